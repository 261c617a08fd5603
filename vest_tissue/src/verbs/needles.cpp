#include <algorithm>
#include <cmath>

#include "../scene/between_jaws.h"
#include "../scene/channels.h"

/// Jaws on needles: they hold a place and a direction until force or moment is too much.
namespace vest::scene {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using interaction::NeedleGrip;

constexpr double kWireFill = 0.03;  ///< rad: a needle fills the gap when it comes this near to the jaws
constexpr double kTurning = 2.0;    ///< N·m/rad: jaws against turning; at a tip 16 mm away 8 N/mm (tuned)
/// m: moment that jaws bear over their pinch. Laparoscopic holders let a needle turn at 0.74 N (Cartmill,
/// mean) at full closure; 12 mm of lever are assumed, and half of that for jaws without carbide inserts.
constexpr double kMomentPerPinch = 0.74 * 0.012 / interaction::kGreatestPinch;

struct Holder {
  Context& c;
  int tool;
  const tools::ToolGeometry& g;
  JawFrame frame;
  Quaterniond orientation;
  double jaw;  ///< rad
};

void letGo(const Holder& h, NeedleGrip& grip) {
  if (grip.active)
    emit(h.c,
         threadEvent(h.c, EventKind::Released, h.tool, h.c.model.threads.rods->needles[grip.needle].node));
  grip = NeedleGrip{};
}

/// Holds what is between the jaws where it is.
void holdHere(const Holder& h, NeedleGrip& grip, const Vector3d& place) {
  const auto& rod = h.c.state.threads.rod;
  grip.local = h.frame.local(place);
  grip.turn = h.orientation.conjugate() * rod.frame[h.c.model.threads.rods->needles[grip.needle].node];
}

void seek(const Holder& h, NeedleGrip& grip) {
  const ThreadModel& m = h.c.model.threads;
  double most = 0.0, sum = 0.0, count = 0.0;
  for (std::uint32_t n = 0; n < m.first_point.size() && count == 0.0; ++n) {
    const suture::NeedleModel& needle = m.rods->needles[n];
    for (std::size_t i = 0; i < needle.points.size(); ++i) {
      const auto place = static_cast<std::uint32_t>(m.first_point[n] + i);
      if (!isBetween(h.c, h.tool, h.g, h.frame, place)) continue;
      const Vector3d local = h.frame.local(m.at(h.c.state.threads.rod, place));
      most = std::max(most, filledJaw(h.g, local, needle.radius));
      sum += needle.spacing * static_cast<double>(i), count += 1.0;
      grip.needle = n;
    }
  }
  if (most <= 0.0) {
    grip.jaw_at_touch = 0.0;
    return;
  }
  if (h.jaw <= most + kWireFill) grip.jaw_at_touch = std::max(grip.jaw_at_touch, most + kWireFill);
  const interaction::Grasp& tissue = h.c.state.grasps[h.tool];  // with the tissue that it lies on
  if (tissue.active) grip.jaw_at_touch = std::max(grip.jaw_at_touch, tissue.jaw_at_touch);
  if (!(grip.jaw_at_touch > 0.0) ||
      !(h.jaw <= (1.0 - interaction::kGraspClosure) * grip.jaw_at_touch || h.jaw <= most))
    return;
  Along at;
  grip.station = sum / count;
  if (!alongNeedle(h.c, grip.needle, grip.station, at)) return;
  grip.active = true;
  grip.pinch = interaction::pinchForce(h.jaw, grip.jaw_at_touch);
  holdHere(h, grip, at.place);
  Event e = threadEvent(h.c, EventKind::Grasped, h.tool, m.rods->needles[grip.needle].node);
  e.force = grip.pinch;
  emit(h.c, e);
}

/// Coulomb's limits of the hold: beyond them the needle slides through the jaws, or turns in them.
void slip(const Holder& h, NeedleGrip& grip) {
  const suture::NeedleModel& needle = h.c.model.threads.rods->needles[grip.needle];
  Along at;
  if (!alongNeedle(h.c, grip.needle, grip.station, at)) return letGo(h, grip);
  const Quaterniond& frame = h.c.state.threads.rod.frame[needle.node];
  const Vector3d off = h.frame.world(grip.local) - at.place;
  const double pull = interaction::kThreadGrip * std::sqrt(off.squaredNorm()),
               most = interaction::kHoldPerPinch * grip.pinch;
  const Quaterniond p = (h.orientation * grip.turn).conjugate() * frame;
  const Vector3d turn = p.vec() * (p.w() < 0.0 ? -2.0 : 2.0);
  const double moment = kTurning * std::sqrt(turn.squaredNorm()),
               greatest = kMomentPerPinch * grip.pinch *
                          (h.c.state.proxies[h.tool].tool == tools::ToolKind::NeedleHolder ? 1.0 : 0.5);
  const bool sliding = pull > most || moment > greatest;
  if (sliding && !grip.sliding) {
    Event e = threadEvent(h.c, EventKind::Slipped, h.tool, needle.node);
    e.force = pull;
    emit(h.c, e);
  }
  grip.sliding = sliding;
  if (moment > greatest) {
    const Vector3d left = 0.5 * (greatest / moment) * turn;
    grip.turn =
        (h.orientation.conjugate() * frame * Quaterniond(1.0, -left.x(), -left.y(), -left.z())).normalized();
  }
  if (!(pull > most)) return;
  const double station = grip.station + off.dot(at.back);  // what is now where the jaws are
  Along next;
  if (!(station <= needle.length) || !alongNeedle(h.c, grip.needle, station, next)) return letGo(h, grip);
  grip.station = station;
  grip.local = h.frame.local(next.place + (most / pull) * off);
  if (interaction::jawAngleAt(h.g, h.frame.local(next.place), 0.0) < 0.0) letGo(h, grip);
}

}  // namespace

