#include <numeric>
#include <utility>

#include "../scene/connections.h"
#include "cut_job.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using net::Block;

constexpr int kMostVersions = 8;

/// A knot and what it was divided into in this step.
struct Versions {
  std::array<std::uint32_t, kMostVersions> knot{};
  int count = 0;
};
Versions versionsOf(const CutJob& j, std::uint32_t knot) {
  Versions v;
  v.knot[0] = knot;
  v.count = 1;
  const std::size_t first = j.s.block.knots() - j.delta.doubled_knots.size();
  for (std::size_t i = 0; i < j.delta.doubled_knots.size() && v.count < kMostVersions; ++i)
    if (j.delta.doubled_knots[i] == knot)
      v.knot[static_cast<std::size_t>(v.count++)] = static_cast<std::uint32_t>(first + i);
  return v;
}

bool shareNeighbour(const CutJob& j, std::uint32_t a, std::uint32_t b) {
  for (const std::uint32_t* t = j.begin(a); t != j.end(a); ++t)
    for (const std::uint32_t x : j.s.triangles[*t])
      if (x != a && j.adjacent(x, b)) return true;
  return false;
}

/// Whether two knots had a neighbour in common, or were neighbours, before this cut.
bool wereNear(const CutJob& j, std::uint32_t a, std::uint32_t b) {
  const auto holds = [&](std::uint32_t triangle, std::uint32_t knot) {
    const auto& t = j.k.triangles_before[triangle];
    return t[0] == knot || t[1] == knot || t[2] == knot;
  };
  for (std::uint32_t n = j.k.before_start[a]; n < j.k.before_start[a + 1]; ++n) {
    if (holds(j.k.before[n], b)) return true;
    for (const std::uint32_t x : j.k.triangles_before[j.k.before[n]]) {
      if (x == a) continue;
      for (std::uint32_t m = j.k.before_start[x]; m < j.k.before_start[x + 1]; ++m)
        if (holds(j.k.before[m], b)) return true;
    }
  }
  return false;
}

/// Pairs of versions that a link of two knots goes on between: at most two (the sides of a cut along it).
struct Pairs {
  std::array<std::array<std::uint32_t, 2>, 2> knots{};
  int count = 0;
  void add(std::uint32_t a, std::uint32_t b) {
    if (count < 2) knots[static_cast<std::size_t>(count++)] = {a, b};
  }
};
Pairs pairsOf(const CutJob& j, std::uint32_t a, std::uint32_t b) {
  const Versions va = versionsOf(j, a), vb = versionsOf(j, b);
  Pairs p;
  const auto each = [&](auto fits) {
    for (int m = 0; m < va.count; ++m)
      for (int n = 0; n < vb.count; ++n) {
        const std::uint32_t x = va.knot[static_cast<std::size_t>(m)],
                            y = vb.knot[static_cast<std::size_t>(n)];
        if (fits(x, y)) p.add(x, y);
      }
  };
  each([&](std::uint32_t x, std::uint32_t y) { return j.adjacent(x, y); });
  if (p.count > 0) return p;
  each([&](std::uint32_t x, std::uint32_t y) { return shareNeighbour(j, x, y) && !j.across(x, y); });
  if (p.count > 0 || wereNear(j, a, b)) return p;
  // Through the organ: it stays with the part that it points into; along the cut it belongs to both sides,
  // but never to one knot of each.
  constexpr double kAlong = -0.2;  // cosine (tuned)
  const auto into = [&](std::uint32_t x, const Vector3d& way) {
    const Vector3d in = j.inward(x);
    return in.dot(way) >= kAlong * std::sqrt(in.squaredNorm() * way.squaredNorm());
  };
  each([&](std::uint32_t x, std::uint32_t y) {
    const Vector3d way = j.rest(y) - j.rest(x);
    return (va.count < 2 || into(x, way)) && (vb.count < 2 || into(y, -way)) && !j.across(x, y);
  });
  return p;
}

/// Marks the knots around everything that was doubled.
void markNear(CutJob& j) {
  std::fill_n(j.k.near_knot.begin(), j.s.block.knots(), std::uint8_t{0});
  for (const std::uint32_t knot : j.delta.doubled_knots)
    for (std::uint32_t n = j.k.before_start[knot]; n < j.k.before_start[knot + 1]; ++n)
      for (const std::uint32_t x : j.s.triangles[j.k.before[n]]) j.k.near_knot[x] = 1;
  for (const std::uint32_t knot : j.delta.doubled_knots) j.k.near_knot[knot] = 2;
}

