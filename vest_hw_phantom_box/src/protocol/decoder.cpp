#include "vest_hw_phantom_box/protocol/decoder.h"

#include <algorithm>
#include <cstring>

#include "vest_hw_phantom_box/protocol/crc16.h"

namespace vest::protocol {
namespace {

std::uint16_t get16(const std::uint8_t* p) {
  return static_cast<std::uint16_t>(p[0] | (p[1] << 8));
}
std::uint32_t get32(const std::uint8_t* p) {
  return static_cast<std::uint32_t>(get16(p)) | (static_cast<std::uint32_t>(get16(p + 2)) << 16);
}

}  // namespace

void Decoder::reset() {
  counters_.skipped += size_;
  size_ = 0;
  has_sequence_ = false;
}

void Decoder::feed(const std::uint8_t* bytes, std::size_t size, FrameSink& sink) {
  counters_.bytes += size;
  while (size > 0) {
    // drain() leaves less than one frame behind, so there is always room.
    const std::size_t n = std::min(size, buffer_.size() - size_);
    std::memcpy(buffer_.data() + size_, bytes, n);
    size_ += n;
    bytes += n;
    size -= n;
    drain(sink);
  }
}

void Decoder::drain(FrameSink& sink) {
  std::size_t at = 0;
  while (at < size_) {
    const std::uint8_t* p = buffer_.data() + at;
    const std::size_t left = size_ - at;
    if (p[0] != kSync0 || (left > 1 && p[1] != kSync1) || (left > 3 && p[3] > kMaxPayload)) {
      ++at;
      ++counters_.skipped;
      continue;
    }
    if (left < kHeaderSize) break;
    const std::size_t payload = p[3];
    const std::size_t total = kHeaderSize + payload + kTrailerSize;
    if (left < total) break;
    const std::size_t crc_at = kHeaderSize + payload;
    if (crc16(p + 2, crc_at - 2) != get16(p + crc_at) ||
        p[crc_at + 2] != static_cast<std::uint8_t>(p[4] ^ kEndMask)) {
      ++counters_.crc_errors;
      ++counters_.skipped;
      ++at;  // a good frame may begin inside the bad one
      continue;
    }
    dispatch(p, payload, sink);
    at += total;
  }
  std::memmove(buffer_.data(), buffer_.data() + at, size_ - at);
  size_ -= at;
}

bool Decoder::inSequence(std::uint16_t sequence, bool start) {
  const std::uint16_t step = static_cast<std::uint16_t>(sequence - last_sequence_);
  if (!has_sequence_ || start) {
    if (has_sequence_ && step != 1) ++counters_.restarts;
  } else if (step == 0) {
    ++counters_.repeated;
    return false;
  } else if (step >= 0x8000) {
    ++counters_.restarts;
  } else {
    counters_.lost += step - 1u;
  }
  has_sequence_ = true;
  last_sequence_ = sequence;
  return true;
}

void Decoder::dispatch(const std::uint8_t* frame, std::size_t payload, FrameSink& sink) {
  const std::uint8_t* d = frame + kHeaderSize;
  const std::uint16_t sequence = get16(frame + 4);
  const std::uint32_t time_us = get32(frame + 6);
  const bool hello = frame[2] == kTypeHello && payload == kHelloPayload;
  ++counters_.frames;
  if (!inSequence(sequence, hello && (d[3] & 2))) return;
  if (hello) {
    Hello h;
    h.version_major = d[0];
    h.version_minor = d[1];
    h.instruments = d[2];
    h.light_post = d[3] & 1;
    h.start = d[3] & 2;
    h.rate_hz = get16(d + 4);
    h.firmware = get16(d + 6);
    for (int i = 0; i < 16 && d[8 + i]; ++i)
      h.serial_number.push_back(d[8 + i] >= 0x20 && d[8 + i] < 0x7F ? static_cast<char>(d[8 + i]) : '?');
    ++counters_.hellos;
    sink.onHello(h, time_us);
  } else if (frame[2] == kTypeMotion && (payload == motionPayload(2) || payload == motionPayload(3))) {
    Motion m;
    m.sequence = sequence;
    m.time_us = time_us;
    m.instruments = payload == motionPayload(2) ? 2 : 3;
    m.footswitches = d[0] & 0x3F;
    m.status = d[1];
    m.invalid = get32(d + 2);
    const std::uint8_t* c = d + 6;
    for (int i = 0; i < m.instruments * kAxes; ++i, c += 2) m.counts[i] = static_cast<std::int16_t>(get16(c));
    for (int i = kEndoscope; i < kJoints; ++i, c += 2) m.counts[i] = static_cast<std::int16_t>(get16(c));
    ++counters_.motions;
    sink.onMotion(m);
  } else {
    ++counters_.unknown;
  }
}

}  // namespace vest::protocol
