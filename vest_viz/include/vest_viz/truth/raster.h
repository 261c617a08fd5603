#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>

#include "vest_viz/camera/model.h"
#include "vest_viz/picture/finish.h"

/// Ground truth of a picture, computed on the processor beside the drawing: what is seen at each pixel of the
/// distorted picture, how far away, and how it moved. Conventions: formats of docs/ros_interface.md.
namespace vest::truth {

/// Labels of segmentation pictures beside those of the topology (TissueObject.segmentation_label, 1 …).
constexpr std::uint16_t kBackground = 0;           ///< nothing there, or outside of the round picture
constexpr std::uint16_t kFirstInstrument = 60001;  ///< left; right, third: the next ones
constexpr std::uint16_t kMetal = 61001;            ///< clips and needles
constexpr std::uint16_t kThread = 61002;           ///< threads and slings
constexpr std::uint16_t kFluid = 62001;            ///< drops and pools of blood or water

/// Triangles of one thing. The arrays belong to the caller and live through draw() and the read-out.
struct Body {
  std::uint16_t label = 0;
  const float* positions = nullptr;  ///< m, world; x y z per vertex
  const float* previous = nullptr;   ///< the same at the picture before; null: unknown, the flow is NaN
  std::size_t vertices = 0;
  const std::uint32_t* triangles = nullptr;
  std::size_t triangle_count = 0;
};

/// Finds the visible triangle of each pixel with a depth buffer over the undistorted pinhole, and cuts the
/// pixel's exact ray with that triangle (and those of the neighbouring pixels): the depth is that of a ray
/// caster except within a pixel of an edge. No allocation after the first picture of a size.
class Raster {
 public:
  /// @param camera the picture's; @param circle the round image in it
  Raster(const camera::Intrinsics& camera, const picture::Circle& circle);

  /// @param X_WO optical frame in world
  void draw(const std::vector<Body>& bodies, const Eigen::Isometry3d& X_WO);

  /// CV_32F, m along the optical axis; NaN where nothing is seen.
  void depth(cv::Mat* out) const;
  /// CV_16U, labels of the bodies; kBackground where nothing is seen.
  void segmentation(cv::Mat* out) const;
  /// CV_32FC2, pixels: place in this picture minus place in the picture before of the point of tissue or
  /// instrument that is seen here; NaN where unknown.
  /// @param X_WO_before optical frame of the picture before
  void flow(const Eigen::Isometry3d& X_WO_before, cv::Mat* out) const;

  /// Depth at a pixel (rounded), m; NaN where nothing is seen or outside.
  float depthAt(double u, double v) const;
  std::uint16_t labelAt(double u, double v) const;

 private:
  struct Hit {
    std::int32_t body = -1;
    std::uint32_t triangle = 0;
    float depth = 0, w1 = 0, w2 = 0;  ///< barycentric weights of the second and third vertex
  };
  void rasterise(std::int32_t body, const std::vector<Body>& bodies);
  void fill(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c, std::int32_t body,
            std::uint32_t triangle);
  bool cut(std::int32_t body, std::uint32_t triangle, const Eigen::Vector3d& ray, double slack,
           Hit* hit) const;

  camera::Intrinsics camera_, pinhole_;
  std::vector<Eigen::Vector2f> rays_;  ///< undistorted direction per pixel; NaN outside of the circle
  std::vector<float> inverse_depth_;   ///< of the pinhole's pixels, 1/m; 0: nothing
  std::vector<std::int32_t> seen_body_;
  std::vector<std::uint32_t> seen_triangle_;
  std::vector<Hit> hits_;  ///< per pixel of the picture
  std::vector<Body> bodies_;
  std::vector<std::vector<Eigen::Vector3f>> camera_vertices_;
};

}  // namespace vest::truth
