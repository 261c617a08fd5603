#include "vest_tissue/scene/world.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <stdexcept>

#include "stages.h"
#include "world_impl.h"

namespace vest::scene {

using net::Block;

World::World(const Description& description, int threads) : World(buildModel(description), threads) {}
World::World(std::shared_ptr<const WorldModel> model, int threads) : impl_(std::make_unique<Impl>()) {
  impl_->model = std::move(model);
  impl_->state = impl_->model->start;
  impl_->scratch = WorldScratch(*impl_->model);
  impl_->reserve();
  impl_->useThreads(threads);
  tools::toolGeometry(tools::ToolKind::None);  // its catalogue is made at the first call: not in a step
}
World::~World() = default;
World::World(World&&) noexcept = default;
World& World::operator=(World&&) noexcept = default;

Status World::step(const StepInput& input, StepReport& report) {
  Impl& w = *impl_;
  if (report.events.capacity() < kEventCapacity) report.events.reserve(kEventCapacity);  // first call only
  report.events.clear();
  report.heat = {};
  report.stage_seconds = {};
  report.status = Status::Ok;
  report.fault_object = {};
  const double dt = input.dt, nominal = w.model->description.dt;
  int stretch = 1;
  while (stretch * nominal < dt * (1.0 - 1e-9) && stretch < 16384) stretch *= 2;
  Context c{*w.model, w.state, w.scratch,        input,   report,   *w.pool, w.shares,
            dt,       stretch, w.account_energy, w.level, &w.deltas};
  if (!checkInput(input)) return w.fault(c, "step input");

  keepBackup(c);
  w.time(report, 0, [&] {
    predict(c);
    moveProxies(c);
    takeLoads(c);
  });
  w.time(report, 1, [&] {
    collide(c);
    takeLoops(c);
    touchThreads(c);
  });
  w.time(report, 2, [&] {
    interact(c);
    suspend(c);
    handleThreads(c);
    handleNeedles(c);
  });
  w.time(report, 3, [&] {
    solve(c);
    fasten(c);
  });
  std::string_view faulty;
  bool good = true;
  w.time(report, 4, [&] { good = settleVelocities(c, faulty) && settleThreads(c, faulty); });
  if (!good) {
    restoreBackup(c);
    return w.fault(c, faulty);
  }
  if (c.account) accountLoads(c);
  w.time(report, 2, [&] {
    cut(c);
    dropLoose(c);
  });
  w.time(report, 1, [&] { measureWays(c); });
  w.time(report, 5, [&] {
    stepHeat(c);
    tell(c);
    feelImage(c);
    renewSides(c);
  });

  ++w.state.step;
  w.state.time += dt;
  for (const ObjectState& s : w.state.objects)
    if (s.degraded || s.cut.exhausted) report.status = Status::Degraded;
  if (w.scratch.threads && w.scratch.threads->full) report.status = Status::Degraded;
  return report.status;
}

Status World::Impl::fault(Context& c, std::string_view object) {
  c.report.status = Status::Fault;
  c.report.fault_object = object;
  c.report.events.clear();
  for (auto& m : c.report.contacts) {
    m = ContactModel{};  // zero force
    m.step = state.step;
  }
  for (auto& p : state.proxies) clearForces(p);
  Event e;
  e.kind = EventKind::Fault;
  e.step = state.step;
  for (std::size_t i = 0; i < model->objects.size(); ++i) {
    if (model->description.objects[i].name != object) continue;
    e.object = static_cast<std::uint16_t>(i);
    // What exploded begins again at rest, or it would explode again.
    Block& b = state.objects[i].block;
    for (const auto r : {Block::VX, Block::VY, Block::VZ}) std::fill_n(b.row(r), b.knots(), 0.0f);
    for (auto& v : state.objects[i].tissue.v) v.setZero();
  }
  for (std::size_t i = 0; i < model->description.sutures.size(); ++i) {
    if (model->description.sutures[i].rod.name != object) continue;
    e.object = static_cast<std::uint16_t>(model->objects.size() + i);
    for (auto& v : state.threads.rod.velocity) v.setZero();
    for (auto& v : state.threads.rod.spin) v.setZero();
  }
  emit(c, e);
  ++state.step;
  state.time += std::isfinite(c.dt) ? std::clamp(c.dt, 0.0, 0.01) : 0.0;
  return Status::Fault;
}

const Description& World::description() const {
  return impl_->model->description;
}
std::uint64_t World::steps() const {
  return impl_->state.step;
}
double World::time() const {
  return impl_->state.time;
}
std::uint32_t World::revision() const {
  return impl_->state.revision;
}
std::size_t World::objectCount() const {
  return impl_->state.objects.size();
}
std::size_t World::knotCount(std::size_t object) const {
  return impl_->state.objects.at(object).block.knots();
}
const Topology& World::topology(std::size_t object) const {
  return impl_->state.objects.at(object).topology;
}

const std::vector<std::array<std::uint32_t, 3>>& World::contactTriangles(std::size_t object) const {
  return impl_->state.objects.at(object).triangles;
}
const std::vector<std::uint8_t>& World::contactTriangleAlive(std::size_t object) const {
  return impl_->state.objects.at(object).triangle_alive;
}

namespace {
void copyRows(const ObjectState& s, Block::KnotRow first, float* out) {
  for (int axis = 0; axis < 3; ++axis) {
    const float* const from = s.block.row(static_cast<Block::KnotRow>(first + axis));
    for (std::size_t i = 0; i < s.block.knots(); ++i) out[3 * i + axis] = from[i];
  }
}
}  // namespace

void World::positions(std::size_t object, float* xyz) const {
  copyRows(impl_->state.objects.at(object), Block::X, xyz);
}
void World::velocities(std::size_t object, float* xyz) const {
  copyRows(impl_->state.objects.at(object), Block::VX, xyz);
}

Eigen::Vector3d World::knotAt(std::size_t object, std::size_t knot) const {
  const ObjectState& s = impl_->state.objects.at(object);
  const std::size_t k = knot < s.block.knots() ? knot : 0;
  return {s.block.row(Block::X)[k], s.block.row(Block::Y)[k], s.block.row(Block::Z)[k]};
}

Eigen::Vector3d World::reaction(std::size_t object) const {
  // Force of the attachments on the object: what tethers pull, and the opposite of what loads each fixed
  // knot.
  const ObjectState& s = impl_->state.objects.at(object);
  const ObjectConstants& constants = impl_->model->objects.at(object);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  if (!constants.deforms) return sum;
  sum = impl_->scratch.objects[object].reaction;
  for (const net::Tether& t : s.elements.tethers) {
    if (s.fixed[t.knot]) continue;
    const Eigen::Vector3d place(t.place[0], t.place[1], t.place[2]);
    sum += static_cast<double>(t.stiffness) * (place - knotPosition(s, t.knot)) -
           static_cast<double>(t.damping) * knotVelocity(s, t.knot);
  }
  return sum + suspensionForce(impl_->state, object);
}

void World::attachments(std::vector<Attachment>& out) const {
  out.clear();
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const auto& grasp = impl_->state.grasps[t];
    if (!grasp.active) continue;
    Attachment a;
    a.id = grasp.id;
    a.instrument = static_cast<std::int8_t>(t);
    const auto& first = grasp.anchors[0];
    a.anchor.object = first.object;
    a.anchor.knots = {first.knot, first.knot, first.knot, first.knot};
    a.anchor.weights = {1, 0, 0, 0};
    const auto& pose = impl_->state.proxies[t].pose;
    a.pose = Eigen::Isometry3d(Eigen::Translation3d(pose.tip) * pose.orientation);
    a.station =
        stationOf(*impl_->model, impl_->state, first.object, {first.knot, first.knot, first.knot}, {1, 0, 0});
    a.closure = grasp.jaw_at_touch > 0.0 ? 1.0 - pose.jaw / grasp.jaw_at_touch : 0.0;
    out.push_back(a);
  }
  addFasteners(impl_->state, out);
  addSuspensions(*impl_->model, impl_->state, out);
}

