#include "elements.h"

#include <algorithm>
#include <cmath>

#include "contacts.h"
#include "quaternions.h"

namespace vest::suture {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d bendStiffness(const Section& s) {
  return {s.bend, s.bend, s.twist};
}

/// Rotation over the sub-step in the frame at its start, 2·Im: the angle, to third order.
struct Turn {
  Vector3d phi;
  Matrix3d derivative;  // by a further rotation in the frame's own axes
};
Turn turnSince(const Eigen::Quaterniond& then, const Eigen::Quaterniond& now) {
  const Eigen::Quaterniond p = then.conjugate() * now;
  const double sign = p.w() < 0.0 ? -1.0 : 1.0;
  return {2.0 * sign * p.vec(), sign * (p.w() * Matrix3d::Identity() + skew(p.vec()))};
}

struct Inertia {
  double weight;   // (m + h·d)/h²
  Vector3d place;  // that it pulls to
};
Inertia inertiaOf(const Potential& p, Index i, double damping) {
  const double m = p.model.mass[i], d = m * damping + p.model.drag[i];
  return {(m + p.h * d) / (p.h * p.h),
          p.before.position[i] + p.before.velocity[i] * (p.h * m / (m + p.h * d))};
}

}  // namespace

Vector3d strainOf(const Model& model, const State& s, const Strand& strand, Index j) {
  const Vector3d d = s.position[strand.next(j)] - s.position[j];
  return s.frame[j].conjugate() * d / model.length[j] - model.rest[j];
}

Vector3d bendOf(const Model& model, const State& s, const std::vector<Eigen::Quaterniond>& held_frame,
                Index k) {
  const Joint& joint = model.joints[k];
  const Eigen::Quaterniond& qa = joint.a == kNone ? held_frame[joint.held] : s.frame[joint.a];
  const Eigen::Quaterniond& qb = joint.b == kNone ? held_frame[joint.held] : s.frame[joint.b];
  const Eigen::Quaterniond p = (qa * s.offset[k]).conjugate() * qb;
  return 2.0 * p.vec() / p.w();
}

void absorbTwist(const Model& model, const std::vector<Eigen::Quaterniond>& held_frame, Index k, State& s) {
  const double z = 0.5 * bendOf(model, s, held_frame, k).z();  // tangent of half the angle
  if (!(std::abs(z) > 0.005) || !(std::abs(z) < 1.0)) return;
  const double z2 = z * z, root = std::sqrt(1.0 + z2);
  double arc = 0.0;  // atan(z)/z by its series after two halvings, |z| then below 0.2
  double w = z / (1.0 + root);
  w /= 1.0 + std::sqrt(1.0 + w * w);
  for (int n = 21; n >= 1; n -= 2) arc = 1.0 / n - w * w * arc;
  const double half_angle = 4.0 * w * arc;
  Vector3d& natural = s.natural_curvature[k];
  s.offset[k] = (s.offset[k] * Eigen::Quaterniond(1.0, 0.0, 0.0, z)).normalized();
  // What curves by nature stays with the material, halfway between both frames.
  const double c = 1.0 / root, sine = z / root, x = natural.x(), y = natural.y();
  natural = {c * x + sine * y, c * y - sine * x, natural.z() - 2.0 * half_angle / model.joints[k].length};
}

namespace {

bool isSevered(const State& s, const Joint& joint) {
  return (joint.a != kNone && s.severed[joint.a] != 0) || (joint.b != kNone && s.severed[joint.b] != 0);
}

}  // namespace

Vector3d placeOf(const Support& a, const Strand& strand, const State& s) {
  if (a.rigid) return s.position[a.segment] + s.frame[a.segment] * a.arm;
  return (1.0 - a.s) * s.position[a.segment] + a.s * s.position[strand.next(a.segment)];
}

