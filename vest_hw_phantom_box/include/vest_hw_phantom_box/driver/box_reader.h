// The loop that reads a box: port → decoder → driver → listener, in the calling thread.
#pragma once

#include <array>
#include <functional>
#include <mutex>
#include <string>

#include "vest_hw_phantom_box/driver/driver.h"
#include "vest_hw_phantom_box/protocol/decoder.h"
#include "vest_hw_phantom_box/transport/raw_log.h"
#include "vest_hw_phantom_box/transport/serial_port.h"

namespace vest::driver {

struct ReaderOptions {
  std::string port;
  unsigned baud_rate = 921600;
  std::string raw_log;  ///< file for every byte of the line (transport/raw_log.h); empty: none
  DriverOptions driver;
  int retry_ms = 100;                         ///< between two attempts to open the port
  Nanoseconds heartbeat = 15 * kMillisecond;  ///< footswitches at least this often (≥ 50 Hz)
};

/// What the reader tells; called from the reading thread.
class ReaderListener {
 public:
  enum class Severity { kInfo, kWarning, kError };
  virtual ~ReaderListener() = default;
  /// One per motion frame. `arrived`: steady time.
  virtual void onSample(const Driver& driver, Nanoseconds arrived) = 0;
  /// On change and as a heartbeat.
  virtual void onFootswitches(std::uint8_t pressed) = 0;
  virtual void onPedal(const PedalEvent& event) = 0;
  /// Once per occasion, not per attempt.
  virtual void onMessage(Severity severity, const std::string& text) = 0;
};

/// A copy for diagnostics.
struct ReaderStatus {
  BoxState state = BoxState::kDisconnected;
  std::string port_error;  ///< why the port is not open
  protocol::Hello box;
  bool has_box = false;
  protocol::DecoderCounters wire;
  DriverCounters driver;
  std::uint64_t reconnects = 0;  ///< connections after the first
  std::uint64_t gaps = 0;        ///< times that no good frame came for DriverOptions::stale
  Nanoseconds age = -1;          ///< of the last good frame
  std::uint8_t status = 0;       ///< the box's status byte
  std::uint8_t pressed = 0;
  std::uint8_t stuck = 0;
  std::string unusable;  ///< names of joints that exist and cannot be used
};

class BoxReader : private protocol::FrameSink {
 public:
  using Clock = std::function<Nanoseconds()>;
  /// `clock` is steady time; left empty: std::chrono::steady_clock.
  BoxReader(const calibration::Calibration& calibration, const ReaderOptions& options,
            ReaderListener& listener, Clock clock = {});

  /// Reads until stop(). Reconnects by itself.
  void run();
  /// One turn of the loop: waits for bytes for at most 5 ms.
  void runOnce();
  /// From any thread.
  void stop();
  /// From any thread.
  ReaderStatus status() const;

 private:
  void onHello(const protocol::Hello& hello, std::uint32_t time_us) override;
  void onMotion(const protocol::Motion& motion) override;
  void tryOpen(Nanoseconds now);
  void lostPort(Nanoseconds now);
  void tellLost();
  void pedals(Nanoseconds now);
  void watch(Nanoseconds now);
  void updateStatus(Nanoseconds now);
  void say(ReaderListener::Severity severity, const std::string& text);

  ReaderOptions options_;
  ReaderListener& listener_;
  Clock clock_;
  transport::SerialPort port_;
  transport::RawLog log_;
  protocol::Decoder decoder_;
  Driver driver_;
  bool stopped_ = false;
  bool ever_connected_ = false;
  bool lost_ = false;
  std::string
      lost_why_;  ///< not told yet: a box that ends with the session hangs up just before the driver ends
  Nanoseconds lost_at_ = 0;
  std::uint64_t reconnects_ = 0;
  Nanoseconds next_attempt_ = INT64_MIN;
  Nanoseconds opened_ = 0;
  Nanoseconds last_heartbeat_ = INT64_MIN / 2;
  Nanoseconds last_status_ = INT64_MIN / 2;
  BoxState last_state_ = BoxState::kDisconnected;
  bool warned_no_frames_ = false;
  bool told_running_ = false, told_silence_ = false;
  std::uint64_t gaps_ = 0;
  Nanoseconds stale_since_ = 0;
  std::uint8_t warned_stuck_ = 0;
  Nanoseconds first_attempt_ = -1;
  std::string last_open_error_;
  std::string told_open_error_;
  mutable std::mutex status_mutex_;
  ReaderStatus status_;
};

}  // namespace vest::driver
