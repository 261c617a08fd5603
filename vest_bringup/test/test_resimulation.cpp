#include <gtest/gtest.h>

#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>

#include <ros/package.h>
#include <std_msgs/String.h>
#include <vest_msgs/EffectsOptions.h>
#include <vest_msgs/SceneFiles.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/TissueEvent.h>

#include "vest_bringup/ros/bag_writer.h"
#include "vest_bringup/ros/recovery.h"
#include "vest_bringup/ros/typed_message.h"
#include "vest_bringup/session/statistics.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/scene/scene_files.h"

// Protects re-simulation from what a bag says: it carries its scene, lies of types and counts are refused
// with the file's name, a FAULT is no silence. With VEST_WRITE_SESSION=FOLDER this program writes a session
// and ends.

namespace vest {
namespace {

namespace fs = std::filesystem;
constexpr std::uint64_t kSteps = 300;

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "vest_resimulation_XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~Folder() { fs::remove_all(path_); }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

template <class M>
topic_tools::ShapeShifter shifted(const M& message) {
  topic_tools::ShapeShifter shifter;
  shifter.morph(ros::message_traits::md5sum(message), ros::message_traits::datatype(message),
                ros::message_traits::definition(message), "");
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(message));
  ros::serialization::OStream out(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(out, message);
  ros::serialization::IStream in(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  shifter.read(in);
  return shifter;
}

/// Where a test changes what is written.
struct Changes {
  std::function<void(vest_msgs::StepInput&)> input = [](vest_msgs::StepInput&) {};  ///< as consumed
  std::function<void(vest_msgs::StepInput&)> written = [](vest_msgs::StepInput&) {};
  std::function<void(vest_msgs::SceneFiles&)> scene = [](vest_msgs::SceneFiles&) {};
  std::function<void(vest_msgs::StateHash&)> effects_hash = [](vest_msgs::StateHash&) {};
  std::string string_on;  ///< topic that gets a std_msgs/String instead
  bool events = true;
  std::function<void(vest_msgs::StateHash&)> hash = [](vest_msgs::StateHash&) {};
  std::optional<ros::Time> fault_of_no_step;  ///< stamp of a FAULT that is written, too
};

class Session {
 public:
  Session(const std::string& folder, const Changes& changes)
      : changes_(changes), bag_(folder + "/session.bag", 0) {}

  template <class M>
  void write(const std::string& topic, double t, const M& message) {
    if (topic == changes_.string_on) {
      std_msgs::String text;
      text.data = std::string(400, 'x');
      bag_.write("/vest/" + topic, ros::Time(1000 + t), shifted(text), nullptr);
    } else {
      bag_.write("/vest/" + topic, ros::Time(1000 + t), shifted(message), nullptr);
    }
  }
  void close() { bag_.close(); }

 private:
  const Changes& changes_;
  session::BagWriter bag_;
};

std::unique_ptr<scene::Simulation> composite(scene::World world, simulation::StageOptions& options) {
  options.blood.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  return std::move(simulation::makeStage(std::move(world), options).trainer);
}

/// A session of 300 steps with effects, as the recorder writes it.
void writeSession(const std::string& folder, const std::string& scene_file, const Changes& changes = {}) {
  scene::SceneFiles files;
  const scene::Description description = scene::loadScene(scene_file, files);
  simulation::StageOptions options;
  const auto trainer = composite(scene::World(description), options);
  const scene::World& world = trainer->world();
  Session session(folder, changes);
  vest_msgs::SceneFiles carried;
  carried.scene = scene_file;
  carried.scene_hash = description.hash;
  for (const auto& [name, bytes] : files.files) {
    carried.names.push_back(name);
    carried.data.insert(carried.data.end(), bytes.begin(), bytes.end());
    carried.ends.push_back(static_cast<std::uint32_t>(carried.data.size()));
  }
  carried.materials.assign(files.materials.begin(), files.materials.end());
  changes.scene(carried);
  session.write("tissue/scene", 0, carried);
  vest_msgs::TissueTopology topology;
  ros_shell::toMsg(world, topology);
  session.write("tissue/topology", 0, topology);
  vest_msgs::EffectsOptions effects;
  effects.vessels = "pelvis";
  eachNumber(options, [&](const char* name, double& value, double, double) {
    effects.names.emplace_back(name);
    effects.values.push_back(value);
  });
  session.write("effects/options", 0, effects);
  scene::StepReport report;
  session::Summary summary;
  summary.version = "0.1.0", summary.scene = world.description().name, summary.scene_hash = description.hash;
  summary.state_hash = "0", summary.ended = "interrupted";
  for (std::uint64_t k = 1; k <= kSteps; ++k) {
    const double t = 0.001 * static_cast<double>(k);
    scene::StepFrame frame;
    frame.input.step = k;
    frame.input.tools[1].present = true;
    frame.input.tools[1].tool = tools::ToolKind::Grasper;
    frame.input.tools[1].position = {0.0, 0.05, 0.1 - 0.0002 * static_cast<double>(k)};
    frame.input.tools[1].pivot = {0.0, 0.0, 0.3};
    vest_msgs::StepInput m;
    ros_shell::toMsg(frame, world.description(), m);
    changes.input(m);
    ros_shell::fromMsg(m, world.description(), frame.input);
    frame.status = trainer->step(frame.input, report);
    ros_shell::toMsg(frame, world.description(), m);
    m.header.stamp = ros::Time(1000 + t);
    changes.written(m);
    session.write("step_inputs", t, m);
    summary.steps.add(k, m.dt, 1000 + t, false);
    for (const scene::Event& event : report.events) {
      vest_msgs::TissueEvent e;
      ros_shell::toMsg(event, world.description(), e);
      e.header.stamp = m.header.stamp;
      if (changes.events) session.write("tissue/events", t, e);
    }
    if (k % 100 != 0) continue;
    vest_msgs::StateHash hash;
    hash.header.stamp = m.header.stamp;
    hash.step = k;
    hash.hash = world.stateHash();
    changes.hash(hash);
    session.write("tissue/state_hash", t, hash);
    hash.step = k;
    hash.hash = trainer->effectsHash().value();
    changes.effects_hash(hash);
    session.write("effects/state_hash", t, hash);
  }
  if (changes.fault_of_no_step) {
    vest_msgs::TissueEvent e;
    e.kind = vest_msgs::TissueEvent::FAULT, e.step = 7, e.header.stamp = *changes.fault_of_no_step;
    session.write("tissue/events", 0.001 * kSteps, e);
  }
  session.close();
  session::writeSummary(summary, folder);
}

std::string shipped(const std::string& scene) {
  return ros::package::getPath("vest_tissue") + "/scenes/" + scene + "/" + scene + ".yaml";
}

struct Said {
  int code;
  std::string text;
};

/// What vest_resimulate says within so much memory.
Said resimulate(const Folder& folder, const std::string& options = "") {
  const std::string out = folder / "said";
  const int status = std::system(
      ("ulimit -v 3000000; " VEST_RESIMULATE " " + folder.path() + " " + options + " > " + out + " 2>&1")
          .c_str());
  std::ifstream in(out);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, {std::istreambuf_iterator<char>(in), {}}};
}

TEST(Resimulation, ASessionCarriesItsSceneAlsoWhereTheSceneIsGone) {
  const Folder folder;
  {
    const Folder scene;
    fs::copy(fs::path(shipped("tube")).parent_path(), scene / "mine", fs::copy_options::recursive);
    fs::rename(scene / "mine/tube.yaml", scene / "mine/my_scene.yaml");
    writeSession(folder.path(), scene / "mine/my_scene.yaml");
  }
  for (const char* options : {"", "--threads 2", "--effects"}) {
    const Said said = resimulate(folder, options);
    EXPECT_EQ(said.code, 0) << options << ": " << said.text;
    EXPECT_EQ(said.text.rfind("300 steps, 3 state hashes", 0), 0U) << said.text;
    const bool told = said.text.find("3 hashes of the effects") != std::string::npos;
    EXPECT_EQ(told, std::string(options) == "--effects") << said.text;
  }
}

TEST(Resimulation, ASceneOfTheDatabasesMaterialsIsLoadedWithTheDatabaseOfTheSession) {
  const Folder folder;
  Changes changes;
  bool carried = false;
  changes.scene = [&](vest_msgs::SceneFiles& files) { carried = !files.materials.empty(); };
  {
    const Folder scene;
    fs::copy(fs::path(shipped("tube")).parent_path(), scene / "tube");
    std::ifstream in(shipped("tube"));
    std::ofstream out(scene / "tube/tube.yaml");
    for (std::string line; std::getline(in, line);)
      if (line.find("law:") == std::string::npos) out << line << "\n";  // then it is the database's
    out.close();
    writeSession(folder.path(), scene / "tube/tube.yaml", changes);
  }
  EXPECT_TRUE(carried);
  setenv("VEST_TISSUE_DATA", "/nowhere", 1);  // a machine with another database
  const Said said = resimulate(folder);
  unsetenv("VEST_TISSUE_DATA");
  EXPECT_EQ(said.code, 0) << said.text;
}

TEST(Resimulation, ASceneWithSuturesIsLoadedWithTheirDatabaseOfTheSession) {
  const Folder folder;
  writeSession(folder.path(), shipped("suture_pad"));
  setenv("VEST_TISSUE_DATA", "/nowhere", 1);
  const Said said = resimulate(folder);
  unsetenv("VEST_TISSUE_DATA");
  EXPECT_EQ(said.code, 0) << said.text;
}

TEST(Resimulation, WhatASceneInABagNamesNeverLeavesItsFolder) {
  for (const char* name : {"../escaped.yaml", "/tmp/vest_escaped.yaml", "a/../../b", ""}) {
    const Folder folder;
    Changes changes;
    changes.scene = [&](vest_msgs::SceneFiles& files) { files.names.back() = name; };
    writeSession(folder.path(), shipped("tube"), changes);
    const Said said = resimulate(folder);
    EXPECT_EQ(said.code, 2) << said.text;
    EXPECT_NE(said.text.find("allowed: a path below the scene's folder"), std::string::npos) << said.text;
  }
  EXPECT_FALSE(fs::exists("/tmp/vest_escaped.yaml"));
}

TEST(Resimulation, ASceneInABagHasNoMoreFilesThanADiskTakesAtOnce) {
  Changes changes;
  changes.scene = [](vest_msgs::SceneFiles& files) {
    files.names.resize(10001, "more.csv");
    files.ends.resize(10001, files.ends.back());
  };
  const Folder folder;
  writeSession(folder.path(), shipped("tube"), changes);
  const Said said = resimulate(folder);
  EXPECT_EQ(said.code, 2) << said.text;
  EXPECT_NE(said.text.find("10001 files (allowed: at most 10000)"), std::string::npos) << said.text;
}

TEST(Resimulation, AWrongTypeIsToldInOneLineThatWritesToNoTerminal) {
  session::BagConnection connection;
  connection.topic = "/vest/\x1b[2J", connection.type = "a\nb", connection.md5sum = "c\xff";
  std_msgs::String to;
  try {
    session::readMessage("file", session::BagMessage{connection, 0, 0, nullptr, 0}, to);
    FAIL() << "believed";
  } catch (const std::invalid_argument& e) {
    const std::string text = e.what();
    EXPECT_TRUE(std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; })) << text;
    EXPECT_NE(text.find("c\\xff"), std::string::npos) << text;
  }
}

