#include "vest_tissue/solver/pool.h"

namespace vest::solver {

Pool::Pool(int threads) {
  for (int i = 1; i < threads; ++i) workers_.emplace_back([this] { serve(); });
}

Pool::~Pool() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (auto& worker : workers_) worker.join();
}

void Pool::take() {
  for (std::size_t item = next_.fetch_add(1); item < count_; item = next_.fetch_add(1))
    function_(context_, item);
}

void Pool::run(std::size_t count, Function function, void* context) {
  if (workers_.empty() || count < 2) {
    for (std::size_t item = 0; item < count; ++item) function(context, item);
    return;
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    count_ = count;
    function_ = function;
    context_ = context;
    next_.store(0);
    busy_ = workers_.size();
    ++round_;
  }
  wake_.notify_all();
  take();
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
}

void Pool::serve() {
  std::size_t seen = 0;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stop_ || round_ != seen; });
    if (stop_) return;
    seen = round_;
    lock.unlock();
    take();
    lock.lock();
    if (--busy_ == 0) done_.notify_one();
  }
}

}  // namespace vest::solver
