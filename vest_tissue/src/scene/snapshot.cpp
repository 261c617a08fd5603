#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "state_bytes.h"
#include "world_impl.h"

namespace vest::scene {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("snapshot: " + what);
}

struct WriteArchive {
  std::vector<std::uint8_t>& out;
  void bytes(const void* data, std::size_t size) {
    const auto* const p = static_cast<const std::uint8_t*>(data);
    out.insert(out.end(), p, p + size);
  }
  template <typename T>
  void resize(std::vector<T>&, std::size_t size) {
    same(size);
  }
  void same(std::uint64_t size) { bytes(&size, sizeof size); }
  void within(std::int32_t, std::int32_t) {}
  void setCounts(ObjectState&, std::uint64_t, std::uint64_t) {}
  void repack(ObjectState&) {}
};

struct ReadArchive {
  const std::vector<std::uint8_t>& in;
  std::size_t at = 0;
  void bytes(void* data, std::size_t size) {
    if (size > in.size() - at)
      refuse("ends after " + std::to_string(in.size()) + " bytes (more are needed: cut off?)");
    if (size > 0) std::memcpy(data, in.data() + at, size);
    at += size;
  }
  template <typename T>
  void resize(std::vector<T>& v, std::size_t) {
    std::uint64_t size;
    bytes(&size, sizeof size);
    if (size > in.size() - at)
      refuse("a list of " + std::to_string(size) + " entries does not fit in the rest of the file");
    v.resize(size);
  }
  void same(std::uint64_t wanted) {
    std::uint64_t size;
    bytes(&size, sizeof size);
    if (size != wanted)
      refuse(std::to_string(size) + " objects or connections (the scene has " + std::to_string(wanted) + ")");
  }
  void within(std::int32_t count, std::int32_t most) {
    if (count < 0 || count > most) refuse(std::to_string(count) + " knots in a clip or sling");
  }
  void setCounts(ObjectState& s, std::uint64_t knots, std::uint64_t links) {
    net::Block& b = s.block;
    scene_links = s.links.size();
    if (knots > b.knotCapacity() || knots < b.knots() || links < s.links.size() ||
        links > 2 * s.links.size() + 64) {
      refuse(std::to_string(knots) + " knots and " + std::to_string(links) +
             " links of an object (the scene has " + std::to_string(b.knots()) + " and " +
             std::to_string(s.links.size()) + ")");
    }
    std::uint32_t index;
    while (b.knots() < knots) b.addKnot(index);
    s.links.resize(links);
  }
  /// Same places in the tables as in the world that wrote it: the order of sums is part of the result.
  void repack(ObjectState& s) {
    for (std::size_t i = 0; i < s.links.size(); ++i) {
      const NetLink& l = s.links[i];
      if (l.values.knot0 >= s.block.knots() || l.values.knot1 >= s.block.knots() || !(l.values.rest > 0.0f) ||
          !(l.conductance >= 0.0f && l.conductance < 1e9f)) {
        refuse("link " + std::to_string(i) + " of an object is damaged");
      }
      net::LinkTable& table = l.by_law ? s.law_links : s.linear_links;
      if (i >= scene_links && (l.place != table.linkCount() || !table.addLink(l.values))) {
        refuse("link " + std::to_string(i) + " of an object has no place");
      }
      if (l.place >= table.linkCount()) refuse("link " + std::to_string(i) + " of an object has no place");
      table.setLink(l.place, l.values.rest, l.values.axial, l.values.damping);
    }
  }
  std::size_t scene_links = 0;
};

template <typename Knot>
void checkCut(const ObjectState& o, Knot knot) {
  const interaction::CutState& c = o.cut;
  const std::size_t triangles = o.triangles.size(), skin = o.topology.skin.triangles.size();
  const auto contact = [&](std::uint32_t t) {
    if (t >= triangles) refuse("contact triangle " + std::to_string(t) + " of a cut");
  };
  for (const auto& x : c.crossings) {
    contact(x.triangle);
    if (x.edge > 2 || x.knot > 3) refuse("edge of a cut");
  }
  for (const auto& x : c.tracks) contact(x.triangle), knot(x.knots[0]), knot(x.knots[1]);
  if (c.line.empty()) return;  // rigid: nothing to cut
  const std::size_t vertices = c.rest.size();
  const auto same = [&](std::size_t size) { return size == vertices; };
  if (c.line.size() != triangles || c.inward.size() != o.block.knotCapacity() ||
      (vertices > 0 && (c.home.size() != skin || c.open.size() != skin)) || !same(c.lies_on.size()) ||
      !same(c.free.size()) || !same(c.outer.size()) || !same(c.inner.size()) || !same(c.wall.size()) ||
      (vertices > 0 && vertices + 1 != o.topology.skin.binding_start.size())) {
    refuse("lists of a cut that do not fit each other");
  }
  for (const auto t : c.lies_on) contact(t);
  for (const auto t : c.home)
    if (t != interaction::kNone) contact(t);
  for (const auto* of : {&c.outer, &c.inner, &c.wall})
    for (const auto v : *of)
      if (v != interaction::kNone && v >= vertices) refuse("skin vertex of a cut");
  for (const auto& f : c.faces) {
    if (f.skin_triangle >= skin || f.edge > 3) refuse("face of a cut");
    for (const auto t : f.built)
      if (t != interaction::kNone && t >= skin) refuse("face of a cut");
  }
}

