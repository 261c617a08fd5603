#include <algorithm>
#include <cmath>
#include <limits>

#include "../suture/contacts.h"
#include "../suture/elements.h"
#include "between_jaws.h"
#include "channels.h"
#include "loops.h"
#include "stages.h"
#include "vest_tissue/scene/cavity_walls.h"

/// Threads and the rest of the World: each part of a step the rods move against what they touch where it will
/// be, and what they do to it is held over that part, the same impulse on both sides.
namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::TouchKind;
using suture::Support;

constexpr double kRigid = 2000.0;      ///< N/m: a node on what does not give way (tuned)
constexpr double kTool = 1000.0;       ///< N/m: a segment on an instrument,
constexpr double kTools = 15000.0;     ///< and all of them: 0.3 of a proxy's mass over a step of 1 ms squared
constexpr double kNeedleFelt = 500.0;  ///< N/m: a held needle against tissue, about (tuned)
constexpr double kJawFriction = 0.4;   ///< serrated jaws, blades; assumed
constexpr double kSteel = 0.15;        ///< thread on a shaft; assumed
/// What a held force may be as stiff as, times the compliance of free knots over the time that it is held:
/// with less than three, what is explicit on one side feeds energy.
constexpr double kHeldShare = 3.0;
/// Of a needle's point: it slides only where it comes flatter than what may puncture (0.3 to the face);
/// assumed
constexpr double kPointFriction = 3.0;
constexpr std::uint64_t kKnotEvery = 100;  ///< steps between two looks at knots
constexpr double kDrawn = 0.5;  ///< N with which a thread presses on itself in a knot that is drawn; assumed
constexpr double kPressing = 2e-4;  ///< m: a touch that is nearer shares its knots' stiffness with others

/// What one part of a step works on.
struct Part {
  Context& c;
  ThreadScratch& w;
  double from, to, h;  ///< of the step; s
  const suture::Model& model() const { return *c.model.threads.rods; }
  const suture::State& rod() const { return c.state.threads.rod; }
};

void atPlace(const Part& p, std::uint32_t place, Support& a) {
  const ThreadPlace& at = p.c.model.threads.places[place];
  a.segment = at.segment, a.s = at.s, a.rigid = at.rigid, a.arm = at.arm;
}
Vector3d placeNow(const Part& p, std::uint32_t place) {
  return p.c.model.threads.at(p.rod(), place);
}
/// On an object that is not an instrument.
double frictionOn(const Part& p, std::uint32_t place, std::size_t object) {
  const ThreadModel& m = p.c.model.threads;
  return std::max(p.c.model.description.objects[object].friction, m.friction[m.places[place].strand]);
}
double radiusOf(const Part& p, std::uint32_t place) {
  return p.c.model.threads.places[place].radius;
}

/// kg that a place moves: its node's, or a point's share of its needle.
double massAt(const Part& p, std::uint32_t place) {
  const ThreadPlace& at = p.c.model.threads.places[place];
  if (!at.rigid) return p.model().mass[place];
  const auto& needle = p.model().needles[p.model().strands[at.strand].needle];
  return p.model().mass[at.segment] / static_cast<double>(needle.points.size());
}

/// @return whether it presses already
bool leanOnTissue(const Part& p, const ThreadReach& r, Support& a, ThreadPush& push) {
  const ObjectState& s = p.c.state.objects[r.touch.body];
  const Object& described = p.c.model.description.objects[r.touch.body];
  const std::uint32_t node = r.touch.segment;
  const auto& k = s.triangles[r.triangle];
  const std::array<Vector3d, 3> x{knotPosition(s, k[0]), knotPosition(s, k[1]), knotPosition(s, k[2])};
  const Vector3d at = placeNow(p, node);
  const contact::Nearest n = contact::nearest(at, x);
  a.from = a.to = Vector3d::Zero();
  push.object = r.touch.body, push.knots = k;
  for (std::size_t e = 0; e < 3; ++e) {
    push.weights[e] = static_cast<float>(n.weights[e]);
    a.from += n.weights[e] * x[e];
    a.to += n.weights[e] * (x[e] + p.h * knotVelocity(s, k[e]));
  }
  Vector3d face = (x[1] - x[0]).cross(x[2] - x[0]);
  face *= r.touch.side / std::max(1e-30, std::sqrt(face.squaredNorm()));
  const Vector3d off = at - a.from;
  a.normal = n.distance > 1e-7 ? Vector3d(off / n.distance) : face;
  // Behind it: the node has gone in. Behind the edge of an open surface it may have come round.
  const bool inside = p.c.model.objects[r.touch.body].closed ||
                      (n.weights[0] > 1e-6 && n.weights[1] > 1e-6 && n.weights[2] > 1e-6);
  if (face.dot(a.normal) < -0.2 && inside) a.normal = -a.normal;
  a.reach = radiusOf(p, node) + described.contact_thickness;
  atPlace(p, node, a);
  const ThreadPlace& place = p.c.model.threads.places[node];
  a.friction = place.rigid && place.station <= 0.0 ? kPointFriction : frictionOn(p, node, r.touch.body);
  return a.normal.dot(off) < a.reach + kPressing;
}

