#include "simulate_rods.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "settle.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world_state.h"
#include "vest_tissue/suture/rod.h"

namespace vest::tools {
namespace {

/// A table that is written row by row.
class Table {
 public:
  Table(const char* option, const std::string& path, const char* header) : option_(option), path_(path) {
    if (path.empty()) return;
    file_.reset(std::fopen(path.c_str(), "w"));
    if (!file_) fail();
    std::fprintf(file_.get(), "%s\n", header);
  }
  explicit operator bool() const { return file_ != nullptr; }
  std::FILE* get() const { return file_.get(); }
  void close() {
    if (!file_) return;
    const bool good = std::ferror(file_.get()) == 0;
    if (std::fclose(file_.release()) != 0 || !good) fail();
  }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  [[noreturn]] void fail() const { throw std::runtime_error(option_ + ": " + path_ + " cannot be written"); }
  std::string option_, path_;
  std::unique_ptr<std::FILE, Close> file_;
};

struct Writer {
  const scene::RodScene& scene;
  const suture::Model& model;
  Table reactions, path;

  void write(double time, const suture::State& s, const std::vector<suture::Reaction>& held) {
    for (std::size_t n = 0; n < model.strands.size(); ++n) {
      const suture::Strand& strand = model.strands[n];
      const char* name = scene.objects.rods[n].name.c_str();
      for (suture::Index k = 0; k < strand.nodes; ++k) {
        const suture::Index i = strand.first + k;
        const Eigen::Vector3d& x = s.position[i];
        if (path)
          std::fprintf(path.get(), "%.17g,%s,%u,%.17g,%.17g,%.17g\n", time, name, k, x.x(), x.y(), x.z());
        if (!reactions || model.held_at[i] == suture::kNone) continue;
        const suture::Reaction& r = held[model.held_at[i]];
        std::fprintf(reactions.get(), "%.17g,%s,%u,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", time, name, k,
                     r.force.x(), r.force.y(), r.force.z(), r.moment.x(), r.moment.y(), r.moment.z());
      }
    }
  }
};

void seekEquilibrium(const suture::Model& model, suture::State& state, suture::Scratch& scratch) {
  const suture::StaticReport report = suture::solveStatic(model, state, scratch);
  if (report.converged) return;
  char what[160];
  std::snprintf(what, sizeof what,
                "no equilibrium of the rods after %d passes: %g of a load of %g is unbalanced",
                report.iterations, report.residual, report.load);
  throw std::runtime_error(what);
}

/// Rods beside other objects: threads of a World. Its steps are 1 ms at most, as in a session, for a touch
/// gives way the more the longer they are; longer ones of the scene are made of equal parts.
SimulatedScene simulateTogether(const scene::RodScene& scene, const SimulateOptions& options,
                                const RodTables& tables, Writer& writer, suture::State& state,
                                suture::Scratch& scratch) {
  constexpr double kMostStep = 0.001, kMostSettling = 100.0, kRestSpeed = 0.0002;  // s, s, m/s
  const double dt = options.dt > 0.0 ? options.dt : scene.dt;
  const int parts = std::max(1, static_cast<int>(std::ceil(dt / kMostStep * (1.0 - 1e-12))));
  scene::Description description = *scene.together;
  description.dt = dt / parts;
  scene::World world(description, options.threads);
  const suture::State& rods = world.state().threads.rod;
  if (options.equilibrium || scene.equilibrium) {
    for (double fastest = 1.0; !(fastest < kRestSpeed);) {
      const Rest rest = run(world, 2.0, 0.0);
      fastest = rest.speed;
      for (const Eigen::Vector3d& v : rods.velocity) fastest = std::max(fastest, v.norm());
      if (world.time() > kMostSettling)
        throw std::runtime_error(
            "not at rest after 100 s; damping of the objects and rods brings them there");
    }
    writer.write(world.time(), rods, world.rodReactions());
  } else {
    suture::findReactions(writer.model, state, scratch);
    writer.write(0.0, state, scratch.reactions);
    scene::StepInput input;
    input.dt = description.dt;
    scene::StepReport report;
    for (std::uint64_t k = 1; k <= options.steps; ++k) {
      for (int part = 0; part < parts; ++part) {
        input.step = world.steps();
        if (world.step(input, report) == scene::Status::Fault)
          throw std::runtime_error("step " + std::to_string(k) + ": fault in " +
                                   std::string(report.fault_object));
      }
      if (k % tables.every == 0) writer.write(static_cast<double>(k) * dt, rods, world.rodReactions());
    }
  }
  SimulatedScene result;
  for (std::size_t o = 0; o < world.objectCount(); ++o) {
    result.names.push_back(description.objects[o].name);
    result.positions.emplace_back();
    for (std::size_t n = 0; n < world.knotCount(o); ++n)
      result.positions.back().push_back(world.knotAt(o, n));
  }
  state.position = rods.position;
  result.hash = scene::digits(world.stateHash());
  return result;
}

}  // namespace

SimulatedScene simulateRods(const scene::RodScene& scene, const SimulateOptions& options,
                            const RodTables& tables) {
  const suture::Model model(scene.objects);
  suture::State state = model.start;
  suture::Scratch scratch(model);
  Writer writer{scene, model, Table("--reactions", tables.reactions, "t,object,node,fx,fy,fz,mx,my,mz"),
                Table("--path", tables.path, "t,object,node,x,y,z")};
  SimulatedScene result;
  if (scene.together) {
    result = simulateTogether(scene, options, tables, writer, state, scratch);
  } else if (options.equilibrium || scene.equilibrium) {
    seekEquilibrium(model, state, scratch);
    writer.write(state.time, state, scratch.reactions);
  } else {
    const double dt = options.dt > 0.0 ? options.dt : scene.dt;
    suture::findReactions(model, state, scratch);
    writer.write(state.time, state, scratch.reactions);
    for (std::uint64_t k = 1; k <= options.steps; ++k) {
      if (suture::step(model, state, scratch, dt) == suture::StepStatus::Fault)
        throw std::runtime_error("step " + std::to_string(k) + ": the rods' numbers are not finite");
      state.time = static_cast<double>(k) * dt;  // no sum of rounding
      if (k % tables.every == 0) writer.write(state.time, state, scratch.reactions);
    }
  }
  writer.reactions.close();
  writer.path.close();
  for (std::size_t n = 0; n < model.strands.size(); ++n) {
    const auto first = state.position.begin() + model.strands[n].first;
    result.names.push_back(scene.objects.rods[n].name);
    result.positions.emplace_back(first, first + model.strands[n].nodes);
  }
  if (!scene.together) result.hash = scene::digits(suture::stateHash(state));
  return result;
}

}  // namespace vest::tools
