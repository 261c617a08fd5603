#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/SVD>

#include "theatre.h"
#include "vest_tissue/interaction/clip.h"
#include "vest_tissue/scene/request.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Eigen::Vector3d;

scene::Description vessel(bool held = true) {
  specimen::TubeOptions o;
  o.radius = 0.0025, o.rings = 24, o.length = 0.07, o.mass = 0.0012, o.fix_ends = held;
  scene::Description d = specimen::tubeScene(o);
  d.gravity.setZero();
  return d;
}

struct Theatre : test::Theatre {
  explicit Theatre(const scene::Description& d = vessel(), int threads = 1) : test::Theatre(d, threads) {}
  /// The applier's jaws, open along y, about the vessel at x; closing from `jaw0` to `jaw1`.
  void close(double x, double jaw0, double jaw1, int steps) {
    use(tools::ToolKind::ClipApplier, Vector3d(x, 0, 0.0435), jaw0, jaw1, steps);
  }
  void clip(double x) {
    close(x, 0.6, 0.6, 60);
    close(x, 0.6, 0.0, 300);
  }
  std::vector<Vector3d> knots() {
    std::vector<float> p(3 * world.knotCount(0));
    world.positions(0, p.data());
    std::vector<Vector3d> out;
    for (std::size_t i = 0; i < p.size(); i += 3) out.emplace_back(p[i], p[i + 1], p[i + 2]);
    return out;
  }
  /// Cross-section of a ring of eight, m².
  double section(int ring) {
    const auto p = knots();
    return interaction::polygonArea(p.data() + 8 * ring, 8);
  }
  double narrowest() {
    double least = 1.0;
    for (int r = 0; r < 24; ++r) least = std::min(least, section(r));
    return least;
  }
  std::vector<scene::Attachment> clips() {
    std::vector<scene::Attachment> all, some;
    world.attachments(all);
    for (const auto& a : all)
      if (a.kind == 1) some.push_back(a);
    return some;
  }
};

TEST(Clip, ClosesAVesselTellsWhereAndStaysWhenTheApplierIsGone) {
  Theatre t;
  const double whole = t.section(12);
  t.clip(0.0);
  const scene::Event* e = t.event(scene::EventKind::Clipped);
  ASSERT_NE(e, nullptr);
  EXPECT_NEAR(e->station, 0.035, 0.003) << "the middle of the tube";
  EXPECT_NEAR(e->area, whole, 0.25 * whole);
  EXPECT_GT(e->force, 0.0);
  EXPECT_EQ(e->instrument, 1);
  EXPECT_NEAR(e->position.x(), 0.0, 0.002);
  t.close(0.0, 0.0, 0.6, 100);
  t.leave();
  t.run(2000);
  EXPECT_LT(t.narrowest(), 0.2 * whole) << "the lumen is shut";
  ASSERT_EQ(t.clips().size(), 1u);
  const auto clip = t.clips()[0];
  EXPECT_GT(clip.closure, 0.95);
  EXPECT_EQ(clip.station, e->station);
  EXPECT_EQ(clip.instrument, -1);
  EXPECT_NEAR(clip.pose.linear().determinant(), 1.0, 1e-9);
  EXPECT_GT(clip.pose.linear().col(2).z(), -1.01);
  EXPECT_LT(clip.pose.linear().col(2).z(), -0.9) << "its legs point where the applier pointed";
  EXPECT_NEAR(std::fabs(clip.pose.linear().col(1).x()), 1.0, 0.05) << "y along the vessel";
  const auto rest = t.knots();
  t.run(1000);
  double moved = 0.0;
  const auto now = t.knots();
  for (std::size_t i = 0; i < rest.size(); ++i) moved = std::max(moved, (now[i] - rest[i]).norm());
  EXPECT_LT(moved, 2e-5) << "it does not creep";
}

TEST(Clip, MovesWithTheOrganAndTurnsWithIt) {
  Theatre t(vessel(false));
  t.clip(0.0);
  t.leave();
  t.run(500);
  ASSERT_EQ(t.clips().size(), 1u);
  const auto before = t.clips()[0];
  t.input.edits.push_back({"", "gravity_x", 1.0});
  t.step();
  t.input.edits.clear();
  const auto from = t.knots();
  t.run(200);
  const auto to = t.knots();
  Vector3d organ = Vector3d::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) organ += (to[i] - from[i]) / static_cast<double>(from.size());
  const auto after = t.clips()[0];
  EXPECT_GT(organ.x(), 0.005);
  EXPECT_NEAR((after.pose.translation() - before.pose.translation() - organ).norm(), 0.0, 0.002);
  EXPECT_GT(after.closure, 0.95);
}

