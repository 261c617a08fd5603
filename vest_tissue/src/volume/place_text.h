#pragma once

#include <sstream>
#include <string>

#include <Eigen/Core>

namespace vest::volume {

/// "(x, y, z)", for messages.
inline std::string text(const Eigen::Vector3d& v) {
  std::ostringstream out;
  out << "(" << v.x() << ", " << v.y() << ", " << v.z() << ")";
  return out.str();
}

}  // namespace vest::volume
