#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <string>

#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"

// Protects what the pelvis scene is for: anatomy holds its organs, and they answer to a hand as surgeons know
// it.

namespace {

using namespace vest;
using Eigen::Vector3d;

const scene::Description& pelvis() {
  static const auto description =
      scene::loadScene(std::string(VEST_TISSUE_SOURCE_DIR) + "/scenes/pelvis/pelvis.yaml");
  return description;
}

bool moves(const scene::Object& object) {
  return object.model != scene::ObjectModel::Rigid;
}

std::uint16_t numberOf(const std::string& name) {
  const auto& objects = pelvis().objects;
  for (std::size_t i = 0; i < objects.size(); ++i)
    if (objects[i].name == name) return static_cast<std::uint16_t>(i);
  ADD_FAILURE() << name;
  return 0;
}

/// A pull (N) on the triangles between two rings of an organ, on one side of the body (±1), or on all of them
/// (0).
class Pull {
 public:
  Pull(const std::string& organ, std::size_t first, std::size_t last, int side = 0, double beyond = 0.0)
      : object_(numberOf(organ)) {
    const scene::Object& net = pelvis().objects[object_];
    std::set<scene::Index> within;
    for (std::size_t r = first; r <= last; ++r)
      for (const auto k : net.tube.rings[r])
        if (side == 0 || side * net.position[k].x() > beyond) within.insert(k);
    for (std::uint32_t t = 0; t < net.contact_triangles.size(); ++t) {
      const auto& k = net.contact_triangles[t];
      if (std::all_of(k.begin(), k.end(), [&](auto n) { return within.count(n) > 0; }))
        triangles_.push_back(t);
    }
    EXPECT_GE(triangles_.size(), 4u);
  }
  /// Grows over 0.7 s and is held for as long.
  void run(const Vector3d& force) {
    for (int i = 0; i < 1400 && !testing::Test::HasFatalFailure(); ++i)
      step(std::min(1.0, i / 700.0) * force);
  }
  void letGo(int steps) {
    for (int i = 0; i < steps && !testing::Test::HasFatalFailure(); ++i) step(Vector3d::Zero());
  }
  /// m: of the knot that is farthest from where it lay.
  double moved(const std::string& organ) const {
    const std::uint16_t o = numberOf(organ);
    double most = 0;
    for (std::size_t k = 0; k < world_.knotCount(o); ++k)
      most = std::max(most, (world_.knotAt(o, k) - pelvis().objects[o].position[k]).norm());
    return most;
  }

