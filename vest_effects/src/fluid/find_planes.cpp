#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

struct V3 {
  float x, y, z;
};
V3 operator-(V3 a, V3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
V3 operator+(V3 a, V3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
V3 operator*(float s, V3 a) {
  return {s * a.x, s * a.y, s * a.z};
}
float dot(V3 a, V3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
V3 cross(V3 a, V3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
V3 at(const float* p) {
  return {p[0], p[1], p[2]};
}
void put(V3 a, float* p) {
  p[0] = a.x, p[1] = a.y, p[2] = a.z;
}

/// Nearest point of a triangle by the regions of its corners and edges. @return true: inside the face
bool nearestWeights(V3 p, V3 a, V3 b, V3 c, float w[3]) {
  const V3 ab = b - a, ac = c - a, ap = p - a;
  const float d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return w[0] = 1, w[1] = 0, w[2] = 0, false;
  const V3 bp = p - b;
  const float d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return w[0] = 0, w[1] = 1, w[2] = 0, false;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    const float t = d1 - d3 > 0 ? d1 / (d1 - d3) : 0;
    return w[0] = 1 - t, w[1] = t, w[2] = 0, false;
  }
  const V3 cp = p - c;
  const float d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return w[0] = 0, w[1] = 0, w[2] = 1, false;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    const float t = d2 - d6 > 0 ? d2 / (d2 - d6) : 0;
    return w[0] = 1 - t, w[1] = 0, w[2] = t, false;
  }
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const float s = (d4 - d3) + (d5 - d6), t = s > 0 ? (d4 - d3) / s : 0;
    return w[0] = 0, w[1] = 1 - t, w[2] = t, false;
  }
  const float s = va + vb + vc;
  if (!(s > 0)) return w[0] = w[1] = w[2] = 1.0f / 3, false;
  w[1] = vb / s, w[2] = vc / s, w[0] = 1 - w[1] - w[2];
  return true;
}

/// Cells that a box covers; false where it is so big that something is wrong with it.
struct Box {
  int low[3], high[3];
  Box(const CellGrid& g, const float* lo, const float* hi) {
    for (int k = 0; k < 3; ++k) low[k] = g.coordinate(lo[k]), high[k] = g.coordinate(hi[k]);
  }
  bool sane() const { return high[0] - low[0] < 64 && high[1] - low[1] < 64 && high[2] - low[2] < 64; }
  template <class F>
  void each(const CellGrid& g, F&& f) const {
    for (int z = low[2]; z <= high[2]; ++z)
      for (int y = low[1]; y <= high[1]; ++y)
        for (int x = low[0]; x <= high[0]; ++x) f(g.cell(x, y, z));
  }
};

/// Cells through which a particle may touch something in this step.
template <class F>
void cellsOf(const ScratchData& s, std::size_t i, F&& f) {
  const float lo[3] = {std::min(s.px[i], s.place[i].a[0]), std::min(s.py[i], s.place[i].a[1]),
                       std::min(s.pz[i], s.place[i].a[2])};
  const float hi[3] = {std::max(s.px[i], s.place[i].a[0]), std::max(s.py[i], s.place[i].a[1]),
                       std::max(s.pz[i], s.place[i].a[2])};
  const Box box(s.tissue_grid, lo, hi);
  if (box.sane()) box.each(s.tissue_grid, f);
}

void placeTriangles(const Model& model, const Inputs& inputs, const State& state, ScratchData& s,
                    float reach) {
  std::size_t id = 0;
  s.placed_count = s.entry_count = 0;
  // What particles want, as a box too: most objects are far from all of them.
  float low[3] = {1e9f, 1e9f, 1e9f}, high[3] = {-1e9f, -1e9f, -1e9f};
  for (std::size_t i = 0; i < state.particles.count; ++i) {
    const float a[3] = {s.px[i], s.py[i], s.pz[i]};
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min({low[k], a[k], s.place[i].a[k]});
      high[k] = std::max({high[k], a[k], s.place[i].a[k]});
    }
  }
  const CellGrid& g = s.tissue_grid;
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    const float* const now = surface.positions;
    const float* const before =
        state.has_knots ? state.knots.data() + 3 * model.first_knot[k] : surface.positions;
    for (std::size_t t = 0; t < surface.triangle_count; ++t) {
      if (surface.alive && !surface.alive[t]) continue;
      const auto& knots = surface.triangles[t];
      if (std::max({knots[0], knots[1], knots[2]}) >= surface.knot_count) continue;
      const float *a = now + 3 * knots[0], *b = now + 3 * knots[1], *c = now + 3 * knots[2];
      float lo[3], hi[3];
      bool far = false;
      for (int axis = 0; axis < 3; ++axis) {
        lo[axis] = std::min({a[axis], b[axis], c[axis]}) - reach;
        hi[axis] = std::max({a[axis], b[axis], c[axis]}) + reach;
        far |= lo[axis] > high[axis] || hi[axis] < low[axis];
      }
      if (far) continue;
      const Box box(g, lo, hi);
      bool wanted = false;
      if (!box.sane()) continue;
      box.each(g, [&](std::uint32_t cell) { wanted |= s.wanted[cell] != 0; });
      if (!wanted || s.placed_count == s.placed.size()) continue;
      PlacedTriangle& p = s.placed[s.placed_count];
      const V3 n = cross(at(b) - at(a), at(c) - at(a));
      const float length = std::sqrt(dot(n, n));
      if (!(length > 1e-12f)) continue;
      put(at(a), p.p0), put(at(b), p.p1), put(at(c), p.p2);
      put(1.0f / length * n, p.normal);
      const float *a0 = before + 3 * knots[0], *b0 = before + 3 * knots[1], *c0 = before + 3 * knots[2];
      const V3 way = 1.0f / 3 * ((at(a) - at(a0)) + (at(b) - at(b0)) + (at(c) - at(c0)));
      put(way, p.travel);
      V3 nb = cross(at(b0) - at(a0), at(c0) - at(a0));
      const float lb = std::sqrt(dot(nb, nb));
      nb = lb > 1e-12f ? 1.0f / lb * nb : at(p.normal);
      put(nb, p.before);
      p.before[3] = dot(nb, at(a0));
      p.surface = static_cast<std::uint16_t>(k);
      p.index = static_cast<std::uint32_t>(t);
      p.id = static_cast<std::uint32_t>(id + t);
      ++s.placed_count;
    }
    id += model.surfaces[k].triangles;
  }
  // By cell, counted first.
  auto& start = s.tissue_grid.start;
  std::fill(start.begin(), start.end(), 0u);
  const auto boxOf = [&](const PlacedTriangle& p) {
    float lo[3], hi[3];
    for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = std::min({p.p0[axis], p.p1[axis], p.p2[axis]}) - reach;
      hi[axis] = std::max({p.p0[axis], p.p1[axis], p.p2[axis]}) + reach;
    }
    return Box(g, lo, hi);
  };
  for (std::size_t j = 0; j < s.placed_count; ++j) {
    boxOf(s.placed[j]).each(g, [&](std::uint32_t cell) {
      if (s.wanted[cell] && s.entry_count < s.entries.size()) ++start[cell + 2], ++s.entry_count;
    });
  }
  for (std::size_t cell = 2; cell < start.size(); ++cell) start[cell] += start[cell - 1];
  std::size_t filled = 0;
  for (std::size_t j = 0; j < s.placed_count; ++j) {
    boxOf(s.placed[j]).each(g, [&](std::uint32_t cell) {
      if (s.wanted[cell] && filled < s.entry_count)
        s.entries[start[cell + 1]++] = static_cast<std::uint32_t>(j), ++filled;
    });
  }
}

