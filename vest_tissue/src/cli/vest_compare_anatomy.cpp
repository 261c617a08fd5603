#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>

#include "surface_distance.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/refusal.h"
#include "vest_tissue/net/skin.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/volume/mesh_file.h"

namespace {

using vest::tools::Surface;

Surface readMesh(const std::string& path) try {
  vest::volume::Surface mesh = vest::volume::readSurface(path, vest::files::read(path, 64u << 20));
  return {std::move(mesh.vertices), std::move(mesh.triangles)};
} catch (const std::invalid_argument& error) {
  throw std::invalid_argument(vest::files::refusal(error.what(), path));
}

void append(const Surface& part, Surface& whole) {
  const auto base = static_cast<std::uint32_t>(whole.points.size());
  whole.points.insert(whole.points.end(), part.points.begin(), part.points.end());
  for (const auto& t : part.triangles) whole.triangles.push_back({base + t[0], base + t[1], base + t[2]});
}

Surface skinOf(const vest::scene::Object& object) {
  Surface surface;
  std::vector<float> knots;
  for (const auto& p : object.position)
    for (int k = 0; k < 3; ++k) knots.push_back(static_cast<float>(p[k]));
  const std::size_t vertices = object.skin.texture_coordinates.size();
  std::vector<float> skin(3 * vertices);
  vest::net::rebuildSkin(knots.data(), object.skin.binding_start.data(), object.skin.binding_knots.data(),
                         object.skin.binding_weights.data(), vertices, skin.data());
  for (std::size_t v = 0; v < vertices; ++v)
    surface.points.emplace_back(skin[3 * v], skin[3 * v + 1], skin[3 * v + 2]);
  surface.triangles.assign(object.skin.triangles.begin(), object.skin.triangles.end());
  return surface;
}

/// What cannot be sampled evenly is refused by name: points without a surface between them, or of another
/// unit.
void check(const Surface& surface, const std::string& name) {
  constexpr double kFar = 10, kLeast = 1e-9;  // m, m² (assumed)
  double area = 0;
  for (const auto& t : surface.triangles)
    area += 0.5 * (surface.points[t[1]] - surface.points[t[0]])
                      .cross(surface.points[t[2]] - surface.points[t[0]])
                      .norm();
  bool near = true;
  for (const auto& p : surface.points) near = near && p.cwiseAbs().maxCoeff() <= kFar;
  if (near && area >= kLeast) return;
  throw std::invalid_argument(name +
                              (near ? ": has no area" : ": a vertex is further than 10 m from the origin") +
                              "; allowed: at least 1e-9 m², within 10 m");
}

// Which reference files make which organ; patient's left is -x of the box.
struct Organ {
  const char* object;
  std::vector<const char*> files;
};
const std::vector<Organ> kOrgans = {
    {"uterus", {"VH_F_body_of_uterus", "VH_F_fundus_of_uterus", "VH_F_cervix"}},
    {"ovary_left", {"VH_F_left_ovary"}},
    {"ovary_right", {"VH_F_right_ovary"}},
    {"tube_left", {"VH_F_isthmus_of_fallopian_tube_L", "VH_F_ampulla_of_uterine_tube_L"}},
    {"tube_right", {"VH_F_ampulla_of_uterine_tube_R"}}};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Mean surface distance between a scene's organs and reference meshes after one rigid fit of all "
      "together.");
  std::string reference, scene_path = vest::tools::defaultScene();
  double limit = 8.0;
  app.add_option("--reference", reference, "folder with the reference meshes (VH_F_*.obj, metres)")
      ->required();
  app.add_option("--limit", limit, "mm; larger mean distances make the exit status 1")
      ->check(vest::files::number(0, 1e6))
      ->capture_default_str();
  app.add_option("SCENE", scene_path, "scene.yaml")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    const auto description = vest::scene::loadScene(scene_path);
    std::vector<Surface> ours, theirs;
    Surface all_ours, all_theirs;
    std::vector<std::string> names;
    for (const Organ& organ : kOrgans) {
      const auto object = std::find_if(description.objects.begin(), description.objects.end(),
                                       [&](const auto& o) { return o.name == organ.object; });
      if (object == description.objects.end())
        throw std::invalid_argument(scene_path + ": objects: has no " + std::string(organ.object));
      Surface whole;
      std::size_t found = 0;
      for (const char* file : organ.files) {
        const std::string path = reference + "/" + file + ".obj";
        if (!std::filesystem::exists(path)) continue;
        const Surface mesh = readMesh(path);
        check(mesh, path);
        append(mesh, whole);
        ++found;
      }
      if (found == 0) {
        std::printf("%-12s no reference mesh, left out\n", organ.object);
        continue;
      }
      // Body axes (left, cranial, ventral) to the box (right, caudal, ventral); the place is found by the
      // fit.
      for (auto& p : whole.points) p = Eigen::Vector3d(-p.x(), -p.y(), p.z());
      ours.push_back(skinOf(*object));
      check(ours.back(), scene_path + ": the skin of " + organ.object);
      theirs.push_back(whole);
      append(ours.back(), all_ours);
      append(whole, all_theirs);
      names.push_back(organ.object);
    }
    if (names.empty()) throw std::invalid_argument(reference + ": holds none of the reference meshes");
    const Eigen::Isometry3d fit = vest::tools::rigidFit(all_theirs, all_ours);
    const Eigen::AngleAxisd turn(fit.rotation());
    std::printf("rigid fit: shift %.1f %.1f %.1f mm, turn %.2f deg\n", 1000 * fit.translation().x(),
                1000 * fit.translation().y(), 1000 * fit.translation().z(),
                turn.angle() * 180 / 3.14159265358979);
    std::printf("%-12s %14s %14s %10s  (mm, mean surface distance)\n", "organ", "ours->ref", "ref->ours",
                "both");
    bool good = true;
    for (std::size_t i = 0; i < names.size(); ++i) {
      for (auto& p : theirs[i].points) p = fit * p;
      const double there = 1000 * vest::tools::meanDistance(ours[i], theirs[i]);
      const double back = 1000 * vest::tools::meanDistance(theirs[i], ours[i]);
      std::printf("%-12s %14.2f %14.2f %10.2f\n", names[i].c_str(), there, back, 0.5 * (there + back));
      good = good && there <= limit && back <= limit;
    }
    std::printf("%s: limit %.1f mm\n", good ? "within" : "NOT within", limit);
    return good ? 0 : 1;
  } catch (const std::exception& error) {
    std::fflush(stdout);
    std::fprintf(stderr, "vest_compare_anatomy: %s\n", vest::files::shown(error.what(), 6000).c_str());
    return 2;
  }
}
