#pragma once

#include <geometry_msgs/Pose.h>
#include <sensor_msgs/CameraInfo.h>
#include <vest_msgs/TissueTopology.h>
#include <vest_msgs/TissueTopologyDelta.h>
#include <Eigen/Geometry>

#include "vest_viz/camera/model.h"
#include "vest_viz/mesh/store.h"

namespace vest::displays {

mesh::Topology toTopology(const vest_msgs::TissueTopology& message);
mesh::Delta toDelta(const vest_msgs::TissueTopologyDelta& message);
/// False if the pose is not finite or its quaternion is not of length 1 (within 1 %).
bool toPose(const geometry_msgs::Pose& message, Eigen::Isometry3d* pose);
sensor_msgs::CameraInfo toCameraInfo(const camera::Intrinsics& camera);

}  // namespace vest::displays
