// The example of the scene format from files to answer, against a dense computation that shares no code with
// the room.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include <Eigen/LU>

#include "../../src/cli/simulate_scene.h"
#include "beam.h"
#include "temporary_scene.h"
#include "vest_tissue/material/database.h"

namespace vest::fem::test {

using namespace specimen;
namespace {

std::string sceneText(const std::string& strain, const std::string& solution) {
  return "gravity: [0, -9, 0]                # any unit system, as long as it is consistent\n"
         "objects:\n"
         "  - name: beam\n"
         "    model: fem                     # net | fem | volume\n"
         "    strain: " +
         strain +
         "\n"
         "    nodes: nodes.csv               # node,x,y,z\n"
         "    tetrahedra: tets.csv           # n0,n1,n2,n3\n"
         "    fixed: fixed_nodes.csv         # node\n"
         "    material: {youngs_modulus: 1000, poisson_ratio: 0.3, density: 0.2, rayleigh_mass: 0.1, "
         "rayleigh_stiffness: 0.1}\n"
         "    loads: loads.csv               # node,fx,fy,fz\n"
         "solution: " +
         solution + "\n";
}

struct Files {
  vest::test::TemporaryScene folder;
  Description d = makeBox({5, 2, 2, 5.0, 1.0, 1.0});
  Files() {
    d.loads = {{53, {0.1, -0.2, 0.3}}, {49, {0.0, -0.5, 0.1}}};
    std::ostringstream nodes, tets, fixed, loads;
    nodes.precision(17);
    nodes << "node,x,y,z\n";
    tets << "n0,n1,n2,n3\n";
    fixed << "node\n";
    loads << "node,fx,fy,fz\n";
    for (std::size_t n = 0; n < d.nodes.size(); ++n) {
      nodes << n << ',' << d.nodes[n].x() << ',' << d.nodes[n].y() << ',' << d.nodes[n].z() << '\n';
    }
    for (const auto& t : d.tetrahedra) tets << t[0] << ',' << t[1] << ',' << t[2] << ',' << t[3] << '\n';
    for (const Index n : d.fixed) fixed << n << '\n';
    for (const Load& l : d.loads)
      loads << l.node << ',' << l.force.x() << ',' << l.force.y() << ',' << l.force.z() << '\n';
    folder.write("nodes.csv", nodes.str());
    folder.write("tets.csv", tets.str());
    folder.write("fixed_nodes.csv", fixed.str());
    folder.write("loads.csv", loads.str());
  }
  std::vector<Eigen::Vector3d> run(const std::string& strain, const std::string& solution,
                                   tools::SimulateOptions o) const {
    const auto result =
        tools::simulateScene(scene::loadScene(folder.write("scene.yaml", sceneText(strain, solution))), o);
    EXPECT_EQ(result.names, std::vector<std::string>{"beam"});
    EXPECT_EQ(result.hash.size(), 16u);
    return result.positions.at(0);
  }
};

// Protects that elements bleed, and are cooled, by the blood of the tissue that the scene names.
TEST(FemScene, ElementsHaveTheBloodOfTheTissueThatTheyName) {
  const material::Tissue liver = material::readDatabase(material::databasePath()).at("liver");
  const double blood = liver.at("perfusion").value;
  ASSERT_GT(blood, 0.01) << "1/s";
  Files files;
  std::string text = sceneText("small", "{integrator: static}");
  const std::string plain = "material: {youngs_modulus: 1000, poisson_ratio: 0.3, density: 0.2,";
  text.replace(text.find(plain), plain.size(), "material: {of: liver, youngs_modulus: 7000,");
  const scene::Object one = scene::loadScene(files.folder.write("scene.yaml", text)).objects[0];
  EXPECT_EQ(one.material, "liver");
  EXPECT_EQ(one.thermal.perfusion, blood);
  EXPECT_EQ(one.fem->material.youngs_modulus, 7000) << "what is written goes before";
  EXPECT_EQ(one.fem->material.density, liver.at("density").value);

  // Two elements that share a face; the second has twice the volume of the first.
  files.folder.write(
      "two.msh",
      "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n"
      "5 1 1 1\n$EndNodes\n$Elements\n2\n1 4 2 1 1 1 2 3 4\n2 4 2 2 2 2 3 4 5\n$EndElements\n");
  const auto with = [&](const std::string& of) {
    return scene::loadScene(files.folder.write(
        "labels.yaml",
        "objects:\n  - name: two\n    model: fem\n    strain: small\n    mesh: two.msh\n"
        "    thermal: {perfusion: 0.001}\n    materials:\n      - {label: 1, of: " +
            of + "}\n      - {label: 2, youngs_modulus: 1000, poisson_ratio: 0.3, density: 1}\n" +
            "solution: {integrator: static}\n"));
  };
  const scene::Object two = with("liver").objects[0];
  ASSERT_EQ(two.knot_perfusion.size(), 5u);
  EXPECT_EQ(two.fem->materials[0].youngs_modulus, liver.law().youngs_modulus);
  EXPECT_NEAR(two.knot_perfusion[0], blood, 1e-12);
  for (std::size_t k = 1; k < 4; ++k)
    EXPECT_NEAR(two.knot_perfusion[k], (blood + 2 * 0.001) / 3, 1e-12) << k << ": of both, by volume";
  EXPECT_NEAR(two.knot_perfusion[4], 0.001, 1e-12) << "names no tissue: the object's";
  try {
    with("stone");
    ADD_FAILURE() << "no such tissue";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("of: stone: must be a material of the database"),
              std::string::npos)
        << error.what();
  }
}

/// K = sum V B^T D B in Voigt's notation, N = inverse of [1 x y z], dense.
struct Dense {
  Eigen::MatrixXd K, M;
  Eigen::VectorXd f;
  std::vector<Eigen::Index> free;
  explicit Dense(const Description& d) {
    const Eigen::Index n = 3 * static_cast<Eigen::Index>(d.nodes.size());
    K = Eigen::MatrixXd::Zero(n, n);
    M = K;
    f = Eigen::VectorXd::Zero(n);
    const double E = 1000, nu = 0.3, rho = 0.2, c = E / ((1 + nu) * (1 - 2 * nu));
    Eigen::Matrix<double, 6, 6> D = Eigen::Matrix<double, 6, 6>::Zero();
    D.topLeftCorner<3, 3>().setConstant(c * nu);
    for (int k = 0; k < 3; ++k) {
      D(k, k) = c * (1 - nu);
      D(k + 3, k + 3) = E / (2 * (1 + nu));
    }
    for (const auto& t : d.tetrahedra) {
      Eigen::Matrix4d P;
      for (int a = 0; a < 4; ++a) P.row(a) << 1.0, d.nodes[t[static_cast<std::size_t>(a)]].transpose();
      const double V = P.determinant() / 6.0;
      const Eigen::Matrix4d N = P.inverse();  // column a: coefficients of N_a
      Eigen::Matrix<double, 6, 12> B = Eigen::Matrix<double, 6, 12>::Zero();
      for (int a = 0; a < 4; ++a) {
        const double bx = N(1, a), by = N(2, a), bz = N(3, a);
        B.block<6, 3>(0, 3 * a) << bx, 0, 0, 0, by, 0, 0, 0, bz, by, bx, 0, 0, bz, by, bz, 0, bx;
      }
      const Eigen::Matrix<double, 12, 12> Ke = V * B.transpose() * D * B;
      for (int a = 0; a < 12; ++a) {
        const Eigen::Index i = 3 * t[static_cast<std::size_t>(a / 3)] + a % 3;
        M(i, i) += rho * V / 4.0;
        for (int b = 0; b < 12; ++b) K(i, 3 * t[static_cast<std::size_t>(b / 3)] + b % 3) += Ke(a, b);
      }
    }
    std::vector<bool> held(d.nodes.size(), false);
    for (const Index i : d.fixed) held[i] = true;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!held[static_cast<std::size_t>(i / 3)]) free.push_back(i);
      if (i % 3 == 1) f[i] += -9.0 * M(i, i);
    }
    for (const Load& l : d.loads) f.segment<3>(3 * l.node) += l.force;
    const auto size = static_cast<Eigen::Index>(free.size());
    const auto at = [this](Eigen::Index i) { return free[static_cast<std::size_t>(i)]; };
    const auto ofFree = [&](const Eigen::MatrixXd& all) {  // Eigen 3.3 takes no list of indices
      return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(
          size, size, [&](Eigen::Index i, Eigen::Index j) { return all(at(i), at(j)); }));
    };
    K = ofFree(K), M = ofFree(M);
    f = Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(size, [&](Eigen::Index i) { return f[at(i)]; }));
  }
  double difference(const Description& d, const std::vector<Eigen::Vector3d>& x,
                    const Eigen::VectorXd& u) const {
    double error = 0.0;
    for (std::size_t i = 0; i < free.size(); ++i) {
      const auto n = static_cast<std::size_t>(free[i] / 3);
      error = std::max(
          error, std::abs(x[n][free[i] % 3] - d.nodes[n][free[i] % 3] - u[static_cast<Eigen::Index>(i)]));
    }
    return error / u.cwiseAbs().maxCoeff();
  }
};

