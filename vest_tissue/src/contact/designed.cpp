#include <algorithm>
#include <array>
#include <cmath>

#include "../scene/stages.h"
#include "vest_tissue/base/nearest.h"

namespace vest::scene {
namespace {

/// Whether a point lies nearer than `reach` to an object's surface, or inside it.
bool within(const Eigen::Vector3d& x, const Object& other, bool closed, double reach) {
  constexpr double kDeepest = 0.03;  // m: no organ of a scene lies deeper in another by design
  double best = closed ? kDeepest : reach;
  bool inside = false;
  for (const auto& t : other.contact_triangles) {
    const std::array<Eigen::Vector3d, 3> p{other.position[t[0]], other.position[t[1]], other.position[t[2]]};
    const Eigen::Array3d low = p[0].cwiseMin(p[1]).cwiseMin(p[2]).array() - best;
    const Eigen::Array3d high = p[0].cwiseMax(p[1]).cwiseMax(p[2]).array() + best;
    if ((x.array() < low).any() || (x.array() > high).any()) continue;
    const contact::Nearest n = contact::nearest(x, p);
    if (!(n.distance < best)) continue;
    best = n.distance;
    inside = closed && (p[1] - p[0]).cross(p[2] - p[0]).dot(x - p[0]) < 0.0;
  }
  return best < reach || inside;
}

/// m: so near to each other, what belongs together does not collide; assumed.
constexpr double kDesigned = 0.005;
/// m: a knot that lies so little deeper in a rigid object than it is drawn rests there, and goes on to;
/// others may lie deeper than they do by as much. Assumed.
constexpr float kResting = 1e-4f;

/// Whether a knot lies nearer than `reach` to a part of its own object's surface that is not beside it.
bool touchesItself(const Object& o, const ObjectConstants& c, std::uint32_t knot, double reach) {
  for (const auto& t : o.contact_triangles) {
    if (!c.onSurface(knot) || c.beside(knot, t[0])) continue;
    const std::array<Eigen::Vector3d, 3> p{o.position[t[0]], o.position[t[1]], o.position[t[2]]};
    const Eigen::Array3d x = o.position[knot].array();
    if ((x < p[0].cwiseMin(p[1]).cwiseMin(p[2]).array() - reach).any() ||
        (x > p[0].cwiseMax(p[1]).cwiseMax(p[2]).array() + reach).any())
      continue;
    if (contact::nearest(o.position[knot], p).distance < reach) return true;
  }
  return false;
}

/// Knots of the surface that are beside each (ObjectConstants::beside): three edges away or less, or by a way
/// over the surface of three times `reach`, so that none of them touches at rest. A tube does not collide
/// with its own section either: stations less than three radii apart.
void findBeside(const Object& o, double reach, ObjectConstants& c) {
  const std::size_t knots = o.position.size();
  std::vector<std::vector<std::uint32_t>> next(knots);
  for (const auto& t : o.contact_triangles)
    for (std::size_t e = 0; e < 3; ++e)
      next[t[e]].push_back(t[(e + 1) % 3]), next[t[(e + 1) % 3]].push_back(t[e]);
  const std::size_t rings = c.tube.ringCount();
  double radius2 = 0.0;
  for (std::size_t r = 0; r < rings; ++r) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const auto k : c.tube.knots(r))
      centre += o.position[k] / static_cast<double>(c.tube.knots(r).size());
    for (const auto k : c.tube.knots(r)) radius2 = std::max(radius2, (o.position[k] - centre).squaredNorm());
  }
  struct Way {
    double length;
    int edges;
    std::uint32_t knot;
  };
  std::vector<Way> ways;
  c.beside_first.assign(1, 0);
  for (std::uint32_t i = 0; i < knots; ++i) {
    std::vector<std::uint32_t> own;
    ways.assign(next[i].empty() ? 0 : 1, {0.0, 0, i});
    for (std::size_t n = 0; n < ways.size(); ++n) {  // shortest ways within the bounds, each knot's renewed
      const Way from = ways[n];
      own.push_back(from.knot);
      for (const std::uint32_t k : next[from.knot]) {
        const Way to{from.length + (o.position[k] - o.position[from.knot]).norm(), from.edges + 1, k};
        const auto known = std::find_if(ways.begin(), ways.end(), [&](const Way& w) { return w.knot == k; });
        if (known == ways.end() && (to.edges <= 3 || to.length < 3.0 * reach)) ways.push_back(to);
      }
    }
    for (std::size_t r = 0; r < rings && !own.empty() && c.tube.ringOf(i) >= 0; ++r)
      if (std::abs(c.tube.station(r) - c.tube.stationOf(i)) < 3.0 * std::sqrt(radius2))
        own.insert(own.end(), c.tube.knots(r).begin(), c.tube.knots(r).end());
    std::sort(own.begin(), own.end());
    own.erase(std::unique(own.begin(), own.end()), own.end());
    c.beside_knots.insert(c.beside_knots.end(), own.begin(), own.end());
    c.beside_first.push_back(static_cast<std::uint32_t>(c.beside_knots.size()));
  }
}

}  // namespace

