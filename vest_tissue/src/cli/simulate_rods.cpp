#include "simulate_rods.h"

#include <cstdio>
#include <memory>
#include <stdexcept>

#include "vest_tissue/scene/baked.h"
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

  void write(const suture::State& s, const suture::Scratch& scratch) {
    for (std::size_t n = 0; n < model.strands.size(); ++n) {
      const suture::Strand& strand = model.strands[n];
      const char* name = scene.objects.rods[n].name.c_str();
      for (suture::Index k = 0; k < strand.nodes; ++k) {
        const suture::Index i = strand.first + k;
        const Eigen::Vector3d& x = s.position[i];
        if (path)
          std::fprintf(path.get(), "%.17g,%s,%u,%.17g,%.17g,%.17g\n", s.time, name, k, x.x(), x.y(), x.z());
        if (!reactions || model.held_at[i] == suture::kNone) continue;
        const suture::Reaction& r = scratch.reactions[model.held_at[i]];
        std::fprintf(reactions.get(), "%.17g,%s,%u,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", s.time, name, k,
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

}  // namespace

SimulatedScene simulateRods(const scene::RodScene& scene, const SimulateOptions& options,
                            const RodTables& tables) {
  const suture::Model model(scene.objects);
  suture::State state = model.start;
  suture::Scratch scratch(model);
  Writer writer{scene, model, Table("--reactions", tables.reactions, "t,object,node,fx,fy,fz,mx,my,mz"),
                Table("--path", tables.path, "t,object,node,x,y,z")};
  if (options.equilibrium || scene.equilibrium) {
    seekEquilibrium(model, state, scratch);
    writer.write(state, scratch);
  } else {
    const double dt = options.dt > 0.0 ? options.dt : scene.dt;
    suture::findReactions(model, state, scratch);
    writer.write(state, scratch);
    for (std::uint64_t k = 1; k <= options.steps; ++k) {
      if (suture::step(model, state, scratch, dt) == suture::StepStatus::Fault)
        throw std::runtime_error("step " + std::to_string(k) + ": the rods' numbers are not finite");
      state.time = static_cast<double>(k) * dt;  // no sum of rounding
      if (k % tables.every == 0) writer.write(state, scratch);
    }
  }
  writer.reactions.close();
  writer.path.close();
  SimulatedScene result;
  for (std::size_t n = 0; n < model.strands.size(); ++n) {
    const auto first = state.position.begin() + model.strands[n].first;
    result.names.push_back(scene.objects.rods[n].name);
    result.positions.emplace_back(first, first + model.strands[n].nodes);
  }
  result.hash = scene::digits(suture::stateHash(state));
  return result;
}

}  // namespace vest::tools
