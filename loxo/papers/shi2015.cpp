// SPDX-License-Identifier: Apache-2.0
// Shi et al. 2015: the initial calibration of an odometer and its error analysis. The drive by
// sim/straight_drive, the chain by calibrate/odometer_errors, the chords by calibrate/two_point.
#include <fmt/format.h>

#include <cmath>

#include "loxo/calibrate/odometer_errors.hpp"
#include "loxo/calibrate/two_point.hpp"
#include "loxo/earth/projection.hpp"
#include "loxo/num/units.hpp"
#include "loxo/papers/reproduce.hpp"
#include "loxo/sim/straight_drive.hpp"

namespace loxo::papers {
namespace {

constexpr Claim kClaims[] = {
#include "loxo/papers/shi2015.inc"
};

struct Setting {
  Ellipsoid ell;
  double sign = 1, drift = 0.01 * deg_per_h;
  double radius = 6378137, w = 7.292115e-5;  // of the paper's sphere, section 2

  // The loaded scale is 1.2 of the true one, the body stands one degree to the left.
  ReckoningErrors errors() const {
    ReckoningErrors e;
    e.k = 1.2;
    e.eps = -1 * deg;
    return e;
  }
};
struct Found {
  double dk = 0, dalpha = 0;  // of K_D, relative; of alpha [deg]
};
Found calibrated(const Setting& s, const StraightDrive& drive, ChordMethod method,
                 const ReckoningErrors& errors, double meridian = 0) {
  ReckoningErrors driven = errors;
  driven.eps *= s.sign;
  const auto e = simulate_straight_drive(s.ell, drive, driven);
  const auto at = [&](double lat, double lon) {
    return chord(s.ell, method, drive.lat, lat, lon - drive.lon, -meridian);
  };
  const auto r = two_point(at(e.lat2, e.lon2), at(e.lat3, e.lon3));
  return {errors.k / r.k - 1, -wrap_pi(r.eps - errors.eps) / deg};  // K_D = K_0/k, alpha = -eps
}

void tables_one_and_two(const Setting& s, Book& book) {
  const auto f = reckoning_error_matrix(s.radius, s.w, 40 * deg, 14, 14);
  const char* const names[5] = {"phiE", "phiN", "phiU", "dL", "dlam"};
  const double sizes[5] = {0.5 * arcmin, 0.5 * arcmin, 3.6 * arcmin, 10 / s.radius, 0};
  for (std::size_t i = 0; i < 5; ++i)
    for (std::size_t j = 0; j < 5; ++j) {
      if (f[i][j] == 0) continue;
      const std::string id = std::string(names[i]) + "dot<-" + names[j];
      book.add("S1-T1-" + id, std::fabs(f[i][j]));
      book.add("S1-T2-" + id, std::fabs(f[i][j]) * sizes[j]);
    }
  book.add("S1-T2-gyro", s.drift);
}

void tables_three_and_four(const Setting& s, const Options& o, Book& book, Paper& paper) {
  const auto drive = sh15_drive();
  const auto run = [&](const ReckoningErrors& e) {
    return calibrated(s, drive, ChordMethod::kGauss, e);
  };
  const Found base = run(s.errors());
  const auto contribution = [&](const ReckoningErrors& e) {
    const Found f = run(e);
    return Found{f.dk - base.dk, f.dalpha - base.dalpha};
  };
  struct Source {
    const char *id, *words, *printed_alpha;
    ReckoningErrors e;
  };
  std::vector<Source> sources = {{"eps_x", "gyro drift x", "3.002e-5", s.errors()},
                                 {"eps_y", "gyro drift y", "2.944e-5", s.errors()},
                                 {"eps_z", "gyro drift z", "-7.968e-4", s.errors()},
                                 {"phiE0", "initial pitch", "-2.338e-5", s.errors()},
                                 {"phiN0", "initial roll", "1.811e-4", s.errors()},
                                 {"phiU0", "initial heading", "0.0596", s.errors()},
                                 {"all", "all together", "0.0589", s.errors()}};
  sources[0].e.gyro_bias.x = sources[6].e.gyro_bias.x = s.drift;
  sources[1].e.gyro_bias.y = sources[6].e.gyro_bias.y = s.drift;
  sources[2].e.gyro_bias.z = sources[6].e.gyro_bias.z = s.drift;
  sources[3].e.phi_e = sources[6].e.phi_e = 0.5 * arcmin;
  sources[4].e.phi_n = sources[6].e.phi_n = 0.5 * arcmin;
  sources[5].e.phi_u = sources[6].e.phi_u = 3.6 * arcmin;
  report::Table table;
  table.title = "Table 3, honestly: what each error does to the two constants";
  table.caption =
      "The drive of the paper's section 3 with strapdown attitude in the dead reckoning, one error "
      "at "
      "a time, the error-free run subtracted. The printed scale column is 4.016e-8 in every row "
      "(E-27); the printed angles have the opposite sign (E-24) and a constant of the paper's own "
      "simulation in the small ones.";
  table.columns = {{"source", ""},
                   {"dK/K_D, ours", ""},
                   {"dK/K_D, printed", ""},
                   {"dalpha, ours", "deg"},
                   {"dalpha, printed", "deg"}};
  for (const auto& x : sources) {
    const Found f = contribution(x.e);
    book.add(fmt::format("S1-T3-{}-K", x.id), f.dk);
    book.add(fmt::format("S1-T3-{}-alpha", x.id), f.dalpha);
    report::Row row;
    row.cells = {report::Cell(x.words), report::Cell(fmt::format("{:.2e}", f.dk)),
                 report::Cell("4.016e-8"), report::Cell(fmt::format("{:.4e}", f.dalpha)),
                 report::Cell(x.printed_alpha)};
    table.rows.push_back(row);
    const std::string id = x.id;
    if (id == "eps_z" || id == "phiU0") {
      const std::string four = id == "eps_z" ? "epsz" : "phiU";
      book.add("S1-T4-simK-" + four, f.dk);
      book.add("S1-T4-sima-" + four, f.dalpha);
    }
  }
  paper.tables.emplace_back(table);

  // Table 4, the formulas.
  const double v = 20 / std::sqrt(2.0), t = 600;
  const auto drift = straight_drive_error(s.radius, 40 * deg, v, v, 0, s.drift, t);
  const auto start = straight_drive_error(s.radius, 40 * deg, v, v, 3.6 * arcmin, 0, t);
  book.add("S1-T4-forK-epsz", drift.constants.dk);
  book.add("S1-T4-forK-phiU", start.constants.dk);
  book.add("S1-T4-fora-epsz", drift.constants.dalpha / deg);
  book.add("S1-T4-fora-phiU", start.constants.dalpha / deg);

  // The error-free run by each chord.
  const struct {
    const char* id;
    ChordMethod method;
  } chords[] = {{"gauss", ChordMethod::kGauss},
                {"geod", ChordMethod::kGeodesic},
                {"rhumb", ChordMethod::kRhumb},
                {"start", ChordMethod::kStartLatitude}};
  for (const auto& c : chords) {
    const Found f = calibrated(s, drive, c.method, s.errors());
    book.add(fmt::format("S1-T3-base-{}/k", c.id), f.dk);
    book.add(fmt::format("S1-T3-base-{}/alpha", c.id), f.dalpha);
  }

  // The angle random walk, by the budget and by drives.
  OdometerSources only;
  only.gyro_noise = 0.001 * deg_per_sqrt_h;
  const CalibrationDrive c{drive.lat, drive.course, drive.length, drive.speed, drive.acceleration};
  book.add("S1-ARW", odometer_budget(s.ell, c, only, HeadingModel::kMechanised).eps / deg);
  const int runs = 120;
  double sum = 0, square = 0;
  auto coarse = drive;
  coarse.interval = 1;
  for (int i = 0; i < runs; ++i) {
    auto e = s.errors();
    e.gyro_noise = only.gyro_noise;
    e.seed = o.seed;
    e.trial = static_cast<std::uint64_t>(i);
    const double x = calibrated(s, coarse, ChordMethod::kGauss, e).dalpha;
    sum += x;
    square += x * x;
  }
  book.add("S1-ARW/simulated", std::sqrt((square - sum * sum / runs) / (runs - 1)));
}

void figures(const Setting& s, Paper& paper) {
  const auto drive = sh15_drive();
  // Figure 1: both tracks on the Gauss plane of the start's meridian.
  report::Scatter tracks;
  tracks.title = "Figure 1: true and reckoned track";
  tracks.caption =
      "The Gauss plane of the start's meridian, from the start O: the true end B, and B' where the "
      "reckoning with 1.2 times the scale and one degree of mounting ends. The two are similar; "
      "their "
      "lengths and directions give the constants.";
  tracks.x = {"east", "km"};
  tracks.y = {"north", "km"};
  tracks.equal = true;
  report::Cloud truth{"true (O B)", {0}, {0}, true}, reckoned{"reckoned (O B')", {0}, {0}, true};
  const auto origin = gauss_forward(s.ell, drive.lat, drive.lon, drive.lon);
  for (double length = 1120; length <= 11200; length += 1120) {
    auto d = drive;
    d.length = length;
    const auto e = simulate_straight_drive(s.ell, d, s.errors());
    const auto a = gauss_forward(s.ell, e.lat2, e.lon2, drive.lon),
               b = gauss_forward(s.ell, e.lat3, e.lon3, drive.lon);
    truth.x.push_back((a.y - origin.y) / 1e3), truth.y.push_back((a.x - origin.x) / 1e3);
    reckoned.x.push_back((b.y - origin.y) / 1e3), reckoned.y.push_back((b.x - origin.x) / 1e3);
  }
  tracks.clouds = {truth, reckoned};
  paper.figures.push_back({"figure1", tracks});

  // How the angle's error grows with the drive, simulation against (33) corrected.
  report::Series f;
  f.title = "Error of the mounting angle against the length of the drive";
  f.caption =
      "Simulated drives against the corrected formula (33), alpha's error = e_U t/2 - phi_U0. The "
      "initial heading error goes into the angle one to one, however long the drive; the drift's "
      "share grows with time.";
  f.x = {"length of the drive", "km"};
  f.y = {"|error of alpha|", "deg", true};
  report::Curve heading, heading_formula, drift, drift_formula;
  heading.name = "initial heading 3.6', simulated";
  heading.style = drift.style = report::Style::kLinePoints;
  heading_formula.name = "initial heading, formula";
  heading_formula.style = drift_formula.style = report::Style::kDashed;
  drift.name = "gyro drift z 0.01 deg/h, simulated";
  drift_formula.name = "gyro drift z, formula";
  for (double length : {1000.0, 2000.0, 4000.0, 6000.0, 8000.0, 11200.0, 15000.0, 20000.0}) {
    auto d = drive;
    d.length = length;
    const double t = d.duration(), v = length / t / std::sqrt(2.0);
    const auto base = calibrated(s, d, ChordMethod::kGeodesic, s.errors());
    auto e = s.errors();
    e.phi_u = 3.6 * arcmin;
    heading.y.push_back(
        std::fabs(calibrated(s, d, ChordMethod::kGeodesic, e).dalpha - base.dalpha));
    e = s.errors();
    e.gyro_bias.z = s.drift;
    drift.y.push_back(std::fabs(calibrated(s, d, ChordMethod::kGeodesic, e).dalpha - base.dalpha));
    f.at.push_back(length / 1e3);
    heading_formula.y.push_back(
        std::fabs(
            straight_drive_error(s.radius, d.lat, v, v, 3.6 * arcmin, 0, t).constants.dalpha) /
        deg);
    drift_formula.y.push_back(
        std::fabs(straight_drive_error(s.radius, d.lat, v, v, 0, s.drift, t).constants.dalpha) /
        deg);
  }
  f.curves = {heading, heading_formula, drift, drift_formula};
  paper.figures.push_back({"drive-length", f});

  // What the Gauss plane itself costs.
  report::Series g, h;
  g.title = "What the Gauss plane costs: scale";
  h.title = "What the Gauss plane costs: angle";
  g.caption = h.caption =
      "The error-free drive calibrated on Gauss planes of other central meridians. At three "
      "degrees "
      "the plane costs a hundred times the printed 4.016e-8 (E-27); the start's own meridian, or "
      "the "
      "geodesic chord, costs nothing.";
  g.x = h.x = {"central meridian east of the start", "deg"};
  g.y = {"dK/K_D", ""};
  h.y = {"dalpha", "deg"};
  g.half = h.half = true;
  report::Curve gk, ga, ek, ea;
  gk.name = ga.name = "Gauss chord";
  ek.name = ea.name = "geodesic chord";
  ek.style = ea.style = report::Style::kDashed;
  const Found exact = calibrated(s, drive, ChordMethod::kGeodesic, s.errors());
  for (double m = -3; m <= 3.01; m += 0.25) {
    const Found x = calibrated(s, drive, ChordMethod::kGauss, s.errors(), m * deg);
    g.at.push_back(m);
    gk.y.push_back(x.dk), ga.y.push_back(x.dalpha);
    ek.y.push_back(exact.dk), ea.y.push_back(exact.dalpha);
  }
  h.at = g.at;
  g.curves = {gk, ek};
  h.curves = {ga, ea};
  paper.figures.push_back({"meridian-scale", g});
  paper.figures.push_back({"meridian-angle", h});

  // All sources, as a tool gives them.
  const CalibrationDrive c{drive.lat, drive.course, drive.length, drive.speed, drive.acceleration};
  OdometerSources sources;
  sources.heading = 3.6 * arcmin;
  sources.level = 0.5 * arcmin;
  sources.gyro_bias = s.drift;
  sources.gyro_noise = 0.001 * deg_per_sqrt_h;
  sources.benchmark = 0.1;
  sources.quantisation = 0.05;
  sources.scale_noise = 1e-3;
  sources.side_slip = 0.05 * deg;
  sources.step = 20;
  const auto budget = odometer_budget(s.ell, c, sources, HeadingModel::kMechanised);
  report::Table table;
  table.title = "Every source, not only the gyros";
  table.caption =
      "1 sigma of scale and angle from the paper's instruments and what it leaves out: benchmarks "
      "of "
      "0.1 m, pulses of 5 cm, 0.1 % of white scale noise and 0.05 deg of side slip a second "
      "(loxo analyze odometer).";
  table.columns = {{"source", ""}, {"ln k", ""}, {"angle", "deg"}};
  for (const auto& x : budget.sources) {
    report::Row row;
    row.cells = {report::Cell(x.words), report::Cell(fmt::format("{:.2e}", x.ln_k)),
                 report::Cell(fmt::format("{:.2e}", x.eps / deg))};
    table.rows.push_back(row);
  }
  report::Row total;
  total.cells = {report::Cell("all together"), report::Cell(fmt::format("{:.2e}", budget.ln_k)),
                 report::Cell(fmt::format("{:.2e}", budget.eps / deg))};
  total.highlighted = true;
  table.rows.push_back(total);
  paper.tables.emplace_back(table);
  paper.numbers["budget-k"] = budget.ln_k;
  paper.numbers["budget-eps"] = budget.eps / deg;
}

constexpr const char* kPage = R"md(## shi2015: Shi et al., what spoils an odometer's calibration

*Shi H., Ma J., Zhang X., Zhang C., the initial calibration of odometer and error analysis, 2015 (in Chinese).*

**Question.** The odometer's scale and the mounting angle come from a straight drive between two surveyed points. The attitude that the
dead reckoning uses comes from gyros that drift and an alignment that is not perfect: what does that do to the two constants?

**Method.** Chords on the Gauss plane; first-order error equations of a dead reckoning that keeps its own attitude, tabulated term by
term (tables 1, 2), simplified to a formula (32), (33), and held against a simulated drive of 11.2 km (tables 3, 4).

**What holds.** The message: the initial heading error goes into the mounting angle one to one ({{S1-T3-phiU0-alpha:.5f}} deg for 3.6
arc minutes), the vertical gyro with half of what it has drifted ({{S1-T3-eps_z-alpha:.2e}} deg), the level errors and the other gyros hardly
(below 2e-4 deg), and the scale is immune ({{S1-T3-all-K:.1e}}).

**What does not.** Both signs of (30), (31) and with them of tables 3 and 4 (E-21, E-24). The scale column of table 3, 4.016e-8 in every
row, is no propagated error (E-27): honest contributions are {{S1-T3-eps_y-K:.0e}} to {{S1-T3-phiN0-K:.0e}}, and the error-free run itself
gives {{S1-T3-base-gauss/k:.1e}} on the Gauss plane. The formula's 3.416e-6 for the heading error (table 4) contradicts the paper's own
simulation 85 times; at first order it is zero (E-22). Tables 1 and 2 have a forgotten tan L ({{S1-T1-phiUdot<-phiU:.3e}}, printed
{{printed S1-T1-phiUdot<-phiU:.1e}}), a wrong exponent ({{S1-T2-phiNdot<-dL:.2e}}, printed {{printed S1-T2-phiNdot<-dL:.1e}}) and
rounded inputs (E-25, E-26). The printed projection series and the error equations (11), (13) to (15), (19) have misprints that dimension
alone shows (E-14 to E-20).

**What loxo does instead.** The chain corrected and as a tool, with every other source beside it: `loxo analyze odometer` names the leading
source and what improves it most; with the paper's instruments and common benchmarks the drive is worth {{budget-k:.1e}} of scale and
{{budget-eps:.3f}} deg. For such logs the geodesic chord or replay instead of a plane ({{S1-T3-base-geod/alpha:.0e}} deg; a rhumb chord would
cost {{S1-T3-base-rhumb/alpha:.1e}} deg).
)md";

}  // namespace

Paper shi2015(const Options& o) {
  Paper paper;
  paper.name = "shi2015";
  paper.title = "what spoils an odometer's calibration";
  paper.reference =
      "Shi, Ma, Zhang and Zhang 2015: the initial calibration of odometer and error analysis (in "
      "Chinese). WGS84; start at 40 N, 116 E (the paper names neither).";
  Book book(paper, kClaims);
  Setting s{o.model.of(wgs84()), o.model.angle_sign, 0.01 * deg_per_h * o.model.gyro_drift};
  s.radius *= o.model.earth_radius;
  s.w *= o.model.earth_rate;
  tables_one_and_two(s, book);
  tables_three_and_four(s, o, book, paper);
  if (o.progress) o.progress(0.6);
  figures(s, paper);
  book.close(kPage);
  if (o.progress) o.progress(1);
  return paper;
}

}  // namespace loxo::papers
