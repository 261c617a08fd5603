#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include <ros/package.h>

#include "../src/simulation/between.h"
#include "vest_bringup/ros/field_messages.h"
#include "vest_bringup/simulation/operating_field.h"
#include "vest_bringup/simulation/surface_effect.h"
#include "vest_bringup/simulation/trainer.h"
#include "vest_instruments/control/pedals.h"
#include "vest_instruments/tools/tool_geometry.h"
#include "vest_tissue/scene/cavity_walls.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"

// Protects the operating field in the Trainer: irrigation by pedal reaches tissue as recorded momentum,
// nothing is lost on its way to pool and suction, coagulation makes smoke, the lens is cleaned in the trocar,
// a snapshot goes on with the same bits, and the messages say what the State is.

namespace vest::simulation {
namespace {

constexpr auto kRight = static_cast<std::size_t>(tools::Instrument::Right);
constexpr auto kCamera = static_cast<std::size_t>(tools::Instrument::Endoscope);

struct Theatre {
  Trainer trainer;
  OperatingField* field = nullptr;
  std::shared_ptr<FieldFrames> frames = std::make_shared<FieldFrames>();
  scene::StepInput tools;
  scene::StepReport report;
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();  ///< that the inputs recorded
  double energy = 0;                                   ///< J that coagulation put into the tissue
  std::uint64_t k = 0;

  /// @param before stands before the field
  explicit Theatre(const std::string& scene, std::unique_ptr<Effect> before = nullptr)
      : trainer(scene::World(scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/" + scene +
                                              "/" + scene + ".yaml"))) {
    if (before) trainer.add(std::move(before));
    auto effect = std::make_unique<OperatingField>(trainer.world(), FieldOptions{}, frames);
    field = effect.get();
    trainer.add(std::move(effect));
    hold(tools::ToolKind::SuctionIrrigator, {0.0, 0.03, 0.08});
    auto& camera = tools.tools[kCamera];
    camera.present = true;
    camera.tool = tools::ToolKind::Endoscope;
    camera.sight = {0, 0.5, std::sqrt(0.75)};  // a 30° optic
    camera.pivot = {0, -0.14, 0.165};
    camera.position = {0.005, -0.035, 0.135};
    camera.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(),
                                                            Eigen::Vector3d(0, 0.195, -0.11).normalized());
  }
  void hold(tools::ToolKind kind, const Eigen::Vector3d& place) {
    auto& tool = tools.tools[kRight];
    tool.present = true;
    tool.tool = kind;
    tool.pivot = {0.115, -0.02, 0.165};
    tool.position = place;
    tool.orientation =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), (place - tool.pivot).normalized());
  }
  /// @param functions switched on: of each tool, what it takes
  void run(double seconds, std::uint32_t functions = 0) {
    for (int n = static_cast<int>(seconds / 0.001 + 0.5); n > 0; --n) {
      scene::StepInput input = tools;
      input.step = ++k;
      for (auto& tool : input.tools) tool.functions = functions & control::functionsOf(tool.tool);
      trainer.step(input, report);
      for (const auto& e : report.events)
        if (e.kind == scene::EventKind::Coagulated) energy += e.energy;
      for (const auto& impact : input.impacts) momentum += impact.momentum;
    }
  }
  double gap() const {
    const auto& s = field->fluid();
    return s.emitted - fluid::particleVolume(field->fluidModel(), s) -
           fluid::poolVolume(field->fluidModel(), s) - fluid::pendingVolume(s) - s.sucked - s.soaked -
           s.lost - s.stained - fluid::filmVolume(field->fluidModel(), s);
  }
};

