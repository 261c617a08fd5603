#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "vest_tissue/scene/world_model.h"

/// The State, described once: fields() names each member, with the limits that hold in any State. Hash,
/// snapshot, what a fault gives back, and the check of what strangers wrote are archives that walk it.
///
/// An archive has values(T*, count, limits) of numbers and count(n, entry bytes, limits) of a list's length;
/// `everything`: also what is as the scene says; `shapes`: also topology, heat and cuts of objects; `at`:
/// whose numbers limits come from.
namespace vest::scene {

inline constexpr std::size_t kAny = ~std::size_t{0};

[[noreturn]] inline void refuse(const std::string& what) {
  throw std::invalid_argument("snapshot: " + what);
}

/// What is allowed. Looked at by Checker alone.
struct Limits {
  const char* what = "a number";
  std::size_t below = kAny;  ///< of an index
  bool none = false;         ///< kNone is one too
  bool nan = false;          ///< NaN says that there is none
  double least = -std::numeric_limits<double>::max(), most = std::numeric_limits<double>::max();
  std::size_t size = kAny;  ///< entries of a list, or of an array in use
  bool part = false;   ///< the first `size` entries alone; what follows means nothing, and is zero in lists
  bool fixed = false;  ///< the list has its length already
};
template <class T>
struct Rule : Limits {
  T& value;
  Rule(T& v, const Limits& l = {}) : Limits(l), value(v) {}
  Rule sized(std::size_t n) const {
    return with([n](Limits& l) { l.size = n; });
  }
  Rule first(std::size_t n) const {
    return with([n](Limits& l) { l.size = n, l.part = true; });
  }
  Rule orNone() const {
    return with([](Limits& l) { l.none = true; });
  }

 private:
  template <class F>
  Rule with(F change) const {
    Rule r = *this;
    change(r);
    return r;
  }
};
template <class T>
Rule<T> rule(T& v) {
  return {v};
}
template <class T>
Rule<T> index(const char* what, T& v, std::size_t below) {
  Limits l;
  l.what = what, l.below = below;
  return {v, l};
}
template <class T>
Rule<T> within(const char* what, T& v, double least, double most) {
  Limits l;
  l.what = what, l.least = least, l.most = most;
  return {v, l};
}
template <class T>
Rule<T> orNan(T& v) {
  Limits l;
  l.nan = true;
  return {v, l};
}
template <class T>
Rule<T> fixedLength(T& v) {
  Limits l;
  l.fixed = true;
  return {v, l};
}
/// A member that follows from others, or is room.
template <class T>
struct Derived {};
template <class T>
Derived<T> derived(const T&) {
  return {};
}

/// Members of an aggregate: as many as it can be made of.
struct AnyMember {
  template <class T>
  operator T() const;
};
template <class T, std::size_t... i>
constexpr auto madeOf(std::index_sequence<i...>, int)
    -> decltype(T{(static_cast<void>(i), AnyMember{})...}, true) {
  return true;
}
template <class T, std::size_t... i>
constexpr bool madeOf(std::index_sequence<i...>, ...) {
  return false;
}
template <class T, std::size_t n = 1>
constexpr std::size_t members() {
  if constexpr (madeOf<T>(std::make_index_sequence<n + 1>{}, 0))
    return members<T, n + 1>();
  else
    return n;
}

template <class A, class T>
void visit(A& a, const Rule<T>& r);

/// An archive on its way through the members of one struct; n of them are named.
template <class A, std::size_t n = 0>
struct Walk {
  static constexpr std::size_t named = n;
  A& archive;

  template <class... F>
  Walk<A, n + sizeof...(F)> operator()(F&&... f) const {
    (one(f), ...);
    return {archive};
  }
  /// Members that have a meaning only where `on`.
  template <class F>
  auto when(bool on, F f) const {
    using Then = decltype(f(Walk<A>{archive}));
    if (on || archive.everything) f(Walk<A>{archive});
    return Walk<A, n + Then::named>{archive};
  }
  template <class F>
  auto shape(F f) const {
    using Then = decltype(f(Walk<A>{archive}));
    if (archive.shapes) f(Walk<A>{archive});
    return Walk<A, n + Then::named>{archive};
  }
  /// What no single member says.
  Walk require(bool good, const char* what) const {
    if (archive.checks && !good) refuse(what);
    return *this;
  }

