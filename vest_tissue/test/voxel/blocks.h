/// Images with a known answer.
#pragma once

#include <functional>
#include <memory>

#include "vest_tissue/volume/feel.h"
#include "vest_tissue/volume/phantom.h"

namespace vest::voxel::testing {

using Eigen::Vector3d;

inline constexpr double kFull = 3.3;  // N, of the device that all is measured by

/// 60 × 60 × 80 voxels of a millimetre, the uppermost face at z = 0.04: what `value` says of a height.
inline volume::Brick layers(const std::function<int(double z)>& value) {
  volume::Brick b;
  b.size = {60, 60, 80};
  b.axes *= 0.001;
  b.origin = Vector3d(-0.0295, -0.0295, -0.0395);
  b.stored.resize(b.voxels());
  std::size_t v = 0;
  for (std::uint32_t k = 0; k < b.size[2]; ++k)
    for (std::uint32_t n = 0; n < b.size[0] * b.size[1]; ++n, ++v)
      b.stored[v] = static_cast<std::int16_t>(value(b.origin.z() + 0.001 * k));
  return b;
}

/// Stiffness, yield, viscosity, friction of 0 (air), 100 and 200.
inline volume::TransferTable table(std::array<double, 4> soft, std::array<double, 4> hard) {
  volume::TransferTable t(4);
  t[0].value = 20, t[1].value = 80, t[2].value = 120, t[3].value = 180;
  t[1].feel = t[2].feel = soft;
  t[3].feel = hard;
  return t;
}

inline volume::FeelOptions options() {
  volume::FeelOptions o;
  o.surface = 50;
  return o;
}

/// Straight down on the axis, from a pivot above.
struct Hand {
  View view;
  Kind kind;
  Vector3d pivot{0, 0, 0.15};
  Vector3d tip{0, 0, 0.02};
  ToolState state;
  Felt felt;
  double put_in = 0;  ///< J, of the hand: trapezoidal
  double jump = 0;    ///< N, greatest change within a tick of what a device of kFull can show
  Vector3d last = Vector3d::Zero();
  Hand(const View& v, Kind k) : view(v), kind(k) { to(tip); }
  static Vector3d shown(const Vector3d& f) { return f.norm() > kFull ? Vector3d(f * (kFull / f.norm())) : f; }
  const Felt& to(const Vector3d& place) {
    Motion m;
    m.kind = kind, m.tip = place, m.pivot = pivot;
    felt = step(view, m, state);
    put_in -= 0.5 * (last + felt.force).dot(place - tip);
    jump = std::max(jump, (shown(felt.force) - shown(last)).norm());
    last = felt.force;
    tip = place;
    return felt;
  }
  /// Along a straight line at a speed, m/s.
  template <class Each>
  void go(const Vector3d& end, double speed, const Each& each) {
    const Vector3d begin = tip;
    const int n = std::max(1, static_cast<int>(std::ceil((end - begin).norm() / (0.001 * speed))));
    for (int i = 1; i <= n; ++i) {
      to(begin + (end - begin) * i / n);
      each();
    }
  }
  void go(const Vector3d& end, double speed) {
    go(end, speed, [] {});
  }
};

/// A block of the lumbar phantom about a disc, upright: the patient's back at +z, its skin at z = 0.1.
inline std::shared_ptr<const voxel::Volume> lumbar(const volume::TransferTable& table, double noise,
                                                   std::vector<double> capsules = {}) {
  const volume::Phantom phantom = volume::makePhantom("lumbar");
  volume::PhantomBlock block;
  block.low = {-0.05, -0.02, -0.01}, block.high = {0.05, 0.105, 0.045};
  block.turn = volume::prone();
  block.noise = noise;
  volume::FeelOptions o;
  o.capsules = std::move(capsules);
  o.region = [&](const Vector3d& place, double) {
    const volume::Shape* const shape = phantom.at(block.toPatient(place));
    return static_cast<std::uint8_t>(shape == nullptr ? 0 : shape->label);
  };
  return makeFeelable(volume::picture(phantom, block), table, o);
}

}  // namespace vest::voxel::testing
