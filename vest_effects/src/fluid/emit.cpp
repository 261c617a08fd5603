#include <algorithm>
#include <cmath>

#include "scratch.h"
#include "vest_tissue/solver/random.h"

namespace vest::fluid {
namespace {

constexpr float kWipes = 3.3f;           ///< s, as bleeding::kSwabTime
constexpr double kGreatestSpeed = 10.0;  ///< m/s of any particle: 100 mm of mercury drive 5 m/s (assumed)

/// Two unit vectors across `d` (unit).
void across(const double d[3], double e[3], double f[3]) {
  const double ax = std::fabs(d[0]), ay = std::fabs(d[1]), az = std::fabs(d[2]);
  const int least = ax <= ay && ax <= az ? 0 : (ay <= az ? 1 : 2);
  double o[3] = {0, 0, 0};
  o[least] = 1;
  const double along = d[least];
  double length = 0;
  for (int a = 0; a < 3; ++a) e[a] = o[a] - along * d[a], length += e[a] * e[a];
  length = std::sqrt(length);
  for (int a = 0; a < 3; ++a) e[a] /= length;
  f[0] = d[1] * e[2] - d[2] * e[1], f[1] = d[2] * e[0] - d[0] * e[2], f[2] = d[0] * e[1] - d[1] * e[0];
}

/// Makes room by letting the oldest particle join what lies right under it. False where no particle is over a
/// bed: then what is emitted waits.
bool makeRoom(const Model& model, State& state) {
  Particles& q = state.particles;
  if (q.count < q.x.size()) return true;
  state.degraded = true;
  std::size_t oldest = q.count;
  for (std::size_t i = 0; i < q.count; ++i)
    if ((oldest == q.count || q.age[i] > q.age[oldest]) && overBed(model, state, i)) oldest = i;
  if (oldest == q.count) return false;
  drown(model, state, oldest);
  const std::size_t last = --q.count;
  for (auto* a : {&q.x, &q.y, &q.z, &q.vx, &q.vy, &q.vz, &q.volume, &q.blood, &q.age, &q.rest})
    (*a)[oldest] = (*a)[last];
  return true;
}

}  // namespace

void emit(const Model& model, const Inputs& inputs, State& state) {
  Particles& q = state.particles;
  // Directions for a disc: turned by the golden angle each time (Vogel 1979), by rotation alone.
  constexpr double kCos = -0.7373688780783197, kSin = 0.6754902942615238;
  for (int k = 0; k < inputs.source_count; ++k) {
    const Source& source = inputs.sources[k];
    const double volume = source.flow * inputs.dt;
    const int slot = source.slot;
    state.pending[slot] += volume;
    if (source.wrung)
      state.soaked -= volume, state.soaked_blood -= volume * source.blood;
    else
      state.emitted += volume, state.emitted_blood += volume * source.blood;
    double d[3], length = 0;
    for (int a = 0; a < 3; ++a) length += source.direction[a] * source.direction[a];
    length = std::sqrt(length);
    for (int a = 0; a < 3; ++a) d[a] = source.direction[a] / length;
    double e[3], f[3];
    across(d, e, f);
    const double speed = source.area > 0 ? std::min(kGreatestSpeed, source.flow / source.area) : 0.0;
    const double radius = std::sqrt(source.area / 3.14159265358979);
    while (state.pending[slot] >= model.whole && makeRoom(model, state)) {
      state.pending[slot] -= model.whole;
      const std::uint32_t number = state.released[slot]++;
      double cx = 1, cy = 0;
      for (std::uint32_t turn = number % 16; turn > 0; --turn) {
        const double x = cx * kCos - cy * kSin;
        cy = cx * kSin + cy * kCos, cx = x;
      }
      const double r = radius * std::sqrt(solver::randomUniform(inputs.seed, number,
                                                                977 + static_cast<std::uint64_t>(slot)));
      // It left a part of the step ago: what is still pending came after it.
      const double ahead = volume > 0 ? std::min(1.0, state.pending[slot] / volume) * inputs.dt : 0.0;
      const std::size_t i = q.count++;
      float* const place[3] = {&q.x[i], &q.y[i], &q.z[i]};
      float* const velocity[3] = {&q.vx[i], &q.vy[i], &q.vz[i]};
      for (int a = 0; a < 3; ++a) {
        // So that it is, at the end of this step, where free flight of that length brought it.
        const double g = inputs.gravity[a], v = speed * d[a] + source.velocity[a],
                     start = v - g * (inputs.dt - ahead);
        *velocity[a] = static_cast<float>(start);
        *place[a] = static_cast<float>(source.position[a] + r * (cx * e[a] + cy * f[a]) + v * ahead +
                                       0.5 * g * (ahead * ahead - inputs.dt * inputs.dt) - start * inputs.dt);
      }
      q.volume[i] = 1, q.blood[i] = static_cast<float>(source.blood), q.age[i] = 0, q.rest[i] = 0;
    }
  }
}

void suck(const Model& model, const Inputs& inputs, State& state, ScratchData& s, Report& report) {
  (void)s;
  Particles& q = state.particles;
  Pools& w = state.pools;
  const double cell = model.parameters.pool_cell, area = cell * cell;
  const auto dt = static_cast<float>(inputs.dt);
  for (int k = 0; k < inputs.suction_count; ++k) {
    const Suction& tip = inputs.suctions[k];
    if (!(tip.flow > 0)) continue;
    double due = tip.flow * inputs.dt;
    const auto take = [&](double volume, double blood) {
      (tip.soaks ? state.soaked : state.sucked) += volume;
      (tip.soaks ? state.soaked_blood : state.sucked_blood) += volume * blood;
      if (!tip.soaks) report.sucked += volume;
      report.taken[static_cast<std::size_t>(k)] += volume;
      report.taken_blood[static_cast<std::size_t>(k)] += volume * blood;
      due -= volume;
    };
    const float tx = static_cast<float>(tip.position[0]), ty = static_cast<float>(tip.position[1]),
                tz = static_cast<float>(tip.position[2]), reach = static_cast<float>(tip.reach),
                sink = static_cast<float>(tip.flow / (4 * 3.14159265358979));
    for (std::size_t i = 0; i < q.count; ++i) {
      const float dx = tx - q.x[i], dy = ty - q.y[i], dz = tz - q.z[i], r2 = dx * dx + dy * dy + dz * dz;
      if (r2 > reach * reach) continue;
      if (r2 < static_cast<float>(tip.capture * tip.capture) && due > 0) {
        const double volume = model.whole * static_cast<double>(q.volume[i]);
        if (volume <= due * (1 + 1e-6) || volume < 0.02 * model.whole) {
          take(volume, static_cast<double>(q.blood[i]));
          q.volume[i] = 0;
          continue;
        }
        const float before = q.volume[i];
        q.volume[i] -= static_cast<float>(due / model.whole);
        take(model.whole * static_cast<double>(before - q.volume[i]), static_cast<double>(q.blood[i]));
      }
      if (tip.soaks) continue;
      // Drawn with the sink's speed; what is near follows within some 10 ms (the drag of air is small:
      // assumed).
      const float r = std::sqrt(r2) + 1e-6f, speed = std::min(2.0f, sink / (r2 + 1e-6f)),
                  share = dt / (dt + 0.01f);
      q.vx[i] += share * (speed * dx / r - q.vx[i]);
      q.vy[i] += share * (speed * dy / r - q.vy[i]);
      q.vz[i] += share * (speed * dz / r - q.vz[i]);
    }
    if (due <= 0) continue;
    // From the pool, where the tip dips into it or nearly touches it.
    const int c0 = columnOf(model, tx - reach), c1 = columnOf(model, tx + reach),
              r0 = rowOf(model, ty - reach), r1 = rowOf(model, ty + reach);
    double there = 0;
    const float above = tip.soaks ? static_cast<float>(tip.capture) : 0.004f;  // m
    const auto within = [&](int c, int r, float low, float high) {
      const float x = static_cast<float>(model.parameters.low[0] + (c + 0.5) * cell) - tx,
                  y = static_cast<float>(model.parameters.low[1] + (r + 0.5) * cell) - ty;
      return x * x + y * y < reach * reach && tz < high + above && tz > low - above;
    };
    const auto wet = [&](int c, int r) {
      const std::size_t i = static_cast<std::size_t>(r) * model.columns + c;
      return w.depth[i] > kDryDepth && w.bed[i] > kNoBed && within(c, r, w.bed[i], w.top(i));
    };
    const auto each = [&](auto&& f) {
      for (int r = std::max(0, r0); r <= std::min(model.rows - 1, r1); ++r)
        for (int c = std::max(0, c0); c <= std::min(model.columns - 1, c1); ++c)
          if (wet(c, r)) f(static_cast<std::size_t>(r) * model.columns + c);
    };
    // Gauze wipes off the ground what has not set there, as fast as it fills itself where it presses most
    // (assumed), and elsewhere as its pressure goes: sqrt(1 - r²/a²), as bleeding::pressedShare.
    const auto patch = static_cast<float>(tip.patch * tip.patch);
    for (int r = std::max(0, r0); tip.soaks && r <= std::min(model.rows - 1, r1); ++r)
      for (int c = std::max(0, c0); c <= std::min(model.columns - 1, c1) && due > 0; ++c) {
        const std::size_t i = static_cast<std::size_t>(r) * model.columns + c;
        if (!(w.film[i] > 0) || !within(c, r, w.ground[i], w.ground[i])) continue;
        const float x = static_cast<float>(model.parameters.low[0] + (c + 0.5) * cell) - tx,
                    y = static_cast<float>(model.parameters.low[1] + (r + 0.5) * cell) - ty,
                    r2 = x * x + y * y;
        if (!(r2 < patch)) continue;
        const float step = dt * std::sqrt(1 - r2 / patch), before = w.film[i],
                    loose = before * (1 - effects::setShare(w.film_age[i])) * step / (step + kWipes);
        w.film[i] = before - std::min(loose, static_cast<float>(due / area));
        take(static_cast<double>(before - w.film[i]) * area, 1.0);
      }
    if (due <= 0) continue;
    each([&](std::size_t i) { there += static_cast<double>(w.depth[i]) * area; });
    if (!(there > 0)) continue;
    const auto keep = static_cast<float>(1.0 - std::min(1.0, due / there));
    each([&](std::size_t i) {
      const float before = w.depth[i], blood = w.blood[i];
      w.depth[i] *= keep, w.blood[i] *= keep;
      const double volume = static_cast<double>(before - w.depth[i]) * area;
      take(volume, before > 0 ? static_cast<double>(blood / before) : 0.0);
    });
  }
}

void hitWindow(const Model& model, const Inputs& inputs, const State& state, Report& report) {
  const Window& w = inputs.window;
  report.lens_count = 0;
  if (!w.present) return;
  const Particles& q = state.particles;
  const double dt = inputs.dt;
  for (std::size_t i = 0; i < q.count && report.lens_count < kMostLensHits; ++i) {
    const double now[3] = {q.x[i] - w.position[0], q.y[i] - w.position[1], q.z[i] - w.position[2]};
    const double v[3] = {q.vx[i], q.vy[i], q.vz[i]};
    double height = 0, before = 0, across = 0, down = 0, square = 0;
    const double below[3] = {w.axis[1] * w.right[2] - w.axis[2] * w.right[1],
                             w.axis[2] * w.right[0] - w.axis[0] * w.right[2],
                             w.axis[0] * w.right[1] - w.axis[1] * w.right[0]};
    for (int a = 0; a < 3; ++a) {
      height += now[a] * w.axis[a];
      before += (now[a] - dt * v[a]) * w.axis[a];
      across += now[a] * w.right[a];
      down += now[a] * below[a];
      square += now[a] * now[a];
    }
    const double slack = model.parameters.spacing + w.radius;
    if (!(before > 0 && height <= 0) || square > (slack + 0.02) * (slack + 0.02)) continue;
    if (across * across + down * down > slack * slack) continue;
    LensHit& hit = report.lens[report.lens_count++];
    hit.u = static_cast<float>(across / w.radius);
    hit.v = static_cast<float>(down / w.radius);
    hit.volume = static_cast<float>(model.whole) * q.volume[i];
    hit.blood = q.blood[i];
  }
}

void compact(State& state) {
  Particles& q = state.particles;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < q.count; ++i) {
    if (q.volume[i] <= 0) continue;
    if (kept != i) {
      for (auto* a : {&q.x, &q.y, &q.z, &q.vx, &q.vy, &q.vz, &q.volume, &q.blood, &q.age, &q.rest})
        (*a)[kept] = (*a)[i];
    }
    ++kept;
  }
  q.count = kept;
}

}  // namespace vest::fluid
