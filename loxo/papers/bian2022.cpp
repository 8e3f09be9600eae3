// SPDX-License-Identifier: Apache-2.0
// Bian et al. 2022: recorded inertial data moved to the pole, and what the reference's errors do to
// the conversion. Everything by sim/polar_transfer and sim/transfer_error; the proof by navigating.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "loxo/ins/strapdown.hpp"
#include "loxo/num/units.hpp"
#include "loxo/papers/reproduce.hpp"
#include "loxo/sim/polar_mover.hpp"
#include "loxo/sim/trajectory.hpp"
#include "loxo/sim/transfer_error.hpp"
#include "loxo/sim/transfer_voyage.hpp"
#include "loxo/study/campaign_pool.hpp"

namespace loxo::papers {
namespace {

constexpr Claim kClaims[] = {
#include "loxo/papers/bian2022.inc"
};

using V = Vec<Body, double>;
double part(const V& v, int i) { return i == 0 ? v.x : i == 1 ? v.y : v.z; }

void table1(Book& book, Paper& paper) {
  report::Series f;
  f.title = "A and B over the latitude of the test";
  f.caption =
      "(14) for four centre latitudes (Table 1), over the 15 degrees the paper allows a test. "
      "Within "
      "a test neither is constant: A changes by up to a third (B3).";
  f.x = {"latitude", "deg"};
  f.y = {"A (negative), B (positive)", ""};
  for (const int centre : {0, 15, 30, 45}) {
    const double angle = (90 - centre) * deg;
    const auto at = [&](double lat) { return transfer_ab((90 - lat) * deg, angle); };
    const double high = centre + 7.5, low = centre - 7.5;
    for (const int edge : {0, 1}) {
      const AB ab = at(edge == 0 ? high : low);
      book.add(fmt::format("T1-A-{}-{}", centre, edge), ab.A);
      book.add(fmt::format("T1-B-{}-{}", centre, edge), ab.B);
    }
    const AB mid = at(centre);
    book.add(fmt::format("T1-R-{}", centre), mid.A * mid.A + mid.B * mid.B);
    book.add(fmt::format("T1-C-{}", centre),
             std::max(std::fabs(at(high).A / mid.A - 1), std::fabs(at(low).A / mid.A - 1)));
    report::Curve a, b;
    a.name = fmt::format("A, centre {} deg", centre);
    b.name = fmt::format("B, centre {} deg", centre);
    b.style = report::Style::kDashed;
    for (double lat = low; lat <= high + 1e-9; lat += 0.5) {
      a.x.push_back(lat), b.x.push_back(lat);
      a.y.push_back(at(lat).A), b.y.push_back(at(lat).B);
    }
    f.curves.push_back(a);
    f.curves.push_back(b);
  }
  for (double lat = -7.5; lat <= 52.5; lat += 0.5) f.at.push_back(lat);
  paper.figures.push_back({"table1", f});
}

// The paper's own voyage is not published: polar.md 9.2 has one like it.
const TransferVoyage kVoyage;
const double kLon0 = kVoyage.lon0, kAngle = kVoyage.angle;

struct Extremes {
  double x = 0, y = 0, z = 0, norm_max = 0;
  void add(const V& v) {
    x = std::max(x, std::fabs(v.x));
    y = std::max(y, std::fabs(v.y));
    z = std::max(z, std::fabs(v.z));
    norm_max = std::max(norm_max, norm(v));
  }
  double any() const { return std::max({x, y, z}); }
};

// Three components over time, red, green and blue in the paper.
struct Trace {
  std::vector<V> v;
};
report::Series traces(const char* title, const char* caption, const report::Axis& y,
                      const std::vector<double>& hours,
                      const std::vector<std::pair<const char*, const Trace*>>& list) {
  report::Series f;
  f.title = title;
  f.caption = caption;
  f.x = {"time", "h", false, 0, 11.6};
  f.y = y;
  f.half = true;
  f.sync = "voyage";
  f.at = hours;
  const char* axis[3] = {"x", "y", "z"};
  // The paper's red, green and blue; the simplified formula paler neighbours of them.
  const int colour[3] = {7, 2, 0}, other[3] = {3, 6, 4};
  for (const auto& [name, trace] : list)
    for (int i = 0; i < 3; ++i) {
      report::Curve c;
      c.name = name[0] == '\0' ? std::string(axis[i]) : fmt::format("{} {}", axis[i], name);
      c.style = trace == list.front().second ? report::Style::kLine : report::Style::kDashed;
      c.colour = trace == list.front().second ? colour[i] : other[i];
      for (const V& v : trace->v) c.y.push_back(part(v, i));
      f.curves.push_back(c);
    }
  return f;
}

void figure3(const std::vector<VoyagePoint>& points, const std::vector<double>& hours,
             std::size_t every, Paper& paper) {
  report::Map map;
  map.title = "Figure 3: where the transfer takes the voyage";
  map.caption =
      "11.6 h off 31 N; turned by 1.029 rad about the transverse axis, the meridian 122.9 E being "
      "the "
      "transverse equator, it lies around the pole. The paper's own voyage is not published.";
  report::Track home, moved;
  home.name = "recorded";
  moved.name = "moved";
  report::Series v, a;
  v.title = "Figure 3: velocity";
  v.x = a.x = {"time", "h", false, 0, 11.6};
  v.y = {"velocity", "m/s"};
  v.half = a.half = true;
  v.sync = a.sync = "voyage";
  a.title = "Figure 3: attitude";
  a.y = {"angle", "deg"};
  v.at = a.at = hours;
  v.caption = "Transverse components.";
  a.caption =
      "Roll and pitch of a ship in waves, and the transverse heading, a twentieth of it: its turns "
      "are "
      "the steps of figures 4 to 7.";
  report::Curve ve, vn, heading, pitch, roll;
  ve.name = "transverse east", vn.name = "transverse north";
  heading.name = "heading / 20", pitch.name = "pitch", roll.name = "roll";
  for (std::size_t i = 0; i < points.size(); i += every) {
    const auto& p = points[i];
    home.lat.push_back(p.lat), home.lon.push_back(p.lon);
    const auto to = from_transverse(p.p.tlat, p.p.tlon - kAngle, kLon0);
    moved.lat.push_back(to.lat), moved.lon.push_back(to.lon);
    ve.y.push_back(p.p.ve), vn.y.push_back(p.p.vn);
    heading.y.push_back(wrap_pi(p.p.heading) / deg / 20);
    pitch.y.push_back(p.p.pitch / deg), roll.y.push_back(p.p.roll / deg);
  }
  map.tracks = {moved};
  paper.figures.push_back({"figure3-moved", map});
  map.title = "Figure 3: the voyage as recorded";
  map.caption = "11.6 h off 31 N, 122.7 E (polar.md 9.2). The paper's own voyage is not published.";
  map.tracks = {home};
  paper.figures.push_back({"figure3-recorded", map});
  v.curves = {ve, vn};
  a.curves = {roll, pitch, heading};
  paper.figures.push_back({"figure3-velocity", v});
  paper.figures.push_back({"figure3-attitude", a});
}

void voyage(const Ellipsoid& earth, const Options& o, Book& book, Paper& paper) {
  const Ellipsoid ball = o.model.of(make_sphere(6371000.0));
  const auto points = sail(earth, kVoyage, 1, false), level = sail(earth, kVoyage, 1, true);
  double lmin = 1e9, lmax = -1e9;
  for (const auto& at : points) {
    lmin = std::min(lmin, at.p.tlon);
    lmax = std::max(lmax, at.p.tlon);
  }
  TransferPoint mid;
  mid.tlon = 0.5 * (lmin + lmax);
  mid.angle = kAngle;
  set_gravity(earth, mid);
  const AB ab = transfer_ab(mid.tlon, kAngle);
  const double G = mid.gm - mid.g, w = earth.w_ie;
  book.add("BV-DG", G);
  book.add("BV-A", ab.A);
  book.add("BV-B", ab.B);

  Extremes df, dw, theory_f, theory_w, full_f, full_f0, full_ell, full_sph, simple_f, simple_w,
      ell_w;
  double path_v = 0, path_f = 0;
  Vec<Transverse, double> last{};
  bool has_last = false;
  const std::size_t every = 9;  // s, of what is drawn: incommensurate with the waves
  std::vector<double> hours;
  Trace th_f, th_w, f7_full_f, f7_full_w, f7_simple_f, f7_simple_w;
  // Coefficients: VE, VN, PhiE, PhiN, PhiU; full and simplified, force and rate.
  Trace full[2][5], simple[2][5];
  double coefficient_apart = 0, largest[2] = {0, 0};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& at = points[i];
    const auto e = voyage_reference_error(earth, kVoyage, at, true),
               e0 = voyage_reference_error(earth, kVoyage, at, false);
    const auto c = convert(earth, at.p), cs = convert(ball, at.p);
    df.add(c.df);
    dw.add(c.dw);
    ell_w.add(c.dw - cs.dw);
    const auto d = conversion_error(earth, at.p, e), d0 = conversion_error(earth, at.p, e0);
    theory_f.add(d.df);
    theory_w.add(d.dw);
    const auto f = conversion_error_full(ball, at.p, e);  // (9), (10)
    full_f.add(f.df - d.df);
    full_f0.add(f.df - d0.df);
    full_ell.add(f.dw - d.dw);
    full_sph.add(f.dw - conversion_error(ball, at.p, e).dw);
    const auto phi = attitude_error_vector(at.p, e);
    const auto k = error_coefficients(ab.A, ab.B, w, G, at.p.heading);
    const V sf = k.F_ve * e.ve + k.F_vn * e.vn + k.F_pe * phi.x + k.F_pn * phi.y,
            sw = k.W_pe * phi.x + k.W_pn * phi.y + k.W_pu * phi.z;
    simple_f.add(sf - d.df);
    simple_w.add(sw - d.dw);
    const PolarMove move{earth, kLon0, kAngle, Keep::kPath};
    const TransverseState<double> home{at.p.tlat, at.p.tlon, 0.0, {at.p.ve, at.p.vn, 0.0}, {}};
    const auto kept = move_state(move, home).v - home.v;
    path_v = std::max(path_v, norm(kept) / norm(home.v));
    if (has_last) path_f = std::max(path_f, norm(kept - last));
    last = kept;
    has_last = true;
    if (i % every != 0) continue;
    hours.push_back(at.t / 3600);
    th_f.v.push_back(d.df), th_w.v.push_back(d.dw);
    f7_full_f.v.push_back(f.df - d.df), f7_full_w.v.push_back(f.dw - d.dw);
    f7_simple_f.v.push_back(sf - d.df), f7_simple_w.v.push_back(sw - d.dw);

    // Columns of (9), (10) for unit errors: those of Phi from unit errors of heading, pitch, roll.
    const double unit = 1e-6;
    Eigen::Matrix3d M;
    ReferenceError euler[3];
    euler[0].heading = euler[1].pitch = euler[2].roll = unit;
    Conversion<double> by_euler[3];
    for (int j = 0; j < 3; ++j) {
      const auto column = attitude_error_vector(at.p, euler[j]);
      M.col(j) << column.x / unit, column.y / unit, column.z / unit;
      by_euler[j] = conversion_error_full(ball, at.p, euler[j]);
    }
    const Eigen::Matrix3d inverse = M.inverse();
    for (int j = 0; j < 5; ++j) {
      V force{}, rate{};
      if (j < 2) {
        ReferenceError v;
        (j == 0 ? v.ve : v.vn) = unit;
        const auto x = conversion_error_full(ball, at.p, v);
        force = x.df * (1 / unit), rate = x.dw * (1 / unit);
      } else {
        for (int m = 0; m < 3; ++m) {
          force = force + by_euler[m].df * (inverse(m, j - 2) / unit);
          rate = rate + by_euler[m].dw * (inverse(m, j - 2) / unit);
        }
      }
      const V zero{};
      const V s_force = j == 0   ? k.F_ve
                        : j == 1 ? k.F_vn
                        : j == 2 ? k.F_pe
                        : j == 3 ? k.F_pn
                                 : zero;
      const V s_rate = j == 2 ? k.W_pe : j == 3 ? k.W_pn : j == 4 ? k.W_pu : zero;
      full[0][j].v.push_back(force), simple[0][j].v.push_back(s_force);
      full[1][j].v.push_back(rate), simple[1][j].v.push_back(s_rate);
      const double amplitude_f = j < 2 ? 2 * std::fabs(ab.A) * w : G,
                   amplitude_w = j == 4 ? ab.B * w : std::fabs(ab.A) * w;
      if (j < 4)
        largest[0] = std::max(
            {largest[0], std::fabs(s_force.x) / amplitude_f, std::fabs(s_force.y) / amplitude_f});
      if (j >= 2)
        largest[1] = std::max(
            {largest[1], std::fabs(s_rate.x) / amplitude_w, std::fabs(s_rate.y) / amplitude_w});
      if (j < 4)
        coefficient_apart = std::max(coefficient_apart, norm(force - s_force) / amplitude_f);
      if (j >= 2)
        coefficient_apart = std::max(coefficient_apart, norm(rate - s_rate) / amplitude_w);
    }
  }
  Extremes flat_f, flat_w, flat_tf, flat_tw;
  for (const auto& at : level) {
    const auto e = voyage_reference_error(earth, kVoyage, at, true);
    const auto d = conversion_error(earth, at.p, e);
    const auto phi = attitude_error_vector(at.p, e);
    const auto k = error_coefficients(ab.A, ab.B, w, G, at.p.heading);
    flat_tf.add(d.df);
    flat_tw.add(d.dw);
    flat_f.add(k.F_ve * e.ve + k.F_vn * e.vn + k.F_pe * phi.x + k.F_pn * phi.y - d.df);
    flat_w.add(k.W_pe * phi.x + k.W_pn * phi.y + k.W_pu * phi.z - d.dw);
  }
  book.add("BV-DF-MAX", df.z);
  book.add("BV-DW-MAX", dw.any());
  book.add("BV-TH-F", theory_f.x);
  book.add("BV-TH-FY", theory_f.y);
  book.add("BV-TH-FZ", theory_f.z);
  book.add("BV-TH-W", theory_w.any());
  book.add("BV-TH-WZ", theory_w.z);
  book.add("BV-FULL-F", full_f.any());
  book.add("BV-FULL-F0", full_f0.any());
  book.add("BV-FULL-W-SPH", full_sph.any());
  book.add("BV-FULL-W-ELL", full_ell.any());
  book.add("BV-FULL-RF", full_f.norm_max / theory_f.norm_max);
  book.add("BV-FULL-RW", full_ell.norm_max / theory_w.norm_max);
  book.add("BV-SIMP-F", simple_f.any());
  book.add("BV-SIMP-W", simple_w.any());
  book.add("BV-SIMP-R0", flat_f.norm_max / flat_tf.norm_max);
  book.add("BV-SIMP-R0W", flat_w.norm_max / flat_tw.norm_max);
  book.add("BV-SIMP-RF", simple_f.norm_max / theory_f.norm_max);
  book.add("BV-SIMP-RW", simple_w.norm_max / theory_w.norm_max);
  book.add("BV-SIMP-RZ", simple_w.z / theory_w.z);
  book.add("BV-ELL-W", ell_w.any());
  book.add("BV-PATH-V", path_v);
  book.add("BV-PATH-F", path_f);
  book.add("BV-COEFF-F", largest[0]);
  book.add("BV-COEFF-W", largest[1]);
  book.add("BV-COEFF-FULL", coefficient_apart);
  paper.numbers["ellipsoid-deg-h"] = ell_w.any() / deg_per_h;

