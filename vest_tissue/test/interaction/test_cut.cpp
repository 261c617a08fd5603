#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "blades.h"
#include "theatre.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// Scissors from the front (+y) whose blades close along z in the plane x = at.
struct Theatre : test::Theatre {
  double greatest_torque = 0.0, greatest_force = 0.0;

  explicit Theatre(const scene::Description& d, int threads = 1) : test::Theatre(d, threads) {
    world.accountEnergy(true);
  }
  void step() {
    test::Theatre::step();
    greatest_torque = std::max(greatest_torque, report.contacts[1].jaw_torque);
    greatest_force = std::max(greatest_force, report.contacts[1].wrench.head<3>().norm());
  }
  void steps(int n) {
    for (int i = 0; i < n; ++i) step();
  }
  void scissors(double x, double y_tip, double z, double jaw) {
    input.tools[1] = specimen::toolAt(tools::ToolKind::Scissors, Vector3d(x, y_tip, z), Vector3d(0, 1, 0),
                                      Vector3d(0, 0, 1), jaw);
  }
  /// Comes with open blades, closes, and stays closed.
  void cut(double x, double y_tip, double z, int n = 150) {
    for (int i = 0; i < 60; ++i) scissors(x, y_tip - 0.02 * (1.0 - i / 60.0), z, 0.9), step();
    for (int i = 1; i <= n; ++i) scissors(x, y_tip, z, 0.9 * (1.0 - double(i) / n)), step();
  }
  void away() { input.tools[1].present = false; }
  double mass() const {
    const auto& b = world.state().objects[0].block;
    double sum = 0.0;
    for (std::size_t i = 0; i < b.knots(); ++i) sum += b.row(net::Block::kMass)[i];
    return sum;
  }
  std::size_t pieces() const {
    std::vector<std::uint32_t> part;
    return specimen::pieces(world, 0, part);
  }
};

/// Narrow enough for one bite.
specimen::BarOptions slim() {
  specimen::BarOptions o;
  o.rows = 3, o.spacing = 0.003, o.thickness = 0.003, o.mass = 0.003;
  return o;
}

scene::Description still(specimen::BarOptions o = slim()) {
  auto d = specimen::barScene(o);
  d.gravity.setZero();
  return d;
}

// The bar's cross-section that the blades divide, m².
constexpr double kWidth = 0.006, kThickness = 0.003, kLength = 0.048;
constexpr double kCut = 0.001, kDeep = 0.0095;  // m: between two columns of knots; the points beyond the bar

TEST(Cut, ScissorsDivideABarInTwoAndNoSpringCrossesTheCut) {
  Theatre t(still());
  const double mass = t.mass(), x = kCut;
  ASSERT_EQ(t.pieces(), 1u);
  t.cut(x, kDeep, 0.05);
  EXPECT_EQ(t.pieces(), 2u);
  EXPECT_EQ(t.count(scene::EventKind::Separated), 1u);
  EXPECT_EQ(t.mass(), mass) << "to the last bit, so within 1e-9";
  const scene::Object& o = t.world.description().objects[0];
  const scene::Topology& topology = t.world.topology(0);
  const auto left = [&](std::uint32_t k) {
    return o.rest_position[scene::originalKnot(topology, o.rest_position.size(), k)].x();
  };
  for (std::size_t i = 0; i < topology.links.size(); ++i) {
    if (!topology.link_alive[i]) continue;
    const double a = left(topology.links[i].knot0), b = left(topology.links[i].knot1);
    EXPECT_FALSE(std::min(a, b) < x - 0.003 && std::max(a, b) > x + 0.003) << "link " << i;
    EXPECT_NEAR(
        topology.links[i].rest,
        (o.rest_position[scene::originalKnot(topology, o.rest_position.size(), topology.links[i].knot0)] -
         o.rest_position[scene::originalKnot(topology, o.rest_position.size(), topology.links[i].knot1)])
            .norm(),
        1e-9)
        << "the rest shape is kept";
  }
  t.away();
  t.steps(300);
  for (const float v : specimen::skinNow(t.world, 0)) ASSERT_TRUE(std::isfinite(v));
}

TEST(Cut, WorkIsToughnessTimesTheAreaThatWasCut) {
  Theatre t(still());
  t.cut(kCut, kDeep, 0.05);
  double area = 0.0, energy = 0.0;
  for (const auto& e : t.events) {
    if (e.kind != scene::EventKind::Cut) continue;
    EXPECT_GT(e.area, 0.0);
    EXPECT_NEAR(e.energy, 164.0 * e.area, 1e-12);
    EXPECT_EQ(e.instrument, 1);
    area += e.area, energy += e.energy;
  }
  // Volume over surface of this bar times its girdle; a bar much longer than thick would give its
  // cross-section. Either way the blades went once through everything.
  const double solid =
      kLength * kWidth * kThickness / (2 * (kLength * kWidth + kLength * kThickness + kWidth * kThickness));
  EXPECT_NEAR(area, solid * 2 * (kWidth + kThickness), 0.1 * area);
  EXPECT_NEAR(t.world.state().objects[0].cut.energy, energy, 1e-12);
  EXPECT_GT(t.greatest_torque, 1e-4) << "the hand feels it";
  EXPECT_LT(t.greatest_torque, 0.1);
  t.steps(20);
  EXPECT_EQ(t.report.contacts[1].jaw_torque, 0.0) << "and not any more when it is through";
}

