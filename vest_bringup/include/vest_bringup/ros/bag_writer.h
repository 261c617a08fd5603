#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <ros/datatypes.h>
#include <ros/time.h>
#include <topic_tools/shape_shifter.h>
#include <boost/shared_ptr.hpp>

namespace vest::session {

/// A bag (format 2.0, indexed, its chunks compressed with LZ4 as stock rosbag does it) that loses next to
/// nothing when its process is killed: chunks are closed several times a second, each with one
/// write. While open it is FILE.active; beside it FILE.progress counts what was received, for the recovery
/// tool. Why not rosbag::Bag: docs/decisions/0003-recording.md.
class BagWriter {
 public:
  /// @param min_free bytes that the disk must keep free  @throws std::runtime_error naming the file
  BagWriter(const std::string& file, std::uint64_t min_free);
  ~BagWriter();
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  /// @param header connection header, kept where the connection is latched; may be null
  /// @return false once the bag is closed
  bool write(const std::string& topic, const ros::Time& time, const topic_tools::ShapeShifter& msg,
             const boost::shared_ptr<ros::M_string>& header);
  /// A message arrived and waits to be written: what a killed recorder lost is known afterwards.
  void received();
  /// Closes the chunk and hands it to the operating system. Call every 250 ms.
  void closeChunk();
  /// Closes the bag, valid, if the disk is nearly full. Call every second. @return false once closed for that
  bool checkDisk();
  /// Index, rename to FILE. Idempotent.
  /// @throws std::runtime_error naming the file, where there is no room for the index
  void close();

  bool isOpen() const { return open_; }
  bool diskFull() const { return disk_full_; }
  /// Bytes of the file, with the chunk that is open.
  std::uint64_t bytes() const;

 private:
  using Bytes = std::vector<std::uint8_t>;
  struct Entry {
    ros::Time time;
    std::uint32_t offset;  ///< of the message's record in its chunk
  };

  std::uint32_t connection(const std::string& topic, const topic_tools::ShapeShifter& msg,
                           const boost::shared_ptr<ros::M_string>& header);
  Bytes bagHeader(std::uint64_t index_position) const;
  /// All or nothing, at the end of the file.
  bool append(const Bytes& bytes);
  /// False: it would not get smaller.
  bool pack();
  /// What the bag's index will say of the open chunk, which begins at a byte of the file.
  void describeChunk(std::uint64_t position);
  bool appendIndex();
  void closeWhatCanBe();

  std::string file_;
  std::uint64_t min_free_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
  bool open_ = false, disk_full_ = false;
  std::map<std::string, std::uint32_t> by_topic_;  ///< topic, for latched ones with who latched it
  std::vector<Bytes> connections_;                 ///< whole records
  Bytes chunk_;                                    ///< records of the open chunk
  Bytes packed_;                                   ///< likewise, compressed
  std::vector<std::vector<Entry>> index_;          ///< of the open chunk, by connection
  ros::Time begin_, end_;                          ///< of the open chunk
  // Records of closed chunks, which come to the end of the bag: in a file without a name, because eight hours
  // of them are 50 MB; the newest, and all where there can be no such file, in memory.
  std::uint32_t chunk_count_ = 0;
  int index_file_ = -1;
  std::uint64_t index_file_size_ = 0;
  Bytes newest_infos_;
  std::uint64_t* progress_ = nullptr;  ///< mapped file: received, written
};

}  // namespace vest::session
