#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include <Eigen/Eigenvalues>

#include "contacts.h"
#include "elements.h"
#include "quaternions.h"

namespace vest::suture {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

[[noreturn]] void refuse(const std::string& rod, const std::string& field, double value,
                         const std::string& allowed) {
  char number[32];
  std::snprintf(number, sizeof number, "%g", value);
  throw std::invalid_argument("object '" + rod + "': " + field + ": " + number + "; " + allowed);
}

void checkSection(const RodDescription& rod) {
  const Section& s = rod.section;
  const std::pair<const char*, double> positive[] = {
      {"radius", s.radius},   {"linear_density", s.linear_density},
      {"stretch", s.stretch}, {"shear", s.shear},
      {"bend", s.bend},       {"twist", s.twist}};
  for (const auto& [name, value] : positive)
    if (!(value >= 1e-30) || !(value <= 1e30)) refuse(rod.name, name, value, "must be from 1e-30 to 1e30");
  const std::pair<const char*, double> least_zero[] = {{"friction", s.friction},
                                                       {"damping", s.damping},
                                                       {"drag", s.drag},
                                                       {"strain damping", s.strain_damping},
                                                       {"yield moment", s.yield_moment},
                                                       {"friction pressure", s.friction_pressure}};
  for (const auto& [name, value] : least_zero)
    if (!(value >= 0.0) || !(value <= 1e30)) refuse(rod.name, name, value, "must be from 0 to 1e30");
  if (!(s.friction_fall >= 0.0) || !(s.friction_fall <= s.friction))
    refuse(rod.name, "friction fall", s.friction_fall, "must be from 0 to the friction");
  if (s.friction_fall > 0.0 && !(s.friction_pressure > 0.0))
    refuse(rod.name, "friction pressure", s.friction_pressure, "must be > 0 where friction falls");
}

void checkNodes(const RodDescription& rod) {
  const std::size_t n = rod.nodes.size();
  if (n < (rod.closed ? 5u : 3u) || n > 20000)
    refuse(rod.name, "nodes", static_cast<double>(n),
           rod.closed ? "must be 5 to 20000" : "must be 3 to 20000");
  for (std::size_t i = 0; i < n; ++i)
    for (const double c : {rod.nodes[i].x(), rod.nodes[i].y(), rod.nodes[i].z()})  // Eigen 3.3 has no begin()
      if (!(std::abs(c) <= 5e5))
        refuse(rod.name, "node " + std::to_string(i), c, "must be within 500000 of 0");
  const std::size_t segments = rod.closed ? n : n - 1;
  double total = 0.0, shortest = 1e300;
  std::size_t at = 0;
  for (std::size_t i = 0; i < segments; ++i) {
    const double l = (rod.nodes[(i + 1) % n] - rod.nodes[i]).norm();
    total += l;
    if (l < shortest) shortest = l, at = i;
  }
  if (!(shortest > 1e-6 * total / static_cast<double>(segments)))
    refuse(rod.name, "length of the segment from node " + std::to_string(at), shortest,
           "must be > 0, and no less than a millionth of the others: two nodes may not be at one place");
  for (std::size_t i = rod.closed ? 0 : 1; i < segments; ++i) {
    const Vector3d t = (rod.nodes[i] - rod.nodes[(i + n - 1) % n]).normalized();
    const Vector3d u = (rod.nodes[(i + 1) % n] - rod.nodes[i]).normalized();
    if (t.dot(u) < -0.86)
      refuse(rod.name, "bend at node " + std::to_string(i) + ", cosine", t.dot(u),
             "must be above -0.86 (150 degrees): more nodes make it rounder");
  }
}

/// Frames without twist along the nodes; of a closed rod, what is missing at the joint that closes it.
std::vector<Quaterniond> framesAlong(const RodDescription& rod, std::size_t segments) {
  std::vector<Quaterniond> q(segments);
  Vector3d t = (rod.nodes[1] - rod.nodes[0]).normalized();
  // From the third axis the shorter way, or by way of the first axis.
  const Vector3d z = t.z() > -0.5 ? Vector3d::UnitZ() : Vector3d::UnitX();
  q[0] = turnOf(z, t);
  if (t.z() <= -0.5) q[0] = q[0] * turnOf(Vector3d::UnitZ(), Vector3d::UnitX());
  for (std::size_t i = 1; i < segments; ++i) {
    const Vector3d u = (rod.nodes[(i + 1) % rod.nodes.size()] - rod.nodes[i]).normalized();
    q[i] = (turnOf(t, u) * q[i - 1]).normalized();
    t = u;
  }
  return q;
}

/// Adds one rod to the model.
class Builder {
 public:
  Builder(const RodDescription& rod, Model& model) : rod_(rod), m_(model) {
    checkSection(rod);
    checkNodes(rod);
    strand_.first = static_cast<Index>(m_.mass.size());
    if (!rod.needle.points.empty()) needle();
    strand_.nodes = static_cast<Index>(rod.nodes.size()) + lead_;
    strand_.segments = strand_.nodes - (rod.closed ? 0 : 1);
    strand_.closed = rod.closed;
    strand_.section = rod.section;
    shape();
    holds();
    joints();
    turns();
    m_.strands.push_back(strand_);
  }

