#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <tuple>

#include "../vest_tissue/src/scene/state_archives.h"
#include "readers.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/scene/world.h"

/// Snapshots: with any bytes changed, and with members of the State changed to what their limits allow.
namespace vest::fuzz {
namespace {

using scene::Limits;

struct Handled {
  std::unique_ptr<scene::World> world;
  Eigen::Vector3d place;           ///< m: where instruments find something
  Eigen::Vector3d along, opening;  ///< shaft, and where jaws open to
};

/// A net beside finite elements; a solid in its skin; one that is thin enough for jaws; a thread with its
/// needle.
std::vector<Handled>& worlds() {
  static std::vector<Handled> all = [] {
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), z = Eigen::Vector3d::UnitZ();
    struct Scene {
      const char* name;
      Eigen::Vector3d place, along, opening;
    };
    std::vector<Handled> made;
    for (const Scene& s :
         {Scene{"two", {0.01, 0.01, 0.06}, -z, x}, Scene{"surface", {0.01, 0.01, 0.02}, -z, x},
          Scene{"plate", {0.016, 0.006, 0.002}, -x, z}, Scene{"suture", {0.01, 0.01, 0.08}, -z, x}}) {
      const std::string file = folder().unpack(
          "scene.yaml", files::read(std::string(VEST_SOURCE_DIR) + "/fuzz/corpus/scene/" + s.name, 1 << 20));
      auto d = scene::loadScene(file);
      d.cache_directory.clear();
      made.push_back({std::make_unique<scene::World>(d), s.place, s.along, s.opening});
    }
    return made;
  }();
  return all;
}
/// The one that a snapshot says it is of, else the first.
Handled& worldOf(const std::string& snapshot) {
  constexpr std::size_t kHash = 16;  // behind "vestsna." and the length of the hash
  for (Handled& one : worlds()) {
    const std::string& hash = one.world->description().hash;
    if (snapshot.size() > kHash && snapshot.compare(kHash, hash.size(), hash) == 0) return one;
  }
  return worlds().front();
}

/// An instrument comes open, closes, and draws back.
void handle(Handled& one, tools::ToolKind kind, int steps) {
  scene::StepInput input;
  scene::StepReport report;
  input.dt = one.world->description().dt;
  scene::ToolInput& tool = input.tools[1];
  tool.present = true, tool.tool = kind, tool.pivot = one.place - 0.15 * one.along;
  Eigen::Matrix3d turn;
  turn << one.opening, one.along.cross(one.opening), one.along;
  tool.orientation = Eigen::Quaterniond(turn);
  tool.functions = tools::kFunctionCut | tools::kFunctionCoagulate;
  for (int i = 0; i < steps; ++i) {
    const double t = static_cast<double>(i) / steps;
    input.step = one.world->steps() + 1;
    tool.jaw = 0.9 * std::clamp(2.0 - 4 * t, 0.0, 1.0);
    if (t > 0.75) tool.functions |= tools::kFunctionFire;
    tool.position = one.place + (0.004 - 0.02 * std::max({0.0, 1 - 4 * t, 0.4 * (4 * t - 3)})) * one.along;
    one.world->step(input, report);
  }
}

/// False: refused.
bool restored(scene::World& world, std::vector<std::uint8_t> bytes) {
  const std::uint64_t sum = XXH64(bytes.data(), bytes.size(), 0);
  bytes.resize(bytes.size() + sizeof sum);
  std::memcpy(bytes.data() + bytes.size() - sizeof sum, &sum, sizeof sum);
  return takes("snapshot", [&] { world.restore(bytes); });
}

/// The inputs are snapshots without the checksum, which is put behind them, so that what lies below it is
/// reached.
void readSnapshot(const std::string& input) {
  Handled& one = worldOf(input);
  if (!restored(*one.world, {input.begin(), input.end()})) return;
  step(*one.world, 2);
  handle(one, tools::ToolKind::Grasper, 2);
  std::vector<std::uint8_t> again;
  one.world->save(again);
}

/// Of each world: as it begins, with what was asked of it, and while each instrument in turn is at work.
std::vector<std::string> snapshots() {
  using tools::ToolKind;
  std::vector<std::string> made;
  for (Handled& one : worlds()) {
    scene::World& of = *one.world;
    const auto keep = [&] {
      std::vector<std::uint8_t> bytes;
      of.save(bytes);
      made.emplace_back(bytes.begin(), bytes.end() - sizeof(std::uint64_t));
    };
    of.reset();
    keep();
    for (const ToolKind kind : {ToolKind::Grasper, ToolKind::ClipApplier, ToolKind::NeedleHolder,
                                ToolKind::BipolarForceps, ToolKind::CoagulationHook, ToolKind::Scissors}) {
      handle(one, kind, 120);
      keep();
    }
    of.reset();
    step(of, 5);
    std::uint32_t copy = 0;
    for (std::size_t object = 0; object < of.objectCount(); ++object)
      of.splitKnot(object, 1, Eigen::Vector3d(1, 0.1, 0.2), copy);
    of.removeLink(0, 2);
    step(of, 2);
    keep();
  }
  return made;
}

/// Members of a State, in the order of the walk. What is allowed of one, its type, and those of the three
/// before it tell it from others.
using Kind = std::tuple<const char*, double, double, bool, std::array<std::size_t, 4>>;

struct Lister : scene::Archive {
  std::map<Kind, std::vector<std::size_t>>& kinds;
  std::size_t number = 0;
  std::array<std::size_t, 4> types{};

