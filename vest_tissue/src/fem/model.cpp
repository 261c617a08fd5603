#include "vest_tissue/fem/model.h"

#include <stdexcept>

namespace vest::fem {
namespace {

std::array<Eigen::Vector3d, 4> corners(const Element& e, const std::vector<Eigen::Vector3d>& field) {
  return {field[e.nodes[0]], field[e.nodes[1]], field[e.nodes[2]], field[e.nodes[3]]};
}

Eigen::Matrix3d gradientAt(const Model& model, const Element& e, const std::vector<Eigen::Vector3d>& x) {
  std::array<Eigen::Vector3d, 4> u = corners(e, x);
  for (int a = 0; a < 4; ++a) u[a] -= model.description.nodes[e.nodes[a]];
  return displacementGradient(e, u);
}

/// Sums the corners' forces per node, always in the same order.
void gather(const Model& model, Scratch& scratch, std::vector<Eigen::Vector3d>& out) {
  auto sum = [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Eigen::Vector3d total = Eigen::Vector3d::Zero();
      for (std::size_t k = model.incidence_start[n]; k < model.incidence_start[n + 1]; ++k) {
        total += scratch.corner[model.incidence[k] / 4][model.incidence[k] % 4];
      }
      out[n] = total;
    }
  };
  scratch.workers.forRanges(out.size(), sum);
}

void clearCorners(std::array<Eigen::Vector3d, 4>& corner) {
  for (auto& f : corner) f.setZero();
}

}  // namespace

Scratch::Scratch(const Model& model, int threads)
    : rotation(model.elements.size(), Eigen::Matrix3d::Identity()),
      corner(model.elements.size()),
      force(model.mass.size(), Eigen::Vector3d::Zero()),
      force2(force),
      v_next(force),
      element_energy(model.elements.size(), 0.0),
      matrix(model.matrix),
      rhs(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * model.free_node.size()))),
      workers(threads) {}

std::unique_ptr<const Model> buildModel(const Description& d, Use use) {
  validate(d, use);
  auto model = std::make_unique<Model>();
  model->description = d;
  const std::size_t nodes = d.nodes.size();
  model->mass.assign(nodes, 0.0);
  model->load.assign(nodes, Eigen::Vector3d::Zero());
  model->held_at = d.nodes;
  std::vector<std::size_t> count(nodes, 0);
  for (const auto& t : d.tetrahedra) {
    model->elements.push_back(makeElement(t, {d.nodes[t[0]], d.nodes[t[1]], d.nodes[t[2]], d.nodes[t[3]]}));
    const Material& material = d.materialOf(model->elements.size() - 1);
    model->laws.push_back(lame(material));
    for (Index n : t) {
      model->mass[n] += material.density * model->elements.back().volume / 4.0;
      ++count[n];
    }
  }
  for (const Load& l : d.loads) model->load[l.node] += l.force;
  // Unknowns.
  std::vector<std::uint8_t> held(nodes, 0);
  for (Index n : d.fixed) held[n] = 1;
  for (const Prescribed& p : d.prescribed) {
    held[p.node] = 1;
    model->held_at[p.node] += p.displacement;
  }
  model->unknown.assign(nodes, -1);
  for (Index n = 0; n < nodes; ++n) {
    if (held[n] != 0 || count[n] == 0) continue;
    model->unknown[n] = static_cast<std::int32_t>(model->free_node.size());
    model->free_node.push_back(n);
  }
  // Incidence, in element order.
  model->incidence_start.assign(1, 0);
  for (std::size_t c : count) model->incidence_start.push_back(model->incidence_start.back() + c);
  model->incidence.resize(model->incidence_start.back());
  std::vector<std::size_t> next(model->incidence_start.begin(), model->incidence_start.end() - 1);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t e = 0; e < model->elements.size(); ++e) {
    for (std::uint32_t a = 0; a < 4; ++a) {
      const Index n = d.tetrahedra[e][a];
      model->incidence[next[n]++] = 4 * e + a;
      for (std::uint32_t b = a + 1; b < 4; ++b) {
        const std::int32_t i = model->unknown[n], j = model->unknown[d.tetrahedra[e][b]];
        if (i >= 0 && j >= 0)
          pairs.emplace_back(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
      }
    }
  }
  try {
    model->matrix = BlockLdlt(model->free_node.size(), pairs);
  } catch (const std::length_error& error) {
    throw std::invalid_argument("object '" + d.name + "': " + error.what());
  }
  model->slots.resize(model->elements.size());
  for (std::size_t e = 0; e < model->elements.size(); ++e) {
    for (std::size_t k = 0; k < kPairs.size(); ++k) {
      const std::int32_t i = model->unknown[d.tetrahedra[e][static_cast<std::size_t>(kPairs[k][0])]];
      const std::int32_t j = model->unknown[d.tetrahedra[e][static_cast<std::size_t>(kPairs[k][1])]];
      if (i >= 0 && j >= 0) {
        model->slots[e][k] = model->matrix.slot(static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(j));
      } else {
        model->slots[e][k].index = kNoSlot;
      }
    }
  }
  return model;
}