void leanOnCapsule(const Part& p, ThreadReach& r, Support& a) {
  const std::uint32_t i = r.touch.segment;
  const int t = r.touch.body;
  const auto &then = p.c.scratch.capsules_before[t][r.touch.part],
             &now = p.c.scratch.capsules_after[t][r.touch.part];
  const auto at = [&](const Vector3d& b, const Vector3d& e, double f) { return Vector3d(b + f * (e - b)); };
  const Vector3d a0 = at(then.a, now.a, p.from), b0 = at(then.b, now.b, p.from);
  const Vector3d x = placeNow(p, i), along = placeNow(p, i + 1) - x;
  const suture::Closest k = suture::closest(x, along, a0, b0 - a0, false);
  atPlace(p, i, a);
  a.s = k.s;
  if (a.rigid) a.arm += k.s * (p.c.model.threads.places[i + 1].arm - a.arm);
  a.from = a0 + k.t * (b0 - a0);
  const Vector3d a1 = at(then.a, now.a, p.to), b1 = at(then.b, now.b, p.to);
  a.to = a1 + k.t * (b1 - a1);
  const double distance = std::sqrt(k.between.squaredNorm());
  a.normal = distance > 1e-7 ? Vector3d(k.between / distance) : Vector3d::UnitZ();
  if (r.touch.normal.dot(a.normal) < 0.0) a.normal = -a.normal;  // it has gone through the axis
  r.touch.normal = a.normal;
  a.reach = radiusOf(p, i) + now.radius;
  a.friction = kSteel;
  a.stiffness = kTool;
}

/// Nodes in jaws hang from them.
void hang(const Part& p) {
  const auto& grips = p.c.state.threads.grips;
  for (std::size_t t = 0; t < grips.size(); ++t) {
    const auto& g = grips[t];
    if (!g.active) continue;
    const auto &then = p.c.scratch.proxies_before[t].pose, &now = p.c.state.proxies[t].pose;
    for (int k = 0; k < g.count; ++k) {
      Support a;
      a.bond = suture::Bond::Hold;
      const Vector3d start = then.tip + then.orientation * g.nodes[k].local,
                     way = now.tip + now.orientation * g.nodes[k].local - start;
      a.from = start + p.from * way, a.to = start + p.to * way;
      a.stiffness = interaction::kThreadGrip / g.count;
      atPlace(p, g.nodes[k].node, a);
      p.w.rod.supports.push_back(a);
    }
  }
}

/// As stiff as the touched knots bear, which share it.
void shareStiffness(const Part& p, std::size_t first) {
  auto& supports = p.w.rod.supports;
  for (std::size_t k = 0; k < p.w.pushes.size(); ++k) {
    const ThreadPush& push = p.w.pushes[k];
    Support& a = supports[first + k];
    double give = 0.0;
    for (std::size_t e = 0; e < 3; ++e) {
      const double w = push.weights[e], crowd = p.w.crowd[push.object][push.knots[e]];
      give += w * std::max(w, crowd) * contactInverseMass(p.c.state.objects[push.object], push.knots[e]);
      const double far = push.far_weights[e];
      if (far > 0.0)
        give += far * std::max<double>(far, p.w.crowd[push.object][push.far_knots[e]]) *
                contactInverseMass(p.c.state.objects[push.object], push.far_knots[e]);
    }
    a.stiffness = 1.0 / (kHeldShare * p.h * p.h * give + 1.0 / kRigid);
  }
  for (const ThreadPush& push : p.w.pushes)
    for (std::size_t e = 0; e < 3; ++e)
      p.w.crowd[push.object][push.knots[e]] = p.w.crowd[push.object][push.far_knots[e]] = 0.0f;
}

bool onInstrument(const ThreadReach& r) {
  return r.touch.kind == TouchKind::Tool || r.touch.kind == TouchKind::JawFace;
}

