#include "vest_viz/truth/keypoints.h"

#include <cmath>
#include <limits>

namespace vest::truth {
namespace {

using Eigen::Vector3d;

/// Pixel and depth; false behind the camera or outside of the round picture.
bool see(const Vector3d& p, const camera::Intrinsics& camera, const picture::Circle& circle,
         const Eigen::Isometry3d& X_WO, Keypoint* k) {
  const Vector3d q = X_WO.inverse() * p;
  k->depth = q.z();
  k->u = k->v = std::numeric_limits<double>::quiet_NaN();
  if (q.z() < 0.002) return false;
  const Eigen::Vector2d n(q.x() / q.z(), q.y() / q.z());
  // Beyond this the distortion polynomial is not one-to-one for usual lenses, and nothing is drawn there.
  if (n.norm() > 1.3) return false;
  const Eigen::Vector2d pixel = camera::project(camera, n);
  k->u = pixel.x();
  k->v = pixel.y();
  return k->u >= -0.5 && k->v >= -0.5 && k->u < camera.width - 0.5 && k->v < camera.height - 0.5 &&
         std::hypot(k->u - circle.cx, k->v - circle.cy) <= circle.radius;
}

}  // namespace

void appendKeypoints(const InstrumentPose& i, const camera::Intrinsics& camera, const picture::Circle& circle,
                     const Eigen::Isometry3d& X_WO, const Raster& raster, std::vector<Keypoint>* out) {
  const auto add = [&](const char* name, const Vector3d& p) {
    Keypoint k;
    k.instrument = i.name;
    k.name = name;
    if (see(p, camera, circle, X_WO, &k)) {
      const float before = raster.depthAt(k.u, k.v);
      const bool hidden = std::isfinite(before) && before < k.depth - 1.2 * i.shaft_radius &&
                          raster.labelAt(k.u, k.v) != i.label;
      k.visibility = hidden ? 1 : 2;
    }
    out->push_back(k);
  };
  const Vector3d wrist = i.X_WTip * Vector3d(0, 0, -i.jaw_length);
  const Vector3d tip = i.X_WTip.translation();
  add("tip", tip);
  if (i.jaw_length > 0)
    for (int side : {1, -1}) {
      const double a = 0.5 * side * i.jaw;
      add(side == 1 ? "jaw_left" : "jaw_right",
          wrist + i.jaw_length * (i.X_WTip.linear() * Vector3d(std::sin(a), 0, std::cos(a))));
    }
  add("wrist", wrist);
  // From the trocar towards the tip, the first place that is in the picture; then halved to a tenth of a
  // millimetre.
  Keypoint trial;
  constexpr int kSteps = 400;
  double seen = -1;
  for (int s = 0; s <= kSteps && seen < 0; ++s)
    if (see(i.pivot + (tip - i.pivot) * (static_cast<double>(s) / kSteps), camera, circle, X_WO, &trial))
      seen = static_cast<double>(s) / kSteps;
  if (seen < 0) {
    Keypoint none;
    none.instrument = i.name;
    none.name = "entry";
    none.u = none.v = std::numeric_limits<double>::quiet_NaN();
    none.depth = (X_WO.inverse() * tip).z();
    out->push_back(none);
    return;
  }
  double low = std::max(0.0, seen - 1.0 / kSteps), high = seen;
  for (int k = 0; k < 12; ++k) {
    const double middle = 0.5 * (low + high);
    (see(i.pivot + (tip - i.pivot) * middle, camera, circle, X_WO, &trial) ? high : low) = middle;
  }
  add("entry", i.pivot + (tip - i.pivot) * high);
}

}  // namespace vest::truth