TEST(SceneExample, StaticSmallStrainIsTheDenseSolution) {
  const Files files;
  const Dense dense(files.d);
  const Eigen::VectorXd u = dense.K.fullPivLu().solve(dense.f);
  EXPECT_LT(dense.difference(files.d, files.run("small", "{integrator: static}", {}), u), 1e-10);
  tools::SimulateOptions o;
  o.equilibrium = true;
  EXPECT_LT(dense.difference(files.d, files.run("small", "{integrator: backward_euler, dt: 0.05}", o), u),
            1e-10);
}

TEST(SceneExample, BackwardEulerSmallStrainIsTheDenseRecurrence) {
  const Files files;
  const Dense dense(files.d);
  const double dt = 0.05;
  const Eigen::MatrixXd C = 0.1 * dense.M + 0.1 * dense.K;
  const Eigen::FullPivLU<Eigen::MatrixXd> A(dense.M + dt * C + dt * dt * dense.K);
  Eigen::VectorXd u = Eigen::VectorXd::Zero(dense.f.size()), v = u;
  for (int i = 0; i < 40; ++i) {
    v = A.solve(dense.M * v + dt * (dense.f - dense.K * u));  // M v' = f - K u' - C v', u' = u + dt v'
    u += dt * v;
  }
  tools::SimulateOptions o;
  o.steps = 40;
  EXPECT_LT(dense.difference(files.d, files.run("small", "{integrator: backward_euler, dt: 0.05}", o), u),
            1e-10);
  o.threads = 2;
  o.dt = 0.05;
  EXPECT_LT(dense.difference(files.d, files.run("small", "{integrator: backward_euler, dt: 1}", o), u),
            1e-10);
}

