#include "vest_viz/mesh/store.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "caps.h"
#include "vest_tissue/net/skin.h"

namespace vest::mesh {
namespace {

bool allBelow(const std::vector<std::uint32_t>& indices, std::size_t limit) {
  return std::all_of(indices.begin(), indices.end(), [limit](std::uint32_t i) { return i < limit; });
}

bool finite(const float* values, std::size_t count) {
  // A sum stays finite only if all terms are; eight partial sums let the compiler use its vector unit.
  float sum[8] = {0};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8)
    for (int k = 0; k < 8; ++k) sum[k] += values[i + k] * 0.0f;
  for (; i < count; ++i) sum[0] += values[i] * 0.0f;
  float total = 0;
  for (float s : sum) total += s;
  return total == 0.0f;
}

/// m, per axis: less is no news. A twentieth of a pixel of the standard view at 2 cm; the pulse moves
/// everything a little all the time.
constexpr float kUnseen = 1e-5f;

/// Greatest difference of two arrays.
float farthest(const float* a, const float* b, std::size_t count) {
  float most[8] = {0};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8)
    for (std::size_t k = 0; k < 8; ++k) {
      const float off = std::fabs(a[i + k] - b[i + k]);
      most[k] = most[k] < off ? off : most[k];
    }
  for (; i < count; ++i) most[0] = std::max(most[0], std::fabs(a[i] - b[i]));
  return *std::max_element(most, most + 8);
}

/// CSR start arrays: begin at 0, never fall, end at the number of entries.
bool isStart(const std::vector<std::uint32_t>& start, std::size_t entries) {
  if (start.empty()) return entries == 0;
  if (start.front() != 0 || start.back() != entries) return false;
  return std::is_sorted(start.begin(), start.end());
}

std::string complain(const Object& object, const std::string& what) {
  return "object " + object.name + ": " + what;
}

void clearShape(Object* object) {
  object->triangles.clear();
  object->triangle_layer.clear();
  object->texture_coordinates.clear();
  object->binding_start.assign(1, 0);
  object->binding_knots.clear();
  object->binding_weights.clear();
  object->link_knots.clear();
  object->link_alive.clear();
  object->link_kind.clear();
  object->tetrahedra.clear();
  object->tetrahedron_material.clear();
  if (object->rest_position.size() != 3 * static_cast<std::size_t>(object->knot_count) ||
      !finite(object->rest_position.data(), object->rest_position.size())) {
    object->rest_position.clear();
    object->knot_count = 0;
  }
}

constexpr std::size_t kAll = ~std::size_t{0};

/// Triangles of the skin with a double of each vertex that cut faces share with other layers.
void splitCutFaces(const Object& o, Skin* skin) {
  skin->triangles = o.triangles;
  skin->doubled.clear();
  const std::size_t n = o.vertexCount();
  skin->cut.build(o);
  if (!o.triangle_layer.empty()) {
    std::vector<std::uint8_t> outside(n, 0);
    for (std::size_t t = 0; t < o.triangle_layer.size(); ++t)
      if (o.triangle_layer[t] != kCutFace)
        for (std::size_t k = 0; k < 3; ++k) outside[o.triangles[3 * t + k]] = 1;
    std::vector<std::uint32_t> twin(n, 0);
    for (std::size_t t = 0; t < o.triangle_layer.size(); ++t) {
      if (o.triangle_layer[t] != kCutFace) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        std::uint32_t& v = skin->triangles[3 * t + k];
        if (!outside[v]) continue;
        if (twin[v] == 0) {
          twin[v] = static_cast<std::uint32_t>(n + skin->doubled.size());
          skin->doubled.push_back(v);
        }
        v = twin[v];
      }
    }
  }
  for (std::uint32_t t : skin->cut.dropped()) std::fill_n(skin->triangles.begin() + 3 * t, 3, 0u);
  skin->uv = o.texture_coordinates;
  if (!skin->uv.empty())
    for (std::uint32_t v : skin->doubled)
      skin->uv.insert(skin->uv.end(), {float(skin->uv[2 * v]), float(skin->uv[2 * v + 1])});
  if (!o.rigid) spreadCaps(o, skin);
  const std::size_t all = 3 * (n + skin->doubled.size());
  skin->positions.assign(all, 0.0f);
  skin->normals.assign(all, 0.0f);
  skin->tangents.assign(all, 0.0f);
}

}  // namespace

