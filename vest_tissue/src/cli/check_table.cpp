#include "check_table.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>

#include <Eigen/Geometry>

#include "settle.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/fem/model.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/falling.h"
#include "vest_tissue/scene/fem_object.h"
#include "vest_tissue/scene/tissue_numbers.h"

namespace vest::tools {
namespace {

// A thousand objects at one place are half a million pairs. Questions for the nearest place of a surface: two
// seconds (assumed).
constexpr std::size_t kMostOverlaps = 200, kMostQuestions = 1000000;

/// What two objects have in common at the start.
struct Overlap {
  const scene::Object *a, *b;
  std::size_t a_in_b = 0, b_in_a = 0;  ///< knots; of a rigid b: free knots of a in it, or in a cavity's wall
  double deepest = 0;                  ///< m
  bool touch = false;                  ///< nearer than contacts reach
};

bool rigid(const scene::Object& object) {
  return object.model == scene::ObjectModel::Rigid;
}

/// Surfaces that were asked for before, by object, and how many questions are left.
struct Nearness {
  std::map<const scene::Object*, modelling::NearestPoints> of;
  std::size_t left = kMostQuestions;
};

std::size_t countInside(const scene::Object& a, const scene::Object& b, Overlap& overlap,
                        Nearness& nearness) {
  // As the World asks whether two objects belong together (docs/decisions/0015).
  const double reach = a.contact_thickness + b.contact_thickness + 3e-4;
  // What is inside of a cavity's surface is its wall, which goes on beyond its box.
  const bool cavity = modelling::enclosedVolume(b.position, b.contact_triangles) < 0;
  Eigen::AlignedBox3d box;
  for (const auto& p : b.position) box.extend(p);
  box.min().array() -= reach, box.max().array() += reach;
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.position.size() && nearness.left > 0; ++i) {
    if ((rigid(b) && a.fixed[i]) || (!cavity && !box.contains(a.position[i]))) continue;
    --nearness.left;
    const auto& nearest = nearness.of.try_emplace(&b, b.position, b.contact_triangles).first->second;
    const double distance = nearest(a.position[i]).distance;
    overlap.touch = overlap.touch || distance < reach;
    overlap.deepest = std::max(overlap.deepest, -distance);
    count += distance < 0;
  }
  return count;
}

/// Of all pairs but those that a connection joins; no further pair is looked at behind kMostOverlaps and
/// kMostQuestions.
std::vector<Overlap> overlapsOf(const scene::Description& description, bool& whole) {
  std::vector<Overlap> overlaps;
  Nearness nearness;
  std::set<std::pair<std::string, std::string>> ties;
  for (const auto& c : description.connections) ties.emplace(c.object0, c.object1);
  const auto joined = [&](const scene::Object& a, const scene::Object& b) {
    return ties.count({a.name, b.name}) + ties.count({b.name, a.name}) > 0;
  };
  for (const auto& a : description.objects) {
    for (const auto& b : description.objects) {
      if (rigid(a) || (!rigid(b) && &b <= &a) || b.contact_triangles.empty() || joined(a, b)) continue;
      Overlap overlap{&a, &b};
      overlap.a_in_b = countInside(a, b, overlap, nearness);
      if (!rigid(b)) overlap.b_in_a = countInside(b, a, overlap, nearness);
      if (overlap.a_in_b + overlap.b_in_a > 0 || (overlap.touch && !rigid(b))) overlaps.push_back(overlap);
      whole = overlaps.size() < kMostOverlaps && nearness.left > 0;
      if (!whole) return overlaps;
    }
  }
  return overlaps;
}

void print(const Overlap& o) {
  const char *a = o.a->name.c_str(), *b = o.b->name.c_str();
  if (rigid(*o.b))
    std::printf("overlap: %zu free knots of %s in %s, deepest %.1f mm: they may stay as deep\n", o.a_in_b, a,
                b, 1000 * o.deepest);
  else if (o.a_in_b + o.b_in_a == 0)
    std::printf("touch: %s and %s: they do not collide with each other\n", a, b);
  else
    std::printf(
        "overlap: %zu knots of %s in %s, %zu the other way round, deepest %.1f mm: they do not collide with "
        "each other\n",
        o.a_in_b, a, b, o.b_in_a, 1000 * o.deepest);
}

/// Numbers of objects that are others than their tissue's.
void printOverrides(const scene::Description& description) {
  material::Database database;
  for (const auto& object : description.objects) {
    if (object.material.empty()) continue;
    if (database.tissues.empty()) database = material::readDatabase(material::databasePath());
    const auto tissue = std::find_if(database.tissues.begin(), database.tissues.end(),
                                     [&](const material::Tissue& t) { return t.name == object.material; });
    if (tissue == database.tissues.end()) continue;
    for (const scene::Override& o : scene::overridesOf(object, *tissue))
      std::printf("override: %s of %s: %.6g %s; its tissue, %s, has %.6g\n", o.quantity.c_str(),
                  object.name.c_str(), o.value, o.unit == "1" ? "(no unit)" : o.unit.c_str(),
                  tissue->name.c_str(), o.of_tissue);
  }
}

/// Connected tetrahedra.
std::size_t countParts(const fem::Description& d) {
  const std::vector<int> parts = fem::components(d, {});
  return parts.empty() ? 0 : static_cast<std::size_t>(*std::max_element(parts.begin(), parts.end()) + 1);
}

}  // namespace

