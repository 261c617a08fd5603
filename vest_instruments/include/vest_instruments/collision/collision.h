#pragma once

#include <array>
#include <memory>

#include <Eigen/Geometry>

#include "vest_instruments/kinematics/trainer_box.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::collision {

/// What the collision of one instrument needs. Frame B is phantom_box.
struct ArmPose {
  bool present = false;
  tools::ToolKind tool = tools::ToolKind::None;
  Eigen::Isometry3d X_BTip = Eigen::Isometry3d::Identity();
  double insertion = 0.0;  ///< m from the pivot to the tip
  double jaw = 0.0;        ///< rad, full opening
};

/// Whether instruments touch each other or the box, rigid against rigid (FCL). The part of a shaft inside the
/// box, jaws and fixed parts are capsules of tools::ToolGeometry; the box is its floor, four walls and lid
/// (at the dome's full height, which the trocars pass freely). Allocates when built; check() calls FCL, which
/// may.
class CollisionModel {
 public:
  explicit CollisionModel(const kinematics::TrainerBox& box);
  ~CollisionModel();
  CollisionModel(CollisionModel&&) noexcept;
  CollisionModel& operator=(CollisionModel&&) noexcept;

  /// @return per instrument: touches another one or the box.
  std::array<bool, tools::kInstrumentCount> check(const std::array<ArmPose, tools::kInstrumentCount>& arms);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vest::collision
