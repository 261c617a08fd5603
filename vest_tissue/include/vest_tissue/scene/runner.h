#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "vest_tissue/scene/edits.h"
#include "vest_tissue/scene/ring.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/shared/contact_memory.h"

namespace vest::scene {

/// What a Runner paces: the tissue alone, or a composite that adds effects around it.
class Simulation {
 public:
  virtual ~Simulation() = default;
  /// One step. May complete `input` (feedback of effects) before the tissue consumes it; what stands in
  /// `input` afterwards is what was consumed. Real-time safe.
  virtual Status step(StepInput& input, StepReport& report) = 0;
  virtual World& world() = 0;
  virtual void reset() = 0;
  /// Goes on where `before` is, as far as both scenes are the same (World::adopt). What is around the tissue
  /// begins as it was made, or goes on. @return as World::adopt
  virtual std::vector<std::uint32_t> adopt(Simulation& before) { return world().adopt(before.world()); }
  /// Snapshot of all that evolves. @throws std::invalid_argument naming what does not fit; nothing changed
  /// then
  virtual void save(std::vector<std::uint8_t>& bytes) { world().save(bytes); }
  virtual void restore(const std::vector<std::uint8_t>& bytes) { world().restore(bytes); }
  /// Of all that evolves around the World; nothing where there is nothing.
  virtual std::optional<std::uint64_t> effectsHash() { return std::nullopt; }
  /// Appends the parameters that edits of a step's input may change. Before it runs.
  virtual void edits(std::vector<EditableParameter>& out) { editableParameters(world(), out); }
};

/// The tissue without anything around it.
class TissueSimulation : public Simulation {
 public:
  explicit TissueSimulation(World world) : world_(std::move(world)) {}
  Status step(StepInput& input, StepReport& report) override { return world_.step(input, report); }
  World& world() override { return world_; }
  void reset() override { world_.reset(); }

 private:
  World world_;
};

/// The newest that is known of all instruments.
struct ToolSample {
  std::array<ToolInput, tools::kInstrumentCount> tools;
};

/// Commands that change the State between two steps; values are those of vest_msgs/StepInput COMMAND_*.
enum class Command : std::uint8_t { None = 0, Reset = 1, Load = 2, Restore = 3, Adopt = 4 };

/// What one step consumed and told, for publishing and recording. Every step makes one; none is lost.
struct StepFrame {
  StepInput input;
  Command command = Command::None;  ///< applied before the step
  std::string command_argument;
  Status status = Status::Ok;
  std::int64_t steady_ns = 0;  ///< steady clock when it was consumed
  bool has_hash = false;
  std::uint64_t hash = 0;                     ///< after the step
  std::optional<std::uint64_t> effects_hash;  ///< likewise, of a simulation with effects
  std::vector<Event> events;
};

struct ContactFrame {
  std::uint64_t step = 0;
  std::int64_t steady_ns = 0;
  std::array<ContactModel, tools::kInstrumentCount> contacts;
};

/// One field of all knots.
struct FieldFrame {
  Field kind = Field::Strain;
  float minimum = 0.0f, maximum = 1.0f;  ///< unit of the kind: range that is sent
  std::vector<float> values;             ///< unit of the kind, per knot, objects in scene order
};
/// Fields that are sent, with their ranges. Temperature: from below body temperature to where char forms.
/// A maximum of 0: as the values ask, see upperEnd().
struct FieldRange {
  Field kind;
  float minimum, maximum;
};
inline constexpr std::array<FieldRange, 6> kFieldFrames{{{Field::Strain, 0.0f, 1.0f},
                                                         {Field::Temperature, 273.15f, 528.15f},
                                                         {Field::Damage, 0.0f, 1.0f},
                                                         {Field::Perfusion, 0.0f, 1.0f},
                                                         {Field::Char, 0.0f, 1.0f},
                                                         {Field::Stress, 0.0f, 0.0f}}};
/// Upper end of a scale that begins at 0 for values up to `largest`: 1, 2 or 5 times a power of ten, so that
/// it seldom changes. At least 1.
float upperEnd(float largest);

struct StateFrame {
  std::uint64_t step = 0;
  std::uint32_t revision = 0;
  std::uint32_t generation = 0;  ///< grows with every loaded scene
  double time = 0.0;             ///< s
  std::int64_t steady_ns = 0;
  std::vector<float> positions;  ///< m, world, x y z per knot, objects in scene order
  bool has_fields = false;
  std::array<FieldFrame, kFieldFrames.size()> fields;  ///< of all knots, while has_fields
  std::vector<Attachment> attachments;
  std::vector<SlingView> slings;
  std::vector<SuspensionView> suspensions;
  std::vector<ThreadView> threads;
  std::vector<NeedleView> needles;
};

/// What viewers are shown of a World as it is now; generation and steady_ns are the caller's.
/// @param fields also the fields per knot
void readState(const World& world, bool fields, StateFrame& frame);

struct RunnerOptions {
  double speed = 1.0;              ///< simulated over wall time, 0.01 … 1000
  double contact_rate = 250;       ///< Hz, wall time
  double state_rate = 60;          ///< Hz, wall time
  double strain_rate = 10;         ///< Hz, wall time: of all fields per knot
  std::uint32_t hash_every = 100;  ///< steps
  std::uint32_t seed = 1;
  double catch_up_limit = 0.25;  ///< s: what is further behind is given up, and shows in the real-time factor
};

struct RunnerStatistics {
  std::uint64_t step = 0;
  double time = 0.0;              ///< s, simulated
  double real_time_factor = 0.0;  ///< in the last second of wall time
  double step_cpu_time = 0.0;     ///< s, mean of the last second
  bool paused = false;
  bool fault = false;
};

/// Steps a Simulation in a thread of its own: fixed steps, paced to the steady clock. Never skips a step:
/// where the machine is too slow, simulated time falls behind and the real-time factor says so.
class Runner {
 public:
  Runner(std::unique_ptr<Simulation> simulation, const RunnerOptions& options);
  /// Before start(): every step's contact models go to this memory too, for haptic processes.
  /// A volume of the scene goes with them. @throws std::runtime_error: no room for the volume
  void shareContacts(std::unique_ptr<shared::ContactWriter> memory);
  ~Runner();

