// Bytes in any pieces to frames. Allocates nothing, knows no clock.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "vest_hw_phantom_box/protocol/frame.h"

namespace vest::protocol {

/// Receives whole, checked frames, each exactly once and in the order of their sequence numbers.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  virtual void onHello(const Hello& hello, std::uint32_t time_us) = 0;
  virtual void onMotion(const Motion& motion) = 0;
};

struct DecoderCounters {
  std::uint64_t bytes = 0;
  std::uint64_t frames = 0;  ///< good ones, of any type
  std::uint64_t hellos = 0;
  std::uint64_t motions = 0;
  std::uint64_t unknown = 0;  ///< good check, but a type or content that version 1 does not define: skipped
  std::uint64_t crc_errors = 0;  ///< something that began like a frame and failed CRC or end byte
  std::uint64_t skipped = 0;     ///< bytes that belonged to no good frame
  std::uint64_t lost = 0;        ///< frames missing between sequence numbers; never filled in
  std::uint64_t repeated = 0;    ///< same sequence number twice: second one dropped
  std::uint64_t restarts = 0;    ///< sequence went backwards: the box began anew
};

/// Resynchronises by trying every byte as a start. Since no frame is longer than kMaxFrame, a false start can
/// hold back at most that many bytes: back in step within two good frames.
class Decoder {
 public:
  void feed(const std::uint8_t* bytes, std::size_t size, FrameSink& sink);
  /// A new connection: forgets bytes and sequence, keeps the counters.
  void reset();
  const DecoderCounters& counters() const { return counters_; }

 private:
  void drain(FrameSink& sink);
  void dispatch(const std::uint8_t* frame, std::size_t payload, FrameSink& sink);
  bool inSequence(std::uint16_t sequence, bool start);

  std::array<std::uint8_t, 1024> buffer_{};
  std::size_t size_ = 0;
  bool has_sequence_ = false;
  std::uint16_t last_sequence_ = 0;
  DecoderCounters counters_;
};

}  // namespace vest::protocol
