#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include <Eigen/Eigenvalues>

#include "knots.h"
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

std::string percent(double ratio) {
  return digits(100.0 * (ratio - 1.0));
}

/// Where a bisection ends between shares at which nothing happens and at which something does.
template <typename Happens>
double threshold(double low, double high, int halvings, const Happens& happens) {
  for (int k = 0; k < halvings; ++k) {
    const double share = 0.5 * (low + high);
    (happens(share) ? high : low) = share;
  }
  return 0.5 * (low + high);
}

void euler(validation::Section& s) {
  constexpr double kLength = 0.1;
  const auto leaves = [=](int segments, double share) {
    auto rod = thread(segments, kLength, 2.0);
    const double load = share * rod.section.bend * std::pow(0.5 * kPi / kLength, 2);
    rod.held.push_back({0, Hold::Frame, {}});
    rod.loads.push_back({static_cast<Index>(segments), {-load, 0.0, 0.0}});
    Moving m(rod);
    for (std::size_t i = 1; i < m.state.position.size(); ++i)
      m.state.velocity[i].y() =
          1e-8 * (1.0 - std::cos(0.5 * kPi * static_cast<double>(i) / static_cast<double>(segments)));
    for (int k = 0; k < 3000; ++k) {
      m.run(kStep, 1);
      if (std::hypot(m.state.position.back().y(), m.state.position.back().z()) > 1e-5) return true;
    }
    return false;
  };
  std::vector<std::vector<std::string>> rows;
  double last = 0.0;
  for (const int n : {10, 20, 40}) {
    last = threshold(0.9, 1.1, 7, [&](double share) { return leaves(n, share); });
    rows.push_back({std::to_string(n), percent(last)});
  }
  s.text(
      "**Euler.** A column is clamped below and free above. The dead load on its top at which it leaves its "
      "axis is found by bisection to 0.2 %; theory has π²·B/4L².");
  s.table({"segments", "load, % off"}, rows);
  s.atMost("Euler's load, 40 segments", 100.0 * std::fabs(last - 1.0), 2.0, "%");
}

void ring(validation::Section& s) {
  constexpr double kLength = 0.2, kRadius = kLength / (2.0 * kPi);
  const auto leaves = [=](int segments, double share) {
    auto rod = thread(segments, kLength, 20.0);
    rod.nodes.clear();
    for (int i = 0; i < segments; ++i) {
      const double a = 2.0 * kPi * i / segments;
      rod.nodes.push_back(kRadius * Vector3d(std::cos(a), std::sin(a), 1e-3 * std::cos(2.0 * a)));
    }
    rod.closed = true;
    rod.turn = share * 2.0 * kPi * std::sqrt(3.0) * rod.section.bend / rod.section.twist;
    Moving m(rod);
    for (int k = 0; k < 2000; ++k) {
      m.run(kStep, 1);
      for (const Vector3d& x : m.state.position)
        if (std::fabs(x.z()) > 0.02 * kRadius) return true;
    }
    return false;
  };
  std::vector<std::vector<std::string>> rows;
  double last = 0.0;
  for (const int n : {20, 40, 80}) {
    last = threshold(0.9, 1.1, 6, [&](double share) { return leaves(n, share); });
    rows.push_back({std::to_string(n), percent(last)});
  }
  s.text(
      "**Michell's ring.** A ring that is straight by nature is closed with a twist. It leaves its plane at "
      "2π·√3·B/C (Michell 1889; Goriely 2006).");
  s.table({"segments", "twist, % off"}, rows);
  s.atMost("Michell's ring, 80 segments: twist", 100.0 * std::fabs(last - 1.0), 3.0, "%");
}

