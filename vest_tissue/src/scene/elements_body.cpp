#include <algorithm>
#include <cmath>

#include "sling_path.h"
#include "stages.h"
#include "vest_tissue/fem/cut_factor.h"
#include "vest_tissue/interaction/fasteners.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using fem::TissuePoint;
using net::Block;

/// Of the proxy's mass over dt²: stiffness that its explicit coupling bears, shared by a tool's points
/// (assumed).
constexpr double kProxyShare = 0.3;
constexpr double kHeldShare = 0.25;  ///< (omega·h)² of contacts with the cavity, which are held over a step
constexpr double kHeldGrip = 0.3;    ///< of mass/h: damping that friction amounts to at most
constexpr double kHardest = 1e9;     ///< N/m: of contacts with itself, far above any tissue's own
constexpr std::uint8_t kOrgan = 255;   ///< TissuePoint::tool of contacts with other objects
constexpr std::uint8_t kThread = 254;  ///< TissuePoint::tool of a sling's places
constexpr double kQuiet = 1e-9;        ///< m/s: fem::TissueScratch::quiet (tuned)
constexpr double kNoticed = 1e-3;      ///< of denaturation: elements with less are as healthy ones
constexpr double kInexact = 1e-2;      ///< relative residual of a step's solve above which it is announced

Vector3d toVector(const float v[3]) {
  return {v[0], v[1], v[2]};
}

void addTensor(double s[6], const Vector3d& n, double w) {
  s[0] += w * n.x() * n.x(), s[1] += w * n.y() * n.y(), s[2] += w * n.z() * n.z();
  s[3] += w * n.x() * n.y(), s[4] += w * n.x() * n.z(), s[5] += w * n.y() * n.z();
}

/// Contacts with rigid objects: springs at the place where the knot would be, weak enough for each mass.
void addPlanes(ObjectState& s, ObjectScratch& o, double h) {
  Block& b = s.block;
  const float* const mass = b.row(Block::kMass);
  for (const contact::PlaneContact& c : o.planes) {
    const std::uint32_t k = c.knot;
    const bool rests = still(s, o, k);
    const Vector3d n = toVector(c.normal), v = rests ? Vector3d(Vector3d::Zero()) : s.tissue.v[k];
    const double inertia = rests ? 1.0 / b.row(Block::kInverseMass)[k] : mass[k];
    const double stiffness = std::min<double>(c.stiffness, kHeldShare * inertia / (h * h));
    const double gap = n.dot(s.tissue.x[k] + h * v) - c.offset;
    if (gap >= 0.0) continue;
    const Vector3d slide = v - n.dot(v) * n;
    const double speed = std::sqrt(slide.squaredNorm()),
                 grip = std::min<double>(c.grip, kHeldGrip * inertia / h);
    const contact::Pressed<double> law(gap, 0.0, speed, stiffness, 0.0, grip, c.friction);
    o.loads.dissipated += law.drag * speed * speed * h;
    addHeld(s, k, law.push * n - law.drag * slide);
  }
}

/// Tool contacts and held knots as points of the implicit solve. `fraction`: of dt at the end of this batch.
bool gatherPoints(Context& c, ObjectScratch& o, double fraction) {
  auto& points = o.tissue.points;
  points.clear();
  std::array<int, tools::kInstrumentCount> of_tool{};
  bool all = true;
  for (const contact::Pull& p : o.pulls) {
    if (points.size() >= fem::kMostContactPoints) {
      all = false;
      break;
    }
    TissuePoint point;
    point.kind = 1;
    point.knots[0] = p.knot, point.weights[0] = 1.0;
    point.target = toVector(p.start) + fraction * toVector(p.travel);
    point.target_velocity = toVector(p.travel) / c.dt;
    point.stiffness = p.stiffness, point.damping = p.damping;
    point.tool = p.tool;
    if (p.tool != contact::kNoTool) ++of_tool[p.tool];
    for (TissuePoint& before : points)
      if (before.knots[0] == p.knot && before.with < 0) {
        before.with = static_cast<std::int32_t>(points.size());
        point.led = true;
      }
    points.push_back(point);
  }
  for (std::uint32_t i = 0; i < o.contacts.size(); ++i) {
    const contact::ToolContact& t = o.contacts[i];
    TissuePoint point;
    Vector3d q = Vector3d::Zero();
    for (int e = 0; e < 3; ++e) {
      point.knots[e] = t.knots[e], point.weights[e] = t.weights[e];
      q += point.weights[e] * o.tissue.q[t.knots[e]];
    }
    point.normal = toVector(t.normal);
    point.target = toVector(t.start) + fraction * toVector(t.travel);
    if (point.normal.dot(point.target - q) > t.reach) continue;
    if (points.size() >= fem::kMostContactPoints) {
      all = false;
      break;
    }
    point.target_velocity = toVector(t.travel) / c.dt;
    point.reach = t.reach;
    point.stiffness = t.stiffness;
    point.friction = t.friction;
    point.tool = t.tool;
    point.source = i;
    ++of_tool[t.tool];
    points.push_back(point);
  }
  for (TissuePoint& point : points) {  // those of tools
    if (point.tool == contact::kNoTool) continue;
    point.most_stiffness =
        kProxyShare * interaction::kProxyMass / (c.dt * c.dt * std::max(1, of_tool[point.tool]));
    point.stiffness = std::min(point.stiffness, point.most_stiffness);
  }
  return all;
}

