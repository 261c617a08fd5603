#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace vest::scene {

/// N on one knot and axis (the weight of a litre of water), N·s/m: what is beyond is set to these (assumed).
inline constexpr float kGreatestLoad = 10.0f, kGreatestLoadDamping = 10.0f;
/// N/m (a hundred square centimetres of water's surface), m
inline constexpr float kGreatestLoadStiffness = 100.0f, kGreatestLoadLevel = 1000.0f;
inline constexpr double kLongestLoad = 10.0;

/// Steady forces on an object's knots and the damping that comes with them, as of a pool: what acts goes over
/// linearly to what was last told, and then holds (docs/decisions/0025-…). The lift of a liquid follows the
/// knot at once: held, too, it would lag, and work organs up that float (docs/decisions/0025-…).
struct HeldLoad {
  enum : std::size_t { kX, kY, kZ, kDamping, kStiffness, kLevel, kCount };
  /// x y z in N, world, of a knot above the level; damping in N·s/m; stiffness in N/m and level in m: for
  /// each metre that the knot lies below it the stiffness is added to z
  using Of = std::array<float, kCount>;
  std::vector<Of> now, told;  ///< per knot, with room for those that cuts add
  std::vector<float> own;     ///< 1/s: decay of each knot without it, while there is any
  double left = 0.0;          ///< s until `now` is `told`
  bool any = false;           ///< false: all of both is zero

  /// A cut knot's load goes with the parts of its mass, so that the sum stays. @param share of the copy
  void divide(std::uint32_t knot, std::uint32_t copy, float share) {
    if (!any) return;
    own[copy] = own[knot];
    for (auto* a : {&now, &told}) {
      (*a)[copy][kLevel] = (*a)[knot][kLevel];
      for (std::size_t i = 0; i < kLevel; ++i) {
        const float part = share * (*a)[knot][i];
        (*a)[copy][i] = part;
        (*a)[knot][i] -= part;
      }
    }
  }
  /// N: what the liquid adds to z of a knot at height z (m)
  float lift(std::size_t knot, float z) const {
    return now[knot][kStiffness] * std::max(0.0f, now[knot][kLevel] - z);
  }
  /// One step of `dt` s.
  void go(double dt, std::size_t knots) {
    if (!any || left <= 0.0) return;
    if (dt >= left) {
      left = 0.0;
      for (std::size_t k = 0; k < knots; ++k) {
        if (told[k][kStiffness] == 0.0f) told[k][kLevel] = 0.0f;
        now[k] = told[k];
      }
      any = std::any_of(now.begin(), now.begin() + static_cast<std::ptrdiff_t>(knots),
                        [](const Of& f) { return f != Of{}; });
      return;
    }
    const auto share = static_cast<float>(dt / left);
    left -= dt;
    for (std::size_t k = 0; k < knots; ++k)
      for (std::size_t i = 0; i < Of{}.size(); ++i) now[k][i] += share * (told[k][i] - now[k][i]);
  }
};

}  // namespace vest::scene
