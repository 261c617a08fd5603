#include "vest_effects/bleeding/surface.h"

#include "vest_effects/arithmetic.h"
#include "vest_effects/bleeding/swab.h"

#include <algorithm>
#include <cmath>

namespace vest::bleeding {

namespace {

using Eigen::Vector3d;

double squaredDistance(const float* xyz, std::uint32_t knot, const Vector3d& place) {
  const double dx = xyz[3 * knot] - place.x(), dy = xyz[3 * knot + 1] - place.y(),
               dz = xyz[3 * knot + 2] - place.z();
  return dx * dx + dy * dy + dz * dz;
}

Vector3d placeOf(const float* xyz, std::uint32_t knot) {
  return {xyz[3 * knot], xyz[3 * knot + 1], xyz[3 * knot + 2]};
}

float raised(float value, double by) {
  const double v = value + by;
  return static_cast<float>(v < 1 ? v : 1);
}

std::uint32_t usedKnots(const SurfaceModel& model, const SurfaceState& state, std::size_t object) {
  return std::min(state.used[object], model.first[object + 1] - model.first[object]);
}

void openKnot(std::size_t object, std::uint32_t knot, SurfaceState& state) {
  state.open[knot] = 1;
  state.sealed[knot] = state.clot[knot] = 0;
  state.active = 1;
  state.dry[object] = 0;
}

/// `volume` m³ of blood of that age comes to a knot's film.
void pour(std::size_t knot, double volume, double age, SurfaceState& state) {
  const double sum = state.film[knot] + volume;
  if (!(sum > 0)) return;
  state.age[knot] = static_cast<float>((state.age[knot] * state.film[knot] + age * volume) / sum);
  state.film[knot] = sum;
}

/// What films need to know of some triangles at once: all of one number lie side by side, so that the
/// compiler takes several together. Edges lead from each corner to the next.
struct Edges {
  static constexpr std::size_t kRoom = 32;  ///< triangles (tuned)
  using Of = std::array<double, kRoom>;
  using Place = std::array<Of, 3>;
  std::array<std::array<std::uint32_t, kRoom>, 3> knot;
  std::array<Place, 3> at;   ///< m: of each corner
  std::array<Of, 3> fall;    ///< m²/s²: along the edge, down > 0
  std::array<Of, 3> steep;   ///< (m/s²)²: fall over length, squared
  std::array<Of, 3> across;  ///< its width over its length
  Of twice;                  ///< m²: area, doubled
  std::size_t count = 0;

  void measure(const Vector3d& gravity) {
    std::array<Place, 3> edge;
    const double gx = gravity.x(), gy = gravity.y(), gz = gravity.z();
    for (std::size_t e = 0; e < 3; ++e)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t n = 0; n < kRoom; ++n) edge[e][axis][n] = at[(e + 1) % 3][axis][n] - at[e][axis][n];
    for (std::size_t e = 0; e < 3; ++e) {
      const auto& [x, y, z] = edge[e];
      for (std::size_t n = 0; n < kRoom; ++n) {
        fall[e][n] = x[n] * gx + y[n] * gy + z[n] * gz;
        steep[e][n] = fall[e][n] * fall[e][n] / (x[n] * x[n] + y[n] * y[n] + z[n] * z[n]);
      }
    }
    const auto &a = edge[0], &b = edge[1];
    for (std::size_t n = 0; n < kRoom; ++n) {
      const double x = a[1][n] * b[2][n] - a[2][n] * b[1][n], y = a[2][n] * b[0][n] - a[0][n] * b[2][n],
                   z = a[0][n] * b[1][n] - a[1][n] * b[0][n];
      twice[n] = std::sqrt(x * x + y * y + z * z);
    }
    for (std::size_t e = 0; e < 3; ++e) {
      const auto &u = edge[(e + 1) % 3], &v = edge[(e + 2) % 3];
      for (std::size_t n = 0; n < kRoom; ++n) {
        const double opposite = -(u[0][n] * v[0][n] + u[1][n] * v[1][n] + u[2][n] * v[2][n]) * (1 / twice[n]);
        across[e][n] = 0.5 * (opposite < 0 ? 0.0 : opposite > 4 ? 4.0 : opposite);
      }
    }
  }
};

/// One object's share of a step.
struct Film {
  const SurfaceModel& model;
  const SurfaceInputs& in;
  SurfaceState& s;
  std::size_t object;
  double dt;
  SurfaceRunoff& off;
  const SurfaceMesh& mesh = in.meshes[object];
  const std::uint32_t first = model.first[object], count = usedKnots(model, s, object);

