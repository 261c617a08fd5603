#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "../scene/delta_room.h"
#include "../scene/stages.h"
#include "vest_tissue/scene/topology.h"

namespace vest::scene {

inline Eigen::Vector3d toVector(const interaction::Vector3Floats& v) {
  return {v[0], v[1], v[2]};
}

/// One object's cut in one step: what the parts of cutting work on. Everything lies in State and Scratch.
struct CutJob {
  Context& c;
  std::uint16_t object;
  ObjectState& s;
  interaction::CutState& cut;
  interaction::CutScratch& k;
  const Object& described;
  const interaction::CutConstants& constants;
  TopologyDelta& delta;
  bool divided = false;  ///< a knot was doubled in this step
  bool parted = false;   ///< there are more pieces than before it

  CutJob(Context& context, std::size_t index, TopologyDelta& to)
      : c(context),
        object(static_cast<std::uint16_t>(index)),
        s(context.state.objects[index]),
        cut(s.cut),
        k(context.scratch.cut),
        described(context.model.description.objects[index]),
        constants(context.model.objects[index].cut),
        delta(to) {}

  /// Where a knot is at rest, m.
  const Eigen::Vector3d& rest(std::uint32_t knot) const {
    const std::size_t of_scene = k.version_of[knot];
    return described.rest_position.empty() ? described.position[of_scene] : described.rest_position[of_scene];
  }
  Eigen::Vector3d centroid(std::uint32_t triangle) const {
    const auto& t = s.triangles[triangle];
    return (rest(t[0]) + rest(t[1]) + rest(t[2])) / 3.0;
  }
  Eigen::Vector3d middle(std::uint32_t triangle) const {  ///< as it is now
    const auto& t = s.triangles[triangle];
    return (knotPosition(s, t[0]) + knotPosition(s, t[1]) + knotPosition(s, t[2])) / 3.0;
  }
  Eigen::Vector3d normal(
      std::uint32_t triangle) const {  ///< of a contact triangle at rest; its length: 2·area
    const auto& t = s.triangles[triangle];
    return (rest(t[1]) - rest(t[0])).cross(rest(t[2]) - rest(t[0]));
  }
  Eigen::Vector3d inward(std::uint32_t knot) const {
    const auto& v = cut.inward[knot];
    return {v[0], v[1], v[2]};
  }
  void setInward(std::uint32_t knot, const Eigen::Vector3d& v) {
    for (int e = 0; e < 3; ++e) cut.inward[knot][static_cast<std::size_t>(e)] = static_cast<float>(v[e]);
  }
  const std::uint32_t* begin(std::uint32_t knot) const { return k.incident.data() + k.incident_start[knot]; }
  const std::uint32_t* end(std::uint32_t knot) const {
    return k.incident.data() + k.incident_start[knot + 1];
  }
  bool adjacent(std::uint32_t a, std::uint32_t b) const {
    for (const std::uint32_t* t = begin(a); t != end(a); ++t)
      if (s.triangles[*t][0] == b || s.triangles[*t][1] == b || s.triangles[*t][2] == b) return true;
    return false;
  }
  /// Two knots lie on different sides of a cut between them: they look away from it, and not at each other.
  bool facingAway(const Eigen::Vector3d& in_a, const Eigen::Vector3d& in_b,
                  const Eigen::Vector3d& way) const {
    const double a2 = in_a.squaredNorm(), b2 = in_b.squaredNorm(), w2 = way.squaredNorm();
    if (!(a2 > 1e-12) || !(b2 > 1e-12)) return false;
    const double together = in_a.dot(in_b);
    if (together > -0.3 * std::sqrt(a2 * b2)) return false;
    return !(in_a.dot(way) > 0.3 * std::sqrt(a2 * w2) && in_b.dot(way) < -0.3 * std::sqrt(b2 * w2));
  }
  bool across(std::uint32_t a, std::uint32_t b) const {
    return facingAway(inward(a), inward(b), rest(b) - rest(a));
  }
};

/// Parts, in files of their own. `true`: something has changed.
void renewVersions(CutJob& j);
void renewIncident(CutJob& j);
bool divideNet(CutJob& j);       ///< cut_net.cpp: doubles knots along the line
void divideElements(CutJob& j);  ///< cut_elements.cpp: links, hinges, volumes, anchors, parts
void divideVolumes(CutJob& j);   ///< cut_volume.cpp
void openSkin(CutJob& j);        ///< cut_skin.cpp
/// Skin whose contact triangle has torn goes, as much of it as the delta has room for.
void removeTornSkin(CutJob& j);  ///< cut_skin.cpp
/// What the delta has no room for waits for the next step.
void bindSkin(CutJob& j, std::size_t old_vertices);                  ///< cut_binding.cpp
std::uint32_t acrossOrgan(const CutJob& j, std::uint32_t triangle);  ///< cut_binding.cpp

}  // namespace vest::scene
