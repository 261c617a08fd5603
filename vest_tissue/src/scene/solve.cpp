#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "connections.h"
#include "stages.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;

/// Sub-steps for which the geometry of contacts holds (tuned; docs/decisions/0016-…): what needs twice as
/// many in a step vibrates faster than the step can follow.
constexpr int kContactSteps = 5;
using net::Block;

net::ElementArrays elementArrays(Block& b) {
  return {b.row(Block::PX), b.row(Block::PY), b.row(Block::PZ), b.row(Block::VX), b.row(Block::VY),
          b.row(Block::VZ), b.row(Block::HX), b.row(Block::HY), b.row(Block::HZ)};
}

/// sum |g_i|²/m_i over the knots, in a fixed order that vectorises.
double compliance(const Block& b, const float* g, std::size_t stride) {
  const float* const w = b.row(Block::kInverseMass);
  const std::size_t knots = b.knots();
  float lanes[8] = {};
  const auto add = [&](std::size_t i, int n) {
    const float gx = g[i], gy = g[stride + i], gz = g[2 * stride + i];
    lanes[n] += (gx * gx + gy * gy + gz * gz) * w[i];
  };
  std::size_t i = 0;
  for (; i + 8 <= knots; i += 8)
    for (int n = 0; n < 8; ++n) add(i + n, n);
  for (; i < knots; ++i) add(i, 0);
  double sum = 0.0;
  for (const float lane : lanes) sum += lane;
  return sum;
}

/// Pressure of the enclosed volume. Its gradient is taken as often as its stiffness needs
/// (ObjectConstants::volume_batches), at the positions predicted for the middle of the `interval` (s) in
/// which it serves: taken at its start it would lag, and the part of the stiffness that comes from the
/// pressure would feed energy (docs/decisions/0013-…). Between, the volume follows the gradient. Where cuts
/// have torn the surface so wide that the pressure is stiffer than an exchange bears, it is softer by as
/// much.
void addPressure(Context& c, std::size_t object, const net::Volume& v, bool renew, double h, int every) {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  Block& b = s.block;
  if (v.bulk_modulus == 0.0f || v.triangles.empty()) return;
  const std::size_t stride = b.knotCapacity() + 1, knots = b.knots();
  const double interval = h * every;
  if (renew) {
    const float ahead = static_cast<float>(0.5 * interval);
    for (int axis = 0; axis < 3; ++axis) {
      const float* const x = b.row(static_cast<Block::KnotRow>(Block::X + axis));
      const float* const u = b.row(static_cast<Block::KnotRow>(Block::VX + axis));
      float* const x0 = o.volume_start.data() + axis * stride;
      for (std::size_t i = 0; i < knots; ++i) x0[i] = x[i] + ahead * u[i];
    }
    net::ElementArrays there = elementArrays(b);
    const float* const x0 = o.volume_start.data();
    there.x = x0, there.y = x0 + stride, there.z = x0 + 2 * stride;
    o.volume = net::volumeGradient(v, there, o.volume_gradient.data(), stride, o.packed);
    constexpr double kMost = solver::kStepMargin * solver::kStepMargin;
    const double rate = v.bulk_modulus / v.rest * compliance(b, o.volume_gradient.data(), stride);
    const double longest = solver::longestStep({rate, 0.0});
    o.volume_share = static_cast<float>(std::min(1.0, kMost * longest * longest / (h * h)));
  }
  double change = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const float *g = o.volume_gradient.data() + axis * stride, *x0 = o.volume_start.data() + axis * stride;
    const float* const p = b.row(static_cast<Block::KnotRow>(Block::PX + axis));
    float lanes[8] = {};  // a fixed order of the sum that vectorises
    std::size_t i = 0;
    for (; i + 8 <= knots; i += 8)
      for (int n = 0; n < 8; ++n) lanes[n] += g[i + n] * (p[i + n] - x0[i + n]);
    for (; i < knots; ++i) lanes[0] += g[i] * (p[i] - x0[i]);
    for (const float lane : lanes) change += lane;
  }
  const float pressure = o.volume_share * net::pressureOf(v, o.volume + change);
  for (int axis = 0; axis < 3; ++axis) {
    const float* const g = o.volume_gradient.data() + axis * stride;
    float* const f = b.row(static_cast<Block::KnotRow>(Block::HX + axis));
    for (std::size_t i = 0; i < knots; ++i) f[i] += pressure * g[i];
  }
}

