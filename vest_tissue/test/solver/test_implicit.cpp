// The implicit step: its matrix, its energies, and what it promises about any stiffness, mass and step.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "nets.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/solver/implicit_net.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

TEST(Skyline, SolvesWhatADenseFactorSolves) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  constexpr int kKnots = 12;
  const std::vector<std::uint32_t> first{0, 0, 1, 0, 3, 2, 6, 4, 5, 8, 10, 1};
  solver::Skyline sparse(kKnots, 2000);
  ASSERT_TRUE(sparse.shape(first.data(), kKnots));
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(3 * kKnots, 3 * kKnots);
  for (int i = 0; i < kKnots; ++i) {
    for (int j = static_cast<int>(first[i]); j <= i; ++j) {
      Eigen::Matrix3d b;
      for (int k = 0; k < 9; ++k) b(k / 3, k % 3) = value(random);
      if (i == j) b = (b * b.transpose() + 30.0 * Eigen::Matrix3d::Identity()).eval();
      sparse.add(i, j, b);
      dense.block<3, 3>(3 * i, 3 * j) = b;
      dense.block<3, 3>(3 * j, 3 * i) = b.transpose();
    }
  }
  Eigen::VectorXd right(3 * kKnots);
  for (Eigen::Index i = 0; i < right.size(); ++i) right[i] = value(random);
  const Eigen::VectorXd expected = dense.llt().solve(right);
  ASSERT_TRUE(sparse.factor());
  sparse.solve(right.data());
  EXPECT_LT((right - expected).norm(), 1e-12 * expected.norm());
}

TEST(Skyline, RefusesAMatrixThatIsNotPositiveAndAnEnvelopeThatDoesNotFit) {
  solver::Skyline m(2, 40);
  const std::uint32_t first[] = {0, 0};
  ASSERT_TRUE(m.shape(first, 2));
  m.add(0, 0, Eigen::Matrix3d::Identity());
  m.add(1, 1, -Eigen::Matrix3d::Identity());
  EXPECT_FALSE(m.factor());
  solver::Skyline small(2, 4);
  EXPECT_FALSE(small.shape(first, 2));
}

/// A tube's state with every kind of element, shaken.
struct Shaken {
  std::unique_ptr<scene::WorldModel> model;
  scene::ObjectState* s;
  solver::NetView net;
  solver::Positions x;
  Shaken() {
    specimen::TubeOptions o;
    o.rings = 5, o.around = 6, o.a2 = 1, o.a3 = 4, o.a4 = 9;
    auto d = specimen::tubeScene(o);
    auto& t = d.objects[0];
    scene::Link bend;
    bend.kind = scene::LinkKind::Bending;
    bend.knot0 = 0, bend.knot1 = 6, bend.knot2 = 12, bend.rest = M_PI, bend.stiffness = 2e-4;
    t.links.push_back(bend);
    bend.knot0 = 1, bend.knot1 = 7, bend.knot2 = 14, bend.rest = 2.4;
    t.links.push_back(bend);
    scene::Link plastic;
    plastic.kind = scene::LinkKind::Plastic;
    plastic.knot0 = 2, plastic.knot1 = 15, plastic.rest = 0.045, plastic.stiffness = 0.1;
    t.links.push_back(plastic);
    t.tethers.push_back({9, {0.01, 0.02, 0.05}, 30.0, 0.1});
    scene::VolumeElement v;
    v.bulk_modulus = 3e4;
    v.triangles = t.contact_triangles;
    for (scene::Index i = 1; i + 1 < 6; ++i) {  // the two ends, whatever way round: closed is what counts
      v.triangles.push_back({0, i + 1, i});
      v.triangles.push_back({24, 24 + i, 24 + i + 1});
    }
    const auto volume = [&] {
      double sum = 0;
      for (const auto& f : v.triangles)
        sum += t.rest_position[f[0]].dot(t.rest_position[f[1]].cross(t.rest_position[f[2]])) / 6;
      return sum;
    };
    v.rest_volume = 0.9 * std::fabs(volume());
    t.volumes.push_back(v);
    model = scene::buildModel(d);
    s = &model->start.objects[0];
    net.links.block = &s->block;
    net.links.count = s->links.size();
    net.links.stride = sizeof(scene::NetLink);
    net.links.first = &s->links[0].values;
    net.links.by_law = &s->links[0].by_law;
    net.links.law = s->law_links.law();
    net.elements = &s->elements;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> shake(-4e-4, 4e-4);
    for (const auto& p : t.rest_position)
      x.emplace_back(p.x() + shake(random), p.y() + shake(random), p.z() + shake(random));
  }
};

