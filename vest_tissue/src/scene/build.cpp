#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <sstream>
#include <stdexcept>

#include <Eigen/Geometry>

#include "connections.h"
#include "identity.h"
#include "object_arrays.h"
#include "stages.h"
#include "vest_tissue/base/grid_cost.h"
#include "vest_tissue/base/nearest.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_scratch.h"
#include "vest_tissue/solver/implicit_net.h"

namespace vest::scene {
namespace {

using net::Block;

constexpr double kContactShare = 0.3;    ///< of the net's own omega² that contacts may add (tuned)
constexpr double kContactLeast = 4.0e6;  ///< 1/s²: and at least this, for loose nets (2,000 rad/s)
constexpr double kSlowMargin = 0.4;  ///< of the longest step, for held forces: they see deformed shapes too
/// The same of connections: kStepMargin, and their ends may answer twice as much as built (connections.cpp:
/// kLighter).
constexpr double kTiedMargin = 0.566;
constexpr double kLeastHeight = 0.5;  ///< of a hinge's lower wing at rest: net::Hinge::least (tuned)
/// s, an implicit step: contacts of kContactLeast are held explicitly beside it, at half a radian a step.
constexpr double kImplicitStep = 2.5e-4;
constexpr int kPowerSweeps = 40;
constexpr double kPowerMargin = 1.15;  ///< the iteration converges from below

/// The least of base, 2 base, 4 base … that is not below `least`.
int doubled(int base, double least) {
  int n = base;
  while (n < least && n < (1 << 20)) n *= 2;
  return n;
}

int multipleOf(int unit, int least) {
  return (least + unit - 1) / unit * unit;
}

/// Exchanges of held forces a step, for objects that touch: 4, or 3 where that costs less, in links and held
/// forces evaluated a step. Each object's own number is this one or it doubled, so that all meet
/// (docs/decisions/0011-…). Finite elements stay with 2 and 4: their steps are dear.
int exchanges(const WorldModel& m, double dt) {
  const int limit = static_cast<int>(std::max(1.0, solver::kSubStepsPerSecond * dt));
  int best = 4;
  double least = std::numeric_limits<double>::infinity();
  for (const int base : {4, 3}) {
    double cost = 0.0;
    bool fits = true;
    for (const std::size_t i : m.bodies) {
      const ObjectConstants& c = m.objects[i];
      const int batches = doubled(base, c.exchanges_needed), sub_steps = multipleOf(batches, c.sub_steps);
      fits = fits && !c.fem && sub_steps <= std::max(limit, base);
      cost += static_cast<double>(m.start.objects[i].links.size()) * (sub_steps + batches);
    }
    if ((fits || base == 4) && cost < least) least = cost, best = base;
  }
  return best;
}

void fillKnots(const Object& o, ObjectState& s) {
  Block& b = s.block;
  for (std::size_t i = 0; i < o.position.size(); ++i) {
    std::uint32_t k;
    b.addKnot(k);
    b.row(Block::X)[i] = static_cast<float>(o.position[i].x());
    b.row(Block::Y)[i] = static_cast<float>(o.position[i].y());
    b.row(Block::Z)[i] = static_cast<float>(o.position[i].z());
    if (o.model == ObjectModel::Rigid) continue;
    const bool fixed = !o.fixed.empty() && o.fixed[i] != 0;
    const double mass = o.mass[i];
    b.row(Block::kMass)[i] = static_cast<float>(mass);
    b.row(Block::kInverseMass)[i] = fixed ? 0.0f : static_cast<float>(1.0 / mass);
    b.row(Block::kDecay)[i] = o.damping.empty() ? 0.0f : static_cast<float>(o.damping[i] / mass);
    if (!fixed && !std::isfinite(b.row(Block::kInverseMass)[i])) {
      std::ostringstream out;
      out << "object '" << o.name << "': mass[" << i << "]: " << mass
          << " (>= 1e-38 kg, so that its inverse is finite)";
      throw std::invalid_argument(out.str());
    }
  }
  s.fixed.assign(o.position.size(), 0);
  for (std::size_t i = 0; i < o.fixed.size(); ++i)
    s.fixed[i] = o.fixed[i] != 0 || o.model == ObjectModel::Rigid;
}

void fillLinks(const Object& o, ObjectState& s) {
  std::vector<net::KernelLink> by_law, linear;
  for (const Link& l : o.links) {
    LinkPlace place{l.kind, 0};
    if (l.kind == LinkKind::Elastic || l.kind == LinkKind::Viscous) {
      const bool elastic = l.kind == LinkKind::Elastic;
      NetLink link;
      link.by_law = elastic && l.stiffness == 0.0;
      const double axial = !elastic      ? 0.0
                           : link.by_law ? o.law.youngs_modulus * l.area
                                         : l.stiffness * l.rest;
      link.values = {l.knot0, l.knot1, elastic ? static_cast<float>(l.rest) : 1.0f, static_cast<float>(axial),
                     static_cast<float>(l.damping)};
      auto& table = link.by_law ? by_law : linear;
      link.place = static_cast<std::uint32_t>(table.size());
      table.push_back(link.values);
      place.index = static_cast<std::uint32_t>(s.links.size());
      s.links.push_back(link);
    } else if (l.kind == LinkKind::Plastic) {
      place.index = static_cast<std::uint32_t>(s.elements.plastic.size());
      s.elements.plastic.push_back({l.knot0, l.knot1, static_cast<float>(l.stiffness),
                                    static_cast<float>(l.rest), static_cast<float>(l.damping)});
    } else {
      place.index = static_cast<std::uint32_t>(s.elements.bending.size());
      s.elements.bending.push_back({l.knot0, l.knot1, l.knot2, static_cast<float>(l.stiffness),
                                    static_cast<float>(std::max(0.0, 3.14159265358979 - l.rest))});
      if (s.elements.bending.back().rest < 1e-5f) s.elements.bending.back().rest = 0.0f;
    }
    s.places.push_back(place);
  }
  // Room for cuts: as many links again.
  s.law_links = net::LinkTable(by_law, o.law, by_law.empty() ? 0 : 32 + by_law.size(), s.fixed);
  s.linear_links = net::LinkTable(linear, material::Law{}, linear.empty() ? 0 : 32 + linear.size(), s.fixed);
}

void fillElements(const Object& o, ObjectState& s) {
  for (const HingeElement& h : o.hinges) {
    const auto at = [&](int i) -> const Eigen::Vector3d& { return o.rest_position[h.knots[i]]; };
    const Eigen::Vector3d edge = at(1) - at(0);
    const double doubled = std::min(edge.cross(at(2) - at(0)).norm(), edge.cross(at(3) - at(0)).norm());
    const double height = kLeastHeight * doubled / std::max(edge.norm(), 1e-12);
    s.elements.hinges.push_back(
        {h.knots[0], h.knots[1], h.knots[2], h.knots[3], static_cast<float>(h.stiffness),
         static_cast<float>(net::foldOf(at(0), at(1), at(2), at(3))), static_cast<float>(height * height)});
  }
  for (const Tether& t : o.tethers) {
    s.elements.tethers.push_back({t.knot,
                                  {float(t.place.x()), float(t.place.y()), float(t.place.z())},
                                  static_cast<float>(t.stiffness),
                                  static_cast<float>(t.damping)});
  }
  for (std::size_t i = 0; i < o.volumes.size(); ++i) {
    const VolumeElement& v = o.volumes[i];
    net::Volume volume;
    volume.bulk_modulus = static_cast<float>(v.bulk_modulus);
    double rest = v.rest_volume;
    for (const auto& t : v.triangles) {
      volume.triangles.push_back({t[0], t[1], t[2]});
      volume.knots.insert(volume.knots.end(), t.begin(), t.end());
      if (v.rest_volume == 0.0) {
        const auto& p = o.rest_position;
        const Eigen::Vector3d origin = p[v.triangles[0][0]];
        rest += (p[t[0]] - origin).dot((p[t[1]] - origin).cross(p[t[2]] - origin)) / 6.0;
      }
    }
    std::sort(volume.knots.begin(), volume.knots.end());
    volume.knots.erase(std::unique(volume.knots.begin(), volume.knots.end()), volume.knots.end());
    if (!volume.triangles.empty() && !(rest > 0.0)) {
      std::ostringstream out;
      out << "object '" << o.name << "': volumes[" << i << "].triangles: enclose " << rest
          << " m³ (> 0: counter-clockwise from outside, closed)";
      throw std::invalid_argument(out.str());
    }
    volume.rest = static_cast<float>(rest);
    s.elements.volumes.push_back(std::move(volume));
  }
}

void fillState(const Object& o, ObjectState& s) {
  const std::size_t knots = o.position.size();
  // Room for cuts: half as many knots more.
  const bool rigid = o.model == ObjectModel::Rigid;
  s.block = Block(rigid ? knots : knots + std::max<std::size_t>(16, knots / 2));
  fillKnots(o, s);
  if (!rigid) {
    fillLinks(o, s);
    fillElements(o, s);
  }
  s.topology.links = o.links;
  s.topology.link_alive.assign(o.links.size(), 1);
  s.topology.skin = o.skin;
  s.topology.triangle_alive.assign(o.skin.triangles.size(), 1);
  for (const auto& t : o.contact_triangles) s.triangles.push_back({t[0], t[1], t[2]});
  s.triangle_alive.assign(s.triangles.size(), 1);
  s.limit_strain = static_cast<float>(o.law.max_strain);
  s.depth.assign(s.block.knotCapacity(), 0.0f);
  if (rigid) return;
  s.load.now.assign(s.block.knotCapacity(), {});
  s.load.told = s.load.now;
  s.load.own.assign(s.block.knotCapacity(), 0.0f);
}

/// Columns of tissue under the knots, and what the links conduct.
void fillHeat(const Object& o, ObjectState& s, ObjectConstants& c) {
  c.heat.material = o.thermal;
  c.heat.perfusion = o.knot_perfusion;
  c.heat.density = o.density;
  c.heat.grasp_damage_threshold = o.grasp_damage_threshold;
  const std::size_t knots = o.rest_position.size();
  std::vector<double> area(knots, 0.0), volume(knots, 0.0);
  std::vector<std::array<double, 3>> places(knots);
  for (const auto& t : o.contact_triangles) {
    const auto& p = o.rest_position;
    const double third = (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]).norm() / 6.0;
    for (const auto k : t) area[k] += third;
  }
  for (std::size_t k = 0; k < knots; ++k) {
    volume[k] = o.mass[k] / o.density;
    places[k] = {o.rest_position[k].x(), o.rest_position[k].y(), o.rest_position[k].z()};
    c.heat.shapes.push_back(interaction::columnShape(volume[k], area[k]));
  }
  if (o.tube.rings.size() > 1) c.motility.waves = o.motility;
  c.motility.area = area;
  std::vector<interaction::HeatLink> links;
  for (const NetLink& l : s.links)
    links.push_back({l.values.knot0, l.values.knot1,
                     (o.rest_position[l.values.knot1] - o.rest_position[l.values.knot0]).norm()});
  const std::vector<double> g = interaction::linkConductances(places, volume, links, o.thermal.conductivity);
  for (std::size_t i = 0; i < g.size(); ++i) s.links[i].conductance = static_cast<float>(g[i]);
  if (o.fem && o.fem->motion == fem::Motion::Condensed) {  // its surface conducts
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : o.contact_triangles)
      for (std::size_t e = 0; e < 3; ++e) edges.insert(std::minmax(t[e], t[(e + 1) % 3]));
    std::vector<interaction::HeatLink> conducting;
    for (const auto& [a, b] : edges)
      conducting.push_back({a, b, (o.rest_position[b] - o.rest_position[a]).norm()});
    const std::vector<double> of =
        interaction::linkConductances(places, volume, conducting, o.thermal.conductivity);
    std::size_t n = 0;
    for (const auto& [a, b] : edges) c.heat.surface_edges.push_back({a, b, static_cast<float>(of[n++])});
  } else if (o.fem) {  // the edges of its elements conduct as links do, each element a share
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> elements;
    const auto pairOf = [&](const std::array<Index, 4>& t, const std::array<int, 2>& p) {
      const std::uint32_t a = t[static_cast<std::size_t>(p[0])], b = t[static_cast<std::size_t>(p[1])];
      return std::pair{std::min(a, b), std::max(a, b)};
    };
    constexpr std::array<std::array<int, 2>, 6> kEdges{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};
    for (const auto& t : o.fem->tetrahedra)
      for (const auto& p : kEdges) ++elements[pairOf(t, p)];
    std::vector<interaction::HeatLink> edges;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> number;
    for (const auto& [pair, count] : elements) {
      number[pair] = edges.size();
      edges.push_back(
          {pair.first, pair.second, (o.rest_position[pair.second] - o.rest_position[pair.first]).norm()});
    }
    const std::vector<double> of =
        interaction::linkConductances(places, volume, edges, o.thermal.conductivity);
    for (const auto& t : o.fem->tetrahedra) {
      for (const auto& p : kEdges) {
        const auto pair = pairOf(t, p);
        c.heat.element_edges.push_back({static_cast<std::uint8_t>(p[0]), static_cast<std::uint8_t>(p[1]),
                                        static_cast<float>(of[number[pair]] / elements[pair])});
      }
    }
  }
  s.heat.columns.resize(s.block.knotCapacity());
  s.heat.sealed.assign(o.tube.rings.size(), 0);
}