  figure3(points, hours, every, paper);
  const char* names[5] = {"velocity east", "velocity north", "PhiE", "PhiN", "PhiU"};
  const char* ids[5] = {"ve", "vn", "phie", "phin", "phiu"};
  for (int j = 0; j < 5; ++j)
    paper.figures.push_back(
        {std::string("figure4-") + ids[j],
         traces(fmt::format("Figure 4: accelerometer, error of {}", names[j]).c_str(),
                "Coefficient of the conversion error, three body axes: full formula (9), and the "
                "simplified (17), which is flat where the full one follows the ship's rolling.",
                {"coefficient", j < 2 ? "1/s" : "m/s^2"}, hours,
                {{"full", &full[0][j]}, {"simplified", &simple[0][j]}})});
  for (int j = 2; j < 5; ++j)
    paper.figures.push_back(
        {std::string("figure5-") + ids[j],
         traces(fmt::format("Figure 5: gyro, error of {}", names[j]).c_str(),
                "Coefficient of the conversion error, three body axes: full formula (10), and the "
                "simplified (18). Velocity errors do not reach the gyro (on the sphere).",
                {"coefficient", "1/s"}, hours,
                {{"full", &full[1][j]}, {"simplified", &simple[1][j]}})});
  paper.figures.push_back(
      {"figure6-accelerometer",
       traces(
           "Figure 6: conversion error by definition, accelerometer",
           "1' of pitch and roll, 3' of heading, 0.1 and -0.1 m/s, 5 m east and north; ellipsoid. "
           "The largest is about 2e-5, as the paper says.",
           {"error", "m/s^2"}, hours, {{"", &th_f}})});
  paper.figures.push_back({"figure6-gyro", traces("Figure 6: conversion error by definition, gyro",
                                                  "Below 1e-7 rad/s, as the paper says.",
                                                  {"error", "rad/s"}, hours, {{"", &th_w}})});
  paper.figures.push_back(
      {"figure7-full-accelerometer",
       traces("Figure 7: full formula minus definition, accelerometer",
              "Of the order of 1e-8: what is left is the position error and the second order.",
              {"difference", "m/s^2"}, hours, {{"", &f7_full_f}})});
  paper.figures.push_back(
      {"figure7-full-gyro",
       traces("Figure 7: full formula minus definition, gyro",
              "With the ellipsoid's transport rate in the definition 1.6e-10, not 1e-11 (B4).",
              {"difference", "rad/s"}, hours, {{"", &f7_full_w}})});
  paper.figures.push_back(
      {"figure7-simplified-accelerometer",
       traces("Figure 7: simplified formula minus definition, accelerometer",
              "Of the order of 1e-6, swinging with the ship's rolling that it leaves out.",
              {"difference", "m/s^2"}, hours, {{"", &f7_simple_f}})});
  paper.figures.push_back(
      {"figure7-simplified-gyro",
       traces("Figure 7: simplified formula minus definition, gyro",
              "Below 1e-8. A tenth of the error's size, but a fifth of the z component (B6).",
              {"difference", "rad/s"}, hours, {{"", &f7_simple_w}})});
}

// A voyage recorded at 100 Hz, converted with its own reference and navigated at the pole.
void closure(const Ellipsoid& earth, const Options& o, Book& book) {
  Trajectory tr;
  tr.ellipsoid = earth;
  tr.start = {30.9 * deg, 122.7 * deg, 0};
  tr.course = 20 * deg;
  tr.speed = 6;
  const double duration = o.brief ? 600 : 6000;
  tr.legs = {{2000, 7, 0, true},
             {200, 7.5, 55 * deg, true},
             {1800, 7.5, 0, true},
             {200, 6, 65 * deg, true},
             {1800, 5, 0, true}};
  tr.waves = {{WaveAxis::kRoll, 4 * deg, 9.3, 0.1},
              {WaveAxis::kRoll, 1.5 * deg, 13.7, 1.4},
              {WaveAxis::kPitch, 1.5 * deg, 6.7, 0.9},
              {WaveAxis::kYaw, 1 * deg, 17.3, 0.3}};
  const auto model = make_earth_model(earth, kLon0);
  TrajectoryWalk walk(tr), reference(tr);
  const auto pose = [](const Truth& t) {
    return ReferenceEpoch{t.t, {t.state.r, t.state.v, to_matrix(t.state.q_eb)}};
  };
  // The reference at 50 Hz, its last epoch at the end of the log.
  long epoch = -1;
  const long epochs = std::lround(duration * 50);
  State<TransverseMechanization, double> x;
  TransverseState<double> last_moved;
  std::vector<ImuIncrement<double>> moved;
  bool started = false;
  PolarMover mover(
      PolarMove{earth, kLon0, kAngle, Keep::kPath},
      [&]() -> std::optional<ReferenceEpoch> {
        if (++epoch > epochs) return std::nullopt;
        if (epoch > 0) reference.to(double(epoch) / 50);
        return pose(reference.truth());
      },
      10, [&](const MovedSample& s) { moved.push_back(s.imu); },
      [&](double, const TransverseState<double>&, const TransverseState<double>& m) {
        if (!started) {
          const auto p = to_ecef_pose(earth, kLon0, m);
          x = TransverseMechanization::from_ecef(
              model, EcefState<double>{p.r, p.v, to_quaternion(p.C_eb)});
          started = true;
        }
        last_moved = m;
      });
  const long n = std::lround(duration * 100);
  for (long i = 1; i <= n; ++i) mover.add(walk.to(double(i) / 100));
  mover.finish();
  for (std::size_t i = 0; i + 1 < moved.size(); i += 2)
    x = constrained(step(model, x, two_samples(moved[i], moved[i + 1])), 0.0, 0.0);
  const auto end = to_ecef_pose(earth, kLon0, last_moved);
  const auto ours = TransverseMechanization::to_ecef(model, x);
  const auto d = conjugate(ours.q_eb) * to_quaternion(end.C_eb);
  book.add("NAV-CLOSE", norm(ours.r - end.r));
  book.add("NAV-CLOSE/attitude", 2 * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) / arcsec);
}