/// What is zero at frequencies of a twisted rod between clamps: W = Σ c·e^(iks), B·k⁴ − M·k³ = ρ·ω², s from
/// the middle. Over the roots' differences it is real, up to one factor.
double clampedTwisted(double omega, double moment, const suture::Section& c, double length) {
  using Complex = std::complex<double>;
  Eigen::Matrix4d companion = Eigen::Matrix4d::Zero();
  companion.diagonal(-1).setOnes();
  companion(0, 3) = c.linear_density * omega * omega / c.bend, companion(3, 3) = moment / c.bend;
  const Eigen::Vector4cd k = companion.eigenvalues();
  Eigen::Matrix4cd conditions;
  Complex between = 1.0;
  for (int j = 0; j < 4; ++j) {
    const Complex there = std::exp(Complex(0.0, 0.5 * length) * k[j]);
    conditions.col(j) << 1.0 / there, k[j] / there, there, k[j] * there;
    for (int i = 0; i < j; ++i) between *= k[j] - k[i];
  }
  const Complex whole = conditions.determinant() / between;
  return std::fabs(whole.real()) > std::fabs(whole.imag()) ? whole.real() : whole.imag();
}
double clampedTwistedMode(double moment, const suture::Section& c, double length) {
  const double unit = std::sqrt(c.bend / c.linear_density) / (length * length);
  double high = 0.5 * unit;  // upwards to the first change of sign
  const bool sign = clampedTwisted(high, moment, c, length) > 0.0;
  while ((clampedTwisted(high, moment, c, length) > 0.0) == sign && high < 30.0 * unit) high += 0.05 * unit;
  double low = high - 0.05 * unit;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    ((clampedTwisted(middle, moment, c, length) > 0.0) == sign ? low : high) = middle;
  }
  return low;
}

struct Swing {
  double omega = 0.0, decay = 0.0;  ///< rad/s, 1/s
};
/// First mode of a rod between clamps that bears a moment: by its zero crossings and its maxima.
Swing swing(int segments, double length, double moment, double step) {
  auto rod = thread(segments, length, 0.0);
  rod.section.strain_damping = 0.0;
  rod.turn = moment * length / rod.section.twist;
  rod.held = {{0, Hold::Frame, {}}, {static_cast<Index>(segments), Hold::Frame, {}}};
  Moving m(rod);
  std::vector<double> shape;
  for (int i = 0; i <= segments; ++i) shape.push_back(std::pow(std::sin(kPi * i / segments), 2));
  for (std::size_t i = 0; i < shape.size(); ++i) m.state.velocity[i].y() = 1e-4 * shape[i];
  double last = 0.0, first_at = 0.0, last_at = 0.0, peak = 0.0, first_peak = 0.0, last_peak = 0.0;
  int crossings = 0;
  for (int k = 1; k * step < 1.5; ++k) {
    m.run(step, 1);
    double y = 0.0;
    for (std::size_t i = 0; i < shape.size(); ++i) y += shape[i] * m.state.position[i].y();
    if (k * step > 0.2) {  // higher modes have died out
      if ((y > 0.0) != (last > 0.0)) {
        last_at = step * (k - y / (y - last));
        if (crossings == 0) first_at = last_at;
        if (crossings == 1) first_peak = peak;
        if (crossings > 0) last_peak = peak;
        ++crossings, peak = 0.0;
      }
      peak = std::max(peak, std::fabs(y));
    }
    last = y;
  }
  Swing r;
  r.omega = kPi * (crossings - 1) / (last_at - first_at);
  r.decay = std::log(first_peak / last_peak) / (kPi / r.omega * (crossings - 2));
  return r;
}

void waves(validation::Section& s) {
  constexpr double kLength = 0.3;
  constexpr int kSegments = 60;
  const suture::Section c = thread(10, kLength, 0.0).section;
  const double unit = c.bend / kLength;
  std::vector<std::vector<std::string>> rows;
  double worst = 0.0;
  for (const double twist : {0.0, 3.0, 6.0, 8.0}) {
    const double theory = clampedTwistedMode(twist * unit, c, kLength),
                 omega = swing(kSegments, kLength, twist * unit, kStep).omega;
    rows.push_back({digits(twist), digits(omega), digits(theory), percent(omega / theory)});
    worst = std::max(worst, 100.0 * std::fabs(omega / theory - 1.0));
  }
  s.text("**Waves in twisted rods.** A rod of 0.3 m in " + std::to_string(kSegments) +
         " segments between clamps swings in its first mode. A moment M makes it slower:\n"
         "B·w⁗ − i·M·w‴ = −ρ·ẅ, and it stands still at Greenhill's 8.987·B/L.");
  s.table({"M·L/B", "rad/s", "theory", "% off"}, rows);
  s.atMost("first mode between clamps, with and without twist", worst, 1.0, "%");

  const double omega = clampedTwistedMode(0.0, c, kLength);
  rows.clear();
  double last = 0.0, order = 1e9, ratio = 0.0;
  for (const double step : {0.002, 0.001, 0.0005}) {
    const double decay = swing(kSegments, kLength, 0.0, step).decay,
                 theory = 0.5 * std::log1p(std::pow(omega * step, 2)) / step;
    if (last > 0.0) order = std::min(order, std::log2(last / decay));
    last = decay, ratio = decay / theory;
    rows.push_back({digits(1e3 * step), digits(decay), digits(theory)});
  }
  s.text(
      "**Damping by the step.** The same rod without twist and without any damping of its own. Backward "
      "Euler damps by ln(1 + ω²h²)/2h, which is of first order.");
  s.table({"step, ms", "decay, 1/s", "of backward Euler, 1/s"}, rows);
  s.atMost("decay against that of backward Euler, 0.5 ms", 100.0 * std::fabs(ratio - 1.0), 5.0, "%");
  s.atLeast("decay: order in the step", order, 0.9, "no unit");
}

