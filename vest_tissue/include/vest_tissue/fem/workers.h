#pragma once

#include <cstddef>
#include <memory>

namespace vest::fem {

/// A few threads that share out index ranges. Tasks write to places of their own, so results do not depend on
/// the number of threads. run() allocates nothing.
class Workers {
 public:
  explicit Workers(int threads);  ///< 1 … 64; 1: everything runs on the caller
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  int threads() const;
  /// body(context, begin, end) for disjoint ranges that cover [0, count).
  void run(std::size_t count, void (*body)(void*, std::size_t, std::size_t), void* context);

  template <class F>
  void forRanges(std::size_t count, F& f) {
    run(
        count, [](void* c, std::size_t b, std::size_t e) { (*static_cast<F*>(c))(b, e); }, &f);
  }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace vest::fem
