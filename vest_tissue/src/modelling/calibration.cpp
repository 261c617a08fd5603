#include "vest_tissue/modelling/calibration.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include <Eigen/Dense>

#include "../scene/object_arrays.h"
#include "vest_tissue/solver/implicit_net.h"

namespace vest::modelling {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kSmall = 1e-4;  // strain, no unit: rounding and second order are both far below

/// Least squares of u = H·X + t.
Matrix3d affine(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to) {
  Vector3d x0 = Vector3d::Zero(), u0 = Vector3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) x0 += from[i], u0 += to[i] - from[i];
  x0 /= static_cast<double>(from.size()), u0 /= static_cast<double>(from.size());
  Matrix3d xx = Matrix3d::Zero(), ux = Matrix3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vector3d x = from[i] - x0;
    xx += x * x.transpose();
    ux += (to[i] - from[i] - u0) * x.transpose();
  }
  return ux * xx.ldlt().solve(Matrix3d::Identity());
}

}  // namespace

namespace {

/// A net on its own, as the solver wants it.
struct Specimen {
  std::unique_ptr<scene::WorldModel> model;
  solver::NetView view;
  explicit Specimen(const scene::Object& net) {
    scene::Description d;
    d.name = "specimen";
    d.objects.push_back(net);
    d.objects[0].position = net.rest_position;
    model = scene::buildModel(d);
    view = scene::netView(model->start.objects[0]);
  }
};

/// Positions under small forces: linear.
std::vector<Vector3d> respond(const scene::Object& net, const std::vector<Vector3d>& forces) {
  const Specimen specimen(net);
  solver::ImplicitNet solver(specimen.view, 0);
  solver::Positions u;
  solver.respond(specimen.view, net.rest_position, forces, u);
  for (std::size_t i = 0; i < u.size(); ++i) u[i] += net.rest_position[i];
  return u;
}

}  // namespace

std::vector<Vector3d> equilibrium(const scene::Object& net, const std::vector<Vector3d>& forces) {
  const Specimen specimen(net);
  solver::ImplicitNet solver(specimen.view, 0);
  solver::Positions x = net.rest_position;
  solver::ImplicitNet::Options options;
  options.iterations = 60;
  Vector3d low = x[0], high = x[0];
  for (const auto& p : x) low = low.cwiseMin(p), high = high.cwiseMax(p);
  options.tolerance = 1e-9 * (high - low).maxCoeff();
  for (int round = 0; round < 4; ++round)
    if (solver.settle(specimen.view, x, forces, options).converged) return x;
  throw std::runtime_error("object '" + net.name + "': no equilibrium found");
}

Matrix3d displacementGradient(const scene::Object& net, const std::vector<Vector3d>& x) {
  return affine(net.rest_position, x);
}

Moduli moduliOf(const Lattice& lattice) {
  const scene::Object net = makeLattice(lattice);
  const double stress = kSmall * lattice.law.youngs_modulus;
  Matrix3d pull = Matrix3d::Zero(), shear = Matrix3d::Zero();
  pull(2, 2) = stress;
  shear(0, 2) = shear(2, 0) = stress;
  const Matrix3d h = displacementGradient(net, respond(net, uniformTraction(lattice, pull)));
  const Matrix3d g = displacementGradient(net, respond(net, uniformTraction(lattice, shear)));
  return {stress / h(2, 2), -0.5 * (h(0, 0) + h(1, 1)) / h(2, 2), stress / (g(0, 2) + g(2, 0))};
}

