#include <rosbag/bag.h>
#include <vest_msgs/EffectsOptions.h>
#include <vest_msgs/SceneFiles.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/StepInput.h>
#include <vest_msgs/TissueEvent.h>
#include <vest_msgs/TissueTopology.h>

#include "readers.h"
#include "vest_bringup/ros/recorded_session.h"
#include "vest_bringup/ros/recovery.h"
#include "vest_bringup/ros/session_check.h"
#include "vest_bringup/session/motion_metrics.h"
#include "vest_bringup/session/motion_table.h"
#include "vest_instruments/files/read.h"

namespace vest::fuzz {
namespace {

Folder& folder() {
  static Folder of_all;
  return of_all;
}

/// A few steps of a session, so small that random changes strike every part; with and without compression.
std::vector<std::string> smallBags() {
  std::vector<std::string> bags;
  for (const auto compression : {rosbag::compression::Uncompressed, rosbag::compression::LZ4}) {
    const std::string file = folder().path() + "/made.bag";
    rosbag::Bag bag(file, rosbag::bagmode::Write);
    bag.setCompression(compression);
    ros::Time t(100.0);
    vest_msgs::SceneFiles files;
    files.scene = "tube";
    files.names = {"scene.yaml"};
    files.data = {'a', ':', '1'};
    files.ends = {3};
    bag.write("/tissue/scene", t, files);
    vest_msgs::TissueTopology topology;
    topology.scene = "tube";
    bag.write("/tissue/topology", t, topology);
    bag.write("/effects/options", t, vest_msgs::EffectsOptions());
    for (int i = 0; i < 4; ++i) {
      t += ros::Duration(0.001);
      vest_msgs::StepInput input;
      input.header.stamp = t;
      input.step = static_cast<std::uint64_t>(i);
      input.dt = 0.001;
      bag.write("/step_inputs", t, input);
      vest_msgs::StateHash hash;
      hash.step = input.step;
      bag.write("/tissue/state_hash", t, hash);
    }
    vest_msgs::TissueEvent event;
    event.kind = vest_msgs::TissueEvent::FAULT;
    bag.write("/tissue/events", t, event);
    bag.close();
    bags.push_back(files::read(file, 1 << 20));
    std::remove(file.c_str());
  }
  return bags;
}

/// The bag of a session: judged, read for re-simulation, recovered.
void readBag(const std::string& input) {
  folder().clear();
  const std::string file = folder().write("session.bag", input), target = folder().path() + "/recovered.bag";
  takes(file, [&] { session::checkSession(folder().path(), "/", false); });
  takes(file, [&] {
    session::RecordedSession recorded(file);
    recorded.steps([](const vest_msgs::StepInput&) {});
  });
  takes(file, [&] { session::recoverBag(file, target); });
  std::remove(target.c_str());
  std::remove((folder().path() + "/session.json").c_str());
}

/// session.json beside a bag that is good: odd values are rows of the table, never the end.
void readSummary(const std::string& input) {
  static const std::string bag = smallBags().front();
  folder().clear();
  folder().write("session.bag", bag);
  folder().write("session.json", input);
  takes("", [&] {
    for (const auto& row : session::checkSession(folder().path(), "/", false)) {
      if (files::shown(row.value, 100000) != row.value)
        throw std::logic_error("a row with control characters");
    }
  });
}

void readTable(const std::string& input) {
  const std::string file = folder().write("table.csv", input);
  session::MotionTable table;
  if (takes(file, [&] { table = session::readMotionTable(file); }))
    takes("", [&] { session::motion::figuresOf(table); });
}

}  // namespace

std::vector<Reader> sessionReaders() {
  return {{"bag", readBag, smallBags}, {"summary", readSummary, {}}, {"motion_table", readTable, {}}};
}

}  // namespace vest::fuzz
