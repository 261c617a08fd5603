#pragma once

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/SessionState.h>
#include <vest_msgs/TissueTopology.h>

#include <array>

#include "base_panel.h"

class QComboBox;
class QDoubleSpinBox;
class QLineEdit;
class QPushButton;

namespace vest::panels {

/// vest_viz/Teacher: pauses, makes complications, takes the camera over, tells the trainee something, and
/// gives the views of its rviz a pen. Each is an input that the recording keeps, and the exercise's result is
/// then called assisted.
class TeacherPanel : public BasePanel {
 public:
  explicit TeacherPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void edit(const std::string& object, const std::string& parameter, double value);
  void assisted() { edit("exercise", "assisted", 1); }
  void bleed();
  void fail(bool fails);
  void takeCamera();
  void select(const std::string& instrument, std::uint8_t source);
  void say();
  void takePen(const QString& pen);
  void onTopology(const vest_msgs::TissueTopology& msg);
  void onInstruments(const vest_msgs::InstrumentStates& msg);

  ros::Subscriber state_sub_, topology_sub_, instruments_sub_;
  ros::Publisher edit_pub_, notes_pub_;
  struct Vessel {
    std::string name;
    double length = 0;  ///< m
  };
  std::vector<Vessel> vessels_;
  std::string scene_hash_;
  bool paused_ = false;
  std::uint8_t camera_ = 0;              ///< source of the endoscope
  std::array<std::uint8_t, 2> hands_{};  ///< of left and right
  /// Whom they are given back to: at first the box.
  std::uint8_t camera_before_ = vest_msgs::InstrumentState::SOURCE_BOX;
  std::array<std::uint8_t, 2> hands_before_{camera_before_, camera_before_};
  QPushButton *pause_, *bleed_, *fog_, *fail_, *mend_, *camera_button_, *say_;
  QComboBox *vessel_, *fault_, *pen_;
  QDoubleSpinBox* area_;
  QLineEdit* words_;
  QLabel* problem_;
};

}  // namespace vest::panels
