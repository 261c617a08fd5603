#include "vest_bringup/learning/environment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "vest_bringup/simulation/rehearsal.h"

namespace vest::learning {

const std::vector<TaskRow>& tasks() {
  using tools::Instrument;
  using tools::ToolKind;
  constexpr double kAcross = 0.77;
  // How far the tip goes beyond the middle, and the opening: as the scripts of these scenes have them.
  static const std::vector<TaskRow> rows{
      {TaskKind::Reach, "reach", "grasp_tube", "tube", Instrument::Right, ToolKind::Grasper, kAcross, -0.008,
       0.0, 4},
      {TaskKind::GraspLift, "grasp_lift", "grasp_tube", "tube", Instrument::Right, ToolKind::Grasper, kAcross,
       0.006, 0.9, 10},
      {TaskKind::Retract, "retract", "grasp_tube", "tube", Instrument::Right, ToolKind::Grasper, kAcross,
       0.006, 0.9, 10},
      {TaskKind::Clip, "clip", "clip_tube", "vessel", Instrument::Right, ToolKind::ClipApplier, kAcross,
       0.0045, 0.6, 10},
      {TaskKind::Cut, "cut", "cut_tube", "tube", Instrument::Right, ToolKind::Scissors, kAcross, 0.0065, 0.75,
       15},
      {TaskKind::Suck, "suck", "irrigation_pool", "tube", Instrument::Right, ToolKind::SuctionIrrigator, 0, 0,
       0, 20},
      {TaskKind::CameraFollow, "camera_follow", "grasp_tube", "tube", Instrument::Endoscope,
       ToolKind::Endoscope, 0, 0, 0, 10},
      {TaskKind::PassNeedle, "pass_needle", "suture_pad", "pad", Instrument::Right, ToolKind::NeedleHolder,
       -3.493, 0, 0, 15},
      {TaskKind::TieThrow, "tie_throw", "thread_throw", "post", Instrument::Right, ToolKind::NeedleHolder,
       0.261, 0, 0, 60, true},
  };
  return rows;
}

std::string taskNames() {
  std::string all;
  for (const TaskRow& row : tasks()) all.append(all.empty() ? "" : ", ").append(row.name);
  return all;
}

simulation::Stage Task::stage(int threads) const {
  simulation::StageOptions with;
  if (exercise) {
    with.blood.vessels = options.vessels;
    with.field_options.fluid.spacing = 0.003;  // m, as of trainer.launch
    simulation::apply(script.effects, with);
    return simulation::makeStage(scene::World(model, threads), with);
  }
  with.haemodynamics = with.surface_bleeding = with.field = !options.vessels.empty();
  with.field = with.field || row.kind == TaskKind::Suck;
  with.blood.vessels = options.vessels;
  with.field_options.fluid.spacing = 0.003;  // m, as of trainer.launch
  return simulation::makeStage(scene::World(model, threads), with);
}

std::uint64_t Task::number() const {
  return exercise ? std::stoull(exercise->hash, nullptr, 16) : static_cast<std::uint64_t>(row.kind);
}

std::size_t Task::actionSize() const {
  if (exercise) return hands.size() * kExerciseActionSize;
  return row.both ? 2 * kActionSize : kActionSize;
}

namespace {

/// Steps a Trainer of the task until `seconds` of simulated time are over and keeps it for the episodes.
/// `act` fills the input, given the s at the end of the step.
template <class Act>
simulation::Stage prepare(Task& task, double seconds, Act act) {
  simulation::Stage stage = task.stage(1);
  scene::StepInput input;
  scene::StepReport report;
  const double dt = task.model->description.dt;
  const int steps = static_cast<int>(seconds / dt + 0.5);
  for (int k = 0; k < steps; ++k) {
    input.impacts.clear(), input.loads.clear(), input.dilatations.clear();
    input.load_over = 0;
    input.step = stage.trainer->world().steps() + 1;
    input.dt = dt;
    act(input, (k + 1) * dt);
    stage.trainer->step(input, report);
  }
  stage.trainer->save(task.start);
  return stage;
}

/// The hand takes the needle from its tray and holds it before the pad.
void takeNeedle(Task& task) {
  if (task.model->threads.first_point.empty())
    throw std::invalid_argument(task.options.scene + ": task pass_needle needs a suture with a needle");
  const kinematics::TrainerArm& arm = task.box.arm(task.row.hand);
  const auto hand = static_cast<std::size_t>(task.row.hand);
  const simulation::Stage stage = prepare(task, kNeedleTaken, [&](scene::StepInput& input, double t) {
    const trajectory::Waypoint now = trajectory::at(needleMotion(), t);
    Eigen::Isometry3d wanted = Eigen::Isometry3d::Identity();
    wanted.translation() = now.tip;
    task.from = kinematics::inverseKinematics(arm.X_BTrocar, wanted, {}, arm.limits).q;
    task.from.roll = now.roll, task.from.jaw = now.jaw;
    input.tools[hand] = simulation::toolInput(arm, task.row.tool, task.from);
  });
  const auto& grips = stage.trainer->world().state().threads.needle_grips;
  if (!grips[hand].active)
    throw std::invalid_argument(task.options.scene +
                                ": task pass_needle: the needle does not lie where its script takes it");
}

/// Water from above into the hollow, and a second to come to rest.
void rinse(Task& task) {
  constexpr double kRinse = 2.2, kRest = 1.0;  // s: 110 ml at the irrigator's flow
  const kinematics::TrainerArm& arm = task.box.arm(task.row.hand);
  Eigen::Isometry3d over = Eigen::Isometry3d::Identity();
  over.translation() = Eigen::Vector3d(0.030, 0.024, 0.075);  // m, as in the script of this scene
  const auto joints = kinematics::inverseKinematics(arm.X_BTrocar, over, {}, arm.limits).q;
  const simulation::Stage stage = prepare(task, kRinse + kRest, [&](scene::StepInput& input, double t) {
    scene::ToolInput& tool = input.tools[static_cast<std::size_t>(task.row.hand)];
    tool = simulation::toolInput(arm, task.row.tool, joints);
    tool.functions = t < kRinse + 1e-9 ? static_cast<std::uint32_t>(tools::kFunctionIrrigate) : 0;
  });
  task.pool = fluid::poolVolume(stage.field->fluidModel(), stage.field->fluid());
  if (!(task.pool > 1e-5))
    throw std::invalid_argument(task.options.scene +
                                ": task suck needs a hollow that holds more than 10 ml (" +
                                std::to_string(1e6 * task.pool) + " ml stand there)");
}

/// The thread comes to rest.
void settle(Task& task) {
  if (!task.model->threads.rods || task.model->threads.rods->strands.front().closed)
    throw std::invalid_argument(task.options.scene + ": task tie_throw needs a suture with two ends");
  prepare(task, kThrowBegins, [](scene::StepInput&, double) {});
}

// As environment.h lists them.
constexpr std::array<const char*, kObservationSize> kObservationNames{"goal - tip, x (cm)",
                                                                      "goal - tip, y (cm)",
                                                                      "goal - tip, z (cm)",
                                                                      "tip - first goal, x (cm)",
                                                                      "tip - first goal, y (cm)",
                                                                      "tip - first goal, z (cm)",
                                                                      "roll - best roll (rad)",
                                                                      "jaw (rad)",
                                                                      "force x (N)",
                                                                      "force y (N)",
                                                                      "force z (N)",
                                                                      "holds (0, 1)",
                                                                      "pinch (N)",
                                                                      "middle - tip, x (cm)",
                                                                      "middle - tip, y (cm)",
                                                                      "middle - tip, z (cm)",
                                                                      "way of the tissue, x (cm)",
                                                                      "way of the tissue, y (cm)",
                                                                      "way of the tissue, z (cm)",
                                                                      "score (0 to 1)",
                                                                      "time left (0 to 1)"};

}  // namespace

std::shared_ptr<const Task> makeTask(const TaskOptions& options) {
  auto task = std::make_shared<Task>();
  const TaskRow* row = nullptr;
  for (const TaskRow& r : tasks())
    if (options.task == r.name) row = &r;
  const bool exercise = row == nullptr && exercise::isExerciseFile(options.task);
  if (!row && !exercise)
    throw std::invalid_argument("task: '" + options.task + "' is unknown (allowed: " + taskNames() +
                                ", or the path of an exercise file)");
  if (options.skip < 1 || options.skip > 1000)
    throw std::invalid_argument("skip: " + std::to_string(options.skip) + " (allowed: 1 to 1000)");
  if (!(options.limit >= 0 && options.limit <= 3600))
    throw std::invalid_argument("limit: " + std::to_string(options.limit) + " s (allowed: 0 to 3600)");
  task->options = options;
  task->box = kinematics::loadTrainerBox(options.box);
  task->model = scene::buildModel(scene::loadScene(options.scene));
  if (exercise) {
    prepareExercise(*task);
    return task;
  }
  task->row = *row;
  task->limit = options.limit > 0 ? options.limit : row->limit;
  task->names.assign(kObservationNames.begin(), kObservationNames.end());
  const auto& objects = task->model->description.objects;
  while (task->object < objects.size() && objects[task->object].name != row->object) ++task->object;
  const bool sews = row->kind == TaskKind::PassNeedle, ties = row->kind == TaskKind::TieThrow;
  if (task->object == objects.size() ||
      (!sews && !ties && task->model->objects[task->object].tube.ringCount() < 8))
    throw std::invalid_argument(options.scene + ": task " + row->name + " needs an object '" + row->object +
                                (sews || ties ? "'" : "' with a tube of at least 8 rings"));
  if (row->kind == TaskKind::Suck) rinse(*task);
  if (sews) takeNeedle(*task);
  if (ties) settle(*task);
  return task;
}

}  // namespace vest::learning
