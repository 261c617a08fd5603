#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <memory>

#include "readers.h"
#include "vest_bringup/simulation/stage.h"
#include "vest_effects/haemodynamics/model.h"
#include "vest_effects/haemodynamics/vessels.h"
#include "vest_instruments/files/read.h"

namespace vest::fuzz {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Effects around a scene, and snapshots of them: of each, the part that is the tissue's, and what stands
/// behind it, up to its checksum.
struct Staged {
  struct Kept {
    Bytes world;
    std::string effects;
  };
  simulation::Stage stage;
  scene::StepInput input;  ///< of every step
  std::vector<Kept> kept;

  Staged(const std::string& scene, const simulation::StageOptions& options,
         const simulation::StageFrames& frames = {}) {
    auto description = scene::loadScene(scene);
    description.cache_directory.clear();
    stage = simulation::makeStage(scene::World(description), options, frames);
  }
  void step(int count) {
    scene::StepReport report;
    for (int i = 0; i < count; ++i) {
      scene::StepInput now = input;
      now.step = stage.trainer->world().steps();
      stage.trainer->step(now, report);
      input.edits.clear();
    }
  }
  void keep() {
    Bytes all;
    stage.trainer->save(all);
    const auto size = static_cast<std::ptrdiff_t>(simulation::worldBytes(all));
    kept.push_back(
        {{all.begin(), all.begin() + size},
         {all.begin() + size, all.end() - 2 * sizeof(std::uint64_t) - simulation::kEffectsMagic.size()}});
  }
  /// These bytes in the place of the effects of a snapshot, and some steps where they are taken.
  void read(const Kept& of, const std::string& effects, int steps) {
    Bytes bytes = of.world;
    bytes.insert(bytes.end(), effects.begin(), effects.end());
    const std::uint64_t tail[] = {XXH64(effects.data(), effects.size(), 0), of.world.size()};
    const auto* const from = reinterpret_cast<const std::uint8_t*>(tail);
    bytes.insert(bytes.end(), from, from + sizeof tail);
    bytes.insert(bytes.end(), simulation::kEffectsMagic.begin(), simulation::kEffectsMagic.end());
    if (takes("snapshot", [&] { stage.trainer->restore(bytes); })) step(steps);
  }
};

/// Gas, blood and surfaces around an artery that bleeds.
Staged& bleeding() {
  static Staged of_all = [] {
    simulation::StageOptions options;
    options.field = false;
    options.blood.dx = 0.02;
    options.blood.vessels = std::string(VEST_SOURCE_DIR) + "/vest_effects/data/vessels/pelvis";
    Staged made(std::string(VEST_SOURCE_DIR) + "/vest_tissue/scenes/arterial_bleeding/arterial_bleeding.yaml",
                options);
    for (const auto& object : made.stage.trainer->world().description().objects)
      if (!object.tube.vessel_segment.empty())
        made.input.edits = {{object.name, "opening_station", 0.02}, {object.name, "opening_area", 1e-6}};
    made.step(8);
    made.keep();
    return made;
  }();
  return of_all;
}

/// Fluid, smoke and lens over a plate, which is irrigated, wiped, coagulated and looked at: just before each
/// of them makes its step, and what is shown is written.
Staged& field() {
  constexpr int kAll = 1200;  ///< steps: of each of their steps a multiple (operating_field.cpp)
  static Staged of_all = [] {
    simulation::StageOptions options;
    options.haemodynamics = false;
    fluid::Parameters& fluid = options.field_options.fluid;
    fluid.capacity = 48, fluid.spacing = 0.004, fluid.pool_cell = 0.006;
    fluid.low = {-0.01, -0.01, -0.01}, fluid.high = {0.04, 0.03, 0.10};
    smoke::Parameters& smoke = options.field_options.smoke;
    smoke.low = {-0.04, -0.04, 0.0}, smoke.high = {0.06, 0.06, 0.10}, smoke.cell = 0.03;
    simulation::StageFrames frames;
    frames.field = std::make_shared<simulation::FieldFrames>();
    // Large cells: what is read here is not the tissue's.
    std::string scene = files::read(std::string(VEST_SOURCE_DIR) + "/fuzz/corpus/scene/plate", 1 << 20);
    const std::string cell = "cell: 0.004";
    scene.replace(scene.find(cell), cell.size(), "cell: 0.008");
    Staged made(folder().unpack("scene.yaml", scene), options, frames);
    const auto hold = [&](tools::Instrument hand, tools::ToolKind kind, const Eigen::Vector3d& tip,
                          std::uint32_t functions) {
      scene::ToolInput& tool = made.input.tools[static_cast<std::size_t>(hand)];
      tool.present = true, tool.tool = kind, tool.functions = functions;
      tool.position = tip, tool.pivot = tip + Eigen::Vector3d(0, 0, 0.15);
      tool.orientation =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ());
    };
    using tools::Instrument;
    using tools::ToolKind;
    hold(Instrument::Endoscope, ToolKind::Endoscope, {0.016, 0.006, 0.06}, 0);
    hold(Instrument::Left, ToolKind::SuctionIrrigator, {0.012, 0.006, 0.03}, tools::kFunctionIrrigate);
    hold(Instrument::Right, ToolKind::CoagulationHook, {0.020, 0.006, 0.0035}, tools::kFunctionCoagulate);
    made.step(kAll - 1);
    made.keep();
    hold(Instrument::Endoscope, ToolKind::Endoscope, {0.016, 0.006, 0.02}, tools::kFunctionIrrigate);
    hold(Instrument::Left, ToolKind::SuctionIrrigator, {0.012, 0.006, 0.006}, tools::kFunctionSuck);
    hold(Instrument::Right, ToolKind::Swab, {0.018, 0.006, 0.004}, 0);
    made.step(kAll);
    made.keep();
    hold(Instrument::Left, ToolKind::SuctionIrrigator, {0.012, 0.006, 0.010},
         tools::kFunctionIrrigate | tools::kFunctionSuck);
    return made;
  }();
  return of_all;
}

