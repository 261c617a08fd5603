#include <gtest/gtest.h>

#include <cmath>

#include <ros/package.h>

#include "vest_bringup/simulation/rehearsal.h"

// Protects the demo of ./run: the scripted trainee takes a uterine tube, pulls it visibly, and lets it go.

namespace vest::simulation {
namespace {

TEST(Demo, TheGrasperTakesAUterineTubePullsItVisiblyAndLetsGo) {
  const auto box =
      kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml");
  const auto trajectory =
      trajectory::fromWaypoints(ros::package::getPath("vest_bringup") + "/trajectories/demo.yaml", box);
  scene::World world(
      scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml"), 2);
  using tools::ToolKind;
  const auto report = rehearse(world, box, trajectory,
                               {ToolKind::Grasper, ToolKind::Grasper, ToolKind::None, ToolKind::Endoscope});
  EXPECT_NE(report.worst, scene::Status::Fault);
  bool grasped = false, released = false;
  for (const scene::Event& e : report.events) {
    const bool tube = world.description().objects[e.object].name.rfind("tube", 0) == 0;
    grasped = grasped || (tube && e.kind == scene::EventKind::Grasped);
    released = released || (tube && grasped && e.kind == scene::EventKind::Released);
  }
  EXPECT_TRUE(grasped);
  EXPECT_TRUE(released);
  EXPECT_GE(report.tube_displacement, 0.015);
  EXPECT_LE(report.tube_displacement, 0.080) << "pulled, not torn away";
  EXPECT_LE(report.greatest_force, 20.0) << "N; what a hand would never do";
}

TEST(Demo, ItEndsWhereItBegins) {
  const auto box =
      kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml");
  const auto t =
      trajectory::fromWaypoints(ros::package::getPath("vest_bringup") + "/trajectories/demo.yaml", box);
  for (std::size_t i = 0; i < t.moves.size(); ++i) {
    if (!t.moves[i]) continue;
    const auto &a = t.rows.front().joints[i], &b = t.rows.back().joints[i];
    EXPECT_NEAR(a.yaw, b.yaw, 1e-6);
    EXPECT_NEAR(a.pitch, b.pitch, 1e-6);
    EXPECT_NEAR(a.insertion, b.insertion, 1e-6);
    EXPECT_NEAR(a.roll, b.roll, 1e-6);
  }
}

}  // namespace
}  // namespace vest::simulation
