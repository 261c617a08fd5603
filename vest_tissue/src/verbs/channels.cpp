#include "../scene/channels.h"

#include <algorithm>
#include <cmath>

#include "vest_tissue/base/nearest.h"

/// Ways of needles and threads through tissue.
namespace vest::scene {
namespace {

using Eigen::Vector3d;
using interaction::Channel;
using interaction::ChannelAnchor;

constexpr double kMouth = 0.0015;    ///< m: nearer to a hole than that nothing touches the surface (tuned)
constexpr double kSpacing = 0.002;   ///< m: between places of a channel within solid tissue
constexpr double kReuse = 0.001;     ///< m: a tip that is as near to a hole goes into it; assumed
constexpr double kWall = 0.001;      ///< m: of a surface without a wall of its own; assumed
constexpr double kSteep = 0.3;       ///< no unit: a tip that comes flatter slides along; assumed
constexpr double kEndOn = 0.7;       ///< no unit: a face so steep to a needle is met by its ends alone; 45°
constexpr double kAlongWay = 0.2;    ///< no unit: a needle does not come through so flat a face; assumed
constexpr double kOffWay = 0.00015;  ///< m: further beside the needle, a place of a hole moves to it
constexpr double kLost = 0.003;      ///< m: further beside it, it is not the way that the needle takes
constexpr double kGone = 1e3;        ///< m, a station: needle and thread have left
/// N/m: friction in a channel per length, of a needle, a smooth thread, a braid; assumed
constexpr double kNeedleDrag = 20.0, kSmoothDrag = 5.0, kBraidDrag = 15.0;

bool isSolid(const Context& c, std::size_t object) {
  const ObjectConstants& o = c.model.objects[object];
  const Object& d = c.model.description.objects[object];
  return o.body->filled() || (o.closed && d.wall_thickness == 0.0);
}
double wallOf(const Context& c, std::size_t object) {
  return std::max(kWall, c.model.description.objects[object].wall_thickness);
}

template <class Of>
Vector3d sumOf(const ObjectState& s, const ChannelAnchor& a, Of of) {
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = 0; k < 6; ++k)
    if (a.weight[k] != 0.0) sum += a.weight[k] * of(s, s.triangles[a.triangle[k / 3]][k % 3]);
  return sum;
}
Vector3d placeOf(const ObjectState& s, const ChannelAnchor& a) {
  return sumOf(s, a, knotPosition);
}

std::array<Vector3d, 3> corners(const ObjectState& s, std::size_t triangle) {
  const auto& k = s.triangles[triangle];
  return {knotPosition(s, k[0]), knotPosition(s, k[1]), knotPosition(s, k[2])};
}

/// The nearest place of an object's surface.
struct Surface {
  std::uint32_t triangle = suture::kNone;
  contact::Nearest near{};
  double height = 0.0;  ///< m, outwards
};
Surface surfaceAt(const Context& c, std::size_t object, const Vector3d& p) {
  const ObjectState& s = c.state.objects[object];
  const double edge = 2.0 * c.model.objects[object].greatest_edge;
  Surface best;
  best.near.distance = 1e3;
  for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
    const double reach = best.near.distance + edge;
    if (!s.triangle_alive[t] || (knotPosition(s, s.triangles[t][0]) - p).squaredNorm() > reach * reach)
      continue;
    const contact::Nearest n = contact::nearest(p, corners(s, t));
    if (n.distance < best.near.distance) best.triangle = t, best.near = n;
  }
  if (best.triangle == suture::kNone) return best;
  const auto x = corners(s, best.triangle);
  Vector3d on = Vector3d::Zero();
  for (std::size_t e = 0; e < 3; ++e) on += best.near.weights[e] * x[e];
  best.height =
      (x[1] - x[0]).cross(x[2] - x[0]).dot(p - on) >= 0.0 ? best.near.distance : -best.near.distance;
  return best;
}

