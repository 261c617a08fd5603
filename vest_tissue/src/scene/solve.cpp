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
  const float most = static_cast<float>(0.5 / h), hardest = static_cast<float>(0.25 / (h * h));
  const float* const v[] = {b.row(Block::VX), b.row(Block::VY), b.row(Block::VZ)};
  float* const f[] = {b.row(Block::HX), b.row(Block::HY), b.row(Block::HZ)};
  const float* const z = b.row(Block::PZ);
  for (std::size_t i = 0; i < b.knots(); ++i) {
    const HeldLoad::Of& l = s.load.now[i];
    if (l == HeldLoad::Of{}) continue;  // most knots
    const float drag = drags ? std::min(l[HeldLoad::kDamping], most * mass[i]) : 0.0f;
    for (std::size_t axis = 0; axis < 3; ++axis) f[axis][i] += l[axis] - drag * v[axis][i];
    const float stiffness = std::min(std::fabs(l[HeldLoad::kStiffness]), hardest * mass[i]);
    f[2][i] += std::copysign(stiffness, l[HeldLoad::kStiffness]) * std::max(0.0f, l[HeldLoad::kLevel] - z[i]);
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
    if (c.body(moved.object).turn() == turn && due(later.object))
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
  const bool moves = hasInertia();
  const net::KnotLoops& loops = net::knotLoops(c.level);
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = [axis](Block::KnotRow first) { return static_cast<Block::KnotRow>(first + axis); };
    const float *x = b.row(at(Block::X)), *v = b.row(at(Block::VX));
    float *p = b.row(at(Block::PX)), *f = b.row(at(Block::HX));
    // What is in equilibrium knows what gravity does to it.
    const float g = moves ? static_cast<float>(c.state.gravity[axis]) : 0.0f;
    loops.predict(x, v, mass, ahead, g, p, f, knots);
    const std::vector<float>& active = c.scratch.objects[object].active;
    if (active.empty()) continue;
    const float* const own = active.data() + static_cast<std::size_t>(axis) * (active.size() / 3);
    loops.addScaled(own, 1.0f, f, knots);
  }
  if (s.load.any) addLoad(s, h, filled() && moves);
}

