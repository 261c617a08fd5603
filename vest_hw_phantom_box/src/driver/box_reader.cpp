#include "vest_hw_phantom_box/driver/box_reader.h"

#include <chrono>

namespace vest::driver {

using Severity = ReaderListener::Severity;

BoxReader::BoxReader(const calibration::Calibration& calibration, const ReaderOptions& options,
                     ReaderListener& listener, Clock clock)
    : options_(options), listener_(listener), clock_(std::move(clock)), driver_(calibration, options.driver) {
  if (!clock_)
    clock_ = [] {
      return std::chrono::duration_cast<std::chrono::nanoseconds>(
                 std::chrono::steady_clock::now().time_since_epoch())
          .count();
    };
  if (options_.raw_log.empty()) return;
  const std::string error = log_.open(options_.raw_log);
  if (!error.empty()) listener_.onMessage(Severity::kError, "raw_log '" + options_.raw_log + "': " + error);
}

void BoxReader::say(Severity severity, const std::string& text) {
  listener_.onMessage(severity, "port '" + options_.port + "': " + text);
}

void BoxReader::run() {
  while (!stopped_) runOnce();
  port_.close();
}

void BoxReader::stop() {
  port_.wake();
}

void BoxReader::runOnce() {
  Nanoseconds now = clock_();
  if (!port_.isOpen() && now >= next_attempt_) tryOpen(now);
  if (port_.isOpen()) {
    std::array<std::uint8_t, 4096> bytes;
    std::size_t size = 0;
    switch (port_.read(bytes.data(), bytes.size(), 5, size)) {
      case transport::SerialPort::Read::kData:
        if (log_.isOpen() && !log_.write(clock_(), bytes.data(), size))
          listener_.onMessage(Severity::kError,
                              "raw_log '" + options_.raw_log + "': cannot be written any more; the log ends");
        decoder_.feed(bytes.data(), size, *this);
        break;
      case transport::SerialPort::Read::kTimeout:
        break;
      case transport::SerialPort::Read::kWoken:
        stopped_ = true;
        break;
      case transport::SerialPort::Read::kClosed:
        lostPort(clock_());
        break;
    }
  } else {
    stopped_ = port_.sleep(10);
  }
  now = clock_();
  if (now - lost_at_ > 300 * kMillisecond) tellLost();
  driver_.tick(now);
  pedals(now);
  watch(now);
  if (now - last_status_ > 50 * kMillisecond) updateStatus(now);
}

void BoxReader::tryOpen(Nanoseconds now) {
  next_attempt_ = now + options_.retry_ms * kMillisecond;
  const std::string error = port_.open(options_.port, options_.baud_rate);
  if (!error.empty()) {
    // That a lost port does not exist for now is no news, and one that is just being made gets a second.
    if (first_attempt_ < 0) first_attempt_ = now;
    const bool absent = error.rfind("No such file", 0) == 0;
    const bool patient = !ever_connected_ && now - first_attempt_ < 1000 * kMillisecond;
    const bool known = error == told_open_error_ || (absent && (lost_ || patient));
    if (!known) {
      say(Severity::kError, error + " (trying again until it works)");
      told_open_error_ = error;
    }
    last_open_error_ = error;
    return;
  }
  tellLost();
  last_open_error_.clear();
  told_open_error_.clear();
  lost_ = false;
  decoder_.reset();
  driver_.connected(now);
  opened_ = now;
  warned_no_frames_ = false;
  if (ever_connected_) ++reconnects_;
  ever_connected_ = true;
  say(Severity::kInfo, "open at " + std::to_string(options_.baud_rate) + " baud");
}

void BoxReader::lostPort(Nanoseconds now) {
  driver_.disconnected(now);
  decoder_.reset();
  told_running_ = false;
  last_open_error_ = port_.error();
  lost_ = true;
  lost_why_ = port_.error();
  lost_at_ = now;
  next_attempt_ = now;
  updateStatus(now);
}

void BoxReader::tellLost() {
  if (lost_why_.empty()) return;
  say(Severity::kError, "lost (" + lost_why_ + "); trying again until it is back");
  lost_why_.clear();
}

void BoxReader::onHello(const protocol::Hello& hello, std::uint32_t) {
  const Nanoseconds now = clock_();
  const bool first = !driver_.hasHello();
  driver_.hello(hello, now);
  if (!first) return;
  if (hello.version_major != protocol::kVersionMajor)
    say(Severity::kError, "the box speaks protocol version " + std::to_string(hello.version_major) + "." +
                              std::to_string(hello.version_minor) + "; allowed: version " +
                              std::to_string(protocol::kVersionMajor));
  else
    say(Severity::kInfo, "box " + hello.serial_number + ", " + std::to_string(hello.instruments) +
                             " instruments, " + std::to_string(hello.rate_hz) + " Hz");
}

void BoxReader::onMotion(const protocol::Motion& motion) {
  const Nanoseconds now = clock_();
  if (driver_.motion(motion, now)) listener_.onSample(driver_, now);
  pedals(now);
}

void BoxReader::pedals(Nanoseconds now) {
  std::array<PedalEvent, 4 * protocol::kFootswitches> events;
  const int n = driver_.footswitches().take(events);
  for (int i = 0; i < n; ++i) listener_.onPedal(events[i]);
  if (n > 0 || now - last_heartbeat_ >= options_.heartbeat) {
    listener_.onFootswitches(driver_.footswitches().pressed());
    last_heartbeat_ = now;
  }
}

void BoxReader::watch(Nanoseconds now) {
  const BoxState state = driver_.state(now);
  // A busy machine holds an emulator or this thread up for longer than DriverOptions::stale: counted. What
  // lasts is told.
  constexpr Nanoseconds kSilence = 500 * kMillisecond;
  if (state == BoxState::kStale && last_state_ != BoxState::kStale) {
    ++gaps_;
    stale_since_ = now;
  }
  if (state == BoxState::kStale && !told_silence_ && now - stale_since_ > kSilence) {
    told_silence_ = true;
    say(Severity::kError, "connected, but no good frame for 0.5 s");
  }
  if (state == BoxState::kFault && told_running_) {
    updateStatus(now);
    say(Severity::kError, "sensor fault; left out until they read well again: " + status_.unusable);
    told_running_ = false;
  }
  if (state == BoxState::kRunning) {
    if (!told_running_ || told_silence_) say(Severity::kInfo, "running");
    told_running_ = true;
    told_silence_ = false;
  }
  last_state_ = state;
  constexpr Nanoseconds kPatience = 2000 * kMillisecond;  // a box says hello once a second
  if (state == BoxState::kNoHello && !warned_no_frames_ && now - opened_ > kPatience) {
    warned_no_frames_ = true;
    const auto& wire = decoder_.counters();
    say(Severity::kError, "open for 2 s, but no box has said hello (" + std::to_string(wire.bytes) +
                              " bytes, " + std::to_string(wire.frames) +
                              " good frames so far); allowed: a box that speaks "
                              "docs/phantom_box_protocol.md at baud_rate " +
                              std::to_string(options_.baud_rate));
  }
  const std::uint8_t stuck = driver_.footswitches().stuck(now);
  if (stuck & ~warned_stuck_) say(Severity::kWarning, "a footswitch has been down for more than a minute");
  warned_stuck_ = stuck;
}

void BoxReader::updateStatus(Nanoseconds now) {
  last_status_ = now;
  const std::lock_guard<std::mutex> lock(status_mutex_);
  status_.state = driver_.state(now);
  status_.port_error = last_open_error_;
  status_.has_box = driver_.hasHello();
  status_.box = driver_.box();
  status_.wire = decoder_.counters();
  status_.driver = driver_.counters();
  status_.reconnects = reconnects_;
  status_.gaps = gaps_;
  status_.age = driver_.age(now);
  status_.status = driver_.status();
  status_.pressed = driver_.footswitches().pressed();
  status_.stuck = driver_.footswitches().stuck(now);
  status_.unusable.clear();
  for (int i = 0; i < protocol::kJoints; ++i)
    if (driver_.has(i) && !driver_.usable(i))
      status_.unusable += (status_.unusable.empty() ? "" : " ") + protocol::jointNames()[i];
}

ReaderStatus BoxReader::status() const {
  const std::lock_guard<std::mutex> lock(status_mutex_);
  return status_;
}

}  // namespace vest::driver