  /// Which tool reaches a knot. @return its index, −1: none
  int near(const SurfaceInputs::Reach (&tools)[4], std::uint32_t k) const {
    for (int t = 0; t < 4; ++t)
      if (tools[t].on &&
          squaredDistance(mesh.positions, k, tools[t].place) < tools[t].radius * tools[t].radius)
        return t;
    return -1;
  }

  double mobility(std::uint32_t i) const {
    const double a = s.age[i] / kSettingTime;
    return 1 / (1 + a * a * a * a);
  }

  void wipe(std::uint32_t k) {
    const std::uint32_t i = first + k;
    for (std::size_t t = 0; t < off.wiped.size(); ++t) {
      const double room = in.gauze[t].room - off.wiped[t];
      if (!(room > 0)) continue;
      const double step =
          dt * pressedShare(squaredDistance(mesh.positions, k, in.gauze[t].place), in.gauze[t].patch);
      if (!(step > 0)) continue;
      const double taken = std::min(room, s.film[i] * mobility(i) * step / (step + kSwabTime));
      s.film[i] -= taken, s.wiped += taken, off.wiped[t] += taken;
    }
  }

  /// SurfaceRunoff::busy, of which most knots are not; vectorises. @return whether any is
  bool findBusy() {
    std::fill_n(s.flow.begin() + first, count, 0.0f);
    const float *drug = s.drug.data() + first, *styptic = s.styptic.data() + first,
                *open = s.open.data() + first, *clot = s.clot.data() + first;
    const double *film = s.film.data() + first, *loose = s.loose.data() + first;
    std::uint8_t* const busy = off.busy.data() + first;
    unsigned any = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint8_t is =
          static_cast<std::uint8_t>(!(drug[k] <= 0)) | static_cast<std::uint8_t>(!(styptic[k] <= 0)) |
          static_cast<std::uint8_t>(!(open[k] <= 0)) | static_cast<std::uint8_t>(!(clot[k] <= 0)) |
          static_cast<std::uint8_t>(!(film[k] <= 0)) | static_cast<std::uint8_t>(!(loose[k] <= 0));
      busy[k] = is;
      any |= is;
    }
    return any != 0;
  }

