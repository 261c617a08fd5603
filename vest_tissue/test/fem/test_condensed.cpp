#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "beam.h"
#include "temporary_scene.h"
#include "vest_tissue/fem/cache.h"
#include "vest_tissue/fem/condensed.h"
#include "vest_tissue/fem/simulate.h"

namespace vest::fem::test {
namespace {

Description block() {
  Description d = makeBox({5, 4, 4, 1.0, 0.8, 0.7});
  shake(d, 0.06);
  return d;
}

/// Loads on outer nodes, and the same as loads of a description.
SparseLoad someLoads(const CondensedModel& model, std::size_t count, std::vector<Load>* plain = nullptr) {
  std::mt19937 random(5);
  SparseLoad load;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t outer = static_cast<std::uint32_t>((7 + 11 * i) % model.outerNodes().size());
    Load l;
    l.node = model.outerNodes()[outer];
    for (int d = 0; d < 3; ++d) {
      l.force[d] = static_cast<double>(random()) / 4294967296.0 - 0.5;
      load.unknown.push_back(3 * outer + static_cast<std::uint32_t>(d));
      load.force.push_back(l.force[d]);
    }
    if (plain != nullptr) plain->push_back(l);
  }
  return load;
}

Eigen::VectorXd respond(const CondensedModel& model, const CondensedState& state, const SparseLoad& load) {
  CondensedScratch scratch(model);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.unknowns());
  addResponse(model, state, load, scratch, u);
  return u;
}

/// Largest difference to a full solution of `d`, over its largest displacement, on nodes that are not loose.
double difference(const CondensedModel& model, const CondensedState& state, const Eigen::VectorXd& u,
                  const Description& d) {
  Options o;
  o.equilibrium = true;
  const Result full = simulate(d, o);
  double error = 0.0, scale = 0.0;
  for (std::size_t i = 0; i < model.outerNodes().size(); ++i) {
    const Index n = model.outerNodes()[i];
    if (state.loose[n] != 0) continue;
    const Eigen::Vector3d expected = full.positions[n] - d.nodes[n];
    error = std::max(error, (u.segment<3>(3 * static_cast<Eigen::Index>(i)) - expected).norm());
    scale = std::max(scale, expected.norm());
  }
  EXPECT_GT(scale, 0.0);
  return error / scale;
}

Description withoutElements(Description d, const CondensedState& state) {
  std::vector<std::array<Index, 4>> kept;
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    if (state.alive[e] != 0 && state.loose[d.tetrahedra[e][0]] == 0) kept.push_back(d.tetrahedra[e]);
  }
  d.tetrahedra = kept;
  return d;
}

TEST(Condensed, EqualsTheFullSolution) {
  Description d = block();
  const CondensedModel model(d, {});
  EXPECT_LT(model.outerNodes().size(), model.model().free_node.size());  // there are inner nodes
  const SparseLoad load = someLoads(model, 10, &d.loads);
  const CondensedState state(model);
  EXPECT_LT(difference(model, state, respond(model, state, load), d), 1e-10);
  const auto field = fullField(model, load);
  Options o;
  o.equilibrium = true;
  const Result full = simulate(d, o);
  for (std::size_t n = 0; n < d.nodes.size(); ++n) {
    EXPECT_LT((field[n] - (full.positions[n] - d.nodes[n])).norm(), 1e-12);
  }
}

TEST(Condensed, InverseIsThatOfTheCondensedStiffness) {
  // C (K_oo - K_oi K_ii^-1 K_io) = 1, with K from columns of the full inverse.
  const CondensedModel model(makeBox({3, 3, 3, 1.0, 1.0, 1.0}), {});
  const Eigen::Index n = 3 * static_cast<Eigen::Index>(model.model().free_node.size());
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(n, n);
  model.solveFull(inverse);
  const Eigen::MatrixXd K = inverse.inverse();
  std::vector<Eigen::Index> outer, inner;
  for (Eigen::Index i = 0; i < n; ++i) {
    (model.outerNumber(model.model().free_node[static_cast<std::size_t>(i / 3)]) >= 0 ? outer : inner)
        .push_back(i);
  }
  ASSERT_EQ(static_cast<Eigen::Index>(outer.size()), model.unknowns());
  ASSERT_GT(inner.size(), 0u);
  const Eigen::MatrixXd condensed =
      K(outer, outer) - K(outer, inner) * K(inner, inner).inverse() * K(inner, outer);
  EXPECT_LT(
      (model.inverse() * condensed - Eigen::MatrixXd::Identity(model.unknowns(), model.unknowns())).norm(),
      1e-9);
}

