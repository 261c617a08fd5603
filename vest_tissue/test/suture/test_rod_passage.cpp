// Nothing leads a thread through itself or another. What tells is the motion of the nodes alone, not
// contacts.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <tuple>

#include "crossings.h"
#include "knots.h"

namespace vest::suture::test {

using namespace specimen;
namespace {

using Eigen::Vector3d;

/// Jaws: nodes that hang from places which move.
struct Jaws {
  std::vector<Index> nodes;
  std::vector<Vector3d> at;
  Vector3d velocity = Vector3d::Zero();  ///< m/s
  bool closed = true;
};

struct Room : Moving {
  explicit Room(const Description& d) : Moving(d) {}
  std::vector<Jaws> hands;
  Vector3d pulled = Vector3d::Zero();  ///< N, by the last hand

  void hold(std::vector<Index> nodes) {
    Jaws j;
    for (const Index i : nodes) j.nodes.push_back(i), j.at.push_back(state.position[i]);
    hands.push_back(j);
  }
  StepStatus go(double h) {
    scratch.supports.clear();
    for (Jaws& j : hands) {
      if (!j.closed) continue;
      for (std::size_t k = 0; k < j.nodes.size(); ++k) {
        Support a;
        a.bond = Bond::Hold;
        const Strand* strand = &model.strands[0];
        while (j.nodes[k] >= strand->first + strand->nodes) ++strand;
        const bool last = j.nodes[k] == strand->first + strand->nodes - 1;
        a.segment = last ? j.nodes[k] - 1 : j.nodes[k], a.s = last ? 1.0 : 0.0;
        a.from = j.at[k], a.to = j.at[k] += h * j.velocity;
        a.stiffness = 5000.0 / static_cast<double>(j.nodes.size());
        scratch.supports.push_back(a);
      }
    }
    const StepStatus status = step(model, state, scratch, h);
    pulled.setZero();
    if (!hands.empty() && hands.back().closed)
      for (std::size_t k = 0; k < hands.back().nodes.size(); ++k)
        pulled += scratch.supports[scratch.supports.size() - 1 - k].force;
    return status;
  }
};

/// The second thread lies round the first one as a U; jaws hold the first one beside it and draw both legs.
struct Turn {
  double length, beside, speed;  // m, of a segment, m/s
  Index held;
};

TEST(RodPassage, ATurnDrawnAgainstWhereJawsHoldTheOtherStrandStaysOutside) {
  for (const Turn& c : {Turn{0.00075, 0.6, 0.05, 6}, Turn{0.00075, 0.0, 0.5, 6}, Turn{0.00075, 0.6, 0.5, 1},
                        Turn{0.000375, 0.6, 0.5, 3}}) {
    constexpr double kRound = 0.0012, kHalf = 0.5 * kPi * kRound;
    RodDescription a = straight(40), b = straight(60);
    for (Vector3d& x : a.nodes) x = {c.length * 40 * (x.x() - 0.5), 0.0, 0.0};
    for (int i = 0; i <= 60; ++i) {
      const double at = c.length * (i - 30), turn = std::clamp(at, -kHalf, kHalf) / kRound;
      b.nodes[static_cast<std::size_t>(i)] = {c.beside * c.length, kRound * std::sin(turn),
                                              std::max(0.0, std::abs(at) - kHalf) - kRound * std::cos(turn)};
    }
    b.name = "b";
    a.section = b.section = silk();
    a.held = {{0, Hold::Place, {}}, {40, Hold::Place, {}}};
    Room m(Description{Vector3d::Zero(), {a, b}, {}});
    std::vector<Index> held;
    for (Index k = 0; k < c.held; ++k) held.push_back(20 + k);
    m.hold(held);
    m.hold({41, 42, 43}), m.hold({99, 100, 101});
    m.hands[1].velocity = m.hands[2].velocity = c.speed * Vector3d::UnitZ();
    for (int k = 0; k < 1200 && m.pulled.norm() < 10.0; ++k) {
      const auto was = m.state.position;
      ASSERT_EQ(m.go(0.00025), StepStatus::Ok);
      ASSERT_EQ(crossings(was, m.state.position, {41}), 0)
          << "beside " << c.beside << ", " << c.held << " held, step " << k << ", " << m.pulled.norm()
          << " N";
    }
    EXPECT_GT(m.pulled.norm(), 1.5) << "N";
  }
}

TEST(RodPassage, AThreadThatStartsFromRestGoesNowhereThroughOneThatWasFar) {
  // A load moves the upper one by 5 mm in its first millisecond; the lower one is 2 mm away.
  RodDescription lower = straight(20), upper = straight(20);
  for (Vector3d& x : lower.nodes) x = {0.04 * (x.x() - 0.5), 0.0, 0.0};
  for (Vector3d& x : upper.nodes) x = {0.0005, 0.04 * (x.x() - 0.5), 0.002};
  lower.section = upper.section = solidSection(0.0002, 1000, 1e8, 0.4);
  upper.name = "upper";
  lower.held = {{0, Hold::Place, {}}, {20, Hold::Place, {}}};
  for (Index i = 0; i <= 20; ++i) upper.loads.push_back({i, {0.0, 0.0, -0.025 / 21.0}});
  Moving m(Description{Vector3d::Zero(), {lower, upper}, {}});
  double lowest = 0.0;
  for (int k = 0; k < 20; ++k) {
    const auto was = m.state.position;
    ASSERT_NE(step(m.model, m.state, m.scratch, 0.001), StepStatus::Fault) << k;
    ASSERT_EQ(crossings(was, m.state.position, {21}), 0) << "step " << k;
    lowest = std::min(lowest, m.state.position[10].z());
  }
  EXPECT_LT(lowest, -0.0001) << "m: it was hit";
}

/// An overhand knot in silk whose ends are drawn with 12 N, held, and let go.
void drawAndLetGo(const RodDescription& rod) {
  const Index n = static_cast<Index>(rod.nodes.size() - 1);
  Room m(Description{Vector3d::Zero(), {rod}, {}});
  m.hold({0, 1, 2}), m.hold({n - 2, n - 1, n});
  const Vector3d way = (rod.nodes.back() - rod.nodes.front()).normalized();
  m.hands[0].velocity = -0.3 * way, m.hands[1].velocity = 0.3 * way;
  int drawn = 0;
  for (int k = 0; k < 1200 && drawn < 600; ++k) {
    if (drawn > 0 || m.pulled.norm() > 12.0) ++drawn;
    for (Jaws& j : m.hands) {
      if (drawn > 0) j.velocity.setZero();
      j.closed = drawn < 150;
    }
    const auto was = m.state.position;
    ASSERT_NE(m.go(0.00025), StepStatus::Fault);
    ASSERT_EQ(crossings(was, m.state.position), 0)
        << "segments of " << m.model.length[0] << " m, step " << k << ", drawn for " << drawn;
  }
  EXPECT_EQ(drawn, 600);
}

TEST(RodPassage, AThrowDrawnWithTwelveNewtonsThatSpringsOpenGoesNowhereThroughItself) {
  // Segments of one diameter, of two as in the scene thread_throw, and of four.
  for (const auto& [segments, length, loop] :
       {std::tuple<Index, double, double>{150, 0.000375, 0.045}, {100, 0.00075, 0.06}, {70, 0.0015, 0.085}}) {
    RodDescription rod = overhand(segments, length, loop);
    rod.section = silk();
    drawAndLetGo(rod);
  }
}

TEST(RodPassage, AKnotYankedAtThreeMetresASecondGoesNowhereThroughItself) {
  const unsigned most = std::getenv("VEST_FULL") != nullptr ? 1000 : 8;
  std::printf("count: %u of 1000 knots that are yanked\n", most);
  for (unsigned seed = 1; seed <= most; ++seed) {
    std::mt19937 random(seed);
    const auto any = [&random] { return random() / 2147483648.0 - 1.0; };
    RodDescription rod = overhand(150, 0.001, 0.13);
    rod.section = solidSection(0.0001125, 900, 3e9, 0.4);  // polypropylene, 3-0
    rod.section.friction = 0.1, rod.section.strain_damping = 1e-4, rod.section.drag = 1e-4;
    rod.natural_shape = true;
    for (const Index end : {0, 150}) {
      HeldNode held{end, Hold::Place, {{0.0, rod.nodes[end], 0.0}}};
      for (int k = 1; k <= 4; ++k) {
        const Vector3d at = held.drive.back().place;
        Vector3d by(any(), any(), any());
        by *= 0.015 / by.norm();
        if ((at + by - rod.nodes[75]).norm() > 0.06) by = -by;
        held.drive.push_back({0.005 * k, at + by, 0.0});
      }
      rod.held.push_back(held);
    }
    Moving m(rod);
    for (int k = 0; k < 120; ++k) {
      const auto was = m.state.position;
      ASSERT_NE(step(m.model, m.state, m.scratch, 0.00025), StepStatus::Fault) << seed << ' ' << k;
      ASSERT_EQ(crossings(was, m.state.position), 0) << "seed " << seed << ", step " << k;
    }
  }
}

}  // namespace
}  // namespace vest::suture::test
