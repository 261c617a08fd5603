#include "vest_haptics/device/impulse_engine.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <sstream>
#include <vector>

#include "vest_haptics/device/realtime.h"
#include "vest_instruments/files/read.h"

namespace vest::haptics {
namespace {

Loads fiveNumbers(const DeviceOptions& options, const std::string& key, const Loads& otherwise) {
  const std::string text = option(options, key, "");
  if (text.empty()) return otherwise;
  std::string plain = text;
  for (char& c : plain) {
    if (c == ',' || c == '[' || c == ']') c = ' ';
  }
  std::istringstream in(plain);
  std::vector<double> numbers;
  bool sound = true;
  for (std::string word; in >> word;) {
    numbers.push_back(0.0);
    sound &= files::parseNumber(word, numbers.back());
  }
  Loads out{};
  if (!sound || numbers.size() != out.size())
    throw DeviceError("Impulse Engine: option '" + key + "' = '" + text + "'; allowed: five numbers");
  std::copy(numbers.begin(), numbers.end(), out.begin());
  return out;
}

}  // namespace

ImpulseEngineDevice::ImpulseEngineDevice() {
  capabilities_.model = "Laparoscopic Impulse Engine";
  capabilities_.joints = true;
  capabilities_.buttons = 7;
  capabilities_.rate = 700.0;  // 16 bytes and a request at 115200 baud
  capabilities_.workspace = {0.6, 0.6, 0.06, 1.5, 0.5};
  capabilities_.damping = 0.05;  // assumed: cable drives and a shaft in a bearing
}

ImpulseEngineDevice::~ImpulseEngineDevice() {
  close();
}

void ImpulseEngineDevice::open(const DeviceOptions& options) {
  checkOptions("Impulse Engine", options, "port baud force force_port counts home maximum_force");
  close();
  port_ = option(options, "port", "/dev/ttyS0");
  baud_ = static_cast<unsigned>(numberOption(options, "baud", 115200, 9600, 115200));
  counts_ = fiveNumbers(options, "counts", {2000, 2000, 20000, 1000, 2000});
  home_ = fiveNumbers(options, "home", {0.0, 0.0, 0.12, 0.0, 0.5});
  for (const double c : counts_) {
    if (c == 0.0)
      throw DeviceError("Impulse Engine: option 'counts' holds a 0; allowed: counts per rad or m, not 0");
  }
  const double force = numberOption(options, "maximum_force", 8.0, 0.1, 20.0);
  capabilities_.maximum = {0.12 * force, 0.12 * force, force, 0.05, 0.2};
  const std::string kind = option(options, "force", "none");
  if (kind == "none") {
    capabilities_.force = false;
  } else if (kind == "emulator") {
    transport_ = std::make_unique<EmulatorTransport>();
  } else {
    library_ = ::dlopen(kind.c_str(), RTLD_NOW | RTLD_LOCAL);
    auto* make = library_ ? reinterpret_cast<ForceTransport* (*)()>(::dlsym(library_, "vest_force_transport"))
                          : nullptr;
    if (!make) {
      throw DeviceError("Impulse Engine: option 'force' = '" + kind +
                        "'; allowed: none, emulator, or a library with the function vest_force_transport "
                        "(the maker's force "
                        "protocol is not public: docs/haptics/impulse_engine.md)");
    }
    transport_.reset(make());
    if (!transport_)
      throw DeviceError("Impulse Engine: option 'force' = '" + kind +
                        "': its vest_force_transport gave none; allowed: a transport");
  }
  begin();
  stop_ = false;
  if (transport_) {
    force_port_ = option(options, "force_port", "");
    transport_->open(force_port_, capabilities_.maximum);
    capabilities_.force = true;
    capabilities_.watchdog = transport_->watchdog();
    capabilities_.delay = transport_->delay();
    forces_ = std::thread([this] { serveForces(); });
  }
  const std::string wrong = tty_.open(port_, baud_);
  if (!wrong.empty()) {
    close();
    throw DeviceError("Impulse Engine: " + wrong);
  }
  if (!connect()) {
    close();
    throw DeviceError("Impulse Engine: port '" + port_ + "' does not answer at " + std::to_string(baud_) +
                      " baud: is it switched on, is it this port, is its baud switch at another rate?");
  }
  capabilities_.model = "Laparoscopic Impulse Engine (" + product_ + ")";
  thread_ = std::thread([this] { serve(); });
}

void ImpulseEngineDevice::close() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  if (forces_.joinable()) forces_.join();
  if (transport_) {
    transport_->write(Loads{});
    transport_->close();
    transport_.reset();
  }
  if (library_) ::dlclose(library_);
  library_ = nullptr;
  if (tty_.isOpen()) {
    tty_.write(&hci::kEndSession, 1);
    tty_.close();
  }
  setStatus(DeviceStatus::Starting);
}

