#include <numeric>

#include "cut_job.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;

constexpr double kLeastShare =
    0.25;  ///< of a knot's mass that a part gets (tuned): no knot becomes too light
constexpr std::size_t kMostAround = 64;  ///< triangles around a knot that are looked at

/// Fans of triangles around a knot that the line divides.
struct Fans {
  std::array<std::uint8_t, kMostAround> of{};  ///< per incident triangle
  std::size_t triangles = 0;
  int count = 0;
};

Fans fansOf(const CutJob& j, std::uint32_t knot) {
  Fans f;
  const std::uint32_t* const first = j.begin(knot);
  f.triangles = std::min<std::size_t>(static_cast<std::size_t>(j.end(knot) - first), kMostAround);
  std::iota(f.of.begin(), f.of.begin() + f.triangles, std::uint8_t{0});
  const auto root = [&](std::uint8_t i) {
    while (f.of[i] != i) i = f.of[i];
    return i;
  };
  // Joined: two triangles that share an edge at the knot which is not in the line.
  for (std::size_t a = 0; a < f.triangles; ++a) {
    const auto& ta = j.s.triangles[first[a]];
    for (std::size_t e = 0; e < 3; ++e) {
      const std::uint32_t p = ta[e], q = ta[(e + 1) % 3];
      if ((p != knot && q != knot) || (j.cut.line[first[a]] >> e & 1u)) continue;
      const std::uint32_t other = p == knot ? q : p;
      for (std::size_t b = a + 1; b < f.triangles; ++b) {
        const auto& tb = j.s.triangles[first[b]];
        for (std::size_t n = 0; n < 3; ++n) {
          const std::uint32_t u = tb[n], v = tb[(n + 1) % 3];
          if (!((u == knot && v == other) || (u == other && v == knot)) || (j.cut.line[first[b]] >> n & 1u))
            continue;
          const std::uint8_t ra = root(static_cast<std::uint8_t>(a)), rb = root(static_cast<std::uint8_t>(b));
          f.of[std::max(ra, rb)] = std::min(ra, rb);
        }
      }
    }
  }
  // Numbered by their first triangle.
  std::array<std::uint8_t, kMostAround> number{};
  for (std::size_t a = 0; a < f.triangles; ++a) {
    const std::uint8_t r = root(static_cast<std::uint8_t>(a));
    if (r == a) number[a] = static_cast<std::uint8_t>(f.count++);
  }
  for (std::size_t a = f.triangles; a-- > 0;) f.of[a] = root(static_cast<std::uint8_t>(a));
  for (std::size_t a = 0; a < f.triangles; ++a) f.of[a] = number[f.of[a]];
  return f;
}

/// Direction from the cut at a knot into a part that lies along `way`: across the blade's tracks there.
Vector3d awayFromCut(const CutJob& j, std::uint32_t knot, const Vector3d& way) {
  Vector3d sum = Vector3d::Zero();
  for (const interaction::CutTrack& track : j.cut.tracks) {
    if (j.k.version_of[track.knots[0]] != j.k.version_of[knot] &&
        j.k.version_of[track.knots[1]] != j.k.version_of[knot])
      continue;
    Vector3d along;
    for (int e = 0; e < 3; ++e)
      along[e] = track.to[static_cast<std::size_t>(e)] - track.from[static_cast<std::size_t>(e)];
    const Vector3d m = along.cross(j.normal(track.triangle));
    sum += m.dot(way) < 0.0 ? Vector3d(-m) : m;
  }
  if (!(sum.squaredNorm() > 0.0)) sum = way;
  const double length = std::sqrt(sum.squaredNorm());
  return length > 0.0 ? Vector3d(sum / length) : Vector3d(Vector3d::Zero());
}