TEST(OperatingField, IrrigationPushesTheTubeFillsThePoolAndSuctionEmptiesIt) {
  Theatre t("irrigation_pool");
  t.run(0.2);
  EXPECT_EQ(t.field->fluid().emitted, 0.0) << "no pedal, no water";
  t.hold(tools::ToolKind::SuctionIrrigator, {0.026, 0.024, 0.075});
  t.run(1.0, 4);
  t.run(0.15);  // the valve closes
  EXPECT_NEAR(t.field->fluid().emitted, 5e-5, 2e-6) << "3 l/min for a second";
  EXPECT_GT(t.momentum.norm(), 1e-3) << "N·s on the tube";
  t.run(1.0);
  const auto& model = t.field->fluidModel();
  const double pool = fluid::poolVolume(model, t.field->fluid());
  EXPECT_GT(pool, 0.8 * t.field->fluid().emitted);
  EXPECT_LT(t.field->fluid().lost, 0.01 * t.field->fluid().emitted);
  EXPECT_LT(std::fabs(t.gap()), 1e-3 * t.field->fluid().emitted);
  // The tube divides the pool: the tip goes to the deepest wet cell of what is left, and again.
  const auto& w = t.field->fluid().pools;
  const double cell = model.parameters.pool_cell;
  const auto columns = static_cast<std::size_t>(model.columns);
  for (int basin = 0; basin < 3; ++basin) {
    const auto deepest =
        static_cast<std::size_t>(std::max_element(w.depth.begin(), w.depth.end()) - w.depth.begin());
    t.hold(tools::ToolKind::SuctionIrrigator,
           {model.parameters.low[0] + (static_cast<double>(deepest % columns) + 0.5) * cell,
            model.parameters.low[1] + (static_cast<double>(deepest / columns) + 0.5) * cell,
            static_cast<double>(w.bed[deepest]) + 0.004});
    t.run(1.0, 8);
  }
  EXPECT_GT(t.field->fluid().sucked, 0.8 * pool);
  EXPECT_LT(std::fabs(t.gap()), 1e-3 * t.field->fluid().emitted);
}

/// Gas is missing.
struct Collapse : Effect {
  double sunk;  ///< m
  explicit Collapse(double metres) : sunk(metres) {}
  Ports ports() const override { return {0, 0, kGas}; }
  void step(const scene::World&, const scene::StepInput&, const scene::StepReport&,
            Feedback& feedback) override {
    feedback.gas.sunk = sunk;
  }
  void reset() override {}
};

TEST(OperatingField, DropsMeetTheWallThatSinksForWantOfGas) {
  // Water straight up: where the wall hangs it comes no higher, and nothing gets lost behind it.
  const auto highest = [](double sunk) {
    Theatre t("irrigation_pool", std::make_unique<Collapse>(sunk));
    t.tools.tools[kCamera].present = false;  // it would prop the wall up
    auto& tool = t.tools.tools[kRight];
    tool.pivot = {0.0, 0.03, 0.02};
    tool.position = {0.0, 0.03, 0.09};
    tool.orientation.setIdentity();
    double most = 0;
    for (int k = 0; k < 40; ++k) {
      t.run(0.01, 4);
      const auto& p = t.field->fluid().particles;
      for (std::size_t i = 0; i < p.count; ++i) most = std::max(most, static_cast<double>(p.z[i]));
    }
    EXPECT_LT(std::fabs(t.gap()), 1e-3 * t.field->fluid().emitted);
    EXPECT_LT(t.field->fluid().lost, 0.01 * t.field->fluid().emitted);
    return most;
  };
  EXPECT_LT(highest(0.05), highest(0) - 0.03) << "m";
}

