#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "vest_bringup/session/motion_table.h"

namespace vest::session {

/// Figures of motion that a person's skill is judged by.
///
/// Figures of raw samples depend on the sampling rate where the recording is noisy: compare those of one
/// device alone. Those called filtered do not: positions pass a second-order Butterworth low pass at 6 Hz
/// forwards and backwards (no lag; half the amplitude at 6 Hz) at the recorded rate, and are sampled anew at
/// 100 Hz through a cubic spline. 6 Hz: tuned, above voluntary motion of a hand, below tremor (8 to 12 Hz).
/// Smooth motions are the same to 2 % from 30 Hz to 1 kHz. Of a tremor of 0.2 mm and 8, 10, 12 Hz in a reach
/// of 0.2 m, log dimensionless jerk reads 4, 12, 26 % less at 30 Hz than at 1 kHz (measured): the bilinear
/// transform closes the filter towards half the rate.
namespace motion {

constexpr double kIdleSpeed = 0.005;      ///< m/s, tuned: below it a tool rests
constexpr double kGapIntervals = 5.0;     ///< median intervals: a longer pause of the recording is a gap
constexpr double kFilterFrequency = 6.0;  ///< Hz
constexpr double kSmoothRate = 100.0;     ///< Hz, of the filtered motion
constexpr double kDepthTurn = 0.005;      ///< m, tuned: a way along the tool's axis that counts
constexpr double kLongestFiltered = 1e4;  ///< s times tools (assumed): the spectrum of more takes 1 GB

/// Nothing is known of the motion from `from` to `to`: no figure counts it.
struct Gap {
  double from = 0, to = 0;  ///< s
};

struct ToolFigures {
  std::string name;
  double duration = 0;    ///< s, recorded, without gaps
  double path = 0;        ///< m, Σ‖Δp‖
  double mean_speed = 0;  ///< m/s, path / duration
  double peak_speed = 0;  ///< m/s, greatest ‖Δp‖/Δt
  std::optional<double>
      rms_jerk;  ///< m/s³, root of the mean ‖second difference of v‖², v by forward difference
  std::optional<double> angular_path;  ///< rad, Σ 2·atan2(‖Im qᵢ*qᵢ₊₁‖, |Re|)
  std::optional<double> depth_path;    ///< m, Σ|Δp·z|, z the tool's axis, mean of both ends
  /// Times that the tool turned back after more than kDepthTurn inwards, by more than kDepthTurn (with
  /// orientations). Ways are counted along its axis; each piece between gaps begins anew.
  std::optional<int> depth_turns;
  std::optional<double> economy;  ///< straight way by the goals over the path; where goals are known
  double idle_fraction = 0;  ///< part of the duration with a speed below kIdleSpeed, interval by interval
  // Of the filtered motion; nothing where the recording is too short, slower than 15 Hz, or longer
  // than kLongestFiltered over the number of tools.
  std::optional<double> filtered_path;        ///< m
  std::optional<double> filtered_peak_speed;  ///< m/s
  std::optional<double> filtered_rms_jerk;    ///< m/s³
  std::optional<double> filtered_idle_fraction;
  std::optional<double> sparc;  ///< spectral arc length of the speed, see sparc()
  std::optional<double> ldlj;   ///< log dimensionless jerk, see logDimensionlessJerk()
  std::vector<Gap> gaps;
};

struct Figures {
  std::string file;
  std::vector<ToolFigures> tools;
  double duration = 0;  ///< s, recorded, without gaps
  double path = 0;      ///< m, of all tools
  /// Time in which two or more tools move over time in which at least one does; for two tools or more.
  std::optional<double> bimanual;
  /// Shorter over longer path, for exactly two tools.
  std::optional<double> path_ratio;
};

/// All figures of a table. Of several pieces between gaps SPARC and log dimensionless jerk are the mean,
/// weighted by duration.
Figures figuresOf(const MotionTable& table);

/// Spectral arc length −∫√((1/f_c)² + (dM/df)²)df of a speed profile: M the spectrum's modulus over its
/// maximum, zero-padded by four octaves, up to the last f ≤ 10 Hz with M ≥ 0.05. Balasubramanian,
/// Melendez-Calderon, Roby-Brami, Burdet 2015, J NeuroEng Rehabil 12:112.
/// @param speed m/s, samples  @param rate Hz  @return nothing for fewer than 2 samples or no motion
std::optional<double> sparc(const std::vector<double>& speed, double rate);

/// −ln(T³/v_peak² · Σ‖v̈‖²·dt), T = samples·dt. The same source.
/// @param velocity m/s, samples  @param rate Hz  @return nothing for fewer than 3 samples, no motion or no
/// jerk
std::optional<double> logDimensionlessJerk(const std::vector<Eigen::Vector3d>& velocity, double rate);

/// (−2z(ln T) − z(ln path) + z(LDLJ))/4 of each recording within the group, z in sample standard deviations.
/// LDLJ is the mean of a recording's tools.
/// @return one per recording; nothing where a recording lacks a figure, or fewer than two have all of them
std::vector<std::optional<double>> motionIndex(const std::vector<Figures>& group);

/// As JSON: `tools` by name, `duration_s`, `path_m`, `bimanual`; what is not known is null.
std::string toJson(const Figures& figures, const std::vector<Figures>& cohort = {});
/// As a table for people.
std::string toText(const Figures& figures, const std::vector<Figures>& cohort = {});

}  // namespace motion
}  // namespace vest::session