  /// What tissue does: drug, clotting, seeping. @param front m²: radius of each depot, squared
  /// @return whether anything is left to do here
  bool seep(const std::array<double, 4>& front) {
    const double clotting = 1 / (1 + dt / kClottingTime), fading = 1 / (1 + dt / kStypticTime),
                 constricting = dt / (dt + kConstrictionTime);
    const double perfused = in.scale * (in.perfused ? in.perfused[object] : 1.0);
    for (std::size_t t = 0; t < front.size(); ++t)
      for (std::uint32_t k = 0;
           in.inject[t].on && in.inject[t].object == static_cast<std::int32_t>(object) && k < count; ++k)
        if (squaredDistance(mesh.positions, k, in.inject[t].place) < front[t]) s.drug[first + k] = 1;
    if (!findBusy()) return false;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t i = first + k;
      if (off.busy[i] == 0) continue;
      s.styptic[i] = static_cast<float>(s.styptic[i] + constricting * (s.drug[i] - s.styptic[i]));
      s.drug[i] = static_cast<float>(s.drug[i] * fading);
      if (s.drug[i] < 1e-3f) s.drug[i] = 0;
      if (s.drug[i] <= 0 && s.styptic[i] < 1e-3f) s.styptic[i] = 0;
      s.age[i] = s.film[i] > 0
                     ? static_cast<float>(s.age[i] + dt * effects::ageing(thickness(s, i), in.drying))
                     : 0.0f;
      if (s.film[i] > 0) wipe(k);
      if (!(s.area[i] > 0) || (s.open[i] <= 0 && s.clot[i] <= 0)) continue;
      const int sucker = s.clot[i] > 0 ? near(in.suck, k) : -1;
      if (sucker >= 0) {
        off.clots[static_cast<std::size_t>(sucker)] += s.clot[i] * s.area[i] * kClotThickness;
        s.open[i] = raised(s.open[i], s.clot[i]);
        s.clot[i] = 0;
      }
      const bool pressed = near(in.press, k) >= 0;
      const double q = pressed ? 0.0
                               : perfused * (in.reach ? in.reach[i] : 1.0f) * model.perfusion[i] * s.area[i] *
                                     model.depth[i] * s.open[i] * (1.0 - s.styptic[i]) * (1.0 - s.sealed[i]);
      s.flow[i] = static_cast<float>(q > 0 ? q : 0);
      pour(i, s.flow[i] * dt, 0, s);
      s.seeped += s.flow[i] * dt;
      const float before = s.open[i];
      s.open[i] =
          static_cast<float>(before * (pressed ? clotting * clotting : clotting));  // twice as fast (assumed)
      if (s.open[i] < 1e-4f) s.open[i] = 0;
      s.clot[i] = raised(s.clot[i], before - s.open[i]);
    }
    return true;
  }

  /// Between two knots of a triangle: its edge e.
  void run(const Edges& edges, std::size_t n, std::size_t e) {
    std::uint32_t i = first + edges.knot[e][n], j = first + edges.knot[(e + 1) % 3][n];
    if (!(s.area[i] > 0) || !(s.area[j] > 0)) return;
    double fall = edges.fall[e][n];
    if (fall < 0) std::swap(i, j), fall = -fall;
    const auto steep = static_cast<float>(edges.steep[e][n]);
    if (steep > off.steepest[i]) off.steepest[i] = steep, off.lower[i] = j;
    const double hi = off.thick[i], hj = off.thick[j];
    if (!(hi > kThinFilm) && !(hj > kThinFilm)) return;
    const double move = dt * edges.across[e][n] *
                        (kFilmDensity * fall / (3 * kFilmViscosity) * hi * hi * hi * off.mobile[i] +
                         kSpread * (hi - hj) * off.mobile[hi > hj ? i : j]);
    const std::uint32_t from = move > 0 ? i : j, to = move > 0 ? j : i;
    if (!(off.thick[from] > kThinFilm)) return;
    const double moved = std::min(std::fabs(move), 0.1 * s.film[from]);  // stable for any step
    s.film[from] -= moved;
    pour(to, moved, s.age[from], s);
  }

  void run(Edges& edges) {
    edges.measure(in.gravity);
    for (std::size_t n = 0; n < edges.count; ++n)
      for (std::size_t e = 0; e < 3 && edges.twice[n] > 1e-14; ++e) run(edges, n, e);
    edges.count = 0;
  }

  void flow() {
    std::fill_n(off.steepest.begin() + first, count, 0.0f);
    bool any = false;
    for (std::uint32_t i = first; i < first + count; ++i) {
      off.thick[i] = s.film[i] > 0 ? std::min(thickness(s, i), kFullFilm) : 0;
      off.mobile[i] = off.thick[i] > kThinFilm ? mobility(i) : 0;
      any = any || off.thick[i] > kThinFilm;
    }
    if (!any) return;
    const auto runs = [&](std::uint32_t k) { return k < count && off.thick[first + k] > kThinFilm; };
    Edges edges{};
    for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
      const auto& k = mesh.triangles[t];
      if (!(runs(k[0]) || runs(k[1]) || runs(k[2])) || (mesh.alive && !mesh.alive[t])) continue;
      if (k[0] >= count || k[1] >= count || k[2] >= count) continue;
      for (std::size_t e = 0; e < 3; ++e) {
        edges.knot[e][edges.count] = k[e];
        for (std::size_t axis = 0; axis < 3; ++axis)
          edges.at[e][axis][edges.count] = mesh.positions[3 * std::size_t{k[e]} + axis];
      }
      if (++edges.count == Edges::kRoom) run(edges);
    }
    run(edges);
  }

  /// What the surface does not hold goes on to where it falls steepest, and drips where that is nearly level.
  double surplus(std::uint32_t k) {
    const std::uint32_t i = first + k;
    const double gone = s.film[i] - kFullFilm * static_cast<double>(s.area[i]);
    if (!(gone > 0)) return 0;
    s.film[i] -= gone;
    if (!(off.steepest[i] > 2.5e-3 * in.gravity.squaredNorm())) return gone;  // 1 in 20
    pour(off.lower[i], gone, s.age[i], s);
    return 0;
  }

  /// The drip that a knot falls with: one near by, or a free one, or the one that rests longest.
  std::size_t dripAt(std::uint32_t k) {
    std::size_t best = 0;
    for (std::size_t d = 0; d < s.drips.size(); ++d) {
      const Drip& drip = s.drips[d];
      if (drip.object == static_cast<std::int32_t>(object) && drip.knot < count &&
          (placeOf(mesh.positions, drip.knot) - placeOf(mesh.positions, k)).squaredNorm() <
              kOneDrip * kOneDrip)
        return d;
      if (s.drips[best].object >= 0 && (drip.object < 0 || drip.idle > s.drips[best].idle)) best = d;
    }
    s.drips[best] = {static_cast<std::int32_t>(object), k, 0};
    return best;
  }

  void drip() {
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t i = first + k;
      const double gone = surplus(k) + s.loose[i];
      if (!(gone > 0)) continue;
      s.loose[i] = 0;
      s.shed += gone;
      const std::size_t d = dripAt(k);
      s.drips[d].idle = 0;
      auto& fall = off.falls[d];
      fall.place = (fall.volume * fall.place + gone * placeOf(mesh.positions, k)) / (fall.volume + gone);
      fall.volume += gone;
      fall.object = static_cast<std::int32_t>(object);
    }
  }
};

}  // namespace

