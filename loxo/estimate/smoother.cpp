// SPDX-License-Identifier: Apache-2.0
#include "loxo/estimate/smoother.hpp"

#include <algorithm>
#include <cstring>

#include "loxo/num/error.hpp"

namespace loxo {
namespace {

enum Kind { kTransition = 1, kMeasurement = 2, kEpoch = 3 };
constexpr int kUpper = kAllStates * (kAllStates + 1) / 2;
constexpr int kNominal = static_cast<int>((sizeof(NominalState) + 7) / 8);
constexpr std::size_t kBlock = 1u << 19;  // doubles read at a time: 4 MB

// Reads records from the end of a file to its beginning.
class Backward {
 public:
  explicit Backward(std::FILE* f) : file_(f) {
    std::fseek(f, 0, SEEK_END);
    left_ = static_cast<std::uint64_t>(std::ftell(f)) / 8;
  }
  // The next record (its kind, or 0 at the beginning); valid until the next call.
  int next(const double*& data, int& count) {
    if (!need(1)) return 0;
    double trailer;
    trailer = buffer_[end_ - 1];
    const int t = static_cast<int>(trailer);
    const int kind = t % 4;
    count = t / 4;
    if (!need(static_cast<std::size_t>(count) + 1))
      throw Error(ErrorKind::kWork, "the smoother's temporary file is damaged");
    end_ -= static_cast<std::size_t>(count) + 1;
    data = buffer_.data() + end_;
    return kind;
  }

