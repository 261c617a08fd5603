#include "vest_tissue/interaction/suspension.h"

namespace vest::interaction {

Eigen::Vector3d middleOf(const Suspension& s) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::int32_t i = 0; i < s.count; ++i) sum += s.knots[static_cast<std::size_t>(i)].place;
  return s.count > 0 ? Eigen::Vector3d(sum / s.count) : sum;
}

void remapSuspension(Suspension& s, std::uint16_t object, const net::KnotDoubling& cut) {
  if (!s.alive) return;
  const Eigen::Vector3d middle = middleOf(s);
  for (std::int32_t i = 0; i < s.count; ++i) {
    HungKnot& h = s.knots[static_cast<std::size_t>(i)];
    if (h.object != object || h.knot != cut.original) continue;
    net::Anchor anchor{h.object, {h.knot, 0, 0, 0}, {1, 0, 0, 0}};
    if (net::remap(anchor, cut, middle)) h.knot = anchor.knots[0];
  }
}

}  // namespace vest::interaction
