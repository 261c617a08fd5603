#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_tissue/net/kernel.h"

namespace vest::net {

/// All arrays of one net in one 64-byte aligned piece of memory, so that an object's sub-steps stay in the first
/// cache level and arrays do not alias at 4 KiB. A value: copying it copies the State of the object.
/// Rows X … VZ and the link rows are State; FX …, HX …, PX … are scratch that lies beside them for locality.
class Block {
 public:
  enum KnotRow : std::size_t {
    X, Y, Z, VX, VY, VZ,            // m, m/s: State that evolves
    kInverseMass, kDecay, kMass,    // 1/kg (0 fixed), 1/s, kg
    HX, HY, HZ,                     // N: held over a batch
    FX, FY, FZ,                     // N: of a sub-step
    PX, PY, PZ,                     // m: predicted for the middle of a batch
    kKnotRows
  };
  enum LinkRow : std::size_t { kInverseRest, kModulus, kDamping, kNonlinear, kLinkRows };

  Block() = default;
  /// Room for that many knots and links (capacity), one padding knot more.
  Block(std::size_t knot_capacity, std::size_t link_capacity);

  std::size_t knots() const { return knots_; }
  std::size_t links() const { return links_; }
  std::size_t knotCapacity() const { return knot_capacity_; }
  std::size_t linkCapacity() const { return link_capacity_; }
  /// Real-time safe; false when the capacity is used up.
  bool addKnot(std::uint32_t& index);
  bool addLink(std::uint32_t knot0, std::uint32_t knot1, std::uint32_t& index);

  float* row(KnotRow r) { return floats() + r * knot_stride_; }
  const float* row(KnotRow r) const { return floats() + r * knot_stride_; }
  float* row(LinkRow r) { return floats() + kKnotRows * knot_stride_ + r * link_stride_; }
  const float* row(LinkRow r) const { return floats() + kKnotRows * knot_stride_ + r * link_stride_; }
  std::uint32_t* knot0() { return indices(); }
  const std::uint32_t* knot0() const { return indices(); }
  std::uint32_t* knot1() { return indices() + link_stride_; }
  const std::uint32_t* knot1() const { return indices() + link_stride_; }

  /// Pointers for the kernel; valid until the block is copied into or destroyed. Law members are the caller's.
  KernelArrays arrays();

  /// Positions and velocities (rows X … VZ), contiguous: what a step's backup keeps.
  float* motion() { return row(X); }
  const float* motion() const { return row(X); }
  std::size_t motionFloats() const { return 6 * knot_stride_; }

 private:
  static constexpr std::size_t kAlign = 64;
  float* floats() { return reinterpret_cast<float*>(lines_.data()); }
  const float* floats() const { return reinterpret_cast<const float*>(lines_.data()); }
  std::uint32_t* indices() {
    return reinterpret_cast<std::uint32_t*>(floats() + kKnotRows * knot_stride_ + kLinkRows * link_stride_);
  }
  const std::uint32_t* indices() const {
    return reinterpret_cast<const std::uint32_t*>(floats() + kKnotRows * knot_stride_ + kLinkRows * link_stride_);
  }

  struct alignas(kAlign) Line {
    float value[kAlign / sizeof(float)];
  };
  std::vector<Line> lines_;
  std::size_t knots_ = 0, links_ = 0, knot_capacity_ = 0, link_capacity_ = 0;
  std::size_t knot_stride_ = 0, link_stride_ = 0;  // entries
};

}  // namespace vest::net
