#include <algorithm>
#include <cmath>

#include "engine_state.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::exercise {
namespace {

using Eigen::Vector3d;

constexpr double kMmHg = 133.322;  ///< Pa
constexpr auto kCamera = static_cast<std::size_t>(tools::Instrument::Endoscope);

Vector3d placeOf(const BuiltMark& mark, const scene::World& world) {
  return mark.object < 0 ? mark.at : world.knotAt(static_cast<std::size_t>(mark.object), mark.knot) + mark.at;
}

/// Cosine of the angle between the line of sight and the way to a point.
double cosineOfSight(const scene::StepInput& input, const Vector3d& point) {
  const scene::ToolInput& camera = input.tools[kCamera];
  const Vector3d way = point - camera.position;
  const double length = std::sqrt(way.squaredNorm());
  if (!camera.present || !(length > 0)) return -1;
  return std::clamp((camera.orientation * camera.sight).dot(way) / length, -1.0, 1.0);
}

/// Of the last 20 ms, with the newest. @param s ToolState or ThreadsState
template <class S>
double mean(S& s, std::size_t window, double newest) {
  s.window[s.at] = newest;
  s.at = (s.at + 1) % window;
  double sum = 0;
  for (std::size_t i = 0; i < window; ++i) sum += s.window[i];
  return sum / static_cast<double>(window);
}

void measureTools(const Engine::Model& m, const scene::StepInput& input, const scene::StepReport& report,
                  Engine::State& s) {
  const bool chord = s.clock.steps % kMotionEvery == 0;
  const double dt = input.dt;
  constexpr double kPictureCosine = 0.81915204428899180;  // of kPictureHalfAngle
  for (std::size_t i = 0; i < kHands; ++i) {
    ToolState& t = s.tools[i];
    const scene::ToolInput& tool = input.tools[i];
    const scene::ContactModel& contact = report.contacts[i];
    t.force = mean(t, m.window, contact.wrench.head<3>().norm());
    t.peak = std::max(t.peak, t.force);
    t.impulse += std::max(0.0, t.force - kFreeForce) * dt;
    t.free = contact.in_contact ? 0.0 : t.free + dt;
    if (contact.in_contact && t.touching == 0) ++t.touches;
    t.touching = t.free < kTouchPause;
    const bool hidden =
        tool.present && input.tools[kCamera].present && cosineOfSight(input, tool.position) < kPictureCosine;
    t.hidden = hidden ? t.hidden + dt : 0.0;
    if (t.hidden > kOutOfViewPause) t.out_of_view += dt;
    if (!chord) continue;
    if (tool.present && t.seen != 0) {
      const double way =
          std::sqrt((tool.position - Vector3d(t.place[0], t.place[1], t.place[2])).squaredNorm());
      const double over = dt * static_cast<double>(kMotionEvery);
      t.path += way;
      t.moves = way >= kIdleSpeed * over;
      if (t.moves == 0) t.idle += over;
    }
    t.seen = tool.present;
    t.place = {tool.position.x(), tool.position.y(), tool.position.z()};
  }
  if (chord && s.tools[0].moves != 0 && s.tools[1].moves != 0)
    s.clock.both_move += dt * static_cast<double>(kMotionEvery);
}

void measureContacts(const scene::World& world, const scene::StepReport& report, Engine::State& s) {
  for (ObjectState& o : s.objects) o.contact.fill(0.0);
  for (const scene::ContactSide& side : world.state().sides) {
    ObjectState& o = s.objects[side.object];
    if (side.tool < kHands && report.contacts[side.tool].in_contact)
      o.contact[side.tool] = s.tools[side.tool].force;
  }
  for (ObjectState& o : s.objects)
    o.contact_peak = std::max(o.contact_peak, *std::max_element(o.contact.begin(), o.contact.end()));
}

/// Direction of a tube at a station, from ring to ring; zero where there is none.
Vector3d tubeAxis(const scene::World& world, std::size_t object, double station) {
  const net::TubeMap& tube = world.model().objects[object].tube;
  if (tube.ringCount() < 3) return Vector3d::Zero();
  const auto middle = [&](std::size_t ring) {
    Vector3d sum = Vector3d::Zero();
    for (const std::uint32_t k : tube.knots(ring)) sum += world.knotAt(object, k);
    return Vector3d(sum / static_cast<double>(tube.knots(ring).size()));
  };
  const std::size_t ring = std::clamp<std::size_t>(tube.nearestRing(station), 1, tube.ringCount() - 2);
  return middle(ring + 1) - middle(ring - 1);
}

/// m, of a point from the straight line between two others.
double aside(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d way = b - a;
  const double squared = way.squaredNorm();
  const double along = squared > 0 ? std::clamp((p - a).dot(way) / squared, 0.0, 1.0) : 0.0;
  return std::sqrt((p - a - along * way).squaredNorm());
}

/// m, of an object's knots.
Vector3d middleOf(const scene::World& world, std::size_t object) {
  Vector3d sum = Vector3d::Zero();
  const std::size_t knots = world.knotCount(object);
  for (std::size_t k = 0; k < knots; ++k) sum += world.knotAt(object, k);
  return sum / static_cast<double>(knots);
}

void measureEvents(const Engine::Model& m, const scene::World& world, const scene::StepReport& report,
                   Engine::State& s) {
  for (const scene::Event& e : report.events) {
    if (e.object >= s.objects.size()) continue;
    ObjectState& o = s.objects[e.object];
    Metric off = Metric::Time;
    if (e.kind == scene::EventKind::Fault) s.clock.flags |= kFault;
    if (e.kind == scene::EventKind::Cut) {
      if (std::isfinite(e.area)) o.cut_area += e.area;
      off = Metric::CutOff;
      if (std::isfinite(e.station))
        o.cut_first = std::min(o.cut_first, e.station), o.cut_last = std::max(o.cut_last, e.station);
      for (std::size_t n = 0; n < m.numbers.size(); ++n) {
        const BuiltNumber& number = m.numbers[n];
        if (number.metric != Metric::CutAside || !number.objects.in[e.object]) continue;
        s.numbers[n] = std::max(s.numbers[n], aside(e.position, placeOf(m.marks[number.marks[0]], world),
                                                    placeOf(m.marks[number.marks[1]], world)));
      }
    }
    if (e.kind == scene::EventKind::Clipped) {
      o.clips += 1;
      off = Metric::ClipOff;
      const Vector3d axis = tubeAxis(world, e.object, e.station);
      const double length = std::sqrt(axis.squaredNorm());
      for (const interaction::Clip& clip : world.state().fasteners.clips) {
        if (!clip.alive || clip.object != e.object || clip.station != e.station || !(length > 0)) continue;
        const double along = std::abs(clip.rotation.col(1).dot(axis)) / length;
        o.clip_tilt = std::max(o.clip_tilt, degrees(std::min(1.0, along)));
      }
    }
    if (off == Metric::Time || !std::isfinite(e.station)) continue;
    for (std::size_t n = 0; n < m.numbers.size(); ++n) {
      const BuiltNumber& number = m.numbers[n];
      if (number.metric != off || !number.objects.in[e.object]) continue;
      double nearest = 1e9;
      for (const double station : number.stations) nearest = std::min(nearest, std::abs(e.station - station));
      s.numbers[n] = std::max(s.numbers[n], nearest);
    }
  }
}

/// Damage of tissue by knots: volume times damage, all or outside a region; or how much of a region is
/// sealed.
double damageOf(const BuiltNumber& number, const scene::World& world, Engine::Scratch& scratch) {
  double sum = 0, sealed = 0, there = 0;
  for (std::size_t i = 0; i < number.objects.list.size(); ++i) {
    const std::size_t object = number.objects.list[i];
    const std::size_t knots = world.knotCount(object);
    if (knots > scratch.damage.size()) continue;
    world.field(object, scene::Field::Damage, scratch.damage.data());
    const scene::Object& described = world.description().objects[object];
    const auto& doubled = world.topology(object).doubled_knots;
    const std::size_t first = described.mass.size();
    for (std::size_t k = 0; k < knots; ++k) {
      std::size_t of = k;  // a copy of a cut knot counts with the knot that it was; its mass is shared
      while (of >= first && of - first < doubled.size()) of = doubled[of - first];
      if (of >= first) continue;
      const bool inside = !number.regions.empty() && number.regions[i][of] != 0;
      const auto damage = static_cast<double>(scratch.damage[k]);
      if (number.metric == Metric::Sealed) {
        there += inside && k < first;
        sealed += inside && k < first && damage >= kSealedDamage;
      } else if (k < first && (number.metric == Metric::Damage || !inside)) {
        sum += described.mass[of] / described.density * damage;
      }
    }
  }
  if (number.metric == Metric::Sealed) return there > 0 ? 100.0 * sealed / there : 0.0;
  return 1e9 * sum;
}

/// m: how far a cut's line is from a circle, beyond the way that leads to it; greatest, or root mean square.
double roundOf(const BuiltNumber& number, const scene::World& world) {
  const Circle& circle = number.circles.front();
  const auto off = [&](const Vector3d& p) {
    const Vector3d way = p - circle.centre, flat = way - circle.normal.dot(way) * circle.normal;
    return std::abs(std::sqrt(flat.squaredNorm()) - circle.radius);
  };
  double most = 0, squares = 0, length = 0;
  for (const std::size_t object : number.objects.list)
    for (const interaction::CutTrack& track : world.state().objects[object].cut.tracks) {
      const Vector3d a(track.from[0], track.from[1], track.from[2]), b(track.to[0], track.to[1], track.to[2]),
          middle = 0.5 * (a + b);
      if (number.circles.size() > 1 && (middle - number.circles[1].centre).squaredNorm() <
                                           number.circles[1].radius * number.circles[1].radius)
        continue;
      const double at_a = off(a), at_middle = off(middle), at_b = off(b),
                   l = std::sqrt((b - a).squaredNorm());
      most = std::max({most, at_a, at_middle, at_b});
      squares += l * (at_a * at_a + 4.0 * at_middle * at_middle + at_b * at_b) / 6.0;  // Simpson
      length += l;
    }
  if (number.metric == Metric::CutRound) return most;
  return length > 0 ? std::sqrt(squares / length) : 0.0;
}

double bitesOf(const BuiltNumber& number, const scene::Bites& bites) {
  double count = 0;
  for (std::size_t i = 0; i < bites.count; ++i)
    count += !bites.mouths[i].exit && number.objects.in[bites.mouths[i].object] != 0;
  return count;
}

/// m: of the ends of ways through tissue from the nearest of their marks.
double biteOff(const BuiltNumber& number, const scene::Bites& bites) {
  double most = 0;
  for (std::size_t i = 0; i < bites.count; ++i) {
    const scene::Mouth& mouth = bites.mouths[i];
    if (!number.objects.in[mouth.object]) continue;
    double nearest = 1e9;
    for (const Circle& mark : number.circles)
      nearest = std::min(nearest, (mouth.rest - mark.centre).squaredNorm());
    most = std::max(most, nearest);
  }
  return std::sqrt(most);
}

void measureThreads(const Engine::Model& m, const scene::World& world, Engine::State& s,
                    Engine::Scratch& scratch) {
  ThreadsState& t = s.threads;
  if (m.tension) {
    t.tension = mean(t, m.window, scene::threadTension(world));
    t.peak = std::max(t.peak, t.tension);
  }
  if (!m.knots || s.clock.steps % kPartsEvery != 0) return;
  const scene::Knot knot = scene::findKnot(world, scratch.knots);
  if (knot.kind.determinant == 0) return;  // too tangled to be told
  t.determinant = static_cast<double>(knot.kind.determinant);
  t.tail = knot.tail;
  scene::findBites(world, scratch.bites);
  double nearest = knot.kind.determinant > 1 ? 1e9 : 0;  // without a bite a knot is far from every one
  for (std::size_t i = 0; i < scratch.bites.count; ++i)
    nearest = std::min(nearest, (scratch.bites.mouths[i].now - knot.place).squaredNorm());
  t.off = std::sqrt(nearest);
}

/// Of all objects that the number is about, by mass.
double looseOf(const BuiltNumber& number, const scene::World& world, scene::LooseScratch& scratch) {
  double loose = 0, whole = 0;
  for (const std::size_t object : number.objects.list) {
    double mass = 0;
    for (const double m : world.description().objects[object].mass) mass += m;
    const scene::LooseShare share = scene::looseShare(world, object, scratch);
    loose += mass * (number.metric == Metric::Removed ? share.removed : share.all), whole += mass;
  }
  return whole > 0 ? 100.0 * loose / whole : 0.0;
}

}  // namespace

