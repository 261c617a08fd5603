#include <algorithm>
#include <cmath>
#include <optional>

#include "connections.h"
#include "stages.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using net::Block;

/// Loads from outside. Their damping is part of the knots' decay (loads.cpp); finite elements, which have
/// none, get as much of it as a force that is held may take, half of the momentum (tuned). The lift follows
/// the knot to the middle of the batch, as stiff as a quarter of what a held force may be (tuned).
void addLoad(ObjectState& s, double h, bool drags) {
  Block& b = s.block;
  const float* const mass = b.row(Block::kMass);
  const float most = static_cast<float>(0.5 / h);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* const v = b.row(static_cast<Block::KnotRow>(Block::VX + axis));
    float* const f = b.row(static_cast<Block::KnotRow>(Block::HX + axis));
    for (std::size_t i = 0; i < b.knots(); ++i) f[i] += s.load.now[i][axis];
    for (std::size_t i = 0; drags && i < b.knots(); ++i)
      f[i] -= std::min(s.load.now[i][3], most * mass[i]) * v[i];
  }
  const float* const z = b.row(Block::PZ);
  float* const f = b.row(Block::HZ);
  const float hardest = static_cast<float>(0.25 / (h * h));
  for (std::size_t i = 0; i < b.knots(); ++i) {
    const HeldLoad::Of& l = s.load.now[i];
    const float stiffness = std::min(std::fabs(l[HeldLoad::kStiffness]), hardest * mass[i]);
    f[i] += std::copysign(stiffness, l[HeldLoad::kStiffness]) * std::max(0.0f, l[HeldLoad::kLevel] - z[i]);
  }
}

/// Adds parts of a force to the held forces of an object's knots.
void push(WorldState& state, const ContactEnd& end, const Vector3d& f) {
  Block& b = state.objects[end.object].block;
  for (std::size_t i = 0; i < 3; ++i) {
    if (end.weights[i] == 0.0f) continue;
    for (int axis = 0; axis < 3; ++axis)
      b.row(static_cast<Block::KnotRow>(Block::HX + axis))[end.knots[i]] +=
          end.weights[i] * static_cast<float>(f[axis]);
  }
}

/// The knots of a contact as one body: what rests against the other and turns with it does not slide on it.
struct ContactBody {
  std::array<Vector3d, 6> arm;  ///< m, from their middle; zero: no part of the contact
  Eigen::Matrix3d inverse;
  Vector3d turn;  ///< 1/s
  ContactBody(const WorldState& state, const OrganContact& r) {
    std::array<Vector3d, 6> velocity;
    Vector3d middle = Vector3d::Zero();
    int count = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      arm[i].setZero(), velocity[i].setZero();
      if (!uses(r, i)) continue;
      const ContactEnd& end = r.ends[i / 3];
      const ObjectState& s = state.objects[end.object];
      arm[i] = knotPosition(s, end.knots[i % 3]), velocity[i] = knotVelocity(s, end.knots[i % 3]);
      middle += arm[i], ++count;
    }
    middle /= count;
    Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
    Vector3d spin = Vector3d::Zero();
    for (std::size_t i = 0; i < 6; ++i) {
      if (!uses(r, i)) continue;
      arm[i] -= middle;
      inertia += arm[i].squaredNorm() * Eigen::Matrix3d::Identity() - arm[i] * arm[i].transpose();
      spin += arm[i].cross(velocity[i]);
    }
    inertia.diagonal().array() += 1e-6 * inertia.trace() + 1e-24;  // of knots on one line
    inverse = inertia.inverse(), turn = inverse * spin;
  }
  static bool uses(const OrganContact& r, std::size_t i) { return r.ends[i / 3].weights[i % 3] != 0.0f; }
};