namespace {

/// The batches of a step, and which of them an object begins one of its own with.
struct Batches {
  const Context& c;
  int count;
  explicit Batches(const Context& context) : c(context), count(context.model.batches) {
    for (const ObjectState& s : c.state.objects) count = std::max(count, s.batches);
    count *= c.stretch;
  }
  /// Of the step, for one of the object's own.
  int every(std::size_t object) const { return count / (c.state.objects[object].batches * c.stretch); }
  bool due(std::size_t object, int batch) const {
    if (!c.model.objects[object].deforms) return false;
    const int own = c.state.objects[object].batches * c.stretch;
    return own == count || batch % (count / own) == 0;  // nearly all take all; divisions are dear
  }
  void begin(Context& to, std::size_t object, int batch) const {
    to.body(object).begin(to, object, to.dt / (to.state.objects[object].batches * to.stretch),
                          batch / every(object));
  }
};

/// Forces of a part of the connections, and of the contacts between organs that answer at once: a force holds
/// until both its objects are renewed together. Writes nothing but these.
void findForces(Context& c, const Batches& batches, int batch, std::size_t chunk) {
  const auto part = [&](std::size_t count, auto work) {
    const std::size_t chunks = c.shares.chunks;
    for (std::size_t n = count * chunk / chunks; n < count * (chunk + 1) / chunks; ++n) work(n);
  };
  FourConnections four(c);
  part(c.state.connections.size(), [&](std::size_t n) {
    const ConnectionState& s = c.state.connections[n];
    if (!s.alive) return;
    const bool due0 = batches.due(s.end0.object, batch), due1 = batches.due(s.end1.object, batch);
    if (!due0 && !due1) return;
    const bool moves0 = c.model.objects[s.end0.object].deforms,
               moves1 = c.model.objects[s.end1.object].deforms;
    const int slow = std::min(moves0 ? c.state.objects[s.end0.object].batches : 1 << 20,
                              moves1 ? c.state.objects[s.end1.object].batches : 1 << 20);
    const double h = c.dt / (slow * c.stretch);
    const bool renew = (due0 || !moves0) && (due1 || !moves1);
    if (renew && four.takes(n))
      four.add(n, h);
    else
      pullTogether(c, n, h, renew);
  });
  four.finish();
  part(c.scratch.organ_contacts.size(), [&](std::size_t n) {
    OrganContact& r = c.scratch.organ_contacts[n];
    r.heat = 0.0;
    if (r.implicit_end < 0 && batches.due(r.ends[0].object, batch) && batches.due(r.ends[1].object, batch))
      r.force = organForce(c, r, c.dt / r.batches, r.heat);
  });
}

/// What was found that is not an object's own, in the order in which it is numbered.
void tellForces(Context& c) {
  for (std::size_t n = 0; n < c.state.connections.size(); ++n) {
    ConnectionForce& f = c.scratch.connection_force[n];
    if (f.torn > 0.0) {
      sever(c, n, f.torn, -1);
      f = ConnectionForce{};
    }
    if (c.account && c.state.connections[n].alive) c.state.energy.dissipated += f.dissipated;
  }
}

/// Of an organ contact, on those of its ends that are on the object.
void holdContact(Context& c, const OrganContact& r, std::size_t object) {
  const std::array<bool, 2> now{r.ends[0].object == object, r.ends[1].object == object};
  for (std::size_t i = 0; r.balanced && i < 6; ++i) {
    const ContactEnd& end = r.ends[i / 3];
    if (now[i / 3] && ContactBody::uses(r, i))
      addHeld(c.state.objects[end.object], end.knots[i % 3], r.couple[i]);
  }
  if (now[0]) push(c.state, r.ends[0], r.force);
  if (now[1]) push(c.state, r.ends[1], -r.force);
}

/// Adds what connections and organ contacts do to an object to its held forces, in the order of their
/// numbers: sums are the same whoever works on it.
void holdConnections(Context& c, std::size_t object) {
  for (const std::uint32_t end : c.model.objects[object].tied)
    if (c.state.connections[end / 2].alive) holdEnd(c, end / 2, end % 2);
}
void holdContacts(Context& c, std::size_t object) {
  for (std::uint32_t n = c.scratch.objects[object].first_contact; n != OrganContact::kNone;) {
    const OrganContact& r = c.scratch.organ_contacts[n];
    if (r.implicit_end < 0) holdContact(c, r, object);
    n = r.next[r.ends[0].object == object ? 0 : 1];
  }
}

}  // namespace

