#include "vest_tissue/modelling/bake.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include <xxhash.h>
#include <Eigen/Geometry>

#include "vest_tissue/fem/description.h"
#include "vest_tissue/modelling/ring_stiffness.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/spread_texture.h"
#include "vest_tissue/scene/tissue_numbers.h"

namespace vest::modelling {
namespace {

using scene::Index;
using scene::Object;

constexpr double kSupportDamping = 0.7;  // of the critical one: gives way without swinging; assumed

// A net between its geometry and its place in the scene.
struct Draft {
  const ObjectSource* source;
  RingNet net;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::uint64_t key = 0;         // of what the net is made from so far
  std::uint64_t object_key = 0;  // of what the object is made from
};

std::uint64_t both(std::uint64_t a, std::uint64_t b) {
  const std::uint64_t pair[] = {a, b};
  return XXH64(pair, sizeof pair, 0);
}

/// What was kept under this key, or what `make` makes.
template <class T, class Make>
const T& keep(BakeCache::Kept<T>& kept, std::uint64_t key, Make make) {
  if (!kept.value || kept.key != key) {
    kept.value = nullptr;
    kept.value = std::make_shared<const T>(make());
    kept.key = key;
  }
  return *kept.value;
}

[[noreturn]] void fail(const ObjectSource& object, int line, const std::string& what) {
  const std::string place = object.file.empty() ? ""
                            : line > 0          ? object.file + ":" + std::to_string(line) + ": "
                                                : object.file + ": ";
  throw std::invalid_argument(place + "object " + object.name + ": " + what);
}

[[noreturn]] void fail(const ObjectSource& object, const std::string& key, const std::string& what) {
  const auto found = object.line.find(object.line.count(key) ? key : "");
  fail(object, found == object.line.end() ? 0 : found->second, what);
}

std::vector<std::uint32_t> selected(const Rings& rings, const Draft& draft) {
  const int count = static_cast<int>(draft.net.rings);
  const int first = rings.first < 0 ? count + rings.first : rings.first;
  const int last = rings.last < 0 ? count + rings.last : rings.last;
  if (first < 0 || last >= count || first > last) {
    fail(*draft.source, rings.line,
         "rings " + std::to_string(rings.first) + " to " + std::to_string(rings.last) +
             ": must be rings of 0 to " + std::to_string(count - 1));
  }
  std::vector<std::uint32_t> result;
  for (int r = first; r <= last; r += rings.step) result.push_back(static_cast<std::uint32_t>(r));
  return result;
}

void pushBumps(Draft& draft) {
  for (const Bump& bump : draft.source->bumps) {
    for (Vector3& knot : draft.net.knots) {
      const Vector3 away = (knot - bump.at).cwiseQuotient(bump.size);
      knot += std::exp(-0.5 * away.squaredNorm()) * bump.push;
    }
  }
}

const Draft& draftNamed(const std::vector<Draft>& drafts, const std::string& name, const Draft& asker,
                        int line) {
  std::string known;
  for (const Draft& draft : drafts) {
    if (draft.source->name == name) return draft;
    known += (known.empty() ? "" : ", ") + draft.source->name;
  }
  fail(*asker.source, line, "refers to " + name + ", which is no object of the scene; those are " + known);
}

void moveRing(RingNet& net, std::uint32_t ring, const Vector3& by) {
  for (std::uint32_t k = 0; k < net.around; ++k) net.knots[net.knot(ring, k)] += by;
  if (ring == 0 && net.start == End::Pole) net.knots[net.startPole()] += by;
  if (ring + 1 == net.rings && net.end == End::Pole) net.knots[net.endPole()] += by;
}

void layOn(Draft& draft, const Draft& other, const LayRule& rule) {
  RingNet& net = draft.net;
  const auto rings = selected(rule.rings, draft);
  const NearestPoints nearest(other.net.knots, other.triangles);
  for (int round = 0; round < 4; ++round) {  // smoothed shifts, a few times: lies close, without kinks
    std::vector<Vector3> shift;
    for (const auto r : rings) {
      Vector3 centre = Vector3::Zero();
      for (std::uint32_t k = 0; k < net.around; ++k) centre += net.knots[net.knot(r, k)] / net.around;
      const auto near = nearest(centre);
      shift.push_back((rule.gap - near.distance) * near.normal);
    }
    for (std::size_t i = 0; i < rings.size(); ++i) {
      const Vector3& before = shift[i > 0 ? i - 1 : i];
      const Vector3& after = shift[std::min(i + 1, rings.size() - 1)];
      moveRing(net, rings[i], 0.25 * before + 0.5 * shift[i] + 0.25 * after);
    }
  }
}

// Rings as a whole give way, so that cross-sections keep their shape; neighbours follow smoothly.
void clearOf(Draft& draft, const Draft& other, double gap) {
  RingNet& net = draft.net;
  const NearestPoints nearest(other.net.knots, other.triangles);
  for (int round = 0; round < 12; ++round) {
    std::vector<Vector3> shift(net.rings, Vector3::Zero());
    double most = 0;
    for (std::uint32_t r = 0; r < net.rings; ++r) {
      for (std::uint32_t k = 0; k < net.around; ++k) {
        const auto near = nearest(net.knots[net.knot(r, k)]);
        const double lacking = gap - near.distance;
        if (lacking > 0 && lacking > shift[r].norm()) shift[r] = lacking * near.normal;
      }
      most = std::max(most, shift[r].norm());
    }
    if (most < 1e-5) break;
    for (std::uint32_t r = 0; r < net.rings; ++r) {
      Vector3 move = shift[r];
      if (r > 0 && 0.5 * shift[r - 1].norm() > move.norm()) move = 0.5 * shift[r - 1];
      if (r + 1 < net.rings && 0.5 * shift[r + 1].norm() > move.norm()) move = 0.5 * shift[r + 1];
      moveRing(net, r, move);
    }
  }
}

void addMasses(const Draft& draft, double density, Object& object) {
  const RingNet& net = draft.net;
  const std::size_t knots = net.knots.size();
  const double volume = std::abs(enclosedVolume(net.knots, draft.triangles));
  const double total = density * volume * draft.source->fill;
  // Shares by the area of the triangles around each knot; nobody has less than a third of the mean (thin
  // ends).
  std::vector<double> share(knots, 0.0);
  for (const auto& t : draft.triangles) {
    const double area =
        0.5 * (net.knots[t[1]] - net.knots[t[0]]).cross(net.knots[t[2]] - net.knots[t[0]]).norm();
    const std::uint32_t ring = std::min(t[0] / net.around, net.rings - 1);
    for (const auto k : t) share[k] += area * net.mean_radius[ring] / 3;
  }
  const double mean = std::accumulate(share.begin(), share.end(), 0.0) / static_cast<double>(knots);
  for (double& s : share) s = std::max(s, mean / 3);
  const double sum = std::accumulate(share.begin(), share.end(), 0.0);
  for (const double s : share) object.mass.push_back(total * s / sum);
}

void addLinks(const Draft& draft, Object& object) {
  const ObjectSource& source = *draft.source;
  std::vector<NetLink> links;
  try {
    links = makeLinks(draft.net, source.springs, source.fillers);
  } catch (const std::invalid_argument& error) {
    fail(source, "springs", error.what());
  }
  const std::vector<double> areas = linkAreas(draft.net, links);
  for (std::size_t i = 0; i < links.size(); ++i) {
    const NetLink& net_link = links[i];
    scene::Link link;
    link.knot0 = net_link.a;
    link.knot1 = net_link.b;
    link.rest = (object.rest_position[net_link.b] - object.rest_position[net_link.a]).norm() /
                (1.0 + source.prestrain);
    link.area = areas[i];
    const double stiffness = linkStiffness(object, link);
    const double reduced = object.mass[link.knot0] * object.mass[link.knot1] /
                           (object.mass[link.knot0] + object.mass[link.knot1]);
    link.damping = 2 * source.damping_ratio * std::sqrt(stiffness * reduced);
    object.links.push_back(link);
  }
}

void addHolds(const Draft& draft, const std::vector<Draft>& drafts, const Vector3& gravity, Object& object) {
  const ObjectSource& source = *draft.source;
  const RingNet& net = draft.net;
  for (const FixRule& rule : source.fixed) {
    if (rule.rings) {
      for (const auto r : selected(*rule.rings, draft)) {
        for (std::uint32_t k = 0; k < net.around; ++k) object.fixed[net.knot(r, k)] = 1;
        if (r == 0 && net.start == End::Pole) object.fixed[net.startPole()] = 1;
        if (r + 1 == net.rings && net.end == End::Pole) object.fixed[net.endPole()] = 1;
      }
    }
    if (!rule.outside.empty()) {
      const Draft& cavity = draftNamed(drafts, rule.outside, draft, rule.line);
      const NearestPoints nearest(cavity.net.knots, cavity.triangles);
      for (std::size_t i = 0; i < net.knots.size(); ++i) {
        if (nearest(net.knots[i]).distance < rule.margin) object.fixed[i] = 1;
      }
    }
  }
  for (const TetherRule& rule : source.tethers) {
    for (const auto r : selected(rule.rings, draft)) {
      for (std::uint32_t k = 0; k < net.around; ++k) {
        const Index knot = net.knot(r, k);
        if (object.fixed[knot]) continue;
        const double damping = 0.2 * std::sqrt(rule.stiffness * object.mass[knot]);
        object.tethers.push_back({knot, object.rest_position[knot], rule.stiffness, damping});
      }
    }
  }
  if (source.support > 0) {
    for (Index i = 0; i < object.mass.size(); ++i) {
      if (object.fixed[i]) continue;
      const double stiffness = object.mass[i] * source.support * source.support;
      const Vector3 place = object.rest_position[i] - object.mass[i] / stiffness * gravity;
      object.tethers.push_back({i, place, stiffness, 2 * kSupportDamping * source.support * object.mass[i]});
    }
  }
}

/// The connections of each rule.
std::vector<std::vector<scene::Connection>> connectionsOf(const Draft& draft,
                                                          const std::vector<Draft>& drafts,
                                                          const std::vector<Object>& objects) {
  const auto objectNamed = [&](const std::string& name) -> const Object& {
    return *std::find_if(objects.begin(), objects.end(), [&](const Object& o) { return o.name == name; });
  };
  const Object& self = objectNamed(draft.source->name);
  std::vector<std::vector<scene::Connection>> all;
  for (const ConnectRule& rule : draft.source->connections) {
    const Draft& other = draftNamed(drafts, rule.to, draft, rule.line);
    const Object& target = objectNamed(rule.to);
    std::vector<scene::Connection>& connections = all.emplace_back();
    const NearestPoints nearest(other.net.knots, other.triangles);
    for (const auto r : selected(rule.rings, draft)) {
      std::vector<std::pair<NearestPoint, Index>> candidates;
      for (std::uint32_t k = 0; k < draft.net.around; ++k) {
        const Index knot = draft.net.knot(r, k);
        const auto near = nearest(draft.net.knots[knot]);
        if (std::abs(near.distance) <= rule.within && !self.fixed[knot]) candidates.emplace_back(near, knot);
      }
      std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
        return std::abs(a.first.distance) < std::abs(b.first.distance);
      });
      if (candidates.size() > rule.per_ring) candidates.resize(rule.per_ring);
      for (const auto& [near, knot] : candidates) {
        scene::Connection connection;
        connection.object0 = draft.source->name;
        connection.object1 = rule.to;
        connection.knot0 = knot;
        connection.triangle1 = other.triangles[near.triangle];
        connection.weights1 = near.weights;
        connection.offset = draft.net.knots[knot] - near.point;
        connection.stiffness = rule.stiffness;
        double carrier = 0;
        for (int k = 0; k < 3; ++k) carrier += near.weights[k] * target.mass[connection.triangle1[k]];
        const double reduced = self.mass[knot] * carrier / (self.mass[knot] + carrier);
        connection.damping = 0.2 * std::sqrt(rule.stiffness * reduced);
        connections.push_back(connection);
      }
    }
  }
  return all;
}