void replaceLink(CutJob& j, std::uint32_t link, const Pairs& p) {
  const Link l = j.s.topology.links[link];
  if (p.count == 1 && p.knots[0][0] == l.knot0 && p.knots[0][1] == l.knot1) return;
  for (int n = 0; n < p.count; ++n) {
    const auto& knots = p.knots[static_cast<std::size_t>(n)];
    const bool room = j.s.topology.links.size() < j.s.topology.links.capacity();
    if (!room ||
        !addLinkLike(j.c.state, j.object, link, {knots[0], knots[1], l.knot2}, 1.0 / p.count, j.delta))
      j.cut.exhausted = true;
  }
  removeLink(j.c.state, j.object, link, j.delta);
}

void divideBending(CutJob& j, std::uint32_t link) {
  const Link l = j.s.topology.links[link];
  const Versions va = versionsOf(j, l.knot0), vb = versionsOf(j, l.knot1), vc = versionsOf(j, l.knot2);
  if (va.count + vb.count + vc.count == 3) return;
  const auto near = [&](std::uint32_t a, std::uint32_t b) {
    return j.adjacent(a, b) || (shareNeighbour(j, a, b) && !j.across(a, b));
  };
  for (int b = 0; b < vb.count; ++b) {
    for (int a = 0; a < va.count; ++a) {
      for (int n = 0; n < vc.count; ++n) {
        const std::array<std::uint32_t, 3> knots{va.knot[static_cast<std::size_t>(a)],
                                                 vb.knot[static_cast<std::size_t>(b)],
                                                 vc.knot[static_cast<std::size_t>(n)]};
        if (!near(knots[0], knots[1]) || !near(knots[1], knots[2])) continue;
        if (knots[0] == l.knot0 && knots[1] == l.knot1 && knots[2] == l.knot2) return;
        if (j.s.topology.links.size() < j.s.topology.links.capacity() &&
            j.s.elements.bending.size() < j.s.elements.bending.capacity()) {
          addLinkLike(j.c.state, j.object, link, knots, 1.0, j.delta);
        } else {
          j.cut.exhausted = true;
        }
        removeLink(j.c.state, j.object, link, j.delta);
        return;
      }
    }
  }
  removeLink(j.c.state, j.object, link, j.delta);
}

void divideLinks(CutJob& j) {
  const std::size_t count = j.s.topology.links.size();
  for (std::uint32_t i = 0; i < count; ++i) {
    const Link& l = j.s.topology.links[i];
    if (!j.s.topology.link_alive[i]) continue;
    const std::uint8_t n0 = j.k.near_knot[l.knot0], n1 = j.k.near_knot[l.knot1];
    if (l.kind == LinkKind::Bending) {
      if (n0 == 2 || n1 == 2 || j.k.near_knot[l.knot2] == 2) divideBending(j, i);
      continue;
    }
    // No surface tells their side: the blade itself cuts them (cutCords).
    if (j.begin(l.knot0) == j.end(l.knot0) || j.begin(l.knot1) == j.end(l.knot1)) continue;
    if (n0 == 2 || n1 == 2) {
      replaceLink(j, i, pairsOf(j, l.knot0, l.knot1));
    } else if (!j.adjacent(l.knot0, l.knot1) &&
               (j.across(l.knot0, l.knot1) ||
                (n0 + n1 > 0 && wereNear(j, l.knot0, l.knot1) && !shareNeighbour(j, l.knot0, l.knot1)))) {
      removeLink(j.c.state, j.object, i, j.delta);
    }
  }
}

