#include <algorithm>
#include <sstream>

#include <rosbag/bag.h>
#include <topic_tools/shape_shifter.h>
#include <vest_msgs/EffectsOptions.h>
#include <vest_msgs/ModelEdit.h>
#include <vest_msgs/SceneFiles.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/StepInput.h>
#include <vest_msgs/TissueEvent.h>
#include <vest_msgs/TissueTopology.h>

#include "readers.h"
#include "vest_bringup/ros/bag_format.h"
#include "vest_bringup/ros/recorded_drawing.h"
#include "vest_bringup/ros/recorded_session.h"
#include "vest_bringup/ros/recovery.h"
#include "vest_bringup/ros/session_check.h"
#include "vest_bringup/ros/session_player.h"
#include "vest_bringup/session/motion_metrics.h"
#include "vest_bringup/session/motion_table.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/refusal.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/ros/conversions.h"
#include "vest_tissue/scene/scene_files.h"
#include "vest_tissue/scene/world.h"

namespace vest::fuzz {
namespace {

/// Inputs of `bag` and `steps` that reached a step of re-simulation.
std::uint64_t stepped = 0;

struct Enough : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct Topic {
  std::string name, type, md5sum, definition;
};
/// Its definition without remarks, which would be most of a small bag.
template <class M>
Topic topic(const char* name) {
  Topic t{name, ros::message_traits::datatype<M>(), ros::message_traits::md5sum<M>(), {}};
  std::istringstream definition(ros::message_traits::definition<M>());
  for (std::string line; std::getline(definition, line);) {
    line.resize(std::min(line.find('#'), line.size()));
    line.resize(line.find_last_not_of(' ') + 1);
    if (!line.empty()) t.definition += line + "\n";
  }
  return t;
}

enum Told : std::size_t { kScene, kTopology, kEffects, kStep, kHash, kEvent, kTopics };
const Topic& topicOf(std::size_t told) {
  using namespace vest_msgs;
  static const Topic all[kTopics] = {
      topic<SceneFiles>("/tissue/scene"),        topic<TissueTopology>("/tissue/topology"),
      topic<EffectsOptions>("/effects/options"), topic<StepInput>("/step_inputs"),
      topic<StateHash>("/tissue/state_hash"),    topic<TissueEvent>("/tissue/events")};
  return all[told];
}

struct Message {
  std::size_t told = 0;
  std::string bytes;
};
template <class M>
Message message(Told told, const M& from) {
  std::string bytes(ros::serialization::serializationLength(from), '\0');
  ros::serialization::OStream out(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                  static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(out, from);
  return {told, bytes};
}

/// Bytes of a bag of these, a millisecond apart.
std::string bagOf(const std::vector<Message>& messages, rosbag::compression::CompressionType compression) {
  const std::string file = folder().path() + "/made.bag";
  rosbag::Bag bag(file, rosbag::bagmode::Write);
  bag.setCompression(compression);
  ros::Time t(100.0);
  for (const Message& m : messages) {
    const Topic& of = topicOf(m.told);
    topic_tools::ShapeShifter shifter;
    shifter.morph(of.md5sum, of.type, of.definition, "");
    std::string bytes = m.bytes;
    ros::serialization::IStream in(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                   static_cast<std::uint32_t>(bytes.size()));
    if (!bytes.empty()) shifter.read(in);  // it copies to null where there is nothing
    bag.write(of.name, t += ros::Duration(0.001), shifter);
  }
  bag.close();
  const std::string bytes = files::read(file, 4 << 20);
  std::remove(file.c_str());
  return bytes;
}

std::string bytesOf(std::uint64_t number, std::size_t size) {
  return {reinterpret_cast<const char*>(&number), size};
}

using Fields = std::vector<std::pair<std::string, std::string>>;
/// Name and value, each pair behind its length, as bags have them (bag_format.h).
std::string text(const Fields& fields) {
  std::string made;
  for (const auto& [name, value] : fields)
    made += bytesOf(name.size() + 1 + value.size(), 4) + name + "=" + value;
  return made;
}

std::string record(session::Op op, const Fields& fields, const std::string& data) {
  const std::string header = text({{"op", std::string(1, static_cast<char>(op))}}) + text(fields);
  return bytesOf(header.size(), 4) + header + bytesOf(data.size(), 4) + data;
}

/// The same messages in one chunk, without an index. rosbag loads a library for each bag that it makes, which
/// takes longer than all that is read of it.
std::string plainBagOf(const std::vector<Message>& messages) {
  using session::Op;
  std::string chunk;
  for (std::size_t told = 0; told < kTopics; ++told) {
    const Topic& of = topicOf(told);
    chunk += record(Op::Connection, {{"conn", bytesOf(told, 4)}, {"topic", of.name}},
                    text({{"type", of.type}, {"md5sum", of.md5sum}, {"message_definition", of.definition}}));
  }
  std::uint64_t nanoseconds = 0;
  for (const Message& m : messages) {
    const std::uint64_t time = 100 + ((nanoseconds += 1'000'000) << 32);
    chunk += record(Op::Message, {{"conn", bytesOf(m.told, 4)}, {"time", bytesOf(time, 8)}}, m.bytes);
  }
  const Fields begin{
      {"index_pos", bytesOf(1, 8)}, {"conn_count", bytesOf(kTopics, 4)}, {"chunk_count", bytesOf(1, 4)}};
  return session::kBagMagic + record(Op::BagHeader, begin, "") +
         record(Op::Chunk, {{"compression", "none"}, {"size", bytesOf(chunk.size(), 4)}}, chunk);
}

std::string sceneText() {
  return files::read(std::string(VEST_SOURCE_DIR) + "/fuzz/corpus/scene/two", 1 << 20);
}

/// A scene as fuzz/corpus has it. It tells no hash: a changed scene is stepped, too.
Message sceneMessage(const std::string& text) {
  folder().unpack("scene.yaml", text);
  vest_msgs::SceneFiles carried;
  carried.scene = "two";
  for (const std::string& name : folder().names()) {
    const std::string bytes = files::read(folder().path() + "/" + name, 1 << 20);
    carried.names.push_back(name);
    carried.data.insert(carried.data.end(), bytes.begin(), bytes.end());
    carried.ends.push_back(static_cast<std::uint32_t>(carried.data.size()));
  }
  folder().clear();
  return message(kScene, carried);
}

/// Four steps with a reset among them, whose hashes are those of whoever simulates them again.
const std::vector<Message>& recordedSteps() {
  static const std::vector<Message> all = [] {
    scene::Description description = scene::loadScene(folder().unpack("scene.yaml", sceneText()));
    description.cache_directory.clear();
    scene::World world(description);
    vest_msgs::TissueTopology topology;
    topology.scene = description.name;
    vest_msgs::EffectsOptions effects;  // for who simulates them, too: vest_score
    effects.vessels = "pelvis";
    std::vector<Message> made{message(kTopology, topology), message(kEffects, effects)};
    for (int i = 0; i < 4; ++i) {
      const ros::Time stamp(100.0 + 0.001 * (i + 1));
      scene::StepFrame frame;
      scene::StepReport report;
      if (i == 2) frame.command = scene::Command::Reset, world.reset();
      frame.input.step = world.steps() + 1;
      frame.input.dt = description.dt;
      scene::ToolInput& tool = frame.input.tools[0];
      tool.present = true, tool.tool = tools::ToolKind::Grasper;
      tool.position = {0.01, 0.01, 0.0605}, tool.pivot = {0, 0, 0.3};
      if (i == 1) {
        frame.input.requests.emplace_back();  // the first link of the first object
        frame.input.edits.push_back({"block", "damping_scale", 0.9});
        frame.input.impacts.emplace_back();
        frame.input.loads.emplace_back();
        frame.input.dilatations.emplace_back();
      }
      frame.status = world.step(frame.input, report);
      vest_msgs::StepInput input;
      ros_shell::toMsg(frame, description, input);
      input.header.stamp = stamp;
      made.push_back(message(kStep, input));
      vest_msgs::StateHash hash;
      hash.header.stamp = stamp;
      hash.step = world.steps();
      hash.hash = world.stateHash();
      made.push_back(message(kHash, hash));
    }
    vest_msgs::TissueEvent event;
    event.kind = vest_msgs::TissueEvent::FAULT;  // of no step: its stamp is that of none
    made.push_back(message(kEvent, event));
    return made;
  }();
  return all;
}

/// So small that random changes strike every part; with and without compression.
std::vector<std::string> smallBags() {
  std::vector<Message> messages = recordedSteps();
  messages.insert(messages.begin(), sceneMessage(sceneText()));
  return {bagOf(messages, rosbag::compression::Uncompressed), bagOf(messages, rosbag::compression::LZ4)};
}

/// Its messages behind the scene, apart: what changes one of them leaves the bag and the others whole. A line
/// "=== N" begins a message of the topic N.
std::vector<std::string> smallSessions() {
  std::string text;
  for (const Message& m : recordedSteps()) text += "\n=== " + std::to_string(m.told) + "\n" + m.bytes;
  return {text};
}

/// As vest_resimulate does. A scene that became large makes one step.
void simulateAgain(const std::string& file) {
  bool any = false;
  try {
    session::RecordedSession recorded(file);
    session::play(folder().path(), recorded, {}, [&](const scene::World& world, const auto&...) {
      any = true;
      std::size_t knots = 0;
      for (const auto& object : world.description().objects) knots += object.position.size();
      if (knots > 400) throw Enough("large");
    });
  } catch (const session::Difference&) {
    any = true;
  } catch (const Enough&) {
  } catch (const std::invalid_argument& error) {
    if (any) ++stepped;
    throw std::invalid_argument(files::refusal(error.what(), file));
  }
  if (any) ++stepped;
}

/// The bag of a session: judged, simulated again, recovered.
void readBag(const std::string& input) {
  folder().clear();
  const std::string file = folder().write("session.bag", input), target = folder().path() + "/recovered.bag";
  takes(file, [&] { session::checkSession(folder().path(), "/", false); });
  takes(folder().path(), [&] { simulateAgain(file); });
  takes(file, [&] { session::recoverBag(file, target); });
  std::remove(target.c_str());
  std::remove((folder().path() + "/session.json").c_str());
}

void readSteps(const std::string& input) {
  static const Message scene = sceneMessage(sceneText());
  std::vector<Message> messages{scene};
  const std::string mark = "\n=== ";
  for (std::size_t at = input.find(mark); at < input.size();) {
    const std::size_t told = at + mark.size(), next = std::min(input.find(mark, told), input.size());
    if (told + 2 <= next)
      messages.push_back({static_cast<unsigned char>(input[told] - '0') % std::size_t{kTopics},
                          input.substr(told + 2, next - told - 2)});
    at = next;
  }
  folder().clear();
  const std::string file = folder().write("session.bag", plainBagOf(messages));
  takes(folder().path(), [&] { simulateAgain(file); });
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
  const FewMaterials few;
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

std::uint64_t steppedSessions() {
  return stepped;
}

std::vector<Reader> sessionReaders() {
  return {{"bag", readBag, smallBags},
          {"steps", readSteps, smallSessions},
          {"drawing", readDrawing, drawings},
          {"summary", readSummary, {}},
          {"motion_table", readTable, {}}};
}

}  // namespace vest::fuzz
