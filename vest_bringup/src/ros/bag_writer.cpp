#include "vest_bringup/ros/bag_writer.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include <roslz4/lz4s.h>

#include "vest_bringup/ros/bag_format.h"

namespace vest::session {
namespace {

constexpr std::size_t kHeaderBytes = 2 * sizeof(std::uint32_t) + 4096;  // of the bag header's record
constexpr std::size_t kChunkBytes = 768 * 1024;                         // bytes, as stock rosbag
constexpr std::size_t kSpill = 64 * 1024;                               // bytes of the index in memory
constexpr std::size_t kProgressBytes = 2 * sizeof(std::uint64_t);

bool writeAll(int descriptor, const std::uint8_t* bytes, std::size_t size, std::uint64_t at) {
  for (std::size_t done = 0; done < size;) {
    const ssize_t n = pwrite(descriptor, bytes + done, size - done, static_cast<off_t>(at + done));
    if (n < 0 && errno == EINTR) continue;
    if (n == 0) errno = ENOSPC;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

/// In the place of what stands there; a link that does is not followed. -1 where there can be none.
int newFile(const std::string& name, mode_t mode) {
  ::unlink(name.c_str());
  return ::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
}

/// A file without a name in the folder of `beside`; -1 where there can be none.
int namelessFile(const std::string& beside) {
  const std::string folder = beside.substr(0, beside.find_last_of('/') + 1);
  const int fd = ::open(folder.empty() ? "." : folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd >= 0) return fd;
  // Not every file system has such files.
  const std::string name = beside + ".index";
  const int named = newFile(name, 0600);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

/// Appends little-endian values and the fields of record headers.
class Writer {
 public:
  explicit Writer(std::vector<std::uint8_t>& to) : to_(to) {}

  void bytes(const void* data, std::size_t size) {
    const auto* begin = static_cast<const std::uint8_t*>(data);
    to_.insert(to_.end(), begin, begin + size);
  }
  template <class T>
  void value(const T& v) {
    bytes(&v, sizeof v);
  }
  void value(const ros::Time& time) {
    value(time.sec);
    value(time.nsec);
  }
  /// Begins a block that is preceded by its length.
  std::size_t open() {
    value(std::uint32_t{0});
    return to_.size();
  }
  void close(std::size_t begin) {
    const auto size = static_cast<std::uint32_t>(to_.size() - begin);
    std::memcpy(to_.data() + begin - sizeof size, &size, sizeof size);
  }
  void field(const char* name, const std::string& text) {
    const std::size_t begin = open();
    bytes(name, std::strlen(name));
    bytes("=", 1);
    bytes(text.data(), text.size());
    close(begin);
  }
  template <class T>
  void field(const char* name, const T& v) {
    const std::size_t begin = open();
    bytes(name, std::strlen(name));
    bytes("=", 1);
    value(v);
    close(begin);
  }

 private:
  std::vector<std::uint8_t>& to_;
};

}  // namespace

BagWriter::BagWriter(const std::string& file, std::uint64_t min_free) : file_(file), min_free_(min_free) {
  descriptor_ = newFile(file_ + ".active", 0666);
  Bytes start(kBagMagic, kBagMagic + kBagMagicSize);
  const Bytes header = bagHeader(0);
  start.insert(start.end(), header.begin(), header.end());
  if (descriptor_ < 0 || !append(start)) {
    const std::string why = std::strerror(errno);
    if (descriptor_ >= 0) ::close(descriptor_);
    throw std::runtime_error(file_ + ".active: cannot be written (" + why + ")");
  }
  flock(descriptor_, LOCK_EX | LOCK_NB);  // the recovery tool leaves a bag alone that is being written
  open_ = true;
  index_file_ = namelessFile(file_);
  const int fd = newFile(file_ + ".progress", 0666);
  if (fd >= 0) {
    if (ftruncate(fd, kProgressBytes) == 0) {
      void* map = mmap(nullptr, kProgressBytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
      if (map != MAP_FAILED) progress_ = static_cast<std::uint64_t*>(map);
    }
    ::close(fd);
  }
}

BagWriter::~BagWriter() {
  closeWhatCanBe();
  if (index_file_ >= 0) ::close(index_file_);
  if (progress_) munmap(progress_, kProgressBytes);
}

void BagWriter::received() {
  if (progress_) ++progress_[0];
}

BagWriter::Bytes BagWriter::bagHeader(std::uint64_t index_position) const {
  Bytes record;
  Writer out(record);
  const std::size_t header = out.open();
  out.field("op", Op::BagHeader);
  out.field("index_pos", index_position);
  out.field("conn_count", static_cast<std::uint32_t>(connections_.size()));
  out.field("chunk_count", chunk_count_);
  out.close(header);
  const std::size_t padding = out.open();
  record.resize(kHeaderBytes, ' ');  // room that a rewritten header fills again
  out.close(padding);
  return record;
}

std::uint32_t BagWriter::connection(const std::string& topic, const topic_tools::ShapeShifter& msg,
                                    const boost::shared_ptr<ros::M_string>& header) {
  std::string key = topic + "\n" + msg.getMD5Sum();  // two publishers may disagree on a topic's type
  if (header) {
    const auto caller = header->find("callerid");
    key += "\nlatched by " + (caller == header->end() ? std::string() : caller->second);
  }
  const auto [found, is_new] = by_topic_.try_emplace(key, static_cast<std::uint32_t>(connections_.size()));
  if (!is_new) return found->second;
  Bytes record;
  Writer out(record);
  const std::size_t fields = out.open();
  out.field("op", Op::Connection);
  out.field("conn", found->second);
  out.field("topic", topic);
  out.close(fields);
  ros::M_string data;
  if (header) data = *header;
  data["topic"] = topic;
  data["type"] = msg.getDataType();
  data["md5sum"] = msg.getMD5Sum();
  data["message_definition"] = msg.getMessageDefinition();
  const std::size_t content = out.open();
  for (const auto& [name, value] : data) out.field(name.c_str(), value);
  out.close(content);
  chunk_.insert(chunk_.end(), record.begin(), record.end());
  connections_.push_back(std::move(record));
  index_.emplace_back();
  return found->second;
}

bool BagWriter::write(const std::string& topic, const ros::Time& time, const topic_tools::ShapeShifter& msg,
                      const boost::shared_ptr<ros::M_string>& header) {
  if (!open_) return false;
  const std::uint32_t id = connection(topic, msg, header);
  const bool first = std::all_of(index_.begin(), index_.end(), [](const auto& e) { return e.empty(); });
  begin_ = first ? time : std::min(begin_, time);
  end_ = first ? time : std::max(end_, time);
  index_[id].push_back({time, static_cast<std::uint32_t>(chunk_.size())});
  Writer out(chunk_);
  const std::size_t fields = out.open();
  out.field("op", Op::Message);
  out.field("conn", id);
  out.field("time", time);
  out.close(fields);
  const std::uint32_t size = msg.size();
  out.value(size);
  chunk_.resize(chunk_.size() + size);
  ros::serialization::OStream stream(chunk_.data() + chunk_.size() - size, size);
  msg.write(stream);
  if (progress_) ++progress_[1];
  if (chunk_.size() >= kChunkBytes) closeChunk();
  return open_;
}

bool BagWriter::append(const Bytes& bytes) {
  if (!writeAll(descriptor_, bytes.data(), bytes.size(), size_)) {
    const int why = errno;
    if (ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) {
      // What stays behind the last whole chunk, no reader looks at.
    }
    errno = why;
    return false;
  }
  size_ += bytes.size();
  return true;
}

bool BagWriter::pack() {
  constexpr int kBlock = 6;  // 1 MB, as stock rosbag
  // roslz4 asks for as much room as bytes that cannot be compressed would take: 4 for each block, 15 around
  // all.
  packed_.resize(chunk_.size() + 4 * (chunk_.size() >> 20U) + 32);
  auto size = static_cast<unsigned int>(packed_.size());
  if (roslz4_buffToBuffCompress(reinterpret_cast<char*>(chunk_.data()),
                                static_cast<unsigned int>(chunk_.size()),
                                reinterpret_cast<char*>(packed_.data()), &size, kBlock) != ROSLZ4_OK)
    return false;
  packed_.resize(size);
  return true;
}

void BagWriter::closeChunk() {
  if (!open_ || chunk_.empty()) return;
  Bytes record;
  record.reserve(chunk_.size() + chunk_.size() / 4);
  Writer out(record);
  const std::size_t fields = out.open();
  out.field("op", Op::Chunk);
  const bool packed = pack();
  const Bytes& content = packed ? packed_ : chunk_;
  out.field("compression", std::string(packed ? "lz4" : "none"));
  out.field("size", static_cast<std::uint32_t>(chunk_.size()));
  out.close(fields);
  const std::size_t data = out.open();
  out.bytes(content.data(), content.size());
  out.close(data);
  const std::size_t described = newest_infos_.size();
  describeChunk(size_);
  for (std::uint32_t id = 0; id < index_.size(); ++id) {
    if (index_[id].empty()) continue;
    const auto count = static_cast<std::uint32_t>(index_[id].size());
    const std::size_t header = out.open();
    out.field("op", Op::Index);
    out.field("ver", std::uint32_t{1});
    out.field("conn", id);
    out.field("count", count);
    out.close(header);
    const std::size_t entries = out.open();
    for (const Entry& entry : index_[id]) {
      out.value(entry.time);
      out.value(entry.offset);
    }
    out.close(entries);
    index_[id].clear();
  }
  chunk_.clear();
  if (!append(record)) {
    newest_infos_.resize(described);
    disk_full_ = true;
    closeWhatCanBe();
    return;
  }
  ++chunk_count_;
  if (newest_infos_.size() >= kSpill && index_file_ >= 0 &&
      writeAll(index_file_, newest_infos_.data(), newest_infos_.size(), index_file_size_)) {
    index_file_size_ += newest_infos_.size();
    newest_infos_.clear();
  }
}

void BagWriter::describeChunk(std::uint64_t position) {
  Writer out(newest_infos_);
  const auto topics = std::count_if(index_.begin(), index_.end(), [](const auto& e) { return !e.empty(); });
  const std::size_t fields = out.open();
  out.field("op", Op::ChunkInfo);
  out.field("ver", std::uint32_t{1});
  out.field("chunk_pos", position);
  out.field("start_time", begin_);
  out.field("end_time", end_);
  out.field("count", static_cast<std::uint32_t>(topics));
  out.close(fields);
  const std::size_t counts = out.open();
  for (std::uint32_t id = 0; id < index_.size(); ++id) {
    if (index_[id].empty()) continue;
    out.value(id);
    out.value(static_cast<std::uint32_t>(index_[id].size()));
  }
  out.close(counts);
}

bool BagWriter::checkDisk() {
  if (disk_full_) return false;
  struct statvfs fs {};
  if (open_ && statvfs((file_ + ".active").c_str(), &fs) == 0) {
    const std::uint64_t free = static_cast<std::uint64_t>(fs.f_bavail) * fs.f_frsize;
    if (free < min_free_ || free - min_free_ < index_file_size_ + newest_infos_.size()) {
      disk_full_ = true;
      closeWhatCanBe();
    }
  }
  return !disk_full_;
}

void BagWriter::closeWhatCanBe() {
  try {
    close();
  } catch (const std::exception& e) {  // no room for the index: FILE.active stays, for the recovery tool
    std::fprintf(stderr, "%s; vest_recover_bag makes a bag of %s.active\n", e.what(), file_.c_str());
  }
}

std::uint64_t BagWriter::bytes() const {
  return size_ + chunk_.size();
}

bool BagWriter::appendIndex() {
  Bytes piece;
  for (std::uint64_t at = 0; at < index_file_size_;) {
    piece.resize(std::min<std::uint64_t>(index_file_size_ - at, 1U << 20U));
    const ssize_t n = pread(index_file_, piece.data(), piece.size(), static_cast<off_t>(at));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    piece.resize(static_cast<std::size_t>(n));
    if (!append(piece)) return false;
    at += piece.size();
  }
  return append(newest_infos_);
}

void BagWriter::close() {
  if (!open_) return;
  closeChunk();
  if (!open_) return;  // the disk was full, and this was called again from within
  open_ = false;
  Bytes tail;
  Writer out(tail);
  for (const Bytes& record : connections_) out.bytes(record.data(), record.size());
  const std::uint64_t index_position = size_;
  const bool indexed = append(tail) && appendIndex();
  const Bytes header = bagHeader(index_position);
  const bool named = indexed && pwrite(descriptor_, header.data(), header.size(), kBagMagicSize) ==
                                    static_cast<ssize_t>(header.size());
  ::close(descriptor_);
  if (!named) throw std::runtime_error(file_ + ".active: not closed, no room for its index");
  if (std::rename((file_ + ".active").c_str(), file_.c_str()) != 0) {
    throw std::runtime_error(file_ + ": cannot be renamed from " + file_ + ".active");
  }
  std::remove((file_ + ".progress").c_str());
}

}  // namespace vest::session
