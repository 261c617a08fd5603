#pragma once

#include <string>
#include <vector>

#include <visualization_msgs/MarkerArray.h>
#include <Eigen/Geometry>

#include "vest_viz/instrument/stl.h"
#include "vest_viz/mesh/store.h"

namespace vest::displays {

/// Lines of an exercise on tissue (session/targets), as ink on it: each point goes with the knot that it is
/// nearest to in the scene as it was loaded. What is not finite or has no object is left out.
class Targets {
 public:
  void set(const visualization_msgs::MarkerArray& markers);
  /// Where they lie now; m, world.
  instrument::TriangleMesh mesh(const mesh::Store& store);

 private:
  struct Point {
    std::size_t knot;
    Eigen::Vector3f offset;
  };
  struct Line {
    std::string object;
    std::vector<Eigen::Vector3f> rest;
    std::vector<Point> points;
  };
  void fasten(const mesh::Store& store, Line* line) const;

  std::vector<Line> lines_;
  std::string scene_;  ///< in which they are fastened
};

}  // namespace vest::displays