void holdNeedles(Context& c, double from, double to) {
  for (std::size_t t = 0; t < c.state.threads.needle_grips.size(); ++t) {
    const NeedleGrip& g = c.state.threads.needle_grips[t];
    Along at;
    if (!g.active || !alongNeedle(c, g.needle, g.station, at)) continue;
    const auto &then = c.scratch.proxies_before[t].pose, &now = c.state.proxies[t].pose;
    suture::Support a = at.at;
    a.bond = suture::Bond::Hold;
    a.stiffness = interaction::kThreadGrip;
    const Vector3d start = then.tip + then.orientation * g.local,
                   way = now.tip + now.orientation * g.local - start;
    a.from = start + from * way, a.to = start + to * way;
    c.scratch.threads->rod.supports.push_back(a);
    const Eigen::Vector4d q0 = (then.orientation * g.turn).coeffs(), q1 = (now.orientation * g.turn).coeffs();
    const double sign = q0.dot(q1) < 0.0 ? -1.0 : 1.0;
    const auto between = [&](double f) {
      return Quaterniond(Eigen::Vector4d((1.0 - f) * q0 + f * sign * q1)).normalized();
    };
    suture::TurnSpring turn;
    turn.segment = c.model.threads.rods->needles[g.needle].node;
    turn.from = between(from), turn.to = between(to);
    if (turn.from.coeffs().dot(turn.to.coeffs()) < 0.0) turn.to.coeffs() *= -1.0;
    turn.stiffness = kTurning;
    c.scratch.threads->rod.turns.push_back(turn);
  }
}

void handleNeedles(Context& c) {
  if (!c.scratch.threads || c.model.threads.first_point.empty()) return;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    NeedleGrip& grip = c.state.threads.needle_grips[t];
    const auto& proxy = c.state.proxies[t];
    const auto& before = c.scratch.proxies_before[t].pose;
    const Holder hand{c,
                      t,
                      tools::toolGeometry(proxy.tool),
                      {before.orientation.toRotationMatrix(), before.tip},
                      before.orientation,
                      proxy.pose.jaw};
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
