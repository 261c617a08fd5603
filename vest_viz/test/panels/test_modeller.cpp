// Protects drawing by hand, at the level of the launch file: a handle that is dragged and a field that is
// typed change the bytes of source.yaml that they mean, refusals are told in one line, undo gives back the
// file.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <QApplication>
#include <QComboBox>
#include <QDoubleSpinBox>
#include <QLabel>
#include <QPushButton>
#include <QTableWidget>
#include <QTreeWidget>

#include <ros/ros.h>
#include <vest_msgs/ModelEdit.h>
#include <vest_msgs/StringStamped.h>
#include <vest_msgs/TissueTopology.h>
#include <visualization_msgs/InteractiveMarkerFeedback.h>
#include <visualization_msgs/InteractiveMarkerInit.h>
#include <visualization_msgs/InteractiveMarkerUpdate.h>
#include <visualization_msgs/Marker.h>

#include "../spin.h"
#include "modeller_panel.h"

namespace vest::panels {
namespace {

using visualization_msgs::InteractiveMarkerFeedback;

std::string read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

/// The panel, the hand in the view, and whoever listens.
class Drawing : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(ros::param::get("~folder", folder_));
    std::string file;
    ASSERT_TRUE(ros::param::get("~start", file));
    start_ = read(file);
    source_sub_ = vest_.subscribe<vest_msgs::StringStamped>(
        "model/source", 20, [this](const vest_msgs::StringStampedConstPtr& msg) { source_ = msg->string; });
    edit_sub_ = vest_.subscribe<vest_msgs::ModelEdit>(
        "model/edits", 1000, [this](const vest_msgs::ModelEditConstPtr& msg) { edits_ = msg->seq; });
    topology_sub_ = vest_.subscribe<vest_msgs::TissueTopology>(
        "model/topology", 2, [this](const vest_msgs::TissueTopologyConstPtr& msg) {
          revision_ = msg->revision;
          objects_ = msg->objects.size();
        });
    lines_sub_ = vest_.subscribe<visualization_msgs::Marker>(
        "model/lines", 20, [this](const visualization_msgs::MarkerConstPtr& msg) { lines_ = *msg; });
    markers_sub_ = vest_.subscribe<visualization_msgs::InteractiveMarkerInit>(
        "model/handles/update_full", 20,
        [this](const visualization_msgs::InteractiveMarkerInitConstPtr& msg) {
          handles_.clear();
          for (const auto& marker : msg->markers) handles_[marker.name] = marker;
        });
    hand_ = vest_.advertise<InteractiveMarkerFeedback>("model/handles/feedback", 100);
    panel_.initialize(nullptr);
    panel_.resize(560, 700);
    panel_.show();
    ASSERT_TRUE(spin([&] { return !source_.empty() && hand_.getNumSubscribers() > 0; }));
    ASSERT_TRUE(spin([&] { return tree()->topLevelItemCount() > 0; }));
  }

  QTreeWidget* tree() { return panel_.findChild<QTreeWidget*>(); }
  QTableWidget* table() { return panel_.findChild<QTableWidget*>(); }
  void click(const char* text) {
    for (QPushButton* const b : panel_.findChildren<QPushButton*>())
      if (b->text() == text) return b->click();
    ADD_FAILURE() << text;
  }
  bool says(const QString& text) {
    for (const QLabel* const label : panel_.findChildren<QLabel*>())
      if (label->isVisible() && label->text().contains(text)) return true;
    return false;
  }
  void choose(const QString& name) {
    const auto items = tree()->findItems(name, Qt::MatchExactly);
    ASSERT_EQ(items.size(), 1) << name.toStdString();
    tree()->setCurrentItem(items[0]);
  }
  int rowOf(const QString& path) {
    for (int row = 0; row < table()->rowCount(); ++row)
      if (table()->item(row, 0)->text() == path) return row;
    return -1;
  }
  void type(const QString& path, const QString& value) {
    const int row = rowOf(path);
    ASSERT_GE(row, 0) << path.toStdString();
    table()->item(row, 1)->setText(value);
  }
  void feel(const std::string& handle, std::uint8_t event, double x, double y, double z) {
    InteractiveMarkerFeedback said;
    said.header.frame_id = "world";
    said.client_id = "hand";
    said.marker_name = handle;
    said.control_name = "drag";
    said.event_type = event;
    said.pose.position.x = x, said.pose.position.y = y, said.pose.position.z = z;
    said.pose.orientation.w = 1;
    hand_.publish(said);
  }
  /// What the source is after a change. What was there before is no answer.
  bool becomes(const std::string& text) {
    const bool came = spin([&] { return source_ == text; });
    EXPECT_EQ(source_, text);
    return came;
  }

