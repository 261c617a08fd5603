#include "vest_tissue/validation/svg_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace vest::validation {
namespace {

constexpr double kWidth = 640, kHeight = 420;                       // points
constexpr double kLeft = 78, kRight = 18, kTop = 40, kBottom = 58;  // margins
// Colours that stay apart for colour-blind readers: Okabe and Ito 2008, "Color Universal Design".
constexpr std::array<const char*, 7> kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                              "#e69f00", "#56b4e9", "#000000"};

std::string number(double value, const char* format = "%.2f") {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

/// One axis: data to 0 … 1.
struct Axis {
  bool logarithmic = false;
  double low = 0, high = 1, step = 0.2;

  bool shows(double v) const { return std::isfinite(v) && (!logarithmic || v > 0); }
  double scaled(double v) const { return logarithmic ? std::log10(v) : v; }
  double place(double v) const { return (scaled(v) - low) / (high - low); }
  std::string label(double tick) const {
    if (logarithmic) return "1e" + number(tick, "%.0f");
    return number(std::fabs(tick) < 1e-9 * step ? 0.0 : tick, "%.4g");
  }
};

Axis axisOf(const Plot& plot, bool x) {
  Axis axis;
  axis.logarithmic = x ? plot.log_x : plot.log_y;
  double low = 1e300, high = -1e300;
  for (const Curve& c : plot.curves) {
    const std::size_t n = std::min(c.x.size(), c.y.size());
    for (std::size_t i = 0; i < n; ++i) {
      const double v = x ? c.x[i] : c.y[i], other = x ? c.y[i] : c.x[i];
      if (!axis.shows(v) || !std::isfinite(other)) continue;
      low = std::min(low, axis.scaled(v));
      high = std::max(high, axis.scaled(v));
    }
  }
  if (!(low <= high) || (low == 0 && high == 0)) low = 0, high = 1;
  if (!(high - low > 1e-12 * std::max(std::fabs(low), std::fabs(high)))) low -= 0.5, high += 0.5;
  axis.step = axis.logarithmic ? std::max(1.0, std::ceil((high - low) / 8)) : tickStep(high - low, 6);
  axis.low = axis.step * std::floor(low / axis.step + 1e-9);
  axis.high = axis.step * std::ceil(high / axis.step - 1e-9);
  if (!(axis.high > axis.low)) axis.high = axis.low + axis.step;
  return axis;
}

struct Frame {
  Axis x, y;
  double px(double v) const { return kLeft + (kWidth - kLeft - kRight) * x.place(v); }
  double py(double v) const { return kHeight - kBottom - (kHeight - kTop - kBottom) * y.place(v); }
  bool shows(double a, double b) const { return x.shows(a) && y.shows(b); }
};

std::string text(double x, double y, const std::string& words, const char* more) {
  return "<text x=\"" + number(x) + "\" y=\"" + number(y) + "\" " + more + ">" + escaped(words) + "</text>\n";
}

std::string grid(const Plot& plot, const Frame& f) {
  std::string out = "<g stroke=\"#dddddd\" fill=\"none\">\n", labels;
  const auto line = [](double x0, double y0, double x1, double y1) {
    return "<path d=\"M" + number(x0) + " " + number(y0) + "L" + number(x1) + " " + number(y1) + "\"/>\n";
  };
  for (double t = f.x.low; t <= f.x.high + 0.5 * f.x.step; t += f.x.step) {
    const double x = kLeft + (kWidth - kLeft - kRight) * (t - f.x.low) / (f.x.high - f.x.low);
    out += line(x, kTop, x, kHeight - kBottom);
    labels += text(x, kHeight - kBottom + 16, f.x.label(t), "text-anchor=\"middle\"");
  }
  for (double t = f.y.low; t <= f.y.high + 0.5 * f.y.step; t += f.y.step) {
    const double y = kHeight - kBottom - (kHeight - kTop - kBottom) * (t - f.y.low) / (f.y.high - f.y.low);
    out += line(kLeft, y, kWidth - kRight, y);
    labels += text(kLeft - 6, y + 4, f.y.label(t), "text-anchor=\"end\"");
  }
  out += "</g>\n" + labels;
  out += text(kWidth / 2, 22, plot.title, "text-anchor=\"middle\" font-size=\"15\"");
  out += text(kWidth / 2, kHeight - 14, plot.x_label, "text-anchor=\"middle\"");
  const std::string turned =
      "text-anchor=\"middle\" transform=\"rotate(-90 18 " + number(kHeight / 2) + ")\"";
  return out + text(18, kHeight / 2, plot.y_label, turned.c_str());
}

std::string drawn(const Curve& c, const Frame& f, const std::string& colour) {
  const std::size_t n = std::min(c.x.size(), c.y.size());
  std::string out;
  if (c.mark == Mark::Points) {
    for (std::size_t i = 0; i < n; ++i) {
      if (!f.shows(c.x[i], c.y[i])) continue;
      out += "<circle cx=\"" + number(f.px(c.x[i])) + "\" cy=\"" + number(f.py(c.y[i])) +
             "\" r=\"3\" fill=\"" + colour + "\"/>\n";
    }
    return out;
  }
  out = "<path fill=\"none\" stroke-width=\"1.8\" stroke=\"" + colour + "\"" +
        (c.mark == Mark::Dashed ? " stroke-dasharray=\"7 4\"" : "") + " d=\"";
  bool pen = false;
  for (std::size_t i = 0; i < n; ++i) {
    if (!f.shows(c.x[i], c.y[i])) {
      pen = false;
      continue;
    }
    out += (pen ? "L" : "M") + number(f.px(c.x[i])) + " " + number(f.py(c.y[i]));
    pen = true;
  }
  return out + "\"/>\n";
}

}  // namespace

double tickStep(double span, int count) {
  const double raw = span / std::max(1, count);
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double lead = raw / power;
  return power * (lead < 1.5 ? 1.0 : lead < 3.5 ? 2.0 : lead < 7.5 ? 5.0 : 10.0);
}

std::string toSvg(const Plot& plot) {
  const Frame f{axisOf(plot, true), axisOf(plot, false)};
  std::string out =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"640\" height=\"420\" viewBox=\"0 0 640 420\" "
      "font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"640\" height=\"420\" fill=\"white\"/>\n";
  out += grid(plot, f);
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    const Curve& c = plot.curves[i];
    const std::string colour = kColours[i % kColours.size()];
    out += drawn(c, f, colour);
    if (c.label.empty()) continue;
    const double y = kTop + 16 + 16 * static_cast<double>(i);
    const double x = kLeft + 8;
    if (c.mark == Mark::Points) {
      out += "<circle cx=\"" + number(x + 12) + "\" cy=\"" + number(y - 4) + "\" r=\"3\" fill=\"" + colour +
             "\"/>\n";
    } else {
      out += "<path stroke-width=\"1.8\" stroke=\"" + colour + "\"" +
             (c.mark == Mark::Dashed ? " stroke-dasharray=\"7 4\"" : "") + " d=\"M" + number(x) + " " +
             number(y - 4) + "h24\"/>\n";
    }
    out += text(kLeft + 38, y, c.label, "");
  }
  return out + "</svg>\n";
}

}  // namespace vest::validation
