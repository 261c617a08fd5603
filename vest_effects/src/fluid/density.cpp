#include <algorithm>
#include <cmath>

#include "lanes.h"

namespace vest::fluid {
namespace {

constexpr std::size_t kStride = kMostNeighbours + 4;

template <class F>
void each(std::size_t count, int threads, F&& f) {
  (void)threads;
#ifdef _OPENMP
  if (threads > 1 && count > 256) {
#pragma omp parallel for schedule(static) num_threads(threads)
    for (long i = 0; i < static_cast<long>(count); ++i) f(static_cast<std::size_t>(i));
    return;
  }
#endif
  for (std::size_t i = 0; i < count; ++i) f(i);
}

}  // namespace

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
  const CellGrid& g = s.grid;
  const float h2 = model.h * model.h;
  const std::uint32_t last_column = (1u << g.bits_x) - 1u;
  each(count, s.threads, [&](std::size_t i) {
    const Quad q = s.place[i];
    const int cx = g.coordinate(q.a[0]), cy = g.coordinate(q.a[1]), cz = g.coordinate(q.a[2]);
    std::uint32_t* const list = s.neighbours.data() + i * kStride;
    std::uint32_t n = 0;
    const auto scan = [&](std::uint32_t from, std::uint32_t to) {
      for (std::uint32_t j = from; j < to; ++j) {
        const Quad& o = s.place[j];
        const float dx = q.a[0] - o.a[0], dy = q.a[1] - o.a[1], dz = q.a[2] - o.a[2];
        list[n] = j;
        n +=
            static_cast<std::uint32_t>(dx * dx + dy * dy + dz * dz < h2) & static_cast<std::uint32_t>(j != i);
        if (n == kMostNeighbours) return;
      }
    };
    for (int z = cz - 1; z <= cz + 1; ++z) {
      for (int y = cy - 1; y <= cy + 1; ++y) {
        const std::uint32_t row = g.row(y, z), a = g.column(cx - 1), b = g.column(cx), c = g.column(cx + 1);
        if (a < b && b < c) {
          scan(g.start[row + a], g.start[row + c + 1]);
        } else if (b == 0) {  // the row begins anew
          scan(g.start[row], g.start[row + c + 1]);
          scan(g.start[row + last_column], g.start[row + last_column + 1]);
        } else {
          scan(g.start[row + a], g.start[row + b + 1]);
          scan(g.start[row], g.start[row + 1]);
        }
        if (n == kMostNeighbours) break;
      }
    }
    s.neighbour_count[i] = static_cast<std::uint16_t>(n);
    // Up to a multiple of four with one that lies outside every kernel.
    for (std::uint32_t k = n; k < n + 4; ++k) list[k] = static_cast<std::uint32_t>(s.place.size() - 1);
  });
}

namespace {

/// Constraint C = density − 1 >= 0 of one particle: lambda, and the gradient's sum for its own move.
void findLambda(const Model& m, ScratchData& s, std::size_t i) {
  const Quad q = s.place[i];
  const Lanes x = all(q.a[0]), y = all(q.a[1]), z = all(q.a[2]), one = all(1.0f);
  const float inverse_h = 1.0f / m.h;
  const Lanes ih = all(inverse_h), ih2 = all(inverse_h * inverse_h), tiny = all(1e-12f);
  Lanes density = all(0), sx = all(0), sy = all(0), sz = all(0), squares = all(0);
  const std::uint32_t* const list = s.neighbours.data() + i * kStride;
  for (std::uint32_t k = 0; k < s.neighbour_count[i]; k += 4) {
    Lanes ox, oy, oz, v;
    gather(s.place.data(), list + k, ox, oy, oz, v);
    const Lanes dx = x - ox, dy = y - oy, dz = z - oz;
    const Lanes r2 = dx * dx + dy * dy + dz * dz + tiny;
    const Lanes t = positive(one - r2 * ih2);
    density += v * t * t * t;
    const Lanes r = squareRoot(r2);
    const Lanes g = positive(one - r * ih), g2 = g * g;
    const Lanes slope = v * g2;
    squares += slope * g2;
    const Lanes along = slope / r;
    sx += along * dx, sy += along * dy, sz += along * dz;
  }
  const float ks = m.gradient_scale;
  const float c = m.density_scale * (q.a[3] + sum(density)) - 1.0f;
  const float gx = ks * sum(sx), gy = ks * sum(sy), gz = ks * sum(sz);
  s.slope[i] = {{gx, gy, gz, 0.0f}};
  float lambda = 0.0f;
  if (c > 0.0f) {
    const float own = (gx * gx + gy * gy + gz * gz) / q.a[3];
    lambda = c / (own + ks * ks * sum(squares) + m.relaxation);
  }
  s.lambda[i] = lambda;
}

void findCorrection(const Model& m, ScratchData& s, const std::vector<float>& volume, std::size_t i) {
  const Quad q = s.place[i];
  const Lanes x = all(q.a[0]), y = all(q.a[1]), z = all(q.a[2]), one = all(1.0f);
  const Lanes ih = all(1.0f / m.h), tiny = all(1e-12f);
  Lanes sx = all(0), sy = all(0), sz = all(0);
  const std::uint32_t* const list = s.neighbours.data() + i * kStride;
  for (std::uint32_t k = 0; k < s.neighbour_count[i]; k += 4) {
    Lanes ox, oy, oz, lambda;
    gather(s.place.data(), list + k, ox, oy, oz, lambda);
    const Lanes dx = x - ox, dy = y - oy, dz = z - oz;
    const Lanes r = squareRoot(dx * dx + dy * dy + dz * dz + tiny);
    const Lanes g = positive(one - r * ih);
    const Lanes along = lambda * g * g / r;
    sx += along * dx, sy += along * dy, sz += along * dz;
  }
  const float own = s.lambda[i] / volume[i];
  s.dx[i] = own * s.slope[i].a[0] + m.gradient_scale * sum(sx);
  s.dy[i] = own * s.slope[i].a[1] + m.gradient_scale * sum(sy);
  s.dz[i] = own * s.slope[i].a[2] + m.gradient_scale * sum(sz);
}

}  // namespace

