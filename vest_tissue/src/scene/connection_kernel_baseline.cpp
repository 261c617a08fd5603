#include <cmath>

#include "connection_kernel_body.h"

namespace vest::scene::kernel {
namespace {

/// Four doubles in portable C++; the compiler turns the loops into whatever the base architecture has.
struct Pack {
  static constexpr std::size_t kCount = ConnectionLanes::kCount;
  struct Mask {
    bool v[kCount];
  };
  double v[kCount];
  template <class Work>
  static Pack each(Work work) {
    Pack r;
    for (std::size_t n = 0; n < kCount; ++n) r.v[n] = work(n);
    return r;
  }
  static Pack broadcast(double a) {
    return each([&](std::size_t) { return a; });
  }
  template <class Number>
  static Pack load(const Number* p) {
    return each([&](std::size_t n) { return static_cast<double>(p[n]); });
  }
  template <class Number>
  void store(Number* p) const {
    for (std::size_t n = 0; n < kCount; ++n) p[n] = static_cast<Number>(v[n]);
  }
};
Pack operator+(const Pack& a, const Pack& b) {
  return Pack::each([&](std::size_t n) { return a.v[n] + b.v[n]; });
}
Pack operator-(const Pack& a, const Pack& b) {
  return Pack::each([&](std::size_t n) { return a.v[n] - b.v[n]; });
}
Pack operator*(const Pack& a, const Pack& b) {
  return Pack::each([&](std::size_t n) { return a.v[n] * b.v[n]; });
}
Pack operator/(const Pack& a, const Pack& b) {
  return Pack::each([&](std::size_t n) { return a.v[n] / b.v[n]; });
}
// As the processor's max and min: the second operand where the comparison is false (NaN, equal zeros).
Pack max(const Pack& a, const Pack& b) {
  return Pack::each([&](std::size_t n) { return a.v[n] > b.v[n] ? a.v[n] : b.v[n]; });
}
Pack min(const Pack& a, const Pack& b) {
  return Pack::each([&](std::size_t n) { return a.v[n] < b.v[n] ? a.v[n] : b.v[n]; });
}
Pack sqrt(const Pack& a) {
  return Pack::each([&](std::size_t n) { return std::sqrt(a.v[n]); });
}
Pack abs(const Pack& a) {
  return Pack::each([&](std::size_t n) { return std::fabs(a.v[n]); });
}
Pack::Mask operator<(const Pack& a, const Pack& b) {
  Pack::Mask r;
  for (std::size_t n = 0; n < Pack::kCount; ++n) r.v[n] = a.v[n] < b.v[n];
  return r;
}
Pack where(const Pack::Mask& mask, const Pack& a, const Pack& b) {
  return Pack::each([&](std::size_t n) { return mask.v[n] ? a.v[n] : b.v[n]; });
}

}  // namespace

void pullBaseline(ConnectionLanes& lanes) {
  pull<Pack>(lanes);
}

}  // namespace vest::scene::kernel
