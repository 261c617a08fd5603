#pragma once

#include <string>
#include <vector>

#include <QProcess>

#include "base_panel.h"
#include "vest_tissue/modelling/library.h"

class QLabel;
class QLineEdit;
class QPlainTextEdit;
class QPushButton;
class QTableWidget;

namespace vest::panels {

/// vest_viz/Patient: the recipe by which a patient's images become a scene (patient.yaml, docs/images.md).
/// Each value that is typed is an edit of the file, kept when the recipe's own reader takes it. Images are
/// read and meshed by vest_import, in a process of its own.
class PatientPanel : public BasePanel {
 public:
  explicit PatientPanel(QWidget* parent = nullptr);
  ~PatientPanel() override;

 protected:
  void connectTopics() override {}

 private:
  std::string recipe() const;
  void open();
  void begin();
  void showFields();
  void changed(int row);
  void addLabel();
  void deleteLabel();
  /// Takes a text that the reader takes, and writes it. Else says why not, and what is there is shown again.
  bool take(const std::string& text);
  /// Whether the file is still what was shown; else it is read again, and said.
  bool asShown();
  void edit(const std::string& op, const std::string& path, const std::string& value);
  void walk(std::size_t to);
  void startImport(const QStringList& words, std::function<void()> done);
  void runScene();

  std::vector<std::string> texts_;  ///< of the recipe; behind `at_` those that were taken back
  std::size_t at_ = 0;
  std::vector<modelling::LibraryEntry> library_;
  QLineEdit *images_, *folder_;
  QTableWidget* fields_;
  QPlainTextEdit* told_;
  QLabel* problem_;
  std::vector<QPushButton*> waits_;  ///< buttons that are off while vest_import works
  QProcess import_;
  std::function<void()> done_;
};

}  // namespace vest::panels