TEST(SceneExample, CorotationalSettlesInItsStaticEquilibrium) {
  const Files files;
  tools::SimulateOptions o;
  const auto rest = files.run("corotational", "{integrator: static}", o);
  o.steps = 1500;
  const auto moved = files.run("corotational", "{integrator: backward_euler, dt: 0.05}", o);
  double error = 0.0, size = 0.0;
  for (std::size_t n = 0; n < rest.size(); ++n) {
    error = std::max(error, (rest[n] - moved[n]).norm());
    size = std::max(size, (rest[n] - files.d.nodes[n]).norm());
  }
  EXPECT_GT(size, 0.3);
  EXPECT_LT(error, 1e-6 * size);
}

TEST(SceneExample, TheTrainersIntegratorMovesItInAWorldWithTheSameSteps) {
  const Files files;
  tools::SimulateOptions o;
  o.steps = 60;
  for (const std::string strain : {"small", "corotational"}) {
    const auto alone = files.run(strain, "{integrator: backward_euler, dt: 0.005}", o);
    const auto world = files.run(strain, "{integrator: newton_euler, dt: 0.005}", o);
    double error = 0.0, size = 0.0;
    for (std::size_t n = 0; n < alone.size(); ++n) {
      error = std::max(error, (alone[n] - world[n]).norm());
      size = std::max(size, (alone[n] - files.d.nodes[n]).norm());
    }
    EXPECT_LT(error, 1e-5 * size) << strain;  // a World tells positions as float32
  }
}

