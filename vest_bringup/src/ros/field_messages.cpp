#include "vest_bringup/ros/field_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace vest::ros_shell {
namespace {

constexpr double kLeastPool = 1e-7, kFilm = 3e-4;  ///< m³, m: less is a wet surface, not a pool (tuned)
constexpr std::size_t kMostPools = 16;

/// Under an organ that spans a pool water stands too, though the height field knows only the organ's top
/// there: the pool's surface goes on from shore to shore. Where tissue stands on the floor instead it hides
/// what is drawn within it. A cell that such an organ has just laid bare is a well there, into which the pool
/// falls within the next tenth of a second: its surface goes on, too.
/// @param surface m, world, per cell; NaN where it is dry  @param labels, patches grow with the surface
void bridge(const fluid::Model& model, const fluid::Pools& pools, std::vector<float>& surface,
            std::vector<std::uint32_t>& labels, std::vector<fluid::PoolPatch>& patches) {
  constexpr int kSpan = 4;         ///< cells to either shore: 28 mm of organ with cells of 4 mm (tuned)
  constexpr float kStep = 0.002f;  ///< m between the levels of two pools that are one below (tuned)
  constexpr int kWays[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
  int c0 = model.columns, c1 = -1, r0 = model.rows, r1 = -1;
  for (const fluid::PoolPatch& p : patches) {
    c0 = std::min(c0, p.column), c1 = std::max(c1, p.column + p.columns - 1);
    r0 = std::min(r0, p.row), r1 = std::max(r1, p.row + p.rows - 1);
  }
  std::vector<float> known;
  // Which pools are one below, by their labels.
  std::uint32_t most = 0;
  for (const fluid::PoolPatch& p : patches) most = std::max(most, p.label);
  std::vector<std::uint32_t> same(most + 1);
  std::iota(same.begin(), same.end(), 0u);
  std::vector<std::uint8_t> drawn(most + 1);
  for (const fluid::PoolPatch& p : patches) drawn[p.label] = 1;
  const auto first = [&](std::uint32_t label) {
    while (same[label] != label) label = same[label];
    return label;
  };
  const auto cell = [&](int c, int r) {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
           static_cast<std::size_t>(c);
  };
  const auto inside = [&](int c, int r) { return c >= c0 && r >= r0 && c <= c1 && r <= r1; };
  const auto wet = [&](int c, int r) { return inside(c, r) && !std::isnan(known[cell(c, r)]); };
  const auto beside = [&](int c, int r, float level) {  // tissue that rises above the water
    for (int dr = -1; dr <= 1; ++dr)
      for (int dc = -1; dc <= 1; ++dc)
        if (inside(c + dc, r + dr) && pools.bed[cell(c + dc, r + dr)] > level) return true;
    return false;
  };
  // Wells lie beside each other: those in the middle have their shores when the outer ones are drawn full.
  for (const bool wells : {false, true, true}) {
    known = surface;
    for (int r = r0; r <= r1; ++r) {
      for (int c = c0; c <= c1; ++c) {
        const std::size_t i = cell(c, r);
        if ((!wells && !std::isnan(known[i])) || pools.bed[i] <= fluid::kNoBed) continue;
        int span = 2 * kSpan + 1;
        for (const auto& way : kWays) {
          int a = 1, b = 1;
          while (a <= kSpan && !wet(c + a * way[0], r + a * way[1])) ++a;
          while (b <= kSpan && !wet(c - b * way[0], r - b * way[1])) ++b;
          if (a > kSpan || b > kSpan || a + b >= span) continue;
          const std::size_t p = cell(c + a * way[0], r + a * way[1]),
                            q = cell(c - b * way[0], r - b * way[1]);
          const float level = 0.5f * (known[p] + known[q]);
          if (std::fabs(known[p] - known[q]) > kStep) continue;
          const bool well = pools.bed[i] < level - kStep && !(known[i] >= level - kStep);
          if (wells ? !well || !beside(c, r, level) : level > pools.bed[i]) continue;
          surface[i] = level, labels[i] = labels[p], span = a + b;
          if (labels[p] > most || labels[q] > most || !drawn[labels[p]] || !drawn[labels[q]]) continue;
          const std::uint32_t one = first(labels[p]), other = first(labels[q]);
          same[std::max(one, other)] = std::min(one, other);
        }
      }
    }
  }
  // Drawn as one, or their shores would show where they meet.
  for (std::uint32_t& label : labels)
    if (label <= most) label = first(label);
  for (std::size_t k = 0; k < patches.size(); ++k) {
    fluid::PoolPatch& p = patches[k];
    if (first(p.label) == p.label) continue;
    const auto to = std::find_if(patches.begin(), patches.end(),
                                 [&](const fluid::PoolPatch& o) { return o.label == first(p.label); });
    if (to == patches.end()) continue;
    const int columns = std::max(to->column + to->columns, p.column + p.columns),
              rows = std::max(to->row + to->rows, p.row + p.rows);
    to->column = std::min(to->column, p.column), to->row = std::min(to->row, p.row);
    to->columns = columns - to->column, to->rows = rows - to->row;
    to->volume += p.volume, to->blood += p.blood;
    p.volume = 0;
  }
  patches.erase(std::remove_if(patches.begin(), patches.end(),
                               [](const fluid::PoolPatch& p) { return !(p.volume > 0); }),
                patches.end());
  for (fluid::PoolPatch& p : patches) {
    int low_c = p.column, high_c = p.column + p.columns - 1, low_r = p.row, high_r = p.row + p.rows - 1;
    for (int r = std::max(r0, low_r - kSpan); r <= std::min(r1, p.row + p.rows - 1 + kSpan); ++r) {
      for (int c = std::max(c0, p.column - kSpan); c <= std::min(c1, p.column + p.columns - 1 + kSpan); ++c) {
        if (labels[cell(c, r)] != p.label) continue;
        low_c = std::min(low_c, c), high_c = std::max(high_c, c);
        low_r = std::min(low_r, r), high_r = std::max(high_r, r);
      }
    }
    p.column = low_c, p.columns = high_c - low_c + 1, p.row = low_r, p.rows = high_r - low_r + 1;
  }
}

/// A film on an organ that stands in a pool is none of its surface: thin water more than a cell above what is
/// beside it. Drawn with the pool it would be a cliff.
void leaveFilmsOut(const fluid::Model& model, const fluid::Pools& pools, std::vector<float>& surface,
                   std::vector<std::uint32_t>& labels) {
  constexpr float kThin = 0.004f;  ///< m (tuned)
  const std::vector<float> known = surface;
  const auto steep = static_cast<float>(model.parameters.pool_cell);
  const auto columns = static_cast<std::size_t>(model.columns), rows = static_cast<std::size_t>(model.rows);
  for (std::size_t i = 0; i < labels.size(); ++i) {
    if (labels[i] == 0 || pools.depth[i] > kThin) continue;
    const std::size_t c = i % columns, r = i / columns;
    const auto below = [&](bool inside, std::size_t j) {
      return inside && !std::isnan(known[j]) && known[j] < known[i] - steep;
    };
    if (below(c > 0, i - 1) || below(c + 1 < columns, i + 1) || below(r > 0, i - columns) ||
        below(r + 1 < rows, i + columns))
      surface[i] = std::numeric_limits<float>::quiet_NaN(), labels[i] = 0;
  }
}

std::uint8_t scaled(float share) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(share, 0.0f, 1.0f)));
}

