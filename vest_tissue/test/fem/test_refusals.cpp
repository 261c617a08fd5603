#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "beam.h"
#include "vest_tissue/fem/simulate.h"
#include "vest_tissue/fem/tissue.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

/// The message of the refusal; fails where there is none.
std::string refusal(const std::function<void(Description&)>& spoil, bool equilibrium = true) {
  Description d = makeBox({2, 1, 1, 1.0, 0.5, 0.5});
  spoil(d);
  Options o;
  o.equilibrium = equilibrium;
  o.steps = 1;
  try {
    simulate(d, o);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  ADD_FAILURE() << "nothing was refused";
  return {};
}

void expectWords(const std::string& message, const std::vector<std::string>& words) {
  EXPECT_EQ(message.find("object 'beam'"), 0u) << message;
  EXPECT_NE(message.find("allowed"), std::string::npos) << message;
  for (const auto& word : words)
    EXPECT_NE(message.find(word), std::string::npos) << word << " is missing in: " << message;
}

TEST(Refusals, NameObjectFieldValueAndWhatIsAllowed) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double e : {0.0, -1.0, nan, inf}) {
    expectWords(refusal([&](Description& d) { d.material.youngs_modulus = e; }), {"youngs_modulus", "> 0"});
  }
  for (const double nu : {0.5, 0.7, -1.0, nan}) {
    expectWords(refusal([&](Description& d) { d.material.poisson_ratio = nu; }),
                {"poisson_ratio", "below 0.5"});
  }
  expectWords(refusal([](Description& d) { d.material.density = 0.0; }, false), {"density", "0", "> 0"});
  expectWords(refusal([](Description& d) { d.material.density = -2.0; }), {"density", "-2"});
  expectWords(refusal([](Description& d) { d.material.rayleigh_mass = -0.5; }), {"rayleigh_mass", "-0.5"});
  expectWords(refusal([](Description& d) { d.material.rayleigh_stiffness = -0.25; }),
              {"rayleigh_stiffness", "-0.25"});
  expectWords(refusal([&](Description& d) { d.nodes[3].y() = nan; }), {"nodes[3]", "finite"});
  expectWords(refusal([](Description& d) { d.tetrahedra[4][2] = 77; }), {"tetrahedra[4]", "77", "0 to 11"});
  expectWords(refusal([](Description& d) { std::swap(d.tetrahedra[5][0], d.tetrahedra[5][1]); }),
              {"tetrahedra[5]", "inverted"});
  expectWords(refusal([](Description& d) { d.tetrahedra[5][0] = d.tetrahedra[5][1]; }),
              {"tetrahedra[5]", "flat"});
  expectWords(refusal([](Description& d) { d.tetrahedra.clear(); }), {"tetrahedra", "at least one"});
  expectWords(refusal([](Description& d) { d.fixed.push_back(99); }), {"fixed[4]", "99"});
  expectWords(refusal([](Description& d) { d.loads.push_back({50, {0, 0, 1}}); }), {"loads[0]", "50"});
  expectWords(refusal([&](Description& d) { d.loads.push_back({5, {0, inf, 1}}); }), {"loads[0]", "finite"});
  expectWords(refusal([](Description& d) {
                d.prescribed.push_back({0, {0, 0, 1}});
              }),
              {"prescribed[0]", "node 0"});
  expectWords(refusal([](Description& d) {
                d.nodes.emplace_back(9, 9, 9);
                d.loads.push_back({12, {0, 0, 1}});
              }),
              {"loads[0]", "belongs to no tetrahedron"});
}

TEST(Refusals, AComponentWithNothingFixedIsNamedInStaticsAndInFfemButMayMoveInDynamics) {
  const auto addLoosePart = [](Description& d) {
    const Description other = makeBox({1, 1, 1, 0.2, 0.2, 0.2}, false);
    const Index first = static_cast<Index>(d.nodes.size());
    for (const auto& x : other.nodes) d.nodes.push_back(x + Eigen::Vector3d(5, 0, 0));
    for (auto t : other.tetrahedra) {
      for (Index& n : t) n += first;
      d.tetrahedra.push_back(t);
    }
  };
  expectWords(refusal(addLoosePart), {"component", "8 nodes", "node 12", "nothing fixed"});
  expectWords(refusal([](Description& d) { d.fixed.clear(); }), {"nothing fixed"});
  expectWords(refusal([](Description& d) { d.fixed = {0, 1}; }), {"can still turn"});
  Description d = makeBox({2, 1, 1, 1.0, 0.5, 0.5});
  addLoosePart(d);
  EXPECT_THROW(makeTissue(d, Motion::Elastostatic, ""), std::invalid_argument);
  Options o;
  o.steps = 1;
  EXPECT_NO_THROW(simulate(d, o));
}

TEST(Refusals, OfOptionsNameTheField) {
  const Description d = makeBox({2, 1, 1, 1.0, 0.5, 0.5});
  Options o;
  o.steps = 1;
  for (const double dt : {0.0, -0.1, std::numeric_limits<double>::quiet_NaN()}) {
    o.dt = dt;
    EXPECT_THROW(simulate(d, o), std::invalid_argument);
  }
  o.dt = 0.1;
  o.threads = 0;
  EXPECT_THROW(simulate(d, o), std::invalid_argument);
}

TEST(Nodes, ThatNoTetrahedronUsesStayWhereTheyAre) {
  Description d = makeBox({2, 1, 1, 1.0, 0.5, 0.5});
  d.nodes.emplace_back(7, 8, 9);
  Options o;
  o.steps = 3;
  o.gravity = {0, 0, -9};
  EXPECT_EQ(simulate(d, o).positions.back(), Eigen::Vector3d(7, 8, 9));
}

}  // namespace
}  // namespace vest::fem::test
