#include <limits>

#include <Eigen/LU>

#include "cut_job.h"

namespace vest::scene {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using interaction::kFree;
using interaction::kNone;
using interaction::kWaits;

constexpr std::uint8_t kHops = 3;  ///< edges within which the knots of a vertex's patch lie
constexpr std::size_t kMostEntries = 64;

/// Two contact triangles lie on different sides of a cut.
bool parted(const CutJob& j, std::uint32_t a, std::uint32_t b) {
  const auto &ta = j.s.triangles[a], &tb = j.s.triangles[b];
  if (j.k.part[ta[0]] != j.k.part[tb[0]]) return true;
  const Vector3d in_a = j.inward(ta[0]) + j.inward(ta[1]) + j.inward(ta[2]),
                 in_b = j.inward(tb[0]) + j.inward(tb[1]) + j.inward(tb[2]);
  return j.facingAway(in_a, in_b, j.centroid(b) - j.centroid(a));
}

/// Knots within some edges of others, and how far.
template <class Knots>
void reach(CutJob& j, const Knots& from) {
  std::fill_n(j.k.hops.begin(), j.s.block.knots(), std::uint8_t{255});
  j.k.reached.clear();
  for (const std::uint32_t knot : from) {
    if (j.k.hops[knot] == 0) continue;
    j.k.hops[knot] = 0;
    j.k.reached.push_back(knot);
  }
  for (std::size_t i = 0; i < j.k.reached.size(); ++i) {
    const std::uint32_t knot = j.k.reached[i];
    if (j.k.hops[knot] == kHops) break;
    for (const std::uint32_t* t = j.begin(knot); t != j.end(knot); ++t) {
      for (const std::uint32_t x : j.s.triangles[*t]) {
        if (j.k.hops[x] != 255) continue;
        j.k.hops[x] = static_cast<std::uint8_t>(j.k.hops[knot] + 1);
        j.k.reached.push_back(x);
      }
    }
  }
}

struct Binding {
  std::array<std::uint32_t, kMostEntries> knots;
  std::array<float, kMostEntries> weights;
  std::size_t count = 0;
  void add(std::uint32_t knot, double weight) {
    for (std::size_t i = 0; i < count; ++i) {
      if (knots[i] != knot) continue;
      weights[i] += static_cast<float>(weight);
      return;
    }
    if (count < kMostEntries) knots[count] = knot, weights[count++] = static_cast<float>(weight);
  }
};

/// The scene's binding with each knot's version of this side; false: one of them is on the other side alone.
bool followVersions(const CutJob& j, std::uint32_t v, Binding& out) {
  const Skin& skin = j.s.topology.skin;
  for (std::uint32_t e = skin.binding_start[v]; e < skin.binding_start[v + 1]; ++e) {
    const std::uint32_t version = j.k.version_of[skin.binding_knots[e]];
    std::uint32_t best = kNone;
    for (const std::uint32_t knot : j.k.reached) {
      if (j.k.version_of[knot] == version && (best == kNone || j.k.hops[knot] < j.k.hops[best])) best = knot;
    }
    if (best == kNone) return false;
    out.add(best, skin.binding_weights[e]);
  }
  return true;
}

/// A place at rest from the triangle that it hangs on: in its plane by the corners, off it by the way to the
/// triangle across the organ. Exact at rest, and it turns and swells with the organ.
void bindFreely(const CutJob& j, std::uint32_t v, Binding& out) {
  const std::uint32_t own = j.cut.lies_on[v], other = acrossOrgan(j, own);
  const auto& t = j.s.triangles[own];
  const Vector3d a = j.rest(t[0]), x = toVector(j.cut.rest[v]) - a;
  Matrix3d m;
  m.col(0) = j.rest(t[1]) - a;
  m.col(1) = j.rest(t[2]) - a;
  m.col(2) = other == kNone ? j.normal(own) : Vector3d(j.centroid(own) - j.centroid(other));
  double scale = 1.0;
  for (int i = 0; i < 3; ++i) scale *= std::sqrt(m.col(i).squaredNorm());
  Vector3d w(1.0 / 3, 1.0 / 3, 0.0);
  if (std::fabs(m.determinant()) > 1e-6 * scale) w = m.inverse() * x;
  for (int i = 0; i < 3; ++i) w[i] = std::clamp(w[i], -4.0, 4.0);  // far from a sliver: bounded
  const double third = other == kNone ? 0.0 : w[2] / 3.0;
  out.add(t[0], 1.0 - w[0] - w[1] + third);
  out.add(t[1], w[0] + third);
  out.add(t[2], w[1] + third);
  if (other == kNone) return;
  for (const std::uint32_t knot : j.s.triangles[other]) out.add(knot, -third);
}

/// Hangs on knots of two pieces.
bool onTwoPieces(const CutJob& j, std::uint32_t v) {
  const Skin& skin = j.s.topology.skin;
  const std::uint32_t first = skin.binding_start[v];
  for (std::uint32_t e = first; e < skin.binding_start[v + 1]; ++e)
    if (j.k.part[skin.binding_knots[e]] != j.k.part[skin.binding_knots[first]]) return true;
  return false;
}

/// Vertices whose binding may have changed: on the cut, or hanging on knots near one that was doubled. A knot
/// that is whole may lie on the other side, too: the way to it from the vertex led through a doubled one.
/// Where a cord was all that held two pieces together, no knot is doubled. And those that wait.
void collect(CutJob& j, std::size_t old_vertices) {
  const Skin& skin = j.s.topology.skin;
  const auto& doubled = j.delta.doubled_knots;
  j.k.work.assign(doubled.begin(), doubled.end());
  for (std::size_t copy = j.s.block.knots() - doubled.size(); copy < j.s.block.knots(); ++copy)
    j.k.work.push_back(static_cast<std::uint32_t>(copy));
  reach(j, j.k.work);
  j.k.order.clear();
  for (std::uint32_t v = 0; v < j.cut.rest.size(); ++v) {
    bool wanted = v >= old_vertices || j.k.candidate[v] != 0 || (j.cut.free[v] & kWaits) != 0 ||
                  (j.cut.free[v] != 0 && j.divided) || (j.parted && onTwoPieces(j, v));
    if (!wanted && j.divided) {
      for (std::uint32_t e = skin.binding_start[v]; e < skin.binding_start[v + 1] && !wanted; ++e)
        wanted = j.k.hops[skin.binding_knots[e]] != 255;
    }
    if (wanted) j.k.order.push_back(v);
  }
}

/// Same binding as before.
bool unchanged(const CutJob& j, std::uint32_t v, const Binding& b) {
  const Skin& skin = j.s.topology.skin;
  const std::uint32_t first = skin.binding_start[v];
  if (skin.binding_start[v + 1] - first != b.count) return false;
  for (std::size_t i = 0; i < b.count; ++i)
    if (skin.binding_knots[first + i] != b.knots[i] || skin.binding_weights[first + i] != b.weights[i])
      return false;
  return true;
}

void tell(Skin& told, const CutJob& j, std::uint32_t v) {
  if (told.binding_start.empty()) told.binding_start.push_back(0);
  const auto from = j.k.new_start[v], to = from + j.k.new_count[v];
  told.binding_knots.insert(told.binding_knots.end(), j.k.new_knots.begin() + from,
                            j.k.new_knots.begin() + to);
  told.binding_weights.insert(told.binding_weights.end(), j.k.new_weights.begin() + from,
                              j.k.new_weights.begin() + to);
  told.binding_start.push_back(static_cast<std::uint32_t>(told.binding_knots.size()));
}

}  // namespace

