#include <limits>

#include "cut_job.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::CutFace;
using interaction::CutTrack;
using interaction::kNone;

constexpr std::size_t kMostAtVertex = 64;  ///< skin triangles around a vertex that are looked at
constexpr std::size_t kWallsPerStep = 48;  ///< triangles of the inner wall that a step builds (tuned)
/// Vertices that a step adds. Of each the binding has six entries at most: the room of a delta.
constexpr std::size_t kDoublesPerStep = 440;
static_assert(kDoublesPerStep <= kDeltaVertices && 6 * kDoublesPerStep <= kDeltaEntries);
constexpr double kGreatestWallReach = 0.012;  ///< m: how far from the cut the inner wall is built (tuned)

interaction::Vector3Floats toFloats(const Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// Place on a track nearest to a point.
Vector3d nearestOn(const CutTrack& track, const Vector3d& p) {
  const Vector3d a = toVector(track.from), way = toVector(track.to) - a;
  const double squared = way.squaredNorm();
  const double t = squared > 0.0 ? std::clamp((p - a).dot(way) / squared, 0.0, 1.0) : 0.0;
  return a + t * way;
}
const CutTrack* nearestTrack(const CutJob& j, const Vector3d& p, double reach, Vector3d& place) {
  const CutTrack* best = nullptr;
  double least = reach * reach;
  for (const CutTrack& track : j.cut.tracks) {
    const Vector3d q = nearestOn(track, p);
    const double distance = (q - p).squaredNorm();
    if (distance < least) least = distance, best = &track, place = q;
  }
  return best;
}

Vector3d skinCentroid(const CutJob& j, std::uint32_t triangle) {
  const auto& t = j.s.topology.skin.triangles[triangle];
  return (toVector(j.cut.rest[t[0]]) + toVector(j.cut.rest[t[1]]) + toVector(j.cut.rest[t[2]])) / 3.0;
}

/// The line runs along edges of contact triangles, the blade through them: skin beyond the blade's track
/// moves its home to the other side, so that it opens where the blade was.
void settleTracks(CutJob& j) {
  for (CutTrack& track : j.cut.tracks) {
    if (track.settled != 0) continue;
    const std::uint32_t own = track.triangle;
    const auto& corners = j.s.triangles[own];
    const auto isCorner = [&](std::uint32_t k) {
      return corners[0] == k || corners[1] == k || corners[2] == k;
    };
    const auto onLine = [&](std::uint32_t k) {
      return j.k.version_of[k] == j.k.version_of[track.knots[0]] ||
             j.k.version_of[k] == j.k.version_of[track.knots[1]];
    };
    // Triangles of the other side: around a version of the line's knots that is not this triangle's.
    std::array<std::uint32_t, kMostAtVertex> others;
    std::size_t count = 0;
    for (std::uint32_t knot = 0; knot < j.s.block.knots(); ++knot) {
      if (!onLine(knot) || isCorner(knot)) continue;
      for (const std::uint32_t* t = j.begin(knot); t != j.end(knot) && count < others.size(); ++t)
        others[count++] = *t;
    }
    if (count == 0) continue;  // not open yet
    track.settled = 1;
    Vector3d inside = Vector3d::Zero();
    double parts = 0.0;
    for (const std::uint32_t k : corners)
      if (!onLine(k)) inside += j.rest(k), parts += 1.0;
    if (!(parts > 0.0)) continue;
    const Vector3d from = toVector(track.from), along = toVector(track.to) - from;
    const Vector3d across = along.cross(j.normal(own));
    const double side = across.dot(inside / parts - from);
    for (std::uint32_t st = 0; st < j.cut.home.size(); ++st) {
      if (j.cut.home[st] != own || j.s.topology.triangle_alive[st] == 0) continue;
      const Vector3d middle = skinCentroid(j, st);
      if (across.dot(middle - from) * side >= 0.0) continue;
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < count; ++i) {
        const double distance = (j.centroid(others[i]) - middle).squaredNorm();
        if (distance < least) least = distance, j.cut.home[st] = others[i];
      }
      j.k.near_triangle[j.cut.home[st]] = 1;
    }
    j.k.near_triangle[own] = 1;
  }
}

