#include "vest_bringup/ros/recorder.h"

#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <cv_bridge/cv_bridge.h>
#include <sensor_msgs/CompressedImage.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include <vest_msgs/SessionState.h>
#include <vest_msgs/Snapshot.h>
#include <vest_msgs/StringStamped.h>

#include "vest_instruments/ros/frames.h"
#include "vest_instruments/ros/service_call.h"
#include "vest_tissue/ros/parameters.h"

namespace vest::session {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kMostQueuedBytes = 128U << 20U;
constexpr double kLate = 1.0;        // s (assumed): a step of before the State was saved has come by then
constexpr double kHeld = 30.0;       // s (assumed): no step waits longer for a State
constexpr double kConnecting = 5.0;  // s (assumed): nobody waits longer for a topic that is published

std::string withSlash(const std::string& ns) {
  return !ns.empty() && ns.back() == '/' ? ns : ns + "/";
}

template <class M>
topic_tools::ShapeShifter::ConstPtr shifted(const M& message) {
  const auto shifter = boost::make_shared<topic_tools::ShapeShifter>();
  shifter->morph(ros::message_traits::md5sum(message), ros::message_traits::datatype(message),
                 ros::message_traits::definition(message), "");
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(out, message);
  ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  shifter->read(in);
  return shifter;
}

/// The message as it is sent.
const std::vector<std::uint8_t>& toBytes(const topic_tools::ShapeShifter& message,
                                         std::vector<std::uint8_t>& to) {
  to.resize(message.size());
  ros::serialization::OStream out(to.data(), message.size());
  message.write(out);
  return to;
}

}  // namespace

std::vector<std::string> defaultTopics() {
  std::vector<std::string> topics = {"step_inputs",
                                     "tissue/scene",
                                     "joint_states",
                                     "phantom_box/joint_states",
                                     "phantom_box/footswitches",
                                     "tissue/instruments",
                                     "tissue/topology",
                                     "tissue/topology_delta",
                                     "tissue/state",
                                     "tissue/contacts",
                                     "tissue/events",
                                     "tissue/attachments",
                                     "tissue/sutures",
                                     "tissue/state_hash",
                                     "session/state",
                                     "session/score",
                                     "session/exercise_file",
                                     "session/notes",
                                     "session/drawing",
                                     "session/targets",
                                     "session/result",
                                     "model/edits",
                                     "endoscope/camera_info",
                                     "effects/options",
                                     "effects/state_hash",
                                     "effects/gas",
                                     "effects/haemodynamics",
                                     "effects/surface",
                                     "effects/fluid",
                                     "effects/smoke",
                                     "effects/lens",
                                     "effects/impacts",
                                     "/tf",
                                     "/tf_static",
                                     "/diagnostics"};
  for (const char* arm : {"left", "right", "third", "endoscope"}) {
    topics.push_back(std::string(arm) + "/measured_js");
    topics.push_back(std::string(arm) + "/measured_cp");
    topics.push_back(std::string(arm) + "/operating_state");
    topics.push_back("haptics/" + std::string(arm) + "/state");
    topics.push_back("haptics/" + std::string(arm) + "/operating_state");
  }
  return topics;
}

Recorder::Recorder(ros::NodeHandle nh, ros::NodeHandle private_nh)
    : nh_(nh), private_nh_(private_nh), observer_(withSlash(nh.getNamespace())) {
  using ros_shell::doubleParameter;
  directory_ = ros_shell::stringParameter(private_nh_, "directory", "");
  if (directory_.empty()) {
    throw std::invalid_argument("parameter " + private_nh_.resolveName("directory") +
                                ": missing (allowed: the folder that gets session.bag)");
  }
  seconds_ = doubleParameter(private_nh_, "seconds", 0.0, 0.0, 1e6);
  end_with_script_ = ros_shell::boolParameter(private_nh_, "end_with_script", false);
  picture_timeout_ = doubleParameter(private_nh_, "picture_timeout", 60.0, 0.0, 3600.0);
  jpeg_rate_ = doubleParameter(private_nh_, "jpeg_rate", 5.0, 0.0, 5.0);
  const double state_rate = doubleParameter(private_nh_, "state_rate", keptRate("tissue/state"), 1.0, 500.0);
  if (ros_shell::boolParameter(private_nh_, "thin", true))
    thinning_.emplace(withSlash(nh.getNamespace()), state_rate);
  const double min_free_mb = doubleParameter(private_nh_, "min_free_mb", 64.0, 0.1, 1e6);
  wait_for_picture_ = ros_shell::boolParameter(private_nh_, "wait_for_picture", false);
  relay_ = ros_shell::boolParameter(private_nh_, "relay", false);
  topics_ = defaultTopics();
  if (private_nh_.hasParam("topics") && !private_nh_.getParam("topics", topics_)) {
    throw std::invalid_argument("parameter " + private_nh_.resolveName("topics") + ": not a list of texts");
  }
  std::error_code error;
  fs::create_directories(directory_, error);
  if (error) throw std::runtime_error(directory_ + ": cannot be made (" + error.message() + ")");
  directory_ = fs::absolute(directory_).string();  // other processes get it as a path
  setAsideEarlier();
  bag_ =
      std::make_unique<BagWriter>(directory_ + "/session.bag", static_cast<std::uint64_t>(min_free_mb * 1e6));
  step_topic_ = nh_.resolveName("step_inputs");
  contacts_topic_ = nh_.resolveName("tissue/contacts");
  events_topic_ = nh_.resolveName("tissue/events");
  marks_topic_ = nh_.resolveName("session/marks");
  summary_.version = VEST_VERSION;
  status_ = nh_.advertise<vest_msgs::SessionState>("session/recording", 10);
}

