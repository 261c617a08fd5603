#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "vest_instruments/tools/tool_kind.h"
#include "vest_tissue/scene/world.h"

/// An exercise as its file says it (docs/exercises.md), plain data. Names of objects and roles are looked up
/// in the scene when an Engine is built.
namespace vest::exercise {

/// Numbers that are known after each step. Their words, units and meanings: kMetrics.
enum class Metric : std::uint8_t {
  Time,
  BloodLost,
  Leak,
  Pool,
  Sucked,
  Path,
  Idle,
  Force,
  ForcePeak,
  ForceImpulse,
  Touches,
  BothMove,
  OutOfView,
  Distance,
  TipHeight,
  OffCentre,
  Horizon,
  Contact,
  ContactPeak,
  Damage,
  DamageOutside,
  Sealed,
  CutArea,
  Clips,
  ClipOff,
  ClipTilt,
  CutOff,
  CutLength,
  CutAside,
  PlaceOff,
  CutRound,
  CutRoundRms,
  CutFree,
  Removed,
  Apart,
  Bites,
  BiteOff,
  KnotDeterminant,
  KnotOff,
  Tail,
  ThreadTension,
  ThreadTensionPeak,
  HeartRate,
  Systolic,
  MeanPressure,
  Given,
  Haematocrit,
  Oxygen,
  Vasopressor,
  Arrested,
  GasPressure,
  Fog,
  FilteredPath,
  AngularPath,
  DepthPath,
  DepthTurns,
  Economy,
  MeanSpeed,
  PeakSpeed,
  Rest,
  RmsJerk,
  Sparc,
  Ldlj,
  Bimanual,
  PathRatio,
};

/// What a number is a number of, beside its word. kFigure: a figure of motion as vest_metrics has it
/// (session/motion_metrics.h). It is known at the end alone, of the endoscope, too.
enum Needs : std::uint8_t { kNothing = 0, kTool = 1, kObject = 2, kMark = 4, kFigure = 8 };

struct MetricInfo {
  Metric metric;
  std::string_view name;  ///< ends with its unit
  std::uint8_t needs;     ///< bits of Needs
  bool sums;              ///< grows from nothing: an item may ask for its part within a phase
  std::string_view meaning;
};

inline constexpr double kIdleSpeed = 0.005;              ///< m/s, as of vest_metrics
inline constexpr double kForceWindow = 0.020;            ///< s: force peaks are peaks of the mean over it
inline constexpr double kFreeForce = 0.5;                ///< N that the impulse does not count (assumed)
inline constexpr double kTouchPause = 0.1;               ///< s without contact before the next touch counts
inline constexpr double kOutOfViewPause = 0.2;           ///< s that a tip may leave the picture
inline constexpr double kPictureHalfAngle = 35;          ///< degrees: half the field of view of the endoscope
inline constexpr double kDegree = 0.017453292519943295;  ///< rad
inline constexpr double kOpticOff = 0.5;  ///< degrees that the endoscope's optic may be off the exercise's
inline constexpr double kSealedDamage = 0.632;  ///< denatured share at which tissue is sealed: omega = 1

inline constexpr std::array<MetricInfo, 65> kMetrics{{
    {Metric::Time, "time_s", kNothing, true, "time since the first phase began"},
    {Metric::BloodLost, "blood_lost_ml", kNothing, true, "blood that left the vessels and surfaces"},
    {Metric::Leak, "leak_ml_s", kNothing, false, "blood that leaves the vessels now"},
    {Metric::Pool, "pool_ml", kNothing, false, "liquid that stands in the field"},
    {Metric::Sucked, "sucked_ml", kNothing, true, "liquid that suction removed"},
    {Metric::Path, "path_mm", kTool, true, "way of the tool's tip"},
    {Metric::Idle, "idle_s", kTool, true, "time with the tip slower than 5 mm/s"},
    {Metric::Force, "force_N", kTool, false, "force of tissue on the tool, mean of 20 ms"},
    {Metric::ForcePeak, "force_peak_N", kTool, false, "greatest mean force within 20 ms"},
    {Metric::ForceImpulse, "force_impulse_Ns", kTool, true, "integral of the force above 0.5 N"},
    {Metric::Touches, "touches", kTool, true, "touches of tissue, those less than 0.1 s apart as one"},
    {Metric::BothMove, "both_move_s", kNothing, true, "time in which left and right tool move together"},
    {Metric::OutOfView, "out_of_view_s", kTool, true,
     "time with the tip outside the picture, beyond 0.2 s each"},
    {Metric::Distance, "distance_mm", kTool | kMark, false, "tip to the mark"},
    {Metric::TipHeight, "tip_height_mm", kTool, false, "height of the tip above the floor of the box"},
    {Metric::OffCentre, "off_centre_deg", kMark, false, "the mark's angle from the middle of the picture"},
    {Metric::Horizon, "horizon_deg", kNothing, false, "the camera's tilt about its line of sight"},
    {Metric::Contact, "contact_N", kTool | kObject, false, "force on the tool while it touches the object"},
    {Metric::ContactPeak, "contact_peak_N", kObject, false, "greatest contact_N of any tool"},
    {Metric::Damage, "damage_mm3", kObject, false, "sum of volume times damage, by heat or crushing"},
    {Metric::DamageOutside, "damage_outside_mm3", kObject | kMark, false,
     "the same of knots outside the mark's radius"},
    {Metric::Sealed, "sealed_percent", kObject | kMark, false,
     "part of the knots within the mark's radius whose damage is 0.632 or more"},
    {Metric::CutArea, "cut_area_mm2", kObject, true, "area of all cuts"},
    {Metric::Clips, "clips", kObject, true, "clips set on the object"},
    {Metric::ClipOff, "clip_off_mm", kObject | kMark, false,
     "greatest distance along the tube of a clip from the nearest of its marks"},
    {Metric::ClipTilt, "clip_tilt_deg", kObject, false,
     "greatest angle of a clip to the tube's cross-section"},
    {Metric::CutOff, "cut_off_mm", kObject | kMark, false,
     "greatest distance of a cut from the mark's plane"},
    {Metric::CutLength, "cut_length_mm", kObject, false, "length along the tube between its outermost cuts"},
    {Metric::CutAside, "cut_aside_mm", kObject | kMark, false,
     "greatest distance of a cut from the straight line between two marks"},
    {Metric::PlaceOff, "place_off_mm", kObject | kMark, false,
     "distance of the object's middle from the mark"},
    {Metric::CutRound, "cut_round_mm", kObject | kMark, false,
     "greatest distance of the cut from the mark's circle, on the tissue at rest"},
    {Metric::CutRoundRms, "cut_round_rms_mm", kObject | kMark, false,
     "root mean square of the same along the cut"},
    {Metric::CutFree, "cut_free_percent", kObject, false,
     "part of the object's mass that nothing but instruments holds"},
    {Metric::Removed, "removed_percent", kObject, false, "what of it has left the cavity through a trocar"},
    {Metric::Apart, "apart_mm", kMark, false, "distance between two marks"},
    {Metric::Bites, "bites", kObject, false, "ways of needle and thread through the object and out again"},
    {Metric::BiteOff, "bite_off_mm", kObject | kMark, false,
     "greatest distance of such a way's ends from the nearest of the marks, on the tissue at rest"},
    {Metric::KnotDeterminant, "knot", kNothing, false,
     "determinant of the thread that is knotted most: 1 no knot, 3 a throw of one turn, 5 of two; several "
     "multiply"},
    {Metric::KnotOff, "knot_off_mm", kNothing, false,
     "distance of the knot from the nearest end of a way through tissue"},
    {Metric::Tail, "tail_mm", kNothing, false, "the shorter end of the thread beyond its knot"},
    {Metric::ThreadTension, "thread_tension_N", kNothing, false,
     "greatest tension in a thread, mean of 20 ms"},
    {Metric::ThreadTensionPeak, "thread_tension_peak_N", kNothing, false, "greatest such mean"},
    {Metric::HeartRate, "heart_rate_min", kNothing, false, "beats a minute; 0 when the heart has stopped"},
    {Metric::Systolic, "systolic_mmHg", kNothing, false, "systolic pressure of the last beat"},
    {Metric::MeanPressure, "mean_pressure_mmHg", kNothing, false, "mean arterial pressure of the last beat"},
    {Metric::Given, "given_ml", kNothing, true, "infusion and transfusion"},
    {Metric::Haematocrit, "haematocrit_percent", kNothing, false, "share of the blood that is red cells"},
    {Metric::Oxygen, "spo2_percent", kNothing, false, "oximeter; 0 when it finds no pulse"},
    {Metric::Vasopressor, "vasopressor_percent", kNothing, false,
     "what drugs add to the resistance of the vessels"},
    {Metric::Arrested, "arrested", kNothing, false, "1 when the heart has stopped"},
    {Metric::GasPressure, "gas_pressure_mmHg", kNothing, false, "pressure of the pneumoperitoneum"},
    {Metric::Fog, "fog_percent", kNothing, false, "how much of the sight condensate on the lens takes"},
    {Metric::FilteredPath, "filtered_path_mm", kTool | kFigure, true, "way of the tip without tremor"},
    {Metric::AngularPath, "angular_path_deg", kTool | kFigure, true, "angle that the tool turned through"},
    {Metric::DepthPath, "depth_path_mm", kTool | kFigure, true, "way along the tool's axis, in and out"},
    {Metric::DepthTurns, "depth_turns", kTool | kFigure, true,
     "times that the tool turned back along its axis, after more than 5 mm and by more than 5 mm"},
    {Metric::Economy, "economy_percent", kTool | kFigure, true,
     "straight way of the tip through the places where phases ended, over its path"},
    {Metric::MeanSpeed, "mean_speed_mm_s", kTool | kFigure, true, "path of the tip over the time"},
    {Metric::PeakSpeed, "peak_speed_mm_s", kTool | kFigure, true, "greatest speed of the tip without tremor"},
    {Metric::Rest, "rest_percent", kTool | kFigure, true,
     "part of the time with the tip slower than 5 mm/s, without tremor"},
    {Metric::RmsJerk, "rms_jerk_m_s3", kTool | kFigure, true,
     "root mean square of the tip's jerk, without tremor"},
    {Metric::Sparc, "sparc", kTool | kFigure, true,
     "smoothness by the spectrum of the speed (SPARC): nearer to zero is smoother"},
    {Metric::Ldlj, "ldlj", kTool | kFigure, true,
     "smoothness by the jerk (log dimensionless jerk): nearer to zero is smoother"},
    {Metric::Bimanual, "bimanual_percent", kFigure, true,
     "time in which both hands move over the time in which one does"},
    {Metric::PathRatio, "path_ratio_percent", kFigure, true,
     "the shorter path of both hands over the longer"},
}};
const MetricInfo& infoOf(Metric metric);
/// "mm/s" of "peak_speed_mm_s"; empty where it has none.
std::string unitOf(const MetricInfo& info);

/// A place that tools, clips and cuts are measured against.
struct Mark {
  std::string name;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< m, world, in the scene as it is loaded
  std::string object;                            ///< that it moves with; empty: it stands
  bool middle = false;                           ///< of the object, in place of `at`
  double radius = 0.002;                         ///< m: of a region on tissue
};

/// A number of the exercise: a metric, and of what.
struct Number {
  Metric metric = Metric::Time;
  int tool = -1;             ///< tools::Instrument
  std::string object, role;  ///< at most one of them
  std::vector<std::string> marks;
};

/// Tree of conditions, judged after each step since its phase began (of gates and errors: since the start; of
/// a phase's start: since the one before it ended).
struct Condition {
  enum class Kind : std::uint8_t {
    Event,   ///< at least `count` such events happened
    Number,  ///< the number lies within [low, high]
    Any,
    All,
    Not,     ///< of its only child
    For,     ///< the child held for `seconds` without a break
    Within,  ///< the child held at a moment not later than `seconds` after the beginning
    Before,  ///< the first child held while the second had not yet; stays true
  };
  Kind kind = Kind::All;
  scene::EventKind event = scene::EventKind::Grasped;
  int tool = -1;                                  ///< of events; -1: any
  std::string object, role;                       ///< of events; both empty: any
  double station_low = -1e9, station_high = 1e9;  ///< m
  std::uint32_t count = 1;
  Number number;
  double low = -1e300, high = 1e300;  ///< unit of the metric
  double seconds = 0;
  std::vector<Condition> children;
};

struct Phase {
  std::string name, instruction, hint;
  std::optional<Condition> start;  ///< without: it starts when the one before it ended
  std::string wait;                ///< what is said until it starts; empty: the instruction
  Condition end;
  double hint_after = 0;  ///< s
  bool required = true;
};

/// What must hold at the end, or must never happen; else the exercise is failed, with its text as the reason.
struct Gate {
  std::string name, text;
  Condition condition;
  bool never = false;
};

/// Costs points (s) each time that its condition becomes true.
struct Error {
  std::string name, text;
  Condition when;
  double points = 0;  ///< s
  std::uint32_t most = 1;
};

struct Item {
  std::string name, phase, source;
  Number number;
  bool higher_is_better = false;
  double weight = 1, proficient = 0, pass = 0;  ///< unit of the metric
};

struct Script {
  std::string file;
  std::string reason;  ///< of one that fails: name of the phase, gate or item it fails by
};

struct Exercise {
  std::string name, title, aim, scene;
  std::string file, hash;  ///< XXH64 of the file's text, 16 hexadecimal digits
  double limit = 0;        ///< s
  double proficient = 0;   ///< s: who does it faster without errors has 100 points
  double least = 0;        ///< s: faster than this nobody is
  double optic = 30;       ///< degrees, of the endoscope that the exercise is done with
  /// What each hand begins with, and then what the tool pedal hands to the right one.
  std::array<std::vector<tools::ToolKind>, 3> tools;
  std::vector<Mark> marks;
  std::vector<Phase> phases;
  std::vector<Gate> gates;
  std::vector<Error> errors;
  std::vector<Item> items;
  Script pass_script;
  std::vector<Script> fail_scripts;
};

/// Reads a file strictly: unknown and doubled keys, numbers out of range, unknown names are errors.
/// @throws std::invalid_argument: file, line, field, value, what is allowed
Exercise loadExercise(const std::string& path);
/// The same of a text; `path` names it in messages.
Exercise parseExercise(const std::string& path, const std::string& text);
/// Whether users gave an exercise as the path of its file, not as a name: it has a slash, or ends in .yaml.
bool isExerciseFile(const std::string& given);

}  // namespace vest::exercise
