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

bool cutThrough(const Vessels& vessels, int index, WoundState& state) {
  if (state.opening_count >= kMostOpenings || state.clamp_count >= kMostClamps) return false;
  Opening& heart = state.openings[index];
  heart.area = vessels.lumen(heart.vessel, heart.station);
  heart.sealed = 0;  // what was sealed is cut
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

bool open(const Vessels& vessels, int vessel, double station, double area, const Opening& like,
          WoundState& state) {
  if (!inside(vessels, vessel, station) || !(area > 0) || !std::isfinite(area)) return false;
  const double lumen = vessels.lumen(vessel, station);
  int index = -1;
  for (int i = 0; i < state.opening_count; ++i) {
    Opening& o = state.openings[i];
    if (o.vessel != vessel || std::fabs(o.station - station) > kSamePlace) continue;
    if (o.end != End::kWall) return true;  // through already
    index = i;
  }
  if (index < 0) {
    if (state.opening_count >= kMostOpenings) {
      ++state.refused;
      return false;
    }
    Opening o = like;
    o.wound = state.next_wound++;
    o.slot = freeSlot(state);
    o.vessel = static_cast<std::int16_t>(vessel);
    o.end = End::kWall;
    o.station = station;
    o.area = o.sealed = o.lost = o.flow = 0;
    index = state.opening_count++;
    state.openings[index] = o;
  }
  Opening& o = state.openings[index];
  o.area += area;
  if (o.area < kThrough * lumen) return true;
  if (cutThrough(vessels, index, state)) return true;
  ++state.refused;
  o.area = std::min(o.area, lumen);
  return false;
}

bool clamp(const Vessels& vessels, ClampKind kind, int vessel, double station, double opening,
           WoundState& state) {
  if (!inside(vessels, vessel, station) || !(opening >= 0 && opening <= 1)) return false;
  if (state.clamp_count >= kMostClamps) {
    ++state.refused;
    return false;
  }
  state.clamps[state.clamp_count++] = {kind, static_cast<std::int16_t>(vessel), station, opening};
  return true;
}

bool release(int vessel, double station, WoundState& state) {
  int nearest = -1;
  double distance = 2 * kSamePlace;
  for (int i = 0; i < state.clamp_count; ++i) {
    const Clamp& c = state.clamps[i];
    if (c.kind != ClampKind::kClip || c.vessel != vessel || std::fabs(c.station - station) > distance)
      continue;
    nearest = i;
    distance = std::fabs(c.station - station);
  }
  if (nearest < 0) return false;
  for (int i = nearest; i + 1 < state.clamp_count; ++i) state.clamps[i] = state.clamps[i + 1];
  state.clamps[--state.clamp_count] = Clamp{};
  return true;
}

bool seal(const Vessels& vessels, int vessel, double station, double area, bool lumen, WoundState& state) {
  if (!inside(vessels, vessel, station) || !(area > 0) || !std::isfinite(area)) return false;
  bool stump = false;
  for (int i = 0; i < state.opening_count; ++i) {
    Opening& o = state.openings[i];
    if (o.vessel != vessel || std::fabs(o.station - station) > kSamePlace) continue;
    stump = stump || o.end != End::kWall;
    const double taken = std::min(area, o.area - o.sealed);
    o.sealed += taken;
    area -= taken;
  }
  if (stump || !lumen || !(area > 0)) return true;
  // The wall shrinks together: a narrowing that further heat closes.
  const double share = area / vessels.lumen(vessel, station);
  for (int i = 0; i < state.clamp_count; ++i) {
    Clamp& c = state.clamps[i];
    if (c.kind != ClampKind::kSeal || c.vessel != vessel || std::fabs(c.station - station) > kSamePlace)
      continue;
    c.opening = std::max(0.0, c.opening - share);
    return true;
  }
  return clamp(vessels, ClampKind::kSeal, vessel, station, std::max(0.0, 1 - share), state);
}

void fill(const Vessels& vessels, const WoundState& state, haemodynamics::CirculationInputs& inputs) {
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
    inputs.holes[i] = {o.vessel, station, std::max(0.0, o.area - o.sealed)};
  }
  inputs.closure_count = state.clamp_count;
  for (int i = 0; i < state.clamp_count; ++i) {
    const Clamp& c = state.clamps[i];
    double station = c.station;
    if (!vessels.isVein(c.vessel)) {
      const SegmentModel& s = vessels.arteries.segments[c.vessel];
      int face = c.kind == ClampKind::kCut ? cutFace(s, station) : faceAt(s, station);
      for (int k = 0; c.kind != ClampKind::kCut && k < state.opening_count; ++k) {
        const Opening& o = state.openings[k];
        if (o.vessel != c.vessel) continue;
        // A clip right on a stump belongs to the stump's side of it.
        const bool before = c.station < o.station || (c.station == o.station && o.end != End::kFar);
        const int cell = cellOf(s, o);
        face = before ? std::min(face, cell) : std::max(face, cell + 1);
      }
      station = std::clamp(face, 1, s.cells - 1) * s.dx;
    }
    inputs.closures[i] = {c.vessel, std::min(station, vessels.length(c.vessel)), c.opening};
  }
}

void book(const haemodynamics::CirculationState& circulation, double dt, WoundState& state) {
  for (int i = 0; i < state.opening_count; ++i) {
    Opening& o = state.openings[i];
    o.flow = circulation.hole_flow[i];
    o.lost += o.flow * dt;
  }
}

double closure(int vessel, const WoundState& state) {
  double open = 1;
  for (int i = 0; i < state.clamp_count; ++i)
    if (state.clamps[i].vessel == vessel) open = std::min(open, state.clamps[i].opening);
  return 1 - open;
}

}  // namespace vest::bleeding
