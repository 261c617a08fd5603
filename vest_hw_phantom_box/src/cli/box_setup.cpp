// A new box: looks at it, asks a person through its calibration, finds its pivots, keeps its bytes.
#include <unistd.h>
#include <csignal>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <fstream>
#include <functional>
#include <iostream>
#include <mutex>
#include <optional>
#include <sstream>
#include <thread>
#include <utility>

#include "vest_hw_phantom_box/calibration/guide.h"
#include "vest_hw_phantom_box/driver/driver.h"
#include "vest_hw_phantom_box/transport/raw_log.h"
#include "vest_hw_phantom_box/transport/serial_port.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_instruments/kinematics/fit_trocar.h"

namespace {

using namespace vest;
using calibration::Calibration;
using protocol::kAxes;
using protocol::kJoints;

std::atomic<bool> g_stop{false};

std::int64_t steadyNow() {
  return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
}

struct Options {
  std::string port, log, calibration, output, layout, arm;
  std::vector<std::string> arms{"left", "right", "third", "endoscope"};
  unsigned baud_rate = 921600;
  double seconds = 0;
  bool csv = false;
};

int armIndex(const std::string& name) {
  int i = 0;
  while (protocol::armNames()[i] != name) ++i;
  return i;
}

/// Reads the line in a thread of its own.
class Box : private protocol::FrameSink {
 public:
  Box(const Options& o, const Calibration& c) : driver_(c) {
    const std::string error = port_.open(o.port, o.baud_rate);
    if (!error.empty()) throw std::runtime_error("--port " + o.port + ": " + error);
    const std::string wrong = o.log.empty() ? "" : log_.open(o.log);
    if (!wrong.empty()) throw std::runtime_error("--log " + o.log + ": " + wrong);
    driver_.connected(steadyNow());
    thread_ = std::thread([this] { run(); });
  }
  ~Box() {
    port_.wake();
    thread_.join();
  }
  /// Called under the lock, with what is known now.
  template <class F>
  auto with(F f) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return f();
  }
  /// Frames that came after this call.
  calibration::Still still() {
    std::unique_lock<std::mutex> lock(mutex_);
    reader_.forget();
    calibration::Still out;
    if (!frame_.wait_for(lock, std::chrono::seconds(10), [&] { return lost_ || reader_.read(out); }) || lost_)
      throw std::runtime_error("the box sends nothing more" +
                               (lost_ ? " (" + port_.error() + ")" : std::string()));
    return out;
  }
  protocol::Hello hello() {
    std::unique_lock<std::mutex> lock(mutex_);
    // A box that runs already may send frames before its next hello, a second later at most.
    if (!frame_.wait_for(lock, std::chrono::seconds(5),
                         [&] { return lost_ || (reader_.hasHello() && reader_.hasFrame()); }) ||
        !reader_.hasHello())
      throw std::runtime_error(
          "no box has said hello; allowed: a box that speaks docs/phantom_box_protocol.md at this "
          "--baud-rate");
    return reader_.hello();
  }
  bool lost() const { return lost_; }
  const calibration::StillReader& reader() const { return reader_; }
  driver::Driver& driver() { return driver_; }
  const protocol::DecoderCounters& wire() const { return decoder_.counters(); }
  /// Called for each frame, in the reading thread. Set under the lock.
  std::function<void(const protocol::Motion&)> on_frame;

 private:
  void run() {
    std::array<std::uint8_t, 4096> bytes;
    for (;;) {
      std::size_t size = 0;
      const auto got = port_.read(bytes.data(), bytes.size(), 100, size);
      if (got == transport::SerialPort::Read::kWoken) return;
      const std::lock_guard<std::mutex> lock(mutex_);
      if (got == transport::SerialPort::Read::kClosed) lost_ = true;
      if (got == transport::SerialPort::Read::kData) {
        if (log_.isOpen()) log_.write(steadyNow(), bytes.data(), size);
        decoder_.feed(bytes.data(), size, *this);
      }
      frame_.notify_all();
      if (lost_) return;
    }
  }
  void onHello(const protocol::Hello& hello, std::uint32_t time_us) override {
    reader_.onHello(hello, time_us);
    driver_.hello(hello, steadyNow());
  }
  void onMotion(const protocol::Motion& motion) override {
    reader_.onMotion(motion);
    driver_.motion(motion, steadyNow());
    if (on_frame) on_frame(motion);
  }

