#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "temporary_scene.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/fem/simulate.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/world.h"

// Protects walls of several layers and surfaces of revolution: meshes that fit, the stiffness of theory, and
// scenes that load as they were baked.

using namespace vest::modelling;

namespace {

const std::string kPackage = VEST_TISSUE_SOURCE_DIR;

RingNet straight(double radius, double length, std::uint32_t rings, std::uint32_t around) {
  TubeSpec spec;
  spec.centre = {{0, 0, 0}, {0, 0, length}};
  spec.sections = {{0.0, {radius}}};
  spec.rings = rings;
  spec.around = around;
  spec.start = spec.end = End::Cap;
  return makeTube(spec);
}

vest::scene::Description bakeText(const std::string& text) {
  return bake(readSource("source.yaml", text), readMaterials(kPackage + "/data/materials.yaml"));
}

std::string wall(const std::string& layers,
                 const std::string& more = "    fixed: [{rings: [0, 0]}, {rings: [-1, -1]}]\n") {
  return "vest_source: 1\nname: wall\nobjects:\n  - name: bowel\n    organ: intestine\n    material: "
         "intestine\n"
         "    tube: {centre: [[0, 0, 0.05], [0.06, 0, 0.05]], reference: [0, 0, 1], rings: 9, around: 8, "
         "start: "
         "cap, end: cap, sections: [{at: 0, radii: [0.01]}]}\n    layers: " +
         layers + "\n" + more;
}

const std::string kThree =
    "[{material: peritoneum, thickness: 0.0005}, {material: intestine, thickness: 0.001, elements: 2}, "
    "{material: fat_soft, thickness: 0.0007}]";

}  // namespace

TEST(Layers, PrismsFitAndFillTheWall) {
  const RingNet net = straight(0.01, 0.04, 9, 24);
  const LayeredMesh mesh = makeLayers(net.knots, wallTriangles(net), {{"a", 0.002, 2}, {"b", 0.003, 1}});
  EXPECT_EQ(mesh.nodes.size(), 4u * 9 * 24);
  EXPECT_EQ(mesh.tetrahedra.size(), 3u * 3 * 2 * 8 * 24);
  double volume[2] = {0, 0};
  for (std::size_t e = 0; e < mesh.tetrahedra.size(); ++e) {
    const auto& t = mesh.tetrahedra[e];
    const auto& x = mesh.nodes;
    const double six = (x[t[1]] - x[t[0]]).dot((x[t[2]] - x[t[0]]).cross(x[t[3]] - x[t[0]]));
    ASSERT_GT(six, 0);
    volume[mesh.layer[e]] += six / 6;
  }
  const double polygon = 12 * std::sin(2 * M_PI / 24);  // area of a regular polygon over its radius squared
  EXPECT_NEAR(volume[0], polygon * (1e-4 - 0.64e-4) * 0.04, 1e-9);
  EXPECT_NEAR(volume[1], polygon * (0.64e-4 - 0.25e-4) * 0.04, 1e-9);
  // Outside, inside, and two open ends: no face is left over between the prisms.
  EXPECT_EQ(vest::scene::boundaryFaces(mesh.tetrahedra).size(), 2u * 2 * 8 * 24 + 2u * 2 * 3 * 24);
}

TEST(Layers, AWallThickerThanItsCurvatureAllowsIsRefusedWithThePlace) {
  const RingNet net = straight(0.01, 0.04, 9, 24);
  EXPECT_NO_THROW(makeLayers(net.knots, wallTriangles(net), {{"a", 0.0079, 4}}));
  try {
    makeLayers(net.knots, wallTriangles(net), {{"a", 0.0085, 4}});
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("too thick for the curvature at ["), std::string::npos)
        << error.what();
  }
}

