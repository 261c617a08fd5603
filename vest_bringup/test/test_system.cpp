#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <set>
#include <sstream>

#include <ros/ros.h>
#include <ros/service_manager.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_srvs/SetBool.h>
#include <std_srvs/Trigger.h>
#include <topic_tools/shape_shifter.h>

#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/LoadScene.h>
#include <vest_msgs/SessionState.h>
#include <vest_msgs/SetSpeed.h>
#include <vest_msgs/Snapshot.h>
#include <vest_msgs/Step.h>
#include <vest_msgs/StepInput.h>
#include <vest_msgs/TissueState.h>

#include "vest_instruments/ros/service_call.h"

// Protects the interface of docs/ros_interface.md on the running system: topics with their types, services,
// refusals.

namespace {

using vest::ros_shell::callService;

const std::map<std::string, std::string> kTopics = {
    {"/vest/phantom_box/joint_states", "sensor_msgs/JointState"},
    {"/vest/phantom_box/footswitches", "sensor_msgs/Joy"},
    {"/vest/joint_states", "sensor_msgs/JointState"},
    {"/vest/instruments", "vest_msgs/InstrumentStates"},
    {"/vest/tissue/instruments", "vest_msgs/InstrumentStates"},
    {"/vest/tissue/topology", "vest_msgs/TissueTopology"},
    {"/vest/tissue/state", "vest_msgs/TissueState"},
    {"/vest/tissue/contacts", "vest_msgs/ContactModels"},
    {"/vest/tissue/attachments", "vest_msgs/TissueAttachments"},
    {"/vest/tissue/state_hash", "vest_msgs/StateHash"},
    {"/vest/step_inputs", "vest_msgs/StepInput"},
    {"/vest/session/state", "vest_msgs/SessionState"},
    {"/diagnostics", "diagnostic_msgs/DiagnosticArray"},
    {"/tf", "tf2_msgs/TFMessage"},
};

TEST(System, EveryTopicOfTheContractSpeaksWithItsType) {
  ros::NodeHandle nh;
  std::map<std::string, std::string> seen;
  std::vector<ros::Subscriber> subscribers;
  for (const auto& [topic, type] : kTopics) {
    const std::string name = topic;
    subscribers.push_back(nh.subscribe<topic_tools::ShapeShifter>(
        name, 10,
        boost::function<void(const topic_tools::ShapeShifter::ConstPtr&)>(
            [&seen, name](const topic_tools::ShapeShifter::ConstPtr& m) { seen[name] = m->getDataType(); })));
  }
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(60);
  while (ros::ok() && seen.size() < kTopics.size() && ros::WallTime::now() < end) {
    ros::spinOnce();
    ros::WallDuration(0.01).sleep();
  }
  for (const auto& [topic, type] : kTopics) EXPECT_EQ(seen[topic], type) << topic;
}

/// Displays take the instruments from here: with each state those of its moment (nearestStamp() has a test of
/// its own), and few beside.
TEST(System, TheInstrumentsOfEachStateComeWithItAndGoOnWhilePaused) {
  ros::NodeHandle nh;
  std::set<ros::Time> all, of_states;
  std::vector<ros::Time> states;
  const auto heard = [&](std::set<ros::Time>* to) {
    return boost::function<void(const vest_msgs::InstrumentStates::ConstPtr&)>(
        [to](const vest_msgs::InstrumentStates::ConstPtr& m) { to->insert(m->header.stamp); });
  };
  const ros::Subscriber fast =
      nh.subscribe<vest_msgs::InstrumentStates>("/vest/instruments", 10000, heard(&all));
  const ros::Subscriber slow =
      nh.subscribe<vest_msgs::InstrumentStates>("/vest/tissue/instruments", 1000, heard(&of_states));
  const ros::Subscriber state =
      nh.subscribe<vest_msgs::TissueState>("/vest/tissue/state", 1000,
                                           boost::function<void(const vest_msgs::TissueState::ConstPtr&)>(
                                               [&](const vest_msgs::TissueState::ConstPtr& m) {
                                                 if (!all.empty() && !of_states.empty())
                                                   states.push_back(m->header.stamp);
                                               }));
  const auto spinUntil = [&](const std::function<bool()>& done) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(60);
    while (ros::ok() && !done() && ros::WallTime::now() < end) {
      ros::spinOnce();
      ros::WallDuration(0.01).sleep();
    }
    return done();
  };
  ASSERT_TRUE(spinUntil([&] { return states.size() >= 100; }));
  spinUntil([&] { return *all.rbegin() > states.back(); });
  EXPECT_LT(of_states.size(), all.size() / 4) << "that is why displays listen here";
  int foreign = 0;
  for (const ros::Time& t : of_states) foreign += t > *all.begin() && t < *all.rbegin() && all.count(t) == 0;
  EXPECT_LE(foreign, 1) << "messages are passed on as they are";

