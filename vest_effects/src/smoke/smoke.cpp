#include "vest_effects/smoke/smoke.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>

#include "vest_effects/smoke/noise.h"
#include "vest_effects/state_bytes.h"
#include "vest_tissue/solver/random.h"

namespace vest::smoke {
namespace {

constexpr float kLife = 3.5f;         ///< s of a puff (assumed)
constexpr double kPuffEvery = 0.08;   ///< s between puffs of a source (assumed)
constexpr double kLeastMass = 1e-10;  ///< kg: a cavity with less counts as clear (assumed)
constexpr int kTransports = 3;        ///< a step
constexpr int kRelaxations = 8;       ///< a step; the pressure goes on from the step before

[[noreturn]] void refuse(const std::string& field, double value, const std::string& allowed) {
  std::ostringstream text;
  text << "smoke: " << field << ": " << value << " (allowed: " << allowed << ")";
  throw std::invalid_argument(text.str());
}

struct Grid {
  int nx, ny, nz;
  float x0, y0, z0, cell;
  explicit Grid(const Model& m)
      : nx(m.nx),
        ny(m.ny),
        nz(m.nz),
        x0(static_cast<float>(m.parameters.low[0])),
        y0(static_cast<float>(m.parameters.low[1])),
        z0(static_cast<float>(m.parameters.low[2])),
        cell(static_cast<float>(m.parameters.cell)) {}
  std::size_t at(int i, int j, int k) const { return (static_cast<std::size_t>(k) * ny + j) * nx + i; }
  std::size_t uAt(int i, int j, int k) const { return (static_cast<std::size_t>(k) * ny + j) * (nx + 1) + i; }
  std::size_t vAt(int i, int j, int k) const { return (static_cast<std::size_t>(k) * (ny + 1) + j) * nx + i; }
  std::size_t wAt(int i, int j, int k) const { return at(i, j, k); }
  bool find(float x, float y, float z, int& i, int& j, int& k) const {
    const float fx = (x - x0) / cell, fy = (y - y0) / cell, fz = (z - z0) / cell;
    if (!(fx >= 0 && fy >= 0 && fz >= 0 && fx < static_cast<float>(nx) && fy < static_cast<float>(ny) &&
          fz < static_cast<float>(nz)))
      return false;
    i = static_cast<int>(fx), j = static_cast<int>(fy), k = static_cast<int>(fz);
    return true;
  }
};

bool finite(const std::array<double, 3>& a) {
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

bool good(const Inputs& in) {
  if (!(in.dt >= 1e-4 && in.dt <= 0.1) || !(in.renewal >= 0 && in.renewal <= 10) || in.source_count < 0 ||
      in.source_count > kMostSources || in.suction_count < 0 || in.suction_count > kMostSuctions)
    return false;
  for (int k = 0; k < in.source_count; ++k)
    if (!finite(in.sources[k].position) || !(in.sources[k].energy >= 0 && in.sources[k].energy <= 1000))
      return false;
  for (int k = 0; k < in.suction_count; ++k)
    if (!finite(in.suctions[k].position) || !(in.suctions[k].flow >= 0 && in.suctions[k].flow <= 0.01))
      return false;
  return true;
}

void makePuff(const Model& model, const Inputs& in, State& s) {
  double energy = 0;
  int strongest = -1;
  for (int k = 0; k < in.source_count; ++k) {
    energy += in.sources[k].energy;
    if (strongest < 0 || in.sources[k].energy > in.sources[strongest].energy) strongest = k;
  }
  s.waiting += energy * model.parameters.yield;
  s.since_puff += in.dt;
  if (!(s.waiting > 0) || strongest < 0 || !(energy > 0) || s.since_puff < kPuffEvery) return;
  if (s.puff_count == kMostPuffs) {  // the oldest makes room: it is nearly gone
    for (std::uint32_t k = 1; k < s.puff_count; ++k) s.puffs[k - 1] = s.puffs[k];
    --s.puff_count;
  }
  Puff& p = s.puffs[s.puff_count++];
  p = Puff{};
  p.seed = s.puffs_made++;
  for (int a = 0; a < 3; ++a) {
    p.position[static_cast<std::size_t>(a)] = static_cast<float>(
        in.sources[strongest].position[a] +
        0.004 * (solver::randomUniform(in.seed, p.seed, static_cast<std::uint64_t>(a)) - 0.5));
  }
  p.mass = static_cast<float>(s.waiting);
  s.waiting = 0;
  s.since_puff = 0;
}

void force(const Model& m, const Inputs& in, const Grid& g, State& s) {
  const Parameters& p = m.parameters;
  const auto dt = static_cast<float>(in.dt), keep = 1.0f / (1.0f + dt * static_cast<float>(p.damping));
  for (auto* a : {&s.u, &s.v, &s.w})
    for (float& x : *a) x *= keep;
  const float lift = dt * static_cast<float>(p.rise) * 1000.0f, stir = dt * static_cast<float>(p.stirring);
  constexpr int kMask = kTurbulenceSide - 1;
  const int shift = static_cast<int>(s.step / 8 & kMask);
  for (int k = 1; k < g.nz; ++k) {
    for (int j = 0; j < g.ny; ++j) {
      for (int i = 0; i < g.nx; ++i) {
        const std::size_t c = g.at(i, j, k);
        const float here = 0.5f * (s.density[c] + s.density[g.at(i, j, k - 1)]);
        if (here < 1e-6f) continue;
        // At most 2 m/s²: a hot plume, not an explosion.
        s.w[c] += std::min(lift * here, 2.0f * dt);
        const auto t = [&](int di, int dj) {
          return m.turbulence[static_cast<std::size_t>(
                     (((k - shift) & kMask) * kTurbulenceSide + ((j + dj) & kMask)) * kTurbulenceSide +
                     ((i + di) & kMask))] -
                 1.0f;
        };
        const float amount = stir * std::min(1.0f, here * 2000.0f);
        if (i > 0) s.u[g.uAt(i, j, k)] += amount * t(7, 0);
        if (j > 0) s.v[g.vAt(i, j, k)] += amount * t(0, 11);
      }
    }
  }
}

/// One row of a red-black relaxation: the cells of this colour, whose first is `first`. All cells are
/// reckoned and those of the other colour kept as they are, which is done eight at a time. Neighbours that a
/// cell at a wall lacks count as itself: nothing flows through walls.
void relaxRow(const Grid& g, int j, int k, int first, const std::vector<float>& divergence,
              std::vector<float>& pressure, Scratch& scratch) {
  const auto nx = static_cast<std::size_t>(g.nx);
  const std::size_t row = g.at(0, j, k), sheet = nx * static_cast<std::size_t>(g.ny);
  float* const old = scratch.in.data();
  std::copy_n(pressure.data() + row, nx, old + 1);
  old[0] = old[1], old[nx + 1] = old[nx];
  const float* const p = pressure.data() + row;
  const auto relax = [nx](float* __restrict now, const float* __restrict own, const float* __restrict south,
                          const float* __restrict north, const float* __restrict below,
                          const float* __restrict above, const float* __restrict rest,
                          const std::uint32_t* __restrict colour) {
    for (std::size_t i = 0; i < nx; ++i) {
      const float here = own[i + 1];
      const float around = own[i] + own[i + 2] + south[i] + north[i] + below[i] + above[i];
      const float relaxed = here + (1.6f / 6.0f) * (around - 6.0f * here - rest[i]);
      now[i] = colour[i] != 0 ? relaxed : here;
    }
  };
  relax(pressure.data() + row, old, j > 0 ? p - nx : old + 1, j + 1 < g.ny ? p + nx : old + 1,
        k > 0 ? p - sheet : old + 1, k + 1 < g.nz ? p + sheet : old + 1, divergence.data() + row,
        scratch.colour.data() + first);
}

/// Makes the flow free of sources, but for the suction's sinks and the gas that flows in for them everywhere.
void project(const Inputs& in, const Grid& g, State& s, Scratch& scratch) {
  double sink = 0;
  const auto divergence = [&](int i, int j, int k) {
    return s.u[g.uAt(i + 1, j, k)] - s.u[g.uAt(i, j, k)] + s.v[g.vAt(i, j + 1, k)] - s.v[g.vAt(i, j, k)] +
           s.w[g.wAt(i, j, k + 1)] - s.w[g.wAt(i, j, k)];
  };
  std::array<std::size_t, kMostSuctions> place{};
  std::array<float, kMostSuctions> strength{};
  int count = 0;
  for (int q = 0; q < in.suction_count; ++q) {
    int i, j, k;
    const auto& t = in.suctions[q];
    if (!g.find(static_cast<float>(t.position[0]), static_cast<float>(t.position[1]),
                static_cast<float>(t.position[2]), i, j, k))
      continue;
    place[static_cast<std::size_t>(count)] = g.at(i, j, k);
    strength[static_cast<std::size_t>(count++)] =
        static_cast<float>(t.flow / (static_cast<double>(g.cell) * static_cast<double>(g.cell)));
    sink += t.flow / (static_cast<double>(g.cell) * static_cast<double>(g.cell));
  }
  const float inflow = static_cast<float>(sink / (static_cast<double>(g.nx) * g.ny * g.nz));
  std::vector<float>& rest = scratch.divergence;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) rest[g.at(i, j, k)] = divergence(i, j, k) - inflow;
  for (int q = 0; q < count; ++q)
    rest[place[static_cast<std::size_t>(q)]] += strength[static_cast<std::size_t>(q)];
  for (int pass = 0; pass < 2 * kRelaxations; ++pass)
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny; ++j) relaxRow(g, j, k, (j + k + pass) & 1, rest, s.pressure, scratch);
  const auto nx = static_cast<std::size_t>(g.nx);
  for (int k = 0; k < g.nz; ++k) {
    for (int j = 0; j < g.ny; ++j) {
      const float* const p = s.pressure.data() + g.at(0, j, k);
      const auto subtract = [&](float* __restrict from, const float* at, const float* before,
                                std::size_t count) {
        for (std::size_t i = 0; i < count; ++i) from[i] -= at[i] - before[i];
      };
      subtract(s.u.data() + g.uAt(1, j, k), p + 1, p, nx - 1);
      if (j > 0) subtract(s.v.data() + g.vAt(0, j, k), p, s.pressure.data() + g.at(0, j - 1, k), nx);
      if (k > 0) subtract(s.w.data() + g.wAt(0, j, k), p, s.pressure.data() + g.at(0, j, k - 1), nx);
    }
  }
  // What was subtracted is no longer there: the next step begins with a part of it, for what is steady.
  for (float& p : s.pressure) p *= 0.25f;
}

/// What flows through `count` faces: of the density upwind, with at most `limit`.
void fluxes(std::size_t count, float limit, float ratio, const float* __restrict velocity,
            const float* __restrict from, const float* __restrict to, float* __restrict out) {
  for (std::size_t i = 0; i < count; ++i) {
    const float u = velocity[i], behind = from[i], ahead = to[i];
    const float over = u < -limit ? -limit : u, v = limit < over ? limit : over;
    out[i] = ratio * v * (v > 0 ? behind : ahead);
  }
}
void exchange(std::size_t count, const float* __restrict in, const float* __restrict out,
              float* __restrict rho) {
  for (std::size_t i = 0; i < count; ++i) rho[i] = rho[i] + in[i] - out[i];
}

/// One direction after another, in place: each keeps the sum and the sign. Rows and sheets at once: each
/// cell's numbers stand for themselves.
void transport(const Grid& g, float dt, State& s, Scratch& scratch) {
  // No face carries more than a sixth of a cell: the donor never runs dry.
  const float limit = 0.16f * g.cell / dt, ratio = dt / g.cell;
  const auto nx = static_cast<std::size_t>(g.nx), sheet = nx * static_cast<std::size_t>(g.ny);
  std::vector<float>&in = scratch.in, &out = scratch.out;
  const auto along = [&](std::size_t steps, std::size_t count, const float* velocity, float* rho) {
    std::fill_n(in.begin(), count, 0.0f);
    for (std::size_t k = 0; k < steps; ++k, rho += count) {
      velocity += count;  // of the faces behind these cells
      if (k + 1 < steps)
        fluxes(count, limit, ratio, velocity, rho, rho + count, out.data());
      else
        std::fill_n(out.begin(), count, 0.0f);
      exchange(count, in.data(), out.data(), rho);
      in.swap(out);
    }
  };
  for (int k = 0; k < g.nz; ++k) {
    for (int j = 0; j < g.ny; ++j) {
      float* const rho = s.density.data() + g.at(0, j, k);
      out[0] = out[nx] = 0.0f;
      fluxes(nx - 1, limit, ratio, s.u.data() + g.uAt(1, j, k), rho, rho + 1, out.data() + 1);
      exchange(nx, out.data(), out.data() + 1, rho);
    }
  }
  for (int k = 0; k < g.nz; ++k)
    along(static_cast<std::size_t>(g.ny), nx, s.v.data() + g.vAt(0, 0, k), s.density.data() + g.at(0, 0, k));
  along(static_cast<std::size_t>(g.nz), sheet, s.w.data(), s.density.data());
}

/// Cells of a column below a wall that hangs into the box: at least one.
int openCells(const Grid& g, const float* ceiling, int i, int j) {
  if (!ceiling) return g.nz;
  const float cells = (ceiling[static_cast<std::size_t>(j) * g.nx + i] - g.z0) / g.cell + 0.5f;
  return cells < 1 ? 1 : cells < static_cast<float>(g.nz) ? static_cast<int>(cells) : g.nz;
}

/// What is above a wall that hangs goes below it, and nothing flows into it.
void pushBelow(const Grid& g, const float* ceiling, State& s) {
  for (int j = 0; j < g.ny; ++j) {
    for (int i = 0; i < g.nx; ++i) {
      const int open = openCells(g, ceiling, i, j);
      float& top = s.density[g.at(i, j, open - 1)];
      for (int k = open; k < g.nz; ++k) {
        float& above = s.density[g.at(i, j, k)];
        top += above, above = 0;
        s.pressure[g.at(i, j, k)] = 0;
        s.w[g.wAt(i, j, k)] = s.u[g.uAt(i, j, k)] = s.u[g.uAt(i + 1, j, k)] = s.v[g.vAt(i, j, k)] =
            s.v[g.vAt(i, j + 1, k)] = 0;
      }
    }
  }
}

void movePuffs(const Inputs& in, const Grid& g, State& s) {
  const auto dt = static_cast<float>(in.dt);
  std::uint32_t kept = 0;
  for (std::uint32_t q = 0; q < s.puff_count; ++q) {
    Puff p = s.puffs[q];
    int i, j, k;
    if (g.find(p.position[0], p.position[1], p.position[2], i, j, k)) {
      p.position[0] += 0.5f * dt * (s.u[g.uAt(i, j, k)] + s.u[g.uAt(i + 1, j, k)]);
      p.position[1] += 0.5f * dt * (s.v[g.vAt(i, j, k)] + s.v[g.vAt(i, j + 1, k)]);
      p.position[2] += 0.5f * dt * (s.w[g.wAt(i, j, k)] + s.w[g.wAt(i, j, k + 1)]);
    }
    // Its own warmth lifts it at first.
    p.position[2] = std::min(p.position[2] + dt * 0.05f / (1.0f + p.age),
                             g.z0 + (static_cast<float>(g.nz) - 0.1f) * g.cell);
    if (in.ceiling && g.find(p.position[0], p.position[1], p.position[2], i, j, k))
      p.position[2] =
          std::min(p.position[2], std::max(g.z0, in.ceiling[static_cast<std::size_t>(j) * g.nx + i]));
    p.age += dt;
    bool drawn = false;
    for (int t = 0; t < in.suction_count; ++t) {
      float d2 = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        const float d = p.position[a] - static_cast<float>(in.suctions[t].position[a]);
        d2 += d * d;
      }
      drawn |= d2 < 0.012f * 0.012f && in.suctions[t].flow > 0;
    }
    if (p.age < kLife && !drawn) s.puffs[kept++] = p;
  }
  s.puff_count = kept;
}

}  // namespace

