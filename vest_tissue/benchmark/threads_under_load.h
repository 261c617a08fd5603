#pragma once

#include <cmath>

#include "drum.h"
#include "knots.h"
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
  suture::specimen::Moving moving_;
};

/// An overhand knot whose ends are drawn apart by 40 mm each at 0.2 m/s.
inline suture::Description overhandDrawn() {
  suture::RodDescription rod = suture::specimen::overhand(150, 0.001, 0.13);
  rod.section = suture::specimen::polypropylene();
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
    const double radius = 0.006 + 0.0035 * angle / (2.0 * suture::specimen::kPi);
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
