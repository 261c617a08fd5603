#include "vest_tissue/volume/phantom.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "vest_instruments/files/read.h"

namespace vest::volume {
namespace {

using Eigen::Vector3d;

constexpr std::int16_t kAir = -1000, kFat = -100, kWater = 0, kMuscle = 55, kBrain = 35, kSpongy = 250,
                       kBone = 1000, kSkin = 40, kLigament = 110;

Phantom head() {
  const auto e = Shape::Ellipsoid;
  return {"head",
          {-0.10, -0.12, -0.08},
          {0.10, 0.12, 0.08},
          {{e, {0, 0, -0.01}, {0.080, 0.100, 0.110}, kMuscle, 1},
           {e, {0, 0, -0.01}, {0.074, 0.094, 0.104}, kBone, 2},
           {e, {0, 0, -0.01}, {0.067, 0.087, 0.097}, kBrain, 3},
           {e, {-0.012, 0, 0.01}, {0.006, 0.030, 0.012}, kWater, 4},
           {e, {0.012, 0, 0.01}, {0.006, 0.030, 0.012}, kWater, 4},
           {e, {0, -0.082, -0.06}, {0.018, 0.009, 0.012}, kAir, 0}},
          {"skin", "skull", "brain", "ventricles"}};
}

Phantom lumbar() {
  Phantom p{"lumbar",
            {-0.16, -0.11, -0.07},
            {0.16, 0.11, 0.07},
            {{Shape::Cylinder, {0, 0, 0}, {0.150, 0.100, 0.2}, kSkin, 6},
             {Shape::Cylinder, {0, 0, 0}, {0.148, 0.098, 0.2}, kFat, 1},
             {Shape::Cylinder, {0, 0.010, 0}, {0.130, 0.078, 0.2}, kMuscle, 2}},
            {"fat", "muscle", "vertebra", "disc", "canal", "skin", "ligament"}};
  for (int level = -2; level <= 2; ++level) {  // bodies 27 mm high, discs 10 mm
    const double z = 0.037 * level;
    p.shapes.push_back({Shape::Cylinder, {0, 0.015, z}, {0.024, 0.017, 0.0135}, kSpongy, 3});
    p.shapes.push_back({Shape::Cylinder, {0, 0.015, z + 0.0185}, {0.024, 0.017, 0.005}, 90, 4});
    p.shapes.push_back({Shape::Box, {0, 0.055, z}, {0.003, 0.015, 0.010}, kSpongy, 3});
    p.shapes.push_back({Shape::Box, {0, 0.041, z}, {0.020, 0.011, 0.010}, kSpongy, 3});
    // The yellow ligament, 4 mm thick, between one arch and the next.
    p.shapes.push_back({Shape::Box, {0, 0.051, z + 0.0185}, {0.012, 0.002, 0.0085}, kLigament, 7});
  }
  p.shapes.push_back({Shape::Cylinder, {0, 0.041, 0}, {0.009, 0.008, 0.2}, 10, 5});
  return p;
}

Phantom abdomen() {
  const auto e = Shape::Ellipsoid;
  return {"abdomen",
          {-0.17, -0.12, -0.08},
          {0.17, 0.12, 0.08},
          {{Shape::Cylinder, {0, 0, 0}, {0.160, 0.110, 0.2}, kFat, 1},
           {Shape::Cylinder, {0, 0.055, 0}, {0.024, 0.020, 0.2}, kSpongy, 2},
           {e, {-0.075, -0.020, 0.015}, {0.065, 0.060, 0.050}, 60, 3},
           {e, {-0.050, -0.058, -0.030}, {0.0175, 0.0175, 0.045}, 10, 4},
           {e, {-0.065, 0.060, -0.030}, {0.025, 0.020, 0.045}, 35, 5},
           {e, {0.065, 0.060, -0.025}, {0.025, 0.020, 0.045}, 35, 5},
           {Shape::Cylinder, {0.012, 0.023, 0}, {0.010, 0.010, 0.2}, 45, 6}},
          {"fat", "vertebra", "liver", "gallbladder", "kidney", "aorta"}};
}

/// SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): a random number of a voxel, whatever the order.
std::uint64_t mixed(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

}  // namespace

// Sum of four even numbers of 16 bits.
double nearlyGaussian(std::uint64_t seed, std::uint64_t index) {
  const std::uint64_t r = mixed(seed * 0x2545f4914f6cdd1dull + 0x9e3779b97f4a7c15ull * (index + 1));
  const double sum =
      static_cast<double>((r & 0xffff) + ((r >> 16) & 0xffff) + ((r >> 32) & 0xffff) + (r >> 48));
  return (sum / 65535.0 - 2.0) * std::sqrt(3.0);
}

bool Shape::holds(const Vector3d& place) const {
  const Vector3d d = (place - centre).cwiseQuotient(half);
  if (kind == Ellipsoid) return d.squaredNorm() <= 1;
  if (kind == Box) return d.cwiseAbs().maxCoeff() <= 1;
  return d.head<2>().squaredNorm() <= 1 && std::abs(d[2]) <= 1;
}

double Shape::volume() const {
  return half.prod() * (kind == Ellipsoid ? 4 * M_PI / 3 : kind == Box ? 8 : 2 * M_PI);
}

const Shape* Phantom::at(const Vector3d& place) const {
  const auto found =
      std::find_if(shapes.rbegin(), shapes.rend(), [&](const Shape& s) { return s.holds(place); });
  return found == shapes.rend() ? nullptr : &*found;
}

Phantom makePhantom(const std::string& name) {
  for (const auto make : {head, lumbar, abdomen}) {
    Phantom phantom = make();
    if (phantom.name == name) return phantom;
  }
  throw std::invalid_argument("phantom \"" + files::shown(name) + "\": head, lumbar and abdomen are there");
}

Brick picture(const Phantom& phantom, const PhantomBlock& block) {
  Brick brick;
  brick.unit = "HU";
  brick.axes = block.spacing * block.turn;
  Vector3d first;
  for (int a = 0; a < 3; ++a) {
    const double voxels = std::round((block.high[a] - block.low[a]) / block.spacing);
    if (!(voxels >= 1 && voxels <= 1024))
      throw std::invalid_argument("a phantom's block must have 1 to 1024 voxels along each axis");
    brick.size[a] = static_cast<std::uint32_t>(voxels);
    first[a] = 0.5 * (block.low[a] + block.high[a] - block.spacing * (voxels - 1));
  }
  brick.origin = block.shift + block.turn * first;
  brick.stored.resize(brick.voxels());
  std::size_t v = 0;
  for (std::uint32_t k = 0; k < brick.size[2]; ++k)
    for (std::uint32_t j = 0; j < brick.size[1]; ++j)
      for (std::uint32_t i = 0; i < brick.size[0]; ++i, ++v) {
        const Shape* const shape = phantom.at(first + block.spacing * Vector3d(i, j, k));
        const double noise = block.noise > 0 ? block.noise * nearlyGaussian(block.seed, v) : 0;
        brick.stored[v] = static_cast<std::int16_t>(
            std::clamp(std::nearbyint((shape == nullptr ? kAir : shape->value) + noise), -1024.0, 3071.0));
      }
  return brick;
}

}  // namespace vest::volume
