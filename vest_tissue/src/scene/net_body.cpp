#include <algorithm>
#include <cmath>
#include <cstring>

#include "stages.h"

namespace vest::scene {
namespace {

using net::Block;

constexpr std::uint64_t kBoundEvery = 4;  ///< steps between two looks at an object's strain
constexpr double kBoundWay = 1e-5;        ///< m: less is no strain worth a look, links are millimetres long
/// A look before the turn: an object moved this part of its longest edge since the last one, and a link is
/// stretched beyond what the sub-steps are for (tuned).
constexpr double kBoundLeap = 0.25;
constexpr double kBorne = 0.9;    ///< of the longest step: links that stretch before the next look (tuned)
constexpr float kReserve = 1.1f;  ///< of the greatest strain: law that stays whole until then (tuned)
constexpr float kGrowth = 1.2f;   ///< of the tangent, below which the old bound still holds (its margin)
/// Sub-steps for which the geometry of contacts holds (tuned; docs/decisions/0016-…): what needs twice as
/// many in a step vibrates faster than the step can follow.
constexpr int kContactSteps = 5;

net::ElementArrays elementArrays(Block& b) {
  return {b.row(Block::PX), b.row(Block::PY), b.row(Block::PZ), b.row(Block::VX), b.row(Block::VY),
          b.row(Block::VZ), b.row(Block::HX), b.row(Block::HY), b.row(Block::HZ)};
}

/// Pressure of the enclosed volume. Its gradient is taken as often as its stiffness needs
/// (ObjectConstants::volume_batches), at the positions predicted for the middle of the `interval` (s) in
/// which it serves: taken at its start it would lag, and the part of the stiffness that comes from the
/// pressure would feed energy (docs/decisions/0012-…). Between, the volume follows the gradient. Where cuts
/// have torn the surface so wide that the pressure is stiffer than an exchange bears, it is softer by as
/// much.
void addPressure(Context& c, std::size_t object, const net::Volume& v, bool renew, double h, int every) {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
  Block& b = s.block;
  if (v.bulk_modulus == 0.0f || v.triangles.empty()) return;
  const std::size_t stride = b.knotCapacity() + 1, knots = b.knots();
  const double interval = h * every;
  const net::KnotLoops& loops = net::knotLoops(c.level);
  if (renew) {
    const float ahead = static_cast<float>(0.5 * interval);
    for (int axis = 0; axis < 3; ++axis) {
      const float* const x = b.row(static_cast<Block::KnotRow>(Block::X + axis));
      const float* const u = b.row(static_cast<Block::KnotRow>(Block::VX + axis));
      loops.lead(x, u, ahead, o.volume_start.data() + axis * stride, knots);
    }
    net::ElementArrays there = elementArrays(b);
    const float* const x0 = o.volume_start.data();
    there.x = x0, there.y = x0 + stride, there.z = x0 + 2 * stride;
    o.volume = net::volumeGradient(v, there, o.volume_gradient.data(), stride, o.packed);
    constexpr double kMost = solver::kStepMargin * solver::kStepMargin;
    const float* const g = o.volume_gradient.data();
    const double compliance =
        loops.weighedSquares(g, g + stride, g + 2 * stride, b.row(Block::kInverseMass), knots);
    const double rate = v.bulk_modulus / v.rest * compliance;
    const double longest = solver::longestStep({rate, 0.0});
    o.volume_share = static_cast<float>(std::min(1.0, kMost * longest * longest / (h * h)));
  }
  double change = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const float *g = o.volume_gradient.data() + axis * stride, *x0 = o.volume_start.data() + axis * stride;
    change = loops.along(change, g, b.row(static_cast<Block::KnotRow>(Block::PX + axis)), x0, knots);
  }
  const float pressure = o.volume_share * net::pressureOf(v, o.volume + change);
  for (int axis = 0; axis < 3; ++axis) {
    loops.addScaled(o.volume_gradient.data() + axis * stride, pressure,
                    b.row(static_cast<Block::KnotRow>(Block::HX + axis)), knots);
  }
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
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t first = 0; first < s.block.knots(); first += 8) {
    const std::size_t end = std::min(first + 8, s.block.knots());
    std::uint64_t any = 1;
    if (end == first + 8) std::memcpy(&any, &s.fixed[first], sizeof any);
    for (std::size_t i = first; any != 0 && i < end; ++i)  // most eights have none
      if (s.fixed[i]) sum -= Eigen::Vector3d(fx[i], fy[i], fz[i]);
  }
  o.reaction = sum;
}

