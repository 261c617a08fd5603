// FFEM at 2,460 surface unknowns: a contact answer from 30 loaded unknowns, and a cut of rank 36 until its
// answer is usable. Targets: 10 µs and 5 ms (docs: performance). Times are medians of repeats on one thread.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "../test/fem/beam.h"
#include "vest_tissue/fem/condensed.h"

namespace {

using namespace vest::fem;

template <class F>
double medianMicroseconds(int repeats, F&& f) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    f();
    times.push_back(
        std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count());
  }
  std::nth_element(times.begin(), times.begin() + repeats / 2, times.end());
  return times[static_cast<std::size_t>(repeats / 2)];
}

}  // namespace

int main() {
  const test::Box box{21, 9, 9, 0.105, 0.045, 0.045};
  const Description d = test::makeBox(box);
  const auto begin = std::chrono::steady_clock::now();
  CondensedOptions options;
  options.outer = Outer::Deep;
  const CondensedModel model(d, options);
  const double build = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::printf("tetrahedra %zu, free nodes %zu, surface unknowns %td, kept for cuts %td\n",
              d.tetrahedra.size(), model.model().free_node.size(), model.surfaceUnknowns(), model.unknowns());
  std::printf("precomputation                          %10.2f s\n", build);

  CondensedState state(model);
  CondensedScratch scratch(model);
  SparseLoad load;
  for (std::uint32_t i = 0; i < 30; ++i) {
    load.unknown.push_back(3 * (400 + 3 * (i / 3)) + i % 3);
    load.force.push_back(0.01 * (i + 1));
  }
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.surfaceUnknowns());
  const double answer = medianMicroseconds(2001, [&] {
    u.setZero();
    addResponse(model, state, load, scratch, u);
  });
  std::printf("contact answer, 30 loaded unknowns      %10.2f us   target 10, ratio %.2f\n", answer,
              10.0 / answer);
  std::vector<double> target(30, 0.001);
  SparseLoad grasp = load;
  const double small = medianMicroseconds(501, [&] {
    if (!prescribe(model, state, target, u, scratch, grasp)) std::printf("prescribe failed\n");
  });
  std::printf("prescribed displacement, 30 x 30        %10.2f us\n", small);

  // Six elements side by side at the surface; they touch inner nodes too.
  std::vector<std::size_t> blade;
  const std::size_t cell = static_cast<std::size_t>((10 * 9 + 4) * 9 + 8) * 6;
  for (std::size_t k = 0; k < 6; ++k) blade.push_back(cell + k);
  int rank = 0;
  for (const bool warm : {false, true}) {
    const double cut_time = medianMicroseconds(warm ? 21 : 1, [&] {
      state = CondensedState(model);
      const CutReport report = cut(model, state, blade);
      rank = report.done ? report.rank : -1;
      u.setZero();
      addResponse(model, state, load, scratch, u);
    });
    std::printf("cut of rank %2d and first answer, %s  %10.2f ms   target 5, ratio %.2f\n", rank,
                warm ? "median" : "first ", 1e-3 * cut_time, 5000.0 / cut_time);
  }
  const double after = medianMicroseconds(501, [&] {
    u.setZero();
    addResponse(model, state, load, scratch, u);
  });
  std::printf("contact answer after the cut            %10.2f us\n", after);
  return 0;
}