double degrees(double cosine) {
  const double x = std::abs(cosine);
  constexpr std::array<double, 8> a{1.5707963050, -0.2145988016, 0.0889789874, -0.0501743046,
                                    0.0308918810, -0.0170881256, 0.0066700901, -0.0012624911};
  double p = 0;
  for (std::size_t i = a.size(); i-- > 0;) p = p * x + a[i];
  const double angle = std::sqrt(std::max(0.0, 1.0 - x)) * p;
  constexpr double kPi = 3.14159265358979323846;
  return 180.0 / kPi * (cosine < 0 ? kPi - angle : angle);
}

void measure(const Engine::Model& m, const scene::World& world, const scene::StepInput& input,
             const scene::StepReport& report, Engine::State& s, Engine::Scratch& scratch) {
  measureTools(m, input, report, s);
  measureContacts(world, report, s);
  measureEvents(m, world, report, s);
  measureThreads(m, world, s, scratch);
  if (s.clock.steps % kFieldsEvery != 0) return;
  for (std::size_t n = 0; n < m.numbers.size(); ++n) {
    const Metric metric = m.numbers[n].metric;
    if (metric == Metric::Damage || metric == Metric::DamageOutside || metric == Metric::Sealed)
      s.numbers[n] = damageOf(m.numbers[n], world, scratch);
    if (metric == Metric::CutRound || metric == Metric::CutRoundRms)
      s.numbers[n] = roundOf(m.numbers[n], world);
    if (metric == Metric::Bites || metric == Metric::BiteOff) {
      scene::findBites(world, scratch.bites);
      s.numbers[n] = metric == Metric::Bites ? bitesOf(m.numbers[n], scratch.bites)
                                             : biteOff(m.numbers[n], scratch.bites);
    }
    if ((metric == Metric::CutFree || metric == Metric::Removed) && s.clock.steps % kPartsEvery == 0)
      s.numbers[n] = looseOf(m.numbers[n], world, scratch.loose);
  }
  if (m.pools && m.field) s.clock.pool = fluid::poolVolume(m.field->fluidModel(), m.field->fluid());
}