void lieOn(ChannelAnchor& a, std::uint32_t triangle, const std::array<double, 3>& weights) {
  a.triangle = {triangle, triangle};
  a.weight = {weights[0], weights[1], weights[2], 0.0, 0.0, 0.0};
}

/// Between the nearest face and the one behind the place, seen from there.
void lieWithin(const Context& c, std::size_t object, const Vector3d& p, const Surface& near,
               ChannelAnchor& a) {
  const ObjectState& s = c.state.objects[object];
  lieOn(a, near.triangle, near.near.weights);
  const Vector3d from = placeOf(s, a), in = p - from;
  if (!(near.height < -1e-6)) return;
  double nearest = 1e3;
  std::uint32_t behind = suture::kNone;
  std::array<double, 3> weights{};
  for (std::uint32_t t = 0; t < s.triangles.size(); ++t) {
    if (!s.triangle_alive[t]) continue;
    const auto x = corners(s, t);
    const Vector3d u = x[1] - x[0], v = x[2] - x[0], q = in.cross(v), o = from - x[0], r = o.cross(u);
    const double d = u.dot(q);  // Möller and Trumbore 1997
    if (!(std::abs(d) > 1e-18)) continue;
    const double b = o.dot(q) / d, g = in.dot(r) / d, way = v.dot(r) / d;
    if (b < 0.0 || g < 0.0 || b + g > 1.0 || !(way > 1.001) || way >= nearest) continue;
    nearest = way, behind = t, weights = {1.0 - b - g, b, g};
  }
  if (behind == suture::kNone) return;
  const double share = 1.0 / nearest;
  a.triangle[1] = behind;
  for (std::size_t e = 0; e < 3; ++e) a.weight[e] *= 1.0 - share, a.weight[e + 3] = share * weights[e];
}

/// Moves a place of a channel to p; a mouth to the surface, if that is no further than `reach` (m). False: p
/// is outside of the tissue.
bool layAt(const Context& c, std::size_t object, const Vector3d& p, bool surface, ChannelAnchor& a,
           double reach = 3e-4) {
  const Surface near = surfaceAt(c, object, p);
  if (near.triangle == suture::kNone) return false;
  if (surface || !isSolid(c, object)) {
    if (near.near.distance > reach) return false;
    lieOn(a, near.triangle, near.near.weights);
    return true;
  }
  if (near.height > 0.0) return false;
  lieWithin(c, object, p, near, a);
  return true;
}
bool onSurface(const Channel& channel, int k) {
  return k == 0 || (channel.through && k + 1 == channel.count);
}

/// m of tissue that an anchor stands for.
double lengthOf(const Context& c, const Channel& channel, int k) {
  if (!isSolid(c, channel.object)) return wallOf(c, channel.object);
  const auto between = [&](int a, int b) {
    return a < 0 || b >= channel.count
               ? 0.0
               : std::min(kSpacing, std::abs(channel.anchors[static_cast<std::size_t>(a)].station -
                                             channel.anchors[static_cast<std::size_t>(b)].station));
  };
  return std::max(0.5e-3, 0.5 * (between(k - 1, k) + between(k, k + 1)));
}

/// The station that is beside a place now.
void follow(const Context& c, const Channel& channel, const Vector3d& place, ChannelAnchor& a) {
  Along at;
  for (int k = 0; k < 2; ++k) {
    const bool there = alongNeedle(c, channel.needle, std::max(0.0, a.station), at);
    if (!there) {
      a.station = kGone;
      return;
    }
    const double step = std::clamp((place - at.place).dot(at.back), -0.002, 0.002);
    if (!a.filled && a.station < 0.0) {  // ahead of the tip
      a.station = (place - at.place).dot(at.back);
      return;
    }
    a.station += step;
    if (a.station < 0.0) return;
  }
}