/// Loads from outside. Their damping is part of the knots' decay (loads.cpp); finite elements, which have
/// none, get as much of it as a force that is held may take, half of the momentum (tuned). The lift follows
/// the knot to the middle of the batch, as stiff as a quarter of what a held force may be (tuned).
void addLoad(ObjectState& s, double h) {
  Block& b = s.block;
  const bool drags = !s.tissue.x.empty() && s.tissue.dynamic;
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

/// Forces that are held over the batch: gravity, loads from outside, and the slower elements where the knots
/// will be in its middle. With that prediction the held force neither feeds nor damps
/// (docs/decisions/0011-…).
void hold(Context& c, std::size_t object, double h, int batch) {
  ObjectState& s = c.state.objects[object];
  Block& b = s.block;
  const std::size_t knots = b.knots();
  const float ahead = static_cast<float>(0.5 * h);
  const float* const mass = b.row(Block::kMass);
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [axis](Block::KnotRow first) { return static_cast<Block::KnotRow>(first + axis); };
    const float *x = b.row(at(Block::X)), *v = b.row(at(Block::VX));
    float *p = b.row(at(Block::PX)), *f = b.row(at(Block::HX));
    // Elastostatic objects know what gravity does to them.
    const bool known = !s.tissue.x.empty() && !s.tissue.dynamic;
    const float g = known ? 0.0f : static_cast<float>(c.state.gravity[axis]);
    for (std::size_t i = 0; i < knots; ++i) {
      p[i] = x[i] + ahead * v[i];
      f[i] = mass[i] * g;
    }
    const std::vector<float>& active = c.scratch.objects[object].active;
    if (active.empty()) continue;
    const float* const own = active.data() + static_cast<std::size_t>(axis) * (active.size() / 3);
    for (std::size_t i = 0; i < knots; ++i) f[i] += own[i];
  }
  if (s.load.any) addLoad(s, h);
  if (c.model.objects[object].implicit) return;  // its elements are part of the step
  net::addElements(s.elements, elementArrays(b), c.level);
  const bool one = s.elements.volumes.size() == 1;
  const ObjectConstants& constants = c.model.objects[object];
  const int every = !one || s.batches > constants.batches ? 1 : s.batches / constants.volume_batches;
  for (const net::Volume& v : s.elements.volumes) {
    auto& gradient = c.scratch.objects[object].volume_gradient;
    if (!one) std::fill(gradient.begin(), gradient.end(), 0.0f);  // a volume sets those of its own knots
    addPressure(c, object, v, batch % every == 0, h, every);
  }
}

/// Adds parts of a force to the held forces of an object's knots.
void pushKnots(WorldState& state, std::size_t object, const std::array<std::uint32_t, 3>& knots,
               const std::array<float, 3>& weights, const Vector3d& f) {
  Block& b = state.objects[object].block;
  for (std::size_t i = 0; i < 3; ++i) {
    if (weights[i] == 0.0f) continue;
    b.row(Block::HX)[knots[i]] += weights[i] * static_cast<float>(f.x());
    b.row(Block::HY)[knots[i]] += weights[i] * static_cast<float>(f.y());
    b.row(Block::HZ)[knots[i]] += weights[i] * static_cast<float>(f.z());
  }
}

