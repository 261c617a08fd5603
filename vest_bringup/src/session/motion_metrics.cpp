#include "vest_bringup/session/motion_metrics.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <limits>

#include <Eigen/QR>
#include <unsupported/Eigen/FFT>

#include <nlohmann/json.hpp>

namespace vest::session::motion {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr double kMostSamples = 2e6;  // of a piece, at its rate (assumed)
constexpr double kSteadiest = 14;     // log dimensionless jerk (tuned); no reach from rest is above -5.3
constexpr double kRoundOff = 1e4;     // units in the last place of a position (tuned, seen: 60)

/// Rows first … last, both counted, without a gap between them.
struct Piece {
  std::size_t first = 0, last = 0;
};

double medianInterval(const std::vector<double>& time) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < time.size(); ++i) steps.push_back(time[i] - time[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  if (steps.size() % 2 == 1) return *middle;
  return 0.5 * (*std::max_element(steps.begin(), middle) + *middle);
}

std::vector<Piece> piecesOf(const std::vector<double>& time, double longest) {
  std::vector<Piece> pieces{{0, 0}};
  for (std::size_t i = 1; i < time.size(); ++i) {
    if (time[i] - time[i - 1] > longest) pieces.push_back({i, i});
    pieces.back().last = i;
  }
  return pieces;
}

/// Cubic spline through points at rising times. Its ends have the slope of the cubic through the four
/// outermost points. de Boor, A Practical Guide to Splines, 1978, chapter IV.
class Spline {
 public:
  Spline(std::vector<double> t, Points p) : t_(std::move(t)), p_(std::move(p)), slope_(p_.size()) {
    const std::size_t n = p_.size();
    slope_.front() = endSlope(0, 1);
    slope_.back() = endSlope(n - 1, -1);
    // Continuous second derivatives; diagonally dominant, so that elimination needs no pivots.
    std::vector<double> upper(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double before = t_[i] - t_[i - 1], after = t_[i + 1] - t_[i];
      const Eigen::Vector3d right =
          3.0 * (after * (p_[i] - p_[i - 1]) / before + before * (p_[i + 1] - p_[i]) / after);
      const double diagonal = 2.0 * (before + after) - after * upper[i - 1];
      upper[i] = before / diagonal;
      slope_[i] = (right - after * slope_[i - 1]) / diagonal;
    }
    for (std::size_t i = n - 1; i-- > 1;) slope_[i] -= upper[i] * slope_[i + 1];
  }

  /// @param i interval to begin the search with, moved to the one of `t`: calls with rising t cost little
  Eigen::Vector3d at(double t, std::size_t& i) const {
    while (i + 2 < t_.size() && t > t_[i + 1]) ++i;
    const double h = t_[i + 1] - t_[i], s = (t - t_[i]) / h;
    return (1 + 2 * s) * (1 - s) * (1 - s) * p_[i] + s * (1 - s) * (1 - s) * h * slope_[i] +
           s * s * (3 - 2 * s) * p_[i + 1] + s * s * (s - 1) * h * slope_[i + 1];
  }

  /// Uniform samples from the first to the last point.
  Points sample(double rate) const {
    const auto count = static_cast<std::size_t>((t_.back() - t_.front()) * rate + 1e-9) + 1;
    Points out;
    out.reserve(count);
    std::size_t i = 0;
    for (std::size_t k = 0; k < count; ++k) out.push_back(at(t_.front() + static_cast<double>(k) / rate, i));
    return out;
  }

 private:
  /// Slope at point `at` of the polynomial through it and up to three neighbours on one side (Newton's form).
  Eigen::Vector3d endSlope(std::size_t at, int side) const {
    const std::size_t count = std::min<std::size_t>(4, p_.size());
    std::vector<double> t;
    Points p;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t j = side > 0 ? at + k : at - k;
      t.push_back(t_[j]);
      p.push_back(p_[j]);
    }
    for (std::size_t order = 1; order < count; ++order)
      for (std::size_t k = count; k-- > order;) p[k] = (p[k] - p[k - 1]) / (t[k] - t[k - order]);
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();
    double product = 1.0;
    for (std::size_t order = 1; order < count; ++order) {
      slope += product * p[order];
      product *= t[0] - t[order];
    }
    return slope;
  }

  std::vector<double> t_;
  Points p_, slope_;
};

