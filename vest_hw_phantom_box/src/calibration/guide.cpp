#include "vest_hw_phantom_box/calibration/guide.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "vest_instruments/files/read.h"

namespace vest::calibration {

using protocol::kAxes;
using protocol::kJoints;

namespace {

constexpr double kLeastWay = 100;  // counts; assumed: less says nothing about a scale
constexpr int kInsertion = 2, kRoll = 3, kFifth = 4;

struct Words {
  const char *zero, *known;
  double usual;  // degrees or mm
};

Words words(int joint) {
  switch (joint % kAxes) {
    case 0:
      return {"point the shaft at its aim, the middle of the field", "swing the tip to the right", 30};
    case 1:
      return {"point the shaft at its aim, the middle of the field", "swing the tip up", 20};
    case kInsertion:
      return {"pull the closed tip back until it is level with the trocar's pivot", "push it in", 100};
    case kRoll:
      return {"turn the shaft until the jaws' mark (of the endoscope: the camera's top) is up",
              "turn it clockwise, seen along the shaft from the handle", 90};
    default:
      return joint == protocol::kLightPost
                 ? Words{"turn the light post up, so that the optic looks down",
                         "turn it clockwise, seen along the shaft from the eyepiece", 90}
                 : Words{"close the jaws", "open the jaws wide", 60};
  }
}

double unit(int joint) {
  return joint % kAxes == kInsertion ? 1e-3 : M_PI / 180;
}

std::string shown(double value, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

}  // namespace

void StillReader::onMotion(const protocol::Motion& motion) {
  if (frames_.size() == kFrames) frames_.pop_front();
  frames_.push_back(motion);
}

bool StillReader::read(Still& still) const {
  if (frames_.size() < kFrames) return false;
  for (int j = 0; j < kJoints; ++j) {
    int low = 32767, high = -32768;
    double sum = 0;
    bool measured = true;
    for (const protocol::Motion& m : frames_) {
      const int c = m.counts[j];
      measured &= !(m.invalid >> j & 1u) && c != protocol::kNoReading;
      low = std::min(low, c), high = std::max(high, c), sum += c;
    }
    still.count[j] = sum / static_cast<double>(frames_.size());
    still.rests[j] = measured && high - low <= kSpread;
  }
  return true;
}

Guide::Guide(const Calibration& start, const std::vector<int>& arms, bool light_post) : calibration_(start) {
  calibration_.has_third = std::count(arms.begin(), arms.end(), 2) > 0;
  calibration_.has_light_post = light_post;
  for (const int arm : arms)
    for (int axis = 0; axis < kAxes; ++axis) {
      const int joint = arm * kAxes + axis;
      if (joint == protocol::kLightPost && !light_post) continue;
      steps_.push_back({joint, What::Zero});
      steps_.push_back({joint, What::Known});
      // Jaws end at the known opening; a shaft that turns round has no ends.
      if (axis == kFifth || calibration_.joints[joint].continuous) continue;
      steps_.push_back({joint, What::OneEnd});
      steps_.push_back({joint, What::OtherEnd});
    }
}

std::string Guide::question() const {
  const Step& s = steps_[at_];
  const std::string name = protocol::jointNames()[s.joint];
  const std::string of =
      "[" + std::to_string(at_ + 1) + "/" + std::to_string(steps_.size()) + "] " + name + ": ";
  const Words w = words(s.joint);
  const bool length = s.joint % kAxes == kInsertion;
  switch (s.what) {
    case What::Zero:
      return of + w.zero + ", hold still, and press Enter";
    case What::Known:
      return of + w.known + " by a known way, hold still, and type the " + (length ? "mm" : "degrees") +
             " (Enter: " + shown(w.usual, 0) + ")";
    case What::OneEnd:
      return of + "move it to one end of its way, hold still, and press Enter (skip: keep the limits)";
    default:
      return of + "move it to the other end, hold still, and press Enter";
  }
}

std::string Guide::known(int joint, const std::string& line, const Still& still) {
  double typed = words(joint).usual;
  if (!line.empty() && (!files::parseNumber(line, typed) || !(typed > 0) || typed > 1000))
    return "'" + line.substr(0, 40) + "' (allowed: a number above 0)";
  const double way = still.count[joint] - zero_.count[joint];
  if (std::abs(way) < kLeastWay)
    return "it moved by " + shown(way, 0) + " counts (at least " + shown(kLeastWay, 0) +
           " are needed; is this the joint " + protocol::jointNames()[joint] + "?)";
  Joint& j = calibration_.joints[joint];
  j.sign = way > 0 ? 1 : -1;
  j.per_count = typed * unit(joint) / std::abs(way);
  j.zero_count = zero_.count[joint];
  if (joint % kAxes == kFifth && joint != protocol::kLightPost) j.min = 0, j.max = typed * unit(joint);
  return {};
}

std::string Guide::answer(const std::string& line, const Still& still) {
  const Step s = steps_[at_];
  const std::string name = protocol::jointNames()[s.joint];
  if (line == "skip" && s.what == What::OneEnd) {
    at_ += 2;
    return {};
  }
  if (s.what != What::Known && !line.empty()) return "'" + line.substr(0, 40) + "' (allowed: Enter alone)";
  if (!still.rests[s.joint]) return name + " does not rest, or is not measured; hold it still";
  if (s.what == What::Zero) zero_ = still;
  if (s.what == What::OneEnd) end_ = still;
  if (s.what == What::Known) {
    // A joint that is wired to another name is found here, and not in the operating field.
    int most = s.joint;
    for (int j = 0; j < kJoints; ++j)
      if (still.rests[j] && zero_.rests[j] &&
          std::abs(still.count[j] - zero_.count[j]) >
              3 * std::abs(still.count[most] - zero_.count[most]) + kLeastWay)
        most = j;
    if (most != s.joint) return protocol::jointNames()[most] + " moved, and not " + name;
    const std::string wrong = known(s.joint, line, still);
    if (!wrong.empty()) return wrong;
  }
  if (s.what == What::OtherEnd) {
    Joint& j = calibration_.joints[s.joint];
    const auto at = [&](const Still& x) { return j.sign * j.per_count * (x.count[s.joint] - j.zero_count); };
    const double a = at(end_), b = at(still);
    if (std::abs(a - b) < kLeastWay * j.per_count) return "both ends are at the same place";
    j.min = std::min(a, b), j.max = std::max(a, b);
  }
  ++at_;
  return {};
}

std::string toYaml(const Calibration& c, const std::string& comment) {
  std::string out = "# " + comment +
                    "\n# position = sign * per_count * (count - zero_count), kept within min and max; rad "
                    "(insertion: m).\n";
  for (int arm = 0; arm <= protocol::kMaxInstruments; ++arm) {
    if (arm == 2 && !c.has_third) continue;
    out += protocol::armNames()[arm] + ":\n";
    const bool endoscope = arm == protocol::kMaxInstruments;
    const char* axes[] = {"yaw", "pitch", "insertion", "roll", endoscope ? "light_post" : "jaw"};
    for (int a = 0; a < kAxes; ++a) {
      if (endoscope && a == kFifth && !c.has_light_post) continue;
      const Joint& j = c.joints[arm * kAxes + a];
      char line[256];
      std::snprintf(line, sizeof line,
                    "  %s: {per_count: %.12g, sign: %d, zero_count: %.12g, min: %.12g, max: %.12g, "
                    "max_speed: %.12g%s}\n",
                    axes[a], j.per_count, j.sign, j.zero_count, j.min, j.max, j.max_speed,
                    j.continuous ? ", continuous: true" : "");
      out += line;
    }
  }
  return out;
}

}  // namespace vest::calibration
