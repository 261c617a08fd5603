#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_tissue/net/tube_map.h"

namespace vest::net {

/// Rings of a tube after cuts, which double its knots. A ring then has two sides: the wall towards the ring
/// before it hangs on some versions of its knots, the wall towards the ring after it on others. Where nothing
/// is cut both are the ring of the tube map.
class CutRings {
 public:
  /// Versions of a ring's knots in the order around it. Where a slit has doubled a knot both are there.
  struct Ring {
    const std::uint32_t* knots = nullptr;
    std::size_t count = 0;
    const std::uint8_t* joined = nullptr;  ///< per knot: wall leads to the next one; null: everywhere
    const std::uint32_t* begin() const { return knots; }
    const std::uint32_t* end() const { return knots + count; }
    bool joins(std::size_t i) const { return joined == nullptr || joined[i] != 0; }
  };

  /// @param knots of the object's scene
  void reserve(const TubeMap& tube, std::size_t knots);
  void forget() { revision_ = kNever; }
  /// @param original per knot: the scene's knot of which it is a copy @param revision of the topology
  /// Work only where the revision is another one. Allocates nothing.
  template <typename Original>
  void renew(const TubeMap& tube, const std::vector<std::array<std::uint32_t, 3>>& triangles,
             const std::vector<std::uint8_t>& alive, std::uint32_t revision, bool any_copy,
             Original original) {
    if (revision == revision_ || start_.empty()) return;
    revision_ = revision;
    cut_ = any_copy;
    if (!cut_) return;
    count_.assign(count_.size(), 0);
    joined_.assign(joined_.size(), 0);
    for (const bool join : {false, true}) {
      for (std::size_t i = 0; i < triangles.size(); ++i) {
        if (alive[i] == 0) continue;
        const auto& t = triangles[i];
        const std::array<std::uint32_t, 3> of{original(t[0]), original(t[1]), original(t[2])};
        place(tube, t, of, join);
      }
    }
  }
  /// @param above the side towards the next ring
  Ring ring(const TubeMap& tube, std::size_t ring, bool above) const {
    if (!cut_ || start_.empty()) return {tube.knots(ring).data(), tube.knots(ring).size(), nullptr};
    const std::size_t part = 2 * ring + (above ? 1 : 0);
    return {knots_.data() + start_[part], count_[part], joined_.data() + start_[part]};
  }
  /// Whether both sides of a ring hang on the same knots.
  bool whole(const TubeMap& tube, std::size_t ring) const;
  bool cut() const { return cut_; }

 private:
  static constexpr std::uint32_t kNever = ~0u;
  void place(const TubeMap& tube, const std::array<std::uint32_t, 3>& triangle,
             const std::array<std::uint32_t, 3>& of, bool join);
  std::size_t find(std::size_t part, std::uint32_t knot) const;  ///< its place there; the count: none
  void insert(std::size_t part, std::uint32_t knot, std::uint32_t order);

  std::uint32_t revision_ = kNever;
  bool cut_ = false;
  std::vector<std::uint32_t> order_;  ///< per knot of the scene: its place in its ring
  std::vector<std::uint32_t> start_;  ///< per side of a ring, into the two below: room for twice its knots
  std::vector<std::uint32_t> count_;  ///< per side of a ring
  std::vector<std::uint32_t> knots_, order_of_;
  std::vector<std::uint8_t> joined_;
};

}  // namespace vest::net
