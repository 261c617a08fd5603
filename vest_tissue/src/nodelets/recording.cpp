#include <ros/console.h>
#include <ros/master.h>
#include <ros/network.h>
#include <ros/param.h>
#include <ros/this_node.h>

#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>

#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/ros/tissue_server.h"
#include "vest_tissue/voxel/volume.h"

// What the simulation does for a recording: it hands out its scene, waits for the recorder, and tells its
// death.
namespace vest::ros_shell {
namespace {

// Whether nothing listens there any more. A process that is only slow, or stopped, still takes connections.
bool refusesConnections(const std::string& host, std::uint32_t port) {
  constexpr int kPatience = 1000;  // ms: another machine that does not answer may only be busy
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  if (::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found) != 0) return false;
  bool refused = found != nullptr;
  for (const addrinfo* a = found; a != nullptr && refused; a = a->ai_next) {
    const int fd = ::socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol);
    if (fd < 0) continue;
    int error = ::connect(fd, a->ai_addr, a->ai_addrlen) == 0 ? 0 : errno;
    if (error == EINPROGRESS) {
      pollfd waiting{fd, POLLOUT, 0};
      socklen_t size = sizeof error;
      if (::poll(&waiting, 1, kPatience) == 1) ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size);
    }
    refused = error == ECONNREFUSED;
    ::close(fd);
  }
  ::freeaddrinfo(found);
  return refused;
}

}  // namespace

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

TissueServer::Recorder TissueServer::lookForRecorder() const {
  XmlRpc::XmlRpcValue request, state, payload;
  request[0] = ros::this_node::getName();
  if (!ros::master::execute("getSystemState", request, state, payload, false)) return Recorder::Unknown;
  Recorder found = Recorder::Absent;
  const XmlRpc::XmlRpcValue& publishers = payload[0];
  for (int i = 0; i < publishers.size(); ++i) {
    if (static_cast<std::string>(publishers[i][0]) != recording_.getTopic()) continue;
    for (int k = 0; k < publishers[i][1].size(); ++k) {
      XmlRpc::XmlRpcValue response, uri;
      std::string host;
      std::uint32_t port = 0;
      request[1] = publishers[i][1][k];
      if (!ros::master::execute("lookupNode", request, response, uri, false) ||
          !ros::network::splitURI(static_cast<std::string>(uri), host, port))
        return Recorder::Unknown;
      if (!refusesConnections(host, port)) return Recorder::There;
      found = Recorder::Killed;
    }
  }
  return found;
}

void TissueServer::watchRecorder() {
  // It says something twice a second, where the machine lets it. Its connection tells nothing: roscpp tries
  // again for ever.
  constexpr double kSilent = 3.0, kStandsStill = 30.0;  // s, assumed
  const auto silent = [&] {
    std::lock_guard<std::mutex> lock(recording_mutex_);
    return recorder_seen_ ? (ros::SteadyTime::now() - recording_time_).toSec() : 0.0;
  };
  if (silent() < kSilent) return;
  const Recorder found = lookForRecorder();
  const bool ended = found == Recorder::Killed || found == Recorder::Absent;
  if (silent() < (ended ? kSilent : kStandsStill)) return;
  std::lock_guard<std::mutex> lock(recording_mutex_);
  recorder_seen_ = false;
  recorder_died_ = true;
  ROS_ERROR(
      "the recorder has died: nothing more is recorded, the training goes on. What it had written is in %s; "
      "vest_recover_bag makes a whole bag of it",
      recording_state_.directory.empty() ? "its folder" : recording_state_.directory.c_str());
}

bool TissueServer::recorderGone() {
  if (recorder_died_) return true;
  {
    std::lock_guard<std::mutex> lock(recording_mutex_);
    if (recorder_seen_) return false;  // watchRecorder() looks after it
  }
  std::string refusal;
  if (ros::param::get(nh_.resolveName("session/recorder_refused"), refusal) && !refusal.empty()) return true;
  // Killed before this process heard of it: the master still has its name.
  return lookForRecorder() == Recorder::Killed;
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
    gone = recorderGone();
  }
  if (gone || waited > recorder_timeout_) {
    ROS_WARN("no recorder listens to %s after %.0f s%s: the simulation begins without one",
             steps_pub_.getTopic().c_str(), waited, gone ? ", and none will: it has ended" : "");
    recorder_died_ = true;
    recorderIsDone();
  }
}

}  // namespace vest::ros_shell
