#include "key_legend.h"

namespace vest::displays {

KeyLegend::KeyLegend(QWidget* host) : label_(new QLabel(host)) {
  label_->setAttribute(Qt::WA_NativeWindow);  // the host draws through a window of its own
  label_->setAttribute(Qt::WA_TransparentForMouseEvents);
  label_->setStyleSheet(
      "background: #14161a; color: white; font-size: 13px; padding: 6px; border: 1px solid #4a4f58");
  label_->setTextFormat(Qt::RichText);
}

KeyLegend::~KeyLegend() {
  delete label_;
}

void KeyLegend::show(const QString& title, const std::vector<Row>& rows) {
  if (!label_) return;
  QString text = "<b>" + title.toHtmlEscaped() + "</b><table>";
  for (const Row& r : rows) {
    text += QString("<tr><td style='padding-right: 10px; color: %1'>%2</td><td>%3</td></tr>")
                .arg(r.lit ? "#ffd84a" : "#9fc4ff", r.keys.toHtmlEscaped(), r.meaning.toHtmlEscaped());
  }
  text += "</table>";
  if (label_->text() != text) {
    label_->setText(text);
    label_->adjustSize();
  }
  label_->move(12, label_->parentWidget()->height() - label_->height() - 12);
  label_->show();
  label_->raise();
}

}  // namespace vest::displays