TEST(Cut, APartThatNothingHoldsFallsAway) {
  specimen::BarOptions o = slim();
  o.fix_right = false, o.youngs_modulus = 1e6;
  Theatre t(specimen::barScene(o));
  t.cut(kCut, kDeep, 0.05, 60);
  t.away();
  t.steps(250);
  std::vector<std::uint32_t> part;
  ASSERT_EQ(specimen::pieces(t.world, 0, part), 2u);
  std::vector<float> p(3 * t.world.knotCount(0));
  t.world.positions(0, p.data());
  double lowest_held = 1.0, highest_free = -1.0;
  for (std::size_t i = 0; i < part.size(); ++i) {
    double& bound = part[i] == part[0] ? lowest_held : highest_free;
    bound =
        part[i] == part[0] ? std::min(bound, double(p[3 * i + 2])) : std::max(bound, double(p[3 * i + 2]));
  }
  EXPECT_LT(highest_free, -0.1) << "0.25 s of free fall";
  EXPECT_GT(lowest_held, 0.0);
}

TEST(Cut, HalfACutStaysHalfAndCanBeGoneOnWith) {
  Theatre t(still());
  t.cut(kCut, 0.0005, 0.05);  // the blades' points reach the middle of the bar
  EXPECT_EQ(t.pieces(), 1u);
  EXPECT_EQ(t.count(scene::EventKind::Separated), 0u);
  const double half = t.world.state().objects[0].cut.area;
  EXPECT_GT(half, 0.0);
  EXPECT_GT(t.world.knotCount(0), t.world.description().objects[0].position.size()) << "it gapes";
  t.steps(100);
  EXPECT_EQ(t.world.state().objects[0].cut.area, half) << "closed blades at rest cut nothing";
  for (int i = 0; i < 60; ++i) t.scissors(kCut, 0.0005 - 0.02 * i / 60.0, 0.05, 0.0), t.step();
  t.cut(kCut, kDeep, 0.05);
  EXPECT_EQ(t.pieces(), 2u);
  EXPECT_EQ(t.count(scene::EventKind::Separated), 1u);
}

TEST(Cut, OpenBladesAndAHookWithoutCurrentDivideNothing) {
  Theatre t(still());
  for (int i = 0; i < 100; ++i) t.scissors(kCut, -0.02 + 0.0003 * i, 0.05, 0.7), t.step();
  for (int i = 0; i < 50; ++i) t.scissors(kCut, 0.01, 0.05, 0.7 + 0.002 * i), t.step();
  EXPECT_EQ(t.world.revision(), 0u);
  t.away();
  t.step();
  for (const bool on : {false, true}) {
    for (int i = 0; i < 400; ++i) {  // the foot of the hook comes down through the bar
      auto& tool = t.input.tools[1] =
          specimen::toolAt(tools::ToolKind::CoagulationHook, Vector3d(kCut, -0.012, 0.060 - 5e-5 * i),
                           Vector3d(0, 1, 0), Vector3d(0, 0, 1));
      tool.functions = on ? tools::kFunctionCut : 0u;
      t.step();
    }
    EXPECT_EQ(t.world.revision() > 0, on);
    t.away();
    t.steps(300);
  }
  EXPECT_GT(t.count(scene::EventKind::Cut), 0u);
}

TEST(Cut, EnergyIsAccountedForThroughACut) {
  Theatre t(specimen::barScene(slim()));
  t.steps(300);
  const auto before = t.world.energy();
  t.cut(kCut, kDeep, 0.048);
  t.away();
  t.steps(1000);
  const auto after = t.world.energy();
  const double gone = before.kinetic + before.elastic + before.potential + (after.work - before.work) -
                      (after.dissipated - before.dissipated) - after.kinetic - after.elastic -
                      after.potential;
  const double moved = std::fabs(before.potential - after.potential) + (after.work - before.work);
  EXPECT_GT(after.work - before.work, 1e-3);
  EXPECT_GT(gone, -0.02 * moved) << "nothing is won by cutting";
  EXPECT_LT(gone, 0.10 * moved) << "springs that died take a little along";
}

