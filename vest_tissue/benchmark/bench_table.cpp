// The table of speed: every row of what "fast" means for tissue, as a ratio in one run, with its floor and
// aim. rosrun vest_tissue vest_bench_table [--output docs/benchmarks.md]
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "condensed_under_load.h"
#include "elements_under_load.h"
#include "nets_in_kernel.h"
#include "slab_under_load.h"
#include "surface_against_bullet.h"
#include "threads_under_load.h"
#include "vest_tissue/solver/pool.h"
#include "world_against_bullet.h"

namespace {

using namespace vest::bench;

struct Row {
  std::string what, measured, floor, aim;
  bool holds = true;
};

class Table {
 public:
  template <class... Values>
  static std::string text(const char* format, Values... values) {
    char line[256];
    std::snprintf(line, sizeof line, format, values...);
    return line;
  }
  /// A ratio, the greater the better.
  void ratio(const std::string& what, const std::string& how, double value, double floor, double aim) {
    rows_.push_back({what, text("**%.1f×** (", value) + how + ")", text("%.3g×", floor), text("%.3g×", aim),
                     value >= floor});
  }
  /// A share of something, in percent.
  void share(const std::string& what, const std::string& how, double value, double floor, double aim) {
    rows_.push_back({what, text("**%.0f %%** (", 100 * value) + how + ")", text("%.0f %%", 100 * floor),
                     text("%.0f %%", 100 * aim), value >= floor});
  }
  /// A time that must not be longer.
  void time(const std::string& what, double value, const char* unit, double floor, double aim) {
    rows_.push_back({what, text("**%.2f %s**", value, unit), text("%.3g %s", floor, unit),
                     text("%.3g %s", aim, unit), value <= floor});
  }
  std::string markdown() const {
    std::ostringstream out;
    out << "| | measured | floor | aim | |\n| --- | --- | --- | --- | --- |\n";
    for (const Row& r : rows_)
      out << "| " << r.what << " | " << r.measured << " | " << r.floor << " | " << r.aim << " | "
          << (r.holds ? "floor held" : "**below the floor**") << " |\n";
    return out.str();
  }
  bool holds() const {
    for (const Row& r : rows_)
      if (!r.holds) return false;
    return true;
  }

