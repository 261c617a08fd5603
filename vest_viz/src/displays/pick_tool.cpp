#include "pick_tool.h"

#include <OgreCamera.h>
#include <OgreManualObject.h>
#include <OgreMaterialManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreViewport.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/string_property.h>
#include <rviz/viewport_mouse_event.h>
#include <QStringList>
#include <pluginlib/class_list_macros.hpp>

#include "ogre_assets.h"
#include "ogre_versions.h"

namespace vest::displays {

PickTool::PickTool() {
  shortcut_key_ = 'p';
  topic_ = new rviz::StringProperty("Tissue Topic", "tissue", "Prefix of topology, topology_delta and state.",
                                    getPropertyContainer());
}

PickTool::~PickTool() {
  input_.unsubscribe();
  if (marker_ != nullptr) scene_manager_->destroyManualObject(marker_);
  if (node_ != nullptr) scene_manager_->destroySceneNode(node_);
  if (material_.empty()) return;
  Ogre::MaterialPtr material = Ogre::MaterialManager::getSingleton().getByName(material_, kOgreGroup);
  drop(material);
}

void PickTool::onInitialize() {
  setName("Pick Tissue");
  loadOgreMedia();
  material_ = uniqueName("pick");
  const Ogre::MaterialPtr material = Ogre::MaterialManager::getSingleton().create(material_, kOgreGroup);
  material->setLightingEnabled(false);
  Ogre::Pass* pass = material->getTechnique(0)->getPass(0);
  pass->setDepthCheckEnabled(false);
  pass->setPointSize(9);
  setLineWidth(pass, 3);
  node_ = scene_manager_->getRootSceneNode()->createChildSceneNode();
  marker_ = scene_manager_->createManualObject(uniqueName("pick"));
  marker_->setDynamic(true);
  marker_->setRenderQueueGroup(Ogre::RENDER_QUEUE_MAIN + 31);
  node_->attachObject(marker_);
  marker_->setVisible(false);
}

void PickTool::activate() {
  input_.subscribe(handle_, topic_->getStdString());
  if (!legend_) {
    legend_ = std::make_unique<Legend>();
    legend_->setCorner(1);
  }
  setStatus("Click on tissue to read a knot or a link.");
}

void PickTool::deactivate() {
  input_.unsubscribe();
  legend_.reset();
  picked_ = {};
  if (marker_ != nullptr) marker_->setVisible(false);
}

void PickTool::update(float wall_dt, float) {
  const bool changed = input_.process();
  const std::string& frame = input_.header().frame_id;
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  if (node_ != nullptr &&
      context_->getFrameManager()->getTransform(frame, ros::Time(), position, orientation)) {
    node_->setPosition(position);
    node_->setOrientation(orientation);
  }
  if (!changed || picked_.kind == inspect::Picked::Kind::Nothing) return;
  mark();
  if ((since_ += wall_dt) < 0.25f) return;
  since_ = 0;
  show();
}

int PickTool::processMouseEvent(rviz::ViewportMouseEvent& event) {
  if (!event.leftDown() || event.viewport == nullptr) return 0;
  const Ogre::Ray ray = event.viewport->getCamera()->getCameraToViewportRay(
      static_cast<float>(event.x) / static_cast<float>(event.viewport->getActualWidth()),
      static_cast<float>(event.y) / static_cast<float>(event.viewport->getActualHeight()));
  // Into the tissue's frame, which need not be rviz's fixed frame.
  const Ogre::Quaternion turn = node_->getOrientation().Inverse();
  const Ogre::Vector3 eye = turn * (ray.getOrigin() - node_->getPosition());
  const Ogre::Vector3 direction = turn * ray.getDirection().normalisedCopy();
  picked_ =
      inspect::pick(input_.store(), {eye.x, eye.y, eye.z}, {direction.x, direction.y, direction.z}, 0.02);
  if (input_.store().empty())
    setStatus("No tissue has come from " + topic_->getString() + ".");
  else if (picked_.kind == inspect::Picked::Kind::Nothing)
    setStatus("No knot and no link there.");
  mark();
  show();
  return Render;
}

void PickTool::mark() {
  marker_->setVisible(picked_.kind != inspect::Picked::Kind::Nothing);
  if (picked_.kind == inspect::Picked::Kind::Nothing) return;
  const mesh::Store& store = input_.store();
  if (inspect::describe(store, picked_).empty()) {  // gone with a new scene
    picked_ = {};
    marker_->setVisible(false);
    return;
  }
  const float* p = store.knots(picked_.object);
  const bool knot = picked_.kind == inspect::Picked::Kind::Knot;
  marker_->clear();
  marker_->begin(material_, knot ? Ogre::RenderOperation::OT_POINT_LIST : Ogre::RenderOperation::OT_LINE_LIST,
                 kOgreGroup);
  for (std::size_t end = 0; end < (knot ? 1u : 2u); ++end) {
    const std::size_t k =
        knot ? picked_.element
             : store.topology().objects[picked_.object].link_knots[2 * picked_.element + end];
    marker_->position(p[3 * k], p[3 * k + 1], p[3 * k + 2]);
    marker_->colour(1.0f, 0.9f, 0.1f);
  }
  marker_->end();
}

void PickTool::show() {
  const std::vector<std::string> lines = inspect::describe(input_.store(), picked_);
  if (lines.empty()) {
    if (legend_) legend_->hide();
    return;
  }
  if (legend_) legend_->showText(lines);
  QStringList said;
  for (const std::string& line : lines) said << QString::fromStdString(line);
  setStatus(said.join(", "));
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::PickTool, rviz::Tool)
