// Plays a script into a scene as fast as it goes, then holds the world at one moment and publishes it: for
// pictures of what an instrument has done.
#include <cstdio>
#include <string>

#include <ros/package.h>
#include <ros/ros.h>
#include <vest_msgs/InstrumentStates.h>
#include <CLI/CLI.hpp>

#include "vest_bringup/simulation/rehearsal.h"
#include "vest_tissue/ros/conversions.h"

namespace {

using vest::tools::ToolKind;

geometry_msgs::Pose poseOf(const Eigen::Isometry3d& X) {
  geometry_msgs::Pose m;
  const Eigen::Quaterniond q(X.linear());
  m.position.x = X.translation().x(), m.position.y = X.translation().y(), m.position.z = X.translation().z();
  m.orientation.w = q.w(), m.orientation.x = q.x(), m.orientation.y = q.y(), m.orientation.z = q.z();
  return m;
}

/// Instruments as a row of the trajectory has them.
vest_msgs::InstrumentStates instrumentsOf(const vest::kinematics::TrainerBox& box,
                                          const vest::trajectory::Trajectory& trajectory, double t) {
  vest_msgs::InstrumentStates out;
  out.header.frame_id = "world";
  std::size_t row = 0;
  while (row + 1 < trajectory.rows.size() && trajectory.rows[row + 1].t <= t) ++row;
  for (std::size_t i = 0; i < box.arms.size(); ++i) {
    if (!trajectory.moves[i]) continue;
    const auto& q = trajectory.rows[row].joints[i];
    const bool scope = i + 1 == box.arms.size();
    vest_msgs::InstrumentState s;
    s.name = std::string(vest::tools::instrumentName(static_cast<vest::tools::Instrument>(i)));
    s.tool = static_cast<std::uint8_t>(scope ? ToolKind::Endoscope
                                             : trajectory.tools[i].value_or(ToolKind::Grasper));
    s.valid = true;
    s.joint_position = {q.yaw, q.pitch, q.insertion, q.roll, q.jaw};
    s.tip = poseOf(vest::kinematics::forwardKinematics(box.arms[i].X_BTrocar, q));
    s.shaft = poseOf(box.arms[i].X_BTrocar);
    out.instruments.push_back(s);
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "vest_show_script");
  CLI::App app{"Plays waypoints (YAML) into a scene, then publishes the world as it is at one moment"};
  std::string waypoints, scene = "gynaecology";
  double until = 10.0, seconds = 0.0;
  app.add_option("WAYPOINTS", waypoints, "as for trajectory_from_waypoints")
      ->required()
      ->check(CLI::ExistingFile);
  app.add_option("--scene", scene, "scene of vest_tissue, or a scene file");
  app.add_option("--until", until, "moment that is shown, s")->check(CLI::NonNegativeNumber);
  app.add_option("--seconds", seconds, "ends after so long; 0: runs on")->check(CLI::NonNegativeNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    if (scene.find('/') == std::string::npos)
      scene = ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
    const auto box = vest::kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") +
                                                      "/config/trainer_box.yaml");
    const auto trajectory = vest::trajectory::fromWaypoints(waypoints, box);
    vest::scene::World world(vest::scene::loadScene(scene), 1);
    std::array<ToolKind, vest::tools::kInstrumentCount> tool;
    for (std::size_t i = 0; i < tool.size(); ++i) tool[i] = trajectory.tools[i].value_or(ToolKind::Grasper);
    tool.back() = ToolKind::Endoscope;
    vest::scene::StepReport report;
    const double dt = world.description().dt;
    for (std::uint64_t k = 0; static_cast<double>(k) * dt < until; ++k) {
      vest::scene::StepInput input =
          vest::simulation::inputAt(box, trajectory, tool, static_cast<double>(k) * dt);
      input.step = world.steps();
      input.dt = dt;
      world.step(input, report);
      for (const auto& e : report.events) {
        vest_msgs::TissueEvent m;
        vest::ros_shell::toMsg(e, world.description(), m);
        std::printf("%7.3f s  %s, %.3g mm2\n", static_cast<double>(k) * dt, m.text.c_str(), 1e6 * m.area);
      }
    }
    ros::NodeHandle handle;
    auto topologies = handle.advertise<vest_msgs::TissueTopology>("tissue/topology", 1, true);
    auto states = handle.advertise<vest_msgs::TissueState>("tissue/state", 1);
    auto instruments = handle.advertise<vest_msgs::InstrumentStates>("instruments", 1);
    vest_msgs::TissueTopology topology;
    vest::ros_shell::toMsg(world, topology);
    topologies.publish(topology);
    vest_msgs::TissueState state;
    state.header.frame_id = "world";
    state.revision = world.revision();
    for (std::size_t i = 0; i < world.objectCount(); ++i) {
      const std::size_t first = state.positions.size();
      state.positions.resize(first + 3 * world.knotCount(i));
      world.positions(i, state.positions.data() + first);
    }
    vest_msgs::InstrumentStates hands = instrumentsOf(box, trajectory, until);
    ros::Rate pace(30);
    const ros::WallTime start = ros::WallTime::now();
    while (ros::ok() && (seconds <= 0.0 || (ros::WallTime::now() - start).toSec() < seconds)) {
      state.header.stamp = hands.header.stamp = ros::Time::now();
      state.step = world.steps() + hands.sequence;
      ++hands.sequence;
      states.publish(state);
      instruments.publish(hands);
      ros::spinOnce();
      pace.sleep();
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_show_script: %s\n", e.what());
    return 1;
  }
  return 0;
}
