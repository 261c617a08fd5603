#include <xxhash.h>

#include <cstring>

#include "readers.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_effects/haemodynamics/model.h"
#include "vest_effects/haemodynamics/vessels.h"
#include "vest_instruments/files/read.h"

namespace vest::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Gas, blood and surfaces around an artery that bleeds, and a snapshot of them.
struct Bleeding {
  simulation::Stage stage;
  Bytes world;          ///< the snapshot's part that is the tissue's
  std::string effects;  ///< and what stands behind it, up to its checksum

  Bleeding() {
    simulation::StageOptions options;
    options.field = false;
    options.blood.dx = 0.02;
    options.blood.vessels = std::string(VEST_SOURCE_DIR) + "/vest_effects/data/vessels/pelvis";
    stage = simulation::makeStage(
        scene::World(scene::loadScene(std::string(VEST_SOURCE_DIR) +
                                      "/vest_tissue/scenes/arterial_bleeding/arterial_bleeding.yaml")),
        options);
    scene::StepInput opens;
    for (const auto& object : stage.trainer->world().description().objects)
      if (!object.tube.vessel_segment.empty())
        opens.edits = {{object.name, "opening_station", 0.02}, {object.name, "opening_area", 1e-6}};
    step(opens, 8);
    Bytes all;
    stage.trainer->save(all);
    const auto size = static_cast<std::ptrdiff_t>(simulation::worldBytes(all));
    world.assign(all.begin(), all.begin() + size);
    effects.assign(all.begin() + size,
                   all.end() - 2 * sizeof(std::uint64_t) - simulation::kEffectsMagic.size());
  }
  void step(scene::StepInput input, int count) {
    scene::StepReport report;
    for (int i = 0; i < count; ++i) {
      scene::StepInput now = input;
      now.step = stage.trainer->world().steps();
      stage.trainer->step(now, report);
      input.edits.clear();
    }
  }
};
Bleeding& bleeding() {
  static Bleeding of_all;
  return of_all;
}

/// The effects' part of a snapshot, without the checksum, which is put behind it.
void readEffects(const std::string& input) {
  Bleeding& b = bleeding();
  Bytes bytes = b.world;
  bytes.insert(bytes.end(), input.begin(), input.end());
  const std::uint64_t tail[] = {XXH64(input.data(), input.size(), 0), b.world.size()};
  const auto* const from = reinterpret_cast<const std::uint8_t*>(tail);
  bytes.insert(bytes.end(), from, from + sizeof tail);
  bytes.insert(bytes.end(), simulation::kEffectsMagic.begin(), simulation::kEffectsMagic.end());
  if (takes("snapshot", [&] { b.stage.trainer->restore(bytes); })) b.step({}, 4);
}

}  // namespace

std::vector<Reader> effectsReaders() {
  static Folder folder;
  // case.json, then network.csv, inflow.csv and vessels.yaml.
  const auto network = [](const std::string& input) {
    folder.unpack("case.json", input);
    haemodynamics::Network read;
    if (!takes(folder.path(), [&] { read = haemodynamics::readCase(folder.path()); })) return;
    takes(folder.path(), [&] { haemodynamics::buildModel(read, 0.01); });
    takes(folder.path(), [] { haemodynamics::readVessels(folder.path()); });
  };
  const auto pelvis = [] {
    const std::string at = std::string(VEST_SOURCE_DIR) + "/vest_effects/data/vessels/pelvis/";
    std::string all = files::read(at + "case.json", 1 << 20);
    for (const char* name : {"network.csv", "inflow.csv", "vessels.yaml"})
      all += std::string("\n=== ") + name + "\n" + files::read(at + name, 1 << 20);
    return std::vector<std::string>{all};
  };
  return {{"network", network, pelvis},
          {"effects", readEffects, [] { return std::vector<std::string>{bleeding().effects}; }}};
}

}  // namespace vest::fuzz
