#include "plots_panel.h"

#include <algorithm>
#include <cmath>

#include <QGridLayout>
#include <QHBoxLayout>
#include <QLabel>
#include <QPainter>
#include <QProgressBar>
#include <QTimer>

#include <pluginlib/class_list_macros.hpp>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::panels {
namespace {

constexpr double kForcesSilent = 0.5;  ///< s
const std::vector<QColor> kPlotColours{QColor(90, 190, 255), QColor(255, 170, 60), QColor(150, 230, 120)};
const QColor kBloodColour(255, 80, 70);

QString plottedName(std::size_t i) {
  const std::string_view name = tools::instrumentName(static_cast<tools::Instrument>(i));
  return QString::fromUtf8(name.data(), static_cast<int>(name.size()));
}
/// Index of an instrument that is plotted; kInstruments if it is none.
std::size_t plottedIndex(const std::string& instrument) {
  std::size_t i = 0;
  while (i < PlotsPanel::kInstruments && plottedName(i).toStdString() != instrument) ++i;
  return i;
}
template <class V>
double magnitude(const V& v) {
  return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
}

}  // namespace

TimePlot::TimePlot(const QString& title, std::vector<QColor> colours, double least, QWidget* parent)
    : QWidget(parent), title_(title), colours_(std::move(colours)), least_(least), lines_(colours_.size()) {
  setMinimumSize(120, 54);
}

void TimePlot::add(double time, std::size_t line, double value) {
  if (!std::isfinite(time) || !std::isfinite(value)) return;
  std::deque<Point>& points = lines_[line];
  if (time < newest_ - 1) {
    for (auto& all : lines_) all.clear();
    newest_ = time;
  }
  newest_ = std::max(newest_, time);
  if (!points.empty() && time - points.back().time < kInterval) {
    points.back().value = std::max(points.back().value, value);
    return;
  }
  points.push_back({time, value});
  while (newest_ - points.front().time > kSpan && points.size() > 1) points.pop_front();
  update();
}

double TimePlot::top() const {
  double most = least_;
  for (const auto& points : lines_)
    for (const Point& p : points) most = std::max(most, p.value);
  const double decade = std::pow(10.0, std::floor(std::log10(most)));
  for (const double step : {1.0, 2.0, 5.0})
    if (most <= step * decade * (1 + 1e-9)) return step * decade;
  return 10 * decade;
}

void TimePlot::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  painter.fillRect(rect(), QColor(18, 20, 22));
  const double top = this->top();
  const int text = painter.fontMetrics().height();
  const auto y = [&](double value) { return height() - 2 - value / top * (height() - text - 4); };
  for (const double value : {0.0, 0.5 * top, top}) {
    painter.setPen(QColor(52, 58, 62));
    painter.drawLine(QPointF(0, y(value)), QPointF(width(), y(value)));
    painter.setPen(QColor(150, 158, 162));
    if (value > 0) painter.drawText(QPointF(3, y(value) + text - 3), QString::number(value));
  }
  painter.setPen(QColor(220, 225, 228));
  painter.drawText(QRectF(0, 0, width() - 4, text), Qt::AlignRight, title_);
  painter.setRenderHint(QPainter::Antialiasing);
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    QPolygonF line;
    for (const Point& p : lines_[i])
      line << QPointF(width() * (1 - (newest_ - p.time) / kSpan), y(std::max(0.0, p.value)));
    painter.setPen(QPen(colours_[i], 1.5));
    painter.drawPolyline(line);
  }
}

