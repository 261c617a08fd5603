#include <algorithm>

#include "stages.h"
#include "vest_tissue/scene/loose.h"

namespace vest::scene {
namespace {

constexpr float kBeyond = 0.001f;  ///< m behind a cavity's wall that count as outside (assumed)

/// Knots of all objects that hang together, by links, surface and connections; number 0 is what does not
/// move.
struct Parts {
  const WorldModel& model;
  const WorldState& state;
  std::vector<std::uint32_t>& of;     ///< union-find over 1 + all knots
  std::vector<std::uint32_t>& first;  ///< per object: number of its first knot

  std::uint32_t root(std::uint32_t i) const {
    while (of[i] != i) i = of[i] = of[of[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) const {
    const std::uint32_t ra = root(a), rb = root(b);
    of[std::max(ra, rb)] = std::min(ra, rb);
  }
  std::uint32_t number(std::size_t object, std::uint32_t knot) const { return first[object] + knot; }

  void find() const {
    std::uint32_t count = 1;
    for (std::size_t i = 0; i < state.objects.size(); ++i) {
      first[i] = count;
      count += static_cast<std::uint32_t>(state.objects[i].block.knots());
    }
    for (std::uint32_t i = 0; i < count; ++i) of[i] = i;
    for (std::size_t i = 0; i < state.objects.size(); ++i) {
      const ObjectState& s = state.objects[i];
      // What has no tethers that could go holds what hangs on it as long as it is there.
      const bool whole = !model.objects[i].body->tethered();
      for (std::uint32_t k = 0; k < s.block.knots(); ++k)
        if (whole || s.fixed[k]) join(0, number(i, k));
      if (whole) continue;
      for (std::size_t n = 0; n < s.topology.links.size(); ++n) {
        const Link& l = s.topology.links[n];
        if (!s.topology.link_alive[n]) continue;
        join(number(i, l.knot0), number(i, l.knot1));
        if (l.kind == LinkKind::Bending) join(number(i, l.knot0), number(i, l.knot2));
      }
      for (std::size_t t = 0; t < s.triangles.size(); ++t) {
        const auto& k = s.triangles[t];
        if (!s.triangle_alive[t]) continue;
        join(number(i, k[0]), number(i, k[1])), join(number(i, k[0]), number(i, k[2]));
      }
    }
    for (const ConnectionState& c : state.connections) {
      if (!c.alive) continue;
      for (std::size_t e = 0; e < 4; ++e)
        if (c.end1.weights[e] != 0.0)
          join(number(c.end0.object, c.end0.knots[0]), number(c.end1.object, c.end1.knots[e]));
    }
  }

  /// What nothing held from the start is not cut off from anything: of such an object the largest part stays
  /// supported. @return its root
  std::uint32_t largest(std::size_t object, std::vector<std::uint32_t>& size) const {
    const std::size_t knots = state.objects[object].block.knots();
    std::uint32_t best = root(number(object, 0));
    for (std::uint32_t k = 0; k < knots; ++k) size[root(number(object, k))] = 0;
    for (std::uint32_t k = 0; k < knots; ++k) ++size[root(number(object, k))];
    for (std::uint32_t k = 0; k < knots; ++k) {
      const std::uint32_t r = root(number(object, k));
      if (size[r] > size[best] || (size[r] == size[best] && r < best)) best = r;
    }
    return best;
  }
};

}  // namespace

void findFloating(WorldModel& m) {
  std::size_t knots = 1;
  for (const ObjectState& s : m.start.objects) knots += s.block.knots();
  std::vector<std::uint32_t> of(knots), first(m.objects.size());
  const Parts parts{m, m.start, of, first};
  parts.find();
  for (std::size_t i = 0; i < m.objects.size(); ++i) {
    const std::size_t count = m.objects[i].deforms ? m.start.objects[i].block.knots() : 0;
    m.objects[i].floats = count > 0;
    for (std::uint32_t k = 0; k < count && m.objects[i].floats; ++k)
      m.objects[i].floats = parts.root(parts.number(i, k)) != 0;
  }
}

void dropLoose(Context& c) {
  if (c.state.revision == c.state.supported_revision) return;
  c.state.supported_revision = c.state.revision;
  const Parts parts{c.model, c.state, c.scratch.part, c.scratch.part_first};
  parts.find();
  for (std::size_t i = 0; i < c.state.objects.size(); ++i) {
    ObjectState& s = c.state.objects[i];
    auto& tethers = s.elements.tethers;
    if (tethers.empty()) continue;
    const std::uint32_t stays = c.model.objects[i].floats ? parts.largest(i, c.scratch.part_size) : 0;
    const auto loose = [&](const net::Tether& t) {
      const std::uint32_t r = parts.root(parts.number(i, t.knot));
      return r != 0 && r != stays;
    };
    const auto end = std::remove_if(tethers.begin(), tethers.end(), loose);
    if (end == tethers.end()) continue;
    tethers.erase(end, tethers.end());
    s.dropped = true;
  }
}

LooseScratch::LooseScratch(const World& world) {
  std::size_t knots = 1;
  for (const ObjectState& s : world.model().start.objects) knots += s.block.knotCapacity();
  part.resize(knots), first.resize(world.objectCount());
}

LooseShare looseShare(const World& world, std::size_t object, LooseScratch& scratch) {
  const WorldModel& m = world.model();
  if (!m.objects[object].deforms) return {};
  const contact::DistanceGrid* wall = nullptr;
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < m.objects.size(); ++i) {
    if (m.description.objects[i].organ != "cavity" || m.objects[i].grid.empty()) continue;
    wall = &m.objects[i].grid;
    for (const Eigen::Vector3d& p : m.description.objects[i].position) box.extend(p);
  }
  const Parts parts{m, world.state(), scratch.part, scratch.first};
  parts.find();
  const ObjectState& s = world.state().objects[object];
  const float* const mass = row(s, net::Block::kMass);
  double whole = 0.0, loose = 0.0, removed = 0.0;
  for (std::uint32_t k = 0; k < s.block.knots(); ++k) {
    const auto own = static_cast<double>(mass[k]);
    whole += own;
    if (parts.root(parts.number(object, k)) == 0) continue;
    loose += own;
    const Eigen::Vector3d p = knotPosition(s, k);
    Eigen::Vector3f gradient;
    if (wall && (!box.contains(p) || wall->distance(p.cast<float>(), gradient) < -kBeyond)) removed += own;
  }
  return {loose / whole, removed / whole};
}

}  // namespace vest::scene
