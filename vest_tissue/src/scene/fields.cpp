#include <algorithm>
#include <cmath>

#include "stages.h"
#include "vest_tissue/scene/topology.h"
#include "world_impl.h"

namespace vest::scene {

using net::Block;

void World::strain(std::size_t object, float* per_knot) const {
  const ObjectState& s = impl_->state.objects.at(object);
  const ObjectConstants& o = impl_->model->objects.at(object);
  std::fill_n(per_knot, s.block.knots(), 0.0f);
  o.body->strain(o, s, per_knot);
}

void World::stress(std::size_t object, float* per_knot) const {
  const ObjectState& s = impl_->state.objects.at(object);
  const ObjectConstants& o = impl_->model->objects.at(object);
  std::fill_n(per_knot, s.block.knots(), 0.0f);
  o.body->stress(o, s, per_knot);
}

void World::field(std::size_t object, Field kind, float* per_knot) const {
  const ObjectState& s = impl_->state.objects.at(object);
  const std::size_t knots = s.block.knots();
  if (kind == Field::Strain) return strain(object, per_knot);
  if (kind == Field::Stress) return stress(object, per_knot);
  const float healthy = kind == Field::Temperature ? static_cast<float>(interaction::kBodyTemperature)
                        : kind == Field::Perfusion ? 1.0f
                                                   : 0.0f;
  if (!s.heat.touched) {
    std::fill_n(per_knot, knots, healthy);
    return;
  }
  for (std::size_t k = 0; k < knots; ++k) {
    const interaction::HeatColumn& c = s.heat.columns[k];
    switch (kind) {
      case Field::Temperature:
        per_knot[k] = static_cast<float>(interaction::kBodyTemperature + c.excess[0]);
        break;
      case Field::Damage:
        per_knot[k] = static_cast<float>(1.0 - (1.0 - c.surface) * (1.0 - c.crushed));
        break;
      case Field::Perfusion:
        per_knot[k] = static_cast<float>((1.0 - c.denatured) * (1.0 - c.crushed));
        break;
      default:
        per_knot[k] = static_cast<float>(c.charred);
    }
  }
}

interaction::HeatLedger World::heat() const {
  interaction::HeatLedger sum;
  const WorldState& state = impl_->state;
  for (std::size_t i = 0; i < state.objects.size(); ++i) {
    const ObjectState& s = state.objects[i];
    if (!s.heat.touched) continue;
    const interaction::HeatModel& model = impl_->model->objects[i].heat;
    sum.delivered += s.heat.ledger.delivered, sum.perfused += s.heat.ledger.perfused;
    sum.surface += s.heat.ledger.surface, sum.latent += s.heat.ledger.latent;
    for (std::uint32_t k = 0; k < s.block.knots(); ++k) {
      const std::size_t original = originalKnot(s.topology, model.shapes.size(), k);
      const auto& shape = model.shapes[std::min(original, model.shapes.size() - 1)];
      sum.stored +=
          interaction::storedHeat(s.heat.columns[k], shape, model.material, row(s, net::Block::kMass)[k]);
    }
  }
  return sum;
}

}  // namespace vest::scene
