#include "vest_tissue/suture/roeder.h"

#include <algorithm>
#include <cmath>

namespace vest::suture {
namespace {

using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

/// The knot as it lies when it has been set, in diameters of its thread: made by the rod of this room from a
/// loose one (specimen/roeder_knot.h), polyglactin, loop and short end drawn with 5 N. That test finds it
/// again. The standing part through it;
constexpr double kStanding[][3] = {{0.005, -0.008, -4.421}, {-0.069, 0.073, -2.417}, {-0.324, 0.333, -0.444},
                                   {-1.003, 1.066, 1.297},  {-1.441, 1.040, 3.260},  {-2.643, 1.428, 4.824},
                                   {-4.257, 1.799, 5.966}};
/// and the other limb of the loop, 1.5 diameters from node to node: hitch, winds, lock, short end.
constexpr double kEnd[][3] = {
    {5.632, 2.430, 5.064},   {4.249, 2.133, 4.559},   {2.801, 1.839, 4.289},   {1.453, 1.433, 3.769},
    {0.873, 0.789, 2.619},   {0.671, -0.142, 1.509},  {-0.331, -0.603, 0.562}, {-1.601, -0.032, 0.061},
    {-1.530, 1.327, -0.148}, {-0.309, 1.831, 0.131},  {0.299, 1.089, 1.206},   {-0.515, 0.068, 1.822},
    {-1.678, 0.055, 1.084},  {-2.066, 1.307, 0.824},  {-1.054, 2.385, 0.992},  {0.425, 2.388, 1.142},
    {1.464, 1.361, 1.087},   {2.073, 0.070, 1.442},   {1.218, -0.990, 1.924},  {-0.227, -1.194, 1.956},
    {-1.675, -0.834, 1.952}, {-2.627, 0.306, 1.862},  {-2.313, 1.577, 1.872},  {-1.013, 2.263, 1.994},
    {0.462, 2.018, 2.104},   {1.746, 1.307, 2.131},   {1.990, 0.072, 2.608},   {0.662, -0.562, 2.823},
    {-0.799, -0.358, 2.693}, {-2.154, 0.174, 2.849},  {-2.589, 1.580, 2.879},  {-1.403, 2.387, 2.964},
    {0.038, 2.615, 3.018},   {1.510, 2.422, 2.853},   {2.467, 1.298, 3.036},   {1.943, 0.240, 3.713},
    {0.646, -0.116, 4.361},  {-0.764, -0.240, 4.759}, {-2.168, 0.066, 4.399},  {-3.349, 0.840, 3.934},
    {-2.927, 2.164, 3.764},  {-1.609, 2.405, 3.951},  {-0.735, 1.306, 4.209},  {-0.748, -0.036, 3.715},
    {-0.600, -1.424, 3.678}, {-0.352, -2.880, 3.862}, {-0.132, -4.362, 3.891}};

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

/// Appends nodes along a polyline, evenly and about `spacing` apart, without its first point.
void appendAlong(const std::vector<Vector3d>& p, double spacing, std::vector<Vector3d>& nodes) {
  double whole = 0.0;
  for (std::size_t i = 0; i + 1 < p.size(); ++i) whole += (p[i + 1] - p[i]).norm();
  const auto parts = std::max(1L, std::lround(whole / spacing));
  std::size_t i = 0;
  double passed = 0.0, span = (p[1] - p[0]).norm();
  for (long k = 1; k <= parts; ++k) {
    const double at = whole * static_cast<double>(k) / static_cast<double>(parts);
    while (at > passed + span && i + 2 < p.size()) {
      passed += span;
      ++i;
      span = (p[i + 1] - p[i]).norm();
    }
    nodes.push_back(p[i] + (at - passed) / span * (p[i + 1] - p[i]));
  }
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

}  // namespace vest::suture
