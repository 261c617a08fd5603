#include "vest_tissue/modelling/spline.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

namespace vest::modelling {
namespace {
constexpr int kSamplesPerSpan = 64;
}  // namespace

std::array<double, 4> catmullRom(double t) {
  const double t2 = t * t, t3 = t2 * t;
  return {0.5 * (-t + 2 * t2 - t3), 0.5 * (2 - 5 * t2 + 3 * t3), 0.5 * (t + 4 * t2 - 3 * t3),
          0.5 * (t3 - t2)};
}

Curve::Curve(std::vector<Vector3> points) : points_(std::move(points)) {
  if (points_.size() < 2) throw std::invalid_argument("a curve needs at least two points");
  for (std::size_t i = 1; i < points_.size(); ++i) {
    if (!((points_[i] - points_[i - 1]).norm() > 0.0)) {
      throw std::invalid_argument("neighbouring points " + std::to_string(i - 1) + " and " +
                                  std::to_string(i) + " of a curve coincide");
    }
  }
  const std::size_t samples = (points_.size() - 1) * kSamplesPerSpan;
  arc_.assign(samples + 1, 0.0);
  Vector3 last = raw(0.0);
  for (std::size_t i = 1; i <= samples; ++i) {
    const Vector3 next = raw(static_cast<double>(i) / kSamplesPerSpan);
    arc_[i] = arc_[i - 1] + (next - last).norm();
    last = next;
  }
}

Vector3 Curve::raw(double parameter) const {
  const int spans = static_cast<int>(points_.size()) - 1;
  const int span = std::clamp(static_cast<int>(std::floor(parameter)), 0, spans - 1);
  // Beyond the ends the neighbour is mirrored, so that the curve leaves its last point straight.
  const auto point = [&](int i) -> Vector3 {
    if (i < 0) return 2 * points_[0] - points_[1];
    if (i > spans) return 2 * points_[spans] - points_[spans - 1];
    return points_[i];
  };
  const auto w = catmullRom(parameter - span);
  return w[0] * point(span - 1) + w[1] * point(span) + w[2] * point(span + 1) + w[3] * point(span + 2);
}

double Curve::parameterAt(double arc_length) const {
  const auto upper = std::upper_bound(arc_.begin(), arc_.end(), arc_length);
  const std::size_t i =
      std::clamp<std::ptrdiff_t>(upper - arc_.begin(), 1, static_cast<std::ptrdiff_t>(arc_.size()) - 1);
  const double part = (arc_length - arc_[i - 1]) / (arc_[i] - arc_[i - 1]);
  return (static_cast<double>(i - 1) + std::clamp(part, 0.0, 1.0)) / kSamplesPerSpan;
}

Vector3 Curve::at(double arc_length) const {
  if (arc_length < 0) return raw(0.0) + arc_length * tangent(0.0);
  if (arc_length > length())
    return raw(static_cast<double>(points_.size() - 1)) + (arc_length - length()) * tangent(length());
  return raw(parameterAt(arc_length));
}

Vector3 Curve::tangent(double arc_length) const {
  const double step = length() * 1e-4;
  const double lower = std::clamp(arc_length - step, 0.0, length());
  const double upper = std::clamp(arc_length + step, 0.0, length());
  return (raw(parameterAt(upper)) - raw(parameterAt(lower))).normalized();
}

std::vector<SectionFrame> framesAlong(const Curve& curve, const std::vector<double>& arc_lengths,
                                      const Vector3& reference) {
  std::vector<SectionFrame> frames;
  frames.reserve(arc_lengths.size());
  for (const double arc : arc_lengths) {
    SectionFrame frame;
    frame.centre = curve.at(arc);
    frame.tangent = curve.tangent(arc);
    if (frames.empty()) {
      frame.x = reference - reference.dot(frame.tangent) * frame.tangent;
      if (frame.x.norm() < 1e-9 * reference.norm() + 1e-300) {
        throw std::invalid_argument("reference is parallel to the curve's first tangent");
      }
      frame.x.normalize();
    } else {
      const SectionFrame& before = frames.back();
      const Vector3 step = frame.centre - before.centre;
      const double c1 = step.squaredNorm();
      Vector3 x = before.x, tangent = before.tangent;
      if (c1 > 0) {
        x -= 2 / c1 * step.dot(x) * step;
        tangent -= 2 / c1 * step.dot(tangent) * step;
      }
      const Vector3 turn = frame.tangent - tangent;
      const double c2 = turn.squaredNorm();
      if (c2 > 0) x -= 2 / c2 * turn.dot(x) * turn;
      frame.x = (x - x.dot(frame.tangent) * frame.tangent).normalized();
    }
    frame.y = frame.tangent.cross(frame.x);
    frames.push_back(frame);
  }
  return frames;
}

double polarRadius(const std::vector<double>& radii, double angle) {
  const std::size_t count = radii.size();
  if (count == 1) return radii[0];
  if (count == 2) {
    const double c = std::cos(angle) / radii[0], s = std::sin(angle) / radii[1];
    return 1.0 / std::sqrt(c * c + s * s);
  }
  double place = angle / (2 * M_PI);
  place = (place - std::floor(place)) * static_cast<double>(count);
  const std::size_t span = std::min(static_cast<std::size_t>(place), count - 1);
  const auto w = catmullRom(place - static_cast<double>(span));
  double radius = 0;
  for (std::size_t k = 0; k < 4; ++k) radius += w[k] * radii[(span + k + count - 1) % count];
  return radius;
}

double sectionRadius(const std::vector<Section>& sections, double at, double angle) {
  const std::size_t count = sections.size();
  if (count == 1 || at <= sections.front().at) return polarRadius(sections.front().radii, angle);
  if (at >= sections.back().at) return polarRadius(sections.back().radii, angle);
  std::size_t i = 1;
  while (sections[i].at < at) ++i;
  const auto value = [&](std::size_t k) { return polarRadius(sections[k].radii, angle); };
  const auto slope = [&](std::size_t k) {  // Fritsch, Carlson, SIAM J. Numer. Anal. 17(2), 1980: no overshoot
    if (k == 0 || k + 1 == count) return 0.0;
    const double before = (value(k) - value(k - 1)) / (sections[k].at - sections[k - 1].at);
    const double after = (value(k + 1) - value(k)) / (sections[k + 1].at - sections[k].at);
    return before * after <= 0 ? 0.0 : 2 * before * after / (before + after);
  };
  const double span = sections[i].at - sections[i - 1].at;
  const double t = (at - sections[i - 1].at) / span, t2 = t * t, t3 = t2 * t;
  return (2 * t3 - 3 * t2 + 1) * value(i - 1) + (t3 - 2 * t2 + t) * span * slope(i - 1) +
         (-2 * t3 + 3 * t2) * value(i) + (t3 - t2) * span * slope(i);
}

}  // namespace vest::modelling
