// Protects: counts become the right angle, and a bad file is refused with one message that names the field.
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "vest_hw_phantom_box/calibration/calibration.h"

namespace {

using namespace vest;
using calibration::Error;
using calibration::parseCalibration;

std::string shipped() {
  std::ifstream in(DEFAULT_CALIBRATION);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string replaced(const std::string& from, const std::string& to) {
  std::string text = shipped();
  const std::size_t at = text.find(from);
  EXPECT_NE(std::string::npos, at) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

void expectMessage(const std::string& text, const std::vector<std::string>& parts) {
  try {
    parseCalibration(text, "box.yaml");
    ADD_FAILURE() << "accepted: " << parts[0];
  } catch (const Error& e) {
    const std::string what = e.what();
    EXPECT_EQ(0u, what.find("box.yaml: ")) << what;
    EXPECT_NE(std::string::npos, what.find("; allowed: ")) << what;
    for (const auto& part : parts)
      EXPECT_NE(std::string::npos, what.find(part)) << what << "\nlacks " << part;
  }
}

TEST(Calibration, TheShippedFileEqualsTheBuiltInValues) {
  const auto file = calibration::loadCalibration(DEFAULT_CALIBRATION);
  const auto built_in = calibration::defaultCalibration();
  EXPECT_TRUE(file.has_third);
  EXPECT_TRUE(file.has_light_post);
  for (int i = 0; i < protocol::kJoints; ++i) {
    SCOPED_TRACE(protocol::jointNames()[i]);
    EXPECT_EQ(built_in.joints[i].per_count, file.joints[i].per_count);
    EXPECT_EQ(built_in.joints[i].sign, file.joints[i].sign);
    EXPECT_EQ(built_in.joints[i].zero_count, file.joints[i].zero_count);
    EXPECT_EQ(built_in.joints[i].min, file.joints[i].min);
    EXPECT_EQ(built_in.joints[i].max, file.joints[i].max);
    EXPECT_EQ(built_in.joints[i].max_speed, file.joints[i].max_speed);
    EXPECT_EQ(built_in.joints[i].continuous, file.joints[i].continuous);
  }
}

TEST(Calibration, SignScaleAndZeroAreApplied) {
  calibration::Joint j;
  j.per_count = 0.0005;
  j.sign = -1;
  j.zero_count = 200;
  EXPECT_DOUBLE_EQ(-0.4, j.position(1000));
  EXPECT_EQ(1000, j.count(-0.4));
  j.continuous = true, j.per_count = 1e-4;
  for (double turned = -20; turned < 20; turned += 0.01)
    ASSERT_NEAR(turned, j.near(j.position(j.count(turned)), turned), 0.51e-4) << "the turn that fits";
  j.continuous = false;
  EXPECT_EQ(-32767, j.count(1e6)) << "saturates, and is never the count that means no reading";
}

TEST(Calibration, EveryMistakeIsNamedWithFileFieldValueAndWhatIsAllowed) {
  expectMessage(replaced("left:", "lefd:"), {"lefd", "unknown key"});
  expectMessage(replaced("yaw:", "yaww:"), {"left.yaww", "unknown key"});
  expectMessage(replaced("sign: 1", "sing: 1"), {"left.yaw.sing", "unknown key", "sign"});
  expectMessage(replaced("per_count: 0.0001, ", ""), {"left.yaw.per_count", "is missing"});
  expectMessage(replaced("per_count: 0.0001", "per_count: .nan"), {"left.yaw.per_count", "'.nan'", "finite"});
  expectMessage(replaced("per_count: 0.0001", "per_count: .inf"), {"left.yaw.per_count", "'.inf'"});
  expectMessage(replaced("per_count: 0.0001", "per_count: 0"), {"left.yaw.per_count", "'0'"});
  expectMessage(replaced("per_count: 0.0001", "per_count: ten"), {"left.yaw.per_count", "'ten'"});
  expectMessage(replaced("per_count: 0.0001", "per_count: [1]"), {"left.yaw.per_count", "a list"});
  expectMessage(replaced("sign: 1", "sign: 0"), {"left.yaw.sign", "'0'", "1 or -1"});
  expectMessage(replaced("min: -1.2", "min: 1.2"), {"left.yaw.min", "'1.2'", "less than max"});
  expectMessage(replaced("max: 1.2", "max: .nan"), {"left.yaw.max", "'.nan'"});
  expectMessage(replaced("max_speed: 50", "max_speed: -1"), {"left.yaw.max_speed", "'-1'"});
  expectMessage(replaced("continuous: true", "continuous: round"),
                {"left.roll.continuous", "'round'", "true or false"});
  expectMessage(replaced("per_count: 0.0001, sign: 1, zero_count: 0, min: -100",
                         "per_count: 0.00009, sign: 1, zero_count: 0, min: -100"),
                {"left.roll.per_count", "'0.00009'", "where continuous"});
  expectMessage(replaced("right:", "left:"), {"left", "twice"});
  expectMessage("left: 5\n", {"right", "is missing"});
  expectMessage("", {"nothing"});
  expectMessage("[1, 2]", {"a list"});
  expectMessage("left: {a: [}", {"line"});
  expectMessage("a: &x 1\nb: *x\n", {"alias"});
  expectMessage(std::string(5000, '['), {"nesting deeper than 8"});
}

TEST(Calibration, MissingFilesAndFoldersAreNamed) {
  for (const std::string path : {"/nowhere/box.yaml", "/", "/dev/null"}) {
    try {
      calibration::loadCalibration(path);
      ADD_FAILURE() << path;
    } catch (const Error& e) {
      EXPECT_EQ(0u, std::string(e.what()).find(path + ": ")) << e.what();
    }
  }
}

TEST(Calibration, ThirdInstrumentAndLightPostMayBeAbsent) {
  std::string text = shipped();
  const auto third = text.find("third:"), endoscope = text.find("endoscope:"),
             light = text.find("  light_post");
  text = text.substr(0, third) + text.substr(endoscope, light - endoscope);
  const auto c = parseCalibration(text, "box.yaml");
  EXPECT_FALSE(c.has_third);
  EXPECT_FALSE(c.has_light_post);
}

}  // namespace
