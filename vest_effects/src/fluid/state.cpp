#include "vest_effects/fluid/state.h"

#include <cmath>
#include <type_traits>

#include "vest_effects/state_bytes.h"

namespace vest::fluid {
namespace {

/// Calls f(pointer, bytes) for everything of the State, in a fixed order.
constexpr auto kEverything = [](auto& s, auto&& f) {
  const auto value = [&](auto& v) {
    if constexpr (std::is_same_v<std::remove_const_t<std::remove_reference_t<decltype(v)>>, bool>) {
      std::uint8_t byte = v ? 1 : 0;  // any byte may come, a bool may not be any
      f(&byte, sizeof byte);
      if constexpr (!std::is_const_v<std::remove_reference_t<decltype(v)>>) v = byte != 0;
    } else {
      f(&v, sizeof v);
    }
  };
  const auto array = [&](auto& a) { f(a.data(), a.size() * sizeof a[0]); };
  value(s.step), value(s.time);
  auto& p = s.particles;
  value(p.count);
  array(p.x), array(p.y), array(p.z), array(p.vx), array(p.vy), array(p.vz);
  array(p.volume), array(p.blood), array(p.age), array(p.rest);
  auto& w = s.pools;
  array(w.bed), array(w.bed_triangle), array(w.depth), array(w.blood), array(w.u), array(w.v), array(w.rise),
      array(w.head), array(w.raised), array(w.sunk);
  value(w.sunk_at);
  array(w.film), array(w.film_age), array(w.ground), value(w.filmed_at);
  auto& b = s.bubbles;
  value(b.count);
  array(b.x), array(b.y), array(b.z), array(b.radius), array(b.left);
  array(s.knots), value(s.has_knots);
  array(s.pending), array(s.released);
  value(s.air), value(s.emitted), value(s.emitted_blood), value(s.sucked), value(s.sucked_blood),
      value(s.soaked), value(s.soaked_blood), value(s.lost), value(s.stained);
  value(s.degraded);
};

}  // namespace

State initialState(const Model& model) {
  State s;
  const auto n = static_cast<std::size_t>(model.parameters.capacity);
  auto& p = s.particles;
  for (auto* a : {&p.x, &p.y, &p.z, &p.vx, &p.vy, &p.vz, &p.volume, &p.blood, &p.age, &p.rest})
    a->assign(n, 0.0f);
  const auto c = static_cast<std::size_t>(model.columns), r = static_cast<std::size_t>(model.rows);
  auto& w = s.pools;
  w.bed.assign(c * r, kNoBed);
  w.bed_triangle.assign(c * r, -1);
  for (auto* a : {&w.depth, &w.blood, &w.rise, &w.head, &w.raised, &w.film, &w.film_age})
    a->assign(c * r, 0.0f);
  w.ground.assign(c * r, kNoBed);
  w.sunk.assign(2 * c * r, -1.0f);
  w.u.assign((c + 1) * r, 0.0f);
  w.v.assign(c * (r + 1), 0.0f);
  s.knots.assign(3 * model.first_knot.back(), 0.0f);
  return s;
}

double particleVolume(const Model& model, const State& state) {
  double sum = 0;
  for (std::size_t i = 0; i < state.particles.count; ++i)
    sum += static_cast<double>(state.particles.volume[i]);
  return sum * model.whole;
}

double pendingVolume(const State& state) {
  double sum = 0;
  for (const double v : state.pending) sum += v;
  return sum;
}

double poolVolume(const Model& model, const State& state) {
  double sum = 0;
  for (const float d : state.pools.depth) sum += static_cast<double>(d);
  return sum * model.parameters.pool_cell * model.parameters.pool_cell;
}

double poolBlood(const Model& model, const State& state) {
  double sum = 0;
  for (const float d : state.pools.blood) sum += static_cast<double>(d);
  return sum * model.parameters.pool_cell * model.parameters.pool_cell;
}

double filmVolume(const Model& model, const State& state) {
  double sum = 0;
  for (const float d : state.pools.film) sum += static_cast<double>(d);
  return sum * model.parameters.pool_cell * model.parameters.pool_cell;
}

void save(const State& state, std::vector<std::uint8_t>& bytes) {
  effects::savePieces(state, kEverything, bytes);
}

bool restore(const Model& model, const std::uint8_t* bytes, std::size_t size, State& state) {
  State read = initialState(model);
  if (!effects::restorePieces(bytes, size, read, kEverything) ||
      read.particles.count > read.particles.x.size() ||
      read.bubbles.count > static_cast<std::size_t>(kMostBubbles))
    return false;
  // Places and ways become numbers of cells: beyond this none has one. Also false for what is no number.
  constexpr double kFarthest = 1e5;
  const auto within = [](const auto& a, double least, double most) {
    for (const double v : a)
      if (!(v >= least && v <= most)) return false;
    return true;
  };
  const auto near = [&](const auto& a) { return within(a, -kFarthest, kFarthest); };
  const auto& p = read.particles;
  for (const auto* a : {&p.x, &p.y, &p.z, &p.vx, &p.vy, &p.vz, &p.rest})
    if (!near(*a)) return false;
  if (!within(p.volume, 0, 2) || !within(p.blood, -0.01, 1.01) || !within(p.age, 0, 1e9)) return false;
  const auto& b = read.bubbles;
  for (const auto* a : {&b.x, &b.y, &b.z, &b.radius, &b.left})
    if (!near(*a)) return false;
  const auto& w = read.pools;
  const auto& knots = read.knots;
  for (const auto* a :
       {&w.bed, &w.depth, &w.blood, &w.u, &w.v, &w.rise, &w.head, &w.raised, &w.sunk, &w.ground, &knots})
    if (!near(*a)) return false;
  if (!within(w.film, 0, 1) || !within(w.film_age, 0, 1e9)) return false;
  if (!within(read.pending, 0, 1)) return false;
  const double volumes[] = {read.emitted, read.emitted_blood, read.sucked, read.sucked_blood,
                            read.soaked,  read.soaked_blood,  read.lost,   read.stained};
  const double times[] = {read.time, w.sunk_at, w.filmed_at};
  if (!near(volumes) || !within(times, 0, 1e9) || !(read.air >= 0 && read.air <= 1)) return false;
  for (const std::int32_t t : w.bed_triangle)
    if (t < -1 || t >= static_cast<std::int64_t>(model.triangles)) return false;
  state = std::move(read);
  return true;
}

}  // namespace vest::fluid