void renewVertexTriangles(CutJob& j) {
  const Skin& skin = j.s.topology.skin;
  const std::size_t vertices = j.cut.rest.size();  // those of this step too
  auto& start = j.k.vertex_start;
  std::fill_n(start.begin(), vertices + 2, 0u);
  const auto counts = [&](std::size_t t) {
    return j.s.topology.triangle_alive[t] != 0 && j.cut.home[t] != kNone;
  };
  for (std::size_t t = 0; t < skin.triangles.size(); ++t)
    if (counts(t))
      for (const std::uint32_t v : skin.triangles[t]) ++start[v + 2];
  for (std::size_t i = 2; i < vertices + 2; ++i) start[i] += start[i - 1];
  for (std::uint32_t t = 0; t < skin.triangles.size(); ++t)
    if (counts(t))
      for (const std::uint32_t v : skin.triangles[t]) j.k.vertex_triangles[start[v + 1]++] = t;
}

/// Contact triangles that are joined by at most two others: not across a cut.
bool joined(const CutJob& j, std::uint32_t from, std::uint32_t to) {
  std::array<std::uint32_t, 48> seen;
  std::size_t count = 0, first = 0;
  seen[count++] = from;
  for (int step = 0; step <= 3; ++step) {
    const std::size_t last = count;
    for (std::size_t i = first; i < last; ++i) {
      if (seen[i] == to) return true;
      if (step == 3) continue;
      const auto& t = j.s.triangles[seen[i]];
      for (std::size_t e = 0; e < 3; ++e) {
        const std::uint32_t a = t[e], b = t[(e + 1) % 3];
        for (const std::uint32_t* n = j.begin(a); n != j.end(a); ++n) {
          const auto& o = j.s.triangles[*n];
          if (*n == seen[i] || (o[0] != b && o[1] != b && o[2] != b)) continue;
          if (count < seen.size() &&
              std::find(seen.begin(), seen.begin() + count, *n) == seen.begin() + count)
            seen[count++] = *n;
        }
      }
    }
    first = last;
  }
  return false;
}

/// Room for one vertex more, in this delta and in the skin.
bool roomForVertex(const CutJob& j) {
  return j.cut.rest.size() < j.constants.most_vertices &&
         j.cut.rest.size() + 1 - (j.s.topology.skin.binding_start.size() - 1) <= kDoublesPerStep;
}

/// A vertex like another one; its binding follows (bindSkin).
std::uint32_t addVertex(CutJob& j, std::uint32_t like, const Vector3d& rest, double u_offset) {
  auto uv = j.s.topology.skin.texture_coordinates[like];
  uv[0] += static_cast<float>(u_offset);
  j.s.topology.skin.texture_coordinates.push_back(uv);
  j.delta.added_skin.texture_coordinates.push_back(uv);
  j.cut.rest.push_back(toFloats(rest));
  j.cut.lies_on.push_back(j.cut.lies_on[like]);
  j.cut.free.push_back(interaction::kFree);
  j.cut.outer.push_back(kNone), j.cut.inner.push_back(kNone), j.cut.wall.push_back(kNone);
  return static_cast<std::uint32_t>(j.cut.rest.size() - 1);
}