TEST(Condensed, PrescribedDisplacementsAreReachedAndEqualTheFullSolution) {
  Description d = block();
  const CondensedModel model(d, {});
  const CondensedState state(model);
  CondensedScratch scratch(model);
  std::vector<double> target;
  SparseLoad grasp;
  for (const std::uint32_t outer : {20u, 21u, 33u}) {
    const Eigen::Vector3d move(0.02, -0.01, 0.03);
    d.prescribed.push_back({model.outerNodes()[outer], move});
    for (std::uint32_t k = 0; k < 3; ++k) {
      grasp.unknown.push_back(3 * outer + k);
      target.push_back(move[static_cast<Eigen::Index>(k)]);
    }
  }
  Description loaded = d;
  SparseLoad push;
  push.unknown = {3 * 50, 3 * 50 + 2};
  push.force = {0.4, -0.8};
  loaded.loads = {{model.outerNodes()[50], {0.4, 0.0, -0.8}}};
  Eigen::VectorXd u = respond(model, state, push);
  ASSERT_TRUE(prescribe(model, state, target, u, scratch, grasp));
  addResponse(model, state, grasp, scratch, u);
  for (std::size_t i = 0; i < target.size(); ++i) EXPECT_NEAR(u[grasp.unknown[i]], target[i], 1e-12);
  EXPECT_LT(difference(model, state, u, loaded), 1e-9);
  // The forces are those with which the full solution holds the nodes.
  Options o;
  o.equilibrium = true;
  const Result full = simulate(loaded, o);
  for (std::size_t i = 0; i < grasp.unknown.size(); ++i) {
    EXPECT_NEAR(grasp.force[i],
                full.reactions[model.outerNodes()[grasp.unknown[i] / 3]]
                              [static_cast<Eigen::Index>(grasp.unknown[i] % 3)],
                1e-8);
  }
  grasp.unknown[1] = grasp.unknown[0];
  EXPECT_FALSE(prescribe(model, state, target, u, scratch, grasp));
}

TEST(Condensed, SurfaceUnknownsComeFirstAndCanBeAskedAlone) {
  Description d = block();
  CondensedOptions options;
  options.outer = Outer::Deep;
  const CondensedModel model(d, options);
  ASSERT_LT(model.surfaceUnknowns(), model.unknowns());
  EXPECT_EQ(model.surfaceUnknowns(), CondensedModel(d, {}).unknowns());
  CondensedState state(model);
  ASSERT_TRUE(cut(model, state, {60, 61}).done);
  const SparseLoad load = someLoads(model, 10);
  CondensedScratch scratch(model);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(model.surfaceUnknowns());
  addResponse(model, state, load, scratch, u);
  EXPECT_EQ((u - respond(model, state, load).head(u.size())).norm(), 0.0);
}

