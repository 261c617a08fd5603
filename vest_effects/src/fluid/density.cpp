#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "scratch.h"

namespace vest::fluid {

const Kernels& chooseKernels() {
#ifdef VEST_HAS_AVX2_KERNEL
  const char* const wish = std::getenv("VEST_KERNEL");
  if (__builtin_cpu_supports("avx2") && !(wish && std::strcmp(wish, "baseline") == 0)) return kAvx2;
#endif
  return kBaseline;
}

const char* kernelLevel() {
  return chooseKernels().level;
}

void sortParticles(const Model&, State& state, ScratchData& s) {
  Particles& p = state.particles;
  const std::size_t n = p.count;
  auto& start = s.grid.start;
  std::fill(start.begin(), start.end(), 0u);
  for (std::size_t i = 0; i < n; ++i) {
    s.cell[i] = s.grid.cell(s.grid.coordinate(p.x[i]), s.grid.coordinate(p.y[i]), s.grid.coordinate(p.z[i]));
    ++start[s.cell[i] + 2];
  }
  for (std::size_t c = 2; c < start.size(); ++c) start[c] += start[c - 1];
  for (std::size_t i = 0; i < n; ++i) s.order[start[s.cell[i] + 1]++] = static_cast<std::uint32_t>(i);
  const auto turn = [&](std::vector<float>& a) {
    for (std::size_t k = 0; k < n; ++k) s.shuffle[k] = a[s.order[k]];
    std::copy_n(s.shuffle.data(), n, a.data());
  };
  for (auto* a : {&p.x, &p.y, &p.z, &p.vx, &p.vy, &p.vz, &p.volume, &p.blood, &p.age, &p.rest}) turn(*a);
  for (auto* a : {&s.px, &s.py, &s.pz}) turn(*a);
}

void findNeighbours(const Model& model, std::size_t count, ScratchData& s) {
  for (std::size_t i = 0; i < count; ++i)
    s.dx[i] = s.place[i].a[0], s.dy[i] = s.place[i].a[1], s.dz[i] = s.place[i].a[2];
  parts(count, s.threads, [&](std::size_t from, std::size_t to) { s.kernels->lists(model, s, from, to); });
}

void solveDensity(const Model& model, const State& state, ScratchData& s, float dt) {
  const std::size_t n = state.particles.count;
  const auto& volume = state.particles.volume;
  // A correction longer than a quarter of the spacing a time would be an explosion, not a pressure.
  const float most = 0.25f * static_cast<float>(model.parameters.spacing);
  for (int iteration = 0; iteration < model.parameters.iterations; ++iteration) {
    parts(n, s.threads, [&](std::size_t from, std::size_t to) { s.kernels->lambdas(model, s, from, to); });
    for (std::size_t i = 0; i < n; ++i) s.place[i].a[3] = s.lambda[i];
    parts(n, s.threads,
          [&](std::size_t from, std::size_t to) { s.kernels->corrections(model, s, volume, from, to); });
    for (std::size_t i = 0; i < n; ++i) {
      const float length = std::sqrt(s.dx[i] * s.dx[i] + s.dy[i] * s.dy[i] + s.dz[i] * s.dz[i]);
      const float factor = length > most ? most / length : 1.0f;
      s.place[i].a[0] += factor * s.dx[i];
      s.place[i].a[1] += factor * s.dy[i];
      s.place[i].a[2] += factor * s.dz[i];
      s.place[i].a[3] = volume[i];
      if (!(s.lambda[i] > 0)) continue;
      for (std::size_t k = i * kMostPlanes; k < i * kMostPlanes + s.plane_count[i]; ++k) {
        // own move λ/volume·slope, times its mass: what the tissue gets the other way
        const double j = -wholeMass(model, state.particles.blood[i]) *
                         static_cast<double>(factor * s.lambda[i] * s.tissue_slope[k]) / dt;
        const Plane& p = s.planes[k];
        if (j != 0)
          addMomentum(s, s.placed[p.placed], p.weights, j * p.normal[0], j * p.normal[1], j * p.normal[2],
                      wholeMass(model, state.particles.blood[i]) * static_cast<double>(volume[i]));
      }
    }
    pushOut(model, state, s, dt);
  }
}

void diffuse(const Model& model, State& state, ScratchData& s, float dt) {
  Particles& p = state.particles;
  const std::size_t n = p.count;
  const Parameters& par = model.parameters;
  const float nu_water = static_cast<float>(par.water_viscosity / par.density),
              nu_blood = static_cast<float>(par.blood_viscosity / par.density);
  // Explicit capillarity is stable up to dt² = rho d³/(2 pi sigma) (Brackbill, Kothe and Zemach 1992, eq.
  // 61): longer steps weaken it to a quarter of that bound.
  const auto bounded = [&](float c, double sigma) {
    const double bound =
        0.25 * par.density * model.whole / (6.283185307 * std::max(sigma, 1e-9) * double{dt} * double{dt});
    return c * static_cast<float>(std::min(1.0, bound));
  };
  const float cw = bounded(model.cohesion_water, par.water_tension),
              cb = bounded(model.cohesion_blood, par.blood_tension);
  const Diffusion f{model.h, model.gradient_scale, dt, nu_water, nu_blood, cw, cb};
  for (std::size_t i = 0; i < n; ++i) s.velocity[i] = {{p.vx[i], p.vy[i], p.vz[i], p.blood[i]}};
  parts(n, s.threads, [&](std::size_t from, std::size_t to) { s.kernels->diffusions(f, s, from, to); });
  for (std::size_t i = 0; i < n; ++i) p.vx[i] += s.dx[i], p.vy[i] += s.dy[i], p.vz[i] += s.dz[i];
}

}  // namespace vest::fluid
