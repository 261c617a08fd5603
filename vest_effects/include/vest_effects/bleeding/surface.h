#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Geometry>

#include "vest_effects/arithmetic.h"
#include "vest_effects/bleeding/source.h"
#include "vest_effects/bleeding/swab.h"
#include "vest_effects/setting.h"

/// Blood on the surfaces of organs: where tissue was cut its capillaries seep, and whatever blood reaches a
/// surface is a film on it, which spreads, runs down, drips and clots. No ROS, no scene: knots and triangles.
/// World frame, SI.
///
///     seeping   q = scale · perfusion · area · depth · open · (1 − styptic) · (1 − sealed) · (1 − pressed),
///     m³/s film      dV/dt = q + Σ Q(neighbours) − what is washed off − what drips running   Q = w (rho g
///     s/(3 mu) h³ + D dh/ds) m(age)   between two knots of a triangle washing   dV/dt = −tau h²/(2 mu) √A
///
/// s: how steep the edge falls; w: its width of the surface, half its length times the cotangent of the angle
/// across in each triangle (Pinkall and Polthier 1993, Exp. Math. 2, 15). The cube is Nusselt's film on a
/// wall (1916; Bird, Stewart and Lightfoot, Transport Phenomena, section 2.2), the square a layer under a
/// shear stress tau (Couette). m falls as the film clots. A film thicker than kFullFilm goes on to the knot
/// where it falls steepest, and drips where none is lower: each wound and each organ from its own lowest
/// place.
///
/// A vasoconstrictor is injected into tissue: it fills the space between the cells of that object out to the
/// radius r = (3 V/(4 pi φ))^⅓ for the volume V, stays in what it has reached, cut or not, and constricts
/// vessels there within seconds.
///
/// Gauze that touches soaks up what has not set: dV/dt = −m(age) p V/kSwabTime, p the share of its pressure
/// there of that in the middle (swab.h).
///
/// Nothing is lost: seeped + stained = film + shed + wiped.
namespace vest::bleeding {

/// m: blood as thick lets 1/e of green light through: 285/cm at 542 nm (oxyhaemoglobin 53236/(M cm), Prahl's
/// table, omlc.org; 150 g/l).
constexpr double kClearFilm = 3.5e-5;
constexpr double kFullFilm = 3.0e-4;  ///< m: what a moist, inclined surface holds (assumed)
constexpr double kSpread = 1.0e-6;    ///< m²/s: how a film levels out between neighbours (assumed)
using effects::kSettingTime;
using effects::kThinFilm;  // a thinner film stays where it is
/// s: open capillaries close by 1 − 1/e: nine of ten in 5 min; bleeding times of skin are 2 … 9 min (Ivy).
constexpr double kClottingTime = 130;
constexpr double kStypticTime = 3000;    ///< s: a vasoconstrictor's effect fades (assumed)
constexpr double kInjectionFlow = 3e-7;  ///< m³/s by the thumb on a syringe (assumed)
constexpr double kInterstice =
    1.0 / 6;  ///< φ: of tissue's volume (Guyton and Hall, Textbook of Medical Physiology)
constexpr double kConstrictionTime = 2.0;  ///< s: of constriction where the drug has come (assumed)
constexpr double kNewStitch = 0.003;       ///< m: a needle that moved farther begins a new depot (assumed)
constexpr double kPressReach = 0.006;      ///< m around a pressing tool's tip (assumed)
constexpr double kFilmViscosity = 3.5e-3;  ///< Pa·s, as fluid::Parameters::blood_viscosity
constexpr double kFilmDensity = 1060;      ///< kg/m³, as fluid::Parameters::blood_density
/// Heat that seals capillaries 1 mm deep, from 37 to 65 °C: rho·c·ΔT·d = 1050·3600·28·0.001 J/m².
constexpr double kSealHeat = 1.06e5;
/// m: vessels that a cut face opens feed tissue as far behind it (assumed; a liver's face gives 0.9 ml a
/// minute from a square centimetre).
constexpr double kFeedDepth = 0.01;
/// Most places that drip at a time; drips of an object nearer than kOneDrip fall as one (assumed).
constexpr int kMostDrips = 60;
constexpr double kOneDrip = 0.005;  ///< m

struct SurfaceModel {
  std::vector<std::uint32_t> first;  ///< per object: its first knot; one more at the end
  std::vector<std::uint32_t> scene;  ///< per object: knots of the scene; the rest of its room is for copies
  std::vector<double> perfusion;     ///< 1/s per knot: volume of blood per volume of tissue
  std::vector<double> depth;         ///< m per knot: of the tissue that it bleeds from
  std::size_t knots() const { return perfusion.size(); }
};

/// A depot's place is taken anew, a drip falls: bounded lists of the state.
struct Drip {
  std::int32_t object = -1;  ///< −1: this one is free
  std::uint32_t knot = 0;    ///< of the object
  double idle = 0;           ///< s since it last fell
};

/// Everything that evolves; per knot, room for copies included.
struct SurfaceState {
  std::vector<float> open, sealed;   ///< 0 … 1
  std::vector<float> clot;           ///< 0 … 1: of what was open, clotted since; comes off by suction
  std::vector<float> drug, styptic;  ///< 0 … 1: vasoconstrictor that came here, and how far it has closed
  std::vector<float> area;           ///< m² of the present surface; 0: inside
  std::vector<double> film;          ///< m³ on the knot's share of the surface
  std::vector<float> age;     ///< s since that blood left its vessel, mean; drying adds to it (setting.h)
  std::vector<double> loose;  ///< m³ that drips next
  std::vector<float> flow;    ///< m³/s seeping in the last step
  std::vector<std::uint32_t> used;               ///< per object: knots that it has now
  std::array<double, 4> injected{};              ///< m³ in each instrument's last depot
  std::array<std::array<double, 3>, 4> depot{};  ///< m: where
  std::array<Drip, kMostDrips> drips{};
  double seeped = 0, stained = 0, shed = 0;  ///< m³ since the start: out of tissue, from drops, dripped
  double wiped = 0;                          ///< m³ since the start: into gauze
  std::uint8_t active = 0;                   ///< anything ever happened: else a step costs nothing
  /// Per object: nothing open, no film, no drug since. Follows from the rest, spares only looking: all 0
  /// where the rest was changed from outside.
  std::vector<std::uint8_t> dry;
};

/// An object as it is now.
struct SurfaceMesh {
  const float* positions = nullptr;                         ///< m, world, x y z per knot; null: left alone
  const std::array<std::uint32_t, 3>* triangles = nullptr;  ///< knots
  const std::uint8_t* alive = nullptr;                      ///< per triangle; null: all
  std::size_t triangle_count = 0;
};

/// What tools do to surfaces in a step.
struct SurfaceInputs {
  struct Reach {
    bool on = false;
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m
    std::int32_t object = 0;                          ///< that the needle is in
    double radius = 0;                                ///< m around the place; not of needles
  };
  struct Gauze {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< m
    double room = 0;                                  ///< m³ that it can still hold; 0: nothing is soaked up
    double patch = kSwabReach;                        ///< m: radius that it presses on (pressedRadius)
  };
  double scale = 1;                      ///< factor for teaching, ≥ 0
  double drying = 0;                     ///< m/s of water that leaves a wet surface, ≥ 0: gas::Condition
  Eigen::Vector3d gravity{0, 0, -9.81};  ///< m/s²
  Reach inject[4], press[4], suck[4];    ///< per instrument; only `inject` looks at the object
  Gauze gauze[4];                        ///< likewise: what it touches within its patch
  const SurfaceMesh* meshes = nullptr;   ///< per object
  const double* perfused = nullptr;      ///< per object: perfusion over that at rest; null: 1
  const float* reach = nullptr;          ///< per knot: PerfusionState::reach; null: 1
};

/// What dripped in the last step; sized once.
struct SurfaceRunoff {
  explicit SurfaceRunoff(const SurfaceModel& model)
      : steepest(model.knots()),
        lower(model.knots()),
        thick(model.knots()),
        mobile(model.knots()),
        busy(model.knots()) {}
  struct Fall {
    double volume = 0;  ///< m³
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    std::int32_t object = -1;
  };
  std::array<Fall, kMostDrips> falls{};  ///< of the same index in SurfaceState::drips
  std::array<double, 4> clots{};         ///< m³ that each sucker took
  std::array<double, 4> wiped{};         ///< m³ of films that each swab took
  double volume() const {
    double sum = 0;
    for (const Fall& f : falls) sum += f.volume;
    return sum;
  }
  // No meaning between steps.
  std::vector<float> steepest;       ///< per knot: square of the greatest fall along an edge, (m/s²)²
  std::vector<std::uint32_t> lower;  ///< and where it leads
  std::vector<double> thick;         ///< m: of the film as it begins to flow, at most kFullFilm; 0: it stays
  std::vector<double> mobile;        ///< no unit: what it flows by, 1 fresh, 0 set
  std::vector<std::uint8_t> busy;    ///< whether anything is left to do
};

SurfaceState initialSurface(const SurfaceModel& model);

/// The knots' shares of the surface, from its living triangles. @param rest m: x y z per knot, by which areas
/// are measured
void measureSurface(const SurfaceModel& model, std::size_t object, const SurfaceMesh& mesh, const float* rest,
                    SurfaceState& state);
/// Opens the capillaries of an object's knots within `reach` m of a place: a cut.
void openSurface(const SurfaceModel& model, std::size_t object, const float* positions,
                 const Eigen::Vector3d& place, double reach, SurfaceState& state);
/// The same for the knots of a triangle: a face that a cut made.
void openFace(const SurfaceModel& model, std::size_t object, const std::array<std::uint32_t, 3>& knots,
              SurfaceState& state);
/// Heat of `energy` J at a place: seals there first, then around, kSealHeat per area.
void sealSurface(const SurfaceModel& model, std::size_t object, const float* positions,
                 const Eigen::Vector3d& place, double energy, SurfaceState& state);
/// Water that flows over a triangle takes its film along.
/// @param impulse N·s: shear stress times area times time
void washSurface(const SurfaceModel& model, std::size_t object, const std::array<std::uint32_t, 3>& knots,
                 double impulse, SurfaceState& state);
/// Drops leave `volume` m³ of fresh blood on a triangle. Where a cut has just taken its surface away, it
/// drips.
void stainSurface(const SurfaceModel& model, std::size_t object, const std::array<std::uint32_t, 3>& knots,
                  double volume, SurfaceState& state);
/// A cut doubled a knot: the copy bleeds as the original does. False where there is no room.
bool copyKnot(const SurfaceModel& model, std::size_t object, std::uint32_t original, SurfaceState& state);

/// Allocates nothing. dt in s, up to some 10 ms.
void stepSurface(const SurfaceModel& model, const SurfaceInputs& inputs, double dt, SurfaceState& state,
                 SurfaceRunoff& runoff);
/// The same in three parts. First what tissue and tools do. False: nothing is wet, and the step is over.
bool seepSurface(const SurfaceModel& model, const SurfaceInputs& inputs, double dt, SurfaceState& state,
                 SurfaceRunoff& runoff);
/// Then the films of each object run, which is most of the work: threads may share the objects out.
void runSurface(const SurfaceModel& model, const SurfaceInputs& inputs, double dt, std::size_t object,
                SurfaceState& state, SurfaceRunoff& runoff);
/// Then what is too thick goes on and drips.
void dripSurface(const SurfaceModel& model, const SurfaceInputs& inputs, SurfaceState& state,
                 SurfaceRunoff& runoff);

/// Volume of the films and of what is about to drip, m³.
double filmVolume(const SurfaceState& state);
/// Thickness of the film at a knot (counted over all objects), m.
inline double thickness(const SurfaceState& state, std::size_t knot) {
  return state.area[knot] > 0 ? state.film[knot] / static_cast<double>(state.area[knot]) : 0.0;
}
using effects::setShare;
/// Thickness, m -> 0 dry … 1 covered: share of green light that stays in it (Beer and Lambert).
inline float wetness(double film) {
  return static_cast<float>(1 - effects::exponential(-film / kClearFilm));
}

}  // namespace vest::bleeding
