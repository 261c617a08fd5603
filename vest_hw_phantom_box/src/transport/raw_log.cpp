#include "vest_hw_phantom_box/transport/raw_log.h"

#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "vest_instruments/files/read.h"

namespace vest::transport {
namespace {

constexpr char kHead[] = "VEST raw bytes 1\n";
constexpr std::size_t kHeadSize = sizeof kHead - 1;
constexpr std::uint32_t kMostOfAPiece = 1 << 16;
constexpr std::size_t kMostOfAFile = 512u << 20, kMostPieces = 8000000;  // two hours, at 1 kHz

void put(std::ostream& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) out.put(static_cast<char>(value >> (8 * i) & 0xFF));
}

bool get(const std::string& bytes, std::size_t& at, std::uint64_t& value, std::size_t count) {
  if (bytes.size() - at < count) return false;
  value = 0;
  for (std::size_t i = 0; i < count; ++i)
    value |= static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[at++])) << (8 * i);
  return true;
}

}  // namespace

std::string RawLog::open(const std::string& path) {
  out_.open(path, std::ios::binary | std::ios::trunc);
  if (!out_) return std::string(std::strerror(errno)) + "; allowed: a file that can be written";
  out_.write(kHead, kHeadSize);
  first_ns_ = -1;
  return {};
}

bool RawLog::write(std::int64_t now_ns, const std::uint8_t* bytes, std::size_t size) {
  if (first_ns_ < 0) first_ns_ = now_ns;
  put(out_, static_cast<std::uint64_t>(now_ns - first_ns_), 8);
  put(out_, size, 4);
  out_.write(reinterpret_cast<const char*>(bytes), static_cast<std::streamsize>(size));
  if (!out_) out_.close();
  return out_.is_open();
}

RawRecording readRawLog(const std::string& path) {
  const auto fail = [&](const std::string& what) {
    throw std::runtime_error(path + ": " + what +
                             "; allowed: a log of raw bytes of the driver (raw_log) or of box_setup (--log)");
  };
  RawRecording out;
  std::string& bytes = out.file;
  std::vector<RawPiece>& pieces = out.pieces;
  try {
    bytes = files::read(path, kMostOfAFile);
  } catch (const files::Refused& refused) {
    fail(refused.value);
  }
  if (bytes.compare(0, kHeadSize, kHead) != 0) fail("not such a file");
  std::size_t at = kHeadSize;
  for (std::uint64_t time = 0, size = 0; get(bytes, at, time, 8) && get(bytes, at, size, 4);) {
    const auto ns = static_cast<std::int64_t>(time);
    if (ns < 0 || (!pieces.empty() && ns < pieces.back().time_ns))
      fail("piece " + std::to_string(pieces.size()) + ": its time goes back");
    if (size > kMostOfAPiece)
      fail("piece " + std::to_string(pieces.size()) + ": " + std::to_string(size) + " bytes");
    if (bytes.size() - at < size) break;
    if (pieces.size() == kMostPieces) fail("more than " + std::to_string(kMostPieces) + " pieces");
    pieces.push_back({ns, at, static_cast<std::uint32_t>(size)});
    at += size;
  }
  if (pieces.empty()) fail("nothing was recorded");
  return out;
}

}  // namespace vest::transport