TEST(SceneExample, OutputHoldsEveryNodeToTheLastDigit) {
  const Files files;
  const auto scene =
      scene::loadScene(files.folder.write("scene.yaml", sceneText("small", "{integrator: static}")));
  const auto result = tools::simulateScene(scene, {});
  const std::string path = files.folder.folder() + "/out.csv";
  tools::writePositions(result, path);
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "object,node,x,y,z");
  for (std::size_t n = 0; n < files.d.nodes.size(); ++n) {
    ASSERT_TRUE(std::getline(file, line));
    std::istringstream cells(line);
    std::string object, cell;
    std::getline(cells, object, ',');
    EXPECT_EQ(object, "beam");
    std::getline(cells, cell, ',');
    EXPECT_EQ(cell, std::to_string(n));
    for (int k = 0; k < 3; ++k) {
      std::getline(cells, cell, ',');
      EXPECT_EQ(std::stod(cell), result.positions[0][n][k]);
    }
  }
  EXPECT_FALSE(std::getline(file, line));
  EXPECT_THROW(tools::writePositions(result, files.folder.folder() + "/nowhere/out.csv"), std::runtime_error);
}

TEST(SceneExample, MistakesAreRefusedWithFileAndField) {
  const Files files;
  const auto message = [&](const std::string& from, const std::string& to) -> std::string {
    std::string text = sceneText("small", "{integrator: backward_euler, dt: 0.05}");
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    try {
      tools::SimulateOptions o;
      o.steps = 1;
      tools::simulateScene(scene::loadScene(files.folder.write("scene.yaml", text)), o);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "nothing was refused";
  };
  const std::vector<std::array<std::string, 3>> cases = {
      {"strain: small", "strain: large", "strain"},
      {"poisson_ratio: 0.3", "poisson_ratio: 0.5", "poisson_ratio"},
      {"youngs_modulus: 1000", "youngs_modulus: -1", "youngs_modulus"},
      {"density: 0.2", "density: 0", "density"},
      {"density: 0.2", "colour: 0.2", "colour"},
      {"rayleigh_mass: 0.1", "rayleigh_mass: -0.1", "rayleigh_mass"},
      {"nodes: nodes.csv", "nodes: absent.csv", "absent.csv"},
      {"dt: 0.05", "dt: 0", "dt"},
      {"tetrahedra: tets.csv", "tetrahedra: nodes.csv", "nodes.csv"},
  };
  for (const auto& c : cases) {
    const std::string text = message(c[0], c[1]);
    EXPECT_NE(text.find(c[2]), std::string::npos) << c[1] << ": " << text;
    EXPECT_EQ(text.find("nothing was refused"), std::string::npos) << c[1];
  }
  files.folder.write("tets.csv", "n0,n1,n2,n3\n0,1,2,54\n");
  EXPECT_NE(message("objects", "objects").find("tets.csv:2"), std::string::npos);
  files.folder.write("tets.csv", "n0,n1,n2,n3\n0,9,12,13\n0,12,9,13\n");
  EXPECT_NE(message("objects", "objects").find("tets.csv:3"), std::string::npos) << "inverted";
}

/// A vessel of elements has stations as one of nets has: from the end that is named, along its middle.
TEST(SceneExample, AVesselOfElementsHasRingsFromTheEndThatIsNamed) {
  const Files files;
  const auto load = [&](const std::string& keys) {
    std::string text = sceneText("small", "{integrator: backward_euler, dt: 0.05}");
    text.replace(text.find("    strain"), 0, keys);
    return scene::loadScene(files.folder.write("scene.yaml", text)).objects[0];
  };
  for (const bool turned : {false, true}) {
    const scene::Object o = load(std::string("    vessel_segment: artery\n    vessel_from: [") +
                                 (turned ? "5" : "0") + ", 0.5, 0.5]\n");
    const auto& tube = o.tube;
    ASSERT_GE(tube.rings.size(), 3U);
    std::size_t knots = 0;
    for (std::size_t r = 0; r < tube.rings.size(); ++r) {
      Eigen::Vector3d middle = Eigen::Vector3d::Zero(), first = middle;
      for (const auto k : tube.rings[r])
        middle += o.rest_position[k] / static_cast<double>(tube.rings[r].size());
      for (const auto k : tube.rings[0])
        first += o.rest_position[k] / static_cast<double>(tube.rings[0].size());
      knots += tube.rings[r].size();
      EXPECT_NEAR(tube.station[r], std::fabs(middle.x() - first.x()), 0.1) << r;
      EXPECT_LT(std::hypot(middle.y() - 0.5, middle.z() - 0.5), 0.25) << "the middle of the beam";
    }
    EXPECT_EQ(tube.station[0], 0.0);
    EXPECT_GT(tube.station.back(), 3.0) << "of 5, less half a ring at each end";
    EXPECT_EQ(knots, 50U) << "each knot of the surface is on one ring: 54 less four inside";
    const double x = o.rest_position[tube.rings[0][0]].x();
    EXPECT_LT(std::fabs(x - (turned ? 5.0 : 0.0)), 1.6) << "station 0 is at the end that was named";
  }
  for (const char* const wrong :
       {"    vessel_from: [0, 0.5, 0.5]\n", "    vessel_segment: artery\n    vessel_from: [0, 0.5]\n"}) {
    try {
      load(wrong);
      ADD_FAILURE() << "nothing was refused";
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find("vessel_from"), std::string::npos) << e.what();
    }
  }
}

