#include "vest_bringup/ros/bag_writer.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cstdio>
#include <stdexcept>

namespace vest::session {
namespace {

constexpr std::uint32_t kChunk = 768 * 1024;  // bytes, as stock rosbag
constexpr std::size_t kProgressBytes = 2 * sizeof(std::uint64_t);

}  // namespace

BagWriter::BagWriter(const std::string& file, std::uint64_t min_free) : file_(file), min_free_(min_free) {
  try {
    bag_.open(file_ + ".active", rosbag::bagmode::Write);
  } catch (const rosbag::BagException& e) {
    throw std::runtime_error(file_ + ".active: cannot be written (" + e.what() + ")");
  }
  open_ = true;
  bag_.setChunkThreshold(kChunk);
  const int fd = ::open((file_ + ".progress").c_str(), O_RDWR | O_CREAT | O_TRUNC, 0666);
  if (fd >= 0) {
    if (ftruncate(fd, kProgressBytes) == 0) {
      void* map = mmap(nullptr, kProgressBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
      if (map != MAP_FAILED) progress_ = static_cast<std::uint64_t*>(map);
    }
    ::close(fd);
  }
}

BagWriter::~BagWriter() {
  try {
    close();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s: %s\n", file_.c_str(), e.what());
  }
  if (progress_) munmap(progress_, kProgressBytes);
}

void BagWriter::received() {
  if (progress_) ++progress_[0];
}

bool BagWriter::write(const std::string& topic, const ros::Time& time, const topic_tools::ShapeShifter& msg,
                      const boost::shared_ptr<ros::M_string>& header) {
  if (!open_) return false;
  try {
    bag_.write(topic, time, msg, header);
  } catch (const rosbag::BagException&) {
    disk_full_ = true;
    closeWhatCanBe();
    return false;
  }
  if (single_) {  // the chunk that this message filled has closed itself and emptied rosbag's buffer
    single_ = false;
    bag_.setChunkThreshold(kChunk);
  }
  chunk_dirty_ = true;
  if (progress_) ++progress_[1];
  return true;
}

void BagWriter::closeChunk() {
  if (!open_ || !chunk_dirty_) return;
  // A new threshold closes the open chunk, but leaves rosbag's copy of it in memory; a threshold of one byte
  // lets the next message close a chunk of its own in the way that frees the copy too.
  bag_.setChunkThreshold(1);
  single_ = true;
  chunk_dirty_ = false;
  std::fflush(nullptr);
}

bool BagWriter::checkDisk() {
  if (disk_full_) return false;
  struct statvfs fs {};
  if (open_ && statvfs((file_ + ".active").c_str(), &fs) == 0 &&
      static_cast<std::uint64_t>(fs.f_bavail) * fs.f_frsize < min_free_) {
    disk_full_ = true;
    closeWhatCanBe();
  }
  return !disk_full_;
}

void BagWriter::closeWhatCanBe() {
  try {
    close();
  } catch (const std::exception& e) {  // no room for the index: FILE.active stays, for the recovery tool
    std::fprintf(stderr, "%s.active: not closed (%s); vest_recover_bag makes a bag of it\n", file_.c_str(),
                 e.what());
  }
}

std::uint64_t BagWriter::bytes() const {
  return open_ ? bag_.getSize() : bytes_;
}

void BagWriter::close() {
  if (!open_) return;
  open_ = false;
  bytes_ = bag_.getSize();
  bag_.close();
  if (std::rename((file_ + ".active").c_str(), file_.c_str()) != 0) {
    throw std::runtime_error(file_ + ": cannot be renamed from " + file_ + ".active");
  }
  std::remove((file_ + ".progress").c_str());
}

}  // namespace vest::session
