#pragma once

#include <vector>

#include <QLabel>
#include <QPointer>

namespace vest::displays {

/// Keys and what they do, in the lower left corner of rviz's view, also where the endoscopic view covers it.
/// Keys that are down stand out.
class KeyLegend {
 public:
  struct Row {
    QString keys, meaning;
    bool lit = false;
  };
  /// @param host widget whose corner it takes
  explicit KeyLegend(QWidget* host);
  ~KeyLegend();
  KeyLegend(const KeyLegend&) = delete;
  KeyLegend& operator=(const KeyLegend&) = delete;
  void show(const QString& title, const std::vector<Row>& rows);

 private:
  QPointer<QLabel> label_;  ///< a child of the host, which may end first
};

}  // namespace vest::displays
