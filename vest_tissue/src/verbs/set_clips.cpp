#include <algorithm>
#include <cmath>
#include <limits>

#include "../scene/between_jaws.h"
#include "vest_tissue/interaction/fasteners.h"

namespace vest::scene {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using interaction::Applier;
using interaction::Clip;
using net::Block;

constexpr double kFill = 0.08;  ///< rad: the tissue fills the gap when it comes this near to the jaws; tuned
constexpr double kRingShare =
    0.6;                          ///< of a ring's knots between the jaws: the lumen is between them; assumed
constexpr double kAcross = 0.3;   ///< least sine between the opening of the jaws and the tube; assumed
constexpr double kClosing = 0.2;  ///< m/s: of the legs of a clip on finite elements; assumed
constexpr double kHard = 5e6;     ///< Pa: no clip flattens what is harder (cartilage, bone); assumed
/// Of the jaws, from their tips: where the parts of a clip are joined.
constexpr double kJoint[] = {0.2, 0.7};
constexpr double kNoStation = std::numeric_limits<double>::quiet_NaN();

bool movable(const ObjectState& s, std::uint32_t k) {
  return row(s, Block::kInverseMass)[k] > 0.0f;
}

bool add(Clip& clip, const ObjectState& s, std::uint32_t knot) {
  const auto end = clip.knots.begin() + clip.count;
  if (clip.count >= interaction::kMaxClipKnots || !movable(s, knot) ||
      std::find(clip.knots.begin(), end, knot) != end)
    return false;
  clip.knots[static_cast<std::size_t>(clip.count++)] = knot;
  return true;
}

/// Share of a ring's knots whose opening angle the jaws embrace; of one that was cut, of the wall that they
/// embrace more of.
double embraced(const Context& c, std::size_t object, std::size_t ring, const tools::ToolGeometry& g,
                const JawFrame& frame, double jaw) {
  const ObjectState& s = c.state.objects[object];
  double most = 0.0;
  for (const bool above : {true, false}) {
    const net::CutRings::Ring knots = ringNow(c, object, ring, above);
    const Vector3d centre = centreOf(s, knots);
    int inside = 0;
    for (const auto k : knots) {
      Vector3d p = frame.local(knotPosition(s, k));
      p.y() -= frame.local(centre).y();  // the ring may lie beside the jaws' middle
      const double at = interaction::jawAngleAt(g, p, 0.0);
      inside += at >= 0.0 && at <= jaw + kFill;
    }
    if (knots.count >= 3)
      most = std::max(most, static_cast<double>(inside) / static_cast<double>(knots.count));
  }
  return most;
}

/// Which rings a clip at `station` closes: the nearest one, and its neighbour where it lies between.
int ringsAt(const net::TubeMap& tube, double station, std::size_t (&rings)[2]) {
  const net::TubeMap::Place at = tube.at(station);
  const bool last = at.ring + 1 >= tube.ringCount();
  if (last || at.fraction <= interaction::kClipReach) {
    rings[0] = at.ring;
    return 1;
  }
  rings[0] = at.fraction > 0.5 ? at.ring + 1 : at.ring;
  rings[1] = at.fraction > 0.5 ? at.ring : at.ring + 1;
  return at.fraction >= 1.0 - interaction::kClipReach ? 1 : 2;
}

struct Between {
  std::size_t object = 0;
  double station = 0.0;  ///< m, mean of the samples
  int samples = 0;
};

/// What lies between the jaws: the objects with the most samples, in that order.
struct Pedicle {
  static constexpr std::size_t kMost = 8;  ///< assumed
  std::array<Between, kMost> parts;
  std::size_t count = 0;
  double most = 0.0;  ///< rad: opening that the tissue fills
};

/// What is hollow is flattened by bending.
bool isHard(const ObjectConstants& o) {
  return o.tube.ringCount() == 0 && o.youngs_modulus > kHard;
}

/// Also ObjectScratch::between.
Pedicle look(Context& c, const tools::ToolGeometry& g, const JawFrame& frame, double jaw) {
  Pedicle all;
  for (ObjectScratch& o : c.scratch.objects) o.between = false;
  Between now;
  double stations = 0.0;
  int with_station = 0;
  const auto finish = [&] {
    now.station = with_station > 0 ? stations / with_station : kNoStation;
    std::size_t at = all.count;
    while (at > 0 && all.parts[at - 1].samples < now.samples) --at;
    if (at == Pedicle::kMost) return;
    all.count = std::min(all.count + 1, Pedicle::kMost);
    std::copy_backward(all.parts.begin() + at, all.parts.begin() + all.count - 1,
                       all.parts.begin() + all.count);
    all.parts[at] = now;
  };
  eachBetween(c, g, frame, jaw + kFill + 0.05,
              [&](std::size_t object, std::size_t triangle, const double* w, double at) {
                all.most = std::max(all.most, at);
                if (isHard(c.model.objects[object])) return;
                if (now.samples == 0 || now.object != object) {
                  if (now.samples > 0) finish();
                  now = Between{object, 0.0, 0};
                  stations = 0.0, with_station = 0;
                }
                ++now.samples;
                c.scratch.objects[object].between = true;
                const double s = stationOf(c.model, c.state, object,
                                           c.state.objects[object].triangles[triangle], {w[0], w[1], w[2]});
                if (std::isfinite(s)) stations += s, ++with_station;
              });
  if (now.samples > 0) finish();
  return all;
}

/// Shape of a clip on a ring or two: the tube's section flattened; false where the jaws open along the tube.
bool shapeRings(Context& c, Clip& clip, const Between& at, const JawFrame& frame) {
  const ObjectState& s = c.state.objects[at.object];
  const net::TubeMap& tube = c.model.objects[at.object].tube;
  std::size_t rings[2];
  const int count = ringsAt(tube, at.station, rings);
  const net::TubeMap::Place place = tube.at(at.station);
  // The wall that the clip is on leads from one ring to the next: of each it takes the knots on that side.
  const auto ringOf = [&](std::size_t r) { return ringNow(c, at.object, r, r <= place.ring); };
  const auto whole = [&](std::size_t r) { return c.scratch.objects[at.object].rings.whole(tube, r); };
  std::size_t before = rings[0] > 0 ? rings[0] - 1 : rings[0],
              after = std::min(rings[0] + 1, tube.ringCount() - 1);
  if (!whole(rings[0])) (rings[0] <= place.ring ? before : after) = rings[0];  // beyond it is another piece
  Vector3d along = centreOf(s, ringOf(after)) - centreOf(s, ringOf(before));
  const double length = std::sqrt(along.squaredNorm());
  if (!(length > 1e-9)) return false;
  along /= length;
  Vector3d squeeze = frame.rotation.col(0) - frame.rotation.col(0).dot(along) * along;
  const double across = std::sqrt(squeeze.squaredNorm());
  if (!(across > kAcross)) return false;
  squeeze /= across;
  Vector3d legs = squeeze.cross(along);
  if (legs.dot(frame.rotation.col(2)) < 0.0) legs = -legs;
  clip.rotation.col(0) = squeeze;
  clip.rotation.col(1) = legs.cross(squeeze);
  clip.rotation.col(2) = legs;
  for (int r = 0; r < count; ++r) {
    const int first = clip.count;
    const net::CutRings::Ring ring = ringOf(rings[r]);
    if (clip.count + static_cast<int>(ring.count) > interaction::kMaxClipKnots) break;
    for (const auto k : ring) add(clip, s, k);
    if (r == 0) clip.ring = clip.count;
    const int n = clip.count - first;
    if (n < 3) return false;
    const Vector3d centre = centreOf(s, ring);
    for (int i = 0; i < n; ++i)
      clip.open[first + i] = clip.rotation.transpose() * (knotPosition(s, clip.knots[first + i]) - centre);
    interaction::flattenRing(clip.open.data() + first, n, interaction::kClipGap, clip.closed.data() + first);
    const Vector3d back = clip.rotation.transpose() * centre;
    for (int i = first; i < clip.count; ++i) clip.open[i] += back, clip.closed[i] += back;
  }
  std::array<Vector3d, interaction::kMaxClipKnots> places;
  for (int i = 0; i < clip.ring; ++i) places[i] = knotPosition(s, clip.knots[i]);
  clip.area = interaction::polygonArea(places.data(), clip.ring);
  clip.station = at.station;
  const Vector3d here = centreOf(s, ringOf(place.ring));
  const Vector3d next = centreOf(s, ringOf(std::min(place.ring + 1, tube.ringCount() - 1)));
  clip.offset = clip.rotation.transpose() * (here + place.fraction * (next - here));
  return true;
}

/// Shape of a clip on any other tissue: what the jaws hold, pressed flat.
void shapeFold(Context& c, Clip& clip, const Between& at, const tools::ToolGeometry& g, const JawFrame& frame,
               double jaw) {
  const ObjectState& s = c.state.objects[at.object];
  clip.count = clip.ring = 0;
  clip.station = clip.area = kNoStation;
  clip.rotation = frame.rotation;
  eachBetween(c, g, frame, jaw + kFill, [&](std::size_t object, std::size_t t, const double* w, double) {
    if (object != at.object) return;
    for (int e = 0; e < 3; ++e)
      if (w[e] > 0.0) add(clip, s, s.triangles[t][e]);
  });
  for (int i = 0; i < clip.count; ++i) {
    clip.open[i] = clip.rotation.transpose() * knotPosition(s, clip.knots[i]);
    clip.closed[i] = clip.open[i];
  }
  const double middle = (clip.rotation.transpose() * frame.world(Vector3d(0, 0, -0.5 * g.jaw_length))).x();
  for (int i = 0; i < clip.count; ++i)
    clip.closed[i].x() = middle + (clip.open[i].x() < middle ? -0.5 : 0.5) * interaction::kClipGap;
  clip.offset = clip.rotation.transpose() * frame.world(Vector3d(0, 0, -0.4 * g.jaw_length));
}

/// Both shapes about their centres of mass, and the clip's place from that of the closed one.
/// Shapes about the centre of mass of what the clip holds. @return by how much the open one moved
Vector3d recentre(const ObjectState& s, Clip& clip) {
  Vector3d open = Vector3d::Zero(), closed = Vector3d::Zero();
  double mass = 0.0;
  for (int i = 0; i < clip.count; ++i) {
    const double m = row(s, Block::kMass)[clip.knots[i]];
    open += m * clip.open[i], closed += m * clip.closed[i];
    mass += m;
  }
  open /= mass, closed /= mass;
  constexpr double kNothing = 1e-9 * 1e-9;  // m²: rounding
  if (open.squaredNorm() < kNothing && closed.squaredNorm() < kNothing) return Vector3d::Zero();
  for (int i = 0; i < clip.count; ++i) clip.open[i] -= open, clip.closed[i] -= closed;
  clip.offset -= open;
  for (Vector3d& joint : clip.joint) joint -= open;
  return open;
}

void centre(const ObjectState& s, Clip& clip) {
  clip.centre = clip.rotation * recentre(s, clip);
}

Event eventOf(const Context& c, const Clip& clip, EventKind kind) {
  Event e = eventOf(c, kind, clip.instrument, clip.object, clip.knots[0]);
  e.barycentric = {1.0, 0.0, 0.0, 0.0};
  e.position = clip.centre + clip.rotation * clip.offset;
  e.station = clip.station;
  e.area = clip.area;
  e.force = clip.force;
  return e;
}

/// Of a clip's leg, towards the other: +1, -1 along its x; 0 between them.
double inwardOf(const Clip& clip, int i) {
  const double side = clip.closed[i].x();
  return side < 0.0 ? 1.0 : side > 0.0 ? -1.0 : 0.0;
}

using Shape = std::array<Vector3d, interaction::kMaxClipKnots>;

/// Where a clip is by what it holds now: the best fit of its shape, which is returned about its centre (m,
/// world). A cut beside it leaves some knots lighter: a shape about the old centre would drag the tissue
/// along.
template <typename Mass, typename Place>
Shape fit(const ObjectState& s, Clip& clip, Mass mass, Place place) {
  recentre(s, clip);
  Vector3d centre = Vector3d::Zero();
  double total = 0.0;
  for (int i = 0; i < clip.count; ++i) {
    const double m = mass(clip.knots[i]);
    centre += m * place(clip.knots[i]);
    total += m;
  }
  clip.centre = centre / total;
  Matrix3d moment = Matrix3d::Zero();
  Shape shape;
  for (int i = 0; i < clip.count; ++i) {
    shape[i] = clip.open[i] + clip.progress * (clip.closed[i] - clip.open[i]);
    moment += mass(clip.knots[i]) * (place(clip.knots[i]) - clip.centre) * shape[i].transpose();
  }
  clip.rotation = interaction::nearestRotation(moment, clip.rotation);
  for (int i = 0; i < clip.count; ++i) shape[i] = clip.rotation * shape[i];
  return shape;
}

/// Holds the group of a clip together after `dt` of motion (interaction/clip.h).
void hold(Context& c, Clip& clip, double dt) {
  ObjectState& s = c.state.objects[clip.object];
  if (clip.count == 0) return;
  const auto mass = [m = row(s, Block::kMass)](std::uint32_t k) { return static_cast<double>(m[k]); };
  const Shape shape = fit(s, clip, mass, [&](std::uint32_t k) { return knotPosition(s, k); });
  Vector3d momentum = Vector3d::Zero(), spin = Vector3d::Zero();
  Matrix3d inertia = Matrix3d::Zero();
  double total = 0.0, energy = 0.0;
  for (int i = 0; i < clip.count; ++i) {
    const double m = mass(clip.knots[i]);
    const Vector3d v = knotVelocity(s, clip.knots[i]);
    momentum += m * v, energy += 0.5 * m * v.squaredNorm(), total += m;
    spin += m * (knotPosition(s, clip.knots[i]) - clip.centre).cross(v);
    inertia += m * (shape[i].squaredNorm() * Matrix3d::Identity() - shape[i] * shape[i].transpose());
  }
  const Vector3d velocity = momentum / total;
  const Vector3d turn =
      interaction::boundedTurn(inertia, spin, energy - 0.5 * total * velocity.squaredNorm());
  double press = 0.0, lost = 0.0, work = 0.0;
  for (int i = 0; i < clip.count; ++i) {
    const std::uint32_t k = clip.knots[i];
    const double m = mass(k);
    const Vector3d place = knotPosition(s, k), before = knotVelocity(s, k);
    const Vector3d goal = clip.centre + shape[i], after = velocity + turn.cross(shape[i]);
    const Vector3d force = m / dt * (after - before);  // of the clip on the knot
    press += 0.5 * inwardOf(clip, i) * force.dot(clip.rotation.col(0));
    lost += 0.5 * m * (before.squaredNorm() - after.squaredNorm());
    work += force.dot(goal - place);
    setMotion(s, k, goal, after);
  }
  clip.force = press;
  auto& loads = c.scratch.objects[clip.object].loads;  // of its own object: threads do not meet
  loads.dissipated += lost;
  loads.work += work;
}

/// A part of a clip that begins to form, on one object. Null: there is nothing that it could hold, or no
/// room.
Clip* form(Context& c, int tool, const Between& at, const tools::ToolGeometry& g, const JawFrame& frame,
           double jaw) {
  if (!c.body(at.object).fastens()) return nullptr;
  auto& clips = c.state.fasteners.clips;
  auto free = std::find_if(clips.begin(), clips.end(), [](const Clip& clip) { return !clip.alive; });
  if (free == clips.end()) {
    if (clips.size() >= interaction::kMaxClips) {  // all are used: said, and nothing more is set
      c.report.status = Status::Degraded;
      return nullptr;
    }
    clips.emplace_back();
    free = clips.end() - 1;
  }
  Clip& clip = *free;
  clip = Clip{};
  clip.object = static_cast<std::uint16_t>(at.object);
  clip.instrument = static_cast<std::int8_t>(tool);
  const net::TubeMap& tube = c.model.objects[at.object].tube;
  const bool around = std::isfinite(at.station) && tube.ringCount() > 1 && !c.body(at.object).filled() &&
                      embraced(c, at.object, tube.nearestRing(at.station), g, frame, jaw) >= kRingShare;
  if (!around || !shapeRings(c, clip, at, frame)) shapeFold(c, clip, at, g, frame, jaw);
  if (c.body(at.object).filled()) clip.station = at.station;  // NaN where it is no vessel
  if (clip.count < 3) return nullptr;
  for (std::size_t j = 0; j < clip.joint.size(); ++j)
    clip.joint[j] = clip.rotation.transpose() * frame.world(Vector3d(0, 0, -kJoint[j] * g.jaw_length));
  ObjectState& s = c.state.objects[clip.object];
  centre(s, clip);
  // Between steps: within one its turn among the objects would come twice.
  c.body(clip.object).change(s);
  clip.alive = true;
  clip.jaw = jaw;
  setBit(c.state.jaws_pass[clip.object], tool, true);
  return &clip;
}

/// The jaws of an applier: tissue between them, a clip that forms, one that is shut.
void applyClip(Context& c, int tool) {
  auto& fasteners = c.state.fasteners;
  Applier& applier = fasteners.appliers[tool];
  const auto& proxy = c.state.proxies[tool];
  std::array<Clip*, Pedicle::kMost> forming{};  // its parts
  std::size_t parts = 0;
  for (Clip& clip : fasteners.clips)
    if (clip.alive && !clip.shut && clip.instrument == tool && parts < forming.size())
      forming[parts++] = &clip;
  const auto drop = [&] {
    for (std::size_t i = 0; i < parts; ++i) forming[i]->alive = false;
  };
  if (!proxy.present || proxy.tool != tools::ToolKind::ClipApplier) {
    drop();
    if (!proxy.present || proxy.tool != tools::ToolKind::SlingApplicator) applier = Applier{};
    return;
  }
  const auto& g = tools::toolGeometry(proxy.tool);
  const JawFrame frame{proxy.pose.orientation.toRotationMatrix(), proxy.pose.tip};
  const double jaw = proxy.pose.jaw;
  if (jaw > interaction::kClipReload && parts == 0) applier.loaded = true;
  const Pedicle between = look(c, g, frame, jaw);
  // The jaws do not push what they hold, nor what they just let go of.
  auto& pass = c.state.jaws_pass;
  if (parts > 0) {
    for (std::size_t i = 0; i < parts; ++i) setBit(pass[forming[i]->object], tool, true);
    const double from = forming[0]->jaw;
    if (jaw > 1.1 * from) {  // opened before it was shut: it falls off
      drop();
      return;
    }
    const double progress = (from - jaw) / std::max(from - interaction::kClipShutJaw, 1e-3);
    for (std::size_t i = 0; i < parts; ++i) {
      forming[i]->progress = std::clamp(progress, forming[i]->progress, 1.0);
      if (forming[i]->progress < 1.0) continue;
      forming[i]->shut = true;
      applier.loaded = false;
      emit(c, eventOf(c, *forming[i], EventKind::Clipped));
    }
    return;
  }
  if (between.count == 0) {
    applier.jaw_at_touch = 0.0;
    return;
  }
  if (!applier.loaded) {
    for (std::size_t object = 0; object < pass.size(); ++object)
      if (c.scratch.objects[object].between) setBit(pass[object], tool, true);
    return;
  }
  if (between.most >= jaw - kFill) applier.jaw_at_touch = std::max(applier.jaw_at_touch, jaw);
  if (applier.jaw_at_touch <= 0.0 || jaw > (1.0 - interaction::kClipCatch) * applier.jaw_at_touch) return;
  for (std::size_t i = 0; i < between.count; ++i)
    if (Clip* const part = form(c, tool, between.parts[i], g, frame, jaw)) forming[parts++] = part;
  if (parts == 0) return;
  for (std::size_t i = 0; i < parts; ++i)
    forming[i]->id = c.state.next_attachment, forming[i]->joined = parts > 1;
  ++c.state.next_attachment;
  applier.jaw_at_touch = 0.0;
}

}  // namespace