/// The same object of a model that was built before, in the same place; null: there is none.
const ObjectConstants* builtBefore(const WorldModel* before, const Description& d, const Object& o,
                                   std::uint64_t identity) {
  if (before == nullptr || before->description.dt != d.dt) return nullptr;
  for (std::size_t i = 0; i < before->objects.size(); ++i)
    if (before->objects[i].identity == identity && before->description.objects[i].position == o.position)
      return &before->objects[i];
  return nullptr;
}

void fillConstants(const Object& o, const ObjectState& s, const ObjectConstants* before, ObjectConstants& c) {
  c.deforms = o.model != ObjectModel::Rigid;
  c.body = &kRigidBody;
  c.law = o.law;
  c.youngs_modulus = o.fem ? o.fem->material.youngs_modulus : o.law.youngs_modulus;
  c.polynomial = o.law.a2 != 0.0 || o.law.a3 != 0.0 || o.law.a4 != 0.0;
  c.tube = net::TubeMap(o.tube.station, o.tube.rings, o.tube.vessel_segment, o.position.size());
  for (std::size_t i = 0; i < o.links.size(); ++i) {
    const Link& l = o.links[i];
    if (l.kind == LinkKind::Elastic && c.tube.ringOf(l.knot0) >= 0 &&
        c.tube.ringOf(l.knot0) == c.tube.ringOf(l.knot1)) {
      const double along =
          c.tube.length() > 0.0 ? (c.tube.stationOf(l.knot0) - c.tube.station(0)) / c.tube.length() : 0.0;
      c.ring_links.push_back({s.places[i].index, static_cast<float>((DilatationInput::kPlaces - 1) *
                                                                    std::clamp(along, 0.0, 1.0))});
    }
  }
  for (const auto& t : s.triangles) {
    for (int e = 0; e < 3; ++e) {
      c.greatest_edge = std::max(c.greatest_edge, (o.position[t[e]] - o.position[t[(e + 1) % 3]]).norm());
    }
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<SurfaceEdge>>
      edges;  // directed: a closed surface has each once both ways
  for (std::uint32_t i = 0; i < s.triangles.size(); ++i)
    for (std::uint32_t e = 0; e < 3; ++e)
      edges[{s.triangles[i][e], s.triangles[i][(e + 1) % 3]}].push_back({i, i, e});
  c.closed = !edges.empty();
  for (const auto& [knots, all] : edges) {
    const auto back = edges.find({knots.second, knots.first});
    c.closed = c.closed && all.size() == 1 && back != edges.end();
    if (!c.deforms || (back != edges.end() && knots.second < knots.first)) continue;
    c.edges.push_back(all.front());
    if (back != edges.end()) c.edges.back().beyond = back->second.front().triangle;
  }
  if (!c.deforms && !o.position.empty()) {
    c.lowest = c.highest = o.position[0].z();
    for (const auto& p : o.position)
      c.lowest = std::min(c.lowest, p.z()), c.highest = std::max(c.highest, p.z());
  }
  if (before != nullptr) {
    c.grid = before->grid;
  } else if (!c.deforms && !o.contact_triangles.empty()) {
    std::vector<std::array<std::uint32_t, 3>> triangles(s.triangles.begin(), s.triangles.end());
    const double spacing = wallSpacing(o);
    c.grid = contact::DistanceGrid(o.position, triangles, spacing, contact::kWallBand * spacing);
  }
}

/// Finite elements: one implicit step a batch. Contacts and holds may be as stiff as those of the loosest
/// nets.
/// @param before  the same object of an earlier model, or null
/// @return where it was made, to be factorised; else null
std::shared_ptr<fem::TissueModel> boundFem(const Description& d, const Object& o,
                                           const ObjectConstants* before, ObjectState& s,
                                           ObjectConstants& c) {
  c.contact_omega_squared = kContactLeast;
  c.rates.omega_squared = kContactLeast;
  std::shared_ptr<fem::TissueModel> made;
  if (before == nullptr) made = fem::makeTissue(*o.fem, o.fem->motion, d.cache_directory);
  c.fem = made ? made : before->fem;
  c.body = c.fem->condensed()                           ? &kCondensedBody
           : o.fem->motion == fem::Motion::Elastostatic ? &kElastostaticBody
                                                        : &kElementsBody;
  s.tissue = fem::tissueAtRest(*c.fem, o.position);
  // Elastostatic knots have no inertia: what they answer to held forces is known once dt is shared out.
  if (!s.tissue.factored) std::fill_n(s.block.row(Block::kInverseMass), s.block.knots(), 0.0f);
  return made;
}

/// The elements' factor for steps of h, s. That of an earlier model stays as it is.
void factorise(const Description& d, const Object& o, double h, std::shared_ptr<fem::TissueModel> made,
               ObjectConstants& c) {
  if (c.fem->step == h || (c.fem->condensed() && c.fem->step > 0.0)) return;
  if (!made) made = fem::makeTissue(*o.fem, o.fem->motion, d.cache_directory);
  fem::prepareTissue(*made, h, [&](double share) {
    if (d.preparing) d.preparing(o.name, share);
  });
  c.fem = made;
}

/// Sub-steps and batches of a net. What the explicit solver cannot hold is stepped implicitly
/// (docs/decisions/0012-…).
void boundSteps(ObjectState& s, ObjectConstants& c, double dt) {
  solver::BoundScratch scratch(s.block.knotCapacity() + 64);
  const solver::BoundLinks links = boundLinks(s);
  c.bound_at_start = solver::linkRates(links, scratch).omega_squared;
  const double power = solver::powerIteration(links, kPowerSweeps);
  c.calibration = c.bound_at_start > 0.0 ? std::min(1.0, kPowerMargin * power / c.bound_at_start) : 1.0;
  const double own = c.bound_at_start * c.calibration;
  c.contact_omega_squared = std::max(kContactShare * own, kContactLeast);
  c.rates.omega_squared = own + c.contact_omega_squared;
  c.rates.decay = solver::linkDecay(links, scratch) + std::sqrt(c.contact_omega_squared);
  const solver::Rates slow = solver::elementRates(s.block, s.elements, scratch);
  c.slow_omega_squared = slow.omega_squared;
  c.slow_decay = slow.decay;
  const double limit = std::max(1.0, solver::kSubStepsPerSecond * dt);
  const double fast_needed = dt / (solver::kStepMargin * solver::longestStep(c.rates));
  const double slow_needed = dt / (kSlowMargin * solver::longestStep(slow));
  if (!(fast_needed <= limit) || !(slow_needed <= limit)) {
    c.implicit = true;
    c.contact_omega_squared = kContactLeast;
    c.sub_steps = 1;
    c.exchanges_needed = dt / kImplicitStep;
    return;
  }
  // A hundredth of a sub-step is nothing beside the margin.
  c.sub_steps = std::max(1, static_cast<int>(std::ceil(fast_needed - 0.01)));
  c.exchanges_needed = slow_needed;
  const solver::Rates volume{solver::volumeRate(s.block, s.elements, scratch), 0.0};
  c.volume_needed = dt / (kSlowMargin * solver::longestStep(volume));  // <= exchanges: part of `slow`
}

/// The matrices of nets that are stepped implicitly: their memory, and how long one takes to be factorised.
class ImplicitRoom {
 public:
  void take(const Object& o, const ObjectState& s) {
    const solver::NetView net = netView(s);
    solver::KnotOrder order(s.block.knots(), solver::KnotOrder::edgesOf(net));
    order.build(net);
    const std::vector<std::uint32_t>& first = order.first();
    for (std::size_t row = 0; row < order.knots(); ++row) {
      const double width = 3.0 * static_cast<double>(row - first[row] + 1);
      entries_ += 3.0 * width, products_ += 3.0 * width * width;
    }
    if (entries_ <= kMostEntries && products_ <= kMostProducts) return;
    std::ostringstream out;
    out << "object '" << o.name << "': its springs are stiff, so that its steps solve a matrix: with it "
        << entries_ << " entries and " << products_ << " products (allowed: " << kMostEntries << " and "
        << kMostProducts << ": softer springs, a shorter dt, heavier or fewer knots)";
    throw std::invalid_argument(out.str());
  }

 private:
  static constexpr double kMostEntries = 2e7;   ///< 240 MB with the room that cuts need (assumed)
  static constexpr double kMostProducts = 4e9;  ///< a second or two for each solution (assumed)
  double entries_ = 0, products_ = 0;
};

void connect(const Description& d, WorldModel& m) {
  const auto find = [&](const std::string& name) {
    for (std::size_t i = 0; i < d.objects.size(); ++i)
      if (d.objects[i].name == name) return static_cast<std::uint16_t>(i);
    return std::uint16_t{0};
  };
  for (std::size_t n = 0; n < d.connections.size(); ++n) {
    const Connection& k = d.connections[n];
    ConnectionState s;
    s.end0.object = find(k.object0);
    s.end0.knots = {k.knot0, k.knot0, k.knot0, k.knot0};
    s.end0.weights = {1, 0, 0, 0};
    s.end1.object = find(k.object1);
    s.end1.knots = {k.triangle1[0], k.triangle1[1], k.triangle1[2], k.triangle1[0]};
    s.end1.weights = {k.weights1[0], k.weights1[1], k.weights1[2], 0};
    // What the scene says of the world's axes the face carries with it from now on.
    ConnectionConstants constants;
    if (!carryOffset(m.start, s, k.offset, constants)) {
      std::ostringstream out;
      out << "connections[" << n << "] ('" << k.object0 << "' to '" << k.object1
          << "'): triangle1: its corners lie on one line (allowed: an area, which carries the offset)";
      throw std::invalid_argument(out.str());
    }
    constants.stiffness = k.stiffness, constants.damping = k.damping, constants.break_force = k.break_force;
    m.connections.push_back(constants);
    m.start.connections.push_back(s);
  }
  const double limit = std::max(1.0, solver::kSubStepsPerSecond * d.dt);
  const std::vector<solver::Rates> rates = connectionRates(d, m.start);
  const auto neededBy = [&](std::size_t n) { return d.dt / (kTiedMargin * solver::longestStep(rates[n])); };
  // Of those that share knots the hardest is named.
  std::size_t worst = d.connections.size();
  double hardest = -1.0;
  for (std::size_t n = 0; n < d.connections.size(); ++n) {
    const double own =
        (d.connections[n].stiffness * d.dt + d.connections[n].damping) * m.connections[n].inverse_mass;
    if (!(neededBy(n) <= limit) && !(own <= hardest)) worst = n, hardest = own;
  }
  for (std::size_t n = 0; n < d.connections.size(); ++n) {
    const double needed = neededBy(n);
    if (n == worst) {
      const Connection& k = d.connections[n];
      std::ostringstream out;
      out << "connections[" << n << "] ('" << k.object0 << "' to '" << k.object1 << "'): stiffness "
          << k.stiffness << " N/m, damping " << k.damping << " N·s/m: with those on the same knots need "
          << needed << " exchanges in " << d.dt << " s (at most " << limit
          << ": lower them or raise the knots' masses)";
      throw std::invalid_argument(out.str());
    }
    const ConnectionState& s = m.start.connections[n];
    m.objects[s.end0.object].tied.push_back(static_cast<std::uint32_t>(2 * n));
    m.objects[s.end1.object].tied.push_back(static_cast<std::uint32_t>(2 * n + 1));
    for (const auto object : {s.end0.object, s.end1.object})
      m.objects[object].exchanges_needed = std::max(m.objects[object].exchanges_needed, needed);
  }
}

}  // namespace

