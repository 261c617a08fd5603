#include "haptic_shell.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <ros/package.h>
#include <std_msgs/String.h>
#include <vest_msgs/TriggerOperatingState.h>

#include "vest_haptics/safety/freshness.h"
#include "vest_instruments/control/input_map.h"
#include "vest_instruments/ros/command_stamp.h"
#include "vest_instruments/ros/frames.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::ros_shell {

using haptics::Command;
using haptics::TickReport;

namespace {

constexpr double kPosePeriod = 0.002;   // s: 500 Hz
constexpr double kStatePeriod = 0.005;  // s: 200 Hz
constexpr double kButtons = 0.015;      // s: a switch that is older than 100 ms counts as released
constexpr std::int64_t kStill =
    200000000;  // ns without a tick, assumed: longer than a loaded machine keeps a thread waiting
constexpr std::int64_t kPause = 50000000;  // ns in which this process was put aside: nobody ticks then

template <class T>
T parameter(const ros::NodeHandle& nh, const std::string& name, T otherwise) {
  if (!nh.hasParam(name)) return otherwise;
  T value = otherwise;
  if (!nh.getParam(name, value)) {
    throw std::runtime_error("parameter '" + nh.resolveName(name) + "' has the wrong type");
  }
  return value;
}

double number(const ros::NodeHandle& nh, const std::string& name, double otherwise, double least,
              double most) {
  const double value = parameter<double>(nh, name, otherwise);
  if (!(value >= least && value <= most)) {
    throw std::runtime_error("parameter '" + nh.resolveName(name) + "' = " + std::to_string(value) +
                             "; allowed: " + std::to_string(least) + " … " + std::to_string(most));
  }
  return value;
}

// A list is its elements with commas between them.
std::string wordOf(XmlRpc::XmlRpcValue& value) {
  using Value = XmlRpc::XmlRpcValue;
  if (value.getType() == Value::TypeString) return static_cast<std::string>(value);
  if (value.getType() == Value::TypeBoolean) return static_cast<bool>(value) ? "true" : "false";
  std::ostringstream text;
  if (value.getType() != Value::TypeArray) {
    value.write(text);
    return text.str();
  }
  for (int i = 0; i < value.size(); ++i) text << (i > 0 ? ", " : "") << wordOf(value[i]);
  return text.str();
}

geometry_msgs::Vector3 toMsg(const Eigen::Vector3d& v) {
  geometry_msgs::Vector3 out;
  out.x = v.x();
  out.y = v.y();
  out.z = v.z();
  return out;
}

// The gate is closed over a force that would be felt: the hand began in tissue.
bool isLimp(const TickReport& r, const haptics::Capabilities& c) {
  return r.state == control::OperatingState::Enabled && r.valid && r.allowance == 0.0 &&
         !(r.limits & haptics::kLimitStale) &&
         r.force_true_W.norm() > haptics::Gate::kSmallShare * c.maximum[c.joints ? 2 : 0];
}

int instrumentOf(const std::string& name) {
  for (int i = 0; i < tools::kInstrumentCount; ++i) {
    if (name == tools::instrumentName(static_cast<tools::Instrument>(i))) return i;
  }
  return -1;
}

}  // namespace

std::unique_ptr<shared::SessionLock> holdHand() {
  constexpr double kPatience = 10.0;  // s: of a session that has just been told to end
  const std::string name = ros::param::param<std::string>("~instrument", "left");
  if (instrumentOf(name) < 0) return nullptr;  // refused by who reads all parameters
  return std::make_unique<shared::SessionLock>(
      "haptics/" + name,
      shared::contactMemoryName(ros::master::getURI(), ros::this_node::getNamespace()) + "_" + name,
      kPatience);
}

