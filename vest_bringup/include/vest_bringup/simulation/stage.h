#pragma once

#include <map>
#include <memory>
#include <string>
#include <type_traits>

#include "vest_bringup/simulation/blood_effect.h"
#include "vest_bringup/simulation/gas_effect.h"
#include "vest_bringup/simulation/operating_field.h"
#include "vest_bringup/simulation/surface_effect.h"
#include "vest_bringup/simulation/trainer.h"

namespace vest::simulation {

/// Which effects surround the tissue, and how.
struct StageOptions {
  bool insufflation = true, haemodynamics = true, surface_bleeding = true, field = true;
  gas::Parameters pneumoperitoneum;
  BloodOptions blood;
  SurfaceOptions surface;
  FieldOptions field_options;
};

/// Each option that changes what the effects compute, by the name that sessions know, with what is allowed.
/// Threads and rates of publishing change nothing. @param number called as number(name, double& value,
/// lowest, highest)
template <class Number>
void eachNumber(StageOptions& o, Number&& number) {
  const auto whole = [&](const char* name, auto& value, double low, double high) {
    auto as_number = static_cast<double>(value);
    number(name, as_number, low, high);
    value = static_cast<std::decay_t<decltype(value)>>(as_number);
  };
  whole("insufflation", o.insufflation, 0, 1);
  whole("haemodynamics", o.haemodynamics, 0, 1);
  whole("surface_bleeding", o.surface_bleeding, 0, 1);
  whole("field", o.field, 0, 1);
  number("vessel_cell", o.blood.dx, 0.0005, 0.05);
  number("pulse_dilatation", o.blood.pulse_dilatation, 0, 20);
  gas::eachNumber(o.pneumoperitoneum, [&](const char* name, double& value, double low, double high) {
    number((std::string("gas/") + name).c_str(), value, low, high);
  });
  number("surface_bleeding_scale", o.surface.scale, 0, 1000);
  eachNumber(o.field_options, number);
  whole("fluid/capacity", o.field_options.fluid.capacity, 16, 60000);
  whole("fluid/iterations", o.field_options.fluid.iterations, 1, 50);
}

/// What a script says about effects (trajectory::Trajectory::effects), in place of the options'.
/// @throws std::invalid_argument naming the option, its value and what is allowed
void apply(const std::map<std::string, double>& effects, StageOptions& options);

/// Where effects put what is to be shown; each may be null. They outlive the stage.
struct StageFrames {
  scene::TripleBuffer<GasFrame>* gas = nullptr;
  scene::TripleBuffer<BloodFrame>* blood = nullptr;
  scene::TripleBuffer<SurfaceFrame>* surface = nullptr;
  std::shared_ptr<FieldFrames> field;
};

/// A Trainer with its effects; those that it does not have are null.
struct Stage {
  std::unique_ptr<Trainer> trainer;
  GasEffect* gas = nullptr;
  BloodEffect* blood = nullptr;
  SurfaceEffect* surface = nullptr;
  OperatingField* field = nullptr;
};

/// The composite of a session: gas, circulation, seeping surfaces and operating field around a World, in the
/// order in which each hands its sources on. @throws what the effects throw
Stage makeStage(scene::World world, const StageOptions& options, const StageFrames& frames = {});

}  // namespace vest::simulation