SurfaceState initialSurface(const SurfaceModel& model) {
  SurfaceState s;
  for (auto* v : {&s.open, &s.drug, &s.styptic, &s.sealed, &s.clot, &s.flow, &s.area, &s.age})
    v->assign(model.knots(), 0.0f);
  for (auto* v : {&s.film, &s.loose}) v->assign(model.knots(), 0.0);
  s.used = model.scene;
  s.dry.assign(model.scene.size(), 0);
  return s;
}

void measureSurface(const SurfaceModel& model, std::size_t object, const SurfaceMesh& mesh, const float* rest,
                    SurfaceState& state) {
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  std::fill_n(state.area.begin() + first, count, 0.0f);
  for (std::size_t t = 0; t < mesh.triangle_count; ++t) {
    const auto& k = mesh.triangles[t];
    if ((mesh.alive && !mesh.alive[t]) || std::max({k[0], k[1], k[2]}) >= count) continue;
    const Vector3d a = placeOf(rest, k[0]);
    const double area =
        0.5 * std::sqrt((placeOf(rest, k[1]) - a).cross(placeOf(rest, k[2]) - a).squaredNorm());
    for (const std::uint32_t knot : k) state.area[first + knot] += static_cast<float>(area / 3);
  }
  for (std::uint32_t i = first; i < first + count; ++i) {  // what stood on a surface that is no more
    if (state.area[i] > 0 || !(state.film[i] > 0)) continue;
    state.loose[i] += state.film[i];
    state.film[i] = 0;
  }
  state.dry[object] = 0;
}

void openSurface(const SurfaceModel& model, std::size_t object, const float* positions, const Vector3d& place,
                 double reach, SurfaceState& state) {
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  std::uint32_t nearest = count;
  double least = 1e30;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (!(state.area[first + k] > 0)) continue;
    const double d = squaredDistance(positions, k, place);
    if (d < least) least = d, nearest = k;
    if (d <= reach * reach) openKnot(object, first + k, state);
  }
  if (nearest < count) openKnot(object, first + nearest, state);
}

void openFace(const SurfaceModel& model, std::size_t object, const std::array<std::uint32_t, 3>& knots,
              SurfaceState& state) {
  for (const std::uint32_t k : knots)
    if (k < usedKnots(model, state, object)) openKnot(object, model.first[object] + k, state);
}

void sealSurface(const SurfaceModel& model, std::size_t object, const float* positions, const Vector3d& place,
                 double energy, SurfaceState& state) {
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  // Heat goes to the nearest surface that is not sealed yet; a few rounds reach what one event can.
  for (int round = 0; round < 16 && energy > 0; ++round) {
    std::uint32_t nearest = count;
    double least = 0.01 * 0.01;  // m²: heat does not reach farther
    for (std::uint32_t k = 0; k < count; ++k) {
      if (!(state.area[first + k] > 0) || state.sealed[first + k] >= 1) continue;
      const double d = squaredDistance(positions, k, place);
      if (d < least) least = d, nearest = k;
    }
    if (nearest == count) return;
    const std::uint32_t k = first + nearest;
    const double needed = (1 - state.sealed[k]) * kSealHeat * state.area[k];
    const double given = std::min(needed, energy);
    state.sealed[k] = given >= needed ? 1.0f : raised(state.sealed[k], given / (kSealHeat * state.area[k]));
    energy -= given;
  }
}

void washSurface(const SurfaceModel& model, std::size_t object, const std::array<std::uint32_t, 3>& knots,
                 double impulse, SurfaceState& state) {
  if (!state.active || object + 1 >= model.first.size() || !(impulse > 0)) return;
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  for (const std::uint32_t k : knots) {
    const std::uint32_t i = first + k;
    if (k >= count || !(state.film[i] > 0) || !(state.area[i] > 0)) continue;
    const double area = state.area[i], before = thickness(state, i);
    // dh/dt = −tau h²/(2 mu √A), solved exactly over the impulse.
    // At most what is there: rounding alone would take a little from `loose`.
    const double film =
        std::min(state.film[i],
                 area * before / (1 + impulse / 3 * before / (2 * kFilmViscosity * area * std::sqrt(area))));
    state.loose[i] += state.film[i] - film;
    state.film[i] = film;
  }
}

