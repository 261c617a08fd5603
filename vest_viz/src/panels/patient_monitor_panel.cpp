#include "patient_monitor_panel.h"

#include <algorithm>
#include <cmath>

#include <QGridLayout>
#include <QLabel>
#include <QPainter>
#include <QTimer>

#include <pluginlib/class_list_macros.hpp>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::panels {
namespace {

constexpr double kPascalPerMmHg = 133.322;  ///< Pa; conventional millimetre of mercury, ISO 80000-4
constexpr double kWindow = 6.0;             ///< s of curve on the screen
constexpr double kMonitorSilent = 1.0;      ///< s
constexpr float kToldClog = 0.05f;          ///< of the bore: less is not felt (assumed)
constexpr float kToldPressor = 0.01f;       ///< of the resistance
constexpr float kToldFull = 0.95f;          ///< of what a swab holds
const QColor kRed(255, 70, 60), kGreen(90, 230, 110), kBlue(90, 190, 255), kYellow(240, 220, 90),
    kCyan(80, 220, 220), kGrid(48, 56, 60);

QLabel* number(QWidget* parent, const QColor& colour) {
  auto* const label = new QLabel(parent);
  label->setStyleSheet(QString("color: %1; background: transparent").arg(colour.name()));
  label->setTextFormat(Qt::RichText);
  return label;
}

}  // namespace

MonitorTrace::MonitorTrace(QWidget* parent, const QColor& colour, double step, int least, bool numbers)
    : QWidget(parent), colour_(colour), step_(step), least_(least), numbers_(numbers) {
  setMinimumSize(260, numbers ? 60 : 25);
}

void MonitorTrace::add(const MonitorSample& sample) {
  if (!std::isfinite(sample.value) || !std::isfinite(sample.time)) return;
  if (!samples_.empty() && sample.time < samples_.back().time) samples_.clear();
  samples_.push_back(sample);
  while (sample.time - samples_.front().time > kWindow) samples_.pop_front();
  update();
}

void MonitorTrace::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), Qt::black);
  if (samples_.empty()) return;
  double low = 1e9, high = -1e9;
  for (const MonitorSample& s : samples_) {
    low = std::min(low, s.value);
    high = std::max(high, s.value);
  }
  low = step_ * std::floor(low / step_ - 0.5);
  high = std::max(step_ * std::ceil(high / step_ + 0.5), low + least_ * step_);
  const auto y = [&](double value) { return height() - (value - low) / (high - low) * height(); };
  painter.setPen(kGrid);
  for (double p = low; numbers_ && p <= high; p += 2 * step_) {
    painter.drawLine(QPointF(0, y(p)), QPointF(width(), y(p)));
    painter.setPen(QColor(130, 140, 145));
    painter.drawText(QPointF(2, y(p) - 2), QString::number(p, 'f', 0));
    painter.setPen(kGrid);
  }
  painter.setRenderHint(QPainter::Antialiasing);
  painter.setPen(QPen(colour_, 1.6));
  const double end = samples_.back().time;
  QPolygonF line;
  for (const MonitorSample& s : samples_)
    line << QPointF(width() * (1.0 - (end - s.time) / kWindow), y(s.value));
  painter.drawPolyline(line);
}

PatientMonitorPanel::PatientMonitorPanel(QWidget* parent) : BasePanel(parent) {
  setStyleSheet("background: black; color: #c8d0d4");
  auto* const grid = new QGridLayout(this);
  ecg_ = new MonitorTrace(this, kGreen, 0.5, 3, false);  // mV
  curve_ = new MonitorTrace(this, kRed, 10, 4, true);    // mmHg
  pleth_ = new MonitorTrace(this, kCyan, 2, 4, false);   // %
  rate_ = number(this, kGreen);
  pressure_ = number(this, kRed);
  oxygen_ = number(this, kCyan);
  loss_ = number(this, kRed);
  balance_ = number(this, kBlue);
  gas_ = number(this, kYellow);
  blood_ = number(this, kRed);
  tools_ = number(this, kBlue);
  grid->addWidget(ecg_, 0, 0);
  grid->addWidget(curve_, 1, 0, 3, 1);
  grid->addWidget(pleth_, 4, 0, 3, 1);
  grid->addWidget(rate_, 0, 1);
  grid->addWidget(oxygen_, 0, 2);
  int row = 1;
  for (QLabel* const label : {pressure_, loss_, blood_, balance_, tools_, gas_})
    grid->addWidget(label, row++, 1, 1, 2);
  grid->setColumnStretch(0, 1);
  rate_->setText("HR –");
  pressure_->setText("ART –");
  oxygen_->setText("SpO₂ –");
  loss_->setText("LOSS –");
  balance_->setText("FLUID –");
  gas_->setText("CO₂ –");
  blood_->setText("Hct –");
  blood_->setToolTip(
      "haematocrit; what infusion and transfusion have given; what a vasopressor adds to resistance");
  tools_->setToolTip("suckers that clots close, and what swabs hold");
  gas_->setToolTip("insufflator: pressure in the cavity/set pressure, flow, gas used");
  balance_->setToolTip("irrigation and blood: what came into the cavity, was sucked out, and is left in it");
  rate_->setToolTip("heart rate");
  oxygen_->setToolTip("oxygen saturation by pulse oximetry; ? where it finds no pulse");
  ecg_->setToolTip("electrocardiogram, lead II");
  pleth_->setToolTip("plethysmogram: how far the pulse widens the reference artery");
  pressure_->setToolTip("arterial pressure: systolic/diastolic (mean)");
  loss_->setToolTip("blood lost since the scene was loaded, and what vessels and surfaces lose now");
  auto* const timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { showAge(); });
  timer->start(500);
}