TEST(Cut, EqualsAFreshFactorisationForSurfaceAndInnerElementsAndRepeatedCuts) {
  for (const Outer outer : {Outer::Surface, Outer::Deep, Outer::All}) {
    Description d = block();
    CondensedOptions options;
    options.outer = outer;
    const CondensedModel model(d, options);
    const SparseLoad load = someLoads(model, 10, &d.loads);
    CondensedState state(model);
    const Eigen::VectorXd whole = respond(model, state, load);
    int rank = 0;
    for (const std::vector<std::size_t>& elements :
         {std::vector<std::size_t>{3, 17}, {200, 201, 250}, {251, 3, 120, 121, 122}, {301}}) {
      const CutReport report = cut(model, state, elements);
      ASSERT_TRUE(report.done);
      EXPECT_FALSE(report.separated);
      EXPECT_GT(report.rank, rank);
      rank = report.rank;
      const Eigen::VectorXd u = respond(model, state, load);
      EXPECT_LT(difference(model, state, u, withoutElements(d, state)), 1e-9);
      EXPECT_GT((u - whole).norm(), 1e-6 * whole.norm());  // the cut does something
      // complianceBlock is the same matrix.
      const Eigen::Matrix3d C = complianceBlock(model, state, 12, 40);
      SparseLoad unit;
      unit.unknown = {3 * 40 + 1};
      unit.force = {1.0};
      EXPECT_LT((respond(model, state, unit).segment<3>(36) - C.col(1)).norm(), 1e-12 * C.norm() + 1e-16);
    }
    EXPECT_EQ(rank, 10 * 6);  // elements that were dead already cost nothing
  }
}

TEST(Cut, APartThatComesLooseIsReportedAndTheRestStaysExact) {
  Description d = makeBox({6, 2, 2, 3.0, 0.6, 0.6});
  shake(d, 0.05);
  CondensedOptions options;
  options.most_rank = 400;
  const CondensedModel model(d, options);
  CondensedState state(model);
  std::vector<std::size_t> slice;  // all elements of the cells 3 along x
  for (std::size_t e = 0; e < d.tetrahedra.size(); ++e) {
    if (e / (2 * 2 * 6) == 3) slice.push_back(e);
  }
  ASSERT_EQ(slice.size(), 24u);
  const CutReport report = cut(model, state, slice);
  ASSERT_TRUE(report.done);
  EXPECT_TRUE(report.separated);
  EXPECT_EQ(report.loose_nodes.size(), 3u * 9u);
  for (const Index n : report.loose_nodes) EXPECT_GT(d.nodes[n].x(), 1.8);
  SparseLoad load;
  Description rest = d;
  for (const Index n : {Index{9 * 3 + 4}, Index{9 * 2 + 8}}) {
    const auto outer = model.outerNumber(n);
    if (outer < 0) continue;
    load.unknown.push_back(static_cast<std::uint32_t>(3 * outer + 2));
    load.force.push_back(0.5);
    rest.loads.push_back({n, {0.0, 0.0, 0.5}});
  }
  ASSERT_FALSE(load.unknown.empty());
  EXPECT_LT(difference(model, state, respond(model, state, load), withoutElements(rest, state)), 1e-8);
  const auto parts = looseParts(model, state);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0].node, report.loose_nodes);
  EXPECT_EQ(parts[0].description.tetrahedra.size(), 2u * 24u);
  EXPECT_NO_THROW(buildModel(parts[0].description, Use::Dynamic));
  EXPECT_THROW(buildModel(parts[0].description, Use::Static), std::invalid_argument);
  // A second cut, into the loose part and into the rest.
  const CutReport second = cut(model, state, {0, d.tetrahedra.size() - 1});
  ASSERT_TRUE(second.done);
  EXPECT_FALSE(second.separated);
  EXPECT_LT(difference(model, state, respond(model, state, load), withoutElements(rest, state)), 1e-8);
}

TEST(Cut, BeyondItsRoomChangesNothing) {
  Description d = block();
  CondensedOptions options;
  options.most_rank = 12;
  const CondensedModel model(d, options);
  CondensedState state(model);
  const SparseLoad load = someLoads(model, 4);
  ASSERT_TRUE(cut(model, state, {5, 6}).done);
  const Eigen::VectorXd before = respond(model, state, load);
  const CutReport report = cut(model, state, {7});
  EXPECT_FALSE(report.done);
  EXPECT_EQ(report.rank, 12);
  EXPECT_EQ(state.alive[7], 1);
  EXPECT_EQ((respond(model, state, load) - before).norm(), 0.0);
  EXPECT_THROW(cut(model, state, {100000}), std::invalid_argument);
}