TEST(NetEnergy, ItsGradientIsItsDerivativeAndTheSameForceAsTheFloatKernels) {
  Shaken t;
  solver::Positions gradient(t.x.size(), Vector3d::Zero());
  solver::addNetGradient(t.net, t.x, gradient);
  double most = 0.0;
  for (const auto& g : gradient) most = std::max(most, g.norm());
  ASSERT_GT(most, 0.0);
  for (std::size_t i = 0; i < t.x.size(); ++i) {
    for (int a = 0; a < 3; ++a) {
      const double h = 1e-8, keep = t.x[i][a];
      t.x[i][a] = keep + h;
      const double more = solver::netEnergy(t.net, t.x);
      t.x[i][a] = keep - h;
      const double less = solver::netEnergy(t.net, t.x);
      t.x[i][a] = keep;
      EXPECT_NEAR(gradient[i][a], (more - less) / (2 * h), 2e-5 * most) << i << ' ' << a;
    }
  }
  net::Block& b = t.s->block;
  for (std::size_t i = 0; i < t.x.size(); ++i)
    for (int a = 0; a < 3; ++a)
      b.row(static_cast<net::Block::KnotRow>(net::Block::X + a))[i] = static_cast<float>(t.x[i][a]);
  net::addLinkForces(t.s->law_links, b.knotArrays(), net::KernelLevel::Baseline);
  const net::ElementArrays arrays{b.row(net::Block::X),  b.row(net::Block::Y),  b.row(net::Block::Z),
                                  b.row(net::Block::VX), b.row(net::Block::VY), b.row(net::Block::VZ),
                                  b.row(net::Block::FX), b.row(net::Block::FY), b.row(net::Block::FZ)};
  net::addElements(t.s->elements, arrays, net::KernelLevel::Baseline);
  net::addVolumes(t.s->elements.volumes, arrays);
  for (std::size_t i = 0; i < t.x.size(); ++i) {
    if (t.s->fixed[i]) continue;  // the kernels leave out links between two of them
    for (int a = 0; a < 3; ++a)
      EXPECT_NEAR(b.row(static_cast<net::Block::KnotRow>(net::Block::FX + a))[i], -gradient[i][a],
                  1e-3 * most);
  }
}

/// Adds up into a dense matrix.
struct Dense final : solver::StiffnessSink {
  Eigen::MatrixXd k;
  explicit Dense(std::size_t n) : k(Eigen::MatrixXd::Zero(3 * n, 3 * n)) {}
  void add(std::uint32_t i, std::uint32_t j, const Eigen::Matrix3d& b) override {
    k.block<3, 3>(3 * i, 3 * j) += b;
    if (i != j) k.block<3, 3>(3 * j, 3 * i) += b.transpose();
  }
};

TEST(NetEnergy, ItsStiffnessIsPositiveSemiDefinite) {
  Shaken t;
  Dense dense(t.x.size());
  solver::addNetStiffness(t.net, t.x, dense);
  const Eigen::VectorXd values = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense.k).eigenvalues();
  EXPECT_GT(values.minCoeff(), -1e-12 * values.maxCoeff());
}

TEST(NetEnergy, TheAngleIsThatOfTheArctangent) {
  for (double phi = 0; phi <= M_PI; phi += 0.001)
    EXPECT_NEAR(solver::angleOf(std::sin(phi), std::cos(phi)), phi, 1e-13);
}

