#include "vest_viz/inspect/pick.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include <Eigen/Geometry>

namespace vest::inspect {
namespace {

using Eigen::Vector3d;

constexpr double kBehind = 0.01;  // m
constexpr double kInfinite = std::numeric_limits<double>::infinity();

Vector3d at(const float* p, std::size_t i) {
  return {p[3 * i], p[3 * i + 1], p[3 * i + 2]};
}

std::string text(const char* format, double value) {
  char buffer[96];
  std::snprintf(buffer, sizeof buffer, format, value);
  return buffer;
}

struct FieldWord {
  const char* word;
  const char* unit;
};
/// In the order of vest_msgs/TissueField.
constexpr FieldWord kFields[] = {
    {"strain", ""},    {"temperature", " K"}, {"damage", ""},  {"perfusion", ""},   {"bleeding", " m3/s"},
    {"stress", " Pa"}, {"char", ""},          {"wetness", ""}, {"oxygenation", ""}, {"setting", ""}};

}  // namespace

double firstSkin(const mesh::Store& store, const Vector3d& eye, const Vector3d& d) {
  double first = kInfinite;
  for (std::size_t o = 0; o < store.topology().objects.size(); ++o) {
    const mesh::Skin& skin = store.skin(o);
    for (std::size_t t = 0; t + 2 < skin.triangles.size(); t += 3) {
      const Vector3d a = at(skin.positions.data(), skin.triangles[t]);
      const Vector3d e1 = at(skin.positions.data(), skin.triangles[t + 1]) - a;
      const Vector3d e2 = at(skin.positions.data(), skin.triangles[t + 2]) - a;
      const Vector3d h = d.cross(e2);
      const double det = e1.dot(h);
      if (std::fabs(det) < 1e-18) continue;
      const Vector3d s = eye - a, q = s.cross(e1);
      const double u = s.dot(h) / det, v = d.dot(q) / det, z = e2.dot(q) / det;
      if (u >= 0 && v >= 0 && u + v <= 1 && z > 1e-6 && z < first) first = z;
    }
  }
  return first;
}

Picked pick(const mesh::Store& store, const Vector3d& eye, const Vector3d& d, double reach) {
  const double limit = firstSkin(store, eye, d) + kBehind;
  Picked knot, link;
  double nearest_knot = reach, nearest_link = reach;
  const auto& objects = store.topology().objects;
  for (std::size_t o = 0; o < objects.size(); ++o) {
    const float* p = store.knots(o);
    for (std::size_t k = 0; k < objects[o].knot_count; ++k) {
      const Vector3d r = at(p, k) - eye;
      const double z = r.dot(d);
      if (!(z > 1e-6) || z > limit) continue;
      const double angle = std::atan2((r - z * d).norm(), z);
      if (angle >= nearest_knot) continue;
      nearest_knot = angle;
      knot = {Picked::Kind::Knot, o, k, z};
    }
    if (knot.kind == Picked::Kind::Knot) continue;
    for (std::size_t k = 0; 2 * k + 1 < objects[o].link_knots.size(); ++k) {
      if (!objects[o].link_alive.empty() && objects[o].link_alive[k] == 0) continue;
      const Vector3d a = at(p, objects[o].link_knots[2 * k]) - eye;
      const Vector3d e = at(p, objects[o].link_knots[2 * k + 1]) - eye - a;
      // Nearest points of ray and link.
      const Vector3d across = e - e.dot(d) * d, start = a - a.dot(d) * d;
      const double s = std::clamp(-start.dot(across) / std::max(across.squaredNorm(), 1e-18), 0.0, 1.0);
      const Vector3d r = a + s * e;
      const double z = r.dot(d);
      if (!(z > 1e-6) || z > limit) continue;
      const double angle = std::atan2((r - z * d).norm(), z);
      if (angle >= nearest_link) continue;
      nearest_link = angle;
      link = {Picked::Kind::Link, o, k, z};
    }
  }
  return knot.kind == Picked::Kind::Knot ? knot : link;
}

std::vector<std::string> describe(const mesh::Store& store, const Picked& picked) {
  std::vector<std::string> lines;
  const auto& objects = store.topology().objects;
  if (picked.kind == Picked::Kind::Nothing || picked.object >= objects.size()) return lines;
  const mesh::Object& o = objects[picked.object];
  const float* p = store.knots(picked.object);
  const auto place = [](const char* what, const Vector3d& x) {
    return std::string(what) + text(": %.4f", x.x()) + text(" %.4f", x.y()) + text(" %.4f m", x.z());
  };
  if (picked.kind == Picked::Kind::Knot) {
    if (picked.element >= o.knot_count) return lines;
    lines = {"object: " + o.name, "organ: " + o.organ};
    if (!o.material.empty()) lines.push_back("material: " + o.material);
    lines.push_back("knot: " + std::to_string(picked.element));
    lines.push_back(place("position", at(p, picked.element)));
    const Vector3d moved = at(p, picked.element) - at(o.rest_position.data(), picked.element);
    lines.push_back(text("displacement: %.2f mm", 1000 * moved.norm()));
    if (!o.knot_fixed.empty()) lines.push_back(o.knot_fixed[picked.element] ? "fixed: yes" : "fixed: no");
    int alive = 0, cut = 0;
    for (std::size_t k = 0; k < o.link_knots.size(); ++k)
      if (o.link_knots[k] == picked.element) (o.link_alive.empty() || o.link_alive[k / 2] ? alive : cut) += 1;
    lines.push_back("links: " + std::to_string(alive) + (cut > 0 ? ", cut: " + std::to_string(cut) : ""));
    for (const mesh::Field& f : store.fields())
      if (f.kind < std::size(kFields))
        lines.push_back(std::string(kFields[f.kind].word) +
                        text(": %.4g", store.knotField(picked.object, f.kind, picked.element)) +
                        kFields[f.kind].unit);
    return lines;
  }
  if (2 * picked.element + 1 >= o.link_knots.size()) return lines;
  const std::uint32_t a = o.link_knots[2 * picked.element], b = o.link_knots[2 * picked.element + 1];
  lines = {"object: " + o.name, "organ: " + o.organ};
  if (!o.material.empty()) lines.push_back("material: " + o.material);
  lines.push_back("link: " + std::to_string(picked.element));
  lines.push_back("knots: " + std::to_string(a) + ", " + std::to_string(b));
  static const char* const kKinds[] = {"elastic", "viscous", "plastic", "bending"};
  if (picked.element < o.link_kind.size() && o.link_kind[picked.element] < std::size(kKinds))
    lines.push_back(std::string("kind: ") + kKinds[o.link_kind[picked.element]]);
  const bool lives = o.link_alive.empty() || o.link_alive[picked.element] != 0;
  lines.push_back(lives ? "alive: yes" : "alive: no");
  const double length = (at(p, a) - at(p, b)).norm();
  const double rest = (at(o.rest_position.data(), a) - at(o.rest_position.data(), b)).norm();
  lines.push_back(text("length: %.3f mm", 1000 * length));
  lines.push_back(text("length as loaded: %.3f mm", 1000 * rest));
  if (rest > 0) lines.push_back(text("elongation: %.1f %%", 100 * (length / rest - 1)));
  return lines;
}

}  // namespace vest::inspect