/// Whether what an anchor waits for, or had in it, is still there.
void fill(Context& c, const Channel& channel, int k, ChannelAnchor& a) {
  const ObjectState& s = c.state.objects[channel.object];
  if (a.station == kGone) return;
  follow(c, channel, placeOf(s, a), a);
  Along at;
  const bool there = a.station >= 0.0 && alongNeedle(c, channel.needle, a.station, at);
  if (there && !a.filled) {
    Vector3d off = at.place - placeOf(s, a);
    off -= off.dot(at.back) * at.back;
    const double d = std::sqrt(off.squaredNorm());
    if (d > kLost ||
        (d > kOffWay && !layAt(c, channel.object, placeOf(s, a) + off, onSurface(channel, k), a, d))) {
      a.station = kGone;
      return;
    }
  }
  if (a.filled && !there) {
    a.along = 0.0;
    if (a.station >= 0.0) a.station = kGone;
  }
  a.filled = there;
}

void pushAt(const ObjectState& s, const Channel& channel, const ChannelAnchor& a, ThreadScratch& w) {
  ThreadPush push;
  push.object = channel.object;
  push.knots = s.triangles[a.triangle[0]], push.far_knots = s.triangles[a.triangle[1]];
  for (std::size_t e = 0; e < 3; ++e) {
    push.weights[e] = static_cast<float>(a.weight[e]),
    push.far_weights[e] = static_cast<float>(a.weight[e + 3]);
    w.crowd[push.object][push.knots[e]] += push.weights[e];
    w.crowd[push.object][push.far_knots[e]] += push.far_weights[e];
  }
  w.pushes.push_back(push);
}

void lead(Context& c, std::size_t number, double h) {
  Channel& channel = c.state.threads.channels[number];
  const ObjectState& s = c.state.objects[channel.object];
  const Object& described = c.model.description.objects[channel.object];
  const suture::NeedleModel& needle = c.model.threads.rods->needles[channel.needle];
  ThreadScratch& w = *c.scratch.threads;
  const auto add = [&](int k, const suture::Support& a) {
    w.led.push_back({number, k, w.rod.supports.size()});
    pushAt(s, channel, channel.anchors[static_cast<std::size_t>(std::min(k, channel.count - 1))], w);
    w.rod.supports.push_back(a);
  };
  for (int k = 0; k < channel.count; ++k) {
    ChannelAnchor& anchor = channel.anchors[static_cast<std::size_t>(k)];
    fill(c, channel, k, anchor);
    Along at;
    if (!anchor.filled || !alongNeedle(c, channel.needle, anchor.station, at)) continue;
    suture::Support a = at.at;
    a.bond = suture::Bond::Slide;
    a.normal = at.back;
    a.from = placeOf(s, anchor), a.to = a.from + h * sumOf(s, anchor, knotVelocity);
    a.friction = described.friction;
    const auto kind = c.model.description.sutures[c.model.threads.places[needle.node].strand].kind;
    a.grip = lengthOf(c, channel, k) * (anchor.station <= needle.length ? kNeedleDrag
                                        : kind == 2                     ? kBraidDrag
                                                                        : kSmoothDrag);
    a.shear = anchor.along * at.back;
    add(k, a);
  }
  Along tip;
  if (channel.through || !isSolid(c, channel.object) || !alongNeedle(c, channel.needle, 0.0, tip)) return;
  const ChannelAnchor& last = channel.anchors[static_cast<std::size_t>(channel.count - 1)];
  const Vector3d end = placeOf(s, last) - channel.ahead * tip.back;
  if (last.station == kGone || tip.back.dot(tip.place - end) > 1e-3) return;
  suture::Support a = tip.at;
  a.normal = tip.back;
  a.from = end, a.to = end + h * sumOf(s, last, knotVelocity);
  a.most = described.cut_toughness * 2.0 * needle.radius;  // work per way of a cut as wide as the wire
  add(channel.count, a);
}

