// Which knot holds how much follows from contact and friction: nothing here knows a knot's name.
#include <gtest/gtest.h>

#include <cstdlib>

#include "knots.h"
#include "pull_test.h"

namespace vest::suture::test {

using namespace specimen;
namespace {

/// Throws in silk 2-0 of this friction at any load, each set with 4.9 N.
PullTest silkOf(const std::vector<int>& throws, double friction) {
  PullTest test;
  test.throws = throws;
  const double ratio = 0.00016 / 0.0001875;  // of the diameters of 2-0 and 0
  test.section = silk();
  test.section.radius *= ratio, test.section.linear_density *= ratio * ratio;
  for (double* stiffness : {&test.section.stretch, &test.section.shear}) *stiffness *= ratio * ratio;
  for (double* stiffness : {&test.section.bend, &test.section.twist}) *stiffness *= std::pow(ratio, 4);
  test.section.friction = friction;
  test.strength = 14.1;  // N, knot-pull
  return test;
}

Pulled pulled(const PullTest& test) {
  const Pulled p = PullRoom(test).run();
  EXPECT_TRUE(p.well);
  EXPECT_EQ(p.through, 0) << "segments went through each other";
  return p;
}

TEST(Pull, AGrannySlipsAtALowerLoadThanASquareKnotAndMoreFrictionHoldsLonger) {
  const Pulled square = pulled(silkOf({3, -3}, 0.3)), granny = pulled(silkOf({3, 3}, 0.3)),
               smooth = pulled(silkOf({3, -3}, 0.2));
  EXPECT_EQ(square.kind.determinant, 9);
  EXPECT_EQ(square.kind.signature, 0);
  EXPECT_EQ(granny.kind.determinant, 9);
  EXPECT_EQ(granny.kind.signature, -4);
  EXPECT_TRUE(square.held) << square.load << " N";
  EXPECT_FALSE(granny.held);
  EXPECT_LT(granny.load, 0.5 * square.load) << "N";
  EXPECT_FALSE(smooth.held);
  EXPECT_LT(smooth.load, 0.5 * square.load) << "N";
}

TEST(Pull, FrictionThatFallsWithLoadHoldsLess) {
  PullTest falls = silkOf({3, -3}, 0.3);
  falls.section.friction_fall = 0.15, falls.section.friction_pressure = 1e7;
  const Pulled p = pulled(falls);
  EXPECT_FALSE(p.held);
  EXPECT_LT(p.load, 10.0) << "N; without the fall it bears 14.1 N";
}

TEST(Pull, ATighterKnotAndAThirdThrowHoldMoreAndShortTailsAsMuch) {
  const bool full = std::getenv("VEST_FULL") != nullptr;
  std::printf("count: %d of 1 series of tensions, throws and tails\n", full ? 1 : 0);
  if (!full) return;
  const Pulled two = pulled(silkOf({3, -3}, 0.15)), three = pulled(silkOf({3, -3, 3}, 0.15));
  EXPECT_EQ(three.kind.determinant, 27);
  EXPECT_GT(three.load, 2.0 * two.load) << "N";
  PullTest test = silkOf({3, -3}, 0.2);
  const Pulled loose = pulled(test);
  test.tail = 0.003;
  EXPECT_NEAR(pulled(test).load, loose.load, 0.25 * loose.load) << "N";
  test.tail = 0.01, test.tension = 14.7;
  EXPECT_GT(pulled(test).load, 1.5 * loose.load) << "N";
}

}  // namespace
}  // namespace vest::suture::test
