#pragma once

#include <cstdint>
#include <vector>

#include "vest_tissue/scene/world.h"

namespace vest::simulation {

/// Which knots of deforming objects hang on something that brings them blood: on fixed knots, or by links,
/// surface, elements and connections on what does. Of an object that nothing held from the start its largest
/// part counts as held. Shut clips and tied slings let no blood through what lies in them.
class SupplyMap {
 public:
  /// @param first per object: its first number; one more at the end
  SupplyMap(const scene::World& world, const std::vector<std::uint32_t>& first);

  /// Looks again if tissue was cut, clipped or tied since, and now and then while a fastener holds. Allocates
  /// nothing.
  void follow(const scene::World& world);
  /// As for the scene that was loaded.
  void reset();
  /// Per number: 1 fed, 0 cut off.
  const std::vector<std::uint8_t>& fed() const { return state.fed; }

  struct State {
    std::vector<std::uint8_t> fed;
    std::uint64_t seen = 0;  ///< what tissue and fasteners were like
  };
  State state;  ///< to save and restore whole

 private:
  struct Barrier {
    std::uint16_t object = 0;
    Eigen::Vector3d centre, normal;  ///< m; unit
    double reach = 0;                ///< m around the centre
  };
  void findBarriers(const scene::World& world);
  std::uint64_t look(const scene::World& world) const;
  std::uint32_t root(std::uint32_t i);
  void join(std::uint32_t a, std::uint32_t b);
  /// Two knots of an object hang together, unless a barrier lies between them.
  void hang(const scene::World& world, std::size_t object, std::uint32_t a, std::uint32_t b);
  void find(const scene::World& world);

  const std::vector<std::uint32_t> first_;
  std::vector<std::uint8_t> floats_;  ///< per object: nothing held it from the start
  // No meaning between calls.
  std::vector<std::uint32_t> part_, size_;  ///< union-find over 1 + all knots; 0: what brings blood
  std::vector<Barrier> barriers_;
};

}  // namespace vest::simulation
