#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <ros/package.h>

#include "vest_bringup/simulation/blood_effect.h"
#include "vest_bringup/simulation/operating_field.h"
#include "vest_bringup/simulation/surface_effect.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"

// Protects the one account of blood: what leaves an artery, a vein or a cut surface, integrated at the hole,
// is found again in particles, pools, suction and the films on the surfaces.

namespace vest::simulation {
namespace {

/// A scene with all effects, whose events the test may add to.
struct Patient {
  scene::World world;
  BloodEffect blood;
  SurfaceEffect surface;
  OperatingField field;
  scene::StepInput input;
  scene::StepReport report;
  Feedback feedback;
  double at_holes = 0;  ///< m³: flow out of vessels and surfaces, integrated here

  explicit Patient(const std::string& scene)
      : Patient(scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene +
                                 ".yaml")) {}
  explicit Patient(const scene::Description& description)
      : world(description),
        blood(world, vessels(), nullptr),
        surface(world, {50.0, 10.0}, &blood, nullptr),
        field(world, FieldOptions{}, nullptr, true) {
    feedback.sources.reserve(bleeding::kMostSources);
    feedback.impacts.reserve(1024), feedback.dilatations.reserve(256);
  }
  /// Goes on where another one is, in a scene that was edited.
  std::vector<std::uint32_t> adopt(const Patient& before) {
    const std::vector<std::uint32_t> objects = world.adopt(before.world);
    blood.adopt(before.blood, objects);
    surface.adopt(before.surface, objects);
    field.adopt(before.field, objects);
    feedback.swab_room = before.feedback.swab_room;
    for (FilmInput film : before.feedback.films) {
      film.object = static_cast<std::uint16_t>(objects[film.object]);
      feedback.films.push_back(film);
    }
    at_holes = before.at_holes;
    return objects;
  }
  static BloodOptions vessels() {
    BloodOptions o;
    o.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
    return o;
  }
  void cutAt(std::size_t object, const Eigen::Vector3d& place) {
    scene::Event cut;
    cut.kind = scene::EventKind::Cut;
    cut.object = static_cast<std::uint16_t>(object);
    cut.position = place;
    cut.station = std::nan(""), cut.area = 1e-6;
    next = cut, has_next = true;
  }
  void openVessel(const std::string& name, double station, double area) {
    input.edits = {{name, "opening_station", station}, {name, "opening_area", area}};
  }
  void run(double seconds) {
    for (int n = static_cast<int>(seconds / 0.001 + 0.5); n > 0; --n) {
      input.step = world.steps() + 1;
      input.dt = 0.001;
      world.step(input, report);
      if (has_next) report.events.push_back(next);
      has_next = false;
      feedback.sources.clear(), feedback.impacts.clear(), feedback.dilatations.clear();
      feedback.wiped.fill(0);
      blood.step(world, input, report, feedback);
      for (const auto& s : feedback.sources) at_holes += s.flow * input.dt;
      const double seeped = surface.state().seeped;
      surface.step(world, input, report, feedback);
      at_holes += surface.state().seeped - seeped;
      field.step(world, input, report, feedback);
      input.edits.clear();
    }
  }
  /// Holds a suction tip into the deepest pool.
  void suck() {
    const auto& w = field.fluid().pools;
    const auto& m = field.fluidModel();
    const auto deepest =
        static_cast<std::size_t>(std::max_element(w.depth.begin(), w.depth.end()) - w.depth.begin());
    const auto columns = static_cast<std::size_t>(m.columns);
    auto& tool = input.tools[static_cast<std::size_t>(tools::Instrument::Right)];
    tool.present = true;
    tool.tool = tools::ToolKind::SuctionIrrigator;
    tool.pivot = {0.115, -0.02, 0.165};
    tool.position = {
        m.parameters.low[0] + (static_cast<double>(deepest % columns) + 0.5) * m.parameters.pool_cell,
        m.parameters.low[1] + (static_cast<double>(deepest / columns) + 0.5) * m.parameters.pool_cell,
        static_cast<double>(w.bed[deepest]) + 0.004};
    tool.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(),
                                                          (tool.position - tool.pivot).normalized());
    tool.functions = tools::kFunctionSuck;
  }
  double found() const {
    const auto& s = field.fluid();
    const auto& m = field.fluidModel();
    return fluid::particleVolume(m, s) + fluid::pendingVolume(s) + fluid::poolVolume(m, s) +
           fluid::filmVolume(m, s) + s.sucked + s.soaked + s.lost + bleeding::filmVolume(surface.state()) +
           surface.state().wiped + told();
  }
  /// m³ that the field has told the surfaces and they take in the next step.
  double told() const {
    double sum = 0;
    for (const auto& film : feedback.films) sum += film.blood;
    return sum;
  }
  void expectBalance(const char* what) const {
    std::printf(
        "%s: %.4f ml at the holes, %.4f ml lost by the patient, %.4f ml found (%+.3f %%), %.4f sucked\n",
        what, 1e6 * at_holes, 1e6 * blood.circulation().lost, 1e6 * found(), 100 * (found() / at_holes - 1),
        1e6 * field.fluid().sucked);
    EXPECT_NEAR(blood.circulation().lost, at_holes, 1e-6 * at_holes) << what;
    EXPECT_NEAR(found(), at_holes, 1e-3 * at_holes) << what;
    EXPECT_LT(field.fluid().lost, 0.01 * at_holes) << what << ": none leaves the field";
  }

