// Protects the whole way of an input map: a gamepad moves and switches the instrument that the map says, and
// no other; the box's handles can change places; a wrong map ends each node with one message.
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <vest_msgs/InstrumentStates.h>

#include <algorithm>
#include <fstream>
#include <vector>

#include "refusal.h"

namespace {

using vest_msgs::InstrumentState;

struct Session {
  std::vector<sensor_msgs::Joy> joy;
  std::vector<vest_msgs::InstrumentStates> states;
};

const Session& session() {
  static Session s;
  if (!s.joy.empty()) return s;
  ros::NodeHandle nh;
  const auto joy = nh.subscribe<sensor_msgs::Joy>(
      "input/pad", 2000, [&](const sensor_msgs::JoyConstPtr& m) { s.joy.push_back(*m); });
  const auto states = nh.subscribe<vest_msgs::InstrumentStates>(
      "instruments", 5000, [&](const vest_msgs::InstrumentStatesConstPtr& m) { s.states.push_back(*m); });
  ros::Publisher box = nh.advertise<sensor_msgs::JointState>("phantom_box/joint_states", 10);
  ros::Publisher keys = nh.advertise<sensor_msgs::Joy>("teleop/footswitches", 10);
  sensor_msgs::JointState joints;
  for (const std::string arm : {"left", "third"}) {
    for (const std::string axis : {"_yaw", "_pitch", "_insertion", "_roll", "_jaw"}) {
      joints.name.push_back(arm + axis);
      joints.position.push_back(arm == "left" ? 0.11 : 0.22);
    }
  }
  sensor_msgs::Joy pressed;
  pressed.buttons = {0, 1};
  // Two rounds of the recording, by the stamps; patience is real time.
  for (int i = 0; i < 4000; ++i) {
    joints.header.stamp = pressed.header.stamp = ros::Time::now();
    box.publish(joints);
    keys.publish(pressed);
    ros::spinOnce();
    if (s.joy.size() > 300 && (s.joy.back().header.stamp - s.joy.front().header.stamp).toSec() > 7.0) break;
    ros::WallDuration(0.01).sleep();
  }
  return s;
}

const InstrumentState* find(const vest_msgs::InstrumentStates& m, const char* name) {
  for (const InstrumentState& i : m.instruments) {
    if (i.name == name) return &i;
  }
  return nullptr;
}

TEST(Inputs, AGamepadHasAHeartbeatOfFiftyHertzOrMore) {
  const auto& joy = session().joy;
  ASSERT_GT(joy.size(), 100u);
  std::vector<double> gaps;
  for (std::size_t i = 1; i < joy.size(); ++i)
    gaps.push_back((joy[i].header.stamp - joy[i - 1].header.stamp).toSec());
  std::nth_element(gaps.begin(), gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2), gaps.end());
  EXPECT_LT(gaps[gaps.size() / 2], 0.02) << "half of the time, whatever else the machine does";
}

TEST(Inputs, AGamepadMovesTheInstrumentOfTheMapBySpeed) {
  double least[2] = {9, 9}, most[2] = {-9, -9};
  for (const auto& m : session().states) {
    const InstrumentState* const right = find(m, "right");
    ASSERT_NE(right, nullptr);
    if (!right->valid) continue;
    for (int k = 0; k < 2; ++k) {
      least[k] = std::min(least[k], right->joint_position[2 * k]);
      most[k] = std::max(most[k], right->joint_position[2 * k]);
    }
  }
  // A second at 0.2 rad/s to and fro; half a second at 0.02 m/s in and out.
  EXPECT_NEAR(most[0] - least[0], 0.2, 0.03);
  EXPECT_NEAR(most[1] - least[1], 0.01, 0.002);
}

TEST(Inputs, AButtonSwitchesItsInstrumentAndNoOther) {
  int on = 0, off = 0;
  for (const auto& m : session().states) {
    const InstrumentState* const right = find(m, "right");
    on += right->functions == InstrumentState::FUNCTION_COAGULATE;
    off += right->functions == 0;
    for (const char* name : {"left", "third"}) {
      EXPECT_EQ(find(m, name)->functions & InstrumentState::FUNCTION_COAGULATE, 0u);
    }
  }
  EXPECT_GT(on, 100);
  EXPECT_GT(off, 100);
}

TEST(Inputs, TheBoxesHandlesCanChangePlaces) {
  const InstrumentState* const left = find(session().states.back(), "left");
  EXPECT_TRUE(left->valid);
  EXPECT_NEAR(left->joint_position[0], 0.22, 1e-9) << "moved by the third handle";
}

TEST(Inputs, AWrongMapEndsEachNodeWithOneMessage) {
  const std::string path = ::testing::TempDir() + "/vest_wrong_inputs.yaml";
  std::ofstream(path) << "instruments: {left: {source: bocks}}\n";
  for (const char* node : {INPUT_NODE, "rosrun vest_instruments instruments_node"}) {
    expectRefusal(node, "_inputs:=" + path,
                  {path + ": instruments.left.source: 'bocks'; allowed: none, box"});
    ros::param::del("box");
  }
  std::ofstream(path) << "devices: {p: {match: x, buttons: [KEY_NONSENSE]}}\ninstruments: {}\n";
  expectRefusal(INPUT_NODE, "_inputs:=" + path,
                {path + ": devices.p.buttons: 'KEY_NONSENSE'; allowed: names of"});
  ros::param::del("box");
  expectRefusal(INPUT_NODE, "_inputs:=/nowhere.yaml",
                {"/nowhere.yaml: file: No such file", "allowed: a readable file"});
  ros::param::del("box");
  expectRefusal(INPUT_NODE, "", {"/box/inputs: missing"});
  std::remove(path.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "node_inputs");
  ros::NodeHandle keep;
  return RUN_ALL_TESTS();
}
