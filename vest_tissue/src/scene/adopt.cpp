#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <tuple>

#include "world_impl.h"

// A scene that was edited goes on: what is the same in both keeps its State, and what holds on to that alone.
namespace vest::scene {
namespace {

using interaction::Channel;
using interaction::Clip;
using interaction::Grasp;
using interaction::Sling;
using interaction::Suspension;

/// From numbers of the World before to those of the one that takes over; kNotAdopted: not taken over.
struct Renumbering {
  std::vector<std::uint32_t> objects, strands, needles, nodes, places;

  bool keeps(std::size_t object) const { return object < objects.size() && objects[object] != kNotAdopted; }
  /// False, and nothing changed, where it is gone.
  template <class T>
  static bool renumber(const std::vector<std::uint32_t>& to, T& number) {
    if (number >= to.size() || to[number] == kNotAdopted) return false;
    number = static_cast<T>(to[number]);
    return true;
  }
  template <class T>
  bool object(T& number) const {
    return renumber(objects, number);
  }
};

std::vector<std::uint32_t> sameIn(const std::vector<std::uint64_t>& then,
                                  const std::vector<std::uint64_t>& now) {
  std::vector<std::uint32_t> to(then.size(), kNotAdopted);
  std::map<std::uint64_t, std::uint32_t> by_identity;  // names are unique, and part of it
  for (std::uint32_t i = 0; i < now.size(); ++i) by_identity.emplace(now[i], i);
  for (std::size_t i = 0; i < then.size(); ++i)
    if (const auto found = by_identity.find(then[i]); found != by_identity.end()) to[i] = found->second;
  return to;
}

/// Threads whose descriptions are the same have as many nodes, joints and places, in the same order.
void renumberThreads(const WorldModel& before, const WorldModel& now, Renumbering& to) {
  to.strands = sameIn(before.sutures, now.sutures);
  if (!before.threads.rods) return;
  const suture::Model& rods = *before.threads.rods;
  to.needles.assign(rods.needles.size(), kNotAdopted);
  to.nodes.assign(rods.mass.size(), kNotAdopted);
  to.places.assign(before.threads.places.size(), kNotAdopted);
  for (std::size_t n = 0; n < to.strands.size(); ++n) {
    if (to.strands[n] == kNotAdopted) continue;
    const suture::Strand &a = rods.strands[n], &b = now.threads.rods->strands[to.strands[n]];
    for (std::uint32_t i = 0; i < a.nodes; ++i) to.nodes[a.first + i] = to.places[a.first + i] = b.first + i;
    if (a.needle == suture::kNone) continue;
    to.needles[a.needle] = b.needle;
    for (std::uint32_t i = 0; i < rods.needles[a.needle].points.size(); ++i)
      to.places[before.threads.first_point[a.needle] + i] = now.threads.first_point[b.needle] + i;
  }
}

/// Sub-steps as fine as before, of the exchanges that the new scene asks for.
void takeObject(const ObjectState& before, const ObjectState& before_start, const ObjectState& start,
                ObjectState& s) {
  s = before;
  s.batches = start.batches * std::max(1, before.batches / std::max(1, before_start.batches));
  const bool elements = !s.tissue.x.empty();  // which take one sub-step a batch
  const int least = elements ? s.batches : std::max(before.sub_steps, start.sub_steps);
  s.sub_steps = (least + s.batches - 1) / s.batches * s.batches;
  s.way_bounded = s.way_searched = -1.0;
  for (std::size_t k = 0; k < std::min(s.depth.size(), start.depth.size()); ++k)
    s.depth[k] = std::min(s.depth[k], start.depth[k]);
  if (!elements || s.tissue.factored) return;
  // What it answers to held forces goes with its share of the step.
  const auto row = net::Block::kInverseMass;
  std::copy_n(start.block.row(row), start.block.knots(), s.block.row(row));
}

/// Which knots two connections tie: what else a scene says of one may follow from where its objects begin.
auto tiesOf(const Connection& c) {
  return std::tie(c.object0, c.object1, c.knot0, c.triangle1);
}

void takeConnections(const WorldModel& before, const WorldState& then, const WorldModel& now,
                     const Renumbering& to, WorldState& s) {
  const auto &was = before.description.connections, &is = now.description.connections;
  for (std::size_t n = 0; n < is.size(); ++n) {
    const auto found =
        std::find_if(was.begin(), was.end(), [&](const auto& c) { return tiesOf(c) == tiesOf(is[n]); });
    if (found == was.end()) continue;
    ConnectionState c = then.connections[static_cast<std::size_t>(found - was.begin())];
    if (to.object(c.end0.object) && to.object(c.end1.object)) s.connections[n] = c;
  }
}

template <class Anchors>
bool renumberAnchors(const Renumbering& to, Anchors& anchors, int count) {
  for (int i = 0; i < count; ++i)
    if (!to.object(anchors[static_cast<std::size_t>(i)].object)) return false;
  return true;
}

void takeFasteners(const interaction::Fasteners& then, const Renumbering& to, interaction::Fasteners& s) {
  s.appliers = then.appliers;
  // A clip on several objects stays on all of them or on none.
  std::set<std::uint64_t> lost;
  for (const Clip& c : then.clips)
    if (c.alive && !to.keeps(c.object)) lost.insert(c.id);
  for (Clip c : then.clips)
    if (c.alive && lost.count(c.id) == 0 && to.object(c.object)) s.clips.push_back(c);
  for (Sling sling : then.slings) {
    bool whole = sling.alive && (!sling.around || to.object(sling.object));
    if (!sling.around) sling.object = 0;
    for (auto& t : sling.touch)
      if (!to.object(t.object)) {
        whole = whole && !(sling.around && t.on);
        t = {};
      }
    if (whole) s.slings.push_back(sling);
  }
}

void takeThreads(const WorldModel& before, const interaction::ThreadState& then, const WorldModel& now,
                 const Renumbering& to, interaction::ThreadState& s) {
  if (!before.threads.rods || !now.threads.rods) return;
  const suture::Model &old = *before.threads.rods, &rods = *now.threads.rods;
  s.rod.time = then.rod.time;
  for (std::size_t n = 0; n < to.strands.size(); ++n) {
    if (to.strands[n] == kNotAdopted) continue;
    const suture::Strand &a = old.strands[n], &b = rods.strands[to.strands[n]];
    const auto copy = [](const auto& from, std::size_t first, std::size_t count, auto& into, std::size_t at) {
      std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(first), count,
                  into.begin() + static_cast<std::ptrdiff_t>(at));
    };
    copy(then.rod.position, a.first, a.nodes, s.rod.position, b.first);
    copy(then.rod.velocity, a.first, a.nodes, s.rod.velocity, b.first);
    copy(then.rod.frame, a.first, a.nodes, s.rod.frame, b.first);
    copy(then.rod.spin, a.first, a.nodes, s.rod.spin, b.first);
    copy(then.rod.severed, a.first, a.nodes, s.rod.severed, b.first);
    const std::size_t joints = a.joints_end - a.joints_begin;
    copy(then.rod.natural_curvature, a.joints_begin, joints, s.rod.natural_curvature, b.joints_begin);
    copy(then.rod.offset, a.joints_begin, joints, s.rod.offset, b.joints_begin);
    s.knots[to.strands[n]] = then.knots[n];
    s.packed[to.strands[n]] = then.packed[n];
  }
  for (std::uint32_t i = 0; i < then.rod.contact_count; ++i) {
    suture::LiveContact c = then.rod.contacts[i];
    if (c.b >= suture::kCylinder || s.rod.contact_count >= s.rod.contacts.size()) continue;
    if (!to.renumber(to.nodes, c.a) || !to.renumber(to.nodes, c.b)) continue;
    if (c.b < c.a) std::swap(c.a, c.b), c.normal = -c.normal, c.force = -c.force;
    s.rod.contacts[s.rod.contact_count++] = c;
  }
  std::sort(s.rod.contacts.begin(), s.rod.contacts.begin() + s.rod.contact_count,
            [](const auto& x, const auto& y) { return std::tie(x.a, x.b) < std::tie(y.a, y.b); });
  for (interaction::ThreadTouch t : then.touches) {
    const bool tissue = t.kind == interaction::TouchKind::Tissue || t.kind == interaction::TouchKind::Rigid;
    if ((!tissue || to.object(t.body)) && to.renumber(to.places, t.segment)) s.touches.push_back(t);
  }
  std::sort(s.touches.begin(), s.touches.end(),
            [](const auto& x, const auto& y) { return interaction::before(x, y); });
  for (std::size_t tool = 0; tool < then.grips.size(); ++tool) {
    interaction::ThreadGrip grip = then.grips[tool];
    int kept = 0;
    for (int i = 0; i < grip.count; ++i) {
      interaction::GripNode node = grip.nodes[static_cast<std::size_t>(i)];
      if (to.renumber(to.nodes, node.node)) grip.nodes[static_cast<std::size_t>(kept++)] = node;
    }
    grip.count = kept;
    if (kept > 0 || !grip.active) s.grips[tool] = grip;
    interaction::NeedleGrip needle = then.needle_grips[tool];
    if (needle.active && to.renumber(to.needles, needle.needle)) s.needle_grips[tool] = needle;
    interaction::ThreadPusher pusher = then.pushers[tool];
    if (pusher.active && to.renumber(to.strands, pusher.strand)) s.pushers[tool] = pusher;
  }
  for (Channel c : then.channels)
    if (to.object(c.object) && to.renumber(to.needles, c.needle)) s.channels.push_back(c);
}

}  // namespace