constexpr const char* kPage = R"md(## bian2022: Bian et al., testing at the pole without going there

*Bian H., Wen Z., Ma H., Wang R., simplification and analysis of the IMU conversion error formula for the inertial navigation polar
simulation test, Acta Geodaetica et Cartographica Sinica 51(9), 2022 (in Chinese).*

**Question.** Few can take a ship to the pole to test its inertial system. Convert the inertial data recorded at home so that the same
unit, with its own errors, sails the same voyage at the pole: how much do the errors of the reference that the conversion needs spoil it?

**Method.** The voyage is turned about the transverse axis; the conversion adds the change of the Earth's rate and of gravity to the
recorded rates (3). Its error to first order is the full formula (9), (10); for a ship without roll and pitch it becomes the simplified
(12), (13), with the coefficients A and B of Table 1.

**What holds.** All 16 entries of Table 1. On a voyage like the paper's the conversion error is at most {{BV-TH-F:.1e}} m/s^2 and
{{BV-TH-W:.1e}} rad/s (printed: about 2e-5, below 1e-7); the full formula misses it by {{BV-FULL-F:.0e}} m/s^2 (printed: 1e-8), the
simplified one by {{BV-SIMP-F:.1e}} m/s^2 and {{BV-SIMP-W:.1e}} rad/s (printed: 1e-6, below 1e-8), {{BV-SIMP-RF:.3f}} and
{{BV-SIMP-RW:.3f}} of the vector's size (printed: about a tenth). A ship that does not roll would see {{BV-SIMP-R0:.3f}} and
{{BV-SIMP-R0W:.4f}}.

