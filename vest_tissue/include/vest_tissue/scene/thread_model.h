#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "vest_tissue/interaction/threads.h"
#include "vest_tissue/net/contacts.h"

namespace vest::scene {

/// What of threads and needles touches: nodes by their numbers, then points of needles, tip first.
struct ThreadPlace {
  std::uint32_t strand = 0;
  std::uint32_t segment = 0;                      ///< node of its segment; of a needle's point the needle
  double s = 0.0;                                 ///< on the segment
  bool rigid = false;                             ///< a needle's point, at `arm`
  bool touches = true;                            ///< false: a needle's centre of mass
  Eigen::Vector3d arm = Eigen::Vector3d::Zero();  ///< m, in the needle's frame
  double radius = 0.0;                            ///< m
  double station = 0.0;  ///< m from the needle's tip, or the thread's end, along needle and thread
};

/// A loop that is tied beforehand, in its packet until a pusher takes it.
struct LoopModel {
  std::uint32_t strand = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m, world: where its knot begins, at the start
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< of suture::roederLoop()'s frame, then
  double standing = 0.0;                                     ///< m: standing part behind the knot
  double give = 0.0;  ///< N/m: what of the standing part runs on to the hand
};

/// All threads of a scene; what never changes.
struct ThreadModel {
  std::shared_ptr<const suture::Model> rods;  ///< a strand per suture, in scene order; null: none
  std::vector<double> strength;               ///< N, per strand: straight
  std::vector<double> knot_strength;  ///< N, per strand: where it is bent tighter than its diameter twice
  std::vector<double> friction;       ///< per strand, on objects: theirs counts where it is more
  std::vector<ThreadPlace> places;
  std::vector<std::uint32_t> first_point;  ///< place of each needle's tip
  std::vector<LoopModel> loops;            ///< in scene order
  int steps = 1;  ///< of the threads in a step, at most: each object's exchanges are a multiple of it
  /// Room for touches: of the State, of a step.
  std::size_t room() const { return rods ? 4 * places.size() + 64 : 0; }
  Eigen::Vector3d at(const suture::State& s, std::size_t place) const {
    const ThreadPlace& p = places[place];
    return p.rigid ? Eigen::Vector3d(s.position[p.segment] + s.frame[p.segment] * p.arm) : s.position[place];
  }
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
  std::array<std::uint32_t, 3> far_knots{};  ///< of an anchor within solid tissue
  std::array<float, 3> far_weights{};
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N
};

/// A support that a channel gives in a part of a step.
struct ChannelSupport {
  std::size_t channel = 0;
  int anchor = 0;  ///< count: the cutting tip
  std::size_t support = 0;
};

/// A triangle that a place may come near.
struct ThreadCandidate {
  std::uint32_t node = 0;
  std::uint16_t object = 0;
  std::uint32_t triangle = 0;
  float distance = 0.0f;  ///< m, when it was looked for
};

/// No meaning between steps; what it remembers spares only work.
struct ThreadScratch {
  explicit ThreadScratch(const suture::Model& model) : rod(model), knots(model.mass.size()) {}
  suture::Scratch rod;
  suture::KnotScratch knots;
  std::vector<ThreadCandidate> candidates;
  std::vector<Eigen::Vector3d> searched;  ///< m: nodes when candidates were looked for
  std::vector<double> way;                ///< m, per object: then
  bool known = false, full = false, faulty = false;
  int parts = 1;  ///< of this step
  std::vector<ThreadReach> reaches;
  std::vector<ThreadPush> pushes;
  std::vector<ChannelSupport> led;                            ///< supports of channels
  std::vector<Eigen::Vector3d> now;                           ///< m, of places, when touches are looked for
  std::size_t hanging = 0;                                    ///< first support in jaws
  std::size_t pushing = 0;                                    ///< first support in and on a pusher
  std::array<std::size_t, tools::kInstrumentCount> pushed{};  ///< of these, per instrument
  std::vector<std::uint8_t> apart;  ///< per place: in a packet or a pusher, where nothing else touches it
  std::vector<std::vector<float>> crowd;  ///< per object and knot: weights of touches
  contact::ObjectLoads loads;             ///< on instruments
};

}  // namespace vest::scene