/// What one candidate means for a particle. @return false: nothing
bool examine(const ScratchData& s, std::size_t i, std::uint32_t index, float reach, float skin, Plane& plane,
             bool& face) {
  const PlacedTriangle& t = s.placed[index];
  const V3 x{s.place[i].a[0], s.place[i].a[1], s.place[i].a[2]}, n = at(t.normal), a = at(t.p0);
  const float d_now = dot(n, x - a);
  if (d_now > reach) return false;
  const V3 p{s.px[i], s.py[i], s.pz[i]};
  const float d_before = dot(at(t.before), p) - t.before[3];
  const auto keep = [&](V3 normal, V3 point, float distance) {
    put(normal, plane.normal);
    plane.offset = dot(normal, point);
    plane.distance = distance;
    plane.placed = index;
    return true;
  };
  if (d_now < 0 && d_before > -skin) {  // the sign of n·a before and after
    const V3 from = p + at(t.travel);
    const float d_from = dot(n, from - a), share = d_from > 0 ? d_from / (d_from - d_now) : 0.0f;
    const V3 hit = from + share * (x - from);
    if (nearestWeights(hit, a, at(t.p1), at(t.p2), plane.weights)) {
      face = true;
      return keep(n, a, d_now);
    }
  }
  if (d_now < -skin) return false;
  face = nearestWeights(x, a, at(t.p1), at(t.p2), plane.weights);
  const V3 c = plane.weights[0] * a + plane.weights[1] * at(t.p1) + plane.weights[2] * at(t.p2);
  const V3 way = x - c;
  const float distance = std::sqrt(dot(way, way));
  if (distance > reach) return false;
  if (face || d_now <= 0 || distance < 1e-6f) return (face || d_now >= 0) && keep(n, c, d_now);
  return keep(1.0f / distance * way, c, distance);
}

}  // namespace

