#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include <ros/package.h>

#include "vest_bringup/simulation/rehearsal.h"
#include "vest_bringup/simulation/stage.h"

namespace vest::simulation {

inline kinematics::TrainerBox testBox() {
  return kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml");
}

/// Effects as a session has them (trainer.launch), or the tissue alone.
inline StageOptions sessionEffects(bool on, const trajectory::Trajectory& script) {
  StageOptions o;
  o.haemodynamics = o.surface_bleeding = o.field = on;
  o.blood.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  o.field_options.fluid.spacing = 0.003;
  apply(script.effects, o);
  return o;
}

/// A scene and the script that plays it, rehearsed offline.
struct Play {
  kinematics::TrainerBox box = testBox();
  trajectory::Trajectory trajectory;
  Stage stage;
  RehearsalReport report;

  /// m/s: faster than this nothing may be when a script has ended. What goes on by itself says why.
  double rest = 0.005;

  /// A script by its file, with effects.
  Play(const std::string& scene, const std::string& file) : Play(scene, file, true) {}
  explicit Play(const std::string& scene, bool effects = true, const std::string& script = "")
      : Play(scene,
             ros::package::getPath("vest_bringup") + "/trajectories/" + (script.empty() ? scene : script) +
                 ".yaml",
             effects) {}
  Play(const std::string& scene, const std::string& file, bool effects)
      : trajectory(trajectory::fromWaypoints(file, box)),
        stage(makeStage(scene::World(scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/" +
                                                      scene + "/" + scene + ".yaml")),
                        sessionEffects(effects, trajectory))) {}

  scene::World& world() { return stage.trainer->world(); }

  /// Plays it; `watch` is told each step. A script must never bring the tissue to a fault, and all comes to
  /// rest at its end: blood, pools, smoke and the organs' own work feed no vibration.
  void run(const Watch& watch = {}, double seconds = 0) {
    scene::StepInput last;
    report = rehearse(*stage.trainer, box, trajectory, handsOf(trajectory), seconds,
                      [&](double t, const scene::StepInput& input, const scene::StepReport& told) {
                        last = input;
                        if (watch) watch(t, input, told);
                      });
    EXPECT_NE(report.worst, scene::Status::Fault);
    if (seconds > 0) return;
    double without = report.settled_speed;
    if (without >= rest && stage.blood) without = fastestWithoutPulse(last);
    std::printf("%.2f mm/s at the end (%s), %.2f mm/s without the pulse\n", 1e3 * report.settled_speed,
                report.fastest.c_str(), 1e3 * without);
    EXPECT_LT(without, rest) << "m/s";
  }

  /// m/s: vessels pulse by a fraction of a millimetre as long as the heart beats, but must not wag. What goes
  /// on when the pulse no longer widens them feeds itself. The state is as before afterwards.
  double fastestWithoutPulse(scene::StepInput input) {
    constexpr int kSteps = 1500;  // what the pulse drove has come to rest by then
    std::vector<std::uint8_t> now;
    stage.trainer->save(now);
    scene::ParameterEdit off;
    off.parameter = "pulse_dilatation";
    input.edits = {off};
    input.requests.clear();
    scene::StepReport told;
    for (int i = 0; i < kSteps; ++i) {
      input.impacts.clear(), input.dilatations.clear(), input.loads.clear();
      input.load_over = 0;
      input.step = world().steps() + 1;
      stage.trainer->step(input, told);
      input.edits.clear();
    }
    std::string name;
    const double most = fastest(&name);
    stage.trainer->restore(now);
    if (most >= rest) std::printf("without the pulse %s is the fastest\n", name.c_str());
    return most;
  }

  /// m/s: of the fastest knot now. @param object  gets its object's name
  double fastest(std::string* object = nullptr) {
    double most = 0;
    for (std::size_t i = 0; i < world().objectCount(); ++i) {
      std::vector<float> v(3 * world().knotCount(i));
      world().velocities(i, v.data());
      const double before = most;
      for (std::size_t k = 0; k + 2 < v.size(); k += 3)
        most = std::max(most, static_cast<double>(std::hypot(v[k], v[k + 1], v[k + 2])));
      if (object != nullptr && most > before) *object = world().description().objects[i].name;
    }
    return most;
  }