std::string validate(const Object& o) {
  const std::size_t knots = o.knot_count;
  if (o.rest_position.size() != 3 * knots)
    return complain(o, "rest_position has " + std::to_string(o.rest_position.size()) +
                           " numbers, knot_count " + std::to_string(knots) + " needs " +
                           std::to_string(3 * knots));
  if (!finite(o.rest_position.data(), o.rest_position.size()))
    return complain(o, "rest_position is not finite");
  if (!o.knot_fixed.empty() && o.knot_fixed.size() != knots)
    return complain(o, "knot_fixed is not one per knot");
  if (o.link_knots.size() % 2 != 0) return complain(o, "link_knots is not in pairs");
  if (!allBelow(o.link_knots, knots)) return complain(o, "link_knots names a knot that does not exist");
  if (!o.link_alive.empty() && o.link_alive.size() != o.link_knots.size() / 2)
    return complain(o, "link_alive is not one per link");
  if (o.binding_weights.size() != o.binding_knots.size())
    return complain(o, "binding_weights and binding_knots differ in size");
  if (!isStart(o.binding_start, o.binding_knots.size()))
    return complain(o, "binding_start does not ascend from 0 to the number of binding_knots");
  if (!allBelow(o.binding_knots, knots)) return complain(o, "binding_knots names a knot that does not exist");
  if (!finite(o.binding_weights.data(), o.binding_weights.size()))
    return complain(o, "binding_weights is not finite");
  if (o.tetrahedra.size() % 4 != 0 || !allBelow(o.tetrahedra, knots))
    return complain(o, "tetrahedra is not in fours, or names a knot that does not exist");
  if (!o.tetrahedron_material.empty() && 4 * o.tetrahedron_material.size() != o.tetrahedra.size())
    return complain(o, "tetrahedron_material is not one per tetrahedron");
  if (o.triangles.size() % 3 != 0) return complain(o, "triangles is not in threes");
  if (!allBelow(o.triangles, o.vertexCount()))
    return complain(o, "triangles names a vertex that does not exist");
  if (!o.triangle_layer.empty() && o.triangle_layer.size() != o.triangles.size() / 3)
    return complain(o, "triangle_layer is not one per triangle");
  if (!o.texture_coordinates.empty() && (o.texture_coordinates.size() != 2 * o.vertexCount() ||
                                         !finite(o.texture_coordinates.data(), o.texture_coordinates.size())))
    return complain(o, "texture_coordinates is not two finite numbers per vertex");
  return {};
}

Outcome Store::setTopology(Topology topology) {
  if (!topology_.objects.empty() && topology.revision == topology_.revision &&
      topology.scene == topology_.scene && topology.objects.size() == topology_.objects.size()) {
    bool same = true;
    for (std::size_t i = 0; same && i < topology.objects.size(); ++i)
      same = topology.objects[i].triangles == topology_.objects[i].triangles &&
             topology.objects[i].rest_position == topology_.objects[i].rest_position &&
             topology.objects[i].link_alive == topology_.objects[i].link_alive;
    if (same) {
      for (std::size_t i = 0; i < topology.objects.size(); ++i)  // these come with no delta
        if (topology.objects[i].knot_count == topology_.objects[i].knot_count &&
            validate(topology.objects[i]).empty())
          topology_.objects[i].tetrahedra = std::move(topology.objects[i].tetrahedra);
      return Outcome::Repeated;
    }
  }
  problem_.clear();
  for (Object& object : topology.objects) {
    const std::string message = validate(object);
    if (message.empty()) continue;
    if (problem_.empty()) problem_ = message;
    clearShape(&object);
  }
  // The same knots again (a repeated whole topology after a cut): keep the shape instead of jumping to rest.
  bool same_knots = topology.scene == topology_.scene && topology.objects.size() == topology_.objects.size();
  for (std::size_t i = 0; same_knots && i < topology.objects.size(); ++i)
    same_knots = topology.objects[i].knot_count == topology_.objects[i].knot_count &&
                 topology.objects[i].rest_position == topology_.objects[i].rest_position;
  const std::vector<float> old = knots_;
  topology_ = std::move(topology);
  if (!same_knots) fields_.clear();
  layOut(same_knots && !old.empty() ? &old : nullptr, kAll);
  return problem_.empty() ? Outcome::Accepted : Outcome::Malformed;
}

