// Elements whose inside is condensed: the answers of the whole object at what can be touched, in a World like
// any other tissue, and what such an object does not do.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "../../src/fem/product.h"
#include "../../src/fem/tiles.h"
#include "slab.h"
#include "temporary_scene.h"
#include "theatre.h"
#include "vest_tissue/scene/world_model.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

using Eigen::Vector3d;

/// A slab of two tissues, held below and at one node inside, with loads outside and inside.
Description slabOf(Motion motion, int nx = 7, int ny = 6, int nz = 5) {
  SlabOptions o;
  o.motion = motion;
  o.nx = nx, o.ny = ny, o.nz = nz;
  Description d = slab(o);
  shake(d, 0.0004);
  d.materials = {d.material, d.material};
  d.materials[1].youngs_modulus *= 3.0, d.materials[1].density *= 1.2;
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e)
    d.cell_material.push_back(static_cast<std::uint16_t>(d.nodes[d.tetrahedra[e][0]].x() > 0.0));
  const Box box{nx, ny, nz, 0.06, 0.04, 0.012};
  d.fixed.push_back(box.node(2, 2, 3));
  d.loads = {{box.node(4, 3, 3), Vector3d(0.01, 0.0, -0.02)}, {box.node(3, 3, nz), Vector3d(0, 0.01, 0.01)}};
  return d;
}

/// The same mesh as one that keeps all its nodes.
Description whole(const scene::Object& condensed) {
  Description d = *condensed.fem;
  d.motion = Motion::Elastostatic;
  return d;
}

TEST(Condensed, ItsAnswersAreThoseOfTheWholeObjectBetweenOuterNodes) {
  const scene::Object o = object(slabOf(Motion::Condensed));
  const auto part = makeTissue(*o.fem, Motion::Condensed, "");
  prepareTissue(*part, 0.001);
  const auto all = makeTissue(whole(o), Motion::Elastostatic, "");
  prepareTissue(*all, 0.001);
  const std::size_t nodes = part->compliance.nodes();
  ASSERT_GT(nodes, 3 * Compliance::kTile);
  ASSERT_LT(nodes, all->model->free_node.size());
  const double scale = all->answer.cwiseAbs().maxCoeff();
  double error = 0.0;
  for (const Index a : part->model->free_node)
    for (const Index b : part->model->free_node) {
      const auto is = part->compliance.block(static_cast<std::size_t>(part->answer_number[a]),
                                             static_cast<std::size_t>(part->answer_number[b]));
      const Eigen::Matrix3d should =
          all->answer.block<3, 3>(3 * all->answer_number[a], 3 * all->answer_number[b]);
      error = std::max(error, (is - should).cwiseAbs().maxCoeff());
    }
  EXPECT_LT(error, 1e-7 * scale) << "single numbers are rounded to 6e-8 of them";
  // Weight and loads, those of inner nodes too.
  for (int i = 0; i < 4; ++i) {
    const auto at = static_cast<std::size_t>(std::min(i, 2));
    const Eigen::VectorXd &is = i < 3 ? part->unit_gravity[at] : part->under_loads,
                          &should = i < 3 ? all->unit_gravity[at] : all->under_loads;
    double off = 0.0, size = 0.0;
    for (const Index n : part->model->free_node) {
      const Vector3d want = should.segment<3>(3 * all->answer_number[n]);
      off = std::max(off, (is.segment<3>(3 * part->answer_number[n]) - want).norm());
      size = std::max(size, want.norm());
    }
    EXPECT_GT(size, 0.0) << i;
    EXPECT_LT(off, 1e-6 * size) << i;
  }
  EXPECT_NEAR(part->softest, all->softest, 0.3 * all->softest);
  for (const Index n : part->model->free_node)
    EXPECT_NEAR(part->softestAt(n), all->softestAt(n), 1e-6 * all->softestAt(n));
}

