#include "contacts.h"

#include <algorithm>
#include <cmath>

#include "blocks.h"

namespace vest::suture {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Index kGroup = 8;             ///< segments of a box
constexpr std::size_t kMostRows = 400;  ///< at once
constexpr double kSoon = 0.25;  ///< of the distance at which two touch: a pair that is further apart is far

bool before(const LiveContact& p, const LiveContact& q) {
  return p.a != q.a ? p.a < q.a : p.b < q.b;
}

const LiveContact* find(const State& s, Index a, Index b) {
  LiveContact key;
  key.a = a, key.b = b;
  const auto end = s.contacts.begin() + s.contact_count;
  const auto at = std::lower_bound(s.contacts.begin(), end, key, before);
  return at != end && at->a == a && at->b == b ? &*at : nullptr;
}

}  // namespace

/// Ericson, Real-Time Collision Detection, 5.1.9.
Closest closest(const Vector3d& p, const Vector3d& u, const Vector3d& q, const Vector3d& v, bool line) {
  const Vector3d r = p - q;
  const double a = u.squaredNorm(), e = v.squaredNorm(), f = v.dot(r), c = u.dot(r), b = u.dot(v);
  const double d = a * e - b * b;
  Closest k;
  k.s = d > 1e-12 * a * e ? std::clamp((b * f - c * e) / d, 0.0, 1.0) : 0.5;
  k.t = (b * k.s + f) / e;
  if (!line && (k.t < 0.0 || k.t > 1.0)) {
    k.t = std::clamp(k.t, 0.0, 1.0);
    k.s = std::clamp((b * k.t - c) / a, 0.0, 1.0);
  }
  k.between = r + k.s * u - k.t * v;
  k.across = line || (k.s > 0.0 && k.s < 1.0 && k.t > 0.0 && k.t < 1.0);
  return k;
}

namespace {

/// Which way the pair lies, and how far; on the side where it was. At ends of segments the way may turn by
/// any angle: their neighbours keep the side.
struct Side {
  Vector3d normal;
  double distance;
};
Side keptSide(const Closest& k, const Vector3d& was, double reach) {
  const double d = k.between.norm();
  if (!(d > 1e-9 * reach)) return {was, 0.0};
  const Vector3d now = k.between / d;
  return k.across && now.dot(was) < 0.0 ? Side{-now, -d} : Side{now, d};
}

Closest closestOf(const Model& m, const State& s, Index a, Index b) {
  const Index a1 = strandOf(m, a).next(a);
  const Vector3d u = s.position[a1] - s.position[a];
  if (b >= kCylinder) {
    const Cylinder& c = m.cylinders[b - kCylinder];
    return closest(s.position[a], u, c.point, c.axis, true);
  }
  return closest(s.position[a], u, s.position[b], s.position[strandOf(m, b).next(b)] - s.position[b], false);
}

/// The side on which a new pair begins: that of a neighbour that was near before, if it is another.
Vector3d sideOf(const State& s, Index a, Index b, const Vector3d& between) {
  for (const auto& [da, db] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
    if (b >= kCylinder && db != 0) continue;
    const LiveContact* n = find(s, a + static_cast<Index>(da), b + static_cast<Index>(db));
    if (n != nullptr && n->normal.dot(between) < -0.3 * between.norm()) return n->normal;
  }
  const double d = between.norm();
  return d > 0.0 ? Vector3d(between / d) : Vector3d::UnitX();
}

double speedOf(const State& s, const Strand& strand, Index a) {
  return std::sqrt(std::max(s.velocity[a].squaredNorm(), s.velocity[strand.next(a)].squaredNorm()));
}

/// A thread's friction at a contact of the length, m, as wide as the thread is thick.
Friction frictionOf(const Section& section, double length) {
  return {section.friction, section.friction_fall, section.friction_pressure * 2.0 * section.radius * length};
}

void consider(const Model& m, const State& s, Index a, Index b, double margin, ContactScratch& c) {
  const Strand& sa = strandOf(m, a);
  Near n;
  n.live.a = a, n.live.b = b;
  if (b >= kCylinder) {
    const Cylinder& cylinder = m.cylinders[b - kCylinder];
    n.reach = sa.section.radius + cylinder.radius;
    n.friction = sa.section.friction >= cylinder.friction ? frictionOf(sa.section, m.length[a])
                                                          : Friction{cylinder.friction, 0.0, 0.0};
  } else {
    const Strand& sb = strandOf(m, b);
    n.reach = sa.section.radius + sb.section.radius;
    n.friction = frictionOf((sa.section.friction >= sb.section.friction ? sa : sb).section,
                            0.5 * (m.length[a] + m.length[b]));
  }
  const Closest k = closestOf(m, s, a, b);
  if (k.between.norm() > n.reach + margin) return;
  if (c.near.size() == c.near.capacity()) {
    c.full = true;
    return;
  }
  if (const LiveContact* live = find(s, a, b)) {
    n.live = *live;
  } else {
    n.live.normal = sideOf(s, a, b, k.between);
  }
  c.near.push_back(n);
}

}  // namespace

