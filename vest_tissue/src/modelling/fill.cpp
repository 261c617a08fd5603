#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "vest_tissue/base/nearest.h"
#include "vest_tissue/modelling/tree.h"
#include "vest_tissue/solver/random.h"

namespace vest::modelling {
namespace {

constexpr std::size_t kNearest = 12;   // branches that an end may join
constexpr double kShortest = 2.0;      // of a branch, in radii of the one that it leaves: out of its wall
constexpr double kClear = 1.5;         // of the sum of two radii: what branches keep between their axes
constexpr int kTries = 400;            // places that are drawn for an end
constexpr int kTriesAtADistance = 10;  // behind as many the ends may lie closer (Karch 1999)
constexpr int kSweeps = 200;           // of all branchings
// Branches that all trials of a tree look at: seconds (assumed).
constexpr std::size_t kMostWork = 20000000;

struct Twig {
  int parent = -1;
  std::array<int, 2> next{-1, -1};
  Vector3 to = Vector3::Zero();
};

/// A tree whose branchings have two followers each. Ends and radii follow from its shape.
class Growing {
 public:
  explicit Growing(const TreeSpec& spec) : spec_(&spec) {}

  std::vector<Twig> twigs;
  std::vector<TreeBranch> branches;  // of the same numbers

  const Vector3& from(std::size_t i) const {
    return twigs[i].parent < 0 ? spec_->root : twigs[static_cast<std::size_t>(twigs[i].parent)].to;
  }
  bool ends(std::size_t i) const { return twigs[i].next[0] < 0; }

  /// Parents first.
  std::vector<std::size_t> inOrder() const {
    std::vector<std::size_t> order{0};
    for (std::size_t k = 0; k < order.size(); ++k)
      for (const int next : twigs[order[k]].next)
        if (next >= 0) order.push_back(static_cast<std::size_t>(next));
    return order;
  }

  void size() {
    const auto order = inOrder();
    branches.assign(twigs.size(), {});
    for (std::size_t k = order.size(); k-- > 0;) {
      const std::size_t i = order[k];
      TreeBranch& branch = branches[i];
      branch.parent = twigs[i].parent;
      if (ends(i))
        branch.ends = 1;
      else
        branch.ends = branches[static_cast<std::size_t>(twigs[i].next[0])].ends +
                      branches[static_cast<std::size_t>(twigs[i].next[1])].ends;
    }
    for (const std::size_t i : order) {
      TreeBranch& branch = branches[i];
      branch.from = from(i);
      branch.to = twigs[i].to;
      branch.radius = branch.parent < 0
                          ? spec_->radius
                          : radiusBehind(branches[static_cast<std::size_t>(branch.parent)], branch.ends);
    }
  }

  /// m³ over pi.
  double volume() const {
    double sum = 0;
    for (std::size_t i = 0; i < twigs.size(); ++i)
      sum += branches[i].radius * branches[i].radius * (twigs[i].to - from(i)).norm();
    return sum;
  }

  /// Where the branching at the end of twig i costs least, its three neighbours at rest: the place nearest to
  /// them, each weighed by its section (Weiszfeld's iteration).
  Vector3 bestPlace(std::size_t i) const {
    const std::array<std::size_t, 3> at{i, static_cast<std::size_t>(twigs[i].next[0]),
                                        static_cast<std::size_t>(twigs[i].next[1])};
    const std::array<Vector3, 3> far{from(i), twigs[at[1]].to, twigs[at[2]].to};
    Vector3 place = twigs[i].to;
    for (int pass = 0; pass < 60; ++pass) {
      Vector3 sum = Vector3::Zero();
      double weights = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double section = branches[at[k]].radius * branches[at[k]].radius;
        const double weight = section / std::max((place - far[k]).norm(), 1e-9);
        sum += weight * far[k];
        weights += weight;
      }
      const Vector3 next = sum / weights;
      const bool there = (next - place).norm() < 1e-9;
      place = next;
      if (there) break;
    }
    return place;
  }

  /// Whether twig i is long enough and clear of all that it does not touch.
  bool good(std::size_t i) const {
    const TreeBranch& branch = branches[i];
    const double before =
        branch.parent < 0 ? branch.radius : branches[static_cast<std::size_t>(branch.parent)].radius;
    if ((twigs[i].to - from(i)).norm() < kShortest * before) return false;
    for (std::size_t j = 0; j < twigs.size(); ++j) {
      if (j == i || twigs[j].parent == static_cast<int>(i) || twigs[i].parent == static_cast<int>(j) ||
          twigs[j].parent == twigs[i].parent)
        continue;
      double s = 0, t = 0;
      if (contact::nearestSegments(from(i), twigs[i].to, from(j), twigs[j].to, s, t) <
          kClear * (branch.radius + branches[j].radius))
        return false;
    }
    return true;
  }

  bool goodAround(std::size_t i) const {
    return good(i) && (ends(i) || (good(static_cast<std::size_t>(twigs[i].next[0])) &&
                                   good(static_cast<std::size_t>(twigs[i].next[1]))));
  }

