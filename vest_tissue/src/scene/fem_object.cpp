#include "vest_tissue/scene/fem_object.h"

#include <algorithm>
#include <stdexcept>
#include <unordered_map>

#include "vest_tissue/fem/element.h"
#include "vest_tissue/fem/simulate.h"

namespace vest::scene {
namespace {

std::array<Index, 3> sorted(std::array<Index, 3> f) {
  std::sort(f.begin(), f.end());
  return f;
}

/// Nodes of the boundary and of the skin first, each kind in its order.
void sortOutside(Object& object) {
  fem::Description d = *object.fem;
  std::vector<std::uint8_t> outside(d.nodes.size(), 0);
  for (const auto& f : object.contact_triangles)
    for (const Index n : f) outside[n] = 1;
  for (const Index n : object.skin.binding_knots) outside[n] = 1;
  d.outer = static_cast<Index>(std::count(outside.begin(), outside.end(), 1));
  std::vector<Index> to(d.nodes.size());
  Index outer = 0, inner = d.outer;
  for (Index n = 0; n < to.size(); ++n) to[n] = outside[n] != 0 ? outer++ : inner++;
  for (Index n = 0; n < to.size(); ++n) d.nodes[to[n]] = object.fem->nodes[n];
  for (auto& t : d.tetrahedra)
    for (Index& n : t) n = to[n];
  for (Index& n : d.fixed) n = to[n];
  for (fem::Prescribed& p : d.prescribed) p.node = to[p.node];
  for (fem::Load& l : d.loads) l.node = to[l.node];
  for (auto& f : object.contact_triangles)
    for (Index& n : f) n = to[n];
  for (std::uint32_t& n : object.skin.binding_knots) n = to[n];
  object.fem = std::make_shared<const fem::Description>(std::move(d));
}

}  // namespace

std::vector<std::array<Index, 3>> boundaryFaces(const std::vector<std::array<Index, 4>>& tetrahedra) {
  struct Hash {
    std::size_t operator()(const std::array<Index, 3>& f) const {
      return (static_cast<std::size_t>(f[0]) * 73856093u) ^ (static_cast<std::size_t>(f[1]) * 19349663u) ^
             (static_cast<std::size_t>(f[2]) * 83492791u);
    }
  };
  std::unordered_map<std::array<Index, 3>, int, Hash> seen;
  seen.reserve(2 * tetrahedra.size());
  const auto face = [&](std::size_t e, int f) {
    const auto& t = tetrahedra[e];
    return std::array<Index, 3>{t[fem::kFaces[f][0]], t[fem::kFaces[f][1]], t[fem::kFaces[f][2]]};
  };
  for (std::size_t e = 0; e < tetrahedra.size(); ++e)
    for (int f = 0; f < 4; ++f) ++seen[sorted(face(e, f))];
  std::vector<std::array<Index, 3>> faces;
  for (std::size_t e = 0; e < tetrahedra.size(); ++e) {
    for (int f = 0; f < 4; ++f)
      if (seen[sorted(face(e, f))] == 1) faces.push_back(face(e, f));
  }
  return faces;
}

std::size_t knotsOf(const fem::Description& d) {
  return d.motion == fem::Motion::Condensed ? d.outer : d.nodes.size();
}

void completeFem(Object& object) {
  object.contact_triangles = boundaryFaces(object.fem->tetrahedra);
  if (object.fem->motion == fem::Motion::Condensed) sortOutside(object);
  const fem::Description& d = *object.fem;
  const std::size_t nodes = knotsOf(d);
  object.rest_position.assign(d.nodes.begin(), d.nodes.begin() + static_cast<std::ptrdiff_t>(nodes));
  object.position = object.rest_position;
  object.fixed.assign(nodes, 0);
  for (const fem::Index n : d.fixed)
    if (n < nodes) object.fixed[n] = 1;
  for (const fem::Prescribed& p : d.prescribed) {
    if (p.node >= nodes) continue;
    object.fixed.at(p.node) = 1;
    object.position.at(p.node) += p.displacement;
  }
  object.mass.assign(nodes, 0.0);
  object.damping.assign(nodes, 0.0);
  double mass = 0.0, volume = 0.0;
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    const auto& t = d.tetrahedra[e];
    const double v =
        fem::sixfoldVolume({d.nodes.at(t[0]), d.nodes.at(t[1]), d.nodes.at(t[2]), d.nodes.at(t[3])}) / 6.0;
    const double share = d.materialOf(e).density * v / 4.0;
    for (const fem::Index n : t)
      if (n < nodes) object.mass[n] += share;
    mass += 4.0 * share, volume += v;
  }
  object.density = volume > 0.0 ? mass / volume : d.material.density;
  object.law.youngs_modulus = d.materialOf(0).youngs_modulus;
  if (!object.skin.triangles.empty()) return;
  Skin& skin = object.skin;
  std::vector<std::uint32_t> vertex(nodes, ~0u);
  for (const auto& f : object.contact_triangles)
    for (const Index n : f) vertex[n] = 0;
  skin.binding_start.push_back(0);
  for (Index n = 0; n < nodes; ++n) {
    if (vertex[n] != 0) continue;
    vertex[n] = static_cast<std::uint32_t>(skin.binding_start.size() - 1);
    skin.binding_knots.push_back(n);
    skin.binding_weights.push_back(1.0f);
    skin.binding_start.push_back(static_cast<std::uint32_t>(skin.binding_knots.size()));
    const Eigen::Vector3d& x = d.nodes[n];
    skin.texture_coordinates.push_back(
        {static_cast<float>(x.x() + 0.5 * x.z()), static_cast<float>(x.y() + 0.5 * x.z())});
  }
  for (const auto& f : object.contact_triangles)
    skin.triangles.push_back({vertex[f[0]], vertex[f[1]], vertex[f[2]]});
  skin.layer.assign(skin.triangles.size(), 0);
}

std::string condensedSentence(const Description& description) {
  std::string names;
  for (const Object& o : description.objects)
    if (o.fem && o.fem->motion == fem::Motion::Condensed) names += (names.empty() ? "" : ", ") + o.name;
  if (names.empty()) return names;
  return "condensed: " + names +
         ": tools press, grasp, stitch and heat it; blades, clips and slings do not take hold of it "
         "(docs/scene_format.md, \"Condensed elements\")";
}

void settleFem(Object& object, const Eigen::Vector3d& gravity) {
  const auto model = fem::buildModel(*object.fem, fem::Use::Static);
  fem::State state = fem::restState(*model);
  fem::Scratch scratch(*model, 1);
  if (!fem::solveStatic(*model, gravity, state, scratch).converged) {
    throw std::invalid_argument(
        "object '" + object.name +
        "': start: equilibrium: none was found; allowed: smaller loads, or start: rest");
  }
  object.position = std::move(state.x);
}

}  // namespace vest::scene
