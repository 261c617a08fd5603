#include "drawn_marks.h"

#include <algorithm>
#include <cmath>

#include <QPainter>

namespace vest::displays {
namespace {

using visualization_msgs::ImageMarker;

constexpr double kShown = 8.0, kLongestShown = 60.0;       // s; the first is that of a teacher's words
constexpr std::size_t kMostPoints = 500, kMostMarks = 16;  // assumed
constexpr float kLine = 0.008f, kWidest = 0.05f;           // parts of the height
constexpr double kHead = 0.06, kHeadHalf = 0.5;            // an arrow's: part of the height; rad

bool inPicture(double x, double y) {
  return x >= 0 && x <= 1 && y >= 0 && y <= 1;  // false of NaN
}

int level(float value) {
  return static_cast<int>(255 * std::clamp(std::isfinite(value) ? value : 0.0f, 0.0f, 1.0f));
}

geometry_msgs::Point point(double x, double y) {
  geometry_msgs::Point p;
  p.x = std::clamp(x, 0.0, 1.0), p.y = std::clamp(y, 0.0, 1.0);
  return p;
}

}  // namespace

bool DrawnMarks::add(const ImageMarker& mark, double now) {
  const bool circle = mark.type == ImageMarker::CIRCLE;
  if (mark.action != ImageMarker::ADD || (!circle && mark.type != ImageMarker::LINE_STRIP)) return false;
  if (circle && (!inPicture(mark.position.x, mark.position.y) || !(mark.scale > 0) || mark.scale > 2))
    return false;
  if (!circle && (mark.points.size() < 2 || mark.points.size() > kMostPoints ||
                  !std::all_of(mark.points.begin(), mark.points.end(),
                               [](const geometry_msgs::Point& p) { return inPicture(p.x, p.y); })))
    return false;
  const double asked = mark.lifetime.toSec();
  if (marks_.size() >= kMostMarks) marks_.erase(marks_.begin());
  marks_.push_back({mark, now + (asked > 0 ? std::min(asked, kLongestShown) : kShown)});
  return true;
}

bool DrawnMarks::tick(double now) {
  const auto over =
      std::remove_if(marks_.begin(), marks_.end(), [now](const Mark& m) { return now > m.until; });
  const bool some = over != marks_.end();
  marks_.erase(over, marks_.end());
  return some;
}

void DrawnMarks::paint(QPainter* to, const QRect& picture) const {
  const auto place = [&picture](const geometry_msgs::Point& p) {
    return QPointF(picture.left() + p.x * picture.width(), picture.top() + p.y * picture.height());
  };
  to->save();
  to->setRenderHint(QPainter::Antialiasing);
  to->setClipRect(picture);
  for (const Mark& mark : marks_) {
    const ImageMarker& m = mark.what;
    const bool circle = m.type == ImageMarker::CIRCLE;
    const float wide = circle || !(m.scale > 0) ? kLine : std::min(m.scale, kWidest);
    const QColor ink(level(m.outline_color.r), level(m.outline_color.g), level(m.outline_color.b));
    QPolygonF line;
    for (const geometry_msgs::Point& p : m.points) line << place(p);
    // Dark below, so that it stands out from tissue of any colour.
    for (const auto& [colour, times] : {std::pair(QColor(0, 0, 0, 160), 2.0), std::pair(ink, 1.0)}) {
      to->setPen(QPen(colour, times * std::max(1.0, static_cast<double>(wide) * picture.height()),
                      Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
      const double radius = 0.5 * static_cast<double>(m.scale) * picture.height();
      if (circle)
        to->drawEllipse(place(m.position), radius, radius);
      else
        to->drawPolyline(line);
    }
  }
  to->restore();
}

ImageMarker markOf(Stroke pen, const std::vector<QPointF>& points, double aspect) {
  ImageMarker m;
  m.action = ImageMarker::ADD;
  m.type = pen == Stroke::Circle ? ImageMarker::CIRCLE : ImageMarker::LINE_STRIP;
  m.outline_color.r = 1.0f, m.outline_color.g = 0.84f, m.outline_color.b = 0.35f, m.outline_color.a = 1;
  m.lifetime = ros::Duration(kShown);
  m.scale = kLine;
  const QPointF from = points.front(), to = points.back();
  const double dx = (to.x() - from.x()) * aspect, dy = to.y() - from.y();
  if (pen == Stroke::Circle) {
    m.position = point(from.x(), from.y());
    m.scale = static_cast<float>(std::clamp(2 * std::hypot(dx, dy), 0.02, 2.0));
  } else if (pen == Stroke::Arrow) {
    const double angle = std::atan2(dy, dx);
    m.points = {point(from.x(), from.y()), point(to.x(), to.y())};
    for (const double side : {kHeadHalf, -kHeadHalf}) {
      const double barb = angle + side;
      m.points.push_back(point(to.x() - kHead * std::cos(barb) / aspect, to.y() - kHead * std::sin(barb)));
      m.points.push_back(point(to.x(), to.y()));
    }
  } else {
    const std::size_t every = points.size() / kMostPoints + 1;
    for (std::size_t i = 0; i < points.size(); i += every)
      m.points.push_back(point(points[i].x(), points[i].y()));
    if (m.points.size() < 2) m.points.push_back(point(to.x(), to.y()));
  }
  return m;
}

}  // namespace vest::displays