TEST(Resimulation, ATopicOfAnotherTypeIsRefusedByNameAndNotBelieved) {
  for (const char* topic : {"step_inputs", "tissue/state_hash", "effects/state_hash", "tissue/topology",
                            "tissue/scene", "effects/options"}) {
    const Folder folder;
    Changes changes;
    changes.string_on = topic;
    writeSession(folder.path(), shipped("tube"), changes);
    const Said said = resimulate(folder);
    EXPECT_EQ(said.code, 2) << topic << ": " << said.text;
    EXPECT_EQ(said.text.find("vest_resimulate: " + folder.path() + "/session.bag: /vest/" + topic), 0U)
        << said.text;
    EXPECT_NE(said.text.find("std_msgs/String"), std::string::npos) << said.text;
  }
}

TEST(Resimulation, AChangedInputAndAChangedFeedbackAreDifferences) {
  const Folder folder;
  Changes changes;
  changes.written = [](vest_msgs::StepInput& m) {
    if (m.step == 120) m.tools[1].position[2] -= 0.05;
  };
  writeSession(folder.path(), shipped("touch_slab"), changes);
  const Said said = resimulate(folder);
  EXPECT_EQ(said.code, 1) << said.text;
  const Folder other;
  changes.written = [](vest_msgs::StepInput& m) {
    if (m.step != 120) return;
    m.dilatations.resize(1);
    m.dilatations[0].vessel_segment = "nobody";
    m.dilatations[0].dilatation.fill(1);
  };
  writeSession(other.path(), shipped("tube"), changes);
  EXPECT_EQ(resimulate(other).code, 0) << "a vessel that is not there moves nothing";
  const Said effects = resimulate(other, "--effects");
  EXPECT_EQ(effects.code, 1) << effects.text;
  EXPECT_NE(effects.text.find("what the effects handed to step 120"), std::string::npos) << effects.text;
}