TEST(Cut, SnapshotThreadsAndKernelLevelGiveTheSameBits) {
  std::vector<std::uint64_t> hashes;
  std::vector<std::uint8_t> middle;
  const auto script = [](Theatre& t, int from, int to) {
    for (int i = from; i < to; ++i) {
      t.scissors(kCut, i < 100 ? kDeep - 0.0002 * (100 - i) : kDeep, 0.049,
                 i < 100 ? 0.9 : 0.9 * (1 - (i - 100) / 120.0));
      t.step();
    }
  };
  for (const int threads : {1, 2, 4}) {
    Theatre t(specimen::barScene(slim()), threads);
    script(t, 0, 160);
    if (threads == 1) t.world.save(middle);
    script(t, 160, 240);
    ASSERT_GT(t.world.revision(), 0u);
    hashes.push_back(t.world.stateHash());
  }
  {
    Theatre t(specimen::barScene(slim()));
    t.world.restore(middle);
    script(t, 160, 240);
    hashes.push_back(t.world.stateHash());
  }
  setenv("VEST_KERNEL", "baseline", 1);
  {
    Theatre t(specimen::barScene(slim()));
    EXPECT_EQ(t.world.kernelLevel(), "baseline");
    script(t, 0, 240);
    hashes.push_back(t.world.stateHash());
    t.world.reset();
    script(t, 0, 240);
    hashes.push_back(t.world.stateHash());
  }
  unsetenv("VEST_KERNEL");
  for (const auto h : hashes) EXPECT_EQ(h, hashes[0]);
}

TEST(Cut, AnchorsGoWithTheirSideAndAConnectionUnderTheBladeComesLoose) {
  auto d = still();
  specimen::BarOptions o = slim();
  o.centre = Vector3d(0, 0, 0.09);
  o.bulk_modulus = 0.0;
  d.objects.push_back(specimen::bar(o));
  d.objects[1].name = "other";
  for (const int column : {8, 9, 2}) {  // on the cut's left, on its right; and one that another blade meets
    scene::Connection c;
    c.object0 = "bar", c.object1 = "other";
    const auto top = static_cast<scene::Index>(51 + 17 + column);
    c.knot0 = top;
    c.triangle1 = {static_cast<scene::Index>(17 + column), static_cast<scene::Index>(2 * 17 + column),
                   static_cast<scene::Index>(2 * 17 + column + 1)};
    c.weights1 = {0.6, 0.2, 0.2};
    Vector3d p = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) p += c.weights1[k] * d.objects[1].position[c.triangle1[k]];
    c.offset = d.objects[0].position[top] - p;
    c.stiffness = 1.0, c.damping = 0.001;
    d.connections.push_back(c);
  }
  Theatre t(d);
  t.cut(kCut, kDeep, 0.05);
  ASSERT_EQ(t.pieces(), 2u);
  std::vector<std::uint32_t> part;
  specimen::pieces(t.world, 0, part);
  const auto& links = t.world.state().connections;
  EXPECT_EQ(part[links[1].end0.knots[0]], part[16]) << "right of the cut";
  EXPECT_EQ(part[links[2].end0.knots[0]], part[0]) << "left of it";
  EXPECT_TRUE(links[2].alive);
  t.away();
  t.step();
  t.cut(-0.0177, kDeep, 0.07);  // between the bars, where the third connection runs
  EXPECT_FALSE(t.world.state().connections[2].alive);
  EXPECT_TRUE(t.world.state().connections[1].alive);
}

TEST(Cut, ThinSheetsStopACapsuleAtOneMetrePerSecondFromBothSides) {
  for (const double side : {1.0, -1.0}) {
    specimen::BarOptions o;
    o.thickness = 0.0012, o.rows = 9, o.bulk_modulus = 0.0, o.mass = 0.004;
    Theatre t(still(o));
    const auto place = [&](double z) {
      // A shaft along y over the sheet's whole width.
      t.input.tools[0] = specimen::toolAt(tools::ToolKind::SuctionIrrigator, Vector3d(0.001, 0.06, z),
                                          Vector3d(0, 1, 0), Vector3d(0, 0, 1));
      t.input.tools[0].pivot = Vector3d(0.001, -0.10, z);
    };
    place(0.05 + side * 0.012);
    t.steps(30);
    for (int i = 0; i < 24; ++i) place(0.05 + side * (0.012 - 0.001 * i)), t.step();  // 1 m/s, 12 mm beyond
    place(0.05 - side * 0.011);
    t.steps(100);
    std::vector<float> p(3 * t.world.knotCount(0));
    t.world.positions(0, p.data());
    double most = -1.0;  // how far towards the shaft's origin a knot under it still is
    for (std::size_t i = 0; i < t.world.knotCount(0); ++i)
      if (std::fabs(p[3 * i] - 0.001) < 0.003) most = std::max(most, side * (p[3 * i + 2] - 0.05));
    EXPECT_LT(most, -0.011 - 0.0015) << "the sheet was pushed in front of the shaft, side " << side;
    EXPECT_LT(side * -t.report.contacts[0].wrench[2], 0.0) << "and pushes back";
  }
}

}  // namespace
