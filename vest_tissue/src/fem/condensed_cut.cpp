#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/LU>

#include "vest_tissue/fem/condensed.h"

namespace vest::fem {
namespace {

/// Ground springs of parts that hang by a node or an edge, relative to those of loose parts (assumed: small
/// beside the tissue, large beside rounding).
constexpr double kWeakGround = 1e-4;

/// Columns U with K_e = sum U U^T: B^T chol(V D), B: strain (xx yy zz, xy yz zx engineering) per
/// displacement.
std::array<UpdateColumn, 6> elementColumns(const Model& model, std::size_t e) {
  const Element& element = model.elements[e];
  const Lame& law = model.laws[e];
  Eigen::Matrix<double, 6, 12> B = Eigen::Matrix<double, 6, 12>::Zero();
  for (int a = 0; a < 4; ++a) {
    const Eigen::Vector3d& g = element.gradient[static_cast<std::size_t>(a)];
    const int c = 3 * a;
    B(0, c) = g.x();
    B(1, c + 1) = g.y();
    B(2, c + 2) = g.z();
    B(3, c) = g.y();
    B(3, c + 1) = g.x();
    B(4, c + 1) = g.z();
    B(4, c + 2) = g.y();
    B(5, c) = g.z();
    B(5, c + 2) = g.x();
  }
  // Cholesky of V·D; D is positive definite for -1 < nu < 0.5.
  const double d = element.volume * (law.lambda + 2.0 * law.mu), o = element.volume * law.lambda;
  Eigen::Matrix<double, 6, 6> L = Eigen::Matrix<double, 6, 6>::Zero();
  L(0, 0) = std::sqrt(d);
  L(1, 0) = L(2, 0) = o / L(0, 0);
  L(1, 1) = std::sqrt(d - L(1, 0) * L(1, 0));
  L(2, 1) = (o - L(2, 0) * L(1, 0)) / L(1, 1);
  L(2, 2) = std::sqrt(d - L(2, 0) * L(2, 0) - L(2, 1) * L(2, 1));
  for (int k = 3; k < 6; ++k) L(k, k) = std::sqrt(element.volume * law.mu);
  const Eigen::Matrix<double, 12, 6> W = B.transpose() * L;
  std::array<UpdateColumn, 6> columns;
  for (std::size_t c = 0; c < 6; ++c) {
    for (std::size_t a = 0; a < 4; ++a) {
      const std::int32_t row = model.unknown[element.nodes[a]];
      for (std::size_t k = 0; k < 3; ++k) {
        columns[c].row[3 * a + k] =
            row < 0 ? kNoSlot : 3 * static_cast<std::uint32_t>(row) + static_cast<std::uint32_t>(k);
        columns[c].value[3 * a + k] = W(static_cast<Eigen::Index>(3 * a + k), static_cast<Eigen::Index>(c));
      }
    }
    columns[c].sign = -1.0;
  }
  return columns;
}

/// Springs to the ground on a node, as columns.
void groundColumns(const Model& model, Index node, double stiffness, std::vector<UpdateColumn>& out) {
  for (std::uint32_t k = 0; k < 3; ++k) {
    UpdateColumn column;
    column.row.fill(kNoSlot);
    column.row[0] = 3 * static_cast<std::uint32_t>(model.unknown[node]) + k;
    column.value[0] = std::sqrt(stiffness);
    column.sign = 1.0;
    out.push_back(column);
  }
}

/// Nodes that hang on nothing fixed: 1. `component` as components() numbers them.
std::vector<std::uint8_t> findLoose(const Model& model, const std::vector<int>& component) {
  std::vector<std::uint8_t> anchored(model.mass.size() + 1, 0);
  for (std::size_t n = 0; n < component.size(); ++n) {
    if (model.unknown[n] < 0 && component[n] >= 0) anchored[static_cast<std::size_t>(component[n])] = 1;
  }
  std::vector<std::uint8_t> loose(component.size(), 0);
  for (const Index n : model.free_node) {
    loose[n] = component[n] < 0 || anchored[static_cast<std::size_t>(component[n])] == 0 ? 1 : 0;
  }
  return loose;
}

/// Elements that hold together by faces. Per element: the smallest element of its cluster.
std::vector<std::uint32_t> findClusters(const CondensedModel& model, const std::vector<std::uint8_t>& alive) {
  std::vector<std::uint32_t> root(alive.size());
  for (std::uint32_t e = 0; e < root.size(); ++e) root[e] = e;
  const auto find = [&root](std::uint32_t e) {
    while (root[e] != e) e = root[e] = root[root[e]];
    return e;
  };
  for (std::uint32_t e = 0; e < root.size(); ++e) {
    if (alive[e] == 0) continue;
    for (const std::uint32_t other : model.neighbours()[e]) {
      if (other == kNoSlot || alive[other] == 0) continue;
      const std::uint32_t a = find(e), b = find(other);
      root[std::max(a, b)] = std::min(a, b);
    }
  }
  for (std::uint32_t e = 0; e < root.size(); ++e) root[e] = find(e);
  return root;
}

/// Per cluster (at its smallest element): 1 where three points that are not on one line hold it, fixed nodes
/// or nodes of clusters that are held themselves.
std::vector<std::uint8_t> findSupported(const Model& m, const std::vector<std::uint8_t>& alive,
                                        const std::vector<std::uint32_t>& cluster) {
  std::vector<std::uint8_t> supported(alive.size(), 0), firm(m.mass.size(), 0);
  for (std::size_t n = 0; n < firm.size(); ++n) firm[n] = m.unknown[n] < 0 ? 1 : 0;
  struct Points {
    int count = 0;
    Index p0 = 0, p1 = 0;
  };
  for (bool changed = true; changed;) {
    changed = false;
    std::vector<Points> points(alive.size());
    for (std::size_t e = 0; e < alive.size(); ++e) {
      const std::uint32_t c = cluster[e];
      if (alive[e] == 0 || supported[c] != 0) continue;
      Points& p = points[c];
      for (Index n : m.elements[e].nodes) {
        if (firm[n] == 0 || (p.count > 0 && n == p.p0) || (p.count > 1 && n == p.p1)) continue;
        const auto& x = m.description.nodes;
        if (p.count == 0) {
          p.p0 = n;
          p.count = 1;
        } else if (p.count == 1) {
          p.p1 = n;
          p.count = 2;
        } else if ((x[p.p1] - x[p.p0]).cross(x[n] - x[p.p0]).norm() >
                   1e-9 * (x[p.p1] - x[p.p0]).norm() * (x[n] - x[p.p0]).norm()) {
          supported[c] = 1;
          changed = true;
          break;
        }
      }
    }
    if (!changed) break;
    for (std::size_t e = 0; e < alive.size(); ++e) {
      if (alive[e] == 0 || supported[cluster[e]] == 0) continue;
      for (Index n : m.elements[e].nodes) firm[n] = 1;
    }
  }
  return supported;
}

double entryOf(const CondensedModel& model, const CondensedState& state, const UpdateColumn& u,
               std::size_t t) {
  // U^T T_t: from the outer rows, or from the full column where U touches inner nodes.
  const UpdateColumn& other = state.columns[t];
  double sum = 0.0;
  for (std::size_t k = 0; k < 12; ++k) {
    if (u.row[k] == kNoSlot) continue;
    if (other.full >= 0) {
      sum += u.value[k] * state.full_columns[static_cast<std::size_t>(other.full)][u.row[k]];
    } else {
      const std::int32_t outer = model.outerNumber(model.model().free_node[u.row[k] / 3]);
      sum += u.value[k] * state.outer_columns(3 * outer + static_cast<Eigen::Index>(u.row[k] % 3),
                                              static_cast<Eigen::Index>(t));
    }
  }
  return sum;
}

/// T = K^-1 U for the new columns: sums of columns of C where all rows are outer ones, else a solve.
void solveColumns(const CondensedModel& model, CondensedState& state, std::size_t first) {
  const Model& m = model.model();
  std::vector<std::size_t> slow;
  for (std::size_t c = first; c < state.columns.size(); ++c) {
    const UpdateColumn& u = state.columns[c];
    const bool inner = std::any_of(u.row.begin(), u.row.end(), [&](std::uint32_t row) {
      return row != kNoSlot && model.outerNumber(m.free_node[row / 3]) < 0;
    });
    if (inner) {
      slow.push_back(c);
      continue;
    }
    auto T = state.outer_columns.col(static_cast<Eigen::Index>(c));
    T.setZero();
    for (std::size_t k = 0; k < 12; ++k) {
      if (u.row[k] == kNoSlot || u.value[k] == 0.0) continue;
      const Eigen::Index outer =
          3 * model.outerNumber(m.free_node[u.row[k] / 3]) + static_cast<Eigen::Index>(u.row[k] % 3);
      T += u.value[k] * model.inverse().col(outer);
    }
  }
  if (slow.empty()) return;
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(m.free_node.size()),
                                                  static_cast<Eigen::Index>(slow.size()));
  for (std::size_t s = 0; s < slow.size(); ++s) {
    const UpdateColumn& u = state.columns[slow[s]];
    for (std::size_t k = 0; k < 12; ++k) {
      if (u.row[k] != kNoSlot) columns(u.row[k], static_cast<Eigen::Index>(s)) += u.value[k];
    }
  }
  model.solveFull(columns);
  for (std::size_t s = 0; s < slow.size(); ++s) {
    const Eigen::Index c = static_cast<Eigen::Index>(slow[s]);
    for (std::size_t o = 0; o < model.outerNodes().size(); ++o) {
      state.outer_columns.col(c).segment<3>(3 * static_cast<Eigen::Index>(o)) =
          columns.col(static_cast<Eigen::Index>(s)).segment<3>(3 * m.unknown[model.outerNodes()[o]]);
    }
    state.columns[slow[s]].full = static_cast<std::int32_t>(state.full_columns.size());
    state.full_columns.emplace_back(columns.col(static_cast<Eigen::Index>(s)));
  }
}

}  // namespace

