#include "vest_tissue/interaction/thermal.h"

#include <algorithm>
#include <cmath>

#include "vest_tissue/base/elementary.h"

namespace vest::interaction {
namespace {

constexpr double kBoilingExcess = kBoiling - kBodyTemperature;
constexpr double kInert = 5.0;  ///< K of excess below which nothing denatures (rate below 1e-5 1/s)
constexpr double kMost = 40.0;  ///< of an Arrhenius integral: all is denatured
constexpr double kCool = 1e-9;  ///< K: what is colder counts as body temperature; booked as perfused

/// m, of layer l in a column of this shape.
double layerThickness(const ColumnShape& s, std::size_t l) {
  return s.thickness * s.share[l];
}

}  // namespace

ColumnShape columnShape(double volume, double area) {
  ColumnShape s;
  if (!(area > 0.0) || !(volume > 0.0)) return s;
  s.thickness = volume / area;
  double rest = s.thickness;
  for (std::size_t l = 0; l < kThermalLayers; ++l) {
    // A sliver of a layer would be a stiff one: it joins the layer above.
    double d = l + 1 < kThermalLayers ? std::min(kLayerThickness[l], rest) : rest;
    if (rest - d < 0.1e-3) d = rest;
    s.share[l] = d / s.thickness;
    rest -= d;
  }
  return s;
}

double denaturationRate(double kelvin) {
  if (!(kelvin > 0.0)) return 0.0;
  constexpr double kLogRate = 226.7847412249076;  // ln(3.1e98)
  return base::exponential(kLogRate - kArrheniusEnergy / (kGasConstant * kelvin));
}

double denaturedPart(double omega) {
  return omega > 0.0 ? 1.0 - base::exponential(-omega) : 0.0;
}

void deliver(HeatColumn& c, const ColumnShape& shape, const ThermalMaterial& m, double mass, double heat,
             bool deep, HeatLedger& ledger) {
  const double capacity = mass * m.heat_capacity;
  if (!(capacity > 0.0)) return;
  if (deep) {
    for (std::size_t l = 0; l < kThermalLayers; ++l)
      if (shape.share[l] > 0.0) c.excess[l] += heat / capacity;
  } else {
    c.excess[0] += heat / (capacity * shape.share[0]);
  }
  ledger.delivered += heat;
}

void stepColumn(HeatColumn& c, const ColumnShape& shape, const ThermalMaterial& m, double mass,
                double density, double dt, HeatLedger& ledger) {
  const double volume = mass / density, area = shape.thickness > 0.0 ? volume / shape.thickness : 0.0;
  std::array<double, kThermalLayers> capacity{}, sink{}, down{}, diagonal{}, right{};
  std::size_t layers = 0;
  for (; layers < kThermalLayers && shape.share[layers] > 0.0; ++layers) {
    const std::size_t l = layers;
    capacity[l] = mass * shape.share[l] * m.heat_capacity;
    // Blood no longer flows through denatured or crushed tissue.
    const double alive = (1.0 - denaturedPart(c.arrhenius[l])) * (1.0 - c.crushed);
    sink[l] = kBloodHeat * m.perfusion * volume * shape.share[l] * alive;
  }
  if (area > 0.0) {
    for (std::size_t l = 0; l + 1 < layers; ++l)
      down[l] = m.conductivity * area / (0.5 * (layerThickness(shape, l) + layerThickness(shape, l + 1)));
  }
  const double gas = kSurfaceLoss * area;
  for (std::size_t l = 0; l < layers; ++l) {
    diagonal[l] = capacity[l] + dt * (sink[l] + down[l] + (l > 0 ? down[l - 1] : gas));
    right[l] = capacity[l] * c.excess[l];
  }
  for (std::size_t l = 1; l < layers; ++l) {  // Thomas' algorithm: off-diagonals are -dt·down
    const double factor = dt * down[l - 1] / diagonal[l - 1];
    diagonal[l] -= factor * dt * down[l - 1];
    right[l] += factor * right[l - 1];
  }
  for (std::size_t l = layers; l-- > 0;) {
    const double below = l + 1 < layers ? dt * down[l] * c.excess[l + 1] : 0.0;
    c.excess[l] = (right[l] + below) / diagonal[l];
  }
  double mean = 0.0;
  for (std::size_t l = 0; l < layers; ++l) {
    ledger.perfused += dt * sink[l] * c.excess[l];
    if (l == 0) ledger.surface += dt * gas * c.excess[0];
    if (c.excess[l] > kBoilingExcess && c.dried[l] < 1.0) {
      const double water = mass * shape.share[l] * m.water;
      const double boiled =
          std::min(capacity[l] * (c.excess[l] - kBoilingExcess) / kLatentHeat, water * (1.0 - c.dried[l]));
      if (water > 0.0) c.dried[l] = std::min(1.0, c.dried[l] + boiled / water);
      c.excess[l] -= boiled * kLatentHeat / capacity[l];
      ledger.latent += boiled * kLatentHeat;
    }
    if (c.excess[l] > kInert && c.arrhenius[l] < kMost) {
      c.arrhenius[l] =
          std::min(kMost, c.arrhenius[l] + dt * denaturationRate(kBodyTemperature + c.excess[l]));
    }
    if (std::fabs(c.excess[l]) < kCool) {
      ledger.perfused += capacity[l] * c.excess[l];
      c.excess[l] = 0.0;
    }
    const double part = denaturedPart(c.arrhenius[l]);
    if (l == 0) c.surface = part;
    mean += shape.share[l] * part;
  }
  c.denatured = mean;
  const double hot = kBodyTemperature + c.excess[0] - kCharBegin;
  if (hot > 0.0)
    c.charred += (1.0 - c.charred) * std::min(1.0, dt * kCharRate * hot / (kCharFull - kCharBegin));
}

double storedHeat(const HeatColumn& c, const ColumnShape& shape, const ThermalMaterial& m, double mass) {
  double sum = 0.0;
  for (std::size_t l = 0; l < kThermalLayers; ++l)
    sum += mass * shape.share[l] * m.heat_capacity * c.excess[l];
  return sum;
}

}  // namespace vest::interaction