HapticShell::HapticShell(ros::NodeHandle nh, ros::NodeHandle private_nh, shared::SessionLock* hand)
    : nh_(nh), hand_(hand) {
  device_word_ = parameter<std::string>(private_nh, "device", "sim");
  name_ = parameter<std::string>(private_nh, "instrument", "left");
  const int instrument = instrumentOf(name_);
  if (instrument < 0) {
    throw std::runtime_error("parameter '" + private_nh.resolveName("instrument") + "' = '" + name_ +
                             "'; allowed: left, right, third, endoscope");
  }
  const std::string shipped = ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml";
  const std::string box =
      parameter(private_nh, "trainer_box", parameter(nh_, "instruments/trainer_box", shipped));
  controller_.instrument = instrument;
  controller_.arm = kinematics::loadTrainerBox(box).arms[static_cast<std::size_t>(instrument)];
  if (!controller_.arm.present) throw std::runtime_error(box + " has no instrument '" + name_ + "'");
  // Forces are turned by the tilt that the instruments have.
  const auto of_instruments = parameter<std::vector<double>>(nh_, "instruments/tilt", {0.0, 0.0});
  const auto tilt = parameter(private_nh, "tilt", of_instruments);
  if (tilt.size() != 2 || !(std::abs(tilt[0]) <= 0.8) || !(std::abs(tilt[1]) <= 0.8))
    throw std::runtime_error("parameter '" + private_nh.resolveName("tilt") +
                             "'; allowed: [about x, about y] in rad, each within ±0.8");
  if (nh_.hasParam("instruments/tilt") && tilt != of_instruments)
    throw std::runtime_error("parameter '" + private_nh.resolveName("tilt") + "' is not '" +
                             nh_.resolveName("instruments/tilt") +
                             "'; allowed: the same, or none: then that of the instruments counts");
  controller_.X_WB = kinematics::tiltedBox(tilt[0], tilt[1]);
  controller_.scale = number(private_nh, "scale", 1.0, 0.01, 10.0);
  controller_.force_gain = number(private_nh, "force_gain", 1.0, 0.1, 5.0);
  controller_.force_limit = number(private_nh, "force_limit", 0.0, 0.0, 1000.0);
  controller_.configured_damping = number(private_nh, "damping", 0.0, 0.0, 20.0);
  controller_.hand_damping = number(private_nh, "hand_damping", 1.0, 0.0, 20.0);
  controller_.trocar_friction = number(private_nh, "trocar_friction", 0.0, 0.0, 5.0);
  controller_.trocar_viscosity = number(private_nh, "trocar_viscosity", 0.0, 0.0, 20.0);
  controller_.passivity = parameter<bool>(private_nh, "passivity", true);
  auto_enable_ = parameter<bool>(private_nh, "auto_enable", true);
  std::map<std::string, std::string> words;
  XmlRpc::XmlRpcValue raw;
  if (private_nh.getParam("options", raw)) {
    if (raw.getType() != XmlRpc::XmlRpcValue::TypeStruct)
      throw std::runtime_error("parameter '" + private_nh.resolveName("options") +
                               "'; allowed: a map of words");
    for (auto& [key, value] : raw) options_[key] = wordOf(value);
  }
  // An input map names device and options for each instrument.
  const std::string inputs = parameter<std::string>(private_nh, "inputs", "");
  if (!inputs.empty()) {
    const control::InputMap map = control::loadInputMap(inputs);
    const control::InstrumentInput& in = map.instruments[static_cast<std::size_t>(instrument)];
    if (in.source != control::Source::Haptic)
      throw std::runtime_error(inputs + ": instruments." + name_ + ".source: '" +
                               std::string(control::sourceName(in.source)) +
                               "'; allowed: haptic, for a device is started for it");
    device_word_ = in.device;
    options_ = in.options;
  }
  const std::string memory = shared::contactMemoryName(ros::master::getURI(), nh_.getNamespace());
  watch_ = std::make_unique<SessionWatch>("haptics/" + name_);
  openDevice();

  std::string package = parameter<std::string>(private_nh, "crtk_package", "auto");
  if (package == "auto") {
    ros::V_string packages;  // asking for a missing package by name would print an error
    ros::package::getAll(packages);
    const bool found = std::find(packages.begin(), packages.end(), "crtk_msgs") != packages.end();
    package = found ? "crtk_msgs" : "vest_msgs";
  } else if (package != "vest_msgs" && package != "crtk_msgs") {
    throw std::runtime_error("parameter '" + private_nh.resolveName("crtk_package") + "' = '" + package +
                             "'; allowed: auto, vest_msgs, crtk_msgs");
  }
  ros::NodeHandle arm(nh_, "haptics/" + name_);
  measured_cp_ = arm.advertise<geometry_msgs::PoseStamped>("measured_cp", 10);
  measured_cv_ = arm.advertise<geometry_msgs::TwistStamped>("measured_cv", 10);
  measured_cf_ = arm.advertise<geometry_msgs::WrenchStamped>("measured_cf", 10);
  if (device_->capabilities().joints)
    measured_js_ = arm.advertise<sensor_msgs::JointState>("measured_js", 10);
  if (device_->capabilities().joints || device_->capabilities().jaw)
    jaw_js_ = arm.advertise<sensor_msgs::JointState>("jaw/measured_js", 10);
  buttons_ = arm.advertise<sensor_msgs::Joy>("buttons", 10, true);
  state_ = arm.advertise<vest_msgs::HapticState>("state", 10);
  ros::AdvertiseOptions operating;
  operating.init<vest_msgs::OperatingState>("operating_state", 1);
  operating.datatype = package + "/OperatingState";
  operating.latch = true;
  operating_state_ = arm.advertise(operating);
  error_ = arm.advertise<std_msgs::String>("error", 10);
  using Trigger = vest_msgs::TriggerOperatingState;
  auto query = ros::AdvertiseServiceOptions::create<Trigger>(
      "operating_state",
      [this](Trigger::Request&, Trigger::Response& answer) {
        const std::lock_guard<std::mutex> lock(operating_mutex_);
        answer.operating_state = operating_;
        return true;
      },
      nullptr, nullptr);
  query.datatype = package + "/TriggerOperatingState";
  query.req_datatype = query.datatype + "Request";
  query.res_datatype = query.datatype + "Response";
  query_ = arm.advertiseService(query);
  diagnostics_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  ros::SubscribeOptions command = ros::SubscribeOptions::create<vest_msgs::StringStamped>(
      "state_command", 10, [this](const vest_msgs::StringStampedConstPtr& msg) { onCommand(*msg); },
      ros::VoidConstPtr(), nullptr);
  command.datatype = package + "/StringStamped";
  command_ = arm.subscribe(command);
  servo_ = arm.subscribe<geometry_msgs::WrenchStamped>(
      "servo_cf", 10, [this](const geometry_msgs::WrenchStampedConstPtr& msg) { onServo(*msg); },
      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());

  js_.name = {name_ + "_yaw", name_ + "_pitch", name_ + "_insertion", name_ + "_roll"};
  js_.position.resize(4);
  jaw_.name = {name_ + "_jaw"};
  jaw_.position.resize(1);
  cp_.header.frame_id = cv_.header.frame_id = cf_.header.frame_id = frameId("phantom_box");
  haptic_state_.header.frame_id = frameId("world");
  haptic_state_.device = device_->capabilities().model;
  haptic_state_.instrument = name_;

  memory_ = std::make_shared<shared::ContactReader>(memory);
  loop_ = std::make_unique<haptics::Loop>(*device_, controller_, memory_);
  after_death_ = hand_ && hand_->predecessorDied();
  if (after_death_)
    ROS_WARN(
        "haptics/%s: the process before this one was killed or crashed: DISABLED, without force. Look at the "
        "device, then 'enable' on haptics/%s/state_command",
        name_.c_str(), name_.c_str());
  else if (auto_enable_)
    loop_->post(Command::Enable);
  loop_->start();
  publisher_ = std::thread([this] { publishLoop(); });
  const haptics::Capabilities& c = device_->capabilities();
  ROS_INFO("haptics/%s: %s%s%s, at most %.2f N", name_.c_str(), c.model.c_str(), c.serial.empty() ? "" : " ",
           c.serial.c_str(), c.maximum[c.joints ? 2 : 0]);
}

