#include "vest_bringup/ros/bag_reader.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include <bzlib.h>
#include <roslz4/lz4s.h>

#include "vest_bringup/ros/bag_format.h"
#include "vest_instruments/files/read.h"

namespace vest::session {
namespace {

// Limits are assumed. The largest header is a connection's: a message definition.
constexpr std::uint32_t kMostHeader = 1U << 20U;
constexpr std::uint32_t kMostChunk = 256U << 20U;
constexpr std::uint32_t kMostFolds =
    100;  ///< of the file's size, in its chunks: beyond what sessions pack to
constexpr std::uint32_t kMostChunkHeader = 1024;  ///< four short fields (a damaged file may name more)
constexpr std::size_t kMostConnections = 65536;

std::uint32_t littleEndian(const std::uint8_t* bytes) {
  std::uint32_t value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

using Fields = std::map<std::string, std::string>;

/// Fields of a header: name=value, each behind its length. False where lengths and names do not fit.
bool readFields(const std::uint8_t* data, std::size_t size, Fields& fields) {
  fields.clear();
  std::size_t at = 0;
  while (at < size) {
    if (size - at < 4) return false;
    const std::uint32_t length = littleEndian(data + at);
    at += 4;
    if (length > size - at) return false;
    const auto* begin = reinterpret_cast<const char*>(data + at);
    const auto* equals = static_cast<const char*>(std::memchr(begin, '=', length));
    if (equals == nullptr || equals == begin) return false;
    fields[std::string(begin, equals)] = std::string(equals + 1, begin + length);
    at += length;
  }
  return true;
}

/// A number of so many bytes. False where the field is missing or of another size.
bool number(const Fields& fields, const char* name, std::size_t size, std::uint64_t& value) {
  const auto field = fields.find(name);
  if (field == fields.end() || field->second.size() != size) return false;
  value = 0;
  std::memcpy(&value, field->second.data(), size);
  return true;
}

bool unpack(const std::string& compression, std::vector<std::uint8_t>& packed, std::uint32_t size,
            std::vector<std::uint8_t>& to) {
  // LZ4 makes at most 255 bytes of one, bzip2 900 kB of some 40.
  const std::uint64_t most =
      compression == "lz4" ? 256ULL * packed.size() + 1024 : 25000ULL * packed.size() + 1024;
  if (size > most) return false;
  to.resize(size);
  unsigned int got = size;
  auto* const from = reinterpret_cast<char*>(packed.data());
  auto* const target = reinterpret_cast<char*>(to.data());
  if (compression == "lz4")
    return roslz4_buffToBuffDecompress(from, static_cast<unsigned int>(packed.size()), target, &got) ==
               ROSLZ4_OK &&
           got == size;
  return BZ2_bzBuffToBuffDecompress(target, &got, from, static_cast<unsigned int>(packed.size()), 0, 0) ==
             BZ_OK &&
         got == size;
}

}  // namespace

/// A record as it lies in the file: header's fields, and where its data are.
struct BagReader::Record {
  Fields fields;
  std::uint64_t begin = 0, data = 0;  ///< bytes from the file's beginning
  std::uint32_t size = 0;             ///< bytes that the data claim
  std::uint8_t op = 0;
  bool is(Op kind) const { return op == static_cast<std::uint8_t>(kind); }
};

BagReader::BagReader(const std::string& file) : file_(file) {
  descriptor_ = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);  // a pipe must not hold us
  struct stat status {};
  if (descriptor_ < 0 || fstat(descriptor_, &status) != 0) {
    const std::string why = std::strerror(errno);
    if (descriptor_ >= 0) ::close(descriptor_);
    throw std::invalid_argument(file_ + ": cannot be read (" + why + ")");
  }
  size_ = static_cast<std::uint64_t>(status.st_size);
  std::vector<std::uint8_t> begin;
  const bool bag = S_ISREG(status.st_mode) && get(0, kBagMagicSize, begin) &&
                   std::memcmp(begin.data(), kBagMagic, kBagMagicSize) == 0;
  if (!bag) {
    ::close(descriptor_);
    throw std::invalid_argument(file_ + ": not a bag (a bag is a file that begins with #ROSBAG V2.0)");
  }
}

BagReader::~BagReader() {
  ::close(descriptor_);
}

void BagReader::refuse(std::uint64_t at, const std::string& what) const {
  throw std::invalid_argument(file_ + ": byte " + std::to_string(at) + ": " + files::shown(what, 6000));
}

bool BagReader::get(std::uint64_t at, std::size_t size, std::vector<std::uint8_t>& to) const {
  if (at > size_ || size > size_ - at) return false;
  to.resize(size);
  for (std::size_t done = 0; done < size;) {
    const ssize_t n = pread(descriptor_, to.data() + done, size - done, static_cast<off_t>(at + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    done += static_cast<std::size_t>(n);
  }
  return true;
}

BagReader::Found BagReader::record(std::uint64_t at, Record& record) const {
  if (at == size_) return Found::End;
  std::vector<std::uint8_t> bytes;
  record.begin = at;
  if (!get(at, 4, bytes)) return Found::Damage;
  const std::uint32_t header = littleEndian(bytes.data());
  if (header > kMostHeader || !get(at + 4, header, bytes)) return Found::Damage;
  if (!readFields(bytes.data(), bytes.size(), record.fields)) return Found::Damage;
  std::uint64_t op = 0;
  if (!number(record.fields, "op", 1, op)) return Found::Damage;
  record.op = static_cast<std::uint8_t>(op);
  if (!get(at + 4 + header, 4, bytes)) return Found::Damage;
  record.size = littleEndian(bytes.data());
  record.data = at + 8 + header;
  return Found::Record;
}

bool BagReader::connect(const Fields& header, const std::uint8_t* data, std::size_t size) {
  std::uint64_t id = 0;
  const auto topic = header.find("topic");
  if (!number(header, "conn", 4, id) || topic == header.end()) {
    problem_ = "a connection without number or topic";
    return false;
  }
  BagConnection connection;
  if (!readFields(data, size, connection.fields)) {
    problem_ = "connection of " + topic->second + ": its fields do not fit";
    return false;
  }
  for (const char* needed : {"type", "md5sum", "message_definition"}) {
    if (connection.fields.count(needed) > 0) continue;
    problem_ = "connection of " + topic->second + " has no " + needed;
    return false;
  }
  connection.topic = topic->second;
  connection.type = connection.fields["type"];
  connection.md5sum = connection.fields["md5sum"];
  connection.definition = connection.fields["message_definition"];
  if (connections_.size() >= kMostConnections) {
    problem_ = "more than " + std::to_string(kMostConnections) + " connections";
    return false;
  }
  connections_.emplace(static_cast<std::uint32_t>(id), std::move(connection));  // the first one holds
  return true;
}

bool BagReader::inChunk(const std::uint8_t* data, std::size_t size, const Callback& callback,
                        Salvage* salvage) {
  bool whole = true;
  const auto damage = [&](const std::string& what) {
    problem_ = what;
    whole = false;
    if (salvage) ++salvage->damaged;
  };
  Fields fields;
  for (std::size_t at = 0; at < size && (whole || salvage);) {
    const std::size_t left = size - at;
    const std::uint32_t header = left < 8 ? 0 : littleEndian(data + at);
    if (left < 8 || header > left - 8) return damage("a record goes beyond its chunk"), false;
    const std::uint32_t length = littleEndian(data + at + 4 + header);
    if (length > left - 8 - header) return damage("a record goes beyond its chunk"), false;
    const std::uint8_t* const content = data + at + 8 + header;
    std::uint64_t op = 0, id = 0, time = 0;
    if (!readFields(data + at + 4, header, fields) || !number(fields, "op", 1, op)) {
      damage("the header of a record cannot be read");
    } else if (op == static_cast<std::uint8_t>(Op::Connection)) {
      if (!connect(fields, content, length)) damage(problem_);
    } else if (op == static_cast<std::uint8_t>(Op::Message)) {
      const auto connection = number(fields, "conn", 4, id)
                                  ? connections_.find(static_cast<std::uint32_t>(id))
                                  : connections_.end();
      if (connection == connections_.end() || !number(fields, "time", 8, time)) {
        damage("a message without time or known connection");
      } else {
        callback({connection->second, static_cast<std::uint32_t>(time),
                  static_cast<std::uint32_t>(time >> 32U), content, length});
        if (salvage) ++salvage->kept;
      }
    } else {
      damage("a record of kind " + std::to_string(op) + " within a chunk");
    }
    at += 8 + header + length;
  }
  return whole;
}

bool BagReader::chunk(const Record& record, const Callback& callback, Salvage* salvage) {
  const auto compression = record.fields.find("compression");
  std::uint64_t size = 0;
  const auto damage = [&](const std::string& what) {
    problem_ = what;
    if (salvage) ++salvage->damaged;
    return false;
  };
  if (compression == record.fields.end() || !number(record.fields, "size", 4, size))
    return damage("a chunk without compression or size");
  const std::uint64_t there = std::min<std::uint64_t>(record.size, size_ - record.data);
  if (there > kMostChunk || size > kMostChunk)
    return damage("a chunk of more than " + std::to_string(kMostChunk) + " bytes");
  // Chunks within chunks, or of zeros: a small file must not ask for hours.
  const bool cut = there < record.size || size == 0;
  const std::uint64_t bytes = std::max<std::uint64_t>(size == 0 ? size_ - record.data : there, size);
  spent_ += cut ? 16 * bytes : bytes;  // a bag has one that was cut off
  if (spent_ > kMostFolds * size_ + kMostChunk)
    return damage("chunks of more than " + std::to_string(kMostFolds) + " times the file");
  if (cut && !salvage) return damage("a chunk that is not whole");
  // A chunk that stock rosbag left open says 0: all that follows is in it.
  if (!get(record.data, size == 0 ? std::min<std::uint64_t>(size_ - record.data, kMostChunk) : there, raw_))
    return damage("a chunk cannot be read");
  if (compression->second == "none") {
    if (!cut && size != record.size && !salvage) return damage("a chunk whose sizes disagree");
    return inChunk(raw_.data(), raw_.size(), callback, salvage);
  }
  if (compression->second != "lz4" && compression->second != "bz2")
    return damage("a chunk of unknown compression '" + compression->second.substr(0, 20) +
                  "' (allowed: none, lz4, bz2)");
  if (cut || !unpack(compression->second, raw_, static_cast<std::uint32_t>(size), unpacked_))
    return damage("a chunk that cannot be decompressed");
  return inChunk(unpacked_.data(), unpacked_.size(), callback, salvage);
}

std::uint64_t BagReader::nextChunk(std::uint64_t at) const {
  constexpr std::size_t kBlock = 1U << 20U, kOverlap = 64;
  static const std::string kWord = "compression=";
  std::vector<std::uint8_t> block;
  Record candidate;
  std::uint64_t most = 1U << 12U;  // where each record is a chunk that lies, the next one is near
  while (at < size_) {
    const off_t data = lseek(descriptor_, static_cast<off_t>(at), SEEK_DATA);
    if (data < 0 && errno == ENXIO) break;  // a hole to the end
    if (data > 0) at = std::max(at, static_cast<std::uint64_t>(data));
    const std::uint64_t size = std::min<std::uint64_t>(most, size_ - at);
    if (!get(at, size, block)) return size_;
    for (auto found = block.begin();; ++found) {
      found = std::search(found, block.end(), kWord.begin(), kWord.end());
      if (found == block.end()) break;
      // Its header begins a few fields before.
      const auto word = at + static_cast<std::uint64_t>(found - block.begin());
      const std::uint64_t first = std::max<std::uint64_t>(at, word < kOverlap ? 0 : word - kOverlap);
      for (std::uint64_t begin = first; begin + 4 <= word; ++begin) {
        const std::uint64_t header = littleEndian(block.data() + (begin - at));
        if (begin + 4 + header < word + kWord.size() || header > kMostChunkHeader) continue;
        if (record(begin, candidate) == Found::Record && candidate.is(Op::Chunk)) return begin;
      }
    }
    if (at + size == size_) break;
    at += size - 2 * kOverlap;
    most = std::min<std::uint64_t>(2 * most, kBlock);
  }
  return size_;
}

std::uint64_t BagReader::walk(const Callback& callback, Salvage* salvage) {
  std::uint64_t chunks = 0;
  Record record;
  for (std::uint64_t at = kBagMagicSize;;) {
    const Found found = this->record(at, record);
    if (found == Found::End) return chunks;
    bool good = found == Found::Record;
    if (!good) problem_ = "a record that cannot be read: the file is cut off or damaged here";
    if (good && record.is(Op::Chunk)) {
      ++chunks;
      good = chunk(record, callback, salvage);
      if (!good && salvage) {  // counted; a chunk that lies about its size must not hide the next ones
        at = nextChunk(record.data);
        continue;
      }
    } else if (good) {
      std::uint64_t index = 0;
      if (record.size > size_ - record.data) {
        problem_ = "a record that goes beyond the end of the file";
        good = false;
      } else if (record.is(Op::Connection) && connections_.size() < kMostConnections) {
        good = get(record.data, record.size, raw_) && connect(record.fields, raw_.data(), raw_.size());
      } else if (record.is(Op::BagHeader) && !salvage && number(record.fields, "index_pos", 8, index) &&
                 index == 0) {
        problem_ = "the bag was not closed (vest_recover_bag makes a whole one of it)";
        good = false;
      } else if (record.op <= static_cast<std::uint8_t>(Op::Message) ||
                 record.op > static_cast<std::uint8_t>(Op::Connection)) {
        problem_ = "a record of kind " + std::to_string(record.op) + " where a chunk is due";
        good = false;
      }
    }
    if (good) {
      // A chunk that stock rosbag left open claims nothing, and went to the end of the file.
      at = record.is(Op::Chunk) && record.size == 0 ? size_ : record.data + record.size;
      continue;
    }
    if (!salvage) refuse(at, problem_);
    ++salvage->damaged;
    at = nextChunk(at + 1);
  }
}

void BagReader::read(const Callback& callback) {
  connections_.clear();
  spent_ = 0;
  walk(callback, nullptr);
}

BagReader::Salvage BagReader::salvage(const Callback& callback) {
  connections_.clear();
  spent_ = 0;
  Salvage salvage;
  walk(callback, &salvage);
  return salvage;
}

}  // namespace vest::session
