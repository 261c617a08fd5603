#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace vest::session {

/// Who wrote which topic, as the bag says. `fields` is the whole header of the connection.
struct BagConnection {
  std::string topic, type, md5sum, definition;
  std::map<std::string, std::string> fields;
};

/// A message where it lies in the bag; valid while the callback runs.
struct BagMessage {
  const BagConnection& connection;
  std::uint32_t seconds, nanoseconds;  ///< when it was recorded
  const std::uint8_t* data;            ///< serialised
  std::uint32_t size;                  ///< bytes
  double time() const { return seconds + 1e-9 * nanoseconds; }
};

/// Reads a bag (format 2.0, http://wiki.ros.org/Bags/Format/2.0) from its beginning to its end, in the order
/// in which it was written. Believes nothing that the file says: every size is compared with what is there
/// before memory is asked for, the index at the end is not needed. Why not rosbag::Bag:
/// docs/decisions/0004-files-are-read-strictly.md.
class BagReader {
 public:
  using Callback = std::function<void(const BagMessage&)>;

  /// What could be read of a bag that is not whole.
  struct Salvage {
    std::uint64_t kept = 0;
    std::uint64_t damaged = 0;  ///< places where something is missing or cannot be read
  };

  /// @throws std::invalid_argument naming the file: cannot be read, no regular file, no bag
  explicit BagReader(const std::string& file);
  ~BagReader();
  BagReader(const BagReader&) = delete;
  BagReader& operator=(const BagReader&) = delete;

  /// Every message. May be called again. @throws std::invalid_argument naming file and byte at the first
  /// record that cannot be, and where the bag was not closed; what the callback throws
  void read(const Callback& callback);
  /// Every message that is whole, also behind damaged places.
  Salvage salvage(const Callback& callback);

  const std::string& file() const { return file_; }

 private:
  struct Record;
  enum class Found { Record, End, Damage };
  Found record(std::uint64_t at, Record& record) const;
  bool get(std::uint64_t at, std::size_t size, std::vector<std::uint8_t>& to) const;
  std::uint64_t walk(const Callback& callback, Salvage* salvage);
  bool chunk(const Record& record, const Callback& callback, Salvage* salvage);
  bool inChunk(const std::uint8_t* data, std::size_t size, const Callback& callback, Salvage* salvage);
  bool connect(const std::map<std::string, std::string>& header, const std::uint8_t* data, std::size_t size);
  /// First byte from `at` on at which a chunk may begin; the file's end where there is none.
  std::uint64_t nextChunk(std::uint64_t at) const;
  [[noreturn]] void refuse(std::uint64_t at, const std::string& what) const;

  std::string file_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  std::map<std::uint32_t, BagConnection> connections_;
  std::vector<std::uint8_t> raw_, unpacked_;
  std::uint64_t spent_ = 0;  ///< bytes of chunks, read and unpacked
  std::string problem_;      ///< of the last thing that was not right
};

}  // namespace vest::session
