// Protects the one file that says who moves what: each kind of source reaches each instrument, and each wrong
// field is one message that names it and what is allowed.
#include <gtest/gtest.h>

#include "refusal.h"
#include "vest_instruments/control/teleoperator.h"

namespace {

using namespace vest::control;
using vest::testing::changed;
using vest::tools::Instrument;

const std::string kDirectory = std::string(VEST_INSTRUMENTS_DIR) + "/config";
const std::string kShipped = kDirectory + "/inputs.yaml";

InputMap load(const std::string& text) {
  InputMap map;
  EXPECT_EQ(vest::testing::refusal(text, [&](const std::string& path) { map = loadInputMap(path); }), "");
  return map;
}

TEST(InputMap, TheShippedExampleHoldsEachKindOfSource) {
  const InputMap map = loadInputMap(kShipped);
  EXPECT_EQ(map.instruments[0].source, Source::Box);
  EXPECT_EQ(map.instruments[1].source, Source::Haptic);
  EXPECT_EQ(map.instruments[1].device, "sim");
  EXPECT_EQ(map.instruments[1].options.at("motion"), "rest");
  EXPECT_TRUE(map.instruments[2].gamepad());
  EXPECT_EQ(map.instruments[2].pad.joints[2].axis, 3);
  EXPECT_EQ(map.instruments[2].pad.joints[2].sign, -1.0);
  EXPECT_EQ(map.instruments[2].pad.joints[4].minus, 2);
  EXPECT_EQ(map.instruments[2].pad.joints[4].plus, 3);
  EXPECT_EQ(map.instruments[3].handle, Instrument::Endoscope);
  ASSERT_EQ(map.switches.size(), 5u);
  const char* topics[] = {"phantom_box/footswitches", "input/pedals", "input/pad", "haptics/right/buttons",
                          "teleop/footswitches"};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(map.switches[i].topic(), topics[i]);
  EXPECT_EQ(map.switches[1].switches[1].button, 1);
  EXPECT_EQ(map.switches[1].switches[1].function, PedalFunction::Cut);
  EXPECT_EQ(map.switches[1].switches[1].instruments, maskOf(Instrument::Third));
}

TEST(InputMap, EverySourceCanMoveEveryInstrument) {
  const std::string devices = "devices: {pad: {match: x, axes: [ABS_X]}}\n";
  const std::pair<const char*, Source> sources[] = {
      {"{source: none}", Source::None},
      {"{source: box, handle: third}", Source::Box},
      {"{source: haptic, device: phantom}", Source::Haptic},
      {"{source: crtk}", Source::Crtk},
      {"{source: teleop}", Source::Teleop},
      {"{source: gamepad, device: pad, yaw: ABS_X}", Source::Teleop},
      {"{source: replay, handle: left}", Source::Replay}};
  for (int i = 0; i < vest::tools::kInstrumentCount; ++i) {
    const std::string name(vest::tools::instrumentName(static_cast<Instrument>(i)));
    for (const auto& [words, source] : sources) {
      const InputMap map = load(devices + "instruments: {" + name + ": " + words + "}\n");
      for (int k = 0; k < vest::tools::kInstrumentCount; ++k) {
        EXPECT_EQ(map.instruments[static_cast<std::size_t>(k)].source, k == i ? source : Source::None)
            << name << ": " << words;
      }
    }
  }
}

TEST(InputMap, OptionsOfADeviceMayBeLists) {
  const InputMap map = load(
      "instruments: {left: {source: haptic, device: impulse_engine, options: {port: /dev/ttyS0, counts: "
      "[2000, "
      "2000, 20000, 1000, 2000], none: []}}}\n");
  const std::map<std::string, std::string> words{
      {"port", "/dev/ttyS0"}, {"counts", "2000, 2000, 20000, 1000, 2000"}, {"none", ""}};
  EXPECT_EQ(map.instruments[0].options, words) << "as the same list of the parameter";
}

// What is changed in the shipped file, and what the message must hold.
struct Mistake {
  const char *from, *to, *says;
};

TEST(InputMap, EachMistakeIsOneMessageWithFieldAndWhatIsAllowed) {
  const Mistake mistakes[] = {
      {"instruments:  ", "instrumnets:  ",
       "unknown key 'instrumnets'; allowed: devices, instruments, switches"},
      {"left: {source: box}", "left: {source: bocks}",
       "instruments.left.source: 'bocks'; allowed: none, box, haptic, crtk, teleop, gamepad, replay"},
      {"left: {source: box}", "middle: {source: box}",
       "unknown key 'middle'; allowed: left, right, third, endoscope"},
      {"left: {source: box}", "left: {}", "instruments.left.source: missing"},
      {"left: {source: box}", "left: {source: crtk, handle: left}", "instruments.left: unknown key 'handle'"},
      {"handle: endoscope", "handle: camera", "instruments.endoscope.handle: 'camera'; allowed: left, right"},
      {"device: sim, ", "", "instruments.right.device: missing"},
      {"options: {motion: rest}", "options: 3", "instruments.right.options: '3'; allowed: a map of words"},
      {"options: {motion: rest}", "options: {motion: {a: 1}}",
       "instruments.right.options.motion: '{a: 1}'; allowed: a word, or a list of words"},
      {"options: {motion: rest}", "options: {motion: [1, ~]}", "instruments.right.options.motion[1]: "},
      {"device: pad,", "device: pat,", "instruments.third.device: 'pat'; allowed: pedals, pad"},
      {"yaw: ABS_X", "yaw: ABS_Z", "instruments.third.yaw: 'ABS_Z'; allowed: ABS_X, ABS_Y, ABS_RX, ABS_RY"},
      {"[BTN_TL, BTN_TR]}", "[BTN_TL]}", "instruments.third.jaw: "},
      {"[BTN_TL, BTN_TR]}", "[BTN_TL, BTN_C]}", "instruments.third.jaw[1]: 'BTN_C'; allowed: BTN_SOUTH"},
      {"roll: ABS_RX,", "roll: ABS_RX, speed: 7,", "instruments.third.speed: 7; allowed: 0.001 … 0.5"},
      {"roll: ABS_RX,", "rol: ABS_RX,", "instruments.third: unknown key 'rol'"},
      {"yaw: ABS_X, pitch: ABS_Y, insertion: -ABS_RY, roll: ABS_RX, jaw: [BTN_TL, BTN_TR]", "speed: 0.1",
       "instruments.third: moves no joint"},
      {"match: FootSwitch", "match: FootSwitch\n    path: /dev/input/event3",
       "devices.pedals: not exactly one of path, match, recording"},
      {"match: FootSwitch", "match: ''", "devices.pedals.match: "},
      {"match: FootSwitch", "match: FootSwitch\n    grab: maybe",
       "devices.pedals.grab: 'maybe'; allowed: true, false"},
      {"[KEY_A, KEY_B, KEY_C]", "KEY_A", "devices.pedals.buttons: 'KEY_A'; allowed: a list"},
      {"[KEY_A, KEY_B, KEY_C]", "[KEY_A, ABS_X]", "devices.pedals.buttons[1]: 'ABS_X'"},
      {"[KEY_A, KEY_B, KEY_C]", "[KEY_A, KEY_A]", "devices.pedals.buttons[1]: 'KEY_A' given twice"},
      {"    buttons: [KEY_A, KEY_B, KEY_C]\n", "", "devices.pedals: neither buttons nor axes"},
      {"axes: [ABS_X, ", "axes: [BTN_X, ", "devices.pad.axes[0]: 'BTN_X'"},
      {"  pad:\n", "  box:\n", "devices: 'box'; allowed: names"},
      {"  pad:\n", "  pedals:\n", "given twice"},
      {"{on: pedals, button: KEY_A,", "{on: pedal, button: KEY_A,",
       "switches[6].on: 'pedal'; allowed: box, teleop, replay, haptics/right, pedals, pad"},
      {"{on: pedals, button: KEY_A,", "{on: pedals, button: KEY_Z,",
       "switches[6].button: 'KEY_Z'; allowed: KEY_A"},
      {"{on: box, button: 0,", "{on: box, button: 6,", "switches[0].button: 6; allowed: 0 … 5"},
      {"{on: box, button: 0,", "{on: box, button: 0.5,", "switches[0].button: 0.5; allowed: a whole number"},
      {"{on: box, button: 0,", "{on: box, button: 1,", "button: 1 is there already"},
      {"function: suction", "function: suck",
       "switches[3].function: 'suck'; allowed: none, coag, monopolar_coag, bipolar_coag, cut"},
      {"function: tool, instruments: [right]", "function: tool", "switches[4]: a switch for tools without"},
      {"clutch, instruments: [third]", "clutch, instruments: [thrid]", "switches[8].instruments[0]: 'thrid'"},
      {"clutch, instruments: [third]", "clutch, instruments: []", "switches[8].instruments: "},
      {"{on: haptics/right", "{on: haptics/left", "switches[9].on: 'haptics/left'"},
      {"pad:\n", "pad: &x\n", "anchor"},
  };
  for (const char* text : {"devices: 3\n", "instruments: left\n", "devices: {pad: 3}\n",
                           "instruments: {left: 3}\n", "3\n", "instruments: [left]\n", "switches: [box]\n"}) {
    const std::string said = vest::testing::refusal(text, loadInputMap);
    EXPECT_NE(said.find("; allowed: "), std::string::npos) << text << "said: " << said;
  }
  const std::string shipped = vest::testing::fileText(kShipped);
  for (const Mistake& m : mistakes) {
    const std::string said = vest::testing::refusal(changed(shipped, m.from, m.to), loadInputMap);
    EXPECT_NE(said.find(m.says), std::string::npos) << m.to << "\nsaid: " << said;
    EXPECT_NE(said.find("; allowed: "), std::string::npos) << said;
    EXPECT_EQ(said.find('\n'), std::string::npos) << said;
  }
}

class Hand : public ::testing::Test {
 protected:
  vest::kinematics::TrainerBox box = vest::kinematics::loadTrainerBox(kDirectory + "/trainer_box.yaml");
};

TEST_F(Hand, ShiftsTheTipExactlyAndKeepsRollAndJaw) {
  Teleoperator hand(box.arms[0]);
  hand.add((Joints() << 0.1, -0.1, 0.02, 0.7, 0.4).finished());
  const Eigen::Vector3d before = hand.tip().translation();
  const Eigen::Vector3d step(0.003, -0.002, 0.004);
  hand.shift(step);
  EXPECT_TRUE((hand.tip().translation() - before).isApprox(step, 1e-9));
  EXPECT_EQ(hand.joints()[3], 0.7);
  EXPECT_EQ(hand.jaw(), 0.4);
}

TEST_F(Hand, NeverLeavesTheLimitsOfTheArmWhateverItIsTold) {
  Teleoperator hand(box.arms[1]);
  const Joints lower = toJoints(box.arms[1].limits.lower), upper = toJoints(box.arms[1].limits.upper);
  for (int i = 0; i < 200; ++i) {
    hand.shift({0.05 * (i % 3), -0.05 * (i % 5), 0.05 * (i % 7) - 0.1});
    hand.add(Joints::Constant(i % 2 ? 9.0 : -4.0));
    hand.add(Joints::Constant(std::nan("")));
    ASSERT_TRUE(hand.joints().allFinite());
    for (int k = 0; k < 5; ++k) {
      ASSERT_GE(hand.joints()[k], lower[k]);
      ASSERT_LE(hand.joints()[k], upper[k]);
    }
  }
}

TEST_F(Hand, AGamepadTurnsEachJointBySpeed) {
  const InputMap map = loadInputMap(kShipped);
  const PadControl& pad = map.instruments[2].pad;
  Teleoperator hand(box.arms[2]);
  const Joints before = hand.joints();
  hand.drive(pad, {1.0, -0.5, 0.0, -1.0}, 1u << 3, 0.1);
  const Joints moved = hand.joints() - before;
  EXPECT_NEAR(moved[0], 0.06, 1e-12);
  EXPECT_NEAR(moved[1], -0.03, 1e-12);
  EXPECT_NEAR(moved[2], 0.004, 1e-12) << "-ABS_RY pushed away goes in";
  EXPECT_NEAR(moved[3], 0.0, 1e-12);
  EXPECT_NEAR(moved[4], 0.06, 1e-12);
  hand.drive(pad, {}, 0, 0.1);
  EXPECT_EQ(hand.joints(), before + moved) << "axes that are not there move nothing";
}

}  // namespace
