#include "vest_tissue/fem/simulate.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace vest::fem {

Result simulate(const Description& d, const Options& o) {
  const auto refuse = [&d](const char* field, double value, const char* allowed) {
    std::ostringstream text;
    text << "object '" << d.name << "': " << field << " is " << value << "; allowed: " << allowed;
    throw std::invalid_argument(text.str());
  };
  if (!o.equilibrium && !(o.dt > 0.0 && std::isfinite(o.dt))) refuse("solution.dt", o.dt, "> 0");
  if (o.steps < 0) refuse("steps", o.steps, ">= 0");
  if (o.threads < 1 || o.threads > 64) refuse("threads", o.threads, "1 to 64");
  if (o.iterations < 1) refuse("iterations", o.iterations, ">= 1");
  for (int k = 0; k < 3; ++k) {
    if (!std::isfinite(o.gravity[k])) refuse("gravity", o.gravity[k], "finite numbers");
  }
  const auto model = buildModel(d, o.equilibrium ? Use::Static : Use::Dynamic);
  State state = restState(*model);
  Scratch scratch(*model, o.threads);
  Result result;
  if (o.equilibrium) {
    result.report = solveStatic(*model, o.gravity, state, scratch);
    if (!result.report.converged) {
      std::ostringstream text;
      text << "object '" << d.name << "': no equilibrium found, unbalanced force " << result.report.residual
           << " beside " << result.report.load << "; reduce the loads or refine the mesh";
      throw std::runtime_error(text.str());
    }
  } else {
    StepOptions step_options;
    step_options.dt = o.dt;
    step_options.gravity = o.gravity;
    step_options.iterations = o.iterations;
    for (int i = 0; i < o.steps; ++i) {
      if (step(*model, step_options, state, scratch) != StepStatus::Ok) {
        throw std::runtime_error("object '" + d.name + "': step " + std::to_string(i) +
                                 " failed; reduce solution.dt");
      }
    }
  }
  updateRotations(*model, state, scratch);
  elasticForces(*model, state, scratch);
  result.reactions.assign(state.x.size(), Eigen::Vector3d::Zero());
  for (std::size_t n = 0; n < state.x.size(); ++n) {
    if (model->unknown[n] < 0) {
      result.reactions[n] = -(scratch.force[n] + model->load[n] + model->mass[n] * o.gravity);
    }
  }
  result.positions = std::move(state.x);
  result.velocities = std::move(state.v);
  return result;
}

}  // namespace vest::fem
