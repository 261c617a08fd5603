#pragma once

#include <array>
#include <memory>
#include <vector>

#include <ros/ros.h>
#include <rviz/display.h>
#include <vest_msgs/ImageVolume.h>

#include "section_visual.h"
#include "volume_visual.h"

namespace rviz {
class BoolProperty;
class EditableEnumProperty;
class FloatProperty;
class Property;
class RosTopicProperty;
class VectorProperty;
}  // namespace rviz

namespace vest::displays {

/// vest_viz/ImageVolume: slices of a patient's image and the whole volume by a table of colours and
/// opacities.
class ImageVolumeDisplay : public rviz::Display {
 public:
  ImageVolumeDisplay();
  ~ImageVolumeDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  struct Row {
    rviz::Property* group;
    rviz::Property *value, *colour, *alpha;
  };
  void subscribe();
  void take(const vest_msgs::ImageVolume::ConstPtr& message);
  void loadTable();
  void takeRows();
  void drawSlices();

  rviz::RosTopicProperty* topic_;
  rviz::BoolProperty *volume_, *shaded_, *card_, *slice_, *cut_;
  rviz::EditableEnumProperty* table_;
  rviz::Property* rows_group_;
  std::array<rviz::BoolProperty*, 3> planes_;   ///< across x, y, z of `world`
  std::array<rviz::FloatProperty*, 3> places_;  ///< share of the volume's extent
  rviz::VectorProperty* normal_;
  rviz::FloatProperty *offset_, *level_, *width_;
  std::vector<Row> rows_;
  bool filling_ = false, slices_changed_ = true;

  ros::Subscriber subscriber_;
  std::shared_ptr<const volume::Brick> brick_;
  std::string frame_;
  Eigen::Vector3d low_ = Eigen::Vector3d::Zero(), high_ = low_;  ///< m: what the volume fills
  volume::TransferTable loaded_;
  std::unique_ptr<VolumeVisual> visual_;
  std::array<std::unique_ptr<SectionVisual>, 4> sections_;  ///< the fourth is oblique
};

}  // namespace vest::displays
