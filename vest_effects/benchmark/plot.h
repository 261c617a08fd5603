#pragma once

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace vest::effects {

/// One curve or cloud of points of a plot.
struct Series {
  std::string name, colour;
  bool points = false;
  std::vector<std::pair<double, double>> at;
};

/// Plain SVG: axes from 0 (or the least value) to the greatest, five ticks each, a legend.
inline void plot(const std::string& file, const std::string& x_name, const std::string& y_name,
                 const std::vector<Series>& series) {
  double x1 = 0, y1 = 0, x0 = 0, y0 = 0;
  for (const Series& s : series)
    for (const auto& [x, y] : s.at)
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  y1 += 0.05 * (y1 - y0);
  const auto px = [&](double x) { return 70 + 500 * (x - x0) / (x1 - x0); };
  const auto py = [&](double y) { return 310 - 280 * (y - y0) / (y1 - y0); };
  std::ofstream out(file);
  char text[256];
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"640\" height=\"370\" font-family=\"sans-serif\" "
         "font-size=\"12\"><rect width=\"640\" height=\"370\" fill=\"white\"/>\n";
  for (int k = 0; k <= 5; ++k) {
    const double x = x0 + (x1 - x0) * k / 5, y = y0 + (y1 - y0) * k / 5;
    std::snprintf(
        text, sizeof text,
        "<path d=\"M%.1f 310V30M70 %.1fH570\" stroke=\"#ddd\"/><text x=\"%.1f\" y=\"326\" "
        "text-anchor=\"middle\">%.3g</text><text x=\"64\" y=\"%.1f\" text-anchor=\"end\">%.3g</text>\n",
        px(x), py(y), px(x), x, py(y) + 4, y);
    out << text;
  }
  int row = 0;
  for (const Series& s : series) {
    if (s.points) {
      for (const auto& [x, y] : s.at) {
        std::snprintf(text, sizeof text, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2.5\" fill=\"%s\"/>", px(x),
                      py(y), s.colour.c_str());
        out << text;
      }
    } else {
      out << "<polyline fill=\"none\" stroke-width=\"1.5\" stroke=\"" << s.colour << "\" points=\"";
      for (const auto& [x, y] : s.at) {
        std::snprintf(text, sizeof text, "%.1f,%.1f ", px(x), py(y));
        out << text;
      }
      out << "\"/>";
    }
    std::snprintf(text, sizeof text,
                  "<rect x=\"400\" y=\"%d\" width=\"14\" height=\"4\" fill=\"%s\"/><text x=\"420\" y=\"%d\">",
                  38 + 16 * row, s.colour.c_str(), 44 + 16 * row);
    out << text << s.name << "</text>\n";
    ++row;
  }
  out << "<text x=\"320\" y=\"350\" text-anchor=\"middle\">" << x_name
      << "</text><text transform=\"translate(18,170) rotate(-90)\" text-anchor=\"middle\">" << y_name
      << "</text></svg>\n";
}

}  // namespace vest::effects