/// What the patient monitor shows, in the units of the ward.
double ofPatient(Metric metric, const simulation::BloodEffect& blood) {
  const haemodynamics::CirculationState& c = blood.circulation();
  switch (metric) {
    case Metric::HeartRate:
      return c.arrested ? 0.0 : 60 * c.heart_rate;
    case Metric::Systolic:
      return c.systolic / kMmHg;
    case Metric::MeanPressure:
      return c.mean / kMmHg;
    case Metric::Given:
      return 1e6 * c.given;
    case Metric::Haematocrit:
      return 100 * haemodynamics::haematocrit(blood.model(), c);
    case Metric::Oxygen: {
      const double seen = static_cast<double>(haemodynamics::monitorCurves(blood.model(), c).spo2);
      return std::isfinite(seen) ? 100 * seen : 0.0;
    }
    case Metric::Vasopressor:
      return 100 * haemodynamics::drugResistance(blood.model(), blood.settings(), c);
    default:
      return c.arrested ? 1.0 : 0.0;
  }
}

double valueOf(const Engine::Model& m, const Engine::State& s, std::size_t number, const scene::World& world,
               const scene::StepInput& input) {
  const BuiltNumber& n = m.numbers[number];
  const Clock& c = s.clock;
  const auto overObjects = [&](auto get, bool greatest) {
    double all = 0;
    for (const std::size_t o : n.objects.list)
      all = greatest ? std::max(all, get(s.objects[o])) : all + get(s.objects[o]);
    return all;
  };
  switch (n.metric) {
    case Metric::Time:
      return sinceBegin(c);
    case Metric::BloodLost:
      return m.blood ? 1e6 * (m.blood->circulation().lost - c.lost_at_start) : 0.0;
    case Metric::Leak: {
      if (!m.blood) return 0.0;
      const bleeding::WoundState& w = m.blood->wounds();
      double flow = 0;
      for (int i = 0; i < w.opening_count; ++i) flow += w.openings[static_cast<std::size_t>(i)].flow;
      return 1e6 * flow;
    }
    case Metric::Pool:
      return 1e6 * c.pool;
    case Metric::Sucked:
      return m.field ? 1e6 * (m.field->fluid().sucked - c.sucked_at_start) : 0.0;
    case Metric::Path:
      return 1e3 * s.tools[n.tool].path;
    case Metric::Idle:
      return s.tools[n.tool].idle;
    case Metric::Force:
      return s.tools[n.tool].force;
    case Metric::ForcePeak:
      return s.tools[n.tool].peak;
    case Metric::ForceImpulse:
      return s.tools[n.tool].impulse;
    case Metric::Touches:
      return static_cast<double>(s.tools[n.tool].touches);
    case Metric::BothMove:
      return c.both_move;
    case Metric::OutOfView:
      return s.tools[n.tool].out_of_view;
    case Metric::Distance: {
      const scene::ToolInput& tool = input.tools[n.tool];
      if (!tool.present) return 1e9;
      return 1e3 * std::sqrt((tool.position - placeOf(m.marks[n.marks[0]], world)).squaredNorm());
    }
    case Metric::TipHeight:
      return input.tools[n.tool].present ? 1e3 * input.tools[n.tool].position.z() : 0.0;
    case Metric::OffCentre:
      return degrees(cosineOfSight(input, placeOf(m.marks[n.marks[0]], world)));
    case Metric::Horizon: {
      const scene::ToolInput& camera = input.tools[kCamera];
      if (!camera.present) return 90.0;
      return 90.0 - degrees(std::min(1.0, std::abs((camera.orientation * Vector3d::UnitX()).z())));
    }
    case Metric::Contact:
      return overObjects([&](const ObjectState& o) { return o.contact[n.tool]; }, true);
    case Metric::ContactPeak:
      return overObjects([](const ObjectState& o) { return o.contact_peak; }, true);
    case Metric::Damage:
    case Metric::DamageOutside:
    case Metric::Sealed:
    case Metric::Bites:
    case Metric::CutFree:
    case Metric::Removed:
      return s.numbers[number];
    case Metric::ClipOff:
    case Metric::CutOff:
      return 1e3 * s.numbers[number];
    case Metric::CutAside:
    case Metric::CutRound:
    case Metric::CutRoundRms:
    case Metric::BiteOff:
      return 1e3 * s.numbers[number];
    case Metric::CutLength:
      return 1e3 *
             overObjects([](const ObjectState& o) { return std::max(0.0, o.cut_last - o.cut_first); }, true);
    case Metric::PlaceOff: {
      double most = 0;
      for (const std::size_t o : n.objects.list)
        most = std::max(most, (middleOf(world, o) - placeOf(m.marks[n.marks[0]], world)).squaredNorm());
      return 1e3 * std::sqrt(most);
    }
    case Metric::Apart:
      return 1e3 *
             std::sqrt(
                 (placeOf(m.marks[n.marks[0]], world) - placeOf(m.marks[n.marks[1]], world)).squaredNorm());
    case Metric::KnotDeterminant:
      return s.threads.determinant;
    case Metric::KnotOff:
      return 1e3 * s.threads.off;
    case Metric::Tail:
      return 1e3 * s.threads.tail;
    case Metric::ThreadTension:
      return s.threads.tension;
    case Metric::ThreadTensionPeak:
      return s.threads.peak;
    case Metric::HeartRate:
    case Metric::Systolic:
    case Metric::MeanPressure:
    case Metric::Given:
    case Metric::Haematocrit:
    case Metric::Oxygen:
    case Metric::Vasopressor:
    case Metric::Arrested:
      return m.blood ? ofPatient(n.metric, *m.blood) : 0.0;
    case Metric::GasPressure:
      return m.gas ? m.gas->now().pressure / kMmHg : 0.0;
    case Metric::Fog:
      return m.field ? 100 * m.field->fog() : 0.0;
    case Metric::CutArea:
      return 1e6 * overObjects([](const ObjectState& o) { return o.cut_area; }, false);
    case Metric::Clips:
      return overObjects([](const ObjectState& o) { return o.clips; }, false);
    case Metric::ClipTilt:
      return overObjects([](const ObjectState& o) { return o.clip_tilt; }, true);
    case Metric::FilteredPath:
    case Metric::AngularPath:
    case Metric::DepthPath:
    case Metric::DepthTurns:
    case Metric::Economy:
    case Metric::MeanSpeed:
    case Metric::PeakSpeed:
    case Metric::Rest:
    case Metric::RmsJerk:
    case Metric::Sparc:
    case Metric::Ldlj:
    case Metric::Bimanual:
    case Metric::PathRatio:
      break;  // known at the end alone (result.cpp)
  }
  return 0;
}

}  // namespace vest::exercise
