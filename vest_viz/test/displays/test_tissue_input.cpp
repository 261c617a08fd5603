// Protects playback of a bag: after a jump in time the topology of each state is there, whatever order things
// come in, and blood of the surfaces reaches the skin.
#include <gtest/gtest.h>
#include <vest_msgs/TissueField.h>
#include <boost/make_shared.hpp>

#include "instrument_history.h"
#include "net_messages.h"
#include "tissue_input.h"

namespace vest::displays {
namespace {

/// Three cuts at steps 1000, 2000, 3000.
void play(TissueInput* input) {
  input->add(whole(0));
  for (std::uint32_t r = 0; r < 4; ++r) {
    if (r > 0) input->add(cut(r - 1));
    input->add(state(r, 1000 * r + 500));
    ASSERT_TRUE(input->process());
    ASSERT_EQ(cutLinks(*input), static_cast<int>(r));
  }
}

TEST(TissueInput, AfterAJumpBackEachStateHasItsOwnTopology) {
  TissueInput input;
  play(&input);
  input.add(state(1, 1600));
  EXPECT_TRUE(input.process());
  EXPECT_EQ(cutLinks(input), 1);
  EXPECT_EQ(input.step(), 1600u);
  EXPECT_EQ(input.dropped(), 0u);
  input.add(state(3, 3600));  // and forward again, to what was seen before
  EXPECT_TRUE(input.process());
  EXPECT_EQ(cutLinks(input), 3);
}

TEST(TissueInput, AResetByAJumpInTimeKeepsWhatIsKnownOfTheTopology) {
  TissueInput input;
  play(&input);
  input.clear();
  EXPECT_TRUE(input.store().empty());
  input.add(whole(3));  // the bag's latched topology is of before the jump
  input.add(state(0, 200));
  EXPECT_TRUE(input.process());
  EXPECT_EQ(cutLinks(input), 0);
  EXPECT_EQ(input.step(), 200u);
}

TEST(TissueInput, AStateThatADeltaOvertookIsDroppedAndDoesNotTurnTheClockBack) {
  TissueInput input;
  play(&input);
  input.add(cut(3));
  input.process();
  input.add(state(3, 4001));
  input.process();
  EXPECT_EQ(cutLinks(input), 4);
  EXPECT_EQ(input.dropped(), 1u);
  input.add(state(4, 4002));
  EXPECT_TRUE(input.process());
  EXPECT_EQ(input.step(), 4002u);
}

TEST(TissueInput, ALateStateOfTheOldTopologyDoesNotKeepTheNewOneAway) {
  TissueInput input;
  play(&input);
  input.add(whole(1));        // the world went back,
  input.add(state(3, 3600));  // and the last state from before it comes by another connection
  input.process();
  for (std::uint64_t step : {3700u, 3800u}) {
    input.add(state(1, step));
    input.process();
    EXPECT_EQ(cutLinks(input), 1);
    EXPECT_EQ(input.step(), step);
  }
  EXPECT_TRUE(input.problem().empty()) << input.problem();
}

TEST(TissueInput, AnUnknownRevisionWaitsForAWholeTopology) {
  TissueInput input;
  play(&input);
  input.add(state(5, 5500));  // a jump forward over two cuts
  input.process();
  EXPECT_EQ(input.step(), 3500u);
  EXPECT_FALSE(input.problem().empty());
  input.add(whole(5));
  input.add(state(5, 5600));
  EXPECT_TRUE(input.process());
  EXPECT_EQ(cutLinks(input), 5);
  EXPECT_TRUE(input.problem().empty());
}

TEST(TissueInput, StatesThatComeBeforeTheTopologyAreDroppedAndTheFirstAfterItIsShown) {
  TissueInput input;
  for (std::uint64_t step : {100u, 200u}) {
    input.add(state(0, step));
    input.process();
    EXPECT_TRUE(input.store().empty());
    EXPECT_FALSE(input.problem().empty()) << "a status line says why nothing is seen";
  }
  input.add(whole(0));
  input.add(state(0, 300));
  EXPECT_TRUE(input.process());
  EXPECT_EQ(input.step(), 300u);
  EXPECT_EQ(input.dropped(), 2u);
  EXPECT_TRUE(input.problem().empty()) << input.problem();
}

TEST(TissueInput, AnotherSceneDoesNotGetTheOldOnesTopology) {
  TissueInput input;
  play(&input);
  input.add(whole(2, "b"));
  input.process();
  input.add(state(1, 100));
  input.process();
  EXPECT_EQ(cutLinks(input), 2);
  EXPECT_EQ(input.dropped(), 1u);
}

TEST(TissueInput, TheHistoryIsBounded) {
  TissueHistory history;
  history.add(whole(0));
  for (std::uint32_t r = 0; r < 2 * TissueHistory::kMostDeltas; ++r) history.add(cut(r));
  vest_msgs::TissueTopology::ConstPtr topology;
  std::vector<vest_msgs::TissueTopologyDelta::ConstPtr> deltas;
  EXPECT_FALSE(history.find(5, &topology, &deltas)) << "the oldest went";
  history.add(whole(2 * TissueHistory::kMostDeltas - 3));
  EXPECT_TRUE(history.find(2 * TissueHistory::kMostDeltas, &topology, &deltas));
  EXPECT_EQ(deltas.size(), 3u);
}

TEST(TissueInput, WhatSurfacesSeepReachesTheStore) {
  TissueInput input;
  play(&input);
  auto seeping = boost::make_shared<vest_msgs::SurfaceBleeding>();
  seeping->revision = 3;
  seeping->fields.resize(1);
  seeping->fields[0].kind = vest_msgs::TissueField::WETNESS;
  seeping->fields[0].maximum = 1;
  seeping->fields[0].data.assign(kLinks + 1, 255);
  input.add(vest_msgs::SurfaceBleeding::ConstPtr(seeping));
  EXPECT_TRUE(input.process());
  EXPECT_FLOAT_EQ(input.store().knotField(0, vest_msgs::TissueField::WETNESS, 2), 1.0f);
  // What vessels bring and what tissue takes have one name in messages, and are two fields here.
  seeping = boost::make_shared<vest_msgs::SurfaceBleeding>(*seeping);
  seeping->fields[0].kind = vest_msgs::TissueField::PERFUSION;
  input.add(vest_msgs::SurfaceBleeding::ConstPtr(seeping));
  EXPECT_TRUE(input.process());
  EXPECT_FLOAT_EQ(input.store().knotField(0, TissueInput::kSupply, 2), 1.0f);
  EXPECT_EQ(input.store().field(vest_msgs::TissueField::PERFUSION), nullptr);
}

vest_msgs::InstrumentStates::ConstPtr instruments(double stamp) {
  auto m = boost::make_shared<vest_msgs::InstrumentStates>();
  m->header.stamp = ros::Time(stamp);
  return m;
}

TEST(InstrumentHistory, GivesTheInstrumentsOfTheStateThatIsShown) {
  InstrumentHistory history;
  EXPECT_EQ(history.at(ros::Time(5), 0.0), nullptr);
  for (int k = 0; k < 50; ++k) history.add(instruments(10 + 0.001 * k));
  EXPECT_DOUBLE_EQ(history.at(ros::Time(10.0202), 0.0)->header.stamp.toSec(), 10.020);
  EXPECT_DOUBLE_EQ(history.at(ros::Time(10.0207), 0.0)->header.stamp.toSec(), 10.021);
  EXPECT_DOUBLE_EQ(history.at(ros::Time(9.99), 0.0)->header.stamp.toSec(), 10) << "before all: the first";
  EXPECT_DOUBLE_EQ(history.at(ros::Time(11), 0.0)->header.stamp.toSec(), 10.049) << "after all: the last";
  EXPECT_DOUBLE_EQ(history.at(ros::Time(), 0.0)->header.stamp.toSec(), 10.049) << "no state has come";
  for (int k = 0; k < 100; ++k) history.add(instruments(10.05 + 0.001 * k));
  EXPECT_DOUBLE_EQ(history.at(ros::Time(10.04), 1.0)->header.stamp.toSec(), 10.149)
      << "a paused simulation: the instruments go on";
  EXPECT_DOUBLE_EQ(history.at(ros::Time(10.04), 0.02)->header.stamp.toSec(), 10.040)
      << "a busy machine: the state came just now, but late";
}

TEST(InstrumentHistory, AwaitsTheInstrumentsOfAStateThatCameFirst) {
  InstrumentHistory history;
  EXPECT_FALSE(history.awaits(ros::Time(10))) << "nobody sends any";
  for (int k = 0; k < 50; ++k) history.add(instruments(10 + 0.02 * k));
  EXPECT_FALSE(history.awaits(ros::Time(10.98))) << "they are here";
  EXPECT_TRUE(history.awaits(ros::Time(11.0))) << "the next ones";
  EXPECT_FALSE(history.awaits(ros::Time(11.5))) << "they have ended";
  EXPECT_FALSE(history.awaits(ros::Time())) << "no state has come";
}

TEST(InstrumentHistory, ABagThatJumpsBackStartsAnewAndGarbageStampsAreSurvived) {
  InstrumentHistory history;
  for (int k = 0; k < 1000; ++k) history.add(instruments(100 + 0.001 * k));
  history.add(instruments(20));
  EXPECT_DOUBLE_EQ(history.at(ros::Time(100.5), 0.0)->header.stamp.toSec(), 20);
  history.add(instruments(4294967295.0));
  EXPECT_NE(history.at(ros::Time(1), 0.0), nullptr);
  history.clear();
  EXPECT_EQ(history.at(ros::Time(20), 0.0), nullptr);
}

}  // namespace
}  // namespace vest::displays
