#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "crossings.h"
#include "laid_knots.h"
#include "vest_tissue/suture/knot_kind.h"

namespace vest::suture::specimen {

/// A knot that is tied throw by throw and then drawn, by the rod alone. Two strands lie between clamps, 28 mm
/// apart: the loop where it leaves its pins. Each throw lies loosely, is drawn by both strands in line with
/// the clamps, and is let go. Then the tails are cut and the clamps part, until the thread breaks or slips.
/// It lies in syrup, so that nothing whips as it is let go.
struct PullTest {
  std::vector<int> throws;  ///< half turns of each, right-handed where positive: see thrown()
  Section section;
  double tension = 4.9;   ///< N, that each throw is set with
  double strength = 1e9;  ///< N, at which it breaks where it is bent tighter than twice its diameter
  double tail = 0.01;     ///< m, left behind the knot
  double speed = 0.02;    ///< m/s, of each clamp
  double damping = 2e5;   ///< 1/s; the thread's drag is then 0.05 N of the pull
};

struct Pulled {
  KnotKind kind;      ///< as it was tied
  double load = 0.0;  ///< N, greatest tension of a strand of the loop, mean of both
  /// Until it broke. Else the loop grew, beyond what its strands stretched, by 6 mm after it bore 5 N, or the
  /// tails came through.
  bool held = false;
  int through = 0;   ///< how often segments went through each other, in all
  bool well = true;  ///< every throw was set, and no step failed
};

class PullRoom : public Moving {
 public:
  explicit PullRoom(const PullTest& test) : PullRoom(test, laid(test)) {}

  Pulled run() {
    // It is laid without stress, and straight by nature soon after.
    for (int k = 0; k < kRest; ++k) {
      for (Eigen::Vector3d& c : state.natural_curvature) c.head<2>() *= 0.9;
      go(0.0);
    }
    for (std::size_t n = 0; n < test_.throws.size(); ++n) set(n);
    for (const auto& ears : ears_) model.force[ears.back()].setZero();
    for (int k = 0; k < kRest; ++k) go(0.0);
    result_.kind = kind();
    cutTails();
    pull();
    return result_;
  }

 private:
  static constexpr double kSize = 0.004, kHeight = 1.6 * kSize, kAside = 0.004, kTail = 0.01,
                          kLeg = 0.01;                   // m
  static constexpr double kStep = 0.00025;               // s
  static constexpr double kSpeed = 0.1;                  // m/s, of hands
  static constexpr double kKnotted = 0.6;                // strength over that of a straight thread; assumed
  static constexpr double kHold = 5000.0;                // N/m, of hands
  static constexpr double kGrown = 0.006, kWay = 0.024;  // m
  static constexpr double kPreload = 5.0;         // N: what a loose knot gives until then is slack; assumed
  static constexpr int kRest = 80, kMost = 3000;  // steps

  struct Laid {
    Description description;
    std::array<std::vector<Index>, 2> ears;  ///< nodes by which each throw is drawn
  };
  static Laid laid(const PullTest& test) {
    using Eigen::Vector3d;
    Laid out;
    // Setting a throw draws the tails in through those that are not yet set.
    const double tail = kTail * std::max(2.0, 3.0 * static_cast<double>(test.throws.size()) - 4.0);
    for (const bool left : {true, false}) {
      bool from_left = left;
      std::vector<Vector3d> path{{(left ? -1.0 : 1.0) * (kSize + kLeg), 0.0, 0.0}}, ears;
      for (std::size_t n = 0; n < test.throws.size(); ++n, from_left = !from_left) {
        const double z = kHeight * static_cast<double>(n), side = from_left ? 1.0 : -1.0;
        for (const Vector3d& x : strandOfThrow(test.throws[n], kSize, z, from_left)) path.push_back(x);
        const bool last = n + 1 == test.throws.size();
        ears.push_back(last ? Vector3d(path.back() + tail * Vector3d(side, 0.0, 0.1))
                            : Vector3d(side * (kSize + kAside), 0.0, z + 0.5 * kHeight));
        path.push_back(ears.back());
      }
      RodDescription rod;
      rod.name = left ? "left" : "right";
      rod.nodes = evenly(path, 4.0 * test.section.radius);
      rod.section = test.section;
      rod.section.damping = test.damping;
      rod.natural_shape = true;
      rod.held = {{0, Hold::Place, {}}};
      const Index first = left ? 0 : static_cast<Index>(out.description.rods[0].nodes.size());
      for (const Vector3d& ear : ears) {
        Index nearest = 0;
        for (Index i = 0; i < rod.nodes.size(); ++i)
          if ((rod.nodes[i] - ear).squaredNorm() < (rod.nodes[nearest] - ear).squaredNorm()) nearest = i;
        out.ears[left ? 0 : 1].push_back(first + nearest);
      }
      out.description.rods.push_back(rod);
    }
    return out;
  }

  PullRoom(const PullTest& test, const Laid& laid)
      : Moving(laid.description),
        test_(test),
        ears_(laid.ears),
        second_(model.strands[1].first),
        starts_{second_} {
    // What keeps a loose throw in its place: a fraction of what would straighten it.
    const double light = 3.0 * test.section.bend / (kSize * kSize);
    for (std::size_t k = 0; k < 2; ++k)
      model.force[ears_[k].back()] = light * outwards(k, test.throws.size() - 1);
  }

  /// Where strand k leaves throw n.
  static Eigen::Vector3d outwards(std::size_t k, std::size_t n) {
    return {(k == 0) == (n % 2 == 0) ? 1.0 : -1.0, 0.0, 0.0};
  }

