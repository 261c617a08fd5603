#include "vest_effects/fluid/step.h"

#include <algorithm>
#include <cmath>

#include "scratch.h"

namespace vest::fluid {
namespace {

bool finite(const std::array<double, 3>& a) {
  return std::isfinite(a[0]) && std::isfinite(a[1]) && std::isfinite(a[2]);
}

bool good(const Model& model, const Inputs& in) {
  if (!(in.dt >= 1e-5 && in.dt <= 0.02) || !finite(in.gravity)) return false;
  if (in.source_count < 0 || in.source_count > kMostSources || in.suction_count < 0 ||
      in.suction_count > kMostSuctions || in.obstacle_count < 0 || in.obstacle_count > kMostObstacles ||
      in.surface_count > model.surfaces.size() || !(in.drying >= 0 && in.drying <= 1e-5))
    return false;
  for (int k = 0; k < in.source_count; ++k) {
    const Source& s = in.sources[k];
    if (s.slot < 0 || s.slot >= kMostSources) return false;
    const double d =
        s.direction[0] * s.direction[0] + s.direction[1] * s.direction[1] + s.direction[2] * s.direction[2];
    if (!finite(s.position) || !finite(s.direction) || !finite(s.velocity) || !(d > 1e-20 && d < 1e20))
      return false;
    if (!(s.area >= 0 && s.area <= 0.01) || !(s.flow >= 0 && s.flow <= kGreatestFlow) ||
        !(s.blood >= 0 && s.blood <= 1))
      return false;
  }
  for (int k = 0; k < in.suction_count; ++k) {
    const Suction& s = in.suctions[k];
    if (!finite(s.position) || !(s.flow >= 0 && s.flow <= 1e-3) || !(s.reach > 0 && s.reach <= 0.1))
      return false;
  }
  for (int k = 0; k < in.obstacle_count; ++k) {
    const Obstacle& o = in.obstacles[static_cast<std::size_t>(k)];
    if (!finite(o.a) || !finite(o.b) || !finite(o.velocity) || !(o.radius >= 0 && o.radius <= 0.1))
      return false;
  }
  for (std::size_t k = 0; k < in.surface_count; ++k) {
    const Surface& s = in.surfaces[k];
    if (s.knot_count > model.surfaces[k].knots || s.triangle_count > model.surfaces[k].triangles ||
        (s.triangle_count > 0 && (!s.positions || !s.triangles)))
      return false;
  }
  return !in.window.present || (finite(in.window.position) && finite(in.window.axis) &&
                                finite(in.window.right) && in.window.radius > 1e-5 && in.window.radius < 0.1);
}

std::size_t surfaceOf(const Model& model, const ScratchData& s, std::uint32_t triangle) {
  std::size_t k = 0;
  while (k + 1 < model.surfaces.size() && triangle >= s.triangle_offset[k + 1]) ++k;
  return k;
}

void tellImpacts(const Model& model, ScratchData& s, Report& report) {
  report.tissue_momentum = {0, 0, 0};
  std::sort(s.touched.begin(), s.touched.end());
  for (const std::uint32_t id : s.touched) {
    auto& j = s.momentum[id];
    auto& w = s.impact_weight[id];
    for (int a = 0; a < 3; ++a) report.tissue_momentum[a] += j[a];
    if (w[3] > 0) {
      Impact impact;
      const std::size_t k = surfaceOf(model, s, id);
      impact.surface = static_cast<std::uint16_t>(k);
      impact.triangle = id - s.triangle_offset[k];
      for (int a = 0; a < 3; ++a) impact.weights[a] = static_cast<float>(w[a] / w[3]);
      impact.momentum = j;
      impact.speed = w[4] / w[3];
      report.impacts.push_back(impact);
    }
    j = {0, 0, 0};
    w = {0, 0, 0, 0, 0};
    s.is_touched[id] = 0;
  }
  s.touched.clear();
  std::sort(s.sheared.begin(), s.sheared.end());
  for (const std::uint32_t id : s.sheared) {
    const std::size_t k = surfaceOf(model, s, id);
    report.shears.push_back(
        {static_cast<std::uint16_t>(k), id - s.triangle_offset[k], s.shear[id], s.stain[id]});
    s.shear[id] = s.stain[id] = 0;
  }
  s.sheared.clear();
}

void keepKnots(const Model& model, const Inputs& inputs, State& state) {
  for (std::size_t k = 0; k < inputs.surface_count; ++k) {
    const Surface& surface = inputs.surfaces[k];
    if (surface.positions && !(surface.still && state.has_knots))
      std::copy_n(surface.positions, 3 * surface.knot_count, state.knots.data() + 3 * model.first_knot[k]);
  }
  state.has_knots = true;
}

}  // namespace

Scratch::Scratch(const Model& model, int threads) : data_(new ScratchData) {
  ScratchData& s = *data_;
  s.threads = std::clamp(threads, 1, 64);
  s.kernels = &chooseKernels();
  const auto n = static_cast<std::size_t>(model.parameters.capacity);
  s.grid.shape(5, 5, 4, static_cast<double>(model.h));
  s.cell.assign(n, 0), s.order.assign(n, 0), s.shuffle.assign(n, 0), s.lambda.assign(n, 0);
  s.place.assign(n + 1, Quad{{1e9f, 1e9f, 1e9f, 0}});
  s.velocity.assign(n + 1, Quad{{0, 0, 0, 0}});
  s.slope.assign(n, Quad{});
  for (auto* a : {&s.px, &s.py, &s.pz, &s.inx, &s.iny, &s.inz}) a->assign(n, 0);
  for (auto* a : {&s.dx, &s.dy, &s.dz}) a->assign(n + kNeighbourPadding, 0);
  s.neighbours.assign(n * (kMostNeighbours + kNeighbourPadding) + kNeighbourPadding, 0);
  s.neighbour_count.assign(n, 0);
  s.planes.assign(n * kMostPlanes, Plane{});
  s.tissue_slope.assign(n * kMostPlanes, 0.0f);
  s.plane_count.assign(n, 0);
  std::size_t blocks = 0;
  for (const SurfaceSize& size : model.surfaces) {
    SurfaceBlocks b;
    b.positions.assign(3 * size.knots, 0.0f);
    b.corners.assign(size.triangles, {});
    b.boxes.assign(size.triangles / kTriangleBlock + 1, Extent{});
    blocks += (b.boxes.size() / 8 + 1) * 8;
    s.surfaces.push_back(std::move(b));
  }
  s.near.assign(model.surfaces.size(), NearSurface{});
  s.groups.assign(n, ParticleGroup{});
  for (int axis = 0; axis < 3; ++axis) s.low[axis].assign(blocks, 0.0f), s.high[axis].assign(blocks, 0.0f);
  s.slot.assign(blocks, 0);
  s.hits.assign(64 * n + 4096, 0);
  s.placed.assign(blocks * kTriangleBlock, PlacedTriangle{});
  for (auto* a : {&s.ball, &s.facing, &s.was}) a->assign(blocks * kTriangleBlock, Quad{});
  s.momentum.assign(model.triangles, {0, 0, 0});
  s.impact_weight.assign(model.triangles, {0, 0, 0, 0, 0});
  s.touched.reserve(model.triangles);
  s.is_touched.assign(model.triangles, 0);
  s.shear.assign(model.triangles, 0), s.stain.assign(model.triangles, 0);
  s.sheared.reserve(model.triangles);
  std::uint32_t first = 0;
  for (const SurfaceSize& size : model.surfaces) {
    s.triangle_offset.push_back(first);
    first += static_cast<std::uint32_t>(size.triangles);
  }
  const auto c = static_cast<std::size_t>(model.columns), r = static_cast<std::size_t>(model.rows);
  for (auto* a : {&s.face_u, &s.face_v, &s.share, &s.old_surface, &s.new_u, &s.new_v, &s.low_u, &s.high_u,
                  &s.low_v, &s.high_v})
    a->assign((c + 1) * (r + 1), 0);
  s.floor.assign(c * r, kNoBed);
  for (auto* a : {&s.floor_triangle, &s.around}) a->assign(c * r, -1);
  s.open.reserve(c * r), s.wave.reserve(2 * c * r);
  s.underside.assign(c * r, 0.0f), s.bearing.assign(c * r, 0.0f), s.sink.assign(2 * c * r, -1.0f);
  s.first_line.assign(c * r, -1);
  s.immersed.reserve(c * r), s.lines.reserve(32768);
  std::size_t most = 0;
  for (const SurfaceSize& size : model.surfaces) most = std::max(most, size.knots);
  s.knot_load.assign(most, {});
  s.is_loaded.assign(most, 0);
  s.loaded.reserve(most);
}
Scratch::~Scratch() {
  delete data_;
}
Scratch::Scratch(Scratch&& other) noexcept : data_(other.data_) {
  other.data_ = nullptr;
}
Scratch& Scratch::operator=(Scratch&& other) noexcept {
  std::swap(data_, other.data_);
  return *this;
}

void step(const Model& model, const Inputs& inputs, State& state, Scratch& scratch, Report& report) {
  ScratchData& s = scratch.data();
  report.impacts.clear();
  report.shears.clear();
  report.loads.clear();
  report.lens_count = 0;
  report.sucked = 0, report.taken.fill(0), report.taken_blood.fill(0);
  report.most_neighbours = 0;
  report.tissue_momentum = {0, 0, 0};
  report.status = good(model, inputs) ? Status::Ok : Status::BadInput;
  if (report.status != Status::Ok) return;
  if (report.impacts.capacity() < model.triangles) {  // first call only
    report.impacts.reserve(model.triangles);
    report.shears.reserve(model.triangles);
    report.loads.reserve(model.first_knot.back());
  }
  Particles& q = state.particles;
  const auto dt = static_cast<float>(inputs.dt);
  state.degraded = false;

  // Rigid ground is looked at again where it moved since, also between two looks.
  for (std::size_t k = 0; k < inputs.surface_count; ++k)
    s.has_floor &= !inputs.surfaces[k].rigid || inputs.surfaces[k].still;
  if (inputs.renew_bed) {
    renewBed(model, inputs, state, s);
    weighPools(model, inputs, state, s, report);
    if (inputs.stains) leaveFilms(model, inputs, state, s);
  }
  suck(model, inputs, state, s, report);
  compact(state);
  emit(model, inputs, state);

  // Predict, with half of gravity's kick before the way and half after all else: free flight is exact then.
  const float kick[3] = {static_cast<float>(0.5 * inputs.dt * inputs.gravity[0]),
                         static_cast<float>(0.5 * inputs.dt * inputs.gravity[1]),
                         static_cast<float>(0.5 * inputs.dt * inputs.gravity[2])};
  for (std::size_t i = 0; i < q.count; ++i) {
    s.px[i] = q.x[i], s.py[i] = q.y[i], s.pz[i] = q.z[i];
    q.vx[i] += kick[0], q.vy[i] += kick[1], q.vz[i] += kick[2];
    q.x[i] += dt * q.vx[i], q.y[i] += dt * q.vy[i], q.z[i] += dt * q.vz[i];
    q.age[i] += dt;
  }
  if (q.count > 0) {
    sortParticles(model, state, s);
    for (std::size_t i = 0; i < q.count; ++i) {
      s.place[i] = {{q.x[i], q.y[i], q.z[i], q.volume[i]}};
      s.inx[i] = q.vx[i], s.iny[i] = q.vy[i], s.inz[i] = q.vz[i];
    }
    findNeighbours(model, q.count, s);
    findPlanes(model, inputs, state, s);
    pushOut(model, state, s, dt);
    solveDensity(model, state, s, dt);

    const float inverse_dt = 1.0f / dt;
    for (std::size_t i = 0; i < q.count; ++i) {
      report.most_neighbours = std::max(report.most_neighbours, static_cast<int>(s.neighbour_count[i]));
      q.x[i] = s.place[i].a[0], q.y[i] = s.place[i].a[1], q.z[i] = s.place[i].a[2];
      q.vx[i] = (q.x[i] - s.px[i]) * inverse_dt, q.vy[i] = (q.y[i] - s.py[i]) * inverse_dt,
      q.vz[i] = (q.z[i] - s.pz[i]) * inverse_dt;
    }
    impact(model, inputs, state, s);
    turnAway(model, inputs, state, s);
    diffuse(model, state, s, dt);
  }
  for (std::size_t i = 0; i < q.count; ++i) q.vx[i] += kick[0], q.vy[i] += kick[1], q.vz[i] += kick[2];
  hitWindow(model, inputs, state, report);
  absorb(model, inputs, state, s);
  compact(state);
  immerse(model, inputs, state, s);
  stepPools(model, std::max(0.0, -inputs.gravity[2]), inputs.dt, state, scratch);
  dragPools(model, inputs, state, s);
  stepBubbles(model, inputs, state);
  tellImpacts(model, s, report);
  keepKnots(model, inputs, state);
  ++state.step;
  state.time += inputs.dt;
}

}  // namespace vest::fluid
