// Protects: a wrong parameter ends the node, or keeps the nodelet out, with one message that names it.
#include <gtest/gtest.h>
#include <ros/ros.h>

#include "refusal.h"

namespace {

TEST(Parameters, WrongTypesAndValuesEndTheNodeWithAMessage) {
  expectRefusal(NODE_PATH, "_port:=5", {"parameter /box/port", "5", "allowed: a path"});
  ros::param::del("/box");
  expectRefusal(NODE_PATH, "_baud_rate:=fast", {"parameter /box/baud_rate", "fast", "9600 to 4000000"});
  expectRefusal(NODE_PATH, "_baud_rate:=1.5", {"parameter /box/baud_rate", "1.5"});
  expectRefusal(NODE_PATH, "_baud_rate:=1", {"parameter /box/baud_rate", "1", "9600"});
  ros::param::del("/box");
  expectRefusal(NODE_PATH, "_calibration:=/nowhere.yaml", {"/nowhere.yaml", "No such file"});
  ros::param::del("/box");
  expectRefusal(NODE_PATH, "_footswitch_preset:=dvrk",
                {"parameter /box/footswitch_preset", "the driver alone", "in the session's namespace"});
  ros::param::del("/box");
}

// The session's parameters, for the driver and for the instruments: a wrong one ends both with the same
// words.
TEST(Parameters, WhatPedalsMeanIsReadAlikeByTheDriverAndTheInstruments) {
  const auto bothRefuse = [](const std::vector<std::string>& parts) {
    expectRefusal(NODE_PATH, "", parts);
    expectRefusal("rosrun vest_instruments instruments_node", "", parts);
  };
  ros::param::set("/footswitch_preset", "piano");
  bothRefuse({"parameter /footswitch_preset", "piano", "trainer, dvrk"});
  ros::param::set("/footswitch_preset", 7);
  bothRefuse({"parameter /footswitch_preset", "no word"});
  ros::param::set("/footswitch_preset", "custom");
  bothRefuse({"/footswitch_functions", "six of none, coag"});
  const std::vector<std::string> six{"coag", "cut", "none", "none", "tool", "clutch"};
  std::vector<std::string> wrong = six;
  wrong[3] = "sing";
  ros::param::set("/footswitch_functions", wrong);
  bothRefuse({"/footswitch_functions", "'sing'"});
  ros::param::set("/footswitch_functions", six);
  for (const std::vector<std::string>& names : {std::vector<std::string>{"a", "b"},
                                                {"a", "b", "c", "d", "e", "e"},
                                                {"a", "b", "c", "d", "e", "f/g"}}) {
    ros::param::set("/footswitch_names", names);
    bothRefuse({"/footswitch_names", "six different names"});
  }
  ros::param::del("/footswitch_names");
  ros::param::set("/footswitch_preset", "dvrk");
  bothRefuse({"/footswitch_functions", "together with footswitch_preset 'dvrk'"});
  ros::param::del("/footswitch_functions");
  ros::param::del("/footswitch_preset");
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