/// Knots in a row along x, held at the first.
scene::Description chain(int knots, double mass, double k, const Vector3d& gravity, double dt) {
  scene::Description d;
  d.name = "chain";
  d.gravity = gravity;
  d.dt = dt;
  scene::Object o;
  o.name = "chain";
  for (int i = 0; i < knots; ++i) {
    o.rest_position.emplace_back(0.01 * i, 0, 0);
    o.mass.push_back(mass);
    o.damping.push_back(20.0 * mass);
    o.fixed.push_back(i == 0);
    if (i == 0) continue;
    scene::Link l;
    l.knot0 = i - 1, l.knot1 = i, l.rest = 0.01, l.stiffness = k;
    o.links.push_back(l);
  }
  o.position = o.rest_position;
  d.objects.push_back(o);
  return d;
}

double run(scene::World& w, double seconds, double dt) {
  scene::StepInput in;
  in.dt = dt;
  scene::StepReport report;
  double fastest = 0.0;
  std::vector<float> v(3 * w.knotCount(0));
  for (int i = 0; i < std::lround(seconds / dt); ++i) {
    EXPECT_NE(w.step(in, report), scene::Status::Fault) << "step " << i;
    w.velocities(0, v.data());
    for (const float u : v) fastest = std::isfinite(u) ? std::max(fastest, std::fabs(double(u))) : 1e9;
  }
  return fastest;
}

TEST(Implicit, AHangingChainSagsAsTheoryAtEveryStiffness) {
  for (int power = 0; power <= 12; power += 2) {
    const double k = 20.0 * std::pow(10.0, power);
    scene::World w(chain(6, 1e-3, k, Vector3d(9.81, 0, 0), 1e-3));
    run(w, 2.0, 1e-3);
    std::vector<float> p(3 * w.knotCount(0));
    w.positions(0, p.data());
    double expected = 0.05;  // each link carries the knots below it
    for (int i = 1; i <= 5; ++i) expected += i * 1e-3 * 9.81 / k;
    EXPECT_NEAR(p[15], expected, 1e-4 * (expected - 0.05) + 2e-8) << "stiffness times 10^" << power;
    EXPECT_EQ(w.model().objects[0].implicit, power >= 6) << power;
  }
}

TEST(Implicit, AStiffPendulumSwingsWithThePeriodOfTheory) {
  // T = 2 pi sqrt(l/g) (1 + a²/16): a step that stiffness locks would swing too slowly.
  auto d = chain(2, 1e-3, 2e13, Vector3d(0, 0, -9.81), 1e-3);
  d.objects[0].damping.assign(2, 0.0);
  d.objects[0].rest_position = {{0, 0, 0}, {0, 0, -0.01}};
  d.objects[0].position = {{0, 0, 0}, {0.01 * std::sin(0.2), 0, -0.01 * std::cos(0.2)}};
  scene::World w(d);
  ASSERT_TRUE(w.model().objects[0].implicit);
  scene::StepInput in;
  scene::StepReport report;
  std::vector<float> p(6);
  double last = 1.0, first_crossing = -1.0, last_crossing = 0.0;
  int crossings = -1;
  for (int i = 1; i <= 1200; ++i) {
    ASSERT_EQ(w.step(in, report), scene::Status::Ok);
    w.positions(0, p.data());
    if (last > 0 && p[3] <= 0) {
      last_crossing = 1e-3 * (i - 1 + last / (last - p[3]));
      if (++crossings == 0) first_crossing = last_crossing;
    }
    last = p[3];
    EXPECT_NEAR(std::hypot(p[3], p[5]), 0.01, 1e-7);
  }
  ASSERT_GE(crossings, 4);
  const double small = 2 * M_PI * std::sqrt(0.01 / 9.81);
  EXPECT_NEAR((last_crossing - first_crossing) / crossings, small, 0.01 * small);
}

