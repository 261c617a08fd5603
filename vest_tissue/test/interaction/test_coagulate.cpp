#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "theatre.h"
#include "vest_tissue/interaction/thermal.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// A hook from above whose foot lies along the tube; its lower side at height `z`.
scene::ToolInput hook(double x, double z, bool on) {
  scene::ToolInput t = specimen::grasper(Vector3d(x, 0, z + 0.0146), 0.0);
  t.tool = tools::ToolKind::CoagulationHook;
  t.pivot = Vector3d(x, 0, 0.25);
  if (on) t.functions = tools::kFunctionCoagulate;
  return t;
}

struct Theatre : test::Theatre {
  explicit Theatre(const scene::Description& d = specimen::tubeScene()) : test::Theatre(d) {
    run(3000);  // at rest under gravity
  }
  /// Height at which the hook's foot lies 1 mm deep in the tube.
  double top() {
    std::vector<float> p(3 * world.knotCount(0));
    world.positions(0, p.data());
    float z = 0.0f;
    for (std::size_t i = 7 * 8; i < 9 * 8; ++i) z = std::max(z, p[3 * i + 2]);
    return z - 0.001;
  }
  float least(scene::Field kind) {
    const auto v = field(kind);
    return *std::min_element(v.begin(), v.end());
  }
};

TEST(Coagulation, WhatTheGeneratorGivesIsAccountedForAndOnlyTouchedTissueGetsIt) {
  Theatre t;
  EXPECT_EQ(t.most(scene::Field::Temperature), 310.15f);
  EXPECT_EQ(t.least(scene::Field::Perfusion), 1.0f);
  t.input.tools[1] = hook(0.0, 0.070, true);  // in the air: no current
  t.run(200);
  EXPECT_EQ(t.world.heat().delivered, 0.0);
  t.input.tools[1] = hook(0.0, t.top(), true);
  t.run(1000);
  const auto heat = t.world.heat();
  ASSERT_GT(heat.delivered, 5.0);
  EXPECT_LE(heat.delivered, 30.0 * 1.0 + 1e-9) << "30 W for a second";
  EXPECT_NEAR(heat.delivered, heat.stored + heat.perfused + heat.surface + heat.latent,
              1e-6 * heat.delivered);
  EXPECT_GT(t.most(scene::Field::Temperature), 340.0f);
  EXPECT_GT(t.most(scene::Field::Damage), 0.9f) << "white under the hook";
  EXPECT_LT(t.least(scene::Field::Perfusion), 0.9f);
  const auto far = t.field(scene::Field::Damage);
  EXPECT_LT(far[2 * 8], 1e-6f) << "ring 2 is far away";
  t.input.tools[1] = hook(0.0, 0.090, false);
  t.run(20000);
  const auto later = t.world.heat();
  EXPECT_EQ(later.delivered, heat.delivered);
  EXPECT_GT(later.perfused, heat.perfused) << "blood carries heat away";
  EXPECT_LT(later.stored, 0.95 * heat.stored);
  EXPECT_NEAR(later.delivered, later.stored + later.perfused + later.surface + later.latent,
              1e-6 * later.delivered);
  double told = 0.0;
  for (const auto& e : t.events)
    if (e.kind == scene::EventKind::Coagulated) told += e.energy;
  EXPECT_NEAR(told, later.delivered, 1e-9 * told) << "events carry all of the energy";
}

TEST(Coagulation, BloodCoolsAKnotAsTheSceneSaysOfItAndNotAsItsObjectSays) {
  const auto carried = [](double object, std::optional<double> knots) {
    scene::Description d = specimen::tubeScene();
    d.objects[0].thermal.perfusion = object;
    if (knots) d.objects[0].knot_perfusion.assign(d.objects[0].rest_position.size(), *knots);
    Theatre t(d);
    t.input.tools[1] = hook(0.0, t.top(), true);
    t.run(1000);
    t.input.tools[1] = hook(0.0, 0.090, false);
    t.run(2000);
    const auto heat = t.world.heat();
    EXPECT_GT(heat.delivered, 5.0);
    return heat.perfused / heat.delivered;
  };
  EXPECT_LT(carried(0.02, 0.0), 1e-6) << "the last nanokelvins are booked as taken by blood";
  const double much = carried(0.02, std::nullopt);
  EXPECT_GT(much, 0.005);
  EXPECT_EQ(carried(0.005, 0.02), much);
}

TEST(Coagulation, TissueShrinksAndStiffensWhereItIsDenatured) {
  Theatre t;
  std::vector<float> before(3 * t.world.knotCount(0)), after(before.size());
  t.world.positions(0, before.data());
  t.input.tools[1] = hook(0.0, t.top(), true);
  t.run(1500);
  t.input.tools[1] = hook(0.0, 0.090, false);
  t.run(3000);
  t.world.positions(0, after.data());
  const auto damage = t.field(scene::Field::Damage);
  // Mean length of links whose ends are both denatured, over what it was.
  double shorter = 0.0, other = 0.0;
  int white = 0, red = 0;
  const auto length = [](const std::vector<float>& p, const scene::Link& l) {
    return std::hypot(p[3 * l.knot0] - p[3 * l.knot1], p[3 * l.knot0 + 1] - p[3 * l.knot1 + 1],
                      p[3 * l.knot0 + 2] - p[3 * l.knot1 + 2]);
  };
  for (const auto& l : t.world.topology(0).links) {
    const double ratio = length(after, l) / length(before, l);
    if (damage[l.knot0] > 0.9f && damage[l.knot1] > 0.9f) shorter += ratio, ++white;
    if (damage[l.knot0] < 0.1f && damage[l.knot1] < 0.1f) other += ratio, ++red;
  }
  ASSERT_GT(white, 0);
  ASSERT_GT(red, 0);
  EXPECT_LT(shorter / white, 0.93);
  EXPECT_NEAR(other / red, 1.0, 0.05);
}

