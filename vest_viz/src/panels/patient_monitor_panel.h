#pragma once

#include <deque>

#include <ros/subscriber.h>
#include <ros/time.h>
#include <vest_msgs/FluidState.h>
#include <vest_msgs/GasState.h>
#include <vest_msgs/HaemodynamicsState.h>

#include "base_panel.h"

namespace vest::panels {

/// What the monitor knows at one moment of simulated time.
struct MonitorSample {
  double time = 0;      ///< s, message stamp
  double pressure = 0;  ///< Pa
};

/// The curve's screen: pressure over the last seconds, drawn as on a patient monitor.
class PressureCurve : public QWidget {
 public:
  explicit PressureCurve(QWidget* parent) : QWidget(parent) { setMinimumSize(260, 110); }
  /// A sample older than the last one begins the curve anew (a bag was wound back).
  void add(const MonitorSample& sample);
  void clear() { samples_.clear(); }
  std::size_t size() const { return samples_.size(); }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  std::deque<MonitorSample> samples_;
};

/// vest_viz/PatientMonitor: arterial pressure curve, systolic / diastolic (mean), heart rate, blood loss,
/// irrigation balance, insufflator.
class PatientMonitorPanel : public BasePanel {
 public:
  explicit PatientMonitorPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void onBlood(const vest_msgs::HaemodynamicsState& msg);
  void onFluid(const vest_msgs::FluidState& msg);
  void onGas(const vest_msgs::GasState& msg);
  void showAge();

  ros::Subscriber blood_sub_, fluid_sub_, gas_sub_;
  ros::SteadyTime heard_;
  PressureCurve* curve_;
  QLabel *rate_, *pressure_, *loss_, *balance_, *gas_;
};

}  // namespace vest::panels
