#include "vest_tissue/volume/feel.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <Eigen/LU>

namespace vest::volume {
namespace {

using Eigen::Vector3d;

constexpr double kSpeed = 0.020, kTick = 0.001;                     // m/s, s
constexpr double kSteepest = 0.04;                                  // of full force a tick
constexpr double kMoreSmoothing = 0.00025, kMostSmoothing = 0.004;  // m
constexpr double kBytes = sizeof(std::int16_t) + sizeof(std::uint8_t);

// How much the stiffness of each depth has to do with what a flat rigid punch of radius a feels: the share
// I(z/a) = 2/π·atan(z/a) − (z/a)/(π·(1 + (z/a)²)) lies above z (Gao, Chiu, Lee, Int. J. Solids Structures 29,
// 1992, for ν = 1/2). Differences of I at 0, ¼, ½, ¾, 1, 1½, 2, 3, 4, 6, 8, 12, ∞ radii; depths in radii.
constexpr double kDepth[voxel::kDepths] = {0.125, 0.375, 0.625, 0.875, 1.25, 1.75, 2.5, 3.5, 5, 7, 10, 16};
constexpr double kWeight[voxel::kDepths] = {0.081062, 0.086781, 0.089034, 0.083968, 0.137909, 0.098755,
                                            0.122165, 0.069471, 0.074100, 0.038411, 0.039071, 0.079273};

struct Grid {
  std::array<std::uint32_t, 3> size{};
  Vector3d origin;
  double spacing;
  std::size_t voxels() const { return std::size_t{size[0]} * size[1] * size[2]; }
  std::size_t step(int axis) const {
    return axis == 0 ? 1 : axis == 1 ? size[0] : std::size_t{size[0]} * size[1];
  }
};

// The block of world that holds the image.
Grid gridAround(const Brick& brick, double spacing, std::vector<std::string>& notes) {
  Vector3d low = Vector3d::Constant(1e300), high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    Vector3d g;
    for (int a = 0; a < 3; ++a) g[a] = (corner >> a & 1) != 0 ? brick.size[a] - 0.5 : -0.5;
    const Vector3d p = brick.origin + brick.axes * g;
    low = low.cwiseMin(p), high = high.cwiseMax(p);
  }
  Grid grid;
  const auto fill = [&](double h) {
    grid.spacing = h;
    for (int a = 0; a < 3; ++a)
      grid.size[a] = static_cast<std::uint32_t>(std::max(1.0, std::ceil((high[a] - low[a]) / h - 1e-6)));
    grid.origin = low + Vector3d::Constant(0.5 * h);
    return kBytes * static_cast<double>(grid.voxels()) <= static_cast<double>(kMostFeelBytes);
  };
  const double wanted = spacing;
  while (!fill(spacing)) spacing *= 1.02;
  if (spacing > wanted) {
    char text[160];
    std::snprintf(text, sizeof text,
                  "the hand feels voxels of %.2f mm instead of %.2f, so that they stay within 64 MB",
                  1e3 * spacing, 1e3 * wanted);
    notes.push_back(text);
  }
  return grid;
}

// A pass along each axis of amounts, with a Gaussian that ends at three standard deviations.
void smooth(const Grid& grid, double voxels, std::vector<float>& field) {
  const int reach = static_cast<int>(std::ceil(3.0 * voxels));
  if (reach < 1) return;
  std::vector<float> weight(static_cast<std::size_t>(2 * reach + 1));
  double sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    const double w = std::exp(-0.5 * i * i / (voxels * voxels));
    weight[static_cast<std::size_t>(i + reach)] = static_cast<float>(w);
    sum += w;
  }
  for (float& w : weight) w = static_cast<float>(w / sum);
  std::vector<float> line;
  for (int axis = 0; axis < 3; ++axis) {
    const int n = static_cast<int>(grid.size[axis]);
    const std::size_t step = grid.step(axis);
    line.resize(static_cast<std::size_t>(n + 2 * reach));
    const int b = (axis + 1) % 3, c = (axis + 2) % 3;
    for (std::uint32_t q = 0; q < grid.size[c]; ++q) {
      for (std::uint32_t p = 0; p < grid.size[b]; ++p) {
        float* const first = field.data() + p * grid.step(b) + q * grid.step(c);
        std::fill(line.begin(), line.end(), 0.0f);
        for (int i = 0; i < n; ++i)
          line[static_cast<std::size_t>(i + reach)] = first[static_cast<std::size_t>(i) * step];
        for (int i = 0; i < n; ++i) {
          float s = 0;
          for (int k = 0; k < 2 * reach + 1; ++k)
            s += weight[static_cast<std::size_t>(k)] * line[static_cast<std::size_t>(i + k)];
          first[static_cast<std::size_t>(i) * step] = s;
        }
      }
    }
  }
}

