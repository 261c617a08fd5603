#pragma once

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_broadcaster.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/ExchangeOptic.h>
#include <vest_msgs/ExchangeTool.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/SelectSource.h>

#include "configuration.h"
#include "crtk_arm.h"
#include "vest_instruments/collision/collision.h"
#include "vest_instruments/control/instrument.h"
#include "vest_instruments/control/pedals.h"

namespace vest_instruments {

/// The instruments as ROS topics: one publication per message of the box, else 500 Hz. Every callback runs in
/// one thread (the queue of the given node handle).
class Instruments {
 public:
  /// @throws std::runtime_error for a wrong configuration, with one message that names the parameter
  Instruments(ros::NodeHandle nh, ros::NodeHandle private_nh);

 private:
  static constexpr std::size_t kCount = vest::tools::kInstrumentCount;

  /// Where each joint of a JointState goes; rebuilt only when the names change.
  struct JointMap {
    std::vector<std::string> names;
    std::array<std::array<int, 5>, kCount> index{};
    JointMap() {
      for (auto& joints : index) joints.fill(-1);
    }
    void learn(const std::vector<std::string>& new_names, const vest::control::InputMap& inputs);
  };

  static double steadyNow();
  void onJoints(const sensor_msgs::JointState& msg, vest::control::Source source, JointMap& map);
  void onSwitches(const sensor_msgs::Joy& msg, std::size_t k);
  bool twoPress(std::size_t k) const;  ///< another node publishes the same switches
  void nextTool(std::size_t i);
  std::uint32_t functions(std::size_t i, double now) const;  ///< what the switches ask of it
  void onContacts(const vest_msgs::ContactModels& msg);
  void onHapticPose(std::size_t i, const geometry_msgs::PoseStamped& msg);
  void onTimer();
  void onDiagnostics();
  void watchPreset();
  bool watchBoxClock(double now);  ///< whether stamps of the box are of another clock
  bool onSelectSource(vest_msgs::SelectSource::Request& request, vest_msgs::SelectSource::Response& response);
  bool onExchangeTool(vest_msgs::ExchangeTool::Request& request, vest_msgs::ExchangeTool::Response& response);
  bool onExchangeOptic(vest_msgs::ExchangeOptic::Request& request,
                       vest_msgs::ExchangeOptic::Response& response);
  std::string exchange(std::size_t i, vest::tools::ToolKind tool);  ///< empty: done; else the reason
  void publish(const ros::Time& stamp, double now);
  void fillStates(const ros::Time& stamp, double now);
  void checkCollisions();
  void prepareTransforms();
  void publishTransforms(const ros::Time& stamp);
  void setDescription();

  Configuration configuration_;
  ros::NodeHandle nh_;
  std::vector<vest::control::Instrument> instruments_;
  std::vector<std::unique_ptr<CrtkArm>> crtk_;    ///< null where the box has no such instrument
  std::vector<vest::control::Pedals> pedals_;     ///< one for each entry of configuration_.inputs.switches
  std::array<std::size_t, kCount> tray_place_{};  ///< presses of the tool pedal that exchanged a tool
  vest::collision::CollisionModel collision_;
  std::array<bool, kCount> colliding_{};
  std::array<bool, kCount> grasping_{};
  std::array<double, kCount> grasping_at_{};
  JointMap box_map_, replay_map_;

  vest_msgs::InstrumentStates states_;
  sensor_msgs::JointState joint_states_;
  std::vector<geometry_msgs::TransformStamped> transforms_;
  tf2_ros::TransformBroadcaster tf_;
  tf2_ros::StaticTransformBroadcaster static_tf_;
  ros::Publisher states_publisher_, joint_states_publisher_, diagnostics_publisher_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::Subscriber> switches_;  ///< as pedals_
  std::vector<ros::ServiceServer> services_;
  ros::SteadyTimer timer_, diagnostics_timer_;
  double last_publish_ = -1.0, last_crtk_ = -1.0, last_tf_ = -1.0, last_collision_ = -1.0, last_box_ = -1.0;
  ros::Time last_stamp_;
  bool renamed_ = false;    ///< the session says otherwise now what the box's pedals mean
  double box_ahead_ = 0.0;  ///< s: the box's newest stamp before this machine's clock
  bool box_off_ = false;
  std::uint64_t rejected_ = 0, published_ = 0, published_before_ = 0;
};

}  // namespace vest_instruments
