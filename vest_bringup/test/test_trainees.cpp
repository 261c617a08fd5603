#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <sqlite3.h>

#include "vest_bringup/exercise/rating.h"
#include "vest_bringup/exercise/report.h"
#include "vest_bringup/exercise/trainees.h"

// Protects what is kept of people: by pseudonym alone, readable by the owner alone, erased when asked,
// nothing lost when the disk is full or another program holds the file; and reports from what their texts
// contain.

namespace vest::exercise {
namespace {

namespace fs = std::filesystem;
const char* const kHostile = "R\"o'bert'); DROP TABLE trainee;-- <b>&\xf0\x9f\x98\x80</b>";

class TraineesTest : public ::testing::Test {
 protected:
  TraineesTest() {
    std::string name = fs::temp_directory_path() / "vest_trainees_XXXXXX";
    folder_ = mkdtemp(name.data());
    file_ = folder_ + "/trainees.db";
  }
  ~TraineesTest() override { fs::remove_all(folder_); }

  static Attempt attempt(const std::string& trainee, const std::string& input = "1", double total = 50) {
    Attempt a;
    a.trainee = trainee, a.exercise = "clip_cut_tube", a.input_hash = input, a.total = total;
    a.json = "{\"secret\": \"SECRETWORD\"}";
    return a;
  }
  static std::string refusal(const std::function<void()>& call) {
    try {
      call();
    } catch (const DatabaseError& why) {
      EXPECT_EQ(std::string(why.what()).find('\n'), std::string::npos) << why.what();
      return why.what();
    }
    return "";
  }
  std::string bytes() const {
    std::string all;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      std::ifstream in(entry.path(), std::ios::binary);
      all.append(std::istreambuf_iterator<char>(in), {});
    }
    return all;
  }
  std::string folder_, file_;
};

TEST_F(TraineesTest, NamesWithQuotesAndEmojiAreNames) {
  Trainees t(file_);
  t.add(kHostile);
  t.add("anna");
  EXPECT_EQ(t.list(), (std::vector<std::string>{kHostile, "anna"}));
  t.keep(attempt(kHostile));
  EXPECT_EQ(t.attempts(kHostile).size(), 1U);
  EXPECT_EQ(t.attempts("anna").size(), 0U);
  EXPECT_NE(refusal([&] { t.add("anna"); }).find("is there already"), std::string::npos);
  for (const char* bad : {"", "line\nbreak", "\xff\xfe", "\xf0\x9f\x98", "bell\a", "\xe2\x80\xae",
                          "\xed\xa0\x80", "\xe0\x80\x80"})
    EXPECT_NE(refusal([&] { t.add(bad); }).find("not a pseudonym"), std::string::npos) << bad;
  EXPECT_NE(refusal([&] { t.add(std::string(65, 'x')); }).find("64 bytes"), std::string::npos);
  EXPECT_NE(refusal([&] { t.keep(attempt("nobody")); }).find("unknown"), std::string::npos);
}

TEST_F(TraineesTest, TheFileIsItsOwnersAlone) {
  Trainees t(file_);
  t.add("anna");
  for (const auto& entry : fs::directory_iterator(folder_)) {
    struct stat status = {};
    stat(entry.path().c_str(), &status);
    EXPECT_EQ(status.st_mode & 0777U, 0600U) << entry.path();
  }
}

TEST_F(TraineesTest, TheSameInputTwiceIsACopy) {
  Trainees t(file_);
  t.add("anna"), t.add("ben");
  EXPECT_EQ(t.keep(attempt("anna", "a")).flags, "");
  EXPECT_EQ(t.keep(attempt("anna", "b")).flags, "");
  EXPECT_EQ(t.keep(attempt("ben", "a")).flags, "copy");
}

TEST_F(TraineesTest, MarksOfAPersonAreKeptBesideTheScoresAndInNoLearningCurve) {
  Trainees trainees(file_);
  trainees.add("anna");
  for (int twice = 0; twice < 2; ++twice)
    EXPECT_EQ(trainees
                  .keep(ratingOf("GOALS", "clip_cut_tube", kHostile, {1, 2, 3, 4, 5}, "anna",
                                 "2026-11-2" + std::to_string(twice)))
                  .flags,
              "")
        << "the same marks again are no copy";
  EXPECT_TRUE(trainees.attempts("anna", "clip_cut_tube").empty());
  const auto kept = trainees.attempts("anna", "GOALS clip_cut_tube");
  ASSERT_EQ(kept.size(), 2U);
  EXPECT_EQ(kept[0].total, 15);
  EXPECT_EQ(kept[0].quality, 50);
  const auto json = nlohmann::json::parse(kept[0].json);
  EXPECT_EQ(json["rater"], kHostile);
  EXPECT_EQ(json["marks"]["tissue_handling"], 4);
  for (const auto& [form, marks] :
       std::vector<std::pair<std::string, std::vector<int>>>{{"GOALS", {1, 2, 3, 4, 5, 5}},
                                                             {"GEARS", {1, 2, 3, 4, 5}},
                                                             {"GOALS", {0, 2, 3, 4, 5}},
                                                             {"GOALS", {1, 2, 3, 4, 6}},
                                                             {"OSATS", {1, 2, 3, 4, 5}},
                                                             {"GOALS", {}}})
    EXPECT_THROW(ratingOf(form, "clip_cut_tube", "boss", marks, "anna", ""), std::invalid_argument) << form;
}

TEST_F(TraineesTest, ErasedIsGoneFromTheBytes) {
  Trainees t(file_);
  t.add("anna"), t.add("ben");
  t.keep(attempt("anna"));
  EXPECT_NE(t.exported("anna").find("SECRETWORD"), std::string::npos);
  EXPECT_NE(bytes().find("SECRETWORD"), std::string::npos);
  t.erase("anna");
  EXPECT_EQ(bytes().find("SECRETWORD"), std::string::npos);
  EXPECT_EQ(t.list(), std::vector<std::string>{"ben"});
}

TEST_F(TraineesTest, ALockedDatabaseIsOneMessageAndNothingIsLost) {
  Trainees t(file_, 50);
  t.add("anna");
  sqlite3* other = nullptr;
  ASSERT_EQ(sqlite3_open(file_.c_str(), &other), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(other, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr), SQLITE_OK);
  const std::string said = refusal([&] { t.keep(attempt("anna")); });
  EXPECT_EQ(said, file_ + ": keep a result: another program holds it (close that program, then try again)");
  EXPECT_NE(refusal([&] { Trainees second(file_, 50); }).find("another program holds it"), std::string::npos);
  sqlite3_close(other);
  t.keep(attempt("anna"));
  EXPECT_EQ(t.attempts("anna").size(), 1U);
}

TEST_F(TraineesTest, AFullDiskIsOneMessageAndNothingIsLost) {
  Trainees t(file_);
  t.add("anna");
  t.keep(attempt("anna", "a"));
  rlimit before = {};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit none{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &none);
  Attempt large = attempt("anna", "b");
  large.json.assign(100000, 'x');
  const std::string said = refusal([&] { t.keep(large); });
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_NE(said.find("the disk is full or failing"), std::string::npos) << said;
  t.keep(large);
  EXPECT_EQ(t.attempts("anna").size(), 2U);
}

TEST_F(TraineesTest, WhatIsNoDatabaseIsRefused) {
  std::ofstream(file_) << std::string(5000, 'x');
  EXPECT_NE(refusal([&] { Trainees t(file_); }).find("is no database of trainees, or damaged"),
            std::string::npos);
  EXPECT_NE(refusal([&] { Trainees t(folder_ + "/nowhere/t.db"); }).find("cannot be written"),
            std::string::npos);
  EXPECT_EQ(bytes(), std::string(5000, 'x')) << "left as it was";
}

TEST_F(TraineesTest, ADatabaseOfAStrangerIsReadAsIfItLied) {
  { Trainees(file_).add("anna"); }
  const auto changed = [&](const char* sql) {
    const std::string copy = folder_ + "/changed.db";
    fs::copy_file(file_, copy, fs::copy_options::overwrite_existing);
    sqlite3* other = nullptr;
    EXPECT_EQ(sqlite3_open(copy.c_str(), &other), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(other, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sql;
    sqlite3_close(other);
    return copy;
  };
  // A view can go on for ever, a trigger changes what was not asked for.
  for (const char* sql :
       {"DROP TABLE attempt; CREATE VIEW attempt AS WITH RECURSIVE r(x) AS (SELECT 1 UNION ALL SELECT x+1 "
        "FROM r) SELECT "
        "'anna' AS trainee, x AS id FROM r",
        "CREATE TRIGGER t AFTER INSERT ON trainee BEGIN DELETE FROM trainee; END", "CREATE TABLE more(x)",
        "DROP TABLE attempt", "DROP TABLE trainee; CREATE TABLE trainee(pseudonym)"})
    EXPECT_NE(refusal([&] { Trainees t(changed(sql)); }).find("is no database of trainees"),
              std::string::npos)
        << sql;
  Trainees odd(
      changed("INSERT INTO attempt(trainee, date, json) VALUES('anna', x'ff', replace(hex(zeroblob(100000)), "
              "'0', '['))"));
  EXPECT_NE(odd.exported("anna").find("result"), std::string::npos);
  ASSERT_EQ(mkfifo((folder_ + "/pipe").c_str(), 0600), 0);
  for (const std::string& none : {folder_ + "/pipe", std::string("/dev/null")})
    EXPECT_NE(refusal([&] { Trainees t(none); }).find("is no file"), std::string::npos) << none;
}

Report reportOf(const Exercise& e, const Result& r, const Trace& trace) {
  return {e,
          r,
          trace,
          kHostile,
          "2026-01-02T03:04:05Z",
          "0",
          {10, 40},
          {{1.5, "<i>", "\xff\xd8\xff"}},
          {{2.0, "<i>"}}};
}

TEST(Report, EscapesEveryTextAndNeedsNothingBesideIt) {
  Exercise e;
  e.name = "x", e.title = "<script>alert(1)</script>", e.aim = "a \"quoted\" & 'b'", e.limit = 10;
  e.items.resize(1);
  e.items[0].name = "<item>";
  Result r;
  r.exercise = e.name, r.items.resize(1);
  r.failed_by = {"<reason>"};
  Trace trace;
  scene::StepInput input;
  input.dt = 0.1, input.tools[1].present = true;
  for (int i = 0; i < 5; ++i) trace.add(input, {});
  const std::string html = toHtml(reportOf(e, r, trace));
  for (const char* raw : {"<script", "<item>", "<reason>", "<i>", "DROP TABLE trainee;-- <b>"})
    EXPECT_EQ(html.find(raw), std::string::npos) << raw;
  EXPECT_NE(html.find("&lt;script&gt;"), std::string::npos);
  EXPECT_NE(html.find("\xf0\x9f\x98\x80"), std::string::npos) << "what is no markup stays";
  EXPECT_NE(html.find("base64,/9j/\""), std::string::npos);
  for (const char* beside : {"src=\"http", "href=", "url(", "@import"})
    EXPECT_EQ(html.find(beside), std::string::npos) << beside;
  EXPECT_NE(html.find("Learning curve"), std::string::npos);
}

TEST(Report, TheStatementSaysWhoWhatAndHowWell) {
  Exercise e;
  e.title = "T";
  Result r;
  r.exercise = "x", r.total = 80, r.time = 12.5, r.passed = r.finished = true;
  const Trace trace;
  const std::string j = toXapi(reportOf(e, r, trace));
  for (const char* part : {"verbs/passed", "\"scaled\": 0.8", "\"duration\": \"PT12.50S\"",
                           "urn:vest:exercise:x", "\"timestamp\": \"2026-01-02T03:04:05Z\"", "R\\\"o'bert"})
    EXPECT_NE(j.find(part), std::string::npos) << part << "\n" << j;
}

}  // namespace
}  // namespace vest::exercise
