#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ros/ros.h>
#include <rviz/display.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/TissueAttachments.h>

#include "vest_instruments/ros/frames.h"

namespace Ogre {
class ManualObject;
}

namespace rviz {
class Arrow;
class BoolProperty;
class FloatProperty;
class StringProperty;
}  // namespace rviz

namespace vest::displays {

/// vest_viz/Contacts: forces of the tissue on the instruments as arrows, contact planes, proxies, the
/// instruments' interaction points and collision shapes, and what is anchored in tissue.
class ContactsDisplay : public rviz::Display {
 public:
  ContactsDisplay();
  ~ContactsDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  void subscribe();
  void draw();
  void drawForces();
  void drawShapes();
  void drawAttachments();

  rviz::StringProperty* tissue_topic_;
  rviz::StringProperty* instruments_topic_;
  rviz::FloatProperty* scale_;
  rviz::BoolProperty* forces_;
  rviz::BoolProperty* planes_;
  rviz::BoolProperty* points_;
  rviz::BoolProperty* shapes_;
  rviz::BoolProperty* attachments_;
  ros::Subscriber contacts_sub_, instruments_sub_, attachments_sub_;
  vest_msgs::ContactModels::ConstPtr contacts_message_;
  vest_msgs::InstrumentStates::ConstPtr instruments_message_;
  vest_msgs::TissueAttachments::ConstPtr attachments_message_;
  std::string frame_ = ros_shell::frameId("world");  ///< of what came last
  bool changed_ = false;
  std::uint64_t left_out_ = 0;
  std::vector<std::unique_ptr<rviz::Arrow>> arrows_;
  Ogre::ManualObject* lines_ = nullptr;
  std::string material_;
  std::size_t line_count_ = 0;
};

}  // namespace vest::displays
