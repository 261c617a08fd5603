#include "vest_tissue/base/sunken_wall.h"

#include <algorithm>

namespace vest::contact {

namespace {

constexpr int kLooks = 12;  ///< halves the rest at least, but for the fold's edge: 2 cm to 5 µm

}  // namespace

double SunkenWall::by(const Eigen::Vector3d& place) const {
  const double above = place.z() - middle;
  if (!(above > 0)) return 0;
  const double share = std::min(above / (high - middle), 1.0);
  double hangs = sunk * share * share * (3 - 2 * share);
  if (propped) {
    const double beside = (place - lens).head<2>().squaredNorm();
    hangs *= beside / (beside + kProp * kProp);
  }
  return std::min(hangs, above);
}

SunkenWall::Above SunkenWall::above(const Eigen::Vector3d& place) const {
  Above out{place.z(), place.z()};
  if (!(place.z() >= middle)) return out;
  // by() grows upwards: from below these steps rise to the least answer, from above they fall to the
  // greatest.
  Eigen::Vector3d low = place, top = place;
  top.z() = std::max(place.z() + sunk, high);
  for (int i = 0; i < kLooks; ++i) {
    low.z() = place.z() + by(low);
    top.z() = place.z() + by(top);
  }
  out.least = low.z(), out.greatest = top.z();
  return out;
}

}  // namespace vest::contact