Model buildModel(const Parameters& p) {
  static const char* const kAxis[] = {"x", "y", "z"};
  if (!(p.cell >= 0.002 && p.cell <= 0.1)) refuse("cell", p.cell, "0.002 to 0.1 m");
  Model m;
  m.parameters = p;
  int* const n[3] = {&m.nx, &m.ny, &m.nz};
  double cells = 1;
  for (int a = 0; a < 3; ++a) {
    const double side = p.high[a] - p.low[a];
    if (!(side >= 2 * p.cell && side <= 2.0))
      refuse(std::string("high - low, ") + kAxis[a], side, "two cells to 2 m");
    cells *= *n[a] = static_cast<int>(side / p.cell + 0.999);
  }
  if (cells > 200000) refuse("cells", cells, "at most 200000");
  const auto within = [](const char* field, double v, double low, double high) {
    if (!(v >= low && v <= high)) refuse(field, v, std::to_string(low) + " to " + std::to_string(high));
  };
  within("yield", p.yield, 0, 1e-4);
  within("rise", p.rise, 0, 100);
  within("damping", p.damping, 0, 1000);
  within("stirring", p.stirring, 0, 10);
  within("settling", p.settling, 0.1, 1e9);
  m.turbulence.resize(static_cast<std::size_t>(kTurbulenceSide) * kTurbulenceSide * kTurbulenceSide);
  double sum = 0;
  std::size_t c = 0;
  for (int k = 0; k < kTurbulenceSide; ++k)
    for (int j = 0; j < kTurbulenceSide; ++j)
      for (int i = 0; i < kTurbulenceSide; ++i) {
        const double t = turbulence((i + 0.5) / 4, (j + 0.5) / 4, (k + 0.5) / 4, 3, kTurbulenceSide / 4);
        m.turbulence[c++] = static_cast<float>(t);
        sum += t;
      }
  const auto scale = static_cast<float>(static_cast<double>(c) / sum);
  for (float& t : m.turbulence) t *= scale;
  return m;
}

