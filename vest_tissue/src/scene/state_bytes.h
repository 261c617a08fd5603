#pragma once

#include <array>
#include <cstring>
#include <type_traits>

#include "vest_tissue/scene/world_state.h"

namespace vest::scene {

/// Walks the State in one order for hash, snapshot and restore. An archive has bytes(void*, size):
/// little-endian numbers without padding, as x86-64 and ARM64 hold them; numbers(T*, count), which looks at
/// what was read; and resize(vector, size): its length goes in and out.
template <typename T>
struct NumbersOf {  ///< what a vector's entries consist of
  using Type = T;
};
template <typename T, std::size_t n>
struct NumbersOf<std::array<T, n>> {
  using Type = T;
};
template <>
struct NumbersOf<Eigen::Vector3d> {
  using Type = double;
};

template <typename Archive>
struct StateWalker {
  Archive& archive;

  template <typename T>
  void value(T& v) {
    static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
    values(&v, 1);
  }
  template <typename T>
  void values(T* v, std::size_t count) {
    archive.bytes(v, count * sizeof(T));
    using Number = typename NumbersOf<T>::Type;
    if constexpr (std::is_floating_point_v<Number>)
      archive.numbers(reinterpret_cast<const Number*>(v), count * (sizeof(T) / sizeof(Number)));
  }
  /// NaN says that there is none.
  void optional(double& v) { archive.bytes(&v, sizeof v); }
  void flag(bool& v) {
    std::uint8_t byte = v;
    value(byte);
    v = byte != 0;
  }
  template <typename T>
  void plain(std::vector<T>& v) {  // of numbers or arrays of numbers
    archive.resize(v, v.size());
    values(v.data(), v.size());
  }
  template <typename T, typename Each>
  void list(std::vector<T>& v, Each each) {
    archive.resize(v, v.size());
    for (T& item : v) each(item);
  }
  void vector3(Eigen::Vector3d& v) { values(v.data(), 3); }

  void anchor(net::Anchor& a) {
    value(a.object), values(a.knots.data(), 4), values(a.weights.data(), 4), value(a.height);
  }
  void link(Link& l) {
    value(l.kind), value(l.knot0), value(l.knot1), value(l.knot2);
    value(l.rest), value(l.area), value(l.stiffness), value(l.damping);
  }
  void skin(Skin& s) {
    plain(s.binding_start), plain(s.binding_knots), plain(s.binding_weights);
    plain(s.texture_coordinates), plain(s.triangles), plain(s.layer);
  }

  void surface(FemSurface& f) {
    plain(f.triangle_face), plain(f.skin_face), plain(f.knot_vertex), plain(f.vertex_element), value(f.parts);
  }
  void tissue(fem::TissueState& t) {
    plain(t.x), plain(t.v), value(t.stiffness_scale), flag(t.dynamic), plain(t.denatured), value(t.revision);
    if (t.revision == 0) return;  // as the scene says
    plain(t.mass), plain(t.corner), plain(t.open), plain(t.origin), plain(t.knot_element);
  }

