#include "vest_bringup/learning/environment.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <xxhash.h>

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
constexpr std::string_view kMagic = "VESTENV3";

Vector3d vec(const std::array<double, 3>& a) {
  return {a[0], a[1], a[2]};
}
std::array<double, 3> arr(const Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}
kinematics::JointPositions between(const kinematics::JointPositions& a, const kinematics::JointPositions& b,
                                   double s) {
  const auto mix = [s](double x, double y) { return x + s * (y - x); };
  return {mix(a.yaw, b.yaw), mix(a.pitch, b.pitch), mix(a.insertion, b.insertion), mix(a.roll, b.roll),
          mix(a.jaw, b.jaw)};
}
double limited(float value) {
  return std::isfinite(value) ? std::clamp(static_cast<double>(value), -1.0, 1.0) : 0.0;
}

}  // namespace

Environment::Environment(std::shared_ptr<const Task> task, int threads)
    : task_(std::move(task)), stage_(task_->stage(threads)) {}

const kinematics::TrainerArm& Environment::arm() const {
  return task_->box.arm(task_->row.hand);
}
Vector3d Environment::tip() const {
  return kinematics::forwardKinematics(arm().X_BTrocar, state_.joints).translation();
}
scene::ToolInput Environment::tool() const {
  return simulation::toolInput(arm(), task_->row.tool, state_.joints);
}
/// Of the tube at the goal; a needle's point.
Vector3d Environment::middle() const {
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
Vector3d Environment::shaft(const Vector3d& towards) const {
  return (towards - arm().pivot_B).normalized();
}

/// Where the tip has to go: along the shaft beyond the middle of the tube, once tissue is held with it.
Vector3d Environment::goal() const {
  if (task_->row.kind == TaskKind::Reach) return vec(state_.place);
  if (task_->row.kind == TaskKind::Suck) return deepest();
  if (task_->row.kind == TaskKind::CameraFollow) return lookOut();
  if (task_->row.kind == TaskKind::PassNeedle) return tip() + left();
  if (task_->row.both) return rightGoal();
  const Vector3d m = middle();
  return m + task_->row.beyond * shaft(m);
}

/// Where the pool is deepest, below its surface.
Vector3d Environment::deepest() const {
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
double Environment::pool() const {
  return fluid::poolVolume(stage_.field->fluidModel(), stage_.field->fluid());
}

/// The instrument that the camera follows, after so many actions: three slow waves with the seed's phases.
kinematics::JointPositions Environment::followed(std::uint64_t steps) const {
  constexpr Vector3d::Scalar kSize = 0.015;  // m
  const double t = static_cast<double>(steps) * task_->options.skip * task_->model->description.dt;
  const auto wave = [&](std::size_t axis, double period) {
    return kSize * std::sin(2 * M_PI * t / period + state_.way[axis]);
  };
  const kinematics::TrainerArm& right = task_->box.arm(tools::Instrument::Right);
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = vec(state_.place) + Vector3d(wave(0, 6), wave(1, 8), 0.5 * wave(2, 5));
  return kinematics::inverseKinematics(right.X_BTrocar, at, {}, right.limits).q;
}
Vector3d Environment::target() const {
  return kinematics::forwardKinematics(task_->box.arm(tools::Instrument::Right).X_BTrocar,
                                       followed(state_.steps))
      .translation();
}

/// Where the endoscope's tip sees the target in the middle, kView away: the tilt of the optic turns with the
/// shaft, which the pivot turns with the tip.
Vector3d Environment::lookOut() const {
  const Vector3d of = target();
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = tip();
  for (int k = 0; k < 12; ++k) {
    const auto joints = kinematics::inverseKinematics(arm().X_BTrocar, at, state_.joints, arm().limits).q;
    at.translation() = of - kView * camera(joints).linear().col(2);
  }
  return at.translation();
}
Eigen::Isometry3d Environment::camera(const kinematics::JointPositions& joints) const {
  const kinematics::TrainerArm& endoscope = task_->box.arm(tools::Instrument::Endoscope);
  return kinematics::forwardKinematics(endoscope.X_BTrocar, joints) *
         kinematics::opticalFrame(endoscope.optic_angle, joints.jaw);
}
Eigen::Isometry3d Environment::camera() const {
  if (task_->row.kind == TaskKind::CameraFollow) return camera(state_.joints);
  const kinematics::TrainerArm& endoscope = task_->box.arm(tools::Instrument::Endoscope);
  Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
  at.translation() = task_->row.both ? kThrowView : kOverview;
  return camera(kinematics::inverseKinematics(endoscope.X_BTrocar, at, {}, endoscope.limits).q);
}
/// In the middle of the picture, and neither near nor far.
bool Environment::watched() const {
  const Vector3d seen = camera().inverse() * target();
  return seen.z() > 0 && seen.head<2>().norm() < std::tan(kOffAxis) * seen.z() &&
         std::fabs(seen.norm() - kView) < kViewBand;
}

/// Where the middle has to go minus where it is.
Vector3d Environment::left() const {
  if (task_->row.both) return leftGoal() - leftTip();
  if (task_->row.kind == TaskKind::PassNeedle)
    return vec(state_.place) + (state_.punctured() ? kNeedleWay : Vector3d::Zero().eval()) - middle();
  return vec(state_.place) - task_->row.beyond * shaft(vec(state_.place)) + vec(state_.way) - middle();
}

double Environment::held() const {
  return static_cast<double>(state_.held) * task_->options.skip * task_->model->description.dt;
}

bool Environment::passed() const {
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
double Environment::score() const {
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

void Environment::reset(std::uint64_t seed, float* observation) {
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

/// Where an action leads a hand.
kinematics::JointPositions Environment::moved(tools::Instrument hand, const kinematics::JointPositions& from,
                                              const float* action) const {
  const kinematics::TrainerArm& arm = task_->box.arm(hand);
  Eigen::Isometry3d wanted = kinematics::forwardKinematics(arm.X_BTrocar, from);
  for (int axis = 0; axis < 3; ++axis) wanted.translation()[axis] += kTipStep * limited(action[axis]);
  kinematics::JointPositions to = kinematics::inverseKinematics(arm.X_BTrocar, wanted, from, arm.limits).q;
  to.roll =
      std::clamp(from.roll + kTurnStep * limited(action[3]), arm.limits.lower.roll, arm.limits.upper.roll);
  // An endoscope's jaw is its light post, which stays.
  if (task_->row.kind != TaskKind::CameraFollow)
    to.jaw =
        std::clamp(from.jaw + kTurnStep * limited(action[4]), arm.limits.lower.jaw, arm.limits.upper.jaw);
  return to;
}

StepResult Environment::step(const float* action, float* observation) {
  if (state_.over != 0) throw std::logic_error("the episode is over, or has not begun: reset it first");
  const kinematics::JointPositions from = state_.joints, to = moved(task_->row.hand, from, action),
                                   left_from = state_.left,
                                   left_to = task_->row.both ? moved(tools::Instrument::Left, left_from,
                                                                     action + kActionSize)
                                                             : left_from;
  // Clips are fired by the handle; a sucker does not rinse what it sucks; no task hangs tissue up.
  const std::uint32_t without = tools::kFunctionFire | tools::kFunctionIrrigate | tools::kFunctionSuspend;
  const std::uint32_t functions =
      limited(action[5]) > 0 ? control::functionsOf(task_->row.tool) & ~without : 0;
  const bool follows = task_->row.kind == TaskKind::CameraFollow;
  const kinematics::JointPositions seen_from = follows ? followed(state_.steps) : from,
                                   seen_to = follows ? followed(state_.steps + 1) : from;
  const int skip = task_->options.skip;
  state_.pull = {};
  for (int k = 1; k <= skip; ++k) {
    const double s = static_cast<double>(k) / skip;
    state_.joints = between(from, to, s);
    input_.impacts.clear(), input_.loads.clear(), input_.dilatations.clear();
    input_.load_over = 0;
    input_.step = world().steps() + 1;
    input_.dt = task_->model->description.dt;
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
  result.truncated =
      !result.terminated &&
      static_cast<double>(state_.steps) * skip * task_->model->description.dt >= task_->limit - 1e-9;
  state_.score = result.score;
  state_.over = result.terminated || result.truncated ? 1 : 0;
  observe(observation);
  return result;
}

void Environment::take(const scene::StepReport& report) {
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

void Environment::expert(float* action) const {
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
    const double when = kNeedleTaken + static_cast<double>(state_.steps + 1) * task_->options.skip *
                                           task_->model->description.dt;
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

void Environment::observe(float* out) const {
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
  number(1.0 - static_cast<double>(state_.steps) * task_->options.skip * task_->model->description.dt /
                   task_->limit);
}

void Environment::save(std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> trainer;
  stage_.trainer->save(trainer);
  bytes.assign(kMagic.begin(), kMagic.end());
  const std::uint64_t kind = static_cast<std::uint64_t>(task_->row.kind);
  const auto append = [&bytes](const void* data, std::size_t count) {
    const auto* const from = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), from, from + count);
  };
  append(&kind, sizeof kind);
  append(&state_, sizeof state_);
  append(trainer.data(), trainer.size());
  const std::uint64_t sum = XXH64(bytes.data(), bytes.size(), 0);
  append(&sum, sizeof sum);
}

void Environment::restore(const std::vector<std::uint8_t>& bytes) {
  const auto refuse = [](const char* what) {
    throw std::invalid_argument(std::string("snapshot of an environment: ") + what);
  };
  constexpr std::size_t kHead = kMagic.size() + sizeof(std::uint64_t) + sizeof(State);
  std::uint64_t kind, sum;
  if (bytes.size() < kHead + sizeof sum || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    refuse("it does not begin as one");
  std::memcpy(&sum, bytes.data() + bytes.size() - sizeof sum, sizeof sum);
  if (sum != XXH64(bytes.data(), bytes.size() - sizeof sum, 0))
    refuse("it does not fit its checksum (damaged, or cut off)");
  std::memcpy(&kind, bytes.data() + kMagic.size(), sizeof kind);
  if (kind != static_cast<std::uint64_t>(task_->row.kind)) refuse("it is of another task");
  State state;
  std::memcpy(&state, bytes.data() + kMagic.size() + sizeof kind, sizeof state);
  bool finite = state.distance > 0 && std::isfinite(state.pinch + state.distance + state.score + state.turns +
                                                    state.pull[0] + state.pull[1]);
  for (const kinematics::JointPositions& q : {state.joints, state.left})
    finite = finite && std::isfinite(q.yaw + q.pitch + q.insertion + q.roll + q.jaw);
  for (const auto& a : {state.force, state.place, state.way}) finite = finite && vec(a).allFinite();
  const std::size_t rings = task_->model->objects[task_->object].tube.ringCount();
  if (!finite || state.ring >= std::max<std::size_t>(rings, 1)) refuse("it holds numbers out of range");
  stage_.trainer->restore(std::vector<std::uint8_t>(bytes.begin() + kHead, bytes.end() - sizeof sum));
  state_ = state;
}

Environments::Environments(const std::shared_ptr<const Task>& task, std::size_t count, int threads)
    : pool_(std::clamp(threads, 1, 64)) {
  if (count < 1 || count > 4096)
    throw std::invalid_argument("environments: " + std::to_string(count) + " (allowed: 1 to 4096)");
  for (std::size_t i = 0; i < count; ++i) all_.push_back(std::make_unique<Environment>(task));
}

void Environments::reset(const std::uint64_t* seeds, float* observations) {
  auto work = [&](std::size_t i) { all_[i]->reset(seeds[i], observations + i * kObservationSize); };
  pool_.each(all_.size(), work);
}

void Environments::step(const float* actions, float* observations, StepResult* results) {
  auto work = [&](std::size_t i) {
    float* const seen = observations + i * kObservationSize;
    results[i] = StepResult{};
    if (all_[i]->over())
      all_[i]->reset(all_[i]->seed() + all_.size(), seen);
    else
      results[i] = all_[i]->step(actions + i * all_[i]->task().actionSize(), seen);
  };
  pool_.each(all_.size(), work);
}

}  // namespace vest::learning
