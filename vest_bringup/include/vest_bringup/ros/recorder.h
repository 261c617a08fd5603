#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <sensor_msgs/Image.h>
#include <topic_tools/shape_shifter.h>
#include <opencv2/core.hpp>

#include "vest_bringup/ros/bag_writer.h"
#include "vest_bringup/ros/recording_relay.h"
#include "vest_bringup/ros/session_observer.h"
#include "vest_bringup/ros/thinning.h"
#include "vest_bringup/session/clock_watch.h"
#include "vest_bringup/session/script_end.h"

namespace vest::session {

/// Topics that make a session, relative to the launch namespace (docs/ros_interface.md).
std::vector<std::string> defaultTopics();

/// Records a session: DIR/session.bag, session.json, endoscope.png and moments. Never in the way of the
/// training: bounded queues with counted drops, a process of its own. Goes by the steady clock: where the
/// system clock jumps, the bag's times go on as before, `session/marks` and session.json say when and by how
/// much, and the stamps within messages stay what they are.
class Recorder {
 public:
  /// @throws std::invalid_argument, std::runtime_error naming parameter or file
  Recorder(ros::NodeHandle nh, ros::NodeHandle private_nh);
  ~Recorder();

  /// Until `stop` gives a reason (what session.json says it `ended`), the wished time is over, or ROS ends.
  /// @return exit code
  int run(const std::function<std::string()>& stop);

 private:
  struct Item {
    std::string topic;
    ros::Time time;  ///< when it came, by the system clock
    topic_tools::ShapeShifter::ConstPtr msg;
    boost::shared_ptr<ros::M_string> header;  ///< only where latched
    double steady;                            ///< s, when it came
  };

  void setAsideEarlier() const;
  void waitForPicture(const std::function<std::string()>& stop);
  void subscribeAll();
  void subscribe(const std::string& topic);
  /// The simulation's inputs, once it has made itself known and all else that it publishes is connected. It
  /// begins when this recorder says that it records: nothing of its first steps is lost.
  void subscribeInputs();
  bool isReady() const;
  void onMessage(const std::string& topic, const ros::MessageEvent<topic_tools::ShapeShifter const>& event);
  void onBatch(const vest_msgs::RecordingBatch::ConstPtr& batch);
  void onImage(const sensor_msgs::Image::ConstPtr& msg);
  void enqueue(Item item);
  void saveStart();
  /// Takes a step that cannot be kept yet: a recording begins with the State that was saved for it, or with
  /// the step that begins a scene. False: it is to be kept now.
  bool hold(const Item& item);
  void keepHeld();
  void writeLoop();
  void watchClock();
  void write(const Item& item);
  bool isKept(const Item& item);
  /// The item, its bytes in scratch_, for `use`.
  template <class Use>
  void asBagMessage(const Item& item, Use&& use);
  void observe(const Item& item);
  void observeContacts(const Item& item);
  void considerPicture();
  void savePicture(const cv::Mat& picture, const std::string& name);
  void finish(const std::string& ended);
  /// @param ended why the recording has ended; empty: it goes on
  void publishStatus(const std::string& ended = "");

  ros::NodeHandle nh_, private_nh_;
  std::string directory_;
  double seconds_ = 0, picture_timeout_ = 0, jpeg_rate_ = 0;
  std::optional<Thinning> thinning_;  ///< none: every message is kept
  bool wait_for_picture_ = false, relay_ = false, end_with_script_ = false;
  ScriptEnd end_;
  RelayInlet inlet_;
  std::set<std::string> relayed_;  ///< what comes through the relay
  std::vector<std::string> topics_;
  std::string step_topic_, contacts_topic_, events_topic_, marks_topic_;

  ros::CallbackQueue queue_, image_queue_;
  ros::AsyncSpinner image_spinner_{1, &image_queue_};
  std::thread listener_;  ///< empties queue_
  std::vector<ros::Subscriber> subscribers_;
  bool inputs_wanted_ = false, inputs_due_ = false, ready_ = false;
  std::atomic<bool> relay_speaks_{false};
  double inputs_known_ = 0;  ///< s, steady: since then there is a simulation; 0: there is none yet
  ros::Subscriber image_;
  ros::Publisher status_;

  std::unique_ptr<BagWriter> bag_;
  std::mutex queue_mutex_;
  std::vector<Item> queued_;
  std::size_t queued_bytes_ = 0;
  std::atomic<std::uint64_t> dropped_{0}, written_{0}, bytes_{0};
  std::atomic<bool> stop_listening_{false}, stop_writing_{false}, disk_full_{false}, snapshot_wanted_{false};
  std::atomic<double> first_step_time_{0};  ///< s, steady
  std::atomic<double> simulated_{0};        ///< s, by the steps that were written
  std::atomic<double> start_saved_{
      0};  ///< s, steady: the State was saved before, or could not be; 0: not yet
  std::thread writer_;

  // Of the writing thread, and of finish() after it.
  SessionObserver observer_;
  Summary& summary_ = observer_.summary;
  ClockWatch clock_;
  std::vector<Item> held_;  ///< first steps, until the State that they go on from is known
  bool begun_ = false;
  double first_step_steady_ = 0;
  std::vector<std::uint8_t> scratch_;
  double next_contacts_ = 0;
  std::optional<PictureMoment> moment_;  ///< the next one
  double best_force_ = -1;
  bool grasping_ = false;
  int moments_ = 0, missed_ = 0;  ///< kept, and without a picture
  cv::Mat best_picture_;

  std::mutex image_mutex_;
  cv::Mat newest_picture_;
  double newest_stamp_ = 0;  ///< s, system clock: what it shows
  std::uint64_t pictures_ = 0;
  double next_jpeg_ = 0;
};

}  // namespace vest::session