TEST(OperatingField, FilmsDripFromWhereTheWallHangsForWantOfGasAndFromItsPlaceWhenItHasRisen) {
  const scene::World world{scene::loadScene(ros::package::getPath("vest_tissue") +
                                            "/scenes/irrigation_pool/irrigation_pool.yaml")};
  constexpr std::size_t kCavity = 0;
  ASSERT_EQ(world.description().objects[kCavity].organ, "cavity");
  SurfaceEffect surface(world, {}, nullptr, nullptr);
  std::vector<float> at(3 * world.knotCount(kCavity));
  world.positions(kCavity, at.data());
  const auto& triangles = world.contactTriangles(kCavity);
  std::uint32_t top = 0;
  const auto height = [&](std::uint32_t t) {
    return at[3 * triangles[t][0] + 2] + at[3 * triangles[t][1] + 2] + at[3 * triangles[t][2] + 2];
  };
  for (std::uint32_t t = 1; t < triangles.size(); ++t)
    if (height(t) > height(top)) top = t;
  scene::StepInput input;
  scene::StepReport report;
  Feedback feedback;
  feedback.sources.reserve(bleeding::kMostSources);
  // The greatest distance (m) of what drips from the wall, and how deep (m) below its rest that is.
  const auto drips = [&](double sunk, double* deepest) {
    std::vector<float> wall = at;
    scene::CavityWalls(world.model(), world.state(), sunk).hang(kCavity, wall.data(), wall.size() / 3);
    input.sunk = sunk;
    double farthest = 0;
    int found = 0;
    *deepest = 0;
    for (int step = 0; step < 200; ++step) {  // the world stands: each is a step of the films
      feedback.sources.clear();
      feedback.films.push_back({kCavity, top, 0, 1e-7});
      surface.step(world, input, report, feedback);
      for (const bleeding::FluidSource& source : feedback.sources) {
        double nearest = 1, below = 0;
        for (std::size_t k = 0; k + 2 < wall.size(); k += 3) {
          const double d = (source.position - Eigen::Vector3d(wall[k], wall[k + 1], wall[k + 2])).norm();
          if (d < nearest) nearest = d, below = static_cast<double>(at[k + 2] - wall[k + 2]);
        }
        farthest = std::max(farthest, nearest), *deepest = std::max(*deepest, below), ++found;
      }
    }
    EXPECT_GT(found, 0);
    return farthest;
  };
  double deepest = 0;
  EXPECT_LT(drips(0.05, &deepest), 1e-4) << "m: from a knot of the wall";
  EXPECT_GT(deepest, 0.03) << "m";
  EXPECT_LT(drips(0, &deepest), 1e-4) << "m";
  EXPECT_EQ(deepest, 0);
}

TEST(OperatingField, ASnapshotOfTheMomentInWhichTheWallRisesGoesOnWithTheSameBitsAnywhere) {
  // What is kept of the wall's places must be none of another State: of one that never stepped, of one whose
  // wall never hung, of itself later.
  const auto begun = [](double sunk, double seconds) {
    auto gas = std::make_unique<Collapse>(sunk);
    Collapse* const at = gas.get();
    auto t = std::make_unique<Theatre>("irrigation_pool", std::move(gas));
    t->hold(tools::ToolKind::SuctionIrrigator, {0.026, 0.024, 0.075});
    t->run(seconds, 4);
    at->sunk = 0;
    return t;
  };
  const auto one = begun(0.05, 0.301);
  one->run(0.001, 4);  // the last step in which it hangs
  ASSERT_NE(one->trainer.world().steps() % 48, 0U) << "between two looks at the ground";
  std::vector<std::uint8_t> bytes;
  one->trainer.save(bytes);
  const std::uint64_t k = one->k;
  one->run(0.1, 4);
  const auto end = one->trainer.effectsHash();
  const auto fresh = begun(0, 0), level = begun(0, 0.2);
  for (Theatre* t : {fresh.get(), level.get(), one.get()}) {
    t->trainer.restore(bytes);
    t->k = k;
    t->run(0.1, 4);
    EXPECT_EQ(t->trainer.effectsHash(), end);
  }
}

