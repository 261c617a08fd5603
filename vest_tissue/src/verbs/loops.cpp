#include "../scene/loops.h"

#include <algorithm>
#include <cmath>

#include "../scene/sling_path.h"

/// Pushers on loops that are tied beforehand. The standing part lies on the pusher's axis and is held at its
/// rear end, which the hand draws back. The point lets that strand in and stops all others: so the knot.
namespace vest::scene {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using interaction::ThreadPusher;

constexpr double kDrawSpeed = 0.04;  ///< m/s: the hand draws the standing part back; assumed
constexpr double kDrawForce = 6.1;   ///< N: the most that tightening a knot took (J Laparoendosc 28:899)
constexpr double kLetRun = 0.2;      ///< N: what an open hand brakes with; assumed
constexpr double kSlips = 1.05;      ///< of either force: beyond it the thread slips through the hand
constexpr double kBore = 0.0006;     ///< m: a strand nearer than this to the axis goes in (assumed)
constexpr double kRim = 0.0012;      ///< m: radius of tools::toolGeometry(), and how deep a strand is sought
constexpr double kAhead = 0.002;     ///< m: touches of the point are prepared this much before they touch
constexpr double kBefore = 0.0003;   ///< m: a strand no further back lies before the point, not beside it
constexpr double kGuide = 2000.0;    ///< N/m: the bore, on each node in it (tuned)
constexpr double kPoint = 4000.0;    ///< N/m: the point, on a node,
constexpr double kPoints = 15000.0;  ///< and on all: as much as an instrument's proxy bears
constexpr double kBoreFriction = 0.05;  ///< of thread in plastic; assumed
constexpr double kClamp = 0.01;         ///< N·m/rad: the hand against the thread's turning (tuned)
constexpr double kPacket = 20.0;        ///< N/m: a packet, on each node (tuned)

/// The tool's tip frame at a fraction of the step.
struct Frame {
  Vector3d tip;
  Quaterniond turn;
  Vector3d axis() const { return turn * Vector3d::UnitZ(); }
  Vector3d at(double z) const { return tip + z * axis(); }
};
Frame frameAt(const Context& c, std::size_t tool, double fraction) {
  const auto &then = c.scratch.proxies_before[tool].pose, &now = c.state.proxies[tool].pose;
  const Eigen::Vector4d q0 = then.orientation.coeffs(), q1 = now.orientation.coeffs();
  const double sign = q0.dot(q1) < 0.0 ? -1.0 : 1.0;
  Frame f{then.tip + fraction * (now.tip - then.tip),
          Quaterniond(Eigen::Vector4d((1.0 - fraction) * q0 + fraction * sign * q1))};
  f.turn.coeffs() /= std::sqrt(f.turn.squaredNorm());
  return f;
}

const LoopModel& loopOf(const Context& c, const ThreadPusher& pusher) {
  const auto& loops = c.model.threads.loops;
  std::size_t k = 0;
  while (loops[k].strand != pusher.strand) ++k;
  return loops[k];
}
const suture::Strand& strandOf(const Context& c, const ThreadPusher& pusher) {
  return c.model.threads.rods->strands[pusher.strand];
}

/// m, local z where the hand holds the rear end.
double handAt(const LoopModel& loop, const ThreadPusher& pusher) {
  return kPusher - loop.standing - pusher.drawn;
}

/// What it touched where it was is forgotten.
void forgetTouches(Context& c, std::uint32_t first, std::uint32_t end) {
  auto& touches = c.state.threads.touches;
  touches.erase(std::remove_if(touches.begin(), touches.end(),
                               [&](const auto& t) { return t.segment >= first && t.segment < end; }),
                touches.end());
}

/// The loop comes out of its packet, its knot at the pusher's point.
void take(Context& c, std::size_t tool, const LoopModel& loop) {
  interaction::ThreadState& threads = c.state.threads;
  ThreadPusher& pusher = threads.pushers[tool];
  pusher = ThreadPusher{};
  pusher.active = true;
  pusher.strand = loop.strand;
  threads.packed[loop.strand] = 0;
  const suture::Strand& strand = strandOf(c, pusher);
  const Frame frame = frameAt(c, tool, 0.0);
  const Quaterniond turn = frame.turn * loop.turn.conjugate();
  const Matrix3d rotation = turn.toRotationMatrix();
  suture::State& rod = threads.rod;
  const Vector3d point = frame.at(kPusher);
  for (std::uint32_t i = strand.first; i < strand.first + strand.nodes; ++i) {
    rod.position[i] = point + rotation * (rod.position[i] - loop.place);
    rod.velocity[i].setZero();
    if (i >= strand.first + strand.segments) continue;
    rod.frame[i] = turn * rod.frame[i];
    rod.frame[i].coeffs() /= std::sqrt(rod.frame[i].squaredNorm());
    rod.spin[i].setZero();
  }
  const auto own = [&](std::uint32_t i) { return i >= strand.first && i < strand.first + strand.nodes; };
  for (std::uint32_t k = 0; k < rod.contact_count; ++k) {
    suture::LiveContact& contact = rod.contacts[k];
    if (!own(contact.a)) continue;
    contact.normal = rotation * contact.normal;
    contact.force = rotation * contact.force;
  }
  forgetTouches(c, strand.first, strand.first + strand.nodes);
}

/// The pusher is gone. What was cut off in it goes with it, into the packet; else the hand lets go.
void withdraw(Context& c, ThreadPusher& pusher) {
  const suture::Strand& strand = strandOf(c, pusher);
  suture::State& rod = c.state.threads.rod;
  std::uint32_t end = strand.first;
  while (end < strand.first + strand.segments && rod.severed[end] == 0) ++end;
  if (end < strand.first + strand.segments) {
    const suture::State& start = c.model.start.threads.rod;
    for (std::uint32_t i = strand.first; i <= end; ++i) {
      rod.position[i] = start.position[i], rod.frame[i] = start.frame[i];
      rod.velocity[i].setZero(), rod.spin[i].setZero();
    }
    c.state.threads.packed[pusher.strand] = end + 1 - strand.first;
    forgetTouches(c, strand.first, end + 1);
  }
  pusher = ThreadPusher{};
}

/// The hand draws, and what has come to the point goes in.
void draw(Context& c, std::size_t tool) {
  ThreadPusher& pusher = c.state.threads.pushers[tool];
  const suture::Strand& strand = strandOf(c, pusher);
  const suture::State& rod = c.state.threads.rod;
  const LoopModel& loop = loopOf(c, pusher);
  const Frame frame = frameAt(c, tool, 0.0);
  const bool on = (c.input.tools[tool].functions & tools::kFunctionFire) != 0;
  c.state.fasteners.appliers[tool].drawn = on;
  const Vector3d off = frame.at(handAt(loop, pusher)) - rod.position[strand.first];
  const double pull = loop.give * std::sqrt(off.squaredNorm());
  const double most = on ? kDrawForce : kLetRun;
  if (on && pull < most)
    pusher.drawn += kDrawSpeed * c.dt;
  else  // it runs after what pulls at it
    pusher.drawn = std::max(0.0, pusher.drawn - std::max(0.0, pull - kSlips * most) / loop.give);
  const auto local = [&](std::uint32_t k) {
    return Vector3d(frame.turn.conjugate() * (rod.position[strand.first + k] - frame.tip));
  };
  const auto enters = [&](std::uint32_t k) {
    const Vector3d p = local(k);
    return p.z() < kPusher && p.x() * p.x() + p.y() * p.y() < kBore * kBore;
  };
  std::uint32_t& in = pusher.inside;
  if (in == 0) in = 1;
  while (in + 1 < strand.nodes && rod.severed[strand.first + in - 1] == 0 && enters(in)) ++in;
  while (in > 1 && !(local(in - 1).z() < kPusher)) --in;
}

suture::Support atNode(const suture::Strand& strand, std::uint32_t k) {
  suture::Support a;
  const bool last = k + 1 == strand.nodes;
  a.segment = strand.first + (last ? k - 1 : k), a.s = last ? 1.0 : 0.0;
  return a;
}

void holdPacked(Context& c) {
  const interaction::ThreadState& threads = c.state.threads;
  for (const LoopModel& loop : c.model.threads.loops) {
    const suture::Strand& strand = c.model.threads.rods->strands[loop.strand];
    for (std::uint32_t k = 0; k < threads.packed[loop.strand]; ++k) {
      suture::Support a = atNode(strand, k);
      if (threads.rod.severed[a.segment] != 0 && a.s == 0.0 && k > 0) --a.segment, a.s = 1.0;
      a.bond = suture::Bond::Hold;
      a.from = a.to = c.model.start.threads.rod.position[strand.first + k];
      a.stiffness = kPacket;
      c.scratch.threads->rod.supports.push_back(a);
    }
  }
}

/// The standing part in the bore, and its end in the hand.
void guide(Context& c, std::size_t tool, const Frame& from, const Frame& to) {
  const ThreadPusher& pusher = c.state.threads.pushers[tool];
  const suture::Strand& strand = strandOf(c, pusher);
  const LoopModel& loop = loopOf(c, pusher);
  auto& supports = c.scratch.threads->rod.supports;
  suture::Support hand = atNode(strand, 0);
  hand.bond = suture::Bond::Hold;
  hand.from = from.at(handAt(loop, pusher)), hand.to = to.at(handAt(loop, pusher));
  hand.stiffness = std::min(loop.give, interaction::kThreadGrip);
  hand.normal = to.axis();
  supports.push_back(hand);
  suture::TurnSpring turn;
  turn.segment = strand.first;
  const Quaterniond laid = loop.turn.conjugate() * c.model.start.threads.rod.frame[strand.first];
  turn.from = from.turn * laid, turn.to = to.turn * laid;
  turn.stiffness = kClamp;
  c.scratch.threads->rod.turns.push_back(turn);
  for (std::uint32_t k = 1; k < pusher.inside; ++k) {
    suture::Support a = atNode(strand, k);
    const double z = from.axis().dot(c.state.threads.rod.position[strand.first + k] - from.tip);
    a.bond = suture::Bond::Slide;
    a.from = from.at(z), a.to = to.at(z);
    a.normal = to.axis();
    a.stiffness = kGuide;
    a.friction = kBoreFriction;
    supports.push_back(a);
  }
}

/// The point stops what does not go in.
void meetPoint(Context& c, std::size_t tool, const Frame& from, const Frame& to) {
  const ThreadPusher& pusher = c.state.threads.pushers[tool];
  const suture::Strand& strand = strandOf(c, pusher);
  auto& supports = c.scratch.threads->rod.supports;
  const std::size_t first = supports.size();
  std::size_t bear = 0;
  for (std::uint32_t k = pusher.inside + 1; k < strand.nodes; ++k) {
    const Vector3d off = c.state.threads.rod.position[strand.first + k] - from.at(kPusher);
    const double z = from.axis().dot(off), radius = strand.section.radius, reach = kRim + radius;
    if (z > kAhead || z < -kRim || off.squaredNorm() - z * z > reach * reach) continue;
    suture::Support a = atNode(strand, k);
    a.from = from.at(kPusher), a.to = to.at(kPusher);
    a.normal = to.axis();
    a.reach = radius;
    a.stiffness = kPoint;
    if (z < radius) ++bear;
    supports.push_back(a);
  }
  for (std::size_t k = first; k < supports.size(); ++k)
    supports[k].stiffness = std::min(kPoint, kPoints / static_cast<double>(std::max<std::size_t>(bear, 1)));
}

}  // namespace

