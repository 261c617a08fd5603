#include "vest_tissue/ros/tissue_server.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>

#include <diagnostic_msgs/DiagnosticArray.h>

#include "vest_instruments/ros/frames.h"
#include "vest_tissue/ros/nearest_stamp.h"
#include "vest_tissue/ros/parameters.h"
#include "vest_tissue/ros/scene_file.h"
#include "vest_tissue/scene/falling.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/request.h"
#include "vest_tissue/scene/scene_files.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::ros_shell {
namespace {

std::int64_t steadyNow() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

constexpr std::size_t kRecent = 64;  // messages: 64 ms of the trainer's instruments; a state is younger
/// ns: where no states come (paused), the instruments are published at about their rate all the same.
constexpr std::int64_t kToolsLatest = 20000000;
constexpr double kTellRefusal = 5.0;  // s: some /diagnostics (1 Hz) say what was refused

}  // namespace

std::unique_ptr<shared::SessionLock> TissueServer::holdSession(const std::string& ns) {
  constexpr double kPatience = 10.0;  // s: of a session that has just been told to end
  try {
    return std::make_unique<shared::SessionLock>(
        "the simulation", shared::contactMemoryName(ros::master::getURI(), ns) + "_simulation", kPatience);
  } catch (const shared::SessionTaken&) {
    throw;
  } catch (const std::exception& e) {
    ROS_WARN_ONCE("%s; a second simulation in this session would not be noticed", e.what());
    return nullptr;
  }
}