TEST(OperatingField, SmokeIsBelowTheWallThatSinksForWantOfGas) {
  const auto highest = [](double sunk) {
    Theatre t("smoke_lens", std::make_unique<Collapse>(sunk));
    t.tools.tools[kCamera].present = false;
    t.hold(tools::ToolKind::CoagulationHook, {0.0, 0.05, 0.058});
    t.run(2.0, tools::kFunctionCoagulate);
    t.run(3.0);
    const smoke::Parameters& p = t.field->smokeModel().parameters;
    for (double z = p.high[2] - 0.5 * p.cell; z > p.low[2]; z -= p.cell)
      if (smoke::densityAt(t.field->smokeModel(), t.field->smoke(), 0.0F, 0.05F, static_cast<float>(z)) > 0)
        return z;
    return 0.0;
  };
  EXPECT_LT(highest(0.05), highest(0) - 0.03) << "m";
}

TEST(OperatingField, TheBagDrivesTheWaterAndTheValveTakesAMoment) {
  Theatre t("irrigation_pool");
  t.tools.edits = {{"fluid", "bag_pressure", 1e4}};
  t.run(0.004);
  t.tools.edits.clear();
  t.run(0.04, 4);
  EXPECT_LT(t.field->fluid().emitted, 0.25 * 2.5e-5 * 0.04) << "a third of its travel";
  t.run(0.16, 4);
  const double before = t.field->fluid().emitted;
  t.run(0.4, 4);
  EXPECT_NEAR(t.field->fluid().emitted - before, 0.5 * 5e-5 * 0.4, 1e-7)
      << "a quarter of the pressure, half the flow";
}

/// Gives what an effect before the field would give.
struct Clots : Effect {
  double volume = 0;  ///< m³ in each step, to the right hand's sucker
  Ports ports() const override { return {0, 0, kClots}; }
  void step(const scene::World&, const scene::StepInput&, const scene::StepReport&,
            Feedback& feedback) override {
    feedback.clots[kRight] += volume;
  }
  void reset() override {}
};

TEST(OperatingField, ClotsStayInTheSuckerUntilWaterDrivesThemOut) {
  auto clots = std::make_unique<Clots>();
  Clots& given = *clots;
  Theatre t("irrigation_pool", std::move(clots));
  const auto open = [&] { return t.field->suctionOpen(t.trainer.world(), kRight); };
  EXPECT_EQ(open(), 1.0);
  given.volume = 1e-8;
  t.run(0.01, 8);
  given.volume = 0;
  EXPECT_NEAR(open(), 0.85, 1e-9) << "0.1 ml of clots, of which 30 % stay in a bore that 0.2 ml close";
  given.volume = 1e-7;
  t.run(0.05, 8);
  given.volume = 0;
  EXPECT_EQ(open(), 0.0) << "closed";
  t.run(0.05, 8);
  vest_msgs::FluidState msg;
  ASSERT_TRUE(t.frames->update());
  ros_shell::toMsg(t.frames->front(), msg);
  EXPECT_EQ(msg.clogged[kRight], 1.0f) << "and everybody is told";
  EXPECT_EQ(msg.clogged[0], 0.0f);
  t.run(0.3, 4);
  EXPECT_EQ(open(), 1.0) << "a squirt of water clears it";
}

/// 30 ml within 10 ms, as from a great vessel: 3 l/s.
struct Burst : Effect {
  int left = 10;
  Ports ports() const override { return {0, 0, kSources}; }
  void step(const scene::World&, const scene::StepInput&, const scene::StepReport&,
            Feedback& feedback) override {
    if (left-- <= 0) return;
    bleeding::FluidSource source;
    source.slot = 3, source.position = {0, 0.03, 0.06}, source.direction = {0, 0, -1};
    source.area = 1e-3, source.flow = 3e-3;
    feedback.sources.push_back(source);
  }
  void reset() override { left = 10; }
};

TEST(OperatingField, WhatASourceGivesFasterThanALitreASecondComesLaterAndNotNever) {
  Theatre t("irrigation_pool", std::make_unique<Burst>());
  t.run(0.012);
  EXPECT_LT(t.field->fluid().emitted, 2e-5) << "m³";
  t.run(0.2);
  EXPECT_NEAR(t.field->fluid().emitted, 3e-5, 1e-9);
  EXPECT_NEAR(t.field->fluid().emitted_blood, 3e-5, 1e-9);
  EXPECT_LT(std::fabs(t.gap()), 1e-3 * t.field->fluid().emitted);
}

