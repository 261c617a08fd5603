// Random sequences of grasp, cut, pull and release on random nets: 10^5 operations with VEST_FULL=1, else
// 10^3.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "blades.h"
#include "vest_tissue/scene/world_model.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

class Operations {
 public:
  explicit Operations(std::uint32_t seed) : random_(seed) {}

  double uniform(double low, double high) { return low + (high - low) * (random_() / 4294967296.0); }
  int choose(int n) { return static_cast<int>(random_() % static_cast<std::uint32_t>(n)); }

  scene::Description net() {
    scene::Description d;
    if (choose(2) == 0) {
      test::BarOptions o;
      o.columns = 7 + choose(6), o.rows = 2 + choose(2);
      o.spacing = uniform(0.0025, 0.004), o.thickness = uniform(0.002, 0.006);
      o.youngs_modulus = uniform(5e3, 50e3), o.bulk_modulus = choose(3) == 0 ? 0.0 : 2e4;
      o.fix_right = choose(2) == 0;
      o.centre = Vector3d(0, 0, 0.05);
      d = test::barScene(o);
    } else {
      test::TubeOptions o;
      o.rings = 8 + choose(8), o.around = 5 + choose(4);
      o.length = 0.05, o.radius = uniform(0.002, 0.004);
      o.youngs_modulus = uniform(5e3, 50e3);
      d = test::tubeScene(o);
      d.objects[0].wall_thickness = 0.001;
    }
    return d;
  }

  scene::ToolInput pose(tools::ToolKind kind, double jaw) {
    const Vector3d along(uniform(-0.7, 0.7), uniform(-0.7, 0.7), -1.0);  // from above, as through a trocar
    const Vector3d opening(uniform(-0.3, 0.3), 1.0, uniform(-0.3, 0.3));
    const Vector3d middle(uniform(-0.018, 0.018), uniform(-0.003, 0.003), uniform(0.048, 0.052));
    const double beyond =
        kind == tools::ToolKind::CoagulationHook ? uniform(-0.014, 0.0) : uniform(-0.002, 0.008);
    const Vector3d tip = middle + beyond * along.normalized();
    return test::toolAt(kind, tip, along, opening, jaw);
  }

 private:
  std::mt19937 random_;
};

/// Every invariant of safety.md that one step can break.
void check(const scene::World& w, double mass, std::size_t knots, std::size_t vertices) {
  const scene::ObjectState& s = w.state().objects[0];
  double sum = 0.0;
  for (std::size_t i = 0; i < s.block.knots(); ++i) {
    sum += s.block.row(net::Block::kMass)[i];
    ASSERT_GT(s.block.row(net::Block::kMass)[i], 0.0f);
    for (const auto r :
         {net::Block::X, net::Block::Y, net::Block::Z, net::Block::VX, net::Block::VY, net::Block::VZ})
      ASSERT_TRUE(std::isfinite(s.block.row(r)[i]));
  }
  ASSERT_NEAR(sum, mass, 1e-9 * mass);
  ASSERT_LE(s.block.knots(), 2 * knots + 64);
  const scene::Topology& t = s.topology;
  ASSERT_LE(t.links.size(), 2 * w.description().objects[0].links.size() + 64);
  for (const auto& l : t.links) ASSERT_TRUE(l.knot0 < s.block.knots() && l.knot1 < s.block.knots());
  for (const auto& f : s.triangles)
    for (const auto k : f) ASSERT_LT(k, s.block.knots());
  const std::size_t now = t.skin.binding_start.empty() ? 0 : t.skin.binding_start.size() - 1;
  ASSERT_LE(now, 2 * vertices + 2048);
  for (const auto k : t.skin.binding_knots) ASSERT_LT(k, s.block.knots());
  for (const auto weight : t.skin.binding_weights) ASSERT_TRUE(std::isfinite(weight));
  for (const auto& f : t.skin.triangles)
    for (const auto v : f) ASSERT_LT(v, now);
  for (const auto& h : s.elements.hinges)
    ASSERT_TRUE(h.edge0 < s.block.knots() && h.edge1 < s.block.knots() && h.wing0 < s.block.knots() &&
                h.wing1 < s.block.knots());
}

