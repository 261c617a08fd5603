#include "vest_instruments/files/read.h"

#include <fcntl.h>
#include <locale.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "vest_instruments/files/utf8.h"

namespace vest::files {
namespace {

/// Length of the UTF-8 character at `at`, and its code; 0: none.
std::size_t character(const std::string& text, std::size_t at, std::uint32_t& code) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const std::uint32_t first = byte(at);
  if (first < 0x80) {
    code = first;
    return 1;
  }
  const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4) return 0;
  code = first & (0x7fu >> size);
  for (std::size_t i = 1; i < size; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(at + i) & 0x3f);
  }
  const std::uint32_t least = size == 4 ? 0x10000 : size == 3 ? 0x800 : 0x80;
  return code < least || code > 0x10ffff || (code >= 0xd800 && code < 0xe000) ? 0 : size;
}

/// Controls of terminals (C0, C1), line separators, marks that turn the direction of writing (UAX #9).
bool harmless(std::uint32_t code) {
  return code >= 0x20 && !(code >= 0x7f && code < 0xa0) && !(code >= 0x200b && code <= 0x200f) &&
         !(code >= 0x2028 && code <= 0x202e) && !(code >= 0x2060 && code <= 0x206f) && code != 0xfeff;
}

constexpr std::uint32_t kJoiner = 0x200d, kAsPicture = 0xfe0f;

/// Blocks that pictographs of emoji sequences are from (Unicode's emoji-zwj-sequences.txt).
bool pictograph(std::uint32_t code) {
  return (code >= 0x1f000 && code <= 0x1faff) || (code >= 0x2600 && code <= 0x27bf) ||
         (code >= 0x2190 && code <= 0x21ff) || (code >= 0x2b00 && code <= 0x2bff);
}

/// A joiner that makes one emoji of two, as in a family (UTS #51, ED-16). Elsewhere it cannot be seen.
bool joins(const std::string& text, std::size_t after, std::uint32_t before) {
  std::uint32_t next = 0;
  return pictograph(before) && character(text, after, next) > 0 && pictograph(next);
}

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

const char* kindOf(mode_t mode) {
  return S_ISDIR(mode) ? "a folder" : S_ISFIFO(mode) ? "a pipe" : S_ISSOCK(mode) ? "a socket" : "a device";
}

}  // namespace

Refused::Refused(int at, std::string of, std::string is, std::string may)
    : std::invalid_argument(of + ": " + shown(is) + ": " + may),
      line(at),
      field(std::move(of)),
      value(std::move(is)),
      allowed(std::move(may)) {}

std::string read(const std::string& path, std::size_t most) {
  const std::string allowed = "a readable file of at most " + std::to_string(most) + " bytes";
  if (path.find('\0') != std::string::npos) throw Refused(0, "file", path, allowed);
  // Non-blocking, so that a pipe without a writer answers too.
  const Descriptor file{::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)};
  struct stat info {};
  if (file.fd < 0 || ::fstat(file.fd, &info) != 0) throw Refused(0, "file", std::strerror(errno), allowed);
  if (!S_ISREG(info.st_mode)) throw Refused(0, "file", kindOf(info.st_mode), allowed);
  const auto size = static_cast<std::uint64_t>(info.st_size);
  if (size > most) throw Refused(0, "file", std::to_string(size) + " bytes", allowed);
  std::string bytes(static_cast<std::size_t>(size) + 1, '\0');
  std::size_t used = 0;
  for (;;) {
    const ssize_t got = ::read(file.fd, bytes.data() + used, bytes.size() - used);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw Refused(0, "file", std::strerror(errno), allowed);
    if (got == 0) break;
    used += static_cast<std::size_t>(got);
    if (used > most) throw Refused(0, "file", "more than " + std::to_string(most) + " bytes", allowed);
    if (used == bytes.size()) bytes.resize(std::min(most + 1, 2 * used));  // it has grown, or has no size
  }
  bytes.resize(used);
  return bytes;
}

std::string shown(const std::string& text, std::size_t most) {
  std::string out;
  std::size_t count = 0;
  std::uint32_t before = 0;
  for (std::size_t at = 0; at < text.size();) {
    if (count++ == most) {
      const std::string joiner = "\xe2\x80\x8d";
      const std::size_t end = out.size() < joiner.size() ? 0 : out.size() - joiner.size();
      if (out.compare(end, std::string::npos, joiner) == 0) out.resize(end);  // what it joined is cut off
      return out + "...";
    }
    std::uint32_t code = 0;
    const std::size_t size = character(text, at, code);
    const bool kept = size > 0 && (harmless(code) || (code == kJoiner && joins(text, at + size, before)));
    if (code != kAsPicture) before = code;
    if (kept) {
      out.append(text, at, size);
      at += size;
      continue;
    }
    for (const std::size_t end = at + std::max<std::size_t>(1, size); at < end; ++at) {
      char escaped[5];
      std::snprintf(escaped, sizeof escaped, "\\x%02x", static_cast<unsigned char>(text[at]));
      out += escaped;
    }
  }
  return out;
}

std::string asUtf8(std::string text) {
  std::uint32_t code = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t size = character(text, at, code);
    if (size == 0) text[at] = '?';
    at += std::max<std::size_t>(1, size);
  }
  return text;
}

bool parseNumber(const std::string& text, double& value) {
  // Not std::from_chars, which GCC has for doubles from version 11 on. No hexadecimal, no inf, no spaces.
  if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos) return false;
  static const locale_t decimal_point = ::newlocale(LC_ALL_MASK, "C", nullptr);
  char* end = nullptr;
  const double number = ::strtod_l(text.c_str(), &end, decimal_point);
  if (end != text.c_str() + text.size() || !std::isfinite(number)) return false;
  value = number;
  return true;
}

}  // namespace vest::files
