#include "vest_tissue/shared/session_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

namespace vest::shared {

namespace {

// One byte of the memory: held, or let go of. A process that dies lets go of nothing.
bool mark(int descriptor, char state) noexcept {
  return ::pwrite(descriptor, &state, 1, 0) == 1;
}
constexpr char kLetGo = 0, kHeld = 1;

}  // namespace

SessionLock::SessionLock(const std::string& who, const std::string& name, double patience) {
  using Clock = std::chrono::steady_clock;
  descriptor_ = ::shm_open(name.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor_ < 0)
    throw std::runtime_error(who + ": shared memory '" + name + "': " + std::strerror(errno));
  const auto end = Clock::now() + std::chrono::duration<double>(patience);
  while (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    if (error == EINTR) continue;
    if (error == EWOULDBLOCK && Clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      continue;
    }
    ::close(descriptor_);
    if (error == EWOULDBLOCK)
      throw SessionTaken(
          who +
          " of this session already runs in another process. If the ROS master was started anew, "
          "the old session still goes on: end it first");
    throw std::runtime_error(who + ": shared memory '" + name + "': " + std::strerror(error));
  }
  char before = kLetGo;
  predecessor_died_ = ::pread(descriptor_, &before, 1, 0) == 1 && before == kHeld;
  if (!mark(descriptor_, kHeld)) {
    const int error = errno;
    ::close(descriptor_);
    throw std::runtime_error(who + ": shared memory '" + name + "': " + std::strerror(error));
  }
}

SessionLock::~SessionLock() {
  if (!predecessor_died_) mark(descriptor_, kLetGo);
  ::close(descriptor_);  // and with it the lock
}

}  // namespace vest::shared
