#pragma once

#include <vest_msgs/SessionScore.h>
#include <QRect>
#include <QString>

class QPainter;

namespace vest::displays {

/// What an exercise tells at the rim of the picture: phase, clock, forces, what to do or the hint, a word for
/// each phase that is done, the result, and what a teacher says. It is drawn over the picture that is shown,
/// never into the one that is published.
class ExerciseRim {
 public:
  /// Each: whether there is something new to draw. @param now s, any steady clock
  bool instruct(const QString& words);
  bool score(const vest_msgs::SessionScore& score, double now);
  bool teacherSays(const QString& words, double now);
  /// Drops what has been shown long enough.
  bool tick(double now);
  void clear();

  void paint(QPainter* to, const QRect& place) const;

 private:
  static constexpr double kDoneShown = 2.5, kWordsShown = 8.0, kResultShown = 20.0;  ///< s
  QString instruction_, phase_, clock_, left_, right_, done_, result_, reason_, words_;
  std::uint32_t phase_number_ = 0;
  bool hint_ = false, passed_ = false;
  double done_until_ = 0, words_until_ = 0, result_until_ = 0;
};

}  // namespace vest::displays
