#include <algorithm>
#include <cmath>

#include "../scene/stages.h"
#include "organ_pairs.h"
#include "vest_tissue/scene/cavity_walls.h"

namespace vest::scene {
namespace {

/// m/s: what is faster was not moved but put there, and is at rest (assumed).
constexpr double kFastestTool = 10.0;

using contact::Nearest;
using contact::PlaneContact;
using contact::ToolContact;
using Eigen::Vector3d;
using Eigen::Vector3f;
using net::Block;

constexpr double kMargin = 0.0015;       ///< m: contacts are prepared this much before they touch (tuned)
constexpr double kJawFriction = 0.6;     ///< serrated jaws on tissue; assumed
constexpr double kSteepest = 1.733;      ///< no unit: of trilinear interpolation between distances, sqrt(3)
constexpr double kCoarse = 1e-5;         ///< m: more than single precision loses in a ball's distance there
constexpr double kSinksOn = 0.001;       ///< m: until knots look again how far they are from a wall (tuned)
constexpr double kFreeWay = 0.001;       ///< m: until a knot does (tuned)
constexpr double kGrip = 0.5;            ///< of critical: damping that friction amounts to at most
constexpr double kContactDamping = 0.3;  ///< of critical, along the normal
constexpr double kShallow = 0.5;         ///< of the reach: contacts that are renewed within the step (tuned)
constexpr std::size_t kMostContacts = 512;
constexpr float kBore = 0.006f;  ///< m: half the width of a trocar of 12 mm (assumed)
/// Of a gradient, squared: less is that of a table of distances that ends there, and says nothing of a wall
/// (tuned).
constexpr float kWhole = 0.5f;
constexpr float kEnters = 0.3f;  ///< cosine: a wall that an instrument enters through, not one that it meets

std::uint64_t sideKey(std::uint8_t tool, std::uint8_t capsule, std::uint16_t object, std::uint32_t triangle) {
  return (static_cast<std::uint64_t>(tool) << 56) | (static_cast<std::uint64_t>(capsule) << 48) |
         (static_cast<std::uint64_t>(object) << 32) | triangle;
}
std::uint64_t sideKey(const ContactSide& s) {
  return sideKey(s.tool, s.capsule, s.object, s.triangle);
}

/// Marks knots within `reach` of a segment; whether there are any. Same operations for every knot:
/// vectorised.
bool markNear(const ObjectState& s, const Vector3d& a, const Vector3d& b, double reach,
              std::vector<std::uint8_t>& near) {
  const float ax = float(a.x()), ay = float(a.y()), az = float(a.z());
  const float bx = float(b.x() - a.x()), by = float(b.y() - a.y()), bz = float(b.z() - a.z());
  const float squared = bx * bx + by * by + bz * bz, inverse = squared > 0.0f ? 1.0f / squared : 0.0f;
  const float reach2 = static_cast<float>(reach * reach);
  const float *x = row(s, Block::X), *y = row(s, Block::Y), *z = row(s, Block::Z);
  std::uint8_t* __restrict const out = near.data();
  const std::size_t knots = s.block.knots();
  unsigned any = 0;
  for (std::size_t i = 0; i < knots; ++i) {
    const float px = x[i] - ax, py = y[i] - ay, pz = z[i] - az;
    float t = (px * bx + py * by + pz * bz) * inverse;
    t = t > 0.0f ? t : 0.0f;
    t = t < 1.0f ? t : 1.0f;
    const float dx = px - t * bx, dy = py - t * by, dz = pz - t * bz;
    const std::uint8_t is = dx * dx + dy * dy + dz * dz < reach2;
    out[i] = is;
    any |= is;
  }
  return any != 0;
}

/// Trocars of the instruments that are there: holes in the wall that they enter through.
struct Bores {
  struct Bore {
    Vector3f pivot, inward;
  };
  std::array<Bore, tools::kInstrumentCount> list;
  std::size_t count = 0;