int holderOf(const Context& c, std::uint32_t needle) {
  for (int t = 0; t < tools::kInstrumentCount; ++t)
    if (c.state.threads.needle_grips[static_cast<std::size_t>(t)].active &&
        c.state.threads.needle_grips[static_cast<std::size_t>(t)].needle == needle)
      return t;
  return -1;
}

void tell(Context& c, const Channel& channel, EventKind kind, const ChannelAnchor& a, double force) {
  const ObjectState& s = c.state.objects[channel.object];
  const double radius = c.model.threads.rods->needles[channel.needle].radius;
  Event e;
  e.kind = kind;
  e.step = c.state.step;
  e.instrument = static_cast<std::int8_t>(holderOf(c, channel.needle));
  e.object = channel.object;
  e.element = a.triangle[0];
  const double sum = a.weight[0] + a.weight[1] + a.weight[2];
  std::array<double, 3> weights{};
  for (std::size_t k = 0; k < 3; ++k) e.barycentric[k] = weights[k] = a.weight[k] / std::max(1e-12, sum);
  e.position = placeOf(s, a);
  e.station = stationOf(c.model, c.state, channel.object, s.triangles[a.triangle[0]], weights);
  e.area = 3.14159265358979323846 * radius * radius;
  e.force = force;
  emit(c, e);
}

/// Room for one more: an old hole is forgotten.
Channel* newChannel(Context& c) {
  auto& channels = c.state.threads.channels;
  if (channels.size() == interaction::kMaxChannels) {
    const auto hole =
        std::find_if(channels.begin(), channels.end(), [](const Channel& h) { return !h.filled; });
    if (hole == channels.end()) return nullptr;
    channels.erase(hole);
  }
  return &channels.emplace_back();
}

/// A hole that the tip finds again.
bool enterHole(Context& c, std::uint16_t object, std::uint32_t needle, const Along& tip) {
  for (Channel& channel : c.state.threads.channels) {
    if (channel.filled || channel.object != object) continue;
    const ObjectState& s = c.state.objects[object];
    const Vector3d to = placeOf(s, channel.anchors[0]) - tip.place;
    const double ahead = -to.dot(tip.back);
    if (ahead < -kReuse || ahead > 2.0 * kReuse || (to + ahead * tip.back).squaredNorm() > kReuse * kReuse)
      continue;
    channel.filled = true;
    channel.needle = needle;
    for (int k = 0; k < channel.count; ++k) {
      ChannelAnchor& a = channel.anchors[static_cast<std::size_t>(k)];
      a.filled = false, a.along = 0.0;
      a.station = std::min(-1e-9, (placeOf(s, a) - tip.place).dot(tip.back));
    }
    return true;
  }
  return false;
}

/// Where the tip's axis meets a triangle.
ChannelAnchor ahead(const ObjectState& s, std::uint32_t triangle, const Along& tip) {
  const auto x = corners(s, triangle);
  const Vector3d face = (x[1] - x[0]).cross(x[2] - x[0]);
  const double way = std::clamp(face.dot(x[0] - tip.place) / -face.dot(tip.back), -0.003, 0.003);
  const contact::Nearest n = contact::nearest(Vector3d(tip.place - way * tip.back), x);
  ChannelAnchor a;
  lieOn(a, triangle, n.weights);
  a.station = std::min(-1e-9, (placeOf(s, a) - tip.place).dot(tip.back));
  return a;
}

/// N: what solid tissue ahead of a tip bears already.
double cuttingForce(const Context& c, std::uint16_t object, std::uint32_t needle, const Vector3d& back) {
  const ThreadScratch& w = *c.scratch.threads;
  double sum = 0.0;
  for (const ChannelSupport& led : w.led) {
    const suture::Support& a = w.rod.supports[led.support];
    if (led.channel >= c.state.threads.channels.size() || a.bond != suture::Bond::Push) continue;
    const Channel& channel = c.state.threads.channels[led.channel];
    if (channel.object == object && channel.needle == needle) sum += a.force.dot(back);
  }
  return sum;
}

