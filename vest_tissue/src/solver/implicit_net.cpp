#include "vest_tissue/solver/implicit_net.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

namespace vest::solver {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using net::Block;

namespace {

constexpr std::size_t kMostVolumes = 8;  // large volumes of an object that are coupled; others act explicitly
constexpr int kSearches = 4;             // line searches after full steps that did not converge
constexpr int kHalvings = 12;            // of a step in the line search
constexpr double kDescent = 1e-4;        // share of the linear decrease that a step must reach (Armijo)
// J per metre of the last step: differences of energies below it are rounding.
constexpr double kFloatEnergy = 1.0;
// m/s: what goes far in one step keeps no more, half of what the World takes for absurd (assumed). A knot of
// a microgram that was crushed by centimetres is at rest within a step of 0.25 ms and has no speed to go on
// with.
constexpr double kFastest = 50.0;
// Shares of the greatest diagonal that are added to it: where rounding beside huge stiffness keeps the matrix
// from being factored, and for an equilibrium, whose free motions nothing else holds.
constexpr double kRidge = 1e-13, kFreeRidge = 1e-9;

double infinityNorm(const Positions& p, std::size_t n) {
  double most = 0.0;
  for (std::size_t i = 0; i < n; ++i) most = std::max(most, p[i].cwiseAbs().maxCoeff());
  return most;
}

}  // namespace

/// Inertia and drag of the step, 0 for an equilibrium.
struct ImplicitNet::Problem {
  double inertia = 0.0;  // 1/h²
  double rate = 0.0;     // 1/h
};

/// Puts pieces into the matrix, or, without one, an upper bound of them on the diagonal: x^T K x <= 2·sum of
/// the diagonal blocks for each pair.
struct ImplicitNet::Sink final : StiffnessSink {
  const KnotOrder* order = nullptr;
  Skyline* matrix = nullptr;
  double* diagonal = nullptr;
  const std::uint8_t* fixed = nullptr;