// Protects the order of what a hook that stays does: white, then dry, then black.
TEST(Coagulation, AHookThatStaysWhitensDriesAndOnlyThenChars) {
  Theatre t;
  const double top = t.top();
  double white = 0.0, boiling = 0.0, black = 0.0, hottest = 0.0;
  for (int i = 0; i < 12000 && black == 0.0; ++i) {
    t.input.tools[1] = hook(0.0, top, true);
    t.step();
    if (i % 10 != 0) continue;
    const double now = 1e-3 * i, kelvin = t.most(scene::Field::Temperature);
    hottest = std::max(hottest, kelvin);
    if (white == 0.0 && t.most(scene::Field::Damage) > 0.95f) white = now;
    if (boiling == 0.0 && kelvin > 373.0) boiling = now;
    if (black == 0.0 && t.most(scene::Field::Char) > 0.5f) black = now;
    if (kelvin < interaction::kCharBegin && black == 0.0) {
      ASSERT_LT(t.most(scene::Field::Char), 0.5f) << "s " << now;
    }
  }
  std::printf("white %.2f s, boiling %.2f s, black %.2f s, %.0f K\n", white, boiling, black, hottest);
  EXPECT_GT(white, 0.0);
  EXPECT_GT(boiling, white) << "collagen denatures before water boils";
  EXPECT_GT(black, boiling + 0.3) << "the water of the first layer has to go";
  EXPECT_GT(hottest, interaction::kCharBegin);
  const auto heat = t.world.heat();
  EXPECT_GT(heat.latent, 0.0);
  EXPECT_NEAR(heat.delivered, heat.stored + heat.perfused + heat.surface + heat.latent,
              1e-6 * heat.delivered);
}

TEST(Coagulation, ForcepsSealAVesselAllAround) {
  Theatre t;
  for (int i = 0; i <= 400; ++i) {
    t.input.tools[1] = specimen::grasper(Vector3d(0, 0, 0.075 - 0.042 * i / 400), 0.87);
    t.input.tools[1].tool = tools::ToolKind::BipolarForceps;
    t.input.tools[1].pivot = Vector3d(0, 0, 0.17);
    t.step();
  }
  for (int i = 0; i <= 400; ++i) {
    t.input.tools[1].jaw = 0.87 - 0.82 * i / 400;
    t.step();
  }
  ASSERT_TRUE(t.report.contacts[1].grasping);
  t.input.tools[1].functions = tools::kFunctionCoagulate;
  bool sealed = false;
  double station = 0.0, energy = 0.0;
  for (int i = 0; i < 8000 && !sealed; ++i) {
    t.events.clear();
    t.step();
    for (const auto& e : t.events) {
      if (e.kind != scene::EventKind::Coagulated) continue;
      energy += e.energy;
      if (e.area == 0.0) sealed = true, station = e.station;
    }
  }
  ASSERT_TRUE(sealed);
  EXPECT_GT(station, 0.03);
  EXPECT_LT(station, 0.07);
  EXPECT_GT(energy, 1.0);
}

TEST(Coagulation, PowerFollowsTheParameterAndTheHashSeesHeat) {
  Theatre a, b;
  a.input.tools[1] = b.input.tools[1] = hook(0.0, a.top(), true);
  b.input.edits.push_back({"", "monopolar_power", 10.0});
  a.run(100);
  b.step();
  b.input.edits.clear();
  b.run(99);
  EXPECT_NEAR(b.world.heat().delivered, a.world.heat().delivered / 3.0, 1e-6);
  EXPECT_NE(a.world.stateHash(), b.world.stateHash());
  // A snapshot keeps the heat: both go on alike.
  std::vector<std::uint8_t> bytes;
  a.world.save(bytes);
  scene::World other(specimen::tubeScene(), 2);
  other.restore(bytes);
  EXPECT_EQ(other.stateHash(), a.world.stateHash());
  for (int i = 0; i < 300; ++i) {
    a.input.step = a.world.steps();
    a.world.step(a.input, a.report);
    other.step(a.input, b.report);
  }
  EXPECT_EQ(other.stateHash(), a.world.stateHash());
  EXPECT_GT(other.heat().delivered, 0.0);
}

TEST(Grasping, BeyondTheThresholdTissueIsDestroyedWithTimeAndBelowItNever) {
  for (const double threshold : {60e3, 1e9, 0.0}) {
    auto d = specimen::tubeScene();
    d.objects[0].grasp_damage_threshold = threshold;
    scene::World w(d);
    scene::StepInput input;
    scene::StepReport report;
    for (int i = 0; i <= 2800; ++i) {
      const double down = std::min(1.0, i / 400.0), shut = std::clamp((i - 400) / 400.0, 0.0, 1.0);
      input.tools[1] = specimen::grasper(Vector3d(0, 0, 0.075 - 0.035 * down), 1.0 - 0.99 * shut);
      input.tools[1].pivot = Vector3d(0, 0, 0.17);
      w.step(input, report);
    }
    ASSERT_TRUE(report.contacts[1].grasping);
    std::vector<float> damage(w.knotCount(0));
    w.field(0, scene::Field::Damage, damage.data());
    const float most = *std::max_element(damage.begin(), damage.end());
    if (threshold == 60e3) {
      EXPECT_GT(most, 0.05f);
      EXPECT_LT(most, 1.0f);
    } else {
      EXPECT_EQ(most, 0.0f);
    }
  }
}

}  // namespace