/// A tip that presses on a surface, from outside or from within.
void press(Context& c, const ThreadReach& r, std::uint32_t needle) {
  const suture::Support& a = c.scratch.threads->rod.supports[static_cast<std::size_t>(r.support)];
  Along tip;
  if (!alongNeedle(c, needle, 0.0, tip) || a.normal.dot(tip.back) < kSteep) return;
  const ObjectState& s = c.state.objects[r.touch.body];
  const bool within = withinOf(c, r.touch.segment, r.touch.body) == Within::Tissue;
  double force = a.force.dot(tip.back);
  if (within && force > 0.0) force += cuttingForce(c, r.touch.body, needle, tip.back);
  if (!within && force > 0.01 && enterHole(c, r.touch.body, needle, tip)) return;
  if (!(force > c.model.description.objects[r.touch.body].puncture_force)) return;
  ChannelAnchor mouth = ahead(s, r.triangle, tip);
  if (!within) {
    Channel* channel = newChannel(c);
    if (channel == nullptr) return;
    channel->object = r.touch.body, channel->needle = needle;
    channel->filled = true, channel->count = 1;
    channel->through = !c.model.objects[r.touch.body].closed;
    channel->anchors[0] = mouth;
    tell(c, *channel, EventKind::Punctured, mouth, force);
    return;
  }
  for (Channel& channel : c.state.threads.channels) {
    if (!channel.filled || channel.through || channel.object != r.touch.body || channel.needle != needle ||
        channel.count == interaction::kMaxChannelAnchors)
      continue;
    channel.through = true;
    channel.anchors[static_cast<std::size_t>(channel.count++)] = mouth;
    tell(c, channel, EventKind::Exited, mouth, force);
    return;
  }
}

/// Whether a tip within tissue presses on what lies ahead: it comes out by force then, as it went in.
bool presses(const Context& c, const Channel& channel) {
  const ThreadScratch& w = *c.scratch.threads;
  return std::any_of(w.reaches.begin(), w.reaches.end(), [&](const ThreadReach& r) {
    return r.touch.kind == interaction::TouchKind::Tissue && r.touch.body == channel.object &&
           r.touch.segment == c.model.threads.first_point[channel.needle] && r.touch.side < 0 &&
           w.rod.supports[static_cast<std::size_t>(r.support)].force.squaredNorm() > 0.0;
  });
}

/// Solid tissue that the tip has cut gets its next place.
void lengthen(Context& c, Channel& channel) {
  ChannelAnchor& last = channel.anchors[static_cast<std::size_t>(channel.count - 1)];
  Along tip;
  if (channel.through || !last.filled || channel.count + 1 >= interaction::kMaxChannelAnchors ||
      !isSolid(c, channel.object) || !alongNeedle(c, channel.needle, 0.0, tip))
    return;
  const double way = -(tip.place - placeOf(c.state.objects[channel.object], last)).dot(tip.back);
  if (way < kSpacing) return;
  ChannelAnchor next;
  next.filled = true;
  if (!layAt(c, channel.object, tip.place, false, next)) {
    if (presses(c, channel)) return;  // it draws the face with it
    // It has come out, past the edge of a face.
    const Surface near = surfaceAt(c, channel.object, tip.place);
    if (near.triangle == suture::kNone) return;
    lieOn(next, near.triangle, near.near.weights);
    channel.through = true;
    tell(c, channel, EventKind::Exited, next, 0.0);
  }
  channel.anchors[static_cast<std::size_t>(channel.count++)] = next;
  channel.ahead -= way;
}

