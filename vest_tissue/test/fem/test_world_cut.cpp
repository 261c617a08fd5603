// Scissors on finite elements in a World: parts, mass, topology on the wire, snapshots, re-simulation.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "blades.h"
#include "slab.h"
#include "vest_tissue/fem/tissue_cut.h"
#include "vest_tissue/scene/topology.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

using Eigen::Vector3d;

/// A bar along x, 40 × 8 × 4 mm, held at x = -20 mm.
Description bar(Motion motion, Strain strain) {
  Description d = makeBox({16, 4, 2, 0.04, 0.008, 0.004});
  d.name = "bar";
  d.motion = motion, d.strain = strain;
  d.material = {200e3, 0.45, 1050.0, 4.0, 0.004};  // sags by 1 mm where it is cut
  for (auto& x : d.nodes) x += Vector3d(-0.02, -0.004, 0.048);
  return d;
}

/// Scissors from -y that close along z in the plane x = 1 mm. @param hand of the hand: steps since the start
scene::StepInput inputOf(std::uint64_t i, double hand) {
  scene::StepInput in;
  in.step = i;
  const double come = std::min(1.0, hand / 60.0), close = std::clamp((hand - 60.0) / 120.0, 0.0, 1.0);
  in.tools[1] =
      vest::specimen::toolAt(tools::ToolKind::Scissors, Vector3d(0.001, 0.009 - 0.025 * (1.0 - come), 0.050),
                             Vector3d(0, 1, 0), Vector3d(0, 0, 1), 0.9 * (1.0 - close));
  return in;
}

scene::StepInput inputOf(std::uint64_t i) {
  return inputOf(i, static_cast<double>(i));
}

TEST(FemCutInWorld, WhereTheHandIsWithinAStepDecidesNothing) {
  // A live hand begins between two steps, and is found where it was in some of them.
  for (const auto strain : {Strain::Small, Strain::Corotational})
    for (const double late : {0.3, 5.0})
      for (const double share : {0.0, 0.2, 0.5}) {
        scene::Description s = sceneOf({object(bar(Motion::BackwardEuler, strain))});
        s.gravity = Vector3d(0, 0, -2);
        scene::World w(s);
        scene::StepReport report;
        int separated = 0;
        double hand = 0.0;
        for (std::uint32_t i = 0, seed = 1; i < 260; ++i) {
          seed = 1664525u * seed + 1013904223u;
          if (1e-3 * (seed >> 22) >= share) hand = std::max(0.0, i - late);
          ASSERT_NE(w.step(inputOf(i, hand), report), scene::Status::Fault);
          for (const auto& e : report.events) separated += e.kind == scene::EventKind::Separated;
        }
        EXPECT_EQ(separated, 1) << int(strain) << ", " << late << " steps late, " << share
                                << " of them still";
      }
}

