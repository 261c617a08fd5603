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

scene::Object cutBar(const scene::Object& net, std::uint32_t first, std::uint32_t last) {
  scene::Object bar;
  bar.name = net.name;
  bar.law = net.law;
  std::vector<scene::Index> place(net.rest_position.size(), ~0u);
  for (std::uint32_t r = first; r <= last; ++r) {
    bar.tube.station.push_back(net.tube.station.at(r));
    auto& ring = bar.tube.rings.emplace_back();
    for (const scene::Index knot : net.tube.rings.at(r)) {
      place[knot] = static_cast<scene::Index>(bar.rest_position.size());
      ring.push_back(place[knot]);
      bar.rest_position.push_back(net.rest_position[knot]);
      bar.mass.push_back(net.mass[knot]);
    }
  }
  bar.position = bar.rest_position;
  bar.damping.assign(bar.mass.size(), 0.0);
  bar.fixed.assign(bar.mass.size(), 0);
  for (scene::Link link : net.links) {
    link.knot0 = place[link.knot0], link.knot1 = place[link.knot1];
    if (link.knot0 != ~0u && link.knot1 != ~0u) bar.links.push_back(link);
  }
  return bar;
}

double barModulus(const scene::Object& bar, const std::vector<double>& section) {
  const auto& rings = bar.tube.rings;
  if (rings.size() < 6 || section.size() + 1 != rings.size())
    throw std::invalid_argument("object '" + bar.name + "': " + std::to_string(rings.size()) + " rings and " +
                                std::to_string(section.size()) +
                                " sections (allowed: 6 rings or more, and a section between each two)");
  const auto centre = [](const std::vector<scene::Index>& ring, const std::vector<Vector3d>& of) {
    Vector3d sum = Vector3d::Zero();
    for (const scene::Index knot : ring) sum += of[knot];
    return Vector3d(sum / static_cast<double>(ring.size()));
  };
  const auto& p = bar.rest_position;
  const Vector3d chord = (centre(rings.back(), p) - centre(rings.front(), p)).normalized();
  std::vector<double> reach(p.size(), 0.0);
  for (const scene::Link& l : bar.links) {
    const double along = l.area * std::fabs((p[l.knot1] - p[l.knot0]).normalized().dot(chord));
    reach[l.knot0] += along, reach[l.knot1] += along;
  }
  const double force = kSmall * bar.law.youngs_modulus * section.front();
  std::vector<Vector3d> f(p.size(), Vector3d::Zero());
  for (const bool back : {false, true}) {
    const auto& ring = back ? rings.back() : rings.front();
    double sum = 0.0;
    for (const scene::Index knot : ring) sum += reach[knot];
    for (const scene::Index knot : ring) f[knot] = (back ? force : -force) * reach[knot] / sum * chord;
  }
  const auto x = respond(bar, f);
  double longer = 0.0, per_modulus = 0.0;
  for (std::size_t r = 2; r + 3 < rings.size(); ++r) {  // an end's forces even out within two rings
    const Vector3d step = centre(rings[r + 1], p) - centre(rings[r], p), along = step.normalized();
    longer += along.dot(centre(rings[r + 1], x) - centre(rings[r], x) - step);
    per_modulus += force * along.dot(chord) * step.norm() / section[r];
  }
  return per_modulus / longer;
}

}  // namespace vest::modelling
