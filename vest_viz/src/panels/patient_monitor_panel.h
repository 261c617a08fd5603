#pragma once

#include <deque>

#include <QColor>

#include <ros/subscriber.h>
#include <ros/time.h>
#include <vest_msgs/FluidState.h>
#include <vest_msgs/GasState.h>
#include <vest_msgs/HaemodynamicsState.h>

#include "base_panel.h"

namespace vest::panels {

/// What the monitor knows at one moment of simulated time.
struct MonitorSample {
  double time = 0;   ///< s, message stamp
  double value = 0;  ///< mV, mmHg or %, as the trace has it
};

/// One trace of the screen: a value over the last seconds, drawn as on a patient monitor.
class MonitorTrace : public QWidget {
 public:
  /// @param step of the scale, `least` steps at least are shown: noise is never blown up to the full height
  MonitorTrace(QWidget* parent, const QColor& colour, double step, int least, bool numbers);
  /// A sample older than the last one clears the trace: a bag was wound back.
  void add(const MonitorSample& sample);

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  const QColor colour_;
  const double step_;
  const int least_;
  const bool numbers_;
  std::deque<MonitorSample> samples_;
};

/// vest_viz/PatientMonitor: ECG, arterial pressure, plethysmogram; heart rate, systolic / diastolic (mean),
/// oxygen saturation, blood loss, irrigation balance, insufflator.
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
  MonitorTrace *ecg_, *curve_, *pleth_;
  QLabel *rate_, *pressure_, *oxygen_, *loss_, *blood_, *balance_, *tools_, *gas_;
};

}  // namespace vest::panels
