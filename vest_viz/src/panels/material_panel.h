#pragma once

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <vest_msgs/TissueTopology.h>

#include "base_panel.h"

class QComboBox;
class QDoubleSpinBox;
class QSlider;

namespace vest::panels {

/// vest_viz/Material: changes stiffness and damping of an object, or gravity, while the simulation runs. The
/// change goes to `parameter_edit` and with the next step's input into the recording.
class MaterialPanel : public BasePanel {
 public:
  explicit MaterialPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void onTopology(const vest_msgs::TissueTopology& msg);
  void showObject();
  void showParameter();
  void apply();

  ros::Subscriber topology_sub_;
  ros::Publisher edit_pub_;
  vest_msgs::TissueTopology topology_;  ///< names and materials alone; arrays are dropped
  QComboBox *object_, *parameter_;
  QDoubleSpinBox* value_;
  QLabel *about_, *problem_;
};

}  // namespace vest::panels
