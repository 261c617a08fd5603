#pragma once

#include <vector>

#include <visualization_msgs/ImageMarker.h>
#include <QPointF>
#include <QRect>

class QPainter;

namespace vest::displays {

/// What a teacher draws on the picture that is shown: lines, arrows and circles, for a time. As ExerciseRim,
/// it is never in the picture that is published. Places are parts of the picture, so that its size does not
/// matter: x of the width, y of the height, from the upper left corner; a circle's diameter is part of the
/// height.
class DrawnMarks {
 public:
  /// A hostile or broken mark is left out. @param now s, any steady clock  @return whether it is shown
  bool add(const visualization_msgs::ImageMarker& mark, double now);
  /// Drops what has been shown long enough. @return whether something was
  bool tick(double now);
  void clear() { marks_.clear(); }
  /// @param picture its place in the widget
  void paint(QPainter* to, const QRect& picture) const;

 private:
  struct Mark {
    visualization_msgs::ImageMarker what;
    double until;
  };
  std::vector<Mark> marks_;
};

/// What the mouse draws.
enum class Stroke { None, Line, Arrow, Circle };

/// A stroke of the mouse. @param points parts of the picture; two or more  @param aspect width over height
visualization_msgs::ImageMarker markOf(Stroke pen, const std::vector<QPointF>& points, double aspect);

}  // namespace vest::displays
