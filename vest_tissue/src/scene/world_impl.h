#pragma once

#include <ctime>
#include <deque>
#include <memory>

#include "stages.h"
#include "vest_tissue/solver/pool.h"

namespace vest::scene {

inline constexpr std::size_t kEventCapacity = 64;

struct World::Impl {
  std::unique_ptr<WorldModel> model;
  WorldState state;
  WorldScratch scratch;
  std::unique_ptr<solver::Pool> pool;
  std::deque<TopologyDelta> deltas;   ///< the last few
  net::KernelLevel level = net::chooseKernelLevel();
  bool account_energy = false;
  bool measure = false;

  /// A copied vector has no spare room: give it back before steps that must not allocate.
  void reserve() {
    state.pairs.reserve(8192);
    state.sides.reserve(2048);
  }
  Status fault(Context& c, std::string_view object);

  template <typename Stage>
  void time(StepReport& report, int index, Stage stage) {
    if (!measure) {
      stage();
      return;
    }
    timespec a, b;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
    stage();
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
    report.stage_seconds[index] = static_cast<double>(b.tv_sec - a.tv_sec) + 1e-9 * static_cast<double>(b.tv_nsec - a.tv_nsec);
  }
};

}  // namespace vest::scene
