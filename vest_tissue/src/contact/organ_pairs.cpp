#include "organ_pairs.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "vest_tissue/scene/topology.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using net::Block;

constexpr std::uint64_t kRenewEvery =
    8;                                  ///< steps from one turn of an object to search for pairs to the next
constexpr double kPairMargin = 0.0045;  ///< m: kRenewWay, and 0.5 m/s of approach until the next turn
constexpr double kRenewWay = 0.0005;    ///< m that things may come nearer before a turn is used

/// An object's turn to look for what it may touch on another, or on itself.
class Search {
 public:
  Search(Context& c, std::size_t a, std::size_t b)
      : c_(c),
        a_(a),
        b_(b),
        sa_(c.state.objects[a]),
        sb_(c.state.objects[b]),
        own_(c.model.objects[a]),
        touch_(c.model.description.objects[a].contact_thickness +
               c.model.description.objects[b].contact_thickness + kClose),
        reach_(static_cast<float>(touch_ - kClose + kPairMargin)) {
    const ObjectScratch &oa = c.scratch.objects[a], &ob = c.scratch.objects[b];
    low_ = oa.low.array().max(ob.low.array() - reach_), high_ = oa.high.array().min(ob.high.array() + reach_);
  }
  static bool comesBefore(const OrganPair& a, const OrganPair& b) {
    return std::tie(a.object, a.other, a.edges, a.knot) < std::tie(b.object, b.other, b.edges, b.knot);
  }
  bool apart() const { return (low_ > high_).any(); }

  /// Knots of `a` near triangles of `b`.
  void knots() {
    near().clear();
    for (std::uint32_t t = 0; t < sb_.triangles.size(); ++t) {
      if (!sb_.triangle_alive[t]) continue;
      if (faraway(t)) continue;
      const auto p = cornersOf(t);
      const Vector3d middle = (p[0] + p[1] + p[2]) / 3.0;
      double radius2 = 0.0;
      for (const Vector3d& corner : p) radius2 = std::max(radius2, (corner - middle).squaredNorm());
      push(middle, std::sqrt(radius2), t);
    }
    if (near().empty()) return;
    near().close();
    for (std::uint32_t i = 0; i < sa_.block.knots(); ++i) {
      const Vector3d x = knotPosition(sa_, i);
      if (outside(x, 0.0f) || together(a_, b_, i)) continue;
      const std::uint32_t scene_knot = self() ? origin(a_, i) : 0;
      if (self() && !own_.onSurface(scene_knot)) continue;
      OrganPair pair = pairOf(false, i);
      double best = reach_;
      contact::Nearest found{};
      bool any = false;
      // From the one whose middle is nearest on: it leaves few others to look at. Of two at the same distance
      // the first in the object's order is taken, whichever was looked at first.
      nearestFirst(x, best, [&](std::uint32_t t) {
        const auto p = cornersOf(t);
        if (toBoxSquared(x, p) > best * best * (1.0 + 1e-9)) return;
        if (self() && own_.beside(scene_knot, origin(b_, sb_.triangles[t][0]))) return;
        const contact::Nearest n = contact::nearest(x, p);
        if (n.distance < best || (any && n.distance == best && t < pair.triangle))
          best = n.distance, found = n, pair.triangle = t, any = true;
      });
      if (any && (!self() || findSide(x, found, pair))) keep(pair, best);
    }
  }

