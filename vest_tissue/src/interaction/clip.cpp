#include "vest_tissue/interaction/clip.h"

#include <algorithm>
#include <cmath>

namespace vest::interaction {

using Eigen::Matrix3d;
using Eigen::Vector3d;

void remapClips(std::vector<Clip>& clips, std::uint16_t object, const net::KnotDoubling& cut) {
  for (Clip& c : clips) {
    if (!c.alive || c.object != object) continue;
    if (!(cut.plane_normal.dot(c.centre - cut.plane_point) > 0.0)) continue;
    std::replace(c.knots.begin(), c.knots.begin() + c.count, cut.original, cut.copy);
  }
}

double polygonArea(const Vector3d* p, int count) {
  Vector3d sum = Vector3d::Zero();
  for (int i = 1; i + 1 < count; ++i) sum += (p[i] - p[0]).cross(p[i + 1] - p[0]);
  return 0.5 * std::sqrt(sum.squaredNorm());
}

void flattenRing(const Vector3d* ring, int count, double gap, Vector3d* closed) {
  // The knot furthest along z stays the end of the fold; the others follow by their way around.
  int end = 0;
  double perimeter = 0.0, side = 0.0;
  for (int i = 0; i < count; ++i) {
    if (ring[i].z() > ring[end].z()) end = i;
    perimeter += std::sqrt((ring[(i + 1) % count] - ring[i]).squaredNorm());
  }
  double way = 0.0;
  for (int n = 0; n < count; ++n) {
    const int i = (end + n) % count;
    const bool first = way < 0.5 * perimeter;
    closed[i] = ring[i];
    closed[i].z() = first ? 0.25 * perimeter - way : way - 0.75 * perimeter;
    if (n == 0) side = 0.0;
    side += (first ? 1.0 : -1.0) * ring[i].x();
    way += std::sqrt((ring[(i + 1) % count] - ring[i]).squaredNorm());
  }
  const double half = side < 0.0 ? -0.5 * gap : 0.5 * gap;
  way = 0.0;
  for (int n = 0; n < count; ++n) {
    const int i = (end + n) % count;
    closed[i].x() = n == 0 ? 0.0 : way < 0.5 * perimeter ? half : -half;
    way += std::sqrt((ring[(i + 1) % count] - ring[i]).squaredNorm());
  }
}

Matrix3d nearestRotation(const Matrix3d& moment, const Matrix3d& guess) {
  Eigen::Quaterniond q(guess);
  for (int n = 0; n < 2; ++n) {
    const Matrix3d r = q.toRotationMatrix();
    Vector3d turn = Vector3d::Zero();
    double length = 0.0;
    for (int k = 0; k < 3; ++k) {
      turn += r.col(k).cross(moment.col(k));
      length += r.col(k).dot(moment.col(k));
    }
    turn /= std::fabs(length) + 1e-30;
    Eigen::Quaterniond d(1.0, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z());
    q = d * q;
    q.coeffs() /= std::sqrt(q.squaredNorm());
  }
  return q.toRotationMatrix();
}

}  // namespace vest::interaction
