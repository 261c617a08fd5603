#include "vest_tissue/scene/fill_record.h"

#include <algorithm>

namespace vest::shared {

void fillRecord(const scene::ContactModel& model, const scene::ToolInput& input,
                ContactRecord& record) noexcept {
  record = ContactRecord{};
  record.flags = (input.present ? kFlagPresent : 0) |
                 (model.in_contact && !model.image_alone ? kFlagContact : 0) |
                 (model.grasping ? kFlagGrasping : 0);
  const Eigen::Quaterniond q(model.proxy.linear());
  for (int e = 0; e < 3; ++e) {
    record.position[e] = model.proxy.translation()[e];
    record.commanded[e] = input.position[e];
    record.pivot[e] = input.pivot[e];
  }
  for (int e = 0; e < 4; ++e) record.orientation[e] = q.coeffs()[e];
  for (int e = 0; e < 6; ++e) {
    record.velocity[e] = model.velocity[e];
    record.wrench[e] = model.wrench[e];
    for (int f = 0; f < 6; ++f) {
      record.stiffness[6 * e + f] = model.stiffness(e, f);
      record.damping[6 * e + f] = model.damping(e, f);
    }
  }
  for (int e = 0; e < 3; ++e) record.wrench[e] -= model.image[e];
  record.feels = input.present ? static_cast<std::uint64_t>(scene::feelsAs(input.tool)) : 0;
  record.reach = scene::reachOf(input.tool);
  record.plane_count = static_cast<std::uint64_t>(std::clamp(model.plane_count, 0, kContactPlanes));
  for (std::uint64_t p = 0; p < record.plane_count; ++p) {
    for (int e = 0; e < 3; ++e) record.planes[p][e] = model.planes[p].normal[e];
    record.planes[p][3] = model.planes[p].offset;
  }
  record.radius = model.radius;
  record.pinch_force = model.pinch_force;
  record.jaw_torque = model.jaw_torque;
}

}  // namespace vest::shared
