#pragma once

#include <string>

#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <QPointer>

#include "drawn_marks.h"

namespace vest::displays {

class ImagePane;

/// Marks that a teacher draws on one view and that all views show: session/drawing
/// (visualization_msgs/ImageMarker). Who draws helps, which an input of the session says: `exercise
/// assisted`.
class TeacherDrawing {
 public:
  void connect(const ros::NodeHandle& nh, const std::string& session, ImagePane* pane);
  void shutdown();
  /// What the mouse draws on this view.
  void setPen(Stroke pen);
  void tick(double now);

 private:
  void send(visualization_msgs::ImageMarker mark);

  ros::NodeHandle nh_;
  std::string session_;
  QPointer<ImagePane> pane_;
  Stroke pen_ = Stroke::None;
  std::int32_t next_ = 0;  ///< id of the next mark
  ros::Subscriber sub_;
  ros::Publisher pub_, edit_pub_;  ///< while a pen is in the hand
};

}  // namespace vest::displays