 private:
  template <class T>
  void one(Rule<T>& r) const {
    scene::visit(archive, r);  // an unnamed one would be std::visit, too, where T is of the library
  }
  template <class T>
  void one(Derived<T>&) const {}
  template <class T>
  void one(T& v) const {
    scene::visit(archive, Rule<T>(v));
  }
};

/// Numbers, and fixed rows of them, lie in memory as in the archive.
template <class T>
struct Flat {
  static constexpr bool is = std::is_arithmetic_v<T> || std::is_enum_v<T>;
  using Number = T;
};
template <class T, std::size_t n>
struct Flat<std::array<T, n>> : Flat<T> {};
template <int rows, int columns>
struct Flat<Eigen::Matrix<double, rows, columns>> : Flat<double> {};
template <>
struct Flat<Eigen::Quaterniond> : Flat<double> {};

template <class T>
struct IsList : std::false_type {};
template <class T>
struct IsList<std::vector<T>> : std::true_type {};
template <class T>
struct IsArray : std::false_type {};
template <class T, std::size_t n>
struct IsArray<std::array<T, n>> : std::true_type {};

template <class A, class T>
void entries(A& a, T* first, std::size_t count, const Limits& l) {
  if constexpr (Flat<T>::is) {
    using Number = typename Flat<T>::Number;
    a.values(reinterpret_cast<Number*>(first), count * (sizeof(T) / sizeof(Number)), l);
  } else {
    Limits each = l;
    each.size = kAny, each.part = each.fixed = false;
    for (std::size_t i = 0; i < count; ++i) scene::visit(a, Rule<T>(first[i], each));
  }
}

template <class A>
void visitKnots(A& a, net::Block& b) {
  using net::Block;
  std::size_t knots = b.knots();
  a.count(knots, 1, Limits{});
  if (!b.setKnots(knots)) refuse(std::to_string(knots) + " knots of an object: no room for them");
  if constexpr (A::measures) a.bytes += (b.knotCapacity() - knots) * 9 * sizeof(float);
  const auto rows = [&](const char* what, double least, double most,
                        std::initializer_list<Block::KnotRow> of) {
    for (const auto r : of) a.values(b.row(r), knots, within(what, knots, least, most));
  };
  rows("a coordinate", -1e6, 1e6, {Block::X, Block::Y, Block::Z});  // beyond these a step is a FAULT
  rows("a velocity", -1e3, 1e3, {Block::VX, Block::VY, Block::VZ});
  rows("a mass or decay", 0.0, 1e38, {Block::kInverseMass, Block::kDecay, Block::kMass});
}

template <class A, class T>
void visit(A& a, const Rule<T>& r) {
  T& v = r.value;
  if constexpr (std::is_same_v<T, net::Block>) {
    visitKnots(a, v);
  } else if constexpr (IsList<T>::value) {
    std::size_t count = r.part ? r.size : v.size();
    if (r.part && count > v.size()) refuse("more entries of an object than it has room for");
    if (!r.part) {
      a.count(count, sizeof(typename T::value_type), r);
      if (r.fixed && count != v.size())
        refuse(std::to_string(count) + " objects or connections (the scene has " + std::to_string(v.size()) +
               ")");
      v.resize(count);
      if constexpr (A::measures) a.bytes += (v.capacity() - count) * sizeof(typename T::value_type);
    } else if constexpr (A::measures) {
      a.bytes += (v.size() - count) * sizeof(typename T::value_type);
    } else if constexpr (A::reads && !std::is_same_v<typename T::value_type, Eigen::Vector3d> &&
                         !std::is_same_v<typename T::value_type, Eigen::Quaterniond>) {
      std::fill(v.begin() + static_cast<std::ptrdiff_t>(count), v.end(), typename T::value_type{});
    }
    entries(a, v.data(), count, r);
  } else if constexpr (Flat<T>::is && !IsArray<T>::value) {
    entries(a, &v, 1, r);
  } else if constexpr (IsArray<T>::value) {
    const std::size_t count = r.part ? r.size : v.size();
    if (count > v.size()) refuse(std::to_string(count) + " entries of " + std::to_string(v.size()));
    entries(a, v.data(), count, r);
  } else {
    using Named = decltype(fields(Walk<A>{a}, v));
    static_assert(Named::named == members<T>(), "fields() has forgotten a member, or names one twice");
    fields(Walk<A>{a}, v);
  }
}

/// Whose numbers indices stay below: the object that is walked, and all of them.
struct Numbers {
  const WorldState* world = nullptr;
  const WorldModel* model = nullptr;
  std::size_t object = 0, channel_object = 0;
  bool changed = false;  ///< its topology is no longer what the scene says

  const ObjectState& now() const { return world->objects[object]; }
  const ObjectState& start() const { return model->start.objects[object]; }
  const ObjectConstants& constants() const { return model->objects[object]; }
  std::size_t objects() const { return world->objects.size(); }
  std::size_t knots() const { return now().block.knots(); }
  std::size_t edgesOf(std::size_t of) const { return of < objects() ? model->objects[of].edges.size() : 0; }
  std::size_t knotsOf(std::size_t of) const { return of < objects() ? world->objects[of].block.knots() : 0; }
  bool deforms(std::size_t of) const { return of < objects() && model->objects[of].deforms; }
  /// Where it is not `used`, a first triangle is allowed where there is none: it stands for "not yet".
  std::size_t trianglesOf(std::size_t of, bool used) const {
    const std::size_t least = used ? 0 : 1;
    return of < objects() ? std::max(least, world->objects[of].triangles.size()) : 0;
  }
  std::size_t triangles() const { return now().triangles.size(); }
  std::size_t skinTriangles() const { return now().topology.skin.triangles.size(); }
  std::size_t vertices() const { return now().topology.skin.texture_coordinates.size(); }
  std::size_t threadNodes() const { return model->start.threads.rod.position.size(); }
  std::size_t threadPlaces() const { return model->threads.places.size(); }
  std::size_t needles() const { return model->threads.first_point.size(); }
  std::size_t threadJoints() const { return model->start.threads.rod.offset.size(); }
  std::size_t threadContacts() const { return model->start.threads.rod.contacts.size(); }
  std::size_t elements() const { return start().tissue.corner.size(); }
};

}  // namespace vest::scene