TEST(OperatingField, ASwabSoaksUpThePoolItLiesInUntilItIsFullAndTheNextOneIsDry) {
  Theatre t("irrigation_pool");
  t.run(1.5, 4);
  const auto& model = t.field->fluidModel();
  const auto& w = t.field->fluid().pools;
  const double cell = model.parameters.pool_cell;
  const auto columns = static_cast<std::size_t>(model.columns);
  const auto into = [&](tools::ToolKind kind) {
    const auto deepest =
        static_cast<std::size_t>(std::max_element(w.depth.begin(), w.depth.end()) - w.depth.begin());
    const double front = tools::toolGeometry(kind).interaction_points.front().z();
    t.hold(kind, {model.parameters.low[0] + (static_cast<double>(deepest % columns) + 0.5) * cell,
                  model.parameters.low[1] + (static_cast<double>(deepest / columns) + 0.5) * cell,
                  static_cast<double>(w.bed[deepest]) + 0.008 + front});
    auto& tool = t.tools.tools[kRight];
    tool.pivot = tool.position + Eigen::Vector3d(0, 0, 0.1);
    tool.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  };
  const auto held = [&] { return t.field->swab(kRight).volume; };
  into(tools::ToolKind::Swab);
  t.run(1.0);
  const double soon = held();
  EXPECT_GT(soon, 0.1 * bleeding::kSwabCapacity);
  EXPECT_LT(soon, 0.5 * bleeding::kSwabCapacity) << "it takes seconds";
  t.run(12.0);
  EXPECT_GT(held(), 0.9 * bleeding::kSwabCapacity);
  EXPECT_LE(held(), bleeding::kSwabCapacity * (1 + 1e-9)) << "and no more";
  EXPECT_NEAR(t.field->fluid().soaked, held(), 1e-12);
  EXPECT_NEAR(t.field->swab(kRight).blood, 0, 1e-12) << "it was water";
  EXPECT_EQ(t.field->fluid().sucked, 0.0) << "that is no suction";
  EXPECT_LT(std::fabs(t.gap()), 1e-3 * t.field->fluid().emitted);
  vest_msgs::FluidState msg;
  ASSERT_TRUE(t.frames->update());
  ros_shell::toMsg(t.frames->front(), msg);
  EXPECT_NEAR(msg.swab_volume[kRight], held(), 0.02 * held());
  EXPECT_NEAR(msg.soaked, held(), 0.02 * held());
  EXPECT_NEAR(msg.swab_capacity, bleeding::kSwabCapacity, 1e-12);
  const double gone = t.field->fluid().soaked;
  t.hold(tools::ToolKind::Grasper, {0.0, 0.03, 0.08});
  t.run(0.02);
  EXPECT_EQ(held(), 0.0);
  into(tools::ToolKind::Swab);
  t.run(1.0);
  EXPECT_GT(held(), 0.0) << "a dry one";
  EXPECT_NEAR(t.field->fluid().soaked, gone + held(), 1e-12);
}

