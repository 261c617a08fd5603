#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <random>

#include <unistd.h>

#include <nlohmann/json.hpp>

#include "vest_bringup/session/motion_metrics.h"

// Protects the figures of motion: against motions whose answers are known, and against files that lie.

namespace vest::session {
namespace {

using Eigen::Vector3d;
using motion::Figures;
using motion::figuresOf;

MotionTable tableOf(double seconds, double rate, const std::function<Vector3d(double)>& place) {
  MotionTable table;
  table.file = "synthetic";
  table.tools.push_back({"right", {}, {}, {}});
  const auto count = static_cast<int>(std::lround(seconds * rate));
  for (int i = 0; i <= count; ++i) {
    table.time.push_back(i / rate);
    table.tools[0].position.push_back(place(table.time.back()));
  }
  return table;
}

/// Flash & Hogan 1985: 0.2 m in 5 s.
Vector3d reach(double t) {
  const double s = t / 5.0;
  return {0.2 * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s), 0, 0};
}

TEST(MotionMetrics, MinimumJerkReachHasItsKnownFigures) {
  const Figures f = figuresOf(tableOf(5.0, 1000.0, reach));
  const auto& tool = f.tools[0];
  EXPECT_NEAR(tool.duration, 5.0, 1e-9);
  EXPECT_NEAR(tool.path, 0.2, 0.2e-3);
  EXPECT_NEAR(tool.mean_speed, 0.04, 4e-5);
  EXPECT_NEAR(tool.peak_speed, 1.875 * 0.04, 7e-5);
  const double jerk = std::sqrt(720.0) * 0.2 / 125.0;
  EXPECT_NEAR(tool.rms_jerk.value(), jerk, 1e-3 * jerk);
  // 30 s²(1−s)²·0.04 < 0.005 at both ends.
  const double root = 0.5 - std::sqrt(0.25 - std::sqrt(0.005 / 1.2));
  EXPECT_NEAR(tool.idle_fraction, 2.0 * root, 1e-3);
  // T³/v²·∫jerk² = 720/1.875², the figure of the motion without a filter.
  EXPECT_NEAR(tool.ldlj.value(), -std::log(720.0 / (1.875 * 1.875)), 0.03);
}

/// The spectrum of what is filtered takes time and memory, without a bound of its own.
TEST(MotionMetrics, OfMoreThanTenThousandSecondsOfAllToolsNothingIsFiltered) {
  MotionTable table = tableOf(10.0, 20.0, reach);
  EXPECT_TRUE(figuresOf(table).tools[0].sparc.has_value());
  table.tools.resize(1001, table.tools[0]);
  const Figures f = figuresOf(table);
  EXPECT_FALSE(f.tools[0].sparc.has_value());
  EXPECT_GT(f.tools[0].path, 0.19);
}

TEST(MotionMetrics, CircleHasItsKnownFigures) {
  const double w = 2.0 * M_PI * 0.5, r = 0.03;
  MotionTable table =
      tableOf(10.0, 500.0, [=](double t) { return Vector3d(r * std::cos(w * t), r * std::sin(w * t), 0.1); });
  for (const double t : table.time)
    table.tools[0].orientation.emplace_back(Eigen::AngleAxisd(w * t, Vector3d::UnitZ()));
  const auto tool = figuresOf(table).tools[0];
  EXPECT_NEAR(tool.path, w * r * 10.0, 1e-3 * w * r * 10.0);
  EXPECT_NEAR(tool.peak_speed, w * r, 1e-3 * w * r);
  EXPECT_NEAR(tool.rms_jerk.value(), w * w * w * r, 1e-3 * w * w * w * r);
  EXPECT_NEAR(tool.angular_path.value(), w * 10.0, 1e-3 * w * 10.0);
  EXPECT_NEAR(tool.depth_path.value(), 0.0, 1e-9) << "it moves across the tool's axis";
  EXPECT_EQ(tool.idle_fraction, 0.0);
}

TEST(MotionMetrics, ACircleIsAsSmoothAsItIsAtEveryRate) {
  // T³/v²·∫jerk² = (ωT)⁴. It is in full swing where the recording begins and ends.
  const double w = 2.0 * M_PI / 5.0, r = 0.05, known = -4.0 * std::log(w * 10.0);
  for (const double rate : {30.0, 100.0, 1000.0}) {
    const auto tool = figuresOf(tableOf(10.0, rate, [=](double t) {
                        return Vector3d(r * std::cos(w * t), r * std::sin(w * t), 0.1);
                      })).tools[0];
    EXPECT_NEAR(tool.ldlj.value(), known, 1e-3 * std::abs(known)) << rate;
    EXPECT_NEAR(tool.filtered_rms_jerk.value(), w * w * w * r, 2e-3 * w * w * w * r) << rate;
  }
}

TEST(MotionMetrics, TremorAddsItsOwnJerkToTheRawFigureAndNotToTheFilteredPath) {
  const double w = 2.0 * M_PI * 20.0, a = 0.0005;
  const auto still = figuresOf(tableOf(5.0, 1000.0, reach)).tools[0];
  const auto shaking = figuresOf(tableOf(5.0, 1000.0, [=](double t) {
                         return Vector3d(reach(t) + Vector3d(0, a * std::sin(w * t), 0));
                       })).tools[0];
  const double tremor = a * w * w * w / std::sqrt(2.0), both = std::hypot(tremor, still.rms_jerk.value());
  // Differences over 1 ms see sin(x)/x of each derivative, x = w·dt/2.
  const double seen = std::pow(std::sin(w * 0.0005) / (w * 0.0005), 3);
  EXPECT_NEAR(shaking.rms_jerk.value(), both * seen, 2e-3 * both);
  EXPECT_GT(shaking.path, 1.05 * still.path);
  EXPECT_NEAR(shaking.filtered_path.value(), still.filtered_path.value(), 0.005 * still.path);
  EXPECT_LT(shaking.ldlj.value(), still.ldlj.value());
}

TEST(MotionMetrics, FilteredFiguresHangOnTheRateByLessThanTwoPerCent) {
  const auto place = [](double t) {
    return Vector3d(0.05 * std::sin(1.7 * t), 0.03 * std::cos(2.3 * t), 0.1 + 0.02 * std::sin(5.0 * t));
  };
  const auto finest = figuresOf(tableOf(20.0, 1000.0, place)).tools[0];
  for (const double rate : {30.0, 100.0}) {
    const auto f = figuresOf(tableOf(20.0, rate, place)).tools[0];
    EXPECT_NEAR(f.filtered_path.value() / finest.filtered_path.value(), 1.0, 0.02) << rate;
    EXPECT_NEAR(f.filtered_peak_speed.value() / finest.filtered_peak_speed.value(), 1.0, 0.02) << rate;
    EXPECT_NEAR(f.filtered_rms_jerk.value() / finest.filtered_rms_jerk.value(), 1.0, 0.02) << rate;
    EXPECT_NEAR(f.sparc.value() / finest.sparc.value(), 1.0, 0.02) << rate;
    EXPECT_NEAR(f.ldlj.value() / finest.ldlj.value(), 1.0, 0.02) << rate;
    EXPECT_NEAR(f.path / finest.path, 1.0, 0.02) << rate;
  }
}

TEST(MotionMetrics, OfSteadyMotionRoundOffHasNoSmoothness) {
  for (const double rate : {30.0, 100.0, 1000.0})
    for (const double away : {0.0, 1.0, 1e5}) {
      const auto f =
          figuresOf(tableOf(20.0, rate, [=](double t) { return Vector3d(away + 0.05 * t, 0, 0); })).tools[0];
      EXPECT_FALSE(f.ldlj.has_value()) << *f.ldlj << " at " << rate << " Hz, " << away << " m away";
      EXPECT_TRUE(f.sparc.has_value());
    }
  const auto line = [](double t) { return Vector3d(0.1 * t, 0, 0); };
  EXPECT_FALSE(figuresOf(tableOf(0.5, 100.0, line)).tools[0].ldlj) << "as short as the filter's ends";
  // The gentlest hand is far above: 0.2 m in a minute.
  EXPECT_TRUE(figuresOf(tableOf(60.0, 100.0, [](double t) { return reach(t / 12.0); })).tools[0].ldlj);
}

TEST(MotionMetrics, DepthOfAToolThatTurnsHangsOnTheRateByLessThanTwoPerCent) {
  // z turns from x to y by 1 rad/s while the tip goes along x by 0.02 m/s: Σ|Δp·z| is 0.02·sin t.
  for (const double rate : {30.0, 100.0, 1000.0}) {
    MotionTable table = tableOf(1.5, rate, [](double t) { return Vector3d(0.02 * t, 0, 0); });
    for (const double t : table.time)
      table.tools[0].orientation.push_back(
          Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d(std::cos(t), std::sin(t), 0)));
    const double known = 0.02 * std::sin(1.5);
    EXPECT_NEAR(figuresOf(table).tools[0].depth_path.value(), known, 1e-3 * known) << rate;
  }
}

