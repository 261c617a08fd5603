#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <vector>

namespace vest::scene {

/// Bounded queue for one writer and one reader, whose slots are filled and read in place. No lock, no
/// allocation.
template <class T>
class SpscRing {
 public:
  explicit SpscRing(std::size_t capacity) : slots_(capacity + 1) {}

  /// Slot to fill, or nullptr while the queue is full. Writer only.
  T* back() {
    const std::size_t head = head_.load(std::memory_order_relaxed);
    return next(head) == tail_.load(std::memory_order_acquire) ? nullptr : &slots_[head];
  }
  void push() { head_.store(next(head_.load(std::memory_order_relaxed)), std::memory_order_release); }

  /// Oldest element, or nullptr while the queue is empty. Reader only.
  T* front() {
    const std::size_t tail = tail_.load(std::memory_order_relaxed);
    return tail == head_.load(std::memory_order_acquire) ? nullptr : &slots_[tail];
  }
  void pop() { tail_.store(next(tail_.load(std::memory_order_relaxed)), std::memory_order_release); }

  template <class F>
  void forEachSlot(F f) {
    for (T& slot : slots_) f(slot);
  }

 private:
  std::size_t next(std::size_t i) const { return i + 1 == slots_.size() ? 0 : i + 1; }
  std::vector<T> slots_;
  std::atomic<std::size_t> head_{0}, tail_{0};
};

/// Newest value from one writer to one reader; neither ever waits.
template <class T>
class TripleBuffer {
 public:
  T& back() { return slots_[back_]; }  ///< writer's
  void publish() {
    back_ = static_cast<unsigned>(middle_.exchange(back_ | kFresh, std::memory_order_acq_rel)) & 3u;
  }

  /// True where something newer than front() was there; it is front() now. Reader only.
  bool update() {
    if (!(middle_.load(std::memory_order_relaxed) & kFresh)) return false;
    front_ = middle_.exchange(front_, std::memory_order_acq_rel) & 3u;
    return true;
  }
  const T& front() const { return slots_[front_]; }

  /// Before there are threads: gives every slot its size.
  template <class F>
  void forEachSlot(F f) {
    for (T& slot : slots_) f(slot);
  }

 private:
  static constexpr unsigned kFresh = 4;
  std::array<T, 3> slots_;
  unsigned back_ = 0, front_ = 2;
  std::atomic<unsigned> middle_{1};
};

}  // namespace vest::scene
