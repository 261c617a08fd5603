#include "vest_hw_phantom_box/protocol/frame.h"

#include "vest_hw_phantom_box/protocol/crc16.h"

namespace vest::protocol {
namespace {

void put16(Bytes& out, std::uint16_t v) {
  out.push_back(static_cast<std::uint8_t>(v & 0xFF));
  out.push_back(static_cast<std::uint8_t>(v >> 8));
}
void put32(Bytes& out, std::uint32_t v) {
  put16(out, static_cast<std::uint16_t>(v & 0xFFFF));
  put16(out, static_cast<std::uint16_t>(v >> 16));
}

void begin(Bytes& out, std::uint8_t type, std::size_t payload, std::uint16_t sequence,
           std::uint32_t time_us) {
  out.push_back(kSync0);
  out.push_back(kSync1);
  out.push_back(type);
  out.push_back(static_cast<std::uint8_t>(payload));
  put16(out, sequence);
  put32(out, time_us);
}

// The CRC covers everything between the sync bytes and itself.
void end(Bytes& out, std::size_t first, std::uint16_t sequence) {
  put16(out, crc16(out.data() + first + 2, out.size() - first - 2));
  out.push_back(static_cast<std::uint8_t>((sequence & 0xFF) ^ kEndMask));
}

}  // namespace

void encode(const Hello& hello, std::uint16_t sequence, std::uint32_t time_us, Bytes& out) {
  const std::size_t first = out.size();
  begin(out, kTypeHello, kHelloPayload, sequence, time_us);
  out.push_back(hello.version_major);
  out.push_back(hello.version_minor);
  out.push_back(hello.instruments);
  out.push_back(static_cast<std::uint8_t>((hello.light_post ? 1 : 0) | (hello.start ? 2 : 0)));
  put16(out, hello.rate_hz);
  put16(out, hello.firmware);
  for (std::size_t i = 0; i < 16; ++i)
    out.push_back(i < hello.serial_number.size() ? static_cast<std::uint8_t>(hello.serial_number[i]) : 0);
  end(out, first, sequence);
}

void encode(const Motion& motion, Bytes& out) {
  const std::size_t first = out.size();
  begin(out, kTypeMotion, motionPayload(motion.instruments), motion.sequence, motion.time_us);
  out.push_back(motion.footswitches);
  out.push_back(motion.status);
  put32(out, motion.invalid);
  for (int i = 0; i < motion.instruments * kAxes; ++i)
    put16(out, static_cast<std::uint16_t>(motion.counts[i]));
  for (int i = kEndoscope; i < kJoints; ++i) put16(out, static_cast<std::uint16_t>(motion.counts[i]));
  end(out, first, motion.sequence);
}

const std::array<std::string, kMaxInstruments + 1>& armNames() {
  static const std::array<std::string, kMaxInstruments + 1> names{"left", "right", "third", "endoscope"};
  return names;
}

const std::array<std::string, kJoints>& jointNames() {
  static const std::array<std::string, kJoints> names = [] {
    const char* axes[] = {"_yaw", "_pitch", "_insertion", "_roll", "_jaw"};
    std::array<std::string, kJoints> n;
    for (int i = 0; i < kJoints; ++i) n[i] = armNames()[i / kAxes] + axes[i % kAxes];
    n[kLightPost] = "endoscope_light_post";
    return n;
  }();
  return names;
}

}  // namespace vest::protocol
