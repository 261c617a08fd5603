#pragma once

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "vest_haptics/device/device.h"
#include "vest_haptics/loop/controller.h"
#include "vest_tissue/scene/ring.h"
#include "vest_tissue/shared/contact_memory.h"

namespace vest::haptics {

struct LoopStatistics {
  std::uint64_t ticks = 0;
  std::uint64_t late = 0;  ///< woken more than one period after its time
  double cpu_max = 0.0;    ///< s of CPU time of one tick
  double cpu_p9999 = 0.0;  ///< s, upper edge of a bin of 1 µs; 1 ms and more: 1 ms
  double cpu_p50 = 0.0;    ///< s
  bool realtime = false;   ///< SCHED_FIFO was granted
};

/// Ticks at the device's rate in a thread of its own: reads the device, the shared memory, computes, writes.
/// No lock, no allocation, no log in it. Everything else talks to it through buffers that nobody waits for.
class Loop {
 public:
  /// @param memory may be unconnected: the owner calls connect() now and then
  Loop(Device& device, const ControllerOptions& options, std::shared_ptr<shared::ContactReader> memory);
  ~Loop();

  void start();
  /// Zero force, forces off, thread ended. Idempotent.
  void stop();
  /// The next tick shows zero and stays there. Async-signal-safe.
  void halt() noexcept { halt_ = true; }

  // Any one ordinary thread.
  /// The next tick takes what was posted since the last one, in its order. Of more than sixteen a disable is
  /// left.
  void post(Command command) noexcept;
  /// Commands that did not fit the state at their tick, since this was asked last: bit of each.
  unsigned refused() noexcept { return refused_.exchange(0); }
  void raise(Fault fault) noexcept { fault_ = static_cast<int>(fault); }
  /// CRTK servo_cf: N, device frame.
  void servo(const Eigen::Vector3d& force, std::int64_t now_ns) noexcept;
  scene::TripleBuffer<TickReport>& reports() { return reports_; }
  LoopStatistics statistics() const;

  /// One tick, for whoever drives time himself (tests, benchmarks): the loop must not have been started.
  const TickReport& tickOnce(std::int64_t now_ns) noexcept;
  const TickReport& newest() const noexcept { return controller_.report(); }  ///< likewise

  static std::int64_t steadyNow() noexcept;

 private:
  struct Servo {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    std::int64_t ns = -1;
  };
  void takeCommands() noexcept;
  void run();

  Device& device_;
  ControllerOptions options_;
  Controller controller_;
  std::shared_ptr<shared::ContactReader> memory_;
  shared::ContactImage image_;
  bool any_image_ = false;
  TickInput input_;
  scene::TripleBuffer<TickReport> reports_;
  scene::TripleBuffer<Servo> servo_;
  std::atomic<std::uint64_t> commands_{0};  ///< 4 bits each, the newest lowest: 1 + Command; 0: none
  std::atomic<unsigned> refused_{0};
  std::atomic<int> fault_{0};
  std::atomic<bool> stop_{false}, halt_{false}, realtime_{false};
  std::atomic<std::uint64_t> ticks_{0}, late_{0}, cpu_max_ns_{0};
  std::array<std::atomic<std::uint32_t>, 1001> cpu_histogram_{};  ///< bins of 1 µs
  std::thread thread_;
};

}  // namespace vest::haptics
