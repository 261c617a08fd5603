#include <algorithm>
#include <cmath>
#include <limits>

#include "../scene/stages.h"
#include "vest_tissue/interaction/suspension.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::Grasp;
using interaction::HungKnot;
using interaction::Suspension;

constexpr std::uint8_t kStitch = 3;  ///< vest_msgs/TissueAttachment STITCH

/// m: from a knot to its place.
Vector3d offOf(const WorldState& state, const HungKnot& h) {
  return h.place - knotPosition(state.objects[h.object], h.knot);
}

/// A contact triangle at the first knot that hangs; the first one where it is on none.
std::uint32_t elementOf(const ObjectState& s, std::uint32_t knot, std::array<double, 4>& weights) {
  weights = {};
  for (std::size_t t = 0; t < s.triangles.size(); ++t)
    for (std::size_t e = 0; e < 3; ++e)
      if (s.triangle_alive[t] && s.triangles[t][e] == knot) {
        weights[e] = 1.0;
        return static_cast<std::uint32_t>(t);
      }
  return 0;
}

double stationOf(const WorldModel& model, const WorldState& state, const HungKnot& h) {
  return stationOf(model, state, h.object, {h.knot, h.knot, h.knot}, {1.0, 0.0, 0.0});
}

void tell(Context& c, EventKind kind, const Suspension& s, int instrument, double force) {
  const HungKnot& first = s.knots[0];
  Event e = eventOf(c, kind, instrument, first.object, 0);
  e.element = elementOf(c.state.objects[first.object], first.knot, e.barycentric);
  e.position = knotPosition(c.state.objects[first.object], first.knot);
  e.station = stationOf(c.model, c.state, first);
  e.area = std::numeric_limits<double>::quiet_NaN();
  e.force = force;
  emit(c, e);
}

void hang(Context& c, const Grasp& grasp, int tool) {
  auto& all = c.state.suspensions.all;
  const auto free = std::find_if(all.begin(), all.end(), [](const Suspension& s) { return !s.alive; });
  if (free == all.end()) {
    c.report.status = Status::Degraded;
    return;
  }
  *free = Suspension{};
  free->id = c.state.next_attachment++;
  free->alive = true;
  free->instrument = static_cast<std::int8_t>(tool);
  free->count = grasp.count;
  for (int i = 0; i < grasp.count; ++i) {
    const interaction::GraspAnchor& a = grasp.anchors[static_cast<std::size_t>(i)];
    HungKnot& h = free->knots[static_cast<std::size_t>(i)];
    h.object = a.object, h.knot = a.knot;
    h.place = knotPosition(c.state.objects[a.object], a.knot);  // no force at that moment
    stiffen(c, h);
  }
  tell(c, EventKind::Suspended, *free, tool, 0.0);
}

/// What its springs had stored is lost.
void letGo(Context& c, Suspension& s, EventKind kind, int tool, double force) {
  tell(c, kind, s, tool, force);
  for (std::int32_t i = 0; i < s.count; ++i) {
    const HungKnot& h = s.knots[static_cast<std::size_t>(i)];
    c.state.energy.dissipated += 0.5 * h.stiffness * offOf(c.state, h).squaredNorm();
  }
  s = Suspension{};
}

bool holdsSome(const Grasp& grasp, const Suspension& s) {
  for (int i = 0; i < grasp.count; ++i)
    for (std::int32_t n = 0; n < s.count; ++n) {
      const interaction::GraspAnchor& a = grasp.anchors[static_cast<std::size_t>(i)];
      const HungKnot& h = s.knots[static_cast<std::size_t>(n)];
      if (a.object == h.object && a.knot == h.knot) return true;
    }
  return false;
}

/// The control was pressed with tissue in the jaws.
void press(Context& c, int tool) {
  const Grasp& grasp = c.state.grasps[static_cast<std::size_t>(tool)];
  bool taken = false;
  for (Suspension& s : c.state.suspensions.all) {
    if (!s.alive || !holdsSome(grasp, s)) continue;
    letGo(c, s, EventKind::Unsuspended, tool, std::sqrt(s.force.squaredNorm()));
    taken = true;
  }
  if (!taken) hang(c, grasp, tool);
}

