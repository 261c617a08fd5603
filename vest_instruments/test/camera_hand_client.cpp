// Protects the camera hand behind topics: a third person turns the view, pedals go in and out and follow the
// instrument, the horizon is level in tf even where the box is tilted, and silence stops everything.
#include <cmath>
#include <cstdio>
#include <functional>

#include <geometry_msgs/TwistStamped.h>
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sensor_msgs/JointState.h>
#include <sensor_msgs/Joy.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#include <vest_msgs/InstrumentStates.h>

namespace {

struct Client {
  ros::NodeHandle nh;
  vest_msgs::InstrumentStates states;
  tf2_ros::Buffer tf;
  tf2_ros::TransformListener listener{tf};
  ros::Publisher command = nh.advertise<geometry_msgs::TwistStamped>("camera_hand/servo_cv", 10);
  ros::Publisher switches = nh.advertise<sensor_msgs::Joy>("phantom_box/footswitches", 10);
  ros::Publisher right = nh.advertise<sensor_msgs::JointState>("right/servo_jp", 10);
  ros::Subscriber subscriber = nh.subscribe<vest_msgs::InstrumentStates>(
      "instruments", 10, [this](const vest_msgs::InstrumentStatesConstPtr& m) { states = *m; });

  const vest_msgs::InstrumentState* find(const std::string& name) const {
    for (const auto& i : states.instruments)
      if (i.name == name) return &i;
    return nullptr;
  }
  double joint(std::size_t k) const { return find("endoscope")->joint_position[k]; }

  /// Sends every 10 ms until `done`.
  bool run(const std::function<void()>& send, const std::function<bool()>& done, double seconds = 20) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
    while (ros::WallTime::now() < end) {
      send();
      ros::spinOnce();
      if (done()) return true;
      ros::WallDuration(0.01).sleep();
    }
    return false;
  }
  bool ready() {
    return run([] {}, [&] { return find("endoscope") != nullptr && find("endoscope")->valid; });
  }
  void steer(double up, double right_turn, double in) {
    geometry_msgs::TwistStamped m;
    m.header.stamp = ros::Time::now();
    m.twist.angular.x = up, m.twist.angular.y = right_turn, m.twist.linear.z = in;
    command.publish(m);
  }
  void press(int button) {
    sensor_msgs::Joy joy;
    joy.header.stamp = ros::Time::now();
    joy.buttons.assign(6, 0);
    joy.buttons[static_cast<std::size_t>(button)] = 1;
    switches.publish(joy);
  }
  /// Height of the picture's right and down directions (length 1) in world, from tf.
  std::array<double, 2> heights() {
    const auto q = tf.lookupTransform("world", "endoscope_optical_frame", ros::Time(), ros::Duration(5))
                       .transform.rotation;
    return {2 * (q.x * q.z - q.w * q.y), 2 * (q.y * q.z + q.w * q.x)};
  }
};

TEST(CameraHand, AThirdPersonTurnsTheViewWithALevelHorizonAndSilenceStopsIt) {
  Client c;
  ASSERT_TRUE(c.ready()) << "the hand holds the endoscope as soon as its source is teleop";
  const double yaw = c.joint(0), insertion = c.joint(2);
  ASSERT_TRUE(c.run([&] { c.steer(0.1, 0.3, 0.02); },
                    [&] { return std::fabs(c.joint(0) - yaw) > 0.3 && c.joint(2) > insertion + 0.01; }));
  EXPECT_TRUE(c.run([] {}, [&] { return std::fabs(c.heights()[0]) < 1e-3; })) << c.heights()[0];
  EXPECT_LT(c.heights()[1], 0) << "down is down";
  // A hundred milliseconds after the last command nothing moves any more.
  c.run([] {}, [] { return false; }, 0.5);
  const double rest = c.joint(0);
  c.run([] {}, [] { return false; }, 0.5);
  EXPECT_NEAR(c.joint(0), rest, 1e-9);
  EXPECT_TRUE(c.find("endoscope")->valid) << "a hand at rest still holds it";
}

TEST(CameraHand, PedalsGoInAndOutAndFollowTheInstrument) {
  Client c;
  ASSERT_TRUE(c.ready());
  const double insertion = c.joint(2);
  EXPECT_TRUE(c.run([&] { c.press(4); }, [&] { return c.joint(2) > insertion + 0.01; }));
  EXPECT_TRUE(c.run([&] { c.press(5); }, [&] { return c.joint(2) < insertion; }));
  sensor_msgs::JointState hand;
  hand.name = {"right_yaw", "right_pitch", "right_insertion", "right_roll"};
  hand.position = {0.2, 0.1, 0.14, 0.0};
  const auto offset = [&] {
    // The instrument's tip in the picture, rad from the middle.
    const auto X = c.tf.lookupTransform("endoscope_optical_frame", "right_tip", ros::Time(), ros::Duration(5))
                       .transform.translation;
    return X.z > 0 ? std::hypot(std::atan2(X.x, X.z), std::atan2(X.y, X.z)) : M_PI;
  };
  const auto send = [&] {
    hand.header.stamp = ros::Time::now();
    c.right.publish(hand);
    c.press(0);
  };
  EXPECT_TRUE(c.run(send, [&] { return offset() < 0.14; })) << offset() << " rad";
  EXPECT_NEAR(c.heights()[0], 0, 1e-3);
}

/// A launch file's mistake must not become a default in silence.
TEST(CameraHand, AParameterOfAWrongTypeIsRefusedByName) {
  for (const auto& [name, value] : {std::pair("dead_zone", "wide"), std::pair("follow", "3")}) {
    const std::string of = std::string("/vest/other/") + name;
    const std::string command = "rosparam set " + of + " " + value +
                                "; rosrun vest_instruments camera_hand_node __ns:=/vest __name:=other 2>&1";
    FILE* const said = popen(command.c_str(), "r");
    ASSERT_NE(said, nullptr);
    std::string text;
    for (int c = std::fgetc(said); c != EOF; c = std::fgetc(said)) text += static_cast<char>(c);
    EXPECT_NE(pclose(said), 0);
    EXPECT_NE(text.find("parameter " + of + ": has a wrong type"), std::string::npos) << text;
    ros::param::del(of);
  }
}

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "camera_hand_client");
  ros::NodeHandle keep;
  return RUN_ALL_TESTS();
}
