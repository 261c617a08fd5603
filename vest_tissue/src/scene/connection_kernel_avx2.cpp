// Built with -mavx2 and without FMA: see CMakeLists.txt. Called only where the processor has AVX2.
#include <immintrin.h>

#include "connection_kernel_body.h"

namespace vest::scene::kernel {
namespace {

struct Pack {
  using Mask = __m256d;
  __m256d v;
  static Pack broadcast(double a) { return {_mm256_set1_pd(a)}; }
  static Pack load(const double* p) { return {_mm256_loadu_pd(p)}; }
  static Pack load(const float* p) { return {_mm256_cvtps_pd(_mm_loadu_ps(p))}; }
  void store(double* p) const { _mm256_storeu_pd(p, v); }
  void store(float* p) const { _mm_storeu_ps(p, _mm256_cvtpd_ps(v)); }
};
Pack operator+(Pack a, Pack b) {
  return {_mm256_add_pd(a.v, b.v)};
}
Pack operator-(Pack a, Pack b) {
  return {_mm256_sub_pd(a.v, b.v)};
}
Pack operator*(Pack a, Pack b) {
  return {_mm256_mul_pd(a.v, b.v)};
}
Pack operator/(Pack a, Pack b) {
  return {_mm256_div_pd(a.v, b.v)};
}
Pack max(Pack a, Pack b) {
  return {_mm256_max_pd(a.v, b.v)};
}
Pack min(Pack a, Pack b) {
  return {_mm256_min_pd(a.v, b.v)};
}
Pack sqrt(Pack a) {
  return {_mm256_sqrt_pd(a.v)};
}
Pack abs(Pack a) {
  return {_mm256_andnot_pd(_mm256_set1_pd(-0.0), a.v)};
}
Pack::Mask operator<(Pack a, Pack b) {
  return _mm256_cmp_pd(a.v, b.v, _CMP_LT_OQ);
}
Pack where(Pack::Mask mask, Pack a, Pack b) {
  return {_mm256_blendv_pd(b.v, a.v, mask)};
}

}  // namespace

void pullAvx2(ConnectionLanes& lanes) {
  pull<Pack>(lanes);
}

}  // namespace vest::scene::kernel
