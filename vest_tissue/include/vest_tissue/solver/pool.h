#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <thread>
#include <vector>

namespace vest::solver {

/// A few threads that live as long as the world. run() hands out the items 0 … count-1; the caller works too.
/// Items must not depend on each other: then the result is the same for any number of threads. Waits by
/// blocking after a short look, so that a busy machine does not stall. run() allocates
/// nothing.
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
  std::atomic<std::size_t> next_{0};
  std::size_t count_ = 0;
  Function function_ = nullptr;
  void* context_ = nullptr;
  std::size_t round_ = 0;  // under mutex_
  std::size_t busy_ = 0;   // under mutex_
  bool stop_ = false;
};

}  // namespace vest::solver