/// Curvature of a motion at its first point, m/s²: of the quartic that fits its first 0.4 s best; zero where
/// fewer than 8 points are there. The quartic leaves a minimum-jerk reach, which begins without curvature, as
/// it is; noise of tremor passes the longer window least.
constexpr double kEndWindow = 0.4;  // s, tuned
template <class Iterator>
Eigen::Vector3d endCurvature(Iterator first, std::size_t points, double rate) {
  const std::size_t n = std::min(points, static_cast<std::size_t>(std::lround(kEndWindow * rate)) + 1);
  if (n < 8) return Eigen::Vector3d::Zero();
  Eigen::MatrixXd powers(n, 5), places(n, 3);
  for (std::size_t i = 0; i < n; ++i) {
    const double t = static_cast<double>(i) / (kEndWindow * rate);
    const auto row = static_cast<Eigen::Index>(i);
    powers.row(row) << 1.0, t, t * t, t * t * t, t * t * t * t;
    places.row(row) = (first[static_cast<std::ptrdiff_t>(i)] - *first).transpose();
  }
  const Eigen::MatrixXd fit = powers.householderQr().solve(places);
  return 2.0 * fit.row(2).transpose() / (kEndWindow * kEndWindow);
}

/// Second-order Butterworth low pass by the bilinear transform, forwards, then backwards.
void filterTwice(Points& points, double rate) {
  const double k = std::tan(M_PI * kFilterFrequency / rate), scale = 1.0 / (1.0 + std::sqrt(2.0) * k + k * k);
  const double b = k * k * scale, a1 = 2.0 * (k * k - 1.0) * scale,
               a2 = (1.0 - std::sqrt(2.0) * k + k * k) * scale;
  const std::size_t n = points.size();
  // The ends go on point-symmetrically, so that a motion does not begin with a step, and with the curvature
  // that they have: a circle whose curvature turned over at its ends would have a jerk that is not there.
  const std::size_t more = std::min(n - 1, static_cast<std::size_t>(std::ceil(rate)));
  Points x;
  x.reserve(n + 2 * more);
  const Eigen::Vector3d at_front = endCurvature(points.begin(), n, rate),
                        at_back = endCurvature(points.rbegin(), n, rate);
  const auto bent = [rate](std::size_t i, const Eigen::Vector3d& curvature) -> Eigen::Vector3d {
    const double away = std::min(static_cast<double>(i) / rate, kEndWindow);
    return away * away * curvature;
  };
  for (std::size_t i = more; i > 0; --i) x.push_back(2.0 * points.front() - points[i] + bent(i, at_front));
  x.insert(x.end(), points.begin(), points.end());
  for (std::size_t i = 1; i <= more; ++i)
    x.push_back(2.0 * points.back() - points[n - 1 - i] + bent(i, at_back));
  for (int pass = 0; pass < 2; ++pass) {
    Eigen::Vector3d x1 = x.front(), x2 = x.front(), y1 = x.front(), y2 = x.front();
    for (Eigen::Vector3d& value : x) {
      const Eigen::Vector3d y = b * (value + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
      x2 = x1;
      x1 = value;
      y2 = y1;
      y1 = y;
      value = y;
    }
    std::reverse(x.begin(), x.end());
  }
  std::copy_n(x.begin() + static_cast<std::ptrdiff_t>(more), n, points.begin());
}

/// Filtered positions of a piece at kSmoothRate; empty where it is too short or too slow.
Points smooth(const std::vector<double>& time, const Points& position, const Piece& piece) {
  const std::size_t n = piece.last - piece.first + 1;
  if (n < 8) return {};
  const auto begin = static_cast<std::ptrdiff_t>(piece.first),
             end = static_cast<std::ptrdiff_t>(piece.last + 1);
  std::vector<double> t(time.begin() + begin, time.begin() + end);
  Points p(position.begin() + begin, position.begin() + end);
  // The rate of the recording; uneven intervals and missing rows are evened out by the spline.
  const double length = t.back() - t.front();
  const double count = std::max(std::round(length / medianInterval(t)), 1.0), rate = count / length;
  if (!(rate >= 2.5 * kFilterFrequency) || count > kMostSamples) return {};
  double uneven = 0;
  for (std::size_t i = 1; i < n; ++i) uneven = std::max(uneven, std::abs((t[i] - t[i - 1]) * rate - 1.0));
  if (uneven > 1e-6 || static_cast<double>(n) != count + 1.0) p = Spline(t, p).sample(rate);
  filterTwice(p, rate);
  t.resize(p.size());
  for (std::size_t i = 0; i < t.size(); ++i) t[i] = static_cast<double>(i) / rate;
  return Spline(t, p).sample(kSmoothRate);
}

/// Means over pieces, weighted by their durations.
struct Mean {
  double sum = 0, weight = 0;
  void add(const std::optional<double>& value, double seconds) {
    if (!value) return;
    sum += *value * seconds;
    weight += seconds;
  }
  std::optional<double> get() const {
    return weight > 0 ? std::optional<double>(sum / weight) : std::nullopt;
  }
};

/// Counts turns back along a tool's axis: in by more than kDepthTurn, then out by more than it.
class Turns {
 public:
  void begin() { place_ = end_ = 0, in_ = false; }
  void add(double inwards) {
    place_ += inwards;
    if (in_ ? place_ > end_ : place_ < end_) end_ = place_;
    if (std::abs(place_ - end_) <= kDepthTurn) return;
    count_ += in_;
    in_ = !in_, end_ = place_;
  }
  int count() const { return count_; }

 private:
  double place_ = 0, end_ = 0;  // m: along the axis; where it was deepest, or least deep, of this way
  bool in_ = false;
  int count_ = 0;
};

void addFiltered(const Points& p, ToolFigures& f, Mean& sparcs, Mean& ldljs, Mean& idle, Mean& jerk) {
  if (p.size() < 4) return;
  const double seconds = static_cast<double>(p.size() - 1) / kSmoothRate;
  Points v;
  std::vector<double> speed;
  double path = 0, peak = 0, rest = 0;
  for (std::size_t i = 1; i < p.size(); ++i) {
    v.push_back(kSmoothRate * (p[i] - p[i - 1]));
    speed.push_back(v.back().norm());
    path += speed.back() / kSmoothRate;
    peak = std::max(peak, speed.back());
    rest += speed.back() < kIdleSpeed ? 1.0 : 0.0;
  }
  double squares = 0, unsure = 0;  // the second in m: what round-off makes of a place
  for (const Eigen::Vector3d& place : p)
    unsure = std::max(unsure, kRoundOff * std::numeric_limits<double>::epsilon() * place.norm());
  for (std::size_t i = 2; i < v.size(); ++i)
    squares += (kSmoothRate * kSmoothRate * (v[i] - 2.0 * v[i - 1] + v[i - 2])).squaredNorm();
  jerk.add(squares / static_cast<double>(v.size() - 2), seconds);
  f.filtered_path = f.filtered_path.value_or(0.0) + path;
  f.filtered_peak_speed = std::max(peak, f.filtered_peak_speed.value_or(0.0));
  idle.add(rest / static_cast<double>(speed.size()), seconds);
  // Of rest, and of steady motion, the differences are round-off or what the filter's ends leave: figures of
  // nothing.
  if (peak > unsure * kSmoothRate) sparcs.add(sparc(speed, kSmoothRate), seconds);
  const double of_steady = unsure * kSmoothRate * kSmoothRate * kSmoothRate;
  if (squares > of_steady * of_steady * static_cast<double>(v.size() - 2))
    if (const auto ldlj = logDimensionlessJerk(v, kSmoothRate); ldlj && *ldlj < kSteadiest)
      ldljs.add(ldlj, seconds);
}

ToolFigures toolFigures(const MotionTable& table, const MotionTable::Tool& tool,
                        const std::vector<Piece>& pieces, bool filtered) {
  ToolFigures f;
  f.name = tool.name;
  const std::vector<double>& t = table.time;
  double idle = 0, jerks = 0, angle = 0, depth = 0;
  Turns turns;
  std::size_t jerk_count = 0;
  Mean sparcs, ldljs, filtered_idle, filtered_jerk;
  for (std::size_t k = 0; k < pieces.size(); ++k) {
    const Piece& piece = pieces[k];
    if (k > 0) f.gaps.push_back({table.start + t[pieces[k - 1].last], table.start + t[piece.first]});
    f.duration += t[piece.last] - t[piece.first];
    turns.begin();
    for (std::size_t i = piece.first + 1; i <= piece.last; ++i) {
      const Eigen::Vector3d step = tool.position[i] - tool.position[i - 1];
      const double dt = t[i] - t[i - 1], speed = step.norm() / dt;
      f.path += step.norm();
      f.peak_speed = std::max(f.peak_speed, speed);
      if (speed < kIdleSpeed) idle += dt;
      if (!tool.orientation.empty()) {
        const Eigen::Quaterniond turn = tool.orientation[i - 1].conjugate() * tool.orientation[i];
        angle += 2.0 * std::atan2(turn.vec().norm(), std::abs(turn.w()));
        const double inwards = 0.5 * step.dot((tool.orientation[i - 1] * Eigen::Vector3d::UnitZ()) +
                                              (tool.orientation[i] * Eigen::Vector3d::UnitZ()));
        depth += std::abs(inwards);
        turns.add(inwards);
      }
      if (i < piece.first + 3) continue;
      // Second divided difference of three velocities, each in the middle of its interval.
      Eigen::Vector3d v[3];
      double at[3];
      for (std::size_t j = 0; j < 3; ++j) {
        const std::size_t later = i - 2 + j;
        v[j] = (tool.position[later] - tool.position[later - 1]) / (t[later] - t[later - 1]);
        at[j] = 0.5 * (t[later] + t[later - 1]);
      }
      const Eigen::Vector3d jerk =
          2.0 * ((v[2] - v[1]) / (at[2] - at[1]) - (v[1] - v[0]) / (at[1] - at[0])) / (at[2] - at[0]);
      jerks += jerk.squaredNorm();
      ++jerk_count;
    }
    if (filtered)
      addFiltered(smooth(t, tool.position, piece), f, sparcs, ldljs, filtered_idle, filtered_jerk);
  }
  f.mean_speed = f.duration > 0 ? f.path / f.duration : 0.0;
  f.idle_fraction = f.duration > 0 ? idle / f.duration : 0.0;
  if (jerk_count > 0) f.rms_jerk = std::sqrt(jerks / static_cast<double>(jerk_count));
  if (!tool.orientation.empty()) {
    f.angular_path = angle;
    f.depth_path = depth;
    f.depth_turns = turns.count();
  }
  f.sparc = sparcs.get();
  f.ldlj = ldljs.get();
  f.filtered_idle_fraction = filtered_idle.get();
  if (const auto mean = filtered_jerk.get()) f.filtered_rms_jerk = std::sqrt(*mean);
  return f;
}

nlohmann::json orNull(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? nlohmann::json(*value) : nlohmann::json(nullptr);
}

}  // namespace

