// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/solution_file.hpp"

#include <cmath>
#include <cstdlib>
#include <vector>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo {
namespace {

bool given(double x) { return x == x; }

struct Column {
  const char* name;
  double SolutionRow::*member;
  double unit;
};
constexpr Column kColumns[] = {{"t_s", &SolutionRow::t, 1},
                               {"lat_deg", &SolutionRow::lat, deg},
                               {"lon_deg", &SolutionRow::lon, deg},
                               {"h_m", &SolutionRow::h, 1},
                               {"ve_mps", &SolutionRow::ve, 1},
                               {"vn_mps", &SolutionRow::vn, 1},
                               {"vu_mps", &SolutionRow::vu, 1},
                               {"roll_deg", &SolutionRow::roll, deg},
                               {"pitch_deg", &SolutionRow::pitch, deg},
                               {"heading_deg", &SolutionRow::heading, deg},
                               {"qw", &SolutionRow::qw, 1},
                               {"qx", &SolutionRow::qx, 1},
                               {"qy", &SolutionRow::qy, 1},
                               {"qz", &SolutionRow::qz, 1},
                               {"x_m", &SolutionRow::x, 1},
                               {"y_m", &SolutionRow::y, 1},
                               {"z_m", &SolutionRow::z, 1},
                               {"std_e_m", &SolutionRow::std_e, 1},
                               {"std_n_m", &SolutionRow::std_n, 1},
                               {"std_u_m", &SolutionRow::std_u, 1},
                               {"std_heading_deg", &SolutionRow::std_heading, deg}};

}  // namespace

struct SolutionWriter::Impl {
  OutputFile file;
  int precision;
  std::string line;
  Impl(const std::string& path, int p) : file(path), precision(p) {}
};

SolutionWriter::SolutionWriter(const std::string& path,
                               const std::map<std::string, std::string>& meta, int precision) {
  if (path.size() > 3 && path.rfind(".h5") == path.size() - 3)
    throw Error(ErrorKind::kUsage,
                "the binary form of a solution (.h5) is not built yet; write .csv or .csv.gz",
                path);
  impl_ = std::make_unique<Impl>(path, precision);
  std::string head;
  for (const auto& [key, value] : meta) head += "# " + key + ": " + value + "\n";
  for (const Column& c : kColumns) head += std::string(c.name) + ",";
  impl_->file.write(head + "frame,health\n");
}
SolutionWriter::~SolutionWriter() = default;
void SolutionWriter::write(const SolutionRow& row) {
  std::string& s = impl_->line;
  s.clear();
  for (const Column& c : kColumns) {
    append_number(s, row.*c.member / c.unit, impl_->precision);
    s += ',';
  }
  s += frame_name(row.frame);
  s += ',';
  s += std::to_string(row.health);
  s += '\n';
  impl_->file.write(s);
}
void SolutionWriter::commit() { impl_->file.commit(); }

void complete_row(SolutionRow& r, const Ellipsoid& ell) {
  if (given(r.lat) && given(r.lon)) {
    if (!given(r.x)) {
      const Point<Ecef> p = to_ecef(ell, Geodetic<double>{r.lat, r.lon, given(r.h) ? r.h : 0.0});
      r.x = p.x, r.y = p.y, r.z = p.z;
    }
  } else if (given(r.x) && given(r.y) && given(r.z)) {
    const Geodetic<double> g = to_geodetic(ell, Point<Ecef>{r.x, r.y, r.z});
    r.lat = g.lat, r.lon = g.lon, r.h = g.h;
  }
  if (!given(r.lat)) return;
  const Rot<Geographic, Ecef> C = geographic_axes(r.lat, r.lon);
  if (given(r.qw) && given(r.qx) && !given(r.heading)) {
    const Euler<double> e = to_euler(C * to_matrix(Quat<Ecef, Body>{r.qw, r.qx, r.qy, r.qz}));
    r.heading = e.heading, r.pitch = e.pitch, r.roll = e.roll;
  } else if (given(r.heading) && !given(r.qw)) {
    const Euler<double> e{r.heading, given(r.pitch) ? r.pitch : 0.0, given(r.roll) ? r.roll : 0.0};
    const Quat<Ecef, Body> q = to_quaternion(transpose(C) * to_matrix<Geographic>(e));
    r.qw = q.w, r.qx = q.x, r.qy = q.y, r.qz = q.z;
  }
}

Solution read_solution(const std::string& path, const Ellipsoid& ellipsoid,
                       Diagnostics& diagnostics,
                       const std::map<std::string, std::string>& columns) {
  CsvReader reader(path);
  Solution out;
  out.meta = reader.meta();
  std::vector<std::string> chosen;
  std::vector<std::pair<double SolutionRow::*, double>> to;
  auto take = [&](const std::string& name, double SolutionRow::*member, double unit) {
    if (!reader.has(name)) return false;
    chosen.push_back(name);
    to.emplace_back(member, unit);
    return true;
  };
  for (const Column& c : kColumns) {
    const auto named = columns.find(c.name);
    if (named != columns.end()) {
      if (!reader.has(named->second)) reader.index(named->second);  // tells what is there
      take(named->second, c.member, c.unit);
      continue;
    }
    if (take(c.name, c.member, c.unit)) continue;
    const std::string bare(c.name);
    if (bare == "ve_mps" || bare == "vn_mps" || bare == "vu_mps")
      take(bare.substr(0, 2), c.member, 1);
  }
  if (chosen.empty() || to[0].first != &SolutionRow::t) reader.index("t_s");
  const bool local = !reader.has("lat_deg") && !reader.has("x_m") && reader.has("e_m") &&
                     reader.has("n_m") && !columns.contains("lat_deg");
  if (local) {
    // Local metres: kept as such in x, y, told in the meta.
    take("e_m", &SolutionRow::x, 1);
    take("n_m", &SolutionRow::y, 1);
    out.meta["local"] = "true";
  }
  const bool with_health = reader.has("health"), with_frame = reader.has("frame");
  reader.select(chosen);
  std::vector<double> v(chosen.size());
  std::size_t i_health = with_health ? reader.index("health") : 0,
              i_frame = with_frame ? reader.index("frame") : 0;
  while (reader.next(v, diagnostics)) {
    SolutionRow r;
    for (const Column& c : kColumns) r.*c.member = kNone;
    for (std::size_t i = 0; i < to.size(); ++i) r.*to[i].first = v[i] * to[i].second;
    const auto& cells = reader.cells();
    if (with_health && i_health < cells.size())
      r.health = static_cast<std::uint32_t>(
          std::strtoul(std::string(cells[i_health]).c_str(), nullptr, 10));
    if (with_frame && i_frame < cells.size())
      for (FrameId f : {FrameId::kGeographic, FrameId::kTransverse, FrameId::kGrid,
                        FrameId::kWander, FrameId::kEcef})
        if (frame_name(f) == cells[i_frame]) r.frame = f;
    if (!given(r.t)) {
      diagnostics.bad("bad_row", path + ":" + std::to_string(reader.line()),
                      "expected a time, found nan; row skipped");
      continue;
    }
    if (!out.rows.empty() && !(r.t > out.rows.back().t)) {
      diagnostics.warn("time_back", path + ":" + std::to_string(reader.line()),
                       "a stamp that is not after the last; row skipped");
      continue;
    }
    if (!local) complete_row(r, ellipsoid);
    out.rows.push_back(r);
  }
  if (out.rows.empty()) throw Error(ErrorKind::kInput, "no row could be read", path);
  return out;
}

}  // namespace loxo
