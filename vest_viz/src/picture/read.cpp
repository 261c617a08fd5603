#include "vest_viz/picture/read.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstddef>
#include <stdexcept>

#include <opencv2/imgcodecs.hpp>

#include "vest_instruments/files/read.h"

namespace vest::picture {
namespace {

constexpr std::size_t kMostBytes = 64u << 20;
/// Of a JPEG: cameras write at most a dozen, and each goes over all of its pixels.
constexpr std::size_t kMostScans = 100;

std::size_t number(const std::string& bytes, std::size_t at, std::size_t count) {
  std::size_t value = 0;
  for (std::size_t i = at; i < at + count; ++i)
    value = value << 8 | (i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0u);
  return value;
}

/// Width times height as the header says, before memory is taken; 0: neither PNG nor JPEG.
std::size_t pixels(const std::string& bytes) {
  // ISO/IEC 15948, 11.2.2: the first chunk is IHDR.
  if (bytes.size() >= 24 && bytes.compare(0, 8, "\x89PNG\r\n\x1a\n") == 0 &&
      bytes.compare(12, 4, "IHDR") == 0)
    return number(bytes, 16, 4) * number(bytes, 20, 4);
  if (bytes.compare(0, 3, "\xff\xd8\xff") != 0) return 0;
  // ITU-T T.81, B.2.2: segments until a start of frame, SOF0 … SOF15 without DHT, JPG and DAC.
  for (std::size_t at = 2; at + 9 < bytes.size() && number(bytes, at, 1) == 0xff;) {
    const std::size_t marker = number(bytes, at + 1, 1);
    if (marker == 0xff) {
      ++at;  // fill byte
      continue;
    }
    if (marker == 0x01 || (marker >= 0xd0 && marker <= 0xd7)) {
      at += 2;  // they have no length
      continue;
    }
    if (marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc)
      return number(bytes, at + 5, 2) * number(bytes, at + 7, 2);
    at += 2 + number(bytes, at + 2, 2);
  }
  return 0;
}

/// Starts of scans (SOS) of a JPEG; within a scan's data none looks like one (B.1.1.5).
std::size_t scans(const std::string& bytes) {
  std::size_t count = 0;
  if (bytes[0] != '\xff') return 0;
  for (std::size_t at = bytes.find("\xff\xda"); at != std::string::npos; at = bytes.find("\xff\xda", at + 2))
    ++count;
  return count;
}

/// Standard error into nothing.
class Quiet {
 public:
  Quiet() : kept_(dup(STDERR_FILENO)) {
    const int nothing = open("/dev/null", O_WRONLY | O_CLOEXEC);
    if (kept_ >= 0 && nothing >= 0) dup2(nothing, STDERR_FILENO);
    if (nothing >= 0) close(nothing);
  }
  ~Quiet() {
    if (kept_ < 0) return;
    dup2(kept_, STDERR_FILENO);
    close(kept_);
  }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  int kept_;
};

}  // namespace

cv::Mat read(const std::string& path, int mode, int most) {
  const auto fail = [&](const std::string& cause) {
    throw std::runtime_error(files::shown(path, 4096) + ": " + cause +
                             ": allowed: a PNG or JPEG picture of at most 64 MiB, " + std::to_string(most) +
                             " megapixels and " + std::to_string(kMostScans) + " scans");
  };
  std::string bytes;
  try {
    bytes = files::read(path, kMostBytes);
  } catch (const files::Refused& refused) {
    fail(refused.value);
  }
  const std::size_t count = pixels(bytes);
  if (count == 0) fail("no PNG or JPEG picture");
  if (count > static_cast<std::size_t>(most) << 20) fail("too large");
  if (scans(bytes) > kMostScans) fail(std::to_string(scans(bytes)) + " scans");
  cv::Mat picture;
  try {
    const Quiet quiet;
    picture = cv::imdecode(cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, bytes.data()), mode);
  } catch (const cv::Exception&) {
    picture.release();
  }
  if (picture.empty()) fail("a damaged picture");
  return picture;
}

}  // namespace vest::picture
