#include "vest_tissue/modelling/handles.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <Eigen/Geometry>

#include "vest_tissue/modelling/fields.h"

namespace vest::modelling {
namespace {

constexpr int kFine = 100;  // steps of a line that is shown

/// 0.01 mm is finer than a hand.
std::string shortNumber(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.5f", value);
  std::string number = text;
  number.erase(number.find_last_not_of('0') + 1);
  if (number.back() == '.') number.pop_back();
  return number == "-0" ? "0" : number;
}

std::string shortVector(const Vector3& v) {
  return "[" + shortNumber(v.x()) + ", " + shortNumber(v.y()) + ", " + shortNumber(v.z()) + "]";
}

std::string itemOf(const std::string& list, std::size_t place) {
  return list + "/" + std::to_string(place);
}

/// Frames at the cross-sections. The frames between carry x along as the drawn rings do.
std::vector<SectionFrame> sectionFrames(const TubeSpec& tube, const Curve& curve) {
  std::vector<double> arcs;
  for (int i = 0; i <= kFine; ++i) arcs.push_back(curve.length() * i / kFine);
  for (const Section& section : tube.sections) arcs.push_back(section.at * curve.length());
  std::sort(arcs.begin(), arcs.end());
  const std::vector<SectionFrame> frames = framesAlong(curve, arcs, tube.reference);
  std::vector<SectionFrame> at;
  for (const Section& section : tube.sections) {
    const auto found = std::lower_bound(arcs.begin(), arcs.end(), section.at * curve.length());
    at.push_back(frames[static_cast<std::size_t>(found - arcs.begin())]);
  }
  return at;
}

/// Handles at the points of a curve; a new one lies on the curve, half way to the next point.
void addPoints(const std::string& list, const std::vector<Vector3>& points, std::vector<Handle>& handles) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    Handle handle;
    handle.path = itemOf(list, i);
    handle.place = points[i];
    const bool last = i + 1 == points.size();
    Vector3 next = points[i] + (last ? Vector3(0.5 * (points[i] - points[i - 1])) : Vector3::Zero());
    if (!last) {
      const auto w = catmullRom(0.5);
      const Vector3 before = i > 0 ? points[i - 1] : Vector3(2 * points[0] - points[1]);
      const Vector3 after = i + 2 < points.size() ? points[i + 2] : Vector3(2 * points[i + 1] - points[i]);
      next = w[0] * before + w[1] * points[i] + w[2] * points[i + 1] + w[3] * after;
    }
    handle.insert_path = last ? list + "/-" : itemOf(list, i + 1);
    handle.insert_value = shortVector(next);
    if (points.size() > 2) handle.remove_path = handle.path;
    handles.push_back(handle);
  }
}

void addWhole(const std::string& path, const std::vector<std::vector<Vector3>>& curves, bool nested,
              std::vector<Handle>& handles) {
  Handle handle;
  handle.kind = Handle::Kind::Whole;
  handle.path = path;
  handle.all = curves;
  handle.nested = nested;
  std::size_t count = 0;
  for (const auto& curve : curves)
    for (const Vector3& p : curve) handle.place += p, ++count;
  handle.place /= static_cast<double>(count);
  handles.push_back(handle);
}

