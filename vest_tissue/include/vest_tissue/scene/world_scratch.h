#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "vest_tissue/fem/tissue_cut.h"
#include "vest_tissue/interaction/cut_scratch.h"
#include "vest_tissue/interaction/sling_loop.h"
#include "vest_tissue/net/contacts.h"
#include "vest_tissue/net/cut_rings.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/solver/implicit_net.h"

namespace vest::scene {

/// A place on an object: its knots, and their weights.
struct ContactEnd {
  std::uint16_t object = 0;
  std::array<std::uint32_t, 3> knots{};
  std::array<float, 3> weights{};
};

/// A contact of a place on one object with one on another or on itself, evaluated once a batch.
struct OrganContact {
  std::array<ContactEnd, 2> ends;                    ///< a knot and a triangle, or two edges
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< to the first
  float reach = 0;                                   ///< m
  float stiffness = 0, damping = 0, grip = 0, friction = 0;
  int batches = 1;
  /// The end that answers implicitly, for it moves before the other does; -1: both get a force from where
  /// they are.
  std::int8_t implicit_end = -1;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, on the first, held
  /// With full contact: N per knot of both ends, held; they take off the torque of two forces at two places.
  bool balanced = false;
  std::array<Eigen::Vector3d, 6> couple{};
  double heat = 0.0;  ///< J, of this exchange
  /// Per end: the next contact of its object; kNone: there is none. Of both ends on one object the first
  /// counts.
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::array<std::uint32_t, 2> next{kNone, kNone};
};

/// Triangles of the other object that a search for pairs looks at: bounding balls, m, as arrays. Neighbours
/// in their order are neighbours in space: a place is compared with the boxes of blocks first.
class Candidates {
 public:
  void reserve(std::size_t n) {
    room_ = n;
    const std::size_t blocks = n / kBlock + 1;
    for (auto* a : {&x_, &y_, &z_, &radius_}) a->assign(blocks * kBlock, 0.0f);
    triangle_.resize(blocks * kBlock);
    for (auto* a : {&low_, &high_})
      for (auto& axis : *a) axis.assign(blocks, 0.0f);
    near_.assign(blocks, 0);
  }
  void clear() { size_ = 0; }
  bool full() const { return size_ == room_; }
  bool empty() const { return size_ == 0; }
  void push(float x, float y, float z, float radius, std::uint32_t triangle) {
    x_[size_] = x, y_[size_] = y, z_[size_] = z, radius_[size_] = radius, triangle_[size_++] = triangle;
  }
  /// All have been pushed.
  void close() {
    for (std::size_t i = size_; i % kBlock != 0; ++i) x_[i] = y_[i] = z_[i] = 1e9f, radius_[i] = 0.0f;
    for (std::size_t first = 0; first < size_; first += kBlock) {
      const std::size_t end = std::min(size_, first + kBlock), b = first / kBlock;
      const std::vector<float>* const places[] = {&x_, &y_, &z_};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::vector<float>& p = *places[axis];
        float low = p[first] - radius_[first], high = p[first] + radius_[first];
        for (std::size_t i = first + 1; i < end; ++i)
          low = std::min(low, p[i] - radius_[i]), high = std::max(high, p[i] + radius_[i]);
        low_[axis][b] = low, high_[axis][b] = high;
      }
    }
  }
  /// Calls visit(dx² + dy² + dz², radius, triangle) for each ball that comes within `reach` of a point, in
  /// the order in which they were pushed.
  template <class Visit>
  void eachWithin(float px, float py, float pz, float reach, Visit visit) {
    const std::size_t blocks = (size_ + kBlock - 1) / kBlock;
    const float room = 1.0001f * reach, most = room * room;  // more than rounding takes
    const float *x0 = low_[0].data(), *y0 = low_[1].data(), *z0 = low_[2].data(), *x1 = high_[0].data(),
                *y1 = high_[1].data(), *z1 = high_[2].data();
    std::uint32_t* const near = near_.data();
    const auto off = [](float low, float high, float at) {
      const float below = low - at, above = at - high, more = below > above ? below : above;
      return more > 0.0f ? more : 0.0f;
    };
    for (std::size_t b = 0; b < blocks; ++b) {
      const float dx = off(x0[b], x1[b], px), dy = off(y0[b], y1[b], py), dz = off(z0[b], z1[b], pz);
      near[b] = dx * dx + dy * dy + dz * dz <= most;
    }
    for (std::size_t b = 0; b < blocks; ++b) {
      if (near[b] == 0) continue;
      const std::size_t first = b * kBlock;
      const float *x = x_.data() + first, *y = y_.data() + first, *z = z_.data() + first,
                  *r = radius_.data() + first;
      float squared[kBlock];
      std::uint32_t hit[kBlock];
      for (std::size_t i = 0; i < kBlock; ++i) {
        const float dx = x[i] - px, dy = y[i] - py, dz = z[i] - pz, bound = reach + r[i];
        squared[i] = dx * dx + dy * dy + dz * dz;
        hit[i] = squared[i] < bound * bound;
      }
      for (std::size_t i = 0; i < kBlock; ++i)
        if (hit[i] != 0) visit(squared[i], r[i], triangle_[first + i]);
    }
  }

