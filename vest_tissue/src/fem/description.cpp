#include "vest_tissue/fem/description.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "vest_tissue/fem/element.h"

namespace vest::fem {
namespace {

/// 6V over the longest edge cubed, below which a tetrahedron counts as flat (assumed: its gradients then lose
/// more than half of the digits of a double).
constexpr double kFlat = 1e-8;

template <class... Parts>
[[noreturn]] void refuse(const Description& d, const Parts&... parts) {
  std::ostringstream text;
  text << "object '" << d.name << "': ";
  (text << ... << parts);
  throw std::invalid_argument(text.str());
}

void checkNumber(const Description& d, const char* field, double value, bool ok, const char* allowed) {
  if (!std::isfinite(value) || !ok) refuse(d, field, " is ", value, "; allowed: ", allowed);
}

void checkNode(const Description& d, const char* field, std::size_t entry, Index node) {
  if (node >= d.nodes.size()) {
    refuse(d, field, "[", entry, "]: node ", node, " does not exist; allowed: 0 to ",
           d.nodes.empty() ? 0 : d.nodes.size() - 1);
  }
}

void checkVector(const Description& d, const char* field, std::size_t entry, const Eigen::Vector3d& v) {
  if (!v.allFinite()) {
    refuse(d, field, "[", entry, "]: ", v.x(), ", ", v.y(), ", ", v.z(),
           " holds a number that is not finite; allowed: "
           "finite numbers");
  }
}

void checkTetrahedra(const Description& d) {
  if (d.tetrahedra.empty()) refuse(d, "tetrahedra is empty; allowed: at least one");
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    const auto& t = d.tetrahedra[e];
    for (Index n : t) checkNode(d, "tetrahedra", e, n);
    const std::array<Eigen::Vector3d, 4> x{d.nodes[t[0]], d.nodes[t[1]], d.nodes[t[2]], d.nodes[t[3]]};
    const int is = orientation(x);
    if (is != 1) {
      refuse(d, "tetrahedra[", e, "] (nodes ", t[0], ", ", t[1], ", ", t[2], ", ", t[3], ") is ",
             is < 0 ? "inverted" : "flat", ", volume ", sixfoldVolume(x) / 6.0,
             "; allowed: positive volume (swap two of its nodes if it is inverted)");
    }
  }
}

}  // namespace

int orientation(const std::array<Eigen::Vector3d, 4>& x) {
  double edge = 0.0;
  for (std::size_t a = 0; a < 4; ++a)
    for (std::size_t b = a + 1; b < 4; ++b) edge = std::max(edge, (x[b] - x[a]).norm());
  const double six = sixfoldVolume(x), least = kFlat * edge * edge * edge;
  return six > least ? 1 : six < -least ? -1 : 0;
}

