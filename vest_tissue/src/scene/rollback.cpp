#include <algorithm>
#include <cstring>

#include "stages.h"
#include "state_archives.h"

// What a fault gives back: all of the State as it was before the step. Its motion is kept every step. Of an
// object's shape a step changes nothing before it is known to be good, but for what its input asks for; that
// is kept when it happens.
namespace vest::scene {

void reserveBackup(const WorldModel& model, WorldState& state, WorldScratch& scratch) {
  Measure motion{{{nullptr, &model}, false}};
  visit(motion, rule(state));
  scratch.kept_motion.reserve(motion.bytes);
  Measure shapes{{{&state, &model}, true, true}};
  for (std::size_t& i = shapes.at.object = 0; i < state.objects.size(); ++i) {
    if (!model.objects[i].deforms) continue;
    visit(shapes, rule(state.objects[i]));
    visit(shapes, rule(state.objects[i].cut.spare));
  }
  scratch.kept_shapes.reserve(shapes.bytes);
}

void keepBackup(Context& c) {
  for (std::size_t i = 0; i < c.state.objects.size(); ++i) {
    ObjectScratch& o = c.scratch.objects[i];
    o.shape_kept = o.rings_kept = kNotKept;
    if (!c.model.objects[i].deforms) continue;
    o.knots_before = c.state.objects[i].block.knots();
  }
  c.scratch.proxies_before = c.state.proxies;
  c.scratch.kept_motion.clear(), c.scratch.kept_shapes.clear();
  Writer writer{{{nullptr, &c.model}, false}, c.scratch.kept_motion};
  visit(writer, rule(c.state));
}

void keepShape(Context& c, std::size_t object) {
  ObjectScratch& o = c.scratch.objects[object];
  if (o.shape_kept != kNotKept || !c.model.objects[object].deforms) return;
  o.shape_kept = c.scratch.kept_shapes.size();
  Writer writer{{{&c.state, &c.model, object}, true, true}, c.scratch.kept_shapes};
  visit(writer, rule(c.state.objects[object]));
}

void keepRings(Context& c, std::size_t object) {
  ObjectScratch& o = c.scratch.objects[object];
  if (o.rings_kept != kNotKept) return;
  o.rings_kept = c.scratch.kept_shapes.size();
  Writer writer{{}, c.scratch.kept_shapes};
  for (const auto& [e, place] : c.model.objects[object].ring_links)
    writer.values(&c.state.objects[object].links[e].values.rest, 1, {});
}

void restoreBackup(Context& c) {
  const auto reader = [&c](std::size_t object, std::size_t from) {
    return Reader{{{&c.state, &c.model, object}, true, true}, c.scratch.kept_shapes, from};
  };
  for (std::size_t i = 0; i < c.state.objects.size(); ++i) {
    if (c.scratch.objects[i].shape_kept == kNotKept) continue;
    Reader shape = reader(i, c.scratch.objects[i].shape_kept);
    visit(shape, rule(c.state.objects[i]));
    repack(c.state.objects[i]);
  }
  Reader motion{{{nullptr, &c.model}, false}, c.scratch.kept_motion};
  visit(motion, rule(c.state));
  for (std::size_t i = 0; i < c.state.objects.size(); ++i) {
    ObjectState& s = c.state.objects[i];
    if (!s.load.any) {
      for (auto* of : {&s.load.now, &s.load.told}) std::fill(of->begin(), of->end(), HeldLoad::Of{});
      std::fill(s.load.own.begin(), s.load.own.end(), 0.0f);
    }
    s.law_links.setMaxStrain(s.limit_strain);
    if (c.scratch.objects[i].rings_kept == kNotKept) continue;
    Reader rings = reader(i, c.scratch.objects[i].rings_kept);
    for (const auto& [e, place] : c.model.objects[i].ring_links) {
      float rest = 0.0f;
      rings.values(&rest, 1, {});
      setLink(s, e, s.links[e].values.axial, rest, s.links[e].values.damping);
    }
  }
  c.deltas->forgetBeyond(c.state.revision);
  c.scratch.forget();
  for (auto& p : c.state.proxies) {
    p.velocity.setZero();
    clearForces(p);
  }
}

}  // namespace vest::scene
