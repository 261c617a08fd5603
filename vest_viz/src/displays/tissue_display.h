#pragma once

#include <array>
#include <memory>

#include <rviz/display.h>

#include "legend.h"
#include "slice_visual.h"
#include "tissue_input.h"
#include "tissue_visual.h"

namespace rviz {
class BoolProperty;
class EnumProperty;
class FloatProperty;
class StringProperty;
class VectorProperty;
}  // namespace rviz

namespace vest::displays {

/// vest_viz/Tissue: the skins of all objects in rviz's 3-D view, with the net behind them on demand.
class TissueDisplay : public rviz::Display {
  Q_OBJECT
 public:
  TissueDisplay();
  ~TissueDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private Q_SLOTS:
  void updateTopic();
  void updateLook();

 private:
  void showStatus();
  void updateColours();
  void updateSlice();
  /// Ends of the scale of a field, by the property Scale.
  std::array<float, 2> scaleOf(const mesh::Field& field) const;

  rviz::StringProperty* topic_;
  rviz::StringProperty* objects_;
  rviz::BoolProperty* surface_;
  rviz::BoolProperty* links_;
  rviz::FloatProperty* alpha_;
  rviz::FloatProperty* light_;
  rviz::EnumProperty* colour_by_;
  rviz::EnumProperty* scale_;
  rviz::FloatProperty* low_;
  rviz::FloatProperty* high_;
  rviz::BoolProperty* show_legend_;
  rviz::BoolProperty* slice_;
  rviz::VectorProperty* slice_normal_;
  rviz::FloatProperty* slice_offset_;
  std::unique_ptr<Legend> legend_;
  std::string legend_text_;  ///< what the legend shows, so that it is painted only when it changes
  TissueInput input_;
  std::unique_ptr<TissueVisual> visual_;
  std::unique_ptr<SliceVisual> slice_visual_;
  TissueVisual::Colouring colouring_;
  float since_slice_ = 1e9f;
  float since_status_ = 1e9f;
};

}  // namespace vest::displays
