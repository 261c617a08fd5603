#pragma once

#include <ctime>
#include <memory>

#include "delta_history.h"
#include "room.h"
#include "stages.h"
#include "vest_tissue/solver/pool.h"

namespace vest::scene {

inline constexpr std::size_t kEventCapacity = 64;

struct World::Impl {
  std::shared_ptr<const WorldModel> model;
  WorldState state;
  WorldScratch scratch;
  std::unique_ptr<solver::Pool> pool;
  Shares shares;
  DeltaHistory deltas;
  net::KernelLevel level = net::chooseKernelLevel();
  bool account_energy = false;
  bool measure = false;

  /// A copied vector has no spare room: give it back before steps that must not allocate.
  void reserve() {
    giveRoom(state.pairs, model->mostPairs());
    state.fasteners.reserve();
    giveRoom(state.sides, 2048);
    giveRoom(state.threads.touches, model->threads.room());
    if (!model->threads.first_point.empty()) giveRoom(state.threads.channels, interaction::kMaxChannels);
    for (const std::size_t i : model->bodies) {
      ObjectState& s = state.objects[i];
      const ObjectState& start = model->start.objects[i];
      const auto room = [](auto& v, std::size_t most) { giveRoom(v, 2 * most + 64); };
      const std::size_t links = start.topology.links.size();
      room(s.topology.links, links), room(s.topology.link_alive, links), room(s.places, links),
          room(s.links, links);
      room(s.elements.bending, start.elements.bending.size()),
          room(s.elements.plastic, start.elements.plastic.size());
      room(s.elements.tethers, start.elements.tethers.size());
      model->objects[i].body->reserve(model->objects[i], start, s);
      giveRoom(s.fixed, s.block.knotCapacity()), giveRoom(s.topology.doubled_knots, s.block.knotCapacity());
    }
    reserveCut(*model, state);
    reserveBackup(*model, state, scratch);
  }
  /// With a State that did not come of the step before.
  void goOn() {
    reserve();
    scratch.forget();
    deltas.clear();
  }
  Status fault(Context& c, std::string_view object);
  void useThreads(int threads) {
    pool = std::make_unique<solver::Pool>(std::clamp(threads, 1, 64));
    shares = shareOut(*model, static_cast<std::size_t>(pool->threads()));
  }

  template <typename Stage>
  void time(StepReport& report, int index, Stage stage) {
    if (!measure) {
      stage();
      return;
    }
    timespec a, b;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &a);
    stage();
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &b);
    report.stage_seconds[index] +=
        static_cast<double>(b.tv_sec - a.tv_sec) + 1e-9 * static_cast<double>(b.tv_nsec - a.tv_nsec);
  }
};

}  // namespace vest::scene
