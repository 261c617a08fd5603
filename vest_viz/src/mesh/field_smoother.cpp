#include "vest_viz/mesh/field_smoother.h"

#include <algorithm>
#include <cmath>

namespace vest::mesh {
namespace {

/// Deviation of the smoothing over the distance of knots: a grid of this pitch keeps 1 % of its contrast
/// (exp(-2 pi² · 0.48²)).
constexpr float kWidth = 0.48f;
constexpr int kMostPasses = 24;

}  // namespace

void FieldSmoother::build(const std::vector<std::uint32_t>& triangles, const std::vector<float>& positions,
                          float knot_distance) {
  const std::size_t n = positions.size() / 3;
  std::vector<std::uint64_t> edges;
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const std::uint32_t* v = &triangles[t];
    if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = v[k], b = v[(k + 1) % 3];
      edges.push_back(a << 32 | b);
      edges.push_back(b << 32 | a);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  start_.assign(n + 1, 0);
  neighbours_.clear();
  double sum = 0;
  for (const std::uint64_t e : edges) {
    const auto a = static_cast<std::size_t>(e >> 32), b = static_cast<std::size_t>(e & 0xffffffffu);
    ++start_[a + 1];
    neighbours_.push_back(static_cast<std::uint32_t>(b));
    float squared = 0;
    for (std::size_t d = 0; d < 3; ++d)
      squared +=
          (positions[3 * a + d] - positions[3 * b + d]) * (positions[3 * a + d] - positions[3 * b + d]);
    sum += static_cast<double>(squared);
  }
  for (std::size_t v = 0; v < n; ++v) start_[v + 1] += start_[v];
  passes_ = 0;
  if (edges.empty() || !(sum > 0)) return;
  // Half of the way to neighbours at distance e moves a value by a variance of e²/4 along each of two axes.
  const double edge2 = sum / static_cast<double>(edges.size());
  const double wanted = static_cast<double>(kWidth * knot_distance * kWidth * knot_distance);
  passes_ = static_cast<int>(std::clamp(std::lround(wanted / (0.25 * edge2)), 0L, long{kMostPasses}));
}

void FieldSmoother::smooth(std::uint8_t* values, std::size_t stride) const {
  const std::size_t n = start_.empty() ? 0 : start_.size() - 1;
  if (passes_ == 0 || n == 0) return;
  now_.resize(n), next_.resize(n);
  bool any = false;
  for (std::size_t v = 0; v < n; ++v) {
    now_[v] = static_cast<float>(values[v * stride]);
    any = any || values[v * stride] != 0;
  }
  if (!any) return;
  for (int pass = 0; pass < passes_; ++pass) {
    for (std::size_t v = 0; v < n; ++v) {
      float sum = 0;
      for (std::uint32_t k = start_[v]; k < start_[v + 1]; ++k) sum += now_[neighbours_[k]];
      const auto count = static_cast<float>(start_[v + 1] - start_[v]);
      next_[v] = count > 0 ? 0.5f * (now_[v] + sum / count) : now_[v];
    }
    std::swap(now_, next_);
  }
  for (std::size_t v = 0; v < n; ++v) values[v * stride] = static_cast<std::uint8_t>(now_[v] + 0.5f);
}

}  // namespace vest::mesh
