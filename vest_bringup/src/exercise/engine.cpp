#include "vest_bringup/exercise/engine.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "engine_state.h"
#include "vest_tissue/scene/ring.h"
#include "vest_tissue/scene/roles.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::exercise {
namespace {

/// Looks up the names of an exercise in a scene.
class Builder {
 public:
  Builder(Engine::Model& model, const scene::World& world) : m_(model), world_(world) {}

  void build() {
    const Exercise& e = m_.exercise;
    m_.scene_objects = world_.objectCount();
    for (Mark& mark : m_.exercise.marks)
      if (mark.middle) mark.at = middle(objects(mark.object, "").list.front());
    m_.window = std::clamp<std::size_t>(
        static_cast<std::size_t>(kForceWindow / world_.description().dt + 0.5), 1, kMostWindow);
    m_.optic_least = std::cos((e.optic + kOpticOff) * kDegree);
    if (e.optic > kOpticOff) m_.optic_most = std::cos((e.optic - kOpticOff) * kDegree);
    for (const Mark& mark : e.marks) m_.marks.push_back(place(mark));
    for (const Phase& p : e.phases) {
      m_.starts.push_back(p.start ? add(*p.start) : Range{});
      m_.phases.push_back(add(p.end));
    }
    for (const Gate& g : e.gates) m_.gates.push_back(add(g.condition));
    for (const Error& x : e.errors) m_.errors.push_back(add(x.when));
    for (const Item& item : e.items) {
      m_.items.push_back(number(item.number));
      std::size_t phase = 0;
      while (phase < e.phases.size() && e.phases[phase].name != item.phase) ++phase;
      m_.phase_of_item.push_back(phase);
    }
    for (const BuiltNumber& n : m_.numbers) {
      m_.pools = m_.pools || n.metric == Metric::Pool;
      m_.knots = m_.knots || n.metric == Metric::KnotDeterminant || n.metric == Metric::KnotOff ||
                 n.metric == Metric::Tail;
      m_.tension = m_.tension || n.metric == Metric::ThreadTension || n.metric == Metric::ThreadTensionPeak;
      const std::uint8_t needs = infoOf(n.metric).needs;
      if ((needs & kFigure) == 0) continue;
      if ((needs & kTool) != 0)
        m_.logged[n.tool] = true;
      else
        m_.logged[0] = m_.logged[1] = true;
    }
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw std::invalid_argument(m_.exercise.file + ": " + what + " (scene " + world_.description().name +
                                ")");
  }

  Objects objects(const std::string& object, const std::string& role) const {
    Objects out;
    out.in.assign(m_.scene_objects, 0);
    for (std::size_t i = 0; i < m_.scene_objects; ++i) {
      const scene::Object& o = world_.description().objects[i];
      const bool meant = object.empty() ? role.empty() || scene::hasRole(o, role) : o.name == object;
      out.in[i] = meant;
      if (meant) out.list.push_back(i);
    }
    if (out.list.empty())
      refuse(object.empty() ? "no object has the role '" + role + "'"
                            : "no object is called '" + object + "'");
    return out;
  }

  /// Events are of objects, and behind them of threads: by name, or without a name of all.
  Objects eventObjects(const std::string& object, const std::string& role) const {
    const auto& sutures = world_.description().sutures;
    std::vector<std::uint8_t> of_threads(sutures.size());
    bool any = false;
    for (std::size_t i = 0; i < sutures.size(); ++i) {
      of_threads[i] = role.empty() && (object.empty() || sutures[i].rod.name == object);
      any = any || (of_threads[i] && !object.empty());
    }
    Objects out;
    if (any)
      out.in.assign(m_.scene_objects, 0);
    else
      out = objects(object, role);
    out.in.insert(out.in.end(), of_threads.begin(), of_threads.end());
    return out;
  }

  Eigen::Vector3d middle(std::size_t object) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (std::size_t k = 0; k < world_.knotCount(object); ++k) sum += world_.knotAt(object, k);
    return sum / static_cast<double>(world_.knotCount(object));
  }