void World::slings(std::vector<SlingView>& out) const {
  out.clear();
  for (const interaction::Sling& sling : impl_->state.fasteners.slings) {
    if (!sling.alive) continue;
    out.emplace_back();
    drawSling(sling, out.back());
  }
}

void World::suspensions(std::vector<SuspensionView>& out) const {
  out.clear();
  for (const interaction::Suspension& s : impl_->state.suspensions.all)
    if (s.alive) drawSuspension(impl_->state, s, out.emplace_back());
}

const std::vector<suture::Reaction>& World::rodReactions() const {
  static const std::vector<suture::Reaction> kNone;
  return impl_->scratch.threads ? impl_->scratch.threads->rod.reactions : kNone;
}

void World::threads(std::vector<ThreadView>& out) const {
  std::size_t count = 0;
  const auto& rods = impl_->model->threads.rods;
  const suture::State& s = impl_->state.threads.rod;
  for (std::size_t n = 0; rods && n < rods->strands.size(); ++n) {
    const suture::Strand& strand = rods->strands[n];
    const std::uint32_t end = strand.first + strand.nodes;
    for (std::uint32_t first = strand.threadFirst(), i = first; i < end; ++i) {
      if (i + 1 < end && s.severed[i] == 0) continue;
      const std::uint32_t begin = first;
      first = i + 1;
      if (begin == i) continue;  // a crumb
      if (out.size() == count) out.emplace_back();
      ThreadView& view = out[count++];
      view.suture = static_cast<std::uint16_t>(n);
      view.first = begin - strand.threadFirst();
      view.positions.assign(s.position.begin() + begin, s.position.begin() + i + 1);
      view.tension.clear();
      for (std::uint32_t k = begin; k < i; ++k)
        view.tension.push_back(suture::tensionOf(*rods, s, strand, k));
    }
  }
  out.resize(count);
}

