#pragma once

#include <string>

#include <vest_msgs/TissueTopology.h>

namespace vest::displays {

/// A square sheet of organ `organ` in the plane z = 0, 6 cm wide round the origin: (cells + 1)² vertices,
/// each with a knot of its own.
inline vest_msgs::TissueTopology sheet(const std::string& organ, int cells = 40) {
  vest_msgs::TissueTopology t;
  t.revision = 1;
  t.header.frame_id = "world";
  t.scene = "sheet";
  vest_msgs::TissueObject o;
  o.name = o.organ = organ;
  o.segmentation_label = 1;
  const auto n = static_cast<std::uint32_t>(cells);
  o.binding_start = {0};
  for (std::uint32_t r = 0; r <= n; ++r)
    for (std::uint32_t c = 0; c <= n; ++c) {
      const float x = 0.06f * (static_cast<float>(c) / n - 0.5f),
                  y = 0.06f * (static_cast<float>(r) / n - 0.5f);
      o.rest_position.insert(o.rest_position.end(), {x, y, 0.0f});
      o.texture_coordinates.insert(o.texture_coordinates.end(), {x, y});
      o.binding_knots.push_back(o.knot_count++);
      o.binding_weights.push_back(1);
      o.binding_start.push_back(o.knot_count);
      if (r == n || c == n) continue;
      const std::uint32_t k = r * (n + 1) + c;
      o.triangles.insert(o.triangles.end(), {k, k + 1, k + n + 2, k, k + n + 2, k + n + 1});
    }
  t.objects = {o};
  return t;
}

}  // namespace vest::displays
