#include "vest_bringup/ros/session_check.h"

#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <map>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "vest_bringup/ros/bag_reader.h"
#include "vest_bringup/ros/session_observer.h"
#include "vest_bringup/ros/thinning.h"
#include "vest_bringup/session/statistics.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/strict_json.h"

namespace vest::session {
namespace {

struct Rate {
  const char* topic;  ///< relative to the namespace
  double least;       ///< Hz (docs/ros_interface.md)
  bool needed;        ///< must be there
};
constexpr Rate kRates[] = {{"joint_states", 500, true},
                           {"phantom_box/joint_states", 500, false},
                           {"phantom_box/footswitches", 50, true},
                           {"left/measured_js", 100, true},
                           {"left/measured_cp", 100, true},
                           {"right/measured_js", 100, true},
                           {"right/measured_cp", 100, true},
                           {"endoscope/measured_cp", 100, true},
                           {"tissue/state", 59, true},
                           {"tissue/contacts", 200, true},
                           {"/tf", 50, true},
                           {"endoscope/camera_info", 15, true}};
struct Field {
  const char* name;
  bool (*fits)(const nlohmann::json&);
};
bool isText(const nlohmann::json& j) {
  return j.is_string();
}
const Field kFields[] = {{"version", isText},
                         {"scene_hash", isText},
                         {"state_hash", isText},
                         {"steps", [](const auto& j) { return j.is_number_unsigned(); }},
                         {"real_time_factor", [](const auto& j) { return j.is_number() || j.is_null(); }},
                         {"rates", [](const auto& j) { return j.is_object(); }},
                         {"events", [](const auto& j) { return j.is_array(); }},
                         {"ended", isText}};
constexpr const char* kGoodEnds[] = {"interrupted", "stopped", "after the wished time", "after the script"};
constexpr std::uintmax_t kMostJson = 64U << 20U;  // bytes; 100,000 events are 20 MB

__attribute__((format(printf, 1, 2))) std::string text(const char* format, ...) {
  char buffer[160];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

/// What a file says, fit for a terminal.
std::string plain(const nlohmann::json& value) {
  std::string s = value.is_string()      ? value.get<std::string>()
                  : value.is_primitive() ? value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace)
                  : value.is_array()     ? "a list"
                                         : "an object";
  for (char& c : s)
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7E) c = '?';
  return s.size() > 24 ? s.substr(0, 21) + "..." : s;
}

struct Recorded {
  StepStatistics steps;
  std::map<std::string, TopicStatistics> topics;
};

Recorded readBag(const std::string& file, const std::string& ns) {
  BagReader bag(file);
  ClockTotals totals;
  bag.read([&](const BagMessage& m) {
    double by = 0;
    if (m.connection.topic == ns + "session/marks" && readClockMark(m, by)) totals.add(by);
  });
  Recorded recorded;
  SessionObserver counts(ns);
  bag.read([&](const BagMessage& m) {
    counts.count(m);
    if (m.connection.topic != ns + "step_inputs") return;
    StepHead head;
    if (!readStepHead(m, head))
      throw std::invalid_argument(file + ": " + m.connection.topic +
                                  ": a message that is no vest_msgs/StepInput");
    recorded.steps.add(head.step, head.dt, totals.onLine(head.stamp, m.time()), head.command != 0);
  });
  recorded.topics = std::move(counts.summary.topics);
  return recorded;
}

/// The object of session.json; no object: a row says why.
nlohmann::json readJson(const std::string& file, std::vector<CheckRow>& rows) {
  const auto none = [&](const std::string& why, const std::string& allowed) {
    rows.push_back({"session.json", why, allowed, false});
    return nlohmann::json();
  };
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) return none("is not there", "a file");
  try {
    auto json = files::parseJson(files::read(file, kMostJson), 8);  // ours is three levels deep
    return json.is_object() ? json : none("is no object", "an object with all fields");
  } catch (const files::Refused& why) {
    const std::string value = why.value.empty() ? "" : " = " + plain(why.value);
    return none((why.line > 0 ? "line " + std::to_string(why.line) + ": " : "") + why.field + value,
                why.allowed);
  }
}