/// Doubles skin vertices whose triangles lie on different sides. Fills k.skin_now and k.border.
void doubleVertices(CutJob& j) {
  const Skin& skin = j.s.topology.skin;
  const std::uint32_t vertices = static_cast<std::uint32_t>(skin.binding_start.size() - 1);
  j.k.skin_now.assign(skin.triangles.begin(), skin.triangles.end());
  std::fill(j.k.border.begin(), j.k.border.end(), std::uint8_t{0});
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::uint32_t* const first = j.k.vertex_triangles.data() + j.k.vertex_start[v];
    const std::size_t count =
        std::min<std::size_t>(j.k.vertex_start[v + 1] - j.k.vertex_start[v], kMostAtVertex);
    bool near = false, same = true;
    for (std::size_t i = 0; i < count; ++i) {
      near = near || j.k.near_triangle[j.cut.home[first[i]]] != 0;
      same = same && j.cut.home[first[i]] == j.cut.home[first[0]];
    }
    if (!near || same) continue;
    std::array<std::uint8_t, kMostAtVertex> group;
    for (std::size_t i = 0; i < count; ++i) group[i] = static_cast<std::uint8_t>(i);
    const auto root = [&](std::uint8_t i) {
      while (group[i] != i) i = group[i];
      return i;
    };
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = a + 1; b < count; ++b) {
        const auto &ta = skin.triangles[first[a]], &tb = skin.triangles[first[b]];
        int shared = 0;
        for (const std::uint32_t x : ta) shared += tb[0] == x || tb[1] == x || tb[2] == x;
        if (shared < 2) continue;
        const std::uint8_t ra = root(static_cast<std::uint8_t>(a)), rb = root(static_cast<std::uint8_t>(b));
        if (ra != rb && joined(j, j.cut.home[first[a]], j.cut.home[first[b]]))
          group[std::max(ra, rb)] = std::min(ra, rb);
      }
    }
    std::array<std::uint8_t, kMostAtVertex> size{};
    for (std::size_t i = 0; i < count; ++i) ++size[root(static_cast<std::uint8_t>(i))];
    const std::uint8_t keeps =
        static_cast<std::uint8_t>(std::max_element(size.begin(), size.begin() + count) - size.begin());
    for (std::uint8_t g = 0; g < count; ++g) {
      if (size[g] == 0 || g == keeps || root(g) != g) continue;
      if (!roomForVertex(j)) {
        j.cut.exhausted = true;
        return;
      }
      const std::uint32_t copy = addVertex(j, v, toVector(j.cut.rest[v]), 0.0);
      j.k.border[v] = j.k.border[copy] = 1;
      for (std::size_t i = 0; i < count; ++i) {
        if (root(static_cast<std::uint8_t>(i)) != g) continue;
        auto& t = j.k.skin_now[first[i]];
        std::replace(t.begin(), t.end(), v, copy);
      }
    }
  }
}

/// Both lips of the cut lie on the blade's track.
void placeBorder(CutJob& j) {
  const double reach = 1.5 * j.constants.skin_edge;
  for (std::uint32_t v = 0; v < j.cut.rest.size(); ++v) {
    if (j.k.border[v] == 0) continue;
    j.cut.free[v] |= interaction::kFree;
    const Vector3d x = toVector(j.cut.rest[v]);
    Vector3d place;
    const CutTrack* const track = nearestTrack(j, x, reach, place);
    if (track == nullptr) continue;
    Vector3d n = j.normal(track->triangle);
    const double length = std::sqrt(n.squaredNorm());
    if (!(length > 0.0)) continue;
    n /= length;
    j.cut.rest[v] = toFloats(place + n * n.dot(x - place));  // within the surface
  }
}

/// Room for some triangles in place of as many.
bool roomForTriangles(const CutJob& j, std::size_t count) {
  return j.s.topology.skin.triangles.size() + count <= j.constants.most_triangles &&
         j.delta.added_triangles.size() + count <= kDeltaTriangles &&
         j.delta.removed_triangles.size() + count <= kDeltaTriangles;
}

std::uint32_t addTriangle(CutJob& j, const std::array<std::uint32_t, 3>& t, std::uint16_t layer,
                          std::uint32_t home, std::uint8_t open) {
  Topology& topology = j.s.topology;
  topology.skin.triangles.push_back(t);
  topology.skin.layer.push_back(layer);
  topology.triangle_alive.push_back(1);
  j.cut.home.push_back(home);
  j.cut.open.push_back(open);
  j.delta.added_triangles.push_back(t);
  j.delta.added_triangle_layer.push_back(layer);
  return static_cast<std::uint32_t>(topology.skin.triangles.size() - 1);
}
void removeTriangle(CutJob& j, std::uint32_t t) {
  j.s.topology.triangle_alive[t] = 0;
  j.delta.removed_triangles.push_back(t);
}