/// @throws std::invalid_argument where a rule ties nothing
void addConnections(const std::vector<Draft>& drafts, const std::vector<Object>& objects, BakeCache& cache,
                    std::vector<scene::Connection>& connections) {
  const auto nothingNear = [](const Draft& draft, const ConnectRule& rule) {
    fail(*draft.source, rule.line,
         "connect to " + rule.to + ": no knot lies within " + std::to_string(rule.within) + " m");
  };
  std::map<std::string, std::pair<bool, std::pair<const Draft*, const ConnectRule*>>> of_trees;
  for (const Draft& draft : drafts) {
    const auto& rules = draft.source->connections;
    if (rules.empty()) continue;
    std::uint64_t key = draft.object_key;
    for (const ConnectRule& rule : rules)
      key = both(key, draftNamed(drafts, rule.to, draft, rule.line).object_key);
    const auto& made = keep(cache.entries[draft.source->name].connections, key,
                            [&] { return connectionsOf(draft, drafts, objects); });
    for (std::size_t r = 0; r < rules.size(); ++r) {
      if (made[r].empty() && rules[r].all_of.empty()) nothingNear(draft, rules[r]);
      if (!rules[r].all_of.empty()) {
        auto& [any, asked] = of_trees[rules[r].all_of + "\n" + std::to_string(r)];
        any = any || !made[r].empty();
        asked = {&draft, &rules[r]};
      }
      connections.insert(connections.end(), made[r].begin(), made[r].end());
    }
  }
  for (const auto& [name, found] : of_trees)
    if (!found.first) nothingNear(*found.second.first, *found.second.second);
}

}  // namespace