void PatientMonitorPanel::connectTopics() {
  blood_sub_ = nh().subscribe<vest_msgs::HaemodynamicsState>(
      "effects/haemodynamics", 20,
      [this](const vest_msgs::HaemodynamicsStateConstPtr& msg) { onBlood(*msg); });
  fluid_sub_ = nh().subscribe<vest_msgs::FluidState>(
      "effects/fluid", 2, [this](const vest_msgs::FluidStateConstPtr& msg) { onFluid(*msg); });
  gas_sub_ = nh().subscribe<vest_msgs::GasState>(
      "effects/gas", 2, [this](const vest_msgs::GasStateConstPtr& msg) { onGas(*msg); });
}

void PatientMonitorPanel::onBlood(const vest_msgs::HaemodynamicsState& msg) {
  heard_ = ros::SteadyTime::now();
  const double time = msg.header.stamp.toSec();
  ecg_->add({time, 1e3 * static_cast<double>(msg.ecg)});
  curve_->add({time, msg.pressure / kPascalPerMmHg});
  pleth_->add({time, 100.0 * static_cast<double>(msg.pleth)});
  oxygen_->setText(QString("SpO₂ <span style='font-size:22pt'>%1</span> %")
                       .arg(std::isfinite(msg.spo2) ? QString::number(100 * msg.spo2, 'f', 0) : "?"));
  rate_->setText(
      msg.arrested
          ? QString("<span style='font-size:22pt; color:red'>ARREST</span>")
          : QString("HR <span style='font-size:22pt'>%1</span> /min").arg(60.0 * msg.heart_rate, 0, 'f', 0));
  pressure_->setText(QString("ART <span style='font-size:22pt'>%1/%2</span> (%3) mmHg")
                         .arg(msg.systolic / kPascalPerMmHg, 0, 'f', 0)
                         .arg(msg.diastolic / kPascalPerMmHg, 0, 'f', 0)
                         .arg(msg.mean_pressure / kPascalPerMmHg, 0, 'f', 0));
  loss_->setText(QString("LOSS <span style='font-size:22pt'>%1</span> ml, now %2 ml/min")
                     .arg(1e6 * msg.blood_loss, 0, 'f', 1)
                     .arg(6e7 * msg.loss_rate, 0, 'f', 0));
  blood_->setText(QString("Hct <span style='font-size:22pt'>%1</span> %, infused %2 ml, transfused %3 ml%4")
                      .arg(100 * msg.haematocrit, 0, 'f', 0)
                      .arg(1e6 * (msg.given - msg.transfused), 0, 'f', 0)
                      .arg(1e6 * msg.transfused, 0, 'f', 0)
                      .arg(msg.vasopressor > kToldPressor
                               ? QString(", pressor +%1 %").arg(100 * msg.vasopressor, 0, 'f', 0)
                               : QString()));
}

void PatientMonitorPanel::onFluid(const vest_msgs::FluidState& msg) {
  balance_->setText(QString("FLUID in %1 ml, sucked %2 ml, left %3 ml")
                        .arg(1e6 * msg.emitted, 0, 'f', 0)
                        .arg(1e6 * msg.sucked, 0, 'f', 0)
                        .arg(1e6 * (msg.emitted - msg.sucked - msg.soaked - msg.lost), 0, 'f', 0));
  QStringList told;
  for (std::size_t i = 0; i < msg.clogged.size(); ++i) {
    const std::string_view name = tools::instrumentName(static_cast<tools::Instrument>(i));
    const QString who = QString::fromUtf8(name.data(), static_cast<int>(name.size()));
    if (msg.clogged[i] > kToldClog)
      told << QString("%1 sucker clogged %2 %: irrigate").arg(who).arg(100 * msg.clogged[i], 0, 'f', 0);
    if (msg.swab_volume[i] > 0 && msg.swab_capacity > 0)
      told << QString("%1 swab %2 ml%3")
                  .arg(who)
                  .arg(1e6f * msg.swab_volume[i], 0, 'f', 1)
                  .arg(msg.swab_volume[i] > kToldFull * msg.swab_capacity ? ", soaked through" : "");
  }
  tools_->setText(told.join("; "));
}

void PatientMonitorPanel::onGas(const vest_msgs::GasState& msg) {
  gas_->setText(QString("CO₂ <span style='font-size:22pt'>%1</span>/%2 mmHg, %3 l/min, used %4 l")
                    .arg(msg.pressure / kPascalPerMmHg, 0, 'f', 0)
                    .arg(msg.set_pressure / kPascalPerMmHg, 0, 'f', 0)
                    .arg(6e4 * static_cast<double>(msg.flow), 0, 'f', 1)
                    .arg(1e3 * msg.supplied, 0, 'f', 1));
}

void PatientMonitorPanel::showAge() {
  if (!heard_.isZero() && (ros::SteadyTime::now() - heard_).toSec() > kMonitorSilent)
    rate_->setText("HR – (no data)");
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::PatientMonitorPanel, rviz::Panel)
