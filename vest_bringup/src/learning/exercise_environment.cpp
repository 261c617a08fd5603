#include "vest_bringup/learning/exercise_environment.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "vest_bringup/simulation/rehearsal.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_instruments/tools/tool_names.h"
#include "vest_tissue/scene/roles.h"
#include "vest_tissue/solver/random.h"

namespace vest::learning {
namespace {

using Eigen::Vector3d;
using tools::Instrument;

constexpr std::size_t kKnots = 8;       // of each object that an exercise names
constexpr double kStartsAside = 0.003;  // m: how far from the script's place a hand begins, at most (tuned)
constexpr double kCm = 100;
constexpr std::uint32_t kFirst = tools::kFunctionCoagulate | tools::kFunctionSuck,
                        kSecond = tools::kFunctionCut | tools::kFunctionIrrigate;
// Bits of the footswitches of the preset `trainer`, which scripts use.
constexpr unsigned kFirstPedals = 1u | 8u, kSecondPedals = 2u | 4u, kToolPedal = 16u;

std::size_t at(Instrument hand) {
  return static_cast<std::size_t>(hand);
}

/// Objects that a condition names, by name or role.
void gather(const exercise::Condition& c, std::vector<std::pair<std::string, std::string>>& named) {
  named.emplace_back(c.object, c.role);
  named.emplace_back(c.number.object, c.number.role);
  for (const exercise::Condition& child : c.children) gather(child, named);
}

std::vector<std::size_t> objectsOf(const exercise::Exercise& e, const scene::Description& scene) {
  std::vector<std::pair<std::string, std::string>> named;
  for (const auto& phase : e.phases) {
    gather(phase.end, named);
    if (phase.start) gather(*phase.start, named);
  }
  for (const auto& gate : e.gates) gather(gate.condition, named);
  for (const auto& error : e.errors) gather(error.when, named);
  for (const auto& item : e.items) named.emplace_back(item.number.object, item.number.role);
  for (const auto& mark : e.marks) named.emplace_back(mark.object, std::string());
  std::vector<std::size_t> found;
  for (std::size_t o = 0; o < scene.objects.size(); ++o) {
    const scene::Object& object = scene.objects[o];
    if (std::any_of(named.begin(), named.end(), [&](const auto& n) {
          return (!n.first.empty() && n.first == object.name) ||
                 (!n.second.empty() && scene::hasRole(object, n.second));
        }))
      found.push_back(o);
  }
  return found;
}

/// Knots far from each other: each one is the farthest from those before it.
std::vector<std::size_t> spread(const std::vector<Vector3d>& knots) {
  std::vector<std::size_t> chosen;
  std::vector<double> near(knots.size(), std::numeric_limits<double>::infinity());
  for (std::size_t next = 0; chosen.size() < std::min(kKnots, knots.size());) {
    chosen.push_back(next);
    for (std::size_t k = 0; k < knots.size(); ++k)
      near[k] = std::min(near[k], (knots[k] - knots[next]).squaredNorm());
    next = static_cast<std::size_t>(std::max_element(near.begin(), near.end()) - near.begin());
  }
  return chosen;
}

std::vector<Vector3d> knotsOf(const scene::World& world, std::size_t object) {
  std::vector<Vector3d> knots;
  for (std::size_t k = 0; k < world.knotCount(object); ++k) knots.push_back(world.knotAt(object, k));
  return knots;
}

Vector3d placeOf(const Landmark& l, const scene::World& world) {
  return l.object == Landmark::kStands ? l.at : Vector3d(world.knotAt(l.object, l.knot) + l.at);
}

void addLandmarks(Task& task, const scene::World& world) {
  const exercise::Exercise& e = *task.exercise;
  const auto& objects = task.model->description.objects;
  const auto told = [&](const std::string& name) {
    for (const char* const axis : {"x", "y", "z"}) task.names.push_back(name + ", " + axis + " (cm)");
  };
  for (const exercise::Mark& mark : e.marks) {
    Landmark l;
    l.at = mark.at;
    for (std::size_t o = 0; o < objects.size() && !mark.object.empty(); ++o) {
      if (objects[o].name != mark.object) continue;
      const std::vector<Vector3d> knots = knotsOf(world, o);
      Vector3d place = mark.at;
      if (mark.middle) {
        place.setZero();
        for (const Vector3d& knot : knots) place += knot / static_cast<double>(knots.size());
      }
      l.object = o;
      l.knot = static_cast<std::size_t>(std::min_element(knots.begin(), knots.end(),
                                                         [&](const Vector3d& a, const Vector3d& b) {
                                                           return (a - place).squaredNorm() <
                                                                  (b - place).squaredNorm();
                                                         }) -
                                        knots.begin());
      l.at = place - knots[l.knot];
    }
    task.landmarks.push_back(l);
    told("mark " + mark.name);
  }
  for (const std::size_t o : objectsOf(e, task.model->description)) {
    for (const std::size_t knot : spread(knotsOf(world, o))) {
      task.landmarks.push_back({o, knot, Vector3d::Zero()});
      told(objects[o].name + "[" + std::to_string(knot) + "]");
    }
  }
}

}  // namespace

void prepareExercise(Task& task) {
  const TaskOptions& o = task.options;
  auto e = std::make_shared<const exercise::Exercise>(exercise::loadExercise(o.task));
  if (o.vessels.empty()) throw std::invalid_argument(o.task + ": an exercise needs the vessels' database");
  task.exercise = e;
  task.limit = o.limit > 0 ? std::min(o.limit, e->limit) : e->limit;
  task.box.arms[at(Instrument::Endoscope)].optic_angle = e->optic * exercise::kDegree;
  task.script = trajectory::fromWaypoints(e->pass_script.file, task.box);
  for (const Instrument hand : {Instrument::Right, Instrument::Left, Instrument::Third})
    if (!e->tools[at(hand)].empty()) task.hands.push_back(hand);
  task.hands.push_back(Instrument::Endoscope);
  for (const Instrument hand : task.hands) {
    const std::string name(tools::instrumentName(hand));
    for (const char* const what :
         {" yaw (rad)", " pitch (rad)", " insertion (cm)", " roll (rad)", " jaw (rad)", " tip, x (cm)",
          " tip, y (cm)", " tip, z (cm)", " attitude, x", " attitude, y", " attitude, z", " attitude, w",
          " force, x (N)", " force, y (N)", " force, z (N)", " pinch (N)", " holds (0, 1)", " tool"})
      task.names.push_back(name + what);
  }
  simulation::Stage stage = task.stage(1);
  exercise::addExercise(*e, stage);  // refuses here what an environment would
  addLandmarks(task, stage.trainer->world());
  for (const char* const what :
       {"phases done (0 to 1)", "quality (0 to 1)", "score (0 to 1)", "time left (0 to 1)"})
    task.names.emplace_back(what);
}

ExerciseEnvironment::ExerciseEnvironment(std::shared_ptr<const Task> task, int threads)
    : Environment(std::move(task), threads), engine_(&exercise::addExercise(*task_->exercise, stage_)) {}

tools::ToolKind ExerciseEnvironment::kind(Instrument hand) const {
  if (hand == Instrument::Endoscope) return tools::ToolKind::Endoscope;
  return task_->exercise->tools[at(hand)][state_.hands[at(hand)].tool];
}

scene::ToolInput ExerciseEnvironment::tool(Instrument hand) const {
  return simulation::toolInput(arm(hand), kind(hand), state_.hands[at(hand)].joints);
}

void ExerciseEnvironment::reset(std::uint64_t seed, float* observation) {
  stage_.trainer->reset();
  state_ = State{};
  state_.seed = seed, state_.over = 0;
  report_.contacts = {};
  std::uint64_t index = 0;
  const auto uniform = [&] {
    return 2 * solver::randomUniform(static_cast<std::uint32_t>(seed), seed >> 32, index++) - 1;
  };
  for (const Instrument hand : task_->hands) {
    kinematics::JointPositions& joints = state_.hands[at(hand)].joints;
    const kinematics::TrainerArm& own = arm(hand);
    if (task_->script.moves[at(hand)]) {
      joints = task_->script.rows.front().joints[at(hand)];
    } else {
      Eigen::Isometry3d wanted = Eigen::Isometry3d::Identity();
      wanted.translation() = 0.5 * (own.aim_B + own.pivot_B);
      joints = kinematics::inverseKinematics(own.X_BTrocar, wanted, {}, own.limits).q;
    }
    if (hand == Instrument::Endoscope) continue;
    Vector3d off(uniform(), uniform(), uniform());
    Eigen::Isometry3d wanted = kinematics::forwardKinematics(own.X_BTrocar, joints);
    wanted.translation() += kStartsAside / std::sqrt(3.0) * off;
    joints = kinematics::inverseKinematics(own.X_BTrocar, wanted, joints, own.limits).q;
  }
  take(engine_->result());
  observe(observation);
}

void ExerciseEnvironment::take(const exercise::Result& now) {
  state_.quality = now.quality / 100;
  const double done =
      static_cast<double>(engine_->phasesDone()) / static_cast<double>(task_->exercise->phases.size());
  state_.score = now.finished && !now.passed ? 0 : done * (1 + state_.quality) / 2;
}

StepResult ExerciseEnvironment::step(const float* action, float* observation) {
  if (state_.over != 0) throw std::logic_error("the episode is over, or has not begun: reset it first");
  std::array<kinematics::JointPositions, tools::kInstrumentCount> from{}, to{};
  std::array<std::uint32_t, tools::kInstrumentCount> functions{};
  for (std::size_t k = 0; k < task_->hands.size(); ++k) {
    const Instrument hand = task_->hands[k];
    const float* const wanted = action + k * kExerciseActionSize;
    Hand& h = state_.hands[at(hand)];
    const std::uint64_t next = on(wanted[7]) ? 1 : 0;
    const std::size_t tools = hand == Instrument::Endoscope ? 1 : task_->exercise->tools[at(hand)].size();
    if (next > h.next) h.tool = (h.tool + 1) % tools;
    h.next = next;
    from[at(hand)] = h.joints, to[at(hand)] = moved(hand, h.joints, wanted, true);
    functions[at(hand)] =
        control::functionsOf(kind(hand)) & ((on(wanted[5]) ? kFirst : 0) | (on(wanted[6]) ? kSecond : 0));
  }
  const int skip = task_->options.skip;
  bool fault = false;
  for (int k = 1; k <= skip && !engine_->finished() && !fault; ++k) {
    beginStep();
    for (const Instrument hand : task_->hands) {
      Hand& h = state_.hands[at(hand)];
      h.joints = between(from[at(hand)], to[at(hand)], static_cast<double>(k) / skip);
      scene::ToolInput& input = input_.tools[at(hand)];
      input = tool(hand);
      input.functions = functions[at(hand)];
      bool was_open = h.was_open != 0;
      simulation::fireByHandle(was_open, input);
      h.was_open = was_open ? 1 : 0;
    }
    fault = stage_.trainer->step(input_, report_) == scene::Status::Fault;
    if (watch_) watch_(input_, report_);
  }
  for (const Instrument hand : task_->hands) {
    Hand& h = state_.hands[at(hand)];
    const scene::ContactModel& contact = report_.contacts[at(hand)];
    for (int axis = 0; axis < 3; ++axis) h.force[static_cast<std::size_t>(axis)] = contact.wrench[axis];
    h.pinch = contact.pinch_force, h.holds = contact.grasping ? 1 : 0;
  }
  ++state_.steps;
  const exercise::Result now = engine_->result();
  StepResult result;
  const double before = state_.score;
  take(now);
  if (fault) state_.score = 0;
  result.score = state_.score;
  result.reward = result.score - before;
  result.passed = !fault && now.finished && now.passed;
  result.terminated = fault || now.finished;
  result.truncated = !result.terminated && seconds(state_.steps) >= task_->limit - 1e-9;
  state_.over = result.terminated || result.truncated ? 1 : 0;
  observe(observation);
  return result;
}

void ExerciseEnvironment::expert(float* action) const {
  std::fill_n(action, task_->actionSize(), 0.0f);
  const double then = seconds(state_.steps + 1);
  const unsigned pedals = simulation::footswitches(task_->script, seconds(state_.steps), then);
  for (std::size_t k = 0; k < task_->hands.size(); ++k) {
    const Instrument hand = task_->hands[k];
    float* const a = action + k * kExerciseActionSize;
    if (!task_->script.moves[at(hand)]) continue;
    const kinematics::JointPositions& now = state_.hands[at(hand)].joints;
    const kinematics::JointPositions next = simulation::jointsAt(task_->script, hand, then);
    const auto tip = [&](const kinematics::JointPositions& q) {
      return Vector3d(kinematics::forwardKinematics(arm(hand).X_BTrocar, q).translation());
    };
    const auto put = [](float& to, double value) { to = static_cast<float>(std::clamp(value, -1.0, 1.0)); };
    const Vector3d way = tip(next) - tip(now);
    const double most = std::max(1.0, way.cwiseAbs().maxCoeff() / kTipStep);
    for (int axis = 0; axis < 3; ++axis) put(a[axis], way[axis] / kTipStep / most);
    put(a[3], (next.roll - now.roll) / kTurnStep);
    put(a[4], (next.jaw - now.jaw) / kTurnStep);
    a[5] = (pedals & kFirstPedals) != 0 ? 1 : -1;
    a[6] = (pedals & kSecondPedals) != 0 ? 1 : -1;
    const bool right = hand == Instrument::Right;
    a[7] = right && (pedals & kToolPedal) != 0 ? 1 : -1;
  }
}

void ExerciseEnvironment::observe(float* out) const {
  const auto number = [&out](double v) { *out++ = static_cast<float>(v); };
  const auto place = [&](const Vector3d& v) {
    for (int axis = 0; axis < 3; ++axis) number(kCm * v[axis]);
  };
  for (const Instrument hand : task_->hands) {
    const Hand& h = state_.hands[at(hand)];
    const scene::ToolInput now = tool(hand);
    number(h.joints.yaw), number(h.joints.pitch), number(kCm * h.joints.insertion);
    number(h.joints.roll), number(h.joints.jaw);
    place(now.position);
    for (int i = 0; i < 4; ++i) number(now.orientation.coeffs()[i]);
    for (const double f : h.force) number(f);
    number(h.pinch), number(static_cast<double>(h.holds)), number(static_cast<double>(now.tool));
  }
  for (const Landmark& l : task_->landmarks) place(placeOf(l, world()));
  number(static_cast<double>(engine_->phasesDone()) / static_cast<double>(task_->exercise->phases.size()));
  number(state_.quality);
  number(state_.score);
  number(std::max(0.0, 1 - seconds(state_.steps) / task_->limit));
}

void ExerciseEnvironment::picture(int width, int height, std::uint8_t* rgb, float* depth) {
  std::vector<scene::ToolInput> all;
  for (const Instrument hand : task_->hands) all.push_back(tool(hand));
  draw(camera(state_.hands[at(Instrument::Endoscope)].joints), all, width, height, rgb, depth);
}

std::string ExerciseEnvironment::result() const {
  return exercise::toJson(*task_->exercise, engine_->result());
}

const char* ExerciseEnvironment::refuse(const void* bytes) const {
  State s;
  std::memcpy(&s, bytes, sizeof s);
  bool good = std::isfinite(s.score + s.quality);
  for (const Hand& h : s.hands) {
    const auto& q = h.joints;
    good = good && std::isfinite(q.yaw + q.pitch + q.insertion + q.roll + q.jaw + h.pinch + h.force[0] +
                                 h.force[1] + h.force[2]);
  }
  for (const Instrument hand : task_->hands)
    good = good && s.hands[at(hand)].tool <
                       (hand == Instrument::Endoscope ? 1 : task_->exercise->tools[at(hand)].size());
  return good ? nullptr : "it holds numbers out of range";
}

}  // namespace vest::learning
