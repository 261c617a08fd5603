#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vest_effects/bleeding/source.h"
#include "vest_effects/haemodynamics/circulation.h"

/// Openings of vessels and what closes them. No ROS, no scene: places are vessel and station.
namespace vest::bleeding {

constexpr int kMostOpenings = 48;  ///< assumed; a cut through takes two
constexpr int kMostClamps =
    56;  ///< assumed; cuts through take one each. Both fit kMostHoles and kMostClosures

/// Openings of one vessel nearer than this count as one, and heat reaches so far, m in the scene (assumed:
/// jaws are 3 … 5 mm wide).
constexpr double kSamePlace = 0.003;
constexpr int kMostPinches = 8;  ///< assumed; with clamps they fit kMostClosures
/// A clot of a whole opening needs so long, s, while nothing flows through it: gauze stopped 56 of 85
/// bleeding aortas within 3 min (PubMed 27466878, abstract). Or while it is a small hole, which vessel and
/// platelets close themselves (Ivy: 2 … 9 min).
constexpr double kStillClotting = 180, kHoleClotting = 240;
constexpr double kSmallHole = 5e-7;  ///< m² in the scene: a needle of 0.8 mm (assumed)
constexpr double kStillFlow = 5e-9;  ///< m³/s: less is no flow that keeps a clot away (assumed)
/// Share of the lumen from which on an opening is a cut through (assumed: the rest tears).
constexpr double kThrough = 0.8;

enum class End : std::int8_t { kHeart = -1, kWall = 0, kFar = 1 };

/// The muscle of an artery that is cut through contracts: to some two fifths of its lumen within minutes
/// (assumed; a smooth cut contracts most, a torn or calcified wall little).
constexpr double kSpasm = 0.6, kSpasmTime = 60;  ///< of the area; s

/// One opening. What a scene knows of its place (object, ring, knot) is only carried.
struct Opening {
  std::uint32_t wound = 0;  ///< from 1
  std::uint16_t slot = 0;   ///< of FluidSource
  std::int16_t vessel = 0;
  End end = End::kWall;  ///< kHeart, kFar: stumps of a vessel that was cut through
  double station = 0;    ///< m
  double area = 0;       ///< m², of the opening in the network's lumen
  double sealed = 0;     ///< m² of it closed by coagulation
  double clot = 0;       ///< m² of it closed by clot, which a sucker takes
  double spasm = 0;      ///< m² of it closed by the muscle of an artery's stump
  double open() const { return area - sealed - clot - spasm > 0 ? area - sealed - clot - spasm : 0; }
  double lost = 0;  ///< m³
  double flow = 0;  ///< m³/s, mean of the last step
  std::int32_t object = -1;
  std::uint32_t ring = 0, knot = 0;
};

enum class ClampKind : std::uint8_t { kClip = 0, kLigature = 1, kSeal = 2, kCut = 3 };

struct Clamp {
  ClampKind kind = ClampKind::kClip;
  std::int16_t vessel = 0;
  double station = 0;  ///< m
  double opening = 0;  ///< 0 shut … 1 open
};

/// Everything that evolves.
struct WoundState {
  int opening_count = 0, clamp_count = 0;
  std::array<Opening, kMostOpenings> openings{};
  std::array<Clamp, kMostClamps> clamps{};
  std::uint32_t next_wound = 1;
  std::uint32_t refused = 0;  ///< openings and clamps for which there was no room: announced
};

using Vessels = haemodynamics::CirculationModel;

/// Of a vessel. A scene may draw it shorter than the patient has it.
struct Place {
  int vessel = 0;
  double station = 0;  ///< m of the network
  double stretch = 1;  ///< m of the network for each m of the scene
  double same() const { return kSamePlace * stretch; }
};

/// What holds a vessel shut in this step alone: jaws, a finger.
struct Pinch {
  Place place;
  double opening = 0;  ///< 0 shut … 1 open
};
struct Pinches {
  int count = 0;
  std::array<Pinch, kMostPinches> each{};
};

/// Adds what a tool holds shut. Without room it takes that of a kink. @param kinks left: the first of
/// `pinches`
inline void hold(const Pinch& pinch, int& kinks, Pinches& pinches) {
  if (pinches.count < kMostPinches)
    pinches.each[static_cast<std::size_t>(pinches.count++)] = pinch;
  else if (kinks > 0)
    pinches.each[static_cast<std::size_t>(--kinks)] = pinch;
}

/// An opening of `area` m² at a place; nearer than kSamePlace to another one it widens that. From kThrough of
/// the lumen on the vessel is cut through: two stumps, and nothing flows past. `like` carries object, ring,
/// knot. Where there is no room one that is wholly sealed makes it. False where there is none, or the place
/// is not in the vessel.
bool open(const Vessels& vessels, const Place& place, double area, const Opening& like, WoundState& state);

/// A clip or ligature. Where there is no room one that another makes needless does: sealed for good beside
/// it.
bool clamp(const Vessels& vessels, ClampKind kind, const Place& place, double opening, WoundState& state);
/// Takes the nearest clip within 2·kSamePlace away. False if there is none.
bool release(const Place& place, WoundState& state);

/// Coagulation closes `area` m² of the openings within kSamePlace; with `lumen` what is left of it narrows
/// the vessel there. Of two stumps that on whose side it is; both, where it is right between them.
bool seal(const Vessels& vessels, const Place& place, double area, bool lumen, WoundState& state);

/// Holes and closures for the circulation's next step, in the order of state.openings. Keeps each closure on
/// its own side of each hole, however coarse the cells are.
void fill(const Vessels& vessels, const WoundState& state, const Pinches& pinches,
          haemodynamics::CirculationInputs& inputs);

/// Books the flows of a step of dt seconds; clots grow.
void book(const Vessels& vessels, const haemodynamics::CirculationState& circulation, double dt,
          WoundState& state);

/// Share of a vessel's cross-section that its narrowest clamp closes, 0 … 1.
double closure(int vessel, const WoundState& state);

}  // namespace vest::bleeding
