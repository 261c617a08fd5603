#include "vest_tissue/modelling/ring_net.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>

#include <Eigen/Geometry>

namespace vest::modelling {
namespace {

// Place and scale of a ring on a centre line whose ends are rounded off: quarter ellipses of height `dome`.
struct Profile {
  double length, start_dome, end_dome;

  double total() const { return M_PI / 2 * (start_dome + end_dome) + length - start_dome - end_dome; }
  void at(double along, double& arc, double& scale) const {
    scale = 1.0;
    const double first = M_PI / 2 * start_dome, last = M_PI / 2 * end_dome;
    if (along < first) {
      arc = start_dome * (1 - std::cos(along / start_dome));
      scale = std::sin(along / start_dome);
    } else if (along > total() - last) {
      const double rest = (total() - along) / end_dome;
      arc = length - end_dome * (1 - std::cos(rest));
      scale = std::sin(rest);
    } else {
      arc = start_dome + along - first;
    }
  }
};

// Fraction of the profile below which `part` of the rings lie, for a density that is linear between its
// points.
double crowded(const std::vector<std::array<double, 2>>& density, double part) {
  if (density.empty()) return part;
  const auto at = [&](double x) {
    if (x <= density.front()[0]) return density.front()[1];
    for (std::size_t i = 1; i < density.size(); ++i) {
      if (x <= density[i][0]) {
        const double t = (x - density[i - 1][0]) / (density[i][0] - density[i - 1][0]);
        return (1 - t) * density[i - 1][1] + t * density[i][1];
      }
    }
    return density.back()[1];
  };
  constexpr int kSteps = 2000;
  double whole = 0;
  for (int i = 0; i < kSteps; ++i) whole += at((i + 0.5) / kSteps);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double next = sum + at((i + 0.5) / kSteps) / whole;
    if (next >= part) return (i + (part - sum) / (next - sum)) / kSteps;
    sum = next;
  }
  return 1.0;
}

double ringPerimeter(const RingNet& net, std::uint32_t ring) {
  double perimeter = 0;
  for (std::uint32_t k = 0; k < net.around; ++k) {
    perimeter += (net.knots[net.knot(ring, k + 1)] - net.knots[net.knot(ring, k)]).norm();
  }
  return perimeter;
}

double ringArea(const RingNet& net, std::uint32_t ring) {
  Vector3 centre = Vector3::Zero(), twice = Vector3::Zero();
  for (std::uint32_t k = 0; k < net.around; ++k) centre += net.knots[net.knot(ring, k)] / net.around;
  for (std::uint32_t k = 0; k < net.around; ++k) {
    twice += (net.knots[net.knot(ring, k)] - centre).cross(net.knots[net.knot(ring, k + 1)] - centre);
  }
  return 0.5 * twice.norm();
}

// Triangles of a polygon as a zigzag between its two sides; counter-clockwise like the polygon, or turned
// round.
template <class Emit>
void zigzag(std::uint32_t first, std::uint32_t count, bool reverse, Emit emit) {
  std::uint32_t low = first, high = first + count - 1;
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    reverse ? emit(a % count, c % count, b % count) : emit(a % count, b % count, c % count);
  };
  while (low + 1 < high) {
    triangle(low, low + 1, high);
    ++low;
    if (low + 1 < high) {
      triangle(low, high - 1, high);
      --high;
    }
  }
}

void addWalls(RingNet& net, double wall_thickness) {
  for (std::uint32_t r = 0; r < net.rings; ++r) {
    const double perimeter = ringPerimeter(net, r), area = ringArea(net, r);
    net.mean_radius.push_back(perimeter / (2 * M_PI));
    net.wall.push_back(wall_thickness > 0 ? std::min(perimeter * wall_thickness, area) : area);
  }
}

}  // namespace

