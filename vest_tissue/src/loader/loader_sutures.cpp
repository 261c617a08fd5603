#include "loader_sutures.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "vest_tissue/suture/polyline.h"
#include "vest_tissue/suture/rod.h"
#include "vest_tissue/suture/roeder.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;
using suture::lengthOf;
using suture::nodesAlong;
using yaml::Map;
using yaml::Value;

constexpr double kKnotted = 0.6;         ///< strength in a knot over that of a straight thread; assumed
constexpr double kStrainDamping = 1e-4;  ///< s; assumed
constexpr double kAir = 1e-4;            ///< N·s/m², drag across a thread in gas; assumed
constexpr double kSteel = 7900.0;        ///< kg/m³, of austenitic stainless steel (EN 10088-1)
constexpr double kPi = 3.14159265358979323846;
constexpr std::size_t kMostSutures = 16, kMostNodes = 2000;

template <class Entry>
const Entry& named(const std::vector<Entry>& entries, const Value& name) {
  std::string known;
  for (const Entry& entry : entries) {
    if (entry.name == name.name()) return entry;
    known += (known.empty() ? "" : ", ") + entry.name;
  }
  name.fail("must be one of: " + known);
}

/// A curve through the points (Catmull and Rom 1974), finely.
std::vector<Vector3d> curveThrough(const std::vector<Vector3d>& p) {
  constexpr int kSteps = 32;
  std::vector<Vector3d> out{p.front()};
  for (std::size_t i = 0; i + 1 < p.size(); ++i) {
    const Vector3d m0 = i > 0 ? Vector3d(0.5 * (p[i + 1] - p[i - 1])) : Vector3d(p[1] - p[0]);
    const Vector3d m1 = i + 2 < p.size() ? Vector3d(0.5 * (p[i + 2] - p[i])) : Vector3d(p[i + 1] - p[i]);
    for (int k = 1; k <= kSteps; ++k) {
      const double t = static_cast<double>(k) / kSteps, t2 = t * t, t3 = t2 * t;
      out.push_back((2 * t3 - 3 * t2 + 1) * p[i] + (t3 - 2 * t2 + t) * m0 + (3 * t2 - 2 * t3) * p[i + 1] +
                    (t3 - t2) * m1);
    }
  }
  return out;
}

std::vector<Vector3d> readPath(const Value& value) {
  std::vector<Vector3d> path;
  for (const Value& point : value.list()) {
    path.push_back(point.vector3());
    if (!(path.back().norm() <= 10.0)) point.fail("must be within 10 m of 0");
    if (path.size() > 1 && !((path.back() - path[path.size() - 2]).norm() >= 1e-4))
      point.fail("must be 0.1 mm or more from the point before");
  }
  if (path.size() < 2 || path.size() > 1000) value.fail("must be 2 to 1000 points");
  return path;
}

/// Angle that a needle's end is bent by, and the share of its length that this end is.
struct Bend {
  const char* kind;
  double angle, share;
};
constexpr Bend kBends[] = {
    {"half", kPi, 1.0}, {"three_eighths", 0.75 * kPi, 1.0}, {"straight", 0.0, 1.0}, {"ski", kPi / 3.0, 0.4}};

/// From the tip to the thread's first end; straight on from there, then bent about `normal`.
std::vector<Vector3d> needlePoints(const Suture& s, const Bend& bend, const Vector3d& ahead) {
  const Vector3d side = s.needle_normal.cross(ahead).normalized();
  const double straight = (1.0 - bend.share) * s.needle_length, arc = s.needle_length - straight;
  const auto parts = static_cast<int>(std::max(8L, std::lround(s.needle_length / 0.001)));
  std::vector<Vector3d> points;
  for (int i = parts; i >= 0; --i) {
    const double at = s.needle_length * i / parts, angle = bend.angle * std::max(0.0, at - straight) / arc;
    Vector3d p = s.rod.nodes[0] + std::min(at, straight) * ahead;
    if (bend.angle > 0.0)
      p += arc / bend.angle * (std::sin(angle) * ahead + (1.0 - std::cos(angle)) * side);
    else
      p = s.rod.nodes[0] + at * ahead;
    points.push_back(p);
  }
  return points;
}