void divideHinges(CutJob& j) {
  for (net::Hinge& h : j.s.elements.hinges) {
    if (h.stiffness == 0.0f) continue;
    const std::array<std::uint32_t, 4> knots{h.edge0, h.edge1, h.wing0, h.wing1};
    if (std::none_of(knots.begin(), knots.end(), [&](std::uint32_t k) { return j.k.near_knot[k] == 2; }))
      continue;
    const Versions v0 = versionsOf(j, h.edge0), v1 = versionsOf(j, h.edge1), w0 = versionsOf(j, h.wing0),
                   w1 = versionsOf(j, h.wing1);
    bool found = false;
    const auto wing = [&](const Versions& w, std::uint32_t a, std::uint32_t b, std::uint32_t& out) {
      for (int n = 0; n < w.count; ++n) {
        out = w.knot[static_cast<std::size_t>(n)];
        if (j.adjacent(out, a) || j.adjacent(out, b)) return true;
      }
      return false;
    };
    for (int a = 0; a < v0.count && !found; ++a) {
      for (int b = 0; b < v1.count && !found; ++b) {
        const std::uint32_t e0 = v0.knot[static_cast<std::size_t>(a)],
                            e1 = v1.knot[static_cast<std::size_t>(b)];
        std::uint32_t x0, x1;
        if (!j.adjacent(e0, e1) || !wing(w0, e0, e1, x0) || !wing(w1, e0, e1, x1)) continue;
        h.edge0 = e0, h.edge1 = e1, h.wing0 = x0, h.wing1 = x1;
        found = true;
      }
    }
    if (!found) h.stiffness = 0.0f;
  }
}

/// The version whose surroundings lie nearest to a place.
std::uint32_t towards(const CutJob& j, std::uint32_t knot, const Vector3d& place) {
  const Versions v = versionsOf(j, knot);
  std::uint32_t best = knot;
  double least = 1e300;
  for (int n = 0; n < v.count; ++n) {
    const std::uint32_t k = v.knot[static_cast<std::size_t>(n)];
    Vector3d sum = Vector3d::Zero();
    double parts = 0.0;
    for (const std::uint32_t* t = j.begin(k); t != j.end(k); ++t)
      for (const std::uint32_t x : j.s.triangles[*t]) sum += knotPosition(j.s, x), parts += 1.0;
    if (!(parts > 0.0)) continue;
    const double distance = (sum / parts - place).squaredNorm();
    if (distance < least) least = distance, best = k;
  }
  return best;
}

/// An anchor on a triangle goes where the triangle went; one on a knot goes to the part nearest to `place`.
void remapAnchor(const CutJob& j, net::Anchor& a, const Vector3d& place) {
  if (a.object != j.object) return;
  bool touched = false;
  for (int i = 0; i < 4; ++i) touched = touched || (a.weights[i] != 0.0 && j.k.near_knot[a.knots[i]] == 2);
  if (!touched) return;
  if (a.weights[2] != 0.0 || a.weights[1] != 0.0) {
    const std::uint32_t k0 = a.knots[0];
    for (std::uint32_t n = j.k.before_start[k0]; n < j.k.before_start[k0 + 1]; ++n) {
      const auto& was = j.k.triangles_before[j.k.before[n]];
      const auto& is = j.s.triangles[j.k.before[n]];
      const auto place_of = [&](std::uint32_t k) {
        return std::find(was.begin(), was.end(), k) - was.begin();
      };
      if (place_of(a.knots[0]) > 2 || place_of(a.knots[1]) > 2 || place_of(a.knots[2]) > 2) continue;
      for (int i = 0; i < 3; ++i) a.knots[i] = is[static_cast<std::size_t>(place_of(a.knots[i]))];
      return;
    }
  }
  for (int i = 0; i < 4; ++i)
    if (a.weights[i] != 0.0) a.knots[i] = towards(j, a.knots[i], place);
}

/// Middle of the triangles' corners around a knot now, m.
Vector3d around(const CutJob& j, std::uint32_t knot) {
  Vector3d sum = Vector3d::Zero();
  double parts = 0.0;
  for (const std::uint32_t* t = j.begin(knot); t != j.end(knot); ++t)
    for (const std::uint32_t x : j.s.triangles[*t]) sum += knotPosition(j.s, x), parts += 1.0;
  return parts > 0.0 ? Vector3d(sum / parts) : knotPosition(j.s, knot);
}

/// Clips and slings stay on the side on which they sit: between the two halves of each knot a plane tells it.
void remapFasteners(CutJob& j) {
  const std::size_t first = j.s.block.knots() - j.delta.doubled_knots.size();
  for (std::size_t i = 0; i < j.delta.doubled_knots.size(); ++i) {
    net::KnotDoubling cut;
    cut.original = j.delta.doubled_knots[i];
    cut.copy = static_cast<std::uint32_t>(first + i);
    cut.plane_normal = around(j, cut.copy) - around(j, cut.original);
    cut.plane_point = knotPosition(j.s, cut.original);
    remapFasteners(j.c.state, j.object, cut);
  }
}

