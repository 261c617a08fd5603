#include "vest_viz/instrument/jaws.h"

#include <algorithm>
#include <cmath>

namespace vest::instrument {
namespace {

constexpr float kHalfWidth = 0.0020f;  // m: of the jaws (make_meshes.cpp), all within 0.2 mm
constexpr float kFade = 0.0030f;       // m: tissue bends round their edges (tuned)
constexpr float kReach = 0.0080f;      // m from the middle: thicker things do not fit between them (tuned)
constexpr float kBite = 0.0001f;       // m: teeth sink in

/// 1 inside of low … high, 0 beyond kFade around it.
float share(float value, float low, float high) {
  const float out = std::max(std::max(low - value, value - high), 0.0f);
  const float t = std::clamp(1.0f - out / kFade, 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

}  // namespace

bool pressBetween(const Jaws& jaws, std::vector<float>* positions) {
  const Eigen::Matrix3f R = jaws.X_WTip.linear().transpose().cast<float>();
  const Eigen::Vector3f tip = jaws.X_WTip.translation().cast<float>();
  const auto length = static_cast<float>(jaws.length);
  const auto slope = static_cast<float>(std::tan(0.5 * std::clamp(jaws.opening, 0.0, 1.5)));
  const float far = length + kFade + kReach;
  bool moved = false;
  for (std::size_t k = 0; k + 2 < positions->size(); k += 3) {
    Eigen::Map<Eigen::Vector3f> p(positions->data() + k);
    const Eigen::Vector3f d = p - tip;
    if (!(d.squaredNorm() < far * far)) continue;
    const Eigen::Vector3f q = R * d;
    if (std::fabs(q.x()) > kReach) continue;
    const float along = q.z() + length;
    const float room = std::max(slope * std::clamp(along, 0.0f, length) + kBite, 0.0f);
    const float over = std::fabs(q.x()) - room;
    if (over <= 0) continue;
    const float w = share(q.y(), -kHalfWidth, kHalfWidth) * share(along, 0.0f, length);
    if (w <= 0) continue;
    p -= R.row(0).transpose() * std::copysign(w * over, q.x());
    moved = true;
  }
  return moved;
}

}  // namespace vest::instrument
