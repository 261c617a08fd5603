// CPU time of a tick, allocations and locks in it, and latencies, idle and beside a whole session, with an
// empty loop as control.
#include <dlfcn.h>
#include <pthread.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <deque>
#include <thread>
#include <vector>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/PoseStamped.h>
#include <ros/callback_queue.h>
#include <ros/package.h>
#include <ros/ros.h>
#include <tf2_msgs/TFMessage.h>
#include <vest_msgs/HapticState.h>
#include <CLI/CLI.hpp>

#include "vest_haptics/device/simulated.h"
#include "vest_haptics/loop/loop.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/kinematics/trainer_box.h"
#include "vest_tissue/validation/section.h"

namespace {
thread_local std::uint64_t allocations = 0, locks = 0;
}

extern "C" void* __libc_malloc(std::size_t);
extern "C" void* __libc_calloc(std::size_t, std::size_t);
extern "C" void* __libc_realloc(void*, std::size_t);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
extern "C" void* calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __libc_calloc(count, size);
}
extern "C" void* realloc(void* old, std::size_t size) {
  ++allocations;
  return __libc_realloc(old, size);
}
extern "C" int pthread_mutex_lock(pthread_mutex_t* m) {
  static auto* real = reinterpret_cast<int (*)(pthread_mutex_t*)>(::dlsym(RTLD_NEXT, "pthread_mutex_lock"));
  ++locks;
  return real(m);
}

