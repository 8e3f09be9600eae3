// SPDX-License-Identifier: Apache-2.0
// Logs of other programs. Each is told by its content; what the format fixes (columns, units, axes,
// the meaning of a stamp) is the convention of its table, so that a section of drive.toml needs the
// file's name only. Columns are named with their unit.
#pragma once
#include <memory>
#include <optional>
#include <string>

#include "loxo/log/table.hpp"

namespace loxo {

enum class Foreign {
  kKfGinsImu,    // t, three angles [rad], three velocities [m/s]; increments, FRD
  kKfGinsGnss,   // t, lat, lon, h, std N, E, D
  kKfGinsGnssV,  // and velocity N, E, D with its std
  kKfGinsNav,    // week, t, lat, lon, h, vn, ve, vd, roll, pitch, yaw
  kPlainText,    // numbers between blanks, without a header: columns c1, c2 …
  kPsinsImu,     // header of initial values and scale factors, then pulses
  kImr,          // Waypoint's binary raw IMU
  kGpx,
  kGeoJson,
  kNmea,  // talker sentences, with or without a log's own time in front
};

// By the head of the file; none of these: nullopt. Never throws.
std::optional<Foreign> foreign_format(const std::string& path);
TableConvention foreign_convention(Foreign format);
// `table`: of NMEA the sentence ("GGA", "HDT" …), empty for the others. Throws Error(kInput).
std::unique_ptr<Table> open_foreign(const std::string& path, Foreign format,
                                    const std::string& table);
// Kinds of sentence in an NMEA log.
std::vector<std::string> nmea_tables(const std::string& path);

// One file each.
std::unique_ptr<Table> open_plain_text(const std::string& path, Foreign format);
std::unique_ptr<Table> open_imr(const std::string& path);
std::unique_ptr<Table> open_gpx(const std::string& path);
std::unique_ptr<Table> open_geojson(const std::string& path);
std::unique_ptr<Table> open_nmea(const std::string& path, const std::string& table);

}  // namespace loxo
