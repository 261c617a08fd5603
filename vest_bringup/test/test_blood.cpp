#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "blood_bench.h"

// Protects the coupling of circulation and tissue: places of the scene and of the network, pulse, sources,
// snapshots, and that a session with effects can be re-simulated.

namespace vest::simulation {
namespace {

TEST(Blood, EveryVesselOfTheSceneIsOneOfTheNetwork) {
  Bench b;
  for (const auto& object : b.world.description().objects) {
    if (!object.tube.vessel_segment.empty()) {
      EXPECT_GE(b.effect.model().find(object.tube.vessel_segment), 0) << object.name;
    }
  }
}

TEST(Blood, CutArterySpurtsFromBothEndsAndAClipAndALigatureStopIt) {
  Bench b;
  const double length = b.world.model().objects[objectNamed(b.world, "uterine_artery_left")].tube.length();
  b.event(scene::EventKind::Cut, "uterine_artery_left", 0.5 * length, 1e-5);
  double emitted = 0, most = 0, least = 1;
  for (int i = 0; i < 2500; ++i) {
    b.step();
    if (i == 0) {
      ASSERT_EQ(b.feedback.sources.size(), 2U);
    }
    double flow = 0;
    for (const auto& s : b.feedback.sources) flow += s.flow, emitted += s.flow * 1e-3;
    if (i > 1000) most = std::max(most, flow), least = std::min(least, flow);
  }
  // What the wounds give is what the patient loses; in step with the pulse.
  EXPECT_NEAR(emitted, b.effect.circulation().lost, 1e-9 * emitted);
  EXPECT_GT(most, 1.3 * least);
  const auto& heart = b.feedback.sources[0];
  const auto& far = b.feedback.sources[1];
  EXPECT_LT((heart.position - far.position).norm(), 0.02);
  EXPECT_NEAR(heart.direction.norm(), 1, 1e-12);
  EXPECT_LT(heart.direction.dot(far.direction), 0);  // against each other
  b.event(scene::EventKind::Clipped, "uterine_artery_left", 0.5 * length - 0.004, std::nan(""));
  b.event(scene::EventKind::Ligated, "uterine_artery_left", 0.5 * length + 0.004, std::nan(""));
  for (int i = 0; i < 1500; ++i) b.step();
  const double lost = b.effect.circulation().lost;
  for (int i = 0; i < 1000; ++i) b.step();
  EXPECT_LT(b.effect.circulation().lost - lost, 5e-9);
}

TEST(Blood, GauzePressedOnAHoleStopsItAndThreeMinutesOfThatHold) {
  Bench b;
  b.event(scene::EventKind::Punctured, "uterine_artery_left", 0.03, 6e-7);
  for (int i = 0; i < 200; ++i) b.step();
  ASSERT_EQ(b.effect.wounds().opening_count, 1);
  const auto& wound = b.effect.wounds().openings[0];
  const double open = wound.flow;
  ASSERT_GT(open, 1e-8);
  constexpr std::size_t kHand = 1;
  auto& tool = b.input.tools[kHand];
  auto& contact = b.report.contacts[kHand];
  tool.present = true, tool.tool = tools::ToolKind::Swab;
  const Eigen::Vector3d front = tools::toolGeometry(tool.tool).interaction_points.front();
  contact.proxy.translation() = b.world.knotAt(static_cast<std::size_t>(wound.object), wound.knot) - front +
                                Eigen::Vector3d(0, 0, 0.007);
  contact.in_contact = true;
  // 100 mmHg on a wad of 1.54 cm²: 2.05 N.
  const auto press = [&](double force, double seconds) {
    contact.wrench.head<3>() = Eigen::Vector3d(0, 0, force);
    for (int i = 0; i < static_cast<int>(1000 * seconds + 0.5); ++i) b.step();
    return wound.flow;
  };
  EXPECT_NEAR(press(0, 0.2), open, 0.02 * open) << "it lies there";
  EXPECT_LT(press(1, 0.5), 0.8 * open);
  EXPECT_GT(press(1, 0.01), 0.1 * open) << "half the pressure holds half back";
  EXPECT_LT(press(4, 5), 1e-3 * open) << "pressed";
  contact.in_contact = false;
  EXPECT_GT(press(0, 0.5), 0.7 * open) << "five seconds make no clot";
  contact.in_contact = true;
  press(4, bleeding::kStillClotting + 2);
  contact.in_contact = false;
  EXPECT_LT(press(0, 0.5), 0.02 * open) << "the clot holds";
  tool.tool = tools::ToolKind::SuctionIrrigator, tool.functions = tools::kFunctionSuck;
  tool.position = b.world.knotAt(static_cast<std::size_t>(wound.object), wound.knot);
  EXPECT_GT(press(0, 0.5), 0.7 * open) << "a sucker takes it, and it bleeds again";
  EXPECT_GT(b.feedback.clots[kHand], 0) << "m³";
}

TEST(Blood, ABolusIsGivenOnceAndDripsGoOn) {
  Bench b;
  b.input.edits = {{"", "phenylephrine", 1e-7},
                   {"", "ephedrine", 1e-5},
                   {"", "noradrenaline", 1e-10},
                   {"", "transfusion", 1e-5},
                   {"", "infusion", 5e-6}};
  for (int i = 0; i < 1000; ++i) b.step();
  const auto& c = b.effect.circulation();
  EXPECT_NEAR(c.given, 1.5e-5, 1e-10);
  EXPECT_NEAR(c.transfused, 1e-5, 1e-10);
  const auto given = [&](haemodynamics::DrugIndex d) { return c.drug_comes[d] + c.drug_acts[d]; };
  EXPECT_NEAR(given(haemodynamics::kPhenylephrine), 1e-7, 1e-9);
  EXPECT_NEAR(given(haemodynamics::kEphedrine), 1e-5, 1e-7);
  EXPECT_NEAR(given(haemodynamics::kNoradrenaline), 1e-10, 1e-12);
}

TEST(Blood, VenousOozeStopsByCoagulation) {
  Bench b;
  b.event(scene::EventKind::Punctured, "uterine_vein_left", 0.03, 1e-6);
  for (int i = 0; i < 100; ++i) b.step();
  ASSERT_EQ(b.feedback.sources.size(), 1U);
  const double flow = b.feedback.sources[0].flow;
  EXPECT_GT(flow, 1e-8);
  EXPECT_LT(flow, 2e-6);
  b.event(scene::EventKind::Coagulated, "uterine_vein_left", 0.031, 0.0);  // sealed all round
  b.step();
  b.step();
  EXPECT_TRUE(b.feedback.sources.empty());
}

TEST(Blood, TissueIsToldToBlanchWhenAllItsArteriesAreClipped) {
  Bench b;
  scene::TripleBuffer<SurfaceFrame> frames;
  SurfaceEffect surface(b.world, {}, &b.effect, &frames);
  const auto supply = [&](const char* name) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < objectNamed(b.world, name); ++i) first += b.world.knotCount(i);
    return frames.front().supply.at(first);
  };
  const auto run = [&](int milliseconds) {  // the vessels alone, then the tissue until its next frame
    for (int i = 0; i < milliseconds; ++i) b.step();
    do {
      b.world.step(b.input, b.report);
      surface.step(b.world, b.input, b.report, b.feedback);
    } while (!frames.update());
    b.report.events.clear();
  };
  run(0);
  for (const char* name : {"uterus", "ovary_right", "tube_right", "cavity"})
    EXPECT_GT(supply(name), 0.95) << name;
  b.event(scene::EventKind::Clipped, "ovarian_artery_right", 0.02, std::nan(""));
  run(3000);
  EXPECT_GT(supply("ovary_right"), 0.9) << "the uterine artery's tubal branch feeds it";
  b.event(scene::EventKind::Clipped, "uterine_artery_right", 0.02, std::nan(""));
  run(2000);
  EXPECT_NEAR(supply("ovary_right"), std::exp(-1.0), 0.12) << "after kPerfusionTime";
  run(4000);
  for (const char* name : {"ovary_right", "tube_right"}) EXPECT_LT(supply(name), 0.1) << name;
  EXPECT_NEAR(supply("uterus"), 0.5, 0.1) << "the left side is left";
  EXPECT_GT(supply("ovary_left"), 0.9);
  EXPECT_EQ(supply("cavity"), 1) << "no vessel of the database feeds it";
}

