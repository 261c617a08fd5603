// Protects what the hand feels of tissue, with a World behind it: forces follow the material's law, and no
// kind of contact makes a jump.
#include <gtest/gtest.h>

#include "support.h"
#include "vest_haptics/device/simulated.h"
#include "vest_haptics/trial/specimen.h"
#include "vest_haptics/trial/trial.h"

using namespace vest;
using namespace vest::haptics;
using vest::haptics::testing::full;

namespace {

void follows(const std::vector<Felt>& felt, double least_strain, const std::string& name) {
  ASSERT_GE(felt.size(), 4u) << name;
  double greatest = 0.0, strain = 0.0;
  for (const Felt& f : felt) {
    greatest = std::max(greatest, std::abs(f.law));
    strain = std::max(strain, std::abs(f.strain));
  }
  EXPECT_GT(strain, least_strain) << name;
  for (const Felt& f : felt)
    EXPECT_NEAR(f.shown, f.law, kFeltBound * greatest) << name << " at " << 1000 * f.depth << " mm";
}

/// A sweep of the hand over one kind of contact: greatest change of the force in a tick beyond coupling · Δx.
struct Sweep {
  SimulatedDevice device;
  scene::World world;
  std::unique_ptr<Trial> trial;
  std::int64_t now = 0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero(), place = Eigen::Vector3d::Zero();
  double jump = 0.0, greatest = 0.0, maximum = 0.0, jaw;
  bool contact = false, grasping = false;
  int changes = 0;  ///< of contact and of grasp

  Sweep(const scene::Description& description, tools::ToolKind tool, double start, double jaw_)
      : world(description), jaw(jaw_) {
    device.open({});
    maximum = device.capabilities().maximum[0];
    ControllerOptions options;
    options.arm = vest::haptics::testing::arm();
    options.arm.aim_B.z() = start;
    trial = std::make_unique<Trial>(world, tool, device, options);
    for (int i = 0; i < 2200; ++i) tick();
  }
  void tick() {
    const TrialSample& s = trial->tick(now += 1000000, jaw);
    const double moved = (s.tip - place).norm();
    if (now > 2000000)
      jump = std::max(jump, (s.shown - last).norm() - trial->loop().newest().stiffness * moved);
    greatest = std::max(greatest, s.shown.norm());
    changes += (s.contact != contact) + (s.grasping != grasping);
    contact = s.contact;
    grasping = s.grasping;
    last = s.shown;
    place = s.tip;
  }
  void go(const Eigen::Vector3d& to, int milliseconds) {
    Eigen::Vector3d from;
    for (int k = 0; k < 3; ++k) from[k] = device.axis(k).x;
    for (int i = 1; i <= milliseconds; ++i) {
      for (int k = 0; k < 3; ++k) device.wish(k, from[k] + (to[k] - from[k]) * i / milliseconds);
      tick();
    }
  }
  void isContinuous() const {
    EXPECT_GT(greatest, 0.02) << "nothing was felt";
    EXPECT_LE(jump, 0.05 * maximum) << "more than 5 % of full force beyond K·dx between two ticks";
  }
};

const material::Tissue& tissue(const char* name) {
  static const material::Database database = material::readDatabase(material::databasePath());
  return database.at(name);
}

}  // namespace

TEST(Trials, ForceAgainstDepthFollowsTheTissuesLawPressedAndPulled) {
  const auto pulled = vest::haptics::testing::counted(3, 1, "tissues pulled, three pressed");
  for (const char* name : {"liver", "uterus", "fat_soft"}) {
    follows(press(tissue(name)), 0.1, std::string(name) + " pressed");
    if (pulled == 3 || std::string(name) == "liver")
      follows(pull(tissue(name)), 0.5, std::string(name) + " pulled");
  }
}

TEST(Continuity, OverDeformableTissueTouchedPressedDraggedAndLeft) {
  Sweep s(pressedSlab(tissue("uterus")), tools::ToolKind::Grasper, 0.058, 0.0);
  s.go({0, 0, -0.0045}, 300);
  s.go({0.008, 0, -0.0045}, 400);
  s.go({0.008, 0.004, 0.001}, 200);
  s.go({0.002, 0, -0.004}, 150);
  s.go({0, 0, 0.004}, 100);
  EXPECT_GE(s.changes, 4);
  s.isContinuous();
}

TEST(Continuity, WhereTheJawsGraspPullAndLetGo) {
  Sweep s(pulledStrip(tissue("liver")), tools::ToolKind::Grasper, 0.065, 0.9);
  s.go({0, 0, -0.014}, 600);
  for (int i = 0; i < 300; ++i, s.jaw = std::max(0.0, s.jaw - 0.004)) s.tick();
  EXPECT_TRUE(s.grasping);
  s.go({0, 0, -0.004}, 500);
  s.go({0.004, 0, -0.004}, 200);
  for (int i = 0; i < 300; ++i, s.jaw = std::min(0.9, s.jaw + 0.004)) s.tick();
  EXPECT_FALSE(s.grasping);
  s.go({0, 0, 0.005}, 200);
  s.isContinuous();
}

TEST(Continuity, WhereWhatIsPulledIsCutThrough) {
  const scene::Description strip = pulledStrip(tissue("uterus"));
  Sweep s(strip, tools::ToolKind::Grasper, 0.065, 0.9);
  s.go({0, 0, -0.014}, 600);
  for (int i = 0; i < 300; ++i, s.jaw = std::max(0.0, s.jaw - 0.004)) s.tick();
  s.go({0, 0, 0.004}, 800);
  s.go({0, 0, 0.004}, 300);
  const double before = s.last.norm();
  EXPECT_GT(before, 0.1 * s.maximum) << "there must be something to lose";
  // All links across the strip's middle part in one step.
  const std::size_t layer = strip.objects[0].position.size() / 2 / 9 * 9;
  const auto& links = strip.objects[0].links;
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (links[i].knot0 >= layer || links[i].knot1 < layer) continue;
    scene::TopologyRequest cut;
    cut.element = static_cast<std::uint32_t>(i);
    s.trial->request(cut);
  }
  s.go({0, 0, 0.004}, 300);
  EXPECT_LT(s.last.norm(), 0.2 * before) << "it was not cut";
  s.isContinuous();
}

TEST(Continuity, AgainstSomethingRigidTouchedFastAndLeftFast) {
  scene::Description wall = pressedSlab(tissue("uterus"));
  for (auto& fixed : wall.objects[0].fixed) fixed = 1;
  Sweep s(wall, tools::ToolKind::Grasper, 0.058, 0.0);
  s.go({0, 0, -0.004}, 80);
  s.go({0.006, 0, -0.004}, 200);
  s.go({0, 0, 0.006}, 80);
  s.go({0, 0, 0.006}, 100);
  s.go({0, 0, -0.006}, 60);
  s.go({0, 0, -0.006}, 100);
  s.go({0, 0, 0.006}, 60);
  s.go({0, 0, 0.006}, 100);
  EXPECT_GE(s.changes, 4);
  s.isContinuous();
}