TEST(FemCutInWorld, ScissorsDivideABarAndTheFarPartFalls) {
  for (const auto& [motion, strain] : {std::pair{Motion::BackwardEuler, Strain::Small},
                                       std::pair{Motion::BackwardEuler, Strain::Corotational},
                                       std::pair{Motion::Elastostatic, Strain::Small}}) {
    scene::Description s = sceneOf({object(bar(motion, strain))});
    s.gravity = Vector3d(0, 0, -2);
    scene::World w(s), threads(s, 3);
    scene::StepReport report;
    std::vector<scene::Event> events;
    const scene::Topology at_start = w.topology(0);
    scene::Topology followed = at_start;
    std::vector<scene::TopologyDelta> deltas;
    const auto mass = [&] {
      double sum = 0.0;
      for (const double m : w.state().objects[0].tissue.mass) sum += m;
      return sum;
    };
    const double before = mass();
    std::vector<std::uint8_t> bytes;
    std::uint32_t revision = 0;
    for (std::uint64_t i = 0; i < 400; ++i) {
      threads.step(inputOf(i), report);
      ASSERT_NE(w.step(inputOf(i), report), scene::Status::Fault);
      events.insert(events.end(), report.events.begin(), report.events.end());
      if (i == 150) w.save(bytes);
      if (w.revision() == revision) continue;
      ASSERT_TRUE(w.deltasSince(revision, deltas));
      for (const auto& d : deltas) ASSERT_TRUE(scene::applyDelta(followed, d));
      revision = w.revision();
    }
    const auto count = [&](scene::EventKind kind) {
      return std::count_if(events.begin(), events.end(), [&](const auto& e) { return e.kind == kind; });
    };
    EXPECT_GE(count(scene::EventKind::Cut), 2) << int(motion) << int(strain);
    EXPECT_EQ(count(scene::EventKind::Separated), 1) << int(motion) << int(strain);
    double area = 0.0;
    for (const auto& e : events)
      if (e.kind == scene::EventKind::Cut) area += e.area;
    EXPECT_GT(area, 0.9 * 0.008 * 0.004);
    EXPECT_LT(area, 2.5 * 0.008 * 0.004) << "faces near the blade's way, not more";
    EXPECT_NEAR(mass(), before, 1e-12 * before);
    const auto& state = w.state().objects[0];
    EXPECT_EQ(state.fem_surface.parts, 2u);
    EXPECT_EQ(state.tissue.x.size(), w.knotCount(0));
    // The far part has fallen, the held one has not.
    const auto x = positionsOf(w, 0);
    float far = 0.0f, near = 1.0f;
    for (std::size_t k = 0; k < w.knotCount(0); ++k) {
      if (x[3 * k] > 0.010f) far = std::max(far, x[3 * k + 2]);
      if (x[3 * k] < -0.012f) near = std::min(near, x[3 * k + 2]);
    }
    EXPECT_LT(far, 0.03f) << "two of five centimetres in the time that is left";
    EXPECT_GT(near, 0.04f);
    // Who followed the deltas has the topology itself; the skin closes around both parts.
    const scene::Topology& t = w.topology(0);
    EXPECT_EQ(followed.revision, t.revision);
    EXPECT_EQ(followed.skin.triangles, t.skin.triangles);
    EXPECT_EQ(followed.triangle_alive, t.triangle_alive);
    EXPECT_EQ(followed.skin.binding_knots, t.skin.binding_knots);
    EXPECT_EQ(followed.doubled_knots, t.doubled_knots);
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    std::size_t alive = 0;
    for (std::size_t i = 0; i < t.skin.triangles.size(); ++i) {
      if (!t.triangle_alive[i]) continue;
      ++alive;
      for (std::size_t e = 0; e < 3; ++e) {
        const auto knot = [&](std::uint32_t v) { return t.skin.binding_knots[t.skin.binding_start[v]]; };
        edges.insert({knot(t.skin.triangles[i][e]), knot(t.skin.triangles[i][(e + 1) % 3])});
      }
    }
    EXPECT_GT(alive, s.objects[0].skin.triangles.size() + 8);
    for (const auto& [a, b] : edges) ASSERT_EQ(edges.count({b, a}), 1u) << a << ' ' << b;
    EXPECT_EQ(threads.stateHash(), w.stateHash());
    scene::World again(s);
    again.restore(bytes);
    for (std::uint64_t i = 151; i < 400; ++i) {
      again.step(inputOf(i), report);
    }
    EXPECT_EQ(again.stateHash(), w.stateHash());
    w.reset();
    EXPECT_EQ(w.knotCount(0), s.objects[0].position.size());
    EXPECT_EQ(w.topology(0).skin.triangles, at_start.skin.triangles);
  }
}

TEST(FemCutInWorld, WhatIsLeftOfAnElastostaticBarIsAtRestAtOnce) {
  // It went on by backward Euler, and swung.
  double fastest[2] = {};
  for (const Motion motion : {Motion::BackwardEuler, Motion::Elastostatic}) {
    scene::Description s = sceneOf({object(bar(motion, Strain::Small))});
    s.gravity = Vector3d(0, 0, -2);
    scene::World w(s);
    scene::StepReport report;
    scene::StepInput in;
    for (std::uint64_t i = 0; i < 200; ++i) w.step(inputOf(i), report);
    const auto& t = w.state().objects[0].tissue;
    ASSERT_EQ(w.state().objects[0].fem_surface.parts, 2u);
    for (in.step = 200; in.step < 202; ++in.step) w.step(in, report);
    for (std::size_t k = 0; k < t.x.size(); ++k)
      if (s.objects[0].position[t.origin[k]].x() < -0.004)
        fastest[motion == Motion::Elastostatic] =
            std::max(fastest[motion == Motion::Elastostatic], t.v[k].norm());
  }
  EXPECT_GT(fastest[0], 1e-4) << "m/s: the scene shows nothing";
  EXPECT_LT(fastest[1], 1e-9) << "m/s";
}

