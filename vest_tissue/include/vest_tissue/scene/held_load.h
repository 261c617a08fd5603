#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vest::scene {

/// N on one knot and axis, the weight of a litre of water, and s: what is beyond is set to these (ours).
inline constexpr float kGreatestLoad = 10.0f;
inline constexpr double kLongestLoad = 10.0;

/// Steady forces on an object's knots, as a pool's weight: what acts goes over linearly to what was last told,
/// and then holds (docs/decisions/0350-…).
struct HeldLoad {
  std::vector<float> now, told;  ///< N, world: x y z per knot, with room for the knots that cuts add
  double left = 0.0;             ///< s until `now` is `told`
  bool any = false;              ///< false: all of both is zero

  /// A cut knot's load goes with the parts of its mass, so that the sum stays. @param share of the copy
  void divide(std::uint32_t knot, std::uint32_t copy, float share) {
    if (!any) return;
    for (auto* a : {&now, &told}) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        float& whole = (*a)[3 * knot + axis];
        const float part = share * whole;
        (*a)[3 * copy + axis] = part;
        whole -= part;
      }
    }
  }
  /// One step of `dt` s.
  void go(double dt, std::size_t knots) {
    if (!any || left <= 0.0) return;
    const std::size_t n = 3 * knots;
    if (dt >= left) {
      left = 0.0;
      std::copy_n(told.begin(), n, now.begin());
      any = std::any_of(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(n),
                        [](float f) { return f != 0.0f; });
      return;
    }
    const auto share = static_cast<float>(dt / left);
    left -= dt;
    for (std::size_t i = 0; i < n; ++i) now[i] += share * (told[i] - now[i]);
  }
};

}  // namespace vest::scene
