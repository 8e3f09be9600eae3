// SPDX-License-Identifier: Apache-2.0
// What is in a drive or in a bare table, before anything is computed from it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <vector>

#include "cli/command.hpp"
#include "loxo/log/drive.hpp"
#include "loxo/log/table.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/quantity.hpp"

namespace loxo::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kEarthRate = 15.041067;  // deg/h
constexpr double kWindow = 10.0;          // s, over which a vehicle is judged to stand
constexpr double kStandingForce = 0.1;    // m/s^2, spread of |f| in a standing window
constexpr double kStandingRate = 0.02;    // rad/s, mean turn in a standing window
constexpr double kStandingEnough = 60.0;  // s of standing for an Earth-rate check
constexpr double kEarthRateBand = 0.2;    // relative
constexpr double kSpanBand = 0.02;        // of a span that is half or twice another
constexpr double kGap = 3.0;              // usual steps; as the readers count them

// Stamps of one channel in file order.
struct Timing {
  std::size_t rows = 0, gaps = 0;
  double first = kNone, last = kNone, step = kNone, longest_gap = 0;

  void gap(double s) {
    if (s > kGap * step) ++gaps, longest_gap = std::max(longest_gap, s);
  }
};

Timing timing_of(const std::vector<double>& t) {
  Timing r;
  r.rows = t.size();
  if (t.empty()) return r;
  r.first = t.front();
  r.last = t.back();
  std::vector<double> steps;
  for (std::size_t i = 1; i < t.size(); ++i) steps.push_back(t[i] - t[i - 1]);
  if (steps.empty()) return r;
  auto sorted = steps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  r.step = *middle;
  for (double s : steps) r.gap(s);
  return r;
}

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json timing_json(const std::string& name, const std::string& file, const Timing& t) {
  Json j;
  j["name"] = name;
  j["file"] = file;
  j["rows"] = t.rows;
  j["rate_hz"] = number(1.0 / t.step);
  j["begin_s"] = number(t.first);
  j["end_s"] = number(t.last);
  j["span_s"] = number(t.last - t.first);
  j["gaps"] = t.gaps;
  j["longest_gap_s"] = t.longest_gap;
  return j;
}

std::string timing_text(const std::string& name, const Timing& t) {
  std::string s = fmt::format("{:<10} {:>9} rows", name, t.rows);
  if (t.rows > 1)
    s += fmt::format("  {:>8.4g} Hz  {:.3f} to {:.3f} s ({:.3f} s)", 1.0 / t.step, t.first, t.last,
                     t.last - t.first);
  if (t.gaps > 0) s += fmt::format("  {} gaps, the longest {:.3f} s", t.gaps, t.longest_gap);
  return s;
}

// The IMU, streamed: what a standing vehicle must show, gravity and the Earth's turn.
struct ImuLook {
  Timing timing;
  double force = 0, up = 0;                    // m/s^2, means
  double standing = 0, standing_rate = kNone;  // s; deg/h, norm of the mean rate while standing
  std::string earth_rate = "no standstill";
};

ImuLook look_at_imu(const Drive& drive, Diagnostics& diagnostics) {
  ImuLook look;
  ImuReader reader(drive, diagnostics);
  look.timing.step = reader.interval();
  ImuIncrement<double> s;
  Vec<Body> still{}, turned{};
  double time = 0, force = 0, force2 = 0, n = 0;
  while (reader.next(s)) {
    Timing& t = look.timing;
    if (t.rows == 0) t.first = s.t;
    if (t.rows > 0) t.gap(s.t - t.last);
    t.last = s.t;
    ++t.rows;
    if (!(s.dt > 0)) continue;
    const double f = norm(s.dv) / s.dt;
    look.force += f;
    look.up += s.dv.z / s.dt;
    turned = turned + s.dtheta;
    time += s.dt;
    force += f, force2 += f * f, n += 1;
    if (time < kWindow) continue;
    const double spread = std::sqrt(std::max(0.0, force2 / n - (force / n) * (force / n)));
    if (spread < kStandingForce && norm(turned) < kStandingRate * time) {
      still = still + turned;
      look.standing += time;
    }
    turned = {};
    time = force = force2 = n = 0;
  }
  if (look.timing.rows > 0) {
    look.force /= static_cast<double>(look.timing.rows);
    look.up /= static_cast<double>(look.timing.rows);
  }
  if (look.standing >= kStandingEnough) {
    look.standing_rate = norm(still) / look.standing / deg * 3600;
    const double off = std::fabs(look.standing_rate / kEarthRate - 1);
    look.earth_rate = off < kEarthRateBand ? "seen" : "hidden by the gyro bias";
  }
  return look;
}

