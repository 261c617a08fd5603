#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

namespace vest::ros_shell {

/// What happens around a running device: the ROS master dies or is another one, the system clock is set. The
/// loop needs neither; people must be told.
class SessionWatch {
 public:
  /// @param who how messages begin, e.g. "haptics/left"
  explicit SessionWatch(std::string who);
  ~SessionWatch();
  SessionWatch(const SessionWatch&) = delete;
  SessionWatch& operator=(const SessionWatch&) = delete;

  /// Often, from one thread: says what changed, once. Does not wait.
  void look();
  bool masterLost() const { return lost_; }
  double clockStep() const { return clock_step_; }  ///< s, all steps of the system clock together

 private:
  static constexpr double kAsk = 0.5;       ///< s between two questions to the master
  static constexpr double kPatience = 1.5;  ///< s without an answer: lost (docs/HAZARDS.md: told in 2 s)
  static constexpr double kAside = 0.2;     ///< s between two looks, assumed: the process stood still
  static constexpr double kStep = 0.5;      ///< s: beyond it the clock was set, not disciplined
  struct Master {
    std::atomic<std::int64_t> answered{0};  ///< steady, ns
    std::atomic<bool> refused{false}, stop{false}, ended{false};
  };

  std::string who_;
  std::shared_ptr<Master> master_ = std::make_shared<Master>();
  bool lost_ = false;
  std::int64_t looked_ = 0, awake_ = 0;  ///< steady, ns: the last look; the first one behind a standstill
  double offset_ = 0.0;                  ///< s, system clock minus steady clock
  double clock_step_ = 0.0;
};

}  // namespace vest::ros_shell
