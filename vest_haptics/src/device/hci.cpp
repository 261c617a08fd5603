#include "vest_haptics/device/hci.h"

namespace vest::haptics::hci {

int encodersOf(std::uint8_t request) {
  constexpr int kCounts[4] = {0, 2, 3, 6};
  return kCounts[request & 3];
}

int analogOf(std::uint8_t request) {
  constexpr int kCounts[4] = {0, 2, 4, 8};
  return kCounts[(request >> 2) & 3];
}

std::size_t answerSize(std::uint8_t request) {
  const int analog = analogOf(request);
  return static_cast<std::size_t>(2 + ((request & 0x20) ? 2 : 0) + (analog ? analog + 1 : 0) +
                                  2 * encodersOf(request));
}

bool Decoder::push(std::uint8_t byte, Answer& answer) noexcept {
  if (byte & 0x80) {
    skipped_ += have_;  // an answer that was cut short
    have_ = 0;
    if (byte != (request_ | 0x80)) {
      ++skipped_;
      return false;
    }
    bytes_[have_++] = byte;
    return false;
  }
  if (have_ == 0) {
    ++skipped_;
    return false;
  }
  bytes_[have_++] = byte;
  if (have_ < size_) return false;
  have_ = 0;
  std::size_t at = 1;
  answer = Answer{};
  answer.buttons = bytes_[at++];
  if (request_ & 0x20) {
    answer.timer = bytes_[at] << 7 | bytes_[at + 1];
    at += 2;
  }
  const int analog = analogOf(request_);
  if (analog) at += static_cast<std::size_t>(analog) + 1;
  for (int i = 0; i < encodersOf(request_); ++i, at += 2) {
    answer.encoders[static_cast<std::size_t>(i)] = bytes_[at] << 7 | bytes_[at + 1];
  }
  return true;
}

std::size_t encode(std::uint8_t request, const Answer& answer, std::uint8_t* out) noexcept {
  std::size_t at = 0;
  out[at++] = static_cast<std::uint8_t>(request | 0x80);
  out[at++] = answer.buttons & 0x7f;
  const auto two = [&](int value) {
    out[at++] = static_cast<std::uint8_t>((value >> 7) & 0x7f);
    out[at++] = static_cast<std::uint8_t>(value & 0x7f);
  };
  if (request & 0x20) two(answer.timer);
  const int analog = analogOf(request);
  for (int i = 0; i < (analog ? analog + 1 : 0); ++i) out[at++] = 0;
  for (int i = 0; i < encodersOf(request); ++i) two(answer.encoders[static_cast<std::size_t>(i)]);
  return at;
}

}  // namespace vest::haptics::hci
