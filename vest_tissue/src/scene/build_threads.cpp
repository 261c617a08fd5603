#include <memory>
#include <numeric>
#include <vector>

#include "stages.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/suture/roeder.h"

namespace vest::scene {
namespace {

constexpr double kToHand =
    0.3;  ///< m of a loop's standing part, from the pusher's point to the hand; assumed

void placeThreads(ThreadModel& m) {
  const suture::Model& rods = *m.rods;
  for (std::uint32_t n = 0; n < rods.strands.size(); ++n) {
    const suture::Strand& strand = rods.strands[n];
    double station = strand.needle != suture::kNone ? rods.needles[strand.needle].length : 0.0;
    for (std::uint32_t i = strand.first; i < strand.first + strand.nodes; ++i) {
      ThreadPlace p;
      p.strand = n, p.radius = strand.section.radius;
      const bool last = i + 1 == strand.first + strand.nodes;
      p.segment = last ? i - 1 : i, p.s = last ? 1.0 : 0.0;
      p.touches = i >= strand.threadFirst();
      p.station = station;
      if (p.touches) station += rods.length[i];
      m.places.push_back(p);
    }
  }
  for (const suture::NeedleModel& needle : rods.needles) {
    m.first_point.push_back(static_cast<std::uint32_t>(m.places.size()));
    for (std::size_t i = 0; i < needle.points.size(); ++i) {
      ThreadPlace p;
      p.strand = m.places[needle.node].strand;
      p.segment = needle.node, p.rigid = true, p.arm = needle.points[i];
      p.radius = needle.radius;
      p.station = needle.spacing * static_cast<double>(i);
      m.places.push_back(p);
    }
  }
}

/// Loops that are tied beforehand lie in their packets.
void placeLoops(WorldModel& m) {
  const std::vector<Suture>& sutures = m.description.sutures;
  m.start.threads.packed.assign(sutures.size(), 0);
  for (std::uint32_t n = 0; n < sutures.size(); ++n) {
    const Suture& s = sutures[n];
    if (!(s.loop > 0.0)) continue;
    LoopModel loop;
    loop.strand = n;
    loop.place = s.loop_at;
    loop.turn = Eigen::Quaterniond(suture::loopAxes(s.loop_ahead, s.loop_across));
    loop.standing = (s.rod.nodes[0] - s.loop_at).norm();
    loop.give = s.rod.section.stretch / kToHand;
    m.threads.loops.push_back(loop);
    m.start.threads.packed[n] = m.threads.rods->strands[n].nodes;
    suture::KnotScratch scratch(s.rod.nodes.size());  // its knot is drawn: no event tells it
    interaction::KnotWatch& watch = m.start.threads.knots[n];
    watch.kind = watch.seen = suture::kindOf(s.rod.nodes.data(), s.rod.nodes.size(), scratch);
    watch.drawn = true;
  }
}

}  // namespace

void buildThreads(WorldModel& m) {
  const Description& d = m.description;
  if (d.sutures.empty()) return;
  suture::Description rods;
  for (const Suture& s : d.sutures) {
    rods.rods.push_back(s.rod);
    m.threads.strength.push_back(s.strength);
    m.threads.knot_strength.push_back(s.knot_strength);
    m.threads.friction.push_back(s.friction);
  }
  rods.cylinders = d.cylinders;
  m.threads.rods = std::make_shared<suture::Model>(rods);
  m.start.threads.rod = m.threads.rods->start;
  m.start.threads.knots.resize(m.threads.rods->strands.size());
  placeThreads(m.threads);
  placeLoops(m);
  int common = 0;
  for (const std::size_t i : m.bodies) common = std::gcd(common, m.objects[i].batches);
  if (common == 0) common = m.batches = 4;
  for (m.threads.steps = common; m.threads.steps > 4;) m.threads.steps /= m.threads.steps % 2 == 0 ? 2 : 3;
}

}  // namespace vest::scene