TEST(FemCutInWorld, AConnectionMeetsTheFlapThatACutMadeSoft) {
  // Springs that are held over a step are bounded by what their knot answers. Cut, it answers more.
  Description above = bar(Motion::Elastostatic, Strain::Small);
  above.name = "above";
  for (auto& x : above.nodes) x.z() += 0.012;
  scene::Description s = sceneOf({object(bar(Motion::Elastostatic, Strain::Small)), object(above)});
  s.gravity.setZero();
  scene::Connection c;
  c.object0 = "bar", c.object1 = "above";
  for (std::uint32_t k = 0; k < s.objects[0].position.size(); ++k)
    if (s.objects[0].position[k].x() > 0.0199 && s.objects[0].position[k].z() > 0.0519) c.knot0 = k;
  c.triangle1 = s.objects[1].contact_triangles[0], c.weights1 = {0.4, 0.3, 0.3};
  c.stiffness = 5.0, c.damping = 0.0;
  s.connections.push_back(c);
  scene::World w(s);
  scene::StepReport report;
  const auto softness = [&] {
    return static_cast<double>(w.state().objects[0].block.row(net::Block::kInverseMass)[c.knot0]);
  };
  const double before = softness();
  for (std::uint64_t i = 0; i < 260; ++i) {
    scene::StepInput in = inputOf(i);
    in.tools[1].position.y() -= 0.006;  // a part of its width
    ASSERT_NE(w.step(in, report), scene::Status::Fault);
  }
  const auto& t = w.state().objects[0].tissue;
  ASSERT_EQ(w.state().objects[0].fem_surface.parts, 1u);
  ASSERT_GT(t.x.size(), s.objects[0].position.size());
  const auto whole = makeTissue(bar(Motion::Elastostatic, Strain::Small), Motion::Elastostatic, "");
  prepareTissue(*whole, s.dt);
  const auto cut = makeTissue(cutDescription(*whole, t), Motion::Elastostatic, "");
  prepareTissue(*cut, s.dt);
  const double softer = cut->softestAt(c.knot0) / whole->softestAt(c.knot0);
  EXPECT_GT(softer, 1.2) << "the scene shows nothing";
  EXPECT_NEAR(softness() / before, softer, 1e-4 * softer);
  scene::StepInput in;
  for (in.step = 260; in.step < 1260; ++in.step) ASSERT_NE(w.step(in, report), scene::Status::Fault);
  EXPECT_LT(t.v[c.knot0].norm(), 5e-4) << "m/s: it comes to rest";
}

TEST(FemCutInWorld, ManyStiffConnectionsComeToRestAndGoOnFromASnapshotWithTheSameBits) {
  // Together they move an end further than each alone, and all the more once the bar is cut.
  for (const int every : {1, 6}) {
    Description above = bar(Motion::Elastostatic, Strain::Small);
    above.name = "above";
    for (auto& x : above.nodes) x.z() += 0.02;
    scene::Description s = sceneOf({object(bar(Motion::Elastostatic, Strain::Small)), object(above)});
    const auto& x = s.objects[0].position;
    int n = 0;
    for (const auto& t : s.objects[1].contact_triangles) {  // the same nodes' numbers in both
      const Vector3d& at = x[t[0]];
      if (at.x() < 0.003 || at.z() < 0.0519 || n++ % every != 0) continue;
      scene::Connection c;
      c.object0 = "bar", c.object1 = "above", c.knot0 = t[0];
      c.triangle1 = t, c.weights1 = {0.4, 0.3, 0.3};
      c.stiffness = 20.0, c.damping = 0.0;
      s.connections.push_back(c);
    }
    ASSERT_GT(s.connections.size(), every == 1 ? 40u : 7u);
    scene::World w(s), again(s, 3);
    scene::StepReport report;
    std::vector<std::uint8_t> bytes;
    for (std::uint64_t i = 0; i < 260; ++i) {
      scene::StepInput in = inputOf(i);
      in.tools[1].position.y() -= 0.006;  // a part of its width
      if (i == 200) w.save(bytes), again.restore(bytes);
      ASSERT_NE(w.step(in, report), scene::Status::Fault) << i;
      if (i >= 200) again.step(in, report);
    }
    ASSERT_GT(w.state().objects[0].tissue.x.size(), x.size()) << "cut";
    scene::StepInput in;
    for (in.step = 260; in.step < 760; ++in.step) {
      ASSERT_NE(w.step(in, report), scene::Status::Fault) << in.step;
      again.step(in, report);
    }
    EXPECT_EQ(again.stateHash(), w.stateHash());
    EXPECT_LT(vest::specimen::fastestKnot(w), 5e-4) << "m/s: it comes to rest";
  }
}