State initialState(const Model& m) {
  State s;
  const auto x = static_cast<std::size_t>(m.nx), y = static_cast<std::size_t>(m.ny),
             z = static_cast<std::size_t>(m.nz);
  s.density.assign(x * y * z, 0);
  s.pressure.assign(x * y * z, 0);
  s.u.assign((x + 1) * y * z, 0);
  s.v.assign(x * (y + 1) * z, 0);
  s.w.assign(x * y * (z + 1), 0);
  return s;
}

double mass(const Model& m, const State& s) {
  double sum = 0;
  for (const float d : s.density) sum += static_cast<double>(d);
  return sum * m.parameters.cell * m.parameters.cell * m.parameters.cell;
}

Status step(const Model& model, const Inputs& in, State& s, Scratch& scratch) {
  if (!good(in)) return Status::BadInput;
  const Grid g(model);
  const double cell_volume = model.parameters.cell * model.parameters.cell * model.parameters.cell;
  double there = 0;
  for (const float d : s.density) there += static_cast<double>(d);
  there *= cell_volume;
  for (int q = 0; q < in.source_count; ++q) {
    int i, j, k;
    const auto& from = in.sources[q];
    const double made = from.energy * model.parameters.yield;
    if (!(made > 0) || !g.find(static_cast<float>(from.position[0]), static_cast<float>(from.position[1]),
                               static_cast<float>(from.position[2]), i, j, k))
      continue;
    s.density[g.at(i, j, k)] += static_cast<float>(made / cell_volume);
    s.made += made;
    there += made;
  }
  makePuff(model, in, s);
  ++s.step;
  s.time += in.dt;
  if (there < kLeastMass) {
    if (there > 0) {
      s.faded += there;
      std::fill(s.density.begin(), s.density.end(), 0.0f);
      for (auto* a : {&s.u, &s.v, &s.w, &s.pressure}) std::fill(a->begin(), a->end(), 0.0f);
    }
    movePuffs(in, g, s);
    return Status::Ok;
  }
  force(model, in, g, s);
  project(in, g, s, scratch);
  if (in.ceiling) pushBelow(g, in.ceiling, s);
  for (int k = 0; k < kTransports; ++k) transport(g, static_cast<float>(in.dt) / kTransports, s, scratch);
  for (int q = 0; q < in.suction_count; ++q) {
    int i, j, k;
    const auto& tip = in.suctions[q];
    if (!g.find(static_cast<float>(tip.position[0]), static_cast<float>(tip.position[1]),
                static_cast<float>(tip.position[2]), i, j, k))
      continue;
    const auto share = static_cast<float>(std::min(0.9, tip.flow * in.dt / cell_volume));
    float& d = s.density[g.at(i, j, k)];
    s.drawn += static_cast<double>(share * d) * cell_volume;
    d -= share * d;
  }
  const double rate = in.dt * (in.renewal + 1 / model.parameters.settling);
  const auto keep = static_cast<float>(1.0 / (1.0 + rate));
  double gone = 0;
  for (float& d : s.density) {
    gone += static_cast<double>(d - d * keep);
    d *= keep;
  }
  s.faded += gone * cell_volume;
  movePuffs(in, g, s);
  return Status::Ok;
}

