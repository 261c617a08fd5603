// Clips and heat on finite elements: they do there what they do on nets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "blades.h"
#include "slab.h"
#include "theatre.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;
using fem::Motion;
using fem::Strain;

struct Kind {
  Motion motion;
  Strain strain;
};
constexpr Kind kKinds[] = {{Motion::BackwardEuler, Strain::Small},
                           {Motion::BackwardEuler, Strain::Corotational},
                           {Motion::Elastostatic, Strain::Small}};

/// A fold along x, 40 × 3 × 6 mm, its lower edge held or free.
scene::Description fold(const Kind& kind, bool held = true) {
  fem::Description d = fem::specimen::makeBox({16, 2, 4, 0.04, 0.003, 0.006}, false);
  d.name = "fold";
  d.motion = kind.motion, d.strain = kind.strain;
  d.material = {20e3, 0.4, 1050.0, 2.0, 0.004};
  for (fem::Index n = 0; n < d.nodes.size(); ++n) {
    if (held && d.nodes[n].z() == 0.0) d.fixed.push_back(n);
    d.nodes[n] += Vector3d(-0.02, -0.0015, 0.047);
  }
  scene::Description s = fem::specimen::sceneOf({fem::specimen::object(d)});
  s.gravity.setZero();
  return s;
}

struct Theatre : test::Theatre {
  using test::Theatre::Theatre;
  /// An applier from above, jaws open along y, that closes over the fold's upper edge.
  void close(double jaw0, double jaw1, int steps) {
    use(tools::ToolKind::ClipApplier, Vector3d(0, 0, 0.0485), jaw0, jaw1, steps);
  }
  void clip() {
    close(0.6, 0.6, 60);
    close(0.6, 0.0, 300);
  }
  const interaction::Clip& theClip() const { return world.state().fasteners.clips.at(0); }
  /// How far apart (m) the two sides are that the legs of the clip hold, from leg to leg.
  double apart(const interaction::Clip& clip) const {
    double low = 1e30, high = -1e30;
    for (int i = 0; i < clip.count; ++i) {
      const double x = clip.rotation.col(0).dot(world.state().objects[0].tissue.x[clip.knots[i]]);
      low = std::min(low, x), high = std::max(high, x);
    }
    return high - low;
  }
};

TEST(ClipOnElements, HoldsTheFoldShutUntilItIsTakenOff) {
  for (const Kind& kind : kKinds) {
    Theatre t(fold(kind));
    t.clip();
    ASSERT_EQ(t.count(scene::EventKind::Clipped), 1u) << int(kind.motion) << int(kind.strain);
    const interaction::Clip clip = t.theClip();
    ASSERT_GE(clip.count, 6);
    EXPECT_GT(clip.force, 1e-3) << "N: the fold presses against the legs";
    t.leave();
    t.run(1000);
    EXPECT_LT(t.apart(t.theClip()), 0.5e-3) << "m, of 3 mm";
    EXPECT_GT(t.theClip().force, 1e-3) << "N";
    const auto rest = fem::specimen::positionsOf(t.world, 0);
    t.run(500);
    const auto now = fem::specimen::positionsOf(t.world, 0);
    double moved = 0.0;
    for (std::size_t i = 0; i < rest.size(); ++i)
      moved = std::max<double>(moved, std::fabs(now[i] - rest[i]));
    EXPECT_LT(moved, 2e-5) << "m: it does not creep";
    scene::TopologyRequest request;
    request.kind = scene::TopologyRequest::Kind::RemoveClip;
    request.element = static_cast<std::uint32_t>(clip.id);
    t.input.requests = {request};
    t.step();
    t.input.requests.clear();
    t.run(1500);
    EXPECT_EQ(t.count(scene::EventKind::Unclipped), 1u);
    EXPECT_GT(t.apart(clip), 2.5e-3) << "m: it opens again";
  }
}