CutReport cut(const CondensedModel& model, CondensedState& state, const std::vector<std::size_t>& elements) {
  const Model& m = model.model();
  CutReport report;
  std::vector<std::size_t> chosen;
  for (std::size_t e : elements) {
    if (e >= m.elements.size()) {
      throw std::invalid_argument("object '" + m.description.name + "': cut of element " + std::to_string(e) +
                                  "; allowed: 0 to " + std::to_string(m.elements.size() - 1));
    }
    if (state.alive[e] != 0) chosen.push_back(e);
  }
  std::sort(chosen.begin(), chosen.end());
  chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
  report.rank = static_cast<int>(state.columns.size());
  if (chosen.empty()) {
    report.done = true;
    return report;
  }
  std::vector<std::uint8_t> alive = state.alive;
  std::vector<UpdateColumn> fresh;
  for (std::size_t e : chosen) {
    alive[e] = 0;
    for (const auto& column : elementColumns(m, e)) fresh.push_back(column);
  }
  // Parts that come loose would make K' singular: springs to the ground on one element of each (or on a node
  // that has no element left) remove that and leave the rest of the object exactly as it is. A part that
  // hangs on by a node or an edge can turn about it: it gets weak springs.
  const std::vector<int> component = components(m.description, alive);
  const std::vector<std::uint8_t> loose = findLoose(m, component);
  const std::vector<std::uint32_t> cluster = findClusters(model, alive);
  const std::vector<std::uint8_t> supported = findSupported(m, alive, cluster);
  std::vector<std::uint8_t> grounded = state.grounded;
  const auto springAt = [&m](Index n) {
    const std::size_t e = m.incidence[m.incidence_start[n]] / 4;
    return m.laws[e].mu * std::cbrt(m.elements[e].volume);
  };
  for (const Index n : m.free_node) {
    if (component[n] >= 0 || grounded[n] != 0) continue;
    groundColumns(m, n, springAt(n), fresh);
    grounded[n] = 1;
  }
  for (std::size_t e = 0; e < alive.size(); ++e) {
    if (alive[e] == 0 || cluster[e] != e || supported[e] != 0) continue;
    report.hanging = report.hanging || loose[m.elements[e].nodes[0]] == 0;
    int held = 0;
    std::vector<std::uint8_t> seen(m.mass.size(), 0);
    for (std::size_t other = e; other < alive.size(); ++other) {
      if (alive[other] == 0 || cluster[other] != e) continue;
      for (Index n : m.elements[other].nodes) {
        held += seen[n] == 0 && grounded[n] != 0 ? 1 : 0;
        seen[n] = 1;
      }
    }
    if (held >= 3) continue;
    for (Index n : m.elements[e].nodes) {
      if (grounded[n] != 0 || m.unknown[n] < 0) continue;
      groundColumns(m, n, (loose[n] != 0 ? 1.0 : kWeakGround) * springAt(n), fresh);
      grounded[n] = 1;
    }
  }
  const std::size_t before = state.columns.size(), after = before + fresh.size();
  if (after > static_cast<std::size_t>(model.mostRank())) return report;

  const std::size_t full_before = state.full_columns.size();
  state.columns.insert(state.columns.end(), fresh.begin(), fresh.end());
  solveColumns(model, state, before);
  // core = (Sigma^-1 + U^T T)^-1; U^T T is symmetric, taken from whichever side has the rows.
  const Eigen::Index r = static_cast<Eigen::Index>(after);
  Eigen::MatrixXd S(r, r);
  for (Eigen::Index i = 0; i < r; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const std::size_t a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      const bool take_b = state.columns[b].full >= 0 || state.columns[a].full < 0;
      S(i, j) = S(j, i) =
          take_b ? entryOf(model, state, state.columns[a], b) : entryOf(model, state, state.columns[b], a);
    }
    S(i, i) += state.columns[static_cast<std::size_t>(i)].sign;
  }
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(S);
  if (!lu.isInvertible()) {
    state.columns.resize(before);
    state.full_columns.resize(full_before);
    return report;
  }
  const Eigen::MatrixXd inverse = lu.inverse();
  state.core.topLeftCorner(r, r) = 0.5 * (inverse + inverse.transpose());
  state.alive = alive;
  state.grounded = grounded;
  for (std::size_t n = 0; n < loose.size(); ++n) {
    if (loose[n] == 0) continue;
    if (state.loose[n] == 0) report.separated = true;
    report.loose_nodes.push_back(static_cast<Index>(n));
  }
  state.loose = loose;
  ++state.revision;
  report.done = true;
  report.rank = static_cast<int>(after);
  return report;
}

