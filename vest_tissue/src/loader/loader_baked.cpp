#include <cmath>
#include <cstdio>
#include <cstring>
#include <numeric>
#include <set>
#include <stdexcept>
#include <tuple>

#include <xxhash.h>

#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/scene/baked.h"

namespace vest::scene {
namespace {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "baked nets are little-endian");
constexpr char kMagic[] = "VESTNET1";
constexpr std::uint32_t kMaxElements = 1u << 22;

class Writer {
 public:
  Writer() : bytes_(kMagic, 8) {}
  template <class T>
  void section(const char* tag, const std::vector<T>& values) {
    const std::uint32_t head[2] = {static_cast<std::uint32_t>(values.size()), sizeof(T)};
    bytes_.append(tag, 4);
    bytes_.append(reinterpret_cast<const char*>(head), sizeof head);
    if (!values.empty())
      bytes_.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

class Reader {
 public:
  Reader(const std::string& bytes, const std::string& file) : bytes_(bytes), file_(file) {
    if (bytes.size() < 8 || bytes.compare(0, 8, kMagic) != 0) {
      yaml::fail(file, 0, "file", "no baked net", std::string("must begin with ") + kMagic);
    }
  }
  template <class T>
  std::vector<T> section(const char* tag) {
    std::uint32_t head[2];
    if (bytes_.size() - place_ < 4 + sizeof head) fail(tag, "cut off");
    if (bytes_.compare(place_, 4, tag) != 0) fail(tag, "missing");
    std::memcpy(head, bytes_.data() + place_ + 4, sizeof head);
    place_ += 4 + sizeof head;
    if (head[1] != sizeof(T)) fail(tag, "elements of " + std::to_string(head[1]) + " bytes");
    if (head[0] > kMaxElements || (bytes_.size() - place_) / sizeof(T) < head[0]) fail(tag, "cut off");
    std::vector<T> values(head[0]);
    if (head[0] > 0) std::memcpy(values.data(), bytes_.data() + place_, values.size() * sizeof(T));
    place_ += values.size() * sizeof(T);
    return values;
  }
  void finish() const {
    if (place_ != bytes_.size()) fail("end", std::to_string(bytes_.size() - place_) + " bytes too many");
  }
  [[noreturn]] void fail(const std::string& section, const std::string& what) const {
    yaml::fail(file_, 0, "section " + section, what,
               "must be as vest_model writes it (docs/scene_format.md)");
  }

 private:
  const std::string& bytes_;
  const std::string& file_;
  std::size_t place_ = 8;
};

using Triple = std::array<double, 3>;

std::vector<Triple> flat(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Triple> values;
  for (const auto& p : points) values.push_back({p.x(), p.y(), p.z()});
  return values;
}

std::vector<Eigen::Vector3d> points(const std::vector<Triple>& values) {
  std::vector<Eigen::Vector3d> result;
  for (const auto& v : values) result.emplace_back(v[0], v[1], v[2]);
  return result;
}

}  // namespace

std::string encodeBaked(const Object& object) {
  Writer writer;
  writer.section("REST", flat(object.rest_position));
  writer.section("POSI", flat(object.position));
  writer.section("MASS", object.mass);
  writer.section("DAMP", object.damping);
  writer.section("FIXD", object.fixed);
  std::vector<std::array<std::uint32_t, 4>> link_knots;
  std::vector<std::array<double, 4>> link_values;
  for (const Link& link : object.links) {
    link_knots.push_back({static_cast<std::uint32_t>(link.kind), link.knot0, link.knot1, link.knot2});
    link_values.push_back({link.rest, link.area, link.stiffness, link.damping});
  }
  writer.section("LNKK", link_knots);
  writer.section("LNKV", link_values);
  std::vector<std::array<std::uint32_t, 3>> volume_triangles;
  std::vector<Triple> volume_values;  // triangles, bulk modulus, rest volume
  for (const auto& volume : object.volumes) {
    volume_triangles.insert(volume_triangles.end(), volume.triangles.begin(), volume.triangles.end());
    volume_values.push_back(
        {static_cast<double>(volume.triangles.size()), volume.bulk_modulus, volume.rest_volume});
  }
  writer.section("VOLT", volume_triangles);
  writer.section("VOLV", volume_values);
  std::vector<std::array<std::uint32_t, 4>> hinge_knots;
  std::vector<double> hinge_values;
  for (const auto& hinge : object.hinges) {
    hinge_knots.push_back(hinge.knots);
    hinge_values.push_back(hinge.stiffness);
  }
  writer.section("HNGK", hinge_knots);
  writer.section("HNGV", hinge_values);
  std::vector<std::uint32_t> tether_knots;
  std::vector<std::array<double, 5>> tether_values;
  for (const auto& tether : object.tethers) {
    tether_knots.push_back(tether.knot);
    tether_values.push_back(
        {tether.place.x(), tether.place.y(), tether.place.z(), tether.stiffness, tether.damping});
  }
  writer.section("TETK", tether_knots);
  writer.section("TETV", tether_values);
  writer.section("CTRI", object.contact_triangles);
  writer.section("SKST", object.skin.binding_start);
  writer.section(
      "SKKN", std::vector<std::uint16_t>(object.skin.binding_knots.begin(), object.skin.binding_knots.end()));
  writer.section("SKWE", object.skin.binding_weights);
  writer.section("SKUV", object.skin.texture_coordinates);
  writer.section("SKTR", object.skin.triangles);
  writer.section("SKLA", object.skin.layer);
  writer.section("TUST", object.tube.station);
  std::vector<std::uint32_t> ring_start{0}, ring_knots;
  for (const auto& ring : object.tube.rings) {
    ring_knots.insert(ring_knots.end(), ring.begin(), ring.end());
    ring_start.push_back(static_cast<std::uint32_t>(ring_knots.size()));
  }
  writer.section("TURS", ring_start);
  writer.section("TURK", ring_knots);
  return writer.take();
}

void decodeBaked(const std::string& bytes, const std::string& file, Object& object) {
  Reader reader(bytes, file);
  object.rest_position = points(reader.section<Triple>("REST"));
  object.position = points(reader.section<Triple>("POSI"));
  object.mass = reader.section<double>("MASS");
  object.damping = reader.section<double>("DAMP");
  object.fixed = reader.section<std::uint8_t>("FIXD");
  const auto link_knots = reader.section<std::array<std::uint32_t, 4>>("LNKK");
  const auto link_values = reader.section<std::array<double, 4>>("LNKV");
  if (link_knots.size() != link_values.size())
    reader.fail("LNKV", std::to_string(link_values.size()) + " links");
  for (std::size_t i = 0; i < link_knots.size(); ++i) {
    if (link_knots[i][0] > 3) reader.fail("LNKK", "kind " + std::to_string(link_knots[i][0]));
    object.links.push_back({static_cast<LinkKind>(link_knots[i][0]), link_knots[i][1], link_knots[i][2],
                            link_knots[i][3], link_values[i][0], link_values[i][1], link_values[i][2],
                            link_values[i][3]});
  }
  const auto volume_triangles = reader.section<std::array<std::uint32_t, 3>>("VOLT");
  std::size_t used = 0;
  for (const auto& value : reader.section<Triple>("VOLV")) {
    if (!(value[0] >= 0 && value[0] <= static_cast<double>(volume_triangles.size() - used)) ||
        value[0] != std::floor(value[0]))
      reader.fail("VOLV", "count of triangles");
    VolumeElement volume;
    const auto first = volume_triangles.begin() + static_cast<std::ptrdiff_t>(used);
    volume.triangles.assign(first, first + static_cast<std::ptrdiff_t>(value[0]));
    used += volume.triangles.size();
    volume.bulk_modulus = value[1];
    volume.rest_volume = value[2];
    object.volumes.push_back(std::move(volume));
  }
  if (used != volume_triangles.size()) reader.fail("VOLT", "triangles of no volume");
  const auto hinge_knots = reader.section<std::array<std::uint32_t, 4>>("HNGK");
  const auto hinge_values = reader.section<double>("HNGV");
  if (hinge_knots.size() != hinge_values.size())
    reader.fail("HNGV", std::to_string(hinge_values.size()) + " hinges");
  for (std::size_t i = 0; i < hinge_knots.size(); ++i)
    object.hinges.push_back({hinge_knots[i], hinge_values[i]});
  const auto tether_knots = reader.section<std::uint32_t>("TETK");
  const auto tether_values = reader.section<std::array<double, 5>>("TETV");
  if (tether_knots.size() != tether_values.size())
    reader.fail("TETV", std::to_string(tether_values.size()) + " tethers");
  for (std::size_t i = 0; i < tether_knots.size(); ++i) {
    const auto& v = tether_values[i];
    object.tethers.push_back({tether_knots[i], {v[0], v[1], v[2]}, v[3], v[4]});
  }
  object.contact_triangles = reader.section<std::array<Index, 3>>("CTRI");
  object.skin.binding_start = reader.section<std::uint32_t>("SKST");
  const auto knots = reader.section<std::uint16_t>("SKKN");
  object.skin.binding_knots.assign(knots.begin(), knots.end());
  object.skin.binding_weights = reader.section<float>("SKWE");
  object.skin.texture_coordinates = reader.section<std::array<float, 2>>("SKUV");
  object.skin.triangles = reader.section<std::array<std::uint32_t, 3>>("SKTR");
  object.skin.layer = reader.section<std::uint16_t>("SKLA");
  object.tube.station = reader.section<double>("TUST");
  const auto ring_start = reader.section<std::uint32_t>("TURS");
  const auto ring_knots = reader.section<std::uint32_t>("TURK");
  reader.finish();
  if (ring_start.size() != object.tube.station.size() + 1 || ring_start.front() != 0 ||
      ring_start.back() != ring_knots.size()) {
    reader.fail("TURS", std::to_string(ring_start.size()) + " entries");
  }
  for (std::size_t i = 0; i + 1 < ring_start.size(); ++i) {
    if (ring_start[i + 1] < ring_start[i] || ring_start[i + 1] > ring_knots.size())
      reader.fail("TURS", "falls");
    object.tube.rings.emplace_back(ring_knots.begin() + ring_start[i],
                                   ring_knots.begin() + ring_start[i + 1]);
  }
}

std::string digits(std::uint64_t hash) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
  return text;
}

std::string hashText(const std::string& bytes) {
  return digits(XXH64(bytes.data(), bytes.size(), 0));
}

}  // namespace vest::scene