std::size_t contactRoom(const Model& model) {
  return model.mass.empty() ? 0 : 12 * model.mass.size() + 64;
}

ContactScratch::ContactScratch(const Model& model) {
  arc.resize(model.mass.size(), 0.0);
  for (const Strand& strand : model.strands) {
    double at = 0.0;
    for (Index k = 0; k < strand.segments; ++k) {
      arc[strand.first + k] = at + 0.5 * model.length[strand.first + k];
      at += model.length[strand.first + k];
      if (strand.first + k < strand.threadFirst()) continue;  // a needle touches no thread
      if (k % kGroup == 0 || strand.first + k == strand.threadFirst())
        boxes.push_back({Vector3d::Zero(), Vector3d::Zero(), strand.first + k,
                         strand.first + std::min((k / kGroup + 1) * kGroup, strand.segments)});
    }
  }
  near.reserve(contactRoom(model));
  rows.reserve(kMostRows);
  touched.reserve(4 * kMostRows);
  place.resize(model.mass.size(), kNone);
  const std::size_t most = std::min(model.mass.size(), 4 * kMostRows);
  answers.resize(most * most);
  leads.resize(most);
  room = std::min(kMostRows, 4 * model.mass.size());
  makeRoomForForces(*this);
  middle.resize(model.mass.size());
  round.resize(model.mass.size());
}

void forgetAnswers(ContactScratch& c) {
  c.answered = false;
}

