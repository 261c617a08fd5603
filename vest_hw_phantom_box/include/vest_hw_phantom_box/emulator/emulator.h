// A trainer box made of software: poses in, bytes out, with the faults that real lines have.
#pragma once

#include <cstdint>
#include <random>

#include "vest_hw_phantom_box/calibration/calibration.h"
#include "vest_hw_phantom_box/emulator/trajectory.h"
#include "vest_hw_phantom_box/protocol/frame.h"

namespace vest::emulator {

/// Probabilities per frame, 0 … 1; all from one seed.
struct Faults {
  double drop = 0;     ///< frame vanishes
  double flip = 0;     ///< one to three bits turn over
  double split = 0;    ///< the second part of the frame is written with the next one
  double garbage = 0;  ///< 1 … 40 random bytes in front
  double lose = 0;     ///< 1 … 20 bytes out of the middle vanish
  double jump = 0;     ///< one joint's count leaps for this frame
  double invalid = 0;  ///< one joint is flagged as not measured in this frame
  double chatter = 0;  ///< a pedal that changes bounces for up to 8 ms, with this probability
  std::uint64_t seed = 1;
  bool any() const { return drop + flip + split + garbage + lose + jump + invalid + chatter > 0; }
};

/// Damages frames on their way.
class FaultInjector {
 public:
  explicit FaultInjector(const Faults& faults) : faults_(faults), random_(faults.seed) {}
  /// Before encoding: sensors and pedals.
  void disturb(protocol::Motion& motion);
  /// After encoding: `frame` holds one frame; what goes out is appended to `line`. Empty frames are allowed.
  void transmit(const protocol::Bytes& frame, protocol::Bytes& line);

 private:
  bool chance(double p) { return p > 0 && std::uniform_real_distribution<double>(0, 1)(random_) < p; }
  std::size_t pick(std::size_t low, std::size_t high) {
    return std::uniform_int_distribution<std::size_t>(low, high)(random_);
  }

  Faults faults_;
  std::mt19937_64 random_;
  protocol::Bytes held_;
  std::uint8_t last_pedals_ = 0;
  std::uint8_t bouncing_ = 0;
  int bounce_left_ = 0;
};

/// Numbers and times the frames of one box.
class Emulator {
 public:
  Emulator(const calibration::Calibration& calibration, int instruments, const Faults& faults = {},
           const std::string& serial_number = "VEST-EMULATOR");

  /// A reader has come: what is sent next begins with a hello that restarts sequence and time.
  void restart();
  /// Frames that could not be sent: sequence and time go on, bytes do not.
  void skip(std::uint64_t frames);
  /// Appends the bytes of one millisecond (a motion frame, once a second a hello before it).
  void tick(const Pose& pose, protocol::Bytes& line);
  /// Undamaged content of the last motion frame.
  const protocol::Motion& last() const { return last_; }
  std::uint64_t ticks() const { return ticks_; }

 private:
  calibration::Calibration calibration_;
  FaultInjector injector_;
  protocol::Hello hello_;
  protocol::Motion last_;
  protocol::Bytes frame_;
  bool start_ = true;
  std::uint16_t sequence_ = 0;
  std::uint64_t ticks_ = 0;  ///< milliseconds since restart()
};

}  // namespace vest::emulator
