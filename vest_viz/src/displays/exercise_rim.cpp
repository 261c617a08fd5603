#include "exercise_rim.h"

#include <algorithm>

#include <QPainter>

namespace vest::displays {
namespace {

QString words(const std::string& name) {
  return QString::fromStdString(name).replace('_', ' ');
}

QString minutes(double seconds) {
  const int s = static_cast<int>(std::clamp(seconds, 0.0, 86400.0));
  return QString("%1:%2").arg(s / 60).arg(s % 60, 2, 10, QChar('0'));
}

const QColor kShade(0, 0, 0, 150), kPlain(230, 230, 230), kHint(255, 215, 90), kGood(70, 200, 140),
    kBad(255, 120, 80);

/// A line of text on a shade that is no wider than it.
void label(QPainter* to, const QRect& place, int flags, const QString& text, const QColor& colour) {
  if (text.isEmpty()) return;
  to->setPen(colour);
  QRect box = to->fontMetrics().boundingRect(place, flags | Qt::TextWordWrap, text);
  const int edge = to->fontMetrics().height() / 3;
  to->fillRect(box.adjusted(-edge, 0, edge, 0), kShade);
  to->drawText(place, flags | Qt::TextWordWrap, text);
}

}  // namespace

bool ExerciseRim::instruct(const QString& text) {
  if (text == instruction_) return false;
  instruction_ = text;
  return true;
}

bool ExerciseRim::score(const vest_msgs::SessionScore& m, double now) {
  const bool further = m.phase_number == phase_number_ + 1;
  if (further && !phase_.isEmpty()) {
    done_ = phase_ + ": done";
    done_until_ = now + kDoneShown;
  }
  if (m.finished) {
    result_ = QString("%1, %2 of 100").arg(m.passed ? "PASSED" : "NOT PASSED").arg(m.total, 0, 'f', 0);
    result_until_ = now + kResultShown;
    reason_ = m.failed_by.empty() ? "" : QString::fromStdString(m.failed_by.front());
  } else {
    result_.clear(), reason_.clear();
  }
  passed_ = m.passed, hint_ = m.hint;
  phase_number_ = m.finished ? 0 : m.phase_number;
  phase_ = words(m.phase);
  clock_ = minutes(m.elapsed) + " / " + minutes(m.limit);
  left_ = QString("%1 N").arg(m.force[0], 0, 'f', 1);
  right_ = QString("%1 N").arg(m.force[1], 0, 'f', 1);
  return true;
}

bool ExerciseRim::teacherSays(const QString& text, double now) {
  words_ = text;
  words_until_ = now + kWordsShown;
  return true;
}

bool ExerciseRim::tick(double now) {
  if (!result_.isEmpty() && now > result_until_) {
    clear();
    return true;
  }
  const bool over = (!done_.isEmpty() && now > done_until_) || (!words_.isEmpty() && now > words_until_);
  if (!done_.isEmpty() && now > done_until_) done_.clear();
  if (!words_.isEmpty() && now > words_until_) words_.clear();
  return over;
}

void ExerciseRim::clear() {
  *this = ExerciseRim();
}

void ExerciseRim::paint(QPainter* to, const QRect& place) const {
  QFont font = to->font();
  font.setPixelSize(std::max(12, place.height() / 32));
  to->setFont(font);
  const int edge = to->fontMetrics().height() / 2;
  const QRect in = place.adjusted(2 * edge, edge, -2 * edge, -edge);
  if (!phase_.isEmpty())
    label(to, in, Qt::AlignLeft | Qt::AlignTop, QString("%1  %2").arg(phase_number_).arg(phase_), kPlain);
  label(to, in, Qt::AlignRight | Qt::AlignTop, clock_, kPlain);
  QRect lower = in;
  if (!instruction_.isEmpty()) {
    const int flags = Qt::AlignCenter | Qt::TextWordWrap;
    const int high =
        to->fontMetrics().boundingRect(0, 0, in.width(), place.height(), flags, instruction_).height();
    const QRect strip(place.left(), place.bottom() + 1 - high - edge, place.width(), high + edge);
    to->fillRect(strip, kShade);
    to->setPen(hint_ ? kHint : kPlain);
    to->drawText(QRect(in.left(), strip.top(), in.width(), strip.height()), flags, instruction_);
    lower.setBottom(strip.top() - edge);
  }
  label(to, lower, Qt::AlignLeft | Qt::AlignBottom, left_, kPlain);
  label(to, lower, Qt::AlignRight | Qt::AlignBottom, right_, kPlain);
  const QRect upper = in.adjusted(0, 2 * to->fontMetrics().height(), 0, 0);
  if (!words_.isEmpty()) label(to, upper, Qt::AlignHCenter | Qt::AlignTop, "Teacher: " + words_, kHint);
  if (!done_.isEmpty() && result_.isEmpty()) label(to, in, Qt::AlignHCenter | Qt::AlignTop, done_, kGood);
  if (result_.isEmpty()) return;
  label(to, lower, Qt::AlignHCenter | Qt::AlignBottom, reason_, kPlain);
  font.setPixelSize(std::max(18, place.height() / 16));
  font.setBold(true);
  to->setFont(font);
  label(to, upper, Qt::AlignHCenter | Qt::AlignTop, result_, passed_ ? kGood : kBad);
}

}  // namespace vest::displays
