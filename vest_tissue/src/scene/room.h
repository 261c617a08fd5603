#pragma once

#include <iterator>
#include <utility>
#include <vector>

namespace vest::scene {

/// Room for exactly n entries. What has room decides what a cut does, so a State that was restored has as
/// much as any other.
template <class T>
void giveRoom(std::vector<T>& v, std::size_t n) {
  if (v.capacity() == n) return;
  std::vector<T> exact;
  exact.reserve(n);
  exact.insert(exact.end(), std::make_move_iterator(v.begin()), std::make_move_iterator(v.end()));
  v.swap(exact);
}

}  // namespace vest::scene
