// Protects rosbag playback: nothing but a stock `rosbag play` of the bag is needed, and after a seek,
// forwards and backwards, each state is shown with its own topology.
#include <csignal>
#include <filesystem>
#include <functional>
#include <string>

#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rosbag/bag.h>

#include "net_messages.h"

namespace vest::displays {
namespace {

constexpr int kSeconds = 24, kWholeEvery = 5, kCutEvery = 6;  // s

std::uint32_t revisionAt(std::uint64_t step) {
  return static_cast<std::uint32_t>(step / (1000 * kCutEvery));
}

class Playback : public testing::Test {
 protected:
  ros::NodeHandle nh;
  TissueInput input;
  std::string file = testing::TempDir() + "vest_playback_" + std::to_string(getpid()) + ".bag";
  pid_t player = -1;

  void SetUp() override {
    rosbag::Bag bag(file, rosbag::bagmode::Write);
    const auto latched = boost::make_shared<ros::M_string>();
    (*latched)["latching"] = "1";
    (*latched)["callerid"] = "/trainer";
    const auto header = [&](const auto& m) {
      (*latched)["type"] = ros::message_traits::datatype(m);
      (*latched)["md5sum"] = ros::message_traits::md5sum(m);
      (*latched)["message_definition"] = ros::message_traits::definition(m);
      return latched;
    };
    for (int k = 0; k < 20 * kSeconds; ++k) {
      const std::uint64_t step = 50u * static_cast<std::uint64_t>(k);
      const ros::Time t(1000.0 + 0.001 * static_cast<double>(step));
      const std::uint32_t revision = revisionAt(step);
      if (k > 0 && k % (20 * kCutEvery) == 0) bag.write("tissue/topology_delta", t, *cut(revision - 1));
      if (k % (20 * kWholeEvery) == 0)
        bag.write("tissue/topology", t, *whole(revision), header(*whole(revision)));
      bag.write("tissue/state", t, *state(revision, step));
    }
    bag.close();
    input.subscribe(nh, "tissue");
  }
  void TearDown() override {
    stop();
    std::filesystem::remove(file);
  }

  void play(const std::string& from) {
    player = fork();
    if (player != 0) return;
    execlp("rosbag", "rosbag", "play", "--clock", "--quiet", "--rate=2", "--start", from.c_str(),
           file.c_str(), nullptr);
    _exit(127);
  }
  void stop() {
    if (player <= 0) return;
    kill(player, SIGINT);
    waitpid(player, nullptr, 0);
    player = -1;
  }
  /// Takes over what comes until `done`; what is shown always fits.
  bool spin(const std::function<bool()>& done, double seconds = 20) {
    const ros::WallTime end = ros::WallTime::now() + ros::WallDuration(seconds);
    auto taken = input.states();
    while (ros::WallTime::now() < end) {
      ros::spinOnce();
      // A delta may come between two states: what counts is the topology that a state is taken on.
      if (input.process() && input.states() > taken) {
        taken = input.states();
        EXPECT_EQ(cutLinks(input), static_cast<int>(revisionAt(input.step()))) << "at step " << input.step();
        EXPECT_FLOAT_EQ(input.store().knots(0)[1], 1e-6f * static_cast<float>(input.step()));
      }
      if (done()) return true;
      ros::WallDuration(0.002).sleep();
    }
    return false;
  }
};

TEST_F(Playback, FromTheStartEachCutIsSeen) {
  play("0");
  EXPECT_TRUE(spin([&] { return input.step() > 7000; })) << input.problem();
}

TEST_F(Playback, AfterASeekTheWholeTopologyComesFromTheBagAlone) {
  play("13");
  ASSERT_TRUE(spin([&] { return input.states() > 0 && input.step() >= 13000; })) << input.problem();
  EXPECT_EQ(cutLinks(input), 2);
  EXPECT_TRUE(spin([&] { return input.step() > 19000; })) << "and goes on over the next cut";
  stop();
  // Back: rviz resets its displays when time jumps.
  input.clear();
  play("1");
  ASSERT_TRUE(spin([&] { return input.states() > 0 && input.step() >= 1000 && input.step() < 6000; }));
  EXPECT_EQ(cutLinks(input), 0);
  EXPECT_TRUE(input.problem().empty()) << input.problem();
}

}  // namespace
}  // namespace vest::displays

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_playback");
  ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