TEST(MotionMetrics, TurnsBackAlongTheToolAreCountedFromFiveMillimetres) {
  const auto turns = [](double depth) {
    // Five times in and out along the tool's axis, which lies along y; the tip sways across it.
    MotionTable table = tableOf(10.0, 100.0, [=](double t) {
      return Vector3d(0.03 * std::sin(9.0 * t), 0.5 * depth * (1.0 - std::cos(M_PI * t)), 0);
    });
    table.tools[0].orientation.assign(
        table.time.size(), Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitY()));
    return figuresOf(table).tools[0].depth_turns.value();
  };
  EXPECT_EQ(turns(0.0049), 0);
  EXPECT_EQ(turns(0.0051), 5);
  EXPECT_EQ(turns(0.02), 5);
  EXPECT_FALSE(figuresOf(tableOf(1, 100, reach)).tools[0].depth_turns) << "no axis is known";
}

TEST(MotionMetrics, SpeedProfileOfThePublishedExampleHasItsPublishedFigures) {
  // Speed exp(−5t²), t −1 … 0.99 s at 100 Hz: the example that comes with Balasubramanian et al. 2015.
  std::vector<double> speed;
  std::vector<Vector3d> velocity;
  for (int i = -100; i < 100; ++i) {
    speed.push_back(std::exp(-5e-4 * i * i));
    velocity.emplace_back(speed.back(), 0, 0);
  }
  EXPECT_NEAR(motion::sparc(speed, 100.0).value(), -1.41403, 5e-5);
  EXPECT_NEAR(motion::logDimensionlessJerk(velocity, 100.0).value(), -5.81636, 5e-5);
}

