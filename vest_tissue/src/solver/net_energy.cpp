#include "vest_tissue/solver/net_energy.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>

namespace vest::solver {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kTiny = 1e-12;     // m: below this a direction is not defined
constexpr double kStraight = 1e-3;  // rad: as net::Bending

struct Law {
  double energy, tension, tangent;  // over the axial stiffness E·A; energy also over the rest length
};

Law lawAt(const net::LinkTable::LawConstants& c, bool by_law, double strain) {
  if (!by_law || strain <= 0.0) return {0.5 * strain * strain, strain, 1.0};
  const double m = c.max_strain, e = std::min(strain, m), a2 = c.a2, a3 = c.a3, a4 = c.a4, tail = c.tail;
  const double tension = e * (1.0 + e * (a2 + e * (a3 + e * a4))), beyond = strain - e;
  return {e * e * (0.5 + e * (a2 / 3 + e * (a3 / 4 + e * a4 / 5))) + beyond * (tension + 0.5 * tail * beyond),
          tension + tail * beyond, strain > m ? tail : 1.0 + e * (2 * a2 + e * (3 * a3 + e * 4 * a4))};
}

struct Arm {
  Vector3d u;
  double length;
};
Arm arm(const Positions& x, std::uint32_t i, std::uint32_t j) {
  Arm a{x[j] - x[i], 0.0};
  a.length = std::sqrt(a.u.squaredNorm());
  a.u /= std::max(a.length, kTiny);
  return a;
}

// ---- bending

struct Bent {
  Arm e0, e1;
  double s, c, beta;
  bool valid;
};
Bent bent(const net::Bending& b, const Positions& x) {
  Bent r{arm(x, b.a, b.b), arm(x, b.b, b.c), 0, 1, 0, false};
  r.valid = r.e0.length > kTiny && r.e1.length > kTiny;
  r.c = r.e0.u.dot(r.e1.u);
  r.s = std::sqrt(r.e0.u.cross(r.e1.u).squaredNorm());
  r.beta = angleOf(r.s, r.c);
  return r;
}
/// (beta - beta0)/sin(beta), as the float kernel has it.
double bendingRatio(const net::Bending& b, const Bent& r) {
  if (b.rest != 0.0f) return (r.beta - b.rest) / std::max(r.s, kStraight);
  return r.s > 1e-6 ? r.beta / r.s : (r.c > 0.0 ? 1.0 : 3.141592653589793 / 1e-6);
}

// ---- hinges: fold = 2·tan(theta/2)

struct Folded {
  double fold;
  std::array<Vector3d, 4> g;  // d fold / d knot: edge0, edge1, wing0, wing1
  bool closed;                // beyond kGreatestFold
};
Folded folded(const net::Hinge& h, const Positions& x) {
  const Vector3d edge = x[h.edge1] - x[h.edge0], w0 = x[h.wing0] - x[h.edge0], w1 = x[h.wing1] - x[h.edge0];
  const Vector3d n0 = edge.cross(w0), n1 = w1.cross(edge);
  const double length2 = std::max(edge.squaredNorm(), 1e-30), length = std::sqrt(length2);
  const double floor = std::max(std::max(1e-6 * length2, static_cast<double>(h.least)) * length2, 1e-30);
  const double area0 = std::max(n0.squaredNorm(), floor), area1 = std::max(n1.squaredNorm(), floor);
  const double product = std::sqrt(area0 * area1), sine = n0.cross(n1).dot(edge) / length;
  const double most = 0.5 * net::kGreatestFold;
  const double wanted = sine / std::max(product + n0.dot(n1), 1e-6 * product);
  const double half = std::clamp(wanted, -most, most);
  Folded r;
  r.fold = 2.0 * half;
  r.closed = std::fabs(wanted) > most;
  const double slope = 1.0 + half * half;
  r.g[2] = n0 * (-slope * length / area0);
  r.g[3] = n1 * (-slope * length / area1);
  const double s0 = w0.dot(edge) / length2, s1 = w1.dot(edge) / length2;
  r.g[1] = -(s0 * r.g[2] + s1 * r.g[3]);
  r.g[0] = -(r.g[1] + r.g[2] + r.g[3]);
  return r;
}

// ---- volumes

double volumeOf(const net::Volume& v, const Positions& x) {
  if (v.triangles.empty()) return 0.0;
  const Vector3d o = x[v.triangles[0][0]];
  double six = 0.0;
  for (const auto& t : v.triangles) six += (x[t[0]] - o).dot((x[t[1]] - o).cross(x[t[2]] - o));
  return six / 6.0;
}

void addPair(StiffnessSink& sink, std::uint32_t i, std::uint32_t j, const Matrix3d& k) {
  sink.add(i, i, k);
  sink.add(j, j, k);
  sink.add(i, j, -k);
}

template <std::size_t N>
void addOuter(StiffnessSink& sink, const std::array<std::uint32_t, N>& knots,
              const std::array<Vector3d, N>& g, double k) {
  for (std::size_t a = 0; a < N; ++a)
    for (std::size_t b = a; b < N; ++b) sink.add(knots[a], knots[b], k * g[a] * g[b].transpose());
}

}  // namespace

