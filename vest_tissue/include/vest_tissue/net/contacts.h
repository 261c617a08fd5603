#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "vest_tissue/net/block.h"

namespace vest::contact {

/// The law of every unilateral contact: what it pushes with, N >= 0, and its friction: a damper (N·s/m) whose
/// force Coulomb limits, so that it fades to zero with the slip.
template <typename T>
struct Pressed {
  T push, drag;
  /// @param gap m, < 0  @param closing, slip m/s  @param k N/m  @param c, grip N·s/m  @param mu no unit
  Pressed(T gap, T closing, T slip, T k, T c, T grip, T mu)
      : push(std::max(-k * gap + c * closing, T(0))),
        drag(slip * grip > mu * push ? mu * push / slip : grip) {}
};

/// Contact of a tool's capsule with a triangle of knots, found once a step, evaluated in every sub-step: the
/// normal and the places on triangle and axis stay, the gap follows knots and tool.
struct ToolContact {
  std::array<std::uint32_t, 3> knots;
  std::array<float, 3> weights;
  float normal[3];  ///< from tissue to tool
  float start[3];   ///< m: point of the tool's axis at the start of the step
  float travel[3];  ///< m: its way over the step
  float jaw[3];     ///< m/rad: its way as the jaws open; zero where it is on no jaw
  float reach;      ///< m: radius + contact thickness
  float stiffness;  ///< N/m
  float damping;    ///< N·s/m along the normal
  float grip;       ///< N·s/m: greatest tangential damping that friction amounts to
  float friction;   ///< Coulomb
  std::uint8_t tool;
  std::uint8_t capsule;
  std::uint32_t triangle;
};

inline constexpr std::uint8_t kNoTool = 253;  ///< Pull::tool of what no tool holds

/// A knot held in the jaws, or by something else: bilateral spring and damper to a point that moves with the
/// tool.
struct Pull {
  std::uint32_t knot;
  float start[3], travel[3];  ///< m
  float stiffness, damping;
  std::uint8_t tool;    ///< that feels it; kNoTool: none
  std::uint8_t anchor;  ///< index in the grasp
};

/// Contact of a knot with the cavity: free space is normal·x >= offset.
struct PlaneContact {
  std::uint32_t knot;
  float normal[3];
  float offset;  ///< m
  float stiffness, damping, grip, friction;
};

/// What the tools did to an object in a step: impulses on the tool and work on the tissue.
struct ToolLoad {
  double impulse[3] = {};      ///< N·s, tissue on tool
  double moment[3] = {};       ///< N·m·s about the world's origin
  double stiffness[6] = {};    ///< N/m: sum of active k·n·n^T (xx yy zz xy xz yz), averaged over sub-steps
  double damping[6] = {};      ///< N·s/m likewise
  double normal[3] = {};       ///< sum of impulse-weighted normals
  double jaw_impulse = 0.0;    ///< N·m·s, tissue on the jaws; positive opens them
  double jaw_stiffness = 0.0;  ///< N·m/rad: of the active contacts against the jaws, averaged over sub-steps
  bool touched = false;
};

struct ObjectLoads {
  std::array<ToolLoad, 4> tools;
  double work = 0.0;        ///< J, by tools on the tissue and its contact springs
  double dissipated = 0.0;  ///< J, in contacts' dampers and friction
  double stored = 0.0;      ///< J, in contact springs at the end of the step
};

/// What a force of the tissue (N) for a time h does to the jaws that it meets (ToolContact::jaw).
/// @param n the contact's normal  @param stiffness N/m, its share of the step included
void onJaws(ToolLoad& load, const float jaw[3], const float f[3], const float n[3], double h,
            double stiffness);

/// Adds the forces of one sub-step to the block's F rows. `fraction`: of the step that has passed at its
/// start.
void addToolContacts(net::Block& block, const std::vector<ToolContact>& contacts, float fraction, float h,
                     float dt, ObjectLoads& loads);
void addPulls(net::Block& block, const std::vector<Pull>& pulls, float fraction, float h, float dt,
              ObjectLoads& loads);
void addPlaneContacts(net::Block& block, const std::vector<PlaneContact>& contacts, float h,
                      ObjectLoads& loads);

}  // namespace vest::contact
