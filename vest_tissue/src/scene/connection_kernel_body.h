// Four connections at once, for all levels: V is a pack of four doubles with correctly rounded operations,
// each lane in the order of pullTogether() (connections.cpp). Included by one translation unit per level.
#pragma once

#include "connection_kernel.h"

namespace vest::scene::kernel {
namespace {

template <class V>
struct Three {
  V x, y, z;
};
template <class V>
Three<V> operator+(const Three<V>& a, const Three<V>& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
template <class V>
Three<V> operator-(const Three<V>& a, const Three<V>& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
template <class V>
Three<V> operator*(const V& s, const Three<V>& a) {
  return {s * a.x, s * a.y, s * a.z};
}
template <class V>
V dot(const Three<V>& a, const Three<V>& b) {
  return (a.x * b.x + a.y * b.y) + a.z * b.z;
}
template <class V>
Three<V> cross(const Three<V>& a, const Three<V>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class V>
Three<V> where(const typename V::Mask& mask, const Three<V>& a, const Three<V>& b) {
  return {where(mask, a.x, b.x), where(mask, a.y, b.y), where(mask, a.z, b.z)};
}
template <class V, class Number>
Three<V> three(const Number (&from)[3][ConnectionLanes::kCount]) {
  return {V::load(from[0]), V::load(from[1]), V::load(from[2])};
}
template <class V, class Number>
void store(const Three<V>& from, Number (&to)[3][ConnectionLanes::kCount]) {
  from.x.store(to[0]), from.y.store(to[1]), from.z.store(to[2]);
}

/// The face of end 1, as Face in connections.cpp.
template <class V>
struct FaceOf {
  Three<V> corner, edge1, edge2, normal;
  V doubled;
  typename V::Mask is;  ///< a face to speak of
};

/// What the height turns, as in connections.cpp.
template <class V>
struct Lever {
  V weight[3], height;
};

template <class V>
V inverseMass(const Lever<V>& a, const FaceOf<V>& face, const V (&edges)[3], const V (&inverse)[3]) {
  const V zero = V::broadcast(0.0), arm = abs(a.height) / face.doubled;
  V sum = zero;
  for (int i = 0; i < 3; ++i) {
    const V lever = where(face.is, arm * edges[i], zero);
    sum = sum + (a.weight[i] * a.weight[i] + lever * lever + V::broadcast(2.0) * abs(a.weight[i]) * lever) *
                    inverse[i];
  }
  return sum;
}

template <class V>
void share(const Lever<V>& a, const FaceOf<V>& face, const Three<V>& force, Three<V> (&knots)[3]) {
  for (int i = 0; i < 3; ++i) knots[i] = knots[i] + a.weight[i] * force;
  const V zero = V::broadcast(0.0);
  const V turns = where(face.is, a.height / face.doubled, zero);
  const Three<V> across = turns * (force - dot(face.normal, force) * face.normal);
  const Three<V> f1 = cross(face.edge2, across), f2 = cross(across, face.edge1);
  knots[1] = knots[1] + f1, knots[2] = knots[2] + f2, knots[0] = knots[0] - (f1 + f2);
}

template <class V>
void pull(ConnectionLanes& l) {
  const V zero = V::broadcast(0.0), one = V::broadcast(1.0);
  const V ahead0 = V::load(l.ahead0), ahead1 = V::load(l.ahead1);
  const Three<V> v0 = three<V>(l.v0), place0 = three<V>(l.x0) + ahead0 * v0;
  Three<V> x[3], v[3];
  for (int i = 0; i < 3; ++i) v[i] = three<V>(l.v1[i]), x[i] = three<V>(l.x1[i]) + ahead1 * v[i];
  const V inverse[3] = {V::load(l.w1[0]), V::load(l.w1[1]), V::load(l.w1[2])};

  FaceOf<V> face;
  face.corner = x[0], face.edge1 = x[1] - x[0], face.edge2 = x[2] - x[0];
  const Three<V> area = cross(face.edge1, face.edge2);
  const V doubled = sqrt(dot(area, area));
  face.is = V::broadcast(kLeastFace) < doubled;
  face.doubled = where(face.is, doubled, one);
  const Three<V> none{zero, zero, zero};
  face.normal =
      where(face.is, Three<V>{area.x / face.doubled, area.y / face.doubled, area.z / face.doubled}, none);

  Lever<V> end;
  for (int i = 0; i < 3; ++i) end.weight[i] = V::load(l.weight[i]);
  end.height = V::load(l.height);
  const Three<V> foot = end.weight[0] * x[0] + end.weight[1] * x[1] + end.weight[2] * x[2];
  const Three<V> way = foot + end.height * face.normal - place0;
  // What is no strand is stretched by all of the way.
  const V strand = V::load(l.strand), length = max(V::broadcast(0.1) * strand, sqrt(dot(way, way)));
  const V stretched = where(zero < strand, one - strand / where(zero < length, length, one), one);
  const Three<V> off = stretched * way;

  // The damper's other end is where the face carries the place of end 0.
  const Three<V> r = place0 - face.corner;
  const V w1 = dot(cross(r, face.edge2), face.normal) / face.doubled,
          w2 = dot(cross(face.edge1, r), face.normal) / face.doubled;
  Lever<V> damper;
  damper.weight[0] = where(face.is, one - w1 - w2, end.weight[0]);
  damper.weight[1] = where(face.is, w1, end.weight[1]);
  damper.weight[2] = where(face.is, w2, end.weight[2]);
  damper.height = where(face.is, dot(r, face.normal), end.height);
  const Three<V> turning = cross(v[1] - v[0], face.edge2) + cross(face.edge1, v[2] - v[0]);
  const V turns = where(face.is, damper.height / face.doubled, zero);
  const Three<V> carried = damper.weight[0] * v[0] + damper.weight[1] * v[1] + damper.weight[2] * v[2] +
                           turns * (turning - dot(face.normal, turning) * face.normal);
  const Three<V> rate = carried - v0;

  const Three<V> across = face.edge1 - face.edge2;
  const V edges[3] = {sqrt(dot(across, across)), sqrt(dot(face.edge2, face.edge2)),
                      sqrt(dot(face.edge1, face.edge1))};
  const V own = V::load(l.w0), most = V::broadcast(kLighter) * V::load(l.built);
  const V soft1 = min(most / (own + inverseMass(end, face, edges, inverse)), one),
          soft2 = min(most / (own + inverseMass(damper, face, edges, inverse)), one);
  const Three<V> spring = (soft1 * V::load(l.stiffness)) * off, damping = (soft2 * V::load(l.damping)) * rate;
  const Three<V> both = spring + damping;

  store(spring, l.spring), store(damping, l.damper), store(rate, l.rate);
  for (int i = 0; i < 3; ++i) damper.weight[i].store(l.damper_weight[i]);
  damper.height.store(l.damper_height);
  dot(both, both).store(l.force2);
  store(both, l.on0);
  Three<V> knots[3] = {none, none, none};
  share(end, face, none - spring, knots);
  share(damper, face, none - damping, knots);
  for (int i = 0; i < 3; ++i) store(knots[i], l.on1[i]);
}

}  // namespace
}  // namespace vest::scene::kernel
