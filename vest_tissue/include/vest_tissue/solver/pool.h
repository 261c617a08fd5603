#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace vest::solver {

/// A few threads that live as long as the world. run() hands out the items 0 … count-1; the caller works too.
/// Items must not depend on each other: then the result is the same for any number of threads. A step calls
/// run() some ten times, some microseconds apart: who waits looks for a while, then sleeps. run() allocates
/// nothing.
///
/// Each thread has its own share of the items, the same in each round of the same shares: what an item works
/// on stays in that processor's cache. Who has finished takes from the end of another's share. So a thread
/// that a busy machine does not let run holds up nobody, unless it is within an item.
class Pool {
 public:
  explicit Pool(int threads = 1);
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }
  using Function = void (*)(void* context, std::size_t item);
  /// In equal shares, one after another.
  void run(std::size_t count, Function function, void* context);
  /// @param ends one for each thread, the caller first: behind the last item of its share. They rise.
  void run(const std::vector<std::size_t>& ends, Function function, void* context);

  template <typename Work>
  void each(std::size_t count, Work& work) {
    run(
        count, [](void* w, std::size_t item) { (*static_cast<Work*>(w))(item); }, &work);
  }
  template <typename Work>
  void each(const std::vector<std::size_t>& ends, Work& work) {
    run(
        ends, [](void* w, std::size_t item) { (*static_cast<Work*>(w))(item); }, &work);
  }

 private:
  /// Number of the round, where the share ends, and its next item. An item belongs to the thread that takes
  /// it off. Until that item is finished the round is not over, so function and context are those of it.
  struct alignas(64) Share {
    std::atomic<std::uint64_t> now{0};
  };
  template <typename End>
  void begin(std::size_t count, Function function, void* context, End endOf);
  void serve(std::size_t thread);
  void take(std::size_t thread);
  std::vector<std::thread> workers_;
  std::unique_ptr<Share[]> shares_;  ///< per thread, the caller's first
  std::uint64_t round_ = 0;
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::size_t count_ = 0;  ///< items of the round
  Function function_ = nullptr;
  void* context_ = nullptr;
  alignas(64) std::atomic<std::size_t> finished_{0};
  alignas(64) std::atomic<int> asleep_{0};  ///< workers
  std::atomic<bool> waiting_{false};        ///< the caller sleeps until the last item is finished
  std::atomic<bool> stop_{false};
};

}  // namespace vest::solver
