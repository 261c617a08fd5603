// Snapshots of strangers: what is damaged fails the checksum; what was made to do harm fails the checks below
// it.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "../fem/slab.h"
#include "blades.h"
#include "nets.h"
#include "vest_tissue/scene/world.h"
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
  scene::World world(test::tubeScene());
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
  auto description = test::tubeScene();
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
  scene::World world(test::tubeScene());
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
    fem::test::SlabOptions options;
    options.motion = elastostatic ? fem::Motion::Elastostatic : fem::Motion::BackwardEuler;
    scene::World world(fem::test::sceneOf({fem::test::object(fem::test::slab(options))}));
    scene::StepInput input;
    scene::StepReport report;
    input.edits.push_back({"slab", "youngs_modulus", 0.75 * options.youngs_modulus});
    for (int i = 0; i < 20; ++i) {
      input.tools[0] = test::toolAt(tools::ToolKind::Scissors, {0.005, 0.0, 0.004}, {0.0, 0.0, -1.0},
                                    {1.0, 0.0, 0.0}, std::max(0.0, 0.9 - 0.1 * i));
      world.step(input, report);
      input.edits.clear();
    }
    ASSERT_GT(world.state().objects[0].tissue.revision, 0u) << "cut";
    Bytes bytes;
    world.save(bytes);
    const std::string message = refusal(world, replaced(bytes, moves, rests));
    EXPECT_NE(message.find("finite elements at rest"), std::string::npos) << message;
    EXPECT_EQ(refusal(world, bytes), "");
  }
}

}  // namespace
