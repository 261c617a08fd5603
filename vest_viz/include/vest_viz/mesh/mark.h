#pragma once

namespace vest::mesh {

/// Whether a skin is drawn with what happened to it. It turns on at once, and off only when nothing was to be
/// seen for a while: each change builds the mesh again, and supply swings by 4 % in each beat of the heart.
class Mark {
 public:
  static constexpr float kLeast = 0.02f;  ///< share of a field's range from which on it is drawn (tuned)
  static constexpr int kWait = 50;        ///< looks: 5 s of a field that comes ten times a second
  /// @param largest 0 … 1, of all fields at all vertices  @return whether it changed
  bool look(float largest) {
    calm_ = largest > kLeast ? 0 : calm_ + 1;
    const bool on = largest > kLeast || (on_ && calm_ < kWait);
    const bool changed = on != on_;
    on_ = on;
    return changed;
  }
  bool on() const { return on_; }
  void clear() { on_ = false, calm_ = 0; }

 private:
  bool on_ = false;
  int calm_ = 0;
};

}  // namespace vest::mesh