void Store::layOut(const std::vector<float>* old_knots, std::size_t changed) {
  first_knot_.clear();
  std::size_t total = 0;
  for (const Object& object : topology_.objects) {
    first_knot_.push_back(total);
    total += object.knot_count;
  }
  if (old_knots != nullptr && old_knots->size() == 3 * total) {
    knots_ = *old_knots;
  } else {
    knots_.clear();
    knots_.reserve(3 * total);
    for (const Object& object : topology_.objects)
      knots_.insert(knots_.end(), object.rest_position.begin(), object.rest_position.end());
  }
  ++shape_version_;
  if (changed != kAll) {
    splitCutFaces(topology_.objects[changed], &skins_[changed]);
    dirty_[changed] = 1;
    object_version_[changed] = shape_version_;
    return;
  }
  skins_.assign(topology_.objects.size(), {});
  for (std::size_t i = 0; i < skins_.size(); ++i) splitCutFaces(topology_.objects[i], &skins_[i]);
  object_version_.assign(skins_.size(), shape_version_);
  dirty_.assign(skins_.size(), 1);
  moved_.assign(skins_.size(), 0);
}

Outcome Store::setField(std::uint32_t revision, const Field& field) {
  if (empty() || revision != topology_.revision) return Outcome::UnknownRevision;
  if (3 * field.data.size() != knots_.size() || !std::isfinite(field.minimum) ||
      !std::isfinite(field.maximum)) {
    problem_ = "field of kind " + std::to_string(field.kind) + " has " + std::to_string(field.data.size()) +
               " values between " + std::to_string(field.minimum) + " and " + std::to_string(field.maximum) +
               ", the topology has " + std::to_string(knots_.size() / 3) + " knots";
    return Outcome::Malformed;
  }
  ++field_version_;
  for (Field& f : fields_)
    if (f.kind == field.kind) {
      f = field;
      return Outcome::Accepted;
    }
  fields_.push_back(field);
  return Outcome::Accepted;
}

const Field* Store::field(std::uint8_t kind) const {
  for (const Field& f : fields_)
    if (f.kind == kind) return &f;
  return nullptr;
}

float Store::knotField(std::size_t object, std::uint8_t kind, std::size_t knot) const {
  const Field* f = field(kind);
  if (f == nullptr || object >= first_knot_.size() || knot >= topology_.objects[object].knot_count)
    return std::numeric_limits<float>::quiet_NaN();
  return f->minimum + (f->maximum - f->minimum) * f->data[first_knot_[object] + knot] / 255.0f;
}

float Store::largestAtKnots(std::size_t object, std::uint8_t kind, float low, float high) const {
  const Field* f = field(kind);
  const std::size_t n = topology_.objects[object].knot_count;
  if (f == nullptr || high == low || n == 0) return 0;
  // The map may turn the order round (perfusion: less is more to see).
  const auto [least, most] =
      std::minmax_element(f->data.begin() + static_cast<std::ptrdiff_t>(first_knot_[object]),
                          f->data.begin() + static_cast<std::ptrdiff_t>(first_knot_[object] + n));
  const auto mapped = [&](std::uint8_t byte) {
    const float value = f->minimum + (f->maximum - f->minimum) * byte / 255.0f;
    return std::clamp((value - low) / (high - low), 0.0f, 1.0f);
  };
  return std::max(mapped(*least), mapped(*most));
}

float Store::vertexField(std::size_t object, std::uint8_t kind, float low, float high, std::uint8_t* out,
                         std::size_t stride) const {
  const Field* f = field(kind);
  const Object& o = topology_.objects[object];
  const Skin& skin = skins_[object];
  const std::size_t n = o.vertexCount();
  const auto at = [&](std::size_t v) -> std::uint8_t& { return out[v * stride]; };
  if (f == nullptr || high == low) {
    for (std::size_t v = 0; v < skin.vertexCount(); ++v) at(v) = 0;
    return 0;
  }
  const float scale = (f->maximum - f->minimum) / (high - low);
  const float offset = 255.0f * (f->minimum - low) / (high - low) + 0.5f;
  const std::uint8_t* data = f->data.data() + first_knot_[object];
  std::uint8_t largest = 0;
  for (std::size_t v = 0; v < n; ++v) {
    float sum = 0;
    for (std::uint32_t k = o.binding_start[v]; k < o.binding_start[v + 1]; ++k)
      sum += o.binding_weights[k] * data[o.binding_knots[k]];
    const auto value = static_cast<std::uint8_t>(std::clamp(sum * scale + offset, 0.0f, 255.0f));
    at(v) = value;
    largest = std::max(largest, value);
  }
  for (std::size_t k = 0; k < skin.doubled.size(); ++k) at(n + k) = at(skin.doubled[k]);
  return static_cast<float>(largest) / 255.0f;
}