float densityAt(const Model& model, const State& s, float x, float y, float z) {
  const Grid g(model);
  int i, j, k;
  return g.find(x, y, z, i, j, k) ? s.density[g.at(i, j, k)] : 0.0f;
}

void drawnDensity(const Model& model, const State& s, float* out) {
  const Grid g(model);
  constexpr int kMask = kTurbulenceSide - 1;
  const double way = s.time * 0.04 / model.parameters.cell;  // the texture shifts up at 4 cm/s (assumed)
  const double whole = std::floor(way);
  const int shift = static_cast<int>(static_cast<long long>(whole) & kMask);
  const auto part = static_cast<float>(way - whole);
  std::size_t c = 0;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i, ++c) {
        if (s.density[c] <= 0) {
          out[c] = 0;
          continue;
        }
        const auto t = [&](int kk) {
          return model.turbulence[static_cast<std::size_t>(
              ((kk & kMask) * kTurbulenceSide + (j & kMask)) * kTurbulenceSide + (i & kMask))];
        };
        out[c] = s.density[c] * ((1.0f - part) * t(k - shift) + part * t(k - shift - 1));
      }
}

PuffLook lookOf(const Puff& puff) {
  // Key frames k0 … k5, equally spaced over the life: radius grows by mixing, density falls (assumed).
  static constexpr std::array<float, 6> kRadius{0.004f, 0.011f, 0.018f, 0.025f, 0.031f, 0.036f};
  static constexpr std::array<float, 6> kOpacity{0.3f, 1.0f, 0.8f, 0.5f, 0.2f, 0.0f};
  PuffLook look;
  look.phase = std::clamp(puff.age / kLife, 0.0f, 1.0f);
  const float t = look.phase * 5.0f;
  const int i = std::min(4, static_cast<int>(t));
  const float f = t - static_cast<float>(i);
  const auto spline = [&](const std::array<float, 6>& key) {
    const auto at = [&](int k) { return key[static_cast<std::size_t>(std::clamp(k, 0, 5))]; };
    const float a = at(i - 1), b = at(i), c = at(i + 1), d = at(i + 2);
    return 0.5f *
           (2 * b + (c - a) * f + (2 * a - 5 * b + 4 * c - d) * f * f + (3 * b - a - 3 * c + d) * f * f * f);
  };
  look.radius = spline(kRadius);
  const float volume = 4.18879f * look.radius * look.radius * look.radius;
  look.density = std::max(0.0f, spline(kOpacity)) * puff.mass / volume;
  return look;
}

