#pragma once

#include <cstdint>
#include <vector>

#include "vest_tissue/solver/net_energy.h"
#include "vest_tissue/solver/skyline.h"

namespace vest::solver {

/// Which knots belong together, as block rows of a matrix of small envelope: reverse Cuthill-McKee order
/// (George 1971; Liu and Sherman 1976, doi:10.1137/0713020). Only the constructor allocates.
class KnotOrder {
 public:
  KnotOrder(std::size_t knots, std::size_t edges);
  /// False if the net has more knots or couplings than the room given. Fixed knots are coupled to none.
  bool build(const NetView& net);
  std::size_t knots() const { return knots_; }
  std::uint32_t rowOf(std::uint32_t knot) const { return row_[knot]; }
  const std::vector<std::uint32_t>& first() const { return first_; }  ///< per row: least coupled row
  /// Couplings that a net has, each counted both ways, with repetitions: what `edges` has to cover.
  static std::size_t edgesOf(const NetView& net);

 private:
  std::vector<std::uint32_t> start_, fill_, neighbours_, row_, order_, first_;
  std::vector<std::uint8_t> seen_;
  std::size_t knots_ = 0;
};

/// One object's implicit step and equilibrium: what the explicit sub-steps cannot hold (stiffness over mass
/// beyond 64 sub-steps a millisecond) is stepped by backward Euler, in double:
///
///   minimise over x   sum_i m_i/(2h²)·|x_i - x0_i - h·v0_i|² + gamma_i/(2h)·|x_i - x0_i|²
///                     + (x-x0)^T C(x0) (x-x0)/(2h) + E(x) - f·x,            v = (x - x0)/h
///
/// by Newton's method, full steps first, then a line search (Kane et al. 2000,
/// doi:10.1002/1097-0207(20001210)49:10<1295::AID- NME993>3.0.CO;2-W, for the variational form). Afterwards,
/// kinetic plus potential energy may be no more than before plus the work of f; if it is, the speed is
/// lowered to that. So the motion is bounded at any stiffness, mass and step, and the equilibrium is that of
/// E and f. Only the constructor allocates.
class ImplicitNet {
 public:
  struct Options {
    int iterations = 8;       ///< Newton, at most
    double tolerance = 1e-8;  ///< m: done when no knot moves further in an iteration
  };
  struct Report {
    int iterations = 0;
    bool converged = false;
    bool bounded = false;     ///< the energy bound, or that of speed (50 m/s), had to lower the speed
    bool degraded = false;    ///< no room for the matrix: diagonal steps instead, more damping
    double dissipated = 0.0;  ///< J, kinetic + potential energy before plus work, minus after
  };

  /// @param net as it is now; @param knots, edges, entries: room for what cuts may add (entries 0: half as
  /// much again)
  ImplicitNet(const NetView& net, std::size_t knots, std::size_t edges = 0, std::size_t entries = 0);

  /// Rebuilds the order after a change of the topology. Real-time safe.
  void renew(const NetView& net);

  /// One step of h (s) from the block's positions and velocities; writes them back. Held forces: rows FX, FY,
  /// FZ of the block (N). Fixed knots stay; what pulls at them is added to their row of forces.
  Report step(const NetView& net, net::Block& block, double h, const Options& options);
  /// Equilibrium under the forces in FX, FY, FZ; velocities become zero.
  Report settle(const NetView& net, net::Block& block, const Options& options);
  /// The same in double, for tests and tools: positions in and out, forces and fixed knots by the block.
  Report settle(const NetView& net, Positions& x, const Positions& forces, const Options& options);

  /// Small displacements u (m) by which further forces (N) move the net from x: one linear solve. Free rigid
  /// motions are held by a ridge of 1e-9 of the greatest stiffness: forces without any must balance.
  void respond(const NetView& net, const Positions& x, const Positions& forces, Positions& u);

  /// dE/dx at the end of the last call, N.
  const Positions& gradient() const { return gradient_; }

 private:
  struct Problem;
  struct Sink;
  Report minimise(const NetView& net, Problem& p, const Options& options);
  double objective(const NetView& net, const Problem& p, const Positions& x) const;
  void direction(const NetView& net, const Problem& p);
  bool solveVolumes(const NetView& net);
  void load(const net::Block& block);

  KnotOrder order_;
  Skyline matrix_;
  bool usable_ = false;
  Positions x_, x0_, v0_, force_, gradient_, step_, trial_, mode_, best_;
  std::vector<double> mass_, drag_, right_, modes_, diagonal_;
  std::vector<std::uint8_t> fixed_;
  std::size_t knots_ = 0;
};

}  // namespace vest::solver