**What does not.** "A and B constant in a test": A changes by {{T1-C-0:.2f}} to {{T1-C-45:.2f}} over the paper's own 15 degrees (B3).
"Better than 1 per mille" for the full formula: {{BV-FULL-RF:.1e}} and {{BV-FULL-RW:.1e}} with the paper's position error of 5 m (B5). "A
tenth" for each axis: the gyro's z component errs by {{BV-SIMP-RZ:.2f}} (B6). And "sphere or ellipsoid makes little difference" (B7): it is
{{BV-ELL-W:.1e}} rad/s = {{ellipsoid-deg-h:.4f}} deg/h in the converted gyro, more than a good gyro drifts; keeping path and velocity
both, as on a sphere, changes the velocity by {{BV-PATH-V:.4f}} of itself and costs {{BV-PATH-F:.1e}} m/s^2 in turns.

**What loxo does instead.** The conversion exactly on the ellipsoid, path or velocity kept, and never both (`loxo transfer`); the full
formula with what the ellipsoid adds, as an equivalent sensor error with a verdict (`loxo transfer budget`, `plan`); and the proof by
navigating: 6000 s of converted 100 Hz data come back to the moved reference within 5 cm and 0.002".
)md";

}  // namespace

Paper bian2022(const Options& o) {
  Paper paper;
  paper.name = "bian2022";
  paper.title = "testing at the pole without going there";
  paper.reference =
      "Bian, Wen, Ma and Wang 2022: simplification and analysis of the IMU conversion error "
      "formula "
      "for the polar simulation test (in Chinese). WGS84; voyage of the specification.";
  Book book(paper, kClaims);
  const Ellipsoid earth = o.model.of(wgs84());
  table1(book, paper);
  if (o.progress) o.progress(0.02);
  voyage(earth, o, book, paper);
  if (o.progress) o.progress(0.4);
  closure(earth, o, book);
  book.close(kPage);
  if (o.progress) o.progress(1);
  return paper;
}

}  // namespace loxo::papers
