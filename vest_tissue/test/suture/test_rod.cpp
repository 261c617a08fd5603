// Rods against what is in print: the solver is the one that runs at 1 ms.
#include <gtest/gtest.h>

#include <cmath>

#include "rods.h"

namespace vest::suture::test {

using namespace specimen;
namespace {

using Eigen::Vector3d;

/// Tip of a clamped elastica of length 1 under a dead load F across, EI = 1: θ″ = −F·cos θ from the tip's
/// angle inwards, found by bisection.
Vector3d elasticaTip(double force) {
  double low = 0.0, high = 0.5 * kPi, x = 0.0, y = 0.0;
  for (int k = 0; k < 60; ++k) {
    double angle = 0.5 * (low + high), slope = 0.0;
    const double ds = 1.0 / 4000;
    x = y = 0.0;
    for (int i = 0; i < 4000; ++i) {  // midpoint rule
      const double middle = angle + 0.5 * ds * slope, rate = slope - 0.5 * ds * force * std::cos(angle);
      x += ds * std::cos(middle), y += ds * std::sin(middle);
      slope -= ds * force * std::cos(middle);
      angle += ds * rate;
    }
    (angle > 0.0 ? high : low) = 0.5 * (low + high);
  }
  return {x, 0.0, -y};
}

Moving cantilever(Index segments, double force) {
  RodDescription rod = straight(segments);
  rod.held.push_back({0, Hold::Frame, {}});
  rod.loads.push_back({segments, {0.0, 0.0, -force}});
  return Moving(rod);
}

TEST(Rod, ElasticaWithinHalfAPercentAndOfSecondOrder) {
  const Vector3d tip = elasticaTip(5.0);
  double last = 0.0;
  for (const Index segments : {20u, 40u}) {
    Moving m = cantilever(segments, 5.0);
    ASSERT_TRUE(m.settle());
    const double error = (m.state.position.back() - tip).norm();
    EXPECT_LT(error, 0.005) << segments;
    if (segments == 40u) {
      EXPECT_LT(error, 0.3 * last);
      EXPECT_NEAR(m.scratch.reactions[0].force.z(), 5.0, 1e-6);
      EXPECT_NEAR(m.scratch.reactions[0].moment.y(), -5.0 * tip.x(), 0.01);
    }
    last = error;
  }
}

TEST(Rod, StepsEndInTheStaticShape) {
  Moving still = cantilever(20, 5.0);
  ASSERT_TRUE(still.settle());
  RodDescription rod = straight(20);
  rod.held.push_back({0, Hold::Frame, {}});
  rod.loads.push_back({20, {0.0, 0.0, -5.0}});
  rod.section.damping = 5.0;
  Moving damped(rod);
  damped.run(0.01, 600);
  for (std::size_t i = 0; i < still.state.position.size(); ++i)
    EXPECT_LT((damped.state.position[i] - still.state.position[i]).norm(), 1e-5) << i;
}

TEST(Rod, ColumnBucklesAtEulersLoad) {
  for (const double share : {0.98, 1.02}) {
    RodDescription rod = straight(40);
    rod.held.push_back({0, Hold::Frame, {}});
    rod.loads.push_back({40, {-share * kPi * kPi / 4.0, 0.0, 0.0}});
    Moving m(rod);
    ASSERT_TRUE(m.settle());
    const Vector3d tip = m.state.position.back();
    const double aside = std::hypot(tip.y(), tip.z());
    if (share < 1.0)
      EXPECT_LT(aside, 1e-6);
    else
      EXPECT_GT(aside, 0.1);
  }
}

TEST(Rod, TwistedRingLeavesItsPlaneAtMichellsTurn) {
  // Flat ring that is straight by nature: 2π·√3·EI/GJ (Michell 1889; Goriely 2006, J. Elasticity 84).
  for (const double share : {0.97, 1.03}) {
    RodDescription rod = straight(4);
    rod.nodes.clear();
    constexpr Index kNodes = 40;
    for (Index i = 0; i < kNodes; ++i) {
      const double a = 2.0 * kPi * i / kNodes;
      rod.nodes.push_back({std::cos(a), std::sin(a), 1e-3 * std::cos(2.0 * a)});
    }
    rod.closed = true;
    rod.turn = share * 2.0 * kPi * std::sqrt(3.0) / rod.section.twist;
    Moving m(rod);
    double high = 0.0;
    for (int k = 0; k < 25;
         ++k) {  // it grows out of the plane; without contact it then passes through itself
      m.run(0.05, 20);
      for (const Vector3d& x : m.state.position) high = std::max(high, std::abs(x.z()));
    }
    if (share < 1.0)
      EXPECT_LT(high, 0.01);
    else
      EXPECT_GT(high, 0.05);
  }
}

TEST(Rod, HangingChainSwingsAsBesselSays) {
  // ω_k = j₀,ₖ/2·√(g/L), the period of the first mode by its zero crossings; no bending to speak of.
  RodDescription rod = straight(40);
  for (Vector3d& x : rod.nodes) x = {0.0, 0.0, -0.1 * x.x()};
  rod.section.linear_density = 5e-5, rod.section.radius = 1e-4, rod.section.stretch = 100.0;
  rod.section.shear = 40.0, rod.section.bend = 1e-12, rod.section.twist = 1e-12;
  rod.held.push_back({0, Hold::Place, {}});
  Moving m(rod, {0.0, 0.0, -9.81});
  ASSERT_TRUE(m.settle());
  // The shape of the mode: J₀(j·√s), s from the free end, by its series.
  constexpr double kZero = 2.404825557695773;
  for (std::size_t i = 0; i < m.state.position.size(); ++i) {
    const double from_below = 1.0 - static_cast<double>(i) / 40.0;
    double bessel = 1.0, part = 1.0;
    for (int k = 1; k < 20; ++k) part *= -0.25 * kZero * kZero * from_below / (k * k), bessel += part;
    m.state.velocity[i].x() = 0.02 * bessel;
  }
  double last = 0.0, first_crossing = 0.0, crossing = 0.0;
  int crossings = 0;
  for (int k = 1; k <= 1500; ++k) {
    m.run(0.001, 1);
    const double x = m.state.position.back().x();
    if (k > 1 && (x > 0.0) != (last > 0.0)) {
      crossing = 0.001 * (k - x / (x - last));
      if (crossings++ == 0) first_crossing = crossing;
    }
    last = x;
  }
  ASSERT_GE(crossings, 3);
  const double period = 2.0 * (crossing - first_crossing) / (crossings - 1);
  EXPECT_NEAR(period, 2.0 * kPi / (0.5 * kZero * std::sqrt(9.81 / 0.1)), 0.01 * period);
}

TEST(Rod, EnergyOfATwistedBentRodThatIsLetGoFalls) {
  RodDescription rod = straight(40);
  for (std::size_t i = 0; i < rod.nodes.size(); ++i) {
    const double a = 0.05 * static_cast<double>(i);
    rod.nodes[i] = {0.5 * std::sin(a), 0.5 * std::cos(a), 0.01 * static_cast<double>(i)};
  }
  rod.turn = 6.0;
  Moving m(rod);
  double last = energy(m.model, m.state);
  for (int k = 0; k < 300; ++k) {
    ASSERT_EQ(step(m.model, m.state, m.scratch, 0.001), StepStatus::Ok);
    const double now = energy(m.model, m.state);
    EXPECT_LE(now, last * (1.0 + 1e-6) + 1e-9) << k;
    last = now;
  }
}

TEST(Rod, YankedRodIsItsLengthAgainSoonAfter) {
  // 1 m/s sideways and along, there and back: a suture of 1 mm segments.
  RodDescription rod = straight(100);
  for (Vector3d& x : rod.nodes) x *= 0.1;
  rod.section = solidSection(1e-4, 1000, 2e9, 0.4);
  rod.section.strain_damping = 1e-4, rod.section.drag = 1e-4;
  rod.held = {{0, Hold::Frame, {{0, {0, 0, 0}, 0}, {0.02, {0.006, 0.018, 0}, 0}, {0.04, {0.006, 0, 0}, 0}}}};
  Moving m(rod, {0, 0, -9.81});
  for (int k = 0; k < 100; ++k) {
    ASSERT_NE(step(m.model, m.state, m.scratch, 0.001), StepStatus::Fault);
    for (Index i = 0; i < 100 && k >= 60; ++i)  // where it whips upon itself, a step may stretch it more
      EXPECT_LT((m.state.position[i + 1] - m.state.position[i]).norm(), 1.02 * m.model.length[i]) << k;
  }
}

TEST(Rod, ManyTurnsOfAHeldEndGiveTheMomentOfTheWholeTwist) {
  RodDescription rod = straight(20);
  rod.section.bend = 100.0;  // does not buckle
  rod.held = {{0, Hold::Frame, {}}, {20, Hold::Frame, {{0, {1, 0, 0}, 0}, {1, {1, 0, 0}, 25.0}}}};
  Moving m(rod);
  ASSERT_TRUE(m.settle());
  EXPECT_NEAR(m.scratch.reactions[1].moment.x(), 25.0 * 0.7, 0.02);
  EXPECT_NEAR(m.scratch.reactions[0].moment.x(), -25.0 * 0.7, 0.02);
}

TEST(Rod, ReactionsOfAHangingRodCarryItsWeight) {
  RodDescription rod = straight(20);
  rod.held = {{0, Hold::Place, {}}, {20, Hold::Place, {}}};
  Moving m(rod, {0, 0, -9.81});
  ASSERT_TRUE(m.settle());
  EXPECT_NEAR(m.scratch.reactions[0].force.z() + m.scratch.reactions[1].force.z(), 9.81, 1e-6);
  EXPECT_EQ(m.scratch.reactions[0].moment, Vector3d::Zero());
}

TEST(Rod, AbsurdRodsAreRefusedByName) {
  const auto refused = [](const RodDescription& rod, const std::string& word) {
    try {
      Moving m(rod);
      ADD_FAILURE() << word << ": accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find("'rod'"), std::string::npos) << error.what();
    }
  };
  RodDescription rod = straight(10);
  rod.section.bend = std::nan("");
  refused(rod, "bend");
  rod = straight(10);
  rod.nodes[4] = rod.nodes[3];
  refused(rod, "length of the segment from node 3");
  rod = straight(10);
  rod.nodes[4] = rod.nodes[2];
  refused(rod, "bend at node");
  rod = straight(10);
  rod.held = {{11, Hold::Place, {}}};
  refused(rod, "held: node");
  rod = straight(1);
  refused(rod, "nodes");
}

}  // namespace
}  // namespace vest::suture::test
