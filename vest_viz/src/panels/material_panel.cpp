#include "material_panel.h"

#include <QComboBox>
#include <QDoubleSpinBox>
#include <QGridLayout>
#include <QLabel>
#include <QPushButton>

#include <vest_msgs/ParameterEdit.h>
#include <pluginlib/class_list_macros.hpp>

namespace vest::panels {
namespace {

/// Parameters that a step applies (docs/parameters.md), with their bounds there.
struct Parameter {
  const char *name, *unit;
  double low, high, usual;
  bool of_world;
};
const Parameter kParameters[] = {
    {"youngs_modulus", " Pa", 10.0, 1e8, 10000.0, false}, {"damping_scale", "", 0.01, 100.0, 1.0, false},
    {"gravity_x", " m/s²", -100.0, 100.0, 0.0, true},     {"gravity_y", " m/s²", -100.0, 100.0, 0.0, true},
    {"gravity_z", " m/s²", -100.0, 100.0, -9.81, true},
};
const char* const kWorld = "the world";

}  // namespace

MaterialPanel::MaterialPanel(QWidget* parent) : BasePanel(parent) {
  auto* const grid = new QGridLayout(this);
  object_ = new QComboBox;
  object_->addItem(kWorld);
  parameter_ = new QComboBox;
  value_ = new QDoubleSpinBox;
  value_->setDecimals(3);
  object_->setToolTip("what is changed: an object, or the world");
  parameter_->setToolTip("as named in docs/parameters.md; damping_scale: 1 is the damping of the scene");
  value_->setToolTip("the value to set; begins at a usual one, not at that of the scene");
  auto* const button = new QPushButton("Apply");
  button->setToolTip("changes it with the next step, and the recording keeps it");
  about_ = new QLabel("no tissue heard");
  about_->setWordWrap(true);
  problem_ = new QLabel;
  problem_->setWordWrap(true);
  problem_->setStyleSheet("color: #b00020");
  problem_->hide();
  grid->addWidget(object_, 0, 0);
  grid->addWidget(parameter_, 0, 1);
  grid->addWidget(value_, 1, 0);
  grid->addWidget(button, 1, 1);
  grid->addWidget(about_, 2, 0, 1, 2);
  grid->addWidget(problem_, 3, 0, 1, 2);
  grid->setRowStretch(4, 1);
  connect(object_, QOverload<int>::of(&QComboBox::currentIndexChanged), this, [this](int) { showObject(); });
  connect(parameter_, QOverload<int>::of(&QComboBox::currentIndexChanged), this,
          [this](int) { showParameter(); });
  connect(button, &QPushButton::clicked, this, [this] { apply(); });
  showObject();
}

void MaterialPanel::connectTopics() {
  topology_sub_ = nh().subscribe<vest_msgs::TissueTopology>(
      "tissue/topology", 1, [this](const vest_msgs::TissueTopologyConstPtr& msg) { onTopology(*msg); });
  edit_pub_ = nh().advertise<vest_msgs::ParameterEdit>("parameter_edit", 10);
}

void MaterialPanel::onTopology(const vest_msgs::TissueTopology& msg) {
  if (msg.scene_hash == topology_.scene_hash && !topology_.objects.empty()) return;
  topology_ = {};
  topology_.scene_hash = msg.scene_hash;
  object_->clear();
  object_->addItem(kWorld);
  for (const auto& object : msg.objects) {
    if (object.model == vest_msgs::TissueObject::MODEL_RIGID) continue;
    vest_msgs::TissueObject names;
    names.name = object.name, names.organ = object.organ, names.material = object.material;
    names.knot_count = object.knot_count;
    topology_.objects.push_back(names);
    object_->addItem(QString::fromStdString(object.name));
  }
  if (object_->count() > 1) object_->setCurrentIndex(1);
}

void MaterialPanel::showObject() {
  const bool world = object_->currentIndex() <= 0;
  parameter_->clear();
  for (const Parameter& parameter : kParameters)
    if (parameter.of_world == world) parameter_->addItem(parameter.name);
  const auto i = static_cast<std::size_t>(object_->currentIndex() - 1);
  if (world || i >= topology_.objects.size()) {
    about_->setText(topology_.objects.empty() ? "no tissue heard" : "");
    return;
  }
  const auto& object = topology_.objects[i];
  about_->setText(QString("%1, material %2, %3 knots")
                      .arg(QString::fromStdString(object.organ), QString::fromStdString(object.material))
                      .arg(object.knot_count));
}

void MaterialPanel::showParameter() {
  for (const Parameter& parameter : kParameters) {
    if (parameter_->currentText() != parameter.name) continue;
    value_->setRange(parameter.low, parameter.high);
    value_->setSuffix(QString::fromUtf8(parameter.unit));
    value_->setValue(parameter.usual);
  }
}

void MaterialPanel::apply() {
  vest_msgs::ParameterEdit edit;
  if (object_->currentIndex() > 0) edit.object = object_->currentText().toStdString();
  edit.parameter = parameter_->currentText().toStdString();
  edit.value = value_->value();
  tell(problem_,
       edit_pub_.getNumSubscribers() == 0 ? "nobody takes parameter_edit: is the trainer running?" : "");
  edit_pub_.publish(edit);
}

}  // namespace vest::panels

PLUGINLIB_EXPORT_CLASS(vest::panels::MaterialPanel, rviz::Panel)