State restState(const Model& model) {
  State state;
  state.x = model.held_at;
  state.v.assign(state.x.size(), Eigen::Vector3d::Zero());
  state.alive.assign(model.elements.size(), 1);
  return state;
}

void updateRotations(const Model& model, const State& state, Scratch& scratch) {
  if (model.description.strain == Strain::Small) return;
  auto turn = [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      if (state.alive[e] == 0) continue;
      scratch.rotation[e] =
          nearestRotation(gradientAt(model, model.elements[e], state.x) + Eigen::Matrix3d::Identity());
    }
  };
  scratch.workers.forRanges(model.elements.size(), turn);
}

void elasticForces(const Model& model, const State& state, Scratch& scratch) {
  auto evaluate = [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      if (state.alive[e] == 0) {
        clearCorners(scratch.corner[e]);
        continue;
      }
      const Eigen::Matrix3d& R = scratch.rotation[e];
      const Eigen::Matrix3d G = gradientAt(model, model.elements[e], state.x);
      const Eigen::Matrix3d A = R.transpose() * G + (R.transpose() - Eigen::Matrix3d::Identity());
      cornerForces(model.elements[e], model.laws[e], R, A, scratch.corner[e]);
    }
  };
  scratch.workers.forRanges(model.elements.size(), evaluate);
  gather(model, scratch, scratch.force);
}

void stiffnessTimes(const Model& model, const State& state, const std::vector<Eigen::Vector3d>& v,
                    Scratch& scratch) {
  auto evaluate = [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      if (state.alive[e] == 0) {
        clearCorners(scratch.corner[e]);
        continue;
      }
      const Eigen::Matrix3d& R = scratch.rotation[e];
      const Eigen::Matrix3d rate = displacementGradient(model.elements[e], corners(model.elements[e], v));
      cornerForces(model.elements[e], model.laws[e], R, R.transpose() * rate, scratch.corner[e]);
    }
  };
  scratch.workers.forRanges(model.elements.size(), evaluate);
  gather(model, scratch, scratch.force2);
}

double strainEnergy(const Model& model, const State& state, Scratch& scratch) {
  auto evaluate = [&](std::size_t begin, std::size_t end) {
    for (std::size_t e = begin; e < end; ++e) {
      scratch.element_energy[e] =
          state.alive[e] == 0 ? 0.0
                              : energy(model.elements[e], model.laws[e],
                                       gradientAt(model, model.elements[e], state.x), scratch.rotation[e]);
    }
  };
  scratch.workers.forRanges(model.elements.size(), evaluate);
  double sum = 0.0;
  for (double e : scratch.element_energy) sum += e;
  return sum;
}

void assemble(const Model& model, const State& state, double mass_factor, double stiffness_factor,
              Tangent tangent, Scratch& scratch) {
  scratch.factored_dt = 0.0;
  scratch.matrix.setZero();
  const bool turning = model.description.strain == Strain::Corotational && tangent != Tangent::Frozen;
  for (std::size_t e = 0; e < model.elements.size(); ++e) {
    if (state.alive[e] == 0) continue;
    const Element& element = model.elements[e];
    const Eigen::Matrix3d& R = scratch.rotation[e];
    Twist t;
    if (turning) {
      t = twist(element, model.laws[e], R, gradientAt(model, element, state.x) + Eigen::Matrix3d::Identity());
    }
    for (std::size_t k = 0; k < kPairs.size(); ++k) {
      const BlockLdlt::Slot& slot = model.slots[e][k];
      if (slot.index == kNoSlot) continue;
      const int a = kPairs[k][0], b = kPairs[k][1];
      Eigen::Matrix3d K = stiffnessBlock(element, model.laws[e], R, a, b);
      if (turning) {
        for (int m = 0; m < 3; ++m) {
          if (tangent == Tangent::Projected && t.kappa[m] < 0.0) continue;
          K += (element.volume * t.kappa[m]) * (t.b[m][a] * t.b[m][b].transpose());
        }
      }
      scratch.matrix.add(slot, stiffness_factor * K);
    }
  }
  if (mass_factor != 0.0) {
    for (std::uint32_t i = 0; i < model.free_node.size(); ++i) {
      scratch.matrix.add(model.matrix.slot(i, i),
                         (mass_factor * model.mass[model.free_node[i]]) * Eigen::Matrix3d::Identity());
    }
  }
}

}  // namespace vest::fem
