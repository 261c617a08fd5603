#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vest_tissue/modelling/spline.h"
#include "vest_tissue/scene/description.h"

/// Nets of rings of knots: tubes, bags and double-leaved sheets alike.
///
///        pole ─ ring 0 ─ ring 1 ─ … ─ ring R-1 ─ pole          knot(r, k) = r·around + k, poles last
///
/// A sheet (peritoneal fold) is a flat ring net whose rings run up one leaf and down the other one.
namespace vest::modelling {

/// How an end of the net is closed.
enum class End : std::uint8_t {
  Pole = 0,  ///< a knot of its own closes the end
  Cap = 1,   ///< no knot; the skin closes over the ring (the ring has at most 8 knots)
  Zip = 2,   ///< sheets: the two leaves are joined
};

struct RingNet {
  std::uint32_t rings = 0, around = 0;
  End start = End::Pole, end = End::Pole;
  bool inside = false;              ///< the outside is within (cavities): turns all triangles round
  std::vector<Vector3> knots;       ///< m, world
  std::vector<double> station;      ///< m, arc length of the centre line per ring
  std::vector<double> wall;         ///< m², solid cross-section of the wall per ring
  std::vector<double> mean_radius;  ///< m per ring

  std::uint32_t knot(std::uint32_t ring, std::uint32_t k) const { return ring * around + k % around; }
  std::uint32_t poles() const { return (start == End::Pole) + (end == End::Pole); }
  std::uint32_t startPole() const { return rings * around; }
  std::uint32_t endPole() const { return rings * around + (start == End::Pole); }
  std::uint32_t size() const { return rings * around + poles(); }
};

/// What a tube is made from.
struct TubeSpec {
  std::vector<Vector3> centre;    ///< m, world: control points of the centre curve
  std::vector<Section> sections;  ///< cross-sections along it
  Vector3 reference{1, 0, 0};     ///< angle 0 of the first cross-section
  std::uint32_t rings = 0, around = 0;
  End start = End::Pole, end = End::Pole;
  double start_dome = 0.0, end_dome = 0.0;    ///< m: length over which the end is rounded off; 0: blunt
  double start_mouth = 0.0, end_mouth = 0.0;  ///< m: the pole lies this deep inside: a funnel
  double wall_thickness = 0.0;                ///< m; 0: solid
  std::vector<std::array<double, 2>>
      density;  ///< (fraction of the profile, rings per length): crowds rings; empty: even
  bool inside = false;
};
RingNet makeTube(const TubeSpec& spec);

/// What a double-leaved sheet is made from: curves of equal meaning from one end to the other one.
struct SheetSpec {
  std::vector<std::vector<Vector3>> curves;  ///< m, world: from the upper to the lower edge, two or more
  std::uint32_t stations = 0;                ///< rings
  std::uint32_t height_knots = 0;            ///< knots per leaf and ring; around = 2·height_knots
  double thickness = 0.0;                    ///< m
};
RingNet makeSheet(const SheetSpec& spec);

/// What a surface of revolution is made from.
struct RevolveSpec {
  Vector3 origin = Vector3::Zero(), axis{0, 0, 1};  ///< m, world; the axis may have any length
  Vector3 reference{1, 0, 0};                       ///< angle 0
  std::vector<std::array<double, 2>> profile;  ///< m: height along the axis, radius; a radius of 0 is a pole
  std::uint32_t rings = 0, around = 0;
  double wall_thickness = 0.0;  ///< m; 0: solid
};
/// @throws std::invalid_argument
RingNet makeRevolve(const RevolveSpec& spec);

/// Springs by class, each class in an order that leaves parallel links next to each other.
enum class LinkClass : std::uint8_t { Ring, Long, Diagonal, Pole, Ring2, Strut, Long2, Cross, Leaf };
struct NetLink {
  LinkClass kind;
  std::uint32_t a, b;
};

/// Ring, Long, Diagonal and Pole links, then those of `fillers` in order: all of them (`springs` 0), or
/// exactly `springs`, where the last class that does not fit entirely is thinned out evenly. @throws
/// std::invalid_argument saying what would be possible
std::vector<NetLink> makeLinks(const RingNet& net, std::uint32_t springs,
                               const std::vector<LinkClass>& fillers);

/// Knot triangles, counter-clockwise from outside, closed.
std::vector<std::array<std::uint32_t, 3>> knotTriangles(const RingNet& net);

/// The same without those that close an end which has no pole.
std::vector<std::array<std::uint32_t, 3>> wallTriangles(const RingNet& net);

/// Volume inside a closed surface, m³ (> 0 with outward triangles).
double enclosedVolume(const std::vector<Vector3>& points,
                      const std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Finer skin: each vertex on bicubic Catmull-Rom patches through at most 16 knots. `along` and `around` are
/// subdivisions per knot interval. `petals` folds the funnel's lip into as many fringes (0: none).
/// Texture coordinates in metres: u is the length along a meridian, v = r·(|angle|−π/2) with the local mean
/// radius r (sinusoidal projection: keeps areas, no seam, both silhouettes at angle 0 and π mirror).
scene::Skin makeSkin(const RingNet& net, std::uint32_t along, std::uint32_t around, std::uint32_t petals = 0,
                     double petal_depth = 0.0);

/// Where an endoscope looks at a cavity whose source says nothing else: caudal and down, at the pelvis.
inline const Vector3 kPelvis{0.0, 0.8710, -0.4913};

}  // namespace vest::modelling