HapticShell::~HapticShell() {
  stop_ = true;
  if (publisher_.joinable()) publisher_.join();
  if (loop_) loop_->stop();
  if (device_) device_->close();
}

void HapticShell::openDevice() {
  device_ = plugins_.create(device_word_);
  device_->open(options_);
  const std::string wrong = haptics::unsound(device_->capabilities());
  if (!wrong.empty()) {
    device_->close();
    throw std::runtime_error("device '" + device_word_ + "' says of itself: " + wrong);
  }
}

ros::Time HapticShell::stamp(std::int64_t steady_ns) const {
  const double age = 1e-9 * static_cast<double>(haptics::Loop::steadyNow() - steady_ns);
  return ros::Time::now() - ros::Duration(age);
}

void HapticShell::refuse(const std::string& what, const std::string& why) {
  std_msgs::String said;
  said.data = "haptics/" + name_ + ": " + what + " refused: " + why;
  const std::lock_guard<std::mutex> lock(refuse_mutex_);
  if (told_lately_(what + why, 1e-9 * static_cast<double>(haptics::Loop::steadyNow()))) return;
  ROS_WARN_STREAM(said.data);
  error_.publish(said);
}

void HapticShell::tellRefused(unsigned commands) {
  const auto tell = [&](Command command, const std::string& word, const char* why) {
    if (commands >> static_cast<int>(command) & 1u) refuse("state_command '" + word + "'", why);
  };
  tell(Command::Enable, "enable", "the device is in FAULT; 'disable' comes first");
  tell(Command::Pause, "pause", "the device is not ENABLED");
  tell(Command::Resume, "resume", "the device is not PAUSED");
}

