#pragma once

#include <geometry_msgs/Pose.h>
#include <sensor_msgs/CameraInfo.h>
#include <vest_msgs/ImageVolume.h>
#include <vest_msgs/InstrumentState.h>
#include <vest_msgs/TissueTopology.h>
#include <vest_msgs/TissueTopologyDelta.h>
#include <Eigen/Geometry>

#include "vest_tissue/volume/brick.h"
#include "vest_viz/camera/model.h"
#include "vest_viz/mesh/store.h"

namespace vest::displays {

mesh::Topology toTopology(const vest_msgs::TissueTopology& message);
mesh::Delta toDelta(const vest_msgs::TissueTopologyDelta& message);
/// False if the pose is not finite or its quaternion is not of length 1 (within 1 %).
bool toPose(const geometry_msgs::Pose& message, Eigen::Isometry3d* pose);
/// Pose of the camera (z forward, x right, y down) of the endoscope: the tip turned the shortest way to its
/// direction of view, as kinematics::opticalFrame does. False if it has no pose.
bool toOpticalFrame(const vest_msgs::InstrumentState& endoscope, Eigen::Isometry3d* pose);
/// Empty, or why the message is no volume.
std::string toBrick(const vest_msgs::ImageVolume& message, volume::Brick* brick);
sensor_msgs::CameraInfo toCameraInfo(const camera::Intrinsics& camera);

}  // namespace vest::displays