TEST(MotionMetrics, AGapIsReportedAndNotBridgedAndAMissingRowIsBridged) {
  MotionTable whole = tableOf(10.0, 50.0, [](double t) { return Vector3d(0.02 * t, 0, 0); }), cut = whole;
  const auto drop = [&cut](std::size_t first, std::size_t count) {
    const auto at = static_cast<std::ptrdiff_t>(first), end = static_cast<std::ptrdiff_t>(first + count);
    cut.time.erase(cut.time.begin() + at, cut.time.begin() + end);
    cut.tools[0].position.erase(cut.tools[0].position.begin() + at, cut.tools[0].position.begin() + end);
  };
  drop(250, 100);  // 2 s
  drop(100, 1);
  const auto f = figuresOf(cut);
  ASSERT_EQ(f.tools[0].gaps.size(), 1U);
  EXPECT_NEAR(f.tools[0].gaps[0].from, 4.98, 1e-9);
  EXPECT_NEAR(f.tools[0].gaps[0].to, 7.0, 1e-9);
  EXPECT_NEAR(f.duration, 10.0 - 2.02, 1e-9);
  EXPECT_NEAR(f.path, 0.02 * (10.0 - 2.02), 1e-9);
  EXPECT_NEAR(f.tools[0].peak_speed, 0.02, 1e-9) << "the jump over the gap is no speed";
  EXPECT_LT(f.tools[0].rms_jerk.value(), 1e-6) << "nor a jerk";
}

TEST(MotionMetrics, UseOfBothHandsIsTheTimeInWhichBothMove) {
  MotionTable table =
      tableOf(10.0, 100.0, [](double t) { return Vector3d(t < 6.0 ? 0.02 * t : 0.12, 0, 0); });
  table.tools.push_back({"left", {}, {}, {}});
  for (const double t : table.time)
    table.tools[1].position.emplace_back(0, t > 4.0 ? 0.01 * (t - 4.0) : 0.0, 0);
  const Figures f = figuresOf(table);
  EXPECT_NEAR(f.bimanual.value(), 0.2, 2e-3);  // 4 … 6 s of 0 … 10 s
  EXPECT_NEAR(f.path_ratio.value(), 0.06 / 0.12, 1e-6);
  EXPECT_FALSE(figuresOf(tableOf(1, 100, reach)).bimanual.has_value()) << "one tool alone";
}

