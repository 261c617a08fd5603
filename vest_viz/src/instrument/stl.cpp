#include "vest_viz/instrument/stl.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/Geometry>

#include "vest_instruments/files/read.h"
#include "vest_tissue/volume/mesh_file.h"

namespace vest::instrument {
namespace {

constexpr std::size_t kMostAtCorner = 1024;  // assumed: each is compared with each

}  // namespace

TriangleMesh readStl(const std::string& path, double crease) {
  volume::Surface surface;
  try {
    surface = volume::readSurface(path, files::read(path, 16 << 20));
  } catch (const files::Refused& e) {
    throw std::runtime_error(path + ": " + e.what());
  } catch (const std::invalid_argument& e) {
    throw std::runtime_error(e.what());
  }
  struct Corner {
    std::uint32_t triangle, corner;
  };
  const std::size_t count = surface.triangles.size();
  std::vector<std::vector<Corner>> corners(surface.vertices.size());
  std::vector<Eigen::Vector3f> area_normal(count), normal(count);
  for (std::uint32_t t = 0; t < count; ++t) {
    const auto& v = surface.triangles[t];
    for (std::uint32_t c = 0; c < 3; ++c) corners[v[c]].push_back({t, c});
    const Eigen::Vector3d edge[2] = {surface.vertices[v[1]] - surface.vertices[v[0]],
                                     surface.vertices[v[2]] - surface.vertices[v[0]]};
    area_normal[t] = edge[0].cross(edge[1]).cast<float>();
    normal[t] = area_normal[t].normalized();
  }
  for (const auto& users : corners)
    if (users.size() > kMostAtCorner)
      throw std::runtime_error(path + ": " + std::to_string(users.size()) +
                               " triangles meet at a corner; allowed: at most " +
                               std::to_string(kMostAtCorner));
  TriangleMesh mesh;
  mesh.triangles.resize(3 * count);
  const float limit = static_cast<float>(std::cos(crease));
  for (std::size_t v = 0; v < corners.size(); ++v) {
    const auto& users = corners[v];
    const Eigen::Vector3f place = surface.vertices[v].cast<float>();
    std::vector<std::pair<Eigen::Vector3f, std::uint32_t>> made;  // normals at this place
    for (const Corner& user : users) {
      const Eigen::Vector3f& own = normal[user.triangle];
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (const Corner& other : users)
        if (own.dot(normal[other.triangle]) >= limit) sum += area_normal[other.triangle];
      const Eigen::Vector3f n =
          sum.squaredNorm() > 0 ? Eigen::Vector3f(sum.normalized()) : Eigen::Vector3f(0, 0, 1);
      std::uint32_t index = 0;
      bool found = false;
      for (const auto& [known, vertex] : made)
        if (known.dot(n) > 0.9999f) index = vertex, found = true;
      if (!found) {
        index = static_cast<std::uint32_t>(mesh.positions.size() / 3);
        mesh.positions.insert(mesh.positions.end(), place.data(), place.data() + 3);
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
