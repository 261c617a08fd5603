#include "vest_tissue/net/elements.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <Eigen/Geometry>

#include "link_kernel_body.h"

namespace vest::net {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

Vector3f at(const ElementArrays& a, std::uint32_t i) {
  return {a.x[i], a.y[i], a.z[i]};
}
Vector3f speed(const ElementArrays& a, std::uint32_t i) {
  return {a.vx[i], a.vy[i], a.vz[i]};
}

void add(const ElementArrays& a, std::uint32_t i, const Vector3f& f) {
  a.fx[i] += f.x();
  a.fy[i] += f.y();
  a.fz[i] += f.z();
}

constexpr float kTiny = 1e-12f;     // m, m²: below this a direction is not defined
constexpr float kStraight = 1e-3f;  // rad: Bending

/// Shape of a bending element: unit arms, lengths, sine, cosine and deviation.
struct Bent {
  Vector3f e0, e1;
  float l0, l1, s, c, beta;
  bool valid;
};

Bent bent(const Bending& b, const ElementArrays& a) {
  Bent r;
  r.e0 = at(a, b.b) - at(a, b.a);
  r.e1 = at(a, b.c) - at(a, b.b);
  r.l0 = std::sqrt(r.e0.squaredNorm());
  r.l1 = std::sqrt(r.e1.squaredNorm());
  r.valid = r.l0 > kTiny && r.l1 > kTiny;
  if (!r.valid) return r;
  r.e0 /= r.l0;
  r.e1 /= r.l1;
  r.c = r.e0.dot(r.e1);
  r.s = std::sqrt(r.e0.cross(r.e1).squaredNorm());
  r.beta = angleOf(r.s, r.c);
  return r;
}

}  // namespace

float angleOf(float s, float c) {
  const float as = std::fabs(s), ac = std::fabs(c);
  const float large = std::max(as, ac), small = std::min(as, ac);
  if (!(large > 0.0f)) return 0.0f;
  // Taylor series of the arctangent after a reduction by pi/8 or pi/4: |q| <= tan(pi/16).
  constexpr float kTan = 0.41421356237f, kPi = 3.14159265359f;
  float q = small / large, offset = 0.0f;
  if (q > 0.6681786379f) {  // tan(3 pi/16): reduce by pi/4
    q = (q - 1.0f) / (q + 1.0f);
    offset = kPi / 4.0f;
  } else if (q > 0.1989123674f) {  // tan(pi/16): reduce by pi/8
    q = (q - kTan) / (1.0f + q * kTan);
    offset = kPi / 8.0f;
  }
  const float q2 = q * q;
  float r = offset + q * (1.0f - q2 * (1.0f / 3 - q2 * (1.0f / 5 - q2 * (1.0f / 7 - q2 * (1.0f / 9)))));
  if (as > ac) r = kPi / 2.0f - r;
  if (c < 0.0f) r = kPi - r;
  return s < 0.0f ? -r : r;
}

void addBending(const std::vector<Bending>& elements, const ElementArrays& a) {
  for (const Bending& b : elements) {
    const Bent r = bent(b, a);
    if (!r.valid) continue;
    // (beta - beta0)/sin(beta): for a straight rest its limit is 1.
    float ratio;
    if (b.rest == 0.0f) {
      ratio = r.s > 1e-4f ? r.beta / r.s : (r.c > 0.0f ? 1.0f : 3.14159265f / 1e-4f);
    } else {
      ratio = (r.beta - b.rest) / std::max(r.s, kStraight);
    }
    const float moment = b.stiffness * ratio;
    const Vector3f f0 = (r.e1 - r.c * r.e0) * (-moment / r.l0);
    const Vector3f f2 = (r.e0 - r.c * r.e1) * (moment / r.l1);
    add(a, b.a, f0);
    add(a, b.c, f2);
    add(a, b.b, -(f0 + f2));
  }
}

double bendingEnergy(const std::vector<Bending>& elements, const ElementArrays& a) {
  double sum = 0.0;
  for (const Bending& b : elements) {
    const Bent r = bent(b, a);
    if (!r.valid) continue;
    const double deviation = static_cast<double>(r.beta) - b.rest;
    sum += 0.5 * b.stiffness * deviation * deviation;
  }
  return sum;
}

double foldOf(const Vector3d& e0, const Vector3d& e1, const Vector3d& w0, const Vector3d& w1) {
  const Vector3d edge = e1 - e0;
  const Vector3d n0 = edge.cross(w0 - e0), n1 = (w1 - e0).cross(edge);
  const double length = edge.norm(), product = n0.norm() * n1.norm();
  if (!(length > 0.0) || !(product > 0.0)) return 0.0;
  const double fold =
      2.0 * (n0.cross(n1).dot(edge) / length) / std::max(product + n0.dot(n1), 1e-6 * product);
  return std::clamp(fold, -static_cast<double>(kGreatestFold), static_cast<double>(kGreatestFold));
}