  explicit Bores(const WorldState& state) {
    for (const auto& proxy : state.proxies) {
      if (!proxy.present) continue;
      const Vector3d inward = proxy.pose.orientation * Vector3d::UnitZ();
      list[count++] = {proxy.pose.pivot.cast<float>(), inward.cast<float>()};
    }
  }
  /// Distance to a wall that has these holes, and its gradient: inside a hole what is nearest is its side.
  /// @return whether a hole changed it
  bool open(const Vector3f& p, float& distance, Vector3f& gradient) const {
    bool changed = false;
    for (std::size_t i = 0; i < count; ++i) {
      const Vector3f way = p - list[i].pivot, off = way - list[i].inward.dot(way) * list[i].inward;
      const float side = std::sqrt(off.squaredNorm());
      if (!(kBore - side > distance) || !(side > 1e-6f)) continue;
      const bool outside = distance < 0.0f && gradient.squaredNorm() < kWhole;  // far beyond the wall
      if (!outside && !(gradient.dot(list[i].inward) > kEnters)) continue;
      distance = kBore - side;
      gradient = -off / side;
      changed = true;
    }
    return changed;
  }
};

/// m: a way on which a knot at p does not meet a cavity's wall that hangs no lower than this; 0: none is
/// known. All that could hang down to it is looked at where it would be (SunkenWall::above).
/// @param free m: from what the knot needs to the wall where nothing is missing, as it is now
double freeBelow(contact::SunkenWall wall, const Vector3f& p, float free) {
  wall.propped = false;
  const double z = static_cast<double>(p.z());
  const double high = wall.above(p.cast<double>() + Vector3d(0, 0, kFreeWay)).greatest;
  return high < wall.high && kSteepest * (kFreeWay + high - z) + kRounding < static_cast<double>(free)
             ? kFreeWay
             : 0.0;
}

bool boxTouches(const ObjectScratch& o, const Vector3d& a, const Vector3d& b, double reach) {
  for (int c = 0; c < 3; ++c) {
    if (std::min(a[c], b[c]) - reach > o.high[c] || std::max(a[c], b[c]) + reach < o.low[c]) return false;
  }
  return true;
}

/// A triangle is further from a segment than `reach`, told by the ball around it: spares most of the exact
/// distances.
struct OutOfReach {
  const float *x, *y, *z;
  float a[3], along[3], inverse, reach;

