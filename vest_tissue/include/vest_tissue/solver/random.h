#pragma once

#include <cstdint>

/// Counter-based random numbers: a number is a function of (seed, step, index) alone, so that threads may ask
/// in any order and a re-simulated session gets the same ones. Integers and exact scalings only: the same
/// bits everywhere.
namespace vest::solver {

/// Increment and finaliser of SplitMix64 (Steele, Lea, Flood 2014, doi:10.1145/2660193.2660195): a bijection
/// of 64 bits in which each bit of the input changes each bit of the output with probability near one half.
inline constexpr std::uint64_t kGoldenGamma = 0x9e3779b97f4a7c15ULL;
constexpr std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

/// 64 random bits. For fixed (seed, step) the index walks a SplitMix64 sequence; seed and step are mixed
/// before, so that sequences of neighbouring steps are not shifts of each other.
constexpr std::uint64_t randomBits(std::uint32_t seed, std::uint64_t step, std::uint64_t index) {
  const std::uint64_t start = mix64(mix64(seed + kGoldenGamma) ^ (step * kGoldenGamma));
  return mix64(start + (index + 1) * kGoldenGamma);
}

/// Uniform in 0 <= x < 1, a multiple of 2^-53.
constexpr double randomUniform(std::uint32_t seed, std::uint64_t step, std::uint64_t index) {
  return static_cast<double>(randomBits(seed, step, index) >> 11) * (1.0 / 9007199254740992.0);
}

/// Uniform in 0 … count-1 (count > 0); its bias is below count/2^32.
constexpr std::uint32_t randomBelow(std::uint32_t count, std::uint32_t seed, std::uint64_t step,
                                    std::uint64_t index) {
  return static_cast<std::uint32_t>(
      (static_cast<std::uint64_t>(count) * (randomBits(seed, step, index) >> 32)) >> 32);
}

}  // namespace vest::solver