TEST(Blood, TissueWhoseVeinsAreClippedIsDrainedNoMore) {
  Bench b;
  for (const char* vein : {"ovarian_vein_right", "uterine_vein_right"})
    b.event(scene::EventKind::Clipped, vein, 0.02, std::nan(""));
  b.step();
  const auto& territories = b.effect.model().vessels.territories;
  for (std::size_t k = 0; k < territories.size(); ++k) {
    const std::string& name = territories[k].tissue;
    EXPECT_EQ(b.effect.drained(k),
              name == "ovary_right" || name == "tube_right" || name == "broad_ligament_right" ? 0.0
              : name == "uterus"                                                              ? 0.5
                                                                                              : 1.0)
        << name;
  }
}

TEST(Blood, APartThatIsCutOffLosesItsSupplyAndTheRestKeepsIt) {
  scene::Description tube = scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/tube/tube.yaml");
  tube.gravity.setZero();
  for (std::size_t k = 0; k < tube.objects[0].fixed.size(); ++k)  // held at one end alone
    if (tube.objects[0].rest_position[k].x() > 0) tube.objects[0].fixed[k] = 0;
  scene::World world(tube);
  SurfaceEffect surface(world, {}, nullptr, nullptr);
  const auto& rings = world.model().objects[0].tube;
  const auto run = [&](double seconds) {
    scene::StepInput input;
    scene::StepReport report;
    Feedback feedback;
    feedback.sources.reserve(bleeding::kMostSources);
    for (int i = 0; i < 1000 * seconds; ++i) {
      input.step = world.steps() + 1;
      world.step(input, report);
      surface.step(world, input, report, feedback);
    }
  };
  const auto reach = [&](std::size_t ring) { return surface.perfusion().reach[rings.knots(ring)[0]]; };
  run(1);
  EXPECT_EQ(reach(20), 1);
  std::uint32_t copy = 0;
  const std::size_t knots = world.knotCount(0);
  const double at = tube.objects[0].rest_position[rings.knots(12)[0]].x() + 1e-6;
  for (const std::uint32_t knot : rings.knots(12)) world.splitKnot(0, knot, Eigen::Vector3d::UnitX(), copy);
  const auto right = [&](std::uint32_t k) { return k >= knots || tube.objects[0].rest_position[k].x() > at; };
  const auto links = world.topology(0).links;
  for (std::uint32_t l = 0; l < links.size(); ++l)  // those that pass the ring
    if (right(links[l].knot0) != right(links[l].knot1)) world.removeLink(0, l);
  run(bleeding::kBlanchTime);
  EXPECT_NEAR(reach(20), std::exp(-1.0), 0.03);
  EXPECT_EQ(reach(4), 1);
  // The State carries it.
  std::vector<std::uint8_t> bytes, again;
  surface.save(bytes);
  const scene::World whole(tube);
  SurfaceEffect other(whole, {}, nullptr, nullptr);
  ASSERT_TRUE(other.restore(bytes.data(), bytes.size()));
  other.save(again);
  EXPECT_EQ(again, bytes);
}

