// A trainer box on a pseudo-terminal: plays a trajectory through the protocol at 1 kHz.
#include <signal.h>
#include <sys/prctl.h>
#include <time.h>

#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <vest_msgs/ContactModels.h>
#include <vest_msgs/SessionState.h>
#include <vest_msgs/StringStamped.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>
#include <vector>

#include "vest_hw_phantom_box/emulator/emulator.h"
#include "vest_hw_phantom_box/emulator/pseudo_terminal.h"
#include "vest_hw_phantom_box/emulator/script_clock.h"
#include "vest_hw_phantom_box/transport/raw_log.h"
#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"

namespace {

using namespace vest;

volatile sig_atomic_t g_stop = 0;
void onSignal(int) {
  g_stop = 1;
}

constexpr std::int64_t kPeriod = 1000000;       // ns
constexpr std::int64_t kIdle = 5000000;         // ns, while nobody listens
constexpr std::int64_t kPatience = 5000000000;  // ns: so long a replay waits for who reads nothing
constexpr std::int64_t kEnd = 1000000000;  // ns, after a replay: what was sent is read before the line goes

std::int64_t steadyNow() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec * 1000000000LL + t.tv_nsec;
}

void sleepUntil(std::int64_t when) {
  const timespec t{when / 1000000000LL, when % 1000000000LL};
  while (!g_stop && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr) == EINTR) {
  }
}

struct Options {
  std::string link, trajectory, replay, calibration, interpolation = "linear",
                                                     serial_number = "VEST-EMULATOR";
  bool loop = false, hold = false, pace = false, start_on_open = true;
  int instruments = 3;
  double max_gap = 0.5, seconds = 0, unplug_at = -1, unplug_for = 1, unplug_every = 0;
  emulator::Faults faults;
};

void declare(CLI::App& app, Options& o) {
  app.add_option("--link", o.link, "make a symbolic link to the pseudo-terminal at this path");
  app.add_option("--trajectory", o.trajectory, "CSV file to play (default: a small built-in motion)");
  app.add_option("--replay", o.replay,
                 "log of raw bytes (raw_log of the driver): they are sent again as they came")
      ->excludes("--trajectory");
  app.add_flag(
         "--pace", o.pace,
         "the trajectory follows the session in its namespace (tissue/contacts), and its end is told there")
      ->excludes("--replay");
  app.add_option("--interpolation", o.interpolation, "between rows")
      ->check(CLI::IsMember({"linear", "cubic"}))
      ->capture_default_str();
  auto* loop = app.add_flag("--loop", o.loop, "begin again at the end");
  app.add_flag("--hold", o.hold, "keep the last row at the end (default)")->excludes(loop);
  app.add_option("--max-gap", o.max_gap, "s; rows further apart are a drop-out, never bridged")
      ->check(vest::files::number(1e-3, 1e9))
      ->capture_default_str();
  app.add_flag("--start-on-open,!--no-start-on-open", o.start_on_open,
               "trajectory time starts when the first reader opens the port (default)");
  app.add_option("--calibration", o.calibration, "YAML file (default: the values of config/default.yaml)");
  app.add_option("--instruments", o.instruments, "2 or 3")->check(CLI::Range(2, 3))->capture_default_str();
  app.add_option("--serial-number", o.serial_number, "at most 16 characters")
      ->check([](const std::string& s) { return s.size() <= 16 ? "" : "at most 16 characters"; });
  app.add_option("--seconds", o.seconds, "end after this time (0: never)")
      ->check(vest::files::number(0, 1e9));
  const auto probability = [&](const char* name, double& value, const char* what) {
    app.add_option(name, value, what)->check(vest::files::number(0, 1));
  };
  probability("--drop", o.faults.drop, "probability that a frame vanishes");
  probability("--flip", o.faults.flip, "... that one to three bits turn over");
  probability("--split", o.faults.split, "... that a frame arrives in two parts, 1 ms apart");
  probability("--garbage", o.faults.garbage, "... of 1 to 40 random bytes before a frame");
  probability("--lose-bytes", o.faults.lose, "... that 1 to 20 bytes of a frame vanish");
  probability("--jump", o.faults.jump, "... that one joint leaps for one frame");
  probability("--invalid", o.faults.invalid, "... that one joint is flagged invalid for one frame");
  probability("--chatter", o.faults.chatter, "... that a pedal that changes bounces for 8 ms");
  app.add_option("--seed", o.faults.seed, "of all faults")->capture_default_str();
  app.add_option("--unplug-at", o.unplug_at, "s after start: hang up")->check(vest::files::number(0, 1e9));
  app.add_option("--unplug-for", o.unplug_for, "s until the port is back")
      ->check(vest::files::number(0, 1e6))
      ->capture_default_str();
  app.add_option("--unplug-every", o.unplug_every, "s between unpluggings (0: once)")
      ->check(vest::files::number(0, 1e9));
}

