// Trees of a scene in the patient's circulation: what begins at an artery's end takes its flow over.

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "vest_effects/haemodynamics/circulation.h"
#include "vest_effects/haemodynamics/pulse_run.h"

using namespace vest::haemodynamics;

namespace {

// Seven branches, as vest_model writes them (vest_tissue/test/modelling/test_tree.cpp).
CaseTexts tree() {
  CaseTexts texts;
  texts.case_json = R"({"rho": 1040, "mu": 0.004, "zeta": 2, "period_s": 0.857, "taper": "linear"})";
  texts.inflow_csv = "t_s,Q_m3_s\n0,1e-7\n0.2,3e-7\n0.4,1e-7\n";
  texts.network_csv =
      "id,name,node_in,node_out,length_m,r_prox_m,r_dist_m,h_prox_m,h_dist_m,E_Pa,P_ref_Pa,terminal,R1_Pa_s_"
      "m3,R2_"
      "Pa_s_m3,C_m3_Pa,P_out_Pa\n";
  const auto row = [&](int id, int in, double length, double radius, bool terminal) {
    const double h = 0.3 * radius;
    texts.network_csv += std::to_string(id) + ",twig_" + std::to_string(id) + "," + std::to_string(in) + "," +
                         std::to_string(id + 1);
    for (const double value : {length, radius, radius, h, h, 3e5, 1e4})
      texts.network_csv += "," + formatNumber(value);
    texts.network_csv += terminal ? ",1,1e9,4e11,5e-13,0\n" : ",0,0,0,0,0\n";
  };
  row(1, 1, 0.018, 0.0015, false);
  row(2, 2, 0.013, 0.0011, false);
  row(3, 3, 0.010, 0.00085, true);
  row(4, 3, 0.010, 0.00085, true);
  row(5, 2, 0.013, 0.0011, false);
  row(6, 6, 0.010, 0.00085, true);
  row(7, 6, 0.010, 0.00085, true);
  return texts;
}

Vessels pelvis() {
  return readVessels(VEST_VESSEL_DATA "/pelvis");
}

double flowAtEnd(const CirculationModel& model, const CirculationState& state, const std::string& name) {
  const int v = model.find(name);
  return at(model, state, v, model.length(v)).flow;
}

}  // namespace

TEST(Graft, FlowsAtTheNodesOfATreeConserve) {
  const Model model = buildModel(parseCase("tree", tree()), 0.002);
  PulseOptions options;
  options.cycles = 4;
  const PulseResult result = runPulse(model, options);
  ASSERT_EQ(result.status, Status::kOk);
  EXPECT_LT(result.mass_error, 1e-6);
  double most = 0;
  for (const auto& at_time : result.samples) {
    for (const int parent : {0, 1, 4}) {
      const auto p = static_cast<std::size_t>(parent);
      const std::size_t first = p + 1, second = parent == 0 ? 4 : p + 2;
      most = std::max(most, std::abs(at_time[p].distal.flow - at_time[first].proximal.flow -
                                     at_time[second].proximal.flow) /
                                3e-7);
    }
  }
  // Flows through the faces at a node, of one instant.
  EXPECT_LT(most, 1e-6);
}

TEST(Graft, TheTreeTakesTheFlowAndTheTerritoryOfTheEndThatItContinues) {
  const Circulation before = buildCirculation(pelvis(), 0.006);
  Vessels vessels = pelvis();
  graft(parseCase("tree", tree()), "uterine_branches_left", vessels);
  const Circulation after = buildCirculation(vessels, 0.006);
  EXPECT_EQ(after.model.arteries.segments.size(), before.model.arteries.segments.size() + 7);
  ASSERT_GE(after.model.find("twig_7"), 0);
  // Mean flows of whole seconds: what comes into the uterus's territory.
  const auto territory = [](const Circulation& c) {
    for (std::size_t i = 0; i < c.model.vessels.territories.size(); ++i)
      if (c.model.vessels.territories[i].tissue == "uterus") return c.model.territory_flow[i];
    return 0.0;
  };
  std::printf("uterus %.4g before, %.4g m3/s behind the tree\n", territory(before), territory(after));
  EXPECT_GT(territory(before), 0);
  EXPECT_NEAR(territory(after), territory(before), 0.05 * territory(before));
  EXPECT_NEAR(after.rest.mean, before.rest.mean, 0.01 * before.rest.mean);
  EXPECT_GT(flowAtEnd(after.model, after.rest, "twig_3"), 0);
}

TEST(Graft, AnOpenedBranchOfTheTreeBleeds) {
  Vessels vessels = pelvis();
  graft(parseCase("tree", tree()), "uterine_branches_left", vessels);
  const Circulation c = buildCirculation(vessels, 0.006);
  CirculationState state = c.rest;
  CirculationScratch scratch(c.model);
  CirculationInputs inputs;
  inputs.hole_count = 1;
  inputs.holes[0] = {c.model.find("twig_2"), 0.006, 2e-6};
  for (int i = 0; i < 2000; ++i) ASSERT_EQ(step(c.model, inputs, 1e-3, state, scratch), Status::kOk);
  std::printf("lost %.4g m3 in 2 s\n", state.lost);
  EXPECT_GT(state.lost, 1e-8);
}

TEST(Graft, WhatFitsNowhereIsRefusedByName) {
  const auto message = [](CaseTexts texts, const std::string& supply) {
    Vessels vessels = pelvis();
    try {
      graft(parseCase("tree", texts), supply, vessels);
    } catch (const NetworkError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message(tree(), "uterine_branches_left"), "");
  EXPECT_NE(message(tree(), "tail").find("supply = tail"), std::string::npos);
  CaseTexts texts = tree();
  texts.network_csv.replace(texts.network_csv.find("0.018"), 5, "1e-9 ");
  EXPECT_NE(message(texts, "uterine_branches_left").find("network.csv:2: length_m"), std::string::npos);
  texts = tree();
  texts.network_csv.replace(texts.network_csv.find("0.0015,0.0015"), 13, "1e-4,1e-4");
  EXPECT_NE(message(texts, "uterine_branches_left").find("wide enough"), std::string::npos);
  texts = tree();
  texts.network_csv.replace(texts.network_csv.find("\n3,twig_3,3,4"), 13, "\n3,twig_3,3,3");
  EXPECT_NE(message(texts, "uterine_branches_left"), "");
}
