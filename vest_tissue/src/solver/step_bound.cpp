#include "vest_tissue/solver/step_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace vest::solver {
namespace {

/// Links' end points differ: unit vector, length, strain.
struct Arm {
  float ux, uy, uz, length, strain;
};

Arm arm(const net::KernelArrays& a, std::size_t e) {
  const std::uint32_t p = a.knot0[e], q = a.knot1[e];
  Arm r;
  const float dx = a.x[q] - a.x[p], dy = a.y[q] - a.y[p], dz = a.z[q] - a.z[p];
  r.length = std::sqrt(dx * dx + dy * dy + dz * dz + 1e-20f);
  r.ux = dx / r.length, r.uy = dy / r.length, r.uz = dz / r.length;
  r.strain = r.length * a.inverse_rest[e] - 1.0f;
  return r;
}

/// Tension and tangent over the modulus, dimensionless.
void law(const net::KernelArrays& a, std::size_t e, float strain, float& tension, float& tangent) {
  const float positive = std::max(strain, 0.0f), c = std::min(positive, a.max_strain), excess = positive - c;
  tension = strain + a.nonlinear[e] * (c * c * (a.a2 + c * (a.a3 + c * a.a4)) + a.excess_slope * excess);
  tangent = 1.0f + a.nonlinear[e] * (c * (2 * a.a2 + c * (3 * a.a3 + c * 4 * a.a4)));
}

void addTensor(std::vector<float>& t, std::size_t i, const Arm& u, float along, float across) {
  float* const s = t.data() + 6 * i;
  const float d = along - across;
  s[0] += d * u.ux * u.ux + across;
  s[1] += d * u.uy * u.uy + across;
  s[2] += d * u.uz * u.uz + across;
  s[3] += d * u.ux * u.uy;
  s[4] += d * u.ux * u.uz;
  s[5] += d * u.uy * u.uz;
}

double greatest(const net::KernelArrays& a, const std::vector<float>& t) {
  double result = 0.0;
  for (std::size_t i = 0; i < a.knots; ++i) {
    const float* const s = t.data() + 6 * i;
    const float rows = std::max({std::fabs(s[0]) + std::fabs(s[3]) + std::fabs(s[4]),
                                 std::fabs(s[3]) + std::fabs(s[1]) + std::fabs(s[5]),
                                 std::fabs(s[4]) + std::fabs(s[5]) + std::fabs(s[2])});
    const float trace = s[0] + s[1] + s[2];
    result = std::max(result, static_cast<double>(std::min(rows, trace)) * a.inverse_mass[i]);
  }
  return 2.0 * result;
}

}  // namespace

Rates linkRates(const net::KernelArrays& a, BoundScratch& scratch) {
  std::fill(scratch.tensor.begin(), scratch.tensor.end(), 0.0f);
  for (std::size_t e = 0; e < a.links; ++e) {
    if (a.modulus[e] == 0.0f) continue;
    const Arm u = arm(a, e);
    float tension, tangent;
    law(a, e, u.strain, tension, tangent);
    const float along = a.modulus[e] * tangent * a.inverse_rest[e];
    const float across = std::max(a.modulus[e] * tension / u.length, 0.0f);
    addTensor(scratch.tensor, a.knot0[e], u, along, across);
    addTensor(scratch.tensor, a.knot1[e], u, along, across);
  }
  return {greatest(a, scratch.tensor), 0.0};
}

double linkDecay(const net::KernelArrays& a, BoundScratch& scratch) {
  std::fill(scratch.tensor.begin(), scratch.tensor.end(), 0.0f);
  for (std::size_t e = 0; e < a.links; ++e) {
    if (a.damping[e] == 0.0f) continue;
    const Arm u = arm(a, e);
    addTensor(scratch.tensor, a.knot0[e], u, a.damping[e], 0.0f);
    addTensor(scratch.tensor, a.knot1[e], u, a.damping[e], 0.0f);
  }
  return greatest(a, scratch.tensor);
}

