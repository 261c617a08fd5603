#include "teacher_drawing.h"

#include <vest_msgs/ParameterEdit.h>

#include "image_pane.h"
#include "steady_seconds.h"

namespace vest::displays {

void TeacherDrawing::connect(const ros::NodeHandle& nh, const std::string& session, ImagePane* pane) {
  nh_ = nh, session_ = session, pane_ = pane;
  sub_ = nh_.subscribe<visualization_msgs::ImageMarker>(
      session_ + "/drawing", 20, [this](const visualization_msgs::ImageMarker::ConstPtr& m) {
        if (pane_ != nullptr) pane_->marks([&](DrawnMarks& marks) { return marks.add(*m, seconds()); });
      });
  setPen(pen_);
}

void TeacherDrawing::shutdown() {
  sub_.shutdown(), pub_.shutdown(), edit_pub_.shutdown();
  if (pane_ == nullptr) return;
  pane_->draw(Stroke::None, {});
  pane_->marks([](DrawnMarks& marks) {
    marks.clear();
    return true;
  });
}

void TeacherDrawing::setPen(Stroke pen) {
  pen_ = pen;
  if (pane_ == nullptr) return;
  pub_.shutdown(), edit_pub_.shutdown();
  if (pen_ != Stroke::None) {
    pub_ = nh_.advertise<visualization_msgs::ImageMarker>(session_ + "/drawing", 20);
    edit_pub_ = nh_.advertise<vest_msgs::ParameterEdit>("parameter_edit", 10);
  }
  pane_->draw(pen_, [this](const visualization_msgs::ImageMarker& mark) { send(mark); });
}

void TeacherDrawing::tick(double now) {
  if (pane_ != nullptr) pane_->marks([now](DrawnMarks& marks) { return marks.tick(now); });
}

void TeacherDrawing::send(visualization_msgs::ImageMarker mark) {
  mark.header.stamp = ros::Time::now();
  mark.ns = "teacher", mark.id = next_++;
  vest_msgs::ParameterEdit edit;
  edit.object = "exercise", edit.parameter = "assisted", edit.value = 1;
  edit_pub_.publish(edit);
  pub_.publish(mark);
}

}  // namespace vest::displays
