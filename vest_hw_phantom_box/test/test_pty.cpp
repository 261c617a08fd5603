// Protects: emulator and driver over a real pseudo-terminal: values, unplugging, return, and ports that are
// none. The driver's clock is injected; only poll() lives in real time, and nothing is judged by it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <cmath>
#include <fstream>

#include "vest_hw_phantom_box/driver/box_reader.h"
#include "vest_hw_phantom_box/emulator/emulator.h"
#include "vest_hw_phantom_box/emulator/pseudo_terminal.h"

namespace {

using namespace vest;
using driver::BoxState;
using driver::kMillisecond;

struct Heard : driver::ReaderListener {
  void onSample(const driver::Driver& d, driver::Nanoseconds) override {
    ++samples;
    if (d.usable(0)) yaw = d.sample().joints[0].position;
  }
  void onFootswitches(std::uint8_t p) override { pressed = p, ++heartbeats; }
  void onPedal(const driver::PedalEvent&) override {}
  void onMessage(Severity, const std::string& t) override { messages.push_back(t); }
  int samples = 0, heartbeats = 0;
  double yaw = NAN;
  std::uint8_t pressed = 0;
  std::vector<std::string> messages;
};

class Pty : public ::testing::Test {
 protected:
  Pty() {
    char folder[] = "/tmp/vest_pty_XXXXXX";
    folder_ = ::mkdtemp(folder);
    link_ = folder_ + "/box";
    options_.port = link_;
  }
  ~Pty() override {
    terminal_.close();
    ::unlink(link_.c_str());
    ::rmdir(folder_.c_str());
  }
  void makeReader() {
    reader_ = std::make_unique<driver::BoxReader>(calibration::defaultCalibration(), options_, heard_,
                                                  [this] { return now_; });
  }
  void tick(const emulator::Pose& pose) {
    protocol::Bytes line;
    emulator_.tick(pose, line);
    ASSERT_TRUE(terminal_.write(line));
    now_ += kMillisecond;
    const int before = heard_.samples;
    for (int i = 0; i < 200 && heard_.samples == before; ++i) reader_->runOnce();
  }
  BoxState state() {
    now_ += 51 * kMillisecond;  // the status copy is refreshed at 20 Hz
    reader_->runOnce();
    return reader_->status().state;
  }

