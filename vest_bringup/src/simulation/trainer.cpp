#include "vest_bringup/simulation/trainer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include <xxhash.h>

#include "vest_effects/bleeding/swab.h"

namespace vest::simulation {
namespace {

void append(std::vector<std::uint8_t>& bytes, const void* data, std::size_t count) {
  const auto* from = static_cast<const std::uint8_t*>(data);
  bytes.insert(bytes.end(), from, from + count);
}

/// Reads numbers one after another; false once there is not enough left.
struct Reader {
  const std::uint8_t* at;
  const std::uint8_t* end;
  bool take(void* to, std::size_t count) {
    if (static_cast<std::size_t>(end - at) < count) return false;
    std::memcpy(to, at, count);
    at += count;
    return true;
  }
};

// Fields one by one: no padding, as the World's snapshot.
void saveFeedback(const Feedback& feedback, std::vector<std::uint8_t>& bytes) {
  const std::uint64_t counts[4] = {feedback.impacts.size(), feedback.dilatations.size(),
                                   feedback.loads.size(), feedback.films.size()};
  append(bytes, counts, sizeof counts);
  append(bytes, &feedback.load_over, sizeof feedback.load_over);
  append(bytes, &feedback.gas_drawn, sizeof feedback.gas_drawn);
  append(bytes, &feedback.gas.sunk, sizeof feedback.gas.sunk);
  append(bytes, feedback.swab_room.data(), sizeof feedback.swab_room);
  for (const auto& l : feedback.loads) {
    append(bytes, &l.object, sizeof l.object), append(bytes, &l.knot, sizeof l.knot);
    append(bytes, l.force.data(), sizeof l.force), append(bytes, &l.damping, sizeof l.damping);
    append(bytes, &l.stiffness, sizeof l.stiffness), append(bytes, &l.depth, sizeof l.depth);
  }
  for (const auto& i : feedback.impacts) {
    append(bytes, &i.object, sizeof i.object), append(bytes, &i.triangle, sizeof i.triangle);
    append(bytes, i.weights.data(), sizeof i.weights), append(bytes, i.momentum.data(), 3 * sizeof(double));
  }
  for (const auto& f : feedback.films) {
    append(bytes, &f.object, sizeof f.object), append(bytes, &f.triangle, sizeof f.triangle);
    append(bytes, &f.impulse, sizeof f.impulse), append(bytes, &f.blood, sizeof f.blood);
  }
  for (const auto& d : feedback.dilatations) {
    std::array<char, scene::VesselName::kMost + 1> name{};
    d.vessel_segment.view().copy(name.data(), scene::VesselName::kMost);
    append(bytes, name.data(), name.size()), append(bytes, &d.dilatation, sizeof d.dilatation);
  }
}

bool readFeedback(Reader& in, Feedback& feedback) {
  std::uint64_t counts[4];
  if (!in.take(counts, sizeof counts) || counts[0] > 1'000'000 || counts[1] > 100'000 ||
      counts[2] > 1'000'000 || counts[3] > 1'000'000 ||
      !in.take(&feedback.load_over, sizeof feedback.load_over) ||
      !in.take(&feedback.gas_drawn, sizeof feedback.gas_drawn) ||
      !(feedback.gas_drawn >= 0 && feedback.gas_drawn <= 0.01) ||
      !in.take(&feedback.gas.sunk, sizeof feedback.gas.sunk) ||
      !(feedback.gas.sunk >= 0 && feedback.gas.sunk <= 1) ||
      !in.take(feedback.swab_room.data(), sizeof feedback.swab_room))
    return false;
  for (const double room : feedback.swab_room)
    if (!(room >= 0 && room <= bleeding::kSwabCapacity)) return false;
  feedback.loads.resize(counts[2]);
  for (auto& l : feedback.loads) {
    if (!in.take(&l.object, sizeof l.object) || !in.take(&l.knot, sizeof l.knot) ||
        !in.take(l.force.data(), sizeof l.force) || !in.take(&l.damping, sizeof l.damping) ||
        !in.take(&l.stiffness, sizeof l.stiffness) || !in.take(&l.depth, sizeof l.depth))
      return false;
  }
  feedback.impacts.resize(counts[0]);
  for (auto& i : feedback.impacts) {
    if (!in.take(&i.object, sizeof i.object) || !in.take(&i.triangle, sizeof i.triangle) ||
        !in.take(i.weights.data(), sizeof i.weights) || !in.take(i.momentum.data(), 3 * sizeof(double)))
      return false;
  }
  feedback.films.resize(counts[3]);
  for (auto& f : feedback.films) {
    if (!in.take(&f.object, sizeof f.object) || !in.take(&f.triangle, sizeof f.triangle) ||
        !in.take(&f.impulse, sizeof f.impulse) || !in.take(&f.blood, sizeof f.blood) ||
        !std::isfinite(f.impulse) || !(f.blood >= 0 && f.blood < 1))
      return false;
  }
  feedback.dilatations.resize(counts[1]);
  for (auto& d : feedback.dilatations) {
    std::array<char, scene::VesselName::kMost + 1> name{};
    if (!in.take(name.data(), name.size()) || !in.take(&d.dilatation, sizeof d.dilatation)) return false;
    name.back() = '\0';
    d.vessel_segment = scene::VesselName(std::string_view(name.data()));
  }
  return true;
}

/// Behind the effects: their checksum, where they begin, the magic word.
constexpr std::size_t kTail = 2 * sizeof(std::uint64_t) + kEffectsMagic.size();

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("snapshot: its effects " + what);
}

}  // namespace