TEST(OperatingField, ASwabThatIsPressedGivesBackWhatItCannotHold) {
  const scene::World world{scene::loadScene(ros::package::getPath("vest_tissue") +
                                            "/scenes/irrigation_pool/irrigation_pool.yaml")};
  OperatingField field(world, FieldOptions{}, nullptr);
  scene::StepInput input;
  scene::StepReport report;
  Feedback feedback;
  feedback.impacts.reserve(4096), feedback.loads.reserve(4096);
  auto& tool = input.tools[kRight];
  tool.present = true, tool.tool = tools::ToolKind::Swab;
  scene::ContactModel& contact = report.contacts[kRight];
  contact.step = 1, contact.in_contact = true;
  contact.proxy.translation() = Eigen::Vector3d(0, 0.05, 0.05);
  const auto press = [&](double force, double seconds) {
    contact.wrench.head<3>() = Eigen::Vector3d(0, 0, force);
    for (int i = 0; i < static_cast<int>(seconds / 0.004 + 0.5);
         ++i) {  // the world stands: each is a fluid step
      field.step(world, input, report, feedback);
      feedback.wiped.fill(0), feedback.impacts.clear(), feedback.loads.clear();
    }
    return field.swab(kRight).volume;
  };
  feedback.wiped[kRight] = 3e-6;
  EXPECT_NEAR(press(0, 1), 3e-6, 1e-12) << "m³ that it wiped off surfaces; nothing lies there to soak up";
  EXPECT_NEAR(feedback.swab_room[kRight], bleeding::kSwabCapacity - 3e-6, 1e-12);
  const double holds = bleeding::capacity(2, tools::toolGeometry(tool.tool).fixed.front().radius);
  EXPECT_LT(holds, 0.5 * bleeding::kSwabCapacity);
  const double left = press(2, 12);
  EXPECT_NEAR(left, holds, 0.05 * holds);
  EXPECT_EQ(feedback.swab_room[kRight], 0.0) << "it takes no more";
  EXPECT_NEAR(field.swab(kRight).blood, left, 1e-12) << "blood comes out as blood";
  const fluid::State& f = field.fluid();
  const fluid::Model& m = field.fluidModel();
  EXPECT_EQ(f.emitted, 0.0) << "nothing is bled twice";
  EXPECT_NEAR(f.soaked, left - 3e-6, 1e-12);
  EXPECT_NEAR(fluid::particleVolume(m, f) + fluid::pendingVolume(f) + fluid::poolVolume(m, f) +
                  fluid::filmVolume(m, f) + f.stained + f.lost,
              3e-6 - left, 1e-9);
}

TEST(OperatingField, TissueOnTheMouthLeavesTheSideHoles) {
  Theatre t("irrigation_pool");
  // Along the shaft onto the middle of the tube, on the side that faces the trocar.
  const scene::World& world = t.trainer.world();
  constexpr std::size_t kTube = 1;
  ASSERT_EQ(world.description().objects[kTube].name, "tube");
  const net::TubeMap& tube = world.model().objects[kTube].tube;
  const Eigen::Vector3d pivot = t.tools.tools[kRight].pivot;
  Eigen::Vector3d side(0, 0, -1);
  for (const auto knot : tube.knots(tube.ringCount() / 2)) {
    const Eigen::Vector3d at = world.knotAt(kTube, knot);
    if ((at - pivot).norm() < (side - pivot).norm()) side = at;
  }
  bool held = false;
  for (int i = 0; i < 500 && !held; ++i) {
    t.hold(tools::ToolKind::SuctionIrrigator, side + (0.008 - 2e-5 * i) * (pivot - side).normalized());
    t.run(0.001, 8);
    for (const auto& e : t.report.events) held = held || e.kind == scene::EventKind::Grasped;
  }
  ASSERT_TRUE(held) << "the tube is drawn onto the mouth";
  EXPECT_EQ(t.field->suctionOpen(world, kRight), 0.5);
  t.run(0.01);
  EXPECT_EQ(t.field->suctionOpen(world, kRight), 1.0) << "the valve is up";
}

TEST(OperatingField, ASnapshotGoesOnWithTheSameBitsAndResetEmptiesTheField) {
  Theatre a("irrigation_pool"), b("irrigation_pool");
  for (Theatre* t : {&a, &b}) t->hold(tools::ToolKind::SuctionIrrigator, {0.026, 0.024, 0.075});
  a.run(0.402, 4);
  std::vector<std::uint8_t> bytes, end_a, end_b;
  a.trainer.save(bytes);
  b.trainer.restore(bytes);
  b.k = a.k;
  a.run(0.1, 12), b.run(0.1, 12);
  a.trainer.save(end_a), b.trainer.save(end_b);
  EXPECT_TRUE(end_a == end_b);
  a.trainer.reset();
  EXPECT_EQ(a.field->fluid().particles.count, 0U);
  EXPECT_EQ(a.field->fluid().emitted, 0.0);
}

