#include "connections.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include "body.h"
#include "connection_kernel.h"
#include "vest_tissue/scene/topology.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using net::Block;

/// 1: greatest answer of a face to a force at the end of its lever, over that at its foot (tuned).
/// Connections of 11 mm on triangles of 4 mm would need ten times as many exchanges as their foot does.
constexpr double kGreatestLever = 1.9;
using kernel::kLeastFace;
using kernel::kLighter;
constexpr int kSweeps = 12;  ///< of connectionRates() (tuned)

/// Where an anchor's face carries its end: at sum of weights·knots + height·normal. The weights may lie
/// beyond the face (sum 1), so that the place turns with it as a rigid lever does.
struct Face {
  Vector3d corner = Vector3d::Zero();                           ///< m, world: corner 0
  Vector3d edge1 = Vector3d::Zero(), edge2 = Vector3d::Zero();  ///< m, from corner 0
  Vector3d normal = Vector3d::Zero();                           ///< unit, or zero
  double doubled = 0.0;  ///< m²: twice the area; 0: no face to speak of
};

bool onFace(const net::Anchor& a) {
  return a.knots[0] != a.knots[1] && a.knots[1] != a.knots[2] && a.knots[0] != a.knots[2] &&
         a.weights[3] == 0.0;
}

/// What the knots of an anchor do, read once: those that bear it or span its face.
struct Corners {
  std::array<Vector3d, 4> place, velocity;  ///< m, some time ahead; m/s, now
  std::array<double, 4> inverse_mass;       ///< 1/kg
};

/// @param ahead s: from now to the places
Corners cornersOf(const WorldState& state, const net::Anchor& a, double ahead) {
  const ObjectState& s = state.objects[a.object];
  const float* const w = row(s, Block::kInverseMass);
  const bool face = onFace(a);
  Corners corners;
  for (std::size_t i = 0; i < 4; ++i) {
    if (a.weights[i] == 0.0 && !(face && i < 3)) {
      corners.place[i].setZero(), corners.velocity[i].setZero(), corners.inverse_mass[i] = 0.0;
      continue;
    }
    const std::uint32_t k = a.knots[i];
    corners.velocity[i] = knotVelocity(s, k);
    corners.place[i] = ahead == 0.0 ? knotPosition(s, k) : knotPosition(s, k) + ahead * corners.velocity[i];
    corners.inverse_mass[i] = static_cast<double>(w[k]);
  }
  return corners;
}

/// s: from the start of a batch of `h` to the mean of the places at which its sub-steps take their forces.
/// Each takes them where it begins.
double untilMean(const Context& c, std::size_t object, double h) {
  return 0.5 * std::max(0.0, h - c.scratch.objects[object].sub_step);
}

/// m: length of the edge of a face that lies opposite to each knot.
std::array<double, 3> edgesOf(const Face& face) {
  return {std::sqrt((face.edge1 - face.edge2).squaredNorm()), std::sqrt(face.edge2.squaredNorm()),
          std::sqrt(face.edge1.squaredNorm())};
}

/// Per knot of an anchor, no unit: how far the height turns the place with it, at most.
std::array<double, 4> leversOf(const net::Anchor& a, const Face& face, const std::array<double, 3>& edges) {
  if (a.height == 0.0 || !(face.doubled > 0.0)) return {};
  const double arm = std::fabs(a.height) / face.doubled;
  return {arm * edges[0], arm * edges[1], arm * edges[2], 0.0};
}

Face faceOf(const Corners& corners, const net::Anchor& a) {
  Face face;
  if (!onFace(a)) return face;
  face.corner = corners.place[0];
  face.edge1 = corners.place[1] - face.corner, face.edge2 = corners.place[2] - face.corner;
  const Vector3d cross = face.edge1.cross(face.edge2);
  const double doubled = std::sqrt(cross.squaredNorm());
  if (!(doubled > kLeastFace)) return face;
  face.doubled = doubled, face.normal = cross / doubled;
  return face;
}