Recorder::~Recorder() {
  stop_listening_ = true;
  if (listener_.joinable()) listener_.join();
  stop_writing_ = true;
  if (writer_.joinable()) writer_.join();
}

void Recorder::setAsideEarlier() const {
  // A recording is never overwritten.
  std::vector<fs::path> earlier;
  for (const char* name : {"session.bag", "session.bag.active", "session.bag.progress", "session.json"}) {
    if (fs::exists(fs::path(directory_) / name)) earlier.push_back(name);
  }
  if (earlier.empty()) return;
  int n = 1;
  fs::path aside;
  do {
    aside = fs::path(directory_) / ("earlier_" + std::to_string(n++));
  } while (fs::exists(aside));
  fs::create_directories(aside);
  for (const fs::path& name : earlier) fs::rename(fs::path(directory_) / name, aside / name);
  ROS_WARN("%s held a session already: it lies in %s now", directory_.c_str(), aside.c_str());
}

void Recorder::enqueue(Item item) {
  const std::size_t bytes = item.msg->size();
  std::lock_guard<std::mutex> lock(queue_mutex_);
  if (queued_bytes_ + bytes > kMostQueuedBytes) {
    ++dropped_;
    return;
  }
  queued_bytes_ += bytes;
  bag_->received();
  queued_.push_back(std::move(item));
}

void Recorder::onMessage(const std::string& topic,
                         const ros::MessageEvent<topic_tools::ShapeShifter const>& event) {
  // Where sessions share the tree of frames, each records its own.
  if ((topic == "/tf" || topic == "/tf_static") && !ros_shell::framePrefix().empty() &&
      event.getPublisherName().rfind(withSlash(nh_.getNamespace()), 0) != 0)
    return;
  if (first_step_time_ == 0 && topic == step_topic_) first_step_time_ = steadySeconds();
  const auto header = event.getConnectionHeaderPtr();
  const auto latching = header ? header->find("latching") : ros::M_string::iterator();
  const bool latched = header && latching != header->end() && latching->second == "1";
  enqueue(
      {topic, event.getReceiptTime(), event.getConstMessage(), latched ? header : nullptr, steadySeconds()});
}

void Recorder::onBatch(const vest_msgs::RecordingBatch::ConstPtr& batch) {
  relay_speaks_ = true;
  dropped_ += inlet_.take(*batch, [this](const std::string& topic, const ros::Time& receipt,
                                         topic_tools::ShapeShifter::ConstPtr message) {
    if (relayed_.count(topic) == 0) return;
    if (first_step_time_ == 0 && topic == step_topic_) first_step_time_ = steadySeconds();
    enqueue({topic, receipt, std::move(message), nullptr, steadySeconds()});
  });
}

void Recorder::subscribeAll() {
  relayed_.clear();
  if (relay_) {
    for (const std::string& name : relayedTopics()) {
      if (std::count(topics_.begin(), topics_.end(), name) > 0) relayed_.insert(nh_.resolveName(name));
    }
  }
  const std::string inputs = nh_.resolveName("step_inputs");
  for (const std::string& name : topics_) {
    const std::string topic = nh_.resolveName(name);
    if (relayed_.count(topic) == 0 && topic != inputs) subscribe(topic);
  }
  if (end_with_script_) {
    using Told = vest_msgs::StringStamped::ConstPtr;
    ros::NodeHandle nh(nh_);
    nh.setCallbackQueue(&queue_);
    const auto hear = [&](const char* topic, void (ScriptEnd::*tell)(double)) {
      subscribers_.push_back(nh.subscribe<vest_msgs::StringStamped>(
          topic, 1, [this, tell](const Told&) { (end_.*tell)(simulated_); }));
    };
    hear("session/script_end", &ScriptEnd::scriptEnded);
    hear("session/result", &ScriptEnd::exerciseEnded);
  }
  inputs_wanted_ = inputs_due_ = relay_ || std::count(topics_.begin(), topics_.end(), "step_inputs") > 0;
}

