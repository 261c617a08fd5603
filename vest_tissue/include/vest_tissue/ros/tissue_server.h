#pragma once

#include <atomic>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>

#include <vest_msgs/LoadScene.h>
#include <vest_msgs/ParameterEdit.h>
#include <vest_msgs/SceneFiles.h>
#include <vest_msgs/SessionState.h>
#include <vest_msgs/SetSpeed.h>
#include <vest_msgs/Snapshot.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/Step.h>
#include <vest_msgs/TissueRequest.h>

#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/ros/message_pool.h"
#include "vest_tissue/scene/runner.h"
#include "vest_tissue/scene/scene_files.h"
#include "vest_tissue/shared/session_lock.h"

namespace vest::ros_shell {

/// Topics and services tissue/*, step_inputs and session/state around a Runner (docs/ros_interface.md). The
/// tissue node and the Trainer differ only in the Simulation that the factory makes.
class TissueServer {
 public:
  using Factory = std::function<std::unique_ptr<scene::Simulation>(scene::World world)>;
  /// Stamp of a moment of the steady clock.
  using Stamp = std::function<ros::Time(std::int64_t steady_ns)>;
  /// Publishes what a composite has beside the tissue; called every 2 ms by the publishing thread.
  using Publish = std::function<void(const Stamp& stamp)>;

  /// Loads the scene and begins. @throws std::invalid_argument naming parameter or file, value and what is
  /// allowed; shared::SessionTaken where another process simulates in this session (master and namespace)
  /// @param alone what holdSession() gave; null: asked for here
  TissueServer(ros::NodeHandle nh, ros::NodeHandle private_nh, Factory factory, Publish publish = {},
               std::unique_ptr<shared::SessionLock> alone = nullptr);
  ~TissueServer();

  /// The session (master and namespace) for one simulation alone. A node asks before its first NodeHandle:
  /// from then on the master has told one of the same name to end. Null, with a warning, without shared
  /// memory.
  /// @param ns launch namespace  @throws shared::SessionTaken after 10 s in which nobody ended
  static std::unique_ptr<shared::SessionLock> holdSession(const std::string& ns);

 private:
  /// Status of session/state from then on; viewers look for it.
  static constexpr char kRecorderDied[] = "THE RECORDER HAS DIED: nothing is recorded";

  struct Loaded {
    std::unique_ptr<scene::Simulation> simulation;
    boost::shared_ptr<vest_msgs::TissueTopology> topology;
    std::shared_ptr<const scene::Description> description;
    std::vector<scene::EditableParameter> edits;
    boost::shared_ptr<vest_msgs::SceneFiles> files;
    std::string falling;  ///< scene::fallingSentence
  };

  /// @param before  model of which what stands the same is not built again; null: all is
  Loaded loadFile(const std::string& scene, const scene::WorldModel* before) const;
  void onInstruments(const vest_msgs::InstrumentStates::ConstPtr& msg);
  void onSilence();  ///< of the instruments: nothing is on that nobody says is on
  void onEdit(const vest_msgs::ParameterEdit::ConstPtr& msg);
  /// Counts it, warns with one sentence, and has /diagnostics say it for a while.
  void refuseInput(const std::string& sentence);
  void onRecording(const vest_msgs::SessionState::ConstPtr& msg);
  bool load(const std::string& scene, bool keep, vest_msgs::LoadScene::Response& res);
  bool onEditScene(vest_msgs::LoadScene::Request& req, vest_msgs::LoadScene::Response& res);
  bool onLoad(vest_msgs::LoadScene::Request& req, vest_msgs::LoadScene::Response& res);
  bool onReset(std_srvs::Trigger::Request& req, std_srvs::Trigger::Response& res);
  bool onPause(std_srvs::SetBool::Request& req, std_srvs::SetBool::Response& res);
  bool onSpeed(vest_msgs::SetSpeed::Request& req, vest_msgs::SetSpeed::Response& res);
  bool onStep(vest_msgs::Step::Request& req, vest_msgs::Step::Response& res);
  bool onRequest(vest_msgs::TissueRequest::Request& req, vest_msgs::TissueRequest::Response& res);
  bool onSnapshot(vest_msgs::Snapshot::Request& req, vest_msgs::Snapshot::Response& res);
  std::string snapshotFile(const std::string& name) const;
  /// Whether the session's folder is there: nothing else makes it than the recorder.
  bool keepsFiles() const;
  /// Files above 64 MB are not sent: a recording then has to find them again.
  static boost::shared_ptr<vest_msgs::SceneFiles> toMessage(const std::string& scene, const std::string& hash,
                                                            const scene::SceneFiles& files);
  void publishFiles(const boost::shared_ptr<vest_msgs::SceneFiles>& files);
  void publishImage(const scene::Description& description);

