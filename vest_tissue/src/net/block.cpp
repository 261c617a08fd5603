#include "vest_tissue/net/block.h"

#include <algorithm>

namespace vest::net {
namespace {

constexpr std::size_t kLine = 16;  // floats per cache line

/// An odd number of cache lines: else rows that are used together would lie a multiple of 4 KiB apart, where
/// a load waits for a store that it takes for its own.
std::size_t stride(std::size_t count) {
  return ((count + kLine - 1) / kLine | 1) * kLine;
}

}  // namespace

Block::Block(std::size_t knot_capacity)
    : knot_capacity_(knot_capacity), knot_stride_(stride(knot_capacity + 2 * kLanes)) {
  lines_.assign(kKnotRows * knot_stride_ / kLine, Line{});
}

bool Block::addKnot(std::uint32_t& index) {
  if (knots_ >= knot_capacity_) return false;
  index = static_cast<std::uint32_t>(knots_++);
  return true;
}

bool Block::setKnots(std::size_t knots) {
  if (knots > knot_capacity_) return false;
  for (std::size_t r = 0; r < kPacked && knots < knots_; ++r)
    std::fill(row(static_cast<KnotRow>(r)) + knots, row(static_cast<KnotRow>(r)) + knots_, 0.0f);
  knots_ = knots;
  return true;
}

KnotArrays Block::knotArrays() {
  return {row(X), row(Y), row(Z), row(VX), row(VY), row(VZ), row(FX), row(FY), row(FZ), row(kPacked)};
}

MotionArrays Block::motionArrays() {
  MotionArrays a{};
  a.n = (knots_ + kLanes - 1) / kLanes * kLanes;
  a.x = row(X), a.y = row(Y), a.z = row(Z), a.vx = row(VX), a.vy = row(VY), a.vz = row(VZ);
  a.fx = row(FX), a.fy = row(FY), a.fz = row(FZ), a.hx = row(HX), a.hy = row(HY), a.hz = row(HZ);
  a.keep = row(kKeep), a.push = row(kPush);
  return a;
}

void Block::prepare(float dt) {
  const float *w = row(kInverseMass), *decay = row(kDecay);
  float *keep = row(kKeep), *push = row(kPush);
  for (std::size_t i = 0; i < knots_; ++i) {
    keep[i] = 1.0f / (1.0f + dt * decay[i]);
    push[i] = dt * w[i];
  }
}

}  // namespace vest::net