std::vector<LoosePart> looseParts(const CondensedModel& model, const CondensedState& state) {
  const Description& d = model.description();
  const std::vector<int> component = components(d, state.alive);
  std::vector<LoosePart> parts;
  std::vector<int> part_of(d.nodes.size(), -1);  // component -> part
  std::vector<Index> number(d.nodes.size(), 0);
  for (Index n = 0; n < d.nodes.size(); ++n) {
    if (component[n] < 0 || state.loose[n] == 0) continue;
    int& p = part_of[static_cast<std::size_t>(component[n])];
    if (p < 0) {
      p = static_cast<int>(parts.size());
      parts.emplace_back();
      parts.back().description.name = d.name + "_part_" + std::to_string(parts.size());
      parts.back().description.strain = Strain::Corotational;  // it falls and turns
      parts.back().description.material = d.material;
      parts.back().description.materials = d.materials;
    }
    LoosePart& part = parts[static_cast<std::size_t>(p)];
    number[n] = static_cast<Index>(part.node.size());
    part.node.push_back(n);
    part.description.nodes.push_back(d.nodes[n]);
  }
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    const auto& t = d.tetrahedra[e];
    if (state.alive[e] == 0 || state.loose[t[0]] == 0) continue;
    LoosePart& part = parts[static_cast<std::size_t>(part_of[static_cast<std::size_t>(component[t[0]])])];
    part.description.tetrahedra.push_back({number[t[0]], number[t[1]], number[t[2]], number[t[3]]});
    if (!d.cell_material.empty()) part.description.cell_material.push_back(d.cell_material[e]);
  }
  return parts;
}

}  // namespace vest::fem