TissueServer::TissueServer(ros::NodeHandle nh, ros::NodeHandle private_nh, Factory factory, Publish publish,
                           std::unique_ptr<shared::SessionLock> alone)
    : nh_(nh),
      private_nh_(private_nh),
      alone_(std::move(alone)),
      factory_(std::move(factory)),
      publish_(std::move(publish)) {
  if (!alone_) alone_ = holdSession(nh_.getNamespace());
  framePrefix();  // a wrong one is refused here, not with the first message
  scene_ = stringParameter(private_nh_, "scene", "gynaecology");
  threads_ = intParameter(private_nh_, "threads", 1, 1, 64);
  session_directory_ = stringParameter(private_nh_, "session_directory", "");
  wait_for_recorder_ = boolParameter(private_nh_, "wait_for_recorder", false);
  wait_for_hands_ = boolParameter(private_nh_, "wait_for_hands", false);
  recorder_timeout_ = doubleParameter(private_nh_, "recorder_timeout", 90.0, 0.0, 3600.0);
  scene::RunnerOptions options;
  options.speed = doubleParameter(private_nh_, "speed", options.speed, 0.01, 1000.0);
  options.catch_up_limit = doubleParameter(private_nh_, "catch_up", options.catch_up_limit, 0.0, 10.0);
  options.state_rate = doubleParameter(private_nh_, "state_rate", options.state_rate, 1.0, 500.0);
  options.contact_rate = doubleParameter(private_nh_, "contact_rate", options.contact_rate, 1.0, 500.0);
  options.strain_rate = doubleParameter(private_nh_, "strain_rate", options.strain_rate, 0.1, 500.0);
  options.seed = static_cast<std::uint32_t>(intParameter(private_nh_, "seed", 1, 0, 2147483647));

  Loaded loaded = loadFile(scene_, nullptr);
  topology_ = loaded.topology;
  description_ = loaded.description;
  editable_ = loaded.edits;
  falling_ = loaded.falling;
  published_revision_ = topology_->revision;
  runner_ = std::make_unique<scene::Runner>(std::move(loaded.simulation), options);
  if (boolParameter(private_nh_, "share_contacts", true)) {
    try {
      runner_->shareContacts(std::make_unique<shared::ContactWriter>(
          shared::contactMemoryName(ros::master::getURI(), nh_.getNamespace())));
    } catch (const std::exception& e) {
      ROS_WARN("%s; the simulation runs without haptic devices", e.what());
    }
  }

  topology_pub_ = nh_.advertise<vest_msgs::TissueTopology>("tissue/topology", 2, true);
  files_pub_ = nh_.advertise<vest_msgs::SceneFiles>("tissue/scene", 10, true);
  publishFiles(loaded.files);
  publishImage(*description_);
  delta_pub_ = nh_.advertise<vest_msgs::TissueTopologyDelta>("tissue/topology_delta", 1000);
  state_pub_ = nh_.advertise<vest_msgs::TissueState>("tissue/state", 10);
  contacts_pub_ = nh_.advertise<vest_msgs::ContactModels>("tissue/contacts", 100);
  tools_pub_ = nh_.advertise<vest_msgs::InstrumentStates>("tissue/instruments", 10);
  events_pub_ = nh_.advertise<vest_msgs::TissueEvent>("tissue/events", 1000);
  attachments_pub_ = nh_.advertise<vest_msgs::TissueAttachments>("tissue/attachments", 10);
  sutures_pub_ = nh_.advertise<vest_msgs::SutureStates>("tissue/sutures", 10);
  markers_pub_ = nh_.advertise<visualization_msgs::MarkerArray>("tissue/markers", 1);
  hash_pub_ = nh_.advertise<vest_msgs::StateHash>("tissue/state_hash", 100);
  effects_hash_pub_ = nh_.advertise<vest_msgs::StateHash>("effects/state_hash", 100);
  session_pub_ = nh_.advertise<vest_msgs::SessionState>("session/state", 10);
  diagnostics_pub_ = nh_.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
  // Last: who finds it has all the others (the recorder waits for that).
  steps_pub_ = nh_.advertise<vest_msgs::StepInput>("step_inputs", 8000);

  ros::NodeHandle input(nh_);
  input.setCallbackQueue(&input_queue_);
  const auto hints = ros::TransportHints().tcpNoDelay();
  instruments_ = input.subscribe("instruments", 10, &TissueServer::onInstruments, this, hints);
  silence_timer_ =
      input.createSteadyTimer(ros::WallDuration(0.02), [this](const ros::SteadyTimerEvent&) { onSilence(); });
  recording_ = input.subscribe("session/recording", 10, &TissueServer::onRecording, this);
  edits_ = input.subscribe("parameter_edit", 100, &TissueServer::onEdit, this);
  ros::NodeHandle service(nh_);
  service.setCallbackQueue(&service_queue_);
  recorder_timer_ = service.createSteadyTimer(ros::WallDuration(0.5),
                                              [this](const ros::SteadyTimerEvent&) { watchRecorder(); });
  services_.push_back(service.advertiseService("tissue/load_scene", &TissueServer::onLoad, this));
  services_.push_back(service.advertiseService("tissue/edit_scene", &TissueServer::onEditScene, this));
  services_.push_back(service.advertiseService("tissue/reset", &TissueServer::onReset, this));
  services_.push_back(service.advertiseService("tissue/pause", &TissueServer::onPause, this));
  services_.push_back(service.advertiseService("tissue/speed", &TissueServer::onSpeed, this));
  services_.push_back(service.advertiseService("tissue/step", &TissueServer::onStep, this));
  services_.push_back(service.advertiseService("tissue/request", &TissueServer::onRequest, this));
  services_.push_back(service.advertiseService("tissue/snapshot", &TissueServer::onSnapshot, this));

  recorded_ = !wait_for_recorder_;
  held_ = wait_for_recorder_ || wait_for_hands_;
  if (held_ || boolParameter(private_nh_, "paused", false)) runner_->setPaused(true);
  runner_->start();
  publisher_ = std::thread([this] { publishLoop(); });
  input_spinner_.start();
  service_spinner_.start();
}

TissueServer::~TissueServer() {
  input_spinner_.stop();
  service_spinner_.stop();
  stop_ = true;
  if (publisher_.joinable()) publisher_.join();
}

TissueServer::Loaded TissueServer::loadFile(const std::string& scene, const scene::WorldModel* before) const {
  scene::SceneFiles files;
  scene::Description description = scene::loadScene(sceneFile(scene), files);
  Loaded loaded;
  loaded.files = toMessage(scene, description.hash, files);
  const std::string condensed = scene::condensedSentence(description);
  if (!condensed.empty()) ROS_INFO("scene %s: %s", description.name.c_str(), condensed.c_str());
  description.preparing = [](const std::string& object, double share) {
    ROS_INFO_THROTTLE(10, "preparing %s: %.0f %%", object.c_str(), 100 * share);
  };
  scene::World world(scene::buildModel(description, before), threads_);
  loaded.topology = boost::make_shared<vest_msgs::TissueTopology>();
  toMsg(world, *loaded.topology);
  loaded.falling = scene::fallingSentence(description);
  if (!loaded.falling.empty()) ROS_WARN("scene %s: %s", description.name.c_str(), loaded.falling.c_str());
  loaded.description = std::make_shared<const scene::Description>(std::move(description));
  loaded.simulation = factory_(std::move(world));
  loaded.simulation->edits(loaded.edits);
  return loaded;
}