  /// One step; hands draw until they bear the force, in x, and come into line with the clamps.
  void go(double force) {
    scratch.supports.clear();
    for (Hand& hand : hands_) {
      if (!hand.closed) continue;
      Support a;
      a.bond = Bond::Hold;
      const bool last = hand.node + 1 == second_ || hand.node + 1 == state.position.size();
      a.segment = last ? hand.node - 1 : hand.node, a.s = last ? 1.0 : 0.0;
      a.from = hand.at;
      const double way = kStep * kSpeed;
      hand.at += (hand.force < force ? way : hand.force > 1.02 * force ? -way : 0.0) * hand.way;
      for (const int e : {1, 2}) hand.at[e] -= std::clamp(hand.at[e], -way, way);
      a.to = hand.at;
      a.stiffness = kHold;
      scratch.supports.push_back(a);
    }
    const std::vector<Eigen::Vector3d> was = whole();
    result_.well = step(model, state, scratch, kStep) == StepStatus::Ok && result_.well;
    result_.through += std::abs(crossings(was, whole(), starts_));
    std::size_t k = 0;
    for (Hand& hand : hands_)
      if (hand.closed) hand.force = scratch.supports[k++].force.norm();
  }

  /// Places of nodes; what is cut off lies far away, for it touches nothing.
  std::vector<Eigen::Vector3d> whole() const {
    std::vector<Eigen::Vector3d> x = state.position;
    for (std::size_t i = 0; i + 1 < x.size(); ++i)
      if (state.severed[i] != 0) x[i + 1] = {static_cast<double>(i), 1.0, 0.0};
    return x;
  }

  void set(std::size_t n) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Index node = ears_[k][n];
      if (n + 1 == test_.throws.size()) model.force[node].setZero();
      hands_[k] = {true, node, state.position[node], outwards(k, n), 0.0};
    }
    const auto all = [this](auto holds) { return holds(hands_[0]) && holds(hands_[1]); };
    int steps = 0;
    for (int drawn = 0; drawn < kRest && steps < kMost; ++steps) {
      go(test_.tension);
      drawn +=
          all([this](const Hand& h) { return h.force > 0.97 * test_.tension && std::abs(h.at.z()) < 1e-4; });
    }
    result_.well = result_.well && steps < kMost;
    for (int k = 0; k < kMost && !all([](const Hand& h) { return h.force < 0.1; }); ++k) go(0.0);
    for (Hand& hand : hands_) hand.closed = false;
    for (int k = 0; k < kRest; ++k) go(0.0);
  }

  /// Each strand ends so far behind the last place where it touches, or nearly does.
  void cutTails() {
    for (const Strand& strand : model.strands) {
      Index last = strand.first;
      for (Index k = 0; k < state.contact_count; ++k) {
        const LiveContact& c = state.contacts[k];
        for (const Index i : {c.a, c.b})
          if (i >= strand.first && i < strand.first + strand.segments) last = std::max(last, i);
      }
      const auto cut = last + static_cast<Index>(std::lround(test_.tail / model.length[strand.first]));
      for (Index i = cut; i < strand.first + strand.segments; ++i) state.severed[i] = 1;
      starts_.push_back(cut + 1);
    }
  }

  /// Whether it is bent tighter anywhere than twice its diameter.
  bool bentTightly() const {
    for (const Strand& strand : model.strands) {
      for (Index i = strand.first; i + 1 < strand.first + strand.segments; ++i) {
        if (state.severed[i + 1] != 0) break;
        const Eigen::Vector3d t = state.frame[i] * Eigen::Vector3d::UnitZ(),
                              u = state.frame[i + 1] * Eigen::Vector3d::UnitZ();
        if ((u - t).norm() * 4.0 * strand.section.radius > model.length[i]) return true;
      }
    }
    return false;
  }

  void pull() {
    for (const std::size_t k : {0, 1}) {
      HeldModel& clamp = model.held[k];
      const Eigen::Vector3d x = state.position[clamp.node];
      clamp.drive = {
          {state.time, x, 0.0},
          {state.time + 1.0, x + Eigen::Vector3d(k == 0 ? -test_.speed : test_.speed, 0.0, 0.0), 0.0}};
    }
    const auto apart = [this] { return (state.position[second_] - state.position[0]).norm(); };
    const double begin = apart();
    double bore = 0.0;  // m apart, unstretched, where the loop first bears the preload; 0: not yet
    while (apart() < begin + kWay) {
      go(0.0);
      const double load = 0.5 * (scratch.reactions[0].force.norm() + scratch.reactions[1].force.norm());
      result_.load = std::max(result_.load, load);
      const double whole = apart() - 2.0 * (kSize + kLeg) * load / test_.section.stretch;
      if (bore == 0.0 && load >= kPreload) bore = whole;
      result_.held = load >= test_.strength / (bentTightly() ? 1.0 : kKnotted);
      if (result_.held || (bore > 0.0 && whole - bore > kGrown)) break;
    }
  }

  KnotKind kind() const {
    std::vector<Eigen::Vector3d> x(state.position.rend() - second_, state.position.rend());
    x.push_back({-0.03, 0.0, -0.03}), x.push_back({0.03, 0.0, -0.03});
    x.insert(x.end(), state.position.begin() + second_, state.position.end());
    KnotScratch memory(x.size());
    return kindOf(x.data(), x.size(), memory);
  }

  struct Hand {
    bool closed = false;
    Index node = 0;
    Eigen::Vector3d at, way;
    double force = 0.0;
  };
  PullTest test_;
  std::array<std::vector<Index>, 2> ears_;
  std::size_t second_;               ///< first node of the second strand
  std::vector<std::size_t> starts_;  ///< that and those of what is cut off
  std::array<Hand, 2> hands_;
  Pulled result_;
};

}  // namespace vest::suture::specimen
