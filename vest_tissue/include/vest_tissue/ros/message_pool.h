#pragma once

#include <cstddef>
#include <vector>

#include <boost/make_shared.hpp>

namespace vest::ros_shell {

/// Messages that nobody holds any more are used again, with the memory of their arrays.
template <class M>
class MessagePool {
 public:
  boost::shared_ptr<M> take() {
    for (std::size_t i = 0; i < pool_.size(); ++i) {
      next_ = next_ + 1 >= pool_.size() ? 0 : next_ + 1;
      if (pool_[next_].use_count() == 1) return pool_[next_];
    }
    if (pool_.size() >= kMost) return boost::make_shared<M>();
    pool_.push_back(boost::make_shared<M>());
    return pool_.back();
  }

 private:
  static constexpr std::size_t kMost = 64;
  std::vector<boost::shared_ptr<M>> pool_;
  std::size_t next_ = 0;
};

}  // namespace vest::ros_shell
