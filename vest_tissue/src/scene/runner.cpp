#include "vest_tissue/scene/runner.h"

#include <ctime>

#include <algorithm>
#include <chrono>
#include <exception>
#include <stdexcept>

#include <pthread.h>
#include <sched.h>

#include "vest_tissue/scene/fill_record.h"

namespace vest::scene {
namespace {

constexpr std::int64_t kSecond = 1000000000;

std::int64_t steadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

void sleepUntil(std::int64_t steady_ns) {
  const timespec t{static_cast<time_t>(steady_ns / kSecond), static_cast<long>(steady_ns % kSecond)};
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

double threadCpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

bool elapsed(std::int64_t now, double rate, std::int64_t& due) {
  if (now < due) return false;
  const auto period = static_cast<std::int64_t>(1e9 / rate);
  due = now - due > period ? now + period : due + period;
  return true;
}

void refuse(const char* name, double value, const char* allowed) {
  throw std::invalid_argument(std::string(name) + ": " + std::to_string(value) + " (allowed: " + allowed +
                              ")");
}

double checkedSpeed(double speed) {
  if (!(speed >= 0.01 && speed <= 1000)) refuse("speed", speed, "0.01 to 1000");
  return speed;
}

RunnerOptions checked(RunnerOptions o) {
  checkedSpeed(o.speed);
  if (!(o.contact_rate >= 1 && o.contact_rate <= 1000))
    refuse("contact_rate", o.contact_rate, "1 to 1000 Hz");
  if (!(o.state_rate >= 1 && o.state_rate <= 1000)) refuse("state_rate", o.state_rate, "1 to 1000 Hz");
  if (!(o.strain_rate >= 0.1 && o.strain_rate <= 1000))
    refuse("strain_rate", o.strain_rate, "0.1 to 1000 Hz");
  if (o.hash_every == 0) refuse("hash_every", 0, "1 or more steps");
  return o;
}

}  // namespace

float upperEnd(float largest) {
  float end = 1.0f;
  for (int i = 0; end < largest && i < 100; ++i) end *= i % 3 == 1 ? 2.5f : 2.0f;
  return end;
}

Runner::Runner(std::unique_ptr<Simulation> simulation, const RunnerOptions& options)
    : options_(checked(options)), simulation_(std::move(simulation)) {
  frames_.forEachSlot([](StepFrame& f) {
    f.events.reserve(32);
    f.input.impacts.reserve(16);
    f.input.dilatations.reserve(16);
  });
  report_.events.reserve(256);
  step_ = simulation_->world().steps();
  time_ = simulation_->world().time();
}

Runner::~Runner() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

void Runner::start() {
  if (!thread_.joinable()) thread_ = std::thread([this] { run(); });
}

RunnerStatistics Runner::statistics() const {
  return {step_, time_, factor_, cpu_, paused_, fault_};
}

void Runner::execute(const std::function<void()>& function) {
  std::lock_guard<std::mutex> caller(caller_);
  if (!thread_.joinable()) return function();
  std::exception_ptr error;
  const std::function<void()> guarded = [&] {
    try {
      function();
    } catch (...) {
      error = std::current_exception();
    }
  };
  std::unique_lock<std::mutex> lock(mutex_);
  command_ = &guarded;
  has_command_ = true;
  done_.wait(lock, [this] { return command_ == nullptr; });
  lock.unlock();
  if (error) std::rethrow_exception(error);
}

void Runner::call(const std::function<void(Simulation&)>& function) {
  execute([&] { function(*simulation_); });
}

void Runner::setPaused(bool paused) {
  execute([&] {
    pausing_ = paused;
    to_advance_ = 0;
    paused_ = paused;
  });
}

void Runner::setSpeed(double speed) {
  checkedSpeed(speed);
  execute([&] { options_.speed = speed; });
}

bool Runner::advance(std::uint32_t steps) {
  bool accepted = false;
  std::uint64_t target = 0;
  execute([&] {
    accepted = pausing_ && thread_.joinable();
    if (!accepted) return;
    to_advance_ += steps;
    target = simulation_->world().steps() + to_advance_;
  });
  while (accepted && !stop_ && step_ < target && paused_)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return accepted;
}

void Runner::request(const TopologyRequest& request) {
  execute([&] { pending_requests_.push_back(request); });
}

void Runner::reset() {
  execute([&] {
    simulation_->reset();
    if (memory_) memory_->beginGeneration();
    fault_ = false;
    pending_command_ = Command::Reset;
    pending_argument_.clear();
  });
}

void Runner::shareContacts(std::unique_ptr<shared::ContactWriter> memory) {
  memory_ = std::move(memory);
  image_.volume = shareVolume(*simulation_);
}

std::uint64_t Runner::shareVolume(Simulation& simulation) {
  const auto& feel = simulation.world().description().feel;
  return memory_ && feel ? memory_->shareVolume(*feel) : 0;
}

void Runner::swap(std::unique_ptr<Simulation>& simulation, std::uint64_t volume, Command command,
                  const std::string& argument) {
  simulation_.swap(simulation);
  image_.volume = volume;
  ++generation_;
  if (memory_) memory_->beginGeneration();
  fault_ = false;
  pending_command_ = command;
  pending_argument_ = argument;
}

void Runner::load(std::unique_ptr<Simulation> simulation, const std::string& argument) {
  const std::uint64_t volume = shareVolume(*simulation);  // copied before the steps wait
  execute([&] { swap(simulation, volume, Command::Load, argument); });
}

std::size_t Runner::adopt(std::unique_ptr<Simulation> simulation, const std::string& argument) {
  const std::uint64_t volume = shareVolume(*simulation);
  std::size_t kept = 0;
  execute([&] {
    const std::vector<std::uint32_t> to = simulation->adopt(*simulation_);
    kept = to.size() - static_cast<std::size_t>(std::count(to.begin(), to.end(), kNotAdopted));
    swap(simulation, volume, Command::Adopt, argument);
  });
  return kept;
}

void Runner::restore(const std::vector<std::uint8_t>& bytes, const std::string& argument,
                     const std::function<void(Simulation&)>& restored) {
  execute([&] {
    simulation_->restore(bytes);
    if (memory_) memory_->beginGeneration();
    fault_ = false;
    pending_command_ = Command::Restore;
    pending_argument_ = argument;
    if (restored) restored(*simulation_);
  });
}

void Runner::edit(const ParameterEdit& edit) {
  execute([&] { pending_edits_.push_back(edit); });
}

void Runner::fillContacts(std::int64_t now) {
  ContactFrame& frame = contacts_.back();
  frame.step = simulation_->world().steps();
  frame.steady_ns = now;
  frame.contacts = report_.contacts;
  contacts_.publish();
}

void Runner::shareStep(std::int64_t now) {
  if (!memory_) return;
  image_.step = simulation_->world().steps();
  image_.steady_ns = now;
  for (std::size_t i = 0; i < report_.contacts.size(); ++i) {
    shared::fillRecord(report_.contacts[i], sample_.tools[i], image_.contacts[i]);
  }
  memory_->write(image_);
}

void readState(const World& world, bool fields, StateFrame& frame) {
  std::size_t knots = 0;
  for (std::size_t i = 0; i < world.objectCount(); ++i) knots += world.knotCount(i);
  frame.positions.resize(3 * knots);
  frame.has_fields = fields;
  for (std::size_t f = 0; f < frame.fields.size(); ++f) {
    FieldFrame& field = frame.fields[f];
    field.kind = kFieldFrames[f].kind;
    field.minimum = kFieldFrames[f].minimum, field.maximum = kFieldFrames[f].maximum;
    field.values.resize(knots);
  }
  std::size_t at = 0;
  for (std::size_t i = 0; i < world.objectCount(); ++i) {
    world.positions(i, frame.positions.data() + 3 * at);
    for (FieldFrame& field : frame.fields)
      if (frame.has_fields) world.field(i, field.kind, field.values.data() + at);
    at += world.knotCount(i);
  }
  for (FieldFrame& field : frame.fields)
    if (frame.has_fields && field.maximum <= field.minimum && !field.values.empty())
      field.maximum = upperEnd(*std::max_element(field.values.begin(), field.values.end()));
  frame.step = world.steps();
  frame.revision = world.revision();
  frame.time = world.time();
  frame.attachments.clear();
  world.attachments(frame.attachments);
  world.slings(frame.slings);
  world.suspensions(frame.suspensions);
  world.threads(frame.threads);
  world.needles(frame.needles);
}

void Runner::fillState(std::int64_t now) {
  StateFrame& frame = states_.back();
  readState(simulation_->world(), elapsed(now, options_.strain_rate, strain_due_), frame);
  frame.generation = generation_;
  frame.steady_ns = now;
  states_.publish();
}

void Runner::stepOnce(std::int64_t now) {
  if (tools_.update()) sample_ = tools_.front();
  StepFrame& frame = *frames_.back();
  World& world = simulation_->world();
  StepInput& input = frame.input;
  input.step = world.steps() + 1;
  input.dt = world.description().dt;
  input.seed = options_.seed;
  input.tools = sample_.tools;
  input.edits.clear();
  input.edits.swap(pending_edits_);
  input.impacts.clear();
  input.loads.clear();
  input.load_over = 0.0;
  input.dilatations.clear();
  input.requests = pending_requests_;
  pending_requests_.clear();
  frame.command = pending_command_;
  frame.command_argument = pending_argument_;
  pending_command_ = Command::None;
  frame.steady_ns = now;
  frame.status = simulation_->step(input, report_);
  if (frame.status == Status::Fault) fault_ = true;
  frame.events = report_.events;
  if (frame.status != Status::Fault) shareStep(now);
  frame.has_hash = input.step % options_.hash_every == 0;
  if (frame.has_hash) {
    frame.hash = world.stateHash();
    frame.effects_hash = simulation_->effectsHash();
  }
  step_ = world.steps();
  time_ = world.time();
  frames_.push();
}

void Runner::run() {
  pthread_setname_np(pthread_self(), "vest_simulation");
  // Real-time priority where the machine grants it; without it the default has to do.
  const sched_param parameter{1};
  pthread_setschedparam(pthread_self(), SCHED_RR, &parameter);

  due_ns_ = steadyNow();
  contact_due_ = state_due_ = strain_due_ = due_ns_;
  std::int64_t window_start = due_ns_;
  std::uint64_t window_steps = 0;
  double window_time = 0.0, window_cpu = threadCpuSeconds();
  while (!stop_) {
    if (has_command_) {
      std::lock_guard<std::mutex> lock(mutex_);
      (*command_)();
      command_ = nullptr;
      has_command_ = false;
      step_ = simulation_->world().steps();
      time_ = simulation_->world().time();
      done_.notify_all();
    }
    std::int64_t now = steadyNow();
    const bool stepping = !pausing_ || to_advance_ > 0;
    if (!stepping ||
        frames_.back() == nullptr) {  // paused, or whoever publishes is seconds behind: wait, lose nothing
      sleepUntil(now + 2000000);
      now = steadyNow();
      due_ns_ = now;
    } else {
      if (!pausing_) {
        if (now < due_ns_) {
          sleepUntil(due_ns_);
          now = steadyNow();
        }
        const auto limit = static_cast<std::int64_t>(options_.catch_up_limit * 1e9);
        if (now - due_ns_ > limit) due_ns_ = now;
        due_ns_ += static_cast<std::int64_t>(1e9 * simulation_->world().description().dt / options_.speed);
      } else {
        --to_advance_;
        due_ns_ = now;
      }
      stepOnce(now);
      ++window_steps;
      window_time += simulation_->world().description().dt;
    }
    if (elapsed(now, options_.contact_rate, contact_due_)) fillContacts(now);
    if (elapsed(now, options_.state_rate, state_due_)) fillState(now);
    if (now - window_start >= kSecond) {
      const double cpu = threadCpuSeconds();
      factor_ = window_time / (1e-9 * static_cast<double>(now - window_start));
      cpu_ = window_steps > 0 ? (cpu - window_cpu) / static_cast<double>(window_steps) : 0.0;
      window_start = now;
      window_steps = 0;
      window_time = 0.0;
      window_cpu = cpu;
    }
  }
  // A caller that still waits must not hang.
  std::lock_guard<std::mutex> lock(mutex_);
  if (command_) {
    (*command_)();
    command_ = nullptr;
    done_.notify_all();
  }
}

}  // namespace vest::scene
