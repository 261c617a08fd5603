#include "vest_hw_phantom_box/driver/driver.h"

#include <algorithm>
#include <cmath>

namespace vest::driver {

using protocol::kJoints;

const char* toString(BoxState state) {
  switch (state) {
    case BoxState::kDisconnected:
      return "disconnected";
    case BoxState::kNoHello:
      return "waiting for the box to say who it is";
    case BoxState::kIncompatible:
      return "protocol version not supported";
    case BoxState::kStale:
      return "no data";
    case BoxState::kSettling:
      return "waiting for the readings to settle";
    case BoxState::kFault:
      return "sensor fault";
    case BoxState::kRunning:
      return "running";
  }
  return "?";
}

Driver::Driver(const calibration::Calibration& calibration, const DriverOptions& options)
    : calibration_(calibration), options_(options), footswitches_(options.footswitches) {}

void Driver::forgetMotion() {
  for (Guard& g : guards_) g = Guard{};
  for (JointReading& j : sample_.joints) j = JointReading{};
  has_time_ = false;
  ++epoch_;
  joint_fault_ = settling_ = false;
}

void Driver::connected(Nanoseconds now) {
  connected_ = true;
  has_hello_ = has_frame_ = false;
  status_ = 0;
  forgetMotion();
  footswitches_.newConnection();
  footswitches_.tick(now);
}

void Driver::disconnected(Nanoseconds now) {
  connected_ = false;
  has_hello_ = false;
  forgetMotion();
  footswitches_.tick(now);
}

void Driver::hello(const protocol::Hello& hello, Nanoseconds now) {
  if (hello.start || (has_hello_ && hello.instruments != hello_.instruments)) {
    forgetMotion();
    footswitches_.newConnection();
  }
  hello_ = hello;
  has_hello_ = true;
  has_frame_ = true;
  last_frame_ = now;
}

bool Driver::has(int joint) const {
  if (!has_hello_) return false;
  const int arm = joint / protocol::kAxes;
  if (joint == protocol::kLightPost) return hello_.light_post && calibration_.has_light_post;
  if (arm == protocol::kMaxInstruments) return true;
  return arm < hello_.instruments && (arm < 2 || calibration_.has_third);
}

bool Driver::motion(const protocol::Motion& m, Nanoseconds now) {
  tick(now);
  if (!has_hello_ || hello_.version_major != protocol::kVersionMajor) return false;
  if (m.instruments != hello_.instruments) {
    ++counters_.mismatched;
    return false;
  }
  const std::int64_t step_us = has_time_ ? static_cast<std::int32_t>(m.time_us - last_us_) : 0;
  if (has_time_ && step_us <= 0) {
    // The box's clock went back without a hello: nothing before it can be compared with.
    forgetMotion();
    footswitches_.newConnection();
  }
  device_us_ = has_time_ ? device_us_ + step_us : m.time_us;
  last_us_ = m.time_us;
  has_time_ = true;
  last_frame_ = now;
  has_frame_ = true;
  status_ = m.status;

  if (!(m.status & protocol::kPedalsMissing)) footswitches_.reading(m.footswitches, device_us_ * 1000, now);

  const bool box_usable = !(m.status & (protocol::kNotReferenced | protocol::kInternalError));
  joint_fault_ = settling_ = false;
  for (int i = 0; i < kJoints; ++i) {
    if (!has(i)) continue;
    joint(i, m, box_usable);
    const bool missing = !sample_.joints[i].usable;
    joint_fault_ |= missing && guards_[i].broken;
    settling_ |= missing && !guards_[i].broken;
  }
  sample_.time_us = m.time_us;
  return true;
}

void Driver::joint(int i, const protocol::Motion& m, bool box_usable) {
  const calibration::Joint& c = calibration_.joints[i];
  Guard& g = guards_[i];
  JointReading& out = sample_.joints[i];
  const double raw = c.position(m.counts[i]);
  const bool reading = box_usable && !(m.invalid & (1u << i)) && m.counts[i] != protocol::kNoReading;
  // Two counts of noise are never a jump. What is not finite is consistent with nothing: the comparison is
  // false.
  const auto consistent = [&](double from, std::int64_t from_us) {
    const double dt = 1e-6 * static_cast<double>(device_us_ - from_us);
    return std::abs(c.near(raw, from) - from) <= c.max_speed * dt + 2 * c.per_count;
  };
  const std::int64_t hold_us = options_.hold / 1000;

  if (reading) {
    const bool comparable = g.has_raw && device_us_ - g.last_raw_us <= hold_us;
    const bool follows = comparable && consistent(g.last_raw, g.last_raw_us);
    g.broken |= comparable && !follows;
    g.settled = follows ? std::min(g.settled + 1, options_.settle) : 0;
    g.last_raw = raw;
    g.last_raw_us = device_us_;
    g.has_raw = true;
  } else {
    g.settled = 0;
    g.has_raw = false;
    g.broken = true;
  }

  // A hole that is older than the hold leaves nothing to compare with: as after a fault.
  if (g.accepted && device_us_ - g.good_us > hold_us) {
    g.accepted = false;
    ++counters_.faults;
  }
  const bool good = reading && (g.accepted ? consistent(g.good, g.good_us) : g.settled >= options_.settle);
  if (good) {
    const double dt = 1e-6 * static_cast<double>(device_us_ - g.good_us);
    const double position = c.near(raw, g.good);
    if (g.accepted) {
      const double gain = dt / (options_.velocity_time_constant + dt);
      g.velocity += gain * ((position - g.good) / dt - g.velocity);
    } else {
      g.velocity = 0;
    }
    g.accepted = true;
    g.broken = false;
    g.good = position;
    g.good_us = device_us_;
    out.position = std::clamp(position, c.min, c.max);
    if (out.position != position) ++counters_.clamped;
    out.velocity = g.velocity;
    out.usable = true;
    return;
  }
  if (!reading || g.accepted) ++counters_.rejected;
  out.usable = g.accepted;  // held: same position, and no motion claimed
  out.velocity = 0;
}

void Driver::tick(Nanoseconds now) {
  footswitches_.tick(now);
}

BoxState Driver::state(Nanoseconds now) const {
  if (!connected_) return BoxState::kDisconnected;
  if (!has_hello_) return BoxState::kNoHello;
  if (hello_.version_major != protocol::kVersionMajor) return BoxState::kIncompatible;
  if (now - last_frame_ > options_.stale) return BoxState::kStale;
  if (joint_fault_) return BoxState::kFault;
  return settling_ || !has_time_ ? BoxState::kSettling : BoxState::kRunning;
}

}  // namespace vest::driver
