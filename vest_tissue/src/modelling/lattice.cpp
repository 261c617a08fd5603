#include "vest_tissue/modelling/lattice.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <Eigen/Dense>

namespace vest::modelling {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using scene::Index;

[[noreturn]] void refuse(const char* field, double value, const char* allowed) {
  std::ostringstream out;
  out << "lattice." << field << ": " << value << " (" << allowed << ")";
  throw std::invalid_argument(out.str());
}

void check(const Lattice& l) {
  for (const int n : l.cells)
    if (n < 1) refuse("cells", n, ">= 1");
  if (l.knots() > 65535) refuse("cells", static_cast<double>(l.knots()), "at most 65535 knots");
  if (!(l.cell > 0.0) || !std::isfinite(l.cell)) refuse("cell", l.cell, "> 0 m");
  if (!(l.poisson_ratio >= 0.25 && l.poisson_ratio <= 0.4999))
    refuse("poisson_ratio", l.poisson_ratio, "0.25 … 0.4999: central springs give 1/4, volumes add to it");
  if (!material::isMonotone(l.law)) refuse("law.youngs_modulus", l.law.youngs_modulus, "> 0, monotone law");
  if (!(l.density > 0.0)) refuse("density", l.density, "> 0 kg/m³");
  if (!(l.damping_time >= 0.0)) refuse("damping_time", l.damping_time, ">= 0 s");
}

/// Share of a knot's, link's or face's cell that lies in the block: half for each face that it lies in.
double share(const Lattice& l, const std::array<int, 3>& at, const std::array<int, 3>& step) {
  double s = 1.0;
  for (int c = 0; c < 3; ++c)
    if (step[c] == 0 && (at[c] == 0 || at[c] == l.cells[c])) s *= 0.5;
  return s;
}

struct Lame {
  double lambda, mu;
};
Lame lameOf(double youngs, double nu) {
  return {youngs * nu / ((1 + nu) * (1 - 2 * nu)), youngs / (2 * (1 + nu))};
}

constexpr std::array<std::array<int, 3>, 9> kSteps{
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, -1, 0}, {0, 1, 1}, {0, 1, -1}, {1, 0, 1}, {1, 0, -1}}};

}  // namespace

std::size_t Lattice::knots() const {
  return static_cast<std::size_t>(cells[0] + 1) * (cells[1] + 1) * (cells[2] + 1);
}
Index Lattice::knot(int i, int j, int k) const {
  return static_cast<Index>((k * (cells[1] + 1) + j) * (cells[0] + 1) + i);
}
Vector3d Lattice::size() const {
  return cell * Vector3d(cells[0], cells[1], cells[2]);
}

scene::Object makeLattice(const Lattice& l) {
  check(l);
  scene::Object o;
  o.name = "lattice";
  o.law = l.law;
  o.density = l.density;
  o.rest_position.resize(l.knots());
  o.mass.resize(l.knots());
  const Lame lame = lameOf(l.law.youngs_modulus, l.poisson_ratio);
  const double stiffness = lame.mu * l.cell;
  const std::array<int, 3>& n = l.cells;
  for (int k = 0; k <= n[2]; ++k)
    for (int j = 0; j <= n[1]; ++j)
      for (int i = 0; i <= n[0]; ++i) {
        const Index here = l.knot(i, j, k);
        o.rest_position[here] = l.low + l.cell * Vector3d(i, j, k);
        o.mass[here] = l.density * l.cell * l.cell * l.cell * share(l, {i, j, k}, {0, 0, 0});
        for (const auto& s : kSteps) {
          const int to[3] = {i + s[0], j + s[1], k + s[2]};
          if (to[0] > n[0] || to[1] < 0 || to[1] > n[1] || to[2] < 0 || to[2] > n[2]) continue;
          scene::Link link;
          link.knot0 = here;
          link.knot1 = l.knot(to[0], to[1], to[2]);
          link.rest = l.cell * std::sqrt(double(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]));
          const double part = stiffness * share(l, {i, j, k}, s);
          link.area = part * link.rest / l.law.youngs_modulus;
          link.damping = part * l.damping_time;
          o.links.push_back(link);
        }
        if (i == n[0] || j == n[1] || k == n[2] || !(lame.lambda > lame.mu * (1 + 1e-9))) continue;
        scene::VolumeElement v;
        v.bulk_modulus = lame.lambda - lame.mu;
        const auto at = [&](int a, int b, int c) { return l.knot(i + a, j + b, k + c); };
        // Two triangles a face, their diagonals so that each comes twice in a pair of cells, outward.
        const std::array<std::array<Index, 4>, 6> faces{
            {{at(0, 0, 0), at(0, 1, 0), at(1, 1, 0), at(1, 0, 0)},
             {at(0, 0, 1), at(1, 0, 1), at(1, 1, 1), at(0, 1, 1)},
             {at(0, 0, 0), at(1, 0, 0), at(1, 0, 1), at(0, 0, 1)},
             {at(0, 1, 0), at(0, 1, 1), at(1, 1, 1), at(1, 1, 0)},
             {at(0, 0, 0), at(0, 0, 1), at(0, 1, 1), at(0, 1, 0)},
             {at(1, 0, 0), at(1, 1, 0), at(1, 1, 1), at(1, 0, 1)}}};
        for (const auto& f : faces) {
          v.triangles.push_back({f[0], f[1], f[2]});
          v.triangles.push_back({f[0], f[2], f[3]});
        }
        o.volumes.push_back(v);
      }
  o.position = o.rest_position;
  o.damping.assign(l.knots(), 0.0);
  o.fixed.assign(l.knots(), 0);
  return o;
}