 private:
  static constexpr std::size_t kBlock = 16;
  std::vector<float> x_, y_, z_, radius_;
  std::array<std::vector<float>, 3> low_, high_;  ///< m: boxes of the balls of each block
  std::vector<std::uint32_t> triangle_, near_;
  std::size_t size_ = 0, room_ = 0;
};

/// One of these near a point.
struct NearBall {
  float squared = 0, radius = 0;  ///< m², m
  std::uint32_t triangle = 0;
};

inline constexpr std::size_t kNotKept = ~std::size_t{0};

/// Per object, no meaning between steps. Threads work on neighbours at once: none shares a line of the cache.
struct alignas(64) ObjectScratch {
  std::vector<float> backup;     ///< m: rows X … Z at the start of the step
  std::size_t knots_before = 0;  ///< then
  std::vector<contact::ToolContact> contacts;
  std::vector<contact::Pull> pulls;
  std::vector<contact::PlaneContact> planes;
  /// Per knot, m: until the object's way exceeds it the knot cannot come near a rigid object. Remembered
  /// between steps, spares only work.
  std::vector<double> clear;
  double clear_sunk = 0.0;            ///< m: no more may a cavity's wall have sunk for that to hold
  std::vector<std::uint8_t> near;     ///< per knot
  std::vector<std::uint16_t> shared;  ///< per knot: contacts that share it
  contact::ObjectLoads loads;
  solver::BoundScratch bound;
  Eigen::Vector3f low, high;                           ///< m: box of the knots
  Eigen::Vector3d reaction = Eigen::Vector3d::Zero();  ///< N, of fixed knots, last sub-step
  double heat = 0.0;  ///< J in this step, links and knots, when accounting is on
  std::vector<float> volume_gradient,
      volume_start;           ///< m², m: three rows over the knots, where the gradient was taken
  float volume_share = 1.0f;  ///< of the pressure that an exchange bears, 0 … 1
  double volume = 0.0;        ///< m³ there
  std::vector<net::PackedKnot> packed;
  fem::TissueScratch tissue;              ///< finite elements
  std::vector<Eigen::Vector3d> backup_x;  ///< m: of finite elements, at the start of the step
  std::size_t shape_kept = kNotKept, rings_kept = kNotKept;  ///< where, in WorldScratch::kept_shapes
  std::unique_ptr<solver::ImplicitNet> implicit;             ///< of an object that is stepped implicitly
  net::CutRings rings;                                       ///< of its tube, as cuts have left them
  std::vector<float> active;  ///< N, three rows over the knots: what the organ itself does in this step
  std::vector<std::uint32_t> cut_knots, cut_faces, cut_roots;  ///< finite elements: of this step's cut
  std::vector<fem::Doubling> doublings;
  bool faulty = false;
  bool between = false;     ///< the jaws or blades of the tool that is looked at
  bool search_due = false;  ///< for pairs with others, in this step
  bool over_budget = false;
  float moved = 0.0f;                          ///< m: the furthest that a knot went in this step
  bool begun = false;                          ///< its next batch
  bool joined = false;                         ///< part of a clip that holds several objects
  double sub_step = 0.0;                       ///< s: between two moments at which it takes forces
  double softest = 0.0;                        ///< m/N: Body::softest() of a cut mesh
  std::uint64_t softened = 0, softest_of = 0;  ///< fem::CutFactor::made() that its masses are of; and that
  bool answered = true;  ///< elastostatic: Body::answer() of all knots that held forces act on
  /// sqrt(m/N): sum and greatest of what ends of connections answer that it holds in equilibrium.
  double answers = 0.0, greatest_answer = 0.0;
  int answering = 0;                                                                      ///< these ends
  std::uint32_t first_contact = OrganContact::kNone, last_contact = OrganContact::kNone;  ///< organ_contacts
};