std::size_t worldBytes(const std::vector<std::uint8_t>& snapshot) {
  if (snapshot.size() < kTail || std::memcmp(snapshot.data() + snapshot.size() - kEffectsMagic.size(),
                                             kEffectsMagic.data(), kEffectsMagic.size()) != 0)
    return snapshot.size();
  std::uint64_t size;
  std::memcpy(&size, snapshot.data() + snapshot.size() - kTail + sizeof size, sizeof size);
  return size <= snapshot.size() - kTail ? size : snapshot.size();
}

Trainer::Trainer(scene::World world) : world_(std::move(world)) {
  feedback_.impacts.reserve(1024);
  feedback_.dilatations.reserve(256);
  std::size_t knots = 0;
  for (std::size_t i = 0; i < world_.objectCount(); ++i) knots += world_.knotCount(i);
  feedback_.loads.reserve(knots + knots / 2 + 1024);
  feedback_.sources.reserve(bleeding::kMostSources);
  std::size_t triangles = 0;
  for (std::size_t i = 0; i < world_.objectCount(); ++i) triangles += world_.contactTriangles(i).size();
  feedback_.films.reserve(2 * triangles + 1024);
}

void Trainer::add(std::unique_ptr<Effect> effect) {
  const Ports after = effect->ports();
  for (const auto& before : effects_) {
    const Ports p = before->ports();
    if ((p.takes & after.gives) != 0 || (p.gives & after.takes_late) != 0)
      throw std::logic_error("effects: one that gives " +
                             std::to_string((p.takes & after.gives) | (p.gives & after.takes_late)) +
                             " (simulation/effect.h, Port) stands on the wrong side of one that takes it");
  }
  effects_.push_back(std::move(effect));
}

scene::Status Trainer::step(scene::StepInput& input, scene::StepReport& report) {
  input.impacts.insert(input.impacts.end(), feedback_.impacts.begin(), feedback_.impacts.end());
  input.loads.insert(input.loads.end(), feedback_.loads.begin(), feedback_.loads.end());
  if (feedback_.load_over > 0) input.load_over = feedback_.load_over;
  input.dilatations.insert(input.dilatations.end(), feedback_.dilatations.begin(),
                           feedback_.dilatations.end());
  input.sunk = feedback_.gas.sunk;
  const scene::Status status = world_.step(input, report);
  clearFeedback();
  for (const auto& effect : effects_) effect->step(world_, input, report, feedback_);
  return status;
}

void Trainer::reset() {
  world_.reset();
  clearFeedback();
  feedback_.films.clear(), feedback_.gas_drawn = 0, feedback_.gas = {}, feedback_.swab_room.fill(0);
  for (const auto& effect : effects_) effect->reset();
}

