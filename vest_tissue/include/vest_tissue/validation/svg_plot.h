#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vest::validation {

enum class Mark : std::uint8_t { Line = 0, Dashed = 1, Points = 2 };

/// One curve of a plot: y over x, in the units that the plot's axis labels name. Values that are not finite
/// interrupt the line.
struct Curve {
  std::string label;
  std::vector<double> x, y;
  Mark mark = Mark::Line;
};

/// A diagram with two axes. Labels carry the unit: "strain, no unit", "stress, kPa".
struct Plot {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;
  bool log_x = false, log_y = false;  ///< values <= 0 are then left out
};

/// The plot as SVG 1.1 text, 640 × 420 points; the same bytes for the same numbers. A plot without a finite
/// value shows its empty axes.
std::string toSvg(const Plot& plot);

/// Step of about `count` ticks over `span` (> 0): 1, 2 or 5 times a power of ten.
double tickStep(double span, int count);

}  // namespace vest::validation
