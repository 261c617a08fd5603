#pragma once

#include <array>
#include <random>
#include <string>

#include "vest_tissue/fem/description.h"

namespace vest::fem::specimen {

struct Box {
  int nx = 4, ny = 2, nz = 2;           ///< cells
  double lx = 1.0, ly = 0.5, lz = 0.5;  ///< m
  Index node(int i, int j, int k) const { return static_cast<Index>((i * (ny + 1) + j) * (nz + 1) + k); }
};

/// A box of cells of six tetrahedra each (Kuhn's subdivision: conforming), from the origin along x, y, z.
/// The end x = 0 is fixed if asked for.
inline Description makeBox(const Box& b, bool clamp = true) {
  Description d;
  d.name = "beam";
  d.material = {1000.0, 0.3, 1.0, 0.0, 0.0};
  for (int i = 0; i <= b.nx; ++i)
    for (int j = 0; j <= b.ny; ++j)
      for (int k = 0; k <= b.nz; ++k) {
        d.nodes.emplace_back(b.lx * i / b.nx, b.ly * j / b.ny, b.lz * k / b.nz);
        if (clamp && i == 0) d.fixed.push_back(b.node(i, j, k));
      }
  const std::array<std::array<int, 3>, 6> orders{
      {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};
  for (int i = 0; i < b.nx; ++i)
    for (int j = 0; j < b.ny; ++j)
      for (int k = 0; k < b.nz; ++k)
        for (std::size_t o = 0; o < orders.size(); ++o) {
          std::array<int, 3> c{i, j, k};
          std::array<Index, 4> t{};
          t[0] = b.node(c[0], c[1], c[2]);
          for (std::size_t s = 0; s < 3; ++s) {
            ++c[static_cast<std::size_t>(orders[o][s])];
            t[s + 1] = b.node(c[0], c[1], c[2]);
          }
          if (o >= 3) std::swap(t[2], t[3]);  // odd permutations turn the other way
          d.tetrahedra.push_back(t);
        }
  return d;
}

/// The same box of cells of five tetrahedra, mirrored from cell to cell: bends without the bias of six.
inline Description makeFiveBox(const Box& b) {
  Description d = makeBox(b);
  d.tetrahedra.clear();
  constexpr int kEven[5][4] = {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 6, 3}, {4, 0, 5, 6}, {7, 3, 6, 5}};
  constexpr int kOdd[5][4] = {{1, 2, 4, 7}, {0, 1, 2, 4}, {3, 1, 7, 2}, {5, 1, 4, 7}, {6, 2, 7, 4}};
  for (int i = 0; i < b.nx; ++i)
    for (int j = 0; j < b.ny; ++j)
      for (int k = 0; k < b.nz; ++k)
        for (const auto& c : (i + j + k) % 2 == 0 ? kEven : kOdd) {
          std::array<Index, 4> t{};
          for (std::size_t n = 0; n < 4; ++n)
            t[n] = b.node(i + (c[n] & 1), j + (c[n] >> 1 & 1), k + (c[n] >> 2 & 1));
          const auto& x = d.nodes;
          const Eigen::Vector3d p = x[t[1]] - x[t[0]], q = x[t[2]] - x[t[0]], r = x[t[3]] - x[t[0]];
          if (p.x() * (q.y() * r.z() - q.z() * r.y()) + p.y() * (q.z() * r.x() - q.x() * r.z()) +
                  p.z() * (q.x() * r.y() - q.y() * r.x()) <
              0.0)
            std::swap(t[2], t[3]);
          d.tetrahedra.push_back(t);
        }
  return d;
}

/// Spreads a force evenly over the nodes of the end x = lx, by their share of the end's area.
inline void loadEnd(Description& d, const Box& b, const Eigen::Vector3d& force) {
  for (int j = 0; j <= b.ny; ++j)
    for (int k = 0; k <= b.nz; ++k) {
      const double share =
          (j == 0 || j == b.ny ? 0.5 : 1.0) * (k == 0 || k == b.nz ? 0.5 : 1.0) / (b.ny * b.nz);
      d.loads.push_back({b.node(b.nx, j, k), share * force});
    }
}

/// Mean displacement of the end x = lx.
inline Eigen::Vector3d endDisplacement(const Description& d, const Box& b,
                                       const std::vector<Eigen::Vector3d>& x) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int j = 0; j <= b.ny; ++j)
    for (int k = 0; k <= b.nz; ++k) sum += x[b.node(b.nx, j, k)] - d.nodes[b.node(b.nx, j, k)];
  return sum / ((b.ny + 1) * (b.nz + 1));
}

/// Moves inner nodes off the regular grid, so that nothing holds by symmetry alone.
inline void shake(Description& d, double amount, unsigned seed = 1) {
  std::mt19937 random(seed);
  for (auto& x : d.nodes)
    for (int k = 0; k < 3; ++k) x[k] += amount * (static_cast<double>(random()) / 4294967296.0 - 0.5);
}

}  // namespace vest::fem::specimen
