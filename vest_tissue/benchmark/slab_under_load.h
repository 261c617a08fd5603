#pragma once

#include <stdexcept>
#include <vector>

#include "../test/fem/beam.h"
#include "vest_tissue/fem/condensed.h"

namespace vest::bench {

/// FFEM at 2,460 surface unknowns: 30 of them loaded, and a cut of rank 36.
class SlabUnderLoad {
 public:
  SlabUnderLoad()
      : model_(fem::test::makeBox({21, 9, 9, 0.105, 0.045, 0.045}), deep()),
        state_(model_),
        scratch_(model_) {
    for (std::uint32_t i = 0; i < 30; ++i) {
      load_.unknown.push_back(3 * (400 + 3 * (i / 3)) + i % 3);
      load_.force.push_back(0.01 * (i + 1));
    }
    held_ = load_;
    u_ = Eigen::VectorXd::Zero(model_.surfaceUnknowns());
    // Six elements side by side at the surface; they touch inner nodes too.
    const std::size_t cell = static_cast<std::size_t>((10 * 9 + 4) * 9 + 8) * 6;
    for (std::size_t k = 0; k < 6; ++k) blade_.push_back(cell + k);
  }
  const fem::CondensedModel& model() const { return model_; }
  void answer() {
    u_.setZero();
    addResponse(model_, state_, load_, scratch_, u_);
  }
  void prescribe() {
    if (!fem::prescribe(model_, state_, target_, u_, scratch_, held_))
      throw std::runtime_error("prescribe failed");
  }
  void makeWhole() { state_ = fem::CondensedState(model_); }
  /// Until the first answer after it. Returns the rank.
  int cut() {
    const fem::CutReport report = fem::cut(model_, state_, blade_);
    if (!report.done) throw std::runtime_error("cut failed");
    answer();
    return report.rank;
  }

 private:
  static fem::CondensedOptions deep() {
    fem::CondensedOptions o;
    o.outer = fem::Outer::Deep;
    return o;
  }
  fem::CondensedModel model_;
  fem::CondensedState state_;
  fem::CondensedScratch scratch_;
  fem::SparseLoad load_, held_;
  std::vector<double> target_ = std::vector<double>(30, 0.001);
  std::vector<std::size_t> blade_;
  Eigen::VectorXd u_;
};

}  // namespace vest::bench
