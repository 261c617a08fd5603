#pragma once

namespace vest::session {

/// Tells a recorder that ended without a word from one that stopped recording: session/recording comes at
/// 2 Hz, and says so when a recording is closed.
class RecorderWatch {
 public:
  /// s without a word; four of the recorder's messages.
  static constexpr double kSilent = 2.0;

  /// @param recording of SessionState; @param now s, a clock that nobody sets
  void heard(bool recording, double now) {
    recording_ = recording;
    heard_ = now;
  }
  /// It recorded, and has been silent since: what happens now is in no recording.
  bool lost(double now) const { return recording_ && now - heard_ > kSilent; }

 private:
  bool recording_ = false;
  double heard_ = 0;
};

}  // namespace vest::session
