#pragma once

#include <map>
#include <string>

#include <QPixmap>

#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <vest_msgs/StringStamped.h>

#include "base_panel.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/library.h"

class QComboBox;
class QDoubleSpinBox;
class QTableWidget;
class QTreeWidget;

namespace vest::panels {

/// vest_viz/Modeller: the objects of the source that is drawn, and what it says of the chosen one. Each
/// change is an edit by the service model/edit of model_node, so that a bag has it.
class ModellerPanel : public BasePanel {
 public:
  explicit ModellerPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  using Done = std::function<void()>;
  void showSource(const std::string& text);
  void showFields();
  void select();
  void changed(int row);
  void add();
  void tie();
  void preview();
  void editAll(std::vector<modelling::Script::Line> edits, std::size_t next);
  void addNext(std::vector<modelling::Script::Line> edits, std::size_t next);
  /// Asks model_node; `done` behind an edit that it took.
  void edit(const std::string& op, const std::string& path, const std::string& value, Done done = {});
  std::string object() const;
  void choose(const std::string& name);

  ros::Subscriber source_sub_, refused_sub_;
  ros::Publisher selected_pub_;
  std::string text_;    ///< of the source as it was heard last
  std::string wanted_;  ///< object to be chosen as soon as the source has it
  std::vector<modelling::LibraryEntry> library_, parts_;
  material::Database materials_;
  std::map<std::string, QPixmap> looks_;  ///< by organ
  QTreeWidget* objects_;
  QTableWidget* fields_;
  QComboBox* part_;
  QDoubleSpinBox* within_;
  QLabel *look_, *properties_, *about_, *problem_;
};

}  // namespace vest::panels
