#include "image_pane.h"

#include <algorithm>
#include <cstring>

#include <QCoreApplication>
#include <QDockWidget>
#include <QEvent>
#include <QLayout>
#include <QMainWindow>
#include <QMouseEvent>
#include <QPainter>

namespace vest::displays {
namespace {
constexpr double kShareBelow = 0.58;  ///< of the frame's height, for the docks below the 3-D view
constexpr int kFrameAtRest = 50;      ///< ms after its last change of size, when its docks are laid out
}  // namespace

ImagePane::ImagePane(QWidget* parent) : QWidget(parent) {
  setAttribute(Qt::WA_OpaquePaintEvent);
  setMinimumSize(180, 144);
}

QImage ImagePane::convert(const unsigned char* rgb, int width, int height) {
  QImage image(width, height, QImage::Format_RGB32);
  for (int y = 0; y < height; ++y) {
    auto* out = reinterpret_cast<QRgb*>(image.scanLine(y));
    const unsigned char* in = rgb + 3 * static_cast<std::size_t>(y) * static_cast<std::size_t>(width);
    for (int x = 0; x < width; ++x, in += 3) out[x] = qRgb(in[0], in[1], in[2]);
  }
  return image;
}

void ImagePane::show(const QImage& image) {
  image_ = image;
  update();
}

void ImagePane::warn(const QString& words) {
  if (words == warning_) return;
  warning_ = words;
  update();
}

void ImagePane::cover(QWidget* host) {
  if (host_ != nullptr) host_->removeEventFilter(this);
  host_ = host;
  if (host == nullptr) return;
  setParent(host);
  setAttribute(
      Qt::WA_NativeWindow);  // the host draws through a window of its own; a plain child would lie below it
  host->installEventFilter(this);
  setGeometry(host->rect());
  QWidget::show();
  raise();
}

void ImagePane::fillDockOf(QMainWindow* frame) {
  frame_ = frame;
  frame->installEventFilter(this);
  arrange_.setSingleShot(true);
  arrange_.setInterval(kFrameAtRest);
  connect(&arrange_, &QTimer::timeout, this, [this] { shareFrame(); });
}

void ImagePane::shareFrame() {
  QWidget* above = parentWidget();
  while (above != nullptr && qobject_cast<QDockWidget*>(above) == nullptr) above = above->parentWidget();
  auto* const dock = static_cast<QDockWidget*>(above);
  if (dock == nullptr || dock->isFloating() || !isVisible()) return;
  const QSize shape = image_.isNull() ? sizeHint() : image_.size();
  frame_->resizeDocks({dock}, {height() * shape.width() / shape.height()}, Qt::Horizontal);
  frame_->layout()->activate();
  // rviz restores its docks before it has a size: those below the 3-D view would take all of its height.
  QList<QDockWidget*> below;
  for (QDockWidget* const other : frame_->findChildren<QDockWidget*>())
    if (frame_->dockWidgetArea(other) == Qt::BottomDockWidgetArea && other->isVisible() &&
        frame_->rect().contains(other->geometry()))
      below << other;
  QList<int> heights;
  for (int i = 0; i < below.size(); ++i) heights << static_cast<int>(kShareBelow * height()) / below.size();
  frame_->resizeDocks(below, heights, Qt::Vertical);
}

bool ImagePane::eventFilter(QObject* watched, QEvent* event) {
  if (watched == frame_ && event->type() == QEvent::Resize) arrange_.start();
  if (watched == host_ && event->type() == QEvent::Resize) {
    setGeometry(host_->rect());
    raise();
  }
  return false;
}

void ImagePane::draw(Stroke pen, std::function<void(const visualization_msgs::ImageMarker&)> drawn) {
  pen_ = pen, drawn_ = std::move(drawn);
  stroke_.clear();
  setCursor(pen == Stroke::None ? Qt::ArrowCursor : Qt::CrossCursor);
}

visualization_msgs::ImageMarker ImagePane::markOfStroke() const {
  return markOf(pen_, stroke_, static_cast<double>(place().width()) / place().height());
}

bool ImagePane::stroke(const QMouseEvent& mouse) {
  const bool begins = mouse.type() == QEvent::MouseButtonPress && mouse.button() == Qt::LeftButton;
  if (pen_ == Stroke::None || (stroke_.empty() && !begins)) return false;
  const QRect in = place();
  if (begins) stroke_.clear();
  stroke_.emplace_back((mouse.localPos().x() - in.left()) / in.width(),
                       (mouse.localPos().y() - in.top()) / in.height());
  update();
  if (mouse.type() != QEvent::MouseButtonRelease || mouse.button() != Qt::LeftButton) return true;
  const auto mark = markOfStroke();
  stroke_.clear();
  if (drawn_) drawn_(mark);
  return true;
}

bool ImagePane::event(QEvent* event) {
  switch (event->type()) {
    case QEvent::MouseButtonPress:
    case QEvent::MouseButtonRelease:
    case QEvent::MouseMove:
      if (stroke(*static_cast<QMouseEvent*>(event))) return true;
      [[fallthrough]];
    case QEvent::Wheel:
      if (host_ != nullptr) return QCoreApplication::sendEvent(host_, event);
      break;
    default:
      break;
  }
  return QWidget::event(event);
}

void ImagePane::paintEvent(QPaintEvent*) {
  QPainter painter(this);
  paintPicture(&painter);
  marks_.paint(&painter, place());
  if (stroke_.size() > 1) {
    DrawnMarks now;
    now.add(markOfStroke(), 0);
    now.paint(&painter, place());
  }
  rim_.paint(&painter, rect());
  if (warning_.isEmpty()) return;
  QFont font = painter.font();
  font.setPixelSize(std::max(14, height() / 24));
  font.setBold(true);
  painter.setFont(font);
  const QRect line(0, 0, width(), 2 * painter.fontMetrics().height());
  painter.fillRect(line, QColor(0, 0, 0, 190));
  painter.setPen(QColor(255, 60, 50));
  painter.drawText(line, Qt::AlignCenter, warning_);
}

QRect ImagePane::place() const {
  if (image_.isNull()) return rect();
  QSize size = image_.size();
  if (size.width() > width() || size.height() > height() || width() > 1.5 * size.width())
    size.scale(width(), height(), Qt::KeepAspectRatio);  // else 1:1, which costs nothing
  return {(width() - size.width()) / 2, (height() - size.height()) / 2, size.width(), size.height()};
}

void ImagePane::paintPicture(QPainter* to) {
  QPainter& painter = *to;
  if (image_.isNull()) {
    painter.fillRect(rect(), Qt::black);
    return;
  }
  const QRect place = this->place();
  painter.fillRect(0, 0, width(), place.top(), Qt::black);
  painter.fillRect(0, place.bottom() + 1, width(), height() - place.bottom() - 1, Qt::black);
  painter.fillRect(0, place.top(), place.left(), place.height(), Qt::black);
  painter.fillRect(place.right() + 1, place.top(), width() - place.right() - 1, place.height(), Qt::black);
  painter.setRenderHint(QPainter::SmoothPixmapTransform, place.size() != image_.size());
  painter.drawImage(place, image_);
}

}  // namespace vest::displays
