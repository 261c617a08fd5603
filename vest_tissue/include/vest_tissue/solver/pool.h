#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace vest::solver {

/// A few threads that live as long as the world. run() hands out the items 0 … count-1; the caller works too.
/// Items must not depend on each other: then the result is the same for any number of threads. A step calls
/// run() tens of times, some microseconds apart: who waits looks for a while, then sleeps. A thread that a
/// busy machine does not let run holds up nobody, unless it is within an item. run() allocates nothing.
class Pool {
 public:
  explicit Pool(int threads = 1);
  ~Pool();
  Pool(const Pool&) = delete;
  Pool& operator=(const Pool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }
  using Function = void (*)(void* context, std::size_t item);
  void run(std::size_t count, Function function, void* context);

  template <typename Work>
  void each(std::size_t count, Work& work) {
    run(
        count, [](void* w, std::size_t item) { (*static_cast<Work*>(w))(item); }, &work);
  }

 private:
  void serve();
  void take();
  std::vector<std::thread> workers_;
  std::mutex mutex_;
  std::condition_variable wake_, done_;
  /// Number of the round, how many items it has, and the next one. An item belongs to the thread that moves
  /// it on. Until that item is finished the round is not over, so function and context are those of it.
  std::atomic<std::uint64_t> next_{0};
  std::atomic<std::size_t> finished_{0};
  Function function_ = nullptr;
  void* context_ = nullptr;
  std::atomic<int> asleep_{0};        ///< workers
  std::atomic<bool> waiting_{false};  ///< the caller sleeps until the last item is finished
  std::atomic<bool> stop_{false};
};

}  // namespace vest::solver
