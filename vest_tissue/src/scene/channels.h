#pragma once

#include "stages.h"

/// Needles that are held, go into tissue, and lead their thread through it.
namespace vest::scene {

/// Where a place of a thread or needle is in respect of an object.
enum class Within : std::uint8_t {
  Outside = 0,  ///< it touches the surface
  Channel = 1,  ///< it is in a hole, or near its mouth: no touch
  Tissue = 2    ///< a tip that has gone in and not come out: it meets what lies ahead of it
};
Within withinOf(const Context& c, std::uint32_t place, std::uint16_t object);
/// Whether a place may lean on a face: a tip within tissue on what lies ahead, the length of a needle on what
/// is beside it. What lies across its way is met by its ends alone, so that the tip bears all that it
/// presses.
bool meets(const Context& c, std::uint32_t place, const Eigen::Vector3d& face, Within within);

/// A place on a needle or the thread behind it, by its distance from the tip.
struct Along {
  suture::Support at;     ///< segment, s, rigid, arm
  Eigen::Vector3d place;  ///< m
  Eigen::Vector3d back;   ///< direction from the tip
};
/// False: before the tip, behind the end, or where the thread is cut.
bool alongNeedle(const Context& c, std::uint32_t needle, double station, Along& out);

/// Supports of channels for a part of h (s), behind those on tissue; and what that part did to channels.
void leadChannels(Context& c, double h);
void settleChannels(Context& c);
/// After a step: punctures, exits, what is cut further, what tears.
void advanceChannels(Context& c);
/// Needles in jaws, for a part between two fractions of a step.
void holdNeedles(Context& c, double from, double to);

}  // namespace vest::scene