  std::mutex mutex_;
  std::condition_variable frame_;
  transport::SerialPort port_;
  transport::RawLog log_;
  protocol::Decoder decoder_;
  calibration::StillReader reader_;
  driver::Driver driver_;
  std::atomic<bool> lost_{false};
  std::thread thread_;
};

Calibration given(const Options& o) {
  return o.calibration.empty() ? calibration::defaultCalibration()
                               : calibration::loadCalibration(o.calibration);
}

// The line that was typed; the end of the input ends the program.
std::string ask(const std::string& question) {
  std::printf("%s\n", question.c_str());
  std::fflush(stdout);
  std::string line;
  if (!std::getline(std::cin, line)) throw std::runtime_error("the input has ended; nothing was written");
  line.erase(0, line.find_first_not_of(" \t\r"));
  line.erase(line.find_last_not_of(" \t\r") + 1);
  return line;
}

void write(const std::string& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  out.close();
  if (!out) throw std::runtime_error("--output " + path + ": cannot be written");
  std::printf("written: %s\n", vest::files::shown(path, 6000).c_str());
}

void calibrate(const Options& o) {
  const Calibration start = given(o);
  Box box(o, start);
  const protocol::Hello hello = box.hello();
  std::vector<int> arms;
  for (const std::string& name : o.arms) {
    const int arm = armIndex(name);
    if (arm == 2 && hello.instruments < 3) continue;
    arms.push_back(arm);
  }
  calibration::Guide guide(start, arms, hello.light_post);
  std::printf("box %s, %d instruments\n", vest::files::shown(hello.serial_number).c_str(), hello.instruments);
  while (!guide.done()) {
    const std::string line = ask(guide.question());
    const std::string wrong = guide.answer(line, box.still());
    if (!wrong.empty()) std::printf("not taken: %s\n", wrong.c_str());
  }
  const std::string text = toYaml(
      guide.calibration(), "Calibration of the box " + hello.serial_number + ", by box_setup calibrate.");
  calibration::parseCalibration(text, o.output);  // never a file that the driver refuses
  write(o.output, text);
}

// Joints of an arm as the calibration reads them.
kinematics::JointPositions joints(const Calibration& c, int arm, const calibration::Still& still) {
  const auto at = [&](int axis) {
    const calibration::Joint& j = c.joints[arm * kAxes + axis];
    return j.sign * j.per_count * (still.count[arm * kAxes + axis] - j.zero_count);
  };
  return {at(0), at(1), at(2), at(3), 0.0};
}

std::string vectorText(const Eigen::Vector3d& v) {
  char text[100];
  std::snprintf(text, sizeof text, "[%.5f, %.5f, %.5f]", v.x(), v.y(), v.z());
  return text;
}

// The layout with another pivot and aim of one arm: all other lines as they are.
std::string replaced(const std::string& layout, const std::string& arm, const kinematics::TrocarFit& fit) {
  std::istringstream in(layout);
  std::string out, line;
  bool inside = false;
  while (std::getline(in, line)) {
    if (line.rfind("  ", 0) == 0 && line.size() > 2 && line[2] != ' ')
      inside = line.rfind("  " + arm + ":", 0) == 0;
    if (inside && line.rfind("    pivot:", 0) == 0) line = "    pivot: " + vectorText(fit.pivot_B);
    if (inside && line.rfind("    aim:", 0) == 0) line = "    aim: " + vectorText(fit.aim_B);
    out += line + '\n';
  }
  return out;
}

void pivot(const Options& o) {
  const Calibration c = given(o);
  const std::string layout = files::read(o.layout, 1 << 16);
  const kinematics::TrainerBox guess = kinematics::loadTrainerBox(o.layout);
  const int arm = armIndex(o.arm);
  // The layout's order is left, right, third, endoscope, as the box's.
  const kinematics::TrainerArm& first = guess.arms[static_cast<std::size_t>(arm)];
  if (!first.present) throw std::runtime_error("--layout " + o.layout + ": has no " + o.arm);
  Box box(o, c);
  box.hello();
  std::vector<kinematics::Touch> touches;
  for (;;) {
    const std::string line = ask("touch a known point with the closed tip of " + o.arm +
                                 ", hold still, and type its place in the box: x y z in mm (" +
                                 std::to_string(touches.size()) + " so far; Enter: enough)");
    if (line.empty() && touches.size() >= 3) break;
    std::istringstream in(line);
    in.imbue(std::locale::classic());
    Eigen::Vector3d p;
    std::string rest;
    if (!(in >> p.x() >> p.y() >> p.z()) || (in >> rest) || !(p.cwiseAbs().maxCoeff() < 2000)) {
      std::printf("not taken: '%s' (allowed: three numbers in mm; three points at least)\n",
                  line.substr(0, 60).c_str());
      continue;
    }
    const calibration::Still still = box.still();
    bool rests = true;
    for (int axis = 0; axis < 3; ++axis) rests &= still.rests[arm * kAxes + axis];
    if (!rests) {
      std::printf("not taken: %s does not rest, or is not measured; hold it still\n", o.arm.c_str());
      continue;
    }
    touches.push_back({1e-3 * p, joints(c, arm, still)});
  }
  const kinematics::TrocarFit fit = kinematics::fitTrocar(touches, first.pivot_B, first.aim_B);
  std::printf("pivot %s, aim %s; the points are met within %.2f mm\n", vectorText(fit.pivot_B).c_str(),
              vectorText(fit.aim_B).c_str(), 1e3 * fit.error);
  const std::string text = replaced(layout, o.arm, fit);
  write(o.output, text);
  kinematics::loadTrainerBox(o.output);  // what the loader refuses is told here
}

