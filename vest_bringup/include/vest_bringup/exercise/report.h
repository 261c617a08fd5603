#pragma once

#include <string>
#include <vector>

#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/exercise/learning_curve.h"
#include "vest_bringup/exercise/motion_log.h"

namespace vest::exercise {

/// What hands did: 20 rows per simulated second, and places 20 ms apart.
class Trace {
 public:
  struct Row {
    double t = 0;  ///< s
    struct Tool {
      bool present = false;
      Eigen::Vector3d tip = Eigen::Vector3d::Zero();  ///< m, world
      double speed = 0, force = 0;                    ///< m/s; N, greatest since the row before
    };
    std::array<Tool, 3> tools;
  };
  /// After each step, the one that ends the exercise included.
  void add(const scene::StepInput& input, const scene::StepReport& report);
  const std::vector<Row>& rows() const { return rows_; }
  std::string toCsv() const;
  /// Figures of motion since the first phase began, the same as score items have them (MotionLog::figures).
  /// @param moments of the exercise that was traced
  session::motion::Figures motion(const std::vector<Moment>& moments) const;

 private:
  static constexpr double kEvery = 0.05;  ///< s
  MotionLog log_;
  std::uint64_t steps_ = 0;
  double time_ = 0;
  Row next_;
  std::vector<Row> rows_;
};

/// A picture of a moment.
struct Picture {
  double t = 0;  ///< s
  std::string text, jpeg;
};

/// What a teacher told the trainee.
struct Note {
  double t = 0;  ///< s
  std::string text;
};

struct Report {
  const Exercise& exercise;
  const Result& result;
  const Trace& trace;
  std::string trainee, date, version;  ///< pseudonym, or empty; ISO 8601; of VEST
  Learning learning;                   ///< of a trainee, this attempt included
  std::vector<Picture> pictures;
  std::vector<Note> notes;
};

/// One HTML page that needs nothing beside it: all texts are escaped, plots are SVG, pictures inline.
std::string toHtml(const Report& report);
/// Experience API statement (xAPI 1.0.3): the pseudonym as an account, passed or failed, scaled score,
/// duration.
std::string toXapi(const Report& report);

}  // namespace vest::exercise
