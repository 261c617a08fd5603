#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <utility>

#include <xxhash.h>

#include "vest_bringup/exercise/exercise.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/tools/tool_names.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/scene/event_words.h"

namespace vest::exercise {
namespace {

using scene::yaml::Map;
using scene::yaml::Value;

constexpr std::size_t kMostBytes = 256U << 10U, kMostEntries = 100;
constexpr int kMostDepth = 8;
std::string text(const Value& value, std::size_t most = 500) {
  const std::string t = value.string();
  if (t.empty() || t.size() > most) value.fail("must be a text of 1 to " + std::to_string(most) + " bytes");
  if (files::shown(t, most) != t)
    value.fail("must have no control characters: it is one printable line of UTF-8");
  return t;
}

std::vector<Value> list(const Value& value) {
  auto entries = value.list();
  if (entries.size() > kMostEntries)
    value.fail("must have at most " + std::to_string(kMostEntries) + " entries");
  return entries;
}

int tool(const Value& value) {
  const std::string word = value.oneOf({"left", "right", "third", "endoscope"});
  for (int i = 0; i < tools::kInstrumentCount; ++i)
    if (word == tools::instrumentName(static_cast<tools::Instrument>(i))) return i;
  return -1;
}

class Reader {
 public:
  explicit Reader(const Value& root) : root_(root) {}

  Exercise read() {
    Map map(root_);
    map["vest_exercise"].integer(1, 1);
    Exercise e;
    e.name = map["name"].name();
    e.title = text(map["title"], 100);
    e.aim = text(map["aim"], 2000);
    e.scene = map["scene"].name();
    e.limit = map["limit_s"].number(1, 7200);
    e.proficient = map["proficient_s"].number(0, e.limit - 0.001);
    if (map.has("least_s")) e.least = map["least_s"].number(0, e.proficient);
    if (map.has("optic_deg")) e.optic = map["optic_deg"].number(0, 90);
    if (map.has("tools")) readTools(map["tools"], e);
    if (map.has("marks"))
      for (const Value& v : list(map["marks"])) e.marks.push_back(mark(v));
    for (const Value& v : list(map["phases"])) e.phases.push_back(phase(v));
    if (e.phases.empty()) map["phases"].fail("must have an entry");
    if (std::none_of(e.phases.begin(), e.phases.end(), [](const Phase& p) { return p.required; }))
      map["phases"].fail("must have a required one: doing nothing is no exercise");
    if (map.has("gates"))
      for (const Value& v : list(map["gates"])) e.gates.push_back(gate(v));
    if (map.has("errors"))
      for (const Value& v : list(map["errors"])) e.errors.push_back(error(v));
    for (const Value& v : list(map["items"])) e.items.push_back(item(v));
    readScripts(map["scripts"], e);
    map.finish();
    return e;
  }

 private:
  void readTools(const Value& value, Exercise& e) {
    Map map(value);
    for (std::size_t hand = 0; hand < e.tools.size(); ++hand) {
      const std::string name(tools::instrumentName(static_cast<tools::Instrument>(hand)));
      if (!map.has(name)) continue;
      for (const Value& v : list(map[name])) {
        const auto kind = tools::toolFromName(v.string());
        if (!kind || *kind == tools::ToolKind::Endoscope || *kind == tools::ToolKind::None)
          v.fail("must be one of " + tools::handTools());
        e.tools[hand].push_back(*kind);
      }
    }
    map.finish();
  }

  std::string fresh(const Value& value) {
    const std::string name = value.name();
    if (!names_.insert(name).second) value.fail("stands twice: names of an exercise differ");
    return name;
  }

  Mark mark(const Value& value) {
    Map map(value);
    Mark m;
    m.name = fresh(map["name"]);
    if (map.has("object")) m.object = map["object"].name();
    m.middle = !m.object.empty() && !map.has("at");
    if (!m.middle) m.at = map["at"].vector3();
    if (m.at.norm() > 10) map["at"].fail("must lie within 10 m");
    if (map.has("radius_mm")) m.radius = 1e-3 * map["radius_mm"].number(0.1, 500);
    map.finish();
    marks_.insert(m.name);
    return m;
  }

