#include <algorithm>
#include <cmath>

#include "scratch.h"
#include "vest_effects/arithmetic.h"
#include "vest_tissue/solver/random.h"

namespace vest::fluid {
namespace {

constexpr float kImpactSpeed = 0.15f;  ///< m/s: slower contacts rest, faster ones are impacts (assumed)
/// m/s: slower particles on tissue become part of the film that the pools' equations move (assumed): what
/// runs down a slope does so as shallow water, which costs a tenth.
constexpr float kRestSpeed = 0.4f;
constexpr double kSplashNumber = 57.7;  ///< We^½·Re^¼ of Mundo, Sommerfeld and Tropea 1995

/// A moving drop leaves blood behind on a strip as wide as itself; on rigid ground to the layer that is too
/// thin to flow (leaveFilms). @param speed m/s
void leaveTrail(const Model& model, const Inputs& inputs, std::size_t i, std::uint32_t triangle, double speed,
                State& state, ScratchData& s) {
  Particles& q = state.particles;
  const Parameters& par = model.parameters;
  const double gravity2 = inputs.gravity[0] * inputs.gravity[0] + inputs.gravity[1] * inputs.gravity[1] +
                          inputs.gravity[2] * inputs.gravity[2];
  if (!(par.blood_tension > 0) || !(gravity2 > 0)) return;
  const double film = 0.94 * std::sqrt(par.blood_tension / (par.blood_density * std::sqrt(gravity2))) *
                      effects::power(par.blood_viscosity * speed / par.blood_tension, 2.0 / 3.0);
  const float before = q.volume[i], blood = q.blood[i];
  const auto left = static_cast<float>(film * par.spacing * speed * inputs.dt / model.whole);
  const float taken = std::min(left, 0.5f * before) * blood;
  q.volume[i] = before - taken;
  q.blood[i] = q.volume[i] > 0 ? std::max(0.0f, before * blood - taken) / q.volume[i] : 0.0f;
  const double volume = model.whole * static_cast<double>(before - q.volume[i]);
  const int c = columnOf(model, q.x[i]), r = rowOf(model, q.y[i]);
  Pools& w = state.pools;
  if (c >= 0 && r >= 0 && c < model.columns && r < model.rows) {
    const auto cell =
        static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) + static_cast<std::size_t>(c);
    if (onGround(w, s, cell) && std::fabs(q.z[i] - w.bed[cell]) < static_cast<float>(par.pool_cell)) {
      const auto depth = static_cast<float>(volume / (par.pool_cell * par.pool_cell));
      w.depth[cell] += depth, w.blood[cell] += depth;
      return;
    }
  }
  addStain(state, s, triangle, volume);
}

}  // namespace

void addMomentum(ScratchData& s, const PlacedTriangle& t, const float* weights, double jx, double jy,
                 double jz, double mass) {
  if (!s.is_touched[t.id]) {
    s.is_touched[t.id] = 1;
    s.touched.push_back(t.id);
  }
  auto& m = s.momentum[t.id];
  m[0] += jx, m[1] += jy, m[2] += jz;
  const double size = std::sqrt(jx * jx + jy * jy + jz * jz);
  auto& w = s.impact_weight[t.id];
  for (int k = 0; k < 3; ++k) w[k] += size * static_cast<double>(weights[k]);
  w[3] += size;
  if (mass > 0) w[4] += size * size / mass;
}

void pushOut(const Model& model, const State& state, ScratchData& s, float dt) {
  const float radius = 0.5f * static_cast<float>(model.parameters.spacing);
  for (std::size_t i = 0; i < state.particles.count; ++i) {
    for (int k = 0; k < s.plane_count[i]; ++k) {
      const Plane& p = s.planes[i * kMostPlanes + k];
      Quad& x = s.place[i];
      const float gap =
          p.normal[0] * x.a[0] + p.normal[1] * x.a[1] + p.normal[2] * x.a[2] - p.offset - radius;
      if (gap >= 0) continue;
      for (int axis = 0; axis < 3; ++axis) x.a[axis] -= gap * p.normal[axis];
      const double mass =
          wholeMass(model, state.particles.blood[i]) * static_cast<double>(state.particles.volume[i]);
      const double j = mass * gap / dt;
      addMomentum(s, s.placed[p.placed], p.weights, j * p.normal[0], j * p.normal[1], j * p.normal[2], mass);
    }
  }
}

