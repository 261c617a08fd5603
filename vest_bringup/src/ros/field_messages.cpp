#include "vest_bringup/ros/field_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vest_effects/fluid/drawn_pools.h"
#include "vest_instruments/ros/frames.h"

namespace vest::ros_shell {
namespace {

std::uint8_t scaled(float share) {
  return static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(share, 0.0f, 1.0f)));
}

/// Tenths of a millimetre; what is wet is never 0.
std::uint8_t tenths(float depth) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(1e4f * depth), 1L, 255L));
}

/// The rectangle that holds all films, and what lies there.
void tellFilm(const fluid::Model& model, const fluid::Pools& w, vest_msgs::FluidFilm& msg) {
  int c0 = model.columns, c1 = -1, r0 = model.rows, r1 = -1;
  float lowest = std::numeric_limits<float>::max();
  const auto cell = [&](int c, int r) {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(model.columns) +
           static_cast<std::size_t>(c);
  };
  // Also under a pool: what is thin of it lets the ground through.
  const auto bloody = [&](std::size_t i) {
    return w.ground[i] > fluid::kNoBed && (w.film[i] > 0 || w.blood[i] > fluid::kDryDepth);
  };
  for (int r = 0; r < model.rows; ++r)
    for (int c = 0; c < model.columns; ++c) {
      if (!bloody(cell(c, r))) continue;
      c0 = std::min(c0, c), c1 = std::max(c1, c), r0 = std::min(r0, r), r1 = std::max(r1, r);
      lowest = std::min(lowest, w.ground[cell(c, r)]);
    }
  msg.cell = model.parameters.pool_cell;
  msg.columns = static_cast<std::uint32_t>(std::max(0, c1 - c0 + 1));
  msg.rows = static_cast<std::uint32_t>(std::max(0, r1 - r0 + 1));
  msg.height.clear(), msg.thickness.clear(), msg.set.clear();
  msg.origin.orientation.w = 1.0;
  if (msg.columns == 0) return;
  msg.origin.position.x = model.parameters.low[0] + c0 * msg.cell;
  msg.origin.position.y = model.parameters.low[1] + r0 * msg.cell;
  msg.origin.position.z = static_cast<double>(lowest);
  for (int r = r0; r <= r1; ++r)
    for (int c = c0; c <= c1; ++c) {
      const std::size_t i = cell(c, r);
      const bool known = bloody(i);
      msg.height.push_back(known ? w.ground[i] - lowest : std::numeric_limits<float>::quiet_NaN());
      msg.thickness.push_back(known ? static_cast<std::uint8_t>(
                                          std::clamp(std::lround(1e6f * (w.film[i] + w.blood[i])), 0L, 255L))
                                    : std::uint8_t{0});
      msg.set.push_back(known ? scaled(effects::setShare(w.film_age[i])) : std::uint8_t{0});
    }
}

}  // namespace

void toMsg(const simulation::FieldFrame& frame, vest_msgs::FluidState& msg) {
  msg.header.frame_id = frameId("world");
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
  const fluid::Pools& w = frame.fluid.pools;
  const double cell = model.parameters.pool_cell;
  const fluid::DrawnPools drawn = fluid::drawnPools(model, frame.fluid);
  // No structured binding: a lambda of C++17 may not capture one (clang refuses it).
  const std::vector<float>& surface = drawn.surface;
  const std::vector<std::uint32_t>& labels = drawn.labels;
  const std::vector<fluid::PoolPatch>& patches = drawn.patches;
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
      const bool bridged = wet && surface[i] < w.bed[i];
      const bool raised = wet && surface[i] != w.top(i);
      pool.velocity[n] = wet && !raised ? w.rise[i] : 0.0f;
      pool.depth[n] = wet ? tenths(fluid::drawnDepth(model, w, drawn, i)) : 0;
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
  tellFilm(model, w, msg.film);
  msg.filmed = fluid::filmVolume(model, frame.fluid);
  msg.emitted = frame.fluid.emitted;
  msg.sucked = frame.fluid.sucked;
  msg.soaked = frame.fluid.soaked;
  msg.lost = frame.fluid.lost;
  msg.stained = frame.fluid.stained;
  msg.flying = fluid::particleVolume(*frame.fluid_model, frame.fluid) + fluid::pendingVolume(frame.fluid);
  msg.pooled = fluid::poolVolume(*frame.fluid_model, frame.fluid);
  msg.degraded = frame.degraded;
  for (std::size_t t = 0; t < frame.swabs.size(); ++t) {
    msg.clogged[t] = static_cast<float>(frame.clogged[t]);
    msg.swab_volume[t] = static_cast<float>(frame.swabs[t].volume);
    msg.swab_blood[t] = static_cast<float>(frame.swabs[t].blood);
  }
  msg.swab_capacity = static_cast<float>(bleeding::kSwabCapacity);
}

void toMsg(const simulation::FieldFrame& frame, vest_msgs::SmokeState& msg) {
  msg.header.frame_id = frameId("world");
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
  msg.header.frame_id = frameId("endoscope_optical_frame");
  msg.step = frame.step;
  msg.temperature = static_cast<float>(frame.lens.temperature);
  msg.humidity = static_cast<float>(frame.humidity);
  msg.condensate = static_cast<float>(frame.lens.condensate);
  msg.fog = static_cast<float>(frame.fog);
  msg.columns = lens::kColumns;
  msg.rows = lens::kRows;
  msg.soiling.resize(frame.lens.soiling.size());
  msg.fogging.resize(frame.lens.water.size());
  for (std::size_t i = 0; i < msg.fogging.size(); ++i) msg.fogging[i] = scaled(frame.fogging[i]);
  msg.soiling_blood.resize(frame.lens.blood.size());
  for (std::size_t i = 0; i < frame.lens.soiling.size(); ++i) {
    msg.soiling[i] = scaled(frame.lens.soiling[i]);
    msg.soiling_blood[i] = scaled(frame.lens.blood[i]);
  }
  // A drop that runs: opaque as far as it is thick.
  for (const lens::Run& run : frame.lens.runs) {
    const int c = static_cast<int>(std::lround(0.5f * (run.u + 1) * lens::kColumns - 0.5f)),
              r = static_cast<int>(std::lround(0.5f * (run.v + 1) * lens::kRows - 0.5f));
    for (int dr = -1; dr <= 1 && run.mass > 0; ++dr)
      for (int dc = -1; dc <= 1; ++dc) {
        if (c + dc < 0 || r + dr < 0 || c + dc >= lens::kColumns || r + dr >= lens::kRows) continue;
        const auto i = static_cast<std::size_t>((r + dr) * lens::kColumns + c + dc);
        const float thick = (dr == 0 && dc == 0 ? 0.55f : 0.25f) * (1 + 0.5f * run.blood);
        msg.soiling[i] = std::max(msg.soiling[i], scaled(thick));
        msg.soiling_blood[i] = std::max(msg.soiling_blood[i], scaled(run.blood));
      }
  }
}

void toMsg(const simulation::FieldFrame& frame, vest_msgs::Impacts& msg) {
  msg.header.frame_id = frameId("world");
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
