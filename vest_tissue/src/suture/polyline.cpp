#include "vest_tissue/suture/polyline.h"

namespace vest::suture {

using Eigen::Vector3d;

double lengthOf(const std::vector<Vector3d>& curve) {
  double sum = 0.0;
  for (std::size_t i = 0; i + 1 < curve.size(); ++i) sum += (curve[i + 1] - curve[i]).norm();
  return sum;
}

std::vector<Vector3d> nodesAlong(const std::vector<Vector3d>& curve, double length, std::size_t segments) {
  std::vector<Vector3d> nodes;
  std::size_t i = 0;
  double passed = 0.0, span = (curve[1] - curve[0]).norm();
  for (std::size_t k = 0; k <= segments; ++k) {
    const double at = length * static_cast<double>(k) / static_cast<double>(segments);
    while (at > passed + span && i + 2 < curve.size()) {
      passed += span;
      ++i;
      span = (curve[i + 1] - curve[i]).norm();
    }
    nodes.push_back(curve[i] + (at - passed) / span * (curve[i + 1] - curve[i]));
  }
  return nodes;
}

}  // namespace vest::suture