// Its files are those of any other object; the World's knots are the nodes of its boundary.
TEST(SceneExample, CondensedElementsAreReadAndWhatTheyCannotBeIsOneMessage) {
  const Files files;
  const auto with = [&](const std::string& key, const std::string& solution, const std::string& strain) {
    std::string text = sceneText(strain, solution);
    text.insert(text.find("    nodes:"), key);
    return files.folder.write("scene.yaml", text);
  };
  const std::string world = "{integrator: newton_euler, dt: 0.001}",
                    condensed = "    integrator: condensed\n";
  const scene::Description read = scene::loadScene(with(condensed, world, "small"));
  const scene::Object& o = read.objects.at(0);
  EXPECT_EQ(o.fem->motion, Motion::Condensed);
  EXPECT_EQ(o.fem->outer, 50u) << "of 54 nodes, 4 lie inside";
  EXPECT_EQ(o.position.size(), 50u);
  for (const auto& t : o.contact_triangles)
    for (const Index n : t) ASSERT_LT(n, 50u);
  const auto refused = [&](const std::string& key, const std::string& solution, const std::string& strain,
                           const std::string& cause) {
    std::string message;
    try {
      scene::loadScene(with(key, solution, strain));
    } catch (const std::invalid_argument& error) {
      message = error.what();
    }
    EXPECT_NE(message.find(cause), std::string::npos) << message;
    EXPECT_NE(message.find("scene.yaml"), std::string::npos) << message;
  };
  refused(condensed, "{integrator: static}", "small",
          "must be backward_euler or elastostatic without a World");
  refused(condensed, world, "corotational", "must be backward_euler with strain: corotational");
  refused(condensed + "    start: equilibrium\n", world, "small", "must be rest with integrator: condensed");
}

}  // namespace
}  // namespace vest::fem::test