TEST(ClipOnElements, PutsNoNetForceOnATissueThatIsFree) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    scene::Description d = fold({Motion::BackwardEuler, strain}, false);
    Theatre t(d);
    t.clip();
    ASSERT_EQ(t.count(scene::EventKind::Clipped), 1u);
    t.leave();
    t.step();
    const auto momentum = [&] {
      Vector3d sum = Vector3d::Zero();
      const auto& s = t.world.state().objects[0].tissue;
      for (std::size_t k = 0; k < s.x.size(); ++k) sum += s.mass[k] * s.v[k];
      return sum;
    };
    const Vector3d before = momentum();
    const double force = t.theClip().force;
    t.run(200);
    // Damping by rayleigh_mass takes momentum, at 2 1/s.
    EXPECT_LT((momentum() - before).norm(), 1e-3 * force * 0.2 + 0.5 * before.norm()) << "N·s";
    EXPECT_GT(force, 1e-3);
  }
}

TEST(ClipOnElements, StaysOnItsSideOfACutAndTheStateGoesOnAlike) {
  for (const Kind& kind : kKinds) {
    const auto cutBeside = [](Theatre& t) {  // scissors 8 mm beside it
      for (int i = 0; i < 200; ++i) {
        const double come = std::min(1.0, i / 60.0), close = std::clamp((i - 60.0) / 120.0, 0.0, 1.0);
        t.input.tools[1] =
            specimen::toolAt(tools::ToolKind::Scissors, Vector3d(0.009, 0, 0.060 - 0.010 * come),
                             Vector3d(0, 0, -1), Vector3d(0, 1, 0), 0.9 * (1.0 - close));
        t.step();
      }
      t.leave();
      t.run(300);
    };
    Theatre one(fold(kind)), threads(fold(kind), 3), restored(fold(kind));
    std::vector<std::uint8_t> clipped, cut;
    for (Theatre* each : {&one, &threads}) {
      each->clip();
      each->leave();
      each->run(50);
      if (each == &one) one.world.save(clipped);
      cutBeside(*each);
      if (each == &one) one.world.save(cut);
    }
    EXPECT_GE(one.count(scene::EventKind::Cut), 1u) << int(kind.motion) << int(kind.strain);
    EXPECT_LT(one.apart(one.theClip()), 0.5e-3) << "m";
    EXPECT_EQ(one.world.stateHash(), threads.world.stateHash());
    // What is read before the cut goes through it like the one that wrote it; what is read after it goes on.
    restored.world.restore(clipped);
    cutBeside(restored);
    EXPECT_EQ(restored.world.stateHash(), one.world.stateHash());
    Theatre later(fold(kind));
    later.world.restore(cut);
    later.run(100), one.run(100);
    EXPECT_EQ(later.world.stateHash(), one.world.stateHash());
  }
}

/// The lower side of a hook's foot at height z above the slab's middle.
scene::ToolInput hook(double z, bool on) {
  scene::ToolInput t = specimen::grasper(Vector3d(0, 0, z + 0.0146), 0.0);
  t.tool = tools::ToolKind::CoagulationHook;
  t.pivot = Vector3d(0, 0, 0.25);
  if (on) t.functions = tools::kFunctionCoagulate;
  return t;
}

/// Part of its free shrinkage that an oblate spheroid in a solid of the same stiffness keeps, across its
/// short axis (Eshelby 1957, doi:10.1098/rspa.1957.0133): (1 + nu)/(1 - nu)·I/(4·pi), I of its potential. At
/// a free surface, half of it, and stiffer than what is around, it keeps more.
/// @param flat short axis over long ones, less than 1
double heldSpot(double flat, double nu) {
  const double off = std::sqrt(1.0 - flat * flat);
  return (1.0 + nu) / (1.0 - nu) * flat / (2.0 * off * off * off) * (std::acos(flat) - flat * off);
}