void Recorder::subscribeInputs() {
  const std::string topic = nh_.resolveName(relay_ ? "session/batches" : "step_inputs");
  ros::master::V_TopicInfo published;
  if (!ros::master::getTopics(published)) return;
  std::set<std::string> names;
  for (const ros::master::TopicInfo& info : published) names.insert(info.name);
  // A simulation makes its inputs known last.
  if (names.count(topic) == 0 || names.count(nh_.resolveName("step_inputs")) == 0) return;
  const double now = steadySeconds();
  if (inputs_known_ == 0) inputs_known_ = now;
  const auto missing = [&names](const ros::Subscriber& s) {
    return names.count(s.getTopic()) > 0 && s.getNumPublishers() == 0;
  };
  // A node that died keeps its names at the master: nobody waits for it for long.
  if (now < inputs_known_ + kConnecting && std::any_of(subscribers_.begin(), subscribers_.end(), missing))
    return;
  inputs_due_ = false;
  if (!relay_) {
    subscribe(topic);
    return;
  }
  ros::NodeHandle nh(nh_);
  nh.setCallbackQueue(&queue_);
  subscribers_.push_back(nh.subscribe("session/batches", 500, &Recorder::onBatch, this));
}

bool Recorder::isReady() const {
  if (!inputs_wanted_) return true;
  if (inputs_due_) return false;
  return relay_ ? relay_speaks_.load() : subscribers_.back().getNumPublishers() > 0;
}

void Recorder::subscribe(const std::string& topic) {
  ros::SubscribeOptions options;
  options.topic = topic;
  options.queue_size = 8000;
  options.md5sum = ros::message_traits::md5sum<topic_tools::ShapeShifter>();
  options.datatype = ros::message_traits::datatype<topic_tools::ShapeShifter>();
  options.helper = boost::make_shared<
      ros::SubscriptionCallbackHelperT<const ros::MessageEvent<topic_tools::ShapeShifter const>&>>(
      [this, topic](const ros::MessageEvent<topic_tools::ShapeShifter const>& event) {
        onMessage(topic, event);
      });
  options.callback_queue = &queue_;
  subscribers_.push_back(nh_.subscribe(options));
}

void Recorder::onImage(const sensor_msgs::Image::ConstPtr& msg) {
  const auto shared = cv_bridge::toCvShare(msg);
  cv::Mat bgr;
  if (msg->encoding == "rgb8") {
    cv::cvtColor(shared->image, bgr, cv::COLOR_RGB2BGR);
  } else {
    bgr = shared->image.clone();
  }
  {
    std::lock_guard<std::mutex> lock(image_mutex_);
    newest_picture_ = bgr;  // never touched again: others may hold it
    newest_stamp_ = msg->header.stamp.toSec();
    ++pictures_;
  }
  const double now = steadySeconds();
  if (jpeg_rate_ <= 0 || now < next_jpeg_) return;
  next_jpeg_ = std::max(next_jpeg_ + 1.0 / jpeg_rate_, now);
  sensor_msgs::CompressedImage jpeg;
  jpeg.header = msg->header;
  jpeg.format = "jpeg";
  cv::imencode(".jpg", bgr, jpeg.data, {cv::IMWRITE_JPEG_QUALITY, 90});
  enqueue({image_.getTopic() + "/compressed", ros::Time::now(), shifted(jpeg), nullptr, now});
}

