#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

/// Bleeding of organ surfaces: where tissue was cut, its capillaries seep; the blood stands as a film on the
/// surface, spreads and runs off. No ROS, no scene: knots with neighbours. World frame, SI.
///
///     seeping   q = scale · supply · open · (1 − styptic) · (1 − sealed) · (1 − pressed) · P/P_rest, m³/s a
///     knot film      A dh/dt = q + Σ mobility·(h_j − h_i) − what runs off above kFullFilm − tau h²/(2 mu) √A
///
/// The last term is the film that water drags along: the flux of a layer of depth h under a shear stress tau
/// is tau h²/(2 mu) per width (Couette flow), and √A is the width of a knot's share of the surface.
///
/// A vasoconstrictor is injected into the tissue: it fills the space between the cells around the needle's
/// tip out to the radius r = (3 V/(4 pi φ))^⅓ for the volume V, and what it reaches constricts within
/// seconds.
///
/// Nothing is lost: seeped = film + shed, where shed is what ran off or was washed off (FluidSource).
namespace vest::bleeding {

constexpr double kOpaqueFilm = 1.0e-4;  ///< m: thicker looks no redder (assumed)
constexpr double kFullFilm = 3.0e-4;    ///< m: what a moist, inclined surface holds (assumed)
constexpr double kSpread = 1.0e-6;      ///< m²/s: how a film spreads between neighbours (assumed)
constexpr double kClottingTime =
    240;  ///< s: open capillaries close; bleeding times of skin are 2 … 9 min (Ivy)
constexpr double kStypticTime = 3000;    ///< s: a vasoconstrictor's effect fades (assumed)
constexpr double kInjectionFlow = 3e-7;  ///< m³/s by the thumb on a syringe (assumed)
constexpr double kInterstice =
    1.0 / 6;  ///< φ: of tissue's volume (Guyton and Hall, Textbook of Medical Physiology)
constexpr double kConstrictionTime = 2.0;  ///< s: of constriction where the drug has come (assumed)
constexpr double kNewStitch = 0.003;       ///< m: a needle that moved farther begins a new depot (assumed)
constexpr double kPressReach = 0.006;      ///< m around a pressing tool's tip (assumed)
constexpr double kFilmViscosity = 3.5e-3;  ///< Pa·s, as fluid::Parameters::blood_viscosity
/// Heat that seals capillaries 1 mm deep, from 37 to 65 °C: rho·c·ΔT·d = 1050·3600·28·0.001 J/m².
constexpr double kSealHeat = 1.06e5;

/// Blood supply of an organ, m³/s per kg, by the material database's word. Uterus: 2 × 7.8 ml/min (Palmer et
/// al. 1992) for 60 g (assumed); intestine 30 ml/min per 100 g, ovary 40, tube 10, ligament and others 3
/// (assumed).
double supplyOf(const char* organ);

struct SurfaceModel {
  std::vector<std::uint32_t> first;  ///< per object: its first knot; one more at the end
  std::vector<std::uint32_t> scene;  ///< per object: knots of the scene; the rest of its room is for copies
  std::vector<double> supply;        ///< m³/s per knot
  std::vector<double> area;          ///< m² per knot, of the surface; 0: inside
  std::vector<std::uint32_t> link0, link1;  ///< pairs of neighbours on a surface, object by object
  std::size_t knots() const { return supply.size(); }
};

/// Everything that evolves; per knot, room for copies included.
struct SurfaceState {
  std::vector<float> open, sealed;   ///< 0 … 1
  std::vector<float> drug, styptic;  ///< 0 … 1: vasoconstrictor that came here, and how far it has closed
  std::vector<double> film;          ///< m
  std::vector<float> flow;           ///< m³/s seeping in the last step
  std::vector<std::uint32_t> used;   ///< per object: knots that it has now
  std::array<double, 4> injected{};  ///< m³ in each instrument's last depot
  std::array<std::array<double, 3>, 4> depot{};  ///< m: where
  double washed = 0;                             ///< m³ taken off by water, not yet in shed
  std::array<double, 3> washed_moment{};         ///< m⁴: the same times its place
  double seeped = 0, shed = 0;                   ///< m³ since the start
  std::uint8_t active = 0;                       ///< anything was ever cut: else a step costs nothing
  /// Per object: nothing open, no film, no flow since. Follows from the rest, spares only looking: all 0 where the
  /// rest was changed from outside.
  std::vector<std::uint8_t> dry;
};

/// What tools do to surfaces in a step.
struct SurfaceInputs {
  struct Reach {
    bool on = false;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m
  };
  double scale = 1;                         ///< factor for teaching, ≥ 0
  double pressure_ratio = 1;                ///< mean arterial pressure over that at rest
  Reach inject[4], press[4];                ///< per instrument; a needle injects into tissue
  const float* const* positions = nullptr;  ///< per object: x y z per knot, m
};

/// What ran off in the last step: one place for all (the blood-weighted mean).
struct SurfaceRunoff {
  double volume = 0;                                ///< m³
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m
  std::int32_t object = -1;                         ///< that gave most
};

SurfaceState initialSurface(const SurfaceModel& model);

/// Opens the capillaries of an object's knots within `reach` m of a place: a cut.
void openSurface(const SurfaceModel& model, std::size_t object, const float* positions,
                 const Eigen::Vector3d& place, double reach, SurfaceState& state);
/// Heat of `energy` J at a place: seals there first, then around, kSealHeat per area.
void sealSurface(const SurfaceModel& model, std::size_t object, const float* positions,
                 const Eigen::Vector3d& place, double energy, SurfaceState& state);
/// Water that flows over a triangle takes its film along.
/// @param impulse N·s: shear stress times area times time
void washSurface(const SurfaceModel& model, std::size_t object, const float* positions,
                 const std::array<std::uint32_t, 3>& knots, double impulse, SurfaceState& state);
/// A cut doubled a knot: the copy bleeds as the original does. False where there is no room.
bool copyKnot(const SurfaceModel& model, std::size_t object, std::uint32_t original, SurfaceState& state);

/// Allocates nothing. `runoff` may be null.
void stepSurface(const SurfaceModel& model, const SurfaceInputs& inputs, double dt, SurfaceState& state,
                 SurfaceRunoff* runoff);

/// Volume of the films and of what water has just taken off them, m³.
double filmVolume(const SurfaceModel& model, const SurfaceState& state);
/// 0 dry … 1 covered.
inline float wetness(double film) {
  return film >= kOpaqueFilm ? 1.0f : static_cast<float>(film / kOpaqueFilm);
}

}  // namespace vest::bleeding
