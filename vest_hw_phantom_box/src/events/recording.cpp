#include <map>
#include <set>
#include <sstream>
#include <vector>

#include <libevdev/libevdev.h>

#include "vest_hw_phantom_box/events/event_source.h"
#include "vest_instruments/files/read.h"

namespace vest::events {
namespace {

constexpr const char* kLine = "t_s,type,code,value, e.g. 0.5,EV_KEY,BTN_SOUTH,1, in order of time";

std::string bytesOf(const std::string& path) try {
  return files::read(path, 64u << 20);
} catch (const files::Refused& why) {
  throw DeviceError(files::shown(path, 4096) + ": cannot be read: " + why.value +
                    "; allowed: " + why.allowed);
}

class Recording : public EventSource {
 public:
  explicit Recording(const std::string& path) : name_(path) {
    std::istringstream in(bytesOf(path));
    std::string line;
    bool head = false;
    for (int number = 1; std::getline(in, line); ++number) {
      const std::string where =
          files::shown(path, 4096) + ": line " + std::to_string(number) + ": '" + files::shown(line) + "'";
      if (line.empty()) continue;
      if (line[0] == '#') {
        if (!about(line.substr(1)))
          throw DeviceError(
              where +
              "; allowed: # name: WORDS, # key: BTN_SOUTH, # axis: ABS_X 0 255 15, # gone: 2.5, # loop: 4");
      } else if (!head) {
        if (line != "t_s,type,code,value")
          throw DeviceError(where + "; allowed: the head t_s,type,code,value");
        head = true;
      } else if (!take(line)) {
        throw DeviceError(where + "; allowed: " + kLine);
      }
    }
    if (!head) throw DeviceError(files::shown(path, 4096) + ": no head; allowed: a line t_s,type,code,value");
  }

  Read next(Event& event, double now) override {
    if (began_ < 0.0) began_ = now;
    if (next_ < events_.size() && events_[next_].first <= now - began_) {
      event = events_[next_++].second;
      return Read::Event;
    }
    if (loop_ > 0.0 && next_ == events_.size() && now - began_ >= loop_) {
      began_ += loop_;
      next_ = 0;
    }
    return gone_ >= 0.0 && now - began_ >= gone_ ? Read::Gone : Read::Nothing;
  }
  bool hasKey(std::uint16_t code) const override { return keys_.count(code) != 0; }
  bool keyDown(std::uint16_t) const override { return false; }
  std::optional<AxisRange> axis(std::uint16_t code) const override {
    const auto at = axes_.find(code);
    if (at == axes_.end()) return std::nullopt;
    return at->second;
  }
  std::string name() const override { return name_; }

 private:
  bool about(const std::string& text) {
    std::istringstream in(text);
    std::string what, word;
    if (!(in >> what)) return true;  // an empty comment
    if (what == "name:") return static_cast<bool>(std::getline(in >> std::ws, name_));
    if (what == "loop:") return static_cast<bool>(in >> loop_) && loop_ > 0.0;
    if (what == "gone:") return static_cast<bool>(in >> gone_) && gone_ >= 0.0;
    if (!(in >> word)) return false;
    if (what == "key:") {
      const auto code = keyCode(word);
      if (code) keys_.insert(*code);
      return code.has_value();
    }
    AxisRange range;
    const auto code = axisCode(word);
    if (what != "axis:" || !code || !(in >> range.minimum >> range.maximum >> range.flat)) return false;
    range.value =  // 64 bits: the width of the widest range is none of 32
        static_cast<std::int32_t>(range.minimum + (std::int64_t{range.maximum} - range.minimum) / 2);
    axes_[*code] = range;
    return true;
  }

  bool take(const std::string& line) {
    std::istringstream in(line);
    std::string time, type, code, value;
    if (!std::getline(in, time, ',') || !std::getline(in, type, ',') || !std::getline(in, code, ',') ||
        !std::getline(in, value))
      return false;
    try {
      std::size_t used_value = 0;
      double t = -1.0;
      const int v = std::stoi(value, &used_value);
      const int kind = libevdev_event_type_from_name(type.c_str());
      const int number =
          kind < 0 ? -1 : libevdev_event_code_from_name(static_cast<unsigned>(kind), code.c_str());
      const bool ordered =
          files::parseNumber(time, t) && t >= 0.0 && (events_.empty() || t >= events_.back().first);
      if (used_value != value.size() || number < 0 || !ordered) return false;
      events_.push_back({t, {static_cast<std::uint16_t>(kind), static_cast<std::uint16_t>(number), v}});
    } catch (const std::logic_error&) {  // no number
      return false;
    }
    return true;
  }

  std::string name_;
  std::set<std::uint16_t> keys_;
  std::map<std::uint16_t, AxisRange> axes_;
  std::vector<std::pair<double, Event>> events_;
  std::size_t next_ = 0;
  double began_ = -1.0, gone_ = -1.0, loop_ = -1.0;
};

}  // namespace

std::unique_ptr<EventSource> openRecording(const std::string& path) {
  return std::make_unique<Recording>(path);
}

}  // namespace vest::events
