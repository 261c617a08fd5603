// Protects the hand: no step of force along slow straight paths, and no stroke gives back more than it took.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "blocks.h"
#include "vest_tissue/solver/random.h"

using namespace vest;
using namespace vest::voxel;
using namespace vest::voxel::testing;

namespace {

/// All of them under ./test --full.
int counted(int whole, int reduced, const char* what) {
  const int count = std::getenv("VEST_FULL") != nullptr ? whole : reduced;
  std::printf("count: %d of %d %s\n", count, whole, what);
  return count;
}

const Volume& spine() {
  static const auto made = lumbar(volume::readTransferTable(VEST_TISSUE_SCENES "/spine_puncture/needle.csv"),
                                  10, {0, 0, 0, 2.5, 0, 1.2});
  return *made;
}

struct Random {
  std::uint64_t stroke, index = 0;
  double between(double low, double high) {
    return low + (high - low) * solver::randomUniform(7, stroke, index++);
  }
  Vector3d inside() { return {between(-0.045, 0.045), between(-0.04, 0.005), between(-0.015, 0.11)}; }
};

/// Height of the skin of the phantom's ellipse.
double skinAt(const Vector3d& p) {
  return 0.100 * std::sqrt(1 - p.x() * p.x() / (0.150 * 0.150));
}

}  // namespace

TEST(Strokes, SlowStraightPathsHaveNoStepOverFivePercentOfFullForce) {
  const int paths = counted(4000, 12, "straight paths through the spine, needle and probe");
  double most[2] = {};
  for (const Kind kind : {Kind::Needle, Kind::Probe}) {
    for (int p = 0; p < paths; ++p) {
      Random random{static_cast<std::uint64_t>(p)};
      Hand hand(spine().view(), kind);
      Vector3d target = random.inside();
      hand.pivot = Vector3d(random.between(-0.03, 0.03), random.between(-0.03, 0.0), 0.2);
      // A probe presses 10 mm deep and strokes over the skin.
      if (kind == Kind::Probe) target.z() = skinAt(target) - random.between(0.001, 0.010);
      const Vector3d start = target + (0.12 - target.z()) / (0.2 - target.z()) * (hand.pivot - target);
      hand.tip = start, hand.state = {};
      hand.to(start);
      hand.jump = 0;
      const double speed = random.between(0.005, 0.020);
      hand.go(target, speed);
      if (kind == Kind::Probe) {
        EXPECT_GT(hand.felt.force.norm(), 0.0);
        hand.go(target + Vector3d(-0.3 * target.x(), random.between(-0.004, 0.004), 0), speed);
      }
      double& greatest = most[kind == Kind::Probe];
      hand.go(start, speed);
      greatest = std::max(greatest, hand.jump);
      ASSERT_LE(hand.jump, 0.05 * kFull) << "path " << p << (kind == Kind::Probe ? " probe" : " needle");
      EXPECT_EQ(hand.felt.force.norm(), 0.0) << "in the air again";
    }
  }
  std::printf("greatest step: needle %.2f %%, probe %.2f %% of %.1f N\n", 100 * most[0] / kFull,
              100 * most[1] / kFull, kFull);
}

TEST(Strokes, NoneGivesBackMoreThanItTook) {
  constexpr int kEach = 100;
  const int strokes = counted(1000000, 2000, "random strokes of the needle");
  // The low-passed speed may give back what it holds: ½·b·τ·v².
  constexpr double kHeld = 0.5 * 0.6 * 0.003 * 0.2 * 0.2;
  double least = 0, back = 0;
  for (int p = 0; p < strokes / kEach; ++p) {
    Random random{static_cast<std::uint64_t>(p) + 1000000};
    Hand hand(spine().view(), Kind::Needle);
    hand.pivot = Vector3d(random.between(-0.03, 0.03), random.between(-0.03, 0.0), 0.2);
    const Vector3d first = random.inside();
    hand.tip = {first.x(), first.y(), 0.11}, hand.state = {};
    hand.to(hand.tip);
    hand.go(first, 0.2);
    for (int s = 0; s < kEach; ++s) {
      // What it put in and what the springs held before: all that may come back.
      const double before = hand.put_in - hand.felt.stored, began = hand.put_in;
      const Vector3d aim(random.between(-1, 1), random.between(-1, 1), random.between(-1, 1));
      hand.go(hand.tip + 0.01 * random.between(0.1, 1) * aim, random.between(0.02, 0.2));
      least = std::min(least, hand.put_in - hand.felt.stored - before);
      back = std::max(back, began - hand.put_in);
      ASSERT_GE(hand.put_in - hand.felt.stored - before, -kHeld) << "stroke " << p * kEach + s;
    }
  }
  EXPECT_GT(back, 1e-4) << "springs gave nothing back: nothing was tested";
  std::printf("least loss of a stroke %.1e J; most that springs gave back %.1e J\n", least, back);
}