/// The knots of a contact as one body: what rests against the other and turns with it does not slide on it.
struct ContactBody {
  std::array<Vector3d, 6> arm;  ///< m, from their middle; zero: no part of the contact
  Eigen::Matrix3d inverse;
  Vector3d turn;  ///< 1/s
  ContactBody(const ObjectState& sa, const ObjectState& sb, const OrganContact& r) {
    std::array<Vector3d, 6> velocity;
    Vector3d middle = Vector3d::Zero();
    int count = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      arm[i].setZero(), velocity[i].setZero();
      if (!uses(r, i)) continue;
      const ObjectState& s = i < 3 ? sa : sb;
      const std::uint32_t knot = i < 3 ? r.knots[i] : r.triangle[i - 3];
      arm[i] = knotPosition(s, knot), velocity[i] = knotVelocity(s, knot);
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
  static bool uses(const OrganContact& r, std::size_t i) {
    return (i < 3 ? r.shares[i] : r.weights[i - 3]) != 0.0f;
  }
};

/// Force on the knot of an organ contact; the triangle gets its opposite. With full contact also the couple
/// that keeps angular momentum: slip is what is left without the turn of all its knots, so that the couple
/// feeds nothing.
Vector3d organForce(const Context& c, OrganContact& r, double h, double& heat) {
  const ObjectState &sa = c.state.objects[r.object], &sb = c.state.objects[r.other];
  Vector3d off = Vector3d::Zero(), rate = off;
  for (int e = 0; e < 3; ++e) {
    off += static_cast<double>(r.shares[e]) * knotPosition(sa, r.knots[e]);
    rate += static_cast<double>(r.shares[e]) * knotVelocity(sa, r.knots[e]);
    off -= static_cast<double>(r.weights[e]) * knotPosition(sb, r.triangle[e]);
    rate -= static_cast<double>(r.weights[e]) * knotVelocity(sb, r.triangle[e]);
  }
  const Vector3d normal(r.normal[0], r.normal[1], r.normal[2]);
  const double gap = normal.dot(off + (0.5 * h) * rate) - r.reach;
  if (!(gap < 0.0)) {
    r.couple.fill(Vector3d::Zero());
    heat = 0.0;
    return Vector3d::Zero();
  }
  std::optional<ContactBody> body;
  if (r.balanced) body.emplace(sa, sb, r), rate -= body->turn.cross(off);
  const double opening = normal.dot(rate);
  const double push = std::max(0.0, -r.stiffness * gap - r.damping * opening);
  const Vector3d slide = rate - opening * normal;
  const double speed = std::sqrt(slide.squaredNorm()), limit = r.friction * push;
  const double coefficient = speed * r.grip > limit ? limit / speed : r.grip;
  heat = (coefficient * speed * speed + std::max(0.0, (push + r.stiffness * gap) * -opening)) * h;
  const Vector3d force = push * normal - coefficient * slide;
  if (body) {
    const Vector3d spin_up = body->inverse * force.cross(off);
    for (std::size_t i = 0; i < 6; ++i) r.couple[i] = spin_up.cross(body->arm[i]);
  }
  return force;
}

/// Heat of the links' dampers and of the knots' damping in a sub-step.
double heatOf(const ObjectState& s, double h) {
  const float *x = row(s, Block::X), *y = row(s, Block::Y), *z = row(s, Block::Z);
  const float *vx = row(s, Block::VX), *vy = row(s, Block::VY), *vz = row(s, Block::VZ);
  double sum = 0.0;
  for (const NetLink& link : s.links) {
    const net::KernelLink& l = link.values;
    if (l.damping == 0.0f) continue;
    const std::uint32_t p = l.knot0, q = l.knot1;
    const double d[3] = {x[q] - x[p], y[q] - y[p], z[q] - z[p]};
    const double u[3] = {vx[q] - vx[p], vy[q] - vy[p], vz[q] - vz[p]};
    const double rate = d[0] * u[0] + d[1] * u[1] + d[2] * u[2];
    sum += l.damping * rate * rate / (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + 1e-20);
  }
  const float *decay = row(s, Block::kDecay), *mass = row(s, Block::kMass);
  for (std::size_t i = 0; i < s.block.knots(); ++i) {
    const double v2 = double(vx[i]) * vx[i] + double(vy[i]) * vy[i] + double(vz[i]) * vz[i];
    sum += static_cast<double>(decay[i]) * mass[i] * v2;
  }
  return sum * h;
}

/// Sum of the forces on fixed knots in the last sub-step: what the attachments take up.
void keepReaction(const ObjectState& s, ObjectScratch& o) {
  const float *fx = row(s, Block::FX), *fy = row(s, Block::FY), *fz = row(s, Block::FZ);
  Vector3d sum = Vector3d::Zero();
  for (std::size_t i = 0; i < s.block.knots(); ++i)
    if (s.fixed[i]) sum -= Vector3d(fx[i], fy[i], fz[i]);
  o.reaction = sum;
}

/// A batch of an object that is stepped implicitly: contacts and held forces as they are at its start.
void advanceImplicit(Context& c, std::size_t object, int batch) {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  const int batches = s.batches * c.stretch;
  const double h = c.dt / batches;
  const float hf = static_cast<float>(h), dt = static_cast<float>(c.dt);
  const float fraction = static_cast<float>(batch) / static_cast<float>(batches);
  for (const auto& [f, held] :
       {std::pair{Block::FX, Block::HX}, std::pair{Block::FY, Block::HY}, std::pair{Block::FZ, Block::HZ}}) {
    std::memcpy(s.block.row(f), s.block.row(held), s.block.knots() * sizeof(float));
  }
  if (!o.contacts.empty()) contact::addToolContacts(s.block, o.contacts, fraction, hf, dt, o.loads);
  if (!o.pulls.empty()) contact::addPulls(s.block, o.pulls, fraction, hf, dt, o.loads);
  if (!o.planes.empty()) contact::addPlaneContacts(s.block, o.planes, hf, o.loads);
  const solver::NetView net = netView(s);
  if (batch == 0) o.implicit->renew(net);  // cuts, or another state: cheap beside the step
  const auto report = o.implicit->step(net, s.block, h, solver::ImplicitNet::Options{});
  holdClips(c, object, h);
  holdSlings(c, object, static_cast<double>(batch + 1) / batches, h);
  if (c.account) o.heat += report.dissipated;
  s.degraded = report.degraded;
  if (batch == batches - 1) keepReaction(s, o);
}

void advance(Context& c, std::size_t object, int batch) {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  if (c.model.objects[object].fem) {
    advanceFem(c, object, batch);
    return;
  }
  const int batches = s.batches * c.stretch, per_batch = std::max(1, s.sub_steps / s.batches);
  const double h = c.dt / (static_cast<double>(batches) * per_batch);
  const float hf = static_cast<float>(h), dt = static_cast<float>(c.dt);
  const net::KnotArrays knots = s.block.knotArrays();
  const net::MotionArrays motion = s.block.motionArrays();
  s.block.prepare(hf);
  for (const auto& [f, held] :
       {std::pair{Block::FX, Block::HX}, std::pair{Block::FY, Block::HY}, std::pair{Block::FZ, Block::HZ}}) {
    std::memcpy(s.block.row(f), s.block.row(held), motion.n * sizeof(float));
  }
  const int all = batches * per_batch, renewal = all / std::max(1, all / kContactSteps);
  net::Upcoming upcoming;
  if (object + 1 < c.state.objects.size()) {
    const ObjectState& next = c.state.objects[object + 1];
    next.block.addMemory(upcoming);
    next.law_links.addMemory(upcoming);
    next.linear_links.addMemory(upcoming);
  }
  for (int i = 0; i < per_batch; ++i) {
    const float fraction =
        static_cast<float>(batch * per_batch + i) / static_cast<float>(batches * per_batch);
    upcoming.ask(i);
    const int before = batch * per_batch + i;
    if (before > 0 && before % renewal == 0 && !o.contacts.empty())
      renewContacts(c, object, static_cast<double>(before) / (batches * per_batch));
    if (s.law_links.linkCount() > 0) net::addLinkForces(s.law_links, knots, c.level);
    if (s.linear_links.linkCount() > 0) net::addLinkForces(s.linear_links, knots, c.level);
    if (!o.contacts.empty()) contact::addToolContacts(s.block, o.contacts, fraction, hf, dt, o.loads);
    if (!o.pulls.empty()) contact::addPulls(s.block, o.pulls, fraction, hf, dt, o.loads);
    if (!o.planes.empty()) contact::addPlaneContacts(s.block, o.planes, hf, o.loads);
    if (batch == batches - 1 && i == per_batch - 1) keepReaction(s, o);
    net::integrateKnots(motion, hf, c.level);
    holdClips(c, object, h);
    const int passed = batch * per_batch + i + 1;
    holdSlings(c, object, static_cast<double>(passed) / (batches * per_batch), h);
    if (c.account) o.heat += heatOf(s, h);
  }
  if (c.account) {
    o.heat += net::elementDissipation(s.elements, elementArrays(s.block)) * c.dt / batches;
  }
}

/// Forces of contacts with the finite elements that have just moved, on the sides that move later.
template <typename Due>
void pushImplicit(Context& c, int turn, Due due) {
  for (const OrganContact& r : c.scratch.organ_contacts) {
    if (r.implicit_side == 0) continue;
    if (turnOf(c, r.implicit_side == 1 ? r.object : r.other) != turn) continue;
    if (r.implicit_side == 2 && due(r.object)) pushKnots(c.state, r.object, r.knots, r.shares, r.force);
    if (r.implicit_side == 1 && due(r.other)) {
      pushKnots(c.state, r.other, r.triangle, r.weights, -r.force);
    }
  }
}

}  // namespace