void findNear(const Model& m, const State& s, double h, ContactScratch& c) {
  c.near.clear();
  c.full = false;
  double thickest = 0.0;
  for (const Strand& strand : m.strands) thickest = std::max(thickest, strand.section.radius);
  for (ContactScratch::Box& box : c.boxes) {
    const Strand& strand = strandOf(m, box.first);
    box.low = box.high = s.position[box.first];
    double way = 0.0;
    for (Index i = box.first; i < box.end; ++i) {
      const Vector3d& x = s.position[strand.next(i)];
      box.low = box.low.cwiseMin(x), box.high = box.high.cwiseMax(x);
      const double speed = speedOf(s, strand, i);
      way = std::max(way, speed);
      c.middle[i] = 0.5 * (s.position[i] + x);
      c.round[i] = 0.5 * std::sqrt((x - s.position[i]).squaredNorm()) + strand.section.radius +
                   1.5 * h * speed + 0.500001 * thickest;
    }
    const double more = strand.section.radius * 1.5 + 1.5 * h * way;
    box.low.array() -= more, box.high.array() += more;
  }
  const auto pair = [&](Index i, Index j) {
    const double reach = c.round[i] + c.round[j];
    if ((c.middle[i] - c.middle[j]).squaredNorm() > reach * reach) return;
    if (s.severed[i] != 0 || s.severed[j] != 0) return;
    const Strand &si = strandOf(m, i), &sj = strandOf(m, j);
    if (&si == &sj) {
      double apart = std::abs(c.arc[i] - c.arc[j]);
      if (si.closed) {
        const Index last = si.first + si.segments - 1;
        apart = std::min(apart, c.arc[last] + 0.5 * m.length[last] - apart);
      }
      const double l = std::max(m.length[i], m.length[j]);
      if (apart <= std::max(3.0 * l, 4.0 * si.section.radius) * (1.0 + 1e-9)) return;
    }
    const double way = 1.5 * h * (speedOf(s, si, i) + speedOf(s, sj, j));
    consider(m, s, i, j, way + thickest, c);
  };
  for (std::size_t p = 0; p < c.boxes.size(); ++p) {
    const ContactScratch::Box& b = c.boxes[p];
    for (std::size_t q = p; q < c.boxes.size(); ++q) {
      const ContactScratch::Box& o = c.boxes[q];
      if ((b.low.array() > o.high.array()).any() || (o.low.array() > b.high.array()).any()) continue;
      for (Index i = b.first; i < b.end; ++i)
        for (Index j = std::max(i + 1, o.first); j < o.end; ++j) pair(i, j);
    }
    for (Index k = 0; k < m.cylinders.size(); ++k)
      for (Index i = b.first; i < b.end; ++i)
        consider(m, s, i, kCylinder + k, 1.5 * h * speedOf(s, strandOf(m, i), i) + thickest, c);
  }
  std::sort(c.near.begin(), c.near.end(),
            [](const Near& p, const Near& q) { return before(p.live, q.live); });
}

namespace {

/// The closest point of the pair is the end of a segment, and a pair with the next segment has it, too.
bool isDoubled(const Model& m, const ContactScratch& c, const Near& n, const Closest& k) {
  const auto there = [&c](Index a, Index b) {
    Near key;
    key.live.a = std::min(a, b), key.live.b = std::max(a, b);
    return std::binary_search(c.near.begin(), c.near.end(), key,
                              [](const Near& p, const Near& q) { return before(p.live, q.live); });
  };
  const Index a = n.live.a, b = n.live.b;
  if (k.s == 1.0 && there(strandOf(m, a).next(a), b)) return true;
  return b < kCylinder && k.t == 1.0 && there(a, strandOf(m, b).next(b));
}

/// The row of a near pair at the iterate; gaps are those after the free change.
Row rowOf(const Model& m, const State& before, const State& s, const Near& n, const Scratch& scratch) {
  Row row;
  const Index a = n.live.a, b = n.live.b;
  const Closest k = closestOf(m, s, a, b);
  const bool on_thread = b < kCylinder;
  row.doubled = isDoubled(m, *scratch.contacts, n, k);
  const std::array<Index, 4> node = {a, strandOf(m, a).next(a), on_thread ? b : kNone,
                                     on_thread ? strandOf(m, b).next(b) : kNone};
  row.weight = {1.0 - k.s, k.s, k.t - 1.0, -k.t};
  const Side side = keptSide(k, n.live.normal, n.reach);
  const Vector3d& normal = side.normal;
  const double gap = side.distance - n.reach;
  // Tangents: the first one along the thread.
  const Vector3d along = s.position[node[1]] - s.position[node[0]];
  Vector3d t = along - along.dot(normal) * normal;
  if (!(t.squaredNorm() > 1e-12 * along.squaredNorm())) t = normal.unitOrthogonal();
  t.normalize();
  row.axes << normal, t, normal.cross(t);
  Vector3d slip = Vector3d::Zero(), ahead = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    row.node[i] = node[i];
    if (node[i] == kNone) continue;
    slip += row.weight[i] * (s.position[node[i]] - before.position[node[i]]);
    ahead += row.weight[i] * scratch.change[node[i]].head<3>();
    if (m.held_at[node[i]] != kNone) row.node[i] = kNone;
  }
  row.gap = row.axes.transpose() * (slip - ahead);
  row.gap[0] = gap - normal.dot(ahead);
  // The free change alone does not tell: in a drawn knot it is many times what contacts leave of it, and one
  // that leads a pair apart left it without force while others held it together.
  row.far = std::min(gap, row.gap[0]) > kSoon * n.reach;
  row.force = row.axes.transpose() * n.live.force;
  row.force[0] = std::max(0.0, row.force[0]);
  const double most = coefficient(n.friction, row.force[0]) * row.force[0], size = row.force.tail<2>().norm();
  if (size > most) row.force.tail<2>() *= size > 0.0 ? most / size : 0.0;
  return row;
}

