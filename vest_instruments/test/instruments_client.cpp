// A client of the instrument node: CRTK commands, sources, tools, pedals, and who publishes what.
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <tf2_msgs/TFMessage.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/ExchangeTool.h>
#include <vest_msgs/InstrumentStates.h>
#include <vest_msgs/OperatingState.h>
#include <vest_msgs/SelectSource.h>
#include <vest_msgs/StringStamped.h>

#include "vest_instruments/ros/service_call.h"

namespace {

using vest::ros_shell::callService;

using vest_msgs::InstrumentState;

constexpr std::size_t kLeft = 0, kRight = 1, kThird = 2;

/// The connection to the node; the box plays its joints until told to stop.
struct Client {
  ros::NodeHandle nh;
  vest_msgs::InstrumentStates states;
  int count = 0;
  sensor_msgs::JointState joints;
  std::set<std::string> frames, static_frames;
  std::vector<vest_msgs::OperatingState> right_states;
  geometry_msgs::PoseStamped setpoint_cp, left_cp;
  sensor_msgs::JointState right_js, left_jaw;
  double box_yaw = 0.1;
  double box_ahead = 0.0;  // s: its stamps before this machine's clock
  std::string node_says;   // vest_instruments in /diagnostics
  bool box_runs = true;
  std::vector<ros::Subscriber> subscribers;
  ros::Publisher box = nh.advertise<sensor_msgs::JointState>("phantom_box/joint_states", 10);
  ros::Publisher pedals = nh.advertise<sensor_msgs::Joy>("phantom_box/footswitches", 10);
  ros::Publisher contacts = nh.advertise<vest_msgs::ContactModels>("tissue/contacts", 10);
  ros::Publisher right_servo_jp = nh.advertise<sensor_msgs::JointState>("right/servo_jp", 10);
  ros::Publisher left_servo_jp = nh.advertise<sensor_msgs::JointState>("left/servo_jp", 10);
  ros::Publisher right_move_jp = nh.advertise<sensor_msgs::JointState>("right/move_jp", 10);
  ros::Publisher right_servo_cp = nh.advertise<geometry_msgs::PoseStamped>("right/servo_cp", 10);
  ros::Publisher left_servo_cp = nh.advertise<geometry_msgs::PoseStamped>("left/servo_cp", 10);
  ros::Publisher right_command = nh.advertise<vest_msgs::StringStamped>("right/state_command", 10);
  ros::WallTimer timer;

  template <class M>
  void keep(const std::string& topic, M& into) {
    subscribers.push_back(
        nh.subscribe<M>(topic, 10, [&into](const boost::shared_ptr<const M>& m) { into = *m; }));
  }

  Client() {
    subscribers.push_back(nh.subscribe<vest_msgs::InstrumentStates>(
        "instruments", 100, [this](const vest_msgs::InstrumentStatesConstPtr& m) {
          states = *m;
          ++count;
        }));
    keep("joint_states", joints);
    keep("right/setpoint_cp", setpoint_cp);
    keep("left/measured_cp", left_cp);
    keep("right/measured_js", right_js);
    keep("left/jaw/measured_js", left_jaw);
    const auto names = [this](const std::string& topic, std::set<std::string>& into) {
      subscribers.push_back(
          nh.subscribe<tf2_msgs::TFMessage>(topic, 10, [&into](const tf2_msgs::TFMessageConstPtr& m) {
            for (const auto& t : m->transforms) into.insert(t.child_frame_id);
          }));
    };
    names("/tf", frames);
    names("/tf_static", static_frames);
    subscribers.push_back(nh.subscribe<vest_msgs::OperatingState>(
        "right/operating_state", 10,
        [this](const vest_msgs::OperatingStateConstPtr& m) { right_states.push_back(*m); }));
    subscribers.push_back(nh.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 10, [this](const diagnostic_msgs::DiagnosticArrayConstPtr& m) {
          for (const auto& status : m->status) {
            if (status.name == "vest_instruments: node") node_says = status.message;
          }
        }));
    timer = nh.createWallTimer(ros::WallDuration(0.005), [this](const ros::WallTimerEvent&) { playBox(); });
    wait(
        [this] {
          return states.instruments.size() == 4 && states.instruments[kLeft].valid &&
                 left_servo_cp.getNumSubscribers() && right_servo_jp.getNumSubscribers() &&
                 left_servo_jp.getNumSubscribers() && right_move_jp.getNumSubscribers() &&
                 right_servo_cp.getNumSubscribers() && right_command.getNumSubscribers() &&
                 pedals.getNumSubscribers() && contacts.getNumSubscribers();
        },
        20.0);
  }

