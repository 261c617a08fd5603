#include "vest_effects/bleeding/wounds.h"

#include <algorithm>
#include <cmath>

namespace vest::bleeding {

namespace {

using haemodynamics::SegmentModel;

bool inside(const Vessels& vessels, int vessel, double station) {
  return vessel >= 0 && vessel < vessels.vesselCount() && station >= 0 && station <= vessels.length(vessel);
}

/// Lowest free slot: a source keeps its own while it lives.
std::uint16_t freeSlot(const WoundState& state) {
  for (std::uint16_t slot = 0;; ++slot) {
    bool taken = false;
    for (int i = 0; i < state.opening_count; ++i) taken = taken || state.openings[i].slot == slot;
    if (!taken) return slot;
  }
}

/// Forgets an opening that bleeds no more.
bool freeOpening(WoundState& state) {
  for (int i = 0; i < state.opening_count; ++i) {
    if (state.openings[i].sealed < state.openings[i].area) continue;
    for (int k = i; k + 1 < state.opening_count; ++k) state.openings[k] = state.openings[k + 1];
    state.openings[--state.opening_count] = Opening{};
    return true;
  }
  return false;
}

void dropClamp(int index, WoundState& state) {
  for (int i = index; i + 1 < state.clamp_count; ++i) state.clamps[i] = state.clamps[i + 1];
  state.clamps[--state.clamp_count] = Clamp{};
}

/// Forgets a closure for good right beside another one that is shut, with no opening between.
bool freeClamp(const Place& place, WoundState& state) {
  for (int i = 0; i < state.clamp_count; ++i) {
    const Clamp& a = state.clamps[i];
    if (a.kind == ClampKind::kClip || a.kind == ClampKind::kCut) continue;
    bool needless = a.opening >= 1;
    for (int k = 0; k < state.clamp_count && !needless; ++k) {
      const Clamp& b = state.clamps[k];
      needless = k != i && b.vessel == a.vessel && b.opening <= a.opening && b.kind != ClampKind::kClip &&
                 std::fabs(b.station - a.station) <= place.same();
      for (int o = 0; o < state.opening_count && needless; ++o) {
        const double at = state.openings[o].station;
        needless = state.openings[o].vessel != a.vessel || (at < a.station) == (at < b.station);
      }
    }
    if (!needless) continue;
    dropClamp(i, state);
    return true;
  }
  return false;
}

bool cutThrough(const Vessels& vessels, int index, WoundState& state) {
  if (state.opening_count >= kMostOpenings || state.clamp_count >= kMostClamps) return false;
  Opening& heart = state.openings[index];
  heart.area = vessels.lumen(heart.vessel, heart.station);
  heart.sealed = heart.clot = heart.spasm = 0;  // what was sealed is cut
  heart.end = End::kHeart;
  Opening far = heart;
  far.end = End::kFar;
  far.lost = far.flow = 0;
  far.slot = freeSlot(state);
  far.wound = state.next_wound++;
  state.openings[state.opening_count++] = far;
  state.clamps[state.clamp_count++] = {ClampKind::kCut, heart.vessel, heart.station, 0};
  return true;
}

int faceAt(const SegmentModel& s, double station) {
  return std::clamp(static_cast<int>(station / s.dx + 0.5), 1, s.cells - 1);
}
/// Stumps need a cell and a face for a clip on either side.
int cutFace(const SegmentModel& s, double station) {
  const int face = faceAt(s, station);
  return s.cells >= 4 ? std::clamp(face, 2, s.cells - 2) : face;
}

/// Cell of an artery's opening.
int cellOf(const SegmentModel& s, const Opening& o) {
  if (o.end == End::kWall) return std::clamp(static_cast<int>(o.station / s.dx), 0, s.cells - 1);
  const int face = cutFace(s, o.station);
  return o.end == End::kHeart ? face - 1 : face;
}

}  // namespace

bool open(const Vessels& vessels, const Place& place, double area, const Opening& like, WoundState& state) {
  const int vessel = place.vessel;
  const double station = place.station;
  if (!inside(vessels, vessel, station) || !(area > 0) || !std::isfinite(area)) return false;
  const double lumen = vessels.lumen(vessel, station);
  int index = -1;
  for (int i = 0; i < state.clamp_count; ++i) {
    const Clamp& c = state.clamps[i];
    if (c.kind == ClampKind::kCut && c.vessel == vessel && std::fabs(c.station - station) <= place.same())
      return true;  // through already
  }
  for (int i = 0; i < state.opening_count; ++i) {
    const Opening& o = state.openings[i];
    if (o.vessel == vessel && o.end == End::kWall && std::fabs(o.station - station) <= place.same())
      index = i;
  }
  if (index < 0) {
    if (state.opening_count >= kMostOpenings && !freeOpening(state)) {
      ++state.refused;
      return false;
    }
    Opening o = like;
    o.wound = state.next_wound++;
    o.slot = freeSlot(state);
    o.vessel = static_cast<std::int16_t>(vessel);
    o.end = End::kWall;
    o.station = station;
    o.area = o.sealed = o.clot = o.spasm = o.lost = o.flow = 0;
    index = state.opening_count++;
    state.openings[index] = o;
  }
  Opening& o = state.openings[index];
  o.area += area;
  if (o.area < kThrough * lumen) return true;
  const std::uint32_t wound = o.wound;
  if (state.opening_count >= kMostOpenings) freeOpening(state);
  if (state.clamp_count >= kMostClamps) freeClamp(place, state);
  for (index = 0; state.openings[index].wound != wound;) ++index;  // it may have moved up
  if (cutThrough(vessels, index, state)) return true;
  ++state.refused;
  state.openings[index].area = std::min(state.openings[index].area, lumen);
  return false;
}

bool clamp(const Vessels& vessels, ClampKind kind, const Place& place, double opening, WoundState& state) {
  if (!inside(vessels, place.vessel, place.station) || !(opening >= 0 && opening <= 1)) return false;
  if (state.clamp_count >= kMostClamps && !freeClamp(place, state)) {
    ++state.refused;
    return false;
  }
  state.clamps[state.clamp_count++] = {kind, static_cast<std::int16_t>(place.vessel), place.station, opening};
  return true;
}

bool release(const Place& place, WoundState& state) {
  int nearest = -1;
  double distance = 2 * place.same();
  for (int i = 0; i < state.clamp_count; ++i) {
    const Clamp& c = state.clamps[i];
    if (c.kind != ClampKind::kClip || c.vessel != place.vessel ||
        std::fabs(c.station - place.station) > distance)
      continue;
    nearest = i;
    distance = std::fabs(c.station - place.station);
  }
  if (nearest < 0) return false;
  dropClamp(nearest, state);
  return true;
}

bool seal(const Vessels& vessels, const Place& place, double area, bool lumen, WoundState& state) {
  const double station = place.station;
  if (!inside(vessels, place.vessel, station) || !(area > 0) || !std::isfinite(area)) return false;
  bool stump = false;
  for (int i = 0; i < state.opening_count; ++i) {
    Opening& o = state.openings[i];
    const double beside = station - o.station;  // m, > 0: far from the heart
    if (o.vessel != place.vessel || std::fabs(beside) > place.same()) continue;
    const bool at_stump = o.end != End::kWall;
    stump = stump || at_stump;
    if (at_stump && beside * static_cast<int>(o.end) < 0) continue;  // the other one's side
    const double taken = std::max(0.0, std::min(area, o.area - o.sealed));
    o.sealed += taken;
    area -= taken;
  }
  if (stump || !lumen || !(area > 0)) return true;
  // The wall shrinks together: a narrowing that further heat closes.
  const double share = area / vessels.lumen(place.vessel, station);
  for (int i = 0; i < state.clamp_count; ++i) {
    Clamp& c = state.clamps[i];
    if (c.kind != ClampKind::kSeal || c.vessel != place.vessel ||
        std::fabs(c.station - station) > place.same())
      continue;
    c.opening = std::max(0.0, c.opening - share);
    return true;
  }
  return clamp(vessels, ClampKind::kSeal, place, std::max(0.0, 1 - share), state);
}

void fill(const Vessels& vessels, const WoundState& state, const Pinches& pinches,
          haemodynamics::CirculationInputs& inputs) {
  const double kBeside = 1e-6;  // m: which side of a cut through a vein a stump lies on
  inputs.hole_count = state.opening_count;
  for (int i = 0; i < state.opening_count; ++i) {
    const Opening& o = state.openings[i];
    double station = o.station;
    if (vessels.isVein(o.vessel)) {
      station = std::clamp(station + kBeside * static_cast<int>(o.end), 0.0, vessels.length(o.vessel));
    } else if (o.end != End::kWall) {
      const SegmentModel& s = vessels.arteries.segments[o.vessel];
      station = (cellOf(s, o) + 0.5) * s.dx;
    }
    inputs.holes[i] = {o.vessel, station, o.open()};
  }
  inputs.closure_count = 0;
  const auto shut = [&](int vessel, double place, double opening, bool cut) {
    double station = place;
    if (!vessels.isVein(vessel)) {
      const SegmentModel& s = vessels.arteries.segments[vessel];
      int face = cut ? cutFace(s, station) : faceAt(s, station);
      for (int k = 0; !cut && k < state.opening_count; ++k) {
        const Opening& o = state.openings[k];
        if (o.vessel != vessel) continue;
        // A clip right on a stump belongs to the stump's side of it.
        const bool before = place < o.station || (place == o.station && o.end != End::kFar);
        const int cell = cellOf(s, o);
        face = before ? std::min(face, cell) : std::max(face, cell + 1);
      }
      station = std::clamp(face, 1, s.cells - 1) * s.dx;
    }
    inputs.closures[inputs.closure_count++] = {vessel, std::min(station, vessels.length(vessel)), opening};
  };
  for (int i = 0; i < state.clamp_count; ++i) {
    const Clamp& c = state.clamps[i];
    shut(c.vessel, c.station, c.opening, c.kind == ClampKind::kCut);
  }
  for (int i = 0; i < std::min(pinches.count, kMostPinches); ++i) {
    const Pinch& p = pinches.each[i];
    if (!inside(vessels, p.place.vessel, p.place.station) || !(p.opening >= 0 && p.opening < 1)) continue;
    shut(p.place.vessel, p.place.station, p.opening, false);
    // Jaws on the opening itself hold that shut, too.
    for (int k = 0; k < state.opening_count; ++k)
      if (state.openings[k].vessel == p.place.vessel && state.openings[k].end == End::kWall &&
          std::fabs(state.openings[k].station - p.place.station) <= p.place.same())
        inputs.holes[k].area *= p.opening;
  }
}

void book(const Vessels& vessels, const haemodynamics::CirculationState& circulation, double dt,
          WoundState& state) {
  for (int i = 0; i < state.opening_count; ++i) {
    Opening& o = state.openings[i];
    o.flow = circulation.hole_flow[i];
    o.lost += o.flow * dt;
    const double time = o.flow < kStillFlow ? kStillClotting
                        : o.end == End::kWall && o.area <= kSmallHole && !vessels.isVein(o.vessel)
                            ? kHoleClotting
                            : 0;
    if (o.end != End::kWall && !vessels.isVein(o.vessel))
      o.spasm += (kSpasm * o.area - o.spasm) * dt / (dt + kSpasmTime);
    if (time > 0) o.clot = std::max(0.0, std::min(o.area - o.sealed, o.clot + o.area * dt / time));
  }
}

double closure(int vessel, const WoundState& state) {
  double open = 1;
  for (int i = 0; i < state.clamp_count; ++i)
    if (state.clamps[i].vessel == vessel) open = std::min(open, state.clamps[i].opening);
  return 1 - open;
}

}  // namespace vest::bleeding
