#include "patient_panel.h"

#include <filesystem>
#include <fstream>

#include <QComboBox>
#include <QGridLayout>
#include <QHeaderView>
#include <QLabel>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QStyledItemDelegate>
#include <QTableWidget>

#include <vest_msgs/LoadScene.h>
#include <pluginlib/class_list_macros.hpp>

#include "look.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/image/patient.h"
#include "vest_tissue/modelling/document.h"

namespace vest::panels {
namespace {

namespace fs = std::filesystem;

enum RecipeColumn { kRecipePath, kRecipeValue, kRecipeAllowed, kRecipeColumns };

/// What a recipe may say (docs/images.md). Its reader refuses; this is for those who type.
struct RecipeKey {
  const char *key, *allowed, *what;
};
constexpr RecipeKey kOfRecipe[] = {
    {"name", "letters, digits, _ . -", "of the scene and its object"},
    {"images", "folder or file", "from the recipe's folder, or absolute"},
    {"series", "number or UID", "which of several series"},
    {"resample", "true, false", "interpolate what is uneven or tilted"},
    {"crop", "[[x, y, z], [x, y, z]] mm", "patient's axes: nothing outside is labelled"},
    {"cell", "0.1 … 1000 mm", "edge of the lattice's cubes: smaller cells, finer mesh"},
    {"integrator", "backward_euler, elastostatic, condensed",
     "large turns; small ones, faster and at most 1,500 free nodes; a fine mesh that is not cut"},
    {"held", "[names of labels]", "their nodes do not move; else the lowest tenth"},
    {"place", "[x, y, z] m", "world: the middle of the underside"},
};
constexpr RecipeKey kOfLabel[] = {
    {"name", "letters, digits, _ . -", "of the label"},
    {"tissue", "a material", "of the database of materials"},
    {"label", "1 … 65535", "of a ready label map"},
    {"values", "[least, greatest]", "voxels between them, HU or the images' unit"},
    {"median", "0 … 5 voxels", "majority of the cube of so many to each side: removes noise"},
    {"closing", "0 … 20 voxels", "fills holes and gaps up to twice as wide"},
    {"from", "[x, y, z] mm", "only what is connected to this place"},
    {"largest", "1 … 1000", "only so many of the largest connected parts"},
};

/// Paths and values that a person edits: scalars, and lists without keys. Then what the recipe may say, too.
void listValues(const modelling::Document& document, const modelling::Document::Node& node,
                const std::string& path, std::vector<std::pair<std::string, std::string>>* values) {
  using Kind = modelling::Document::Node::Kind;
  const auto is_plain = [](const auto& self, const modelling::Document::Node& n) -> bool {
    if (n.kind == Kind::Map) return false;
    for (const auto& child : n.children)
      if (!self(self, child)) return false;
    return true;
  };
  if (node.kind != Kind::Map && !path.empty() && is_plain(is_plain, node)) {
    values->emplace_back(path, modelling::inOneLine(document.bytes(path)));
    return;
  }
  for (std::size_t i = 0; i < node.children.size(); ++i) {
    std::string name = node.kind == Kind::Map ? node.names[i] : std::to_string(i);
    if (node.kind == Kind::List && document.has(path + "/" + name + "/name"))
      name = document.bytes(path + "/" + name + "/name");
    listValues(document, node.children[i], path + "/" + name, values);
  }
  const bool top = path.empty(),
             label = path.compare(0, 8, "/labels/") == 0 || path.compare(0, 9, "/tissues/") == 0;
  if (node.kind != Kind::Map || !(top || label)) return;
  const auto offer = [&](const RecipeKey& key) {
    if (!document.has(path + "/" + key.key)) values->emplace_back(path + "/" + key.key, "");
  };
  if (top)
    for (const RecipeKey& key : kOfRecipe) offer(key);
  else
    for (const RecipeKey& key : kOfLabel) offer(key);
}

const RecipeKey* recipeKeyOf(const std::string& path) {
  const std::string key = path.substr(path.rfind('/') + 1);
  const bool top = path.rfind('/') == 0;
  if (top)
    for (const RecipeKey& k : kOfRecipe)
      if (key == k.key) return &k;
  if (!top)
    for (const RecipeKey& k : kOfLabel)
      if (key == k.key) return &k;
  return nullptr;
}

/// Tissues are chosen from a list; other values are typed.
class Tissues : public QStyledItemDelegate {
 public:
  Tissues(const std::vector<modelling::LibraryEntry>& library, QObject* parent)
      : QStyledItemDelegate(parent), library_(library) {}
  QWidget* createEditor(QWidget* parent, const QStyleOptionViewItem& option,
                        const QModelIndex& index) const override {
    const QString path = index.sibling(index.row(), kRecipePath).data().toString();
    if (!path.endsWith("/tissue")) return QStyledItemDelegate::createEditor(parent, option, index);
    auto* const box = new QComboBox(parent);
    for (const modelling::LibraryEntry& entry : library_)
      if (entry.kind == "material") box->addItem(qt(entry.name));
    return box;
  }

