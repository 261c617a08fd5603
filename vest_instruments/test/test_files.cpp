// What every reader of files rests on: bytes of regular files, one YAML document, texts that are safe to
// print.
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "vest_instruments/files/refusal.h"
#include "vest_instruments/files/strict_json.h"
#include "vest_instruments/files/strict_yaml.h"
#include "vest_instruments/kinematics/trainer_box.h"
#include "vest_instruments/trajectory/trajectory.h"

namespace {

using vest::files::Refused;

std::string inTest(const std::string& name) {
  return ::testing::TempDir() + "/vest_files_" + std::to_string(::getpid()) + "_" + name;
}

template <class Read>
std::string refusal(Read read) {
  try {
    read();
  } catch (const std::exception& error) {
    return error.what();
  }
  return {};
}

std::string yaml(const std::string& text, std::size_t values = 100) {
  vest::files::YamlLimits limits;
  limits.depth = 8;
  limits.values = values;
  try {
    vest::files::parseYaml(text, limits);
  } catch (const Refused& why) {
    return std::to_string(why.line) + ": " + why.what();
  }
  return {};
}

void says(const std::string& message, const std::string& part) {
  EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
}

TEST(Files, BytesComeFromRegularFilesAloneAndNobodyWaits) {
  const std::string file = inTest("file"), pipe = inTest("pipe");
  std::ofstream(file) << "twelve bytes";
  EXPECT_EQ(vest::files::read(file, 12), "twelve bytes");
  says(refusal([&] { vest::files::read(file, 11); }), "12 bytes");
  says(refusal([] { vest::files::read("/", 11); }), "a folder");
  says(refusal([] { vest::files::read("/dev/zero", 11); }), "a device");
  says(refusal([] { vest::files::read("/no/such", 11); }), "No such file");
  EXPECT_NE(vest::files::read("/proc/self/status", 1 << 20), "") << "a file that says it has no bytes";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  says(refusal([&] { vest::files::read(pipe, 11); }), "a pipe");
  // And so do those who read YAML and tables through it.
  says(refusal([&] { vest::kinematics::loadTrainerBox(pipe); }), "a pipe");
  says(refusal([&] { vest::trajectory::fromWaypoints(pipe, {}); }), "a pipe");
  std::remove(file.c_str()), std::remove(pipe.c_str());
}

TEST(Files, WhatIsShownCannotWriteToATerminal) {
  EXPECT_EQ(vest::files::shown("größe … 10 µm"), "größe … 10 µm");
  EXPECT_EQ(vest::files::shown("a\n\x1b[2J\x7f"), "a\\x0a\\x1b[2J\\x7f");
  EXPECT_EQ(vest::files::shown("\xc2\x9b"
                               "1m"),
            "\\xc2\\x9b1m")
      << "a control of eight bits";
  EXPECT_EQ(vest::files::shown("\xe2\x80\xae"
                               "exe"),
            "\\xe2\\x80\\xae"
            "exe")
      << "turns the direction of writing";
  EXPECT_EQ(vest::files::shown("\xc3\x28\xff\xed\xa0\x80\xc0\xaf"), "\\xc3(\\xff\\xed\\xa0\\x80\\xc0\\xaf")
      << "no UTF-8";
  EXPECT_EQ(vest::files::shown("äöü", 2), "äö...") << "cut between characters";
  EXPECT_EQ(vest::files::shown("👩\xe2\x80\x8d👩", 2), "👩...") << "a joiner goes with what it joined";
  for (const char* emoji : {"\U0001F468\u200d\U0001F469\u200d\U0001F467", "\U0001F3F3\uFE0F\u200d\U0001F308",
                            "\U0001F469\U0001F3FD\u200d\u2695\uFE0F"})
    EXPECT_EQ(vest::files::shown(emoji), emoji) << "a joiner is part of an emoji";
  for (const char* hidden :
       {"an\u200dna", "\u200d\U0001F467", "\U0001F468\u200d", "\U0001F468\u200d\u200d\U0001F467"})
    EXPECT_NE(vest::files::shown(hidden), hidden) << "elsewhere nobody sees it";
}

TEST(Files, NumbersAreDecimalFiniteAndWhole) {
  double value = 0;
  for (const auto& [text, is] : {std::pair{"1.5", 1.5}, {"+2e3", 2e3}, {"-0", 0.0}}) {
    EXPECT_TRUE(vest::files::parseNumber(text, value)) << text;
    EXPECT_EQ(value, is);
  }
  for (const char* text :
       {"", "+", "+-1", "1,5", "1.5 ", " 1", "nan", "inf", "1e999", "0x10", "1_0", "1.5.2"})
    EXPECT_FALSE(vest::files::parseNumber(text, value)) << text;
}

TEST(Files, YamlIsOneDocumentWithoutAnchorsTagsAndEndlessLists) {
  EXPECT_EQ(yaml("a: [1, 'two', {b: ~}]\n"), "");
  EXPECT_EQ(yaml("---\na: 1\n...\n"), "");
  says(yaml("a: 1\n---\nb: 2\n"), "a second document");
  says(yaml("a: 1\n---\n"), "a second document");
  says(yaml("a: 1\n---\n[\n"), "document");
  says(yaml("a: {b:"), "end of map flow");  // yaml-cpp 0.6 never ended, of the next neither
  says(yaml("a:\n  [b:]\n"), "2: document: ':]'");
  says(yaml("a: [b:\x04\n"), "1: document: a control character");
  says(yaml("a: &x 1\n"), "1: document: an anchor");
  says(yaml("a: 1\nb: *x\n"), "document");
  says(yaml("a: !!binary 1\n"), "the tag");
  says(yaml("a: [[[[[[[[1]]]]]]]]\n"), "nesting deeper than 8");
  says(yaml("a: [" + std::string(150, '1') + "]\nb:\n" +
            [] {
              std::string list;
              for (int i = 0; i < 101; ++i) list += "  - 1\n";
              return list;
            }()),
       "more than 100 values");
  says(yaml(std::string(1000000, '[')), "more than 200 values or lines");
  says(yaml("a: [1\n"), "well-formed YAML");
  // A file that was cut within quotes, at the end of a line or of a colon.
  for (const char* const cut : {"a: 1\nb: \"c\n", "a: 1\nb: \"c:", "a: 1\nb: 'c\n\n", "a: 1\nb: \"c\n# d"})
    says(yaml(cut), ": document: illegal EOF");
  says(yaml("a: 1\nb: \"c\n"), "2: document");
  EXPECT_EQ(yaml("a: \"b\n  c\"  # d"), "");
  EXPECT_EQ(yaml("a: |\n  'b"), "");
}

std::string json(const std::string& text) {
  try {
    vest::files::parseJson(text, 8);
  } catch (const Refused& why) {
    return std::to_string(why.line) + ": " + why.what();
  }
  return {};
}

TEST(Files, JsonHasEachKeyOnceAndIsNotDeep) {
  EXPECT_EQ(json("{\"a\": {\"a\": 1}, \"b\": [{\"a\": \"a\"}, {\"a\": \"\\\"a\\\": \"}]}"), "")
      << "once in each";
  EXPECT_EQ(json("{\"a\": 1,\n\"b\": 2,\n\"a\": 1}"), "3: key: a: each key once") << "the same value, too";
  EXPECT_EQ(json("[{\"a\": 1, \"\\u0061\" : 2}]"), "1: key: a: each key once") << "however it is written";
  EXPECT_EQ(json("{\"a\": 1, \"a\\u0000\": 2}"), "");
  EXPECT_EQ(json(std::string(8, '[') + std::string(8, ']')), "");
  says(json(std::string(100000, '[')), "1: JSON: : nesting of at most 8");
  std::string list = "[0";
  for (int i = 0; i < 1000000; ++i) list += ",0";
  says(json(list + "]"), "at most 1000000 values");
  for (const char* none :
       {"", "{", "nul", "{\"a\": NaN}", "{\"a\" 1}", "{\"a\": 1,}", "]", "{\"\\ud800\": 1}", "1 2"})
    says(json(none), "1: JSON: : valid JSON");
  says(json("{\"a\":\n\n1,}"), "3: JSON");
  says(json("[1e999]"), "numbers that a double can hold");
}

TEST(Files, ARefusalNamesItsFileOnceAndDoesNotWriteToTheTerminal) {
  EXPECT_EQ(vest::files::refusal("/a/x.yaml:3: no", "/a/x.yaml"), "/a/x.yaml:3: no");
  EXPECT_EQ(vest::files::refusal("/a/y.csv:3: no", "/a/x.yaml"), "/a/y.csv:3: no") << "of its folder";
  EXPECT_EQ(vest::files::refusal("no", "/a/x.yaml"), "/a/x.yaml: no");
  EXPECT_EQ(vest::files::refusal("y.csv: no", "x.yaml"), "x.yaml: y.csv: no");
  const std::string bad = "/a\x1b[2J\n\xe2\x80\xae/x", good = "/a\\x1b[2J\\x0a\\xe2\\x80\\xae/x: no";
  EXPECT_EQ(vest::files::refusal("no", bad), good);
  EXPECT_EQ(vest::files::refusal(bad + ": no", bad), good) << "not twice";
  EXPECT_EQ(vest::files::refusal(good, bad), good);
}

TEST(Files, WaypointsOfTenHoursAtAThousandHertzAreRefusedBeforeTheyAreRows) {
  const std::string file = inTest("waypoints.yaml");
  std::ofstream(file) << "rate: 1000\ninstruments:\n  left:\n    - {t: 0, tip: [0, 0, 0.06]}\n    - {t: "
                         "36000, tip: [0, 0, 0.06]}\n";
  const auto box = vest::kinematics::loadTrainerBox(VEST_INSTRUMENTS_DIR "/config/trainer_box.yaml");
  const std::string message = refusal([&] { vest::trajectory::fromWaypoints(file, box); });
  says(message, file + ": rate: 36000001 rows");
  std::ofstream(file) << "rate: 10\nrate: 20\ninstruments: {}\n";
  says(refusal([&] { vest::trajectory::fromWaypoints(file, box); }), "key 'rate' given twice");
  std::remove(file.c_str());
}

}  // namespace
