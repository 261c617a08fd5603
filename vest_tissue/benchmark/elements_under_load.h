#pragma once

#include "beam.h"
#include "cutting.h"

namespace vest::bench {

/// An elastostatic object of 2,430 unknowns in steps of 1 ms, as a World takes them: ten of its knots are
/// held by jaws, and a blade opens faces across its top.
class ElementsUnderLoad {
 public:
  ElementsUnderLoad() : cutting_(object()), whole_(cutting_.state) {
    for (fem::Index n = 0; n < whole_.x.size() && knots_.size() < 10; ++n) {
      const Eigen::Vector3d& p = whole_.x[n];
      if (p.z() > 0.0399 && std::fabs(p.x() - 0.03) < 0.011) knots_.push_back(n);
    }
  }
  Eigen::Index unknowns() const { return cutting_.model->answer.rows(); }
  double megabytes() const { return 8e-6 * static_cast<double>(cutting_.model->answer.size()); }
  void step() {
    auto& scratch = cutting_.scratch;
    scratch.points.clear();
    for (const fem::Index k : knots_) {
      fem::TissuePoint point;
      point.kind = 1;
      point.knots = {k, k, k}, point.weights = {1, 0, 0};
      point.target = whole_.x[k] + Eigen::Vector3d(0, 0, 0.002);
      point.stiffness = 500.0;
      scratch.points.push_back(point);
    }
    const std::array<const float*, 3> held{cutting_.held[0].data(), cutting_.held[1].data(),
                                           cutting_.held[2].data()};
    auto& c = cutting_;
    c.check(fem::freeTissueStep(*c.model, c.state, c.h, held, Eigen::Vector3d::Zero(), scratch));
    fem::solveTissuePoints(*c.model, c.state, c.h, scratch);
    c.check(fem::endTissueStep(*c.model, c.state, c.h, scratch));
  }
  void makeWhole() {
    cutting_.state = whole_;
    cutting_.state.x.reserve(whole_.x.size() + 200);
    cutting_.scratch.forget();
    step();
  }
  /// Until the end of the first step after it. Returns how many knots it doubled.
  std::size_t cut() {
    const auto doubled = cutting_.cutAt(0, 0.03, [](const Eigen::Vector3d& p) { return p.z() > 0.03; });
    fem::useFactor(cutting_.state);
    step();
    return doubled.size();
  }

 private:
  static fem::Description object() {
    fem::Description d = fem::specimen::makeBox({10, 8, 8, 0.06, 0.04, 0.04});
    d.motion = fem::Motion::Elastostatic;
    d.material = {8e3, 0.4, 1050.0, 1.0, 0.002};
    return d;
  }
  fem::specimen::Cutting cutting_;
  fem::TissueState whole_;
  std::vector<fem::Index> knots_;
};

}  // namespace vest::bench
