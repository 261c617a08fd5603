#include "vest_tissue/scene/falling.h"

#include <algorithm>

#include <Eigen/Geometry>

namespace vest::scene {
namespace {

using Eigen::Vector3d;

/// Whether a ray meets a triangle at a distance >= 0 (Moeller and Trumbore 1997, J. Graphics Tools 2(1)
/// 21-28).
bool meets(const Vector3d& from, const Vector3d& way, const Vector3d& a, const Vector3d& b,
           const Vector3d& c) {
  const Vector3d ab = b - a, ac = c - a, p = way.cross(ac);
  const double det = ab.dot(p);
  if (det == 0.0) return false;
  const Vector3d s = from - a, q = s.cross(ab);
  const double u = s.dot(p) / det, v = way.dot(q) / det;
  return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && ac.dot(q) / det >= 0.0;
}

bool liesAbove(const Object& upper, const Object& lower, const Vector3d& down) {
  for (const Vector3d& knot : upper.position)
    for (const auto& t : lower.contact_triangles)
      if (meets(knot, down, lower.position[t[0]], lower.position[t[1]], lower.position[t[2]])) return true;
  return false;
}

}  // namespace

std::vector<std::size_t> fallingObjects(const Description& d) {
  const double g = d.gravity.norm();
  if (!(g > 0.0)) return {};
  const Vector3d down = d.gravity / g;
  std::vector<char> carried;
  for (const Object& o : d.objects)
    carried.push_back(o.model == ObjectModel::Rigid || !o.tethers.empty() ||
                      std::count(o.fixed.begin(), o.fixed.end(), 1) > 0);
  const auto indexOf = [&](const std::string& name) {
    std::size_t i = 0;
    while (i < d.objects.size() && d.objects[i].name != name) ++i;
    return i;
  };
  for (bool more = true; more;) {
    more = false;
    const auto carry = [&](std::size_t i) { more = true, carried[i] = 1; };
    for (const Connection& c : d.connections) {
      const std::size_t a = indexOf(c.object0), b = indexOf(c.object1);
      if (carried[a] != carried[b]) carry(carried[a] ? b : a);
    }
    for (std::size_t i = 0; i < d.objects.size(); ++i)
      for (std::size_t k = 0; !carried[i] && k < d.objects.size(); ++k)
        if (carried[k] && liesAbove(d.objects[i], d.objects[k], down)) carry(i);
  }
  std::vector<std::size_t> falling;
  for (std::size_t i = 0; i < carried.size(); ++i)
    if (!carried[i]) falling.push_back(i);
  return falling;
}

std::string fallingSentence(const Description& description) {
  std::string names;
  const auto falling = fallingObjects(description);
  for (const std::size_t i : falling) names += (names.empty() ? "" : ", ") + description.objects[i].name;
  if (falling.empty()) return {};
  return (falling.size() == 1 ? "object " + names + " falls" : "objects " + names + " fall") +
         " for ever: nothing holds it and nothing lies below it; give it fixed knots, a connection or a "
         "floor "
         "(docs/scene_format.md, \"What carries an object\")";
}

}  // namespace vest::scene