struct Raw {
  std::vector<float> amount, measured;  // stored numbers times measured; 1 or 0
};

Raw resampled(const Brick& brick, const Grid& grid) {
  Raw raw;
  raw.amount.assign(grid.voxels(), 0.0f);
  raw.measured.assign(grid.voxels(), 0.0f);
  const Eigen::Matrix3d inverse = brick.axes.inverse();
  std::size_t v = 0;
  for (std::uint32_t k = 0; k < grid.size[2]; ++k)
    for (std::uint32_t j = 0; j < grid.size[1]; ++j)
      for (std::uint32_t i = 0; i < grid.size[0]; ++i, ++v) {
        const Vector3d at = inverse * (grid.origin + grid.spacing * Vector3d(i, j, k) - brick.origin);
        bool there = true;
        for (int a = 0; a < 3; ++a) there = there && at[a] >= -0.5 && at[a] <= brick.size[a] - 0.5;
        float number = 0;
        if (!there || !interpolate(brick, at.cast<float>(), number)) continue;
        raw.amount[v] = number;
        raw.measured[v] = 1.0f;
      }
  return raw;
}

// A voxel counts where all its neighbours were measured, so that what is next to nothing has no force.
std::vector<std::uint8_t> within(const Grid& grid, const std::vector<float>& measured) {
  std::vector<std::uint8_t> field(measured.size());
  for (std::size_t v = 0; v < measured.size(); ++v) field[v] = measured[v] > 0.5f;
  std::vector<std::uint8_t> before;
  for (int axis = 0; axis < 3; ++axis) {
    before = field;
    const std::size_t step = grid.step(axis);
    std::size_t v = 0;
    for (std::uint32_t k = 0; k < grid.size[2]; ++k)
      for (std::uint32_t j = 0; j < grid.size[1]; ++j)
        for (std::uint32_t i = 0; i < grid.size[0]; ++i, ++v) {
          const std::uint32_t at = axis == 0 ? i : axis == 1 ? j : k;
          field[v] = before[v] && at > 0 && at + 1 < grid.size[axis] && before[v - step] && before[v + step];
        }
  }
  return field;
}

// The greatest slope of the yield that a hand can feel between two values, N per unit of the value.
double slopeOf(const voxel::Header& h, double low, double high, double full) {
  const auto* const end = h.table + h.rows;
  const auto* above =
      std::upper_bound(h.table, end, low, [](double v, const voxel::Feel& row) { return v < row.value; });
  if (above == h.table) ++above;
  double most = 0;
  for (; above < end && above[-1].value < high; ++above) {
    const voxel::Feel &a = above[-1], &b = *above;
    if (std::min(a.yield, b.yield) < full)
      most = std::max(most, std::abs(b.yield - a.yield) / (b.value - a.value));
  }
  return most;
}

double steepest(const voxel::Volume& f, const Grid& grid, double full) {
  double most = 0;
  std::size_t v = 0;
  for (std::uint32_t k = 0; k < grid.size[2]; ++k)
    for (std::uint32_t j = 0; j < grid.size[1]; ++j)
      for (std::uint32_t i = 0; i < grid.size[0]; ++i, ++v) {
        if (f.stored[v] == voxel::kNothing) continue;
        const auto at = voxel::sample(f.view(), grid.origin + grid.spacing * Vector3d(i, j, k));
        const double reach = grid.spacing * at.gradient.cwiseAbs().sum();  // values as far as the next voxel
        const double slope = slopeOf(f.header, at.value - reach, at.value + reach, full);
        most = std::max(most, slope * at.gradient.norm() * kSpeed * kTick / full);
      }
  return most;
}

}  // namespace

