#include "tissue_display.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>

#include <OgreSceneNode.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/properties/vector_property.h>
#include <pluginlib/class_list_macros.hpp>

#include "ogre_assets.h"
#include "vest_instruments/ros/frames.h"
#include "vest_viz/inspect/colour_map.h"
#include "vest_viz/texture/organ_texture.h"

namespace vest::displays {

namespace {

using By = TissueVisual::Colouring::By;
using vest_msgs::TissueField;

struct Option {
  const char* word;
  By by;
  std::uint8_t field;
  const char* title;
};
enum class Scale { Data, Field, Fixed };
/// A field comes in 255 levels of its range: fewer are no detail.
constexpr double kLeastScale = 4.0 / 255;
constexpr float kSliceInterval = 0.1f;  // s: the section follows a moving scene that often

constexpr Option kColourings[] = {{"look", By::Look, 0, ""},
                                  {"strain", By::Field, TissueField::STRAIN, "strain"},
                                  {"stress", By::Field, TissueField::STRESS, "stress, Pa"},
                                  {"temperature", By::Field, TissueField::TEMPERATURE, "temperature, K"},
                                  {"damage", By::Field, TissueField::DAMAGE, "damage"},
                                  {"char", By::Field, TissueField::CHAR, "char"},
                                  {"perfusion", By::Field, TissueField::PERFUSION, "perfusion"},
                                  {"bleeding", By::Field, TissueField::BLEEDING, "bleeding, m3/s"},
                                  {"wetness", By::Field, TissueField::WETNESS, "film of blood"},
                                  {"oxygenation", By::Field, TissueField::OXYGENATION, "oxygen in tissue"},
                                  {"setting", By::Field, TissueField::SETTING, "set film of blood"},
                                  {"material", By::Material, 0, "material"},
                                  {"organ", By::Organ, 0, "organ"},
                                  {"object", By::Object, 0, "object"},
                                  {"layer", By::Layer, 0, "layer"}};

/// Word of an object's material for legend and colour; volumes have several.
std::string materialName(const mesh::Object& o, int inner) {
  const std::string& word = o.material.empty() ? o.name : o.material;
  return inner < 0 ? word : word + ": " + std::to_string(inner + 1);
}

QColor toQt(const inspect::Colour& c) {
  return QColor::fromRgbF(static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2]));
}

}  // namespace

TissueDisplay::TissueDisplay() {
  topic_ = new rviz::StringProperty("Tissue Topic", "tissue", "Prefix of topology, topology_delta and state.",
                                    this, SLOT(updateTopic()));
  objects_ = new rviz::StringProperty(
      "Objects", "",
      "Names or organ words to show, separated by spaces; empty: all. With a - before it: not that one.",
      this, SLOT(updateLook()));
  surface_ = new rviz::BoolProperty("Surface", true, "Show the skins.", this, SLOT(updateLook()));
  links_ =
      new rviz::BoolProperty("Links", false, "Show the wire net of living links.", this, SLOT(updateLook()));
  alpha_ = new rviz::FloatProperty("Alpha", 1.0f, "Opacity of the skins.", this, SLOT(updateLook()));
  alpha_->setMin(0.0f);
  alpha_->setMax(1.0f);
  light_ = new rviz::FloatProperty("Light", 1.0f, "Brightness of the lamp beside the viewer.", this,
                                   SLOT(updateLook()));
  light_->setMin(0.0f);
  colour_by_ = new rviz::EnumProperty("Colour By", "look", "What the colours of the skins mean.", this,
                                      SLOT(updateLook()));
  for (std::size_t i = 0; i < std::size(kColourings); ++i)
    colour_by_->addOption(kColourings[i].word, static_cast<int>(i));
  scale_ = new rviz::EnumProperty(
      "Scale", "data",
      "data: fits itself to the values of the objects that are shown. field: that which the field comes "
      "with. fixed: from Low to High.",
      colour_by_, SLOT(updateLook()), this);
  for (const auto& [word, scale] :
       {std::pair{"data", Scale::Data}, {"field", Scale::Field}, {"fixed", Scale::Fixed}})
    scale_->addOption(word, static_cast<int>(scale));
  low_ = new rviz::FloatProperty("Low", 0.0f, "Lower end of the scale, unit of the field.", colour_by_,
                                 SLOT(updateLook()), this);
  high_ =
      new rviz::FloatProperty("High", 1.0f, "Upper end of the scale.", colour_by_, SLOT(updateLook()), this);
  show_legend_ = new rviz::BoolProperty("Legend", true, "Show what the colours mean.", colour_by_,
                                        SLOT(updateLook()), this);
  slice_ = new rviz::BoolProperty(
      "Slice", false,
      "Cut everything by a plane: fields and materials inside of volumes, walls and lumina of nets. The tool "
      "vest_viz/Slice moves it with the mouse.",
      this, SLOT(updateLook()));
  slice_->setDisableChildrenIfFalse(true);
  slice_normal_ = new rviz::VectorProperty("Normal", Ogre::Vector3(1, 0, 0),
                                           "In world; the side to which it points is taken away.", slice_,
                                           SLOT(updateLook()), this);
  slice_offset_ = new rviz::FloatProperty("Offset", 0.0f, "m along the normal from the origin of world.",
                                          slice_, SLOT(updateLook()), this);
}