/// Times a step that held forces have to be renewed for the shape and the parts that there are now.
int exchangesNow(const ObjectConstants& constants, const ObjectState& s, double dt, int most,
                 solver::BoundScratch& scratch) {
  const solver::Rates slow = solver::elementRates(s.block, s.elements, scratch);
  const double needed = dt / (solver::kStepMargin * solver::longestStep(slow));
  int batches = constants.batches;
  while (batches < needed && 2 * batches <= most) batches *= 2;
  return batches;
}

/// dσ/dε over Young's modulus, no unit.
float tangentOf(const net::LinkTable::LawConstants& a, float strain) {
  return 1.0f + strain * (2 * a.a2 + strain * (3 * a.a3 + strain * 4 * a.a4));
}

/// Until the next look the law goes on along its tangent from where the sub-steps bear no steeper one: what a
/// tool stretches within a step is softer than its law, and stable. @param own 1/s², of the links as they are
/// stretched, the greatest by `strain`
void limitLaw(ObjectState& s, const ObjectConstants& constants, double own, float strain, double dt) {
  const double h = dt / (kBorne * s.sub_steps),
               decay = constants.rates.decay * std::max(1.0, s.damping_scale);
  // solver::longestStep() turned round: h²·omega²/4 + h·decay/2 = 1.
  const double bears = 4.0 / (h * h) * (1.0 - 0.5 * h * decay) - constants.contact_omega_squared;
  const auto& a = s.law_links.law();
  const auto all = static_cast<float>(constants.law.max_strain);
  const auto most = static_cast<float>(bears / own) * tangentOf(a, std::min(strain, all));
  float low = std::min(all, kReserve * strain), high = all;
  if (tangentOf(a, high) <= most) low = high;
  for (int i = 0; i < 12 && low < high; ++i) {
    const float middle = 0.5f * (low + high);
    (tangentOf(a, middle) <= most ? low : high) = middle;
  }
  s.limit_strain = low;
  s.law_links.setMaxStrain(low);
}

/// Per knot, the greatest size of what `value` makes of its links' strains.
template <typename Value>
void greatestOf(const ObjectState& s, float* per_knot, Value value) {
  const float *x = row(s, Block::X), *y = row(s, Block::Y), *z = row(s, Block::Z);
  for (const NetLink& link : s.links) {
    const net::KernelLink& l = link.values;
    if (l.axial == 0.0f) continue;
    const float dx = x[l.knot1] - x[l.knot0], dy = y[l.knot1] - y[l.knot0], dz = z[l.knot1] - z[l.knot0];
    const float strain = std::sqrt(dx * dx + dy * dy + dz * dz) / l.rest - 1.0f;
    const auto is = static_cast<float>(std::fabs(value(link, strain)));
    per_knot[l.knot0] = std::max(per_knot[l.knot0], is);
    per_knot[l.knot1] = std::max(per_knot[l.knot1], is);
  }
}

}  // namespace

const RigidBody kRigidBody;
const NetBody kNetBody;
const ImplicitNetBody kImplicitNetBody;