void hangingThread(validation::Section& s) {
  constexpr double kLength = 0.1, kZero = 2.404825557695773;  // of J₀
  std::vector<std::vector<std::string>> rows;
  double last = 0.0;
  for (const int n : {10, 20, 40}) {
    auto rod = thread(n, kLength, 0.0);
    for (Vector3d& x : rod.nodes) x = {0.0, 0.0, -x.x()};
    rod.section.bend *= 1e-6, rod.section.twist *= 1e-6, rod.section.strain_damping = 0.0;
    rod.held.push_back({0, Hold::Place, {}});
    Moving m(rod, {0.0, 0.0, -9.81});
    m.settle();
    for (int i = 0; i <= n; ++i) {
      const double below = 1.0 - static_cast<double>(i) / n;
      double bessel = 1.0, part = 1.0;
      for (int k = 1; k < 20; ++k) part *= -0.25 * kZero * kZero * below / (k * k), bessel += part;
      m.state.velocity[static_cast<std::size_t>(i)].x() = 0.02 * bessel;
    }
    double was = 0.0, first = 0.0, at = 0.0;
    int crossings = 0;
    for (int k = 1; k <= 1500; ++k) {
      m.run(kStep, 1);
      const double x = m.state.position.back().x();
      if (k > 1 && (x > 0.0) != (was > 0.0)) {
        at = kStep * (k - x / (x - was));
        if (crossings++ == 0) first = at;
      }
      was = x;
    }
    last = kPi * (crossings - 1) / (at - first) / (0.5 * kZero * std::sqrt(9.81 / kLength));
    rows.push_back({std::to_string(n), percent(last)});
  }
  s.text(
      "**A thread that swings.** A supple thread of 0.1 m hangs from one end; its first mode has "
      "ω = j₀,₁/2·√(g/L), j₀,₁ = 2.405.");
  s.table({"segments", "ω, % off"}, rows);
  s.atMost("first mode of a hanging thread, 40 segments", 100.0 * std::fabs(last - 1.0), 1.0, "%");
}

void energyOfAFreeRod(validation::Section& s) {
  constexpr int kSegments = 40;
  auto rod = thread(kSegments, 0.1, 0.0);
  rod.section.strain_damping = 0.0;
  for (int i = 0; i <= kSegments; ++i) {
    const double a = 2.0 * i / kSegments;
    rod.nodes[static_cast<std::size_t>(i)] = 0.05 * Vector3d(std::sin(a), std::cos(a), 0.02 * i);
  }
  rod.turn = 6.0;
  Moving m(rod);
  const double start = suture::energy(m.model, m.state);
  double last = start, most = 0.0;
  for (int k = 0; k < 500; ++k) {
    m.run(kStep, 1);
    const double now = suture::energy(m.model, m.state);
    most = std::max(most, (now - last) / start);
    last = now;
  }
  s.text(
      "**Energy.** A rod is bent to two thirds of a half circle, twisted by 6 rad and let go, without any "
      "damping of its own. Its "
      "energy is " +
      digits(100.0 * last / start) + " % of the first after 0.5 s, and grows in no step.");
  s.atMost("free rod: greatest growth of energy in a step, of the first", 100.0 * most, 1e-4, "%");
}

