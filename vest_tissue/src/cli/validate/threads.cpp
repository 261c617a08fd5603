#include <algorithm>
#include <cmath>

#include "sections.h"
#include "thread.h"

namespace vest::validate {
namespace {

using Eigen::Vector3d;
using suture::Hold;
using suture::Index;
using suture::specimen::kPi;
using suture::specimen::Moving;
using validation::digits;

/// Tip of a clamped elastica of length 1 under a dead load F across, EI = 1: θ″ = −F·cos θ from the tip's
/// angle inwards, found by bisection.
Vector3d elasticaTip(double force) {
  double low = 0.0, high = 0.5 * kPi, x = 0.0, y = 0.0;
  for (int k = 0; k < 60; ++k) {
    double angle = 0.5 * (low + high), slope = 0.0;
    constexpr int kParts = 4000;
    x = y = 0.0;
    for (int i = 0; i < kParts; ++i) {  // midpoint rule
      const double middle = angle + 0.5 * slope / kParts,
                   rate = slope - 0.5 * force * std::cos(angle) / kParts;
      x += std::cos(middle) / kParts, y += std::sin(middle) / kParts;
      slope -= force * std::cos(middle) / kParts;
      angle += rate / kParts;
    }
    (angle > 0.0 ? high : low) = 0.5 * (low + high);
  }
  return {x, 0.0, -y};
}

void elastica(validation::Section& s) {
  constexpr double kLength = 0.1, kLoad = 5.0;
  const Vector3d tip = kLength * elasticaTip(kLoad);
  std::vector<std::vector<std::string>> rows;
  double last = 0.0, order = 1e9;
  for (const int n : {20, 40, 80}) {
    auto rod = thread(n, kLength, 50.0);
    rod.held.push_back({0, Hold::Frame, {}});
    rod.loads.push_back({static_cast<Index>(n), {0.0, 0.0, -kLoad * rod.section.bend / (kLength * kLength)}});
    Moving m(rod);
    m.run(kStep, 2000);
    const double error = 100.0 * (m.state.position.back() - tip).norm() / kLength;
    rows.push_back({std::to_string(n), digits(error)});
    if (last > 0.0) order = std::min(order, std::log2(last / error));
    last = error;
  }
  s.text(
      "**Elastica.** One end is clamped, a dead load of 5·B/L² hangs across the other; place of the tip "
      "after "
      "2 s.");
  s.table({"segments", "error of the tip, % of L"}, rows);
  s.atMost("elastica, 80 segments: place of the tip, of L", last, 0.5, "%");
  s.atLeast("elastica: order in the length of segments", order, 1.7, "no unit");
}

/// Greenhill's equation B·w⁗ − i·M·w‴ − T·w″ = 0 with both ends clamped: zero at the buckling moment.
double clamped(double moment, double tension, double bend, double length) {
  const double mean = 0.5 * moment / bend, half = 0.5 * length,
               apart = std::sqrt(mean * mean - tension / bend), p = mean + apart, q = mean - apart;
  // w = a·s + c·e^(ips) + d·e^(iqs) from the middle, whose other half is the conjugate.
  const double c = q * std::sin(q * half), d = -p * std::sin(p * half);
  return (c * std::sin(p * half) + d * std::sin(q * half)) / half -
         (c * p * std::cos(p * half) + d * q * std::cos(q * half));
}
double clampedMoment(double tension, double bend, double length) {
  if (tension == 0.0) return 8.98682 * bend / length;  // tan x = x, x = M·L/2B
  const double unit = bend / length;
  double low = 2.0 * std::sqrt(bend * tension) + 1e-3 * unit, high = low;
  const bool sign = clamped(low, tension, bend, length) > 0.0;
  while ((clamped(high, tension, bend, length) > 0.0) == sign && high < low + 20.0 * unit)
    high += 1e-2 * unit;
  low = high - 1e-2 * unit;
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (low + high);
    ((clamped(middle, tension, bend, length) > 0.0) == sign ? low : high) = middle;
  }
  return low;
}

/// Whether a clamped rod of 0.1 m, stretched by the tension and twisted to the moment, leaves its axis in 1
/// s.
bool buckles(int segments, double tension, double moment) {
  constexpr double kLength = 0.1;
  auto rod = thread(segments, kLength, 20.0);
  const double longer = 1.0 + tension / rod.section.stretch;
  rod.turn = moment * kLength / rod.section.twist;
  rod.held = {{0, Hold::Frame, {}},
              {static_cast<Index>(segments), Hold::Frame, {{0.0, {kLength * longer, 0.0, 0.0}, 0.0}}}};
  Moving m(rod);
  for (std::size_t i = 1; i + 1 < m.state.position.size(); ++i) {
    m.state.position[i].x() *= longer;
    m.state.velocity[i].y() = 1e-8 * std::sin(kPi * static_cast<double>(i) / segments);
  }
  for (int k = 0; k < 1000; ++k) {
    m.run(kStep, 1);
    for (const Vector3d& x : m.state.position)
      if (std::hypot(x.y(), x.z()) > 1e-5) return true;  // it began with 1e-11 m
  }
  return false;
}

void greenhill(validation::Section& s, int segments) {
  const suture::Section c = thread(10, 0.1, 0.0).section;
  std::vector<std::vector<std::string>> rows;
  double worst = 0.0, formula = 0.0;
  for (const double load : {0.0, 20.0, 100.0, 400.0}) {
    const double unit = c.bend / 0.1, tension = load * unit / 0.1,
                 theory = clampedMoment(tension, c.bend, 0.1),
                 hinged = unit * std::sqrt(4.0 * load + 4.0 * kPi * kPi);
    double low = 0.9, high = 1.1;
    for (int k = 0; k < 6; ++k) {
      const double share = 0.5 * (low + high);
      (buckles(segments, tension, share * theory) ? high : low) = share;
    }
    const double share = 0.5 * (low + high);
    worst = std::max(worst, 100.0 * std::fabs(share - 1.0));
    if (load >= 100.0) formula = std::max(formula, 100.0 * std::fabs(share * theory / hinged - 1.0));
    rows.push_back(
        {digits(load), digits(share * theory / unit), digits(theory / unit), digits(hinged / unit)});
  }
  s.text(
      "**Greenhill.** A rod of " + std::to_string(segments) +
      " segments is stretched and twisted between clamps. The moment at which it leaves its axis is found by "
      "bisection to 0.2 %. B·w⁗ − i·M·w‴ − T·w″ = 0 gives it\nfor clamps. Hinges have M² = 4BT + (2πB/L)²; "
      "with "
      "tension the ends matter little.");
  s.table({"T·L²/B", "M·L/B, measured", "clamps", "hinges"}, rows);
  s.atMost("moment of buckling against Greenhill's equation, clamped ends", worst, 2.0, "%");
  s.atMost("the same against M² = 4BT + (2πB/L)², T ≥ 100·B/L²", formula, 2.0, "%");
}

/// A long twisted rod whose ends have come together.
struct Localised {
  double tension = 0.0, moment = 0.0;  ///< over those of theory
  double shape = 0.0;                  ///< root mean square error of cos θ, over its depth
  std::vector<double> at, cosine;
};
constexpr double kLong = 0.2, kAngle = kPi / 3.0, kScale = 0.005;  // m; θ₀; √(B/T), m

Localised localise(int segments) {
  auto rod = thread(segments, kLong, 20.0);
  const suture::Section& c = rod.section;
  const double tension = c.bend / (kScale * kScale),
               moment = 2.0 * std::sqrt(c.bend * tension) * std::cos(0.5 * kAngle),
               nearer = 4.0 * kScale * std::sin(0.5 * kAngle) - tension * kLong / c.stretch;
  rod.turn = moment * kLong / c.twist + 2.0 * kAngle;
  // Drawn out at first, so that it is straight; 1.5 times what keeps it straight.
  const double first = 0.375 * std::pow(rod.turn * c.twist / kLong, 2) / c.bend,
               out = first * kLong / c.stretch;
  const auto end = [](double by) { return Vector3d(kLong - by, 0.0, 0.0); };
  rod.held = {
      {0, Hold::Frame, {}},
      {static_cast<Index>(segments),
       Hold::Frame,
       {{0.0, end(0.0), 0.0}, {0.005, end(-out), 0.0}, {0.1, end(-out), 0.0}, {0.6, end(nearer), 0.0}}}};
  Moving m(rod);
  const double l = kLong / segments;
  for (int i = 1; i < segments; ++i) {
    const double s = (i - 0.5 * segments) * l / 0.01;
    m.state.velocity[static_cast<std::size_t>(i)].y() = 1e-3 * std::exp(-s * s);
  }
  m.run(kStep, 2000);
  Localised r;
  r.tension = m.scratch.reactions[1].force.x() / tension;
  r.moment = m.scratch.reactions[1].moment.x() / moment;
  double sum = 0.0, centre = 0.0;
  for (std::size_t j = 0; j + 1 < m.state.position.size(); ++j) {
    r.at.push_back((static_cast<double>(j) + 0.5) * l);
    r.cosine.push_back((m.state.position[j + 1] - m.state.position[j]).normalized().x());
    sum += 1.0 - r.cosine.back(), centre += (1.0 - r.cosine.back()) * r.at.back();
  }
  for (double& at : r.at) at -= centre / sum;
  for (std::size_t j = 0; j < r.at.size(); ++j) {
    const double deep = (1.0 - r.cosine[j]) / (1.0 - std::cos(kAngle)),
                 ch = std::cosh(std::sin(0.5 * kAngle) * r.at[j] / kScale);
    r.shape += std::pow(deep - 1.0 / (ch * ch), 2) / segments;
  }
  r.shape = std::sqrt(r.shape);
  return r;
}

void localised(validation::Section& s, bool full) {
  s.text(
      "**Localised helical buckling.** A rod of 0.2 m is twisted by 16 turns and its ends are brought "
      "together by "
      "10 mm. The twist gathers in one helix (van der Heijden and Thompson 2000):\n"
      "1 − cos θ = (1 − cos θ₀)/cosh²(sin(θ₀/2)·√(T/B)·s), M = 2·√(BT)·cos(θ₀/2), turn M·L/C + 2·θ₀, way "
      "4·√(B/T)·sin(θ₀/2); here θ₀ = 60°.");
  validation::Plot plot{"Localised helix", "along the rod, mm", "cos θ, no unit", {}, false, false};
  std::vector<std::vector<std::string>> rows;
  double last = 0.0, order = 1e9;
  Localised r;
  for (const int n : full ? std::vector<int>{50, 100, 200, 400, 800} : std::vector<int>{50, 100, 200, 400}) {
    r = localise(n);
    rows.push_back({std::to_string(n), digits(1e3 * kLong / n), digits(100.0 * (r.tension - 1.0)),
                    digits(100.0 * (r.moment - 1.0)), digits(100.0 * r.shape)});
    if (n > 100) order = std::min(order, std::log2(last / r.shape));
    last = r.shape;
    validation::Curve curve{std::to_string(n) + " segments", {}, r.cosine, validation::Mark::Points};
    for (const double at : r.at) curve.x.push_back(1e3 * at);
    if (n == 100 || n == 400) plot.curves.push_back(curve);
  }
  validation::Curve theory{"theory", {}, {}, validation::Mark::Line};
  for (int i = -200; i <= 200; ++i) {
    const double at = 0.25e-3 * i, ch = std::cosh(std::sin(0.5 * kAngle) * at / kScale);
    theory.x.push_back(1e3 * at), theory.y.push_back(1.0 - (1.0 - std::cos(kAngle)) / (ch * ch));
  }
  plot.curves.push_back(theory);
  s.table({"segments", "length of a segment, mm", "tension, % off", "moment, % off", "cos θ, % of its depth"},
          rows);
  s.plot("helix", plot);
  s.atMost("localised helix, finest: root mean square error of cos θ, of its depth", 100.0 * last, 1.0, "%");
  s.atMost("localised helix, finest: tension", 100.0 * std::fabs(r.tension - 1.0), 2.0, "%");
  s.atLeast("localised helix: order in the length of segments, from 100 on", order, 1.5, "no unit");
}

void catenary(validation::Section& s) {
  // Supple, of 0.12 m between ends at one height 0.08 m apart.
  constexpr int kSegments = 60;
  constexpr double kLength = 0.12, kSpan = 0.08;
  double a = 0.01;  // 2·a·sinh(span/2a) = length
  for (double low = 0.005, high = 1.0; high - low > 1e-12;) {
    a = 0.5 * (low + high);
    (2.0 * a * std::sinh(0.5 * kSpan / a) > kLength ? low : high) = a;
  }
  auto rod = thread(kSegments, kLength, 20.0);
  rod.section.bend *= 1e-4, rod.section.twist *= 1e-4;
  rod.held = {{0, Hold::Place, {}},
              {kSegments, Hold::Place, {{0.0, {kLength, 0.0, 0.0}, 0.0}, {0.4, {kSpan, 0.0, 0.0}, 0.0}}}};
  Moving m(rod, {0.0, 0.0, -9.81});
  for (std::size_t i = 1; i < kSegments; ++i) m.state.velocity[i].z() = -1e-3;
  m.run(kStep, 3000);
  const double sag = -m.state.position[kSegments / 2].z(), theory = a * (std::cosh(0.5 * kSpan / a) - 1.0),
               pull = std::fabs(m.scratch.reactions[1].force.x()), weight = rod.section.linear_density * 9.81;
  s.text("**Catenary.** A supple thread of 0.12 m hangs between ends 0.08 m apart.");
  s.atMost("catenary, 60 segments: sag", 100.0 * std::fabs(sag / theory - 1.0), 1.0, "%");
  s.atMost("catenary, 60 segments: pull along the span against w·a",
           100.0 * std::fabs(pull / (weight * a) - 1.0), 1.0, "%");
}

}  // namespace

validation::Section threadsSection(const Options& o, const std::string& command) {
  validation::Section s("21_threads", "Threads as elastic rods", command);
  s.text(
      "Polypropylene 2-0 (0.32 mm, E = 3 GPa, ν = 0.4) in steps of 1 ms by the solver of the World's threads "
      "(suture/rod.h). B is its bending stiffness EI, C its torsional stiffness GJ.");
  elastica(s);
  catenary(s);
  greenhill(s, 80);
  localised(s, o.full);
  return s;
}

}  // namespace vest::validate