TEST(Blood, CutUterusSeepsAndThePatientLosesIt) {
  Bench b;
  SurfaceOptions surface;
  surface.scale = 50;
  SurfaceEffect seeping(b.world, surface, &b.effect, nullptr);
  const std::uint16_t uterus = objectNamed(b.world, "uterus");
  scene::Event cut;
  cut.kind = scene::EventKind::Cut;
  cut.object = uterus;
  cut.position = b.world.knotAt(uterus, 100);
  cut.station = std::nan(""), cut.area = 1e-6;
  double shed = 0;
  for (int i = 0; i < 3000; ++i) {
    if (i == 10) b.report.events.push_back(cut);
    b.feedback.sources.clear();
    b.effect.step(b.world, b.input, b.report, b.feedback);
    seeping.step(b.world, b.input, b.report, b.feedback);
    for (const auto& s : b.feedback.sources) shed += s.flow * 1e-3;
    b.report.events.clear();
  }
  EXPECT_GT(seeping.state().seeped, 1e-9);
  EXPECT_NEAR(b.effect.circulation().lost, seeping.state().seeped, 1e-9 * seeping.state().seeped);
  EXPECT_NEAR(shed, seeping.state().shed, 1e-9 * shed);
  EXPECT_NEAR(seeping.state().seeped, bleeding::filmVolume(seeping.state()) + seeping.state().shed,
              1e-9 * seeping.state().seeped);
  std::vector<std::uint8_t> bytes, again;
  seeping.save(bytes);
  SurfaceEffect other(b.world, surface, nullptr, nullptr);
  EXPECT_FALSE(other.restore(bytes.data(), bytes.size() - 1));
  ASSERT_TRUE(other.restore(bytes.data(), bytes.size()));
  other.save(again);
  EXPECT_EQ(again, bytes);
}

