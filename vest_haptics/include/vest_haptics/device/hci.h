/// The serial HCI protocol of Immersion's position interfaces, as far as it is publicly known. Host asks,
/// device answers; bytes of an answer have their top bit clear except the first, so a reader is back in step
/// at once.
///
///   begin    host 0xC5 (end of an older session) · host "IMMC" every 15 ms until echoed · host "BEGIN" ·
///            device: product name, NUL
///   request  one byte: 0x20 timer | 0x04, 0x08, 0x0C: 2, 4, 8 analog channels | 1, 2, 3: 2, 3, 6 encoders
///   answer   request | 0x80 · buttons (7 bits) · timer 2 × 7 bits · analog high 7 bits each, then a byte of
///            low bits · encoders 2 × 7 bits each, most significant first
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace vest::haptics::hci {

inline constexpr std::uint8_t kEndSession = 0xC5;
inline constexpr char kSync[] = "IMMC";
inline constexpr char kBegin[] = "BEGIN";
inline constexpr int kEncoderRange = 1 << 14;
inline constexpr std::uint8_t kTimerSixEncoders = 0x20 | 3;

int encodersOf(std::uint8_t request);  ///< 0, 2, 3 or 6
int analogOf(std::uint8_t request);    ///< 0, 2, 4 or 8
/// Bytes of an answer, header included.
std::size_t answerSize(std::uint8_t request);

struct Answer {
  std::uint8_t buttons = 0;       ///< 7 bits
  int timer = 0;                  ///< 14 bits, device's milliseconds
  std::array<int, 6> encoders{};  ///< 0 … 16383, wrapping
};

/// Bytes in, answers out; what does not belong is skipped and counted.
class Decoder {
 public:
  explicit Decoder(std::uint8_t request) : request_(request), size_(answerSize(request)) {}
  /// True where `byte` completes an answer.
  bool push(std::uint8_t byte, Answer& answer) noexcept;
  std::uint64_t skipped() const noexcept { return skipped_; }

 private:
  std::uint8_t request_;
  std::size_t size_, have_ = 0;
  std::array<std::uint8_t, 32> bytes_{};
  std::uint64_t skipped_ = 0;
};

/// The device's half of it. @return bytes written into `out` (at least 32 long)
std::size_t encode(std::uint8_t request, const Answer& answer, std::uint8_t* out) noexcept;

/// A wrapping encoder as counts since home, half way of its range.
class Unwrap {
 public:
  long update(int raw) noexcept {
    if (!any_) {
      any_ = true;
      count_ = raw - kEncoderRange / 2;
    } else {
      int d = raw - last_;
      if (d > kEncoderRange / 2) d -= kEncoderRange;
      if (d < -kEncoderRange / 2) d += kEncoderRange;
      count_ += d;
    }
    last_ = raw;
    return count_;
  }

 private:
  bool any_ = false;
  int last_ = 0;
  long count_ = 0;
};

}  // namespace vest::haptics::hci
