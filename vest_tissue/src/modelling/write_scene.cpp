#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "../loader/loader_living.h"
#include "../loader/loader_sutures.h"
#include "text.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/files/replace.h"
#include "vest_tissue/fem/description.h"
#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/copy_parts.h"
#include "vest_tissue/modelling/layers.h"
#include "vest_tissue/scene/baked.h"

namespace vest::modelling {
namespace {

constexpr const char* kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-";

/// A folder below that of a scene. A link would lead out of it.
void makeFolder(const std::filesystem::path& path) {
  if (std::filesystem::is_symlink(path))
    throw std::runtime_error(path.string() + ": a link; allowed: a folder, or nothing that has this name");
  std::filesystem::create_directory(path);
}

/// Files of a folder, all of them or none.
class Files {
 public:
  explicit Files(std::string directory) : directory_(std::move(directory)) {
    std::error_code error;
    std::filesystem::create_directories(directory_, error);
  }
  ~Files() {
    for (const auto& name : names_) std::remove((directory_ + "/" + name + kNew).c_str());
  }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  void write(const std::string& name, const std::string& bytes) {
    const std::string path = directory_ + "/" + name;
    // Told before any file has its place: as for a tree of vessels that is named as the source.
    if (std::filesystem::is_directory(path))
      throw std::runtime_error(path + ": a folder has this name; allowed: another name, or another folder");
    names_.push_back(name);
    std::ofstream stream = files::replacing(path + kNew);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (!stream) throw std::runtime_error(path + ": cannot be written");
  }
  void finish() {
    for (const auto& name : names_) {
      const std::string path = directory_ + "/" + name;
      if (std::rename((path + kNew).c_str(), path.c_str()) != 0)
        throw std::runtime_error(path + ": cannot be written");
    }
    names_.clear();
  }

