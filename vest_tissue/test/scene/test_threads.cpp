// Threads in a World: they lie on tissue, hang from jaws, pull what they wrap, are cut and break.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>

#include "nets.h"
#include "vest_tissue/base/nearest.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;
using scene::EventKind;

constexpr double kThickness = 0.0005;  // m: scene::Object::contact_thickness

/// A soft sheet of 60 × 60 mm at z = 0, held along its border; its triangles look up.
scene::Object sheet() {
  scene::Object s;
  s.name = "sheet";
  s.law.youngs_modulus = 20e3;
  s.friction = 0.2;
  constexpr int n = 16;
  const auto at = [](int i, int j) { return static_cast<scene::Index>(i * n + j); };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      s.rest_position.push_back({0.06 * i / (n - 1) - 0.03, 0.06 * j / (n - 1) - 0.03, 0.0});
      s.mass.push_back(5e-5);
      s.damping.push_back(5e-4);
      s.fixed.push_back(i == 0 || j == 0 || i == n - 1 || j == n - 1);
    }
  }
  s.position = s.rest_position;
  const auto link = [&](scene::Index a, scene::Index b) {
    scene::Link l;
    l.knot0 = a, l.knot1 = b;
    l.rest = 0.98 * (s.rest_position[a] - s.rest_position[b]).norm();
    l.area = 8e-6, l.damping = 0.02;
    s.links.push_back(l);
  };
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      if (i + 1 < n) link(at(i, j), at(i + 1, j));
      if (j + 1 < n) link(at(i, j), at(i, j + 1));
      if (i + 1 == n || j + 1 == n) continue;
      link(at(i, j), at(i + 1, j + 1)), link(at(i + 1, j), at(i, j + 1));
      s.contact_triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.contact_triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return s;
}

/// Polyglactin 910, 2-0.
scene::Suture polyglactin(const std::vector<Vector3d>& nodes) {
  scene::Suture s;
  s.material = "polyglactin_910", s.size = "2-0", s.kind = 2;
  s.strength = 43.8, s.knot_strength = 26.3;
  s.rod.name = "thread";
  s.rod.nodes = nodes;
  s.rod.section = suture::solidSection(0.00016, 1125.0, 6e9, 0.4);
  s.rod.section.bend *= 0.05, s.rod.section.twist *= 0.05;
  s.rod.section.friction = 0.2, s.rod.section.strain_damping = 1e-4, s.rod.section.drag = 1e-4;
  return s;
}

/// Nodes a millimetre apart.
std::vector<Vector3d> line(const Vector3d& from, const Vector3d& along, int segments) {
  std::vector<Vector3d> nodes;
  for (int i = 0; i <= segments; ++i) nodes.push_back(from + 0.001 * i * along.normalized());
  return nodes;
}

double massOf(const scene::World& w) {
  double sum = 0.0;
  for (const double m : w.model().threads.rods->mass) sum += m;
  return sum;
}
double fastest(const scene::World& w) {
  double most = 0.0;
  for (const Vector3d& v : w.state().threads.rod.velocity) most = std::max(most, v.norm());
  return most;
}
const std::vector<Vector3d>& nodesOf(const scene::World& w) {
  return w.state().threads.rod.position;
}

struct Room {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  int cuts = 0, torn = 0, grasped = 0, released = 0;

  explicit Room(const scene::Description& d, int threads = 1) : world(d, threads) {}
  scene::Status step() {
    input.step = world.steps();
    const scene::Status status = world.step(input, report);
    for (const scene::Event& e : report.events) {
      cuts += e.kind == EventKind::Cut, torn += e.kind == EventKind::Torn;
      grasped += e.kind == EventKind::Grasped, released += e.kind == EventKind::Released;
    }
    return status;
  }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) ASSERT_NE(step(), scene::Status::Fault) << "step " << world.steps();
  }
};

scene::Description onSheet() {
  scene::Description d;
  d.name = "sheet", d.hash = "0000000000000003";
  d.objects.push_back(sheet());
  std::vector<Vector3d> nodes;
  for (int i = 0; i <= 40; ++i)
    nodes.push_back({0.001 * i - 0.02, 0.004 * std::sin(0.3 * i), 0.003 + 0.00005 * i});
  d.sutures.push_back(polyglactin(nodes));
  d.sutures[0].rod.natural_shape = true;
  return d;
}

