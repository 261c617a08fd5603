#include "vest_haptics/trial/specimen.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vest_haptics/device/simulated.h"
#include "vest_haptics/trial/trial.h"

namespace vest::haptics {
namespace {

using scene::Index;

constexpr double kTop = 0.055;  // m

/// A box of knots, x fastest.
struct Grid {
  Index nx, ny, nz;
  double spacing;  ///< m, in x and y
  double rise;     ///< m, in z
  Index at(Index x, Index y, Index z) const { return x + nx * (y + ny * z); }
};

scene::Object knots(const Grid& g, const material::Tissue& tissue) {
  scene::Object o;
  o.name = "specimen";
  o.organ = o.material = tissue.name;
  o.law = tissue.law();
  o.density = tissue.at("density").value;
  o.friction = 0.1;
  for (Index z = 0; z < g.nz; ++z) {
    for (Index y = 0; y < g.ny; ++y) {
      for (Index x = 0; x < g.nx; ++x) {
        o.position.push_back({g.spacing * (x - 0.5 * (g.nx - 1)), g.spacing * (y - 0.5 * (g.ny - 1)),
                              kTop - g.rise * (g.nz - 1 - z)});
        // Edges belong to fewer cells.
        const auto share = [](Index i, Index n) { return i == 0 || i + 1 == n ? 0.5 : 1.0; };
        const double m =
            o.density * g.spacing * g.spacing * g.rise * share(x, g.nx) * share(y, g.ny) * share(z, g.nz);
        o.mass.push_back(m);
        o.damping.push_back(20.0 * m);  // 1/s, assumed: at rest within a moment
        o.fixed.push_back(z == 0);
      }
    }
  }
  o.rest_position = o.position;
  return o;
}

void link(scene::Object& o, Index a, Index b, double area) {
  scene::Link l;
  l.knot0 = a;
  l.knot1 = b;
  l.rest = (o.position[a] - o.position[b]).norm();
  l.area = area;
  // A tenth of what would stop the pair's own oscillation, as baked scenes have it.
  const double k = o.law.youngs_modulus * area / l.rest, m = 0.5 * (o.mass[a] + o.mass[b]);
  l.damping = 0.1 * std::sqrt(k * m);
  o.links.push_back(l);
}

void face(scene::Object& o, Index a, Index b, Index c, Index d) {
  o.contact_triangles.push_back({a, b, c});
  o.contact_triangles.push_back({a, c, d});
}

scene::Description described(scene::Object o) {
  scene::Description d;
  d.name = "specimen";
  d.gravity.setZero();
  d.objects.push_back(std::move(o));
  return d;
}

}  // namespace

scene::Description pressedSlab(const material::Tissue& tissue) {
  const Grid g{21, 21, 6, 0.003, 0.003};
  scene::Object o = knots(g, tissue);
  const double side = g.spacing * g.spacing;
  for (Index z = 0; z < g.nz; ++z) {
    for (Index y = 0; y < g.ny; ++y) {
      for (Index x = 0; x < g.nx; ++x) {
        const Index here = g.at(x, y, z);
        const bool right = x + 1 < g.nx, back = y + 1 < g.ny, up = z + 1 < g.nz;
        if (right) link(o, here, g.at(x + 1, y, z), side);
        if (back) link(o, here, g.at(x, y + 1, z), side);
        if (up) link(o, here, g.at(x, y, z + 1), side);
        // Both diagonals of each face of a cell carry shear.
        const auto cross = [&](bool inside, Index b, Index c, Index d) {
          if (!inside) return;
          link(o, here, d, 0.5 * side);
          link(o, b, c, 0.5 * side);
        };
        cross(right && back, g.at(x + 1, y, z), g.at(x, y + 1, z), g.at(x + 1, y + 1, z));
        cross(right && up, g.at(x + 1, y, z), g.at(x, y, z + 1), g.at(x + 1, y, z + 1));
        cross(back && up, g.at(x, y + 1, z), g.at(x, y, z + 1), g.at(x, y + 1, z + 1));
        if (right && back && z + 1 == g.nz)
          face(o, here, g.at(x + 1, y, z), g.at(x + 1, y + 1, z), g.at(x, y + 1, z));
      }
    }
  }
  return described(std::move(o));
}

scene::Description pulledStrip(const material::Tissue& tissue) {
  const Grid g{3, 3, 16, 0.002, kStripLength / 15};
  scene::Object o = knots(g, tissue);
  const auto share = [](Index i) { return i == 1 ? 0.5 : 0.25; };
  for (Index z = 0; z < g.nz; ++z) {
    for (Index y = 0; y < g.ny; ++y) {
      for (Index x = 0; x < g.nx; ++x) {
        const Index here = g.at(x, y, z);
        // Along the strip: shares of the cross section. Across: only what keeps the strip in shape.
        if (z + 1 < g.nz) link(o, here, g.at(x, y, z + 1), kStripArea * share(x) * share(y));
        if (x + 1 < g.nx) link(o, here, g.at(x + 1, y, z), 0.25 * kStripArea);
        if (y + 1 < g.ny) link(o, here, g.at(x, y + 1, z), 0.25 * kStripArea);
      }
    }
  }
  for (Index z = 0; z + 1 < g.nz; ++z) {
    for (Index i = 0; i < 2; ++i) {
      face(o, g.at(i, 0, z), g.at(i + 1, 0, z), g.at(i + 1, 0, z + 1), g.at(i, 0, z + 1));
      face(o, g.at(i + 1, 2, z), g.at(i, 2, z), g.at(i, 2, z + 1), g.at(i + 1, 2, z + 1));
      face(o, g.at(0, i + 1, z), g.at(0, i, z), g.at(0, i, z + 1), g.at(0, i + 1, z + 1));
      face(o, g.at(2, i, z), g.at(2, i + 1, z), g.at(2, i + 1, z + 1), g.at(2, i, z + 1));
    }
  }
  for (Index y = 0; y < 2; ++y) {
    for (Index x = 0; x < 2; ++x)
      face(o, g.at(x, y, g.nz - 1), g.at(x + 1, y, g.nz - 1), g.at(x + 1, y + 1, g.nz - 1),
           g.at(x, y + 1, g.nz - 1));
  }
  return described(std::move(o));
}

namespace {

/// A hand above the specimen that holds its handle firmly, with a grasper straight down.
struct Hand {
  SimulatedDevice device;
  scene::World world;
  std::unique_ptr<Trial> trial;
  std::int64_t now = 0;
  double jaw;
  TrialSample last;