/// Force on the first end of an organ contact; the other gets its opposite. With full contact also the couple
/// that keeps angular momentum: slip is what is left without the turn of all its knots, so that the couple
/// feeds nothing.
Vector3d organForce(const Context& c, OrganContact& r, double h, double& heat) {
  Vector3d off, rate;
  apart(c.state, r, off, rate);
  const Vector3d normal = r.normal.cast<double>();
  const double gap = normal.dot(off + (0.5 * h) * rate) - r.reach;
  if (!(gap < 0.0)) {
    r.couple.fill(Vector3d::Zero());
    heat = 0.0;
    return Vector3d::Zero();
  }
  std::optional<ContactBody> body;
  if (r.balanced) body.emplace(c.state, r), rate -= body->turn.cross(off);
  const double opening = normal.dot(rate);
  const Vector3d slide = rate - opening * normal;
  const double speed = std::sqrt(slide.squaredNorm());
  const contact::Pressed<double> law(gap, -opening, speed, r.stiffness, r.damping, r.grip, r.friction);
  heat = (law.drag * speed * speed + std::max(0.0, (law.push + r.stiffness * gap) * -opening)) * h;
  const Vector3d force = law.push * normal - law.drag * slide;
  if (body) {
    const Vector3d spin_up = body->inverse * force.cross(off);
    for (std::size_t i = 0; i < 6; ++i) r.couple[i] = spin_up.cross(body->arm[i]);
  }
  return force;
}

/// Forces of contacts with what has just moved, on the ends that move later.
template <typename Due>
void pushLater(Context& c, int turn, Due due) {
  for (const OrganContact& r : c.scratch.organ_contacts) {
    if (r.implicit_end < 0) continue;
    const ContactEnd &moved = r.ends[static_cast<std::size_t>(r.implicit_end)],
                     &later = r.ends[static_cast<std::size_t>(1 - r.implicit_end)];
    if (later.object == moved.object) continue;  // both answered
    if (c.body(moved.object).turn(c.state.objects[moved.object]) == turn && due(later.object))
      push(c.state, later, r.implicit_end == 1 ? r.force : Vector3d(-r.force));
  }
}

}  // namespace

void Body::accelerate(ObjectState& s, std::uint32_t knot, const Vector3d& gain) const {
  for (int e = 0; e < 3; ++e)
    s.block.row(static_cast<Block::KnotRow>(Block::VX + e))[knot] += static_cast<float>(gain[e]);
}

/// Knots' places are predicted for the middle of the batch: what is held then neither feeds nor damps
/// (docs/decisions/0011-…).
void Body::begin(Context& c, std::size_t object, double h, int /*batch*/) const {
  ObjectState& s = c.state.objects[object];
  Block& b = s.block;
  const std::size_t knots = b.knots();
  const float ahead = static_cast<float>(0.5 * h);
  const float* const mass = b.row(Block::kMass);
  const bool moves = hasInertia(s);
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [axis](Block::KnotRow first) { return static_cast<Block::KnotRow>(first + axis); };
    const float *x = b.row(at(Block::X)), *v = b.row(at(Block::VX));
    float *p = b.row(at(Block::PX)), *f = b.row(at(Block::HX));
    // What is in equilibrium knows what gravity does to it.
    const float g = moves ? static_cast<float>(c.state.gravity[axis]) : 0.0f;
    for (std::size_t i = 0; i < knots; ++i) {
      p[i] = x[i] + ahead * v[i];
      f[i] = mass[i] * g;
    }
    const std::vector<float>& active = c.scratch.objects[object].active;
    if (active.empty()) continue;
    const float* const own = active.data() + static_cast<std::size_t>(axis) * (active.size() / 3);
    for (std::size_t i = 0; i < knots; ++i) f[i] += own[i];
  }
  if (s.load.any) addLoad(s, h, filled() && moves);
}

