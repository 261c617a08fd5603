#pragma once

#include <cstdint>
#include <cstring>

/// Functions that give the same bits on every processor: sums, products and exact scalings only (libm's
/// differ between machines with and without FMA; docs: "Arithmetic"). All are total: no errors, no traps.
namespace vest::effects {

/// 2^n for -1022 <= n <= 1023, exact.
inline double powerOfTwo(int n) {
  const std::uint64_t bits = static_cast<std::uint64_t>(n + 1023) << 52;
  double x;
  std::memcpy(&x, &bits, sizeof x);
  return x;
}

/// e^x, relative error below 1e-14 for |x| <= 700; clamped beyond. x = n ln 2 + r, |r| <= ln 2/2, Taylor sum
/// of e^r to the 13th power.
inline double exponential(double x) {
  if (!(x > -700.0)) return 0.0;
  if (x > 700.0) x = 700.0;
  const double scaled = x * 1.4426950408889634;
  const int n = static_cast<int>(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
  const double r = (x - n * 0.693147180369123816490) - n * 1.90821492927058770002e-10;  // ln 2 in two parts
  double sum = 1.0;
  for (int k = 13; k >= 1; --k) sum = 1.0 + sum * r / k;
  return sum * powerOfTwo(n);
}

/// ln x for normal x > 0, absolute error below 1e-14·max(1, |ln x|); -700 for anything else. x = 2^n m with m
/// in [√½, √2): 2 artanh((m−1)/(m+1)), sum to the 27th power.
inline double logarithm(double x) {
  if (!(x > 1e-300)) return -700.0;
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof x);
  int n = static_cast<int>(bits >> 52) - 1023;
  bits = (bits & 0x000fffffffffffffULL) | 0x3ff0000000000000ULL;
  double m;
  std::memcpy(&m, &bits, sizeof m);
  if (m > 1.4142135623730951) m *= 0.5, ++n;
  const double s = (m - 1.0) / (m + 1.0), s2 = s * s;
  double sum = 0.0;
  for (int k = 27; k >= 1; k -= 2) sum = sum * s2 + 1.0 / k;
  return n * 0.69314718055994530942 + 2.0 * s * sum;
}

/// x^y for x > 0; 0 for x <= 0.
inline double power(double x, double y) {
  return x > 0.0 ? exponential(y * logarithm(x)) : 0.0;
}

}  // namespace vest::effects
