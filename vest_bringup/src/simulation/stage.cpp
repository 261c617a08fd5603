#include "vest_bringup/simulation/stage.h"

#include <stdexcept>
#include <string>

namespace vest::simulation {

void apply(const std::map<std::string, double>& effects, StageOptions& options) {
  for (const auto& [wanted, value] : effects) {
    bool known = false;
    const auto take = [&, &name = wanted, v = value](const char* which, double& to, double low, double high) {
      if (name != which) return;
      if (!(v >= low && v <= high))
        throw std::invalid_argument("effects: " + name + ": " + std::to_string(v) +
                                    " (allowed: a number from " + std::to_string(low) + " to " +
                                    std::to_string(high) + ")");
      known = true;
      to = v;
    };
    eachNumber(options.field_options, take);
    gas::eachNumber(options.pneumoperitoneum, [&](const char* field, double& to, double low, double high) {
      take((std::string("gas/") + field).c_str(), to, low, high);
    });
    take("surface_bleeding_scale", options.surface.scale, 0, 1000);
    take("pulse_dilatation", options.blood.pulse_dilatation, 0, 20);
    if (!known)
      throw std::invalid_argument("effects: " + wanted +
                                  ": unknown (allowed: the numbers of the Trainer's ~effects, e.g. "
                                  "lens/start_temperature)");
  }
}

Stage makeStage(scene::World world, const StageOptions& options, const StageFrames& frames) {
  Stage stage;
  stage.trainer = std::make_unique<Trainer>(std::move(world));
  const auto add = [&](auto effect) {
    auto* const raw = effect.get();
    stage.trainer->add(std::move(effect));
    return raw;
  };
  const scene::World& tissue = stage.trainer->world();
  if (options.insufflation)
    stage.gas = add(std::make_unique<GasEffect>(options.pneumoperitoneum, frames.gas));
  BloodOptions blood = options.blood;
  if (options.insufflation) blood.gas_pressure = options.pneumoperitoneum.set_pressure;
  if (options.haemodynamics) stage.blood = add(std::make_unique<BloodEffect>(tissue, blood, frames.blood));
  if (options.surface_bleeding)
    stage.surface =
        add(std::make_unique<SurfaceEffect>(tissue, options.surface, stage.blood, frames.surface));
  if (options.field)
    stage.field = add(std::make_unique<OperatingField>(tissue, options.field_options, frames.field,
                                                       stage.surface != nullptr));
  return stage;
}

}  // namespace vest::simulation
