#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

/// Elementary functions for use inside a step: additions, multiplications and exact scalings only, so that
/// every machine gets the same bits (docs/conventions.md: those of libm differ between processors).
namespace vest::base {

/// exp(x); relative error below 1e-14 for -700 <= x <= 700, 0 below and exp(700) above.
/// x = n·ln2 + r, |r| <= ln2/2; Taylor series of exp(r) to the 12th power.
inline double exponential(double x) {
  if (!(x >= -700.0)) return 0.0;
  if (x > 700.0) x = 700.0;
  constexpr double kInverse = 1.4426950408889634, kHigh = 6.93147180369123816490e-01,
                   kLow = 1.90821492927058770002e-10;  // ln2 in two parts: n·kHigh is exact
  const double n = std::floor(x * kInverse + 0.5), r = (x - n * kHigh) - n * kLow;
  double sum = 1.0;
  for (int k = 12; k >= 1; --k) sum = 1.0 + sum * r / k;
  const std::uint64_t bits = static_cast<std::uint64_t>(static_cast<std::int64_t>(n) + 1023) << 52;
  double scale;
  std::memcpy(&scale, &bits, sizeof scale);
  return sum * scale;
}

/// sin(2·pi·turns); absolute error below 1e-11 for |turns| <= 1e5. Taylor series over a quarter turn.
inline double sineOfTurns(double turns) {
  double x = turns - std::floor(turns + 0.5);  // -1/2 … 1/2
  if (x > 0.25) x = 0.5 - x;
  if (x < -0.25) x = -0.5 - x;
  const double a = 6.283185307179586 * x, a2 = a * a;
  double sum = 1.0;
  for (int k = 16; k >= 2; k -= 2) sum = 1.0 - sum * a2 / (k * (k + 1));
  return a * sum;
}

}  // namespace vest::base
