// The kernel's loop, once for all levels: V is a pack of eight floats with correctly rounded operations.
// Included by one translation unit per level; not a public header.
#pragma once

#include "vest_tissue/net/elements.h"
#include "vest_tissue/net/link_kernel.h"

namespace vest::net::kernel {

// Shortest length that counts, m: keeps 0/0 out where two knots coincide or a padded lane reads anything.
inline constexpr float kShortest = 1e-12f;

template <class V>
struct Force {
  V x, y, z;
};

/// @tparam kStraight the law is linear (a2 = a3 = a4 = 0): the same bits with fewer operations
template <class V, bool kStraight>
inline Force<V> linkForce(const LinkTable::Block& b, const LinkTable::LawConstants& c, V dx, V dy, V dz, V ux,
                          V uy, V uz) {
  const V square = max(dx * dx + dy * dy + dz * dz, V::broadcast(kShortest * kShortest));
  const V length = sqrt(square);
  const V inverse = V::broadcast(1.0f) / length;
  const V strain = (length - V::load(b.rest)) * V::load(b.inverse_rest);
  V stress = strain;  // over E
  if constexpr (!kStraight) {
    // eps + (a2·eps^2 + a3·eps^3 + a4·eps^4) inside, the slope at max_strain beyond; in short chains, because
    // waiting for a result costs more here than an operation.
    const V zero = V::broadcast(0.0f), most = V::broadcast(c.max_strain);
    const V inside = min(max(strain, zero), most), beyond = max(strain, most) - most;
    const V inside2 = inside * inside;
    const V higher =
        (V::broadcast(c.a2) + inside * V::broadcast(c.a3)) + inside2 * V::broadcast(c.a4);  // over eps^2
    stress = (strain + V::broadcast(c.beyond) * beyond) + inside2 * higher;
  }
  const V rate = (ux * dx + uy * dy + uz * dz) * inverse;
  const V s = (V::load(b.axial) * stress + V::load(b.damping) * rate) * inverse;
  return {s * dx, s * dy, s * dz};
}

template <class V, bool kStraight>
void addRunForces(const LinkTable& table, const KnotArrays& knots) {
  // Copies: a pack that is stored might change any of these for all the compiler knows.
  const LinkTable::LawConstants c = table.law();
  const KnotArrays k = knots;
  const LinkTable::Block* const blocks = table.blocks().data();
  const LinkTable::Place* const places = table.places().data();
  const std::size_t count = table.places().size();
  for (std::size_t n = 0; n < count; ++n) {
    const std::uint32_t i = places[n].knot0, j = places[n].knot1;
    const Force<V> f = linkForce<V, kStraight>(
        blocks[n], c, V::load(k.x + j) - V::load(k.x + i), V::load(k.y + j) - V::load(k.y + i),
        V::load(k.z + j) - V::load(k.z + i), V::load(k.vx + j) - V::load(k.vx + i),
        V::load(k.vy + j) - V::load(k.vy + i), V::load(k.vz + j) - V::load(k.vz + i));
    // The two ranges may overlap: first all of knot0, then all of knot1, at every level.
    (V::load(k.fx + i) + f.x).store(k.fx + i);
    (V::load(k.fy + i) + f.y).store(k.fy + i);
    (V::load(k.fz + i) + f.z).store(k.fz + i);
    (V::load(k.fx + j) - f.x).store(k.fx + j);
    (V::load(k.fy + j) - f.y).store(k.fy + j);
    (V::load(k.fz + j) - f.z).store(k.fz + j);
  }
}

template <class V, bool kStraight>
void addIndexedForces(const LinkTable& table, const KnotArrays& knots) {
  const LinkTable::LawConstants c = table.law();
  const KnotArrays k = knots;
  const LinkTable::Block* const blocks = table.blocks().data() + table.firstIndexedBlock();
  const LinkTable::Indices* const indices = table.indices().data();
  const std::size_t count = table.indexedBlocks();
  for (std::size_t n = 0; n < count; ++n) {
    const LinkTable::Indices& index = indices[n];
    const Force<V> f =
        linkForce<V, kStraight>(blocks[n], c, V::gather(k.x, index.knot1) - V::gather(k.x, index.knot0),
                                V::gather(k.y, index.knot1) - V::gather(k.y, index.knot0),
                                V::gather(k.z, index.knot1) - V::gather(k.z, index.knot0),
                                V::gather(k.vx, index.knot1) - V::gather(k.vx, index.knot0),
                                V::gather(k.vy, index.knot1) - V::gather(k.vy, index.knot0),
                                V::gather(k.vz, index.knot1) - V::gather(k.vz, index.knot0));
    alignas(32) float sx[kLanes], sy[kLanes], sz[kLanes];
    f.x.store(sx);
    f.y.store(sy);
    f.z.store(sz);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::uint32_t i = index.knot0[lane];
      const std::uint32_t j = index.knot1[lane];
      k.fx[i] += sx[lane];
      k.fy[i] += sy[lane];
      k.fz[i] += sz[lane];
      k.fx[j] -= sx[lane];
      k.fy[j] -= sy[lane];
      k.fz[j] -= sz[lane];
    }
  }
}

template <class V>
void integrateKnots(const MotionArrays& arrays, float dt) {
  const MotionArrays a = arrays;  // a copy, see addRunForces
  const V step = V::broadcast(dt);
  for (std::size_t i = 0; i < a.n; i += kLanes) {
    const V keep = V::load(a.keep + i), push = V::load(a.push + i);
    const V vx = keep * (V::load(a.vx + i) + push * V::load(a.fx + i));
    const V vy = keep * (V::load(a.vy + i) + push * V::load(a.fy + i));
    const V vz = keep * (V::load(a.vz + i) + push * V::load(a.fz + i));
    vx.store(a.vx + i);
    vy.store(a.vy + i);
    vz.store(a.vz + i);
    (V::load(a.x + i) + step * vx).store(a.x + i);
    (V::load(a.y + i) + step * vy).store(a.y + i);
    (V::load(a.z + i) + step * vz).store(a.z + i);
    V::load(a.hx + i).store(a.fx + i);
    V::load(a.hy + i).store(a.fy + i);
    V::load(a.hz + i).store(a.fz + i);
  }
}

void integrateKnotsBaseline(const MotionArrays& a, float dt);
void integrateKnotsAvx2(const MotionArrays& a, float dt);
void addHingesBaseline(const std::vector<Hinge>& hinges, const ElementArrays& a);
void addHingesAvx2(const std::vector<Hinge>& hinges, const ElementArrays& a);
void addLinkForcesBaseline(const LinkTable& table, const KnotArrays& knots);
void addLinkForcesAvx2(const LinkTable& table, const KnotArrays& knots);  // only where built for x86-64

}  // namespace vest::net::kernel