double angleOf(double s, double c) {
  const double ac = std::fabs(c), large = std::max(s, ac), small = std::min(s, ac);
  if (!(large > 0.0)) return 0.0;
  constexpr double kPi = 3.14159265358979323846, kTan = 0.41421356237309504880;  // tan(pi/8)
  double q = small / large, offset = 0.0;
  if (q > 0.66817863791929888) {  // tan(3 pi/16): reduce by pi/4
    q = (q - 1.0) / (q + 1.0);
    offset = kPi / 4;
  } else if (q > 0.19891236737965800) {  // tan(pi/16): reduce by pi/8
    q = (q - kTan) / (1.0 + q * kTan);
    offset = kPi / 8;
  }
  // Series of the arctangent, |q| <= tan(pi/16): the first term left out is below q^19/19 = 3e-15.
  const double q2 = q * q;
  double sum = 0.0;
  for (int n = 17; n >= 1; n -= 2) sum = 1.0 / n - q2 * sum;
  double r = offset + q * sum;
  if (s > ac) r = kPi / 2 - r;
  return c < 0.0 ? kPi - r : r;
}

double netEnergy(const NetView& net, const Positions& x) {
  double sum = 0.0;
  for (std::size_t i = 0; i < net.links.count; ++i) {
    const net::KernelLink& l = net.links.link(i);
    if (l.axial == 0.0f) continue;
    const double rest = l.rest, strain = arm(x, l.knot0, l.knot1).length / rest - 1.0;
    sum += static_cast<double>(l.axial) * rest * lawAt(net.links.law, net.links.lawOf(i), strain).energy;
  }
  const net::Elements& e = *net.elements;
  for (const net::Bending& b : e.bending) {
    const Bent r = bent(b, x);
    if (r.valid) sum += 0.5 * b.stiffness * (r.beta - b.rest) * (r.beta - b.rest);
  }
  for (const net::Hinge& h : e.hinges) {
    const double off = folded(h, x).fold - h.rest;
    sum += h.stiffness * off * off;
  }
  for (const net::Plastic& p : e.plastic) {
    const double width = static_cast<double>(net::kPlasticWidth) * p.rest;
    const double off = std::fabs(arm(x, p.a, p.b).length - p.rest);
    sum += p.kappa * (off < width ? 0.5 * off * off / width : off - 0.5 * width);
  }
  for (const net::Tether& t : e.tethers)
    sum += 0.5 * t.stiffness * (x[t.knot] - Vector3d(t.place[0], t.place[1], t.place[2])).squaredNorm();
  for (const net::Volume& v : e.volumes) {
    if (v.bulk_modulus == 0.0f || v.triangles.empty()) continue;
    const double strain = std::fabs(volumeOf(v, x) / v.rest - 1.0), most = net::kGreatestCompression;
    sum += v.bulk_modulus * v.rest * (strain > most ? most * (strain - 0.5 * most) : 0.5 * strain * strain);
  }
  return sum;
}

