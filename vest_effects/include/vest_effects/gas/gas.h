#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

/// The pneumoperitoneum: one well-mixed volume of carbon dioxide and water vapour between an elastic wall, an
/// insufflator, leaks and suction. Pressures are above the theatre's air; volumes of gas that people read
/// (flows, litres used) are counted as insufflators count them, dry at 101,325 Pa and 21 °C.
namespace vest::gas {

struct Parameters {
  double set_pressure = 1600;  ///< Pa: 12 mmHg, 0 … 4000. Guidelines ask for 12 to 14 (Neudecker et al. 2002,
                               ///< Surg. Endosc. 16:1121)
  double max_flow = 3.33e-4;   ///< m³/s of the insufflator: 20 l/min, 0 (off) … 1e-3; assumed
  double leak_area = 6.5e-7;   ///< m² of all leaks together: 1 l/min at 12 mmHg, 0 … 1e-4; assumed
  double compliance = 2.2e-6;  ///< m³/Pa of the wall: 0.3 l/mmHg, 1e-7 … 1e-4; assumed
  double slack_volume = 5e-4;  ///< m³ that lift no wall, 1e-5 … 1e-2; assumed: 4 l in all at 12 mmHg
  double absorption = 7e-7;    ///< m³/s into the blood: 42 ml/min (Tan, Lee and Tweed 1992, Can. J. Anaesth.
                               ///< 39:677, pelvic laparoscopy), 0 … 1e-5
  double wall_area = 0.15;     ///< m² that warms and moistens the gas, 0.01 … 2; assumed
  double heat_transfer = 5;    ///< W/(m²K) at the wall: still gas, 1 … 100; assumed
  double wall_temperature = 310.15;    ///< K, 273 … 330
  double supply_temperature = 294.15;  ///< K of the dry gas from the insufflator, 250 … 330
};

/// Everything that evolves. A copy is a snapshot.
struct State {
  std::uint64_t step = 0;
  double gas = 0;          ///< mol of carbon dioxide
  double vapour = 0;       ///< mol of water
  double temperature = 0;  ///< K
  // Carbon dioxide since the start, mol: supplied = change of `gas` + leaked + absorbed + drawn.
  double supplied = 0, leaked = 0, absorbed = 0, drawn = 0;
};

struct Inputs {
  double dt = 0.02;    ///< s, 1e-4 … 0.1
  double suction = 0;  ///< m³/s of the cavity's gas that suction draws, 0 … 0.01
};

/// What the gas does now; follows from Parameters and State.
struct Condition {
  double pressure = 0;  ///< Pa above the air outside
  double volume = 0;    ///< m³
  /// m: how far the highest place of the wall lies below where it is at the set pressure. What is missing of
  /// the volume is that under a paraboloid, as a membrane hangs: 2ΔV/S, over S = kRoof · wall_area.
  double sunk = 0;
  double flow = 0;         ///< m³/s from the insufflator
  double leak = 0;         ///< m³/s
  double humidity = 0;     ///< relative, 0 … 1
  double temperature = 0;  ///< K
  double renewal = 0;      ///< 1/s: share of the gas that leaves by leaks and absorption
  double drying = 0;       ///< m/s of water that leaves a wet wall, ≥ 0
};

/// Share of the wall that is lifted: front and sides; the rest lies on the spine (assumed).
constexpr double kRoof = 2.0 / 3;

enum class Status : std::uint8_t { Ok = 0, BadInput = 1 };

/// Each number of the parameters by its name, with what is allowed.
/// @param number called as number(name, double& value, lowest, highest)
template <class P, class Number>
void eachNumber(P& p, Number&& number) {
  number("set_pressure", p.set_pressure, 0, 4000);
  number("max_flow", p.max_flow, 0, 1e-3);
  number("leak_area", p.leak_area, 0, 1e-4);
  number("compliance", p.compliance, 1e-7, 1e-4);
  number("slack_volume", p.slack_volume, 1e-5, 1e-2);
  number("absorption", p.absorption, 0, 1e-5);
  number("wall_area", p.wall_area, 0.01, 2);
  number("heat_transfer", p.heat_transfer, 1, 100);
  number("wall_temperature", p.wall_temperature, 273, 330);
  number("supply_temperature", p.supply_temperature, 250, 330);
}

/// @throws std::invalid_argument naming field, value and what is allowed
void check(const Parameters& parameters);
/// Filled to the set pressure, warm and saturated.
State initialState(const Parameters& parameters);
/// One step. Ideal gas in a wall with V = slack_volume + compliance·p; below p = 0 the wall falls in and no
/// gas leaks. Leak: orifice, 0.6·leak_area·sqrt(2p/rho). Insufflator: proportional within 2 mmHg below
/// the set pressure (assumed). Vapour follows the wall's warmth by Chilton and Colburn (1934) with Lewis
/// number 0.85, as in lens.h; so does what a wet surface loses (Condition::drying). Allocates and throws
/// nothing; no libm but sqrt. After BadInput the State is what it was.
Status step(const Parameters& parameters, const Inputs& inputs, State& state);
Condition condition(const Parameters& parameters, const State& state);
/// m³ as insufflators count them, of an amount (mol).
double counted(double mol);

void save(const State& state, std::vector<std::uint8_t>& bytes);
/// False, and the State is what it was, where the bytes are none of save().
bool restore(const std::uint8_t* bytes, std::size_t size, State& state);

}  // namespace vest::gas
