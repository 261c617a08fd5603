#pragma once

#include <map>
#include <memory>
#include <string>

#include "vest_bringup/simulation/blood_effect.h"
#include "vest_bringup/simulation/operating_field.h"
#include "vest_bringup/simulation/surface_effect.h"
#include "vest_bringup/simulation/trainer.h"

namespace vest::simulation {

/// Which effects surround the tissue, and how.
struct StageOptions {
  bool haemodynamics = true, surface_bleeding = true, field = true;
  BloodOptions blood;
  SurfaceOptions surface;
  FieldOptions field_options;
};

/// What a script says about effects (trajectory::Trajectory::effects), in place of the options'.
/// @throws std::invalid_argument naming the option, its value and what is allowed
void apply(const std::map<std::string, double>& effects, StageOptions& options);

/// Where effects put what is to be shown; each may be null. They outlive the stage.
struct StageFrames {
  scene::TripleBuffer<BloodFrame>* blood = nullptr;
  scene::TripleBuffer<SurfaceFrame>* surface = nullptr;
  std::shared_ptr<FieldFrames> field;
};

/// A Trainer with its effects; those that it does not have are null.
struct Stage {
  std::unique_ptr<Trainer> trainer;
  BloodEffect* blood = nullptr;
  SurfaceEffect* surface = nullptr;
  OperatingField* field = nullptr;
};

/// The composite of a session: circulation, seeping surfaces and operating field around a World, in the order
/// in which each hands its sources on. @throws what the effects throw
Stage makeStage(scene::World world, const StageOptions& options, const StageFrames& frames = {});

}  // namespace vest::simulation