  void playBox() {
    if (!box_runs) return;
    sensor_msgs::JointState m;
    m.header.stamp = ros::Time::now() + ros::Duration(box_ahead);
    for (const std::string name : {"left", "right", "third", "endoscope"}) {
      m.name.insert(m.name.end(), {name + "_yaw", name + "_pitch", name + "_insertion", name + "_roll"});
      m.position.insert(m.position.end(), {box_yaw, 0.0, 0.12, 0.0});
    }
    m.name.push_back("left_jaw");
    m.position.push_back(0.4);
    box.publish(m);
  }

  /// Spins until the condition holds; false where it does not within the time.
  bool wait(const std::function<bool()>& condition, double seconds = 5.0) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
    while (ros::WallTime::now() < end) {
      ros::spinOnce();
      if (condition()) return true;
      ros::WallDuration(0.002).sleep();
    }
    return false;
  }
  /// Whether it is off fifty times in a row: a busy machine's gap releases pedals once, too.
  bool staysOff(const std::function<bool()>& pressed) {
    int off = 0;
    return wait(
        [&] {
          off = pressed() ? 0 : off + 1;
          ros::WallDuration(0.01).sleep();
          return off >= 50;
        },
        20.0);
  }
  const InstrumentState& state(std::size_t i) const { return states.instruments.at(i); }
  double yaw(std::size_t i) const { return state(i).joint_position[0]; }
  bool yawIs(std::size_t i, double value, double seconds = 5.0) {
    return wait([=] { return std::abs(yaw(i) - value) < 1e-9; }, seconds);
  }
  static sensor_msgs::JointState joint(const std::vector<double>& position) {
    sensor_msgs::JointState m;
    m.header.stamp = ros::Time::now();
    m.position = position;
    return m;
  }
  void command(const std::string& word) {
    vest_msgs::StringStamped m;
    m.header.stamp = ros::Time::now();
    m.string = word;
    right_command.publish(m);
  }
  void press(int mask) {
    sensor_msgs::Joy m;
    m.header.stamp = ros::Time::now();
    for (int i = 0; i < 6; ++i) m.buttons.push_back((mask >> i) & 1);
    pedals.publish(m);
  }
  bool exchange(const std::string& instrument, int tool) {
    vest_msgs::ExchangeTool srv;
    srv.request.instrument = instrument;
    srv.request.tool = static_cast<std::uint8_t>(tool);
    EXPECT_TRUE(callService("exchange_tool", srv));
    EXPECT_EQ(srv.response.success == 0, !srv.response.message.empty()) << "a refusal gives its reason";
    return srv.response.success;
  }
  bool select(const std::string& instrument, int source) {
    vest_msgs::SelectSource srv;
    srv.request.instrument = instrument;
    srv.request.source = static_cast<std::uint8_t>(source);
    EXPECT_TRUE(callService("select_source", srv));
    return srv.response.success;
  }
};

Client& client() {
  static Client the_client;
  return the_client;
}