/// Anchors of whatever holds on to the object.
void remapAnchors(CutJob& j) {
  WorldState& state = j.c.state;
  remapFasteners(j);
  for (std::size_t i = 0; i < j.s.triangles.size(); ++i)
    followTriangle(state, j.object, j.k.triangles_before[i], j.s.triangles[i]);
  for (ConnectionState& c : state.connections) {
    if (c.end0.object != j.object && c.end1.object != j.object) continue;
    const Vector3d p0 = footOf(state, c.end0), p1 = footOf(state, c.end1);
    remapAnchor(j, c.end0, p1);
    remapAnchor(j, c.end1, p0);
  }
  for (std::size_t t = 0; t < state.grasps.size(); ++t) {
    const auto& pose = state.proxies[t].pose;
    auto& grasp = state.grasps[t];
    for (int i = 0; i < grasp.count; ++i) {
      auto& a = grasp.anchors[static_cast<std::size_t>(i)];
      if (a.object == j.object && j.k.near_knot[a.knot] == 2)
        a.knot = towards(j, a.knot, pose.tip + pose.orientation * a.local);
    }
  }
}

/// Sets of knots, as a forest in `parent`.
struct Pieces {
  std::vector<std::uint32_t>& parent;
  Pieces(std::vector<std::uint32_t>& room, std::size_t knots) : parent(room) {
    std::iota(parent.begin(), parent.begin() + static_cast<std::ptrdiff_t>(knots), 0u);
  }
  std::uint32_t root(std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t ra = root(a), rb = root(b);
    parent[std::max(ra, rb)] = std::min(ra, rb);
  }
};

/// Numbers the connected pieces and counts them. Where the surface has come apart, what still ran through
/// the organ from one piece to the other is cut, too.
void countParts(CutJob& j) {
  const std::uint32_t knots = static_cast<std::uint32_t>(j.s.block.knots());
  Pieces part(j.k.part, knots), uncut(j.k.uncut, knots);
  for (std::size_t i = 0; i < j.s.triangles.size(); ++i) {
    const auto& t = j.s.triangles[i];
    if (j.s.triangle_alive[i]) part.join(t[0], t[1]), part.join(t[0], t[2]);
    for (const std::uint32_t k : t) uncut.join(k, t[0]), uncut.join(k, j.k.version_of[k]);
  }
  const auto parted = [&](std::uint32_t a, std::uint32_t b) {  // knots inside hang on links alone: never
    return part.root(a) != part.root(b) && uncut.root(a) == uncut.root(b) && j.begin(a) != j.end(a) &&
           j.begin(b) != j.end(b);
  };
  for (std::uint32_t i = 0; j.divided && i < j.s.topology.links.size(); ++i) {
    const Link& l = j.s.topology.links[i];
    if (j.s.topology.link_alive[i] &&
        (parted(l.knot0, l.knot1) || (l.kind == LinkKind::Bending && parted(l.knot1, l.knot2))))
      removeLink(j.c.state, j.object, i, j.delta);
  }
  for (std::size_t i = 0; i < j.s.topology.links.size(); ++i) {
    const Link& l = j.s.topology.links[i];
    if (!j.s.topology.link_alive[i]) continue;
    part.join(l.knot0, l.knot1);
    if (l.kind == LinkKind::Bending) part.join(l.knot0, l.knot2);
  }
  for (std::uint32_t i = 0; i < knots; ++i) j.k.part[i] = part.root(i);
  std::fill_n(j.k.uncut.begin(), knots, 0u);  // a knot that lost its surface in a tear is no piece
  std::uint32_t count = 0;
  for (std::size_t i = 0; i < j.s.triangles.size(); ++i)
    if (j.s.triangle_alive[i]) count += std::exchange(j.k.uncut[j.k.part[j.s.triangles[i][0]]], 1u) == 0u;
  j.cut.parts = std::max(j.cut.parts, count);
}

}  // namespace

void divideElements(CutJob& j) {
  if (j.divided) {
    markNear(j);
    divideLinks(j);
    divideHinges(j);
    remapAnchors(j);
  }
  countParts(j);
  if (j.divided) divideVolumes(j);
}

}  // namespace vest::scene
