#include "vest_tissue/base/box_tree.h"

#include <limits>

namespace vest::contact {
namespace {

using Eigen::Vector3d;

constexpr std::uint32_t kLeaf = 4;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

BoxTree::BoxTree(const std::vector<Box>& boxes) {
  if (boxes.empty()) return;
  for (std::uint32_t i = 0; i < boxes.size(); ++i) order_.push_back(i);
  nodes_.emplace_back();
  nodes_[0].end = static_cast<std::uint32_t>(boxes.size());
  for (std::uint32_t node = 0; node < nodes_.size(); ++node) grow(node, boxes);  // it appends
}

void BoxTree::grow(std::uint32_t node, const std::vector<Box>& boxes) {
  const std::uint32_t begin = nodes_[node].begin, end = nodes_[node].end;
  const auto middleOf = [&](std::uint32_t k) { return Vector3d(0.5 * (boxes[k].low + boxes[k].high)); };
  Box all = boxes[order_[begin]];
  Vector3d low = middleOf(order_[begin]), high = low;
  for (std::uint32_t k = begin; k < end; ++k) {
    const Box& box = boxes[order_[k]];
    all.low = all.low.cwiseMin(box.low), all.high = all.high.cwiseMax(box.high);
    low = low.cwiseMin(middleOf(order_[k])), high = high.cwiseMax(middleOf(order_[k]));
  }
  nodes_[node].box = all;
  if (end - begin <= kLeaf) return;
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const std::uint32_t middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     return std::pair(middleOf(a)[axis], a) < std::pair(middleOf(b)[axis], b);
                   });
  nodes_[node].left = static_cast<std::uint32_t>(nodes_.size());
  nodes_.resize(nodes_.size() + 2);
  nodes_[nodes_.size() - 2].begin = begin, nodes_[nodes_.size() - 2].end = middle;
  nodes_[nodes_.size() - 1].begin = middle, nodes_[nodes_.size() - 1].end = end;
}

double distanceTo(const Box& box, const Vector3d& place) {
  return (place - place.cwiseMax(box.low).cwiseMin(box.high)).norm();
}

double entry(const Box& box, const Vector3d& place, const Vector3d& direction) {
  double first = 0.0, last = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0.0) {
      if (place[axis] < box.low[axis] || place[axis] > box.high[axis]) return kInfinity;
      continue;
    }
    const double a = (box.low[axis] - place[axis]) / direction[axis],
                 b = (box.high[axis] - place[axis]) / direction[axis];
    first = std::max(first, std::min(a, b)), last = std::min(last, std::max(a, b));
  }
  return first <= last * (1 + 1e-9) ? first * (1 - 1e-9) : kInfinity;  // beyond rounding
}

}  // namespace vest::contact
