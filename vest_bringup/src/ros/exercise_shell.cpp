#include "vest_bringup/ros/exercise_shell.h"

#include <ros/console.h>
#include <vest_msgs/SessionScore.h>
#include <vest_msgs/StringStamped.h>
#include <visualization_msgs/MarkerArray.h>

#include "vest_bringup/exercise/outline.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/ros/parameters.h"

namespace vest::ros_shell {
namespace {

void toMsg(const exercise::Exercise& e, const exercise::Result& r, vest_msgs::SessionScore& msg) {
  msg.exercise = e.name;
  msg.elapsed = r.time;
  msg.total = r.total;
  msg.finished = r.finished, msg.passed = r.passed;
  for (std::size_t i = 0; i < r.items.size(); ++i) {
    const exercise::MetricInfo& info = exercise::infoOf(e.items[i].number.metric);
    vest_msgs::ScoreItem item;
    item.name = e.items[i].name;
    item.value = r.items[i].value;
    const std::size_t unit = info.name.rfind('_');
    item.unit = unit == std::string_view::npos ? "" : std::string(info.name.substr(unit + 1));
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
    m.header.frame_id = "world", m.header.stamp = now;
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
  if (name.empty()) return;
  const std::string file = exerciseFile(name);
  exercise_ = std::make_unique<exercise::Exercise>(exercise::loadExercise(file));
  file_text_ = files::read(file, 1U << 20U);
  publishText(file_pub_, file_text_, ros::Time::now());
}

void ExerciseShell::attach(simulation::Stage& stage) {
  std::shared_ptr<exercise::Progress> progress;
  if (exercise_ && stage.trainer->world().description().name == exercise_->scene)
    progress = exercise::addExercise(*exercise_, stage).progress();
  else if (exercise_)
    ROS_WARN("exercise %s needs scene %s: nothing is scored in this one", exercise_->name.c_str(),
             exercise_->scene.c_str());
  visualization_msgs::MarkerArray targets;
  if (progress) toMsg(exercise::outlinesOf(*exercise_, stage.trainer->world()), ros::Time::now(), targets);
  targets_pub_.publish(targets);
  const std::lock_guard<std::mutex> lock(mutex_);
  progress_ = std::move(progress);
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
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    progress = progress_;
  }
  if (!progress || !progress->update()) return;
  const exercise::Result result = progress->result();
  vest_msgs::SessionScore score;
  score.header.stamp = now;
  toMsg(progress->exercise(), result, score);
  score_pub_.publish(score);
  const std::string instruction = progress->instruction();
  if (instruction != instruction_) publishText(instruction_pub_, instruction_ = instruction, now);
  if (!result.finished) told_ = false;
  if (!result.finished || told_) return;
  told_ = true;
  publishText(result_pub_, toJson(progress->exercise(), result), now);
  ROS_INFO("exercise %s: %s, total %.1f of 100", result.exercise.c_str(),
           result.passed ? "passed" : "not passed", result.total);
}

}  // namespace vest::ros_shell
