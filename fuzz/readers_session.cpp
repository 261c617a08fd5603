#include <rosbag/bag.h>
#include <vest_msgs/EffectsOptions.h>
#include <vest_msgs/ModelEdit.h>
#include <vest_msgs/SceneFiles.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/StepInput.h>
#include <vest_msgs/TissueEvent.h>
#include <vest_msgs/TissueTopology.h>

#include "readers.h"
#include "vest_bringup/ros/recorded_drawing.h"
#include "vest_bringup/ros/recorded_session.h"
#include "vest_bringup/ros/recovery.h"
#include "vest_bringup/ros/session_check.h"
#include "vest_bringup/session/motion_metrics.h"
#include "vest_bringup/session/motion_table.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/material/database.h"

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

/// A drawing of three edits, as the modeller records it.
std::vector<std::string> drawings() {
  const std::string source = files::read(std::string(VEST_SOURCE_DIR) + "/fuzz/corpus/source/tube", 1 << 20);
  modelling::Session drawn("source.yaml", source, modelling::readMaterials(material::databasePath()));
  drawn.apply("set", "/name", "other");
  drawn.apply("insert", "/objects/-", "{name: second, mirror_of: " + drawn.source().objects[0].name + "}");
  drawn.apply("undo", "");
  const std::string file = folder().path() + "/made.bag";
  {
    rosbag::Bag bag(file, rosbag::bagmode::Write);
    ros::Time t(100.0);
    for (const auto& edit : drawn.log()) {
      vest_msgs::ModelEdit told;
      told.seq = static_cast<std::uint32_t>(edit.seq);
      told.op = edit.op, told.path = edit.path, told.before = edit.before, told.after = edit.after;
      told.hash = edit.hash;
      bag.write("/model/edits", t += ros::Duration(1.0), told);
    }
  }
  std::vector<std::string> made{files::read(file, 1 << 20)};
  std::remove(file.c_str());
  return made;
}

void readDrawing(const std::string& input) {
  folder().clear();
  const std::string file = folder().write("drawing.bag", input);
  takes(file, [&] { session::replayDrawing(file); });
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
  folder().clear();
  const std::string file = folder().write("table.csv", input);
  session::MotionTable table;
  if (takes(file, [&] { table = session::readMotionTable(file); }))
    takes("", [&] { session::motion::figuresOf(table); });
}

}  // namespace

std::vector<Reader> sessionReaders() {
  return {{"bag", readBag, smallBags},
          {"drawing", readDrawing, drawings},
          {"summary", readSummary, {}},
          {"motion_table", readTable, {}}};
}

}  // namespace vest::fuzz