// One line a joint: place within the limits as a bar, counts, position, what was seen.
void show(Box& box, const Calibration& c, std::array<std::pair<double, double>, kJoints>& seen, double rate) {
  std::string out = "\033[H\033[J";
  box.with([&] {
    const auto& hello = box.reader().hello();
    char line[200];
    std::snprintf(line, sizeof line, "box %s  %.0f of %d Hz  %s  CRC errors %llu  lost %llu\n",
                  hello.serial_number.c_str(), rate, hello.rate_hz, toString(box.driver().state(steadyNow())),
                  static_cast<unsigned long long>(box.wire().crc_errors),
                  static_cast<unsigned long long>(box.wire().lost));
    out += line;
    const auto& motion = box.reader().last();
    for (int j = 0; j < kJoints; ++j) {
      if (!box.driver().has(j)) continue;
      const double x = box.driver().sample().joints[j].position;
      const bool usable = box.driver().usable(j);
      auto& [low, high] = seen[j];
      if (usable) low = std::min(low, x), high = std::max(high, x);
      std::string bar(31, '.');
      const auto& limits = c.joints[j];
      const double least = limits.continuous ? -M_PI : limits.min,
                   most = limits.continuous ? M_PI : limits.max;
      const double along = std::clamp((limits.near(x, 0) - least) / (most - least), 0.0, 1.0);
      if (usable) bar[static_cast<std::size_t>(std::lround(30 * along))] = '#';
      std::snprintf(line, sizeof line, "%-22s %6d %9.4f [%s] seen %.4f ... %.4f %s\n",
                    protocol::jointNames()[j].c_str(), motion.counts[j], x, bar.c_str(), low, high,
                    usable ? "" : "NOT USABLE");
      out += line;
    }
    out += "footswitches ";
    for (int i = 0; i < protocol::kFootswitches; ++i) out += motion.footswitches >> i & 1 ? '#' : '.';
    out += '\n';
  });
  std::fputs(out.c_str(), stdout);
  std::fflush(stdout);
}

/// The table of `--csv`: a row for each frame, so that a reading that leaps once is in it.
class Table {
 public:
  Table(Box& box, const Calibration& c) : box_(box), calibration_(c) {
    rows_ = "t_s";
    for (const std::string& name : protocol::jointNames()) rows_ += ',' + name + ',' + name + "_raw";
    rows_ += ",footswitches,lost,crc_errors\n";
    box.with([&] { box.on_frame = [this](const protocol::Motion& m) { add(m); }; });
  }
  ~Table() {
    box_.with([&] { box_.on_frame = {}; });
  }
  /// Prints what has come. @return false where nobody reads it any more
  bool print() {
    const std::string rows = box_.with([&] { return std::exchange(rows_, {}); });
    std::fwrite(rows.data(), 1, rows.size(), stdout);
    return std::fflush(stdout) == 0;
  }

 private:
  static constexpr std::size_t kMost = 1 << 24;  ///< bytes that wait for a reader who stands still

