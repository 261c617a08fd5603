#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include <ros/package.h>

#include "vest_bringup/learning/exercise_environment.h"
#include "vest_bringup/vest.h"

// Protects exercises as environments: their script passes them by actions alone, rewards are the changes of
// what the engine scores, snapshots are exact, and the numbers are what their names say.

namespace vest::learning {
namespace {

TaskOptions optionsOf(const std::string& exercise, const std::string& scene) {
  TaskOptions o;
  o.task = ros::package::getPath("vest_bringup") + "/exercises/" + exercise + "/exercise.yaml";
  o.scene = ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
  o.box = ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml";
  o.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  return o;
}
std::shared_ptr<const Task> clipAndCut() {
  static const std::shared_ptr<const Task> task = makeTask(optionsOf("clip_cut_tube", "clip_tube"));
  return task;
}

struct Seat {
  explicit Seat(std::shared_ptr<const Task> of) : task(std::move(of)), env(makeEnvironment(task)) {
    action.resize(task->actionSize());
    seen.resize(task->observationSize());
  }
  /// As the script does, until the episode is over or so many actions were made.
  StepResult play(int most = 1000000) {
    StepResult r;
    for (int k = 0; k < most && !env->over(); ++k) {
      env->expert(action.data());
      r = env->step(action.data(), seen.data());
      rewards += r.reward;
    }
    return r;
  }
  float number(const std::string& name) const {
    const auto at = std::find(task->names.begin(), task->names.end(), name);
    if (at == task->names.end()) throw std::invalid_argument(name);
    return seen[static_cast<std::size_t>(at - task->names.begin())];
  }
  std::shared_ptr<const Task> task;
  std::unique_ptr<Environment> env;
  std::vector<float> action, seen;
  double rewards = 0;
};

TEST(ExerciseEnvironment, TheScriptPassesItByActionsAndRewardsAddUpToTheScore) {
  for (const std::uint64_t seed : {1u, 2u}) {
    Seat s(clipAndCut());
    s.env->reset(seed, s.seen.data());
    EXPECT_EQ(s.number("score (0 to 1)"), 0);
    const StepResult r = s.play();
    EXPECT_TRUE(r.passed && r.terminated && !r.truncated) << s.env->result();
    EXPECT_GT(r.score, 0.8);
    EXPECT_NEAR(s.rewards, r.score, 1e-12);
    EXPECT_EQ(s.number("phases done (0 to 1)"), 1);
    EXPECT_NE(s.env->result().find("\"passed\": true"), std::string::npos) << s.env->result();
    EXPECT_THROW(s.env->step(s.action.data(), s.seen.data()), std::logic_error);
  }
}

TEST(ExerciseEnvironment, DoingNothingScoresNothingAndTheLimitTruncates) {
  TaskOptions o = optionsOf("clip_cut_tube", "clip_tube");
  o.limit = 1;
  Seat s(makeTask(o));
  s.env->reset(3, s.seen.data());
  StepResult r;
  for (int k = 0; k < 50; ++k) {
    EXPECT_FALSE(s.env->over());
    r = s.env->step(s.action.data(), s.seen.data());
  }
  EXPECT_TRUE(r.truncated && !r.terminated && s.env->over());
  EXPECT_EQ(r.score, 0);
  EXPECT_EQ(s.number("time left (0 to 1)"), 0);
}

TEST(ExerciseEnvironment, WhatIsClippedWronglyFailsWithScoreZero) {
  // The scissors first: the vessel is divided before it is closed.
  Seat s(clipAndCut());
  s.env->reset(1, s.seen.data());
  StepResult r;
  bool first = true;
  while (!s.env->over()) {
    s.env->expert(s.action.data());
    s.action[7] = first ? 1.0f : -1.0f;
    first = false;
    r = s.env->step(s.action.data(), s.seen.data());
  }
  EXPECT_FALSE(r.passed);
  EXPECT_TRUE(r.terminated);
  EXPECT_EQ(r.score, 0);
  EXPECT_NE(s.env->result().find("clipped_before_cut"), std::string::npos) << s.env->result();
}

TEST(ExerciseEnvironment, StartsFollowFromTheSeed) {
  Seat a(clipAndCut()), b(clipAndCut());
  a.env->reset(5, a.seen.data()), b.env->reset(5, b.seen.data());
  EXPECT_EQ(a.seen, b.seen);
  b.env->reset(6, b.seen.data());
  const auto tip = [](const Seat& s) {
    return Eigen::Vector3f(s.number("right tip, x (cm)"), s.number("right tip, y (cm)"),
                           s.number("right tip, z (cm)"));
  };
  EXPECT_GT((tip(a) - tip(b)).norm(), 0.001f);
  EXPECT_LT((tip(a) - tip(b)).norm(), 0.6f);  // cm: 3 mm to either side
}

TEST(ExerciseEnvironment, NumbersAreWhatTheirNamesSay) {
  Seat s(clipAndCut());
  s.env->reset(1, s.seen.data());
  const auto& objects = s.task->model->description.objects;
  std::size_t vessel = 0;
  while (objects[vessel].name != "vessel") ++vessel;
  const auto find = [&](const std::string& begin) {
    return std::find_if(s.task->names.begin(), s.task->names.end(),
                        [&](const std::string& n) { return n.rfind(begin, 0) == 0; });
  };
  // A mark lies where its exercise says, and goes with the tissue; so does each knot.
  EXPECT_NEAR(s.number("mark near, x (cm)"), -0.26, 1e-4);
  EXPECT_NEAR(s.number("mark near, y (cm)"), 4.57, 1e-4);
  EXPECT_NEAR(s.number("mark near, z (cm)"), 5.5, 1e-4);
  const std::vector<float> before = s.seen;
  s.play(200);
  int moved = 0;
  for (auto name = find("vessel["); name != s.task->names.end() && name->rfind("vessel[", 0) == 0;
       name += 3) {
    const auto knot = static_cast<std::size_t>(std::stoul(name->substr(7)));
    const Eigen::Vector3d at = s.env->world().knotAt(vessel, knot);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ(s.seen[static_cast<std::size_t>(name - s.task->names.begin() + axis)],
                static_cast<float>(100 * at[axis]))
          << *name;
    moved += s.seen[static_cast<std::size_t>(name - s.task->names.begin())] !=
             before[static_cast<std::size_t>(name - s.task->names.begin())];
  }
  EXPECT_GE(moved, 1);
  const scene::ToolInput tool = s.env->tool();
  EXPECT_EQ(s.number("right tip, z (cm)"), static_cast<float>(100 * tool.position.z()));
  EXPECT_EQ(s.number("right attitude, w"), static_cast<float>(tool.orientation.w()));
  EXPECT_EQ(s.number("right tool"), static_cast<float>(tools::ToolKind::ClipApplier));
}

TEST(ExerciseEnvironment, ASnapshotGoesOnExactlyAndItsResultIsNoSecondTry) {
  Seat whole(clipAndCut()), other(clipAndCut());
  whole.env->reset(1, whole.seen.data());
  whole.play(250);
  std::vector<std::uint8_t> kept;
  whole.env->save(kept);
  whole.play();
  other.env->reset(9, other.seen.data());
  other.env->restore(kept);
  other.play();
  EXPECT_EQ(other.env->world().stateHash(), whole.env->world().stateHash());
  EXPECT_EQ(other.seen, whole.seen);
  EXPECT_EQ(other.env->result(), whole.env->result());
  kept[kept.size() / 2] ^= 1;
  EXPECT_THROW(other.env->restore(kept), std::invalid_argument);
  EXPECT_EQ(other.env->result(), whole.env->result());
}

TEST(ExerciseEnvironment, ThreadsOfAVectorChangeNothing) {
  const auto task = clipAndCut();
  constexpr std::size_t kCount = 3;
  std::array<std::uint64_t, kCount> seeds{4, 5, 6};
  std::array<std::array<std::uint64_t, kCount>, 2> hashes{};
  for (int threads = 1; threads <= 2; ++threads) {
    Environments all(task, kCount, threads);
    std::vector<float> seen(kCount * task->observationSize()), actions(kCount * task->actionSize());
    std::array<StepResult, kCount> results;
    all.reset(seeds.data(), seen.data());
    for (int k = 0; k < 60; ++k) {
      for (std::size_t i = 0; i < kCount; ++i) all.at(i).expert(actions.data() + i * task->actionSize());
      all.step(actions.data(), seen.data(), results.data());
    }
    for (std::size_t i = 0; i < kCount; ++i)
      hashes[static_cast<std::size_t>(threads - 1)][i] = all.at(i).world().stateHash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST(ExerciseEnvironment, IsRefusedWithItsReasonWhereItCannotBe) {
  const auto refusal = [](TaskOptions o) {
    try {
      makeTask(o);
    } catch (const std::exception& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  const TaskOptions good = optionsOf("clip_cut_tube", "clip_tube");
  TaskOptions o = good;
  o.vessels.clear();
  EXPECT_NE(refusal(o).find("needs the vessels' database"), std::string::npos) << refusal(o);
  o = optionsOf("clip_cut_tube", "slab");
  EXPECT_NE(refusal(o).find("exercise.yaml"), std::string::npos) << refusal(o);
  o = good, o.task = "/nowhere/exercise.yaml";
  EXPECT_NE(refusal(o).find("/nowhere/exercise.yaml"), std::string::npos) << refusal(o);
  o = good, o.task = "clip_cut_tube";
  EXPECT_NE(refusal(o).find("or the path of an exercise file"), std::string::npos) << refusal(o);
}

TEST(ExerciseEnvironment, ThroughCItTellsItsSizesNamesAndResult) {
  const TaskOptions o = optionsOf("clip_cut_tube", "clip_tube");
  EXPECT_STREQ(vest_task_scene(o.task.c_str()), "clip_tube");
  EXPECT_STREQ(vest_task_scene("/nowhere/exercise.yaml"), "");
  vest_model_options options{
      sizeof options, o.task.c_str(), o.scene.c_str(), o.box.c_str(), o.vessels.c_str(), 20, 0};
  vest_handle model, env;
  ASSERT_EQ(vest_model_load(&options, &model), VEST_OK) << vest_error(0);
  std::size_t numbers = 0, actions = 0;
  ASSERT_EQ(vest_model_observation_size(model, &numbers), VEST_OK);
  ASSERT_EQ(vest_model_action_size(model, &actions), VEST_OK);
  EXPECT_EQ(actions, 16u);  // the right hand, and the endoscope
  char text[64], tight[6];
  EXPECT_EQ(vest_model_observation_name(model, 0, text, sizeof text), VEST_OK);
  EXPECT_STREQ(text, "right yaw (rad)");
  EXPECT_EQ(vest_model_observation_name(model, 0, tight, sizeof tight), VEST_OK);
  EXPECT_STREQ(tight, "right");
  EXPECT_EQ(vest_model_observation_name(model, numbers, text, sizeof text), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_model_observation_name(model, 0, nullptr, 9), VEST_BAD_ARGUMENT);
  ASSERT_EQ(vest_env_new(model, 1, &env), VEST_OK);
  std::vector<float> seen(numbers);
  EXPECT_EQ(vest_reset(env, 1, seen.data(), numbers - 1), VEST_BAD_ARGUMENT);
  ASSERT_EQ(vest_reset(env, 1, seen.data(), numbers), VEST_OK);
  std::size_t size = 0;
  ASSERT_EQ(vest_exercise_result(env, nullptr, &size), VEST_OK);
  std::string json(size, ' ');
  ASSERT_EQ(vest_exercise_result(env, json.data(), &size), VEST_OK);
  EXPECT_NE(json.find("clip_cut_tube"), std::string::npos);
  size = 3;
  EXPECT_EQ(vest_exercise_result(env, json.data(), &size), VEST_BAD_ARGUMENT);
  EXPECT_EQ(size, json.size());
  vest_close(env), vest_close(model);
}

}  // namespace
}  // namespace vest::learning
