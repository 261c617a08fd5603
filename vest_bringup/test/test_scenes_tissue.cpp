#include <cstdlib>
#include <numeric>

#include "passages.h"
#include "play.h"
#include "vest_tissue/scene/loose.h"
#include "vest_tissue/scene/stitches.h"
#include "vest_tissue/scene/world_state.h"
#include "vest_tissue/suture/knot_kind.h"

// Protects the small scenes of the tissue: each script really shows the interaction that it is named after.

namespace vest::simulation {
namespace {

using scene::EventKind;
using scene::Field;

constexpr double kThrowReplayed = 31.2;  // s: before the throw is drawn off the jaws

TEST(SceneTouch, ThePressDentsTheLiverAndFrictionPullsAgainstTheStroke) {
  Play p("touch_slab");
  const auto start = p.knots("slab");
  double dent = 0, normal = 0;
  Eigen::Vector3d stroke = Eigen::Vector3d::Zero();  // mean force of the stroke
  p.run([&](double t, const scene::StepInput&, const scene::StepReport& r) {
    const Eigen::Vector3d f = r.contacts[kRightHand].wrench.head<3>();
    if (at(t, 3.3)) dent = p.moved("slab", start), normal = f.norm();
    if (t > 3.8 && t < 6.0) stroke += f / 2200.0;
  });
  EXPECT_GT(dent, 0.003) << "m";
  EXPECT_GT(normal, 0.02) << "N";
  EXPECT_GT(stroke.x(), 0.03 * stroke.norm()) << "the tip goes to -x, the tissue pulls it to +x";
  EXPECT_LT(stroke.x(), 0.5 * stroke.norm()) << "within what friction can";
  EXPECT_LT(p.moved("slab", start), 0.001) << "it comes back";
}

TEST(SceneGrasp, ItIsHeldThenSlipsThenTears) {
  Play p("grasp_tube");
  const auto start = p.knots("tube");
  double lifted = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 3.9)) lifted = p.moved("tube", start);
  });
  const auto grasped = p.times(EventKind::Grasped, "tube");
  ASSERT_GE(grasped.size(), 3U);
  EXPECT_GT(lifted, 0.006) << "m";
  const double slipped = p.first(EventKind::Slipped, "tube"), torn = p.first(EventKind::Torn, "tube");
  EXPECT_GT(slipped, grasped[1]) << "a firm hold does not slip";
  EXPECT_LT(slipped, grasped[2]);
  EXPECT_GT(torn, grasped[2]) << "neither a lift nor a slip tears";
  EXPECT_LT(torn, 16.0);
  EXPECT_GE(p.times(EventKind::Separated, "tube").size(), 1U) << "what is torn off is a piece";
  // What tore has no surface: no triangle spans the gap.
  const std::size_t tube = p.object("tube");
  const auto now = p.knots("tube");
  const auto& rest = p.world().description().objects[tube].rest_position;
  const auto& triangles = p.world().contactTriangles(tube);
  const auto& alive = p.world().contactTriangleAlive(tube);
  std::size_t gone = 0;
  double longest = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    gone += alive[t] == 0;
    for (std::size_t e = 0; alive[t] && e < 3; ++e) {
      const std::uint32_t a = triangles[t][e], b = triangles[t][(e + 1) % 3];
      const Eigen::Vector3d way(now[3 * a] - now[3 * b], now[3 * a + 1] - now[3 * b + 1],
                                now[3 * a + 2] - now[3 * b + 2]);
      longest = std::max(longest, way.norm() / (rest[a] - rest[b]).norm());
    }
  }
  EXPECT_GT(gone, 0U);
  EXPECT_LT(longest, 2.0) << "over its length at rest";
}

TEST(SceneCutTube, ScissorsDivideItIntoTwoStumps) {
  Play p("cut_tube");
  p.run();
  EXPECT_GT(p.times(EventKind::Cut, "tube").size(), 3U);
  EXPECT_LT(p.first(EventKind::Separated, "tube"), 6.0);
  EXPECT_GT(p.gape("tube"), 0.010) << "m between the stumps";
}

TEST(SceneCutStrip, TwoBitesOfTheScissorsMakeAGapingWound) {
  Play p("cut_strip");
  double after_first = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 4.9)) after_first = p.gape("strip");
  });
  EXPECT_GT(after_first, 0.0005) << "m";
  EXPECT_GT(p.gape("strip"), after_first);
}

