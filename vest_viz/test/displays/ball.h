#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include <vest_msgs/TissueObject.h>

namespace vest::displays {

/// A ball: one of 2 cm radius, 8 cm before the camera, inside one of 15 cm round everything.
inline vest_msgs::TissueObject ball(const std::string& name, const std::string& organ, double radius,
                                    double z, bool inward) {
  vest_msgs::TissueObject o;
  o.name = name;
  o.organ = organ;
  const std::uint32_t rows = 24, columns = 36;
  for (std::uint32_t i = 0; i <= rows; ++i)
    for (std::uint32_t j = 0; j <= columns; ++j) {
      const double a = M_PI * i / rows, b = 2 * M_PI * j / columns;
      o.rest_position.push_back(static_cast<float>(radius * std::sin(a) * std::cos(b)));
      o.rest_position.push_back(static_cast<float>(radius * std::sin(a) * std::sin(b)));
      o.rest_position.push_back(static_cast<float>(z + radius * std::cos(a)));
      o.texture_coordinates.push_back(static_cast<float>(radius * a));
      o.texture_coordinates.push_back(static_cast<float>(radius * b));
      o.binding_knots.push_back(o.knot_count);
      o.binding_weights.push_back(1);
      o.binding_start.push_back(o.knot_count++);
      if (i == rows || j == columns) continue;
      const std::uint32_t k = i * (columns + 1) + j, down = k + columns + 1;
      const std::uint32_t t[] = {k, down, down + 1, k, down + 1, k + 1};
      for (int n = 0; n < 6; ++n) o.triangles.push_back(t[inward ? 5 - n : n]);
    }
  o.binding_start.push_back(o.knot_count);
  o.link_knots = {0, 1, 1, 2};
  o.link_kind = {0, 0};
  o.link_alive = {1, 1};
  return o;
}

}  // namespace vest::displays