void HapticShell::onCommand(const vest_msgs::StringStamped& msg) {
  const std::string& w = msg.string;
  const std::string wrong = wrongStamp(msg.header.stamp, w);
  if (!wrong.empty()) {
    refuse("state_command '" + w.substr(0, 60) + "'", wrong);
  } else if (w == "enable") {
    if (hand_) hand_->settle();
    after_death_ = false;
    loop_->post(Command::Enable);
  } else if (w == "disable") {
    loop_->post(Command::Disable);  // whatever reset() waits for
    device_->reset();
    loop_->post(Command::Disable);  // the error has raised its fault anew meanwhile
  } else if (w == "home") {
    device_->home();
  } else if (w == "pause") {
    loop_->post(Command::Pause);
  } else if (w == "resume") {
    loop_->post(Command::Resume);
  } else {
    refuse("state_command '" + w.substr(0, 60) + "'", "allowed: enable, disable, pause, resume, home");
  }
}

void HapticShell::onServo(const geometry_msgs::WrenchStamped& msg) {
  // Judged by the time at which it was sent, where the client says it: a queue cannot make old commands
  // young.
  const std::int64_t now = haptics::Loop::steadyNow();
  const std::string wrong = wrongStamp(msg.header.stamp, haptics::kDecayEnds);
  if (!wrong.empty()) {
    refuse("servo_cf", wrong);
    return;
  }
  const double age = msg.header.stamp.isZero() ? 0.0 : (ros::Time::now() - msg.header.stamp).toSec();
  loop_->servo({msg.wrench.force.x, msg.wrench.force.y, msg.wrench.force.z},
               now - static_cast<std::int64_t>(std::max(age, 0.0) * 1e9));
}

void HapticShell::publishLoop() {
  double next_pose = 0.0, next_state = 0.0, next_second = 0.0;
  std::int64_t ticked = haptics::Loop::steadyNow(), passed = ticked;
  bool said = false, limp = false;
  while (!stop_) {
    const double now = 1e-9 * static_cast<double>(haptics::Loop::steadyNow());
    watch_->look();
    if (const unsigned refused = loop_->refused()) tellRefused(refused);
    if (now >= next_second) {
      next_second = now + 1.0;
      memory_->connect();
      if (command_.getNumPublishers() > 1 || servo_.getNumPublishers() > 1)
        loop_->raise(haptics::Fault::Publisher);
      const haptics::LoopStatistics s = loop_->statistics();
      rate_ = static_cast<double>(s.ticks - last_statistics_.ticks);
      last_statistics_ = s;
      if (!said && s.ticks > 0) {
        said = true;
        if (!s.realtime)
          ROS_WARN(
              "haptics/%s: no real-time priority (SCHED_FIFO); contact may feel rough beside other load. "
              "Mended by "
              "'@haptics - rtprio 90' in /etc/security/limits.conf, the group haptics and a new login",
              name_.c_str());
      }
      const TickReport& report = loop_->reports().front();
      const bool was = std::exchange(limp, isLimp(report, device_->capabilities()));
      if (limp && !was)
        ROS_WARN(
            "haptics/%s: no force is shown, for the instrument began inside tissue. Draw it out: force comes "
            "back within two seconds",
            name_.c_str());
      publishDiagnostics(report);
    }
    const std::int64_t pass = haptics::Loop::steadyNow();
    if (pass - passed > kPause) ticked += pass - passed;
    passed = pass;
    if (!stands_still_ && pass - ticked > kStill) {
      stands_still_ = true;
      ROS_ERROR(
          "haptics/%s: the loop stands still: a call of the device has not come back. %s", name_.c_str(),
          device_->capabilities().watchdog > 0.0
              ? "The device's watchdog takes its force away"
              : "The device has no watchdog and may keep its last force: let go of it and switch it off");
    }
    if (loop_->reports().update()) {
      ticked = haptics::Loop::steadyNow();
      if (stands_still_) ROS_WARN("haptics/%s: the loop goes on", name_.c_str());
      stands_still_ = false;
      const TickReport& report = loop_->reports().front();
      if (now >= next_pose) {
        next_pose = std::max(next_pose + kPosePeriod, now);
        publish(report);
      }
      if (now >= next_state) {
        next_state = std::max(next_state + kStatePeriod, now);
        publishState(report);
      }
    }
    ros::WallDuration(0.0005).sleep();
  }
}