std::vector<Vector3d> uniformTraction(const Lattice& l, const Matrix3d& stress) {
  std::vector<Vector3d> f(l.knots(), Vector3d::Zero());
  const std::array<int, 3>& n = l.cells;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {0, n[axis]})
      for (int a = 0; a <= n[(axis + 1) % 3]; ++a)
        for (int b = 0; b <= n[(axis + 2) % 3]; ++b) {
          std::array<int, 3> at{}, step{};
          at[axis] = side, at[(axis + 1) % 3] = a, at[(axis + 2) % 3] = b;
          step[axis] = 1;  // only the other two directions halve the area
          const double area = l.cell * l.cell * share(l, at, step);
          f[l.knot(at[0], at[1], at[2])] += (side == 0 ? -area : area) * stress.col(axis);
        }
  return f;
}

BarResponse barResponse(const material::Law& links, double nu, double strain) {
  const Lame lame = lameOf(1.0, nu);
  material::Law law = links;
  law.youngs_modulus = 1.0;
  // Energy of a cell over a³ with stretches p along, q across: links of stiffness mu·a, half their strain
  // energy times rest² each; one edge link and two diagonals a direction and plane.
  const double kappa = lame.lambda - lame.mu;
  const double p = 1.0 + strain;
  const auto diagonal = [](double a, double b) { return std::sqrt(0.5 * (a * a + b * b)); };
  // dW/dq = 0 by Newton with a numerical slope: smooth and monotone.
  const auto across = [&](double q) {
    const double d = diagonal(p, q);
    const double links_part = lame.mu * (2.0 * material::stress(law, q - 1) +
                                         4.0 * 2.0 * material::stress(law, d - 1) * q / (2.0 * d) +
                                         2.0 * 2.0 * material::stress(law, q - 1));
    return links_part + kappa * (p * q * q - 1.0) * 2.0 * p * q;
  };
  double q = 1.0 - nu * strain;
  for (int i = 0; i < 60; ++i) {
    const double h = 1e-7, slope = (across(q + h) - across(q - h)) / (2 * h), step = across(q) / slope;
    q = std::clamp(q - step, 0.2, 3.0);
    if (std::fabs(step) < 1e-14) break;
  }
  const double d = diagonal(p, q);
  BarResponse r;
  r.across = q - 1.0;
  r.stress =
      lame.mu * (material::stress(law, strain) + 4.0 * 2.0 * material::stress(law, d - 1) * p / (2.0 * d)) +
      kappa * (p * q * q - 1.0) * q * q;
  return r;
}

LinkLaw fitLinkLaw(const material::Law& tissue, double nu) {
  constexpr int kSamples = 40;
  material::Law wanted = tissue;
  wanted.youngs_modulus = 1.0;
  LinkLaw best{tissue, 0.0};
  Eigen::Vector3d a(tissue.a2, tissue.a3, tissue.a4);
  const auto lawOf = [&](const Eigen::Vector3d& c) {
    material::Law law = tissue;
    law.a2 = c[0], law.a3 = c[1], law.a4 = c[2];
    return law;
  };
  Eigen::VectorXd scale(kSamples);
  const auto residual = [&](const Eigen::Vector3d& c) {
    Eigen::VectorXd r(kSamples);
    for (int i = 0; i < kSamples; ++i) {
      const double e = tissue.max_strain * (i + 1) / kSamples;
      r[i] = barResponse(lawOf(c), nu, e).stress - material::stress(wanted, e);
    }
    return r;
  };
  const double top = material::stress(wanted, tissue.max_strain);
  Eigen::VectorXd r = residual(a);
  const auto worst = [&](const Eigen::VectorXd& v) { return v.cwiseAbs().maxCoeff() / top; };
  best.residual = worst(r);
  double damping = 1e-3;
  for (int round = 0; round < 40; ++round) {
    Eigen::Matrix<double, kSamples, 3> jacobian;
    for (int c = 0; c < 3; ++c) {
      Eigen::Vector3d more = a;
      const double h = 1e-5 * std::max(1.0, std::fabs(a[c]));
      more[c] += h;
      jacobian.col(c) = (residual(more) - r) / h;
    }
    Matrix3d normal = jacobian.transpose() * jacobian;
    normal.diagonal() *= 1.0 + damping;
    const Eigen::Vector3d next = a - normal.ldlt().solve(jacobian.transpose() * r);
    material::Law law = lawOf(next);
    const Eigen::VectorXd after = residual(next);
    if (material::isMonotone(law) && after.squaredNorm() < r.squaredNorm()) {
      const bool done = r.squaredNorm() - after.squaredNorm() < 1e-14 * r.squaredNorm();
      a = next, r = after, damping *= 0.3;
      best = {law, worst(r)};
      if (done) break;
    } else {
      damping *= 10.0;
      if (damping > 1e12) break;
    }
  }
  return best;
}

}  // namespace vest::modelling
