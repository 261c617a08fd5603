#include "vest_tissue/interaction/clip.h"

#include <algorithm>
#include <cmath>

namespace vest::interaction {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {
constexpr double kGreatestTurn = 0.5;  // rad: of one of Newton's steps
}

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

Vector3d boundedTurn(const Matrix3d& inertia, const Vector3d& momentum, double energy) {
  const double size = inertia.trace();
  for (double added = 1e-9; added < 10.0; added *= 10.0) {
    const Matrix3d sum = inertia + added * size * Matrix3d::Identity();
    const Vector3d turn = sum.inverse() * momentum;
    if (0.5 * turn.dot(inertia * turn) <= energy * (1.0 + 1e-6)) return turn;
  }
  return Vector3d::Zero();
}

Matrix3d nearestRotation(const Matrix3d& moment, const Matrix3d& guess) {
  Eigen::Quaterniond q(guess);
  for (int n = 0; n < 4; ++n) {
    const Matrix3d r = q.toRotationMatrix(), stretch = moment * r.transpose();
    const Vector3d gradient(stretch(2, 1) - stretch(1, 2), stretch(0, 2) - stretch(2, 0),
                            stretch(1, 0) - stretch(0, 1));
    const double size = std::fabs(stretch.trace()) + 1e-30;
    // Newton's matrix. Dividing by its trace instead would leave the turn of a long thin group about its own
    // axis far behind: the links' torque about it would go on and on, and feed energy into the tissue.
    const Matrix3d curvature = stretch.trace() * Matrix3d::Identity() -
                               0.5 * (stretch + stretch.transpose()) + 1e-6 * size * Matrix3d::Identity();
    const double det2 = curvature(0, 0) * curvature(1, 1) - curvature(0, 1) * curvature(1, 0);
    const bool convex = curvature(0, 0) > 0.0 && det2 > 0.0 && curvature.determinant() > 0.0;
    Vector3d turn = convex ? Vector3d(curvature.inverse() * gradient) : Vector3d(gradient / size);
    const double angle = std::sqrt(turn.squaredNorm());
    if (!(angle < kGreatestTurn)) turn *= kGreatestTurn / angle;
    if (!turn.allFinite()) break;
    q = Eigen::Quaterniond(1.0, 0.5 * turn.x(), 0.5 * turn.y(), 0.5 * turn.z()) * q;
    q.coeffs() /= std::sqrt(q.squaredNorm());
    if (angle < 1e-10) break;  // rounding
  }
  return q.toRotationMatrix();
}

}  // namespace vest::interaction
