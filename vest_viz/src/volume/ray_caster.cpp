#include "vest_viz/volume/ray_caster.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace vest::volume {
namespace {

constexpr int kBlock = 8;       // voxels along an edge of a block
constexpr int kEntries = 4096;  // of the table, evenly spread over its values

float clamped(float x, std::uint32_t size) {
  return std::min(std::max(x, 0.0f), static_cast<float>(size - 1));
}

}  // namespace

/// What a picture needs of table and view.
struct RayCaster::Step {
  const View& view;
  const Look& look;
  std::vector<Eigen::Vector4f> colours;  ///< multiplied by alpha, alpha: of one step
};

RayCaster::RayCaster(std::shared_ptr<const Brick> brick) : brick_(std::move(brick)) {
  to_grid_ = brick_->axes.inverse().cast<float>();
  const auto& size = brick_->size;
  for (int a = 0; a < 3; ++a) blocks_[a] = (size[a] + kBlock - 1) / kBlock;
  const std::size_t count = std::size_t{blocks_[0]} * blocks_[1] * blocks_[2];
  low_.assign(count, std::numeric_limits<std::int16_t>::max());
  high_.assign(count, Brick::kNothing);
  // A sample takes values of its cell's two ends: each voxel belongs to the block below it, too.
  std::size_t voxel = 0;
  for (std::uint32_t k = 0; k < size[2]; ++k)
    for (std::uint32_t j = 0; j < size[1]; ++j)
      for (std::uint32_t i = 0; i < size[0]; ++i, ++voxel) {
        const std::int16_t number = brick_->stored[voxel];
        if (number == Brick::kNothing) continue;
        for (std::uint32_t c = (k - (k > 0)) / kBlock; c <= k / kBlock; ++c)
          for (std::uint32_t b = (j - (j > 0)) / kBlock; b <= j / kBlock; ++b)
            for (std::uint32_t a = (i - (i > 0)) / kBlock; a <= i / kBlock; ++a) {
              const std::size_t block = (std::size_t{c} * blocks_[1] + b) * blocks_[0] + a;
              low_[block] = std::min(low_[block], number);
              high_[block] = std::max(high_[block], number);
            }
      }
  clear_.assign(count, 1);
}

void RayCaster::setTable(const TransferTable& table) {
  const auto number = [&](double value) {
    return static_cast<float>((value - brick_->intercept) / brick_->slope);
  };
  first_ = number(table.front().value);
  scale_ = (kEntries - 1) / (number(table.back().value) - first_);
  colours_.resize(kEntries);
  seen_.assign(kEntries + 1, 0);
  for (int e = 0; e < kEntries; ++e) {
    const double t = static_cast<double>(e) / (kEntries - 1);
    const Transfer row =
        transfer(table, table.front().value + t * (table.back().value - table.front().value));
    colours_[e] = {static_cast<float>(row.colour[0]), static_cast<float>(row.colour[1]),
                   static_cast<float>(row.colour[2]), static_cast<float>(-1e3 * std::log1p(-row.alpha))};
    seen_[e + 1] = seen_[e] + (row.alpha > 0 ? 1 : 0);
  }
  for (std::size_t b = 0; b < clear_.size(); ++b) clear_[b] = clear(low_[b], high_[b]) ? 1 : 0;
}

bool RayCaster::clear(std::int16_t low, std::int16_t high) const {
  if (low > high) return true;  // nothing was measured here
  const auto at = [&](std::int16_t number, int aside) {
    return static_cast<std::size_t>(std::min(std::max(entry(number) + static_cast<float>(aside), 0.0f),
                                             static_cast<float>(kEntries - 1)));
  };
  return seen_[at(high, 1) + 1] == seen_[at(low, -1)];
}

float RayCaster::shade(const Eigen::Vector3f& at, const Eigen::Vector3f& towards) const {
  Eigen::Vector3f change;  // per voxel
  for (int a = 0; a < 3; ++a) {
    float ends[2] = {0, 0};
    for (int side = 0; side < 2; ++side) {
      Eigen::Vector3f p = at;
      p[a] += side == 0 ? -1.0f : 1.0f;
      if (!interpolate(*brick_, p, ends[side])) return 1;
    }
    change[a] = 0.5f * (ends[1] - ends[0]);
  }
  const Eigen::Vector3f gradient = to_grid_.transpose() * change;  // per m
  const float steep = gradient.norm();
  if (!(steep > 0)) return 1;
  const float lit = kAmbient + (1 - kAmbient) * std::abs(gradient.dot(towards)) / steep;
  const float edge = std::min(1.0f, 1e-3f * steep * std::abs(scale_) / (kEdge * kEntries));
  return 1 + edge * (lit - 1);
}

