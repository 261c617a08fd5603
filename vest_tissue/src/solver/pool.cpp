#include "vest_tissue/solver/pool.h"

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace vest::solver {
namespace {

constexpr int kBits = 18;  ///< of an item's number, and of where a share ends
constexpr std::uint64_t kOneEnd = std::uint64_t{1} << kBits;
constexpr std::uint64_t kMost = kOneEnd - 1;
constexpr int kLooks = 1000;  ///< some 30 µs, longer than what lies between two rounds of a step (tuned)

std::uint64_t roundOf(std::uint64_t share) {
  return share >> (2 * kBits);
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
  shares_ = std::make_unique<Share[]>(static_cast<std::size_t>(threads > 1 ? threads : 1));
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this, i] { serve(static_cast<std::size_t>(i)); });
}

Pool::~Pool() {
  stop_ = true;
  { const std::lock_guard<std::mutex> lock(mutex_); }
  wake_.notify_all();
  for (auto& worker : workers_) worker.join();
}

void Pool::take(std::size_t thread) {
  std::size_t mine = 0;
  const std::size_t threads = workers_.size() + 1;
  for (std::size_t n = 0; n < threads; ++n) {
    std::atomic<std::uint64_t>& share = shares_[(thread + n) % threads].now;
    std::uint64_t now = share;
    while (true) {
      const std::uint64_t next = now & kMost, end = (now >> kBits) & kMost;
      if (next >= end) break;
      // One's own from the front, another's from its end: both keep to what they worked on before.
      if (!share.compare_exchange_weak(now, n == 0 ? now + 1 : now - kOneEnd)) continue;
      function_(context_, n == 0 ? next : end - 1);
      ++mine;
      now = share;
    }
  }
  if (mine == 0) return;
  const std::size_t count = count_;
  if (finished_.fetch_add(mine) + mine == count && waiting_) {
    const std::lock_guard<std::mutex> lock(mutex_);
    done_.notify_one();
  }
}

template <typename End>
void Pool::begin(std::size_t count, Function function, void* context, End endOf) {
  if (workers_.empty() || count < 2 || count > kMost) {
    for (std::size_t item = 0; item < count; ++item) function(context, item);
    return;
  }
  function_ = function;
  context_ = context;
  count_ = count;
  finished_ = 0;
  ++round_;
  std::size_t first = 0;
  for (std::size_t thread = 0; thread <= workers_.size(); ++thread) {
    const std::size_t end = endOf(thread);
    shares_[thread].now = (round_ << (2 * kBits)) | (end << kBits) | first;
    first = end;
  }
  if (asleep_ > 0) {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_.notify_all();
  }
  take(0);
  const auto finished = [&] { return finished_ == count; };
  if (look(finished)) return;
  std::unique_lock<std::mutex> lock(mutex_);
  waiting_ = true;
  done_.wait(lock, finished);
  waiting_ = false;
}

void Pool::run(std::size_t count, Function function, void* context) {
  const std::size_t threads = workers_.size() + 1;
  begin(count, function, context, [&](std::size_t thread) { return count * (thread + 1) / threads; });
}

void Pool::run(const std::vector<std::size_t>& ends, Function function, void* context) {
  begin(ends.back(), function, context, [&](std::size_t thread) { return ends[thread]; });
}

void Pool::serve(std::size_t thread) {
  std::uint64_t seen = 0;
  const std::atomic<std::uint64_t>& own = shares_[thread].now;
  while (!stop_) {
    const auto called = [&] { return stop_ || roundOf(own) != seen; };
    if (!look(called)) {
      std::unique_lock<std::mutex> lock(mutex_);
      ++asleep_;
      wake_.wait(lock, called);
      --asleep_;
    }
    seen = roundOf(own);
    take(thread);
  }
}

}  // namespace vest::solver
