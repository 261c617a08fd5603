#include "vest_tissue/net/block.h"

namespace vest::net {
namespace {

constexpr std::size_t kLine = 16;  // floats per cache line

std::size_t padded(std::size_t count) { return (count + kLine - 1) / kLine * kLine; }

/// Rows whose distance is a multiple of 4 KiB alias in the first cache level.
std::size_t stride(std::size_t count) {
  std::size_t result = padded(count);
  if (result % 1024 == 0) result += kLine;
  return result;
}

}  // namespace

Block::Block(std::size_t knot_capacity, std::size_t link_capacity)
    : knot_capacity_(knot_capacity),
      link_capacity_(link_capacity),
      knot_stride_(stride(knot_capacity + 1)),
      link_stride_(stride(link_capacity + kLine)) {
  const std::size_t words = kKnotRows * knot_stride_ + (kLinkRows + 2) * link_stride_;
  lines_.assign(words / kLine, Line{});
  // Padding links join knot 0 to the padding knot, which moves nothing: it has no mass and they have no modulus.
  for (std::size_t i = 0; i < link_stride_; ++i) knot1()[i] = static_cast<std::uint32_t>(knot_capacity_);
}

bool Block::addKnot(std::uint32_t& index) {
  if (knots_ >= knot_capacity_) return false;
  index = static_cast<std::uint32_t>(knots_++);
  return true;
}

bool Block::addLink(std::uint32_t k0, std::uint32_t k1, std::uint32_t& index) {
  if (links_ >= link_capacity_) return false;
  index = static_cast<std::uint32_t>(links_++);
  knot0()[index] = k0;
  knot1()[index] = k1;
  return true;
}

KernelArrays Block::arrays() {
  KernelArrays a{};
  a.knots = padded(knot_capacity_ + 1);
  a.links = padded(links_);
  a.x = row(X), a.y = row(Y), a.z = row(Z);
  a.vx = row(VX), a.vy = row(VY), a.vz = row(VZ);
  a.inverse_mass = row(kInverseMass), a.decay = row(kDecay);
  a.hx = row(HX), a.hy = row(HY), a.hz = row(HZ);
  a.fx = row(FX), a.fy = row(FY), a.fz = row(FZ);
  a.knot0 = knot0(), a.knot1 = knot1();
  a.inverse_rest = row(kInverseRest), a.modulus = row(kModulus);
  a.damping = row(kDamping), a.nonlinear = row(kNonlinear);
  return a;
}

}  // namespace vest::net