namespace {
constexpr auto kEverything = [](auto& s, auto&& f) {
  const auto value = [&](auto& v) { f(&v, sizeof v); };
  const auto array = [&](auto& a) { f(a.data(), a.size() * sizeof a[0]); };
  value(s.step), value(s.time);
  array(s.density), array(s.u), array(s.v), array(s.w), array(s.pressure), array(s.puffs);
  value(s.puff_count), value(s.puffs_made), value(s.waiting), value(s.since_puff);
  value(s.made), value(s.drawn), value(s.faded);
};
}  // namespace

void save(const State& state, std::vector<std::uint8_t>& bytes) {
  effects::savePieces(state, kEverything, bytes);
}

bool restore(const Model& model, const std::uint8_t* bytes, std::size_t size, State& state) {
  State read = initialState(model);
  constexpr double kLongest = 1e9;  // s; the drawn texture moves on with it
  if (!effects::restorePieces(bytes, size, read, kEverything) || read.puff_count > kMostPuffs ||
      !(read.time >= 0 && read.time <= kLongest) || !(read.since_puff >= 0 && read.since_puff <= kLongest) ||
      !(read.waiting >= 0 && read.waiting <= 1))
    return false;
  constexpr float kMost =
      1e5f;  // kg/m³, m/s, m²/s, m: no step leaves as much. Also false for what is no number
  const auto within = [](float v, float least) { return v >= least && v <= kMost; };
  for (const float v : read.density)
    if (!within(v, 0)) return false;
  for (const auto* a : {&read.u, &read.v, &read.w, &read.pressure})
    for (const float v : *a)
      if (!within(v, -kMost)) return false;
  for (const Puff& p : read.puffs) {
    for (const float v : p.position)
      if (!within(v, -kMost)) return false;
    if (!within(p.age, 0) || !within(p.mass, 0)) return false;
  }
  for (const double v : {read.made, read.drawn, read.faded})
    if (!std::isfinite(v)) return false;
  state = std::move(read);
  return true;
}

}  // namespace vest::smoke