/// Contacts with objects that move later in this batch: where these will be without them. Those with itself:
/// both places answer.
bool gatherOrgans(Context& c, std::size_t object, double h) {
  auto& points = c.scratch.objects[object].tissue.points;
  for (std::uint32_t i = 0; i < c.scratch.organ_contacts.size(); ++i) {
    OrganContact& r = c.scratch.organ_contacts[i];
    if (r.implicit_end < 0) continue;
    const ContactEnd &own = r.ends[static_cast<std::size_t>(r.implicit_end)],
                     &far = r.ends[static_cast<std::size_t>(1 - r.implicit_end)];
    if (own.object != object) continue;
    r.force.setZero();
    TissuePoint point;
    point.between = far.object == object;
    Vector3d other = Vector3d::Zero(), rate = other, q = other;
    const ObjectState& s = c.state.objects[far.object];
    for (std::size_t e = 0; e < 3; ++e) {
      point.knots[e] = own.knots[e], point.weights[e] = own.weights[e];
      const auto share = static_cast<double>(far.weights[e]);
      if (point.between) {
        point.knots[3 + e] = far.knots[e], point.weights[3 + e] = -share;
        continue;
      }
      other += share * knotPosition(s, far.knots[e]);
      rate += share * knotVelocity(s, far.knots[e]);
    }
    point.normal = (r.implicit_end == 0 ? -1.0 : 1.0) * r.normal.cast<double>();
    point.target = other + h * rate;
    for (int e = 0; e < point.used(); ++e)
      if (point.weights[e] != 0.0) q += point.weights[e] * c.scratch.objects[object].tissue.q[point.knots[e]];
    if (point.normal.dot(point.target - q) > r.reach) continue;
    if (points.size() >= fem::kMostContactPoints) return false;
    point.target_velocity = rate;
    point.reach = r.reach;
    point.stiffness = point.between ? 0.0 : r.stiffness;
    point.most_stiffness = point.between ? kHardest : r.stiffness;
    point.friction = r.friction;
    point.tool = kOrgan;
    point.source = i;
    points.push_back(point);
  }
  return true;
}

/// s: fem::TissueScratch::delay, the tissue's own damping; at least some steps (tuned).
double delayOf(const Context& c, std::size_t object) {
  constexpr double kLeast = 0.004;
  if (c.body(object).hasInertia()) return 0.0;
  const auto& slings = c.state.fasteners.slings;
  const bool any = std::any_of(slings.begin(), slings.end(), [&](const interaction::Sling& s) {
    return s.alive && s.around && s.object == object;
  });
  const auto& m = c.model.objects[object].fem->model->description.material;
  return any ? std::max(kLeast, m.rayleigh_stiffness) : 0.0;
}

