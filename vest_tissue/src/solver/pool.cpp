#include "vest_tissue/solver/pool.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace vest::solver {
namespace {

constexpr int kBits = 18;  ///< of an item's number, and of their count
constexpr std::uint64_t kMost = (std::uint64_t{1} << kBits) - 1;
constexpr int kLooks = 1000;  ///< some 30 µs, longer than what lies between two rounds of a step (tuned)

std::uint64_t roundOf(std::uint64_t next) {
  return next >> (2 * kBits);
}

void relax() {
#if defined(__x86_64__)
  _mm_pause();
#endif
}

/// Looks until something holds, for a while. @return whether it does
template <typename Holds>
bool look(Holds holds) {
  for (int i = 0; i < kLooks; ++i) {
    if (holds()) return true;
    relax();
  }
  return false;
}

}  // namespace

Pool::Pool(int threads) {
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { serve(); });
}

Pool::~Pool() {
  stop_ = true;
  { const std::lock_guard<std::mutex> lock(mutex_); }
  wake_.notify_all();
  for (auto& worker : workers_) worker.join();
}

void Pool::take() {
  std::uint64_t next = next_;
  while (true) {
    const std::uint64_t item = next & kMost, count = (next >> kBits) & kMost;
    if (item >= count) return;
    if (!next_.compare_exchange_weak(next, next + 1)) continue;
    function_(context_, item);
    if (finished_.fetch_add(1) + 1 == count && waiting_) {
      const std::lock_guard<std::mutex> lock(mutex_);
      done_.notify_one();
    }
    next = next_;
  }
}

void Pool::run(std::size_t count, Function function, void* context) {
  if (workers_.empty() || count < 2 || count > kMost) {
    for (std::size_t item = 0; item < count; ++item) function(context, item);
    return;
  }
  function_ = function;
  context_ = context;
  finished_ = 0;
  next_ = ((roundOf(next_) + 1) << (2 * kBits)) | (count << kBits);
  if (asleep_ > 0) {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_.notify_all();
  }
  take();
  const auto finished = [&] { return finished_ == count; };
  if (look(finished)) return;
  std::unique_lock<std::mutex> lock(mutex_);
  waiting_ = true;
  done_.wait(lock, finished);
  waiting_ = false;
}

void Pool::serve() {
  std::uint64_t seen = 0;
  while (!stop_) {
    const auto called = [&] { return stop_ || roundOf(next_) != seen; };
    if (!look(called)) {
      std::unique_lock<std::mutex> lock(mutex_);
      ++asleep_;
      wake_.wait(lock, called);
      --asleep_;
    }
    seen = roundOf(next_);
    take();
  }
}

}  // namespace vest::solver