TEST(Client, ServoJpMovesTheCrtkInstrumentAndNotTheBoxOne) {
  Client& c = client();
  ASSERT_EQ(c.states.instruments.size(), 4u);
  c.right_servo_jp.publish(c.joint({0.25, -0.1, 0.15, 0.5}));
  ASSERT_TRUE(c.yawIs(kRight, 0.25));
  EXPECT_TRUE(c.state(kRight).valid);
  c.left_servo_jp.publish(c.joint({0.9, -0.1, 0.15, 0.5}));
  EXPECT_FALSE(c.wait([&] { return std::abs(c.yaw(kLeft) - c.box_yaw) > 1e-9; }, 0.4));
  c.box_yaw = 0.2;  // the box, in turn, moves left and not right
  EXPECT_TRUE(c.yawIs(kLeft, 0.2));
  EXPECT_EQ(c.yaw(kRight), 0.25);
}

TEST(Client, ServoCpPutsTheTipWhereTheClientSaysAndNotThatOfTheBox) {
  Client& c = client();
  geometry_msgs::PoseStamped m;
  m.header.stamp = ros::Time::now();
  m.pose.position.x = 0.03;
  m.pose.position.y = 0.05;
  m.pose.position.z = 0.06;
  m.pose.orientation.w = 1.0;
  const auto arrived = [&](std::size_t i) {
    const auto& p = c.state(i).tip.position;
    return std::hypot(p.x - 0.03, p.y - 0.05, p.z - 0.06) < 1e-6;
  };
  c.right_servo_cp.publish(m);
  c.left_servo_cp.publish(m);
  EXPECT_TRUE(c.wait([&] { return arrived(kRight); }));
  EXPECT_FALSE(c.wait([&] { return arrived(kLeft); }, 0.3));
  m.header.stamp = ros::Time::now();  // out of reach: setpoint_cp stays behind the command
  m.pose.position.z = -0.5;
  c.right_servo_cp.publish(m);
  EXPECT_TRUE(c.wait([&] { return !arrived(kRight) && c.setpoint_cp.pose.position.z < 0.05; }));
  EXPECT_GT(c.setpoint_cp.pose.position.z, -0.4);
  EXPECT_EQ(c.setpoint_cp.header.frame_id, "phantom_box");
}

TEST(Client, OldAndNonFiniteCommandsMoveNothing) {
  Client& c = client();
  c.right_servo_jp.publish(c.joint({0.1, 0.0, 0.15, 0.0}));
  ASSERT_TRUE(c.yawIs(kRight, 0.1));
  auto old = c.joint({0.4, 0.0, 0.15, 0.0});
  old.header.stamp -= ros::Duration(3.0);
  c.right_servo_jp.publish(old);
  c.right_servo_jp.publish(c.joint({std::numeric_limits<double>::quiet_NaN(), 0.0, 0.15, 0.0}));
  c.right_servo_jp.publish(c.joint({0.4, 0.0}));
  geometry_msgs::PoseStamped pose;
  pose.pose.orientation.w = 1.0;
  pose.header.stamp = ros::Time::now() + ros::Duration(3.0);
  c.right_servo_cp.publish(pose);
  pose.header.stamp = ros::Time::now();
  pose.pose.orientation.w = 0.0;
  c.right_servo_cp.publish(pose);
  pose.pose.orientation.w = 1.0;
  pose.header.frame_id = "kitchen";
  c.right_servo_cp.publish(pose);
  EXPECT_FALSE(c.wait([&] { return std::abs(c.yaw(kRight) - 0.1) > 1e-9; }, 0.4));
}

TEST(Client, StateCommandPausesAndResumes) {
  Client& c = client();
  ASSERT_TRUE(c.wait([&] { return !c.right_states.empty(); }));
  EXPECT_EQ(c.right_states.back().state, "ENABLED");
  EXPECT_TRUE(c.right_states.back().is_homed);
  c.command("pause");
  ASSERT_TRUE(c.wait([&] { return c.right_states.back().state == "PAUSED"; }));
  const double before = c.yaw(kRight);
  c.right_servo_jp.publish(c.joint({before + 0.2, 0.0, 0.15, 0.0}));
  EXPECT_FALSE(c.wait([&] { return std::abs(c.yaw(kRight) - before) > 1e-9; }, 0.3));
  c.command("resume");
  EXPECT_TRUE(c.wait([&] { return c.right_states.back().state == "ENABLED"; }));
}