std::optional<double> sparc(const std::vector<double>& speed, double rate) {
  if (speed.size() < 2) return {};
  std::size_t padded = 1;
  while (padded < speed.size()) padded *= 2;
  padded *= 16;  // four octaves
  std::vector<double> in(speed);
  in.resize(padded, 0.0);
  std::vector<std::complex<double>> out;
  Eigen::FFT<double> fft;
  fft.SetFlag(Eigen::FFT<double>::HalfSpectrum);
  fft.fwd(out, in);
  std::vector<double> modulus;
  double greatest = 0;
  for (const auto& value : out) {
    modulus.push_back(std::abs(value));
    greatest = std::max(greatest, modulus.back());
  }
  if (!(greatest > 0)) return {};
  const double df = rate / static_cast<double>(padded);
  std::size_t last = 0;
  for (std::size_t i = 0; i < modulus.size() && static_cast<double>(i) * df <= 10.0; ++i)
    if (modulus[i] >= 0.05 * greatest) last = i;
  if (last == 0) return {};
  double length = 0;
  for (std::size_t i = 1; i <= last; ++i)
    length += std::hypot(1.0 / static_cast<double>(last), (modulus[i] - modulus[i - 1]) / greatest);
  return -length;
}

std::optional<double> logDimensionlessJerk(const std::vector<Eigen::Vector3d>& velocity, double rate) {
  if (velocity.size() < 3) return {};
  double peak = 0, squares = 0;
  for (std::size_t i = 0; i < velocity.size(); ++i) {
    peak = std::max(peak, velocity[i].norm());
    if (i >= 2)
      squares += (rate * rate * (velocity[i] - 2.0 * velocity[i - 1] + velocity[i - 2])).squaredNorm();
  }
  const double seconds = static_cast<double>(velocity.size()) / rate;
  if (!(peak > 0) || !(squares > 0)) return {};
  return -std::log(seconds * seconds * seconds / (peak * peak) * squares / rate);
}

