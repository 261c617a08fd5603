#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iterator>

#include "temporary_scene.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/validation/svg_plot.h"

namespace {

using namespace vest;
using material::Condition;

const std::string kDatabase = VEST_TISSUE_SOURCE_DIR "/data/materials.yaml";

std::string complaint(const std::function<void()>& work) {
  try {
    work();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

void expectNamed(const std::string& message, const std::vector<std::string>& words) {
  for (const auto& word : words)
    EXPECT_NE(message.find(word), std::string::npos) << "'" << word << "' in: " << message;
}

std::string written(const std::string& name, const std::string& text) {
  const std::string path = testing::TempDir() + name;
  std::ofstream(path) << text;
  return path;
}

TEST(Database, HoldsEveryTissueOfTheIssueInBothConditions) {
  const auto database = material::readDatabase(kDatabase);
  for (const char* name : {"fat_soft", "fat_firm", "liver", "spleen", "heart_muscle", "kidney", "uterus",
                           "tube", "ovary", "ligament", "peritoneum", "intestine", "gallbladder", "bile_duct",
                           "artery", "vein", "skin", "bone"}) {
    const auto& tissue = database.at(name);
    for (const auto c : {Condition::InVivo, Condition::PostMortem})
      EXPECT_TRUE(material::isMonotone(tissue.law(c))) << name;
    EXPECT_GT(tissue.at("heat_capacity").value, 0.0);
  }
  EXPECT_GT(database.at("liver").law(Condition::PostMortem).youngs_modulus,
            database.at("liver").law().youngs_modulus);
  EXPECT_EQ(database.at("kidney").at("youngs_modulus").value, 5000.0);
  EXPECT_NE(database.at("kidney").at("youngs_modulus").source.find("10.2214/AJR.10.5449"), std::string::npos);
  expectNamed(complaint([&] { database.at("brain"); }), {"brain", "allowed", "liver"});
}

TEST(Database, RefusesANumberWithoutSourceByFileLineAndField) {
  std::ifstream in(kDatabase);
  std::string text((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto at = text.find("source: arda, ");
  ASSERT_NE(at, std::string::npos);
  const std::string path = written("unsourced.yaml", std::string(text).erase(at, 14));
  expectNamed(complaint([&] { material::readDatabase(path); }), {"unsourced.yaml", "source"});
  text.replace(at, 14, "source: none, ");
  expectNamed(complaint([&] { material::readDatabase(written("unsourced.yaml", text)); }),
              {"unsourced.yaml", "source", "none", "sources"});
}

/// A recording brings its database. One of 40,000 sources took minutes: each was looked for among all.
TEST(Database, ReadsAsManySourcesAsAFileHolds) {
  std::ifstream file(kDatabase);
  std::string text{std::istreambuf_iterator<char>(file), {}}, more = "sources:\n";
  for (int i = 0; i < 40000; ++i) more += "  k" + std::to_string(i) + ": a printed book\n";
  text.replace(text.find("sources:\n"), 9, more);
  const vest::test::TemporaryScene folder;
  EXPECT_EQ(material::readDatabase(folder.write("materials.yaml", text)).tissues.size(),
            material::readDatabase(kDatabase).tissues.size());
  text.replace(text.find("  k39999:"), 8, "  k39998");
  expectNamed(complaint([&] { material::readDatabase(folder.write("materials.yaml", text)); }),
              {"sources: k39998", "stands twice"});
}

TEST(Database, ASceneTakesItsMaterialByNameAndMayReplaceNumbers) {
  written("nodes.csv", "node,x,y,z\n0,0,0,0\n1,0,0,0.01\n");
  written("links.csv", "n0,n1\n0,1\n");
  const auto scene = [](const std::string& material) {
    return written("named.yaml",
                   "objects:\n  - name: bar\n    nodes: nodes.csv\n    links: links.csv\n"
                   "    knot_mass: 0.001\n    link_area: 1.0e-5\n    material: " +
                       material + "\n");
  };
  auto d = scene::loadScene(scene("liver"));
  EXPECT_EQ(d.objects[0].law.youngs_modulus, 5400.0);
  EXPECT_EQ(d.objects[0].law.a3, 50.0);
  EXPECT_EQ(d.objects[0].density, 1050.0);
  const std::string hash = d.hash;
  d = scene::loadScene(scene("{of: liver, condition: post_mortem, a3: 4}"));
  EXPECT_EQ(d.objects[0].law.youngs_modulus, 8000.0);
  EXPECT_EQ(d.objects[0].law.a3, 4.0);
  EXPECT_NE(d.hash, hash);
  d = scene::loadScene(scene("{youngs_modulus: 700}"));
  EXPECT_EQ(d.objects[0].law.youngs_modulus, 700.0);
  expectNamed(complaint([&] { scene::loadScene(scene("jelly")); }),
              {"named.yaml", "material", "jelly", "liver"});
  expectNamed(complaint([&] { scene::loadScene(scene("{of: liver, condition: cold}")); }),
              {"condition", "cold"});
}

TEST(Fit, FindsTheCoefficientsThatMadeTheCurve) {
  const material::Law law{4200.0, 0.7, 3.0, 11.0, 0.5};
  std::vector<material::Point> points;
  for (double e = -0.1; e < 0.51; e += 0.02) points.push_back({e, material::stress(law, e)});
  const auto fit = material::fitLaw(points);
  EXPECT_NEAR(fit.law.youngs_modulus, 4200.0, 1e-6);
  EXPECT_NEAR(fit.law.a2, 0.7, 1e-8);
  EXPECT_NEAR(fit.law.a3, 3.0, 1e-7);
  EXPECT_NEAR(fit.law.a4, 11.0, 1e-7);
  EXPECT_LT(fit.greatest, 1e-6);
  EXPECT_TRUE(fit.monotone);
  // With noise of known size the residual is that size, not less and not more.
  for (std::size_t i = 0; i < points.size(); ++i) points[i].stress += i % 2 == 0 ? 20.0 : -20.0;
  const auto noisy = material::fitLaw(points);
  EXPECT_NEAR(noisy.rms, 20.0, 3.0);
  EXPECT_NEAR(noisy.law.youngs_modulus, 4200.0, 300.0);
}

TEST(Fit, RefusesBadCurvesByFileLineAndField) {
  const auto read = [](const std::string& text) {
    return complaint([&] { material::readCurve(written("curve.csv", text)); });
  };
  expectNamed(read("strain,stress\n0.1,100\n0.2,abc\n0.3,300\n"), {"curve.csv", "3", "stress", "abc"});
  expectNamed(read("strain,stress\n0.1,100\n0.2,-5\n0.3,300\n"), {"curve.csv", "3", "stress", "-5"});
  expectNamed(read("strain,stress\n0.1,100\n-1.5,-5\n0.3,300\n"), {"curve.csv", "3", "strain", "-1.5"});
  expectNamed(read("strain,force\n0.1,100\n"), {"curve.csv", "1"});
  expectNamed(read("strain,stress\n0.1,100\n"), {"curve.csv", "rows", "at least 3"});
  EXPECT_NE(complaint([] { material::fitLaw({{0.1, 10}, {0.1, 11}, {0.2, 20}}, 4); }), "accepted");
  EXPECT_NE(complaint([] { material::fitLaw({{-0.1, 10}, {-0.2, 11}, {-0.3, 20}}, 1); }), "accepted");
}

TEST(SvgPlot, ShowsAxesWithUnitsAndEveryCurveAndSurvivesEmptyAndBadNumbers) {
  validation::Plot p{"a < b", "strain, no unit", "stress, kPa", {}, false, false};
  EXPECT_NE(validation::toSvg(p).find("stress, kPa"), std::string::npos);
  p.curves.push_back({"one", {0, 0.1, 0.2}, {1, std::nan(""), 3}, validation::Mark::Line});
  p.curves.push_back({"two", {0, 0.1, 0.2}, {2, 2, 2}, validation::Mark::Points});
  const std::string svg = validation::toSvg(p);
  EXPECT_NE(svg.find("a &lt; b"), std::string::npos);
  EXPECT_NE(svg.find(">one<"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  p.log_y = true;
  p.curves[1].y[0] = -1.0;
  EXPECT_EQ(validation::toSvg(p).find("nan"), std::string::npos);
}

}  // namespace
