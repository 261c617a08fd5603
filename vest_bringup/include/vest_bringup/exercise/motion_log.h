#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/session/motion_metrics.h"

namespace vest::exercise {

/// Where instruments were told to be, in the first step and every 20th after it: what figures of motion are
/// made of. Time is simulated time, so that a recording gives the figures of its session to the bit.
class MotionLog {
 public:
  static constexpr std::uint64_t kEvery = 20;  ///< steps
  static constexpr std::size_t kTools = tools::kInstrumentCount;
  using Tools = std::array<bool, kTools>;  ///< by tools::Instrument
  static constexpr double kEver = 1e15;    ///< steps

  /// Of all instruments, as long as it takes.
  MotionLog() { logged_.fill(true); }
  /// Of some, with room for so many rows of each: add() allocates nothing, and drops what finds no room.
  MotionLog(const Tools& logged, std::size_t rows);
  /// Copies of one log that went on copy what came since: not the whole of it, and into their own room.
  MotionLog(const MotionLog& other) { *this = other; }
  MotionLog& operator=(const MotionLog& other);
  MotionLog(MotionLog&&) = default;
  MotionLog& operator=(MotionLog&&) = default;
  ~MotionLog() = default;

  /// @param t s, rising  @param step number of the step
  void add(double t, std::uint64_t step, const scene::StepInput& input);
  void clear();

  /// As vest_metrics has them, of each instrument that was there; `bimanual` and `path_ratio` of left and
  /// right while both are there. Economy: the straight way from the first row through the places where a
  /// phase ended over the path, at most 1; nothing before a phase ended.
  /// @param moments of the exercise  @param from, to  steps: the rows between count
  session::motion::Figures figures(const std::vector<Moment>& moments, double from = 0,
                                   double to = kEver) const;

  void save(std::vector<std::uint8_t>& bytes) const;
  /// @return the rest, or null where the bytes are no log
  const std::uint8_t* restore(const std::uint8_t* bytes, const std::uint8_t* end);

 private:
  struct Row {
    double step, t;
    std::array<double, 3> position;     ///< m, world
    std::array<double, 4> orientation;  ///< x y z w
  };
  Tools logged_;
  std::size_t most_ = 0;    ///< rows; 0: any
  std::uint64_t life_ = 0;  ///< logs of another one have nothing in common
  std::array<std::vector<Row>, kTools> rows_;
};

}  // namespace vest::exercise
