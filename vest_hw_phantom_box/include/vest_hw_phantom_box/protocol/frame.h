// What travels on the wire between a trainer box and the driver: docs/phantom_box_protocol.md, version 1.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vest::protocol {

constexpr std::uint8_t kSync0 = 0x56;
constexpr std::uint8_t kSync1 = 0xB5;
constexpr std::uint8_t kTypeHello = 0x01;
constexpr std::uint8_t kTypeMotion = 0x02;
constexpr std::uint8_t kVersionMajor = 1;
constexpr std::uint8_t kVersionMinor = 0;

constexpr std::size_t kHeaderSize = 10;  ///< sync, type, length, sequence, time
constexpr std::size_t kTrailerSize = 3;  ///< CRC-16, end byte
constexpr std::size_t kMaxPayload = 46;  ///< a longer one is never a frame: bounds what a false start costs
constexpr std::size_t kHelloPayload = 24;
constexpr std::size_t kMaxFrame = kHeaderSize + kMaxPayload + kTrailerSize;
constexpr std::uint8_t kEndMask = 0xA5;  ///< end byte = low byte of the sequence number xor this

constexpr int kMaxInstruments = 3;
constexpr int kAxes = 5;  ///< yaw, pitch, insertion, roll, and jaw or light post
constexpr int kJoints = (kMaxInstruments + 1) * kAxes;
constexpr int kEndoscope = kMaxInstruments * kAxes;  ///< first joint of the endoscope
constexpr int kLightPost = kEndoscope + 4;
constexpr int kFootswitches = 6;
constexpr std::int16_t kNoReading = -32768;  ///< a count that says: this sensor gave nothing

/// Bits of the status byte.
enum Status : std::uint8_t {
  kSensorFault = 0x01,    ///< at least one bit of `invalid` is set
  kNotReferenced = 0x02,  ///< counts have no zero yet: no joint can be used
  kOverrun = 0x04,        ///< the box lost samples of its own
  kPedalsMissing = 0x08,  ///< footswitch bits mean nothing
  kInternalError = 0x10   ///< no joint can be used
};

/// Who the box is. Sent when the port is opened and once a second.
struct Hello {
  std::uint8_t version_major = kVersionMajor;
  std::uint8_t version_minor = kVersionMinor;
  std::uint8_t instruments = 3;  ///< 2 or 3
  bool light_post = true;        ///< the endoscope's fifth joint exists
  bool start = false;            ///< sequence and time begin anew with this frame
  std::uint16_t rate_hz = 1000;  ///< motion frames per second
  std::uint16_t firmware = 0;
  std::string serial_number;  ///< at most 16 printable ASCII characters
};

/// One sample of all sensors. Joint i*5+axis belongs to instrument i (left, right, third); 15…19 to the
/// endoscope.
struct Motion {
  std::uint16_t sequence = 0;
  std::uint32_t time_us = 0;      ///< device time of the sample, wraps after 71.6 min
  std::uint8_t instruments = 3;   ///< 2 or 3: follows from the length of the frame
  std::uint8_t footswitches = 0;  ///< bits 0…5, 1 = pressed
  std::uint8_t status = 0;
  std::uint32_t invalid = 0;  ///< bit per joint: the count is not a measurement
  std::array<std::int16_t, kJoints> counts{};
};

constexpr std::size_t motionPayload(int instruments) {
  return 6 + static_cast<std::size_t>(instruments + 1) * kAxes * 2;
}

using Bytes = std::vector<std::uint8_t>;

/// Appends one whole frame to `out`. Only capacity that `out` lacks is allocated.
void encode(const Hello& hello, std::uint16_t sequence, std::uint32_t time_us, Bytes& out);
void encode(const Motion& motion, Bytes& out);

/// "left_yaw" … "endoscope_light_post", in the order of the joints above.
const std::array<std::string, kJoints>& jointNames();
const std::array<std::string, kMaxInstruments + 1>& armNames();

}  // namespace vest::protocol