/// Tenths of a millimetre; what is wet is never 0.
std::uint8_t tenths(float depth) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(1e4f * depth), 1L, 255L));
}

}  // namespace

void toMsg(const simulation::FieldFrame& frame, vest_msgs::FluidState& msg) {
  msg.header.frame_id = "world";
  msg.step = frame.step;
  const fluid::Model& model = *frame.fluid_model;
  const fluid::Particles& p = frame.fluid.particles;
  msg.particle_radius = static_cast<float>(0.5 * model.parameters.spacing);
  msg.positions.resize(3 * p.count);
  msg.velocities.resize(3 * p.count);
  msg.blood_fraction.resize(p.count);
  msg.volume.resize(p.count);
  for (std::size_t i = 0; i < p.count; ++i) {
    msg.positions[3 * i] = p.x[i], msg.positions[3 * i + 1] = p.y[i], msg.positions[3 * i + 2] = p.z[i];
    msg.velocities[3 * i] = p.vx[i], msg.velocities[3 * i + 1] = p.vy[i], msg.velocities[3 * i + 2] = p.vz[i];
    msg.blood_fraction[i] = scaled(p.blood[i]);
    msg.volume[i] = scaled(p.volume[i]);
  }
  std::vector<std::uint32_t> labels;
  std::vector<fluid::PoolPatch> patches;
  fluid::findPools(model, frame.fluid, kLeastPool, kFilm, kMostPools, labels, patches);
  const fluid::Pools& w = frame.fluid.pools;
  const double cell = model.parameters.pool_cell;
  std::vector<float> surface(labels.size(), std::numeric_limits<float>::quiet_NaN());
  for (std::size_t i = 0; i < labels.size(); ++i)
    if (labels[i] != 0) surface[i] = w.bed[i] + w.depth[i];
  leaveFilmsOut(model, w, surface, labels);
  bridge(model, w, surface, labels, patches);
  msg.pools.resize(patches.size());
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const fluid::PoolPatch& patch = patches[k];
    vest_msgs::FluidPool& pool = msg.pools[k];
    // The same pool keeps its number while it keeps its first cell.
    pool.id = static_cast<std::uint32_t>(patch.row * model.columns + patch.column);
    pool.cell = cell;
    pool.columns = static_cast<std::uint32_t>(patch.columns);
    pool.rows = static_cast<std::uint32_t>(patch.rows);
    pool.volume = patch.volume;
    pool.blood_fraction = patch.volume > 0 ? static_cast<float>(patch.blood / patch.volume) : 0.0f;
    float lowest = std::numeric_limits<float>::max();
    const auto each = [&](auto&& f) {
      std::size_t n = 0;
      for (int r = patch.row; r < patch.row + patch.rows; ++r)
        for (int c = patch.column; c < patch.column + patch.columns; ++c)
          f(n++, static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
                     static_cast<std::size_t>(c));
    };
    each([&](std::size_t, std::size_t i) {
      if (labels[i] == patch.label) lowest = std::min(lowest, surface[i]);
    });
    pool.height.resize(pool.columns * pool.rows);
    pool.velocity.resize(pool.height.size());
    pool.depth.resize(pool.height.size());
    pool.blood.resize(pool.height.size());
    each([&](std::size_t n, std::size_t i) {
      const bool wet = labels[i] == patch.label;
      pool.height[n] = wet ? surface[i] - lowest : std::numeric_limits<float>::quiet_NaN();
      // Under an organ nobody knows how deep it is: as deep as can be told.
      const bool bridged = wet && surface[i] < w.bed[i];
      const bool raised = wet && surface[i] != w.bed[i] + w.depth[i];
      pool.velocity[n] = wet && !raised ? w.rise[i] : 0.0f;
      pool.depth[n] = !wet ? 0 : bridged ? 255 : tenths(raised ? surface[i] - w.bed[i] : w.depth[i]);
      pool.blood[n] =
          wet && !bridged && w.depth[i] > 0 ? scaled(w.blood[i] / w.depth[i]) : scaled(pool.blood_fraction);
    });
    pool.origin.position.x = model.parameters.low[0] + patch.column * cell;
    pool.origin.position.y = model.parameters.low[1] + patch.row * cell;
    pool.origin.position.z = static_cast<double>(lowest);
    pool.origin.orientation.w = 1.0;
    pool.bubbles.clear();
    const fluid::Bubbles& b = frame.fluid.bubbles;
    for (std::size_t j = 0; j < b.count; ++j) {
      const int c = static_cast<int>(
                    std::floor((static_cast<double>(b.x[j]) - model.parameters.low[0]) / cell)),
                r = static_cast<int>(
                    std::floor((static_cast<double>(b.y[j]) - model.parameters.low[1]) / cell));
      if (c < 0 || r < 0 || c >= model.columns || r >= model.rows) continue;
      if (labels[static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
                 static_cast<std::size_t>(c)] != patch.label)
        continue;
      pool.bubbles.insert(pool.bubbles.end(), {b.x[j], b.y[j], b.z[j], b.radius[j]});
    }
  }
  msg.emitted = frame.fluid.emitted;
  msg.sucked = frame.fluid.sucked;
  msg.lost = frame.fluid.lost;
  msg.stained = frame.fluid.stained;
  msg.flying = fluid::particleVolume(*frame.fluid_model, frame.fluid) + fluid::pendingVolume(frame.fluid);
  msg.pooled = fluid::poolVolume(*frame.fluid_model, frame.fluid);
  msg.degraded = frame.degraded;
}