/// m, world; on the face, without the height.
Vector3d footOf(const Corners& corners, const net::Anchor& a) {
  Vector3d p = Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i)
    if (a.weights[i] != 0.0) p += a.weights[i] * corners.place[i];
  return p;
}

/// m, world, with it.
Vector3d placeOf(const Corners& corners, const net::Anchor& a, const Face& face) {
  const Vector3d foot = footOf(corners, a);
  return a.height == 0.0 ? foot : Vector3d(foot + a.height * face.normal);
}

/// m/s: of the place.
Vector3d velocityOf(const Corners& corners, const net::Anchor& a, const Face& face) {
  Vector3d v = Vector3d::Zero();
  for (std::size_t i = 0; i < 4; ++i)
    if (a.weights[i] != 0.0) v += a.weights[i] * corners.velocity[i];
  if (a.height == 0.0 || face.doubled == 0.0) return v;
  const Vector3d &v0 = corners.velocity[0], u1 = corners.velocity[1] - v0, u2 = corners.velocity[2] - v0;
  const Vector3d turning = u1.cross(face.edge2) + face.edge1.cross(u2);
  return v + a.height / face.doubled * (turning - face.normal.dot(turning) * face.normal);
}

/// 1/kg: how the place answers to a force, at most.
double inverseMass(const Corners& corners, const net::Anchor& a, const Face& face,
                   const std::array<double, 3>& edges) {
  const std::array<double, 4> lever = leversOf(a, face, edges);
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i)  // along the normal and across it: at right angles
    sum += (a.weights[i] * a.weights[i] + lever[i] * lever[i] + 2.0 * std::fabs(a.weights[i]) * lever[i]) *
           corners.inverse_mass[i];
  return sum;
}
double inverseMass(const Corners& corners, const net::Anchor& a) {
  return inverseMass(corners, a, Face{}, {});
}

/// Adds what a force (N) at the place does to each knot (N): sum and torque are those of the force.
void share(const net::Anchor& a, const Face& face, const Vector3d& force, std::array<Vector3d, 4>& knots) {
  for (std::size_t i = 0; i < 4; ++i)
    if (a.weights[i] != 0.0) knots[i] += a.weights[i] * force;
  if (a.height == 0.0 || face.doubled == 0.0) return;
  // Transpose of what the normal's turning does to the place.
  const Vector3d across = a.height / face.doubled * (force - face.normal.dot(force) * face.normal);
  const Vector3d f1 = face.edge2.cross(across), f2 = across.cross(face.edge1);
  knots[1] += f1, knots[2] += f2, knots[0] -= f1 + f2;
}

/// Weights and height with which the anchor's face carries a place (m, world). False: there is no face.
bool carry(net::Anchor& a, const Face& face, const Vector3d& place) {
  if (face.doubled == 0.0) return false;
  const Vector3d r = place - face.corner;
  const double w1 = r.cross(face.edge2).dot(face.normal) / face.doubled,
               w2 = face.edge1.cross(r).dot(face.normal) / face.doubled;
  a.weights = {1.0 - w1 - w2, w1, w2, 0.0};
  a.height = r.dot(face.normal);
  return true;
}

/// m: by how much a way (m) from end 0 to end 1 stretches what has the given strand.
Vector3d stretchOf(const Vector3d& way, double strand) {
  if (strand == 0.0) return way;
  // A strand that is crushed to nothing has no direction.
  const double length = std::max(std::sqrt(way.squaredNorm()), 0.1 * strand);
  return (1.0 - strand / length) * way;
}

Vector3d placeOf(const WorldState& state, const net::Anchor& a) {
  const Corners corners = cornersOf(state, a, 0.0);
  return placeOf(corners, a, faceOf(corners, a));
}

}  // namespace

Vector3d footOf(const WorldState& state, const net::Anchor& a) {
  return footOf(cornersOf(state, a, 0.0), a);
}