TEST(HeatOnElements, TheHookWhitensStiffensAndShrinksASlabAndEveryJouleIsAccountedFor) {
  for (const Kind& kind : kKinds) {
    fem::specimen::SlabOptions options;
    options.motion = kind.motion, options.strain = kind.strain;
    options.nx = 12, options.ny = 8;
    scene::Description d = fem::specimen::sceneOf({fem::specimen::object(fem::specimen::slab(options))});
    d.gravity.setZero();
    Theatre t(d);
    t.input.tools[1] = hook(0.0112, false);
    t.run(50);
    EXPECT_EQ(t.world.heat().delivered, 0.0);
    t.input.tools[1] = hook(0.0112, true);
    t.run(1500);
    const auto heat = t.world.heat();
    ASSERT_GT(heat.delivered, 5.0) << int(kind.motion) << int(kind.strain);
    EXPECT_LE(heat.delivered, 30.0 * 1.5 + 1e-9);
    EXPECT_NEAR(heat.delivered, heat.stored + heat.perfused + heat.surface + heat.latent,
                1e-6 * heat.delivered);
    EXPECT_GT(t.most(scene::Field::Damage), 0.95f);
    t.input.tools[1] = hook(0.080, false);
    t.run(1500);
    // The surface is drawn together towards the spot, and far away it is as it was.
    std::vector<float> damage(t.world.knotCount(0));
    t.world.field(0, scene::Field::Damage, damage.data());
    const fem::TissueState& tissue = t.world.state().objects[0].tissue;
    ASSERT_FALSE(tissue.denatured.empty());
    double contraction = 0.0, edges = 0.0;  // over that of free tissue
    for (const auto& c : d.objects[0].contact_triangles) {
      for (int e = 0; e < 3; ++e) {
        const auto a = c[e], b = c[(e + 1) % 3];
        if (damage[a] < 0.9f || damage[b] < 0.9f) continue;
        double free = 0.0, sharing = 0.0;
        for (std::size_t n = 0; n < tissue.corner.size(); ++n) {
          const auto& k = tissue.corner[n];
          if (std::count(k.begin(), k.end(), a) + std::count(k.begin(), k.end(), b) < 2) continue;
          free += fem::kShrinkage * static_cast<double>(tissue.denatured[n]), sharing += 1.0;
        }
        const double now = (tissue.x[a] - tissue.x[b]).norm(),
                     rest = (d.objects[0].rest_position[a] - d.objects[0].rest_position[b]).norm();
        contraction += (1.0 - now / rest) / (free / sharing), edges += 1.0;
      }
    }
    ASSERT_GT(edges, 0.0);
    const auto white = std::count_if(damage.begin(), damage.end(), [](float v) { return v >= 0.9f; });
    const double wide =
                     std::sqrt(static_cast<double>(white) * (0.06 / options.nx) * (0.04 / options.ny) / M_PI),
                 deep = 0.012 / options.nz;  // m: knots stand for a cell of the surface, elements go down one
    EXPECT_GT(contraction / edges, heldSpot(deep / wide, 0.45)) << "in the plane of the surface";
    EXPECT_LT(contraction / edges, 1.0) << "no more than free tissue";
    // What is white is denatured in its first layer at least; elements are the mean of their corners.
    double least = 0.0;
    for (const auto& corner : tissue.corner) {
      double sum = 0.0;
      for (const fem::Index k : corner)
        if (damage[k] >= 0.9f) sum += 0.25 * 0.9 * t.world.model().objects[0].heat.shapes[k].share[0];
      least = std::max(least, sum);
    }
    EXPECT_GE(*std::max_element(tissue.denatured.begin(), tissue.denatured.end()), least);
    EXPECT_GT(least, 0.0);
    std::size_t healthy = 0;
    for (const float v : damage) healthy += v < 0.01f;
    EXPECT_GT(healthy, damage.size() / 2);
    // A snapshot keeps it.
    std::vector<std::uint8_t> bytes;
    t.world.save(bytes);
    scene::World other(d, 2);
    other.restore(bytes);
    EXPECT_EQ(other.stateHash(), t.world.stateHash());
    scene::StepReport report;
    for (int i = 0; i < 100; ++i) {
      t.step();
      other.step(t.input, report);
    }
    EXPECT_EQ(other.stateHash(), t.world.stateHash());
  }
}

/// A free bar along x, or one that is held at both ends; parts of it are denatured at once.
scene::Description shrinkingBar(const Strain strain, bool held) {
  fem::Description b = fem::specimen::makeBox({20, 2, 2, 0.04, 0.002, 0.002}, false);
  b.name = "bar";
  b.strain = strain;
  b.material = {20e3, 0.0, 1050.0, 20.0, 0.004};
  for (fem::Index n = 0; n < b.nodes.size(); ++n) {
    if (held && (b.nodes[n].x() == 0.0 || b.nodes[n].x() > 0.04 - 1e-9)) b.fixed.push_back(n);
    b.nodes[n] += Vector3d(-0.02, -0.001, 0.05);
  }
  scene::Description d = fem::specimen::sceneOf({fem::specimen::object(b)});
  d.gravity.setZero();
  return d;
}