void addHinges(const std::vector<Hinge>& elements, const ElementArrays& a, KernelLevel level) {
#if defined(VEST_HAVE_AVX2_KERNEL)
  if (level == KernelLevel::Avx2) {
    kernel::addHingesAvx2(elements, a);
    return;
  }
#else
  (void)level;
#endif
  kernel::addHingesBaseline(elements, a);
}

double hingeEnergy(const std::vector<Hinge>& elements, const ElementArrays& a) {
  double sum = 0.0;
  for (const Hinge& h : elements) {
    const auto p = [&](std::uint32_t i) -> Vector3d { return at(a, i).cast<double>(); };
    const double off = foldOf(p(h.edge0), p(h.edge1), p(h.wing0), p(h.wing1)) - h.rest;
    sum += h.stiffness * off * off;
  }
  return sum;
}

void addPlastic(const std::vector<Plastic>& elements, const ElementArrays& a) {
  for (const Plastic& p : elements) {
    const Vector3f d = at(a, p.b) - at(a, p.a);
    const float length = std::sqrt(d.squaredNorm());
    if (!(length > kTiny)) continue;
    const Vector3f u = d / length;
    const float ramp = std::clamp((length / p.rest - 1.0f) / kPlasticWidth, -1.0f, 1.0f);
    const Vector3f f = u * (p.kappa * ramp + p.damping * (speed(a, p.b) - speed(a, p.a)).dot(u));
    add(a, p.a, f);
    add(a, p.b, -f);
  }
}

double plasticEnergy(const std::vector<Plastic>& elements, const ElementArrays& a) {
  double sum = 0.0;
  for (const Plastic& p : elements) {
    const double length = (at(a, p.b) - at(a, p.a)).cast<double>().norm();
    const double width = static_cast<double>(kPlasticWidth) * p.rest, off = std::fabs(length - p.rest);
    sum += p.kappa * (off < width ? 0.5 * off * off / width : off - 0.5 * width);
  }
  return sum;
}

void addTethers(const std::vector<Tether>& elements, const ElementArrays& a) {
  const auto load = [](const float* from) {
    Four v;
    std::memcpy(&v, from, sizeof v);
    return v;
  };
  const auto pull = [&](const Tether* t) {  // four of neighbouring knots, each in its own lane
    const std::uint32_t i = t[0].knot;
    const auto of = [t](auto value) { return Four{value(t[0]), value(t[1]), value(t[2]), value(t[3])}; };
    const Four stiffness = of([](const Tether&l) { return l.stiffness; }),
               damping = of([](const Tether&l) { return l.damping; });
    const auto axis = [&](std::size_t e, const float* x, const float* v, float* f) {
      const Four place = of([e](const Tether& l) { return l.place[e]; });
      const Four sum = load(f + i) + (stiffness * (place - load(x + i)) - damping * load(v + i));
      std::memcpy(f + i, &sum, sizeof sum);
    };
    axis(0, a.x, a.vx, a.fx), axis(1, a.y, a.vy, a.fy), axis(2, a.z, a.vz, a.fz);
  };
  for (std::size_t n = 0; n < elements.size();) {
    const Tether& t = elements[n];
    const std::uint32_t i = t.knot;
    if (n + 4 <= elements.size() && elements[n + 1].knot == i + 1 && elements[n + 2].knot == i + 2 &&
        elements[n + 3].knot == i + 3) {
      pull(&t);
      n += 4;
      continue;
    }
    a.fx[i] += t.stiffness * (t.place[0] - a.x[i]) - t.damping * a.vx[i];
    a.fy[i] += t.stiffness * (t.place[1] - a.y[i]) - t.damping * a.vy[i];
    a.fz[i] += t.stiffness * (t.place[2] - a.z[i]) - t.damping * a.vz[i];
    ++n;
  }
}

double tetherEnergy(const std::vector<Tether>& elements, const ElementArrays& a) {
  double sum = 0.0;
  for (const Tether& t : elements) {
    const Vector3d off = Vector3d(t.place[0], t.place[1], t.place[2]) - at(a, t.knot).cast<double>();
    sum += 0.5 * t.stiffness * off.squaredNorm();
  }
  return sum;
}

