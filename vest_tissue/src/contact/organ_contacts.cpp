#include <algorithm>
#include <cmath>

#include "../scene/stages.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using net::Block;

constexpr std::uint64_t kRenewEvery =
    8;                                  ///< steps from one turn of an object to search for pairs to the next
constexpr double kPairMargin = 0.0045;  ///< m: kRenewWay, and 0.5 m/s of approach until the next turn
constexpr double kRenewWay = 0.0005;    ///< m that things may come nearer before a turn is used
constexpr double kRounding = 1e-6;      ///< m: far more than single precision loses in a box of 1 m
constexpr double kShare = 0.25;         ///< (omega·h)² that a held contact may have
constexpr double kDamping = 0.3, kGrip = 0.3;
constexpr double kClose = 0.001;  ///< m: contacts are prepared this much before they touch

/// Squared distance, m², of a point from the box of a triangle, never more than that from the triangle:
/// spares the exact one.
double toBoxSquared(const Vector3d& x, const std::array<Vector3d, 3>& p) {
  double squared = 0.0;
  for (int e = 0; e < 3; ++e) {
    const double low = std::min(std::min(p[0][e], p[1][e]), p[2][e]),
                 high = std::max(std::max(p[0][e], p[1][e]), p[2][e]);
    const double off = std::max(std::max(low - x[e], x[e] - high), 0.0);
    squared += off * off;
  }
  return squared;
}
bool beyondBox(const Vector3d& x, const std::array<Vector3d, 3>& p, double reach) {
  return toBoxSquared(x, p) > reach * reach * (1.0 + 1e-9);
}

/// Way at which a pair that is `distance` apart now can touch within `reach` at the earliest.
double clearUntil(const ObjectState& a, const ObjectState& b, double distance, double reach) {
  return a.way + b.way + (distance - reach) - kRounding;
}

}  // namespace

void measureWays(Context& c) {
  // A cut may put knots elsewhere than they were: everything is looked at again.
  const double jump = c.state.revision != c.state.way_revision ? 1.0 : 0.0;
  c.state.way_revision = c.state.revision;
  float furthest = 0.0f;
  for (std::size_t object = 0; object < c.state.objects.size(); ++object) {
    if (!c.model.objects[object].net) continue;
    ObjectState& s = c.state.objects[object];
    const float* const before = c.scratch.objects[object].backup.data();
    const float* const motion = s.block.motion();
    const auto rowOf = [&](Block::KnotRow r) { return s.block.row(r) - motion; };
    const auto X = static_cast<std::size_t>(rowOf(Block::X)), Y = static_cast<std::size_t>(rowOf(Block::Y)),
               Z = static_cast<std::size_t>(rowOf(Block::Z));
    const auto moved = [&](std::size_t k) {
      const float dx = motion[X + k] - before[X + k], dy = motion[Y + k] - before[Y + k],
                  dz = motion[Z + k] - before[Z + k];
      return dx * dx + dy * dy + dz * dz;
    };
    float lanes[8] = {};                                               // vectorises
    const std::size_t knots = c.scratch.objects[object].knots_before;  // new ones are a jump
    std::size_t i = 0;
    for (; i + 8 <= knots; i += 8)
      for (std::size_t n = 0; n < 8; ++n) {
        const float m = moved(i + n);
        lanes[n] = lanes[n] < m ? m : lanes[n];
      }
    for (; i < knots; ++i) lanes[0] = std::max(lanes[0], moved(i));
    const float far = std::sqrt(*std::max_element(lanes, lanes + 8)) * 1.00001f;
    s.way += static_cast<double>(far) + jump;
    furthest = std::max(furthest, far);
  }
  c.state.way += static_cast<double>(furthest) + jump;
}

