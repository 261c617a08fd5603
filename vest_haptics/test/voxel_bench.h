/// What the tests of hands in a patient's image share.
#pragma once

#include <cmath>

#include "support.h"
#include "vest_haptics/device/simulated.h"
#include "vest_haptics/trial/trial.h"
#include "vest_tissue/volume/feel.h"

namespace vest::haptics::testing {

using Eigen::Vector3d;

inline constexpr double kSurface = 0.050, kYield = 0.8, kFriction = 10, kReach = 0.020;  // m, N, N/m, m

/// An image alone: 100 below the surface, 0 above. Its region is there for the World to have an object.
inline scene::Description block(double stiffness = 64) {
  volume::Brick b;
  b.size = {60, 60, 60};
  b.axes *= 0.001;
  b.origin = Vector3d(-0.0295, -0.0295, kSurface - 0.0395);
  b.stored.resize(b.voxels());
  for (std::size_t v = 0; v < b.stored.size(); ++v) b.stored[v] = v / 3600 < 40 ? 100 : 0;
  volume::TransferTable table(2);
  table[0].value = 20, table[1].value = 80;
  table[1].feel = {stiffness, kYield, 0.2, kFriction};
  volume::FeelOptions o;
  o.surface = 50;
  o.region = [](const Vector3d&, double value) { return static_cast<std::uint8_t>(value > 50 ? 1 : 0); };
  scene::Description d;
  d.name = "block";
  d.feel = makeFeelable(b, table, o);
  scene::Object region;
  region.name = region.organ = region.material = "block";
  region.model = scene::ObjectModel::Rigid;
  region.law.youngs_modulus = 1e5;
  region.position = region.rest_position = {Vector3d(0, 0, kSurface - 0.02)};
  region.mass = {1e-3}, region.damping = {0}, region.fixed = {1};
  d.objects.push_back(region);
  d.regions = {0};
  return d;
}

}  // namespace vest::haptics::testing
