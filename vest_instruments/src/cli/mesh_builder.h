#pragma once

// Triangles by lofts and sweeps, written as binary STL. For the generator of the shipped meshes only.

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace vest::meshes {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Ring = std::vector<Vector3d>;

class Mesh {
 public:
  /// Closed surface through rings of equal size; `closed_path`: the last ring joins the first, else both ends
  /// are capped. Turned inside out where its volume comes out negative, so that normals always point outward.
  void loft(const std::vector<Ring>& rings, bool closed_path = false) {
    const std::size_t first = triangles_.size(), n = rings.front().size(), m = rings.size();
    for (std::size_t i = 0; i + (closed_path ? 0 : 1) < m; ++i) {
      const Ring &a = rings[i], &b = rings[(i + 1) % m];
      for (std::size_t k = 0; k < n; ++k) {
        const std::size_t l = (k + 1) % n;
        add(a[k], a[l], b[l]);
        add(a[k], b[l], b[k]);
      }
    }
    if (!closed_path) {
      cap(rings.front(), true);
      cap(rings.back(), false);
    }
    double volume = 0.0;
    for (std::size_t i = first; i < triangles_.size(); ++i) {
      volume += triangles_[i][0].dot(triangles_[i][1].cross(triangles_[i][2]));
    }
    if (volume < 0.0) {
      for (std::size_t i = first; i < triangles_.size(); ++i) std::swap(triangles_[i][1], triangles_[i][2]);
    }
  }

  /// Solid of revolution about z through (radius, z) points.
  void revolve(const std::vector<Vector2d>& profile, int segments, bool closed_path = false) {
    std::vector<Ring> rings;
    for (const Vector2d& p : profile) {
      Ring ring;
      for (int k = 0; k < segments; ++k) {
        const double a = 2.0 * M_PI * k / segments;
        ring.emplace_back(p.x() * std::cos(a), p.x() * std::sin(a), p.y());
      }
      rings.push_back(ring);
    }
    loft(rings, closed_path);
  }

  /// Axis-parallel block.
  void block(const Vector3d& low, const Vector3d& high) {
    std::vector<Ring> rings;
    for (const double z : {low.z(), high.z()}) {
      rings.push_back({Vector3d(low.x(), low.y(), z), Vector3d(high.x(), low.y(), z),
                       Vector3d(high.x(), high.y(), z), Vector3d(low.x(), high.y(), z)});
    }
    loft(rings);
  }

  /// Round wire of a radius along a polyline in the x–z plane.
  void wire(const std::vector<Vector2d>& path_xz, double radius, int segments) {
    std::vector<Ring> rings;
    for (std::size_t i = 0; i < path_xz.size(); ++i) {
      const Vector2d before = path_xz[i == 0 ? 0 : i - 1],
                     after = path_xz[std::min(i + 1, path_xz.size() - 1)];
      const Vector2d t = (after - before).normalized();
      const Vector3d normal(t.y(), 0.0, -t.x());
      const double r = i + 1 == path_xz.size() ? 0.5 * radius : radius;
      Ring ring;
      for (int k = 0; k < segments; ++k) {
        const double a = 2.0 * M_PI * k / segments;
        ring.push_back(Vector3d(path_xz[i].x(), 0.0, path_xz[i].y()) +
                       r * (std::cos(a) * normal + std::sin(a) * Vector3d::UnitY()));
      }
      rings.push_back(ring);
    }
    loft(rings);
  }

  void add(const Vector3d& a, const Vector3d& b, const Vector3d& c) { triangles_.push_back({a, b, c}); }
  void append(const Mesh& other) {
    triangles_.insert(triangles_.end(), other.triangles_.begin(), other.triangles_.end());
  }
  /// The same turned by half a turn about z: the opposite jaw.
  Mesh turned() const {
    Mesh out = *this;
    for (auto& t : out.triangles_) {
      for (auto& v : t) v = Vector3d(-v.x(), -v.y(), v.z());
    }
    return out;
  }
  std::size_t size() const { return triangles_.size(); }

  /// Binary STL, little-endian, metres; throws where the file cannot be written.
  void write(const std::string& path) const {
    std::ofstream out(path, std::ios::binary);
    char header[80] = "VEST instrument mesh, metres, own work, BSD-3-Clause";
    out.write(header, sizeof header);
    std::vector<std::array<Vector3d, 3>> kept;
    for (const auto& t : triangles_) {
      if ((t[1] - t[0]).cross(t[2] - t[0]).norm() > 1e-14) kept.push_back(t);
    }
    const auto count = static_cast<std::uint32_t>(kept.size());
    out.write(reinterpret_cast<const char*>(&count), 4);
    for (const auto& t : kept) {
      const Vector3d n = (t[1] - t[0]).cross(t[2] - t[0]).normalized();
      float record[12];
      for (int i = 0; i < 3; ++i) {
        record[i] = static_cast<float>(n[i]);
        for (int v = 0; v < 3; ++v)
          record[3 + 3 * v + i] = static_cast<float>(t[static_cast<std::size_t>(v)][i]);
      }
      out.write(reinterpret_cast<const char*>(record), sizeof record);
      const std::uint16_t attribute = 0;
      out.write(reinterpret_cast<const char*>(&attribute), 2);
    }
    out.close();  // a full disk is seen only then
    if (!out) throw std::runtime_error(path + ": cannot be written");
  }

 private:
  void cap(const Ring& ring, bool front) {
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d& p : ring) centre += p / static_cast<double>(ring.size());
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vector3d &a = ring[k], &b = ring[(k + 1) % ring.size()];
      front ? add(centre, b, a) : add(centre, a, b);
    }
  }

  std::vector<std::array<Vector3d, 3>> triangles_;
};

}  // namespace vest::meshes
