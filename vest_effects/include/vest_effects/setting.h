#pragma once

#include <algorithm>

/// How a film of blood sets: by clotting, and by drying. One law for films on organs (bleeding/surface.h) and
/// on rigid ground (fluid/state.h).
namespace vest::effects {

/// s: a film sets; whole blood clots in a tube in 5 … 10 min (Lee and White 1913).
constexpr double kSettingTime = 400;
/// m: a film is drawn out no thinner than a red cell is thick (2.57 µm, Evans and Fung 1972).
constexpr double kThinFilm = 2.5e-6;
/// Share of blood's volume that can dry: plasma has 0.93 water, red cells 0.7 (assumed, for all of it
/// together).
constexpr double kWater = 0.8;

/// Share 0 fresh … 1 set of a film of that age (s). Its age counts from when the blood left its vessel, and
/// goes on by ageing().
inline float setShare(float age) {
  const float a = age / static_cast<float>(kSettingTime), a4 = a * a * a * a;
  return a4 / (1 + a4);
}

/// s by which a film ages in a second: 1 while it clots, and so much more that it is as old as two setting
/// times (94 % set) when its water has gone. So its thin rim dries first.
/// @param film m, its thickness  @param drying m/s of water that leaves a wet surface: gas::Condition::drying
inline double ageing(double film, double drying) {
  return 1 + 2 * kSettingTime * drying / (kWater * std::max(film, kThinFilm));
}

}  // namespace vest::effects