Eigen::Vector4f RayCaster::ray(const Step& step, double x, double y, float depth) const {
  const auto place = [&](double z) {
    const Eigen::Vector4d p = step.view.from_clip * Eigen::Vector4d(x, y, z, 1);
    return Eigen::Vector3d(p.head<3>() / p[3]);
  };
  const Eigen::Vector3d eye = place(-1);
  const Eigen::Vector3d along = (place(0) - eye).normalized();
  double from = 0, end = depth < 1 ? std::max(0.0, along.dot(place(depth) - eye)) : 1e6;
  const auto keepBelow = [&](double value, double slope, double bound) {  // value + t·slope ≤ bound
    if (slope > 0)
      end = std::min(end, (bound - value) / slope);
    else if (slope < 0)
      from = std::max(from, (bound - value) / slope);
    else if (value > bound)
      end = -1;
  };
  for (const inspect::Plane& cut : step.look.cuts) {
    const Eigen::Vector3d normal = cut.normal.cast<double>();
    keepBelow(normal.dot(eye), normal.dot(along), cut.offset);
  }
  const Eigen::Matrix3d inverse = brick_->axes.inverse();
  const Eigen::Vector3d start = inverse * (eye - brick_->origin), turn = inverse * along;
  for (int a = 0; a < 3; ++a) {
    keepBelow(start[a], turn[a], brick_->size[a] - 0.5);
    keepBelow(-start[a], -turn[a], 0.5);
  }
  Eigen::Vector4f sum = Eigen::Vector4f::Zero();
  if (!(from < end)) return sum;
  const Eigen::Vector3f base = (start + from * turn).cast<float>(), direction = turn.cast<float>();
  const Eigen::Vector3f towards = along.cast<float>();
  const auto length = static_cast<float>(step.look.step);
  const double steps = (end - from) / step.look.step;
  const long whole = static_cast<long>(steps), count = whole + (steps > static_cast<double>(whole) ? 1 : 0);
  for (long k = 0; k < count; ++k) {
    const float part = k < whole ? 1.0f : static_cast<float>(steps - static_cast<double>(whole));
    const float t = (static_cast<float>(k) + 0.5f * part) * length;
    const Eigen::Vector3f at = base + t * direction;
    std::uint32_t block[3];
    for (int a = 0; a < 3; ++a)
      block[a] = static_cast<std::uint32_t>(clamped(at[a], brick_->size[a])) / kBlock;
    if (clear_[(std::size_t{block[2]} * blocks_[1] + block[1]) * blocks_[0] + block[0]] != 0) {
      float leaves = std::numeric_limits<float>::max();
      for (int a = 0; a < 3; ++a) {
        const bool up = direction[a] > 0;
        if (direction[a] == 0 || (up ? block[a] + 1 == blocks_[a] : block[a] == 0)) continue;
        const auto border = static_cast<float>((block[a] + (up ? 1 : 0)) * kBlock);
        leaves = std::min(leaves, (border - base[a]) / direction[a]);
      }
      const float next = std::ceil(leaves / length - 0.5f) - 1;
      if (next >= static_cast<float>(count)) break;
      k = std::max(k, static_cast<long>(next));
      continue;
    }
    float number = 0;
    if (!interpolate(*brick_, at, number)) continue;
    const float e = std::min(std::max(entry(number) + 0.5f, 0.0f), static_cast<float>(kEntries - 1));
    Eigen::Vector4f colour = step.colours[static_cast<std::size_t>(e)];
    if (!(colour[3] > 0)) continue;
    if (part < 1) {
      const float alpha = 1 - std::pow(1 - colour[3], part);
      colour *= alpha / colour[3];
    }
    const float light = 1 - sum[3];
    if (step.look.shaded && light * colour[3] > kLeastLight) colour.head<3>() *= shade(at, towards);
    sum += light * colour;
    if (1 - sum[3] < kLeastLight) break;
  }
  return sum;
}

void RayCaster::row(const Step& step, int y, std::uint8_t* rgba) const {
  const View& view = step.view;
  for (int x = 0; x < view.width; ++x, rgba += 4) {
    const float depth =
        view.depth == nullptr ? 1.0f : view.depth[static_cast<std::ptrdiff_t>(y) * view.width + x];
    const Eigen::Vector4f sum =
        ray(step, 2 * (x + 0.5) / view.width - 1, 1 - 2 * (y + 0.5) / view.height, depth);
    for (int c = 0; c < 4; ++c)
      rgba[c] = static_cast<std::uint8_t>(255 * std::min(std::max(sum[c], 0.0f), 1.0f) + 0.5f);
  }
}

RayCaster::Table RayCaster::tableOf(double step) const {
  Table table{colours_, first_, scale_};
  for (Eigen::Vector4f& colour : table.colours) {
    const float alpha = 1 - std::exp(-colour[3] * static_cast<float>(step));
    colour = {alpha * colour[0], alpha * colour[1], alpha * colour[2], alpha};
  }
  return table;
}

bool RayCaster::cast(const View& view, const Look& look, solver::Pool& pool, std::vector<std::uint8_t>* rgba,
                     const std::atomic<bool>* stop) const {
  rgba->assign(4 * static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height), 0);
  if (colours_.empty()) return true;
  const Step step{view, look, tableOf(look.step).colours};
  std::atomic<bool> stopped{false};
  auto draw = [&](std::size_t y) {
    if (stop != nullptr && stop->load(std::memory_order_relaxed)) stopped = true;
    if (stopped) return;
    row(step, static_cast<int>(y), rgba->data() + 4 * y * static_cast<std::size_t>(view.width));
  };
  pool.each(static_cast<std::size_t>(view.height), draw);
  return !stopped;
}

}  // namespace vest::volume