  OutOfReach(const ObjectState& s, const Vector3d& from, const Vector3d& to, double within)
      : x(row(s, Block::X)), y(row(s, Block::Y)), z(row(s, Block::Z)) {
    const double squared = (to - from).squaredNorm();
    for (int e = 0; e < 3; ++e)
      a[e] = static_cast<float>(from[e]), along[e] = static_cast<float>(to[e] - from[e]);
    inverse = squared > 0.0 ? static_cast<float>(1.0 / squared) : 0.0f;
    reach = static_cast<float>(within + kCoarse);
  }
  bool operator()(const std::array<std::uint32_t, 3>& k) const {
    const float p[3][3] = {
        {x[k[0]], y[k[0]], z[k[0]]}, {x[k[1]], y[k[1]], z[k[1]]}, {x[k[2]], y[k[2]], z[k[2]]}};
    float middle[3], from[3], on = 0.0f, radius2 = 0.0f, off2 = 0.0f;
    for (int e = 0; e < 3; ++e) {
      middle[e] = (p[0][e] + p[1][e] + p[2][e]) * (1.0f / 3.0f), from[e] = middle[e] - a[e];
      on += from[e] * along[e];
    }
    const float t = std::min(std::max(on * inverse, 0.0f), 1.0f);
    for (const auto& corner : p) {
      const float dx = corner[0] - middle[0], dy = corner[1] - middle[1], dz = corner[2] - middle[2];
      radius2 = std::max(radius2, dx * dx + dy * dy + dz * dz);
    }
    for (int e = 0; e < 3; ++e) {
      const float off = from[e] - t * along[e];
      off2 += off * off;
    }
    const float most = reach + std::sqrt(radius2);
    return off2 > most * most;
  }
};

/// Key of the feature (corner, edge or face) that the weights name, so that triangles that share it count
/// once.
std::uint64_t featureKey(const std::array<std::uint32_t, 3>& k, const std::array<double, 3>& w,
                         std::size_t triangle) {
  std::uint32_t on[3] = {};
  int n = 0;
  for (int i = 0; i < 3; ++i)
    if (w[i] > 1e-6) on[n++] = k[i];
  if (n == 3) return (1ull << 63) | triangle;
  if (n == 1) return on[0];
  if (on[0] > on[1]) std::swap(on[0], on[1]);
  return (static_cast<std::uint64_t>(on[0] + 1) << 24) | on[1];
}

/// Where a contact is, from the nearest points of its capsule and its triangle.
void placeContact(const Context& c, const Nearest& n, const Vector3d& normal,
                  const interaction::PlacedCapsule& before, const interaction::PlacedCapsule& after,
                  ToolContact& r) {
  const Vector3d start = before.a + (before.b - before.a) * n.s, end = after.a + (after.b - after.a) * n.s;
  for (std::size_t e = 0; e < 3; ++e) {
    const auto i = static_cast<Eigen::Index>(e);
    r.weights[e] = static_cast<float>(n.weights[e]);
    r.normal[e] = static_cast<float>(normal[i]);
    r.start[e] = static_cast<float>(start[i]);
    r.travel[e] = static_cast<float>(end[i] - start[i]);
  }
  if (after.which < 0) return;
  const auto& proxy = c.state.proxies[r.tool];
  const Vector3d z = proxy.pose.orientation * Vector3d::UnitZ(),
                 y = proxy.pose.orientation * Vector3d::UnitY();
  const Vector3d arm = end - (proxy.pose.tip - tools::toolGeometry(proxy.tool).jaw_length * z);
  const Vector3d way = (after.which == 0 ? 0.5 : -0.5) * y.cross(arm);
  for (std::size_t e = 0; e < 3; ++e) r.jaw[e] = static_cast<float>(way[static_cast<Eigen::Index>(e)]);
}

/// Knots share their room for contact stiffness among the contacts that touch them.
void shareStiffness(Context& c, std::size_t object) {
  const ObjectState& s = c.state.objects[object];
  const ObjectConstants& constants = c.model.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  std::fill(o.shared.begin(), o.shared.end(), std::uint16_t{0});
  for (const ToolContact& r : o.contacts)
    for (int e = 0; e < 3; ++e)
      if (r.weights[e] > 1e-6f) ++o.shared[r.knots[e]];
  const double omega = std::sqrt(constants.contact_omega_squared);
  for (ToolContact& r : o.contacts) {
    double inverse = 0.0;
    int most = 1;
    for (int e = 0; e < 3; ++e) {
      inverse += static_cast<double>(r.weights[e]) * r.weights[e] * contactInverseMass(s, r.knots[e]);
      if (r.weights[e] > 1e-6f) most = std::max<int>(most, o.shared[r.knots[e]]);
    }
    const double mass = 1.0 / inverse;
    r.stiffness = static_cast<float>(constants.contact_omega_squared * mass / most);
    r.damping = static_cast<float>(2.0 * kContactDamping * omega * mass / most);
    r.grip = static_cast<float>(2.0 * kGrip * omega * mass / most);
  }
}

}  // namespace

void placeTools(Context& c) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const auto& proxy = c.state.proxies[t];
    c.scratch.capsule_count[t] = 0;
    if (!proxy.present) continue;
    const auto& geometry = tools::toolGeometry(proxy.tool);
    interaction::placeCapsules(geometry, c.scratch.proxies_before[t].pose,
                               c.scratch.capsules_before[t].data());
    c.scratch.capsule_count[t] =
        interaction::placeCapsules(geometry, proxy.pose, c.scratch.capsules_after[t].data());
    for (int k = 0; k < c.scratch.capsule_count[t]; ++k) {
      auto& before = c.scratch.capsules_before[t][k];
      const auto& after = c.scratch.capsules_after[t][k];
      const double way = std::max((after.a - before.a).norm(), (after.b - before.b).norm());
      if (way > kFastestTool * c.dt) before = after;
    }
  }
}

