// Threads in a World never go through themselves or each other, whatever instruments do with them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "crossings.h"
#include "knots.h"
#include "nets.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/suture/knot_kind.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

/// Silk, 0, in segments as those of the scene thread_throw; it does not break.
scene::Suture silk(const std::string& name, const std::vector<Vector3d>& nodes) {
  scene::Suture s;
  s.material = "silk", s.size = "0", s.kind = 2;
  s.strength = s.knot_strength = 1000.0;
  s.rod.name = name;
  s.rod.nodes = nodes;
  s.rod.section = suture::specimen::silk();
  return s;
}

struct Room {
  scene::World world;
  scene::StepInput input;
  scene::StepReport report;
  std::vector<scene::ThreadView> threads;
  std::vector<std::size_t> starts;
  int through = 0;

  explicit Room(const scene::Description& d, int workers = 1) : world(d, workers) {
    const auto& strands = world.model().threads.rods->strands;
    for (std::size_t n = 1; n < strands.size(); ++n) starts.push_back(strands[n].first);
  }
  const std::vector<Vector3d>& nodes() const { return world.state().threads.rod.position; }
  void step() {
    const auto was = nodes();
    input.step = world.steps();
    ASSERT_NE(world.step(input, report), scene::Status::Fault);
    through += std::abs(suture::specimen::crossings(was, nodes(), starts));
  }
  double pull(int tool) const {
    return report.contacts[static_cast<std::size_t>(tool)].wrench.head<3>().norm();
  }
};

scene::Description air() {
  scene::Description d;
  d.name = "air", d.hash = "0000000000000005";
  d.objects.push_back(specimen::tubeScene({}).objects[0]);
  for (Vector3d& x : d.objects[0].position) x.z() -= 1.0;
  d.objects[0].rest_position = d.objects[0].position;
  return d;
}

TEST(ThreadPassage, ATurnDrawnAgainstTheJawsThatHoldTheOtherStrandStaysOutside) {
  constexpr double l = 0.00075, r = 0.0012;
  const Vector3d centre(0.3, 0.0, 0.3);
  constexpr double speed = 0.2;  // m/s
  for (const double lean : {-1.5, -0.5, 0.5}) {
    scene::Description d = air();
    std::vector<Vector3d> a, b;
    for (int i = -30; i <= 40; ++i) a.push_back(centre + Vector3d(l * i, 0, 0));
    for (int i = -40; i <= 40; ++i) {
      const double at = l * i, half = 0.5 * M_PI * r;
      const double z = std::abs(at) < half ? -r * std::cos(at / r) : std::abs(at) - half;
      b.push_back(centre + Vector3d(0.002, std::abs(at) < half ? r * std::sin(at / r) : at > 0 ? r : -r, z));
    }
    d.sutures.push_back(silk("held", a));
    d.sutures[0].rod.held = {{0, suture::Hold::Place, {}}, {70, suture::Hold::Place, {}}};
    d.sutures.push_back(silk("turn", b));
    Room m(d);
    double most = 0.0;
    for (int k = 0; k < 400 && most < 12.0; ++k) {
      const Vector3d by = 0.001 * speed * std::max(0, k - 20) * Vector3d(lean, 0, 1).normalized(),
                     y = Vector3d::UnitY();
      m.input.tools[0] = specimen::grasper(centre - Vector3d(0.002, 0, 0.004), -Vector3d::UnitZ(), y, 0.0);
      for (int t = 1; t <= 2; ++t) {
        const double side = t == 1 ? -1.0 : 1.0;
        m.input.tools[t] =
            specimen::grasper(centre + by + Vector3d(0.002, side * (r - 0.006), l * 36 - 0.5 * M_PI * r),
                              -side * y, Vector3d::UnitX(), 0.0);
        m.input.tools[t].pivot = m.input.tools[t].position + Vector3d(0, side * 0.12, 0);
      }
      m.step();
      most = m.pull(1);
      ASSERT_EQ(m.through, 0) << lean << ", step " << k << ", " << most << " N";
    }
    EXPECT_GT(most, 12.0) << "N: it was drawn";
  }
}

TEST(ThreadPassage, ATurnDrawnOffJawsThatHoldAnotherThreadDoesNotComeBetweenThem) {
  // A needle holder holds a thread aslant and draws back. A turn of another thread lies round it, both of its
  // ends are held ahead. The held thread stops it where it leaves the jaws. A turn that came between them
  // slid along the held thread and off its end, with 0.5 N, and left no throw.
  const Vector3d tip(0.3, 0.0, 0.3);
  const auto at = [&](double x, double y, double z) { return Vector3d(tip + Vector3d(y, x, -z)); };
  scene::Description d = air();
  std::vector<Vector3d> a, b;
  for (int i = -30; i <= 14; ++i) a.push_back(at(0, -0.000375 * i, -0.0045 + 0.00065 * i));
  for (double z = 0.025; z > -0.0108; z -= 0.00075) b.push_back(at(0.00275, 0, z));
  for (int i = 1; i <= 19; ++i) {
    const double f = i / 19.0, angle = 2.0 * M_PI * f, wide = 1.0 + 0.15 * f;
    b.push_back(at(wide * 0.00275 * std::cos(angle), wide * 0.0016 * std::sin(angle), -0.0108 + 0.0006 * f));
  }
  for (double z = -0.00945; z < 0.025; z += 0.00075) b.push_back(at(0.00316, 0, z));
  d.sutures = {silk("held", a), silk("turn", b)};
  const auto last = static_cast<std::uint32_t>(b.size() - 1);
  d.sutures[1].rod.held = {{0, suture::Hold::Place, {}}, {last, suture::Hold::Place, {}}};
  Room m(d);
  double most = 0.0;
  for (int k = 0; k < 900 && most < 2.0; ++k) {
    const Vector3d moved = tip + 2e-5 * std::max(0, k - 50) * Vector3d::UnitZ();
    m.input.tools[0] = specimen::grasper(moved, -Vector3d::UnitZ(), Vector3d::UnitY(), 0.0);
    m.input.tools[0].tool = tools::ToolKind::NeedleHolder;
    m.step();
    ASSERT_EQ(m.through, 0) << "step " << k;
    most = std::max(most, m.pull(0));
  }
  EXPECT_GE(most, 2.0) << "N, by which it is drawn";
}

