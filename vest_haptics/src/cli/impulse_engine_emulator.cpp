// A Laparoscopic Impulse Engine on two pseudo-terminals: positions by the HCI protocol, forces by the frames
// of force_transport.h, with a watchdog of its own and a simulated hand behind it. In a process of its own,
// so that killing the driver shows what the device does.
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <random>

#include <CLI/CLI.hpp>

#include "vest_haptics/device/force_transport.h"
#include "vest_haptics/device/hci.h"
#include "vest_haptics/device/simulated.h"
#include "vest_instruments/files/option.h"

namespace {

volatile std::sig_atomic_t stop = 0, pull = 0, pull_force = 0, hush = 0;

std::int64_t steadyNow() {
  timespec t{};
  ::clock_gettime(CLOCK_MONOTONIC, &t);
  return static_cast<std::int64_t>(t.tv_sec) * 1000000000 + t.tv_nsec;
}

void pullOrPlugIn(vest::haptics::Tty& line, const std::string& link) {
  if (line.isOpen())
    line.close();
  else if (const std::string wrong = line.openPseudo(link); !wrong.empty())
    std::fprintf(stderr, "impulse_engine_emulator: %s\n", wrong.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  using namespace vest::haptics;
  CLI::App app("Emulated Laparoscopic Impulse Engine on pseudo-terminals");
  std::string link = "/tmp/vest_impulse_engine", force_link = "/tmp/vest_impulse_engine_force", log_file,
              motion = "press";
  double seconds = 0.0, watchdog = 0.020, noise = 0.0;
  app.add_option("--link", link, "symbolic link of the position port")->capture_default_str();
  app.add_option("--force-link", force_link, "symbolic link of the force port")->capture_default_str();
  app.add_option(
      "--log", log_file,
      "CSV: steady_ns, the loads shown, force frames that came, whether the position line is there, "
      "every millisecond");
  app.add_option("--motion", motion, "what the hand wishes: rest, press, circle")->capture_default_str();
  app.add_option("--watchdog", watchdog, "s after the last force frame until forces are zero")
      ->check(vest::files::number(0, 3600))
      ->capture_default_str();
  app.add_option("--seconds", seconds, "end after this time; 0: never")
      ->check(vest::files::number(0, 1e9))
      ->capture_default_str();
  app.add_option("--noise", noise, "share of answered bytes that are spoiled or lost")
      ->check(vest::files::number(0, 1))
      ->capture_default_str();
  app.footer(
      "SIGUSR1 pulls the position line out and plugs it in again, SIGHUP the force line; SIGUSR2 leaves the "
      "position line in and answers no more.");
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGINT, [](int) { stop = 1; });
  std::signal(SIGTERM, [](int) { stop = 1; });
  std::signal(SIGUSR1, [](int) { pull = 1; });
  std::signal(SIGHUP, [](int) { pull_force = 1; });
  std::signal(SIGUSR2, [](int) { hush = 1; });

  Tty position, force;
  for (const std::string& wrong : {position.openPseudo(link), force.openPseudo(force_link)}) {
    if (!wrong.empty()) {
      std::fprintf(stderr, "impulse_engine_emulator: %s\n", wrong.c_str());
      return 2;
    }
  }
  std::FILE* log = log_file.empty() ? nullptr : std::fopen(log_file.c_str(), "w");
  if (log) std::setvbuf(log, nullptr, _IOLBF, 0);
  SimulatedDevice arm;
  try {
    arm.open({{"axes", "joints"},
              {"motion", motion},
              {"maximum_force", "8"},
              {"watchdog", std::to_string(watchdog)}});
  } catch (const DeviceError& e) {
    std::fprintf(stderr, "impulse_engine_emulator: %s\n", e.what());
    return 2;
  }
  arm.enableForces(true);
  const Loads counts{2000, 2000, 20000, 1000, 2000}, home{0.0, 0.0, 0.12, 0.0, 0.5};
  const Loads maximum = arm.capabilities().maximum;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  std::string heard;
  std::vector<std::uint8_t> frame;
  bool session = false;
  int frames = 0;  // force frames since the last line of the log
  const std::int64_t begin = steadyNow();
  std::int64_t due = begin;
  std::uint8_t buffer[256];
  while (!stop && (seconds <= 0.0 || 1e-9 * static_cast<double>(steadyNow() - begin) < seconds)) {
    for (int n = force.read(buffer, sizeof buffer, 0), i = 0; i < n; ++i) {
      frame.push_back(buffer[i]);
      if (frame[0] != 0xA5) frame.clear();
      if (frame.size() < force_frame::kSize) continue;
      std::uint8_t sequence = 0;
      Loads loads{};
      if (force_frame::decode(frame.data(), maximum, sequence, loads)) {
        arm.write(loads);
        ++frames;
        frame.clear();
      } else {
        frame.erase(frame.begin());
        while (!frame.empty() && frame[0] != 0xA5) frame.erase(frame.begin());
      }
    }
    if (pull) {
      pull = 0;
      session = false;
      pullOrPlugIn(position, link);
    }
    if (pull_force) {
      pull_force = 0;
      frame.clear();
      pullOrPlugIn(force, force_link);
    }
    if (!position.isOpen()) ::usleep(1000);
    const int n = position.isOpen() ? position.read(buffer, sizeof buffer, 1) : 0;
    for (int i = 0; i < n && !hush; ++i) {
      const std::uint8_t byte = buffer[i];
      if (byte == hci::kEndSession) {
        session = false;
        heard.clear();
      } else if (!session) {
        heard += static_cast<char>(byte);
        if (heard.size() >= 4 && heard.compare(heard.size() - 4, 4, hci::kSync) == 0)
          position.write(hci::kSync, 4);
        if (heard.size() >= 5 && heard.compare(heard.size() - 5, 5, hci::kBegin) == 0) {
          session = true;
          position.write("VEST LIE EMULATOR", 18);  // with its NUL
        }
      } else if (byte < 0x40) {
        Sample sample;
        arm.read(sample);
        hci::Answer answer;
        answer.timer = static_cast<int>((steadyNow() - begin) / 1000000) & 0x3fff;
        for (std::size_t k = 0; k < kChannels; ++k) {
          const long c = std::lround((sample.joints[k] - home[k]) * counts[k]) + hci::kEncoderRange / 2;
          answer.encoders[k] = static_cast<int>(c & (hci::kEncoderRange - 1));
        }
        std::uint8_t out[32], sent[32];
        const std::size_t size = hci::encode(byte, answer, out);
        std::size_t left = 0;
        for (std::size_t k = 0; k < size; ++k) {
          if (uniform(random) < noise) continue;  // lost
          sent[left++] = out[k];
        }
        position.write(sent, left);
      }
    }
    const std::int64_t now = steadyNow();
    for (; due <= now; due += 1000000) {
      arm.advance(0.001);
      if (log) {
        std::fprintf(log, "%lld,%.4f,%.4f,%.4f,%.4f,%.4f,%d,%d\n", static_cast<long long>(due),
                     arm.shown()[0], arm.shown()[1], arm.shown()[2], arm.shown()[3], arm.shown()[4], frames,
                     position.isOpen() && !hush);
        frames = 0;
      }
    }
  }
  if (log) std::fclose(log);
  return 0;
}