/// Sub-steps of an object for its present strain. Only numbers of the State enter: re-simulation takes the
/// same.
void NetBody::renewBound(Context& c, std::size_t object) const {
  const ObjectConstants& constants = c.model.objects[object];
  ObjectState& s = c.state.objects[object];
  if ((c.state.step + object) % kBoundEvery != 0) {
    const double moved = std::fmod(s.way - std::max(0.0, s.way_bounded), 1.0);  // whole metres are cuts
    if (!(moved > kBoundLeap * constants.greatest_edge) ||
        !(solver::greatestStrain(boundLinks(s)) > s.limit_strain))
      return;
  }
  const bool scaled =
      s.elastic_scale > 1.0 || s.damping_scale > 1.0 || s.heat.stiffened || !s.topology.doubled_knots.empty();
  if (s.way_bounded >= 0.0 && s.way - s.way_bounded < kBoundWay && !scaled && !s.degraded) return;
  s.way_bounded = s.way;
  ObjectScratch& o = c.scratch.objects[object];
  const bool was_degraded = s.degraded;
  s.degraded = false;
  const float limited = s.limit_strain;
  const auto limit_to = [&s](float strain) { s.law_links.setMaxStrain(s.limit_strain = strain); };
  const auto whole = static_cast<float>(constants.law.max_strain);
  limit_to(whole);
  solver::BoundLinks links = boundLinks(s);
  const float strain = solver::greatestStrain(links);
  const bool softened = limited < whole && strain > limited;  // since the last look: told until the next one
  const float tangent = tangentOf(links.law, std::min(strain, whole));
  const double dt = c.model.description.dt;
  // Removed links leave every bound valid; doubled knots do not.
  const bool cut = !s.topology.doubled_knots.empty();
  if (tangent <= kGrowth && strain < 0.5f && !scaled) {
    s.sub_steps = constants.sub_steps;
    s.batches = constants.batches;
    s.bound_strain = 0.0f;
    if (constants.polynomial)
      limitLaw(s, constants, constants.bound_at_start * constants.calibration, 0.0f, dt);
    s.degraded = softened;
    return;
  }
  const int most = static_cast<int>(solver::kSubStepsPerSecond * dt);
  const int before = s.batches;
  s.batches = exchangesNow(constants, s, dt, most, o.bound);
  // The bound of a strain serves for a little more and for somewhat less.
  if (!scaled && !was_degraded && s.batches == before && strain < 1.05f * s.bound_strain &&
      strain > 0.8f * s.bound_strain) {
    limit_to(std::min(whole, std::max(limited, kReserve * strain)));
    s.degraded = softened;
    return;
  }
  s.bound_strain = strain;
  const int limit = std::max(s.batches, most / s.batches * s.batches);  // of whole batches
  int needed = 1;
  double own = 0.0;
  for (int attempt = 0; attempt < 8; ++attempt) {
    solver::Rates rates = solver::linkRates(links, o.bound);
    own = rates.omega_squared * (cut ? 1.0 : constants.calibration);
    rates.omega_squared = own + constants.contact_omega_squared;
    rates.decay = constants.rates.decay * std::max(1.0, s.damping_scale);
    needed = solver::subSteps(dt, rates);
    if (needed <= limit) break;
    // Declared fallback: the law goes on along its tangent from a smaller strain, softer but bounded.
    s.degraded = true;
    limit_to(0.5f * s.limit_strain);
    links.law = s.law_links.law();
  }
  needed = std::clamp(needed, constants.sub_steps, limit);
  s.sub_steps = (needed + s.batches - 1) / s.batches * s.batches;
  if (constants.polynomial && !s.degraded) limitLaw(s, constants, own, strain, dt);
  s.degraded = s.degraded || softened;
}

