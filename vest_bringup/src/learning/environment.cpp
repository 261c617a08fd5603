#include "vest_bringup/learning/environment.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include <xxhash.h>

#include "vest_bringup/learning/exercise_environment.h"
#include "vest_instruments/kinematics/jacobian.h"

namespace vest::learning {
namespace {

constexpr std::string_view kMagic = "VESTENV3";

double limited(float value) {
  return std::isfinite(value) ? std::clamp(static_cast<double>(value), -1.0, 1.0) : 0.0;
}

}  // namespace

Environment::Environment(std::shared_ptr<const Task> task, int threads)
    : task_(std::move(task)), stage_(task_->stage(threads)) {}

double Environment::seconds(std::uint64_t actions) const {
  return static_cast<double>(actions) * task_->options.skip * task_->model->description.dt;
}

bool Environment::on(float number) {
  return limited(number) > 0;
}

void Environment::beginStep() {
  input_.impacts.clear(), input_.loads.clear(), input_.dilatations.clear();
  input_.load_over = 0;
  input_.step = world().steps() + 1;
  input_.dt = task_->model->description.dt;
}

kinematics::JointPositions Environment::between(const kinematics::JointPositions& a,
                                                const kinematics::JointPositions& b, double s) {
  const auto mix = [s](double x, double y) { return x + s * (y - x); };
  return {mix(a.yaw, b.yaw), mix(a.pitch, b.pitch), mix(a.insertion, b.insertion), mix(a.roll, b.roll),
          mix(a.jaw, b.jaw)};
}

Eigen::Isometry3d Environment::camera(const kinematics::JointPositions& joints) const {
  const kinematics::TrainerArm& endoscope = arm(tools::Instrument::Endoscope);
  return kinematics::forwardKinematics(endoscope.X_BTrocar, joints) *
         kinematics::opticalFrame(endoscope.optic_angle, joints.jaw);
}

kinematics::JointPositions Environment::moved(tools::Instrument hand, const kinematics::JointPositions& from,
                                              const float* action, bool jaw) const {
  const kinematics::TrainerArm& arm = this->arm(hand);
  Eigen::Isometry3d wanted = kinematics::forwardKinematics(arm.X_BTrocar, from);
  for (int axis = 0; axis < 3; ++axis) wanted.translation()[axis] += kTipStep * limited(action[axis]);
  kinematics::JointPositions to = kinematics::inverseKinematics(arm.X_BTrocar, wanted, from, arm.limits).q;
  const auto turned = [&](double angle, float by, double low, double high) {
    return std::clamp(angle + kTurnStep * limited(by), low, high);
  };
  to.roll = turned(from.roll, action[3], arm.limits.lower.roll, arm.limits.upper.roll);
  if (jaw) to.jaw = turned(from.jaw, action[4], arm.limits.lower.jaw, arm.limits.upper.jaw);
  return to;
}

void Environment::save(std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> trainer;
  stage_.trainer->save(trainer);
  bytes.assign(kMagic.begin(), kMagic.end());
  const std::uint64_t kind = task_->number();
  const auto [own, size] = state();
  const auto append = [&bytes](const void* data, std::size_t count) {
    const auto* const from = static_cast<const std::uint8_t*>(data);
    bytes.insert(bytes.end(), from, from + count);
  };
  append(&kind, sizeof kind);
  append(own, size);
  append(trainer.data(), trainer.size());
  const std::uint64_t sum = XXH64(bytes.data(), bytes.size(), 0);
  append(&sum, sizeof sum);
}

void Environment::restore(const std::vector<std::uint8_t>& bytes) {
  const auto refused = [](const char* what) {
    throw std::invalid_argument(std::string("snapshot of an environment: ") + what);
  };
  const auto [own, size] = state();
  const std::size_t head = kMagic.size() + sizeof(std::uint64_t) + size;
  std::uint64_t kind, sum;
  if (bytes.size() < head + sizeof sum || std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) != 0)
    refused("it does not begin as one");
  std::memcpy(&sum, bytes.data() + bytes.size() - sizeof sum, sizeof sum);
  if (sum != XXH64(bytes.data(), bytes.size() - sizeof sum, 0))
    refused("it does not fit its checksum (damaged, or cut off)");
  std::memcpy(&kind, bytes.data() + kMagic.size(), sizeof kind);
  if (kind != task_->number()) refused("it is of another task");
  const std::uint8_t* const from = bytes.data() + kMagic.size() + sizeof kind;
  if (const char* const wrong = refuse(from)) refused(wrong);
  stage_.trainer->restore(
      std::vector<std::uint8_t>(bytes.begin() + static_cast<std::ptrdiff_t>(head), bytes.end() - sizeof sum));
  std::memcpy(own, from, size);
  restored();
}

std::unique_ptr<Environment> makeEnvironment(const std::shared_ptr<const Task>& task, int threads) {
  if (task->exercise) return std::make_unique<ExerciseEnvironment>(task, threads);
  return std::make_unique<TaskEnvironment>(task, threads);
}

Environments::Environments(const std::shared_ptr<const Task>& task, std::size_t count, int threads)
    : pool_(std::clamp(threads, 1, 64)) {
  if (count < 1 || count > 4096)
    throw std::invalid_argument("environments: " + std::to_string(count) + " (allowed: 1 to 4096)");
  for (std::size_t i = 0; i < count; ++i) all_.push_back(makeEnvironment(task));
}

void Environments::reset(const std::uint64_t* seeds, float* observations) {
  auto work = [&](std::size_t i) {
    all_[i]->reset(seeds[i], observations + i * all_[i]->task().observationSize());
  };
  pool_.each(all_.size(), work);
}

void Environments::step(const float* actions, float* observations, StepResult* results) {
  auto work = [&](std::size_t i) {
    float* const seen = observations + i * all_[i]->task().observationSize();
    results[i] = StepResult{};
    if (all_[i]->over())
      all_[i]->reset(all_[i]->seed() + all_.size(), seen);
    else
      results[i] = all_[i]->step(actions + i * all_[i]->task().actionSize(), seen);
  };
  pool_.each(all_.size(), work);
}

}  // namespace vest::learning