template <class Rows>
std::vector<double> stamps(const Rows& rows) {
  std::vector<double> t;
  t.reserve(rows.size());
  for (const auto& r : rows) t.push_back(r.t);
  return t;
}

int inspect_drive(const Globals& globals, const std::string& path) {
  const Drive drive = read_drive(path, globals.sets);
  Diagnostics diagnostics = drive.diagnostics;
  Json channels = Json::array();
  std::string text = fmt::format("drive      {}", drive.name.empty() ? path : drive.name);
  std::string empty;
  Timing of_imu;
  auto tell = [&](const std::string& name, const ChannelFile& file, const Timing& t) {
    if (name == "imu") of_imu = t;
    // Stamps of half or twice the rate stand out against a channel that lasts twice or half as
    // long.
    const double ratio = (of_imu.last - of_imu.first) / (t.last - t.first);
    if (std::fabs(ratio - 0.5) < kSpanBand || std::fabs(ratio / 2 - 1) < kSpanBand)
      diagnostics.warn(
          "spans", file.where,
          fmt::format("imu lasts {:.1f} s and {} {:.1f} s: are the imu's stamps {} what "
                      "they should be?",
                      of_imu.last - of_imu.first, name, t.last - t.first,
                      ratio < 1 ? "half" : "twice"));
    channels.push_back(timing_json(name, file.file, t));
    text += "\n" + timing_text(name, t);
    if (t.rows == 0 && empty.empty()) empty = file.file;
  };
  if (drive.imu.present) {
    const ImuLook look = look_at_imu(drive, diagnostics);
    tell("imu", drive.imu, look.timing);
    Json& j = channels.back();
    j["kind"] = drive.imu_kind;
    j["axes"] = drive.imu_axes;
    j["mean_force_mps2"] = look.force;
    j["mean_up_mps2"] = look.up;
    j["standing_s"] = look.standing;
    j["standing_rate_deg_h"] = number(look.standing_rate);
    j["earth_rate"] = look.earth_rate;
    text += fmt::format("\n           mean |f| {:.4f} m/s^2, up axis {:+.4f}", look.force, look.up);
    text += fmt::format("\n           Earth rate: {}", look.earth_rate);
    if (std::isfinite(look.standing_rate))
      text += fmt::format(" (standing {:.0f} s: {:.3f} deg/h, the Earth turns {:.3f})",
                          look.standing, look.standing_rate, kEarthRate);
  }
  if (drive.odometer.present) {
    const auto ticks = read_odometer(drive, diagnostics);
    tell("odometer", drive.odometer, timing_of(stamps(ticks)));
    double way = 0;
    for (std::size_t i = 1; i < ticks.size(); ++i)
      way += ticks[i].is_speed
                 ? 0.5 * (ticks[i].value + ticks[i - 1].value) * (ticks[i].t - ticks[i - 1].t)
                 : ticks[i].value;
    if (!ticks.empty() && !ticks[0].is_speed) way += ticks[0].value;
    channels.back()["kind"] = drive.odometer_kind;
    channels.back()["distance_m"] = way;
    text += fmt::format("\n           {}, {:.3f} m", drive.odometer_kind, way);
  }
  if (drive.attitude.present)
    tell("attitude", drive.attitude, timing_of(stamps(read_attitude(drive, diagnostics))));
  if (drive.track.present) {
    const auto track = read_track(drive, diagnostics);
    tell("track", drive.track, timing_of(stamps(track)));
    double way = 0;
    for (const auto& s : track) way += s.ds;
    channels.back()["distance_m"] = way;
    text += fmt::format("\n           {:.3f} m", way);
  }
  if (drive.fix.present) tell("fix", drive.fix, timing_of(stamps(read_fixes(drive, diagnostics))));
  if (drive.velocity.present)
    tell("velocity", drive.velocity, timing_of(stamps(read_velocities(drive, diagnostics))));
  if (drive.heading.present)
    tell("heading", drive.heading, timing_of(stamps(read_heading_log(drive, diagnostics))));
  if (drive.height.present)
    tell("height", drive.height, timing_of(stamps(read_heights(drive, diagnostics))));
  if (drive.reference.present)
    tell("reference", drive.reference, timing_of(stamps(read_reference(drive, diagnostics).rows)));
  if (!drive.benchmarks.empty()) text += fmt::format("\nbenchmarks {}", drive.benchmarks.size());
  print_diagnostics(globals, diagnostics);
  if (!empty.empty())
    throw Error(ErrorKind::kInput, "expected rows of data, found none that can be read", empty);
  if (globals.json) {
    Json j;
    j["command"] = "inspect";
    j["kind"] = "drive";
    j["path"] = path;
    j["name"] = drive.name;
    j["ellipsoid"] = drive.ellipsoid.name;
    j["benchmarks"] = drive.benchmarks.size();
    j["channels"] = channels;
    j["diagnostics"] = to_json(diagnostics);
    print_json(j);
  }
  say(globals, text);
  return 0;
}