TEST(OperatingField, SmokeAndFluidGiveTheSameBitsForAnyThreads) {
  const auto played = [](int threads) {
    Theatre t("smoke_lens");
    t.trainer.world().setThreads(threads);
    t.hold(tools::ToolKind::SuctionIrrigator, {-0.02, 0.05, 0.065});
    t.tools.tools[static_cast<std::size_t>(tools::Instrument::Left)] = t.tools.tools[kRight];
    t.hold(tools::ToolKind::CoagulationHook, {0.0, 0.05, 0.058});
    t.run(0.6, tools::kFunctionCoagulate | tools::kFunctionIrrigate);  // beside each other
    t.run(0.4, tools::kFunctionCoagulate | tools::kFunctionSuck);      // one after the other
    t.run(0.2);
    EXPECT_GT(t.field->smoke().made, 0);
    EXPECT_GT(t.field->fluid().sucked, 0);
    return t.trainer.effectsHash();
  };
  const auto one = played(1);
  for (const int threads : {2, 3}) EXPECT_EQ(played(threads), one) << threads;
}

TEST(OperatingField, ASnapshotThatNoStepLeavesIsRefused) {
  Theatre t("irrigation_pool");
  t.run(0.1, 4);
  std::vector<std::uint8_t> bytes;
  t.field->save(bytes);
  std::uint8_t* const at = bytes.data() + bytes.size() - sizeof(Between);
  Between good;
  std::memcpy(&good, at, sizeof good);
  const auto refused = [&](auto change) {
    Between changed = good;
    change(changed);
    std::memcpy(at, &changed, sizeof changed);
    return !t.field->restore(bytes.data(), bytes.size());
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(refused([](Between&) {}));
  EXPECT_TRUE(refused([&](Between& b) { b.valve[kRight][0] = nan; }));
  EXPECT_TRUE(refused([](Between& b) { b.bag_pressure = 1e300; }));
  EXPECT_TRUE(refused([](Between& b) { b.source[3].flow = -1; }));
  EXPECT_TRUE(refused([&](Between& b) { b.source[3].position[1] = nan; }));
  EXPECT_TRUE(refused([](Between& b) { b.energy[0] = 1e300; }));
  EXPECT_TRUE(refused([](Between& b) { b.hits[2].u = 1e30f; }));
  EXPECT_TRUE(refused([](Between& b) { b.humidity = 2; }));
}

TEST(OperatingField, CoagulationOfTissueMakesSmokeAndTheMessagesCarryIt) {
  Theatre t("smoke_lens");
  t.hold(tools::ToolKind::CoagulationHook, {0.0, 0.05, 0.058});
  t.run(2.0, tools::kFunctionCoagulate);
  t.run(0.1);
  ASSERT_GT(t.energy, 0.0) << "the hook touches the slab";
  EXPECT_NEAR(t.field->smoke().made, t.field->smokeModel().parameters.yield * t.energy,
              1e-6 * t.field->smoke().made)
      << "the heat that went into the tissue, once";
  ASSERT_TRUE(t.frames->update());
  const FieldFrame& frame = t.frames->front();
  vest_msgs::SmokeState smoke;
  ros_shell::toMsg(frame, smoke);
  EXPECT_EQ(smoke.density.size(), static_cast<std::size_t>(smoke.size[0]) * smoke.size[1] * smoke.size[2]);
  EXPECT_GT(smoke.density_scale, 0.0f);
  EXPECT_GT(smoke.puffs.size(), 15U) << "one every 0.08 s while it smokes, for 2 s";
  EXPECT_EQ(smoke.puffs.size(), frame.puff_count);
  vest_msgs::LensState lens;
  ros_shell::toMsg(frame, lens);
  EXPECT_EQ(lens.soiling.size(), lens.columns * lens.rows);
}

TEST(OperatingField, PoolsInMessagesHoldTheVolumeOfTheirHeights) {
  Theatre t("irrigation_pool");
  t.hold(tools::ToolKind::SuctionIrrigator, {0.026, 0.024, 0.075});
  t.run(0.8, 4);
  t.run(0.7);
  ASSERT_TRUE(t.frames->update());
  vest_msgs::FluidState msg;
  ros_shell::toMsg(t.frames->front(), msg);
  ASSERT_FALSE(msg.pools.empty());
  double volume = 0, depth = 0;
  for (const auto& pool : msg.pools) {
    EXPECT_EQ(pool.height.size(), pool.columns * pool.rows);
    EXPECT_EQ(pool.blood_fraction, 0.0f);
    volume += pool.volume;
    ASSERT_EQ(pool.depth.size(), pool.height.size());
    ASSERT_EQ(pool.blood.size(), pool.height.size());
    for (std::size_t k = 0; k < pool.height.size(); ++k) {
      EXPECT_EQ(pool.depth[k] == 0, std::isnan(pool.height[k])) << "what is wet has a depth";
      EXPECT_EQ(pool.blood[k], 0);
      if (std::isnan(pool.height[k])) continue;
      // Under the tube it is drawn, and is none of the volume.
      const fluid::Model& model = *t.frames->front().fluid_model;
      const auto cells = [&](double place, double low) {
        return static_cast<std::size_t>(std::lround((place - low) / pool.cell));
      };
      const std::size_t column = cells(pool.origin.position.x, model.parameters.low[0]) + k % pool.columns,
                        row = cells(pool.origin.position.y, model.parameters.low[1]) + k / pool.columns,
                        at = row * static_cast<std::size_t>(model.columns) + column;
      const double top = pool.origin.position.z + static_cast<double>(pool.height[k]);
      if (top >= static_cast<double>(t.frames->front().fluid.pools.bed[at]))
        depth += 1e-4 * pool.depth[k] * pool.cell * pool.cell;
    }
  }
  EXPECT_NEAR(depth, volume, 0.05 * volume) << "but for rounding to 0.1 mm";
  EXPECT_NEAR(volume, msg.emitted, 0.15 * msg.emitted) << "the rest is film and drops";
  EXPECT_NEAR(msg.emitted, msg.flying + msg.pooled + msg.sucked + msg.lost, 1e-3 * msg.emitted);
  EXPECT_EQ(msg.positions.size(), 3 * msg.blood_fraction.size());
  ASSERT_EQ(msg.positions.size(), 3 * msg.volume.size());
  double flying = 0;
  for (const std::uint8_t share : msg.volume) flying += share / 255.0 * std::pow(2 * msg.particle_radius, 3);
  EXPECT_NEAR(flying, msg.flying, 0.05 * msg.flying + 1e-8) << "and what waits for a whole particle";
}

TEST(OperatingField, AColdLensSteamsUpAndIsClearAfterItsVisitInTheTrocar) {
  Theatre t("smoke_lens");
  t.tools.tools[kRight].present = false;
  t.tools.edits = {{"lens", "temperature", 293.15}};
  t.run(0.001);
  t.tools.edits.clear();
  t.run(8.0);
  ASSERT_GT(t.field->lens().condensate, 0.0005);
  auto& camera = t.tools.tools[kCamera];
  const Eigen::Vector3d inside = camera.position;
  camera.position = camera.pivot + 0.01 * (inside - camera.pivot).normalized();
  t.run(3.0);
  camera.position = inside;
  t.run(0.5);
  EXPECT_LT(t.field->lens().condensate, 0.0001);
  EXPECT_GT(t.field->lens().temperature, 309.5) << "above the dew point";
}

}  // namespace
}  // namespace vest::simulation
