#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "vest_effects/haemodynamics/circulation.h"

/// Openings of vessels and what closes them. No ROS, no scene: places are vessel and station.
namespace vest::bleeding {

constexpr int kMostOpenings = 48;  ///< ours; a cut through takes two
constexpr int kMostClamps = 56;  ///< ours; cuts through take one each. Both fit kMostHoles and kMostClosures

/// Openings of one vessel nearer than this count as one, and heat reaches so far, m (ours: jaws are 3 … 5 mm
/// wide).
constexpr double kSamePlace = 0.003;
/// Share of the lumen from which on an opening is a cut through (ours: the rest tears).
constexpr double kThrough = 0.8;

enum class End : std::int8_t { kHeart = -1, kWall = 0, kFar = 1 };

/// One opening. What a scene knows of its place (object, ring, knot) is only carried.
struct Opening {
  std::uint32_t wound = 0;  ///< from 1
  std::uint16_t slot = 0;   ///< of FluidSource
  std::int16_t vessel = 0;
  End end = End::kWall;  ///< kHeart, kFar: stumps of a vessel that was cut through
  double station = 0;    ///< m
  double area = 0;       ///< m², of the opening in the network's lumen
  double sealed = 0;     ///< m² of it closed by coagulation
  double lost = 0;       ///< m³
  double flow = 0;       ///< m³/s, mean of the last step
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

/// An opening of `area` m² at a place; nearer than kSamePlace to another one it widens that. From kThrough of
/// the lumen on the vessel is cut through: two stumps, and nothing flows past. `like` carries object, ring,
/// knot. False where there is no room or the place is not in the vessel.
bool open(const Vessels& vessels, int vessel, double station, double area, const Opening& like,
          WoundState& state);

/// A clip or ligature.
bool clamp(const Vessels& vessels, ClampKind kind, int vessel, double station, double opening,
           WoundState& state);
/// Takes the nearest clip within 2·kSamePlace away. False if there is none.
bool release(int vessel, double station, WoundState& state);

/// Coagulation closes `area` m² of the openings within kSamePlace; with `lumen` what is left of it narrows
/// the vessel there.
bool seal(const Vessels& vessels, int vessel, double station, double area, bool lumen, WoundState& state);

/// Holes and closures for the circulation's next step, in the order of state.openings. Keeps each closure on
/// its own side of each hole, however coarse the cells are.
void fill(const Vessels& vessels, const WoundState& state, haemodynamics::CirculationInputs& inputs);

/// Books the flows of a step of dt seconds.
void book(const haemodynamics::CirculationState& circulation, double dt, WoundState& state);

/// Share of a vessel's cross-section that its narrowest clamp closes, 0 … 1.
double closure(int vessel, const WoundState& state);

}  // namespace vest::bleeding