void TissueServer::onInstruments(const vest_msgs::InstrumentStates::ConstPtr& msg) {
  if (!fromMsg(*msg, sample_)) {
    ++refused_inputs_;
    ROS_WARN_THROTTLE(
        5, "instruments: an unknown name or tool, or a pose that is not finite; its last good pose is kept");
  }
  instruments_time_ = ros::SteadyTime::now();
  runner_->setTools(sample_);
  const auto of_box = [](const vest_msgs::InstrumentState& s) {
    return s.source == vest_msgs::InstrumentState::SOURCE_BOX &&
           s.tool != vest_msgs::InstrumentState::TOOL_NONE;
  };
  const auto there = [&](const vest_msgs::InstrumentState& s) { return s.valid || !of_box(s); };
  if (std::any_of(msg->instruments.begin(), msg->instruments.end(), of_box) &&
      std::all_of(msg->instruments.begin(), msg->instruments.end(), there))
    hands_there_ = true;
  std::lock_guard<std::mutex> lock(recent_mutex_);
  if (!recent_.empty() && msg->header.stamp < recent_.back()->header.stamp) recent_.clear();
  recent_.push_back(msg);
  if (recent_.size() > kRecent) recent_.pop_front();
}

void TissueServer::onSilence() {
  constexpr double kStale = 0.1;  // s, as for pedals
  if ((ros::SteadyTime::now() - instruments_time_).toSec() < kStale) return;
  bool on = false;
  for (scene::ToolInput& tool : sample_.tools) {
    on = on || tool.functions != 0;
    tool.functions = 0;
  }
  if (on) runner_->setTools(sample_);
}

void TissueServer::refuseInput(const std::string& sentence) {
  ++refused_inputs_;
  ROS_WARN_THROTTLE(0.2, "%s", sentence.c_str());
  std::lock_guard<std::mutex> lock(refusal_mutex_);
  refusal_ = sentence;
  refusal_time_ = ros::SteadyTime::now();
}

void TissueServer::onEdit(const vest_msgs::ParameterEdit::ConstPtr& msg) {
  const scene::ParameterEdit edit{msg->object, msg->parameter, msg->value};
  std::string why;
  {
    std::lock_guard<std::mutex> lock(loaded_mutex_);
    why = scene::refusal(editable_, edit);
  }
  if (!why.empty()) return refuseInput("parameter_edit: " + why + "; nothing changes");
  runner_->edit(edit);
}

bool TissueServer::onLoad(vest_msgs::LoadScene::Request& req, vest_msgs::LoadScene::Response& res) {
  return load(req.scene, false, res);
}

bool TissueServer::onEditScene(vest_msgs::LoadScene::Request& req, vest_msgs::LoadScene::Response& res) {
  return load(req.scene, true, res);
}

bool TissueServer::load(const std::string& scene, bool keep, vest_msgs::LoadScene::Response& res) {
  try {
    const scene::WorldModel* before = nullptr;  // that of a World which only this service swaps
    if (keep) runner_->call([&](scene::Simulation& s) { before = &s.world().model(); });
    Loaded loaded = loadFile(scene, before);
    loading_ = true;
    publishFiles(loaded.files);
    if (keep) {
      res.message = std::to_string(runner_->adopt(std::move(loaded.simulation), scene)) + " objects went on";
      runner_->call([&](scene::Simulation& s) { toMsg(s.world(), *loaded.topology); });
    } else {
      runner_->load(std::move(loaded.simulation), scene);
    }
    std::lock_guard<std::mutex> lock(loaded_mutex_);
    topology_ = loaded.topology;
    description_ = loaded.description;
    publishImage(*description_);
    editable_ = loaded.edits;
    falling_ = loaded.falling;
    topology_due_ = true;
    loading_ = false;
    res.success = true;
    if (!keep) res.message = "loaded " + description_->name;
    res.scene_hash = description_->hash;
    snapshots_.clear();
  } catch (const std::exception& e) {
    loading_ = false;
    res.success = false;
    res.message = e.what();
    if (keep)
      ROS_ERROR("edit_scene refused, the present scene goes on: %s", e.what());
    else
      ROS_ERROR("load_scene refused, the present scene goes on: %s", e.what());
  }
  return true;
}

bool TissueServer::onReset(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& res) {
  runner_->reset();
  topology_due_ = true;
  res.success = true;
  res.message = "step 0";
  return true;
}

