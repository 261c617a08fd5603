#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace vest::haptics {

/// Where the device's tip is in the simulation. Clutching and taking an instrument over leave an offset
/// between the device's pose and the instrument's, which only the simulation knows: it says what pose each
/// step was asked for, and this finds the own pose of the last moments that fits.
class Registration {
 public:
  static constexpr double kTolerance = 0.003;  ///< m, assumed: beyond it the offset has changed
  static constexpr double kWindow = 0.150;     ///< s of own poses: latency of a command on its way, and more

  void reset() noexcept;
  /// Own tip of this tick, m, world.
  void push(std::int64_t now_ns, const Eigen::Vector3d& own) noexcept;
  /// A step's commanded tip, m, world. True where the offset is known and has not changed.
  bool observe(std::int64_t step_ns, const Eigen::Vector3d& commanded) noexcept;
  const Eigen::Vector3d& offset() const noexcept { return offset_; }  ///< m: commanded − own

 private:
  static constexpr std::size_t kSlots = 160;
  struct Entry {
    std::int64_t ns = INT64_MIN / 2;  ///< so long ago that it is in no window
    Eigen::Vector3d own = Eigen::Vector3d::Zero();
  };
  std::array<Entry, kSlots> ring_;
  std::size_t next_ = 0;
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();
};

}  // namespace vest::haptics
