#include "vest_bringup/ros/exercise_action.h"

#include <ros/service.h>
#include <vest_msgs/ExchangeOptic.h>
#include <vest_msgs/ExchangeTool.h>
#include <vest_msgs/LoadScene.h>

#include "vest_bringup/exercise/learning_curve.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_instruments/ros/service_call.h"
#include "vest_instruments/tools/tool_names.h"

namespace vest::ros_shell {
namespace {

constexpr double kTell = 0.05;    // s between two words about how it goes
constexpr double kPatience = 10;  // s for a service that is still coming
constexpr double kSettled =
    2;  // s: before, the last second that session/state tells of has the loading in it
constexpr double kPace = 0.05;  // part by which simulated time may be off real time (docs/exercises.md)

/// @throws std::runtime_error with the words of who refused
template <class Service>
void call(const ros::NodeHandle& nh, const std::string& name, Service& service) {
  const std::string full = nh.resolveName(name);
  if (!ros::service::waitForService(full, ros::Duration(kPatience)) || !callService(full, service))
    throw std::runtime_error(full + ": nobody answers");
  if (!service.response.success) throw std::runtime_error(full + ": " + service.response.message);
}

}  // namespace

ExerciseAction::ExerciseAction(const ros::NodeHandle& nh, ExerciseShell& shell)
    : nh_(nh),
      shell_(shell),
      state_sub_(nh_.subscribe<vest_msgs::SessionState>(
          "session/state", 5, [this](const vest_msgs::SessionStateConstPtr& msg) { onState(*msg); })),
      server_(
          nh_, "session/exercise", [this](const vest_msgs::ExerciseGoalConstPtr& goal) { execute(goal); },
          false) {
  server_.start();
}

ExerciseAction::~ExerciseAction() {
  stop_ = true;
}

void ExerciseAction::onState(const vest_msgs::SessionState& state) {
  const std::lock_guard<std::mutex> lock(mutex_);
  directory_ = state.directory;
  if (state.state == vest_msgs::SessionState::PAUSED ||
      (state.real_time_factor > 0 && std::abs(state.real_time_factor - 1) > kPace))
    off_pace_ = true;
}

void ExerciseAction::giveTools(const exercise::Exercise& e) {
  for (std::size_t hand = 0; hand < e.tools.size(); ++hand) {
    if (e.tools[hand].empty()) continue;
    vest_msgs::ExchangeTool exchange;
    exchange.request.instrument = tools::instrumentName(static_cast<tools::Instrument>(hand));
    exchange.request.tool = static_cast<std::uint8_t>(e.tools[hand].front());
    call(nh_, "exchange_tool", exchange);
  }
  vest_msgs::ExchangeOptic optic;
  optic.request.angle = e.optic * exercise::kDegree;
  call(nh_, "exchange_optic", optic);
}

void ExerciseAction::keep(const exercise::Exercise& e, const std::string& trainee, std::string& words) const {
  if (trainee.empty()) return;
  bool kept = false;
  try {
    exercise::Result result = shell_.told().result;
    if (off_pace_) result.flags |= exercise::kPractice;
    const std::string file = exercise::Trainees::defaultFile();
    exercise::Trainees trainees(file);
    trainees.keep(ros_shell::attemptOf(e, result, trainee, exercise::dateNow(), VEST_VERSION, directory_));
    kept = true;
    words = toText(
        exercise::learningOf(trainees.attempts(trainee, e.name), exercise::storedReference(file, e.name)));
  } catch (const std::exception& why) {
    words = std::string(kept ? "the result is kept, but not compared: " : "the result is not kept: ") +
            why.what();
    ROS_ERROR("%s", words.c_str());
  }
}

void ExerciseAction::end(const std::string& problem) {
  vest_msgs::ExerciseResult result;
  result.score = shell_.told().score;
  if (off_pace_) result.score.flags.push_back("practice");
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    result.directory = directory_;
  }
  server_.setAborted(result, problem);
}

bool ExerciseAction::follow(const vest_msgs::ExerciseGoal& goal, std::uint64_t attempt) {
  for (double seconds = 0; ros::ok() && !stop_; seconds += kTell) {
    ros::WallDuration(kTell).sleep();
    if (seconds < kSettled) off_pace_ = false;
    if (server_.isPreemptRequested()) {
      server_.setPreempted();
      return false;
    }
    if (shell_.attempt() != attempt) {
      end("another scene was loaded");
      return false;
    }
    const ExerciseShell::Told told = shell_.told();
    if (told.attempt != attempt) continue;  // its first word is still to come
    vest_msgs::ExerciseFeedback feedback;
    feedback.score = told.score, feedback.hint = told.instruction;
    server_.publishFeedback(feedback);
    if (told.score.finished) return true;
    if (goal.time_limit > 0 && told.score.elapsed >= goal.time_limit) {
      end("not finished within the time limit of the goal");
      return false;
    }
  }
  return false;
}

void ExerciseAction::execute(const vest_msgs::ExerciseGoalConstPtr& goal) {
  const ExerciseShell::Chosen before = shell_.chosen();
  ExerciseShell::Chosen chosen;
  try {
    if (!(goal->time_limit >= 0)) throw std::invalid_argument("time_limit: must be 0 or more seconds");
    if (!goal->trainee.empty())  // who is not known is told before, not after the work
      exercise::Trainees(exercise::Trainees::defaultFile()).attempts(goal->trainee);
    chosen = shell_.choose(goal->exercise);
    giveTools(*chosen);
    vest_msgs::LoadScene load;
    load.request.scene = chosen->scene;
    call(nh_, "tissue/load_scene", load);
  } catch (const std::exception& why) {
    if (chosen) shell_.choose(before);
    ROS_ERROR("session/exercise: %s", why.what());
    server_.setAborted({}, why.what());
    return;
  }
  if (!follow(*goal, shell_.attempt())) {
    if (server_.isActive()) server_.setAborted({}, "the session ends");
    return;
  }
  vest_msgs::ExerciseResult result;
  result.score = shell_.told().score;
  if (off_pace_) result.score.flags.push_back("practice");
  std::string words;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    result.directory = directory_;
    keep(*chosen, goal->trainee, words);
  }
  server_.setSucceeded(result, words);
}

}  // namespace vest::ros_shell
