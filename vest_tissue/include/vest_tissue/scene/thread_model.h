#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "vest_tissue/interaction/threads.h"
#include "vest_tissue/net/contacts.h"

namespace vest::scene {

/// All threads of a scene; what never changes.
struct ThreadModel {
  std::shared_ptr<const suture::Model> rods;  ///< a strand per suture, in scene order; null: none
  std::vector<double> strength;               ///< N, per strand: straight
  std::vector<double> knot_strength;  ///< N, per strand: where it is bent tighter than its diameter twice
  int steps = 1;  ///< of the threads in a step: each object's exchanges are a multiple of it
  /// Room for touches: of the State, of a step.
  std::size_t room() const { return rods ? 4 * rods->mass.size() + 64 : 0; }
};

/// A touch in this step.
struct ThreadReach {
  interaction::ThreadTouch touch;
  std::uint32_t triangle = 0;               ///< Tissue
  Eigen::Vector3d normal, place;            ///< Rigid, JawFace: plane at the step's end of the place
  Eigen::Vector3d normal_then, place_then;  ///< and at its start
  int support = -1;                         ///< number in suture::Scratch::supports
};

/// Force of a thread on knots of an object, held until the thread's next step.
struct ThreadPush {
  std::uint16_t object = 0;
  std::array<std::uint32_t, 3> knots{};
  std::array<float, 3> weights{};
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N
};

/// A triangle that a node may come near.
struct ThreadCandidate {
  std::uint32_t node = 0;
  std::uint16_t object = 0;
  std::uint32_t triangle = 0;
};

/// No meaning between steps; what it remembers spares only work.
struct ThreadScratch {
  explicit ThreadScratch(const suture::Model& model) : rod(model) {}
  suture::Scratch rod;
  std::vector<ThreadCandidate> candidates;
  std::vector<Eigen::Vector3d> searched;  ///< m: nodes when candidates were looked for
  std::vector<double> way;                ///< m, per object: then
  bool known = false, full = false, faulty = false;
  std::vector<ThreadReach> reaches;
  std::vector<ThreadPush> pushes;
  std::vector<std::vector<float>> crowd;  ///< per object and knot: weights of touches
  contact::ObjectLoads loads;             ///< on instruments
};

}  // namespace vest::scene
