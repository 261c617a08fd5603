#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "blades.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world_model.h"

// Protects that what is cut free falls in the scene that trainees use: the tube is clipped, divided and freed
// from its mesosalpinx under traction, drops, and is taken away.

namespace {

using namespace vest;
using Eigen::Vector3d;

/// The left tube under four instruments; world frame, z up.
class Operation {
 public:
  Operation()
      : description_(
            scene::loadScene(std::string(VEST_TISSUE_SOURCE_DIR) + "/scenes/gynaecology/gynaecology.yaml")),
        world_(description_) {
    while (description_.objects[tube_].name != "tube_left") ++tube_;
  }

  Vector3d ring(std::size_t n) const {
    const auto& knots = description_.objects[tube_].tube.rings[n];
    Vector3d sum = Vector3d::Zero();
    for (const auto k : knots) sum += world_.knotAt(tube_, k) / static_cast<double>(knots.size());
    return sum;
  }
  std::size_t tethers() const { return world_.state().objects[tube_].elements.tethers.size(); }

  void run(int steps) {
    for (int i = 0; i < steps; ++i) {
      in.step = world_.steps();
      ASSERT_NE(world_.step(in, report_), scene::Status::Fault);
      for (const auto& e : report_.events) clips += e.kind == scene::EventKind::Clipped && e.object == tube_;
    }
  }
  /// Jaws close across the tube, from above.
  void bite(tools::ToolKind kind, std::size_t at, double open) {
    const Vector3d along = ring(at + 1) - ring(at - 1);
    in.tools[1] = specimen::toolAt(kind, ring(at) - Vector3d(0, 0, 0.004), -Vector3d::UnitZ(),
                                   along.cross(Vector3d::UnitZ()), open);
    run(20);
    for (int i = 0; i < 150; ++i) in.tools[1].jaw = open * (1.0 - i / 149.0), run(1);
    for (int i = 0; i < 30; ++i) in.tools[1].jaw = 0.02 * i, run(1);
    in.tools[1].present = false;
    run(50);
  }
  void grasp(std::size_t at, double lift) {
    in.tools[0] = specimen::toolAt(tools::ToolKind::Grasper, ring(at) - Vector3d(0, 0, 0.004),
                                   -Vector3d::UnitZ(), Vector3d::UnitY(), 1.0);
    run(20);
    for (int i = 0; i < 60; ++i) in.tools[0].jaw = 1.0 - i / 59.0, run(1);
    for (int i = 0; i < static_cast<int>(lift / 1e-4); ++i) in.tools[0].position.z() += 1e-4, run(1);
  }
  /// A hook under current passes between the tube and what it hangs on, beyond a ring, from one side (±1).
  /// @return connections that are left there
  int free(std::uint32_t beyond, double side) {
    int left = 0;
    for (std::size_t n = 0; n < description_.connections.size(); ++n) {
      const auto& c = description_.connections[n];
      const auto& s = world_.state().connections[n];
      const std::uint32_t at = c.knot0 / 6;
      if (c.object0 != "tube_left" || at < beyond || !s.alive) continue;
      Vector3d foot = Vector3d::Zero();
      for (std::size_t e = 0; e < 3; ++e)
        foot += s.end1.weights[e] * world_.knotAt(s.end1.object, s.end1.knots[e]);
      const Vector3d middle = 0.5 * (foot + world_.knotAt(tube_, s.end0.knots[0]));
      const Vector3d along = (ring(at + 1) - ring(at - 1)).normalized(),
                     across = side * along.cross(Vector3d::UnitZ()).normalized();
      for (int i = 0; i < 40; ++i) {
        in.tools[1] = specimen::toolAt(tools::ToolKind::CoagulationHook,
                                       middle - 0.008 * across + 0.0002 * (i - 20) * along, across, along);
        in.tools[1].functions = tools::kFunctionCut;
        run(1);
      }
      in.tools[1].present = false;
      run(1);
      left += s.alive;
    }
    return left;
  }

  /// Jaws that come by the left trocar take the tube and draw it out there, at 0.1 m/s.
  void drawOut(std::size_t at) {
    const Vector3d pivot(-0.115, -0.02, 0.165), target = ring(at), along = ring(at + 1) - ring(at - 1),
                                                way = target - pivot, z = way.normalized();
    double depth = way.norm() + 0.005;
    const auto hold = [&](double jaw) {
      in.tools[0] = specimen::toolAt(tools::ToolKind::Grasper, pivot + depth * z, z, along.cross(z), jaw);
      in.tools[0].pivot = pivot;
      run(1);
      fastest = std::max(fastest, specimen::fastestKnot(world_));
    };
    for (int i = 0; i < 300; ++i) hold(0.9 - 0.85 * std::clamp(i / 200.0 - 0.15, 0.0, 1.0));
    fastest = 0.0;
    for (; depth > 0.001; depth -= 1e-4) hold(0.05);
    const double drawing = fastest;
    for (int i = 0; i < 1000; ++i) fastest = i < 500 ? 0.0 : fastest, hold(0.05);
    resting = fastest, fastest = drawing;
  }

  scene::StepInput in;
  int clips = 0;
  double fastest = 0.0, resting = 0.0;  ///< m/s, of any knot: while it is drawn out, and afterwards

 private:
  scene::Description description_;
  scene::World world_;
  scene::StepReport report_;
  std::size_t tube_ = 0;
};

TEST(Gynaecology, ATubeThatIsClippedAndCutOutDropsAndIsTakenAway) {
  Operation o;
  const double start = o.ring(14).z(), stump = o.ring(1).z();
  o.bite(tools::ToolKind::ClipApplier, 3, 0.6);
  ASSERT_EQ(o.clips, 1);
  o.bite(tools::ToolKind::Scissors, 5, 0.8);
  int left = 1;
  for (int pass = 0; pass < 8 && left > 0 && !HasFatalFailure(); ++pass) {
    if (pass == 2) o.grasp(8, 0.01);  // traction
    left = o.free(6, pass % 2 == 0 ? -1.0 : 1.0);
  }
  ASSERT_EQ(left, 0) << "connections that hold it";
  EXPECT_LT(o.tethers(), 50u) << "the stump's alone: its surroundings no longer carry what is cut out";
  o.in.tools[0].present = false;
  o.run(500);
  EXPECT_LT(o.ring(14).z(), start - 0.03) << "it drops";
  EXPECT_LT(o.ring(22).z(), start - 0.03);
  EXPECT_NEAR(o.ring(1).z(), stump, 0.002) << "the stump stays";
  const double fallen = o.ring(14).z();
  o.grasp(14, 0.05);
  o.run(100);
  EXPECT_GT(o.ring(14).z(), fallen + 0.04) << "taken away";
  EXPECT_NEAR(o.ring(1).z(), stump, 0.002);
  // In the trocar distances to the wall that mean nothing beat the tube about by 10 mm a step: 30 m/s.
  o.in.tools[0].present = false;
  o.run(300);
  o.drawOut(14);
  EXPECT_LT(o.fastest, 10.0) << "m/s, on its way out";
  EXPECT_LT(o.resting, 1.0) << "m/s, in the trocar";
}

}  // namespace
