#include "organ_pairs.h"

#include <algorithm>
#include <cmath>

namespace vest::scene {
namespace {

using Eigen::Vector3d;

constexpr double kShare = 0.25;  ///< (omega·h)² that a held contact may have
constexpr double kDamping = 0.3, kPairGrip = 0.3;

/// Of the knots at both ends of a contact.
using Weights = std::array<std::array<double, 3>, 2>;

/// A knot and a triangle. `clear`: m, how far they are apart where that is more than `most`; else 0.
bool meetTriangle(const Context& c, const OrganPair& pair, double most, OrganContact& r, Vector3d& normal,
                  Weights& w, double& clear) {
  const ObjectState &sa = c.state.objects[pair.object], &sb = c.state.objects[pair.other];
  const auto& k = sb.triangles[pair.triangle];
  const Vector3d x = knotPosition(sa, pair.knot);
  const std::array<Vector3d, 3> p{knotPosition(sb, k[0]), knotPosition(sb, k[1]), knotPosition(sb, k[2])};
  const Vector3d face = (p[1] - p[0]).cross(p[2] - p[0]);
  const double area = std::sqrt(face.squaredNorm());
  const bool self = pair.object == pair.other;
  // What has passed through its own wall is pushed back, however deep it is.
  const bool through = self && pair.side * face.dot(x - p[0]) < 0.0;
  const double box = through ? 0.0 : toBoxSquared(x, p);
  if (box > most * most * (1.0 + 1e-9)) {
    clear = std::sqrt(box);
    return false;
  }
  const auto n = contact::nearest(x, p);
  if (!(n.distance < most) && !through) {
    clear = n.distance;
    return false;
  }
  if (!(area > 1e-14)) return false;
  normal = x - (p[0] * n.weights[0] + p[1] * n.weights[1] + p[2] * n.weights[2]);
  // On a closed surface outside is where the triangle faces: a knot that got in through the face goes out
  // there. At edges and on open sheets the side is the one on which the knot is.
  const bool on_face = n.weights[0] > 0.02 && n.weights[1] > 0.02 && n.weights[2] > 0.02;
  const bool wrong = (self || c.model.objects[pair.other].closed) && pair.side * normal.dot(face) < 0.0;
  if (wrong && !on_face && self) return false;  // it slid round an edge: another triangle's turn
  if (n.distance < 1e-6 || (wrong && on_face)) {
    normal = pair.side * face / area;
  } else {
    normal /= std::sqrt(normal.squaredNorm());
  }
  r.ends[0].knots = {pair.knot, pair.knot, pair.knot}, r.ends[1].knots = k;
  w = {{{1.0, 0.0, 0.0}, n.weights}};
  return true;
}

/// Two edges that cross.
bool meetEdges(const Context& c, const OrganPair& pair, double most, OrganContact& r, Vector3d& normal,
               Weights& w, double& clear) {
  const ObjectState &sa = c.state.objects[pair.object], &sb = c.state.objects[pair.other];
  const EdgeNow e(sa, c.model.objects[pair.object].edges[pair.knot]),
      g(sb, c.model.objects[pair.other].edges[pair.triangle]);
  double s, t;
  const double distance = contact::nearestSegments(e.from, e.to, g.from, g.to, s, t);
  if (!(distance < most)) {
    clear = distance;
    return false;
  }
  const Vector3d u = e.to - e.from, v = g.to - g.from;
  normal = pair.side * u.cross(v);
  const double across = std::sqrt(normal.squaredNorm());
  // At their ends, and where they are nearly parallel, knots and triangles do it.
  if (!(s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0) ||
      !(across > 0.1 * std::sqrt(u.squaredNorm() * v.squaredNorm())))
    return false;
  normal /= across;
  r.ends[0].knots = {e.knots[0], e.knots[1], e.knots[1]},
  r.ends[1].knots = {g.knots[0], g.knots[1], g.knots[1]};
  w = {{{1.0 - s, s, 0.0}, {1.0 - t, t, 0.0}}};
  return true;
}

}  // namespace

void findOrganContacts(Context& c) {
  auto& contacts = c.scratch.organ_contacts;
  contacts.clear();
  const auto& d = c.model.description;
  for (OrganPair& pair : c.state.pairs) {
    const ObjectState &sa = c.state.objects[pair.object], &sb = c.state.objects[pair.other];
    if (sa.way + sb.way < pair.clear) continue;
    const double reach = d.objects[pair.object].contact_thickness + d.objects[pair.other].contact_thickness;
    OrganContact r;
    r.ends[0].object = pair.object, r.ends[1].object = pair.other;
    Vector3d normal;
    Weights w;
    double clear = 0.0;
    const bool touches = pair.edges ? meetEdges(c, pair, reach + kClose, r, normal, w, clear)
                                    : meetTriangle(c, pair, reach + kClose, r, normal, w, clear);
    if (clear > 0.0) pair.clear = clearUntil(sa, sb, clear, reach + kClose);
    if (!touches) continue;
    r.couple.fill(Vector3d::Zero());
    r.normal = normal.cast<float>();
    std::array<double, 2> inverses{};
    for (std::size_t n = 0; n < 2; ++n)
      for (std::size_t e = 0; e < 3; ++e) {
        r.ends[n].weights[e] = static_cast<float>(w[n][e]);
        inverses[n] += w[n][e] * w[n][e] * contactInverseMass(n == 0 ? sa : sb, r.ends[n].knots[e]);
      }
    // What moves first answers implicitly: then only the other end's mass limits the spring.
    const int first = c.body(pair.object).turn(), second = c.body(pair.other).turn();
    r.implicit_end = static_cast<std::int8_t>(first < second ? 0 : second < first ? 1 : -1);
    // A body that moves early answers to itself, too: both ends at once.
    if (pair.object == pair.other && first < Body::kLast) r.implicit_end = 0;
    r.balanced = r.implicit_end < 0 && c.model.fullContact(pair.object, pair.other);
    const double inverse = r.implicit_end < 0 ? inverses[0] + inverses[1]
                                              : inverses[static_cast<std::size_t>(1 - r.implicit_end)];
    r.batches = std::min(sa.batches, sb.batches) * c.stretch;
    const double h = c.dt / r.batches;
    r.stiffness = static_cast<float>(kShare / (h * h * inverse));
    r.damping = static_cast<float>(kDamping / (h * inverse));
    r.grip = static_cast<float>(kPairGrip / (h * inverse));
    r.friction =
        static_cast<float>(std::max(d.objects[pair.object].friction, d.objects[pair.other].friction));
    r.reach = static_cast<float>(reach);
    if (contacts.size() < contacts.capacity()) contacts.push_back(r);
  }
  for (ObjectScratch& o : c.scratch.objects) o.first_contact = OrganContact::kNone;
  for (std::uint32_t n = 0; n < contacts.size(); ++n)
    for (std::size_t end = 0; end < 2; ++end) {
      const std::uint16_t object = contacts[n].ends[end].object;
      if (end == 1 && object == contacts[n].ends[0].object) continue;
      ObjectScratch& o = c.scratch.objects[object];
      if (o.first_contact == OrganContact::kNone) {
        o.first_contact = n;
      } else {
        OrganContact& last = contacts[o.last_contact];
        last.next[last.ends[0].object == object ? 0 : 1] = n;
      }
      o.last_contact = n;
    }
  // As stiff as the exchange of held forces allows: contacts that share a knot share that room.
  if (contacts.empty()) return;
  for (ObjectScratch& o : c.scratch.objects) std::fill(o.shared.begin(), o.shared.end(), std::uint16_t{0});
  const auto each = [&](const OrganContact& r, auto visit) {
    for (const ContactEnd& end : r.ends)
      for (std::size_t e = 0; e < 3; ++e)
        if (end.weights[e] > 1e-3f) visit(c.scratch.objects[end.object].shared[end.knots[e]]);
  };
  for (const OrganContact& r : contacts) each(r, [](std::uint16_t& count) { ++count; });
  for (OrganContact& r : contacts) {
    std::uint16_t most = 1;
    each(r, [&](std::uint16_t& count) { most = std::max(most, count); });
    r.stiffness /= most, r.damping /= most, r.grip /= most;
  }
}

}  // namespace vest::scene
