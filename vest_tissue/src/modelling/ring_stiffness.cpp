#include "vest_tissue/modelling/ring_stiffness.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/QR>

namespace vest::modelling {
namespace {

double spacing(const RingNet& net, std::uint32_t ring) {
  const std::uint32_t before = ring > 0 ? ring - 1 : ring, after = std::min(ring + 1, net.rings - 1);
  double length = 0;
  for (std::uint32_t k = 0; k < net.around; ++k) {
    length += (net.knots[net.knot(after, k)] - net.knots[net.knot(before, k)]).norm();
  }
  return length / net.around / std::max(1u, after - before);
}

/// What a link begins with: longitudinal and diagonal ones share wall(ring)/around, those along a ring have
/// wall thickness × spacing. Assumed, so that along and across each add up to the solid section (the
/// diagonals count for both).
double share(const RingNet& net, const NetLink& link) {
  const std::uint32_t ring = std::min(std::min(link.a, link.b) / net.around, net.rings - 1);
  const double along = net.wall[ring] / net.around;
  const double perimeter = 2 * M_PI * net.mean_radius[ring];
  const double around = net.wall[ring] / perimeter * spacing(net, ring);
  switch (link.kind) {
    case LinkClass::Ring:
      return 0.6 * around;
    case LinkClass::Long:
      return 0.6 * along;
    case LinkClass::Diagonal:
    case LinkClass::Cross:
      return 0.4 * std::min(along, around);
    case LinkClass::Pole:
      return 0.5 * along;
    case LinkClass::Ring2:
      return 0.3 * around;
    case LinkClass::Strut:
      return 0.4 * around;
    case LinkClass::Long2:
      return 0.2 * along;
    case LinkClass::Leaf:
      return 0.5 * std::min(along, around);
  }
  return 0.0;
}

/// First and last piece of those that a link crosses or lies at: piece 0 is between rings 0 and 1. False: it
/// goes to a pole.
bool piecesOf(const RingNet& net, const NetLink& link, std::uint32_t& first, std::uint32_t& last) {
  const std::uint32_t a = link.a / net.around, b = link.b / net.around;
  if (a >= net.rings || b >= net.rings) return false;
  const std::uint32_t low = std::min(a, b), high = std::max(a, b);
  first = low < high ? low : low > 0 ? low - 1 : 0;
  last = std::min(low < high ? high - 1 : low, net.rings - 2);
  return true;
}

/// Direction of the meridian at a knot.
Vector3 meridian(const RingNet& net, std::uint32_t knot) {
  const std::uint32_t ring = knot / net.around, k = knot % net.around;
  return (net.knots[net.knot(std::min(ring + 1, net.rings - 1), k)] -
          net.knots[net.knot(ring > 0 ? ring - 1 : 0, k)])
      .normalized();
}

/// Parts of a link's strain: of the surface that it lies in stretched along by 1, stretched across, sheared
/// with the rings, and sheared against them where they come back. A tube turns with the rings. A sheet, whose
/// rings run up one leaf and down the other one, is twisted by that, and the other shear leaves it flat.
Eigen::Vector4d partsOf(const RingNet& net, const NetLink& link) {
  if (link.kind == LinkClass::Leaf) return Eigen::Vector4d::Zero();  // across the thickness, which is free
  const Vector3 u = (net.knots[link.b] - net.knots[link.a]).normalized();
  const double along = u.dot((meridian(net, link.a) + meridian(net, link.b)).normalized());
  const double across = std::sqrt(std::max(0.0, 1.0 - along * along));
  const std::uint32_t n = net.around, a = link.a % n, b = link.b % n;
  const double shear = ((b + n - a) % n <= n / 2 ? 1 : -1) * along * across;
  const double flat = net.start != End::Zip ? 0.0 : a + b >= n ? -shear : shear;
  return {along * along, across * across, shear, flat};
}

double areaOf(const Vector3& a, const Vector3& b, const Vector3& c) {
  return 0.5 * (b - a).cross(c - a).norm();
}

/// m³ of solid wall between rings r and r+1.
double wallBetween(const RingNet& net, std::uint32_t r) {
  const auto thickness = [&](std::uint32_t ring) {
    return net.wall[ring] / (2 * M_PI * net.mean_radius[ring]);
  };
  double surface = 0.0;
  for (std::uint32_t k = 0; k < net.around; ++k) {
    const Vector3 &a = net.knots[net.knot(r, k)], &b = net.knots[net.knot(r, k + 1)],
                  &c = net.knots[net.knot(r + 1, k)], &d = net.knots[net.knot(r + 1, k + 1)];
    surface += 0.5 * (areaOf(a, b, c) + areaOf(b, d, c) + areaOf(a, b, d) + areaOf(a, d, c));
  }
  return 0.5 * (thickness(r) + thickness(r + 1)) * surface;
}

}  // namespace

std::vector<double> axialModuli(const RingNet& net, const std::vector<NetLink>& links,
                                const std::vector<double>& areas) {
  // Twice the energy of each piece is q' M q of q = (1, across, two shears): what is free is condensed out.
  std::vector<Eigen::Matrix4d> energy(net.rings - 1, Eigen::Matrix4d::Zero());
  for (std::size_t i = 0; i < links.size(); ++i) {
    std::uint32_t first = 0, last = 0;
    if (!piecesOf(net, links[i], first, last)) continue;
    const double length = (net.knots[links[i].b] - net.knots[links[i].a]).norm();
    const Eigen::Vector4d parts = partsOf(net, links[i]);
    // Half of a ring lies at each piece beside it; at an end the other half is nobody's.
    const bool ring = links[i].a / net.around == links[i].b / net.around;
    const double share_of = ring ? 0.5 : 1.0 / (last - first + 1);
    for (std::uint32_t r = first; r <= last; ++r)
      energy[r] += share_of * areas[i] * length * parts * parts.transpose();
  }
  std::vector<double> moduli;
  for (std::uint32_t r = 0; r + 1 < net.rings; ++r) {
    const Eigen::Matrix4d& m = energy[r];
    const Eigen::Matrix3d free = m.bottomRightCorner<3, 3>();
    const Eigen::Vector3d coupled = m.block<3, 1>(1, 0);
    const double stored = m(0, 0) - coupled.dot(free.completeOrthogonalDecomposition().solve(coupled));
    moduli.push_back(stored / wallBetween(net, r));
  }
  return moduli;
}

std::vector<double> linkAreas(const RingNet& net, const std::vector<NetLink>& links) {
  constexpr int kRounds = 100;
  constexpr double kGood = 1e-4;  // of the modulus
  std::vector<double> areas;
  for (const NetLink& link : links) areas.push_back(share(net, link));
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> moduli = axialModuli(net, links, areas);
    double worst = 0.0;
    for (const double m : moduli) worst = std::max(worst, std::fabs(m - 1.0));
    if (worst < kGood) break;
    for (std::size_t i = 0; i < links.size(); ++i) {
      std::uint32_t first = 0, last = 0;
      if (!piecesOf(net, links[i], first, last))
        first = last = std::min(links[i].a, links[i].b) < net.around ? 0 : net.rings - 2;
      double factor = 0.0;
      for (std::uint32_t r = first; r <= last; ++r) factor += 1.0 / moduli[r];
      areas[i] *= factor / (last - first + 1);
    }
  }
  return areas;
}

}  // namespace vest::modelling