void findToolContacts(Context& c, std::size_t object) {
  const ObjectState& s = c.state.objects[object];
  const ObjectConstants& constants = c.model.objects[object];
  const Object& described = c.model.description.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  o.contacts.clear();
  if (s.triangles.empty()) return;
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    for (int k = 0; k < c.scratch.capsule_count[t]; ++k) {
      const auto &before = c.scratch.capsules_before[t][k], &after = c.scratch.capsules_after[t][k];
      const bool jaw = after.which >= 0;
      if (jaw && (c.state.jaws_pass[object] >> t & 1u)) continue;
      // Blades that cut go through. A hook's capsules from 2 on are its wire (tools::ToolGeometry).
      if ((jaw || k >= 2) && (c.state.blades_pass[object] >> t & 1u)) continue;
      const double way = std::max((after.a - before.a).norm(), (after.b - before.b).norm());
      const double touch = after.radius + described.contact_thickness, reach = touch + kMargin + way;
      const Vector3d a = 0.5 * (before.a + after.a), b = 0.5 * (before.b + after.b);
      // A triangle whose every corner is further away than its edges are long cannot be near.
      const double corner = reach + 0.8 * constants.greatest_edge + 0.002;
      if (!boxTouches(o, a, b, reach) || !markNear(s, a, b, corner, o.near)) continue;
      const OutOfReach out(s, a, b, reach);
      std::array<std::uint64_t, 96> features;
      std::size_t feature_count = 0;
      for (std::size_t i = 0; i < s.triangles.size(); ++i) {
        const auto& knots = s.triangles[i];
        if (!(o.near[knots[0]] | o.near[knots[1]] | o.near[knots[2]]) || !s.triangle_alive[i]) continue;
        if (out(knots)) continue;
        const std::array<Vector3d, 3> p{knotPosition(s, knots[0]), knotPosition(s, knots[1]),
                                        knotPosition(s, knots[2])};
        const Nearest n = contact::nearest(a, b, p);
        if (!(n.distance < reach) || o.contacts.size() >= kMostContacts) continue;
        const std::uint64_t key = featureKey(knots, n.weights, i);
        if (std::find(features.begin(), features.begin() + feature_count, key) !=
            features.begin() + feature_count)
          continue;
        if (feature_count < features.size()) features[feature_count++] = key;
        const Vector3d q = p[0] * n.weights[0] + p[1] * n.weights[1] + p[2] * n.weights[2];
        const Vector3d axis = a + (b - a) * n.s;
        Vector3d face = (p[1] - p[0]).cross(p[2] - p[0]);
        const double area = std::sqrt(face.squaredNorm());
        if (!(area > 1e-14)) continue;
        face /= area;
        Vector3d normal = axis - q;
        const double distance = std::sqrt(normal.squaredNorm());
        normal = distance > 1e-7 ? Vector3d(normal / distance) : face;
        // A contact keeps the side on which it began, however deep it goes.
        const std::uint64_t wanted =
            sideKey(std::uint8_t(t), std::uint8_t(k), std::uint16_t(object), std::uint32_t(i));
        const auto found =
            std::lower_bound(c.state.sides.begin(), c.state.sides.end(), wanted,
                             [](const ContactSide& x, std::uint64_t value) { return sideKey(x) < value; });
        if (found != c.state.sides.end() && sideKey(*found) == wanted &&
            face.dot(normal) * found->side < -0.2)
          normal = -normal;
        ToolContact r{};
        for (int e = 0; e < 3; ++e) r.knots[e] = knots[e];
        r.tool = static_cast<std::uint8_t>(t);
        placeContact(c, n, normal, before, after, r);
        r.reach = static_cast<float>(touch);
        r.friction =
            static_cast<float>(jaw ? std::max(described.friction, kJawFriction) : described.friction);
        r.capsule = static_cast<std::uint8_t>(k);
        r.triangle = static_cast<std::uint32_t>(i);
        o.contacts.push_back(r);
      }
    }
  }
  if (o.contacts.empty()) return;
  shareStiffness(c, object);
}

void renewContacts(Context& c, std::size_t object, double fraction) {
  const ObjectState& s = c.state.objects[object];
  for (ToolContact& r : c.scratch.objects[object].contacts) {
    const auto &before = c.scratch.capsules_before[r.tool][r.capsule],
               &after = c.scratch.capsules_after[r.tool][r.capsule];
    const Vector3d a = before.a + fraction * (after.a - before.a),
                   b = before.b + fraction * (after.b - before.b);
    const std::array<Vector3d, 3> p{knotPosition(s, r.knots[0]), knotPosition(s, r.knots[1]),
                                    knotPosition(s, r.knots[2])};
    const Nearest n = contact::nearest(a, b, p);
    Vector3d normal = a + (b - a) * n.s - (p[0] * n.weights[0] + p[1] * n.weights[1] + p[2] * n.weights[2]);
    const double distance = std::sqrt(normal.squaredNorm());
    // Towards the capsule's axis the direction to it says less and less: there a contact stays as it was
    // found.
    if (!(distance > kShallow * r.reach)) continue;
    normal /= distance;
    // It keeps its side within the step.
    if (normal.dot(Vector3d(r.normal[0], r.normal[1], r.normal[2])) < 0.0) normal = -normal;
    placeContact(c, n, normal, before, after, r);
  }
  shareStiffness(c, object);
}

