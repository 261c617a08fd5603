#include <algorithm>
#include <cmath>
#include <limits>

#include "../scene/between_jaws.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::Grasp;
using interaction::GraspAnchor;
using net::Block;

constexpr double kFillTolerance =
    0.03;  ///< rad: the tissue fills the gap when it comes this near to the jaws

/// As stiff as the knot's mass bears beside the object's own links.
void stiffen(const Context& c, GraspAnchor& a) {
  const double mass = row(c.state.objects[a.object], Block::kMass)[a.knot],
               omega2 = c.model.objects[a.object].contact_omega_squared;
  a.stiffness = mass * omega2;
  a.damping = 0.6 * mass * std::sqrt(omega2);
}

/// What a cut has taken from a knot its hold loses with it.
void soften(Context& c, Grasp& grasp, const JawFrame& frame) {
  for (int i = 0; i < grasp.count; ++i) {
    GraspAnchor& a = grasp.anchors[i];
    const double before = a.stiffness;
    stiffen(c, a);
    if (a.stiffness == before) continue;
    const Vector3d off = frame.world(a.local) - knotPosition(c.state.objects[a.object], a.knot);
    c.state.energy.dissipated += 0.5 * (before - a.stiffness) * off.squaredNorm();
  }
}

void addAnchor(Context& c, Grasp& grasp, const JawFrame& frame, std::size_t object, std::uint32_t knot) {
  for (int i = 0; i < grasp.count; ++i) {
    if (grasp.anchors[i].object == object && grasp.anchors[i].knot == knot) return;
  }
  if (grasp.count >= interaction::kMaxGraspAnchors) return;
  const ObjectState& s = c.state.objects[object];
  GraspAnchor& a = grasp.anchors[grasp.count++];
  a.object = static_cast<std::uint16_t>(object);
  a.knot = knot;
  a.local = frame.local(knotPosition(s, knot));  // no force at the moment of grasp
  stiffen(c, a);
}

Event eventOf(const Context& c, const Grasp& grasp, EventKind kind, int tool) {
  Event e = eventOf(c, kind, tool, grasp.anchors[0].object, grasp.element);
  e.barycentric = grasp.barycentric;
  e.position = knotPosition(c.state.objects[e.object], grasp.anchors[0].knot);
  e.station = stationOf(c.model, c.state, e.object, c.state.objects[e.object].triangles[e.element],
                        {e.barycentric[0], e.barycentric[1], e.barycentric[2]});
  e.area = std::numeric_limits<double>::quiet_NaN();
  e.force = grasp.pinch;
  return e;
}

void letGo(Context& c, Grasp& grasp, int tool) {
  emit(c, eventOf(c, grasp, EventKind::Released, tool));
  grasp.active = false;
  grasp.sliding = false;
  grasp.count = 0;
  grasp.pinch = 0.0;
  grasp.jaw_at_touch = 0.0;
}

void seek(Context& c, Grasp& grasp, const tools::ToolGeometry& g, const JawFrame& frame, int tool) {
  const double jaw = c.state.proxies[tool].pose.jaw;
  double most = 0.0;
  for (ObjectScratch& o : c.scratch.objects) o.between = false;
  eachBetween(c, g, frame, jaw + kFillTolerance + 0.05,
              [&](std::size_t object, std::size_t, const double*, double at) {
                most = std::max(most, at);
                c.scratch.objects[object].between = true;
              });
  for (std::size_t object = 0; object < c.scratch.objects.size(); ++object)  // what left the jaws is pushed
    if (!c.scratch.objects[object].between) setBit(c.state.jaws_pass[object], tool, false);
  if (most <= 0.0) {
    grasp.jaw_at_touch = 0.0;
    return;
  }
  if (most >= jaw - kFillTolerance) grasp.jaw_at_touch = std::max(grasp.jaw_at_touch, jaw);
  if (grasp.jaw_at_touch <= 0.0 || jaw > (1.0 - interaction::kGraspClosure) * grasp.jaw_at_touch) return;
  // Which tissue: knots between the jaws, and the corners of triangles of which a part is between them.
  grasp.count = 0;
  eachBetween(c, g, frame, grasp.jaw_at_touch + kFillTolerance,
              [&](std::size_t object, std::size_t t, const double* w, double) {
                if (grasp.count == 0) {
                  grasp.element = static_cast<std::uint32_t>(t);
                  grasp.barycentric = {w[0], w[1], w[2], 0.0};
                }
                for (int e = 0; e < 3; ++e) {
                  if (w[e] > 0.0) addAnchor(c, grasp, frame, object, c.state.objects[object].triangles[t][e]);
                }
              });
  if (grasp.count == 0) return;
  grasp.active = true;
  grasp.sliding = false;
  grasp.id = c.state.next_attachment++;
  grasp.pinch = interaction::pinchForce(jaw, grasp.jaw_at_touch);
  for (int i = 0; i < grasp.count; ++i) setBit(c.state.jaws_pass[grasp.anchors[i].object], tool, true);
  emit(c, eventOf(c, grasp, EventKind::Grasped, tool));
}