RingNet makeTube(const TubeSpec& spec) {
  if (spec.rings < 3 || spec.around < 4)
    throw std::invalid_argument("a tube needs at least 3 rings of 4 knots");
  if (spec.sections.empty()) throw std::invalid_argument("a tube needs at least one cross-section");
  const Curve curve(spec.centre);
  if (spec.start_dome + spec.end_dome > curve.length() * (1 + 1e-9)) {
    throw std::invalid_argument("domes are longer than the centre curve of " +
                                std::to_string(curve.length()) + " m");
  }
  RingNet net;
  net.rings = spec.rings;
  net.around = spec.around;
  net.start = spec.start;
  net.end = spec.end;
  net.inside = spec.inside;

  const Profile profile{curve.length(), spec.start_dome, spec.end_dome};
  const int before = spec.start_dome > 0, after = spec.end_dome > 0;
  std::vector<double> arcs, scales;
  for (std::uint32_t r = 0; r < spec.rings; ++r) {
    double arc = 0, scale = 1;
    const double part = static_cast<double>(r + before) / (spec.rings - 1 + before + after);
    profile.at(profile.total() * crowded(spec.density, part), arc, scale);
    arcs.push_back(arc);
    scales.push_back(scale);
  }
  const auto frames = framesAlong(curve, arcs, spec.reference);
  for (std::uint32_t r = 0; r < spec.rings; ++r) {
    const SectionFrame& frame = frames[r];
    for (std::uint32_t k = 0; k < spec.around; ++k) {
      const double angle = 2 * M_PI * k / spec.around;
      const double radius = scales[r] * sectionRadius(spec.sections, arcs[r] / curve.length(), angle);
      net.knots.push_back(frame.centre + radius * (std::cos(angle) * frame.x + std::sin(angle) * frame.y));
    }
  }
  if (spec.start == End::Pole) net.knots.push_back(curve.at(spec.start_mouth));
  if (spec.end == End::Pole) net.knots.push_back(curve.at(curve.length() - spec.end_mouth));
  net.station = arcs;
  addWalls(net, spec.wall_thickness);
  return net;
}

RingNet makeSheet(const SheetSpec& spec) {
  if (spec.curves.size() < 2) throw std::invalid_argument("a sheet needs at least two curves");
  if (spec.stations < 3 || spec.height_knots < 3)
    throw std::invalid_argument("a sheet needs at least 3 stations of 3 knots");
  if (!(spec.thickness > 0)) throw std::invalid_argument("a sheet needs a thickness > 0");
  RingNet net;
  net.rings = spec.stations;
  net.around = 2 * spec.height_knots;
  net.start = net.end = End::Zip;
  std::vector<Curve> curves;
  for (const auto& points : spec.curves) curves.emplace_back(points);
  const auto profileAt = [&](double fraction) {
    std::vector<Vector3> points;
    for (const auto& curve : curves) points.push_back(curve.at(fraction * curve.length()));
    return Curve(points);
  };
  const std::uint32_t height = spec.height_knots;
  double station = 0;
  for (std::uint32_t r = 0; r < spec.stations; ++r) {
    const double fraction = static_cast<double>(r) / (spec.stations - 1);
    const Curve profile = profileAt(fraction);
    const Curve before = profileAt(std::max(0.0, fraction - 0.01)),
                after = profileAt(std::min(1.0, fraction + 0.01));
    std::vector<Vector3> front, back;
    for (std::uint32_t k = 0; k < height; ++k) {
      const double part = static_cast<double>(k) / (height - 1);
      const Vector3 place = profile.at(part * profile.length());
      const Vector3 along =
          (after.at(part * after.length()) - before.at(part * before.length())).normalized();
      const Vector3 normal = profile.tangent(part * profile.length()).cross(along).normalized();
      const double edge = (k == 0 || k + 1 == height) ? 0.6 : 1.0;  // rounded free edges
      front.push_back(place + 0.5 * edge * spec.thickness * normal);
      back.push_back(place - 0.5 * edge * spec.thickness * normal);
    }
    if (r > 0) station += (front[height / 2] - net.knots[(r - 1) * net.around + height / 2]).norm();
    net.station.push_back(station);
    net.knots.insert(net.knots.end(), front.begin(), front.end());
    net.knots.insert(net.knots.end(), back.rbegin(), back.rend());
  }
  addWalls(net, 0.0);
  return net;
}