  /// Edges of `a` that cross edges of `b`.
  void edges() {
    const auto &ours = own_.edges, &theirs = c_.model.objects[b_].edges;
    near().clear();
    for (std::uint32_t f = 0; f < theirs.size(); ++f) {
      if (!sb_.triangle_alive[theirs[f].triangle]) continue;
      const EdgeNow e(sb_, theirs[f]);
      push(0.5 * (e.from + e.to), 0.5 * std::sqrt((e.to - e.from).squaredNorm()), f);
    }
    if (near().empty()) return;
    near().close();
    for (std::uint32_t i = 0; i < ours.size(); ++i) {
      if (!sa_.triangle_alive[ours[i].triangle]) continue;
      const EdgeNow e(sa_, ours[i]);
      const Vector3d middle = 0.5 * (e.from + e.to);
      const double half = 0.5 * std::sqrt((e.to - e.from).squaredNorm());
      if (outside(middle, static_cast<float>(half)) || together(a_, b_, e.knots[0]) ||
          together(a_, b_, e.knots[1]))
        continue;
      const std::uint32_t scene_knot = self() ? origin(a_, e.knots[0]) : 0;
      OrganPair pair = pairOf(true, i);
      const OrganPair* const old = before(pair);
      double best = reach_;
      bool any = false;
      eachNear(middle, half, best, [&](std::uint32_t f) {
        if (self() && f >= i) return;  // each two once
        const EdgeNow g(sb_, theirs[f]);
        if (self() && own_.beside(scene_knot, origin(b_, g.knots[0]))) return;
        if (together(b_, a_, g.knots[0]) || together(b_, a_, g.knots[1])) return;
        double s, t;
        const double distance = contact::nearestSegments(e.from, e.to, g.from, g.to, s, t);
        if (!(distance < best) || !(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0)) return;
        std::int8_t side;
        if (old != nullptr && old->triangle == f) {
          side = old->side;
        } else if (!crossing(e, g, s, t, ours[i], theirs[f], side)) {
          return;
        }
        best = distance, any = true;
        pair.triangle = f, pair.side = side;
      });
      if (any) keep(pair, best);
    }
  }

 private:
  Context& c_;
  std::size_t a_, b_;
  const ObjectState &sa_, &sb_;
  const ObjectConstants& own_;
  double touch_;               ///< m: of contacts that are prepared
  float reach_;                ///< m: of what is found
  Eigen::Array3f low_, high_;  ///< m: where both can be

  Candidates& near() { return c_.scratch.candidates; }
  bool self() const { return a_ == b_; }
  bool closed() const { return c_.model.objects[b_].closed; }
  bool outside(const Vector3d& x, float radius) const {
    const Eigen::Array3f at = x.cast<float>().array();
    return (at < low_ - radius).any() || (at > high_ + radius).any();
  }
  std::uint32_t origin(std::size_t object, std::uint32_t knot) const {
    return originalKnot(c_.state.objects[object].topology,
                        c_.model.description.objects[object].position.size(), knot);
  }
  /// A knot that the scene puts on or into the other object.
  bool together(std::size_t object, std::size_t other, std::uint32_t knot) const {
    const auto& knots = c_.model.objects[object].designed[other];
    return !knots.empty() && knots[origin(object, knot)] != 0;
  }
  std::array<Vector3d, 3> cornersOf(std::uint32_t t) const {
    const auto& k = sb_.triangles[t];
    return {knotPosition(sb_, k[0]), knotPosition(sb_, k[1]), knotPosition(sb_, k[2])};
  }