  Number number(Map& map) {
    const Value of = map["of"];
    const std::string word = of.string();
    const auto info =
        std::find_if(kMetrics.begin(), kMetrics.end(), [&](const MetricInfo& m) { return m.name == word; });
    if (info == kMetrics.end()) {
      std::string all;
      for (const MetricInfo& m : kMetrics) all += " " + std::string(m.name);
      of.fail("must be one of" + all);
    }
    Number n;
    n.metric = info->metric;
    if (info->needs & kTool) n.tool = tool(map["tool"]);
    if (info->needs & kObject) readObject(map, n.object, n.role);
    if ((info->needs & kObject) && n.object.empty() && n.role.empty()) map["object"];
    if (info->needs & kMark) {
      const Value v = map["mark"];
      for (const Value& one : v.isList() ? list(v) : std::vector<Value>{v}) {
        if (!marks_.count(one.name())) one.fail("must be the name of one of the marks");
        n.marks.push_back(one.name());
      }
      if (n.marks.empty()) v.fail("must be a mark, or a list of some");
      const bool two = n.metric == Metric::CutAside || n.metric == Metric::Apart;
      if (two && n.marks.size() != 2) v.fail("must be two marks");
      const bool round = n.metric == Metric::CutRound || n.metric == Metric::CutRoundRms;
      if (round && n.marks.size() > 2) v.fail("must be one mark, or two: the circle and the way to it");
      const bool some = n.metric == Metric::ClipOff || n.metric == Metric::BiteOff;
      if (n.marks.size() > 1 && !two && !round && !some) v.fail("must be one mark");
    }
    return n;
  }

  static void readObject(Map& map, std::string& object, std::string& role) {
    if (map.has("object")) object = map["object"].name();
    if (!map.has("role")) return;
    role = map["role"].name();
    if (!object.empty()) map["role"].fail("is there beside object: give one of them");
  }

  /// What has to hold for a time, or at one: a figure that is known at the end alone is none of it.
  Condition inTime(const Value& value, int depth) {
    const bool before = std::exchange(at_end_, false);
    Condition c = condition(value, depth);
    at_end_ = before;
    return c;
  }

  Condition condition(const Value& value, int depth = 0) {
    if (depth > kMostDepth) value.fail("conditions stand at most " + std::to_string(kMostDepth) + " deep");
    if (++conditions_ > kMostConditions) value.fail("an exercise has at most 500 conditions");
    using Kind = Condition::Kind;
    Map map(value);
    Condition c;
    const auto children = [&](const char* key) {
      for (const Value& v : list(map[key])) c.children.push_back(condition(v, depth + 1));
      if (c.children.empty()) map[key].fail("must have an entry");
    };
    if (map.has("event")) {
      c.kind = Kind::Event;
      const auto keys = scene::eventKeys();
      const auto key = std::find(keys.begin(), keys.end(), map["event"].oneOf(keys));
      c.event = static_cast<scene::EventKind>(key - keys.begin());
      readObject(map, c.object, c.role);
      if (map.has("by")) c.tool = tool(map["by"]);
      if (map.has("at_least")) c.count = map["at_least"].integer(1, 100000);
      if (map.has("station_mm")) {
        const auto range = list(map["station_mm"]);
        if (range.size() != 2) map["station_mm"].fail("must be [least, most]");
        c.station_low = 1e-3 * range[0].number(-1e4, 1e4);
        c.station_high = 1e-3 * range[1].number(1e3 * c.station_low, 1e4);
      }
    } else if (map.has("of")) {
      c.kind = Kind::Number;
      c.number = number(map);
      if ((infoOf(c.number.metric).needs & kFigure) && !at_end_)
        map["of"].fail("is known at the end alone: it may stand in items, and in what a gate needs");
      if (map.has("above")) c.low = map["above"].number(-1e9, 1e9);
      // Nothing lies between ends that are exchanged: an error or a gate of it would never be seen.
      if (map.has("below")) c.high = map["below"].number(std::max(c.low, -1e9), 1e9);
      if (!map.has("above") && !map.has("below")) map["below"];
    } else if (map.has("any")) {
      c.kind = Kind::Any, children("any");
    } else if (map.has("all")) {
      c.kind = Kind::All, children("all");
    } else if (map.has("not")) {
      c.kind = Kind::Not;
      c.children.push_back(condition(map["not"], depth + 1));
    } else if (map.has("before")) {
      c.kind = Kind::Before;
      for (const Value& v : list(map["before"])) c.children.push_back(inTime(v, depth + 1));
      if (c.children.size() != 2) map["before"].fail("must be [first, second]");
    } else if (map.has("for_s")) {
      c.kind = Kind::For;
      c.seconds = map["for_s"].number(0, 7200);
      c.children.push_back(inTime(map["that"], depth + 1));
    } else if (map.has("within_s")) {
      c.kind = Kind::Within;
      c.seconds = map["within_s"].number(0, 7200);
      c.children.push_back(inTime(map["that"], depth + 1));
    } else {
      value.fail("must have one of event, of, any, all, not, before, for_s, within_s");
    }
    map.finish();
    return c;
  }