/// Slings that lie on the object: the places of their nodes, and the way over these.
bool gatherThreads(Context& c, std::size_t object, double before, double after) {
  static_assert(interaction::kSlingNodes <= static_cast<int>(fem::kMostThreadPoints));
  auto& w = c.scratch.objects[object].tissue;
  w.threads.clear();
  auto& slings = c.state.fasteners.slings;
  for (std::size_t n = 0; n < slings.size(); ++n) {
    const interaction::Sling& sling = slings[n];
    const LoopTissue& loop = c.scratch.loops[n];
    if (!sling.alive || !sling.around || sling.object != object || loop.count == 0) continue;
    if (w.threads.size() == fem::kMostThreads) return false;
    fem::TissueThread thread;
    thread.source = static_cast<std::uint32_t>(n);
    thread.first = static_cast<std::uint32_t>(w.points.size());
    thread.held = loop.held;
    thread.knot = loop.knot + before * loop.travel, thread.knot_end = loop.knot + after * loop.travel;
    thread.length = std::max(sling.rest - kAround, 0.0);
    thread.fastest = kDrawn;
    thread.most = interaction::kSlingTension;
    thread.tension = sling.tension;
    // The knot, node 0, closes the way.
    for (int i = 1; i <= interaction::kSlingNodes; ++i) {
      const int node = i % interaction::kSlingNodes;
      const interaction::SlingTouch& t = sling.touch[node];
      if ((node == 0 && loop.held) || !t.on || t.object != sling.object) continue;
      TissuePoint point;
      point.kind = 2;
      std::copy(t.knots.begin(), t.knots.end(), point.knots.begin());
      std::copy(t.weights.begin(), t.weights.end(), point.weights.begin());
      point.tool = kThread;
      w.points.push_back(point);
      ++thread.count;
    }
    w.threads.push_back(thread);
  }
  return true;
}

/// What slings do to their applicators, and what is told of them; after copyTissue().
void tellThreads(Context& c, std::size_t object, double h) {
  constexpr double kSmooth = 0.005;  // s: of the tension that is told
  const ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  const double keep = std::min(1.0, h / kSmooth);
  for (const fem::TissueThread& thread : o.tissue.threads) {
    interaction::Sling& sling = c.state.fasteners.slings[thread.source];
    sling.tension += keep * (thread.tension - sling.tension);
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < thread.count; ++i) {
      const TissuePoint& point = o.tissue.points[thread.first + static_cast<std::uint32_t>(i)];
      sum += point.force;
      for (int e = 0; e < 3; ++e)
        if (point.weights[e] != 0.0)
          o.loads.work += h * point.weights[e] * point.force.dot(knotVelocity(s, point.knots[e]));
    }
    // A hand, or a knot, bears no more: the thread slips through its knot.
    if (thread.tension >= thread.most) {
      const double length =
          pathOf(s, sling, c.scratch.loops[thread.source], thread.knot_end, nullptr, nullptr);
      sling.rest = std::max(sling.rest, length + kAround);
    }
    if (!thread.held || !(thread.tension > 0.0)) continue;
    give(o.loads.tools[sling.instrument], -h * sum, thread.knot_end);
  }
}

/// What the tools feel, and the work that they do.
void tellTools(Context& c, const ObjectState& s, ObjectScratch& o, double h) {
  const double share = h / c.dt;
  for (const TissuePoint& point : o.tissue.points) {
    if (point.tool == kOrgan) {
      OrganContact& r = c.scratch.organ_contacts[point.source];
      r.force = r.implicit_end == 0 ? point.force : Vector3d(-point.force);
      o.loads.dissipated += h * point.slip_power;
      continue;
    }
    if (point.tool == kThread) continue;
    if (point.tool == contact::kNoTool) {  // its place stays: no work
      o.loads.dissipated += h * point.slip_power;
      continue;
    }
    contact::ToolLoad& load = o.loads.tools[point.tool];
    if (point.kind == 0 && point.force.squaredNorm() == 0.0) continue;
    Vector3d q = Vector3d::Zero();
    for (int e = 0; e < 3; ++e)
      if (point.weights[e] != 0.0) q += point.weights[e] * s.tissue.x[point.knots[e]];
    give(load, -h * point.force, q);
    // Spring of the contact and tissue behind it, in series.
    const double k = point.stiffness > 0.0 ? share / (1.0 / point.stiffness + point.compliance) : 0.0;
    if (point.kind == 1) {
      for (int e = 0; e < 3; ++e) load.stiffness[e] += k, load.damping[e] += point.damping * share;
    } else {
      addTensor(load.stiffness, point.normal, k);
      const double push = -point.force.dot(point.normal);
      for (int e = 0; e < 3; ++e) load.normal[e] += point.normal[e] * push * share;
      const contact::ToolContact& t = o.contacts[point.source];
      const Eigen::Vector3f f = (-point.force).cast<float>();
      contact::onJaws(load, t.jaw, f.data(), t.normal, h, k);
    }
    o.loads.work += h * point.force.dot(point.target_velocity);
    o.loads.dissipated += h * point.slip_power;
  }
}

