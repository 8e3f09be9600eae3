// SPDX-License-Identifier: Apache-2.0
// A vehicle computer cannot wait for an allocator: after construction the strapdown loop, its
// handovers and vertical channel, the dead reckoner and the filter allocate nothing, sample by
// sample. Every operator new of this program is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "loxo/earth/geodetic.hpp"
#include "loxo/estimate/alignment.hpp"
#include "loxo/estimate/navigator.hpp"
#include "loxo/ins/closed_form_truth.hpp"
#include "loxo/ins/dead_reckoning.hpp"
#include "loxo/ins/handover.hpp"
#include "loxo/num/units.hpp"

namespace {
std::atomic<long> allocations{0};
void* counted(std::size_t size, std::size_t align) {
  ++allocations;
  void* p = align > alignof(std::max_align_t)
                ? std::aligned_alloc(align, (size + align - 1) / align * align)
                : std::malloc(size > 0 ? size : 1);
  if (p == nullptr) throw std::bad_alloc();
  return p;
}
}  // namespace
void* operator new(std::size_t size) { return counted(size, 0); }
void* operator new[](std::size_t size) { return counted(size, 0); }
void* operator new(std::size_t size, std::align_val_t a) {
  return counted(size, static_cast<std::size_t>(a));
}
void* operator new[](std::size_t size, std::align_val_t a) {
  return counted(size, static_cast<std::size_t>(a));
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete[](void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t) noexcept { std::free(p); }
void operator delete(void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::align_val_t) noexcept { std::free(p); }
void operator delete(void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept { std::free(p); }

namespace loxo {
namespace {

class CountedAllocations {
 public:
  CountedAllocations() : before_(allocations.load()) {}
  long count() const { return allocations.load() - before_; }

 private:
  long before_;
};

truth::Motion rocking() {
  auto m = truth::great_circle(wgs84(), 80 * deg, 10 * deg, 40 * deg, 12);
  m.roll = 2 * deg, m.pitch = 1 * deg;
  return m;
}

TEST(Allocations, AreSeenByThisTest) {
  const CountedAllocations here;
  std::vector<double>* v = new std::vector<double>(100);
  EXPECT_GE(here.count(), 2);
  delete v;
}

template <class M, class Other>
long strapdown_allocations(const std::vector<ImuIncrement<double>>& imu,
                           const EcefState<double>& start) {
  const auto earth = make_earth_model(wgs84());
  const auto gains = make_vertical_gains(20);
  const CountedAllocations here;
  auto x = M::from_ecef(earth, start);
  double integral = 0, sum = 0;
  for (std::size_t i = 0; i + 2 <= imu.size(); i += 2) {
    x = damped(step(earth, x, two_samples(imu[i], imu[i + 1])), 0.0, gains, 0.02, integral);
    x = handover<M>(earth, handover<Other>(earth, x));
    sum += M::to_ecef(earth, x).r.x;
  }
  EXPECT_TRUE(sum == sum);
  return here.count();
}
TEST(Allocations, NoneInTheStrapdownLoop) {
  const auto m = rocking();
  const auto imu = m.record(0.01, 2000);
  const auto start = m.at(0).state;
  EXPECT_EQ((strapdown_allocations<GeographicMechanization, TransverseMechanization>(imu, start)),
            0);
  EXPECT_EQ((strapdown_allocations<TransverseMechanization, GridMechanization>(imu, start)), 0);
  EXPECT_EQ((strapdown_allocations<GridMechanization, WanderMechanization>(imu, start)), 0);
  EXPECT_EQ((strapdown_allocations<WanderMechanization, EcefMechanization>(imu, start)), 0);
  EXPECT_EQ((strapdown_allocations<EcefMechanization, GeographicMechanization>(imu, start)), 0);
}

TEST(Allocations, NoneInTheReckoner) {
  const Ellipsoid ell = wgs84();
  const CountedAllocations here;
  auto a = reckon_start(55 * deg, 10 * deg);
  auto b = grid_start(89 * deg, 10 * deg);
  auto c = mechanised_start(55 * deg, 10 * deg);
  for (int i = 0; i < 2000; ++i) {
    for (Integrator k : {Integrator::kExact, Integrator::kMidpoint, Integrator::kStartLatitude})
      step_by(ell, k, a, 5.0, 3.0, 10.0);
    step_grid(ell, true, b, 10.0, 0.3, 0.0);
    step_mechanised(ell, c, 10.0, 0.3, 1.01, 0.01, 0.0, 0.1);
  }
  EXPECT_EQ(here.count(), 0);
  EXPECT_TRUE(a.lat + b.n.z + c.truth.lat == a.lat + b.n.z + c.truth.lat);
}

// All its witnesses in turn, measurements ahead of time and late, rows of the solution.
TEST(Allocations, NoneInTheFilter) {
  const auto m = rocking();
  NavigatorConfig config;
  config.ellipsoid = wgs84();
  config.gyro_noise = 0.01 * deg_per_sqrt_h, config.accel_noise = 0.01 * mps_per_sqrt_h;
  config.gyro_bias = 0.1 * deg_per_h, config.accel_bias = 100 * ug;
  config.standstill.sigma_w = 1e-4, config.standstill.sigma_f = 1e-3;
  NavigatorStart start;
  const auto s0 = m.at(0).state;
  start.state.r = s0.r, start.state.v = s0.v, start.state.q = s0.q_eb;
  for (int i = 0; i < kStates; ++i) start.P.p[i][i] = 1e-6;
  const auto imu = m.record(0.01, 3000);
  Navigator filter(config);
  FineAlignmentConfig fine;
  fine.sensors = config;
  FineAlignment aligned(fine, start);
  const CountedAllocations here;
  filter.start(start);
  double sum = 0;
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const double t = imu[i].t;
    if (i % 10 == 0) {
      filter.odometer({t + 0.05, 1.2, false});
      filter.velocity({t, {0.0, 12.0, 0.0}, false});
      filter.height({t - 0.02, 0.0, kNone});
      filter.heading({t, 40 * deg, 1 * deg});
    }
    if (i % 100 == 0) {
      const auto g = to_geodetic(config.ellipsoid, m.at(t).state.r);
      Fix f;
      f.t = t, f.lat = g.lat, f.lon = g.lon, f.h = g.h;
      f.std_e = f.std_n = f.std_u = 1;
      filter.fix(f);
      filter.benchmark(f);
    }
    filter.imu(imu[i]);
    aligned.add(imu[i]);
    sum += filter.row(FrameId::kGeographic).lat;
  }
  EXPECT_EQ(here.count(), 0);
  EXPECT_TRUE(sum == sum);
  EXPECT_GT(filter.innovations(Sensor::kFix).used, 0);  // it did something
}

}  // namespace
}  // namespace loxo