Shares shareOut(const WorldModel& model, std::size_t threads) {
  // Relative cost of a step, as measured with the gynaecology scene: a link in a sub-step counts 1, what is
  // done once a batch or a step counts 15 a knot. An element's implicit step is dearer by far (assumed).
  constexpr double kKnot = 15.0, kElement = 1000.0;
  std::vector<std::pair<double, std::size_t>> costs;
  for (const std::size_t i : model.bodies) {
    const ObjectState& s = model.start.objects[i];
    costs.emplace_back(static_cast<double>(s.links.size()) * model.objects[i].sub_steps +
                           kKnot * static_cast<double>(s.block.knots()) +
                           kElement * static_cast<double>(s.tissue.corner.size()),
                       i);
  }
  std::stable_sort(costs.begin(), costs.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<std::vector<std::size_t>> of(threads);
  std::vector<double> sum(threads, 0.0);
  for (const auto& [cost, object] : costs) {
    const auto least = static_cast<std::size_t>(std::min_element(sum.begin(), sum.end()) - sum.begin());
    of[least].push_back(object), sum[least] += cost;
  }
  Shares shares;
  shares.chunks = threads == 1 ? 1 : 2 * threads;
  shares.next.resize(model.objects.size());
  for (auto& own : of) {
    std::sort(own.begin(), own.end());
    for (std::size_t n = 0; n < own.size(); ++n) shares.next[own[n]] = own[std::min(n + 1, own.size() - 1)];
    shares.bodies.insert(shares.bodies.end(), own.begin(), own.end());
    shares.body_ends.push_back(shares.bodies.size());
    shares.search_ends.push_back(shares.bodies.size() + 1);
  }
  return shares;
}

void solve(Context& c) {
  int first = Body::kLast;
  const Batches batches(c);
  for (const std::size_t object : c.model.bodies) first = std::min(first, c.body(object).turn());
  for (std::size_t i = 0; i < c.scratch.objects.size(); ++i) {
    ObjectScratch& o = c.scratch.objects[i];
    const ObjectState& s = c.state.objects[i];
    o.loads = contact::ObjectLoads{};
    o.heat = 0.0;
    o.faulty = o.begun = o.joined = false;
    o.sub_step = c.dt / (c.stretch * static_cast<double>(c.body(i).stepsOf(s)));
    c.body(i).soften(c, i);
  }
  softenConnections(c);
  gatherSlings(c);
  // Each object adds up what others do to it just before it moves, where nothing else is held in between.
  for (const auto& clip : c.state.fasteners.clips)
    if (clip.alive && clip.joined) c.scratch.objects[clip.object].joined = true;
  const auto apart = [&](std::size_t object) {
    return first == Body::kLast && !c.scratch.threads && !c.scratch.objects[object].joined;
  };
  for (int batch = 0; batch < batches.count; ++batch) {
    eachBody(c, [&](std::size_t object) {
      if (batches.due(object, batch) && !c.scratch.objects[object].begun) batches.begin(c, object, batch);
    });
    auto find = [&](std::size_t chunk) { findForces(c, batches, batch, chunk); };
    c.pool.each(c.shares.chunks, find);
    tellForces(c);
    const auto hold = [&](auto holdAll) {
      for (const std::size_t object : c.model.bodies)
        if (!apart(object) && batches.due(object, batch)) holdAll(c, object);
    };
    hold(holdConnections);
    joinClips(c, batch, batches.count);
    for (const OrganContact& r : c.scratch.organ_contacts) c.state.energy.dissipated += r.heat;
    hold(holdContacts);
    if (c.scratch.threads) {
      const int each = batches.count / (c.scratch.threads->parts * c.stretch);
      if (batch % each == 0) stepThreads(c, batch / each);
      for (const ThreadPush& p : c.scratch.threads->pushes)
        if (batches.due(p.object, batch)) {
          push(c.state, {p.object, p.knots, p.weights}, p.force);
          push(c.state, {p.object, p.far_knots, p.far_weights}, p.force);
        }
    }
    for (int turn = first; turn <= Body::kLast; ++turn) {
      eachBody(c, [&](std::size_t object) {
        const Body& body = c.body(object);
        if (body.turn() != turn || !batches.due(object, batch)) return;
        if (apart(object)) holdConnections(c, object), holdContacts(c, object);
        const int every = batches.every(object), next = batch + every;
        body.advance(c, object, batch / every);
        // Its next batch begins at once, while it is in the processor's cache.
        c.scratch.objects[object].begun = turn == Body::kLast && next < batches.count;
        if (c.scratch.objects[object].begun) batches.begin(c, object, next);
      });
      if (turn < Body::kLast)
        pushLater(c, turn, [&](std::size_t object) { return batches.due(object, batch); });
    }
  }
}

bool settleVelocities(Context& c, std::string_view& faulty) {
  constexpr float kAbsurd = 100.0f * 100.0f;  // (m/s)²
  eachBody(c, [&c](std::size_t object) {
    const ObjectState& s = c.state.objects[object];
    ObjectScratch& o = c.scratch.objects[object];
    const float *vx = row(s, Block::VX), *vy = row(s, Block::VY), *vz = row(s, Block::VZ);
    const float *x = row(s, Block::X), *y = row(s, Block::Y), *z = row(s, Block::Z);
    unsigned bad = o.faulty ? 1u : 0u;
    for (std::size_t i = 0; i < s.block.knots(); ++i) {
      const float v2 = vx[i] * vx[i] + vy[i] * vy[i] + vz[i] * vz[i],
                  p2 = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
      bad |= static_cast<unsigned>(!(v2 < kAbsurd)) | static_cast<unsigned>(!(p2 < 1e12f));
    }
    o.faulty = bad != 0;
    o.moved = movedBy(c, object);
  });
  for (const std::size_t object : c.model.bodies)
    if (c.scratch.objects[object].faulty) {
      faulty = c.model.description.objects[object].name;
      return false;
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