TEST(Client, MoveJpIsBusyUntilItArrives) {
  Client& c = client();
  c.right_servo_jp.publish(c.joint({0.0, 0.0, 0.15, 0.0}));
  ASSERT_TRUE(c.yawIs(kRight, 0.0));
  c.right_states.clear();
  c.right_move_jp.publish(c.joint({0.2, 0.0, 0.15, 0.0}));
  ASSERT_TRUE(c.yawIs(kRight, 0.2));
  EXPECT_TRUE(c.wait([&] { return c.right_states.size() >= 2; }));
  EXPECT_TRUE(c.right_states.front().is_busy);
  EXPECT_FALSE(c.right_states.back().is_busy);
}

TEST(Client, MeasuredTopicsAgreeWithInstruments) {
  Client& c = client();
  ASSERT_TRUE(c.wait([&] { return !c.right_js.name.empty() && !c.left_jaw.name.empty(); }));
  EXPECT_EQ(c.right_js.name,
            (std::vector<std::string>{"right_yaw", "right_pitch", "right_insertion", "right_roll"}));
  EXPECT_EQ(c.left_jaw.name, std::vector<std::string>{"left_jaw"});
  EXPECT_NEAR(c.left_jaw.position[0], 0.4, 1e-9);
  EXPECT_TRUE(
      c.wait([&] { return std::abs(c.left_cp.pose.position.x - c.state(kLeft).tip.position.x) < 1e-9; }));
  EXPECT_EQ(c.left_cp.header.frame_id, "phantom_box");
}

TEST(Client, ToolsAreExchangedUnlessTissueIsHeld) {
  Client& c = client();
  EXPECT_TRUE(c.exchange("third", InstrumentState::TOOL_SCISSORS));
  EXPECT_TRUE(c.wait([&] { return c.state(kThird).tool == InstrumentState::TOOL_SCISSORS; }));
  std::string description;
  ASSERT_TRUE(c.nh.getParam("robot_description", description));
  EXPECT_NE(description.find("scissors_jaw_left.stl"), std::string::npos);
  EXPECT_FALSE(c.exchange("third", 99));
  EXPECT_FALSE(c.exchange("middle", 1));
  EXPECT_FALSE(c.exchange("endoscope", 1));
  EXPECT_FALSE(c.exchange("third", InstrumentState::TOOL_ENDOSCOPE));
  vest_msgs::ContactModels held;
  held.contacts.resize(1);
  held.contacts[0].instrument = "third";
  held.contacts[0].grasping = true;
  EXPECT_TRUE(c.wait([&] {
    c.contacts.publish(held);
    ros::WallDuration(0.02).sleep();
    return !c.exchange("third", InstrumentState::TOOL_GRASPER);
  }));
}

TEST(Client, PedalsSwitchTheToolThatTakesThemAndSilenceReleases) {
  Client& c = client();
  ASSERT_EQ(c.state(kLeft).tool, InstrumentState::TOOL_COAGULATION_HOOK);
  EXPECT_TRUE(c.wait([&] {
    c.press(1);
    return c.state(kLeft).functions == InstrumentState::FUNCTION_COAGULATE;
  }));
  EXPECT_EQ(c.state(kRight).functions, 0u);
  EXPECT_TRUE(c.wait([&] { return c.state(kLeft).functions == 0; }, 2.0));
  // The pedal hands over what lies on the tray, press by press, and begins again.
  for (const int next : {InstrumentState::TOOL_CLIP_APPLIER, InstrumentState::TOOL_SCISSORS,
                         InstrumentState::TOOL_CLIP_APPLIER}) {
    c.press(0);
    c.press(16);
    EXPECT_TRUE(c.wait([&] { return c.state(kRight).tool == next; })) << next;
  }
  c.press(0);
  EXPECT_TRUE(c.exchange("right", InstrumentState::TOOL_GRASPER));
}

