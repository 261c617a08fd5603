#include "vest_tissue/scene/stitches.h"

#include <algorithm>

#include "vest_tissue/scene/world_model.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::Channel;
using interaction::ChannelAnchor;

/// m: of a knot on the shape without load; a copy beside a cut has that of the knot that it was.
Vector3d atRest(const World& world, std::size_t object, std::size_t knot) {
  const Object& o = world.description().objects[object];
  const auto& rest = o.rest_position.empty() ? o.position : o.rest_position;
  const auto& doubled = world.topology(object).doubled_knots;
  while (knot >= rest.size() && knot - rest.size() < doubled.size()) knot = doubled[knot - rest.size()];
  return knot < rest.size() ? rest[knot] : world.knotAt(object, knot);
}

Mouth mouthOf(const World& world, const Channel& channel, int number) {
  const ChannelAnchor& a = channel.anchors[static_cast<std::size_t>(number)];
  const auto& triangles = world.state().objects[channel.object].triangles;
  Mouth m;
  m.object = channel.object, m.exit = number > 0;
  for (std::size_t k = 0; k < a.weight.size(); ++k) {
    if (a.weight[k] == 0.0) continue;
    const std::uint32_t knot = triangles[a.triangle[k / 3]][k % 3];
    m.now += a.weight[k] * world.knotAt(channel.object, knot);
    m.rest += a.weight[k] * atRest(world, channel.object, knot);
  }
  return m;
}

}  // namespace

void findBites(const World& world, Bites& out) {
  out.count = 0;
  for (const Channel& channel : world.state().threads.channels) {
    if (!channel.filled || !channel.through) continue;
    out.mouths[out.count++] = mouthOf(world, channel, 0);
    if (channel.count > 1) out.mouths[out.count++] = mouthOf(world, channel, channel.count - 1);
  }
}

double threadTension(const World& world) {
  const ThreadModel& threads = world.model().threads;
  double most = 0.0;
  if (!threads.rods) return most;
  const suture::State& s = world.state().threads.rod;
  for (const suture::Strand& strand : threads.rods->strands)
    for (std::uint32_t i = strand.threadFirst(); i < strand.first + strand.segments; ++i)
      if (s.severed[i] == 0) most = std::max(most, suture::tensionOf(*threads.rods, s, strand, i));
  return most;
}

Knot findKnot(const World& world, suture::KnotScratch& scratch) {
  const ThreadModel& threads = world.model().threads;
  Knot best;
  if (!threads.rods) return best;
  const suture::State& s = world.state().threads.rod;
  for (const suture::Strand& strand : threads.rods->strands) {
    if (strand.closed) continue;
    suture::eachPart(strand, s, [&](std::uint32_t first, std::uint32_t count) {
      const suture::KnotPlace found = suture::placeOfKnot(&s.position[first], count, scratch);
      if (found.kind.determinant <= best.kind.determinant) return;
      best.kind = found.kind;
      double before = 0.0, behind = 0.0;
      for (std::size_t i = 0; i < found.first; ++i) before += threads.rods->length[first + i];
      for (std::size_t i = found.last; i + 1 < count; ++i) behind += threads.rods->length[first + i];
      best.tail = std::min(before, behind);
      best.place = 0.5 * (s.position[first + found.first] + s.position[first + found.last]);
    });
  }
  return best;
}

}  // namespace vest::scene
