// SPDX-License-Identifier: Apache-2.0
#include "loxo/ins/dead_reckoning.hpp"

#include "loxo/earth/rhumb.hpp"
#include "loxo/num/function_kernels.hpp"
#include "loxo/num/lanes.hpp"
#include "loxo/num/units.hpp"

namespace loxo {
namespace {

// A step is short below both: 2 km keeps the latitude series (order 3 in h/a, times e2) below 1e-16
// rad, 6e-4 of the distance from the axis keeps the next term of the mean rate, (h/r)^4/80, below
// 2e-15.
constexpr double kShortStep = 2000.0;
constexpr double kShortByAxis = 6e-4;
constexpr double kGridStep = 2000.0;

// hi + low += x without losing x's low digits (two-sum).
template <Real S>
inline void add_compensated(S& hi, S& low, S x) {
  const S y = x + low;
  const S t = hi + y;
  const S b = t - hi;
  low = (hi - (t - b)) + (y - b);
  hi = t;
}

// Sine and cosine of the latitude with its low part.
template <Real S>
inline void latitude_sincos(const ReckonState<S>& state, S& s, S& c) {
  S s0, c0;
  kernels::sincos(state.lat, s0, c0);
  s = s0 + c0 * state.lat_low;
  c = c0 - s0 * state.lat_low;
}

// dn *= M/(M+h), de *= N/(N+h): metres at height h to metres on the ellipsoid (vehicle.md 0).
template <Real S>
inline void reduce_height(const Ellipsoid& ell, S w2, S w, S h, S& dn, S& de) {
  if (!any(fabs(h) > S(0.0))) return;
  const double inverse_a = 1.0 / ell.a;
  const S e = S(1.0) + h * w * S(inverse_a);
  const S n = S(1.0) + h * w * w2 * S(inverse_a * (1.0 + ell.ep2));  // 1/(1 - e2) = 1 + ep2
  const S both = S(1.0) / (e * n);  // one division in a step's longest chain
  dn = dn * (e * both);
  de = de * (n * both);
}

template <Real S>
inline S nan_beyond_pole(S lat, S value) {
  return select(fabs(lat) > S(kPi / 2), S(kNone), value);
}

}  // namespace

template <Real S>
StepRates<S> step_exact(const Ellipsoid& ell, ReckonState<S>& state, S dn, S de, S h) {
  const S one(1.0);
  S s, c;
  latitude_sincos(state, s, c);
  const S e2(ell.e2);
  const S w2 = one - e2 * s * s;
  const S w = sqrt(w2);
  reduce_height(ell, w2, w, h, dn, de);

  // Latitude as a function of the arc, three derivatives (dL/dm = W^3/(a(1-e2))); z =
  // arc/(a(1-e2)).
  const S p = e2 * s * c;
  const S third = S(2.0) * p * p - S(0.5) * e2 * (c * c - s * s) * w2;
  const S second = S(-1.5) * p;
  const S w3 = w2 * w;
  const double inverse_a = 1.0 / ell.a, inverse_m = inverse_a * (1.0 + ell.ep2);
  const S inverse_polar(inverse_m);
  const S z = dn * inverse_polar, zh = S(0.5) * z;
  const S d = w3 * z * (one + w * z * (second + w * z * third));
  const S dh = w3 * zh * (one + w * zh * (second + w * zh * third));

  // sin and cos at mid-step by a small turn, then the mean rate: midpoint and its second derivative
  // (V-8), (V-10).
  const S dh2 = dh * dh;
  const S sd = dh * (one - dh2 * S(1.0 / 6.0) * (one - dh2 * S(1.0 / 20.0)));
  const S cd = one - dh2 * S(0.5) * (one - dh2 * S(1.0 / 12.0));
  S sm = s * cd + c * sd;
  const S cm = c * cd - s * sd;
  const S wm2 = one - e2 * sm * sm;
  const S wm = sqrt(wm2);
  S rate = wm / (S(ell.a) * cm);
  const S curvature = wm2 * wm2 * S(inverse_a * inverse_m);
  const S sr = sm * rate;
  S mean = rate * (one + dn * dn * S(1.0 / 24.0) * (curvature + S(2.0) * sr * sr));
  S dlat = d;

  const S far = max(fabs(dn) - S(kShortStep), fabs(dn) * wm - S(kShortByAxis * ell.a) * cm);
  const auto is_long = far > S(0.0);
  if (any(is_long)) {
    const S lat0 = state.lat + state.lat_low;
    const S m1 = meridian_arc(ell, lat0) + dn;
    const S quarter(ell.quarter_meridian);
    const S bad = select(fabs(m1) > quarter, S(kNone), S(0.0));
    // Up to 2 km the latitude keeps its series, also beside the pole: a difference of two arcs
    // would lose 1e-9 m every time.
    const auto is_far = fabs(dn) > S(kShortStep);
    if (any(is_far))
      dlat =
          select(is_far, latitude_of_arc(ell, select(fabs(m1) > quarter, S(0.0), m1)) - lat0, dlat);
    dlat = select(is_long, dlat + bad, dlat);
    const S lat1 = lat0 + dlat;
    const S mean_long = isometric_divided_difference(ell, lat0, lat1);
    const S mid = S(0.5) * (lat0 + lat1);
    mean = select(is_long, mean_long, mean);
    sm = select(is_long, sin(mid), sm);
    rate = select(is_long, isometric_rate(ell, mid), rate);
  }
  add_compensated(state.lat, state.lat_low, dlat);
  add_compensated(state.lon, state.lon_low, de * mean);
  return {dn, de, mean, sm * rate * rate, sm};
}

template <Real S>
void step_midpoint(const Ellipsoid& ell, ReckonState<S>& state, S dn, S de, S h) {
  // (V-7)
  S s, c;
  latitude_sincos(state, s, c);
  const S dmid = S(0.5) * dn / (meridian_radius(ell, s) + h);
  const S mid = state.lat + (state.lat_low + dmid);
  kernels::sincos(mid, s, c);
  const S dlat = dn / (meridian_radius(ell, s) + h);
  const S dlon = de / ((prime_vertical_radius(ell, s) + h) * c);
  add_compensated(state.lat, state.lat_low, nan_beyond_pole(state.lat + dlat, dlat));
  add_compensated(state.lon, state.lon_low, dlon);
}

template <Real S>
void step_start_latitude(const Ellipsoid& ell, ReckonState<S>& state, S dn, S de, S h) {
  // (V-6)
  S s, c;
  latitude_sincos(state, s, c);
  const S dlat = dn / (meridian_radius(ell, s) + h);
  const S dlon = de / ((prime_vertical_radius(ell, s) + h) * c);
  add_compensated(state.lat, state.lat_low, nan_beyond_pole(state.lat + dlat, dlat));
  add_compensated(state.lon, state.lon_low, dlon);
}

template <Real S>
void step_by(const Ellipsoid& ell, Integrator integrator, ReckonState<S>& state, S dn, S de, S h) {
  switch (integrator) {
    case Integrator::kExact:
      step_exact(ell, state, dn, de, h);
      break;
    case Integrator::kMidpoint:
      step_midpoint(ell, state, dn, de, h);
      break;
    case Integrator::kStartLatitude:
      step_start_latitude(ell, state, dn, de, h);
      break;
  }
}

template <Real S>
GridState<S> grid_start(S lat, S lon) {
  S sl, cl, so, co;
  kernels::sincos(lat, sl, cl);
  kernels::sincos(lon, so, co);
  return {{cl * co, cl * so, sl}};
}

template <Real S>
GridAxes<S> grid_axes(bool north, const Vec<Ecef, S>& n) {
  // (V-11); the south is the north mirrored: (X, Y, Z) -> (X, -Y, -Z), and the image of grid north
  // changes sign.
  const S sign(north ? 1.0 : -1.0);
  const S x = n.x, y = sign * n.y, z = sign * n.z;
  const S k = S(1.0) / (S(1.0) + z);
  const Vec<Ecef, S> gn{x * x * k - S(1.0), x * y * k, x};
  const Vec<Ecef, S> ge{-(x * y * k), S(1.0) - y * y * k, -y};
  return {{sign * gn.x, gn.y, gn.z}, {sign * ge.x, ge.y, ge.z}};
}

namespace {

// dn/ds of (V-11): along the tangent t, the meridian part with its own radius.
template <Real S>
inline Vec<Ecef, S> grid_rate(const Ellipsoid& ell, bool north, const Vec<Ecef, S>& n, S cg, S sg) {
  const auto axes = grid_axes(north, n);
  const Vec<Ecef, S> t = cg * axes.north + sg * axes.east;
  // Of c = (-ZX, -ZY, 1 - Z^2) and t on the sphere: t . c = t_z, since t . n = 0.
  const Vec<Ecef, S> meridian{-(n.z * n.x), -(n.z * n.y), S(1.0) - n.z * n.z};
  const S w = sqrt(S(1.0) - S(ell.e2) * n.z * n.z);
  return (w * S(1.0 / ell.a)) * (t + (S(ell.ep2) * t.z) * meridian);
}

template <Real S>
inline Vec<Ecef, S> choose(MaskOf<S> m, const Vec<Ecef, S>& a, const Vec<Ecef, S>& b) {
  return {select(m, a.x, b.x), select(m, a.y, b.y), select(m, a.z, b.z)};
}

}  // namespace

template <Real S>
void step_grid(const Ellipsoid& ell, bool north, GridState<S>& state, S ds, S grid_heading, S h) {
  S sg, cg;
  kernels::sincos(grid_heading, sg, cg);
  if (any(fabs(h) > S(0.0))) {
    // The step's own radius of curvature at its start: 1/r = |dn/ds|.
    const auto rate = grid_rate(ell, north, state.n, cg, sg);
    ds = ds / (S(1.0) + h * norm(rate));
  }
  // A step of more than the Earth's size, or NaN, is no step at all: it ends as NaN below.
  const S poison = (ds + grid_heading) * S(0.0) + select(fabs(ds) > S(1e8), S(kNone), S(0.0));
  S left = select(fabs(ds) > S(1e8), S(0.0), ds);
  const S half(0.5);
  while (any(fabs(left) > S(0.0))) {
    const S step = copysign(min(fabs(left), S(kGridStep)), left);
    const Vec<Ecef, S> n = state.n;
    const auto k1 = grid_rate(ell, north, n, cg, sg);
    const auto k2 = grid_rate(ell, north, n + (half * step) * k1, cg, sg);
    const auto k3 = grid_rate(ell, north, n + (half * step) * k2, cg, sg);
    const auto k4 = grid_rate(ell, north, n + step * k3, cg, sg);
    Vec<Ecef, S> next = n + (step * S(1.0 / 6.0)) * (k1 + S(2.0) * (k2 + k3) + k4);
    next = (S(1.0) / norm(next)) * next;
    state.n = choose<S>(fabs(step) > S(0.0), next, n);
    left = left - step;
  }
  state.n.x = state.n.x + poison;
}

template <Real S>
void latlon_of_normal(const Vec<Ecef, S>& n, S& lat, S& lon) {
  lat = atan2(n.z, sqrt(n.x * n.x + n.y * n.y));
  lon = atan2(n.y, n.x);
}

namespace {

// Meridian convergence gained over the first half of a step: ds sin(psi) tan(L)/(2N) (V-42).
template <Real S>
inline S half_convergence_rate(const Ellipsoid& ell, const ReckonState<S>& state) {
  S s, c;
  latitude_sincos(state, s, c);
  return S(0.5) * s * sqrt(S(1.0) - S(ell.e2) * s * s) / (S(ell.a) * c);
}

template <Real S>
inline S sin_latitude(const ReckonState<S>& state) {
  S s, c;
  latitude_sincos(state, s, c);
  return s;
}

// Both tracks advance by their own step; convergence and Earth rate are summed.
template <Real S>
inline void advance(const Ellipsoid& ell, MechanisedState<S>& state, S ds_rec, S psi_rec, S ds_true,
                    S psi, S h, S dt) {
  if (any(fabs(dt) > S(0.0)))
    state.earth =
        state.earth + S(ell.w_ie) * dt * (sin_latitude(state.recorded) - sin_latitude(state.truth));
  S s, c;
  kernels::sincos(psi_rec, s, c);
  auto rates = step_exact(ell, state.recorded, ds_rec * c, ds_rec * s, h);
  state.chi_recorded = state.chi_recorded + rates.sin_mid * rates.mean_rate * ds_rec * s;
  kernels::sincos(psi, s, c);
  rates = step_exact(ell, state.truth, ds_true * c, ds_true * s, h);
  state.chi_truth = state.chi_truth + rates.sin_mid * rates.mean_rate * ds_true * s;
}

}  // namespace

template <Real S>
S step_mechanised(const Ellipsoid& ell, MechanisedState<S>& state, S ds, S psi_rec, S k, S eps, S h,
                  S dt) {
  // (V-42). The half step of the true track depends on the heading sought; the dependence is ds
  // tan(L)/2N, so that two passes leave its cube.
  const S chi_rec =
      state.chi_recorded + ds * sin(psi_rec) * half_convergence_rate(ell, state.recorded);
  const S ds_true = ds / k;
  const S half_true = ds_true * half_convergence_rate(ell, state.truth);
  const S known = psi_rec - eps - (chi_rec - state.chi_truth) - state.earth;
  S psi = known;
  psi = known + half_true * sin(psi);
  psi = known + half_true * sin(psi);
  advance(ell, state, ds, psi_rec, ds_true, psi, h, dt);
  return psi;
}

template <Real S>
S record_mechanised(const Ellipsoid& ell, MechanisedState<S>& state, S ds_true, S psi, S k, S eps,
                    S h, S dt) {
  // (V-12) with chi at mid-step.
  const S chi_true = state.chi_truth + ds_true * sin(psi) * half_convergence_rate(ell, state.truth);
  const S ds_rec = ds_true * k;
  const S half_rec = ds_rec * half_convergence_rate(ell, state.recorded);
  const S known = psi + eps + (state.chi_recorded - chi_true) + state.earth;
  S psi_rec = known;
  psi_rec = known + half_rec * sin(psi_rec);
  psi_rec = known + half_rec * sin(psi_rec);
  advance(ell, state, ds_rec, psi_rec, ds_true, psi, h, dt);
  return psi_rec;
}

#define LOXO_INSTANTIATE(S)                                                            \
  template StepRates<S> step_exact(const Ellipsoid&, ReckonState<S>&, S, S, S);        \
  template void step_midpoint(const Ellipsoid&, ReckonState<S>&, S, S, S);             \
  template void step_start_latitude(const Ellipsoid&, ReckonState<S>&, S, S, S);       \
  template void step_by(const Ellipsoid&, Integrator, ReckonState<S>&, S, S, S);       \
  template GridState<S> grid_start(S, S);                                              \
  template GridAxes<S> grid_axes(bool, const Vec<Ecef, S>&);                           \
  template void step_grid(const Ellipsoid&, bool, GridState<S>&, S, S, S);             \
  template void latlon_of_normal(const Vec<Ecef, S>&, S&, S&);                         \
  template S step_mechanised(const Ellipsoid&, MechanisedState<S>&, S, S, S, S, S, S); \
  template S record_mechanised(const Ellipsoid&, MechanisedState<S>&, S, S, S, S, S, S);
LOXO_INSTANTIATE(double)
LOXO_INSTANTIATE(Lanes)
#undef LOXO_INSTANTIATE

}  // namespace loxo