void impact(const Model& model, const Inputs& inputs, State& state, ScratchData& s) {
  Particles& q = state.particles;
  const Parameters& par = model.parameters;
  const auto dt = static_cast<float>(inputs.dt);
  const float radius = 0.5f * static_cast<float>(par.spacing);
  const std::size_t n = q.count;
  for (std::size_t i = 0; i < n; ++i) {
    float resting = 0;
    const double whole = wholeMass(model, q.blood[i]);
    const float in[3] = {s.inx[i], s.iny[i], s.inz[i]};
    for (int k = 0; k < s.plane_count[i]; ++k) {
      const Plane& p = s.planes[i * kMostPlanes + k];
      const float* const nrm = p.normal;
      const float z = nrm[0] * q.x[i] + nrm[1] * q.y[i] + nrm[2] * q.z[i] - p.offset;
      if (z > 0.75f * model.h) continue;
      float v[3] = {q.vx[i], q.vy[i], q.vz[i]};
      const float before[3] = {v[0], v[1], v[2]};
      const float blood = q.blood[i];
      double mass = whole * static_cast<double>(q.volume[i]), child_momentum[3] = {0, 0, 0};
      if (z < 1.1f * radius) {
        float vn = 0, vn_in = 0, rel[3], rel_in[3];
        for (int a = 0; a < 3; ++a) {
          rel[a] = v[a] - p.velocity[a];
          rel_in[a] = in[a] - p.velocity[a];
          vn += nrm[a] * rel[a];
          vn_in += nrm[a] * rel_in[a];
        }
        float keep, normal;
        if (vn_in < -kImpactSpeed) {  // v' = v_T (1 − mu_p) − v_N eps_p
          keep = 1.0f - static_cast<float>(par.friction);
          normal = std::max(vn, static_cast<float>(-par.restitution) * vn_in);
        } else {  // a film of half a spacing drags by 3 nu/delta² (Nusselt)
          const float nu = static_cast<float>(
              (par.water_viscosity + (par.blood_viscosity - par.water_viscosity) * blood) / par.density);
          keep = 1.0f / (1.0f + dt * 3.0f * nu / (radius * radius));
          normal = std::max(vn, 0.0f);
        }
        // A drop or jet spreads along the wall with the speed that it came with.
        const float came = rel_in[0] * rel_in[0] + rel_in[1] * rel_in[1] + rel_in[2] * rel_in[2];
        if (came > 1e-6f)
          addShear(s, s.placed[p.placed].id, static_cast<double>(kDrag * came * dt) * mass / par.spacing);
        if (inputs.stains && blood > 0.01f)
          leaveTrail(model, inputs, i, s.placed[p.placed].id, std::sqrt(static_cast<double>(came)), state, s);
        float speed2 = 0;
        for (int a = 0; a < 3; ++a) {
          const float tangential = rel[a] - vn * nrm[a];
          v[a] = p.velocity[a] + keep * tangential + normal * nrm[a];
          speed2 += (v[a] - p.velocity[a]) * (v[a] - p.velocity[a]);
        }
        // What sticks to a wall waits longer: it may still run down.
        if (speed2 < kRestSpeed * kRestSpeed) resting = std::max(resting, nrm[2] > 0.2f ? 1.0f : 0.05f);
        // A whole drop that comes fast enough sends two small ones off.
        if (vn_in < -kImpactSpeed && q.volume[i] > 0.9f && par.splash_share > 0 &&
            q.count + 2 <= q.x.size() / 2) {  // where particles get scarce, none for the looks
          const double sigma =
              std::max(1e-6, par.water_tension + (par.blood_tension - par.water_tension) * blood);
          const double mu =
              std::max(1e-9, par.water_viscosity + (par.blood_viscosity - par.water_viscosity) * blood);
          const double u = static_cast<double>(-vn_in), we = par.density * u * u * par.spacing / sigma,
                       re = par.density * u * par.spacing / mu;
          if (std::sqrt(we) * std::sqrt(std::sqrt(re)) > kSplashNumber) {
            const float share = 0.5f * static_cast<float>(par.splash_share) * q.volume[i];
            for (int c = 0; c < 2; ++c) {
              const std::size_t j = q.count++;
              float random[3], along = 0, cv[3];
              for (int a = 0; a < 3; ++a) {
                random[a] = 2.0f * static_cast<float>(
                                       solver::randomUniform(inputs.seed, state.step,
                                                             8 * (i + 1) + 3 * static_cast<std::size_t>(c) +
                                                                 static_cast<std::size_t>(a) + 1000000)) -
                            1.0f;
                along += random[a] * nrm[a];
              }
              const float up = static_cast<float>(par.splash_restitution) * -vn_in;
              for (int a = 0; a < 3; ++a) {
                cv[a] = v[a] + up * (0.8f * (random[a] - along * nrm[a])) + (up - normal) * nrm[a];
                child_momentum[a] += whole * static_cast<double>(share * cv[a]);
              }
              q.x[j] = q.x[i] + 0.3f * radius * nrm[0];
              q.y[j] = q.y[i] + 0.3f * radius * nrm[1];
              q.z[j] = q.z[i] + 0.3f * radius * nrm[2];
              q.vx[j] = cv[0], q.vy[j] = cv[1], q.vz[j] = cv[2];
              q.volume[j] = share, q.blood[j] = blood, q.age[j] = q.age[i], q.rest[j] = 0;
              s.px[j] = s.px[i], s.py[j] = s.py[i], s.pz[j] = s.pz[i];
              s.plane_count[j] = 0, s.neighbour_count[j] = 0;
              s.place[j] = {{q.x[j], q.y[j], q.z[j], share}};
            }
            q.volume[i] -= 2.0f * share;
          }
        }
      }
      const double left = whole * static_cast<double>(q.volume[i]);
      // The wall's attraction; equal and opposite on the tissue like all the rest.
      const float a0 = model.adhesion_water + (model.adhesion_blood - model.adhesion_water) * blood;
      const float pull = std::min(a0 * dt, 0.1f) * std::max(0.0f, 1.0f - z / model.h);
      for (int a = 0; a < 3; ++a) v[a] -= pull * nrm[a];
      q.vx[i] = v[0], q.vy[i] = v[1], q.vz[i] = v[2];
      double j[3];
      for (int a = 0; a < 3; ++a)
        j[a] = mass * static_cast<double>(before[a]) - left * static_cast<double>(v[a]) - child_momentum[a];
      addMomentum(s, s.placed[p.placed], p.weights, j[0], j[1], j[2], mass);
    }
    q.rest[i] = resting > 0 ? q.rest[i] + resting * dt : 0.0f;
  }
}

}  // namespace vest::fluid
