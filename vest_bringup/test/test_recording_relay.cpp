#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include <std_msgs/Header.h>

#include "vest_bringup/ros/recorder.h"
#include "vest_bringup/ros/recording_relay.h"
#include "vest_bringup/ros/thinning.h"

// Protects recordings that come in batches: every message whole, losses counted, and nothing read past the
// end of what came.

namespace vest::session {
namespace {

class Batches {
 public:
  /// The next batch: messages with these sequence numbers.
  vest_msgs::RecordingBatch next(const std::vector<std::uint32_t>& seqs, bool described) {
    vest_msgs::RecordingBatch batch;
    if (described) {
      batch.described = {4};
      batch.names = {"/vest/a"};
      batch.datatypes = {ros::message_traits::datatype<std_msgs::Header>()};
      batch.md5sums = {ros::message_traits::md5sum<std_msgs::Header>()};
      batch.definitions = {ros::message_traits::definition<std_msgs::Header>()};
    }
    batch.first = count_;
    count_ += seqs.size();
    for (const std::uint32_t seq : seqs) {
      std_msgs::Header message;
      message.seq = seq;
      message.frame_id = std::string(seq, 'f');
      const std::size_t begin = batch.data.size();
      batch.data.resize(begin + ros::serialization::serializationLength(message));
      ros::serialization::OStream out(batch.data.data() + begin,
                                      static_cast<std::uint32_t>(batch.data.size() - begin));
      ros::serialization::serialize(out, message);
      batch.topics.push_back(4);
      batch.receipts.push_back(ros::Time(seq, 0));
      batch.ends.push_back(static_cast<std::uint32_t>(batch.data.size()));
    }
    return batch;
  }

 private:
  std::uint64_t count_ = 100;
};

class Taken {
 public:
  std::uint64_t take(const vest_msgs::RecordingBatch& batch) {
    return inlet_.take(batch, [this](const std::string& topic, const ros::Time& receipt,
                                     topic_tools::ShapeShifter::ConstPtr message) {
      const auto header = message->instantiate<std_msgs::Header>();
      EXPECT_EQ(topic, "/vest/a");
      EXPECT_EQ(receipt, ros::Time(header->seq, 0));
      EXPECT_EQ(header->frame_id, std::string(header->seq, 'f'));
      seqs.push_back(header->seq);
    });
  }
  std::vector<std::uint32_t> seqs;

 private:
  RelayInlet inlet_;
};

TEST(RecordingRelay, EveryMessageOfABatchComesOutWholeWithItsTopicAndTime) {
  Batches batches;
  Taken taken;
  EXPECT_EQ(taken.take(batches.next({1, 2, 3}, true)), 0U);
  EXPECT_EQ(taken.take(batches.next({4, 5}, false)), 0U);
  EXPECT_EQ(taken.seqs, (std::vector<std::uint32_t>{1, 2, 3, 4, 5}));
}

TEST(RecordingRelay, WhatCameBeforeTheTopicsWereDescribedIsNoLossAndLaterGapsAreCounted) {
  Batches batches;
  Taken taken;
  EXPECT_EQ(taken.take(batches.next({1}, false)), 0U);
  batches.next({2, 3}, false);  // lost before the recording began
  EXPECT_EQ(taken.take(batches.next({4}, true)), 0U);
  batches.next({5, 6, 7}, false);  // lost while it runs
  EXPECT_EQ(taken.take(batches.next({8}, false)), 3U);
  EXPECT_EQ(taken.seqs, (std::vector<std::uint32_t>{4, 8}));
}

TEST(RecordingRelay, ABatchThatContradictsItselfGivesNoMessageBeyondItsData) {
  Batches batches;
  Taken taken;
  vest_msgs::RecordingBatch batch = batches.next({1, 2}, true);
  batch.ends[1] += 1000;
  taken.take(batch);
  batch = batches.next({3, 4}, false);
  batch.ends[1] = 1;
  taken.take(batch);
  batch = batches.next({5, 6}, false);
  batch.receipts.pop_back();
  taken.take(batch);
  EXPECT_EQ(taken.seqs, (std::vector<std::uint32_t>{1, 3, 5}));
}

TEST(RecordingRelay, RelaysOnlyTopicsOfASession) {
  const std::vector<std::string> all = defaultTopics();
  const std::vector<std::string> relayed = relayedTopics();
  EXPECT_GE(relayed.size(), 10U);
  for (const std::string& topic : relayed)
    EXPECT_EQ(std::count(all.begin(), all.end(), topic), 1) << topic << " would never be recorded";
}

// A session in which somebody drew is drawn again from its bag (vest_replay_model).
TEST(RecordingRelay, EveryEditOfTheModellerIsRecordedWhole) {
  const std::vector<std::string> all = defaultTopics();
  EXPECT_EQ(std::count(all.begin(), all.end(), "model/edits"), 1);
  EXPECT_EQ(keptRate("model/edits"), 0.0);
}

// The values of a head show a face.
TEST(RecordingRelay, PatientsImagesAreNotRecordedUnlessAskedFor) {
  for (const std::string& topic : defaultTopics())
    EXPECT_EQ(topic.find("image/volume"), std::string::npos) << topic;
}

// An hour of bleeding and smoke is a bag of 6 GB at most (docs/decisions/0003-recording.md).
TEST(Thinning, WhatReSimulationMakesAgainIsKeptTenTimesASecondAndAllElseWhole) {
  for (const char* whole : {"step_inputs", "tissue/events", "effects/impacts", "haptics/left/state",
                            "phantom_box/footswitches", "session/score"}) {
    EXPECT_EQ(keptRate(whole), 0.0) << whole;
    EXPECT_FALSE(Thinning("/vest/", 10).wants(std::string("/vest/") + whole)) << whole;
  }
  for (const char* name : {"effects/fluid", "effects/smoke", "effects/lens", "tissue/state"}) {
    Thinning thinning("/vest/", 10);
    const BagConnection connection{std::string("/vest/") + name, "", "", "", {}};
    ASSERT_TRUE(thinning.wants(connection.topic)) << name;
    const std::uint8_t header[16] = {};
    int kept = 0;
    for (std::uint32_t i = 0; i < 400; ++i) {  // 40 a second for 10 s
      const BagMessage message{connection, 100 + i / 40, i % 40 * 25000000, header, sizeof header};
      kept += thinning.keeps(message, message.time());
    }
    EXPECT_NEAR(kept, 100, 2) << name;
  }
}

}  // namespace
}  // namespace vest::session
