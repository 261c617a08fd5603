#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "vest_effects/fluid/model.h"
#include "vest_effects/setting.h"

namespace vest::fluid {

/// Particles as arrays with room for Parameters::capacity; the first `count` are alive.
struct Particles {
  std::size_t count = 0;
  std::vector<float> x, y, z;     ///< m, world
  std::vector<float> vx, vy, vz;  ///< m/s
  std::vector<float> volume;      ///< of a whole particle, 0 … 1
  std::vector<float> blood;       ///< 0 water … 1 blood
  std::vector<float> age;         ///< s since it was emitted
  std::vector<float> rest;        ///< s that it has lain slowly on tissue (a twentieth of it on walls)
};

/// Shallow water over the upward faces of the tissue. Cell (c, r) is r·columns + c; its centre is
/// low + (c+½, r+½)·pool_cell.
struct Pools {
  std::vector<float> bed;                  ///< m, world z of the tissue; kNoBed where there is none
  std::vector<std::int32_t> bed_triangle;  ///< index among all triangles, -1: none
  std::vector<float> depth;                ///< m
  std::vector<float> blood;                ///< m: part of the depth that is blood
  std::vector<float> u;                    ///< m/s at faces c−½, (columns+1)·rows
  std::vector<float> v;                    ///< m/s at faces r−½, columns·(rows+1)
  std::vector<float> rise;                 ///< m/s, vertical velocity of the surface
  std::vector<float> head;    ///< m: pressure of impacts and of `raised` in this step, as a water column
  std::vector<float> raised;  ///< m: how much higher the surface is for what instruments displace
  /// m, per cell for what stands there, then per cell for what reaches under tissue: how much lower liquid
  /// stands that fills the gaps under tissue beside it, too. < 0: there are none.
  std::vector<float> sunk;
  double sunk_at = 0;  ///< s: State::time when it was renewed
  // Blood that lies on rigid ground as a film, under a pool or beside it.
  std::vector<float> film;      ///< m
  std::vector<float> film_age;  ///< s since it was left there, mean; drying adds to it (setting.h)
  std::vector<float> ground;    ///< m, world z of that ground; kNoBed where no blood has been
  double filmed_at = 0;         ///< s: State::time when they were renewed

  /// m, world z of the surface of a cell that is wet.
  float top(std::size_t cell) const { return bed[cell] + depth[cell] + raised[cell]; }
};
inline constexpr float kNoBed = -1.0e3f;
inline constexpr float kDryDepth = 1.0e-5f;  ///< m: shallower counts as dry (tuned)

struct Bubbles {
  std::size_t count = 0;
  std::array<float, kMostBubbles> x{}, y{}, z{};  ///< m, world
  std::array<float, kMostBubbles> radius{};       ///< m
  std::array<float, kMostBubbles> left{};         ///< s until it bursts
};

/// Everything that evolves. A copy is a snapshot.
struct State {
  std::uint64_t step = 0;
  double time = 0;  ///< s
  Particles particles;
  Pools pools;
  Bubbles bubbles;
  std::vector<float> knots;  ///< m: knots of all surfaces at the end of the last step, x y z
  bool has_knots = false;
  std::array<double, kMostSources> pending{};          ///< m³ due, per slot
  std::array<std::uint32_t, kMostSources> released{};  ///< particles, per slot
  double air = 0;                                      ///< m³ of air dragged into pools, not yet a bubble
  double emitted = 0, emitted_blood = 0;               ///< m³ since the start
  double sucked = 0, sucked_blood = 0;                 ///< m³
  double soaked = 0, soaked_blood = 0;                 ///< m³ that gauze took up and has not given back
  double lost = 0;                                     ///< m³ that left the domain
  double stained = 0;                                  ///< m³ of blood left on soft tissue as a film
  bool degraded = false;                               ///< the particle budget was exhausted in the last step
};

/// Nothing in it: no particle, no pool.
State initialState(const Model& model);

double particleVolume(const Model& model, const State& state);  ///< m³
double pendingVolume(const State& state);  ///< m³ that waits at sources for a whole particle
double poolVolume(const Model& model, const State& state);  ///< m³
double poolBlood(const Model& model, const State& state);   ///< m³ of blood in the pools

double filmVolume(const Model& model, const State& state);  ///< m³ of the films on rigid ground

/// State as bytes, little-endian, arrays whole (their unused ends too): for hashes and snapshots.
void save(const State& state, std::vector<std::uint8_t>& bytes);
/// All or nothing. @return false where the bytes do not belong to this model, or hold what no step leaves
bool restore(const Model& model, const std::uint8_t* bytes, std::size_t size, State& state);

}  // namespace vest::fluid