void takeLoops(Context& c) {
  if (!c.scratch.threads || c.model.threads.loops.empty()) return;
  interaction::ThreadState& threads = c.state.threads;
  for (std::size_t t = 0; t < threads.pushers.size(); ++t) {
    const auto& proxy = c.state.proxies[t];
    const bool present = proxy.present && proxy.tool == tools::ToolKind::SlingApplicator;
    ThreadPusher& pusher = threads.pushers[t];
    if (pusher.active && (!present || c.scratch.appeared[t])) withdraw(c, pusher);
    if (!present) continue;
    if (c.scratch.appeared[t])
      for (const LoopModel& loop : c.model.threads.loops)
        if (!pusher.active && threads.packed[loop.strand] == strandOf(c, {true, loop.strand}).nodes)
          take(c, t, loop);
    if (pusher.active) draw(c, t);
  }
  auto& apart = c.scratch.threads->apart;
  std::fill(apart.begin(), apart.end(), std::uint8_t{0});
  for (const LoopModel& loop : c.model.threads.loops)
    std::fill_n(apart.begin() + c.model.threads.rods->strands[loop.strand].first, threads.packed[loop.strand],
                std::uint8_t{1});
  for (const ThreadPusher& pusher : threads.pushers)
    if (pusher.active) std::fill_n(apart.begin() + strandOf(c, pusher).first, pusher.inside, std::uint8_t{1});
}

