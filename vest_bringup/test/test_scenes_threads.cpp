#include <algorithm>
#include <cstdlib>
#include <random>

#include "../../vest_tissue/specimen/knots.h"
#include "../../vest_tissue/specimen/nets.h"
#include "passages.h"
#include "play.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"
#include "vest_tissue/suture/knot_kind.h"

// Protects the scenes whose thread itself holds, by contact and friction alone.

namespace vest::simulation {
namespace {

using Eigen::Vector3d;
using scene::EventKind;

constexpr double kReplayed = 5.0;  // s: while the hand draws

/// A loop of thread with something round in it.
struct Loop {
  const suture::Model& model;
  Vector3d place, axis;  ///< m; of a unit
  double radius;         ///< m

  Vector3d off(const Vector3d& x) const {
    const Vector3d way = x - place;
    return way - axis.dot(way) * axis;
  }
  /// N, of the segment that is pulled most.
  double greatest(const suture::State& rod) const {
    double tension = 0;
    for (suture::Index i = 0; i < model.strands[0].segments; ++i)
      tension = std::max(tension, suture::tensionOf(model, rod, model.strands[0], i));
    return tension;
  }
  /// Turns of the thread round the stump's axis.
  double turns(const suture::State& rod) const {
    double angle = 0;
    for (std::size_t i = 0; i + 1 < rod.position.size(); ++i) {
      const Vector3d a = off(rod.position[i]), b = off(rod.position[i + 1]);
      if (a.norm() < 0.005 && b.norm() < 0.005) angle += std::atan2(axis.dot(a.cross(b)), a.dot(b));
    }
    return std::abs(angle) / (2 * M_PI);
  }
  /// N: greatest tension of the loop's far side on something that grows by `more` (m), by the rod alone.
  double bears(suture::State& rod, double more) const {
    constexpr double kStep = 0.0005, kGrowth = 0.002, kLength = 0.010;  // s, m/s, m along the axis each way
    suture::Scratch scratch(model);
    double most = 0;
    for (double by = 0; by < more; by += kGrowth * kStep) {
      scratch.supports.clear();
      suture::Index far = 0;
      for (suture::Index i = 0; i + 1 < rod.position.size(); ++i) {
        const Vector3d way = off(rod.position[i]);
        if (way.norm() > radius + by + 0.0015 || std::abs(axis.dot(rod.position[i] - place)) > kLength)
          continue;
        if (far == 0 || way.z() < off(rod.position[far]).z()) far = i;
        suture::Support a;
        a.segment = i;
        a.normal = way.normalized();
        a.from = a.to = rod.position[i] - way;
        a.reach = radius + by + model.strands[0].section.radius;
        a.stiffness = 2000, a.friction = 0.3;
        scratch.supports.push_back(a);
      }
      EXPECT_EQ(suture::step(model, rod, scratch, kStep), suture::StepStatus::Ok);
      most = std::max(most, suture::tensionOf(model, rod, model.strands[0], far));
    }
    return most;
  }
};

TEST(SceneEndoloop, ALoopIsDrawnOnAStumpCutAndHeldByFriction) {
  Play p("endoloop", false);
  const Loop loop{*p.world().model().threads.rods,
                  {0.0005, 0.0508, 0.062},
                  Vector3d(0.0260, 0.0427, 0).normalized(),
                  0.0035};
  const auto& rod = p.world().state().threads.rod;
  suture::KnotScratch scratch(rod.position.size());
  std::vector<Vector3d> before = rod.position;
  std::vector<std::uint8_t> snapshot, tight;
  std::uint64_t hash = 0;
  double slides = 0, drawn = 0, run = 0;
  scene::StepInput last, pulled;
  int passed = 0, wrong = 0;
  p.run([&](double t, const scene::StepInput& input, const scene::StepReport&) {
    last = input;
    if (t > 0.01) passed += std::abs(suture::specimen::crossings(before, rod.position));  // out of its packet
    before = rod.position;
    if (at(t, kReplayed)) p.stage.trainer->save(snapshot);
    if (at(t, kReplayed + 0.4)) hash = p.world().stateHash();
    if (t > 4.5 && t < 6.0)
      slides = std::max(slides, suture::tensionOf(loop.model, rod, loop.model.strands[0], 0));
    if (t > 7.8 && t < 8.7) run = std::max(run, suture::tensionOf(loop.model, rod, loop.model.strands[0], 0));
    if (at(t, 7.1)) drawn = loop.greatest(rod), pulled = input, p.stage.trainer->save(tight);
    if (t < 5.7 && at(std::fmod(t + 0.005, 0.1), 0.005))  // then the short end lies across the loop
      wrong += suture::kindOf(rod.position.data(), rod.position.size(), scratch).determinant != 29;
  });
  suture::State alone = rod;
  const double held = loop.greatest(rod), bore = loop.bears(alone, 0.0008);
  std::printf("the knot slides with %.2f N, is drawn with %.2f N and holds %.2f N; then it bears %.2f N\n",
              slides, drawn, held, bore);
  EXPECT_EQ(passed, 0) << "segments that went through each other";
  EXPECT_EQ(wrong, 0) << "it stays a Roeder knot as it slides";
  EXPECT_LT(slides, 2.0) << "N: while nothing lies in the loop";
  EXPECT_GT(drawn, 5.0) << "N";
  EXPECT_LT(run, 0.5) << "N: the pusher goes back along a thread that an open hand lets run";
  EXPECT_GT(loop.turns(rod), 0.85) << "round the stump";
  EXPECT_GT(held, 0.5) << "N: cut, and nobody holds it";
  EXPECT_GT(bore, 6.1) << "N: more than the hand drew it with";
  const auto cut = p.times(EventKind::Cut, "loop");
  ASSERT_EQ(cut.size(), 1U);
  EXPECT_GT(cut[0], 11.0) << "s: by the scissors";
  EXPECT_TRUE(p.times(EventKind::Torn, "loop").empty());
  EXPECT_TRUE(p.times(EventKind::KnotTied, "loop").empty()) << "its knot is tied beforehand";
  std::vector<scene::SlingView> slings;
  p.world().slings(slings);
  EXPECT_TRUE(slings.empty()) << "no loop by a rule";
  // The pusher takes what was cut off in it out of the cavity.
  const auto& pusher = p.world().state().threads.pushers[kRightHand];
  EXPECT_TRUE(pusher.active);
  const auto left = static_cast<std::uint32_t>(
      std::find(rod.severed.begin(), rod.severed.end(), std::uint8_t{1}) - rod.severed.begin());
  EXPECT_GE(left + 1, pusher.inside) << "nodes on its side of the cut";
  scene::StepReport told;
  last.step = p.world().steps() + 1;
  last.tools[kRightHand].present = false;
  p.stage.trainer->step(last, told);
  EXPECT_FALSE(pusher.active);
  EXPECT_EQ(p.world().state().threads.packed[0], left + 1);
  for (std::uint32_t i = 0; i <= left; ++i) EXPECT_GT(rod.position[i].z(), 0.3) << "m: back in the packet";
  EXPECT_LT(rod.position[left + 1].z(), 0.1) << "m: the loop stays";
  // A pusher that goes back with a closed hand draws the thread through that hand, and not through itself.
  p.stage.trainer->restore(tight);
  double hardest = 0;
  for (int k = 1; k <= 500; ++k) {
    before = rod.position;
    scene::ToolInput& tool = pulled.tools[kRightHand];
    tool.position += 2e-5 * (tool.pivot - tool.position).normalized();  // m: 20 mm/s
    pulled.step = p.world().steps() + 1;
    p.stage.trainer->step(pulled, told);
    passed += std::abs(suture::specimen::crossings(before, rod.position));
    hardest = std::max(hardest, loop.greatest(rod));
  }
  std::printf("drawn back with a closed hand: %.2f N\n", hardest);
  EXPECT_LT(hardest, 8.0) << "N";
  EXPECT_EQ(passed, 0);
  // It is drawn in the same bits with two threads.
  p.world().setThreads(2);
  p.stage.trainer->restore(snapshot);
  Script script(p.box, p.trajectory, handsOf(p.trajectory));
  for (int k = 3900; k <= 1000 * kReplayed; ++k) script.inputAt(0.001 * k);  // the handle has been open
  scene::StepReport report;
  for (int k = 1; k <= 400; ++k) {
    scene::StepInput input = script.inputAt(static_cast<double>(p.world().steps()) * 0.001);
    input.step = p.world().steps() + 1;
    input.dt = 0.001;
    p.stage.trainer->step(input, report);
  }
  EXPECT_EQ(p.world().stateHash(), hash);
}

/// Two threads across each other; the upper one is `above` (m) the other.
scene::Description crossed(double above) {
  scene::Description d;
  d.name = "crossed", d.hash = "0000000000000005";
  d.objects.push_back(specimen::tubeScene({}).objects[0]);
  const Vector3d centre(0.3, 0.0, 0.3);
  for (int k = 0; k < 2; ++k) {
    scene::Suture thread;
    thread.material = "silk", thread.size = "0", thread.kind = 2;
    thread.strength = thread.knot_strength = 1000.0;
    thread.rod.name = k == 0 ? "lower" : "upper";
    for (int i = -10; i <= 10; ++i)
      thread.rod.nodes.push_back(centre +
                                 (k == 0 ? Vector3d(0.001 * i, 0, 0) : Vector3d(0.0004, 0.001 * i, above)));
    thread.rod.section = suture::specimen::silk();
    d.sutures.push_back(thread);
  }
  return d;
}

TEST(Passages, WhatWentThroughIsSeenWhereverTheStepIsPlayedOnceMore) {
  scene::TissueSimulation over{scene::World(crossed(0.0006))}, under{scene::World(crossed(-0.0006))};
  Passages passages(over);
  scene::StepInput input;
  scene::StepReport report;
  for (int k = 0; k < 30; ++k) {
    input.step = over.world().steps() + 1;
    over.step(input, report);
    under.step(input, report);
    passages.look(input);
  }
  EXPECT_EQ(passages.closer, 0) << "they fall beside each other";
  input.step = over.world().steps() + 1;
  over.step(input, report);
  std::vector<std::uint8_t> through;
  under.step(input, report);
  under.save(through);
  over.restore(through);
  passages.look(input);
  EXPECT_EQ(passages.closer, 1);
  EXPECT_EQ(passages.passed, 1);
  EXPECT_LT(passages.farthest, 0.0001) << "m: by no motion of their own";
}

// Twenty seconds of it, and with VEST_FULL=1 both throws: some four minutes of a core.
TEST(SceneSquareKnot, ThreeInstrumentsTieTwoThrowsThatHoldByFriction) {
  Play p("square_knot", false);
  const suture::Model& model = *p.world().model().threads.rods;
  const auto& rod = p.world().state().threads.rod;
  suture::KnotScratch scratch(2 * rod.position.size());
  // Of what is left in the post, once the long end is cut.
  const auto kind = [&](const suture::State& s) {
    const auto cut = std::find(s.severed.begin(), s.severed.end(), std::uint8_t{1});
    const std::ptrdiff_t from = cut == s.severed.end() ? 0 : cut - s.severed.begin() + 1;
    const auto k =
        suture::kindOf(s.position.data() + from, s.position.size() - static_cast<std::size_t>(from), scratch);
    return std::pair(static_cast<int>(k.determinant), static_cast<int>(k.signature));
  };
  const std::pair none(1, 0), first(5, -4), both(15, -2);  // determinant and signature
  Passages passages(*p.stage.trainer);
  double drawn = 0;
  suture::State taut;  // while hands hold both ends
  int wrong = 0;
  const auto watch = [&](double t, const scene::StepInput& input, const scene::StepReport&) {
    passages.look(input);
    if (!at(std::fmod(t + 0.05, 0.1), 0.05)) return;
    if (t < 27.0) wrong += kind(rod) != none;
    if (t > 45.0 && t < 95.0) wrong += kind(rod) != first;
    if (t > 108.0) wrong += kind(rod) != both;
    if (t < 116.0) drawn = suture::tensionOf(model, rod, model.strands[0], 60), taut = rod;
  };
  const bool whole = std::getenv("VEST_FULL") != nullptr;
  p.run(watch, whole ? 0 : 20.0);
  EXPECT_EQ(wrong, 0) << "none, then a throw of two turns, then one of one turn the other way round";
  std::printf("%d steps were played once more, in parts in which nodes moved by up to %.2f mm\n",
              passages.closer, 1e3 * passages.farthest);
  EXPECT_EQ(passages.passed, 0) << "steps in which segments went through each other";
  EXPECT_EQ(p.times(EventKind::Grasped, "thread").size(), whole ? 4U : 2U)
      << "by the left one, then the right one";
  if (!whole) return;
  EXPECT_GT(drawn, 2.0) << "N, between left jaws and knot";
  const auto tied = p.times(EventKind::KnotTied, "thread");
  ASSERT_GE(tied.size(), 2U);
  EXPECT_LT(tied.front(), 50.0) << "s: the first throw is drawn";
  EXPECT_GT(tied.back(), 95.0) << "s: the second one is";
  EXPECT_TRUE(p.times(EventKind::Torn, "thread").empty());
  EXPECT_EQ(p.times(EventKind::Cut, "thread").size(), 1U) << "the long end, by scissors";
  // What lies in the loop grows, and nobody holds the ends.
  const auto bears = [&](double friction, suture::State& alone) {
    suture::Model with = model;
    for (auto& strand : with.strands) strand.section.friction *= friction;
    return Loop{with, {0, 0.055, 0.092}, Vector3d(0.566, 0.600, 0).normalized(), 0.002}.bears(alone, 0.0035);
  };
  suture::State held = taut, slipped = taut;
  const double load = bears(1.0, held);
  bears(0.0, slipped);
  std::printf("drawn with %.2f N, its loop bears %.2f N\n", drawn, load);
  EXPECT_GT(load, 1.0) << "N";
  EXPECT_EQ(kind(held), both);
  EXPECT_EQ(kind(slipped), none) << "without friction it comes undone";
}

// The stitch, and with VEST_FULL=1 its knot, twice: some ten minutes of a core.
TEST(SceneStitchKnot, IsTiedByTheNeedleThoughCountsAreRoundedAndPosesComeLate) {
  const bool whole = std::getenv("VEST_FULL") != nullptr;
  constexpr double kCount = 2e-4, kLate = 0.003;  // rad (a tenth of it in m), s: twice a box's counts
  for (int run = whole ? 1 : 0; run < (whole ? 3 : 1); ++run) {
    Play p("stitch_knot", false);
    p.rest = 0.02;  // the short end hangs since 5 s, and still swings
    std::mt19937 random(static_cast<unsigned>(run));
    const auto rounded = [](double v, double count) { return count * std::round(v / count); };
    for (trajectory::Row& row : p.trajectory.rows) {
      if (!whole) continue;
      row.t += run * kLate * static_cast<double>(random()) / static_cast<double>(std::mt19937::max());
      for (auto& j : row.joints)
        j = {rounded(j.yaw, kCount), rounded(j.pitch, kCount), rounded(j.insertion, 0.1 * kCount),
             rounded(j.roll, kCount), rounded(j.jaw, kCount)};
    }
    const auto& rod = p.world().state().threads.rod;
    suture::KnotScratch scratch(rod.position.size());
    const auto kind = [&] {
      const auto k = suture::kindOf(rod.position.data(), rod.position.size(), scratch);
      return std::pair(static_cast<int>(k.determinant), static_cast<int>(k.signature));
    };
    std::array<double, 2> drawn{};  // N: by the left hand and the right one
    std::pair<int, int> first;
    p.run(
        [&](double t, const scene::StepInput&, const scene::StepReport& told) {
          if (at(t, 75.0)) first = kind();
          if (at(t, 112.9))
            for (std::size_t i = 0; i < 2; ++i) drawn[i] = told.contacts[i].wrench.head<3>().norm();
        },
        whole ? 0 : 12.0);
    EXPECT_EQ(p.times(EventKind::Punctured, "pad").size(), 1U) << run;
    EXPECT_EQ(p.times(EventKind::Exited, "pad").size(), 1U) << run;
    if (!whole) return;
    EXPECT_EQ(first, std::pair(3, 2)) << run << ": a throw";
    EXPECT_EQ(kind(), std::pair(9, 0)) << run << ": a square knot, and no granny; nobody holds its short end";
    std::printf("run %d: drawn with %.2f N and %.2f N\n", run, drawn[0], drawn[1]);
    EXPECT_GT(std::min(drawn[0], drawn[1]), 1.0) << "N, " << run;
    EXPECT_TRUE(p.times(EventKind::Torn, "thread").empty()) << run;
    EXPECT_TRUE(p.times(EventKind::TornOut, "pad").empty()) << run;
  }
}

}  // namespace
}  // namespace vest::simulation
