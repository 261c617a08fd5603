#include "vest_effects/gas/gas.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "vest_effects/state_bytes.h"
#include "vest_effects/vapour.h"

namespace vest::gas {
namespace {

constexpr double kGasConstant = 8.314462618;                   ///< J/(mol K), CODATA 2018
constexpr double kAir = 101325;                                ///< Pa, standard atmosphere
constexpr double kCounted = kAir / (8.314462618 * 294.15);     ///< mol/m³ of gas as people count it
constexpr double kCarbonDioxide = 0.04401, kWater = 0.018015;  ///< kg/mol
constexpr double kWaterDensity = 993;                          ///< kg/m³ at 37 °C
constexpr double kMolarHeat = 37.5;  ///< J/(mol K) of carbon dioxide at 37 °C and constant pressure
constexpr double kLewis = 0.897;     ///< Le^⅔ for Le = 0.85
constexpr double kBand = 267;        ///< Pa: 2 mmHg over which the insufflator throttles; assumed
constexpr double kDischarge = 0.6;   ///< of a sharp orifice
constexpr double kLeast = 0.02;      ///< of the slack volume: suction leaves that much

/// Pa and m³ from (p_air + p)(V_slack + C p) = N R T; without overpressure the wall lies on the gas.
void balance(const Parameters& p, double mol, double kelvin, double& pressure, double& volume) {
  const double work = mol * kGasConstant * kelvin;
  const double excess = work - p.slack_volume * kAir;
  if (excess <= 0) {
    pressure = 0, volume = work / kAir;
    return;
  }
  const double b = p.slack_volume + p.compliance * kAir;
  pressure = 2 * excess / (b + std::sqrt(b * b + 4 * p.compliance * excess));
  volume = p.slack_volume + p.compliance * pressure;
}

/// mol/m³ of water over a wet wall.
double saturated(double kelvin) {
  return effects::saturationPressure(kelvin) / (kGasConstant * kelvin);
}

/// m/s: gas that meets the wall, of `mol` in m³. Heat transfer over the gas' heat by volume, times Lewis'
/// factor.
double exchange(const Parameters& p, double mol, double volume) {
  return p.heat_transfer * volume / (kMolarHeat * mol * kLewis);
}

}  // namespace

void check(const Parameters& parameters) {
  eachNumber(parameters, [](const char* field, double value, double low, double high) {
    if (value >= low && value <= high) return;
    throw std::invalid_argument(std::string("gas: ") + field + ": " + std::to_string(value) +
                                " (allowed: " + std::to_string(low) + " to " + std::to_string(high) + ")");
  });
}

State initialState(const Parameters& p) {
  State s;
  s.temperature = p.wall_temperature;
  const double volume = p.slack_volume + p.compliance * p.set_pressure;
  s.vapour = saturated(s.temperature) * volume;
  s.gas = (kAir + p.set_pressure) * volume / (kGasConstant * s.temperature) - s.vapour;
  return s;
}

Condition condition(const Parameters& p, const State& s) {
  Condition c;
  balance(p, s.gas + s.vapour, s.temperature, c.pressure, c.volume);
  c.sunk =
      2 * std::max(0.0, p.slack_volume + p.compliance * p.set_pressure - c.volume) / (kRoof * p.wall_area);
  c.temperature = s.temperature;
  c.humidity = std::min(1.0, s.vapour / (saturated(s.temperature) * c.volume));
  c.flow = p.max_flow * std::clamp((p.set_pressure - c.pressure) / kBand, 0.0, 1.0);
  const double density = (s.gas * kCarbonDioxide + s.vapour * kWater) / c.volume;
  const double out = kDischarge * p.leak_area * std::sqrt(2 * c.pressure / density);  // m³/s as it is there
  c.leak = out * s.gas / (c.volume * kCounted);
  c.renewal = std::min(10.0, out / c.volume + p.absorption * kCounted / s.gas);
  c.drying = std::max(0.0, saturated(p.wall_temperature) - s.vapour / c.volume) *
             exchange(p, s.gas, c.volume) * kWater / kWaterDensity;
  return c;
}

double counted(double mol) {
  return mol / kCounted;
}

Status step(const Parameters& p, const Inputs& in, State& s) {
  if (!(in.dt >= 1e-4 && in.dt <= 0.1) || !(in.suction >= 0 && in.suction <= 0.01)) return Status::BadInput;
  const Condition c = condition(p, s);
  // What leaves takes vapour with it; leaks end at the air's pressure, suction where hardly any gas is left.
  const double spare = std::max(0.0, 1 - p.slack_volume * kAir / ((kAir + c.pressure) * c.volume));
  const double leak = std::min(spare, in.dt * c.leak * kCounted / s.gas);
  const double left = std::max(0.0, 1 - leak - kLeast * p.slack_volume / c.volume);
  const double suck = std::min(left, in.dt * in.suction / c.volume);
  const double absorbed = std::min(std::max(0.0, left - suck) * s.gas, in.dt * p.absorption * kCounted);
  const double supplied = in.dt * c.flow * kCounted;
  s.leaked += leak * s.gas, s.drawn += suck * s.gas, s.absorbed += absorbed, s.supplied += supplied;
  const double before = s.gas;
  s.gas += supplied - absorbed - (leak + suck) * s.gas;
  s.vapour -= (leak + suck) * s.vapour;
  // The wall warms and moistens what is there, implicitly; cold dry gas mixes in.
  const double heated = in.dt * p.heat_transfer * p.wall_area / (kMolarHeat * s.gas);
  const double mixed = supplied / std::max(before, s.gas);
  s.temperature =
      (s.temperature + heated * p.wall_temperature + mixed * p.supply_temperature) / (1 + heated + mixed);
  double pressure, volume;
  balance(p, s.gas + s.vapour, s.temperature, pressure, volume);
  const double moistened = in.dt * p.wall_area * exchange(p, s.gas, volume) / volume;
  s.vapour = (s.vapour + moistened * saturated(p.wall_temperature) * volume) / (1 + moistened);
  s.vapour = std::min(s.vapour, saturated(s.temperature) * volume);  // the rest is mist on the wall
  ++s.step;
  return Status::Ok;
}

namespace {
template <class Archive, class S>
void walk(Archive& archive, S& s) {
  archive(s.step), archive(s.gas), archive(s.vapour), archive(s.temperature);
  archive(s.supplied), archive(s.leaked), archive(s.absorbed), archive(s.drawn);
}
}  // namespace

void save(const State& state, std::vector<std::uint8_t>& bytes) {
  effects::StateWriter writer(bytes);
  walk(writer, state);
}

bool restore(const std::uint8_t* bytes, std::size_t size, State& state) {
  State read;
  effects::StateReader reader(bytes, size);
  walk(reader, read);
  if (!reader.done() || !(read.gas > 1e-6 && read.gas < 100) || !(read.vapour >= 0 && read.vapour < 100) ||
      !(read.temperature > 200 && read.temperature < 400))
    return false;
  state = read;
  return true;
}

}  // namespace vest::gas
