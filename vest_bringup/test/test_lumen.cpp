// What bending, stretching and pressing leave of a vessel's lumen, and of the blood behind.
#include <algorithm>

#include "blood_bench.h"

namespace vest::simulation {
namespace {

/// Knots of a vessel beyond a ring, turned about it: as a hand bends it.
void bend(scene::World& world, std::size_t object, std::size_t ring, double angle) {
  auto& block = const_cast<scene::WorldState&>(world.state()).objects[object].block;
  const net::TubeMap& tube = world.model().objects[object].tube;
  const auto centre = [&](std::size_t r) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto k : tube.knots(r)) sum += world.knotAt(object, k);
    return Eigen::Vector3d(sum / static_cast<double>(tube.knots(r).size()));
  };
  const Eigen::Vector3d at = centre(ring), along = (centre(ring + 1) - centre(ring - 1)).normalized();
  const Eigen::AngleAxisd turn(angle, along.unitOrthogonal());
  for (std::size_t k = 0; k < world.knotCount(object); ++k) {
    if (tube.ringOf(static_cast<std::uint32_t>(k)) <= static_cast<std::int32_t>(ring)) continue;
    const Eigen::Vector3d p = at + turn * (world.knotAt(object, k) - at);
    block.row(net::Block::X)[k] = static_cast<float>(p.x());
    block.row(net::Block::Y)[k] = static_cast<float>(p.y());
    block.row(net::Block::Z)[k] = static_cast<float>(p.z());
  }
}

TEST(Blood, AKinkHoldsTheBloodBackAndAGentleBendDoesNot) {
  double flow[3];
  const double angles[3] = {0, 0.5, 2.7};  // rad
  for (int i = 0; i < 3; ++i) {
    Bench b;
    EXPECT_EQ(b.effect.kinks().count, 0);
    const auto object = objectNamed(b.world, "uterine_artery_left");
    const net::TubeMap& tube = b.world.model().objects[object].tube;
    bend(b.world, object, tube.ringCount() / 3, angles[i]);
    b.event(scene::EventKind::Separated, "uterine_artery_left", tube.station(2 * tube.ringCount() / 3),
            std::nan(""));
    for (int k = 0; k < 300; ++k) b.step();
    flow[i] = 0;
    for (const auto& source : b.feedback.sources) flow[i] += source.flow;
    ASSERT_EQ(b.effect.wounds().opening_count, 2);
    flow[i] = b.effect.wounds().openings[0].end == bleeding::End::kHeart ? b.effect.wounds().openings[0].flow
                                                                         : b.effect.wounds().openings[1].flow;
    EXPECT_EQ(b.effect.kinks().count, i == 2 ? 1 : 0) << angles[i] << " rad";
    if (i != 2) continue;
    std::vector<std::uint8_t> bytes;
    b.effect.save(bytes);
    b.effect.reset();
    ASSERT_TRUE(b.effect.restore(bytes.data(), bytes.size()));
    EXPECT_EQ(b.effect.kinks().count, 1) << "a snapshot has it";
  }
  std::printf("heart's stump: %.3f ml/s, bent by 29 degrees %.3f, kinked %.3f\n", 1e6 * flow[0],
              1e6 * flow[1], 1e6 * flow[2]);
  EXPECT_NEAR(flow[1], flow[0], 0.02 * flow[0]);
  EXPECT_LT(flow[2], 0.1 * flow[0]);
}