TEST(MotionMetrics, MotionIndexPrefersTheQuickAndSmoothWithinAGroup) {
  std::vector<Figures> group(3);
  const double seconds[3] = {30, 60, 90}, metres[3] = {1, 2, 3}, smooth[3] = {-8, -10, -12};
  for (std::size_t i = 0; i < 3; ++i) {
    group[i].duration = std::exp(seconds[i] / 30.0);
    group[i].path = std::exp(metres[i]);
    group[i].tools.emplace_back();
    group[i].tools[0].ldlj = smooth[i];
  }
  auto index = motion::motionIndex(group);
  EXPECT_NEAR(index[0].value(), 1.0, 1e-12);  // (−2·(−1) − (−1) + 1)/4
  EXPECT_NEAR(index[1].value(), 0.0, 1e-12);
  EXPECT_NEAR(index[2].value(), -1.0, 1e-12);
  group[1].tools[0].ldlj.reset();
  index = motion::motionIndex(group);
  EXPECT_FALSE(index[1].has_value());
  EXPECT_TRUE(index[0].has_value());
}

TEST(MotionMetrics, RestHasNoSmoothnessAndJsonSaysNull) {
  const auto f = figuresOf(tableOf(1.0, 100.0, [](double) { return Vector3d(0.1, 0.2, 0.3); }));
  EXPECT_EQ(f.tools[0].idle_fraction, 1.0);
  const auto json = nlohmann::json::parse(motion::toJson(f));
  EXPECT_TRUE(json["tools"]["right"]["sparc"].is_null());
  EXPECT_TRUE(json["bimanual"].is_null());
  EXPECT_EQ(json["path_m"], 0.0);
}