double enclosedVolume(const Volume& volume, const ElementArrays& a) {
  if (volume.triangles.empty()) return 0.0;
  const Vector3d o = at(a, volume.triangles[0][0]).cast<double>();  // near the surface: little cancellation
  double six = 0.0;
  for (const auto& t : volume.triangles) {
    const Vector3d p = at(a, t[0]).cast<double>() - o, q = at(a, t[1]).cast<double>() - o,
                   r = at(a, t[2]).cast<double>() - o;
    six += p.dot(q.cross(r));
  }
  return six / 6.0;
}

void addVolumes(const std::vector<Volume>& elements, const ElementArrays& a) {
  for (const Volume& v : elements) {
    if (v.bulk_modulus == 0.0f || v.triangles.empty()) continue;
    const float pressure = pressureOf(v, enclosedVolume(v, a)) / 6.0f;
    for (const auto& t : v.triangles) {
      const Vector3f p = at(a, t[0]), q = at(a, t[1]), r = at(a, t[2]);
      // dV/dp = (q x r)/6; on a closed surface the area vector ((q-p) x (r-p))/6 for each corner sums to the
      // same.
      const Vector3f f = (q - p).cross(r - p) * pressure;
      add(a, t[0], f);
      add(a, t[1], f);
      add(a, t[2], f);
    }
  }
}

namespace {
/// y, z, x of a vector: the cross product of a and b is y(a)·z(b) - z(a)·y(b), so turned.
Four turned(Four v) {
  return Four{v[1], v[2], v[0], v[3]};
}
}  // namespace

double volumeGradient(const Volume& v, const ElementArrays& e, float* g, std::size_t stride,
                      std::vector<PackedKnot>& packed) {
  // Packed, a corner is one load and one store instead of three each.
  if (v.triangles.empty()) {
    for (int axis = 0; axis < 3; ++axis)
      for (const std::uint32_t k : v.knots) g[axis * stride + k] = 0.0f;
    return 0.0;
  }
  const std::uint32_t first = v.triangles[0][0];
  const float o[3] = {e.x[first], e.y[first], e.z[first]};
  PackedKnot* const at = packed.data();
  for (const std::uint32_t k : v.knots)
    at[k] = {Four{e.x[k] - o[0], e.y[k] - o[1], e.z[k] - o[2], 0.0f}, Four{}};
  double six = 0.0;
  for (const auto& t : v.triangles) {
    PackedKnot &p = at[t[0]], &q = at[t[1]], &r = at[t[2]];
    const Four a = q.x - p.x, b = r.x - p.x;
    const Four area = turned(a) * turned(turned(b)) - turned(turned(a)) * turned(b);
    const Four height = p.x * area;
    six += static_cast<double>(height[0] + height[1] + height[2]);
    p.gradient += area;
    q.gradient += area;
    r.gradient += area;
  }
  for (const std::uint32_t k : v.knots)
    for (int axis = 0; axis < 3; ++axis) g[axis * stride + k] = at[k].gradient[axis] * (1.0f / 6.0f);
  return six / 6.0;
}

double volumeEnergy(const std::vector<Volume>& elements, const ElementArrays& a) {
  double sum = 0.0;
  for (const Volume& v : elements) {
    if (v.bulk_modulus == 0.0f || v.triangles.empty()) continue;
    const double strain = std::fabs(enclosedVolume(v, a) / v.rest - 1.0), most = kGreatestCompression;
    sum += v.bulk_modulus * v.rest * (strain > most ? most * (strain - 0.5 * most) : 0.5 * strain * strain);
  }
  return sum;
}

void addElements(const Elements& e, const ElementArrays& a, KernelLevel level) {
  addBending(e.bending, a);
  addHinges(e.hinges, a, level);
  addPlastic(e.plastic, a);
  addTethers(e.tethers, a);
}

double elementEnergy(const Elements& e, const ElementArrays& a) {
  return bendingEnergy(e.bending, a) + hingeEnergy(e.hinges, a) + plasticEnergy(e.plastic, a) +
         tetherEnergy(e.tethers, a) + volumeEnergy(e.volumes, a);
}

double elementDissipation(const Elements& e, const ElementArrays& a) {
  double sum = 0.0;
  for (const Tether& t : e.tethers) sum += t.damping * speed(a, t.knot).cast<double>().squaredNorm();
  for (const Plastic& p : e.plastic) {
    const Vector3d d = (at(a, p.b) - at(a, p.a)).cast<double>();
    const double rate = (speed(a, p.b) - speed(a, p.a)).cast<double>().dot(d) / std::max(d.norm(), 1e-12);
    sum += p.damping * rate * rate;
  }
  return sum;
}

}  // namespace vest::net
