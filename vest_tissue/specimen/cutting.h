#pragma once

#include <algorithm>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <vector>

#include "vest_tissue/fem/cut_factor.h"
#include "vest_tissue/fem/tissue_cut.h"

namespace vest::fem::specimen {

/// A tissue whose state has room for cuts, and steps of it under gravity.
struct Cutting {
  std::shared_ptr<TissueModel> model;
  TissueState state;
  TissueScratch scratch;
  double h = 0.001;
  std::vector<float> held[3];
  Cutting(const Description& d, std::size_t room = 200) {
    model = makeTissue(d, d.motion, "");
    prepareTissue(*model, h);
    state = tissueAtRest(*model, d.nodes);
    const std::size_t most = d.nodes.size() + room;
    state.x.reserve(most), state.v.reserve(most), state.mass.reserve(most);
    state.origin.reserve(most), state.knot_element.reserve(most);
    scratch = TissueScratch(*model, most);
    for (auto& row : held) row.assign(most, 0.0f);
  }
  /// Opens all faces between elements whose centres lie on two sides of a place along an axis.
  std::vector<Doubling> cutAt(int axis, double place,
                              const std::function<bool(const Eigen::Vector3d&)>& where) {
    std::vector<Index> knots;
    const auto centre = [&](std::size_t e) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (const Index k : state.corner[e]) sum += 0.25 * state.x[k];
      return sum;
    };
    for (std::uint32_t e = 0; e < state.corner.size(); ++e) {
      for (int f = 0; f < 4; ++f) {
        const std::uint32_t other = model->neighbours[e][static_cast<std::size_t>(f)];
        if (other == kNoSlot || other < e) continue;
        const Eigen::Vector3d p = centre(e), q = centre(other);
        if ((p[axis] < place) == (q[axis] < place) || !where(0.5 * (p + q))) continue;
        check(openFace(*model, state, faceCode(e, f)));
        for (const Index k : faceKnots(state, faceCode(e, f)))
          if (std::find(knots.begin(), knots.end(), k) == knots.end()) knots.push_back(k);
      }
    }
    std::vector<Doubling> out;
    out.reserve(500);
    check(divideKnots(*model, state, knots, out));
    return out;
  }
  void step(const Eigen::Vector3d& gravity) {
    const bool inertia = model->motion == Motion::BackwardEuler;  // the others know it themselves
    for (std::size_t k = 0; k < state.x.size(); ++k)
      for (int a = 0; a < 3; ++a)
        held[a][k] = inertia ? static_cast<float>(state.mass[k] * gravity[a]) : 0.0f;
    scratch.points.clear();
    check(
        freeTissueStep(*model, state, h, {held[0].data(), held[1].data(), held[2].data()}, gravity, scratch));
    check(endTissueStep(*model, state, h, scratch));
  }
  static void check(bool good) {
    if (!good) throw std::runtime_error("the tissue refused a cut or a step");
  }
  double mass() const { return std::accumulate(state.mass.begin(), state.mass.end(), 0.0); }
  std::uint32_t parts() const {
    std::vector<std::uint32_t> root(state.corner.size());
    return tissueParts(*model, state, root);
  }
};

/// Largest difference between the answers of a cut object and of a fresh model of the cut mesh at the points
/// of `c`, over the largest answer.
inline double answerError(Cutting& c, Cutting& fresh, double h) {
  fresh.scratch.points = c.scratch.points;
  answerPoints(*c.model, c.state, h, c.scratch);
  answerPoints(*fresh.model, fresh.state, h, fresh.scratch);
  double error = 0.0, size = 0.0;
  for (std::size_t p = 0; p < c.scratch.points.size(); ++p) {
    for (std::size_t q = 0; q < c.scratch.points.size(); ++q) {
      const auto& is = c.scratch.answers[p * kMostTissuePoints + q];
      const auto& should = fresh.scratch.answers[p * kMostTissuePoints + q];
      error = std::max(error, (is - should).norm());
      size = std::max(size, should.norm());
    }
  }
  return error / size;
}

}  // namespace vest::fem::specimen
