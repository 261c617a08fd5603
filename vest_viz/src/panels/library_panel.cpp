#include "library_panel.h"

#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QPainter>
#include <QPushButton>
#include <QTreeWidget>
#include <QVBoxLayout>

#include <vest_msgs/EditModel.h>
#include <vest_msgs/LoadScene.h>
#include <pluginlib/class_list_macros.hpp>

#include "look.h"
#include "vest_tissue/volume/transfer_table.h"

namespace vest::panels {
namespace {

constexpr int kWide = 240, kTall = 192;  ///< pixels of a picture

/// The table's colours over its values from left to right, on a chequered ground where they are clear.
QPixmap lookOfTable(const std::string& file) {
  const volume::TransferTable table = volume::readTransferTable(file);
  QPixmap pixmap(kWide, kTall / 3);
  QPainter painter(&pixmap);
  for (int x = 0; x < pixmap.width(); ++x) {
    const double t = x / (pixmap.width() - 1.0);
    const volume::Transfer row =
        volume::transfer(table, table.front().value + t * (table.back().value - table.front().value));
    for (int y = 0; y < pixmap.height(); ++y) {
      const double ground = (x / 8 + y / 8) % 2 == 0 ? 0.25 : 0.4, a = row.alpha;
      painter.setPen(QColor::fromRgbF(a * row.colour[0] + (1 - a) * ground,
                                      a * row.colour[1] + (1 - a) * ground,
                                      a * row.colour[2] + (1 - a) * ground));
      painter.drawPoint(x, y);
    }
  }
  return pixmap;
}

QPixmap pictureOf(const modelling::LibraryEntry& entry) {
  if (!entry.picture.empty()) return QPixmap(qt(entry.picture));
  if (entry.kind == "table") return lookOfTable(entry.file);
  return lookOf(entry.name);
}

}  // namespace

LibraryPanel::LibraryPanel(QWidget* parent) : BasePanel(parent) {
  auto* const column = new QVBoxLayout(this);
  words_ = new QLineEdit;
  words_->setPlaceholderText("words of a name, kind, licence or origin");
  words_->setToolTip("only entries that have all of these words are shown");
  entries_ = new QTreeWidget;
  entries_->setHeaderLabels({"kind", "name", "licence", "what it is"});
  entries_->setRootIsDecorated(false);
  picture_ = new QLabel;
  picture_->setObjectName("picture");
  picture_->setFixedSize(kWide, kTall);
  picture_->setAlignment(Qt::AlignCenter);
  about_ = new QLabel;
  about_->setObjectName("about");
  about_->setWordWrap(true);
  about_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  use_ = new QPushButton("Add to the drawing");
  done_ = new QLabel;
  done_->setWordWrap(true);
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  auto* const below = new QHBoxLayout;
  below->addWidget(picture_);
  below->addWidget(about_, 1);
  column->addWidget(words_);
  column->addWidget(entries_, 1);
  column->addLayout(below);
  column->addWidget(use_);
  column->addWidget(done_);
  column->addWidget(problem_);
  try {
    library_ = modelling::readLibrary();
  } catch (const std::exception& error) {
    tell(problem_, error.what());
  }
  for (const modelling::LibraryEntry& entry : library_)
    entries_->addTopLevelItem(
        new QTreeWidgetItem({qt(entry.kind), qt(entry.name), qt(entry.licence), qt(entry.about)}));
  for (int i = 0; i < 3; ++i) entries_->resizeColumnToContents(i);
  connect(words_, &QLineEdit::textChanged, this, [this] { filter(); });
  connect(entries_, &QTreeWidget::itemSelectionChanged, this, [this] { select(); });
  connect(use_, &QPushButton::clicked, this, [this] { use(); });
  if (!library_.empty()) entries_->setCurrentItem(entries_->topLevelItem(0));
}

void LibraryPanel::connectTopics() {
  source_sub_ = nh().subscribe<vest_msgs::StringStamped>(
      "model/source", 2, [this](const vest_msgs::StringStampedConstPtr& msg) { text_ = msg->string; });
}

void LibraryPanel::filter() {
  const QStringList words = words_->text().split(' ', Qt::SkipEmptyParts);
  for (std::size_t i = 0; i < library_.size(); ++i) {
    const modelling::LibraryEntry& e = library_[i];
    const QString all = qt(e.kind + " " + e.name + " " + e.licence + " " + e.about + " " + e.source);
    bool has = true;
    for (const QString& word : words) has = has && all.contains(word, Qt::CaseInsensitive);
    entries_->topLevelItem(static_cast<int>(i))->setHidden(!has);
  }
}

const modelling::LibraryEntry* LibraryPanel::chosen() const {
  const QList<QTreeWidgetItem*> items = entries_->selectedItems();
  const int row = items.isEmpty() ? -1 : entries_->indexOfTopLevelItem(items.front());
  return row < 0 ? nullptr : &library_[static_cast<std::size_t>(row)];
}

void LibraryPanel::select() {
  const modelling::LibraryEntry* const entry = chosen();
  use_->setEnabled(entry != nullptr && (entry->kind == "part" || entry->kind == "scene"));
  if (entry == nullptr) return;
  use_->setText(entry->kind == "scene" ? "Load into the session" : "Add to the drawing");
  about_->setText(
      QString("%1\n\nfrom: %2\nlicence: %3").arg(qt(entry->about), qt(entry->source), qt(entry->licence)));
  done_->clear();
  tell(problem_, "");
  try {
    picture_->setPixmap(pictureOf(*entry));
  } catch (const std::exception& error) {
    picture_->clear();
    tell(problem_, error.what());
  }
}

void LibraryPanel::use() {
  const modelling::LibraryEntry* const entry = chosen();
  if (entry == nullptr) return;
  if (entry->kind == "scene") {
    vest_msgs::LoadScene load;
    load.request.scene = entry->name;
    return call<vest_msgs::LoadScene>(
        "tissue/load_scene", load, [this](const vest_msgs::LoadScene& answer, const std::string& problem) {
          tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
          if (problem.empty() && answer.response.success)
            done_->setText("loaded: scene " + qt(answer.response.scene_hash));
        });
  }
  if (text_.empty()) return tell(problem_, "no source heard: is model_node running?");
  try {
    editAll(modelling::additions(modelling::Document(text_), entry->file), 0);
  } catch (const std::exception& error) {
    tell(problem_, error.what());
  }
}

void LibraryPanel::editAll(std::vector<modelling::Script::Line> edits, std::size_t next) {
  if (next == edits.size()) {
    tell(problem_, "");
    return done_->setText(QString("%1 added: Undo of the panel Modeller takes it back").arg(edits.size()));
  }
  vest_msgs::EditModel request;
  request.request.op = edits[next].op, request.request.path = edits[next].path;
  request.request.value = edits[next].value;
  call<vest_msgs::EditModel>(
      "model/edit", request,
      [this, edits = std::move(edits), next](const vest_msgs::EditModel& answer, const std::string& problem) {
        if (!problem.empty() || !answer.response.success)
          return tell(problem_, problem.empty() ? answer.response.message : problem);
        editAll(edits, next + 1);
      });
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::LibraryPanel, rviz::Panel)
