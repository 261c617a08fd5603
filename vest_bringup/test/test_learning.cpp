#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <numeric>
#include <thread>

#include <ros/package.h>

#include "vest_bringup/learning/environment.h"
#include "vest_bringup/session/resimulation.h"
#include "vest_bringup/vest.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/trajectory/trajectory.h"
#include "vest_tissue/solver/random.h"

// Protects learning: tasks can be passed, snapshots are exact, threads change nothing, C and C++ give the
// same bits, and vest.h survives whatever a caller hands over.

extern "C" int vest_test_episode(const char* task, const char* scene, const char* box, std::uint64_t seed,
                                 int steps, std::uint64_t* hash);

namespace vest::learning {
namespace {

TaskOptions optionsOf(const std::string& name, bool effects = false) {
  TaskOptions o;
  o.task = name;
  const std::string scene = vest_task_scene(name.c_str());
  o.scene = ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
  o.box = ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml";
  if (effects) o.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  return o;
}
std::string boxFile() {
  return optionsOf("reach").box;
}
std::string sceneOf(const std::string& task) {
  return optionsOf(task).scene;
}

using Action = std::array<float, 2 * kActionSize>;  // room for both hands
using Observation = std::array<float, kObservationSize>;

/// Steps by the expert. @return the last result
StepResult play(Environment& e, std::uint64_t seed, int most = 1000000) {
  Action action;
  Observation seen;
  e.reset(seed, seen.data());
  StepResult r;
  for (int k = 0; k < most && !e.over(); ++k) {
    e.expert(action.data());
    r = e.step(action.data(), seen.data());
  }
  return r;
}

/// m: how far a motion is from its hand's in a script, at most, as long as it lasts.
double offScript(const std::vector<trajectory::Waypoint>& motion, tools::Instrument hand,
                 const std::string& script) {
  const kinematics::TrainerBox box = kinematics::loadTrainerBox(boxFile());
  const auto rows =
      trajectory::fromWaypoints(ros::package::getPath("vest_bringup") + "/trajectories/" + script, box).rows;
  double farthest = 0;
  for (const trajectory::Row& row : rows) {
    if (row.t > motion.back().t) break;
    const auto& joints = row.joints[static_cast<std::size_t>(hand)];
    const Eigen::Vector3d tip = kinematics::forwardKinematics(box.arm(hand).X_BTrocar, joints).translation();
    farthest = std::max(farthest, (tip - trajectory::at(motion, row.t).tip).norm());
  }
  return farthest;
}

TEST(Learning, TheExpertsMotionsAreThoseOfTheirScripts) {
  using tools::Instrument;
  constexpr double kRounding = 2e-4;  // m: of times to rows
  EXPECT_LT(offScript(throwMotion()[0], Instrument::Left, "thread_throw.yaml"), kRounding);
  EXPECT_LT(offScript(throwMotion()[1], Instrument::Right, "thread_throw.yaml"), kRounding);
  EXPECT_LT(offScript(needleMotion(), Instrument::Right, "suture_pad.yaml"), kRounding);
}

TEST(Learning, TheExpertPassesEachTaskFromOtherStarts) {
  for (const TaskRow& row : tasks()) {
    TaskEnvironment e(makeTask(optionsOf(row.name)));
    Observation first, second;
    e.reset(1, first.data()), e.reset(2, second.data());
    EXPECT_NE(first, second) << "the start follows from the seed";
    if (row.both && std::getenv("VEST_FULL") == nullptr)
      continue;  // one start is tried below: 40 s of a core
    for (const std::uint64_t seed : {1ULL, 2ULL, (1ULL << 40) + 3}) {
      const StepResult r = play(e, seed);
      EXPECT_TRUE(r.passed) << row.name << ", seed " << seed << ": " << r.score << " after " << e.steps();
      EXPECT_TRUE(r.terminated);
      EXPECT_EQ(r.score, 1.0);
    }
  }
}

TEST(Learning, AThrowIsTiedAndThenBothHandsPullForASecond) {
  TaskEnvironment e(makeTask(optionsOf("tie_throw")));
  const std::size_t skip = 20, actions = 50;  // simulated steps of an action; actions of a second
  std::array<std::vector<double>, 2> force;
  std::size_t tied = 0;
  e.watch([&](const scene::StepInput&, const scene::StepReport& report) {
    for (std::size_t i = 0; i < force.size(); ++i)
      force[i].push_back(report.contacts[i].wrench.head<3>().norm());
    for (const scene::Event& event : report.events)
      if (event.kind == scene::EventKind::KnotTied) tied = force[0].size();
  });
  const StepResult r = play(e, 1);
  ASSERT_TRUE(r.passed) << r.score << " after " << e.steps();
  EXPECT_EQ(r.score, 1.0);
  ASSERT_GT(tied, 0U);
  EXPECT_GE(force[0].size() - tied, (actions - 1) * skip) << "the pull before the knot does not count";
  for (const auto& hand : force)
    for (std::size_t k = 1; k <= actions; ++k) {
      const auto end = hand.end() - static_cast<std::ptrdiff_t>((k - 1) * skip);
      EXPECT_GT(std::accumulate(end - static_cast<std::ptrdiff_t>(skip), end, 0.0) / skip, 1.0) << k;
    }
}

TEST(Learning, AThrowNeedsBothHands) {
  const auto task = makeTask(optionsOf("tie_throw"));
  ASSERT_EQ(task->actionSize(), 2 * kActionSize);
  TaskEnvironment both(task), other(task), right(task);
  Action action;
  Observation seen, same;
  const auto step = [&](Environment& e, bool left) {
    e.expert(action.data());
    if (!left) std::fill(action.begin() + kActionSize, action.end(), 0.0F);
    return e.step(action.data(), seen.data());
  };
  both.reset(7, seen.data()), right.reset(7, seen.data());
  StepResult with, without;
  for (int k = 0; k < 110; ++k) with = step(both, true), without = step(right, false);
  EXPECT_GE(with.score, 0.2) << "the left hand holds the long end";
  EXPECT_LT(without.score, 0.1) << "it stays where it began";
  std::vector<std::uint8_t> snapshot;
  both.save(snapshot);
  other.restore(snapshot);
  for (int k = 0; k < 20; ++k) {
    step(both, true);
    other.expert(action.data());
    other.step(action.data(), same.data());
    ASSERT_EQ(seen, same) << "the snapshot has both hands";
    ASSERT_EQ(both.world().stateHash(), other.world().stateHash());
  }
}

TEST(Learning, RewardsAreTheChangesOfTheScoreAndTimeTruncates) {
  TaskOptions o = optionsOf("reach");
  o.limit = 0.1;
  TaskEnvironment e(makeTask(o));
  Observation seen;
  e.reset(3, seen.data());
  const double start = seen[19];
  Action stay{};
  double sum = 0;
  int steps = 0;
  StepResult r;
  while (!e.over()) {
    stay[0] = ++steps % 2 != 0 ? 1.0f : -0.5f;
    r = e.step(stay.data(), seen.data());
    sum += r.reward;
  }
  EXPECT_EQ(steps, 5) << "0.1 s of 20 ms each";
  EXPECT_TRUE(r.truncated);
  EXPECT_FALSE(r.terminated);
  EXPECT_NEAR(sum, r.score - start, 1e-6);
  EXPECT_THROW(e.step(stay.data(), seen.data()), std::logic_error);
}

TEST(Learning, ASnapshotInTheMiddleOfAGraspGoesOnExactly) {
  for (const bool effects : {false, true}) {
    const auto task = makeTask(optionsOf("grasp_lift", effects));
    TaskEnvironment whole(task), other(task);
    play(whole, 5, 60);
    std::vector<std::uint8_t> snapshot, a, b;
    whole.save(snapshot);
    other.restore(snapshot);
    Observation x, y;
    Action action;
    whole.observe(x.data()), other.observe(y.data());
    EXPECT_EQ(x, y);
    for (int k = 0; k < 15 && !whole.over(); ++k) {
      whole.expert(action.data());
      const StepResult r = whole.step(action.data(), x.data()), s = other.step(action.data(), y.data());
      ASSERT_EQ(x, y) << "step " << k;
      ASSERT_EQ(r.reward, s.reward);
      ASSERT_EQ(whole.world().stateHash(), other.world().stateHash());
    }
    whole.save(a), other.save(b);
    EXPECT_EQ(a, b);
    // A damaged one changes nothing.
    for (const std::size_t at : {std::size_t{3}, std::size_t{40}, snapshot.size() / 2, snapshot.size() - 1}) {
      auto damaged = snapshot;
      damaged[at] ^= 0x10;
      EXPECT_THROW(other.restore(damaged), std::invalid_argument) << "byte " << at;
    }
    snapshot.resize(snapshot.size() / 2);
    EXPECT_THROW(other.restore(snapshot), std::invalid_argument);
    other.save(b);
    EXPECT_EQ(a, b);
    TaskEnvironment reach(makeTask(optionsOf("reach")));
    EXPECT_THROW(reach.restore(a), std::invalid_argument) << "of another task";
  }
}

TEST(Learning, ManyEnvironmentsShareOneModelAndThreadsChangeNothing) {
  const auto task = makeTask(optionsOf("grasp_lift"));
  constexpr std::size_t kCount = 6;
  const auto run = [&](int threads) {
    Environments all(task, kCount, threads);
    std::array<std::uint64_t, kCount> seeds{};
    for (std::size_t i = 0; i < kCount; ++i) seeds[i] = 100 + i;
    std::vector<float> seen(kCount * kObservationSize), actions(kCount * kActionSize);
    std::vector<StepResult> results(kCount);
    all.reset(seeds.data(), seen.data());
    for (int k = 0; k < 95; ++k) {  // long enough for some to begin anew
      for (std::size_t i = 0; i < kCount; ++i) all.at(i).expert(&actions[i * kActionSize]);
      all.step(actions.data(), seen.data(), results.data());
    }
    std::vector<std::uint64_t> hashes;
    for (std::size_t i = 0; i < kCount; ++i) {
      EXPECT_EQ(&all.at(i).world().model(), task->model.get());
      hashes.push_back(all.at(i).world().stateHash());
    }
    EXPECT_EQ(all.at(0).seed(), 100 + kCount) << "began anew with the next seed";
    return hashes;
  };
  const auto one = run(1);
  EXPECT_EQ(one, run(3));
}

vest_input toC(const scene::StepInput& input) {
  vest_input c{};
  c.struct_size = sizeof c, c.step = input.step, c.dt = input.dt, c.seed = input.seed;
  for (std::size_t i = 0; i < input.tools.size(); ++i) {
    const scene::ToolInput& t = input.tools[i];
    c.tools[i].present = t.present ? 1 : 0, c.tools[i].tool = static_cast<std::int32_t>(t.tool);
    c.tools[i].functions = t.functions, c.tools[i].jaw = t.jaw;
    std::copy_n(t.position.data(), 3, c.tools[i].position);
    std::copy_n(t.pivot.data(), 3, c.tools[i].pivot);
    std::copy_n(t.sight.data(), 3, c.tools[i].sight);
    std::copy_n(t.orientation.coeffs().data(), 4, c.tools[i].orientation);
  }
  return c;
}

TEST(Learning, AVesselsPulseIsTakenAtAllItsPlacesThroughC) {
  const std::string scene =
      ros::package::getPath("vest_tissue") + "/scenes/arterial_bleeding/arterial_bleeding.yaml";
  const vest_world_options options{sizeof options, scene.c_str(), 1};
  vest_handle of_c = 0;
  ASSERT_EQ(vest_world_new(&options, &of_c), VEST_OK) << vest_error(0);
  scene::World of_cpp(scene::loadScene(scene));
  const vest_dilatation pulse{"uterine_artery_left", {1.05F, 1.03F, 1.01F, 0.99F}};
  scene::StepInput input;
  input.dilatations = {{"uterine_artery_left", {1.05F, 1.03F, 1.01F, 0.99F}}};
  scene::StepReport report;
  for (int k = 0; k < 20; ++k) {
    input.step = of_cpp.steps() + 1, input.dt = of_cpp.description().dt;
    ASSERT_EQ(of_cpp.step(input, report), scene::Status::Ok);
    vest_input c = toC(input);
    c.dilatations = &pulse, c.dilatation_count = 1;
    ASSERT_EQ(vest_world_step_input(of_c, &c), VEST_OK) << vest_error(0);
  }
  std::uint64_t hash = 0;
  ASSERT_EQ(vest_hash(of_c, &hash), VEST_OK);
  EXPECT_EQ(hash, of_cpp.stateHash());
  EXPECT_EQ(vest_close(of_c), VEST_OK);
}

TEST(Learning, CAndCppAndTheReSimulatedInputsGiveTheSameHash) {
  const auto task = makeTask(optionsOf("grasp_lift"));
  TaskEnvironment e(task);
  session::Resimulation again(std::make_unique<scene::TissueSimulation>(scene::World(task->model)));
  const std::string scene = sceneOf("grasp_lift");
  const vest_world_options options{sizeof options, scene.c_str(), 2};
  vest_handle by_inputs = 0;
  ASSERT_EQ(vest_world_new(&options, &by_inputs), VEST_OK) << vest_error(0);
  e.watch([&](const scene::StepInput& input, const scene::StepReport&) {
    ASSERT_EQ(again.step(input, false, false), session::Resimulation::Outcome::Same);
    const vest_input same = toC(input);
    ASSERT_EQ(vest_world_step_input(by_inputs, &same), VEST_OK) << vest_error(0);
    std::uint64_t hash = 0;
    ASSERT_EQ(vest_hash(by_inputs, &hash), VEST_OK);
    ASSERT_EQ(hash, e.world().stateHash()) << "step " << input.step;
  });
  play(e, 9, 70);
  const std::uint64_t hash = e.world().stateHash();
  EXPECT_TRUE(again.compare(hash)) << "as a recorded session's inputs";
  EXPECT_EQ(vest_close(by_inputs), VEST_OK);
  std::uint64_t of_c = 0;
  ASSERT_EQ(vest_test_episode("grasp_lift", sceneOf("grasp_lift").c_str(), boxFile().c_str(), 9, 70, &of_c),
            VEST_OK)
      << vest_error(0);
  EXPECT_EQ(of_c, hash);
}

/// Handles of each kind, for those who misuse them.
struct Handles {
  vest_handle world = 0, model = 0, env = 0, vec = 0;
  std::string scene = sceneOf("reach"), box = boxFile();
  Handles() {
    const vest_world_options w{sizeof w, scene.c_str(), 1};
    vest_model_options m{};
    m.struct_size = sizeof m, m.task = "reach", m.scene = scene.c_str(), m.box = box.c_str();
    EXPECT_EQ(vest_world_new(&w, &world), VEST_OK) << vest_error(0);
    EXPECT_EQ(vest_model_load(&m, &model), VEST_OK) << vest_error(0);
    EXPECT_EQ(vest_env_new(model, 1, &env), VEST_OK);
    EXPECT_EQ(vest_vec_new(model, 2, 2, &vec), VEST_OK);
  }
  ~Handles() {
    for (const vest_handle h : {world, model, env, vec}) vest_close(h);
  }
};

TEST(CInterface, RefusesNullWrongSizesAndWrongKindsWithAText) {
  Handles h;
  float seen[kObservationSize], action[kActionSize] = {};
  vest_result result{};
  EXPECT_EQ(vest_step(h.env, action, kActionSize, seen, kObservationSize, &result), VEST_BAD_ARGUMENT)
      << "struct_size is 0";
  EXPECT_NE(std::string(vest_error(h.env)).find("struct_size is 0 (allowed: "), std::string::npos)
      << vest_error(h.env);
  result.struct_size = sizeof result;
  EXPECT_EQ(vest_step(h.env, action, kActionSize, seen, kObservationSize, &result), VEST_OVER) << "not begun";
  EXPECT_EQ(vest_reset(h.env, 1, seen, kObservationSize - 1), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_reset(h.env, 1, nullptr, kObservationSize), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_reset(h.env, 1, seen, kObservationSize), VEST_OK);
  EXPECT_STREQ(vest_error(h.env), "");
  action[0] = std::numeric_limits<float>::quiet_NaN(), action[1] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(vest_step(h.env, action, kActionSize, seen, kObservationSize, &result), VEST_OK);
  for (const float s : seen) EXPECT_TRUE(std::isfinite(s));
  EXPECT_EQ(vest_reset(h.world, 1, seen, kObservationSize), VEST_BAD_HANDLE) << "a world is no environment";
  EXPECT_EQ(vest_world_step(h.env, 1), VEST_BAD_HANDLE);
  EXPECT_EQ(vest_positions(h.world, 99, seen, 3), VEST_BAD_ARGUMENT);
  std::size_t size = 1;
  std::uint8_t byte;
  EXPECT_EQ(vest_save(h.world, &byte, &size), VEST_BAD_ARGUMENT);
  EXPECT_GT(size, 1000U);
  EXPECT_EQ(vest_restore(h.world, &byte, 1), VEST_REFUSED);
  vest_handle out = 77;
  vest_world_options w{sizeof w, "/nowhere.yaml", 1};
  EXPECT_EQ(vest_world_new(&w, &out), VEST_REFUSED);
  EXPECT_EQ(out, 0U);
  EXPECT_NE(std::string(vest_error(0)).find("/nowhere.yaml"), std::string::npos) << vest_error(0);
  w.scene = h.scene.c_str(), w.threads = 0;
  EXPECT_EQ(vest_world_new(&w, &out), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_vec_new(h.model, 0, 1, &out), VEST_REFUSED);
}

TEST(CInterface, AModelTellsHowManyNumbersItsActionsHave) {
  Handles h;
  std::size_t numbers = 0;
  EXPECT_EQ(vest_model_action_size(h.model, &numbers), VEST_OK);
  EXPECT_EQ(numbers, vest_action_size());
  EXPECT_EQ(vest_model_action_size(h.model, nullptr), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_model_action_size(h.env, &numbers), VEST_BAD_HANDLE);
  const std::string scene = sceneOf("tie_throw");
  vest_model_options m{};
  m.struct_size = sizeof m, m.task = "tie_throw", m.scene = scene.c_str(), m.box = h.box.c_str();
  vest_handle model = 0, env = 0, vec = 0;
  ASSERT_EQ(vest_model_load(&m, &model), VEST_OK) << vest_error(0);
  EXPECT_EQ(vest_model_action_size(model, &numbers), VEST_OK);
  ASSERT_EQ(numbers, 2 * vest_action_size());
  ASSERT_EQ(vest_env_new(model, 1, &env), VEST_OK);
  ASSERT_EQ(vest_vec_new(model, 2, 2, &vec), VEST_OK);
  float seen[2 * kObservationSize], actions[4 * kActionSize] = {};
  const std::uint64_t seeds[] = {7, 8};
  vest_result results[2] = {};
  results[0].struct_size = sizeof(vest_result);
  EXPECT_EQ(vest_reset(env, 7, seen, kObservationSize), VEST_OK);
  EXPECT_EQ(vest_expert(env, actions, kActionSize), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_expert(env, actions, numbers), VEST_OK);
  EXPECT_EQ(vest_step(env, actions, kActionSize, seen, kObservationSize, results), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_step(env, actions, numbers, seen, kObservationSize, results), VEST_OK);
  EXPECT_EQ(vest_vec_reset(vec, seeds, 2, seen, 2 * kObservationSize), VEST_OK);
  EXPECT_EQ(vest_vec_expert(vec, actions, 2 * kActionSize), VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_vec_expert(vec, actions, 2 * numbers), VEST_OK);
  EXPECT_EQ(vest_vec_step(vec, actions, 2 * kActionSize, seen, 2 * kObservationSize, results, 2),
            VEST_BAD_ARGUMENT);
  EXPECT_EQ(vest_vec_step(vec, actions, 2 * numbers, seen, 2 * kObservationSize, results, 2), VEST_OK);
  for (const vest_handle of : {vec, env, model}) EXPECT_EQ(vest_close(of), VEST_OK);
}

TEST(CInterface, AClosedHandleIsRefusedAndNeverComesBack) {
  Handles h;
  const vest_handle closed = h.env;
  EXPECT_EQ(vest_close(h.model), VEST_OK) << "environments keep it alive";
  float seen[kObservationSize];
  EXPECT_EQ(vest_reset(h.env, 1, seen, kObservationSize), VEST_OK);
  EXPECT_EQ(vest_close(closed), VEST_OK);
  EXPECT_EQ(vest_close(closed), VEST_BAD_HANDLE);
  EXPECT_EQ(vest_reset(closed, 1, seen, kObservationSize), VEST_BAD_HANDLE);
  EXPECT_NE(std::string(vest_error(closed)).find("is closed"), std::string::npos);
  vest_handle next = 0;
  EXPECT_EQ(vest_env_new(h.model, 1, &next), VEST_BAD_HANDLE);
  h.model = 0;
}

TEST(CInterface, ASecondThreadIsToldToWait) {
  Handles h;
  std::atomic<bool> done{false};
  std::thread worker([&] {
    while (!done) vest_world_step(h.world, 200);
  });
  int busy = 0;
  for (int k = 0; k < 10000000 && busy == 0; ++k) {
    std::uint64_t hash;
    const int code = vest_hash(h.world, &hash);
    busy += code == VEST_BUSY;
    ASSERT_TRUE(code == VEST_OK || code == VEST_BUSY) << code;
  }
  done = true;
  worker.join();
  EXPECT_GT(busy, 0);
}

TEST(CInterface, SurvivesRandomCalls) {
  Handles h;
  std::uint64_t n = 0;
  const auto below = [&n](std::uint32_t count) { return solver::randomBelow(count, 19, 0, n++); };
  const std::array<vest_handle, 7> handles{h.world, h.model, h.env, h.vec, 0, 1ULL << 60, ~0ULL};
  std::vector<float> room(4 * kObservationSize + 30000);
  std::vector<std::uint8_t> bytes(3000000);
  const char* const words[] = {nullptr,       "",         "reach", "\xff\xfe", "../..", h.scene.c_str(),
                               h.box.c_str(), "/dev/null"};
  std::array<int, 8> codes{};
  const int count = std::getenv("VEST_FULL") != nullptr ? 300000 : 6000;
  for (int k = 0; k < count; ++k) {
    const vest_handle handle = handles[below(handles.size())];
    const std::size_t sizes[] = {
        0, 1, kActionSize, kObservationSize, 2 * kActionSize, 2 * kObservationSize, ~std::size_t{0}};
    const std::size_t a = sizes[below(7)], b = sizes[below(7)];
    float* const floats = below(5) == 0 ? nullptr : room.data();
    std::size_t size = below(2) == 0 ? bytes.size() : below(100);
    std::uint64_t number = 0;
    double seconds = 0;
    vest_result results[2] = {};
    results[0].struct_size = below(3) == 0 ? below(100) : sizeof(vest_result);
    const vest_world_options w{below(2) == 0 ? sizeof(vest_world_options) : below(100), words[below(5)], 1};
    vest_model_options m{};
    m.struct_size = sizeof m, m.task = words[below(4)], m.scene = words[below(8)], m.box = words[below(8)];
    m.skip = static_cast<std::int32_t>(below(3)) - 1;
    vest_handle out = 0;
    int code = VEST_OK;
    vest_input in{};
    in.struct_size = below(4) == 0 ? below(600) : sizeof in;
    in.step = below(3), in.dt = below(3) == 0 ? 1e9 : 0;
    const vest_load load{below(4), below(5000), {}, 0, 0, 0};
    const vest_impact impact{below(4), below(5000), {}, {0, 0, below(2) == 0 ? 1.0 : HUGE_VAL}};
    const vest_edit edit{words[below(3)], words[below(3)], below(2) == 0 ? 1.0 : std::nan("")};
    const vest_dilatation dilatation{words[below(3)], {1, 1, below(2) == 0 ? 1.01F : -1e30F, 1}};
    if (below(3) == 0) in.loads = &load, in.load_count = 1;
    if (below(3) == 0) in.impacts = &impact, in.impact_count = 1;
    if (below(4) == 0) in.edits = below(3) == 0 ? nullptr : &edit, in.edit_count = 1;
    if (below(4) == 0) in.dilatations = &dilatation, in.dilatation_count = 1;
    if (below(6) == 0) in.requests = words, in.request_count = below(8);
    if (below(2) == 0)
      in.tools[1] = {1,
                     static_cast<std::int32_t>(below(14)) - 1,
                     below(64),
                     {0, 0.05, below(2) == 0 ? 0.05 : 1e300},
                     {0, 0, 0, 1},
                     {0, 0, 0.3},
                     0.5,
                     {0, 0, 1}};
    switch (below(18)) {
      case 15:
        code = vest_world_step_input(handle, below(9) == 0 ? nullptr : &in);
        break;
      case 0:
        code = vest_reset(handle, k, floats, a);
        break;
      case 1:
        code = vest_step(handle, floats, a, floats, b, results);
        break;
      case 2:
        code = vest_expert(handle, floats, a);
        break;
      case 3:
        code = vest_vec_step(handle, floats, a, floats, b, results, below(4));
        break;
      case 4:
        code = vest_vec_expert(handle, floats, a);
        break;
      case 5:
        code = vest_positions(handle, below(4), floats, a);
        break;
      case 6:
        code = vest_save(handle, below(3) == 0 ? nullptr : bytes.data(), &size);
        break;
      case 7:
        code = vest_restore(handle, bytes.data(), size);
        break;
      case 8:
        code = vest_hash(handle, below(3) == 0 ? nullptr : &number);
        break;
      case 9:
        code = vest_time(handle, &number, below(3) == 0 ? nullptr : &seconds);
        break;
      case 10:
        code = vest_object_name(handle, below(4), reinterpret_cast<char*>(floats), below(10));
        break;
      case 11:
        code = vest_world_new(below(5) == 0 ? nullptr : &w, &out);
        break;
      case 12:
        code = below(20) == 0 ? vest_model_load(&m, &out) : vest_observe(handle, floats, a);
        break;
      case 13:
        code = vest_env_new(handle, static_cast<std::int32_t>(below(3)) - 1, below(2) == 0 ? nullptr : &out);
        break;
      case 16: {
        const auto side = static_cast<std::int32_t>(below(3)) * 8;
        code = vest_picture(handle, side, side, bytes.data(), 3 * 64, below(3) == 0 ? nullptr : floats, 64);
        break;
      }
      case 14:
        code = vest_triangles(handle, below(4), nullptr, &size);
        break;
      default:
        code = vest_world_step(handle, below(3));
    }
    ASSERT_GE(code, VEST_OK);
    ASSERT_LE(code, VEST_OVER) << vest_error(0);
    ++codes[static_cast<std::size_t>(code)];
    ASSERT_NE(vest_error(handle), nullptr);
    if (code != VEST_OK) {
      ASSERT_STRNE(vest_error(0), "");
    }
    if (out != 0) {
      ASSERT_EQ(vest_close(out), VEST_OK);
    }
  }
  for (const int code : {VEST_OK, VEST_BAD_HANDLE, VEST_BAD_ARGUMENT, VEST_REFUSED})
    EXPECT_GT(codes[code], 10) << code;
}

}  // namespace
}  // namespace vest::learning
