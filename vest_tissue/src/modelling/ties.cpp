#include "vest_tissue/modelling/ties.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>

namespace vest::modelling {
namespace {

Vector3 centreOf(const Laid& object, std::size_t ring) {
  Vector3 sum = Vector3::Zero();
  for (const std::uint32_t knot : object.rings[ring]) sum += object.knots[knot];
  return sum / static_cast<double>(std::max<std::size_t>(object.rings[ring].size(), 1));
}

bool isFree(const Laid& object, std::uint32_t knot) {
  return object.fixed.empty() || object.fixed[knot] == 0;
}

/// Of those that have a free knot.
std::optional<std::size_t> nearestRing(const Laid& object, const Vector3& place) {
  std::optional<std::size_t> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t r = 0; r < object.rings.size(); ++r) {
    const double distance = (centreOf(object, r) - place).norm();
    if (distance < least && std::any_of(object.rings[r].begin(), object.rings[r].end(),
                                        [&](std::uint32_t knot) { return isFree(object, knot); }))
      least = distance, best = r;
  }
  return best;
}

const Vector3& nearestKnot(const Laid& object, const Vector3& place) {
  return *std::min_element(object.knots.begin(), object.knots.end(), [&](const Vector3& a, const Vector3& b) {
    return (a - place).squaredNorm() < (b - place).squaredNorm();
  });
}

const Laid* nearestOrgan(const Vector3& place, const std::string& own, const std::vector<Laid>& scene) {
  const Laid* best = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const Laid& object : scene) {
    if (object.name == own || object.rigid || object.knots.empty()) continue;
    const double distance = (nearestKnot(object, place) - place).norm();
    if (distance < least) least = distance, best = &object;
  }
  return best;
}

/// The rule's `within` as large as each of its rings needs: a knot is no farther from the organ's surface
/// than from the organ's nearest knot. Up to the next 0.1 mm.
void reach(ConnectRule& rule, const Laid& own, const Laid& organ) {
  double farthest = 0;
  for (int r = rule.rings.first; r <= rule.rings.last; r += rule.rings.step) {
    double least = std::numeric_limits<double>::infinity();
    for (const std::uint32_t knot : own.rings[static_cast<std::size_t>(r)])
      if (isFree(own, knot))
        least = std::min(least, (nearestKnot(organ, own.knots[knot]) - own.knots[knot]).norm());
    if (std::isfinite(least)) farthest = std::max(farthest, least);
  }
  rule.within = std::max(rule.within, std::ceil(farthest * 1e4 + 0.1) * 1e-4);
}

const Laid* named(const std::string& name, const std::vector<Laid>& scene) {
  const auto found = std::find_if(scene.begin(), scene.end(), [&](const Laid& o) { return o.name == name; });
  return found == scene.end() || found->knots.empty() ? nullptr : &*found;
}

}  // namespace

std::vector<Tie> tiesOf(const std::vector<ConnectRule>& rules, const Laid& own,
                        const std::vector<Laid>& scene) {
  std::vector<Tie> ties;
  const int count = static_cast<int>(own.rings.size());
  for (std::size_t i = 0; i < rules.size(); ++i) {
    Tie tie{"/connect/" + std::to_string(i), rules[i]};
    Rings& rings = tie.rule.rings;
    if (rings.first < 0) rings.first += count;
    if (rings.last < 0) rings.last += count;
    const Laid* const other = named(tie.rule.to, scene);
    if (other == nullptr || rings.first < 0 || rings.last >= count || rings.first > rings.last) continue;
    tie.own = centreOf(own, static_cast<std::size_t>((rings.first + rings.last) / 2));
    tie.other = nearestKnot(*other, tie.own);
    ties.push_back(tie);
  }
  return ties;
}

ConnectRule ownEndAt(const Tie& tie, const Vector3& place, const Laid& own, const std::vector<Laid>& scene) {
  ConnectRule rule = tie.rule;
  const int span = rule.rings.last - rule.rings.first, most = static_cast<int>(own.rings.size()) - 1 - span;
  rule.rings.first = std::clamp(static_cast<int>(nearestRing(own, place).value_or(0)) - span / 2, 0, most);
  rule.rings.last = rule.rings.first + span;
  if (const Laid* const organ = named(rule.to, scene)) reach(rule, own, *organ);
  return rule;
}

ConnectRule otherEndAt(const Tie& tie, const Vector3& place, const Laid& own,
                       const std::vector<Laid>& scene) {
  ConnectRule rule = tie.rule;
  if (const Laid* const organ = nearestOrgan(place, own.name, scene)) {
    rule.to = organ->name;
    reach(rule, own, *organ);
  }
  return rule;
}

std::optional<ConnectRule> tieFrom(const Vector3& place, const Laid& own, const std::vector<Laid>& scene) {
  const std::optional<std::size_t> ring = nearestRing(own, place);
  const Laid* const organ = ring ? nearestOrgan(centreOf(own, *ring), own.name, scene) : nullptr;
  if (organ == nullptr) return std::nullopt;
  ConnectRule rule;
  rule.to = organ->name;
  rule.rings.first = rule.rings.last = static_cast<int>(*ring);
  rule.stiffness = kTie;
  reach(rule, own, *organ);
  return rule;
}

std::string textOf(const ConnectRule& rule) {
  char text[256];
  const std::string step = rule.rings.step == 1 ? "" : ", " + std::to_string(rule.rings.step);
  std::snprintf(text, sizeof text, "{to: %s, rings: [%d, %d%s], per_ring: %u, within: %.4g, stiffness: %.4g}",
                rule.to.c_str(), rule.rings.first, rule.rings.last, step.c_str(), rule.per_ring, rule.within,
                rule.stiffness);
  return text;
}

}  // namespace vest::modelling
