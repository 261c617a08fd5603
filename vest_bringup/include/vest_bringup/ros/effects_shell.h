#pragma once

#include <memory>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include <vest_msgs/GasState.h>
#include <vest_msgs/HaemodynamicsState.h>
#include <vest_msgs/SurfaceBleeding.h>

#include "vest_bringup/ros/exercise_action.h"
#include "vest_bringup/ros/field_publisher.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_tissue/ros/message_pool.h"
#include "vest_tissue/ros/tissue_server.h"

namespace vest::ros_shell {

void toMsg(const simulation::GasFrame& frame, vest_msgs::GasState& msg);
void toMsg(const simulation::BloodFrame& frame, vest_msgs::HaemodynamicsState& msg);
void toMsg(const simulation::SurfaceFrame& frame, vest_msgs::SurfaceBleeding& msg);

/// Effects as parameters and topics: reads ~effects/*, makes the Trainer of a scene, publishes effects/*. The
/// buffers outlive each Trainer: a scene that is loaded writes where the one before it wrote.
class EffectsShell {
 public:
  /// @throws std::invalid_argument naming the parameter
  EffectsShell(ros::NodeHandle nh, ros::NodeHandle private_nh);
  /// Trainer with the effects that the parameters ask for. @throws what the effects throw
  std::unique_ptr<scene::Simulation> compose(scene::World world);
  /// By the publishing thread.
  void publish(const TissueServer::Stamp& stamp);

 private:
  simulation::StageOptions options_;
  scene::TripleBuffer<simulation::GasFrame> gas_frames_;
  ros::Publisher gas_pub_;
  scene::TripleBuffer<simulation::BloodFrame> blood_frames_;
  ros::Publisher haemodynamics_pub_;
  MessagePool<vest_msgs::HaemodynamicsState> haemodynamics_pool_;
  scene::TripleBuffer<simulation::SurfaceFrame> surface_frames_;
  ros::Publisher surface_pub_;
  MessagePool<vest_msgs::SurfaceBleeding> surface_pool_;
  std::unique_ptr<FieldPublisher> field_;  ///< null: effects/field is false
  ExerciseShell exercise_;
  ExerciseAction action_;
  ros::Publisher options_pub_;
  void publishOptions(const std::string& vessels);
  void diagnose(const simulation::BloodFrame& frame);
  ros::Publisher diagnostics_pub_;
  std::uint32_t degraded_seen_ = 0, refused_seen_ = 0;  ///< of the frame before
  std::uint32_t degraded_told_ = 0;                     ///< in /diagnostics
  double diagnostics_due_ = 0;                          ///< s, steady clock
};

}  // namespace vest::ros_shell