/// Triangles with new corners: the old one dies, a new one is added.
void commitTriangles(CutJob& j) {
  const std::size_t count = j.k.skin_now.size();
  for (std::uint32_t t = 0; t < count; ++t) j.k.moved[t] = t;
  bool any = false;
  for (std::uint32_t t = 0; t < count; ++t) {
    if (j.k.skin_now[t] == j.s.topology.skin.triangles[t]) continue;
    if (!roomForTriangles(j, 1)) {
      j.cut.exhausted = true;
      break;
    }
    any = true;
    removeTriangle(j, t);
    const std::uint16_t layer =
        j.s.topology.skin.layer.empty() ? std::uint16_t{0} : j.s.topology.skin.layer[t];
    j.k.moved[t] = addTriangle(j, j.k.skin_now[t], layer, j.cut.home[t], j.cut.open[t]);
  }
  if (!any) return;
  for (CutFace& f : j.cut.faces)
    if (f.skin_triangle < count) f.skin_triangle = j.k.moved[f.skin_triangle];
}

/// Half of the organ's least thickness along the cut, within a distance of a place (m). Where the skin's own
/// triangles are as large as that distance, the distance.
double halfThickness(const CutJob& j, const Vector3d& x, double within) {
  double least = within;
  if (within <= 2.0 * j.constants.skin_edge) return least;
  for (const CutTrack& track : j.cut.tracks) {
    const std::uint32_t other = j.constants.opposite[track.triangle];
    if (other == kNone || (nearestOn(track, x) - x).squaredNorm() > within * within) continue;
    const Vector3d n = j.normal(track.triangle);
    const double squared = n.squaredNorm();
    if (!(squared > 0.0)) continue;
    const Vector3d through = j.centroid(other) - j.centroid(track.triangle);
    least = std::min(least, 0.5 * std::fabs(n.dot(through)) / std::sqrt(squared));
  }
  return least;
}

/// Where the tissue under a skin vertex ends, at rest: the wall's thickness below, or half way through.
Vector3d below(const CutJob& j, std::uint32_t v, double& depth) {
  const Vector3d x = toVector(j.cut.rest[v]);
  const std::uint32_t own = j.cut.lies_on[v], other = acrossOrgan(j, own);
  Vector3d n = j.normal(own);
  const double length = std::sqrt(n.squaredNorm());
  depth = j.constants.wall;
  if (!(length > 0.0)) return x;
  n /= length;
  if (other == kNone) return x - depth * n;
  Vector3d through = j.centroid(other) - j.centroid(own);
  if (j.constants.hollow) {
    depth = std::min(depth, 0.4 * std::fabs(n.dot(through)));
    return x - depth * n;
  }
  Vector3d place;
  const CutTrack* const track = nearestTrack(j, x, 2.0 * j.constants.skin_edge, place);
  if (track != nullptr) {  // within the cut
    Vector3d m = (toVector(track->to) - toVector(track->from)).cross(j.normal(track->triangle));
    const double squared = m.squaredNorm();
    if (squared > 0.0) through -= m * (m.dot(through) / squared);
  }
  depth = 0.5 * std::sqrt(through.squaredNorm());
  const double thin = halfThickness(j, x, depth);
  if (thin >= 0.5 * depth) return x + 0.5 * through;
  // The narrow side of a flat section: faces to its very middle would stick out of a leaf that bends.
  through *= thin / depth;
  depth = thin;
  return x + 0.5 * through;
}

bool ensureDouble(CutJob& j, std::uint32_t v, std::vector<std::uint32_t>& of, bool under) {
  if (of[v] != kNone) return true;
  if (!roomForVertex(j)) return false;
  double depth = 0.0;
  const Vector3d place = under ? below(j, v, depth) : toVector(j.cut.rest[v]);
  const std::uint32_t added = addVertex(j, v, place, depth);
  of[v] = added;
  return true;
}