class MotionTableFile : public ::testing::Test {
 protected:
  void SetUp() override {
    char name[] = "/tmp/vest_motion_XXXXXX";
    close(mkstemp(name));
    path_ = name;
  }
  void TearDown() override { std::remove(path_.c_str()); }
  void write(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }
  std::string refusal(const MotionLayout& layout = {}) {
    try {
      readMotionTable(path_, layout);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  }
  std::string path_;
};

TEST_F(MotionTableFile, ColumnsAreFoundByTheirNames) {
  write(
      "\xEF\xBB\xBF# comment\r\nr_z_m,t_s,r_x_m,r_y_m,r_jaw_rad,note,r_qx,r_qy,r_qz,r_qw\r\n"
      "3,0.0,1,2,0.5,7,0,0,0,2\r\n6,0.1,4,5,0.6,7,0,0,2,0\r\n");
  const MotionTable table = readMotionTable(path_);
  ASSERT_EQ(table.tools.size(), 1U);
  EXPECT_EQ(table.tools[0].name, "r");
  EXPECT_EQ(table.tools[0].position[1], Vector3d(4, 5, 6));
  EXPECT_EQ(table.tools[0].jaw[1], 0.6);
  EXPECT_EQ(table.tools[0].orientation[1].z(), 1.0);
  EXPECT_EQ(table.time[1], 0.1);
}

TEST_F(MotionTableFile, ForeignTablesAreReadByTheirColumns) {
  write("  1 10 20 30 0.5\n  2 11 20 30 0.5\n  3 12 20 30 0.5\n");
  MotionLayout layout;
  layout.tools = parseColumns("left=2-4");
  layout.rate = 30;
  layout.metres_per_unit = 0.001;
  const MotionTable table = readMotionTable(path_, layout);
  EXPECT_NEAR(table.time[2], 2.0 / 30.0, 1e-12);
  EXPECT_NEAR(table.tools[0].position[2].x(), 0.012, 1e-12);
  layout.rate = 0;
  layout.time_column = 1;
  EXPECT_EQ(readMotionTable(path_, layout).time[2], 2.0) << "since the first row";
  EXPECT_EQ(readMotionTable(path_, layout).start, 1.0);
  write("a title\n2,10,20,30\n4,10,20,30\n");
  EXPECT_EQ(readMotionTable(path_, layout).time[1], 2.0);
  layout.time_column = 0;
  write("t_s,a,b,c\n0.5,1,2,3\n0.75,1,2,3\n");
  EXPECT_EQ(readMotionTable(path_, layout).time[1], 0.25) << "a column t_s is found without being asked for";
}

TEST_F(MotionTableFile, StampsSince1970AreAsFineAsThoseSinceTheBegin) {
  // A double holds them to 0.2 millionths of a second: at 1 kHz the raw jerk was 359 times too great.
  const auto jerk = [this](const std::string& format, int per_ms, double unit) {
    std::string text = "a title\n";
    for (int i = 0; i < 1000; ++i) {
      char row[120];
      std::snprintf(row, sizeof row, format.c_str(), per_ms * i, reach(0.001 * i).x());
      text += row;
    }
    write(text);
    MotionLayout layout;
    layout.tools = parseColumns("r=2-4");
    layout.time_column = 1, layout.seconds_per_unit = unit;
    return figuresOf(readMotionTable(path_, layout)).tools[0].rms_jerk.value();
  };
  const double known = figuresOf(tableOf(0.999, 1000.0, reach)).tools[0].rms_jerk.value();
  EXPECT_NEAR(jerk("1764388800.%06d %.17g 0 0\n", 1000, 1.0), known, 1e-3 * known);
  EXPECT_NEAR(jerk("1764388800%09d %.17g 0 0\n", 1000000, 1e-9), known, 1e-3 * known) << "as ROS prints";
  EXPECT_NEAR(jerk("%de-3 %.17g 0 0\n", 1, 1.0), known, 1e-3 * known);
}

TEST_F(MotionTableFile, WhatSpreadsheetsWriteIsRead) {
  write(
      "\"\";\"t_s\";\"note\";\"r_x_m\";\"r_y_m\";\"r_z_m\";\"note\"\r\n"
      "\"1\";0.5;\"a; \"\"b\"\"\";1;2;3;x, y\r\n\"2\";0.6;;4;5;6;\r\n");
  EXPECT_EQ(readMotionTable(path_).tools.at(0).position.at(1), Vector3d(4, 5, 6));
  write("t_s;r_x_m;r_y_m;r_z_m\n0,5;1,5;2;3\n");
  EXPECT_NE(refusal().find("line 2: t_s: 0,5 (allowed: a number with a decimal point)"), std::string::npos)
      << refusal();
}

TEST_F(MotionTableFile, OtherLineEndsAreReadAndOtherEncodingsNamed) {
  write("t_s,r_x_m,r_y_m,r_z_m\r0.5,1,2,3\r0.6,4,5,6\r");
  EXPECT_EQ(readMotionTable(path_).tools.at(0).position.at(1), Vector3d(4, 5, 6));
  write(std::string("\xFF\xFEt\0_\0s\0\n\0", 10));
  EXPECT_NE(refusal().find("file: text in UTF-16 (allowed: text in UTF-8"), std::string::npos) << refusal();
}

TEST(MotionMetrics, FiveIntervalsAreNoGapWhereverTheyLie) {
  for (int at = 190; at < 220; ++at) {  // some of these sums round up
    MotionTable table = tableOf(8.0, 50.0, [](double t) { return Vector3d(0.02 * t, 0, 0); });
    for (double& t : table.time) t = std::stod(std::to_string(t));
    const auto drop = [&](auto& column) { column.erase(column.begin() + at, column.begin() + at + 4); };
    drop(table.time), drop(table.tools[0].position);
    ASSERT_TRUE(figuresOf(table).tools[0].gaps.empty()) << at;
  }
}

TEST(MotionMetrics, TheMedianOfAnEvenNumberLiesBetweenTheMiddleTwo) {
  MotionTable table;
  table.tools.push_back({"r", std::vector<Vector3d>(5, Vector3d::Zero()), {}, {}});
  table.time = {0, 1, 2, 4, 11.6};  // intervals 1 1 2 7.6, median 1.5
  EXPECT_EQ(figuresOf(table).tools[0].gaps.size(), 1U);
}

TEST_F(MotionTableFile, WhatIsRefusedNamesLineFieldAndWhatIsAllowed) {
  const std::string header = "t_s,r_x_m,r_y_m,r_z_m\n0,1,2,3\n";
  const auto has = [](const std::string& text, const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  };
  write(header + "0,1,2,3\n");
  has(refusal(), "line 3: t_s: 0 (allowed: later");
  write(header + "1,1,2\n");
  has(refusal(), "line 3: row: 3 cells (allowed: 4 cells)");
  write(header + "1,1,nan,3\n");
  has(refusal(), "line 3: r_y_m: nan (allowed: a finite number)");
  write(header + "1,1,,3\n");
  has(refusal(), "line 3: r_y_m: nothing");
  write(header + "1,1, 2 2 ,3\n");
  has(refusal(), "line 3: r_y_m: 2 2 (allowed: a finite number)");
  write(header + "1,1,1e300,3\n");
  has(refusal(), "line 3: r_y_m: 1e300 (allowed: -1e6 to 1e6 m");
  write(header + "1e30,1,2,3\n");
  has(refusal(), "line 3: t_s: 1e30 (allowed: -1e10 to 1e10 s");
  write("t_s,r_x_m,r_y_m,r_z_m,r_jaw_rad\n0,1,2,3,1e30\n1,1,2,3,0\n");
  has(refusal(), "line 2: r_jaw_rad: 1e30 (allowed: -1000 to 1000 rad");
  write(header);
  has(refusal(), "1 rows (allowed: 2 or more");
  write("");
  has(refusal(), "0 rows");
  write("t_s,r_x_m,r_y_m\n0,1,2\n");
  has(refusal(), "no r_z_m");
  write("t_s,r_x_m,r_y_m,r_z_m,r_qx\n0,1,2,3,0\n");
  has(refusal(), "1 of its quaternion's columns");
  write("r_x_m,r_y_m,r_z_m\n0,1,2\n");
  has(refusal(), "time: none");
  write("a,b\n0,1\n");
  has(refusal(), "no tool");
  write("t_s,t_s,r_x_m\n");
  has(refusal(), "t_s twice");
  std::string many = "t_s";  // five thousand rows of 300 tools are the most
  for (int i = 0; i < 300; ++i)
    for (const char* axis : {"_x_m", "_y_m", "_z_m"}) many += "," + std::to_string(i) + axis;
  std::string zeros;
  for (int i = 0; i < 900; ++i) zeros += ",0";
  for (int row = 0; row < 5001; ++row) many += "\n" + std::to_string(row) + zeros;
  write(many);
  has(refusal(), "line 5002: file: more rows (allowed: at most 5000 rows of 300 tools)");
  const std::string written = path_;
  for (const char* place : {"/tmp", "/proc/kmsg"}) {  // the second says that it is a file, and never ends
    path_ = place;
    has(refusal(), "(allowed: a file of at most 128 MB with a table of numbers");
  }
  path_ = written;
}

TEST_F(MotionTableFile, ColumnsThatAreNotAllowedAreRefused) {
  for (const char* text : {"", "left", "left=", "left=2", "left=4-2", "left=2-5", "=2-4", "left=0-2",
                           "left=2-4,", "left=2-4,left=5-7", "left=99999-100001", "left=-4"})
    EXPECT_THROW(parseColumns(text), std::invalid_argument) << text;
  EXPECT_EQ(parseColumns("left=2-4,right=9-15").at("right").last, 15U);
}

TEST_F(MotionTableFile, DamagedTablesAreRefusedOrHaveFiniteFigures) {
  std::string good = "t_s,r_x_m,r_y_m,r_z_m,r_qx,r_qy,r_qz,r_qw\n";
  for (int i = 0; i < 40; ++i)
    good += std::to_string(0.01 * i) + ",0." + std::to_string(100 + i) + ",0.2,0.3,0,0,0.1,1\n";
  std::mt19937 random(5);
  int refused = 0, read = 0;
  const int runs = std::getenv("VEST_FULL") != nullptr ? 1'000'000 : 300;
  std::printf("count: %d of 1000000 damaged tables\n", runs);
  for (int run = 0; run < runs; ++run) {
    std::string text = good;
    for (unsigned k = 0; k < 1 + random() % 4; ++k) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0:
          text[at] = static_cast<char>(random());
          break;
        case 1:
          text.erase(at, random() % 60);
          break;
        case 2:
          text.insert(at, text.substr(random() % text.size(), random() % 60));
          break;
        default:
          text.insert(at, std::string(1, "-e.9,\n;# "[random() % 9]));
          break;
      }
    }
    write(text);
    try {
      const Figures f = figuresOf(readMotionTable(path_));
      ++read;
      ASSERT_TRUE(std::isfinite(f.duration) && f.duration >= 0.0) << text;
      ASSERT_TRUE(std::isfinite(f.path)) << text;
      ASSERT_FALSE(nlohmann::json::parse(motion::toJson(f)).is_null());
    } catch (const std::invalid_argument& e) {
      ++refused;
      ASSERT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    }
  }
  EXPECT_GT(refused, runs / 10);
  EXPECT_GT(read, runs / 100);
}

}  // namespace
}  // namespace vest::session
