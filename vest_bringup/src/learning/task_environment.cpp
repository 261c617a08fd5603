#include "vest_bringup/learning/environment.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "vest_bringup/simulation/rehearsal.h"
#include "vest_instruments/kinematics/jacobian.h"
#include "vest_tissue/solver/random.h"

namespace vest::learning {
namespace {

using Eigen::Vector3d;
constexpr double kReached = 0.0015;             // m
constexpr double kLift = 0.010;                 // m
constexpr double kRetracted = 0.002;            // m
constexpr double kHoldTime = 0.5;               // s
constexpr double kBeside = 0.004;               // m: a clip or cut farther from its place fails
constexpr double kDry = 0.15;                   // of the pool: what may be left
constexpr double kDrawTime = 1.0, kDraw = 1.0;  // s, N: as the exercise intracorporeal_knot asks
constexpr double kWatched = 2.0;                // s that the target stays in the middle
constexpr double kOffAxis = 0.0873, kView = 0.060,
                 kViewBand = 0.015;  // rad (5°), m, m: off the middle, distance
constexpr double kStitchLow = -0.002,
                 kStitchHigh = 0.004;            // m, in x and in y: where the needle is asked to pierce
constexpr double kSuckDepth = 0.003;             // m: of the tip below the surface, at most
const Vector3d kOverview(0.005, -0.035, 0.135);  // m: where the scripts of these scenes hold the endoscope
const Vector3d kThrowView(0, -0.030, 0.159);     // m: where that of the throw does

Vector3d vec(const std::array<double, 3>& a) {
  return {a[0], a[1], a[2]};
}
std::array<double, 3> arr(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
}  // namespace

TaskEnvironment::TaskEnvironment(std::shared_ptr<const Task> task, int threads)
    : Environment(std::move(task), threads) {}

Vector3d TaskEnvironment::tip() const {
  return kinematics::forwardKinematics(arm().X_BTrocar, state_.joints).translation();
}
scene::ToolInput TaskEnvironment::tool() const {
  return simulation::toolInput(arm(), task_->row.tool, state_.joints);
}
/// Of the tube at the goal; a needle's point.
Vector3d TaskEnvironment::middle() const {
  if (task_->row.both) return leftTip();
  if (task_->row.kind == TaskKind::PassNeedle) {
    const scene::ThreadModel& m = task_->model->threads;
    return m.at(world().state().threads.rod, m.first_point.front());
  }
  const auto& knots = task_->model->objects[task_->object].tube.knots(state_.ring);
  Vector3d sum = Vector3d::Zero();
  for (const auto k : knots) sum += world().knotAt(task_->object, k);
  return sum / static_cast<double>(knots.size());
}
Vector3d TaskEnvironment::shaft(const Vector3d& towards) const {
  return (towards - arm().pivot_B).normalized();
}

/// Where the tip has to go: along the shaft beyond the middle of the tube, once tissue is held with it.
Vector3d TaskEnvironment::goal() const {
  if (task_->row.kind == TaskKind::Reach) return vec(state_.place);
  if (task_->row.kind == TaskKind::Suck) return deepest();
  if (task_->row.kind == TaskKind::CameraFollow) return lookOut();
  if (task_->row.kind == TaskKind::PassNeedle) return tip() + left();
  if (task_->row.both) return rightGoal();
  const Vector3d m = middle();
  return m + task_->row.beyond * shaft(m);
}

/// Where the pool is deepest, below its surface.
Vector3d TaskEnvironment::deepest() const {
  const fluid::Model& model = stage_.field->fluidModel();
  const fluid::Pools& pools = stage_.field->fluid().pools;
  const auto cell = static_cast<std::size_t>(std::max_element(pools.depth.begin(), pools.depth.end()) -
                                             pools.depth.begin());
  const auto columns = static_cast<std::size_t>(model.columns);
  const double size = model.parameters.pool_cell, depth = static_cast<double>(pools.depth[cell]);
  if (depth <= 0) return vec(state_.place);
  return {model.parameters.low[0] + (static_cast<double>(cell % columns) + 0.5) * size,
          model.parameters.low[1] + (static_cast<double>(cell / columns) + 0.5) * size,
          static_cast<double>(pools.bed[cell]) + std::min(0.5 * depth, kSuckDepth)};
}
double TaskEnvironment::pool() const {
  return fluid::poolVolume(stage_.field->fluidModel(), stage_.field->fluid());
}

/// The instrument that the camera follows, after so many actions: three slow waves with the seed's phases.
kinematics::JointPositions TaskEnvironment::followed(std::uint64_t steps) const {
  constexpr Vector3d::Scalar kSize = 0.015;  // m
  const double t = seconds(steps);
  const auto wave = [&](std::size_t axis, double period) {
    return kSize * std::sin(2 * M_PI * t / period + state_.way[axis]);
  };
  const kinematics::TrainerArm& right = task_->box.arm(tools::Instrument::Right);
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = vec(state_.place) + Vector3d(wave(0, 6), wave(1, 8), 0.5 * wave(2, 5));
  return kinematics::inverseKinematics(right.X_BTrocar, at, {}, right.limits).q;
}
Vector3d TaskEnvironment::target() const {
  return kinematics::forwardKinematics(task_->box.arm(tools::Instrument::Right).X_BTrocar,
                                       followed(state_.steps))
      .translation();
}

/// Where the endoscope's tip sees the target in the middle, kView away: the tilt of the optic turns with the
/// shaft, which the pivot turns with the tip.
Vector3d TaskEnvironment::lookOut() const {
  const Vector3d of = target();
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = tip();
  for (int k = 0; k < 12; ++k) {
    const auto joints = kinematics::inverseKinematics(arm().X_BTrocar, at, state_.joints, arm().limits).q;
    at.translation() = of - kView * camera(joints).linear().col(2);
  }
  return at.translation();
}
Eigen::Isometry3d TaskEnvironment::camera() const {
  if (task_->row.kind == TaskKind::CameraFollow) return camera(state_.joints);
  const kinematics::TrainerArm& endoscope = task_->box.arm(tools::Instrument::Endoscope);
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = task_->row.both ? kThrowView : kOverview;
  return camera(kinematics::inverseKinematics(endoscope.X_BTrocar, at, {}, endoscope.limits).q);
}
/// In the middle of the picture, and neither near nor far.
bool TaskEnvironment::watched() const {
  const Vector3d seen = camera().inverse() * target();
  return seen.z() > 0 && seen.head<2>().norm() < std::tan(kOffAxis) * seen.z() &&
         std::fabs(seen.norm() - kView) < kViewBand;
}

/// Where the middle has to go minus where it is.
Vector3d TaskEnvironment::left() const {
  if (task_->row.both) return leftGoal() - leftTip();
  if (task_->row.kind == TaskKind::PassNeedle)
    return vec(state_.place) + (state_.punctured() ? kNeedleWay : Vector3d::Zero().eval()) - middle();
  return vec(state_.place) - task_->row.beyond * shaft(vec(state_.place)) + vec(state_.way) - middle();
}

double TaskEnvironment::held() const {
  return seconds(state_.held);
}

bool TaskEnvironment::passed() const {
  switch (task_->row.kind) {
    case TaskKind::Reach:
      return (goal() - tip()).norm() < kReached;
    case TaskKind::GraspLift:
    case TaskKind::Retract:
      return held() >= kHoldTime;
    case TaskKind::Clip:
      return state_.clipped != 0;
    case TaskKind::Cut:
      return state_.divided != 0;
    case TaskKind::Suck:
      return pool() < kDry * task_->pool;
    case TaskKind::CameraFollow:
      return held() >= kWatched;
    case TaskKind::PassNeedle:
      return state_.divided != 0;
    case TaskKind::TieThrow:
      return held() >= kDrawTime;
  }
  return false;
}

/// 0.3 (reach: all) for the way to the goal, 0.2 for the grasp, 0.5 for the way of the tissue or the deed;
/// 0.2 for the way to the pool, the rest for what is sucked; half for the place of the camera; 0.3 for the
/// needle's way to the pad, 0.4 as it pierces it, 0.5 more for its way through. A throw: throwScore().
double TaskEnvironment::score() const {
  if (state_.failed != 0) return 0;
  if (passed()) return 1;
  if (task_->row.both) return throwScore();
  const double near = std::clamp(1.0 - (goal() - tip()).norm() / state_.distance, 0.0, 1.0);
  if (task_->row.kind == TaskKind::Reach) return 0.9 * near;
  if (task_->row.kind == TaskKind::Clip || task_->row.kind == TaskKind::Cut) return 0.5 * near;
  if (task_->row.kind == TaskKind::Suck)
    return 0.2 * near + 0.7 * std::clamp((1 - pool() / task_->pool) / (1 - kDry), 0.0, 1.0);
  if (task_->row.kind == TaskKind::CameraFollow) return 0.5 * near + 0.4 * held() / kWatched;
  if (task_->row.kind == TaskKind::PassNeedle)
    return state_.punctured() ? 0.4 + 0.5 * std::clamp(1.0 - left().norm() / kNeedleWay.norm(), 0.0, 1.0)
                              : 0.3 * near;
  if (state_.grasping == 0) return 0.3 * near;
  const double way = vec(state_.way).norm();
  return 0.5 + 0.4 * std::clamp(1.0 - left().norm() / way, 0.0, 1.0);
}

void TaskEnvironment::reset(std::uint64_t seed, float* observation) {
  if (task_->start.empty())
    stage_.trainer->reset();
  else
    stage_.trainer->restore(task_->start);
  state_ = State{};
  report_.contacts = {};
  state_.over = 0;
  state_.seed = seed;
  std::uint64_t index = 0;
  const auto uniform = [&](double low, double high) {
    return low + (high - low) * solver::randomUniform(static_cast<std::uint32_t>(seed), seed >> 32, index++);
  };
  if (task_->row.kind == TaskKind::PassNeedle) {
    state_.place =
        arr(kNeedleEntry + Vector3d(uniform(kStitchLow, kStitchHigh), uniform(kStitchLow, kStitchHigh), 0));
    state_.joints = task_->from;
    state_.distance = left().norm();
    state_.score = score();
    observe(observation);
    return;
  }
  const auto ball = [&](double radius) {
    Vector3d v;
    do v = {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)};
    while (v.squaredNorm() > 1);
    return Vector3d(radius * v);
  };
  if (task_->row.both) {
    beginThrow(ball);
    observe(observation);
    return;
  }
  const auto rings = task_->model->objects[task_->object].tube.ringCount();
  state_.ring = static_cast<std::uint64_t>(uniform(0.4, 0.6) * static_cast<double>(rings));
  const TaskRow& row = task_->row;
  const Vector3d centre = middle(), along = shaft(centre);
  Vector3d place = centre + row.beyond * along;
  if (row.kind == TaskKind::Reach) place += ball(0.006) - 0.010 * along;
  if (row.kind == TaskKind::Suck) place = deepest() + Vector3d(0, 0, 0.015) + ball(0.012);
  if (row.kind == TaskKind::CameraFollow) {
    place = centre + Vector3d(0, 0, 0.030);  // m: clear of the tube
    for (double& phase : state_.way) phase = uniform(0, 2 * M_PI);
  }
  state_.place = arr(place);
  if (row.kind == TaskKind::GraspLift) state_.way = {0, 0, kLift};
  if (row.kind == TaskKind::Retract) {
    const double side = uniform(-1, 1);
    state_.way = arr(0.008 * Vector3d(side, std::sqrt(1 - side * side), 0.5).normalized());
  }
  Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
  start.translation() = place - 0.020 * along + ball(0.008);
  if (row.kind == TaskKind::CameraFollow) start.translation() = kOverview + ball(0.015);
  kinematics::JointPositions reference;
  reference.jaw = row.open_jaw;
  reference.roll = row.roll + uniform(-0.1, 0.1);
  const double roll = reference.roll;
  state_.joints = kinematics::inverseKinematics(arm().X_BTrocar, start, reference, arm().limits).q;
  state_.joints.roll = roll;
  state_.distance = std::max((goal() - tip()).norm(), 0.005);
  state_.score = score();
  observe(observation);
}

StepResult TaskEnvironment::step(const float* action, float* observation) {
  if (state_.over != 0) throw std::logic_error("the episode is over, or has not begun: reset it first");
  // An endoscope's jaw is its light post, which stays.
  const bool follows = task_->row.kind == TaskKind::CameraFollow;
  const kinematics::JointPositions from = state_.joints, to = moved(task_->row.hand, from, action, !follows),
                                   left_from = state_.left,
                                   left_to = task_->row.both ? moved(tools::Instrument::Left, left_from,
                                                                     action + kActionSize, true)
                                                             : left_from;
  // Clips are fired by the handle; a sucker does not rinse what it sucks; no task hangs tissue up.
  const std::uint32_t without = tools::kFunctionFire | tools::kFunctionIrrigate | tools::kFunctionSuspend;
  const std::uint32_t functions = on(action[5]) ? control::functionsOf(task_->row.tool) & ~without : 0;
  const kinematics::JointPositions seen_from = follows ? followed(state_.steps) : from,
                                   seen_to = follows ? followed(state_.steps + 1) : from;
  const int skip = task_->options.skip;
  state_.pull = {};
  for (int k = 1; k <= skip; ++k) {
    const double s = static_cast<double>(k) / skip;
    state_.joints = between(from, to, s);
    beginStep();
    input_.tools[hand()] = tool();
    input_.tools[hand()].functions = functions;
    if (task_->row.both) {
      state_.left = between(left_from, left_to, s);
      input_.tools[static_cast<std::size_t>(tools::Instrument::Left)] = leftTool();
    }
    if (follows)
      input_.tools[static_cast<std::size_t>(tools::Instrument::Right)] = simulation::toolInput(
          task_->box.arm(tools::Instrument::Right), tools::ToolKind::Grasper, between(seen_from, seen_to, s));
    bool was_open = state_.was_open != 0;
    simulation::fireByHandle(was_open, input_.tools[hand()]);
    state_.was_open = was_open ? 1 : 0;
    if (stage_.trainer->step(input_, report_) == scene::Status::Fault) state_.failed = 1;
    take(report_);
    for (std::size_t i = 0; i < state_.pull.size(); ++i)
      state_.pull[i] += report_.contacts[i].wrench.head<3>().norm() / skip;
    if (watch_) watch_(input_, report_);
  }
  state_.joints = to, state_.left = left_to;
  ++state_.steps;
  if (task_->row.both) state_.turns = std::max(state_.turns, turns());
  const bool there = follows                ? watched()
                     : task_->row.both      ? drawn() && state_.pull[0] > kDraw && state_.pull[1] > kDraw
                     : state_.grasping == 0 ? false
                     : task_->row.kind == TaskKind::GraspLift ? -left().z() > -kRetracted
                                                              : left().norm() < kRetracted;
  state_.held = there ? state_.held + 1 : 0;
  StepResult result;
  result.score = score();
  result.reward = result.score - state_.score;
  result.passed = state_.failed == 0 && passed();
  result.terminated = state_.failed != 0 || result.passed;
  result.truncated = !result.terminated && seconds(state_.steps) >= task_->limit - 1e-9;
  state_.score = result.score;
  state_.over = result.terminated || result.truncated ? 1 : 0;
  observe(observation);
  return result;
}

void TaskEnvironment::take(const scene::StepReport& report) {
  const scene::ContactModel& contact = report.contacts[hand()];
  state_.force = arr(contact.wrench.head<3>());
  state_.grasping = contact.grasping ? 1 : 0;
  state_.pinch = contact.pinch_force;
  if (task_->row.kind == TaskKind::PassNeedle && !world().state().threads.needle_grips[hand()].active &&
      state_.divided == 0)
    state_.failed = 1;  // lost
  if (task_->row.both) state_.grasping = holds(task_->row.hand) ? 1 : 0;
  for (const scene::Event& e : report.events) {
    if (task_->row.both && e.kind == scene::EventKind::Torn) state_.failed = 1;
    if (e.object != task_->object) continue;
    if (task_->row.kind == TaskKind::PassNeedle) {
      if (e.kind == scene::EventKind::Punctured && !state_.punctured())
        ((e.position - vec(state_.place)).norm() <= kBeside ? state_.clipped : state_.failed) = 1;
      if (e.kind == scene::EventKind::Exited) state_.divided = 1;
      continue;
    }
    const bool clip = e.kind == scene::EventKind::Clipped, divided = e.kind == scene::EventKind::Separated;
    // Where the scene's tube was asked to be treated: stations do not move with it.
    const double beside =
        std::fabs(e.station - task_->model->objects[task_->object].tube.station(state_.ring));
    if (task_->row.kind == TaskKind::Clip && clip) (beside <= kBeside ? state_.clipped : state_.failed) = 1;
    if (task_->row.kind != TaskKind::Cut) continue;
    if (e.kind == scene::EventKind::Cut && beside > 2 * kBeside) state_.failed = 1;
    if (divided) state_.divided = 1;
  }
}

void TaskEnvironment::expert(float* action) const {
  std::fill_n(action, task_->actionSize(), 0.0f);
  if (task_->row.both) return expertThrow(action);
  // What is cut moves; where it is to be cut does not. One cut may leave a rest: the next one is set beside
  // it.
  const bool cuts = task_->row.kind == TaskKind::Cut, follows = task_->row.kind == TaskKind::CameraFollow;
  constexpr std::uint64_t kOpening = 35, kCycle = 125;                // actions
  constexpr std::array<double, 4> kDeeper{0, 0.002, -0.0015, 0.001};  // m
  const Vector3d t = tip(), middle = cuts ? vec(state_.place) : goal(), along = shaft(middle);
  const Vector3d g =
      cuts ? Vector3d(middle + kDeeper[state_.steps / kCycle % kDeeper.size()] * along) : middle;
  const auto go = [&](const Vector3d& way, double share) {
    const Vector3d a = way / kTipStep;
    const double scale = share / std::max(a.norm(), share);
    for (int axis = 0; axis < 3; ++axis) action[axis] = static_cast<float>(scale * a[axis]);
  };
  if (task_->row.kind == TaskKind::Reach) return go(g - t, 1);
  action[3] = static_cast<float>(std::clamp((task_->row.roll - state_.joints.roll) / kTurnStep, -1.0, 1.0));
  if (follows) return go(g - t, 1);
  if (task_->row.kind == TaskKind::PassNeedle) {
    const double when = kNeedleTaken + seconds(state_.steps + 1);
    const trajectory::Waypoint next = trajectory::at(needleMotion(), when);
    action[3] = static_cast<float>(std::clamp((next.roll - state_.joints.roll) / kTurnStep, -1.0, 1.0));
    return go(next.tip + vec(state_.place) - kNeedleEntry - t, 1);
  }
  if (task_->row.kind == TaskKind::Suck) {
    action[5] = 1;
    const Vector3d off = g - t;
    // Aside from above: what hangs in the pool is not pushed about.
    return go(off.head<2>().norm() > 0.004 ? Vector3d(off.x(), off.y(), off.z() + 0.010) : off, 1);
  }
  const auto jaw = [&](double wanted) {
    action[4] = static_cast<float>(std::clamp((wanted - state_.joints.jaw) / kTurnStep, -1.0, 1.0));
  };
  // Blades cut where they meet: slowly.
  const auto closing = [&] { action[4] = task_->row.kind == TaskKind::Cut ? -0.1f : -0.25f; };
  if (state_.grasping != 0) {
    if (state_.joints.jaw > 0.05) return closing();
    const Vector3d way = left();
    return go(task_->row.kind == TaskKind::GraspLift ? Vector3d(way + Vector3d(0, 0, 0.001)) : way, 0.5);
  }
  const Vector3d off = t - g;
  const double depth = off.dot(along);  // m, negative: before the goal
  const double aside = (off - depth * along).norm();
  const bool at_goal = off.norm() < 0.001;
  if (cuts && state_.steps % kCycle >= kOpening) return closing();
  if (!cuts &&
      (at_goal || (aside < 0.002 && state_.joints.jaw < task_->row.open_jaw - 0.06 && depth > -0.003)))
    return closing();
  jaw(task_->row.open_jaw);
  if (aside > 0.001 && depth > -0.012) return go(g - 0.016 * along - t, 1);  // back, then along the shaft
  if (aside > 0.001) return go(-(off - depth * along), 1);
  go(-off, 1);
}

void TaskEnvironment::observe(float* out) const {
  const auto put = [&out](const Vector3d& v, double scale) {
    for (int axis = 0; axis < 3; ++axis) *out++ = static_cast<float>(scale * v[axis]);
  };
  const auto number = [&out](double v) { *out++ = static_cast<float>(v); };
  constexpr double kCm = 100;
  const Vector3d t = tip();
  put(goal() - t, kCm);
  put(t - vec(state_.place), kCm);
  number(state_.joints.roll - task_->row.roll), number(state_.joints.jaw);
  put(vec(state_.force), 1);
  number(static_cast<double>(state_.grasping)), number(state_.pinch);
  put(middle() - t, kCm);
  const bool moves = task_->row.kind == TaskKind::GraspLift || task_->row.kind == TaskKind::Retract ||
                     task_->row.kind == TaskKind::PassNeedle || task_->row.both;
  put(moves ? left() : Vector3d::Zero(), kCm);
  number(state_.score);
  number(1.0 - seconds(state_.steps) / task_->limit);
}

const char* TaskEnvironment::refuse(const void* bytes) const {
  State state;
  std::memcpy(&state, bytes, sizeof state);
  bool finite = state.distance > 0 && std::isfinite(state.pinch + state.distance + state.score + state.turns +
                                                    state.pull[0] + state.pull[1]);
  for (const kinematics::JointPositions& q : {state.joints, state.left})
    finite = finite && std::isfinite(q.yaw + q.pitch + q.insertion + q.roll + q.jaw);
  for (const auto& a : {state.force, state.place, state.way}) finite = finite && vec(a).allFinite();
  const std::size_t rings = task_->model->objects[task_->object].tube.ringCount();
  return finite && state.ring < std::max<std::size_t>(rings, 1) ? nullptr : "it holds numbers out of range";
}

void TaskEnvironment::picture(int width, int height, std::uint8_t* rgb, float* depth) {
  std::vector<scene::ToolInput> tools{tool()};
  if (task_->row.both) tools.push_back(leftTool());
  if (task_->row.kind == TaskKind::CameraFollow)
    tools.push_back(simulation::toolInput(task_->box.arm(tools::Instrument::Right), tools::ToolKind::Grasper,
                                          followed(state_.steps)));
  draw(camera(), tools, width, height, rgb, depth);
}

}  // namespace vest::learning
