#pragma once

#include <cstdint>
#include <string>

namespace vest::session {

/// Format 2.0 of bags as the ROS wiki's "Bags/Format/2.0" describes it. Little endian, as every machine that
/// ROS 1 runs on.
inline constexpr char kBagMagic[] = "#ROSBAG V2.0\n";
inline constexpr std::size_t kBagMagicSize = sizeof kBagMagic - 1;

/// Kinds of records.
enum class Op : std::uint8_t {
  Message = 2,
  BagHeader = 3,
  Index = 4,
  Chunk = 5,
  ChunkInfo = 6,
  Connection = 7
};

/// Whether a topic, or a file's name, ends so.
inline bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

}  // namespace vest::session
