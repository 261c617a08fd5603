#pragma once

#include <array>
#include <string>
#include <vector>

namespace vest::inspect {

using Colour = std::array<float, 3>;  ///< sRGB, 0 … 1

/// A value between 0 and 1 as a colour: dark blue, teal, green, yellow, brightening all the way, so that it
/// is read alike in grey and by colour-blind people. Colours are tuned by eye. NaN is grey.
Colour valueColour(float t);
/// A colour for a name (of an object, a material): the same name has the same colour everywhere.
Colour nameColour(const std::string& name);
/// Colour of a layer of TissueObject.triangle_layer.
Colour layerColour(unsigned layer);

/// Ticks of a scale from low to high: round numbers, at most `most`, all inside. Empty if low is not below
/// high or one of them is not finite.
std::vector<double> ticks(double low, double high, int most);

/// Round ends of a scale round values from low to high: whole steps of 1, 2 or 5 times a power of ten, two to
/// ten of them, so that it stays while the values move a little.
/// @param least the scale spans no less, so that rounding errors do not fill it; > 0
std::array<double, 2> fittedScale(double low, double high, double least);

}  // namespace vest::inspect