std::string printCheck(const scene::Description& description) {
  std::printf("%-22s %-9s %6s %7s %6s %5s %6s %6s %8s %9s %8s %6s %6s %9s\n", "object", "organ", "knots",
              "springs", "pieces", "twice", "free", "inside", "vertices", "triangles", "mass g", "fixed",
              "ties", "steps/ms");
  std::size_t objects = 0, knots = 0, springs = 0, vertices = 0, triangles = 0;
  bool good = true;
  bool whole = true;
  const std::vector<Overlap> overlaps = overlapsOf(description, whole);
  for (const auto& object : description.objects) {
    const bool still = rigid(object), elements = object.fem != nullptr;
    const std::size_t pieces = still ? 1 : elements ? countParts(*object.fem) : scene::countPieces(object);
    const std::size_t twice = scene::countDuplicateLinks(object);
    const bool bound = elements || object.skin.triangles.empty();  // inner nodes carry no skin
    const std::size_t unbound = bound ? 0 : scene::countUnboundKnots(object);
    std::size_t inside = 0;
    for (const Overlap& o : overlaps) inside += o.a == &object ? o.a_in_b : o.b == &object ? o.b_in_a : 0;
    double mass = 0;
    for (const double m : object.mass) mass += m;
    const auto fixed = std::count(object.fixed.begin(), object.fixed.end(), 1);
    const auto ties =
        std::count_if(description.connections.begin(), description.connections.end(),
                      [&](const auto& c) { return c.object0 == object.name || c.object1 == object.name; });
    // Sub-steps that an explicit step of the springs needs at rest: dt·omega/2.
    const double steps = still || elements ? 0 : description.dt * modelling::highestFrequency(object) / 2;
    std::printf("%-22s %-9s %6zu %7zu %6zu %5zu %6zu %6zu %8zu %9zu %8.2f %6td %6td %9.2f%s\n",
                object.name.c_str(), object.organ.c_str(), object.mass.size(), object.links.size(), pieces,
                twice, unbound, inside, object.skin.texture_coordinates.size(), object.skin.triangles.size(),
                1000 * mass, fixed, ties, steps,
                still      ? "  rigid"
                : elements ? ("  " + std::to_string(object.fem->tetrahedra.size()) + " tetrahedra").c_str()
                           : "");
    // Parts of a volume may be loose: an image holds what it holds.
    good = good && (pieces == 1 || elements) && twice == 0 && unbound == 0;
    if (still) continue;
    ++objects;
    knots += object.mass.size();
    springs += object.links.size();
    vertices += object.skin.texture_coordinates.size();
    triangles += object.skin.triangles.size();
  }
  std::printf("%zu objects that move: %zu knots, %zu springs, %zu vertices, %zu triangles; %zu connections\n",
              objects, knots, springs, vertices, triangles, description.connections.size());
  for (const Overlap& overlap : overlaps) print(overlap);
  if (!whole)
    std::printf("overlap: no more is looked for than %zu pairs, and %zu knots near others\n", kMostOverlaps,
                kMostQuestions);
  printOverrides(description);
  const std::string condensed = scene::condensedSentence(description);
  if (!condensed.empty()) std::printf("%s\n", condensed.c_str());
  const std::string falling = scene::fallingSentence(description);
  if (!falling.empty()) std::printf("%s\n", falling.c_str());
  good = good && falling.empty();
  return good ? "" : "pieces must be 1; twice and free 0; no object may fall";
}

std::string startFault(const scene::Description& description) try {
  constexpr double kTime = 0.2, kThrown = 5.0;  // s; m/s: more than anything falls in that time (tuned)
  constexpr double kPatience = 2.0;             // s of processor time (assumed): whoever checks a scene waits
  if (description.integrator == scene::Integrator::NewtonEuler) {
    scene::Description told = description;
    tellPreparing(told);
    scene::World world(told, 1);
    // What answers at once is in equilibrium after its first step, and was at rest before it: that is no
    // speed.
    const Rest rest = run(world, kTime, description.dt, kPatience);
    if (rest.speed < kThrown && rest.seconds < 0.99 * kTime)
      std::printf("its steps are slow, %.0f ms each: no more than its first %.0f ms were looked at\n",
                  1e3 * rest.seconds_per_step, 1e3 * rest.seconds);
    if (rest.speed < kThrown) return "";
    char speed[80];
    std::snprintf(speed, sizeof speed, "%.1f m/s within %.1f s", rest.speed, kTime);
    return files::shown(rest.object, 100) + " is thrown about: " + speed + ", without any tool";
  }
  const bool still = description.integrator == scene::Integrator::Static;
  for (const auto& object : description.objects)
    if (object.fem) fem::buildModel(*object.fem, still ? fem::Use::Static : fem::Use::Dynamic);
  return "";
} catch (const std::exception& error) {
  return "it does not start: " + files::shown(error.what(), 6000);
}

bool printVerdict(const std::vector<std::string>& faults) {
  std::string all;
  for (const std::string& fault : faults)
    if (!fault.empty()) all += (all.empty() ? "" : "; ") + fault;
  std::printf("%s\n", all.empty() ? "good" : ("NOT good: " + all).c_str());
  return all.empty();
}

std::string defaultMaterials() {
  const std::string source = VEST_TISSUE_SOURCE_DATA;
  return std::ifstream(source + "/materials.yaml").good()
             ? source + "/materials.yaml"
             : std::string(VEST_TISSUE_INSTALLED_DATA) + "/materials.yaml";
}

}  // namespace vest::tools
