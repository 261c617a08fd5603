#pragma once

#include <memory>
#include <string>

#include <rviz/tool.h>

#include "legend.h"
#include "tissue_input.h"
#include "vest_viz/inspect/pick.h"

namespace Ogre {
class ManualObject;
class SceneNode;
}  // namespace Ogre

namespace rviz {
class StringProperty;
}

namespace vest::displays {

/// vest_viz/Pick: a click on tissue picks a knot or a link; all that is known of it stands in the corner of
/// the view and follows the simulation.
class PickTool : public rviz::Tool {
 public:
  PickTool();
  ~PickTool() override;
  void onInitialize() override;
  void activate() override;
  void deactivate() override;
  void update(float wall_dt, float ros_dt) override;
  int processMouseEvent(rviz::ViewportMouseEvent& event) override;

 private:
  void show();
  void mark();

  rviz::StringProperty* topic_;
  ros::NodeHandle handle_;
  TissueInput input_;
  inspect::Picked picked_;
  std::unique_ptr<Legend> legend_;
  Ogre::SceneNode* node_ = nullptr;
  Ogre::ManualObject* marker_ = nullptr;
  std::string material_;
  float since_ = 1e9f;
};

}  // namespace vest::displays
