// From images to a scene: a patient whose shapes are known comes back as labels, tetrahedra and a World that
// runs.
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <map>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "blades.h"
#include "phantom_files.h"
#include "theatre.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/image/patient.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/volume/stuffing.h"

namespace {

using namespace vest::image;
using vest::test::bytesOf;
using vest::test::refusal;
using vest::test::TemporaryScene;

constexpr double kSphere = 0.014;

/// A box of 50 HU around a sphere of 300 HU.
Phantom boxWithSphere() {
  return {"box",
          {-0.036, -0.036, -0.03},
          {0.036, 0.036, 0.03},
          {{Shape::Box, {0, 0, 0}, {0.030, 0.025, 0.020}, 50, 1},
           {Shape::Ellipsoid, {0.004, -0.002, 0.001}, {kSphere, kSphere, kSphere}, 300, 2}},
          {"box", "sphere"}};
}

const PhantomImage kImage{{48, 48, 40}, 15, 3};

Segment segmentOf(const std::string& name, const std::string& tissue, double low, double high) {
  Segment s;
  s.name = name, s.tissue = tissue, s.low = low, s.high = high;
  return s;
}

Patient patientOf() {
  Patient p;
  p.name = "box";
  p.segments = {segmentOf("box", "spleen", -400, 900), segmentOf("sphere", "kidney", 175, 900)};
  for (Segment& s : p.segments) s.largest = 1;
  p.cell = 0.005;
  return p;
}

TEST(Patient, ImagesBecomeTheShapesThatTheyShow) {
  const Phantom phantom = boxWithSphere();
  const Volume volume = picture(phantom, kImage);
  const auto found = segment(volume, patientOf()), exact = labels(phantom, kImage);
  std::size_t wrong = 0;
  for (std::size_t v = 0; v < exact.labels.size(); ++v) wrong += found.labels[v] != exact.labels[v];
  EXPECT_LT(wrong, exact.labels.size() / 100);
  const auto lattice = mesh(found, patientOf());
  const double sphere = phantom.shapes[1].volume();
  EXPECT_NEAR(vest::volume::volumeOf(lattice, 2) / sphere, 1, 0.03);
  EXPECT_NEAR(vest::volume::volumeOf(lattice, 1) / (phantom.shapes[0].volume() - sphere), 1, 0.03);
  const auto [least, greatest] = vest::volume::dihedralAngles(lattice);
  EXPECT_GE(least, 10.7);
  EXPECT_LE(greatest, 165.0001);
}

// Supine: the patient's left is at the trainee's left (-x), the front is up, the underside lies at `place`.
TEST(Patient, LiesOnItsBackAtItsPlace) {
  const auto lattice = mesh(segment(picture(boxWithSphere(), kImage), patientOf()), patientOf());
  Eigen::Vector3d low = lattice.nodes[0], high = low, sphere = Eigen::Vector3d::Zero();
  double of_sphere = 0;
  for (const auto& n : lattice.nodes) low = low.cwiseMin(n), high = high.cwiseMax(n);
  for (std::size_t t = 0; t < lattice.label.size(); ++t) {
    if (lattice.label[t] != 2) continue;
    const auto& n = lattice.tetrahedra[t];
    sphere += 0.25 * (lattice.nodes[n[0]] + lattice.nodes[n[1]] + lattice.nodes[n[2]] + lattice.nodes[n[3]]);
    ++of_sphere;
  }
  EXPECT_NEAR(low[2], 0.03, 1e-12);
  EXPECT_NEAR(high[0] - low[0], 0.060, 0.002);
  EXPECT_NEAR(high[1] - low[1], 0.040, 0.002);  // the patient's height lies along y
  EXPECT_NEAR(high[2] - low[2], 0.050, 0.002);
  const Eigen::Vector3d middle = sphere / of_sphere - 0.5 * (low + high);
  EXPECT_LT((middle - Eigen::Vector3d(-0.004, -0.001, 0.002)).norm(), 0.001) << middle;
}

TEST(Patient, TheSameRecipeGivesTheSameBytesAndASceneThatRuns) {
  const TemporaryScene first, second;
  const auto lattice = mesh(segment(picture(boxWithSphere(), kImage), patientOf()), patientOf());
  const std::string scene = writePatientScene(lattice, patientOf(), first.folder());
  writePatientScene(mesh(segment(picture(boxWithSphere(), kImage), patientOf()), patientOf()), patientOf(),
                    second.folder());
  for (const char* const name : {"box.yaml", "box.vtk", "box_held.csv"})
    EXPECT_TRUE(bytesOf(first.folder() + "/" + name) == bytesOf(second.folder() + "/" + name)) << name;
  auto description = vest::scene::loadScene(scene);
  description.cache_directory.clear();
  ASSERT_EQ(description.objects.at(0).position.size(), lattice.nodes.size());
  vest::scene::World world(description);
  vest::scene::StepInput input;
  vest::scene::StepReport report;
  input.dt = description.dt;
  for (int i = 0; i < 5; ++i) {
    input.step = world.steps();
    world.step(input, report);
  }
  EXPECT_EQ(world.steps(), 5u);
  EXPECT_EQ(report.status, vest::scene::Status::Ok) << report.fault_object;
}

// Chords of the cells stay inside a round shape, by cell^2 / 8 r = 0.2 mm here.
TEST(Patient, EachNodeOfASurfaceLiesWithinAVoxelOfTheShapeThatWasPictured) {
  const Volume volume = picture(boxWithSphere(), kImage);
  const auto lattice = mesh(segment(volume, patientOf()), patientOf());
  const double voxel = 0.072 / kImage.size[0];
  Eigen::AlignedBox3d all;
  std::map<std::array<std::uint32_t, 3>, std::vector<std::uint8_t>> faces;  // labels at both sides
  for (const auto& n : lattice.nodes) all.extend(n);
  for (std::size_t t = 0; t < lattice.tetrahedra.size(); ++t)
    for (std::size_t left_out = 0; left_out < 4; ++left_out) {
      std::array<std::uint32_t, 3> f{};
      for (std::size_t i = 0, k = 0; i < 4; ++i)
        if (i != left_out) f[k++] = lattice.tetrahedra[t][i];
      std::sort(f.begin(), f.end());
      faces[f].push_back(static_cast<std::uint8_t>(lattice.label[t]));
    }
  const Eigen::Vector3d sphere = all.center() + Eigen::Vector3d(-0.004, -0.001, 0.002),
                        half(0.030, 0.020, 0.025);
  std::size_t inner = 0, outer = 0;
  for (const auto& [corners, sides] : faces) {
    if (sides.size() == 2 && sides[0] == sides[1]) continue;
    for (const std::uint32_t c : corners) {
      const Eigen::Vector3d& x = lattice.nodes[c];
      if (sides.size() == 2) {
        EXPECT_NEAR((x - sphere).norm(), kSphere, voxel) << ++inner;
      } else {
        const double out = ((x - all.center()).cwiseAbs() - half).maxCoeff();
        EXPECT_NEAR(out, 0.0, voxel) << ++outer;
      }
    }
  }
}

TEST(Patient, TheSceneIsCutByAHookUnderCurrent) {
  for (const char* const integrator : {"backward_euler", "elastostatic"}) {
    const TemporaryScene folder;
    Patient p = patientOf();
    p.integrator = integrator;
    p.cell = 0.0065;  // few elements: this test is about what becomes of a scene
    const auto lattice = mesh(segment(picture(boxWithSphere(), kImage), p), p);
    auto description = vest::scene::loadScene(writePatientScene(lattice, p, folder.folder()));
    description.cache_directory.clear();
    Eigen::AlignedBox3d all;
    for (const auto& n : lattice.nodes) all.extend(n);
    vest::test::Theatre t(description);
    const std::size_t knots = t.world.knotCount(0);
    for (int i = 0; i < 200; ++i) {  // 20 mm across the upper face, 3 mm deep
      auto& hook = t.input.tools[1];
      hook = vest::specimen::toolAt(
          vest::tools::ToolKind::CoagulationHook,
          {all.center().x(), all.min().y() - 0.004 + 1e-4 * i, all.max().z() - 0.003}, {0, 0, -1}, {0, 1, 0});
      hook.functions = vest::tools::kFunctionCut;
      ASSERT_NO_FATAL_FAILURE(t.step()) << integrator;
    }
    EXPECT_GT(t.count(vest::scene::EventKind::Cut), 2u) << integrator;
    EXPECT_GT(t.world.knotCount(0), knots) << integrator << ": a furrow has two sides";
  }
}

TEST(Patient, AFineMeshBecomesAnObjectWhoseInsideIsCondensed) {
  const TemporaryScene folder;
  Patient p = patientOf();
  p.integrator = "condensed";
  const auto lattice = mesh(segment(picture(boxWithSphere(), kImage), p), p);
  auto description = vest::scene::loadScene(writePatientScene(lattice, p, folder.folder()));
  description.cache_directory.clear();
  ASSERT_LT(description.objects.at(0).position.size(), lattice.nodes.size()) << "inner nodes are no knots";
  vest::scene::World world(description);
  vest::scene::StepInput input;
  vest::scene::StepReport report;
  input.dt = description.dt;
  double weight = 0.0;
  for (std::size_t t = 0; t < lattice.tetrahedra.size(); ++t) {
    const auto& n = lattice.tetrahedra[t];
    const Eigen::Vector3d a = lattice.nodes[n[1]] - lattice.nodes[n[0]],
                          b = lattice.nodes[n[2]] - lattice.nodes[n[0]],
                          c = lattice.nodes[n[3]] - lattice.nodes[n[0]];
    weight += 9.81 * description.objects[0].fem->materialOf(t).density * a.dot(b.cross(c)) / 6.0;
  }
  for (int i = 0; i < 5; ++i) {
    input.step = world.steps();
    ASSERT_EQ(world.step(input, report), vest::scene::Status::Ok) << report.fault_object;
  }
  EXPECT_NEAR(world.reaction(0).z(), weight, 1e-4 * weight) << "what holds it bears its inside, too";
  p = readPatient(folder.write("patient.yaml",
                               "vest_patient: 1\nname: a\ncell: 5\nintegrator: condensed\nlabels: map.nrrd\n"
                               "tissues: [{label: 10, name: box, tissue: spleen}]\n"));
  EXPECT_EQ(p.integrator, "condensed");
}

TEST(Patient, ASceneThatItsReaderRefusesLeavesNoFile) {
  const TemporaryScene folder;
  const auto lattice = mesh(segment(picture(boxWithSphere(), kImage), patientOf()), patientOf());
  std::string message;
  try {
    writePatientScene(lattice, patientOf(), folder.folder(), [](const std::string& scene) {
      EXPECT_TRUE(std::filesystem::exists(scene));
      throw std::invalid_argument(scene + ":1: refused");
    });
  } catch (const std::invalid_argument& error) {
    message = error.what();
  }
  EXPECT_EQ(message, folder.folder() + "/box.yaml:1: refused");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder.folder()))
    ADD_FAILURE() << "left behind: " << entry.path();
}