TEST(Threads, OneThatFallsOnTissueLiesOnItAndRests) {
  Room r(onSheet());
  r.run(1200);
  EXPECT_LT(fastest(r.world), 0.005);
  double lowest = 1.0, highest = -1.0;
  for (const Vector3d& x : nodesOf(r.world)) {
    lowest = std::min(lowest, x.z()), highest = std::max(highest, x.z());
  }
  // The sheet itself sags by some two millimetres; the thread's axis lies its radius over its surface.
  EXPECT_GT(lowest, -0.003);
  EXPECT_LT(highest, 0.003);
  for (const Vector3d& x : nodesOf(r.world)) {
    double above = 1.0;
    for (const auto& t : r.world.contactTriangles(0)) {
      const std::array<Vector3d, 3> p{r.world.knotAt(0, t[0]), r.world.knotAt(0, t[1]),
                                      r.world.knotAt(0, t[2])};
      above = std::min(above, contact::nearest(x, p).distance);
    }
    EXPECT_GT(above, 0.9 * (kThickness + 0.00016));
  }
}

TEST(Threads, TheSutureOfTheScenePadComesToRest) {
  Room r(scene::loadScene(VEST_TISSUE_SOURCE_DIR "/scenes/thread_pad/thread_pad.yaml"));
  r.run(1000);
  EXPECT_LT(fastest(r.world), 0.005);
  // It lies on the pad and hangs over its edge.
  for (const Vector3d& x : nodesOf(r.world)) {
    if (x.y() > 0.025) {
      EXPECT_NEAR(x.z(), 0.068, 0.003);
    }
    EXPECT_GT(x.z(), 0.040);
  }
}

TEST(Threads, HeldInJawsItHangsWithItsWeight) {
  scene::Description d;
  d.name = "air", d.hash = "0000000000000004";
  d.objects.push_back(sheet());
  // 150 mm from a grasper that comes from above: far beside the sheet.
  const Vector3d top(0.2, 0, 0.3);
  d.sutures.push_back(polyglactin(line(top, Vector3d(0, 0, -1), 150)));
  Room r(d);
  r.input.tools[0] = specimen::grasper(top - Vector3d(0, 0, 0.003), 0.0);
  r.run(800);
  EXPECT_EQ(r.grasped, 1);
  double sum = 0.0;
  for (int i = 0; i < 200; ++i) {
    r.run(1);
    sum += r.report.contacts[0].wrench[2];
  }
  const double weight = 9.81 * massOf(r.world);
  EXPECT_NEAR(sum / 200, -weight, 0.02 * weight);
  std::vector<scene::ThreadView> threads;
  r.world.threads(threads);
  ASSERT_EQ(threads.size(), 1u);
  // Tension half way down is half of the weight.
  EXPECT_NEAR(threads[0].tension[75], 0.5 * weight, 0.1 * weight);
}

/// A thread under a tube that is held at both ends; two graspers hold its ends.
scene::Description underTube(bool held = true) {
  specimen::TubeOptions o;
  o.rings = 24, o.length = 0.06, o.radius = 0.004, o.mass = 0.006, o.youngs_modulus = 50e3;
  o.fix_ends = held;
  o.centre = Vector3d(0, 0, 0.05);
  scene::Description d = specimen::tubeScene(o);
  std::vector<Vector3d> nodes;
  for (int i = 0; i <= 25; ++i) nodes.push_back({0, -0.008, 0.070 - 0.001 * i});
  const double radius = 0.008;
  for (int i = 1; i < 25; ++i) {
    const double a = M_PI * i / 25.0;
    nodes.push_back({0, -radius * std::cos(a), 0.045 - radius * std::sin(a)});
  }
  for (int i = 0; i <= 25; ++i) nodes.push_back({0, 0.008, 0.045 + 0.001 * i});
  d.sutures.push_back(polyglactin(nodes));
  d.sutures[0].rod.natural_shape = true;
  return d;
}

