#include "vest_viz/instrument/stl.h"

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>

#include <Eigen/Geometry>

namespace vest::instrument {

TriangleMesh readStl(const std::string& path, double crease) {
  std::ifstream in(path, std::ios::binary | std::ios::ate);
  if (!in) throw std::runtime_error(path + ": cannot be read");
  const std::streamoff size = in.tellg();
  if (size < 84) throw std::runtime_error(path + ": shorter than the 84 bytes of a binary STL header");
  if (size > (16 << 20)) throw std::runtime_error(path + ": over 16 MB");
  std::vector<char> bytes(static_cast<std::size_t>(size));
  in.seekg(0);
  in.read(bytes.data(), size);
  std::uint32_t count = 0;
  std::memcpy(&count, &bytes[80], 4);
  if (84 + 50 * static_cast<std::uint64_t>(count) > bytes.size())
    throw std::runtime_error(path + ": says " + std::to_string(count) + " triangles, holds fewer");
  struct Corner {
    std::uint32_t triangle, corner;
  };
  std::map<std::array<float, 3>, std::vector<Corner>> corners;
  std::vector<std::array<Eigen::Vector3f, 3>> points(count);
  std::vector<Eigen::Vector3f> area_normal(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    float v[9];
    std::memcpy(v, &bytes[84 + 50 * static_cast<std::size_t>(t) + 12], sizeof v);
    for (float f : v)
      if (!std::isfinite(f))
        throw std::runtime_error(path + ": triangle " + std::to_string(t) + " is not finite");
    for (std::uint32_t c = 0; c < 3; ++c) {
      points[t][c] = Eigen::Vector3f(v[3 * c], v[3 * c + 1], v[3 * c + 2]);
      corners[{v[3 * c], v[3 * c + 1], v[3 * c + 2]}].push_back({t, c});
    }
    area_normal[t] = (points[t][1] - points[t][0]).cross(points[t][2] - points[t][0]);
  }
  TriangleMesh mesh;
  mesh.triangles.resize(3 * static_cast<std::size_t>(count));
  const float limit = static_cast<float>(std::cos(crease));
  for (const auto& [place, users] : corners) {
    std::vector<std::pair<Eigen::Vector3f, std::uint32_t>> made;  // normals at this place
    for (const Corner& user : users) {
      const Eigen::Vector3f own = area_normal[user.triangle].normalized();
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (const Corner& other : users)
        if (own.dot(area_normal[other.triangle].normalized()) >= limit) sum += area_normal[other.triangle];
      const Eigen::Vector3f n =
          sum.squaredNorm() > 0 ? Eigen::Vector3f(sum.normalized()) : Eigen::Vector3f(0, 0, 1);
      std::uint32_t index = 0;
      bool found = false;
      for (const auto& [normal, vertex] : made)
        if (normal.dot(n) > 0.9999f) index = vertex, found = true;
      if (!found) {
        index = static_cast<std::uint32_t>(mesh.positions.size() / 3);
        mesh.positions.insert(mesh.positions.end(), place.begin(), place.end());
        mesh.normals.insert(mesh.normals.end(), {n.x(), n.y(), n.z()});
        made.emplace_back(n, index);
      }
      mesh.triangles[3 * static_cast<std::size_t>(user.triangle) + user.corner] = index;
    }
  }
  return mesh;
}

TriangleMesh capsule(double radius, double z0, double z1) {
  constexpr int kAround = 20, kCap = 4;
  constexpr double kPi = 3.14159265358979323846;
  TriangleMesh mesh;
  for (int ring = 0; ring < 2 * (kCap + 1); ++ring) {
    const bool far_end = ring > kCap;
    const double latitude =
        far_end ? 0.5 * kPi * (ring - kCap - 1) / kCap : -0.5 * kPi * (kCap - ring) / kCap;
    for (int i = 0; i < kAround; ++i) {
      const double a = 2 * kPi * i / kAround;
      const double n[3] = {std::cos(latitude) * std::cos(a), std::cos(latitude) * std::sin(a),
                           std::sin(latitude)};
      for (int k = 0; k < 3; ++k) {
        mesh.positions.push_back(static_cast<float>(radius * n[k] + (k == 2 ? (far_end ? z1 : z0) : 0)));
        mesh.normals.push_back(static_cast<float>(n[k]));
      }
      if (ring == 0) continue;
      const std::uint32_t a0 = static_cast<std::uint32_t>((ring - 1) * kAround + i), b0 = a0 + kAround;
      const std::uint32_t next = i + 1 == kAround ? 1 - kAround : 1;
      for (std::uint32_t index : {a0, a0 + next, b0 + next, a0, b0 + next, b0})
        mesh.triangles.push_back(index);
    }
  }
  return mesh;
}

}  // namespace vest::instrument
