#include <algorithm>
#include <cmath>

#include "vest_bringup/learning/environment.h"
#include "vest_bringup/simulation/rehearsal.h"

// The task tie_throw: both hands. Which knot lies in the thread is told by the World from its crossings.

namespace vest::learning {
namespace {

using Eigen::Vector3d;
using tools::Instrument;

constexpr double kStart = 0.008;  // m: how far from the script's place a hand begins
constexpr double kTurns = 2;      // of a surgeon's throw
constexpr double kLaid = 1.7;     // turns with which the right hand goes for the short end
constexpr double kRound = 0.030;  // m: radius on which the left hand goes round
constexpr double kBehind = 0.060,
                 kAhead = 0.005;  // m along the right instrument, from its tip: where turns lie
constexpr double kAside = 0.030;  // m from its axis, at most
// m of thread from either end: where the scripts take it.
constexpr double kLongEnd = 0.006, kShortEnd = 0.006;

const trajectory::Waypoint& last(Instrument hand) {
  return throwMotion()[static_cast<std::size_t>(hand)].back();
}

}  // namespace

scene::ToolInput TaskEnvironment::leftTool() const {
  return simulation::toolInput(task_->box.arm(Instrument::Left), tools::ToolKind::Grasper, state_.left);
}

Vector3d TaskEnvironment::leftTip() const {
  return kinematics::forwardKinematics(task_->box.arm(Instrument::Left).X_BTrocar, state_.left).translation();
}

bool TaskEnvironment::holds(Instrument hand) const {
  return world().state().threads.grips[static_cast<std::size_t>(hand)].active;
}

bool TaskEnvironment::tied() const {
  const auto& knots = world().state().threads.knots;
  return std::any_of(knots.begin(), knots.end(), [](const auto& k) { return k.kind.determinant > 2; });
}

bool TaskEnvironment::drawn() const {
  const auto& knots = world().state().threads.knots;
  return std::any_of(knots.begin(), knots.end(),
                     [](const auto& k) { return k.kind.determinant > 2 && k.drawn; });
}

/// Of the thread round the right instrument behind its point, as angle about its axis; either way counts.
double TaskEnvironment::turns() const {
  const scene::ToolInput right = tool();
  const Eigen::Quaterniond to_tip = right.orientation.conjugate();
  const auto& s = world().state().threads.rod;
  const suture::Strand& strand = task_->model->threads.rods->strands.front();
  double angle = 0, before = 0;
  bool inside = false;
  for (suture::Index i = 0; i < strand.nodes; ++i) {
    const Vector3d p = to_tip * (s.position[strand.first + i] - right.position);
    const bool here = p.z() > -kBehind && p.z() < kAhead && p.head<2>().norm() < kAside;
    const double now = std::atan2(p.y(), p.x());
    if (here && inside) angle += std::remainder(now - before, 2 * M_PI);
    inside = here, before = now;
  }
  return std::fabs(angle) / (2 * M_PI);
}

/// To the long end; with it round the right instrument; then to where the throw is drawn.
Vector3d TaskEnvironment::leftGoal() const {
  const auto& s = world().state().threads.rod;
  const suture::Strand& strand = task_->model->threads.rods->strands.front();
  if (!holds(Instrument::Left)) {
    const auto node =
        static_cast<suture::Index>(kLongEnd / task_->model->threads.rods->length[strand.first] + 0.5);
    return s.position[strand.first + std::min(node, strand.nodes - 1)];
  }
  if (holds(Instrument::Right)) return last(Instrument::Left).tip;
  const scene::ToolInput right = tool();
  if (state_.turns >= kLaid) return leftTip();
  const Vector3d axis = right.orientation * Vector3d::UnitZ();
  Vector3d from = leftTip() - right.position;
  from -= from.dot(axis) * axis;
  return right.position + kRound * (Eigen::AngleAxisd(1.0, axis) * from.normalized());
}

/// To where the turns are laid, through them to the short end, and back with it.
Vector3d TaskEnvironment::rightGoal() const {
  const auto& s = world().state().threads.rod;
  const suture::Strand& strand = task_->model->threads.rods->strands.front();
  if (holds(Instrument::Right)) return last(Instrument::Right).tip;
  if (state_.turns < kLaid) return throwMotion()[1][2].tip;
  const auto node =
      static_cast<suture::Index>(kShortEnd / task_->model->threads.rods->length[strand.first] + 0.5);
  return s.position[strand.first + strand.nodes - 1 - std::min(node, strand.nodes - 1)];
}

/// 0.1 for the left hand's way to the long end, 0.1 as it holds it, 0.2 for the turns that it lays, 0.1 as
/// the right one holds the short end, 0.15 as the hands draw apart then; 0.7 with a knot in the thread, 0.8
/// as it is drawn, up to 0.95 with the time for which both hands pull.
double TaskEnvironment::throwScore() const {
  if (drawn()) return 0.8 + 0.15 * std::min(1.0, held());
  if (tied()) return 0.7;
  if (!holds(Instrument::Left)) return 0.1 * std::clamp(1.0 - left().norm() / state_.distance, 0.0, 1.0);
  const double laid = 0.2 + 0.2 * std::min(1.0, state_.turns / kTurns);
  if (!holds(Instrument::Right)) return laid;
  const double apart = (last(Instrument::Left).tip - last(Instrument::Right).tip).norm();
  return laid + 0.1 + 0.15 * std::min(1.0, (leftTip() - tip()).norm() / apart);
}

/// Both hands begin near the script's places, a little turned.
void TaskEnvironment::beginThrow(const std::function<Vector3d(double)>& ball) {
  for (const Instrument hand : {Instrument::Left, Instrument::Right}) {
    const kinematics::TrainerArm& arm = task_->box.arm(hand);
    const trajectory::Waypoint begin =
        trajectory::at(throwMotion()[static_cast<std::size_t>(hand)], kThrowBegins);
    Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
    at.translation() = begin.tip + ball(kStart);
    auto& joints = hand == Instrument::Left ? state_.left : state_.joints;
    joints = kinematics::inverseKinematics(arm.X_BTrocar, at, {}, arm.limits).q;
    joints.roll = begin.roll + ball(0.1).x(), joints.jaw = begin.jaw;
  }
  state_.place = {rightGoal().x(), rightGoal().y(), rightGoal().z()};
  state_.distance = std::max(left().norm(), 0.005);
  state_.score = score();
}

/// The script of the scene, by time; each hand goes back to it from where it begins.
void TaskEnvironment::expertThrow(float* action) const {
  const double t = kThrowBegins +
                   static_cast<double>(state_.steps + 1) * task_->options.skip * task_->model->description.dt;
  const auto follow = [&](Instrument hand, const Vector3d& tip, const kinematics::JointPositions& joints,
                          float* to) {
    const trajectory::Waypoint next = trajectory::at(throwMotion()[static_cast<std::size_t>(hand)], t);
    const Vector3d way = (next.tip - tip) / kTipStep;
    const double share = 1 / std::max(1.0, way.norm());
    for (int axis = 0; axis < 3; ++axis) to[axis] = static_cast<float>(share * way[axis]);
    to[3] = static_cast<float>(std::clamp((next.roll - joints.roll) / kTurnStep, -1.0, 1.0));
    to[4] = static_cast<float>(std::clamp((next.jaw - joints.jaw) / kTurnStep, -1.0, 1.0));
  };
  follow(Instrument::Right, tip(), state_.joints, action);
  follow(Instrument::Left, leftTip(), state_.left, action + kActionSize);
}

}  // namespace vest::learning
