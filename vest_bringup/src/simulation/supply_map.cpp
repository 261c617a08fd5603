#include "vest_bringup/simulation/supply_map.h"

#include <algorithm>
#include <cmath>

#include "vest_tissue/scene/world_model.h"

namespace vest::simulation {

using Eigen::Vector3d;

namespace {

constexpr double kClipReach = 0.006;   ///< m around the middle of a clip: half a clip of 10 mm (assumed)
constexpr double kSlingReach = 0.003;  ///< m beyond a loop: what it has squeezed out of its way (assumed)
constexpr std::uint64_t kAgain = 256;  ///< steps: a fastener goes on to draw in tissue after it has closed

}  // namespace

SupplyMap::SupplyMap(const scene::World& world, const std::vector<std::uint32_t>& first)
    : first_(first), floats_(world.objectCount(), 0), part_(first.back() + 1u), size_(first.back() + 1u) {
  barriers_.reserve(interaction::kMaxClips + interaction::kMaxSlings);
  find(world);
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const std::size_t knots = world.knotCount(i);
    floats_[i] = knots > 0;
    for (std::uint32_t k = 0; k < knots && floats_[i]; ++k) floats_[i] = root(1 + first_[i] + k) != 0;
  }
  reset();
}

void SupplyMap::reset() {
  state.fed.assign(first_.back(), 1);
  state.seen = 0;
}

std::uint64_t SupplyMap::look(const scene::World& world) const {
  std::uint64_t sum = world.revision();
  bool closed = false;
  const auto add = [&](std::uint64_t n) { sum = sum * 1099511628211ull + n + 1; };
  for (const auto& clip : world.state().fasteners.clips)
    if (clip.alive && clip.shut) add(clip.id), closed = true;
  for (const auto& sling : world.state().fasteners.slings)
    if (sling.alive && sling.tied) add(sling.id), closed = true;
  if (closed) add(world.steps() / kAgain);
  return sum;
}

void SupplyMap::findBarriers(const scene::World& world) {
  barriers_.clear();
  for (const auto& clip : world.state().fasteners.clips)
    if (clip.alive && clip.shut)
      barriers_.push_back(
          {clip.object, clip.centre + clip.rotation * clip.offset, clip.rotation.col(1), kClipReach});
  for (const auto& sling : world.state().fasteners.slings) {
    if (!(sling.alive && sling.tied && sling.around)) continue;
    Barrier b;
    b.object = sling.object;
    b.centre = b.normal = Vector3d::Zero();
    for (const Vector3d& p : sling.node) b.centre += p / interaction::kSlingNodes;
    for (std::size_t i = 0; i < sling.node.size(); ++i)
      b.normal += (sling.node[i] - b.centre).cross(sling.node[(i + 1) % sling.node.size()] - b.centre);
    const double area = std::sqrt(b.normal.squaredNorm());
    if (!(area > 1e-12)) continue;
    b.normal /= area;
    for (const Vector3d& p : sling.node) b.reach = std::max(b.reach, (p - b.centre).squaredNorm());
    b.reach = std::sqrt(b.reach) + kSlingReach;
    barriers_.push_back(b);
  }
}

std::uint32_t SupplyMap::root(std::uint32_t i) {
  while (part_[i] != i) i = part_[i] = part_[part_[i]];
  return i;
}

void SupplyMap::join(std::uint32_t a, std::uint32_t b) {
  const std::uint32_t ra = root(a), rb = root(b);
  part_[std::max(ra, rb)] = std::min(ra, rb);
}

void SupplyMap::hang(const scene::World& world, std::size_t object, std::uint32_t a, std::uint32_t b) {
  for (const Barrier& barrier : barriers_) {
    if (barrier.object != object) continue;
    const Vector3d pa = world.knotAt(object, a) - barrier.centre,
                   pb = world.knotAt(object, b) - barrier.centre;
    const double da = pa.dot(barrier.normal), db = pb.dot(barrier.normal);
    if ((da < 0) == (db < 0)) continue;
    const double share = da / (da - db);
    if ((pa + share * (pb - pa)).squaredNorm() < barrier.reach * barrier.reach) return;
  }
  join(1 + first_[object] + a, 1 + first_[object] + b);
}

void SupplyMap::find(const scene::World& world) {
  for (std::uint32_t i = 0; i < part_.size(); ++i) part_[i] = i;
  const scene::WorldState& tissue = world.state();
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const scene::ObjectState& s = tissue.objects[i];
    const auto knots =
        static_cast<std::uint32_t>(std::min<std::size_t>(world.knotCount(i), first_[i + 1] - first_[i]));
    const bool rigid = !world.model().objects[i].deforms;
    for (std::uint32_t k = 0; k < knots; ++k)
      if (rigid || (k < s.fixed.size() && s.fixed[k])) join(0, 1 + first_[i] + k);
    if (rigid) continue;
    const auto tie = [&](std::uint32_t a, std::uint32_t b) {
      if (a < knots && b < knots) hang(world, i, a, b);
    };
    for (std::size_t n = 0; n < s.topology.links.size(); ++n)
      if (s.topology.link_alive[n]) tie(s.topology.links[n].knot0, s.topology.links[n].knot1);
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      if (!s.triangle_alive[t]) continue;
      const auto& k = s.triangles[t];
      tie(k[0], k[1]), tie(k[1], k[2]), tie(k[2], k[0]);
    }
    for (const auto& corner : s.tissue.corner)
      for (std::size_t a = 0; a < 4; ++a)
        for (std::size_t b = a + 1; b < 4; ++b)
          tie(static_cast<std::uint32_t>(corner[a]), static_cast<std::uint32_t>(corner[b]));
  }
  for (const scene::ConnectionState& c : tissue.connections) {
    if (!c.alive) continue;
    for (std::size_t e = 0; e < 4; ++e)
      if (c.end1.weights[e] != 0.0)
        join(1 + first_[c.end0.object] + c.end0.knots[0], 1 + first_[c.end1.object] + c.end1.knots[e]);
  }
}

void SupplyMap::follow(const scene::World& world) {
  const std::uint64_t now = look(world);
  if (now == state.seen) return;
  state.seen = now;
  findBarriers(world);
  find(world);
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    const std::uint32_t from = 1 + first_[i], to = 1 + first_[i + 1];
    std::uint32_t stays = 0;
    if (floats_[i]) {
      const auto knots = static_cast<std::uint32_t>(world.knotCount(i));
      for (std::uint32_t n = from; n < to; ++n) size_[root(n)] = 0;
      for (std::uint32_t n = from; n < std::min(to, from + knots); ++n) ++size_[root(n)];
      stays = root(from);
      for (std::uint32_t n = from; n < std::min(to, from + knots); ++n)
        if (size_[root(n)] > size_[stays]) stays = root(n);
    }
    for (std::uint32_t n = from; n < to; ++n) {
      const std::uint32_t r = root(n);
      state.fed[n - 1] = r == 0 || (floats_[i] && r == stays);
    }
  }
}

}  // namespace vest::simulation
