#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/net/skin.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

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
  for (const auto& p : object.position)
    for (int k = 0; k < 3; ++k) knots.push_back(static_cast<float>(p[k]));
  vest::net::rebuildSkin(knots.data(), object.skin.binding_start.data(), object.skin.binding_knots.data(),
                         object.skin.binding_weights.data(), object.skin.texture_coordinates.size(),
                         out.data());
  std::vector<Eigen::Vector3d> points;
  for (std::size_t v = 0; v < object.skin.texture_coordinates.size(); ++v)
    points.emplace_back(out[3 * v], out[3 * v + 1], out[3 * v + 2]);
  return points;
}

}  // namespace

// One source of blood in tissue: the database, by the tissue's name (a scene that says a number replaces it).
TEST(Gynaecology, OrgansHaveTheHeatAndPerfusionOfTheirTissue) {
  const auto database =
      vest::material::readDatabase(std::string(VEST_TISSUE_SOURCE_DIR) + "/data/materials.yaml");
  int of_database = 0;
  for (const Object& object : scene().objects) {
    const auto found = std::find_if(database.tissues.begin(), database.tissues.end(),
                                    [&](const auto& tissue) { return tissue.name == object.material; });
    if (found == database.tissues.end()) continue;
    ++of_database;
    EXPECT_EQ(object.thermal.perfusion, found->at("perfusion").value) << object.name;
    EXPECT_EQ(object.thermal.conductivity, found->at("thermal_conductivity").value) << object.name;
    EXPECT_EQ(object.thermal.heat_capacity, found->at("heat_capacity").value) << object.name;
  }
  EXPECT_GT(of_database, 15);
}

// Stability: no sub-step and no exchange is longer than the bounds allow, and objects that touch meet at each
// exchange of the one that has fewer (docs/decisions/0011).
TEST(Gynaecology, SubStepsAndExchangesKeepTheirBoundsAndMeet) {
  const auto model = vest::scene::buildModel(scene());
  const double dt = scene().dt;
  int nets = 0;
  for (std::size_t i = 0; i < model->objects.size(); ++i) {
    const auto& c = model->objects[i];
    if (!c.deforms) continue;
    ++nets;
    const std::string& name = scene().objects[i].name;
    EXPECT_LE(dt / c.sub_steps, 1.01 * vest::solver::kStepMargin * vest::solver::longestStep(c.rates))
        << name;
    EXPECT_GE(c.batches, c.exchanges_needed) << name;
    EXPECT_GE(c.volume_batches, c.volume_needed) << name;
    EXPECT_EQ(c.sub_steps % c.batches, 0) << name;
    EXPECT_EQ(c.batches % c.volume_batches, 0) << name;
    EXPECT_EQ(model->batches % c.batches, 0) << name;
    EXPECT_EQ(c.batches % 3, 0) << name;  // the cheaper of three and four here
  }
  EXPECT_EQ(nets, 21);
}

// docs/anatomy.md: objects, knots and springs of the 2001 scene, exactly.
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
    const std::string group =
        object.organ == "artery" || object.organ == "vein" || object.organ == "intestine" ? object.organ
                                                                                          : "organs";
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
  for (const char* name :
       {"uterus", "tube_left", "tube_right", "ovary_left", "ovary_right", "broad_ligament_left",
        "broad_ligament_right", "uterine_artery_left", "ovarian_artery_right", "iliac_artery_left",
        "uterine_vein_right", "ovarian_vein_left", "iliac_vein_right", "vena_cava", "intestine", "cavity"}) {
    EXPECT_EQ(names.count(name), 1u) << name;
  }
}

TEST(Gynaecology, EveryObjectIsInOnePieceWithoutDoubleLinksAndEveryKnotMovesItsSkin) {
  for (const Object& object : scene().objects) {
    SCOPED_TRACE(object.name);
    if (object.model != ObjectModel::Rigid) {
      EXPECT_EQ(vest::scene::countPieces(object), 1u);
    }
    EXPECT_EQ(vest::scene::countDuplicateLinks(object), 0u);
    EXPECT_EQ(vest::scene::countUnboundKnots(object), 0u);
  }
}

