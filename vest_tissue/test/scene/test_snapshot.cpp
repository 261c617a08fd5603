// Snapshots of strangers: what is damaged fails the checksum; what was made to do harm fails the checks below
// it.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include "blades.h"
#include "nets.h"
#include "slab.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"
#include "vest_tissue/scene/world_state.h"

namespace {

using namespace vest;
using Bytes = std::vector<std::uint8_t>;

std::string refusal(scene::World& world, const Bytes& bytes) {
  try {
    world.restore(bytes);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

/// With the checksum of somebody who knows how it is made.
Bytes sealed(Bytes bytes) {
  const std::uint64_t sum = XXH64(bytes.data(), bytes.size() - sizeof sum, 0);
  std::memcpy(bytes.data() + bytes.size() - sizeof sum, &sum, sizeof sum);
  return bytes;
}

template <class T>
Bytes replaced(const Bytes& bytes, T from, T to) {
  Bytes spoilt = bytes;
  for (std::size_t at = 0; at + sizeof from <= bytes.size(); ++at) {
    if (std::memcmp(bytes.data() + at, &from, sizeof from) != 0) continue;
    std::memcpy(spoilt.data() + at, &to, sizeof to);
    return sealed(spoilt);
  }
  ADD_FAILURE() << "not in the snapshot";
  return spoilt;
}

TEST(Snapshot, EveryChangedByteIsRefused) {
  scene::World world(specimen::tubeScene());
  Bytes bytes;
  world.save(bytes);
  const auto hash = world.stateHash();
  for (std::size_t at = 0; at < bytes.size(); at += 1 + bytes.size() / 60) {
    Bytes spoilt = bytes;
    spoilt[at] ^= 0x10;
    EXPECT_NE(refusal(world, spoilt), "") << "byte " << at;
  }
  EXPECT_NE(refusal(world, {}), "");
  Bytes older = bytes;
  older[7] = '6';
  EXPECT_NE(refusal(world, sealed(older)).find("another version"), std::string::npos);
  EXPECT_EQ(world.stateHash(), hash) << "nothing has changed";
  EXPECT_EQ(refusal(world, bytes), "");
}

TEST(Snapshot, NumbersThatNoStepCanHoldAreRefused) {
  auto description = specimen::tubeScene();
  description.objects[0].position[5].x() = 0.0123456;
  scene::World world(description);
  Bytes bytes;
  world.save(bytes);
  const auto x = static_cast<float>(0.0123456);
  const std::string not_finite = refusal(world, replaced(bytes, x, std::numeric_limits<float>::quiet_NaN()));
  EXPECT_NE(not_finite.find("is not finite"), std::string::npos) << not_finite;
  const std::string far = refusal(world, replaced(bytes, x, 1e20f));
  EXPECT_NE(far.find("a coordinate of 1e+20"), std::string::npos) << far;
  EXPECT_EQ(refusal(world, sealed(bytes)), "");
}

TEST(Snapshot, IndicesOutsideOfTheSceneAreRefused) {
  scene::World world(specimen::tubeScene());
  std::uint32_t copy = 0;
  ASSERT_TRUE(world.splitKnot(0, 20, Eigen::Vector3d::UnitX(), copy));
  Bytes bytes;
  world.save(bytes);
  // A contact triangle, as it stands in the file.
  const auto triangle = world.contactTriangles(0).at(7);
  auto spoilt = triangle;
  spoilt[1] = 70000;
  const std::string message = refusal(world, replaced(bytes, triangle, spoilt));
  EXPECT_NE(message.find("knot 70000 (of "), std::string::npos) << message;
  // Any four bytes as any index: refused, or a State that can be stepped.
  scene::StepInput input;
  scene::StepReport report;
  for (std::size_t at = 24; at + 12 < bytes.size(); at += 1 + bytes.size() / 150) {
    Bytes other = bytes;
    const std::uint32_t index = 0x7fffff00u + static_cast<std::uint32_t>(at);
    std::memcpy(other.data() + at, &index, sizeof index);
    if (refusal(world, sealed(other)).empty()) world.step(input, report);
  }
}

/// Only an uncut elastostatic body has the answers that a step at rest reads.
TEST(Snapshot, FiniteElementsThatMoveAreNotAtRest) {
  struct {
    double stiffness_scale;
    bool dynamic;
  } __attribute__((packed)) const moves{0.75, true}, rests{0.75, false};
  for (const bool elastostatic : {false, true}) {
    fem::specimen::SlabOptions options;
    options.motion = elastostatic ? fem::Motion::Elastostatic : fem::Motion::BackwardEuler;
    scene::World world(fem::specimen::sceneOf({fem::specimen::object(fem::specimen::slab(options))}));
    scene::StepInput input;
    scene::StepReport report;
    input.edits.push_back({"slab", "youngs_modulus", 0.75 * options.youngs_modulus});
    for (int i = 0; i < 20; ++i) {
      input.tools[0] = specimen::toolAt(tools::ToolKind::Scissors, {0.005, 0.0, 0.004}, {0.0, 0.0, -1.0},
                                        {1.0, 0.0, 0.0}, std::max(0.0, 0.9 - 0.1 * i));
      world.step(input, report);
      input.edits.clear();
    }
    ASSERT_GT(world.state().objects[0].tissue.revision, 0u) << "cut";
    Bytes bytes;
    world.save(bytes);
    const std::string message = refusal(world, replaced(bytes, moves, rests));
    EXPECT_NE(message.find("finite elements as built"), std::string::npos) << message;
    EXPECT_EQ(refusal(world, bytes), "");
  }
}

/// A tube with a surface, one without, a floor, a needle with its thread.
scene::Description lain() {
  specimen::TubeOptions o;
  o.rings = 6, o.around = 5, o.length = 0.02, o.mass = 0.001;
  scene::Description d = specimen::tubeScene(o);
  o.name = "cord", o.centre.y() += 0.05;
  d.objects.push_back(specimen::tube(o));
  d.objects[1].contact_triangles.clear(), d.objects[1].skin = {};
  scene::Object floor;
  floor.name = "floor", floor.model = scene::ObjectModel::Rigid;
  floor.position = {{-0.1, -0.1, -0.1}, {0.1, -0.1, -0.1}, {0.1, 0.1, -0.1}, {-0.1, 0.1, -0.1}};
  floor.contact_triangles = {{0, 1, 2}, {0, 2, 3}};
  d.objects.push_back(floor);
  d.sutures.resize(1);
  auto& rod = d.sutures[0].rod;
  for (int i = 0; i < 4; ++i) rod.needle.points.push_back({0.1 + 0.002 * i, 0, 0.05});
  rod.needle.radius = 0.00033, rod.needle.density = 7900.0, rod.needle.swage = 10.8;
  for (int i = 0; i < 4; ++i) rod.nodes.push_back({0.106 + 0.01 * i, 0, 0.05});
  rod.name = "thread", rod.section = suture::solidSection(0.0001, 1000.0, 1e9, 0.4);
  d.sutures[0].needle = "straight";
  return d;
}

/// Each member alone may have its value; together no State has them, and a step would read what is not there
/// or go on for ever.
TEST(Snapshot, MembersThatContradictEachOtherAreRefused) {
  using scene::WorldState;
  constexpr std::size_t kTube = 0, kCord = 1, kFloor = 2;
  const auto sling = [](WorldState& s) -> interaction::Sling& {
    s.fasteners.slings.resize(1);
    s.fasteners.slings[0].alive = true, s.fasteners.slings[0].instrument = 0;
    return s.fasteners.slings[0];
  };
  const auto channel = [](WorldState& s) -> interaction::Channel& {
    s.threads.channels.resize(1);
    s.threads.channels[0].count = 1;
    return s.threads.channels[0];
  };
  const struct {
    const char* says;
    std::function<void(WorldState&)> lie;
  } lies[] = {
      {"a grasp that holds nothing",
       [](WorldState& s) { s.grasps[1].active = true, s.grasps[1].element = 0xfffffff0u; }},
      {"contact triangle 0 (of 0)",
       [](WorldState& s) { s.grasps[1].count = 1, s.grasps[1].anchors[0].object = kCord; }},
      {"a grasp of a rigid object",
       [](WorldState& s) { s.grasps[1].count = 1, s.grasps[1].anchors[0].object = kFloor; }},
      {"contact triangle 0 (of 0)",
       [](WorldState& s) { s.cutting.tools[0].owed = 1.0, s.cutting.tools[0].object = kCord; }},
      {"heat of an electrode",
       [](WorldState& s) {
         s.electrosurgery.electrodes[0].energy = 1.0, s.electrosurgery.electrodes[0].object = kCord;
       }},
      {"knot of a sling 70000",
       [&](WorldState& s) { sling(s).touch[3].side = 1, s.fasteners.slings[0].touch[3].knots[0] = 70000; }},
      {"a sling around a rigid object",
       [&](WorldState& s) { sling(s).around = true, s.fasteners.slings[0].object = kFloor; }},
      {"a clip on a rigid object",
       [](WorldState& s) {
         s.fasteners.clips.resize(1);
         s.fasteners.clips[0].alive = true, s.fasteners.clips[0].object = kFloor;
       }},
      {"contact triangle of a channel 0 (of 0)", [&](WorldState& s) { channel(s).object = kCord; }},
      {"a channel in a rigid object", [&](WorldState& s) { channel(s).object = kFloor; }},
      {"a rigid object among those that may touch",
       [](WorldState& s) {
         s.pairs.resize(1);
         s.pairs[0].object = kTube, s.pairs[0].other = kFloor;
       }},
      {"sub-steps or exchanges",
       [](WorldState& s) { s.objects[kFloor].batches = s.objects[kFloor].sub_steps = 4096; }},
      {"a knot that is a copy of a later one",
       [](WorldState& s) {
         s.objects[kTube].topology.doubled_knots[0] =
             static_cast<std::uint32_t>(s.objects[kTube].block.knots()) - 1;
       }},
      {"lists of an object that do not fit each other",
       [](WorldState& s) { s.objects[kTube].topology.doubled_knots.clear(); }},
  };
  scene::World world(lain());
  std::uint32_t copy = 0;
  ASSERT_TRUE(world.splitKnot(kTube, 7, Eigen::Vector3d::UnitX(), copy));
  Bytes bytes;
  world.save(bytes);
  for (const auto& [says, lie] : lies) {
    ASSERT_EQ(refusal(world, bytes), "");
    lie(const_cast<WorldState&>(world.state()));
    Bytes lied;
    world.save(lied);
    const std::string message = refusal(world, lied);
    EXPECT_NE(message.find(says), std::string::npos) << says << ": " << message;
  }
}

/// What is as the scene says is not looked at: a State that says so must not bring anything else.
TEST(Snapshot, TopologyThatSaysItIsTheScenesIsRefusedWithAnother) {
  scene::World world(lain());
  std::uint32_t copy = 0;
  ASSERT_TRUE(world.splitKnot(0, 7, Eigen::Vector3d::UnitX(), copy));
  auto& s = const_cast<scene::WorldState&>(world.state()).objects[0];
  constexpr std::uint32_t kRevision = 0x7a5b3c1d;
  s.topology.revision = kRevision;
  Bytes bytes;
  world.save(bytes);
  const std::string message = refusal(world, replaced(bytes, kRevision, std::uint32_t{0}));
  EXPECT_NE(message.find("not as new as it says"), std::string::npos) << message;
  EXPECT_EQ(refusal(world, bytes), "");
}

/// Cutting works on arrays of fixed size.
TEST(Snapshot, ASkinIsNoLargerThanCutsMakeIt) {
  scene::World world(specimen::barScene());
  auto& s = const_cast<scene::WorldState&>(world.state()).objects[0];
  s.topology.revision = 1;
  Bytes bytes;
  world.save(bytes);
  const std::size_t more = world.model().objects[0].cut.most_triangles + 1;
  s.topology.skin.triangles.resize(more), s.topology.skin.layer.resize(more);
  s.topology.triangle_alive.resize(more), s.cut.home.resize(more), s.cut.open.resize(more);
  Bytes lied;
  world.save(lied);
  const std::string message = refusal(world, lied);
  EXPECT_NE(message.find("a skin with more than a cut has room for"), std::string::npos) << message;
  EXPECT_EQ(refusal(world, bytes), "");
}

TEST(Snapshot, AVertexInAnElementHangsOnItsCorners) {
  scene::World world(fem::specimen::sceneOf({fem::specimen::object(fem::specimen::slab())}));
  auto& s = const_cast<scene::WorldState&>(world.state()).objects[0];
  s.topology.revision = 1;
  Bytes bytes;
  world.save(bytes);
  s.fem_surface.vertex_element[0] = 0;
  Bytes lied;
  world.save(lied);
  const std::string message = refusal(world, lied);
  EXPECT_NE(message.find("a vertex in an element"), std::string::npos) << message;
  EXPECT_EQ(refusal(world, bytes), "");
}

}  // namespace
