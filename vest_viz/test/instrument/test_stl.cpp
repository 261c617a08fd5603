#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <unistd.h>

#include <gtest/gtest.h>

#include "vest_viz/instrument/stl.h"

namespace vest::instrument {
namespace {

/// A file of its own in the temporary folder, removed at the end.
class File {
 public:
  explicit File(const std::string& bytes)
      : path_(testing::TempDir() + "vest_viz_" + std::to_string(getpid()) + ".stl") {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~File() { std::remove(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

/// Two triangles that share an edge and meet at `angle`.
std::string hinge(float angle, float z = 0) {
  std::string s(80, ' ');
  const std::uint32_t count = 2;
  s.append(reinterpret_cast<const char*>(&count), 4);
  const float c = std::cos(angle), n = std::sin(angle);
  const float v[2][9] = {{0, 0, 0, 0, 1, 0, -1, 0, z}, {0, 0, 0, c, 0, -n, 0, 1, 0}};
  for (const auto& t : v) {
    s.append(12, '\0');
    s.append(reinterpret_cast<const char*>(t), sizeof t);
    s.append(2, '\0');
  }
  return s;
}

TEST(Stl, SmoothEdgesShareNormalsAndSharpOnesDoNot) {
  EXPECT_EQ(readStl(File(hinge(0.2f)).path(), 0.6).positions.size(), 3u * 4u);
  EXPECT_EQ(readStl(File(hinge(1.4f)).path(), 0.6).positions.size(), 3u * 6u);
}

TEST(Stl, BrokenFilesAreRefusedByName) {
  const std::string good = hinge(0.2f);
  EXPECT_THROW(readStl("/nowhere/a.stl", 0.6), std::runtime_error);
  EXPECT_THROW(readStl(File(good.substr(0, 60)).path(), 0.6), std::runtime_error);
  EXPECT_THROW(readStl(File(good.substr(0, good.size() - 1)).path(), 0.6), std::runtime_error);
  EXPECT_THROW(readStl(File(hinge(0.2f, std::numeric_limits<float>::quiet_NaN())).path(), 0.6),
               std::runtime_error);
  std::string star = good;  // each triangle at a corner is compared with each: they must be few
  const std::uint32_t same = 100000;
  std::memcpy(&star[80], &same, 4);
  star.resize(84);
  for (std::uint32_t i = 0; i < same; ++i) star += good.substr(84, 50);
  EXPECT_THROW(readStl(File(star).path(), 0.6), std::runtime_error);
  std::string lying = good;
  const std::uint32_t many = 0xffffffffu;
  std::memcpy(&lying[80], &many, 4);
  const File file(lying);
  try {
    readStl(file.path(), 0.6);
    FAIL() << "a lying size was accepted";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find(file.path()), std::string::npos);
  }
}

TEST(Capsule, NormalsPointOutwardAndHaveLengthOne) {
  const TriangleMesh m = capsule(0.002, -0.1, 0.0);
  for (std::size_t i = 0; i < m.normals.size(); i += 3) {
    EXPECT_NEAR(std::hypot(m.normals[i], m.normals[i + 1], m.normals[i + 2]), 1.0, 1e-5);
    EXPECT_GE(m.normals[i] * m.positions[i] + m.normals[i + 1] * m.positions[i + 1], -1e-9);
  }
  for (std::uint32_t t : m.triangles) EXPECT_LT(t, m.positions.size() / 3);
}

}  // namespace
}  // namespace vest::instrument
