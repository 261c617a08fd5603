#pragma once

#include <map>
#include <string>
#include <vector>

#include "vest_effects/haemodynamics/network.h"

namespace vest::haemodynamics {

/// A vein as two resistances that meet at its pressure: from the venules and from the heart's side.
/// Resistances follow from the pressures and the flow at rest.
struct Vein {
  std::string name;
  double length = 0;             ///< m, station 0 at the heart's side
  double radius = 0;             ///< m
  double pressure = 0;           ///< Pa, at rest
  double upstream_pressure = 0;  ///< Pa, of its venules, > pressure
  double central_pressure = 0;   ///< Pa, towards the heart, < pressure
  double flow = 0;               ///< m³/s at rest
  double upstreamResistance() const { return (upstream_pressure - pressure) / flow; }  ///< Pa·s/m³
  double centralResistance() const { return (pressure - central_pressure) / flow; }    ///< Pa·s/m³
};

/// Tissue that segments feed with what leaves their ends.
struct Territory {
  std::string tissue;         ///< name of the scene's object
  std::vector<int> segments;  ///< of the network, each with a terminal
  std::vector<int> veins;     ///< of Vessels::veins, that drain it; none: nobody closes its veins
};

/// Numbers of the closed loop (circulation.h says what they do).
struct ControlNumbers {
  double blood_volume = 0;                    ///< m³
  double filling_pressure = 0;                ///< Pa, mean systemic
  double systemic_compliance = 0;             ///< m³/Pa
  double leg_compliance = 0;                  ///< m³/Pa of it, of the legs' veins
  double atrial_pressure = 0;                 ///< Pa
  double heart_rate = 0;                      ///< Hz, at rest
  double rate_gain = 0, resistance_gain = 0;  ///< no unit: share added at full tone
  double reflex_volume = 0;                   ///< m³ that veins give back at full tone
  double reflex_relaxation = 0;               ///< no unit: share of it that they take up at none
  double reflex_width = 0;                    ///< Pa, of heart rate and veins
  double resistance_width = 0;                ///< Pa, of the resistance
  double ischaemic_pressure = 0;              ///< Pa: below it the brain calls
  double rate_time = 0, resistance_time = 0, volume_time = 0;  ///< s
  double baroreceptor_time = 0;                                ///< s
  double discharge = 0;                                        ///< no unit, of holes
  double gas_resistance_gain = 0;      ///< no unit: share that the greatest pneumoperitoneum adds
  double gas_resistance_pressure = 0;  ///< Pa that add half of it
};

/// A flow, radius and speed kept as somebody gave them; nothing is computed from the speed.
struct QuotedVessel {
  std::string vessel, source;
  double flow = 0, radius = 0, velocity = 0;  ///< m³/s, m, m/s
};

/// Knowledge database of one patient: a folder with case.json, network.csv, inflow.csv (as vest_pulse reads
/// them) and vessels.yaml (veins, control, sources).
struct Vessels {
  Network network;
  std::vector<Vein> veins;
  ControlNumbers control;
  std::string reference_artery;                  ///< where the monitor measures
  std::map<std::string, std::string> sources;    ///< key -> citation
  std::map<std::string, std::string> source_of;  ///< number, vein or segment -> key in `sources`
  std::vector<QuotedVessel> quoted;
  std::vector<Territory> territories;
};

/// Strict: unknown keys, unknown sources, other units, numbers out of range, aliases, files over 1 MB are
/// refused. Throws NetworkError naming file, line, field, value and what is allowed.
Vessels readVessels(const std::string& folder);

/// Adds a tree of vessels that a scene has: its root becomes the end of the artery `supply`. Where that one
/// ended in a load, the tree takes its place: its ends' resistances are scaled together, so that the flow at
/// rest stays, and territories that the artery fed are fed by them. Throws NetworkError.
void graft(const Network& tree, const std::string& supply, Vessels& patient);

}  // namespace vest::haemodynamics