void toMsg(const simulation::FieldFrame& frame, vest_msgs::SmokeState& msg) {
  msg.header.frame_id = "world";
  msg.step = frame.step;
  const smoke::Model& model = *frame.smoke_model;
  msg.origin.x = model.parameters.low[0], msg.origin.y = model.parameters.low[1],
  msg.origin.z = model.parameters.low[2];
  msg.cell = model.parameters.cell;
  msg.size = {static_cast<std::uint32_t>(model.nx), static_cast<std::uint32_t>(model.ny),
              static_cast<std::uint32_t>(model.nz)};
  float most = 0;
  for (const float d : frame.smoke) most = std::max(most, d);
  msg.density_scale = most;
  msg.mass = frame.smoke_mass;
  if (most > 0) {
    msg.density.resize(frame.smoke.size());
    for (std::size_t i = 0; i < frame.smoke.size(); ++i) msg.density[i] = scaled(frame.smoke[i] / most);
  } else {
    msg.density.clear();  // a clear cavity
  }
  msg.puffs.resize(frame.puff_count);
  for (std::uint32_t k = 0; k < frame.puff_count; ++k) {
    const smoke::Puff& from = frame.puffs[k];
    const smoke::PuffLook look = smoke::lookOf(from);
    vest_msgs::SmokePuff& to = msg.puffs[k];
    to.position.x = static_cast<double>(from.position[0]);
    to.position.y = static_cast<double>(from.position[1]);
    to.position.z = static_cast<double>(from.position[2]);
    to.radius = look.radius, to.density = look.density, to.age = from.age, to.phase = look.phase,
    to.seed = from.seed;
  }
}

