#include "vest_bringup/learning/task.h"

#include <cmath>
#include <stdexcept>

namespace vest::learning {

const std::vector<TaskRow>& tasks() {
  using tools::ToolKind;
  // How far the tip goes beyond the middle, and the opening: as the scripts of these scenes have them.
  static const std::vector<TaskRow> rows{
      {TaskKind::Reach, "reach", "grasp_tube", "tube", ToolKind::Grasper, -0.008, 0.0, 4},
      {TaskKind::GraspLift, "grasp_lift", "grasp_tube", "tube", ToolKind::Grasper, 0.006, 0.9, 10},
      {TaskKind::Retract, "retract", "grasp_tube", "tube", ToolKind::Grasper, 0.006, 0.9, 10},
      {TaskKind::Clip, "clip", "clip_tube", "vessel", ToolKind::ClipApplier, 0.0045, 0.6, 10},
      {TaskKind::Cut, "cut", "cut_tube", "tube", ToolKind::Scissors, 0.0065, 0.75, 15},
  };
  return rows;
}

std::string taskNames() {
  std::string all;
  for (const TaskRow& row : tasks()) all.append(all.empty() ? "" : ", ").append(row.name);
  return all;
}

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
  if (task->object == objects.size() || task->model->objects[task->object].tube.ringCount() < 8)
    throw std::invalid_argument(options.scene + ": task " + row->name + " needs an object '" + row->object +
                                "' with a tube of at least 8 rings");
  return task;
}

}  // namespace vest::learning
