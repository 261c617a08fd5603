#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "cutting.h"
#include "sections.h"
#include "slab.h"
#include "vest_tissue/fem/simulate.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::validate {
namespace {

using Eigen::Vector3d;
using fem::Description;
using fem::Index;
using fem::specimen::Box;
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
  Description d = fem::specimen::makeBox(b, false);
  fem::specimen::shake(d, 0.05);
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
  Description d = fem::specimen::makeBox(b);
  fem::specimen::shake(d, 0.03);
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

void elastostatic(validation::Section& s) {
  Description d = fem::specimen::makeBox({5, 4, 4, 0.1, 0.08, 0.07});
  d.motion = fem::Motion::Elastostatic;
  d.material = {8e3, 0.3, 1050.0, 1.0, 0.002};
  fem::specimen::shake(d, 0.006);
  std::mt19937 random(5);
  for (Index n = 40; n < 140; n += 11) {  // a tenth of a newton, inside and outside
    Vector3d force;
    for (int a = 0; a < 3; ++a) force[a] = 0.02 * (static_cast<double>(random()) / 4294967296.0 - 0.5);
    d.loads.push_back({n, force});
  }
  scene::Description scene = fem::specimen::sceneOf({fem::specimen::object(d)});
  scene.gravity.setZero();
  scene::World w(scene);
  scene::StepInput in;
  scene::StepReport report;
  for (in.step = 0; in.step < 30; ++in.step) w.step(in, report);
  const auto full = solve(d);
  s.atMost("elastostatic object of a World under loads, against the full solution",
           largest(w.state().objects[0].tissue.x, full) / largest(full, d.nodes), 1e-6, "no unit");

  double worst = 0.0, off = 0.0;
  for (Index n = 0; n < d.nodes.size(); ++n)  // both parts are held
    if (d.nodes[n].x() > 0.0999) d.fixed.push_back(n);
  for (const double depth : {0.04, -1.0}) {  // with a tip that stays whole, and through
    fem::specimen::Cutting cut(d);
    const auto doubled = cut.cutAt(0, 0.045, [depth](const Vector3d& p) { return p.z() > depth; });
    fem::useFactor(cut.state);
    const Description now = fem::cutDescription(*cut.model, cut.state);
    fem::specimen::Cutting fresh(now);
    cut.step(Vector3d::Zero());
    const auto full_now = solve(now);
    off = std::max(off, largest(cut.state.x, full_now) / largest(full_now, now.nodes));
    for (const fem::Doubling& two : doubled) {
      fem::TissuePoint point;
      point.knots = {two.copy, two.original, doubled[0].copy};
      point.weights = {0.5, 0.3, 0.2};
      if (fresh.model->answer_number[two.copy] >= 0 && fresh.model->answer_number[two.original] >= 0)
        cut.scratch.points.push_back(point);
    }
    worst = cut.scratch.points.empty() ? NAN : std::max(worst, fem::specimen::answerError(cut, fresh, cut.h));
  }
  s.atMost("the same object one step after a cut, against the full solution of the cut mesh", off, 1e-6,
           "no unit");
  s.atMost("answers at the faces of a cut against a fresh factorisation of the cut mesh", worst, 1e-6,
           "no unit");
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
    Description d = fem::specimen::makeBox(b);
    d.strain = fem::Strain::Corotational;
    d.material = {1e6, 0.0, 0.0, 0.0, 0.0};
    const double EI = 1e6 * b.ly * b.lz * b.lz * b.lz / 12.0;
    fem::specimen::loadEnd(d, b, {0.0, 0.0, -load * EI / 100.0});
    const double own = -fem::specimen::endDisplacement(d, b, solve(d)).z() / 10.0;
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
  elastostatic(s);
  elastica(s, o);
  return s;
}

}  // namespace vest::validate