void addNetGradient(const NetView& net, const Positions& x, Positions& gradient) {
  for (std::size_t i = 0; i < net.links.count; ++i) {
    const net::KernelLink& l = net.links.link(i);
    if (l.axial == 0.0f) continue;
    const Arm a = arm(x, l.knot0, l.knot1);
    const double tension = lawAt(net.links.law, net.links.lawOf(i), a.length / l.rest - 1.0).tension;
    const Vector3d f = (l.axial * tension) * a.u;
    gradient[l.knot1] += f;
    gradient[l.knot0] -= f;
  }
  const net::Elements& e = *net.elements;
  for (const net::Bending& b : e.bending) {
    const Bent r = bent(b, x);
    if (!r.valid) continue;
    const double moment = b.stiffness * bendingRatio(b, r);
    const Vector3d g0 = (r.e1.u - r.c * r.e0.u) * (moment / r.e0.length);
    const Vector3d g2 = (r.e0.u - r.c * r.e1.u) * (-moment / r.e1.length);
    gradient[b.a] += g0;
    gradient[b.c] += g2;
    gradient[b.b] -= g0 + g2;
  }
  for (const net::Hinge& h : e.hinges) {
    const Folded f = folded(h, x);
    const double moment = 2.0 * h.stiffness * (f.fold - h.rest);
    const std::uint32_t knots[4] = {h.edge0, h.edge1, h.wing0, h.wing1};
    for (int k = 0; k < 4; ++k) gradient[knots[k]] += moment * f.g[k];
  }
  for (const net::Plastic& p : e.plastic) {
    const Arm a = arm(x, p.a, p.b);
    if (!(a.length > kTiny)) continue;
    const double ramp = std::clamp((a.length / p.rest - 1.0) / net::kPlasticWidth, -1.0, 1.0);
    gradient[p.b] += (p.kappa * ramp) * a.u;
    gradient[p.a] -= (p.kappa * ramp) * a.u;
  }
  for (const net::Tether& t : e.tethers)
    gradient[t.knot] +=
        static_cast<double>(t.stiffness) * (x[t.knot] - Vector3d(t.place[0], t.place[1], t.place[2]));
  for (const net::Volume& v : e.volumes) {
    if (v.bulk_modulus == 0.0f || v.triangles.empty()) continue;
    const double pressure = net::pressureOf(v, volumeOf(v, x)) / 6.0;
    for (const auto& t : v.triangles) {
      const Vector3d g = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]) * pressure;
      for (const auto k : t) gradient[k] -= g;
    }
  }
}

