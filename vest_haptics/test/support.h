#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "vest_haptics/loop/controller.h"
#include "vest_tissue/shared/contact_memory.h"

namespace vest::haptics::testing {

inline constexpr std::int64_t kMs = 1000000;

/// Full counts of docs/HAZARDS.md under ./test --full, about 1 % of them otherwise.
inline bool full() {
  return std::getenv("VEST_FULL") != nullptr;
}

/// How many of something a test does: all of them under ./test --full. Says it in the form that
/// .ci/full_table reads.
inline std::int64_t counted(std::int64_t whole, std::int64_t reduced, const char* what) {
  const std::int64_t count = full() ? whole : reduced;
  std::printf("count: %lld of %lld %s\n", static_cast<long long>(count), static_cast<long long>(whole), what);
  return count;
}

/// A trocar above the middle of the box that points straight down.
inline kinematics::TrainerArm arm() {
  kinematics::TrainerArm a;
  a.present = true;
  a.pivot_B = {0.0, 0.0, 0.165};
  a.aim_B = {0.0, 0.0, 0.055};
  a.X_BTrocar = kinematics::trocarFrame(a.pivot_B, a.aim_B);
  return a;
}

inline Capabilities cartesian() {
  Capabilities c;
  c.model = "test";
  c.maximum = {3.3, 0, 0, 0, 0};
  c.stiffness = 2000.0;
  c.orientation = false;
  return c;
}

inline ControllerOptions options() {
  ControllerOptions o;
  o.arm = arm();
  return o;
}

/// A simulation in a few lines: an elastic half space below z = level, felt by the tip that was commanded. A
/// step a millisecond.
struct HalfSpace {
  double level = 0.055;      ///< m, world
  double stiffness = 300.0;  ///< N/m
  double damping = 0.0;      ///< N·s/m
  double jump = 0.0;         ///< N added to the force, e.g. NaN
  bool present = true;       ///< the instrument is in the scene
  double lag = 0.0;          ///< m: so far above what was asked for something holds its proxy
  shared::ContactImage image;

  HalfSpace() { image.generation = 1; }
  /// @param tip m, world: where the hand's instrument is
  const shared::ContactImage* step(const Eigen::Vector3d& tip, std::int64_t now_ns) {
    ++image.step;
    image.steady_ns = now_ns;
    shared::ContactRecord& r = image.contacts[0];
    r = shared::ContactRecord{};
    r.flags = present ? shared::kFlagPresent : 0;
    for (int e = 0; e < 3; ++e) {
      r.position[e] = present ? tip[e] : 0.0;
      r.commanded[e] = tip[e];
    }
    r.position[2] += lag;
    r.pivot[2] = 0.165;
    r.radius = 0.005;
    const double depth = level - r.position[2];
    if (depth > 0.0 && present) {
      r.flags |= shared::kFlagContact;
      r.wrench[2] = stiffness * depth + jump;
      r.stiffness[14] = stiffness;
      r.damping[14] = damping;
      r.plane_count = 1;
      r.planes[0][2] = 1.0;
      r.planes[0][3] = level;
    }
    return &image;
  }
};

}  // namespace vest::haptics::testing