std::vector<solver::Rates> connectionRates(const Description& d, const WorldState& state) {
  // M^-1 J^T k J has the eigenvalues of G = k^1/2 J M^-1 J^T k^1/2, a row a connection: two meet in the knots
  // that both hold. With the sizes of G and any x > 0 none is greater than the greatest (G x)_n / x_n
  // (Collatz 1942); sweeps of x <- G x bring all of these near to it.
  const std::size_t count = d.connections.size();
  std::vector<std::vector<double>> held;  // per knot
  for (const ObjectState& s : state.objects) held.emplace_back(s.block.knots());
  const auto each = [&](std::size_t n, auto work) {
    const ConnectionState& s = state.connections[n];
    for (const net::Anchor* a : {&s.end0, &s.end1}) {
      const Face face = faceOf(cornersOf(state, *a, 0.0), *a);
      const std::array<double, 4> lever = leversOf(*a, face, edgesOf(face));
      for (std::size_t i = 0; i < 4; ++i)
        work(held[a->object][a->knots[i]], std::fabs(a->weights[i]) + lever[i],
             static_cast<double>(row(state.objects[a->object], Block::kInverseMass)[a->knots[i]]));
    }
  };
  const auto bound = [&](double Connection::*of) {
    std::vector<double> x(count, 1.0), ratio(count, 0.0);
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      for (auto& h : held) std::fill(h.begin(), h.end(), 0.0);
      for (std::size_t n = 0; n < count; ++n)
        each(n, [&](double& sum, double moves, double /*inverse_mass*/) {
          sum += std::sqrt(d.connections[n].*of) * moves * x[n];
        });
      double most = 0.0;
      for (std::size_t n = 0; n < count; ++n) {
        double next = 0.0;
        each(n, [&](double& sum, double moves, double inverse_mass) {
          next += std::sqrt(d.connections[n].*of) * moves * inverse_mass * sum;
        });
        ratio[n] = x[n] > 0.0 ? next / x[n] : 0.0;
        x[n] = next, most = std::max(most, next);
      }
      for (double& value : x) value /= most > 0.0 ? most : 1.0;
    }
    return ratio;
  };
  const std::vector<double> stiff = bound(&Connection::stiffness), damped = bound(&Connection::damping);
  std::vector<solver::Rates> rates;
  for (std::size_t n = 0; n < count; ++n) rates.push_back({stiff[n], damped[n]});
  return rates;
}

Vector3d stretchOf(const WorldState& state, const ConnectionState& s, const ConnectionConstants& k) {
  return stretchOf(placeOf(state, s.end1) - placeOf(state, s.end0), k.strand);
}

bool carryOffset(const WorldState& state, ConnectionState& s, const Vector3d& offset,
                 ConnectionConstants& k) {
  const Corners corners = cornersOf(state, s.end1, 0.0);
  const Face face = faceOf(corners, s.end1);
  const std::array<double, 3> edges = edgesOf(face);
  const double own = inverseMass(cornersOf(state, s.end0, 0.0), s.end0);
  const double most = own + kGreatestLever * inverseMass(corners, s.end1, face, edges);
  const Vector3d foot = footOf(corners, s.end1);
  const double length = std::sqrt(offset.squaredNorm());
  if (length > 0.0) {
    net::Anchor a = s.end1;
    double share = 1.0;
    do {
      if (!carry(a, face, foot + share * offset)) return false;
      k.inverse_mass = own + inverseMass(corners, a, face, edges);
      k.strand = (1.0 - share) * length;
      share *= 0.9;
    } while (k.inverse_mass > most && share > 0.05);
    s.end1 = a;
  }
  k.inverse_mass = own + inverseMass(corners, s.end1, face, edges);
  return true;
}

void sever(Context& c, std::size_t n, double force, int instrument) {
  ConnectionState& s = c.state.connections[n];
  s.alive = false;
  // The object's own lists stay as they are: a delta without entries.
  TopologyDelta& delta = c.deltas->next();
  beginDelta(c.state, s.end0.object, delta);
  delta.revision = ++c.state.revision;
  c.deltas->keep();
  Event e = eventOf(c, instrument < 0 ? EventKind::Torn : EventKind::Cut, instrument, s.end0.object,
                    s.end0.knots[0]);
  e.position = placeOf(c.state, s.end0);
  e.force = force;
  emit(c, e);
}