void solve(Context& c) {
  int batches = c.model.batches, first = Body::kLast;
  for (const ObjectState& s : c.state.objects) batches = std::max(batches, s.batches);
  batches *= c.stretch;
  for (const std::size_t object : c.model.bodies)
    first = std::min(first, c.body(object).turn(c.state.objects[object]));
  for (ObjectScratch& o : c.scratch.objects) {
    o.loads = contact::ObjectLoads{};
    o.heat = 0.0;
    o.faulty = false;
  }
  gatherSlings(c);
  for (int batch = 0; batch < batches; ++batch) {
    // Batches of the step for one of an object's own.
    const auto every = [&](std::size_t object) {
      return batches / (c.state.objects[object].batches * c.stretch);
    };
    const auto due = [&](std::size_t object) {
      return c.model.objects[object].deforms && batch % every(object) == 0;
    };
    eachBody(c, [&](std::size_t object) {
      if (due(object))
        c.body(object).begin(c, object, c.dt / (c.state.objects[object].batches * c.stretch),
                             batch / every(object));
    });
    // Exchange between objects, in fixed order; a force holds until both its objects are renewed together.
    for (std::size_t n = 0; n < c.state.connections.size(); ++n) {
      const ConnectionState& s = c.state.connections[n];
      if (!s.alive) continue;
      const bool due0 = due(s.end0.object), due1 = due(s.end1.object);
      const bool moves0 = c.model.objects[s.end0.object].deforms,
                 moves1 = c.model.objects[s.end1.object].deforms;
      if (!due0 && !due1) continue;
      const int slow = std::min(moves0 ? c.state.objects[s.end0.object].batches : 1 << 20,
                                moves1 ? c.state.objects[s.end1.object].batches : 1 << 20);
      exchange(c, n, c.dt / (slow * c.stretch), (due0 || !moves0) && (due1 || !moves1), due0, due1);
    }
    joinClips(c, batch, batches);
    for (OrganContact& r : c.scratch.organ_contacts) {
      if (r.implicit_end >= 0) continue;
      const std::array<bool, 2> now{due(r.ends[0].object), due(r.ends[1].object)};
      if (now[0] && now[1]) {
        double heat;
        r.force = organForce(c, r, c.dt / r.batches, heat);
        c.state.energy.dissipated += heat;
      }
      for (std::size_t i = 0; r.balanced && i < 6; ++i) {
        const ContactEnd& end = r.ends[i / 3];
        if (now[i / 3] && ContactBody::uses(r, i))
          addHeld(c.state.objects[end.object], end.knots[i % 3], r.couple[i]);
      }
      if (now[0]) push(c.state, r.ends[0], r.force);
      if (now[1]) push(c.state, r.ends[1], -r.force);
    }
    if (c.scratch.threads) {
      const int each = batches / (c.scratch.threads->parts * c.stretch);
      if (batch % each == 0) stepThreads(c, batch / each);
      for (const ThreadPush& p : c.scratch.threads->pushes)
        if (due(p.object)) {
          push(c.state, {p.object, p.knots, p.weights}, p.force);
          push(c.state, {p.object, p.far_knots, p.far_weights}, p.force);
        }
    }
    for (int turn = first; turn <= Body::kLast; ++turn) {
      eachBody(c, [&](std::size_t object) {
        const Body& body = c.body(object);
        if (body.turn(c.state.objects[object]) == turn && due(object))
          body.advance(c, object, batch / every(object));
      });
      if (turn < Body::kLast) pushLater(c, turn, due);
    }
  }
}

bool settleVelocities(Context& c, std::string_view& faulty) {
  constexpr float kAbsurd = 100.0f * 100.0f;  // (m/s)²
  for (const std::size_t object : c.model.bodies) {
    const ObjectState& s = c.state.objects[object];
    const float *vx = row(s, Block::VX), *vy = row(s, Block::VY), *vz = row(s, Block::VZ);
    const float *x = row(s, Block::X), *y = row(s, Block::Y), *z = row(s, Block::Z);
    unsigned bad = c.scratch.objects[object].faulty ? 1u : 0u;
    for (std::size_t i = 0; i < s.block.knots(); ++i) {
      const float v2 = vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i],
                  p2 = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
      bad |= static_cast<unsigned>(!(v2 < kAbsurd)) | static_cast<unsigned>(!(p2 < 1e12f));
    }
    if (bad != 0) {
      faulty = c.model.description.objects[object].name;
      return false;
    }
  }
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    if (!c.state.proxies[t].pose.tip.allFinite() || !c.state.proxies[t].velocity.allFinite()) {
      faulty = "instrument";
      return false;
    }
  }
  return true;
}

}  // namespace vest::scene