/// Coulomb's limit of the hold: above it the held points slide in the jaws until the pull is what the pinch
/// carries.
void slip(Context& c, Grasp& grasp, const tools::ToolGeometry& g, const JawFrame& frame, int tool) {
  Vector3d pull = Vector3d::Zero();
  for (int i = 0; i < grasp.count; ++i) {
    const GraspAnchor& a = grasp.anchors[i];
    pull += a.stiffness * (frame.world(a.local) - knotPosition(c.state.objects[a.object], a.knot));
  }
  const double limit = interaction::kHoldPerPinch * grasp.pinch, force = std::sqrt(pull.squaredNorm());
  const bool sliding = force > limit;
  if (sliding) {
    const double keep = limit / force;
    for (int i = 0; i < grasp.count; ++i) {
      GraspAnchor& a = grasp.anchors[i];
      const Vector3d at = frame.local(knotPosition(c.state.objects[a.object], a.knot));
      c.state.energy.dissipated += 0.5 * a.stiffness * (1.0 - keep * keep) * (a.local - at).squaredNorm();
      a.local = at + keep * (a.local - at);
    }
    if (!grasp.sliding) {
      Event e = eventOf(c, grasp, EventKind::Slipped, tool);
      e.force = force;
      emit(c, e);
    }
  }
  grasp.sliding = sliding;
  // Points that left the jaws are no longer held. A knot may stand out by the length of a triangle.
  int kept = 0;
  for (int i = 0; i < grasp.count; ++i) {
    const GraspAnchor a = grasp.anchors[i];
    const double out = c.model.objects[a.object].greatest_edge;
    const bool inside = a.local.z() < out && a.local.z() > -g.jaw_length - out &&
                        std::fabs(a.local.y()) < out + 0.005 && std::fabs(a.local.x()) < out + 0.010;
    if (inside) grasp.anchors[kept++] = a;
  }
  if (kept == 0) {
    letGo(c, grasp, tool);  // the first anchor is still in place for the event
    return;
  }
  grasp.count = kept;
}

}  // namespace

void interact(Context& c) {
  for (std::size_t object = 0; object < c.scratch.objects.size(); ++object)
    c.scratch.objects[object].pulls.clear();
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    Grasp& grasp = c.state.grasps[t];
    const auto& proxy = c.state.proxies[t];
    if (!proxy.present || !interaction::hasJaws(proxy.tool)) {
      if (grasp.active) letGo(c, grasp, t);
      for (auto& pass : c.state.jaws_pass) setBit(pass, t, false);
      continue;
    }
    const auto& g = tools::toolGeometry(proxy.tool);
    const auto& before = c.scratch.proxies_before[t].pose;
    const JawFrame frame{before.orientation.toRotationMatrix(), before.tip};
    if (!grasp.active) {
      seek(c, grasp, g, frame, t);
    } else {
      grasp.pinch = interaction::pinchForce(proxy.pose.jaw, grasp.jaw_at_touch);
      if (proxy.pose.jaw > (1.0 - interaction::kReleaseClosure) * grasp.jaw_at_touch) {
        letGo(c, grasp, t);
      } else {
        soften(c, grasp, frame);
        slip(c, grasp, g, frame, t);
      }
    }
    if (!grasp.active) continue;
    const JawFrame after{proxy.pose.orientation.toRotationMatrix(), proxy.pose.tip};
    for (int i = 0; i < grasp.count; ++i) {
      const GraspAnchor& a = grasp.anchors[i];
      contact::Pull pull{};
      pull.knot = a.knot;
      const Vector3d start = frame.world(a.local), travel = after.world(a.local) - start;
      for (int e = 0; e < 3; ++e)
        pull.start[e] = static_cast<float>(start[e]), pull.travel[e] = static_cast<float>(travel[e]);
      pull.stiffness = static_cast<float>(a.stiffness);
      pull.damping = static_cast<float>(a.damping);
      pull.tool = static_cast<std::uint8_t>(t);
      pull.anchor = static_cast<std::uint8_t>(i);
      auto& pulls = c.scratch.objects[a.object].pulls;
      if (pulls.size() < pulls.capacity()) pulls.push_back(pull);
    }
  }
}

}  // namespace vest::scene
