#include <algorithm>
#include <cmath>
#include <limits>

#include "../scene/between_jaws.h"
#include "vest_tissue/interaction/suction.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::Grasp;
using interaction::GraspAnchor;

constexpr double kFillTolerance =
    0.03;  ///< rad: the tissue fills the gap when it comes this near to the jaws

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

/// Above a limit the held points slide until the pull is what the hold carries. @return N, the pull; 0:
/// within it
double slide(Context& c, Grasp& grasp, double limit, const JawFrame& frame) {
  Vector3d pull = Vector3d::Zero();
  for (int i = 0; i < grasp.count; ++i) {
    const GraspAnchor& a = grasp.anchors[i];
    pull += a.stiffness * (frame.world(a.local) - knotPosition(c.state.objects[a.object], a.knot));
  }
  const double force = std::sqrt(pull.squaredNorm());
  if (!(force > limit)) return 0.0;
  const double keep = limit / force;
  for (int i = 0; i < grasp.count; ++i) {
    GraspAnchor& a = grasp.anchors[i];
    const Vector3d at = frame.local(knotPosition(c.state.objects[a.object], a.knot));
    c.state.energy.dissipated += 0.5 * a.stiffness * (1.0 - keep * keep) * (a.local - at).squaredNorm();
    a.local = at + keep * (a.local - at);
  }
  return force;
}

/// The first anchor stands for the grasp: its triangle is one of that anchor's object, at its knot.
void keepElement(const Context& c, Grasp& grasp) {
  const GraspAnchor& first = grasp.anchors[0];
  const auto& triangles = c.state.objects[first.object].triangles;
  grasp.element = 0, grasp.barycentric = {1.0, 0.0, 0.0, 0.0};
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t e = 0; e < 3; ++e)
      if (triangles[t][e] == first.knot) {
        grasp.element = static_cast<std::uint32_t>(t), grasp.barycentric = {};
        grasp.barycentric[e] = 1.0;
        return;
      }
}

/// Coulomb's limit of the hold.
void slip(Context& c, Grasp& grasp, const tools::ToolGeometry& g, const JawFrame& frame, int tool) {
  const double force = slide(c, grasp, interaction::kHoldPerPinch * grasp.pinch, frame);
  if (force > 0.0 && !grasp.sliding) {
    Event e = eventOf(c, grasp, EventKind::Slipped, tool);
    e.force = force;
    emit(c, e);
  }
  grasp.sliding = force > 0.0;
  // Points that left the jaws are no longer held. A knot may stand out by the length of a triangle.
  const std::uint16_t object = grasp.anchors[0].object;
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
  if (grasp.anchors[0].object != object) keepElement(c, grasp);
}

/// Tissue nearest to a sucker's mouth.
struct AtMouth {
  double distance = interaction::kSuctionGap;  ///< m; as much: none is so near
  std::size_t object = 0, triangle = 0;
  std::array<double, 3> weights{};
};
AtMouth atMouth(const Context& c, const Vector3d& mouth) {
  AtMouth found;
  for (const std::size_t object : c.model.bodies) {
    const ObjectState& s = c.state.objects[object];
    const ObjectScratch& o = c.scratch.objects[object];
    const double thickness = c.model.description.objects[object].contact_thickness;
    bool apart = false;
    for (int e = 0; e < 3; ++e)
      apart = apart || mouth[e] - found.distance - thickness > o.high[e] ||
              mouth[e] + found.distance + thickness < o.low[e];
    if (apart) continue;
    const double reach = found.distance + thickness + c.model.objects[object].greatest_edge;
    for (std::size_t t = 0; t < s.triangles.size(); ++t) {
      const auto& k = s.triangles[t];
      const Vector3d p = knotPosition(s, k[0]);
      if ((p - mouth).squaredNorm() > reach * reach || !s.triangle_alive[t]) continue;
      const contact::Nearest n = contact::nearest(mouth, {p, knotPosition(s, k[1]), knotPosition(s, k[2])});
      if (n.distance - thickness < found.distance) found = {n.distance - thickness, object, t, n.weights};
    }
  }
  return found;
}

/// Tissue that a sucker touches with its mouth is drawn onto it, and pulled off where the vacuum holds no
/// more.
void drawTissue(Context& c, Grasp& grasp, const Vector3d& mouth, const JawFrame& frame, int tool) {
  const AtMouth at = atMouth(c, mouth);
  if (grasp.active) {
    if (at.distance >= interaction::kSuctionGap) {
      letGo(c, grasp, tool);
    } else {
      grasp.pinch = interaction::kSuctionForce;
      soften(c, grasp, frame);
      grasp.sliding = slide(c, grasp, grasp.pinch, frame) > 0.0;
    }
    return;
  }
  if (!(at.distance <= interaction::kSuctionSeal)) return;
  grasp.count = 0;
  grasp.element = static_cast<std::uint32_t>(at.triangle);
  grasp.barycentric = {at.weights[0], at.weights[1], at.weights[2], 0.0};
  for (const std::uint32_t knot : c.state.objects[at.object].triangles[at.triangle])
    addAnchor(c, grasp, frame, at.object, knot);
  grasp.active = true;
  grasp.sliding = false;
  grasp.id = c.state.next_attachment++;
  grasp.pinch = interaction::kSuctionForce;
  emit(c, eventOf(c, grasp, EventKind::Grasped, tool));
}

}  // namespace

void interact(Context& c) {
  for (std::size_t object = 0; object < c.scratch.objects.size(); ++object)
    c.scratch.objects[object].pulls.clear();
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    Grasp& grasp = c.state.grasps[t];
    const auto& proxy = c.state.proxies[t];
    const bool jaws = proxy.present && interaction::hasJaws(proxy.tool),
               draws = proxy.present && interaction::draws(proxy.tool, c.input.tools[t].functions);
    if (!jaws && !draws) {
      if (grasp.active) letGo(c, grasp, t);
      for (auto& pass : c.state.jaws_pass) setBit(pass, t, false);
      continue;
    }
    const auto& g = tools::toolGeometry(proxy.tool);
    const auto& before = c.scratch.proxies_before[t].pose;
    const JawFrame frame{before.orientation.toRotationMatrix(), before.tip};
    if (draws) {
      drawTissue(c, grasp, frame.world(Vector3d(0, 0, g.shaft_radius)), frame, t);
    } else if (!grasp.active) {
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