bool TissueServer::onPause(std_srvs::SetBool::Request& req, std_srvs::SetBool::Response& res) {
  held_ = false;
  runner_->setPaused(req.data);
  res.success = true;
  res.message = req.data ? "paused" : "running";
  return true;
}

bool TissueServer::onSpeed(vest_msgs::SetSpeed::Request& req, vest_msgs::SetSpeed::Response& res) {
  try {
    runner_->setSpeed(req.speed);
    res.success = true;
  } catch (const std::invalid_argument& e) {
    res.success = false;
    res.message = e.what();
  }
  return true;
}

bool TissueServer::onRequest(vest_msgs::TissueRequest::Request& req,
                             vest_msgs::TissueRequest::Response& res) {
  try {
    std::shared_ptr<const scene::Description> description;
    {
      std::lock_guard<std::mutex> lock(loaded_mutex_);
      description = description_;
    }
    const scene::TopologyRequest request = scene::parseRequest(req.request, *description);
    res.message = "in the next step";
    if (request.kind == scene::TopologyRequest::Kind::RemoveClip) {
      std::vector<scene::Attachment> attachments;
      runner_->call([&](scene::Simulation& s) { s.world().attachments(attachments); });
      const auto clip = std::find_if(attachments.begin(), attachments.end(), [&](const scene::Attachment& a) {
        return a.kind == vest_msgs::TissueAttachment::CLIP && a.id == request.element;
      });
      if (clip == attachments.end())
        throw std::invalid_argument("there is no clip " + req.request.substr(12));
      res.message = "clip on " + description->objects[clip->anchor.object].name + " at station " +
                    std::to_string(clip->station) + " m, closure " + std::to_string(clip->closure);
    }
    runner_->request(request);
    res.success = true;
  } catch (const std::exception& e) {
    res.success = false;
    res.message = e.what();
  }
  return true;
}

bool TissueServer::onStep(vest_msgs::Step::Request& req, vest_msgs::Step::Response& res) {
  res.success = req.steps <= 1000000 && runner_->advance(req.steps);
  if (!res.success) {
    res.message = req.steps > 1000000 ? "steps: " + std::to_string(req.steps) + " (allowed: at most 1000000)"
                                      : "not paused: call tissue/pause with true before tissue/step";
  }
  runner_->call([&](scene::Simulation& s) {
    res.step = s.world().steps();
    res.time = s.world().time();
    res.state_hash = s.world().stateHash();
  });
  return true;
}

ros::Time TissueServer::stamp(std::int64_t steady_ns) const {
  const std::int64_t t = steady_ns + clock_offset_ns_;
  ros::Time time;
  if (t > 0) time.fromNSec(static_cast<std::uint64_t>(t));
  return time;
}

void TissueServer::followClock() {
  const std::int64_t before = steadyNow();
  const std::int64_t system = static_cast<std::int64_t>(ros::Time::now().toNSec());
  const std::int64_t after = steadyNow();
  // Put aside between the two clocks: the next reading tells.
  if (clock_offset_ns_ != 0 && after - before > 1000000) return;
  const std::int64_t offset = system - before;
  const std::int64_t error = offset - clock_offset_ns_;
  if (std::abs(error) > 5000000) {
    if (clock_offset_ns_ != 0) {
      ++clock_jumps_;
      ROS_WARN_THROTTLE(1, "the system clock jumped by %.3f s: stamps follow it, the simulation does not",
                        1e-9 * static_cast<double>(error));
    }
    clock_offset_ns_ = offset;
  } else {
    clock_offset_ns_ += error / 256;  // follows a slewed clock without steps in the stamps
  }
}

void TissueServer::publishLoop() {
  pthread_setname_np(pthread_self(), "vest_publisher");
  using Clock = std::chrono::steady_clock;
  const auto begin = Clock::now();
  auto next = begin;
  double session_due = 0, diagnostics_due = 0, topology_due = 0;
  while (!stop_) {
    next += std::chrono::milliseconds(2);
    if (next < Clock::now()) next = Clock::now();
    std::this_thread::sleep_until(next);
    const double t = std::chrono::duration<double>(Clock::now() - begin).count();
    followClock();
    startWhenReady(t);
    if (topology_due_ || t >= topology_due) {
      topology_due = t + 10.0;
      publishTopology();
    }
    publishSteps();
    if (runner_->contacts().update()) {
      const auto msg = contact_pool_.take();
      const scene::ContactFrame& frame = runner_->contacts().front();
      msg->header.seq = ++contact_sequence_;
      msg->header.stamp = stamp(frame.steady_ns);
      toMsg(frame, 1e-9 * static_cast<double>(steadyNow() - frame.steady_ns), *msg);
      contacts_pub_.publish(vest_msgs::ContactModels::ConstPtr(msg));
    }
    if (runner_->states().update()) publishState();
    if (steadyNow() - tools_published_ns_ > kToolsLatest) publishInstruments(stamp(steadyNow()));
    if (publish_ && !loading_) publish_([this](std::int64_t steady_ns) { return stamp(steady_ns); });
    if (t >= session_due) {
      session_due = t + 0.5;
      publishSession();
    }
    if (t >= diagnostics_due) {
      diagnostics_due = t + 1.0;
      publishDiagnostics();
    }
  }
}

