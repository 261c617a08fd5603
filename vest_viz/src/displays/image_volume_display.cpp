#include "image_volume_display.h"

#include <algorithm>
#include <cmath>

#include <OgreRenderWindow.h>
#include <OgreSceneNode.h>
#include <ros/package.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/color_property.h>
#include <rviz/properties/editable_enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/properties/vector_property.h>
#include <rviz/render_panel.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <pluginlib/class_list_macros.hpp>

#include "conversion.h"
#include "ogre_assets.h"

namespace vest::displays {
namespace {
constexpr float kBehind =
    2e-4f;  // m: what is cut begins so far behind the slice, which would flicker (tuned)
const char* const kPresets[] = {"bone", "soft", "lung", "vessels", "skin"};
}  // namespace

ImageVolumeDisplay::ImageVolumeDisplay() {
  topic_ = new rviz::RosTopicProperty("Topic", "image/volume", "vest_msgs/ImageVolume",
                                      "vest_msgs/ImageVolume, latched.", this);
  volume_ = new rviz::BoolProperty("Volume", true, "Show the whole volume by a table.", this);
  volume_->setDisableChildrenIfFalse(true);
  table_ = new rviz::EditableEnumProperty(
      "Table", "soft",
      "Colours and opacities by value: one that is shipped, or the path of a file of your own.", volume_);
  for (const char* const name : kPresets) table_->addOptionStd(name);
  rows_group_ =
      new rviz::Property("Rows", QVariant(), "The table's rows; between them all is linear.", volume_);
  shaded_ = new rviz::BoolProperty("Shaded", true, "By a lamp at the viewer.", volume_);
  card_ = new rviz::BoolProperty(
      "Graphics Card", false,
      "Rays through a 3-D texture by the graphics card. Without it the processor casts them.", volume_);
  const char* const names[] = {"Sagittal", "Coronal", "Axial"};  // a supine patient: across x, z, y
  const int axes[] = {0, 2, 1};
  for (int p = 0; p < 3; ++p) {
    const int a = axes[p];
    planes_[a] =
        new rviz::BoolProperty(names[p], false, QString("Slice across ") + "xyz"[a] + " of world.", this);
    planes_[a]->setDisableChildrenIfFalse(true);
    places_[a] =
        new rviz::FloatProperty("Place", 0.5f, "0 … 1 from one end of the volume to the other.", planes_[a]);
    places_[a]->setMin(0);
    places_[a]->setMax(1);
  }
  slice_ = new rviz::BoolProperty("Slice", false,
                                  "An oblique slice. The tool vest_viz/Slice moves it with the mouse.", this);
  slice_->setDisableChildrenIfFalse(true);
  normal_ = new rviz::VectorProperty("Normal", Ogre::Vector3(1, 0, 0), "In world.", slice_);
  offset_ = new rviz::FloatProperty("Offset", 0.0f, "m along the normal from the origin of world.", slice_);
  cut_ = new rviz::BoolProperty("Cut Volume", true,
                                "Take away the side of the volume to which the normal points.", slice_);
  level_ = new rviz::FloatProperty("Level", 40,
                                   "Middle of the grey values of slices, HU or the image's unit.", this);
  width_ =
      new rviz::FloatProperty("Window", 400, "From black to white in slices, HU or the image's unit.", this);
  width_->setMin(1);
  QObject::connect(topic_, &rviz::Property::changed, this, [this] { subscribe(); });
  QObject::connect(table_, &rviz::Property::changed, this, [this] { loadTable(); });
  for (rviz::Property* p : std::initializer_list<rviz::Property*>{
           volume_, shaded_, card_, planes_[0], planes_[1], planes_[2], places_[0], places_[1], places_[2],
           slice_, normal_, offset_, cut_, level_, width_})
    QObject::connect(p, &rviz::Property::changed, this, [this] { slices_changed_ = true; });
}

ImageVolumeDisplay::~ImageVolumeDisplay() {
  subscriber_.shutdown();
}

void ImageVolumeDisplay::onInitialize() {
  try {
    loadOgreMedia();
    rviz::RenderPanel* const panel = context_->getViewManager()->getRenderPanel();
    visual_ = std::make_unique<VolumeVisual>(scene_manager_, panel->getRenderWindow());
    visual_->setVisible(false);
    for (auto& section : sections_) section = std::make_unique<SectionVisual>(scene_manager_, scene_node_);
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Media", e.what());
    visual_.reset();
    return;
  }
  loadTable();
}

void ImageVolumeDisplay::onEnable() {
  subscribe();
}

void ImageVolumeDisplay::onDisable() {
  subscriber_.shutdown();
  if (visual_) visual_->setVisible(false);
}

void ImageVolumeDisplay::reset() {
  rviz::Display::reset();
  brick_.reset();
  if (visual_) visual_->setBrick(nullptr);
  slices_changed_ = true;
  if (isEnabled()) subscribe();  // a latched message comes again
}

void ImageVolumeDisplay::subscribe() {
  subscriber_.shutdown();
  if (!isEnabled()) return;
  try {
    subscriber_ = update_nh_.subscribe(topic_->getTopicStd(), 1, &ImageVolumeDisplay::take, this);
    setStatus(rviz::StatusProperty::Warn, "Image", "No image yet: rosrun vest_tissue image_server PATH");
  } catch (const ros::Exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Image", e.what());
  }
}

void ImageVolumeDisplay::take(const vest_msgs::ImageVolume::ConstPtr& message) {
  auto brick = std::make_shared<volume::Brick>();
  const std::string fault = toBrick(*message, brick.get());
  if (!visual_) return;
  if (!fault.empty()) {
    setStatusStd(rviz::StatusProperty::Error, "Image", fault);
    return;
  }
  brick_ = brick;
  frame_ = message->header.frame_id;
  low_ = Eigen::Vector3d::Constant(1e300), high_ = -low_;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d grid;
    for (int a = 0; a < 3; ++a) grid[a] = (corner >> a & 1) != 0 ? brick->size[a] - 0.5 : -0.5;
    const Eigen::Vector3d p = brick->origin + brick->axes * grid;
    low_ = low_.cwiseMin(p), high_ = high_.cwiseMax(p);
  }
  visual_->setBrick(brick_);
  takeRows();
  slices_changed_ = true;
  const Eigen::Vector3d mm = 1e3 * brick->axes.colwise().norm().transpose();
  setStatus(rviz::StatusProperty::Ok, "Image",
            QString("%1: %2 x %3 x %4 voxels of %5 x %6 x %7 mm")
                .arg(QString::fromStdString(message->name))
                .arg(brick->size[0])
                .arg(brick->size[1])
                .arg(brick->size[2])
                .arg(mm[0], 0, 'g', 3)
                .arg(mm[1], 0, 'g', 3)
                .arg(mm[2], 0, 'g', 3));
}

