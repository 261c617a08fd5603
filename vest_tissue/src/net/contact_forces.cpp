#include <algorithm>
#include <cmath>

#include "vest_tissue/net/contacts.h"

namespace vest::contact {
namespace {

using net::Block;

/// Knots' rows that a contact touches.
struct Rows {
  float *x, *y, *z, *vx, *vy, *vz, *fx, *fy, *fz;
  explicit Rows(Block& b)
      : x(b.row(Block::X)),
        y(b.row(Block::Y)),
        z(b.row(Block::Z)),
        vx(b.row(Block::VX)),
        vy(b.row(Block::VY)),
        vz(b.row(Block::VZ)),
        fx(b.row(Block::FX)),
        fy(b.row(Block::FY)),
        fz(b.row(Block::FZ)) {}
};

struct Force {
  float normal;
  float tangential[3];  ///< on the tissue
  double heat;          ///< W
};

Force evaluate(float gap, const float v[3], const float n[3], float k, float c, float grip, float mu) {
  // v: velocity of the tissue relative to the tool; closing speed is v·n.
  Force r{};
  const float closing = v[0] * n[0] + v[1] * n[1] + v[2] * n[2];
  const float elastic = -k * gap;
  const float t[3] = {v[0] - closing * n[0], v[1] - closing * n[1], v[2] - closing * n[2]};
  const float speed = std::sqrt(t[0] * t[0] + t[1] * t[1] + t[2] * t[2]);
  const Pressed<float> law(gap, closing, speed, k, c, grip, mu);
  r.normal = law.push;
  for (int i = 0; i < 3; ++i) r.tangential[i] = -law.drag * t[i];
  r.heat = static_cast<double>(law.drag) * speed * speed + (r.normal - elastic) * closing;
  return r;
}

void addTensor(double s[6], const float n[3], double w) {
  s[0] += w * n[0] * n[0], s[1] += w * n[1] * n[1], s[2] += w * n[2] * n[2];
  s[3] += w * n[0] * n[1], s[4] += w * n[0] * n[2], s[5] += w * n[1] * n[2];
}

/// Impulse f·h of the tissue on the tool at p.
void onTool(ToolLoad& load, const float f[3], const float p[3], double h) {
  const double j[3] = {f[0] * h, f[1] * h, f[2] * h};
  for (int i = 0; i < 3; ++i) load.impulse[i] += j[i];
  load.moment[0] += p[1] * j[2] - p[2] * j[1];
  load.moment[1] += p[2] * j[0] - p[0] * j[2];
  load.moment[2] += p[0] * j[1] - p[1] * j[0];
}

}  // namespace

void onJaws(ToolLoad& load, const float jaw[3], const float f[3], const float n[3], double h,
            double stiffness) {
  const double lever = n[0] * jaw[0] + n[1] * jaw[1] + n[2] * jaw[2];
  load.jaw_impulse += (f[0] * jaw[0] + f[1] * jaw[1] + f[2] * jaw[2]) * h;
  load.jaw_stiffness += stiffness * lever * lever;
}

void addToolContacts(Block& block, const std::vector<ToolContact>& contacts, float fraction, float h,
                     float dt, ObjectLoads& loads) {
  const Rows r(block);
  const float share = h / dt;
  for (const ToolContact& c : contacts) {
    float q[3] = {}, v[3] = {};
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t k = c.knots[i];
      const float w = c.weights[i];
      q[0] += w * r.x[k], q[1] += w * r.y[k], q[2] += w * r.z[k];
      v[0] += w * r.vx[k], v[1] += w * r.vy[k], v[2] += w * r.vz[k];
    }
    float p[3], tool_velocity[3];
    for (int i = 0; i < 3; ++i) {
      p[i] = c.start[i] + fraction * c.travel[i];
      tool_velocity[i] = c.travel[i] / dt;
      v[i] -= tool_velocity[i];
    }
    const float gap =
        c.normal[0] * (p[0] - q[0]) + c.normal[1] * (p[1] - q[1]) + c.normal[2] * (p[2] - q[2]) - c.reach;
    if (gap >= 0.0f) continue;
    const Force f = evaluate(gap, v, c.normal, c.stiffness, c.damping, c.grip, c.friction);
    float on_tissue[3];
    for (int i = 0; i < 3; ++i) on_tissue[i] = f.tangential[i] - f.normal * c.normal[i];
    for (int i = 0; i < 3; ++i) {
      const std::uint32_t k = c.knots[i];
      r.fx[k] += c.weights[i] * on_tissue[0];
      r.fy[k] += c.weights[i] * on_tissue[1];
      r.fz[k] += c.weights[i] * on_tissue[2];
    }
    ToolLoad& load = loads.tools[c.tool];
    load.touched = true;
    const float on_tool[3] = {-on_tissue[0], -on_tissue[1], -on_tissue[2]};
    onTool(load, on_tool, q, h);
    addTensor(load.stiffness, c.normal, c.stiffness * share);
    addTensor(load.damping, c.normal, c.damping * share);
    for (int i = 0; i < 3; ++i) load.normal[i] += static_cast<double>(c.normal[i]) * f.normal * share;
    onJaws(load, c.jaw, on_tool, c.normal, h, c.stiffness * share);
    loads.work += (on_tissue[0] * tool_velocity[0] + on_tissue[1] * tool_velocity[1] +
                   on_tissue[2] * tool_velocity[2]) *
                  static_cast<double>(h);
    loads.dissipated += f.heat * h;
  }
}

