#include <cmath>
#include <unordered_map>

#include "vest_tissue/volume/lattice.h"

namespace vest::volume {

Surface surfaceOf(const LabelledImage& image, double cell) {
  using Eigen::Vector3d;
  // Samples one cell beyond the image on every side: the surface closes.
  Vector3d low;
  std::array<int, 3> size{};
  for (int a = 0; a < 3; ++a) {
    const double extent = image.spacing[a] * image.size[static_cast<std::size_t>(a)];
    size[static_cast<std::size_t>(a)] = static_cast<int>(std::ceil(extent / cell)) + 3;
    low[a] = 0.5 * (extent - image.spacing[a]) - 0.5 * cell * (size[static_cast<std::size_t>(a)] - 1);
  }
  const auto index = [&](int i, int j, int k) {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(i);
  };
  std::vector<float> field(index(size[0] - 1, size[1] - 1, size[2] - 1) + 1, 0.0f);
  for (int k = 0; k < size[2]; ++k) {
    for (int j = 0; j < size[1]; ++j) {
      for (int i = 0; i < size[0]; ++i) {
        int in = 0;  // share of 27 samples around: smooths the steps of voxels
        for (int s = 0; s < 27; ++s) {
          const Vector3d at(i + (s % 3 - 1) / 2.0, j + (s / 3 % 3 - 1) / 2.0, k + (s / 9 - 1) / 2.0);
          in += image.nearest(low + cell * at) != 0;
        }
        field[index(i, j, k)] = static_cast<float>(in) / 27.0f - 0.5f;
      }
    }
  }
  Surface surface;
  std::unordered_map<std::size_t, Index> vertex;  // by cube
  const auto vertexOf = [&](int i, int j, int k) {
    const auto found = vertex.find(index(i, j, k));
    if (found != vertex.end()) return found->second;
    // Mean of the places where the cube's edges cross the surface.
    Vector3d sum = Vector3d::Zero();
    int count = 0;
    for (int c = 0; c < 8; ++c) {
      for (int a = 0; a < 3; ++a) {
        if (c >> a & 1) continue;
        const int d = c | 1 << a;
        const float f = field[index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1))],
                    g = field[index(i + (d & 1), j + (d >> 1 & 1), k + (d >> 2 & 1))];
        if ((f > 0.0f) == (g > 0.0f)) continue;
        Vector3d at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1));
        at[a] += f / (f - g);
        sum += at;
        ++count;
      }
    }
    const Index n = static_cast<Index>(surface.vertices.size());
    surface.vertices.push_back(image.origin + image.direction * (low + cell * (sum / count)));
    vertex.emplace(index(i, j, k), n);
    return n;
  };
  for (int k = 1; k + 1 < size[2]; ++k) {
    for (int j = 1; j + 1 < size[1]; ++j) {
      for (int i = 1; i + 1 < size[0]; ++i) {
        for (int a = 0; a < 3; ++a) {
          std::array<int, 3> p{i, j, k}, q = p;
          ++q[static_cast<std::size_t>(a)];
          const bool f = field[index(p[0], p[1], p[2])] > 0.0f, g = field[index(q[0], q[1], q[2])] > 0.0f;
          if (f == g) continue;
          // The four cubes around the edge, counter-clockwise about axis a.
          const std::size_t b = static_cast<std::size_t>((a + 1) % 3),
                            c = static_cast<std::size_t>((a + 2) % 3);
          std::array<Index, 4> ring{};
          constexpr int kTurn[4][2] = {{-1, -1}, {0, -1}, {0, 0}, {-1, 0}};
          for (std::size_t n = 0; n < 4; ++n) {
            std::array<int, 3> cube = p;
            cube[b] += kTurn[n][0];
            cube[c] += kTurn[n][1];
            ring[n] = vertexOf(cube[0], cube[1], cube[2]);
          }
          if (!f) std::swap(ring[1], ring[3]);
          surface.triangles.push_back({ring[0], ring[1], ring[2]});
          surface.triangles.push_back({ring[0], ring[2], ring[3]});
        }
      }
    }
  }
  if (image.direction.determinant() < 0.0)
    for (auto& t : surface.triangles) std::swap(t[1], t[2]);
  return surface;
}

}  // namespace vest::volume
