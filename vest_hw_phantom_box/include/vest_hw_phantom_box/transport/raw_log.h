// What came over a line, byte by byte, with the times at which it came.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

namespace vest::transport {

/// One reading of the line.
struct RawPiece {
  std::int64_t time_ns = 0;  ///< since the first piece
  std::size_t first = 0;     ///< of its bytes in the file's
  std::uint32_t size = 0;
};

/// What a log holds, without a copy of each piece.
struct RawRecording {
  std::string file;  ///< its bytes
  std::vector<RawPiece> pieces;
};

/// File: the line "VEST raw bytes 1", then for each piece 8 bytes time_ns, 4 bytes size, and the bytes;
/// numbers little-endian. A last piece that is cut off is left out by the reader.
class RawLog {
 public:
  /// Empty on success, else what is wrong. An older file of this name is replaced.
  std::string open(const std::string& path);
  bool isOpen() const { return out_.is_open(); }
  /// @param now_ns steady time. False: it could not be written (disk full); the log is closed then.
  bool write(std::int64_t now_ns, const std::uint8_t* bytes, std::size_t size);

 private:
  std::ofstream out_;
  std::int64_t first_ns_ = -1;
};

/// A regular file of at most 512 MiB and 8,000,000 pieces. @throws std::runtime_error with file, what is
/// wrong, what is allowed
RawRecording readRawLog(const std::string& path);

}  // namespace vest::transport