TissueDisplay::~TissueDisplay() {
  input_.unsubscribe();
}

void TissueDisplay::onInitialize() {
  try {
    loadOgreMedia();
    visual_ = std::make_unique<TissueVisual>(scene_manager_, scene_node_, 1, false);
    slice_visual_ = std::make_unique<SliceVisual>(scene_manager_, scene_node_);
    slice_visual_->hide();
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Media", e.what());
    visual_.reset();
  }
}

void TissueDisplay::onEnable() {
  updateTopic();
}

void TissueDisplay::onDisable() {
  if (legend_) legend_->hide();
  legend_text_.clear();
  input_.unsubscribe();
}

void TissueDisplay::reset() {
  rviz::Display::reset();
  input_.clear();
  if (visual_) {
    visual_->update(input_.store());
    updateSlice();
  }
  if (isEnabled()) updateTopic();  // latched topology comes again with a new subscription
}

void TissueDisplay::updateTopic() {
  if (isEnabled()) input_.subscribe(update_nh_, topic_->getStdString());
}

void TissueDisplay::updateLook() {
  if (!visual_) return;
  std::set<std::string> names;
  std::istringstream words(objects_->getStdString());
  for (std::string word; words >> word;) names.insert(word);
  visual_->setFilter(names);
  visual_->showSurface(surface_->getBool());
  visual_->showLinks(links_->getBool());
  visual_->setAlpha(alpha_->getFloat());
  updateColours();
  if (!input_.store().empty()) visual_->update(input_.store());
  updateSlice();
  context_->queueRender();
}

void TissueDisplay::updateSlice() {
  const mesh::Store& store = input_.store();
  const Ogre::Vector3 n = slice_normal_->getVector();
  const bool wanted = slice_->getBool() && n.length() > 1e-6f && std::isfinite(n.length());
  inspect::Plane plane;
  if (wanted) {
    plane.normal = Eigen::Vector3f(n.x, n.y, n.z).normalized();
    plane.offset = slice_offset_->getFloat();
  }
  visual_->setSlice(wanted ? &plane : nullptr, store);
  if (!wanted || store.empty()) return slice_visual_->hide();
  since_slice_ = 0;
  const auto& objects = store.topology().objects;
  const inspect::SliceField field{colouring_.field, colouring_.low, colouring_.high};
  const inspect::Slice slice = inspect::slice(
      store, plane, [&](std::size_t i) { return visual_->shows(objects[i].name, objects[i].organ); },
      colouring_.by == By::Field ? &field : nullptr);
  slice_visual_->show(slice, [&](std::size_t v) {
    const mesh::Object& o = objects[slice.object[v]];
    switch (colouring_.by) {
      case By::Field:
        return inspect::valueColour(slice.values[v]);
      case By::Object:
        return inspect::nameColour(o.name);
      case By::Organ:
        return inspect::nameColour(o.organ);
      case By::Material:
        return inspect::nameColour(materialName(o, slice.material[v]));
      case By::Layer:
        return inspect::layerColour(mesh::kCutFace);
      default:
        return inspect::Colour(texture::insideOf(o.organ).base);
    }
  });
}

std::array<float, 2> TissueDisplay::scaleOf(const mesh::Field& field) const {
  const auto scale = static_cast<Scale>(scale_->getOptionInt());
  if (scale == Scale::Fixed) return {low_->getFloat(), high_->getFloat()};
  const double range = static_cast<double>(field.maximum) - static_cast<double>(field.minimum);
  if (scale == Scale::Field || !(range > 0)) return {field.minimum, field.maximum};
  std::uint8_t low = 255, high = 0;
  std::size_t first = 0;
  for (const mesh::Object& o : input_.store().topology().objects) {
    if (visual_->shows(o.name, o.organ) && !o.rigid)
      for (std::size_t k = first; k < first + o.knot_count; ++k) {
        low = std::min(low, field.data[k]);
        high = std::max(high, field.data[k]);
      }
    first += o.knot_count;
  }
  if (low > high) return {field.minimum, field.maximum};
  const auto value = [&](std::uint8_t byte) {
    return static_cast<double>(field.minimum) + range * byte / 255;
  };
  const auto ends = inspect::fittedScale(value(low), value(high), kLeastScale * range);
  return {static_cast<float>(ends[0]), static_cast<float>(ends[1])};
}