 private:
  const std::vector<modelling::LibraryEntry>& library_;
};

void write(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::invalid_argument(path + ": cannot be written");
}

}  // namespace

PatientPanel::PatientPanel(QWidget* parent) : BasePanel(parent) {
  try {
    library_ = modelling::readLibrary();
  } catch (const std::exception&) {  // tissues are typed then
  }
  auto* const grid = new QGridLayout(this);
  images_ = new QLineEdit;
  images_->setObjectName("images");
  images_->setPlaceholderText("folder or file of DICOM, NRRD, MetaImage, NIfTI");
  folder_ = new QLineEdit;
  folder_->setObjectName("folder");
  folder_->setPlaceholderText("folder of the patient, with patient.yaml");
  fields_ = new QTableWidget(0, kRecipeColumns);
  fields_->setHorizontalHeaderLabels({"of the recipe", "value", "allowed"});
  fields_->verticalHeader()->hide();
  fields_->verticalHeader()->setDefaultSectionSize(fields_->fontMetrics().height() + 6);
  fields_->horizontalHeader()->setStretchLastSection(true);
  fields_->setToolTip("a double click edits a value; one that is emptied is taken out");
  fields_->setItemDelegateForColumn(kRecipeValue, new Tissues(library_, fields_));
  told_ = new QPlainTextEdit;
  told_->setReadOnly(true);
  told_->setObjectName("told");
  told_->setMaximumBlockCount(500);
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  int row = 0, column = 0;
  const auto button = [&](const char* text, const char* tip, std::function<void()> clicked) {
    auto* const made = new QPushButton(text);
    made->setToolTip(tip);
    waits_.push_back(made);
    connect(made, &QPushButton::clicked, this, std::move(clicked));
    grid->addWidget(made, row, column++);
  };
  grid->addWidget(new QLabel("Images"), row, 0);
  grid->addWidget(images_, row, 1, 1, 3);
  column = 4;
  button("New", "reads the images, and writes a recipe to begin with into the folder", [this] { begin(); });
  grid->addWidget(new QLabel("Folder"), ++row, 0);
  grid->addWidget(folder_, row, 1, 1, 3);
  column = 4;
  button("Open", "reads patient.yaml of the folder", [this] { open(); });
  grid->addWidget(fields_, ++row, 0, 1, 5);
  grid->setRowStretch(row, 3);
  ++row, column = 0;
  button("Add label", "a label of a range of values; where labels overlap, the later one counts",
         [this] { addLabel(); });
  button("Delete label", "the one whose line is chosen", [this] { deleteLabel(); });
  button("Undo", "takes back the last edit", [this] { walk(at_ - 1); });
  button("Redo", "does it again", [this] { walk(at_ + 1); });
  ++row, column = 0;
  button("Bake", "labels, mesh and a scene that runs (vest_import bake)", [this] {
    if (asShown()) startImport({"bake", folder_->text()}, {});
  });
  button("Run", "loads the baked scene into the session", [this] { runScene(); });
  grid->addWidget(told_, ++row, 0, 1, 5);
  grid->setRowStretch(row, 1);
  grid->addWidget(problem_, ++row, 0, 1, 5);
  connect(fields_, &QTableWidget::cellChanged, this, [this](int at, int what) {
    if (what == kRecipeValue) changed(at);
  });
  import_.setProcessChannelMode(QProcess::MergedChannels);
  connect(&import_, &QProcess::readyRead, this,
          [this] { told_->appendPlainText(QString::fromUtf8(import_.readAll()).trimmed()); });
  const auto over = [this](const QString& problem) {
    for (QPushButton* const b : waits_) b->setEnabled(true);
    tell(problem_, problem.toStdString());
    const std::function<void()> done = std::move(done_);
    done_ = {};
    if (problem.isEmpty() && done) done();
  };
  connect(&import_, QOverload<int, QProcess::ExitStatus>::of(&QProcess::finished), this,
          [this, over](int code, QProcess::ExitStatus status) {
            if (code == 0 && status == QProcess::NormalExit) return over("");
            over(told_->toPlainText().section('\n', -1));
          });
  connect(&import_, &QProcess::errorOccurred, this, [over](QProcess::ProcessError error) {
    if (error == QProcess::FailedToStart)
      over("vest_import: cannot be started: is VEST's setup.bash sourced?");
  });
}

PatientPanel::~PatientPanel() {
  import_.disconnect(this);
  import_.kill();
  import_.waitForFinished(1000);
}

std::string PatientPanel::recipe() const {
  return (fs::path(folder_->text().toStdString()) / "patient.yaml").string();
}

void PatientPanel::open() {
  texts_.clear();
  at_ = 0;
  try {
    const std::string text = scene::yaml::readFile(recipe(), scene::yaml::kMaxBytes);
    image::readPatient(recipe());
    const modelling::Document edited(text);
    texts_ = {text};
    tell(problem_, "");
  } catch (const std::exception& error) {
    tell(problem_, error.what());
  }
  showFields();
}

void PatientPanel::begin() {
  startImport({"new", images_->text(), folder_->text()}, [this] { open(); });
}

void PatientPanel::startImport(const QStringList& words, std::function<void()> done) {
  for (const QString& word : words)
    if (word.trimmed().isEmpty()) return tell(problem_, "Images and Folder: must be named first");
  for (QPushButton* const b : waits_) b->setEnabled(false);
  tell(problem_, "");
  told_->clear();
  done_ = std::move(done);
  import_.start("rosrun", QStringList{"vest_tissue", "vest_import"} + words);
}

void PatientPanel::showFields() {
  const QSignalBlocker quiet(fields_);
  fields_->setRowCount(0);
  if (texts_.empty()) return;
  std::vector<std::pair<std::string, std::string>> values;
  const modelling::Document document(texts_[at_]);
  listValues(document, document.root(), "", &values);
  fields_->setRowCount(static_cast<int>(values.size()));
  for (int row = 0; row < fields_->rowCount(); ++row) {
    const auto& [path, value] = values[static_cast<std::size_t>(row)];
    const RecipeKey* const key = recipeKeyOf(path);
    const QString cells[] = {qt(path.substr(1)), qt(value),
                             QString::fromUtf8(key == nullptr ? "" : key->allowed)};
    for (int c = 0; c < kRecipeColumns; ++c) {
      auto* const item = new QTableWidgetItem(cells[c]);
      if (c != kRecipeValue) item->setFlags(Qt::ItemIsEnabled | Qt::ItemIsSelectable);
      if (value.empty()) item->setForeground(Qt::gray);
      if (key != nullptr) item->setToolTip(QString::fromUtf8(key->what));
      item->setData(Qt::UserRole, cells[c]);
      fields_->setItem(row, c, item);
    }
  }
  fields_->resizeColumnsToContents();
  fields_->setColumnWidth(kRecipeValue, std::min(fields_->columnWidth(kRecipeValue), 180));
  fields_->horizontalHeader()->setStretchLastSection(true);
}

bool PatientPanel::asShown() {
  if (texts_.empty()) {
    tell(problem_, "no recipe is open");
    return false;
  }
  std::string now;
  try {
    now = scene::yaml::readFile(recipe(), scene::yaml::kMaxBytes);
  } catch (const std::exception& error) {
    tell(problem_, error.what());
    return false;
  }
  if (now == texts_[at_]) return true;
  open();
  if (!texts_.empty())
    tell(problem_, recipe() + ": was changed elsewhere, and is read again: nothing was edited");
  return false;
}

bool PatientPanel::take(const std::string& text) {
  const std::string path = recipe(), trial = path + ".new";
  try {
    const modelling::Document edited(text);  // what can be shown
    write(trial, text);
    image::readPatient(trial);
    fs::rename(trial, path);
    tell(problem_, "");
    return true;
  } catch (const std::exception& error) {
    std::error_code gone;
    fs::remove(trial, gone);
    std::string said = error.what();
    for (std::size_t at; (at = said.find(trial)) != std::string::npos;) said.replace(at, trial.size(), path);
    tell(problem_, said);
    return false;
  }
}

void PatientPanel::edit(const std::string& op, const std::string& path, const std::string& value) {
  if (!asShown()) return;
  try {
    const modelling::Document document(texts_[at_]);
    const modelling::Patch patch = op == "set"      ? document.set(path, value)
                                   : op == "insert" ? document.insert(path, value)
                                                    : document.remove(path);
    std::string text = document.text();
    text.replace(patch.offset, patch.before.size(), patch.after);
    if (take(text)) {
      texts_.resize(at_ + 1);
      texts_.push_back(text);
      ++at_;
    }
  } catch (const std::exception& error) {
    tell(problem_, error.what());
  }
  showFields();
}

void PatientPanel::walk(std::size_t to) {
  if (to >= texts_.size() || !asShown()) return;  // -1 is far beyond the end
  if (take(texts_[to])) at_ = to;
  showFields();
}

void PatientPanel::changed(int row) {
  const QString value = fields_->item(row, kRecipeValue)->text().trimmed();
  if (value == fields_->item(row, kRecipeValue)->data(Qt::UserRole).toString()) return;
  edit(value.isEmpty() ? "remove" : "set", "/" + fields_->item(row, kRecipePath)->text().toStdString(),
       value.toStdString());
}

void PatientPanel::addLabel() {
  if (!asShown()) return;
  const modelling::Document document(texts_[at_]);
  const bool of_map = document.has("/tissues");
  const std::string list = of_map ? "/tissues" : "/labels";
  int number = 1;
  while (document.has(list + "/label_" + std::to_string(number))) ++number;
  edit("insert", list + "/-",
       "{name: label_" + std::to_string(number) + ", tissue: liver, " +
           (of_map ? "label: " + std::to_string(number) : std::string("values: [0, 100]")) + "}");
}

void PatientPanel::deleteLabel() {
  const int row = fields_->currentRow();
  const QStringList words = row < 0 ? QStringList() : fields_->item(row, kRecipePath)->text().split('/');
  if (words.size() < 3) return tell(problem_, "no line of a label is chosen");
  edit("remove", "/" + words[0].toStdString() + "/" + words[1].toStdString(), "");
}

void PatientPanel::runScene() {
  if (!asShown()) return;
  vest_msgs::LoadScene load;
  try {
    const std::string name = image::readPatient(recipe()).name;
    load.request.scene = fs::absolute(fs::path(recipe()).parent_path() / (name + ".yaml")).string();
    if (!fs::exists(load.request.scene))
      throw std::invalid_argument(load.request.scene + ": is not there: Bake writes it");
  } catch (const std::exception& error) {
    return tell(problem_, error.what());
  }
  call<vest_msgs::LoadScene>(
      "tissue/load_scene", load, [this](const vest_msgs::LoadScene& answer, const std::string& problem) {
        tell(problem_, !problem.empty() ? problem : answer.response.success ? "" : answer.response.message);
        if (problem.empty() && answer.response.success)
          told_->appendPlainText("loaded: scene " + qt(answer.response.scene_hash));
      });
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::PatientPanel, rviz::Panel)
