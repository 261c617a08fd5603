#pragma once

#include <string>
#include <vector>

#include "vest_effects/haemodynamics/step.h"

namespace vest::haemodynamics {

struct PulseOptions {
  int cycles = 0;  ///< inflow periods to run; 0: until periodic
  int threads = 1;
  double tolerance = 1e-4;  ///< periodic when no pressure or flow at a middle changes by more than this share
                            ///< of its greatest
  int most_cycles = 200;    ///< gives up being periodic after so many
  double sample_period = 1e-3;  ///< s
};

/// A run from rest, the last cycle kept.
struct PulseResult {
  Status status = Status::kOk;
  int failed_segment = -1;
  double failed_time = 0;  ///< s
  int cycles = 0;
  long substeps = 0;
  double change = 0;  ///< greatest relative change from the cycle before; 1 after a single cycle
  bool periodic =
      false;  ///< change below the tolerance, and outflow equal to inflow within twice the tolerance
  double inflow_volume = 0, outflow_volume = 0, stored_volume = 0;  ///< m³ in the last cycle
  /// |in − out − stored| relative to the inflow (to all that moved, if nothing flows in).
  double mass_error = 0;
  std::vector<double> time;  ///< s from the start of the last cycle, 0 ≤ time < period
  std::vector<std::vector<SegmentSample>> samples;  ///< per time, per segment
};

PulseResult runPulse(const Model& model, const PulseOptions& options);

/// Writes NAME_prox.csv, NAME_mid.csv, NAME_dist.csv (t_s,P_Pa,Q_m3_s,A_m2) for each segment and summary.csv
/// (id,name,P_mean_Pa,P_min_Pa,P_max_Pa,Q_mean_m3_s,Q_min_m3_s,Q_max_m3_s, at the middle) into a folder, made
/// if need be. Throws std::runtime_error naming the file that could not be written.
void writePulse(const Model& model, const PulseResult& result, const std::string& folder);

}  // namespace vest::haemodynamics