/// Tension at the end that is drawn over that at the other one, 1 N: half a turn on a drum 20 threads thick.
double drawnRoundADrum(int arc, double friction, double speed) {
  constexpr double kDrum = 0.01, kRadius = 0.0005, kAt = kDrum + 1.001 * kRadius;
  const int legs = arc / 4;
  const double l = kAt * kPi / arc;
  suture::RodDescription rod = suture::specimen::straight(4);
  rod.nodes.clear();
  for (int i = legs; i > 0; --i) rod.nodes.push_back({kAt, -l * i, 0.0});
  for (int i = 0; i <= arc; ++i)
    rod.nodes.push_back({kAt * std::cos(kPi * i / arc), kAt * std::sin(kPi * i / arc), 0.0});
  for (int i = 1; i <= legs; ++i) rod.nodes.push_back({-kAt, -l * i, 0.0});
  rod.section = suture::solidSection(kRadius, 900, 3e9, 0.4);
  rod.section.bend *= 1e-4, rod.section.twist *= 1e-4;  // supple
  rod.section.friction = friction, rod.section.damping = 50.0, rod.section.strain_damping = 1e-4;
  constexpr double kWay = 0.003;
  const Vector3d start = rod.nodes.front(), end = start - Vector3d(0.0, kWay, 0.0);
  rod.held = {{0, Hold::Place, {{0.05, start, 0.0}, {0.05 + kWay / speed, end, 0.0}}}};
  rod.loads.push_back({static_cast<Index>(rod.nodes.size() - 1), {0.0, -1.0, 0.0}});
  suture::Description d{Vector3d::Zero(), {rod}, {}};
  d.cylinders.push_back({"drum", Vector3d::Zero(), Vector3d::UnitZ(), kDrum, friction});
  Moving m(d);
  const int whole = static_cast<int>((0.05 + kWay / speed) / kStep), mean = whole / 4;
  m.run(kStep, whole - mean);
  double tension = 0.0;
  for (int k = 0; k < mean; ++k) {
    m.run(kStep, 1);
    tension -= m.scratch.reactions[0].force.y() / mean;
  }
  return tension;
}

void capstan(validation::Section& s) {
  std::vector<std::vector<std::string>> rows;
  double worst = 0.0;
  for (const double friction : {0.1, 0.2, 0.3}) {
    for (const int arc : {16, 32}) {
      for (const double speed : {0.003, 0.03}) {
        const double theory = std::exp(friction * kPi), tension = drawnRoundADrum(arc, friction, speed);
        rows.push_back({digits(friction), std::to_string(arc), digits(1e3 * speed), digits(tension),
                        digits(theory), percent(tension / theory)});
        worst = std::max(worst, 100.0 * std::fabs(tension / theory - 1.0));
      }
    }
  }
  s.text(
      "**Capstan.** A supple thread lies half a turn round a drum that is 20 times as thick. 1 N draws at "
      "one end, the other one is drawn at a speed. Theory has exp(μ·π), at any speed.");
  s.table({"μ", "segments on the drum", "speed, mm/s", "tension, N", "theory, N", "% off"}, rows);
  s.atMost("tension beyond a drum", worst, 5.0, "%");
}

