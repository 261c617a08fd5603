#include "slice_tool.h"

#include <OgreCamera.h>
#include <OgreMath.h>
#include <OgreViewport.h>
#include <rviz/display.h>
#include <rviz/display_context.h>
#include <rviz/display_group.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/vector_property.h>
#include <rviz/viewport_mouse_event.h>
#include <pluginlib/class_list_macros.hpp>

namespace vest::displays {
namespace {
constexpr float kMetresPerPixel = 0.0002f, kRadiansPerPixel = 0.01f;  // a drag across the view: 16 cm
}

SliceTool::SliceTool() {
  shortcut_key_ = 'l';
}

void SliceTool::collect(rviz::DisplayGroup* group, std::vector<rviz::Property*>* slices) {
  for (int i = 0; i < group->numDisplays(); ++i) {
    rviz::Display* const display = group->getDisplayAt(i);
    if (auto* const below = dynamic_cast<rviz::DisplayGroup*>(display)) collect(below, slices);
    if (display->getClassId() == "vest_viz/Tissue" || display->getClassId() == "vest_viz/ImageVolume")
      slices->push_back(display->subProp("Slice"));
  }
}

void SliceTool::activate() {
  std::vector<rviz::Property*> slices;
  collect(context_->getRootDisplayGroup(), &slices);
  for (rviz::Property* slice : slices) slice->setValue(true);
  setStatus(slices.empty() ? "There is no Tissue and no ImageVolume display to slice."
                           : "Left-drag: move the slice along its normal. Right-drag: turn it.");
}

int SliceTool::processMouseEvent(rviz::ViewportMouseEvent& event) {
  const int dx = event.x - event.last_x, dy = event.y - event.last_y;
  if (event.type != QEvent::MouseMove || (!event.left() && !event.right()) || (dx == 0 && dy == 0)) return 0;
  std::vector<rviz::Property*> slices;
  collect(context_->getRootDisplayGroup(), &slices);
  const Ogre::Camera* const camera = event.viewport->getCamera();
  for (rviz::Property* slice : slices) {
    auto* const normal = static_cast<rviz::VectorProperty*>(slice->subProp("Normal"));
    auto* const offset = static_cast<rviz::FloatProperty*>(slice->subProp("Offset"));
    Ogre::Vector3 n = normal->getVector().normalisedCopy();
    if (event.left()) {
      // Upwards or to the right, whichever the normal points to on the screen.
      const float along = n.dotProduct(camera->getDerivedRight()) * static_cast<float>(dx) -
                          n.dotProduct(camera->getDerivedUp()) * static_cast<float>(dy);
      const float into = n.dotProduct(camera->getDerivedDirection()) * static_cast<float>(-dy);
      offset->setFloat(offset->getFloat() + kMetresPerPixel * (along + into));
    } else {
      n = Ogre::Quaternion(Ogre::Radian(kRadiansPerPixel * static_cast<float>(dx)), camera->getDerivedUp()) *
          Ogre::Quaternion(Ogre::Radian(kRadiansPerPixel * static_cast<float>(dy)),
                           camera->getDerivedRight()) *
          n;
      normal->setVector(n.normalisedCopy());
    }
  }
  return Render;
}

}  // namespace vest::displays

PLUGINLIB_EXPORT_CLASS(vest::displays::SliceTool, rviz::Tool)