TEST(Cut, RandomSequencesNeverBreakTheAnswer) {
  std::mt19937 random(17);
  int separations = 0, cuts = 0, compared = 0;
  for (int run = 0; run < 12; ++run) {
    Description d = makeBox({3, 2, 2, 1.0, 0.7, 0.7});
    shake(d, 0.05, static_cast<unsigned>(run));
    CondensedOptions options;
    options.most_rank = 700;
    const CondensedModel model(d, options);
    CondensedState state(model);
    for (int i = 0; i < 14; ++i) {
      std::vector<std::size_t> elements;
      for (int k = 0; k < 4; ++k) elements.push_back(random() % d.tetrahedra.size());
      const CutReport report = cut(model, state, elements);
      if (!report.done) continue;
      ++cuts;
      separations += report.separated ? 1 : 0;
      const SparseLoad load = someLoads(model, 3);
      ASSERT_TRUE(respond(model, state, load).allFinite());
      // Where nothing hangs by a hinge, it is the fresh factorisation's answer on what is left.
      Description rest = withoutElements(d, state);
      SparseLoad held;
      for (std::size_t k = 0; k < load.unknown.size(); ++k) {
        const Index n = model.outerNodes()[load.unknown[k] / 3];
        if (state.loose[n] != 0) continue;
        held.unknown.push_back(load.unknown[k]);
        held.force.push_back(load.force[k]);
        rest.loads.push_back({n, load.force[k] * Eigen::Vector3d::Unit(load.unknown[k] % 3)});
      }
      if (!report.hanging && !held.unknown.empty()) {
        EXPECT_LT(difference(model, state, respond(model, state, held), rest), 1e-6);
        ++compared;
      }
      // Compliance of what still hangs on stays symmetric and positive.
      for (std::uint32_t o = 0; o < model.outerNodes().size(); o += 5) {
        if (state.loose[model.outerNodes()[o]] != 0) continue;
        const Eigen::Matrix3d C = complianceBlock(model, state, o, o);
        ASSERT_GT(C.diagonal().minCoeff(), 0.0);
      }
    }
  }
  EXPECT_GE(cuts, 100);
  EXPECT_GE(separations, 10);
  EXPECT_GE(compared, 20);
}

TEST(Cache, SecondStartReadsWhatTheFirstComputedAndDamageIsIgnored) {
  const vest::test::TemporaryScene folder;
  CondensedOptions options;
  options.cache_directory = folder.folder() + "/cache";
  const Description d = makeBox({3, 2, 2, 1.0, 0.5, 0.5});
  const CondensedModel first(d, options);
  EXPECT_FALSE(first.fromCache());
  const CondensedModel second(d, options);
  EXPECT_TRUE(second.fromCache());
  EXPECT_EQ((first.inverse() - second.inverse()).norm(), 0.0);
  // Cuts work from the cache too: the factor is made when it is needed.
  CondensedState a(first), b(second);
  ASSERT_TRUE(cut(first, a, {40}).done);
  ASSERT_TRUE(cut(second, b, {40}).done);
  EXPECT_EQ((a.outer_columns.leftCols(6) - b.outer_columns.leftCols(6)).norm(), 0.0);
  // Another material is other content.
  Description other = d;
  other.material.poisson_ratio = 0.31;
  EXPECT_FALSE(CondensedModel(other, options).fromCache());
  const std::string path = cachePath(options.cache_directory, contentHash(d, first.outerNodes()));
  ASSERT_TRUE(std::filesystem::exists(path));
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(options.cache_directory)) {
    ++files;
    EXPECT_EQ(entry.path().extension(), ".bin");  // no temporary file is left
  }
  EXPECT_EQ(files, 2u);
  // One flipped bit, a short file, an empty one: rebuilt with the same numbers, and the file is good again.
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
    const CondensedModel again(d, options);
    EXPECT_FALSE(again.fromCache());
    EXPECT_EQ((again.inverse() - first.inverse()).norm(), 0.0);
    EXPECT_TRUE(CondensedModel(d, options).fromCache());
  }
}

}  // namespace
}  // namespace vest::fem::test