// One column of a bare table.
struct ColumnLook {
  std::string name, unit;
  double low = kNone, high = kNone, sum = 0;
  std::size_t numbers = 0;
};

using NamedTable = std::pair<std::string, std::string>;  // file, its table

struct TableLook {
  std::string path, table;
  TableConvention convention;
  std::vector<std::string> words;  // columns of text
  std::vector<ColumnLook> columns;
  Timing timing;
  double force = kNone, rate = kNone;  // mean norms of ax, ay, az and gx, gy, gz
  std::size_t backwards = 0;
  std::size_t at(const std::string& name) const {
    std::size_t i = 0;
    while (i < columns.size() && columns[i].name != name) ++i;
    return i;
  }
  bool has(const std::string& name) const {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const ColumnLook& c) { return c.name == name; });
  }
  bool has_all(std::initializer_list<const char*> names) const {
    return std::all_of(names.begin(), names.end(), [&](const char* n) { return has(n); });
  }
};

TableLook look_at_table(const std::string& path, const std::string& table,
                        Diagnostics& diagnostics) {
  TableLook look;
  look.path = path;
  look.table = table;
  const auto opened = open_table(path, table);
  Table& reader = *opened;
  look.convention = reader.convention();
  look.words = reader.word_columns();
  std::vector<std::string> numbers;
  for (const auto& name : reader.header()) {
    if (std::find(look.words.begin(), look.words.end(), name) != look.words.end()) continue;
    look.columns.push_back({name, std::string(unit_of_column(name)), kNone, kNone, 0, 0});
    numbers.push_back(name);
  }
  reader.select(numbers);
  const bool imu = look.has_all({"gx", "gy", "gz", "ax", "ay", "az"});
  std::size_t place[6]{};
  if (imu) {
    const char* names[] = {"gx", "gy", "gz", "ax", "ay", "az"};
    for (std::size_t i = 0; i < 6; ++i) place[i] = look.at(names[i]);
  }
  const bool timed = look.has("t_s");
  const std::size_t time = timed ? look.at("t_s") : 0;
  std::vector<double> row(look.columns.size()), t;
  double force = 0, rate = 0;
  std::size_t rows = 0, whole = 0;
  while (reader.next(row, diagnostics)) {
    ++rows;
    for (std::size_t i = 0; i < row.size(); ++i) {
      ColumnLook& c = look.columns[i];
      if (!std::isfinite(row[i])) continue;
      c.low = std::fmin(c.low, row[i]);
      c.high = std::fmax(c.high, row[i]);
      c.sum += row[i];
      ++c.numbers;
    }
    if (timed && std::isfinite(row[time])) {
      if (!t.empty() && row[time] <= t.back()) {
        ++look.backwards;
        diagnostics.warn(row[time] == t.back() ? "duplicate" : "time_back", reader.where(),
                         fmt::format("expected a time after {}, found {}", t.back(), row[time]));
      } else {
        t.push_back(row[time]);
      }
    }
    if (imu) {
      const double w = std::hypot(row[place[0]], row[place[1]], row[place[2]]);
      const double f = std::hypot(row[place[3]], row[place[4]], row[place[5]]);
      if (std::isfinite(w + f)) rate += w, force += f, ++whole;
    }
  }
  if (rows == 0)
    throw Error(ErrorKind::kInput, "expected rows of data, found none that can be read", path);
  look.timing = timing_of(t);
  look.timing.rows = rows;
  if (whole > 0) {
    look.force = force / static_cast<double>(whole);
    look.rate = rate / static_cast<double>(whole);
  }
  if (whole > 0) {
    const bool g = std::fabs(look.force - 1) < 0.15;
    for (auto& c : look.columns) {
      if (c.name == "gx" || c.name == "gy" || c.name == "gz")
        c.unit = look.rate > 2 ? "deg/s" : "rad/s";
      if (c.name == "ax" || c.name == "ay" || c.name == "az") c.unit = g ? "g" : "m/s^2";
    }
    if (!g && (look.force < 7 || look.force > 13))
      diagnostics.warn(
          "imu_units", path,
          fmt::format("ax, ay, az have a mean norm of {:.4g}: neither g nor m/s^2, are "
                      "they counts or increments?",
                      look.force));
  }
  for (const auto& c : look.columns)
    if (c.name == "lat_deg" && (c.high > 90 || c.low < -90))
      diagnostics.bad("latitude", path,
                      fmt::format("expected lat_deg in [-90, 90], found {} to {}", c.low, c.high));
  return look;
}