TEST(Implicit, ATubeKeepsTheSagOfItsStiffnessWhetherExplicitOrImplicit) {
  // The same tube, heavy so that explicit sub-steps hold it, and with knots of a hundredth of the mass and a
  // hundred times the gravity: implicit, the same equilibrium.
  specimen::TubeOptions heavy;
  heavy.mass = 0.02, heavy.youngs_modulus = 60e3, heavy.knot_damping = 4e-3;
  auto d = specimen::tubeScene(heavy);
  auto light = d;
  for (double& m : light.objects[0].mass) m *= 1e-6;
  light.gravity *= 1e6;
  scene::World a(d), b(light);
  EXPECT_FALSE(a.model().objects[0].implicit);
  EXPECT_TRUE(b.model().objects[0].implicit);
  run(a, 3.0, 1e-3);
  run(b, 0.5, 1e-3);
  std::vector<float> p(3 * a.knotCount(0)), q(p.size());
  a.positions(0, p.data());
  b.positions(0, q.data());
  double sag = 0.0, apart = 0.0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    sag = std::max(sag, std::fabs(p[i] - d.objects[0].position[i / 3][i % 3]));
    apart = std::max(apart, double(std::fabs(p[i] - q[i])));
  }
  EXPECT_GT(sag, 1e-3);
  EXPECT_LT(apart, 0.01 * sag);
}

TEST(Implicit, EveryStiffnessMassAndStepMovesBoundedly) {
  specimen::TubeOptions o;
  o.rings = 8, o.around = 6;
  for (const double dt : {1e-6, 1e-4, 1e-3, 1e-2}) {
    for (int power = 0; power <= 12; power += 3) {
      for (const double mass : {1.0, 1e-6, 1e-15}) {
        auto options = o;
        options.youngs_modulus *= std::pow(10.0, power);
        auto d = specimen::tubeScene(options);
        d.dt = dt;
        for (double& m : d.objects[0].mass) m *= mass;
        scene::World w(d);
        const double fastest = run(w, 12 * dt, dt);
        // Falling freely for that time, and what the start's rounding to float holds, is all that may move.
        EXPECT_LT(fastest, 9.81 * 12 * dt + 0.02) << "E·10^" << power << ", mass·" << mass << ", dt " << dt;
      }
    }
  }
}

TEST(Implicit, AStretchedStiffNetReleasesNoMoreEnergyThanItHad) {
  specimen::TubeOptions o;
  o.youngs_modulus = 20e9;
  o.fix_ends = false;
  auto d = specimen::tubeScene(o);
  d.gravity.setZero();
  for (auto& p : d.objects[0].position) p.x() *= 1.2;
  scene::World w(d);
  ASSERT_TRUE(w.model().objects[0].implicit);
  scene::StepInput in;
  scene::StepReport report;
  auto total = [&] {
    const auto e = w.energy();
    return e.kinetic + e.elastic;
  };
  double last = total();
  for (int i = 0; i < 50; ++i) {
    ASSERT_NE(w.step(in, report), scene::Status::Fault);
    // Positions are float: what their rounding stores in a link of k = 1e7 N/m is allowed for.
    EXPECT_LT(total(), last * 1.000001 + 1e-7) << i;
    last = total();
  }
}

TEST(Implicit, CutsGoOnThroughTheImplicitStep) {
  specimen::TubeOptions o;
  o.youngs_modulus = 20e9;
  scene::World w(specimen::tubeScene(o));
  scene::StepInput in;
  scene::StepReport report;
  std::uint32_t copy = 0;
  for (int i = 0; i < 8; ++i) {
    w.removeLink(0, 40 + 3 * i);
    EXPECT_TRUE(w.splitKnot(0, 60 + i, Vector3d::UnitX(), copy));
    ASSERT_EQ(w.step(in, report), scene::Status::Ok) << i;
  }
  EXPECT_LT(run(w, 0.05, 1e-3), 2.0);
}

}  // namespace
