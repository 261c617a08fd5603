#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include <Eigen/Geometry>

#include "vest_viz/mesh/store.h"

namespace vest::inspect {

/// Points x with normal · x = offset. World.
struct Plane {
  Eigen::Vector3f normal = Eigen::Vector3f::UnitX();  ///< length 1
  float offset = 0;                                   ///< m
};

/// What a plane cuts of the objects: a filled face and the borders of their skins.
struct Slice {
  std::vector<float> positions;  ///< m, world; x y z per vertex of the face
  std::vector<float> values;     ///< per vertex: the field, 0 at `low`, 1 at `high`; NaN if unknown
  std::vector<int> material;     ///< per vertex: Object::tetrahedron_material; -1: the object has but one
  std::vector<std::uint16_t> object;     ///< per vertex: index in scene order
  std::vector<std::uint32_t> triangles;  ///< three vertices each
  std::vector<float> borders;            ///< m, world; x y z of both ends of each line
};

/// A field to show in a face.
struct SliceField {
  std::uint8_t kind = 0;    ///< of vest_msgs/TissueField
  float low = 0, high = 1;  ///< unit of the kind
};

/// Cuts the objects that are wanted. Objects with tetrahedra are cut element by element, with the field
/// inside; elements that a cut has torn open (an edge longer than kTorn times its rest) are left out. Nets
/// have nothing inside: where their skin is closed, walls, inner walls and lumina come out by the even-odd
/// rule, and the field is that of the walls, blended across. Rigid objects have borders only.
/// @param wanted by index of the object; empty: all
/// @param field  null: values are NaN
Slice slice(const mesh::Store& store, const Plane& plane, const std::function<bool(std::size_t)>& wanted,
            const SliceField* field);

constexpr float kTorn = 3.0f;           ///< no unit (tuned)
constexpr float kSliceRow = 0.0004f;    ///< m: height of the rows that fill the section of a net (tuned)
constexpr std::size_t kMostRows = 400;  ///< of one object (assumed)

}  // namespace vest::inspect
