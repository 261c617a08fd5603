// Protects two ways into a scene by hand: the library, where each entry has a picture, a licence and an
// origin and is put into the drawing or loaded; and the recipe of a patient's images, which is edited in its
// place, baked and loaded.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include <QLabel>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QProcess>
#include <QPushButton>
#include <QTableWidget>
#include <QTreeWidget>

#include <unistd.h>

#include <ros/ros.h>
#include <vest_msgs/LoadScene.h>
#include <vest_msgs/StringStamped.h>

#include "../spin.h"
#include "library_panel.h"
#include "patient_panel.h"

namespace vest::panels {
namespace {

namespace fs = std::filesystem;

std::string bytesOf(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

/// A panel on Qt's offscreen platform, and a session that takes every scene.
template <class Panel>
class ByHand : public testing::Test {
 protected:
  void SetUp() override {
    load_ = vest_.advertiseService<vest_msgs::LoadSceneRequest, vest_msgs::LoadSceneResponse>(
        "tissue/load_scene",
        [this](vest_msgs::LoadSceneRequest& request, vest_msgs::LoadSceneResponse& response) {
          loaded_ = request.scene;
          response.success = true, response.scene_hash = "0123456789abcdef";
          return true;
        });
    panel_.initialize(nullptr);
    panel_.resize(560, 700);
    panel_.show();
  }
  void click(const char* text) {
    for (QPushButton* const b : panel_.template findChildren<QPushButton*>())
      if (b->text() == text) {
        EXPECT_TRUE(b->isEnabled()) << text;
        return b->click();
      }
    ADD_FAILURE() << text;
  }
  bool says(const QString& text) {
    for (const QLabel* const label : panel_.template findChildren<QLabel*>())
      if (label->isVisible() && label->text().contains(text)) return true;
    return false;
  }

  ros::NodeHandle vest_{"/vest"};
  ros::ServiceServer load_;
  std::string loaded_;
  Panel panel_;
};

class Library : public ByHand<LibraryPanel> {
 protected:
  QTreeWidget* tree() { return panel_.findChild<QTreeWidget*>(); }
  void choose(const QString& kind, const QString& name) {
    for (int i = 0; i < tree()->topLevelItemCount(); ++i) {
      QTreeWidgetItem* const item = tree()->topLevelItem(i);
      if (item->text(0) == kind && item->text(1) == name) return tree()->setCurrentItem(item);
    }
    ADD_FAILURE() << name.toStdString();
  }
};

TEST_F(Library, EachEntryHasAPictureAndAPartComesIntoTheDrawing) {
  const auto* const picture = panel_.findChild<QLabel*>("picture");
  ASSERT_GT(tree()->topLevelItemCount(), 50);
  std::set<QString> kinds;
  for (int i = 0; i < tree()->topLevelItemCount(); ++i) {
    tree()->setCurrentItem(tree()->topLevelItem(i));
    kinds.insert(tree()->topLevelItem(i)->text(0));
    EXPECT_FALSE(picture->pixmap(Qt::ReturnByValue).isNull())
        << tree()->topLevelItem(i)->text(1).toStdString();
    EXPECT_TRUE(says("licence: ") && says("from: "));
  }
  EXPECT_EQ(kinds, (std::set<QString>{"part", "scene", "material", "table", "texture"}));

  panel_.findChild<QLineEdit*>()->setText("part PERITONEUM");
  int shown = 0;
  for (int i = 0; i < tree()->topLevelItemCount(); ++i) shown += tree()->topLevelItem(i)->isHidden() ? 0 : 1;
  EXPECT_EQ(shown, 2) << "fold and hollow";
  panel_.findChild<QLineEdit*>()->clear();

  std::string source;
  const ros::Subscriber listens = vest_.subscribe<vest_msgs::StringStamped>(
      "model/source", 20, [&](const vest_msgs::StringStampedConstPtr& msg) { source = msg->string; });
  choose("part", "pouch");
  const auto pouches = [&] {
    std::size_t count = 0;
    for (std::size_t at = 0; (at = source.find("name: pouch", at)) != std::string::npos; ++at) ++count;
    return count;
  };
  ASSERT_TRUE(spin([&] { return !source.empty(); }));
  const std::size_t before = pouches();
  click("Add to the drawing");
  EXPECT_TRUE(spin([&] { return pouches() == before + 1; })) << source;
  EXPECT_TRUE(spin([&] { return says("1 added"); }));

  choose("scene", "pelvis");
  click("Load into the session");
  EXPECT_TRUE(spin([&] { return says("loaded: scene 0123456789abcdef"); }));
  EXPECT_EQ(loaded_, "pelvis");
  choose("material", "liver");
  for (QPushButton* const b : panel_.findChildren<QPushButton*>()) EXPECT_FALSE(b->isEnabled());
}

class Patient : public ByHand<PatientPanel> {
 protected:
  void SetUp() override {
    ByHand::SetUp();
    folder_ = testing::TempDir() + "vest_patient_" + std::to_string(getpid());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    ASSERT_EQ(
        QProcess::execute("rosrun", {"vest_tissue", "vest_phantom", "abdomen",
                                     QString::fromStdString(folder_ + "/ct"), "--size", "85", "60", "40"}),
        0);
    line("images")->setText(QString::fromStdString(folder_ + "/ct"));
    line("folder")->setText(QString::fromStdString(folder_ + "/lying"));
  }
  void TearDown() override { fs::remove_all(folder_); }
  QLineEdit* line(const char* name) { return panel_.findChild<QLineEdit*>(name); }
  QTableWidget* table() { return panel_.findChild<QTableWidget*>(); }
  int rowOf(const QString& path) {
    for (int row = 0; row < table()->rowCount(); ++row)
      if (table()->item(row, 0)->text() == path) return row;
    return -1;
  }
  QString value(const QString& path) {
    const int row = rowOf(path);
    return row < 0 ? "no such line" : table()->item(row, 1)->text();
  }
  void type(const QString& path, const QString& value) {
    ASSERT_GE(rowOf(path), 0) << path.toStdString();
    table()->item(rowOf(path), 1)->setText(value);
  }
  bool ready() {
    for (QPushButton* const b : panel_.findChildren<QPushButton*>())
      if (!b->isEnabled()) return false;
    return true;
  }
  std::string recipe() { return bytesOf(folder_ + "/lying/patient.yaml"); }
  std::string folder_;
};

TEST_F(Patient, ImagesBecomeASceneByThePanelAlone) {
  click("Bake");
  EXPECT_TRUE(says("no recipe is open"));
  click("New");
  ASSERT_TRUE(spin([&] { return ready(); }, 120));
  ASSERT_GT(table()->rowCount(), 0) << panel_.findChild<QPlainTextEdit*>("told")->toPlainText().toStdString();
  const std::string first = recipe();
  EXPECT_EQ(value("labels/bone/values"), "[200, 4000]");
  EXPECT_EQ(value("labels/bone/closing"), "") << "it may say so";

  // An edit replaces the bytes of its value.
  type("labels/soft_tissue/values", "[30, 100]");
  std::string wanted = first;
  wanted.replace(wanted.find("[-20, 150]"), 10, "[30, 100]");
  EXPECT_EQ(recipe(), wanted);
  // One that the reader refuses changes nothing, and says why.
  type("cell", "0");
  EXPECT_TRUE(says("cell"));
  EXPECT_FALSE(says("patient.yaml.new"));
  EXPECT_EQ(recipe(), wanted);
  EXPECT_EQ(fs::exists(folder_ + "/lying/patient.yaml.new"), false);
  EXPECT_NE(value("cell"), "0");

  // Labels come, grow from a place, and go; undo gives the bytes back.
  click("Add label");
  EXPECT_EQ(value("labels/label_1/values"), "[0, 100]");
  type("labels/label_1/from", "[-75, -20, 10]");
  type("labels/label_1/largest", "1");
  EXPECT_NE(recipe().find("from: [-75, -20, 10]"), std::string::npos);
  type("labels/label_1/largest", "");
  EXPECT_EQ(recipe().find("largest: 1}\n  - {name: label_1"), std::string::npos);
  table()->setCurrentCell(rowOf("labels/label_1/values"), 1);
  click("Delete label");
  EXPECT_EQ(recipe(), wanted);
  click("Undo");
  EXPECT_NE(recipe(), wanted);
  for (int i = 0; i < 6; ++i) click("Undo");
  EXPECT_EQ(recipe(), first);
  click("Redo");
  EXPECT_EQ(recipe(), wanted);

  // What another program wrote meanwhile is not written over.
  std::ofstream(folder_ + "/lying/patient.yaml", std::ios::app) << "# by another hand\n";
  type("cell", "12");
  EXPECT_TRUE(says("changed elsewhere"));
  EXPECT_EQ(recipe(), wanted + "# by another hand\n");
  type("cell", "20");
  EXPECT_NE(recipe().find("cell: 20 "), std::string::npos) << recipe();

  click("Run");
  EXPECT_TRUE(says("Bake writes it"));
  click("Bake");
  ASSERT_TRUE(spin([&] { return ready(); }, 300));
  const QString told = panel_.findChild<QPlainTextEdit*>("told")->toPlainText();
  EXPECT_TRUE(told.contains("dihedral angles")) << told.toStdString();
  click("Run");
  EXPECT_TRUE(spin([&] { return loaded_ == folder_ + "/lying/lying.yaml"; })) << loaded_;
  EXPECT_NE(bytesOf(loaded_).find("model: fem"), std::string::npos);
}

}  // namespace
}  // namespace vest::panels
