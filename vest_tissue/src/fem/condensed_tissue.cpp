#include "condensed_tissue.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "condense.h"
#include "vest_tissue/cache/block.h"
#include "vest_tissue/fem/cache.h"

namespace vest::fem {
namespace {

constexpr int kSweeps = 30;       // of the power iteration
constexpr double kMargin = 1.1;   // it converges from below (as prepareElastostatic())
constexpr double kFronts = 0.35;  // share of eliminating in all the work (measured)

[[noreturn]] void refuse(const Description& d, const std::string& what) {
  throw std::invalid_argument("object '" + d.name + "': integrator: condensed with " + what);
}

void checkSize(const Description& d, std::size_t free) {
  if (d.tetrahedra.size() > kMostCondensedElements || d.nodes.size() > kMostCondensedNodes) {
    refuse(d, std::to_string(d.tetrahedra.size()) + " tetrahedra and " + std::to_string(d.nodes.size()) +
                  " nodes; allowed: at most " + std::to_string(kMostCondensedElements) + " and " +
                  std::to_string(kMostCondensedNodes));
  }
  if (free > kMostOuterNodes) {
    refuse(d, std::to_string(free) + " free nodes at the surface and under the skin; allowed: at most " +
                  std::to_string(kMostOuterNodes) + " (coarser cells, or more of it held)");
  }
  if (d.strain == Strain::Corotational) refuse(d, "strain: corotational; allowed: small");
}

/// Neighbours side by side, a tile's nodes in one clump: what is touched at a time lies in few tiles.
void clump(const std::vector<Eigen::Vector3d>& x, Index* first, Index* last) {
  constexpr auto kTile = static_cast<std::ptrdiff_t>(Compliance::kTile);
  if (last - first <= kTile) return std::sort(first, last);
  Eigen::Vector3d low = x[*first], high = low;
  for (const Index* n = first; n != last; ++n) low = low.cwiseMin(x[*n]), high = high.cwiseMax(x[*n]);
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  Index* const half = first + ((last - first) / kTile + 1) / 2 * kTile;
  std::nth_element(first, half, last, [&](Index a, Index b) {
    return x[a][axis] != x[b][axis] ? x[a][axis] < x[b][axis] : a < b;
  });
  clump(x, first, half);
  clump(x, half, last);
}

/// Its outer nodes as a model of its own: masses, loads, what is held; no elements.
std::unique_ptr<const Model> outside(const Description& d, TissueModel& t) {
  auto m = std::make_unique<Model>();
  Description& o = m->description;
  o.name = d.name, o.strain = d.strain, o.motion = d.motion, o.material = d.material, o.outer = d.outer;
  o.nodes.assign(d.nodes.begin(), d.nodes.begin() + d.outer);
  m->mass.assign(d.outer, 0.0);
  m->load.assign(d.outer, Eigen::Vector3d::Zero());
  m->held_at = o.nodes;
  m->unknown.assign(d.outer, 0);
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    const auto& c = d.tetrahedra[e];
    const double share = d.materialOf(e).density / 24.0 *
                         sixfoldVolume({d.nodes[c[0]], d.nodes[c[1]], d.nodes[c[2]], d.nodes[c[3]]});
    for (const Index n : c) (n < d.outer ? m->mass[n] : t.inner_mass) += share;
  }
  for (const Load& l : d.loads) (l.node < d.outer ? m->load[l.node] : t.inner_load) += l.force;
  for (const Index n : d.fixed)
    if (n < d.outer) o.fixed.push_back(n), m->unknown[n] = -1;
  for (Index n = 0; n < d.outer; ++n)
    if (m->unknown[n] == 0) m->free_node.push_back(n);
  clump(o.nodes, m->free_node.data(), m->free_node.data() + m->free_node.size());
  for (std::size_t row = 0; row < m->free_node.size(); ++row)
    m->unknown[m->free_node[row]] = static_cast<std::int32_t>(row);
  m->incidence_start.assign(d.outer + 1u, 0);
  return m;
}

std::uint64_t hashOf(const Description& d, const std::vector<Index>& free) {
  std::vector<double> loads;
  for (const Load& l : d.loads)
    loads.insert(loads.end(), {static_cast<double>(l.node), l.force.x(), l.force.y(), l.force.z()});
  // Any step: masses are part of it.
  return cache::hash(loads.data(), loads.size() * sizeof(double), contentHash(d, free, 1.0));
}

/// In single numbers, without the minus that the sweep leaves.
Compliance toCompliance(Tiles& s, std::size_t nodes) {
  Compliance out(nodes);
  constexpr std::size_t kNodes = Compliance::kTile, kWide = Tiles::kWide;
  const std::size_t tiles = (nodes + kNodes - 1) / kNodes;
  for (std::size_t i = 0; i < tiles; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double* const from = s.tile(i, j);
      float* to = out.tile(i, j);
      for (std::size_t c = 0; c < kNodes; ++c)
        for (std::size_t r = 0; r < kNodes; ++r)
          for (std::size_t b = 0; b < 3; ++b)
            for (std::size_t a = 0; a < 3; ++a)
              *to++ = static_cast<float>(-from[(3 * c + b) * kWide + 3 * r + a]);
    }
  }
  return out;
}