void readNeedle(const Value& value, Suture& s, double swage) {
  Map map(value);
  map.only({"kind", "length", "wire", "normal"});
  s.needle = map["kind"].oneOf({"half", "three_eighths", "straight", "ski"});
  s.needle_length = map.has("length") ? map["length"].number(0.005, 0.06) : 0.026;
  s.needle_wire = map.has("wire") ? map["wire"].number(0.0001, 0.0015) : 0.00066;
  if (map.has("normal")) s.needle_normal = map["normal"].vector3();
  const Vector3d ahead = (s.rod.nodes[0] - s.rod.nodes[1]).normalized();
  if (!(s.needle_normal.norm() > 1e-6) || !(s.needle_normal.normalized().cross(ahead).norm() > 0.1))
    (map.has("normal") ? map["normal"] : value)
        .fail("must have a normal that is not along the thread's first end");
  map.finish();
  for (const Bend& bend : kBends)
    if (s.needle == bend.kind) s.rod.needle.points = needlePoints(s, bend, ahead);
  s.rod.needle.radius = 0.5 * s.needle_wire;
  s.rod.needle.density = kSteel;
  s.rod.needle.swage = swage;
}

/// Nodes that are held where they lie: the thread passes through what does not give way.
void readFixed(const Value& value, double segment, Suture& s) {
  const auto range = value.list();
  if (range.size() != 2) value.fail("must be two places along the thread: from, to");
  const double from = range[0].number(0.0, 5.0), to = range[1].number(0.0, 5.0);
  for (suture::Index i = 0; i < s.rod.nodes.size(); ++i) {
    const double at = segment * i;
    if (at > from - 1e-9 && at < to + 1e-9) s.rod.held.push_back({i, suture::Hold::Place, {}});
  }
  if (s.rod.held.empty()) value.fail("must hold at least one node of the thread");
}

/// A loop with a Roeder knot, in its packet.
void readLoop(const Value& value, Suture& s) {
  Map map(value);
  map.only({"at", "ahead", "across", "length"});
  const auto place = [&map](const char* key) {
    const Vector3d v = map[key].vector3();
    if (!(v.norm() <= 10.0)) map[key].fail("must be within 10 m of 0");
    return v;
  };
  s.loop_at = place("at");
  s.loop_ahead = place("ahead");
  if (!(s.loop_ahead.norm() > 1e-6)) map["ahead"].fail("must have a direction");
  s.loop_across = place("across");
  if (!(s.loop_across.norm() > 1e-6) ||
      !(s.loop_ahead.normalized().cross(s.loop_across.normalized()).norm() > 0.1))
    map["across"].fail("must not be along 'ahead'");
  suture::RoederLoop loop;
  loop.length = s.loop = map.has("length") ? map["length"].number(0.03, 0.3) : loop.length;
  map.finish();
  loop.diameter = 2.0 * s.rod.section.radius;
  loop.segment = s.segment;
  const Eigen::Matrix3d turn = suture::loopAxes(s.loop_ahead, s.loop_across);
  for (const Vector3d& p : suture::roederLoop(loop)) s.rod.nodes.push_back(s.loop_at + turn * p);
  s.rod.natural_shape = true;
}

/// A thread along its points.
void readLaid(Map& map, Suture& s) {
  s.path = readPath(map["path"]);
  const auto curve = curveThrough(s.path);
  const double length = map.has("length") ? map["length"].number(0.005, 5.0) : lengthOf(curve);
  if (!(length >= 0.005 && length <= 5.0)) map["path"].fail("must be 0.005 to 5 m long");
  const auto segments = static_cast<std::size_t>(std::lround(length / s.segment));
  if (segments < 4 || segments > kMostNodes)
    map[map.has("segment") ? "segment" : "path"].fail("must make 4 to " + std::to_string(kMostNodes) +
                                                      " segments; these are " + std::to_string(segments));
  s.rod.nodes = nodesAlong(curve, length, segments);
  s.rod.natural_shape = map.has("natural") && map["natural"].oneOf({"straight", "path"}) == "path";
  if (map.has("fixed")) readFixed(map["fixed"], length / static_cast<double>(segments), s);
}

}  // namespace

Suture readSutureKind(Map& map, const material::Sutures& known) {
  Suture s;
  const material::SutureMaterial& material = named(known.materials, map["material"]);
  const auto& size = named(known.sizes, map["size"]).numbers;
  const auto of = [&material](const char* key) { return material.numbers.at(key).value; };
  s.material = material.name;
  s.size = map["size"].name();
  suture::Section& section = s.rod.section;
  section = suture::solidSection(0.5 * size.at("diameter").value, of("density"), of("youngs_modulus"),
                                 of("poisson_ratio"));
  section.bend *= of("bending_ratio");
  section.twist *= of("bending_ratio");
  section.friction = of("friction_slack");
  section.friction_fall = of("friction_slack") - of("friction_tight");
  section.friction_pressure = of("friction_pressure");
  // Solid threads bend as solid rods do, braids hardly resist.
  s.kind = of("bending_ratio") >= 1.0 ? 0 : of("bending_ratio") > 0.1 ? 1 : 2;
  s.knot_strength = size.at(material.absorbable ? "knot_pull_absorbable" : "knot_pull").value;
  s.strength = s.knot_strength / kKnotted;
  return s;
}