bool inPusher(const Context& c, std::size_t thread) {
  const interaction::ThreadState& threads = c.state.threads;
  return threads.packed[thread] == c.model.threads.rods->strands[thread].nodes ||
         std::any_of(threads.pushers.begin(), threads.pushers.end(),
                     [&](const ThreadPusher& pusher) { return pusher.active && pusher.strand == thread; });
}

bool atPusher(const Context& c, int tool, std::uint32_t segment) {
  const ThreadPusher& pusher = c.state.threads.pushers[static_cast<std::size_t>(tool)];
  if (!pusher.active) return false;
  const suture::Strand& strand = strandOf(c, pusher);
  if (segment < strand.first || segment >= strand.first + strand.segments) return false;
  if (segment - strand.first <= pusher.inside) return true;
  const Frame frame = frameAt(c, static_cast<std::size_t>(tool), 0.0);
  const auto before = [&](std::uint32_t i) {
    return frame.axis().dot(c.state.threads.rod.position[i] - frame.at(kPusher)) > -kBefore;
  };
  return before(segment) && before(segment + 1);
}

void holdLoops(Context& c, double from, double to) {
  ThreadScratch& w = *c.scratch.threads;
  w.pushed.fill(0);
  w.pushing = w.rod.supports.size();
  if (c.model.threads.loops.empty()) return;
  holdPacked(c);
  w.pushing = w.rod.supports.size();
  for (std::size_t t = 0; t < w.pushed.size(); ++t) {
    if (!c.state.threads.pushers[t].active) continue;
    const std::size_t before = w.rod.supports.size();
    const Frame begin = frameAt(c, t, from), end = frameAt(c, t, to);
    guide(c, t, begin, end);
    meetPoint(c, t, begin, end);
    w.pushed[t] = w.rod.supports.size() - before;
  }
}

}  // namespace vest::scene
