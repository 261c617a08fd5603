#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

/// Procedural textures of organs by turbulence, baked once and tiled over the skin.
/// Colours are tuned by eye so that lit pictures lie in the figures of vest_viz/docs/pictures.md.
namespace vest::texture {

using Colour = std::array<float, 3>;  ///< sRGB, 0 … 1

/// What an organ's surface looks like. Lengths in metres, the rest without unit.
struct Style {
  std::string organ;
  double tile = 0.04;  ///< m, edge of the square that repeats
  int span = 1;        ///< longest waves of mottling, film and fat per tile, over those of a small tile
  Colour base{0.7f, 0.4f, 0.35f};
  Colour second{0.6f, 0.3f, 0.28f};  ///< what the ground is mottled with
  float mottle = 0.5f;               ///< 0 … 1, how far towards `second`
  Colour artery{0.55f, 0.09f, 0.08f};
  Colour vein{0.34f, 0.07f, 0.12f};
  int vessel_trees = 5;          ///< per tile
  double vessel_width = 0.0006;  ///< m, at the root
  float vessel_strength = 0.8f;  ///< 0 … 1
  int capillaries = 40;          ///< short twigs per tile
  float fat = 0.0f;              ///< 0 … 1, share of the surface covered by fat lobules
  double relief = 0.0002;        ///< m, amplitude of the coarse relief
  double relief_length = 0.004;  ///< m, its longest wave
  float streak = 1.0f;           ///< >1: relief and mottling drawn out along u (fibres)
  double crypts = 0.0;           ///< m, depth of cell-like pits (ovary, mucosa)
  double weave = 0.0;            ///< m, from thread to thread of a cloth; 0: none
  float wet = 0.8f;              ///< 0 matt … 1 running wet
  float translucence = 0.3f;     ///< 0 … 1, how far light bleeds red through edges
};

/// Style for an organ word of the scene (uterus, tube, ovary, ligament, artery, vein, intestine, cavity,
/// liver, gallbladder, duct, areolar, omentum, bone, cartilage) or of a thing of a training box (board, peg,
/// rubber, gauze); any other word gets that of a pink serosa.
const Style& styleOf(const std::string& organ);
/// What a cut through an organ lays open.
const Style& insideOf(const std::string& organ);

/// Square RGBA pictures that tile without a seam, row 0 at v = 0.
struct Baked {
  int size = 0;
  double tile = 0;                   ///< m
  std::vector<std::uint8_t> albedo;  ///< RGB sRGB colour, A wetness
  std::vector<std::uint8_t>
      relief;  ///< R, G: slope dh/du, dh/dv coded 128 + 127·slope/kSlopeRange; B: 255 crest … 0 groove
};
constexpr float kSlopeRange = 1.0f;

/// @param size texels per edge, a power of two ≥ 16
Baked bake(const Style& style, int size, std::uint32_t seed);

/// Micro relief that every wet surface shares: it breaks the highlights up. RG slopes, B brightness 128 = 1.
Baked bakeMicro(int size, std::uint32_t seed);

/// Low-frequency tint at a place of the body, so that tiles do not show: factors around 1 per colour channel.
std::array<float, 3> tintAt(float x, float y, float z, const Style& style);

}  // namespace vest::texture