std::vector<Suture> readSutures(const Value& list, const material::Sutures& known,
                                const std::vector<std::string>& taken) {
  std::vector<Suture> sutures;
  const auto items = list.list();
  if (items.empty() || items.size() > kMostSutures)
    list.fail("must be 1 to " + std::to_string(kMostSutures) + " sutures");
  for (const Value& item : items) {
    Map map(item);
    const bool loop = map.has("roeder_loop");
    if (loop)
      map.only({"name", "material", "size", "segment", "roeder_loop"});
    else
      map.only({"name", "material", "size", "path", "length", "segment", "natural", "fixed", "needle"});
    Suture s = readSutureKind(map, known);
    s.rod.name = map["name"].name();
    bool there = std::find(taken.begin(), taken.end(), s.rod.name) != taken.end();
    for (const Suture& o : sutures) there = there || o.rod.name == s.rod.name;
    if (there) map["name"].fail("must be there once, among objects too");
    if (map.has("segment")) s.segment = map["segment"].number(0.0002, 0.005);
    if (loop)
      readLoop(map["roeder_loop"], s);
    else
      readLaid(map, s);
    s.rod.section.strain_damping = kStrainDamping;
    s.rod.section.drag = kAir;
    if (map.has("needle"))
      readNeedle(map["needle"], s, named(known.sizes, map["size"]).numbers.at("swage").value);
    map.finish();
    try {
      const suture::Model checked(suture::Description{Vector3d::Zero(), {s.rod}, {}});
    } catch (const std::invalid_argument& error) {
      map[loop ? "roeder_loop" : "path"].fail(error.what());
    }
    sutures.push_back(std::move(s));
  }
  return sutures;
}

std::string suturesText(const std::vector<Suture>& sutures) {
  std::string yaml = sutures.empty() ? "" : "sutures:\n";
  char number[160];
  for (const Suture& s : sutures) {
    const auto& nodes = s.rod.nodes;
    yaml += "  - name: " + s.rod.name + "\n    material: " + s.material + "\n    size: \"" + s.size + "\"\n";
    if (s.loop > 0.0) {
      std::snprintf(number, sizeof number, "    segment: %.10g\n    roeder_loop: {length: %.10g", s.segment,
                    s.loop);
      yaml += number;
      for (const auto& [key, v] : {std::pair<const char*, Vector3d>{"at", s.loop_at},
                                   {"ahead", s.loop_ahead},
                                   {"across", s.loop_across}}) {
        std::snprintf(number, sizeof number, ", %s: [%.10g, %.10g, %.10g]", key, v.x(), v.y(), v.z());
        yaml += number;
      }
      yaml += "}\n";
      continue;
    }
    std::snprintf(number, sizeof number, "    length: %.10g\n    segment: %.10g\n", lengthOf(nodes),
                  s.segment);
    yaml +=
        std::string(number) + "    natural: " + (s.rod.natural_shape ? "path" : "straight") + "\n    path: [";
    for (std::size_t i = 0; i < s.path.size(); ++i) {
      const Vector3d& p = s.path[i];
      std::snprintf(number, sizeof number, "%s[%.10g, %.10g, %.10g]", i > 0 ? ", " : "", p.x(), p.y(), p.z());
      yaml += number;
    }
    yaml += "]\n";
    if (!s.rod.held.empty()) {
      const double each = lengthOf(nodes) / static_cast<double>(nodes.size() - 1);
      std::snprintf(number, sizeof number, "    fixed: [%.10g, %.10g]\n", each * s.rod.held.front().node,
                    each * s.rod.held.back().node);
      yaml += number;
    }
    if (s.needle.empty()) continue;
    const Vector3d& n = s.needle_normal;
    std::snprintf(number, sizeof number, ", length: %.10g, wire: %.10g, normal: [%.10g, %.10g, %.10g]}\n",
                  s.needle_length, s.needle_wire, n.x(), n.y(), n.z());
    yaml += "    needle: {kind: " + s.needle + number;
  }
  return yaml;
}

}  // namespace vest::scene
