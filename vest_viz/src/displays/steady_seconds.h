#pragma once

#include <chrono>

namespace vest::displays {

/// s, of the steady clock.
inline double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace vest::displays