/// A mouth that was dragged to a face along the way, round the edge of its own.
bool isRoundEdge(const ObjectState& s, const ChannelAnchor& was, const ChannelAnchor& is,
                 const Vector3d& way) {
  if (was.triangle[0] == is.triangle[0]) return false;
  const auto x = corners(s, is.triangle[0]);
  const Vector3d face = (x[1] - x[0]).cross(x[2] - x[0]);
  return std::abs(face.dot(way)) < kAlongWay * std::sqrt(face.squaredNorm());
}

/// What is pulled across with more than its toughness gives way: the thread cuts on, by the work that takes.
void tear(Context& c) {
  ThreadScratch& w = *c.scratch.threads;
  for (std::size_t n = w.led.size(); n-- > 0;) {
    const ChannelSupport& led = w.led[n];
    Channel& channel = c.state.threads.channels[led.channel];
    if (led.anchor >= channel.count) continue;
    const suture::Support& a = w.rod.supports[led.support];
    const Vector3d across = a.force - a.force.dot(a.normal) * a.normal;
    const double force = std::sqrt(across.squaredNorm()),
                 bears = c.model.description.objects[channel.object].cut_toughness *
                         lengthOf(c, channel, led.anchor);
    if (!(force > bears)) continue;
    ChannelAnchor& anchor = channel.anchors[static_cast<std::size_t>(led.anchor)];
    const ObjectState& s = c.state.objects[channel.object];
    const double way = std::min(0.001, (force - bears) / a.stiffness);
    const ChannelAnchor was = anchor;
    const bool mouth = onSurface(channel, led.anchor);
    if (layAt(c, channel.object, placeOf(s, anchor) - (way / force) * across, mouth, anchor) &&
        !(mouth && isRoundEdge(s, was, anchor, a.normal)))
      continue;
    for (int k = led.anchor; k + 1 < channel.count; ++k)
      channel.anchors[static_cast<std::size_t>(k)] = channel.anchors[static_cast<std::size_t>(k + 1)];
    --channel.count;
    if (channel.count == 1 && isSolid(c, channel.object)) channel.count = 0;  // a mouth alone leads nowhere
    if (channel.count > 0) continue;
    tell(c, channel, EventKind::TornOut, was, force);
  }
}

/// Nothing is in it any more, or its tissue is gone.
void empty(Context& c) {
  auto& channels = c.state.threads.channels;
  for (Channel& channel : channels) {
    const ObjectState& s = c.state.objects[channel.object];
    int kept = 0;
    bool filled = false;
    for (int k = 0; k < channel.count; ++k) {
      const ChannelAnchor a = channel.anchors[static_cast<std::size_t>(k)];
      if (!s.triangle_alive[a.triangle[0]] || !s.triangle_alive[a.triangle[1]]) continue;
      channel.anchors[static_cast<std::size_t>(kept++)] = a;
      filled = filled || a.filled || (a.station < 0.0 && a.station > -kMouth);
    }
    channel.count = kept;
    channel.filled = channel.filled && filled;
  }
  channels.erase(
      std::remove_if(channels.begin(), channels.end(), [](const Channel& h) { return h.count == 0; }),
      channels.end());
}

}  // namespace

bool alongNeedle(const Context& c, std::uint32_t n, double station, Along& out) {
  const ThreadModel& m = c.model.threads;
  const suture::State& rod = c.state.threads.rod;
  const suture::NeedleModel& needle = m.rods->needles[n];
  if (!(station >= 0.0)) return false;
  out.at = suture::Support{};
  if (station <= needle.length) {
    const std::size_t i =
        std::min(needle.points.size() - 2, static_cast<std::size_t>(station / needle.spacing));
    const Vector3d way = needle.points[i + 1] - needle.points[i];
    out.at.segment = needle.node, out.at.rigid = true;
    out.at.arm = needle.points[i] + (station / needle.spacing - static_cast<double>(i)) * way;
    out.place = rod.position[needle.node] + rod.frame[needle.node] * out.at.arm;
    out.back = rod.frame[needle.node] * (way / needle.spacing);
    return true;
  }
  const suture::Strand& strand = m.rods->strands[m.places[needle.node].strand];
  std::uint32_t i = strand.threadFirst(), end = strand.first + strand.nodes - 1;
  while (end - i > 1) {
    const std::uint32_t middle = (i + end) / 2;
    (m.places[middle].station <= station ? i : end) = middle;
  }
  const double s = (station - m.places[i].station) / m.rods->length[i];
  if (s > 1.0 || rod.severed[i] != 0) return false;
  const Vector3d way = rod.position[i + 1] - rod.position[i];
  out.at.segment = i, out.at.s = s;
  out.place = rod.position[i] + s * way;
  out.back = way / std::max(1e-12, std::sqrt(way.squaredNorm()));
  return true;
}

