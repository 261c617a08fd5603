#include <algorithm>
#include <limits>

#include "cut_job.h"

namespace vest::scene {
namespace {

using interaction::kNone;

/// The surface that torn links held together goes: of each, the contact triangles that have both its knots.
/// These knots are marked. False: none, the links ran through the organ.
bool openTornSurface(CutJob& j) {
  std::fill_n(j.k.near_knot.begin(), j.s.block.knots(), std::uint8_t{0});
  bool any = false;
  for (const std::uint32_t link : j.delta.removed_links) {
    const Link& l = j.s.topology.links[link];
    for (std::size_t t = 0; t < j.s.triangles.size(); ++t) {
      const auto& k = j.s.triangles[t];
      if (std::count(k.begin(), k.end(), l.knot0) + std::count(k.begin(), k.end(), l.knot1) != 2) continue;
      j.s.triangle_alive[t] = 0;
      j.k.near_knot[l.knot0] = j.k.near_knot[l.knot1] = 1;
      any = true;
    }
  }
  return any;
}

/// The skin on it goes, too. Vertices that hung on both ends of a torn link hang on what is left on their
/// side. Where the delta has no room, the next steps take the rest.
void openTornSkin(CutJob& j) {
  Skin& skin = j.s.topology.skin;
  if (skin.triangles.empty() || skin.binding_start.size() < 2) return;
  const std::size_t vertices = skin.binding_start.size() - 1;
  std::fill(j.k.candidate.begin(), j.k.candidate.end(), std::uint8_t{0});
  for (std::size_t v = 0; v < vertices; ++v) {
    int torn = 0;
    for (std::uint32_t e = skin.binding_start[v]; e < skin.binding_start[v + 1]; ++e)
      torn += j.k.near_knot[skin.binding_knots[e]] != 0 && skin.binding_weights[e] != 0.0f;
    j.k.candidate[v] = torn >= 2 ? 2 : 0;  // 2: no place yet
  }
  for (std::uint32_t t = 0; t < skin.triangles.size(); ++t) {
    const std::uint32_t home = j.cut.home[t];
    if (j.s.topology.triangle_alive[t] == 0 || home == kNone || j.s.triangle_alive[home] == 0) continue;
    for (const std::uint32_t v : skin.triangles[t]) {
      if (j.k.candidate[v] != 2) continue;
      j.k.candidate[v] = 1, j.cut.lies_on[v] = home, j.cut.free[v] |= interaction::kFree;
    }
  }
  removeTornSkin(j);
  // What was bound to a place before may have hung on what is another piece now.
  for (std::size_t v = 0; v < vertices; ++v)
    if (j.k.candidate[v] != 1)
      j.k.candidate[v] = (j.cut.free[v] & interaction::kFree) != 0 && j.k.candidate[v] == 0 ? 1 : 0;
  bindSkin(j, vertices);
}

}  // namespace

void tear(Context& c, std::size_t object) {
  const Object& described = c.model.description.objects[object];
  ObjectState& s = c.state.objects[object];
  using net::Block;
  const float *x = s.block.row(Block::X), *y = s.block.row(Block::Y), *z = s.block.row(Block::Z);
  const float most = static_cast<float>((1.0 + described.tear_strain) * (1.0 + described.tear_strain));
  TopologyDelta& delta = c.deltas->next();
  beginDelta(c.state, static_cast<std::uint16_t>(object), delta);
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < s.topology.links.size() && delta.removed_links.size() < kDeltaLinks; ++i) {
    if (!s.topology.link_alive[i] || s.places[i].kind != LinkKind::Elastic) continue;
    const net::KernelLink& l = s.links[s.places[i].index].values;
    const float dx = x[l.knot1] - x[l.knot0], dy = y[l.knot1] - y[l.knot0], dz = z[l.knot1] - z[l.knot0];
    if (!(dx * dx + dy * dy + dz * dz > most * l.rest * l.rest)) continue;
    if (delta.removed_links.empty()) {
      keepShape(c, object);
      Event e = eventOf(c, EventKind::Torn, -1, object, static_cast<std::uint32_t>(i));
      place = e.position = 0.5 * (knotPosition(s, l.knot0) + knotPosition(s, l.knot1));
      e.station = stationOf(c.model, c.state, object, {l.knot0, l.knot1, l.knot1}, {0.5, 0.5, 0.0});
      e.area = s.topology.links[i].area;
      emit(c, e);
    }
    tearLink(c.state, static_cast<std::uint16_t>(object), static_cast<std::uint32_t>(i), delta);
  }
  if (delta.removed_links.empty()) return;
  CutJob j(c, object, delta);
  std::uint32_t parted = 0;
  if (j.constants.possible) {
    const std::uint32_t before = j.cut.parts;
    renewVersions(j);
    const bool opened = openTornSurface(j);
    renewIncident(j);
    divideElements(j);
    j.parted = j.cut.parts > before;
    if (opened || j.parted) openTornSkin(j);
    parted = j.cut.parts - before;
  }
  endDelta(c.state, delta);
  c.deltas->keep();
  for (; parted > 0; --parted) {
    Event e = eventOf(c, EventKind::Separated, -1, object, 0);
    e.position = place;
    e.station = std::numeric_limits<double>::quiet_NaN();
    emit(c, e);
  }
}

}  // namespace vest::scene