TEST(Client, OnePressOfThePedalHandsOverOneToolThoughItsMessagesComeWithAGap) {
  Client& c = client();
  const auto pressed = [&] {
    c.press(16);
    return c.state(kRight).tool != InstrumentState::TOOL_GRASPER;
  };
  ASSERT_TRUE(c.wait([&] { return c.state(kRight).tool == InstrumentState::TOOL_GRASPER; }));
  c.press(0);
  ASSERT_TRUE(c.wait(pressed));
  const int first = c.state(kRight).tool;
  for (int gap = 0; gap < 3; ++gap) {  // the foot stays down, a busy machine holds the messages up
    c.wait([] { return false; }, 0.25);
    const int count = c.count;
    c.press(16);
    ASSERT_TRUE(c.wait([&] { return c.count > count + 50; }));
    EXPECT_EQ(c.state(kRight).tool, first) << "gap " << gap;
  }
  c.press(0);
  EXPECT_TRUE(c.exchange("right", InstrumentState::TOOL_GRASPER));
}

TEST(Client, APresetThatChangesUnderneathReleasesThePedals) {
  Client& c = client();
  const auto coagulates = [&] {
    c.press(1);
    return c.state(kLeft).functions == InstrumentState::FUNCTION_COAGULATE;
  };
  ASSERT_TRUE(c.wait(coagulates));
  c.nh.setParam("footswitch_preset", "dvrk");  // a driver that starts now says clutch to this pedal
  EXPECT_TRUE(c.staysOff(coagulates));
  c.nh.setParam("footswitch_preset", "trainer");
  EXPECT_TRUE(c.wait(coagulates, 20.0));
  c.press(0);
}

TEST(Client, TheEndoscopeSaysWhereItsOpticLooks) {
  Client& c = client();
  const auto& s = c.state(3).sight;  // 30 degrees down at light post 0
  EXPECT_NEAR(s[0], 0.0, 1e-9);
  EXPECT_NEAR(s[1], 0.5, 1e-9);
  EXPECT_NEAR(s[2], std::sqrt(0.75), 1e-9);
  EXPECT_EQ(c.state(kLeft).sight[2], 0.0);
}

TEST(Client, ASecondPublisherOfPedalsReleasesThemUntilItIsGone) {
  Client& c = client();
  const auto coagulates = [&] {
    c.press(1);
    return c.state(kLeft).functions == InstrumentState::FUNCTION_COAGULATE;
  };
  ASSERT_TRUE(c.wait(coagulates));
  // Presses nothing, and seldom: without the guard the first one's pedals would stay down.
  const pid_t second = ::fork();
  if (second == 0) {
    ::execlp("rostopic", "rostopic", "pub", "-r", "1", "phantom_box/footswitches", "sensor_msgs/Joy", "{}",
             static_cast<char*>(nullptr));
    ::_exit(1);
  }
  EXPECT_TRUE(c.staysOff(coagulates));
  ::kill(second, SIGINT);
  ::waitpid(second, nullptr, 0);
  EXPECT_TRUE(c.wait(coagulates, 20.0)) << "one is left, and is heard";
}

TEST(Client, SelectSourceTakesEffectAndRefusesNonsense) {
  Client& c = client();
  EXPECT_FALSE(c.select("right", 77));
  EXPECT_FALSE(c.select("nobody", 1));
  EXPECT_TRUE(c.select("right", InstrumentState::SOURCE_BOX));
  EXPECT_TRUE(c.yawIs(kRight, c.box_yaw));
  c.command("source:crtk");
  EXPECT_TRUE(c.wait([&] { return c.state(kRight).source == InstrumentState::SOURCE_CRTK; }));
}

