#pragma once

#include <string>

#include "vest_tissue/scene/description.h"

/// Baked nets: one object's knots, springs, skin and tube map in one binary file (docs/scene_format.md).
namespace vest::scene {

/// Geometry of an object as bytes: everything in Object but name, organ, material, roles, law, density,
/// friction.
std::string encodeBaked(const Object& object);

/// @param bytes of the file `file` @param object gets the geometry
/// @throws std::invalid_argument: file, section, index, value, what is allowed
void decodeBaked(const std::string& bytes, const std::string& file, Object& object);

/// What every object must obey, wherever it was read from: finite numbers, mass > 0, links that exist and are
/// there once, one piece, bindings whose weights sum to 1. @throws std::invalid_argument: file, field with
/// index, value, what is allowed
void checkObject(const Object& object, const std::string& file);

/// Spacing of the grid on which the walls of a rigid object are felt, m: 2 mm, or a 160th of its size where
/// that is more (tuned).
double wallSpacing(const Object& rigid);
/// kMostKnots, kMostLinks, kMostTriangles. @throws std::invalid_argument as checkTogether
void checkCounts(const Description& description, const std::string& file);
/// What all objects must obey together: counts, and in a World gravity, and walls that are felt no more
/// coarsely than all that moves is wide. @throws std::invalid_argument: file, object, value, what is allowed
void checkTogether(const Description& description, const std::string& file);

/// Number of pieces that the elastic links leave (1 for an object in one piece).
std::size_t countPieces(const Object& object);

/// Knots that appear in no binding of the skin.
std::size_t countUnboundKnots(const Object& object);

/// Pairs of knots that more than one link of the same kind joins.
std::size_t countDuplicateLinks(const Object& object);

inline constexpr double kFarthest = 5e5;  ///< of a coordinate: beyond 1e6 a World's step is a FAULT
/// bytes of an object's net, and of all: what a scene's reader takes of side files, with room for the others.
inline constexpr std::size_t kMostBaked = 64u << 20, kMostBakedOfAll = 120u << 20;
/// Of a scene's objects together: a World of them takes some 500 MB, and seconds to build (assumed).
inline constexpr std::size_t kMostKnots = 131072, kMostLinks = 524288, kMostTriangles = 262144;
inline constexpr double kGreatest =
    1e30;  ///< of stiffness, damping, force: single precision holds their products

/// 64 bits as 16 hexadecimal digits.
std::string digits(std::uint64_t hash);
/// XXH64 of bytes as 16 hexadecimal digits.
std::string hashText(const std::string& bytes);

}  // namespace vest::scene