namespace {

using namespace vest;
using namespace vest::haptics;

constexpr const char* kCommand = "rosrun vest_haptics benchmark_haptics --output docs/haptics";

std::int64_t clockNow(clockid_t c) {
  timespec t{};
  ::clock_gettime(c, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1000000000 + t.tv_nsec;
}

/// Quantiles, µs.
struct Figures {
  double p50 = NAN, p9999 = NAN, max = NAN;
  std::size_t count = 0;

  Figures() = default;
  explicit Figures(std::vector<std::int64_t> ns) : count(ns.size()) {
    if (ns.empty()) return;
    std::sort(ns.begin(), ns.end());
    const auto at = [&](double p) {
      return 1e-3 * static_cast<double>(ns[static_cast<std::size_t>(p * static_cast<double>(ns.size() - 1))]);
    };
    p50 = at(0.5);
    p9999 = at(0.9999);
    max = at(1.0);
  }
};

/// A loop on a simulated device that presses, and a surface 5 mm below the middle as its simulation.
struct Bench {
  SimulatedDevice device;
  shared::ContactWriter writer;
  std::shared_ptr<shared::ContactReader> reader;
  std::unique_ptr<Loop> loop;
  shared::ContactImage image;

  explicit Bench(const std::string& name)
      : writer(name), reader(std::make_shared<shared::ContactReader>(name)) {
    reader->connect();
    ::shm_unlink(name.c_str());
    device.open({{"motion", "press"}, {"seconds", "1"}});
    ControllerOptions options;
    options.arm.present = true;
    options.arm.pivot_B = {0.0, 0.0, 0.165};
    options.arm.aim_B = {0.0, 0.0, 0.055};
    options.arm.X_BTrocar = kinematics::trocarFrame(options.arm.pivot_B, options.arm.aim_B);
    loop = std::make_unique<Loop>(device, options, reader);
    loop->post(Command::Enable);
  }
  void step(std::int64_t now, double z) {
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
  }
};

/// What is measured in this process, without ROS.
struct Local {
  Figures tick, control;                                ///< CPU time
  std::uint64_t allocated = 0, locked = 0, forced = 0;  ///< in all ticks; ticks with force
  Figures contact, empty;  ///< wall: model written to force written; an empty loop of 1 kHz woken late
  LoopStatistics loop;
};

Local measure(std::size_t ticks, double seconds) {
  Local out;
  Bench b("/vest_benchmark_" + std::to_string(::getpid()));
  std::vector<std::int64_t> cpu(ticks), control(ticks);
  std::int64_t now = clockNow(CLOCK_MONOTONIC);
  double z = 0.055;
  for (std::size_t i = 0; i < ticks; ++i) {
    now += 1000000;
    b.step(now, z);
    const std::uint64_t a = allocations, l = locks;
    const std::int64_t begin = clockNow(CLOCK_THREAD_CPUTIME_ID);
    const TickReport& r = b.loop->tickOnce(now);
    const std::int64_t end = clockNow(CLOCK_THREAD_CPUTIME_ID);
    out.allocated += allocations - a;
    out.locked += locks - l;
    out.forced += r.loads[2] > 0.0;
    z = r.tip_W.z();
    cpu[i] = end - begin;
    control[i] = clockNow(CLOCK_THREAD_CPUTIME_ID) - end;
    b.device.advance(0.001);
  }
  out.tick = Figures(std::move(cpu));
  out.control = Figures(std::move(control));

  // The same loop in its own thread, at 1 kHz.
  Bench live("/vest_benchmark_live_" + std::to_string(::getpid()));
  live.loop->start();
  std::vector<std::int64_t> empty, contact;
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
  for (int i = 0; i < static_cast<int>(seconds * 500); ++i) {
    const std::int64_t wrote = clockNow(CLOCK_MONOTONIC);
    live.step(wrote, z);
    for (int k = 0; k < 100; ++k) {
      if (live.loop->reports().update() && live.loop->reports().front().step >= live.image.step) {
        contact.push_back(clockNow(CLOCK_MONOTONIC) - wrote);
        z = live.loop->reports().front().tip_W.z();
        break;
      }
      ::usleep(100);
    }
    ::usleep(1000);
  }
  idle.join();
  out.loop = live.loop->statistics();
  live.loop->stop();
  out.contact = Figures(std::move(contact));
  out.empty = Figures(std::move(empty));
  return out;
}

/// A command of its own process group, ended with the object.
class Child {
 public:
  Child(std::vector<std::string> words, const std::string& ns) {
    pid_ = ::fork();
    if (pid_ != 0) return;
    ::setpgid(0, 0);
    if (!ns.empty()) ::setenv("ROS_NAMESPACE", ns.c_str(), 1);
    std::FILE* log = std::freopen("/dev/null", "w", stdout);
    static_cast<void>(log);
    std::vector<char*> argv;
    for (std::string& w : words) argv.push_back(w.data());
    argv.push_back(nullptr);
    ::execvp(argv[0], argv.data());
    ::_exit(127);
  }
  ~Child() {
    ::kill(pid_, SIGINT);  // roslaunch ends its nodes
    for (int i = 0; i < 300 && ::waitpid(pid_, nullptr, WNOHANG) == 0; ++i) ::usleep(100000);
    ::kill(-pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

 private:
  pid_t pid_ = -1;
};

/// What is seen of a running session: its left instrument is moved by the simulated device.
struct Seen {
  Figures tf;   ///< wall: the device was read, until the pose is there on /tf
  Figures age;  ///< wall: the simulation's step began, until a tick that uses it
  double tick_p50 = NAN, tick_p9999 = NAN, tick_max = NAN;  ///< µs CPU, by the node's own count
  std::string realtime;
};

class Watch {
 public:
  explicit Watch(const std::string& ns) : nh_(ns) {
    arm_ = kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml")
               .arm(tools::Instrument::Left);
    const auto now = ros::TransportHints().tcpNoDelay();
    cp_ = nh_.subscribe<geometry_msgs::PoseStamped>(
        "haptics/left/measured_cp", 1000, [this](const auto& m) { onPose(*m); }, ros::VoidConstPtr(), now);
    tf_ = nh_.subscribe<tf2_msgs::TFMessage>(
        "/tf", 1000, [this](const auto& m) { onTransforms(*m); }, ros::VoidConstPtr(), now);
    state_ = nh_.subscribe<vest_msgs::HapticState>(
        "haptics/left/state", 1000, [this](const auto& m) { onState(*m); }, ros::VoidConstPtr(), now);
    diagnostics_ = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 100, [this](const auto& m) { onDiagnostics(*m); });
  }
  /// Until transforms come (and a simulation, if there is one to be), then `seconds` of them. False: nothing.
  bool watch(double seconds, bool simulation, Seen& seen) {
    const auto spin = [&](double until, auto&& enough) {
      const ros::SteadyTime begin = ros::SteadyTime::now();
      while ((ros::SteadyTime::now() - begin).toSec() < until && !enough())
        ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));
      return enough();
    };
    if (!spin(180.0, [&] { return !delay_.empty() && (!simulation || !age_.empty()); })) return false;
    spin(15.0, [] { return false; });  // start-up is over
    delay_.clear();
    age_.clear();
    spin(seconds, [] { return false; });
    seen_.tf = Figures(delay_);
    seen_.age = Figures(age_);
    seen = seen_;
    return true;
  }

 private:
  void onPose(const geometry_msgs::PoseStamped& m) {
    if (m.header.stamp.isZero()) return;
    const Eigen::Vector3d p(m.pose.position.x, m.pose.position.y, m.pose.position.z);
    poses_.push_back({m.header.stamp, (p - arm_.pivot_B).norm()});
    if (poses_.size() > 500) poses_.pop_front();
  }
  void onTransforms(const tf2_msgs::TFMessage& m) {
    const ros::Time now = ros::Time::now();
    for (const auto& t : m.transforms) {
      if (t.child_frame_id != "left_insertion") continue;
      // The newest reading of just this insertion: the hand moves, so no two of a moment are alike.
      const double insertion = t.transform.translation.z;
      if (std::abs(insertion - last_) > 1e-6) {
        for (auto p = poses_.rbegin(); p != poses_.rend(); ++p) {
          if (std::abs(p->second - insertion) > 1e-9) continue;
          delay_.push_back((now - p->first).toNSec());
          break;
        }
      }
      last_ = insertion;
    }
  }
  void onState(const vest_msgs::HapticState& m) {
    if (m.step == 0 || !(m.model_age < 1.0)) return;  // what an ended session left behind
    age_.push_back(static_cast<std::int64_t>(1e9 * m.model_age));
  }
  void onDiagnostics(const diagnostic_msgs::DiagnosticArray& m) {
    for (const auto& s : m.status) {
      if (s.name != "vest_haptics: left") continue;
      for (const auto& v : s.values) {
        if (v.key == "tick CPU p50 [us]") seen_.tick_p50 = std::atof(v.value.c_str());
        if (v.key == "tick CPU p99.99 [us]") seen_.tick_p9999 = std::atof(v.value.c_str());
        if (v.key == "tick CPU max [us]") seen_.tick_max = std::atof(v.value.c_str());
        if (v.key == "real-time priority") seen_.realtime = v.value;
      }
    }
  }

  ros::NodeHandle nh_;
  kinematics::TrainerArm arm_;
  ros::Subscriber cp_, tf_, state_, diagnostics_;
  std::deque<std::pair<ros::Time, double>> poses_;
  std::vector<std::int64_t> delay_, age_;
  double last_ = 0.0;
  Seen seen_;
};

void print(const char* what, const Figures& f) {
  std::printf("%-44s p50 %8.2f us   p99.99 %8.2f us   max %8.2f us   (%zu)\n", what, f.p50, f.p9999, f.max,
              f.count);
}

void print(const Local& l) {
  print("tick, CPU time", l.tick);
  print("empty tick (two readings of the clock), CPU", l.control);
  std::printf("%-44s %llu\n%-44s %llu\n%-44s %llu\n", "allocations in ticks",
              static_cast<unsigned long long>(l.allocated), "locks in ticks",
              static_cast<unsigned long long>(l.locked), "ticks with force",
              static_cast<unsigned long long>(l.forced));
  print("contact model to force written, wall time", l.contact);
  print("empty loop of 1 kHz: woken late, wall time", l.empty);
  std::printf("loop of 1 kHz: %llu ticks, %llu late by more than a period, real-time priority: %s\n",
              static_cast<unsigned long long>(l.loop.ticks), static_cast<unsigned long long>(l.loop.late),
              l.loop.realtime ? "yes" : "no");
}

std::string loadNow() {
  double load[1] = {NAN};
  ::getloadavg(load, 1);
  return validation::digits(load[0]);
}

/// Both halves: quiet (instruments and device alone), then beside a session with tissue, effects and view.
validation::Section compare(std::size_t ticks, double seconds, int& argc, char** argv) {
  ros::init(argc, argv, "benchmark_haptics", ros::init_options::NoSigintHandler);
  std::unique_ptr<Child> master;
  if (!ros::master::check()) {
    const std::string uri = ros::master::getURI(), port = uri.substr(uri.rfind(':') + 1);
    master = std::make_unique<Child>(
        std::vector<std::string>{"roscore", "-p", std::to_string(std::atoi(port.c_str()))}, "");
    for (int i = 0; i < 200 && !ros::master::check(); ++i) ::usleep(100000);
  }
  const std::string hand = "{motion: press, seconds: 2}";
  Local quiet, loaded;
  Seen quiet_session, loaded_session;
  std::string quiet_load, loaded_load;
  const auto need = [](bool came, const char* what) {
    if (!came)
      throw std::runtime_error(std::string(what) +
                               ": no transforms or steps of a simulation within 3 minutes");
  };
  {
    Watch watch("/vest");
    {
      Child instruments({"roslaunch", "vest_instruments", "instruments.launch", "left:=haptic", "right:=none",
                         "third:=none", "endoscope:=none"},
                        "");
      Child device({"roslaunch", "vest_haptics", "device.launch", "options:=" + hand}, "/vest");
      std::printf("instruments and device alone ...\n");
      need(watch.watch(seconds, false, quiet_session), "instruments.launch");
    }
    quiet = measure(ticks, seconds);
    quiet_load = loadNow();
    print(quiet);
  }
  {
    Watch watch("/vest");
    Child session({"roslaunch", "vest_bringup", "trainer.launch", "headless:=true", "record:=false",
                   "script:=demo", "loop:=true", "left:=sim", "left_options:=" + hand,
                   "port:=/tmp/vest_benchmark_" + std::to_string(::getpid())},
                  "");
    std::printf("beside a whole session ...\n");
    need(watch.watch(seconds, true, loaded_session), "trainer.launch");
    loaded = measure(ticks, seconds);
    loaded_load = loadNow();
    print(loaded);
  }
  validation::Section s("72_loop", "The loop of 1 kHz", kCommand);
  s.text("CPU time of a tick by the thread's own clock over " + std::to_string(ticks) +
         " ticks: reading device and shared memory, control, writing; every tick with a new contact model, "
         "pressing and leaving in turn. Control: an empty tick, that is two readings of the clock. "
         "Quiet: nothing of VEST beside it (load average of the machine at its end " +
         quiet_load + " on " + std::to_string(std::thread::hardware_concurrency()) +
         " processors, by other work). Beside a "
         "session: `trainer.launch` with the gynaecology scene, the demo's motion and rviz that renders in "
         "software (load average " +
         loaded_load + "). Real-time priority: " + (loaded.loop.realtime ? "yes" : "no") +
         ". Wall times are those of this machine under this load and carry no bound; "
         "CPU times on a virtual machine hold what its host takes from it.");
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](const std::string& what, const Figures& q, const Figures& l) {
    const auto digits = [](double us) { return std::isnan(us) ? std::string("-") : validation::digits(us); };
    rows.push_back(
        {what, digits(q.p50), digits(q.p9999), digits(q.max), digits(l.p50), digits(l.p9999), digits(l.max)});
  };
  Figures own_quiet, own_loaded;
  own_quiet.p50 = quiet_session.tick_p50, own_quiet.p9999 = quiet_session.tick_p9999,
  own_quiet.max = quiet_session.tick_max;
  own_loaded.p50 = loaded_session.tick_p50, own_loaded.p9999 = loaded_session.tick_p9999,
  own_loaded.max = loaded_session.tick_max;
  row("tick, CPU", quiet.tick, loaded.tick);
  row("control: empty tick, CPU", quiet.control, loaded.control);
  row("tick of the running node, simulated arm and reports included, CPU (by its own count, bins of 1 µs)",
      own_quiet, own_loaded);
  row("contact model in the memory to force at the device, wall", quiet.contact, loaded.contact);
  row("control: empty loop of 1 kHz woken late, wall", quiet.empty, loaded.empty);
  row("device read to its pose on /tf, wall", quiet_session.tf, loaded_session.tf);
  row("step of the simulation begun, until the tick that uses it and its force goes out, wall", Figures(),
      loaded_session.age);
  s.table({"µs", "quiet: p50", "p99.99", "max", "beside a session: p50", "p99.99", "max"}, rows);
  for (const Local* l : {&quiet, &loaded}) {
    const std::string when = l == &quiet ? "quiet: " : "beside a session: ";
    s.atMost(when + "CPU time of a tick, p99.99", l->tick.p9999, 200.0, "us");
    s.atMost(when + "allocations in all ticks", static_cast<double>(l->allocated), 0.0, "");
    s.atMost(when + "locks taken in all ticks", static_cast<double>(l->locked), 0.0, "");
    s.atLeast(when + "share of ticks that showed a force",
              static_cast<double>(l->forced) / static_cast<double>(ticks), 0.2, "");
  }
  s.atMost("the running node beside a session: CPU time of a tick, p99.99", loaded_session.tick_p9999, 200.0,
           "us");
  ros::shutdown();
  return s;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("CPU time and latency of the haptic loop");
  std::size_t ticks = 1000000;
  double seconds = 5.0;
  std::string output;
  app.add_option("--ticks", ticks, "ticks whose CPU time is measured")
      ->capture_default_str()
      ->check(CLI::Range(1000, 100000000));
  app.add_option("--seconds", seconds, "of the wall-time measurements")
      ->capture_default_str()
      ->check(vest::files::number(1, 3600));
  app.add_option(
      "--output", output,
      "folder of the section 72_loop: also measures beside a whole session, with a view under Xvfb");
  CLI11_PARSE(app, argc, argv);
  try {
    // The traps work.
    const std::uint64_t a = allocations, l = locks;
    std::free(std::malloc(1));
    pthread_mutex_t m = PTHREAD_MUTEX_INITIALIZER;
    pthread_mutex_lock(&m);
    pthread_mutex_unlock(&m);
    if (allocations == a || locks == l)
      throw std::runtime_error("the traps for allocations and locks do not work");
    if (output.empty()) {
      const Local local = measure(ticks, seconds);
      print(local);
      return local.tick.p9999 <= 200.0 && local.allocated == 0 && local.locked == 0 ? 0 : 1;
    }
    const validation::Section s = compare(ticks, seconds, argc, argv);
    s.write(output);
    std::printf("%s: %s\n%s", s.stem().c_str(), s.passed() ? "all claims hold" : "CLAIMS FAIL",
                s.failures().c_str());
    return s.passed() ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "benchmark_haptics: %s\n", e.what());
    return 2;
  }
}