 private:
  bool need(std::size_t n) {  // buffer_[begin_, end_) holds at least n
    if (end_ >= n) return true;
    std::vector<double> tail(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(end_));
    const std::size_t more =
        static_cast<std::size_t>(std::min<std::uint64_t>(left_, std::max(kBlock, n)));
    if (more == 0) return end_ >= n && n > 0 && end_ > 0;
    buffer_.resize(more + tail.size());
    left_ -= more;
    std::fseek(file_, static_cast<long>(left_ * 8), SEEK_SET);
    if (std::fread(buffer_.data(), 8, more, file_) != more)
      throw Error(ErrorKind::kWork, "the smoother's temporary file cannot be read back");
    std::copy(tail.begin(), tail.end(), buffer_.begin() + static_cast<std::ptrdiff_t>(more));
    end_ = buffer_.size();
    return end_ >= n;
  }
  std::FILE* file_;
  std::uint64_t left_ = 0;
  std::vector<double> buffer_;
  std::size_t end_ = 0;
};

}  // namespace

SmootherTape::SmootherTape(bool extra) : file_(open_spool()), extra_(extra) {}
SmootherTape::~SmootherTape() = default;

void SmootherTape::put(int kind, const double* data, int count) {
  const double trailer = 4.0 * count + kind;
  const auto n = static_cast<std::size_t>(count);
  if (std::fwrite(data, 8, n, file_.get()) != n || std::fwrite(&trailer, 8, 1, file_.get()) != 1)
    spool_failed("the smoother's steps");
  bytes_ += 8 * (n + 1);
}
void SmootherTape::transition(const TransitionProduct& f) {
  double out[12 * kAllStates];
  double* o = out;
  for (int i = 0; i < 12; ++i) {
    o = std::copy_n(f.f[kMovingRows[i]], kStates, o);
    if (extra_) o = std::copy_n(f.extra[kMovingRows[i]], kExtra, o);
  }
  put(kTransition, out, static_cast<int>(o - out));
}
void SmootherTape::measurement(const SparseRow<double>& h, double s, double y, const double* gain) {
  double out[3 + 2 * SparseRow<double>::kMax + kAllStates];
  int n = 0;
  out[n++] = s;
  out[n++] = y;
  out[n++] = h.n;
  for (int i = 0; i < h.n; ++i) {
    out[n++] = h.index[i];
    out[n++] = h.value[i];
  }
  const int states = extra_ ? kAllStates : kStates;
  std::copy_n(gain, states, out + n);
  put(kMeasurement, out, n + states);
}
void SmootherTape::epoch(const NominalState& nominal, const Covariance<kStates>& P,
                         const ExtraCovariance* X, std::uint32_t health) {
  double out[kNominal + kUpper + 1]{};
  std::memcpy(out, &nominal, sizeof nominal);
  int n = kNominal;
  for (int i = 0; i < kStates; ++i) {
    for (int j = i; j < kStates; ++j) out[n++] = P.p[i][j];
    for (int j = 0; extra_ && j < kExtra; ++j) out[n++] = X ? X->c[i][j] : 0.0;
  }
  for (int i = 0; extra_ && i < kExtra; ++i)
    for (int j = i; j < kExtra; ++j) out[n++] = X ? X->e[i][j] : 0.0;
  out[n++] = health;
  put(kEpoch, out, n);
}

void SmootherTape::smooth(const Emit& emit) {
  if (extra_)
    smooth_states<kAllStates>(emit);
  else
    smooth_states<kStates>(emit);
}
template <int N>
void SmootherTape::smooth_states(const Emit& emit) {
  constexpr int kLd = (N + 7) / 8 * 8;
  std::fflush(file_.get());
  if (std::ferror(file_.get())) spool_failed("the smoother's steps");
  Backward back(file_.get());
  struct alignas(64) Matrix {
    double m[N][kLd]{};
  };
  auto L = std::make_unique<Matrix>();  // Lambda
  auto W = std::make_unique<Matrix>();
  auto P = std::make_unique<Matrix>();
  auto Ps = std::make_unique<Covariance<kStates>>();
  alignas(64) double f[12][kLd]{};
  double lambda[kLd]{};
  bool moving[N]{};
  for (int r : kMovingRows) moving[r] = true;

  const double* data;
  int count;
  for (int kind; (kind = back.next(data, count)) != 0;) {
    if (kind == kTransition) {  // lambda <- F^T lambda, Lambda <- F^T Lambda F
      for (int i = 0; i < 12; ++i) std::copy_n(data + i * N, N, f[i]);
      double next[kLd]{};
      for (int j = 0; j < N; ++j) next[j] = moving[j] ? 0.0 : lambda[j];
      for (int i = 0; i < 12; ++i) {
        const double l = lambda[kMovingRows[i]];
        for (int j = 0; j < kLd; ++j) next[j] += l * f[i][j];
      }
      std::copy_n(next, kLd, lambda);
      for (int r = 0; r < N; ++r) {  // W = Lambda F
        double* __restrict w = W->m[r];
        for (int j = 0; j < N; ++j) w[j] = moving[j] ? 0.0 : L->m[r][j];
        for (int i = 0; i < 12; ++i) {
          const double l = L->m[r][kMovingRows[i]];
          const double* __restrict fi = f[i];
          for (int j = 0; j < kLd; ++j) w[j] += l * fi[j];
        }
      }
      for (int r = 0; r < N; ++r) {  // Lambda = F^T W
        double* __restrict o = L->m[r];
        if (moving[r]) {
          for (int j = 0; j < kLd; ++j) o[j] = 0;
        } else {
          for (int j = 0; j < kLd; ++j) o[j] = W->m[r][j];
        }
        for (int i = 0; i < 12; ++i) {
          const double l = f[i][r];
          const double* __restrict w = W->m[kMovingRows[i]];
          for (int j = 0; j < kLd; ++j) o[j] += l * w[j];
        }
      }
      for (int r = 0; r < N; ++r)
        for (int j = 0; j < r; ++j) L->m[r][j] = L->m[j][r] = 0.5 * (L->m[r][j] + L->m[j][r]);
    } else if (kind == kMeasurement) {
      const double s = data[0], y = data[1];
      const int n = static_cast<int>(data[2]);
      const double* h = data + 3;
      const double* K = h + 2 * n;
      double kl = y / s, g[kLd]{}, kg = 1.0 / s;
      for (int i = 0; i < N; ++i) kl += K[i] * lambda[i];
      for (int i = 0; i < N; ++i) {
        const double* row = L->m[i];
        double sum = 0;
        for (int j = 0; j < N; ++j) sum += row[j] * K[j];
        g[i] = sum;
      }
      for (int i = 0; i < N; ++i) kg += K[i] * g[i];
      for (int a = 0; a < n; ++a) lambda[static_cast<int>(h[2 * a])] -= h[2 * a + 1] * kl;
      // Lambda - H^T g^T - g H + H^T (K^T g + 1/S) H
      for (int a = 0; a < n; ++a) {
        const int i = static_cast<int>(h[2 * a]);
        const double v = h[2 * a + 1];
        for (int j = 0; j < N; ++j) {
          L->m[i][j] -= v * g[j];
          L->m[j][i] -= v * g[j];
        }
        for (int b = 0; b < n; ++b) L->m[i][static_cast<int>(h[2 * b])] += v * h[2 * b + 1] * kg;
      }
    } else {
      NominalState state;
      std::memcpy(static_cast<void*>(&state), data, sizeof state);
      int n = kNominal;
      for (int i = 0; i < N; ++i)
        for (int j = i; j < N; ++j) P->m[i][j] = P->m[j][i] = data[n++];
      const auto health = static_cast<std::uint32_t>(data[n]);
      double x[N];
      for (int i = 0; i < N; ++i) {
        double sum = 0;
        for (int j = 0; j < N; ++j) sum += P->m[i][j] * lambda[j];
        x[i] = -sum;
        double* __restrict w = W->m[i];  // W = P Lambda
        for (int j = 0; j < kLd; ++j) w[j] = 0;
        for (int k = 0; k < N; ++k) {
          const double p = P->m[i][k];
          const double* __restrict l = L->m[k];
          for (int j = 0; j < kLd; ++j) w[j] += p * l[j];
        }
      }
      const auto smoothed = [&](int i, int j) {
        double sum = 0;
        for (int k = 0; k < N; ++k) sum += W->m[i][k] * P->m[k][j];
        return P->m[i][j] - sum;
      };
      for (int i = 0; i < kStates; ++i)
        for (int j = 0; j < kStates; ++j)
          Ps->p[i][j] = i == j || (i < 9 && j < 9) ? smoothed(i, j) : P->m[i][j];
      feed_back(state, x);
      if constexpr (N > kStates) {
        for (int i = 0; i < kExtra; ++i) extra_variance_[i] = smoothed(kStates + i, kStates + i);
        feed_back_extra(state, x + kStates);
      }
      emit(state, *Ps, health);
    }
  }
}

}  // namespace loxo
