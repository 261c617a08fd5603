// What the hand feels, in figures: slabs and strips of three tissues against their laws, and work in the
// gynaecology scene with the simulated device, the stand-in of libHD and the emulator of the HCI protocol.
#include <dlfcn.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <thread>

#include <ros/package.h>
#include <CLI/CLI.hpp>

#include "vest_haptics/device/impulse_engine.h"
#include "vest_haptics/device/phantom.h"
#include "vest_haptics/device/simulated.h"
#include "vest_haptics/trial/specimen.h"
#include "vest_haptics/trial/trial.h"
#include "vest_tissue/scene/baked.h"
#include "vest_tissue/validation/section.h"

namespace {

using namespace vest;
using namespace vest::haptics;
using Eigen::Vector3d;

constexpr const char* kCommand = "rosrun vest_haptics haptics_trials --output docs/haptics";

validation::Section specimens() {
  validation::Section s("70_forces", "Force against depth", kCommand);
  s.text(
      "A simulated device, the loop of 1 kHz and a World, one millisecond after another. Pressed: a "
      "grasper's tip sinks into a slab of 60 x 60 x 15 mm; "
      "in compression the law is the line sigma = E eps, and one constant of the geometry serves all three "
      "tissues. Pulled: jaws hold the end of a strip of 4 x 4 x 30 mm "
      "and stretch it by half and more; force = area times sigma(strain), fourth order. Depth > 0 pressed "
      "in, < 0 pulled out; force > 0 pushes the hand back.");
  const material::Database database = material::readDatabase(material::databasePath());
  validation::Plot pressed{"Pressed", "depth, mm", "force, N", {}},
      pulled{"Pulled", "elongation, mm", "force, N", {}};
  std::vector<std::vector<std::string>> rows;
  for (const char* name : {"liver", "uterus", "fat_soft"}) {
    const material::Tissue& tissue = database.at(name);
    for (const bool pulling : {false, true}) {
      const std::vector<Felt> felt = pulling ? pull(tissue) : press(tissue);
      validation::Curve shown{std::string(name) + ", felt", {}, {}, validation::Mark::Points};
      validation::Curve law{std::string(name) + ", law", {}, {}, validation::Mark::Line};
      double worst = felt.empty() ? NAN : 0.0, greatest = 0.0;
      for (const Felt& f : felt) {
        const double sign = pulling ? -1000.0 : 1000.0;
        shown.x.push_back(sign * f.depth), law.x.push_back(sign * f.depth);
        shown.y.push_back(f.shown), law.y.push_back(f.law);
        greatest = std::max(greatest, std::abs(f.law));
      }
      for (const Felt& f : felt) {
        worst = std::max(worst, std::abs(f.shown - f.law) / greatest);
        rows.push_back({name, pulling ? "pulled" : "pressed", validation::digits(1000 * f.depth),
                        validation::digits(f.strain), validation::digits(f.shown),
                        validation::digits(f.law)});
      }
      (pulling ? pulled : pressed).curves.push_back(shown);
      (pulling ? pulled : pressed).curves.push_back(law);
      s.atMost(std::string(name) + (pulling ? " pulled" : " pressed") + ": force felt and law differ by",
               worst, kFeltBound, "of the greatest force");
    }
  }
  s.plot("pressed", pressed);
  s.plot("pulled", pulled);
  s.table({"tissue", "trial", "depth, mm", "strain", "felt, N", "law, N"}, rows);
  return s;
}

/// Where the hand wishes to be, and its jaws; the last holds.
struct Waypoint {
  double t;
  Vector3d tip;
  double jaw;
};

Waypoint at(const std::vector<Waypoint>& way, double t) {
  for (std::size_t i = 1; i < way.size(); ++i) {
    if (t > way[i].t) continue;
    const double u = (t - way[i - 1].t) / (way[i].t - way[i - 1].t), s = u * u * (3.0 - 2.0 * u);
    return {t, way[i - 1].tip + s * (way[i].tip - way[i - 1].tip),
            way[i - 1].jaw + s * (way[i].jaw - way[i - 1].jaw)};
  }
  return way.back();
}

/// Touch and press on the fundus of the uterus, then take the right tube, pull it up, lay it back, let go.
const std::vector<Waypoint> kWork{
    {0.0, {0.020, 0.058, 0.100}, 0.0},      {2.6, {0.000, 0.062, 0.095}, 0.0},
    {4.0, {0.000, 0.064, 0.068}, 0.0},      {4.6, {0.000, 0.064, 0.068}, 0.0},
    {5.6, {0.000, 0.062, 0.095}, 0.3},      {7.0, {0.052, 0.048, 0.078}, 0.95},
    {8.2, {0.0476, 0.0546, 0.0622}, 0.95},  {9.2, {0.0476, 0.0546, 0.0622}, 0.0},
    {9.6, {0.0475, 0.0544, 0.0627}, 0.0},   {11.5, {0.0385, 0.0435, 0.0840}, 0.0},
    {12.5, {0.0385, 0.0435, 0.0840}, 0.0},  {14.0, {0.0475, 0.0543, 0.0630}, 0.0},
    {14.6, {0.0475, 0.0543, 0.0630}, 0.95}, {16.0, {0.052, 0.048, 0.085}, 0.95}};

/// Repeats a trial's ticks at the clock, for devices that live in real time.
struct Pace {
  std::int64_t due = Loop::steadyNow();
  std::int64_t next() {
    due += 1000000;
    const std::int64_t now = Loop::steadyNow();
    if (due > now) std::this_thread::sleep_for(std::chrono::nanoseconds(due - now));
    if (now - due > 20000000) due = now;  // the machine was busy: the hand moves on
    return Loop::steadyNow();
  }
};

/// Greatest change of a channel, as a share of its maximum; Cartesian: of the force.
double change(const Capabilities& c, const Loads& a, const Loads& b) {
  double most = 0.0, square = 0.0;
  for (std::size_t i = 0; i < kChannels; ++i) {
    square += (a[i] - b[i]) * (a[i] - b[i]);
    if (c.joints) most = std::max(most, std::abs(a[i] - b[i]) / c.maximum[i]);
  }
  return c.joints ? most : std::sqrt(square) / c.maximum[0];
}

void judge(validation::Section& s, const std::string& device, const std::vector<TrialSample>& samples,
           const Capabilities& c, const std::string& directory) {
  validation::Curve shown{"shown", {}, {}, validation::Mark::Line},
      asked{"asked by the tissue", {}, {}, validation::Mark::Dashed};
  double touched = 0.0, held = 0.0, jump = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const TrialSample& a = samples[i];
    const double force = a.shown.norm();
    if (a.grasping)
      held = std::max(held, force);
    else if (a.contact)
      touched = std::max(touched, force);
    if (i > 0) jump = std::max(jump, change(c, a.loads, samples[i - 1].loads));
    if (i % 20 != 0) continue;
    shown.x.push_back(a.time), asked.x.push_back(a.time);
    shown.y.push_back(force), asked.y.push_back(a.asked.norm());
  }
  s.plot(device, {device, "time, s", "force, N", {shown, asked}});
  s.atLeast(device + ": greatest force while it touches and presses", touched, 0.05, "N");
  s.atLeast(device + ": greatest force while it holds and pulls", held, 0.05, "N");
  s.atMost(device + ": greatest change of a channel in a tick", jump, 0.05, "of the maximum");
  if (!directory.empty()) writeSamples(directory + "/gynaecology_" + device + ".csv", samples);
}