/// Effects that differ and hand nothing back, as smoke and a lens do, differ in their hash alone.
TEST(Resimulation, EffectsOfAnotherStateAreADifference) {
  const Folder folder;
  Changes changes;
  changes.effects_hash = [](vest_msgs::StateHash& m) {
    if (m.step == 200) m.hash ^= 1U;
  };
  writeSession(folder.path(), shipped("tube"), changes);
  EXPECT_EQ(resimulate(folder).code, 0);
  const Said said = resimulate(folder, "--effects");
  EXPECT_EQ(said.code, 1) << said.text;
  EXPECT_NE(said.text.find("the effects' hash after step 200"), std::string::npos) << said.text;
}

TEST(Resimulation, AStepLengthThatIsNoneIsRefusedByStepAndFile) {
  for (const double dt : {std::numeric_limits<double>::quiet_NaN(), 0.0, -0.001}) {
    const Folder folder;
    Changes changes;
    changes.written = [&](vest_msgs::StepInput& m) {
      if (m.step == 250) m.dt = dt;
    };
    writeSession(folder.path(), shipped("tube"), changes);
    const Said said = resimulate(folder);
    EXPECT_EQ(said.code, 2) << said.text;
    EXPECT_NE(said.text.find("session.bag: step 250: dt is "), std::string::npos) << said.text;
  }
}

