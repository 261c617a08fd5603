#pragma once

#include <pthread.h>
#include <sched.h>

namespace vest::haptics {

/// Gives the calling thread a name and, where this user may have it, the priority that the loop of 1 kHz and
/// the threads that serve devices share. @return whether it was granted
inline bool becomeRealTime(const char* name) noexcept {
  constexpr int kPriority =
      80;  // of 99, assumed: below the kernel's own threads for interrupts on a PREEMPT_RT
  pthread_setname_np(pthread_self(), name);
  const sched_param parameter{kPriority};
  return pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameter) == 0;
}

}  // namespace vest::haptics