TEST(ThreadPassage, AThrowHeldWithTenNewtonsThatSpringsOpenStaysAThrow) {
  constexpr double speed = 0.2;  // m/s
  scene::Description d = air();
  suture::RodDescription rod = suture::specimen::overhand(110, 0.00075, 0.05);
  const Vector3d centre(0.3, 0.0, 0.3);
  for (Vector3d& x : rod.nodes) x += centre;
  d.sutures.push_back(silk("thread", rod.nodes));
  const Vector3d first = rod.nodes[4], last = rod.nodes[106], way = (last - first).normalized();
  Room m(d);
  suture::KnotScratch scratch(rod.nodes.size());
  double by = 0.0, tension = 0.0, jaw = 0.0;
  int held = 0, told = 0, told_before = 0;
  for (int k = 0; k < 1500 && held < 400; ++k) {
    if (tension < 10.0 && held == 0)
      by += k > 20 ? 0.001 * speed : 0.0;
    else if (++held > 150)
      jaw = 0.6;
    const Vector3d down = -Vector3d::UnitZ(), x = way.cross(down).normalized();
    m.input.tools[0] = specimen::grasper(first - by * way + 0.004 * down, down, x, jaw);
    m.input.tools[1] = specimen::grasper(last + by * way + 0.004 * down, down, x, jaw);
    m.step();
    m.world.threads(m.threads);
    tension = m.threads[0].tension[15];
    for (const scene::Event& e : m.report.events) {
      if (e.kind != scene::EventKind::KnotTied) continue;
      ++told, told_before += by < 0.001;
      EXPECT_EQ(e.object, m.world.description().objects.size()) << "behind the objects: the first thread";
      EXPECT_GT(e.force, 0.5) << "N: the thread presses on itself";
    }
    ASSERT_EQ(m.through, 0) << "step " << k << ", " << tension << " N";
  }
  EXPECT_EQ(told, 1) << "once, although it is drawn for a second, held and let go";
  EXPECT_EQ(told_before, 0) << "a loose knot is not told";
  EXPECT_EQ(held, 400) << "it was drawn with 10 N";
  EXPECT_FALSE(m.world.state().threads.grips[0].active);
  m.world.threads(m.threads);
  EXPECT_EQ(suture::kindOf(m.threads[0].positions.data(), rod.nodes.size(), scratch).determinant, 3);
}

/// m: how deep a taut thread sinks into a shaft that pushes it aside by 2 mm.
double sinks(bool beside) {
  constexpr double l = 0.00075, radius = 0.0001875 + 0.0025;
  const Vector3d tip(0.3, 0.0, 0.3);
  scene::Description d = air();
  std::vector<Vector3d> taut, other;
  for (int i = -30; i <= 30; ++i) taut.push_back(tip + Vector3d(l * i, radius, 0.06));
  for (int i = -40; i <= 40; ++i) other.push_back(tip + Vector3d(0, -radius - 0.0008, 0.06 + l * i));
  d.sutures.push_back(silk("taut", taut));
  d.sutures[0].rod.held = {{0, suture::Hold::Place, {}}, {60, suture::Hold::Place, {}}};
  if (beside) {
    d.sutures.push_back(silk("beside", other));
    for (std::uint32_t i = 0; i <= 80; ++i)
      d.sutures[1].rod.held.push_back({i, suture::Hold::Place, {{0.1, other[i] + Vector3d(0, 0.002, 0), 0}}});
  }
  Room m(d);
  Vector3d shaft = tip;
  for (int k = 0; k < 150; ++k) {
    shaft.y() = 2e-5 * std::min(k, 100);
    m.input.tools[0] = specimen::grasper(shaft, -Vector3d::UnitZ(), Vector3d::UnitX(), 0.0);
    m.step();
  }
  const auto& pose = m.world.state().proxies[0].pose;
  const Vector3d axis = (pose.tip - pose.pivot).normalized(), off = m.nodes()[30] - pose.tip;
  return radius - (off - off.dot(axis) * axis).norm();
}

TEST(ThreadPassage, AShaftIsNoSofterWhereMoreThreadLiesBesideIt) {
  // What does not press took its share of the shaft's stiffness, so that turns sank into jaws and went
  // through.
  const double alone = sinks(false), beside = sinks(true);
  EXPECT_GT(alone, 1e-5) << "m: it presses";
  EXPECT_NEAR(beside, alone, 1e-6) << "m: 81 nodes lie 0.8 mm from the shaft on its other side";
}

}  // namespace
