#include "vest_tissue/scene/topology.h"

#include <algorithm>

#include "connections.h"

namespace vest::scene {

namespace {
constexpr double kLeastShare = 0.25;  ///< of a knot's mass that a part gets (as in cut_net.cpp)
}

void beginDelta(const WorldState& state, std::uint16_t object, TopologyDelta& d) {
  d.object = object;
  d.from_revision = d.revision = state.revision;
  d.object_revision = state.objects[object].topology.revision;
  d.removed_links.clear(), d.added_links.clear(), d.doubled_knots.clear();
  d.removed_triangles.clear(), d.added_triangles.clear(), d.added_triangle_layer.clear();
  d.rebound_vertices.clear();
  for (Skin* s : {&d.added_skin, &d.rebound_skin}) {
    s->binding_start.clear(), s->binding_knots.clear(), s->binding_weights.clear();
    s->texture_coordinates.clear(), s->triangles.clear(), s->layer.clear();
  }
}

TopologyDelta beginDelta(const WorldState& state, std::uint16_t object) {
  TopologyDelta d;
  beginDelta(state, object, d);
  return d;
}

bool removeLink(WorldState& state, std::uint16_t object, std::uint32_t link, TopologyDelta& delta) {
  ObjectState& s = state.objects[object];
  if (link >= s.topology.links.size() || !s.topology.link_alive[link]) return false;
  const LinkPlace place = s.places[link];
  switch (place.kind) {
    case LinkKind::Elastic:
    case LinkKind::Viscous:
      setLink(s, place.index, 0.0f, s.links[place.index].values.rest, 0.0f);
      break;
    case LinkKind::Plastic:
      s.elements.plastic[place.index].kappa = s.elements.plastic[place.index].damping = 0.0f;
      break;
    case LinkKind::Bending:
      s.elements.bending[place.index].stiffness = 0.0f;
      break;
  }
  s.topology.link_alive[link] = 0;
  delta.removed_links.push_back(link);
  return true;
}

namespace {

/// An elastic link joins a and b. Where `copy` is given, it counts as the knot that it was split from.
bool linked(const ObjectState& s, std::uint32_t a, std::uint32_t b, std::uint32_t knot = 0,
            std::uint32_t copy = 0) {
  const auto as = [&](std::uint32_t k) { return copy != 0 && k == copy ? knot : k; };
  a = as(a), b = as(b);
  for (std::size_t i = 0; i < s.topology.links.size(); ++i) {
    const Link& l = s.topology.links[i];
    const std::uint32_t p = as(l.knot0), q = as(l.knot1);
    if (s.topology.link_alive[i] && l.kind == LinkKind::Elastic && ((p == a && q == b) || (p == b && q == a)))
      return true;
  }
  return false;
}

bool hangs(const ObjectState& s, const net::Hinge& h, std::uint32_t wing, std::uint32_t knot = 0,
           std::uint32_t copy = 0) {
  return linked(s, h.edge0, wing, knot, copy) || linked(s, h.edge1, wing, knot, copy);
}

}  // namespace

bool tearLink(WorldState& state, std::uint16_t object, std::uint32_t link, TopologyDelta& delta) {
  if (!removeLink(state, object, link, delta)) return false;
  ObjectState& s = state.objects[object];
  const Link& l = s.topology.links[link];
  if (l.kind != LinkKind::Elastic) return true;
  for (net::Hinge& h : s.elements.hinges) {
    if (h.stiffness == 0.0f) continue;
    const auto is = [&](std::uint32_t a, std::uint32_t b) {
      return (l.knot0 == a && l.knot1 == b) || (l.knot0 == b && l.knot1 == a);
    };
    const bool off = is(h.edge0, h.edge1) && !linked(s, h.edge0, h.edge1);
    const auto lost = [&](std::uint32_t wing) {
      return (is(h.edge0, wing) || is(h.edge1, wing)) && !hangs(s, h, wing);
    };
    if (off || lost(h.wing0) || lost(h.wing1)) h.stiffness = 0.0f;
  }
  return true;
}

bool doubleKnot(WorldState& state, std::uint16_t object, std::uint32_t knot, std::uint32_t& copy,
                TopologyDelta& delta, double share) {
  using net::Block;
  ObjectState& s = state.objects[object];
  Block& b = s.block;
  if (!s.tissue.x.empty()) return false;  // finite elements are cut along their faces
  if (knot >= b.knots() || !b.addKnot(copy)) return false;
  for (const auto r : {Block::X, Block::Y, Block::Z, Block::VX, Block::VY, Block::VZ, Block::kDecay})
    b.row(r)[copy] = b.row(r)[knot];
  // The lesser part is what the greater one leaves: their sum is the mass before, to the last bit.
  const float whole = b.row(Block::kMass)[knot], kept = static_cast<float>(1.0 - share);
  const float greater = whole * std::max(kept, 1.0f - kept), lesser = whole - greater;
  b.row(Block::kMass)[knot] = kept >= 0.5f ? greater : lesser;
  b.row(Block::kMass)[copy] = kept >= 0.5f ? lesser : greater;
  const bool held = b.row(Block::kInverseMass)[knot] == 0.0f;
  for (const std::uint32_t i : {knot, copy})
    b.row(Block::kInverseMass)[i] = held ? 0.0f : 1.0f / b.row(Block::kMass)[i];
  s.fixed.push_back(s.fixed[knot]);
  s.depth[copy] = s.depth[knot];
  s.load.divide(knot, copy, 1.0f - kept);
  interaction::copyColumn(s.heat, knot, copy);
  s.topology.doubled_knots.push_back(knot);
  if (!s.cut.inward.empty()) s.cut.inward[copy] = s.cut.inward[knot];
  // Parts of the tethers go with the parts of the mass: both keep their support.
  for (std::size_t i = 0, count = s.elements.tethers.size(); i < count; ++i) {
    net::Tether& t = s.elements.tethers[i];
    if (t.knot != knot) continue;
    net::Tether part = t;
    part.knot = copy;
    part.stiffness *= 1.0f - kept, part.damping *= 1.0f - kept;
    t.stiffness *= kept, t.damping *= kept;
    s.elements.tethers.push_back(part);
  }
  delta.doubled_knots.push_back(knot);
  return true;
}

bool addLinkLike(WorldState& state, std::uint16_t object, std::uint32_t link,
                 const std::array<std::uint32_t, 3>& knots, double share, TopologyDelta& delta) {
  ObjectState& s = state.objects[object];
  const LinkPlace place = s.places[link];
  Link added = s.topology.links[link];
  added.knot0 = knots[0], added.knot1 = knots[1], added.knot2 = knots[2];
  added.area *= share, added.stiffness *= share, added.damping *= share;
  const float part = static_cast<float>(share);
  LinkPlace at{place.kind, 0};
  if (place.kind == LinkKind::Elastic || place.kind == LinkKind::Viscous) {
    NetLink l = s.links[place.index];
    l.values.knot0 = knots[0], l.values.knot1 = knots[1];
    l.values.axial *= part, l.values.damping *= part;
    net::LinkTable& table = l.by_law ? s.law_links : s.linear_links;
    l.place = static_cast<std::uint32_t>(table.linkCount());
    if (!table.addLink(l.values)) return false;
    at.index = static_cast<std::uint32_t>(s.links.size());
    s.links.push_back(l);
  } else if (place.kind == LinkKind::Plastic) {
    net::Plastic p = s.elements.plastic[place.index];
    p.a = knots[0], p.b = knots[1];
    p.kappa *= part, p.damping *= part;
    at.index = static_cast<std::uint32_t>(s.elements.plastic.size());
    s.elements.plastic.push_back(p);
  } else {
    net::Bending p = s.elements.bending[place.index];
    p.a = knots[0], p.b = knots[1], p.c = knots[2];
    p.stiffness *= part;
    at.index = static_cast<std::uint32_t>(s.elements.bending.size());
    s.elements.bending.push_back(p);
  }
  s.topology.links.push_back(added);
  s.topology.link_alive.push_back(1);
  s.places.push_back(at);
  delta.added_links.push_back(added);
  return true;
}

bool moveLinkEnd(WorldState& state, std::uint16_t object, std::uint32_t link, std::uint32_t from,
                 std::uint32_t to, TopologyDelta& delta) {
  ObjectState& s = state.objects[object];
  if (link >= s.topology.links.size() || !s.topology.link_alive[link]) return false;
  const Link& l = s.topology.links[link];
  std::array<std::uint32_t, 3> knots{l.knot0, l.knot1, l.knot2};
  const std::size_t ends = l.kind == LinkKind::Bending ? 3 : 2;
  std::replace(knots.begin(), knots.begin() + ends, from, to);
  if (!addLinkLike(state, object, link, knots, 1.0, delta)) return false;
  return removeLink(state, object, link, delta);
}

namespace {

/// Skin vertices on the copy's side hang on the copy.
void rebindSkin(ObjectState& s, const net::KnotDoubling& cut, TopologyDelta& delta) {
  Skin& skin = s.topology.skin;
  for (std::size_t v = 0; v + 1 < skin.binding_start.size(); ++v) {
    const std::uint32_t first = skin.binding_start[v], last = skin.binding_start[v + 1];
    const auto begin = skin.binding_knots.begin() + first, end = skin.binding_knots.begin() + last;
    if (std::find(begin, end, cut.original) == end) continue;
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    for (std::uint32_t e = first; e < last; ++e) {
      at += static_cast<double>(skin.binding_weights[e]) * knotPosition(s, skin.binding_knots[e]);
    }
    if (!(cut.plane_normal.dot(at - cut.plane_point) > 0.0)) continue;
    std::replace(begin, end, cut.original, cut.copy);
    Skin& told = delta.rebound_skin;
    if (told.binding_start.empty()) told.binding_start.push_back(0);
    delta.rebound_vertices.push_back(static_cast<std::uint32_t>(v));
    told.binding_knots.insert(told.binding_knots.end(), begin, end);
    told.binding_weights.insert(told.binding_weights.end(), skin.binding_weights.begin() + first,
                                skin.binding_weights.begin() + last);
    told.binding_start.push_back(static_cast<std::uint32_t>(told.binding_knots.size()));
  }
}

}  // namespace

void remapFasteners(WorldState& state, std::uint16_t object, const net::KnotDoubling& cut) {
  const ObjectState& s = state.objects[object];
  for (interaction::Sling& sling : state.fasteners.slings) {
    if (!sling.alive || !sling.around || sling.object != object) continue;
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (int i = 0; i < sling.count; ++i) middle += knotPosition(s, sling.knots[i]) / sling.count;
    interaction::remapSling(sling, cut, middle);
  }
  interaction::remapClips(state.fasteners.clips, object, cut);
  for (auto& s : state.suspensions.all) interaction::remapSuspension(s, object, cut);
}

void followTriangle(WorldState& state, std::uint16_t object, const std::array<std::uint32_t, 3>& before,
                    const std::array<std::uint32_t, 3>& now) {
  if (before == now) return;
  for (interaction::Sling& sling : state.fasteners.slings)
    for (interaction::SlingTouch& t : sling.touch)
      if (sling.alive && sling.count == 0 && t.object == object && t.knots == before) t.knots = now;
}

void remapAnchors(WorldState& state, std::uint16_t object, const net::KnotDoubling& cut) {
  remapFasteners(state, object, cut);
  for (ConnectionState& c : state.connections)
    for (net::Anchor* a : {&c.end0, &c.end1})
      if (a->object == object) net::remap(*a, cut, footOf(state, *a));
  for (std::size_t t = 0; t < state.grasps.size(); ++t) {
    const auto& pose = state.proxies[t].pose;
    auto& grasp = state.grasps[t];
    for (int i = 0; i < grasp.count; ++i) {
      auto& a = grasp.anchors[i];
      if (a.object != object || a.knot != cut.original) continue;
      // The knot lies in the plane: where the jaws hold it tells the side.
      net::Anchor anchor{a.object, {a.knot, 0, 0, 0}, {1, 0, 0, 0}};
      if (net::remap(anchor, cut, pose.tip + pose.orientation * a.local)) a.knot = anchor.knots[0];
    }
  }
}

bool splitKnot(WorldState& state, std::uint16_t object, std::uint32_t knot, const Eigen::Vector3d& normal,
               std::uint32_t& copy, TopologyDelta& delta) {
  ObjectState& s = state.objects[object];
  if (!(normal.squaredNorm() > 0.0) || !normal.allFinite() || knot >= s.block.knots()) return false;
  const Eigen::Vector3d place = knotPosition(s, knot);
  const auto beyond = [&](auto first, auto last) {  // the others of an element lie beyond the plane
    double sum = 0.0;
    for (; first != last; ++first)
      if (*first != knot) sum += normal.dot(knotPosition(s, *first) - place);
    return sum > 0.0;
  };
  // The mass goes with the tissue. Where there is none on one side, nothing is divided.
  std::array<int, 2> parts{};
  for (std::size_t i = 0; i < s.topology.links.size(); ++i) {
    const Link& l = s.topology.links[i];
    const std::array<std::uint32_t, 2> ends{l.knot0, l.knot1};
    if (s.topology.link_alive[i] && (l.knot0 == knot || l.knot1 == knot))
      ++parts[beyond(ends.begin(), ends.end()) ? 1 : 0];
  }
  for (const auto& t : s.triangles)
    if (std::find(t.begin(), t.end(), knot) != t.end()) ++parts[beyond(t.begin(), t.end()) ? 1 : 0];
  if (parts[0] == 0 || parts[1] == 0) return false;
  const double share =
      std::clamp(static_cast<double>(parts[1]) / (parts[0] + parts[1]), kLeastShare, 1.0 - kLeastShare);
  if (!doubleKnot(state, object, knot, copy, delta, share)) return false;
  const net::KnotDoubling cut{knot, copy, normal, place};
  // A hinge goes with its triangles and with the link along its edge; where these part, it dies.
  for (net::Hinge& h : s.elements.hinges) {
    const bool at0 = h.edge0 == knot, at1 = h.edge1 == knot;
    std::uint32_t* const wing = h.wing0 == knot ? &h.wing0 : h.wing1 == knot ? &h.wing1 : nullptr;
    if (h.stiffness == 0.0f || (!at0 && !at1 && wing == nullptr)) continue;
    const auto side = [&](std::uint32_t w) {
      const std::array<std::uint32_t, 3> t{h.edge0, h.edge1, w};
      return beyond(t.begin(), t.end());
    };
    if (wing != nullptr) {
      if (side(*wing)) *wing = copy;
      continue;
    }
    const std::uint32_t other = at0 ? h.edge1 : h.edge0;
    const std::array<std::uint32_t, 2> edge{knot, other};
    const bool moves = side(h.wing0), had_link = linked(s, knot, other);
    if (moves != side(h.wing1) || (had_link && moves != beyond(edge.begin(), edge.end()))) {
      h.stiffness = 0.0f;
    } else if (moves) {
      (at0 ? h.edge0 : h.edge1) = copy;
    }
  }
  for (std::size_t i = 0, count = s.topology.links.size(); i < count; ++i) {
    const Link& l = s.topology.links[i];
    const std::array<std::uint32_t, 3> knots{l.knot0, l.knot1,
                                             l.kind == LinkKind::Bending ? l.knot2 : l.knot1};
    if (!s.topology.link_alive[i] || std::find(knots.begin(), knots.end(), knot) == knots.end()) continue;
    if (!beyond(knots.begin(), knots.end())) continue;
    // Where there is no room for the moved link, it tears.
    if (!moveLinkEnd(state, object, static_cast<std::uint32_t>(i), knot, copy, delta)) {
      removeLink(state, object, static_cast<std::uint32_t>(i), delta);
    }
  }
  for (net::Hinge& h : s.elements.hinges) {  // a wing that went one way, and its links the other
    const std::array<std::uint32_t, 4> of{h.edge0, h.edge1, h.wing0, h.wing1};
    const bool at = std::any_of(of.begin(), of.end(), [&](auto k) { return k == knot || k == copy; });
    if (h.stiffness == 0.0f || !at) continue;
    for (const std::uint32_t wing : {h.wing0, h.wing1})
      if (hangs(s, h, wing, knot, copy) && !hangs(s, h, wing)) h.stiffness = 0.0f;
  }
  for (auto& t : s.triangles) {
    const auto before = t;
    if (std::find(t.begin(), t.end(), knot) != t.end() && beyond(t.begin(), t.end()))
      std::replace(t.begin(), t.end(), knot, copy);
    followTriangle(state, object, before, t);
  }
  rebindSkin(s, cut, delta);
  remapAnchors(state, object, cut);
  return true;
}

void endDelta(WorldState& state, TopologyDelta& delta) {
  delta.revision = ++state.revision;
  delta.object_revision = ++state.objects[delta.object].topology.revision;
}

std::uint32_t originalKnot(const Topology& topology, std::size_t scene_knots, std::uint32_t knot) {
  while (knot >= scene_knots && knot - scene_knots < topology.doubled_knots.size()) {
    knot = topology.doubled_knots[knot - scene_knots];
  }
  return knot;
}

namespace {

/// Replaces the binding of some vertices, whose number of entries may change.
void rebind(Skin& skin, const std::vector<std::uint32_t>& vertices, const Skin& binding) {
  Skin now;
  now.binding_start.push_back(0);
  std::vector<std::size_t> from(skin.binding_start.size(), vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) from[vertices[i]] = i;
  for (std::size_t v = 0; v + 1 < skin.binding_start.size(); ++v) {
    const bool kept = from[v] == vertices.size();
    const Skin& source = kept ? skin : binding;
    const std::size_t at = kept ? v : from[v];
    for (std::uint32_t e = source.binding_start[at]; e < source.binding_start[at + 1]; ++e) {
      now.binding_knots.push_back(source.binding_knots[e]);
      now.binding_weights.push_back(source.binding_weights[e]);
    }
    now.binding_start.push_back(static_cast<std::uint32_t>(now.binding_knots.size()));
  }
  skin.binding_start = std::move(now.binding_start);
  skin.binding_knots = std::move(now.binding_knots);
  skin.binding_weights = std::move(now.binding_weights);
}

/// Vertices of a binding, or -1 where its lists do not fit each other.
std::ptrdiff_t vertexCount(const Skin& s) {
  if (s.binding_start.empty()) return s.binding_knots.empty() ? 0 : -1;
  const bool fits = s.binding_start.front() == 0 && s.binding_start.back() == s.binding_knots.size() &&
                    s.binding_knots.size() == s.binding_weights.size() &&
                    std::is_sorted(s.binding_start.begin(), s.binding_start.end());
  return fits ? static_cast<std::ptrdiff_t>(s.binding_start.size()) - 1 : -1;
}

}  // namespace

bool applyDelta(Topology& t, const TopologyDelta& d) {
  const bool nothing = d.object_revision == t.revision;  // something outside these lists changed
  if (!nothing && d.object_revision != t.revision + 1) return false;
  const std::ptrdiff_t vertices = vertexCount(t.skin), added = vertexCount(d.added_skin),
                       rebound = vertexCount(d.rebound_skin);
  if (vertices < 0 || added < 0 || rebound != static_cast<std::ptrdiff_t>(d.rebound_vertices.size()) ||
      d.added_triangles.size() != d.added_triangle_layer.size()) {
    return false;
  }
  const auto below = [](const auto& list, std::size_t limit) {
    return std::all_of(list.begin(), list.end(), [limit](auto i) { return i < limit; });
  };
  if (!below(d.removed_links, t.links.size() + d.added_links.size()) ||
      !below(d.removed_triangles, t.skin.triangles.size()) ||
      !below(d.rebound_vertices, static_cast<std::size_t>(vertices))) {
    return false;
  }
  for (const auto& f : d.added_triangles)
    if (!below(f, static_cast<std::size_t>(vertices + added))) return false;
  t.doubled_knots.insert(t.doubled_knots.end(), d.doubled_knots.begin(), d.doubled_knots.end());
  t.links.insert(t.links.end(), d.added_links.begin(), d.added_links.end());
  t.link_alive.resize(t.links.size(), 1);
  for (const auto i : d.removed_links) t.link_alive[i] = 0;
  for (const auto i : d.removed_triangles) t.triangle_alive[i] = 0;
  if (!d.rebound_vertices.empty()) rebind(t.skin, d.rebound_vertices, d.rebound_skin);
  if (added > 0) {
    const auto base = static_cast<std::uint32_t>(t.skin.binding_knots.size());
    if (t.skin.binding_start.empty()) t.skin.binding_start.push_back(0);
    for (std::size_t v = 1; v < d.added_skin.binding_start.size(); ++v) {
      t.skin.binding_start.push_back(base + d.added_skin.binding_start[v]);
    }
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    append(t.skin.binding_knots, d.added_skin.binding_knots);
    append(t.skin.binding_weights, d.added_skin.binding_weights);
    append(t.skin.texture_coordinates, d.added_skin.texture_coordinates);
  }
  t.skin.triangles.insert(t.skin.triangles.end(), d.added_triangles.begin(), d.added_triangles.end());
  t.skin.layer.insert(t.skin.layer.end(), d.added_triangle_layer.begin(), d.added_triangle_layer.end());
  t.triangle_alive.resize(t.skin.triangles.size(), 1);
  t.revision = d.object_revision;
  return true;
}

}  // namespace vest::scene