double bendingModulus(const Lattice& lattice) {
  const scene::Object net = makeLattice(lattice);
  const Vector3d size = lattice.size();
  const double inertia = size.y() * size.x() * size.x() * size.x() / 12.0;
  const Vector3d centre = lattice.low + 0.5 * size;
  // Stress that grows across the bar on its two ends, scaled to the moment exactly.
  Matrix3d unit = Matrix3d::Zero();
  unit(2, 2) = 1.0;
  std::vector<Vector3d> f = uniformTraction(lattice, unit);
  double moment = 0.0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    const double x = net.rest_position[i].x() - centre.x();
    f[i] = Vector3d(0, 0, f[i].z() * x);
    if (net.rest_position[i].z() > centre.z()) moment += f[i].z() * x;
  }
  const double curvature = kSmall / size.x(), wanted = lattice.law.youngs_modulus * inertia * curvature;
  for (auto& force : f) force *= wanted / moment;
  const auto x = respond(net, f);
  // Turn of the cross-sections over the middle half, where the ends' stress has evened out.
  double weight = 0.0, turn = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double z = net.rest_position[i].z() - centre.z(), across = net.rest_position[i].x() - centre.x();
    if (std::fabs(z) > 0.25 * size.z() + 1e-9 || z == 0.0) continue;
    turn += (x[i].z() - net.rest_position[i].z()) * z * across;
    weight += z * z * across * across;
  }
  return wanted / (inertia * (turn / weight));
}

Bar pullBar(const scene::Object& net, int axis, double area, double strain) {
  const auto& p = net.rest_position;
  double low = p[0][axis], high = low;
  for (const auto& x : p) low = std::min(low, x[axis]), high = std::max(high, x[axis]);
  const double length = high - low, slack = 1e-6 * length;
  std::vector<double> reach(p.size(), 0.0);
  for (const scene::Link& l : net.links) {
    if (l.kind != scene::LinkKind::Elastic) continue;
    const Vector3d u = p[l.knot1] - p[l.knot0];
    const double size = l.stiffness > 0.0 ? l.stiffness * l.rest : net.law.youngs_modulus * l.area;
    const double along = size * std::fabs(u[axis]) / u.norm();
    reach[l.knot0] += along, reach[l.knot1] += along;
  }
  double sums[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i][axis] < low + slack) sums[0] += reach[i];
    if (p[i][axis] > high - slack) sums[1] += reach[i];
  }
  if (!(sums[0] > 0.0) || !(sums[1] > 0.0))
    throw std::invalid_argument("object '" + net.name + "': no links along axis " + std::to_string(axis) +
                                " at an end (allowed: knots at both ends with elastic links)");
  const double force = strain * net.law.youngs_modulus * area;
  std::vector<Vector3d> f(p.size(), Vector3d::Zero());
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i][axis] < low + slack) f[i][axis] = -force * reach[i] / sums[0];
    if (p[i][axis] > high - slack) f[i][axis] = force * reach[i] / sums[1];
  }
  scene::Object loose = net;
  loose.fixed.assign(p.size(), 0);
  const auto x = respond(loose, f);
  double ends[2] = {0.0, 0.0};
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (p[i][axis] < low + slack) ends[0] += (x[i][axis] - p[i][axis]) * reach[i] / sums[0];
    if (p[i][axis] > high - slack) ends[1] += (x[i][axis] - p[i][axis]) * reach[i] / sums[1];
  }
  const Matrix3d h = displacementGradient(net, x);
  Bar bar;
  bar.youngs = force * length / (area * (ends[1] - ends[0]));
  bar.poisson = -0.5 * (h.trace() - h(axis, axis)) / h(axis, axis);
  return bar;
}

Bar calibrateBar(scene::Object& net, int axis, double area, int rounds) {
  Bar bar = pullBar(net, axis, area);
  for (int round = 0; round < rounds; ++round) {
    const double factor = net.law.youngs_modulus / bar.youngs;
    if (std::fabs(factor - 1.0) < 1e-6) break;
    if (!(factor > 0.0)) throw std::runtime_error("object '" + net.name + "': its bar has no stiffness");
    for (scene::Link& l : net.links)
      if (l.kind == scene::LinkKind::Elastic && l.stiffness == 0.0) l.area *= factor;
    bar = pullBar(net, axis, area);
  }
  return bar;
}

}  // namespace vest::modelling