void findCavityContacts(Context& c, std::size_t object) {
  const ObjectState& s = c.state.objects[object];
  const ObjectConstants& constants = c.model.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  o.planes.clear();
  const Object& described = c.model.description.objects[object];
  const Bores bores(c.state);
  const CavityWalls hanging(c.model, c.state, c.input.sunk);
  const float thickness = static_cast<float>(described.contact_thickness);
  const double omega = std::sqrt(constants.contact_omega_squared);
  const float deepest = static_cast<float>(-kWallWeighs / constants.contact_omega_squared);
  const float *x = row(s, Block::X), *y = row(s, Block::Y), *z = row(s, Block::Z),
              *mass = row(s, Block::kMass);
  // A wall that sinks on is looked at anew every so often.
  if (!hanging.sink()) {
    o.clear_sunk = 0.0;
  } else if (!(c.input.sunk <= o.clear_sunk)) {
    o.clear_sunk = c.input.sunk + kSinksOn;
    std::fill(o.clear.begin(), o.clear.end(), 0.0);
  }
  const CavityWalls lowest(c.model, c.state, o.clear_sunk);
  for (std::size_t i = 0; i < s.block.knots(); ++i) {
    if (s.way < o.clear[i]) continue;
    o.clear[i] = s.way + 1.0;
    if (s.fixed[i]) continue;
    const Vector3f p(x[i], y[i], z[i]);
    const float limit = thickness + s.depth[i], close = limit + static_cast<float>(kMargin);
    for (std::size_t other = 0; other < c.model.objects.size(); ++other) {
      const auto& grid = c.model.objects[other].grid;
      if (grid.empty()) continue;
      Vector3f gradient;
      float distance = grid.distance(p, gradient);
      const float still = distance;
      const bool hangs = hanging.lower(other, p, distance, gradient);
      if (distance <= close && bores.open(p, distance, gradient) && distance > close) {
        o.clear[i] = 0.0;
        continue;
      }
      const float length = std::sqrt(gradient.squaredNorm());
      if (distance > close) {
        double way = static_cast<double>(still - close) / kSteepest - kRounding;
        if (hanging.sink() && hanging.isCavity(other))
          way = std::min(way, freeBelow(lowest.wall(other), p, still - close));
        o.clear[i] = std::min(o.clear[i], s.way + way);
        continue;
      }
      o.clear[i] = 0.0;
      if (!(length > 0.1f) || o.planes.size() >= o.planes.capacity()) continue;
      gradient /= length;
      PlaneContact r{};
      r.knot = static_cast<std::uint32_t>(i);
      for (int e = 0; e < 3; ++e) r.normal[e] = gradient[e];
      const float gap = distance - limit;
      r.offset = gradient.dot(p) - (hangs ? std::max(gap, deepest) : gap);
      r.stiffness = static_cast<float>(constants.contact_omega_squared) * mass[i];
      r.damping = static_cast<float>(2.0 * kContactDamping * omega) * mass[i];
      r.grip = static_cast<float>(2.0 * kGrip * omega) * mass[i];
      r.friction =
          static_cast<float>(std::max(described.friction, c.model.description.objects[other].friction));
      o.planes.push_back(r);
    }
  }
}

void renewSides(Context& c) {
  auto& sides = c.state.sides;
  sides.clear();
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    const ObjectState& s = c.state.objects[object];
    for (const ToolContact& r : c.scratch.objects[object].contacts) {
      if (gapOf(s, r) > 0.0 || sides.size() >= sides.capacity()) continue;
      const Vector3d p0 = knotPosition(s, r.knots[0]), normal(r.normal[0], r.normal[1], r.normal[2]);
      const double side =
          (knotPosition(s, r.knots[1]) - p0).cross(knotPosition(s, r.knots[2]) - p0).dot(normal);
      sides.push_back({r.triangle, static_cast<std::uint16_t>(object), r.tool, r.capsule,
                       static_cast<std::int8_t>(side < 0 ? -1 : 1)});
    }
  }
  std::sort(sides.begin(), sides.end(),
            [](const ContactSide& a, const ContactSide& b) { return sideKey(a) < sideKey(b); });
}

void collide(Context& c) {
  placeTools(c);
  // The search is the longest piece of work: the caller does it, and others take what is left of its share.
  auto at = [&c](std::size_t i) {
    if (i == 0) {
      findOrganPairs(c);
      return;
    }
    findToolContacts(c, c.shares.bodies[i - 1]);
    findCavityContacts(c, c.shares.bodies[i - 1]);
  };
  c.pool.each(c.shares.search_ends, at);
  findOrganContacts(c);
}

}  // namespace vest::scene