std::vector<std::uint32_t> World::adopt(const World& before) {
  const WorldModel &was = *before.impl_->model, &is = *impl_->model;
  const WorldState& then = before.impl_->state;
  WorldState& s = impl_->state;
  Renumbering to;
  std::vector<std::uint64_t> old_objects, new_objects;
  for (const ObjectConstants& c : was.objects) old_objects.push_back(c.identity);
  for (const ObjectConstants& c : is.objects) new_objects.push_back(c.identity);
  to.objects = sameIn(old_objects, new_objects);
  if (was.description.dt != is.description.dt) to.objects.assign(to.objects.size(), kNotAdopted);
  renumberThreads(was, is, to);

  s = is.start;
  s.step = then.step, s.time = then.time, s.way = then.way;
  s.revision = then.revision + 1, s.way_revision = s.supported_revision = then.revision;
  s.next_attachment = then.next_attachment;
  if (was.description.gravity == is.description.gravity) s.gravity = then.gravity;
  s.proxies = then.proxies;
  s.electrosurgery.monopolar_power = then.electrosurgery.monopolar_power;
  s.electrosurgery.bipolar_power = then.electrosurgery.bipolar_power;
  for (std::size_t i = 0; i < to.objects.size(); ++i) {
    if (to.objects[i] == kNotAdopted) continue;
    const std::size_t n = to.objects[i];
    takeObject(then.objects[i], was.start.objects[i], is.start.objects[n], s.objects[n]);
    s.jaws_pass[n] = then.jaws_pass[i], s.blades_pass[n] = then.blades_pass[i];
  }
  takeConnections(was, then, is, to, s);
  for (std::size_t t = 0; t < then.grasps.size(); ++t) {
    Grasp grasp = then.grasps[t];
    if (renumberAnchors(to, grasp.anchors, grasp.count)) s.grasps[t] = grasp;
    interaction::CuttingTool cutting = then.cutting.tools[t];
    if (to.object(cutting.object)) s.cutting.tools[t] = cutting;
    interaction::Electrode electrode = then.electrosurgery.electrodes[t];
    if (to.object(electrode.object)) s.electrosurgery.electrodes[t] = electrode;
  }
  for (OrganPair p : then.pairs)
    if (to.object(p.object) && to.object(p.other) && s.pairs.size() < is.mostPairs()) s.pairs.push_back(p);
  for (ContactSide side : then.sides)
    if (to.object(side.object)) s.sides.push_back(side);
  std::sort(s.sides.begin(), s.sides.end(), [](const ContactSide& a, const ContactSide& b) {
    return std::tie(a.tool, a.capsule, a.object, a.triangle) <
           std::tie(b.tool, b.capsule, b.object, b.triangle);
  });
  takeFasteners(then.fasteners, to, s.fasteners);
  s.suspensions.pressed = then.suspensions.pressed;
  for (std::size_t i = 0; i < then.suspensions.all.size(); ++i) {
    Suspension hung = then.suspensions.all[i];
    if (renumberAnchors(to, hung.knots, hung.count)) s.suspensions.all[i] = hung;
  }
  takeThreads(was, then.threads, is, to, s.threads);
  if (was.description.feel == is.description.feel) s.in_image = then.in_image;
  s.energy = then.energy;
  impl_->goOn();
  return to.objects;
}

}  // namespace vest::scene
