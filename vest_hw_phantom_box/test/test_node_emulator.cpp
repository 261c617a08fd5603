// Protects: names, rates, stamps and values of the topics that everything above the box reads.
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace {

std::vector<sensor_msgs::JointState> g_joints;
std::vector<sensor_msgs::Joy> g_pedals;
std::map<std::string, std::vector<int>> g_single;

class Node : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    ros::NodeHandle nh;
    using OnJoy = boost::function<void(const sensor_msgs::Joy::ConstPtr&)>;
    const boost::function<void(const sensor_msgs::JointState::ConstPtr&)> on_joints =
        [](const sensor_msgs::JointState::ConstPtr& m) { g_joints.push_back(*m); };
    const OnJoy on_pedals = [](const sensor_msgs::Joy::ConstPtr& m) { g_pedals.push_back(*m); };
    const auto joints = nh.subscribe<sensor_msgs::JointState>("phantom_box/joint_states", 20000, on_joints);
    const auto pedals = nh.subscribe<sensor_msgs::Joy>("phantom_box/footswitches", 20000, on_pedals);
    std::vector<ros::Subscriber> single;
    for (const std::string name : {"coag", "cut", "irrigation", "suction", "tool", "clutch"}) {
      const OnJoy on_pedal = [name](const sensor_msgs::Joy::ConstPtr& m) {
        g_single[name].push_back(m->buttons.at(0));
      };
      single.push_back(nh.subscribe<sensor_msgs::Joy>("footpedals/" + name, 100, on_pedal));
    }
    // Until a whole period of the trajectory (4 s) has come; patience is real time, judgement is by stamps.
    for (int i = 0; i < 3000; ++i) {
      ros::spinOnce();
      if (g_joints.size() > 1000 &&
          (g_joints.back().header.stamp - g_joints.front().header.stamp).toSec() > 9)
        break;
      ros::WallDuration(0.01).sleep();
    }
    ASSERT_GT(g_joints.size(), 1000u);
    ASSERT_GT(g_pedals.size(), 100u);
  }
};

TEST_F(Node, NamesAreTheContractsInOrder) {
  std::vector<std::string> names;
  for (const std::string arm : {"left", "right", "third"})
    for (const std::string axis : {"_yaw", "_pitch", "_insertion", "_roll", "_jaw"})
      names.push_back(arm + axis);
  for (const std::string axis : {"_yaw", "_pitch", "_insertion", "_roll", "_light_post"})
    names.push_back("endoscope" + axis);
  for (const auto& m : g_joints) {
    ASSERT_EQ(names, m.name);
    ASSERT_EQ(names.size(), m.position.size());
    ASSERT_EQ(names.size(), m.velocity.size());
  }
}

TEST_F(Node, JointStatesComeAtTheBoxsRateWithStampsThatOnlyGrow) {
  for (std::size_t i = 1; i < g_joints.size(); ++i)
    ASSERT_GT(g_joints[i].header.stamp, g_joints[i - 1].header.stamp);
  const double span = (g_joints.back().header.stamp - g_joints.front().header.stamp).toSec();
  const double rate = static_cast<double>(g_joints.size() - 1) / span;
  EXPECT_GE(rate, 500) << "the contract";
  EXPECT_LE(rate, 1010);
  EXPECT_NEAR(span, (ros::Time::now() - g_joints.front().header.stamp).toSec(), 2.0) << "stamps are ROS time";
}

TEST_F(Node, PositionsAndVelocitiesAreTheTrajectorys) {
  int moving = 0;
  for (std::size_t i = 20; i < g_joints.size(); ++i) {
    const auto& m = g_joints[i];
    ASSERT_LE(std::abs(m.position[0]), 0.4 + 1e-4);
    ASSERT_NEAR(0.1, m.position[1], 1e-4);
    ASSERT_NEAR(0.15, m.position[7], 1e-5);
    ASSERT_NEAR(0.3, m.position[14], 1e-4);
    ASSERT_NEAR(-0.2, m.position[18], 1e-4);
    ASSERT_NEAR(0, m.velocity[1], 1e-6);
    // The triangle moves at 0.4 rad/s: where it does not turn, the difference over 0.1 s must say so.
    if (i < 120) continue;
    const auto& before = g_joints[i - 100];
    const double dt = (m.header.stamp - before.header.stamp).toSec();
    if (std::abs(m.position[0]) > 0.3 || std::abs(before.position[0]) > 0.3) continue;
    ASSERT_NEAR(0.4, std::abs(m.position[0] - before.position[0]) / dt, 0.02);
    ++moving;
  }
  EXPECT_GT(moving, 1000);
}

TEST_F(Node, FootswitchesHaveAHeartbeatOfFiftyHertzOrMore) {
  const double span = (g_pedals.back().header.stamp - g_pedals.front().header.stamp).toSec();
  EXPECT_GE(static_cast<double>(g_pedals.size() - 1) / span, 50);
  bool coag = false;
  for (const auto& m : g_pedals) {
    ASSERT_EQ(6u, m.buttons.size());
    coag |= m.buttons[0] == 1;
    EXPECT_EQ(0, m.buttons[1]);
  }
  EXPECT_TRUE(coag);
}

TEST_F(Node, SinglePedalsSpeakCrtkWithQuickTap) {
  const auto holds = [](const std::vector<int>& all, const std::vector<int>& part) {
    return std::search(all.begin(), all.end(), part.begin(), part.end()) != all.end();
  };
  EXPECT_TRUE(holds(g_single["clutch"], {1, 2, 0})) << "0.1 s is a tap";
  EXPECT_TRUE(holds(g_single["coag"], {1, 0})) << "1 s is not";
  EXPECT_FALSE(holds(g_single["coag"], {2}));
  EXPECT_EQ(std::vector<int>{0}, g_single["cut"]) << "latched";
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "phantom_box_test_node_emulator");
  ros::Time::init();
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
