// Publishes a scene file's topology, a gently moved state and instruments, without any simulation: to look at
// a scene, and for the benchmark and the tests of the displays.
#include <cmath>
#include <cstdio>
#include <string>

#include <ros/package.h>
#include <ros/ros.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/TissueState.h>
#include <vest_msgs/TissueTopology.h>
#include <CLI/CLI.hpp>

#include "vest_instruments/kinematics/arm.h"
#include "vest_tissue/scene/world.h"

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

/// Tip at a place, by inverse kinematics through the trocar.
vest_msgs::InstrumentState instrument(const Trocar& trocar, const Vector3d& tip, double roll, double jaw) {
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

vest_msgs::TissueTopology toMessage(const vest::scene::Description& scene) {
  vest_msgs::TissueTopology topology;
  topology.header.frame_id = "world";
  topology.header.stamp = ros::Time::now();
  topology.revision = 1;
  topology.scene = scene.name;
  topology.scene_hash = scene.hash;
  for (const vest::scene::Object& o : scene.objects) {
    vest_msgs::TissueObject m;
    m.name = o.name;
    m.id = static_cast<std::uint16_t>(topology.objects.size());
    m.organ = o.organ;
    m.material = o.material;
    m.model = static_cast<std::uint8_t>(o.model);
    m.knot_count = static_cast<std::uint32_t>(o.rest_position.size());
    for (const Vector3d& p : o.rest_position)
      for (int k = 0; k < 3; ++k) m.rest_position.push_back(static_cast<float>(p[k]));
    m.knot_fixed = o.fixed;
    for (const vest::scene::Link& link : o.links) {
      m.link_knots.insert(m.link_knots.end(), {link.knot0, link.knot1});
      m.link_kind.push_back(static_cast<std::uint8_t>(link.kind));
      m.link_alive.push_back(1);
    }
    for (const auto& t : o.skin.triangles) m.triangles.insert(m.triangles.end(), t.begin(), t.end());
    m.triangle_layer = o.skin.layer;
    for (const auto& uv : o.skin.texture_coordinates)
      m.texture_coordinates.insert(m.texture_coordinates.end(), uv.begin(), uv.end());
    m.binding_start = o.skin.binding_start;
    m.binding_knots = o.skin.binding_knots;
    m.binding_weights = o.skin.binding_weights;
    topology.objects.push_back(std::move(m));
  }
  return topology;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "vest_show_scene");
  CLI::App app{
      "Publishes tissue/topology, tissue/state and instruments for a scene file, without simulation."};
  std::string path;
  double rate = 60, insertion = 0.10, seconds = 0;
  std::vector<double> view;
  bool still = false;
  app.add_option("scene", path, "scene file; default: the gynaecology scene of vest_tissue");
  app.add_option("--rate", rate, "states per second")->check(CLI::Range(0.1, 1000.0));
  app.add_option("--insertion", insertion, "of the endoscope, m")->check(CLI::Range(0.0, 0.28));
  app.add_option("--view", view, "endoscope tip x y z, m, in world")->expected(3);
  app.add_option("--seconds", seconds, "ends after so long; 0: runs on");
  app.add_flag("--still", still, "nothing moves");
  CLI11_PARSE(app, argc, argv);
  if (path.empty()) path = ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml";
  vest::scene::Description scene;
  try {
    scene = vest::scene::loadScene(path);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
  ros::NodeHandle handle;
  ros::Publisher topology_pub = handle.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
  ros::Publisher state_pub = handle.advertise<vest_msgs::TissueState>("tissue/state", 1);
  ros::Publisher instruments_pub = handle.advertise<vest_msgs::InstrumentStates>("instruments", 1);
  topology_pub.publish(toMessage(scene));

  // Where the grasper holds: the left tube's isthmus.
  Vector3d held(-0.035, 0.05, 0.06);
  double nearest = 1e9;
  for (const auto& o : scene.objects)
    for (const Vector3d& p : o.position)
      if (o.name == "tube_left" && std::fabs(p.x() + 0.035) < nearest) {
        nearest = std::fabs(p.x() + 0.035);
        held = p;
      }
  ros::Rate pace(rate);
  const ros::WallTime start = ros::WallTime::now();
  for (std::uint64_t n = 0; ros::ok(); ++n) {
    const double t = still ? 2.0 : static_cast<double>(n) / rate;
    if (seconds > 0 && (ros::WallTime::now() - start).toSec() > seconds) break;
    const double lift = 0.5 - 0.5 * std::cos(t * 1.2);
    const Vector3d pull = lift * Vector3d(-0.005, -0.012, 0.022);
    vest_msgs::TissueState state;
    state.header.stamp = ros::Time::now();
    state.header.frame_id = "world";
    state.revision = 1;
    state.step = n;
    state.time = t;
    for (const auto& o : scene.objects) {
      const double share = o.model == vest::scene::ObjectModel::Rigid ? 0.0 : 1.0;
      for (std::size_t i = 0; i < o.rest_position.size(); ++i) {
        const Vector3d& p0 = i < o.position.size() ? o.position[i] : o.rest_position[i];
        const double d2 = (p0 - held).squaredNorm() / (0.018 * 0.018);
        const double breath = still ? 0.0 : 0.0006 * std::sin(1.5 * t + 40 * p0.x());
        const Vector3d p = p0 + share * (std::exp(-d2) * pull + Vector3d(0, 0, breath));
        for (int k = 0; k < 3; ++k) state.positions.push_back(static_cast<float>(p[k]));
      }
    }
    state_pub.publish(state);
    vest_msgs::InstrumentStates instruments;
    instruments.header = state.header;
    instruments.sequence = n + 1;
    instruments.instruments.push_back(instrument(kTrocars[0], held + pull, 0.4, 0.12));
    instruments.instruments.push_back(
        instrument(kTrocars[1], Vector3d(0.03 + 0.01 * std::sin(0.8 * t), 0.045, 0.075), -0.3, 0.5));
    const Trocar& scope = kTrocars[2];
    const Vector3d tip = view.size() == 3
                             ? Vector3d(view[0], view[1], view[2])
                             : Vector3d(scope.pivot + insertion * (scope.aim - scope.pivot).normalized());
    instruments.instruments.push_back(instrument(scope, tip, 0, 0));
    instruments_pub.publish(instruments);
    ros::spinOnce();
    pace.sleep();
  }
  return 0;
}
