#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <Eigen/Geometry>

#include "beam.h"
#include "vest_tissue/fem/model.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double operator()() { return 2.0 * (static_cast<double>(engine_()) / 4294967296.0) - 1.0; }
  Eigen::Vector3d vector() { return {(*this)(), (*this)(), (*this)()}; }
  Eigen::Matrix3d matrix() {
    Eigen::Matrix3d m;
    for (int i = 0; i < 9; ++i) m(i) = (*this)();
    return m;
  }
  Eigen::Matrix3d rotation() {
    return Eigen::Quaterniond(Eigen::Vector4d((*this)(), (*this)(), (*this)(), (*this)()).normalized())
        .toRotationMatrix();
  }

 private:
  std::mt19937 engine_;
};

Description shakenBox(Strain strain) {
  Description d = makeBox({3, 2, 2, 1.0, 0.6, 0.5});
  shake(d, 0.08);
  d.strain = strain;
  d.material = {1000.0, 0.35, 2.0, 0.0, 0.0};
  return d;
}

void deform(State& state, const Model& model, double amount, unsigned seed) {
  Random random(seed);
  for (const Index n : model.free_node) state.x[n] += amount * random.vector();
}

TEST(NearestRotation, IsTheRotationOfAStretchedAndTurnedShape) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Matrix3d R = random.rotation(), B = random.matrix();
    const Eigen::Matrix3d S = B * B.transpose() + 0.05 * Eigen::Matrix3d::Identity();
    EXPECT_LT((nearestRotation(R * S) - R).norm(), 1e-12);
  }
}

TEST(NearestRotation, StaysAProperRotationForInvertedFlatAndVanishingShapes) {
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    Eigen::Matrix3d F = random.matrix();
    if (i % 3 == 0) F.col(0) = -F.col(0);
    if (i % 5 == 0) F.col(2) = F.col(1);
    if (i % 7 == 0) F.setZero();
    if (i % 11 == 0) F *= 1e-150;
    const Eigen::Matrix3d R = nearestRotation(F);
    ASSERT_TRUE(R.allFinite());
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    EXPECT_NEAR(R.determinant(), 1.0, 1e-12);
    // No other rotation is nearer.
    for (int k = 0; k < 10; ++k) EXPECT_LE((F - R).norm(), (F - random.rotation()).norm() + 1e-12);
  }
}

TEST(Energy, ElasticForcesAreItsGradientBySmallStrainAndCorotational) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    const auto model = buildModel(shakenBox(strain), Use::Static);
    State state = restState(*model);
    Scratch scratch(*model, 1);
    deform(state, *model, 0.05, 7);
    updateRotations(*model, state, scratch);
    elasticForces(*model, state, scratch);
    const auto force = scratch.force;
    double scale = 0.0;
    for (const auto& f : force) scale = std::max(scale, f.norm());
    const double h = 1e-6;
    for (std::size_t i = 0; i < model->free_node.size(); i += 5) {
      const Index n = model->free_node[i];
      for (int d = 0; d < 3; ++d) {
        double energy[2];
        for (int s = 0; s < 2; ++s) {
          State moved = state;
          moved.x[n][d] += s == 0 ? -h : h;
          updateRotations(*model, moved, scratch);
          energy[s] = strainEnergy(*model, moved, scratch);
        }
        EXPECT_NEAR(force[n][d], -(energy[1] - energy[0]) / (2 * h), 1e-7 * scale);
      }
    }
  }
}

/// Solves with the assembled matrix and compares with finite differences of forces: K (K^-1 f) = f.
TEST(Energy, ExactTangentIsTheDerivativeOfTheForces) {
  const auto model = buildModel(shakenBox(Strain::Corotational), Use::Static);
  State state = restState(*model);
  // Stretched, so that the Hessian is positive definite, and sheared, so that it is none of the frozen one's.
  for (const Index n : model->free_node) {
    const Eigen::Vector3d X = model->description.nodes[n];
    state.x[n] += Eigen::Vector3d(0.3 * X.x(), 0.1 * X.x() + 0.2 * X.y(), 0.15 * X.x() * X.x() + 0.2 * X.z());
  }
  Scratch scratch(*model, 1);
  Random random(8);
  Eigen::VectorXd direction(3 * static_cast<Eigen::Index>(model->free_node.size()));
  for (Eigen::Index i = 0; i < direction.size(); ++i) direction[i] = random();
  const double h = 1e-6;
  Eigen::VectorXd change = Eigen::VectorXd::Zero(direction.size());
  for (const double sign : {-1.0, 1.0}) {
    State moved = state;
    for (std::size_t i = 0; i < model->free_node.size(); ++i) {
      moved.x[model->free_node[i]] += sign * h * direction.segment<3>(3 * static_cast<Eigen::Index>(i));
    }
    updateRotations(*model, moved, scratch);
    elasticForces(*model, moved, scratch);
    for (std::size_t i = 0; i < model->free_node.size(); ++i) {
      change.segment<3>(3 * static_cast<Eigen::Index>(i)) -=
          sign * scratch.force[model->free_node[i]] / (2 * h);
    }
  }
  updateRotations(*model, state, scratch);
  const auto error = [&](Tangent tangent) {
    assemble(*model, state, 0.0, 1.0, tangent, scratch);
    EXPECT_TRUE(scratch.matrix.factorise());
    Eigen::VectorXd x = change;
    scratch.matrix.solve(x.data());
    return (x - direction).norm() / direction.norm();
  };
  EXPECT_LT(error(Tangent::Exact), 1e-6);
  EXPECT_GT(error(Tangent::Frozen), 1e-2);  // the test would notice if the twist were left out
}