/// A touch that is prepared but does not press bears nothing, and takes no share from those that do.
bool pressesTool(const Part& p, const Support& a) {
  const Vector3d at = suture::placeOf(a, strandOf(p.model(), a.segment), p.rod());
  return a.normal.dot(at - a.from) < a.reach + kPressing;
}

void gather(const Part& p) {
  ThreadScratch& w = p.w;
  w.rod.supports.clear();
  w.rod.turns.clear();
  w.pushes.clear();
  // Those on tissue first: push and support have the same number.
  for (ThreadReach& r : w.reaches) {
    r.support = -1;
    if (r.touch.kind != TouchKind::Tissue) continue;
    Support a;
    ThreadPush push;
    a.shear = r.touch.shear;
    const bool presses = leanOnTissue(p, r, a, push);
    for (std::size_t e = 0; presses && e < 3; ++e) w.crowd[push.object][push.knots[e]] += push.weights[e];
    r.support = static_cast<int>(w.rod.supports.size());
    w.rod.supports.push_back(a);
    w.pushes.push_back(push);
  }
  leadChannels(p.c, p.h);
  shareStiffness(p, 0);
  int on_tools[tools::kInstrumentCount] = {};
  for (ThreadReach& r : w.reaches) {
    if (r.touch.kind == TouchKind::Tissue) continue;
    Support a;
    a.shear = r.touch.shear;
    if (r.touch.kind == TouchKind::Tool) {
      leanOnCapsule(p, r, a);
    } else {
      const bool face = r.touch.kind == TouchKind::JawFace;
      const Vector3d normal = r.normal_then + p.to * (r.normal - r.normal_then);
      a.normal = normal / std::sqrt(normal.squaredNorm());
      a.from = r.place_then + p.from * (r.place - r.place_then);
      a.to = r.place_then + p.to * (r.place - r.place_then);
      a.reach = radiusOf(p, r.touch.segment);
      a.friction = face ? kJawFriction : frictionOn(p, r.touch.segment, r.touch.body);
      a.stiffness = face ? kTool : kRigid;
      atPlace(p, r.touch.segment, a);
      if (r.touch.kind == TouchKind::Rigid && r.touch.part == kHangs) {
        const double deep = a.reach - a.normal.dot(placeNow(p, r.touch.segment) - a.from),
                     most = kWallWeighs * massAt(p, r.touch.segment);
        if (a.stiffness * deep > most) a.stiffness = most / deep;
      }
    }
    if (onInstrument(r) && pressesTool(p, a)) ++on_tools[r.touch.body];
    r.support = static_cast<int>(w.rod.supports.size());
    w.rod.supports.push_back(a);
  }
  for (const ThreadReach& r : w.reaches) {
    if (!onInstrument(r)) continue;
    Support& a = w.rod.supports[static_cast<std::size_t>(r.support)];
    a.stiffness = std::min(a.stiffness, kTools / std::max(1, on_tools[r.touch.body]));
  }
  w.hanging = w.rod.supports.size();
  hang(p);
  holdNeedles(p.c, p.from, p.to);
  holdLoops(p.c, p.from, p.to);
}

/// Force of the thread on an instrument at a place.
void onTool(const Part& p, int tool, const Support& a, const Eigen::Matrix3d& stiffness) {
  contact::ToolLoad& load = p.w.loads.tools[static_cast<std::size_t>(tool)];
  const Vector3d impulse = -p.h * a.force, moment = a.to.cross(impulse);
  const double share = p.h / p.c.dt;
  load.touched = true;
  for (int e = 0; e < 3; ++e) {
    load.impulse[e] += impulse[e], load.moment[e] += moment[e];
    load.normal[e] -= a.bond == suture::Bond::Hold ? 0.0 : share * a.normal[e] * a.normal.dot(a.force);
  }
  const double k[6] = {stiffness(0, 0), stiffness(1, 1), stiffness(2, 2),
                       stiffness(0, 1), stiffness(0, 2), stiffness(1, 2)};
  for (int e = 0; e < 6; ++e) load.stiffness[e] += share * k[e];
}