  BuiltMark place(const Mark& mark) const {
    BuiltMark b{mark.at, -1, 0};
    if (mark.object.empty()) return b;
    const std::size_t object = objects(mark.object, "").list.front();
    double nearest = 1e300;
    for (std::size_t k = 0; k < world_.knotCount(object); ++k) {
      const double d = (world_.knotAt(object, k) - mark.at).squaredNorm();
      if (d < nearest) nearest = d, b.knot = k;
    }
    b.object = static_cast<int>(object);
    b.at = mark.at - world_.knotAt(object, b.knot);
    return b;
  }

  std::size_t number(const Number& n) {
    BuiltNumber b;
    b.metric = n.metric;
    b.tool = n.tool < 0 ? 0 : static_cast<std::size_t>(n.tool);
    const MetricInfo& info = infoOf(n.metric);
    if ((info.needs & (kTool | kFigure)) == kTool && n.metric != Metric::Distance && b.tool >= kHands)
      refuse(std::string(info.name) + " is not known of the endoscope");
    if (info.needs & kObject) b.objects = objects(n.object, n.role);
    for (const std::string& name : n.marks) {
      std::size_t i = 0;
      while (m_.exercise.marks[i].name != name) ++i;
      b.marks.push_back(i);
    }
    if (n.metric == Metric::ClipOff || n.metric == Metric::CutOff)
      for (const std::size_t mark : b.marks) b.stations.push_back(station(mark, b.objects));
    if (n.metric == Metric::DamageOutside || n.metric == Metric::Sealed)
      for (const std::size_t object : b.objects.list) b.regions.push_back(region(object, b.marks.front()));
    if (n.metric == Metric::CutRound || n.metric == Metric::CutRoundRms || n.metric == Metric::BiteOff)
      for (const std::size_t mark : b.marks) b.circles.push_back(circle(b.objects.list.front(), mark));
    m_.numbers.push_back(std::move(b));
    return m_.numbers.size() - 1;
  }

  /// m, of the ring that a mark is nearest to.
  double station(std::size_t mark, const Objects& of) const {
    const net::TubeMap& tube = world_.model().objects[of.list.front()].tube;
    if (tube.ringCount() == 0) refuse("mark '" + m_.exercise.marks[mark].name + "': its object is no tube");
    double nearest = 1e300, at = 0;
    for (std::size_t ring = 0; ring < tube.ringCount(); ++ring) {
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (const std::uint32_t k : tube.knots(ring)) middle += world_.knotAt(of.list.front(), k);
      middle /= static_cast<double>(tube.knots(ring).size());
      const double d = (middle - m_.exercise.marks[mark].at).squaredNorm();
      if (d < nearest) nearest = d, at = tube.station(ring);
    }
    return at;
  }

  std::vector<std::uint8_t> region(std::size_t object, std::size_t mark) const {
    const Mark& of = m_.exercise.marks[mark];
    std::vector<std::uint8_t> in(world_.knotCount(object));
    bool any = false;
    for (std::size_t k = 0; k < in.size(); ++k) {
      in[k] = (world_.knotAt(object, k) - of.at).norm() <= of.radius;
      any = any || in[k];
    }
    if (!any) refuse("mark '" + of.name + "': none of the object's knots lies within its radius");
    return in;
  }

  /// Where a mark's circle lies on an object at rest: with the knot that is nearest to it.
  Circle circle(std::size_t object, std::size_t mark) const {
    const Mark& of = m_.exercise.marks[mark];
    const scene::Object& o = world_.description().objects[object];
    const auto& rest = o.rest_position.empty() ? o.position : o.rest_position;
    std::size_t knot = 0;
    for (std::size_t k = 0; k < o.position.size(); ++k)
      if ((o.position[k] - of.at).squaredNorm() < (o.position[knot] - of.at).squaredNorm()) knot = k;
    Circle c{of.at - o.position[knot] + rest[knot], Eigen::Vector3d::Zero(), of.radius};
    for (const auto& t : o.contact_triangles)
      if (std::find(t.begin(), t.end(), knot) != t.end())
        c.normal += (rest[t[1]] - rest[t[0]]).cross(rest[t[2]] - rest[t[0]]);
    if (!(c.normal.norm() > 0)) refuse("mark '" + of.name + "': its object has no surface there");
    c.normal.normalize();
    return c;
  }

