#pragma once

#include <vector>

#include <Eigen/Core>

/// A ligation loop that is tied beforehand: a thread with a Roeder knot round its own standing part.
namespace vest::suture {

struct RoederLoop {
  double diameter = 0.0;    ///< m, of the thread
  double standing = 0.020;  ///< m of the standing part behind the knot
  double length =
      0.120;  ///< m round the open loop: 38 mm across, about 4 cm in print (laparoscopyhospital.com/v33.htm)
  double tail = 0.005;       ///< m of the short end, beyond what sticks out of the knot; assumed
  double segment = 0.00075;  ///< m, of the loop and the standing part; within the knot 1.5 diameters
};

/// Nodes from the standing part's rear end to the short end's tip. The knot is 1:3:1 (Suhardja et al. 2019,
/// doi:10.1007/s10151-019-01986-z): a hitch round the standing part, three winds round both limbs of the
/// loop, a locking hitch round the standing part, whose end is tucked between it and the winds. Frame: the
/// standing part comes along the z axis; the knot begins at z = 0, the loop lies ahead of it.
std::vector<Eigen::Vector3d> roederLoop(const RoederLoop& loop);

/// Axes of that frame where its z axis points along `ahead` and its x axis about along `across`, of any
/// length but zero and not along each other.
Eigen::Matrix3d loopAxes(const Eigen::Vector3d& ahead, const Eigen::Vector3d& across);

}  // namespace vest::suture