  std::string folder_, link_;
  driver::ReaderOptions options_;
  emulator::PseudoTerminal terminal_;
  emulator::Emulator emulator_{calibration::defaultCalibration(), 3};
  Heard heard_;
  driver::Nanoseconds now_ = 1000000 * kMillisecond;
  std::unique_ptr<driver::BoxReader> reader_;
};

TEST_F(Pty, WhatTheEmulatorPlaysIsWhatTheDriverReads) {
  terminal_.open(link_);
  makeReader();
  EXPECT_FALSE(terminal_.hasReader());
  reader_->runOnce();
  EXPECT_TRUE(terminal_.hasReader());
  for (int i = 0; i < 500; ++i) {
    const auto pose = emulator::defaultMotion(i * 1e-3);
    tick(pose);
    if (i > 25) {
      ASSERT_NEAR(pose.joints[0], heard_.yaw, 0.51e-4) << i;
    }
  }
  EXPECT_EQ(500, heard_.samples);
  EXPECT_GE(heard_.heartbeats, 500 / 20) << "footswitches at 50 Hz or more";
}

TEST_F(Pty, UnpluggingIsSeenWithinTwentyMillisecondsAndTheBoxComesBack) {
  terminal_.open(link_);
  makeReader();
  reader_->runOnce();
  auto pose = emulator::restPose();
  pose.footswitches = 5;
  for (int i = 0; i < 60; ++i) tick(pose);
  EXPECT_EQ(5, heard_.pressed);
  const int samples = heard_.samples;
  terminal_.close();
  reader_->runOnce();  // no time has passed at all
  EXPECT_EQ(BoxState::kDisconnected, reader_->status().state);
  now_ += 101 * kMillisecond;
  reader_->runOnce();
  EXPECT_EQ(0, heard_.pressed);
  EXPECT_EQ(samples, heard_.samples) << "no motion without frames";
  const std::size_t said = heard_.messages.size();  // of a box that may end with its session: nothing yet
  for (int i = 0; i < 20; ++i) {
    now_ += 100 * kMillisecond;
    reader_->runOnce();
  }
  ASSERT_EQ(said + 1, heard_.messages.size()) << "one message, however often it tries";
  EXPECT_NE(heard_.messages.back().find("lost ("), std::string::npos) << heard_.messages.back();

  terminal_.open(link_);
  emulator_.restart();
  now_ += 100 * kMillisecond;
  reader_->runOnce();
  for (int i = 0; i < 60; ++i) tick(emulator::restPose());
  EXPECT_EQ(samples + 60, heard_.samples);
  now_ += kMillisecond;
  reader_->runOnce();
  EXPECT_EQ(1u, reader_->status().reconnects);
}

TEST_F(Pty, WhatLayInThePortBeforeItWasOpenedIsThrownAway) {
  terminal_.open(link_);
  const int before = ::open(terminal_.path().c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(before, 0);
  protocol::Bytes old;
  for (int i = 0; i < 20; ++i) emulator_.tick(emulator::restPose(), old);
  ASSERT_TRUE(terminal_.write(old));
  ::usleep(50000);
  makeReader();
  for (int i = 0; i < 3; ++i) reader_->runOnce();
  EXPECT_EQ(0, heard_.samples);
  emulator_.restart();
  for (int i = 0; i < 30; ++i) tick(emulator::restPose());
  EXPECT_EQ(30, heard_.samples);
  ::close(before);
}

TEST_F(Pty, ASilentBoxIsStaleThoughThePortIsOpen) {
  terminal_.open(link_);
  makeReader();
  reader_->runOnce();
  for (int i = 0; i < 30; ++i) tick(emulator::restPose());
  const auto before = heard_.messages.size();
  now_ += 21 * kMillisecond;
  reader_->runOnce();
  EXPECT_EQ(BoxState::kStale, state());
  EXPECT_EQ(before, heard_.messages.size()) << "as short as a busy machine's";
  for (int i = 0; i < 20; ++i) {
    now_ += 100 * kMillisecond;
    reader_->runOnce();
  }
  ASSERT_EQ(before + 1, heard_.messages.size()) << "once";
  EXPECT_NE(std::string::npos, heard_.messages.back().find("no good frame"));
  tick(emulator::restPose());
  EXPECT_NE(std::string::npos, heard_.messages.back().find("running"));
}

TEST_F(Pty, GapsThatABusyMachineMakesAreCountedAndNotSaid) {
  terminal_.open(link_);
  makeReader();
  reader_->runOnce();
  for (int i = 0; i < 30; ++i) tick(emulator::restPose());
  const auto before = heard_.messages.size();
  for (int gap = 0; gap < 10; ++gap) {
    const int ms = gap % 2 ? 15 : 40;  // longer than a reading is held, and than frames are waited for
    now_ += ms * kMillisecond;
    emulator_.skip(static_cast<std::uint64_t>(ms));
    if (gap > 4) reader_->runOnce();  // else the reader itself is held up: it finds the next frame at once
    for (int i = 0; i < 30; ++i) tick(emulator::restPose());
  }
  EXPECT_EQ(before, heard_.messages.size());
  now_ += 60 * kMillisecond;
  reader_->runOnce();
  EXPECT_EQ(3u, reader_->status().gaps) << "seen as such: of 40 ms, and the last one";
}

TEST_F(Pty, ASecondDriverOnThePortIsToldSo) {
  terminal_.open(link_);
  makeReader();
  reader_->runOnce();
  Heard second;
  driver::BoxReader other(calibration::defaultCalibration(), options_, second, [this] { return now_; });
  other.runOnce();
  ASSERT_EQ(1u, second.messages.size());
  EXPECT_NE(std::string::npos, second.messages[0].find("in use by another program")) << second.messages[0];
  for (int i = 0; i < 30; ++i) tick(emulator::restPose());
  EXPECT_EQ(30, heard_.samples) << "the first one is not disturbed";
  reader_.reset();
  now_ += 200 * kMillisecond;
  other.runOnce();
  EXPECT_EQ(2u, second.messages.size()) << "takes over once the port is free";
}

TEST_F(Pty, WhatIsNoSerialPortIsNamedOnce) {
  const std::string file = folder_ + "/garbage";
  std::ofstream(file) << std::string(5000, 'x');
  for (const std::string& path :
       {file, std::string("/dev/null"), std::string("/dev/zero"), folder_, folder_ + "/nothing"}) {
    options_.port = path;
    Heard heard;
    driver::BoxReader reader(calibration::defaultCalibration(), options_, heard, [this] { return now_; });
    for (int i = 0; i < 20; ++i) {
      now_ += 200 * kMillisecond;
      reader.runOnce();
    }
    ASSERT_EQ(1u, heard.messages.size()) << path;
    EXPECT_NE(std::string::npos, heard.messages[0].find("'" + path + "'")) << heard.messages[0];
    EXPECT_NE(std::string::npos, heard.messages[0].find("allowed:")) << heard.messages[0];
    EXPECT_EQ(0, heard.samples);
  }
  ::unlink(file.c_str());
}

TEST_F(Pty, APortThatAppearsWithinASecondOfTheStartIsNoError) {
  makeReader();
  for (int i = 0; i < 4; ++i) {
    now_ += 200 * kMillisecond;
    reader_->runOnce();
  }
  terminal_.open(link_);
  now_ += 100 * kMillisecond;
  reader_->runOnce();
  ASSERT_EQ(1u, heard_.messages.size());
  EXPECT_NE(std::string::npos, heard_.messages[0].find("open at")) << heard_.messages[0];
}

TEST_F(Pty, APortOnWhichNobodySpeaksTheProtocolIsReportedOnce) {
  terminal_.open(link_);
  makeReader();
  reader_->runOnce();
  const protocol::Bytes garbage(3000, 0x56);
  for (int i = 0; i < 50; ++i) {
    terminal_.write(garbage);
    now_ += 100 * kMillisecond;
    reader_->runOnce();
  }
  int told = 0;
  for (const auto& m : heard_.messages) told += m.find("no box has said hello") != std::string::npos;
  EXPECT_EQ(1, told);
  EXPECT_EQ(0, heard_.samples);
}

TEST_F(Pty, AReaderThatDrainsNothingCostsFramesAndNothingElse) {
  terminal_.open(link_);
  const int reader = ::open(terminal_.path().c_str(), O_RDONLY | O_NOCTTY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  const auto pose = emulator::restPose();
  int taken = 0, dropped = 0;
  for (int i = 0; i < 5000; ++i) {
    protocol::Bytes line;
    emulator_.tick(pose, line);
    (terminal_.write(line) ? taken : dropped)++;
  }
  EXPECT_GT(dropped, 0);
  // What it took is whole: drained now, it decodes without a bad byte.
  struct Sink : protocol::FrameSink {
    int n = 0;
    void onHello(const protocol::Hello&, std::uint32_t) override {}
    void onMotion(const protocol::Motion&) override { ++n; }
  } sink;
  protocol::Decoder decoder;
  std::uint8_t bytes[4096];
  for (int idle = 0; idle < 50;) {
    const ssize_t n = ::read(reader, bytes, sizeof bytes);
    if (n > 0) {
      decoder.feed(bytes, static_cast<std::size_t>(n), sink);
      idle = 0;
    } else {
      ++idle;
      terminal_.write({});
      ::usleep(1000);
    }
  }
  EXPECT_EQ(taken, sink.n);
  EXPECT_EQ(0u, decoder.counters().skipped);
  ::close(reader);
}

TEST_F(Pty, ALinkThatIsNotALinkIsNeverReplaced) {
  std::ofstream(link_) << "precious";
  EXPECT_THROW(terminal_.open(link_), std::runtime_error);
  std::ifstream in(link_);
  std::string word;
  in >> word;
  EXPECT_EQ("precious", word);
}

}  // namespace
