#pragma once

#include <array>
#include <vector>

#include "vest_effects/haemodynamics/model.h"

namespace vest::haemodynamics {

/// A hole in a vessel's wall (a cut, a puncture). Leak by the orifice equation
/// Q = discharge·area·sqrt(2 (P − external_pressure)/rho), in both directions unless `outward_only`.
struct Hole {
  int segment = 0;
  double station = 0;            ///< m from the proximal end
  double area = 0;               ///< m², of the hole itself
  double discharge = 0.6;        ///< no unit; 0.6 is the sharp-edged orifice of hydraulics textbooks
  double external_pressure = 0;  ///< Pa
  bool outward_only = false;     ///< a soft vessel that lets no air in
};

/// A narrowing at a station (clip, ligature, coagulation, a jaw that pinches). Pressure loss
/// 1.52·(rho/2)·(1/opening − 1)²·U² (turbulent term of Young and Tsai 1973, J. Biomech. 6, 395–410);
/// opening 0 is a wall on which both sides reflect.
struct Closure {
  int segment = 0;
  double station = 0;  ///< m from the proximal end
  double opening = 1;  ///< open share of the area, 0 … 1
};

constexpr int kMostHoles = 64;
constexpr int kMostClosures = 64;

/// What a step is told from outside. Plain data of fixed size: a copy can be recorded.
struct Inputs {
  double heart_rate_scale = 1;         ///< speed at which the inflow curve is run through, ≥ 0
  double flow_scale = 1;               ///< factor on the inflow
  double resistance_scale = 1;         ///< factor on R1 and R2 of all terminals, > 0
  double outflow_pressure_offset = 0;  ///< Pa, added to every P_out
  int hole_count = 0;
  std::array<Hole, kMostHoles> holes{};
  int closure_count = 0;
  std::array<Closure, kMostClosures> closures{};
};

/// Everything that evolves. A copy is a snapshot.
struct State {
  double time = 0;                          ///< s since the start
  double phase = 0;                         ///< s within the inflow curve, [0, period)
  std::vector<double> area;                 ///< m², per cell
  std::vector<double> velocity;             ///< m/s, per cell, positive towards distal
  std::vector<double> windkessel_pressure;  ///< Pa over C, per node (terminals)
  std::vector<double>
      node_volume;  ///< m³ that came in through each node since the start (terminals: negative)
  std::vector<double> leak_volume;             ///< m³ lost through holes, per segment, since the start
  std::array<double, kMostHoles> hole_flow{};  ///< m³/s through each hole, mean of the last step
};

enum class Status {
  kOk,
  kBadInput,         ///< an input out of range; nothing was done
  kTooManySubsteps,  ///< more than kMostSubsteps, or shorter ones than kLeastSubstep, would be needed
  kNotConverged,     ///< a node's equations have no solution near by
  kSupercritical,    ///< |U| reached the wave speed: outside the model
  kNotFinite         ///< a number is no number, or an area is not positive
};
const char* toText(Status status);

constexpr int kMostSubsteps = 1'000'000;
/// s: a network that needs shorter ones would run for hours without a word; arteries in cells of 0.1 mm need
/// twenty times as long ones (assumed).
constexpr double kLeastSubstep = 5e-8;

struct StepReport {
  Status status = Status::kOk;
  int substeps = 0;
  int segment = -1;  ///< where it went wrong, -1 if not known
};

/// Work space, sized once; also fixes the number of threads. Holds nothing that matters between steps.
struct Scratch {
  Scratch(const Model& model, int threads = 1);
  int threads;
  std::vector<int> segment_range, node_range;            ///< parts for the threads, threads + 1 bounds each
  std::vector<double> pressure, inv_area;                ///< per cell: P − P_ref; 1/A
  std::vector<double> p_left, u_left, p_right, u_right;  ///< per cell: at its faces, half a step ahead
  std::vector<double> flux_area, flux_velocity;          ///< per face: A U; U²/2 + (P − P_ref)/rho
  std::vector<double> speeds;                            ///< per face: |U| + c, m/s
  std::vector<double> node_pressure_p, node_velocity;  ///< per face at nodes: solution there, P − P_ref and U
  std::vector<double> rate;                            ///< per part: greatest (|U| + c)/dx, 1/s
  std::vector<int> failed_segment;  ///< per part: segment of a node that did not converge, or -1
  std::array<double, kMostClosures> closure_jump{};  ///< right minus left velocity flux
  State backup;
};

/// Start: U = 0, P = P_ref everywhere, windkessels at the pressure of their segment (so that nothing flows in
/// them).
State initialState(const Model& model);

/// Sets the pressure of the whole network (Pa) and stops the flow: the state of rest.
void setUniformPressure(const Model& model, double pressure, State& state);

/// Advances by dt seconds, in as many equal sub-steps as the Courant number 0.9 asks for.
///
/// Second order in space and time: MUSCL–Hancock (van Leer 1984, SIAM J. Sci. Stat. Comput. 5, 1–20) on
/// pressure and velocity, so that a network at rest stays at rest whatever its taper; linearised
/// characteristic flux; friction by the trapezoidal rule; nodes by the Riemann invariants U ± 4c with mass
/// and total pressure, Newton with a bounded count; windkessels implicit. Allocates nothing with one thread,
/// throws nothing; the same bits for any number of threads. On any status but kOk the state is what it was
/// before.
StepReport step(const Model& model, const Inputs& inputs, double dt, State& state, Scratch& scratch);

/// What is read off a network at one instant.
struct Sample {
  double pressure = 0;  ///< Pa
  double flow = 0;      ///< m³/s
  double area = 0;      ///< m²
};
struct SegmentSample {
  Sample proximal, middle, distal;  ///< at 0, length/2, length
};

/// Samples every segment at this instant; ends come from the nodes' equations, so flows at a node sum to
/// zero. `out` must hold one entry per segment. False if a node's equations were not solved.
bool sample(const Model& model, const Inputs& inputs, const State& state, Scratch& scratch,
            std::vector<SegmentSample>& out);

/// Volume of blood in the segments, m³.
double volume(const Model& model, const State& state);

}  // namespace vest::haemodynamics