 private:
  void step(const Vector3d& force) {
    in_.step = world_.steps();
    in_.impacts.clear();
    const double share = in_.dt / static_cast<double>(triangles_.size());
    if (!force.isZero())
      for (const auto t : triangles_)
        in_.impacts.push_back({object_, t, {1 / 3.0, 1 / 3.0, 1 / 3.0}, share * force});
    ASSERT_NE(world_.step(in_, report_), scene::Status::Fault);
  }
  std::uint16_t object_;
  std::vector<std::uint32_t> triangles_;
  scene::World world_{pelvis()};
  scene::StepInput in_;
  scene::StepReport report_;
};

TEST(Pelvis, FewerThanATenthOfItsKnotsAreNailedDownAndNoOrganThatIsOperatedOnHangsOnTethers) {
  std::size_t knots = 0, fixed = 0;
  std::set<std::string> tethered;
  for (const auto& object : pelvis().objects) {
    if (!moves(object)) continue;
    knots += object.fixed.size();
    fixed += static_cast<std::size_t>(std::count(object.fixed.begin(), object.fixed.end(), 1));
    if (!object.tethers.empty()) tethered.insert(object.name.substr(0, object.name.rfind("_left")));
  }
  std::printf("%zu of %zu knots are fixed\n", fixed, knots);
  EXPECT_LT(10 * fixed, knots);
  for (const char* organ :
       {"tube", "ovary", "ovarian_ligament", "broad_ligament", "anterior_leaf", "round_ligament",
        "uterosacral_ligament", "infundibulopelvic_ligament", "tubal_arcade", "uterine_artery",
        "rectosigmoid", "sigmoid_mesocolon", "vesicouterine_fold"})
    EXPECT_EQ(tethered.count(organ), 0u) << organ;
  const auto& uterus = pelvis().objects[numberOf("uterus")];
  EXPECT_EQ(std::count(uterus.fixed.begin(), uterus.fixed.end(), 1), 0);
  EXPECT_LT(5 * uterus.tethers.size(), uterus.fixed.size()) << "vault and cardinal ligaments alone";
}

TEST(Pelvis, ArteriesAreOneTreeOnEachSideAndSegmentsOfThePatientsNetwork) {
  std::map<std::string, std::string> root;
  const auto of = [&](std::string name) {
    while (root[name] != name) name = root[name];
    return name;
  };
  for (const auto& object : pelvis().objects)
    if (object.organ == "artery") root[object.name] = object.name;
  for (const auto& c : pelvis().connections)
    if (root.count(c.object0) && root.count(c.object1)) root[of(c.object0)] = of(c.object1);
  for (const std::string side : {"_left", "_right"})
    for (const std::string artery : {"external_iliac_artery", "internal_iliac_artery", "anterior_division",
                                     "uterine_artery", "tubal_arcade", "ovarian_artery"})
      EXPECT_EQ(of(artery + side), of("common_iliac_artery" + side)) << artery << side;
  std::set<std::string> segments;
  for (const auto& object : pelvis().objects) {
    if (object.organ != "artery" && object.organ != "vein") continue;
    EXPECT_FALSE(object.tube.vessel_segment.empty()) << object.name;
    EXPECT_TRUE(segments.insert(object.tube.vessel_segment).second) << object.name << ": a segment twice";
  }
}

TEST(Pelvis, OrgansAreAsLongAndWideAsInPrint) {
  const auto sizeOf = [](const std::string& name) {
    const auto& object = pelvis().objects[numberOf(name)];
    Vector3d low = object.rest_position[0], high = low;
    for (const auto& p : object.rest_position) low = low.cwiseMin(p), high = high.cwiseMax(p);
    double length = 0, mass = 0;
    Vector3d last = Vector3d::Zero();
    for (std::size_t r = 0; r < object.tube.rings.size(); ++r) {
      Vector3d middle = Vector3d::Zero();
      for (const auto k : object.tube.rings[r])
        middle += object.rest_position[k] / static_cast<double>(object.tube.rings[r].size());
      if (r > 0) length += (middle - last).norm();
      last = middle;
    }
    mass = std::accumulate(object.mass.begin(), object.mass.end(), 0.0);
    return std::array<double, 3>{length, high.x() - low.x(), mass};
  };
  const auto [uterus, width, uterus_mass] = sizeOf("uterus");
  EXPECT_NEAR(uterus, 0.070, 0.008) << "m, between its rounded ends";
  EXPECT_NEAR(width, 0.052, 0.005) << "m, from horn to horn";
  EXPECT_NEAR(uterus_mass, 0.048, 0.010) << "kg: 28 to 48 g in print, the larger after births";
  EXPECT_NEAR(sizeOf("tube_left")[0], 0.075, 0.010) << "m: 70 to 140 mm in print";
  EXPECT_NEAR(sizeOf("ovary_left")[2], 0.004, 0.002) << "kg";
}

// docs/conventions.md: scenes are saved in equilibrium under gravity. Two seconds without any instrument.
TEST(Pelvis, IsSavedAtRestAndStaysThereForTwoSeconds) {
  scene::World world(pelvis());
  scene::StepInput input;
  scene::StepReport report;
  std::vector<float> velocity;
  double most = 0;
  std::string of;
  for (int i = 0; i < 2000; ++i) {
    input.step = world.steps();
    ASSERT_NE(world.step(input, report), scene::Status::Fault) << i;
    if (i % 50 != 0) continue;
    for (std::size_t o = 0; o < world.objectCount(); ++o) {
      velocity.resize(3 * world.knotCount(o));
      world.velocities(o, velocity.data());
      for (std::size_t k = 0; k + 2 < velocity.size(); k += 3) {
        const double speed = std::hypot(velocity[k], velocity[k + 1], velocity[k + 2]);
        if (speed > most) most = speed, of = pelvis().objects[o].name;
      }
    }
  }
  std::printf("%.3f mm/s at most (%s)\n", 1e3 * most, of.c_str());
  EXPECT_LT(most, 0.001) << "m/s, " << of;
}

// What surgeons know of a tube: 0.2 to 1 N lift it, with its mesosalpinx and ovary behind it.
TEST(Pelvis, ATubeIsLiftedByTwoTenthsToOneNewton) {
  const Vector3d up = Vector3d(0.3, -0.3, 0.8).normalized();
  double last = 0;
  for (const double force : {0.2, 0.5, 1.0}) {
    Pull pull("tube_left", 13, 14);
    pull.run(force * up);
    const double tube = pull.moved("tube_left");
    std::printf("%.1f N: tube %.1f, fold %.1f, ovary %.1f, uterus %.1f mm\n", force, 1e3 * tube,
                1e3 * pull.moved("broad_ligament_left"), 1e3 * pull.moved("ovary_left"),
                1e3 * pull.moved("uterus"));
    EXPECT_GT(tube, std::max(0.015, last)) << force << " N";
    EXPECT_LT(tube, 0.055) << force << " N";
    EXPECT_GT(pull.moved("broad_ligament_left"), 0.4 * tube);
    EXPECT_GT(pull.moved("ovary_left"), 0.3 * tube);
    EXPECT_LT(pull.moved("uterus"), 0.010);
    last = tube;
  }
  Pull again("tube_left", 13, 14);
  again.run(0.5 * up);
  again.letGo(2500);
  EXPECT_LT(again.moved("tube_left"), 0.010) << "it slides over the ovary and lies down again";
}

TEST(Pelvis, TheUterusFollowsAPullAtItsHorn) {
  Pull pull("uterus", 17, 20, -1, 0.018);
  pull.run(1.0 * Vector3d(0.5, -0.3, 0.8).normalized());
  std::printf("1 N at the left horn: uterus %.1f, tubes %.1f and %.1f, round ligament %.1f mm\n",
              1e3 * pull.moved("uterus"), 1e3 * pull.moved("tube_left"), 1e3 * pull.moved("tube_right"),
              1e3 * pull.moved("round_ligament_left"));
  EXPECT_GT(pull.moved("uterus"), 0.010);
  EXPECT_LT(pull.moved("uterus"), 0.040) << "its ligaments hold it";
  EXPECT_GT(pull.moved("tube_right"), 0.004) << "what hangs on it comes along";
  EXPECT_GT(pull.moved("round_ligament_left"), 0.008);
  pull.letGo(3000);
  EXPECT_LT(pull.moved("uterus"), 0.006) << "and it returns";
}

// Nothing hovers: a tube without what ties it falls on what lies below.
TEST(Pelvis, ATubeWhoseTiesAreCutFalls) {
  scene::Description free = pelvis();
  const auto ofTube = [](const scene::Connection& c) {
    return c.object0 == "tube_left" || c.object1 == "tube_left";
  };
  auto& ties = free.connections;
  ties.erase(std::remove_if(ties.begin(), ties.end(), ofTube), ties.end());
  ASSERT_LT(ties.size(), pelvis().connections.size());
  const std::uint16_t tube = numberOf("tube_left");
  const auto height = [&](const scene::World& world) {
    double sum = 0;
    for (std::size_t k = 0; k < world.knotCount(tube); ++k) sum += world.knotAt(tube, k).z();
    return sum / static_cast<double>(world.knotCount(tube));
  };
  scene::World held(pelvis()), fallen(free);
  const double start = height(held);
  scene::StepInput in;
  scene::StepReport report;
  for (scene::World* world : {&held, &fallen})
    for (int i = 0; i < 600; ++i) {
      in.step = world->steps();
      ASSERT_NE(world->step(in, report), scene::Status::Fault);
    }
  std::printf("%.1f mm down\n", 1e3 * (start - height(fallen)));
  EXPECT_NEAR(height(held), start, 0.001);
  EXPECT_LT(height(fallen), start - 0.010);
}

}  // namespace
