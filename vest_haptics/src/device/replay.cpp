#include "vest_haptics/device/replay.h"

#include <array>
#include <cmath>
#include <sstream>

#include "vest_instruments/files/read.h"

namespace vest::haptics {

namespace {

// x right, y up, z towards the user → x right, y away, z up.
Eigen::Matrix3d fromPhantom() {
  Eigen::Matrix3d r;
  r << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return r;
}

constexpr std::size_t kMostBytes = std::size_t{128} << 20, kMostRows = 1200000;  // assumed: 20 min at 1 kHz
constexpr double kMostMillimetres = 10000;  // no device of this kind reaches a metre

std::string trimmed(const std::string& cell) {
  const std::size_t from = cell.find_first_not_of(" \r"), to = cell.find_last_not_of(" \r");
  return from == std::string::npos ? std::string() : cell.substr(from, to - from + 1);
}

}  // namespace

ReplayDevice::ReplayDevice() {
  capabilities_.model = "replay";
  capabilities_.orientation = true;
  capabilities_.force = false;
  capabilities_.maximum = {1e-3, 0, 0, 0, 0};
  capabilities_.workspace = {0.3, 0.3, 0.3, 0, 0};
}

void ReplayDevice::open(const DeviceOptions& options) {
  checkOptions("replay device", options, "file frame loop");
  const std::string file = option(options, "file", ""), frame = option(options, "frame", "phantom");
  if (frame != "phantom" && frame != "device")
    throw DeviceError("replay device: frame '" + frame + "'; allowed: phantom, device");
  const std::string loop = option(options, "loop", "false");
  if (loop != "true" && loop != "false")
    throw DeviceError("replay device: loop '" + loop + "'; allowed: true, false");
  loop_ = loop == "true";
  const std::string where = "replay device: file '" + files::shown(file, 1000) + "'";
  std::istringstream in;
  try {
    in.str(files::read(file, kMostBytes));
  } catch (const files::Refused& e) {
    throw DeviceError(where + ": " + e.value +
                      "; allowed: a CSV of at most 128 MB with t_s, px_mm, py_mm, pz_mm, qx, qy, qz, qw");
  }
  std::string line, cell;
  std::getline(in, line);
  const std::array<const char*, 8> wanted{"t_s", "px_mm", "py_mm", "pz_mm", "qx", "qy", "qz", "qw"};
  std::array<int, 8> column;
  column.fill(-1);
  std::istringstream header(line);
  for (int c = 0; std::getline(header, cell, ','); ++c) {
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      if (trimmed(cell) != wanted[k]) continue;
      if (column[k] >= 0) throw DeviceError(where + ": column '" + wanted[k] + "' stands there twice");
      column[k] = c;
    }
  }
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    if (column[k] < 0) throw DeviceError(where + ": column '" + wanted[k] + "' is missing");
  }
  const Eigen::Matrix3d R = frame == "phantom" ? fromPhantom() : Eigen::Matrix3d::Identity();
  rows_.clear();
  double begin = 0.0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (int number = 2; std::getline(in, line); ++number) {
    if (line.empty()) continue;
    if (rows_.size() == kMostRows)
      throw DeviceError(where + " line " + std::to_string(number) + ": more than " +
                        std::to_string(kMostRows) + " rows; allowed: at most as many");
    std::istringstream cells(line);
    std::array<double, 8> v;
    v.fill(std::nan(""));
    for (int c = 0; std::getline(cells, cell, ','); ++c) {
      for (std::size_t k = 0; k < 8; ++k) {
        if (column[k] == c && !files::parseNumber(trimmed(cell), v[k])) v[k] = std::nan("");
      }
    }
    for (std::size_t k = 0; k < 8; ++k) {
      if (!isFinite(v[k]))
        throw DeviceError(where + " line " + std::to_string(number) + ": " + wanted[k] + " is not a number");
    }
    for (std::size_t k = 0; k < 4; ++k) {
      if (std::abs(v[k]) > (k == 0 ? 1e7 : kMostMillimetres))
        throw DeviceError(where + " line " + std::to_string(number) + ": " + wanted[k] +
                          (k == 0 ? " is beyond 1e7 s" : " is beyond 10 m"));
    }
    Row row;
    if (rows_.empty()) begin = v[0];
    row.t = v[0] - begin;
    if (!rows_.empty() && !(row.t > rows_.back().t))
      throw DeviceError(where + " line " + std::to_string(number) + ": t_s does not grow");
    row.sample.position = R * (0.001 * Eigen::Vector3d(v[1], v[2], v[3]));
    const Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
    if (std::abs(q.norm() - 1.0) > 0.02)
      throw DeviceError(where + " line " + std::to_string(number) + ": qx qy qz qw is no rotation");
    row.sample.orientation = Eigen::Quaterniond(R * q.normalized().toRotationMatrix());
    middle += row.sample.position;
    rows_.push_back(row);
  }
  if (rows_.size() < 2) throw DeviceError(where + " has fewer than two rows");
  middle /= static_cast<double>(rows_.size());
  if (frame == "phantom") {
    for (Row& row : rows_) row.sample.position -= middle;  // the origin is the middle of what was used
  }
  time_ = 0.0;
  at_ = 0;
  open_ = true;
}

DeviceStatus ReplayDevice::read(Sample& sample) noexcept {
  if (!open_) return DeviceStatus::Starting;
  if (loop_ && time_ > rows_.back().t) {
    time_ -= rows_.back().t;
    at_ = 0;
    return DeviceStatus::Unplugged;  // the jump from end to start is not a motion
  }
  while (at_ + 2 < rows_.size() && rows_[at_ + 1].t <= time_) ++at_;
  const Row &a = rows_[at_], &b = rows_[at_ + 1];
  double s = (time_ - a.t) / (b.t - a.t);
  s = s < 0.0 ? 0.0 : s > 1.0 ? 1.0 : s;
  sample = a.sample;
  sample.position += s * (b.sample.position - a.sample.position);
  sample.orientation = a.sample.orientation.slerp(s, b.sample.orientation);
  return DeviceStatus::Ok;
}

}  // namespace vest::haptics