void solveDensity(const Model& model, const State& state, ScratchData& s, float dt) {
  const std::size_t n = state.particles.count;
  const auto& volume = state.particles.volume;
  // A correction longer than a quarter of the spacing a time would be an explosion, not a pressure.
  const float most = 0.25f * static_cast<float>(model.parameters.spacing);
  for (int iteration = 0; iteration < model.parameters.iterations; ++iteration) {
    each(n, s.threads, [&](std::size_t i) { findLambda(model, s, i); });
    each(n, s.threads, [&](std::size_t i) { s.place[i].a[3] = s.lambda[i]; });
    each(n, s.threads, [&](std::size_t i) { findCorrection(model, s, volume, i); });
    each(n, s.threads, [&](std::size_t i) {
      const float length = std::sqrt(s.dx[i] * s.dx[i] + s.dy[i] * s.dy[i] + s.dz[i] * s.dz[i]);
      const float factor = length > most ? most / length : 1.0f;
      s.place[i].a[0] += factor * s.dx[i];
      s.place[i].a[1] += factor * s.dy[i];
      s.place[i].a[2] += factor * s.dz[i];
      s.place[i].a[3] = volume[i];
    });
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
  const float h = model.h, ks = model.gradient_scale;
  for (std::size_t i = 0; i < n; ++i) s.velocity[i] = {{p.vx[i], p.vy[i], p.vz[i], p.blood[i]}};
  each(n, s.threads, [&](std::size_t i) {
    const Quad q = s.place[i], w = s.velocity[i];
    const Lanes x = all(q.a[0]), y = all(q.a[1]), z = all(q.a[2]), one = all(1.0f), half = all(0.5f);
    const Lanes vx = all(w.a[0]), vy = all(w.a[1]), vz = all(w.a[2]), blood = all(w.a[3]);
    const Lanes ih = all(1.0f / h), tiny = all(1e-12f), soft = all(0.01f * h * h), near = all(1.0f / 64);
    const Lanes base = all(nu_water), step_nu = all(nu_blood - nu_water), c0 = all(cw), c1 = all(cb - cw);
    Lanes ax = all(0), ay = all(0), az = all(0);
    const std::uint32_t* const list = s.neighbours.data() + i * kStride;
    for (std::uint32_t k = 0; k < s.neighbour_count[i]; k += 4) {
      Lanes ox, oy, oz, v, ux, uy, uz, b;
      gather(s.place.data(), list + k, ox, oy, oz, v);
      gather(s.velocity.data(), list + k, ux, uy, uz, b);
      const Lanes dx = x - ox, dy = y - oy, dz = z - oz;
      const Lanes r2 = dx * dx + dy * dy + dz * dz + tiny;
      const Lanes r = squareRoot(r2), t = r * ih, g = positive(one - t);
      const Lanes mixed = half * (blood + b);
      // Monaghan: 10 nu (v_ij·x_ij)/(r² + 0.01 h²) grad W.
      const Lanes closing = (vx - ux) * dx + (vy - uy) * dy + (vz - uz) * dz;
      const Lanes viscous =
          all(-10.0f * ks) * (base + step_nu * mixed) * v * g * g / r * closing / (r2 + soft);
      // Akinci: (1−t)³t³, and below t = ½ twice that minus 1/64.
      const Lanes g3 = g * g * g * t * t * t;
      const LaneMask close = t < half;
      const Lanes shape = reinterpret_cast<Lanes>((reinterpret_cast<LaneMask>(g3 + g3 - near) & close) |
                                                  (reinterpret_cast<LaneMask>(g3) & ~close));
      const Lanes pull = -(c0 + c1 * mixed) * v * shape / r;
      const Lanes both = viscous + pull;
      ax += both * dx, ay += both * dy, az += both * dz;
    }
    s.dx[i] = dt * sum(ax), s.dy[i] = dt * sum(ay), s.dz[i] = dt * sum(az);
  });
  for (std::size_t i = 0; i < n; ++i) p.vx[i] += s.dx[i], p.vy[i] += s.dy[i], p.vz[i] += s.dz[i];
}

}  // namespace vest::fluid