void addTube(const TubeSpec& tube, std::vector<Handle>& handles) {
  addPoints("/tube/centre", tube.centre, handles);
  addWhole("/tube/centre", {tube.centre}, false, handles);
  const Curve curve(tube.centre);
  const auto frames = sectionFrames(tube, curve);
  for (std::size_t s = 0; s < tube.sections.size(); ++s) {
    const Section& section = tube.sections[s];
    const std::size_t count = section.radii.size();
    const std::string item = itemOf("/tube/sections", s);
    const bool last = s + 1 == tube.sections.size();
    const double next = last ? 1.0 : 0.5 * (section.at + tube.sections[s + 1].at);
    for (std::size_t k = 0; k < count; ++k) {
      const double angle = count == 2 ? 0.5 * M_PI * static_cast<double>(k)
                                      : 2 * M_PI * static_cast<double>(k) / static_cast<double>(count);
      Handle handle;
      handle.kind = Handle::Kind::Length;
      handle.path = itemOf(item + "/radii", k);
      handle.origin = frames[s].centre;
      handle.axis = std::cos(angle) * frames[s].x + std::sin(angle) * frames[s].y;
      handle.place = handle.origin + section.radii[k] * handle.axis;
      if (next > section.at) {
        std::string radii;
        for (const double r : section.radii) radii += (radii.empty() ? "" : ", ") + shortNumber(r);
        handle.insert_path = last ? "/tube/sections/-" : itemOf("/tube/sections", s + 1);
        handle.insert_value = "{at: " + shortNumber(next) + ", radii: [" + radii + "]}";
      }
      if (tube.sections.size() > 1) handle.remove_path = item;
      handles.push_back(handle);
    }
  }
}

void addRevolve(const RevolveSpec& revolve, std::vector<Handle>& handles) {
  Handle origin;
  origin.path = "/revolve/origin";
  origin.place = revolve.origin;
  handles.push_back(origin);
  const Vector3 axis = revolve.axis.normalized();
  const Vector3 across = (revolve.reference - revolve.reference.dot(axis) * axis).normalized();
  const auto& profile = revolve.profile;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    Handle handle;
    handle.kind = Handle::Kind::Profile;
    handle.path = itemOf("/revolve/profile", i);
    handle.origin = revolve.origin;
    handle.axis = axis, handle.across = across;
    handle.place = revolve.origin + profile[i][0] * axis + profile[i][1] * across;
    if (i + 1 < profile.size()) {
      handle.insert_path = itemOf("/revolve/profile", i + 1);
      handle.insert_value = "[" + shortNumber(0.5 * (profile[i][0] + profile[i + 1][0])) + ", " +
                            shortNumber(0.5 * (profile[i][1] + profile[i + 1][1])) + "]";
    }
    if (profile.size() > 2) handle.remove_path = handle.path;
    handles.push_back(handle);
  }
}

void addTree(const TreeSpec& tree, std::vector<Handle>& handles) {
  Handle root;
  root.path = "/tree/root";
  root.place = tree.root;
  handles.push_back(root);
  Handle radius;
  radius.kind = Handle::Kind::Length;
  radius.path = "/tree/radius";
  radius.origin = tree.root;
  if (!tree.region) {
    Handle direction;
    direction.kind = Handle::Kind::Direction;
    direction.path = "/tree/direction";
    direction.origin = tree.root;
    direction.place = tree.root + tree.length * tree.radius * tree.direction.normalized();
    handles.push_back(direction);
    radius.axis = tree.direction.cross(tree.plane).normalized();
  } else {
    const Region& region = *tree.region;
    Handle centre;
    centre.path = "/tree/region/centre";
    centre.place = region.centre;
    handles.push_back(centre);
    for (int axis = 0; axis < 3; ++axis) {
      Handle half;
      half.kind = Handle::Kind::Length;
      half.path = itemOf("/tree/region/half_axes", static_cast<std::size_t>(axis));
      half.origin = region.centre;
      half.axis = Vector3::Unit(axis);
      half.place = region.centre + region.half_axes[axis] * half.axis;
      handles.push_back(half);
    }
    radius.axis = (region.centre - tree.root).unitOrthogonal();
  }
  radius.place = tree.root + tree.radius * radius.axis;
  handles.push_back(radius);
}

std::vector<Vector3> lineOf(const std::vector<Vector3>& points) {
  const Curve curve(points);
  std::vector<Vector3> line;
  for (int i = 0; i <= kFine; ++i) line.push_back(curve.at(curve.length() * i / kFine));
  return line;
}

}  // namespace

