#pragma once

#include <array>
#include <cstddef>

/// Heat in one knot's column of tissue: from the touched surface downwards in layers (docs/decisions/0020-…).
/// Stateless functions over one column; how columns exchange heat along the net is in heat.h.
///
///   touched surface  ┌────────┐ layer 0: 0.4 mm   electrode's power, loss to the gas
///                    ├────────┤ layer 1: 0.8 mm
///                    ├────────┤ layer 2: 1.6 mm
///                    │        │ layer 3: the rest of what the knot stands for
///                    └────────┘
namespace vest::interaction {

inline constexpr std::size_t kThermalLayers = 4;
inline constexpr std::array<double, 3> kLayerThickness{0.4e-3, 0.8e-3, 1.6e-3};  ///< m; assumed

inline constexpr double kBodyTemperature = 310.15;  ///< K: 37 °C, of tissue at rest, blood and gas
/// Blood: density and heat capacity, J/(m³·K): 1050 kg/m³ · 3617 J/(kg·K), McIntosh & Anderson 2010,
/// doi:10.1142/S1793048010001184.
inline constexpr double kBloodHeat = 1050.0 * 3617.0;
inline constexpr double kSurfaceLoss = 10.0;  ///< W/(m²·K) to the gas: free convection, assumed
/// Henriques 1947 (Arch. Pathol. 43:489), as tabulated in Wright 2003, doi:10.1115/1.1553974: burn injury of
/// skin, the transition at about 60 °C in one second.
inline constexpr double kArrheniusRate = 3.1e98;                  ///< 1/s
inline constexpr double kArrheniusEnergy = 6.28e5;                ///< J/mol
inline constexpr double kGasConstant = 8.314462618;               ///< J/(mol·K), CODATA 2018
inline constexpr double kBoiling = 373.15;                        ///< K, water at 1 atm
inline constexpr double kLatentHeat = 2.257e6;                    ///< J/kg, water at 100 °C (steam tables)
inline constexpr double kCharBegin = 423.15, kCharFull = 473.15;  ///< K: carbonisation above 150 °C; assumed
inline constexpr double kCharRate = 1.0;  ///< 1/s at kCharFull; assumed, rising linearly from kCharBegin

/// What a tissue says of heat. Defaults: soft organs, rounded from McIntosh & Anderson 2010 (muscle,
/// intestine, uterus: 3421 … 3676 J/(kg·K), 0.49 … 0.53 W/(m·K)); perfusion between resting muscle (0.0006)
/// and intestine (0.018).
struct ThermalMaterial {
  double heat_capacity = 3600.0;  ///< J/(kg·K)
  double conductivity = 0.5;      ///< W/(m·K)
  double perfusion = 0.005;       ///< 1/s: volume of blood per volume of tissue
  double water = 0.75;            ///< kg/kg: what can evaporate (soft organs 0.7 … 0.8; assumed)
};

/// State of one column. Temperatures as excess over kBodyTemperature, so that small ones keep their digits.
struct HeatColumn {
  std::array<double, kThermalLayers> excess{};     ///< K
  std::array<double, kThermalLayers> arrhenius{};  ///< no unit: integral of the rate of denaturation
  std::array<double, kThermalLayers> dried{};      ///< no unit: share of the water that has boiled away
  double charred = 0.0;                            ///< no unit, 0 … 1, of layer 0
  double crushed = 0.0;                            ///< no unit, 0 … 1: by jaws (heat.h)
  double denatured = 0.0;                          ///< no unit, 0 … 1: mean over the layers
  double surface = 0.0;                            ///< no unit, 0 … 1: denatured part of layer 0
};

/// Geometry of a column; layers beyond its thickness have share 0.
struct ColumnShape {
  double thickness = 0.0;  ///< m: volume of the knot over its surface; 0: no surface, one layer
  std::array<double, kThermalLayers> share{1.0, 0.0, 0.0, 0.0};  ///< of the knot's mass
};

/// @param volume m³ @param area m², of surface that belongs to the knot; 0: one layer holds all
ColumnShape columnShape(double volume, double area);

/// J, since the start: delivered = stored + perfused + surface + latent within rounding.
struct HeatLedger {
  double delivered = 0.0;  ///< by instruments
  double perfused = 0.0;   ///< carried off by blood
  double surface = 0.0;    ///< lost to the gas
  double latent = 0.0;     ///< of evaporated water
  double stored = 0.0;     ///< in warm tissue now
};

/// 1/s: A·exp(-Ea/(R·T)).
double denaturationRate(double kelvin);
/// Denatured part after an Arrhenius integral: 1 - exp(-omega).
double denaturedPart(double omega);

/// Heat into the column, J; `deep`: through its whole thickness (between jaws), else into layer 0.
void deliver(HeatColumn& column, const ColumnShape& shape, const ThermalMaterial& m, double mass, double heat,
             bool deep, HeatLedger& ledger);

/// One step of a column: conduction into the depth, perfusion and surface loss implicitly (stable for any
/// dt), then boiling, denaturation, charring.
/// @param mass kg of the knot @param density kg/m³ @param dt s
void stepColumn(HeatColumn& column, const ColumnShape& shape, const ThermalMaterial& m, double mass,
                double density, double dt, HeatLedger& ledger);

/// J that the column holds above body temperature.
double storedHeat(const HeatColumn& column, const ColumnShape& shape, const ThermalMaterial& m, double mass);

}  // namespace vest::interaction
