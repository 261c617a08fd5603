#include "vest_bringup/ros/recorded_session.h"

#include <cmath>
#include <stdexcept>

#include <vest_msgs/SceneFiles.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/StringStamped.h>
#include <vest_msgs/TissueEvent.h>
#include <vest_msgs/TissueTopology.h>

#include "vest_bringup/ros/bag_format.h"
#include "vest_bringup/ros/typed_message.h"

namespace vest::session {
namespace {

RecordedScene sceneOf(const vest_msgs::SceneFiles& msg, const std::string& file) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(file + ": tissue/scene of '" + files::shown(msg.scene) + "': " + what);
  };
  RecordedScene scene;
  scene.scene = msg.scene;
  scene.hash = msg.scene_hash;
  scene.files.materials.assign(msg.materials.begin(), msg.materials.end());
  if (msg.names.size() != msg.ends.size())
    refuse(std::to_string(msg.names.size()) + " names and " + std::to_string(msg.ends.size()) + " ends");
  constexpr std::size_t kMostFiles = 10000;  // each is written to the disk (assumed)
  if (msg.names.size() > kMostFiles)
    refuse(std::to_string(msg.names.size()) + " files (allowed: at most " + std::to_string(kMostFiles) + ")");
  std::size_t begin = 0;
  for (std::size_t i = 0; i < msg.names.size(); ++i) {
    const std::size_t end = msg.ends[i];
    if (end < begin || end > msg.data.size())
      refuse("ends[" + std::to_string(i) + "] is " + std::to_string(end) +
             " (allowed: " + std::to_string(begin) + " to " + std::to_string(msg.data.size()) + ")");
    scene.files.files.emplace_back(msg.names[i],
                                   std::string(msg.data.begin() + static_cast<std::ptrdiff_t>(begin),
                                               msg.data.begin() + static_cast<std::ptrdiff_t>(end)));
    begin = end;
  }
  return scene;
}

}  // namespace

RecordedSession::RecordedSession(const std::string& file) : reader_(file) {
  reader_.read([this](const BagMessage& m) { note(m); });
}

std::map<RecordedSession::Step, const char*> RecordedSession::judgements() const {
  std::map<Step, const char*> all;
  for (const auto& [step, hash] : effects_hashes_) all[step] = "an effects' hash";
  for (const auto& [step, hash] : state_hashes_) all[step] = "a state hash";
  for (const Step& step : faults_) all[step] = "a FAULT";
  return all;
}

void RecordedSession::note(const BagMessage& m) {
  const std::string& topic = m.connection.topic;
  if (endsWith(topic, "step_inputs")) {
    if (steps_++ > 0) return;
    vest_msgs::StepInput input;
    readMessage(file(), m, input);
    first_step_ = input.step, begin_ = input.header.stamp;
  } else if (endsWith(topic, "/state_hash")) {
    vest_msgs::StateHash hash;
    readMessage(file(), m, hash);
    Hashes& hashes = endsWith(topic, "effects/state_hash") ? effects_hashes_ : state_hashes_;
    hashes[{hash.step, hash.header.stamp}] = hash.hash;
  } else if (endsWith(topic, "tissue/events")) {
    vest_msgs::TissueEvent event;
    readMessage(file(), m, event);
    // The event names the last good step; the one that failed has its stamp.
    if (event.kind == vest_msgs::TissueEvent::FAULT) faults_.insert({event.step + 1, event.header.stamp});
  } else if (endsWith(topic, "tissue/scene")) {
    vest_msgs::SceneFiles files;
    readMessage(file(), m, files);
    scenes_.push_back(sceneOf(files, file()));
  } else if (endsWith(topic, "tissue/topology") && scene_hash_.empty()) {
    vest_msgs::TissueTopology topology;
    readMessage(file(), m, topology);
    scene_name_ = topology.scene;
    scene_hash_ = topology.scene_hash;
  } else if (endsWith(topic, "effects/options") && !effects_) {
    vest_msgs::EffectsOptions options;
    readMessage(file(), m, options);
    effects_ = options;
  } else if (endsWith(topic, "session/exercise_file") || endsWith(topic, "session/result") ||
             endsWith(topic, "session/notes")) {
    vest_msgs::StringStamped text;
    readMessage(file(), m, text);
    if (endsWith(topic, "session/result"))
      result_ = text.string;
    else
      (endsWith(topic, "session/notes") ? notes_ : exercise_files_)
          .push_back({text.header.stamp, text.string});
  }
}

std::optional<std::uint64_t> RecordedSession::find(const Hashes& in, const Step& step) {
  const auto found = in.find(step);
  return found == in.end() ? std::nullopt : std::optional<std::uint64_t>(found->second);
}

void RecordedSession::steps(const std::function<void(const vest_msgs::StepInput& input)>& callback) {
  reader_.read([&](const BagMessage& m) {
    if (!endsWith(m.connection.topic, "step_inputs")) return;
    vest_msgs::StepInput input;
    readMessage(file(), m, input);
    if (!(std::isfinite(input.dt) && input.dt > 0))
      throw std::invalid_argument(file() + ": step " + std::to_string(input.step) + ": dt is " +
                                  std::to_string(input.dt) + " (allowed: a positive number of seconds)");
    callback(input);
  });
}

}  // namespace vest::session
