#include "vest_tissue/fem/workers.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace vest::fem {

struct Workers::Impl {
  std::vector<std::thread> threads;
  std::mutex mutex;
  std::condition_variable start, done;
  std::size_t round = 0, count = 0;
  int busy = 0;
  bool stop = false;
  void (*body)(void*, std::size_t, std::size_t) = nullptr;
  void* context = nullptr;

  void range(std::size_t part) const {
    const std::size_t parts = threads.size() + 1;
    const std::size_t begin = count * part / parts, end = count * (part + 1) / parts;
    if (begin < end) body(context, begin, end);
  }

  void loop(std::size_t part) {
    std::size_t seen = 0;
    for (;;) {
      {
        std::unique_lock<std::mutex> lock(mutex);
        start.wait(lock, [&] { return stop || round != seen; });
        if (stop) return;
        seen = round;
      }
      range(part);
      std::lock_guard<std::mutex> lock(mutex);
      if (--busy == 0) done.notify_one();
    }
  }
};

Workers::Workers(int threads) : impl_(std::make_unique<Impl>()) {
  const int extra = std::clamp(threads, 1, 64) - 1;
  impl_->threads.resize(
      static_cast<std::size_t>(extra));  // the size is read by range() before all have started
  for (int t = 0; t < extra; ++t) {
    impl_->threads[static_cast<std::size_t>(t)] =
        std::thread([this, t] { impl_->loop(static_cast<std::size_t>(t) + 1); });
  }
}

Workers::~Workers() {
  {
    std::lock_guard<std::mutex> lock(impl_->mutex);
    impl_->stop = true;
  }
  impl_->start.notify_all();
  for (auto& thread : impl_->threads) thread.join();
}

int Workers::threads() const {
  return static_cast<int>(impl_->threads.size()) + 1;
}

void Workers::run(std::size_t count, void (*body)(void*, std::size_t, std::size_t), void* context) {
  constexpr std::size_t kWorthSharing = 256;  // elements; below it waking a thread costs more (assumed)
  if (impl_->threads.empty() || count < kWorthSharing) {
    if (count > 0) body(context, 0, count);
    return;
  }
  {
    std::lock_guard<std::mutex> lock(impl_->mutex);
    impl_->body = body;
    impl_->context = context;
    impl_->count = count;
    impl_->busy = static_cast<int>(impl_->threads.size());
    ++impl_->round;
  }
  impl_->start.notify_all();
  impl_->range(0);
  std::unique_lock<std::mutex> lock(impl_->mutex);
  impl_->done.wait(lock, [&] { return impl_->busy == 0; });
}

}  // namespace vest::fem
