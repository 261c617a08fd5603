#include "vest_bringup/data/table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

namespace vest::data {
namespace {

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", value);
  return text;
}

}  // namespace

bool Episode::has(std::size_t instrument) const {
  return !rows.empty() &&
         std::all_of(rows.begin(), rows.end(), [&](const Row& row) { return row.tools[instrument].present; });
}

void Episode::leaveOutEnds() {
  std::size_t first = 0, end = rows.size();
  for (std::size_t i = 0; i < kInstruments.size(); ++i) {
    const auto there = [i](const Row& row) { return row.tools[i].present; };
    if (2 * static_cast<std::size_t>(std::count_if(rows.begin(), rows.end(), there)) < rows.size()) continue;
    const auto from = std::find_if(rows.begin(), rows.end(), there);
    const auto to = std::find_if(rows.rbegin(), rows.rend(), there).base();
    first = std::max(first, static_cast<std::size_t>(from - rows.begin()));
    end = std::min(end, static_cast<std::size_t>(to - rows.begin()));
  }
  if (first >= end) return;
  left_out = rows.size() - (end - first);
  rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(end), rows.end());
  rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(first));
  first_picture += first;
}

const std::vector<Column>& columnsOf(std::size_t instrument) {
  static const std::vector<Column> endoscope{{"pos", "m", "tip as commanded, world: x y z", 3},
                                             {"quat", "1", "tip in world: x y z w, z along the shaft", 4}};
  static const std::vector<Column> hand = [] {
    std::vector<Column> all = endoscope;
    all.push_back({"jaw", "rad", "full opening angle", 1});
    all.push_back({"tool", "1", "InstrumentState.TOOL_*", 1});
    all.push_back({"functions", "1", "bits of InstrumentState.FUNCTION_*", 1});
    all.push_back({"force", "N", "of the tissue on the tip, world: x y z", 3});
    all.push_back({"grasping", "1", "1: the jaws hold tissue", 1});
    all.push_back({"pinch", "N", "force between the jaws", 1});
    return all;
  }();
  return instrument < kHands ? hand : endoscope;
}

void values(const ToolRow& row, std::size_t instrument, std::vector<double>& to) {
  const auto& q = row.orientation;
  to = {row.tip.x(), row.tip.y(), row.tip.z(), q.x(), q.y(), q.z(), q.w()};
  if (instrument >= kHands) return;
  to.insert(to.end(), {row.jaw, static_cast<double>(row.tool), static_cast<double>(row.functions),
                       row.force.x(), row.force.y(), row.force.z(), row.grasping ? 1.0 : 0.0, row.pinch});
}

bool action(const ToolRow& from, const ToolRow& to, double rate, float* numbers) {
  constexpr double kTip = 0.002 * 50, kTurn = 0.1 * 50;  // m/s, rad/s: what 1 is
  const Eigen::Vector3d way = (to.tip - from.tip) * rate / kTip;
  Eigen::Quaterniond q = from.orientation.conjugate() * to.orientation;
  if (q.w() < 0) q.coeffs() *= -1;
  // The twist about z of a rotation (swing-twist decomposition).
  const double turn = 2 * std::atan2(q.z(), q.w()) * rate / kTurn;
  const double wanted[kActionSize] = {
      way.x(), way.y(), way.z(), turn, (to.jaw - from.jaw) * rate / kTurn, to.functions != 0 ? 1.0 : -1.0};
  bool beyond = false;
  for (std::size_t i = 0; i < kActionSize; ++i) {
    beyond = beyond || std::fabs(wanted[i]) > 1 + 1e-9;
    numbers[i] = static_cast<float>(std::clamp(wanted[i], -1.0, 1.0));
  }
  return beyond;
}

std::vector<std::size_t> seenInAll(const std::vector<Episode>& episodes) {
  std::vector<std::size_t> seen;
  for (std::size_t i = 0; i < kInstruments.size(); ++i)
    if (std::all_of(episodes.begin(), episodes.end(), [i](const Episode& e) { return e.has(i); }))
      seen.push_back(i);
  return seen;
}

std::vector<std::size_t> handsInAll(const std::vector<Episode>& episodes) {
  std::vector<std::size_t> hands = seenInAll(episodes);
  if (!hands.empty() && hands.back() == kHands) hands.pop_back();
  if (hands.empty())
    throw std::invalid_argument(
        "no hand's instrument is there from the beginning to the end of each session "
        "(a data set for learning needs one: its motion is the action)");
  return hands;
}

void checkSamples(const Episode& e) {
  if (e.rows.size() < 2)
    throw std::invalid_argument(e.session + ": " + e.name + " has " + std::to_string(e.rows.size()) +
                                " rows (allowed: 2 and more)");
}

bool actionsAt(const Episode& e, std::size_t k, const std::vector<std::size_t>& hands, float* numbers) {
  bool beyond = false;
  for (std::size_t h = 0; h < hands.size(); ++h)
    beyond |=
        action(e.rows[k].tools[hands[h]], e.rows[k + 1].tools[hands[h]], e.rate, numbers + h * kActionSize);
  return beyond;
}

std::vector<std::string> csvColumnsOf(std::size_t instrument) {
  static constexpr const char* kNames[] = {
      "_x_m",  "_y_m",       "_z_m",       "_qx",        "_qy",        "_qz",       "_qw",     "_jaw_rad",
      "_tool", "_functions", "_force_x_N", "_force_y_N", "_force_z_N", "_grasping", "_pinch_N"};
  constexpr std::size_t kPose = 7;
  std::vector<std::string> all;
  for (const char* name : kNames) {
    if (instrument >= kHands && all.size() == kPose) break;
    all.push_back(std::string(kInstruments[instrument]) + name);
  }
  return all;
}

std::string toCsv(const Episode& episode) {
  std::string out = "t_s,step";
  for (std::size_t i = 0; i < kInstruments.size(); ++i) {
    if (!episode.has(i)) continue;
    for (const std::string& name : csvColumnsOf(i)) out += "," + name;
  }
  const bool scored = !episode.exercise.empty();
  out += scored ? ",score,state_hash\n" : ",state_hash\n";
  std::vector<double> numbers;
  for (const Row& row : episode.rows) {
    out += number(row.time) + "," + std::to_string(row.step);
    for (std::size_t i = 0; i < kInstruments.size(); ++i) {
      if (!episode.has(i)) continue;
      values(row.tools[i], i, numbers);
      for (const double v : numbers) out += "," + number(v);
    }
    if (scored) out += "," + number(row.score);
    char hash[24];
    std::snprintf(hash, sizeof hash, ",%016llx\n", static_cast<unsigned long long>(row.state_hash));
    out += hash;
  }
  return out;
}

std::string eventsToCsv(const Episode& episode) {
  std::string out = "t_s,event,x_m,y_m,z_m,station_m,energy_J\n";
  for (const EventRow& e : episode.events) {
    std::string text = e.text;  // names of objects come from a file
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c == ',' || c == '"' || c == '\n'; }, '_');
    out += number(e.time) + "," + text;
    for (const double v : {e.position.x(), e.position.y(), e.position.z(), e.station, e.energy})
      out += "," + (std::isfinite(v) ? number(v) : std::string());
    out += "\n";
  }
  return out;
}

}  // namespace vest::data
