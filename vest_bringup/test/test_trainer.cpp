#include <gtest/gtest.h>

#include <cmath>
#include <limits>

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

using Outcome = session::Resimulation::Outcome;

std::unique_ptr<scene::Simulation> tissue(int threads) {
  return std::make_unique<scene::TissueSimulation>(scene::World(tubeScene(), threads));
}

/// Pushes the first triangle in every third step.
/// Takes or gives one thing.
struct Plug : Effect {
  Ports plug;
  explicit Plug(Ports p) : plug(p) {}
  Ports ports() const override { return plug; }
  void step(const scene::World&, const scene::StepInput&, const scene::StepReport&, Feedback&) override {}
  void reset() override {}
};

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

TEST(Trainer, EffectsThatAreMadeForAnEditedSceneHearWhatIsKept) {
  struct Hears : Plug {
    Hears() : Plug({}) {}
    void adopt(const Effect& before, const std::vector<std::uint32_t>& objects) override {
      from = &before, kept = objects;
    }
    const Effect* from = nullptr;
    std::vector<std::uint32_t> kept;
  };
  scene::Description before = tubeScene(), after = before;
  before.objects.push_back(before.objects[0]);
  before.objects[1].name = "gone";
  after.objects.insert(after.objects.begin(), after.objects[0]);
  after.objects[0].name = "new";
  const auto around = [](const scene::Description& d, Hears*& effect) {
    auto trainer = std::make_unique<Trainer>(scene::World(d));
    auto hears = std::make_unique<Hears>();
    effect = hears.get();
    trainer->add(std::move(hears));
    return trainer;
  };
  Hears *old = nullptr, *now = nullptr;
  const auto first = around(before, old), second = around(after, now);
  second->adopt(*first);
  EXPECT_EQ(now->from, old);
  EXPECT_EQ(now->kept, (std::vector<std::uint32_t>{1, scene::kNotAdopted}));
}

TEST(Trainer, AnEffectStandsBehindThoseWhoseWorkItTakes) {
  const auto row = [](Ports first, Ports second) {
    Trainer t{scene::World(tubeScene())};
    t.add(std::make_unique<Plug>(first));
    t.add(std::make_unique<Plug>(second));
  };
  EXPECT_NO_THROW(row({0, 0, kGas}, {kGas, 0, 0}));
  EXPECT_THROW(row({kGas, 0, 0}, {0, 0, kGas}), std::logic_error);
  EXPECT_NO_THROW(row({0, kFilms, 0}, {0, 0, kFilms}));
  EXPECT_THROW(row({0, 0, kFilms}, {0, kFilms, 0}), std::logic_error) << "what comes late comes from behind";
}

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
    session::Resimulation resimulation(tissue(threads));
    for (std::size_t i = 0; i < recorded.size(); ++i) {
      ASSERT_EQ(resimulation.step(recorded[i], false, false), Outcome::Same);
      ASSERT_TRUE(resimulation.compare(hashes[i])) << "step " << i + 1 << ", threads " << threads;
    }
  }
}

TEST(Trainer, AMissingStepAndAChangedInputAreSeen) {
  session::Resimulation resimulation(tissue(1));
  scene::StepInput input;
  input.step = 1;
  EXPECT_EQ(resimulation.step(input, false, false), Outcome::Same);
  input.step = 3;
  EXPECT_EQ(resimulation.step(input, false, false), Outcome::Missing);
  EXPECT_EQ(resimulation.world().steps(), 1U);
  EXPECT_FALSE(resimulation.compare(resimulation.world().stateHash() + 1));
}

TEST(Trainer, AFaultThatTheSessionDidNotHaveIsSeenAndOneThatItHadIsNoDifference) {
  for (const bool had : {false, true}) {
    session::Resimulation resimulation(tissue(1));
    scene::StepInput input;
    input.step = 1;
    input.dt = std::numeric_limits<double>::quiet_NaN();  // the State stays as it was, and so does its hash
    EXPECT_EQ(resimulation.step(input, false, false, had), had ? Outcome::Same : Outcome::Fault);
    EXPECT_EQ(resimulation.faults(), had ? 1U : 0U);
    input.dt = 0.001;
    input.step = resimulation.world().steps() + 1;
    EXPECT_EQ(resimulation.step(input, false, false, true), Outcome::NoFault);
  }
}

TEST(Trainer, EffectsThatAreSimulatedAgainHandBackWhatTheyDidAndAChangeIsSeen) {
  const auto composite = [] {
    auto trainer = std::make_unique<Trainer>(scene::World(tubeScene()));
    trainer->add(std::make_unique<Pusher>());
    return trainer;
  };
  const auto recorded = composite();
  session::Resimulation again(composite(), true), changed(composite(), true);
  scene::StepReport report;
  for (std::uint64_t k = 1; k <= 12; ++k) {
    scene::StepInput input;
    input.step = k;
    recorded->step(input, report);
    ASSERT_EQ(again.step(input, false, false), Outcome::Same) << "step " << k;
    if (k == 10) input.impacts.at(0).momentum.z() = std::nextafter(input.impacts.at(0).momentum.z(), 1.0);
    ASSERT_EQ(changed.step(input, false, false), k == 10 ? Outcome::Feedback : Outcome::Same) << "step " << k;
  }
  EXPECT_TRUE(again.compare(recorded->world().stateHash()));
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