void findPlanes(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  const std::size_t n = state.particles.count;
  std::fill_n(s.plane_count.begin(), n, std::uint8_t{0});
  if (n == 0 || inputs.surface_count == 0) return;
  const float reach = 0.75f * model.h, skin = static_cast<float>(model.parameters.spacing);
  std::fill(s.wanted.begin(), s.wanted.end(), std::uint8_t{0});
  for (std::size_t i = 0; i < n; ++i) cellsOf(s, i, [&](std::uint32_t cell) { s.wanted[cell] = 1; });
  placeTriangles(model, inputs, state, s, reach);
  const float inverse_dt = static_cast<float>(1.0 / inputs.dt);
  for (std::size_t i = 0; i < n; ++i) {
    Plane* const kept = s.planes.data() + i * kMostPlanes;
    int count = 0;
    Plane nearest{}, plane{};
    nearest.distance = 1e9f;
    bool nearest_face = false;
    const auto add = [&](const Plane& candidate) {
      for (int k = 0; k < count; ++k) {
        if (dot(at(kept[k].normal), at(candidate.normal)) < 0.95f) continue;
        if (candidate.distance < kept[k].distance) kept[k] = candidate;
        return;
      }
      if (count < kMostPlanes) {
        kept[count++] = candidate;
        return;
      }
      int worst = 0;
      for (int k = 1; k < count; ++k)
        if (kept[k].distance > kept[worst].distance) worst = k;
      if (candidate.distance < kept[worst].distance) kept[worst] = candidate;
    };
    cellsOf(s, i, [&](std::uint32_t cell) {
      for (std::uint32_t e = s.tissue_grid.start[cell]; e < s.tissue_grid.start[cell + 1]; ++e) {
        bool face = false;
        if (!examine(s, i, s.entries[e], reach, skin, plane, face)) continue;
        if (std::fabs(plane.distance) < std::fabs(nearest.distance)) nearest = plane, nearest_face = face;
        if (face) add(plane);
      }
    });
    // Edges and corners count only where nothing is nearer: else every edge of a flat floor would be a bump.
    if (nearest.distance < 1e8f && !nearest_face) add(nearest);
    for (int k = 0; k < count; ++k) {
      const PlacedTriangle& t = s.placed[kept[k].placed];
      for (int axis = 0; axis < 3; ++axis) kept[k].velocity[axis] = t.travel[axis] * inverse_dt;
    }
    s.plane_count[i] = static_cast<std::uint8_t>(count);
  }
}

}  // namespace vest::fluid
