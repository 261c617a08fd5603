#pragma once

#include <ros/subscriber.h>
#include <ros/time.h>
#include <vest_msgs/SessionState.h>

#include "base_panel.h"
#include "vest_viz/session/recorder_watch.h"

class QComboBox;
class QDoubleSpinBox;
class QLineEdit;
class QPushButton;
class QSpinBox;

namespace vest::panels {

/// vest_viz/Session: state of the simulation and its recording; starts and stops a recording, pause, single
/// steps, speed, reset, scene, snapshot, restore.
class SessionPanel : public BasePanel {
 public:
  explicit SessionPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void onState(const vest_msgs::SessionState& msg);
  void showAge();
  void snapshot(bool restore);
  /// Calls a service whose answer has `success` and `message`; a refusal is shown.
  template <class Service>
  void ask(const std::string& name, const Service& service);

  ros::Subscriber state_sub_, recorder_sub_;
  session::RecorderWatch recorder_;
  vest_msgs::SessionState state_;
  ros::SteadyTime heard_;
  QLabel *state_label_, *recording_label_, *problem_;
  QPushButton *start_, *stop_, *pause_, *step_, *reset_, *load_, *save_, *restore_;
  QSpinBox* steps_;
  QDoubleSpinBox* speed_;
  QComboBox* scene_;
  QLineEdit* snapshot_;
};

}  // namespace vest::panels