std::uint32_t acrossOrgan(const CutJob& j, std::uint32_t triangle) {
  const std::uint32_t designed = j.constants.opposite[triangle];
  if (designed == kNone || (j.s.triangle_alive[designed] != 0 && !parted(j, triangle, designed)))
    return designed;
  // The cut went between, or it has torn: the nearest one of this side that looks the other way.
  const Vector3d n = j.normal(triangle), wanted = j.centroid(designed), own = j.centroid(triangle);
  std::uint32_t best = kNone;
  double least = 4.0 * (wanted - own).squaredNorm();
  for (std::uint32_t t = 0; t < j.s.triangles.size(); ++t) {
    if (j.s.triangle_alive[t] == 0) continue;
    const Vector3d at = j.centroid(t), way = own - at;
    const double distance = (at - wanted).squaredNorm();
    if (distance >= least || n.dot(way) <= 0.3 * std::sqrt(n.squaredNorm() * way.squaredNorm()) ||
        n.dot(j.normal(t)) >= 0.0 || parted(j, triangle, t))
      continue;
    least = distance, best = t;
  }
  return best;
}

void bindSkin(CutJob& j, std::size_t old_vertices) {
  Skin& skin = j.s.topology.skin;
  collect(j, old_vertices);
  if (j.k.order.empty()) return;
  // Triangle by triangle, so that the surroundings are searched once for each.
  std::sort(j.k.order.begin(), j.k.order.end(), [&](std::uint32_t a, std::uint32_t b) {
    return j.cut.lies_on[a] != j.cut.lies_on[b] ? j.cut.lies_on[a] < j.cut.lies_on[b] : a < b;
  });
  std::fill(j.k.new_count.begin(), j.k.new_count.end(), 0u);
  j.k.new_knots.clear(), j.k.new_weights.clear();
  std::uint32_t around = kNone;
  std::size_t rebound = 0, entries = 0;
  for (const std::uint32_t v : j.k.order) {
    Binding b;
    bool good = false;
    if ((j.cut.free[v] & kFree) == 0) {
      if (around != j.cut.lies_on[v]) reach(j, j.s.triangles[around = j.cut.lies_on[v]]);
      good = followVersions(j, v, b);
    }
    if (!good) {
      j.cut.free[v] |= kFree;
      b.count = 0;
      bindFreely(j, v, b);
    }
    if (v < old_vertices) {  // those of this step have their room (kDoublesPerStep)
      const bool same = unchanged(j, v, b);
      if (!same && (rebound == kDeltaVertices || entries + b.count > kDeltaEntries)) {
        j.cut.free[v] |= kWaits;
        j.cut.unfinished = true;
        continue;
      }
      j.cut.free[v] = static_cast<std::uint8_t>(j.cut.free[v] & ~kWaits);
      if (same) continue;
      ++rebound, entries += b.count;
    }
    j.k.new_start[v] = static_cast<std::uint32_t>(j.k.new_knots.size());
    j.k.new_count[v] = static_cast<std::uint32_t>(b.count);
    j.k.new_knots.insert(j.k.new_knots.end(), b.knots.begin(), b.knots.begin() + b.count);
    j.k.new_weights.insert(j.k.new_weights.end(), b.weights.begin(), b.weights.begin() + b.count);
  }
  auto &start = j.k.binding_start, &knots = j.k.binding_knots;
  auto& weights = j.k.binding_weights;
  start.clear(), knots.clear(), weights.clear();
  start.push_back(0);
  for (std::uint32_t v = 0; v < j.cut.rest.size(); ++v) {
    const bool fresh = j.k.new_count[v] > 0;
    const auto& from_knots = fresh ? j.k.new_knots : skin.binding_knots;
    const auto& from_weights = fresh ? j.k.new_weights : skin.binding_weights;
    const std::uint32_t first = fresh ? j.k.new_start[v] : skin.binding_start[v];
    const std::uint32_t count = fresh ? j.k.new_count[v] : skin.binding_start[v + 1] - first;
    knots.insert(knots.end(), from_knots.begin() + first, from_knots.begin() + first + count);
    weights.insert(weights.end(), from_weights.begin() + first, from_weights.begin() + first + count);
    start.push_back(static_cast<std::uint32_t>(knots.size()));
    if (v >= old_vertices) {
      tell(j.delta.added_skin, j, v);
    } else if (fresh) {
      j.delta.rebound_vertices.push_back(v);
      tell(j.delta.rebound_skin, j, v);
    }
  }
  skin.binding_start.assign(start.begin(), start.end());
  skin.binding_knots.assign(knots.begin(), knots.end());
  skin.binding_weights.assign(weights.begin(), weights.end());
}

}  // namespace vest::scene