  Hand(const scene::Description& description, double start, double jaw_) : world(description), jaw(jaw_) {
    device.open({{"maximum_force", "8"}});
    device.axis(2).hand_stiffness = 2000.0;
    ControllerOptions options;
    options.arm.present = true;
    options.arm.pivot_B = {0.0, 0.0, 0.165};
    options.arm.aim_B = {0.0, 0.0, kTop + start};
    options.arm.X_BTrocar = kinematics::trocarFrame(options.arm.pivot_B, options.arm.aim_B);
    trial = std::make_unique<Trial>(world, tools::ToolKind::Grasper, device, options);
    for (int i = 0; i < 2200; ++i) tick();  // through the ramp, in the air
  }
  void tick() { last = trial->tick(now += 1000000, jaw); }
  /// To a height above the start, m, and rest there.
  void go(double height, int milliseconds) {
    const double from = device.axis(2).x;
    for (int i = 1; i <= milliseconds; ++i) {
      device.wish(2, from + (height - from) * std::min(1.0, 1.5 * i / milliseconds));
      tick();
    }
  }
};

}  // namespace

std::vector<Felt> press(const material::Tissue& tissue) {
  const scene::Description slab = pressedSlab(tissue);
  Hand hand(slab, 0.003, 0.0);
  const std::size_t middle = slab.objects[0].position.size() - 21 * 21 / 2 - 1;  // under the tip
  const double height = slab.objects[0].position[middle].z() - slab.objects[0].position[0].z();
  std::vector<Felt> felt;
  for (double h = -0.0025; h > -0.0052; h -= 0.0005) {
    hand.go(h, 300);
    Felt f;
    f.depth = slab.objects[0].position[middle].z() - hand.world.knotAt(0, middle).z();
    f.strain = -f.depth / height;
    f.shown = hand.last.shown.z();
    f.law = kPressShape * tissue.law().youngs_modulus * f.depth;
    if (hand.last.contact && f.depth > 2e-4) felt.push_back(f);
  }
  return felt;
}

std::vector<Felt> pull(const material::Tissue& tissue) {
  const scene::Description strip = pulledStrip(tissue);
  Hand hand(strip, 0.010, 0.9);
  hand.go(-0.014, 900);
  while (hand.jaw > 0.0) {
    hand.jaw = std::max(0.0, hand.jaw - 0.0025);
    hand.tick();
  }
  std::vector<Felt> felt;
  const std::size_t ring = 9, layers = strip.objects[0].position.size() / ring, middle = layers / 2;
  const double rest = kStripLength * static_cast<double>(middle) / static_cast<double>(layers - 1);
  for (double h = -0.014; h < 0.0045; h += 0.001) {
    hand.go(h, 400);
    double rise = 0.0;
    for (std::size_t k = middle * ring; k < (middle + 1) * ring; ++k)
      rise += (hand.world.knotAt(0, k).z() - strip.objects[0].position[k].z()) / static_cast<double>(ring);
    Felt f;
    f.strain = rise / rest;
    f.depth = -f.strain * kStripLength;
    f.shown = hand.last.shown.z();
    f.law = -kStripArea * material::stress(tissue.law(), f.strain);
    if (hand.last.grasping && f.strain > 0.01) felt.push_back(f);
  }
  return felt;
}

}  // namespace vest::haptics