Rates elementRates(const net::Block& block, const net::Elements& elements) {
  using net::Block;
  const float *x = block.row(Block::X), *y = block.row(Block::Y), *z = block.row(Block::Z);
  const float* w = block.row(Block::kInverseMass);
  std::vector<double> stiffness(block.knotCapacity() + 1, 0.0), damping(block.knotCapacity() + 1, 0.0);
  const auto distance = [&](std::uint32_t i, std::uint32_t j) {
    const double dx = x[i] - x[j], dy = y[i] - y[j], dz = z[i] - z[j];
    return std::sqrt(dx * dx + dy * dy + dz * dz);
  };
  for (const auto& b : elements.bending) {  // gradient of the angle: 1/l0, 1/l0 + 1/l1, 1/l1
    const double g0 = 1.0 / std::max(distance(b.a, b.b), 1e-9), g1 = 1.0 / std::max(distance(b.b, b.c), 1e-9);
    stiffness[b.a] += 3.0 * b.stiffness * g0 * g0;
    stiffness[b.b] += 3.0 * b.stiffness * (g0 + g1) * (g0 + g1);
    stiffness[b.c] += 3.0 * b.stiffness * g1 * g1;
  }
  for (const auto& h : elements.hinges) {  // gradient of the dihedral angle: one over the wing's height
    const Eigen::Vector3d e0(x[h.edge0], y[h.edge0], z[h.edge0]), e1(x[h.edge1], y[h.edge1], z[h.edge1]);
    const Eigen::Vector3d a(x[h.wing0], y[h.wing0], z[h.wing0]), b(x[h.wing1], y[h.wing1], z[h.wing1]);
    const Eigen::Vector3d edge = e1 - e0;
    const double length = std::max(edge.norm(), 1e-9);
    const auto height = [&](const Eigen::Vector3d& p) {
      const Eigen::Vector3d d = p - e0;
      const Eigen::Vector3d off = d - edge * (d.dot(edge) / (length * length));
      return std::max(off.norm(), 1e-9);
    };
    const double ga = 1.0 / height(a), gb = 1.0 / height(b), ge = ga + gb;
    const double k = 2.0 * h.stiffness * 4.0;
    stiffness[h.wing0] += k * ga * ga;
    stiffness[h.wing1] += k * gb * gb;
    stiffness[h.edge0] += k * ge * ge;
    stiffness[h.edge1] += k * ge * ge;
  }
  for (const auto& p : elements.plastic) {
    const double k = 2.0 * p.kappa / (static_cast<double>(net::kPlasticWidth) * p.rest);
    stiffness[p.a] += k, stiffness[p.b] += k;
    damping[p.a] += 2.0 * p.damping, damping[p.b] += 2.0 * p.damping;
  }
  for (const auto& t : elements.tethers) stiffness[t.knot] += t.stiffness, damping[t.knot] += t.damping;
  Rates rates;
  for (std::size_t i = 0; i < block.knots(); ++i) {
    rates.omega_squared = std::max(rates.omega_squared, stiffness[i] * w[i]);
    rates.decay = std::max(rates.decay, damping[i] * w[i]);
  }
  for (const auto& v : elements.volumes) {  // K/V0·g g^T: one mode, omega² = K/V0·sum |g_i|²/m_i
    std::vector<Eigen::Vector3d> g(block.knotCapacity() + 1, Eigen::Vector3d::Zero());
    for (const auto& t : v.triangles) {
      const Eigen::Vector3d p(x[t[0]], y[t[0]], z[t[0]]), q(x[t[1]], y[t[1]], z[t[1]]), r(x[t[2]], y[t[2]], z[t[2]]);
      const Eigen::Vector3d share = (q - p).cross(r - p) / 6.0;
      for (const auto i : t) g[i] += share;
    }
    double sum = 0.0;
    for (std::size_t i = 0; i < block.knots(); ++i) sum += g[i].squaredNorm() * w[i];
    rates.omega_squared += v.bulk_modulus / v.rest * sum;
  }
  return rates;
}