void fastenClips(Context& c) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) applyClip(c, t);
}

void holdClips(Context& c, std::size_t object, double dt) {
  for (Clip& clip : c.state.fasteners.clips)
    if (clip.alive && clip.object == object) hold(c, clip, dt);
}

void gatherClips(Context& c, std::size_t object, double dt) {
  ObjectState& s = c.state.objects[object];
  auto& groups = c.scratch.objects[object].tissue.groups;
  auto& taken = c.scratch.objects[object].shared;  // per knot: a clip set later has it
  groups.clear();
  auto& clips = c.state.fasteners.clips;
  for (std::size_t n = clips.size(); n-- > 0;) {
    Clip& clip = clips[n];
    if (!clip.alive || clip.object != object || groups.size() == groups.capacity()) continue;
    if (groups.empty()) std::fill(taken.begin(), taken.end(), std::uint16_t{0});
    c.body(object).change(s);
    const Shape shape = fit(
        s, clip, [&](std::uint32_t k) { return s.tissue.mass[k]; },
        [&](std::uint32_t k) -> const Vector3d& { return s.tissue.x[k]; });
    groups.emplace_back();
    fem::TissueGroup& g = groups.back();
    g.source = static_cast<std::uint32_t>(n);
    double furthest = 0.0;
    for (int i = 0; i < clip.count; ++i) {
      const std::uint32_t k = clip.knots[i];
      if (taken[k] != 0 || s.fixed[k]) continue;
      taken[k] = 1;
      g.knots[g.count] = k;
      g.member[g.count] = static_cast<std::uint8_t>(i);
      g.goal[g.count] = clip.centre + shape[i];
      furthest = std::max(furthest, (g.goal[g.count] - s.tissue.x[k]).squaredNorm());
      ++g.count;
    }
    if (g.count < 3) {
      for (int i = 0; i < g.count; ++i) taken[g.knots[i]] = 0;
      groups.pop_back();
      continue;
    }
    // What came loose from its shape, by another clip that is gone, comes back no faster than jaws close.
    const double way = std::sqrt(furthest), part = way > kClosing * dt ? kClosing * dt / way : 1.0;
    for (int i = 0; i < g.count; ++i) {
      const Vector3d& x = s.tissue.x[g.knots[i]];
      g.goal[i] = x + part * (g.goal[i] - x);
    }
    fem::prepareGroup(g);
  }
}

