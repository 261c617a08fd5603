#pragma once

#include <cmath>

#include "rods.h"

namespace vest::suture::specimen {

/// 3-0.
inline Section polypropylene() {
  Section s = solidSection(0.0001125, 900, 3e9, 0.4);
  s.friction = 0.2, s.strain_damping = 1e-4;
  return s;
}

/// Two turns, 40 segments, round a drum; 0.2 N at one end, the other is held and drawn from 0.4 s on.
inline Description roundADrum() {
  using Eigen::Vector3d;
  constexpr double kSegment = 0.001, kAngle = 4.0 * kPi, kDrum = 40 * kSegment / kAngle;
  RodDescription rod = straight(4);
  rod.section = polypropylene();
  rod.section.damping = 50.0;
  rod.nodes.clear();
  const double at = kDrum + 1.001 * rod.section.radius;
  for (int i = 55; i > 0; --i) rod.nodes.push_back({at, -kSegment * i, 0.0});
  for (int i = 0; i <= 40; ++i)
    rod.nodes.push_back({at * std::cos(kAngle * i / 40), at * std::sin(kAngle * i / 40), 5e-5 * i});
  for (int i = 1; i <= 55; ++i) rod.nodes.push_back({at, kSegment * i, 0.002});
  const Vector3d end = rod.nodes.front();
  rod.held = {{0, Hold::Place, {{0.4, end, 0.0}, {0.6, end - Vector3d(0.0, 0.01, 0.0), 0.0}}}};
  rod.loads = {{150, {0.0, 0.2, 0.0}}};
  Description d{Vector3d::Zero(), {rod}, {}};
  d.cylinders.push_back({"drum", Vector3d::Zero(), Vector3d::UnitZ(), kDrum, 0.2});
  return d;
}

}  // namespace vest::suture::specimen
