#pragma once

#include <cstdint>
#include <vector>

namespace vest::mesh {

/// How the wall of a cut is drawn. Elements part along their faces, so that the simulated wall is as rough as
/// their mesh (docs/decisions/0029); tissue tears finer. Vertices of cut faces are drawn at the mean of their
/// neighbours, those of the rim at the mean along the rim; both sides of a cut are drawn alike, so that a
/// closed cut is closed. Pieces of a few triangles that came loose are not drawn. The simulation has no part
/// in it.
class CutSurface {
 public:
  static constexpr int kPasses = 4;         ///< of Laplacian smoothing, half of the way each
  static constexpr float kMost = 0.6f;      ///< of the mean length of a vertex' edges: it moves no farther
  static constexpr std::size_t kLeast = 9;  ///< triangles of a piece that is drawn: two elements have eight

  /// @param triangles  three vertices each; dead ones have no area
  /// @param layer      of each; kCutFace: wall of a cut. Empty: nothing is cut
  /// @param vertices   number of them
  void build(const std::vector<std::uint32_t>& triangles, const std::vector<std::uint16_t>& layer,
             std::size_t vertices);
  /// Moves the vertices of cut faces. @param positions m, x y z per vertex
  void smooth(float* positions) const;
  /// Triangles of pieces that are too small to be drawn.
  const std::vector<std::uint32_t>& dropped() const { return dropped_; }
  bool empty() const { return moved_.empty() && dropped_.empty(); }

 private:
  void findPieces(const std::vector<std::uint32_t>& triangles, std::size_t vertices);

  std::vector<std::uint32_t> moved_;               ///< vertices that are smoothed
  std::vector<std::uint32_t> start_, neighbours_;  ///< of each of them
  std::vector<std::uint32_t> dropped_;
  mutable std::vector<float> place_, next_, reach_;  ///< of smooth()
};

}  // namespace vest::mesh
