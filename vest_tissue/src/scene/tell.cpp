#include <algorithm>
#include <cmath>

#include "stages.h"
#include "vest_tissue/scene/cavity_walls.h"

namespace vest::scene {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Matrix3d full(const double s[6]) {
  Matrix3d m;
  m << s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2];
  return m;
}

// Half of the thickness of what touches tissue: jaws, hook, needle; of a tool without such, its shaft. m.
// A tool that moves on by it touches elsewhere, where the linear model says nothing.
double thickness(const tools::ToolGeometry& tool) {
  double most = 0.0;
  for (const auto* part : {&tool.fixed, &tool.jaw[0], &tool.jaw[1]})
    for (const tools::Capsule& c : *part) most = std::max(most, c.radius);
  return most > 0.0 ? most : tool.shaft_radius;
}

/// m from the pivot to the tip: nearer than this an instrument turns about its pivot as heavily as from here.
/// Its shaft goes on beyond the trocar, and a hand holds it there (assumed).
constexpr double kShortLever = 0.05;

/// N: what the tip feels of a force and its moment about the world's origin. Axial force whole, lateral force
/// by the moment about the pivot over the length. The proxy has its mass and its coupling at the tip. About
/// the pivot these go to nothing with the square of the length, those of an instrument do not.
Vector3d feltAtTip(const interaction::ToolPose& pose, const Vector3d& force, const Vector3d& moment) {
  const Vector3d along = pose.tip - pose.pivot, about_pivot = moment - pose.pivot.cross(force);
  const double length = std::sqrt(along.squaredNorm());
  if (!(length > 1e-6)) {
    const Vector3d z = pose.orientation * Vector3d::UnitZ();
    return z * force.dot(z);
  }
  const Vector3d z = along / length;
  const double share = std::min(1.0, length / kShortLever);
  return z * force.dot(z) + share * share * about_pivot.cross(z) / length;
}

constexpr double kWallLoad = 300.0;    ///< Pa: 3 cm of wall lie on what holds it up (assumed)
constexpr double kWallYields = 0.002;  ///< m into the wall in which it comes to lie so (assumed)
constexpr int kParts = 8;              ///< of a capsule, on each of which the wall lies by itself (tuned)

/// A sunken wall lies on shafts and jaws by its weight over their width. It presses across a shaft alone, for
/// steel slides, and hangs on the trocar beside it. The endoscope props it up: nothing lies on that.
void meetWalls(const Context& c, const CavityWalls& hanging, int t, contact::ToolLoad& load) {
  const auto& proxy = c.state.proxies[t];
  if (!hanging.sink() || proxy.tool == tools::ToolKind::Endoscope) return;
  const Vector3d along = proxy.pose.orientation * Vector3d::UnitZ();
  for (std::size_t object = 0; object < c.model.objects.size(); ++object) {
    if (!hanging.isCavity(object)) continue;
    for (int k = 0; k < c.scratch.capsule_count[t] * kParts; ++k) {
      const auto& part = c.scratch.capsules_after[t][k / kParts];
      const Vector3d x = part.a + ((k % kParts + 0.5) / kParts) * (part.b - part.a);
      const Eigen::Vector3f p = x.cast<float>();
      Eigen::Vector3f gradient;
      float distance = c.model.objects[object].grid.distance(p, gradient);
      if (!(distance > 0.0f) || !hanging.lower(object, p, distance, gradient)) continue;
      const double deep = part.radius - static_cast<double>(distance);
      if (!(deep > 0.0)) continue;
      Vector3d across = gradient.cast<double>();
      across /= std::sqrt(across.squaredNorm());
      across -= across.dot(along) * along;
      const double length = std::sqrt((part.b - part.a).squaredNorm()) / kParts,
                   beside = (x - proxy.pose.pivot).head<2>().squaredNorm(),
                   most = kWallLoad * 2.0 * part.radius * length * beside /
                          (beside + contact::kProp * contact::kProp),
                   force = most * std::min(1.0, deep / kWallYields);
      const Vector3d impulse = c.dt * force * across, moment = x.cross(impulse);
      load.touched = true;
      for (int e = 0; e < 3; ++e) load.impulse[e] += impulse[e], load.moment[e] += moment[e];
      if (deep >= kWallYields) continue;
      const Eigen::Matrix3d rises = most / kWallYields * across * across.transpose();
      const double six[6] = {rises(0, 0), rises(1, 1), rises(2, 2), rises(0, 1), rises(0, 2), rises(1, 2)};
      for (int e = 0; e < 6; ++e) load.stiffness[e] += six[e];
    }
  }
}

}  // namespace

