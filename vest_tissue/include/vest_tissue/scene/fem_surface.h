#pragma once

#include <cstdint>
#include <vector>

namespace vest::scene {

/// How the surface of finite elements hangs on their faces, so that cuts can open it. State; element·4 + face
/// are face codes (fem/tissue_cut.h).
struct FemSurface {
  std::vector<std::uint32_t> triangle_face;   ///< per contact triangle: face code
  std::vector<std::uint32_t> skin_face;       ///< per skin triangle: face code; ~0: of an embedded skin
  std::vector<std::uint32_t> knot_vertex;     ///< per knot: skin vertex that hangs on it alone; ~0: none
  std::vector<std::uint32_t> vertex_element;  ///< per skin vertex: element that it is embedded in; ~0: none
  std::uint32_t parts = 1;                    ///< that hold together by closed faces
};

}  // namespace vest::scene