void kernel::pull(ConnectionLanes& lanes, net::KernelLevel level) {
#if defined(VEST_HAVE_AVX2_KERNEL)
  if (level == net::KernelLevel::Avx2) {
    pullAvx2(lanes);
    return;
  }
#else
  (void)level;
#endif
  pullBaseline(lanes);
}

namespace {

bool inEquilibrium(const Context& c, const net::Anchor& a) {
  return c.model.objects[a.object].deforms && !c.body(a.object).hasInertia() &&
         still(c.state.objects[a.object], c.scratch.objects[a.object], a.knots[0]);
}

/// m/N: how the place of an anchor answers to a force at it, where its knots are in equilibrium; else zero.
Eigen::Matrix3d answerOf(Context& c, const net::Anchor& a) {
  using Eigen::Matrix3d;
  if (!inEquilibrium(c, a)) return Matrix3d::Zero();
  const Body& body = c.body(a.object);
  const ObjectScratch& o = c.scratch.objects[a.object];
  const Corners corners = cornersOf(c.state, a, 0.0);
  const Face face = faceOf(corners, a);
  std::array<std::array<Vector3d, 4>, 3> forces;  // on the knots, of each unit force
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    auto& on = forces[static_cast<std::size_t>(axis)];
    on.fill(Vector3d::Zero());
    share(a, face, Vector3d::Unit(axis), on);
  }
  Matrix3d sum = Matrix3d::Zero();
  if (!o.answered) {  // by the softest answer of the whole object
    double squares = 0.0;
    for (const auto& on : forces)
      for (const Vector3d& force : on) squares += force.squaredNorm();
    return squares * body.softest(c, a.object) * Matrix3d::Identity();
  }
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t k = 0; k < 4; ++k) {
      if (corners.inverse_mass[i] == 0.0 || corners.inverse_mass[k] == 0.0) continue;
      const Matrix3d answer = body.answer(c, a.object, a.knots[i], a.knots[k]);
      for (std::size_t p = 0; p < 3; ++p)
        for (std::size_t q = 0; q < 3; ++q)
          sum(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(q)) +=
              forces[p][i].dot(answer * forces[q][k]);
    }
  }
  return 0.5 * (sum + sum.transpose());
}

/// A bound of the greatest eigenvalue of a symmetric matrix.
double sizeOf(const Eigen::Matrix3d& m) {
  return m.cwiseAbs().rowwise().sum().maxCoeff();
}

}  // namespace

void softenConnections(Context& c) {
  if (std::all_of(c.model.bodies.begin(), c.model.bodies.end(),
                  [&](std::size_t object) { return c.body(object).hasInertia(); }))
    return;
  for (ObjectScratch& o : c.scratch.objects) o.answers = o.greatest_answer = 0.0, o.answering = 0;
  const auto eachEnd = [&](auto work) {
    for (std::size_t n = 0; n < c.state.connections.size(); ++n) {
      const ConnectionState& s = c.state.connections[n];
      ConnectionForce& f = c.scratch.connection_force[n];
      for (std::size_t end = 0; s.alive && end < 2; ++end)
        work(f, end == 0 ? s.end0 : s.end1, f.softness[end]);
    }
  };
  eachEnd([&](ConnectionForce& f, const net::Anchor& a, Eigen::Matrix3d& softness) {
    if (&softness == &f.softness[0]) f.soft = false;
    softness = answerOf(c, a);
    const double root = std::sqrt(sizeOf(softness));
    if (root == 0.0) return;
    f.soft = true;
    ObjectScratch& o = c.scratch.objects[a.object];
    o.answers += root, ++o.answering;
    o.greatest_answer = std::max(o.greatest_answer, root);
  });
  // The answers of all ends to all forces are a positive matrix. It is no greater than that of each end's own
  // answer alone, over a share of it, if the shares sum to one. Where many hold an object its softest answer
  // is the better bound.
  eachEnd([&](ConnectionForce&, const net::Anchor& a, Eigen::Matrix3d& softness) {
    const double root = std::sqrt(sizeOf(softness));
    const ObjectScratch& o = c.scratch.objects[a.object];
    if (root == 0.0 || o.answering < 2) return;
    const double whole =
        std::max(o.greatest_answer * o.greatest_answer, c.body(a.object).softest(c, a.object));
    if (o.greatest_answer * o.answers > whole)
      softness = whole * Eigen::Matrix3d::Identity();
    else
      softness *= o.answers / root;
  });
}

