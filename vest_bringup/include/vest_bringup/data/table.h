#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Geometry>

/// Sessions as tables for other programs (vest_export). No ROS.
namespace vest::data {

/// What a row has of one instrument. World frame, SI.
struct ToolRow {
  bool present = false;
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();                    ///< m, as commanded
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< z along the shaft
  double jaw = 0;                                                   ///< rad
  int tool = 0;                                                     ///< vest_msgs/InstrumentState.TOOL_*
  std::uint32_t functions = 0;                                      ///< bits of FUNCTION_*
  Eigen::Vector3d force = Eigen::Vector3d::Zero();                  ///< N, of the tissue on the tip
  bool grasping = false;                                            ///< jaws hold tissue
  double pinch = 0;                                                 ///< N
};

struct Row {
  std::uint64_t step = 0;
  double time = 0;               ///< s, simulated
  std::array<ToolRow, 4> tools;  ///< left, right, third, endoscope
  double score = 0;              ///< 0 … 1, where an exercise was done
  std::uint64_t state_hash = 0;  ///< of the tissue
};

struct EventRow {
  double time = 0;  ///< s, simulated
  std::string text;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, world
  double station = 0, energy = 0;                      ///< m; J; NaN where there is none
};

/// Rows at one rate of a stretch without a jump: a reset, another scene or a restored snapshot begins the
/// next one.
struct Episode {
  std::string name, session, scene, scene_hash, exercise;
  std::string aim;                ///< what the exercise asks for, in words; empty: no exercise
  double rate = 0;                ///< Hz
  bool valid = false;             ///< for validation, not for training
  std::size_t first_picture = 0;  ///< of the pictures of all episodes
  std::vector<Row> rows;
  std::vector<EventRow> events;
  std::size_t left_out = 0;  ///< rows before and after those

  /// A recording begins before its instruments are heard, and may end after them. Leaves out rows of both
  /// ends until those instruments are there that are in at least half of all rows.
  void leaveOutEnds();

  /// Whether an instrument is there in all rows: those that are not have no columns.
  bool has(std::size_t instrument) const;
};

inline constexpr std::array<const char*, 4> kInstruments{"left", "right", "third", "endoscope"};
inline constexpr std::size_t kHands = 3;

/// A number per row, or a few.
struct Column {
  std::string name, unit, meaning;
  std::size_t width = 1;
};
/// Columns of an instrument, and the numbers of a row in their order.
const std::vector<Column>& columnsOf(std::size_t instrument);
void values(const ToolRow& row, std::size_t instrument, std::vector<double>& to);
/// Names of these numbers in tables: "right_x_m", "right_y_m" …
std::vector<std::string> csvColumnsOf(std::size_t instrument);

/// Numbers of an action of one hand, each in [−1, 1], as of vest.make(): motion of the tip in world x, y, z
/// (1: 2 mm in 20 ms), turn about the shaft and of the jaw (0.1 rad in 20 ms), functions (on 1, off −1).
inline constexpr std::size_t kActionSize = 6;
/// @return whether a number was beyond [−1, 1], and is cut off
bool action(const ToolRow& from, const ToolRow& to, double rate, float* numbers);

// Samples for learning: each of R rows but the last one, with the action that leads to the next row.

/// Hands that are in all rows of all episodes: they act. @throws std::invalid_argument where there is none
std::vector<std::size_t> handsInAll(const std::vector<Episode>& episodes);
/// Those, and the endoscope where it is in all rows: what is observed.
std::vector<std::size_t> seenInAll(const std::vector<Episode>& episodes);
/// @throws std::invalid_argument where an episode has fewer than 2 rows
void checkSamples(const Episode& episode);
/// Of row k. @param numbers kActionSize per hand  @return whether one was beyond [−1, 1], and is cut off
bool actionsAt(const Episode& episode, std::size_t k, const std::vector<std::size_t>& hands, float* numbers);

/// A table that vest_metrics reads, and another one with the events.
std::string toCsv(const Episode& episode);
std::string eventsToCsv(const Episode& episode);

}  // namespace vest::data