Figures figuresOf(const MotionTable& table) {
  Figures out;
  out.file = table.file;
  // Five intervals are no gap, whatever their sum rounds to.
  const std::vector<Piece> pieces =
      piecesOf(table.time, (1.0 + 1e-9) * kGapIntervals * medianInterval(table.time));
  double both = 0, any = 0;
  for (const Piece& piece : pieces) {
    out.duration += table.time[piece.last] - table.time[piece.first];
    for (std::size_t i = piece.first + 1; i <= piece.last; ++i) {
      const double dt = table.time[i] - table.time[i - 1];
      int moving = 0;
      for (const auto& tool : table.tools)
        moving += (tool.position[i] - tool.position[i - 1]).norm() / dt >= kIdleSpeed;
      if (moving > 0) any += dt;
      if (moving > 1) both += dt;
    }
  }
  const double seconds = out.duration * static_cast<double>(table.tools.size());
  for (const auto& tool : table.tools) {
    out.tools.push_back(toolFigures(table, tool, pieces, seconds <= kLongestFiltered));
    out.path += out.tools.back().path;
  }
  if (table.tools.size() > 1) out.bimanual = any > 0 ? both / any : 0.0;
  if (table.tools.size() == 2) {
    const double longer = std::max(out.tools[0].path, out.tools[1].path);
    if (longer > 0) out.path_ratio = std::min(out.tools[0].path, out.tools[1].path) / longer;
  }
  return out;
}