 private:
  scene::Event next;
  bool has_next = false;
};

TEST(Account, OfACutArteryClosesWithinAThousandth) {
  Patient p("gynaecology");
  p.openVessel("uterine_artery_left", 0.03, 1e-4);  // through
  p.run(2.5);
  EXPECT_GT(p.at_holes, 2e-6);
  p.suck();
  p.run(0.5);
  EXPECT_GT(p.field.fluid().sucked, 0.0);
  p.expectBalance("artery");
}

TEST(Account, GoesOnInASceneThatIsEditedWhileItBleeds) {
  Patient p("arterial_bleeding");
  scene::Description edited = p.world.description();
  std::size_t artery = 0;
  while (edited.objects[artery].name != "artery") ++artery;
  p.openVessel("artery", 0.6 * p.world.model().objects[artery].tube.length(), 1e-6);
  p.run(1.0);
  const double before = p.at_holes, flow = p.blood.wounds().openings[0].flow;
  ASSERT_GT(before, 1e-7);
  scene::Object drawn = edited.objects[artery];
  drawn.name = "drawn", drawn.tube.vessel_segment.clear();
  for (auto* list : {&drawn.position, &drawn.rest_position})
    for (Eigen::Vector3d& x : *list) x.z() += 0.05;
  edited.objects.insert(edited.objects.begin(), drawn);
  Patient next(edited);
  EXPECT_EQ(next.adopt(p)[artery], artery + 1);
  ASSERT_EQ(next.blood.wounds().opening_count, 1);
  EXPECT_EQ(next.blood.wounds().openings[0].object, static_cast<std::int32_t>(artery + 1));
  next.run(1.0);
  EXPECT_NEAR(next.blood.wounds().openings[0].flow, flow, 0.5 * flow);
  EXPECT_GT(next.at_holes, 1.3 * before);
  next.expectBalance("edited");

  // Where the artery itself is drawn again it is whole.
  edited.objects[artery + 1].friction += 0.01;
  Patient whole(edited);
  EXPECT_EQ(whole.adopt(next)[artery + 1], scene::kNotAdopted);
  EXPECT_EQ(whole.blood.wounds().opening_count, 0);
  const double lost = whole.blood.circulation().lost;
  whole.run(0.5);
  EXPECT_EQ(whole.blood.circulation().lost, lost);
  whole.expectBalance("drawn again");
}

TEST(Account, FilmsOnWallAndOrganDryInDryGas) {
  Patient p("gynaecology");
  p.feedback.gas.drying = 1.5e-7;  // m/s
  p.openVessel("uterine_artery_left", 0.03, 1e-4);
  p.run(1.5);
  const auto oldest = [](const std::vector<float>& ages) {
    return *std::max_element(ages.begin(), ages.end());
  };
  EXPECT_GT(oldest(p.field.fluid().pools.film_age), 2.0f) << "s: older than the session, since they dry";
  EXPECT_GT(oldest(p.surface.state().age), 2.0f) << "s";
}