TEST(Blood, KnotsSeepByTheSupplyThatTheSceneGivesThemAndSoDoTheirCopies) {
  scene::Description d = gynaecology();
  scene::Object* uterus = nullptr;
  for (scene::Object& o : d.objects)
    if (o.name == "uterus") uterus = &o;
  ASSERT_NE(uterus, nullptr);
  const std::size_t knots = uterus->rest_position.size();
  const auto place = [&](std::uint32_t k) { return uterus->rest_position[k].x(); };
  std::uint32_t fed = 0, bare = 0;  // the knots farthest to both sides
  for (std::uint32_t k = 0; k < knots; ++k) {
    if (place(k) > place(fed)) fed = k;
    if (place(k) < place(bare)) bare = k;
  }
  const auto flow = [&](std::vector<std::uint32_t> of) {
    scene::World world(d);
    SurfaceEffect seeping(world, {50.0, 10.0}, nullptr, nullptr);
    scene::StepInput input;
    scene::StepReport report;
    Feedback feedback;
    feedback.sources.reserve(bleeding::kMostSources);
    const std::uint16_t object = objectNamed(world, "uterus");
    for (int i = 0; i < 40; ++i) {
      input.step = world.steps() + 1;
      world.step(input, report);
      for (const std::uint32_t k : {fed, bare}) {
        scene::Event cut;
        cut.kind = scene::EventKind::Cut, cut.object = object;
        cut.position = world.knotAt(object, k), cut.station = std::nan(""), cut.area = 1e-6;
        if (i == 3) report.events.push_back(cut);
      }
      std::uint32_t copy = 0;
      if (i == 11) {
        EXPECT_TRUE(world.splitKnot(object, bare, Eigen::Vector3d::UnitZ(), copy));
      }
      feedback.sources.clear();
      seeping.step(world, input, report, feedback);
    }
    const std::uint32_t first = seeping.model().first[object];
    EXPECT_GT(seeping.state().area[first + knots], 0) << "the copy has a surface";
    std::vector<float> flows;
    for (const std::uint32_t k : of) flows.push_back(seeping.state().flow[first + k]);
    return flows;
  };
  const auto copy = static_cast<std::uint32_t>(knots);
  const auto before = flow({fed, bare, copy});
  for (const float f : before) EXPECT_GT(f, 0);
  uterus->knot_perfusion.assign(knots, 2 * uterus->thermal.perfusion);
  for (std::uint32_t k = 0; k < knots; ++k)
    if (place(k) < place(bare) + 0.01) uterus->knot_perfusion[k] = 0;
  const auto after = flow({fed, bare, copy});
  EXPECT_NEAR(after[0], 2 * before[0], 0.05f * before[0]);
  EXPECT_EQ(after[1], 0);
  EXPECT_EQ(after[2], 0);
}