TEST(SceneHook, CuttingCurrentDividesTheFold) {
  Play p("hook_strip");
  double before_current = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (t < 1.5) before_current = std::max(before_current, p.gape("strip"));
  });
  EXPECT_EQ(before_current, 0.0) << "a hook without current divides nothing";
  EXPECT_GT(p.times(EventKind::Cut, "strip").size(), 10U);
  EXPECT_LT(p.first(EventKind::Separated, "strip"), 12.0) << "both leaves, from edge to edge";
  EXPECT_GT(p.gape("strip"), 0.010) << "m between the stumps";
}

/// A live hand: it begins between two steps, and in a share of the steps it is found where it was.
void dividesWhateverTheHandsSteps(const std::string& scene, const std::string& object, double seconds,
                                  double share, double late) {
  SCOPED_TRACE(std::to_string(1e3 * late) + " ms late, " + std::to_string(share) +
               " of the steps without motion");
  Play p(scene, false);
  Script script(p.box, p.trajectory, handsOf(p.trajectory));
  scene::StepReport report;
  double hand = 0;
  int parts = 1;
  for (std::uint32_t k = 0, seed = 1; k < 1000 * seconds; ++k) {
    seed = 1664525u * seed + 1013904223u;
    if (1e-3 * (seed >> 22) >= share) hand = 1e-3 * k + late;
    scene::StepInput input = script.inputAt(hand);
    input.step = k + 1;
    ASSERT_NE(p.stage.trainer->step(input, report), scene::Status::Fault);
    for (const scene::Event& e : report.events) parts += e.kind == EventKind::Separated;
  }
  EXPECT_EQ(parts, 2);
  EXPECT_GT(p.gape(object), 0.010) << "m between the stumps";
}

TEST(SceneCutTube, ScissorsThatHesitateDivideItToo) {
  for (const double share : {0.2, 0.8}) dividesWhateverTheHandsSteps("cut_tube", "tube", 9, share, 0.0003);
}

TEST(SceneHook, WhereTheHandIsWithinAStepDecidesNothing) {
  const bool full = std::getenv("VEST_FULL") != nullptr;
  for (const double share : {0.0, 0.2, 0.5})
    for (const double late : {0.0, 0.0003, 0.0006, 0.0009, 0.005})
      if (full || (late == 0.0003 && share == 0.0) || (late == 0.005 && share == 0.2))
        dividesWhateverTheHandsSteps("hook_strip", "strip", 13, share, late);
}

TEST(SceneClip, TwoClipsCloseTheVesselAndStay) {
  Play p("clip_tube");
  const double open = p.ringRadius("vessel", 16);
  p.run();
  EXPECT_EQ(p.times(EventKind::Clipped, "vessel").size(), 2U);
  std::vector<scene::Attachment> attachments;
  p.world().attachments(attachments);
  ASSERT_EQ(attachments.size(), 2U);
  for (const auto& a : attachments) EXPECT_GT(a.closure, 0.95);
  EXPECT_NE(attachments[0].station, attachments[1].station);
  EXPECT_LT(p.ringRadius("vessel", 16), 0.9 * open) << "pinched";
  const auto [between, beside] = p.reach("vessel");
  EXPECT_LT(between, 0.3f) << "nothing comes between two clips";
  EXPECT_EQ(beside, 1.0f);
}

TEST(SceneMonopolar, UnderADwellingHookTheLiverWhitensThenBoilsThenChars) {
  Play p("coagulate_slab");
  constexpr double kNever = std::numeric_limits<double>::infinity();
  constexpr double kLifted = 13.1, kLine = 15.8;  // s: of the script
  double white = kNever, boiling = kNever, black = kNever;
  float char_of_spot = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (!at(std::fmod(t + 0.05, 0.1), 0.05)) return;
    const float kelvin = p.most("slab", Field::Temperature), burnt = p.most("slab", Field::Char);
    if (p.most("slab", Field::Damage) > 0.5f) white = std::min(white, t);
    if (kelvin >= 373.0f) boiling = std::min(boiling, t);
    if (burnt > 0.5f) black = std::min(black, t);
    if (t < kLine) char_of_spot = burnt;
  });
  EXPECT_LT(white, boiling);
  EXPECT_LT(boiling + 1.0, black) << "its water boils off first";
  EXPECT_LT(black, kLifted);
  EXPECT_EQ(p.most("slab", Field::Char), char_of_spot) << "a hook that moves on does not char";
  EXPECT_GT(p.most("slab", Field::Damage), 0.95f);
  const auto told = p.times(EventKind::Coagulated, "slab");
  EXPECT_GE(std::count_if(told.begin(), told.end(), [&](double t) { return t > kLine; }), 3) << "a line, too";
  EXPECT_LT(p.most("slab", Field::Temperature), 350.0f) << "cooled at the end";
}

