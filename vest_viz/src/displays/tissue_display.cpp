#include "tissue_display.h"

#include <sstream>

#include <OgreSceneNode.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <pluginlib/class_list_macros.hpp>

#include "ogre_assets.h"

namespace vest::displays {

TissueDisplay::TissueDisplay() {
  topic_ = new rviz::StringProperty("Tissue Topic", "tissue", "Prefix of topology, topology_delta and state.",
                                    this, SLOT(updateTopic()));
  objects_ = new rviz::StringProperty("Objects", "",
                                      "Names or organ words to show, separated by spaces; empty: all.", this,
                                      SLOT(updateLook()));
  surface_ = new rviz::BoolProperty("Surface", true, "Show the skins.", this, SLOT(updateLook()));
  links_ =
      new rviz::BoolProperty("Links", false, "Show the wire net of living links.", this, SLOT(updateLook()));
  alpha_ = new rviz::FloatProperty("Alpha", 1.0f, "Opacity of the skins.", this, SLOT(updateLook()));
  alpha_->setMin(0.0f);
  alpha_->setMax(1.0f);
  light_ = new rviz::FloatProperty("Light", 1.0f, "Brightness of the lamp beside the viewer.", this,
                                   SLOT(updateLook()));
  light_->setMin(0.0f);
}

TissueDisplay::~TissueDisplay() {
  input_.unsubscribe();
}

void TissueDisplay::onInitialize() {
  try {
    loadOgreMedia();
    visual_ = std::make_unique<TissueVisual>(scene_manager_, scene_node_, 1, false);
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Media", e.what());
  }
}

void TissueDisplay::onEnable() {
  updateTopic();
}

void TissueDisplay::onDisable() {
  input_.unsubscribe();
}

void TissueDisplay::reset() {
  rviz::Display::reset();
  input_.clear();
  if (visual_) visual_->update(input_.store());
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
  if (visual_ && !input_.store().empty()) visual_->update(input_.store());
  context_->queueRender();
}

void TissueDisplay::update(float wall_dt, float) {
  if (!visual_) return;
  takeBakedTextures();
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  const std::string frame = input_.header().frame_id.empty() ? "world" : input_.header().frame_id;
  const bool placed = context_->getFrameManager()->getTransform(frame, ros::Time(), position, orientation);
  if (placed) {
    scene_node_->setPosition(position);
    scene_node_->setOrientation(orientation);
  }
  if (input_.process()) {
    visual_->update(input_.store());
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
