// Which knot holds how much follows from contact and friction: nothing here knows a knot's name.
#include <gtest/gtest.h>

#include "knots.h"
#include "pull_test.h"

namespace vest::suture::test {
namespace {

/// Two throws in silk 2-0, set with 4.9 N.
Pulled pulled(int second, double friction) {
  PullTest test;
  test.throws = {3, second};
  const double ratio = 0.00016 / 0.0001875;  // of the diameters of 2-0 and 0
  test.section = silk();
  test.section.radius *= ratio, test.section.linear_density *= ratio * ratio;
  for (double* stiffness : {&test.section.stretch, &test.section.shear}) *stiffness *= ratio * ratio;
  for (double* stiffness : {&test.section.bend, &test.section.twist}) *stiffness *= std::pow(ratio, 4);
  test.section.friction = friction;
  test.strength = 14.1;  // N, knot-pull
  PullRoom room(test);
  const Pulled p = room.run();
  EXPECT_TRUE(p.well);
  EXPECT_EQ(p.through, 0) << "segments went through each other";
  return p;
}

TEST(Pull, AGrannySlipsAtALowerLoadThanASquareKnotAndMoreFrictionHoldsLonger) {
  const Pulled square = pulled(-3, 0.3), granny = pulled(3, 0.3), smooth = pulled(-3, 0.2);
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

}  // namespace
}  // namespace vest::suture::test
