#include "instruments_panel.h"

#include <QAbstractItemView>
#include <QComboBox>
#include <QGridLayout>
#include <QLabel>

#include <vest_msgs/ExchangeTool.h>
#include <vest_msgs/SelectSource.h>
#include <vest_msgs/StringStamped.h>
#include <pluginlib/class_list_macros.hpp>

#include "vest_instruments/tools/tool_kind.h"

namespace vest::panels {
namespace {

using vest_msgs::InstrumentState;

QString nameOf(std::size_t i) {
  const std::string_view name = tools::instrumentName(static_cast<tools::Instrument>(i));
  return QString::fromUtf8(name.data(), static_cast<int>(name.size()));
}
QString words(std::string_view name) {
  return QString::fromUtf8(name.data(), static_cast<int>(name.size())).replace('_', ' ');
}

QString functionsOf(std::uint32_t mask) {
  QStringList on;
  if (mask & InstrumentState::FUNCTION_CUT) on << "cut";
  if (mask & InstrumentState::FUNCTION_COAGULATE) on << "coagulate";
  if (mask & InstrumentState::FUNCTION_IRRIGATE) on << "irrigate";
  if (mask & InstrumentState::FUNCTION_SUCK) on << "suck";
  if (mask & InstrumentState::FUNCTION_FIRE) on << "fire";
  if (mask & InstrumentState::FUNCTION_CLUTCH) on << "clutch";
  if (mask & InstrumentState::FUNCTION_SUSPEND) on << "suspend";
  return on.join(", ");
}

}  // namespace

InstrumentsPanel::InstrumentsPanel(QWidget* parent) : BasePanel(parent) {
  auto* const grid = new QGridLayout(this);
  const char* const titles[] = {"", "tool", "moved by", "CRTK", "command", "active"};
  for (int i = 0; i < 6; ++i) grid->addWidget(new QLabel(QString("<small>%1</small>").arg(titles[i])), 0, i);
  for (std::size_t i = 0; i < kCount; ++i) addRow(grid, i);
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  grid->addWidget(problem_, 5, 0, 1, 6);
  grid->setRowStretch(6, 1);
}

void InstrumentsPanel::addRow(QGridLayout* grid, std::size_t i) {
  Row& row = rows_[i];
  const int line = static_cast<int>(i) + 1;
  row.tool = new QComboBox;
  if (nameOf(i) == "endoscope") {
    row.tool->addItem("endoscope", static_cast<int>(tools::ToolKind::Endoscope));
    row.tool->setEnabled(false);
  } else {
    for (int kind = 0; kind < tools::kToolKindCount; ++kind)
      if (static_cast<tools::ToolKind>(kind) != tools::ToolKind::Endoscope)
        row.tool->addItem(words(tools::toolName(static_cast<tools::ToolKind>(kind))), kind);
  }
  row.source = new QComboBox;
  const char* const sources[] = {"nobody", "box",    "haptic",
                                 "crtk",   "teleop", "replay"};  // InstrumentState.SOURCE_*
  for (const char* const source : sources) row.source->addItem(source);
  row.operating = new QLabel("–");
  row.command = new QComboBox;
  row.command->addItems({"command …", "enable", "disable", "pause", "resume", "home"});
  row.active = new QLabel;
  row.tool->setToolTip("exchanges the tool; refused while it holds tissue");
  row.source->setToolTip(
      "who moves the instrument: the box's sensors, a haptic device, a CRTK client, keyboard and mouse, "
      "or a recording");
  row.operating->setToolTip("CRTK operating state");
  row.command->setToolTip("CRTK command to this arm");
  row.active->setToolTip(
      "what the pedals make it do, whether it touches another instrument, whether its source is silent");
  grid->addWidget(new QLabel(QString("<b>%1</b>").arg(nameOf(i))), line, 0);
  grid->addWidget(row.tool, line, 1);
  grid->addWidget(row.source, line, 2);
  grid->addWidget(row.operating, line, 3);
  grid->addWidget(row.command, line, 4);
  grid->addWidget(row.active, line, 5);
  // `activated` is the user's choice alone; messages change the boxes without it.
  connect(row.tool, QOverload<int>::of(&QComboBox::activated), this,
          [this, i](int index) { exchange(i, rows_[i].tool->itemData(index).toInt()); });
  connect(row.source, QOverload<int>::of(&QComboBox::activated), this,
          [this, i](int index) { select(i, index); });
  connect(row.command, QOverload<int>::of(&QComboBox::activated), this, [this, i](int index) {
    if (index > 0) {
      vest_msgs::StringStamped command;
      command.header.stamp = ros::Time::now();
      command.string = rows_[i].command->currentText().toStdString();
      rows_[i].command_pub.publish(command);
    }
    rows_[i].command->setCurrentIndex(0);
  });
}

void InstrumentsPanel::connectTopics() {
  // At 1 kHz in the trainer: the newest is enough for people.
  states_sub_ = nh().subscribe<vest_msgs::InstrumentStates>(
      "instruments", 1, [this](const vest_msgs::InstrumentStatesConstPtr& msg) { onStates(*msg); });
  for (std::size_t i = 0; i < kCount; ++i) {
    const std::string name = nameOf(i).toStdString();
    rows_[i].operating_sub = nh().subscribe<vest_msgs::OperatingState>(
        name + "/operating_state", 2, [this, i](const vest_msgs::OperatingStateConstPtr& msg) {
          rows_[i].operating->setText(QString::fromStdString(msg->state) +
                                      (msg->is_homed ? "" : ", not homed") + (msg->is_busy ? ", busy" : ""));
        });
    rows_[i].command_pub = nh().advertise<vest_msgs::StringStamped>(name + "/state_command", 2);
  }
}

void InstrumentsPanel::onStates(const vest_msgs::InstrumentStates& msg) {
  for (const InstrumentState& state : msg.instruments) {
    for (std::size_t i = 0; i < kCount; ++i) {
      if (nameOf(i).toStdString() != state.name) continue;
      Row& row = rows_[i];
      if (!row.tool->view()->isVisible())
        row.tool->setCurrentIndex(row.tool->findData(static_cast<int>(state.tool)));
      if (!row.source->view()->isVisible()) row.source->setCurrentIndex(state.source);
      QString active = functionsOf(state.functions);
      if (state.colliding) active += active.isEmpty() ? "collides" : ", collides";
      if (!state.valid) active = "silent: the last pose is held";
      if (row.active->text() != active) row.active->setText(active);
    }
  }
}

void InstrumentsPanel::exchange(std::size_t i, int tool) {
  vest_msgs::ExchangeTool exchange;
  exchange.request.instrument = nameOf(i).toStdString();
  exchange.request.tool = static_cast<std::uint8_t>(tool);
  call<vest_msgs::ExchangeTool>(
      "exchange_tool", exchange, [this](const auto& answer, const std::string& problem) {
        tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
      });
}

void InstrumentsPanel::select(std::size_t i, int source) {
  vest_msgs::SelectSource select;
  select.request.instrument = nameOf(i).toStdString();
  select.request.source = static_cast<std::uint8_t>(source);
  call<vest_msgs::SelectSource>(
      "select_source", select, [this](const auto& answer, const std::string& problem) {
        tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
      });
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::InstrumentsPanel, rviz::Panel)
