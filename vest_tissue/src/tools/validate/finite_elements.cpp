#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "beam.h"
#include "sections.h"
#include "vest_tissue/fem/condensed.h"
#include "vest_tissue/fem/simulate.h"

namespace vest::validate {
namespace {

using Eigen::Vector3d;
using fem::Description;
using fem::Index;
using fem::test::Box;
using validation::digits;

std::vector<Vector3d> solve(const Description& d, std::vector<Vector3d>* reactions = nullptr) {
  fem::Options o;
  o.equilibrium = true;
  const auto r = fem::simulate(d, o);
  if (reactions != nullptr) *reactions = r.reactions;
  return r.positions;
}

double largest(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}

void patch(validation::Section& s) {
  const Box b{4, 3, 3, 1.0, 0.8, 0.7};
  Description d = fem::test::makeBox(b, false);
  fem::test::shake(d, 0.05);
  Eigen::Matrix3d h;
  h << 0.01, 0.004, -0.003, 0.002, -0.008, 0.005, 0.001, 0.003, 0.006;
  std::vector<Vector3d> expected;
  for (const auto& x : d.nodes) expected.push_back(x + h * x);
  for (int i = 0; i <= b.nx; ++i)
    for (int j = 0; j <= b.ny; ++j)
      for (int k = 0; k <= b.nz; ++k)
        if (i == 0 || j == 0 || k == 0 || i == b.nx || j == b.ny || k == b.nz)
          d.prescribed.push_back({b.node(i, j, k), h * d.nodes[b.node(i, j, k)]});
  s.atMost("patch test: a linear field on the boundary, inner nodes' error over the largest displacement",
           largest(solve(d), expected) / largest(expected, d.nodes), 1e-9, "no unit");
}

void reciprocityAndReactions(validation::Section& s) {
  const Box b{5, 3, 3, 1.0, 0.5, 0.4};
  Description d = fem::test::makeBox(b);
  fem::test::shake(d, 0.03);
  const Index p = b.node(3, 0, 3), q = b.node(5, 2, 1);
  Description first = d, second = d;
  first.loads.push_back({p, {0.3, -0.2, 0.5}});
  second.loads.push_back({q, {-0.1, 0.4, 0.2}});
  std::vector<Vector3d> reactions;
  const auto x1 = solve(first, &reactions), x2 = solve(second);
  const double a = first.loads[0].force.dot(x2[p] - d.nodes[p]),
               c = second.loads[0].force.dot(x1[q] - d.nodes[q]);
  s.atMost("reciprocity: work of one load on the other's displacement, both ways",
           std::fabs(a - c) / std::fabs(a), 1e-9, "no unit");
  Vector3d sum = first.loads[0].force;
  for (const auto& r : reactions) sum += r;
  s.atMost("reactions and loads sum to zero, over the load", sum.norm() / first.loads[0].force.norm(), 1e-9,
           "no unit");
}

/// Largest difference of a condensed answer to a full solution, over the largest displacement.
double difference(const fem::CondensedModel& m, const fem::CondensedState& state, const fem::SparseLoad& load,
                  const Description& full) {
  fem::CondensedScratch scratch(m);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(m.unknowns());
  fem::addResponse(m, state, load, scratch, u);
  const auto x = solve(full);
  double error = 0.0, scale = 0.0;
  for (std::size_t i = 0; i < m.outerNodes().size(); ++i) {
    const Index n = m.outerNodes()[i];
    if (state.loose[n] != 0) continue;
    const Vector3d expected = x[n] - full.nodes[n];
    error = std::max(error, (u.segment<3>(3 * static_cast<Eigen::Index>(i)) - expected).norm());
    scale = std::max(scale, expected.norm());
  }
  return error / scale;
}

void condensed(validation::Section& s) {
  Description d = fem::test::makeBox({5, 4, 4, 1.0, 0.8, 0.7});
  fem::test::shake(d, 0.06);
  const fem::CondensedModel m(d, {});
  fem::CondensedState state(m);
  fem::SparseLoad load;
  std::mt19937 random(5);
  for (std::uint32_t i = 0; i < 10; ++i) {
    const auto outer = static_cast<std::uint32_t>((7 + 11 * i) % m.outerNodes().size());
    fem::Load l;
    l.node = m.outerNodes()[outer];
    for (int a = 0; a < 3; ++a) {
      l.force[a] = static_cast<double>(random()) / 4294967296.0 - 0.5;
      load.unknown.push_back(3 * outer + static_cast<std::uint32_t>(a));
      load.force.push_back(l.force[a]);
    }
    d.loads.push_back(l);
  }
  s.atMost("condensed to the surface against the full solution", difference(m, state, load, d), 1e-6,
           "no unit");
  double worst = 0.0;
  int cuts = 0;
  for (const std::size_t e : {200u, 331u, 77u, 412u}) {
    if (!fem::cut(m, state, {e}).done) continue;
    ++cuts;
    Description fresh = d;
    fresh.tetrahedra.clear();
    for (std::size_t i = 0; i < d.tetrahedra.size(); ++i)
      if (state.alive[i] != 0 && state.loose[d.tetrahedra[i][0]] == 0)
        fresh.tetrahedra.push_back(d.tetrahedra[i]);
    worst = std::max(worst, difference(m, state, load, fresh));
  }
  s.atMost("cut by low-rank update against a fresh factorisation", cuts > 0 ? worst : NAN, 1e-6, "no unit");
}

void elastica(validation::Section& s, const Options& o) {
  // w/L at P·L²/(E·I): Bisshopp and Drucker 1945, doi:10.1090/qam/13360.
  const std::array<std::array<double, 2>, 4> theory{
      {{1.0, 0.30172}, {2.0, 0.49346}, {5.0, 0.71379}, {10.0, 0.81061}}};
  const int n = o.full ? 16 : 12;
  const Box b{20 * n, 1, n, 10.0, 0.6, 0.5};
  validation::Curve exact{"elastica", {0}, {0}, validation::Mark::Line},
      found{"corotational tetrahedra", {}, {}, validation::Mark::Points};
  std::vector<std::vector<std::string>> rows;
  double worst = 0.0;
  for (const auto& [load, w] : theory) {
    Description d = fem::test::makeBox(b);
    d.strain = fem::Strain::Corotational;
    d.material = {1e6, 0.0, 0.0, 0.0, 0.0};
    const double EI = 1e6 * b.ly * b.lz * b.lz * b.lz / 12.0;
    fem::test::loadEnd(d, b, {0.0, 0.0, -load * EI / 100.0});
    const double own = -fem::test::endDisplacement(d, b, solve(d)).z() / 10.0;
    rows.push_back({digits(load), digits(own), digits(w), digits(100 * (own / w - 1.0))});
    exact.x.push_back(load), exact.y.push_back(w);
    found.x.push_back(load), found.y.push_back(own);
    worst = std::max(worst, std::fabs(own / w - 1.0));
  }
  s.text("**Large rotation.** A slender cantilever (L/h = 20, " + std::to_string(n) +
         " cells over the height, ν = 0) against the elastica.");
  s.table({"P·L²/(E·I)", "w/L", "elastica", "difference, %"}, rows);
  s.plot(
      "elastica",
      {"Cantilever under an end load", "P·L²/(E·I), no unit", "w/L, no unit", {exact, found}, false, false});
  s.atMost("corotational cantilever against the elastica", 100 * worst, 2.0, "%");
}

}  // namespace

validation::Section finiteElementsSection(const Options& o, const std::string& command) {
  validation::Section s("20_finite_elements", "Finite elements", command);
  s.text("Linear tetrahedra on irregular meshes; the claims are in the table at the end.");
  patch(s);
  reciprocityAndReactions(s);
  condensed(s);
  elastica(s, o);
  return s;
}

}  // namespace vest::validate
