#include "vest_hw_phantom_box/emulator/emulator.h"

#include <algorithm>

namespace vest::emulator {

using protocol::Bytes;
using protocol::kJoints;

void FaultInjector::disturb(protocol::Motion& m) {
  if (chance(faults_.jump)) {
    const std::size_t joint = pick(0, kJoints - 1);
    m.counts[joint] = static_cast<std::int16_t>(m.counts[joint] + (m.counts[joint] > 0 ? -9000 : 9000));
  }
  if (chance(faults_.invalid)) {
    m.invalid |= 1u << pick(0, kJoints - 1);
    m.status |= protocol::kSensorFault;
  }
  const std::uint8_t changed = static_cast<std::uint8_t>(m.footswitches ^ last_pedals_);
  last_pedals_ = m.footswitches;
  if (changed && chance(faults_.chatter)) {
    bouncing_ = changed;
    bounce_left_ = 8;
  }
  if (bounce_left_ > 0) {
    --bounce_left_;
    if (chance(0.5)) m.footswitches = static_cast<std::uint8_t>(m.footswitches ^ bouncing_);
  }
}

void FaultInjector::transmit(const Bytes& frame, Bytes& line) {
  line.insert(line.end(), held_.begin(), held_.end());
  held_.clear();
  if (frame.empty() || chance(faults_.drop)) return;
  if (chance(faults_.garbage))
    for (std::size_t n = pick(1, 40); n > 0; --n) line.push_back(static_cast<std::uint8_t>(pick(0, 255)));
  Bytes damaged;
  const Bytes* out = &frame;
  const bool flip = chance(faults_.flip), lose = chance(faults_.lose);
  if (flip || lose) {
    damaged = frame;
    if (flip)
      for (std::size_t n = pick(1, 3); n > 0; --n)
        damaged[pick(0, damaged.size() - 1)] ^= static_cast<std::uint8_t>(1u << pick(0, 7));
    if (lose) {
      const std::size_t from = pick(0, damaged.size() - 1);
      const std::size_t n = std::min(pick(1, 20), damaged.size() - from);
      damaged.erase(damaged.begin() + static_cast<long>(from), damaged.begin() + static_cast<long>(from + n));
    }
    out = &damaged;
  }
  const bool split = out->size() > 1 && chance(faults_.split);
  const std::size_t cut = split ? pick(1, out->size() - 1) : out->size();
  line.insert(line.end(), out->begin(), out->begin() + static_cast<long>(cut));
  held_.assign(out->begin() + static_cast<long>(cut), out->end());
}

Emulator::Emulator(const calibration::Calibration& calibration, int instruments, const Faults& faults,
                   const std::string& serial_number)
    : calibration_(calibration), injector_(faults) {
  hello_.instruments = static_cast<std::uint8_t>(instruments);
  hello_.serial_number = serial_number;
  last_.instruments = hello_.instruments;
}

void Emulator::restart() {
  start_ = true;
  sequence_ = 0;
  ticks_ = 0;
}

void Emulator::skip(std::uint64_t frames) {
  sequence_ = static_cast<std::uint16_t>(sequence_ + frames);
  ticks_ += frames;
}

void Emulator::tick(const Pose& pose, Bytes& line) {
  const auto time_us = static_cast<std::uint32_t>(ticks_ * 1000);
  if (start_ || ticks_ % 1000 == 0) {
    hello_.start = start_;
    start_ = false;
    frame_.clear();
    encode(hello_, sequence_++, time_us, frame_);
    injector_.transmit(frame_, line);
  }
  protocol::Motion& m = last_;
  m.sequence = sequence_++;
  m.time_us = time_us;
  m.footswitches = pose.footswitches;
  // Only bits of joints that travel in this frame.
  const std::uint32_t present = m.instruments == 3 ? 0xFFFFFu : 0xFFFFFu & ~(0x1Fu << 10);
  m.invalid = pose.invalid & present;
  m.status = m.invalid ? protocol::kSensorFault : 0;
  for (int i = 0; i < kJoints; ++i) m.counts[i] = calibration_.joints[i].count(pose.joints[i]);
  protocol::Motion sent = m;
  injector_.disturb(sent);
  frame_.clear();
  encode(sent, frame_);
  injector_.transmit(frame_, line);
  ++ticks_;
}

}  // namespace vest::emulator