TEST(SceneBipolar, ForcepsSealTheTubeBetweenThem) {
  Play p("bipolar_tube");
  const double before = p.ringRadius("tube", 12);
  p.run();
  EXPECT_LT(p.first(EventKind::Grasped, "tube"), p.first(EventKind::Coagulated, "tube"));
  EXPECT_GT(p.most("tube", Field::Damage), 0.95f);
  EXPECT_LT(p.most("tube", Field::Char), 0.05f) << "water keeps bipolar tissue from charring";
  EXPECT_LT(p.ringRadius("tube", 12), 0.98 * before) << "shrunk";
}

TEST(SceneThread, ItsEndIsDrawnUpHandedOverAndLaidDown) {
  Play p("thread_pad");
  std::vector<scene::ThreadView> threads;
  const auto highest = [&] {
    p.world().threads(threads);
    double most = 0;
    for (const auto& thread : threads)
      for (const auto& x : thread.positions) most = std::max(most, x.z());
    return most;
  };
  double with_both = 0, with_left = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 6.1)) with_both = highest();
    if (at(t, 8.8)) with_left = highest();
  });
  EXPECT_EQ(p.times(EventKind::Grasped, "thread").size(), 2U) << "by each hand once";
  EXPECT_TRUE(p.times(EventKind::Grasped, "pad").empty());
  EXPECT_GT(with_both, 0.090) << "m";
  EXPECT_GT(with_left, 0.090) << "m";
  EXPECT_LT(highest(), 0.075) << "m: it lies on the pad, whose upper side is at 0.068";
  EXPECT_EQ(threads.size(), 1U) << "in one piece";
}

TEST(SceneThrow, TwoInstrumentsTieASurgeonsThrowThatStaysWhenOneLetsGo) {
  Play p("thread_throw", false);
  std::vector<scene::ThreadView> threads;
  const auto& nodes = p.world().description().sutures[0].rod.nodes;
  suture::KnotScratch scratch(nodes.size());
  const auto kind = [&] {
    return suture::kindOf(threads[0].positions.data(), threads[0].positions.size(), scratch);
  };
  std::vector<std::uint8_t> snapshot;
  std::uint64_t hash = 0;
  Passages passages(*p.stage.trainer);
  double drawn = 0, tail = 0;
  int wrong = 0;
  p.run([&](double t, const scene::StepInput& input, const scene::StepReport&) {
    if (at(t, kThrowReplayed)) p.stage.trainer->save(snapshot);
    if (at(t, kThrowReplayed + 1.0)) hash = p.world().stateHash();
    p.world().threads(threads);
    ASSERT_EQ(threads.size(), 1U) << t << " s: in one piece";
    passages.look(input);
    if (!at(std::fmod(t + 0.005, 0.01), 0.005)) return;
    if (t < 27.0) wrong += kind().determinant != 1;
    if (t > 36.0) wrong += kind().determinant != 5 || kind().signature != -4;
    if (at(t, 36.4)) drawn = threads[0].tension[60], tail = threads[0].tension[210];
  });
  std::printf("drawn with %.2f N and %.2f N; %d steps were played once more, in parts of up to %.2f mm\n",
              drawn, tail, passages.closer, 1e3 * passages.farthest);
  EXPECT_EQ(wrong, 0) << "none while both lead their ends about, then one of two turns to the end";
  EXPECT_EQ(passages.passed, 0) << "steps in which segments went through each other";
  EXPECT_GT(drawn, 1.0) << "N, between left jaws and throw";
  EXPECT_GT(tail, 1.0) << "N, between throw and right jaws";
  EXPECT_EQ(p.times(EventKind::Grasped, "thread").size(), 2U) << "by each hand once";
  const auto released = p.times(EventKind::Released, "thread");
  ASSERT_EQ(released.size(), 1U);
  EXPECT_GT(released[0], 38.0) << "s: the right one lets go of what it has drawn";
  EXPECT_TRUE(p.times(EventKind::Torn, "thread").empty());
  const auto tied = p.times(EventKind::KnotTied, "thread");
  ASSERT_EQ(tied.size(), 1U) << "drawn once";
  EXPECT_GT(tied[0], 27.0);
  EXPECT_LT(tied[0], released[0]);
  const scene::Knot knot = scene::findKnot(p.world(), scratch);
  EXPECT_EQ(knot.kind.determinant, 5);
  EXPECT_GT(knot.tail, 0.003) << "m: beyond the throw";
  EXPECT_LT(knot.tail, 0.06);
  // The throw leaves the jaws in the same bits with two threads.
  p.world().setThreads(2);
  p.stage.trainer->restore(snapshot);
  Script script(p.box, p.trajectory, handsOf(p.trajectory));
  scene::StepReport report;
  for (int k = 1; k <= 1000; ++k) {
    scene::StepInput input = script.inputAt(static_cast<double>(p.world().steps()) * 0.001);
    input.step = p.world().steps() + 1;
    input.dt = 0.001;
    p.stage.trainer->step(input, report);
  }
  EXPECT_EQ(p.world().stateHash(), hash);
}

