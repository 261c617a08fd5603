#pragma once

#include <cstddef>

#include "vest_tissue/net/link_kernel.h"

namespace vest::scene::kernel {

constexpr double kLeastFace = 1e-12;  ///< m²: less than a micrometre each way (tuned)
/// A face that crumples would carry its lever with the forces of a crowbar: a connection gets softer where
/// its ends have become this much lighter than they were built (tuned).
constexpr double kLighter = 2.0;

/// Four connections at a time, each of a knot with a face (connections.cpp: pullTogether). Arrays are
/// [axis][lane] or [corner][axis][lane]. A knot's place is where it is now; `ahead` leads to the mean place
/// of the sub-steps.
struct ConnectionLanes {
  static constexpr std::size_t kCount = 4;
  // In.
  float x0[3][kCount], v0[3][kCount];         ///< m, m/s: the knot of end 0
  float x1[3][3][kCount], v1[3][3][kCount];   ///< m, m/s: the corners of the face of end 1
  float w0[kCount], w1[3][kCount];            ///< 1/kg
  double ahead0[kCount], ahead1[kCount];      ///< s
  double weight[3][kCount], height[kCount];   ///< net::Anchor of end 1
  double strand[kCount], built[kCount];       ///< ConnectionConstants
  double stiffness[kCount], damping[kCount];  ///< N/m, N·s/m
  // Out.
  double spring[3][kCount], damper[3][kCount];             ///< N, on end 0
  double rate[3][kCount];                                  ///< m/s
  double damper_weight[3][kCount], damper_height[kCount];  ///< of what carries the damper's other end
  double force2[kCount];                                   ///< N²: of both
  float on0[3][kCount], on1[3][3][kCount];                 ///< N, of each knot
};

/// At a level of the processor; the same bits from each.
void pull(ConnectionLanes& lanes, net::KernelLevel level);
void pullBaseline(ConnectionLanes& lanes);
#if defined(VEST_HAVE_AVX2_KERNEL)
void pullAvx2(ConnectionLanes& lanes);
#endif

}  // namespace vest::scene::kernel
