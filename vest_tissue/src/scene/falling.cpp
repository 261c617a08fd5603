#include "vest_tissue/scene/falling.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "vest_tissue/base/box_tree.h"

namespace vest::scene {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMostLooks = 10000000;  ///< at boxes: a second (assumed)

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

/// The triangles of an object that something may lie on.
struct Below {
  const Object* object;
  contact::BoxTree tree;
  explicit Below(const Object& o) : object(&o), tree(boxesOf(o)) {}

  static std::vector<contact::Box> boxesOf(const Object& o) {
    std::vector<contact::Box> boxes;
    const auto& x = o.position;
    for (const auto& t : o.contact_triangles) {
      contact::Box box{x[t[0]].cwiseMin(x[t[1]]).cwiseMin(x[t[2]]),
                       x[t[0]].cwiseMax(x[t[1]]).cwiseMax(x[t[2]])};
      const double more = 1e-9 * (box.low.cwiseAbs() + box.high.cwiseAbs()).maxCoeff();  // beyond rounding
      box.low.array() -= more, box.high.array() += more;
      boxes.push_back(box);
    }
    return boxes;
  }
  /// @param looks is counted down; at 0 there is no further one
  bool carries(const Object& upper, const Vector3d& down, std::size_t& looks) const {
    for (const Vector3d& knot : upper.position) {
      double least = 0.0;  // of what is not looked at: -1 where one is met
      const auto bound = [&](const contact::Box& box) {
        if (looks > 0) --looks;
        return looks > 0 && std::isfinite(contact::entry(box, knot, down)) ? 0.0 : 1.0;
      };
      tree.visit(bound, least, [&](std::uint32_t i) {
        const auto& t = object->contact_triangles[i];
        const auto& x = object->position;
        if (meets(knot, down, x[t[0]], x[t[1]], x[t[2]])) least = -1.0;
      });
      if (least < 0.0) return true;
    }
    return false;
  }
};

}  // namespace

std::vector<std::size_t> fallingObjects(const Description& d) {
  const double g = d.gravity.norm();
  if (!(g > 0.0)) return {};
  const Vector3d down = d.gravity / g;
  std::vector<char> carried;
  for (const Object& o : d.objects)
    carried.push_back(o.model == ObjectModel::Rigid || !o.tethers.empty() ||
                      std::count(o.fixed.begin(), o.fixed.end(), 1) > 0);
  std::map<std::string, std::size_t> number;
  for (std::size_t i = 0; i < d.objects.size(); ++i) number.emplace(d.objects[i].name, i);
  std::set<std::pair<std::size_t, std::size_t>> tied;
  for (const Connection& c : d.connections) tied.emplace(number.at(c.object0), number.at(c.object1));
  std::vector<std::size_t> carriers;  // whatever lies above or is tied to one is carried, too
  for (std::size_t i = 0; i < d.objects.size(); ++i)
    if (carried[i]) carriers.push_back(i);
  const auto carry = [&](std::size_t i) { carried[i] = 1, carriers.push_back(i); };
  std::size_t looks = kMostLooks;
  for (std::size_t n = 0; n < carriers.size() && carriers.size() < d.objects.size(); ++n) {
    const std::size_t k = carriers[n];
    for (const auto& [a, b] : tied)
      if (carried[a] != carried[b] && (a == k || b == k)) carry(a == k ? b : a);
    const Below below(d.objects[k]);
    for (std::size_t i = 0; i < d.objects.size(); ++i)
      if (!carried[i] && below.carries(d.objects[i], down, looks)) carry(i);
  }
  std::vector<std::size_t> falling;
  for (std::size_t i = 0; i < carried.size(); ++i)
    if (!carried[i] && looks > 0) falling.push_back(i);
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