void solve(Context& c) {
  int batches = c.model.batches;
  for (const ObjectState& s : c.state.objects) batches = std::max(batches, s.batches);
  batches *= c.stretch;
  const std::size_t objects = c.model.objects.size();
  const bool elements = std::any_of(c.model.objects.begin(), c.model.objects.end(),
                                    [](const auto& o) { return o.fem != nullptr; });
  for (ObjectScratch& o : c.scratch.objects) {
    o.loads = contact::ObjectLoads{};
    o.heat = 0.0;
    o.faulty = false;
  }
  gatherSlings(c);
  for (int batch = 0; batch < batches; ++batch) {
    const auto due = [&](std::size_t object) {
      const int every = batches / (c.state.objects[object].batches * c.stretch);
      return c.model.objects[object].net && batch % every == 0;
    };
    auto prepare = [&](std::size_t object) {
      if (!due(object)) return;
      const int own = c.state.objects[object].batches * c.stretch;
      hold(c, object, c.dt / own, batch / (batches / own));
    };
    c.pool.each(objects, prepare);
    // Exchange between objects, in fixed order; a force holds until both its objects are renewed together.
    for (std::size_t n = 0; n < c.state.connections.size(); ++n) {
      const ConnectionState& s = c.state.connections[n];
      if (!s.alive) continue;
      const bool due0 = due(s.end0.object), due1 = due(s.end1.object);
      const bool net0 = c.model.objects[s.end0.object].net, net1 = c.model.objects[s.end1.object].net;
      if (!due0 && !due1) continue;
      const int slow = std::min(net0 ? c.state.objects[s.end0.object].batches : 1 << 20,
                                net1 ? c.state.objects[s.end1.object].batches : 1 << 20);
      exchange(c, n, c.dt / (slow * c.stretch), (due0 || !net0) && (due1 || !net1), due0, due1);
    }
    joinClips(c, batch, batches);
    for (OrganContact& r : c.scratch.organ_contacts) {
      if (r.implicit_side != 0) continue;
      const bool due0 = due(r.object), due1 = due(r.other);
      if (due0 && due1) {
        double heat;
        r.force = organForce(c, r, c.dt / r.batches, heat);
        c.state.energy.dissipated += heat;
      }
      for (std::size_t i = 0; r.balanced && i < 6; ++i) {
        const std::size_t object = i < 3 ? r.object : r.other;
        if ((i < 3 ? due0 : due1) && ContactBody::uses(r, i))
          pushKnots(c.state, object, {i < 3 ? r.knots[i] : r.triangle[i - 3], 0, 0}, {1, 0, 0}, r.couple[i]);
      }
      if (due0) pushKnots(c.state, r.object, r.knots, r.shares, r.force);
      if (due1) {
        pushKnots(c.state, r.other, r.triangle, r.weights, -r.force);
      }
    }
    if (c.scratch.threads) {
      const int every = batches / (c.scratch.threads->parts * c.stretch);
      if (batch % every == 0) stepThreads(c, batch / every);
      for (const ThreadPush& push : c.scratch.threads->pushes)
        if (due(push.object)) {
          pushKnots(c.state, push.object, push.knots, push.weights, push.force);
          pushKnots(c.state, push.object, push.far_knots, push.far_weights, push.force);
        }
    }
    for (int turn = elements ? 0 : 2; turn <= 2; ++turn) {
      auto work = [&](std::size_t object) {
        if (turnOf(c, object) != turn || !due(object)) return;
        const int every = batches / (c.state.objects[object].batches * c.stretch);
        c.model.objects[object].implicit ? advanceImplicit(c, object, batch / every)
                                         : advance(c, object, batch / every);
      };
      c.pool.each(objects, work);
      if (elements && turn < 2) pushImplicit(c, turn, due);
    }
  }
}

bool settleVelocities(Context& c, std::string_view& faulty) {
  constexpr float kAbsurd = 100.0f * 100.0f;  // (m/s)²
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    if (!c.model.objects[object].net) continue;
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
