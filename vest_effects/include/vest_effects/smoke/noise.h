#pragma once

namespace vest::smoke {

/// Improved noise (Perlin 2002, doi:10.1145/566654.566636): gradient noise on the integer lattice with the
/// fade 6t⁵ − 15t⁴ + 10t³ and twelve gradients, in the published permutation. The same values to the last bit
/// as the reference program in double precision. About −1 … 1, 0 at lattice points, no unit.
double noise(double x, double y, double z);

/// The same with the lattice repeated every `period` units (a power of two up to 256); equal to noise() at
/// 256.
double periodicNoise(double x, double y, double z, int period);

/// Turbulence: sum of |noise(2^k x)|/2^k over the octaves (Perlin 1985, doi:10.1145/325165.325247), periodic.
double turbulence(double x, double y, double z, int octaves, int period);

}  // namespace vest::smoke