// Two-layer tube in plane strain under inner pressure. Its ends move as theory says, so that it is of one
// length with the infinite one; what is compared are its walls in the middle.
TEST(Layers, LamesTubeOfTwoLayersGivesWayAsTheoryHasIt) {
  const double ro = 0.010, rm = 0.008, ri = 0.006, nu = 0.45, pressure = 1000;
  const double young[2] = {20000, 60000};  // outer, inner
  Eigen::Matrix4d system = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  const auto lambda = [&](int l) { return young[l] * nu / ((1 + nu) * (1 - 2 * nu)); };
  const auto mu = [&](int l) { return young[l] / (2 * (1 + nu)); };
  // u = A r + B/r in each layer; radial stress 2 (lambda + mu) A - 2 mu B/r².
  const auto stress = [&](int row, int l, double r, double sign) {
    system(row, 2 * l) += sign * 2 * (lambda(l) + mu(l));
    system(row, 2 * l + 1) -= sign * 2 * mu(l) / (r * r);
  };
  stress(0, 0, ro, 1);
  stress(1, 1, ri, 1);
  right[1] = -pressure;
  stress(2, 0, rm, 1);
  stress(2, 1, rm, -1);
  system.row(3) << rm, 1 / rm, -rm, -1 / rm;
  const Eigen::Vector4d c = system.fullPivLu().solve(right);
  const auto theory = [&](double r) {
    const int l = r > rm ? 0 : 1;
    return c[2 * l] * r + c[2 * l + 1] / r;
  };

  constexpr std::uint32_t kRings = 13, kAround = 48, kAcross = 4;
  const double length = 0.02;
  const RingNet net = straight(ro, length, kRings, kAround);
  const LayeredMesh mesh =
      makeLayers(net.knots, wallTriangles(net), {{"outer", ro - rm, kAcross}, {"inner", rm - ri, kAcross}});
  vest::fem::Description d;
  d.name = "lame";
  d.nodes = mesh.nodes;
  d.tetrahedra = mesh.tetrahedra;
  d.cell_material = mesh.layer;
  for (const double e : young) d.materials.push_back({e, nu, 1000.0, 0.0, 0.0});
  d.material = d.materials[0];
  const std::uint32_t level = kRings * kAround;
  for (std::uint32_t n = 0; n < d.nodes.size(); ++n) {
    const std::uint32_t ring = n % level / kAround;
    if (ring != 0 && ring + 1 != kRings) continue;
    Vector3 radial = d.nodes[n];
    radial.z() = 0;
    d.prescribed.push_back({n, theory(radial.norm()) / radial.norm() * radial});
  }
  const std::uint32_t inmost = static_cast<std::uint32_t>(d.nodes.size()) - level;
  for (const auto& t : wallTriangles(net)) {  // outward: the pressure pushes along it
    const Vector3 area = 0.5 * (d.nodes[inmost + t[1]] - d.nodes[inmost + t[0]])
                                   .cross(d.nodes[inmost + t[2]] - d.nodes[inmost + t[0]]);
    for (const auto k : t) d.loads.push_back({inmost + k, pressure / 3 * area});
  }
  vest::fem::Options options;
  options.equilibrium = true;
  const vest::fem::Result result = vest::fem::simulate(d, options);
  ASSERT_TRUE(result.report.converged);
  for (const bool inner : {false, true}) {
    double moved = 0;
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const std::uint32_t n = (inner ? inmost : 0) + kRings / 2 * kAround + k;
      Vector3 radial = d.nodes[n];
      radial.z() = 0;
      moved += (result.positions[n] - d.nodes[n]).dot(radial.normalized()) / kAround;
    }
    const double wanted = theory(inner ? ri : ro);
    std::printf("%s wall: %.4g, theory %.4g mm: %+.2f %%\n", inner ? "inner" : "outer", 1e3 * moved,
                1e3 * wanted, 100 * (moved / wanted - 1));
    EXPECT_NEAR(moved, wanted, 0.02 * wanted);
  }
}

