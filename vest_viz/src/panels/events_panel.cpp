#include "events_panel.h"

#include <cmath>

#include <QHeaderView>
#include <QPushButton>
#include <QScrollBar>
#include <QTableWidget>
#include <QVBoxLayout>

#include <pluginlib/class_list_macros.hpp>

#include "vest_tissue/scene/event_words.h"

namespace vest::panels {
namespace {

constexpr double kSimulationStep = 0.001;  ///< s, of the simulation
enum EventColumn { kEventTime, kEventWhat, kEventObject, kEventBy, kEventHow, kEventColumns };

/// What is known of it beside its kind.
QString eventDetails(const vest_msgs::TissueEvent& msg) {
  QStringList words;
  if (std::isfinite(msg.force) && msg.force > 0) words << QString("%1 N").arg(msg.force, 0, 'f', 2);
  if (std::isfinite(msg.energy) && msg.energy > 0) words << QString("%1 J").arg(msg.energy, 0, 'f', 1);
  if (std::isfinite(msg.area) && msg.area > 0) words << QString("%1 mm²").arg(1e6 * msg.area, 0, 'f', 1);
  if (!msg.vessel_segment.empty()) words << QString::fromStdString(msg.vessel_segment);
  if (!msg.text.empty()) words << QString::fromStdString(msg.text);
  return words.join(", ");
}

}  // namespace

QString eventWord(std::uint8_t kind) {
  if (kind == vest_msgs::TissueEvent::FAULT) return "FAULT";
  if (kind >= scene::kEventWords.size()) return QString("kind %1").arg(kind);
  return QString::fromStdString(std::string(scene::kEventWords[kind]));
}

EventsPanel::EventsPanel(QWidget* parent) : BasePanel(parent) {
  auto* const rows = new QVBoxLayout(this);
  rows->setContentsMargins(4, 4, 4, 4);
  table_ = new QTableWidget(0, kEventColumns);
  table_->setHorizontalHeaderLabels({"s", "what", "object", "by", "how"});
  table_->horizontalHeaderItem(kEventTime)->setToolTip("simulated time");
  table_->horizontalHeaderItem(kEventHow)->setToolTip(
      "load at that moment, energy brought in, opened or closed cross-section, vessel");
  table_->verticalHeader()->hide();
  table_->verticalHeader()->setDefaultSectionSize(table_->fontMetrics().height() + 4);
  // Widths that follow the contents would be measured anew with each of many events.
  const auto width = [this](const char* widest) {
    return table_->fontMetrics().horizontalAdvance(widest) + 12;
  };
  table_->setColumnWidth(kEventTime, width("1000.00"));
  table_->setColumnWidth(kEventWhat, width("coagulated"));
  table_->setColumnWidth(kEventObject, width("uterine_artery_left"));
  table_->setColumnWidth(kEventBy, width("endoscope"));
  table_->horizontalHeader()->setStretchLastSection(true);
  table_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  table_->setSelectionBehavior(QAbstractItemView::SelectRows);
  table_->setMinimumHeight(60);
  auto* const clear = new QPushButton("Clear");
  clear->setToolTip("empties the list; nothing of the recording changes");
  rows->addWidget(table_);
  rows->addWidget(clear);
  connect(clear, &QPushButton::clicked, this, [this] { table_->setRowCount(0); });
}

void EventsPanel::connectTopics() {
  sub_ = nh().subscribe<vest_msgs::TissueEvent>(
      "tissue/events", 1000, [this](const vest_msgs::TissueEventConstPtr& msg) { onEvent(*msg); });
}

void EventsPanel::onEvent(const vest_msgs::TissueEvent& msg) {
  if (msg.step < last_step_) table_->setRowCount(0);  // a reset, another scene, a bag that was wound back
  last_step_ = msg.step;
  // Who reads an older line is left there.
  const QScrollBar* const bar = table_->verticalScrollBar();
  const bool at_end = bar->value() == bar->maximum();
  while (table_->rowCount() >= kMost) table_->removeRow(0);
  const int row = table_->rowCount();
  table_->insertRow(row);
  const QString cells[] = {QString::number(kSimulationStep * static_cast<double>(msg.step), 'f', 2),
                           eventWord(msg.kind), QString::fromStdString(msg.object),
                           QString::fromStdString(msg.instrument), eventDetails(msg)};
  for (int column = 0; column < kEventColumns; ++column) {
    auto* const item = new QTableWidgetItem(cells[column]);
    item->setToolTip(cells[column]);
    if (msg.kind == vest_msgs::TissueEvent::FAULT) item->setForeground(QColor(176, 0, 32));
    table_->setItem(row, column, item);
  }
  if (at_end) table_->scrollToBottom();
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::EventsPanel, rviz::Panel)
