#include <gtest/gtest.h>

#include <ros/package.h>

#include "vest_bringup/simulation/stage.h"
#include "vest_instruments/control/pedals.h"

// Protects the cavity's gas in the composite of a session: its pressure stands around the vessels, its
// humidity before the lens, its renewal thins smoke, suction of gas takes it away, suction of liquid does
// not.

namespace vest::simulation {
namespace {

constexpr auto kRight = static_cast<std::size_t>(tools::Instrument::Right);

StageOptions with(double max_flow = 3.33e-4) {
  StageOptions o;
  o.blood.vessels = ros::package::getPath("vest_effects") + "/data/vessels/pelvis";
  o.pneumoperitoneum.max_flow = max_flow;
  return o;
}

struct Theatre {
  Stage stage;
  scene::StepInput tools;
  scene::StepReport report;
  std::uint64_t k = 0;

  explicit Theatre(const StageOptions& options = with()) {
    stage = makeStage(scene::World(scene::loadScene(ros::package::getPath("vest_tissue") +
                                                    "/scenes/irrigation_pool/irrigation_pool.yaml")),
                      options);
    auto& tool = tools.tools[kRight];
    tool.present = true;
    tool.tool = tools::ToolKind::SuctionIrrigator;
    tool.pivot = {0.115, -0.02, 0.165};
    tool.position = {0.0, 0.03, 0.08};
    tool.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(),
                                                          (tool.position - tool.pivot).normalized());
  }
  void run(double seconds, std::uint32_t functions = 0) {
    for (int n = static_cast<int>(seconds / 0.001 + 0.5); n > 0; --n) {
      scene::StepInput input = tools;
      input.step = ++k;
      input.tools[kRight].functions = functions;
      stage.trainer->step(input, report);
    }
  }
};

TEST(CavityGas, StandsAroundTheVesselsAndIsDrawnOffBySuction) {
  Theatre t(with(1e-4));  // 6 l/min
  t.run(0.2);
  EXPECT_NEAR(t.stage.gas->now().pressure, 1600, 30);
  EXPECT_EQ(t.stage.blood->circulation().external_pressure, t.stage.gas->now().pressure);
  const double venous = haemodynamics::at(t.stage.blood->model(), t.stage.blood->circulation(),
                                          t.stage.blood->model().vesselCount() - 1, 0)
                            .pressure;
  t.run(6.0, tools::kFunctionSuck);  // 10 l/min of gas against 6
  EXPECT_LT(t.stage.gas->now().pressure, 1300);
  EXPECT_NEAR(gas::counted(t.stage.gas->state().drawn), 6.0 * 1.7e-4, 0.15 * 6.0 * 1.7e-4);
  EXPECT_LT(haemodynamics::at(t.stage.blood->model(), t.stage.blood->circulation(),
                              t.stage.blood->model().vesselCount() - 1, 0)
                .pressure,
            venous)
      << "veins of the abdomen feel it";
  std::vector<std::uint8_t> bytes;
  t.stage.trainer->save(bytes);
  Theatre other(with(1e-4));
  other.stage.trainer->restore(bytes);
  other.k = t.k;
  t.run(0.3), other.run(0.3);
  EXPECT_EQ(*t.stage.trainer->effectsHash(), *other.stage.trainer->effectsHash());
  t.stage.trainer->reset();
  EXPECT_NEAR(t.stage.gas->now().pressure, 1600, 1e-6);
}

TEST(CavityGas, ThePatientIsUnderItFromTheFirstStepAndPumpsMoreWhenItIsLetOut) {
  Theatre t;
  const auto& blood = t.stage.blood->circulation();
  const double rest = t.stage.blood->model().curve_output, began = blood.output;
  EXPECT_LT(began, 0.85 * rest);
  t.run(10);
  EXPECT_NEAR(blood.output, began, 0.03 * began) << "the monitor does not wander at the start";
  scene::StepInput input;
  input.step = ++t.k;
  input.edits.push_back({"gas", "leak_area", 1e-4});
  input.edits.push_back({"gas", "max_flow", 0});
  t.stage.trainer->step(input, t.report);
  t.run(40);
  EXPECT_LT(t.stage.gas->now().pressure, 100);
  EXPECT_GT(blood.output, 1.2 * began);
}

TEST(CavityGas, ATipUnderWaterDrawsWaterInstead) {
  Theatre dry, wet;
  wet.tools.tools[kRight].position = {0.0, 0.03, 0.012};
  wet.run(4.0, tools::kFunctionIrrigate);
  const double before = wet.stage.gas->state().drawn;
  dry.run(1.0, tools::kFunctionSuck), wet.run(1.0, tools::kFunctionSuck);
  ASSERT_GT(wet.stage.field->fluid().sucked, 5e-6) << "the tip lay in the pool";
  EXPECT_LT(wet.stage.gas->state().drawn - before, 0.8 * dry.stage.gas->state().drawn);
}

TEST(CavityGas, AnOpenValveDriesTheGasAndCarriesSmokeAway) {
  Theatre tight, open;
  scene::StepInput input;
  input.step = ++open.k;
  input.edits.push_back({"gas", "leak_area", 1.3e-5});
  open.stage.trainer->step(input, open.report);
  tight.run(20), open.run(20);
  EXPECT_GT(open.stage.gas->now().renewal, 5 * tight.stage.gas->now().renewal);
  EXPECT_LT(open.stage.gas->now().humidity, tight.stage.gas->now().humidity - 0.05);
  EXPECT_GT(open.stage.gas->now().drying, 2 * tight.stage.gas->now().drying)
      << "m/s of water off wet surfaces";
}

TEST(CavityGas, WithoutInsufflationThePressureIsThatOfTheAir) {
  StageOptions o = with();
  o.insufflation = false;
  Theatre t(o);
  t.run(0.1);
  EXPECT_EQ(t.stage.gas, nullptr);
  EXPECT_EQ(t.stage.blood->circulation().external_pressure, 0);
}

}  // namespace
}  // namespace vest::simulation