double greatestEigenvalue(const Compliance& c) {
  Eigen::VectorXd x = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(3 * c.nodes()));
  double value = 0.0;
  for (int i = 0; i < kSweeps; ++i) {
    const Eigen::VectorXd y = c.times(x);
    value = y.norm() / std::max(x.norm(), 1e-300);
    x = y / std::max(y.norm(), 1e-300);
  }
  return value;
}

void makeCompliance(TissueModel& t, const Progress& progress) {
  const Description& d = *t.whole;
  const auto part = [&](double from, double to) -> Progress {
    if (!progress) return {};
    return [&progress, from, to](double share) { progress(from + share * (to - from)); };
  };
  Condensed c = condense(d, t.model->free_node, part(0.0, kFronts));
  // Half of the processor's threads: the rest of the machine goes on.
  const int threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()) / 2, 1, 8);
  if (!sweep(c.stiffness, threads, part(kFronts, 1.0)))
    refuse(d, "a stiffness that is singular to rounding; allowed: supports that hold every part, no slivers");
  t.compliance = toCompliance(c.stiffness, t.model->free_node.size());
  t.condensed_loads = c.loads;
}

}  // namespace

std::shared_ptr<TissueModel> makeCondensed(const Description& d, const std::string& cache) {
  validate(d, Use::Dynamic);
  validate(d, Use::Static);
  auto t = std::make_shared<TissueModel>();
  t->motion = Motion::Condensed;
  t->cache_directory = cache;
  t->whole = std::make_shared<const Description>(d);
  t->model = outside(d, *t);
  const Model& m = *t->model;
  checkSize(d, m.free_node.size());
  if (!d.prescribed.empty()) refuse(d, "prescribed displacements; allowed: none");
  for (Index n = 0; n < d.outer; ++n)
    if (!(m.mass[n] > 0.0)) refuse(d, "node " + std::to_string(n) + ", which belongs to no tetrahedron");
  t->answer_number = m.unknown;
  t->node_element.assign(d.outer, kNoSlot);
  t->loose_inverse.assign(d.outer, 0.0);
  return t;
}

void prepareCondensed(TissueModel& t, double h, const Progress& progress) {
  t.step = h;
  if (!t.whole) return;  // its answers do not depend on the step
  const Model& m = *t.model;
  const std::size_t nodes = m.free_node.size();
  const auto size = static_cast<Eigen::Index>(3 * nodes);
  const std::uint64_t hash = hashOf(*t.whole, m.free_node);
  const auto path = [&](const char* kind) { return cache::path(t.cache_directory, kind, hash); };
  const bool keep = !t.cache_directory.empty();
  Eigen::MatrixXd rest(size + 1, 8);  // loads; displacements by them; below: the greatest eigenvalue
  const cache::Key key{hash, nodes, nodes};
  const auto bytes = static_cast<std::size_t>(rest.size()) * sizeof(double);
  t.compliance = Compliance(nodes);
  if (keep && cache::load(path("condensed_loads"), key, rest.data(), bytes) &&
      cache::load(path("condensed"), key, t.compliance.data(), t.compliance.bytes())) {
    t.condensed_loads = rest.topLeftCorner(size, 4);
  } else {
    makeCompliance(t, progress);
    rest.setZero();
    rest.topLeftCorner(size, 4) = t.condensed_loads;
    for (Eigen::Index i = 0; i < 4; ++i)
      rest.block(0, 4 + i, size, 1) = t.compliance.times(t.condensed_loads.col(i));
    rest(size, 0) = greatestEigenvalue(t.compliance);
    if (keep && cache::save(path("condensed"), key, t.compliance.data(), t.compliance.bytes()))
      cache::save(path("condensed_loads"), key, rest.data(), bytes);
  }
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    t.unit_gravity[static_cast<std::size_t>(axis)] = rest.block(0, 4 + axis, size, 1);
  t.under_loads = rest.block(0, 7, size, 1);
  t.softest = kMargin * rest(size, 0);
  t.whole.reset();
}

}  // namespace vest::fem