std::string propose(const TableLook& look) {
  const std::string file = fs::path(look.path).filename().string();
  const std::string time = look.has("t_s") ? "time = \"t_s\", " : "";
  const std::string rate = look.has("t_s") ? "" : "rate = \"100 Hz\"  # expected: the true rate\n";
  const std::string table = look.table.empty() ? "" : "table = \"" + look.table + "\"\n";
  auto section = [&](const std::string& name, const std::string& columns, const std::string& more) {
    return fmt::format("[{}]\nfile = \"{}\"\n{}{}{}columns = {{ {}{} }}\n", name, file, table, rate,
                       more, time, columns);
  };
  if (!look.convention.section.empty()) {  // what the format fixes need not be said
    std::string known =
        fmt::format("[{}]\nfile = \"{}\"\n{}", look.convention.section, file, table);
    if (!look.convention.columns.contains("time") && !look.has("t_s"))
      known += "rate = \"100 Hz\"  # expected: the true rate\n";
    return known + "# " + look.convention.format +
           ": columns, units and axes are those of the format\n";
  }
  if (std::isfinite(look.force)) {
    const std::string f = std::fabs(look.force - 1) < 0.15 ? "g" : "m/s^2";
    const std::string w = look.rate > 2 ? "deg/s" : "rad/s";
    return section("imu", "gyro = [\"gx\", \"gy\", \"gz\"], accel = [\"ax\", \"ay\", \"az\"]",
                   "kind = \"rate\"\nstamp = \"end\"\naxes = \"RFU\"\n"
                   "units = { gyro = \"" +
                       w + "\", accel = \"" + f + "\" }\n");
  }
  if (look.has("lat_deg") && look.has("lon_deg")) {
    const bool whole = look.has_all({"roll_deg", "pitch_deg", "heading_deg"});
    std::string columns = "lat = \"lat_deg\", lon = \"lon_deg\"";
    if (look.has("h_m")) columns += ", height = \"h_m\"";
    if (whole) columns += ", roll = \"roll_deg\", pitch = \"pitch_deg\", heading = \"heading_deg\"";
    return section(whole ? "reference" : "fix", columns, "");
  }
  if (look.has_all({"ds_m", "heading_deg"}))
    return section("track", "distance = \"ds_m\", heading = \"heading_deg\"", "");
  if (look.has_all({"ds_m", "dheading_rad"}))
    return section("track", "distance = \"ds_m\", heading_step = \"dheading_rad\"", "");
  if (look.has("v_mps")) return section("odometer", "value = \"v_mps\"", "kind = \"speed\"\n");
  if (look.has("counts"))
    return section("odometer", "value = \"counts\"",
                   "kind = \"counter\"\nscale = \"0.01 m/pulse\"  # expected: the true one\n");
  if (look.has("heading_deg")) return section("heading", "heading = \"heading_deg\"", "");
  return "";
}