/// Springs of this step, or the end of it.
void pull(Context& c, Suspension& s) {
  s.force.setZero();
  for (std::int32_t i = 0; i < s.count; ++i) {
    HungKnot& h = s.knots[static_cast<std::size_t>(i)];
    const Vector3d off = offOf(c.state, h);
    const double before = h.stiffness;
    stiffen(c, h);  // what a cut has taken from a knot its hold loses with it
    c.state.energy.dissipated += 0.5 * (before - h.stiffness) * off.squaredNorm();
    s.force += h.stiffness * off;
  }
  const double force = std::sqrt(s.force.squaredNorm());
  if (force > interaction::kSuspensionStrength) {
    letGo(c, s, EventKind::TornOut, -1, force);
    return;
  }
  for (std::int32_t i = 0; i < s.count; ++i) {
    const HungKnot& h = s.knots[static_cast<std::size_t>(i)];
    contact::Pull pull{};
    pull.knot = h.knot;
    for (int e = 0; e < 3; ++e) pull.start[e] = static_cast<float>(h.place[e]);
    pull.stiffness = static_cast<float>(h.stiffness);
    pull.damping = static_cast<float>(h.damping);
    pull.tool = contact::kNoTool;
    auto& pulls = c.scratch.objects[h.object].pulls;
    if (pulls.size() < pulls.capacity()) pulls.push_back(pull);
  }
}

}  // namespace

void suspend(Context& c) {
  interaction::Suspensions& s = c.state.suspensions;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const ToolInput& input = c.input.tools[t];
    const bool down = input.present && (input.functions & tools::kFunctionSuspend) != 0,
               pressed = down && !s.pressed[t];
    s.pressed[t] = down;
    if (pressed && c.state.grasps[t].active && interaction::hasJaws(c.state.proxies[t].tool)) press(c, t);
  }
  for (Suspension& each : s.all)
    if (each.alive) pull(c, each);
}

void addSuspensions(const WorldModel& model, const WorldState& state, std::vector<Attachment>& out) {
  for (const Suspension& s : state.suspensions.all) {
    if (!s.alive) continue;
    const HungKnot& first = s.knots[0];
    Attachment a;
    a.id = s.id;
    a.kind = kStitch;
    a.anchor.object = first.object;
    a.anchor.knots = {first.knot, first.knot, first.knot, first.knot};
    a.anchor.weights = {1, 0, 0, 0};
    a.pose.translation() = interaction::middleOf(s);
    a.station = stationOf(model, state, first);
    out.push_back(a);
  }
}

void drawSuspension(const WorldState& state, const Suspension& s, SuspensionView& view) {
  view.id = s.id;
  view.tissue.setZero();
  view.force.setZero();
  for (std::int32_t i = 0; i < s.count; ++i) {
    const HungKnot& h = s.knots[static_cast<std::size_t>(i)];
    view.tissue += knotPosition(state.objects[h.object], h.knot) / s.count;
    view.force += h.stiffness * offOf(state, h);
  }
  view.wall = view.tissue + interaction::kSuspensionRise * Vector3d::UnitZ();
}

Vector3d suspensionForce(const WorldState& state, std::size_t object) {
  Vector3d sum = Vector3d::Zero();
  for (const Suspension& s : state.suspensions.all)
    for (std::int32_t i = 0; i < s.count; ++i) {
      const HungKnot& h = s.knots[static_cast<std::size_t>(i)];
      if (h.object != object) continue;
      sum += h.stiffness * offOf(state, h) - h.damping * knotVelocity(state.objects[object], h.knot);
    }
  return sum;
}

double suspensionEnergy(const WorldState& state) {
  double sum = 0.0;
  for (const Suspension& s : state.suspensions.all)
    for (std::int32_t i = 0; i < s.count; ++i) {
      const HungKnot& h = s.knots[static_cast<std::size_t>(i)];
      sum += 0.5 * h.stiffness * offOf(state, h).squaredNorm();
    }
  return sum;
}

}  // namespace vest::scene