std::vector<std::uint32_t> Trainer::adopt(scene::Simulation& before) {
  const std::vector<std::uint32_t> objects = world_.adopt(before.world());
  const auto* const other = dynamic_cast<const Trainer*>(&before);
  if (other == nullptr || other->effects_.size() != effects_.size()) return objects;
  feedback_.gas_drawn = other->feedback_.gas_drawn, feedback_.gas.sunk = other->feedback_.gas.sunk;
  feedback_.swab_room = other->feedback_.swab_room;
  for (FilmInput film : other->feedback_.films) {
    // Of an organ that is not there any more: its blood goes with it (SurfaceEffect::takeFilms).
    film.object =
        static_cast<std::uint16_t>(film.object < objects.size() ? objects[film.object] : scene::kNotAdopted);
    feedback_.films.push_back(film);
  }
  for (std::size_t i = 0; i < effects_.size(); ++i) effects_[i]->adopt(*other->effects_[i], objects);
  return objects;
}

void Trainer::edits(std::vector<scene::EditableParameter>& out) {
  scene::editableParameters(world_, out);
  for (const auto& effect : effects_) effect->edits(world_, out);
}

void Trainer::saveEffects(std::vector<std::uint8_t>& bytes) const {
  saveFeedback(feedback_, bytes);
  for (const auto& effect : effects_) {
    const std::size_t place = bytes.size();
    std::uint64_t size = 0;
    append(bytes, &size, sizeof size);
    effect->save(bytes);
    size = bytes.size() - place - sizeof size;
    std::memcpy(bytes.data() + place, &size, sizeof size);
  }
}

std::optional<std::uint64_t> Trainer::effectsHash() {
  if (effects_.empty()) return std::nullopt;
  hashed_.clear();
  saveEffects(hashed_);
  return XXH64(hashed_.data(), hashed_.size(), 0);
}

void Trainer::save(std::vector<std::uint8_t>& bytes) {
  world_.save(bytes);
  if (effects_.empty()) return;
  const std::uint64_t size = bytes.size();
  saveEffects(bytes);
  const std::uint64_t sum = XXH64(bytes.data() + size, bytes.size() - size, 0);
  append(bytes, &sum, sizeof sum);
  append(bytes, &size, sizeof size);
  append(bytes, kEffectsMagic.data(), kEffectsMagic.size());
}

void Trainer::restore(const std::vector<std::uint8_t>& bytes) {
  const std::size_t size = worldBytes(bytes);
  if (size != bytes.size()) {
    const std::size_t end = bytes.size() - kTail;
    std::uint64_t sum = 0;
    std::memcpy(&sum, bytes.data() + end, sizeof sum);
    if (sum != XXH64(bytes.data() + size, end - size, 0))
      refuse("do not fit their checksum (damaged, or cut off)");
  }
  std::vector<std::uint8_t> before;
  save(before);  // all or nothing: what was taken is given back if the rest does not fit
  world_.restore(std::vector<std::uint8_t>(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
  clearFeedback();
  feedback_.films.clear(), feedback_.gas_drawn = 0, feedback_.gas = {}, feedback_.swab_room.fill(0);
  const auto take = [this](const std::vector<std::uint8_t>& from, std::size_t world) {
    if (world == from.size()) {
      for (const auto& effect : effects_) effect->reset();
      return true;
    }
    Reader in{from.data() + world, from.data() + from.size() - kTail};
    if (!readFeedback(in, feedback_)) return false;
    for (const auto& effect : effects_) {
      std::uint64_t count;
      if (!in.take(&count, sizeof count) || count > static_cast<std::uint64_t>(in.end - in.at) ||
          !effect->restore(in.at, count))
        return false;
      in.at += count;
    }
    return in.at == in.end;
  };
  if (take(bytes, size)) return;
  const std::size_t old = worldBytes(before);
  world_.restore(
      std::vector<std::uint8_t>(before.begin(), before.begin() + static_cast<std::ptrdiff_t>(old)));
  take(before, old);
  refuse("do not fit those of this Trainer");
}

void Trainer::clearFeedback() {
  feedback_.impacts.clear();
  feedback_.loads.clear();
  feedback_.load_over = 0;
  feedback_.dilatations.clear();
  feedback_.sources.clear();
  feedback_.clots.fill(0), feedback_.wiped.fill(0);
}

}  // namespace vest::simulation
