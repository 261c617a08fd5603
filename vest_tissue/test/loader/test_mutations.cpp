#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "temporary_scene.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/world.h"

namespace {

// Counter-based random numbers, so that a failure can be repeated (SplitMix64, Steele et al., OOPSLA 2014).
std::uint64_t random(std::uint64_t seed, std::uint64_t index) {
  std::uint64_t z = seed + 0x9e3779b97f4a7c15ull * (index + 1);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  return z ^ (z >> 31);
}

std::string mutate(std::string bytes, std::uint64_t seed) {
  static const char* const kPieces[] = {"nan", "-",     "[",  "{",  ": ",   "\n",   "&a",
                                        "*a",  "1e999", "..", "  ", "\x00", "\xff", "99999999999"};
  const int changes = 1 + static_cast<int>(random(seed, 0) % 4);
  for (int c = 0; c < changes && !bytes.empty(); ++c) {
    const std::size_t place = random(seed, 10 * c + 1) % bytes.size();
    switch (random(seed, 10 * c + 2) % 4) {
      case 0:
        bytes[place] = static_cast<char>(random(seed, 10 * c + 3));
        break;
      case 1:
        bytes.erase(place, 1 + random(seed, 10 * c + 3) % 20);
        break;
      case 2:
        bytes.insert(place, kPieces[random(seed, 10 * c + 3) % (sizeof kPieces / sizeof *kPieces)]);
        break;
      default:
        bytes.insert(place, bytes.substr(place, random(seed, 10 * c + 3) % 60));
        break;
    }
  }
  return bytes;
}

}  // namespace

// A damaged scene either loads or says one sentence; it never crashes or throws anything else.
TEST(Mutations, OfASceneFileLoadOrSayOneSentence) {
  const std::string scene =
      "name: pair\ngravity: [0, 0, -9.81]\nobjects:\n  - name: chain\n    model: net\n    nodes: nodes.csv\n"
      "    links: links.csv\n    knot_mass: 0.001\n    link_area: 1e-6\n    material: {youngs_modulus: "
      "10000, density: 1000}\n"
      "solution: {integrator: newton_euler, dt: 0.001}\n";
  const std::string nodes = "node,x,y,z\n0,0,0,0\n1,0.01,0,0\n2,0.02,0,0\n", links = "n0,n1\n0,1\n1,2\n";
  vest::test::TemporaryScene folder;
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= 600; ++seed) {
    const int which = static_cast<int>(seed % 3);
    const std::string path = folder.write("scene.yaml", which == 0 ? mutate(scene, seed) : scene);
    folder.write("nodes.csv", which == 1 ? mutate(nodes, seed) : nodes);
    folder.write("links.csv", which == 2 ? mutate(links, seed) : links);
    try {
      vest::scene::loadScene(path);
    } catch (const std::invalid_argument& error) {
      ++refused;
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos)
          << "seed " << seed << ": " << error.what();
    }
  }
  EXPECT_GT(refused, 200) << "the mutations must do harm, or this test checks nothing";
}

TEST(Mutations, OfABakedNetLoadOrSayOneSentence) {
  const auto object =
      vest::scene::loadScene(std::string(VEST_TISSUE_SOURCE_DIR) + "/scenes/tube/tube.yaml").objects.at(0);
  const std::string bytes = vest::scene::encodeBaked(object);
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    vest::scene::Object damaged;
    try {
      vest::scene::decodeBaked(mutate(bytes, seed), "damaged.net", damaged);
      vest::scene::checkObject(damaged, "damaged.net");
    } catch (const std::invalid_argument&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 200);
}
