// Protects how a collapsed field looks: the wall above hangs down, most where it was highest, the floor
// stays, nothing passes through what lies below, and the endoscope keeps room round its lens.
#include "vest_viz/mesh/sunken_wall.h"

#include <cmath>

#include <gtest/gtest.h>

namespace vest::mesh {
namespace {

/// An arch over y, 10 cm high, its floor below: places at angles, far from the lens along x.
std::vector<float> arch(float x) {
  std::vector<float> p;
  for (int i = 0; i <= 36; ++i) {
    const double a = i * M_PI / 18;
    p.insert(p.end(),
             {x, static_cast<float>(0.05 * std::cos(a)), static_cast<float>(0.05 + 0.05 * std::sin(a))});
  }
  return p;
}

TEST(SunkenWall, HangsFromItsLowerHalfAndMostWhereItWasHighest) {
  const std::vector<float> before = arch(1.0f);
  std::vector<float> after = before;
  sinkWall(0.02, {0, 0, 0}, {}, &after);
  EXPECT_NEAR(before[3 * 9 + 2] - after[3 * 9 + 2], 0.02, 2e-4) << "its top";
  for (std::size_t i = 0; i < before.size(); i += 3) {
    EXPECT_EQ(after[i], before[i]);
    EXPECT_EQ(after[i + 1], before[i + 1]);
    EXPECT_LE(after[i + 2], before[i + 2]);
    if (before[i + 2] <= 0.05f) {
      EXPECT_EQ(after[i + 2], before[i + 2]) << "the floor";
    }
  }
  std::vector<float> collapsed = before;
  sinkWall(1.0, {0, 0, 0}, {}, &collapsed);
  for (std::size_t i = 0; i < before.size(); i += 3)
    EXPECT_GE(collapsed[i + 2], std::min(before[i + 2], 0.05f) - 1e-6f)
        << "it lies there, and goes no deeper";
}

TEST(SunkenWall, KeepsRoomAboveTheLensAndAFullCavityIsLeftAlone) {
  std::vector<float> near = arch(0.0f), beside = arch(static_cast<float>(contact::kProp)), full = near;
  sinkWall(0.02, {0, 0, 0.06}, {}, &near);
  EXPECT_NEAR(near[3 * 9 + 2], 0.1, 1e-6) << "right over the lens";
  sinkWall(0.02, {0, 0, 0.06}, {}, &beside);
  EXPECT_NEAR(beside[3 * 9 + 2], 0.09, 1e-4) << "half as much at kProp";
  const std::vector<float> before = full;
  for (const double sunk : {0.0, -1.0, std::nan("")}) sinkWall(sunk, {0, 0, 0}, {}, &full);
  sinkWall(0.02, {std::nan(""), 0, 0}, {}, &full);
  EXPECT_EQ(full, before);
}

TEST(SunkenWall, IsStretchedOverShaftsAndHangsBesideThem) {
  const std::vector<float> before = arch(1.0f);
  std::vector<float> hung = before, tent = before, above = before;
  sinkWall(0.04, {0, 0, 0}, {}, &hung);
  const TentPole shaft{{0.5, 0, 0.08}, {1.5, 0, 0.08}, 0.0025};
  sinkWall(0.04, {0, 0, 0}, {shaft}, &tent);
  EXPECT_LT(hung[3 * 9 + 2], 0.08f) << "the shaft would stick out of it";
  EXPECT_GT(tent[3 * 9 + 2], 0.0825f);
  EXPECT_LT(tent[3 * 9 + 2], 0.09f);
  for (std::size_t i = 2; i < before.size(); i += 3) {
    EXPECT_GE(tent[i], hung[i]);
    EXPECT_LE(tent[i], before[i]);
  }
  EXPECT_EQ(tent[3 * 3 + 2], hung[3 * 3 + 2]) << "43 mm beside it";
  sinkWall(0.04, {0, 0, 0}, {{{0.5, 0, 0.2}, {1.5, 0, 0.2}, 0.0025}}, &above);
  EXPECT_EQ(above, hung) << "what lies outside holds nothing";
}

}  // namespace
}  // namespace vest::mesh