std::vector<Handle> handlesOf(const SceneSource& alone) {
  std::vector<Handle> handles;
  if (!alone.trees.empty()) {
    addTree(alone.trees.front().spec, handles);
    return handles;
  }
  const ObjectSource& object = alone.objects.front();
  if (object.tube) addTube(*object.tube, handles);
  if (object.sheet) {
    for (std::size_t c = 0; c < object.sheet->curves.size(); ++c)
      addPoints(itemOf("/sheet/curves", c), object.sheet->curves[c], handles);
    addWhole("/sheet/curves", object.sheet->curves, true, handles);
  }
  if (object.revolve) addRevolve(*object.revolve, handles);
  for (std::size_t b = 0; b < object.bumps.size(); ++b) {
    Handle handle;
    handle.path = itemOf("/bumps", b) + "/at";
    handle.place = object.bumps[b].at;
    if (object.bumps.size() > 1) handle.remove_path = itemOf("/bumps", b);
    handles.push_back(handle);
  }
  return handles;
}

std::string valueAt(const Handle& handle, const Vector3& place) {
  const Vector3 from = place - handle.origin;
  // The nearest that the field allows.
  const auto allowed = [&](const std::string& path, double value) {
    const Field* field = fieldOf(path.substr(1));
    return shortNumber(field == nullptr ? value : std::clamp(value, field->least, field->most));
  };
  switch (handle.kind) {
    case Handle::Kind::Point:
      return shortVector(place);
    case Handle::Kind::Direction:
      return shortVector(from.norm() > 1e-6 ? Vector3(from.normalized()) : handle.axis);
    case Handle::Kind::Length:
      return allowed(handle.path, from.dot(handle.axis));
    case Handle::Kind::Profile:
      return "[" + allowed(handle.path + "/0", from.dot(handle.axis)) + ", " +
             allowed(handle.path + "/1", from.dot(handle.across)) + "]";
    case Handle::Kind::Whole:
      break;
  }
  const Vector3 by = place - handle.place;
  std::string curves;
  for (const auto& curve : handle.all) {
    std::string points;
    for (const Vector3& p : curve) points += (points.empty() ? "" : ", ") + shortVector(p + by);
    curves += (curves.empty() ? "[" : ", [") + points + "]";
  }
  return handle.nested ? "[" + curves + "]" : curves;
}

std::vector<std::vector<Vector3>> linesOf(const SceneSource& alone) {
  std::vector<std::vector<Vector3>> lines;
  for (const ObjectSource& object : alone.objects) {
    if (object.tube) {
      lines.push_back(lineOf(object.tube->centre));
      if (!alone.trees.empty()) continue;  // a branch: its line says enough
      const Curve curve(object.tube->centre);
      const auto frames = sectionFrames(*object.tube, curve);
      for (std::size_t s = 0; s < frames.size(); ++s) {
        std::vector<Vector3> ring;
        for (int i = 0; i <= kFine; ++i) {
          const double angle = 2 * M_PI * i / kFine;
          const double radius = polarRadius(object.tube->sections[s].radii, angle);
          ring.push_back(frames[s].centre +
                         radius * (std::cos(angle) * frames[s].x + std::sin(angle) * frames[s].y));
        }
        lines.push_back(std::move(ring));
      }
    }
    if (object.sheet)
      for (const auto& curve : object.sheet->curves) lines.push_back(lineOf(curve));
    if (object.revolve) {
      const RevolveSpec& revolve = *object.revolve;
      const Vector3 axis = revolve.axis.normalized();
      const Vector3 across = (revolve.reference - revolve.reference.dot(axis) * axis).normalized();
      std::vector<Vector3> profile;
      for (const auto& p : revolve.profile) profile.push_back(revolve.origin + p[0] * axis + p[1] * across);
      lines.push_back({revolve.origin + revolve.profile.front()[0] * axis,
                       revolve.origin + revolve.profile.back()[0] * axis});
      lines.push_back(lineOf(profile));
    }
  }
  return lines;
}

}  // namespace vest::modelling
