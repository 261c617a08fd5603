#include "vest_tissue/scene/topology.h"

namespace vest::scene {

TopologyDelta beginDelta(const WorldState& state, std::uint16_t object) {
  TopologyDelta d;
  d.object = object;
  d.from_revision = state.revision;
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

bool doubleKnot(WorldState& state, std::uint16_t object, std::uint32_t knot, std::uint32_t& copy, TopologyDelta& delta) {
  using net::Block;
  ObjectState& s = state.objects[object];
  Block& b = s.block;
  if (knot >= b.knots() || !b.addKnot(copy)) return false;
  for (const auto r : {Block::X, Block::Y, Block::Z, Block::VX, Block::VY, Block::VZ, Block::kDecay}) b.row(r)[copy] = b.row(r)[knot];
  b.row(Block::kMass)[knot] *= 0.5f;
  b.row(Block::kMass)[copy] = b.row(Block::kMass)[knot];
  b.row(Block::kInverseMass)[knot] *= 2.0f;  // 0 stays 0: fixed
  b.row(Block::kInverseMass)[copy] = b.row(Block::kInverseMass)[knot];
  s.fixed.push_back(s.fixed[knot]);
  s.depth[copy] = s.depth[knot];
  delta.doubled_knots.push_back(knot);
  return true;
}

bool moveLinkEnd(WorldState& state, std::uint16_t object, std::uint32_t link, std::uint32_t from, std::uint32_t to,
                 TopologyDelta& delta) {
  ObjectState& s = state.objects[object];
  if (link >= s.topology.links.size() || !s.topology.link_alive[link]) return false;
  const LinkPlace place = s.places[link];
  Link moved = s.topology.links[link];
  const auto swap = [&](auto& k) { if (k == from) k = static_cast<std::decay_t<decltype(k)>>(to); };
  swap(moved.knot0), swap(moved.knot1);
  LinkPlace added{place.kind, 0};
  if (place.kind == LinkKind::Elastic || place.kind == LinkKind::Viscous) {
    NetLink l = s.links[place.index];
    swap(l.values.knot0), swap(l.values.knot1);
    net::LinkTable& table = l.by_law ? s.law_links : s.linear_links;
    l.place = static_cast<std::uint32_t>(table.linkCount());
    if (!table.addLink(l.values)) return false;
    added.index = static_cast<std::uint32_t>(s.links.size());
    s.links.push_back(l);
  } else if (place.kind == LinkKind::Plastic) {
    net::Plastic p = s.elements.plastic[place.index];
    swap(p.a), swap(p.b);
    added.index = static_cast<std::uint32_t>(s.elements.plastic.size());
    s.elements.plastic.push_back(p);
  } else {
    swap(moved.knot2);
    net::Bending p = s.elements.bending[place.index];
    swap(p.a), swap(p.b), swap(p.c);
    added.index = static_cast<std::uint32_t>(s.elements.bending.size());
    s.elements.bending.push_back(p);
  }
  removeLink(state, object, link, delta);
  s.topology.links.push_back(moved);
  s.topology.link_alive.push_back(1);
  s.places.push_back(added);
  delta.added_links.push_back(moved);
  return true;
}

void endDelta(WorldState& state, TopologyDelta& delta) {
  delta.revision = ++state.revision;
  delta.object_revision = ++state.objects[delta.object].topology.revision;
}

}  // namespace vest::scene