  void add(const protocol::Motion& m) {
    // By the box's clock. Where it begins anew, time goes on, by no more than the host's has.
    const std::int64_t now = steadyNow();
    const std::int64_t step = 1000 * std::int64_t{static_cast<std::int32_t>(m.time_us - last_us_)};
    if (last_ > 0) time_ += std::clamp<std::int64_t>(step, 0, now - last_ + 1000000000);
    last_ = now;
    last_us_ = m.time_us;
    if (rows_.size() > kMost) return;
    number(1e-9 * static_cast<double>(time_));
    for (int j = 0; j < kJoints; ++j) {
      const driver::Driver& driver = box_.driver();
      const double x = driver.sample().joints[j].position;
      rows_ += ',';
      if (driver.usable(j)) number(x);
      rows_ += ',';
      const calibration::Joint& c = calibration_.joints[j];
      if (driver.has(j) && !(m.invalid >> j & 1) && m.counts[j] != protocol::kNoReading)
        number(c.near(c.position(m.counts[j]), x));
    }
    const auto& wire = box_.wire();
    rows_ += ',' + std::to_string(m.footswitches) + ',' + std::to_string(wire.lost) + ',' +
             std::to_string(wire.crc_errors) + '\n';
  }
  void number(double x) {
    char text[40];
    rows_.append(text, static_cast<std::size_t>(std::snprintf(text, sizeof text, "%.6f", x)));
  }

  Box& box_;
  Calibration calibration_;
  std::string rows_;
  std::int64_t time_ = 0, last_ = 0;  // ns
  std::uint32_t last_us_ = 0;
};

void watch(const Options& o) {
  const Calibration c = given(o);
  Box box(o, c);
  box.hello();
  std::array<std::pair<double, double>, kJoints> seen;
  seen.fill({1e9, -1e9});
  std::optional<Table> table;
  if (o.csv) table.emplace(box, c);
  const std::int64_t begin = steadyNow(), period = 100000000;
  std::uint64_t frames = 0;
  for (std::int64_t next = begin; !g_stop && !box.lost(); next += period) {
    if (o.seconds > 0 && steadyNow() - begin > static_cast<std::int64_t>(o.seconds * 1e9)) return;
    if (table) {
      if (!table->print()) return;
    } else {
      const std::uint64_t now = box.with([&] { return box.wire().motions; });
      show(box, c, seen, static_cast<double>(now - frames) / (static_cast<double>(period) * 1e-9));
      frames = now;
    }
    std::this_thread::sleep_for(std::chrono::nanoseconds(next + period - steadyNow()));
  }
  if (table) table->print();
  if (box.lost()) throw std::runtime_error("--port " + o.port + ": the box is gone");
}

void common(CLI::App* app, Options& o, bool output) {
  app->add_option("--port", o.port, "serial device of the box, for example /dev/ttyUSB0")->required();
  app->add_option("--baud-rate", o.baud_rate, "baud")
      ->check(CLI::Range(9600, 4000000))
      ->capture_default_str();
  app->add_option("--calibration", o.calibration, "YAML file (default: the values of config/default.yaml)");
  app->add_option("--log", o.log,
                  "keep every byte of the line in this file; phantom_box_emulator --replay sends it again");
  if (output) app->add_option("--output", o.output, "YAML file to write")->required();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Sets a trainer box up (vest_hw_phantom_box/README.md)"};
  app.require_subcommand(1);
  Options o;
  const std::vector<std::string> names(protocol::armNames().begin(), protocol::armNames().end());
  auto* watching = app.add_subcommand("watch", "shows joints, pedals and errors of the line");
  common(watching, o, false);
  watching->add_flag("--csv", o.csv,
                     "a table instead of a screen, a row for each frame: of each joint what the driver "
                     "takes, and what the line reads");
  watching->add_option("--seconds", o.seconds, "end after this time (0: at Ctrl-C)")
      ->check(vest::files::number(0, 1e9));
  auto* calibrating =
      app.add_subcommand("calibrate", "asks for zero, direction, scale and limits of each joint");
  common(calibrating, o, true);
  calibrating->add_option("--arms", o.arms, "which of them")->delimiter(',')->check(CLI::IsMember(names));
  auto* finding =
      app.add_subcommand("pivot", "finds a trocar's pivot and aim from points that the tip touches");
  common(finding, o, true);
  finding
      ->add_option("--layout", o.layout,
                   "layout to begin with, for example vest_instruments/config/trainer_box.yaml")
      ->required();
  finding->add_option("--arm", o.arm, "which of them")->check(CLI::IsMember(names))->required();
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGPIPE, SIG_IGN);
  const auto stop = [](int) { g_stop = true; };
  if (watching->parsed()) std::signal(SIGINT, stop), std::signal(SIGTERM, stop);
  try {
    if (watching->parsed()) watch(o);
    if (calibrating->parsed()) calibrate(o);
    if (finding->parsed()) pivot(o);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "box_setup: %s\n", e.what());
    return 1;
  }
  return 0;
}