TEST(Resimulation, AFaultIsComparedWithTheSessions) {
  Changes changes;
  changes.input = [](vest_msgs::StepInput& m) {
    if (m.step == 250) m.dt = 1e9;
  };
  const Folder folder;
  writeSession(folder.path(), shipped("tube"), changes);
  const Said said = resimulate(folder);
  EXPECT_EQ(said.code, 0) << said.text;
  EXPECT_NE(said.text.find("1 of these steps are FAULTs, as in the session"), std::string::npos) << said.text;
  changes.events = false;
  const Folder silent;
  writeSession(silent.path(), shipped("tube"), changes);
  const Said other = resimulate(silent);
  EXPECT_EQ(other.code, 1) << other.text;
  EXPECT_NE(other.text.find("FAULT in step 250, which the session did not have"), std::string::npos)
      << other.text;
}

TEST(Resimulation, WhatWasRecordedOfAStepThatIsNotThereIsADifference) {
  const auto said = [](const Changes& changes) {
    const Folder folder;
    writeSession(folder.path(), shipped("tube"), changes);
    return resimulate(folder);
  };
  Changes changes;
  changes.hash = [](vest_msgs::StateHash& hash) {
    if (hash.step == 200) ++hash.step;
  };
  const Said hash = said(changes);
  EXPECT_EQ(hash.code, 1) << hash.text;
  EXPECT_NE(hash.text.find("first difference: a state hash of step 201, and no step input has"),
            std::string::npos)
      << hash.text;
  changes = {};
  changes.fault_of_no_step = ros::Time(1000.2);
  const Said fault = said(changes);
  EXPECT_EQ(fault.code, 1) << fault.text;
  EXPECT_NE(fault.text.find("first difference: a FAULT of step 8, and no step input has"), std::string::npos)
      << fault.text;
  changes.fault_of_no_step = ros::Time(999.9);  // the recorder came later
  EXPECT_EQ(said(changes).code, 0);
}

TEST(Recovery, WritesSessionJsonLeavesNoSecondCopyAndKeepsWhatLiesBehindADamagedChunk) {
  const Folder folder;
  writeSession(folder.path(), shipped("tube"));
  fs::remove(folder / "session.json");
  const auto size = fs::file_size(folder / "session.bag");
  fs::rename(folder / "session.bag", folder / "session.bag.active");
  fs::resize_file(folder / "session.bag.active", size - size / 10);
  const session::Recovery done = session::recoverBag(folder.path(), "");
  EXPECT_GT(done.kept, 100U);
  EXPECT_TRUE(done.summarised);
  EXPECT_TRUE(fs::exists(folder / "session.bag"));
  EXPECT_FALSE(fs::exists(folder / "session.bag.active"));
  std::ifstream in(folder / "session.json");
  const std::string json{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(json.find("\"ended\": \"killed\""), std::string::npos) << json;
  EXPECT_NE(json.find("\"/vest/step_inputs\""), std::string::npos) << json;
  EXPECT_THROW(session::recoverBag(folder.path(), ""), std::invalid_argument) << "nothing is left to recover";
}

TEST(Recovery, WhatIsBeingRecordedIsLeftAlone) {
  const Folder folder;
  session::BagWriter writer(folder / "session.bag", 0);
  writer.write("/a", ros::Time(1), shifted(std_msgs::String()), nullptr);
  writer.closeChunk();
  try {
    session::recoverBag(folder.path(), "");
    FAIL() << "recovered under the recorder's hands";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("is being recorded"), std::string::npos) << e.what();
  }
  EXPECT_TRUE(fs::exists(folder / "session.bag.active"));
}

}  // namespace
}  // namespace vest

int main(int argc, char** argv) {
  if (const char* folder = std::getenv("VEST_WRITE_SESSION")) {
    vest::writeSession(folder, vest::shipped("tube"));
    return 0;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
