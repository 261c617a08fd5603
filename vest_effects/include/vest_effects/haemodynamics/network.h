#pragma once

#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace vest::haemodynamics {

/// A value of a case that cannot be used. what() is the one message a user sees:
/// "FILE:LINE: FIELD = VALUE: allowed is …".
class NetworkError : public std::runtime_error {
 public:
  NetworkError(std::string file, int line, std::string field, std::string value, std::string allowed);
  const std::string& file() const { return file_; }
  int line() const { return line_; }  ///< 1-based; 0 where the whole file is meant
  const std::string& field() const { return field_; }
  const std::string& value() const { return value_; }
  const std::string& allowed() const { return allowed_; }

 private:
  std::string file_, field_, value_, allowed_;
  int line_;
};

/// Three-element windkessel: R1 in series with (R2 parallel to C), to the pressure P_out.
/// C = 0 or R2 = 0 leave a plain resistance.
struct Windkessel {
  double proximal_resistance = 0;  ///< R1, Pa·s/m³, ≥ 0
  double distal_resistance = 0;    ///< R2, Pa·s/m³, ≥ 0
  double compliance = 0;           ///< C, m³/Pa, ≥ 0
  double outflow_pressure = 0;     ///< P_out, Pa
};

/// One artery: a straight piece between two nodes, radius (and wall thickness) linear along it.
struct SegmentSpec {
  std::string id;
  std::string name;   ///< letters, digits, '_', '-', '.': it becomes part of a file name
  long node_in = 0;   ///< node at the proximal end
  long node_out = 0;  ///< node at the distal end
  double length = 0;  ///< m
  double radius_proximal = 0, radius_distal = 0;  ///< m, inner radius at the reference pressure
  double wall_proximal = 0, wall_distal = 0;      ///< m, thickness; unused with a WallThicknessLaw
  double youngs_modulus = 0;                      ///< Pa
  double reference_pressure = 0;                  ///< P_ref, Pa
  bool terminal = false;                          ///< ends in `load`
  Windkessel load;
  int line = 0;  ///< in network.csv
};

/// h(r) = r·(a·exp(b·r) + c·exp(d·r)), r in m (the empirical form that case.json may give,
/// used by Boileau et al. 2015, Int. J. Numer. Meth. Biomed. Eng. 31(10) e02732, for the ADAN model).
struct WallThicknessLaw {
  double a = 0, b = 0, c = 0, d = 0;  ///< a, c: no unit; b, d: 1/m
  double thickness(double radius) const;
};

struct InflowPoint {
  double time = 0;  ///< s, 0 … period, strictly rising
  double flow = 0;  ///< m³/s
  int line = 0;     ///< in inflow.csv
};

/// A case as its files say it, parsed but not yet checked (buildModel checks).
struct Network {
  std::string case_file = "case.json", network_file = "network.csv", inflow_file = "inflow.csv";
  double density = 1060;     ///< rho, kg/m³
  double viscosity = 0.004;  ///< mu, Pa·s
  double profile =
      2;  ///< zeta, no unit: velocity profile (zeta + 2)/zeta·(1 − (r/R)^zeta); 2 is Poiseuille's
  double period = 1;  ///< s, of the inflow
  std::optional<WallThicknessLaw> wall_thickness_law;
  std::vector<SegmentSpec> segments;
  std::vector<InflowPoint> inflow;        ///< linear between the points, periodic
  std::map<std::string, int> case_lines;  ///< line of each key of case.json, for messages
};

/// Reads case.json, network.csv and inflow.csv of a folder (docs: README.md of vest_effects).
/// Independent of the locale. Throws NetworkError.
Network readCase(const std::string& folder);
/// The same of texts; `folder` is what messages call it.
struct CaseTexts {
  std::string case_json, network_csv, inflow_csv;
};
Network parseCase(const std::string& folder, const CaseTexts& texts);

/// Parses a finite decimal number with '.', whatever the locale; false if `text` is anything else.
bool parseNumber(const std::string& text, double& value);

/// Shortest text that reads back as the same number, with '.', whatever the locale.
std::string formatNumber(double value);

}  // namespace vest::haemodynamics