void ImageVolumeDisplay::loadTable() {
  const std::string word = table_->getStdString();
  const bool shipped = std::count(std::begin(kPresets), std::end(kPresets), word) > 0;
  try {
    loaded_ = volume::readTransferTable(
        shipped ? ros::package::getPath("vest_tissue") + "/library/tables/" + word + ".csv" : word);
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Table", e.what());
    return;  // the one before goes on
  }
  setStatus(rviz::StatusProperty::Ok, "Table", QString::number(loaded_.size()) + " rows");
  filling_ = true;
  rows_group_->removeChildren();
  rows_.clear();
  for (std::size_t r = 0; r < loaded_.size(); ++r) {
    const volume::Transfer& t = loaded_[r];
    Row row;
    row.group = new rviz::Property("Row " + QString::number(r + 1), QVariant(), "", rows_group_);
    row.value =
        new rviz::FloatProperty("Value", static_cast<float>(t.value), "HU, or the image's unit.", row.group);
    row.colour = new rviz::ColorProperty("Color", QColor::fromRgbF(t.colour[0], t.colour[1], t.colour[2]), "",
                                         row.group);
    auto* const alpha =
        new rviz::FloatProperty("Alpha", static_cast<float>(t.alpha),
                                "0 … 1: share of the light that a millimetre keeps back.", row.group);
    alpha->setMin(0);
    alpha->setMax(1);
    row.alpha = alpha;
    for (rviz::Property* p : {row.value, row.colour, row.alpha})
      QObject::connect(p, &rviz::Property::changed, this, [this] { takeRows(); });
    rows_.push_back(row);
  }
  filling_ = false;
  takeRows();
}

