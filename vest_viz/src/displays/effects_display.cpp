#include "effects_display.h"

#include <OgreCamera.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/string_property.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <pluginlib/class_list_macros.hpp>

#include "ogre_assets.h"

namespace vest::displays {

EffectsDisplay::EffectsDisplay() {
  tissue_topic_ =
      new rviz::StringProperty("Tissue Topic", "tissue", "Prefix of attachments and sutures.", this);
  effects_topic_ = new rviz::StringProperty("Effects Topic", "effects", "Prefix of fluid and smoke.", this);
  light_ = new rviz::FloatProperty("Light", 1.0f, "Brightness of the lamp beside the viewer.", this);
  light_->setMin(0.0f);
  for (rviz::StringProperty* p : {tissue_topic_, effects_topic_})
    QObject::connect(p, &rviz::Property::changed, this, [this] { subscribe(); });
}

EffectsDisplay::~EffectsDisplay() {
  for (ros::Subscriber& s : subscribers_) s.shutdown();
}

void EffectsDisplay::onInitialize() {
  try {
    loadOgreMedia();
    visual_ = std::make_unique<EffectsVisual>(scene_manager_, scene_node_, false);
  } catch (const std::exception& e) {
    setStatusStd(rviz::StatusProperty::Error, "Media", e.what());
  }
}

void EffectsDisplay::onEnable() {
  subscribe();
}

void EffectsDisplay::onDisable() {
  for (ros::Subscriber& s : subscribers_) s.shutdown();
}

void EffectsDisplay::reset() {
  rviz::Display::reset();
  attachments_.reset();
  sutures_.reset();
  fluid_.reset();
  smoke_.reset();
  if (visual_) visual_->clear();
  if (isEnabled()) subscribe();
}

void EffectsDisplay::subscribe() {
  if (!isEnabled()) return;
  const std::string tissue = tissue_topic_->getStdString(), effects = effects_topic_->getStdString();
  subscribers_[0] = update_nh_.subscribe<vest_msgs::TissueAttachments>(
      tissue + "/attachments", 1, [this](const vest_msgs::TissueAttachments::ConstPtr& m) {
        attachments_ = m;
        frame_ = m->header.frame_id;
        changed_ = true;
      });
  subscribers_[1] = update_nh_.subscribe<vest_msgs::SutureStates>(
      tissue + "/sutures", 1, [this](const vest_msgs::SutureStates::ConstPtr& m) {
        sutures_ = m;
        frame_ = m->header.frame_id;
        changed_ = true;
      });
  subscribers_[2] = update_nh_.subscribe<vest_msgs::FluidState>(
      effects + "/fluid", 1, [this](const vest_msgs::FluidState::ConstPtr& m) {
        fluid_ = m;
        frame_ = m->header.frame_id;
        changed_ = true;
      });
  subscribers_[3] = update_nh_.subscribe<vest_msgs::SmokeState>(
      effects + "/smoke", 1, [this](const vest_msgs::SmokeState::ConstPtr& m) {
        smoke_ = m;
        frame_ = m->header.frame_id;
        changed_ = true;
      });
}

void EffectsDisplay::update(float, float) {
  if (!visual_) return;
  // A lamp at the viewer, as that of the display Tissue.
  visual_->setLight(Ogre::Vector4(0.0f, 1.5f, 2.0f, 4.0f * light_->getFloat()));
  if (!changed_) return;
  changed_ = false;
  Ogre::Vector3 position = Ogre::Vector3::ZERO;
  Ogre::Quaternion orientation = Ogre::Quaternion::IDENTITY;
  if (context_->getFrameManager()->getTransform(frame_, ros::Time(), position, orientation)) {
    scene_node_->setPosition(position);
    scene_node_->setOrientation(orientation);
    setStatusStd(rviz::StatusProperty::Ok, "Frame", frame_);
  } else {
    setStatusStd(rviz::StatusProperty::Warn, "Frame", "no transform from " + frame_);
  }
  Eigen::Vector3d eye(0, 0, 1);
  rviz::ViewManager* views = context_->getViewManager();
  if (views != nullptr && views->getCurrent() != nullptr) {
    const Ogre::Vector3 p =
        orientation.Inverse() * (views->getCurrent()->getCamera()->getDerivedPosition() - position);
    eye = {p.x, p.y, p.z};
  }
  if (attachments_) visual_->setAttachments(*attachments_);
  if (sutures_) visual_->setSutures(*sutures_);
  if (fluid_) visual_->setFluid(fluid_, eye);
  if (smoke_) visual_->setSmoke(*smoke_, eye, true);
  setStatus(rviz::StatusProperty::Ok, "Effects",
            QString("%1 drops, %2 pools, %3 puffs, %4 attachments")
                .arg(fluid_ ? fluid_->positions.size() / 3 : 0)
                .arg(fluid_ ? fluid_->pools.size() : 0)
                .arg(smoke_ ? smoke_->puffs.size() : 0)
                .arg(attachments_ ? attachments_->attachments.size() : 0));
  if (!visual_->warning().empty())
    setStatusStd(rviz::StatusProperty::Warn, "Shaders", "not all is shown: " + visual_->warning());
  context_->queueRender();
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::EffectsDisplay, rviz::Display)
