#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vest_tissue/modelling/source.h"

/// Where a hand takes hold of what ties two organs (docs/modelling.md).
namespace vest::modelling {

/// N/m a knot, of a tie that no person has weighed yet (assumed: between those of the gynaecology scene).
inline constexpr double kTie = 10.0;

/// An object of the scene as it is built.
struct Laid {
  std::string name;
  bool rigid = false;
  std::vector<Vector3> knots;                          ///< m, world
  std::vector<std::vector<std::uint32_t>> rings = {};  ///< knots of each ring; none: it cannot be tied
  std::vector<std::uint8_t> fixed = {};                ///< a knot; what is fixed is not tied
};

/// A tie as a line with two ends: on the object's own rings, and on the other organ.
struct Tie {
  std::string path;                                        ///< of the rule, below the object: /connect/0
  ConnectRule rule;                                        ///< rings counted from the beginning
  Vector3 own = Vector3::Zero(), other = Vector3::Zero();  ///< m, world
};

/// Of an object's rules, those whose objects and rings lie in the scene.
std::vector<Tie> tiesOf(const std::vector<ConnectRule>& rules, const Laid& own,
                        const std::vector<Laid>& scene);

/// The rule with its own end dropped at `place`: on as many rings there. `within` grows where it must.
ConnectRule ownEndAt(const Tie& tie, const Vector3& place, const Laid& own, const std::vector<Laid>& scene);

/// The rule with its other end dropped at `place`: on the organ that lies nearest. Rigid objects are no
/// organs.
ConnectRule otherEndAt(const Tie& tie, const Vector3& place, const Laid& own, const std::vector<Laid>& scene);

/// A rule that ties the free ring nearest to `place` to the organ nearest to that ring. None: there is no
/// other organ, or the object has no free ring.
std::optional<ConnectRule> tieFrom(const Vector3& place, const Laid& own, const std::vector<Laid>& scene);

/// The rule in one line of YAML.
std::string textOf(const ConnectRule& rule);

}  // namespace vest::modelling
