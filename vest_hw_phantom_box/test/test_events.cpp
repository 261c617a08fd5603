// Protects pedals and gamepads: what the kernel tells arrives whole, through libevdev itself; what is
// unplugged is released; what cannot be used is one message that says what mends it.
#include <cmath>
#include <fstream>

#include <gtest/gtest.h>

#include "fake_evdev.h"
#include "vest_hw_phantom_box/events/input_device.h"

namespace {

using namespace vest::events;
using vest::control::EventDevice;
using vest::testing::FakeEvdev;

EventDevice pad() {
  EventDevice d;
  d.name = "pad";
  d.buttons = {"BTN_SOUTH", "BTN_TR"};
  d.axes = {"ABS_X", "ABS_RY"};
  return d;
}

struct KernelPad : FakeEvdev {
  KernelPad() {
    keys = {BTN_SOUTH, BTN_TR};
    axes[ABS_X] = {0, -32768, 32767, 0, 1000, 0};
    axes[ABS_RY] = {127, 0, 255, 0, 15, 0};
  }
  InputDevice open(bool grab = true) {
    return InputDevice(pad(), openKernelDevice(descriptor(), "fake", grab));
  }
};

/// Exactly these events, which libevdev may put right before they come.
struct Script : EventSource {
  std::vector<Event> events;
  std::map<int, AxisRange> ranges{{ABS_X, {-100, 100, 0, 0}}, {ABS_RY, {-100, 100, 0, 0}}};
  bool gone = false;
  int* asked = nullptr;
  Read next(Event& event, double) override {
    if (asked) ++*asked;
    if (gone) return Read::Gone;
    if (events.empty()) return Read::Nothing;
    event = events.front();
    events.erase(events.begin());
    return Read::Event;
  }
  bool hasKey(std::uint16_t) const override { return true; }
  bool keyDown(std::uint16_t) const override { return false; }
  std::optional<AxisRange> axis(std::uint16_t code) const override {
    const auto it = ranges.find(code);
    return it == ranges.end() ? std::nullopt : std::optional<AxisRange>(it->second);
  }
  std::string name() const override { return "script"; }
};

/// What a device says after these events.
InputDevice played(std::vector<Event> events) {
  auto script = std::make_unique<Script>();
  script->events = std::move(events);
  InputDevice device(pad(), std::move(script));
  device.poll(1.0);
  return device;
}

std::string problem(const std::function<void()>& work) {
  try {
    work();
  } catch (const DeviceError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return {};
}

TEST(Events, LibevdevReadsADeviceWholeReportByWholeReport) {
  KernelPad kernel;
  InputDevice device = kernel.open();
  EXPECT_EQ(device.name(), "VEST test pad");
  EXPECT_TRUE(kernel.grabbed) << "a pedal that types letters types none";
  EXPECT_FALSE(device.poll(1.0));
  kernel.send(EV_KEY, BTN_TR, 1);
  kernel.send(EV_ABS, ABS_X, -32768);
  EXPECT_FALSE(device.poll(1.0)) << "half a report is not seen";
  EXPECT_EQ(device.buttons(), 0u);
  kernel.report();
  EXPECT_TRUE(device.poll(1.01));
  EXPECT_EQ(device.buttons(), 2u);
  EXPECT_EQ(device.axes()[0], -1.0);
  kernel.send(EV_KEY, BTN_TR, 2);
  kernel.report();
  EXPECT_FALSE(device.poll(1.02)) << "a repeated key is no news";
  kernel.send(EV_KEY, BTN_TR, 0);
  kernel.report();
  EXPECT_TRUE(device.poll(1.03));
  EXPECT_EQ(device.buttons(), 0u);
}

TEST(Events, AnAxisIsZeroInItsFlatMiddleAndGrowsFromThereWithoutAJump) {
  KernelPad kernel;
  InputDevice device = kernel.open();
  double before = -2.0;
  for (int v = 0; v <= 255; ++v) {
    kernel.send(EV_ABS, ABS_RY, v);
    kernel.report();
    device.poll(1.0);
    const double a = device.axes()[1];
    EXPECT_GE(a, before);
    if (before > -2.0) {
      EXPECT_LT(a - before, 0.01);
    }
    if (std::abs(v - 127.5) < 15.0) {
      EXPECT_EQ(a, 0.0) << v;
    }
    before = a;
  }
  EXPECT_EQ(before, 1.0);
  kernel.send(EV_ABS, ABS_RY, 4000);
  kernel.report();
  device.poll(1.0);
  EXPECT_EQ(device.axes()[1], 1.0) << "beyond its range";
}

TEST(Events, OnlyAReportMakesThemSeenAndARepeatedKeyPressesNothing) {
  EXPECT_EQ(played({{EV_KEY, BTN_SOUTH, 1}, {EV_MSC, MSC_SERIAL, 7}}).buttons(), 0u);
  EXPECT_EQ(played({{EV_KEY, BTN_SOUTH, 1}, {EV_SYN, SYN_MT_REPORT, 0}}).buttons(), 0u);
  EXPECT_EQ(played({{EV_KEY, BTN_SOUTH, 1}, {EV_SYN, SYN_REPORT, 0}}).buttons(), 1u);
  EXPECT_EQ(played({{EV_KEY, BTN_SOUTH, 2}, {EV_SYN, SYN_REPORT, 0}}).buttons(), 0u);
  EXPECT_EQ(played({{EV_ABS, BTN_SOUTH, 1}, {EV_SYN, SYN_REPORT, 0}}).buttons(), 0u)
      << "an axis of its number";
  const auto axes = played({{EV_ABS, ABS_RY, 50}, {EV_SYN, SYN_REPORT, 0}}).axes();
  EXPECT_EQ(axes[0], 0.0) << "the other axis";
  EXPECT_EQ(axes[1], 0.5);
}

TEST(Events, AFlatMiddleThatCannotBeLeavesAnAxisOfUse) {
  for (const std::int32_t flat : {-50, 100, 1000}) {
    auto script = std::make_unique<Script>();
    script->ranges[ABS_X].flat = flat;
    script->events = {{EV_ABS, ABS_X, 0}, {EV_SYN, SYN_REPORT, 0}};
    Script& events = *script;
    InputDevice device(pad(), std::move(script));
    device.poll(1.0);
    EXPECT_EQ(device.axes()[0], 0.0) << flat;
    events.events = {{EV_ABS, ABS_X, 100}, {EV_SYN, SYN_REPORT, 0}};
    device.poll(1.0);
    EXPECT_EQ(device.axes()[0], 1.0) << flat;
  }
}

TEST(Events, WhatIsGoneIsNotAskedAgain) {
  auto script = std::make_unique<Script>();
  int asked = 0;
  script->gone = true;
  script->asked = &asked;
  InputDevice device(pad(), std::move(script));
  EXPECT_TRUE(device.poll(1.0));
  EXPECT_FALSE(device.poll(2.0));
  EXPECT_EQ(asked, 1);
}

TEST(Events, WhatTheKernelDroppedIsAskedForAnew) {
  KernelPad kernel;
  InputDevice device = kernel.open();
  kernel.send(EV_KEY, BTN_SOUTH, 1);
  kernel.report();
  device.poll(1.0);
  ASSERT_EQ(device.buttons(), 1u);
  // The release and a press of the other button are lost with the queue; the kernel knows the present state.
  kernel.down = {BTN_TR};
  kernel.axes[ABS_X].value = 32767;
  kernel.send(EV_SYN, SYN_DROPPED, 0);
  kernel.send(EV_KEY, BTN_SOUTH, 1);
  kernel.report();
  device.poll(1.01);
  device.poll(1.02);
  EXPECT_EQ(device.buttons(), 2u);
  EXPECT_EQ(device.axes()[0], 1.0);
}

TEST(Events, AnUnpluggedDeviceReleasesEverything) {
  KernelPad kernel;
  InputDevice device = kernel.open();
  kernel.send(EV_KEY, BTN_SOUTH, 1);
  kernel.send(EV_ABS, ABS_X, 32767);
  kernel.report();
  device.poll(1.0);
  ASSERT_EQ(device.buttons(), 1u);
  kernel.unplug();
  EXPECT_TRUE(device.poll(1.01));
  EXPECT_FALSE(device.connected());
  EXPECT_EQ(device.buttons(), 0u);
  EXPECT_EQ(device.axes()[0], 0.0);
  EXPECT_FALSE(device.poll(1.02));
}

TEST(Events, AButtonThatIsHeldWhileItIsOpenedIsDownAtOnceAndReportedWhenStuck) {
  KernelPad kernel;
  kernel.down = {BTN_SOUTH};
  InputDevice device = kernel.open();
  EXPECT_EQ(device.buttons(), 1u);
  device.poll(10.0);
  device.poll(69.0);
  EXPECT_EQ(device.stuck(70.0), 0u);
  EXPECT_EQ(device.stuck(70.1), 1u);
}

TEST(Events, WhatCannotBeOpenedSaysWhatMendsIt) {
  EXPECT_NE(
      problem([] { openKernelDevice("/dev/input/by-id/none-of-these", true); }).find("plug the device in"),
      std::string::npos);
  EXPECT_NE(problem([] { openKernelDevice("/dev/null", true); }).find("/dev/null: no event device"),
            std::string::npos);
  EventDevice wanted = pad();
  wanted.match = "Foot";
  EXPECT_NE(problem([&] {
              openSource(wanted, "/nowhere");
            }).find("no device in /nowhere has 'Foot' in its name; plug it in"),
            std::string::npos);
  {
    KernelPad kernel;
    kernel.grab_refused = true;
    EXPECT_NE(problem([&] { kernel.open(); }).find("another program has it"), std::string::npos);
  }
  KernelPad kernel;
  EventDevice more = pad();
  more.buttons.push_back("BTN_NORTH");
  EXPECT_NE(problem([&] {
              InputDevice(more, openKernelDevice(kernel.descriptor(), "fake", false));
            }).find("'BTN_NORTH' is not on this device"),
            std::string::npos);
  KernelPad other;
  EventDevice wrong = pad();
  wrong.axes[0] = "ABS_NONSENSE";
  EXPECT_NE(problem([&] {
              InputDevice(wrong, openKernelDevice(other.descriptor(), "fake", false));
            }).find("'ABS_NONSENSE' is no axis; allowed"),
            std::string::npos);
}

TEST(Events, KeysAndAxesThatCannotBeUsedAreNamed) {
  const auto refused = [](const EventDevice& wanted, const AxisRange& x) {
    auto script = std::make_unique<Script>();
    script->ranges[ABS_X] = x;
    return problem([&] { InputDevice(wanted, std::move(script)); });
  };
  const AxisRange good{-100, 100, 0, 0};
  EventDevice key = pad(), axis = pad();
  key.buttons[0] = "BTN_NONSENSE";
  axis.axes[1] = "ABS_Z";
  EXPECT_NE(refused(key, good).find("'BTN_NONSENSE' is no key; allowed"), std::string::npos);
  EXPECT_NE(refused(axis, good).find("'ABS_Z' is not on this device"), std::string::npos);
  EXPECT_NE(refused(pad(), {5, 5, 0, 5}).find("'ABS_X' has no range"), std::string::npos);
  EXPECT_NE(refused(pad(), {5, -5, 0, 0}).find("'ABS_X' has no range"), std::string::npos);
  EXPECT_EQ(refused(pad(), good), "");
}

TEST(Events, ARecordingPlaysAsADeviceWould) {
  EventDevice wanted = pad();
  wanted.recording = TEST_DATA "/pad.csv";
  InputDevice device(wanted, openSource(wanted));
  EXPECT_EQ(device.name(), "VEST test controller");
  device.poll(100.0);
  EXPECT_EQ(device.axes()[0], 0.0);
  EXPECT_TRUE(device.poll(100.6));
  EXPECT_EQ(device.axes()[0], 1.0);
  EXPECT_TRUE(device.poll(101.6));
  EXPECT_EQ(device.buttons(), 1u);
  EXPECT_EQ(device.axes()[1], -1.0);
  EXPECT_TRUE(device.poll(102.6));
  EXPECT_EQ(device.buttons(), 0u);
  EXPECT_EQ(device.axes()[0], 0.0);
  device.poll(103.1);
  EXPECT_TRUE(device.poll(103.6)) << "round two";
  EXPECT_EQ(device.axes()[0], 1.0);
  EXPECT_TRUE(device.connected());
}

TEST(Events, ASpoiledRecordingNamesFileAndLine) {
  const char* const spoiled[] = {"",
                                 "t,type\n",
                                 "# colour: red\nt_s,type,code,value\n",
                                 "# key: BTN_NONSENSE\nt_s,type,code,value\n",
                                 "# axis: ABS_X 0\nt_s,type,code,value\n",
                                 "t_s,type,code,value\nx,EV_KEY,BTN_SOUTH,1\n",
                                 "t_s,type,code,value\n1,EV_KEE,BTN_SOUTH,1\n",
                                 "t_s,type,code,value\n1,EV_KEY,BTN_NONSENSE,1\n",
                                 "t_s,type,code,value\n1,EV_KEY,BTN_SOUTH,on\n",
                                 "t_s,type,code,value\n1,EV_KEY,BTN_SOUTH\n",
                                 "t_s,type,code,value\n1,EV_KEY,BTN_SOUTH,1\n0.5,EV_KEY,BTN_SOUTH,0\n"};
  const std::string path = ::testing::TempDir() + "/vest_events_test.csv";
  for (const char* text : spoiled) {
    std::ofstream(path) << text;
    const std::string said = problem([&] { openRecording(path); });
    EXPECT_EQ(said.rfind(path + ": ", 0), 0u) << text << "\nsaid: " << said;
    EXPECT_NE(said.find("; allowed: "), std::string::npos) << said;
  }
  std::remove(path.c_str());
  EXPECT_NE(problem([&] { openRecording(path); }).find("cannot be read"), std::string::npos);
}

}  // namespace
