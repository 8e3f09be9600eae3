// SPDX-License-Identifier: Apache-2.0
// `loxo transfer rates` as interface.md names it, against the formulas written out here again.
#include <gtest/gtest.h>

#include <cmath>

#include "program.hpp"

namespace loxo::testing {
namespace {

const char* const kHeader =
    "tlat_deg,tlon_deg,angle_deg,vte_mps,vtn_mps,theading_deg,pitch_deg,roll_deg,g_mps2,gm_mps2";
constexpr double kDeg = M_PI / 180, kRate = 7.292115e-5;

// (3) on the sphere: C_bt [2 O x v - dg], C_bt O with O = w (B, A sin p, -A cos p).
std::vector<double> expected(const std::vector<double>& x) {
  const double p = x[0] * kDeg, l = x[1] * kDeg, L = x[2] * kDeg, ve = x[3], vn = x[4];
  const double A = std::cos(l) - std::cos(l - L), B = std::sin(l) - std::sin(l - L);
  const double O[3] = {kRate * B, kRate * A * std::sin(p), -kRate * A * std::cos(p)};
  const double f[3] = {2 * (-O[2] * vn), 2 * (O[2] * ve),
                       2 * (O[0] * vn - O[1] * ve) + x[9] - x[8]};
  const double h = x[5] * kDeg, t = x[6] * kDeg, g = x[7] * kDeg;
  const double C[3][3] = {{std::cos(h) * std::cos(g) + std::sin(h) * std::sin(t) * std::sin(g),
                           std::sin(h) * std::cos(t),
                           std::cos(h) * std::sin(g) - std::sin(h) * std::sin(t) * std::cos(g)},
                          {-std::sin(h) * std::cos(g) + std::cos(h) * std::sin(t) * std::sin(g),
                           std::cos(h) * std::cos(t),
                           -std::sin(h) * std::sin(g) - std::cos(h) * std::sin(t) * std::cos(g)},
                          {-std::cos(t) * std::sin(g), std::sin(t), std::cos(t) * std::cos(g)}};
  std::vector<double> r;
  for (int j = 0; j < 3; ++j) r.push_back(C[0][j] * f[0] + C[1][j] * f[1] + C[2][j] * f[2]);
  for (int j = 0; j < 3; ++j) r.push_back(C[0][j] * O[0] + C[1][j] * O[1] + C[2][j] * O[2]);
  return r;
}

TEST(TransferRates, SphereConversionAndItsErrors) {
  const std::vector<double> x = {0.4, 59, 58.96, 5, -3, 37, 1.5, -4, 9.795, 9.833};
  const Outcome r = run("transfer rates --earth sphere",
                        std::string(kHeader) +
                            ",dheading_deg,dpitch_deg,droll_deg,dvte_mps,dvtn_mps\n"
                            "0.4,59,58.96,5,-3,37,1.5,-4,9.795,9.833,0.05,0.0167,-0.0167,0.1,-0.1\n"
                            "90,59,58.96,5,-3,37,1.5,-4,9.795,9.833,0,0,0,0,0\n");
  ASSERT_EQ(r.exit_code, 0) << r.err;
  const auto t = columns(r.out);
  const char* names[] = {"f_x_mps2", "f_y_mps2", "f_z_mps2", "w_x_radps", "w_y_radps", "w_z_radps"};
  const auto right = expected(x);
  auto y = x;
  y[5] += 0.05;
  y[6] += 0.0167;
  y[7] -= 0.0167;
  y[3] += 0.1;
  y[4] -= 0.1;
  const auto wrong = expected(y);
  for (std::size_t i = 0; i < 6; ++i) {
    const double size = i < 3 ? 0.04 : 7e-5;
    EXPECT_NEAR(number(t.at(std::string("d") + names[i])[0]), right[i], 1e-14 * size * 10)
        << names[i];
    const double definition = number(t.at(std::string("dd") + names[i])[0]);
    EXPECT_NEAR(definition, wrong[i] - right[i], 1e-14 * size * 10) << names[i];
    // first order in 1e-3 rad: second order is 1e-6 of the rate
    EXPECT_NEAR(number(t.at(std::string("dd") + names[i] + "_full")[0]), definition, 2e-6 * size)
        << names[i];
    EXPECT_NEAR(number(t.at(std::string("dd") + names[i] + "_simple")[0]), definition, 2e-4 * size)
        << names[i];
    EXPECT_EQ(t.at(std::string("d") + names[i])[1], "nan");
  }
  EXPECT_NE(r.err.find(":3:"), std::string::npos) << r.err;
}

TEST(TransferRates, EllipsoidPathAndUsage) {
  const std::string row = "0.4,59,58.96,5,-3,37,1.5,-4";
  const std::string head = std::string(kHeader).substr(0, std::string(kHeader).find(",g_mps2"));
  const Outcome ell = run("transfer rates", std::string(kHeader) + "\n" + row + ",9.795,9.833\n");
  ASSERT_EQ(ell.exit_code, 0) << ell.err;
  EXPECT_NEAR(number(columns(ell.out).at("dw_x_radps")[0]),
              number(columns(run("transfer rates --earth sphere",
                                 std::string(kHeader) + "\n" + row + ",9.795,9.833\n")
                                 .out)
                         .at("dw_x_radps")[0]),
              1e-8);
  const Outcome path =
      run("transfer rates --keep path", head + ",fx_mps2,fy_mps2,fz_mps2\n" + row + ",0,0,9.8\n");
  EXPECT_EQ(path.exit_code, 0) << path.err;
  EXPECT_EQ(run("transfer rates --keep path", std::string(kHeader) + "\n" + row + ",9.795,9.833\n")
                .exit_code,
            3);
  EXPECT_EQ(run("transfer rates --earth spher").exit_code, 2);
  EXPECT_EQ(run("transfer rates", std::string(kHeader) + ",dpitch_deg\n" + row + ",9.795,9.833,0\n")
                .exit_code,
            3);
}

}  // namespace
}  // namespace loxo::testing
