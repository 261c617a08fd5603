#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

/// Curves that organs are drawn with (spline curves with 2-D cross-sections).
/// All curves are cubic and pass through their control points: Catmull, Rom, "A class of local interpolating
/// splines", Computer Aided Geometric Design, Academic Press 1974, with tension 1/2.
namespace vest::modelling {

using Vector3 = Eigen::Vector3d;

/// Weights of the four neighbouring control points at t in [0, 1] between the second and the third. Sum is 1.
std::array<double, 4> catmullRom(double t);

/// Open curve through points, parametrised by arc length.
class Curve {
 public:
  /// @throws std::invalid_argument with fewer than two points, or where neighbours coincide
  explicit Curve(std::vector<Vector3> points);
  double length() const { return arc_.back(); }  ///< m
  Vector3 at(double arc_length) const;           ///< m; beyond the ends: straight on
  Vector3 tangent(double arc_length) const;      ///< unit

 private:
  Vector3 raw(double parameter) const;
  double parameterAt(double arc_length) const;
  std::vector<Vector3> points_;
  std::vector<double> arc_;  // arc length at equally spaced parameters
};

/// Right-handed frame of a cross-section: x and y span it, z is the tangent.
struct SectionFrame {
  Vector3 centre, x, y, tangent;
};

/// Frames along a curve that do not twist: the first x is `reference` made orthogonal to the tangent, the
/// others follow by the double reflection of Wang, Jüttler, Zheng, Liu, ACM Trans. Graph. 27(1), 2008,
/// doi:10.1145/1330511.1330513.
std::vector<SectionFrame> framesAlong(const Curve& curve, const std::vector<double>& arc_lengths,
                                      const Vector3& reference);

/// Closed curve in polar form: radius over angle through equally spaced radii (angle 0 on the frame's x).
/// One radius is a circle, two are the semi-axes of an ellipse (x, y), four or more a closed spline.
double polarRadius(const std::vector<double>& radii, double angle);

/// Cross-sections at fractions of the centre curve, interpolated between them (monotone: never beyond its
/// neighbours).
struct Section {
  double at = 0.0;            ///< fraction of the curve's length, 0 … 1, ascending
  std::vector<double> radii;  ///< m
};
double sectionRadius(const std::vector<Section>& sections, double at, double angle);

}  // namespace vest::modelling
