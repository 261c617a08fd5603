#include "vest_effects/bleeding/surface.h"

#include "vest_effects/arithmetic.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace vest::bleeding {

namespace {

using Eigen::Vector3d;

double squaredDistance(const float* xyz, std::uint32_t knot, const Vector3d& place) {
  const double dx = xyz[3 * knot] - place.x(), dy = xyz[3 * knot + 1] - place.y(),
               dz = xyz[3 * knot + 2] - place.z();
  return dx * dx + dy * dy + dz * dz;
}

float raised(float value, double by) {
  const double v = value + by;
  return static_cast<float>(v < 1 ? v : 1);
}

/// A copy shares its original's surface: both carry the original's area until the scene is loaded anew.
std::uint32_t usedKnots(const SurfaceModel& model, const SurfaceState& state, std::size_t object) {
  return std::min(state.used[object], model.first[object + 1] - model.first[object]);
}

/// The first link from `link` on that begins at knot `knot` or behind it.
std::size_t endOfLinks(const SurfaceModel& model, std::size_t link, std::uint32_t knot) {
  const auto begin = model.link0.begin();
  return static_cast<std::size_t>(std::partition_point(begin + static_cast<std::ptrdiff_t>(link),
                                                       model.link0.end(),
                                                       [&](std::uint32_t k) { return k < knot; }) -
                                  begin);
}

}  // namespace

double supplyOf(const char* organ) {
  const double kPer100gMinute = 1e-6 / 60 / 0.1;  // ml/min per 100 g in m³/s per kg
  if (std::strcmp(organ, "uterus") == 0) return 26 * kPer100gMinute;
  if (std::strcmp(organ, "intestine") == 0) return 30 * kPer100gMinute;
  if (std::strcmp(organ, "ovary") == 0) return 40 * kPer100gMinute;
  if (std::strcmp(organ, "tube") == 0) return 10 * kPer100gMinute;
  if (std::strcmp(organ, "cavity") == 0) return 0;
  return 3 * kPer100gMinute;
}

SurfaceState initialSurface(const SurfaceModel& model) {
  SurfaceState s;
  for (auto* v : {&s.open, &s.drug, &s.styptic, &s.sealed, &s.flow}) v->assign(model.knots(), 0.0f);
  s.film.assign(model.knots(), 0.0);
  s.used = model.scene;
  s.dry.assign(model.scene.size(), 0);
  return s;
}

void openSurface(const SurfaceModel& model, std::size_t object, const float* positions, const Vector3d& place,
                 double reach, SurfaceState& state) {
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  std::uint32_t nearest = count;
  double least = 1e30;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (!(model.area[first + k] > 0)) continue;
    const double d = squaredDistance(positions, k, place);
    if (d < least) least = d, nearest = k;
    if (d > reach * reach) continue;
    state.open[first + k] = 1;
    state.sealed[first + k] = 0;
    state.active = 1;
  }
  if (nearest == count) return;
  state.dry[object] = 0;
  state.open[first + nearest] = 1;
  state.sealed[first + nearest] = 0;
  state.active = 1;
}

void sealSurface(const SurfaceModel& model, std::size_t object, const float* positions, const Vector3d& place,
                 double energy, SurfaceState& state) {
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  // Heat goes to the nearest surface that is not sealed yet; a few rounds reach what one event can.
  for (int round = 0; round < 16 && energy > 0; ++round) {
    std::uint32_t nearest = count;
    double least = 0.01 * 0.01;  // m²: heat does not reach farther
    for (std::uint32_t k = 0; k < count; ++k) {
      if (!(model.area[first + k] > 0) || state.sealed[first + k] >= 1) continue;
      const double d = squaredDistance(positions, k, place);
      if (d < least) least = d, nearest = k;
    }
    if (nearest == count) return;
    const std::uint32_t k = first + nearest;
    const double needed = (1 - state.sealed[k]) * kSealHeat * model.area[k];
    const double given = std::min(needed, energy);
    state.sealed[k] = given >= needed ? 1.0f : raised(state.sealed[k], given / (kSealHeat * model.area[k]));
    energy -= given;
  }
}

void washSurface(const SurfaceModel& model, std::size_t object, const float* positions,
                 const std::array<std::uint32_t, 3>& knots, double impulse, SurfaceState& state) {
  if (!state.active || object + 1 >= model.first.size() || !(impulse > 0)) return;
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  for (const std::uint32_t k : knots) {
    if (k >= count || !(state.film[first + k] > 0) || !(model.area[first + k] > 0)) continue;
    const double area = model.area[first + k], before = state.film[first + k];
    // dh/dt = −tau h²/(2 mu √A), solved exactly over the impulse.
    const double film = before / (1 + impulse / 3 * before / (2 * kFilmViscosity * area * std::sqrt(area)));
    state.film[first + k] = film;
    const double volume = (before - film) * area;
    state.washed += volume;
    for (std::uint32_t a = 0; a < 3; ++a) state.washed_moment[a] += volume * positions[3 * k + a];
  }
}

