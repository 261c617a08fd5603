#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include <Eigen/Geometry>

#include "sections.h"
#include "vest_tissue/fem/element.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/solver/net_energy.h"

namespace vest::validate {
namespace {

using Eigen::Vector3d;
using net::Block;
using scene::LinkKind;

// ---- the kinds: one that is added without a case here does not compile.

/// An element kind on five knots: what a scene says.
struct Kind {
  std::string name;
  std::function<void(scene::Object&)> put;
  std::function<std::size_t(const scene::ObjectState&)> count;  ///< how many of it the built net holds
  bool damps = false;
};

scene::Link link(LinkKind kind, scene::Index a, scene::Index b) {
  scene::Link l;
  l.kind = kind, l.knot0 = a, l.knot1 = b;
  return l;
}

/// Every kind of link. -Wswitch is an error here: a new one needs a case.
#pragma GCC diagnostic push
#pragma GCC diagnostic error "-Wswitch"
std::vector<Kind> kindsOf(LinkKind kind) {
  using scene::Object;
  using scene::ObjectState;
  switch (kind) {
    case LinkKind::Elastic:
      return {{"link, elastic, fourth-order law",
               [](Object& o) {
                 o.links = {link(LinkKind::Elastic, 0, 1), link(LinkKind::Elastic, 1, 2),
                            link(LinkKind::Elastic, 0, 3)};
                 for (auto& l : o.links) l.rest = 0.009, l.area = 2e-6, l.damping = 0.03;
               },
               [](const ObjectState& s) { return s.law_links.linkCount(); }, true},
              {"link, elastic, linear",
               [](Object& o) {
                 o.links = {link(LinkKind::Elastic, 0, 1), link(LinkKind::Elastic, 2, 3)};
                 for (auto& l : o.links) l.rest = 0.008, l.stiffness = 40.0, l.damping = 0.02;
               },
               [](const ObjectState& s) { return s.linear_links.linkCount(); }, true}};
    case LinkKind::Viscous:
      return {{"link, viscous",
               [](Object& o) {
                 o.links = {link(LinkKind::Viscous, 0, 1), link(LinkKind::Viscous, 1, 3)};
                 for (auto& l : o.links) l.damping = 0.2;
               },
               [](const ObjectState& s) { return s.linear_links.linkCount(); }, true}};
    case LinkKind::Plastic:
      return {{"link, plastic",
               [](Object& o) {
                 o.links = {link(LinkKind::Plastic, 0, 1), link(LinkKind::Plastic, 1, 2)};
                 for (auto& l : o.links)
                   l.rest = 0.995 * (o.rest_position[l.knot1] - o.rest_position[l.knot0]).norm(),
                   l.stiffness = 0.2, l.damping = 0.3;
                 o.links[1].rest *= 0.8;
               },
               [](const ObjectState& s) { return s.elements.plastic.size(); }, true}};
    case LinkKind::Bending:
      return {{"link, bending",
               [](Object& o) {
                 o.links = {link(LinkKind::Bending, 0, 1), link(LinkKind::Bending, 1, 2)};
                 o.links[0].knot2 = 2, o.links[0].rest = M_PI, o.links[0].stiffness = 2e-4;
                 o.links[1].knot2 = 3, o.links[1].rest = 2.2, o.links[1].stiffness = 1e-4;
               },
               [](const ObjectState& s) { return s.elements.bending.size(); }}};
  }
  return {};
}
#pragma GCC diagnostic pop

std::vector<Kind> kinds() {
  using scene::Object;
  using scene::ObjectState;
  {  // The members of net::Elements: one more does not compile until it has a case below.
    const net::Elements all;
    const auto& [bending, hinges, plastic, tethers, volumes] = all;
    (void)bending, (void)hinges, (void)plastic, (void)tethers, (void)volumes;
  }
  std::vector<Kind> result;
  for (const auto kind : {LinkKind::Elastic, LinkKind::Viscous, LinkKind::Plastic, LinkKind::Bending})
    for (auto& k : kindsOf(kind)) result.push_back(k);
  result.push_back({"hinge",
                    [](Object& o) {
                      scene::HingeElement h;
                      h.knots = {0, 1, 2, 3}, h.stiffness = 3e-5;
                      o.rest_position[3] = {0.003, -0.009, 0.003};  // open: closed folds keep their moment
                      o.hinges.push_back(h);
                    },
                    [](const ObjectState& s) { return s.elements.hinges.size(); }});
  result.push_back({"tether",
                    [](Object& o) {
                      o.tethers.push_back({1, {0.01, 0.02, 0.0}, 30.0, 0.4});
                    },
                    [](const ObjectState& s) { return s.elements.tethers.size(); }, true});
  result.push_back({"volume",
                    [](Object& o) {
                      scene::VolumeElement v;
                      v.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
                      v.bulk_modulus = 5e4;
                      o.volumes.push_back(v);
                    },
                    [](const ObjectState& s) { return s.elements.volumes.size(); }});
  return result;
}

// ---- measured on the float kernels that the World runs, against the energy in double

struct Result {
  double gradient = NAN;  ///< greatest difference of force and -dE/dx over the greatest force
  double power = NAN;  ///< greatest power of what depends on velocity, over its size; <= 0: takes energy out
  double balance = NAN;  ///< sum of forces over the greatest, of kinds without a place of their own
};

Result measure(const Kind& kind) {
  scene::Description d;
  d.name = "kind";
  scene::Object o;
  o.name = "kind";
  o.law = {2e4, 1.0, 4.0, 9.0, 0.4};
  o.rest_position = {
      {0, 0, 0}, {0.010, 0.001, 0}, {0.004, 0.009, 0.002}, {0.003, 0.002, 0.009}, {0.02, 0.01, 0.03}};
  o.mass.assign(5, 1e-3);
  o.damping.assign(5, 0.0);
  o.fixed.assign(5, 0);
  kind.put(o);
  o.position = o.rest_position;
  d.objects.push_back(o);
  const auto model = scene::buildModel(d);
  scene::ObjectState s = model->start.objects[0];
  Result r;
  if (kind.count(s) == 0) return r;
  solver::NetView net;
  net.links.block = &s.block;
  net.links.count = s.links.size();
  net.links.stride = sizeof(scene::NetLink);
  if (!s.links.empty()) net.links.first = &s.links[0].values, net.links.by_law = &s.links[0].by_law;
  net.links.law = s.law_links.law();
  net.elements = &s.elements;

  std::mt19937 random(11);
  std::uniform_real_distribution<double> shake(-1.5e-3, 1.5e-3), speed(-0.2, 0.2);
  const auto at = [](Block::KnotRow first, int axis) { return static_cast<Block::KnotRow>(first + axis); };
  const auto forces = [&] {
    for (int a = 0; a < 3; ++a) std::fill_n(s.block.row(at(Block::FX, a)), 5, 0.0f);
    net::addLinkForces(s.law_links, s.block.knotArrays(), net::chooseKernelLevel());
    net::addLinkForces(s.linear_links, s.block.knotArrays(), net::chooseKernelLevel());
    const net::ElementArrays arrays{s.block.row(Block::X),  s.block.row(Block::Y),  s.block.row(Block::Z),
                                    s.block.row(Block::VX), s.block.row(Block::VY), s.block.row(Block::VZ),
                                    s.block.row(Block::FX), s.block.row(Block::FY), s.block.row(Block::FZ)};
    net::addElements(s.elements, arrays, net::chooseKernelLevel());
    net::addVolumes(s.elements.volumes, arrays);
    std::vector<Vector3d> f(5);
    for (int i = 0; i < 5; ++i)
      for (int a = 0; a < 3; ++a) f[i][a] = s.block.row(at(Block::FX, a))[i];
    return f;
  };
  r.gradient = 0.0, r.balance = 0.0, r.power = -1e300;
  for (int shape = 0; shape < 20; ++shape) {
    solver::Positions x(5);
    for (int i = 0; i < 5; ++i)
      for (int a = 0; a < 3; ++a) {
        const float value = static_cast<float>(o.rest_position[i][a] + shake(random));
        s.block.row(at(Block::X, a))[i] = value, x[i][a] = value;
        s.block.row(at(Block::VX, a))[i] = 0.0f;
      }
    const auto still = forces();
    double greatest = 1e-12;
    Vector3d sum = Vector3d::Zero();
    for (const auto& f : still) greatest = std::max(greatest, f.norm()), sum += f;
    if (s.elements.tethers.empty()) r.balance = std::max(r.balance, sum.norm() / greatest);
    for (int i = 0; i < 5; ++i)
      for (int a = 0; a < 3; ++a) {
        const double h = 1e-8, keep = x[i][a];
        x[i][a] = keep + h;
        const double more = solver::netEnergy(net, x);
        x[i][a] = keep - h;
        const double less = solver::netEnergy(net, x);
        x[i][a] = keep;
        r.gradient = std::max(r.gradient, std::fabs(still[i][a] + (more - less) / (2 * h)) / greatest);
      }
    double power = 0.0, size = 1e-12;
    std::vector<Vector3d> v(5);
    for (int i = 0; i < 5; ++i)
      for (int a = 0; a < 3; ++a)
        v[i][a] = s.block.row(at(Block::VX, a))[i] = static_cast<float>(speed(random));
    const auto moving = forces();
    for (int i = 0; i < 5; ++i)
      power += (moving[i] - still[i]).dot(v[i]),
          size += still[i].norm() * v[i].norm() + (moving[i] - still[i]).norm() * v[i].norm();
    r.power = std::max(r.power, power / size);
  }
  return r;
}

/// Finite elements: forces of one tetrahedron against its energy, small and corotational.
double tetrahedron(bool turned) {
  const std::array<Vector3d, 4> rest{Vector3d{0, 0, 0}, Vector3d{1, 0.1, 0}, Vector3d{0.2, 0.9, 0.1},
                                     Vector3d{0.1, 0.2, 1.1}};
  const auto element = fem::makeElement({0, 1, 2, 3}, rest);
  fem::Material material;
  material.youngs_modulus = 1000.0, material.poisson_ratio = 0.3;
  const auto law = fem::lame(material);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> shake(-0.2, 0.2);
  std::array<Vector3d, 4> u;
  for (auto& p : u) p = {shake(random), shake(random), shake(random)};
  const auto rotation = [&](const Eigen::Matrix3d& g) -> Eigen::Matrix3d {
    return turned ? fem::nearestRotation(Eigen::Matrix3d::Identity() + g)
                  : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  };
  const auto energy = [&] {
    const Eigen::Matrix3d g = fem::displacementGradient(element, u);
    return fem::energy(element, law, g, rotation(g));
  };
  const Eigen::Matrix3d g = fem::displacementGradient(element, u), r = rotation(g);
  std::array<Vector3d, 4> f;
  fem::cornerForces(element, law, r,
                    r.transpose() * (Eigen::Matrix3d::Identity() + g) - Eigen::Matrix3d::Identity(), f);
  double greatest = 0.0, error = 0.0;
  for (const auto& p : f) greatest = std::max(greatest, p.norm());
  for (int i = 0; i < 4; ++i)
    for (int a = 0; a < 3; ++a) {
      const double h = 1e-6, keep = u[i][a];
      u[i][a] = keep + h;
      const double more = energy();
      u[i][a] = keep - h;
      const double less = energy();
      u[i][a] = keep;
      error = std::max(error, std::fabs(f[i][a] + (more - less) / (2 * h)) / greatest);
    }
  return error;
}

}  // namespace

validation::Section forcesSection(const Options&, const std::string& command) {
  validation::Section s("12_forces", "Every force against its energy", command);
  s.text(
      "Each kind of element that a net can hold, on random shapes: the force of the World's own kernels "
      "against "
      "central differences of the energy in double, and the power\nof what depends on velocity, which must "
      "take energy out. "
      "A kind that is added without a case does not compile (tools/validate/forces.cpp).");
  std::vector<std::vector<std::string>> rows;
  for (const Kind& kind : kinds()) {
    const Result r = measure(kind);
    rows.push_back({kind.name, validation::digits(r.gradient), validation::digits(r.balance),
                    kind.damps ? validation::digits(r.power) : "none"});
    s.atMost(kind.name + ": force and -dE/dx differ by", r.gradient, 2e-3, "of the greatest force");
    s.atMost(kind.name + ": sum of its forces", r.balance, 1e-4, "of the greatest force");
    // Without dampers nothing depends on velocity: exactly 0.
    s.atMost(kind.name + ": power of its damping", r.power, kind.damps ? -1e-6 : 0.0, "of force times speed");
  }
  s.table({"kind", "force against energy", "sum of forces", "greatest power"}, rows);
  s.atMost("tetrahedron, small strain: force and -dE/dx differ by", tetrahedron(false), 1e-6,
           "of the greatest force");
  s.atMost("tetrahedron, corotational: force and -dE/dx differ by", tetrahedron(true), 1e-6,
           "of the greatest force");
  return s;
}

}  // namespace vest::validate