ControllerOptions rightHand() {
  ControllerOptions options;
  options.instrument = static_cast<int>(tools::Instrument::Right);
  options.arm =
      kinematics::loadTrainerBox(ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml")
          .arm(tools::Instrument::Right);
  return options;
}

template <class F>
std::vector<TrialSample> work(Device& device, const ControllerOptions& options, double seconds, F&& hand) {
  static const scene::Description gynaecology =
      scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/gynaecology/gynaecology.yaml");
  scene::World world(gynaecology);
  Trial trial(world, tools::ToolKind::Grasper, device, options);
  std::vector<TrialSample> samples;
  for (int i = 0; i < static_cast<int>(1000 * seconds); ++i) samples.push_back(hand(trial, 0.001 * i));
  return samples;
}

validation::Section gynaecology(const std::string& fake_hd, const std::string& emulator,
                                const std::string& csv) {
  validation::Section s("71_gynaecology", "Forces in the gynaecology scene", kCommand);
  s.text(
      "Each device works through the same loop, trocar and scene: touch and press on the uterus, grasp the "
      "right tube, pull it up, lay it back. `simulated`: a mass with a hand. `phantom`: the "
      "plug-in for libHD on the stand-in of that library, with the arm and the hand that it simulates. "
      "`impulse_engine`: the plug-in on the emulator of the HCI protocol, over pseudo-terminals, in "
      "real time; its hand goes in and out along the shaft, and the jaws close at the deepest point; "
      "its curve is as rough as steps of its encoders (50 um, 0.5 mrad) and a busy machine's uneven ticks "
      "make "
      "it. No hardware was there. Dashed: what the newest contact model asks for at the hand's place, "
      "without the coupling; drawn: what the device shows.");
  const ControllerOptions right = rightHand();
  const auto wish = [&](double t, Vector3d& position) {
    const Waypoint w = at(kWork, t);
    position = w.tip - right.arm.aim_B;
    return w.jaw;
  };
  {
    SimulatedDevice device;
    device.open({});
    std::int64_t now = 0;
    const auto samples = work(device, right, 16.5, [&](Trial& trial, double t) {
      Vector3d p;
      const double jaw = wish(t, p);
      for (int k = 0; k < 3; ++k) device.wish(k, p[k]);
      return trial.tick(now += 1000000, jaw);
    });
    judge(s, "simulated", samples, device.capabilities(), csv);
  }
  {
    void* library = ::dlopen(fake_hd.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (library == nullptr)
      throw std::runtime_error(std::string(::dlerror()) + "; allowed: the stand-in libvest_fake_hd.so");
    reinterpret_cast<void (*)()>(::dlsym(library, "fakehd_manual"))();
    const auto step = reinterpret_cast<void (*)(int)>(::dlsym(library, "fakehd_step"));
    const auto move = reinterpret_cast<void (*)(double, double, double)>(::dlsym(library, "fakehd_wish"));
    PhantomDevice device;
    device.open({{"library", fake_hd}});
    Pace pace;
    const auto samples = work(device, right, 16.5, [&](Trial& trial, double t) {
      Vector3d p;
      const double jaw = wish(t, p);
      move(p.x(), p.z(), -p.y());  // the maker's axes: y up, z to the user
      step(1);
      return trial.tick(pace.next(), jaw);
    });
    judge(s, "phantom", samples, device.capabilities(), csv);
    const int wrong = reinterpret_cast<int (*)()>(::dlsym(library, "fakehd_violations"))();
    s.atMost("phantom: calls out of the documented order", wrong, 0, "");
    device.close();
    ::dlclose(library);
  }
  {
    const std::string link = "/tmp/vest_trial_lie_" + std::to_string(::getpid());
    const std::string start =
        emulator + " --link " + link + " --force-link " + link + "_force --seconds 60 & echo $!";
    std::FILE* pipe = ::popen(start.c_str(), "r");
    int pid = 0;
    if (pipe == nullptr || std::fscanf(pipe, "%d", &pid) != 1)
      throw std::runtime_error(emulator + ": does not start");
    for (int i = 0; i < 300 && !std::filesystem::exists(link + "_force"); ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ImpulseEngineDevice device;
    device.open({{"port", link}, {"force", "emulator"}, {"force_port", link + "_force"}});
    // Its hand goes from 0.12 to 0.14 m of insertion: a trocar from which that ends at the tube.
    ControllerOptions options = right;
    const Vector3d place(0.0476, 0.0546, 0.0622), along = (place - right.arm.pivot_B).normalized();
    options.arm.pivot_B = place - 0.139 * along;
    options.arm.aim_B = place;
    options.arm.X_BTrocar = kinematics::trocarFrame(options.arm.pivot_B, options.arm.aim_B);
    Pace pace;
    double deepest = 0.0, last = 0.0, jaw = 0.95;
    const auto samples = work(device, options, 16.5, [&](Trial& trial, double) {
      const TrialSample& sample = trial.tick(pace.next(), jaw);
      const double in = (sample.tip - options.arm.pivot_B).norm();
      // Close on the way back from the deepest point, open again near the top.
      deepest = in > last ? in : deepest;
      const bool hold = in < last + 1e-7 && in > 0.1235 && deepest > 0.137;
      jaw = hold ? std::max(0.0, jaw - 0.004) : (in < 0.1235 ? std::min(0.95, jaw + 0.004) : jaw);
      last = in;
      return sample;
    });
    judge(s, "impulse_engine", samples, device.capabilities(), csv);
    device.close();
    ::kill(pid, SIGTERM);
    ::pclose(pipe);
  }
  return s;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("What the hand feels: sections with figures, tables and bounds");
  std::string output = "docs/haptics", csv;
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  std::string emulator = here / "impulse_engine_emulator", fake = here.parent_path() / "libvest_fake_hd.so";
  bool only_specimens = false;
  app.add_option("--output", output, "folder of the sections")->capture_default_str();
  app.add_option("--csv", csv, "folder for every millisecond of the work in the scene");
  app.add_option("--fake-hd", fake, "stand-in of libHD")->capture_default_str();
  app.add_option("--emulator", emulator, "emulator of the Impulse Engine")->capture_default_str();
  app.add_flag("--specimens", only_specimens, "slabs and strips alone");
  CLI11_PARSE(app, argc, argv);
  try {
    bool good = true;
    const auto keep = [&](const validation::Section& s) {
      s.write(output);
      std::printf("%s: %s\n%s", s.stem().c_str(), s.passed() ? "all claims hold" : "CLAIMS FAIL",
                  s.failures().c_str());
      good = good && s.passed();
    };
    keep(specimens());
    if (!only_specimens) keep(gynaecology(fake, emulator, csv));
    return good ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "haptics_trials: %s\n", e.what());
    return 2;
  }
}