TEST(Condensed, ProductsHaveTheSameBitsOnEveryProcessorAndTheSweepForAnyThreads) {
  std::mt19937 dice(5);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const std::size_t rows = 203, columns = 101, depth = 401;
  std::vector<double> a(rows * depth), b(columns * depth), c(rows * columns, 1.0), other = c;
  for (double& x : a) x = number(dice);
  for (double& x : b) x = number(dice);
  Product p{c.data(), a.data(), b.data(), rows, rows, columns, rows, columns, depth};
  subtract(p);
  p.c = other.data();
  std::vector<double> room(kernel::kRoom);
  kernel::subtractBaseline(p, room.data());
  EXPECT_EQ(std::memcmp(c.data(), other.data(), c.size() * sizeof(double)), 0);
  double by_hand = 1.0;
  for (std::size_t k = 0; k < depth; ++k) by_hand -= a[202 + k * rows] * b[100 + k * columns];
  EXPECT_NEAR(c[202 + 100 * rows], by_hand, 1e-12);

  const std::size_t nodes = 17 * Compliance::kTile, size = 3 * nodes;
  const auto fill = [&](Tiles& t) {
    for (std::size_t i = 0; i < size; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        const double entry = i == j ? 4.0 : 1.0 / static_cast<double>((i - j) * (i - j) + 1);
        t.at(i, j) = entry;
        if (i / Tiles::kWide == j / Tiles::kWide) t.at(j, i) = entry;
      }
  };
  Tiles one(nodes), three(nodes);
  fill(one), fill(three);
  ASSERT_TRUE(sweep(one, 1, nullptr));
  ASSERT_TRUE(sweep(three, 3, nullptr));
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j <= i; ++j) ASSERT_EQ(one.at(i, j), three.at(i, j)) << i << " " << j;
}

/// Jaws that press, take hold and lift; what they feel, and where the outer nodes are.
struct Touched {
  Vector3d press, pull, reaction;
  std::vector<float> x;
};
Touched touch(const Description& d) {
  vest::test::Theatre t(sceneOf({object(d)}));
  const Vector3d above(0.0, 0.0, 0.030), pressed(0.0, 0.0, 0.0105), low(0.0, 0.0, 0.0108),
      lifted(0.001, 0.0, 0.015);
  const auto move = [&](const Vector3d& from, const Vector3d& to, double jaw0, double jaw1, int steps) {
    for (int i = 1; i <= steps && !testing::Test::HasFatalFailure(); ++i) {
      const double s = static_cast<double>(i) / steps;
      t.input.tools[1] = vest::specimen::grasper(from + s * (to - from), jaw0 + s * (jaw1 - jaw0));
      t.input.tools[1].pivot = Vector3d(0, 0, 0.17);
      t.step();
    }
  };
  Touched out;
  move(above, pressed, 0.0, 0.0, 200);
  out.press = t.report.contacts[1].wrench.head<3>();
  move(pressed, above, 0.0, 1.0, 200);
  move(above, low, 1.0, 1.0, 200);
  move(low, low, 1.0, 0.05, 200);
  EXPECT_TRUE(t.saw(scene::EventKind::Grasped));
  move(low, lifted, 0.05, 0.05, 200);
  out.pull = t.report.contacts[1].wrench.head<3>();
  out.reaction = t.world.reaction(0);
  out.x = positionsOf(t.world, 0);
  return out;
}

TEST(Condensed, IsPressedGraspedAndLiftedAsTheWholeObjectIs) {
  const Description d = slabOf(Motion::Condensed);
  const scene::Object o = object(d);
  const Touched is = touch(d), should = touch(whole(o));
  EXPECT_GT(should.press.norm(), 0.01);
  EXPECT_GT(should.pull.norm(), 0.01);
  // The motion of jaws feeds back: single numbers in it grow, but not far.
  EXPECT_LT((is.press - should.press).norm(), 1e-3 * should.press.norm());
  EXPECT_LT((is.pull - should.pull).norm(), 1e-3 * should.pull.norm());
  EXPECT_LT((is.reaction - should.reaction).norm(), 1e-3 * should.reaction.norm())
      << "the weight of its inside";
  double moved = 0.0, off = 0.0;
  ASSERT_EQ(is.x.size(), 3 * o.position.size());
  for (std::size_t i = 0; i < is.x.size(); ++i) {
    const double rest = o.rest_position[i / 3][static_cast<Eigen::Index>(i % 3)];
    moved = std::max(moved, std::fabs(double(should.x[i]) - rest));
    off = std::max(off, std::fabs(double(is.x[i]) - double(should.x[i])));
  }
  EXPECT_GT(moved, 0.002) << "m";
  EXPECT_LT(off, 1e-3 * moved);
}