void ImageVolumeDisplay::takeRows() {
  if (filling_ || !visual_ || rows_.empty()) return;
  volume::TransferTable table = loaded_;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    volume::Transfer& t = table[r];
    const QColor colour = static_cast<rviz::ColorProperty*>(rows_[r].colour)->getColor();
    t.value = static_cast<rviz::FloatProperty*>(rows_[r].value)->getFloat();
    t.colour = {colour.redF(), colour.greenF(), colour.blueF()};
    t.alpha = static_cast<rviz::FloatProperty*>(rows_[r].alpha)->getFloat();
    if (!std::isfinite(t.value) || (r > 0 && !(t.value > table[r - 1].value))) {
      setStatusStd(rviz::StatusProperty::Error, "Table",
                   "Row " + std::to_string(r + 1) + ": its value must be above that of the row before");
      return;
    }
  }
  setStatus(rviz::StatusProperty::Ok, "Table", QString::number(table.size()) + " rows");
  visual_->setTable(table);
  context_->queueRender();
}

void ImageVolumeDisplay::drawSlices() {
  slices_changed_ = false;
  const Ogre::Vector3 n = normal_->getVector();
  const bool oblique = slice_->getBool() && std::isfinite(n.length()) && n.length() > 1e-6f;
  std::array<inspect::Plane, 4> planes;
  for (int a = 0; a < 3; ++a)
    planes[a] = {Eigen::Vector3f::Unit(a),
                 static_cast<float>(low_[a] + places_[a]->getFloat() * (high_[a] - low_[a]))};
  if (oblique) planes[3] = {Eigen::Vector3f(n.x, n.y, n.z).normalized(), offset_->getFloat()};
  for (std::size_t a = 0; a < 4; ++a) {
    volume::Section section;
    if (brick_ && (a < 3 ? planes_[a]->getBool() : oblique))
      section = volume::section(*brick_, planes[a], {level_->getFloat(), width_->getFloat()});
    sections_[a]->show(section);
  }
  std::vector<inspect::Plane> cuts;
  if (oblique && cut_->getBool()) {
    cuts.push_back(planes[3]);
    cuts[0].offset -= kBehind;
  }
  visual_->setLook(cuts, shaded_->getBool());
  visual_->setOnCard(card_->getBool());
  visual_->setVisible(isEnabled() && volume_->getBool());
  context_->queueRender();
}

void ImageVolumeDisplay::update(float, float) {
  if (!visual_) return;
  visual_->setCamera(context_->getViewManager()->getCurrent()->getCamera());
  if (slices_changed_) drawSlices();
  if (visual_->refusal().empty())
    deleteStatus("Graphics Card");
  else
    setStatusStd(rviz::StatusProperty::Warn, "Graphics Card", visual_->refusal());
  Ogre::Vector3 position;
  Ogre::Quaternion turn;
  if (!brick_ || !context_->getFrameManager()->getTransform(frame_, ros::Time(), position, turn)) return;
  scene_node_->setPosition(position);
  scene_node_->setOrientation(turn);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = Eigen::Quaterniond(turn.w, turn.x, turn.y, turn.z).normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(position.x, position.y, position.z);
  visual_->setPose(pose);
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::ImageVolumeDisplay, rviz::Display)
