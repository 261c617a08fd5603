#include "vest_tissue/solver/step_bound.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace vest::solver {
namespace {

using net::Block;

/// Links' end points differ: unit vector, length, strain.
struct Way {
  float ux, uy, uz, length, strain;
};

struct Rows {
  const float *x, *y, *z, *w;
  explicit Rows(const BoundLinks& l)
      : x(l.block->row(Block::X)),
        y(l.block->row(Block::Y)),
        z(l.block->row(Block::Z)),
        w(l.block->row(Block::kInverseMass)) {}
};

Way arm(const Rows& a, const net::KernelLink& l) {
  Way r;
  const float dx = a.x[l.knot1] - a.x[l.knot0], dy = a.y[l.knot1] - a.y[l.knot0],
              dz = a.z[l.knot1] - a.z[l.knot0];
  r.length = std::sqrt(dx * dx + dy * dy + dz * dz + 1e-20f);
  r.ux = dx / r.length, r.uy = dy / r.length, r.uz = dz / r.length;
  r.strain = r.length / l.rest - 1.0f;
  return r;
}

/// Tension and tangent over the axial stiffness, dimensionless.
void lawOf(const net::LinkTable::LawConstants& c, bool by_law, float strain, float& tension, float& tangent) {
  if (!by_law || strain <= 0.0f) {
    tension = strain;
    tangent = 1.0f;
    return;
  }
  const float e = std::min(strain, c.max_strain);
  tension = e * (1.0f + e * (c.a2 + e * (c.a3 + e * c.a4))) + c.tail * (strain - e);
  tangent = 1.0f + e * (2 * c.a2 + e * (3 * c.a3 + e * 4 * c.a4));
}

void addTensor(std::vector<float>& t, std::size_t i, const Way& u, float along, float across) {
  float* const s = t.data() + 6 * i;
  const float d = along - across;
  s[0] += d * u.ux * u.ux + across;
  s[1] += d * u.uy * u.uy + across;
  s[2] += d * u.uz * u.uz + across;
  s[3] += d * u.ux * u.uy;
  s[4] += d * u.ux * u.uz;
  s[5] += d * u.uy * u.uz;
}

double greatest(const BoundLinks& l, const std::vector<float>& t) {
  const float* const w = l.block->row(Block::kInverseMass);
  double result = 0.0;
  for (std::size_t i = 0; i < l.block->knots(); ++i) {
    const float* const s = t.data() + 6 * i;
    const float rows = std::max({std::fabs(s[0]) + std::fabs(s[3]) + std::fabs(s[4]),
                                 std::fabs(s[3]) + std::fabs(s[1]) + std::fabs(s[5]),
                                 std::fabs(s[4]) + std::fabs(s[5]) + std::fabs(s[2])});
    const float trace = s[0] + s[1] + s[2];
    result = std::max(result, static_cast<double>(std::min(rows, trace)) * w[i]);
  }
  return 2.0 * result;
}

}  // namespace

Rates linkRates(const BoundLinks& links, BoundScratch& scratch) {
  std::fill(scratch.tensor.begin(), scratch.tensor.end(), 0.0f);
  const Rows rows(links);
  for (std::size_t i = 0; i < links.count; ++i) {
    const net::KernelLink& l = links.link(i);
    if (l.axial == 0.0f) continue;
    const Way u = arm(rows, l);
    float tension, tangent;
    lawOf(links.law, links.lawOf(i), u.strain, tension, tangent);
    const float along = l.axial * tangent / l.rest;
    const float across = std::max(l.axial * tension / u.length, 0.0f);
    addTensor(scratch.tensor, l.knot0, u, along, across);
    addTensor(scratch.tensor, l.knot1, u, along, across);
  }
  return {greatest(links, scratch.tensor), 0.0};
}

double linkDecay(const BoundLinks& links, BoundScratch& scratch) {
  std::fill(scratch.tensor.begin(), scratch.tensor.end(), 0.0f);
  const Rows rows(links);
  for (std::size_t i = 0; i < links.count; ++i) {
    const net::KernelLink& l = links.link(i);
    if (l.damping == 0.0f) continue;
    const Way u = arm(rows, l);
    addTensor(scratch.tensor, l.knot0, u, l.damping, 0.0f);
    addTensor(scratch.tensor, l.knot1, u, l.damping, 0.0f);
  }
  return greatest(links, scratch.tensor);
}