/// Edges of the skin that lost their neighbour get a face of the cut.
void addFaces(CutJob& j) {
  const Skin& skin = j.s.topology.skin;
  const std::uint32_t triangles = static_cast<std::uint32_t>(skin.triangles.size());
  for (std::uint32_t t = 0; t < triangles; ++t) {
    if (j.s.topology.triangle_alive[t] == 0 || j.cut.home[t] == kNone) continue;
    const auto& corners = skin.triangles[t];
    if ((j.k.border[corners[0]] | j.k.border[corners[1]] | j.k.border[corners[2]]) == 0) continue;
    for (std::uint8_t e = 0; e < 3; ++e) {
      if (j.cut.open[t] >> e & 1u) continue;
      const std::uint32_t u = corners[e], v = corners[(e + 1u) % 3];
      bool partner = false;
      for (std::uint32_t n = j.k.vertex_start[u]; n < j.k.vertex_start[u + 1] && !partner; ++n) {
        const std::uint32_t o = j.k.vertex_triangles[n];
        partner =
            o != t && (skin.triangles[o][0] == v || skin.triangles[o][1] == v || skin.triangles[o][2] == v);
      }
      if (partner) continue;
      const bool known = std::any_of(j.cut.faces.begin(), j.cut.faces.end(),
                                     [&](const CutFace& f) { return f.skin_triangle == t && f.edge == e; });
      if (known) continue;
      if (j.cut.faces.size() == j.cut.faces.capacity() || !ensureDouble(j, u, j.cut.outer, false) ||
          !ensureDouble(j, v, j.cut.outer, false) || !ensureDouble(j, u, j.cut.inner, true) ||
          !ensureDouble(j, v, j.cut.inner, true)) {
        j.cut.exhausted = true;
        return;
      }
      j.cut.faces.push_back({t, e, {kNone, kNone}});
    }
  }
}

/// The inner wall of a hollow organ, as far as one sees it through the cut; some triangles a step.
void addWalls(CutJob& j) {
  j.cut.unfinished = false;
  if (!j.constants.hollow || j.cut.faces.empty()) return;
  const Skin& skin = j.s.topology.skin;
  std::fill(j.k.walled.begin(), j.k.walled.end(), std::uint8_t{0});
  for (const CutFace& f : j.cut.faces)
    if (f.edge == 3) j.k.walled[f.skin_triangle] = 1;
  std::size_t built = 0;
  for (std::uint32_t t = 0; t < skin.triangles.size(); ++t) {
    if (j.s.topology.triangle_alive[t] == 0 || j.cut.home[t] == kNone || j.k.walled[t] != 0) continue;
    const std::uint32_t own = j.cut.home[t], other = acrossOrgan(j, own);
    if (other == kNone) continue;
    const double wide = std::sqrt((j.centroid(other) - j.centroid(own)).squaredNorm());
    const double reach = std::min(kGreatestWallReach, 2.5 * wide);
    Vector3d place;
    if (nearestTrack(j, skinCentroid(j, t), reach, place) == nullptr) continue;
    const auto& v = skin.triangles[t];
    if (built == kWallsPerStep) {
      j.cut.unfinished = true;
      return;
    }
    if (j.cut.faces.size() == j.cut.faces.capacity() || !ensureDouble(j, v[0], j.cut.wall, true) ||
        !ensureDouble(j, v[1], j.cut.wall, true) || !ensureDouble(j, v[2], j.cut.wall, true)) {
      return;  // no room: one sees a little less of the inside
    }
    j.cut.faces.push_back({t, 3, {kNone, kNone}});
    ++built;
  }
}

/// Brings every face's triangles up to the skin that they belong to.
void buildFaces(CutJob& j) {
  Skin& skin = j.s.topology.skin;
  for (CutFace& f : j.cut.faces) {
    const auto& t = skin.triangles[f.skin_triangle];
    std::array<std::array<std::uint32_t, 3>, 2> wanted;
    if (f.edge == 3) {
      const auto& w = j.cut.wall;
      if (!ensureDouble(j, t[0], j.cut.wall, true) || !ensureDouble(j, t[1], j.cut.wall, true) ||
          !ensureDouble(j, t[2], j.cut.wall, true))
        continue;
      wanted = {{{w[t[0]], w[t[2]], w[t[1]]}, {w[t[0]], w[t[2]], w[t[1]]}}};
    } else {
      const std::uint32_t u = t[f.edge], v = t[(f.edge + 1u) % 3];
      if (!ensureDouble(j, u, j.cut.outer, false) || !ensureDouble(j, v, j.cut.outer, false) ||
          !ensureDouble(j, u, j.cut.inner, true) || !ensureDouble(j, v, j.cut.inner, true))
        continue;
      const std::uint32_t uo = j.cut.outer[u], vo = j.cut.outer[v], ui = j.cut.inner[u], vi = j.cut.inner[v];
      wanted = {{{vo, uo, ui}, {vo, ui, vi}}};
    }
    const bool built = f.built[0] != kNone;
    if (built && skin.triangles[f.built[0]] == wanted[0] && skin.triangles[f.built[1]] == wanted[1]) continue;
    if (!roomForTriangles(j, 2)) {
      j.cut.exhausted = true;
      return;
    }
    if (built) {
      removeTriangle(j, f.built[0]);
      if (f.built[1] != f.built[0]) removeTriangle(j, f.built[1]);
    }
    const std::uint16_t layer = f.edge == 3 ? 1 : 2;
    f.built[0] = addTriangle(j, wanted[0], layer, kNone, 0);
    f.built[1] = f.edge == 3 ? f.built[0] : addTriangle(j, wanted[1], layer, kNone, 0);
  }
}

