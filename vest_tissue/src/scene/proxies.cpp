#include <algorithm>
#include <cmath>

#include "stages.h"

namespace vest::scene {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using interaction::kCouplingDamping;
using interaction::kCouplingStiffness;
using interaction::kProxyMass;
using interaction::kProxySpeedLimit;
using interaction::Proxy;
using interaction::throughPivot;

/// Puts the proxy onto the commanded pose, at rest.
void resetProxy(Proxy& proxy, const ToolInput& input) {
  proxy = Proxy{};
  proxy.present = true;
  proxy.tool = input.tool;
  proxy.commanded = input.position;
  proxy.pose.tip = input.position;
  proxy.pose.pivot = input.pivot;
  proxy.pose.orientation = throughPivot(input.orientation.normalized(), input.pivot, input.position);
  proxy.pose.jaw = input.jaw;
}

/// One step of the proxy: semi-implicit in the coupling, the tissue's force of the last step held. The jaws
/// follow the handle as long as the torque of the tissue on them stays below what a hand closes with; beyond
/// it they stop or give way, by as much as the contacts' stiffness says (no inertia: an equilibrium).
void stepProxy(Proxy& proxy, const ToolInput& input, double dt) {
  Vector3d wanted = (input.position - proxy.commanded) / dt;
  const double wanted_speed = std::sqrt(wanted.squaredNorm());
  if (wanted_speed > kProxySpeedLimit) wanted *= kProxySpeedLimit / wanted_speed;
  // v1 = v0 + dt/m·(K (x_cmd - x0 - dt·v1) + C (v_cmd - v1) + F): implicit in the coupling, stable for any
  // dt.
  const double a = dt / kProxyMass;
  Vector3d v =
      (proxy.velocity + a * (kCouplingStiffness * (input.position - dt * wanted - proxy.pose.tip) +
                             (kCouplingDamping + dt * kCouplingStiffness) * wanted + proxy.tip_force)) /
      (1.0 + a * (kCouplingDamping + dt * kCouplingStiffness));
  const double speed = std::sqrt(v.squaredNorm());
  if (speed > kProxySpeedLimit) v *= kProxySpeedLimit / speed;
  proxy.velocity = v;
  proxy.pose.tip += dt * v;
  proxy.commanded = input.position;
  proxy.pose.pivot = input.pivot;
  Quaterniond q = input.orientation;
  q.coeffs() /= std::sqrt(q.squaredNorm());
  proxy.pose.orientation = throughPivot(q, input.pivot, proxy.pose.tip);
  const double most = interaction::kJawSpeedLimit * dt;
  double way = std::max(input.jaw, 0.0) - proxy.pose.jaw;
  if (proxy.jaw_stiffness > 0.0) {
    const double limit = 0.5 * tools::toolGeometry(proxy.tool).jaw_length * interaction::kJawForceLimit;
    way = std::clamp(way, (proxy.jaw_torque - limit) / proxy.jaw_stiffness,
                     (proxy.jaw_torque + limit) / proxy.jaw_stiffness);
  }
  proxy.pose.jaw = std::max(0.0, proxy.pose.jaw + std::clamp(way, -most, most));
}

}  // namespace

void moveProxies(Context& c) {
  for (int t = 0; t < tools::kInstrumentCount; ++t) {
    const ToolInput& input = c.input.tools[t];
    auto& proxy = c.state.proxies[t];
    const bool present = input.present && input.tool != tools::ToolKind::None;
    c.scratch.appeared[t] = present && (!proxy.present || proxy.tool != input.tool);
    if (!present) {
      proxy = Proxy{};
    } else if (c.scratch.appeared[t]) {
      if (c.state.grasps[t].active) c.state.grasps[t].jaw_at_touch = 0.0;  // an exchanged tool lets go
      resetProxy(proxy, input);
      c.scratch.proxies_before[t] = proxy;
    } else {
      stepProxy(proxy, input, c.dt);
    }
  }
}

}  // namespace vest::scene