Outcome Store::setState(std::uint32_t revision, const float* positions, std::size_t count) {
  if (empty() || revision != topology_.revision) {
    problem_ =
        "state of revision " + std::to_string(revision) + ", known is " + std::to_string(topology_.revision);
    return Outcome::UnknownRevision;
  }
  if (count != knots_.size()) {
    problem_ = "state has " + std::to_string(count) + " numbers, the topology's knots need " +
               std::to_string(knots_.size());
    return Outcome::Malformed;
  }
  Outcome outcome = Outcome::Accepted;
  for (std::size_t i = 0; i < skins_.size(); ++i) {
    const std::size_t begin = 3 * first_knot_[i],
                      n = 3 * static_cast<std::size_t>(topology_.objects[i].knot_count);
    if (n == 0) continue;
    if (!finite(positions + begin, n)) {
      problem_ = complain(topology_.objects[i], "positions are not finite, the last good ones are shown");
      outcome = Outcome::NotFinite;
      continue;
    }
    if (farthest(positions + begin, knots_.data() + begin, n) <= kUnseen) continue;
    std::copy(positions + begin, positions + begin + n, knots_.begin() + begin);
    dirty_[i] = 1;
  }
  return outcome;
}

void Store::rebuildSkins() {
  for (std::size_t i = 0; i < skins_.size(); ++i) {
    moved_[i] = dirty_[i];
    if (!dirty_[i]) continue;
    dirty_[i] = 0;
    const Object& o = topology_.objects[i];
    Skin& skin = skins_[i];
    const std::size_t n = o.vertexCount();
    if (n == 0) continue;
    net::rebuildSkin(knots(i), o.binding_start.data(), o.binding_knots.data(), o.binding_weights.data(), n,
                     skin.positions.data());
    skin.cut.smooth(skin.positions.data());
    for (std::size_t k = 0; k < skin.doubled.size(); ++k)
      std::copy_n(&skin.positions[3 * static_cast<std::size_t>(skin.doubled[k])], 3,
                  &skin.positions[3 * (n + k)]);
    net::vertexNormals(skin.positions.data(), skin.vertexCount(), skin.triangles.data(),
                       skin.triangles.size() / 3, skin.normals.data());
    vertexTangents(skin.positions.data(), skin.uv.empty() ? nullptr : skin.uv.data(), skin.normals.data(),
                   skin.vertexCount(), skin.triangles.data(), skin.triangles.size() / 3,
                   skin.tangents.data());
  }
}

