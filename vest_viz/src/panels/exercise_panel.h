#pragma once

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <vest_msgs/ExerciseActionResult.h>
#include <vest_msgs/SessionScore.h>

#include "base_panel.h"

class QComboBox;
class QLineEdit;
class QProgressBar;
class QPushButton;
class QTableWidget;

namespace vest::panels {

/// vest_viz/Exercise: starts and ends an exercise (action session/exercise), and shows how it goes: phase,
/// instruction, clock, running figures, result.
class ExercisePanel : public BasePanel {
 public:
  explicit ExercisePanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void start();
  void onScore(const vest_msgs::SessionScore& score);
  void onResult(const vest_msgs::ExerciseActionResult& result);

  ros::Subscriber score_sub_, instruction_sub_, result_sub_;
  ros::Publisher goal_pub_, cancel_pub_;
  QComboBox* exercise_;
  QLineEdit* trainee_;
  QPushButton *start_, *stop_;
  QLabel *title_, *instruction_, *result_, *problem_;
  QProgressBar* clock_;
  QTableWidget* items_;
};

}  // namespace vest::panels