void HapticShell::publish(const TickReport& r) {
  const ros::Time when = stamp(r.now_ns);
  cp_.header.stamp = cv_.header.stamp = cf_.header.stamp = js_.header.stamp = jaw_.header.stamp =
      r.valid ? when : ros::Time();  // CRTK: stamp 0 marks invalid data
  const Eigen::Quaterniond q(r.X_BTip.linear());
  cp_.pose.position.x = r.X_BTip.translation().x();
  cp_.pose.position.y = r.X_BTip.translation().y();
  cp_.pose.position.z = r.X_BTip.translation().z();
  cp_.pose.orientation.x = q.x();
  cp_.pose.orientation.y = q.y();
  cp_.pose.orientation.z = q.z();
  cp_.pose.orientation.w = q.w();
  measured_cp_.publish(cp_);
  cv_.twist.linear = toMsg(r.velocity_B);
  measured_cv_.publish(cv_);
  cf_.wrench.force = toMsg(controller_.X_WB.linear().transpose() * r.force_shown_W);
  measured_cf_.publish(cf_);
  const haptics::Capabilities& c = device_->capabilities();
  if (c.joints) {
    for (std::size_t i = 0; i < 4; ++i) js_.position[i] = r.sample.joints[i];
    measured_js_.publish(js_);
  }
  if (jaw_js_) {
    jaw_.position[0] = c.joints ? r.sample.joints[4] : r.sample.jaw;
    jaw_js_.publish(jaw_);
  }
  const bool due = 1e-9 * static_cast<double>(r.now_ns) - last_joy_ >= kButtons;
  if (c.buttons > 0 && r.valid && (r.sample.buttons != last_buttons_ || due)) {
    last_buttons_ = r.sample.buttons;
    last_joy_ = 1e-9 * static_cast<double>(r.now_ns);
    sensor_msgs::Joy joy;
    joy.header.stamp = when;
    for (int i = 0; i < c.buttons; ++i) joy.buttons.push_back(static_cast<int>((last_buttons_ >> i) & 1u));
    buttons_.publish(joy);
  }
  const std::string state(control::operatingStateName(r.state));
  if (state != last_state_ || r.valid != last_homed_) {
    if (r.state == control::OperatingState::Fault) {
      std::string why = device_->lastError();
      if (r.fault == haptics::Fault::ContactModel) why = r.detail;
      if (r.fault == haptics::Fault::Publisher)
        why = "'rostopic info' names them; one that was killed counts until 'rosnode cleanup'";
      ROS_ERROR(
          "haptics/%s: FAULT: %s%s%s. Forces are off; 'disable', then 'enable' on haptics/%s/state_command",
          name_.c_str(), std::string(haptics::faultText(r.fault)).c_str(), why.empty() ? "" : ": ",
          why.c_str(), name_.c_str());
    }
    last_state_ = state;
    last_homed_ = r.valid;
    vest_msgs::OperatingState msg;
    msg.header.stamp = when;
    msg.state = state;
    msg.is_homed = r.valid;
    operating_state_.publish(msg);
    const std::lock_guard<std::mutex> lock(operating_mutex_);
    operating_ = msg;
  }
}

