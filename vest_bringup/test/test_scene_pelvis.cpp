#include <algorithm>

#include "play.h"

// Protects the pelvis scene as a session plays it: its script lifts a tube, draws the uterus by a round
// ligament, and cuts the tube with the vessels below it, which bleed as one tree.

namespace vest::simulation {
namespace {

using scene::EventKind;

TEST(ScenePelvis, ATubeIsLiftedTheUterusFollowsAndWhatIsCutBleedsFromBothSides) {
  Play p("pelvis");
  const auto tube = p.knots("tube_right"), uterus = p.knots("uterus"), ovary = p.knots("ovary_right");
  double lifted = 0, ovary_lifted = 0, hand = 0, drawn = 0, dry = 1, swayed = 1;
  p.run(
      [&](double t, const scene::StepInput&, const scene::StepReport& r) {
        if (at(t, 1.9)) swayed = std::max(p.moved("tube_right", tube), p.moved("uterus", uterus));
        if (at(t, 7.6)) {
          lifted = p.moved("tube_right", tube), ovary_lifted = p.moved("ovary_right", ovary);
          hand = r.contacts[kRightHand].wrench.head<3>().norm();
        }
        if (at(t, 16.7)) drawn = p.moved("uterus", uterus);
        if (at(t, 21.3)) dry = p.stage.blood->circulation().lost;
      },
      27.9);
  const auto& wounds = p.stage.blood->wounds();
  double from_heart = 0, from_ovary = 0;
  for (int i = 0; i < wounds.opening_count; ++i)
    (wounds.openings[i].end == bleeding::End::kHeart ? from_heart : from_ovary) += wounds.openings[i].flow;
  std::printf(
      "moved %.2f mm before; tube %.1f mm up by %.2f N, ovary %.1f; uterus %.1f mm; %.2f and %.2f ml/s, %.1f "
      "ml lost\n",
      1e3 * swayed, 1e3 * lifted, hand, 1e3 * ovary_lifted, 1e3 * drawn, 1e6 * from_heart, 1e6 * from_ovary,
      1e6 * p.stage.blood->circulation().lost);
  EXPECT_LT(swayed, 0.001) << "m: by the pulse alone";
  EXPECT_GT(lifted, 0.015) << "m";
  EXPECT_GT(hand, 0.05) << "N";
  EXPECT_LT(hand, 1.0) << "N";
  EXPECT_GT(ovary_lifted, 0.004) << "m: what hangs on it comes along";
  EXPECT_GT(drawn, 0.004) << "m";
  EXPECT_EQ(dry, 0.0) << "m³: nothing bleeds before it is cut";
  EXPECT_LT(p.first(EventKind::Separated, "tube_right"), 23.0);
  EXPECT_LT(p.first(EventKind::Separated, "tubal_arcade_right"), 23.0);
  EXPECT_GT(from_heart, 0.1e-6) << "m³/s, of the uterine artery";
  EXPECT_GT(from_ovary, 0.05e-6) << "m³/s, of the ovarian artery: both feed the arcade";
  EXPECT_GT(p.stage.blood->circulation().lost, 1e-6) << "m³";
  for (const char* name : {"uterus", "ureter_right", "ovary_right", "uterine_artery_right",
                           "external_iliac_artery_right", "tube_left"})
    EXPECT_EQ(p.times(EventKind::Cut, name).size(), 0U) << name;
}

}  // namespace
}  // namespace vest::simulation
