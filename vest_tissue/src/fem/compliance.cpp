#include "vest_tissue/fem/compliance.h"

#include <algorithm>
#include <cstring>

namespace vest::fem {
namespace {

constexpr std::size_t kWide = Compliance::kTile;

/// Three numbers side by side; the fourth is of no meaning.
typedef float Four __attribute__((vector_size(16)));

Four load(const float* from) {
  Four four;
  std::memcpy(&four, from, sizeof four);
  return four;
}

/// sum += the blocks of a column, times a force.
void addColumn(const float* block, const Eigen::Vector3f& f, Four* sum) {
  const Four f0 = {f[0], f[0], f[0], f[0]}, f1 = {f[1], f[1], f[1], f[1]}, f2 = {f[2], f[2], f[2], f[2]};
  for (std::size_t r = 0; r < kWide; ++r, block += 9)
    sum[r] += load(block) * f0 + load(block + 3) * f1 + load(block + 6) * f2;
}

/// The same with the blocks of rows, transposed: all loads in them at once.
void addRows(const float* tile, const Compliance::Load* first, const Compliance::Load* last, Four* sum) {
  for (std::size_t c = 0; c < kWide; ++c, tile += 9 * kWide) {
    Four along[3] = {};
    for (const Compliance::Load* l = first; l != last; ++l) {
      const Four f = {l->force[0], l->force[1], l->force[2], 0.0f};
      const float* const block = tile + 9 * (l->node % kWide);
      __builtin_prefetch(block + 4 * 9 * kWide);  // of the column after the next three
      along[0] += load(block) * f, along[1] += load(block + 3) * f, along[2] += load(block + 6) * f;
    }
    for (int a = 0; a < 3; ++a) sum[c][a] += along[a][0] + along[a][1] + along[a][2];
  }
}

}  // namespace

Compliance::Compliance(std::size_t nodes)
    : nodes_(nodes), tiles_((nodes + kTile - 1) / kTile), blocks_(place(tiles_, 0) + 1, 0.0f) {}

Eigen::Matrix3d Compliance::block(std::size_t row, std::size_t column) const {
  const std::size_t i = std::max(row, column), j = std::min(row, column);
  const float* const at = tile(i / kTile, j / kTile) + 9 * (j % kTile * kTile + i % kTile);
  const Eigen::Matrix3d lower = Eigen::Map<const Eigen::Matrix3f>(at).cast<double>();
  return row >= column ? lower : Eigen::Matrix3d(lower.transpose());
}

void Compliance::add(const std::vector<Load>& loads, double scale, Eigen::VectorXd& u) const {
  for (std::size_t own = 0; own < tiles_; ++own) {
    Four sum[kTile] = {};
    for (const Load *load = loads.data(), *end = load + loads.size(); load != end;) {
      const std::size_t other = load->node / kTile;
      const Load* next = load;
      while (next != end && next->node / kTile == other) ++next;
      if (own < other) {
        addRows(tile(other, own), load, next, sum);
        load = next;
      }
      for (; load != next; ++load)
        addColumn(tile(own, other) + 9 * kTile * (load->node % kTile), load->force, sum);
    }
    const std::size_t first = kTile * own, count = std::min(kTile, nodes_ - first);
    for (std::size_t n = 0; n < count; ++n)
      for (int a = 0; a < 3; ++a)
        u[3 * static_cast<Eigen::Index>(first + n) + a] += scale * static_cast<double>(sum[n][a]);
  }
}

Eigen::VectorXd Compliance::times(const Eigen::VectorXd& f) const {
  Eigen::VectorXd u = Eigen::VectorXd::Zero(f.size());
  std::vector<Load> loads;
  for (std::size_t n = 0; n < nodes_; ++n) {
    loads.push_back(
        {static_cast<std::uint32_t>(n), f.segment<3>(3 * static_cast<Eigen::Index>(n)).cast<float>()});
    if (loads.size() < kTile && n + 1 < nodes_) continue;
    add(loads, 1.0, u);
    loads.clear();
  }
  return u;
}

}  // namespace vest::fem
