#pragma once

#include "stages.h"
#include "vest_tissue/interaction/blade_sweep.h"

namespace vest::scene {

/// What the blades of one step did to one object of finite elements.
struct FemCut {
  double area = 0.0;                                ///< m², newly opened; 0: nothing
  std::uint8_t instrument = 0;                      ///< whose blade it was
  bool electric = false;                            ///< by current
  std::uint32_t triangle = 0;                       ///< contact triangle of the last face that was opened
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m, its middle
  std::uint32_t separated = 0;                      ///< parts that came off
};

/// Opens what the sweeps crossed in this step: faces, knots, contact triangles, skin, anchors, delta. After
/// the knots have moved. Real-time safe.
FemCut cutFem(Context& c, std::size_t object, const interaction::BladeSweep* sweeps, int count);

/// At building: how the surface hangs on the faces. Room for cuts, again after copying a State.
void fillFemSurface(const fem::TissueModel& tissue, ObjectState& s);
void reserveFem(const fem::TissueModel& tissue, ObjectState& s);

}  // namespace vest::scene
