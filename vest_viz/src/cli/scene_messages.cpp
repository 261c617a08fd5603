#include "scene_messages.h"

#include <cmath>

#include "vest_instruments/kinematics/arm.h"
#include "vest_tissue/ros/drawn_scene.h"

namespace vest::tools {
namespace {

using Eigen::Vector3d;
namespace kin = vest::kinematics;

/// Pivot, and the point that z aims at with zero angles (docs of vest_instruments: trainer box).
struct Trocar {
  const char* name;
  Vector3d pivot, aim;
  int tool;
};
const Trocar kTrocars[] = {
    {"left", {-0.115, -0.02, 0.165}, {-0.02, 0.05, 0.055}, vest_msgs::InstrumentState::TOOL_GRASPER},
    {"right", {0.115, -0.02, 0.165}, {0.02, 0.05, 0.055}, vest_msgs::InstrumentState::TOOL_BIPOLAR_FORCEPS},
    {"endoscope", {0.0, -0.14, 0.165}, {0.0, 0.055, 0.055}, vest_msgs::InstrumentState::TOOL_ENDOSCOPE}};

Eigen::Isometry3d trocarFrame(const Trocar& trocar) {
  const Vector3d z = (trocar.aim - trocar.pivot).normalized();
  const Vector3d x = (Vector3d::UnitX() - z.x() * z).normalized();
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() << x, z.cross(x), z;
  X.translation() = trocar.pivot;
  return X;
}

geometry_msgs::Pose toMessage(const Eigen::Isometry3d& X) {
  geometry_msgs::Pose pose;
  const Eigen::Quaterniond q(X.linear());
  pose.position.x = X.translation().x(), pose.position.y = X.translation().y(),
  pose.position.z = X.translation().z();
  pose.orientation.w = q.w(), pose.orientation.x = q.x(), pose.orientation.y = q.y(),
  pose.orientation.z = q.z();
  return pose;
}

}  // namespace

vest_msgs::InstrumentState instrumentAt(Place place, const Vector3d& tip, double roll, double jaw) {
  const Trocar& trocar = kTrocars[static_cast<int>(place)];
  const Eigen::Isometry3d X_WT0 = trocarFrame(trocar);
  Eigen::Isometry3d wanted = Eigen::Isometry3d::Identity();
  wanted.translation() = tip;
  kin::JointPositions reference;
  reference.roll = roll;
  reference.jaw = jaw;
  kin::JointPositions q = kin::inverseKinematics(X_WT0, wanted, reference, {}).q;
  q.roll = roll;
  q.jaw = jaw;
  vest_msgs::InstrumentState state;
  state.name = trocar.name;
  state.tool = static_cast<std::uint8_t>(trocar.tool);
  state.valid = true;
  state.joint_position = {q.yaw, q.pitch, q.insertion, q.roll, q.jaw};
  state.tip = toMessage(kin::forwardKinematics(X_WT0, q));
  state.shaft = toMessage(X_WT0);
  return state;
}

Vector3d endoscopeTip(double insertion) {
  const Trocar& scope = kTrocars[static_cast<int>(Place::Endoscope)];
  return scope.pivot + insertion * (scope.aim - scope.pivot).normalized();
}

vest_msgs::TissueTopology topologyOf(const vest::scene::Description& scene) {
  vest_msgs::TissueTopology topology = ros_shell::topologyOf(scene);
  topology.header.stamp = ros::Time::now();
  return topology;
}

vest_msgs::TissueTopology chessboard(int columns, int rows, double square) {
  vest_msgs::TissueTopology topology;
  topology.header.frame_id = "world";
  topology.revision = 1;
  topology.scene = "chessboard";
  for (int colour = 0; colour < 2; ++colour) {
    vest_msgs::TissueObject o;
    o.name = o.organ = colour == 0 ? "board_white" : "board_black";
    o.segmentation_label = static_cast<std::uint16_t>(colour + 1);
    o.model = vest_msgs::TissueObject::MODEL_RIGID;
    o.binding_start = {0};
    for (int r = -1; r <= rows; ++r)
      for (int c = -1; c <= columns; ++c) {
        const bool margin = r < 0 || c < 0 || r == rows || c == columns;
        if ((!margin && (r + c) % 2 == 0) != (colour == 1)) continue;
        const std::uint32_t first = o.knot_count;
        for (int k = 0; k < 4; ++k) {
          const double x = (c + (k == 1 || k == 2) - 0.5 * columns) * square;
          const double y = (r + (k >= 2) - 0.5 * rows) * square;
          o.rest_position.insert(o.rest_position.end(), {static_cast<float>(x), static_cast<float>(y), 0.0f});
          o.texture_coordinates.insert(o.texture_coordinates.end(),
                                       {static_cast<float>(x), static_cast<float>(y)});
          o.binding_knots.push_back(o.knot_count++);
          o.binding_weights.push_back(1);
          o.binding_start.push_back(o.knot_count);
        }
        for (std::uint32_t k : {0u, 1u, 2u, 0u, 2u, 3u}) o.triangles.push_back(first + k);
      }
    topology.objects.push_back(std::move(o));
  }
  return topology;
}

}  // namespace vest::tools