namespace {

/// Where a support is in a state: off its other end, into what it leans on, and across since it stuck.
struct Lean {
  Vector3d off, across;
  double gap;
};
Lean leanOf(const Support& a, const Strand& strand, const State& before, const State& s, double then,
            double now) {
  const Vector3d place = placeOf(a, strand, s), was = placeOf(a, strand, before), way = a.to - a.from;
  Lean lean;
  lean.off = place - (a.from + now * way);
  lean.gap = a.normal.dot(lean.off) - a.reach;
  const Vector3d slip = place - was - (now - then) * way - a.shear / a.stiffness;
  if (a.bond == Bond::Slide) {
    lean.across = a.normal.dot(slip) * a.normal;
    lean.off -= a.normal.dot(lean.off) * a.normal;
  } else {
    lean.across = slip - a.normal.dot(slip) * a.normal;
  }
  return lean;
}

/// N along the normal, where it pushes.
double pushOf(const Support& a, const Lean& lean) {
  const double push = std::max(0.0, -a.stiffness * lean.gap);
  return a.most > 0.0 ? std::min(push, a.most) : push;
}
/// N: what friction bears.
double frictionOf(const Support& a, const Lean& lean) {
  return a.bond == Bond::Slide ? a.grip + a.friction * a.stiffness * lean.off.norm()
                               : a.friction * pushOf(a, lean);
}

/// Rotation of a needle off where it is held, in its frame: 2·Im, the angle to third order.
Vector3d turnOff(const TurnSpring& t, const State& s, double fraction) {
  const Eigen::Quaterniond held(t.from.coeffs() + fraction * (t.to.coeffs() - t.from.coeffs())),
      p = held.normalized().conjugate() * s.frame[t.segment];
  return p.vec() * (p.w() < 0.0 ? -2.0 : 2.0);
}

/// Friction is a spring up to its limit and slides beyond.
double slideValue(const Support& a, const Vector3d& across) {
  const double d = across.norm(), stick = a.limit / a.stiffness;
  return d <= stick ? 0.5 * a.stiffness * d * d : a.limit * (d - 0.5 * stick);
}

}  // namespace

double tensionOf(const Model& model, const State& state, const Strand& strand, Index segment) {
  if (state.severed[segment] != 0) return 0.0;
  const Vector3d strain = strainOf(model, state, strand, segment);
  return segment < strand.threadFirst() ? model.stiffness[segment].z() * strain.norm()
                                        : strand.section.stretch * strain.z();
}

void settleSupports(const Potential& p, const State& s, double share, Scratch& scratch) {
  for (Support& a : scratch.supports) {
    const Lean lean =
        leanOf(a, strandOf(p.model, a.segment), p.before, s, scratch.fraction_then, scratch.fraction);
    if (a.bond != Bond::Push) a.force -= share * a.stiffness * lean.off;
    if (a.bond == Bond::Hold) continue;
    const double most = frictionOf(a, lean), drag = a.stiffness * lean.across.norm();
    a.shear = -a.stiffness * lean.across;
    if (drag > most) a.shear *= most / drag;
    a.force += share * a.shear;
    if (a.bond == Bond::Push) a.force += share * pushOf(a, lean) * a.normal;
  }
  for (TurnSpring& t : scratch.turns)
    t.moment = -t.stiffness * (s.frame[t.segment] * turnOff(t, s, scratch.fraction));
}

double valueOf(const Potential& p, const State& s, const Scratch& scratch) {
  const Model& m = p.model;
  double sum = 0.0;
  for (const Strand& strand : m.strands) {
    const double rate = strand.section.strain_damping / p.h;
    const Vector3d K = bendStiffness(strand.section);
    for (Index k = 0; k < strand.nodes; ++k) {
      const Index i = strand.first + k;
      const Inertia a = inertiaOf(p, i, strand.section.damping);
      sum += 0.5 * a.weight * (s.position[i] - a.place).squaredNorm() -
             (m.force[i] + m.mass[i] * scratch.gravity).dot(s.position[i] - p.before.position[i]);
      if (k >= strand.segments) continue;
      const Vector3d strain = strainOf(m, s, strand, i), &S = m.stiffness[i];
      if (s.severed[i] == 0)
        sum += 0.5 * m.length[i] *
               (S.cwiseProduct(strain).dot(strain) +
                rate * S.cwiseProduct(strain - scratch.strain_then[i]).dot(strain - scratch.strain_then[i]));
      const double weight = (1.0 + p.h * strand.section.damping) / (p.h * p.h);
      const Vector3d past = turnSince(p.before.frame[i], s.frame[i]).phi -
                            p.before.spin[i] * (p.h / (1.0 + p.h * strand.section.damping));
      sum += 0.5 * weight * p.inertia(i).cwiseProduct(past).dot(past);
    }
    for (Index k = strand.joints_begin; k < strand.joints_end; ++k) {
      const Joint& joint = m.joints[k];
      if (isSevered(s, joint)) continue;
      const Vector3d bend = bendOf(m, s, scratch.held_frame, k) / joint.length;
      const Vector3d off = bend - s.natural_curvature[k], change = bend - scratch.curvature_then[k];
      sum += 0.5 * joint.length * (K.cwiseProduct(off).dot(off) + rate * K.cwiseProduct(change).dot(change));
    }
  }
  for (const Support& a : scratch.supports) {
    const Lean lean = leanOf(a, strandOf(m, a.segment), p.before, s, scratch.fraction_then, scratch.fraction);
    if (a.bond != Bond::Push) sum += 0.5 * a.stiffness * lean.off.squaredNorm();
    if (a.bond == Bond::Slide) sum += slideValue(a, lean.across);
    if (a.bond != Bond::Push || !(lean.gap < 0.0)) continue;
    const double push = pushOf(a, lean);  // beyond `most` it grows no more
    sum += push * (-lean.gap - 0.5 * push / a.stiffness) + slideValue(a, lean.across);
  }
  for (const TurnSpring& t : scratch.turns)
    sum += 0.5 * t.stiffness * turnOff(t, s, scratch.fraction).squaredNorm();
  return sum;
}