TEST(FemCutInWorld, ScissorsThatJumpThroughASlabThrowNothing) {
  // A liver that two scissors are in, somewhere else every five steps: at 128 doubled knots and more a place
  // that was touched flew off, one step in fifteen was a fault, and each took 24 iterations or more.
  for (const Motion motion : {Motion::Elastostatic, Motion::BackwardEuler}) {
    Description d = slab({Strain::Small, motion, 5400.0, 1060.0, 12, 8, 3, true, "slab"});
    for (auto& x : d.nodes) x.z() += 0.036;
    const scene::Description s = sceneOf({object(d)});
    scene::World w(s), threads(s, 3);
    scene::StepInput in;
    scene::StepReport report;
    std::uint32_t seed = 1;
    const auto uniform = [&](double low, double high) {
      seed = 1664525u * seed + 1013904223u;
      return low + (high - low) * (seed / 4294967296.0);
    };
    std::size_t cuts = 0;
    constexpr int kSteps = 120;
    for (int i = 0; i < kSteps; ++i) {
      for (auto& tool : in.tools) {
        if (i % 5 == 0) {
          const Vector3d along(uniform(-0.7, 0.7), uniform(-0.7, 0.7), -1.0),
              opening(uniform(-1, 1), uniform(-1, 1), uniform(-0.3, 0.3)),
              tip(uniform(-0.03, 0.03), uniform(-0.02, 0.02), uniform(0.03, 0.045));
          tool = vest::specimen::toolAt(tools::ToolKind::Scissors, tip, along, opening, uniform(0, 1));
          tool.present = &tool != &in.tools[2];
        }
        tool.jaw = std::max(0.0, tool.jaw - 0.2);
      }
      in.step = w.steps();
      threads.step(in, report);
      ASSERT_NE(w.step(in, report), scene::Status::Fault) << "step " << i;
      for (const auto& e : report.events) cuts += e.kind == scene::EventKind::Cut;
    }
    EXPECT_GT(cuts, 80u);
    EXPECT_GT(w.state().objects[0].fem_surface.parts, 15u) << "a single element keeps its last face";
    EXPECT_GT(w.knotCount(0) - d.nodes.size(), 150u);
    EXPECT_EQ(threads.stateHash(), w.stateHash());
  }
}

TEST(FemCutInWorld, AtAnyStiffnessAndMassACutObjectMovesBoundedly) {
  for (const auto& [motion, strain] : {std::pair{Motion::BackwardEuler, Strain::Small},
                                       std::pair{Motion::BackwardEuler, Strain::Corotational},
                                       std::pair{Motion::Elastostatic, Strain::Small}}) {
    for (double stiffness = 1.0; stiffness < 2e12; stiffness *= 1e4) {
      for (const double density : {1.0, 1e-9}) {
        Description d = makeBox({10, 2, 2, 0.04, 0.008, 0.004});
        d.name = "bar";
        d.motion = motion, d.strain = strain;
        d.material = {20e3 * stiffness, 0.45, 1050.0 * density, 4.0, 0.004};
        for (auto& x : d.nodes) x += Vector3d(-0.02, -0.004, 0.048);
        scene::Description s = sceneOf({object(d)});
        s.gravity = Vector3d(0, 0, -2);
        scene::World w(s);
        scene::StepReport report;
        std::size_t cuts = 0;
        for (std::uint64_t i = 0; i < 260; ++i) {
          ASSERT_NE(w.step(inputOf(i), report), scene::Status::Fault)
              << int(motion) << int(strain) << " E·" << stiffness << " density·" << density << " step " << i;
          for (const auto& e : report.events) cuts += e.kind == scene::EventKind::Cut;
        }
        EXPECT_GE(cuts, 1u);
        for (const Vector3d& x : w.state().objects[0].tissue.x)
          ASSERT_LT((x - Vector3d(0, 0, 0.05)).norm(), 0.1)
              << int(motion) << int(strain) << " E·" << stiffness << " density·" << density;
      }
    }
  }
}

TEST(FemInWorld, ElementsTurnedInsideOutStayBoundedAndComeToRest) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    Description d = makeBox({6, 3, 3, 0.03, 0.012, 0.012});
    d.name = "bar";
    d.strain = strain;
    d.material = {20e3, 0.45, 1050.0, 4.0, 0.004};
    scene::Description weightless = sceneOf({object(d)});
    weightless.gravity.setZero();
    scene::World w(weightless);
    auto& t = const_cast<scene::WorldState&>(w.state()).objects[0].tissue;
    const auto rest = t.x;
    for (std::size_t k = 0; k < t.x.size(); ++k)  // the free half mirrored, and everything beyond flat
      if (rest[k].x() > 0.012) t.x[k].z() = rest[k].x() > 0.024 ? 0.006 : 0.012 - rest[k].z();
    scene::StepInput in;
    scene::StepReport report;
    for (in.step = 0; in.step < 1500; ++in.step)
      ASSERT_NE(w.step(in, report), scene::Status::Fault) << in.step;
    double fastest = 0.0;
    for (std::size_t k = 0; k < t.x.size(); ++k) {
      ASSERT_LT((t.x[k] - rest[k]).norm(), 0.05);
      fastest = std::max(fastest, t.v[k].norm());
    }
    EXPECT_LT(fastest, 1e-3) << "m/s";
    if (strain == Strain::Small) {
      for (std::size_t k = 0; k < t.x.size(); ++k) EXPECT_LT((t.x[k] - rest[k]).norm(), 1e-4) << k;
    }
  }
}

}  // namespace
}  // namespace vest::fem::test