std::vector<std::optional<double>> motionIndex(const std::vector<Figures>& group) {
  std::vector<std::optional<double>> out(group.size());
  std::vector<std::size_t> who;
  std::vector<Eigen::Array3d> what;  // ln T, ln path, LDLJ
  for (std::size_t i = 0; i < group.size(); ++i) {
    Mean ldlj;
    for (const auto& tool : group[i].tools) ldlj.add(tool.ldlj, 1.0);
    if (!ldlj.get() || !(group[i].duration > 0) || !(group[i].path > 0)) continue;
    who.push_back(i);
    what.emplace_back(std::log(group[i].duration), std::log(group[i].path), *ldlj.get());
  }
  if (what.size() < 2) return out;
  Eigen::Array3d mean = Eigen::Array3d::Zero(), variance = Eigen::Array3d::Zero();
  for (const auto& w : what) mean += w / static_cast<double>(what.size());
  for (const auto& w : what) variance += (w - mean).square() / static_cast<double>(what.size() - 1);
  for (std::size_t k = 0; k < who.size(); ++k) {
    Eigen::Array3d z = Eigen::Array3d::Zero();  // of what is the same for all: zero
    for (int j = 0; j < 3; ++j)
      if (variance[j] > 1e-18) z[j] = (what[k][j] - mean[j]) / std::sqrt(variance[j]);
    out[who[k]] = (-2.0 * z[0] - z[1] + z[2]) / 4.0;
  }
  return out;
}