/// Opens the artery at 0.6 of its length for half a second. @return m: its middle at 0.35, upstream
Eigen::Vector3d openArtery(Patient& p) {
  std::size_t artery = 0;
  while (p.world.description().objects[artery].name != "artery") ++artery;
  const auto& tube = p.world.model().objects[artery].tube;
  const auto& ring = tube.knots(tube.nearestRing(tube.station(0) + 0.35 * tube.length()));
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto k : ring) centre += p.world.knotAt(artery, k) / static_cast<double>(ring.size());
  p.openVessel("artery", 0.6 * tube.length(), 1e-6);
  p.run(0.5);
  return centre;
}

TEST(Account, AGrasperOnTheArteryStopsTheHoleBehindItWhileItHolds) {
  Patient p("arterial_bleeding");
  const Eigen::Vector3d centre = openArtery(p);
  const auto leak = [&] { return p.blood.wounds().openings[0].flow; };
  const double before = leak();
  ASSERT_GT(before, 1e-7);
  auto& tool = p.input.tools[static_cast<std::size_t>(tools::Instrument::Right)];
  tool.present = true;
  tool.tool = tools::ToolKind::Grasper;
  tool.pivot = {0.115, -0.02, 0.165};
  const Eigen::Vector3d way = (centre - tool.pivot).normalized();
  bool grasped = false;
  for (int roll = 0; roll < 4 && !grasped; ++roll) {  // until the jaws lie across it
    tool.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), way) *
                       Eigen::Quaterniond(Eigen::AngleAxisd(roll * M_PI / 4, Eigen::Vector3d::UnitZ()));
    tool.jaw = 0.8;
    for (int i = 0; i <= 20; ++i) tool.position = centre + (0.006 - 0.002 * (20 - i)) * way, p.run(0.01);
    for (int i = 0; i <= 20; ++i) tool.jaw = 0.04 * (20 - i), p.run(0.01);
    grasped = p.world.state().grasps[static_cast<std::size_t>(tools::Instrument::Right)].active;
  }
  ASSERT_TRUE(grasped);
  p.run(1.0);
  std::printf("%.2f ml/s through the hole, %.2f ml/s while it is held\n", 1e6 * before, 1e6 * leak());
  EXPECT_LT(leak(), 0.5 * before) << "what flows back is left";
  for (int i = 0; i <= 20; ++i) tool.jaw = 0.04 * i, p.run(0.01);
  p.run(0.6);
  EXPECT_GT(leak(), 0.7 * before);
}

// Protects that whatever presses on a vessel shuts it, as a finger does: here a closed grasper's shaft.
TEST(Account, AShaftPressedAcrossTheArteryStopsTheHoleBehindItWhileItPresses) {
  Patient p("arterial_bleeding");
  const Eigen::Vector3d centre = openArtery(p);
  const auto beat = [&] {  // m³ through the hole in a second
    const double so_far = p.at_holes;
    p.run(1.0);
    return p.at_holes - so_far;
  };
  const double before = beat();
  ASSERT_GT(before, 1e-7);
  constexpr auto kHand = static_cast<std::size_t>(tools::Instrument::Right);
  auto& tool = p.input.tools[kHand];
  tool.present = true;
  tool.tool = tools::ToolKind::Grasper;
  tool.pivot = {0.115, -0.02, 0.165};
  const auto hold = [&](int millimetres) {  // the shaft's axis over where the artery lay; its tip is beyond
    const Eigen::Vector3d over = centre + Eigen::Vector3d(0, 0, 1e-3 * millimetres);
    const Eigen::Vector3d way = (over - tool.pivot).normalized();
    tool.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), way);
    tool.position = over + 0.045 * way;
    p.run(0.05);
  };
  for (int mm = 12; mm >= -26; --mm) hold(mm);  // it hangs between its ends: it gives way
  const double force = p.report.contacts[kHand].wrench.head<3>().norm(), pressed = beat();
  std::printf("%.3f ml in a second, %.3f under %.2f N\n", 1e6 * before, 1e6 * pressed, force);
  EXPECT_LT(pressed, 0.65 * before) << "what flows back is left";
  for (int mm = -26; mm <= 12; ++mm) hold(mm);
  EXPECT_GT(beat(), 0.85 * before);
}

