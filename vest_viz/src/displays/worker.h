#pragma once

#include <condition_variable>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

namespace vest::displays {

/// One thread for one task after another. A thread for each picture costs more than its start: OpenCV 4.6
/// never frees what it notes of a thread that has run a parallel loop (three blocks, about 850 bytes).
class Worker {
 public:
  Worker() : thread_([this] { loop(); }) {}
  /// Waits for the task that has begun.
  ~Worker() {
    {
      const std::lock_guard lock(mutex_);
      end_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  /// Begins a task; the one before must be done. What it throws comes out of the future's get().
  template <class F>
  auto start(F task) {
    auto packed = std::make_shared<std::packaged_task<decltype(task())()>>(std::move(task));
    {
      const std::lock_guard lock(mutex_);
      task_ = [packed] { (*packed)(); };
    }
    changed_.notify_one();
    return packed->get_future();
  }

 private:
  void loop() {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [this] { return task_ || end_; });
      if (!task_) return;
      const std::function<void()> task = std::exchange(task_, nullptr);
      lock.unlock();
      task();
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> task_;
  bool end_ = false;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace vest::displays
