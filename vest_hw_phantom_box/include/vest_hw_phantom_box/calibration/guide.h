// A new box's calibration, asked of a person step by step. No line, no screen: questions out, answers in.
#pragma once

#include <array>
#include <deque>
#include <string>
#include <vector>

#include "vest_hw_phantom_box/calibration/calibration.h"
#include "vest_hw_phantom_box/protocol/decoder.h"

namespace vest::calibration {

/// Counts of a box that is held still.
struct Still {
  std::array<double, protocol::kJoints> count{};  ///< mean
  std::array<bool, protocol::kJoints> rests{};    ///< measured in every frame, and within kSpread
};

/// Collects frames; says where the joints rest.
class StillReader : public protocol::FrameSink {
 public:
  static constexpr std::size_t kFrames = 100;  ///< 0.1 s of a box of 1 kHz
  static constexpr int kSpread = 40;  ///< counts; assumed: a hand that rests on an instrument, 0.2 degrees

  void onHello(const protocol::Hello& hello, std::uint32_t) override { hello_ = hello, has_hello_ = true; }
  void onMotion(const protocol::Motion& motion) override;
  /// The last kFrames frames; false as long as there are fewer.
  bool read(Still& still) const;
  /// What came before counts no more.
  void forget() { frames_.clear(); }
  bool hasHello() const { return has_hello_; }
  const protocol::Hello& hello() const { return hello_; }
  bool hasFrame() const { return !frames_.empty(); }
  const protocol::Motion& last() const { return frames_.back(); }

 private:
  std::deque<protocol::Motion> frames_;
  protocol::Hello hello_;
  bool has_hello_ = false;
};

/// Asks for each joint: its zero, a known way from there, and its two ends.
class Guide {
 public:
  /// @param arms 0 left, 1 right, 2 third, 3 endoscope. @param start what the other joints keep
  Guide(const Calibration& start, const std::vector<int>& arms, bool light_post);

  bool done() const { return at_ == steps_.size(); }
  /// What the person should do next, then press Enter.
  std::string question() const;
  /// @param line what was typed: nothing, or a number (degrees, mm) where the question asks for one, or
  /// "skip"
  /// @return empty where it was taken, else what was wrong; the question stays
  std::string answer(const std::string& line, const Still& still);
  const Calibration& calibration() const { return calibration_; }

 private:
  enum class What { Zero, Known, OneEnd, OtherEnd };
  struct Step {
    int joint;
    What what;
  };
  std::string known(int joint, const std::string& line, const Still& still);

  Calibration calibration_;
  std::vector<Step> steps_;
  std::size_t at_ = 0;
  Still zero_, end_;
};

/// A calibration file; parseCalibration() reads the same values.
std::string toYaml(const Calibration& calibration, const std::string& comment);

}  // namespace vest::calibration