void TissueServer::publishTopology() {
  topology_due_ = false;
  std::lock_guard<std::mutex> lock(loaded_mutex_);
  // A message that was published is never touched again: a new header needs a copy.
  const auto msg = boost::make_shared<vest_msgs::TissueTopology>(*topology_);
  msg->header.stamp = stamp(steadyNow());
  published_revision_ = msg->revision;
  topology_pub_.publish(vest_msgs::TissueTopology::ConstPtr(msg));
}

void TissueServer::publishChangedTopology(std::uint32_t revision) {
  std::vector<scene::TopologyDelta> deltas;
  bool known = false;
  const auto whole = boost::make_shared<vest_msgs::TissueTopology>();
  runner_->call([&](scene::Simulation& s) {
    known = s.world().deltasSince(published_revision_, deltas);
    toMsg(s.world(), *whole);
  });
  {
    std::lock_guard<std::mutex> lock(loaded_mutex_);
    topology_ = whole;
  }
  if (!known) return publishTopology();
  for (const scene::TopologyDelta& delta : deltas) {
    vest_msgs::TissueTopologyDelta msg;
    toMsg(delta, msg);
    msg.header.stamp = stamp(steadyNow());
    msg.step = whole->step;
    delta_pub_.publish(msg);
  }
  published_revision_ = revision;
}

void TissueServer::publishSteps() {
  std::shared_ptr<const scene::Description> description;
  {
    std::lock_guard<std::mutex> lock(loaded_mutex_);
    description = description_;
  }
  while (scene::StepFrame* frame = runner_->steps().front()) {
    const ros::Time time = stamp(frame->steady_ns);
    const auto msg = step_pool_.take();
    toMsg(*frame, *description, *msg);
    msg->header.seq = ++step_sequence_;
    msg->header.stamp = time;
    steps_pub_.publish(vest_msgs::StepInput::ConstPtr(msg));
    for (const scene::Event& event : frame->events) {
      const auto e = boost::make_shared<vest_msgs::TissueEvent>();
      toMsg(event, *description, *e);
      e->header.stamp = time;
      e->id = ++event_id_;
      events_pub_.publish(vest_msgs::TissueEvent::ConstPtr(e));
    }
    if (frame->has_hash) {
      vest_msgs::StateHash hash;
      hash.header.stamp = time;
      hash.step = frame->input.step;
      hash.hash = frame->hash;
      hash_pub_.publish(hash);
      if (frame->effects_hash) {
        hash.hash = *frame->effects_hash;
        effects_hash_pub_.publish(hash);
      }
    }
    runner_->steps().pop();
  }
}

void TissueServer::publishState() {
  const scene::StateFrame& frame = runner_->states().front();
  // A viewer gets the topology first, then states that belong to it.
  if (loading_ || topology_due_ || frame.generation != runner_->generation()) return;
  if (frame.revision != published_revision_) publishChangedTopology(frame.revision);
  publishInstruments(stamp(frame.steady_ns));  // first: who gets the state has them
  const auto msg = state_pool_.take();
  toMsg(frame, *msg);
  msg->header.seq = ++state_sequence_;
  msg->header.stamp = stamp(frame.steady_ns);
  state_pub_.publish(vest_msgs::TissueState::ConstPtr(msg));

  std::lock_guard<std::mutex> lock(loaded_mutex_);
  const auto attachments = boost::make_shared<vest_msgs::TissueAttachments>();
  toMsg(frame, *description_, *attachments);
  attachments->header.stamp = msg->header.stamp;
  attachments_pub_.publish(vest_msgs::TissueAttachments::ConstPtr(attachments));
  const bool sutures_there = !frame.slings.empty() || !frame.threads.empty() || !frame.suspensions.empty();
  if (sutures_there || had_sutures_) {  // once more when the last one is gone
    had_sutures_ = sutures_there;
    const auto sutures = boost::make_shared<vest_msgs::SutureStates>();
    toMsg(frame, *description_, *sutures);
    sutures->header.stamp = msg->header.stamp;
    sutures_pub_.publish(vest_msgs::SutureStates::ConstPtr(sutures));
  }
  const double now = 1e-9 * static_cast<double>(frame.steady_ns);
  if (now >= next_markers_ && markers_pub_.getNumSubscribers() > 0) {
    next_markers_ = now + 0.1;
    const auto markers = boost::make_shared<visualization_msgs::MarkerArray>();
    toMarkers(*topology_, frame, *markers);
    for (auto& m : markers->markers) m.header.stamp = msg->header.stamp;
    markers_pub_.publish(visualization_msgs::MarkerArray::ConstPtr(markers));
  }
}

