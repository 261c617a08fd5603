#include "vest_instruments/kinematics/jacobian.h"

namespace vest::kinematics {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

Eigen::Matrix<double, 6, 4> tipJacobian(const Eigen::Isometry3d& X_WTrocar, const JointPositions& q) {
  const Eigen::Matrix3d R_W = X_WTrocar.linear();
  const Vector3d yaw_axis = R_W.col(1);
  const Eigen::Matrix3d R_yaw = R_W * AngleAxisd(q.yaw, Vector3d::UnitY()).toRotationMatrix();
  const Vector3d pitch_axis = R_yaw.col(0);
  const Vector3d shaft = R_yaw * (AngleAxisd(q.pitch, Vector3d::UnitX()) * Vector3d::UnitZ());
  const Vector3d reach = shaft * q.insertion;
  Eigen::Matrix<double, 6, 4> J = Eigen::Matrix<double, 6, 4>::Zero();
  J.col(0) << yaw_axis.cross(reach), yaw_axis;
  J.col(1) << pitch_axis.cross(reach), pitch_axis;
  J.block<3, 1>(0, 2) = shaft;
  J.block<3, 1>(3, 3) = shaft;
  return J;
}

Eigen::Isometry3d opticalFrame(double optic_angle, double light_post) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = (AngleAxisd(light_post, Vector3d::UnitZ()) * AngleAxisd(-optic_angle, Vector3d::UnitX()) *
                AngleAxisd(-light_post, Vector3d::UnitZ()))
                   .toRotationMatrix();
  return X;
}

}  // namespace vest::kinematics
