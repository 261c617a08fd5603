#pragma once

#include <cstdint>
#include <string>

#include <ros/time.h>
#include <rosbag/bag.h>
#include <topic_tools/shape_shifter.h>
#include <boost/shared_ptr.hpp>

namespace vest::session {

/// A bag that loses next to nothing when its process is killed: chunks are closed several times a second
/// (safety.md). While open it is FILE.active; beside it FILE.progress counts what was received, for the
/// recovery tool.
class BagWriter {
 public:
  /// @param min_free bytes that the disk must keep free  @throws std::runtime_error naming the file
  BagWriter(const std::string& file, std::uint64_t min_free);
  ~BagWriter();

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
  void close();

  bool isOpen() const { return open_; }
  bool diskFull() const { return disk_full_; }
  std::uint64_t bytes() const;

 private:
  void closeWhatCanBe();

  std::string file_;
  std::uint64_t min_free_;
  rosbag::Bag bag_;
  bool open_ = false, disk_full_ = false, chunk_dirty_ = false, single_ = false;
  std::uint64_t bytes_ = 0;
  std::uint64_t* progress_ = nullptr;  ///< mapped file: received, written
};

}  // namespace vest::session
