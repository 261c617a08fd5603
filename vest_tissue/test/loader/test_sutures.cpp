// Sutures of a scene: what is read, and one message for each mistake.
#include <gtest/gtest.h>

#include "temporary_scene.h"
#include "vest_tissue/scene/world.h"

namespace {

const char* const kObjects =
    "objects:\n"
    "  - name: chain\n"
    "    nodes: nodes.csv\n"
    "    links: links.csv\n"
    "    knot_mass: 0.001\n"
    "    link_area: 1e-6\n"
    "    material: {youngs_modulus: 10000, density: 1000}\n";
const char* const kThread =
    "name: thread, material: silk, size: 3-0, path: [[0, 0, 0.1], [0.01, 0, 0.1], [0.02, 0.005, 0.1]]";

vest::scene::Description load(const std::string& sutures) {
  const vest::test::TemporaryScene folder;
  folder.write("nodes.csv", "node,x,y,z\n0,0,0,0\n1,0.01,0,0\n");
  folder.write("links.csv", "n0,n1\n0,1\n");
  return vest::scene::loadScene(folder.write("scene.yaml", kObjects + ("sutures:\n" + sutures)));
}

std::string messageOf(const std::string& sutures) {
  try {
    load(sutures);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Sutures, LieAlongTheirPath) {
  const auto d = load("  - {" + std::string(kThread) + ", length: 0.05}\n");
  ASSERT_EQ(d.sutures.size(), 1u);
  const auto& nodes = d.sutures[0].rod.nodes;
  EXPECT_EQ(nodes.size(), 51u);
  EXPECT_LT((nodes[10] - Eigen::Vector3d(0.01, 0, 0.1)).norm(), 6e-4);
  EXPECT_NEAR((nodes[50] - nodes[49]).norm(), 0.001, 1e-5);
  EXPECT_NEAR(d.sutures[0].rod.section.radius, 0.5 * 0.0002245, 1e-9);
  EXPECT_DOUBLE_EQ(d.sutures[0].knot_strength, 9.4);
}

TEST(Sutures, ANeedleLeavesTheFirstEnd) {
  const auto d =
      load("  - {" + std::string(kThread) + ", needle: {kind: half, length: 0.02, normal: [0, 0, 1]}}\n");
  const auto& needle = d.sutures[0].rod.needle;
  ASSERT_EQ(needle.points.size(), 21u);
  EXPECT_LT((needle.points.back() - d.sutures[0].rod.nodes[0]).norm(), 1e-12);
  // Half a circle from the thread's end, straight on at first and then round: its ends are two radii apart.
  EXPECT_NEAR((needle.points.front() - needle.points.back()).norm(), 0.04 / M_PI, 1e-9);
  EXPECT_NEAR((needle.points[19] - needle.points[20])
                  .normalized()
                  .dot((d.sutures[0].rod.nodes[0] - d.sutures[0].rod.nodes[1]).normalized()),
              1.0, 0.01);
  EXPECT_DOUBLE_EQ(needle.radius, 0.00033);
  EXPECT_DOUBLE_EQ(needle.swage, 6.7);
}

TEST(Sutures, FixedNodesAreThoseBetweenTwoPlaces) {
  const auto d = load("  - {" + std::string(kThread) + ", length: 0.05, fixed: [0.010, 0.0145]}\n");
  const auto& held = d.sutures[0].rod.held;
  ASSERT_EQ(held.size(), 5u);  // a node each millimetre
  EXPECT_EQ(held.front().node, 10u);
  EXPECT_EQ(held.back().node, 14u);
}

TEST(Sutures, ALoopIsTiedBeforehandInItsPacket) {
  const auto d = load(
      "  - {name: loop, material: polyglactin_910, size: \"0\", segment: 0.00075,"
      " roeder_loop: {at: [0.2, 0, 0.3], ahead: [0, 1, 0], across: [1, 0, 0], length: 0.1}}\n");
  const auto& nodes = d.sutures[0].rod.nodes;
  EXPECT_LT((nodes[0] - Eigen::Vector3d(0.2, -0.02, 0.3)).norm(), 1e-9) << "the standing part's rear end";
  double ahead = 0.0, length = 0.0;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
    ahead = std::max(ahead, nodes[i].y());
    length += (nodes[i + 1] - nodes[i]).norm();
  }
  EXPECT_NEAR(ahead, 0.1 / M_PI, 0.003) << "m: the loop's far side";
  EXPECT_NEAR(length, 0.02 + 0.1 + 0.029, 0.01) << "m: standing part, loop, knot and short end";
  EXPECT_TRUE(d.sutures[0].rod.natural_shape);
}

TEST(Sutures, OneMessageForEachMistake) {
  const std::string thread = kThread;
  const auto with = [&thread](const std::string& from, const std::string& to) {
    std::string changed = thread;
    changed.replace(changed.find(from), from.size(), to);
    return "  - {" + changed + "}\n";
  };
  const auto loop = [](const std::string& says) {
    return "  - {name: loop, material: silk, size: 3-0, roeder_loop: {" + says + "}}\n";
  };
  const std::pair<std::string, const char*> wrong[] = {
      {"  []\n", "1 to 16 sutures"},
      {"  - {" + thread + "}\n  - {" + thread + "}\n", "must be there once"},
      {with("name: thread", "name: chain"), "among objects too"},
      {with("silk", "wire"), "polypropylene"},
      {with("3-0", "12-0"), "must be one of: 4-0"},
      {with("[0.01, 0, 0.1]", "[0, 0, 0.1]"), "0.1 mm or more"},
      {with("[0, 0, 0.1], [0.01, 0, 0.1], ", ""), "2 to 1000 points"},
      {with("[0.01, 0, 0.1]", "[99, 0, 0.1]"), "within 10 m"},
      {with("[0.01, 0, 0.1]", "[.nan, 0, 0.1]"), "number"},
      {"  - {" + thread + ", length: 0}\n", "0.005"},
      {"  - {" + thread + ", segment: 1}\n", "0.005"},
      {"  - {" + thread + ", segment: 0.0002, length: 5}\n", "4 to 2000 segments"},
      {"  - {" + thread + ", knots: 3}\n", "knots"},
      {"  - {" + thread + ", fixed: [0.01]}\n", "from, to"},
      {"  - {" + thread + ", fixed: [0.01, 9]}\n", "5"},
      {"  - {" + thread + ", fixed: [0.014, 0.01]}\n", "at least one node"},
      {"  - {" + thread + ", needle: half}\n", "needle"},
      {"  - {" + thread + ", needle: {kind: bent}}\n", "three_eighths"},
      {"  - {" + thread + ", needle: {kind: half, length: 0}}\n", "0.005"},
      {"  - {" + thread + ", needle: {kind: half, wire: 0}}\n", "0.0001"},
      {"  - {" + thread + ", needle: {kind: half, length: 0.9}}\n", "0.06"},
      {"  - {" + thread + ", needle: {length: 0.02}}\n", "kind"},
      {"  - {" + thread + ", needle: {kind: ski, tip: round}}\n", "tip"},
      {"  - {" + thread + ", needle: {kind: half, normal: [0, 0, 0]}}\n", "normal"},
      {"  - {" + thread + ", needle: {kind: half, normal: [1, 0, 0]}}\n", "normal"},
      {with("[0.02, 0.005, 0.1]", "[0, 0.0002, 0.1]"), "bend at node"},
      {loop("at: [0, 0, 0]"), "ahead"},
      {loop("at: [99, 0, 0], ahead: [0, 0, 1], across: [1, 0, 0]"), "within 10 m"},
      {loop("at: [0, 0, 0], ahead: [0, 0, 0], across: [1, 0, 0]"), "direction"},
      {loop("at: [0, 0, 0], ahead: [0, 0, 1], across: [0, 0, 2]"), "along 'ahead'"},
      {loop("at: [0, 0, 0], ahead: [0, 0, 1], across: [0, 0, 0]"), "along 'ahead'"},
      {loop("at: [0, 0, .nan], ahead: [0, 0, 1], across: [1, 0, 0]"), "number"},
      {loop("at: [0, 0, 0], ahead: [0, 0, 1], across: [1, 0, 0], length: 9"), "0.3"},
      {loop("at: [0, 0, 0], ahead: [0, 0, 1], across: [1, 0, 0], turns: 3"), "turns"},
      {"  - {" + thread + ", roeder_loop: {at: [0, 0, 0], ahead: [0, 0, 1], across: [1, 0, 0]}}\n", "path"}};
  for (const auto& [text, part] : wrong) {
    const std::string message = messageOf(text);
    EXPECT_NE(message.find(part), std::string::npos) << text << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

}  // namespace
