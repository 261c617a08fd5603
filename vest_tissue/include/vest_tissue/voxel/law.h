/// What a needle and a probe feel in a patient's image. One law for the World and for the haptic loop, so all
/// that it reads is plain data that fits in shared memory.
///
///   needle, tip x:   F = −K (x − p) − friction along the shaft − viscosity,   K |x − p| ≤ yield(value at x)
///   probe, tip x:    F = K (p − x), p the point of the surface nearest to x
///
/// A needle's p follows where the yield is reached, so what it took is gone. p never goes back: behind the
/// tip lies the channel that it cut, where no tissue is cut again.
#pragma once

#include <array>
#include <cstdint>
#include <type_traits>

#include <Eigen/Core>

namespace vest::voxel {

inline constexpr int kMostRows = 256;             ///< of the table
inline constexpr int kMostRegions = 32;           ///< region 0 is what has no name
inline constexpr int kDepths = 12;                ///< at which a probe asks for stiffness
inline constexpr std::int16_t kNothing = -32768;  ///< stored where nothing was measured, or near it

/// A row of the table; linear between rows, the same beyond the first and the last.
struct Feel {
  double value = 0;      ///< HU, or the unit of the image
  double stiffness = 0;  ///< N/m, under the probe's tip
  double yield = 0;      ///< N, what stops the needle's tip at most
  double viscosity = 0;  ///< N·s/m
  double friction = 0;   ///< N/m, a metre of the needle's shaft
};

/// All but the voxels.
struct Header {
  std::uint32_t size[3] = {};
  std::uint32_t rows = 0;
  double to_grid[3][4] = {};          ///< world, m → grid; (i, j, k) is the centre of a voxel
  double slope = 1, intercept = 0;    ///< value = intercept + slope · stored
  double needle_stiffness = 1000;     ///< N/m: half of it at the tip, half along the shaft
  double surface = 0;                 ///< value of the surface that a probe rests on
  double radius = 0.002;              ///< m: of the probe's flat end
  double depth[kDepths] = {};         ///< m below the surface, at which stiffness is asked for
  double weight[kDepths] = {};        ///< of each; they sum to 1
  double capsule[kMostRegions] = {};  ///< N that a region's skin holds before it gives way; 0: none
  Feel table[kMostRows];
};
static_assert(std::is_trivially_copyable_v<Header>);

/// Voxels and header, wherever they lie.
struct View {
  const Header* header = nullptr;
  const std::int16_t* stored = nullptr;  ///< i fastest
  const std::uint8_t* region = nullptr;  ///< of each voxel
  explicit operator bool() const noexcept { return header != nullptr; }
};

enum class Kind : std::uint8_t { None, Needle, Probe };

/// Where a tool is.
struct Motion {
  Kind kind = Kind::None;
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();    ///< m, world
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();  ///< m, world: the shaft comes from there
  double reach = 0.0;                               ///< m: the point is so far beyond `tip` along the shaft
  double dt = 0.001;                                ///< s
  double most_stiffness = 1e9;                      ///< N/m that may be shown
};

/// All that evolves of a tool.
struct ToolState {
  Kind kind = Kind::None;
  std::uint8_t region = 0;                             ///< in which the tip is
  std::uint8_t pending = 0;                            ///< whose capsule it presses; 0: none
  bool touching = false;                               ///< probe: p is on the surface
  bool outside = false;                                ///< probe: it has been outside, so it may touch
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();       ///< m, a tick ago
  Eigen::Vector3d crossed = Eigen::Vector3d::Zero();   ///< m: where the region changed last
  Eigen::Vector3d spring = Eigen::Vector3d::Zero();    ///< m: x − p of the needle; p itself of the probe
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();    ///< probe: out of the tissue, at p
  Eigen::Vector3d aside = Eigen::Vector3d::Zero();     ///< m that the tip cut across its channel
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< m/s, low-passed
  double shaft = 0;                                    ///< m that the shaft's friction is drawn along it
  double stiffness = 0;                                ///< N/m of the tip's spring
  double ahead = 0;                                    ///< m of channel before the tip
  double held = 0;  ///< N that a capsule holds, or still holds while it drops
  double drop = 0;  ///< N/s
};

/// What a step found.
struct Felt {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< N, world: of the tissue on the tool, at Motion::tip
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();    ///< m: the point
  double stiffness = 0;                             ///< N/m of what is shown
  double stored = 0;                                ///< J that can come back
  double value = 0;                                 ///< at the tip
  bool tissue = false;                              ///< the tip is in what was measured
  std::uint8_t entered = 0, left = 0;               ///< regions; 0: none
  double broke = 0;                                 ///< N at which a capsule gave way, in this step
};

/// Cubic B-spline over the voxels: value, gradient a metre of world, and how much of the neighbourhood was
/// measured (0 … 1, and 0 wherever the nearest voxel is next to none).
struct Sampled {
  double value = 0, share = 0;
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
};
Sampled sample(const View& view, const Eigen::Vector3d& place) noexcept;
/// Without the gradient.
Sampled sampleValue(const View& view, const Eigen::Vector3d& place) noexcept;
Feel feelOf(const Header& header, double value) noexcept;
/// Of the nearest voxel; 0 outside.
std::uint8_t regionAt(const View& view, const Eigen::Vector3d& place) noexcept;

/// One step. Real-time safe; the same bits for the same motion. A tool that appears, or changes its kind,
/// begins without force where it is.
Felt step(const View& view, const Motion& motion, ToolState& state) noexcept;

}  // namespace vest::voxel