void emit(Context& c, const Event& event) {
  if (c.report.events.size() < c.report.events.capacity()) c.report.events.push_back(event);
}

void tell(Context& c) {
  const CavityWalls hanging(c.model, c.state, c.input.sunk);
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    ContactModel& m = c.report.contacts[t];
    m = ContactModel{};
    m.step = c.state.step;
    auto& proxy = c.state.proxies[t];
    if (!proxy.present) continue;
    const Vector3d tip = proxy.pose.tip;
    Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero(), normal = Vector3d::Zero();
    Matrix3d stiffness = Matrix3d::Zero(), damping = Matrix3d::Zero();
    bool touched = false;
    proxy.jaw_torque = proxy.jaw_stiffness = 0.0;
    const auto add = [&](const contact::ToolLoad& load, double series) {
      if (!load.touched) return;
      touched = true;
      for (int e = 0; e < 3; ++e) {
        force[e] += load.impulse[e] / c.dt;
        moment[e] += load.moment[e] / c.dt;
        normal[e] += load.normal[e];
      }
      proxy.jaw_torque += load.jaw_impulse / c.dt;
      proxy.jaw_stiffness += load.jaw_stiffness;
      stiffness += series * full(load.stiffness);
      damping += full(load.damping);
    };
    // Objects in order: the same sum for any threads.
    for (const std::size_t i : c.model.bodies)
      add(c.scratch.objects[i].loads.tools[t], c.model.objects[i].contact_series);
    if (c.scratch.threads) add(c.scratch.threads->loads.tools[t], 1.0);
    contact::ToolLoad wall;
    meetWalls(c, hanging, t, wall);
    add(wall, 1.0);
    const Vector3d torque = moment - tip.cross(force);
    proxy.force = force;
    proxy.torque = torque;
    proxy.tip_force = feltAtTip(proxy.pose, force, moment);
    const auto& grasp = c.state.grasps[t];
    m.radius = thickness(tools::toolGeometry(proxy.tool));
    m.in_contact = touched;
    m.grasping = grasp.active || c.state.threads.grips[t].active;
    m.proxy = Eigen::Isometry3d(Eigen::Translation3d(tip) * proxy.pose.orientation);
    m.velocity.head<3>() = proxy.velocity;
    m.wrench.head<3>() = force;
    m.wrench.tail<3>() = torque;
    m.stiffness.topLeftCorner<3, 3>() = stiffness;
    m.damping.topLeftCorner<3, 3>() = damping;
    m.pinch_force = grasp.active ? grasp.pinch : 0.0;
    m.jaw_torque = m.pinch_force * 0.5 * tools::toolGeometry(proxy.tool).jaw_length +
                   c.state.cutting.tools[t].torque + proxy.jaw_torque;
    const double push = std::sqrt(normal.squaredNorm());
    if (push > 1e-6 && !grasp.active) {
      // Free space begins where the linear model's force along the normal ends.
      const Vector3d n = normal / push;
      const double k = n.dot(stiffness * n);
      if (k > 1e-9) m.planes[m.plane_count++] = {n, n.dot(tip) + n.dot(force) / k};
    }
  }
  for (ObjectScratch& o : c.scratch.objects) {
    c.state.energy.work += o.loads.work;
    c.state.energy.dissipated += o.loads.dissipated + o.heat;
  }
}

}  // namespace vest::scene
