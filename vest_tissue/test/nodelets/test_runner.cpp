#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <thread>

#include "nets.h"
#include "vest_tissue/scene/runner.h"

// Protects the session: every step is handed out once and in order, commands act between steps, and what was
// consumed re-simulates to the same bits.

namespace vest::scene {
namespace {

Description oneTube() {
  Description d;
  d.name = "tube";
  d.objects.push_back(specimen::tube({}));
  return d;
}

std::unique_ptr<Runner> makeRunner(double speed) {
  RunnerOptions options;
  options.speed = speed;
  options.hash_every = 50;
  auto runner = std::make_unique<Runner>(std::make_unique<TissueSimulation>(World(oneTube())), options);
  runner->setPaused(true);
  runner->start();
  return runner;
}

void drain(Runner& runner, std::vector<StepFrame>& out) {
  while (StepFrame* frame = runner.steps().front()) {
    out.push_back(*frame);
    runner.steps().pop();
  }
}

void drainUntil(Runner& runner, std::size_t count, std::vector<StepFrame>& out) {
  for (int i = 0; i < 60000 && out.size() < count; ++i) {
    drain(runner, out);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ASSERT_GE(out.size(), count);
}

ToolSample pushing(double depth) {
  ToolSample sample;
  ToolInput& t = sample.tools[0];
  t.present = true;
  t.tool = tools::ToolKind::Grasper;
  t.position = {0.0, 0.0, 0.060 - depth};
  t.orientation = Eigen::Quaterniond(0, 1, 0, 0);  // z downwards
  t.pivot = {0.0, 0.0, 0.160};
  return sample;
}

TEST(Runner, WhilePausedNothingMovesAndAdvanceMovesExactly) {
  auto runner = makeRunner(1000);
  std::vector<StepFrame> frames;
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  drain(*runner, frames);
  EXPECT_TRUE(frames.empty());
  EXPECT_TRUE(runner->advance(137));
  drain(*runner, frames);
  ASSERT_EQ(frames.size(), 137U);
  EXPECT_EQ(frames.front().input.step, 1U);
  EXPECT_EQ(frames.back().input.step, 137U);
  EXPECT_EQ(runner->statistics().step, 137U);
  runner->setPaused(false);
  EXPECT_FALSE(runner->advance(1)) << "a running simulation is not stepped by hand";
}

TEST(Runner, NoStepIsLostWhileNobodyReads) {
  auto runner = makeRunner(1000);
  runner->setPaused(false);
  for (int i = 0; i < 3000 && runner->statistics().step < 4096; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_EQ(runner->statistics().step, 4096U) << "the full queue holds the simulation back";
  std::vector<StepFrame> frames;
  drainUntil(*runner, 5000, frames);
  for (std::size_t i = 0; i < frames.size(); ++i) ASSERT_EQ(frames[i].input.step, i + 1);
}

TEST(Runner, WhatWasConsumedReSimulatesToTheSameHashesThroughResetAndRestore) {
  auto runner = makeRunner(1000);
  std::vector<StepFrame> frames;
  std::vector<std::uint8_t> snapshot;
  runner->setPaused(false);
  for (int i = 0; i < 12; ++i) {
    runner->setTools(pushing(0.001 * i));
    drainUntil(*runner, frames.size() + 40, frames);
  }
  runner->call([&](Simulation& s) { s.world().save(snapshot); });
  drainUntil(*runner, frames.size() + 200, frames);
  runner->reset();
  drainUntil(*runner, frames.size() + 200, frames);
  runner->restore(snapshot, "kept");
  drainUntil(*runner, frames.size() + 200, frames);
  runner->setPaused(true);
  drain(*runner, frames);

  World world(oneTube(), 2);
  StepReport report;
  int compared = 0, resets = 0, restores = 0;
  for (const StepFrame& f : frames) {
    if (f.command == Command::Reset) world.reset(), ++resets;
    if (f.command == Command::Restore) world.restore(snapshot), ++restores;
    ASSERT_EQ(f.input.step, world.steps() + 1);
    world.step(f.input, report);
    if (!f.has_hash) continue;
    ++compared;
    ASSERT_EQ(f.hash, world.stateHash()) << "after step " << f.input.step;
  }
  EXPECT_GE(compared, 10);
  EXPECT_EQ(resets, 1);
  EXPECT_EQ(restores, 1);
}

TEST(Runner, ASceneThatIsEditedWhileItRunsReSimulatesToTheSameHashes) {
  auto runner = makeRunner(1000);
  scene::Description edited = oneTube();
  specimen::TubeOptions o;
  o.name = "drawn", o.centre.y() = 0.1;
  edited.objects.insert(edited.objects.begin(), specimen::tube(o));
  std::vector<StepFrame> frames;
  runner->setPaused(false);
  for (int i = 0; i < 10; ++i) {
    runner->setTools(pushing(0.001 * i));
    drainUntil(*runner, frames.size() + 40, frames);
  }
  EXPECT_EQ(runner->adopt(std::make_unique<TissueSimulation>(World(edited)), "edited"), 1U);
  // What waits in the queue is of the scene before.
  const std::uint64_t enough = runner->statistics().step + 400;
  while (frames.back().input.step < enough && !HasFatalFailure())
    drainUntil(*runner, frames.size() + 1, frames);
  runner->setPaused(true);
  drain(*runner, frames);

  TissueSimulation first{World(oneTube())}, second{World(edited)};
  Simulation* now = &first;
  StepReport report;
  int compared = 0;
  for (StepFrame& f : frames) {
    if (f.command == Command::Adopt) {
      EXPECT_EQ(f.command_argument, "edited");
      second.adopt(first);
      now = &second;
    }
    ASSERT_EQ(f.input.step, now->world().steps() + 1) << "steps are counted on";
    now->step(f.input, report);
    if (!f.has_hash) continue;
    compared += now == &second;
    ASSERT_EQ(f.hash, now->world().stateHash()) << "after step " << f.input.step;
  }
  EXPECT_GE(compared, 2);
}

// A haptic process closes its gate at a new generation: tissue may be where the hand is, at once.
TEST(Runner, WhateverIsNotTheNextStepIsANewGenerationForTheHand) {
  const std::string name = "/vest_test_runner_" + std::to_string(::getpid());
  auto runner =
      std::make_unique<Runner>(std::make_unique<TissueSimulation>(World(oneTube())), RunnerOptions{});
  runner->shareContacts(std::make_unique<shared::ContactWriter>(name));
  runner->setPaused(true);
  runner->start();
  shared::ContactReader reader(name);
  ASSERT_EQ(reader.connect(), "");
  const auto generation = [&](std::uint32_t steps) {
    EXPECT_TRUE(runner->advance(steps));
    shared::ContactImage image;
    EXPECT_TRUE(reader.read(image));
    return image.generation;
  };
  std::uint64_t before = generation(20);
  EXPECT_EQ(generation(20), before) << "it only goes on";
  std::vector<std::uint8_t> snapshot;
  runner->call([&](Simulation& s) { s.world().save(snapshot); });
  const auto anew = [&](const char* what) {
    const std::uint64_t now = generation(2);
    EXPECT_GT(now, before) << what;
    EXPECT_EQ(generation(2), now) << what;
    before = now;
  };
  runner->reset();
  anew("reset");
  runner->restore(snapshot, "later");
  anew("a snapshot of a later step");
  runner->restore(snapshot, "earlier");
  anew("a snapshot of an earlier step");
  runner->adopt(std::make_unique<TissueSimulation>(World(oneTube())), "edited");
  anew("a scene that was edited");
  runner->load(std::make_unique<TissueSimulation>(World(oneTube())), "another");
  anew("another scene");
  runner.reset();
  ::shm_unlink(name.c_str());
}

TEST(Runner, ARefusedSnapshotChangesNothing) {
  auto runner = makeRunner(1000);
  runner->advance(10);
  EXPECT_THROW(runner->restore({1, 2, 3}, "broken"), std::invalid_argument);
  EXPECT_EQ(runner->statistics().step, 10U);
  std::vector<StepFrame> frames;
  runner->advance(1);
  drain(*runner, frames);
  EXPECT_EQ(frames.back().input.step, 11U);
  EXPECT_EQ(frames.back().command, Command::None);
}

TEST(Runner, TheStateHandedOutBelongsToItsStep) {
  auto runner = makeRunner(1000);
  runner->advance(25);
  bool seen = false;
  for (int i = 0; i < 2000 && !seen; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    seen = runner->states().update() && runner->states().front().step == 25;
  }
  ASSERT_TRUE(seen);
  const StateFrame& state = runner->states().front();
  World world(oneTube());
  StepReport report;
  for (std::uint64_t k = 1; k <= 25; ++k) {
    StepInput input;
    input.step = k;
    world.step(input, report);
  }
  std::vector<float> expected(3 * world.knotCount(0));
  world.positions(0, expected.data());
  EXPECT_EQ(state.positions, expected);
  EXPECT_DOUBLE_EQ(state.time, world.time());
}

TEST(Runner, SpeedChangesThePaceAndNotTheState) {
  // Slower than anything that a busy machine could imitate: 200 steps would take 20 s.
  auto runner = makeRunner(0.01);
  runner->setPaused(false);
  runner->setSpeed(1000);
  std::vector<StepFrame> frames;
  drainUntil(*runner, 200, frames);
  runner->setPaused(true);
  World world(oneTube());
  StepReport report;
  for (const StepFrame& frame : frames) {
    world.step(frame.input, report);
    if (frame.has_hash) {
      EXPECT_EQ(world.stateHash(), frame.hash) << frame.input.step;
    }
  }
  EXPECT_THROW(runner->setSpeed(0), std::invalid_argument);
  EXPECT_THROW(runner->setSpeed(std::nan("")), std::invalid_argument);
}

TEST(Runner, TheScaleOfStressGoesByRoundSteps) {
  EXPECT_EQ(upperEnd(0), 1.0f);
  EXPECT_EQ(upperEnd(1.5f), 2.0f);
  EXPECT_EQ(upperEnd(4900), 5000.0f);
  EXPECT_EQ(upperEnd(5100), 10000.0f);
  EXPECT_TRUE(std::isfinite(upperEnd(std::numeric_limits<float>::infinity())));
}

TEST(Runner, OptionsOutOfRangeAreRefusedByName) {
  RunnerOptions options;
  options.speed = 0;
  try {
    Runner runner(std::make_unique<TissueSimulation>(World(oneTube())), options);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("speed"), std::string::npos);
  }
}

}  // namespace
}  // namespace vest::scene
