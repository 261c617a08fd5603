#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TwistStamped.h>
#include <geometry_msgs/WrenchStamped.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <vest_msgs/HapticState.h>
#include <vest_msgs/OperatingState.h>
#include <vest_msgs/StringStamped.h>

#include "device_plugins.h"
#include "session_watch.h"
#include "vest_haptics/loop/loop.h"
#include "vest_instruments/ros/told_lately.h"
#include "vest_tissue/shared/session_lock.h"

namespace vest::ros_shell {

/// The hand of `~instrument` in this session, for this process alone. Asked for before the first NodeHandle.
/// @throws std::runtime_error where another process has it, or there is no shared memory
std::unique_ptr<shared::SessionLock> holdHand();

/// One device as a CRTK arm under haptics/NAME, NAME being the instrument that it moves.
class HapticShell {
 public:
  /// @param hand whose predecessor's death keeps the device DISABLED until somebody enables it; may be null
  /// @throws std::runtime_error: one message that names parameter, library or device and what to do
  HapticShell(ros::NodeHandle nh, ros::NodeHandle private_nh, shared::SessionLock* hand);
  ~HapticShell();
  haptics::Loop& loop() { return *loop_; }

 private:
  void publishLoop();
  void publish(const haptics::TickReport& report);
  void publishState(const haptics::TickReport& report);
  void publishDiagnostics(const haptics::TickReport& report);
  void onCommand(const vest_msgs::StringStamped& msg);
  void onServo(const geometry_msgs::WrenchStamped& msg);
  void refuse(const std::string& what, const std::string& why);
  void tellRefused(unsigned commands);
  void openDevice();
  ros::Time stamp(std::int64_t steady_ns) const;

  ros::NodeHandle nh_;
  std::string device_word_, name_;
  haptics::DeviceOptions options_;
  haptics::ControllerOptions controller_;
  bool auto_enable_ = true;
  shared::SessionLock* hand_;
  std::atomic<bool> after_death_{false};  ///< of the process before, and nobody has enabled this one yet

  DevicePlugins plugins_;
  boost::shared_ptr<haptics::Device> device_;
  std::shared_ptr<shared::ContactReader> memory_;
  std::unique_ptr<haptics::Loop> loop_;
  std::unique_ptr<SessionWatch> watch_;

  ros::Publisher measured_cp_, measured_cv_, measured_cf_, measured_js_, jaw_js_, buttons_, state_,
      operating_state_, error_, diagnostics_;
  ros::Subscriber command_, servo_;
  ros::ServiceServer query_;
  std::mutex operating_mutex_;
  vest_msgs::OperatingState operating_;  ///< as it was published last
  geometry_msgs::PoseStamped cp_;
  geometry_msgs::TwistStamped cv_;
  geometry_msgs::WrenchStamped cf_;
  sensor_msgs::JointState js_, jaw_;
  vest_msgs::HapticState haptic_state_;
  std::uint32_t last_buttons_ = 0xffffffff;
  double last_joy_ = -1.0;  // s, steady
  std::mutex refuse_mutex_;
  ToldLately told_lately_;
  std::string last_state_;
  bool last_homed_ = false;
  haptics::LoopStatistics last_statistics_;
  double rate_ = 0.0;
  bool stands_still_ = false;
  std::atomic<bool> stop_{false};
  std::thread publisher_;
};

}  // namespace vest::ros_shell