std::string toJson(const Figures& figures, const std::vector<Figures>& cohort) {
  nlohmann::json out;
  out["tools"] = nlohmann::json::object();
  for (const ToolFigures& f : figures.tools) {
    nlohmann::json tool;
    tool["duration_s"] = f.duration;
    tool["path_m"] = f.path;
    tool["mean_speed_m_s"] = f.mean_speed;
    tool["peak_speed_m_s"] = f.peak_speed;
    tool["rms_jerk_m_s3"] = orNull(f.rms_jerk);
    tool["angular_path_rad"] = orNull(f.angular_path);
    tool["depth_path_m"] = orNull(f.depth_path);
    if (f.depth_turns) tool["depth_turns"] = *f.depth_turns;
    if (f.economy) tool["economy"] = *f.economy;
    tool["idle_fraction"] = f.idle_fraction;
    tool["sparc"] = orNull(f.sparc);
    tool["ldlj"] = orNull(f.ldlj);
    tool["filtered_path_m"] = orNull(f.filtered_path);
    tool["filtered_peak_speed_m_s"] = orNull(f.filtered_peak_speed);
    tool["filtered_rms_jerk_m_s3"] = orNull(f.filtered_rms_jerk);
    tool["filtered_idle_fraction"] = orNull(f.filtered_idle_fraction);
    tool["gaps"] = nlohmann::json::array();
    for (const Gap& gap : f.gaps) tool["gaps"].push_back({{"from_s", gap.from}, {"to_s", gap.to}});
    out["tools"][f.name] = std::move(tool);
  }
  out["duration_s"] = figures.duration;
  out["path_m"] = figures.path;
  out["bimanual"] = orNull(figures.bimanual);
  out["path_ratio"] = orNull(figures.path_ratio);
  if (!cohort.empty()) {
    std::vector<Figures> group{figures};
    group.insert(group.end(), cohort.begin(), cohort.end());
    const auto index = motionIndex(group);
    out["cohort"] = nlohmann::json::array();
    for (std::size_t i = 0; i < group.size(); ++i)
      out["cohort"].push_back({{"file", group[i].file}, {"motion_index", orNull(index[i])}});
  }
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string toText(const Figures& figures, const std::vector<Figures>& cohort) {
  std::string out;
  const auto line = [&out](const char* what, const std::string& value) {
    char text[160];
    std::snprintf(text, sizeof text, "  %-32s %s\n", what, value.c_str());
    out += text;
  };
  const auto shown = [](const std::optional<double>& value, const char* unit) {
    char text[64];
    if (!value) return std::string("-");
    std::snprintf(text, sizeof text, "%.6g %s", *value, unit);
    return std::string(text);
  };
  for (const ToolFigures& f : figures.tools) {
    out += f.name + "\n";
    line("duration", shown(f.duration, "s"));
    line("path (filtered)", shown(f.path, "m") + " (" + shown(f.filtered_path, "m") + ")");
    line("mean speed", shown(f.mean_speed, "m/s"));
    line("peak speed (filtered)",
         shown(f.peak_speed, "m/s") + " (" + shown(f.filtered_peak_speed, "m/s") + ")");
    line("RMS jerk (filtered)", shown(f.rms_jerk, "m/s3") + " (" + shown(f.filtered_rms_jerk, "m/s3") + ")");
    line("angular path", shown(f.angular_path, "rad"));
    line("path along the tool", shown(f.depth_path, "m"));
    line("turns back along the tool", shown(f.depth_turns, ""));
    line("idle fraction (filtered)",
         shown(f.idle_fraction, "") + "(" + shown(f.filtered_idle_fraction, "") + ")");
    line("SPARC", shown(f.sparc, ""));
    line("log dimensionless jerk", shown(f.ldlj, ""));
    for (const Gap& gap : f.gaps) line("gap, not counted", shown(gap.from, "s to ") + shown(gap.to, "s"));
  }
  out += "all tools\n";
  line("duration", shown(figures.duration, "s"));
  line("path", shown(figures.path, "m"));
  line("bimanual", shown(figures.bimanual, ""));
  line("path ratio", shown(figures.path_ratio, ""));
  if (!cohort.empty()) {
    std::vector<Figures> group{figures};
    group.insert(group.end(), cohort.begin(), cohort.end());
    const auto index = motionIndex(group);
    out += "motion index\n";
    for (std::size_t i = 0; i < group.size(); ++i) line(group[i].file.c_str(), shown(index[i], ""));
  }
  return out;
}

}  // namespace vest::session::motion