RingNet makeRevolve(const RevolveSpec& spec) {
  std::vector<Vector3> points;
  for (const auto& p : spec.profile) points.push_back({p[1], 0.0, p[0]});
  const Curve curve(points);
  const Vector3 axis = spec.axis.normalized();
  const Vector3 x = (spec.reference - spec.reference.dot(axis) * axis).normalized(), y = axis.cross(x);
  if (!(x.norm() > 0.5)) throw std::invalid_argument("axis and reference must be two directions");
  RingNet net;
  net.rings = spec.rings;
  net.around = spec.around;
  for (std::size_t i = 1; i + 1 < spec.profile.size(); ++i)
    if (!(spec.profile[i][1] > 0))
      throw std::invalid_argument("profile: a radius of " + std::to_string(spec.profile[i][1]) +
                                  " m between its ends; allowed: > 0 but at its ends");
  net.start = spec.profile.front()[1] > 0 ? End::Cap : End::Pole;
  net.end = spec.profile.back()[1] > 0 ? End::Cap : End::Pole;
  const auto at = [&](double radius, double height, double angle) -> Vector3 {
    return spec.origin + height * axis + radius * (std::cos(angle) * x + std::sin(angle) * y);
  };
  const int before = net.start == End::Pole, after = net.end == End::Pole;
  for (std::uint32_t r = 0; r < spec.rings; ++r) {
    const double arc = curve.length() * (r + before) / (spec.rings - 1 + before + after);
    const Vector3 place = curve.at(arc);
    if (!(place.x() > 0))
      throw std::invalid_argument("profile: a radius of " + std::to_string(place.x()) +
                                  " m between its points; allowed: > 0 but at its ends");
    for (std::uint32_t k = 0; k < spec.around; ++k)
      net.knots.push_back(at(place.x(), place.z(), 2 * M_PI * k / spec.around));
    net.station.push_back(arc);
  }
  if (before) net.knots.push_back(at(0, spec.profile.front()[0], 0));
  if (after) net.knots.push_back(at(0, spec.profile.back()[0], 0));
  addWalls(net, spec.wall_thickness);
  return net;
}

std::vector<NetLink> makeLinks(const RingNet& net, std::uint32_t springs,
                               const std::vector<LinkClass>& fillers) {
  const std::uint32_t n = net.around, rings = net.rings;
  const auto ofClass = [&](LinkClass kind) {
    std::vector<NetLink> links;
    const auto add = [&](std::uint32_t a, std::uint32_t b) { links.push_back({kind, a, b}); };
    for (std::uint32_t r = 0; r < rings; ++r) {
      for (std::uint32_t k = 0; k < n; ++k) {
        const bool even = r % 2 == 0;  // diagonals lean left and right in turn: no twist under tension
        switch (kind) {
          case LinkClass::Ring:
            add(net.knot(r, k), net.knot(r, k + 1));
            break;
          case LinkClass::Long:
            if (r + 1 < rings) add(net.knot(r, k), net.knot(r + 1, k));
            break;
          case LinkClass::Diagonal:
            if (r + 1 < rings) add(net.knot(r, k + !even), net.knot(r + 1, k + even));
            break;
          case LinkClass::Cross:
            if (r + 1 < rings) add(net.knot(r, k + even), net.knot(r + 1, k + !even));
            break;
          case LinkClass::Ring2:
            add(net.knot(r, k), net.knot(r, k + 2));
            break;
          case LinkClass::Strut:
            if (n % 2 || k < n / 2) add(net.knot(r, k), net.knot(r, k + n / 2));
            break;
          case LinkClass::Long2:
            if (r + 2 < rings) add(net.knot(r, k), net.knot(r + 2, k));
            break;
          case LinkClass::Leaf:
            if (k > 0 && k + 1 < n / 2) add(net.knot(r, k), net.knot(r, n - 1 - k));
            break;
          case LinkClass::Pole:
            if (r == 0 && net.start == End::Pole) add(net.knot(0, k), net.startPole());
            if (r + 1 == rings && net.end == End::Pole) add(net.knot(r, k), net.endPole());
            break;
        }
      }
    }
    return links;
  };
  std::vector<NetLink> result;
  std::set<std::pair<std::uint32_t, std::uint32_t>> known;
  const auto fresh = [&](const NetLink& link) { return known.insert(std::minmax(link.a, link.b)).second; };
  for (const LinkClass kind : {LinkClass::Ring, LinkClass::Long, LinkClass::Diagonal, LinkClass::Pole}) {
    for (const NetLink& link : ofClass(kind))
      if (fresh(link)) result.push_back(link);
  }
  const std::size_t least = result.size();
  for (const LinkClass kind : fillers) {
    std::vector<NetLink> candidates;
    for (const NetLink& link : ofClass(kind))
      if (fresh(link)) candidates.push_back(link);
    const std::size_t room = springs > result.size() ? springs - result.size() : 0;
    const std::size_t take = springs == 0 ? candidates.size() : std::min(room, candidates.size());
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if ((i + 1) * take / candidates.size() > i * take / candidates.size()) result.push_back(candidates[i]);
    }
  }
  if (springs != 0 && result.size() != springs) {
    throw std::invalid_argument("springs is " + std::to_string(springs) +
                                ", possible with these fillers is " + std::to_string(least) + " to " +
                                std::to_string(result.size()) + "; leave it out to take all");
  }
  return result;
}