TEST(CutSequences, RandomGraspsCutsPullsAndReleasesKeepEveryInvariant) {
  const bool full = std::getenv("VEST_FULL") != nullptr;
  const int sequences = full ? 12500 : 125, per_sequence = 8;
  std::size_t cuts = 0, separations = 0, grasps = 0, releases = 0, degraded = 0, faults = 0;
  for (int n = 0; n < sequences; ++n) {
    Operations random(static_cast<std::uint32_t>(1000 + n));
    scene::World w(random.net());
    const std::size_t knots = w.knotCount(0);
    const std::size_t vertices = w.description().objects[0].skin.texture_coordinates.size();
    double mass = 0.0;
    for (std::size_t i = 0; i < knots; ++i) mass += w.state().objects[0].block.row(net::Block::kMass)[i];
    scene::StepInput in;
    scene::StepReport report;
    scene::Status status = scene::Status::Ok;
    const auto step = [&] {
      in.step = w.steps();
      status = w.step(in, report);
      faults += status == scene::Status::Fault;  // declared: the last good state is kept, no force
      degraded += status == scene::Status::Degraded;
      for (const auto& e : report.events) {
        cuts += e.kind == scene::EventKind::Cut, separations += e.kind == scene::EventKind::Separated;
        grasps += e.kind == scene::EventKind::Grasped, releases += e.kind == scene::EventKind::Released;
        ASSERT_TRUE(e.position.allFinite() && std::isfinite(e.force) && std::isfinite(e.energy));
      }
      for (const auto& c : report.contacts) ASSERT_TRUE(c.wrench.allFinite());
      check(w, mass, knots, vertices);
    };
    for (int operation = 0; operation < per_sequence && !HasFatalFailure(); ++operation) {
      const int what = random.choose(4);
      if (what <= 1) {  // scissors close somewhere, perhaps not entirely
        in.tools[1] = random.pose(tools::ToolKind::Scissors, 0.8);
        const double end = random.choose(2) == 0 ? 0.0 : random.uniform(0.0, 0.6);
        for (int i = 0; i <= 25; ++i) in.tools[1].jaw = 0.8 + (end - 0.8) * i / 25.0, step();
        in.tools[1].present = false;
      } else if (what == 2) {  // a hook is drawn through
        in.tools[1] = random.pose(tools::ToolKind::CoagulationHook, 0.0);
        in.tools[1].functions = tools::kFunctionCut;
        const Vector3d way(random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02),
                           random.uniform(-0.02, 0.02));
        for (int i = 0; i < 60; ++i) in.tools[1].position += way / 60, step();
        in.tools[1].present = false;
      } else {  // a grasper closes, pulls, and in half of the cases lets go
        in.tools[0] = random.pose(tools::ToolKind::Grasper, 1.0);
        for (int i = 0; i < 12; ++i) step();
        for (int i = 0; i <= 15; ++i) in.tools[0].jaw = 1.0 - i / 15.0, step();
        const Vector3d way(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01), random.uniform(0, 0.02));
        for (int i = 0; i < 15; ++i) in.tools[0].position += way / 15, step();
        if (random.choose(2) == 0) in.tools[0].present = false;
      }
      for (int i = 0; i < 5; ++i) step();
    }
    ASSERT_FALSE(HasFatalFailure());
  }
  std::printf(
      "%d operations: %zu cuts, %zu separations, %zu grasps, %zu releases, %zu degraded steps, %zu faults\n",
      sequences * per_sequence, cuts, separations, grasps, releases, degraded, faults);
  EXPECT_GE(cuts, static_cast<std::size_t>(sequences)) << "least number of successful cuts";
  EXPECT_GE(separations, static_cast<std::size_t>(sequences / 10)) << "and of separations";
  EXPECT_LE(faults, static_cast<std::size_t>(sequences / 10)) << "instruments appear within thin nets here";
  EXPECT_GE(grasps, static_cast<std::size_t>(sequences / 10));
}

}  // namespace