TEST(Corotational, ForcesTurnWithTheObjectAndVanishForRigidMotion) {
  const auto model = buildModel(shakenBox(Strain::Corotational), Use::Static);
  Scratch scratch(*model, 1);
  State state = restState(*model);
  Random random(9);
  const Eigen::Matrix3d Q = random.rotation();
  const Eigen::Vector3d t = 3.0 * random.vector();
  State turned = state;
  for (auto& x : turned.x) x = Q * x + t;
  updateRotations(*model, turned, scratch);
  elasticForces(*model, turned, scratch);
  for (const auto& f : scratch.force) EXPECT_LT(f.norm(), 1e-10);  // E·area is about 300 N
  deform(state, *model, 0.1, 10);
  updateRotations(*model, state, scratch);
  elasticForces(*model, state, scratch);
  const auto force = scratch.force;
  turned = state;
  for (auto& x : turned.x) x = Q * x + t;
  updateRotations(*model, turned, scratch);
  elasticForces(*model, turned, scratch);
  for (std::size_t n = 0; n < force.size(); ++n) EXPECT_LT((scratch.force[n] - Q * force[n]).norm(), 1e-10);
}

TEST(Energy, ForcesAndTorquesOfTheTissueSumToZero) {
  const auto model = buildModel(shakenBox(Strain::Corotational), Use::Static);
  Scratch scratch(*model, 1);
  State state = restState(*model);
  deform(state, *model, 0.1, 11);
  updateRotations(*model, state, scratch);
  elasticForces(*model, state, scratch);
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), torque = force;
  for (std::size_t n = 0; n < state.x.size(); ++n) {
    force += scratch.force[n];
    torque += state.x[n].cross(scratch.force[n]);
  }
  EXPECT_LT(force.norm(), 1e-10);
  EXPECT_LT(torque.norm(), 1e-10);
}

TEST(Damping, RayleighForcesNeverHavePositivePower) {
  for (const Strain strain : {Strain::Small, Strain::Corotational}) {
    const auto model = buildModel(shakenBox(strain), Use::Dynamic);
    Scratch scratch(*model, 1);
    for (unsigned seed = 1; seed < 30; ++seed) {
      State state = restState(*model);
      deform(state, *model, 0.15, seed);
      Random random(seed + 100);
      for (const Index n : model->free_node) state.v[n] = random.vector();
      updateRotations(*model, state, scratch);
      stiffnessTimes(*model, state, state.v, scratch);
      double stiffness_power = 0.0, mass_power = 0.0;
      for (std::size_t n = 0; n < state.v.size(); ++n) {
        stiffness_power += scratch.force2[n].dot(state.v[n]);
        mass_power -= model->mass[n] * state.v[n].squaredNorm();
      }
      EXPECT_LE(stiffness_power, 0.0);
      EXPECT_LT(mass_power, 0.0);
    }
  }
}

TEST(BlockLdlt, SolvesAndRefusesWhatIsNotPositiveDefinite) {
  const auto model = buildModel(shakenBox(Strain::Small), Use::Static);
  Scratch scratch(*model, 1);
  const State state = restState(*model);
  assemble(*model, state, 0.0, 1.0, Tangent::Frozen, scratch);
  ASSERT_TRUE(scratch.matrix.factorise());
  // K x by stiffnessTimes must give back the right side.
  Random random(12);
  std::vector<double> x(3 * model->free_node.size());
  for (double& value : x) value = random();
  const std::vector<double> b = x;
  scratch.matrix.solve(x.data());
  std::vector<Eigen::Vector3d> field(state.x.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < model->free_node.size(); ++i) {
    field[model->free_node[i]] = {x[3 * i], x[3 * i + 1], x[3 * i + 2]};
  }
  stiffnessTimes(*model, state, field, scratch);
  for (std::size_t i = 0; i < model->free_node.size(); ++i) {
    for (std::size_t d = 0; d < 3; ++d) {
      EXPECT_NEAR(-scratch.force2[model->free_node[i]][static_cast<Eigen::Index>(d)], b[3 * i + d], 1e-11);
    }
  }
  // Eight columns at once have the same bits as one by one.
  std::vector<double> many;
  for (int c = 0; c < 11; ++c) many.insert(many.end(), b.begin(), b.end());
  scratch.matrix.solveColumns(many.data(), 11, b.size());
  for (std::size_t i = 0; i < many.size(); ++i) ASSERT_EQ(many[i], x[i % b.size()]);
  assemble(*model, state, 0.0, -1.0, Tangent::Frozen, scratch);
  EXPECT_FALSE(scratch.matrix.factorise());
}

}  // namespace
}  // namespace vest::fem::test