PlotsPanel::PlotsPanel(QWidget* parent) : BasePanel(parent) {
  auto* const grid = new QGridLayout(this);
  grid->setContentsMargins(4, 4, 4, 4);
  grid->setSpacing(3);
  for (std::size_t i = 0; i < kInstruments; ++i) {
    Force& force = forces_[i];
    auto* const name = new QLabel(plottedName(i));
    name->setStyleSheet(QString("color: %1; font-weight: bold").arg(kPlotColours[i].darker(150).name()));
    force.number = new QLabel("– N");
    force.number->setMinimumWidth(force.number->fontMetrics().horizontalAdvance("88.88 N "));
    force.bar = new QProgressBar;
    force.bar->setRange(0, static_cast<int>(100 * kBarFull));
    force.bar->setTextVisible(false);
    force.bar->setMinimumWidth(40);
    force.bar->setMaximumHeight(force.bar->fontMetrics().height());
    force.bar->setToolTip(QString("force of the tissue on the instrument; full at %1 N").arg(kBarFull));
    auto* const line = new QHBoxLayout;
    line->addWidget(name);
    line->addWidget(force.number);
    line->addWidget(force.bar, 1);
    grid->addLayout(line, 0, static_cast<int>(i));
  }
  force_ = new TimePlot("force, N", kPlotColours, 0.5);
  speed_ = new TimePlot("speed of tips, mm/s", kPlotColours, 20);
  blood_ = new TimePlot("blood lost, ml", {kBloodColour}, 5);
  int column = 0;
  for (TimePlot* const plot : {force_, speed_, blood_}) {
    plot->setToolTip(QString("last %1 s").arg(TimePlot::kSpan));
    grid->addWidget(plot, 1, column);
    grid->setColumnStretch(column++, 1);
  }
  grid->setRowStretch(1, 1);
  auto* const timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { showNumbers(); });
  timer->start(100);
}

void PlotsPanel::connectTopics() {
  contacts_sub_ = nh().subscribe<vest_msgs::ContactModels>(
      "tissue/contacts", 50, [this](const vest_msgs::ContactModelsConstPtr& msg) { onContacts(*msg); });
  // The simulation's own part of the instruments: 60 a second are enough for a plot.
  instruments_sub_ = nh().subscribe<vest_msgs::InstrumentStates>(
      "tissue/instruments", 20,
      [this](const vest_msgs::InstrumentStatesConstPtr& msg) { onInstruments(*msg); });
  blood_sub_ = nh().subscribe<vest_msgs::HaemodynamicsState>(
      "effects/haemodynamics", 20,
      [this](const vest_msgs::HaemodynamicsStateConstPtr& msg) { onBlood(*msg); });
}

void PlotsPanel::onContacts(const vest_msgs::ContactModels& msg) {
  for (const vest_msgs::ContactModel& contact : msg.contacts) {
    const std::size_t i = plottedIndex(contact.instrument);
    const double newton = magnitude(contact.wrench.force);
    if (i == kInstruments || !std::isfinite(newton)) continue;
    force_->add(msg.header.stamp.toSec(), i, newton);
    forces_[i].largest = std::max(forces_[i].largest, newton);
    forces_[i].heard = ros::SteadyTime::now();
  }
}

void PlotsPanel::onInstruments(const vest_msgs::InstrumentStates& msg) {
  for (const vest_msgs::InstrumentState& state : msg.instruments) {
    const std::size_t i = plottedIndex(state.name);
    if (i < kInstruments && state.valid)
      speed_->add(msg.header.stamp.toSec(), i, 1e3 * magnitude(state.twist.linear));
  }
}

void PlotsPanel::onBlood(const vest_msgs::HaemodynamicsState& msg) {
  blood_->add(msg.header.stamp.toSec(), 0, 1e6 * msg.blood_loss);
}

void PlotsPanel::showNumbers() {
  for (Force& force : forces_) {
    const bool silent =
        force.heard.isZero() || (ros::SteadyTime::now() - force.heard).toSec() > kForcesSilent;
    if (silent) force.largest = 0;
    force.number->setText(silent ? "– N" : QString("%1 N").arg(force.largest, 0, 'f', 2));
    force.bar->setValue(static_cast<int>(100 * std::min(force.largest, kBarFull)));
    if (!silent && (ros::SteadyTime::now() - force.heard).toSec() < 0.1) force.largest = 0;
  }
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::PlotsPanel, rviz::Panel)