/// Nodes of rows; those of the pass before serve where they have all of them. @return whether they do
bool collectTouched(ContactScratch& c) {
  bool same = c.answered;
  for (const Row& row : c.rows)
    for (const Index i : row.node) same = same && (i == kNone || c.place[i] != kNone);
  if (same) return true;
  for (const Index i : c.touched) c.place[i] = kNone;
  c.touched.clear();
  for (const Row& row : c.rows)
    for (const Index i : row.node)
      if (i != kNone && c.place[i] == kNone) c.place[i] = 0, c.touched.push_back(i);
  std::sort(c.touched.begin(), c.touched.end());
  for (std::size_t k = 0; k < c.touched.size(); ++k) c.place[c.touched[k]] = static_cast<Index>(k);
  return false;
}

/// Blocks of the inverse between touched nodes.
void findAnswers(const Model& m, Scratch& scratch, ContactScratch& c) {
  const std::size_t n = c.touched.size();
  std::fill(c.answers.begin(), c.answers.begin() + static_cast<std::ptrdiff_t>(n * n), Matrix3d::Zero());
  for (std::size_t k = 0; k < m.strands.size(); ++k) {
    const Strand& strand = m.strands[k];
    BlockChain& chain = scratch.chain[k];
    const auto begin = std::lower_bound(c.touched.begin(), c.touched.end(), strand.first);
    const auto end = std::lower_bound(begin, c.touched.end(), strand.first + strand.nodes);
    if (begin == end) continue;
    chain.prepareInverse(*begin - strand.first);
    for (auto p = begin; p + 1 < end; ++p) {  // from each touched node to the one before
      Matrix6& leads = c.leads[static_cast<std::size_t>(p - c.touched.begin())];
      leads.setIdentity();
      for (Index i = p[1]; i-- > *p;) chain.lead(i - strand.first, leads);
    }
    for (auto q = begin; q != end; ++q) {
      const std::size_t at = static_cast<std::size_t>(q - c.touched.begin());
      Matrix63 column = chain.inverse(*q - strand.first).leftCols<3>(), last;
      for (auto p = q;; --p) {
        const std::size_t row = static_cast<std::size_t>(p - c.touched.begin());
        if (p != q) last = column, times(c.leads[row], last, column);
        const Matrix3d block = column.topRows<3>() + chain.around(*p - strand.first, *q - strand.first);
        c.answers[row * n + at] = block;
        c.answers[at * n + row] = block.transpose();
        if (p == begin) break;
      }
    }
  }
}

}  // namespace

bool solveContacts(const Model& m, const State& before, const State& s, Scratch& scratch) {
  ContactScratch& c = *scratch.contacts;
  c.rows.clear();
  for (Index k = 0; k < c.near.size(); ++k) {
    Row row = rowOf(m, before, s, c.near[k], scratch);
    row.near = k;
    const bool far = row.far && c.near[k].live.force.isZero();
    c.near[k].live.force.setZero();
    if (far || row.doubled) continue;
    if (c.rows.size() == c.room) {
      c.full = true;
      continue;
    }
    c.rows.push_back(row);
  }
  if (c.rows.empty()) return false;
  if (!collectTouched(c)) findAnswers(m, scratch, c);
  c.answered = true;
  couple(c);
  findForces(c, scratch);
  bool any = false;
  for (const Row& row : c.rows) {
    const Vector3d force = row.axes * row.force;
    c.near[row.near].live.force = force;
    any = any || row.force[0] > 0.0;
    for (int i = 0; i < 4; ++i)
      if (row.node[i] != kNone) scratch.gradient[row.node[i]].head<3>() -= row.weight[i] * force;
  }
  return any;
}