void tellTools(const Part& p) {
  const auto& supports = p.w.rod.supports;
  for (const ThreadReach& r : p.w.reaches) {
    if (!onInstrument(r)) continue;
    const Support& a = supports[static_cast<std::size_t>(r.support)];
    if (a.force.squaredNorm() == 0.0) continue;
    onTool(p, r.touch.body, a, a.stiffness * a.normal * a.normal.transpose());
  }
  std::size_t k = p.w.hanging;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const auto& g = p.c.state.threads.grips[static_cast<std::size_t>(t)];
    for (int n = 0; g.active && n < g.count; ++n, ++k) {
      const Support& a = supports[k];
      // As stiff as the thread between the jaws and its far end, along the pull.
      const suture::Strand& strand = strandOf(p.model(), a.segment);
      double length = 0.0;
      for (std::uint32_t i = strand.threadFirst(); i < strand.first + strand.segments; ++i)
        length += p.model().length[i];
      const double squared = a.force.squaredNorm(),
                   stiffness =
                       1.0 / (g.count * (1.0 / interaction::kThreadGrip + length / strand.section.stretch));
      onTool(p, t, a,
             squared > 0.0 ? Eigen::Matrix3d(stiffness / squared * a.force * a.force.transpose())
                           : Eigen::Matrix3d(Eigen::Matrix3d::Zero()));
    }
  }
  std::size_t turn = 0;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const interaction::NeedleGrip& g = p.c.state.threads.needle_grips[static_cast<std::size_t>(t)];
    if (!g.active) continue;
    onTool(p, t, supports[k++], kNeedleFelt * Eigen::Matrix3d::Identity());
    const Vector3d moment = -p.h * p.w.rod.turns[turn++].moment;
    for (int e = 0; e < 3; ++e) p.w.loads.tools[static_cast<std::size_t>(t)].moment[e] += moment[e];
  }
  k = p.w.pushing;
  for (int t = 0; t < tools::kInstrumentCount; ++t)
    for (std::size_t n = 0; n < p.w.pushed[static_cast<std::size_t>(t)]; ++n, ++k) {
      const Support& a = supports[k];
      if (a.force.squaredNorm() == 0.0) continue;
      onTool(p, t, a, a.stiffness * a.normal * a.normal.transpose());
    }
}

/// N that a segment bears: less where it is bent as sharply as in a knot.
double strengthOf(const ThreadModel& m, const suture::State& s, std::size_t n, std::uint32_t segment,
                  const std::vector<Eigen::Quaterniond>& held) {
  const suture::Strand& strand = m.rods->strands[n];
  const std::uint32_t k = segment - strand.first;
  for (const std::uint32_t j : {k, k + 1}) {  // joints before and behind
    // That at the swage is of the needle.
    if (j < 1 + (strand.needle != suture::kNone ? 1u : 0u) || strand.joints_begin + j > strand.joints_end)
      continue;
    const std::uint32_t joint = strand.joints_begin + j - 1;
    if (suture::bendOf(*m.rods, s, held, joint).head<2>().norm() * 4.0 * strand.section.radius >
        m.rods->joints[joint].length)
      return m.knot_strength[n];
  }
  return m.strength[n];
}

/// At most one segment of each thread breaks in a step: that which is pulled furthest beyond its strength. It
/// has to be so where the step's last part begins, too: passes that did not settle leave tensions of tens of
/// newtons in a slack thread that whips, gone with the next.
void breakThreads(Context& c) {
  const ThreadModel& m = c.model.threads;
  suture::State& s = c.state.threads.rod;
  const suture::State& then = c.scratch.threads->rod.backup;
  for (std::size_t n = 0; n < m.rods->strands.size(); ++n) {
    const suture::Strand& strand = m.rods->strands[n];
    double most = 1.0, force = 0.0;
    std::uint32_t weakest = suture::kNone;
    for (std::uint32_t i = strand.first; i < strand.first + strand.segments; ++i) {
      const double tension =
          std::min(suture::tensionOf(*m.rods, s, strand, i), suture::tensionOf(*m.rods, then, strand, i));
      if (i < strand.threadFirst()) {  // the swage
        most = tension / m.rods->needles[strand.needle].swage;
        if (most > 1.0) weakest = i, force = tension;
        most = std::max(most, 1.0);
        continue;
      }
      if (!(tension > m.knot_strength[n])) continue;
      const double load = tension / strengthOf(m, s, n, i, c.scratch.threads->rod.held_frame);
      if (load > most) most = load, weakest = i, force = tension;
    }
    if (weakest == suture::kNone) continue;
    s.severed[weakest] = 1;
    Event e = threadEvent(c, EventKind::Torn, -1, weakest);
    e.force = force;
    emit(c, e);
  }
}

/// What was cut counts as the part that is knotted most. Determinant 0: too tangled to be told.
suture::KnotKind kindOf(const suture::State& s, const suture::Strand& strand, suture::KnotScratch& w) {
  suture::KnotKind most;
  bool told = true;
  suture::eachPart(strand, s, [&](suture::Index first, suture::Index count) {
    const suture::KnotKind kind = suture::kindOf(&s.position[first], count, w);
    told = told && kind.determinant != 0;
    if (kind.determinant > most.determinant) most = kind;
  });
  return told ? most : suture::KnotKind{0, 0};
}