void HapticShell::publishState(const TickReport& r) {
  haptic_state_.header.stamp = stamp(r.now_ns);
  haptic_state_.force_true = toMsg(r.force_true_W);
  haptic_state_.force_rendered = toMsg(r.force_shown_W);
  haptic_state_.model_age = r.age;
  haptic_state_.tick_rate = rate_;
  haptic_state_.energy = r.energy;
  haptic_state_.injected_damping = r.damping;
  haptic_state_.limits = r.limits;
  haptic_state_.step = r.step;
  state_.publish(haptic_state_);
}

void HapticShell::publishDiagnostics(const TickReport& r) {
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus d;
  const haptics::Capabilities& c = device_->capabilities();
  d.name = "vest_haptics: " + name_;
  d.hardware_id = c.model + (c.serial.empty() ? "" : " " + c.serial);
  d.level = DiagnosticStatus::OK;
  d.message = std::string(control::operatingStateName(r.state));
  if (r.state == control::OperatingState::Fault) {
    d.level = DiagnosticStatus::ERROR;
    d.message += ": " + std::string(haptics::faultText(r.fault));
  } else if (after_death_) {
    d.level = DiagnosticStatus::WARN;
    d.message += ": the process before was killed or crashed; 'enable' when the device is well";
  } else if (r.status != haptics::DeviceStatus::Ok) {
    d.level = DiagnosticStatus::WARN;
    d.message += std::string(": device ") + haptics::statusName(r.status);
    if (r.status == haptics::DeviceStatus::Uncalibrated) d.message += ": " + device_->calibrationHint();
  } else if (r.limits & haptics::kLimitStale) {
    d.level = DiagnosticStatus::WARN;
    d.message += ": no fresh contact model from the simulation, no force";
  } else if (isLimp(r, c)) {
    d.level = DiagnosticStatus::WARN;
    d.message += ": no force, the instrument began inside tissue; draw it out";
  }
  if (stands_still_) {
    d.level = DiagnosticStatus::ERROR;
    d.message = "the loop stands still: a call of the device has not come back";
  }
  if (watch_->masterLost()) {
    d.level = std::max<std::int8_t>(d.level, DiagnosticStatus::WARN);
    d.message += "; ROS master lost";
  }
  const auto add = [&](const char* key, const std::string& value) {
    diagnostic_msgs::KeyValue kv;
    kv.key = key;
    kv.value = value;
    d.values.push_back(kv);
  };
  const haptics::LoopStatistics& s = last_statistics_;
  add("device", device_word_);
  add("status", haptics::statusName(r.status));
  add("last error", stands_still_ ? "not asked" : device_->lastError());
  add("tick rate [Hz]", std::to_string(rate_));
  add("tick CPU p50 [us]", std::to_string(1e6 * s.cpu_p50));
  add("tick CPU p99.99 [us]", std::to_string(1e6 * s.cpu_p9999));
  add("tick CPU max [us]", std::to_string(1e6 * s.cpu_max));
  add("late ticks", std::to_string(s.late));
  add("real-time priority", s.realtime ? "yes" : "no");
  add("contact memory", memory_->connected() ? memory_->name() : memory_->connect());
  add("age of contact model [s]", std::to_string(r.age));
  add("force shown [N]", std::to_string(r.force_shown_W.norm()));
  add("force true [N]", std::to_string(r.force_true_W.norm()));
  add("allowance", std::to_string(r.allowance));
  add("energy [J]", std::to_string(r.energy));
  add("ROS master", watch_->masterLost() ? "lost" : "there");
  add("system clock was set by [s]", std::to_string(watch_->clockStep()));
  add("rejected readings", std::to_string(r.rejected));
  const haptics::Timing timing = device_->timing();
  add("stiffness shown at most [N/m]", std::to_string(r.stiffness));
  add("measured period of forces [ms]",
      timing.period > 0.0 ? std::to_string(1e3 * timing.period) : "not measured");
  add("measured delay of forces [ms]",
      timing.period > 0.0 ? std::to_string(1e3 * timing.delay) : "not measured");
  add("force that the motors bear for ever [N]",
      c.continuous > 0.0 ? std::to_string(c.continuous) : "not told");
  add("watchdog of the device [s]", c.watchdog > 0.0 ? std::to_string(c.watchdog) : "none");
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  array.status.push_back(d);
  diagnostics_.publish(array);
}

}  // namespace vest::ros_shell