/// Indices that a damaged file could have wrong: every one is checked before the State is taken over.
void checkIndices(const WorldState& s) {
  for (const ObjectState& o : s.objects) {
    const auto knot = [&](std::uint64_t k) {
      if (k >= o.block.knots())
        refuse("knot " + std::to_string(k) + " of an object with " + std::to_string(o.block.knots()));
    };
    for (const auto& t : o.triangles)
      for (const auto k : t) knot(k);
    for (const auto* load : {&o.load.now, &o.load.told})
      for (const HeldLoad::Of& of : *load)
        for (std::size_t i = 0; i < of.size(); ++i) {
          constexpr HeldLoad::Of kMost{kGreatestLoad,        kGreatestLoad,          kGreatestLoad,
                                       kGreatestLoadDamping, kGreatestLoadStiffness, kGreatestLoadLevel};
          constexpr const char* kUnit[] = {"N", "N", "N", "N·s/m", "N/m", "m (level)"};
          if (!(of[i] >= (i == HeldLoad::kDamping ? 0.0f : -kMost[i]) && of[i] <= kMost[i]))
            refuse("a load of " + std::to_string(of[i]) + " " + kUnit[i] + " on a knot");
        }
    if (!(o.load.left >= 0.0 && o.load.left <= kLongestLoad))
      refuse("a load that comes within " + std::to_string(o.load.left) + " s");
    for (const auto& b : o.elements.bending) knot(b.a), knot(b.b), knot(b.c);
    for (const auto& h : o.elements.hinges) knot(h.edge0), knot(h.edge1), knot(h.wing0), knot(h.wing1);
    for (const auto& p : o.elements.plastic) knot(p.a), knot(p.b);
    for (const auto& t : o.elements.tethers) knot(t.knot);
    for (const auto& v : o.elements.volumes)
      for (const auto& t : v.triangles)
        for (const auto k : t) knot(k);
    const fem::TissueState& e = o.tissue;
    if (!e.x.empty()) {
      if (e.x.size() != o.block.knots() || e.v.size() != e.x.size() || e.mass.size() != e.x.size() ||
          e.origin.size() != e.x.size() || e.knot_element.size() != e.x.size() ||
          e.open.size() != e.corner.size() || (!e.denatured.empty() && e.denatured.size() != e.corner.size()))
        refuse("finite elements whose lists do not fit each other");
      for (const auto& c : e.corner)
        for (const auto k : c) knot(k);
      for (std::size_t k = 0; k < e.origin.size(); ++k) {
        if (e.origin[k] > k || e.knot_element[k] >= e.corner.size())
          refuse("finite elements that are damaged");
      }
    }
    const FemSurface& f = o.fem_surface;
    if (!e.x.empty() &&
        (f.triangle_face.size() != o.triangles.size() ||
         f.skin_face.size() != o.topology.skin.triangles.size() || f.knot_vertex.size() != o.block.knots() ||
         f.vertex_element.size() + 1 > std::max<std::size_t>(1, o.topology.skin.binding_start.size())))
      refuse("a surface of finite elements whose lists do not fit each other");
    for (const auto code : f.triangle_face)
      if (code / 4 >= e.corner.size()) refuse("a face that is not there");
    const Topology& t = o.topology;
    if (t.link_alive.size() != t.links.size() || o.places.size() != t.links.size() ||
        t.triangle_alive.size() != t.skin.triangles.size() || o.triangle_alive.size() != o.triangles.size() ||
        o.fixed.size() != o.block.knots() || o.depth.size() != o.block.knotCapacity()) {
      refuse("lists of an object that do not fit each other");
    }
    for (std::size_t i = 0; i < t.links.size(); ++i) {
      knot(t.links[i].knot0), knot(t.links[i].knot1), knot(t.links[i].knot2);
      const auto kind = o.places[i].kind;
      const std::size_t limit = kind == LinkKind::Plastic   ? o.elements.plastic.size()
                                : kind == LinkKind::Bending ? o.elements.bending.size()
                                                            : o.links.size();
      if (o.places[i].index >= limit) refuse("link " + std::to_string(i) + " of an object has no place");
    }
    checkCut(o, knot);
    for (const auto k : t.skin.binding_knots) knot(k);
    for (const auto k : t.doubled_knots) knot(k);
    const std::size_t batches = static_cast<std::size_t>(o.batches);
    if (o.sub_steps < 1 || o.sub_steps > 100000 || o.sub_steps % batches != 0)
      refuse("sub-steps of an object");
  }
  const auto anchored = [&](std::uint64_t object, std::uint64_t k) {
    if (object >= s.objects.size() || k >= s.objects[object].block.knots())
      refuse("an anchor outside the scene");
  };
  for (const auto& c : s.connections) {
    for (const auto k : c.end0.knots) anchored(c.end0.object, k);
    for (const auto k : c.end1.knots) anchored(c.end1.object, k);
  }
  for (const auto& g : s.grasps) {
    if (g.count < 0 || g.count > interaction::kMaxGraspAnchors) refuse("number of grasped knots");
    for (int i = 0; i < g.count; ++i) anchored(g.anchors[i].object, g.anchors[i].knot);
  }
  for (const auto& p : s.pairs) {
    anchored(p.object, p.knot), anchored(p.other, 0);
    if (p.triangle >= s.objects[p.other].triangles.size()) refuse("a contact outside the scene");
  }
  if (s.fasteners.clips.size() > interaction::kMaxClips ||
      s.fasteners.slings.size() > interaction::kMaxSlings)
    refuse("too many clips or slings");
  for (const auto& f : s.fasteners.clips)
    for (int i = 0; f.alive && i < f.count; ++i) anchored(f.object, f.knots[i]);
  for (const auto& f : s.fasteners.slings) {
    anchored(f.object, 0);
    for (int i = 0; f.alive && i < f.count; ++i) anchored(f.object, f.knots[i]);
    if (f.alive && (f.instrument < 0 || f.instrument >= tools::kInstrumentCount))
      refuse("the instrument of a sling");
    for (const auto& touch : f.touch)
      for (const auto k : touch.knots)
        if (f.alive && touch.on) anchored(touch.object, k);
  }
  for (const auto& e : s.electrosurgery.electrodes) {
    anchored(e.object, 0);
    const auto& triangles = s.objects[e.object].triangles;
    if (e.energy > 0.0 && e.element >= triangles.size()) refuse("an electrode outside the scene");
  }
  for (const auto& t : s.cutting.tools) {
    if (t.object >= s.objects.size() || (t.element != 0 && t.element >= s.objects[t.object].triangles.size()))
      refuse("cut of an instrument");
  }
  for (const auto& p : s.proxies) {
    if (static_cast<int>(p.tool) >= tools::kToolKindCount)
      refuse("kind of tool " + std::to_string(static_cast<int>(p.tool)));
  }
}

}  // namespace