Outcome Store::applyDelta(const Delta& d) {
  if (empty()) {
    problem_ = "topology delta before any topology";
    return Outcome::UnknownRevision;
  }
  if (d.revision == topology_.revision) return Outcome::Repeated;
  if (d.from_revision != topology_.revision) {
    problem_ = "topology delta from revision " + std::to_string(d.from_revision) + ", known is " +
               std::to_string(topology_.revision);
    return Outcome::UnknownRevision;
  }
  if (d.object >= topology_.objects.size()) {
    problem_ = "topology delta for object " + std::to_string(d.object) + " of " +
               std::to_string(topology_.objects.size());
    return Outcome::Malformed;
  }
  Object o = topology_.objects[d.object];
  const auto refuse = [&](const char* what) {
    problem_ = complain(o, std::string("delta: ") + what);
    return Outcome::Malformed;
  };
  const std::size_t old_knots = o.knot_count;
  if (!allBelow(d.removed_links, o.link_knots.size() / 2))
    return refuse("removed_links names a link that does not exist");
  if (!allBelow(d.doubled_knots, old_knots)) return refuse("doubled_knots names a knot that does not exist");
  if (!allBelow(d.removed_triangles, o.triangles.size() / 3) ||
      std::adjacent_find(d.removed_triangles.begin(), d.removed_triangles.end(), std::greater_equal<>()) !=
          d.removed_triangles.end())
    return refuse("removed_triangles does not ascend among the triangles");
  if (!isStart(d.added_binding_start, d.added_binding_knots.size()))
    return refuse("added_binding_start is inconsistent");
  if (!isStart(d.rebound_start, d.rebound_knots.size()) ||
      (!d.rebound_vertices.empty() && d.rebound_start.size() != d.rebound_vertices.size() + 1) ||
      d.rebound_weights.size() != d.rebound_knots.size() || !allBelow(d.rebound_vertices, o.vertexCount()))
    return refuse("rebound_* is inconsistent");

  o.link_alive.resize(o.link_knots.size() / 2, 1);
  for (std::uint32_t link : d.removed_links) o.link_alive[link] = 0;
  o.link_knots.insert(o.link_knots.end(), d.added_link_knots.begin(), d.added_link_knots.end());
  o.link_alive.resize(o.link_knots.size() / 2, 1);
  if (!o.link_kind.empty()) {
    o.link_kind.insert(o.link_kind.end(), d.added_link_kind.begin(), d.added_link_kind.end());
    o.link_kind.resize(o.link_knots.size() / 2, 0);
  }

  o.knot_count += static_cast<std::uint32_t>(d.doubled_knots.size());
  if (!o.knot_fixed.empty()) o.knot_fixed.resize(o.knot_count, 0);
  for (std::uint32_t p : d.doubled_knots)
    for (int k = 0; k < 3; ++k) o.rest_position.push_back(float(o.rest_position[3 * p + k]));

  if (o.triangle_layer.empty()) o.triangle_layer.assign(o.triangles.size() / 3, 0);
  // Indices never shift: a dead triangle stays, without area.
  for (std::uint32_t t : d.removed_triangles) std::fill_n(o.triangles.begin() + 3 * t, 3, 0u);
  o.triangles.insert(o.triangles.end(), d.added_triangles.begin(), d.added_triangles.end());
  o.triangle_layer.insert(o.triangle_layer.end(), d.added_triangle_layer.begin(),
                          d.added_triangle_layer.end());
  o.triangle_layer.resize(o.triangles.size() / 3, 2);

  if (!d.rebound_vertices.empty()) {
    // Rewritten as a whole: entries per vertex may have changed in number.
    std::vector<std::int64_t> replaced(o.vertexCount(), -1);
    for (std::size_t i = 0; i < d.rebound_vertices.size(); ++i)
      replaced[d.rebound_vertices[i]] = std::int64_t(i);
    std::vector<std::uint32_t> start{0}, knots;
    std::vector<float> weights;
    for (std::size_t v = 0; v < o.vertexCount(); ++v) {
      const bool is_new = replaced[v] >= 0;
      const auto& s = is_new ? d.rebound_start : o.binding_start;
      const auto& k = is_new ? d.rebound_knots : o.binding_knots;
      const auto& w = is_new ? d.rebound_weights : o.binding_weights;
      const std::size_t row = is_new ? std::size_t(replaced[v]) : v;
      knots.insert(knots.end(), k.begin() + s[row], k.begin() + s[row + 1]);
      weights.insert(weights.end(), w.begin() + s[row], w.begin() + s[row + 1]);
      start.push_back(std::uint32_t(knots.size()));
    }
    o.binding_start = std::move(start);
    o.binding_knots = std::move(knots);
    o.binding_weights = std::move(weights);
  }
  if (!d.added_binding_start.empty()) {
    const std::uint32_t base = o.binding_start.back();
    for (std::size_t i = 1; i < d.added_binding_start.size(); ++i)
      o.binding_start.push_back(base + d.added_binding_start[i]);
    o.binding_knots.insert(o.binding_knots.end(), d.added_binding_knots.begin(), d.added_binding_knots.end());
    o.binding_weights.insert(o.binding_weights.end(), d.added_binding_weights.begin(),
                             d.added_binding_weights.end());
    if (!o.texture_coordinates.empty())
      o.texture_coordinates.insert(o.texture_coordinates.end(), d.added_texture_coordinates.begin(),
                                   d.added_texture_coordinates.end());
  }
  const std::string message = validate(o);
  if (!message.empty()) {
    problem_ = message;
    return Outcome::Malformed;
  }
  // Copies P' start where P is now, so that nothing jumps before the next state.
  std::vector<float> now;
  now.reserve(knots_.size() + 3 * d.doubled_knots.size());
  for (std::size_t i = 0; i < topology_.objects.size(); ++i) {
    const float* first = knots(i);
    now.insert(now.end(), first, first + 3 * static_cast<std::size_t>(topology_.objects[i].knot_count));
    if (i == d.object)
      for (std::uint32_t p : d.doubled_knots) now.insert(now.end(), first + 3 * p, first + 3 * p + 3);
  }
  for (Field& f : fields_) {
    std::vector<std::uint8_t> data;
    data.reserve(now.size() / 3);
    for (std::size_t i = 0; i < topology_.objects.size(); ++i) {
      const std::uint8_t* first = f.data.data() + first_knot_[i];
      data.insert(data.end(), first, first + topology_.objects[i].knot_count);
      if (i == d.object)
        for (std::uint32_t p : d.doubled_knots) data.push_back(first[p]);
    }
    f.data = std::move(data);
  }
  if (!fields_.empty()) ++field_version_;
  topology_.objects[d.object] = std::move(o);
  topology_.revision = d.revision;
  layOut(&now, d.object);
  return Outcome::Accepted;
}

