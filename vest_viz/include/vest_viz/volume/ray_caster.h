/// Pictures of a whole volume by rays (Levoy, Display of surfaces from volume data, IEEE CG&A 8(3), 1988).
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/solver/pool.h"
#include "vest_tissue/volume/brick.h"
#include "vest_tissue/volume/transfer_table.h"
#include "vest_viz/inspect/slice.h"

namespace vest::volume {

/// From where, and what hides the volume. Rows go from the top down.
struct View {
  int width = 0, height = 0;  ///< pixels
  /// From normalised device coordinates (x to the right, y up, z from -1, near, to 1) to homogeneous places
  /// in the world, m.
  Eigen::Matrix4d from_clip = Eigen::Matrix4d::Identity();
  const float* depth = nullptr;  ///< per pixel: z at which a ray ends, -1 … 1; null: nothing hides
};

struct Look {
  double step = 0.5e-3;              ///< m, between samples of a ray
  bool shaded = true;                ///< by a lamp at the eye, where the values change
  std::vector<inspect::Plane> cuts;  ///< the side that a normal points to is taken away
};

/// A block of equal values lets through (1 - alpha)^(length / mm) at any step (Beer, Lambert).
class RayCaster {
 public:
  explicit RayCaster(std::shared_ptr<const Brick> brick);
  void setTable(const TransferTable& table);  ///< until then all is clear

  /// @param rgba width × height × 4 bytes; colours are multiplied by alpha. The same for any number of
  /// threads
  /// @param stop looked at between rows; @return false: it was set, and the picture is not whole
  bool cast(const View& view, const Look& look, solver::Pool& pool, std::vector<std::uint8_t>* rgba,
            const std::atomic<bool>* stop = nullptr) const;
  const Brick& brick() const { return *brick_; }

  /// What a caster of another kind needs to come to the same picture.
  struct Table {
    std::vector<Eigen::Vector4f> colours;  ///< of one step: red, green, blue, multiplied by alpha; alpha
    float first = 0, scale = 0;            ///< stored number of the first entry; entries per number
  };
  Table tableOf(double step) const;  ///< @param step m
  static constexpr float kLeastLight =
      1.0f / 512;                          ///< half of a level of 255: what is behind it cannot be seen
  static constexpr float kAmbient = 0.3f;  ///< share of light without a direction (tuned)
  /// Change over 1 mm, share of the table's range, that is shaded fully (tuned).
  static constexpr float kEdge = 0.03f;

 private:
  struct Step;
  void row(const Step& step, int y, std::uint8_t* rgba) const;
  Eigen::Vector4f ray(const Step& step, double x, double y, float depth) const;
  float shade(const Eigen::Vector3f& at, const Eigen::Vector3f& towards) const;
  bool clear(std::int16_t low, std::int16_t high) const;
  float entry(float number) const { return (number - first_) * scale_; }

  std::shared_ptr<const Brick> brick_;
  Eigen::Matrix3f to_grid_;               ///< turns differences in the world, m, to grid coordinates
  std::uint32_t blocks_[3]{};             ///< of kBlock³ voxels, along each axis
  std::vector<std::int16_t> low_, high_;  ///< per block: of the values that a sample in it can have
  std::vector<std::uint8_t> clear_;       ///< per block: 1: nothing of it is seen
  std::vector<Eigen::Vector4f> colours_;  ///< red, green, blue, and extinction in 1/m
  std::vector<std::uint32_t> seen_;       ///< how many of the entries before this one are not clear
  float first_ = 0, scale_ = 0;           ///< stored number of the first entry; entries per number
};

}  // namespace vest::volume