  /// Its number in events, where sutures come behind the objects.
  std::size_t object(const std::string& name) const {
    const auto& objects = stage.trainer->world().description().objects;
    const auto& sutures = stage.trainer->world().description().sutures;
    for (std::size_t i = 0; i < objects.size(); ++i)
      if (objects[i].name == name) return i;
    for (std::size_t i = 0; i < sutures.size(); ++i)
      if (sutures[i].rod.name == name) return objects.size() + i;
    ADD_FAILURE() << "no object " << name;
    return 0;
  }
  /// Times (s) of an event, in order.
  std::vector<double> times(scene::EventKind kind, const std::string& name) const {
    std::vector<double> out;
    const std::size_t which = object(name);
    for (const scene::Event& e : report.events)
      if (e.kind == kind && e.object == which) out.push_back(1e-3 * static_cast<double>(e.step));
    return out;
  }
  /// m², of all its cuts.
  double cutArea(const std::string& name) const {
    const std::size_t which = object(name);
    double sum = 0;
    for (const scene::Event& e : report.events)
      if (e.kind == scene::EventKind::Cut && e.object == which) sum += e.area;
    return sum;
  }
  /// Its first time, or infinity.
  double first(scene::EventKind kind, const std::string& name) const {
    const auto all = times(kind, name);
    return all.empty() ? std::numeric_limits<double>::infinity() : all.front();
  }

  std::vector<float> knots(const std::string& name) {
    const std::size_t i = object(name);
    std::vector<float> xyz(3 * world().knotCount(i));
    world().positions(i, xyz.data());
    return xyz;
  }
  /// Greatest way (m) of an object's knots since `before`; copies of cut knots come behind and do not count.
  double moved(const std::string& name, const std::vector<float>& before) {
    const auto now = knots(name);
    double far = 0;
    for (std::size_t i = 0; i + 2 < std::min(now.size(), before.size()); i += 3)
      far = std::max<double>(
          far, std::hypot(now[i] - before[i], now[i + 1] - before[i + 1], now[i + 2] - before[i + 2]));
    return far;
  }
  /// How far (m) a cut gapes: greatest distance between a knot and its copy.
  double gape(const std::string& name) {
    const auto xyz = knots(name);
    const auto& doubled = world().topology(object(name)).doubled_knots;
    const std::size_t first = xyz.size() / 3 - doubled.size();
    double far = 0;
    for (std::size_t i = 0; i < doubled.size(); ++i) {
      const float *a = &xyz[3 * (first + i)], *b = &xyz[3 * doubled[i]];
      far = std::max<double>(far, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
    }
    return far;
  }
  float most(const std::string& name, scene::Field field) {
    const std::size_t i = object(name);
    std::vector<float> values(world().knotCount(i));
    world().field(i, field, values.data());
    return *std::max_element(values.begin(), values.end());
  }
  /// Mean distance (m) of a ring's knots from their middle.
  double ringRadius(const std::string& name, std::size_t ring) {
    const std::size_t i = object(name);
    const auto& knots = world().description().objects[i].tube.rings.at(ring);
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const auto k : knots) middle += world().knotAt(i, k) / static_cast<double>(knots.size());
    double radius = 0;
    for (const auto k : knots)
      radius += (world().knotAt(i, k) - middle).norm() / static_cast<double>(knots.size());
    return radius;
  }

  /// Of an object's knots of the scene the least or the most of their blood supply, 0 … 1.
  std::pair<float, float> reach(const std::string& name) const {
    const std::size_t first = stage.surface->model().first[object(name)],
                      knots = stage.surface->model().scene[object(name)];
    const auto& reach = stage.surface->perfusion().reach;
    const auto [low, high] = std::minmax_element(reach.begin() + static_cast<std::ptrdiff_t>(first),
                                                 reach.begin() + static_cast<std::ptrdiff_t>(first + knots));
    return {*low, *high};
  }
};

/// What flows out of all opened vessels now, m³/s.
inline double leak(const Stage& stage) {
  const bleeding::WoundState& w = stage.blood->wounds();
  double flow = 0;
  for (int i = 0; i < w.opening_count; ++i) flow += w.openings[static_cast<std::size_t>(i)].flow;
  return flow;
}
/// Blood that the patient has lost, m³.
inline double lost(const Stage& stage) {
  return stage.blood->circulation().lost;
}

/// This step is the one at a moment (s).
inline bool at(double t, double moment) {
  return std::fabs(t - moment) < 5e-4;
}

constexpr auto kRightHand = static_cast<std::size_t>(tools::Instrument::Right);

}  // namespace vest::simulation
