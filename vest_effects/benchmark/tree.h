#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "vest_effects/haemodynamics/step.h"

namespace vest::haemodynamics::bench {

/// Six generations, 63 segments, radii by Murray's law, about 12 cm each at first and shorter towards the
/// ends.
inline Network tree() {
  Network n;
  n.viscosity = 0.004;
  const int generations = 6;
  double radius = 0.012, length = 0.16;
  long next = 2;
  std::vector<long> ends{1};
  for (int g = 0; g < generations; ++g) {
    std::vector<long> fresh;
    for (long from : ends) {
      for (int branch = 0; branch < (g == 0 ? 1 : 2); ++branch) {
        SegmentSpec s;
        s.id = std::to_string(n.segments.size() + 1);
        s.name = "segment_" + s.id;
        s.node_in = from;
        s.node_out = next++;
        s.length = length * (1 + 0.1 * branch);
        s.radius_proximal = radius;
        s.radius_distal = 0.9 * radius;
        s.wall_proximal = 0.1 * s.radius_proximal;
        s.wall_distal = 0.1 * s.radius_distal;
        s.youngs_modulus = 4e5;
        s.reference_pressure = 10000;
        if (g == generations - 1) {
          s.terminal = true;
          s.load = {1e9, 3e9, 3e-11, 0};
        }
        fresh.push_back(s.node_out);
        n.segments.push_back(s);
      }
    }
    ends = fresh;
    radius *= 0.9 * std::pow(0.5, 1.0 / 3);
    length *= 0.9;
  }
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.01 * i;
    n.inflow.push_back({t, t < 0.35 ? 4e-4 * std::pow(std::sin(3.14159265358979 * t / 0.35), 2) : 0, i + 2});
  }
  return n;
}

/// The tree in cells of such a length that there are about 2,200 of them.
inline Model tree2200() {
  const Network network = tree();
  double total = 0;
  for (const auto& s : network.segments) total += s.length;
  return buildModel(network, total / (2200 - 0.5 * static_cast<double>(network.segments.size())));
}

}  // namespace vest::haemodynamics::bench
