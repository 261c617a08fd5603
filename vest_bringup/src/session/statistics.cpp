#include "vest_bringup/session/statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>

#include <nlohmann/json.hpp>

#include "vest_instruments/files/replace.h"

namespace vest::session {

void StepStatistics::add(std::uint64_t step, double dt, double stamp, bool jumps) {
  if (steps_ == 0) {
    first_stamp_ = stamp;
    first_dt_ = dt;
  } else if (!jumps && step != last_step_ + 1) {
    skipped_ += step > last_step_ ? step - last_step_ - 1 : 1;
  }
  ++steps_;
  last_step_ = step;
  last_stamp_ = std::max(stamp, last_stamp_);
  simulated_ += dt;
  const double tenth = std::floor((stamp - first_stamp_) * 10.0);
  if (tenth >= 0.0 && tenth < 1e7) {
    if (tenths_.size() <= static_cast<std::size_t>(tenth))
      tenths_.resize(static_cast<std::size_t>(tenth) + 1, 0.0);
    tenths_[static_cast<std::size_t>(tenth)] += dt;
  }
}

double StepStatistics::realTimeFactor() const {
  // The first step opens the interval: what it simulates lies before its stamp.
  return duration() > 0.0 ? (simulated_ - first_dt_) / duration() : std::numeric_limits<double>::quiet_NaN();
}

double StepStatistics::worstSecond() const {
  if (tenths_.size() < 11) return std::numeric_limits<double>::quiet_NaN();
  double worst = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 11 <= tenths_.size(); ++i) {  // the last tenth is not whole
    double sum = 0.0;
    for (std::size_t k = 0; k < 10; ++k) sum += tenths_[i + k];
    worst = std::min(worst, sum);
  }
  return worst;
}

std::string toJson(const Summary& s) {
  const auto number = [](double x) { return std::isfinite(x) ? nlohmann::json(x) : nlohmann::json(nullptr); };
  nlohmann::json j;
  j["version"] = s.version;
  j["scene"] = s.scene;
  j["scene_hash"] = s.scene_hash;
  j["state_hash"] = s.state_hash;
  j["state_hash_step"] = s.state_hash_step;
  j["steps"] = s.steps.steps();
  j["skipped_steps"] = s.steps.skipped();
  j["duration_s"] = number(s.steps.duration());
  j["real_time_factor"] = number(s.steps.realTimeFactor());
  j["worst_second_real_time_factor"] = number(s.steps.worstSecond());
  j["rates"] = nlohmann::json::object();
  for (const auto& [topic, t] : s.topics) j["rates"][topic] = number(t.rate());
  j["events"] = nlohmann::json::array();
  for (const EventLine& e : s.events) {
    j["events"].push_back({{"step", e.step},
                           {"time_s", number(e.time)},
                           {"kind", e.kind},
                           {"instrument", e.instrument},
                           {"object", e.object},
                           {"force_n", number(e.force)}});
  }
  j["clock_jumps"] = nlohmann::json::array();
  for (const ClockJumpLine& c : s.clock_jumps)
    j["clock_jumps"].push_back({{"step", c.step}, {"time_s", number(c.time)}, {"by_s", number(c.by)}});
  j["messages"] = s.messages;
  j["dropped_messages"] = s.dropped;
  j["bytes"] = s.bytes;
  j["disk_full"] = s.disk_full;
  j["ended"] = s.ended;
  j["pictures"] = s.pictures;
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

bool writeSummary(const Summary& summary, const std::string& directory) {
  const std::string file = directory + "/session.json";
  std::ofstream out = files::replacing(file + ".part");
  out << toJson(summary);
  out.close();
  return out && std::rename((file + ".part").c_str(), file.c_str()) == 0;
}

}  // namespace vest::session
