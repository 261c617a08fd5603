// CPU time of a tick, allocations and locks in it, and wake-up latency beside an empty loop as control.
#include <dlfcn.h>
#include <pthread.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <thread>
#include <vector>

#include <CLI/CLI.hpp>

#include "vest_haptics/device/simulated.h"
#include "vest_haptics/loop/loop.h"
#include "vest_instruments/kinematics/trainer_box.h"

namespace {
thread_local std::uint64_t allocations = 0, locks = 0;
std::int64_t clockNow(clockid_t c) {
  timespec t{};
  ::clock_gettime(c, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1000000000 + t.tv_nsec;
}
void print(const char* what, std::vector<std::int64_t>& ns) {
  std::sort(ns.begin(), ns.end());
  const auto at = [&](double p) {
    return 1e-3 * static_cast<double>(ns[static_cast<std::size_t>(p * static_cast<double>(ns.size() - 1))]);
  };
  std::printf("%-44s p50 %8.2f us   p99.99 %8.2f us   max %8.2f us   (%zu)\n", what, at(0.5), at(0.9999),
              at(1.0), ns.size());
}
}  // namespace

extern "C" void* __libc_malloc(std::size_t);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
extern "C" int pthread_mutex_lock(pthread_mutex_t* m) {
  static auto* real = reinterpret_cast<int (*)(pthread_mutex_t*)>(::dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  ++locks;
  return real(m);
}

int main(int argc, char** argv) {
  using namespace vest;
  using namespace vest::haptics;
  CLI::App app("CPU time and latency of the haptic loop");
  std::size_t ticks = 1000000;
  double seconds = 5.0;
  app.add_option("--ticks", ticks, "ticks whose CPU time is measured")->capture_default_str();
  app.add_option("--seconds", seconds, "of the wake-up measurement")->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  const std::string name = "/vest_benchmark_" + std::to_string(::getpid());
  shared::ContactWriter writer(name);
  auto reader = std::make_shared<shared::ContactReader>(name);
  reader->connect();
  ::shm_unlink(name.c_str());
  SimulatedDevice device;
  device.open({{"motion", "press"}, {"seconds", "1"}});
  ControllerOptions options;
  options.arm.present = true;
  options.arm.pivot_B = {0.0, 0.0, 0.165};
  options.arm.aim_B = {0.0, 0.0, 0.055};
  options.arm.X_BTrocar = kinematics::trocarFrame(options.arm.pivot_B, options.arm.aim_B);
  Loop loop(device, options, reader);
  loop.post(Command::Enable);
  shared::ContactImage image;
  // A surface 5 mm below the middle, a step a tick.
  const auto step = [&](std::int64_t now, double z) {
    ++image.step;
    image.steady_ns = now;
    shared::ContactRecord& r = image.contacts[0];
    r = shared::ContactRecord{};
    r.flags = shared::kFlagPresent;
    r.position[2] = r.commanded[2] = z;
    r.pivot[2] = 0.165;
    r.radius = 0.005;
    const double depth = 0.050 - z;
    if (depth > 0) {
      r.flags |= shared::kFlagContact;
      r.wrench[2] = 300.0 * depth;
      r.stiffness[0] = r.stiffness[7] = r.stiffness[14] = 300.0;
      r.plane_count = 1;
      r.planes[0][2] = 1.0;
      r.planes[0][3] = 0.050;
    }
    writer.write(image);
  };
  std::vector<std::int64_t> cpu(ticks), control(ticks);
  std::int64_t now = clockNow(CLOCK_MONOTONIC);
  std::uint64_t allocated = 0, locked = 0, forced = 0;
  double z = 0.055;
  for (std::size_t i = 0; i < ticks; ++i) {
    now += 1000000;
    step(now, z);
    const std::uint64_t a = allocations, l = locks;
    const std::int64_t begin = clockNow(CLOCK_THREAD_CPUTIME_ID);
    const TickReport& r = loop.tickOnce(now);
    const std::int64_t end = clockNow(CLOCK_THREAD_CPUTIME_ID);
    allocated += allocations - a;
    locked += locks - l;
    forced += r.loads[2] > 0.0;
    z = r.tip_W.z();
    cpu[i] = end - begin;
    control[i] = clockNow(CLOCK_THREAD_CPUTIME_ID) - end;
    device.advance(0.001);
  }
  print("tick, CPU time", cpu);
  print("empty tick (two readings of the clock), CPU", control);
  std::printf("%-44s %llu\n%-44s %llu\n%-44s %llu\n", "allocations in ticks",
              static_cast<unsigned long long>(allocated), "locks in ticks",
              static_cast<unsigned long long>(locked), "ticks with force",
              static_cast<unsigned long long>(forced));

  // From a step of the simulation that is in the memory to the force at the device: wall time, in ticks of 1
  // kHz.
  loop.start();
  std::vector<std::int64_t> late, empty;
  std::thread idle([&] {
    std::int64_t due = clockNow(CLOCK_MONOTONIC);
    const sched_param p{80};
    pthread_setschedparam(pthread_self(), SCHED_FIFO, &p);
    for (int i = 0; i < static_cast<int>(seconds * 1000); ++i) {
      due += 1000000;
      const timespec t{due / 1000000000, due % 1000000000};
      ::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
      empty.push_back(clockNow(CLOCK_MONOTONIC) - due);
    }
  });
  std::vector<std::int64_t> contact;
  for (int i = 0; i < static_cast<int>(seconds * 500); ++i) {
    const std::int64_t wrote = clockNow(CLOCK_MONOTONIC);
    step(wrote, z);
    const std::uint64_t wanted = image.step;
    for (int k = 0; k < 100; ++k) {
      if (loop.reports().update() && loop.reports().front().step >= wanted) {
        contact.push_back(clockNow(CLOCK_MONOTONIC) - wrote);
        z = loop.reports().front().tip_W.z();
        break;
      }
      ::usleep(100);
    }
    ::usleep(1000);
  }
  idle.join();
  const LoopStatistics s = loop.statistics();
  loop.stop();
  print("contact model to force written, wall time", contact);
  print("empty loop of 1 kHz: woken late, wall time", empty);
  std::printf("loop of 1 kHz: %llu ticks, %llu late by more than a period, real-time priority: %s\n",
              static_cast<unsigned long long>(s.ticks), static_cast<unsigned long long>(s.late),
              s.realtime ? "yes" : "no");
  return 0;
}