TEST(SceneSuture, ANeedleTakesABiteAndDrawsItsThreadThrough) {
  Play p("suture_pad", false);
  std::vector<double> force;  // N, of the needle holder
  std::vector<scene::NeedleView> needles;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport& r) {
    force.push_back(r.contacts[kRightHand].wrench.head<3>().norm());
    if (at(t, 25.5)) p.world().needles(needles);
  });
  const auto in = p.times(EventKind::Punctured, "pad"), out = p.times(EventKind::Exited, "pad"),
             grasped = p.times(EventKind::Grasped, "thread");
  ASSERT_EQ(in.size(), 1U);
  ASSERT_EQ(out.size(), 1U);
  ASSERT_EQ(grasped.size(), 2U) << "near its end on the tray, at its point behind the bite";
  EXPECT_LT(grasped[0], in[0]);
  EXPECT_LT(in[0], out[0]);
  EXPECT_LT(out[0], grasped[1]);
  for (const double t : {in[0], out[0]}) {
    const auto peak = force.begin() + std::lround(1e3 * t);
    const double before = *std::max_element(peak - 50, peak), after = *std::min_element(peak, peak + 50);
    std::printf("%.3f N, then %.3f N\n", before, after);
    EXPECT_LT(after, 0.9 * before) << "a peak at " << t << " s";
  }
  EXPECT_TRUE(p.times(EventKind::Grasped, "pad").empty());
  EXPECT_TRUE(p.times(EventKind::TornOut, "pad").empty());
  ASSERT_EQ(needles.size(), 1U);
  EXPECT_EQ(needles[0].instrument, static_cast<int>(kRightHand));
  for (const auto& x : needles[0].positions) EXPECT_GT(x.z(), 0.065) << "m: the pad's upper side is at 0.060";
  const auto& channels = p.world().state().threads.channels;
  ASSERT_EQ(channels.size(), 1U);
  EXPECT_TRUE(channels[0].through);
  for (int k = 0; k < channels[0].count; ++k)
    EXPECT_GT(channels[0].anchors[static_cast<std::size_t>(k)].station, 0.036)
        << "m: thread is in place " << k;
}

TEST(SceneSling, TheLoopIsDrawnShutAndHoldsTheStump) {
  Play p("sling_stump");
  const double before = p.ringRadius("stump", 11);
  p.run();
  EXPECT_LT(p.first(EventKind::Ligated, "stump"), 7.0);
  std::vector<scene::SlingView> slings;
  p.world().slings(slings);
  ASSERT_GE(slings.size(), 1U);
  EXPECT_TRUE(slings[0].around);
  EXPECT_TRUE(slings[0].tied);
  double waist = before;
  for (std::size_t ring = 6; ring < 16; ++ring) waist = std::min(waist, p.ringRadius("stump", ring));
  EXPECT_LT(waist, 0.8 * before);
  const auto [least, most] = p.reach("stump");
  EXPECT_LT(least, 0.05) << "what lies behind the loop gets no blood";
  EXPECT_GT(most, 0.99) << "the held end keeps its own";
}