void ignoreDesignedContacts(WorldModel& m) {
  const auto& d = m.description;
  for (ObjectConstants& c : m.objects)
    c.together.assign(d.objects.size(), 0), c.designed.resize(d.objects.size());
  const auto join = [&](std::size_t a, std::size_t b) {
    m.objects[a].together[b] = m.objects[b].together[a] = 1;
  };
  m.start.jaws_pass.assign(d.objects.size(), 0), m.start.blades_pass.assign(d.objects.size(), 0);
  for (const std::size_t a : m.bodies) {
    ObjectState& s = m.start.objects[a];
    for (std::size_t b = 0; b < d.objects.size(); ++b) {
      if (a == b || d.objects[b].contact_triangles.empty()) continue;
      const Object& other = d.objects[b];
      if (!m.objects[b].deforms) {
        const Object& own = d.objects[a];
        const auto gap = [&](const Eigen::Vector3d& x) {
          Eigen::Vector3f g;
          return m.objects[b].grid.distance(x.cast<float>(), g) - static_cast<float>(own.contact_thickness);
        };
        for (std::size_t i = 0; i < own.position.size(); ++i) {
          const float lies = gap(own.position[i]);
          if (lies >= 0.0f) continue;
          const float drawn = own.rest_position.empty() ? 0.0f : std::min(0.0f, gap(own.rest_position[i]));
          s.depth[i] = std::min(s.depth[i], lies < drawn - kResting ? lies - kResting : drawn);
        }
        continue;
      }
      const double reach = d.objects[a].contact_thickness + other.contact_thickness + 3e-4;
      for (std::size_t i = 0; i < d.objects[a].position.size(); ++i) {
        if (within(d.objects[a].position[i], other, m.objects[b].closed, reach)) {
          join(a, b);
          break;
        }
      }
    }
  }
  for (const ConnectionState& c : m.start.connections) join(c.end0.object, c.end1.object);
  for (const std::size_t a : m.bodies) {
    m.objects[a].together[a] = !d.objects[a].full_contact;
    if (!m.objects[a].together[a])
      findBeside(d.objects[a], 2.0 * d.objects[a].contact_thickness, m.objects[a]);
    for (std::size_t b = 0; b < d.objects.size(); ++b) {
      if (!m.fullContact(a, b) || (a == b) == (m.objects[a].together[b] != 0)) continue;
      const double reach = d.objects[a].contact_thickness + d.objects[b].contact_thickness;
      auto& knots = m.objects[a].designed[b];
      knots.assign(d.objects[a].position.size(), 0);
      for (std::uint32_t i = 0; i < knots.size(); ++i)
        knots[i] =
            a == b ? touchesItself(d.objects[a], m.objects[a], i, 2.0 * reach)
                   : within(d.objects[a].position[i], d.objects[b], m.objects[b].closed, reach + kDesigned);
    }
  }
  for (const std::size_t a : m.bodies)
    for (const std::size_t b : m.bodies)
      if (a != b && m.fullContact(a, b)) m.objects[a].together[b] = 0;
}

}  // namespace vest::scene