/// Force of the attachments: what the tissue and other forces do to held knots; for elastostatic objects that
/// are whole the opposite of everything that acts on them, since they are in equilibrium.
Vector3d reactionOf(const Context& c, std::size_t object, const std::array<const float*, 3>& held,
                    const Vector3d& internal) {
  const ObjectState& s = c.state.objects[object];
  const fem::TissueModel& tissue = *c.model.objects[object].fem;
  const fem::Model& m = *tissue.model;
  const bool inertia = c.body(object).hasInertia(), factored = s.tissue.factored;
  Vector3d reaction = -internal - tissue.inner_mass * c.state.gravity - tissue.inner_load;
  for (std::size_t k = 0; k < s.tissue.x.size(); ++k) {
    if (factored && !s.fixed[k]) continue;
    reaction -= Vector3d(held[0][k], held[1][k], held[2][k]);
    if (!inertia) reaction -= s.tissue.mass[k] * c.state.gravity;
    if (!factored) reaction -= m.load[s.tissue.origin[k]];
  }
  if (factored) return reaction;
  for (const TissuePoint& point : c.scratch.objects[object].tissue.points)
    if (!point.between) reaction -= point.force;
  return reaction;
}

double kineticOf(const ObjectState& s, const ObjectScratch& o) {
  const fem::TissueState& t = s.tissue;
  double sum = 0.0;
  for (std::size_t k = 0; k < t.x.size(); ++k)
    if (!still(s, o, k)) sum += 0.5 * t.mass[k] * t.v[k].squaredNorm();
  return sum;
}

}  // namespace

const ElementsBody kElementsBody;
const ElastostaticBody kElastostaticBody;
const CondensedBody kCondensedBody;

/// Its inverse is that of the tissue as it was.
void ElastostaticBody::change(ObjectState& s) const {
  fem::useFactor(s.tissue);
}

namespace {

/// Free knots that held forces act on in this step. False: no room for all.
bool gatherHeld(const Context& c, std::size_t object, std::vector<fem::Index>& out) {
  const ObjectState& s = c.state.objects[object];
  out.clear();
  bool all = true;
  const auto take = [&](std::uint32_t k) {
    if (s.fixed[k]) return;
    all = all && out.size() < out.capacity();
    if (all) out.push_back(k);
  };
  for (const contact::PlaneContact& p : c.scratch.objects[object].planes) take(p.knot);
  for (const OrganContact& r : c.scratch.organ_contacts)
    for (const ContactEnd& end : r.ends)
      for (std::size_t e = 0; end.object == object && e < 3; ++e)
        if (end.weights[e] != 0.0f) take(end.knots[e]);
  for (const ConnectionState& s2 : c.state.connections)
    for (const net::Anchor* a : {&s2.end0, &s2.end1})
      for (std::size_t i = 0; s2.alive && a->object == object && i < 4; ++i) take(a->knots[i]);
  return all;
}

}  // namespace

/// A flap is softer than what it was part of: springs on it are the weaker.
void ElastostaticBody::soften(Context& c, std::size_t object) const {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  const fem::TissueModel& tissue = *c.model.objects[object].fem;
  o.answered = true;
  if (!s.tissue.factored) return;
  fem::CutFactor& factor = *o.tissue.cut;
  const bool usable = factor.renew(tissue, s.tissue), renewed = o.softened != factor.made();
  float* const inverse = s.block.row(Block::kInverseMass);
  for (std::size_t k = 0; renewed && k < s.tissue.x.size(); ++k)
    if (!s.fixed[k] && !still(s, o, k)) inverse[k] = static_cast<float>(1.0 / s.tissue.mass[k]);
  o.softened = factor.made();
  if (!usable) return;
  const bool all = gatherHeld(c, object, o.cut_knots);
  const bool found = factor.touch(o.cut_knots.data(), o.cut_knots.size());
  o.answered = all && found;
  for (const fem::Index k : o.cut_knots) {
    if (!still(s, o, k)) continue;
    const double soft =
        found ? tissue.step * tissue.step * factor.answer(k, k).trace() : 3.0 * softest(c, object);
    inverse[k] = static_cast<float>(inverseMassOf(soft, tissue.step));
  }
}

