#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "dynamic_mesh.h"
#include "ogre_vector.h"
#include "vest_viz/instrument/jaws.h"

namespace vest::displays {

/// One instrument of the picture: shaft, fixed parts and two jaws from the meshes of package
/// vest_instruments, or capsules where a mesh is missing.
class InstrumentVisual {
 public:
  /// @param depth_in_alpha for the finishing pass of the endoscopic view
  InstrumentVisual(Ogre::SceneManager* manager, Ogre::SceneNode* parent, bool depth_in_alpha);
  ~InstrumentVisual();

  /// @param tool one of vest_msgs/InstrumentState.TOOL_*; meshes are exchanged when it changes
  void setTool(int tool);
  /// @param X_WTip tip pose in world; @param jaw full opening, rad
  void setPose(const Eigen::Isometry3d& X_WTip, double jaw);
  /// All parts in world as they were placed last, for ground truth.
  instrument::TriangleMesh worldMesh() const;
  /// Axis of the shaft in world, from the middle of the jaws outwards, and its radius; false: nothing shown.
  bool shaft(Eigen::Vector3d* from, Eigen::Vector3d* to, double* radius) const;
  /// Where the jaws are in world; false: nothing shown, or there are none.
  bool jaws(instrument::Jaws* jaws) const;
  bool visible() const { return visible_; }
  /// @param full of what its gauze holds, 0 … 1; @param blood share of blood in that, 0 … 1. Without gauze
  /// nothing.
  void setSoaked(float full, float blood);
  void setLight(const Ogre::Vector4& light);
  /// How fine the picture is. Teeth that its pixels cannot show are left out (instrument::toothless()).
  /// @param camera m, its place in world; @param pixels per rad
  void setDetail(const Eigen::Vector3d& camera, double pixels);
  void setVisible(bool visible);
  const std::string& warning() const { return warning_; }

 private:
  struct Part {
    std::unique_ptr<DynamicMesh> mesh;
    Ogre::MaterialPtr material;
    instrument::TriangleMesh triangles;
    instrument::TriangleMesh toothless;  ///< of jaws with teeth
    bool gauze = false;
  };
  enum class Surface : std::uint8_t { Steel, Insulation, Gauze };
  void add(int slot, const instrument::TriangleMesh& mesh, Surface surface);
  void clear();

  Ogre::SceneManager* manager_;
  Ogre::SceneNode* node_;
  std::array<std::vector<Part>, 3> slots_;  ///< 0: tip frame, 1 and 2: jaws
  std::array<Ogre::SceneNode*, 3> slot_nodes_;
  int tool_ = -1;
  double jaw_length_ = 0, shaft_radius_ = 0;
  double opening_ = 0;  ///< rad
  float teeth_ = 1;     ///< share that is drawn
  bool depth_in_alpha_, visible_ = true;
  std::array<Eigen::Isometry3d, 3> X_WSlot_;
  std::string warning_;
};

}  // namespace vest::displays