/// Knots of three rings, nearer to their centre: across one way by `flat`, and the other way by `narrow`.
void squeeze(scene::World& world, std::size_t object, std::size_t middle, double flat, double narrow) {
  auto& block = const_cast<scene::WorldState&>(world.state()).objects[object].block;
  const net::TubeMap& tube = world.model().objects[object].tube;
  for (std::size_t ring = middle - 1; ring <= middle + 1; ++ring) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const auto k : tube.knots(ring)) centre += world.knotAt(object, k);
    centre /= static_cast<double>(tube.knots(ring).size());
    const Eigen::Vector3d u = (world.knotAt(object, tube.knots(ring)[0]) - centre).normalized();
    for (const auto k : tube.knots(ring)) {
      const Eigen::Vector3d d = world.knotAt(object, k) - centre, along = d.dot(u) * u;
      const Eigen::Vector3d p = centre + flat * along + narrow * (d - along);
      block.row(net::Block::X)[k] = static_cast<float>(p.x());
      block.row(net::Block::Y)[k] = static_cast<float>(p.y());
      block.row(net::Block::Z)[k] = static_cast<float>(p.z());
    }
  }
}

// Protects that a vessel whose lumen a hand makes small bleeds less behind that place: pressed flat, or drawn
// out so that it is thin. What a pulse does to it, a tenth, holds nothing back.
TEST(Blood, AVesselThatIsPressedFlatOrDrawnOutHoldsItsBloodBack) {
  struct Case {
    const char* what;
    double flat, narrow;
  };
  const Case cases[] = {
      {"as it lies", 1, 1}, {"pulse", 0.92, 1}, {"flat", 0.05, 1}, {"drawn out", 0.25, 0.25}};
  double flow[4];
  for (int i = 0; i < 4; ++i) {
    Bench b;
    const auto object = objectNamed(b.world, "uterine_artery_left");
    const net::TubeMap& tube = b.world.model().objects[object].tube;
    squeeze(b.world, object, tube.ringCount() / 3, cases[i].flat, cases[i].narrow);
    b.event(scene::EventKind::Separated, "uterine_artery_left", tube.station(2 * tube.ringCount() / 3),
            std::nan(""));
    for (int k = 0; k < 300; ++k) b.step();
    ASSERT_EQ(b.effect.wounds().opening_count, 2);
    const auto& openings = b.effect.wounds().openings;
    flow[i] = openings[openings[0].end == bleeding::End::kHeart ? 0 : 1].flow;
    ASSERT_EQ(b.effect.kinks().count, i < 2 ? 0 : 1) << cases[i].what;
    if (i >= 2) {
      EXPECT_NEAR(b.effect.kinks().each[0].opening, cases[i].flat * cases[i].narrow, 0.02)
          << cases[i].what << ": the share of the lumen that is left";
    }
  }
  std::printf("heart's stump: %.3f ml/s, a pulse %.3f, flat %.3f, drawn out %.3f\n", 1e6 * flow[0],
              1e6 * flow[1], 1e6 * flow[2], 1e6 * flow[3]);
  EXPECT_NEAR(flow[1], flow[0], 0.02 * flow[0]);
  EXPECT_LT(flow[2], 0.7 * flow[0]);
  EXPECT_LT(flow[3], 0.7 * flow[0]);
}

/// A shut grasper that presses a uterine artery against the uterus, and the artery's stump behind that place.
struct Finger : Bench {
  static constexpr auto kHand = static_cast<std::size_t>(tools::Instrument::Right);
  std::uint16_t artery = objectNamed(world, "uterine_artery_left");
  const net::TubeMap& tube = world.model().objects[artery].tube;
  std::size_t end = tube.ringCount() - 1;
  Eigen::Vector3d place, way;
  double depth = -0.006;  ///< m beyond the artery's middle