TEST(Threads, PulledUpItLiftsTheTissueThatItWraps) {
  Room r(underTube());
  const std::size_t middle = 12 * 8;
  r.run(1);
  const double before = r.world.knotAt(0, middle).z();
  for (int i = 0; i < 1500; ++i) {
    const double up = 0.015 * std::min(1.0, i / 1000.0);
    r.input.tools[0] = specimen::grasper({0, -0.008, 0.068 + up}, 0.0);
    r.input.tools[1] = specimen::grasper({0, 0.008, 0.068 + up}, 0.0);
    r.run(1);
  }
  EXPECT_EQ(r.grasped, 2);
  EXPECT_GT(r.world.knotAt(0, middle).z() - before, 0.002);
  // Both hands feel it, pulled downwards, alike.
  const double left = r.report.contacts[0].wrench[2], right = r.report.contacts[1].wrench[2];
  EXPECT_LT(left, -0.02);
  EXPECT_NEAR(left, right, 0.1 * std::fabs(left));
}

TEST(Threads, WhatAThreadGivesTissueItLoses) {
  scene::Description d = underTube(false);
  d.gravity.setZero();
  for (double& damping : d.objects[0].damping) damping = 0.0;
  d.sutures[0].rod.section.drag = 0.0;
  Room r(d);
  auto& s = const_cast<scene::WorldState&>(r.world.state());
  for (Vector3d& v : s.threads.rod.velocity) v = Vector3d(0, 0, 0.5);
  const auto momentum = [&](bool thread, bool tissue) {
    Vector3d sum = Vector3d::Zero();
    const auto& rod = r.world.state().threads.rod;
    for (std::size_t i = 0; thread && i < rod.velocity.size(); ++i)
      sum += r.world.model().threads.rods->mass[i] * rod.velocity[i];
    const net::Block& b = r.world.state().objects[0].block;
    for (std::size_t i = 0; tissue && i < b.knots(); ++i)
      sum += double(b.row(net::Block::kMass)[i]) *
             Vector3d(b.row(net::Block::VX)[i], b.row(net::Block::VY)[i], b.row(net::Block::VZ)[i]);
    return sum;
  };
  const Vector3d start = momentum(true, true);
  r.run(40);
  EXPECT_GT(momentum(false, true).z(), 0.1 * start.z());  // it has struck
  EXPECT_LT((momentum(true, true) - start).norm(), 0.01 * start.norm());
}

TEST(Threads, OneHandTakesItFromTheOther) {
  scene::Description d;
  d.name = "air", d.hash = "0000000000000004";
  d.objects.push_back(sheet());
  d.sutures.push_back(polyglactin(line({0.2, 0, 0.3}, Vector3d(0, 0, -1), 60)));
  Room r(d);
  for (int i = 0; i < 1200; ++i) {
    r.input.tools[0] = specimen::grasper({0.2, 0, 0.297}, i < 600 ? 0.0 : 0.5);
    // From the side, across the thread.
    r.input.tools[1] =
        specimen::grasper({0.194, 0, 0.28}, -Vector3d::UnitX(), Vector3d::UnitY(), i < 300 ? 0.5 : 0.0);
    r.input.tools[1].present = i > 100;
    r.run(1);
  }
  EXPECT_EQ(r.grasped, 2);
  EXPECT_EQ(r.released, 1);
  EXPECT_FALSE(r.world.state().threads.grips[0].active);
  EXPECT_TRUE(r.world.state().threads.grips[1].active);
  r.run(800);
  EXPECT_LT(nodesOf(r.world).back().z(), 0.25);
  EXPECT_GT(nodesOf(r.world).back().z(), 0.20);  // it has not fallen
}

TEST(Threads, ClosedJawsAreSolidToAThreadThatComesToThem) {
  // It hangs across closed jaws of a lying grasper, at their middle: it lies on them, on both broad sides.
  for (const bool blades : {false, true}) {
    for (const bool turned : {false, true}) {
      scene::Description d;
      d.name = "air", d.hash = "0000000000000004";
      d.objects.push_back(sheet());
      d.sutures.push_back(polyglactin(line({0.18, 0, 0.303}, Vector3d::UnitX(), 40)));
      Room r(d);
      r.input.tools[0] = specimen::grasper({0.2, 0.011, 0.3}, Vector3d::UnitY(),
                                           turned ? Vector3d::UnitZ() : Vector3d::UnitX(), 0.0);
      if (blades) r.input.tools[0].tool = tools::ToolKind::Scissors;
      for (int i = 0; i < 400; ++i) {
        r.run(1);
        ASSERT_GT(nodesOf(r.world)[20].z(), 0.2999) << blades << turned << i;
      }
      EXPECT_EQ(r.grasped, 0) << turned;
      EXPECT_EQ(r.cuts, 0) << turned;
    }
  }
}

