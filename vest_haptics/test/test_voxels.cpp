// Protects a hand that holds a needle or a probe in a patient's image: what the World asks for is what the
// device shows, smoothly, through limiter, gate and passivity control; and nothing where there is nothing.
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>

#include <gtest/gtest.h>

#include "vest_haptics/device/simulated.h"
#include "vest_haptics/trial/trial.h"
#include "vest_tissue/solver/random.h"
#include "voxel_bench.h"

using namespace vest;
using namespace vest::haptics;
using Eigen::Vector3d;
using namespace vest::haptics::testing;

namespace {

/// A hand above the block that holds its handle firmly; the tip's frame begins 10 mm above the surface.
struct Hand {
  SimulatedDevice device;
  scene::World world;
  std::unique_ptr<Trial> trial;
  std::int64_t now = 0;
  TrialSample last;
  Vector3d before = Vector3d::Zero();
  double jump = 0, taken = 0, lowest = 0, maximum = 0;
  int punctured = 0, exited = 0;

  explicit Hand(tools::ToolKind tool, double above = 0.010, const DeviceOptions& kind = {},
                double stiffness = 64)
      : world(block(stiffness)) {
    device.open(kind);
    maximum = device.capabilities().maximum[0];
    ControllerOptions options;
    options.arm = vest::haptics::testing::arm();
    options.arm.aim_B.z() = kSurface + above;
    if (device.capabilities().joints)
      device.wish(2, options.arm.pivot_B.z() - options.arm.aim_B.z());
    else
      for (int a = 0; a < 3; ++a) device.axis(a).hand_stiffness = 2000.0;
    trial = std::make_unique<Trial>(world, tool, device, options);
    for (int i = 0; i < 2200; ++i) tick();
    jump = taken = lowest = 0;
  }
  void tick() {
    const Vector3d at(device.axis(0).x, device.axis(1).x, device.axis(2).x);
    last = trial->tick(now += 1000000, 0.0);
    const Vector3d moved = Vector3d(device.axis(0).x, device.axis(1).x, device.axis(2).x) - at;
    taken -= last.shown.dot(moved);
    lowest = std::min(lowest, taken);
    jump = std::max(jump, (last.shown - before).norm());
    before = last.shown;
    for (const scene::Event& e : trial->step().events) {
      punctured += e.kind == scene::EventKind::Punctured && e.object == 0;
      exited += e.kind == scene::EventKind::Exited && e.object == 0;
    }
  }
  void go(const Vector3d& to, double speed) {
    Vector3d from;
    for (int a = 0; a < 3; ++a) from[a] = device.axis(a).x;
    const int n = std::max(1, static_cast<int>((to - from).norm() / speed * 1000));
    for (int i = 1; i <= n; ++i) {
      for (int a = 0; a < 3; ++a) device.wish(a, from[a] + (to[a] - from[a]) * i / n);
      tick();
    }
  }
};

}  // namespace

TEST(VoxelHaptics, ANeedleIsFeltAsTheLawHasItAndSmoothly) {
  Hand hand(tools::ToolKind::InjectionNeedle, 0.010 + kReach);
  hand.go({0, 0, -0.030}, 0.010);
  const double depth = kSurface - (hand.last.tip.z() - kReach), theory = kYield + kFriction * depth;
  EXPECT_GT(depth, 0.015);
  EXPECT_NEAR(hand.last.asked.z(), theory, 0.05 * theory);
  EXPECT_NEAR(hand.last.shown.z(), theory, 0.05 * theory);
  EXPECT_NEAR(hand.trial->step().contacts[0].wrench[2], theory, 0.05 * theory) << "what the World tells";
  EXPECT_EQ(hand.punctured, 1);
  hand.go({0, 0, 0.005}, 0.010);
  hand.go({0, 0, 0.006}, 0.010);
  EXPECT_EQ(hand.exited, 1);
  EXPECT_LT(hand.last.asked.norm(), 1e-9) << "nothing in the air";
  EXPECT_LT(hand.last.shown.norm(), 0.02);
  EXPECT_LE(hand.jump, 0.05 * hand.maximum);
  EXPECT_GE(hand.lowest, -1e-4) << "J given back";
}

TEST(VoxelHaptics, AProbePressesAsAFlatPunch) {
  Hand hand(tools::ToolKind::Grasper);
  hand.go({0, 0, -0.016}, 0.010);
  hand.go({0, 0, -0.016}, 0.010);
  const double depth = kSurface - hand.last.tip.z();
  EXPECT_GT(depth, 0.004);
  EXPECT_NEAR(hand.last.shown.z(), 64 * depth, 0.05 * 64 * depth);
  EXPECT_EQ(hand.punctured, 0) << "a probe punctures nothing";
  hand.go({0, 0, 0}, 0.010);
  EXPECT_LT(hand.last.shown.norm(), 0.02);
  EXPECT_LE(hand.jump, 0.05 * hand.maximum);
}

