#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "vest_instruments/files/cells.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/trajectory/trajectory.h"

namespace vest::trajectory {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr std::size_t kMostBytes = 64u << 20, kMostCells = 256;  // assumed
constexpr std::size_t kMostSamples = 600000;                     // assumed: 10 min at 1 kHz

struct Sample {
  double t;
  Vector3d p;  // m, axes of phantom_box
  Matrix3d R;  // the same axes
};

std::string readMotionFile(const std::string& path) try {
  return files::read(path, kMostBytes);
} catch (const files::Refused& why) {
  throw TrajectoryError(files::shown(path, 4096) + ": cannot be read: " + why.value +
                        "; allowed: " + why.allowed);
}

std::vector<Sample> readMotion(const std::string& path) {
  std::istringstream in(readMotionFile(path));
  std::string line;
  if (!std::getline(in, line))
    throw TrajectoryError(files::shown(path, 4096) + ": empty; allowed: a header and samples");
  const std::array<const char*, 8> wanted{"t_s", "px_mm", "py_mm", "pz_mm", "qx", "qy", "qz", "qw"};
  const std::vector<std::string> header = files::cells(line, kMostCells);
  std::array<std::size_t, 8> column{};
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    column[k] = static_cast<std::size_t>(std::find(header.begin(), header.end(), wanted[k]) - header.begin());
    if (column[k] == header.size()) {
      throw TrajectoryError(files::shown(path, 4096) + ": line 1: column '" + wanted[k] +
                            "' is missing; allowed: t_s, px_mm, py_mm, pz_mm, qx, qy, qz, qw and others");
    }
    if (std::count(header.begin(), header.end(), wanted[k]) > 1)
      throw TrajectoryError(files::shown(path, 4096) + ": line 1: column '" + wanted[k] +
                            "' stands there twice; allowed: once");
  }
  Matrix3d C;  // device axes (x right, y up, z to the user) to those of phantom_box
  C << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  std::vector<Sample> samples;
  for (std::size_t number = 2; std::getline(in, line); ++number) {
    if (line.empty() || line == "\r") continue;
    const std::vector<std::string> cells = files::cells(line, kMostCells);
    std::array<double, 8> v{};
    for (std::size_t k = 0; k < v.size(); ++k) {
      const std::string where =
          files::shown(path, 4096) + ": line " + std::to_string(number) + ": " + wanted[k] + ": ";
      if (column[k] >= cells.size()) throw TrajectoryError(where + "missing; allowed: a finite number");
      if (!files::parseNumber(cells[column[k]], v[k]) || std::abs(v[k]) > 1e12) {
        throw TrajectoryError(where + "'" + files::shown(cells[column[k]]) + "'; allowed: a finite number");
      }
    }
    if (samples.size() == kMostSamples)
      throw TrajectoryError(files::shown(path, 4096) + ": line " + std::to_string(number) + ": more than " +
                            std::to_string(kMostSamples) + " samples; allowed: at most as many");
    const Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
    if (std::abs(q.norm() - 1.0) > 0.02) {
      throw TrajectoryError(files::shown(path, 4096) + ": line " + std::to_string(number) +
                            ": quaternion of norm " + std::to_string(q.norm()) + "; allowed: 1");
    }
    if (!samples.empty() && v[0] <= samples.back().t) {
      throw TrajectoryError(files::shown(path, 4096) + ": line " + std::to_string(number) +
                            ": t_s does not grow");
    }
    samples.push_back({v[0], C * (1e-3 * Vector3d(v[1], v[2], v[3])),
                       C * q.normalized().toRotationMatrix() * C.transpose()});
  }
  if (samples.size() < 2) throw TrajectoryError(files::shown(path, 4096) + ": fewer than two samples");
  return samples;
}

/// All rows at this scale, or nothing where one is out of reach.
std::optional<std::vector<Row>> layOut(const std::vector<Sample>& samples, const kinematics::TrainerArm& arm,
                                       const Vector3d& centre, double scale, std::size_t index, double jaw) {
  constexpr double kFloor = 0.01;  // m of air kept above the floor
  double deepest = 1e9;
  for (const Sample& s : samples) deepest = std::min(deepest, arm.aim_B.z() + scale * (s.p.z() - centre.z()));
  const Vector3d target = arm.aim_B + Vector3d(0, 0, std::max(0.0, kFloor - deepest));

  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  kinematics::JointPositions reference;
  reference.jaw = std::clamp(jaw, arm.limits.lower.jaw, arm.limits.upper.jaw);
  const Matrix3d R_start = arm.X_BTrocar.linear(), R_first = samples.front().R.transpose();
  std::vector<Row> rows;
  rows.reserve(samples.size());
  for (const Sample& s : samples) {
    X.translation() = target + scale * (s.p - centre);
    X.linear() = s.R * R_first * R_start;
    const auto result = kinematics::inverseKinematics(arm.X_BTrocar, X, reference, arm.limits);
    if (!result.reachable) return std::nullopt;
    reference = result.q;
    rows.push_back({s.t - samples.front().t, {}, 0});
    rows.back().joints[index] = result.q;
  }
  return rows;
}

}  // namespace

MotionReport fromMotion(const std::string& path, const kinematics::TrainerBox& box,
                        tools::Instrument instrument, double jaw) {
  const auto index = static_cast<std::size_t>(instrument);
  const kinematics::TrainerArm& arm = box.arms[index];
  if (!arm.present)
    throw TrajectoryError("instrument '" + std::string(tools::instrumentName(instrument)) +
                          "' is not in this box");
  const std::vector<Sample> samples = readMotion(path);

  MotionReport report;
  std::vector<double> steps;
  for (std::size_t i = 1; i < samples.size(); ++i) steps.push_back(samples[i].t - samples[i - 1].t);
  std::vector<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  report.median_dt = sorted[sorted.size() / 2];
  const double t0 = samples.front().t;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i] > std::max(0.1, 5.0 * report.median_dt)) {
      report.gaps.push_back({samples[i].t - t0, samples[i + 1].t - t0});
    }
  }

  Vector3d low = samples.front().p, high = low;
  for (const Sample& s : samples) {
    low = low.cwiseMin(s.p);
    high = high.cwiseMax(s.p);
  }
  report.centre = 0.5 * (low + high);
  const Vector3d half(0.05, 0.05, 0.035);  // m: about the pelvis of the gynaecology scene
  report.scale = 1.0;
  for (int k = 0; k < 3; ++k) {
    const double extent = 0.5 * (high[k] - low[k]);
    if (extent > half[k]) report.scale = std::min(report.scale, half[k] / extent);
  }
  for (int attempt = 0; attempt < 60; ++attempt, report.scale *= 0.9) {
    auto rows = layOut(samples, arm, report.centre, report.scale, index, jaw);
    if (!rows) continue;
    report.trajectory.rows = std::move(*rows);
    report.trajectory.moves[index] = true;
    return report;
  }
  throw TrajectoryError(
      files::shown(path, 4096) +
      ": cannot be laid into reach of this instrument: its aim point itself is out of reach");
}

}  // namespace vest::trajectory
