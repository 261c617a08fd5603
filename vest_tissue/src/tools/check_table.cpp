#include "check_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include <Eigen/Geometry>

#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/baked.h"

namespace vest::tools {

bool printCheck(const scene::Description& description) {
  std::printf("%-22s %-9s %6s %7s %6s %5s %6s %8s %9s %8s %6s %6s %9s\n", "object", "organ", "knots",
              "springs", "pieces", "twice", "free", "vertices", "triangles", "mass g", "fixed", "ties",
              "steps/ms");
  std::size_t objects = 0, knots = 0, springs = 0, vertices = 0, triangles = 0;
  bool good = true;
  for (const auto& object : description.objects) {
    const bool rigid = object.model == scene::ObjectModel::Rigid;
    const std::size_t pieces = rigid ? 1 : scene::countPieces(object);
    const std::size_t twice = scene::countDuplicateLinks(object);
    const std::size_t unbound = object.skin.triangles.empty() ? 0 : scene::countUnboundKnots(object);
    double mass = 0;
    for (const double m : object.mass) mass += m;
    const auto fixed = std::count(object.fixed.begin(), object.fixed.end(), 1);
    const auto ties =
        std::count_if(description.connections.begin(), description.connections.end(),
                      [&](const auto& c) { return c.object0 == object.name || c.object1 == object.name; });
    // Sub-steps that an explicit step of the springs needs at rest: dt·omega/2.
    const double steps = rigid ? 0 : description.dt * modelling::highestFrequency(object) / 2;
    std::printf("%-22s %-9s %6zu %7zu %6zu %5zu %6zu %8zu %9zu %8.2f %6td %6td %9.2f%s\n",
                object.name.c_str(), object.organ.c_str(), object.mass.size(), object.links.size(), pieces,
                twice, unbound, object.skin.texture_coordinates.size(), object.skin.triangles.size(),
                1000 * mass, fixed, ties, steps, rigid ? "  rigid" : "");
    good = good && pieces == 1 && twice == 0 && unbound == 0;
    if (rigid) continue;
    ++objects;
    knots += object.mass.size();
    springs += object.links.size();
    vertices += object.skin.texture_coordinates.size();
    triangles += object.skin.triangles.size();
  }
  std::printf("%zu objects that move: %zu knots, %zu springs, %zu vertices, %zu triangles; %zu connections\n",
              objects, knots, springs, vertices, triangles, description.connections.size());
  // Knots that begin inside another organ: contact would push them out. Attached places overlap on purpose.
  for (const auto& a : description.objects) {
    if (a.model == scene::ObjectModel::Rigid) continue;
    for (const auto& b : description.objects) {
      if (&a == &b || b.contact_triangles.empty()) continue;
      Eigen::AlignedBox3d box;
      for (const auto& p : b.position) box.extend(p);
      std::size_t inside = 0;
      double deepest = 0;
      for (std::size_t i = 0; i < a.position.size(); ++i) {
        if (a.fixed[i] || !box.contains(a.position[i])) continue;
        const double distance =
            modelling::nearestPoint(b.position, b.contact_triangles, a.position[i]).distance;
        inside += distance < 0;
        deepest = std::min(deepest, distance);
      }
      if (inside > 0)
        std::printf("overlap: %zu free knots of %s in %s, deepest %.1f mm\n", inside, a.name.c_str(),
                    b.name.c_str(), -1000 * deepest);
    }
  }
  std::printf("%s\n", good ? "good" : "NOT good: pieces must be 1; twice and free must be 0");
  return good;
}

std::string defaultMaterials() {
  const std::string source = VEST_TISSUE_SOURCE_DATA;
  return std::ifstream(source + "/materials.yaml").good()
             ? source + "/materials.yaml"
             : std::string(VEST_TISSUE_INSTALLED_DATA) + "/materials.yaml";
}

}  // namespace vest::tools