TEST(Blood, TheMonitorReadsOneArteryAndItsLossNowHasTheOozeToo) {
  const scene::World world{gynaecology()};
  scene::TripleBuffer<BloodFrame> frames;
  BloodEffect effect(world, options(), &frames);
  SurfaceOptions surface;
  surface.scale = 50;
  SurfaceEffect seeping(world, surface, &effect, nullptr);
  scene::StepReport report;
  Feedback feedback;
  feedback.sources.reserve(bleeding::kMostSources), feedback.dilatations.reserve(64);
  scene::Event cut;
  cut.kind = scene::EventKind::Cut;
  cut.object = objectNamed(world, "uterus");
  cut.position = world.knotAt(cut.object, 100);
  cut.station = std::nan(""), cut.area = 1e-6;
  double most = 0;
  constexpr int kEnd = 3000, kBeat = 860;  // steps
  for (int i = 0; i < kEnd; ++i) {
    if (i == 10) report.events.push_back(cut);
    feedback.sources.clear(), feedback.dilatations.clear();
    effect.step(world, {}, report, feedback);
    seeping.step(world, {}, report, feedback);
    report.events.clear();
    if (frames.update() && i > kEnd - kBeat) most = std::max(most, frames.front().pressure);
  }
  EXPECT_NEAR(most, frames.front().systolic, 0.005 * most) << "Pa: curve and number are of one artery";
  double ooze = 0;
  for (const float flow : seeping.state().flow) ooze += static_cast<double>(flow);
  EXPECT_GT(ooze, 1e-9) << "m³/s";
  EXPECT_NEAR(frames.front().loss_rate, ooze, 0.02 * ooze) << "no vessel is open";
}

TEST(Blood, HeatBesideAHoleSealsItInTheScenesMetres) {
  Bench b;
  b.event(scene::EventKind::Punctured, "uterine_artery_left", 0.03, 5e-7);
  b.step();
  b.event(scene::EventKind::Coagulated, "uterine_artery_left", 0.032, 0.0);
  b.step();
  ASSERT_EQ(b.effect.wounds().opening_count, 1);
  EXPECT_EQ(b.effect.wounds().openings[0].sealed, b.effect.wounds().openings[0].area);
}

TEST(Blood, AJetFromAHoleHasTorricellisSpeed) {
  Bench b;
  b.event(scene::EventKind::Punctured, "iliac_artery_left", 0.03, 1e-6);
  for (int i = 0; i < 200; ++i) b.step();
  ASSERT_EQ(b.feedback.sources.size(), 1U);
  const auto& s = b.feedback.sources[0];
  const auto& o = b.effect.wounds().openings[0];
  const double p = hd::at(b.effect.model(), b.effect.circulation(), o.vessel, o.station).pressure;
  EXPECT_NEAR(s.flow / s.area, std::sqrt(2 * p / b.effect.model().arteries.density), 0.1);
}

TEST(Blood, EventsWithoutAVesselOrAPlaceDoNothing) {
  Bench b;
  b.event(scene::EventKind::Cut, "uterus", std::nan(""), 1e-5);
  b.event(scene::EventKind::Cut, "uterine_artery_left", std::nan(""), 1e-5);
  b.event(scene::EventKind::Grasped, "uterine_artery_left", 0.03, 1e-5);
  b.step();
  EXPECT_EQ(b.effect.wounds().opening_count, 0);
}

TEST(Blood, PulseWidensTheRingsOfTheSceneByTheFactorForTeaching) {
  const auto widening = [](double factor) {
    Trainer trainer{scene::World(gynaecology())};
    trainer.add(std::make_unique<BloodEffect>(trainer.world(), options(), nullptr));
    const auto object = objectNamed(trainer.world(), "iliac_artery_left");
    const auto& tube = trainer.world().model().objects[object].tube;
    double most = 0, least = 1;
    scene::StepReport report;
    for (std::uint64_t k = 1; k <= 1400; ++k) {
      scene::StepInput input;
      input.step = k;
      if (k == 1) input.edits.push_back({"", "pulse_dilatation", factor});
      trainer.step(input, report);
      if (k < 500) continue;
      double sum = 0;
      const auto& ring = tube.knots(6);
      for (std::size_t i = 0; i < ring.size(); ++i)
        sum += (trainer.world().knotAt(object, ring[i]) -
                trainer.world().knotAt(object, ring[(i + 1) % ring.size()]))
                   .norm();
      most = std::max(most, sum), least = std::min(least, sum);
    }
    return most / least - 1;
  };
  const double none = widening(0), once = widening(1);
  std::printf("ring of the external iliac artery: %.2f %% wider in systole (%.2f %% without pulse)\n",
              100 * once, 100 * none);
  EXPECT_GT(once, 0.02);
  EXPECT_LT(once, 0.16);
  EXPECT_LT(none, 0.3 * once);
}

