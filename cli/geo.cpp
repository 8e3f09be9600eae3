// SPDX-License-Identifier: Apache-2.0
// `loxo geo OP`: geodesy on CSV tables.
#include <cmath>
#include <memory>

#include "cli/command.hpp"
#include "cli/table.hpp"
#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodesic.hpp"
#include "loxo/earth/projection.hpp"
#include "loxo/earth/transverse.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/nearest.hpp"

namespace loxo::cli {
namespace {

using In = std::span<const double>;
using Out = std::span<double>;

struct Options {
  std::string file = "-";
  std::string ellipsoid = "WGS84";
  std::string earth = "ellipsoid";
  std::string meridian = "0deg";
  std::string central_meridian = "0deg";
  std::string false_easting = "500000m";
  std::string series = "exact";
  std::string hemisphere = "north";
};

// One of a few words, or Error(kUsage) with the nearest.
void one_of(const std::string& word, const std::vector<std::string>& words,
            const std::string& option) {
  for (const auto& w : words)
    if (w == word) return;
  throw Error(ErrorKind::kUsage, "unknown value '" + word + "'" + suggestion(word, words), option);
}

Ellipsoid the_earth(const Options& o) {
  one_of(o.earth, {"ellipsoid", "sphere"}, "--earth");
  if (o.earth == "sphere") return paper_sphere();
  try {
    return ellipsoid_by_name(o.ellipsoid);
  } catch (const Error& e) {
    throw Error(ErrorKind::kUsage, e.what(), "--ellipsoid");
  }
}

double to_360(double rad) {
  const double d = wrap_2pi(rad) / deg;
  return d >= 360.0 ? 0.0 : d;
}

// The first complaint of a few.
std::string first_of(std::initializer_list<std::string> list) {
  for (const auto& s : list)
    if (!s.empty()) return s;
  return {};
}

TableJob rhumb_inverse_job(const Ellipsoid& ell) {
  return {{"lat1_deg", "lon1_deg", "lat2_deg", "lon2_deg"},
          {"azimuth_deg", "distance_m"},
          [ell](In in, Out out) {
            const auto bad =
                first_of({bad_latitude("lat1_deg", in[0]), bad_longitude("lon1_deg", in[1]),
                          bad_latitude("lat2_deg", in[2]), bad_longitude("lon2_deg", in[3])});
            if (!bad.empty()) return bad;
            const auto r = rhumb_inverse_degrees(ell, in[0], in[1], in[2], in[3]);
            out[0] = r.azimuth;
            out[1] = r.distance;
            return std::string();
          }};
}

TableJob rhumb_direct_job(const Ellipsoid& ell) {
  return {
      {"lat1_deg", "lon1_deg", "azimuth_deg", "distance_m"},
      {"lat2_deg", "lon2_deg"},
      [ell](In in, Out out) {
        auto bad = first_of({bad_latitude("lat1_deg", in[0]), bad_longitude("lon1_deg", in[1])});
        if (!bad.empty()) return bad;
        if (std::fabs(in[2]) > 720.0)
          return std::string("azimuth_deg: expected an azimuth within 0 to 360");
        const auto r = rhumb_direct_degrees(ell, in[0], in[1], in[2], in[3]);
        if (std::isnan(r.lat) || std::isnan(r.lon))
          return std::string("the line reaches a pole before its end: no longitude there");
        out[0] = r.lat;
        out[1] = r.lon;
        return std::string();
      }};
}

TableJob geodesic_inverse_job(const Ellipsoid& ell) {
  return {{"lat1_deg", "lon1_deg", "lat2_deg", "lon2_deg"},
          {"azimuth_deg", "distance_m", "azimuth2_deg"},
          [ell](In in, Out out) {
            const auto bad =
                first_of({bad_latitude("lat1_deg", in[0]), bad_longitude("lon1_deg", in[1]),
                          bad_latitude("lat2_deg", in[2]), bad_longitude("lon2_deg", in[3])});
            if (!bad.empty()) return bad;
            const auto r =
                geodesic_inverse(ell, in[0] * deg, in[1] * deg, in[2] * deg, in[3] * deg);
            out[0] = to_360(r.azimuth1);
            out[1] = r.distance;
            out[2] = to_360(r.azimuth2);
            return std::string();
          }};
}

TableJob geodesic_direct_job(const Ellipsoid& ell) {
  return {{"lat1_deg", "lon1_deg", "azimuth_deg", "distance_m"},
          {"lat2_deg", "lon2_deg", "azimuth2_deg"},
          [ell](In in, Out out) {
            const auto bad =
                first_of({bad_latitude("lat1_deg", in[0]), bad_longitude("lon1_deg", in[1])});
            if (!bad.empty()) return bad;
            const auto r = geodesic_direct(ell, in[0] * deg, in[1] * deg, in[2] * deg, in[3]);
            out[0] = r.lat / deg;
            out[1] = r.lon / deg;
            out[2] = to_360(r.azimuth2);
            return std::string();
          }};
}

// Both ways: position, and velocity and heading where the table has them. Directions go through the
// axes of both frames, which mean something at the geographic and at the transverse poles too.
TableJob transverse_job(const TableHeader& header, double lon0, bool forward) {
  const std::vector<std::string> geographic = {"lat_deg", "lon_deg", "ve_mps", "vn_mps",
                                               "heading_deg"};
  const std::vector<std::string> transverse = {"tlat_deg", "tlon_deg", "vte_mps", "vtn_mps",
                                               "theading_deg"};
  const auto& from = forward ? geographic : transverse;
  const auto& to = forward ? transverse : geographic;
  TableJob job;
  job.inputs = {from[0], from[1]};
  job.outputs = {to[0], to[1]};
  // One velocity component alone is a missing column, named as such.
  const bool velocity = header.has(from[2]) || header.has(from[3]);
  const bool heading = header.has(from[4]);
  if (velocity) {
    job.inputs.insert(job.inputs.end(), {from[2], from[3]});
    job.outputs.insert(job.outputs.end(), {to[2], to[3]});
  }
  if (heading) {
    job.inputs.push_back(from[4]);
    job.outputs.push_back(to[4]);
  }
  const std::string lat_name = from[0], lon_name = from[1];
  job.row = [=](In in, Out out) {
    const auto bad =
        first_of({bad_latitude(lat_name.c_str(), in[0]), bad_longitude(lon_name.c_str(), in[1])});
    if (!bad.empty()) return bad;
    double lat = 0, lon = 0, tlat = 0, tlon = 0;
    if (forward) {
      lat = in[0] * deg;
      lon = in[1] * deg;
      const auto t = to_transverse(lat, lon, lon0);
      tlat = t.tlat;
      tlon = t.tlon;
    } else {
      tlat = in[0] * deg;
      tlon = in[1] * deg;
      const auto g = from_transverse(tlat, tlon, lon0);
      lat = g.lat;
      lon = g.lon;
    }
    out[0] = (forward ? tlat : lat) / deg;
    out[1] = (forward ? tlon : lon) / deg;
    const auto C_gt = geographic_axes(lat, lon) * transpose(transverse_axes(tlat, tlon, lon0));
    if (velocity) {
      const double e = in[2], n = in[3];
      out[2] = forward ? C_gt.m[0][0] * e + C_gt.m[1][0] * n : C_gt.m[0][0] * e + C_gt.m[0][1] * n;
      out[3] = forward ? C_gt.m[0][1] * e + C_gt.m[1][1] * n : C_gt.m[1][0] * e + C_gt.m[1][1] * n;
    }
    if (heading) {
      const double sigma = std::atan2(C_gt.m[0][1], C_gt.m[1][1]);  // polar.md 1.2
      const std::size_t i = velocity ? 4 : 2;
      out[i] = to_360(in[i] * deg + (forward ? -sigma : sigma));
    }
    return std::string();
  };
  return job;
}

// Where the next term of the Krueger series would be 1e-6 m, the answer is no longer exact to speak
// of.
bool too_far(const Ellipsoid& ell, double eta) {
  return std::fabs(ell.mu_of_chi.c[8]) * ell.n * std::exp(18.0 * std::fabs(eta)) * ell.a > 1e-6;
}
const char* const kTooFar = "too far from the central meridian for the projection";

TableJob gauss_forward_job(const Ellipsoid& ell, double lon0, double false_easting, bool paper) {
  return {{"lat_deg", "lon_deg"}, {"x_m", "y_m"}, [=](In in, Out out) {
            const auto bad =
                first_of({bad_latitude("lat_deg", in[0]), bad_longitude("lon_deg", in[1])});
            if (!bad.empty()) return bad;
            const double lat = in[0] * deg, dlon = wrap_pi(in[1] * deg - lon0);
            if (too_far(ell, std::atanh(std::cos(lat) * std::sin(dlon))))
              return std::string(kTooFar);
            const auto exact = gauss_forward(ell, lat, dlon, 0.0, false_easting);
            const auto r = paper ? gauss_forward_paper(ell, lat, dlon, 0.0, false_easting) : exact;
            // A truncated series says nothing far away.
            if (std::hypot(r.x - exact.x, r.y - exact.y) > 100.0)
              return std::string(
                  "the papers' series is more than 100 m wrong here; use --series exact");
            out[0] = r.x;
            out[1] = r.y;
            return std::string();
          }};
}

TableJob gauss_inverse_job(const Ellipsoid& ell, double lon0, double false_easting, bool paper) {
  return {{"x_m", "y_m"}, {"lat_deg", "lon_deg"}, [=](In in, Out out) {
            if (std::fabs(in[0]) > 2.0 * ell.quarter_meridian ||
                too_far(ell, (in[1] - false_easting) / ell.a))
              return std::string(kTooFar);
            const auto r = paper ? gauss_inverse_paper(ell, in[0], in[1], lon0, false_easting)
                                 : gauss_inverse(ell, in[0], in[1], lon0, false_easting);
            out[0] = r.lat / deg;
            out[1] = r.lon / deg;
            return std::string();
          }};
}

TableJob to_ecef_job(const TableHeader& header, const Ellipsoid& ell) {
  TableJob job{{"lat_deg", "lon_deg"}, {"x_m", "y_m", "z_m"}, {}};
  const bool height = header.has("h_m");
  if (height) job.inputs.push_back("h_m");
  job.row = [ell, height](In in, Out out) {
    const auto bad = first_of({bad_latitude("lat_deg", in[0]), bad_longitude("lon_deg", in[1])});
    if (!bad.empty()) return bad;
    const auto r = to_ecef(ell, Geodetic<double>{in[0] * deg, in[1] * deg, height ? in[2] : 0.0});
    out[0] = r.x;
    out[1] = r.y;
    out[2] = r.z;
    return std::string();
  };
  return job;
}

TableJob from_ecef_job(const Ellipsoid& ell) {
  return {{"x_m", "y_m", "z_m"}, {"lat_deg", "lon_deg", "h_m"}, [ell](In in, Out out) {
            // Within the evolute of the meridian ellipse a point has several normals.
            const double inner = ell.e2 * ell.a * 1.01;
            if (in[0] * in[0] + in[1] * in[1] + in[2] * in[2] < inner * inner)
              return std::string("too near the centre of the Earth: no geodetic coordinates");
            const auto g = to_geodetic(ell, Point<Ecef, double>{in[0], in[1], in[2]});
            out[0] = g.lat / deg;
            out[1] = g.lon / deg;
            out[2] = g.h;
            return std::string();
          }};
}

TableJob stereographic_job(const Ellipsoid& ell, double lon0, bool north, bool forward) {
  if (forward)
    return {{"lat_deg", "lon_deg"}, {"x_m", "y_m"}, [=](In in, Out out) {
              const auto bad =
                  first_of({bad_latitude("lat_deg", in[0]), bad_longitude("lon_deg", in[1])});
              if (!bad.empty()) return bad;
              if (in[0] == (north ? -90.0 : 90.0))
                return std::string("lat_deg: the opposite pole is at infinity");
              const auto r =
                  polar_stereographic_forward(ell, in[0] * deg, in[1] * deg, lon0, north);
              out[0] = r.x;
              out[1] = r.y;
              return std::string();
            }};
  return {{"x_m", "y_m"}, {"lat_deg", "lon_deg"}, [=](In in, Out out) {
            const auto r = polar_stereographic_inverse(ell, in[0], in[1], lon0, north);
            out[0] = r.lat / deg;
            out[1] = r.lon / deg;
            return std::string();
          }};
}

TableJob meridian_arc_job(const Ellipsoid& ell, bool forward) {
  if (forward)
    return {{"lat_deg"}, {"arc_m"}, [ell](In in, Out out) {
              const auto bad = bad_latitude("lat_deg", in[0]);
              if (bad.empty()) out[0] = meridian_arc(ell, in[0] * deg);
              return bad;
            }};
  return {{"arc_m"}, {"lat_deg"}, [ell](In in, Out out) {
            if (std::fabs(in[0]) > ell.quarter_meridian * (1.0 + 1e-15))
              return std::string("arc_m: longer than a quarter meridian");
            out[0] = min(max(latitude_of_arc(ell, in[0]) / deg, -90.0), 90.0);
            return std::string();
          }};
}

}  // namespace

void add_geo(CLI::App& app, Globals& globals) {
  auto o = std::make_shared<Options>();
  CLI::App* geo = add_command(
      app, globals, "geo", "geodesy on CSV tables: rhumb lines, projections, frames",
      "printf 'lat1_deg,lon1_deg,lat2_deg,lon2_deg\\n55,110,60,120\\n' | loxo geo rhumb-inverse",
      []() -> int {
        throw Error(ErrorKind::kUsage, "geo needs an operation; see 'loxo geo --help'");
      });

  using Plan = std::function<TableJob(const TableHeader&)>;
  const auto add = [&](const std::string& name, const std::string& job, const std::string& example,
                       std::function<Plan()> plan) {
    CLI::App* op = add_subcommand(*geo, globals, name, job, example, [name, plan, o, &globals] {
      return run_table(globals, "geo " + name, o->file, plan());
    });
    op->add_option("FILE", o->file, "CSV table; '-' or none: standard input");
    op->add_option("--ellipsoid", o->ellipsoid, "WGS84, GRS80, CGCS2000, Krassovsky, or a=…m,f=…");
    op->add_option("--earth", o->earth, "ellipsoid, or sphere (R 6371000 m)");
    return op;
  };
  const auto meridian = [&](CLI::App* op) {
    op->add_option("--meridian", o->meridian,
                   "reference meridian of the transverse frame, with its unit");
  };
  const auto gauss = [&](CLI::App* op) {
    op->add_option("--central-meridian", o->central_meridian, "central meridian, with its unit");
    op->add_option("--false-easting", o->false_easting, "added to y, with its unit");
    op->add_option("--series", o->series,
                   "exact, or paper: the truncated series of the papers, corrected");
  };
  const auto stereographic = [&](CLI::App* op) {
    op->add_option("--meridian", o->meridian,
                   "meridian that points down (north pole) or up (south pole)");
    op->add_option("--hemisphere", o->hemisphere, "north or south: the pole in the middle");
  };
  const auto lon0 = [o] { return option_quantity(o->meridian, Dimension::kAngle, "--meridian"); };

  add("rhumb-inverse",
      "azimuth and length of the rhumb line between two points (the shorter way in longitude)",
      "printf 'lat1_deg,lon1_deg,lat2_deg,lon2_deg\\n55,110,60,120\\n' | loxo geo rhumb-inverse",
      [o] { return [ell = the_earth(*o)](const TableHeader&) { return rhumb_inverse_job(ell); }; });
  add("rhumb-direct", "end of a rhumb line of given azimuth and length",
      "printf 'lat1_deg,lon1_deg,azimuth_deg,distance_m\\n55,110,45,90000\\n' | loxo geo "
      "rhumb-direct",
      [o] { return [ell = the_earth(*o)](const TableHeader&) { return rhumb_direct_job(ell); }; });
  add("geodesic-inverse", "azimuths and length of the shortest line between two points",
      "printf 'lat1_deg,lon1_deg,lat2_deg,lon2_deg\\n55,110,60,120\\n' | loxo geo geodesic-inverse",
      [o] {
        return [ell = the_earth(*o)](const TableHeader&) { return geodesic_inverse_job(ell); };
      });
  add("geodesic-direct", "end of a geodesic of given initial azimuth and length",
      "printf 'lat1_deg,lon1_deg,azimuth_deg,distance_m\\n55,110,45,90000\\n' | loxo geo "
      "geodesic-direct",
      [o] {
        return [ell = the_earth(*o)](const TableHeader&) { return geodesic_direct_job(ell); };
      });
  meridian(add(
      "to-transverse", "transverse latitude and longitude; velocity and heading where given",
      "printf 'lat_deg,lon_deg\\n89.9,45\\n' | loxo geo to-transverse --meridian 0deg", [o, lon0] {
        the_earth(*o);  // the normals are the same on any Earth, but a wrong name is told
        return [l = lon0()](const TableHeader& h) { return transverse_job(h, l, true); };
      }));
  meridian(
      add("from-transverse", "geodetic latitude and longitude from transverse ones",
          "printf 'tlat_deg,tlon_deg\\n0.07,0.07\\n' | loxo geo from-transverse --meridian 0deg",
          [o, lon0] {
            the_earth(*o);
            return [l = lon0()](const TableHeader& h) { return transverse_job(h, l, false); };
          }));
  const auto gauss_plan = [o](bool forward) {
    one_of(o->series, {"exact", "paper"}, "--series");
    const Ellipsoid ell = the_earth(*o);
    const double l = option_quantity(o->central_meridian, Dimension::kAngle, "--central-meridian");
    const double e = option_quantity(o->false_easting, Dimension::kLength, "--false-easting");
    const bool paper = o->series == "paper";
    return [=](const TableHeader&) {
      return forward ? gauss_forward_job(ell, l, e, paper) : gauss_inverse_job(ell, l, e, paper);
    };
  };
  gauss(add(
      "gauss-forward",
      "Gauss-Krueger plane coordinates (x north, y east), unit scale on the central meridian",
      "printf 'lat_deg,lon_deg\\n40,116.5\\n' | loxo geo gauss-forward --central-meridian 117deg",
      [gauss_plan] { return gauss_plan(true); }));
  gauss(add("gauss-inverse", "latitude and longitude from Gauss-Krueger coordinates",
            "printf 'x_m,y_m\\n4429529.03,457316.5\\n' | loxo geo gauss-inverse --central-meridian "
            "117deg",
            [gauss_plan] { return gauss_plan(false); }));
  add("to-ecef", "Earth-centred coordinates from latitude, longitude and (where given) height",
      "printf 'lat_deg,lon_deg,h_m\\n90,0,100\\n' | loxo geo to-ecef",
      [o] { return [ell = the_earth(*o)](const TableHeader& h) { return to_ecef_job(h, ell); }; });
  add("from-ecef", "latitude, longitude and height from Earth-centred coordinates",
      "printf 'x_m,y_m,z_m\\n0,0,6356752.3\\n' | loxo geo from-ecef",
      [o] { return [ell = the_earth(*o)](const TableHeader&) { return from_ecef_job(ell); }; });
  for (const bool forward : {true, false}) {
    stereographic(
        add(forward ? "stereographic-forward" : "stereographic-inverse",
            forward ? "polar stereographic plane coordinates, unit scale at the pole"
                    : "latitude and longitude from polar stereographic coordinates",
            forward ? "printf 'lat_deg,lon_deg\\n85,30\\n' | loxo geo stereographic-forward"
                    : "printf 'x_m,y_m\\n1e5,2e5\\n' | loxo geo stereographic-inverse",
            [o, lon0, forward] {
              one_of(o->hemisphere, {"north", "south"}, "--hemisphere");
              return [ell = the_earth(*o), l = lon0(), north = o->hemisphere == "north", forward](
                         const TableHeader&) { return stereographic_job(ell, l, north, forward); };
            }));
    add(forward ? "meridian-arc" : "from-meridian-arc",
        forward ? "length of the meridian from the equator"
                : "latitude at a length of the meridian from the equator",
        forward ? "printf 'lat_deg\\n45\\n' | loxo geo meridian-arc"
                : "printf 'arc_m\\n5e6\\n' | loxo geo from-meridian-arc",
        [o, forward] {
          return [ell = the_earth(*o), forward](const TableHeader&) {
            return meridian_arc_job(ell, forward);
          };
        });
  }
}

}  // namespace loxo::cli
