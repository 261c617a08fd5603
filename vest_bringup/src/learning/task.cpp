#include "vest_bringup/learning/task.h"

#include <algorithm>
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
  with.haemodynamics = with.surface_bleeding = with.field = !options.vessels.empty();
  with.field = with.field || row.kind == TaskKind::Suck;
  with.blood.vessels = options.vessels;
  with.field_options.fluid.spacing = 0.003;  // m, as of trainer.launch
  return simulation::makeStage(scene::World(model, threads), with);
}

const Eigen::Vector3d kNeedleEntry(0.0039, 0.0589, 0.0595), kNeedleWay(-0.0117, -0.0158, 0.0009);

const std::vector<Waypoint>& needleMotion() {
  static const std::vector<Waypoint> rows{
      {0.0, {0.0786, -0.0028, 0.1057}, -2.127, 0.5}, {1.5, {0.0633, 0.0043, 0.0809}, -2.127, 0.5},
      {2.3, {0.0633, 0.0043, 0.0809}, -2.127, 0},    {3.2, {0.0847, -0.0057, 0.1156}, -2.127, 0},
      {4.0, {0.0400, 0.0120, 0.1280}, -2.810, 0},    {5.0, {0.0133, 0.0322, 0.0878}, -3.493, 0},
      {6.0, {-0.0125, 0.0454, 0.0682}, -3.493, 0},   {6.42, {-0.0129, 0.0477, 0.0703}, -3.221, 0},
      {6.83, {-0.0127, 0.0504, 0.0719}, -2.948, 0},  {7.25, {-0.0119, 0.0533, 0.0729}, -2.676, 0},
      {7.67, {-0.0107, 0.0562, 0.0735}, -2.403, 0},  {8.08, {-0.0091, 0.0589, 0.0735}, -2.130, 0},
      {8.5, {-0.0071, 0.0611, 0.0728}, -1.856, 0},   {8.92, {-0.0050, 0.0627, 0.0716}, -1.582, 0},
      {9.33, {-0.0029, 0.0636, 0.0698}, -1.308, 0},  {9.75, {-0.0009, 0.0638, 0.0678}, -1.033, 0},
      {10.17, {0.0009, 0.0630, 0.0654}, -0.759, 0},  {10.58, {0.0022, 0.0615, 0.0629}, -0.485, 0},
      {11.0, {0.0029, 0.0595, 0.0607}, -0.211, 0}};
  return rows;
}

Waypoint at(const std::vector<Waypoint>& motion, double t) {
  std::size_t k = 1;
  while (k + 1 < motion.size() && motion[k].t < t) ++k;
  const Waypoint &a = motion[k - 1], &b = motion[k];
  const double s = std::clamp((t - a.t) / (b.t - a.t), 0.0, 1.0);
  return {t, a.tip + s * (b.tip - a.tip), a.roll + s * (b.roll - a.roll), a.jaw + s * (b.jaw - a.jaw)};
}