TEST(Clip, PutsNoNetForceAndNoNetTorqueOnTheTissue) {
  auto d = vessel(false);
  for (auto& g : d.objects[0].damping) g = 0.0;
  Theatre t(d);
  t.clip(0.0);
  t.leave();
  t.step();
  const auto& mass = d.objects[0].mass;
  const auto momenta = [&](Vector3d& linear, Vector3d& angular) {
    std::vector<float> v(3 * t.world.knotCount(0));
    t.world.velocities(0, v.data());
    const auto p = t.knots();
    linear.setZero(), angular.setZero();
    for (std::size_t i = 0; i < p.size(); ++i) {
      const Vector3d u = mass[i] * Vector3d(v[3 * i], v[3 * i + 1], v[3 * i + 2]);
      linear += u;
      angular += p[i].cross(u);
    }
  };
  Vector3d l0, a0, l1, a1;
  momenta(l0, a0);
  t.run(3000);
  momenta(l1, a1);
  const double force = t.event(scene::EventKind::Clipped)->force;
  ASSERT_GT(force, 1e-3);
  EXPECT_LT((l1 - l0).norm(), 1e-6 * force * 3.0) << "N·s: a millionth of what a leg presses";
  EXPECT_LT((a1 - a0).norm(), 1e-4 * force * 0.005 * 3.0) << "N·m·s";
  EXPECT_EQ(t.clips().size(), 1u);
}

TEST(Clip, RemovedItLetsTheVesselOpenAgain) {
  Theatre t;
  const double whole = t.section(12);
  t.clip(0.0);
  t.close(0.0, 0.0, 0.6, 50);
  t.leave();
  t.run(200);
  ASSERT_EQ(t.clips().size(), 1u);
  scene::TopologyRequest request =
      scene::parseRequest("remove_clip " + std::to_string(t.clips()[0].id), t.world.description());
  EXPECT_EQ(scene::requestText(request, t.world.description()),
            "remove_clip " + std::to_string(t.clips()[0].id));
  t.input.requests = {request};
  t.step();
  t.input.requests.clear();
  ASSERT_NE(t.event(scene::EventKind::Unclipped), nullptr);
  EXPECT_EQ(t.event(scene::EventKind::Unclipped)->station, t.event(scene::EventKind::Clipped)->station);
  EXPECT_TRUE(t.clips().empty());
  t.run(3000);
  EXPECT_GT(t.narrowest(), 0.6 * whole);
  EXPECT_THROW(scene::parseRequest("remove_clip", t.world.description()), std::invalid_argument);
  EXPECT_THROW(scene::parseRequest("remove_clip 3 4", t.world.description()), std::invalid_argument);
}

TEST(Clip, OneClosingOfTheJawsSetsOneClipAndAnEmptyOneNone) {
  Theatre t;
  t.clip(0.0);
  t.close(0.0, 0.0, 0.0, 300);
  EXPECT_EQ(t.clips().size(), 1u);
  t.close(0.0, 0.0, 0.6, 100);
  t.clip(0.010);
  EXPECT_EQ(t.clips().size(), 2u);
  t.close(0.010, 0.0, 0.6, 100);
  for (int i = 1; i <= 400; ++i) {  // in the air
    auto& tool = t.input.tools[1];
    tool = specimen::grasper(Vector3d(0, 0.03, 0.08), 0.6 - 0.6 * i / 400);
    tool.tool = tools::ToolKind::ClipApplier;
    tool.pivot = Vector3d(0, 0.03, 0.2);
    t.step();
  }
  EXPECT_EQ(t.clips().size(), 2u);
}

TEST(Clip, JawsThatOpenBeforeItIsShutLeaveNone) {
  Theatre t;
  t.close(0.0, 0.6, 0.6, 60);
  t.close(0.0, 0.6, 0.25, 200);
  ASSERT_EQ(t.clips().size(), 1u) << "it forms";
  EXPECT_LT(t.clips()[0].closure, 0.95);
  t.close(0.0, 0.25, 0.6, 200);
  EXPECT_TRUE(t.clips().empty());
  EXPECT_EQ(t.event(scene::EventKind::Clipped), nullptr);
}