/// Of a cut mesh a dozen solves: found where it is asked for, once for each mesh.
double ElastostaticBody::softest(Context& c, std::size_t object) const {
  const ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  const fem::TissueModel& tissue = *c.model.objects[object].fem;
  const double softer = 1.0 / s.tissue.stiffness_scale;
  if (!s.tissue.factored) return softer * tissue.softest;
  fem::CutFactor& factor = *o.tissue.cut;
  const bool usable = factor.renew(tissue, s.tissue);
  if (std::exchange(o.softest_of, factor.made()) != factor.made())
    o.softest = usable ? factor.softest(tissue, s.tissue) : 0.0;
  return softer * o.softest;
}

Eigen::Matrix3d ElastostaticBody::answer(const Context& c, std::size_t object, std::uint32_t a,
                                         std::uint32_t b) const {
  const ObjectState& s = c.state.objects[object];
  const fem::TissueModel& tissue = *c.model.objects[object].fem;
  const double softer = 1.0 / s.tissue.stiffness_scale;
  if (s.tissue.factored)
    return (softer * tissue.step * tissue.step) * c.scratch.objects[object].tissue.cut->answer(a, b);
  const std::int32_t i = tissue.answer_number[a], k = tissue.answer_number[b];
  if (i < 0 || k < 0) return Eigen::Matrix3d::Zero();
  if (tissue.condensed())
    return softer * tissue.compliance.block(static_cast<std::size_t>(i), static_cast<std::size_t>(k));
  return softer * tissue.answer.block<3, 3>(3 * i, 3 * k);
}

bool still(const ObjectState& s, const ObjectScratch& o, std::size_t knot) {
  return !s.tissue.factored || (o.tissue.cut && o.tissue.cut->still(static_cast<fem::Index>(knot)));
}

void copyMasses(ObjectState& s, bool inertia) {
  for (std::size_t k = 0; k < s.tissue.x.size(); ++k) {
    s.block.row(Block::kMass)[k] = static_cast<float>(s.tissue.mass[k]);
    if (!inertia) continue;  // as before, until soften()
    s.block.row(Block::kInverseMass)[k] = s.fixed[k] ? 0.0f : static_cast<float>(1.0 / s.tissue.mass[k]);
  }
}

void copyTissue(ObjectState& s) {
  Block& b = s.block;
  for (std::size_t k = 0; k < s.tissue.x.size(); ++k) {
    for (int axis = 0; axis < 3; ++axis) {
      b.row(static_cast<Block::KnotRow>(Block::X + axis))[k] = static_cast<float>(s.tissue.x[k][axis]);
      b.row(static_cast<Block::KnotRow>(Block::VX + axis))[k] = static_cast<float>(s.tissue.v[k][axis]);
    }
  }
}

