#include "vest_tissue/fem/tissue.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

#include "condensed_tissue.h"
#include "tissue_solve.h"
#include "vest_tissue/fem/cache.h"
#include "vest_tissue/fem/cut_factor.h"

namespace vest::fem {
namespace {

constexpr std::size_t kWorthKeeping = 600;  ///< unknowns: smaller inverses are made anew faster (assumed)

[[noreturn]] void refuse(const Description& d, const std::string& what) {
  throw std::invalid_argument("object '" + d.name + "': " + what);
}

void findFaces(TissueModel& t) {
  const Description& d = t.model->description;
  std::map<std::array<Index, 3>, std::pair<std::uint32_t, int>> open;
  t.neighbours.assign(d.tetrahedra.size(), {kNoSlot, kNoSlot, kNoSlot, kNoSlot});
  const auto corners = [&](std::uint32_t e, int f) {
    return std::array<Index, 3>{d.tetrahedra[e][static_cast<std::size_t>(kFaces[f][0])],
                                d.tetrahedra[e][static_cast<std::size_t>(kFaces[f][1])],
                                d.tetrahedra[e][static_cast<std::size_t>(kFaces[f][2])]};
  };
  for (std::uint32_t e = 0; e < d.tetrahedra.size(); ++e) {
    for (int f = 0; f < 4; ++f) {
      auto key = corners(e, f);
      std::sort(key.begin(), key.end());
      const auto found = open.find(key);
      if (found == open.end()) {
        open[key] = {e, f};
        continue;
      }
      t.neighbours[e][static_cast<std::size_t>(f)] = found->second.first;
      t.neighbours[found->second.first][static_cast<std::size_t>(found->second.second)] = e;
      open.erase(found);
    }
  }
  for (std::uint32_t e = 0; e < d.tetrahedra.size(); ++e) {
    for (int f = 0; f < 4; ++f) {
      if (t.neighbours[e][static_cast<std::size_t>(f)] == kNoSlot) t.surface.push_back(corners(e, f));
    }
  }
}

/// scale·A^-1 between nodes, by columns.
Eigen::MatrixXd between(const Model& m, BlockLdlt& factor, const std::vector<Index>& nodes, double scale) {
  const Eigen::Index size = 3 * static_cast<Eigen::Index>(nodes.size());
  Eigen::MatrixXd answer(size, size), columns;
  constexpr Eigen::Index kBatch = 48;
  for (Eigen::Index first = 0; first < size; first += kBatch) {
    const Eigen::Index count = std::min(kBatch, size - first);
    columns.setZero(3 * static_cast<Eigen::Index>(m.free_node.size()), count);
    for (Eigen::Index c = 0; c < count; ++c)
      columns(3 * m.unknown[nodes[static_cast<std::size_t>((first + c) / 3)]] + (first + c) % 3, c) = scale;
    factor.solveColumns(columns.data(), static_cast<std::size_t>(count),
                        static_cast<std::size_t>(columns.rows()));
    for (Eigen::Index c = 0; c < count; ++c)
      for (std::size_t n = 0; n < nodes.size(); ++n)
        answer.col(first + c).segment<3>(3 * static_cast<Eigen::Index>(n)) =
            columns.col(c).segment<3>(3 * m.unknown[nodes[n]]);
  }
  return answer;
}

/// The matrix of `make`, or what an earlier start kept of it.
template <typename Make>
Eigen::MatrixXd kept(const TissueModel& t, const std::vector<Index>& nodes, double step, Make make) {
  const auto size = 3 * static_cast<Eigen::Index>(nodes.size());
  const bool keep = !t.cache_directory.empty() && static_cast<std::size_t>(size) > kWorthKeeping;
  if (!keep) return make();
  const std::uint64_t hash = contentHash(t.model->description, nodes, step);
  Eigen::MatrixXd answer;
  if (loadMatrix(t.cache_directory, hash, size, answer)) return answer;
  answer = make();
  saveMatrix(t.cache_directory, hash, answer);
  return answer;
}

/// Free nodes, those of the surface first, and their block rows.
std::vector<Index> number(const TissueModel& t, bool inner, std::vector<std::int32_t>& rows) {
  const Model& m = *t.model;
  std::vector<std::uint8_t> outer(m.mass.size(), 0);
  for (const auto& f : t.surface)
    for (const Index n : f) outer[n] = 1;
  std::vector<Index> nodes;
  for (const bool at_surface : {true, false}) {
    if (!at_surface && !inner) continue;
    for (const Index n : m.free_node)
      if ((outer[n] != 0) == at_surface) nodes.push_back(n);
  }
  rows.assign(m.mass.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) rows[nodes[i]] = static_cast<std::int32_t>(i);
  return nodes;
}

/// FFEM: K^-1 between all free nodes, and what gravity and the loads of the scene do.
void prepareElastostatic(TissueModel& t) {
  const Model& m = *t.model;
  const std::vector<Index> nodes = number(t, true, t.answer_number);
  t.answer = kept(t, nodes, 0.0, [&] {
    Scratch scratch(m, 1);
    assemble(m, restState(m), 0.0, 1.0, Tangent::Frozen, scratch);
    if (!m.free_node.empty() && !scratch.matrix.factorise()) {
      refuse(m.description,
             "its stiffness is singular to rounding; allowed: supports that hold every part, no slivers");
    }
    Eigen::MatrixXd answer = between(m, scratch.matrix, nodes, 1.0);
    // Symmetric up to rounding; exactly from here on.
    for (Eigen::Index j = 0; j < answer.cols(); ++j)
      for (Eigen::Index i = j + 1; i < answer.rows(); ++i)
        answer(i, j) = answer(j, i) = 0.5 * (answer(i, j) + answer(j, i));
    return answer;
  });
  const Eigen::Index size = t.answer.rows();
  Eigen::VectorXd load = Eigen::VectorXd::Zero(size);
  for (int axis = 0; axis < 3; ++axis) t.unit_gravity[static_cast<std::size_t>(axis)] = load;
  for (const Index n : m.free_node) {
    const Eigen::Index row = 3 * t.answer_number[n];
    load.segment<3>(row) = m.load[n];
    for (int axis = 0; axis < 3; ++axis)
      t.unit_gravity[static_cast<std::size_t>(axis)] += m.mass[n] * t.answer.col(row + axis);
  }
  t.under_loads = t.answer * load;
  // Power iteration; a tenth above it is the bound that contacts with others rely on.
  Eigen::VectorXd x = Eigen::VectorXd::Ones(size), y;
  for (int i = 0; i < 30; ++i) {
    y = t.answer * x;
    t.softest = y.norm() / std::max(x.norm(), 1e-300);
    x = y / std::max(y.norm(), 1e-300);
  }
  t.softest *= 1.1;
}

/// Before a matrix of them is factorised, which takes seconds.
void checkSurface(const TissueModel& t) {
  std::vector<std::int32_t> rows;
  const std::size_t nodes = number(t, false, rows).size();
  if (nodes > kMostSurfaceNodes) {
    refuse(t.model->description, std::to_string(nodes) +
                                     " free nodes at the surface; allowed in a World: at most " +
                                     std::to_string(kMostSurfaceNodes));
  }
}

/// h² A0^-1 between surface nodes, and their block rows.
void stepAnswers(TissueModel& t, double h) {
  const std::vector<Index> nodes = number(t, false, t.answer_number);
  t.answer = kept(t, nodes, h, [&] { return between(*t.model, t.factor, nodes, h * h); });
}

}  // namespace

std::shared_ptr<TissueModel> makeTissue(const Description& d, Motion motion, const std::string& cache) {
  if (motion == Motion::Condensed) return makeCondensed(d, cache);
  auto t = std::make_shared<TissueModel>();
  if (d.nodes.size() > kMostTissueNodes) {
    refuse(d, "nodes: " + std::to_string(d.nodes.size()) + "; allowed in a World: at most " +
                  std::to_string(kMostTissueNodes));
  }
  validate(d, Use::Dynamic);
  if (motion == Motion::Elastostatic) validate(d, Use::Static);
  t->model = buildModel(d, Use::Dynamic);
  const Model& m = *t->model;
  t->motion = motion;
  t->cache_directory = cache;
  if (motion == Motion::Elastostatic && d.strain == Strain::Corotational)
    refuse(d, "strain: corotational; allowed with integrator: elastostatic: small");
  if (motion == Motion::Elastostatic && m.free_node.size() > kMostElastostaticNodes) {
    refuse(d, "integrator: elastostatic with " + std::to_string(m.free_node.size()) +
                  " free nodes; allowed: at most " + std::to_string(kMostElastostaticNodes) +
                  " (coarser mesh, backward_euler or condensed)");
  }
  t->node_element.assign(d.nodes.size(), kNoSlot);
  for (std::size_t e = m.elements.size(); e-- > 0;) {
    for (const Index n : m.elements[e].nodes) t->node_element[n] = static_cast<Index>(e);
  }
  for (std::size_t n = 0; n < d.nodes.size(); ++n) {
    if (t->node_element[n] == kNoSlot) {
      refuse(d, "node " + std::to_string(n) +
                    " belongs to no tetrahedron; allowed in a World: nodes of the tissue alone");
    }
  }
  findFaces(*t);
  return t;
}

void prepareTissue(TissueModel& t, double h, const std::function<void(double)>& progress) {
  if (t.condensed()) return prepareCondensed(t, h, progress);
  const Model& m = *t.model;
  const Description& d = m.description;
  t.step = h;
  checkSurface(t);
  Scratch scratch(m, 1);
  const State rest = restState(m);
  const double a = d.material.rayleigh_mass, b = d.material.rayleigh_stiffness;
  assemble(m, rest, 1.0 + h * a, h * (h + b), Tangent::Frozen, scratch);
  if (!m.free_node.empty() && !scratch.matrix.factorise())
    refuse(d,
           "the matrix of a step is singular to rounding; allowed: no slivers, less stiffness or shorter dt");
  t.factor = std::move(scratch.matrix);
  t.loose_inverse.assign(m.mass.size(), 0.0);
  for (const Index n : m.free_node) {
    double trace = 3.0 * (1.0 + h * a) * m.mass[n];
    for (std::size_t k = m.incidence_start[n]; k < m.incidence_start[n + 1]; ++k) {
      const std::size_t e = m.incidence[k] / 4;
      const int c = static_cast<int>(m.incidence[k] % 4);
      trace +=
          h * (h + b) * stiffnessBlock(m.elements[e], m.laws[e], Eigen::Matrix3d::Identity(), c, c).trace();
    }
    t.loose_inverse[n] = 3.0 / trace;
  }
  if (t.motion == Motion::Elastostatic)
    prepareElastostatic(t);
  else
    stepAnswers(t, h);
}

TissueState tissueAtRest(const TissueModel& t, const std::vector<Eigen::Vector3d>& position) {
  const Model& m = *t.model;
  TissueState s;
  s.x = position;
  for (std::size_t n = 0; n < s.x.size(); ++n) {
    if (m.unknown[n] < 0) s.x[n] = m.held_at[n];
  }
  s.v.assign(s.x.size(), Eigen::Vector3d::Zero());
  s.mass = m.mass;
  s.corner.resize(m.elements.size());
  for (std::size_t e = 0; e < m.elements.size(); ++e) s.corner[e] = m.elements[e].nodes;
  s.open.assign(m.elements.size(), 0);
  s.origin.resize(s.x.size());
  for (Index n = 0; n < s.origin.size(); ++n) s.origin[n] = n;
  s.knot_element = t.node_element;
  s.factored = t.motion == Motion::BackwardEuler;
  return s;
}

TissueScratch::TissueScratch(const TissueModel& t, std::size_t knots)
    : factor(t.factor),
      rotation(t.model->elements.size(), Eigen::Matrix3d::Identity()),
      force(knots, Eigen::Vector3d::Zero()),
      v_next(force),
      r(force),
      z(force),
      p(force),
      q(force),
      turned(force),
      sum(t.model->mass.size(), Eigen::Vector3d::Zero()),
      count(t.model->mass.size(), 0),
      work(Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(t.model->free_node.size()))),
      answers(kMostTissuePoints * kMostTissuePoints) {
  if (t.motion == Motion::Elastostatic) u = Eigen::VectorXd::Zero(t.answer.rows());
  if (t.condensed()) u = Eigen::VectorXd::Zero(t.condensed_loads.rows()), loads.reserve(knots);
  points.reserve(kMostTissuePoints);
  threads.reserve(kMostThreads);
  thread_answers.assign(kMostThreadPoints * kMostThreadPoints, Eigen::Matrix3d::Zero());
  thread_matrix.assign(9 * kMostThreadPoints * kMostThreadPoints, 0.0);
  groups.reserve(kMostGroups);
  if (!t.condensed()) cut = std::make_shared<CutFactor>(t, knots);
  group_residual.resize(kMostGroups * kMostGroupKnots);
}