  /// Begins to step; idempotent.
  void start();
  /// Newest sample of the instruments; the next step consumes it. One caller's thread.
  void setTools(const ToolSample& sample) {
    tools_.back() = sample;
    tools_.publish();
  }

  /// Adds a request to the next step's input. Any thread but the Runner's.
  void request(const TopologyRequest& request);

  // The following run between two steps and wait for it. Any thread but the Runner's.
  void setPaused(bool paused);
  /// Pace from the next step on. @throws std::invalid_argument outside of 0.01 to 1000
  void setSpeed(double speed);
  /// Advances a paused simulation. @return false where it is not paused
  bool advance(std::uint32_t steps);
  void reset();
  /// Swaps the simulation; the old one is destroyed by the caller's thread. @param argument what step_inputs
  /// names
  void load(std::unique_ptr<Simulation> simulation, const std::string& argument);
  /// The same for a scene that was edited: what is the same in both goes on (Simulation::adopt).
  /// @return objects that kept their State
  std::size_t adopt(std::unique_ptr<Simulation> simulation, const std::string& argument);
  /// @param restored runs behind it, before the next step
  /// @throws std::invalid_argument, and then nothing has changed
  void restore(const std::vector<std::uint8_t>& bytes, const std::string& argument,
               const std::function<void(Simulation&)>& restored = {});
  /// The next step applies it.
  void edit(const ParameterEdit& edit);
  /// Runs a function between two steps.
  void call(const std::function<void(Simulation&)>& function);

  RunnerStatistics statistics() const;
  std::uint32_t generation() const { return generation_.load(); }

  // Ends of the queues, for one publishing thread.
  SpscRing<StepFrame>& steps() { return frames_; }
  TripleBuffer<ContactFrame>& contacts() { return contacts_; }
  TripleBuffer<StateFrame>& states() { return states_; }

 private:
  void run();
  void swap(std::unique_ptr<Simulation>& simulation, std::uint64_t volume, Command command,
            const std::string& argument);
  void stepOnce(std::int64_t now);
  std::uint64_t shareVolume(Simulation& simulation);
  void fillContacts(std::int64_t now);
  void shareStep(std::int64_t now);
  void fillState(std::int64_t now);
  void execute(const std::function<void()>& function);

  RunnerOptions options_;
  std::unique_ptr<Simulation> simulation_;
  SpscRing<StepFrame> frames_{4096};
  TripleBuffer<ContactFrame> contacts_;
  TripleBuffer<StateFrame> states_;
  TripleBuffer<ToolSample> tools_;

  std::mutex mutex_;  ///< guards command_; taken by the stepping thread only when has_command_ says so
  std::condition_variable done_;
  const std::function<void()>* command_ = nullptr;
  std::atomic<bool> has_command_{false};
  std::atomic<bool> stop_{false};
  std::mutex caller_;  ///< one command at a time

  std::atomic<std::uint32_t> generation_{1};
  std::atomic<std::uint64_t> step_{0};
  std::atomic<double> time_{0}, factor_{0}, cpu_{0};
  std::atomic<bool> paused_{false}, fault_{false};

  // Of the stepping thread.
  bool pausing_ = false;
  std::uint64_t to_advance_ = 0;
  std::int64_t due_ns_ = 0;
  std::int64_t contact_due_ = 0, state_due_ = 0, strain_due_ = 0;
  std::vector<TopologyRequest> pending_requests_;
  Command pending_command_ = Command::None;
  std::string pending_argument_;
  std::vector<ParameterEdit> pending_edits_;
  ToolSample sample_;
  StepReport report_;
  std::unique_ptr<shared::ContactWriter> memory_;
  shared::ContactImage image_;
  std::thread thread_;
};

}  // namespace vest::scene