  void add(std::uint32_t i, std::uint32_t j, const Matrix3d& block) override {
    if (fixed[i] != 0 || fixed[j] != 0) return;
    if (matrix == nullptr) {
      if (i == j) diagonal[i] += 4.0 * block.trace();
      return;
    }
    const std::uint32_t a = order->rowOf(i), b = order->rowOf(j);
    if (a >= b)
      matrix->add(a, b, block);
    else
      matrix->add(b, a, block.transpose());
  }
};

ImplicitNet::ImplicitNet(const NetView& net, std::size_t knots, std::size_t edges, std::size_t entries)
    : order_(std::max(knots, net.links.block->knots()), std::max(edges, KnotOrder::edgesOf(net))),
      matrix_(0, 0) {
  const std::size_t n = std::max(knots, net.links.block->knots());
  order_.build(net);
  const std::size_t needed = Skyline::entriesOf(order_.first().data(), order_.knots());
  matrix_ = Skyline(n, std::max(entries, needed + needed / 2 + 64));
  for (Positions* p : {&x_, &x0_, &v0_, &force_, &gradient_, &step_, &trial_, &mode_, &best_})
    p->assign(n, Vector3d::Zero());
  mass_.assign(n, 0.0), drag_.assign(n, 0.0), right_.assign(3 * n, 0.0), diagonal_.assign(n, 0.0);
  fixed_.assign(n, 0);
  std::size_t large = 0;
  for (const net::Volume& v : net.elements->volumes) large += !isSmall(v);
  modes_.assign(3 * n * std::min(large, kMostVolumes), 0.0);
  usable_ = matrix_.shape(order_.first().data(), order_.knots());
}

void ImplicitNet::renew(const NetView& net) {
  usable_ = order_.build(net) && matrix_.shape(order_.first().data(), order_.knots());
}

void ImplicitNet::load(const Block& block) {
  knots_ = std::min(block.knots(), x_.size());
  const float *w = block.row(Block::kInverseMass), *m = block.row(Block::kMass),
              *d = block.row(Block::kDecay);
  for (std::size_t i = 0; i < knots_; ++i) {
    fixed_[i] = w[i] == 0.0f;
    mass_[i] = m[i];
    drag_[i] = static_cast<double>(d[i]) * m[i];
    x0_[i] = {block.row(Block::X)[i], block.row(Block::Y)[i], block.row(Block::Z)[i]};
    v0_[i] = {block.row(Block::VX)[i], block.row(Block::VY)[i], block.row(Block::VZ)[i]};
    force_[i] = {block.row(Block::FX)[i], block.row(Block::FY)[i], block.row(Block::FZ)[i]};
    if (fixed_[i] != 0) v0_[i].setZero();
  }
}

/// What the step minimises (header).
double ImplicitNet::objective(const NetView& net, const Problem& p, const Positions& x) const {
  double sum = netEnergy(net, x);
  for (std::size_t i = 0; i < knots_; ++i) {
    if (fixed_[i] != 0) continue;
    const Vector3d moved = x[i] - x0_[i];
    sum -= force_[i].dot(moved);
    if (p.inertia == 0.0) continue;
    sum += 0.5 * p.inertia * mass_[i] * (moved - v0_[i] / p.rate).squaredNorm() +
           0.5 * p.rate * drag_[i] * moved.squaredNorm();
  }
  if (p.inertia == 0.0) return sum;
  const auto along = [&](std::uint32_t i, std::uint32_t j, double damping) {
    if (damping == 0.0) return;
    const Vector3d d = x0_[j] - x0_[i], r = (x[j] - x0_[j]) - (x[i] - x0_[i]);
    const double on = d.dot(r);
    sum += 0.5 * p.rate * damping * on * on / std::max(d.squaredNorm(), 1e-24);
  };
  for (std::size_t n = 0; n < net.links.count; ++n) {
    const net::KernelLink& l = net.links.link(n);
    along(l.knot0, l.knot1, l.damping);
  }
  for (const net::Plastic& q : net.elements->plastic) along(q.a, q.b, q.damping);
  for (const net::Tether& t : net.elements->tethers)
    sum += 0.5 * p.rate * t.damping * (x[t.knot] - x0_[t.knot]).squaredNorm();
  return sum;
}

/// Newton's direction at x_ into step_; gradient_ holds dE/dx, right_ the negative gradient of the objective.
void ImplicitNet::direction(const NetView& net, const Problem& p) {
  std::fill(gradient_.begin(), gradient_.end(), Vector3d::Zero());
  addNetGradient(net, x_, gradient_);
  Sink sink;
  sink.order = &order_, sink.fixed = fixed_.data(), sink.diagonal = diagonal_.data();
  sink.matrix = usable_ ? &matrix_ : nullptr;
  if (usable_) matrix_.clear();
  std::fill(diagonal_.begin(), diagonal_.end(), 0.0);
  addNetStiffness(net, x_, sink);
  if (p.inertia > 0.0) addNetDamping(net, x0_, p.rate, sink);
  double greatest = 0.0;
  for (std::size_t i = 0; i < knots_; ++i) {
    // The objective's gradient: inner forces, held forces, inertia, drag; dampers follow below.
    Vector3d g = gradient_[i] - force_[i];
    double own = 0.0;
    if (p.inertia > 0.0) {
      const Vector3d moved = x_[i] - x0_[i];
      g += p.inertia * mass_[i] * (moved - v0_[i] / p.rate) + p.rate * drag_[i] * moved;
      own = p.inertia * mass_[i] + p.rate * drag_[i];
    }
    trial_[i] = g;
    greatest = std::max(greatest, own);
    diagonal_[i] += own;
    if (usable_ && fixed_[i] == 0) matrix_.add(order_.rowOf(i), order_.rowOf(i), own * Matrix3d::Identity());
    if (usable_ && fixed_[i] != 0) matrix_.add(order_.rowOf(i), order_.rowOf(i), Matrix3d::Identity());
  }
  if (p.inertia > 0.0) {
    const auto along = [&](std::uint32_t i, std::uint32_t j, double damping) {
      if (damping == 0.0) return;
      const Vector3d d = x0_[j] - x0_[i], r = (x_[j] - x0_[j]) - (x_[i] - x0_[i]);
      const Vector3d f = (p.rate * damping * d.dot(r) / std::max(d.squaredNorm(), 1e-24)) * d;
      trial_[j] += f;
      trial_[i] -= f;
    };
    for (std::size_t n = 0; n < net.links.count; ++n) {
      const net::KernelLink& l = net.links.link(n);
      along(l.knot0, l.knot1, l.damping);
    }
    for (const net::Plastic& q : net.elements->plastic) along(q.a, q.b, q.damping);
    for (const net::Tether& t : net.elements->tethers)
      trial_[t.knot] += p.rate * t.damping * (x_[t.knot] - x0_[t.knot]);
  }
  for (std::size_t i = 0; i < knots_; ++i)
    if (fixed_[i] != 0) trial_[i].setZero();
  if (!usable_) {
    for (std::size_t i = 0; i < knots_; ++i)
      step_[i] =
          fixed_[i] != 0 || !(diagonal_[i] > 0.0) ? Vector3d::Zero() : Vector3d(-trial_[i] / diagonal_[i]);
    return;
  }
  // Free motions of an equilibrium, and rounding beside huge stiffness: a ridge, greater until it factors.
  double trace = 0.0;
  {
    struct Trace final : StiffnessSink {
      double most = 0.0;
      void add(std::uint32_t i, std::uint32_t j, const Matrix3d& b) override {
        if (i == j) most = std::max(most, b.trace());
      }
    } look;
    addNetStiffness(net, x_, look);
    trace = std::max(look.most, greatest);
  }
  double ridge = (p.inertia > 0.0 ? kRidge : kFreeRidge) * trace;
  for (int attempt = 0; attempt < 6; ++attempt, ridge = std::max(100.0 * ridge, 1e-300)) {
    if (attempt > 0) {
      matrix_.clear();
      addNetStiffness(net, x_, sink);
      if (p.inertia > 0.0) addNetDamping(net, x0_, p.rate, sink);
    }
    for (std::size_t i = 0; i < knots_; ++i) {
      const double own =
          attempt > 0 ? (fixed_[i] != 0 ? 1.0 : p.inertia * mass_[i] + p.rate * drag_[i]) : 0.0;
      const bool needed = p.inertia == 0.0 || attempt > 0;
      matrix_.add(order_.rowOf(i), order_.rowOf(i), (own + (needed ? ridge : 0.0)) * Matrix3d::Identity());
    }
    if (!matrix_.factor()) continue;
    for (std::size_t i = 0; i < knots_; ++i)
      for (int a = 0; a < 3; ++a) right_[3 * order_.rowOf(i) + a] = -trial_[i][a];
    matrix_.solve(right_.data());
    if (!solveVolumes(net)) continue;
    bool finite = true;
    for (std::size_t i = 0; i < knots_; ++i) {
      for (int a = 0; a < 3; ++a) step_[i][a] = right_[3 * order_.rowOf(i) + a];
      finite = finite && step_[i].allFinite();
    }
    if (finite) return;
  }
  std::fill(step_.begin(), step_.end(), Vector3d::Zero());
}

/// Adds the volumes' stiffness scale·g·g^T to the solution in right_, one after another (Sherman and Morrison
/// 1950): the k-th uses the inverse that has the k-1 before it.
bool ImplicitNet::solveVolumes(const NetView& net) {
  const std::size_t n3 = 3 * knots_;
  struct Mode {
    std::size_t volume;
    double scale, bottom;
  };
  Mode known[kMostVolumes];
  std::size_t count = 0;
  const auto dotMode = [&](const double* a) {
    double sum = 0.0;
    for (std::size_t i = 0; i < knots_; ++i)
      for (int axis = 0; axis < 3; ++axis) sum += mode_[i][axis] * a[3 * order_.rowOf(i) + axis];
    return sum;
  };
  const auto fill = [&](std::size_t volume) {
    const double scale = volumeMode(net, volume, x_, mode_);
    for (std::size_t i = 0; i < knots_; ++i)
      if (fixed_[i] != 0) mode_[i].setZero();
    return scale;
  };
  for (std::size_t v = 0; v < net.elements->volumes.size() && count < kMostVolumes; ++v) {
    if (isSmall(net.elements->volumes[v]) || (count + 1) * n3 > modes_.size()) continue;
    Mode& own = known[count];
    own.volume = v;
    own.scale = fill(v);
    if (own.scale == 0.0) continue;
    double* const z = modes_.data() + count * n3;
    for (std::size_t i = 0; i < knots_; ++i)
      for (int axis = 0; axis < 3; ++axis) z[3 * order_.rowOf(i) + axis] = mode_[i][axis];
    matrix_.solve(z);
    for (std::size_t m = 0; m < count; ++m) {
      fill(known[m].volume);
      const double share = known[m].scale * dotMode(z) / known[m].bottom;
      for (std::size_t r = 0; r < n3; ++r) z[r] -= share * modes_[m * n3 + r];
    }
    fill(v);
    own.bottom = 1.0 + own.scale * dotMode(z);
    const double share = own.scale * dotMode(right_.data()) / own.bottom;
    for (std::size_t r = 0; r < n3; ++r) right_[r] -= share * z[r];
    ++count;
  }
  return true;
}

/// Full Newton steps first. Where stiff parts turn, each lengthens them a little, which the next one
/// corrects: a line search would stop at that. It is asked only from the best place if they do not converge.
ImplicitNet::Report ImplicitNet::minimise(const NetView& net, Problem& p, const Options& o) {
  Report report;
  report.degraded = !usable_;
  double best = objective(net, p, x_);
  std::copy(x_.begin(), x_.end(), best_.begin());
  for (; usable_ && report.iterations < o.iterations && !report.converged; ++report.iterations) {
    direction(net, p);
    const double moved = infinityNorm(step_, knots_);
    for (std::size_t i = 0; i < knots_; ++i) x_[i] += step_[i];
    const double value = objective(net, p, x_);
    if (!std::isfinite(value)) break;
    // The first step takes out what rounding to float put into stiff links; its tension holds back the rest.
    report.converged = report.iterations > 0 && moved <= o.tolerance &&
                       value <= best + 1e-6 * std::fabs(best) + kFloatEnergy * moved;
    if (value < best || report.converged) {
      best = value;
      std::copy(x_.begin(), x_.end(), best_.begin());
    }
  }
  std::copy(best_.begin(), best_.end(), x_.begin());
  for (int search = 0; search < kSearches && !report.converged; ++search, ++report.iterations) {
    direction(net, p);
    double slope = 0.0;
    for (std::size_t i = 0; i < knots_; ++i) slope += trial_[i].dot(step_[i]);
    if (!(slope < 0.0)) break;
    double length = 1.0;
    bool better = false;
    for (int halving = 0; halving < kHalvings && !better; ++halving, length *= 0.5) {
      for (std::size_t i = 0; i < knots_; ++i) trial_[i] = x_[i] + length * step_[i];
      const double next = objective(net, p, trial_);
      better = next <= best + kDescent * length * slope;
      if (better) best = next;
    }
    if (!better) break;
    std::copy(trial_.begin(), trial_.end(), x_.begin());
    report.converged = infinityNorm(step_, knots_) * 2.0 * length <= o.tolerance;
  }
  std::fill(gradient_.begin(), gradient_.end(), Vector3d::Zero());
  addNetGradient(net, x_, gradient_);
  return report;
}

ImplicitNet::Report ImplicitNet::step(const NetView& net, Block& block, double h, const Options& o) {
  load(block);
  Problem p{1.0 / (h * h), 1.0 / h};
  double before = netEnergy(net, x0_);
  for (std::size_t i = 0; i < knots_; ++i) {
    if (fixed_[i] == 0) before += 0.5 * mass_[i] * v0_[i].squaredNorm();
    x_[i] = x0_[i] + h * v0_[i];
    trial_[i] = x0_[i];
  }
  // Start where the objective is lower: at rest or carried on.
  if (!(objective(net, p, x_) < objective(net, p, trial_))) std::copy(x0_.begin(), x0_.end(), x_.begin());
  Report report = minimise(net, p, o);
  double kinetic = 0.0, work = 0.0, furthest = 0.0;
  for (std::size_t i = 0; i < knots_; ++i) {
    if (fixed_[i] != 0) continue;
    kinetic += 0.5 * mass_[i] * ((x_[i] - x0_[i]) / h).squaredNorm();
    furthest = std::max(furthest, (x_[i] - x0_[i]).norm());
    work += force_[i].dot(x_[i] - x0_[i]);
  }
  const double allowed = std::max(0.0, before + work - netEnergy(net, x_));
  double scale = 1.0;
  if (kinetic > allowed) {
    scale = std::sqrt(allowed / kinetic);
    report.bounded = true;
  }
  if (scale * furthest > kFastest * h) {
    scale = kFastest * h / furthest;
    report.bounded = true;
  }
  report.dissipated = allowed - scale * scale * kinetic;
  for (std::size_t i = 0; i < knots_; ++i) {
    if (fixed_[i] != 0) {
      block.row(Block::FX)[i] -= static_cast<float>(gradient_[i].x());
      block.row(Block::FY)[i] -= static_cast<float>(gradient_[i].y());
      block.row(Block::FZ)[i] -= static_cast<float>(gradient_[i].z());
      continue;
    }
    const Vector3d v = (scale / h) * (x_[i] - x0_[i]);
    for (int a = 0; a < 3; ++a) {
      block.row(static_cast<Block::KnotRow>(Block::X + a))[i] = static_cast<float>(x_[i][a]);
      block.row(static_cast<Block::KnotRow>(Block::VX + a))[i] = static_cast<float>(v[a]);
    }
  }
  return report;
}

void ImplicitNet::respond(const NetView& net, const Positions& x, const Positions& forces, Positions& u) {
  load(*net.links.block);
  for (std::size_t i = 0; i < knots_; ++i) x_[i] = x0_[i] = x[i], force_[i] = forces[i];
  const Problem p;
  direction(net, p);
  u.assign(step_.begin(), step_.begin() + static_cast<std::ptrdiff_t>(knots_));
  // Without the forces: what the net would do anyhow, mostly rounding.
  std::fill(force_.begin(), force_.end(), Vector3d::Zero());
  direction(net, p);
  for (std::size_t i = 0; i < knots_; ++i) u[i] -= step_[i];
}

ImplicitNet::Report ImplicitNet::settle(const NetView& net, Positions& x, const Positions& forces,
                                        const Options& o) {
  load(*net.links.block);
  for (std::size_t i = 0; i < knots_; ++i) x_[i] = x0_[i] = x[i], force_[i] = forces[i];
  Problem p;
  const Report report = minimise(net, p, o);
  for (std::size_t i = 0; i < knots_; ++i) x[i] = x_[i];
  return report;
}

ImplicitNet::Report ImplicitNet::settle(const NetView& net, Block& block, const Options& o) {
  load(block);
  std::copy(x0_.begin(), x0_.end(), x_.begin());
  Problem p;
  const Report report = minimise(net, p, o);
  for (std::size_t i = 0; i < knots_; ++i) {
    for (int a = 0; a < 3; ++a) {
      block.row(static_cast<Block::KnotRow>(Block::VX + a))[i] = 0.0f;
      if (fixed_[i] == 0)
        block.row(static_cast<Block::KnotRow>(Block::X + a))[i] = static_cast<float>(x_[i][a]);
    }
  }
  return report;
}

}  // namespace vest::solver
