#include "vest_haptics/device/force_transport.h"

#include <algorithm>
#include <cmath>

namespace vest::haptics {
namespace force_frame {
namespace {

std::uint16_t crc(const std::uint8_t* bytes, std::size_t size) noexcept {
  std::uint16_t c = 0xffff;
  for (std::size_t i = 0; i < size; ++i) {
    c = static_cast<std::uint16_t>(c ^ (bytes[i] << 8));
    for (int b = 0; b < 8; ++b) c = static_cast<std::uint16_t>(c & 0x8000 ? (c << 1) ^ 0x1021 : c << 1);
  }
  return c;
}

}  // namespace

void encode(std::uint8_t sequence, const Loads& loads, const Loads& maximum, std::uint8_t* out) noexcept {
  out[0] = 0xA5;
  out[1] = sequence;
  for (std::size_t i = 0; i < kChannels; ++i) {
    const double share = maximum[i] > 0.0 ? std::clamp(loads[i] / maximum[i], -1.0, 1.0) : 0.0;
    const auto v = static_cast<std::uint16_t>(static_cast<std::int16_t>(std::lround(share * 32767.0)));
    out[2 + 2 * i] = static_cast<std::uint8_t>(v & 0xff);
    out[3 + 2 * i] = static_cast<std::uint8_t>(v >> 8);
  }
  const std::uint16_t c = crc(out, 12);
  out[12] = static_cast<std::uint8_t>(c & 0xff);
  out[13] = static_cast<std::uint8_t>(c >> 8);
}

bool decode(const std::uint8_t* bytes, const Loads& maximum, std::uint8_t& sequence, Loads& loads) noexcept {
  if (bytes[0] != 0xA5 || crc(bytes, 12) != (bytes[12] | bytes[13] << 8)) return false;
  sequence = bytes[1];
  for (std::size_t i = 0; i < kChannels; ++i) {
    const auto v = static_cast<std::int16_t>(bytes[2 + 2 * i] | bytes[3 + 2 * i] << 8);
    loads[i] = maximum[i] * v / 32767.0;
  }
  return true;
}

}  // namespace force_frame

void EmulatorTransport::open(const std::string& port, const Loads& maximum) {
  const std::string wrong = tty_.open(port, 115200);
  if (!wrong.empty()) throw DeviceError("Impulse Engine, force side: " + wrong);
  maximum_ = maximum;
}

bool EmulatorTransport::write(const Loads& loads) noexcept {
  std::uint8_t frame[force_frame::kSize];
  force_frame::encode(++sequence_, loads, maximum_, frame);
  return tty_.write(frame, sizeof frame);
}

}  // namespace vest::haptics
