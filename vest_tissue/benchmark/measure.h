#pragma once

#include <time.h>

#include <algorithm>
#include <chrono>
#include <vector>

namespace vest::bench {

/// µs of CPU time of this thread: what else the machine does is not counted.
inline double cpuNow() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

/// Median of `batches` runs of f, `repeats` calls each, on this thread alone: µs a call.
template <class F>
double microseconds(F&& f, int batches = 60, int repeats = 20) {
  std::vector<double> times;
  for (int batch = 0; batch < batches; ++batch) {
    const double begin = cpuNow();
    for (int n = 0; n < repeats; ++n) f();
    times.push_back((cpuNow() - begin) / repeats);
  }
  std::nth_element(times.begin(), times.begin() + batches / 2, times.end());
  return times[static_cast<std::size_t>(batches / 2)];
}

/// Least wall time of `batches` calls of f, µs, where several threads work: on a shared machine it is the one
/// that was disturbed least.
template <class F>
double leastWallMicroseconds(F&& f, int batches = 200) {
  double least = 1e300;
  for (int batch = 0; batch < batches; ++batch) {
    const auto begin = std::chrono::steady_clock::now();
    f();
    least = std::min(
        least, std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }
  return least;
}

}  // namespace vest::bench