  Range add(const Condition& condition) {
    const std::size_t begin = m_.nodes.size();
    node(condition);
    return {begin, m_.nodes.size()};
  }

  std::size_t node(const Condition& c) {
    Node n{c.kind, c.event, c.tool,    {}, c.station_low, c.station_high, static_cast<double>(c.count), 0,
           c.low,  c.high,  c.seconds, {}};
    for (const Condition& child : c.children) n.children.push_back(node(child));
    if (c.kind == Condition::Kind::Event) n.objects = eventObjects(c.object, c.role);
    if (c.kind == Condition::Kind::Number) n.number = number(c.number);
    m_.nodes.push_back(std::move(n));
    return m_.nodes.size() - 1;
  }

  Engine::Model& m_;
  const scene::World& world_;
};

/// One step of a condition. @param since s since its beginning  @return whether it holds
bool judge(const Engine::Model& m, Engine::State& s, const Range& range, double since,
           const scene::World& world, const scene::StepInput& input, const scene::StepReport& report) {
  using Kind = Condition::Kind;
  if (range.begin == range.end) return true;
  for (std::size_t i = range.begin; i < range.end; ++i) {
    const Node& n = m.nodes[i];
    NodeState& state = s.nodes[i];
    const auto child = [&](std::size_t k) { return s.nodes[n.children[k]].value != 0; };
    bool holds = false;
    switch (n.kind) {
      case Kind::Event:
        for (const scene::Event& e : report.events) {
          const bool station =
              n.station_low <= -1e8 || (e.station >= n.station_low && e.station <= n.station_high);
          if (e.kind == n.event && e.object < n.objects.in.size() && n.objects.in[e.object] &&
              (n.tool < 0 || e.instrument == n.tool) && station)
            state.count += 1;
        }
        holds = state.count >= n.count;
        break;
      case Kind::Number: {
        const double value = valueOf(m, s, n.number, world, input);
        holds = value >= n.low && value <= n.high;
        break;
      }
      case Kind::Any:
      case Kind::All: {
        std::size_t held = 0;
        for (std::size_t k = 0; k < n.children.size(); ++k) held += child(k);
        holds = n.kind == Kind::Any ? held > 0 : held == n.children.size();
        break;
      }
      case Kind::Not:
        holds = !child(0);
        break;
      case Kind::For:
        state.held = child(0) ? state.held + input.dt : 0.0;
        holds = child(0) && state.held >= n.seconds;
        break;
      case Kind::Within:
        if (child(0) && since <= n.seconds) state.latched = 1;
        holds = state.latched != 0;
        break;
      case Kind::Before:
        if (state.count == 0 && child(1)) state.count = 1;  // the second held
        if (state.count == 0 && child(0)) state.latched = 1;
        holds = state.latched != 0;
        break;
    }
    state.value = holds;
  }
  return s.nodes[range.end - 1].value != 0;
}

void note(Engine::State& s, Moment::Kind kind, std::uint64_t step, std::size_t index) {
  if (s.moments.size() < kMostMoments) s.moments.push_back({kind, step, index});
}

void renew(Engine::State& s, const Range& range) {
  for (std::size_t i = range.begin; i < range.end; ++i) s.nodes[i] = NodeState{};
}

/// A phase begins; with the first one the clock does.
void beginPhase(const Engine::Model& m, Engine::State& s, std::size_t p, const scene::World& world,
                const scene::StepInput& input) {
  if (s.clock.begun == 0) s.clock.begun = world.steps(), s.clock.time = 0;
  s.phases[p].begun = world.steps(), s.phases[p].since = s.clock.time;
  s.clock.hinted = 0;
  renew(s, m.phases[p]);
  for (std::size_t i = 0; i < m.items.size(); ++i)
    if (m.phase_of_item[i] == p) s.items[i].begin = valueOf(m, s, m.items[i], world, input);
  note(s, Moment::Kind::PhaseBegun, world.steps(), p);
}

