// Protects: a new box is set up from byte to YAML. The box is emulated with signs, scales and zeros that the
// program has to find; the person is this test, who types what is asked.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <fstream>
#include <functional>
#include <thread>

#include "vest_hw_phantom_box/calibration/guide.h"
#include "vest_hw_phantom_box/driver/box_reader.h"
#include "vest_hw_phantom_box/emulator/emulator.h"
#include "vest_hw_phantom_box/emulator/pseudo_terminal.h"
#include "vest_instruments/kinematics/trainer_box.h"

namespace {

using namespace vest;
using protocol::kAxes;
using protocol::kJoints;

/// What nobody knows of this box.
calibration::Calibration hidden() {
  auto c = calibration::defaultCalibration();
  for (int j = 0; j < kJoints; ++j) {
    c.joints[j].sign = j % 2 ? -1 : 1;
    c.joints[j].zero_count = 100.0 * j - 700;
    c.joints[j].per_count *= 1.1 + 0.01 * j;
  }
  return c;
}

/// A box on a pseudo-terminal that holds the pose it is told.
class Rig {
 public:
  Rig() : emulator_(hidden(), 3) {
    terminal_.open();
    thread_ = std::thread([this] {
      bool listening = false;
      while (!stop_) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        if (terminal_.hasReader() && !listening) emulator_.restart();
        listening = terminal_.hasReader();
        protocol::Bytes line;
        emulator::Pose pose;
        {
          const std::lock_guard<std::mutex> lock(mutex_);
          pose = pose_;
        }
        emulator_.tick(pose, line);
        if (listening) terminal_.write(line);
      }
    });
  }
  ~Rig() {
    stop_ = true;
    thread_.join();
  }
  void hold(int joint, double position) {
    const std::lock_guard<std::mutex> lock(mutex_);
    pose_.joints[joint] = position;
  }
  const std::string& port() const { return terminal_.path(); }