void findOrganPairs(Context& c) {
  // Every step it is the turn of some objects, so that no step bears the whole search; it is made where
  // things came nearer since the last one.
  auto& pairs = c.state.pairs;
  const std::uint64_t turn = c.state.step % kRenewEvery;
  const auto& d = c.model.description;
  bool any = false;
  for (std::size_t a = 0; a < d.objects.size(); ++a) {
    c.scratch.objects[a].search_due = false;
    ObjectState& s = c.state.objects[a];
    if (!c.model.objects[a].net || a % kRenewEvery != turn) continue;
    if (s.way_searched >= 0.0 && s.way + c.state.way - s.way_searched < kRenewWay) continue;
    s.way_searched = s.way + c.state.way;
    c.scratch.objects[a].search_due = any = true;
  }
  if (!any) return;
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(),
                             [&](const OrganPair& p) { return c.scratch.objects[p.object].search_due; }),
              pairs.end());
  for (std::size_t a = 0; a < d.objects.size(); ++a) {
    if (!c.scratch.objects[a].search_due) continue;
    const ObjectState& sa = c.state.objects[a];
    const ObjectScratch& oa = c.scratch.objects[a];
    for (std::size_t b = 0; b < d.objects.size(); ++b) {
      if (a == b || c.model.objects[a].together[b] || !c.model.objects[b].net ||
          c.state.objects[b].triangles.empty())
        continue;
      const ObjectState& sb = c.state.objects[b];
      const ObjectScratch& ob = c.scratch.objects[b];
      const float reach =
          static_cast<float>(d.objects[a].contact_thickness + d.objects[b].contact_thickness + kPairMargin);
      Eigen::Array3f low, high;  // where both can be
      bool apart = false;
      for (int e = 0; e < 3; ++e) {
        low[e] = std::max(oa.low[e], ob.low[e] - reach);
        high[e] = std::min(oa.high[e], ob.high[e] + reach);
        apart = apart || low[e] > high[e];
      }
      if (apart) continue;
      const float *x = row(sa, Block::X), *y = row(sa, Block::Y), *z = row(sa, Block::Z);
      const float *ux = row(sb, Block::X), *uy = row(sb, Block::Y), *uz = row(sb, Block::Z);
      // Triangles of b whose bounding ball reaches where both can be.
      auto& near = c.scratch.candidates;
      near.clear();
      const float third = 1.0f / 3.0f;
      for (std::size_t t = 0; t < sb.triangles.size(); ++t) {
        const auto& k = sb.triangles[t];
        const float mx = (ux[k[0]] + ux[k[1]] + ux[k[2]]) * third,
                    my = (uy[k[0]] + uy[k[1]] + uy[k[2]]) * third,
                    mz = (uz[k[0]] + uz[k[1]] + uz[k[2]]) * third;
        float radius2 = 0.0f;
        for (const auto v : k) {
          const float dx = ux[v] - mx, dy = uy[v] - my, dz = uz[v] - mz;
          radius2 = std::max(radius2, dx * dx + dy * dy + dz * dz);
        }
        const float r = std::sqrt(radius2);
        if (mx < low[0] - r || mx > high[0] + r || my < low[1] - r || my > high[1] + r || mz < low[2] - r ||
            mz > high[2] + r || !sb.triangle_alive[t] || near.full()) {
          continue;
        }
        near.push(mx, my, mz, r, static_cast<std::uint32_t>(t));
      }
      if (near.empty()) continue;
      for (std::size_t i = 0; i < sa.block.knots(); ++i) {
        if (x[i] < low[0] || x[i] > high[0] || y[i] < low[1] || y[i] > high[1] || z[i] < low[2] ||
            z[i] > high[2])
          continue;
        const Vector3d p(x[i], y[i], z[i]);
        double nearest_distance = reach;
        std::uint32_t nearest_triangle = 0;
        bool found = false;
        near.within(x[i], y[i], z[i], reach);
        for (std::size_t q = 0; q < near.size(); ++q) {
          if (!near.hit(q)) continue;
          const float dx = near.x(q) - x[i], dy = near.y(q) - y[i], dz = near.z(q) - z[i];
          const float bound = static_cast<float>(nearest_distance) + near.radius(q);
          if (dx * dx + dy * dy + dz * dz > bound * bound) continue;
          const std::uint32_t t = near.triangle(q);
          const auto& k = sb.triangles[t];
          const std::array<Vector3d, 3> corners{knotPosition(sb, k[0]), knotPosition(sb, k[1]),
                                                knotPosition(sb, k[2])};
          if (beyondBox(p, corners, nearest_distance)) continue;
          const auto n = contact::nearest(p, corners);
          if (n.distance < nearest_distance) {
            nearest_distance = n.distance;
            nearest_triangle = t;
            found = true;
          }
        }
        if (found && pairs.size() < pairs.capacity()) {
          const double touch = d.objects[a].contact_thickness + d.objects[b].contact_thickness + kClose;
          pairs.push_back({static_cast<std::uint16_t>(a), static_cast<std::uint16_t>(b),
                           static_cast<std::uint32_t>(i), nearest_triangle,
                           clearUntil(sa, sb, nearest_distance, touch)});
        }
      }
    }
  }
}

