#pragma once

#include <stdexcept>
#include <string>

namespace vest::shared {

/// Another process holds it.
struct SessionTaken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A part of a session (its simulation, the device of a hand) for one process alone. A ROS master that was
/// restarted knows nothing of a session that still runs, and no master minds two names for the same part.
/// Ends with the process, however it dies.
class SessionLock {
 public:
  /// @param who how the refusal begins, e.g. "haptics/left"  @param name in shared memory, "/…": that of
  /// contactMemoryName() with the part behind it  @param patience s: who was told to end has so long to do it
  /// @throws SessionTaken where another process (or another object of this one) holds it; std::runtime_error
  /// with the system's reason where there is no shared memory
  SessionLock(const std::string& who, const std::string& name, double patience = 0.0);
  /// Lets go. A process that dies without it leaves that to be seen by the next.
  ~SessionLock();
  SessionLock(const SessionLock&) = delete;
  SessionLock& operator=(const SessionLock&) = delete;

  /// Who held it before did not let go (it was killed, or crashed), and nobody has settled it since this
  /// machine was started.
  bool predecessorDied() const noexcept { return predecessor_died_; }
  /// A person knows of it: who comes next is not told again.
  void settle() noexcept { predecessor_died_ = false; }

 private:
  int descriptor_ = -1;
  bool predecessor_died_ = false;
};

}  // namespace vest::shared
