#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "vest_bringup/simulation/operating_field.h"
#include "vest_bringup/simulation/trainer.h"
#include "vest_tissue/scene/world_state.h"

// Protects the coupling of pools and tissue in the Trainer: a stretched membrane sags under what is poured on
// it as hydrostatics says, its ends bear the liquid gram for gram, it comes to rest and stays there, and the
// State is the same for any threads and from what was recorded.

namespace vest::simulation {
namespace {

constexpr double kGravity = 9.81, kWater = 1000;
constexpr double kHalf = 0.04, kWide = 0.024;  // m
constexpr double kMass = 0.2;                  // kg/m²: a membrane of 0.2 mm
constexpr int kAlong = 41, kAcross = 7;

/// A strip along x, held at both ends and stretched to twice its length, so that its tension hardly changes.
/// Beside it is no ground: water stands on it as in a trough. @param tension N/m
scene::Description membrane(double tension) {
  scene::Description d;
  d.name = "membrane", d.hash = "0000000000000003";
  d.objects.emplace_back();
  scene::Object& o = d.objects.back();
  o.name = "membrane";
  o.law.youngs_modulus = 1e4;
  const double dx = 2 * kHalf / (kAlong - 1), dy = kWide / (kAcross - 1);
  const auto at = [](int i, int j) { return static_cast<scene::Index>(j * kAlong + i); };
  const auto half = [](int k, int count) { return k == 0 || k == count - 1 ? 0.5 : 1.0; };
  for (int j = 0; j < kAcross; ++j) {
    for (int i = 0; i < kAlong; ++i) {
      o.position.emplace_back(-kHalf + dx * i, -0.5 * kWide + dy * j, 0.05);
      o.mass.push_back(kMass * dx * dy * half(i, kAlong) * half(j, kAcross));
      o.damping.push_back(60 * o.mass.back());  // 1/s: slow against its first wave
      o.fixed.push_back(i == 0 || i == kAlong - 1);
    }
  }
  o.rest_position = o.position;
  const auto link = [&](scene::Index a, scene::Index b, double length, double rest, double stiffness) {
    scene::Link l;
    l.knot0 = a, l.knot1 = b, l.rest = rest * length, l.stiffness = stiffness / l.rest;
    l.damping = 1e-5;
    o.links.push_back(l);
  };
  for (int j = 0; j < kAcross; ++j) {
    for (int i = 0; i < kAlong; ++i) {
      if (i + 1 < kAlong) link(at(i, j), at(i + 1, j), dx, 0.5, tension * dy * half(j, kAcross));
      if (j + 1 < kAcross) link(at(i, j), at(i, j + 1), dy, 1.0, tension * dx);
      if (i + 1 == kAlong || j + 1 == kAcross) continue;
      o.contact_triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      o.contact_triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return d;
}

struct Sheet {
  Trainer trainer;
  OperatingField* field;
  scene::StepReport report;
  scene::StepInput tools;
  double load = 0;  ///< N, downwards: what the last input told
  std::vector<scene::StepInput> recorded;
  bool record = false;

  explicit Sheet(double tension, int threads = 1) : trainer(scene::World(membrane(tension), threads)) {
    FieldOptions o;
    o.irrigation_flow = 2e-6;
    auto effect = std::make_unique<OperatingField>(trainer.world(), o, nullptr);
    field = effect.get();
    trainer.add(std::move(effect));
    auto& tool = tools.tools[static_cast<std::size_t>(tools::Instrument::Right)];
    tool.present = true, tool.tool = tools::ToolKind::SuctionIrrigator;
    tool.pivot = {0, 0, 0.2}, tool.position = {0.001, 0.001, 0.065};
    tool.orientation = Eigen::Quaterniond(0, 1, 0, 0);  // down
  }
  void run(double seconds, bool irrigate = false) {
    for (int n = static_cast<int>(seconds / 0.001 + 0.5); n > 0; --n) {
      scene::StepInput input = tools;
      input.step = trainer.world().steps() + 1;
      input.tools[static_cast<std::size_t>(tools::Instrument::Right)].functions =
          irrigate ? tools::kFunctionIrrigate : 0u;
      EXPECT_EQ(trainer.step(input, report), scene::Status::Ok);
      if (record) recorded.push_back(input);
      if (!(input.load_over > 0)) continue;
      load = 0;
      for (const auto& l : input.loads) load -= static_cast<double>(l.force[2]);
    }
  }
  double pool() const { return fluid::poolVolume(field->fluidModel(), field->fluid()); }
  /// m³ of it with tissue under it: where the sheet has swung away the old bed holds what stands there.
  double borne() const {
    const fluid::Pools& w = field->fluid().pools;
    double sum = 0;
    for (std::size_t i = 0; i < w.depth.size(); ++i)
      if (w.bed_triangle[i] >= 0) sum += static_cast<double>(w.depth[i]);
    return sum * std::pow(field->fluidModel().parameters.pool_cell, 2);
  }
  double sag() const {
    const auto middle = static_cast<std::size_t>((kAcross / 2) * kAlong + kAlong / 2);
    return 0.05 - trainer_world().knotAt(0, middle).z();
  }
  const scene::World& trainer_world() const { return const_cast<Sheet*>(this)->trainer.world(); }
  double kinetic() const { return trainer_world().energy().kinetic; }
};

/// Sag of the middle under a volume V that covers all of it: T z'' = rho g d + m g with a level top, so that
/// d + c = A cos(kx), k² = rho g/T, c = m/rho. Without water's following of the sag it would be k²a²/2 (V/2aw
/// + c).
double hydrostaticSag(double volume, double tension) {
  const double c = kMass / kWater, k = std::sqrt(kWater * kGravity / tension);
  const double most = (0.5 * volume / kWide + c * kHalf) * k / std::sin(k * kHalf);
  return most * (1 - std::cos(k * kHalf));
}

TEST(Impacts, NoKnotOutrunsTheFluidThatStrikesIt) {
  Sheet s(2.0);  // slack: nothing but its own weight, a twentieth of the drops', holds a knot back
  double fastest = 0, fluid = 0;
  for (int n = 0; n < 300; ++n) {
    s.run(0.001, true);
    const fluid::Particles& q = s.field->fluid().particles;
    for (std::size_t i = 0; i < q.count; ++i)
      fluid = std::max<double>(fluid, std::hypot(q.vx[i], q.vy[i], q.vz[i]));
    std::vector<float> v(3 * s.trainer.world().knotCount(0));
    s.trainer.world().velocities(0, v.data());
    for (std::size_t k = 0; k < v.size(); k += 3)
      fastest = std::max<double>(fastest, std::hypot(v[k], v[k + 1], v[k + 2]));
  }
  EXPECT_GT(fluid, 0.3) << "m/s: the jet has come down";
  EXPECT_GT(fastest, 0.05) << "m/s: and was felt";
  EXPECT_LT(fastest, 1.1 * fluid) << "m/s: else it gives more energy than it has";
}

TEST(PoolWeight, AMembraneSagsAsHydrostaticsSaysAndItsEndsBearTheLiquid) {
  // As soft as this, water that follows the sag doubles it; at k²a² = 2.5 it would run off to one place.
  const double tension = kWater * kGravity * kHalf * kHalf / 1.44;
  Sheet s(tension);
  s.run(3.0);
  const double dry = s.trainer_world().reaction(0).z(),
               own = 0.5 * kMass * kGravity * kHalf * kHalf / tension;
  EXPECT_NEAR(s.sag(), own, 0.03 * own) << "its own weight";
  s.run(2.0, true);
  s.run(20.0);
  const double weight = kWater * kGravity * s.pool();
  EXPECT_NEAR(s.pool(), s.field->fluid().emitted, 0.01 * s.field->fluid().emitted) << "all lies there";
  EXPECT_NEAR(s.load, weight, 0.01 * weight) << "what is told";
  EXPECT_NEAR(s.trainer_world().reaction(0).z() - dry, weight, 0.01 * weight) << "what the ends bear";
  const double expected = hydrostaticSag(s.pool(), tension);
  std::printf("%.3f ml: sags %.3f mm, hydrostatics says %.3f mm\n", 1e6 * s.pool(), 1e3 * s.sag(),
              1e3 * expected);
  EXPECT_NEAR(s.sag(), expected, 0.05 * expected) << "cells of 4 mm";
}

TEST(PoolWeight, ItComesToRestAndStaysThere) {
  Sheet s(kWater * kGravity * kHalf * kHalf / 1.44);
  s.run(1.0);
  s.run(2.0, true);
  s.run(10.0);
  double most = 0;
  const double sag = s.sag();
  for (int second = 0; second < 60; ++second) {
    for (int part = 0; part < 20; ++part) {
      s.run(0.05);
      most = std::max(most, s.kinetic());
    }
  }
  // J: what the liquid gave up when it lowered the membrane.
  const double given = kWater * kGravity * s.pool() * sag;
  std::printf("greatest kinetic energy in a minute %.2e J of %.2e J\n", most, given);
  EXPECT_LT(most, 1e-4 * given);
  EXPECT_NEAR(s.sag(), sag, 0.01 * sag);
}

TEST(PoolWeight, ASheetTooSlackToHoldAPoolComesToRest) {
  // Beyond k²a² = 2.5 a pool draws together what it has, where the sheet gives way most. It must not work up,
  // and must come to rest: what it bears does not come and go as its knots cross the pool's cells.
  const double tension = kWater * kGravity * kHalf * kHalf / 4.0;
  Sheet s(tension);
  s.run(1.0);
  s.run(1.0, true);
  s.run(10.0);
  double most = 0, deepest = 0, load = 0, weight = 0;
  for (int part = 0; part < 1200; ++part) {
    s.run(0.05);
    most = std::max(most, s.kinetic()), deepest = std::max(deepest, std::fabs(s.sag()));
    load += s.load / 1200, weight += kWater * kGravity * s.borne() / 1200;
  }
  const double given = kWater * kGravity * s.pool() * deepest;
  std::printf("slack: kinetic energy at most %.2e J of %.2e J; greatest sag %.2f mm\n", most, given,
              1e3 * deepest);
  std::printf("slack: load %.2f mN of a weight of %.2f mN upon it\n", 1e3 * load, 1e3 * weight);
  EXPECT_LT(most, 2e-3 * given) << "at rest: all that the liquid can give is 1";
  // m: what all of it in the middle, and the sheet's own weight, would draw it down
  const double furthest = 0.5 * kGravity * kHalf / tension * (kWater * s.pool() / kWide + kMass * kHalf);
  EXPECT_LT(deepest, furthest);
  EXPECT_GT(load, 0.98 * weight) << "what has tissue under the middle of its cell";
  EXPECT_LT(load, 1.001 * kWater * kGravity * s.pool()) << "and no more than there is beside";
}

TEST(PoolWeight, SameBitsForAnyThreadsAndFromWhatWasRecorded) {
  Sheet one(10.0, 1), three(10.0, 3);
  for (Sheet* s : {&one, &three}) s->record = true, s->run(0.5, true), s->run(0.5);
  EXPECT_EQ(one.trainer.world().stateHash(), three.trainer.world().stateHash());
  EXPECT_EQ(one.trainer.effectsHash(), three.trainer.effectsHash());
  scene::World again(membrane(10.0));
  for (const auto& input : one.recorded) again.step(input, one.report);
  EXPECT_EQ(again.stateHash(), one.trainer.world().stateHash()) << "the tissue alone";
  std::vector<std::uint8_t> bytes, a, b;
  one.trainer.save(bytes);
  three.trainer.restore(bytes);
  one.run(0.2), three.run(0.2);
  one.trainer.save(a), three.trainer.save(b);
  EXPECT_TRUE(a == b) << "from a snapshot";
}

TEST(PoolWeight, WhenTheFieldIsEmptiedTheTissueIsRelieved) {
  Sheet s(10.0);
  std::vector<std::uint8_t> world;
  s.run(0.5, true);
  s.run(0.5);
  ASSERT_TRUE(s.trainer_world().state().objects[0].load.any);
  s.trainer.world().save(world);
  s.trainer.restore(world);  // of the tissue alone: the effects begin anew
  s.run(0.2);
  EXPECT_FALSE(s.trainer_world().state().objects[0].load.any);
}

}  // namespace
}  // namespace vest::simulation
