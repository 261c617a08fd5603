#include "label_field.h"

#include <algorithm>
#include <cmath>

namespace vest::volume {
namespace {

/// Cubic B-spline: standard deviation 1 / √3 voxels. A wider one pulls curved surfaces in, by σ² / radius.
double kernel(double voxels) {
  const double x = std::abs(voxels);
  if (x >= 2) return 0;
  return x < 1 ? 2.0 / 3 - x * x + x * x * x / 2 : (2 - x) * (2 - x) * (2 - x) / 6;
}

}  // namespace

double LabelField::Shares::of(std::uint16_t wanted) const {
  for (int i = 0; i < count; ++i)
    if (label[i] == wanted) return share[i];
  return 0;
}

double LabelField::Shares::any() const {
  double sum = 0;
  for (int i = 0; i < count; ++i) sum += label[i] != 0 ? share[i] : 0;
  return sum;
}

std::uint16_t LabelField::Shares::most() const {
  int best = -1;
  for (int i = 0; i < count; ++i) {
    if (label[i] == 0) continue;
    if (best < 0 || share[i] > share[best] || (share[i] == share[best] && label[i] < label[best])) best = i;
  }
  return best < 0 ? 0 : label[best];
}

void LabelField::Shares::add(std::uint16_t of, double amount) {
  int i = 0;
  while (i < count && label[i] != of) ++i;
  if (i == kMost) return;
  if (i == count) label[i] = of, share[i] = 0, ++count;
  share[i] += amount;
}

LabelField::Shares LabelField::at(const Eigen::Vector3d& place) const {
  Shares shares;
  long first[3];
  double weight[3][4];
  for (int a = 0; a < 3; ++a) {
    const double grid = place[a] / image_.spacing[a];
    first[a] = static_cast<long>(std::floor(grid)) - 1;
    for (int i = 0; i < 4; ++i) weight[a][i] = kernel(static_cast<double>(first[a] + i) - grid);
  }
  const auto inside = [&](int a, long i) { return i >= 0 && i < static_cast<long>(image_.size[a]); };
  for (int k = 0; k < 4; ++k) {
    for (int j = 0; j < 4; ++j) {
      const double rows = weight[1][j] * weight[2][k];
      const bool there = inside(1, first[1] + j) && inside(2, first[2] + k);
      std::uint16_t run = 0;  // neighbours mostly share their label
      double sum = 0;
      for (int i = 0; i < 4; ++i) {
        const std::uint16_t label = there && inside(0, first[0] + i)
                                        ? image_.at(static_cast<std::uint32_t>(first[0] + i),
                                                    static_cast<std::uint32_t>(first[1] + j),
                                                    static_cast<std::uint32_t>(first[2] + k))
                                        : std::uint16_t{0};
        if (label != run && sum > 0) shares.add(run, sum), sum = 0;
        run = label;
        sum += rows * weight[0][i];
      }
      if (sum > 0) shares.add(run, sum);
    }
  }
  return shares;
}

}  // namespace vest::volume