double powerIteration(const net::KernelArrays& a, int iterations) {
  std::vector<std::array<double, 3>> d(a.knots), f(a.knots);
  std::uint32_t random = 12345u;
  for (auto& p : d) {
    for (double& value : p) {
      random = random * 1664525u + 1013904223u;
      value = static_cast<double>(random >> 8) / (1u << 23) - 1.0;
    }
  }
  double lambda = 0.0;
  for (int sweep = 0; sweep < iterations; ++sweep) {
    std::fill(f.begin(), f.end(), std::array<double, 3>{});
    for (std::size_t e = 0; e < a.links; ++e) {
      if (a.modulus[e] == 0.0f) continue;
      const Arm u = arm(a, e);
      float tension, tangent;
      law(a, e, u.strain, tension, tangent);
      const double along = a.modulus[e] * tangent * a.inverse_rest[e];
      const double across = std::max(a.modulus[e] * tension / u.length, 0.0f);
      auto &p = d[a.knot0[e]], &q = d[a.knot1[e]];
      const double r[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
      const double on = (along - across) * (r[0] * u.ux + r[1] * u.uy + r[2] * u.uz);
      const double t[3] = {on * u.ux + across * r[0], on * u.uy + across * r[1], on * u.uz + across * r[2]};
      for (int c = 0; c < 3; ++c) f[a.knot0[e]][c] -= t[c], f[a.knot1[e]][c] += t[c];
    }
    double length = 0.0, before = 0.0;  // in the norm of the mass
    for (std::size_t i = 0; i < a.knots; ++i) {
      const double w = a.inverse_mass[i];
      if (w == 0.0) {
        d[i] = {0, 0, 0};
        continue;
      }
      for (int c = 0; c < 3; ++c) {
        before += d[i][c] * d[i][c] / w;
        const double next = w * f[i][c];
        length += next * next / w;
        d[i][c] = next;
      }
    }
    if (!(length > 0.0) || !(before > 0.0)) return 0.0;
    lambda = std::sqrt(length / before);
    const double scale = 1.0 / std::sqrt(length);
    for (auto& p : d) for (double& value : p) value *= scale;
  }
  return lambda;
}

float greatestStrain(const net::KernelArrays& a) {
  constexpr std::size_t kLanes = 8;
  float most[kLanes] = {};
  for (std::size_t first = 0; first + kLanes <= a.links; first += kLanes) {
    for (std::size_t i = 0; i < kLanes; ++i) {
      const std::size_t e = first + i;
      const std::uint32_t p = a.knot0[e], q = a.knot1[e];
      const float dx = a.x[q] - a.x[p], dy = a.y[q] - a.y[p], dz = a.z[q] - a.z[p];
      const float ratio = std::sqrt(dx * dx + dy * dy + dz * dz) * a.inverse_rest[e];
      const float strain = a.modulus[e] != 0.0f ? ratio - 1.0f : 0.0f;
      most[i] = std::max(most[i], strain);
    }
  }
  return *std::max_element(most, most + kLanes);
}

double longestStep(const Rates& rates) {
  const double omega = std::sqrt(rates.omega_squared);
  if (!(omega > 0.0)) return rates.decay > 0.0 ? 2.0 / rates.decay : std::numeric_limits<double>::infinity();
  const double xi = rates.decay / (2.0 * omega);
  return 2.0 / omega * (std::sqrt(1.0 + xi * xi) - xi);
}

int subSteps(double dt, const Rates& rates) {
  const double needed = dt / (kStepMargin * longestStep(rates));
  if (!(needed < 1e9)) return 1000000000;
  return std::max(1, static_cast<int>(std::ceil(needed)));
}

}  // namespace vest::solver