  void object(ObjectState& s) {
    using net::Block;
    Block& b = s.block;
    std::uint64_t knots = b.knots(), links = s.links.size();
    value(knots), value(links);
    archive.setCounts(s, knots, links);
    for (const auto r : {Block::X, Block::Y, Block::Z, Block::VX, Block::VY, Block::VZ, Block::kInverseMass,
                         Block::kDecay, Block::kMass}) {
      values(b.row(r), knots);
    }
    for (NetLink& l : s.links) {
      value(l.values.knot0), value(l.values.knot1), value(l.values.rest), value(l.values.axial),
          value(l.values.damping);
      flag(l.by_law), value(l.place), value(l.shrink), value(l.stiffen), value(l.conductance);
    }
    archive.repack(s);
    value(s.sub_steps), value(s.batches), value(s.limit_strain), value(s.bound_strain),
        value(s.elastic_scale), value(s.damping_scale), flag(s.degraded), flag(s.dropped);
    if (!s.load.now.empty()) flag(s.load.any);
    if (s.load.any) {
      value(s.load.left), values(s.load.own.data(), knots);
      for (auto* load : {&s.load.now, &s.load.told})
        for (std::size_t k = 0; k < knots; ++k) values((*load)[k].data(), (*load)[k].size());
    }
    heat(s.heat, knots);
    list(s.cut.crossings, [&](interaction::CutCrossing& x) {
      value(x.triangle), value(x.edge), value(x.place), value(x.knot);
    });
    list(s.cut.tracks, [&](interaction::CutTrack& x) {
      value(x.triangle), values(x.knots.data(), 2), values(x.from.data(), 3), values(x.to.data(), 3),
          value(x.settled);
    });
    flag(s.cut.exhausted);
    if (!s.tissue.x.empty()) tissue(s.tissue);
    values(s.motility.phase.data(), 2);
    value(s.topology.revision);
    if (s.topology.revision == 0 && s.cut.tracks.empty() && !s.dropped) return;  // as the scene says
    cut(s.cut);
    if (!s.tissue.x.empty()) surface(s.fem_surface);
    list(s.topology.links, [&](Link& l) { link(l); });
    list(s.places, [&](LinkPlace& p) { value(p.kind), value(p.index); });
    plain(s.topology.doubled_knots), plain(s.topology.link_alive), plain(s.topology.triangle_alive),
        skin(s.topology.skin);
    plain(s.triangles), plain(s.triangle_alive), plain(s.fixed), plain(s.depth);
    list(s.elements.bending,
         [&](net::Bending& e) { value(e.a), value(e.b), value(e.c), value(e.stiffness), value(e.rest); });
    list(s.elements.hinges, [&](net::Hinge& e) {
      value(e.edge0), value(e.edge1), value(e.wing0), value(e.wing1), value(e.stiffness), value(e.rest),
          value(e.least);
    });
    list(s.elements.plastic,
         [&](net::Plastic& e) { value(e.a), value(e.b), value(e.kappa), value(e.rest), value(e.damping); });
    list(s.elements.tethers,
         [&](net::Tether& e) { value(e.knot), values(e.place, 3), value(e.stiffness), value(e.damping); });
    list(s.elements.volumes,
         [&](net::Volume& e) { plain(e.triangles), plain(e.knots), value(e.bulk_modulus), value(e.rest); });
  }

  void heat(interaction::HeatState& h, std::size_t knots) {
    flag(h.touched);
    if (!h.touched) return;
    archive.room(h.columns.size(), knots);
    flag(h.warm), flag(h.stiffened), flag(h.denaturing);
    for (std::size_t k = 0; k < knots; ++k) {
      interaction::HeatColumn& c = h.columns[k];
      values(c.excess.data(), c.excess.size()), values(c.arrhenius.data(), c.arrhenius.size());
      values(c.dried.data(), c.dried.size());
      value(c.charred), value(c.crushed), value(c.denatured), value(c.surface);
    }
    values(h.sealed.data(), h.sealed.size());
    value(h.ledger.delivered), value(h.ledger.perfused), value(h.ledger.surface), value(h.ledger.latent);
  }
  void electrosurgery(interaction::Electrosurgery& e) {
    value(e.monopolar_power), value(e.bipolar_power);
    for (auto& p : e.electrodes) {
      flag(p.on), value(p.object), value(p.element), values(p.weights.data(), 3);
      value(p.energy), value(p.since);
    }
  }

