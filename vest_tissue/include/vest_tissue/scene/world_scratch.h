#pragma once

#include <vector>

#include "vest_tissue/contact/contacts.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::scene {

/// A contact of a knot with another object's triangle, evaluated once a batch.
struct OrganContact {
  std::uint16_t object = 0, other = 0;
  std::uint32_t knot = 0;
  std::array<std::uint32_t, 3> triangle{};
  std::array<float, 3> weights{};
  float normal[3] = {};   ///< from the triangle to the knot
  float reach = 0;        ///< m
  float stiffness = 0, damping = 0, grip = 0, friction = 0;
  int batches = 1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, held
};

/// Per object, no meaning between steps.
struct ObjectScratch {
  std::vector<float> backup;                   ///< motion at the start of the step
  std::vector<contact::ToolContact> contacts;
  std::vector<contact::Pull> pulls;
  std::vector<contact::PlaneContact> planes;
  std::vector<std::uint8_t> near;              ///< per knot
  std::vector<std::uint16_t> shared;           ///< per knot: contacts that share it
  contact::ObjectLoads loads;
  solver::BoundScratch bound;
  Eigen::Vector3f low, high;                   ///< m: box of the knots
  double heat = 0.0;                           ///< J in this step, links and knots, when accounting is on
  bool faulty = false;
  bool over_budget = false;
};

struct WorldScratch {
  std::vector<ObjectScratch> objects;
  std::vector<OrganContact> organ_contacts;
  std::vector<Eigen::Vector3d> connection_force;  ///< N on end 0, held
  Energy energy_before;
  std::array<interaction::Proxy, tools::kInstrumentCount> proxies_before{};
  std::array<interaction::Grasp, tools::kInstrumentCount> grasps_before{};
  std::array<interaction::PlacedCapsule, interaction::kMaxToolCapsules> capsules_before[tools::kInstrumentCount];
  std::array<interaction::PlacedCapsule, interaction::kMaxToolCapsules> capsules_after[tools::kInstrumentCount];
  std::array<int, tools::kInstrumentCount> capsule_count{};
  explicit WorldScratch(const WorldModel& model);
  WorldScratch() = default;
};

}  // namespace vest::scene