TEST(Blood, ThePulseRunsAlongTheVessel) {
  // The circulation says when the wave passes each end (its own tests hold the speed); the rings follow.
  Trainer trainer{scene::World(gynaecology())};
  auto effect = std::make_unique<BloodEffect>(trainer.world(), options(), nullptr);
  const BloodEffect& blood = *effect;
  trainer.add(std::move(effect));
  const auto object = objectNamed(trainer.world(), "iliac_artery_left");
  const auto& tube = trainer.world().model().objects[object].tube;
  const int vessel = blood.model().find(tube.segment());
  ASSERT_GE(vessel, 0);
  struct Upstroke {
    double before = 0, steepest = 0;
    std::uint64_t when = 0;
    void see(double value, std::uint64_t k) {
      if (before > 0 && value - before > steepest) steepest = value - before, when = k;
      before = value;
    }
  };
  Upstroke told[2];                              // what the tissue is told of both ends
  std::vector<Upstroke> seen(tube.ringCount());  // the rings
  const auto perimeter = [&](std::size_t r) {
    const auto& ring = tube.knots(r);
    double sum = 0;
    for (std::size_t i = 0; i < ring.size(); ++i)
      sum += (trainer.world().knotAt(object, ring[i]) -
              trainer.world().knotAt(object, ring[(i + 1) % ring.size()]))
                 .norm();
    return sum;
  };
  scene::StepReport report;
  for (std::uint64_t k = 1; k <= 1200; ++k) {
    scene::StepInput input;
    input.step = k;
    trainer.step(input, report);
    if (k < 300) continue;
    for (std::size_t r = 0; r < seen.size() && k % 4 == 0; ++r) seen[r].see(perimeter(r), k);
    for (const auto& d : input.dilatations)
      if (d.vessel_segment.view() == tube.segment()) {
        told[0].see(static_cast<double>(d.dilatation.front()), k);
        told[1].see(static_cast<double>(d.dilatation.back()), k);
      }
  }
  const double length = blood.model().length(vessel);
  const double speed = length / (1e-3 * static_cast<double>(told[1].when - told[0].when));
  seen.erase(std::remove_if(seen.begin(), seen.end(), [](const Upstroke& u) { return u.when == 0; }),
             seen.end());  // rings that are fixed
  ASSERT_GE(seen.size(), 3U);
  std::printf("pulse along %s: %.0f mm in %d ms, %.1f m/s; %zu rings that move, %d ms\n",
              tube.segment().c_str(), 1e3 * length, static_cast<int>(told[1].when - told[0].when), speed,
              seen.size(), static_cast<int>(seen.back().when) - static_cast<int>(seen.front().when));
  // Pulse wave velocity of adults' iliac arteries 5 … 15 m/s; the input is told every 4 ms.
  EXPECT_GT(told[1].when, told[0].when);
  EXPECT_GT(speed, 3);
  EXPECT_LT(speed, 25);
  EXPECT_GT(seen.back().when, seen.front().when);
}