void addNetStiffness(const NetView& net, const Positions& x, StiffnessSink& sink) {
  const auto axial = [&](std::uint32_t i, std::uint32_t j, const Arm& a, double along, double across) {
    addPair(sink, i, j, (along - across) * a.u * a.u.transpose() + across * Matrix3d::Identity());
  };
  for (std::size_t i = 0; i < net.links.count; ++i) {
    const net::KernelLink& l = net.links.link(i);
    if (l.axial == 0.0f) continue;
    const Arm a = arm(x, l.knot0, l.knot1);
    const Law law = lawAt(net.links.law, net.links.lawOf(i), a.length / l.rest - 1.0);
    axial(l.knot0, l.knot1, a, l.axial * law.tangent / l.rest,
          std::max(0.0, l.axial * law.tension / std::max(a.length, kTiny)));
  }
  const net::Elements& e = *net.elements;
  for (const net::Bending& b : e.bending) {
    const Bent r = bent(b, x);
    if (!r.valid) continue;
    const std::array<std::uint32_t, 3> knots{b.a, b.b, b.c};
    if (b.rest == 0.0f) {  // near straight beta is the length of w = e1/l1 - e0/l0 across the arms
      const Vector3d sum = r.e0.u + r.e1.u;
      const double n = std::sqrt(sum.squaredNorm());
      const Vector3d t = n > 1e-6 ? Vector3d(sum / n) : r.e0.u;
      const Matrix3d across = static_cast<double>(b.stiffness) * (Matrix3d::Identity() - t * t.transpose());
      const double d[3] = {1 / r.e0.length, -(1 / r.e0.length + 1 / r.e1.length), 1 / r.e1.length};
      for (int i = 0; i < 3; ++i)
        for (int j = i; j < 3; ++j) sink.add(knots[i], knots[j], d[i] * d[j] * across);
      continue;
    }
    const double s = std::max(r.s, kStraight);
    std::array<Vector3d, 3> g;
    g[0] = (r.e1.u - r.c * r.e0.u) / (r.e0.length * s);
    g[2] = (r.e0.u - r.c * r.e1.u) / (-r.e1.length * s);
    g[1] = -(g[0] + g[2]);
    addOuter(sink, knots, g, b.stiffness);
  }
  for (const net::Hinge& h : e.hinges) {
    const Folded f = folded(h, x);
    addOuter<4>(sink, {h.edge0, h.edge1, h.wing0, h.wing1}, f.g, 2.0 * h.stiffness);
  }
  for (const net::Plastic& p : e.plastic) {
    const Arm a = arm(x, p.a, p.b);
    const double width = static_cast<double>(net::kPlasticWidth) * p.rest;
    const double ramp = std::clamp((a.length - p.rest) / width, -1.0, 1.0);
    axial(p.a, p.b, a, std::fabs(ramp) < 1.0 ? p.kappa / width : 0.0,
          std::max(0.0, p.kappa * ramp / std::max(a.length, kTiny)));
  }
  for (const net::Tether& t : e.tethers)
    sink.add(t.knot, t.knot, static_cast<double>(t.stiffness) * Matrix3d::Identity());
  for (const net::Volume& v : e.volumes) {
    if (!isSmall(v) || v.bulk_modulus == 0.0f || v.triangles.empty()) continue;
    if (!(std::fabs(volumeOf(v, x) / v.rest - 1.0) < net::kGreatestCompression)) continue;
    std::array<Vector3d, kSmallVolume> g;
    g.fill(Vector3d::Zero());
    for (const auto& t : v.triangles) {
      const Vector3d share = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]) / 6.0;
      for (const auto k : t)
        for (std::size_t n = 0; n < v.knots.size(); ++n)
          if (v.knots[n] == k) g[n] += share;
    }
    const double k = v.bulk_modulus / v.rest;
    for (std::size_t a = 0; a < v.knots.size(); ++a)
      for (std::size_t b = a; b < v.knots.size(); ++b)
        sink.add(v.knots[a], v.knots[b], k * g[a] * g[b].transpose());
  }
}

void addNetDamping(const NetView& net, const Positions& x, double factor, StiffnessSink& sink) {
  const auto along = [&](std::uint32_t i, std::uint32_t j, double damping) {
    if (damping == 0.0) return;
    const Arm a = arm(x, i, j);
    addPair(sink, i, j, factor * damping * a.u * a.u.transpose());
  };
  for (std::size_t i = 0; i < net.links.count; ++i) {
    const net::KernelLink& l = net.links.link(i);
    along(l.knot0, l.knot1, l.damping);
  }
  for (const net::Plastic& p : net.elements->plastic) along(p.a, p.b, p.damping);
  for (const net::Tether& t : net.elements->tethers)
    sink.add(t.knot, t.knot, factor * t.damping * Matrix3d::Identity());
}

double volumeMode(const NetView& net, std::size_t index, const Positions& x, Positions& g) {
  const net::Volume& v = net.elements->volumes[index];
  std::fill(g.begin(), g.end(), Vector3d::Zero());
  if (isSmall(v) || v.bulk_modulus == 0.0f || v.triangles.empty()) return 0.0;
  for (const auto& t : v.triangles) {
    const Vector3d share = (x[t[1]] - x[t[0]]).cross(x[t[2]] - x[t[0]]) / 6.0;
    for (const auto k : t) g[k] += share;
  }
  const double strain = std::fabs(volumeOf(v, x) / v.rest - 1.0);
  return strain < net::kGreatestCompression ? v.bulk_modulus / v.rest : 0.0;
}

}  // namespace vest::solver