const std::array<std::vector<trajectory::Waypoint>, 2>& throwMotion() {
  static const std::array<std::vector<trajectory::Waypoint>, 2> hands{
      {{{0, {-0.0576, -0.0313, 0.0697}, 0.739, 0.5, false},
        {3, {-0.0576, -0.0313, 0.0697}, 0.739, 0.5, false},
        {4, {-0.0432, -0.0341, 0.0458}, 0.739, 0.5, false},
        {4.6, {-0.0432, -0.0341, 0.0458}, 0.739, 0, false},
        {5, {-0.0432, -0.0341, 0.0458}, 0.739, 0, false},
        {7, {-0.03, -0.005, 0.106}, -0.058, 0, true},
        {9, {-0.0127, 0.0268, 0.1285}, -1.386, 0, true},
        {10, {0.0031, 0.0584, 0.1328}, -2.551, 0, true},
        {11, {0.0184, 0.0843, 0.1208}, -2.928, 0, true},
        {12.2, {0.0056, 0.0958, 0.1001}, -3.848, 0, true},
        {13.2, {-0.0017, 0.0789, 0.0843}, -4.675, 0, true},
        {14, {-0.0129, 0.055, 0.0841}, -5.314, 0, true},
        {15.5, {-0.016, 0.01, 0.098}, -3.5, 0, true},
        {16.5, {-0.0127, 0.0268, 0.1285}, -1.386, 0, true},
        {17.5, {0.0031, 0.0584, 0.1328}, -2.551, 0, true},
        {18.5, {0.0184, 0.0843, 0.1208}, -2.928, 0, true},
        {19.7, {0.0056, 0.0958, 0.1001}, -3.848, 0, true},
        {20.7, {-0.0017, 0.0789, 0.0843}, -4.675, 0, true},
        {21.5, {-0.0129, 0.055, 0.0841}, -5.314, 0, true},
        {23, {-0.0129, 0.055, 0.0841}, -5.314, 0, false},
        {24.2, {-0.0135, 0.053, 0.0898}, -5.32, 0, false},
        {25.5, {-0.0098, 0.0589, 0.0908}, -5.528, 0, false},
        {27.5, {-0.0098, 0.0589, 0.0908}, -5.528, 0, false},
        {28.8, {-0.004, 0.05, 0.108}, -4.37, 0, false},
        {29.8, {-0.004, 0.05, 0.108}, -4.37, 0, false},
        {31.1, {-0.03, 0.066, 0.108}, -4.343, 0, true},
        {33, {-0.06, 0.09, 0.11}, -4.336, 0, false},
        {35, {-0.08, 0.115, 0.108}, -4.161, 0, false},
        {37, {-0.08, 0.115, 0.108}, -4.161, 0, false}},
       {{0, {0.0417, 0.0314, 0.1253}, 0, 0, false},
        {6, {0.0417, 0.0314, 0.1253}, 0, 0, false},
        {8, {-0.0055, 0.0644, 0.0997}, 0, 0, false},
        {21.5, {-0.0055, 0.0644, 0.0997}, 0, 0, false},
        {23.1, {-0.0264, 0.0791, 0.0883}, 0, 0, false},
        {24.2, {-0.0264, 0.0791, 0.0883}, 0, 0, false},
        {25.7, {-0.0008, 0.0748, 0.0921}, 0.261, 0.6, false},
        {26.7, {-0.014, 0.0856, 0.0838}, 0.261, 0.6, false},
        {27.3, {-0.014, 0.0856, 0.0838}, 0.261, 0, false},
        {30, {0.0076, 0.0492, 0.1033}, 0.261, 0, false},
        {37, {0.0076, 0.0492, 0.1033}, 0.261, 0, false}}}};
  return hands;
}

std::size_t Task::actionSize() const {
  return row.both ? 2 * kActionSize : kActionSize;
}

