// "With the fast kernels masked off": the gynaecology scene, run in processes of their own with other
// kernels, with glibc's own fast paths masked, and with other numbers of threads, has the same state hash
// every 100 steps.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>
#include <utility>
#include <vector>

#include "nets.h"
#include "vest_tissue/scene/world.h"

namespace {

using namespace vest;
using Environment = std::vector<std::pair<std::string, std::string>>;

constexpr int kSteps = 200;

/// A grasper comes down on the middle of the left tube, closes and pulls. Prints kernel level, what happened
/// and hashes.
int child(int threads) {
  scene::World world(scene::loadScene(VEST_TISSUE_SOURCE_DIR "/scenes/gynaecology/gynaecology.yaml"),
                     threads);
  const auto& objects = world.description().objects;
  const auto tube =
      std::find_if(objects.begin(), objects.end(), [](const auto& o) { return o.name == "tube_left"; });
  if (tube == objects.end()) return 1;
  const auto& ring = tube->tube.rings[tube->tube.rings.size() / 2];
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto k : ring) middle += tube->position[k] / static_cast<double>(ring.size());
  scene::StepReport report;
  bool grasped = false;
  std::cout << world.kernelLevel();
  for (int i = 0; i < kSteps; ++i) {
    scene::StepInput in;
    in.step = static_cast<std::uint64_t>(i) + 1;
    const double down = std::min(1.0, i / 60.0), close = std::clamp((i - 60) / 80.0, 0.0, 1.0);
    const double up = std::clamp((i - 145) / 55.0, 0.0, 1.0);
    in.tools[0] = specimen::grasper(middle + Eigen::Vector3d(0, 0, 0.03 - 0.034 * down + 0.02 * up),
                                    1.0 - 0.95 * close);
    in.tools[0].pivot = middle + Eigen::Vector3d(0, 0, 0.15);
    if (world.step(in, report) == scene::Status::Fault) return 2;
    for (const auto& e : report.events) grasped = grasped || e.kind == scene::EventKind::Grasped;
    if (i % 100 == 99) std::cout << ' ' << std::hex << world.stateHash();
  }
  std::cout << (grasped ? " grasped" : " missed") << std::endl;
  return 0;
}

struct Result {
  std::string level, hashes;
};

Result run(int threads, const Environment& environment) {
  Result result;
  int ends[2];
  if (pipe(ends) != 0) return result;
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(ends[1], STDOUT_FILENO);
    close(ends[0]);
    close(ends[1]);
    unsetenv("VEST_KERNEL");
    unsetenv("GLIBC_TUNABLES");
    for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
    execl("/proc/self/exe", "test_levels", "--child", std::to_string(threads).c_str(), nullptr);
    _exit(127);
  }
  close(ends[1]);
  std::string text;
  std::array<char, 512> part;
  for (ssize_t n = read(ends[0], part.data(), part.size()); n > 0;
       n = read(ends[0], part.data(), part.size())) {
    text.append(part.data(), static_cast<std::size_t>(n));
  }
  close(ends[0]);
  int status = 0;
  waitpid(pid, &status, 0);
  EXPECT_TRUE(pid > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0) << "status " << status;
  const auto space = text.find(' ');
  if (space == std::string::npos) return result;
  return {text.substr(0, space), text.substr(space + 1)};
}

TEST(Reproduction, TheGynaecologySceneHasTheSameHashesWithFastKernelsMaskedOffAndAnyThreads) {
  const Result reference = run(1, {});
  ASSERT_EQ(std::count(reference.hashes.begin(), reference.hashes.end(), ' '), kSteps / 100)
      << reference.hashes;
  EXPECT_NE(reference.hashes.find("grasped"), std::string::npos)
      << "an instrument is at work, so that contacts count too";
  const Result baseline = run(1, {{"VEST_KERNEL", "baseline"}});
  EXPECT_EQ(baseline.level, "baseline");
  EXPECT_EQ(baseline.hashes, reference.hashes);
  const std::pair<std::string, std::string> masked{"GLIBC_TUNABLES", "glibc.cpu.hwcaps=-AVX2,-FMA"};
  EXPECT_EQ(run(1, {masked}).hashes, reference.hashes);
  EXPECT_EQ(run(2, {masked, {"VEST_KERNEL", "baseline"}}).hashes, reference.hashes);
  for (const int threads : {2, 4})
    EXPECT_EQ(run(threads, {}).hashes, reference.hashes) << threads << " threads";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::strcmp(argv[1], "--child") == 0) return child(std::atoi(argv[2]));
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