TEST(Account, OfAVeinClosesWithinAThousandth) {
  Patient p("gynaecology");
  p.openVessel("uterine_vein_left", 0.03, 2e-6);
  p.run(2.5);
  EXPECT_GT(p.at_holes, 1e-6);
  p.expectBalance("vein");
}

TEST(Account, ClosesWithAnArteryFullOfWoundsAndAPoundingHeart) {
  Patient p("arterial_bleeding");
  p.input.edits = {{"", "heart_rate", 4.0}};
  p.run(0.012);  // all in all whole steps of the fluid
  for (int i = 0; i < 60; ++i) {
    p.openVessel("artery", 0.00125 * (1 + i), i % 2 == 0 ? 2e-7 : 1e-4);  // a hole; through
    p.run(0.04);
    ASSERT_NE(p.report.status, scene::Status::Fault) << i << ": " << p.report.fault_object << p.world.time();
  }
  EXPECT_GT(p.blood.wounds().opening_count, 24);
  p.run(0.5);
  EXPECT_NE(p.report.status, scene::Status::Fault);
  p.expectBalance("48 wounds");
}

TEST(Account, OfASeepingSurfaceClosesWithinAThousandthWithItsFilm) {
  Patient p("smoke_lens");
  std::size_t object = 0;
  while (!p.world.model().objects[object].deforms) ++object;
  p.cutAt(object, p.world.knotAt(object, 10));
  p.run(4);
  EXPECT_GT(p.at_holes, 1e-9);
  EXPECT_GT(bleeding::filmVolume(p.surface.state()), 0.0);
  p.expectBalance("surface");
}

TEST(Account, OfWhatASwabWipesAndSoaksUpClosesWithinAThousandth) {
  Patient p("smoke_lens");
  std::size_t object = 0;
  while (!p.world.model().objects[object].deforms) ++object;
  // The highest knot: a swab comes to it from above.
  std::uint32_t top = 0;
  for (std::uint32_t k = 0; k < p.world.knotCount(object); ++k)
    if (p.world.knotAt(object, k).z() > p.world.knotAt(object, top).z()) top = k;
  p.cutAt(object, p.world.knotAt(object, top));
  p.run(3);
  const double film = bleeding::filmVolume(p.surface.state());
  ASSERT_GT(film, 1e-9);
  constexpr auto kHand = static_cast<std::size_t>(tools::Instrument::Right);
  auto& tool = p.input.tools[kHand];
  tool.present = true, tool.tool = tools::ToolKind::Swab;
  tool.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));  // straight down
  const Eigen::Vector3d place = p.world.knotAt(object, top);
  tool.pivot = place + Eigen::Vector3d(0, 0, 0.12);
  for (int i = 0; i < 40; ++i) tool.position = place + Eigen::Vector3d(0, 0, 0.040 - 0.0005 * i), p.run(0.01);
  const double seeped = p.surface.state().seeped;
  p.run(1);
  ASSERT_TRUE(p.report.contacts[kHand].in_contact);
  const bleeding::Swab& swab = p.field.swab(kHand);
  std::printf("%.4f ml of film before, %.4f ml in the swab, %.4f ml of it wiped\n", 1e6 * film,
              1e6 * swab.volume, 1e6 * p.surface.state().wiped);
  // How much is wiped is the matter of surface_test; nothing wiped would balance too.
  EXPECT_GT(p.surface.state().wiped, 1e-9);
  EXPECT_NEAR(swab.volume, p.surface.state().wiped + p.field.fluid().soaked, 1e-12);
  EXPECT_LE(swab.blood, swab.volume * (1 + 1e-9));
  EXPECT_LT(p.surface.state().seeped - seeped, 0.1 * film) << "and what it presses on bleeds no more";
  p.expectBalance("swab");
}

}  // namespace
}  // namespace vest::simulation