int inspect_tables(const Globals& globals, const std::vector<NamedTable>& paths) {
  Diagnostics diagnostics;
  std::string toml = "format = 1\n", text;
  Json tables = Json::array();
  bool any = false;
  for (const auto& [path, name] : paths) {
    const TableLook look = look_at_table(path, name, diagnostics);
    const std::string section = propose(look);
    any = any || !section.empty();
    if (!section.empty()) toml += "\n" + section;
    Json j = timing_json(fs::path(path).filename().string(), path, look.timing);
    Json columns = Json::array();
    j["format"] = look.convention.format;
    j["table"] = name;
    text += (text.empty() ? "" : "\n") +
            timing_text(name.empty() ? path : path + ":" + name, look.timing);
    text += "\n  " + look.convention.format;
    for (const auto& w : look.words) {
      columns.push_back({{"name", w}, {"unit", ""}, {"text", true}});
      text += fmt::format("\n  {:<16} text", w);
    }
    for (const auto& c : look.columns) {
      columns.push_back({{"name", c.name},
                         {"unit", c.unit},
                         {"numbers", c.numbers},
                         {"min", number(c.low)},
                         {"max", number(c.high)},
                         {"mean", number(c.sum / static_cast<double>(c.numbers))}});
      text += fmt::format("\n  {:<16} {:<8} {:>12.6g} to {:>12.6g}", c.name,
                          c.unit.empty() ? "?" : c.unit, c.low, c.high);
    }
    j["columns"] = columns;
    if (std::isfinite(look.force)) {
      j["mean_force"] = look.force;
      j["mean_rate"] = look.rate;
      text += fmt::format("\n  mean |a| {:.4f}, mean |g| {:.6f}", look.force, look.rate);
    }
    tables.push_back(j);
  }
  print_diagnostics(globals, diagnostics);
  if (globals.json) {
    Json j;
    j["command"] = "inspect";
    j["kind"] = "table";
    j["tables"] = tables;
    j["drive_toml"] = any ? Json(toml) : Json(nullptr);
    j["diagnostics"] = to_json(diagnostics);
    print_json(j);
  }
  say(globals, text);
  say(globals, any ? "\na drive.toml for it (check units and axes):\n\n" + toml
                   : "\nno section of sensors is known by these columns");
  return 0;
}

int inspect(const Globals& globals, const std::string& path) {
  std::vector<NamedTable> tables;
  if (fs::is_directory(path) && !fs::exists(fs::path(path) / "drive.toml")) {
    std::vector<std::string> files;
    for (const auto& entry : fs::directory_iterator(path)) {
      const std::string name = entry.path().filename().string();
      if (entry.is_regular_file() && !name.starts_with('.') && !name.ends_with(".md"))
        files.push_back(entry.path().string());
    }
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
      try {
        for (const auto& name : tables_of(file)) {
          open_table(file, name);
          tables.emplace_back(file, name);
        }
      } catch (const Error& e) {
        // A folder may hold anything; a file that was meant to be read is refused below.
        if (files.size() == 1 || file.ends_with(".csv") || file.ends_with(".csv.gz")) throw;
        say(globals, fmt::format("{}: passed over ({})", file, e.what()));
      }
    }
    if (tables.empty())
      throw Error(ErrorKind::kInput, "the folder holds neither drive.toml nor a table", path);
    return inspect_tables(globals, tables);
  }
  if (fs::is_regular_file(path) && !is_drive(path)) {
    for (const auto& name : tables_of(path)) tables.emplace_back(path, name);
    if (tables.empty()) throw Error(ErrorKind::kInput, "holds no table of numbers", path);
    return inspect_tables(globals, tables);
  }
  return inspect_drive(globals, path);
}

}  // namespace

void add_inspect(CLI::App& app, Globals& globals) {
  static std::string path;
  auto* sub = add_command(
      app, globals, "inspect",
      "what is in a drive or a file: format, rates, units, gaps, what looks wrong",
      "loxo inspect examples/drives/kingston2008_a", [&globals] { return inspect(globals, path); });
  sub->add_option("PATH", path, "a drive, a table in any format, or a folder of such")->required();
}

}  // namespace loxo::cli
