#include "vest_viz/inspect/slice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace vest::inspect {
namespace {

using Eigen::Vector3f;

Vector3f pointAt(const float* p, std::size_t i) {
  return {p[3 * i], p[3 * i + 1], p[3 * i + 2]};
}

/// A place in the plane with the field there.
struct Corner {
  Vector3f place;
  float value;
};

class Cutter {
 public:
  Cutter(const mesh::Store& store, const Plane& plane, const SliceField* field, Slice* out)
      : store_(store), plane_(plane), field_(field), out_(out) {
    u_ = std::fabs(plane.normal.x()) < 0.8f ? plane.normal.cross(Vector3f::UnitX())
                                            : plane.normal.cross(Vector3f::UnitY());
    u_.normalize();
    v_ = plane.normal.cross(u_);
  }

  void object(std::size_t index) {
    const mesh::Object& o = store_.topology().objects[index];
    object_ = static_cast<std::uint16_t>(index);
    material_ = -1;
    borders(index);
    if (!o.tetrahedra.empty())
      elements(index);
    else if (!o.rigid)
      rows();
  }

 private:
  float height(const Vector3f& p) const { return plane_.normal.dot(p) - plane_.offset; }

  static Corner between(const Vector3f& a, const Vector3f& b, float ha, float hb, float va, float vb) {
    const float t = ha / (ha - hb);
    return {a + t * (b - a), va + t * (vb - va)};
  }

  float knotValue(std::size_t index, std::size_t knot) const {
    if (field_ == nullptr || field_->high == field_->low) return std::numeric_limits<float>::quiet_NaN();
    return (store_.knotField(index, field_->kind, knot) - field_->low) / (field_->high - field_->low);
  }

  void triangle(const Corner& a, const Corner& b, const Corner& c) {
    for (const Corner* corner : {&a, &b, &c}) {
      out_->triangles.push_back(static_cast<std::uint32_t>(out_->values.size()));
      out_->positions.insert(out_->positions.end(), corner->place.data(), corner->place.data() + 3);
      out_->values.push_back(corner->value);
      out_->object.push_back(object_);
      out_->material.push_back(material_);
    }
  }

  void elements(std::size_t index) {
    const mesh::Object& o = store_.topology().objects[index];
    const float* const p = store_.knots(index);
    const float* const rest = o.rest_position.data();
    for (std::size_t e = 0; e + 3 < o.tetrahedra.size(); e += 4) {
      const std::uint32_t* const k = &o.tetrahedra[e];
      std::array<float, 4> h;
      int above = 0;
      for (std::size_t i = 0; i < 4; ++i) above += (h[i] = height(pointAt(p, k[i]))) > 0;
      if (above == 0 || above == 4) continue;
      bool torn = false;
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j)
          torn |= (pointAt(p, k[i]) - pointAt(p, k[j])).squaredNorm() >
                  kTorn * kTorn * (pointAt(rest, k[i]) - pointAt(rest, k[j])).squaredNorm();
      if (torn) continue;
      material_ = o.tetrahedron_material.empty() ? -1 : o.tetrahedron_material[e / 4];
      // Edges from one side to the other: three around a lone corner, or four, in a ring.
      std::array<Corner, 4> ring;
      std::size_t count = 0;
      const auto edge = [&](std::size_t i, std::size_t j) {
        ring[count++] = between(pointAt(p, k[i]), pointAt(p, k[j]), h[i], h[j], knotValue(index, k[i]),
                                knotValue(index, k[j]));
      };
      if (above == 2) {
        std::size_t up[2], down[2], ups = 0, downs = 0;
        for (std::size_t i = 0; i < 4; ++i) (h[i] > 0 ? up[ups++] : down[downs++]) = i;
        edge(up[0], down[0]), edge(up[0], down[1]), edge(up[1], down[1]), edge(up[1], down[0]);
      } else {
        std::size_t lone = 0;
        while ((h[lone] > 0) != (above == 1)) ++lone;
        for (std::size_t i = 0; i < 4; ++i)
          if (i != lone) edge(lone, i);
      }
      triangle(ring[0], ring[1], ring[2]);
      if (count == 4) triangle(ring[0], ring[2], ring[3]);
    }
  }