namespace {

/// The hand takes the needle from its tray and holds it before the pad.
void takeNeedle(Task& task) {
  if (task.model->threads.first_point.empty())
    throw std::invalid_argument(task.options.scene + ": task pass_needle needs a suture with a needle");
  const kinematics::TrainerArm& arm = task.box.arm(task.row.hand);
  simulation::Stage stage = task.stage(1);
  scene::StepInput input;
  scene::StepReport report;
  const double dt = task.model->description.dt;
  const int steps = static_cast<int>(kNeedleTaken / dt + 0.5);
  for (int k = 0; k < steps; ++k) {
    input.impacts.clear(), input.loads.clear(), input.dilatations.clear();
    input.load_over = 0;
    input.step = stage.trainer->world().steps() + 1;
    input.dt = dt;
    const Waypoint now = at(needleMotion(), (k + 1) * dt);
    Eigen::Isometry3d wanted = Eigen::Isometry3d::Identity();
    wanted.translation() = now.tip;
    task.from = kinematics::inverseKinematics(arm.X_BTrocar, wanted, {}, arm.limits).q;
    task.from.roll = now.roll, task.from.jaw = now.jaw;
    input.tools[static_cast<std::size_t>(task.row.hand)] =
        simulation::toolInput(arm, task.row.tool, task.from);
    stage.trainer->step(input, report);
  }
  const auto& grips = stage.trainer->world().state().threads.needle_grips;
  if (!grips[static_cast<std::size_t>(task.row.hand)].active)
    throw std::invalid_argument(task.options.scene +
                                ": task pass_needle: the needle does not lie where its script takes it");
  stage.trainer->save(task.start);
}

/// Water from above into the hollow, and a second to come to rest.
void rinse(Task& task) {
  constexpr int kRinse = 2200, kRest = 1000;  // steps: 110 ml at the irrigator's flow
  const kinematics::TrainerArm& arm = task.box.arm(task.row.hand);
  Eigen::Isometry3d over = Eigen::Isometry3d::Identity();
  over.translation() = Eigen::Vector3d(0.030, 0.024, 0.075);  // m, as in the script of this scene
  const auto joints = kinematics::inverseKinematics(arm.X_BTrocar, over, {}, arm.limits).q;
  simulation::Stage stage = task.stage(1);
  scene::StepInput input;
  scene::StepReport report;
  for (int k = 0; k < kRinse + kRest; ++k) {
    input.impacts.clear(), input.loads.clear(), input.dilatations.clear();
    input.load_over = 0;
    input.step = stage.trainer->world().steps() + 1;
    input.dt = task.model->description.dt;
    scene::ToolInput& tool = input.tools[static_cast<std::size_t>(task.row.hand)];
    tool = simulation::toolInput(arm, task.row.tool, joints);
    tool.functions = k < kRinse ? static_cast<std::uint32_t>(tools::kFunctionIrrigate) : 0;
    stage.trainer->step(input, report);
  }
  task.pool = fluid::poolVolume(stage.field->fluidModel(), stage.field->fluid());
  if (!(task.pool > 1e-5))
    throw std::invalid_argument(task.options.scene +
                                ": task suck needs a hollow that holds more than 10 ml (" +
                                std::to_string(1e6 * task.pool) + " ml stand there)");
  stage.trainer->save(task.start);
}

/// The thread comes to rest.
void settle(Task& task) {
  if (!task.model->threads.rods || task.model->threads.rods->strands.front().closed)
    throw std::invalid_argument(task.options.scene + ": task tie_throw needs a suture with two ends");
  simulation::Stage stage = task.stage(1);
  scene::StepInput input;
  scene::StepReport report;
  const double dt = task.model->description.dt;
  const int steps = static_cast<int>(kThrowBegins / dt + 0.5);
  for (int k = 0; k < steps; ++k) {
    input.impacts.clear(), input.loads.clear(), input.dilatations.clear();
    input.load_over = 0;
    input.step = stage.trainer->world().steps() + 1;
    input.dt = dt;
    stage.trainer->step(input, report);
  }
  stage.trainer->save(task.start);
}

}  // namespace

std::shared_ptr<const Task> makeTask(const TaskOptions& options) {
  auto task = std::make_shared<Task>();
  const TaskRow* row = nullptr;
  for (const TaskRow& r : tasks())
    if (options.task == r.name) row = &r;
  if (!row)
    throw std::invalid_argument("task: '" + options.task + "' is unknown (allowed: " + taskNames() + ")");
  if (options.skip < 1 || options.skip > 1000)
    throw std::invalid_argument("skip: " + std::to_string(options.skip) + " (allowed: 1 to 1000)");
  if (!(options.limit >= 0 && options.limit <= 3600))
    throw std::invalid_argument("limit: " + std::to_string(options.limit) + " s (allowed: 0 to 3600)");
  task->row = *row;
  task->options = options;
  task->limit = options.limit > 0 ? options.limit : row->limit;
  task->box = kinematics::loadTrainerBox(options.box);
  task->model = scene::buildModel(scene::loadScene(options.scene));
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
