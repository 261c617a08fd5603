#include "exercise_panel.h"

#include <algorithm>
#include <cmath>

#include <QComboBox>
#include <QGridLayout>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QProgressBar>
#include <QPushButton>
#include <QTableWidget>

#include <actionlib_msgs/GoalID.h>
#include <vest_msgs/ExerciseActionGoal.h>
#include <vest_msgs/StringStamped.h>
#include <pluginlib/class_list_macros.hpp>

namespace vest::panels {
namespace {

enum ItemColumn { kItemName, kItemValue, kItemPoints, kItemColumns };

QString plain(const std::string& text) {
  return QString::fromStdString(text).toHtmlEscaped();
}

}  // namespace

ExercisePanel::ExercisePanel(QWidget* parent) : BasePanel(parent) {
  auto* const grid = new QGridLayout(this);
  grid->setContentsMargins(4, 4, 4, 4);
  grid->setVerticalSpacing(3);
  exercise_ = new QComboBox;
  exercise_->setEditable(true);
  exercise_->addItems(shipped("vest_bringup", "exercises"));
  exercise_->setToolTip("an exercise of vest_bringup, or the path of an exercise file");
  trainee_ = new QLineEdit;
  trainee_->setPlaceholderText("trainee (pseudonym)");
  trainee_->setToolTip(
      "keeps the result for this trainee; empty: it is not kept. vest_trainee add NAME makes one");
  start_ = new QPushButton("Start");
  start_->setToolTip("gives the hands their tools, loads the exercise's scene and begins");
  stop_ = new QPushButton("Give up");
  stop_->setToolTip("ends the exercise without a result; the simulation goes on");
  title_ = new QLabel("no exercise");
  instruction_ = new QLabel;
  instruction_->setWordWrap(true);
  result_ = new QLabel;
  result_->setWordWrap(true);
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  clock_ = new QProgressBar;
  clock_->setToolTip("time that is used, of the limit");
  items_ = new QTableWidget(0, kItemColumns);
  items_->setHorizontalHeaderLabels({"figure", "value", "points"});
  items_->verticalHeader()->hide();
  items_->verticalHeader()->setDefaultSectionSize(items_->fontMetrics().height() + 4);
  items_->horizontalHeader()->setSectionResizeMode(kItemName, QHeaderView::Stretch);
  items_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  items_->setMinimumHeight(60);
  grid->addWidget(exercise_, 0, 0);
  grid->addWidget(trainee_, 0, 1);
  grid->addWidget(start_, 0, 2);
  grid->addWidget(stop_, 0, 3);
  grid->addWidget(title_, 1, 0, 1, 2);
  grid->addWidget(clock_, 1, 2, 1, 2);
  grid->addWidget(instruction_, 2, 0, 1, 4);
  grid->addWidget(items_, 3, 0, 1, 4);
  grid->addWidget(result_, 4, 0, 1, 4);
  grid->addWidget(problem_, 5, 0, 1, 4);
  connect(start_, &QPushButton::clicked, this, [this] { start(); });
  connect(stop_, &QPushButton::clicked, this, [this] { cancel_pub_.publish(actionlib_msgs::GoalID()); });
}

void ExercisePanel::connectTopics() {
  score_sub_ = nh().subscribe<vest_msgs::SessionScore>(
      "session/score", 2, [this](const vest_msgs::SessionScoreConstPtr& msg) { onScore(*msg); });
  instruction_sub_ = nh().subscribe<vest_msgs::StringStamped>(
      "session/instruction", 1,
      [this](const vest_msgs::StringStampedConstPtr& msg) { instruction_->setText(plain(msg->string)); });
  result_sub_ = nh().subscribe<vest_msgs::ExerciseActionResult>(
      "session/exercise/result", 5,
      [this](const vest_msgs::ExerciseActionResultConstPtr& msg) { onResult(*msg); });
  goal_pub_ = nh().advertise<vest_msgs::ExerciseActionGoal>("session/exercise/goal", 1);
  cancel_pub_ = nh().advertise<actionlib_msgs::GoalID>("session/exercise/cancel", 1);
}

void ExercisePanel::start() {
  if (goal_pub_.getNumSubscribers() == 0)
    return tell(problem_, nh().resolveName("session/exercise") +
                              ": nobody offers this action; is the trainer running?");
  tell(problem_, "");
  vest_msgs::ExerciseActionGoal goal;
  goal.header.stamp = ros::Time::now();
  goal.goal.exercise = exercise_->currentText().toStdString();
  goal.goal.trainee = trainee_->text().toStdString();
  goal_pub_.publish(goal);
}

void ExercisePanel::onScore(const vest_msgs::SessionScore& m) {
  QString phase = plain(m.phase);
  phase.replace('_', ' ');
  title_->setText(
      QString("<b>%1</b>%2")
          .arg(plain(m.title), m.phase.empty()
                                   ? ""
                                   : QString(", %1 of %2: %3").arg(m.phase_number).arg(m.phases).arg(phase)));
  clock_->setRange(0, std::max(1, static_cast<int>(std::clamp(m.limit, 1.0, 1e6))));
  clock_->setValue(static_cast<int>(std::clamp(m.elapsed, 0.0, m.limit)));
  clock_->setFormat(QString("%1 s of %2 s").arg(m.elapsed, 0, 'f', 0).arg(m.limit, 0, 'f', 0));
  items_->setRowCount(static_cast<int>(m.items.size()));
  for (int i = 0; i < items_->rowCount(); ++i) {
    const vest_msgs::ScoreItem& item = m.items[static_cast<std::size_t>(i)];
    QString name = QString::fromStdString(item.name);
    const QString cells[] = {
        name.replace('_', ' '),
        std::isfinite(item.value)
            ? QString("%1 %2").arg(item.value, 0, 'g', 3).arg(QString::fromStdString(item.unit))
            : QString("at the end"),
        QString::number(item.points, 'f', 0)};
    for (int column = 0; column < kItemColumns; ++column) {
      auto* cell = items_->item(i, column);
      if (cell == nullptr) items_->setItem(i, column, cell = new QTableWidgetItem);
      cell->setText(cells[column]);
      cell->setToolTip(QString::fromStdString(item.explanation));
    }
  }
  QString words;
  if (m.finished) {
    words = QString("<b style='color: %1'>%2</b>, %3 of 100")
                .arg(m.passed ? "#00704f" : "#b33a00", m.passed ? "PASSED" : "NOT PASSED")
                .arg(m.total, 0, 'f', 0);
    for (const std::string& why : m.failed_by) words += "<br>" + plain(why);
  }
  for (std::size_t i = 0; i < m.flags.size(); ++i)
    words += (words.isEmpty() ? "" : "<br>") + plain(m.flags[i]);
  result_->setText(words);
}

void ExercisePanel::onResult(const vest_msgs::ExerciseActionResult& m) {
  tell(problem_, m.status.text);
  if (m.status.status == actionlib_msgs::GoalStatus::SUCCEEDED) onScore(m.result.score);
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::ExercisePanel, rviz::Panel)
