#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

namespace vest::learning {

/// A small picture and its depth, drawn by the processor: shaded surfaces under a light at the camera,
/// without textures, shadows or gloss. For agents; people look at vest_viz.
class Painter {
 public:
  using Colour = std::array<std::uint8_t, 3>;  ///< red, green, blue

  /// Begins a picture. @param camera in world (REP 103: z along the line of sight, x right, y down)
  /// @param field_of_view rad, horizontal  @param rgb width × height × 3, rows from above
  /// @param depth m along the line of sight, 0 where nothing is; width × height. Both are filled.
  void begin(const Eigen::Isometry3d& camera, double field_of_view, int width, int height, std::uint8_t* rgb,
             float* depth);
  /// @param xyz m, world, x y z per knot  @param alive per triangle, empty: all
  void mesh(const std::vector<float>& xyz, const std::vector<std::array<std::uint32_t, 3>>& triangles,
            const std::vector<std::uint8_t>& alive, Colour colour);
  /// A capsule as a tube with flat ends. m, world.
  void rod(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius, Colour colour);

 private:
  struct Corner {
    Eigen::Vector3f at;  ///< m, camera
    float light;
  };
  void triangle(const Corner& a, const Corner& b, const Corner& c, Colour colour);
  float light(const Eigen::Vector3f& at, const Eigen::Vector3f& normal) const;

  Eigen::Isometry3f world_to_camera_;
  int width_ = 0, height_ = 0;
  float focal_ = 0;  ///< pixels
  std::uint8_t* rgb_ = nullptr;
  float* depth_ = nullptr;
  std::vector<Corner> corners_;
  std::vector<Eigen::Vector3f> normals_;
};

}  // namespace vest::learning