std::unique_ptr<WorldModel> buildModel(const Description& description, const WorldModel* before) {
  validate(description);
  auto model = std::make_unique<WorldModel>();
  model->description = description;
  WorldModel& m = *model;
  m.start.gravity = description.gravity;
  m.objects.resize(description.objects.size());
  m.start.objects.resize(description.objects.size());
  std::vector<std::shared_ptr<fem::TissueModel>> tissues(description.objects.size());
  ImplicitRoom room;
  for (std::size_t i = 0; i < description.objects.size(); ++i) {
    const Object& o = description.objects[i];
    ObjectState& s = m.start.objects[i];
    ObjectConstants& c = m.objects[i];
    c.identity = identityOf(o);
    const ObjectConstants* const same = builtBefore(before, description, o, c.identity);
    fillState(o, s);
    fillConstants(o, s, same, c);
    if (!c.deforms) continue;
    m.bodies.push_back(i);
    fillHeat(o, s, c);
    buildCut(o, s, c.cut);
    if (o.fem) {
      tissues[i] = boundFem(description, o, same, s, c);
      continue;
    }
    if (same != nullptr)
      static_cast<StepBounds&>(c) = same->alone;
    else
      boundSteps(s, c, description.dt);
    c.alone = c;
    if (c.implicit) room.take(o, s);
    c.body = c.implicit ? static_cast<const Body*>(&kImplicitNetBody) : &kNetBody;
  }
  for (const Suture& suture : description.sutures) m.sutures.push_back(identityOf(suture));
  connect(description, m);
  const bool several = m.bodies.size() > 1 || !description.sutures.empty();
  // Organ against organ is exchanged three or four times a step; finite elements, whose steps are dear,
  // twice.
  const int base = several ? exchanges(m, description.dt) : 1;
  for (const std::size_t i : m.bodies) {
    ObjectConstants& c = m.objects[i];
    c.batches = doubled(several ? (c.fem ? 2 : base) : 1, c.exchanges_needed);
    c.sub_steps = multipleOf(c.batches, c.sub_steps);
    // A whole part of the exchanges.
    for (c.volume_batches = c.batches; c.volume_batches % 2 == 0 && c.volume_batches / 2 >= c.volume_needed;)
      c.volume_batches /= 2;
    if (c.volume_batches % 3 == 0 && c.volume_batches / 3 >= c.volume_needed) c.volume_batches /= 3;
    m.start.objects[i].sub_steps = c.sub_steps;
    m.start.objects[i].batches = c.batches;
    m.batches = std::max(m.batches, c.batches);
    if (!c.fem) {
      // Of the tissue the order of half its highest mode's. Finite elements tell the stiffness of both.
      const double own = 0.5 * std::max(c.rates.omega_squared - c.contact_omega_squared, 0.0);
      c.contact_series = own / (own + c.contact_omega_squared);
      continue;
    }
    const double h = description.dt / c.batches;
    factorise(description, description.objects[i], h, tissues[i], c);
    ObjectState& s = m.start.objects[i];
    if (!s.tissue.factored) {
      for (std::size_t k = 0; k < s.block.knots(); ++k)
        s.block.row(Block::kInverseMass)[k] =
            s.fixed[k] ? 0.0f : static_cast<float>(inverseMassOf(c.fem->softestAt(static_cast<Index>(k)), h));
    }
    copyTissue(s);
    fillFemSurface(*c.fem, s);
  }
  buildThreads(m);
  ignoreDesignedContacts(m);
  findFloating(m);
  m.start.pairs.reserve(m.mostPairs());
  m.start.sides.reserve(2048);
  return model;
}