void TissueScratch::forget() {
  if (cut) cut->forget();
}

Eigen::Matrix3d polarRotation(const Eigen::Matrix3d& F) {
  // Newton's iteration X <- (X + X^-T)/2 converges quadratically to the orthogonal factor.
  Eigen::Matrix3d X = F;
  const double size = F.squaredNorm();
  if (!(size > 1e-12 && size < 1e12)) return nearestRotation(F);
  for (int i = 0; i < 10; ++i) {
    Eigen::Matrix3d C;  // cofactors: X^-T = C / det
    C.col(0) = X.col(1).cross(X.col(2));
    C.col(1) = X.col(2).cross(X.col(0));
    C.col(2) = X.col(0).cross(X.col(1));
    const double det = X.col(0).dot(C.col(0));
    if (!(det > 0.02)) return nearestRotation(F);
    const Eigen::Matrix3d next = 0.5 * (X + C / det);
    const double change = (next - X).squaredNorm();
    X = next;
    if (change < 1e-16) return X;  // the next step's change would be below rounding
  }
  return nearestRotation(F);
}

double leastVolume(const TissueModel& t, const TissueState& s, const std::vector<std::uint16_t>& marked) {
  double least = 1.0;
  for (std::size_t e = 0; e < s.corner.size(); ++e) {
    const auto& k = s.corner[e];
    if ((marked[k[0]] | marked[k[1]] | marked[k[2]] | marked[k[3]]) == 0) continue;
    least = std::min(least, gradient(t.model->elements[e], k, s.x).determinant());
  }
  return least;
}