/// It is the turn of a phase, and of those optional ones behind which it waits. What has no start of its own
/// begins; what has one waits for it, unless it does so already or began.
void nextPhases(const Engine::Model& m, Engine::State& s, const scene::World& world,
                const scene::StepInput& input) {
  s.clock.hinted = 0;
  for (std::size_t p = s.clock.phase; p < m.phases.size(); ++p) {
    PhaseState& phase = s.phases[p];
    if (!m.exercise.phases[p].start) {
      beginPhase(m, s, p, world, input);
    } else if (phase.due == 0) {
      phase.due = world.steps(), phase.since = s.clock.time;
      renew(s, m.starts[p]);
    }
    if (m.exercise.phases[p].required) break;
  }
}

/// The phase that is told of: what has begun before what waits, else the first that is due.
std::size_t toldPhase(const Engine::Model& m, const Engine::State& s) {
  for (std::size_t p = s.clock.phase; p < m.phases.size(); ++p) {
    if (s.phases[p].begun != 0) return p;
    if (m.exercise.phases[p].required) break;
  }
  return s.clock.phase;
}

std::uint64_t mixed(std::uint64_t hash, double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  return (hash ^ bits) * 1099511628211ULL;  // FNV-1a by words
}

}  // namespace

Engine::Engine(const Exercise& exercise, const scene::World& world, const simulation::Stage& stage) {
  auto model = std::make_unique<Model>();
  model->exercise = exercise;
  model->gas = stage.gas, model->blood = stage.blood, model->field = stage.field;
  Builder(*model, world).build();
  model_ = std::move(model);
  state_ = std::make_unique<State>();
  scratch_ = std::make_unique<Scratch>(world);
  std::size_t most = 0;
  for (std::size_t i = 0; i < world.objectCount(); ++i)
    most = std::max(most, world.knotCount(i) + world.knotCount(i) / 4 + 256);
  scratch_->damage.resize(most);
  // Its clock may begin as late as it may end.
  const bool logs = std::any_of(model_->logged.begin(), model_->logged.end(), [](bool b) { return b; });
  const double rows = 2 * exercise.limit / (world.description().dt * static_cast<double>(kMotionEvery)) + 2;
  state_->log = MotionLog(model_->logged, logs ? static_cast<std::size_t>(rows) : 0);
  reset();
}
Engine::~Engine() = default;

void Engine::reset() {
  State& s = *state_;
  s.clock = Clock{};
  s.tools.fill(ToolState{});
  s.nodes.assign(model_->nodes.size(), {});
  s.phases.assign(model_->phases.size(), {});
  s.gates.assign(model_->gates.size(), 0);
  s.errors.assign(model_->errors.size(), 0);
  s.error_was.assign(model_->errors.size(), 0);
  s.items.assign(model_->items.size(), {});
  s.numbers.assign(model_->numbers.size(), 0.0);
  s.results.assign(model_->items.size(), 0.0);
  s.objects.assign(model_->scene_objects, {});
  s.moments.clear();
  s.moments.reserve(kMostMoments);
  s.log.clear();
}