namespace {

/// N: the spring of a connection with an end in equilibrium, which follows at once, without inertia. The
/// force goes over to its new value as the end and what else holds its object will answer. Where others do,
/// that is a bound, and the force late. What an end with inertia moves by then acts at once, not late: a
/// spring that lags drives what hangs on it.
/// @param off m: its stretch @param next m: by how much the ends with inertia stretch it in this exchange
Vector3d springOf(const Context& c, std::size_t n, const Vector3d& off, const Vector3d& next) {
  using Eigen::Matrix3d;
  const ConnectionState& s = c.state.connections[n];
  const ConnectionForce& f = c.scratch.connection_force[n];
  const double k = c.model.connections[n].stiffness;
  Matrix3d late = Matrix3d::Zero();
  for (std::size_t end = 0; end < 2; ++end)
    if (c.scratch.objects[(end == 0 ? s.end0 : s.end1).object].answering > 1) late += k * f.softness[end];
  const Matrix3d slower = Matrix3d::Identity() + k * (f.softness[0] + f.softness[1]);
  return s.force + slower.inverse() * (k * off - s.force + late * (k * next));
}

}  // namespace

bool FourConnections::takes(std::size_t n) const {
  const ConnectionState& s = c_.state.connections[n];
  const auto &knot = s.end0.knots, &face = s.end1.knots;
  const auto& w = s.end0.weights;
  return knot[0] == knot[1] && w[0] == 1.0 && w[1] == 0.0 && w[2] == 0.0 && w[3] == 0.0 &&
         s.end1.weights[3] == 0.0 && face[0] != face[1] && face[1] != face[2] && face[0] != face[2] &&
         !c_.scratch.connection_force[n].soft;
}

void FourConnections::add(std::size_t n, double h) {
  const ConnectionState& s = c_.state.connections[n];
  const ConnectionConstants& k = c_.model.connections[n];
  const std::size_t l = count_;
  number_[l] = n, interval_[l] = h;
  const auto read = [l](const ObjectState& o, std::uint32_t knot, auto& x, auto& v, auto& w) {
    const std::size_t stride = o.block.motionFloats() / 6;
    const float* const at = o.block.motion() + knot;
    for (std::size_t axis = 0; axis < 3; ++axis)
      x[axis][l] = at[axis * stride], v[axis][l] = at[(3 + axis) * stride];
    w[l] = row(o, Block::kInverseMass)[knot];
  };
  read(c_.state.objects[s.end0.object], s.end0.knots[0], lanes_.x0, lanes_.v0, lanes_.w0);
  for (std::size_t i = 0; i < 3; ++i) {
    read(c_.state.objects[s.end1.object], s.end1.knots[i], lanes_.x1[i], lanes_.v1[i], lanes_.w1[i]);
    lanes_.weight[i][l] = s.end1.weights[i];
  }
  lanes_.ahead0[l] = untilMean(c_, s.end0.object, h), lanes_.ahead1[l] = untilMean(c_, s.end1.object, h);
  lanes_.height[l] = s.end1.height, lanes_.strand[l] = k.strand, lanes_.built[l] = k.inverse_mass;
  lanes_.stiffness[l] = k.stiffness, lanes_.damping[l] = k.damping;
  if (++count_ == kernel::ConnectionLanes::kCount) pull();
}

