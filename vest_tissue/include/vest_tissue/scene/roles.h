#pragma once

#include <algorithm>
#include <string_view>
#include <vector>

#include "vest_tissue/scene/description.h"

/// Role tags (target, forbidden, …) and vessel segments of a scene, for exercises, scores and effects.
namespace vest::scene {

inline bool hasRole(const Object& object, std::string_view role) {
  return std::find(object.roles.begin(), object.roles.end(), role) != object.roles.end();
}

/// Objects with a role, in scene order.
inline std::vector<std::size_t> objectsWithRole(const Description& description, std::string_view role) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < description.objects.size(); ++i) {
    if (hasRole(description.objects[i], role)) found.push_back(i);
  }
  return found;
}

/// Objects whose wall is that of a segment of the vessel network, in scene order; none for the empty name.
inline std::vector<std::size_t> objectsOfSegment(const Description& description, std::string_view segment) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < description.objects.size(); ++i) {
    if (!segment.empty() && description.objects[i].tube.vessel_segment == segment) found.push_back(i);
  }
  return found;
}

}  // namespace vest::scene
