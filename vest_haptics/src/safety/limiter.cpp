#include "vest_haptics/safety/limiter.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace vest::haptics {
namespace {

constexpr double kShrink = 1.0 - 1e-12;  // rounding stays on the safe side

double largest(const double* x, int n) noexcept {
  double m = 0.0;
  for (int i = 0; i < n; ++i) m = std::max(m, std::abs(x[i]));
  return m;
}

double norm(const double* x, int n) noexcept {
  double sum = 0.0;
  for (int i = 0; i < n; ++i) sum += x[i] * x[i];
  return std::sqrt(sum);
}

// Shortens x to at most `most`; true if it had to. The first factor keeps the squares from overflowing.
bool shorten(double* x, int n, double most) noexcept {
  const double m = largest(x, n);
  bool cut = false;
  if (m > most) {
    for (int i = 0; i < n; ++i) x[i] = x[i] / m * most * kShrink;
    cut = true;
  }
  const double length = norm(x, n);
  if (length > most) {
    const double factor = most / length * kShrink;
    for (int i = 0; i < n; ++i) x[i] *= factor;
    cut = true;
  }
  return cut;
}

}  // namespace

bool isFinite(double x) noexcept {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  return (bits & 0x7ff0000000000000ull) != 0x7ff0000000000000ull;
}

Loads Limiter::zero() noexcept {
  last_.fill(0.0);
  return last_;
}

Loads Limiter::limit(const Loads& wanted, double allowance, std::uint32_t& flags) noexcept {
  const int groups = options_.joints ? kChannels : 1;
  const int size = options_.joints ? 1 : 3;
  for (int i = 0; i < groups * size; ++i) {
    if (!isFinite(wanted[i])) {
      flags |= kLimitNotFinite;
      return zero();
    }
  }
  if (!isFinite(allowance) || allowance < 0.0 || allowance > 1.0) {
    flags |= kLimitNotFinite;
    allowance = 0.0;
  }
  Loads out{};
  for (int g = 0; g < groups; ++g) {
    double target[3] = {}, step[3] = {};
    for (int i = 0; i < size; ++i) target[i] = wanted[g * size + i];
    if (shorten(target, size, options_.maximum[g] * kShrink)) flags |= kLimitMagnitude;
    for (int i = 0; i < size; ++i) {
      target[i] *= allowance;
      step[i] = target[i] - last_[g * size + i];
    }
    if (allowance > 0.0 && shorten(step, size, options_.slew_per_tick[g])) {
      flags |= kLimitSlew;
      // Between two vectors within the maximum lies nothing beyond it.
      for (int i = 0; i < size; ++i) target[i] = last_[g * size + i] + step[i];
    }
    for (int i = 0; i < size; ++i) out[g * size + i] = target[i];
  }
  last_ = out;
  return out;
}

}  // namespace vest::haptics
