#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/net/skin.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"

namespace {

using vest::scene::Object;
using vest::scene::ObjectModel;

const vest::scene::Description& scene() {
  static const auto description =
      vest::scene::loadScene(std::string(VEST_TISSUE_SOURCE_DIR) + "/scenes/gynaecology/gynaecology.yaml");
  return description;
}

std::vector<Eigen::Vector3d> skinOf(const Object& object) {
  std::vector<float> knots, out(3 * object.skin.texture_coordinates.size());
  for (const auto& p : object.position) for (int k = 0; k < 3; ++k) knots.push_back(static_cast<float>(p[k]));
  vest::net::rebuildSkin(knots.data(), object.skin.binding_start.data(), object.skin.binding_knots.data(),
                         object.skin.binding_weights.data(), object.skin.texture_coordinates.size(), out.data());
  std::vector<Eigen::Vector3d> points;
  for (std::size_t v = 0; v < object.skin.texture_coordinates.size(); ++v) points.emplace_back(out[3 * v], out[3 * v + 1], out[3 * v + 2]);
  return points;
}

}  // namespace

// models.md section 5: the seed's scene, exactly.
TEST(Gynaecology, HasTheSeedsObjectsKnotsAndSprings) {
  std::map<std::string, std::array<std::size_t, 3>> groups;
  std::set<std::string> names;
  std::size_t rigid = 0, vertices = 0;
  for (const Object& object : scene().objects) {
    names.insert(object.name);
    if (object.model == ObjectModel::Rigid) {
      ++rigid;
      continue;
    }
    const std::string group = object.organ == "artery" || object.organ == "vein" || object.organ == "intestine" ? object.organ : "organs";
    ++groups[group][0];
    groups[group][1] += object.rest_position.size();
    groups[group][2] += object.links.size();
    vertices += object.skin.texture_coordinates.size();
  }
  EXPECT_EQ((groups["organs"]), (std::array<std::size_t, 3>{7, 1335, 5030}));
  EXPECT_EQ((groups["artery"]), (std::array<std::size_t, 3>{6, 594, 2508}));
  EXPECT_EQ((groups["vein"]), (std::array<std::size_t, 3>{7, 675, 2844}));
  EXPECT_EQ((groups["intestine"]), (std::array<std::size_t, 3>{1, 147, 560}));
  EXPECT_EQ(rigid, 1u);
  EXPECT_NEAR(static_cast<double>(vertices), 15000, 1500);
  for (const char* name : {"uterus", "tube_left", "tube_right", "ovary_left", "ovary_right", "broad_ligament_left",
                           "broad_ligament_right", "uterine_artery_left", "ovarian_artery_right", "iliac_artery_left",
                           "uterine_vein_right", "ovarian_vein_left", "iliac_vein_right", "vena_cava", "intestine", "cavity"}) {
    EXPECT_EQ(names.count(name), 1u) << name;
  }
}

TEST(Gynaecology, EveryObjectIsInOnePieceWithoutDoubleLinksAndEveryKnotMovesItsSkin) {
  for (const Object& object : scene().objects) {
    SCOPED_TRACE(object.name);
    if (object.model != ObjectModel::Rigid) EXPECT_EQ(vest::scene::countPieces(object), 1u);
    EXPECT_EQ(vest::scene::countDuplicateLinks(object), 0u);
    EXPECT_EQ(vest::scene::countUnboundKnots(object), 0u);
  }
}

TEST(Gynaecology, SkinsAreClosedAndFaceOutwardsTheCavityInwards) {
  for (const Object& object : scene().objects) {
    SCOPED_TRACE(object.name);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : object.skin.triangles) for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    std::size_t open = 0;
    for (const auto& [edge, count] : edges) open += count != 1 || edges.count({edge.second, edge.first}) == 0;
    EXPECT_EQ(open, 0u);
    const double volume = vest::modelling::enclosedVolume(skinOf(object), object.skin.triangles);
    if (object.name == "cavity") {
      EXPECT_LT(volume, 0);
    } else {
      EXPECT_GT(volume, 0);
      double mass = 0;
      for (const double m : object.mass) mass += m;
      const double filled = mass / (object.density * volume);  // bowel holds gas
      EXPECT_GT(filled, object.organ == "intestine" ? 0.35 : 0.75) << "mass belongs to the organ's volume";
      EXPECT_LT(filled, 1.25);
    }
  }
}

TEST(Gynaecology, WeightsOfAVertexAreAtMostSixteen) {
  for (const Object& object : scene().objects) {
    for (std::size_t v = 0; v + 1 < object.skin.binding_start.size(); ++v) {
      ASSERT_LE(object.skin.binding_start[v + 1] - object.skin.binding_start[v], 16u) << object.name << " vertex " << v;
    }
  }
}

TEST(Gynaecology, EveryMovingObjectIsHeldAndNeedsFewSubSteps) {
  for (const Object& object : scene().objects) {
    if (object.model == ObjectModel::Rigid) continue;
    SCOPED_TRACE(object.name);
    bool held = !object.tethers.empty();
    for (const auto fixed : object.fixed) held = held || fixed;
    for (const auto& connection : scene().connections) held = held || connection.object0 == object.name;
    EXPECT_TRUE(held) << "nothing keeps it from falling";
    EXPECT_LT(scene().dt * vest::modelling::highestFrequency(object) / 2, 10.0) << "sub-steps per millisecond";
  }
}

TEST(Gynaecology, TubesAndVesselsKnowTheirStationsAndSegments) {
  for (const Object& object : scene().objects) {
    if (object.organ != "tube" && object.organ != "artery" && object.organ != "vein") continue;
    SCOPED_TRACE(object.name);
    EXPECT_GE(object.tube.rings.size(), 5u);
    EXPECT_EQ(object.tube.rings.size(), object.tube.station.size());
    EXPECT_EQ(object.tube.vessel_segment.empty(), object.organ == "tube");
  }
}

TEST(Gynaecology, NothingLiesFarOutsideOfTheCavity) {
  const auto& objects = scene().objects;
  const Object& cavity = objects[0];
  ASSERT_EQ(cavity.name, "cavity");
  for (const Object& object : objects) {
    if (object.model == ObjectModel::Rigid) continue;
    for (std::size_t i = 0; i < object.position.size(); i += 5) {
      if (object.fixed[i]) continue;
      EXPECT_GT(vest::modelling::nearestPoint(cavity.position, cavity.contact_triangles, object.position[i]).distance, -0.001)
          << object.name << " knot " << i << " is free but within the wall";
    }
  }
}
