#include "vest_bringup/simulation/rehearsal.h"

#include <algorithm>

#include "vest_instruments/kinematics/jacobian.h"

namespace vest::simulation {
namespace {

std::vector<float> knots(const scene::World& world, std::size_t object) {
  std::vector<float> xyz(3 * world.knotCount(object));
  world.positions(object, xyz.data());
  return xyz;
}

struct RowsAround {
  const trajectory::Row &before, &after;
};

RowsAround rowsAt(const trajectory::Trajectory& trajectory, double t) {
  const auto& rows = trajectory.rows;
  const auto next = std::upper_bound(rows.begin(), rows.end(), t,
                                     [](double v, const trajectory::Row& r) { return v < r.t; });
  return {next == rows.begin() ? rows.front() : *(next - 1), next == rows.end() ? rows.back() : *next};
}

}  // namespace

scene::ToolInput toolInput(const kinematics::TrainerArm& arm, tools::ToolKind tool,
                           const kinematics::JointPositions& joints) {
  const Eigen::Isometry3d tip = kinematics::forwardKinematics(arm.X_BTrocar, joints);
  scene::ToolInput in;
  in.present = true;
  in.tool = tool;
  in.position = tip.translation();
  in.orientation = Eigen::Quaterniond(tip.linear());
  in.pivot = arm.pivot_B;
  in.jaw = tool == tools::ToolKind::Endoscope ? 0.0 : joints.jaw;
  if (tool == tools::ToolKind::Endoscope)
    in.sight = kinematics::opticalFrame(arm.optic_angle, joints.jaw).linear().col(2);
  return in;
}

void fireByHandle(bool& was_open, scene::ToolInput& tool) {
  constexpr double kOpen = 0.15, kClosed = 0.05;  // rad
  was_open = was_open || tool.jaw > kOpen;
  if (was_open && tool.jaw < kClosed)
    tool.functions |= control::functionsOf(tool.tool) & tools::kFunctionFire;
}

kinematics::JointPositions jointsAt(const trajectory::Trajectory& trajectory, tools::Instrument instrument,
                                    double t) {
  const auto [a, b] = rowsAt(trajectory, t);
  const double s = b.t > a.t ? std::clamp((t - a.t) / (b.t - a.t), 0.0, 1.0) : 0.0;
  const auto mix = [s](double x, double y) { return x + s * (y - x); };
  const auto i = static_cast<std::size_t>(instrument);
  const auto &p = a.joints[i], &q = b.joints[i];
  return {mix(p.yaw, q.yaw), mix(p.pitch, q.pitch), mix(p.insertion, q.insertion), mix(p.roll, q.roll),
          mix(p.jaw, q.jaw)};
}

unsigned footswitches(const trajectory::Trajectory& trajectory, double from, double to) {
  const trajectory::Row* row = &rowsAt(trajectory, from).before;
  unsigned down = row->footswitches;
  for (const trajectory::Row* const end = &trajectory.rows.back() + 1; ++row != end && row->t <= to;)
    down |= row->footswitches;
  return down;
}

scene::StepInput inputAt(const kinematics::TrainerBox& box, const trajectory::Trajectory& trajectory,
                         const std::array<tools::ToolKind, tools::kInstrumentCount>& tool, double t) {
  scene::StepInput input;
  for (std::size_t i = 0; i < tool.size(); ++i) {
    if (!trajectory.moves[i]) continue;
    input.tools[i] =
        toolInput(box.arms[i], tool[i], jointsAt(trajectory, static_cast<tools::Instrument>(i), t));
  }
  return input;
}

Hands handsOf(const trajectory::Trajectory& trajectory) {
  using tools::ToolKind;
  Hands hands;
  hands.tool = {ToolKind::Grasper, ToolKind::Grasper, ToolKind::None, ToolKind::Endoscope};
  for (std::size_t i = 0; i < hands.tool.size(); ++i)
    hands.tool[i] = trajectory.tools[i].value_or(hands.tool[i]);
  hands.tray = trajectory.tool_tray;
  return hands;
}

Script::Script(const kinematics::TrainerBox& box, const trajectory::Trajectory& trajectory, Hands hands)
    : box_(box),
      trajectory_(trajectory),
      hands_(std::move(hands)),
      pedals_(control::footswitchPreset("trainer")->functions) {
  pedals_.update(0, 0.0);  // all are up before the script begins
}

scene::StepInput Script::inputAt(double t) {
  scene::StepInput input = simulation::inputAt(box_, trajectory_, hands_.tool, t);
  pedals_.update(footswitches(trajectory_, t, t), t);
  if (pedals_.takeToolPress() && !hands_.tray.empty()) {
    const auto hand = static_cast<std::size_t>(hands_.tray_hand);
    hands_.tool[hand] = hands_.tray[tray_place_++ % hands_.tray.size()];
    input.tools[hand].tool = hands_.tool[hand];
  }
  for (std::size_t i = 0; i < input.tools.size(); ++i) {
    scene::ToolInput& tool = input.tools[i];
    if (!tool.present) continue;
    tool.functions = pedals_.active(tool.tool, t);
    fireByHandle(was_open_[i], tool);
  }
  return input;
}

RehearsalReport rehearse(scene::Simulation& simulation, const kinematics::TrainerBox& box,
                         const trajectory::Trajectory& trajectory, const Hands& hands, double seconds,
                         const Watch& watch, const std::function<bool()>& ended) {
  scene::World& world = simulation.world();
  Script script(box, trajectory, hands);
  RehearsalReport out;
  scene::StepReport report;
  std::vector<std::pair<std::size_t, std::vector<float>>> tubes;
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    if (world.description().objects[i].name.rfind("tube", 0) == 0) tubes.emplace_back(i, knots(world, i));
  }
  std::vector<scene::ThreadView> threads, before;
  std::uint64_t looked_steps = 0;
  const double dt = world.description().dt;
  const double end = seconds > 0 ? seconds : trajectory.rows.back().t;
  for (std::uint64_t k = 0; static_cast<double>(k) * dt < end; ++k) {
    const double t = static_cast<double>(k) * dt;
    if (k % 20 == 0) {
      world.threads(before);
      looked_steps = world.steps();
    }
    scene::StepInput input = script.inputAt(t);
    input.step = world.steps() + 1;
    input.dt = dt;
    out.worst = std::max(out.worst, simulation.step(input, report));
    out.events.insert(out.events.end(), report.events.begin(), report.events.end());
    for (const scene::ContactModel& c : report.contacts) {
      out.greatest_force = std::max(out.greatest_force, c.wrench.head<3>().norm());
    }
    if (watch) watch(t, input, report);
    if (ended && ended()) break;
    if (k % 20 != 0) continue;
    for (const auto& [object, start] : tubes) {
      const std::vector<float> now = knots(world, object);
      for (std::size_t i = 0; i + 2 < std::min(now.size(), start.size());
           i += 3) {  // copies of cut knots come behind
        const double d =
            Eigen::Vector3d(now[i] - start[i], now[i + 1] - start[i + 1], now[i + 2] - start[i + 2]).norm();
        if (d > out.tube_displacement) {
          out.tube_displacement = d;
          out.tube = world.description().objects[object].name;
        }
      }
    }
  }
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    std::vector<float> v(3 * world.knotCount(i));
    world.velocities(i, v.data());
    for (std::size_t k = 0; k + 2 < v.size(); k += 3) {
      const double speed = static_cast<double>(Eigen::Vector3f(v[k], v[k + 1], v[k + 2]).norm());
      if (speed <= out.settled_speed) continue;
      out.settled_speed = speed;
      out.fastest = world.description().objects[i].name;
    }
  }
  // Threads tell places only: their nodes' way since the last look.
  world.threads(threads);
  const double over = static_cast<double>(world.steps() - looked_steps) * dt;
  for (std::size_t i = 0; over > 0 && i < std::min(threads.size(), before.size()); ++i) {
    const auto &now = threads[i].positions, &then = before[i].positions;
    for (std::size_t k = 0; k < std::min(now.size(), then.size()); ++k) {
      const double speed = (now[k] - then[k]).norm() / over;
      if (speed <= out.settled_speed) continue;
      out.settled_speed = speed;
      out.fastest = world.description().sutures[threads[i].suture].rod.name;
    }
  }
  return out;
}

}  // namespace vest::simulation
