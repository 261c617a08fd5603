#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "vest_bringup/exercise/engine.h"
#include "vest_instruments/tools/tool_kind.h"

namespace vest::exercise {
namespace {

std::string hex(std::uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

std::string line(const char* format, double value) {
  char text[64];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace

std::string readable(double value) {
  if (!std::isfinite(value)) return "-";
  const double size = std::fabs(value);
  if (size > 0 && size < 0.005) return "0.0";
  if (size == std::floor(size) || size >= 99.95) return line("%.0f", value);
  std::string text = line(size < 9.995 ? "%.2f" : "%.1f", value);
  if (size < 9.995 && text.back() == '0') text.pop_back();
  return text;
}

std::string unitOf(const MetricInfo& info) {
  const std::string word(info.name);
  for (const auto& [end, unit] :
       {std::pair("_ml_s", "ml/s"), std::pair("_mm_s", "mm/s"), std::pair("_m_s3", "m/s³")})
    if (word.size() > std::string_view(end).size() &&
        word.compare(word.size() - std::string_view(end).size(), std::string::npos, end) == 0)
      return unit;
  const std::size_t at = word.rfind('_');
  return at == std::string::npos ? "" : word.substr(at + 1);
}

std::vector<std::string> flagWords(std::uint64_t flags) {
  std::vector<std::string> words;
  if (flags & kAssisted) words.emplace_back("assisted");
  if (flags & kPractice) words.emplace_back("practice");
  if (flags & kRestored) words.emplace_back("restored");
  if (flags & kImplausible) words.emplace_back("implausibly fast");
  if (flags & kFault) words.emplace_back("fault");
  return words;
}

std::string textOf(const Exercise& e, const std::string& name) {
  for (const Phase& p : e.phases)
    if (p.name == name) return "Not done: " + p.instruction;
  for (const Gate& g : e.gates)
    if (g.name == name) return g.text;
  for (const Item& i : e.items)
    if (i.name == name) return "Beyond its pass mark: " + std::string(infoOf(i.number.metric).meaning);
  if (name == "optic") return "The endoscope had another optic than this exercise asks for";
  return name == "tools" ? "A tool that this exercise does not allow was in a hand" : name;
}

std::string describe(const Exercise& e, const Moment& moment) {
  const std::size_t i = moment.index;
  switch (moment.kind) {
    case Moment::Kind::PhaseBegun:
      return i < e.phases.size() ? "Begin: " + e.phases[i].instruction : "";
    case Moment::Kind::PhaseEnded:
      return i < e.phases.size() ? "Done: " + e.phases[i].name : "";
    case Moment::Kind::Hint:
      return i < e.phases.size() ? "Hint: " + e.phases[i].hint : "";
    case Moment::Kind::GateBroken:
      return i < e.gates.size() ? e.gates[i].text : "";
    case Moment::Kind::ErrorMade:
      return i < e.errors.size() ? e.errors[i].text : "";
    case Moment::Kind::WrongTool:
      return textOf(e, i == static_cast<std::size_t>(tools::Instrument::Endoscope) ? "optic" : "tools");
    case Moment::Kind::Finished:
      return "End";
  }
  return "";
}

std::string toJson(const Exercise& e, const Result& r) {
  using nlohmann::json;
  json j;
  j["exercise"] = r.exercise, j["exercise_hash"] = r.hash;
  j["finished"] = r.finished, j["passed"] = r.passed;
  j["time_s"] = r.time, j["error_points_s"] = r.error_points;
  j["total"] = r.total, j["quality"] = r.quality;
  j["failed_by"] = r.failed_by;
  j["flags"] = flagWords(r.flags);
  j["input_hash"] = hex(r.input_hash);
  j["items"] = json::array();
  for (std::size_t i = 0; i < r.items.size(); ++i)
    j["items"].push_back({{"name", e.items[i].name},
                          {"metric", std::string(infoOf(e.items[i].number.metric).name)},
                          {"value", r.items[i].value},
                          {"pass", e.items[i].pass},
                          {"proficient", e.items[i].proficient},
                          {"better", e.items[i].higher_is_better ? "higher" : "lower"},
                          {"weight", e.items[i].weight},
                          {"points", r.items[i].points},
                          {"passed", r.items[i].passed}});
  j["errors"] = json::array();
  for (std::size_t i = 0; i < r.errors.size(); ++i)
    j["errors"].push_back(
        {{"name", e.errors[i].name}, {"times", r.errors[i]}, {"points_s", e.errors[i].points}});
  j["moments"] = json::array();
  for (const Moment& m : r.moments) j["moments"].push_back({{"step", m.step}, {"text", describe(e, m)}});
  return j.dump(2) + "\n";
}

std::string toText(const Exercise& e, const Result& r) {
  std::string out = e.title + ": " +
                    (r.passed     ? "PASSED"
                     : r.finished ? "FAILED"
                                  : "NOT FINISHED") +
                    line(", total %.1f of 100", r.total) + line(", quality %.1f of 100", r.quality) +
                    line(", %.1f s", r.time) + line(" + %.0f s for errors\n", r.error_points);
  for (const std::string& name : r.failed_by) out += "  failed by " + name + ": " + textOf(e, name) + "\n";
  for (const std::string& word : flagWords(r.flags)) out += "  " + word + "\n";
  for (std::size_t i = 0; i < r.items.size(); ++i) {
    const std::string metric(infoOf(e.items[i].number.metric).name);
    out += "  " + e.items[i].name + ": " + metric + " " + readable(r.items[i].value) + " (pass " +
           readable(e.items[i].pass) + ", proficient " + readable(e.items[i].proficient) + ")" +
           line(", %.0f points", r.items[i].points) + (r.items[i].passed ? "" : ", not passed") + "\n";
  }
  for (std::size_t i = 0; i < r.errors.size(); ++i)
    if (r.errors[i] > 0)
      out += "  error " + e.errors[i].name + ", " + std::to_string(r.errors[i]) +
             " times: " + e.errors[i].text + "\n";
  for (const Moment& m : r.moments)
    out += line("  %8.3f s  ", 1e-3 * static_cast<double>(m.step)) + describe(e, m) + "\n";
  return out;
}

}  // namespace vest::exercise