void stainSurface(const SurfaceModel& model, std::size_t object, const std::array<std::uint32_t, 3>& knots,
                  double volume, SurfaceState& state) {
  if (object + 1 >= model.first.size() || !(volume > 0)) return;
  const std::uint32_t first = model.first[object], count = usedKnots(model, state, object);
  int here = 0;
  for (const std::uint32_t k : knots) here += k < count && state.area[first + k] > 0;
  if (here == 0) state.loose[first + (knots[0] < count ? knots[0] : 0)] += volume;
  for (const std::uint32_t k : knots)
    if (k < count && state.area[first + k] > 0) pour(first + k, volume / here, 0, state);
  state.stained += volume;
  state.active = 1;
  state.dry[object] = 0;
}

bool copyKnot(const SurfaceModel& model, std::size_t object, std::uint32_t original, SurfaceState& state) {
  const std::uint32_t first = model.first[object], room = model.first[object + 1] - first;
  const std::uint32_t copy = state.used[object]++;
  if (copy >= room || original >= copy) return false;
  state.dry[object] = 0;
  const std::uint32_t from = first + original, to = first + copy;
  for (auto* v : {&state.open, &state.clot, &state.drug, &state.styptic, &state.sealed, &state.age})
    (*v)[to] = (*v)[from];
  // Until the surface is measured anew, half of it is the copy's.
  state.film[to] = state.film[from] *= 0.5;
  state.area[to] = state.area[from] *= 0.5f;
  return true;
}

bool seepSurface(const SurfaceModel& model, const SurfaceInputs& in, double dt, SurfaceState& state,
                 SurfaceRunoff& runoff) {
  runoff.falls.fill({}), runoff.clots.fill(0), runoff.wiped.fill(0);
  if (!in.meshes) return false;
  // Depots grow while needles inject; where a needle is set anew, another begins.
  std::array<double, 4> front{};  // m²
  bool injected = false;
  for (std::size_t t = 0; t < front.size(); ++t) {
    if (!in.inject[t].on) continue;
    injected = true;
    if ((Vector3d(state.depot[t].data()) - in.inject[t].place).squaredNorm() > kNewStitch * kNewStitch)
      state.injected[t] = 0;
    for (std::size_t a = 0; a < 3; ++a) state.depot[t][a] = in.inject[t].place[static_cast<int>(a)];
    state.injected[t] += kInjectionFlow * dt;
    front[t] = effects::power(3 * state.injected[t] / (4 * 3.14159265358979 * kInterstice), 2.0 / 3.0);
    const auto object = static_cast<std::size_t>(in.inject[t].object);
    if (object < state.dry.size()) state.dry[object] = 0;
  }
  if (injected) state.active = 1;
  if (!state.active) return false;
  for (Drip& drip : state.drips) drip.idle += dt;
  for (std::size_t object = 0; object + 1 < model.first.size(); ++object) {
    if (state.dry[object] || !in.meshes[object].positions) continue;
    state.dry[object] = !Film{model, in, state, object, dt, runoff}.seep(front);
  }
  return true;
}

void runSurface(const SurfaceModel& model, const SurfaceInputs& in, double dt, std::size_t object,
                SurfaceState& state, SurfaceRunoff& runoff) {
  if (!state.dry[object] && in.meshes[object].positions) Film{model, in, state, object, dt, runoff}.flow();
}

void dripSurface(const SurfaceModel& model, const SurfaceInputs& in, SurfaceState& state,
                 SurfaceRunoff& runoff) {
  for (std::size_t object = 0; object + 1 < model.first.size(); ++object)
    if (!state.dry[object] && in.meshes[object].positions) Film{model, in, state, object, 0, runoff}.drip();
}

void stepSurface(const SurfaceModel& model, const SurfaceInputs& in, double dt, SurfaceState& state,
                 SurfaceRunoff& runoff) {
  if (!seepSurface(model, in, dt, state, runoff)) return;
  for (std::size_t object = 0; object + 1 < model.first.size(); ++object)
    runSurface(model, in, dt, object, state, runoff);
  dripSurface(model, in, state, runoff);
}

double filmVolume(const SurfaceState& state) {
  double sum = 0;
  for (std::size_t i = 0; i < state.film.size(); ++i) sum += state.film[i] + state.loose[i];
  return sum;
}

}  // namespace vest::bleeding