  ros::NodeHandle vest_{"/vest"};
  std::string folder_, start_, source_;
  std::uint32_t edits_ = 0, revision_ = 0;
  std::size_t objects_ = 0;
  visualization_msgs::Marker lines_;
  std::map<std::string, visualization_msgs::InteractiveMarker> handles_;
  ros::Subscriber source_sub_, edit_sub_, topology_sub_, lines_sub_, markers_sub_;
  ros::Publisher hand_;
  ModellerPanel panel_;
};

TEST_F(Drawing, HandlesAndFieldsEditTheSourceAndUndoGivesItsBytesBack) {
  ASSERT_EQ(source_, start_) << "a new file begins as the one that was named";
  EXPECT_EQ(tree()->topLevelItem(0)->text(0), "vessel");
  EXPECT_EQ(tree()->topLevelItem(0)->text(1), "tube");
  EXPECT_EQ(tree()->topLevelItem(0)->text(3), "vein");
  EXPECT_EQ(tree()->topLevelItem(1)->text(1), "included part");
  choose("vessel");
  ASSERT_TRUE(spin([&] { return handles_.count("/tube/centre/1") == 1; }));
  EXPECT_EQ(handles_.size(), 6u) << "three points, all of them, two radii";
  EXPECT_EQ(handles_["/tube/centre/1"].menu_entries.size(), 2u);
  ASSERT_GE(rowOf("friction"), 0);
  EXPECT_EQ(table()->item(rowOf("friction"), 1)->text(), "0.10");
  EXPECT_EQ(table()->item(rowOf("friction"), 3)->text(), QString::fromUtf8("0 … 2"));
  EXPECT_EQ(table()->item(rowOf("support"), 2)->text(), "rad/s");

  // What it looks like, and what its material is.
  const auto look = [&] { return panel_.findChild<QLabel*>("look")->pixmap(Qt::ReturnByValue).toImage(); };
  const QImage vein = look();
  ASSERT_FALSE(vein.isNull());
  EXPECT_TRUE(says("youngs_modulus 150000 Pa (assumed)"))
      << panel_.findChild<QLabel*>("properties")->text().toStdString();

  // A drag: lines follow the hand, the source waits for it to let go.
  const std::uint32_t revision = revision_;
  feel("/tube/centre/1", InteractiveMarkerFeedback::MOUSE_DOWN, 0, 0.05, 0.06);
  for (int i = 1; i <= 5; ++i)
    feel("/tube/centre/1", InteractiveMarkerFeedback::POSE_UPDATE, 0, 0.05, 0.06 + 0.002 * i);
  const auto highest = [&] {
    double z = 0;
    for (const auto& point : lines_.points) z = std::max(z, point.z);
    return z;
  };
  ASSERT_TRUE(spin([&] { return highest() > 0.069; }));
  EXPECT_EQ(source_, start_);
  feel("/tube/centre/1", InteractiveMarkerFeedback::MOUSE_UP, 0, 0.05, 0.07);
  const std::string dragged = replaced(start_, "[0, 0.05,0.06]", "[0, 0.05, 0.07]");
  ASSERT_TRUE(becomes(dragged));
  EXPECT_TRUE(spin([&] { return revision_ > revision && edits_ == 1; }))
      << "the organ is built anew, and told";

  // A radius goes along its axis alone; 4 mm and 1 beside it are 5.
  feel("/tube/sections/0/radii/0", InteractiveMarkerFeedback::MOUSE_DOWN, -0.03, 0.05, 0.064);
  feel("/tube/sections/0/radii/0", InteractiveMarkerFeedback::MOUSE_UP, -0.03, 0.07, 0.0654);
  ASSERT_TRUE(spin([&] { return source_ != dragged; }));
  const std::size_t place = source_.find("radii: [") + 8;
  EXPECT_NEAR(std::stod(source_.substr(place)), 0.0049, 0.0006);
  const std::string wider = source_;
  ASSERT_EQ(wider.substr(source_.find(']', place)), dragged.substr(dragged.find(']', place)));

  // A click is no edit.
  feel("/tube/centre/0", InteractiveMarkerFeedback::MOUSE_DOWN, -0.03, 0.05, 0.06);
  feel("/tube/centre/0", InteractiveMarkerFeedback::MOUSE_UP, -0.03, 0.05, 0.06);

  // The panel: a number as it is typed, one that is refused, and one that the source did not have.
  type("friction", "0.250");
  const std::string rough = replaced(wider, "0.10   # as typed", "0.250   # as typed");
  ASSERT_TRUE(becomes(rough));
  EXPECT_TRUE(spin([&] { return edits_ >= 3; }));
  EXPECT_EQ(edits_, 3u);
  type("friction", "5");
  EXPECT_TRUE(spin([&] { return says("friction"); })) << "refused in one line";
  EXPECT_EQ(source_, rough);
  EXPECT_TRUE(spin([&] { return table()->item(rowOf("friction"), 1)->text() == "0.250"; }))
      << "what the source has is shown again";
  type("bulk_modulus", "200");
  ASSERT_TRUE(spin([&] { return source_.find("bulk_modulus: 200") != std::string::npos; }));
  EXPECT_TRUE(spin([&] { return !says("friction"); })) << "what was done takes the refusal away";

  // A point of the menu, a part of the library, and away with it.
  InteractiveMarkerFeedback menu;
  menu.header.frame_id = "world", menu.client_id = "hand", menu.marker_name = "/tube/centre/2";
  menu.event_type = InteractiveMarkerFeedback::MENU_SELECT, menu.menu_entry_id = 2;
  hand_.publish(menu);
  ASSERT_TRUE(spin([&] { return source_.find("[0, 0.05, 0.07]]") != std::string::npos; })) << source_;
  panel_.findChild<QComboBox*>()->setCurrentText("pouch");
  click("Add");
  ASSERT_TRUE(spin([&] {
    return !tree()->selectedItems().isEmpty() && tree()->selectedItems()[0]->text(0) == "pouch";
  })) << "it is chosen, to be drawn at once";
  ASSERT_TRUE(spin([&] { return objects_ == 3 && handles_.count("/revolve/profile/2") == 1; }));
  EXPECT_NE(look(), vein) << "another organ looks otherwise";
  auto* const within = panel_.findChild<QDoubleSpinBox*>();
  within->setValue(0.1);
  click("Tie within");
  EXPECT_TRUE(spin([&] { return says("lies as near"); }));
  within->setValue(100);
  click("Tie within");
  ASSERT_TRUE(spin([&] { return source_.find("connect: [{to: vessel") != std::string::npos; })) << source_;
  // The tie is a line with two ends. Its own end goes to other rings, and its menu takes it away.
  ASSERT_TRUE(
      spin([&] { return handles_.count("/connect/0/rings") == 1 && handles_.count("/connect/0/to") == 1; }));
  const std::string tied = source_;
  const auto end = handles_["/connect/0/rings"].pose.position;
  feel("/connect/0/rings", InteractiveMarkerFeedback::MOUSE_DOWN, end.x, end.y, end.z);
  feel("/connect/0/rings", InteractiveMarkerFeedback::MOUSE_UP, end.x + 0.05, end.y + 0.05, end.z + 0.05);
  EXPECT_TRUE(spin([&] { return source_ != tied; })) << source_;
  // A second one from the menu of a point, and away by the menu of its end.
  const auto chooses = [&](const std::string& handle, std::uint32_t entry) {
    InteractiveMarkerFeedback said;
    said.header.frame_id = "world", said.client_id = "hand", said.marker_name = handle;
    said.event_type = InteractiveMarkerFeedback::MENU_SELECT, said.menu_entry_id = entry;
    hand_.publish(said);
  };
  ASSERT_TRUE(spin([&] { return edits_ == 8; }));
  const std::string moved = source_;
  chooses("/revolve/origin", 3);
  ASSERT_TRUE(spin([&] { return handles_.count("/connect/1/to") == 1; })) << source_;
  chooses("/connect/1/to", 2);
  ASSERT_TRUE(becomes(moved));
  ASSERT_TRUE(spin([&] { return edits_ == 10; }));
  click("Delete");
  // The source comes on a topic of its own, and may be behind.
  ASSERT_TRUE(spin(
      [&] { return objects_ == 2 && edits_ == 11 && source_.find("name: pouch") == std::string::npos; }));

  // A handle that would end in nothing goes back, and the panel says why.
  choose("vessel");
  ASSERT_TRUE(spin([&] { return handles_.count("/tube/centre/1") == 1; }));
  const std::string before = source_;
  feel("/tube/centre/1", InteractiveMarkerFeedback::MOUSE_UP, -0.03, 0.05, 0.06);
  EXPECT_TRUE(spin([&] { return says("coincide"); }));
  EXPECT_EQ(source_, before);

  for (int i = 0; i < 11; ++i) {
    const std::uint32_t done = edits_;
    click("Undo");
    ASSERT_TRUE(spin([&] { return edits_ == done + 1; }));
  }
  ASSERT_TRUE(becomes(start_));
  click("Redo");
  ASSERT_TRUE(becomes(dragged));
  click("Save");
  ASSERT_TRUE(spin([&] { return says("saved: "); }));
  EXPECT_EQ(read(folder_ + "/source.yaml"), dragged);
  EXPECT_TRUE(std::filesystem::exists(folder_ + "/drawing.yaml"));
  std::filesystem::remove_all(folder_);
}

}  // namespace
}  // namespace vest::panels

int main(int argc, char** argv) {
  qputenv("QT_QPA_PLATFORM", "offscreen");
  ros::init(argc, argv, "vest_viz_test_modeller");
  QApplication application(argc, argv);
  testing::InitGoogleTest(&argc, argv);
  ros::NodeHandle keep;
  return RUN_ALL_TESTS();
}