void NetBody::begin(Context& c, std::size_t object, double h, int batch) const {
  Body::begin(c, object, h, batch);
  ObjectState& s = c.state.objects[object];
  net::addElements(s.elements, elementArrays(s.block), c.level);
  const bool one = s.elements.volumes.size() == 1;
  const ObjectConstants& constants = c.model.objects[object];
  const int every = !one || s.batches > constants.batches ? 1 : s.batches / constants.volume_batches;
  for (const net::Volume& v : s.elements.volumes) {
    auto& gradient = c.scratch.objects[object].volume_gradient;
    if (!one) std::fill(gradient.begin(), gradient.end(), 0.0f);  // a volume sets those of its own knots
    addPressure(c, object, v, batch % every == 0, h, every);
  }
}
/// A batch of an object that is stepped implicitly: contacts and held forces as they are at its start.
void ImplicitNetBody::advance(Context& c, std::size_t object, int batch) const {
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

void NetBody::advance(Context& c, std::size_t object, int batch) const {
  ObjectState& s = c.state.objects[object];
  ObjectScratch& o = c.scratch.objects[object];
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
  if (c.shares.next[object] != object) {
    const ObjectState& next = c.state.objects[c.shares.next[object]];
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

void NetBody::conduct(Context& c, std::size_t object, double dt) const {
  // Nearly all knots are at body temperature, and nothing passes between two of these.
  const ObjectState& s = c.state.objects[object];
  std::vector<std::uint8_t>& warm = c.scratch.objects[object].near;
  for (std::size_t k = 0; k < s.block.knots(); ++k)
    warm[k] = s.heat.columns[k].excess != decltype(interaction::HeatColumn::excess){};
  for (const NetLink& l : s.links) {
    const std::uint32_t p = l.values.knot0, q = l.values.knot1;
    if ((warm[p] | warm[q]) == 0 || l.conductance == 0.0f ||
        (l.values.axial == 0.0f && l.values.damping == 0.0f))
      continue;
    exchangeHeat(c, object, p, q, l.conductance, dt);
    warm[p] = warm[q] = 1;
  }
}

void NetBody::denature(ObjectState& s) const {
  for (std::size_t i = 0; i < s.links.size(); ++i) {
    NetLink& l = s.links[i];
    if (l.values.axial == 0.0f) continue;
    const double part =
        0.5 * (s.heat.columns[l.values.knot0].denatured + s.heat.columns[l.values.knot1].denatured);
    const float shorter = static_cast<float>(1.0 - interaction::kShrinkage * part),
                stiffer = static_cast<float>(1.0 + interaction::kStiffening * part);
    if (std::fabs(stiffer - l.stiffen) < 1e-3f) continue;
    setLink(s, i, l.values.axial * (stiffer / l.stiffen), l.values.rest * (shorter / l.shrink),
            l.values.damping);
    l.shrink = shorter;
    l.stiffen = stiffer;
    s.heat.stiffened = true;
  }
}

double NetBody::elasticEnergy(const ObjectConstants& constants, const ObjectState& s) const {
  material::Law law = constants.law;
  law.youngs_modulus = 1.0;
  law.max_strain = s.limit_strain;
  material::Law linear;
  linear.youngs_modulus = 1.0;
  double sum = 0.0;
  for (const NetLink& link : s.links) {
    const net::KernelLink& l = link.values;
    if (l.axial == 0.0f) continue;
    const double length = (knotPosition(s, l.knot1) - knotPosition(s, l.knot0)).norm();
    sum += l.axial * l.rest * material::energyDensity(link.by_law ? law : linear, length / l.rest - 1.0);
  }
  const net::ElementArrays arrays{row(s, Block::X), row(s, Block::Y), row(s, Block::Z), nullptr, nullptr,
                                  nullptr,          nullptr,          nullptr,          nullptr};
  return sum + net::elementEnergy(s.elements, arrays);
}

void NetBody::strain(const ObjectConstants&, const ObjectState& s, float* per_knot) const {
  greatestOf(s, per_knot, [](const NetLink&, float strain) { return strain; });
}

void NetBody::stress(const ObjectConstants& constants, const ObjectState& s, float* per_knot) const {
  material::Law law = constants.law;
  law.youngs_modulus *= s.elastic_scale;
  law.max_strain = s.limit_strain;
  material::Law linear;
  linear.youngs_modulus = law.youngs_modulus;
  greatestOf(s, per_knot, [&](const NetLink& link, float strain) {
    return link.stiffen * material::stress(link.by_law ? law : linear, strain);
  });
}

void ImplicitNetBody::reserve(const ObjectConstants&, const ObjectState& s, ObjectScratch& o) const {
  // Cuts add knots and couplings, and widen the matrix' envelope: half as much again.
  const solver::NetView net = netView(s);
  const std::size_t edges = solver::KnotOrder::edgesOf(net);
  o.implicit = std::make_unique<solver::ImplicitNet>(net, s.block.knotCapacity(), edges + edges / 2);
}
}  // namespace vest::scene