void Engine::step(const scene::World& world, const scene::StepInput& input, const scene::StepReport& report) {
  const Model& m = *model_;
  State& s = *state_;
  Clock& c = s.clock;
  if (c.finished != 0) return;
  const std::uint64_t step = world.steps();
  if (c.steps == 0) {
    c.lost_at_start = m.blood ? m.blood->circulation().lost : 0.0;
    c.sucked_at_start = m.field ? m.field->fluid().sucked : 0.0;
    if (step > 1) c.flags |= kRestored;
    nextPhases(m, s, world, input);
  }
  ++c.steps;
  c.time += input.dt, c.lived += input.dt;
  if (c.steps % kMotionEvery == 1) s.log.add(c.lived, step, input);
  if (!input.edits.empty() || !input.requests.empty()) c.flags |= kAssisted;
  if (report.status == scene::Status::Fault) c.flags |= kFault;
  for (const scene::ToolInput& t : input.tools) {
    c.input_hash = mixed(c.input_hash, static_cast<double>(t.functions) + (t.present ? 0.5 : 0.25));
    if (!t.present) continue;
    for (int i = 0; i < 3; ++i) c.input_hash = mixed(c.input_hash, t.position[i]);
    for (int i = 0; i < 4; ++i) c.input_hash = mixed(c.input_hash, t.orientation.coeffs()[i]);
    c.input_hash = mixed(c.input_hash, t.jaw);
  }
  measure(m, world, input, report, s, *scratch_);

  for (std::size_t hand = 0; hand < kHands; ++hand) {
    const auto& allowed = m.exercise.tools[hand];
    const scene::ToolInput& t = input.tools[hand];
    if (!t.present || allowed.empty() || s.tools[hand].wrong != 0 ||
        std::find(allowed.begin(), allowed.end(), t.tool) != allowed.end())
      continue;
    s.tools[hand].wrong = step;
    note(s, Moment::Kind::WrongTool, step, hand);
  }
  const scene::ToolInput& camera = input.tools[static_cast<std::size_t>(tools::Instrument::Endoscope)];
  const double optic = camera.sight.z();  // cosine of its angle
  if (camera.present && c.wrong_optic == 0 && (optic < m.optic_least || optic > m.optic_most)) {
    c.wrong_optic = step;
    note(s, Moment::Kind::WrongTool, step, static_cast<std::size_t>(tools::Instrument::Endoscope));
  }
  for (std::size_t i = 0; i < m.gates.size(); ++i) {
    const bool holds = judge(m, s, m.gates[i], c.time, world, input, report);
    if (!m.exercise.gates[i].never || !holds || s.gates[i] != 0) continue;
    s.gates[i] = step;
    note(s, Moment::Kind::GateBroken, step, i);
  }
  for (std::size_t i = 0; i < m.errors.size(); ++i) {
    const bool holds = judge(m, s, m.errors[i], c.time, world, input, report);
    if (holds && s.error_was[i] == 0 && s.errors[i] < m.exercise.errors[i].most) {
      ++s.errors[i];
      note(s, Moment::Kind::ErrorMade, step, i);
    }
    s.error_was[i] = holds;
  }
  for (std::size_t p = c.phase; p < m.phases.size(); ++p) {
    const double since = c.time - s.phases[p].since;
    if (s.phases[p].begun == 0) {
      if (judge(m, s, m.starts[p], since, world, input, report)) beginPhase(m, s, p, world, input);
    } else if (judge(m, s, m.phases[p], since, world, input, report)) {
      s.phases[p].ended = step;
      for (std::size_t i = 0; i < m.items.size(); ++i)
        if (m.phase_of_item[i] == p) s.items[i].end = valueOf(m, s, m.items[i], world, input);
      note(s, Moment::Kind::PhaseEnded, step, p);
      c.phase = p + 1, c.hinted = 0;
      // Beside one that came in between, the next one goes on.
      const Phase& ended = m.exercise.phases[p];
      if (c.phase < m.phases.size() && (ended.required || !ended.start)) nextPhases(m, s, world, input);
      break;
    }
    if (m.exercise.phases[p].required) break;
  }
  if (c.phase < m.phases.size()) {
    const std::size_t told = toldPhase(m, s);
    const Phase& phase = m.exercise.phases[told];
    const PhaseState& now = s.phases[told];
    if (c.hinted == 0 && !phase.hint.empty() && now.begun != 0 && c.time - now.since >= phase.hint_after) {
      c.hinted = 1;
      note(s, Moment::Kind::Hint, step, told);
    }
  }
  for (std::size_t i = 0; i < m.items.size(); ++i) {
    const bool part = m.phase_of_item[i] < m.phases.size();
    const ItemState& item = s.items[i];
    const std::size_t p = m.phase_of_item[i];
    s.results[i] = !part                    ? valueOf(m, s, m.items[i], world, input)
                   : s.phases[p].ended != 0 ? item.end - item.begin
                   : s.phases[p].begun != 0 ? valueOf(m, s, m.items[i], world, input) - item.begin
                                            : 0.0;
  }
  if (c.phase == m.phases.size() || c.time >= m.exercise.limit) {
    c.finished = step;
    note(s, Moment::Kind::Finished, step, 0);
  }
  if (progress_) progress_->show(s);
}

void Engine::save(std::vector<std::uint8_t>& bytes) const {
  State::walk(*state_, [&](const void* data, std::size_t count) {
    const auto* from = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), from, from + count);
  });
  const std::uint64_t moments = state_->moments.size();
  const auto* from = reinterpret_cast<const std::uint8_t*>(&moments);
  bytes.insert(bytes.end(), from, from + sizeof moments);
  from = reinterpret_cast<const std::uint8_t*>(state_->moments.data());
  bytes.insert(bytes.end(), from, from + moments * sizeof(Moment));
  state_->log.save(bytes);
}

