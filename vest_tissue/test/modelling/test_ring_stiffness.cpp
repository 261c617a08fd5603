// A bar that is cut from an organ is as stiff as its tissue, whatever the net: pulled by the solver of a
// session.
#include <gtest/gtest.h>

#include <cmath>

#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/calibration.h"
#include "vest_tissue/modelling/ring_stiffness.h"

namespace vest::modelling {
namespace {

const std::string kPackage = VEST_TISSUE_SOURCE_DIR;

std::string tube(const std::string& shape, const std::string& more) {
  return "vest_source: 1\nname: t\nobjects:\n  - name: a\n    organ: tube\n    material: tube\n    tube: "
         "{centre: [[0,0,0],[0.08,0,0]], reference: [0,0,1], " +
         shape + "}\n" + more;
}

std::string sheet(const std::string& more) {
  return "vest_source: 1\nname: t\nobjects:\n  - name: a\n    organ: ligament\n    material: ligament\n    "
         "sheet: {stations: 16, height_knots: 6, thickness: 0.002, curves: "
         "[[[0,0,0],[0.06,0,0]],[[0,0.03,0],[0.06,0.03,0]]]}\n" +
         more;
}

/// E of the rings of a baked object but for its ends, over that of its tissue.
double ofTissue(const SceneSource& source, const Materials& materials, std::size_t which, std::uint32_t first,
                std::uint32_t last) {
  const ObjectSource& from = source.objects[which];
  const RingNet net = from.tube    ? makeTube(*from.tube)
                      : from.sheet ? makeSheet(*from.sheet)
                                   : makeRevolve(*from.revolve);
  std::vector<double> section;
  for (std::uint32_t r = first; r < last; ++r) section.push_back(0.5 * (net.wall[r] + net.wall[r + 1]));
  const auto baked = bake(source, materials);
  return barModulus(cutBar(baked.objects[which], first, last), section) /
         materials.at(from.material).law().youngs_modulus;
}

TEST(RingStiffness, ABarCutFromABakedOrganHasItsTissuesModulus) {
  const Materials materials = readMaterials(kPackage + "/data/materials.yaml");
  const std::string round = "rings: 24, around: 6, sections: [{at: 0, radii: [0.003]}]",
                    walled = round + ", wall_thickness: 0.0008",
                    fine = "rings: 40, around: 12, sections: [{at: 0, radii: [0.004]}]",
                    flat = "rings: 24, around: 10, sections: [{at: 0, radii: [0.006, 0.003]}]";
  for (const std::string& text :
       {tube(round, ""), tube(round, "    fillers: []\n"), tube(round, "    fillers: [ring2, long2]\n"),
        tube(round, "    fillers: [ring2, cross]\n"), tube(walled, ""), tube(fine, ""),
        tube(fine, "    fillers: [ring2, strut]\n"), tube(flat, "    fillers: [ring2, strut]\n"), sheet(""),
        sheet("    fillers: [leaf, cross, long2]\n")}) {
    const SceneSource source = readSource("source.yaml", text);
    const std::uint32_t rings = source.objects[0].tube ? source.objects[0].tube->rings : 16;
    EXPECT_NEAR(ofTissue(source, materials, 0, 2, rings - 3), 1.0, 0.05) << text;
  }
}

TEST(RingStiffness, AFactorOfTheSourceIsOneOnTheModulus) {
  const Materials materials = readMaterials(kPackage + "/data/materials.yaml");
  const SceneSource source = readSource(
      "source.yaml",
      tube("rings: 24, around: 6, sections: [{at: 0, radii: [0.003]}]", "    stiffness_factor: 2.5\n"));
  EXPECT_NEAR(ofTissue(source, materials, 0, 2, 21), 2.5, 0.05 * 2.5);
}

/// Those that lie straight: a bent bar's ends turn, and what is measured is no longer its stretch alone.
TEST(RingStiffness, BarsCutFromShippedOrgansHaveTheirTissuesModulus) {
  const Materials materials = readMaterials(kPackage + "/data/materials.yaml");
  std::size_t bars = 0;
  for (const std::string scene :
       {"tube", "cut_tube", "clip_tube", "cut_strip", "hook_strip", "gallbladder"}) {
    const SceneSource source = readSource(kPackage + "/scenes/" + scene + "/source.yaml");
    for (std::size_t i = 0; i < source.objects.size(); ++i) {
      const ObjectSource& o = source.objects[i];
      const std::string& name = o.name;
      if (name != "tube" && name != "vessel" && name != "strip" && name != "common_duct" &&
          name != "cystic_duct" && name != "cystic_artery_1")
        continue;
      const std::uint32_t rings = o.tube ? o.tube->rings : o.sheet->stations;
      ++bars;
      EXPECT_NEAR(ofTissue(source, materials, i, 4, rings - 5) / o.stiffness_factor, 1.0, 0.05)
          << scene << ": " << name;
    }
  }
  EXPECT_EQ(bars, 8u);
}

/// Of every organ of the pelvis, bent and tapered ones too: by the energy that its links store.
TEST(RingStiffness, EveryPieceOfEveryOrganIsBroughtToTheModulusOfItsTissue) {
  for (const std::string scene : {"gynaecology", "pelvis", "gallbladder"})
    for (const ObjectSource& o : readSource(kPackage + "/scenes/" + scene + "/source.yaml").objects) {
      if (o.rigid || !o.layers.empty()) continue;
      const RingNet net = o.tube    ? makeTube(*o.tube)
                          : o.sheet ? makeSheet(*o.sheet)
                                    : makeRevolve(*o.revolve);
      const auto links = makeLinks(net, o.springs, o.fillers);
      const auto areas = linkAreas(net, links);
      for (const double area : areas) ASSERT_GT(area, 0.0) << o.name;
      for (const double modulus : axialModuli(net, links, areas))
        EXPECT_NEAR(modulus, 1.0, 1e-3) << scene << ": " << o.name;
    }
}

}  // namespace
}  // namespace vest::modelling
