#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_tissue/net/link_kernel.h"

namespace vest::net {

/// All arrays over the knots of one net in one 64-byte aligned piece of memory, so that an object's sub-steps
/// stay in the first cache level and arrays do not alias at 4 KiB. A value: copying it copies the State of
/// the object. Rows X … kMass are State; the others are scratch that lies beside them for locality.
class Block {
 public:
  enum KnotRow : std::size_t {
    X,
    Y,
    Z,
    VX,
    VY,
    VZ,  // m, m/s: State that evolves
    FX,
    FY,
    FZ,  // N: of a sub-step
    HX,
    HY,
    HZ,  // N: held over a batch
    kKeep,
    kPush,  // no unit, s/kg: of the sub-step in use (net::MotionArrays)
    kInverseMass,
    kDecay,
    kMass,  // 1/kg (0 fixed), 1/s, kg: State that cuts and loads change
    PX,
    PY,
    PZ,       // m: predicted for the middle of a batch
    kPacked,  // kPackedFloats rows of scratch for the kernel
    kKnotRows = kPacked + kPackedFloats
  };

  Block() = default;
  /// Room for that many knots and the kernel's padding.
  explicit Block(std::size_t knot_capacity);

  std::size_t knots() const { return knots_; }
  std::size_t knotCapacity() const { return knot_capacity_; }
  /// Real-time safe; false when the capacity is used up.
  bool addKnot(std::uint32_t& index);
  /// As many as they were, or are in another State; rows of those that go are zero. False: no room.
  bool setKnots(std::size_t knots);

  float* row(KnotRow r) { return floats() + r * knot_stride_; }
  const float* row(KnotRow r) const { return floats() + r * knot_stride_; }

  /// Pointers for the kernel; valid until the block is assigned to or destroyed.
  KnotArrays knotArrays();
  MotionArrays motionArrays();
  /// Fills kKeep and kPush for sub-steps of dt.
  void prepare(float dt);

  /// Positions and velocities (rows X … VZ), contiguous: what a step's backup keeps.
  float* motion() { return row(X); }
  const float* motion() const { return row(X); }
  std::size_t motionFloats() const { return 6 * knot_stride_; }
  /// All rows.
  void addMemory(Upcoming& to) const { to.add(lines_.data(), lines_.size() * sizeof(Line)); }

 private:
  static constexpr std::size_t kAlign = 64;
  float* floats() { return reinterpret_cast<float*>(lines_.data()); }
  const float* floats() const { return reinterpret_cast<const float*>(lines_.data()); }
  struct alignas(kAlign) Line {
    float value[kAlign / sizeof(float)];
  };
  std::vector<Line> lines_;
  std::size_t knots_ = 0, knot_capacity_ = 0, knot_stride_ = 0;  // entries
};

}  // namespace vest::net
