#include "loader_image.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "vest_tissue/base/elementary.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/scene/spread_texture.h"
#include "vest_tissue/volume/feel.h"
#include "vest_tissue/volume/lattice.h"
#include "vest_tissue/volume/phantom.h"

namespace vest::scene {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using yaml::Map;
using yaml::Value;

constexpr std::size_t kMostPictured = std::size_t{32} << 20;  // 64 MB of 16 bits
constexpr double kSurfaceCell = 0.002;                        // m, of the shapes that are drawn

/// What the scene says of a part of the image.
struct Region {
  std::string name, organ;
  std::vector<std::string> roles;
  double low = 1, high = 0;  ///< values that it has, where no label says it
  int label = -1;            ///< of the phantom
  double capsule = 0;        ///< N
  bool drawn = false;
};

/// The picture, and which region each place is of.
struct Picture {
  volume::Brick brick;
  volume::Phantom phantom;
  volume::PhantomBlock block;
  bool made = false;  ///< of the phantom
};

Matrix3d turned(Map& map) {
  const std::string lies = map.has("lies") ? map["lies"].oneOf({"supine", "prone"}) : "supine";
  const double turns = map.has("turn") ? map["turn"].number(-360, 360) / 360 : 0.0;
  const double s = base::sineOfTurns(turns), c = base::sineOfTurns(turns + 0.25);
  const Matrix3d about_z = (Matrix3d() << c, -s, 0, s, c, 0, 0, 0, 1).finished();
  return about_z * (lies == "prone" ? volume::prone() : volume::supine());
}

Picture phantomOf(Map& map) {
  Picture p;
  p.made = true;
  const Value& name = map["phantom"];
  p.phantom = volume::makePhantom(name.oneOf({"head", "lumbar", "abdomen"}));
  p.block.low = map.has("low") ? map["low"].vector3() : p.phantom.low;
  p.block.high = map.has("high") ? map["high"].vector3() : p.phantom.high;
  if (map.has("spacing")) p.block.spacing = map["spacing"].number(1e-4, 0.1);
  if (map.has("noise")) p.block.noise = map["noise"].number(0, 1000);
  p.block.turn = turned(map);
  if (map.has("place")) p.block.shift = map["place"].vector3();
  double voxels = 1;
  for (int a = 0; a < 3; ++a) voxels *= std::round((p.block.high[a] - p.block.low[a]) / p.block.spacing);
  if (!((p.block.high - p.block.low).minCoeff() > p.block.spacing) || !(voxels <= kMostPictured))
    (map.has("high") ? map["high"] : name).fail("must be above low, and make at most 33554432 voxels");
  p.brick = volume::picture(p.phantom, p.block);
  return p;
}

Picture fileOf(Map& map, const ReadFile& read) {
  Picture p;
  volume::Brick& b = p.brick;
  const auto sizes = map["size"].list();
  if (sizes.size() != 3) map["size"].fail("must be 3 whole numbers: voxels along i, j, k");
  std::size_t count = 1;
  for (std::size_t a = 0; a < 3; ++a) count *= b.size[a] = sizes[a].integer(1, 4096);
  if (count > kMostPictured) map["size"].fail("must make at most 33554432 voxels");
  const auto rows = map["axes"].list();
  if (rows.size() != 3)
    map["axes"].fail("must be 3 rows of 3 numbers; its columns are steps along i, j, k, m");
  for (int a = 0; a < 3; ++a) b.axes.row(a) = rows[static_cast<std::size_t>(a)].vector3().transpose();
  if (!(std::abs(b.axes.determinant()) > 1e-15)) map["axes"].fail("must span a volume");
  b.origin = map["origin"].vector3();
  if (map.has("unit")) b.unit = map["unit"].name();
  if (map.has("slope")) b.slope = map["slope"].number(-1e9, 1e9);
  if (map.has("intercept")) b.intercept = map["intercept"].number(-1e9, 1e9);
  if (b.slope == 0) map["slope"].fail("must not be 0");
  std::string path;
  const std::string bytes = read(map["file"], path);
  if (bytes.size() != 2 * count)
    map["file"].fail("must have " + std::to_string(2 * count) +
                     " bytes (size × int16, little-endian); it has " + std::to_string(bytes.size()));
  b.stored.resize(count);
  for (std::size_t i = 0; i < count; ++i)
    b.stored[i] = static_cast<std::int16_t>(static_cast<std::uint8_t>(bytes[2 * i]) |
                                            static_cast<std::uint8_t>(bytes[2 * i + 1]) << 8);
  return p;
}

Region readRegion(const Value& value, const Picture& picture) {
  Map map(value);
  Region r;
  r.name = map["name"].name();
  r.organ = map.has("organ") ? map["organ"].name() : r.name;
  if (map.has("roles"))
    for (const Value& role : map["roles"].list()) r.roles.push_back(role.name());
  if (map.has("capsule")) r.capsule = map["capsule"].number(0, 1000);
  if (map.has("drawn")) r.drawn = map["drawn"].boolean();
  if (map.has("values")) {
    const auto ends = map["values"].list();
    if (ends.size() != 2) map["values"].fail("must be [least, greatest]");
    r.low = ends[0].number(-1e9, 1e9), r.high = ends[1].number(r.low, 1e9);
  } else {
    const auto& labels = picture.phantom.labels;
    const auto found = std::find(labels.begin(), labels.end(), r.name);
    if (found == labels.end()) {
      std::string known;
      for (const std::string& l : labels) known += (known.empty() ? "" : ", ") + l;
      map["name"].fail(picture.made ? "must be a part of the phantom (" + known + "), or have values"
                                    : "must have values: [least, greatest]");
    }
    r.label = static_cast<int>(found - labels.begin()) + 1;
  }
  map.finish();
  return r;
}

/// An object that nothing touches: a name for events, and a shape to be looked at.
Object objectOf(const Region& region, std::uint8_t number, const voxel::Volume& felt) {
  const auto& h = felt.header;
  volume::LabelledImage image;
  image.size = {h.size[0], h.size[1], h.size[2]};
  image.spacing = Vector3d::Constant(felt.spacing);
  for (int a = 0; a < 3; ++a) image.origin[a] = -h.to_grid[a][3] * felt.spacing;
  image.labels.resize(felt.region.size());
  Vector3d middle = Vector3d::Zero();
  std::size_t count = 0, v = 0;
  for (std::uint32_t k = 0; k < h.size[2]; ++k)
    for (std::uint32_t j = 0; j < h.size[1]; ++j)
      for (std::uint32_t i = 0; i < h.size[0]; ++i, ++v) {
        if (felt.region[v] != number) continue;
        image.labels[v] = 1;
        middle += Vector3d(i, j, k);
        ++count;
      }
  middle = image.origin + felt.spacing * middle / static_cast<double>(std::max<std::size_t>(count, 1));
  Object o;
  o.name = region.name;
  o.organ = o.material = region.organ;
  o.roles = region.roles;
  o.model = ObjectModel::Rigid;
  o.law.youngs_modulus = 1e5;  // nothing asks for it
  volume::Surface surface;
  if (region.drawn && count > 0) surface = volume::surfaceOf(image, kSurfaceCell);
  if (surface.vertices.empty()) surface.vertices = {middle};
  o.rest_position = o.position = surface.vertices;
  o.mass.assign(o.position.size(), 1e-3);
  o.damping.assign(o.position.size(), 0.0);
  o.fixed.assign(o.position.size(), 1);
  if (surface.triangles.empty()) return o;
  Skin& skin = o.skin;
  for (std::uint32_t n = 0; n <= o.position.size(); ++n) skin.binding_start.push_back(n);
  for (std::uint32_t n = 0; n < o.position.size(); ++n) {
    skin.binding_knots.push_back(n);
    skin.binding_weights.push_back(1.0f);
    skin.texture_coordinates.push_back({});
  }
  skin.triangles = surface.triangles;
  spreadTexture(o.position, Vector3d::UnitZ(), &skin);
  skin.layer.assign(skin.triangles.size(), 0);
  return o;
}

}  // namespace

