#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "vest_viz/camera/model.h"
#include "vest_viz/picture/finish.h"
#include "vest_viz/truth/raster.h"

namespace vest::truth {

/// As vest_msgs/Keypoint.
struct Keypoint {
  std::string instrument, name;
  double u = 0, v = 0;          ///< pixel
  double depth = 0;             ///< m along the optical axis; negative behind the camera (u and v are NaN)
  std::uint8_t visibility = 0;  ///< 0 outside of the picture, 1 hidden, 2 visible
};

/// An instrument as the drawing has it.
struct InstrumentPose {
  std::string name;
  std::uint16_t label = 0;       ///< kFirstInstrument …
  Eigen::Isometry3d X_WTip;      ///< tip frame of the closed jaws: z along the shaft, x the opening direction
  Eigen::Vector3d pivot;         ///< m, world: of the trocar
  double jaw = 0;                ///< rad, full opening
  double jaw_length = 0;         ///< m; 0: a tool without jaws, which has no keypoints jaw_left and jaw_right
  double shaft_radius = 0.0025;  ///< m
};

/// tip: origin of the tip frame. wrist: the jaws' axis (the tip, where there are none). jaw_left, jaw_right:
/// points of the jaws as opened. entry: where the instrument's axis comes into the round picture (its trocar,
/// if that is seen). A point is visible if it is not hidden by something that lies more than a shaft's radius
/// before it, or if the pixel shows the instrument itself.
void appendKeypoints(const InstrumentPose& instrument, const camera::Intrinsics& camera,
                     const picture::Circle& circle, const Eigen::Isometry3d& X_WO, const Raster& raster,
                     std::vector<Keypoint>* out);

}  // namespace vest::truth