TEST(Threads, JawsThatHoldOneThreadAreSolidToAnother) {
  // They hold one that hangs down; the other falls across their narrow side, as a throw does that slides off.
  scene::Description d;
  d.name = "air", d.hash = "0000000000000004";
  d.objects.push_back(sheet());
  d.sutures.push_back(polyglactin(line({0.2, 0, 0.305}, -Vector3d::UnitZ(), 40)));
  std::vector<Vector3d> across;
  for (int i = -7; i <= 7; ++i) across.push_back({0.2 + 0.003 * i, 0.006, 0.303});
  d.sutures.push_back(polyglactin(across));
  d.sutures[1].rod.name = "other";
  Room r(d);
  r.input.tools[0] = specimen::grasper({0.2, 0.011, 0.3}, Vector3d::UnitY(), Vector3d::UnitX(), 0.0);
  for (int i = 0; i < 300; ++i) {
    r.run(1);
    ASSERT_GT(nodesOf(r.world)[41 + 7].z(), 0.2999) << i;
  }
  EXPECT_EQ(r.grasped, 1);
  const auto& grip = r.world.state().threads.grips[0];
  ASSERT_TRUE(grip.active);
  for (int k = 0; k < grip.count; ++k) EXPECT_LT(grip.nodes[static_cast<std::size_t>(k)].node, 41U);
}

TEST(Threads, ScissorsPartIt) {
  scene::Description d;
  d.name = "air", d.hash = "0000000000000004";
  d.objects.push_back(sheet());
  d.gravity.setZero();
  d.sutures.push_back(polyglactin(line({0.17, 0, 0.3}, Vector3d::UnitX(), 60)));
  Room r(d);
  for (int i = 0; i < 300; ++i) {
    r.input.tools[0] = specimen::grasper({0.2, 0, 0.292}, std::max(0.0, 0.6 - 0.003 * i));
    r.input.tools[0].tool = tools::ToolKind::Scissors;
    r.run(1);
  }
  EXPECT_EQ(r.cuts, 1);
  std::vector<scene::ThreadView> pieces;
  r.world.threads(pieces);
  ASSERT_EQ(pieces.size(), 2u);
  EXPECT_EQ(pieces[0].positions.size() + pieces[1].positions.size(), 61u);
  EXPECT_NEAR(pieces[0].positions.back().x(), 0.2, 0.006);
}

TEST(Threads, ItBreaksAtItsStrength) {
  scene::Description d;
  d.name = "air", d.hash = "0000000000000004";
  d.objects.push_back(sheet());
  d.gravity.setZero();
  d.sutures.push_back(polyglactin(line({0.2, -0.02, 0.3}, Vector3d(0, 1, 0), 40)));
  d.sutures[0].strength = 5.0, d.sutures[0].knot_strength = 3.0;
  Room r(d);
  double greatest = 0.0;
  for (int i = 0; i < 600; ++i) {
    const double out = 0.00002 * i;
    const Vector3d down = -Vector3d::UnitZ(), x = Vector3d::UnitX();
    r.input.tools[0] = specimen::grasper({0.2, -0.017 - out, 0.295}, down, x, 0.0);
    r.input.tools[1] = specimen::grasper({0.2, 0.017 + out, 0.295}, down, x, 0.0);
    r.run(1);
    if (r.torn == 0) greatest = std::max(greatest, std::fabs(r.report.contacts[0].wrench[1]));
  }
  EXPECT_EQ(r.grasped, 2);
  EXPECT_EQ(r.torn, 1);
  EXPECT_NEAR(greatest, 5.0, 0.5);
  std::vector<scene::ThreadView> pieces;
  r.world.threads(pieces);
  EXPECT_EQ(pieces.size(), 2u);
}

