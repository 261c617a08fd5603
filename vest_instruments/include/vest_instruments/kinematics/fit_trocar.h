#pragma once

#include <vector>

#include "vest_instruments/kinematics/trainer_box.h"

namespace vest::kinematics {

/// One touch: where the closed tip was known to be, and what the joints said.
struct Touch {
  Eigen::Vector3d point_B = Eigen::Vector3d::Zero();  ///< m, phantom_box
  JointPositions joints;
};

struct TrocarFit {
  Eigen::Vector3d pivot_B, aim_B;  ///< m; the aim lies 0.1 m from the pivot
  double error = 0;                ///< m: root of the mean squared distance between points and tips
};

/// Pivot and aim of a trocar from touched points: least squares of the distances, Gauss-Newton from a first
/// guess (a few cm and 30 degrees away are well inside its reach).
/// @param touches at least three, which do not lie in one direction from the pivot
/// @throws files::FileError with what is wrong and what is allowed
TrocarFit fitTrocar(const std::vector<Touch>& touches, const Eigen::Vector3d& pivot_B,
                    const Eigen::Vector3d& aim_B);

}  // namespace vest::kinematics
