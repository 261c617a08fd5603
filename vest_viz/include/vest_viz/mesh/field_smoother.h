#pragma once

#include <cstdint>
#include <vector>

namespace vest::mesh {

/// Spreads a field that knots carry over a skin that is finer than they are: what is linear between knots
/// shows their grid. Laplacian smoothing over the edges of the skin, half of the way each pass.
class FieldSmoother {
 public:
  /// @param triangles three vertices each; dead ones have no area
  /// @param knot_distance m, between neighbouring knots
  void build(const std::vector<std::uint32_t>& triangles, const std::vector<float>& positions,
             float knot_distance);
  /// @param values one per vertex, `stride` apart
  void smooth(std::uint8_t* values, std::size_t stride) const;
  int passes() const { return passes_; }

 private:
  std::vector<std::uint32_t> start_, neighbours_;
  int passes_ = 0;
  mutable std::vector<float> now_, next_;
};

}  // namespace vest::mesh