Rates elementRates(const net::Block& block, const net::Elements& elements, BoundScratch& scratch) {
  const float *x = block.row(Block::X), *y = block.row(Block::Y), *z = block.row(Block::Z);
  const float* w = block.row(Block::kInverseMass);
  std::fill(scratch.tensor.begin(), scratch.tensor.end(), 0.0f);
  float* const stiffness = scratch.tensor.data();
  float* const damping = stiffness + scratch.tensor.size() / 2;
  const auto add = [](float& to, double value) { to += static_cast<float>(value); };
  const auto distance = [&](std::uint32_t i, std::uint32_t j) {
    const double dx = x[i] - x[j], dy = y[i] - y[j], dz = z[i] - z[j];
    return std::sqrt(dx * dx + dy * dy + dz * dz);
  };
  for (const auto& b : elements.bending) {  // gradient of the angle: 1/l0, 1/l0 + 1/l1, 1/l1
    const double g0 = 1.0 / std::max(distance(b.a, b.b), 1e-9), g1 = 1.0 / std::max(distance(b.b, b.c), 1e-9);
    add(stiffness[b.a], 3.0 * b.stiffness * g0 * g0);
    add(stiffness[b.b], 3.0 * b.stiffness * (g0 + g1) * (g0 + g1));
    add(stiffness[b.c], 3.0 * b.stiffness * g1 * g1);
  }
  for (const auto& h : elements.hinges) {  // gradient of the dihedral angle: one over the wing's height
    const Eigen::Vector3d e0(x[h.edge0], y[h.edge0], z[h.edge0]), e1(x[h.edge1], y[h.edge1], z[h.edge1]);
    const Eigen::Vector3d a(x[h.wing0], y[h.wing0], z[h.wing0]), b(x[h.wing1], y[h.wing1], z[h.wing1]);
    const Eigen::Vector3d edge = e1 - e0;
    const double length = std::max(edge.norm(), 1e-9);
    const auto height = [&](const Eigen::Vector3d& p) {
      const Eigen::Vector3d d = p - e0;
      const Eigen::Vector3d off = d - edge * (d.dot(edge) / (length * length));
      return std::max({off.norm(), std::sqrt(static_cast<double>(h.least)), 1e-9});  // lower: it fades
    };
    const double ga = 1.0 / height(a), gb = 1.0 / height(b), ge = ga + gb;
    const double bent = 1.0 + 0.25 * h.rest * h.rest;         // d fold/d theta at rest
    const double k = 2.0 * h.stiffness * bent * bent * 10.0;  // folded and crushed ones are stiffer
    add(stiffness[h.wing0], k * ga * ga);
    add(stiffness[h.wing1], k * gb * gb);
    add(stiffness[h.edge0], k * ge * ge);
    add(stiffness[h.edge1], k * ge * ge);
  }
  for (const auto& p : elements.plastic) {
    const double k = 2.0 * p.kappa / (static_cast<double>(net::kPlasticWidth) * p.rest);
    add(stiffness[p.a], k), add(stiffness[p.b], k);
    add(damping[p.a], 2.0 * p.damping), add(damping[p.b], 2.0 * p.damping);
  }
  for (const auto& t : elements.tethers) add(stiffness[t.knot], t.stiffness), add(damping[t.knot], t.damping);
  Rates rates;
  for (std::size_t i = 0; i < block.knots(); ++i) {
    rates.omega_squared = std::max(rates.omega_squared, static_cast<double>(stiffness[i]) * w[i]);
    rates.decay = std::max(rates.decay, static_cast<double>(damping[i]) * w[i]);
  }
  rates.omega_squared += volumeRate(block, elements, scratch);
  return rates;
}

double volumeRate(const net::Block& block, const net::Elements& elements, BoundScratch& scratch) {
  const float *x = block.row(Block::X), *y = block.row(Block::Y), *z = block.row(Block::Z);
  const float* const w = block.row(Block::kInverseMass);
  double rate = 0.0;
  for (const auto& v : elements.volumes) {  // K/V0·g g^T: one mode, omega² = K/V0·sum |g_i|²/m_i
    if (v.bulk_modulus == 0.0f || v.triangles.empty()) continue;
    std::fill(scratch.tensor.begin(), scratch.tensor.end(), 0.0f);
    const auto g = [&](std::uint32_t k) {
      return Eigen::Map<Eigen::Vector3f>(scratch.tensor.data() + 3 * k);
    };
    for (const auto& t : v.triangles) {
      const Eigen::Vector3d p(x[t[0]], y[t[0]], z[t[0]]), q(x[t[1]], y[t[1]], z[t[1]]),
          r(x[t[2]], y[t[2]], z[t[2]]);
      const Eigen::Vector3d share = (q - p).cross(r - p) / 6.0;
      for (const auto i : t) g(i) += share.cast<float>();
    }
    double sum = 0.0;
    for (const auto i : v.knots) sum += static_cast<double>(g(i).squaredNorm()) * w[i];
    rate += v.bulk_modulus / v.rest * sum;
  }
  return rate;
}

double powerIteration(const BoundLinks& links, int iterations) {
  const Rows rows(links);
  const std::size_t knots = links.block->knots();
  std::vector<std::array<double, 3>> d(knots), f(knots);
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
    for (std::size_t i = 0; i < links.count; ++i) {
      const net::KernelLink& l = links.link(i);
      if (l.axial == 0.0f) continue;
      const Way u = arm(rows, l);
      float tension, tangent;
      lawOf(links.law, links.lawOf(i), u.strain, tension, tangent);
      const double along = l.axial * tangent / l.rest;
      const double across = std::max(l.axial * tension / u.length, 0.0f);
      const auto &p = d[l.knot0], &q = d[l.knot1];
      const double r[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
      const double on = (along - across) * (r[0] * u.ux + r[1] * u.uy + r[2] * u.uz);
      const double t[3] = {on * u.ux + across * r[0], on * u.uy + across * r[1], on * u.uz + across * r[2]};
      for (int c = 0; c < 3; ++c) f[l.knot0][c] -= t[c], f[l.knot1][c] += t[c];
    }
    double length = 0.0, before = 0.0;  // in the norm of the mass
    for (std::size_t i = 0; i < knots; ++i) {
      const double w = rows.w[i];
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
    for (auto& p : d)
      for (double& value : p) value *= scale;
  }
  return lambda;
}

float greatestStrain(const BoundLinks& links) {
  const Rows rows(links);
  float most = 0.0f;  // of (l/rest)²: the root is taken once
  for (std::size_t i = 0; i < links.count; ++i) {
    const net::KernelLink& l = links.link(i);
    const float dx = rows.x[l.knot1] - rows.x[l.knot0], dy = rows.y[l.knot1] - rows.y[l.knot0],
                dz = rows.z[l.knot1] - rows.z[l.knot0];
    const float ratio = (dx * dx + dy * dy + dz * dz) / (l.rest * l.rest);
    most = l.axial != 0.0f && ratio > most ? ratio : most;
  }
  return std::max(0.0f, std::sqrt(most) - 1.0f);
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