  /// Spares double precision: push() would leave the triangle's ball out.
  bool faraway(std::uint32_t t) const {
    const auto& k = sb_.triangles[t];
    const float *x = row(sb_, Block::X), *y = row(sb_, Block::Y), *z = row(sb_, Block::Z);
    const float p[3][3] = {
        {x[k[0]], y[k[0]], z[k[0]]}, {x[k[1]], y[k[1]], z[k[1]]}, {x[k[2]], y[k[2]], z[k[2]]}};
    float middle[3], off = -1.0f, radius2 = 0.0f;
    for (int e = 0; e < 3; ++e) {
      middle[e] = (p[0][e] + p[1][e] + p[2][e]) * (1.0f / 3.0f);
      off = std::max(off, std::max(low_[e] - middle[e], middle[e] - high_[e]));
    }
    off -= static_cast<float>(kRounding);
    if (!(off > 0.0f)) return false;
    for (const auto& corner : p) {
      const float dx = corner[0] - middle[0], dy = corner[1] - middle[1], dz = corner[2] - middle[2];
      radius2 = std::max(radius2, dx * dx + dy * dy + dz * dz);
    }
    return off * off > 1.01f * radius2;  // more than rounding takes
  }
  void push(const Vector3d& middle, double radius, std::uint32_t index) {
    const float r = static_cast<float>(radius) * 1.00001f;
    if (outside(middle, r) || near().full()) return;
    near().push(static_cast<float>(middle.x()), static_cast<float>(middle.y()),
                static_cast<float>(middle.z()), r, index);
  }
  /// Every candidate whose ball comes within `best + radius` of a place; `visit` may lower `best`.
  template <class Visit>
  void eachNear(const Vector3d& x, double radius, const double& best, Visit visit) {
    const auto px = static_cast<float>(x.x()), py = static_cast<float>(x.y()), pz = static_cast<float>(x.z());
    near().eachWithin(px, py, pz, reach_ + static_cast<float>(radius),
                      [&](float squared, float of_ball, std::uint32_t triangle) {
                        const float bound = static_cast<float>(best + radius) + of_ball;
                        if (squared <= bound * bound) visit(triangle);
                      });
  }

  /// The same for a point, the ball whose middle is nearest before all others.
  template <class Visit>
  void nearestFirst(const Vector3d& x, const double& best, Visit visit) {
    auto& hits = c_.scratch.near_balls;
    hits.clear();
    std::size_t first = 0;
    near().eachWithin(static_cast<float>(x.x()), static_cast<float>(x.y()), static_cast<float>(x.z()), reach_,
                      [&](float squared, float radius, std::uint32_t triangle) {
                        if (!hits.empty() && squared < hits[first].squared) first = hits.size();
                        hits.push_back({squared, radius, triangle});
                      });
    if (hits.empty()) return;
    std::swap(hits[0], hits[first]);
    for (const NearBall& ball : hits) {
      const float bound = static_cast<float>(best) + ball.radius;
      if (ball.squared <= bound * bound) visit(ball.triangle);
    }
  }

  OrganPair pairOf(bool edges, std::uint32_t knot) const {
    OrganPair p;
    p.object = static_cast<std::uint16_t>(a_), p.other = static_cast<std::uint16_t>(b_);
    p.edges = edges, p.knot = knot;
    return p;
  }
  /// The same knot's or edge's pair of the last search.
  const OrganPair* before(const OrganPair& p) const {
    const auto& old = c_.scratch.old_pairs;
    const auto at = std::lower_bound(old.begin(), old.end(), p, comesBefore);
    return at != old.end() && !comesBefore(p, *at) ? &*at : nullptr;
  }
  void keep(OrganPair& p, double distance) {
    p.clear = clearUntil(sa_, sb_, distance, touch_);
    if (c_.state.pairs.size() < c_.state.pairs.capacity()) c_.state.pairs.push_back(p);
  }

  /// The side of an object's own triangle on which a knot is: that on which it came there. False: inside of
  /// a closed surface, where the opposite wall is no obstacle.
  bool findSide(const Vector3d& x, const contact::Nearest& n, OrganPair& pair) const {
    const OrganPair* const old = before(pair);
    const double least = std::min({n.weights[0], n.weights[1], n.weights[2]});
    if (old != nullptr && (closed() || least > 0.0)) {  // else it may have gone round the rim of a sheet
      pair.side = old->side;
      return true;
    }
    const auto p = cornersOf(pair.triangle);
    pair.side = (p[1] - p[0]).cross(p[2] - p[0]).dot(x - p[0]) < 0.0 ? -1 : 1;
    return pair.side > 0 || !closed();
  }