TEST(SceneConnected, TheFoldFollowsTheTubeUntilItsTiesTear) {
  Play p("connected_organs");
  const auto start = p.knots("fold");
  double followed = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 4.4)) followed = p.moved("fold", start);
  });
  EXPECT_GT(followed, 0.0025) << "m: the faces that hold the ties turn under the pull, and give way";
  const auto torn = p.times(EventKind::Torn, "fold");
  ASSERT_GE(torn.size(), 4U);
  EXPECT_GT(torn.front(), 4.5) << "a small pull tears nothing";
  EXPECT_GT(torn.back() - torn.front(), 0.1) << "one by one";
  EXPECT_LT(p.moved("fold", start), 0.5 * followed) << "it falls back";
}

TEST(ScenePeristalsis, AWaveOfContractionTravelsAlongTheBowel) {
  Play p("peristalsis");
  // Each ring's radius over the last two periods, and when it is narrowest.
  constexpr double kPeriod = 7.5;  // s: 8 a minute
  std::vector<double> least(36, 1.0), most(36, 0.0), when(36, 0.0);
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (t < 15.0 || t > 15.0 + kPeriod || !at(std::fmod(t + 0.02, 0.05), 0.02)) return;
    for (std::size_t r = 4; r < 32; ++r) {
      const double radius = p.ringRadius("bowel", r);
      if (radius < least[r]) least[r] = radius, when[r] = t;
      most[r] = std::max(most[r], radius);
    }
  });
  int squeezed = 0, later = 0;
  for (std::size_t r = 4; r < 32; ++r) squeezed += least[r] < 0.9 * most[r];
  EXPECT_GE(squeezed, 14) << "rings that narrow by a tenth";
  for (std::size_t r = 5; r < 32; ++r)
    later += std::fmod(when[r] - when[r - 1] + kPeriod, kPeriod) < kPeriod / 2;
  EXPECT_GE(later, 20) << "of 27 neighbours: the one behind is narrowest later";
}

TEST(SceneElements, ASlabOfElementsIsDentedTheNetOnItIsLiftedAndTheHookOpensAFurrow) {
  Play p("fem_slab");
  const auto slab = p.knots("slab"), tube = p.knots("tube");
  double dent = 0, lifted = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 3.0)) dent = p.moved("slab", slab);
    if (at(t, 8.3)) lifted = p.moved("tube", tube);
  });
  EXPECT_GT(dent, 0.0005) << "m";
  EXPECT_LT(p.first(EventKind::Grasped, "tube"), 7.0);
  EXPECT_GT(lifted, 0.004) << "m";
  EXPECT_GT(p.first(EventKind::Cut, "slab"), 14.6) << "only under current";
  EXPECT_GT(p.times(EventKind::Cut, "slab").size(), 10U);
  EXPECT_GT(p.cutArea("slab"), 30e-6) << "m²: 30 mm long, deeper than a millimetre";
}

TEST(SceneElementsSling, TheLoopIsDrawnShutAroundAStumpOfElementsAndHolds) {
  Play p("fem_ligation");
  const auto start = p.knots("stump");
  double tied = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 8.0)) tied = p.moved("stump", start);
  });
  EXPECT_LT(p.first(EventKind::Ligated, "stump"), 7.0);
  EXPECT_TRUE(p.times(EventKind::Fault, "stump").empty());
  std::vector<scene::SlingView> slings;
  p.world().slings(slings);
  ASSERT_GE(slings.size(), 1U);
  EXPECT_TRUE(slings[0].tied);
  EXPECT_GT(tied, 0.0008) << "m: drawn in, of a radius of 3.5 mm";
  EXPECT_NEAR(p.moved("stump", start), tied, 0.2 * tied) << "it holds without the applicator";
  const auto [beyond, held] = p.reach("stump");
  EXPECT_LT(beyond, 0.3f) << "what is tied off gets no blood";
  // The vessel that it is has a station there, and no flow.
  for (const scene::Event& e : p.report.events)
    if (e.kind == EventKind::Ligated) {
      const double along =
          (e.position - Eigen::Vector3d(-0.0156, 0.0244, 0.055)).dot(Eigen::Vector3d(0.436, 0.900, 0));
      EXPECT_NEAR(e.station, along, 0.002) << "m from its held end; rings are 2 mm apart";
    }
  const auto& blood = *p.stage.blood;
  const int vessel = blood.model().find("femoral_artery_left");
  ASSERT_GE(vessel, 0);
  ASSERT_EQ(blood.wounds().clamp_count, 1);
  EXPECT_EQ(blood.wounds().clamps[0].vessel, vessel);
  EXPECT_EQ(bleeding::closure(vessel, blood.wounds()), 1.0);
  EXPECT_EQ(held, 1.0f);
}