void addCurvature(const Model& m, const State& s, Scratch& scratch) {
  for (const Near& near : scratch.contacts->near) {
    if (near.live.b < kCylinder || near.live.force.isZero()) continue;
    const Index a = near.live.a;
    const Strand& strand = strandOf(m, a);
    const Index a1 = strand.next(a);
    const Closest k = closestOf(m, s, a, near.live.b);
    if (!(k.s > 0.0 && k.s < 1.0)) continue;
    const Vector3d& axis = m.cylinders[near.live.b - kCylinder].axis;
    const Vector3d u = s.position[a1] - s.position[a], across = u - u.dot(axis) * axis;
    const double length = across.norm(), d = k.between.norm();
    const Vector3d t = across / length, n = k.between / d;
    const double load = n.dot(near.live.force);
    if (!(load > 0.0) || !(length > 1e-3 * m.length[a]) || !(d > 0.5 * near.reach)) continue;
    // Of the work of the load, −load·(2·dθ·τ + d·dθ²) for changes dθ = n·(dx1 − dx0)/L and
    // τ = t·((1 − s)·dx0 + s·dx1). A spring along the normal, which the contact holds, keeps it definite.
    const std::array<double, 2> w = {1.0 - k.s, k.s}, r = {-1.0 / length, 1.0 / length};
    const Matrix3d nn = (load * d) * n * n.transpose(), nt = load * n * t.transpose();
    const auto block = [&](std::size_t i, std::size_t j) -> Matrix3d {
      return (r[i] * w[j]) * nt + (w[i] * r[j]) * nt.transpose() +
             (r[i] * r[j] + w[i] * w[j] / (length * length)) * nn;
    };
    BlockChain& chain = scratch.chain[static_cast<std::size_t>(&strand - m.strands.data())];
    chain.diagonal[a - strand.first].topLeftCorner<3, 3>() += block(0, 0);
    chain.diagonal[a1 - strand.first].topLeftCorner<3, 3>() += block(1, 1);
    chain.lower[a - strand.first].topLeftCorner<3, 3>() += block(1, 0);
  }
}

double contactWork(const Scratch& scratch) {
  double sum = 0.0;
  for (const Row& row : scratch.contacts->rows) {
    const Vector3d force = row.axes * row.force;
    for (std::size_t i = 0; i < 4; ++i)  // nodes move by −change
      if (row.node[i] != kNone) sum += row.weight[i] * force.dot(scratch.change[row.node[i]].head<3>());
  }
  return sum;
}

void keepContacts(const Model& m, State& s, Scratch& scratch) {
  for (Vector3d& f : scratch.contact_force) f.setZero();
  ContactScratch& c = *scratch.contacts;
  s.contact_count = static_cast<Index>(std::min(c.near.size(), s.contacts.size()));
  for (Index k = 0; k < s.contact_count; ++k) {
    LiveContact& live = s.contacts[k] = c.near[k].live;
    const Closest at = closestOf(m, s, live.a, live.b);
    live.normal = keptSide(at, live.normal, c.near[k].reach).normal;
    scratch.contact_force[live.a] += (1.0 - at.s) * live.force;
    scratch.contact_force[strandOf(m, live.a).next(live.a)] += at.s * live.force;
    if (live.b >= kCylinder) continue;
    scratch.contact_force[live.b] -= (1.0 - at.t) * live.force;
    scratch.contact_force[strandOf(m, live.b).next(live.b)] -= at.t * live.force;
  }
}

}  // namespace vest::suture
