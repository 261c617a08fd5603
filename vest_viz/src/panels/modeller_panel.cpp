#include "modeller_panel.h"

#include <sstream>

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QLabel>
#include <QPushButton>
#include <QSplitter>
#include <QStyledItemDelegate>
#include <QTableWidget>
#include <QTreeWidget>
#include <QVBoxLayout>

#include <vest_msgs/EditModel.h>
#include <pluginlib/class_list_macros.hpp>

#include "look.h"
#include "vest_tissue/modelling/fields.h"

namespace vest::panels {
namespace {

enum FieldColumn { kPath, kValue, kUnit, kAllowed, kFieldColumns };

QTableWidgetItem* fixedItem(const QString& text) {
  auto* const item = new QTableWidgetItem(text);
  item->setFlags(Qt::ItemIsEnabled | Qt::ItemIsSelectable);
  return item;
}

/// Parts that the source includes: their objects are drawn there, and not edited here.
QStringList includedParts(const modelling::Document& document) {
  QStringList parts;
  for (int i = 0; document.has("/include/" + std::to_string(i)); ++i)
    for (const char* key : {"/part", "/file"}) {
      const std::string path = "/include/" + std::to_string(i) + key;
      if (document.has(path)) parts << qt(document.bytes(path));
    }
  return parts;
}

/// What the library has is chosen from a list; other values are typed.
class Words : public QStyledItemDelegate {
 public:
  Words(const std::vector<modelling::LibraryEntry>& library, QObject* parent)
      : QStyledItemDelegate(parent), library_(library) {}
  QWidget* createEditor(QWidget* parent, const QStyleOptionViewItem& option,
                        const QModelIndex& index) const override {
    const QString path = index.sibling(index.row(), kPath).data().toString();
    const char* const kind = path.endsWith("material") ? "material" : path == "organ" ? "texture" : nullptr;
    if (kind == nullptr) return QStyledItemDelegate::createEditor(parent, option, index);
    auto* const box = new QComboBox(parent);
    box->setEditable(true);  // an organ may be any word
    for (const modelling::LibraryEntry& entry : library_) {
      if (entry.kind != kind) continue;
      box->addItem(qt(entry.name));
      box->setItemData(box->count() - 1, qt(entry.about), Qt::ToolTipRole);
    }
    return box;
  }