TEST(Threads, ItBreaksByALoadThatLastsAndNotByThatOfOneMoment) {
  // Its halves fly apart at 0.1 m/s, so that a step of 1 ms bears half of their momentum as tension in the
  // middle.
  scene::Description d;
  d.name = "air", d.hash = "0000000000000004";
  d.objects.push_back(sheet());
  d.gravity.setZero();
  d.sutures.push_back(polyglactin(line({0.18, 0, 0.3}, Vector3d::UnitX(), 40)));
  constexpr double kSpeed = 0.1;                                                              // m/s
  const double load = 20 * d.sutures[0].rod.section.linear_density * 0.001 * kSpeed / 0.001;  // N
  d.sutures[0].strength = d.sutures[0].knot_strength = 0.5 * load;
  const auto jerk = [](Room& r) {
    auto& rod = const_cast<scene::WorldState&>(r.world.state()).threads.rod;
    for (std::size_t i = 0; i < rod.velocity.size(); ++i)
      rod.velocity[i] = (i < 20 ? -kSpeed : i > 20 ? kSpeed : 0.0) * Vector3d::UnitX();
  };
  const auto tension = [](const Room& r) {
    const auto& m = *r.world.model().threads.rods;
    return suture::tensionOf(m, r.world.state().threads.rod, m.strands[0], 20);
  };
  Room r(d);
  jerk(r);
  r.run(1);
  EXPECT_GT(tension(r), d.sutures[0].strength) << "beyond what it bears, but for a moment";
  r.run(10);
  EXPECT_EQ(r.torn, 0);
  for (int i = 0; i < 2; ++i) jerk(r), r.run(1);
  EXPECT_EQ(r.torn, 1);
}

TEST(Threads, ASnapshotGoesOnWithTheSameBits) {
  Room a(onSheet()), b(onSheet());
  const auto hold = [](Room& r, int i) {
    r.input.tools[0] =
        specimen::grasper(onSheet().sutures[0].rod.nodes[5] + Vector3d(0, 0, 0.00005 * i - 0.002), 0.0);
    r.run(1);
  };
  for (int i = 0; i < 200; ++i) hold(a, i);
  EXPECT_TRUE(a.world.state().threads.grips[0].active);
  std::vector<std::uint8_t> bytes;
  a.world.save(bytes);
  b.run(30);  // somewhere else
  b.world.restore(bytes);
  ASSERT_EQ(a.world.stateHash(), b.world.stateHash());
  for (int i = 200; i < 300; ++i) {
    hold(a, i), hold(b, i);
    ASSERT_EQ(a.world.stateHash(), b.world.stateHash()) << i;
  }
}

TEST(Threads, TheSameBitsForAnyNumberOfWorkers) {
  std::vector<std::uint64_t> hashes;
  for (const int workers : {1, 2, 4}) {
    Room r(underTube(), workers);
    for (int i = 0; i < 300; ++i) {
      r.input.tools[0] = specimen::grasper({0, -0.008, 0.068 + 0.00003 * i}, 0.0);
      r.input.tools[1] = specimen::grasper({0, 0.008, 0.068}, 0.0);
      r.run(1);
    }
    hashes.push_back(r.world.stateHash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Threads, YankedAboutItNeverEndsInAFault) {
  const int sequences = std::getenv("VEST_FULL") != nullptr ? 1000 : 2;
  std::printf("count: %d of 1000 sequences of 200 steps\n", sequences);
  for (int n = 0; n < sequences; ++n) {
    Room r(underTube());
    std::mt19937 random(static_cast<unsigned>(n));
    const auto unit = [&random] { return 2.0 * static_cast<double>(random()) / 4294967295.0 - 1.0; };
    std::array<Vector3d, 2> tip{Vector3d(0, -0.008, 0.068), Vector3d(0, 0.008, 0.068)}, way;
    for (int i = 0; i < 200; ++i) {
      for (std::size_t t = 0; t < 2; ++t) {
        if (i % 40 == 0) way[t] = 0.001 * Vector3d(unit(), unit(), unit());  // up to 1.7 m/s
        if ((tip[t] + way[t] - Vector3d(0, 0, 0.06)).norm() < 0.06) tip[t] += way[t];
        r.input.tools[t] = specimen::grasper(tip[t], i > 120 && i % 50 < 10 ? 0.5 : 0.0);
      }
      ASSERT_NE(r.step(), scene::Status::Fault) << "sequence " << n << ", step " << i;
      for (const Vector3d& x : nodesOf(r.world)) ASSERT_TRUE(x.allFinite() && x.norm() < 3.0);
    }
  }
}

}  // namespace