 private:
  emulator::PseudoTerminal terminal_;
  emulator::Emulator emulator_;
  emulator::Pose pose_{};
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/// box_setup with a person in front of it.
class Program {
 public:
  explicit Program(const std::string& arguments) {
    std::signal(SIGPIPE, SIG_IGN);  // a program that has ended is a line that is missing, not our end
    int in[2], out[2];
    if (::pipe(in) != 0 || ::pipe(out) != 0) std::abort();
    child_ = ::fork();
    if (child_ == 0) {
      ::dup2(in[0], 0), ::dup2(out[1], 1);
      for (const int fd : {in[0], in[1], out[0], out[1]}) ::close(fd);
      ::execl("/bin/sh", "sh", "-c", ("exec " BOX_SETUP " " + arguments + " 2>&1").c_str(), nullptr);
      std::_Exit(127);
    }
    ::close(in[0]), ::close(out[1]);
    in_ = in[1];
    out_ = ::fdopen(out[0], "r");
  }
  ~Program() { std::fclose(out_); }
  /// The next line, without its end; empty at the end.
  std::string line() {
    char text[1000];
    std::string all = std::fgets(text, sizeof text, out_) ? text : "";
    said += all;
    if (!all.empty()) all.pop_back();
    return all;
  }
  void type(const std::string& text) {
    const std::string line = text + "\n";
    EXPECT_EQ(::write(in_, line.data(), line.size()), static_cast<ssize_t>(line.size()));
  }
  /// What is said of a text. On a busy machine the motion before it may still be among the readings: who is
  /// asked again answers again.
  std::string answer(const std::string& text) {
    std::string said_of_it;
    for (int tries = 0; tries < 100; ++tries) {
      type(text);
      said_of_it = line();
      if (said_of_it.find("does not rest") == std::string::npos) break;
      line();
    }
    return said_of_it;
  }
  int wait() {
    ::close(in_);
    while (!line().empty()) {
    }
    int status = 0;
    ::waitpid(child_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string said;

 private:
  pid_t child_;
  int in_;
  std::FILE* out_;
};

int jointIn(const std::string& question) {
  for (int j = 0; j < kJoints; ++j)
    if (question.find("] " + protocol::jointNames()[j] + ": ") != std::string::npos) return j;
  return -1;
}

TEST(BoxSetup, CalibrateFindsSignScaleZeroAndLimitsOfABox) {
  Rig rig;
  const std::string output = testing::TempDir() + "/vest_new_box.yaml";
  Program program("calibrate --port " + rig.port() + " --arms left,endoscope --output " + output);
  EXPECT_NE(program.line().find("box VEST-EMULATOR"), std::string::npos) << program.said;
  bool mistaken = false;
  for (std::string q = program.line(); q.find("written: ") != 0; q = program.line()) {
    ASSERT_FALSE(q.empty()) << program.said;
    if (q.find("not taken:") == 0) continue;
    const int j = jointIn(q);
    ASSERT_GE(j, 0) << q;
    if (q.find("type the mm") != std::string::npos) {
      rig.hold(j, 0.080);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      program.type("80");
    } else if (q.find("type the degrees") != std::string::npos) {
      if (!mistaken) {  // the wrong joint is moved first, and words are typed
        mistaken = true;
        program.type("far");
        EXPECT_NE(program.line().find("'far' (allowed: a number above 0)"), std::string::npos)
            << program.said;
        program.line();
        rig.hold(j + 1, 0.5);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        EXPECT_NE(program.answer("30").find("left_pitch moved, and not left_yaw"), std::string::npos)
            << program.said;
        program.line();
        rig.hold(j + 1, 0);
      }
      rig.hold(j, M_PI / 6);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      program.type("30");
    } else {
      rig.hold(j, q.find("one end") != std::string::npos     ? -0.01 * (j + 1)
                  : q.find("other end") != std::string::npos ? 0.2
                                                             : 0);
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      program.type("");
    }
  }
  EXPECT_EQ(program.wait(), 0) << program.said;
  const auto found = calibration::loadCalibration(output), truth = hidden();
  EXPECT_FALSE(found.has_third);
  EXPECT_TRUE(found.has_light_post);
  for (const int arm : {0, 3})
    for (int axis = 0; axis < kAxes; ++axis) {
      const int j = arm * kAxes + axis;
      SCOPED_TRACE(protocol::jointNames()[j]);
      EXPECT_EQ(found.joints[j].sign, truth.joints[j].sign);
      EXPECT_NEAR(found.joints[j].per_count / truth.joints[j].per_count, 1, 2e-4)
          << "half a count of the way";
      EXPECT_NEAR(found.joints[j].zero_count, truth.joints[j].zero_count, 0.5);
      if (axis == 3) {
        EXPECT_TRUE(found.joints[j].continuous);
      } else if (axis == 4 && arm == 0) {
        EXPECT_EQ(found.joints[j].min, 0);
        EXPECT_NEAR(found.joints[j].max, M_PI / 6, 1e-9);
      } else if (axis < 3) {
        EXPECT_NEAR(found.joints[j].min, -0.01 * (j + 1), 2e-4);
        EXPECT_NEAR(found.joints[j].max, 0.2, 2e-4);
      }
    }
  std::remove(output.c_str());
}

TEST(BoxSetup, PivotFindsATrocarFromTouchedPoints) {
  Rig rig;
  const auto layout = kinematics::loadTrainerBox(TRAINER_BOX);
  const Eigen::Vector3d pivot(-0.095, -0.035, 0.150), aim(-0.01, 0.06, 0.05);
  const Eigen::Isometry3d X = kinematics::trocarFrame(pivot, aim);
  const std::string folder = testing::TempDir(), calibration = folder + "/vest_pivot_box.yaml",
                    output = folder + "/vest_pivot_layout.yaml";
  std::ofstream(calibration) << calibration::toYaml(hidden(), "what calibrate found");
  Program program("pivot --port " + rig.port() + " --arm left --calibration " + calibration +
                  " --layout " TRAINER_BOX " --output " + output);
  program.line();
  program.type("");
  EXPECT_NE(program.line().find("three points at least"), std::string::npos) << program.said;
  program.line();
  for (const kinematics::JointPositions& q : {kinematics::JointPositions{0.2, 0.1, 0.15, 0.3, 0},
                                              {-0.3, 0.2, 0.12, 0, 0},
                                              {0.1, -0.4, 0.18, 0, 0},
                                              {-0.1, 0.3, 0.08, 0, 0}}) {
    rig.hold(0, q.yaw), rig.hold(1, q.pitch), rig.hold(2, q.insertion), rig.hold(3, q.roll);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    const Eigen::Vector3d p = 1e3 * kinematics::forwardKinematics(X, q).translation();
    char text[100];
    std::snprintf(text, sizeof text, "%.3f %.3f %.3f", p.x(), p.y(), p.z());
    ASSERT_NE(program.answer(text).find("touch a known point"), std::string::npos) << program.said;
  }
  program.type("");
  EXPECT_EQ(program.wait(), 0) << program.said;
  const auto found = kinematics::loadTrainerBox(output);
  const auto& left = found.arm(tools::Instrument::Left);
  EXPECT_NEAR((left.pivot_B - pivot).norm(), 0, 3e-4) << "half a count at the joints";
  EXPECT_NEAR((left.aim_B - left.pivot_B).normalized().dot((aim - pivot).normalized()), 1, 1e-6);
  EXPECT_TRUE(
      found.arm(tools::Instrument::Right).pivot_B.isApprox(layout.arm(tools::Instrument::Right).pivot_B));
  std::remove(calibration.c_str());
  std::remove(output.c_str());
}

TEST(BoxSetup, WhatIsWrittenReadsBackTheSame) {
  auto c = hidden();
  c.has_third = c.has_light_post = false;
  const auto back = calibration::parseCalibration(calibration::toYaml(c, "x"), "x.yaml");
  EXPECT_FALSE(back.has_third || back.has_light_post);
  for (const int j : {0, 4, 8, 15, 18}) {
    EXPECT_NEAR(back.joints[j].per_count, c.joints[j].per_count, 1e-15);
    EXPECT_EQ(back.joints[j].sign, c.joints[j].sign);
    EXPECT_EQ(back.joints[j].zero_count, c.joints[j].zero_count);
    EXPECT_EQ(back.joints[j].continuous, c.joints[j].continuous);
  }
}

/// Positions that a driver read, in order.
struct Heard : driver::ReaderListener {
  void onSample(const driver::Driver& d, driver::Nanoseconds) override {
    if (d.usable(0)) yaw.push_back(d.sample().joints[0].position);
  }
  void onFootswitches(std::uint8_t) override {}
  void onPedal(const driver::PedalEvent&) override {}
  void onMessage(Severity, const std::string& text) override { messages += text + "\n"; }
  std::vector<double> yaw;
  std::string messages;
};

TEST(RawLog, WhatADriverReadIsReadAgainFromItsLogThroughTheEmulator) {
  const std::string folder = testing::TempDir(), log = folder + "/vest_raw.log",
                    link = folder + "/vest_raw_port";
  Heard live;
  {
    emulator::PseudoTerminal terminal;
    terminal.open();
    emulator::Emulator emulator(calibration::defaultCalibration(), 3);
    driver::ReaderOptions options;
    options.port = terminal.path();
    options.raw_log = log;
    driver::BoxReader reader(calibration::defaultCalibration(), options, live);
    reader.runOnce();
    for (int i = 0; i < 300; ++i) {
      protocol::Bytes line;
      if (i == 100) line.assign(7, 0x56);  // rubbish is kept, too
      emulator.tick(emulator::defaultMotion(i * 1e-3), line);
      ASSERT_TRUE(terminal.write(line));
      reader.runOnce();
    }
    for (int i = 0; i < 20; ++i) reader.runOnce();
  }
  ASSERT_GT(live.yaw.size(), 200u) << live.messages;

  Heard again;
  driver::ReaderOptions options;
  options.port = link;
  driver::BoxReader reader(calibration::defaultCalibration(), options, again);
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl(EMULATOR, EMULATOR, "--link", link.c_str(), "--replay", log.c_str(), nullptr);
    std::_Exit(127);
  }
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  int status = 0;
  bool late = false;
  while (::waitpid(child, &status, WNOHANG) == 0 && std::chrono::steady_clock::now() < end) {
    // All 300 pieces are due at once, and a terminal holds a quarter of them: who reads late loses none.
    if (!late && !again.yaw.empty()) std::this_thread::sleep_for(std::chrono::milliseconds(300)), late = true;
    reader.runOnce();
  }
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(live.yaw, again.yaw);
  std::remove(log.c_str());
}

TEST(RawLog, ItsNameDoesNotWriteToTheTerminal) {
  const std::string path = testing::TempDir() + "/vest_log\x1b[2J\n";
  std::ofstream(path, std::ios::binary) << std::string("VEST raw bytes 1\n\0\0\0\0\0\0\0\0\1\0\0\0a", 30);
  ASSERT_EQ(transport::readRawLog(path).pieces.size(), 1u);
  FILE* const out = ::popen(("'" EMULATOR "' --seconds 0.01 --replay '" + path + "' 2>&1").c_str(), "r");
  std::string said;
  for (int c = std::fgetc(out); c != EOF; c = std::fgetc(out)) said += static_cast<char>(c);
  EXPECT_EQ(::pclose(out), 0) << said;
  EXPECT_NE(said.find("vest_log\\x1b[2J\\x0a: 1 pieces"), std::string::npos) << said;
  EXPECT_EQ(said.find('\x1b'), std::string::npos);
  std::remove(path.c_str());
}

TEST(RawLog, WhatIsNoSuchFileIsRefused) {
  const std::string path = testing::TempDir() + "/vest_no_log";
  for (const std::string& text :
       {std::string(), std::string("VEST raw bytes 2\n"), std::string("VEST raw bytes 1\n"),
        std::string("VEST raw bytes 1\n\0\0\0\0\0\0\0\0\xff\xff\xff\xff", 29)}) {
    std::ofstream(path, std::ios::binary) << text;
    EXPECT_THROW(transport::readRawLog(path), std::runtime_error);
  }
  // Pieces of no bytes: in memory each takes twice what it takes in the file.
  std::ofstream(path, std::ios::binary) << "VEST raw bytes 1\n";
  ASSERT_EQ(0, truncate(path.c_str(), 17 + 12 * 8000001));
  EXPECT_THROW(transport::readRawLog(path), std::runtime_error);
  std::remove(path.c_str());
  EXPECT_THROW(transport::readRawLog(path), std::runtime_error);
  ASSERT_EQ(0, mkfifo(path.c_str(), 0600));
  EXPECT_THROW(transport::readRawLog(path), std::runtime_error) << "a pipe would let the emulator wait";
  std::remove(path.c_str());
}

}  // namespace
