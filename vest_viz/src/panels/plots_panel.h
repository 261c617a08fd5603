#pragma once

#include <array>
#include <deque>
#include <vector>

#include <ros/subscriber.h>
#include <ros/time.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/HaemodynamicsState.h>
#include <vest_msgs/InstrumentStates.h>
#include <QColor>
#include <QWidget>

#include "base_panel.h"

class QLabel;
class QProgressBar;

namespace vest::panels {

/// Lines over time, of one unit; the scale fits itself to what is seen.
class TimePlot : public QWidget {
 public:
  static constexpr double kSpan = 30;        ///< s that are seen
  static constexpr double kInterval = 0.05;  ///< s between two points

  /// @param least smallest upper end of the scale, so that noise does not fill it
  TimePlot(const QString& title, std::vector<QColor> colours, double least, QWidget* parent = nullptr);
  /// @param time s; less than before begins anew. Between two points the largest value counts.
  void add(double time, std::size_t line, double value);
  /// Upper end of the scale: 1, 2 or 5 times a power of ten.
  double top() const;
  std::size_t points(std::size_t line) const { return lines_[line].size(); }
  QSize sizeHint() const override { return {300, 90}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  struct Point {
    double time, value;
  };
  QString title_;
  std::vector<QColor> colours_;
  double least_, newest_ = 0;
  std::vector<std::deque<Point>> lines_;
};

/// vest_viz/Plots: force of the tissue on each instrument as a number, a bar and over time; speed of each tip
/// and blood lost over time.
class PlotsPanel : public BasePanel {
 public:
  static constexpr std::size_t kInstruments = 3;  ///< left, right, third
  static constexpr double kBarFull = 5;           ///< N

  explicit PlotsPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void onContacts(const vest_msgs::ContactModels& msg);
  void onInstruments(const vest_msgs::InstrumentStates& msg);
  void onBlood(const vest_msgs::HaemodynamicsState& msg);
  void showNumbers();

  struct Force {
    QLabel* number;
    QProgressBar* bar;
    double largest = 0;  ///< N, since the last showNumbers()
    ros::SteadyTime heard;
  };
  ros::Subscriber contacts_sub_, instruments_sub_, blood_sub_;
  std::array<Force, kInstruments> forces_;
  TimePlot *force_, *speed_, *blood_;
};

}  // namespace vest::panels