// A bar without lateral contraction under an even pull: u = F L / (E A), exact for linear tetrahedra.
TEST(Condensed, ABarOfAFineMeshStretchesAsTheorySays) {
  Description d = makeBox({24, 6, 6, 0.06, 0.01, 0.01});
  d.motion = Motion::Condensed;
  d.material = {10e3, 0.0, 1000.0, 0.0, 0.0};
  const double pull = 0.05;  // N
  for (const auto& f : scene::boundaryFaces(d.tetrahedra)) {
    const Vector3d area = 0.5 * (d.nodes[f[1]] - d.nodes[f[0]]).cross(d.nodes[f[2]] - d.nodes[f[0]]);
    if (area.x() < 0.9 * area.norm() || d.nodes[f[0]].x() < 0.059) continue;
    for (const Index n : f) d.loads.push_back({n, Vector3d(pull / 1e-4 * area.x() / 3.0, 0, 0)});
  }
  scene::Description s = sceneOf({object(d)});
  s.gravity.setZero();
  vest::test::Theatre t(s);
  t.run(20);
  const auto x = positionsOf(t.world, 0);
  const double expected = pull * 0.06 / (10e3 * 1e-4);  // 3 mm
  const auto& rest = s.objects[0].rest_position;
  ASSERT_LT(rest.size(), d.nodes.size());
  for (std::size_t k = 0; k < rest.size(); ++k)
    ASSERT_NEAR(double(x[3 * k]) - rest[k].x(), expected * rest[k].x() / 0.06, 1e-5 * expected) << k;
  EXPECT_NEAR(t.world.reaction(0).x(), -pull, 1e-6 * pull);
}

TEST(Condensed, HasTheSameBitsForAnyThreadsAndAfterARestore) {
  SlabOptions o;
  o.motion = Motion::Condensed;
  const scene::Object one = object(slab(o));
  o.name = "other";
  scene::Object two = object(slab(o));
  for (auto* places : {&two.position, &two.rest_position})
    for (auto& p : *places) p.z() += 0.05;
  Description moved = *two.fem;
  for (auto& p : moved.nodes) p.z() += 0.05;
  two.fem = std::make_shared<const Description>(moved);
  const scene::Description s = sceneOf({one, two});
  vest::test::Theatre a(s, 1), b(s, 3);
  const auto both = [&](int from, int to) {
    for (int i = from; i < to; ++i)
      for (auto* t : {&a, &b}) {
        t->input.tools[1] = vest::specimen::grasper(Vector3d(0, 0, 0.02 - 1e-4 * i), 0.0);
        t->input.tools[1].pivot = Vector3d(0, 0, 0.17);
        t->step();
      }
  };
  both(0, 80);
  EXPECT_EQ(a.world.stateHash(), b.world.stateHash());
  std::vector<std::uint8_t> saved;
  a.world.save(saved);
  both(80, 100);
  const auto end = a.world.stateHash();
  EXPECT_EQ(end, b.world.stateHash());
  EXPECT_TRUE(a.report.contacts[1].in_contact);
  a.world.restore(saved), b.world.restore(saved);
  both(80, 100);
  EXPECT_EQ(a.world.stateHash(), end);
  EXPECT_EQ(b.world.stateHash(), end);
}

TEST(Condensed, BladesAndClipsLeaveItAsItIs) {
  SlabOptions o;
  o.motion = Motion::Condensed;
  const std::vector<std::pair<tools::ToolKind, std::uint32_t>> hands{
      {tools::ToolKind::Scissors, 0},
      {tools::ToolKind::CoagulationHook, tools::kFunctionCut},
      {tools::ToolKind::ClipApplier, 0}};
  for (const auto& [kind, functions] : hands) {
    vest::test::Theatre t(sceneOf({object(slab(o))}));
    const std::size_t knots = t.world.knotCount(0);
    t.use(kind, Vector3d(0.0, 0.0, 0.011), 1.0, 1.0, 50, functions);
    t.use(kind, Vector3d(0.0, 0.0, 0.011), 1.0, 0.0, 200, functions);
    t.use(kind, Vector3d(0.02, 0.0, 0.011), 0.0, 0.0, 200, functions);
    EXPECT_EQ(t.world.knotCount(0), knots);
    for (const auto event : {scene::EventKind::Cut, scene::EventKind::Clipped, scene::EventKind::Separated})
      EXPECT_FALSE(t.saw(event)) << int(kind) << " " << int(event);
    EXPECT_FALSE(t.world.state().objects[0].tissue.factored);
  }
}