 private:
  /// Its mass at its centre, evenly along its points, in the frame of its principal axes.
  void needle() {
    const Needle& n = rod_.needle;
    NeedleModel model;
    model.node = strand_.first;
    model.radius = n.radius, model.swage = n.swage;
    Vector3d centre = Vector3d::Zero();
    for (std::size_t i = 0; i + 1 < n.points.size(); ++i) {
      const double l = (n.points[i + 1] - n.points[i]).norm();
      model.length += l;
      centre += 0.5 * l * (n.points[i] + n.points[i + 1]);
    }
    if (rod_.closed || n.points.size() < 3 || !(model.length > 1e-6))
      refuse(rod_.name, "needle: length", model.length, "must be > 0, on an open thread");
    if (!(n.radius > 0.0) || !(n.density > 0.0) || !(n.swage > 0.0))
      refuse(rod_.name, "needle: radius, density and swage, least", std::min({n.radius, n.density, n.swage}),
             "must be > 0");
    centre /= model.length;
    model.spacing = model.length / static_cast<double>(n.points.size() - 1);
    const double mass = 3.14159265358979323846 * n.radius * n.radius * model.length * n.density;
    Eigen::Matrix3d second = Eigen::Matrix3d::Identity() * (0.25 * n.radius * n.radius * mass);
    for (std::size_t i = 0; i + 1 < n.points.size(); ++i) {  // Simpson's rule is exact
      const Vector3d a = n.points[i] - centre, b = n.points[i + 1] - centre, c = 0.5 * (a + b);
      const double m = mass * (b - a).norm() / model.length;
      for (const auto& [x, w] : {std::pair{a, 1.0 / 6}, {c, 4.0 / 6}, {b, 1.0 / 6}})
        second += w * m * (x.squaredNorm() * Eigen::Matrix3d::Identity() - x * x.transpose());
    }
    Eigen::Matrix3d axes = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(second).eigenvectors();
    if (axes.determinant() < 0.0) axes.col(0) *= -1.0;
    const Quaterniond frame = Quaterniond(axes).normalized();
    for (const Vector3d& x : n.points) model.points.push_back(frame.conjugate() * (x - centre));
    const Vector3d& end = model.points.back();
    const double first = (rod_.nodes[1] - rod_.nodes[0]).norm();
    model.hold = rod_.section.stretch / first;
    strand_.needle = static_cast<Index>(m_.needles.size());
    m_.needles.push_back(model);
    lead_ = 1;
    length_.push_back(end.norm());
    m_.mass.push_back(mass);
    m_.drag.push_back(rod_.section.drag * model.length);
    m_.length.push_back(length_.back());
    m_.rest.push_back(end / length_.back());
    m_.stiffness.push_back(Vector3d::Constant(model.hold * length_.back()));
    m_.inertia.push_back(
        (frame.conjugate().toRotationMatrix() * second * frame.toRotationMatrix()).diagonal());
    m_.force.push_back(mass * m_.gravity);
    m_.held_at.push_back(kNone);
    m_.start.position.push_back(centre);
    m_.start.frame.push_back(frame);
  }

  void shape() {
    const Section& s = rod_.section;
    const std::size_t n = rod_.nodes.size(), segments = n - (rod_.closed ? 0 : 1);
    std::vector<double> length;
    for (std::size_t i = 0; i < segments; ++i)
      length.push_back((rod_.nodes[(i + 1) % n] - rod_.nodes[i]).norm());
    length_.insert(length_.end(), length.begin(), length.end());
    for (std::size_t i = 0; i < n; ++i) {
      const double own = i < length.size() ? length[i] : 0.0;
      const double last = i > 0 ? length[i - 1] : rod_.closed ? length.back() : 0.0;
      const double l = 0.5 * (own + last);
      m_.mass.push_back(s.linear_density * l);
      m_.drag.push_back(s.drag * l);
      m_.length.push_back(own);
      m_.rest.push_back(Vector3d::UnitZ());
      m_.stiffness.push_back({s.shear, s.shear, s.stretch});
      // ρI per length is ρA·r²/4 across and twice that along a round section.
      const double across = 0.25 * s.linear_density * s.radius * s.radius * own;
      m_.inertia.push_back({across, across, 2.0 * across});
      m_.force.push_back(m_.mass.back() * m_.gravity);
      m_.held_at.push_back(kNone);
      m_.start.position.push_back(rod_.nodes[i]);
    }
    for (const NodeLoad& load : rod_.loads) {
      if (load.node >= n) refuse(rod_.name, "loads: node", load.node, "must be a node of the rod");
      if (!(load.force.norm() <= 1e30))
        refuse(rod_.name, "loads: force", load.force.norm(), "must be at most 1e30");
      m_.force[strand_.first + lead_ + load.node] += load.force;
    }
    auto q = framesAlong(rod_, segments);
    q.resize(n, Quaterniond::Identity());
    m_.start.frame.insert(m_.start.frame.end(), q.begin(), q.end());
  }