void vertexTangents(const float* p, const float* uv, const float* normals, std::size_t vertices,
                    const std::uint32_t* triangles, std::size_t count, float* tangents) {
  std::fill(tangents, tangents + 3 * vertices, 0.0f);
  for (std::size_t t = 0; uv != nullptr && t < count; ++t) {
    const std::uint32_t a = triangles[3 * t], b = triangles[3 * t + 1], c = triangles[3 * t + 2];
    const float v1 = uv[2 * b + 1] - uv[2 * a + 1], v2 = uv[2 * c + 1] - uv[2 * a + 1];
    const float u1 = uv[2 * b] - uv[2 * a], u2 = uv[2 * c] - uv[2 * a];
    const float turn = u1 * v2 - u2 * v1 < 0 ? -1.0f : 1.0f;
    for (int k = 0; k < 3; ++k) {
      const float e1 = p[3 * b + k] - p[3 * a + k], e2 = p[3 * c + k] - p[3 * a + k];
      const float g = turn * (e1 * v2 - e2 * v1);
      tangents[3 * a + k] += g;
      tangents[3 * b + k] += g;
      tangents[3 * c + k] += g;
    }
  }
  for (std::size_t i = 0; i < vertices; ++i) {
    float* t = tangents + 3 * i;
    const float* n = normals + 3 * i;
    float squared = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
    if (!(squared > 1e-24f)) {
      // Across the normal, by its smaller component.
      if (std::fabs(n[0]) < 0.8f) {
        t[0] = 0, t[1] = n[2], t[2] = -n[1];
      } else {
        t[0] = -n[2], t[1] = 0, t[2] = n[0];
      }
      squared = std::max(t[0] * t[0] + t[1] * t[1] + t[2] * t[2], 1e-12f);
    }
    const float s = 1.0f / std::sqrt(squared);
    for (int k = 0; k < 3; ++k) t[k] *= s;
  }
}

double metresPerTextureUnit(const Object& o, const float* p) {
  if (o.texture_coordinates.empty()) return 0.0;
  double area = 0, area_uv = 0;
  const float* uv = o.texture_coordinates.data();
  for (std::size_t t = 0; t + 2 < o.triangles.size(); t += 3) {
    const std::size_t a = o.triangles[t], b = o.triangles[t + 1], c = o.triangles[t + 2];
    double e1[3], e2[3];
    for (int k = 0; k < 3; ++k) e1[k] = p[3 * b + k] - p[3 * a + k], e2[k] = p[3 * c + k] - p[3 * a + k];
    const double x = e1[1] * e2[2] - e1[2] * e2[1], y = e1[2] * e2[0] - e1[0] * e2[2],
                 z = e1[0] * e2[1] - e1[1] * e2[0];
    area += std::sqrt(x * x + y * y + z * z);
    area_uv += std::fabs(double(uv[2 * b] - uv[2 * a]) * (uv[2 * c + 1] - uv[2 * a + 1]) -
                         double(uv[2 * c] - uv[2 * a]) * (uv[2 * b + 1] - uv[2 * a + 1]));
  }
  return area_uv > 0 && area > 0 ? std::sqrt(area / area_uv) : 0.0;
}

}  // namespace vest::mesh
