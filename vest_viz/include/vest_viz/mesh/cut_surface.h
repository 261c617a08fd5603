#pragma once

#include <cstdint>
#include <vector>

namespace vest::mesh {

struct Object;

/// How the wall of a cut is drawn. Elements part along their faces, so that the simulated wall is as rough as
/// their mesh (docs/decisions/0019); tissue tears finer. Vertices of cut faces are drawn at the mean of their
/// neighbours, those of the rim at the mean along the rim; both sides of a cut are drawn alike, so that a
/// closed cut is closed. Pieces of a few triangles that came loose are not drawn. The simulation has no part
/// in it.
class CutSurface {
 public:
  static constexpr int kPasses = 4;         ///< of Laplacian smoothing, half of the way each
  static constexpr float kMost = 0.6f;      ///< of the mean length of a vertex' edges: it moves no farther
  static constexpr std::size_t kLeast = 9;  ///< triangles of a piece that is drawn: two elements have eight

  /// @param object  its layers may be empty: nothing is cut
  void build(const Object& object);
  /// Moves the vertices of cut faces. @param positions m, x y z per vertex
  void smooth(float* positions) const;
  /// Triangles of pieces that are too small to be drawn.
  const std::vector<std::uint32_t>& dropped() const { return dropped_; }
  bool empty() const { return moved_.empty() && dropped_.empty(); }

 private:
  void findPieces(const Object& object);

  std::vector<std::uint32_t> moved_;               ///< vertices that are smoothed
  std::vector<std::uint32_t> start_, neighbours_;  ///< of each of them
  std::vector<std::uint32_t> dropped_;
  mutable std::vector<float> place_, next_, reach_;  ///< of smooth()
};

}  // namespace vest::mesh
