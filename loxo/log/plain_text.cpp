// SPDX-License-Identifier: Apache-2.0
// Numbers between blanks, streamed: KF-GINS's files and PSINS's .imu.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "loxo/log/foreign.hpp"
#include "loxo/num/error.hpp"
#include "loxo/num/units.hpp"
#include "loxo/text/gzip.hpp"

namespace loxo {
namespace {

constexpr std::size_t kBuffer = 1u << 18;
constexpr std::size_t kLongestLine = 1u << 20;

class PlainText : public Table {
 public:
  PlainText(const std::string& path, Foreign format) : source_(path), buffer_(kBuffer) {
    path_ = path;
    convention_ = foreign_convention(format);
    switch (format) {
      case Foreign::kKfGinsImu:
        header_ = {"t_s", "dthx_rad", "dthy_rad", "dthz_rad", "dvx_mps", "dvy_mps", "dvz_mps"};
        break;
      case Foreign::kKfGinsGnss:
        header_ = {"t_s", "lat_deg", "lon_deg", "h_m", "std_n_m", "std_e_m", "std_u_m"};
        break;
      case Foreign::kKfGinsGnssV:
        header_ = {"t_s",        "lat_deg",    "lon_deg",   "h_m",    "std_n_m",
                   "std_e_m",    "std_u_m",    "vn_mps",    "ve_mps", "vu_mps",
                   "std_vn_mps", "std_ve_mps", "std_vu_mps"};
        factor_.assign(13, 1.0);
        factor_[9] = -1;  // down in the file
        break;
      case Foreign::kKfGinsNav:
        header_ = {"week",   "t_s",    "lat_deg",  "lon_deg",   "h_m",        "vn_mps",
                   "ve_mps", "vu_mps", "roll_deg", "pitch_deg", "heading_deg"};
        factor_.assign(11, 1.0);
        factor_[7] = -1;
        break;
      case Foreign::kPsinsImu:
        read_psins();
        break;
      default:
        name_columns();
        break;
    }
    if (factor_.empty()) factor_.assign(header_.size(), 1.0);
    for (std::size_t i = 0; i < header_.size(); ++i) chosen_.push_back(i);
    values_.resize(header_.size());
  }
  void select(const std::vector<std::string>& columns) override {
    chosen_.clear();
    for (const auto& c : columns) chosen_.push_back(index(c));
  }
  bool next(std::span<double> row, Diagnostics& d) override {
    for (std::string_view line; next_line(line);) {
      if (line.find_first_not_of(" \t\r") == std::string_view::npos) continue;
      if (line[0] == '#' || line[0] == '%') continue;
      ++rows_;
      const std::size_t given = header_.size() - (clock_ ? 1 : 0);
      const std::size_t n = parse(line, given);
      if (n != given) {
        d.bad("bad_row", where(),
              "expected " + std::to_string(given) + " numbers, found " +
                  (n > given ? "more" : std::to_string(n)) + "; row skipped");
        continue;
      }
      if (clock_) values_[given] = t0_ + static_cast<double>(rows_) * interval_;
      for (std::size_t i = 0; i < chosen_.size(); ++i)
        row[i] = values_[chosen_[i]] * factor_[chosen_[i]];
      return true;
    }
    if (!source_.fault().empty() && !told_) {
      told_ = true;
      d.bad("truncated", where(),
            "the file " + source_.fault() + "; the " + std::to_string(rows_) +
                " rows before are kept");
    }
    return false;
  }
  std::size_t rows() const override { return rows_; }
  std::string where() const override { return path_ + ":" + std::to_string(line_); }