std::vector<std::array<std::uint32_t, 3>> knotTriangles(const RingNet& net) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (net.inside) std::swap(b, c);
    triangles.push_back({a, b, c});
  };
  const std::uint32_t n = net.around;
  for (const bool at_end : {false, true}) {
    const std::uint32_t ring = at_end ? net.rings - 1 : 0;
    if ((at_end ? net.end : net.start) == End::Pole) {
      const std::uint32_t pole = at_end ? net.endPole() : net.startPole();
      for (std::uint32_t k = 0; k < n; ++k) {
        at_end ? add(pole, net.knot(ring, k), net.knot(ring, k + 1))
               : add(pole, net.knot(ring, k + 1), net.knot(ring, k));
      }
    } else {
      zigzag(0, n, !at_end, [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        add(net.knot(ring, a), net.knot(ring, b), net.knot(ring, c));
      });
    }
  }
  for (std::uint32_t r = 0; r + 1 < net.rings; ++r) {
    for (std::uint32_t k = 0; k < n; ++k) {
      const std::uint32_t a = net.knot(r, k), b = net.knot(r, k + 1), c = net.knot(r + 1, k + 1),
                          d = net.knot(r + 1, k);
      if (r % 2 == 0) {
        add(a, b, c);
        add(a, c, d);
      } else {
        add(a, b, d);
        add(b, c, d);
      }
    }
  }
  return triangles;
}

std::vector<std::array<std::uint32_t, 3>> wallTriangles(const RingNet& net) {
  std::vector<std::array<std::uint32_t, 3>> triangles = knotTriangles(net);
  const auto ringOf = [&](std::uint32_t knot) { return knot / net.around; };
  triangles.erase(std::remove_if(triangles.begin(), triangles.end(),
                                 [&](const auto& t) {
                                   return ringOf(t[0]) == ringOf(t[1]) && ringOf(t[0]) == ringOf(t[2]) &&
                                          ringOf(t[0]) < net.rings;
                                 }),
                  triangles.end());
  return triangles;
}

double enclosedVolume(const std::vector<Vector3>& points,
                      const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  double six = 0;
  const Vector3 origin = points.empty() ? Vector3::Zero() : points[0];
  for (const auto& t : triangles) {
    six += (points[t[0]] - origin).dot((points[t[1]] - origin).cross(points[t[2]] - origin));
  }
  return six / 6;
}

}  // namespace vest::modelling