TEST(SceneVolume, ANoduleBelowTheSurfaceIsFeltAndScissorsOpenTheLobe) {
  Play p("volume_phantom");
  double soft = 0, stiff = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport& r) {
    const double force = r.contacts[kRightHand].wrench.head<3>().norm();
    if (at(t, 3.1)) soft = force;
    if (at(t, 6.9)) stiff = force;
  });
  EXPECT_GT(soft, 0.01) << "N";
  EXPECT_GT(stiff, 1.5 * soft);
  EXPECT_GT(p.first(EventKind::Cut, "phantom"), 13.2);
  EXPECT_GT(p.cutArea("phantom"), 30e-6) << "m²";
  // Scissors that close on a lobe open it: no crumb of it comes loose, and its skin tears where elements
  // part.
  EXPECT_TRUE(p.times(EventKind::Separated, "phantom").empty());
  const std::size_t object = p.object("phantom");
  const auto& topology = p.world().topology(object);
  std::vector<float> x(3 * p.world().knotCount(object));
  p.world().positions(object, x.data());
  // The faces that the cut opened ooze, each.
  const auto& faces = p.world().contactTriangles(object);
  const auto& alive = p.world().contactTriangleAlive(object);
  const auto& surface = *p.stage.surface;
  std::size_t opened = 0, oozing = 0;
  for (std::size_t t = p.world().description().objects[object].contact_triangles.size(); t < faces.size();
       ++t) {
    if (!alive[t]) continue;
    float flow = 0;
    for (const std::uint32_t k : faces[t])
      flow = std::max(flow, surface.state().flow[surface.model().first[object] + k]);
    ++opened, oozing += flow > 0;
  }
  std::printf("%zu of %zu new faces ooze\n", oozing, opened);
  EXPECT_GE(opened, 8U);
  EXPECT_EQ(oozing, opened);
  const scene::Skin& skin = topology.skin;
  const auto place = [&](std::uint32_t v) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (std::uint32_t k = skin.binding_start[v]; k < skin.binding_start[v + 1]; ++k)
      sum += skin.binding_weights[k] * Eigen::Map<const Eigen::Vector3f>(&x[3 * skin.binding_knots[k]]);
    return sum;
  };
  float longest = 0;
  for (std::size_t t = 0; t < skin.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3 && topology.triangle_alive[t] && skin.layer[t] != 2; ++k)
      longest =
          std::max(longest, (place(skin.triangles[t][k]) - place(skin.triangles[t][(k + 1) % 3])).norm());
  EXPECT_LT(longest, 0.006f) << "m: a cell; its edges are 2 mm, and hung 39 mm down into the wound";
}

TEST(SceneSpine, TheNeedleGoesThroughSkinFatAndMuscleIntoTheDiscAndASecondTimeMoreEasily) {
  Play p("spine_puncture", false);
  double muscle = 0, disc = 0, again = 0, jump = 0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  p.run([&](double t, const scene::StepInput&, const scene::StepReport& r) {
    const Eigen::Vector3d f = r.contacts[kRightHand].wrench.head<3>();
    jump = std::max(jump, (f - last).norm());
    last = f;
    if (at(t, 7.0)) muscle = f.norm();
    if (at(t, 11.2)) disc = f.norm();
    if (at(t, 20.5)) again = f.norm();
  });
  const double skin = p.first(EventKind::Punctured, "skin"), fat = p.first(EventKind::Punctured, "fat");
  const double flesh = p.first(EventKind::Punctured, "muscle"), in = p.first(EventKind::Punctured, "disc");
  EXPECT_LT(skin, fat);
  EXPECT_LT(fat, flesh);
  EXPECT_LT(flesh, in);
  EXPECT_LT(in, 11.5);
  EXPECT_EQ(p.times(EventKind::Punctured, "canal").size(), 0U);
  EXPECT_EQ(p.times(EventKind::Punctured, "vertebra").size(), 0U);
  EXPECT_GE(p.times(EventKind::Exited, "skin").size(), 1U);
  EXPECT_GT(muscle, 0.5) << "N";
  EXPECT_GT(disc, muscle + 0.5) << "N";
  EXPECT_LT(disc, 3.3) << "N: what a small device shows";
  EXPECT_LT(again, muscle) << "the channel is there: the shaft alone rubs";
  EXPECT_LT(jump, 0.05 * 3.3) << "N in a step";
}

