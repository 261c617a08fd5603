#pragma once

#include <string>
#include <vector>

#include "vest_bringup/data/table.h"

namespace vest::data {

/// A Python that has LeRobot. Its own writer makes the files; scripts/lerobot_writer.py calls it.
class LeRobot {
 public:
  /// @param python program, looked up on PATH  @param writer lerobot_writer.py  @param work folder for what
  /// is not kept, there  @throws std::invalid_argument saying what to install
  LeRobot(std::string python, std::string writer, std::string work);

  /// Writes a data set of format 3 and reads it back. Each of R rows of an episode but the last one is a
  /// frame.
  /// @param root folder, not there yet  @param name of the data set
  /// @param pictures files of all episodes' rows, one after another; empty: none  @param height, width pixels
  /// @throws std::invalid_argument as writeHdf5(), or where the rate is no whole number; std::runtime_error
  /// with LeRobot's words
  void write(const std::string& root, const std::string& name, const std::vector<Episode>& episodes,
             const std::vector<std::string>& pictures, int height, int width);

  const std::string& version() const { return version_; }  ///< of LeRobot
  const std::string& format() const { return format_; }    ///< of what was written: "v3.0"
  std::size_t beyond() const { return beyond_; }           ///< frames with an action beyond [−1, 1]

 private:
  std::string ask(const std::string& request);

  std::string python_, writer_, work_, version_, format_;
  std::size_t beyond_ = 0;
};

}  // namespace vest::data