TEST(Client, TfAndJointStatesHaveOnePublisherAndEveryFrameIsThere) {
  Client& c = client();
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = "client";
  ASSERT_TRUE(ros::master::execute("getSystemState", request, response, payload, false));
  int checked = 0;
  for (int i = 0; i < payload[0].size(); ++i) {
    const std::string topic = payload[0][i][0];
    if (topic != "/tf" && topic != "/tf_static" && topic != "/vest/joint_states") continue;
    ++checked;
    ASSERT_EQ(payload[0][i][1].size(), 1) << topic;
    EXPECT_EQ(static_cast<std::string>(payload[0][i][1][0]), "/vest/instruments") << topic;
  }
  EXPECT_EQ(checked, 3);
  const auto has = [](const std::set<std::string>& frames, const std::vector<std::string>& wanted) {
    for (const auto& f : wanted) {
      if (frames.count(f) == 0) return false;
    }
    return true;
  };
  EXPECT_TRUE(c.wait([&] {
    return has(c.frames,
               {"left_yaw", "left_pitch", "left_insertion", "left_roll", "left_jaw_left", "left_jaw_right",
                "right_roll", "third_roll", "endoscope_roll", "endoscope_optical_frame"}) &&
           has(c.static_frames, {"phantom_box", "left_trocar", "left_tip", "endoscope_trocar"});
  }));
  EXPECT_EQ(std::set<std::string>(c.joints.name.begin(), c.joints.name.end()).size(), c.joints.name.size());
  EXPECT_EQ(c.joints.name.size(), 20u);
}

TEST(Client, OperatingStateAndStateCommandAreCrtkOnTheWire) {
  EXPECT_STREQ(ros::message_traits::md5sum<vest_msgs::OperatingState>(), "b1bd4021639d9d9c5fbfff78d6ff3158");
  EXPECT_STREQ(ros::message_traits::md5sum<vest_msgs::StringStamped>(), "5e3e46086181199270f1ac3a28a5977f");
  ros::master::V_TopicInfo topics;
  ASSERT_TRUE(ros::master::getTopics(topics));
  std::string type;
  for (const auto& t : topics) {
    if (t.name == "/vest/third/operating_state") type = t.datatype;
  }
  EXPECT_EQ(type, "crtk_msgs/OperatingState") << "~crtk_package of this test says so";
}

TEST(Client, ABoxWhoseClockIsAnHourOffMovesItsInstrumentsAndThatIsTold) {
  Client& c = client();
  const std::string told = "stamps of the box are not of this machine's clock";
  for (const double ahead : {3600.0, -3600.0}) {
    c.box_ahead = ahead;
    c.box_yaw = 0.1 + 1e-5 * ahead;
    EXPECT_TRUE(c.wait([&] { return std::abs(c.state(kLeft).joint_position[0] - c.box_yaw) < 1e-9; }))
        << "it is measured now, whatever its clock says";
    EXPECT_TRUE(c.wait([&] { return c.node_says.find(told) != std::string::npos; })) << c.node_says;
    c.box_ahead = 0.0;
    EXPECT_TRUE(c.wait([&] { return c.node_says.find(told) == std::string::npos; })) << c.node_says;
  }
}

// Last: it silences the box.
TEST(Client, ZASilentBoxIsNoLongerValidAndItsPoseIsHeld) {
  Client& c = client();
  const auto before = c.state(kLeft).joint_position;
  c.box_runs = false;
  EXPECT_TRUE(c.wait([&] { return !c.state(kLeft).valid; }, 2.0));
  EXPECT_EQ(c.state(kLeft).joint_position, before);
  const int count = c.count;
  EXPECT_TRUE(c.wait([&] { return c.count > count + 100; })) << "a timer takes over the pace";
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "instruments_client");
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