/// A knot that is drawn is told once: when its thread presses on itself.
void tellKnots(Context& c) {
  if (c.state.step % kKnotEvery != 0) return;
  const suture::State& s = c.state.threads.rod;
  for (std::size_t n = 0; n < c.state.threads.knots.size(); ++n) {
    const suture::Strand& strand = c.model.threads.rods->strands[n];
    if (strand.closed || inPusher(c, n)) continue;
    interaction::KnotWatch& watch = c.state.threads.knots[n];
    const suture::KnotKind seen = kindOf(s, strand, c.scratch.threads->knots);
    if (seen.determinant == 0) continue;
    if (!(seen == watch.kind) && seen == watch.seen) watch.kind = seen, watch.drawn = false;
    watch.seen = seen;
    if (watch.drawn || watch.kind.determinant == 1 || !(watch.kind == seen)) continue;
    const auto within = [&strand](std::uint32_t i) { return i - strand.first < strand.nodes; };
    double press = 0.0, most = 0.0;
    std::uint32_t node = strand.threadFirst();
    for (std::uint32_t i = 0; i < s.contact_count; ++i) {
      const suture::LiveContact& contact = s.contacts[i];
      if (!within(contact.a) || !within(contact.b)) continue;
      const double force = std::sqrt(contact.force.squaredNorm());
      press += force;
      if (force > most) most = force, node = contact.a;
    }
    if (!(press > kDrawn)) continue;
    watch.drawn = true;
    Event e = threadEvent(c, EventKind::KnotTied, -1, node);
    e.force = press;
    emit(c, e);
  }
}

}  // namespace

Event threadEvent(const Context& c, EventKind kind, int tool, std::uint32_t node) {
  const suture::Strand& strand = strandOf(*c.model.threads.rods, node);
  Event e;
  e.kind = kind;
  e.step = c.state.step;
  e.instrument = static_cast<std::int8_t>(tool);
  const std::size_t number = static_cast<std::size_t>(&strand - c.model.threads.rods->strands.data());
  e.object = static_cast<std::uint16_t>(c.model.objects.size() + number);
  e.element = node - std::min(node, strand.threadFirst());
  e.position = c.state.threads.rod.position[node];
  e.station = e.area = std::numeric_limits<double>::quiet_NaN();
  return e;
}

void stepThreads(Context& c, int part) {
  ThreadScratch& w = *c.scratch.threads;
  if (w.faulty) return;
  const int parts = w.parts * c.stretch;
  const Part p{c, w, static_cast<double>(part) / parts, static_cast<double>(part + 1) / parts, c.dt / parts};
  if (part == 0) w.loads = contact::ObjectLoads{};
  gather(p);
  w.rod.gravity = c.state.gravity;
  const suture::StepStatus status = suture::step(*c.model.threads.rods, c.state.threads.rod, w.rod, p.h);
  w.faulty = status == suture::StepStatus::Fault;
  w.full = w.full || status == suture::StepStatus::Degraded;
  if (w.faulty) {
    w.pushes.clear();
    return;
  }
  for (std::size_t k = 0; k < w.pushes.size(); ++k) w.pushes[k].force = -w.rod.supports[k].force;
  for (ThreadReach& r : w.reaches) r.touch.shear = w.rod.supports[static_cast<std::size_t>(r.support)].shear;
  settleChannels(c);
  tellTools(p);
}

bool settleThreads(Context& c, std::string_view& faulty) {
  if (!c.scratch.threads) return true;
  ThreadScratch& w = *c.scratch.threads;
  const suture::State& rod = c.state.threads.rod;
  bool good = !w.faulty;
  for (const Vector3d& v : rod.velocity) good = good && v.squaredNorm() < 1e6;  // m²/s², absurd
  for (const Vector3d& x : rod.position) good = good && x.squaredNorm() < 1e6;
  if (!good) {
    faulty = c.model.description.sutures[0].rod.name;
    return false;
  }
  auto& touches = c.state.threads.touches;
  touches.clear();
  for (const ThreadReach& r : w.reaches)
    if (touches.size() < c.model.threads.room()) touches.push_back(r.touch);
  std::sort(touches.begin(), touches.end(),
            [](const auto& a, const auto& b) { return interaction::before(a, b); });
  breakThreads(c);
  advanceChannels(c);
  tellKnots(c);
  return true;
}

}  // namespace vest::scene
