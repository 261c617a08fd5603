#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

namespace vest::haptics {

/// Where the device's tip is in the simulation. Clutching and taking an instrument over leave an offset
/// between the device's pose and the instrument's, which only the simulation knows: it says what pose each
/// step was asked for, and this finds the own pose of the last moments that fits. How old that pose is nobody
/// knows, so an offset that changes under a moving hand is found within kTolerance only. A hand that stands
/// still has one pose: then the offset is what lies between.
class Registration {
 public:
  static constexpr double kTolerance = 0.003;  ///< m, assumed: beyond it the offset has changed
  static constexpr double kWindow = 0.150;     ///< s of own poses: latency of a command on its way, and more
  static constexpr double kStill = 0.0005;     ///< m within kWindow, tuned: less is a hand that stands still
  static constexpr double kFollow = 0.005;  ///< m/s while a force is shown, tuned: slower than a hand moves

  void reset() noexcept;
  /// Own tip of this tick, m, world.
  void push(std::int64_t now_ns, const Eigen::Vector3d& own) noexcept;
  /// A step's commanded tip, m, world. True where the offset is known and has not changed.
  /// @param shown a force is shown: the offset follows by kFollow alone, or the hand would feel a kick
  bool observe(std::int64_t step_ns, const Eigen::Vector3d& commanded, bool shown) noexcept;
  const Eigen::Vector3d& offset() const noexcept { return offset_; }  ///< m: commanded − own

 private:
  static constexpr std::size_t kSlots = 160;
  struct Entry {
    std::int64_t ns = INT64_MIN / 2;  ///< so long ago that it is in no window
    Eigen::Vector3d own = Eigen::Vector3d::Zero();
  };
  std::array<Entry, kSlots> ring_;
  std::size_t next_ = 0;
  std::int64_t observed_ns_ = 0;
  Eigen::Vector3d offset_ = Eigen::Vector3d::Zero();
};

}  // namespace vest::haptics