void tissueStrain(const TissueModel& t, const TissueState& s, float* per_knot) {
  const Model& m = *t.model;
  std::fill_n(per_knot, s.x.size(), 0.0f);
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const Eigen::Matrix3d F = gradient(m.elements[e], s.corner[e], s.x);
    // Green's strain: none for rotations. Its largest row sum bounds the principal strain from above.
    const Eigen::Matrix3d E = 0.5 * (F.transpose() * F - Eigen::Matrix3d::Identity());
    Eigen::Vector3d values;
    Eigen::Matrix3d vectors;
    symmetricEigen(E, values, vectors);
    const float strain = static_cast<float>(values.cwiseAbs().maxCoeff());
    for (const Index k : s.corner[e]) per_knot[k] = std::max(per_knot[k], strain);
  }
}

void tissueStress(const TissueModel& t, const TissueState& s, float* per_knot) {
  const Model& m = *t.model;
  std::fill_n(per_knot, s.x.size(), 0.0f);
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const Eigen::Matrix3d F = gradient(m.elements[e], s.corner[e], s.x);
    const double part = s.denatured.empty() ? 0.0 : static_cast<double>(s.denatured[e]);
    Eigen::Matrix3d strain = -Eigen::Matrix3d::Identity();  // shrinking is isotropic: no deviator
    strain += m.description.strain == Strain::Small ? F : Eigen::Matrix3d(polarRotation(F).transpose() * F);
    // Only the deviator of the strain makes equivalent stress: sqrt(3/2) |2 mu dev eps|.
    const Eigen::Matrix3d symmetric = 0.5 * (strain + strain.transpose());
    const Eigen::Matrix3d deviator = symmetric - symmetric.trace() / 3.0 * Eigen::Matrix3d::Identity();
    const auto stress = static_cast<float>((1.0 + kStiffening * part) * s.stiffness_scale * std::sqrt(6.0) *
                                           m.laws[e].mu * deviator.norm());
    for (const Index k : s.corner[e]) per_knot[k] = std::max(per_knot[k], stress);
  }
}

double tissueEnergy(const TissueModel& t, const TissueState& s) {
  const Model& m = *t.model;
  double sum = 0.0;
  for (std::size_t e = 0; e < m.elements.size(); ++e) {
    const Eigen::Matrix3d G = gradient(m.elements[e], s.corner[e], s.x) - Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d R = m.description.strain == Strain::Small
                                  ? Eigen::Matrix3d(Eigen::Matrix3d::Identity())
                                  : polarRotation(G + Eigen::Matrix3d::Identity());
    if (s.denatured.empty()) {
      sum += energy(m.elements[e], m.laws[e], G, R);
      continue;
    }
    const double part = static_cast<double>(s.denatured[e]);
    // Strain beyond the shorter rest shape: R^T F - (1 - shrinkage).
    const Eigen::Matrix3d shrunk = G + kShrinkage * part * R;
    sum += (1.0 + kStiffening * part) * energy(m.elements[e], m.laws[e], shrunk, R);
  }
  return s.stiffness_scale * sum;
}

}  // namespace vest::fem