 private:
  static constexpr const char* kNew = ".new";
  std::string directory_;
  std::vector<std::string> names_;
};

/// A wall of layers: what the loader reads, and its two files.
std::string layersText(const scene::Object& object, Files& folder) {
  const fem::Description& d = *object.fem;
  std::string yaml = "    model: fem\n    strain: ";
  yaml += d.strain == fem::Strain::Small ? "small" : "corotational";
  if (d.start_in_equilibrium) yaml += "\n    start: equilibrium";
  yaml += "\n    mesh: " + object.name + ".msh\n    fixed: " + object.name + "_fixed.csv\n    materials:\n";
  for (std::size_t i = 0; i < d.materials.size(); ++i) {
    const fem::Material& m = d.materials[i];
    yaml += text("      - {label: %zu, youngs_modulus: %.10g, poisson_ratio: %.10g, density: %.10g}\n", i + 1,
                 m.youngs_modulus, m.poisson_ratio, m.density);
  }
  yaml += text("    rayleigh_mass: %.10g\n    rayleigh_stiffness: %.10g\n", d.material.rayleigh_mass,
               d.material.rayleigh_stiffness);
  yaml += text("    contact_thickness: %.10g\n", object.contact_thickness);
  if (object.full_contact) yaml += "    full_contact: true\n";
  if (object.puncture_force != scene::Object{}.puncture_force)
    yaml += text("    puncture_force: %.10g\n", object.puncture_force);
  yaml += scene::livingText(object);
  folder.write(object.name + ".msh", meshText(d.nodes, d.tetrahedra, d.cell_material));
  std::string fixed = "node\n";
  for (const fem::Index node : d.fixed) fixed += std::to_string(node) + "\n";
  folder.write(object.name + "_fixed.csv", fixed);
  return yaml;
}

}  // namespace

void writeScene(const scene::Description& description, const std::string& directory,
                const std::string& source_file, const std::string& source_bytes) {
  if (source_file == description.name + ".yaml")
    throw std::invalid_argument("name: " + description.name +
                                ": its scene file would take the place of its source " + source_file +
                                "; allowed: another name");
  if (source_file.find_first_not_of(kPlain) != std::string::npos || source_file[0] == '.')
    throw std::invalid_argument(files::shown(source_file) +
                                ": the name of a source; allowed: letters, digits, _ . -");
  if (description.objects.empty())
    throw std::invalid_argument(source_file +
                                ": objects: none; allowed: one or more where a scene is written");
  for (const auto& object : description.objects) {
    const bool layered = object.model == scene::ObjectModel::Fem && object.fem &&
                         !object.fem->materials.empty() && object.fem->loads.empty();
    if (object.fem && !layered) {
      throw std::invalid_argument(
          "object '" + object.name +
          "': model: fem or volume; allowed in scenes that are written: net, rigid, and walls of layers");
    }
    // What a reader would refuse is not written: it would stand there as half a scene.
    if (!object.fem) scene::checkObject(object, source_file);
  }
  scene::checkTogether(description, source_file);
  Files folder(directory);
  std::string yaml = "# Written by vest_model.\n";
  if (!source_file.empty())
    yaml = "# Written by vest_model bake from " + source_file + ": change that file and bake again.\n";
  yaml += "vest_scene: 1\nname: " + description.name + "\n";
  if (!source_file.empty()) yaml += "source: " + source_file + "\n";
  yaml += text("gravity: [%.10g, %.10g, %.10g]\n", description.gravity.x(), description.gravity.y(),
               description.gravity.z());
  yaml += text("seed: %u\nsolution: {integrator: newton_euler, dt: %.10g}\nobjects:\n", description.seed,
               description.dt);
  std::size_t all = 0;
  for (const auto& object : description.objects) {
    yaml += "  - name: " + object.name + "\n    organ: " + object.organ;
    if (!object.fem) yaml += "\n    material: " + object.material;
    yaml += "\n    roles: [";
    for (std::size_t i = 0; i < object.roles.size(); ++i) yaml += (i ? ", " : "") + object.roles[i];
    yaml += "]\n";
    if (object.fem) {
      yaml += layersText(object, folder);
      continue;
    }
    yaml += "    model: ";
    yaml += object.model == scene::ObjectModel::Rigid ? "rigid" : "net";
    yaml += "\n    baked: " + object.name + ".net\n";
    yaml +=
        text("    law: {youngs_modulus: %.10g, a2: %.10g, a3: %.10g, a4: %.10g, max_strain: %.10g}\n",
             object.law.youngs_modulus, object.law.a2, object.law.a3, object.law.a4, object.law.max_strain);
    yaml +=
        text("    density: %.10g\n    contact_thickness: %.10g\n", object.density, object.contact_thickness);
    if (object.model != scene::ObjectModel::Rigid) {
      if (object.full_contact) yaml += "    full_contact: true\n";
      if (object.puncture_force != scene::Object{}.puncture_force)
        yaml += text("    puncture_force: %.10g\n", object.puncture_force);
      if (object.wall_thickness > 0.0) yaml += text("    wall_thickness: %.10g\n", object.wall_thickness);
    }
    yaml += scene::livingText(object);
    if (!object.tube.vessel_segment.empty())
      yaml += "    vessel_segment: " + object.tube.vessel_segment + "\n";
    if (object.motility.active()) yaml += "    motility: " + scene::motilityText(object.motility) + "\n";
    const std::string net = scene::encodeBaked(object);
    if (net.size() > scene::kMostBaked || (all += net.size()) > scene::kMostBakedOfAll)
      throw std::invalid_argument(source_file + ": object " + object.name + ": its net has " +
                                  std::to_string(net.size()) + " bytes; allowed: at most " +
                                  std::to_string(scene::kMostBaked) + ", and of all objects " +
                                  std::to_string(scene::kMostBakedOfAll));
    folder.write(object.name + ".net", net);
  }
  if (!description.connections.empty()) {
    const auto indexOf = [&](const std::string& name) {
      std::size_t i = 0;
      while (description.objects[i].name != name) ++i;
      return i;
    };
    std::string csv =
        "object0,knot0,object1,t0,t1,t2,w0,w1,w2,offset_x,offset_y,offset_z,stiffness,damping,break_force\n";
    for (const auto& c : description.connections) {
      csv += text("%zu,%u,%zu,%u,%u,%u,%.6f,%.6f,%.6f,%.7f,%.7f,%.7f,%.6g,%.6g,%.6g\n", indexOf(c.object0),
                  c.knot0, indexOf(c.object1), c.triangle1[0], c.triangle1[1], c.triangle1[2], c.weights1[0],
                  c.weights1[1], c.weights1[2], c.offset.x(), c.offset.y(), c.offset.z(), c.stiffness,
                  c.damping, c.break_force);
    }
    const std::string name = description.name + "_connections.csv";
    folder.write(name, csv);
    yaml += "connections: " + name + "\n";
  }
  if (!description.vessels.empty()) yaml += "vessels:\n";
  for (const auto& tree : description.vessels) {
    yaml += "  - {case: " + tree.folder + ", supply: " + tree.supply + "}\n";
    makeFolder(directory + "/" + tree.folder);
    folder.write(tree.folder + "/case.json", tree.case_json);
    folder.write(tree.folder + "/network.csv", tree.network_csv);
    folder.write(tree.folder + "/inflow.csv", tree.inflow_csv);
  }
  yaml += scene::suturesText(description.sutures);
  folder.write(description.name + ".yaml", yaml);
  if (!source_bytes.empty()) folder.write(source_file, source_bytes);
  folder.finish();
}

void copyParts(const SceneSource& source, const std::string& from, const std::string& to) {
  namespace fs = std::filesystem;
  std::error_code none;
  for (const fs::path part : source.parts) {
    const fs::path file = fs::path(from) / part, copy = fs::path(to) / part;
    if (fs::equivalent(file, copy, none)) continue;
    fs::path folder = to;
    for (const fs::path& name : part.parent_path()) makeFolder(folder /= name);
    if (fs::is_symlink(copy)) fs::remove(copy);
    fs::copy_file(file, copy, fs::copy_options::overwrite_existing);
  }
}

}  // namespace vest::modelling
