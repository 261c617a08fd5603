#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace vest::tools {

/// Kind of tool at the end of an instrument. Values are those of vest_msgs/InstrumentState TOOL_*.
enum class ToolKind : std::uint8_t {
  None = 0,
  Grasper = 1,
  Scissors = 2,
  ClipApplier = 3,
  CoagulationHook = 4,
  BipolarForceps = 5,
  NeedleHolder = 6,
  SuctionIrrigator = 7,
  InjectionNeedle = 8,
  SlingApplicator = 9,
  Endoscope = 10,
  Swab = 11,
};

inline constexpr int kToolKindCount = 12;

/// Name used in YAML, URDF links and services: none, grasper, scissors, clip_applier, coagulation_hook,
/// bipolar_forceps, needle_holder, suction_irrigator, injection_needle, sling_applicator, endoscope, swab.
std::string_view toolName(ToolKind kind);

/// Inverse of toolName; empty where the word is unknown.
std::optional<ToolKind> toolFromName(std::string_view name);

/// What is switched on, a bit mask. Values are those of vest_msgs/InstrumentState FUNCTION_*.
enum ToolFunction : std::uint32_t {
  kFunctionCut = 1,
  kFunctionCoagulate = 2,
  kFunctionIrrigate = 4,
  kFunctionSuck = 8,
  kFunctionFire = 16,
  kFunctionClutch = 32,
  kFunctionCameraFollow = 64,
  kFunctionCameraIn = 128,
  kFunctionCameraOut = 256,
  kFunctionSuspend = 512,
};

/// Instruments in the order of every array of them.
enum class Instrument : std::uint8_t { Left = 0, Right = 1, Third = 2, Endoscope = 3 };
inline constexpr int kInstrumentCount = 4;

/// left, right, third, endoscope.
std::string_view instrumentName(Instrument instrument);

}  // namespace vest::tools