void TissueServer::publishInstruments(const ros::Time& moment) {
  tools_published_ns_ = steadyNow();
  vest_msgs::InstrumentStates::ConstPtr nearest;
  {
    std::lock_guard<std::mutex> lock(recent_mutex_);
    nearest = nearestStamp(recent_, moment);
  }
  if (!nearest || nearest == published_tools_) return;
  published_tools_ = nearest;
  tools_pub_.publish(nearest);
}

void TissueServer::publishSession() {
  const scene::RunnerStatistics s = runner_->statistics();
  vest_msgs::SessionState msg;
  {
    std::lock_guard<std::mutex> lock(recording_mutex_);
    if ((ros::SteadyTime::now() - recording_time_).toSec() < 2.0) msg = recording_state_;
    if (recorder_died_) msg = vest_msgs::SessionState();
  }
  if (recorder_died_) msg.status = kRecorderDied;
  msg.header.stamp = stamp(steadyNow());
  msg.state = s.fault ? vest_msgs::SessionState::FAULT
                      : (s.paused ? vest_msgs::SessionState::PAUSED : vest_msgs::SessionState::RUNNING);
  {
    std::lock_guard<std::mutex> lock(loaded_mutex_);
    msg.scene = description_->name;
  }
  msg.step = s.step;
  msg.simulated_time = s.time;
  msg.real_time_factor = s.real_time_factor;
  msg.step_cpu_time = s.step_cpu_time;
  if (held_) msg.status = recorded_ ? "waiting for the hands" : "waiting for the recorder";
  if (s.fault) msg.status = "an object fell back to its last good state";
  session_pub_.publish(msg);
}

void TissueServer::publishDiagnostics() {
  const scene::RunnerStatistics s = runner_->statistics();
  diagnostic_msgs::DiagnosticArray msg;
  msg.header.stamp = stamp(steadyNow());
  msg.status.resize(1);
  diagnostic_msgs::DiagnosticStatus& status = msg.status[0];
  status.name = "vest: simulation";
  status.hardware_id = "none";
  const bool slow = !s.paused && s.real_time_factor < 0.95;
  std::string refused;
  bool lately = false;
  {
    std::lock_guard<std::mutex> lock(refusal_mutex_);
    refused = refusal_;
    lately = !refused.empty() && (ros::SteadyTime::now() - refusal_time_).toSec() < kTellRefusal;
  }
  std::string falling;
  {
    std::lock_guard<std::mutex> lock(loaded_mutex_);
    falling = falling_;
  }
  status.level = s.fault                                ? diagnostic_msgs::DiagnosticStatus::ERROR
                 : (slow || lately || !falling.empty()) ? diagnostic_msgs::DiagnosticStatus::WARN
                                                        : diagnostic_msgs::DiagnosticStatus::OK;
  status.message = s.fault            ? "fault: last good state kept"
                   : lately           ? "refused: " + refused
                   : !falling.empty() ? falling
                   : s.paused         ? "paused"
                   : slow             ? "slower than real time"
                                      : "real time";
  const auto add = [&](const char* key, double value) {
    diagnostic_msgs::KeyValue kv;
    kv.key = key;
    kv.value = std::to_string(value);
    status.values.push_back(kv);
  };
  add("step", static_cast<double>(s.step));
  add("real_time_factor", s.real_time_factor);
  add("step_cpu_time_s", s.step_cpu_time);
  add("refused_inputs", static_cast<double>(refused_inputs_));
  add("clock_jumps", static_cast<double>(clock_jumps_));
  diagnostic_msgs::KeyValue last;
  last.key = "last_refused_input";
  last.value = refused;
  status.values.push_back(last);
  diagnostics_pub_.publish(msg);
}

}  // namespace vest::ros_shell
