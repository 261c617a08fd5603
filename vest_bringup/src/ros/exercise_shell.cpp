#include "vest_bringup/ros/exercise_shell.h"

#include <ros/console.h>
#include <vest_msgs/SessionScore.h>
#include <vest_msgs/StringStamped.h>
#include <visualization_msgs/MarkerArray.h>

#include "vest_bringup/exercise/outline.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/ros/frames.h"
#include "vest_tissue/ros/parameters.h"

namespace vest::ros_shell {
namespace {

void toMsg(const exercise::Exercise& e, const exercise::Result& r, const exercise::Standing& now,
           vest_msgs::SessionScore& msg) {
  msg.exercise = e.name, msg.title = e.title;
  msg.phase = now.phase, msg.hint = now.hint;
  msg.phase_number = static_cast<std::uint32_t>(now.number);
  msg.phases = static_cast<std::uint32_t>(e.phases.size());
  msg.elapsed = r.time, msg.limit = e.limit;
  for (std::size_t i = 0; i < now.force.size(); ++i) msg.force[i] = now.force[i];
  if (r.finished)
    for (const std::string& name : r.failed_by) msg.failed_by.push_back(exercise::textOf(e, name));
  msg.flags = exercise::flagWords(r.flags);
  msg.total = r.total;
  msg.finished = r.finished, msg.passed = r.passed;
  for (std::size_t i = 0; i < r.items.size(); ++i) {
    const exercise::MetricInfo& info = exercise::infoOf(e.items[i].number.metric);
    vest_msgs::ScoreItem item;
    item.name = e.items[i].name;
    item.value = r.items[i].value;
    item.unit = exercise::unitOf(info);
    item.points = r.items[i].points;
    item.weight = e.items[i].weight;
    item.explanation = std::string(info.meaning);
    msg.items.push_back(item);
  }
}

/// Lines where the exercise wants something; `ns` is the object that they move with.
void toMsg(const std::vector<exercise::Outline>& outlines, const ros::Time& now,
           visualization_msgs::MarkerArray& msg) {
  for (const exercise::Outline& outline : outlines) {
    visualization_msgs::Marker m;
    m.header.frame_id = frameId("world"), m.header.stamp = now;
    m.ns = outline.object, m.text = outline.mark;
    m.id = static_cast<std::int32_t>(msg.markers.size());
    m.type = visualization_msgs::Marker::LINE_STRIP, m.action = visualization_msgs::Marker::ADD;
    m.pose.orientation.w = 1, m.scale.x = 0.0005, m.color.a = 1;
    for (std::size_t i = 0; i <= outline.line.size(); ++i) {
      const Eigen::Vector3d& p = outline.line[i % outline.line.size()];
      geometry_msgs::Point point;
      point.x = p.x(), point.y = p.y(), point.z = p.z();
      m.points.push_back(point);
    }
    msg.markers.push_back(m);
  }
}

}  // namespace

ExerciseShell::ExerciseShell(ros::NodeHandle nh, const ros::NodeHandle& private_nh) {
  const std::string name = stringParameter(private_nh, "exercise", "");
  file_pub_ = nh.advertise<vest_msgs::StringStamped>("session/exercise_file", 1, true);
  score_pub_ = nh.advertise<vest_msgs::SessionScore>("session/score", 10);
  instruction_pub_ = nh.advertise<vest_msgs::StringStamped>("session/instruction", 1, true);
  targets_pub_ = nh.advertise<visualization_msgs::MarkerArray>("session/targets", 1, true);
  result_pub_ = nh.advertise<vest_msgs::StringStamped>("session/result", 1, true);
  if (name.empty())
    choose(Chosen());  // a recording that gets one later shall know that it had none
  else
    choose(name);
}

ExerciseShell::Chosen ExerciseShell::choose(const std::string& name) {
  const auto exercise =
      std::make_shared<const exercise::Exercise>(exercise::loadExercise(exerciseFile(name)));
  choose(exercise);
  return exercise;
}

void ExerciseShell::choose(const Chosen& exercise) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    exercise_ = exercise;
  }
  // A recording has it before the scene that it belongs to.
  publishText(file_pub_, exercise ? files::read(exercise->file, 1U << 20U) : "", ros::Time::now());
}

ExerciseShell::Chosen ExerciseShell::chosen() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return exercise_;
}
std::uint64_t ExerciseShell::attempt() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return attempt_;
}
ExerciseShell::Told ExerciseShell::told() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return told_;
}

void ExerciseShell::attach(simulation::Stage& stage) {
  const Chosen exercise = chosen();
  std::shared_ptr<exercise::Progress> progress;
  if (exercise && stage.trainer->world().description().name == exercise->scene)
    progress = exercise::addExercise(*exercise, stage).progress();
  else if (exercise)
    ROS_WARN("exercise %s needs scene %s: nothing is scored in this one", exercise->name.c_str(),
             exercise->scene.c_str());
  visualization_msgs::MarkerArray targets;
  if (progress) toMsg(exercise::outlinesOf(*exercise, stage.trainer->world()), ros::Time::now(), targets);
  targets_pub_.publish(targets);
  const std::lock_guard<std::mutex> lock(mutex_);
  progress_ = std::move(progress);
  ++attempt_;
}

void ExerciseShell::publishText(const ros::Publisher& publisher, const std::string& text,
                                const ros::Time& now) const {
  vest_msgs::StringStamped msg;
  msg.header.stamp = now;
  msg.string = text;
  publisher.publish(msg);
}

void ExerciseShell::publish(const ros::Time& now) {
  std::shared_ptr<exercise::Progress> progress;
  std::uint64_t attempt = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    progress = progress_, attempt = attempt_;
  }
  if (!progress) {  // the scene that is shown now has no exercise
    if (!instruction_.empty()) publishText(instruction_pub_, instruction_ = "", now);
    return;
  }
  if (!progress->update()) return;
  Told told;
  told.attempt = attempt;
  told.result = progress->result();
  const exercise::Standing standing = progress->standing();
  told.instruction = standing.instruction;
  told.score.header.stamp = now;
  toMsg(progress->exercise(), told.result, standing, told.score);
  score_pub_.publish(told.score);
  if (told.instruction != instruction_) publishText(instruction_pub_, instruction_ = told.instruction, now);
  const bool finished = told.result.finished;
  if (finished && !finished_told_) {
    publishText(result_pub_, toJson(progress->exercise(), told.result), now);
    ROS_INFO("exercise %s: %s, total %.1f of 100", told.result.exercise.c_str(),
             told.result.passed ? "passed" : "not passed", told.result.total);
  }
  finished_told_ = finished;
  const std::lock_guard<std::mutex> lock(mutex_);
  told_ = std::move(told);
}

}  // namespace vest::ros_shell