TEST(Gynaecology, SkinsAreClosedAndFaceOutwardsTheCavityInwards) {
  for (const Object& object : scene().objects) {
    SCOPED_TRACE(object.name);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (const auto& t : object.skin.triangles)
      for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
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
      ASSERT_LE(object.skin.binding_start[v + 1] - object.skin.binding_start[v], 16u)
          << object.name << " vertex " << v;
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
    EXPECT_LT(scene().dt * vest::modelling::highestFrequency(object) / 2, 10.0)
        << "sub-steps per millisecond";
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
      EXPECT_GT(vest::modelling::nearestPoint(cavity.position, cavity.contact_triangles, object.position[i])
                    .distance,
                -0.001)
          << object.name << " knot " << i << " is free but within the wall";
    }
  }
}

// docs/conventions.md: scenes are saved in equilibrium under gravity. Two seconds without any instrument.
TEST(Gynaecology, IsSavedAtRestAndStaysThereForTwoSeconds) {
  vest::scene::World world(scene());
  vest::scene::StepInput input;
  vest::scene::StepReport report;
  std::vector<float> velocity;
  float most = 0;
  for (int i = 0; i < 2000; ++i) {
    input.step = world.steps();
    ASSERT_EQ(world.step(input, report), vest::scene::Status::Ok) << i;
    if (i % 50 != 0) continue;
    for (std::size_t o = 0; o < world.objectCount(); ++o) {
      velocity.resize(3 * world.knotCount(o));
      world.velocities(o, velocity.data());
      for (std::size_t k = 0; k < velocity.size(); k += 3) {
        most = std::max(most, velocity[k] * velocity[k] + velocity[k + 1] * velocity[k + 1] +
                                  velocity[k + 2] * velocity[k + 2]);
      }
    }
  }
  EXPECT_LT(std::sqrt(most), 0.001f) << "m/s";
}

// A tube that half a newton pulls up by some centimetres, the ovary and the mesosalpinx behind it, the uterus
// hardly.
TEST(Gynaecology, ATubeFollowsAPullOfHalfANewtonAndComesBack) {
  vest::scene::World world(scene());
  const auto object = [&](const char* name) {
    std::uint16_t o = 0;
    while (scene().objects[o].name != name) ++o;
    return o;
  };
  const auto farthest = [&](std::uint16_t o) {
    std::vector<float> x(3 * world.knotCount(o));
    world.positions(o, x.data());
    double most = 0;
    for (std::size_t k = 0; k < world.knotCount(o); ++k) {
      most = std::max(
          most,
          (Eigen::Vector3d(x[3 * k], x[3 * k + 1], x[3 * k + 2]) - scene().objects[o].position[k]).norm());
    }
    return most;
  };
  const std::uint16_t tube = object("tube_left"), uterus = object("uterus"),
                      ligament = object("broad_ligament_left");
  std::vector<std::uint32_t> pulled;  // triangles between rings 13 and 14
  const Object& net = scene().objects[tube];
  for (std::uint32_t t = 0; t < net.contact_triangles.size(); ++t) {
    bool within = true;
    for (const auto k : net.contact_triangles[t]) within = within && k / 6 >= 13 && k / 6 <= 14 && k < 156;
    if (within) pulled.push_back(t);
  }
  ASSERT_EQ(pulled.size(), 12u);
  vest::scene::StepInput input;
  vest::scene::StepReport report;
  const Eigen::Vector3d force = 0.5 * Eigen::Vector3d(0.3, -0.3, 0.8).normalized();
  for (int i = 0; i < 1000; ++i) {
    input.step = world.steps();
    input.impacts.clear();
    const double part = std::min(1.0, i / 500.0) * input.dt / static_cast<double>(pulled.size());
    for (const auto t : pulled) input.impacts.push_back({tube, t, {1 / 3.0, 1 / 3.0, 1 / 3.0}, part * force});
    ASSERT_EQ(world.step(input, report), vest::scene::Status::Ok);
  }
  EXPECT_GT(farthest(tube), 0.015);
  EXPECT_LT(farthest(tube), 0.045);
  EXPECT_GT(farthest(ligament), 0.008);
  EXPECT_LT(farthest(uterus), 0.005);
  input.impacts.clear();
  for (int i = 0; i < 2500; ++i) {
    input.step = world.steps();
    ASSERT_EQ(world.step(input, report), vest::scene::Status::Ok);
  }
  EXPECT_LT(farthest(tube), 0.002) << "the organ returns";
}