double linkStiffness(const Object& object, const scene::Link& link) {
  if (link.stiffness > 0 || link.kind != scene::LinkKind::Elastic) return link.stiffness;
  return object.law.youngs_modulus * link.area / link.rest;
}

double highestFrequency(const Object& object) {
  // Largest eigenvalue of M^-1 K of the springs, seen from the rest shape. Start vector: fixed, without
  // symmetry.
  const std::size_t knots = object.rest_position.size();
  std::vector<Vector3> v(knots), f(knots);
  for (std::size_t i = 0; i < knots; ++i) {
    v[i] = {std::sin(1.0 + 12.9898 * static_cast<double>(i)), std::sin(2.0 + 78.233 * static_cast<double>(i)),
            std::sin(3.0 + 37.719 * static_cast<double>(i))};
  }
  double value = 0;
  for (int round = 0; round < 300; ++round) {
    double norm = 0;
    for (std::size_t i = 0; i < knots; ++i) {
      if (object.fixed[i]) v[i].setZero();
      norm += v[i].squaredNorm();
    }
    if (norm == 0) return 0;
    for (auto& x : v) x /= std::sqrt(norm);
    for (auto& x : f) x.setZero();
    for (const auto& link : object.links) {
      if (link.kind != scene::LinkKind::Elastic) continue;
      const Vector3 d = (object.rest_position[link.knot1] - object.rest_position[link.knot0]).normalized();
      const Vector3 force = linkStiffness(object, link) * d.dot(v[link.knot1] - v[link.knot0]) * d;
      f[link.knot0] -= force;
      f[link.knot1] += force;
    }
    for (const auto& tether : object.tethers) f[tether.knot] += tether.stiffness * v[tether.knot];
    value = 0;
    for (std::size_t i = 0; i < knots; ++i) value += v[i].dot(f[i]) / object.mass[i];
    for (std::size_t i = 0; i < knots; ++i) v[i] = f[i] / object.mass[i];
  }
  return std::sqrt(std::max(0.0, value));
}

