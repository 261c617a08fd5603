#include "vest_hw_phantom_box/emulator/trajectory.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "vest_instruments/files/cells.h"
#include "vest_instruments/files/read.h"

namespace vest::emulator {
namespace {

using protocol::kAxes;
using protocol::kEndoscope;
using protocol::kJoints;

constexpr int kFootswitchColumn = -2;
constexpr int kTimeColumn = -1;
constexpr std::size_t kMostColumns = kJoints + 2;
/// rad/s, m/s: the greatest speeds of the way from the last row to the first (assumed: a calm hand's), and
/// how much greater they are than its mean.
constexpr double kCalmTurn = 1.0, kCalmSlide = 0.1, kGreatestOverMean = 1.5;
constexpr int kInsertion = 2;              // axis
constexpr std::size_t kMostRows = 720000;  // assumed: 2 h at 100 Hz

[[noreturn]] void fail(const std::string& file, const std::string& field, const std::string& value,
                       const std::string& allowed) {
  throw Error(files::shown(file, 4096) + ": " + files::shown(field, 200) + ": " + files::shown(value, 100) +
              "; allowed: " + allowed);
}

std::vector<int> parseHeader(const std::string& line, const std::string& file) {
  std::string allowed = "t_s, footswitches";
  for (const auto& n : protocol::jointNames()) allowed += ", " + n;
  std::vector<int> columns;
  for (const std::string& cell : files::cells(line, kMostColumns)) {
    const auto& names = protocol::jointNames();
    const auto found = std::find(names.begin(), names.end(), cell);
    const int column = cell == "t_s"            ? kTimeColumn
                       : cell == "footswitches" ? kFootswitchColumn
                       : found != names.end()   ? static_cast<int>(found - names.begin())
                                                : kJoints;
    if (column == kJoints) fail(file, "line 1", "unknown column '" + cell + "'", allowed);
    if (std::find(columns.begin(), columns.end(), column) != columns.end())
      fail(file, "line 1", "column '" + cell + "' twice", "once");
    columns.push_back(column);
  }
  if (std::find(columns.begin(), columns.end(), kTimeColumn) == columns.end())
    fail(file, "line 1", "no column t_s", "a header with t_s");
  return columns;
}

double parseNumber(const std::string& cell, const std::string& file, std::size_t line,
                   const std::string& column) {
  double value = 0;
  // Hundreds of rad or m are a wrong unit or a broken file; time may be an epoch.
  const double limit = column == "t_s" ? 1e11 : 100;
  if (!files::parseNumber(cell, value) || std::abs(value) > limit)
    fail(file, "line " + std::to_string(line) + ", column " + column, "'" + cell + "'",
         "a finite number, at most " + std::string(column == "t_s" ? "1e11" : "100") + " in size");
  return value;
}

}  // namespace

Pose restPose() {
  Pose p;
  for (int arm = 0; arm <= protocol::kMaxInstruments; ++arm) p.joints[arm * kAxes + 2] = 0.12;
  p.joints[2 * kAxes + 2] = 0.05;
  p.joints[kEndoscope + 1] = 0.30;
  p.joints[kEndoscope + 2] = 0.10;
  return p;
}

Trajectory Trajectory::load(const std::string& file, const TrajectoryOptions& options) {
  std::string text;
  try {
    text = files::read(file, 128u << 20);
  } catch (const files::Refused& why) {
    fail(file, "trajectory", why.value, why.allowed);
  }
  return parse(text, file, options);
}

Trajectory Trajectory::parse(const std::string& text, const std::string& name,
                             const TrajectoryOptions& options) {
  Trajectory t;
  t.options_ = options;
  std::istringstream in(text);
  std::string line;
  if (!std::getline(in, line) || line.empty())
    fail(name, "line 1", "empty", "a header line that begins with t_s");
  const std::vector<int> columns = parseHeader(line, name);
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    if (line.empty() || line == "\r") continue;
    const std::vector<std::string> cells = files::cells(line, kMostColumns);
    if (cells.size() != columns.size())
      fail(name, "line " + std::to_string(number), std::to_string(cells.size()) + " cells",
           std::to_string(columns.size()) + ", as in the header");
    if (t.times_.size() == kMostRows)
      fail(name, "line " + std::to_string(number), "more than " + std::to_string(kMostRows) + " rows",
           "at most as many");
    Pose row = restPose();
    double time = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const int c = columns[i];
      const std::string column = c == kTimeColumn         ? "t_s"
                                 : c == kFootswitchColumn ? "footswitches"
                                                          : protocol::jointNames()[c];
      const double value = parseNumber(cells[i], name, number, column);
      if (c == kTimeColumn) {
        time = value;
      } else if (c == kFootswitchColumn) {
        if (value < 0 || value > 63 || value != std::floor(value))
          fail(name, "line " + std::to_string(number) + ", column footswitches", "'" + cells[i] + "'",
               "a whole number from 0 to 63");
        row.footswitches = static_cast<std::uint8_t>(value);
      } else {
        row.joints[c] = value;
      }
    }
    if (!t.times_.empty() && !(time > t.times_.back()))
      fail(name, "line " + std::to_string(number) + ", column t_s", "'" + std::to_string(time) + "'",
           "later than the row before");
    t.times_.push_back(time);
    t.joints_.push_back(row.joints);
    t.footswitches_.push_back(row.footswitches);
  }
  if (t.times_.empty()) fail(name, "line 2", "no rows", "at least one row");
  t.prepare();
  return t;
}

