#include <algorithm>
#include <cmath>

#include "vest_tissue/fem/simulate.h"

namespace vest::fem {
namespace {

constexpr double kTolerance = 1e-10;  // unbalanced over applied force
constexpr double kUsable = 1e-6;      // accepted where rounding stops the descent
constexpr int kIterations = 60;       // per load step
constexpr int kMostLoadSteps = 256;

/// The object under a share of its load.
class Problem {
 public:
  Problem(const Model& model, const Eigen::Vector3d& gravity, State& state, Scratch& scratch)
      : model_(model), gravity_(gravity), state_(state), s_(scratch) {
    // A position x is known to eps·|x|; its rounding alone makes forces of this norm.
    double square = 0.0;
    for (std::size_t t = 0; t < model.elements.size(); ++t) {
      const Element& e = model.elements[t];
      for (std::size_t a = 0; a < 4; ++a) {
        const double k =
            e.volume * (model.laws[t].lambda + 4.0 * model.laws[t].mu) * e.gradient[a].squaredNorm();
        square += k * k * model.description.nodes[e.nodes[a]].squaredNorm();
      }
    }
    floor_ = 2.3e-16 * std::sqrt(square);
  }

  Eigen::Vector3d external(Index n) const { return share_ * (model_.load[n] + model_.mass[n] * gravity_); }

  void setShare(double share) {
    share_ = share;
    for (std::size_t n = 0; n < state_.x.size(); ++n) {
      if (model_.unknown[n] < 0) {
        state_.x[n] = model_.description.nodes[n] + share * (model_.held_at[n] - model_.description.nodes[n]);
      }
    }
  }

  /// J: strain energy less the work of the loads.
  double potential() {
    updateRotations(model_, state_, s_);
    const double strain = strainEnergy(model_, state_, s_);
    double work = 0.0;
    for (const Index n : model_.free_node) work += external(n).dot(state_.x[n] - model_.description.nodes[n]);
    rounding_ = 1e-14 * (std::abs(strain) + std::abs(work));
    return strain - work;
  }

  /// Unbalanced forces into rhs. Needs rotations. Returns their norm and sets what it is measured against.
  double residual() {
    elasticForces(model_, state_, s_);
    double square = 0.0, applied = 0.0, inner = 0.0;
    for (std::size_t i = 0; i < model_.free_node.size(); ++i) {
      const Index n = model_.free_node[i];
      const Eigen::Vector3d f = external(n), r = f + s_.force[n];
      s_.rhs.segment<3>(static_cast<Eigen::Index>(3 * i)) = r;
      square += r.squaredNorm();
      applied += f.squaredNorm();
    }
    for (const auto& c : s_.corner)
      for (const auto& f : c) inner += f.squaredNorm();
    // Prescribed displacements load it through the elements alone; 1e-3: inner forces of slender parts are
    // large beside the load that makes them.
    measure_ = std::max(std::sqrt(applied), 1e-3 * std::sqrt(inner));
    return std::sqrt(square);
  }

  bool newton(StaticReport& report) {
    double value = potential();
    double r = residual();
    int stuck = 0;
    for (int i = 0; i < kIterations; ++i) {
      if (!std::isfinite(r) || !std::isfinite(value)) return false;
      if (r <= kTolerance * measure_ + floor_) break;
      assemble(model_, state_, 0.0, 1.0, stuck > 0 ? Tangent::Projected : Tangent::Exact, s_);
      if (!s_.matrix.factorise()) {
        assemble(model_, state_, 0.0, 1.0, Tangent::Projected, s_);
        if (!s_.matrix.factorise()) return false;
      }
      const Eigen::VectorXd gradient = s_.rhs;
      s_.matrix.solve(s_.rhs.data());
      ++report.iterations;
      const Eigen::VectorXd direction = s_.rhs;
      const double slope = -gradient.dot(direction);
      const double before = value, slack = rounding_;
      bool moved = false;
      double length = 1.0, taken = 0.0;
      for (int h = 0; h < 25 && !moved; ++h, length *= 0.5) {
        move(direction, length - taken);
        taken = length;
        value = potential();
        moved = std::isfinite(value) && value <= before + 1e-4 * length * slope + slack;
      }
      if (!moved) {
        move(direction, -taken);
        value = potential();
        r = residual();
        if (++stuck > 1) break;
        continue;
      }
      const double last = r;
      r = residual();
      // At rounding level the residual no longer falls.
      if (r >= 0.5 * last && r <= 1e3 * kTolerance * measure_ + 10.0 * floor_) break;
      stuck = 0;
    }
    report.residual = r;
    report.load = measure_;
    return std::isfinite(r) && r <= kUsable * measure_ + 10.0 * floor_;
  }

 private:
  void move(const Eigen::VectorXd& direction, double length) {
    for (std::size_t i = 0; i < model_.free_node.size(); ++i) {
      state_.x[model_.free_node[i]] += length * direction.segment<3>(static_cast<Eigen::Index>(3 * i));
    }
  }

  const Model& model_;
  const Eigen::Vector3d gravity_;
  State& state_;
  Scratch& s_;
  double share_ = 1.0, measure_ = 0.0, floor_ = 0.0, rounding_ = 0.0;
};

}  // namespace

StaticReport solveStatic(const Model& model, const Eigen::Vector3d& gravity, State& state, Scratch& scratch) {
  StaticReport report;
  const State start = state;
  Problem problem(model, gravity, state, scratch);
  const bool small = model.description.strain == Strain::Small;
  for (int steps = 1; steps <= (small ? 1 : kMostLoadSteps); steps *= 4) {
    state = start;
    report.load_steps = steps;
    bool good = true;
    for (int k = 1; k <= steps && good; ++k) {
      problem.setShare(static_cast<double>(k) / steps);
      good = problem.newton(report);
    }
    if (good) {
      report.converged = true;
      break;
    }
  }
  for (auto& v : state.v) v.setZero();
  return report;
}

}  // namespace vest::fem
