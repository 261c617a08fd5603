#include "vest_bringup/data/lerobot.h"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "vest_bringup/data/run_program.h"

namespace vest::data {
namespace {

using nlohmann::json;

std::string lastLine(const std::string& file) {
  std::ifstream in(file);
  std::string line, last;
  while (std::getline(in, line))
    if (!line.empty()) last = line;
  return last;
}

/// One row per frame: simulated time, reward, state, action. @return frames with an action beyond [−1, 1]
std::size_t writeTable(const std::string& file, const Episode& e, const std::vector<std::size_t>& seen,
                       const std::vector<std::size_t>& hands) {
  std::ofstream out(file, std::ios::binary);
  std::size_t beyond = 0;
  std::vector<double> row, tool;
  std::vector<float> action(hands.size() * kActionSize);
  for (std::size_t k = 0; k + 1 < e.rows.size(); ++k) {
    beyond += actionsAt(e, k, hands, action.data()) ? 1 : 0;
    row = {e.rows[k].time, e.rows[k + 1].score - e.rows[k].score};
    for (const std::size_t i : seen) {
      values(e.rows[k].tools[i], i, tool);
      row.insert(row.end(), tool.begin(), tool.end());
    }
    row.insert(row.end(), action.begin(), action.end());
    out.write(reinterpret_cast<const char*>(row.data()),
              static_cast<std::streamsize>(row.size() * sizeof(double)));
  }
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written (is the disk full?)");
  return beyond;
}

int wholeRate(const std::vector<Episode>& episodes) {
  const double rate = episodes.front().rate;
  const auto whole = static_cast<int>(std::lround(rate));
  for (const Episode& e : episodes)
    if (std::fabs(e.rate - rate) > 1e-9 * rate)
      throw std::invalid_argument(e.session + ": " + e.name + " has " + std::to_string(e.rate) +
                                  " rows a second, others " + std::to_string(rate) +
                                  " (LeRobot has one rate for all)");
  if (whole < 1 || std::fabs(rate - whole) > 1e-9 * rate)
    throw std::invalid_argument("--rate: rows would come " + std::to_string(rate) +
                                " times a second (LeRobot has whole numbers alone; choose one that divides "
                                "the steps of a second: 10, 20, 25, 50, 100)");
  return whole;
}

}  // namespace

LeRobot::LeRobot(std::string python, std::string writer, std::string work)
    : python_(std::move(python)), writer_(std::move(writer)), work_(std::move(work)) {
  try {
    version_ = json::parse(ask("")).at("lerobot");
  } catch (const std::runtime_error& e) {
    throw std::invalid_argument(std::string("--to lerobot: ") + e.what());
  }
}

std::string LeRobot::ask(const std::string& request) {
  const std::string answer = work_ + "/answer.json", log = work_ + "/log.txt";
  std::vector<std::string> words{python_, writer_, answer};
  if (!request.empty()) words.push_back(request);
  std::remove(answer.c_str());
  const int code = runProgram(std::move(words), log, true);
  if (code == 127) throw std::runtime_error("--python: " + python_ + " cannot be run");
  std::ifstream in(answer);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const json said = json::parse(text, nullptr, false);
  if (said.is_object() && said.contains("error")) throw std::runtime_error(said["error"]);
  if (code != 0 || !said.is_object())
    throw std::runtime_error(python_ + " " + writer_ + " ended with status " + std::to_string(code) + ": " +
                             lastLine(log));
  return text;
}

void LeRobot::write(const std::string& root, const std::string& name, const std::vector<Episode>& episodes,
                    const std::vector<std::string>& pictures, int height, int width) {
  const std::vector<std::size_t> hands = handsInAll(episodes);
  const std::vector<std::size_t> seen = seenInAll(episodes);
  json request{{"root", root}, {"work", work_}, {"repo_id", "vest/" + name}, {"robot_type", "vest"}};
  request["fps"] = wholeRate(episodes);
  request["state"] = request["action"] = request["episodes"] = json::array();
  request["picture"] = nullptr;
  if (!pictures.empty()) request["picture"] = {height, width};
  for (const std::size_t i : seen)
    for (const std::string& column : csvColumnsOf(i)) request["state"].push_back(column);
  for (const std::size_t h : hands)
    for (const char* part : {"x", "y", "z", "roll", "jaw", "functions"})
      request["action"].push_back(std::string(kInstruments[h]) + "_" + part);
  for (const Episode& e : episodes) {
    checkSamples(e);
    const std::string table = work_ + "/" + e.name + ".f64";
    beyond_ += writeTable(table, e, seen, hands);
    json& of = request["episodes"].emplace_back();
    of["frames"] = e.rows.size() - 1, of["table"] = table;
    of["task"] = e.aim.empty() ? "Scene " + e.scene : e.aim;
    of["pictures"] = json::array();
    if (!pictures.empty())
      for (std::size_t k = 0; k + 1 < e.rows.size(); ++k)
        of["pictures"].push_back(pictures[e.first_picture + k]);
  }
  const std::string file = work_ + "/request.json";
  std::ofstream out(file);
  out << request.dump();
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written (is the disk full?)");
  format_ = json::parse(ask(file)).at("format");
}

}  // namespace vest::data