  template <class T>
  void values(const T*, std::size_t, const Limits& l) {
    visited(sizeof(T) + (std::is_floating_point_v<T> ? 16 : std::is_same_v<T, bool> ? 32 : 0), l);
  }
  void count(std::size_t, std::size_t, const Limits& l) { visited(0, l); }

 private:
  void visited(std::size_t type, const Limits& l) {
    types = {type, types[0], types[1], types[2]};
    kinds[{l.what, l.least, l.most, l.below == scene::kAny, types}].push_back(number++);
  }
};

/// Changes one member to what is likely to be allowed of it.
struct Changer : scene::Archive {
  std::size_t wanted, entry;  ///< number in the walk; of an array
  std::uint8_t choice;
  std::size_t number = 0;

  template <class T>
  void values(T* v, std::size_t n, const Limits& l) {
    if (number++ != wanted || n == 0) return;
    T& of = v[entry % n];
    if constexpr (std::is_same_v<T, bool>) {
      of = !of;
    } else if constexpr (std::is_floating_point_v<T>) {
      const auto is = static_cast<double>(of);
      const double to[] = {0.0, -is,   l.least, l.most, 1e3 * is, 1e-30,
                           1.0, -1e30, 1e30,    1e18,   2.0,      std::numeric_limits<double>::quiet_NaN()};
      const double most = std::numeric_limits<T>::max(), is_now = to[choice % std::size(to)];
      of = static_cast<T>(std::isnan(is_now) ? is_now : std::clamp(is_now, -most, most));
    } else {
      const std::size_t below = l.below == scene::kAny ? 256 : std::max<std::size_t>(1, l.below),
                        is = static_cast<std::size_t>(of);
      const std::size_t to[] = {0,      below - 1, entry / 7 % below, interaction::kNone,  below / 2,
                                is + 1, is ^ 1,    ~std::size_t{0},   std::size_t{1} << 31};
      of = static_cast<T>(to[choice % std::size(to)]);
    }
  }
  void count(std::size_t& n, std::size_t, const Limits&) {
    if (number++ != wanted) return;
    const std::size_t to[] = {0, n + 1, n - std::min<std::size_t>(n, 1), 2 * n, n + 8};
    n = to[choice % std::size(to)];
  }
};

struct Kept {
  Handled* of;
  scene::WorldState state;
  std::vector<std::vector<std::size_t>> members;  ///< numbers in the walk, of each kind
};
const std::vector<Kept>& kept() {
  static const std::vector<Kept> all = [] {
    std::vector<Kept> made;
    for (const std::string& s : snapshots()) {
      Handled& of = worldOf(s);
      restored(*of.world, {s.begin(), s.end()});
      Kept one{&of, of.world->state(), {}};
      std::map<Kind, std::vector<std::size_t>> kinds;
      Lister lister{{{nullptr, &of.world->model()}}, kinds};
      visit(lister, scene::rule(one.state));
      for (auto& [kind, members] : kinds) one.members.push_back(std::move(members));
      made.push_back(std::move(one));
    }
    return made;
  }();
  return all;
}

/// First byte: which snapshot; second: which instrument comes then; each eight more: which member becomes
/// what.
void readState(const std::string& input) {
  using tools::ToolKind;
  constexpr std::size_t kHead = 2, kChange = 8, kMost = 4;
  if (input.size() < kHead + kChange) return;
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(input[i]); };
  const Kept& from = kept()[byte(0) % kept().size()];
  scene::World& world = *from.of->world;
  scene::WorldState state = from.state;
  for (std::size_t n = 0; n < kMost && kHead + (n + 1) * kChange <= input.size(); ++n) {
    const std::size_t i = kHead + n * kChange;
    std::uint32_t place = 0;
    std::memcpy(&place, &input[i + 2], sizeof place);
    const auto& members = from.members[(byte(i) + 256u * byte(i + 1)) % from.members.size()];
    Changer changer{{{nullptr, &world.model()}},
                    members[place % members.size()],
                    place / members.size() + byte(i + 6),
                    byte(i + 7)};
    try {
      visit(changer, scene::rule(state));
    } catch (const std::invalid_argument&) {
      return;  // it has no room for that
    }
  }
  std::vector<std::uint8_t> bytes;
  {
    scene::Writer writer{{{nullptr, &world.model()}}, bytes};
    const std::string& hash = world.description().hash;
    writer.values(scene::kSnapshotMagic.data(), scene::kSnapshotMagic.size(), {});
    writer.count(hash.size(), 1, {});
    writer.values(hash.data(), hash.size(), {});
    visit(writer, scene::rule(state));
  }
  if (!restored(world, bytes)) return;
  const ToolKind kinds[] = {ToolKind::Grasper,         ToolKind::ClipApplier,     ToolKind::NeedleHolder,
                            ToolKind::BipolarForceps,  ToolKind::CoagulationHook, ToolKind::Scissors,
                            ToolKind::SlingApplicator, ToolKind::SuctionIrrigator};
  step(world, 1);
  handle(*from.of, kinds[byte(1) % std::size(kinds)], 8);
  std::uint32_t copy = 0;
  world.splitKnot(0, 1, Eigen::Vector3d(1, 0.1, 0.2), copy);
  world.removeLink(0, 2);
  step(world, 1);
  world.save(bytes);
}

/// Eight of each snapshot, counted through.
std::vector<std::string> states() {
  std::vector<std::string> made;
  std::uint64_t number = 0;
  for (std::size_t n = 0; n < kept().size(); ++n)
    for (int k = 0; k < 8; ++k, ++number) {
      made.push_back({static_cast<char>(n), static_cast<char>(k)});
      for (std::uint64_t word = 0; word < 4; ++word) {
        const std::uint64_t bits = XXH64(&number, sizeof number, word);
        made.back().append(reinterpret_cast<const char*>(&bits), sizeof bits);
      }
    }
  return made;
}

}  // namespace

std::vector<Reader> stateReaders() {
  return {{"snapshot", readSnapshot, snapshots}, {"state", readState, states}};
}

}  // namespace vest::fuzz
