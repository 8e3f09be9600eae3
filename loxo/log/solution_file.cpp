// SPDX-License-Identifier: Apache-2.0
#include "loxo/log/solution_file.hpp"

#include <cmath>
#include <optional>
#include <vector>

#include "loxo/earth/attitude.hpp"
#include "loxo/earth/geodetic.hpp"
#include "loxo/log/hdf5_file.hpp"
#include "loxo/log/table.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/csv.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo {
namespace {

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
constexpr std::size_t kNumbers = std::size(kColumns);

}  // namespace

struct SolutionWriter::Impl {
  std::optional<OutputFile> file;
  std::optional<H5Writer> binary;
  int precision = 0;
  std::string line;
};

SolutionWriter::SolutionWriter(const std::string& path,
                               const std::map<std::string, std::string>& meta, int precision)
    : impl_(std::make_unique<Impl>()) {
  impl_->precision = precision;
  if (path.ends_with(".h5")) {
    H5Writer& h5 = impl_->binary.emplace(path);
    std::vector<std::string> names;
    for (const Column& c : kColumns) names.emplace_back(c.name);
    names.emplace_back("frame");
    names.emplace_back("health");
    h5.begin("", names, {"frame"});
    h5.attribute("format", "loxo solution 1");
    for (const auto& [key, value] : meta) h5.attribute(key, value);
    return;
  }
  impl_->file.emplace(path);
  std::string head;
  for (const auto& [key, value] : meta) head += "# " + key + ": " + value + "\n";
  for (const Column& c : kColumns) head += std::string(c.name) + ",";
  impl_->file->write(head + "frame,health\n");
}
SolutionWriter::~SolutionWriter() = default;
void SolutionWriter::write(const SolutionRow& row) {
  if (impl_->binary) {
    double x[kNumbers + 1];
    for (std::size_t i = 0; i < kNumbers; ++i) x[i] = row.*kColumns[i].member / kColumns[i].unit;
    x[kNumbers] = row.health;
    const std::string_view frame[] = {frame_name(row.frame)};
    impl_->binary->row(x, frame);
    return;
  }
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
  impl_->file->write(s);
}
void SolutionWriter::commit() {
  if (impl_->binary)
    impl_->binary->commit();
  else
    impl_->file->commit();
}

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
  const std::unique_ptr<Table> table = open_table(path);
  Solution out;
  out.meta = table->meta();
  std::vector<std::string> chosen;
  std::vector<std::pair<double SolutionRow::*, double>> to;
  auto take = [&](const std::string& name, double SolutionRow::*member, double unit) {
    if (!table->has(name)) return false;
    chosen.push_back(name);
    to.emplace_back(member, unit);
    return true;
  };
  for (const Column& c : kColumns) {
    const auto named = columns.find(c.name);
    if (named != columns.end()) {
      if (!table->has(named->second)) table->select({named->second});  // tells what is there
      take(named->second, c.member, c.unit);
      continue;
    }
    if (take(c.name, c.member, c.unit)) continue;
    const std::string bare(c.name);
    if (bare == "ve_mps" || bare == "vn_mps" || bare == "vu_mps")
      take(bare.substr(0, 2), c.member, 1);
  }
  if (chosen.empty() || to[0].first != &SolutionRow::t) table->select({"t_s"});
  const bool local = !table->has("lat_deg") && !table->has("x_m") && table->has("e_m") &&
                     table->has("n_m") && !columns.contains("lat_deg");
  if (local) {
    // Local metres: kept as such in x, y, told in the meta.
    take("e_m", &SolutionRow::x, 1);
    take("n_m", &SolutionRow::y, 1);
    out.meta["local"] = "true";
  }
  const bool with_health = table->has("health"), with_frame = table->has("frame");
  const std::size_t health = chosen.size();
  if (with_health) chosen.emplace_back("health");
  table->select(chosen);
  std::vector<double> v(chosen.size());
  while (table->next(v, diagnostics)) {
    SolutionRow r;
    for (const Column& c : kColumns) r.*c.member = kNone;
    for (std::size_t i = 0; i < to.size(); ++i) r.*to[i].first = v[i] * to[i].second;
    if (with_health && v[health] >= 0 && v[health] <= 4294967295.0)
      r.health = static_cast<std::uint32_t>(v[health]);
    if (with_frame) {
      const std::string_view word = table->word("frame");
      for (FrameId f : {FrameId::kGeographic, FrameId::kTransverse, FrameId::kGrid,
                        FrameId::kWander, FrameId::kEcef})
        if (frame_name(f) == word) r.frame = f;
    }
    if (!given(r.t)) {
      diagnostics.bad("bad_row", table->where(), "expected a time, found nan; row skipped");
      continue;
    }
    if (!out.rows.empty() && !(r.t > out.rows.back().t)) {
      diagnostics.warn("time_back", table->where(),
                       "a stamp that is not after the last; row skipped");
      continue;
    }
    if (given(r.lat) && std::fabs(r.lat) > 0.5 * kPi + 1e-12) {
      diagnostics.bad("bad_row", table->where(), "latitude beyond 90 deg; row skipped");
      continue;
    }
    if (!local) complete_row(r, ellipsoid);
    out.rows.push_back(r);
  }
  if (out.rows.empty()) throw Error(ErrorKind::kInput, "no row could be read", path);
  return out;
}

}  // namespace loxo