WorldScratch::WorldScratch(const WorldModel& model) {
  objects.resize(model.objects.size());
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const Block& b = model.start.objects[i].block;
    ObjectScratch& s = objects[i];
    s.backup.resize(b.motionFloats() / 2);
    s.contacts.reserve(512);
    s.pulls.reserve((4 + interaction::kMaxSuspensions) * interaction::kMaxGraspAnchors);
    s.planes.reserve(b.knotCapacity());
    s.clear.assign(b.knotCapacity() + 1, 0.0);
    s.packed.resize(b.knotCapacity() + 1);
    s.volume_gradient.resize(3 * (b.knotCapacity() + 1));
    s.volume_start.resize(3 * (b.knotCapacity() + 1));
    s.near.resize(b.knotCapacity() + 1);
    s.shared.resize(b.knotCapacity() + 1);
    s.bound = solver::BoundScratch(b.knotCapacity() + 64);
    model.objects[i].body->reserve(model.objects[i], model.start.objects[i], s);
    s.rings.reserve(model.objects[i].tube, model.description.objects[i].position.size());
    if (model.objects[i].motility.waves.active()) s.active.resize(3 * b.knotCapacity());
  }
  organ_contacts.reserve(model.mostPairs()), old_pairs.reserve(model.mostPairs());
  loop_candidates.reserve(4096);
  std::size_t most = 0;
  for (const auto& o : model.start.objects) most = std::max(most, 2 * o.triangles.size() + 64);
  candidates.reserve(most), near_balls.reserve(most);
  if (model.threads.rods) {
    threads = std::make_unique<ThreadScratch>(*model.threads.rods);
    threads->candidates.reserve(64 * model.threads.places.size());
    threads->searched.resize(model.threads.places.size()), threads->now.resize(model.threads.places.size());
    threads->led.reserve(interaction::kMaxChannels * (interaction::kMaxChannelAnchors + 1));
    threads->way.resize(objects.size());
    threads->apart.resize(model.threads.places.size());
    threads->reaches.reserve(model.threads.room()),
        threads->pushes.reserve(model.threads.room() + threads->led.capacity());
    threads->crowd.resize(objects.size());
    for (std::size_t i = 0; i < objects.size(); ++i)
      threads->crowd[i].assign(model.start.objects[i].block.knotCapacity() + 1, 0.0f);
  }
  reserveCut(model, cut);
  std::size_t knots = 1;
  for (const ObjectState& s : model.start.objects) knots += s.block.knotCapacity();
  part.resize(knots), part_size.resize(knots), part_first.resize(model.objects.size());
  connection_force.assign(model.start.connections.size(), ConnectionForce{});
}

}  // namespace vest::scene
