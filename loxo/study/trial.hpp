// SPDX-License-Identifier: Apache-2.0
// What a campaign repeats. A kind of trial turns parameters into metrics; its kernel is written
// once over a scalar and runs eight trials in lanes or one in double, to the same bits.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "loxo/text/quantity.hpp"
#include "loxo/text/toml.hpp"

namespace loxo {

struct ParameterInfo {
  std::string name;  // as in the campaign file
  std::string unit;  // suffix of its column in the store (SI): "rad", "m", "" …
  Dimension dimension = Dimension::kNone;
  double standard = 0;  // SI, where the campaign says nothing
  std::string meaning;
  // Values outside are refused as an impossible distribution, SI.
  double least = -1e300, most = 1e300;

  std::string column() const { return unit.empty() ? name : name + "_" + unit; }
};
struct MetricInfo {
  std::string name;  // column, with its unit as suffix
  std::string meaning;
};

class TrialKind {
 public:
  virtual ~TrialKind() = default;
  const std::vector<ParameterInfo>& parameters() const { return parameters_; }
  const std::vector<MetricInfo>& metrics() const { return metrics_; }
  // The settings in canonical form: equal text, equal rows.
  const std::string& settings() const { return settings_; }
  // Row-major: parameters[8][P] in, metrics[8][M] out, of trials first … first + 7.
  virtual void eight(const double* parameters, std::uint64_t seed, std::uint64_t first,
                     double* metrics) const = 0;
  virtual void alone(const double* parameters, std::uint64_t seed, std::uint64_t trial,
                     double* metrics) const = 0;
  // Trials that make a piece of work for a thread, a multiple of 8.
  virtual int grain() const = 0;

 protected:
  std::vector<ParameterInfo> parameters_;
  std::vector<MetricInfo> metrics_;
  std::string settings_;
};

// Names of the kinds, with what they do.
struct KindInfo {
  std::string name, job;
};
const std::vector<KindInfo>& trial_kinds();
// `settings`: what is the same in every trial (the campaign file's [settings]). Throws
// Error(kInput) for an unknown kind, at `where`, or a bad setting.
std::unique_ptr<TrialKind> make_trial_kind(const std::string& kind, const TomlTable& settings,
                                           const std::string& where);

// The rooms of kinds: one .cpp each.
std::unique_ptr<TrialKind> make_two_point_trial(const TomlTable& settings);
std::unique_ptr<TrialKind> make_drive_trial(const TomlTable& settings);

}  // namespace loxo