void tellClips(Context& c, std::size_t object, double dt) {
  for (const fem::TissueGroup& g : c.scratch.objects[object].tissue.groups) {
    Clip& clip = c.state.fasteners.clips[g.source];
    clip.force = 0.0;
    for (int i = 0; i < g.count; ++i)
      clip.force += 0.5 * inwardOf(clip, g.member[i]) * g.impulse[i].dot(clip.rotation.col(0)) / dt;
  }
}

bool removeClip(Context& c, std::uint64_t id) {
  bool found = false;
  for (Clip& clip : c.state.fasteners.clips) {
    if (!clip.alive || clip.id != id) continue;
    if (clip.shut) emit(c, eventOf(c, clip, EventKind::Unclipped));
    clip.alive = false;
    found = true;
  }
  return found;
}

void fasten(Context& c) {
  fastenClips(c);
  fastenSlings(c);
}

void addFasteners(const WorldState& state, std::vector<Attachment>& out) {
  for (const Clip& clip : state.fasteners.clips) {
    if (!clip.alive) continue;
    Attachment a;
    a.id = clip.id;
    a.kind = 1;  // vest_msgs/TissueAttachment CLIP
    a.anchor.object = clip.object;
    a.anchor.knots = {clip.knots[0], clip.knots[clip.count / 2], clip.knots[0], clip.knots[0]};
    a.anchor.weights = {0.5, 0.5, 0.0, 0.0};
    a.pose.linear() = clip.rotation;
    a.pose.translation() = clip.centre + clip.rotation * clip.offset;
    a.station = clip.station;
    a.closure = clipClosure(state.objects[clip.object], clip);
    a.instrument = clip.shut ? -1 : clip.instrument;
    out.push_back(a);
  }
  for (const interaction::Sling& sling : state.fasteners.slings) {
    if (!sling.alive || !sling.around) continue;
    Attachment a;
    attachSling(state, sling, a);
    out.push_back(a);
  }
}

double clipClosure(const ObjectState& s, const Clip& clip) {
  if (clip.ring < 3) return clip.progress;
  std::array<Vector3d, interaction::kMaxClipKnots> places;
  for (int i = 0; i < clip.ring; ++i) places[i] = knotPosition(s, clip.knots[i]);
  const double least = interaction::polygonArea(clip.closed.data(), clip.ring),
               now = interaction::polygonArea(places.data(), clip.ring);
  return std::clamp((clip.area - now) / std::max(clip.area - least, 1e-12), 0.0, 1.0);
}

}  // namespace vest::scene