TEST(Condensed, HeatGoesAlongItsSurface) {
  SlabOptions o;
  o.motion = Motion::Condensed;
  vest::test::Theatre t(sceneOf({object(slab(o))}));
  t.use(tools::ToolKind::CoagulationHook, Vector3d(0.0, 0.0, 0.0115), 0.0, 0.0, 1500,
        tools::kFunctionCoagulate);
  const auto& columns = t.world.state().objects[0].heat.columns;
  std::size_t warm = 0;
  for (std::size_t k = 0; k < t.world.knotCount(0); ++k) warm += columns[k].excess[0] > 1e-6f ? 1 : 0;
  EXPECT_GT(warm, 20u) << "knots: more than those of the triangles that the hook touches";
}

std::string refusal(const Description& d) {
  try {
    makeTissue(d, d.motion, "");
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Condensed, RefusesWhatItCannotBe) {
  SlabOptions o;
  o.motion = Motion::Condensed;
  o.nx = 56, o.ny = 56, o.nz = 1;
  EXPECT_EQ(refusal(*object(slab(o)).fem), "");
  o.hold = false;
  o.nx = 72, o.ny = 70;
  Description d = slab(o);
  d.fixed = {0, 1, 200};
  EXPECT_EQ(refusal(*object(d).fem),
            "object 'slab': integrator: condensed with 10363 free nodes at the surface and under the skin; "
            "allowed: at most 5000 (coarser cells, or more of it held)");
  d = slabOf(Motion::Condensed);
  d.strain = Strain::Corotational;
  EXPECT_EQ(refusal(*object(d).fem),
            "object 'slab': integrator: condensed with strain: corotational; allowed: small");
  d = slabOf(Motion::Condensed);
  d.fixed.clear();
  EXPECT_NE(refusal(*object(d).fem).find("has nothing fixed"), std::string::npos);
  d = slabOf(Motion::Elastostatic, 20, 14, 8);
  EXPECT_NE(refusal(d).find("coarser mesh, backward_euler or condensed"), std::string::npos);
  EXPECT_EQ(
      scene::condensedSentence(sceneOf({object(slabOf(Motion::Condensed))})).rfind("condensed: slab: ", 0),
      0u);
  EXPECT_EQ(scene::condensedSentence(sceneOf({object(slabOf(Motion::BackwardEuler))})), "");
}

TEST(Condensed, ASecondStartReadsWhatTheFirstPreparedAndDamageIsIgnored) {
  const vest::test::TemporaryScene folder;
  const std::string cache = folder.folder() + "/cache";
  const scene::Object o = object(slabOf(Motion::Condensed));
  int told = 0;
  const auto prepared = [&] {
    const auto t = makeTissue(*o.fem, Motion::Condensed, cache);
    told = 0;
    prepareTissue(*t, 0.001, [&](double share) {
      ++told;
      EXPECT_GE(share, 0.0);
      EXPECT_LE(share, 1.0);
    });
    return t;
  };
  const auto same = [](const TissueModel& a, const TissueModel& b) {
    return a.compliance.bytes() == b.compliance.bytes() &&
           std::memcmp(a.compliance.data(), b.compliance.data(), a.compliance.bytes()) == 0 &&
           a.under_loads == b.under_loads && a.unit_gravity[2] == b.unit_gravity[2] && a.softest == b.softest;
  };
  const auto first = prepared();
  EXPECT_GT(told, 3) << "long work says how far it is";
  EXPECT_TRUE(same(*first, *prepared()));
  EXPECT_EQ(told, 0) << "it was read";
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(cache)) {
    ++files;
    std::fstream file(entry.path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(100);
    file.put('x');
  }
  EXPECT_EQ(files, 2u);
  EXPECT_TRUE(same(*first, *prepared()));
  EXPECT_GT(told, 3) << "made anew";
}

}  // namespace
}  // namespace vest::fem::test