 private:
  bool next_line(std::string_view& line) {
    std::size_t searched = at_;
    for (;;) {
      const auto* found =
          static_cast<const char*>(std::memchr(buffer_.data() + searched, '\n', end_ - searched));
      if (found != nullptr) {
        line = {buffer_.data() + at_, static_cast<std::size_t>(found - buffer_.data()) - at_};
        at_ += line.size() + 1;
        ++line_;
        return true;
      }
      std::memmove(buffer_.data(), buffer_.data() + at_, end_ - at_);
      end_ -= at_;
      at_ = 0;
      searched = end_;
      if (end_ == buffer_.size()) {
        if (buffer_.size() >= kLongestLine)
          throw Error(ErrorKind::kInput, "a line of more than 1 MB: no text of numbers", where());
        buffer_.resize(2 * buffer_.size());
      }
      const std::size_t n = source_.read(buffer_.data() + end_, buffer_.size() - end_);
      if (n == 0) {
        if (end_ == 0 || !source_.fault().empty()) return false;
        line = {buffer_.data(), end_};
        at_ = end_;
        ++line_;
        return true;
      }
      end_ += n;
    }
  }
  // How many numbers stand on the line, up to one more than wanted.
  std::size_t parse(std::string_view line, std::size_t wanted) {
    const char *p = line.data(), *const end = p + line.size();
    std::size_t n = 0;
    for (;;) {
      while (p < end && (*p == ' ' || *p == '\t' || *p == '\r')) ++p;
      if (p == end) return n;
      if (n == wanted) return n + 1;
      if (*p == '+') ++p;
      const auto [q, error] = std::from_chars(p, end, values_[n]);
      if (error != std::errc() || (q < end && *q != ' ' && *q != '\t' && *q != '\r')) return n;
      ++n;
      p = q;
    }
  }
  // Three lines behind the comments: attitude and velocity; position, t0, interval in ms, g; scale
  // factors of the pulses in arcsec and in ug s.
  void read_psins() {
    double head[3][6];
    for (auto& values : head) {
      std::string_view line;
      do {
        if (!next_line(line))
          throw Error(ErrorKind::kInput, "a PSINS log without its three lines of values", path_);
      } while (line.empty() || line[0] == '%' ||
               line.find_first_not_of(" \t\r") == std::string_view::npos);
      values_.assign(6, 0.0);
      if (parse(line, 6) != 6)
        throw Error(ErrorKind::kInput, "expected six numbers of the PSINS header", where());
      std::copy(values_.begin(), values_.end(), values);
    }
    t0_ = head[1][3];
    interval_ = 1e-3 * head[1][4];
    if (!(interval_ > 0))
      throw Error(ErrorKind::kInput, "expected a sampling interval above 0 ms", where());
    header_ = {"dthx_rad", "dthy_rad", "dthz_rad", "dvx_mps", "dvy_mps", "dvz_mps", "t_s"};
    for (int i = 0; i < 3; ++i) factor_.push_back(head[2][i] * arcsec);
    for (int i = 3; i < 6; ++i) factor_.push_back(head[2][i] * 1e-6 * head[1][5]);
    factor_.push_back(1.0);
    clock_ = true;
    const auto text = [](double x) {
      char s[32];
      std::snprintf(s, sizeof s, "%.10g", x);
      return std::string(s);
    };
    meta_ = {{"pitch0_deg", text(head[0][0])},    {"roll0_deg", text(head[0][1])},
             {"heading0_deg", text(-head[0][2])}, {"lat0_deg", text(head[1][0])},
             {"lon0_deg", text(head[1][1])},      {"h0_m", text(head[1][2])}};
  }
  void name_columns() {
    std::string_view line;
    do {
      if (!next_line(line)) throw Error(ErrorKind::kInput, "no row of numbers", path_);
    } while (line.empty() || line[0] == '#' || line[0] == '%' ||
             line.find_first_not_of(" \t\r") == std::string_view::npos);
    values_.assign(1024, 0.0);
    const std::size_t n = parse(line, values_.size());
    for (std::size_t i = 1; i <= n; ++i) header_.push_back("c" + std::to_string(i));
    at_ = 0;  // the line is a row: read it again
    line_ = 0;
  }

  ByteSource source_;
  std::vector<char> buffer_;
  std::size_t at_ = 0, end_ = 0, line_ = 0, rows_ = 0;
  std::vector<double> values_, factor_;
  std::vector<std::size_t> chosen_;
  bool clock_ = false, told_ = false;
  double t0_ = 0, interval_ = 0;
};

}  // namespace

std::unique_ptr<Table> open_plain_text(const std::string& path, Foreign format) {
  return std::make_unique<PlainText>(path, format);
}

}  // namespace loxo
