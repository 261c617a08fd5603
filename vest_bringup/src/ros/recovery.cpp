#include "vest_bringup/ros/recovery.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <topic_tools/shape_shifter.h>

#include "vest_bringup/ros/bag_format.h"
#include "vest_bringup/ros/bag_reader.h"
#include "vest_bringup/ros/bag_writer.h"
#include "vest_bringup/ros/session_observer.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/utf8.h"

namespace vest::session {
namespace {

namespace fs = std::filesystem;

/// A bag that nobody writes.
class Held {
 public:
  explicit Held(const std::string& file)
      : descriptor_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    if (descriptor_ < 0 || flock(descriptor_, LOCK_EX | LOCK_NB) == 0) return;
    ::close(descriptor_);
    throw std::invalid_argument(file + ": is being recorded (end the session first)");
  }
  ~Held() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  Held(const Held&) = delete;
  Held& operator=(const Held&) = delete;

 private:
  int descriptor_;
};

/// A connection as it is written. Stock readers take texts of a bag for UTF-8.
struct Copied {
  std::string topic;
  topic_tools::ShapeShifter message;
  boost::shared_ptr<ros::M_string> header;  ///< where latched
};

Copied copied(const BagConnection& c) {
  Copied out;
  out.topic = files::asUtf8(c.topic);
  out.message.morph(files::asUtf8(c.md5sum), files::asUtf8(c.type), files::asUtf8(c.definition), "");
  const auto latching = c.fields.find("latching");
  if (latching != c.fields.end() && latching->second == "1") {
    out.header = boost::make_shared<ros::M_string>();
    for (const auto& [name, value] : c.fields) (*out.header)[files::asUtf8(name)] = files::asUtf8(value);
  }
  return out;
}

/// Namespace of the session: what stands before step_inputs, else before session/state.
void noteNamespace(const std::string& topic, std::string& ns) {
  for (const char* known : {"/step_inputs", "/session/state"})
    if (ns.empty() && endsWith(topic, known)) ns = topic.substr(0, topic.size() - std::strlen(known) + 1);
}

std::optional<std::uint64_t> received(const std::string& source) {
  if (!endsWith(source, ".active")) return std::nullopt;
  constexpr std::size_t kMost = 4096;
  try {
    const std::string bytes = files::read(source.substr(0, source.size() - 7) + ".progress", kMost);
    std::uint64_t count = 0;
    if (bytes.size() < sizeof count) return std::nullopt;
    std::memcpy(&count, bytes.data(), sizeof count);
    return count;
  } catch (const files::Refused&) {  // there is none, or it is a pipe
    return std::nullopt;
  }
}

/// session.json of what was recovered.
bool summarise(const std::string& bag, const std::string& ns, const Recovery& recovery) {
  BagReader reader(bag);
  ClockTotals totals;
  reader.read([&](const BagMessage& m) {
    double by = 0;
    if (m.connection.topic == ns + "session/marks" && readClockMark(m, by)) totals.add(by);
  });
  SessionObserver observer(ns);
  Summary& summary = observer.summary;
  reader.read([&](const BagMessage& m) {
    const std::string& topic = m.connection.topic;
    observer.count(m);
    if (observer.wants(topic))
      observer.observe(m, m.time(), [&](double stamp) { return totals.onLine(stamp, m.time()); });
    double by = 0;
    if (topic == ns + "session/marks" && readClockMark(m, by)) {
      const auto steps = summary.topics.find(ns + "step_inputs");
      const double since = steps == summary.topics.end() ? 0.0 : m.time() - steps->second.first;
      summary.clock_jumps.push_back({summary.steps.lastStep(), since, by});
    }
  });
  const fs::path folder = fs::absolute(bag).parent_path();
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".png" && entry.path().stem().string().rfind("endoscope", 0) == 0)
      summary.pictures.push_back(entry.path().filename().string());
  }
  std::sort(summary.pictures.begin(), summary.pictures.end());
  summary.version = VEST_VERSION;
  summary.messages = recovery.kept;
  summary.dropped = recovery.lost.value_or(recovery.damaged);
  summary.bytes = fs::file_size(bag);
  summary.ended = "killed";
  return writeSummary(summary, folder.string());
}

}  // namespace

Recovery recoverBag(std::string source, std::string target) {
  if (fs::is_directory(source)) {
    const fs::path active = fs::path(source) / "session.bag.active";
    if (!fs::exists(active) && fs::exists(fs::path(source) / "session.bag"))
      throw std::invalid_argument(
          source +
          ": holds session.bag and no session.bag.active: nothing to recover (of a damaged "
          "bag: name the file itself)");
    source = active.string();
  }
  const bool active = endsWith(source, ".active");
  const bool in_place = target.empty() && active;
  if (target.empty()) target = active ? source.substr(0, source.size() - 7) : source + ".recovered.bag";
  if (fs::exists(target))
    throw std::invalid_argument(target + ": exists (allowed: a file that does not exist)");
  BagReader reader(source);
  const Held held(source);

  Recovery recovery;
  recovery.bag = target;
  std::string ns;
  const std::string part = target + ".recovering";
  try {
    BagWriter writer(part, 0);
    std::map<const BagConnection*, Copied> connections;
    const BagReader::Salvage salvage = reader.salvage([&](const BagMessage& m) {
      auto [found, is_new] = connections.try_emplace(&m.connection);
      Copied& copy = found->second;
      if (is_new) {
        copy = copied(m.connection);
        noteNamespace(copy.topic, ns);
      }
      ros::serialization::IStream in(const_cast<std::uint8_t*>(m.data), m.size);
      if (m.size + copy.message.size() > 0) copy.message.read(in);  // it copies to null where both are empty
      if (!writer.write(copy.topic, ros::Time(m.seconds, m.nanoseconds), copy.message, copy.header))
        throw std::runtime_error(part + ": cannot be written (is the disk full?)");
    });
    recovery.kept = salvage.kept;
    recovery.damaged = salvage.damaged;
    if (recovery.kept == 0) throw std::invalid_argument(source + ": no message in it could be read");
    writer.close();
  } catch (...) {
    for (const char* more : {"", ".active", ".progress"}) std::remove((part + more).c_str());
    throw;
  }
  if (const auto count = received(source))
    recovery.lost = *count > recovery.kept ? *count - recovery.kept : 0;
  if (std::rename(part.c_str(), target.c_str()) != 0)
    throw std::runtime_error(target + ": cannot be renamed from " + part);
  const bool session = fs::path(target).filename() == "session.bag";
  if (session && !fs::exists(fs::absolute(target).parent_path() / "session.json"))
    recovery.summarised = summarise(target, ns.empty() ? "/" : ns, recovery);
  if (in_place) {
    std::remove(source.c_str());
    std::remove((target + ".progress").c_str());
  }
  return recovery;
}

}  // namespace vest::session
