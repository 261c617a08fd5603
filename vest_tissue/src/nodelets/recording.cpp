#include <ros/console.h>
#include <ros/master.h>
#include <ros/param.h>
#include <ros/this_node.h>

#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/ros/tissue_server.h"
#include "vest_tissue/voxel/volume.h"

// What the simulation does for a recording: it hands out its scene, waits for the recorder, and tells its
// death.
namespace vest::ros_shell {

boost::shared_ptr<vest_msgs::SceneFiles> TissueServer::toMessage(const std::string& scene,
                                                                 const std::string& hash,
                                                                 const scene::SceneFiles& files) {
  constexpr std::size_t kMostBytes = 64U << 20U;
  const auto msg = boost::make_shared<vest_msgs::SceneFiles>();
  msg->scene = scene;
  msg->scene_hash = hash;
  std::size_t bytes = 0;
  for (const auto& [name, content] : files.files) bytes += content.size();
  if (bytes > kMostBytes) {
    ROS_WARN("scene %s has files of %zu MB: recordings name them instead of carrying them (at most 64 MB)",
             scene.c_str(), bytes >> 20U);
    return msg;
  }
  msg->data.reserve(bytes);
  for (const auto& [name, content] : files.files) {
    msg->names.push_back(name);
    msg->data.insert(msg->data.end(), content.begin(), content.end());
    msg->ends.push_back(static_cast<std::uint32_t>(msg->data.size()));
  }
  msg->materials.assign(files.materials.begin(), files.materials.end());
  return msg;
}

void TissueServer::publishFiles(const boost::shared_ptr<vest_msgs::SceneFiles>& files) {
  files->header.stamp = ros::Time::now();
  files_pub_.publish(vest_msgs::SceneFiles::ConstPtr(files));
}

void TissueServer::publishImage(const scene::Description& description) {
  if (!description.image) return;
  for (const std::string& note : description.feel->notes)
    ROS_WARN("scene %s: %s", description.name.c_str(), note.c_str());
  const auto msg = boost::make_shared<vest_msgs::ImageVolume>();
  toMsg(*description.image, *msg);
  msg->header.stamp = ros::Time::now();
  msg->name = description.name;
  msg->hash = description.hash;
  // Advertised with the first image alone: without one, image_server may be who publishes.
  if (!image_pub_) image_pub_ = nh_.advertise<vest_msgs::ImageVolume>("image/volume", 1, true);
  image_pub_.publish(vest_msgs::ImageVolume::ConstPtr(msg));
}

void TissueServer::onRecording(const vest_msgs::SessionState::ConstPtr& msg) {
  std::lock_guard<std::mutex> lock(recording_mutex_);
  recording_state_ = *msg;
  recording_time_ = ros::SteadyTime::now();
  recorder_died_ = false;
  // An end that is meant is announced: session/stop, the wished time, a full disk.
  recorder_seen_ = msg->state == vest_msgs::SessionState::RUNNING;
}

void TissueServer::watchRecorder() {
  // It says something twice a second. Its connection tells nothing: roscpp tries again for ever.
  constexpr double kSilent = 3.0;  // s
  std::lock_guard<std::mutex> lock(recording_mutex_);
  if (!recorder_seen_ || (ros::SteadyTime::now() - recording_time_).toSec() < kSilent) return;
  recorder_seen_ = false;
  recorder_died_ = true;
  ROS_ERROR(
      "the recorder has died: nothing more is recorded, the training goes on. What it had written is in %s; "
      "vest_recover_bag makes a whole bag of it",
      recording_state_.directory.empty() ? "its folder" : recording_state_.directory.c_str());
}

bool TissueServer::recorderGone() const {
  if (recorder_died_) return true;
  std::string refusal;
  if (ros::param::get(nh_.resolveName("session/recorder_refused"), refusal) && !refusal.empty()) return true;
  // Killed before this process heard of it: the master still has its name, and nobody answers.
  if (recording_.getNumPublishers() > 0) return false;
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", request, response, payload, false)) return false;
  const XmlRpc::XmlRpcValue& publishers = payload[0];
  for (int i = 0; i < publishers.size(); ++i)
    if (static_cast<std::string>(publishers[i][0]) == recording_.getTopic()) return true;
  return false;
}

void TissueServer::startWhenReady(double waited) {
  if (!held_) return;
  const auto recorderIsDone = [&] {
    recorded_ = true;
    held_since_ = waited;
    if (wait_for_hands_) return;
    held_ = false;
    runner_->setPaused(false);
  };
  if (recorded_) {
    constexpr double kPatience = 30.0;  // s: a driver and its box are there in less than one (assumed)
    if (!hands_there_ && waited < held_since_ + kPatience) return;
    if (!hands_there_)
      ROS_WARN("instruments: no hands of a box after %.0f s: the simulation begins without them", kPatience);
    held_ = false;
    runner_->setPaused(false);
    return;
  }
  // The recorder says so when it takes all topics; others may have listened to the inputs long before.
  bool recording = false;
  {
    std::lock_guard<std::mutex> lock(recording_mutex_);
    recording = recording_state_.recording;
  }
  if (recording && steps_pub_.getNumSubscribers() > 0) return recorderIsDone();
  bool gone = false;
  if (waited >= next_look_) {
    next_look_ = waited + 1.0;
    const bool was = looked_gone_;
    looked_gone_ = recorderGone();
    gone = looked_gone_ && (was || recorder_died_);  // twice: it may be connecting just now
  }
  if (gone || waited > recorder_timeout_) {
    ROS_WARN("no recorder listens to %s after %.0f s%s: the simulation begins without one",
             steps_pub_.getTopic().c_str(), waited, gone ? ", and none will: it has ended" : "");
    recorder_died_ = true;
    recorderIsDone();
  }
}

}  // namespace vest::ros_shell