void ElementsBody::advance(Context& c, std::size_t object, int batch) const {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  const fem::TissueModel& tissue = *c.model.objects[object].fem;
  const int batches = s.batches * c.stretch;
  const double h = c.dt / batches;
  if (batch == 0) s.degraded = false;
  addPlanes(s, o, h);
  const std::array<const float*, 3> held{s.block.row(Block::HX), s.block.row(Block::HY),
                                         s.block.row(Block::HZ)};
  gatherClips(c, object, h);
  o.tissue.delay = delayOf(c, object);
  o.tissue.quiet = kQuiet;
  bool good = fem::freeTissueStep(tissue, s.tissue, h, held, c.state.gravity, o.tissue);
  double before = 0.0;
  if (c.account) before = kineticOf(s, o) + fem::tissueEnergy(tissue, s.tissue);
  // What held knots take from the tissue, before the solver uses its room for something else.
  Vector3d internal = Vector3d::Zero();
  for (std::size_t k = 0; s.tissue.factored && k < s.tissue.x.size(); ++k)
    if (s.fixed[k]) internal += o.tissue.force[k];
  double inexact = o.tissue.residual;
  bool all = good && gatherPoints(c, o, static_cast<double>(batch + 1) / batches);
  all = all && gatherOrgans(c, object, h);
  if (good) {
    all = gatherThreads(c, object, static_cast<double>(batch) / batches,
                        static_cast<double>(batch + 1) / batches) &&
          all;
  }
  if (good) {
    fem::solveTissuePoints(tissue, s.tissue, h, o.tissue);
    inexact = std::max(inexact, o.tissue.residual);
    if (c.account) {  // places at the start, for the work of held forces
      for (std::size_t k = 0; k < s.tissue.x.size(); ++k) o.tissue.p[k] = s.tissue.x[k];
    }
    good = fem::endTissueStep(tissue, s.tissue, h, o.tissue);
  }
  if (!good) {
    o.faulty = true;
    return;
  }
  tellClips(c, object, h);
  o.reaction = reactionOf(c, object, held, internal);
  tellTools(c, s, o, h);
  if (c.account) {
    double work = 0.0;  // of all forces from outside, gravity too
    for (std::size_t k = 0; k < s.tissue.x.size(); ++k) {
      Vector3d f(held[0][k], held[1][k], held[2][k]);
      if (!c.body(object).hasInertia()) f += s.tissue.mass[k] * c.state.gravity;
      work += f.dot(s.tissue.x[k] - o.tissue.p[k]);
    }
    for (const TissuePoint& point : o.tissue.points) {
      for (int e = 0; e < point.used(); ++e) {
        if (point.weights[e] != 0.0)
          work += point.weights[e] * point.force.dot(s.tissue.x[point.knots[e]] - o.tissue.p[point.knots[e]]);
      }
    }
    for (const fem::TissueGroup& g : o.tissue.groups)
      for (int i = 0; i < g.count; ++i)
        work += g.impulse[i].dot(s.tissue.x[g.knots[i]] - o.tissue.p[g.knots[i]]) / h;
    o.heat += before + work - kineticOf(s, o) - fem::tissueEnergy(tissue, s.tissue);
  }
  if (inexact > kInexact || !all) s.degraded = true;
  copyTissue(s);
  tellThreads(c, object, h);
}

void ElementsBody::conduct(Context& c, std::size_t object, double dt) const {
  const fem::TissueState& t = c.state.objects[object].tissue;
  const auto& columns = c.state.objects[object].heat.columns;
  const auto warm = [&](fem::Index k) {
    return columns[k].excess != decltype(interaction::HeatColumn::excess){};
  };
  for (std::size_t e = 0; e < t.corner.size(); ++e) {
    const auto& knots = t.corner[e];
    if (std::none_of(knots.begin(), knots.end(), warm)) continue;
    for (std::size_t i = 6 * e; i < 6 * e + 6; ++i) {
      const interaction::ElementEdge& edge = c.model.objects[object].heat.element_edges[i];
      exchangeHeat(c, object, knots[edge.corner0], knots[edge.corner1], edge.conductance, dt);
    }
  }
}

void CondensedBody::conduct(Context& c, std::size_t object, double dt) const {
  for (const interaction::HeatEdge& e : c.model.objects[object].heat.surface_edges)
    exchangeHeat(c, object, e.knot0, e.knot1, e.conductance, dt);
}

/// Elements follow the mean of their corners.
void ElementsBody::denature(ObjectState& s) const {
  fem::TissueState& t = s.tissue;
  bool any = !t.denatured.empty();
  for (std::size_t k = 0; k < t.x.size() && !any; ++k) any = s.heat.columns[k].denatured > kNoticed;
  if (!any) return;
  if (t.denatured.empty()) {
    change(s);
    t.denatured.resize(t.corner.size(), 0.0f);
  }
  for (std::size_t e = 0; e < t.corner.size(); ++e) {
    double sum = 0.0;
    for (const fem::Index k : t.corner[e]) sum += s.heat.columns[k].denatured;
    t.denatured[e] = static_cast<float>(0.25 * sum);
  }
}

void ElementsBody::reserve(const ObjectConstants& k, const ObjectState& s, ObjectScratch& o) const {
  o.tissue = fem::TissueScratch(*k.fem, s.block.knotCapacity());
  o.backup_x.reserve(s.block.knotCapacity());
  o.cut_faces.reserve(512), o.cut_knots.reserve(1024), o.doublings.reserve(512);
  o.cut_roots.resize(k.fem->neighbours.size());
}

}  // namespace vest::scene