  /// Sum of the areas beside an edge along their normals, m²: outwards on a closed surface.
  static Vector3d outOf(const ObjectState& s, const SurfaceEdge& e) {
    Vector3d sum = Vector3d::Zero();
    for (const std::uint32_t t : {e.triangle, e.beyond}) {
      const auto& k = s.triangles[t];
      const Vector3d p = knotPosition(s, k[0]);
      sum += 0.5 * (knotPosition(s, k[1]) - p).cross(knotPosition(s, k[2]) - p);
    }
    return sum;
  }
  /// On which side of the second edge the first is, along the cross product of both. False: the two are
  /// opposite walls, seen from within.
  bool crossing(const EdgeNow& e, const EdgeNow& g, double s, double t, const SurfaceEdge& ours,
                const SurfaceEdge& theirs, std::int8_t& side) const {
    const Vector3d across = (e.to - e.from).cross(g.to - g.from);
    const Vector3d off = e.from + s * (e.to - e.from) - g.from - t * (g.to - g.from);
    side = across.dot(off) < 0.0 ? -1 : 1;
    if (!closed() || !own_.closed) return true;
    const std::int8_t out = across.dot(outOf(sb_, theirs) - outOf(sa_, ours)) < 0.0 ? -1 : 1;
    if (self()) return out == side;
    side = out;
    return true;
  }
};

}  // namespace

float movedBy(const Context& c, std::size_t object) {
  const ObjectState& s = c.state.objects[object];
  const std::size_t knots = c.scratch.objects[object].knots_before;  // new ones are a jump
  return std::sqrt(net::knotLoops(c.level).furthest(s.block.motion(), c.scratch.objects[object].backup.data(),
                                                    s.block.motionFloats() / 6, knots)) *
         1.00001f;
}

void measureWays(Context& c) {
  // A cut may put knots elsewhere than they were: everything is looked at again.
  const bool cut = c.state.revision != c.state.way_revision;
  const double jump = cut ? 1.0 : 0.0;
  c.state.way_revision = c.state.revision;
  float furthest = 0.0f;
  for (const std::size_t object : c.model.bodies) {
    const float far = cut ? movedBy(c, object) : c.scratch.objects[object].moved;
    c.state.objects[object].way += static_cast<double>(far) + jump;
    furthest = std::max(furthest, far);
  }
  c.state.way += static_cast<double>(furthest) + jump;
}

void findOrganPairs(Context& c) {
  // Every step it is the turn of some objects, so that no step bears the whole search; it is made where
  // things came nearer since the last one.
  auto &pairs = c.state.pairs, &old = c.scratch.old_pairs;
  const std::uint64_t turn = c.state.step % kRenewEvery;
  bool any = false;
  for (const std::size_t a : c.model.bodies) {
    c.scratch.objects[a].search_due = false;
    ObjectState& s = c.state.objects[a];
    if (a % kRenewEvery != turn) continue;
    if (s.way_searched >= 0.0 && s.way + c.state.way - s.way_searched < kRenewWay) continue;
    s.way_searched = s.way + c.state.way;
    c.scratch.objects[a].search_due = any = true;
  }
  if (!any) return;
  old.clear();
  const auto due = [&](const OrganPair& p) { return c.scratch.objects[p.object].search_due; };
  for (const OrganPair& p : pairs)
    if (due(p)) old.push_back(p);
  std::sort(old.begin(), old.end(), Search::comesBefore);
  pairs.erase(std::remove_if(pairs.begin(), pairs.end(), due), pairs.end());
  for (const std::size_t a : c.model.bodies) {
    if (!c.scratch.objects[a].search_due) continue;
    for (const std::size_t b : c.model.bodies) {
      if (c.state.objects[b].triangles.empty() || c.model.objects[a].together[b]) continue;
      Search search(c, a, b);
      if (search.apart()) continue;
      search.knots();
      if (b <= a && c.model.fullContact(a, b)) search.edges();
    }
  }
}

}  // namespace vest::scene