void World::needles(std::vector<NeedleView>& out) const {
  const ThreadModel& m = impl_->model->threads;
  const interaction::ThreadState& s = impl_->state.threads;
  out.resize(m.first_point.size());
  for (std::size_t n = 0; n < out.size(); ++n) {
    const suture::NeedleModel& needle = m.rods->needles[n];
    out[n].suture = static_cast<std::uint16_t>(m.places[needle.node].strand);
    out[n].threaded = s.rod.severed[needle.node] == 0;
    out[n].radius = needle.radius;
    out[n].instrument = -1;
    for (std::size_t t = s.needle_grips.size(); t-- > 0;)
      if (s.needle_grips[t].active && s.needle_grips[t].needle == n)
        out[n].instrument = static_cast<std::int8_t>(t);
    out[n].positions.clear();
    for (std::size_t i = 0; i < needle.points.size(); ++i)
      out[n].positions.push_back(m.at(s.rod, m.first_point[n] + i));
  }
}

bool World::deltasSince(std::uint32_t revision, std::vector<TopologyDelta>& out) const {
  return impl_->deltas.since(revision, impl_->state.revision, out);
}

bool World::removeLink(std::size_t object, std::uint32_t link) {
  std::uint32_t copy;
  TopologyRequest request;
  request.object = static_cast<std::uint16_t>(object), request.element = link;
  return object < objectCount() && applyRequest(*impl_->model, impl_->state, impl_->deltas, request, copy);
}

bool World::splitKnot(std::size_t object, std::uint32_t knot, const Eigen::Vector3d& normal,
                      std::uint32_t& copy) {
  const TopologyRequest request{TopologyRequest::Kind::SplitKnot, static_cast<std::uint16_t>(object), knot,
                                normal};
  return object < objectCount() && applyRequest(*impl_->model, impl_->state, impl_->deltas, request, copy);
}

void World::reset() {
  impl_->state = impl_->model->start;
  impl_->goOn();
}

void World::setThreads(int threads) {
  impl_->useThreads(threads);
}
solver::Pool& World::pool() const {
  return *impl_->pool;
}
std::string_view World::kernelLevel() const {
  return net::kernelLevelName(impl_->level);
}
void World::accountEnergy(bool on) {
  impl_->account_energy = on;
}
void World::measureStages(bool on) {
  impl_->measure = on;
}
const WorldModel& World::model() const {
  return *impl_->model;
}
const WorldState& World::state() const {
  return impl_->state;
}

}  // namespace vest::scene