namespace {

const material::Tissue& materialOf(const ObjectSource& object, const std::string& key,
                                   const std::string& name, const Materials& materials) {
  const auto found = materials.find(name);
  if (found != materials.end()) return found->second;
  std::string known;
  for (const auto& entry : materials) known += (known.empty() ? "" : ", ") + entry.first;
  fail(object, key, "material " + name + " is not in the database: " + known);
}

/// A wall of elements: its first nodes are the net's knots.
void addLayers(const Draft& draft, const std::vector<Draft>& drafts, const Vector3& gravity,
               const Materials& materials, Object& object) {
  // As the shipped scenes of elements have them: assumed.
  constexpr double kRayleighMass = 2.0, kRayleighStiffness = 0.004;
  const ObjectSource& from = *draft.source;
  LayeredMesh mesh;
  try {
    mesh = makeLayers(draft.net.knots, wallTriangles(draft.net), from.layers);
  } catch (const std::invalid_argument& error) {
    fail(from, "layers", error.what());
  }
  auto fem = std::make_shared<fem::Description>();
  fem->name = from.name;
  fem->start_in_equilibrium = true;
  fem->nodes = mesh.nodes;
  fem->tetrahedra = mesh.tetrahedra;
  fem->cell_material = mesh.layer;
  for (const Layer& layer : from.layers) {
    const material::Tissue& entry = materialOf(from, "layers", layer.material, materials);
    fem->materials.push_back(
        {entry.law().youngs_modulus, entry.at("poisson_ratio").value, entry.at("density").value, 0.0, 0.0});
  }
  fem->material = fem->materials[0];
  fem->material.rayleigh_mass = kRayleighMass;
  fem->material.rayleigh_stiffness = kRayleighStiffness;
  // Held is the whole wall below a knot that is held.
  object.rest_position = draft.net.knots;
  object.fixed.assign(draft.net.knots.size(), 0);
  addHolds(draft, drafts, gravity, object);
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
    if (object.fixed[i % draft.net.knots.size()]) fem->fixed.push_back(static_cast<Index>(i));
  if (fem->fixed.empty()) fail(from, "layers", "nothing holds it; allowed: fixed rings, for elements");
  object.model = scene::ObjectModel::Fem;
  object.fem = std::move(fem);
  scene::completeFem(object);
  object.contact_thickness = from.contact_thickness;
  object.full_contact = from.full_contact;
  object.puncture_force = from.puncture_force;
}

Object objectOf(const Draft& draft, const std::vector<Draft>& drafts, const Vector3& gravity,
                const Materials& materials) {
  const ObjectSource& from = *draft.source;
  const material::Tissue& material = materialOf(from, "material", from.material, materials);
  Object object;
  object.name = from.name;
  object.organ = from.organ;
  object.material = from.material;
  object.roles = from.roles;
  object.model = from.rigid ? scene::ObjectModel::Rigid : scene::ObjectModel::Net;
  object.law = material.law();
  object.law.youngs_modulus *= from.stiffness_factor;
  object.density = material.at("density").value;
  scene::takeTissue(material, material::Condition::InVivo, object);
  object.friction = from.friction.value_or(object.friction);
  object.cut_toughness = from.cut_toughness.value_or(object.cut_toughness);
  object.tear_strain = from.tear_strain.value_or(object.tear_strain);
  object.grasp_damage_threshold = from.grasp_damage_threshold.value_or(object.grasp_damage_threshold);
  if (!from.layers.empty()) {
    addLayers(draft, drafts, gravity, materials, object);
    return object;
  }
  object.rest_position = object.position = draft.net.knots;
  object.fixed.assign(draft.net.knots.size(), from.rigid ? 1 : 0);
  addMasses(draft, object.density, object);
  for (const double mass : object.mass) object.damping.push_back(from.rigid ? 0.0 : from.damping_rate * mass);
  if (!from.rigid) {
    addLinks(draft, object);
    if (from.bulk_modulus > 0) object.volumes.push_back({draft.triangles, from.bulk_modulus, 0.0});
    addHolds(draft, drafts, gravity, object);
  }
  object.contact_triangles = draft.triangles;
  object.contact_thickness = from.contact_thickness;
  object.full_contact = from.full_contact;
  object.puncture_force = from.puncture_force;
  object.wall_thickness = from.inner_wall > 0.0 ? from.inner_wall
                          : from.tube           ? from.tube->wall_thickness
                          : from.revolve        ? from.revolve->wall_thickness
                                                : 0.0;
  object.skin = makeSkin(draft.net, from.skin_along, from.skin_around, from.petals, from.petal_depth);
  if (from.facing || draft.net.inside)
    scene::spreadTexture(draft.net.knots, from.facing.value_or(kPelvis), &object.skin);
  object.tube.station = draft.net.station;
  object.tube.vessel_segment = from.vessel_segment;
  object.motility = from.motility;
  for (std::uint32_t r = 0; r < draft.net.rings; ++r) {
    std::vector<Index> ring;
    for (std::uint32_t k = 0; k < draft.net.around; ++k) ring.push_back(draft.net.knot(r, k));
    object.tube.rings.push_back(std::move(ring));
  }
  return object;
}

RingNet drawn(const ObjectSource& object) try {
  Draft draft{&object,
              object.tube    ? makeTube(*object.tube)
              : object.sheet ? makeSheet(*object.sheet)
                             : makeRevolve(*object.revolve),
              {}};
  pushBumps(draft);
  return draft.net;
} catch (const std::invalid_argument& error) {
  fail(object, object.tube ? "tube" : object.sheet ? "sheet" : "revolve", error.what());
}

/// Nets in their places.
std::vector<Draft> draftsOf(const SceneSource& source, BakeCache& cache) {
  std::vector<Draft> drafts;
  for (const ObjectSource& object : source.objects) {
    Draft draft{
        &object, keep(cache.entries[object.name].drawn, object.key, [&] { return drawn(object); }), {}};
    draft.triangles = knotTriangles(draft.net);
    draft.key = object.key;
    drafts.push_back(std::move(draft));
  }
  for (Draft& draft : drafts) {
    const auto& rules = draft.source->lay;
    if (rules.empty()) continue;
    for (const LayRule& rule : rules)
      draft.key = both(draft.key, draftNamed(drafts, rule.on, draft, rule.line).key);
    draft.net = keep(cache.entries[draft.source->name].laid, draft.key, [&] {
      Draft moved = draft;
      for (const LayRule& rule : rules) layOn(moved, draftNamed(drafts, rule.on, draft, rule.line), rule);
      return moved.net;
    });
  }
  for (Draft& draft : drafts) {  // when everything lies in its place
    const auto& rules = draft.source->clear;
    if (rules.empty()) continue;
    for (const ClearRule& rule : rules)
      draft.key = both(draft.key, draftNamed(drafts, rule.of, draft, rule.line).key);
    draft.net = keep(cache.entries[draft.source->name].cleared, draft.key, [&] {
      Draft moved = draft;
      for (const ClearRule& rule : rules)
        clearOf(moved, draftNamed(drafts, rule.of, draft, rule.line), rule.gap);
      return moved.net;
    });
  }
  return drafts;
}

/// Before a skin is made: a source of ten lines may ask for gigabytes.
void checkSkins(const std::vector<Draft>& drafts) {
  constexpr std::size_t kMost =
      250000;  ///< vertices of all objects (assumed): 40 MB of nets, of 64 that are read
  std::size_t vertices = 0;
  for (const Draft& draft : drafts) {
    const ObjectSource& from = *draft.source;
    if (!from.layers.empty()) continue;
    vertices += std::size_t{from.skin_along} * (draft.net.rings + 1) * from.skin_around * draft.net.around;
    if (vertices > kMost)
      fail(from, "skin",
           std::to_string(vertices) + " vertices of skin, with the objects before it; allowed: at most " +
               std::to_string(kMost));
  }
}

}  // namespace