/// Divides one knot among its fans. Returns whether it was doubled.
bool divideKnot(CutJob& j, std::uint32_t knot) {
  const Fans fans = fansOf(j, knot);
  if (fans.count < 2 || fans.count > 8) return false;
  const std::uint32_t* const first = j.begin(knot);
  std::array<double, 8> area{};
  std::array<Vector3d, 8> way;
  way.fill(Vector3d::Zero());
  for (std::size_t i = 0; i < fans.triangles; ++i) {
    const std::uint8_t fan = fans.of[i];
    const double twice = std::sqrt(j.normal(first[i]).squaredNorm());
    area[fan] += 0.5 * twice;
    way[fan] += twice * (j.centroid(first[i]) - j.rest(knot));
  }
  const int keeps =
      static_cast<int>(std::max_element(area.begin(), area.begin() + fans.count) - area.begin());
  double left = std::accumulate(area.begin(), area.begin() + fans.count, 0.0);
  bool doubled = false;
  for (int fan = 0; fan < fans.count; ++fan) {
    const Vector3d inward = awayFromCut(j, knot, way[static_cast<std::size_t>(fan)]);
    if (fan == keeps) {
      j.setInward(knot, inward);
      continue;
    }
    const double a = area[static_cast<std::size_t>(fan)];
    const double share = std::clamp(left > 0.0 ? a / left : 0.5, kLeastShare, 1.0 - kLeastShare);
    std::uint32_t copy = 0;
    if (j.s.fixed.size() == j.s.fixed.capacity() ||
        !doubleKnot(j.c.state, j.object, knot, copy, j.delta, share)) {
      j.cut.exhausted = true;
      return doubled;
    }
    left -= a;
    doubled = true;
    j.setInward(copy, inward);
    j.k.split[copy] = knot;
    j.k.version_of[copy] = j.k.version_of[knot];
    for (std::size_t i = 0; i < fans.triangles; ++i) {
      if (fans.of[i] != fan) continue;
      auto& t = j.s.triangles[first[i]];
      std::replace(t.begin(), t.end(), knot, copy);
    }
  }
  return doubled;
}

}  // namespace

void renewVersions(CutJob& j) {
  const std::uint32_t knots = static_cast<std::uint32_t>(j.s.block.knots());
  const std::uint32_t of_scene = knots - static_cast<std::uint32_t>(j.s.topology.doubled_knots.size());
  for (std::uint32_t i = 0; i < knots; ++i) {
    j.k.version_of[i] = i < of_scene ? i : j.k.version_of[j.s.topology.doubled_knots[i - of_scene]];
    j.k.split[i] = i;
  }
}

void renewIncident(CutJob& j) {
  const std::size_t knots = j.s.block.knots();
  auto& start = j.k.incident_start;
  std::fill_n(start.begin(), knots + 2, 0u);
  for (std::size_t t = 0; t < j.s.triangles.size(); ++t) {
    if (j.s.triangle_alive[t] == 0) continue;  // torn: it holds nothing together
    for (const std::uint32_t k : j.s.triangles[t]) ++start[k + 2];
  }
  for (std::size_t i = 2; i < knots + 2; ++i) start[i] += start[i - 1];
  for (std::uint32_t t = 0; t < j.s.triangles.size(); ++t) {
    if (j.s.triangle_alive[t] == 0) continue;
    for (const std::uint32_t k : j.s.triangles[t]) j.k.incident[start[k + 1]++] = t;
  }
}

bool divideNet(CutJob& j) {
  j.k.before_start.assign(j.k.incident_start.begin(), j.k.incident_start.end());
  j.k.before.assign(j.k.incident.begin(), j.k.incident.end());
  j.k.triangles_before.assign(j.s.triangles.begin(), j.s.triangles.end());
  std::sort(j.k.work.begin(), j.k.work.end());
  for (const std::uint32_t knot : j.k.work) {
    // Corners of triangles change while neighbours are divided; the triangles around a knot stay the same.
    if (divideKnot(j, knot)) j.divided = true;
  }
  if (j.divided) renewIncident(j);
  return j.divided;
}

}  // namespace vest::scene