/// Held forces of a connection on its end 0, N, and what carries the other end of its damper.
struct ConnectionForce {
  Eigen::Vector3d spring = Eigen::Vector3d::Zero(), damping = Eigen::Vector3d::Zero();
  bool soft = false;  ///< an end is in equilibrium
  /// m/N: how each end that is in equilibrium answers, others that hold its object included; else zero.
  std::array<Eigen::Matrix3d, 2> softness{Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  net::Anchor damper;
  /// N: what this exchange does to the knots of each end.
  std::array<std::array<std::array<float, 3>, 4>, 2> knots{};
  double dissipated = 0.0;  ///< J, likewise, when accounting is on
  double torn = 0.0;        ///< N: with which it breaks now; 0: it does not
};

/// Who works on what: the shares of a pool's threads.
struct Shares {
  std::vector<std::size_t> bodies, body_ends;  ///< objects that deform, each on the same thread in all rounds
  std::vector<std::size_t> next;         ///< per object: the one that its thread works on after it, or itself
  std::vector<std::size_t> search_ends;  ///< the same, with one more before them
  std::size_t chunks = 1;                ///< into which connections and organ contacts are divided
};

/// What a sling draws in during one step: each knot once.
struct LoopTissue {
  static constexpr std::size_t kMost = 3 * interaction::kSlingNodes;
  int count = 0;
  std::array<std::uint32_t, kMost> knots{};
  std::array<std::array<std::uint8_t, 3>, interaction::kSlingNodes> slot{};  ///< per node: places in `knots`
  bool held = false;  ///< its applicator holds the central knot
  Eigen::Vector3d knot = Eigen::Vector3d::Zero(),
                  travel = Eigen::Vector3d::Zero();  ///< m: of that in the step
};

struct WorldScratch {
  std::vector<ObjectScratch> objects;
  std::vector<OrganContact> organ_contacts;
  std::vector<OrganPair> old_pairs;  ///< those of the last search, in order
  Candidates candidates;
  std::vector<NearBall> near_balls;
  std::vector<ConnectionForce> connection_force;
  /// N: per clip of the State, on the first part that shares its id, at each place of their joint.
  std::array<std::array<Eigen::Vector3d, 2>, interaction::kMaxClips> clip_force{};
  std::vector<std::uint32_t> part, part_first, part_size;                ///< support.cpp
  std::array<LoopTissue, interaction::kMaxSlings> loops;                 ///< per sling of the State
  interaction::LoopStep loop_step;                                       ///< of the loop that moves
  std::vector<std::pair<std::uint16_t, std::uint32_t>> loop_candidates;  ///< near it: object, triangle
  interaction::CutScratch cut;
  std::unique_ptr<ThreadScratch> threads;              ///< null without any
  std::vector<std::uint8_t> kept_motion, kept_shapes;  ///< what a fault gives back (rollback.cpp)
  std::array<interaction::Proxy, tools::kInstrumentCount> proxies_before{};
  std::array<interaction::PlacedCapsule, interaction::kMaxToolCapsules>
      capsules_before[tools::kInstrumentCount];
  std::array<interaction::PlacedCapsule, interaction::kMaxToolCapsules>
      capsules_after[tools::kInstrumentCount];
  std::array<int, tools::kInstrumentCount> capsule_count{};
  explicit WorldScratch(const WorldModel& model);
  WorldScratch() = default;
  /// What was remembered of a State that is no longer the one.
  void forget() {
    for (ObjectScratch& o : objects) {
      std::fill(o.clear.begin(), o.clear.end(), 0.0);
      o.tissue.forget();
      o.rings.forget();
    }
    if (threads) threads->known = false;
  }
  std::array<bool, tools::kInstrumentCount> appeared{};  ///< not there in the step before
};

}  // namespace vest::scene