namespace {

enum class Want { Gradient, Matrix };  ///< alone, or with the Hessian

template <Want kWant>
void addInertia(const Potential& p, const State& s, const Strand& strand, Index k, BlockChain& chain,
                Scratch& scratch) {
  const Index i = strand.first + k;
  const Inertia a = inertiaOf(p, i, strand.section.damping);
  Vector6& g = scratch.gradient[i];
  g.head<3>() += a.weight * (s.position[i] - a.place) - p.model.force[i] - p.model.mass[i] * scratch.gravity;
  if (kWant == Want::Matrix) {
    chain.diagonal[k].topLeftCorner<3, 3>().diagonal().array() += a.weight;
    // An end has no segment.
    if (k >= strand.segments) chain.diagonal[k].bottomRightCorner<3, 3>().setIdentity();
  }
  if (k >= strand.segments) return;
  const double damping = strand.section.damping, weight = (1.0 + p.h * damping) / (p.h * p.h);
  const Turn turn = turnSince(p.before.frame[i], s.frame[i]);
  const Vector3d inertia = weight * p.inertia(i);
  const Vector3d moment = inertia.cwiseProduct(turn.phi - p.before.spin[i] * (p.h / (1.0 + p.h * damping)));
  g.tail<3>() += turn.derivative.transpose() * moment;
  if (kWant == Want::Matrix)
    chain.diagonal[k].bottomRightCorner<3, 3>() +=
        turn.derivative.transpose() * inertia.asDiagonal() * turn.derivative;
}

/// A symmetric matrix a·I + b·uuᵀ.
Matrix3d plusDyad(double a, double b, const Vector3d& u) {
  Matrix3d m = (b * u) * u.transpose();
  m.diagonal().array() += a;
  return m;
}

/// Both stiffnesses across are one, so that S = across·I + (along − across)·e3e3ᵀ.
template <Want kWant>
void addSegment(const Potential& p, const State& s, const Strand& strand, Index k, bool exact,
                BlockChain& chain, Scratch& scratch) {
  const Index i = strand.first + k, j = strand.next(i);
  const double l = p.model.length[i], rate = strand.section.strain_damping / p.h;
  const Matrix3d R = s.frame[i].toRotationMatrix();
  const Vector3d d = s.position[j] - s.position[i], b = R.transpose() * d;
  const Vector3d strain = b / l - p.model.rest[i], &S = p.model.stiffness[i];
  const Vector3d n = S.cwiseProduct(strain + rate * (strain - scratch.strain_then[i]));
  const Vector3d force = R * n;
  scratch.gradient[i].head<3>() -= force;
  scratch.gradient[j].head<3>() += force;
  scratch.gradient[i].tail<3>() += n.cross(b);
  if (kWant == Want::Gradient) return;

  const double across = S.x() * ((1.0 + rate) / l), more = (S.z() - S.x()) * ((1.0 + rate) / l);
  const Vector3d t = R.col(2), lever(b.y(), -b.x(), 0.0);  // b × e3
  Matrix3d dd = plusDyad(across, more, t);
  // Rows of Rᵀ[v] are cross products of R's columns and v.
  Vector3d v = -across * d;
  if (exact) v += force;
  Matrix3d td = (-more * lever) * t.transpose();
  for (int r = 0; r < 3; ++r) td.row(r) += R.col(r).cross(v).transpose();
  Matrix3d tt = plusDyad(across * b.squaredNorm(), -across, b) + plusDyad(0.0, more, lever);
  if (exact) {
    tt += 0.5 * (n * b.transpose() + b * n.transpose());
    tt.diagonal().array() -= n.dot(b);
  } else if (n.z() > 0.0 && i >= strand.threadFirst()) {
    dd += plusDyad(n.z() / l, -n.z() / l, t);
  }
  // Places i and j, rotation i.
  const Index kj = j - strand.first;
  chain.diagonal[k].topLeftCorner<3, 3>() += dd;
  chain.diagonal[kj].topLeftCorner<3, 3>() += dd;
  chain.diagonal[k].bottomLeftCorner<3, 3>() -= td;
  chain.diagonal[k].topRightCorner<3, 3>() -= td.transpose();
  chain.diagonal[k].bottomRightCorner<3, 3>() += tt;
  chain.lower[k].topLeftCorner<3, 3>() -= dd;
  chain.lower[k].topRightCorner<3, 3>() += td.transpose();
}

/// A = I + [c] + ccᵀ leads from a small rotation to half the change of 2·Im p / Re p, c = Im p / Re p. Both
/// bending stiffnesses are one, and AᵀA = AAᵀ = (1 + c²)(I + ccᵀ), A² = (1 − c²)I + 2[c] + (3 + c²)ccᵀ.
template <Want kWant>
void addJoint(const Potential& p, const State& s, const Strand& strand, Index k, bool exact,
              BlockChain& chain, Scratch& scratch) {
  const Joint& joint = p.model.joints[k];
  const double l = joint.length, rate = strand.section.strain_damping / p.h;
  const Vector3d K = bendStiffness(strand.section);
  const Vector3d u = bendOf(p.model, s, scratch.held_frame, k), c = 0.5 * u, curvature = u / l;
  const Vector3d m =
      K.cwiseProduct(curvature - s.natural_curvature[k] + rate * (curvature - scratch.curvature_then[k]));
  const Vector3d turned = c.cross(m), along = c.dot(m) * c;
  const Vector3d gb = m - turned + along, ha = m + turned + along;  // gradients: b, and minus that of a
  const bool offset = s.offset[k].vec() != Vector3d::Zero();
  if (joint.b != kNone)
    scratch.gradient[joint.b].tail<3>() += gb;
  else
    scratch.reactions[joint.held].moment += scratch.held_frame[joint.held] * gb;
  if (joint.a == kNone)
    scratch.reactions[joint.held].moment -= scratch.held_frame[joint.held] * ha;
  else if (offset)
    scratch.gradient[joint.a].tail<3>() -= s.offset[k] * ha;
  else
    scratch.gradient[joint.a].tail<3>() -= ha;
  if (kWant == Want::Gradient) return;

  const double bend = K.x() * ((1.0 + rate) / l), more = (K.z() - K.x()) * ((1.0 + rate) / l),
               c2 = c.squaredNorm(), mc = m.dot(c);
  // A·e3, and e3ᵀ·A
  const Vector3d column = Vector3d(c.y(), -c.x(), 1.0) + c.z() * c,
                 row = Vector3d(-c.y(), c.x(), 1.0) + c.z() * c;
  const Matrix3d even = plusDyad(bend * (1.0 + c2), bend * (1.0 + c2), c);
  const auto symmetric = [&](const Vector3d& w, const Vector3d& g) {
    Matrix3d out = even + plusDyad(0.0, more, w);
    if (exact) out += 0.5 * (g * c.transpose() + c * g.transpose());
    return out;
  };
  if (joint.b != kNone)
    chain.diagonal[joint.b - strand.first].bottomRightCorner<3, 3>() += symmetric(row, gb);
  const Matrix3d O = offset ? s.offset[k].toRotationMatrix() : Matrix3d(Matrix3d::Identity());
  if (joint.a != kNone) {
    const Matrix3d aa = symmetric(column, ha);
    if (offset)
      chain.diagonal[joint.a - strand.first].bottomRightCorner<3, 3>() += O * aa * O.transpose();
    else
      chain.diagonal[joint.a - strand.first].bottomRightCorner<3, 3>() += aa;
  }
  if (joint.a == kNone || joint.b == kNone) return;
  // −A·D·A and its part of the moment
  double square = -bend * (3.0 + c2), whole = -bend * (1.0 - c2);
  Vector3d about = -2.0 * bend * c;
  Matrix3d ab = (-more * column) * row.transpose();
  if (exact) {
    square -= mc, whole -= mc;
    about += 0.5 * (m - mc * c);
    ab += (0.5 * turned) * -c.transpose() + (0.5 * c) * turned.transpose();
  }
  ab += plusDyad(whole, square, c) + skew(about);
  if (offset)
    chain.lower[joint.a - strand.first].bottomRightCorner<3, 3>() += (O * ab).transpose();
  else
    chain.lower[joint.a - strand.first].bottomRightCorner<3, 3>() += ab.transpose();
}

/// @return whether each support is what it was at the last Hessian: away, sticking, sliding, at its most
template <Want kWant>
bool addSupports(const Potential& p, const State& s, Scratch& scratch) {
  bool same = true;
  std::vector<std::uint8_t>& bearing = scratch.contacts->bearing;
  bearing.resize(scratch.supports.size());
  for (std::size_t n = 0; n < scratch.supports.size(); ++n) {
    Support& a = scratch.supports[n];
    const auto bears = [&](std::uint8_t how) {
      same = same && bearing[n] == how;
      if (kWant == Want::Matrix) bearing[n] = how;
    };
    const Strand& strand = strandOf(p.model, a.segment);
    const Lean lean = leanOf(a, strand, p.before, s, scratch.fraction_then, scratch.fraction);
    Vector3d gradient = a.stiffness * lean.off;
    Matrix3d hessian = a.stiffness * Matrix3d::Identity();
    if (a.bond != Bond::Hold) {
      a.limit = frictionOf(a, lean);
      if (a.bond == Bond::Push && !(lean.gap < 0.0)) {
        bears(0);
        continue;
      }
      const bool most = a.bond == Bond::Push && !(pushOf(a, lean) < a.most || a.most == 0.0);
      const Matrix3d normal = a.normal * a.normal.transpose(), plane = Matrix3d::Identity() - normal;
      if (a.bond == Bond::Slide) {
        hessian = a.stiffness * plane;
      } else {
        const double push = pushOf(a, lean);
        gradient = -push * a.normal;
        hessian = (most ? 0.0 : a.stiffness) * normal;
      }
      const Matrix3d free = a.bond == Bond::Slide ? normal : plane;
      const double d = lean.across.norm();
      const bool sticks = a.stiffness * d <= a.limit;
      bears(static_cast<std::uint8_t>((sticks ? 1 : 2) + (most ? 2 : 0)));
      if (sticks) {
        gradient += a.stiffness * lean.across;
        hessian += a.stiffness * free;
      } else {
        const Vector3d t = lean.across / d;
        gradient += a.limit * t;
        hessian += (a.limit / d) * (free - t * t.transpose());
      }
    }
    const Index k = a.segment - strand.first;
    BlockChain& chain = scratch.chain[static_cast<std::size_t>(&strand - p.model.strands.data())];
    if (a.rigid) {  // a small turn θ in the needle's frame moves the place by −R·[arm]·θ
      const Matrix3d R = s.frame[a.segment].toRotationMatrix(), lever = -R * skew(a.arm);
      scratch.gradient[a.segment].head<3>() += gradient;
      scratch.gradient[a.segment].tail<3>() += lever.transpose() * gradient;
      if (kWant == Want::Gradient) continue;
      const Matrix3d turn = lever.transpose() * hessian;
      chain.diagonal[k].topLeftCorner<3, 3>() += hessian;
      chain.diagonal[k].bottomLeftCorner<3, 3>() += turn;
      chain.diagonal[k].topRightCorner<3, 3>() += turn.transpose();
      chain.diagonal[k].bottomRightCorner<3, 3>() += turn * lever;
      continue;
    }
    const Index kj = strand.next(a.segment) - strand.first;
    scratch.gradient[a.segment].head<3>() += (1.0 - a.s) * gradient;
    scratch.gradient[strand.next(a.segment)].head<3>() += a.s * gradient;
    if (kWant == Want::Gradient) continue;
    chain.diagonal[k].topLeftCorner<3, 3>() += (1.0 - a.s) * (1.0 - a.s) * hessian;
    chain.diagonal[kj].topLeftCorner<3, 3>() += a.s * a.s * hessian;
    chain.lower[k].topLeftCorner<3, 3>() += a.s * (1.0 - a.s) * hessian;
  }
  for (const TurnSpring& t : scratch.turns) {
    const Strand& strand = strandOf(p.model, t.segment);
    const Vector3d off = turnOff(t, s, scratch.fraction);
    Matrix3d A = 0.5 * skew(off);
    A.diagonal().array() += std::sqrt(std::max(0.0, 1.0 - 0.25 * off.squaredNorm()));
    scratch.gradient[t.segment].tail<3>() += t.stiffness * A.transpose() * off;
    if (kWant == Want::Gradient) continue;
    BlockChain& chain = scratch.chain[static_cast<std::size_t>(&strand - p.model.strands.data())];
    chain.diagonal[t.segment - strand.first].bottomRightCorner<3, 3>() += t.stiffness * A.transpose() * A;
  }
  return same;
}

/// Held places: their change is known, so that the equations of their neighbours get it.
void hold(const Model& m, const State& s, const Strand& strand, BlockChain& chain, Scratch& scratch) {
  for (Index h = 0; h < m.held.size(); ++h) {
    const Index i = m.held[h].node;
    if (i < strand.first || i >= strand.first + strand.nodes) continue;
    const Index k = i - strand.first, before = k > 0 ? k - 1 : strand.nodes - 1,
                after = k + 1 < strand.nodes ? k + 1 : 0;
    const Vector3d change = scratch.target[h] - s.position[i];
    scratch.reactions[h].force = scratch.gradient[i].head<3>();
    scratch.gradient[i].tail<3>() += chain.diagonal[k].bottomLeftCorner<3, 3>() * change;
    if (k + 1 < strand.nodes || strand.closed) {
      scratch.gradient[strand.first + after] += chain.lower[k].leftCols<3>() * change;
      chain.lower[k].leftCols<3>().setZero();
    }
    if (k > 0 || strand.closed) {
      scratch.gradient[strand.first + before] += chain.lower[before].topRows<3>().transpose() * change;
      chain.lower[before].topRows<3>().setZero();
    }
    Matrix6& d = chain.diagonal[k];
    d.topRows<3>().setZero();
    d.leftCols<3>().setZero();
    d.topLeftCorner<3, 3>().setIdentity();
  }
  // Last, so that neighbours which are held both are right.
  for (Index h = 0; h < m.held.size(); ++h) {
    const Index i = m.held[h].node;
    if (i >= strand.first && i < strand.first + strand.nodes)
      scratch.gradient[i].head<3>() = s.position[i] - scratch.target[h];
  }
}

/// @return whether the supports are as at the last Hessian
template <Want kWant>
bool addAll(const Potential& p, const State& s, bool exact, Scratch& scratch) {
  for (auto& g : scratch.gradient) g.setZero();
  for (auto& r : scratch.reactions) r.moment.setZero();
  for (Index n = 0; n < p.model.strands.size(); ++n) {
    const Strand& strand = p.model.strands[n];
    BlockChain& chain = scratch.chain[n];
    if (kWant == Want::Matrix) chain.setZero();
    for (Index k = 0; k < strand.nodes; ++k) addInertia<kWant>(p, s, strand, k, chain, scratch);
    for (Index k = 0; k < strand.segments; ++k)
      if (s.severed[strand.first + k] == 0) addSegment<kWant>(p, s, strand, k, exact, chain, scratch);
    for (Index k = strand.joints_begin; k < strand.joints_end; ++k)
      if (!isSevered(s, p.model.joints[k])) addJoint<kWant>(p, s, strand, k, exact, chain, scratch);
  }
  return addSupports<kWant>(p, s, scratch);
}

}  // namespace

void assemble(const Potential& p, const State& s, bool exact, Scratch& scratch) {
  addAll<Want::Matrix>(p, s, exact, scratch);
  if (exact) addCurvature(p.model, s, scratch);
  for (Index n = 0; n < p.model.strands.size(); ++n)
    hold(p.model, s, p.model.strands[n], scratch.chain[n], scratch);
}

bool assembleGradient(const Potential& p, const State& s, Scratch& scratch) {
  const bool same = addAll<Want::Gradient>(p, s, true, scratch);
  for (Index h = 0; h < p.model.held.size(); ++h) {
    auto place = scratch.gradient[p.model.held[h].node].head<3>();
    scratch.reactions[h].force = place;
    place.setZero();
  }
  return same;
}

}  // namespace vest::suture
