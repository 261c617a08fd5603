#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "vest_effects/fluid/step.h"

// Simple surfaces for tests, benchmarks and validation: plates and open boxes of triangles, and one fluid in
// them.

namespace vest::fluid::specimen {

struct Mesh {
  std::vector<float> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;

  /// A flat piece: corner, two edges, cells on each; its outside is edge0 × edge1.
  void add(std::array<double, 3> corner, std::array<double, 3> edge0, std::array<double, 3> edge1,
           int cells) {
    const auto first = static_cast<std::uint32_t>(positions.size() / 3);
    for (int j = 0; j <= cells; ++j)
      for (int i = 0; i <= cells; ++i)
        for (int a = 0; a < 3; ++a)
          positions.push_back(static_cast<float>(corner[a] + edge0[a] * i / cells + edge1[a] * j / cells));
    for (std::uint32_t j = 0; j < static_cast<std::uint32_t>(cells); ++j) {
      for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(cells); ++i) {
        const std::uint32_t w = static_cast<std::uint32_t>(cells) + 1, k = first + j * w + i;
        triangles.push_back({k, k + 1, k + w + 1});
        triangles.push_back({k, k + w + 1, k + w});
      }
    }
  }
  SurfaceSize size() const { return {positions.size() / 3, triangles.size()}; }
  Surface surface() const {
    return {positions.data(), triangles.data(), positions.size() / 3, triangles.size(), nullptr};
  }
};

inline Mesh plate(double half, double z = 0.0, int cells = 10) {
  Mesh m;
  m.add({-half, -half, z}, {2 * half, 0, 0}, {0, 2 * half, 0}, cells);
  return m;
}

/// Open box x0 … x1, y0 … y1 over the floor z = 0; its inside is where the fluid is.
inline Mesh openBox(double x0, double x1, double y0, double y1, double height, int cells = 6) {
  Mesh m;
  m.add({x0, y0, 0}, {x1 - x0, 0, 0}, {0, y1 - y0, 0}, cells);
  m.add({x0, y0, 0}, {0, y1 - y0, 0}, {0, 0, height}, cells);
  m.add({x1, y0, 0}, {0, 0, height}, {0, y1 - y0, 0}, cells);
  m.add({x0, y0, 0}, {0, 0, height}, {x1 - x0, 0, 0}, cells);
  m.add({x0, y1, 0}, {x1 - x0, 0, 0}, {0, 0, height}, cells);
  return m;
}

/// A fluid over meshes, and what a step needs.
struct Fluid {
  std::vector<Mesh> meshes;
  Model model;
  State state;
  Scratch scratch;
  Inputs inputs;
  Report report;
  std::vector<Surface> surfaces;
  bool still = false;  ///< says so of all surfaces from the second step on
  bool rigid = false;  ///< likewise, from the first

  Fluid(const Parameters& parameters, std::vector<Mesh> in, int threads = 1)
      : meshes(std::move(in)),
        model(buildModel(parameters, sizes())),
        state(initialState(model)),
        scratch(model, threads) {
    report.impacts.reserve(model.triangles);
  }
  std::vector<SurfaceSize> sizes() const {
    std::vector<SurfaceSize> s;
    for (const Mesh& m : meshes) s.push_back(m.size());
    return s;
  }
  void step() {
    surfaces.clear();
    for (const Mesh& m : meshes) {
      surfaces.push_back(m.surface());
      surfaces.back().still = still && state.step > 0;
      surfaces.back().rigid = rigid;
    }
    inputs.surfaces = surfaces.data();
    inputs.surface_count = surfaces.size();
    fluid::step(model, inputs, state, scratch, report);
    inputs.renew_bed = false;
  }
  /// Whole particles on a cubic lattice.
  void fill(double x0, double x1, double y0, double y1, double z0, double z1, float blood = 0) {
    const double d = model.parameters.spacing;
    Particles& p = state.particles;
    for (double z = z0 + d / 2; z < z1 - 1e-9; z += d)
      for (double y = y0 + d / 2; y < y1 - 1e-9; y += d)
        for (double x = x0 + d / 2; x < x1 - 1e-9; x += d) {
          if (p.count == p.x.size()) return;
          const std::size_t i = p.count++;
          p.x[i] = static_cast<float>(x), p.y[i] = static_cast<float>(y), p.z[i] = static_cast<float>(z);
          p.vx[i] = p.vy[i] = p.vz[i] = 0;
          p.volume[i] = 1, p.blood[i] = blood, p.age[i] = p.rest[i] = 0;
          state.emitted += model.whole;
        }
  }
  /// m³ that the account misses.
  double gap() const {
    return state.emitted - particleVolume(model, state) - poolVolume(model, state) - pendingVolume(state) -
           filmVolume(model, state) - state.sucked - state.soaked - state.lost - state.stained;
  }
};

}  // namespace vest::fluid::specimen
