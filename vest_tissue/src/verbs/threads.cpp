#include "vest_tissue/interaction/threads.h"

#include <algorithm>
#include <cmath>

#include "../scene/between_jaws.h"

/// Jaws and blades on threads.
namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::GripNode;
using interaction::ThreadGrip;

constexpr double kThreadFill = 0.03;  ///< rad: a thread fills the gap when it comes this near to the jaws

/// One instrument in this step.
struct Hand {
  Context& c;
  int tool;
  const tools::ToolGeometry& g;
  JawFrame frame;
  double jaw;  ///< rad

  const suture::State& rod() const { return c.state.threads.rod; }
  bool isBetween(std::uint32_t node) const { return scene::isBetween(c, tool, g, frame, node); }
  /// Opening that a thread fills where it is.
  double filled(const Vector3d& local, double radius) const { return filledJaw(g, local, radius); }
};

template <typename Visit>
void eachNode(const Hand& h, Visit visit) {
  for (const suture::Strand& strand : h.c.model.threads.rods->strands)
    for (std::uint32_t i = strand.threadFirst(); i < strand.first + strand.nodes; ++i)
      if (h.isBetween(i)) visit(i, strand.section.radius);
}

void hold(const Hand& h, ThreadGrip& grip, std::uint32_t node) {
  for (int k = 0; k < grip.count; ++k)
    if (grip.nodes[k].node == node) return;
  if (grip.count < interaction::kMaxGripNodes)
    grip.nodes[grip.count++] = {node, h.frame.local(h.rod().position[node])};
}

/// Neighbours of what is held have been drawn in between the jaws.
void holdDrawn(const Hand& h, ThreadGrip& grip, const ThreadGrip& was) {
  for (int k = 0; k < was.count; ++k) {
    const std::uint32_t node = was.nodes[k].node;
    const ThreadPlace& place = h.c.model.threads.places[node];
    const suture::Strand& strand = h.c.model.threads.rods->strands[place.strand];
    for (const std::uint32_t i : {node, node - 1, node + 1})
      if (i >= strand.threadFirst() && i < strand.first + strand.nodes &&
          (i == node || h.rod().severed[std::min(i, node)] == 0) &&
          interaction::jawAngleAt(h.g, h.frame.local(h.rod().position[i]), 0.0) >= 0.0)
        hold(h, grip, i);
  }
}

void letGo(const Hand& h, ThreadGrip& grip) {
  if (grip.active) emit(h.c, threadEvent(h.c, EventKind::Released, h.tool, grip.nodes[0].node));
  grip = ThreadGrip{};
}

void seek(const Hand& h, ThreadGrip& grip) {
  double most = 0.0;
  eachNode(h, [&](std::uint32_t i, double radius) {
    most = std::max(most, h.filled(h.frame.local(h.rod().position[i]), radius));
  });
  // What holds tissue holds the thread that lies on it.
  const interaction::Grasp& tissue = h.c.state.grasps[h.tool];
  const bool pressed = most > 0.0 && tissue.active;
  if (most <= 0.0) grip.jaw_at_touch = 0.0;
  if (most > 0.0 && h.jaw <= most + kThreadFill)
    grip.jaw_at_touch = std::max(grip.jaw_at_touch, most + kThreadFill);
  if (pressed) grip.jaw_at_touch = std::max(grip.jaw_at_touch, tissue.jaw_at_touch);
  const bool opening = h.jaw > h.c.scratch.proxies_before[h.tool].pose.jaw;
  const bool closed = !opening && grip.jaw_at_touch > 0.0 &&
                      (h.jaw <= (1.0 - interaction::kGraspClosure) * grip.jaw_at_touch || h.jaw <= most);
  if (!closed) return;
  grip.count = 0;
  eachNode(h, [&](std::uint32_t i, double) { hold(h, grip, i); });
  if (grip.count == 0) return;
  grip.active = true;
  grip.pinch = interaction::pinchForce(h.jaw, grip.jaw_at_touch);
  Event e = threadEvent(h.c, EventKind::Grasped, h.tool, grip.nodes[0].node);
  e.force = grip.pinch;
  emit(h.c, e);
}