Within withinOf(const Context& c, std::uint32_t place, std::uint16_t object) {
  const ThreadPlace& p = c.model.threads.places[place];
  const std::uint32_t needle = c.model.threads.rods->strands[p.strand].needle;
  Within within = Within::Outside;
  for (const Channel& channel : c.state.threads.channels) {
    if (!channel.filled || channel.object != object || channel.needle != needle) continue;
    const ChannelAnchor &entry = channel.anchors[0],
                        &last = channel.anchors[static_cast<std::size_t>(channel.count - 1)];
    if (p.station > entry.station + kMouth || (channel.through && p.station < last.station - kMouth))
      continue;
    if (!channel.through && place == c.model.threads.first_point[needle] &&
        channel.count < interaction::kMaxChannelAnchors)
      return Within::Tissue;
    within = Within::Channel;
  }
  return within;
}

bool meets(const Context& c, std::uint32_t place, const Vector3d& face, Within within) {
  const ThreadPlace& p = c.model.threads.places[place];
  const std::uint32_t needle = c.model.threads.rods->strands[p.strand].needle;
  Along at;
  if (!p.rigid || !alongNeedle(c, needle, p.station, at)) return true;
  const double along = face.dot(at.back) / std::max(1e-30, std::sqrt(face.squaredNorm()));
  if (within == Within::Tissue) return along < -kSteep;
  const bool end = p.station <= 0.0 || p.station >= c.model.threads.rods->needles[needle].length - 1e-9;
  return end || std::abs(along) < kEndOn;
}

void leadChannels(Context& c, double h) {
  c.scratch.threads->led.clear();
  for (std::size_t n = 0; n < c.state.threads.channels.size(); ++n)
    if (c.state.threads.channels[n].filled) lead(c, n, h);
}

void settleChannels(Context& c) {
  ThreadScratch& w = *c.scratch.threads;
  for (const ChannelSupport& led : w.led) {
    Channel& channel = c.state.threads.channels[led.channel];
    const suture::Support& a = w.rod.supports[led.support];
    if (led.anchor < channel.count) {
      channel.anchors[static_cast<std::size_t>(led.anchor)].along = a.shear.dot(a.normal);
      continue;
    }
    Along tip;
    if (!alongNeedle(c, channel.needle, 0.0, tip)) continue;
    const double beyond = -a.normal.dot(tip.place - a.to), bears = a.most / a.stiffness;
    if (beyond > bears) channel.ahead += beyond - bears;
  }
}

void advanceChannels(Context& c) {
  if (c.model.threads.first_point.empty()) return;
  tear(c);
  for (const ThreadReach& r : c.scratch.threads->reaches) {
    if (r.touch.kind != interaction::TouchKind::Tissue) continue;
    const ThreadPlace& p = c.model.threads.places[r.touch.segment];
    if (!p.rigid || p.station > 0.0) continue;
    press(c, r, c.model.threads.rods->strands[p.strand].needle);
  }
  for (Channel& channel : c.state.threads.channels)
    if (channel.filled && channel.count > 0) lengthen(c, channel);
  empty(c);
}

}  // namespace vest::scene