  void holds() {
    for (const HeldNode& h : rod_.held) {
      if (h.node >= rod_.nodes.size()) refuse(rod_.name, "held: node", h.node, "must be a node of the rod");
      const Index node = strand_.first + lead_ + h.node;
      if (m_.held_at[node] != kNone) refuse(rod_.name, "held: node", h.node, "must be there once");
      HeldModel held;
      held.node = node;
      held.hold = h.hold;
      held.drive = h.drive;
      for (std::size_t i = 1; i < held.drive.size(); ++i)
        if (!(held.drive[i].t > held.drive[i - 1].t))
          refuse(rod_.name, "drive: t of node " + std::to_string(h.node), held.drive[i].t,
                 "must rise from row to row");
      if (held.drive.empty() || held.drive.front().t > 0.0)
        held.drive.insert(held.drive.begin(), {0.0, rod_.nodes[h.node], 0.0});
      m_.held_at[node] = static_cast<Index>(m_.held.size());
      m_.held.push_back(held);
    }
  }

  Index heldFrame(Index node) const {
    const Index h = m_.held_at[node];
    return h != kNone && m_.held[h].hold == Hold::Frame ? h : kNone;
  }

  void joints() {
    strand_.joints_begin = static_cast<Index>(m_.joints.size());
    for (Index k = 0; k < strand_.nodes; ++k) {
      const Index node = strand_.first + k;
      const bool first = k == 0 && !rod_.closed, last = k + 1 == strand_.nodes && !rod_.closed;
      const Index before = first ? kNone : (k > 0 ? node - 1 : strand_.first + strand_.nodes - 1);
      const Index after = last ? kNone : node;
      const Index held = heldFrame(node);
      if (held == kNone) {
        if (k == 1 && lead_ == 1)  // as clamped: through half an element
          add({before, after, kNone, 0.5 * l(after)},
              m_.start.frame[before].conjugate() * m_.start.frame[after]);
        else if (!first && !last)
          add({before, after, kNone, 0.5 * (l(before) + l(after))}, closing(k, before, after));
        continue;
      }
      holdFrame(held, before, after, k);
    }
    strand_.joints_end = static_cast<Index>(m_.joints.size());
  }

  /// A held frame stands between its segments, or half an angle of the next joint beyond the end.
  void holdFrame(Index held, Index before, Index after, Index k) {
    const auto& q = m_.start.frame;
    Quaterniond& frame = m_.held[held].frame;
    if (before != kNone && after != kNone) {
      const Quaterniond offset = closing(k, before, after);
      frame = ((q[before] * offset) * half((q[before] * offset).conjugate() * q[after])).normalized();
      add({before, kNone, held, 0.5 * l(before)}, offset);
      add({kNone, after, held, 0.5 * l(after)}, Quaterniond::Identity());
    } else if (after != kNone) {
      frame = (q[after] * half(q[after].conjugate() * q[after + 1]).conjugate()).normalized();
      add({kNone, after, held, 0.5 * l(after)}, Quaterniond::Identity());
    } else {
      frame = (q[before] * half(q[before - 1].conjugate() * q[before])).normalized();
      add({before, kNone, held, 0.5 * l(before)}, Quaterniond::Identity());
    }
  }

  /// Frames without twist do not meet where a closed rod closes: what is left there is no strain.
  Quaterniond closing(Index k, Index before, Index after) const {
    if (k != 0) return Quaterniond::Identity();
    const auto& q = m_.start.frame;
    const Vector3d t = q[before] * Vector3d::UnitZ(), u = q[after] * Vector3d::UnitZ();
    const Quaterniond there = turnOf(t, u) * q[before];
    Quaterniond z = there.conjugate() * q[after];
    z = Quaterniond(z.w(), 0.0, 0.0, z.z());
    return z.norm() > 1e-9 ? z.normalized() : Quaterniond(0, 0, 0, 1);
  }