void FourConnections::pull() {
  kernel::pull(lanes_, c_.level);
  const auto of = [](const auto& from, std::size_t l) {
    return Vector3d(from[0][l], from[1][l], from[2][l]);
  };
  for (std::size_t l = 0; l < count_; ++l) {
    const std::size_t n = number_[l];
    const ConnectionConstants& k = c_.model.connections[n];
    ConnectionForce& f = c_.scratch.connection_force[n];
    f.spring = of(lanes_.spring, l), f.damping = of(lanes_.damper, l);
    f.damper = c_.state.connections[n].end1;
    for (std::size_t i = 0; i < 3; ++i) f.damper.weights[i] = lanes_.damper_weight[i][l];
    f.damper.height = lanes_.damper_height[l];
    f.torn = k.break_force > 0.0 && lanes_.force2[l] > k.break_force * k.break_force
                 ? std::sqrt(lanes_.force2[l])
                 : 0.0;
    f.dissipated = c_.account ? f.damping.dot(of(lanes_.rate, l)) * interval_[l] : 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      f.knots[0][0][axis] = lanes_.on0[axis][l];
      for (std::size_t i = 0; i < 3; ++i) f.knots[1][i][axis] = lanes_.on1[i][axis][l];
    }
  }
  count_ = 0;
}

void pullTogether(Context& c, std::size_t n, double h, bool renew) {
  const ConnectionConstants& k = c.model.connections[n];
  ConnectionState& s = c.state.connections[n];
  ConnectionForce& f = c.scratch.connection_force[n];
  // All at the mean place of the sub-steps in which they act (docs/decisions/0015-…): no torque is left.
  const double ahead0 = untilMean(c, s.end0.object, h), ahead1 = untilMean(c, s.end1.object, h);
  const Corners corners1 = cornersOf(c.state, s.end1, ahead1);
  const Face face = faceOf(corners1, s.end1);
  f.torn = f.dissipated = 0.0;
  if (renew) {
    const Corners corners0 = cornersOf(c.state, s.end0, ahead0);
    const Vector3d place0 = placeOf(corners0, s.end0, faceOf(corners0, s.end0));
    const Vector3d way = placeOf(corners1, s.end1, face) - place0, off = stretchOf(way, k.strand);
    // The damper sits at end 0 and its other end is carried by the face there: a stretched connection that
    // only turns is not damped, and no torque is left.
    f.damper = s.end1;
    carry(f.damper, face, place0);
    const Vector3d rate = velocityOf(corners1, f.damper, face) - velocityOf(corners0, s.end0, Face{});
    const double built = k.inverse_mass, own = inverseMass(corners0, s.end0);
    const std::array<double, 3> edges = edgesOf(face);
    const double soft1 = std::min(1.0, kLighter * built / (own + inverseMass(corners1, s.end1, face, edges))),
                 soft2 =
                     std::min(1.0, kLighter * built / (own + inverseMass(corners1, f.damper, face, edges)));
    f.spring = (soft1 * k.stiffness) * off;
    f.damping = (soft2 * k.damping) * rate;
    if (f.soft) {
      Vector3d moves = Vector3d::Zero();
      if (!inEquilibrium(c, s.end0)) moves -= velocityOf(corners0, s.end0, Face{});
      if (!inEquilibrium(c, s.end1)) moves += velocityOf(corners1, s.end1, face);
      const Vector3d next = stretchOf(way + h * moves, k.strand);
      f.spring = s.force = springOf(c, n, off, next - off);
      f.damping.setZero();
    }
    const double force2 = (f.spring + f.damping).squaredNorm();
    if (k.break_force > 0.0 && force2 > k.break_force * k.break_force) {
      f.torn = std::sqrt(force2);
      return;
    }
    if (c.account) f.dissipated = f.damping.dot(rate) * h;
  }
  const auto keep = [](std::array<float, 3>& to, const Vector3d& force) {
    for (std::size_t e = 0; e < 3; ++e) to[e] = static_cast<float>(force[static_cast<Eigen::Index>(e)]);
  };
  for (std::size_t i = 0; i < 4; ++i) keep(f.knots[0][i], s.end0.weights[i] * (f.spring + f.damping));
  std::array<Vector3d, 4> knots;
  knots.fill(Vector3d::Zero());
  share(s.end1, face, -f.spring, knots);
  share(f.damper, face, -f.damping, knots);
  for (std::size_t i = 0; i < 4; ++i) keep(f.knots[1][i], knots[i]);
}

}  // namespace vest::scene