void Trajectory::prepare() {
  const double first = times_.front();
  for (double& t : times_) t -= first;
  const std::size_t n = times_.size();
  const auto broken = [&](std::size_t i) { return times_[i + 1] - times_[i] > options_.max_gap; };
  for (std::size_t i = 0; i + 1 < n; ++i)
    if (broken(i)) gaps_.push_back({times_[i], times_[i + 1]});
  if (n > 1) {
    const double step = std::min(times_[n - 1] - times_[n - 2], options_.max_gap);
    double calm = 0;  // s
    for (int j = 0; j < kJoints; ++j) {
      const double way = std::abs(joints_[0][j] - joints_[n - 1][j]);
      calm = std::max(calm, kGreatestOverMean * way / (j % kAxes == kInsertion ? kCalmSlide : kCalmTurn));
    }
    if (calm > kGreatestOverMean * step) way_back_ = calm;
    period_ = times_.back() + std::max(step, way_back_);
  }

  slopes_.assign(n, {});
  if (options_.interpolation != Interpolation::kCubic) return;
  for (std::size_t i = 0; i < n; ++i) {
    const bool before = i > 0 && !broken(i - 1);
    const bool after = i + 1 < n && !broken(i);
    for (int j = 0; j < kJoints; ++j) {
      const double h0 = before ? times_[i] - times_[i - 1] : 0, h1 = after ? times_[i + 1] - times_[i] : 0;
      const double d0 = before ? (joints_[i][j] - joints_[i - 1][j]) / h0 : 0;
      const double d1 = after ? (joints_[i + 1][j] - joints_[i][j]) / h1 : 0;
      slopes_[i][j] = before && after ? (h1 * d0 + h0 * d1) / (h0 + h1) : d0 + d1;
    }
  }
}

Pose Trajectory::at(double t) const {
  Pose pose;
  if (options_.at_end == AtEnd::kLoop && period_ > 0 && t > 0) t = std::fmod(t, period_);
  if (t > times_.back() && options_.at_end == AtEnd::kLoop && way_back_ > 0) {
    const double s = (t - times_.back()) / way_back_, share = s * s * (3 - 2 * s);
    for (int j = 0; j < kJoints; ++j)
      pose.joints[j] = joints_.back()[j] + share * (joints_.front()[j] - joints_.back()[j]);
    return pose;
  }
  const auto upper = std::upper_bound(times_.begin(), times_.end(), t);
  if (upper == times_.begin() || upper == times_.end()) {
    const std::size_t i = upper == times_.begin() ? 0 : times_.size() - 1;
    pose.joints = joints_[i];
    pose.footswitches = footswitches_[i];
    return pose;
  }
  const auto i = static_cast<std::size_t>(upper - times_.begin()) - 1;
  const double h = times_[i + 1] - times_[i];
  if (h > options_.max_gap && t > times_[i]) {
    pose.joints = joints_[i];  // sent, but flagged: nobody may use them
    pose.invalid = (1u << kJoints) - 1;
    return pose;
  }
  pose.footswitches = footswitches_[i];
  const double s = (t - times_[i]) / h;
  for (int j = 0; j < kJoints; ++j) {
    const double a = joints_[i][j], b = joints_[i + 1][j];
    if (options_.interpolation == Interpolation::kLinear) {
      pose.joints[j] = a + s * (b - a);
    } else {
      const double s2 = s * s, s3 = s2 * s;
      pose.joints[j] = (2 * s3 - 3 * s2 + 1) * a + (s3 - 2 * s2 + s) * h * slopes_[i][j] +
                       (3 * s2 - 2 * s3) * b + (s3 - s2) * h * slopes_[i + 1][j];
    }
  }
  return pose;
}

Pose defaultMotion(double t) {
  constexpr double kTau = 6.283185307179586;
  Pose p = restPose();
  for (int arm = 0; arm < 2; ++arm) {
    double* q = p.joints.data() + arm * kAxes;
    const double side = arm == 0 ? 1 : -1;
    q[0] = side * 0.20 * std::sin(kTau * t / 5);
    q[1] = 0.15 * std::sin(kTau * t / 7);
    q[2] += 0.02 * std::sin(kTau * t / 4 + arm);
    q[3] = side * 0.8 * std::sin(kTau * t / 6);
    q[4] = 0.3 * (1 - std::cos(kTau * t / 3));
  }
  p.joints[kEndoscope] = 0.05 * std::sin(kTau * t / 11);
  // One pedal after the other for half a second every two seconds.
  if (std::fmod(t, 2.0) > 1.5)
    p.footswitches = static_cast<std::uint8_t>(1u << (static_cast<long>(t / 2) % 6));
  return p;
}

}  // namespace vest::emulator
