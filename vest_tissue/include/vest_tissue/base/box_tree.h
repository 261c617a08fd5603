/// Boxes in a tree, so that a large surface is not looked through for each question.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace vest::contact {

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
};

class BoxTree {
 public:
  explicit BoxTree(const std::vector<Box>& boxes);

  /// Visits boxes, the likeliest first, until none is left whose bound is at most `least`.
  /// @param bound of a Box: no lower one has anything that lies in it; infinity: it is left out
  /// @param least is lowered by the visits
  /// @param visit is given the number of a box
  template <class Bound, class Visit>
  void visit(const Bound& bound, const double& least, const Visit& visit) const {
    std::vector<std::pair<double, std::uint32_t>> waiting;  // a heap
    const auto add = [&](std::uint32_t node) {
      const double at = bound(nodes_[node].box);
      if (!(at <= least)) return;
      waiting.emplace_back(at, node);
      std::push_heap(waiting.begin(), waiting.end(), std::greater<>());
    };
    if (!nodes_.empty()) add(0);
    while (!waiting.empty() && waiting.front().first <= least) {
      std::pop_heap(waiting.begin(), waiting.end(), std::greater<>());
      const Node& node = nodes_[waiting.back().second];
      waiting.pop_back();
      if (node.left != 0) {
        add(node.left), add(node.left + 1);
        continue;
      }
      for (std::uint32_t k = node.begin; k < node.end; ++k) visit(order_[k]);
    }
  }

 private:
  struct Node {
    Box box;
    std::uint32_t begin = 0, end = 0;  ///< in order_
    std::uint32_t left = 0;            ///< its children are this one and the next; 0: a leaf
  };
  void grow(std::uint32_t node, const std::vector<Box>& boxes);

  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

/// m: least distance from a place to anything in a box.
double distanceTo(const Box& box, const Eigen::Vector3d& place);
/// s: least of place + s direction, s >= 0, in a box; infinity where the ray misses it.
double entry(const Box& box, const Eigen::Vector3d& place, const Eigen::Vector3d& direction);

}  // namespace vest::contact