/// How far the simulation is, by ROS: 200 times a second by its steps, whose length its state tells.
class Pace {
 public:
  /// @throws std::runtime_error without a master
  Pace() {
    if (!ros::master::check()) throw std::runtime_error("--pace: no ROS master answers");
    ros::NodeHandle node;
    node.setCallbackQueue(&queue_);
    state_ = node.subscribe<vest_msgs::SessionState>("session/state", 2, [this](const auto& m) {
      if (m->step > 0)
        dt_ = m->simulated_time / static_cast<double>(m->step);
      else
        clock_.hear(0.0);  // it waits for the hands
    });
    clock_.hear(0.0);  // hands wait at the script's begin
    end_ = node.advertise<vest_msgs::StringStamped>("session/script_end", 1, true);
    contacts_ = node.subscribe<vest_msgs::ContactModels>(
        "tissue/contacts", 2, [this](const auto& m) { clock_.hear(dt_ * static_cast<double>(m->step)); });
  }
  double at(std::int64_t when) {
    queue_.callAvailable();
    return clock_.at(1e-9 * static_cast<double>(when));
  }
  void tellEnd(double script) {
    vest_msgs::StringStamped msg;
    msg.header.stamp = ros::Time::now();
    msg.string = "the script has ended at " + std::to_string(script) + " s";
    end_.publish(msg);
  }

 private:
  emulator::ScriptClock clock_;
  ros::CallbackQueue queue_;
  ros::Subscriber state_, contacts_;
  ros::Publisher end_;
  double dt_ = 1e-3;  ///< s: that of all scenes that are shipped, until it is told
};

class Program {
 public:
  explicit Program(const Options& options)
      : o_(options),
        calibration_(o_.calibration.empty() ? calibration::defaultCalibration()
                                            : calibration::loadCalibration(o_.calibration)),
        emulator_(calibration_, o_.instruments, o_.faults, o_.serial_number) {
    if (!o_.replay.empty()) {
      recorded_ = transport::readRawLog(o_.replay);
      std::printf("replay %s: %zu pieces, %.3f s\n", files::shown(o_.replay, 6000).c_str(),
                  recorded_.pieces.size(), static_cast<double>(recorded_.pieces.back().time_ns) * 1e-9);
    }
    if (o_.pace) pace_ = std::make_unique<Pace>();
    if (!o_.trajectory.empty()) {
      emulator::TrajectoryOptions t;
      t.interpolation =
          o_.interpolation == "cubic" ? emulator::Interpolation::kCubic : emulator::Interpolation::kLinear;
      t.at_end = o_.loop ? emulator::AtEnd::kLoop : emulator::AtEnd::kHold;
      t.max_gap = o_.max_gap;
      trajectory_ = emulator::Trajectory::load(o_.trajectory, t);
      std::printf("trajectory %s: %zu rows, %.3f s\n", files::shown(o_.trajectory, 6000).c_str(),
                  trajectory_->rows(), trajectory_->duration());
      for (const auto& g : trajectory_->gaps())
        std::printf("drop-out from %.3f s to %.3f s: joints are sent as invalid\n", g.begin, g.end);
    }
  }

  void run() {
    plug();
    begin_ = steadyNow();
    if (!o_.start_on_open) play_start_ = begin_;
    std::int64_t deadline = begin_;
    while (!g_stop) {
      const std::int64_t now = steadyNow();
      if (o_.seconds > 0 && now - begin_ >= static_cast<std::int64_t>(o_.seconds * 1e9)) break;
      handlePlug(now);
      if (!terminal_.hasReader()) {
        listening_ = false;
        deadline = now + kIdle;
        sleepUntil(deadline);
        continue;
      }
      if (!listening_) {
        listening_ = true;
        terminal_.flush();
        emulator_.restart();
        if (play_start_ < 0) play_start_ = now;
        deadline = now;
      }
      // A box keeps its rate whatever happens here: late ticks are sent at once, very late ones are lost.
      if (now - deadline > 100 * kPeriod) {
        const std::int64_t missed = (now - deadline) / kPeriod;
        emulator_.skip(static_cast<std::uint64_t>(missed));
        dropped_ += static_cast<std::uint64_t>(missed);
        deadline += missed * kPeriod;
      }
      if (recorded_.pieces.empty())
        send(deadline);
      else if (!sendRecorded(deadline))
        break;
      deadline += kPeriod;
      sleepUntil(deadline);
    }
    terminal_.close();
    std::printf("sent %llu frames, dropped %llu that nobody took\n", static_cast<unsigned long long>(sent_),
                static_cast<unsigned long long>(dropped_));
  }