scene::Description bake(const SceneSource& source, const Materials& materials, BakeCache* cache) {
  scene::Description description;
  description.name = source.name;
  description.gravity = source.gravity;
  description.dt = source.dt;
  description.seed = source.seed;
  description.sutures = source.sutures;

  BakeCache fresh;
  BakeCache& kept = cache ? *cache : fresh;
  kept.rebuilt.clear();
  std::vector<Draft> drafts = draftsOf(source, kept);
  checkSkins(drafts);
  for (Draft& draft : drafts) {
    const ObjectSource& from = *draft.source;
    draft.object_key = XXH64(source.gravity.data(), 3 * sizeof(double), draft.key);
    for (const FixRule& rule : from.fixed)
      if (!from.rigid && !rule.outside.empty())
        draft.object_key = both(draft.object_key, draftNamed(drafts, rule.outside, draft, rule.line).key);
    description.objects.push_back(keep(kept.entries[from.name].object, draft.object_key, [&] {
      kept.rebuilt.push_back(from.name);
      return objectOf(draft, drafts, source.gravity, materials);
    }));
  }
  addConnections(drafts, description.objects, kept, description.connections);
  for (const TreeSource& tree : source.trees) {
    if (tree.spec.supply.empty()) continue;
    description.vessels.push_back(
        vesselTree(tree.name, tree.spec, tree.branches, materials.at(tree.material).law().youngs_modulus));
  }
  for (auto& [name, entry] : kept.entries) entry.used = false;
  for (const ObjectSource& object : source.objects) kept.entries[object.name].used = true;
  for (auto it = kept.entries.begin(); it != kept.entries.end();)
    it = it->second.used ? std::next(it) : kept.entries.erase(it);
  return description;
}

}  // namespace vest::modelling