// Handshake of hci.h. True once the product has named itself.
bool ImpulseEngineDevice::connect() {
  using clock = std::chrono::steady_clock;
  const auto limit = clock::now() + std::chrono::seconds(1);
  std::uint8_t buffer[64];
  tty_.write(&hci::kEndSession, 1);
  std::string heard;
  bool echoed = false;
  auto next = clock::now();
  while (!echoed) {
    if (stop_ || clock::now() > limit) return false;
    if (clock::now() >= next) {
      if (!tty_.write(hci::kSync, 4)) return false;
      next = clock::now() + std::chrono::milliseconds(15);
    }
    const int n = tty_.read(buffer, sizeof buffer, 5);
    if (n < 0) return false;
    heard.append(reinterpret_cast<char*>(buffer), static_cast<std::size_t>(n));
    echoed = heard.find(hci::kSync) != std::string::npos;
    if (heard.size() > 4096) heard.erase(0, 4000);
  }
  if (!tty_.write(hci::kBegin, 5)) return false;
  heard.clear();
  while (true) {
    if (stop_ || clock::now() > limit) return false;
    const int n = tty_.read(buffer, sizeof buffer, 5);
    if (n < 0) return false;
    heard.append(reinterpret_cast<char*>(buffer), static_cast<std::size_t>(n));
    const auto end = heard.find('\0');
    if (end == std::string::npos) continue;
    // Late echoes of IMMC may stand in front.
    std::string name = heard.substr(0, end);
    for (auto at = name.find(hci::kSync); at != std::string::npos; at = name.find(hci::kSync))
      name.erase(at, 4);
    product_ = name;
    return true;
  }
}

void ImpulseEngineDevice::serve() {
  becomeRealTime("vest_lie_pose");
  hci::Decoder decoder(hci::kTimerSixEncoders);
  std::array<hci::Unwrap, kChannels> unwrap;
  hci::Answer answer;
  std::uint8_t buffer[128];
  while (!stop_) {
    if (!tty_.isOpen()) {
      setStatus(DeviceStatus::Unplugged);
      if (!tty_.open(port_, baud_).empty() || !connect()) {
        tty_.close();
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        continue;
      }
      decoder = hci::Decoder(hci::kTimerSixEncoders);
      unwrap = {};
    }
    const std::int64_t asked = steadyNow();
    bool answered = false, gone = !tty_.write(&hci::kTimerSixEncoders, 1);
    while (!answered && !gone && steadyNow() - asked < 5000000) {
      const int n = tty_.read(buffer, sizeof buffer, 1);
      gone = n < 0;
      for (int i = 0; i < n; ++i) answered |= decoder.push(buffer[i], answer);
    }
    if (answered) {
      Sample sample;
      for (std::size_t i = 0; i < kChannels; ++i) {
        sample.joints[i] = home_[i] + static_cast<double>(unwrap[i].update(answer.encoders[i])) / counts_[i];
      }
      sample.buttons = answer.buttons;
      deliver(sample, asked);  // measured after that, at the earliest
      setStatus(DeviceStatus::Ok);
      silent_since_ = 0;
    } else {
      if (silent_since_ == 0) silent_since_ = asked;
      if (gone || steadyNow() - silent_since_ > 15000000) {
        setStatus(DeviceStatus::Unplugged);
        tty_.close();
        silent_since_ = 0;
      }
    }
  }
}

// Nothing here waits for the position line. While that gives no poses, wanted() is zero. So it is once this
// line was gone, and then it goes out as soon as the line is back: until then the motors may hold what came
// last.
void ImpulseEngineDevice::serveForces() {
  constexpr std::int64_t kAgain = 100000000;  // ns between two looks at a line that is gone, assumed
  becomeRealTime("vest_lie_force");
  bool gone = false;
  std::int64_t look = 0;
  auto due = std::chrono::steady_clock::now();
  while (!stop_) {
    const std::int64_t now = steadyNow();
    const Loads loads = wanted(now);
    if (gone && now >= look) {
      gone = !reopenForces();
      look = now + kAgain;
    }
    gone = gone || !transport_->write(loads);
    if (gone) fail(kForceGone);
    due = std::max(due + std::chrono::milliseconds(1), std::chrono::steady_clock::now());
    std::this_thread::sleep_until(due);
  }
}

bool ImpulseEngineDevice::reopenForces() noexcept {
  try {
    transport_->close();
    transport_->open(force_port_, capabilities_.maximum);
    return true;
  } catch (...) {  // of a lab's library, anything: the next look may find the line
    return false;
  }
}

std::string ImpulseEngineDevice::describe(std::uint32_t code) const {
  return code == kForceGone ? "the force side does not take forces any more"
                            : "error " + std::to_string(code);
}

}  // namespace vest::haptics
