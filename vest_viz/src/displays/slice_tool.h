#pragma once

#include <vector>

#include <rviz/tool.h>

namespace rviz {
class DisplayGroup;
class Property;
}  // namespace rviz

namespace vest::displays {

/// vest_viz/Slice: moves the plane of every Tissue and ImageVolume display by the mouse: left button along
/// its normal, right button turns it.
class SliceTool : public rviz::Tool {
 public:
  SliceTool();
  void activate() override;
  void deactivate() override {}
  int processMouseEvent(rviz::ViewportMouseEvent& event) override;

 private:
  /// The properties "Slice" of these displays in a group and the groups below.
  static void collect(rviz::DisplayGroup* group, std::vector<rviz::Property*>* slices);
};

}  // namespace vest::displays
