#include <algorithm>
#include <cmath>

#include "scratch.h"
#include "triangle.h"

namespace vest::fluid {
namespace {

constexpr float kSlack =
    0.0005f;  ///< m: so far may knots move before their blocks' boxes are made anew (tuned)

bool stayed(const float* now, const float* then, std::size_t count) {
  int moved = 0;
  for (std::size_t i = 0; i < count; ++i) moved |= !(std::fabs(now[i] - then[i]) <= kSlack);
  return moved == 0;
}

/// Brings a surface's boxes up to date. They hold what its triangles occupy, and kSlack more; what is found
/// with them does not depend on when they were made.
void refit(const Surface& surface, SurfaceBlocks& b) {
  if (surface.still && b.knots == surface.knot_count && b.triangles == surface.triangle_count) return;
  const bool same_mesh =
      b.knots == surface.knot_count && b.triangles == surface.triangle_count &&
      std::equal(b.corners.begin(), b.corners.begin() + static_cast<std::ptrdiff_t>(b.triangles),
                 surface.triangles);
  if (same_mesh && stayed(surface.positions, b.positions.data(), 3 * b.knots)) return;
  b.knots = surface.knot_count, b.triangles = surface.triangle_count;
  std::copy_n(surface.positions, 3 * b.knots, b.positions.data());
  std::copy_n(surface.triangles, b.triangles, b.corners.data());
  b.whole = {};
  for (std::size_t block = 0; block * kTriangleBlock < b.triangles; ++block) {
    Extent& box = b.boxes[block];
    box = {};
    for (std::size_t t = block * kTriangleBlock; t < std::min(b.triangles, (block + 1) * kTriangleBlock); ++t)
      for (const std::uint32_t knot : b.corners[t])
        if (knot < b.knots) box.add(surface.positions + 3 * knot);
    box.grow(kSlack);
    b.whole.add(box.low), b.whole.add(box.high);
  }
}

/// A triangle as the search needs it. @return false where it is gone or has no area
bool place(const Model& model, const Surface& surface, const State& state, std::size_t k, std::size_t t,
           float reach, std::size_t j, ScratchData& s) {
  if (t >= surface.triangle_count || (surface.alive && !surface.alive[t])) return false;
  const auto& knots = surface.triangles[t];
  if (std::max({knots[0], knots[1], knots[2]}) >= surface.knot_count) return false;
  const float* const now = surface.positions;
  const float* const before =
      state.has_knots ? state.knots.data() + 3 * model.first_knot[k] : surface.positions;
  const V3 a = at(now + 3 * knots[0]), b = at(now + 3 * knots[1]), c = at(now + 3 * knots[2]);
  const V3 n = cross(b - a, c - a);
  const float size = length(n);
  if (!(size > 1e-12f)) return false;
  PlacedTriangle& p = s.placed[j];
  put(a, p.p0), put(b, p.p1), put(c, p.p2);
  put(1.0f / size * n, p.normal);
  const V3 a0 = at(before + 3 * knots[0]), b0 = at(before + 3 * knots[1]), c0 = at(before + 3 * knots[2]);
  const V3 way = 1.0f / 3 * ((a - a0) + (b - b0) + (c - c0));
  put(way, p.travel);
  const V3 nb = cross(b0 - a0, c0 - a0);
  const float lb = length(nb);
  put(lb > 1e-12f ? 1.0f / lb * nb : at(p.normal), p.before);
  p.before[3] = dot(at(p.before), a0);
  p.box = {};
  p.box.add(p.p0), p.box.add(p.p1), p.box.add(p.p2);
  p.box.grow(reach);
  p.surface = static_cast<std::uint16_t>(k);
  p.index = static_cast<std::uint32_t>(t);
  const V3 m = 1.0f / 3 * (a + b + c);
  const float r2 = std::max({dot(a - m, a - m), dot(b - m, b - m), dot(c - m, c - m)});
  s.ball[j] = {{m.x, m.y, m.z, std::sqrt(r2) + reach + length(way)}};
  s.facing[j] = {{p.normal[0], p.normal[1], p.normal[2], dot(at(p.normal), a)}};
  s.was[j] = {{p.before[0], p.before[1], p.before[2], p.before[3]}};
  return true;
}

}  // namespace

void nearBlocks(const Inputs& inputs, const Extent& particles, ScratchData& s, float reach) {
  s.near_count = s.block_count = 0;
  const auto push = [&](const Extent& box) {
    for (int axis = 0; axis < 3; ++axis)
      s.low[axis][s.block_count] = box.low[axis], s.high[axis][s.block_count] = box.high[axis];
    s.slot[s.block_count++] = 0;
  };
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    if (surface.triangle_count == 0) continue;
    SurfaceBlocks& from = s.surfaces[k];
    refit(surface, from);
    NearSurface n;
    n.surface = k, n.first = s.block_count, n.whole = from.whole;
    n.whole.grow(reach);
    if (!n.whole.meets(particles)) continue;
    for (std::size_t b = 0; b * kTriangleBlock < from.triangles; ++b) {
      Extent box = from.boxes[b];
      box.grow(reach);
      push(box);
    }
    while (s.block_count % 8 != 0) push(Extent{});
    n.last = s.block_count;
    s.near[s.near_count++] = n;
  }
}

void placeTriangles(const Model& model, const Inputs& inputs, const State& state, ScratchData& s,
                    float reach) {
  s.placed_blocks = 0;
  for (std::size_t near = 0; near < s.near_count; ++near) {
    const NearSurface& n = s.near[near];
    std::size_t id = 0;
    for (std::size_t k = 0; k < n.surface; ++k) id += model.surfaces[k].triangles;
    for (std::size_t block = n.first; block < n.last; ++block) {
      if (s.slot[block] == 0) continue;
      const std::size_t slot = s.placed_blocks++;
      s.slot[block] = static_cast<std::uint32_t>(slot + 1);
      for (std::size_t lane = 0; lane < kTriangleBlock; ++lane) {
        const std::size_t t = (block - n.first) * kTriangleBlock + lane, j = slot * kTriangleBlock + lane;
        if (place(model, inputs.surfaces[n.surface], state, n.surface, t, reach, j, s)) {
          s.placed[j].id = static_cast<std::uint32_t>(id + t);
        } else {
          s.ball[j] = {{1e9f, 1e9f, 1e9f, 0}};  // out of everyone's way
        }
      }
    }
  }
}

}  // namespace vest::fluid
