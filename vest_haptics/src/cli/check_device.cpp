// The conformance suite on any plug-in: `rosrun vest_haptics check_device mine/MyDevice --option
// port=/dev/ttyS0`
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <new>

#include <CLI/CLI.hpp>

#include "../ros/device_plugins.h"
#include "vest_haptics/conformance/conformance.h"
#include "vest_instruments/files/option.h"

namespace {
thread_local std::uint64_t allocations = 0;
}
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
  std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
  std::free(p);
}

int main(int argc, char** argv) {
  using namespace vest::haptics;
  CLI::App app(
      "What every haptic device plug-in must do, tried on one. Hold the handle: a small force is shown.");
  std::string name;
  std::vector<std::string> words;
  conformance::Options options;
  bool no_force = false;
  app.add_option("plugin", name, "word of the launch files or class name, e.g. vest_haptics/Simulated")
      ->required();
  app.add_option("--option", words, "KEY=VALUE of the device, may be repeated");
  app.add_option("--seconds", options.seconds, "of motion that is watched")
      ->check(vest::files::number(0, 3600))
      ->capture_default_str();
  app.add_flag("--no-force", no_force, "do not show the small force");
  CLI11_PARSE(app, argc, argv);
  options.small_force = !no_force;
  options.allocations = [] { return allocations; };
  for (const std::string& w : words) {
    const auto at = w.find('=');
    if (at == std::string::npos) {
      std::fprintf(stderr, "check_device: --option %s; allowed: KEY=VALUE\n", w.c_str());
      return 2;
    }
    options.device[w.substr(0, at)] = w.substr(at + 1);
  }
  try {
    vest::ros_shell::DevicePlugins plugins;
    const boost::shared_ptr<Device> device = plugins.create(name);
    int broken = 0;
    for (const conformance::Finding& f : conformance::run(*device, options)) {
      std::printf("%s  %s%s%s\n", f.kept ? "kept  " : "BROKEN", f.promise.c_str(),
                  f.kept || f.detail.empty() ? "" : ": ", f.kept ? "" : f.detail.c_str());
      broken += !f.kept;
    }
    std::printf("%s: %d broken\n", name.c_str(), broken);
    return broken == 0 ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "check_device: %s\n", e.what());
    return 2;
  }
}