/// Soft tissue, and beside it a plate of bone, three voxels thick.
Volume withPlate() {
  const Phantom phantom = {"plate",
                           {-0.036, -0.036, -0.03},
                           {0.036, 0.036, 0.03},
                           {{Shape::Box, {0, 0, -0.008}, {0.030, 0.025, 0.012}, 50, 1},
                            {Shape::Box, {0, 0, 0.016}, {0.028, 0.023, 0.00125}, 300, 2}},
                           {"soft", "plate"}};
  return picture(phantom, {{96, 96, 80}, 0, 3});
}

// A skull lost three quarters of its volume to a coarse cell, and the scene was called good.
TEST(Patient, ALabelThatLosesHalfOfItsVolumeIsTold) {
  const Volume volume = withPlate();
  Patient p = patientOf();
  p.segments = {segmentOf("soft", "liver", -20, 150), segmentOf("plate", "bone", 200, 900)};
  const auto found = segment(volume, p);
  const auto told = [&](double cell) {
    p.cell = cell;
    return lossSentence(volumesOf(found, mesh(found, p), 2), p);
  };
  const std::string message = told(0.004);
  EXPECT_EQ(message.rfind("plate: 5.8 ml of voxels became ", 0), 0u) << message;
  for (const char* const part : {" ml of elements", "cell 4:", "less than half", "take a smaller cell"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_EQ(message.find("soft"), std::string::npos) << message;
  EXPECT_EQ(told(0.002), "");
  const auto volumes = std::vector<LabelVolume>{{2e-6, 1e-6}, {2e-6, 0.99e-6}};
  EXPECT_EQ(lossSentence(volumes, p).rfind("plate: 2.0 ml of voxels became 1.0 ml", 0), 0u);
}

TEST(Recipe, BeginsWithACellThatKeepsItsLabels) {
  const TemporaryScene folder;
  const Volume volume = withPlate();
  const auto expectKept = [&](const std::string& recipe) {
    const Patient p = readPatient(folder.write("patient.yaml", recipe));
    const auto found = segment(volume, p);
    const auto lattice = mesh(found, p);
    EXPECT_EQ(lossSentence(volumesOf(found, lattice, p.segments.size()), p), "");
    EXPECT_LE(lattice.nodes.size(), 20000u);
    EXPECT_LT(p.cell, 0.004);
  };
  expectKept(firstPatient("a", "/x", volume));
  // Where all is thick, the cell stays a twentieth of the volume: a finer mesh is slower.
  Phantom thick = boxWithSphere();
  const Patient p =
      readPatient(folder.write("patient.yaml", firstPatient("a", "/x", picture(thick, kImage))));
  EXPECT_EQ(p.cell, 0.004);
  EXPECT_EQ(readPatient(folder.write("patient.yaml", firstPatient("a", "/x", volume, false))).cell, 0.004);
}

/// The labels of a phantom as voxels.
Volume mapOf(const Phantom& phantom) {
  Volume map = picture(phantom, kImage);
  const auto exact = labels(phantom, kImage);
  const std::shared_ptr<std::int16_t> values(new std::int16_t[map.voxels()],
                                             std::default_delete<std::int16_t[]>());
  for (std::size_t v = 0; v < map.voxels(); ++v)
    values.get()[v] = static_cast<std::int16_t>(10 * exact.labels[v]);
  map.whole = values;
  return map;
}

TEST(LabelMap, ShapesKeepTheirVolumesAndNames) {
  const TemporaryScene folder;
  const Phantom phantom = boxWithSphere();
  const double sphere = phantom.shapes[1].volume();
  for (const std::string name : {"map.nrrd", "map.mha"}) {
    write(mapOf(phantom), folder.folder() + "/" + name);
    const Patient p = readPatient(folder.write(
        "patient.yaml", "vest_patient: 1\nname: a\nlabels: " + name +
                            "\ncell: 5\ntissues:\n  - {label: 20, name: sphere, tissue: kidney}\n"
                            "  - {label: 10, name: box, tissue: spleen}\nheld: [box]\n"));
    EXPECT_EQ(p.held, std::vector<std::string>{"box"});
    const Volume map = readSource(p);
    EXPECT_EQ(countLabels(map).size(), 2u);
    const auto lattice = mesh(segment(map, p), p);
    EXPECT_NEAR(vest::volume::volumeOf(lattice, 1) / sphere, 1, 0.03) << name;
    EXPECT_NEAR(vest::volume::volumeOf(lattice, 2) / (phantom.shapes[0].volume() - sphere), 1, 0.03) << name;
  }
  const Patient first = readPatient(folder.write(
      "patient.yaml", firstOfLabels("b", "map.nrrd",
                                    readSource(readPatient(folder.write(
                                        "p.yaml",
                                        "vest_patient: 1\nname: a\nlabels: map.nrrd\ncell: 5\ntissues:\n"
                                        "  - {label: 10, name: box, tissue: spleen}\n"))))));
  ASSERT_EQ(first.segments.size(), 2u);
  EXPECT_EQ(first.segments[1].low, 20);
}

TEST(LabelMap, WhatIsNoneOrLiesElsewhereIsRefused) {
  const TemporaryScene folder;
  const auto refused = [&](const std::string& rest, const std::string& cause) {
    const std::string file =
        folder.write("patient.yaml", "vest_patient: 1\nname: a\ncell: 5\nlabels: map.nrrd\n" + rest);
    const std::string message = refusal([&] { readSource(readPatient(file)); });
    EXPECT_NE(message.find(cause), std::string::npos) << message;
    EXPECT_EQ(message.rfind(folder.folder() + "/", 0), 0u) << message;
  };
  const std::string box = "tissues: [{label: 10, name: box, tissue: spleen}]\n";
  const Volume map = mapOf(boxWithSphere());
  Volume moved = map;
  moved.origin += 0.6 * map.axes.col(2);
  write(map, folder.folder() + "/map.nrrd");
  write(moved, folder.folder() + "/moved.nrrd");
  write(map, folder.folder() + "/same.mha");
  EXPECT_EQ(refusal([&] {
              readSource(readPatient(folder.write(
                  "patient.yaml",
                  "vest_patient: 1\nname: a\ncell: 5\nlabels: map.nrrd\nimages: same.mha\n" + box)));
            }),
            "");
  refused(box + "images: moved.nrrd\n", "another grid");
  refused(box + "images: none.nrrd\n",
          "patient.yaml: images: " + folder.folder() + "/none.nrrd: No such file");
  refused(box + "resample: true\n", "images");
  refused("", "tissues");
  refused(box + "place: [0, -1e9, 0]\n", "within 100 m");
  refused("tissues: [{label: 0, name: box, tissue: spleen}]\n", "label");
  refused("tissues: [{values: [1, 2], name: box, tissue: spleen}]\n", "label");
  refused("tissues: [{label: 10, name: a, tissue: spleen}, {label: 10, name: b, tissue: liver}]\n",
          "label of its own");
  write(picture(boxWithSphere(), kImage), folder.folder() + "/map.nrrd");
  refused(box, "is no label map");
}

/// Values along a line of voxels, as a volume.
Volume line(const std::vector<std::int16_t>& values) {
  Volume v;
  v.size = {static_cast<std::uint32_t>(values.size()), 1, 1};
  v.axes *= 0.001;
  v.slices.resize(1);
  const auto copy =
      std::shared_ptr<std::int16_t>(new std::int16_t[values.size()], std::default_delete<std::int16_t[]>());
  std::copy(values.begin(), values.end(), copy.get());
  v.whole = copy;
  return v;
}

std::vector<std::uint16_t> labelled(const std::vector<std::int16_t>& values, const Segment& s) {
  Patient p;
  p.segments = {s};
  return segment(line(values), p).labels;
}

TEST(Segment, ClosesGrowsAndKeepsTheLargest) {
  const std::vector<std::int16_t> values{9, 9, 0, 9, 9, 9, 0, 0, 0, 9, 0, 0};
  using Labels = std::vector<std::uint16_t>;
  Segment s = segmentOf("nine", "liver", 5, 10);
  EXPECT_EQ(labelled(values, s), (Labels{1, 1, 0, 1, 1, 1, 0, 0, 0, 1, 0, 0}));
  s.closing = 1;
  EXPECT_EQ(labelled(values, s), (Labels{1, 1, 1, 1, 1, 1, 0, 0, 0, 1, 0, 0}));
  s.largest = 1;
  EXPECT_EQ(labelled(values, s), (Labels{1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0}));
  s.largest = 0, s.grows = true, s.from = {0.009, 0, 0};
  EXPECT_EQ(labelled(values, s), (Labels{0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0}));
  s.from = {0.011, 0, 0};
  EXPECT_NE(refusal([&] { labelled(values, s); }).find("nine: from"), std::string::npos);
  s = segmentOf("ten", "liver", 10, 10);
  EXPECT_NE(refusal([&] { labelled(values, s); }).find("ten: no voxel"), std::string::npos);
}

TEST(Segment, MedianFillsHolesAndDropsCorners) {
  Volume block = line(std::vector<std::int16_t>(125, 9));
  block.size = {5, 5, 5};
  block.slices.resize(5);
  const_cast<std::int16_t*>(block.whole.get())[62] = 0;  // the middle
  Patient p;
  p.segments = {segmentOf("nine", "liver", 5, 10)};
  p.segments[0].median = 1;
  const auto labels = segment(block, p);
  EXPECT_EQ(labels.at(2, 2, 2), 1);
  EXPECT_EQ(labels.at(0, 2, 2), 1);
  EXPECT_EQ(labels.at(0, 0, 0), 0);
  p.cropped = true, p.low.setZero(), p.high.setConstant(0.0021);
  EXPECT_EQ(segment(block, p).at(2, 2, 3), 0);
}

TEST(Recipe, IsReadStrictly) {
  const TemporaryScene folder;
  const auto recipe = [&](const std::string& labels) {
    return folder.write("patient.yaml",
                        "vest_patient: 1\nname: a\nimages: dicom\ncell: 5\nlabels: [" + labels + "]\n");
  };
  const std::string good = "{name: liver, tissue: liver, values: [0, 100], from: [10, 20, 30]}";
  const Patient p = readPatient(recipe(good));
  EXPECT_EQ(p.images, folder.folder() + "/dicom");
  EXPECT_EQ(p.segments.at(0).from, Eigen::Vector3d(0.010, 0.020, 0.030));
  EXPECT_EQ(p.cell, 0.005);
  for (const char* const bad :
       {"", "{name: liver, tissue: cheese, values: [0, 100]}", "{name: liver, tissue: liver, values: [9, 1]}",
        "{name: liver, tissue: liver}", "{name: liver, tissue: liver, values: [0, 1], colour: red}"}) {
    const std::string message = refusal([&] { readPatient(recipe(bad)); });
    EXPECT_NE(message.find("patient.yaml:"), std::string::npos) << bad << ": " << message;
  }
  EXPECT_NE(refusal([&] { readPatient(recipe(good + ", " + good)); }).find("name of its own"),
            std::string::npos);
  for (const char* const crop : {"[[5, -5, -5], [-5, 5, 5]]", "[[0, 0, 0], [1, 1, 0]]"}) {
    const std::string message = refusal([&] { readPatient(recipe(good + "]\ncrop: " + crop + " #")); });
    EXPECT_NE(message.find("patient.yaml:6: crop: "), std::string::npos) << message;
  }
  const Volume head = vest::test::headOf(24, 8);
  EXPECT_EQ(readPatient(folder.write("patient.yaml", firstPatient("b", "/x", head))).images, "/x");
  const std::string odd = "/a: b #c\\\"d";
  EXPECT_EQ(readPatient(folder.write("patient.yaml", firstPatient("b", odd, head))).images, odd);
  // Its scene would take the recipe's place.
  EXPECT_NE(refusal([&] {
              readPatient(folder.write("patient.yaml", firstPatient("patient", "/x", head)));
            }).find("name: patient: must be another"),
            std::string::npos);
}

}  // namespace
