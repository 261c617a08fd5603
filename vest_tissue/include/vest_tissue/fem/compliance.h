#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace vest::fem {

/// A symmetric matrix of 3×3 blocks between nodes, m/N: the displacement of one per force on another. Half of
/// it is kept, in float: 18 bytes times the square of the number of nodes. Immutable once made.
///
/// Tiles of kTile × kTile blocks, those on and below the diagonal, row by row of tiles. Within a tile blocks
/// go column by column, nine numbers each, by columns too.
class Compliance {
 public:
  static constexpr std::size_t kTile = 32;  ///< nodes (tuned): a column of a tile lies on one page
  struct Load {
    std::uint32_t node = 0;
    Eigen::Vector3f force = Eigen::Vector3f::Zero();  ///< N
  };

  Compliance() = default;
  explicit Compliance(std::size_t nodes);  ///< zeros

  std::size_t nodes() const { return nodes_; }
  std::size_t bytes() const { return place(tiles_, 0) * sizeof(float); }
  float* data() { return blocks_.data(); }
  const float* data() const { return blocks_.data(); }
  float* tile(std::size_t row, std::size_t column) { return blocks_.data() + place(row, column); }

  Eigen::Matrix3d block(std::size_t row, std::size_t column) const;
  /// u += scale·C·f, m, of 3·nodes numbers; loads in the order of their nodes. Of each load its columns alone
  /// are read. Real-time safe.
  void add(const std::vector<Load>& loads, double scale, Eigen::VectorXd& u) const;
  Eigen::VectorXd times(const Eigen::VectorXd& f) const;

 private:
  static constexpr std::size_t kBlocks = 9 * kTile * kTile;  ///< numbers of a tile
  static std::size_t place(std::size_t row, std::size_t column) {
    return kBlocks * (row * (row + 1) / 2 + column);
  }
  const float* tile(std::size_t row, std::size_t column) const { return blocks_.data() + place(row, column); }
  std::size_t nodes_ = 0, tiles_ = 0;
  std::vector<float> blocks_;
};

}  // namespace vest::fem