TEST(Clip, PinchesTissueThatIsNoTube) {
  auto d = vessel();
  d.objects[0].tube = {};
  Theatre t(d);
  t.clip(0.0);
  const scene::Event* e = t.event(scene::EventKind::Clipped);
  ASSERT_NE(e, nullptr);
  EXPECT_TRUE(std::isnan(e->station));
  EXPECT_TRUE(std::isnan(e->area));
  t.leave();
  t.run(500);
  EXPECT_LT(t.narrowest(), 0.5 * M_PI * 0.0025 * 0.0025);
}

TEST(Clip, HashesAreTheSameForAnyThreadsAndAfterRestore) {
  const auto hashes = [](int threads, bool restored) {
    Theatre t(vessel(), threads);
    t.close(0.0, 0.6, 0.6, 60);
    t.close(0.0, 0.6, 0.15, 200);  // half formed
    if (restored) {
      std::vector<std::uint8_t> bytes;
      t.world.save(bytes);
      scene::World other(vessel(), threads);
      other.restore(bytes);
      t.world = std::move(other);
    }
    t.close(0.0, 0.15, 0.0, 100);
    t.leave();
    t.run(100);
    EXPECT_EQ(t.clips().size(), 1u);
    return t.world.stateHash();
  };
  const auto reference = hashes(1, false);
  EXPECT_EQ(hashes(2, false), reference);
  EXPECT_EQ(hashes(4, false), reference);
  EXPECT_EQ(hashes(2, true), reference);
}

/// A group of knots as a clip holds it: long along z, thin along x.
struct Group {
  std::vector<Vector3d> shape;
  std::vector<double> mass;
  Group() {
    std::mt19937 dice(5);
    const auto random = [&](double size) { return size * (dice() / 2147483648.0 - 1.0); };
    for (int i = 0; i < 16; ++i) {
      shape.emplace_back(random(0.2e-3), random(0.5e-3), random(8e-3));
      mass.push_back(1e-6 * (1.0 + std::fabs(random(0.5))));
    }
    Vector3d centre = Vector3d::Zero();
    double total = 0.0;
    for (std::size_t i = 0; i < shape.size(); ++i) centre += mass[i] * shape[i], total += mass[i];
    for (Vector3d& p : shape) p -= centre / total;
  }
  Eigen::Matrix3d moment(const Eigen::Matrix3d& turn, double noise) const {
    std::mt19937 dice(7);
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < shape.size(); ++i) {
      const Vector3d off(dice() / 4294967296.0 - 0.5, dice() / 4294967296.0 - 0.5,
                         dice() / 4294967296.0 - 0.5);
      sum += mass[i] * (turn * shape[i] + noise * off) * shape[i].transpose();
    }
    return sum;
  }
  Eigen::Matrix3d inertia() const {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < shape.size(); ++i)
      sum +=
          mass[i] * (shape[i].squaredNorm() * Eigen::Matrix3d::Identity() - shape[i] * shape[i].transpose());
    return sum;
  }
};

double angleBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a * b.transpose()).angle();
}

// Protects the Newton matrix: divided by the trace instead, the turn of a thin group about its own axis stays
// far behind.
TEST(ClipRotation, IsThePolarFactorForTurnsAboutEveryAxisOfAThinGroup) {
  const Group group;
  const Vector3d axes[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ(),
                           Vector3d(1, 2, -1).normalized()};
  for (const Vector3d& axis : axes) {
    for (const double angle : {1e-6, 0.05, 0.4}) {
      const Eigen::Matrix3d turn = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
      for (const double noise : {0.0, 0.1e-3}) {
        const Eigen::Matrix3d moment = group.moment(turn, noise);
        const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moment, Eigen::ComputeFullU | Eigen::ComputeFullV);
        Eigen::Matrix3d polar = svd.matrixU() * svd.matrixV().transpose();
        if (polar.determinant() < 0.0) {
          Eigen::Matrix3d u = svd.matrixU();
          u.col(2) = -u.col(2);
          polar = u * svd.matrixV().transpose();
        }
        const Eigen::Matrix3d found = interaction::nearestRotation(moment, Eigen::Matrix3d::Identity());
        EXPECT_LT(angleBetween(found, polar), 1e-4) << axis.transpose() << ", " << angle << ", " << noise;
        EXPECT_LT((found * found.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
      }
    }
  }
}

TEST(ClipRotation, ReachesALargeTurnWithinAFewCalls) {
  const Group group;
  for (const Vector3d& axis : {Vector3d(Vector3d::UnitY()), Vector3d(Vector3d(1, 1, 1).normalized())}) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0, axis).toRotationMatrix();
    Eigen::Matrix3d found = Eigen::Matrix3d::Identity();
    for (int i = 0; i < 4; ++i) {
      found = interaction::nearestRotation(group.moment(turn, 0.0), found);
      EXPECT_NEAR(found.determinant(), 1.0, 1e-12);
    }
    EXPECT_LT(angleBetween(found, turn), 1e-6);
  }
}