TEST(SceneCt, TheNeedleGoesThroughFatIntoTheLiver) {
  Play p("ct_puncture", false);
  double liver = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport& r) {
    if (at(t, 7.5)) liver = r.contacts[kRightHand].wrench.head<3>().norm();
  });
  EXPECT_LT(p.first(EventKind::Punctured, "fat"), p.first(EventKind::Punctured, "soft"));
  EXPECT_LT(p.first(EventKind::Punctured, "soft"), 8.0);
  EXPECT_EQ(p.times(EventKind::Punctured, "bone").size(), 0U);
  EXPECT_GT(liver, 0.5) << "N";
}

/// Length (m) of the line through an object's rings, and its greatest mean radius.
std::pair<double, double> sizeOf(Play& p, const std::string& name) {
  const std::size_t i = p.object(name);
  const auto& rings = p.world().description().objects[i].tube.rings;
  double length = 0, radius = 0;
  Eigen::Vector3d last = Eigen::Vector3d::Zero();
  for (std::size_t r = 0; r < rings.size(); ++r) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto k : rings[r]) middle += p.world().knotAt(i, k) / static_cast<double>(rings[r].size());
    if (r > 0) length += (middle - last).norm();
    last = middle;
    radius = std::max(radius, p.ringRadius(name, r));
  }
  return {length, radius};
}

// Seven seconds of it, and with VEST_FULL=1 the whole operation.
TEST(SceneGallbladder, HasTheSizesInPrintAndIsTakenClippedAndFreedFromItsBed) {
  const bool whole = std::getenv("VEST_FULL") != nullptr;
  Play p("gallbladder", whole);
  const auto [length, radius] = sizeOf(p, "gallbladder");
  EXPECT_NEAR(length, 0.090, 0.004) << "m: its ends lie beyond its rings";
  EXPECT_NEAR(2 * radius, 0.035, 0.001) << "m";
  const auto& mass = p.world().description().objects[p.object("gallbladder")].mass;
  EXPECT_NEAR(std::accumulate(mass.begin(), mass.end(), 0.0) / 1060.0, 40e-6, 3e-6) << "m³";
  EXPECT_NEAR(sizeOf(p, "cystic_duct").first, 0.027, 0.0025) << "m: between its rounded ends";
  EXPECT_NEAR(sizeOf(p, "cystic_duct").second, 0.0014, 0.0001);
  EXPECT_NEAR(sizeOf(p, "cystic_artery_1").first, 0.027, 0.002);
  EXPECT_NEAR(sizeOf(p, "cystic_artery_1").second, 0.0006, 0.0001);
  double still = 1;
  const auto watch = [&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 1.0)) still = p.fastest();
  };
  p.run(watch, whole ? 0 : 7.0);
  EXPECT_LT(still, whole ? 0.02 : 0.001)
      << "m/s: it hangs still before anybody touches it, but for its pulse";
  EXPECT_LT(p.first(EventKind::Grasped, "gallbladder"), 3.0);
  EXPECT_LT(p.first(EventKind::Clipped, "cystic_duct"), 7.0);
  if (!whole) return;
  for (const char* name : {"cystic_duct", "cystic_artery_1"}) {
    EXPECT_EQ(p.times(EventKind::Clipped, name).size(), 3U) << name;
    EXPECT_GT(p.first(EventKind::Cut, name), p.times(EventKind::Clipped, name).back()) << name;
    EXPECT_LT(p.first(EventKind::Separated, name), 35.0) << name;
  }
  EXPECT_LT(p.first(EventKind::Separated, "areolar_fold"), 65.0);
  scene::LooseScratch scratch(p.world());
  EXPECT_EQ(scene::looseShare(p.world(), p.object("gallbladder"), scratch).all, 1.0)
      << "nothing but jaws holds it";
  EXPECT_LT(p.stage.blood->circulation().lost, 2e-6) << "m³: the clips hold";
  for (const char* name : {"common_duct", "hepatic_artery", "gallbladder"})
    EXPECT_EQ(p.times(EventKind::Cut, name).size(), 0U) << name;
}

}  // namespace
}  // namespace vest::simulation
