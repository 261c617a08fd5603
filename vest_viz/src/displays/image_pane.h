#pragma once

#include <functional>
#include <vector>

#include <QImage>
#include <QTimer>
#include <QWidget>

#include "drawn_marks.h"
#include "exercise_rim.h"

class QMainWindow;
class QMouseEvent;
class QPainter;

namespace vest::displays {

/// Shows a picture, as large as fits, black around it.
class ImagePane : public QWidget {
 public:
  explicit ImagePane(QWidget* parent = nullptr);
  /// @param rgb packed 8 bit RGB, copied; for any thread
  static QImage convert(const unsigned char* rgb, int width, int height);
  void show(const QImage& image);
  /// Red words over the picture; empty: none. They are in no picture that is published.
  void warn(const QString& words);
  /// What an exercise tells at the rim; likewise. @param change called as change(rim): whether it is drawn
  /// anew
  void rim(const std::function<bool(ExerciseRim&)>& change) {
    if (change(rim_)) update();
  }
  /// Likewise for what a teacher drew.
  void marks(const std::function<bool(DrawnMarks&)>& change) {
    if (change(marks_)) update();
  }
  /// With a pen the left button of the mouse draws, and no longer acts on what is below.
  /// @param drawn gets what was drawn when the button is released
  void draw(Stroke pen, std::function<void(const visualization_msgs::ImageMarker&)> drawn);
  const QString& warning() const { return warning_; }
  /// Lies over `host` and follows its size; nullptr ends that.
  void cover(QWidget* host);
  /// In a dock of `frame`: when the frame changes its size, its dock takes the width that
  /// its height allows, and docks at the bottom leave room for the 3-D view.
  void fillDockOf(QMainWindow* frame);
  QSize sizeHint() const override { return QSize(720, 576); }

 protected:
  void paintEvent(QPaintEvent* event) override;
  /// Over a host, mouse and wheel are the host's, but for the button that draws.
  bool event(QEvent* event) override;
  bool eventFilter(QObject* watched, QEvent* event) override;

 private:
  void paintPicture(QPainter* to);
  /// Where the picture lies in the pane.
  QRect place() const;
  /// @return whether it was drawing
  bool stroke(const QMouseEvent& mouse);
  visualization_msgs::ImageMarker markOfStroke() const;
  void shareFrame();
  QImage image_;
  QString warning_;
  ExerciseRim rim_;
  DrawnMarks marks_;
  Stroke pen_ = Stroke::None;
  std::vector<QPointF> stroke_;  ///< that is being drawn; parts of the picture
  std::function<void(const visualization_msgs::ImageMarker&)> drawn_;
  QWidget* host_ = nullptr;
  QMainWindow* frame_ = nullptr;
  QTimer arrange_;
};

}  // namespace vest::displays
