#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "nets.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_state.h"

// Protects steady forces from outside (the weight of pools): the attachments bear all of them and no more,
// they come and go without a jerk, the next ones take their place, cuts lose none, snapshots keep them, their
// work is accounted, and absurd ones stay bounded.

namespace {

using namespace vest;
using Eigen::Vector3d;

constexpr float kForce = -2e-5f;  // N on each of the middle knots

scene::StepInput load(float force, double over = 0.05, float damping = 0.0f) {
  scene::StepInput in;
  in.load_over = over;
  for (std::uint32_t k = 48; k < 80; ++k) in.loads.push_back({0, k, {0, 0, force}, damping});
  return in;
}
void run(scene::World& w, int steps, const scene::StepInput& first = {}) {
  scene::StepReport report;
  for (int i = 0; i < steps; ++i)
    EXPECT_EQ(w.step(i == 0 ? first : scene::StepInput{}, report), scene::Status::Ok);
}

TEST(Load, TheAttachmentsBearAllOfItAndLetItGoAgain) {
  scene::World w(specimen::tubeScene());
  run(w, 6000);
  const double dry = w.reaction(0).z();
  run(w, 6000, load(kForce));
  const double weight = -32.0 * static_cast<double>(kForce);
  EXPECT_NEAR(w.reaction(0).z() - dry, weight, 0.01 * weight);
  EXPECT_LT(w.knotAt(0, 64).z(), w.description().objects[0].position[64].z());
  run(w, 6000, load(2 * kForce));
  EXPECT_NEAR(w.reaction(0).z() - dry, 2 * weight, 0.01 * weight) << "instead of what was told before";
  scene::StepInput none;
  none.load_over = 0.05;
  run(w, 6000, none);
  EXPECT_NEAR(w.reaction(0).z(), dry, 0.01 * weight);
  EXPECT_FALSE(w.state().objects[0].load.any);
}

TEST(Load, ItComesLinearlyAndThenHolds) {
  scene::World w(specimen::tubeScene());
  run(w, 10, load(kForce, 0.04));
  const auto now = [&] { return w.state().objects[0].load.now[60][2]; };
  EXPECT_NEAR(now(), 0.25f * kForce, 1e-3f * std::fabs(kForce));
  run(w, 20);
  EXPECT_NEAR(now(), 0.75f * kForce, 1e-3f * std::fabs(kForce));
  run(w, 10);
  EXPECT_EQ(now(), kForce);
  run(w, 500);
  EXPECT_EQ(now(), kForce);
  EXPECT_EQ(w.state().objects[0].load.now[47][2], 0.0f);
}

TEST(Load, ItsWorkIsAccounted) {
  scene::World w(specimen::tubeScene());
  w.accountEnergy(true);
  run(w, 1);
  const auto sum = [](const scene::Energy& e) {
    return e.kinetic + e.elastic + e.potential + e.dissipated - e.work;
  };
  const scene::Energy before = w.energy();
  run(w, 3000, load(kForce));
  const scene::Energy after = w.energy();
  EXPECT_GT(after.work - before.work, 1e-8) << "J";
  EXPECT_NEAR(sum(after), sum(before), 0.02 * (after.work - before.work));
}

TEST(Load, ItsDampingTakesEnergyAndLeavesThePlaceAsItIs) {
  scene::World free(specimen::tubeScene()), damped(specimen::tubeScene());
  for (scene::World* w : {&free, &damped}) w->accountEnergy(true);
  run(free, 1, load(kForce)), run(damped, 1, load(kForce, 0.05, 1e-2f));
  const auto sum = [](const scene::Energy& e) {
    return e.kinetic + e.elastic + e.potential + e.dissipated - e.work;
  };
  const scene::Energy before = damped.energy();
  double most_free = 0, most_damped = 0;
  for (int i = 0; i < 300; ++i) {
    run(free, 1), run(damped, 1);
    most_free = std::max(most_free, free.energy().kinetic),
    most_damped = std::max(most_damped, damped.energy().kinetic);
  }
  EXPECT_LT(most_damped, 0.5 * most_free);
  run(free, 12000), run(damped, 12000);
  const double sag = specimen::tubeScene().objects[0].position[64].z() - free.knotAt(0, 64).z();
  EXPECT_NEAR(damped.knotAt(0, 64).z(), free.knotAt(0, 64).z(), 0.01 * sag);
  EXPECT_NEAR(sum(damped.energy()), sum(before), 0.02 * (damped.energy().work - before.work));
  scene::StepInput absurd = load(0.0f, 0.05, 1e30f);  // all that a knot may have: slow, and no more
  run(damped, 3000, absurd);
}

/// A tube that floats: lifted by `stiffness` N/m for each metre that a knot is below `level`.
scene::StepInput lift(const scene::World& w, double level, float stiffness) {
  scene::StepInput in;
  in.load_over = 0.048;
  for (std::uint32_t k = 8; k < 120; ++k) {
    const auto depth = static_cast<float>(level - w.knotAt(0, k).z());
    in.loads.push_back({0, k, {0, 0, stiffness * std::max(0.0f, depth)}, 0, stiffness, depth});
  }
  return in;
}

TEST(Load, ALiftFollowsItsKnotAndFeedsNothing) {
  // Told every 48 ms, as pools are. 0.4 N/m on a knot of 31 mg are 110 rad/s: held from one look to the next
  // such a force works the tube up.
  specimen::TubeOptions o;
  o.youngs_modulus = 2e3, o.damping = 1e-4, o.knot_damping = 1e-4;
  scene::World w(specimen::tubeScene(o));
  w.accountEnergy(true);
  const double level = 0.052;
  double most = 0;
  scene::StepReport report;
  for (int i = 0; i < 6000; ++i) {
    ASSERT_EQ(w.step(i % 48 == 0 ? lift(w, level, 0.4f) : scene::StepInput{}, report), scene::Status::Ok);
    if (i > 4000) most = std::max(most, w.energy().kinetic);
  }
  EXPECT_LT(most, 1e-9) << "J: at rest";
  double lifted = 0, weight = 0;
  for (std::uint32_t k = 8; k < 120; ++k) {
    lifted += 0.4 * std::max(0.0, level - w.knotAt(0, k).z());
    weight += 9.81 * w.description().objects[0].mass[k];
  }
  const auto sum = [&] {
    const scene::Energy e = w.energy();
    return e.kinetic + e.elastic + e.potential + e.dissipated - e.work;
  };
  const double before = sum(), work = w.energy().work;
  EXPECT_NEAR(lifted, weight, 0.5 * weight) << "it floats, the ends hold the rest";
  scene::StepInput up = lift(w, level + 0.004, 0.4f);  // the pool rises
  run(w, 1000, up);
  EXPECT_GT(std::fabs(w.energy().work - work), 1e-7) << "J";
  EXPECT_NEAR(sum(), before, 0.05 * std::fabs(w.energy().work - work));
  EXPECT_GT(w.knotAt(0, 64).z(), 0.05) << "and takes it along";
}

TEST(Load, ACutKnotSharesItWithItsCopy) {
  scene::World w(specimen::tubeScene());
  run(w, 100, load(kForce));
  std::uint32_t copy = 0;
  ASSERT_TRUE(w.splitKnot(0, 60, Vector3d::UnitX(), copy));
  const auto& now = w.state().objects[0].load.now;
  EXPECT_EQ(now[60][2] + now[copy][2], kForce);
  EXPECT_LT(now[copy][2], 0.0f);
}

TEST(Load, ASnapshotKeepsItAndADamagedOneIsRefused) {
  scene::World live(specimen::tubeScene()), other(specimen::tubeScene());
  std::vector<std::uint8_t> bytes;
  run(live, 20, load(kForce));  // on its way
  live.save(bytes);
  other.restore(bytes);
  EXPECT_EQ(other.stateHash(), live.stateHash());
  run(live, 100), run(other, 100);
  EXPECT_EQ(other.stateHash(), live.stateHash());
  live.save(bytes);
  const float absurd = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i + sizeof kForce <= bytes.size(); ++i) {
    if (std::memcmp(&bytes[i], &kForce, sizeof kForce) != 0) continue;
    std::memcpy(&bytes[i], &absurd, sizeof absurd);
    break;
  }
  const auto hash = other.stateHash();
  EXPECT_THROW(other.restore(bytes), std::invalid_argument);
  EXPECT_EQ(other.stateHash(), hash);
}

TEST(Load, AbsurdOnesStayBoundedAndUnknownOnesAreLeftOut) {
  scene::World w(specimen::tubeScene());
  scene::StepInput in;
  in.load_over = 0.05;
  in.loads.push_back({0, 60, {std::numeric_limits<float>::quiet_NaN(), 1e30f, -1e30f}, -1.0f});
  in.loads.push_back({0, 61, {0, 0, 0}, 1e30f});
  in.loads.push_back({0, 100000, {0, 0, 1}, 0});
  in.loads.push_back({9, 60, {0, 0, 1}, 0});
  scene::StepReport report;
  w.step(in, report);
  const auto& told = w.state().objects[0].load.told;
  EXPECT_EQ(told[60][0], 0.0f);
  EXPECT_EQ(told[60][1], scene::kGreatestLoad);
  EXPECT_EQ(told[60][2], -scene::kGreatestLoad);
  EXPECT_EQ(told[60][3], 0.0f);
  EXPECT_EQ(told[61][3], scene::kGreatestLoadDamping);
  in.loads.clear();
  in.load_over = std::numeric_limits<double>::quiet_NaN();
  w.step(in, report);
  EXPECT_EQ(told[60][1], scene::kGreatestLoad) << "told nothing";
}

}  // namespace
