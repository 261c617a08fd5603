// Protects long sessions: eight hours of simulated time cost neither memory nor descriptors, simulated and
// recorded.
#include <cstdio>
#include <cstdlib>
#include <filesystem>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_msgs/Header.h>

#include "../../vest_tissue/test/support/soak.h"
#include "play.h"
#include "vest_bringup/ros/bag_writer.h"
#include "vest_bringup/session/statistics.h"

namespace vest {
namespace {

namespace fs = std::filesystem;

std::int64_t counted(std::int64_t whole, std::int64_t part, const char* what) {
  const std::int64_t count = std::getenv("VEST_FULL") != nullptr ? whole : whole / part;
  std::printf("count: %lld of %lld %s\n", static_cast<long long>(count), static_cast<long long>(whole), what);
  return count;
}

TEST(Soak, EightHoursOfASessionCostNoMemoryAndNoDescriptor) {
  const std::int64_t steps = counted(28800000, 400, "steps");
  simulation::Play play("touch_slab", true);
  const double dt = play.world().description().dt;
  const double length = play.trajectory.rows.back().t;
  const auto round = static_cast<std::int64_t>(length / dt);
  const simulation::Hands hands = simulation::handsOf(play.trajectory);
  auto script = std::make_unique<simulation::Script>(play.box, play.trajectory, hands);
  session::StepStatistics statistics;
  scene::StepReport report;
  testing::Soak soak;
  std::int64_t touched = 0, faults = 0;
  for (std::int64_t i = 0; i < steps; ++i) {
    if (i % round == 0) script = std::make_unique<simulation::Script>(play.box, play.trajectory, hands);
    const bool reset = i % (6 * round) == 0;  // each minute
    if (reset) play.stage.trainer->reset();
    scene::StepInput input = script->inputAt(static_cast<double>(i % round) * dt);
    input.step = play.world().steps() + 1;
    input.dt = dt;
    faults += play.stage.trainer->step(input, report) == scene::Status::Fault;
    touched += report.contacts[simulation::kRightHand].in_contact;
    statistics.add(input.step, dt, static_cast<double>(i) * dt, reset);
    if (i >= steps / 10 && i % (steps / 100) == 0) soak.sample(static_cast<double>(i) * dt / 3600.0);
  }
  EXPECT_EQ(faults, 0);
  EXPECT_GT(touched, steps / 5);
  EXPECT_EQ(statistics.steps(), static_cast<std::uint64_t>(steps));
  soak.judge();
}

TEST(Soak, EightHoursOfRecordingCostNoMemoryAndNoDescriptor) {
  // As many topics and chunks as a session has: a chunk each 250 ms.
  const std::int64_t chunks = counted(8 * 3600 * 4, 100, "chunks of a bag of 45 topics");
  std::string folder = (fs::temp_directory_path() / "vest_soak_XXXXXX").string();
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  std_msgs::Header header;
  topic_tools::ShapeShifter message;
  message.morph(ros::message_traits::md5sum(header), ros::message_traits::datatype(header),
                ros::message_traits::definition(header), "");
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(header));
  ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(out, header);
  ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  message.read(in);
  constexpr int kTopics = 45;
  std::vector<std::string> topics;
  for (int k = 0; k < kTopics; ++k) topics.push_back("/vest/topic_" + std::to_string(k));
  {
    session::BagWriter bag(folder + "/session.bag", 0);
    testing::Soak soak;
    for (std::int64_t i = 0; i < chunks; ++i) {
      const ros::Time time(1000 + static_cast<std::uint32_t>(i / 4),
                           250000000 * static_cast<std::uint32_t>(i % 4));
      for (const std::string& topic : topics) {
        bag.received();
        ASSERT_TRUE(bag.write(topic, time, message, nullptr));
      }
      bag.closeChunk();
      if (i % 4 == 0) bag.checkDisk();
      if (i >= chunks / 10 && i % (chunks / 100) == 0) soak.sample(static_cast<double>(i) / (4.0 * 3600.0));
    }
    soak.judge();
    bag.close();
  }
  {
    rosbag::Bag bag(folder + "/session.bag", rosbag::bagmode::Read);
    EXPECT_EQ(rosbag::View(bag).size(), static_cast<std::uint32_t>(kTopics * chunks));
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1)
      << "nothing beside the bag";
  fs::remove_all(folder);
}

}  // namespace
}  // namespace vest