TEST(ClipRotation, OfAMomentThatSaysNothingStaysARotation) {
  const Eigen::Matrix3d guess = Eigen::AngleAxisd(0.7, Vector3d(0, 0.6, 0.8)).toRotationMatrix();
  for (const Eigen::Matrix3d& moment : {Eigen::Matrix3d(Eigen::Matrix3d::Zero()),
                                        Eigen::Matrix3d(Vector3d(1, 0, 0) * Vector3d(1, 0, 0).transpose()),
                                        Eigen::Matrix3d(-Eigen::Matrix3d::Identity())}) {
    const Eigen::Matrix3d found = interaction::nearestRotation(moment, guess);
    EXPECT_TRUE(found.allFinite());
    EXPECT_LT((found * found.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  }
}

// Protects the bound of the spin: without it an error of the thin axis by a thousandth became many times the
// energy.
TEST(ClipSpin, IsThatOfTheMomentumWhereTheEnergyAllowsIt) {
  const Eigen::Matrix3d inertia = Group().inertia();
  const Vector3d momentum = inertia * Vector3d(3.0, -2.0, 5.0);
  const double energy = 0.5 * Vector3d(3.0, -2.0, 5.0).dot(momentum);
  const Vector3d turn = interaction::boundedTurn(inertia, momentum, 1.001 * energy);
  EXPECT_LT((turn - Vector3d(3.0, -2.0, 5.0)).norm(), 1e-4);
}

TEST(ClipSpin, AboutTheThinAxisNeverHasMoreEnergyThanThereWas) {
  // kg m²: 50 mm along z, a hundredth of that across.
  const Eigen::Matrix3d inertia = Vector3d(1e-5, 1e-5, 1e-10).asDiagonal();
  const double about_x = 1e-6;                           // N·m·s
  const double energy = 0.5 * about_x * about_x / 1e-5;  // J, of the turn about x alone
  for (const double leaked : {1e-9, 1e-8, 1e-7}) {       // N·m·s about z that are not really there
    const Vector3d momentum(about_x, 0.0, leaked);
    const Vector3d turn = interaction::boundedTurn(inertia, momentum, 1.05 * energy);
    EXPECT_LE(0.5 * turn.dot(inertia * turn), 1.05 * energy * (1.0 + 1e-5)) << leaked;
    EXPECT_NEAR(turn.x(), about_x / 1e-5, 0.02 * about_x / 1e-5) << "the real turn goes on: " << leaked;
  }
  EXPECT_EQ(interaction::boundedTurn(inertia, Vector3d(1e-6, 0, 0), 0.0).norm(), 0.0) << "no energy, no turn";
}

TEST(Clip, FlatteningKeepsThePerimeter) {
  const Vector3d ring[8] = {{0, 0, 3},  {2, 0, 2},   {3, 0, 0},  {2, 0, -2},
                            {0, 0, -3}, {-2, 0, -2}, {-3, 0, 0}, {-2, 0, 2}};
  Vector3d flat[8];
  interaction::flattenRing(ring, 8, 0.1, flat);
  double before = 0.0, after = 0.0;
  for (int i = 0; i < 8; ++i) {
    before += (ring[(i + 1) % 8] - ring[i]).norm();
    after += (flat[(i + 1) % 8] - flat[i]).norm();
  }
  EXPECT_NEAR(after, before, 0.02 * before);
  EXPECT_LT(interaction::polygonArea(flat, 8), 0.1 * interaction::polygonArea(ring, 8));
  EXPECT_GT(flat[2].x() * ring[2].x(), 0.0) << "each side stays on its side";
  EXPECT_NEAR(interaction::polygonArea(ring, 8), 24.0, 1e-9);  // the octagon's, by the shoelace formula
}

}  // namespace