bool copyKnot(const SurfaceModel& model, std::size_t object, std::uint32_t original, SurfaceState& state) {
  const std::uint32_t first = model.first[object], room = model.first[object + 1] - first;
  const std::uint32_t copy = state.used[object]++;
  if (copy >= room || original >= copy) return false;
  state.dry[object] = 0;
  state.open[first + copy] = state.open[first + original];
  state.drug[first + copy] = state.drug[first + original];
  state.styptic[first + copy] = state.styptic[first + original];
  state.sealed[first + copy] = state.sealed[first + original];
  return true;
}

void stepSurface(const SurfaceModel& model, const SurfaceInputs& in, double dt, SurfaceState& state,
                 SurfaceRunoff* runoff) {
  SurfaceRunoff off;
  if (runoff) *runoff = off;
  if (!state.active || !in.positions) return;
  const double clotting = 1 / (1 + dt / kClottingTime), fading = 1 / (1 + dt / kStypticTime),
               constricting = dt / (dt + kConstrictionTime);
  off.volume = state.washed, off.place = Vector3d(state.washed_moment.data());
  state.shed += state.washed;
  state.washed = 0, state.washed_moment.fill(0);
  // Depots grow while needles inject; where a needle is set anew, another begins.
  std::array<double, 4> front{};  // m²
  for (std::size_t t = 0; t < front.size(); ++t) {
    if (!in.inject[t].on) continue;
    if ((Vector3d(state.depot[t].data()) - in.inject[t].place).squaredNorm() > kNewStitch * kNewStitch)
      state.injected[t] = 0;
    for (std::size_t a = 0; a < 3; ++a) state.depot[t][a] = in.inject[t].place[static_cast<int>(a)];
    state.injected[t] += kInjectionFlow * dt;
    front[t] = effects::power(3 * state.injected[t] / (4 * 3.14159265358979 * kInterstice), 2.0 / 3.0);
  }
  double shed_most = 0;
  std::size_t link = 0;
  for (std::size_t object = 0; object + 1 < model.first.size(); ++object) {
    const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
    const std::size_t end = endOfLinks(model, link, model.first[object + 1]);
    if (state.dry[object]) {
      link = end;
      continue;
    }
    const float* xyz = in.positions[object];
    double shed_here = 0;
    bool any = false;
    for (std::uint32_t k = 0; k < count && xyz; ++k) {
      const std::uint32_t i = first + k;
      state.flow[i] = 0;
      const bool dry = state.open[i] <= 0 && state.film[i] <= 0;
      if (dry || !(model.area[i] > 0)) continue;
      any = true;
      double pressed = 0;
      for (std::size_t t = 0; t < front.size(); ++t) {
        if (in.inject[t].on && squaredDistance(xyz, k, in.inject[t].place) < front[t]) state.drug[i] = 1;
        if (in.press[t].on && squaredDistance(xyz, k, in.press[t].place) < kPressReach * kPressReach)
          pressed = 1;
      }
      state.styptic[i] =
          static_cast<float>(state.styptic[i] + constricting * (state.drug[i] - state.styptic[i]));
      const double q = in.scale * model.supply[i] * in.pressure_ratio * state.open[i] *
                       (1.0 - state.styptic[i]) * (1.0 - state.sealed[i]) * (1 - pressed);
      state.flow[i] = static_cast<float>(q > 0 ? q : 0);
      const double grown = state.film[i] + state.flow[i] * dt / model.area[i];
      state.film[i] = std::min(grown, kFullFilm);
      if (state.film[i] < 1e-12) state.film[i] = 0;  // m: thinner than a molecule
      const double gone = (grown - state.film[i]) * model.area[i];
      state.seeped += state.flow[i] * dt;
      if (gone > 0) {
        state.shed += gone;
        off.volume += gone;
        off.place += gone * Vector3d(xyz[3 * k], xyz[3 * k + 1], xyz[3 * k + 2]);
        shed_here += gone;
      }
      state.open[i] = static_cast<float>(
          state.open[i] * (pressed > 0 ? clotting * clotting * clotting * clotting : clotting));
      if (state.open[i] < 1e-4f) state.open[i] = 0;
      state.drug[i] = static_cast<float>(state.drug[i] * fading);
    }
    if (shed_here > shed_most) shed_most = shed_here, off.object = static_cast<std::int32_t>(object);
    // Neighbours level out: volumes move, in the order of the links, which go object by object. What is dry
    // everywhere, as nearly all organs are, has nothing to level.
    state.dry[object] = !any;
    for (link = any ? link : end; link < end; ++link) {
      const std::uint32_t a = model.link0[link], b = model.link1[link];
      if (state.film[a] == state.film[b]) continue;
      const double least = std::min(model.area[a], model.area[b]);
      const double rate = std::min(kSpread * dt, 0.05 * least);  // m² a step: stable for any dt
      const double move = rate * (state.film[a] - state.film[b]);
      state.film[a] -= move / model.area[a];
      state.film[b] += move / model.area[b];
    }
  }
  if (off.volume > 0) off.place /= off.volume;
  if (runoff) *runoff = off;
}

double filmVolume(const SurfaceModel& model, const SurfaceState& state) {
  double sum = state.washed;
  for (std::size_t i = 0; i < state.film.size(); ++i) sum += state.film[i] * model.area[i];
  return sum;
}

}  // namespace vest::bleeding