TEST(VoxelHaptics, ElasticitiesAreFeltByBothKindsOfDevices) {
  for (const char* const axes : {"cartesian", "joints"})
    for (const double stiffness : {40.0, 64.0, 160.0}) {
      SCOPED_TRACE(std::string(axes) + " " + std::to_string(stiffness));
      Hand hand(tools::ToolKind::Grasper, 0.010, {{"axes", axes}}, stiffness);
      const bool joints = hand.device.capabilities().joints;
      EXPECT_NEAR(hand.last.tip.z(), kSurface + 0.010, 1e-3);
      const double from = hand.device.axis(2).x;
      for (int i = 1; i <= 2400; ++i) {
        hand.device.wish(2, from + (joints ? 1 : -1) * 0.016 * std::min(1.0, i / 1600.0));
        hand.tick();
      }
      const double depth = kSurface - hand.last.tip.z();
      EXPECT_GT(depth, 0.003);
      EXPECT_NEAR(hand.last.shown.z(), stiffness * depth, 0.05 * stiffness * depth);
    }
}

TEST(VoxelHaptics, RandomStrokesGiveBackNoEnergy) {
  const auto strokes = counted(1000000, 400, "strokes of needle and probe behind the passivity control");
  for (const auto tool : {tools::ToolKind::InjectionNeedle, tools::ToolKind::Grasper}) {
    Hand hand(tool, tool == tools::ToolKind::Grasper ? 0.010 : 0.010 + kReach);
    for (std::int64_t s = 0; s < strokes / 2; ++s) {
      const auto u = [&](std::uint64_t i) {
        return solver::randomUniform(17, static_cast<std::uint64_t>(s), i);
      };
      hand.go({0.008 * (u(0) - 0.5), 0.008 * (u(1) - 0.5), -0.010 - 0.012 * (u(2) - 0.3)},
              0.02 + 0.18 * u(3));
    }
    hand.go({0, 0, 0.002}, 0.05);
    EXPECT_GT(hand.taken, 0.0) << tools::toolName(tool);
    EXPECT_GE(hand.lowest, -1e-4) << "J given back: " << tools::toolName(tool);
  }
}

TEST(VoxelHaptics, AVolumeOfAnotherSceneIsNotFelt) {
  const std::string name = "/vest_test_voxels_" + std::to_string(::getpid());
  shared::ContactWriter writer(name);
  const auto memory = std::make_shared<shared::ContactReader>(name);
  const scene::Description scene = block();
  const std::uint64_t number = writer.shareVolume(*scene.feel);
  EXPECT_EQ(memory->connect(), "");
  SimulatedDevice device;
  device.open({});
  for (const std::uint64_t says : {number, number + 1, std::uint64_t{0}}) {
    ControllerOptions options = vest::haptics::testing::options();
    options.arm.aim_B.z() = kSurface + 0.01;
    Loop loop(device, options, memory);
    shared::ContactImage image;
    image.volume = says;
    image.contacts[0].flags = shared::kFlagPresent;
    image.contacts[0].feels = static_cast<std::uint64_t>(voxel::Kind::Needle);
    double most = 0;
    for (std::int64_t t = 1; t < 400; ++t) {
      device.axis(2).x = -5e-5 * static_cast<double>(t);
      image.step = static_cast<std::uint64_t>(t), image.steady_ns = t * 1000000;
      image.contacts[0].commanded[2] = image.contacts[0].position[2] = kSurface + 0.01 + device.axis(2).x;
      writer.write(image);
      most = std::max(most, loop.tickOnce(t * 1000000).force_true_W.norm());
    }
    if (says == number) {
      EXPECT_GT(most, 0.5) << "that of this scene is";
    } else {
      EXPECT_EQ(most, 0.0);
    }
    writer.beginGeneration();
  }
  ::shm_unlink(name.c_str());
}

TEST(VoxelHaptics, WhatIsNotSoundIsNotFelt) {
  const scene::Description scene = block();
  const auto forceWith = [&](std::uint64_t kind, double reach) {
    ControllerOptions options = vest::haptics::testing::options();
    options.arm.aim_B.z() = kSurface + 0.01;
    Controller controller(vest::haptics::testing::cartesian(), options);
    TickInput input;
    shared::ContactImage image;
    image.generation = 1;
    image.contacts[0].flags = shared::kFlagPresent;
    image.contacts[0].feels = kind;
    image.contacts[0].reach = reach;
    input.image = &image;
    input.volume = scene.feel->view();
    input.status = DeviceStatus::Ok;
    Vector3d force = Vector3d::Zero();
    for (std::int64_t t = 1; t < 400; ++t) {
      input.sample.position.z() = -5e-5 * static_cast<double>(t);
      input.now_ns = image.steady_ns = t * 1000000;
      image.step = static_cast<std::uint64_t>(t);
      image.contacts[0].commanded[2] = image.contacts[0].position[2] =
          kSurface + 0.01 + input.sample.position.z();
      force = controller.tick(input).force_true_W;
    }
    return force;
  };
  EXPECT_GT(forceWith(1, 0.0).z(), 0.5) << "a needle";
  EXPECT_GT(forceWith(2, 0.0).z(), 0.3) << "a probe";
  EXPECT_EQ(forceWith(7, 0.0).norm(), 0.0) << "no kind of tool";
  EXPECT_TRUE(forceWith(1, std::nan("")).allFinite());
}