void TissueDisplay::updateColours() {
  const mesh::Store& store = input_.store();
  const Option& option = kColourings[static_cast<std::size_t>(colour_by_->getOptionInt())];
  TissueVisual::Colouring colouring;
  colouring.by = option.by;
  colouring.field = option.field;
  const mesh::Field* field = option.by == By::Field ? store.field(option.field) : nullptr;
  colouring.low = low_->getFloat(), colouring.high = high_->getFloat();
  if (field != nullptr) {
    const auto [low, high] = scaleOf(*field);
    colouring.low = low, colouring.high = high;
  }
  colouring_ = colouring;
  visual_->setColouring(colouring, store);
  if (option.by == By::Field && field == nullptr && !store.empty())
    setStatus(rviz::StatusProperty::Warn, "Colours", QString("no field %1 has come: grey").arg(option.word));
  else
    deleteStatus("Colours");

  if (!isEnabled() || option.by == By::Look || !show_legend_->getBool()) {
    if (legend_) legend_->hide();
    legend_text_.clear();
    return;
  }
  std::vector<std::pair<QString, QColor>> rows;
  std::string text =
      std::string(option.word) + std::to_string(colouring.low) + std::to_string(colouring.high);
  if (option.by == By::Layer) {
    const char* const words[] = {"outer skin", "inner wall", "cut face"};
    for (unsigned i = 0; i < 3; ++i) rows.emplace_back(words[i], toQt(inspect::layerColour(i)));
  } else if (option.by != By::Field) {
    std::set<std::string> names;
    for (const mesh::Object& o : store.topology().objects) {
      names.insert(option.by == By::Object ? o.name : option.by == By::Organ ? o.organ : materialName(o, -1));
      if (option.by == By::Material && slice_->getBool())
        for (const std::uint16_t inner :
             std::set<std::uint16_t>(o.tetrahedron_material.begin(), o.tetrahedron_material.end()))
          names.insert(materialName(o, inner));
    }
    for (const std::string& name : names) {
      rows.emplace_back(QString::fromStdString(name), toQt(inspect::nameColour(name)));
      text += "/" + name;
    }
  }
  if (text == legend_text_) return;
  legend_text_ = text;
  if (!legend_) legend_ = std::make_unique<Legend>();
  if (option.by == By::Field)
    legend_->showScale(option.title, static_cast<double>(colouring.low), static_cast<double>(colouring.high));
  else
    legend_->showList(option.title, rows);
}

void TissueDisplay::update(float wall_dt, float) {
  if (!visual_) return;
  takeBakedTextures();
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  const std::string frame =
      input_.header().frame_id.empty() ? ros_shell::frameId("world") : input_.header().frame_id;
  const bool placed = context_->getFrameManager()->getTransform(frame, ros::Time(), position, orientation);
  if (placed) {
    scene_node_->setPosition(position);
    scene_node_->setOrientation(orientation);
  }
  since_slice_ += wall_dt;
  if (input_.process() || !visual_->settled()) {
    visual_->update(input_.store());
    updateColours();
    if (since_slice_ >= kSliceInterval) updateSlice();
    context_->queueRender();
  }
  // A lamp at the viewer that shows near and far alike: far away in proportion to its strength.
  visual_->setLight(Ogre::Vector4(0.0f, 1.5f, 2.0f, 4.0f * light_->getFloat()));
  if ((since_status_ += wall_dt) < 0.5f) return;
  since_status_ = 0;
  if (placed)
    setStatus(rviz::StatusProperty::Ok, "Frame", QString::fromStdString(frame));
  else
    setStatus(rviz::StatusProperty::Warn, "Frame", QString::fromStdString("no transform from " + frame));
  showStatus();
}

void TissueDisplay::showStatus() {
  if (input_.store().empty())
    setStatus(rviz::StatusProperty::Warn, "Tissue", "no topology yet");
  else if (!input_.problem().empty())
    setStatusStd(rviz::StatusProperty::Warn, "Tissue", input_.problem());
  else
    setStatus(rviz::StatusProperty::Ok, "Tissue",
              QString("%1 objects, %2 vertices, %3 states, %4 dropped")
                  .arg(input_.store().topology().objects.size())
                  .arg(visual_->vertexCount())
                  .arg(input_.states())
                  .arg(input_.dropped()));
  if (!visual_->warning().empty())
    setStatusStd(rviz::StatusProperty::Warn, "Shaders", "plain shading: " + visual_->warning());
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::TissueDisplay, rviz::Display)