std::vector<int> components(const Description& d, const std::vector<std::uint8_t>& alive) {
  std::vector<Index> root(d.nodes.size());
  for (Index n = 0; n < root.size(); ++n) root[n] = n;
  const auto find = [&root](Index n) {
    while (root[n] != n) n = root[n] = root[root[n]];
    return n;
  };
  std::vector<std::uint8_t> used(d.nodes.size(), 0);
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    if (!alive.empty() && alive[e] == 0) continue;
    for (Index n : d.tetrahedra[e]) {
      used[n] = 1;
      const Index a = find(d.tetrahedra[e][0]), b = find(n);
      root[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<int> number(d.nodes.size(), -1);
  int next = 0;
  for (Index n = 0; n < root.size(); ++n) {
    if (used[n] == 0) continue;
    const Index r = find(n);
    if (r == n)
      number[n] = next++;  // the smallest node of a component is its root
    else
      number[n] = number[r];
  }
  return number;
}

void validate(const Description& d, Use use) {
  const Material& m = d.material;
  checkNumber(d, "material.youngs_modulus", m.youngs_modulus, m.youngs_modulus > 0, "> 0");
  checkNumber(d, "material.poisson_ratio", m.poisson_ratio, m.poisson_ratio > -1 && m.poisson_ratio < 0.5,
              "above -1 and below 0.5");
  if (use == Use::Dynamic)
    checkNumber(d, "material.density", m.density, m.density > 0, "> 0 (dynamics needs mass)");
  checkNumber(d, "material.density", m.density, m.density >= 0, ">= 0");
  checkNumber(d, "material.rayleigh_mass", m.rayleigh_mass, m.rayleigh_mass >= 0, ">= 0");
  checkNumber(d, "material.rayleigh_stiffness", m.rayleigh_stiffness, m.rayleigh_stiffness >= 0, ">= 0");
  if (d.cell_material.size() != (d.materials.empty() ? 0 : d.tetrahedra.size())) {
    refuse(d, "cell_material has ", d.cell_material.size(), " entries; allowed: one per tetrahedron (",
           d.tetrahedra.size(), ") with materials, none without");
  }
  for (const std::uint16_t c : d.cell_material) {
    if (c >= d.materials.size())
      refuse(d, "cell_material is ", c, "; allowed: 0 to ", d.materials.size() - 1);
  }
  for (const Material& cell : d.materials) {
    checkNumber(d, "materials.youngs_modulus", cell.youngs_modulus, cell.youngs_modulus > 0, "> 0");
    checkNumber(d, "materials.poisson_ratio", cell.poisson_ratio,
                cell.poisson_ratio > -1 && cell.poisson_ratio < 0.5, "above -1 and below 0.5");
    checkNumber(d, "materials.density", cell.density,
                use == Use::Dynamic ? cell.density > 0 : cell.density >= 0,
                use == Use::Dynamic ? "> 0 (dynamics needs mass)" : ">= 0");
  }
  for (std::size_t i = 0; i < d.nodes.size(); ++i) checkVector(d, "nodes", i, d.nodes[i]);
  checkTetrahedra(d);
  const std::vector<int> component = components(d, {});
  std::vector<std::uint8_t> held(d.nodes.size(), 0);
  for (std::size_t i = 0; i < d.fixed.size(); ++i) {
    checkNode(d, "fixed", i, d.fixed[i]);
    held[d.fixed[i]] = 1;
  }
  for (std::size_t i = 0; i < d.prescribed.size(); ++i) {
    const Prescribed& p = d.prescribed[i];
    checkNode(d, "prescribed", i, p.node);
    checkVector(d, "prescribed", i, p.displacement);
    if (held[p.node] != 0) refuse(d, "prescribed[", i, "]: node ", p.node, " is held already; allowed: once");
    held[p.node] = 1;
  }
  for (std::size_t i = 0; i < d.loads.size(); ++i) {
    checkNode(d, "loads", i, d.loads[i].node);
    checkVector(d, "loads", i, d.loads[i].force);
    if (component[d.loads[i].node] < 0) {
      refuse(d, "loads[", i, "]: node ", d.loads[i].node,
             " belongs to no tetrahedron; allowed: nodes of the tissue");
    }
  }
  if (use == Use::Dynamic) return;
  const int count = component.empty() ? 0 : *std::max_element(component.begin(), component.end()) + 1;
  std::vector<std::uint8_t> anchored(static_cast<std::size_t>(count), 0);
  for (std::size_t n = 0; n < held.size(); ++n) {
    if (held[n] != 0 && component[n] >= 0) anchored[static_cast<std::size_t>(component[n])] = 1;
  }
  // Three held nodes that are not on one line take all six rigid motions; fewer leave a hinge.
  for (int c = 0; c < count; ++c) {
    std::size_t size = 0, first = d.nodes.size(), points = 0;
    Eigen::Vector3d p0, p1;
    bool hinge = true;
    for (std::size_t n = 0; n < component.size(); ++n) {
      if (component[n] != c) continue;
      ++size;
      first = std::min(first, n);
      if (held[n] == 0) continue;
      if (points == 0) p0 = d.nodes[n];
      if (points == 1) p1 = d.nodes[n];
      if (points >= 2) {
        const Eigen::Vector3d u = p1 - p0, w = d.nodes[n] - p0;
        if (u.cross(w).norm() > 1e-9 * u.norm() * w.norm()) hinge = false;
      }
      ++points;
    }
    if (anchored[static_cast<std::size_t>(c)] == 0) {
      refuse(d, "the component of ", size, " nodes that starts at node ", first,
             " has nothing fixed, so it has no equilibrium; allowed: at least three nodes of it in `fixed`");
    }
    if (hinge) {
      refuse(d, "the component of ", size, " nodes that starts at node ", first, " is held by ", points,
             " node(s) on one line and can still turn; allowed: at least three fixed nodes that are not on "
             "one line");
    }
  }
}

}  // namespace vest::fem
