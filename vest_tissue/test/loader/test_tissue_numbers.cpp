// A tissue's name is enough: what it cuts, tears and slides like, and what a scene writes in its place.
#include <gtest/gtest.h>

#include "../../src/cli/check_table.h"
#include "temporary_scene.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/tissue_numbers.h"
#include "vest_tissue/scene/world.h"

namespace vest::scene {
namespace {

const material::Tissue& tissueOf(const std::string& name) {
  static const material::Database database =
      material::readDatabase(std::string(VEST_TISSUE_SOURCE_DIR) + "/data/materials.yaml");
  return database.at(name);
}

void expectNumbersOf(const Object& object, const std::string& tissue) {
  SCOPED_TRACE(object.name + " of " + tissue);
  const material::Tissue& of = tissueOf(tissue);
  EXPECT_EQ(object.cut_toughness, of.at("cut_toughness").value);
  EXPECT_EQ(object.tear_strain, of.at("tear_strain").value);
  EXPECT_EQ(object.grasp_damage_threshold, of.at("grasp_damage").value);
  EXPECT_EQ(object.friction, of.at("friction").value);
  EXPECT_EQ(object.thermal.perfusion, of.at("perfusion").value);
  EXPECT_EQ(object.thermal.conductivity, of.at("thermal_conductivity").value);
  EXPECT_EQ(object.thermal.heat_capacity, of.at("heat_capacity").value);
}

/// Three knots in a row, given by tables.
Description chain(const std::string& material, const std::string& more = "") {
  const test::TemporaryScene folder;
  folder.write("nodes.csv", "node,x,y,z\n0,0,0,0\n1,0.01,0,0\n2,0.02,0,0\n");
  folder.write("links.csv", "n0,n1\n0,1\n1,2\n");
  return loadScene(folder.write("scene.yaml",
                                "objects:\n  - name: chain\n    nodes: nodes.csv\n    links: links.csv\n    "
                                "knot_mass: 0.001\n    link_area: 1e-6\n    material: " +
                                    material + "\n" + more));
}

/// Two tetrahedra of one label and one of another, in a file of gmsh.
Description elements(const std::string& materials) {
  const test::TemporaryScene folder;
  folder.write(
      "body.msh",
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 0 0 0\n2 0.01 0 0\n3 0 0.01 0\n4 0 0 0.01\n"
      "5 0.01 0.01 0.01\n6 0.02 0.02 0\n$EndNodes\n$Elements\n3\n1 4 2 1 1 1 2 3 4\n2 4 2 2 2 2 3 4 5\n"
      "3 4 2 2 2 2 3 5 6\n$EndElements\n");
  folder.write("fixed.csv", "node\n0\n1\n2\n");
  return loadScene(folder.write(
      "scene.yaml",
      "objects:\n  - {name: body, model: fem, mesh: body.msh, fixed: fixed.csv, " + materials + "}\n"));
}

TEST(TissueNumbers, ATableOfSpringsAndABodyOfElementsHaveThemByTheNameOfTheTissue) {
  expectNumbersOf(chain("intestine").objects[0], "intestine");
  expectNumbersOf(elements("material: {of: kidney}").objects[0], "kidney");
}

TEST(TissueNumbers, ABodyOfSeveralTissuesHasThoseOfTheOneThatMostElementsAreOf) {
  expectNumbersOf(elements("materials: [{label: 1, of: liver}, {label: 2, of: skin}]").objects[0], "skin");
  expectNumbersOf(elements("materials: [{label: 1, of: liver}, {label: 2, youngs_modulus: 5e3, "
                           "poisson_ratio: 0.4, density: 1000}]")
                      .objects[0],
                  "liver");
}

TEST(TissueNumbers, WhatASceneWritesTakesTheirPlace) {
  const auto d = chain("liver",
                       "    friction: 0.2\n    tear_strain: 0\n    cut_toughness: 7\n    "
                       "grasp_damage_threshold: 5\n    thermal: {perfusion: 0.5}\n");
  const Object& o = d.objects[0];
  EXPECT_EQ(o.friction, 0.2);
  EXPECT_EQ(o.tear_strain, 0.0);
  EXPECT_EQ(o.cut_toughness, 7.0);
  EXPECT_EQ(o.grasp_damage_threshold, 5.0);
  EXPECT_EQ(o.thermal.perfusion, 0.5);
  EXPECT_EQ(o.thermal.conductivity, tissueOf("liver").at("thermal_conductivity").value);
  EXPECT_EQ(overridesOf(o, tissueOf("liver")).size(), 5u);
}

TEST(TissueNumbers, ABakedOrganKeepsThemAndThoseOfItsSourceThroughItsFile) {
  const test::TemporaryScene folder;
  const std::string source = folder.write(
      "source.yaml",
      "vest_source: 1\nname: t\nobjects:\n  - {name: a, organ: tube, material: tube, fixed: [{rings: [0, "
      "0]}], "
      "tube: {centre: [[0,0,0],[0.05,0,0]], reference: [0,0,1], rings: 10, around: 6, sections: [{at: 0, "
      "radii: [0.002]}]}}\n"
      "  - {name: b, organ: tube, material: tube, fixed: [{rings: [0, 0]}], friction: 0.4, tear_strain: 0, "
      "cut_toughness: 33, grasp_damage_threshold: 136000, stiffness_factor: 3, tube: {centre: "
      "[[0,0.1,0],[0.05,0.1,0]], reference: [0,0,1], rings: 10, around: 6, sections: [{at: 0, radii: "
      "[0.002]}]}}\n");
  const auto baked =
      modelling::bake(modelling::readSource(source),
                      modelling::readMaterials(std::string(VEST_TISSUE_SOURCE_DIR) + "/data/materials.yaml"));
  modelling::writeScene(baked, folder.folder(), "source.yaml", "");
  const auto loaded = loadScene(folder.folder() + "/t.yaml");
  for (const Description* d : {&baked, &loaded}) {
    expectNumbersOf(d->objects[0], "tube");
    EXPECT_TRUE(overridesOf(d->objects[0], tissueOf("tube")).empty());
    const Object& b = d->objects[1];
    EXPECT_EQ(b.friction, 0.4);
    EXPECT_EQ(b.tear_strain, 0.0);
    EXPECT_EQ(b.cut_toughness, 33.0);
    EXPECT_EQ(b.grasp_damage_threshold, 136000.0);
    EXPECT_EQ(b.law.youngs_modulus, 3 * tissueOf("tube").law().youngs_modulus);
  }
}

TEST(TissueNumbers, CheckNamesEachThatIsAnotherOne) {
  testing::internal::CaptureStdout();
  tools::printCheck(chain("liver", "    cut_toughness: 7\n"));
  const std::string table = testing::internal::GetCapturedStdout();
  EXPECT_NE(table.find("override: cut_toughness of chain: 7 J/m2; its tissue, liver, has 164\n"),
            std::string::npos)
      << table;
  EXPECT_EQ(table.find("override:"), table.rfind("override:")) << table;
}

}  // namespace
}  // namespace vest::scene