std::shared_ptr<const voxel::Volume> makeFeelable(const Brick& brick, const TransferTable& table,
                                                  const FeelOptions& o) {
  const bool felt = std::any_of(table.begin(), table.end(), [](const Transfer& row) {
    return std::any_of(row.feel.begin(), row.feel.end(), [](double f) { return f > 0; });
  });
  if (!felt)
    throw std::invalid_argument(
        "the table has nothing for the hand; it must have columns stiffness, yield, viscosity, friction");
  for (std::size_t f = 1; f < table.front().feel.size(); ++f)
    if (table.front().feel[f] > 0)
      throw std::invalid_argument(
          "the first row of the table resists; its yield, viscosity and friction must be 0, those of air");
  auto made = std::make_shared<voxel::Volume>();
  voxel::Header& h = made->header;
  const Grid grid = gridAround(brick, o.spacing, made->notes);
  made->spacing = grid.spacing;
  for (int a = 0; a < 3; ++a) {
    h.size[a] = grid.size[a];
    h.to_grid[a][a] = 1 / grid.spacing;
    h.to_grid[a][3] = -grid.origin[a] / grid.spacing;
  }
  h.rows = static_cast<std::uint32_t>(table.size());
  for (std::size_t r = 0; r < table.size(); ++r)
    h.table[r] = {table[r].value, table[r].feel[0], table[r].feel[1], table[r].feel[2], table[r].feel[3]};
  h.slope = brick.slope, h.intercept = brick.intercept;
  h.needle_stiffness = o.needle_stiffness;
  h.surface = o.surface;
  h.radius = kProbeRadius;
  for (int d = 0; d < voxel::kDepths; ++d) h.depth[d] = kDepth[d] * h.radius, h.weight[d] = kWeight[d];
  for (std::size_t c = 0; c < std::min<std::size_t>(o.capsules.size(), voxel::kMostRegions - 1); ++c)
    h.capsule[c + 1] = o.capsules[c];

  const Raw raw = resampled(brick, grid);
  const std::vector<std::uint8_t> inside = within(grid, raw.measured);
  made->stored.resize(grid.voxels());
  double wide = o.smoothing;
  for (;; wide += kMoreSmoothing) {
    std::vector<float> amount = raw.amount, measured = raw.measured;
    smooth(grid, wide / grid.spacing, amount);
    smooth(grid, wide / grid.spacing, measured);
    for (std::size_t v = 0; v < amount.size(); ++v)
      made->stored[v] = inside[v] != 0 ? static_cast<std::int16_t>(std::lround(
                                             std::clamp(amount[v] / measured[v], -32767.0f, 32767.0f)))
                                       : voxel::kNothing;
    made->steepest = steepest(*made, grid, o.full);
    if (made->steepest <= kSteepest || wide + kMoreSmoothing > kMostSmoothing + 1e-9) break;
  }
  made->smoothing = wide;
  char text[240];
  if (made->steepest > kSteepest) {
    std::snprintf(
        text, sizeof text,
        "the table is too steep: at 20 mm/s the yield changes by %.1f %% of %.2f N in a millisecond, "
        "even smoothed over %.2f mm; allowed are 4 %%",
        100 * made->steepest, o.full, 1e3 * wide);
    throw std::invalid_argument(text);
  }
  if (wide > o.smoothing) {
    std::snprintf(
        text, sizeof text,
        "the hand feels the image smoothed over %.2f mm instead of %.2f, so that at 20 mm/s no yield "
        "changes by more than 4 %% of %.2f N in a millisecond",
        1e3 * wide, 1e3 * o.smoothing, o.full);
    made->notes.push_back(text);
  }
  made->region.assign(grid.voxels(), 0);
  if (o.region) {
    std::size_t v = 0;
    for (std::uint32_t k = 0; k < grid.size[2]; ++k)
      for (std::uint32_t j = 0; j < grid.size[1]; ++j)
        for (std::uint32_t i = 0; i < grid.size[0]; ++i, ++v)
          if (made->stored[v] != voxel::kNothing)
            made->region[v] =
                std::min<std::uint8_t>(o.region(grid.origin + grid.spacing * Vector3d(i, j, k),
                                                brick.intercept + brick.slope * made->stored[v]),
                                       voxel::kMostRegions - 1);
  }
  return made;
}

}  // namespace vest::volume
