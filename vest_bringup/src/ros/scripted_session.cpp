#include "vest_bringup/ros/scripted_session.h"

#include <filesystem>

#include <vest_msgs/EffectsOptions.h>
#include <vest_msgs/SceneFiles.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/StringStamped.h>
#include <vest_msgs/TissueEvent.h>

#include "vest_tissue/ros/conversions.h"

namespace vest::session {

template <class M>
void ScriptedSession::put(const std::string& topic, M& message) {
  message.header.stamp = time_;
  try {
    bag_->write("/vest/" + topic, time_, message);
  } catch (const rosbag::BagException&) {
    giveUp();
  }
}

void ScriptedSession::giveUp() {
  static_cast<void>(bag_.release());  // its destructor would write again, and end the program
  std::error_code ignored;
  const bool begun = std::filesystem::remove(file_, ignored);
  throw std::invalid_argument(file_ + ": cannot be written" + (begun ? " (is the disk full?)" : ""));
}

void ScriptedSession::close() {
  try {
    bag_->close();
  } catch (const rosbag::BagException&) {
    giveUp();
  }
}

ScriptedSession::~ScriptedSession() {
  if (bag_) try {
      close();
    } catch (const std::invalid_argument&) {  // who asks, closes
    }
}

void ScriptedSession::putText(const std::string& topic, const std::string& text) {
  vest_msgs::StringStamped message;
  message.string = text;
  put(topic, message);
}

ScriptedSession::ScriptedSession(const std::string& directory, const scene::SceneFiles& files,
                                 const scene::World& world, simulation::StageOptions options,
                                 const std::string& vessels)
    : file_(directory + "/session.bag") {
  std::error_code error;
  std::filesystem::create_directories(directory, error);
  if (std::filesystem::exists(file_, error))
    throw std::invalid_argument(file_ + ": is there already (allowed: a folder without a session)");
  try {
    bag_->open(file_, rosbag::bagmode::Write);
  } catch (const rosbag::BagException&) {
    giveUp();
  }
  bag_->setCompression(rosbag::compression::LZ4);
  vest_msgs::SceneFiles carried;
  carried.scene = world.description().name;
  carried.scene_hash = world.description().hash;
  for (const auto& [name, bytes] : files.files) {
    carried.names.push_back(name);
    carried.data.insert(carried.data.end(), bytes.begin(), bytes.end());
    carried.ends.push_back(static_cast<std::uint32_t>(carried.data.size()));
  }
  carried.materials.assign(files.materials.begin(), files.materials.end());
  put("tissue/scene", carried);
  vest_msgs::TissueTopology topology;
  ros_shell::toMsg(world, topology);
  put("tissue/topology", topology);
  vest_msgs::EffectsOptions effects;
  effects.vessels = vessels;
  eachNumber(options, [&](const char* name, double& value, double, double) {
    effects.names.emplace_back(name);
    effects.values.push_back(value);
  });
  put("effects/options", effects);
}

void ScriptedSession::write(const scene::World& world, const scene::StepInput& input,
                            const scene::StepReport& report) {
  time_ += ros::Duration(input.dt);
  scene::StepFrame frame;
  frame.input = input;
  frame.status = report.status;
  vest_msgs::StepInput message;
  ros_shell::toMsg(frame, world.description(), message);
  put("step_inputs", message);
  for (const scene::Event& event : report.events) {
    vest_msgs::TissueEvent e;
    ros_shell::toMsg(event, world.description(), e);
    put("tissue/events", e);
  }
  if (world.steps() % 100 != 0) return;
  vest_msgs::StateHash hash;
  hash.step = world.steps();
  hash.hash = world.stateHash();
  put("tissue/state_hash", hash);
}

void ScriptedSession::writeExercise(const std::string& file_text) {
  putText("session/exercise_file", file_text);
}
void ScriptedSession::writeResult(const std::string& json) {
  putText("session/result", json);
}

}  // namespace vest::session
