#include "vest_tissue/net/anchor.h"

namespace vest::net {

bool remap(Anchor& anchor, const KnotDoubling& doubling, const Eigen::Vector3d& anchor_position) {
  if (!(doubling.plane_normal.dot(anchor_position - doubling.plane_point) > 0.0)) return false;
  bool changed = false;
  for (std::size_t i = 0; i < anchor.knots.size(); ++i) {
    if (anchor.weights[i] == 0.0 || anchor.knots[i] != doubling.original) continue;
    anchor.knots[i] = doubling.copy;
    changed = true;
  }
  return changed;
}

}  // namespace vest::net