int Recorder::run(const std::function<std::string()>& stop) {
  ros::NodeHandle image_nh(nh_);
  image_nh.setCallbackQueue(&image_queue_);
  image_ = image_nh.subscribe("endoscope/image_raw", 1, &Recorder::onImage, this);
  writer_ = std::thread([this] { writeLoop(); });
  image_spinner_.start();
  if (wait_for_picture_) waitForPicture(stop);
  subscribeAll();
  // Thousands of messages a second: taken in heaps, a thread need not be woken for each. They bear the time
  // at which they came.
  listener_ = std::thread([this] {
    while (!stop_listening_) {
      queue_.callAvailable(ros::WallDuration(0));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    queue_.callAvailable(ros::WallDuration(0));
  });
  ROS_INFO("recording %zu topics to %s", topics_.size(), directory_.c_str());

  std::string ended = "interrupted";
  double next_status = 0, next_look = 0;
  bool warned = false;
  while (ros::ok()) {
    if (const std::string reason = stop(); !reason.empty()) {
      ended = reason;
      break;
    }
    const double now = steadySeconds();
    if (end_with_script_ && end_.over(simulated_)) {
      ended = "after the script";
      break;
    }
    if (seconds_ > 0 && first_step_time_ > 0 && now - first_step_time_ >= seconds_) {
      ended = "after the wished time";
      break;
    }
    if (inputs_due_ && now >= next_look) {
      next_look = now + 0.1;
      subscribeInputs();
    }
    if (!ready_ && isReady()) {
      ready_ = true;
      next_status = 0;  // at once: the simulation waits for it
    }
    if (snapshot_wanted_.exchange(false)) saveStart();
    if (disk_full_ && !warned) {
      warned = true;
      ROS_ERROR(
          "the disk of %s is nearly full: the bag was closed and is valid, nothing more is recorded; the "
          "training goes on",
          directory_.c_str());
    }
    if (now >= next_status) {
      next_status = now + 0.5;
      publishStatus();
    }
    ros::WallDuration(0.02).sleep();
  }
  finish(ended);
  return 0;
}

void Recorder::saveStart() {
  std::error_code error;
  fs::create_directories(fs::path(directory_) / "snapshots", error);
  vest_msgs::Snapshot snapshot;
  snapshot.request.operation = vest_msgs::Snapshot::Request::SAVE;
  snapshot.request.name = "start";
  const bool called = ros_shell::callService(nh_.resolveName("tissue/snapshot"), snapshot);
  // The simulation says which file it wrote: that of this folder, where it was told of the same one.
  const fs::path file = fs::path(directory_) / "snapshots" / "start.snapshot";
  if (!called || !snapshot.response.success || !fs::equivalent(file, snapshot.response.message, error)) {
    ROS_WARN(
        "the recording begins in the middle, and the State could not be saved: it cannot be re-simulated "
        "(%s)",
        snapshot.response.message.c_str());
  }
  start_saved_ = steadySeconds();
}

bool Recorder::hold(const Item& item) {
  if (begun_) return false;
  StepHead head;
  bool readable = false;
  asBagMessage(item, [&](const BagMessage& message) { readable = readStepHead(message, head); });
  if (!readable) return false;
  if (head.step == 1) {  // what came before leads to another State
    held_.clear();
    begun_ = true;
    return false;
  }
  if (held_.empty()) snapshot_wanted_ = true;
  held_.push_back(item);
  const bool known = start_saved_ > 0 && item.steady > start_saved_ + kLate;
  if (known || item.steady > held_.front().steady + kHeld) keepHeld();
  return true;
}

void Recorder::keepHeld() {
  begun_ = true;
  for (const Item& item : held_) {
    observe(item);
    write(item);
  }
  held_.clear();
}

void Recorder::writeLoop() {
  using Clock = std::chrono::steady_clock;
  auto chunk_due = Clock::now(), disk_due = Clock::now();
  std::vector<Item> items;
  for (bool last = false; !last;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    last = stop_writing_;  // read before the queue: nothing that was queued by then is left behind
    items.clear();
    {
      std::lock_guard<std::mutex> lock(queue_mutex_);
      items.swap(queued_);
      queued_bytes_ = 0;
    }
    watchClock();  // after the queue was emptied: a jump before any of its times is known
    for (const Item& item : items) {
      if (item.topic == step_topic_ && hold(item)) continue;
      observe(item);
      if (isKept(item)) write(item);
    }
    if (last) keepHeld();
    const auto now = Clock::now();
    if (now >= chunk_due) {
      chunk_due = now + std::chrono::milliseconds(250);
      bag_->closeChunk();
      considerPicture();
    }
    if (now >= disk_due) {
      disk_due = now + std::chrono::seconds(1);
      bag_->checkDisk();
      disk_full_ = bag_->diskFull();
    }
    bytes_ = bag_->bytes();
  }
}

void Recorder::watchClock() {
  const auto reading = readClocks();
  const auto jump = reading ? clock_.look(reading->system, reading->steady) : std::nullopt;
  if (!jump) return;
  const double since = summary_.steps.steps() > 0 ? jump->steady - first_step_steady_ : 0.0;
  summary_.clock_jumps.push_back({summary_.steps.lastStep(), since, jump->by});
  char text[80];
  std::snprintf(text, sizeof text, "system clock set by %+.6f s", jump->by);
  ROS_WARN("%s: marked in the recording, whose times go on by the steady clock", text);
  vest_msgs::StringStamped mark;
  mark.header.stamp = ros::Time::now();
  mark.string = text;
  bag_->received();
  write({marks_topic_, mark.header.stamp, shifted(mark), nullptr, jump->steady});
}

void Recorder::write(const Item& item) {
  const double time = clock_.line(item.time.toSec(), item.steady);
  const ros::Time stamp = clock_.jumps().empty() ? item.time : ros::Time(std::max(time, 0.0));
  if (!bag_->write(item.topic, stamp, *item.msg, item.header)) return;
  ++written_;
}

template <class Use>
void Recorder::asBagMessage(const Item& item, Use&& use) {
  BagConnection connection;
  connection.topic = item.topic;
  connection.type = item.msg->getDataType();
  connection.md5sum = item.msg->getMD5Sum();
  toBytes(*item.msg, scratch_);
  use(BagMessage{connection, item.time.sec, item.time.nsec, scratch_.data(), item.msg->size()});
}

bool Recorder::isKept(const Item& item) {
  bool kept = true;
  if (thinning_ && thinning_->wants(item.topic))
    asBagMessage(item, [&](const BagMessage& message) {
      kept = thinning_->keeps(message, clock_.line(item.time.toSec(), item.steady));
    });
  return kept;
}

void Recorder::observe(const Item& item) {
  if (item.topic == contacts_topic_ && item.steady >= next_contacts_) {
    next_contacts_ = item.steady + 0.1;
    observeContacts(item);
  }
  if (item.topic == events_topic_) moment_.emplace(item.time.toSec() + 0.3);
  const double time = clock_.line(item.time.toSec(), item.steady);
  summary_.topics[item.topic].add(time);
  if (!observer_.wants(item.topic)) return;
  asBagMessage(item, [&](const BagMessage& message) {
    StepHead head;
    if (summary_.steps.steps() == 0 && item.topic == step_topic_ && readStepHead(message, head))
      first_step_steady_ = item.steady;
    observer_.observe(message, time, [&](double stamp) { return clock_.line(stamp, item.steady); });
  });
  simulated_ = summary_.steps.simulated();
}

void Recorder::publishStatus(const std::string& ended) {
  vest_msgs::SessionState msg;
  msg.header.stamp = ros::Time::now();
  msg.directory = directory_;
  msg.state = disk_full_ || !ended.empty() ? vest_msgs::SessionState::IDLE : vest_msgs::SessionState::RUNNING;
  msg.recording = msg.state == vest_msgs::SessionState::RUNNING && ready_;
  msg.recorded_messages = written_;
  msg.recorded_bytes = bytes_;
  msg.dropped_messages = dropped_;
  if (!ready_)
    msg.status = subscribers_.empty() ? "waiting for the first picture" : "waiting for the simulation";
  if (!ended.empty()) msg.status = "the recording has ended: " + ended;
  if (disk_full_) msg.status = "disk full: the bag is closed";
  status_.publish(msg);
}

void Recorder::finish(const std::string& ended) {
  publishStatus(ended);  // whoever watches can tell an end from a death, however long the bag takes to close
  stop_listening_ = true;
  if (listener_.joinable()) listener_.join();
  for (ros::Subscriber& s : subscribers_) s.shutdown();
  image_.shutdown();
  image_spinner_.stop();
  stop_writing_ = true;
  if (writer_.joinable()) writer_.join();
  bag_->close();
  const cv::Mat picture = best_picture_.empty() ? newest_picture_ : best_picture_;
  if (!picture.empty()) savePicture(picture, "endoscope.png");
  summary_.messages = written_;
  summary_.dropped = dropped_;
  summary_.bytes = bag_->bytes();
  summary_.disk_full = bag_->diskFull();
  summary_.ended = summary_.disk_full ? "disk full" : ended;
  if (!writeSummary(summary_, directory_)) ROS_ERROR("%s/session.json cannot be written", directory_.c_str());
  const double minutes = first_step_time_ > 0 ? (steadySeconds() - first_step_time_) / 60 : 0;
  const double megabytes = 1e-6 * static_cast<double>(summary_.bytes);
  std::fprintf(stderr, "session recorded: %s, %llu messages, %llu steps, %.0f MB", directory_.c_str(),
               static_cast<unsigned long long>(summary_.messages),
               static_cast<unsigned long long>(summary_.steps.steps()), megabytes);
  std::fprintf(stderr, minutes > 0.02 ? " (%.0f MB a minute)\n" : "\n", megabytes / minutes);
}

}  // namespace vest::session