/// T·R²/B of an open overhand knot, and R over the thread's radius.
struct Traction {
  double radius = 0.0, measured = 0.0;
};
/// @param way m, of each end, from the shape that is taken in syrup; negative: the knot is loosened
Traction traction(double length, double friction, double way) {
  constexpr double kThin = 0.0001125, kDraw = 0.02, kSpeed = 0.005, kSegment = 0.0005;
  const Index last = static_cast<Index>(std::lround(length / kSegment));
  suture::RodDescription rod = suture::specimen::overhand(last, kSegment, 0.13);
  rod.section = suture::solidSection(kThin, 900, 3e9, 0.4);
  rod.section.friction = friction, rod.section.strain_damping = 1e-4, rod.section.damping = 2e4;
  const Vector3d a = rod.nodes.front(), b = rod.nodes.back(), along = (b - a).normalized();
  const double lasts = std::fabs(way) / kSpeed;
  const auto drive = [&](const Vector3d& from, const Vector3d& out) {
    return std::vector<suture::DriveRow>{{0.0, from, 0.0},
                                         {kDraw / 0.2, from + kDraw * out, 0.0},
                                         {0.5, from + kDraw * out, 0.0},
                                         {0.5 + lasts, from + (kDraw + way) * out, 0.0}};
  };
  rod.held = {{0, Hold::Place, drive(a, -along)}, {last, Hold::Place, drive(b, along)}};
  Moving m(rod);
  m.run(kStep, 500);
  m.model.strands[0].section.damping = 200.0;  // out of the syrup
  const int mean = 200;
  m.run(kStep, static_cast<int>(lasts / kStep) - mean);
  Traction r;
  for (int k = 0; k < mean; ++k) {
    m.run(kStep, 1);
    const double radius =
        (length - (m.state.position.back() - m.state.position.front()).norm()) / (2.0 * kPi);
    const double tension = 0.5 * along.dot(m.scratch.reactions[1].force - m.scratch.reactions[0].force);
    r.radius += radius / kThin / mean;
    r.measured += tension * radius * radius / rod.section.bend / mean;
  }
  return r;
}

void overhandKnot(validation::Section& s) {
  // c1, σ1 and s1 by least bending energy of two strands that wind round each other by 3π.
  constexpr double kC = 0.475, kSigma = 0.492, kShort = 2.4;
  struct Trial {
    double length, friction, way;
  };
  std::vector<std::vector<std::string>> rows;
  double wide = 0.0, off = 0.0, order = 1e9, rubbed = 0.0;
  for (const Trial& trial : std::vector<Trial>{{0.15, 0.0, 0.008},
                                               {0.25, 0.0, 0.008},
                                               {0.3, 0.0, 0.004},
                                               {0.25, 0.03, 0.004},
                                               {0.25, 0.03, -0.004},
                                               {0.25, 0.1, 0.01}}) {
    const Traction t = traction(trial.length, trial.friction, trial.way);
    const double theory = 0.5 + kC / std::sqrt(t.radius) +
                          std::copysign(trial.friction, trial.way) * (kSigma * std::sqrt(t.radius) + kShort);
    rows.push_back({digits(trial.friction), trial.way > 0.0 ? "drawn" : "loosened", digits(t.radius),
                    digits(t.measured), digits(theory), percent(t.measured / theory)});
    const double error = std::fabs(t.measured / theory - 1.0);
    if (trial.friction > 0.0) {
      rubbed = std::max(rubbed, 100.0 * error);
      continue;
    }
    if (wide > 0.0) order = std::min(order, std::log(off / error) / std::log(t.radius / wide));
    wide = t.radius, off = error;
  }
  s.text(
      "**Overhand knot.** Polypropylene 3-0 in segments of 0.5 mm is tied to an open knot, whose ends are "
      "moved by 5 mm/s. What its ends are short of its length is 2π·R; r is the thread's radius.\n"
      "T·R²/B = 1/2 + 0.475·√(r/R) ± μ·(0.492·√(R/r) + 2.4), + where it is drawn (Audoly, Clauvelin and "
      "Neukirch 2007; Jawed et al. 2015). Terms of the order of r/R are not in it.\n"
      "The last number is a fit, and the friction is to first order.");
  s.table({"μ", "the knot is", "R/r", "T·R²/B", "theory", "% off"}, rows);
  s.atMost("traction of the widest overhand knot without friction", 100.0 * off, 5.0, "%");
  s.atLeast("the same: order in r/R", order, 0.8, "no unit");
  s.atMost("traction with friction, μ ≤ 0.1", rubbed, 10.0, "%");
}

}  // namespace

validation::Section threadMotionSection(const Options&, const std::string& command) {
  validation::Section s("23_thread_motion", "Threads in motion and in contact", command);
  s.text(
      "Threads as above, in steps of 1 ms where nothing else is said, by the solver of the World's threads. "
      "B is the bending stiffness, C the torsional stiffness, ρ the mass of a metre, h the step.");
  euler(s);
  ring(s);
  waves(s);
  hangingThread(s);
  energyOfAFreeRod(s);
  capstan(s);
  overhandKnot(s);
  return s;
}

}  // namespace vest::validate
