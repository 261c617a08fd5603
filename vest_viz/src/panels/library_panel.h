#pragma once

#include <string>
#include <vector>

#include <ros/subscriber.h>
#include <vest_msgs/StringStamped.h>

#include "base_panel.h"
#include "vest_tissue/modelling/library.h"

class QLabel;
class QLineEdit;
class QPushButton;
class QTreeWidget;

namespace vest::panels {

/// vest_viz/Library: what VEST ships, with a picture, licence and origin of each entry. A part is put into
/// the source that is drawn, by edits of model_node; a scene is loaded into the session.
class LibraryPanel : public BasePanel {
 public:
  explicit LibraryPanel(QWidget* parent = nullptr);

 protected:
  void connectTopics() override;

 private:
  void filter();
  void select();
  void use();
  void editAll(std::vector<modelling::Script::Line> edits, std::size_t next);
  const modelling::LibraryEntry* chosen() const;

  ros::Subscriber source_sub_;
  std::string text_;  ///< of the source as it was heard last
  std::vector<modelling::LibraryEntry> library_;
  QLineEdit* words_;
  QTreeWidget* entries_;
  QLabel *picture_, *about_, *done_, *problem_;
  QPushButton* use_;
};

}  // namespace vest::panels