// Denatured tissue is shorter at rest by kShrinkage: all of it where it is free; between healthy parts of a
// bar that is held, s of the free strain and r times as stiff, by s·r/(r + f/(1 - f)), f its share of the
// bar: one tension along all of it, and lengths that add up to that of the bar.
TEST(HeatOnElements, DenaturedPartsOfABarShrinkFreelyOrAgainstTheRestOfIt) {
  constexpr double kPart = 0.5, kFree = kPart * fem::kShrinkage, kShare = 0.5;
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    for (const bool held : {false, true}) {
      const scene::Description d = shrinkingBar(strain, held);
      Theatre t(d);
      auto& tissue = const_cast<scene::WorldState&>(t.world.state()).objects[0].tissue;
      tissue.denatured.assign(tissue.corner.size(), 0.0f);
      const double reach = held ? 0.5 * kShare * 0.04 : 1.0;  // m: from the middle
      for (std::size_t e = 0; e < tissue.corner.size(); ++e) {
        double middle = 0.0;
        for (const fem::Index k : tissue.corner[e]) middle += 0.25 * tissue.x[k].x();
        if (std::fabs(middle) < reach) tissue.denatured[e] = static_cast<float>(kPart);
      }
      t.run(2000);
      const double stiffer = 1.0 + fem::kStiffening * kPart;
      const double wanted = held ? kFree * stiffer / (stiffer + kShare / (1.0 - kShare)) : kFree;
      // Of the ends of the denatured part.
      const double end = held ? reach : 0.02;
      double shorter = 0.0, n = 0.0;
      for (std::size_t k = 0; k < tissue.x.size(); ++k) {
        const Vector3d& rest = d.objects[0].rest_position[k];
        if (std::fabs(std::fabs(rest.x()) - end) > 1e-9) continue;
        shorter += 1.0 - tissue.x[k].x() / rest.x(), n += 1.0;
      }
      // Held, its cross-section shrinks too: near its ends, over about its thickness, the tension is not
      // even.
      const double tolerance = held ? 0.002 / (2.0 * reach) : 1e-4;
      EXPECT_NEAR(shorter / n, wanted, tolerance * wanted) << int(strain) << held;
    }
  }
}

TEST(HeatOnElements, ABarConductsAlongItsEdgesLikeTheHeatEquation) {
  fem::Description b = fem::specimen::makeBox({8, 1, 1, 0.008, 0.001, 0.001}, false);
  b.name = "bar";
  b.material = {20e3, 0.4, 1050.0, 2.0, 0.004};
  for (auto& x : b.nodes) x += Vector3d(-0.004, -0.0005, 0.05);
  scene::Description d = fem::specimen::sceneOf({fem::specimen::object(b)});
  d.objects[0].thermal.perfusion = 0.0;
  scene::World w(d);
  auto& heat = const_cast<scene::WorldState&>(w.state()).objects[0].heat;
  heat.touched = heat.warm = true;
  std::vector<double> place;
  for (std::size_t k = 0; k < w.knotCount(0); ++k) {
    place.push_back((w.knotAt(0, k).x() + 0.004) / 0.008);
    for (double& e : heat.columns[k].excess) e = 4.0 * std::cos(M_PI * place[k]);
  }
  scene::StepInput input;
  input.dt = 0.01;
  scene::StepReport report;
  for (int i = 0; i < 2000; ++i) {
    input.step = w.steps();
    w.step(input, report);
  }
  // The slowest mode decays with (pi/L)²·k/(rho·c); the surface loses heat to the gas, A·h/(V·rho·c).
  const auto& m = d.objects[0].thermal;
  const double capacity = 1050.0 * m.heat_capacity, area = 4 * 0.008 * 0.001 + 2 * 1e-6;
  const double rate = M_PI * M_PI / (0.008 * 0.008) * m.conductivity / capacity +
                      interaction::kSurfaceLoss * area / (0.008e-6 * capacity);
  double amplitude = 0.0, size = 0.0;
  for (std::size_t k = 0; k < place.size(); ++k) {
    const double mode = std::cos(M_PI * place[k]), mass = w.state().objects[0].tissue.mass[k];
    amplitude += mass * mode * heat.columns[k].excess[0];
    size += mass * mode * mode;
  }
  EXPECT_NEAR(std::log(4.0 / (amplitude / size)) / 20.0, rate, 0.1 * rate) << "1/s";
}

}  // namespace