  void matrix(Eigen::Matrix3d& m) { values(m.data(), 9); }
  void clip(interaction::Clip& c) {
    value(c.id), flag(c.alive), flag(c.shut), value(c.instrument), value(c.object), value(c.count),
        value(c.ring);
    archive.within(c.count, interaction::kMaxClipKnots), archive.within(c.ring, interaction::kMaxClipKnots);
    values(c.knots.data(), static_cast<std::size_t>(c.count));
    for (int i = 0; i < c.count; ++i) vector3(c.open[i]), vector3(c.closed[i]);
    value(c.progress), value(c.jaw), optional(c.station), optional(c.area), value(c.force);
    matrix(c.rotation), vector3(c.centre), vector3(c.offset);
  }
  void sling(interaction::Sling& s) {
    value(s.id), flag(s.alive), flag(s.around), flag(s.tied), flag(s.drawing), value(s.instrument),
        value(s.object);
    value(s.count), archive.within(s.count, interaction::kMaxSlingKnots);
    values(s.knots.data(), static_cast<std::size_t>(s.count));
    value(s.ring), value(s.rest), value(s.tension), optional(s.station), optional(s.area);
    for (int i = 0; i < interaction::kSlingNodes; ++i) {
      interaction::SlingTouch& t = s.touch[i];
      vector3(s.node[i]), vector3(s.velocity[i]);
      flag(t.on), value(t.side), value(t.object), values(t.knots.data(), 3), values(t.weights.data(), 3);
      vector3(t.offset);
    }
    vector3(s.tip), vector3(s.ahead), vector3(s.across);
  }
  void fasteners(interaction::Fasteners& f) {
    list(f.clips, [&](interaction::Clip& c) { clip(c); });
    list(f.slings, [&](interaction::Sling& s) { sling(s); });
    for (auto& a : f.appliers) value(a.jaw_at_touch), flag(a.loaded), flag(a.drawn);
  }

  void cut(interaction::CutState& s) {
    plain(s.line), plain(s.inward), plain(s.home), plain(s.open), plain(s.lies_on), plain(s.rest),
        plain(s.free);
    plain(s.outer), plain(s.inner), plain(s.wall);
    list(s.faces,
         [&](interaction::CutFace& f) { value(f.skin_triangle), value(f.edge), values(f.built.data(), 2); });
    value(s.parts), value(s.area), value(s.energy), flag(s.opened), flag(s.unfinished);
  }
  void cutting(interaction::CuttingTool& t) {
    value(t.owed), value(t.force), value(t.torque), vector3(t.place), value(t.object), value(t.element);
  }
  void tool(interaction::Proxy& p) {
    flag(p.present), value(p.tool), vector3(p.pose.tip), values(p.pose.orientation.coeffs().data(), 4),
        vector3(p.pose.pivot);
    value(p.pose.jaw), vector3(p.velocity), vector3(p.commanded), vector3(p.force), vector3(p.torque),
        vector3(p.tip_force), value(p.jaw_torque), value(p.jaw_stiffness);
  }
  void grasp(interaction::Grasp& g) {
    flag(g.active), flag(g.sliding), value(g.jaw_at_touch), value(g.pinch), value(g.count), value(g.id);
    value(g.element), values(g.barycentric.data(), 4);
    for (auto& a : g.anchors)
      value(a.object), value(a.knot), vector3(a.local), value(a.stiffness), value(a.damping);
  }

  void world(WorldState& s) {
    value(s.step), value(s.time), vector3(s.gravity), value(s.revision), value(s.next_attachment);
    archive.same(s.objects.size());
    for (ObjectState& o : s.objects) object(o);
    archive.same(s.connections.size());
    for (ConnectionState& c : s.connections) anchor(c.end0), anchor(c.end1), flag(c.alive), vector3(c.force);
    for (auto& p : s.proxies) tool(p);
    for (auto& g : s.grasps) grasp(g);
    electrosurgery(s.electrosurgery);
    fasteners(s.fasteners);
    for (auto& t : s.cutting.tools) cutting(t);
    values(s.jaws_pass.data(), s.objects.size()), values(s.blades_pass.data(), s.objects.size());
    list(s.pairs, [&](OrganPair& p) {
      value(p.object), value(p.other), value(p.knot), value(p.triangle), value(p.clear);
    });
    value(s.way), value(s.way_revision), value(s.supported_revision);
    for (ObjectState& o : s.objects) value(o.way), value(o.way_bounded), value(o.way_searched);
    list(s.sides, [&](ContactSide& p) {
      value(p.triangle), value(p.object), value(p.tool), value(p.capsule), value(p.side);
    });
    value(s.energy.work), value(s.energy.dissipated);
  }
};

}  // namespace vest::scene
