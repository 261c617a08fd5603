#include <gtest/gtest.h>

#include <ros/package.h>

#include "vest_bringup/session/resimulation.h"
#include "vest_bringup/simulation/trainer.h"

// Protects the composite: feedback of effects reaches the tissue one step later, and is part of the recorded
// input.

namespace vest::simulation {
namespace {

scene::Description tubeScene() {
  return scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/tube/tube.yaml");
}

/// Pushes the first triangle in every third step.
class Pusher : public Effect {
 public:
  void step(const scene::World&, const scene::StepInput& input, const scene::StepReport&,
            Feedback& feedback) override {
    if (input.step % 3 != 0) return;
    scene::ImpactInput impact;
    impact.weights = {1.0, 0.0, 0.0};
    impact.momentum = {0.0, 0.0, 1e-7};
    feedback.impacts.push_back(impact);
  }
  void reset() override { ++resets; }
  int resets = 0;
};

TEST(Trainer, FeedbackOfAStepIsInTheNextInputAndNowhereElse) {
  Trainer trainer{scene::World(tubeScene())};
  trainer.add(std::make_unique<Pusher>());
  scene::StepReport report;
  for (std::uint64_t k = 1; k <= 12; ++k) {
    scene::StepInput input;
    input.step = k;
    trainer.step(input, report);
    EXPECT_EQ(input.impacts.size(), k > 1 && (k - 1) % 3 == 0 ? 1U : 0U) << "step " << k;
  }
}

TEST(Trainer, TheRecordedInputsAloneReSimulateACompositeWithEffects) {
  Trainer trainer{scene::World(tubeScene())};
  trainer.add(std::make_unique<Pusher>());
  scene::StepReport report;
  std::vector<scene::StepInput> recorded;
  std::vector<std::uint64_t> hashes;
  for (std::uint64_t k = 1; k <= 200; ++k) {
    scene::StepInput input;
    input.step = k;
    trainer.step(input, report);
    recorded.push_back(input);
    hashes.push_back(trainer.world().stateHash());
  }
  for (const int threads : {1, 2, 4}) {
    scene::World world(tubeScene(), threads);
    session::Resimulation resimulation(world);
    for (std::size_t i = 0; i < recorded.size(); ++i) {
      ASSERT_FALSE(resimulation.step(recorded[i], false, false).has_value());
      ASSERT_TRUE(resimulation.compare(hashes[i])) << "step " << i + 1 << ", threads " << threads;
    }
  }
}

TEST(Trainer, AMissingStepAndAChangedInputAreSeen) {
  scene::World world(tubeScene());
  session::Resimulation resimulation(world);
  scene::StepInput input;
  input.step = 1;
  EXPECT_FALSE(resimulation.step(input, false, false).has_value());
  input.step = 3;
  EXPECT_EQ(resimulation.step(input, false, false), std::optional<std::uint64_t>(2));
  EXPECT_FALSE(resimulation.compare(world.stateHash() + 1));
}

TEST(Trainer, ResetForgetsFeedbackAndResetsEffects) {
  Trainer trainer{scene::World(tubeScene())};
  auto pusher = std::make_unique<Pusher>();
  Pusher* seen = pusher.get();
  trainer.add(std::move(pusher));
  scene::StepReport report;
  for (std::uint64_t k = 1; k <= 3; ++k) {
    scene::StepInput input;
    input.step = k;
    trainer.step(input, report);
  }
  trainer.reset();
  EXPECT_EQ(seen->resets, 1);
  scene::StepInput input;
  input.step = 1;
  trainer.step(input, report);
  EXPECT_TRUE(input.impacts.empty());
}

}  // namespace
}  // namespace vest::simulation
