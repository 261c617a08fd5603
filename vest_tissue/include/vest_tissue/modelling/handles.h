#pragma once

#include <string>
#include <vector>

#include "vest_tissue/modelling/source.h"

/// Where a hand takes hold of a drawn object, and what it writes into the source there (docs/modelling.md).
namespace vest::modelling {

struct Handle {
  enum class Kind : unsigned char {
    Point,      ///< a point of a curve: moves freely
    Whole,      ///< all points of the object: moves freely
    Direction,  ///< a direction from `origin`: moves freely
    Length,     ///< a radius: moves along `axis` from `origin`
    Profile,    ///< [height, radius]: moves in the plane of `axis` (height) and `across` from `origin`
  } kind = Kind::Point;
  std::string path;  ///< of the value, below the object: /tube/centre/3
  Vector3 place = Vector3::Zero();
  Vector3 origin = Vector3::Zero();
  Vector3 axis{0, 0, 1}, across{1, 0, 0};  ///< unit
  std::vector<std::vector<Vector3>> all;   ///< of Whole: its curves
  bool nested = false;                     ///< of Whole: a list of curves, not one curve
  std::string insert_path, insert_value;   ///< an insert that adds one behind this; empty: none
  std::string remove_path;                 ///< what a remove takes away; empty: nothing
};

/// Of an object that was read alone (readAlone): control points, radii of cross-sections at their angles, the
/// profile, bumps; of a tree root, direction and radius. `lay` and `clear` move a surface away from them.
std::vector<Handle> handlesOf(const SceneSource& alone);

/// What the source says when a handle was moved to a place: YAML in one line, m to 0.01 mm.
/// @param place m, world; what the handle cannot reach is projected to the nearest that it can
std::string valueAt(const Handle& handle, const Vector3& place);

/// Lines that show how an object is drawn: centre curve and cross-sections, curves, profile, branches; m.
std::vector<std::vector<Vector3>> linesOf(const SceneSource& alone);

}  // namespace vest::modelling