 private:
  const std::vector<modelling::LibraryEntry>& library_;
};

/// What the database says of a tissue, a line each; behind each number its source or `assumed`.
QString propertiesOf(const material::Tissue& tissue) {
  QStringList lines;
  for (const char* const key : {"youngs_modulus", "density", "perfusion", "cut_toughness"}) {
    const auto found = tissue.in_vivo.find(key);
    if (found == tissue.in_vivo.end()) continue;
    const material::Quantity& q = found->second;
    lines << QString("%1 %2 %3 (%4)")
                 .arg(key)
                 .arg(q.value)
                 .arg(qt(q.unit), q.assumed ? "assumed" : qt(q.source));
  }
  return lines.join('\n');
}

}  // namespace

ModellerPanel::ModellerPanel(QWidget* parent) : BasePanel(parent) {
  auto* const column = new QVBoxLayout(this);
  objects_ = new QTreeWidget;
  objects_->setObjectName("objects");
  objects_->setHeaderLabels({"object", "kind", "organ", "material"});
  objects_->setRootIsDecorated(false);
  objects_->setToolTip("the objects of the source; the chosen one has handles in the view");
  fields_ = new QTableWidget(0, kFieldColumns);
  fields_->setHorizontalHeaderLabels({"field", "value", "unit", "allowed"});
  fields_->verticalHeader()->hide();
  fields_->verticalHeader()->setDefaultSectionSize(fields_->fontMetrics().height() + 6);
  fields_->horizontalHeader()->setStretchLastSection(true);
  fields_->setToolTip("a double click edits a value; an empty one is not said, and its default goes");
  auto* const split = new QSplitter(Qt::Vertical);
  split->addWidget(objects_);
  split->addWidget(fields_);
  split->setStretchFactor(0, 1);
  split->setStretchFactor(1, 2);
  part_ = new QComboBox;
  part_->setObjectName("part");
  try {
    materials_ = material::readDatabase(material::databasePath());
    library_ = modelling::readLibrary();
    for (const modelling::LibraryEntry& entry : library_)
      if (entry.kind == "part") {
        part_->addItem(qt(entry.name));
        part_->setItemData(part_->count() - 1, qt(entry.about), Qt::ToolTipRole);
        parts_.push_back(entry);
      }
  } catch (const std::exception& error) {
    part_->setToolTip(error.what());
  }
  fields_->setItemDelegateForColumn(kValue, new Words(library_, fields_));
  look_ = new QLabel;
  look_->setObjectName("look");
  look_->setFixedSize(kLookSize, kLookSize);
  look_->setToolTip("the organ's surface as the view textures it, without light");
  properties_ = new QLabel;
  properties_->setObjectName("properties");
  properties_->setWordWrap(true);
  properties_->setToolTip(
      "the material's numbers with their sources; all of them: rosrun vest_tissue vest_material show NAME");
  auto* const preview = new QHBoxLayout;
  preview->addWidget(look_);
  preview->addWidget(properties_, 1);
  within_ = new QDoubleSpinBox;
  within_->setRange(0.1, 100.0);
  within_->setValue(5.0);
  within_->setSuffix(" mm");
  within_->setToolTip("how near the other organ's surface has to be");
  auto* const first = new QHBoxLayout;
  auto* const second = new QHBoxLayout;
  const auto button = [&](QHBoxLayout* row, const char* text, const char* tip,
                          std::function<void()> clicked) {
    auto* const made = new QPushButton(text);
    made->setToolTip(tip);
    row->addWidget(made);
    connect(made, &QPushButton::clicked, this, std::move(clicked));
  };
  first->addWidget(part_, 1);
  button(first, "Add", "adds this part of the library to the source", [this] { add(); });
  button(first, "Delete", "removes the chosen object; what refers to it goes first", [this] {
    if (!object().empty()) edit("remove", "/objects/" + object(), "");
  });
  button(first, "Tie within", "ties the chosen object to each organ that lies near it, ring by ring",
         [this] { tie(); });
  first->addWidget(within_);
  button(second, "Undo", "takes back the last edit, byte for byte", [this] { edit("undo", "", ""); });
  button(second, "Redo", "does it again", [this] { edit("redo", "", ""); });
  button(second, "Save", "writes source, scene and nets", [this] { edit("save", "", ""); });
  button(second, "Run", "loads the drawing into the session that runs; the file is not written",
         [this] { edit("run", "", ""); });
  about_ = new QLabel("no source heard");
  about_->setWordWrap(true);
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  column->addWidget(split, 1);
  column->addLayout(preview);
  column->addLayout(first);
  column->addLayout(second);
  column->addWidget(about_);
  column->addWidget(problem_);
  connect(objects_, &QTreeWidget::itemSelectionChanged, this, [this] { select(); });
  connect(fields_, &QTableWidget::cellChanged, this, [this](int row, int at) {
    if (at == kValue) changed(row);
  });
}

void ModellerPanel::connectTopics() {
  source_sub_ = nh().subscribe<vest_msgs::StringStamped>(
      "model/source", 2, [this](const vest_msgs::StringStampedConstPtr& msg) { showSource(msg->string); });
  refused_sub_ = nh().subscribe<vest_msgs::StringStamped>(
      "model/refused", 20,
      [this](const vest_msgs::StringStampedConstPtr& msg) { tell(problem_, msg->string); });
  selected_pub_ = nh().advertise<vest_msgs::StringStamped>("model/selected", 2, true);
}

void ModellerPanel::showSource(const std::string& text) {
  const std::string before = wanted_.empty() ? object() : wanted_;
  text_ = text;
  try {
    const modelling::Document document(text);
    const QSignalBlocker quiet(objects_);
    objects_->clear();
    for (const modelling::ObjectLine& line : modelling::objectsOf(document))
      objects_->addTopLevelItem(
          new QTreeWidgetItem({qt(line.name), qt(line.kind), qt(line.organ), qt(line.material)}));
    about_->setText(QString("%1 objects").arg(objects_->topLevelItemCount()));
    for (const QString& part : includedParts(document)) {
      auto* const item = new QTreeWidgetItem({part, "included part", "", ""});
      item->setDisabled(true);
      objects_->addTopLevelItem(item);
    }
    for (int i = 0; i < 4; ++i) objects_->resizeColumnToContents(i);
  } catch (const std::exception& error) {
    return tell(problem_, error.what());
  }
  tell(problem_, "");
  choose(before);
}

void ModellerPanel::choose(const std::string& name) {
  {
    const QSignalBlocker quiet(objects_);
    for (int i = 0; i < objects_->topLevelItemCount(); ++i) {
      QTreeWidgetItem* const item = objects_->topLevelItem(i);
      if (item->text(0) != qt(name) || item->isDisabled()) continue;
      objects_->setCurrentItem(item);
      if (name == wanted_) wanted_.clear();
    }
  }
  select();
}

std::string ModellerPanel::object() const {
  const QList<QTreeWidgetItem*> chosen = objects_->selectedItems();
  return chosen.isEmpty() ? "" : chosen.front()->text(0).toStdString();
}

void ModellerPanel::select() {
  vest_msgs::StringStamped msg;
  msg.header.stamp = ros::Time::now();
  msg.string = object();
  selected_pub_.publish(msg);
  showFields();
}

void ModellerPanel::showFields() {
  std::vector<modelling::Entry> entries;
  try {
    if (!object().empty()) entries = modelling::entriesOf(modelling::Document(text_), object());
  } catch (const std::exception& error) {
    tell(problem_, error.what());
  }
  const QSignalBlocker quiet(fields_);
  const int count = static_cast<int>(entries.size());
  fields_->setRowCount(count);
  for (int row = 0; row < count; ++row) {
    const modelling::Entry& entry = entries[static_cast<std::size_t>(row)];
    const modelling::Field* const field = entry.field;
    const QString what = field == nullptr ? QString() : QString::fromUtf8(field->what);
    const QString range = field == nullptr ? QString() : qt(modelling::allowedText(*field));
    fields_->setItem(row, kPath, fixedItem(qt(entry.path)));
    auto* const value = new QTableWidgetItem(qt(entry.value));
    value->setData(Qt::UserRole, qt(entry.value));
    fields_->setItem(row, kValue, value);
    fields_->setItem(row, kUnit, fixedItem(field == nullptr ? QString() : QString::fromUtf8(field->unit)));
    fields_->setItem(row, kAllowed, fixedItem(range.isEmpty() ? what : range));
    for (int c = 0; c < kFieldColumns; ++c) {
      fields_->item(row, c)->setToolTip(what);
      if (entry.value.empty()) fields_->item(row, c)->setForeground(Qt::gray);
    }
  }
  preview();
  fields_->resizeColumnsToContents();
  fields_->setColumnWidth(kValue, std::min(fields_->columnWidth(kValue), 150));
  fields_->horizontalHeader()->setStretchLastSection(true);
}

void ModellerPanel::preview() {
  const QList<QTreeWidgetItem*> chosen = objects_->selectedItems();
  if (chosen.isEmpty()) {
    look_->clear();
    return properties_->clear();
  }
  const std::string organ = chosen.front()->text(2).toStdString();
  const auto known = looks_.find(organ);
  look_->setPixmap(known != looks_.end() ? known->second : looks_[organ] = lookOf(organ));
  try {
    properties_->setText(propertiesOf(materials_.at(chosen.front()->text(3).toStdString())));
  } catch (const std::exception& error) {
    properties_->setText(error.what());
  }
}

void ModellerPanel::tie() {
  if (object().empty()) return tell(problem_, "no object is chosen");
  vest_msgs::EditModel request;
  request.request.op = "propose", request.request.path = object();
  request.request.value = std::to_string(1e-3 * within_->value());
  call<vest_msgs::EditModel>(
      "model/edit", request, [this](const vest_msgs::EditModel& answer, const std::string& problem) {
        if (!problem.empty() || !answer.response.success)
          return tell(problem_, problem.empty() ? answer.response.message : problem);
        std::vector<modelling::Script::Line> edits;
        std::istringstream lines(answer.response.message);
        for (modelling::Script::Line line; lines >> line.op >> line.path && std::getline(lines, line.value);)
          edits.push_back(line);
        if (edits.empty()) return tell(problem_, "no other organ lies as near as that");
        editAll(std::move(edits), 0);
      });
}

void ModellerPanel::editAll(std::vector<modelling::Script::Line> edits, std::size_t next) {
  if (next == edits.size()) return;
  const modelling::Script::Line line = edits[next];
  edit(line.op, line.path, line.value, [this, edits = std::move(edits), next] { editAll(edits, next + 1); });
}

void ModellerPanel::changed(int row) {
  const std::string path = fields_->item(row, kPath)->text().toStdString();
  const QString value = fields_->item(row, kValue)->text().trimmed();
  if (value == fields_->item(row, kValue)->data(Qt::UserRole).toString()) return;
  if (path == "name") wanted_ = value.toStdString();
  edit(value.isEmpty() ? "remove" : "set", "/objects/" + object() + "/" + path, value.toStdString());
}

void ModellerPanel::add() {
  const auto place = static_cast<std::size_t>(part_->currentIndex());
  if (place >= parts_.size()) return tell(problem_, "the library: " + part_->toolTip().toStdString());
  if (text_.empty()) return tell(problem_, "no source heard: is model_node running?");
  try {
    addNext(modelling::additions(modelling::Document(text_), parts_[place].file), 0);
  } catch (const std::exception& error) {
    tell(problem_, error.what());
  }
}

void ModellerPanel::addNext(std::vector<modelling::Script::Line> edits, std::size_t next) {
  if (next == edits.size()) return;
  const modelling::Script::Line line = edits[next];
  // Chosen when the source comes with it.
  const modelling::Document value("value: " + line.value);
  wanted_ = value.bytes(value.has("/value/0/name") ? "/value/0/name" : "/value/name");
  edit(line.op, line.path, line.value, [this, edits = std::move(edits), next] { addNext(edits, next + 1); });
}

void ModellerPanel::edit(const std::string& op, const std::string& path, const std::string& value,
                         Done done) {
  vest_msgs::EditModel request;
  request.request.op = op, request.request.path = path, request.request.value = value;
  call<vest_msgs::EditModel>(
      "model/edit", request,
      [this, op, done](const vest_msgs::EditModel& answer, const std::string& problem) {
        if (!problem.empty() || !answer.response.success) {
          wanted_.clear();
          showFields();  // what the source has, in place of what was typed
          return tell(problem_, problem.empty() ? answer.response.message : problem);
        }
        tell(problem_, "");
        if (op == "save") about_->setText(qt("saved: " + answer.response.message));
        if (op == "run") about_->setText(qt(answer.response.message));
        if (done) done();
      });
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::ModellerPanel, rviz::Panel)