 private:
  void plug() {
    terminal_.open(o_.link);
    listening_ = false;
    std::printf("port %s%s%s\n", terminal_.path().c_str(), o_.link.empty() ? "" : " link ",
                files::shown(o_.link, 6000).c_str());
    std::fflush(stdout);
  }

  void handlePlug(std::int64_t now) {
    if (o_.unplug_at < 0) return;
    const double t = static_cast<double>(now - begin_) * 1e-9 - o_.unplug_at;
    double phase = t;
    if (o_.unplug_every > 0 && t >= 0) phase = std::fmod(t, o_.unplug_every);
    const bool out = phase >= 0 && phase < o_.unplug_for;
    if (out && terminal_.isOpen()) terminal_.close();
    if (!out && !terminal_.isOpen()) plug();
  }

  void send(std::int64_t when) {
    const double t = pace_ ? pace_->at(when) : static_cast<double>(when - play_start_) * 1e-9;
    line_.clear();
    emulator_.tick(trajectory_ ? trajectory_->at(t) : emulator::defaultMotion(t), line_);
    if (terminal_.write(line_))
      ++sent_;
    else
      ++dropped_;
    if (pace_ && trajectory_ && !o_.loop && !end_told_ && t >= trajectory_->duration()) {
      end_told_ = true;
      pace_->tellEnd(t);
    }
  }

  // Of a replay: what was read up to this time. False at its end.
  bool sendRecorded(std::int64_t when) {
    const std::int64_t now = steadyNow();
    if (next_ == 0) taken_ = now;
    const auto& pieces = recorded_.pieces;
    while (next_ < pieces.size() && pieces[next_].time_ns <= when - play_start_) {
      const auto first = recorded_.file.begin() + static_cast<std::ptrdiff_t>(pieces[next_].first);
      line_.assign(first, first + static_cast<std::ptrdiff_t>(pieces[next_].size));
      if (terminal_.write(line_)) {
        ++sent_;
        taken_ = now, blocked_ = 0;
      } else {
        if (blocked_ == 0) blocked_ = now;
        if (now - blocked_ < kPatience) break;  // who reads late makes room again
        ++dropped_;
      }
      ++next_;
    }
    if (next_ == pieces.size() && o_.loop) {
      next_ = 0;
      play_start_ = when;
    }
    return next_ < pieces.size() || now - taken_ < kEnd;
  }

  Options o_;
  calibration::Calibration calibration_;
  emulator::Emulator emulator_;
  std::optional<emulator::Trajectory> trajectory_;
  std::unique_ptr<Pace> pace_;
  emulator::PseudoTerminal terminal_;
  protocol::Bytes line_;
  transport::RawRecording recorded_;
  std::size_t next_ = 0;
  bool listening_ = false, end_told_ = false;
  std::int64_t begin_ = 0, play_start_ = -1;
  std::int64_t taken_ = 0, blocked_ = 0;  ///< of a replay: the last piece, and since when there is no room
  std::uint64_t sent_ = 0, dropped_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Emulates a VEST trainer box on a pseudo-terminal (docs/phantom_box_protocol.md)"};
  Options options;
  declare(app, options);
  // Takes the remappings that roslaunch appends; without --pace nothing else of ROS is used.
  ros::init(argc, argv, "phantom_box_emulator",
            ros::init_options::NoSigintHandler | ros::init_options::NoRosout);
  CLI11_PARSE(app, argc, argv);
  struct sigaction action {};
  action.sa_handler = onSignal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGHUP, SIG_IGN);
  signal(SIGPIPE, SIG_IGN);
  prctl(PR_SET_TIMERSLACK, 1000UL);  // the default of 50 µs would show as jitter
  try {
    Program(options).run();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "phantom_box_emulator: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  }
  return 0;
}
