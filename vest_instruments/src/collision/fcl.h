#pragma once

// FCL 0.6 and later (templates on the scalar, Eigen poses), or 0.5 of Ubuntu 20.04 (doubles, poses of its
// own).

#include <Eigen/Geometry>

#if __has_include(<fcl/narrowphase/collision.h>)
#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/distance.h>

namespace vest::collision {
inline const Eigen::Isometry3d& fclPose(const Eigen::Isometry3d& X) {
  return X;
}
inline fcl::Boxd fclBox(const Eigen::Vector3d& sides) {
  return fcl::Boxd(sides);
}
}  // namespace vest::collision
#else
#include <fcl/collision.h>
#include <fcl/distance.h>
#include <fcl/shape/geometric_shapes.h>

namespace fcl {
using Boxd = Box;
using Capsuled = Capsule;
using CollisionRequestd = CollisionRequest;
using CollisionResultd = CollisionResult;
using DistanceRequestd = DistanceRequest;
using DistanceResultd = DistanceResult;
}  // namespace fcl

namespace vest::collision {
inline fcl::Transform3f fclPose(const Eigen::Isometry3d& X) {
  const Eigen::Matrix3d R = X.linear();
  const Eigen::Vector3d t = X.translation();
  return {fcl::Matrix3f(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)),
          fcl::Vec3f(t.x(), t.y(), t.z())};
}
inline fcl::Boxd fclBox(const Eigen::Vector3d& sides) {
  return fcl::Boxd(sides.x(), sides.y(), sides.z());
}
}  // namespace vest::collision
#endif
