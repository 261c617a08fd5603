#pragma once

// A capsule against 7,040 moving triangles, update and query: World's search for tool contacts, and Bullet's
// tree of boxes, refitted, with the same distance between capsule and triangle at its leaves.
#include <vector>

#include "measure.h"
#include "nets.h"
#include "vest_tissue/base/nearest.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/scene/world_model.h"

#if defined(VEST_HAVE_BULLET)
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btTriangleIndexVertexArray.h>
#endif

namespace vest::bench {

struct Surface {
  scene::Description scene;
  scene::ToolInput tool;
  Eigen::Vector3d a, b;  ///< m: axis of the instrument's shaft
};

/// A tube of 441 rings of 8; the shaft of a suction cannula lies across it.
inline Surface surface() {
  Surface s;
  specimen::TubeOptions o;
  o.rings = 441, o.length = 0.44, o.mass = 0.11;
  s.scene = specimen::tubeScene(o);
  s.scene.gravity.setZero();
  s.tool = specimen::grasper(Eigen::Vector3d(0.01, 0.0, 0.0535), 0.0);
  s.tool.tool = tools::ToolKind::SuctionIrrigator;
  s.a = s.tool.pivot, s.b = s.tool.position;
  return s;
}

/// µs of World's collision stage a step.
inline double searchOfWorld(const Surface& s) {
  scene::World w(s.scene);
  w.measureStages(true);
  scene::StepInput in;
  scene::StepReport report;
  in.tools[1] = s.tool;
  std::vector<double> times;
  for (int i = 0; i < 400; ++i) {
    in.step = w.steps();
    w.step(in, report);
    times.push_back(1e6 * report.stage_seconds[1]);
  }
  std::nth_element(times.begin(), times.begin() + 200, times.end());
  return times[200];
}

#if defined(VEST_HAVE_BULLET)
class NearTriangles : public btTriangleCallback {
 public:
  NearTriangles(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double reach)
      : a_(a), b_(b), reach_(reach) {}
  void processTriangle(btVector3* t, int, int) override {
    const auto p = [&](int i) { return Eigen::Vector3d(t[i].x(), t[i].y(), t[i].z()); };
    near += contact::nearest(a_, b_, {p(0), p(1), p(2)}).distance < reach_;
  }
  int near = 0;

 private:
  Eigen::Vector3d a_, b_;
  double reach_;
};

inline double searchOfBullet(const Surface& s) {
  const auto& o = s.scene.objects[0];
  std::vector<btScalar> x;
  for (const auto& p : o.position)
    for (int e = 0; e < 3; ++e) x.push_back(btScalar(p[e]));
  std::vector<int> triangles;
  for (const auto& t : o.contact_triangles)
    for (const auto k : t) triangles.push_back(static_cast<int>(k));
  btTriangleIndexVertexArray mesh(static_cast<int>(triangles.size() / 3), triangles.data(), 3 * sizeof(int),
                                  static_cast<int>(o.position.size()), x.data(), 3 * sizeof(btScalar));
  btBvhTriangleMeshShape shape(&mesh, true);
  const double reach = 0.0025 + o.contact_thickness + 0.0015;
  const auto vector = [](const Eigen::Vector3d& p) {
    return btVector3(btScalar(p.x()), btScalar(p.y()), btScalar(p.z()));
  };
  const Eigen::Vector3d low = (s.a.cwiseMin(s.b).array() - reach).matrix(),
                        high = (s.a.cwiseMax(s.b).array() + reach).matrix();
  btScalar sign = 1;
  return microseconds([&] {
    for (auto& c : x) c += sign * btScalar(1e-6);
    sign = -sign;
    btVector3 least, most;
    mesh.calculateAabbBruteForce(least, most);
    shape.refitTree(least, most);
    NearTriangles query(s.a, s.b, reach);
    shape.processAllTriangles(&query, vector(low), vector(high));
    if (query.near == 0) std::abort();
  });
}
#endif

}  // namespace vest::bench
