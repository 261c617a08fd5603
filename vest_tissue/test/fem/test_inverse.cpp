// The precomputed inverse of an elastostatic object: what it is, and what is kept of it between runs.
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>

#include "beam.h"
#include "cutting.h"
#include "temporary_scene.h"
#include "vest_tissue/fem/cache.h"
#include "vest_tissue/fem/simulate.h"
#include "vest_tissue/fem/tissue.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

Eigen::MatrixXd inverse(const Description& d, const std::string& cache) {
  const auto tissue = makeTissue(d, Motion::Elastostatic, cache);
  prepareTissue(*tissue, 0.001);
  return tissue->answer;
}

TEST(Inverse, ItsColumnsAreTheFullSolutionsUnderUnitForces) {
  Description d = makeBox({4, 3, 3, 0.1, 0.08, 0.07});
  shake(d, 0.006);
  const auto tissue = makeTissue(d, Motion::Elastostatic, "");
  prepareTissue(*tissue, 0.001);
  EXPECT_EQ((tissue->answer - tissue->answer.transpose()).norm(), 0.0);
  Options o;
  o.equilibrium = true;
  for (const Index loaded : {Index{30}, Index{53}, Index{70}}) {
    const std::int32_t row = tissue->answer_number[loaded];
    if (row < 0) continue;
    Description pushed = d;
    pushed.loads = {{loaded, Eigen::Vector3d(0, 1, 0)}};
    const auto full = simulate(pushed, o);
    double error = 0.0, scale = 0.0;
    for (Index n = 0; n < d.nodes.size(); ++n) {
      const Eigen::Vector3d expected = full.positions[n] - d.nodes[n];
      const std::int32_t at = tissue->answer_number[n];
      const Eigen::Vector3d is = at < 0 ? Eigen::Vector3d::Zero()
                                        : Eigen::Vector3d(tissue->answer.col(3 * row + 1).segment<3>(3 * at));
      error = std::max(error, (is - expected).norm()), scale = std::max(scale, expected.norm());
    }
    EXPECT_GT(scale, 0.0);
    EXPECT_LT(error, 1e-10 * scale) << loaded;
  }
}

TEST(Inverse, ASecondStartReadsWhatTheFirstComputedAndDamageIsIgnored) {
  const vest::test::TemporaryScene folder;
  const std::string cache = folder.folder() + "/cache";
  const auto files = [&] {
    std::vector<std::filesystem::path> out;
    for (const auto& entry : std::filesystem::directory_iterator(cache)) out.push_back(entry.path());
    return out;
  };
  const Description same = makeBox({9, 4, 4, 0.1, 0.05, 0.05});  // 675 unknowns: worth keeping
  const Eigen::MatrixXd first = inverse(same, cache);
  const auto kept = files();
  ASSERT_EQ(kept.size(), 1u) << "that between surface nodes alone is too small to be kept";
  for (const auto& path : kept) EXPECT_EQ(path.extension(), ".bin");  // no temporary file is left
  // It is read: a valid file of other numbers under its name is believed.
  const auto tissue = makeTissue(same, Motion::Elastostatic, "");
  prepareTissue(*tissue, 0.001);
  std::vector<Index> nodes(tissue->answer.rows() / 3);
  for (Index n = 0; n < same.nodes.size(); ++n)
    if (tissue->answer_number[n] >= 0) nodes[static_cast<std::size_t>(tissue->answer_number[n])] = n;
  const std::uint64_t hash = contentHash(same, nodes);
  ASSERT_TRUE(std::filesystem::exists(cachePath(cache, hash)));
  ASSERT_TRUE(saveMatrix(cache, hash, 2.0 * first));
  EXPECT_EQ((inverse(same, cache) - 2.0 * first).norm(), 0.0);
  ASSERT_TRUE(saveMatrix(cache, hash, first));
  // Another material is other content.
  Description other = same;
  other.material.poisson_ratio = 0.31;
  EXPECT_GT((inverse(other, cache) - first).norm(), 1e-6 * first.norm());
  EXPECT_EQ(files().size(), 2u);
  // One flipped bit, a short file, an empty one: made anew with the same numbers, and the file is good again.
  const std::string path = cachePath(cache, hash);
  const auto size = std::filesystem::file_size(path);
  for (int kind = 0; kind < 3; ++kind) {
    if (kind == 0) {
      std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
      file.seekg(static_cast<std::streamoff>(size / 2));
      const char byte = static_cast<char>(file.get() ^ 1);
      file.seekp(static_cast<std::streamoff>(size / 2));
      file.put(byte);
    } else {
      std::filesystem::resize_file(path, kind == 1 ? size - 9 : 0);
    }
    Eigen::MatrixXd read;
    EXPECT_FALSE(loadMatrix(cache, hash, first.rows(), read));
    EXPECT_EQ((inverse(same, cache) - first).norm(), 0.0);
    ASSERT_TRUE(loadMatrix(cache, hash, first.rows(), read));
    EXPECT_EQ((read - first).norm(), 0.0);
  }
}

TEST(TissueHolds, ManyOnOneKnotAreOneOfTheirSum) {
  for (const Motion motion : {Motion::BackwardEuler, Motion::Elastostatic}) {
    Description d = makeBox({4, 3, 3, 0.1, 0.08, 0.07});
    d.motion = motion;
    d.material = {20e3, 0.4, 1050.0, 1.0, 0.002};
    Cutting many(d), one(d);
    const auto knot = static_cast<Index>(d.nodes.size() - 1);
    const std::array<double, 3> stiffness{500, 2000, 80};
    const std::array<double, 3> up{0.001, -0.002, 0.004};
    TissuePoint hold, whole;
    hold.kind = whole.kind = 1;
    hold.knots[0] = whole.knots[0] = knot, hold.weights[0] = whole.weights[0] = 1.0;
    whole.target.setZero();
    for (std::size_t i = 0; i < 3; ++i) {
      hold.stiffness = stiffness[i];
      hold.target = d.nodes[knot] + Eigen::Vector3d(0, 0.5 * up[i], up[i]);
      hold.with = i < 2 ? static_cast<std::int32_t>(i) + 1 : -1;
      hold.led = i > 0;
      many.scratch.points.push_back(hold);
      whole.stiffness += hold.stiffness, whole.target += hold.stiffness * hold.target;
    }
    whole.target /= whole.stiffness;
    one.scratch.points = {whole};
    for (Cutting* const c : {&many, &one}) {
      ASSERT_TRUE(freeTissueStep(*c->model, c->state, c->h,
                                 {c->held[0].data(), c->held[1].data(), c->held[2].data()},
                                 Eigen::Vector3d::Zero(), c->scratch));
      solveTissuePoints(*c->model, c->state, c->h, c->scratch);
      ASSERT_TRUE(endTissueStep(*c->model, c->state, c->h, c->scratch));
    }
    const Eigen::Vector3d moved = one.state.x[knot] - d.nodes[knot];
    EXPECT_GT(moved.norm(), 1e-6);
    EXPECT_LT((many.state.x[knot] - one.state.x[knot]).norm(), 1e-9 * moved.norm()) << int(motion);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const TissuePoint& point : many.scratch.points) {
      const Eigen::Vector3d spring = point.stiffness * (point.target - many.state.x[knot]);
      EXPECT_LT((point.force - spring).norm(), 1e-9 * spring.norm());
      sum += point.force;
    }
    EXPECT_LT((sum - one.scratch.points[0].force).norm(), 1e-9 * sum.norm());
  }
}

}  // namespace
}  // namespace vest::fem::test
