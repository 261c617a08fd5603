#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nets.h"
#include "vest_tissue/scene/edits.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_state.h"

// Protects how a person hears of an edit that cannot be: one sentence with object, parameter, value and what
// is allowed; that what is listed is what a step takes, ends included; and that a step stays bounded all the
// same.

namespace vest::scene {
namespace {

std::vector<EditableParameter> list() {
  return {{"", "gravity_z", "m/s²", -20, 20},
          {"tube", "youngs_modulus", "Pa", 100, 1e6},
          {"tube", "damping_scale", "", 0.01, 100},
          {"ovary", "damping_scale", "", 0.01, 100},
          {"lens", "rinse", "", 0, 1}};
}

TEST(EditRefusal, WhatIsAllowedIsNotRefusedEndsIncluded) {
  for (const EditableParameter& p : list())
    for (const double value : {p.low, 0.5 * (p.low + p.high), p.high})
      EXPECT_EQ(refusal(list(), {p.object, p.parameter, value}), "") << p.object << " " << p.parameter;
}

TEST(EditRefusal, BeyondTheRangeSaysObjectParameterValueAndRangeWithItsUnit) {
  EXPECT_EQ(refusal(list(), {"tube", "youngs_modulus", 5e7}),
            "tube: youngs_modulus = 5e+07: allowed is 100 to 1e+06 Pa");
  EXPECT_EQ(refusal(list(), {"tube", "damping_scale", -1}),
            "tube: damping_scale = -1: allowed is 0.01 to 100");
  EXPECT_EQ(refusal(list(), {"", "gravity_z", 21}), "gravity_z = 21: allowed is -20 to 20 m/s²");
}

TEST(EditRefusal, WhatIsNoNumberIsRefused) {
  for (const double value :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
        -std::numeric_limits<double>::infinity()})
    EXPECT_NE(refusal(list(), {"tube", "youngs_modulus", value}), "");
  EXPECT_EQ(refusal(list(), {"tube", "youngs_modulus", std::numeric_limits<double>::infinity()}),
            "tube: youngs_modulus = inf: allowed is 100 to 1e+06 Pa");
}

TEST(EditRefusal, UnknownParametersAndObjectsAreAnsweredWithTheKnownOnes) {
  EXPECT_EQ(refusal(list(), {"tube", "colour", 1}),
            "tube: parameter = colour: allowed is one of youngs_modulus, damping_scale");
  EXPECT_EQ(refusal(list(), {"", "colour", 1}), "parameter = colour: allowed is one of gravity_z");
  EXPECT_EQ(refusal(list(), {"spleen", "damping_scale", 1}),
            "object = spleen: allowed is one of tube, ovary, lens, or none for what belongs to no object");
  auto of_objects = list();
  of_objects.erase(of_objects.begin());
  EXPECT_EQ(refusal(of_objects, {"spleen", "damping_scale", 1}),
            "object = spleen: allowed is one of tube, ovary, lens");
}

TEST(EditRefusal, WhatAWorldListsItsStepTakesAndWhatIsBeyondEndsAtItsEnd) {
  World world(specimen::tubeScene());
  std::vector<EditableParameter> allowed;
  editableParameters(world, allowed);
  const auto tube = std::find_if(allowed.begin(), allowed.end(), [](const EditableParameter& p) {
    return p.object == "tube" && p.parameter == "youngs_modulus";
  });
  ASSERT_NE(tube, allowed.end());
  EXPECT_EQ(tube->unit, "Pa");
  const double law = world.description().objects[0].law.youngs_modulus;
  const auto edit = [&](double value) {
    StepInput in;
    StepReport report;
    in.edits.push_back({"tube", "youngs_modulus", value});
    world.step(in, report);
    return world.state().objects[0].elastic_scale * law;
  };
  EXPECT_EQ(refusal(allowed, {"tube", "youngs_modulus", tube->high}), "");
  EXPECT_NEAR(edit(tube->high), tube->high, 1e-6 * tube->high);
  EXPECT_NE(refusal(allowed, {"tube", "youngs_modulus", 1.01 * tube->high}), "");
  EXPECT_NEAR(edit(10 * tube->high), tube->high, 1e-6 * tube->high);
  EXPECT_NEAR(edit(0.1 * tube->low), tube->low, 1e-6 * tube->low);
  EXPECT_NEAR(edit(std::numeric_limits<double>::quiet_NaN()), tube->low, 1e-6 * tube->low) << "left out";
  EXPECT_NE(refusal(allowed, {"", "gravity_z", 1e9}), "");
  for (const EditableParameter& p : allowed) {
    if (!p.object.empty()) continue;
    EXPECT_EQ(refusal(allowed, {"", p.parameter, p.low}), "") << p.parameter;
  }
}

}  // namespace
}  // namespace vest::scene
