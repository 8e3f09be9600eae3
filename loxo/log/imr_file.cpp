// SPDX-License-Identifier: Apache-2.0
// Waypoint's .imr: a header of 512 bytes, then records of a double and six 32-bit counts.
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "loxo/log/foreign.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/gzip.hpp"

namespace loxo {
namespace {

constexpr std::size_t kHeader = 512, kRecord = 32;

class Imr : public Table {
 public:
  explicit Imr(const std::string& path) : source_(path) {
    path_ = path;
    std::array<char, kHeader> head{};
    if (fill(head.data(), kHeader) != kHeader)
      throw Error(ErrorKind::kInput, "an .imr that ends within its header", path);
    swap_ = (head[8] != 0) == (std::endian::native == std::endian::little);
    const bool delta_angle = get<std::int32_t>(&head[17]) != 0;
    const bool delta_velocity = get<std::int32_t>(&head[21]) != 0;
    const double rate = get<double>(&head[25]);
    double gyro = get<double>(&head[33]) * deg, accel = get<double>(&head[41]);
    bias_ = get<double>(&head[57]);
    if (!(rate > 0) || !(gyro > 0) || !(accel > 0) || !std::isfinite(rate + gyro + accel + bias_))
      throw Error(ErrorKind::kInput, "an .imr whose header holds no usable rate and scale factors",
                  path);
    // One kind for both: mixed files are brought to rates.
    if (delta_angle != delta_velocity) (delta_angle ? gyro : accel) *= rate;
    const bool increment = delta_angle && delta_velocity;
    factor_ = {1, gyro, gyro, gyro, accel, accel, accel};
    header_ = increment ? std::vector<std::string>{"t_s",     "dthx_rad", "dthy_rad", "dthz_rad",
                                                   "dvx_mps", "dvy_mps",  "dvz_mps"}
                        : std::vector<std::string>{"t_s",     "wx_radps", "wy_radps", "wz_radps",
                                                   "fx_mps2", "fy_mps2",  "fz_mps2"};
    convention_ = foreign_convention(Foreign::kImr);
    convention_.kind = increment ? "increment" : "rate";
    convention_.columns = {{"time", {header_[0]}},
                           {"gyro", {header_[1], header_[2], header_[3]}},
                           {"accel", {header_[4], header_[5], header_[6]}}};
    meta_["imu"] = std::string(&head[65], ::strnlen(&head[65], 32));
    for (std::size_t i = 0; i < 7; ++i) chosen_.push_back(i);
  }
  void select(const std::vector<std::string>& columns) override {
    chosen_.clear();
    for (const auto& c : columns) chosen_.push_back(index(c));
  }
  bool next(std::span<double> row, Diagnostics& d) override {
    char record[kRecord];
    const std::size_t n = fill(record, kRecord);
    if (n != kRecord) {
      if (n > 0 || (!source_.fault().empty() && !told_)) {
        told_ = true;
        d.bad("truncated", where(), "the file ends within a record; the rows before are kept");
      }
      return false;
    }
    ++rows_;
    double x[7];
    x[0] = get<double>(record) + bias_;
    for (std::size_t i = 0; i < 6; ++i)
      x[i + 1] = get<std::int32_t>(record + 8 + 4 * i) * factor_[i + 1];
    for (std::size_t i = 0; i < chosen_.size(); ++i) row[i] = x[chosen_[i]];
    return true;
  }
  std::size_t rows() const override { return rows_; }
  std::string where() const override { return path_ + ": record " + std::to_string(rows_); }

 private:
  template <class T>
  T get(const char* from) const {
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), from, sizeof(T));
    if (swap_)
      for (std::size_t i = 0; i < sizeof(T) / 2; ++i) std::swap(bytes[i], bytes[sizeof(T) - 1 - i]);
    return std::bit_cast<T>(bytes);
  }
  std::size_t fill(char* to, std::size_t n) {
    std::size_t done = 0;
    while (done < n) {
      if (at_ == end_) {
        at_ = 0;
        end_ = source_.read(block_.data(), block_.size());
        if (end_ == 0) break;
      }
      const std::size_t part = std::min(n - done, end_ - at_);
      std::memcpy(to + done, block_.data() + at_, part);
      at_ += part;
      done += part;
    }
    return done;
  }

  ByteSource source_;
  std::vector<char> block_ = std::vector<char>(1u << 16);
  std::size_t at_ = 0, end_ = 0, rows_ = 0;
  bool swap_ = false, told_ = false;
  double bias_ = 0;
  std::array<double, 7> factor_{};
  std::vector<std::size_t> chosen_;
};

}  // namespace

std::unique_ptr<Table> open_imr(const std::string& path) { return std::make_unique<Imr>(path); }

}  // namespace loxo