  void borders(std::size_t index) {
    segments_.clear();
    const mesh::Skin& skin = store_.skin(index);
    const float* const p = skin.positions.data();
    std::vector<std::uint8_t> bytes;
    const bool known = field_ != nullptr && store_.field(field_->kind) != nullptr;
    if (known) {
      bytes.resize(skin.vertexCount());
      store_.vertexField(index, field_->kind, field_->low, field_->high, bytes.data(), 1);
    }
    const auto value = [&](std::size_t v) {
      return known ? static_cast<float>(bytes[v]) / 255 : std::numeric_limits<float>::quiet_NaN();
    };
    for (std::size_t t = 0; t + 2 < skin.triangles.size(); t += 3) {
      const std::uint32_t* const v = &skin.triangles[t];
      if (v[0] == v[1] || v[1] == v[2]) continue;  // died in a cut
      const std::array<float, 3> h{height(pointAt(p, v[0])), height(pointAt(p, v[1])),
                                   height(pointAt(p, v[2]))};
      std::array<Corner, 2> ends;
      std::size_t count = 0;
      for (std::size_t i = 0; i < 3 && count < 2; ++i) {
        const std::size_t j = (i + 1) % 3;
        if ((h[i] > 0) == (h[j] > 0)) continue;
        ends[count++] = between(pointAt(p, v[i]), pointAt(p, v[j]), h[i], h[j], value(v[i]), value(v[j]));
      }
      if (count < 2) continue;
      segments_.push_back(ends);
      for (const Corner& end : ends)
        out_->borders.insert(out_->borders.end(), end.place.data(), end.place.data() + 3);
    }
  }

  /// Fills what the borders enclose, row by row along u.
  void rows() {
    if (segments_.empty()) return;
    float low = std::numeric_limits<float>::infinity(), high = -low;
    for (const auto& s : segments_)
      for (const Corner& c : s) {
        low = std::min(low, v_.dot(c.place));
        high = std::max(high, v_.dot(c.place));
      }
    const auto count =
        std::clamp<std::size_t>(static_cast<std::size_t>((high - low) / kSliceRow), 1, kMostRows);
    const float step = (high - low) / static_cast<float>(count);
    std::vector<std::vector<std::pair<float, float>>> crossings(count);  // u and value
    for (const auto& s : segments_) {
      const float a = v_.dot(s[0].place), b = v_.dot(s[1].place);
      if (a == b) continue;
      // Rows whose middle lies in [min, max): each border between two segments counts once.
      const auto rowFrom = [&](float v) {
        const float row = std::ceil((v - low) / step - 0.5f);
        return static_cast<std::size_t>(std::clamp(row, 0.0f, static_cast<float>(count)));
      };
      for (std::size_t r = rowFrom(std::min(a, b)), end = rowFrom(std::max(a, b)); r < end; ++r) {
        const float t = (low + (static_cast<float>(r) + 0.5f) * step - a) / (b - a);
        crossings[r].emplace_back(u_.dot(s[0].place) + t * u_.dot(s[1].place - s[0].place),
                                  s[0].value + t * (s[1].value - s[0].value));
      }
    }
    const Vector3f origin = plane_.offset * plane_.normal;
    for (std::size_t r = 0; r < count; ++r) {
      auto& row = crossings[r];
      std::sort(row.begin(), row.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
      const float below = low + static_cast<float>(r) * step;
      for (std::size_t k = 0; k + 1 < row.size(); k += 2) {
        const auto corner = [&](const std::pair<float, float>& end, float v) {
          return Corner{origin + end.first * u_ + v * v_, end.second};
        };
        const Corner a = corner(row[k], below), b = corner(row[k + 1], below),
                     c = corner(row[k + 1], below + step), d = corner(row[k], below + step);
        triangle(a, b, c);
        triangle(a, c, d);
      }
    }
  }

  const mesh::Store& store_;
  Plane plane_;
  const SliceField* field_;
  Slice* out_;
  Vector3f u_, v_;  ///< axes of the plane
  std::uint16_t object_ = 0;
  int material_ = -1;
  std::vector<std::array<Corner, 2>> segments_;
};

}  // namespace

Slice slice(const mesh::Store& store, const Plane& plane, const std::function<bool(std::size_t)>& wanted,
            const SliceField* field) {
  Slice out;
  Cutter cutter(store, plane, field, &out);
  for (std::size_t i = 0; i < store.topology().objects.size(); ++i)
    if (!wanted || wanted(i)) cutter.object(i);
  return out;
}

}  // namespace vest::inspect