/// Each vertex near the cut hangs on a contact triangle of its own side; its doubles go with it.
void renewPlaces(CutJob& j) {
  std::fill(j.k.candidate.begin(), j.k.candidate.end(), std::uint8_t{0});
  const Skin& skin = j.s.topology.skin;
  for (std::uint32_t t = 0; t < skin.triangles.size(); ++t) {
    if (j.s.topology.triangle_alive[t] == 0 || j.cut.home[t] == kNone ||
        j.k.near_triangle[j.cut.home[t]] == 0)
      continue;
    for (const std::uint32_t v : skin.triangles[t]) {
      if (j.k.candidate[v] != 0) continue;
      j.k.candidate[v] = 1;
      j.cut.lies_on[v] = j.cut.home[t];
    }
  }
  for (std::uint32_t v = 0; v < j.cut.rest.size(); ++v) {
    if (j.k.candidate[v] == 0) continue;
    double depth;
    for (const std::uint32_t d : {j.cut.outer[v], j.cut.inner[v], j.cut.wall[v]}) {
      if (d == kNone) continue;
      j.cut.lies_on[d] = j.cut.lies_on[v];
      j.cut.rest[d] = d == j.cut.outer[v] ? j.cut.rest[v] : toFloats(below(j, v, depth));
      j.k.candidate[d] = 1;
    }
  }
}

}  // namespace

void removeTornSkin(CutJob& j) {
  for (std::uint32_t t = 0; t < j.s.topology.skin.triangles.size(); ++t) {
    const std::uint32_t home = j.cut.home[t];
    if (j.s.topology.triangle_alive[t] == 0 || home == kNone || j.s.triangle_alive[home] != 0) continue;
    if (j.delta.removed_triangles.size() == kDeltaTriangles) {
      j.cut.unfinished = true;
      return;
    }
    removeTriangle(j, t);
  }
}

void openSkin(CutJob& j) {
  Skin& skin = j.s.topology.skin;
  if (skin.triangles.empty() || skin.binding_start.size() < 2) return;
  const std::size_t vertices = skin.binding_start.size() - 1;
  std::fill(j.k.near_triangle.begin(), j.k.near_triangle.end(), std::uint8_t{0});
  // All along the cut: what hung together round its end a step ago does so no more.
  if (j.divided) {
    for (const CutTrack& track : j.cut.tracks)
      for (const std::uint32_t knot : track.knots) j.k.near_knot[j.k.version_of[knot]] |= 4;
    for (std::uint32_t t = 0; t < j.s.triangles.size(); ++t)
      for (const std::uint32_t knot : j.s.triangles[t])
        if (j.k.near_knot[j.k.version_of[knot]] & 4) j.k.near_triangle[t] = 1;
    for (std::uint32_t knot = 0; knot < j.s.block.knots(); ++knot) j.k.near_knot[knot] &= 3;
  }
  if (j.divided) {
    settleTracks(j);
    renewVertexTriangles(j);
    doubleVertices(j);
    placeBorder(j);
    commitTriangles(j);
    renewVertexTriangles(j);
  }
  renewPlaces(j);
  if (j.divided) addFaces(j);
  addWalls(j);
  buildFaces(j);
  removeTornSkin(j);  // what the tear's own delta had no room for
  std::sort(j.delta.removed_triangles.begin(), j.delta.removed_triangles.end());
  bindSkin(j, vertices);
}

}  // namespace vest::scene