  void publishLoop();
  void publishSteps();
  void publishState();
  /// The instruments of the moment of a state: displays need no more, and 1 kHz over a socket is dear.
  void publishInstruments(const ros::Time& moment);
  void publishTopology();
  void publishChangedTopology(std::uint32_t revision);
  void publishSession();
  void publishDiagnostics();
  void startWhenReady(double waited);
  enum class Recorder { Unknown, Absent, Killed, There };
  /// What the master and the recorder's own address say of it. Waits for both, up to seconds.
  Recorder lookForRecorder() const;
  /// Notices that the recorder died, says so once, and keeps saying it in session/state.
  void watchRecorder();
  /// Whether a recorder that the start waits for will never come. Asks the master: not while it runs.
  bool recorderGone();
  ros::Time stamp(std::int64_t steady_ns) const;
  void followClock();

  ros::NodeHandle nh_, private_nh_;
  std::unique_ptr<shared::SessionLock> alone_;
  Factory factory_;
  Publish publish_;
  int threads_ = 1;
  std::string scene_, session_directory_;
  bool wait_for_recorder_ = false, wait_for_hands_ = false;
  double recorder_timeout_ = 60.0;
  std::atomic<bool> held_{false};  ///< paused until a recorder listens, and until a script's hands are there
  std::atomic<bool> recorded_{false}, hands_there_{false};
  double held_since_ = 0;  ///< s since the start: for hands alone
  double next_look_ = 0;   ///< s since the start: for a recorder that will never listen

  std::unique_ptr<scene::Runner> runner_;
  std::mutex
      loaded_mutex_;  ///< topology_, description_, editable_, falling_; never held by the stepping thread
  boost::shared_ptr<vest_msgs::TissueTopology> topology_;
  std::shared_ptr<const scene::Description> description_;
  std::vector<scene::EditableParameter> editable_;  ///< likewise
  std::string falling_;                             ///< likewise
  std::atomic<bool> topology_due_{true}, loading_{false};
  std::map<std::string, std::vector<std::uint8_t>> snapshots_;

  ros::CallbackQueue input_queue_, service_queue_;
  ros::AsyncSpinner input_spinner_{1, &input_queue_}, service_spinner_{1, &service_queue_};
  ros::Subscriber instruments_, recording_, edits_;
  std::vector<ros::ServiceServer> services_;
  ros::Publisher topology_pub_, files_pub_, image_pub_, delta_pub_, state_pub_, contacts_pub_, events_pub_,
      attachments_pub_, tools_pub_, sutures_pub_, markers_pub_, steps_pub_, hash_pub_, effects_hash_pub_,
      session_pub_, diagnostics_pub_;

  // Of the input thread.
  scene::ToolSample sample_;
  ros::SteadyTime instruments_time_;
  ros::SteadyTimer silence_timer_, recorder_timer_;
  std::mutex recent_mutex_;  ///< recent_: of the input and the publishing thread
  std::deque<vest_msgs::InstrumentStates::ConstPtr> recent_;  ///< the last messages, oldest first
  std::atomic<std::uint64_t> refused_inputs_{0};
  std::mutex refusal_mutex_;
  std::string refusal_;  ///< the last one
  ros::SteadyTime refusal_time_;

  // Of the publishing thread.
  MessagePool<vest_msgs::StepInput> step_pool_;
  MessagePool<vest_msgs::ContactModels> contact_pool_;
  MessagePool<vest_msgs::TissueState> state_pool_;
  std::uint32_t state_sequence_ = 0, contact_sequence_ = 0, step_sequence_ = 0;
  std::uint64_t event_id_ = 0, clock_jumps_ = 0;
  std::int64_t clock_offset_ns_ = 0;
  double next_markers_ = 0.0;
  std::int64_t tools_published_ns_ = 0;  ///< steady clock
  vest_msgs::InstrumentStates::ConstPtr published_tools_;
  bool had_sutures_ = false;
  std::uint32_t published_revision_ = 0;
  std::mutex recording_mutex_;
  vest_msgs::SessionState recording_state_;
  ros::SteadyTime recording_time_;
  bool recorder_seen_ = false;              ///< it was there, and has not said that it ends
  std::atomic<bool> recorder_died_{false};  ///< until another one says something

  std::atomic<bool> stop_{false};
  std::thread publisher_;
};

}  // namespace vest::ros_shell