void addPulls(Block& block, const std::vector<Pull>& pulls, float fraction, float h, float dt,
              ObjectLoads& loads) {
  const Rows r(block);
  const float share = h / dt;
  for (const Pull& c : pulls) {
    const std::uint32_t k = c.knot;
    const float x[3] = {r.x[k], r.y[k], r.z[k]}, v[3] = {r.vx[k], r.vy[k], r.vz[k]};
    float f[3], on_tool[3];
    double heat = 0.0, work = 0.0;
    for (int i = 0; i < 3; ++i) {
      const float target = c.start[i] + fraction * c.travel[i], target_velocity = c.travel[i] / dt;
      const float rate = target_velocity - v[i];
      f[i] = c.stiffness * (target - x[i]) + c.damping * rate;
      on_tool[i] = -f[i];
      heat += static_cast<double>(c.damping) * rate * rate;
      work += static_cast<double>(f[i]) * target_velocity;
    }
    r.fx[k] += f[0];
    r.fy[k] += f[1];
    r.fz[k] += f[2];
    loads.work += work * h;
    loads.dissipated += heat * h;
    if (c.tool == kNoTool) continue;
    ToolLoad& load = loads.tools[c.tool];
    load.touched = true;
    onTool(load, on_tool, x, h);
    for (int i = 0; i < 3; ++i)
      load.stiffness[i] += c.stiffness * share, load.damping[i] += c.damping * share;
  }
}

void addPlaneContacts(Block& block, const std::vector<PlaneContact>& contacts, float h, ObjectLoads& loads) {
  const Rows r(block);
  for (const PlaneContact& c : contacts) {
    const std::uint32_t k = c.knot;
    const float gap = c.normal[0] * r.x[k] + c.normal[1] * r.y[k] + c.normal[2] * r.z[k] - c.offset;
    if (gap >= 0.0f) continue;
    // evaluate() counts closing along its normal: here the cavity is the "tool", its normal points away from
    // tissue.
    const float n[3] = {-c.normal[0], -c.normal[1], -c.normal[2]}, v[3] = {r.vx[k], r.vy[k], r.vz[k]};
    const Force f = evaluate(gap, v, n, c.stiffness, c.damping, c.grip, c.friction);
    r.fx[k] += f.tangential[0] + f.normal * c.normal[0];
    r.fy[k] += f.tangential[1] + f.normal * c.normal[1];
    r.fz[k] += f.tangential[2] + f.normal * c.normal[2];
    loads.dissipated += f.heat * h;
  }
}

}  // namespace vest::contact