void checkJson(const std::string& file, const Recorded& recorded, std::vector<CheckRow>& rows) {
  const nlohmann::json json = readJson(file, rows);
  if (!json.is_object()) return;
  std::string wrong;
  for (const Field& field : kFields) {
    const bool there = json.contains(field.name);
    if (!there || !field.fits(json[field.name]))
      wrong += (there ? " odd " : " no ") + std::string(field.name);
  }
  rows.push_back({"session.json", wrong.empty() ? "whole" : wrong.substr(1), "all fields", wrong.empty()});
  if (!wrong.empty()) return;
  const auto& steps = json["steps"];
  rows.push_back({"session.json steps", plain(steps),
                  text("%llu", static_cast<unsigned long long>(recorded.steps.steps())),
                  steps.get<std::uint64_t>() == recorded.steps.steps()});
  const double factor = recorded.steps.realTimeFactor();
  const auto& said = json["real_time_factor"];
  rows.push_back({"session.json real_time_factor", plain(said), text("%.4f +- 0.005", factor),
                  said.is_number() && std::abs(said.get<double>() - factor) < 0.005});
  const auto& ended = json["ended"];
  const bool good =
      std::any_of(std::begin(kGoodEnds), std::end(kGoodEnds), [&](const char* end) { return ended == end; });
  rows.push_back({"session.json ended", plain(ended), "as it was meant to", good});
}

}  // namespace

std::vector<CheckRow> checkSession(const std::string& directory, const std::string& ns, bool picture) {
  namespace fs = std::filesystem;
  const fs::path folder(directory);
  const std::string file = (folder / "session.bag").string();
  const std::string prefix = !ns.empty() && ns.back() == '/' ? ns : ns + "/";
  const bool open = fs::exists(folder / "session.bag.active");
  if (open && !fs::exists(file))
    throw std::invalid_argument(file +
                                ".active: the session has not ended, or its recorder was killed "
                                "(vest_recover_bag makes a whole bag of it)");
  const Recorded recorded = readBag(file, prefix);
  const auto found = [&](const std::string& topic) {
    const auto t = recorded.topics.find(topic);
    return t == recorded.topics.end() ? nullptr : &t->second;
  };
  std::vector<CheckRow> rows;
  const TopicStatistics* const session = found(prefix + "step_inputs");
  for (const Rate& rate : kRates) {
    const std::string name = rate.topic;
    if (name == "endoscope/camera_info" && !picture) continue;
    const std::string allowed = text(">= %g Hz", rate.least);
    const TopicStatistics* topic = found(name[0] == '/' ? name : prefix + name);
    if (topic == nullptr && name == "/tf") topic = found(prefix + "tf");  // in another namespace than vest
    if (topic == nullptr) {
      if (rate.needed) rows.push_back({name, "missing", allowed, false});
      continue;
    }
    // Over the whole session: a topic that stops half way does not keep its rate.
    double end = session ? std::max(topic->last, session->last) : topic->last;
    // Where the last one that was kept is as near to the end as can be, those behind it are not missing.
    if (const double kept = keptRate(name); kept > 0 && end - topic->last < 2 / kept) end = topic->last;
    const double span = end - (session ? std::max(topic->first, session->first) : topic->first);
    const double hz = span > 0 ? static_cast<double>(topic->count - 1) / span : 0.0;
    rows.push_back({name, text("%.1f Hz", hz), allowed, hz >= rate.least});
  }
  const StepStatistics& steps = recorded.steps;
  const auto count = [](std::uint64_t n) { return text("%llu", static_cast<unsigned long long>(n)); };
  rows.push_back({"steps", count(steps.steps()), "> 0", steps.steps() > 0});
  rows.push_back({"steps skipped", count(steps.skipped()), "0", steps.skipped() == 0});
  const double factor = steps.realTimeFactor(), worst = steps.worstSecond();
  rows.push_back({"real-time factor", text("%.4f", factor), ">= 0.99", factor >= 0.99});
  rows.push_back({"real-time factor, worst second", text("%.3f", worst), ">= 0.95", worst >= 0.95});
  checkJson((folder / "session.json").string(), recorded, rows);
  if (open) rows.push_back({"session.bag.active", "is there", "closed, or recovered", false});
  return rows;
}

}  // namespace vest::session
