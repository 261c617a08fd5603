// Protects that bleeding stops as fast as in print, and no faster: by itself where it is small, by pressure
// where it is not. (A clot held a pressed artery after one minute, and a cut surface seeped on for longer
// than any bleeding time.) Sources: docs/validation.md, section on haemostasis.

#include "haemostasis.h"

#include <gtest/gtest.h>

#include "vest_effects/haemodynamics/circulation.h"

namespace vest::bleeding::haemostasis {
namespace {

TEST(Haemostasis, PressedArteriesAndNeedlesHolesStopWithinPrint) {
  const haemodynamics::Circulation pelvis =
      haemodynamics::buildCirculation(haemodynamics::readVessels(VEST_VESSEL_DATA "/pelvis"), 0.01);
  const int artery = pelvis.model.find("external_iliac_artery_left");
  ASSERT_GE(artery, 0);
  const double pressed = holeMinutes(pelvis.model, artery, 3e-6, 0);
  EXPECT_GE(pressed, 3 - 1e-3) << "gauze stops two of three bleeding aortas in 3 min";
  EXPECT_LE(pressed, 34) << "femoral arteries after a catheter take 14 … 34 min";
  EXPECT_TRUE(std::isinf(holeMinutes(pelvis.model, artery, 3e-6, 1e-6))) << "nothing closes it unpressed";
  const double needle = holeMinutes(pelvis.model, artery, 2e-7, 1e-7);
  EXPECT_GE(needle, 2);
  EXPECT_LE(needle, 9) << "bleeding time (Ivy)";
  EXPECT_LT(holeMinutes(pelvis.model, artery, 2e-7, 0), needle) << "pressure helps";
}

TEST(Haemostasis, CutSurfacesStopWithinTheBleedingTimeAndSoonerUnderGauze) {
  EXPECT_GE(surfaceMinutes(false), 2);
  EXPECT_LE(surfaceMinutes(false), 9) << "bleeding time (Ivy)";
  EXPECT_LE(surfaceMinutes(true), 3);
  EXPECT_GE(surfaceMinutes(true), 1) << "gauze is no glue";
}

TEST(Haemostasis, TissueWithoutBloodRecoversAsPrinted) {
  const Release r = release();
  EXPECT_NEAR(r.fall, 0.112, 0.003);
  EXPECT_NEAR(r.rise, 2.13, 0.6);
  EXPECT_NEAR(r.above, 0.15, 0.05);
  EXPECT_NEAR(r.back, 2.4, 1.2);
}

}  // namespace
}  // namespace vest::bleeding::haemostasis