  Eigen::Vector3d centre(std::size_t ring) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto k : tube.knots(ring)) sum += world.knotAt(artery, k);
    return sum / static_cast<double>(tube.knots(ring).size());
  }
  /// @param before  rings from the artery's end, where it is divided, to the place that is pressed
  explicit Finger(std::size_t before) : place(centre(end - before)) {
    const auto uterus = objectNamed(world, "uterus");
    const Eigen::Vector3d axis = (place - centre(end - before - 1)).normalized();
    Eigen::Vector3d behind = world.knotAt(uterus, 0);
    for (std::uint32_t k = 0; k < world.knotCount(uterus); ++k)
      if ((world.knotAt(uterus, k) - place).norm() < (behind - place).norm())
        behind = world.knotAt(uterus, k);
    way = behind - place;
    way = (way - way.dot(axis) * axis).normalized();
    auto& tool = input.tools[kHand];
    tool.present = true, tool.tool = tools::ToolKind::Grasper;
    tool.pivot = place - 0.12 * way;
    tool.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), way);
    event(scene::EventKind::Separated, "uterine_artery_left", tube.station(end), std::nan(""));
    step();
  }
  void go(double to) {
    for (const double way_of_a_look = to > depth ? 1e-4 : -1e-4; std::fabs(to - depth) > 1e-6;
         depth += way_of_a_look) {
      input.tools[kHand].position = place + depth * way;
      for (int i = 0; i < 3; ++i) world.step(input, report);
    }
  }
  double force() const { return report.contacts[kHand].wrench.head<3>().norm(); }
  bool touches() const {
    const auto& sides = world.state().sides;
    return std::any_of(sides.begin(), sides.end(), [&](const auto& s) { return s.object == artery; });
  }
  /// ml of the stump on the heart's side, in a second in which tissue and tool stand still.
  double bleeds() {
    const auto& wounds = effect.wounds().openings;
    const auto& stump = wounds[wounds[0].end == bleeding::End::kHeart ? 0 : 1];
    for (int i = 0; i < 200; ++i) step();
    const double lost = stump.lost;
    for (int i = 0; i < 1000; ++i) step();
    return 1e6 * (stump.lost - lost);
  }
};

// Protects that an instrument which presses an artery against the organ behind it stops what bleeds behind
// that place, as a finger does.
TEST(Blood, ABluntInstrumentPressesAnArteryShutOnTheOrganBehindIt) {
  Finger f(1);
  const double open = f.bleeds();
  f.go(0.004);
  ASSERT_TRUE(f.touches());
  const double touching = f.force(), touched = f.bleeds();
  f.go(0.010);
  const double pressing = f.force(), pressed = f.bleeds();
  f.go(-0.006);
  const double again = f.bleeds();
  std::printf("%.2f ml/s, touched with %.3f N %.2f, pressed with %.3f N %.2f, left %.2f\n", open, touching,
              touched, pressing, pressed, again);
  ASSERT_GT(open, 0.5) << "ml/s";
  EXPECT_GT(touched, 0.85 * open);
  EXPECT_LT(pressed, 0.1 * open);
  EXPECT_GT(again, 0.85 * open) << "five seconds make no clot";
}

// Protects that a shaft which leans on a ligament does not shut the artery that its tip just touches.
TEST(Blood, WhatAnInstrumentPressesElsewhereDoesNotShutAnArtery) {
  Finger f(3);
  const double open = f.bleeds();
  while (!f.touches() && f.depth < 0.004) f.go(f.depth + 0.001);
  ASSERT_TRUE(f.touches());
  const double leaning = f.force(), touched = f.bleeds();
  std::printf("%.2f ml/s, touched while the shaft leans with %.3f N: %.2f\n", open, leaning, touched);
  ASSERT_GT(leaning, 0.15) << "N: as much as shuts it";
  EXPECT_GT(touched, 0.85 * open);
}

TEST(Blood, NoVesselOfASceneIsKinkedAsItLies) {
  for (const char* name : {"gynaecology", "pelvis", "arterial_bleeding", "venous_ooze", "gallbladder"}) {
    const scene::World world{
        scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/" + name + "/" + name + ".yaml")};
    BloodEffect effect(world, options(), nullptr);
    scene::StepReport report;
    Feedback feedback;
    feedback.sources.reserve(bleeding::kMostSources), feedback.dilatations.reserve(64);
    effect.step(world, {}, report, feedback);
    EXPECT_EQ(effect.kinks().count, 0) << name;
  }
}

}  // namespace
}  // namespace vest::simulation