TEST(Layers, ASceneWithAWallLoadsAsItWasBakedAndRuns) {
  const std::string text = wall(kThree) +
                           "  - name: vessel\n    organ: artery\n    material: artery\n    support: 25\n    "
                           "tube: {centre: [[0.01, 0, "
                           "0.0625], [0.05, 0, 0.0625]], reference: [0, 0, 1], rings: 12, around: 6, "
                           "start_dome: 0.001, end_dome: 0.001, "
                           "sections: [{at: 0, radii: [0.0015]}]}\n    connect: [{to: bowel, rings: [0, -1], "
                           "per_ring: 1, within: 0.004, "
                           "stiffness: 5}]\n";
  const auto baked = bakeText(text);
  const vest::test::TemporaryScene folder;
  writeScene(baked, folder.folder(), "source.yaml", text);
  const auto loaded = vest::scene::loadScene(folder.folder() + "/wall.yaml");
  ASSERT_EQ(loaded.objects.size(), 2u);
  const auto &a = *baked.objects[0].fem, &b = *loaded.objects[0].fem;
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.tetrahedra, b.tetrahedra);
  EXPECT_EQ(a.cell_material, b.cell_material);
  EXPECT_EQ(a.fixed, b.fixed);
  ASSERT_EQ(b.materials.size(), 3u);
  for (int l = 0; l < 3; ++l) EXPECT_EQ(a.materials[l].youngs_modulus, b.materials[l].youngs_modulus);
  EXPECT_EQ(baked.objects[0].mass, loaded.objects[0].mass);
  EXPECT_GT(loaded.connections.size(), 5u);
  vest::scene::World world(loaded);
  vest::scene::StepInput input;
  vest::scene::StepReport report;
  for (int i = 0; i < 300; ++i) {
    input.dt = 1e-3;
    input.step = static_cast<std::uint64_t>(i) + 1;
    ASSERT_EQ(world.step(input, report), vest::scene::Status::Ok);
  }
}

TEST(Layers, MistakesAreNamed) {
  const auto says = [](const std::string& text, const std::string& part) {
    try {
      bakeText(text);
      ADD_FAILURE() << part;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  };
  says(wall("[{material: wood, thickness: 0.001}]"), "source.yaml:8: object bowel: material wood");
  says(wall("[{material: intestine, thickness: 0.0095}]"), "too thick for the curvature");
  says(wall("[{material: intestine, thickness: 0.001}]", ""), "nothing holds it");
  says(wall("[{material: intestine, thickness: 0.001}]", "    support: 25\n"),
       "support: 25: belongs to nets");
  says(wall("[]"), "must be layers of 1 to 64 elements");
}

TEST(Revolve, AProfileFromPoleToPoleIsABall) {
  RevolveSpec spec;
  spec.origin = {0.1, 0, 0};
  for (int i = 0; i <= 16; ++i) {
    const double angle = M_PI * i / 16;
    spec.profile.push_back({-0.02 * std::cos(angle), i == 0 || i == 16 ? 0.0 : 0.02 * std::sin(angle)});
  }
  spec.rings = 31;
  spec.around = 48;
  const RingNet net = makeRevolve(spec);
  EXPECT_EQ(net.start, End::Pole);
  EXPECT_EQ(net.end, End::Pole);
  EXPECT_EQ(net.size(), 31u * 48 + 2);
  const double ball = 4.0 / 3 * M_PI * 8e-6;
  EXPECT_NEAR(enclosedVolume(net.knots, knotTriangles(net)), ball, 0.01 * ball);
  spec.axis = {0, 1, 0};
  spec.profile = {{0, 0.01}, {0.02, 0.012}, {0.04, 0.01}};
  EXPECT_EQ(makeRevolve(spec).start, End::Cap);
  spec.profile = {{0, 0.01}, {0.02, 0.0}, {0.04, 0.01}};
  EXPECT_THROW(makeRevolve(spec), std::invalid_argument);
}

TEST(Revolve, ABallOfLayersIsClosed) {
  const auto scene = bakeText(
      "vest_source: 1\nname: ball\nobjects:\n  - name: ball\n    organ: ovary\n    material: ovary\n    "
      "revolve: "
      "{origin: [0, 0, 0.05], axis: [0, 0, 1], profile: [[-0.01, 0], [-0.0071, 0.0071], [0, 0.01], [0.0071, "
      "0.0071], "
      "[0.01, 0]], rings: 9, around: 12}\n    layers: [{material: ovary, thickness: 0.002}, {material: "
      "fat_soft, "
      "thickness: 0.002}]\n    fixed: [{rings: [0, 1]}]\n");
  // A surface outside and one inside, each closed.
  EXPECT_EQ(scene.objects[0].contact_triangles.size(), 2u * (2 * 12 * 8 + 2 * 12));
}