/// A phase beyond a beat, or an opening in what is no vessel: a step would go on for ever, or read what is
/// not there.
TEST(Blood, AStateThatNoStepLeavesIsRefused) {
  Bench b;
  b.event(scene::EventKind::Cut, "uterine_artery_left", 0.03, 1e-5);
  for (int k = 0; k < 5; ++k) b.step();
  std::vector<std::uint8_t> bytes;
  b.effect.save(bytes);
  ASSERT_TRUE(b.effect.restore(bytes.data(), bytes.size()));
  const auto refused = [&](std::size_t at, auto value) {
    std::vector<std::uint8_t> other = bytes;
    std::memcpy(other.data() + at, &value, sizeof value);
    return !b.effect.restore(other.data(), other.size());
  };
  // As BloodEffect::walk() writes them: time, phase, areas; at the end openings, clamps, two numbers.
  constexpr std::size_t kPhase = 8, kAreas = 24, kOpening = 77, kClamp = 19, kEnd = 16;
  for (const double phase : {1e300, -1.0, 60.0}) EXPECT_TRUE(refused(kPhase, phase)) << phase;
  std::uint64_t cells = 0;
  std::memcpy(&cells, bytes.data() + kAreas - sizeof cells, sizeof cells);
  const std::size_t velocities = kAreas + cells * sizeof(double) + sizeof cells;
  for (const double area : {0.0, -1e-6, 1e6}) EXPECT_TRUE(refused(kAreas, area)) << area;
  EXPECT_TRUE(refused(velocities, 1e9));
  const std::size_t clamp = bytes.size() - kEnd - bleeding::kMostClamps * kClamp,
                    opening = clamp - bleeding::kMostOpenings * kOpening;
  std::int32_t object = 0;
  std::memcpy(&object, bytes.data() + opening + 65, sizeof object);
  ASSERT_EQ(object, objectNamed(b.world, "uterine_artery_left"));
  EXPECT_TRUE(refused(opening + 65, std::int32_t{objectNamed(b.world, "cavity")}));
  EXPECT_TRUE(refused(opening + 9, 1e300)) << "station";
  EXPECT_TRUE(refused(opening + 8, std::int8_t{100})) << "end";
  EXPECT_FALSE(refused(kPhase, 0.25));
}

TEST(Blood, SessionWithEffectsIsTheSameBitsAgainForAnyThreadsAndFromASnapshot) {
  const auto make = [](int threads) {
    auto trainer = std::make_unique<Trainer>(scene::World(gynaecology(), threads));
    trainer->add(std::make_unique<BloodEffect>(trainer->world(), options(), nullptr));
    return trainer;
  };
  const auto inputAt = [](std::uint64_t k) {
    scene::StepInput input;
    input.step = k;
    if (k == 20) input.edits.push_back({"uterine_artery_left", "opening_station", 0.04});
    if (k == 21) input.edits.push_back({"uterine_artery_left", "opening_area", 1e-4});
    if (k == 22) input.edits = {{"", "noradrenaline", 2e-10}, {"", "ephedrine", 1e-5}};
    if (k == 60) input.edits.push_back({"", "heart_rate", 1.5});
    return input;
  };
  auto first = make(1);
  scene::StepReport report;
  std::vector<scene::StepInput> recorded;
  std::vector<std::uint8_t> snapshot;
  for (std::uint64_t k = 1; k <= 120; ++k) {
    scene::StepInput input = inputAt(k);
    first->step(input, report);
    recorded.push_back(input);
    if (k == 50) first->save(snapshot);
  }
  // The tissue alone, from what was recorded.
  for (const int threads : {1, 3}) {
    session::Resimulation again(
        std::make_unique<scene::TissueSimulation>(scene::World(gynaecology(), threads)));
    for (const auto& input : recorded)
      ASSERT_EQ(again.step(input, false, false), session::Resimulation::Outcome::Same);
    EXPECT_TRUE(again.compare(first->world().stateHash()));
  }
  // The whole composite, from what people did.
  auto second = make(2);
  for (std::uint64_t k = 1; k <= 120; ++k) {
    scene::StepInput input = inputAt(k);
    second->step(input, report);
    ASSERT_EQ(input.dilatations.size(), recorded[k - 1].dilatations.size());
  }
  EXPECT_EQ(second->world().stateHash(), first->world().stateHash());
  EXPECT_EQ(second->effectsHash(), first->effectsHash());
  // From the snapshot, effects included.
  auto third = make(1);
  third->restore(snapshot);
  for (std::uint64_t k = 51; k <= 120; ++k) {
    scene::StepInput input = inputAt(k);
    third->step(input, report);
  }
  EXPECT_EQ(third->world().stateHash(), first->world().stateHash());
  EXPECT_EQ(third->effectsHash(), first->effectsHash());
  // Damaged effects: refused, and nothing has changed.
  std::vector<std::uint8_t> damaged = snapshot;
  damaged.erase(damaged.end() - 100, damaged.end() - 60);
  EXPECT_THROW(third->restore(damaged), std::invalid_argument);
  EXPECT_EQ(third->world().stateHash(), first->world().stateHash());
  EXPECT_EQ(third->effectsHash(), first->effectsHash());
}

}  // namespace
}  // namespace vest::simulation
