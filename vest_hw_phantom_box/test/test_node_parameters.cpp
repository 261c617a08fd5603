// Protects: a wrong parameter ends the node, or keeps the nodelet out, with one message that names it.
#include <gtest/gtest.h>
#include <ros/ros.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <string>
#include <vector>

namespace {

struct Ended {
  int code;
  std::string output;
};

Ended shell(const std::string& command) {
  Ended e{-1, {}};
  FILE* pipe = ::popen(("timeout 20 " + command + " 2>&1").c_str(), "r");
  if (!pipe) return e;
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe)) e.output += buffer.data();
  const int status = ::pclose(pipe);
  e.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return e;
}

void expectRefusal(const std::string& arguments, const std::vector<std::string>& parts) {
  const Ended e = shell(std::string(NODE_PATH) + " __name:=box " + arguments);
  EXPECT_EQ(1, e.code) << arguments << "\n" << e.output;
  std::size_t messages = 0;
  for (std::size_t at = e.output.find("[FATAL]"); at != std::string::npos;
       at = e.output.find("[FATAL]", at + 1))
    ++messages;
  EXPECT_EQ(1u, messages) << e.output;
  for (const auto& p : parts)
    EXPECT_NE(std::string::npos, e.output.find(p)) << "lacks " << p << "\n" << e.output;
}

TEST(Parameters, WrongTypesAndValuesEndTheNodeWithAMessage) {
  expectRefusal("_port:=5", {"parameter /box/port", "5", "allowed: a path"});
  ros::param::del("/box");
  expectRefusal("_baud_rate:=fast", {"parameter /box/baud_rate", "fast", "9600 to 4000000"});
  expectRefusal("_baud_rate:=1.5", {"parameter /box/baud_rate", "1.5"});
  expectRefusal("_baud_rate:=1", {"parameter /box/baud_rate", "1", "9600"});
  ros::param::del("/box");
  expectRefusal("_calibration:=/nowhere.yaml", {"/nowhere.yaml", "No such file"});
  ros::param::del("/box");
  expectRefusal("_footswitch_preset:=piano", {"parameter /box/footswitch_preset", "piano", "trainer, dvrk"});
  ros::param::del("/box");
  ros::param::set("/box/footswitch_preset", "custom");
  expectRefusal("", {"/box/footswitch_preset"});
  for (const std::vector<std::string>& names : {std::vector<std::string>{"a", "b"},
                                                {"a", "b", "c", "d", "e", "e"},
                                                {"a", "b", "c", "d", "e", "f/g"}}) {
    ros::param::set("/box/footswitch_names", names);
    expectRefusal("", {"/box/footswitch_names", "six different names"});
  }
  ros::param::del("/box");
}

TEST(Parameters, TheNodeletIsRefusedTheSameWay) {
  const Ended e =
      shell("rosrun nodelet nodelet standalone vest_hw_phantom_box/PhantomBox __name:=lone _port:=5");
  EXPECT_NE(0, e.code) << e.output;
  EXPECT_NE(124, e.code) << "must end by itself\n" << e.output;
  EXPECT_NE(std::string::npos, e.output.find("parameter /lone/port")) << e.output;
}

}  // namespace

int main(int argc, char** argv) {
  ros::init(argc, argv, "phantom_box_test_node_parameters");
  ros::NodeHandle nh;
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