bool Engine::restore(const std::uint8_t* bytes, std::size_t count) {
  State s = *state_;
  bool good = true;
  const auto take = [&](void* data, std::size_t size) {
    good = good && size <= count;
    if (!good || size == 0) return;
    std::memcpy(data, bytes, size);
    bytes += size, count -= size;
  };
  State::walk(s, take);
  std::uint64_t moments = 0;
  take(&moments, sizeof moments);
  good = good && moments <= kMostMoments && count >= moments * sizeof(Moment) &&
         s.clock.phase <= model_->phases.size();
  if (!good) return false;
  s.moments.resize(moments);
  take(s.moments.data(), moments * sizeof(Moment));
  good = s.log.restore(bytes, bytes + count) == bytes + count;
  for (const Moment& moment : s.moments)
    good = good && moment.kind <= Moment::Kind::Finished && moment.index < 1000;
  for (const ToolState& t : s.tools) good = good && t.at < kMostWindow;
  good = good && s.threads.at < kMostWindow;
  if (!good) return false;
  s.moments.reserve(kMostMoments);
  *state_ = std::move(s);
  flags_restored_ = state_->clock.flags;
  state_->clock.flags |= kRestored;
  return true;
}

void Engine::goOn() {
  state_->clock.flags = flags_restored_;
}

Result Engine::result() const {
  return resultOf(*model_, *state_);
}
bool Engine::finished() const {
  return state_->clock.finished != 0;
}
std::size_t Engine::phasesDone() const {
  return state_->clock.phase;
}
const Exercise& Engine::exercise() const {
  return model_->exercise;
}
std::shared_ptr<Progress> Engine::progress() {
  progress_ = std::make_shared<Progress>(model_, *state_);
  return progress_;
}

struct Progress::Impl {
  std::shared_ptr<const Engine::Model> model;
  scene::TripleBuffer<Engine::State> buffer;
  std::size_t moments = 0;
  std::uint64_t next = 0;
};

Progress::Progress(std::shared_ptr<const Engine::Model> model, const Engine::State& state)
    : impl_(std::make_unique<Impl>()) {
  impl_->model = std::move(model);
  impl_->buffer.forEachSlot([&](Engine::State& slot) {
    slot = state;
    slot.moments.reserve(kMostMoments);
  });
}
Progress::~Progress() = default;

void Progress::show(const Engine::State& state) {
  const std::uint64_t steps = state.clock.steps;
  if (steps == 1) impl_->next = 0;  // after a reset
  if (steps < impl_->next && state.moments.size() == impl_->moments) return;
  impl_->next = steps + 50, impl_->moments = state.moments.size();
  impl_->buffer.back() = state;  // of the same sizes: nothing allocates
  impl_->buffer.publish();
}
bool Progress::update() {
  return impl_->buffer.update();
}
Result Progress::result() const {
  return resultOf(*impl_->model, impl_->buffer.front());
}
Standing Progress::standing() const {
  const Engine::State& s = impl_->buffer.front();
  const auto& phases = exercise().phases;
  Standing now;
  for (std::size_t i = 0; i < kHands; ++i) now.force[i] = s.tools[i].force;
  if (s.clock.finished != 0 || s.clock.phase >= phases.size()) return now;
  const std::size_t told = toldPhase(*impl_->model, s);
  const Phase& phase = phases[told];
  now.phase = phase.name, now.number = told + 1;
  now.hint = s.clock.hinted != 0;
  const bool waits = s.phases[told].begun == 0 && !phase.wait.empty();
  now.instruction = now.hint ? phase.hint : waits ? phase.wait : phase.instruction;
  return now;
}
const Exercise& Progress::exercise() const {
  return impl_->model->exercise;
}

Engine& addExercise(const Exercise& exercise, simulation::Stage& stage) {
  auto effect = std::make_unique<ExerciseEffect>(exercise, stage.trainer->world(), stage);
  Engine& engine = effect->engine();
  stage.trainer->add(std::move(effect));
  return engine;
}

}  // namespace vest::exercise