void readFeltImage(const Value& value, const ReadFile& read, Description& description) {
  Map map(value);
  map.only({"phantom",
            "low",
            "high",
            "spacing",
            "noise",
            "lies",
            "turn",
            "place",
            "file",
            "size",
            "axes",
            "origin",
            "unit",
            "slope",
            "intercept",
            "table",
            "smoothing",
            "surface",
            "needle_stiffness",
            "full_force",
            "regions"});
  if (map.has("phantom") == map.has("file")) value.fail("must have one of phantom, file");
  for (const char* key : {"low", "high", "spacing", "noise", "lies", "turn", "place"})
    if (map.has(key) && !map.has("phantom")) map[key].fail("belongs to phantom");
  for (const char* key : {"size", "axes", "origin", "unit", "slope", "intercept"})
    if (map.has(key) && !map.has("file")) map[key].fail("belongs to file");
  Picture picture = map.has("phantom") ? phantomOf(map) : fileOf(map, read);
  std::string path;
  const std::string bytes = read(map["table"], path);
  const volume::TransferTable table = volume::readTransferTable(path, bytes);
  volume::FeelOptions o;
  if (map.has("smoothing")) o.smoothing = map["smoothing"].number(0.0005, 0.004);
  if (map.has("surface")) o.surface = map["surface"].number(-1e9, 1e9);
  if (map.has("needle_stiffness")) o.needle_stiffness = map["needle_stiffness"].number(1, 1e5);
  if (map.has("full_force")) o.full = map["full_force"].number(0.1, 100);
  std::vector<Region> regions;
  if (map.has("regions")) {
    for (const Value& item : map["regions"].list()) {
      regions.push_back(readRegion(item, picture));
      const auto taken = [&](const std::string& name) { return name == regions.back().name; };
      for (std::size_t r = 0; r + 1 < regions.size(); ++r)
        if (taken(regions[r].name)) Map(item)["name"].fail("must be there once");
      for (const Object& object : description.objects)
        if (taken(object.name)) Map(item)["name"].fail("must be there once, also among the objects");
    }
    if (regions.size() >= voxel::kMostRegions) map["regions"].fail("must be at most 31");
  }
  map.finish();
  for (const Region& r : regions) o.capsules.push_back(r.capsule);
  o.region = [&](const Vector3d& place, double number) {
    const volume::Shape* const shape =
        picture.made ? picture.phantom.at(picture.block.toPatient(place)) : nullptr;
    for (std::size_t r = 0; r < regions.size(); ++r) {
      const bool in = regions[r].label >= 0 ? shape != nullptr && shape->label == regions[r].label
                                            : number >= regions[r].low && number <= regions[r].high;
      if (in) return static_cast<std::uint8_t>(r + 1);
    }
    return std::uint8_t{0};
  };
  try {
    description.feel = volume::makeFeelable(picture.brick, table, o);
  } catch (const std::invalid_argument& error) {
    map["table"].fail(error.what());
  }
  description.image = std::make_shared<const volume::Brick>(std::move(picture.brick));
  for (std::size_t r = 0; r < regions.size(); ++r) {
    description.regions.push_back(static_cast<std::uint16_t>(description.objects.size()));
    description.objects.push_back(objectOf(regions[r], static_cast<std::uint8_t>(r + 1), *description.feel));
    checkObject(description.objects.back(), value.file());
  }
}

}  // namespace vest::scene