  ASSERT_TRUE(ros::service::waitForService("/vest/tissue/pause", ros::Duration(60)));
  std_srvs::SetBool pause;
  pause.request.data = true;
  ASSERT_TRUE(callService("/vest/tissue/pause", pause));
  of_states.clear();
  EXPECT_TRUE(spinUntil([&] { return of_states.size() >= 10; }))
      << "instruments move while the tissue stands";
  pause.request.data = false;
  ASSERT_TRUE(callService("/vest/tissue/pause", pause));
}

TEST(System, PauseStepAndResetDoWhatTheySay) {
  ros::NodeHandle nh;
  ASSERT_TRUE(ros::service::waitForService("/vest/tissue/pause", ros::Duration(60)));
  vest_msgs::Step step;
  step.request.steps = 5;
  ASSERT_TRUE(callService("/vest/tissue/step", step));
  EXPECT_FALSE(step.response.success) << "a running simulation is not stepped";
  std_srvs::SetBool pause;
  pause.request.data = true;
  ASSERT_TRUE(callService("/vest/tissue/pause", pause));
  ASSERT_TRUE(callService("/vest/tissue/step", step));
  ASSERT_TRUE(step.response.success) << step.response.message;
  const auto before = step.response.step;
  ASSERT_TRUE(callService("/vest/tissue/step", step));
  EXPECT_EQ(step.response.step, before + 5);
  std_srvs::Trigger reset;
  ASSERT_TRUE(callService("/vest/tissue/reset", reset));
  ASSERT_TRUE(callService("/vest/tissue/step", step));
  EXPECT_EQ(step.response.step, 5U);
  pause.request.data = false;
  ASSERT_TRUE(callService("/vest/tissue/pause", pause));
}

TEST(System, ASlowerPaceIsKeptAndAnImpossibleOneIsRefused) {
  vest_msgs::SetSpeed speed;
  speed.request.speed = 0.2;
  ASSERT_TRUE(callService("/vest/tissue/speed", speed));
  ASSERT_TRUE(speed.response.success) << speed.response.message;
  // The factor is that of the last second: until it is one at the new pace.
  double factor = 1;
  for (int i = 0; i < 20 && factor > 0.25; ++i) {
    const auto state =
        ros::topic::waitForMessage<vest_msgs::SessionState>("/vest/session/state", ros::Duration(10));
    ASSERT_TRUE(state);
    factor = state->real_time_factor;
  }
  EXPECT_LT(factor, 0.25);
  EXPECT_GT(factor, 0);
  for (const double impossible : {0.0, -1.0, 1e9}) {
    speed.request.speed = impossible;
    ASSERT_TRUE(callService("/vest/tissue/speed", speed));
    EXPECT_FALSE(speed.response.success) << impossible;
    EXPECT_NE(speed.response.message.find("allowed"), std::string::npos);
  }
  speed.request.speed = 1;
  ASSERT_TRUE(callService("/vest/tissue/speed", speed));
  EXPECT_TRUE(speed.response.success);
}

