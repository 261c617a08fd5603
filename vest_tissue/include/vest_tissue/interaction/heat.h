#pragma once

#include <cstdint>
#include <vector>

#include "vest_tissue/interaction/thermal.h"

/// Heat and damage of one net: columns (thermal.h) under the knots, joined along the links. Also what
/// electrosurgery needs to know from step to step.
namespace vest::interaction {

/// Power that a generator gives while its function is on, W; typical soft coagulation settings are 20 … 40 W
/// (monopolar) and 20 … 30 W (bipolar); assumed.
inline constexpr double kMonopolarPower = 30.0, kBipolarPower = 25.0;
inline constexpr double kGreatestPower = 120.0;  ///< W, of a parameter edit
/// Dry tissue conducts the current worse: power·1/(1 + 9·dried); the order of magnitude is assumed.
inline constexpr double kDryResistance = 9.0;
inline constexpr double kElectrodeReach =
    0.2e-3;  ///< m: surface this near to the electrode takes current; assumed

/// Denatured collagen is up to a third shorter (Wright & Humphrey 2002, Annu. Rev. Biomed. Eng. 4:109) and
/// coagulated tissue several times stiffer; the factor is assumed.
inline constexpr double kShrinkage = 0.3;
inline constexpr double kStiffening = 4.0;
inline constexpr double kSealed =
    0.632;  ///< denatured part of every knot around that closes a vessel: omega = 1

/// Pinch over the area of a jaw from which on tissue is damaged: 15 N, the lower end of Heijnsdijk's 15 … 37
/// N, over the 110 mm² of our grasper's jaw (which jaw was measured is assumed).
inline constexpr double kGraspDamageThreshold = 136e3;  ///< Pa
inline constexpr double kCrushTime = 10.0;              ///< s to destroy at twice the threshold; assumed

/// What two knots of a surface conduct.
struct HeatEdge {
  std::uint32_t knot0 = 0, knot1 = 0;
  float conductance = 0.0f;  ///< W/K
};

/// A pair of corners of a finite element, for heat that flows through it: a cut parts it by itself.
struct ElementEdge {
  std::uint8_t corner0 = 0, corner1 = 0;
  float conductance = 0.0f;  ///< W/K, the element's share of what joins these two knots
};

/// What of an object's heat never changes.
struct HeatModel {
  ThermalMaterial material;
  std::vector<double> perfusion;  ///< 1/s per knot of the scene; empty: the material's
  double density = 1000.0;        ///< kg/m³
  double grasp_damage_threshold = kGraspDamageThreshold;  ///< Pa; 0: never
  std::vector<ColumnShape> shapes;                        ///< per knot of the scene
  std::vector<HeatEdge> surface_edges;                    ///< condensed finite elements
  std::vector<ElementEdge> element_edges;                 ///< finite elements: six each, in their order
};

/// State of one object.
struct HeatState {
  std::vector<HeatColumn> columns;   ///< per knot, room for copies
  std::vector<std::uint8_t> sealed;  ///< per ring of the tube map
  bool touched = false;  ///< anything ever happened: else all columns are as new, and cost nothing
  bool warm = false;     ///< some column is warmer than the body
  bool stiffened = false;
  bool denaturing = false;  ///< links lag behind the columns
  HeatLedger ledger;        ///< stored is computed on demand
};

/// A knot's copy gets its column.
inline void copyColumn(HeatState& s, std::uint32_t knot, std::uint32_t copy) {
  if (copy < s.columns.size()) s.columns[copy] = s.columns[knot];
}

/// State of one instrument's electrode.
struct Electrode {
  bool on = false;
  std::uint16_t object = 0;
  std::uint32_t element = 0;        ///< contact triangle touched last
  std::array<double, 3> weights{};  ///< barycentric
  double energy = 0.0;              ///< J since the last event
  std::uint64_t since = 0;          ///< step of the last event
};

/// State of the generator and its electrodes.
struct Electrosurgery {
  double monopolar_power = kMonopolarPower;  ///< W
  double bipolar_power = kBipolarPower;      ///< W
  std::array<Electrode, 4> electrodes;       ///< per tools::Instrument
};

/// A net for conductances: place of each knot and its ends.
struct HeatLink {
  std::uint32_t knot0 = 0, knot1 = 0;
  double length = 0.0;  ///< m
};

/// W/K per link, so that heat flows through the net as through the solid that the knots' masses fill:
/// G = k·(d_0·V_0/n_0 + d_1·V_1/n_1)/L², V volume of an end's knot, n its links, d = 1/tr(M²) the number of
/// directions that its links span, M = mean of u u^T (1: a chain, 2: a shell, 3: a lattice). Exact where
/// links point everywhere alike in those directions; derivation in docs/decisions/0020-….
/// @param position x y z per knot, m @param volume m³ per knot
std::vector<double> linkConductances(const std::vector<std::array<double, 3>>& position,
                                     const std::vector<double>& volume, const std::vector<HeatLink>& links,
                                     double conductivity);

/// Heat that passes between two bodies in dt, J, to the first: g·dt·(T1 - T0)/(1 + g·dt·(1/C0 + 1/C1)); what
/// one gets the other loses, and neither passes the common temperature: stable for any dt.
inline double exchange(double conductance, double excess0, double excess1, double capacity0, double capacity1,
                       double dt) {
  const double flow = conductance * dt;
  return flow * (excess1 - excess0) / (1.0 + flow * (1.0 / capacity0 + 1.0 / capacity1));
}

}  // namespace vest::interaction
