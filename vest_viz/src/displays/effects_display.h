#pragma once

#include <memory>
#include <string>

#include <ros/ros.h>
#include <rviz/display.h>

#include "effects_visual.h"
#include "vest_instruments/ros/frames.h"

namespace rviz {
class BoolProperty;
class FloatProperty;
class StringProperty;
}  // namespace rviz

namespace vest::displays {

/// vest_viz/Effects: clips, threads, needles, slings, drops, pools and puffs of smoke in rviz's 3-D view.
class EffectsDisplay : public rviz::Display {
 public:
  EffectsDisplay();
  ~EffectsDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  void subscribe();

  rviz::StringProperty* tissue_topic_;
  rviz::StringProperty* effects_topic_;
  rviz::FloatProperty* light_;
  ros::Subscriber subscribers_[4];
  vest_msgs::TissueAttachments::ConstPtr attachments_;
  vest_msgs::SutureStates::ConstPtr sutures_;
  vest_msgs::FluidState::ConstPtr fluid_;
  vest_msgs::SmokeState::ConstPtr smoke_;
  std::string frame_ = ros_shell::frameId("world");  ///< of what came last
  bool changed_ = false;
  std::unique_ptr<EffectsVisual> visual_;
};

}  // namespace vest::displays
