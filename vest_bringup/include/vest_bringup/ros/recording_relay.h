#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <topic_tools/shape_shifter.h>
#include <vest_msgs/RecordingBatch.h>

namespace vest::session {

/// Frequent topics of the simulation's process, relative to the launch namespace: with the relay they reach
/// the recorder in batches. The others, and all latched ones, go the usual way.
std::vector<std::string> relayedTopics();

/// Hands the messages of relayedTopics() on as `session/batches`, 50 a second. Lives in the process that
/// publishes them, where they cost no socket. Subscribes only while somebody listens.
class RecordingRelay {
 public:
  explicit RecordingRelay(ros::NodeHandle nh);
  ~RecordingRelay();

 private:
  struct Topic;
  template <class M>
  void relay(const std::string& name);
  template <class M>
  void append(std::uint16_t topic, const M& message, const ros::Time& receipt);
  void loop();
  void send();

  ros::NodeHandle nh_;
  ros::CallbackQueue queue_;
  ros::Publisher publisher_;
  std::vector<Topic> topics_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<std::uint32_t> sequences_;  ///< by topic: messages so far
  vest_msgs::RecordingBatch batch_;
  std::uint64_t count_ = 0;
  bool listener_came_ = false;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// The recorder's end: takes batches apart.
class RelayInlet {
 public:
  using Callback = std::function<void(const std::string& topic, const ros::Time& receipt,
                                      topic_tools::ShapeShifter::ConstPtr)>;
  /// Hands on every message whose topic was described. @return messages lost since the last batch
  std::uint64_t take(const vest_msgs::RecordingBatch& batch, const Callback& callback);

 private:
  struct Kind {
    std::string topic, datatype, md5sum, definition;
  };
  std::map<std::uint16_t, Kind> kinds_;
  std::uint64_t next_ = 0;
  bool begun_ = false;
};

}  // namespace vest::session