  void add(const Joint& joint, const Quaterniond& offset) {
    m_.joints.push_back(joint);
    m_.start.offset.push_back(offset);
    m_.start.natural_curvature.push_back(Vector3d::Zero());
  }

  /// Natural curvature of the shape without twist, then the twist.
  void turns() {
    std::vector<Quaterniond> held_frame;
    for (const HeldModel& h : m_.held) held_frame.push_back(h.frame);
    if (rod_.natural_shape)
      for (Index k = strand_.joints_begin; k < strand_.joints_end; ++k)
        m_.start.natural_curvature[k] = bendOf(m_, m_.start, held_frame, k) / m_.joints[k].length;
    if (rod_.turn == 0.0) return;
    double total = 0.0, at = 0.0;
    for (const double length : length_) total += length;
    const double rate = rod_.turn / total;
    if (!(std::abs(rod_.turn) <= 1e5)) refuse(rod_.name, "turn", rod_.turn, "must be from -1e5 to 1e5");
    for (Index k = 0; k < strand_.nodes; ++k) {
      const Index node = strand_.first + k, h = heldFrame(node);
      if (h != kNone) m_.held[h].frame = (m_.held[h].frame * about(rate * at)).normalized();
      if (k >= strand_.segments) continue;
      m_.start.frame[node] = (m_.start.frame[node] * about(rate * (at + 0.5 * length_[k]))).normalized();
      at += length_[k];
    }
    for (Index k = strand_.joints_begin; k < strand_.joints_end; ++k) {
      const double angle = rate * m_.joints[k].length;
      m_.start.offset[k] = (m_.start.offset[k] * about(angle)).normalized();
      Vector3d& natural = m_.start.natural_curvature[k];
      natural = about(-0.5 * angle) * natural;
      natural.z() -= rate;
    }
    // Round once, the frames come back turned by as much.
    if (rod_.closed)
      m_.start.offset[strand_.joints_begin] =
          (m_.start.offset[strand_.joints_begin] * about(-rod_.turn)).normalized();
  }

  double l(Index segment) const { return m_.length[segment]; }

  const RodDescription& rod_;
  Model& m_;
  Strand strand_;
  std::vector<double> length_;
  Index lead_ = 0;  ///< 1: a needle goes before the nodes
};

}  // namespace

Section solidSection(double radius, double density, double youngs_modulus, double poisson_ratio) {
  constexpr double kPi = 3.14159265358979323846;
  const double area = kPi * radius * radius, shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio));
  Section s;
  s.radius = radius;
  s.linear_density = density * area;
  s.stretch = youngs_modulus * area;
  s.shear = shear * area;
  s.bend = 0.25 * youngs_modulus * area * radius * radius;
  s.twist = 0.5 * shear * area * radius * radius;
  return s;
}

Model::Model(const Description& description) : gravity(description.gravity) {
  for (const RodDescription& rod : description.rods) Builder(rod, *this);
  for (Cylinder cylinder : description.cylinders) {
    if (!(cylinder.radius > 0.0) || !(cylinder.radius <= 5e5))
      refuse(cylinder.name, "radius", cylinder.radius, "must be > 0, at most 500000");
    if (!(cylinder.axis.norm() > 0.0) || !(cylinder.axis.norm() < 1e30))
      refuse(cylinder.name, "axis, length", cylinder.axis.norm(), "must be > 0");
    if (!(cylinder.friction >= 0.0) || !(cylinder.friction <= 1e3))
      refuse(cylinder.name, "friction", cylinder.friction, "must be from 0 to 1000");
    cylinder.axis.normalize();
    cylinders.push_back(cylinder);
  }
  start.velocity.resize(mass.size(), Vector3d::Zero());
  start.spin.resize(mass.size(), Vector3d::Zero());
  start.severed.resize(mass.size(), 0);
  start.contacts.resize(contactRoom(*this));
}

Scratch::Scratch(const Model& model)
    : reactions(model.held.size()),
      gradient(model.mass.size()),
      change(model.mass.size()),
      strain_then(model.mass.size(), Vector3d::Zero()),
      curvature_then(model.joints.size(), Vector3d::Zero()),
      target(model.held.size()),
      held_frame(model.held.size()),
      contact_force(model.mass.size(), Vector3d::Zero()),
      before(model.start),
      trial(model.start),
      backup(model.start),
      contacts(std::make_unique<ContactScratch>(model)) {
  supports.reserve(8 * model.mass.size() + 256 + 200 * model.needles.size());
  contacts->bearing.reserve(supports.capacity());
  turns.reserve(16);
  for (const Strand& strand : model.strands) chain.emplace_back(strand.nodes, strand.closed);
}

Scratch::~Scratch() = default;

}  // namespace vest::suture