  Phase phase(const Value& value) {
    Map map(value);
    Phase p;
    p.name = fresh(map["name"]);
    p.instruction = text(map["instruction"]);
    if (map.has("start")) {
      p.start = condition(map["start"]);
      if (map.has("wait")) p.wait = text(map["wait"]);
    }
    p.end = condition(map["end"]);
    if (map.has("hint")) {
      p.hint = text(map["hint"]);
      p.hint_after = map["hint_after_s"].number(0, 7200);
    }
    if (map.has("required")) p.required = map["required"].boolean();
    map.finish();
    phases_.insert(p.name);
    return p;
  }

  Gate gate(const Value& value) {
    Map map(value);
    Gate g;
    g.name = fresh(map["name"]);
    g.text = text(map["text"]);
    g.never = map.has("never");
    at_end_ = !g.never;
    g.condition = condition(map[g.never ? "never" : "need"]);
    at_end_ = false;
    map.finish();
    return g;
  }

  Error error(const Value& value) {
    Map map(value);
    Error e;
    e.name = fresh(map["name"]);
    e.text = text(map["text"]);
    e.when = condition(map["when"]);
    e.points = map["points_s"].number(0, 7200);
    if (map.has("most")) e.most = map["most"].integer(1, 1000);
    map.finish();
    return e;
  }

  Item item(const Value& value) {
    Map map(value);
    Item i;
    i.name = fresh(map["name"]);
    // An attempt has them beside those of its items (learning_curve.cpp).
    if (i.name == "total" || i.name == "quality" || i.name == "time_s")
      map["name"].fail("is a figure of every attempt: an item has another name");
    i.number = number(map);
    if (map.has("phase")) {
      i.phase = map["phase"].name();
      if (!phases_.count(i.phase)) map["phase"].fail("must be the name of one of the phases");
      if (!infoOf(i.number.metric).sums) map["phase"].fail("this number has no part within a phase");
    }
    i.higher_is_better = map["better"].oneOf({"lower", "higher"}) == "higher";
    if (map.has("weight")) i.weight = map["weight"].number(0, 1000);
    i.proficient = map["proficient"].number(-1e9, 1e9);
    i.pass = map["pass"].number(-1e9, 1e9);
    if (i.higher_is_better ? i.pass >= i.proficient : i.pass <= i.proficient)
      map["pass"].fail("must be worse than proficient");
    i.source = text(map["source"]);
    map.finish();
    return i;
  }

  void readScripts(const Value& value, Exercise& e) {
    Map map(value);
    const auto file = [&](const Value& v) {
      const std::string name = v.name();
      if (std::filesystem::path(name).extension() != ".yaml")
        v.fail("must be a .yaml beside the exercise, or among the trajectories");
      const auto folder = std::filesystem::path(v.file()).parent_path();
      const auto shared = folder / ".." / ".." / "trajectories" / name;
      std::error_code error;
      return (std::filesystem::exists(shared, error) ? shared : folder / name).lexically_normal().string();
    };
    e.pass_script.file = file(map["pass"]);
    for (const Value& v : list(map["fail"])) {
      Map one(v);
      Script s{file(one["file"]), one["reason"].name()};
      if (!names_.count(s.reason)) one["reason"].fail("must name a phase, a gate or an item");
      one.finish();
      e.fail_scripts.push_back(s);
    }
    if (e.fail_scripts.empty()) map["fail"].fail("must have an entry");
    map.finish();
  }

  static constexpr int kMostConditions = 500;
  Value root_;
  std::set<std::string> names_, marks_, phases_;
  int conditions_ = 0;
  bool at_end_ = false;  ///< what is read now is judged at the end
};

}  // namespace

const MetricInfo& infoOf(Metric metric) {
  return kMetrics[static_cast<std::size_t>(metric)];
}

Exercise parseExercise(const std::string& path, const std::string& file_text) {
  Exercise e = Reader(scene::yaml::parse(path, file_text)).read();
  e.file = path;
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx",
                static_cast<unsigned long long>(XXH64(file_text.data(), file_text.size(), 0)));
  e.hash = hash;
  return e;
}

Exercise loadExercise(const std::string& path) {
  return parseExercise(path, scene::yaml::readFile(path, kMostBytes));
}

bool isExerciseFile(const std::string& given) {
  const std::string_view kind = ".yaml";
  return given.find('/') != std::string::npos ||
         (given.size() > kind.size() && given.compare(given.size() - kind.size(), kind.size(), kind) == 0);
}

}  // namespace vest::exercise