  /// A branch to `end` leaves twig i, whose part behind the branching is a twig of its own.
  void join(std::size_t i, const Vector3& end) {
    const int behind = static_cast<int>(twigs.size());
    Twig rest = twigs[i];
    for (const int next : rest.next)
      if (next >= 0) twigs[static_cast<std::size_t>(next)].parent = behind;
    rest.parent = static_cast<int>(i);
    twigs[i].to = (from(i) + rest.to + end) / 3;
    twigs[i].next = {behind, behind + 1};
    twigs.push_back(rest);
    twigs.push_back({static_cast<int>(i), {-1, -1}, end});
    size();
    twigs[i].to = bestPlace(i);
  }

 private:
  const TreeSpec* spec_;
};

Vector3 placeIn(const Region& region, std::uint32_t seed, std::uint64_t draw) {
  for (std::uint64_t again = 0;; ++again) {
    Vector3 place;
    for (int axis = 0; axis < 3; ++axis)
      place[axis] = 2 * solver::randomUniform(seed, draw, 3 * again + static_cast<std::uint64_t>(axis)) - 1;
    if (place.squaredNorm() <= 1) return region.centre + place.cwiseProduct(region.half_axes);
  }
}

/// The tree with one more end, where it then has the least volume. False: the end finds no place.
/// @param work grows by the branches that trials look at
bool grow(Growing& tree, const Vector3& end, std::size_t& work) {
  std::vector<std::pair<double, std::size_t>> near;
  for (std::size_t i = 0; i < tree.twigs.size(); ++i) {
    double s = 0, t = 0;
    near.emplace_back(contact::nearestSegments(tree.from(i), tree.twigs[i].to, end, end, s, t), i);
  }
  std::sort(near.begin(), near.end());
  near.resize(std::min(near.size(), kNearest));
  double least = std::numeric_limits<double>::infinity();
  Growing best = tree;
  for (const auto& [distance, i] : near) {
    Growing trial = tree;
    work += trial.twigs.size();
    trial.join(i, end);
    const double volume = trial.volume();
    if (volume < least && trial.goodAround(i)) {
      least = volume;
      best = std::move(trial);
    }
  }
  if (!std::isfinite(least)) return false;
  tree = std::move(best);
  tree.size();
  return true;
}

/// Each branching goes to where it costs least, as long as branches stay clear of each other.
void settle(Growing& tree) {
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double moved = 0;
    for (std::size_t i = 0; i < tree.twigs.size(); ++i) {
      if (tree.ends(i)) continue;
      const Vector3 before = tree.twigs[i].to;
      tree.twigs[i].to = tree.bestPlace(i);
      if (!tree.goodAround(i))
        tree.twigs[i].to = before;
      else
        moved = std::max(moved, (tree.twigs[i].to - before).norm());
    }
    if (moved < 1e-9) break;
  }
}

}  // namespace

std::vector<TreeBranch> fillRegion(const TreeSpec& spec) {
  const Region& region = *spec.region;
  Growing tree(spec);
  const double volume = region.half_axes.prod();
  std::uint64_t draw = 0;
  std::size_t work = 0;
  double apart = std::cbrt(volume);
  for (std::uint32_t end = 0; end < spec.terminals; ++end) {
    int tries = 0;
    apart = std::min(apart, std::cbrt(volume / (end + 1)));
    for (bool found = false; !found; ++tries) {
      if (tries == kTries || work > kMostWork)
        throw std::invalid_argument("terminals: " + std::to_string(end) + " of " +
                                    std::to_string(spec.terminals) +
                                    " find a place; allowed: fewer, a thinner radius or a larger region");
      if (tries > 0 && tries % kTriesAtADistance == 0) apart *= 0.9;
      const Vector3 place = placeIn(region, spec.seed, draw++);
      if (tree.twigs.empty()) {
        tree.twigs.push_back({-1, {-1, -1}, place});
        tree.size();
        found = tree.good(0);
        if (!found) tree.twigs.clear();
        continue;
      }
      double nearest = std::numeric_limits<double>::infinity(), s = 0, t = 0;
      for (std::size_t i = 0; i < tree.twigs.size(); ++i)
        nearest =
            std::min(nearest, contact::nearestSegments(tree.from(i), tree.twigs[i].to, place, place, s, t));
      found = nearest >= apart && grow(tree, place, work);
    }
  }
  settle(tree);
  tree.size();

  // Parents before their branches, and each turned from the way of its parent.
  const auto order = tree.inOrder();
  std::vector<int> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = static_cast<int>(k);
  std::vector<TreeBranch> branches;
  for (const std::size_t i : order) {
    TreeBranch branch = tree.branches[i];
    const Vector3 way = branch.to - branch.from;
    Vector3 axis = way.unitOrthogonal();
    if (branch.parent >= 0) {
      const TreeBranch& before = tree.branches[static_cast<std::size_t>(branch.parent)];
      const Vector3 turn = (before.to - before.from).cross(way);
      if (turn.norm() > 1e-6 * way.norm() * (before.to - before.from).norm()) axis = turn.normalized();
      branch.parent = place[static_cast<std::size_t>(branch.parent)];
    }
    branch.axis = axis;
    branches.push_back(branch);
  }
  return branches;
}

}  // namespace vest::modelling
