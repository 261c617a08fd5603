#include "vest_tissue/suture/roeder.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "vest_tissue/suture/polyline.h"

namespace vest::suture {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

/// The knot as it lies when it has been set, in diameters of its thread: made by the rod of this room from a
/// loose one (specimen/roeder_knot.h), polyglactin, loop and short end drawn with 5 N. That test finds it
/// again. The standing part through it;
constexpr double kStanding[][3] = {{0.012, 0.001, -3.560}, {0.006, 0.020, -2.060}, {-0.077, 0.076, -0.564},
                                   {-0.572, 0.387, 0.818}, {-0.950, 0.690, 2.239}, {-1.262, 0.697, 3.709},
                                   {-2.068, 1.021, 4.935}, {-3.308, 1.289, 5.741}, {-4.536, 1.548, 6.569},
                                   {-5.631, 1.809, 7.565}};
/// and the other limb of the loop, 1.5 diameters from node to node: hitch, winds, lock, short end.
constexpr double kEnd[][3] = {
    {5.407, 2.043, 5.425},   {3.985, 1.766, 5.025},   {2.518, 1.509, 4.830},   {1.288, 1.102, 4.073},
    {1.066, 0.475, 2.798},   {1.029, -0.468, 1.678},  {-0.097, -0.866, 0.869}, {-1.456, -0.468, 0.523},
    {-1.577, 0.990, 0.500},  {-0.363, 1.575, 0.660},  {0.442, 0.775, 1.534},   {-0.181, -0.398, 2.104},
    {-1.512, -0.442, 1.538}, {-1.907, 0.804, 1.469},  {-0.993, 1.958, 1.646},  {0.504, 1.996, 1.729},
    {1.625, 1.055, 1.785},   {2.293, -0.121, 2.119},  {1.414, -1.247, 2.526},  {-0.053, -1.393, 2.515},
    {-1.477, -1.015, 2.518}, {-2.404, 0.141, 2.430},  {-1.852, 1.418, 2.541},  {-0.527, 2.018, 2.691},
    {0.964, 1.897, 2.749},   {2.181, 1.050, 2.799},   {2.014, -0.166, 3.211},  {0.619, -0.664, 3.273},
    {-0.872, -0.520, 3.291}, {-2.213, 0.029, 3.484},  {-2.395, 1.409, 3.462},  {-1.084, 2.085, 3.634},
    {0.362, 2.327, 3.767},   {1.819, 2.244, 3.558},   {2.810, 1.139, 3.682},   {2.141, 0.102, 4.307},
    {0.844, -0.274, 4.943},  {-0.563, -0.395, 5.341}, {-1.977, -0.175, 4.925}, {-3.167, 0.459, 4.422},
    {-2.828, 1.885, 4.277},  {-1.519, 2.143, 4.578},  {-0.676, 1.131, 4.742},  {-0.525, -0.268, 4.279},
    {-0.240, -1.649, 4.316}, {0.089, -3.110, 4.346}};

/// Centripetal Catmull–Rom curve through all but the first and the last point (Barry and Goldman 1988).
std::vector<Vector3d> curveThrough(const std::vector<Vector3d>& p) {
  constexpr int kSteps = 24;
  std::vector<Vector3d> out;
  for (std::size_t i = 1; i + 2 < p.size(); ++i) {
    double t[4] = {};
    for (std::size_t k = 1; k < 4; ++k) t[k] = t[k - 1] + std::sqrt((p[i - 1 + k] - p[i - 2 + k]).norm());
    for (int n = 0; n < kSteps; ++n) {
      const double at = t[1] + (t[2] - t[1]) * n / kSteps;
      Vector3d a[3], b[2];
      for (std::size_t k = 0; k < 3; ++k)
        a[k] = ((t[k + 1] - at) * p[i - 1 + k] + (at - t[k]) * p[i + k]) / (t[k + 1] - t[k]);
      for (std::size_t k = 0; k < 2; ++k)
        b[k] = ((t[k + 2] - at) * a[k] + (at - t[k]) * a[k + 1]) / (t[k + 2] - t[k]);
      out.push_back(((t[2] - at) * b[0] + (at - t[1]) * b[1]) / (t[2] - t[1]));
    }
  }
  out.push_back(p[p.size() - 2]);
  return out;
}

/// Appends nodes along a way, evenly and about `spacing` apart, without its first point.
void appendAlong(const std::vector<Vector3d>& p, double spacing, std::vector<Vector3d>& nodes) {
  const double whole = lengthOf(p);
  const auto parts = static_cast<std::size_t>(std::max(1L, std::lround(whole / spacing)));
  const std::vector<Vector3d> along = nodesAlong(p, whole, parts);
  nodes.insert(nodes.end(), along.begin() + 1, along.end());
}

}  // namespace

std::vector<Vector3d> roederLoop(const RoederLoop& loop) {
  const double d = loop.diameter;
  std::vector<Vector3d> standing, end;
  for (const auto& p : kStanding) standing.push_back(d * Vector3d(p[0], p[1], p[2]));
  for (const auto& p : kEnd) end.push_back(d * Vector3d(p[0], p[1], p[2]));
  const Vector3d rear(0, 0, -loop.standing);
  std::vector<Vector3d> nodes{rear};
  appendAlong({rear, standing[0]}, loop.segment, nodes);
  nodes.insert(nodes.end(), standing.begin() + 1, standing.end());
  // From where the standing part leaves the knot round a circle to the other limb.
  const double radius = loop.length / (2.0 * kPi);
  const Vector3d middle(0.5 * (standing.back().x() + end[0].x()), end[0].y(), end[0].z() + radius);
  std::vector<Vector3d> round{standing[standing.size() - 2], standing.back()};
  constexpr int kRound = 36;
  for (int k = 4; k <= kRound - 3; ++k) {
    const double angle = 2.0 * kPi * k / kRound;
    round.push_back(middle + radius * Vector3d(-std::sin(angle), 0, -std::cos(angle)));
  }
  round.push_back(end[0]), round.push_back(end[1]);
  appendAlong(curveThrough(round), loop.segment, nodes);
  nodes.insert(nodes.end(), end.begin() + 1, end.end());
  const Vector3d tip = nodes.back(), way = (tip - nodes[nodes.size() - 2]).normalized();
  if (loop.tail > 0.0) appendAlong({tip, tip + loop.tail * way}, loop.segment, nodes);
  return nodes;
}

Eigen::Matrix3d loopAxes(const Vector3d& ahead, const Vector3d& across) {
  Eigen::Matrix3d axes;
  axes.col(2) = ahead.normalized();
  axes.col(1) = axes.col(2).cross(across).normalized();
  axes.col(0) = axes.col(1).cross(axes.col(2));
  return axes;
}

}  // namespace vest::suture
