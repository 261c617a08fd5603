#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "vest_tissue/base/nearest.h"

namespace vest::contact {

using Eigen::Vector3d;

double nearestSegments(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d, double& s,
                       double& t) {
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v), uw = u.dot(w), vw = v.dot(w);
  const double det = uu * vv - uv * uv;
  s = det > 1e-12 * uu * vv && det > 0.0 ? std::clamp((uv * vw - vv * uw) / det, 0.0, 1.0) : 0.0;
  t = vv > 0.0 ? (uv * s + vw) / vv : 0.0;
  if (t < 0.0 || t > 1.0) {
    t = std::clamp(t, 0.0, 1.0);
    s = uu > 0.0 ? std::clamp((uv * t - uw) / uu, 0.0, 1.0) : 0.0;
  }
  return (a + u * s - (c + v * t)).norm();
}

Nearest nearest(const Vector3d& point, const std::array<Vector3d, 3>& p) {
  // Regions of the triangle by the signs of the projections on its edges.
  Nearest r{};
  const Vector3d ab = p[1] - p[0], ac = p[2] - p[0], ap = point - p[0];
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  const Vector3d bp = point - p[1], cp = point - p[2];
  const double d3 = ab.dot(bp), d4 = ac.dot(bp), d5 = ab.dot(cp), d6 = ac.dot(cp);
  const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
  if (d1 <= 0 && d2 <= 0) {
    r.weights = {1, 0, 0};
  } else if (d3 >= 0 && d4 <= d3) {
    r.weights = {0, 1, 0};
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const double t = d1 - d3 > 0 ? d1 / (d1 - d3) : 0.0;
    r.weights = {1 - t, t, 0};
  } else if (d6 >= 0 && d5 <= d6) {
    r.weights = {0, 0, 1};
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const double t = d2 - d6 > 0 ? d2 / (d2 - d6) : 0.0;
    r.weights = {1 - t, 0, t};
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double sum = (d4 - d3) + (d5 - d6), t = sum > 0 ? (d4 - d3) / sum : 0.0;
    r.weights = {0, 1 - t, t};
  } else {
    const double sum = va + vb + vc;
    if (sum > 0) {
      r.weights = {va / sum, vb / sum, vc / sum};
    } else {
      r.weights = {1, 0, 0};
    }
  }
  r.distance = (p[0] * r.weights[0] + p[1] * r.weights[1] + p[2] * r.weights[2] - point).norm();
  return r;
}

Nearest nearest(const Vector3d& a, const Vector3d& b, const std::array<Vector3d, 3>& p) {
  Nearest best = nearest(a, p);
  best.s = 0.0;
  Nearest other = nearest(b, p);
  other.s = 1.0;
  if (other.distance < best.distance) best = other;
  for (int e = 0; e < 3; ++e) {
    const int f = (e + 1) % 3;
    double s, t;
    const double distance = nearestSegments(a, b, p[e], p[f], s, t);
    if (distance < best.distance) {
      best.distance = distance;
      best.s = s;
      best.weights = {0, 0, 0};
      best.weights[e] = 1 - t;
      best.weights[f] = t;
    }
  }
  // The segment may pass through the inside of the triangle.
  const Vector3d n = (p[1] - p[0]).cross(p[2] - p[0]);
  const double da = n.dot(a - p[0]), db = n.dot(b - p[0]);
  if ((da > 0) != (db > 0) && da != db) {
    const double s = da / (da - db);
    const Nearest through = nearest(Vector3d(a + (b - a) * s), p);
    if (through.distance < best.distance) {
      best = through;
      best.s = s;
    }
  }
  return best;
}

}  // namespace vest::contact
