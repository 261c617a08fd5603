#pragma once

#include <cmath>

#include "../test/suture/knots.h"
#include "measure.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"

namespace vest::bench {

/// Threads of 150 segments, polypropylene 3-0, in steps of 1 ms.
class ThreadUnderLoad {
 public:
  explicit ThreadUnderLoad(const suture::Description& d) : moving_(d) {}
  void step() { suture::step(moving_.model, moving_.state, moving_.scratch, 0.001); }
  void run(int steps) {
    for (int i = 0; i < steps; ++i) step();
  }
  int pressed() const {
    int n = 0;
    for (suture::Index k = 0; k < moving_.state.contact_count; ++k)
      n += moving_.state.contacts[k].force.squaredNorm() > 0.0;
    return n;
  }

 private:
  suture::test::Moving moving_;
};

inline suture::Section polypropylene() {
  suture::Section s = suture::solidSection(0.0001125, 900, 3e9, 0.4);
  s.friction = 0.2, s.strain_damping = 1e-4;
  return s;
}

/// Two turns, 40 segments, round a drum; 0.2 N at one end, the other is held and drawn from 0.4 s on.
inline suture::Description roundADrum() {
  using Eigen::Vector3d;
  constexpr double kSegment = 0.001, kAngle = 4.0 * suture::test::kPi, kDrum = 40 * kSegment / kAngle;
  suture::RodDescription rod = suture::test::straight(4);
  rod.section = polypropylene();
  rod.section.damping = 50.0;
  rod.nodes.clear();
  const double at = kDrum + 1.001 * rod.section.radius;
  for (int i = 55; i > 0; --i) rod.nodes.push_back({at, -kSegment * i, 0.0});
  for (int i = 0; i <= 40; ++i)
    rod.nodes.push_back({at * std::cos(kAngle * i / 40), at * std::sin(kAngle * i / 40), 5e-5 * i});
  for (int i = 1; i <= 55; ++i) rod.nodes.push_back({at, kSegment * i, 0.002});
  const Vector3d end = rod.nodes.front();
  rod.held = {{0, suture::Hold::Place, {{0.4, end, 0.0}, {0.6, end - Vector3d(0.0, 0.01, 0.0), 0.0}}}};
  rod.loads = {{150, {0.0, 0.2, 0.0}}};
  suture::Description d{Vector3d::Zero(), {rod}, {}};
  d.cylinders.push_back({"drum", Vector3d::Zero(), Vector3d::UnitZ(), kDrum, 0.2});
  return d;
}

/// An overhand knot whose ends are drawn apart by 40 mm each at 0.2 m/s.
inline suture::Description overhandDrawn() {
  suture::RodDescription rod = suture::test::overhand(150, 0.001, 0.13);
  rod.section = polypropylene();
  rod.section.damping = 2e4;
  const Eigen::Vector3d a = rod.nodes.front(), b = rod.nodes.back(),
                        by(a.x() < b.x() ? 0.04 : -0.04, 0.0, 0.0);
  rod.held = {{0, suture::Hold::Place, {{0.0, a, 0.0}, {0.2, a - by, 0.0}}},
              {150, suture::Hold::Place, {{0.0, b, 0.0}, {0.2, b + by, 0.0}}}};
  return {Eigen::Vector3d::Zero(), {rod}, {}};
}

/// µs that a thread of 150 segments in a spiral on the pad of a scene adds to a step of its World.
struct OnTissue {
  double falling = 0.0, still = 0.0;
  std::size_t touches = 0;
};
inline OnTissue threadOnTissue(const std::string& scene) {
  scene::Description with = scene::loadScene(scene);
  std::vector<Eigen::Vector3d> nodes;
  double angle = 0.0;
  for (int i = 0; i <= 150; ++i) {
    const double radius = 0.006 + 0.0035 * angle / (2.0 * suture::test::kPi);
    nodes.push_back(Eigen::Vector3d(radius * std::cos(angle), 0.03 + radius * std::sin(angle), 0.0725));
    angle += 0.001 / radius;
  }
  with.sutures[0].rod.nodes = nodes;
  with.sutures[0].rod.natural_shape = true;
  scene::Description without = with;
  without.sutures.clear();
  struct Room {
    scene::World world;
    scene::StepInput input;
    scene::StepReport report;
    explicit Room(const scene::Description& d) : world(d) {}
    void step() { input.step = world.steps(), world.step(input, report); }
    double cost(int steps) {
      return microseconds([this] { step(); }, steps, 1);
    }
  };
  Room a(with), b(without);
  OnTissue result;
  result.falling = a.cost(200) - b.cost(200);
  for (int i = 0; i < 400; ++i) a.step();
  result.still = a.cost(200) - b.cost(200);
  result.touches = a.world.state().threads.touches.size();
  return result;
}

}  // namespace vest::bench
