// Property test: random nets whose stiffness is scaled over twelve decades stay bounded, finite and whole
// through cuts, doubled knots and kicks (safety: exploding state).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "nets.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/solver/random.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// Numbers of one net, from its seed alone.
struct Dice {
  std::uint32_t seed;
  std::uint64_t next = 0;
  double uniform() { return solver::randomUniform(seed, 1, next++); }
  std::uint32_t below(std::uint32_t n) { return solver::randomBelow(n, seed, 2, next++); }
};

scene::Description randomNet(Dice& dice) {
  specimen::TubeOptions o;
  o.rings = 3 + static_cast<int>(dice.below(5));
  o.around = 3 + static_cast<int>(dice.below(4));
  o.youngs_modulus = 20e3 * std::pow(10.0, 12.0 * dice.uniform());
  o.mass = 0.004 * std::pow(10.0, -12.0 * dice.uniform() * dice.uniform());
  o.damping *= dice.uniform();
  auto d = specimen::tubeScene(o);
  auto& t = d.objects[0];
  for (std::size_t i = 0; i < t.position.size(); ++i)
    if (!t.fixed[i]) t.position[i] += 1e-5 * Vector3d(dice.uniform(), dice.uniform(), dice.uniform());
  // Some links of another stiffness altogether, some degenerate, some triangles crushed from the start.
  for (std::size_t n = 0; n < t.links.size() / 8; ++n)
    t.links[dice.below(static_cast<std::uint32_t>(t.links.size()))].area *=
        std::pow(10.0, 6.0 * dice.uniform() - 3.0);
  if (dice.uniform() < 0.3) t.position[t.position.size() / 2] = t.position[t.position.size() / 2 - 1];
  for (auto& h : t.hinges) h.stiffness *= std::pow(10.0, 8.0 * dice.uniform());
  return d;
}

TEST(RandomNets, StayBoundedFiniteAndOfValidIndicesThroughCuts) {
  const int nets = std::getenv("VEST_FULL") != nullptr ? 4000 : 40;
  std::printf("count: %d of 4000 random nets\n", nets);
  int implicit = 0, cuts = 0, copies = 0;
  for (int n = 0; n < nets; ++n) {
    Dice dice{static_cast<std::uint32_t>(n + 1)};
    auto d = randomNet(dice);
    scene::World w(d);
    implicit += w.model().objects[0].implicit;
    scene::StepInput in;
    scene::StepReport report;
    int faults = 0;
    for (int i = 0; i < 30; ++i) {
      std::uint32_t copy = 0;
      if (dice.uniform() < 0.3)
        cuts += w.removeLink(0, dice.below(static_cast<std::uint32_t>(w.topology(0).links.size())));
      if (dice.uniform() < 0.2)
        copies +=
            w.splitKnot(0, dice.below(static_cast<std::uint32_t>(w.knotCount(0))), Vector3d::UnitX(), copy);
      faults += w.step(in, report) == scene::Status::Fault;
      std::vector<float> v(3 * w.knotCount(0)), p(v.size());
      w.velocities(0, v.data());
      w.positions(0, p.data());
      for (std::size_t k = 0; k < v.size(); ++k) {
        ASSERT_TRUE(std::isfinite(v[k]) && std::isfinite(p[k])) << "net " << n << " step " << i;
        ASSERT_LT(std::fabs(v[k]), 100.0f) << "net " << n << " step " << i;
      }
      for (const auto& l : w.topology(0).links) {
        ASSERT_LT(l.knot0, w.knotCount(0));
        ASSERT_LT(l.knot1, w.knotCount(0));
      }
    }
    EXPECT_EQ(faults, 0) << "net " << n;
    const auto energy = w.energy();
    ASSERT_TRUE(std::isfinite(energy.kinetic) && std::isfinite(energy.elastic)) << n;
  }
  EXPECT_GE(implicit, nets / 3);
  EXPECT_GE(cuts, nets);
  EXPECT_GE(copies, nets / 2);
}

}  // namespace