void World::save(std::vector<std::uint8_t>& bytes) const {
  bytes.clear();
  WriteArchive archive{bytes};
  archive.bytes(kSnapshotMagic.data(), kSnapshotMagic.size());
  const std::string& hash = impl_->model->description.hash;
  archive.same(hash.size());
  archive.bytes(hash.data(), hash.size());
  StateWalker<WriteArchive>{archive}.world(const_cast<WorldState&>(impl_->state));
}

void World::restore(const std::vector<std::uint8_t>& bytes) {
  ReadArchive archive{bytes};
  char magic[8];
  archive.bytes(magic, sizeof magic);
  if (kSnapshotMagic != std::string_view(magic, sizeof magic))
    refuse("begins with other bytes than " + std::string(kSnapshotMagic));
  std::uint64_t size;
  archive.bytes(&size, sizeof size);
  if (size > 64) refuse("scene_hash of " + std::to_string(size) + " characters (at most 64)");
  std::string hash(size, '\0');
  archive.bytes(hash.data(), size);
  if (hash != impl_->model->description.hash) {
    refuse("scene_hash '" + hash + "' (the loaded scene's is '" + impl_->model->description.hash + "')");
  }
  WorldState state = impl_->model->start;
  StateWalker<ReadArchive>{archive}.world(state);
  for (ObjectState& o : state.objects) o.law_links.setMaxStrain(o.limit_strain);
  if (archive.at != bytes.size()) refuse(std::to_string(bytes.size() - archive.at) + " bytes too many");
  checkIndices(state);
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    const std::size_t is = state.objects[i].tissue.corner.size(),
                      wanted = impl_->model->start.objects[i].tissue.corner.size();
    if (is != wanted)
      refuse(std::to_string(is) + " elements of an object (the scene has " + std::to_string(wanted) + ")");
  }
  impl_->state = std::move(state);
  impl_->reserve();
  impl_->scratch.forget();
  impl_->deltas.clear();
}

}  // namespace vest::scene
