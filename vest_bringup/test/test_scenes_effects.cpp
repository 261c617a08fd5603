#include <cstdio>

#include "play.h"
#include "vest_effects/bleeding/swab.h"

// Protects the small scenes of blood, water and smoke: each script really shows what it is named after, with
// all effects around the tissue as in a session.

namespace vest::simulation {
namespace {

using scene::EventKind;

TEST(SceneArterialBleeding, ACutArterySpurtsWithThePulseUntilClipsStopIt) {
  Play p("arterial_bleeding", true);
  double least = 1, most = 0, after_heart = 0, lost_at_end = 0, least_after = 1, most_after = 0;
  double stillest = 1, liveliest = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    const double flow = leak(p.stage);
    if (t > 5.0 && t < 8.0) least = std::min(least, flow), most = std::max(most, flow);
    if (at(t, 12.0)) after_heart = flow;
    if (t > 11.0 && t < 13.0)
      least_after = std::min(least_after, flow), most_after = std::max(most_after, flow);
    if (at(t, 15.0)) lost_at_end = lost(p.stage);
    if (t < 18.5 || t > 20.0) return;
    const double speed = p.fastest();
    stillest = std::min(stillest, speed), liveliest = std::max(liveliest, speed);
  });
  std::printf("stump: %.1f to %.1f mm/s in the last beats\n", 1e3 * stillest, 1e3 * liveliest);
  EXPECT_LT(stillest, 0.005) << "m/s: at rest between two beats";
  // The upstroke widens the clipped stump by 6 % within 25 ms, which its free rim feels as a jerk.
  EXPECT_LT(liveliest, 0.1) << "m/s";
  std::printf("%.2f to %.2f ml/s; after the clip on the heart's side %.2f to %.2f ml/s\n", 1e6 * least,
              1e6 * most, 1e6 * least_after, 1e6 * most_after);
  EXPECT_GT(most, 1e-6) << "m3/s";
  EXPECT_GT(most, 1.5 * least) << "in step with the pulse";
  EXPECT_LT(after_heart, 0.2 * most) << "the clip on the heart's side leaves what flows back";
  EXPECT_EQ(p.times(EventKind::Clipped, "artery").size(), 2U);
  EXPECT_LT(leak(p.stage), 1e-3 * most) << "the second clip stops that too";
  EXPECT_LT(lost(p.stage) - lost_at_end, 1e-8) << "m3: the count stands still";
  EXPECT_GT(p.stage.field->fluid().emitted, 0.9 * lost(p.stage)) << "what is lost is seen";
  EXPECT_GT(p.stage.field->fluid().soaked, 0.5 * bleeding::kSwabCapacity) << "m3: the swab lay in it";
}

TEST(SceneVenousOoze, ANickedVeinOozesUntilBipolarForcepsSealIt) {
  Play p("venous_ooze", true);
  double least = 1, most = 0, lost_when_sealed = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (t > 5.0 && t < 8.0) least = std::min(least, leak(p.stage)), most = std::max(most, leak(p.stage));
    if (at(t, 14.5)) lost_when_sealed = lost(p.stage);
  });
  EXPECT_GT(least, 2e-7) << "m3/s";
  EXPECT_LT(most, 1.1 * least) << "a vein has no pulse";
  EXPECT_GE(p.times(EventKind::Coagulated, "vein").size(), 1U);
  EXPECT_EQ(leak(p.stage), 0.0);
  EXPECT_EQ(lost(p.stage), lost_when_sealed);
}

TEST(SceneSurfaceBleeding, ACutSeepsStypticStopsItAndIrrigationWashesIt) {
  Play p("surface_bleeding", true);
  const auto seeping = [&] {
    double flow = 0;
    for (const float f : p.stage.surface->state().flow) flow += static_cast<double>(f);
    return flow;
  };
  const auto film = [&] { return bleeding::filmVolume(p.stage.surface->state()); };
  double before = 0, after = 0, film_before = 0, film_after = 0, pool = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 9.0)) before = seeping();
    if (at(t, 19.5)) after = seeping();
    if (at(t, 20.8)) film_before = film();
    if (at(t, 23.1))
      film_after = film(), pool = fluid::poolVolume(p.stage.field->fluidModel(), p.stage.field->fluid());
  });
  EXPECT_GT(before, 1e-9) << "m3/s";
  EXPECT_LT(after, 0.05 * before) << "what the needle injected closes the capillaries";
  EXPECT_LT(film_after, 0.5 * film_before) << "washed";
  EXPECT_GT(p.stage.field->fluid().sucked, 0.3 * pool) << "cleared";
}

TEST(SceneIrrigationPool, TheJetBendsTheTubeThePoolFillsAndSuctionClearsIt) {
  Play p("irrigation_pool", true);
  const auto start = p.knots("tube");
  double bent = 0, pool = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (t < 3.3 && at(std::fmod(t + 0.05, 0.1), 0.05)) bent = std::max(bent, p.moved("tube", start));
    if (at(t, 5.0)) pool = fluid::poolVolume(p.stage.field->fluidModel(), p.stage.field->fluid());
  });
  const fluid::State& f = p.stage.field->fluid();
  EXPECT_GT(bent, 0.005) << "m";
  EXPECT_GT(pool, 0.9 * f.emitted);
  EXPECT_GT(f.sucked, 0.85 * pool) << "a mouth near the floor leaves films and what stands in corners";
  const double there = fluid::particleVolume(p.stage.field->fluidModel(), f) +
                       fluid::poolVolume(p.stage.field->fluidModel(), f);
  EXPECT_NEAR(there + f.sucked + f.lost, f.emitted, 0.01 * f.emitted) << "nothing vanishes";
}

TEST(SceneSmokeLens, SmokeRisesTheColdLensSteamsUpAndClearsAndSuctionDrawsTheSmoke) {
  Play p("smoke_lens", true);
  double fogged = 0, cleared = 0, drawn = 0;
  p.run([&](double t, const scene::StepInput&, const scene::StepReport&) {
    if (at(t, 11.4)) fogged = p.stage.field->lens().condensate;
    if (at(t, 17.0)) cleared = p.stage.field->lens().condensate;
    if (at(t, 18.0)) drawn = p.stage.field->smoke().drawn;
  });
  EXPECT_GT(p.stage.field->smoke().made, 2e-6) << "kg";
  EXPECT_GT(fogged, 0.0015) << "kg/m2: a sixth of the sight is gone";
  EXPECT_LT(cleared, 0.05 * fogged);
  EXPECT_EQ(drawn, 0.0);
  EXPECT_GT(p.stage.field->smoke().drawn, 1e-7) << "kg";
}

}  // namespace
}  // namespace vest::simulation
