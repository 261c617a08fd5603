// Protects: garbage, lost bytes, leaps and unplugging end in diagnostics, never in motion.
#include <diagnostic_msgs/DiagnosticArray.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

namespace {

struct Seen {
  long joints = 0, joints_after_return = 0;
  double worst_speed = 0, worst_position = 0;
  ros::Time last_stamp, yaw_stamp;  // of the last message, and of the last with the joint
  double last_yaw = NAN;
  bool backwards = false, error_level = false, recovered = false;
  long crc = 0, lost = 0, reconnects = 0, rejected = 0;
} g;

void onJoints(const sensor_msgs::JointState::ConstPtr& m) {
  ++g.joints;
  if (g.reconnects > 0) ++g.joints_after_return;
  g.backwards |= m->header.stamp <= g.last_stamp;
  for (std::size_t i = 0; i < m->name.size(); ++i) {
    if (m->name[i] != "left_yaw") continue;
    g.worst_position = std::max(g.worst_position, std::abs(m->position[i]));
    const double dt = (m->header.stamp - g.yaw_stamp).toSec();
    if (std::isfinite(g.last_yaw) && dt > 0 && dt < 0.02)
      g.worst_speed = std::max(g.worst_speed, std::abs(m->position[i] - g.last_yaw) / std::max(dt, 1e-3));
    g.last_yaw = m->position[i];
    g.yaw_stamp = m->header.stamp;
  }
  g.last_stamp = m->header.stamp;
}

void onDiagnostics(const diagnostic_msgs::DiagnosticArray::ConstPtr& m) {
  for (const auto& s : m->status) {
    if (s.name != "phantom_box: trainer box") continue;
    for (const auto& v : s.values) {
      if (v.key == "CRC errors") g.crc = std::atol(v.value.c_str());
      if (v.key == "lost frames") g.lost = std::atol(v.value.c_str());
      if (v.key == "reconnects") g.reconnects = std::atol(v.value.c_str());
      if (v.key == "rejected readings") g.rejected = std::atol(v.value.c_str());
    }
    if (s.level == s.ERROR && g.joints > 0) g.error_level = true;
    if (s.level != s.ERROR && g.error_level) g.recovered = true;
  }
}

TEST(Faults, DamageAndUnpluggingAreReportedAndNoMotionIsInvented) {
  ros::NodeHandle nh;
  const auto joints = nh.subscribe("phantom_box/joint_states", 20000, onJoints);
  const auto diagnostics = nh.subscribe("/diagnostics", 100, onDiagnostics);
  for (int i = 0; i < 4000 && !(g.recovered && g.reconnects > 0 && g.joints_after_return > 500); ++i) {
    ros::spinOnce();
    ros::WallDuration(0.01).sleep();
  }
  EXPECT_GT(g.joints, 1000);
  EXPECT_GT(g.crc, 0);
  EXPECT_GT(g.lost, 0);
  EXPECT_GT(g.rejected, 0) << "leaps";
  EXPECT_TRUE(g.error_level) << "unplugged is an error";
  EXPECT_TRUE(g.recovered);
  EXPECT_GE(g.reconnects, 1);
  EXPECT_GT(g.joints_after_return, 500);
  EXPECT_FALSE(g.backwards) << "stamps only grow, also across reconnection";
  // The trajectory stays within 0.4 rad at 0.4 rad/s. A held reading is made up for by the next good one, so
  // a step of up to 10 ms of motion (0.004 rad in 1 ms) may follow; a leap of 0.9 rad would be 900 rad/s.
  EXPECT_LE(g.worst_position, 0.4 + 1e-4);
  EXPECT_LE(g.worst_speed, 0.4 * 11 + 0.2);
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "phantom_box_test_node_faults");
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