/// Coulomb's limit of the hold, as for tissue: beyond it the thread is drawn through the jaws.
void slip(const Hand& h, ThreadGrip& grip) {
  Vector3d pull = Vector3d::Zero();
  const double stiffness = interaction::kThreadGrip / grip.count;
  for (int k = 0; k < grip.count; ++k)
    pull += stiffness * (h.frame.world(grip.nodes[k].local) - h.rod().position[grip.nodes[k].node]);
  const double limit = interaction::kHoldPerPinch * grip.pinch, force = std::sqrt(pull.squaredNorm());
  const bool sliding = force > limit;
  if (sliding && !grip.sliding) {
    Event e = threadEvent(h.c, EventKind::Slipped, h.tool, grip.nodes[0].node);
    e.force = force;
    emit(h.c, e);
  }
  grip.sliding = sliding;
  if (!sliding) return;
  const ThreadGrip was = grip;
  int kept = 0;
  for (int k = 0; k < grip.count; ++k) {
    GripNode n = grip.nodes[k];
    const Vector3d at = h.frame.local(h.rod().position[n.node]);
    n.local = at + limit / force * (n.local - at);
    if (interaction::jawAngleAt(h.g, at, 0.0) >= 0.0) grip.nodes[kept++] = n;
  }
  grip.count = kept;
  holdDrawn(h, grip, was);
  if (grip.count > 0) return;
  grip.nodes[0] = was.nodes[0];  // for the event
  letGo(h, grip);
}

/// Blades that have met part the thread between them.
void snip(const Hand& h) {
  suture::State& rod = h.c.state.threads.rod;
  for (const suture::Strand& strand : h.c.model.threads.rods->strands) {
    for (std::uint32_t i = strand.threadFirst(); i < strand.first + strand.segments; ++i) {
      const std::uint32_t last = strand.first + strand.segments - 1;
      if (rod.severed[i] != 0 || h.c.scratch.threads->apart[i] != 0 ||
          (i > strand.threadFirst() && rod.severed[i - 1] != 0) || (i < last && rod.severed[i + 1] != 0))
        continue;  // no crumbs beside a cut
      const Vector3d a = h.frame.local(rod.position[i]), b = h.frame.local(rod.position[i + 1]);
      if ((a.y() < 0.0) == (b.y() < 0.0)) continue;
      const Vector3d cut = a + (a.y() / (a.y() - b.y())) * (b - a);
      const double at = interaction::jawAngleAt(h.g, cut, 0.0);
      const double filled = h.filled(cut, strand.section.radius);
      if (at < 0.0 || at > h.jaw + 0.05 || h.jaw > filled) continue;
      // What comes to closed blades from outside is not between them.
      if (h.c.scratch.proxies_before[h.tool].pose.jaw <= filled && !h.c.scratch.appeared[h.tool] &&
          !wasBetween(h.c, h.tool, i) && !wasBetween(h.c, h.tool, i + 1))
        continue;
      rod.severed[i] = 1;
      emit(h.c, threadEvent(h.c, EventKind::Cut, h.tool, i));
    }
  }
}

}  // namespace

void handleThreads(Context& c) {
  if (!c.scratch.threads) return;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    ThreadGrip& grip = c.state.threads.grips[t];
    const auto& proxy = c.state.proxies[t];
    const auto& before = c.scratch.proxies_before[t].pose;
    const Hand hand{c,
                    t,
                    tools::toolGeometry(proxy.tool),
                    {before.orientation.toRotationMatrix(), before.tip},
                    proxy.pose.jaw};
    if (proxy.present && proxy.tool == tools::ToolKind::Scissors) snip(hand);
    if (!proxy.present || !interaction::hasJaws(proxy.tool)) {
      letGo(hand, grip);
    } else if (!grip.active) {
      seek(hand, grip);
    } else {
      grip.pinch = interaction::pinchForce(proxy.pose.jaw, grip.jaw_at_touch);
      if (proxy.pose.jaw > (1.0 - interaction::kReleaseClosure) * grip.jaw_at_touch)
        letGo(hand, grip);
      else
        slip(hand, grip);
    }
  }
}

}  // namespace vest::scene