constexpr int kFieldSteps = 6;  ///< to the next step of all of it, and one of the fluid more

/// 'b' and the effects of the bleeding, or a digit, a snapshot of the field, and those of the field.
void readEffects(const std::string& input) {
  if (input.empty()) return;
  if (input[0] == 'b') return bleeding().read(bleeding().kept[0], input.substr(1), 4);
  Staged& f = field();
  f.read(f.kept[static_cast<unsigned char>(input[0]) % f.kept.size()], input.substr(1), kFieldSteps);
}

std::vector<std::string> effects() {
  std::vector<std::string> made{"b" + bleeding().kept[0].effects};
  for (std::size_t i = 0; i < field().kept.size(); ++i)
    made.push_back(static_cast<char>('0' + i) + field().kept[i].effects);
  return made;
}

/// First byte: which snapshot of the field; each eight more: where in its effects another number comes, and
/// which. Nothing else is changed, so that nearly all are read to their end.
void readField(const std::string& input) {
  constexpr std::size_t kChange = 8, kMost = 6;
  Staged& f = field();
  if (input.size() < 1 + kChange) return;
  const Staged::Kept& of = f.kept[static_cast<unsigned char>(input[0]) % f.kept.size()];
  std::string effects = of.effects;
  for (std::size_t n = 0; n < kMost && 1 + (n + 1) * kChange <= input.size(); ++n) {
    std::uint32_t place = 0;
    std::uint8_t type = 0, choice = 0;
    const char* const from = input.data() + 1 + n * kChange;
    std::memcpy(&place, from, sizeof place);
    std::memcpy(&type, from + 4, 1), std::memcpy(&choice, from + 5, 1);
    const auto change = [&](auto is, auto next) {
      if (effects.size() < sizeof is) return;
      char* const at = effects.data() + place % (effects.size() - sizeof is + 1);
      std::memcpy(&is, at, sizeof is);
      is = next(is);
      std::memcpy(at, &is, sizeof is);
    };
    const double numbers[] = {0.0, 1.0, -1.0, 1e-30, 1e5, -1e5, 1e9, 1e18, 1e30, 1e300, 0.5, 1e-3};
    const std::uint64_t counts[] = {0,         1, 2, 255, 1u << 16, 0x7fffffff, 0xffffffff, ~std::uint64_t{0},
                                    1ull << 63};
    const double number = numbers[choice % std::size(numbers)];
    const std::uint64_t count = counts[choice % std::size(counts)];
    switch (type % 5) {
      case 0:
        change(0.0f, [&](float) { return static_cast<float>(std::min(number, 3e38)); });
        break;
      case 1:
        change(0.0f, [&](float is) { return is * (choice % 2 == 0 ? -1.0f : 1e3f); });
        break;
      case 2:
        change(0.0, [&](double) { return number; });
        break;
      case 3:
        change(std::uint64_t{0}, [&](std::uint64_t) { return count; });
        break;
      default:
        change(std::uint8_t{0}, [&](std::uint8_t) { return choice; });
    }
  }
  f.read(of, effects, kFieldSteps);
}

/// Of each snapshot many, counted through.
std::vector<std::string> fields() {
  std::vector<std::string> made;
  std::uint64_t number = 0;
  for (std::size_t n = 0; n < field().kept.size(); ++n)
    for (int k = 0; k < 64; ++k, ++number) {
      made.emplace_back(1, static_cast<char>(n));
      for (std::uint64_t word = 0; word < 3; ++word) {
        const std::uint64_t bits = XXH64(&number, sizeof number, word);
        made.back().append(reinterpret_cast<const char*>(&bits), sizeof bits);
      }
    }
  return made;
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
  return {{"network", network, pelvis}, {"effects", readEffects, effects}, {"field", readField, fields}};
}

}  // namespace vest::fuzz