void toMsg(const simulation::FieldFrame& frame, vest_msgs::LensState& msg) {
  msg.header.frame_id = "endoscope_optical_frame";
  msg.step = frame.step;
  msg.temperature = static_cast<float>(frame.lens.temperature);
  msg.humidity = static_cast<float>(frame.humidity);
  msg.condensate = static_cast<float>(frame.lens.condensate);
  msg.fog = static_cast<float>(frame.fog);
  msg.columns = lens::kColumns;
  msg.rows = lens::kRows;
  msg.soiling.resize(frame.lens.soiling.size());
  msg.soiling_blood.resize(frame.lens.blood.size());
  for (std::size_t i = 0; i < frame.lens.soiling.size(); ++i) {
    msg.soiling[i] = scaled(frame.lens.soiling[i]);
    msg.soiling_blood[i] = scaled(frame.lens.blood[i]);
  }
}

void toMsg(const simulation::FieldFrame& frame, vest_msgs::Impacts& msg) {
  msg.header.frame_id = "world";
  msg.step = frame.step + 1;
  msg.impacts.resize(frame.impacts.size());
  for (std::size_t i = 0; i < frame.impacts.size(); ++i) {
    const scene::ImpactInput& from = frame.impacts[i];
    vest_msgs::Impact& to = msg.impacts[i];
    to.object = from.object < frame.objects->size() ? (*frame.objects)[from.object] : std::string();
    to.element = from.triangle;
    for (std::size_t a = 0; a < 3; ++a) to.barycentric[a] = from.weights[a];
    to.momentum.x = from.momentum.x(), to.momentum.y = from.momentum.y(), to.momentum.z = from.momentum.z();
  }
}

}  // namespace vest::ros_shell
