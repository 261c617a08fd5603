#pragma once

#include <array>
#include <cstring>
#include <vector>

#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/exercise/motion_log.h"
#include "vest_tissue/scene/loose.h"
#include "vest_tissue/scene/stitches.h"
#include "vest_tissue/scene/world_state.h"

namespace vest::exercise {

constexpr std::size_t kHands = 3;  ///< left, right, third
constexpr std::uint64_t kMotionEvery =
    MotionLog::kEvery;                      ///< steps: by chords of 20 ms, whatever the box's rate
constexpr std::uint64_t kFieldsEvery = 20;  ///< steps: damage and pools
constexpr std::uint64_t kPartsEvery = 200;  ///< steps: what is cut free, and where it is; knots
constexpr std::size_t kMostWindow = 64;     ///< steps of the force window

/// Objects of the scene that a number or event is about.
struct Objects {
  std::vector<std::uint8_t> in;  ///< per object of the scene
  std::vector<std::size_t> list;
};

/// A mark's circle on tissue at rest.
struct Circle {
  Eigen::Vector3d centre, normal;  ///< m; of the surface there
  double radius;                   ///< m
};

struct BuiltNumber {
  Metric metric;
  std::size_t tool = 0;
  Objects objects;
  std::vector<std::size_t> marks;
  std::vector<double> stations;                    ///< m, of the marks on the tube
  std::vector<std::vector<std::uint8_t>> regions;  ///< per object of the list: knots within the mark's radius
  std::vector<Circle> circles;  ///< of the marks, at rest, where a cut's line or a bite is asked for
};

struct BuiltMark {
  Eigen::Vector3d at;  ///< m: place, or offset from the knot
  int object = -1;
  std::size_t knot = 0;
};

struct Node {
  Condition::Kind kind;
  scene::EventKind event;
  int tool;
  Objects objects;
  double station_low, station_high;
  double count;
  std::size_t number = 0;
  double low, high, seconds;
  std::vector<std::size_t> children;
};
/// Nodes of one condition, children before parents; the last is the root.
struct Range {
  std::size_t begin = 0, end = 0;
};

struct Engine::Model {
  Exercise exercise;
  const simulation::GasEffect* gas = nullptr;
  const simulation::BloodEffect* blood = nullptr;
  const simulation::OperatingField* field = nullptr;
  std::vector<BuiltMark> marks;
  std::vector<BuiltNumber> numbers;
  std::vector<Node> nodes;
  std::vector<Range> starts, phases, gates, errors;  ///< starts: empty where a phase has none
  std::vector<std::size_t> items;                    ///< number of each
  std::vector<std::size_t> phase_of_item;
  std::size_t window = 20;                  ///< steps
  double optic_least = -1, optic_most = 2;  ///< cosines of the optic's angle
  std::size_t scene_objects = 0;
  bool pools = false, knots = false, tension = false;
  MotionLog::Tools logged{};  ///< whose figures of motion are asked for
};

// Members of 8 bytes alone: no padding, the bytes are saved and hashed.
struct NodeState {
  double count = 0, held = 0;
  std::uint64_t latched = 0, value = 0;
};
struct PhaseState {
  std::uint64_t due = 0, begun = 0, ended = 0;  ///< steps; 0: not yet. due: it waits for its start
  double since = 0;                             ///< s: when it became due, then when it began
};
struct ToolState {
  std::uint64_t seen = 0, at = 0, touches = 0, touching = 0, moves = 0, wrong = 0;
  double path = 0, idle = 0, force = 0, peak = 0, impulse = 0, free = 1e9, hidden = 0, out_of_view = 0;
  std::array<double, 3> place{};  ///< m, at the last chord
  std::array<double, kMostWindow> window{};
};
struct ObjectState {
  std::array<double, 4> contact{};  ///< N, per instrument
  double contact_peak = 0, cut_area = 0, clips = 0, clip_tilt = 0;
  double cut_first = 1e9, cut_last = -1e9;  ///< m: stations
};
struct ItemState {
  double begin = 0, end = 0;
};
/// Of threads.
struct ThreadsState {
  std::uint64_t at = 0;
  double tension = 0, peak = 0;  ///< N, means of 20 ms
  double determinant = 1, tail = 0, off = 0;
  std::array<double, kMostWindow> window{};
};
struct Clock {
  std::uint64_t steps = 0, begun = 0, phase = 0, hinted = 0, finished = 0, flags = 0, wrong_optic = 0,
                input_hash = 14695981039346656037ULL;
  /// s. `time` begins anew with the first phase; `lived` does not.
  double time = 0, lived = 0, lost_at_start = 0, both_move = 0, pool = 0, sucked_at_start = 0;
};
/// s since the first phase began.
inline double sinceBegin(const Clock& clock) {
  return clock.begun != 0 ? clock.time : 0.0;
}

struct Engine::State {
  Clock clock;
  std::vector<NodeState> nodes;
  std::vector<PhaseState> phases;
  std::vector<std::uint64_t> gates;   ///< step at which it was broken; 0: not
  std::vector<std::uint64_t> errors;  ///< times
  std::vector<std::uint64_t> error_was;
  std::vector<ItemState> items;
  std::vector<double> numbers;  ///< what a number keeps for itself
  std::vector<double> results;  ///< of the items, when it ended
  std::array<ToolState, kHands> tools;
  ThreadsState threads;
  std::vector<ObjectState> objects;
  std::vector<Moment> moments;
  MotionLog log;

  template <class Self, class Archive>
  static void walk(Self& s, Archive&& archive) {
    archive(&s.clock, sizeof s.clock), archive(s.tools.data(), sizeof s.tools);
    archive(&s.threads, sizeof s.threads);
    const auto all = [&](auto& v) { archive(v.data(), v.size() * sizeof v[0]); };
    all(s.nodes), all(s.phases), all(s.gates), all(s.errors), all(s.error_was), all(s.items);
    all(s.numbers), all(s.results), all(s.objects);
  }
};

struct Engine::Scratch {
  explicit Scratch(const scene::World& world)
      : loose(world), knots(world.state().threads.rod.position.size()) {}
  std::vector<float> damage;  ///< room for the largest object and its copies
  scene::LooseScratch loose;
  scene::Bites bites;
  suture::KnotScratch knots;
};

/// What numbers are made of, after a step.
void measure(const Engine::Model& m, const scene::World& world, const scene::StepInput& input,
             const scene::StepReport& report, Engine::State& s, Engine::Scratch& scratch);
double valueOf(const Engine::Model& m, const Engine::State& s, std::size_t number, const scene::World& world,
               const scene::StepInput& input);
/// What it came to, or stands at; figures of motion when it is finished. Allocates: no part of a step.
Result resultOf(const Engine::Model& m, const Engine::State& s);

}  // namespace vest::exercise
