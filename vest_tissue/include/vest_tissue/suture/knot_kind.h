#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

/// Which knot lies in a thread, told by its crossings alone. Nothing in a step's motion depends on it.
namespace vest::suture {

/// Two numbers that stay the same however a knot is moved or drawn (Goeritz's matrix; Gordon and Litherland
/// 1978).
struct KnotKind {
  std::int32_t determinant =
      1;                       ///< 1: none; overhand 3, square and granny 9, surgeon's 15; 0: not to be told
  std::int32_t signature = 0;  ///< of a square knot 0, of a granny 4 or -4
  bool operator==(const KnotKind& k) const {
    return determinant == k.determinant && signature == k.signature;
  }
};

/// Memory of kindOf(), sized once.
class KnotScratch {
 public:
  static constexpr int kMostCrossings = 96;  ///< of a drawn thread; more are not told
  explicit KnotScratch(std::size_t nodes);

 private:
  friend KnotKind kindOf(const Eigen::Vector3d* nodes, std::size_t count, KnotScratch& w);
  struct Crossing {
    bool left = false;        ///< the second strand goes from right to left of the first
    bool first_over = false;  ///< the first strand is above
    int pass[2] = {};         ///< of both strands
    int ray[4] = {};          ///< half-edges that leave it, counterclockwise
  };
  struct Pass {
    double at;
    int crossing, strand;
  };
  bool findCrossings();
  int findFaces();
  bool colourFaces(int faces);
  KnotKind measure(int faces);

  std::vector<Eigen::Vector3d> drawn_;  ///< in the plane of the picture, and towards the eye
  std::vector<Crossing> crossings_;
  std::vector<Pass> passes_;
  std::vector<int> at_;      ///< per half-edge: crossing · 4 + place among its rays
  std::vector<int> face_;    ///< per half-edge
  std::vector<int> colour_;  ///< per face; then its number among those of its colour
  std::vector<double> matrix_;
};

/// @param nodes m, of a thread from end to end. Its ends count as drawn out straight from its middle, to far
/// away, and joined there. No allocation, no exception.
KnotKind kindOf(const Eigen::Vector3d* nodes, std::size_t count, KnotScratch& w);

/// Where both ends of a thread go into its knot: as much may be taken from one of them before it opens. That
/// is within its first and its last throw.
struct KnotPlace {
  KnotKind kind;
  std::size_t first = 0, last = 0;  ///< nodes; without a knot the thread's ends
};
/// @param nodes as of kindOf(). No allocation, no exception.
KnotPlace placeOfKnot(const Eigen::Vector3d* nodes, std::size_t count, KnotScratch& w);

}  // namespace vest::suture