 private:
  std::vector<Row> rows_;
};

constexpr int kSubSteps = 10;

/// µs of one sub-step of the whole net, object by object, ten at a time.
double substeps(Net& net, vest::net::KernelLevel level) {
  const auto all = [&] {
    for (std::size_t object = 0; object < net.objects(); ++object) net.step(object, level, kSubSteps);
  };
  return microseconds(all, 40, net.objects() > 100 ? 1 : 10) / kSubSteps;
}

/// The same by a pool of threads, least wall time.
double pooled(Net& net, vest::net::KernelLevel level, int threads) {
  vest::solver::Pool pool(threads);
  auto work = [&](std::size_t object) { net.step(object, level, kSubSteps); };
  return leastWallMicroseconds([&] { pool.each(net.objects(), work); }) / kSubSteps;
}

void kernels(Table& table) {
  const auto level = vest::net::chooseKernelLevel();
  Net runs(false), any(true);
  const double t_runs = microseconds([&] { runs.step(level); }),
               t_any = microseconds([&] { any.step(level); });
#if defined(VEST_HAVE_BULLET)
  BulletNet bullet;
  const double t_bullet = microseconds([&] { bullet.step(); });
  table.ratio("seed scene, 4th-order law, one kernel step against Bullet's step",
              Table::text("%.1f µs against %.1f µs", t_runs, t_bullet), t_bullet / t_runs, 8, 20);
  table.ratio("any topology, as after cuts, likewise",
              Table::text("%.1f µs against %.1f µs", t_any, t_bullet), t_bullet / t_any, 4, 10);
#endif
  Net many(false, 100);
  const double one = substeps(runs, level), hundred = substeps(many, level);
  const double alone = pooled(many, level, 1), two = pooled(many, level, 2);
  table.share("rate at ×100 relative to ×1, ten sub-steps an object at a time",
              Table::text("%.1f µs, %.0f µs a sub-step", one, hundred), 100.0 * one / hundred, 0.85, 0.98);
  table.ratio("2 threads, ×100, least wall times", Table::text("%.0f µs against %.0f µs", two, alone),
              alone / two, 1.7, 1.9);
}

void worlds(Table& table) {
#if defined(VEST_HAVE_BULLET)
  const auto d = fallingTubes();
  const Places fine = reference(d);
  const Run ours = runWorld(d, fine);
  Run theirs;  // as exact as ours, or its most exact
  for (int n = 1; n <= 64; n *= 2) {
    const Run run = runBullet(d, fine, n);
    std::printf("Bullet, %2d sub-steps a millisecond: %8.0f µs, error %.2f %%\n", n, run.microseconds,
                100 * run.error);
    if (n == 1 || run.error < theirs.error) theirs = run;
    if (theirs.error <= ours.error) break;
  }
  table.ratio("World::step, everything in it, a simulated millisecond against Bullet at equal error",
              Table::text("%.0f µs at an error of %.2f %%; Bullet with %d sub-steps: %.0f µs at %.2f %%%s",
                          ours.microseconds, 100 * ours.error, theirs.sub_steps, theirs.microseconds,
                          100 * theirs.error, theirs.error <= ours.error ? "" : ", its least"),
              theirs.microseconds / ours.microseconds, 3, 10);
  // What a session's step has besides; Bullet's time is that for its springs alone.
  const auto row = [&](const char* what, const Load& load, double floor) {
    table.ratio(what,
                Table::text("%.0f µs, %.1f times real time, %zu contacts", load.microseconds,
                            1e3 / load.microseconds, load.contacts),
                theirs.microseconds / load.microseconds, floor, 10);
  };
  row("the same with damped links", runLoad(damped(d), 0), 3);
  row("and hinges", runLoad(hinged(damped(d)), 0), 2);
  row("and the fourth-order law", runLoad(vest::specimen::seedSizeScene(false), 0), 2);
  row("and two instruments that press into it", runLoad(vest::specimen::seedSizeScene(false), 2), 2);
#else
  (void)table;
#endif
}

void surfaces(Table& table) {
#if defined(VEST_HAVE_BULLET)
  const Surface s = surface();
  const double ours = searchOfWorld(s), theirs = searchOfBullet(s);
  table.ratio("collision update + query, 7,040 moving triangles, against Bullet's BVH",
              Table::text("%.1f µs against %.1f µs", ours, theirs), theirs / ours, 3, 10);
#else
  (void)table;
#endif
}

void elements(Table& table) {
  ElementsUnderLoad object;
  const std::string what = Table::text("elastostatic elements in a World, %d unknowns, %.0f MB of inverse: ",
                                       static_cast<int>(object.unknowns()), object.megabytes());
  table.time(what + "a step with ten knots held", microseconds([&] { object.step(); }, 60, 50), "µs", 500,
             50);
  std::size_t doubled = 0;
  std::vector<double> cuts;
  for (int i = 0; i < 21; ++i) {
    object.makeWhole();
    cuts.push_back(1e-3 * microseconds([&] { doubled = object.cut(); }, 1, 1));
  }
  std::nth_element(cuts.begin(), cuts.begin() + 10, cuts.end());
  table.time(what + Table::text("a cut that doubles %zu knots, until the end of its first step", doubled),
             cuts[10], "ms", 20, 5);
  table.time(what + "once cut, a step with ten knots held", microseconds([&] { object.step(); }, 60, 5), "µs",
             1000, 300);
}

void condensed(Table& table) {
  CondensedUnderLoad object;
  std::printf("condensed elements: prepared or read in %.1f s\n", object.seconds());
  const std::string what =
      Table::text("%zu condensed elements, %zu free outer nodes, %.0f MB of compliance: ", object.elements(),
                  object.nodes(), object.megabytes());
  object.hold();
  table.time(what + "a step with ten knots held", microseconds([&] { object.step(); }, 60, 10), "µs", 1000,
             300);
  object.press();
  table.time(what + Table::text("a step with a ball in %zu contacts", object.points()),
             microseconds([&] { object.step(); }, 60, 10), "µs", 1000, 300);
}

void slab(Table& table) {
  const SlabUnderLoad load = slabUnderLoad(VEST_TISSUE_SCENES "/fem_slab/fem_slab.yaml");
  std::printf("fem_slab: %.0f µs a simulated millisecond before it is touched\n", load.whole);
  table.time(Table::text("scene fem_slab, a slab of elements with a tube, once cut %zu times and left alone: "
                         "processor time a simulated ms",
                         load.cuts),
             load.alone, "µs", 2000, 1000);
  table.time("the same while a pair of scissors cuts it", load.cutting, "µs", 2000, 1000);
}

void threads(Table& table) {
  ThreadUnderLoad drum(vest::suture::specimen::roundADrum());
  drum.run(200);
  const double still = microseconds([&] { drum.step(); }, 100, 1);
  table.time(Table::text("a thread of 150 segments, round a drum in %d contacts, held: a step of 1 ms",
                         drum.pressed()),
             still, "µs", 300, 100);
  drum.run(150);
  const double drawn = microseconds([&] { drum.step(); }, 100, 1);
  table.time(Table::text("the same drawn at 0.05 m/s, %d contacts", drum.pressed()), drawn, "µs", 300, 100);
  ThreadUnderLoad knot(overhandDrawn());
  knot.run(50);
  const double tied = microseconds([&] { knot.step(); }, 140, 1);
  table.time("an overhand knot of 150 segments, its ends drawn apart at 0.2 m/s", tied, "µs", 300, 100);
  const OnTissue pad = threadOnTissue(VEST_TISSUE_SCENES "/thread_pad/thread_pad.yaml");
  table.time(
      Table::text("what a thread of 150 segments adds to a step of a World, on tissue by %zu nodes, still",
                  pad.touches),
      pad.still, "µs", 300, 100);
  table.time("the same while it falls and comes to rest", pad.falling, "µs", 300, 100);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Prints the table of speed: ratios in one run, floors and aims"};
  std::string output;
  bool strict = false, only_threads = false, only_slab = false, only_condensed = false;
  app.add_option("--output", output, "markdown page to write");
  app.add_flag("--only_threads", only_threads, "prints the rows of threads alone")->excludes("--output");
  app.add_flag("--only_slab", only_slab, "prints the rows of the scene fem_slab alone")
      ->excludes("--output")
      ->excludes("--only_threads");
  app.add_flag("--only_condensed", only_condensed, "prints the rows of condensed elements alone")
      ->excludes("--output")
      ->excludes("--only_threads")
      ->excludes("--only_slab");
  app.add_flag("--strict", strict, "exit 1 where a floor is not held");
  CLI11_PARSE(app, argc, argv);
  Table table;
  const bool all = !only_threads && !only_slab && !only_condensed;
  if (all) {
    kernels(table);
    worlds(table);
    surfaces(table);
    elements(table);
  }
  if (all || only_condensed) condensed(table);
  if (all || only_slab) slab(table);
  if (all || only_threads) threads(table);
  const std::string rows = table.markdown();
  std::printf("kernel level %s\n%s", vest::net::kernelLevelName(vest::net::chooseKernelLevel()).data(),
              rows.c_str());
#if !defined(VEST_HAVE_BULLET)
  std::printf("Bullet is not installed (libbullet-dev): its rows are missing\n");
#endif
  if (!output.empty()) {
    std::ofstream page(output);
    page << "# How fast the tissue is\n\nMade by `rosrun vest_tissue vest_bench_table --output "
            "docs/benchmarks.md`; do not edit. Ratios of one run on one machine (kernel level "
         << vest::net::kernelLevelName(vest::net::chooseKernelLevel())
         << "), medians of CPU time: absolute times move from machine to machine.\nEqual error: root mean "
            "square of the "
            "difference to one fine integration (2 µs, double) after 50 ms, over that of the way; Bullet "
            "gets the same springs by its\nlinks' stiffness at one iteration, and twice as many sub-steps "
            "until it is as exact. Collision: one capsule. One thread unless said.\n\n"
         << rows;
    if (!page) {
      std::fprintf(stderr, "vest_bench_table: cannot write %s\n", output.c_str());
      return 1;
    }
  }
  return strict && !table.holds() ? 1 : 0;
}