TEST(System, StopClosesTheRecordingAndStartBeginsAnotherBesideIt) {
  std::string output;
  ASSERT_TRUE(ros::NodeHandle("~").getParam("output", output));
  ASSERT_TRUE(ros::service::waitForService("/vest/session/stop", ros::Duration(60)));
  std_srvs::Trigger trigger;
  ASSERT_TRUE(callService("/vest/session/start", trigger));
  EXPECT_FALSE(trigger.response.success) << "it records already";
  ASSERT_TRUE(callService("/vest/session/stop", trigger));
  ASSERT_TRUE(trigger.response.success) << trigger.response.message;
  const auto text = [](const std::string& file) {
    std::ifstream in(file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_NE(text(output + "/session.json").find("\"stopped\""), std::string::npos);
  {
    rosbag::Bag bag(output + "/session.bag", rosbag::bagmode::Read);
    std::map<std::string, int> counts;
    for (const rosbag::MessageInstance& m : rosbag::View(bag)) ++counts[m.getTopic()];
    EXPECT_GT(counts["/vest/step_inputs"], 100);
    for (const char* thinned : {"joint_states", "phantom_box/joint_states"})
      EXPECT_GT(counts["/vest/" + std::string(thinned)], 10) << thinned;
    EXPECT_GT(counts["/vest/tissue/instruments"], 10);
    EXPECT_EQ(counts["/vest/tissue/scene"], 1) << "the bag carries its scene";
    EXPECT_EQ(counts["/vest/effects/options"], 1);
    EXPECT_GE(counts["/vest/tissue/topology"], 1) << "latched: not through the relay";
  }
  ASSERT_TRUE(callService("/vest/session/stop", trigger));
  EXPECT_FALSE(trigger.response.success) << "nothing is recorded";
  ASSERT_TRUE(callService("/vest/session/start", trigger));
  ASSERT_TRUE(trigger.response.success) << trigger.response.message;
  const std::string earlier = output + "/earlier_1/session.bag";
  EXPECT_TRUE(std::ifstream(earlier).good()) << "nothing is overwritten";
  // The inputs that ROS consumed give the same hashes through Python and C.
  EXPECT_EQ(std::system(("cd " VEST_TESTS " && /usr/bin/python3 -c \"import unittest, test_python; "
                         "test_python.compare_with_bag(unittest.TestCase(), '" +
                         earlier + "', 10**9)\"")
                            .c_str()),
            0);
  bool recording = false;
  for (int i = 0; i < 40 && !recording; ++i) {
    const auto state =
        ros::topic::waitForMessage<vest_msgs::SessionState>("/vest/session/recording", ros::Duration(10));
    recording = state && state->recording && state->recorded_messages > 0;
  }
  EXPECT_TRUE(recording);
}

TEST(System, ASnapshotOfARunningSessionSaysWhichStepItIsOf) {
  vest_msgs::Snapshot saved, restored;
  saved.request.operation = vest_msgs::Snapshot::Request::SAVE;
  restored.request.operation = vest_msgs::Snapshot::Request::RESTORE;
  for (int i = 0; i < 5; ++i) {
    saved.request.name = restored.request.name = "running" + std::to_string(i);
    ASSERT_TRUE(callService("/vest/tissue/snapshot", saved));
    ASSERT_TRUE(saved.response.success) << saved.response.message;
    ASSERT_TRUE(callService("/vest/tissue/snapshot", restored));
    EXPECT_EQ(restored.response.step, saved.response.step);
    EXPECT_EQ(restored.response.state_hash, saved.response.state_hash);
  }
}

TEST(System, ASnapshotBringsTheSameStateBackAndAnUnknownOneIsRefused) {
  std_srvs::SetBool pause;
  pause.request.data = true;
  ASSERT_TRUE(callService("/vest/tissue/pause", pause));
  vest_msgs::Snapshot snapshot;
  snapshot.request.operation = vest_msgs::Snapshot::Request::SAVE;
  snapshot.request.name = "here";
  ASSERT_TRUE(callService("/vest/tissue/snapshot", snapshot));
  ASSERT_TRUE(snapshot.response.success) << snapshot.response.message;
  const auto hash = snapshot.response.state_hash;
  vest_msgs::Step step;
  step.request.steps = 20;
  ASSERT_TRUE(callService("/vest/tissue/step", step));
  EXPECT_NE(step.response.state_hash, hash);
  snapshot.request.operation = vest_msgs::Snapshot::Request::RESTORE;
  ASSERT_TRUE(callService("/vest/tissue/snapshot", snapshot));
  EXPECT_EQ(snapshot.response.state_hash, hash);
  snapshot.request.name = "nowhere";
  ASSERT_TRUE(callService("/vest/tissue/snapshot", snapshot));
  EXPECT_FALSE(snapshot.response.success);
  EXPECT_NE(snapshot.response.message.find("nowhere"), std::string::npos);
  EXPECT_EQ(snapshot.response.state_hash, hash) << "a refusal changes nothing";
  pause.request.data = false;
  ASSERT_TRUE(callService("/vest/tissue/pause", pause));
}

TEST(System, NoMessageWritesOutsideOfTheSessionsFolder) {
  std::string output;
  ASSERT_TRUE(ros::NodeHandle("~").getParam("output", output));
  const std::string file = "/tmp/vest_system_snapshot_" + std::to_string(getpid());
  vest_msgs::Snapshot snapshot;
  snapshot.request.operation = vest_msgs::Snapshot::Request::SAVE;
  for (const std::string& name : {file, output + "/in_it", std::string("../elsewhere"), std::string("a/b"),
                                  std::string("a\0b", 3), std::string(300, 'a'), std::string()}) {
    snapshot.request.name = name;
    ASSERT_TRUE(callService("/vest/tissue/snapshot", snapshot));
    EXPECT_FALSE(snapshot.response.success) << name;
    EXPECT_NE(snapshot.response.message.find("allowed: a word"), std::string::npos)
        << snapshot.response.message;
  }
  for (const std::string& name :
       {file, output + "/in_it", output + "/elsewhere.snapshot", output + "/snapshots/a"})
    EXPECT_FALSE(std::ifstream(name).good()) << name;
  for (const char* word : {"word", "word", ".."}) {
    snapshot.request.name = word;
    ASSERT_TRUE(callService("/vest/tissue/snapshot", snapshot));
    EXPECT_TRUE(snapshot.response.success) << snapshot.response.message;
    EXPECT_EQ(snapshot.response.message, output + "/snapshots/" + word + ".snapshot");
    EXPECT_TRUE(std::ifstream(snapshot.response.message).good());
  }
  // A link with a snapshot's name is replaced; what it led to stays as it was.
  std::ofstream(file) << "mine";
  ASSERT_EQ(symlink(file.c_str(), (output + "/snapshots/link.snapshot").c_str()), 0);
  snapshot.request.name = "link";
  ASSERT_TRUE(callService("/vest/tissue/snapshot", snapshot));
  EXPECT_TRUE(snapshot.response.success) << snapshot.response.message;
  std::string kept;
  std::ifstream(file) >> kept;
  EXPECT_EQ(kept, "mine");
  std::remove(file.c_str());
  // A folder of snapshots that is a link leads out of the session's folder: refused.
  const std::string folder = output + "/snapshots", away = output + "/away";
  ASSERT_EQ(std::rename(folder.c_str(), away.c_str()), 0);
  ASSERT_EQ(symlink("away", folder.c_str()), 0);
  snapshot.request.name = "led_away";
  ASSERT_TRUE(callService("/vest/tissue/snapshot", snapshot));
  EXPECT_FALSE(snapshot.response.success);
  EXPECT_NE(snapshot.response.message.find("not a link"), std::string::npos) << snapshot.response.message;
  EXPECT_FALSE(std::ifstream(away + "/led_away.snapshot").good());
  ASSERT_EQ(std::remove(folder.c_str()), 0);
  ASSERT_EQ(std::rename(away.c_str(), folder.c_str()), 0);
}

TEST(System, ServicesListenOnThisMachineAlone) {
  // Where the simulation listens for services and topics, by the master's word: rosrpc://HOST:PORT.
  const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(60);
  std::string host;
  std::uint32_t port = 0;
  while (!ros::ServiceManager::instance()->lookupService("/vest/tissue/step", host, port) &&
         ros::WallTime::now() < end)
    ros::WallDuration(0.1).sleep();
  ASSERT_NE(port, 0u);
  EXPECT_EQ(host, "localhost");
  int found = 0;
  for (const char* table : {"/proc/net/tcp", "/proc/net/tcp6"}) {
    std::ifstream in(table);
    std::string line, number, local, remote, state;
    std::getline(in, line);
    while (std::getline(in, line)) {
      std::istringstream(line) >> number >> local >> remote >> state;
      const std::size_t colon = local.find(':');
      if (state != "0A" || std::stoul(local.substr(colon + 1), nullptr, 16) != port) continue;  // 0A: listens
      ++found;
      EXPECT_TRUE(local.substr(0, colon) == "0100007F" ||
                  local.substr(0, colon) == "00000000000000000000000001000000")
          << "listens beyond this machine: " << local;
    }
  }
  EXPECT_GT(found, 0);
}

TEST(System, ARefusedSceneNamesTheFileAndThePresentOneGoesOn) {
  vest_msgs::LoadScene load;
  load.request.scene = "/nowhere/scene.yaml";
  ASSERT_TRUE(callService("/vest/tissue/load_scene", load));
  EXPECT_FALSE(load.response.success);
  EXPECT_NE(load.response.message.find("/nowhere/scene.yaml"), std::string::npos) << load.response.message;
  const auto a = ros::topic::waitForMessage<vest_msgs::StepInput>("/vest/step_inputs", ros::Duration(10));
  ASSERT_TRUE(a);
  const auto b = ros::topic::waitForMessage<vest_msgs::StepInput>("/vest/step_inputs", ros::Duration(10));
  ASSERT_TRUE(b);
  EXPECT_GT(b->step, a->step);
}

TEST(System, AParameterOfTheWrongTypeEndsTheNodeAndNamesIt) {
  const std::string out = "/tmp/vest_system_parameter_" + std::to_string(getpid());
  const int code = std::system(
      ("rosrun vest_tissue tissue_node __name:=refused __ns:=other _scene:=tube _threads:=many > " + out +
       " 2>&1")
          .c_str());
  EXPECT_NE(code, 0);
  EXPECT_EQ(std::system(("grep -q 'threads.*many.*allowed' " + out).c_str()), 0);
  std::remove(out.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_system");
  ros::NodeHandle keep;
  return RUN_ALL_TESTS();
}