void findOrganContacts(Context& c) {
  auto& contacts = c.scratch.organ_contacts;
  contacts.clear();
  const auto& d = c.model.description;
  for (OrganPair& pair : c.state.pairs) {
    const ObjectState &sa = c.state.objects[pair.object], &sb = c.state.objects[pair.other];
    if (sa.way + sb.way < pair.clear) continue;
    const auto& k = sb.triangles[pair.triangle];
    const Vector3d x = knotPosition(sa, pair.knot);
    const std::array<Vector3d, 3> p{knotPosition(sb, k[0]), knotPosition(sb, k[1]), knotPosition(sb, k[2])};
    const double reach = d.objects[pair.object].contact_thickness + d.objects[pair.other].contact_thickness;
    const double box = toBoxSquared(x, p);
    if (box > (reach + kClose) * (reach + kClose) * (1.0 + 1e-9)) {
      pair.clear = clearUntil(sa, sb, std::sqrt(box), reach + kClose);
      continue;
    }
    const auto n = contact::nearest(x, p);
    if (!(n.distance < reach + kClose)) {
      pair.clear = clearUntil(sa, sb, n.distance, reach + kClose);
      continue;
    }
    Vector3d normal = x - (p[0] * n.weights[0] + p[1] * n.weights[1] + p[2] * n.weights[2]);
    const Vector3d face = (p[1] - p[0]).cross(p[2] - p[0]);
    const double area = std::sqrt(face.squaredNorm());
    if (!(area > 1e-14)) continue;
    // On a closed surface outside is where the triangle faces: a knot that got in through the face goes out
    // there. At edges and on open sheets the side is the one on which the knot is.
    const bool on_face = n.weights[0] > 0.02 && n.weights[1] > 0.02 && n.weights[2] > 0.02;
    if (n.distance < 1e-6 || (c.model.objects[pair.other].closed && on_face && normal.dot(face) < 0.0)) {
      normal = face / area;
    } else {
      normal /= std::sqrt(normal.squaredNorm());
    }
    OrganContact r;
    r.object = pair.object, r.other = pair.other, r.knot = pair.knot, r.triangle = k;
    const double inverse_a = contactInverseMass(sa, pair.knot);
    double inverse_b = 0.0;
    for (int e = 0; e < 3; ++e) {
      r.weights[e] = static_cast<float>(n.weights[e]);
      r.normal[e] = static_cast<float>(normal[e]);
      inverse_b += n.weights[e] * n.weights[e] * contactInverseMass(sb, k[e]);
    }
    // Finite elements that move first answer implicitly: then only the other side's mass limits the spring.
    const int turn_a = turnOf(c, pair.object), turn_b = turnOf(c, pair.other);
    r.implicit_side = turn_a < turn_b ? 1 : turn_b < turn_a ? 2 : 0;
    double inverse = inverse_a + inverse_b;
    if (r.implicit_side == 1) inverse = inverse_b;
    if (r.implicit_side == 2) inverse = inverse_a;
    r.batches = std::min(sa.batches, sb.batches) * c.stretch;
    const double h = c.dt / r.batches;
    r.stiffness = static_cast<float>(kShare / (h * h * inverse));
    r.damping = static_cast<float>(kDamping / (h * inverse));
    r.grip = static_cast<float>(kGrip / (h * inverse));
    r.friction =
        static_cast<float>(std::max(d.objects[pair.object].friction, d.objects[pair.other].friction));
    r.reach = static_cast<float>(reach);
    if (contacts.size() < contacts.capacity()) contacts.push_back(r);
  }
  // As stiff as the exchange of held forces allows: contacts that share a knot share that room.
  if (contacts.empty()) return;
  for (ObjectScratch& o : c.scratch.objects) std::fill(o.shared.begin(), o.shared.end(), std::uint16_t{0});
  const auto each = [&](const OrganContact& r, auto visit) {
    visit(c.scratch.objects[r.object].shared[r.knot]);
    for (int e = 0; e < 3; ++e)
      if (r.weights[e] > 1e-3f) visit(c.scratch.objects[r.other].shared[r.triangle[e]]);
  };
  for (const OrganContact& r : contacts) each(r, [](std::uint16_t& count) { ++count; });
  for (OrganContact& r : contacts) {
    std::uint16_t most = 1;
    each(r, [&](std::uint16_t& count) { most = std::max(most, count); });
    r.stiffness /= most, r.damping /= most, r.grip /= most;
  }
}

}  // namespace vest::scene
