// SPDX-License-Identifier: Apache-2.0
// `loxo transfer rates`: the conversion of single states, and its error, on a table (interface.md).
#include <cmath>

#include "cli/table.hpp"
#include "cli/transfer.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/sim/transfer_error.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

const char* const kAxes[] = {"f_x_mps2",  "f_y_mps2",  "f_z_mps2",
                             "w_x_radps", "w_y_radps", "w_z_radps"};

void put(const Conversion<double>& c, std::span<double> out, std::size_t at) {
  const double v[] = {c.df.x, c.df.y, c.df.z, c.dw.x, c.dw.y, c.dw.z};
  for (std::size_t i = 0; i < 6; ++i) out[at + i] = v[i];
}

std::string bad_place(double tlat, double tlon, double angle) {
  std::string bad = bad_latitude("tlat_deg", tlat);
  if (bad.empty()) bad = bad_longitude("tlon_deg", tlon);
  if (bad.empty() && std::fabs(tlat) == 90.0)
    bad = "tlat_deg: a transverse pole, where east and north are not defined";
  if (bad.empty() && std::fabs(angle) > 360.0)
    bad = "angle_deg: expected an angle within -360 to 360";
  return bad;
}

}  // namespace

int transfer_rates(const Globals& globals, const TransferOptions& o) {
  const std::vector<std::string> earths = {"ellipsoid", "sphere"}, keeps = {"velocity", "path"};
  if (o.earth != "ellipsoid" && o.earth != "sphere")
    throw Error(ErrorKind::kUsage, "unknown value '" + o.earth + "'" + suggestion(o.earth, earths),
                "--earth");
  if (!o.keep.empty() && o.keep != "velocity" && o.keep != "path")
    throw Error(ErrorKind::kUsage, "unknown value '" + o.keep + "'" + suggestion(o.keep, keeps),
                "--keep");
  Ellipsoid earth = paper_sphere();
  if (o.earth == "ellipsoid") {
    try {
      earth = ellipsoid_by_name(o.ellipsoid);
    } catch (const Error& e) {
      throw Error(ErrorKind::kUsage, e.what(), "--ellipsoid");
    }
  }
  // On a sphere path and velocity are kept together.
  const bool path = o.keep == "path" && earth.f > 0;

  return run_table(globals, "transfer rates", o.table, [&](const TableHeader& header) {
    TableJob job;
    job.inputs = {"tlat_deg", "tlon_deg",     "angle_deg", "vte_mps",
                  "vtn_mps",  "theading_deg", "pitch_deg", "roll_deg"};
    for (const char* axis : kAxes) job.outputs.push_back(std::string("d") + axis);
    const auto point = [](std::span<const double> in) {
      TransferPoint p;
      p.tlat = in[0] * deg;
      p.tlon = in[1] * deg;
      p.angle = in[2] * deg;
      p.ve = in[3];
      p.vn = in[4];
      p.heading = in[5] * deg;
      p.pitch = in[6] * deg;
      p.roll = in[7] * deg;
      return p;
    };
    if (path) {
      // The velocity that keeps the path changes at another rate: that needs the recorded force.
      job.inputs.insert(job.inputs.end(), {"fx_mps2", "fy_mps2", "fz_mps2"});
      job.row = [earth, point](std::span<const double> in, std::span<double> out) {
        std::string bad = bad_place(in[0], in[1], in[2]);
        if (!bad.empty()) return bad;
        const TransferPoint p = point(in);
        const TransverseState<double> home{
            p.tlat,
            p.tlon,
            0.0,
            {p.ve, p.vn, 0.0},
            to_matrix<Transverse>(Euler<double>{p.heading, p.pitch, p.roll})};
        put(move_path(PolarMove{earth, 0.0, p.angle, Keep::kPath}, home, {in[8], in[9], in[10]})
                .conversion,
            out, 0);
        return std::string();
      };
      return job;
    }
    job.inputs.insert(job.inputs.end(), {"g_mps2", "gm_mps2"});
    bool errors = false;
    const std::vector<std::string> wrong = {"dheading_deg", "dpitch_deg", "droll_deg", "dvte_mps",
                                            "dvtn_mps"};
    for (const auto& name : wrong) errors = errors || header.has(name);
    if (errors) {
      job.inputs.insert(job.inputs.end(), wrong.begin(), wrong.end());
      for (const char* suffix : {"", "_full", "_simple"})
        for (const char* axis : kAxes) job.outputs.push_back(std::string("dd") + axis + suffix);
    }
    job.row = [earth, point, errors](std::span<const double> in, std::span<double> out) {
      std::string bad = bad_place(in[0], in[1], in[2]);
      if (!bad.empty()) return bad;
      TransferPoint p = point(in);
      p.g = in[8];
      p.gm = in[9];
      put(convert(earth, p), out, 0);
      if (errors) {
        ReferenceError e;
        e.heading = in[10] * deg;
        e.pitch = in[11] * deg;
        e.roll = in[12] * deg;
        e.ve = in[13];
        e.vn = in[14];
        put(conversion_error(earth, p, e), out, 6);
        put(conversion_error_full(earth, p, e), out, 12);
        put(conversion_error_simple(earth, p, e), out, 18);
      }
      return std::string();
    };
    return job;
  });
}

}  // namespace loxo::cli
