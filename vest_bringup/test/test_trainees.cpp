#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/stat.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include <sqlite3.h>

#include "vest_bringup/exercise/curriculum.h"
#include "vest_bringup/exercise/erase_reports.h"
#include "vest_bringup/exercise/learning_curve.h"
#include "vest_bringup/exercise/rating.h"
#include "vest_bringup/exercise/report.h"
#include "vest_bringup/exercise/trainees.h"

// Protects what is kept of people: by pseudonym alone, readable by the owner alone, erased when asked,
// nothing lost when the disk is full or another program holds the file; and reports from what their texts
// contain.

namespace vest::exercise {
namespace {

namespace fs = std::filesystem;
const std::string kDoctor = "\U0001F469\u200d\u2695\uFE0F";  // one emoji of two, by a joiner
const std::string kHostile = "R\"o'bert'); DROP TABLE trainee;-- <b>&" + kDoctor + "</b>";

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
  EXPECT_EQ(nlohmann::json::parse(t.exported(kHostile))["trainee"], kHostile);
  EXPECT_NE(refusal([&] { t.add("anna"); }).find("is there already"), std::string::npos);
  for (const char* bad : {"", "line\nbreak", "\xff\xfe", "\xf0\x9f\x98", "bell\a", "\xe2\x80\xae",
                          "\xed\xa0\x80", "\xe0\x80\x80"})
    EXPECT_NE(refusal([&] { t.add(bad); }).find("not a pseudonym"), std::string::npos) << bad;
  for (const char* hidden : {"an\u200dna", "anna\u200d", "\u200d\U0001F467"})
    EXPECT_NE(refusal([&] { t.add(hidden); }).find("not a pseudonym"), std::string::npos)
        << "looks like another";
  EXPECT_NE(refusal([&] { t.add(std::string(65, 'x')); }).find("64 bytes"), std::string::npos);
  EXPECT_NE(refusal([&] { t.keep(attempt("nobody")); }).find("unknown"), std::string::npos);
  EXPECT_NE(refusal([&] { t.attempts("no\nbody"); }).find("no\\x0abody"), std::string::npos) << "one line";
}

TEST_F(TraineesTest, ANameThatCannotBeToldFromNoneOrAnotherIsRefused) {
  Trainees t(file_);
  for (const char* name : {"", " ", "anna ", " anna"})
    EXPECT_NE(refusal([&] { t.add(name); }).find("no blank at either end"), std::string::npos) << name;
  t.add("anna maria");
  EXPECT_EQ(t.list().size(), 1U);
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

TEST_F(TraineesTest, OfTwoThatHandTheSameInTogetherOneIsTheCopy) {
  { Trainees(file_).add("anna"); }
  constexpr int kTimes = 20;
  std::atomic<int> at{0}, originals{0};
  const auto hand_in = [&] {
    Trainees own(file_);
    for (int i = 0; i < kTimes; ++i) {
      for (++at; at < 2 * (i + 1);) std::this_thread::yield();
      originals += own.keep(attempt("anna", std::to_string(i))).flags.empty();
    }
  };
  std::thread other(hand_in);
  hand_in();
  other.join();
  EXPECT_EQ(originals, kTimes);
  EXPECT_EQ(Trainees(file_).attempts("anna").size(), 2U * kTimes);
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

TEST_F(TraineesTest, ACurriculumTellsWhatIsDoneAndGoesWithTheTrainee) {
  Trainees trainees(file_);
  trainees.add("anna"), trainees.add("berta");
  EXPECT_TRUE(curriculumSteps(trainees.attempts("anna")).empty());
  for (const char* name : {"anna", "berta"})
    EXPECT_EQ(trainees.keep(curriculumOf({"touch_order", "clip_cut_tube"}, name, "2026-11-29")).flags, "")
        << "a class has the same one";
  int input = 0;
  const auto attempted = [&](bool passed, const char* flags = "") {
    Attempt a = attempt("anna", "input " + std::to_string(++input));
    a.passed = passed, a.flags = flags;
    trainees.keep(a);
    return curriculumSteps(trainees.attempts("anna")).at(1);
  };
  EXPECT_FALSE(attempted(true).done) << "one pass may be luck";
  EXPECT_FALSE(attempted(false).done);
  EXPECT_FALSE(attempted(true).done) << "two in a row are asked for";
  EXPECT_FALSE(attempted(true, "assisted").done);
  EXPECT_TRUE(attempted(true).done);
  const CurriculumStep step = attempted(false);
  EXPECT_TRUE(step.done) << "once learned";
  EXPECT_EQ(step.attempts, 5U);
  EXPECT_FALSE(curriculumSteps(trainees.attempts("anna")).at(0).done);
  EXPECT_TRUE(trainees.attempts("anna", "touch_order").empty()) << "it is in no learning curve";
  trainees.keep(curriculumOf({"lift_tube"}, "anna", "2026-11-30"));
  EXPECT_EQ(curriculumSteps(trainees.attempts("anna")).at(0).exercise, "lift_tube") << "the newest holds";
  EXPECT_NE(trainees.exported("anna").find("lift_tube"), std::string::npos);
  trainees.erase("anna");
  EXPECT_EQ(bytes().find("lift_tube"), std::string::npos);
  Attempt bad = curriculumOf({}, "berta", "2026-12-01");
  bad.json = "{\"exercises\": 5";
  trainees.keep(bad);
  EXPECT_NE(refusal([&] { curriculumSteps(trainees.attempts("berta")); }).find("curriculum of"),
            std::string::npos);
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

TEST_F(TraineesTest, ErasedIsGoneFromReportsAndNotFromThoseOfOthers) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(folder_ + "/" + name) << text;
  };
  const auto statement = [](const std::string& name) {
    return nlohmann::json{{"actor", {{"account", {{"name", name}}}}}}.dump();
  };
  const char* const kOurs[] = {"report.html", "report.pdf", "learning.json", "learning.csv"};
  for (const char* name : kOurs) write(name, "Trainee anna");
  write("score.json", "{}"), write("session.bag", "steps");
  for (const std::string& other : {std::string("{"), std::string("{}"), statement("ben")}) {
    write("xapi.json", other);
    EXPECT_FALSE(eraseReports(folder_, "anna"));
    EXPECT_NE(bytes().find("anna"), std::string::npos);
  }
  write("xapi.json", statement(kHostile));
  EXPECT_TRUE(eraseReports(folder_, kHostile));
  EXPECT_FALSE(eraseReports(folder_, kHostile)) << "and none is there any more";
  EXPECT_FALSE(eraseReports("", "anna"));
  EXPECT_EQ(bytes().find("anna"), std::string::npos);
  EXPECT_TRUE(fs::exists(folder_ + "/score.json") && fs::exists(folder_ + "/session.bag"));
}

TEST_F(TraineesTest, WhoErasesIsToldWhereAReaderKeepsTheBytes) {
  Trainees t(file_, 50);
  t.add("anna");
  sqlite3* reader = nullptr;
  ASSERT_EQ(sqlite3_open(file_.c_str(), &reader), SQLITE_OK);
  t.keep(attempt("anna"));
  ASSERT_EQ(sqlite3_exec(reader, "BEGIN; SELECT * FROM attempt", nullptr, nullptr, nullptr), SQLITE_OK);
  EXPECT_NE(refusal([&] { t.erase("anna"); }).find("-wal, which has the old bytes still"), std::string::npos);
  sqlite3_close(reader);
  Trainees(file_).list();
  EXPECT_EQ(t.list().size(), 0U);
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

TEST_F(TraineesTest, WhatLiesInThePlaceOfAJournalIsNotWaitedFor) {
  { Trainees(file_).add("anna"); }
  for (const char* beside : {"-journal", "-wal", "-shm"}) {
    const std::string own = file_ + beside;
    fs::remove(own);
    ASSERT_EQ(::mkfifo(own.c_str(), 0600), 0);
    EXPECT_NE(refusal([&] { Trainees t(file_); }).find(own + ": is no file"), std::string::npos);
    fs::remove(own);
    fs::create_symlink("/proc/kmsg", own);
    EXPECT_NE(refusal([&] { Trainees t(file_); }).find(own + ": is no file"), std::string::npos);
    fs::remove(own);
  }
  EXPECT_EQ(Trainees(file_).list(), std::vector<std::string>{"anna"});
}

TEST_F(TraineesTest, AJournalDoesNotLetTheDatabaseGrow) {
  { Trainees(file_).add("anna"); }
  const auto before = fs::file_size(file_);
  const std::string magic = "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
  // One page, a seed, 2^32 - 256 pages before; sectors of 512 bytes, pages of 4096.
  const unsigned char head[] = {0, 0, 0, 1, 0, 0, 0, 7, 0xff, 0xff, 0xff, 0, 0, 0, 2, 0, 0, 0, 0x10, 0};
  std::string journal = magic + std::string(reinterpret_cast<const char*>(head), sizeof head);
  journal.resize(512);
  std::ofstream(file_ + "-journal", std::ios::binary) << journal;
  EXPECT_NE(refusal([&] { Trainees t(file_); }).find("-journal: pages: 4294967040 (allowed: at most 16384"),
            std::string::npos);
  EXPECT_EQ(fs::file_size(file_), before);
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
  const auto told = nlohmann::json::parse(odd.exported("anna"), nullptr, false);
  ASSERT_TRUE(told.is_object()) << "JSON, whatever was kept";
  EXPECT_EQ(told["attempts"][0]["result"].get<std::string>().size(), 200000U) << "all of it";
  // Numbers that are compared come from JSON that says one thing alone.
  Trainees twice(changed(
      "INSERT INTO attempt(trainee, exercise, date, json) VALUES('anna', 'x', 'then', '{\"items\": [], "
      "\"items\": []}')"));
  EXPECT_NE(
      refusal([&] { twice.attempts("anna", "x"); }).find("changed.db: attempt of then: json: key: items"),
      std::string::npos);
  EXPECT_EQ(twice.attempts("anna").size(), 1U);
  ASSERT_EQ(mkfifo((folder_ + "/pipe").c_str(), 0600), 0);
  for (const std::string& none :
       {folder_ + "/pipe", std::string("/dev/null"), std::string("/proc/self/comm")})
    EXPECT_NE(refusal([&] { Trainees t(none); }).find("is no file"), std::string::npos) << none;
}

Attempt attempt(double total, bool passed = true) {
  Attempt a;
  a.total = total, a.passed = passed, a.exercise = "x", a.exercise_hash = "1", a.time = 100 - total;
  a.json =
      "{\"items\": [{\"name\": \"off\", \"better\": \"lower\", \"value\": " + std::to_string(total) + "}]}";
  return a;
}

TEST(Learning, TheCurveOfAKnownLawIsFoundAndNotBeforeSixAttempts) {
  std::vector<double> totals;
  for (int n = 1; n <= 5; ++n) totals.push_back(90 - 60 * std::pow(n, -0.8));
  EXPECT_FALSE(fitCurve(totals));
  for (int n = 6; n <= 20; ++n) totals.push_back(90 - 60 * std::pow(n, -0.8));
  const auto curve = fitCurve(totals);
  ASSERT_TRUE(curve);
  EXPECT_NEAR(curve->a, 90, 1e-3);
  EXPECT_NEAR(curve->b, -60, 1e-3);
  EXPECT_NEAR(curve->c, 0.8, 1e-4);
  EXPECT_LT(curve->rms, 1e-5);
  const auto flat = fitCurve(std::vector<double>(8, 70));
  EXPECT_NEAR(flat->a, 70, 1e-9) << "who is as good as ever has no slope";
  EXPECT_NEAR(flat->b, 0, 1e-9);
}

TEST(Learning, CusumDecidesAfterTwentyPassesAndAfterThreeFailures) {
  // ln((1-beta)/alpha) and ln((1-p0)/(1-p1)) over ln(p1/p0) + ln((1-p0)/(1-p1)), alpha = beta = 0.1.
  const double p = std::log(kBadRate / kGoodRate), q = std::log((1 - kGoodRate) / (1 - kBadRate));
  EXPECT_NEAR(kCusumStep, q / (p + q), 5e-4);
  EXPECT_NEAR(kCusumLimit, std::log(9) / (p + q), 5e-3);
  using Verdict = Cusum::Verdict;
  EXPECT_EQ(cusumOf(std::vector<bool>(19, true)).verdict, Verdict::Open);
  const Cusum good = cusumOf(std::vector<bool>(21, true));
  EXPECT_EQ(good.verdict, Verdict::Competent);
  EXPECT_NEAR(good.sums[19], -1.84, 1e-12);
  EXPECT_NEAR(good.sums[20], -0.092, 1e-12) << "it begins anew";
  EXPECT_EQ(cusumOf({false, false}).verdict, Verdict::Open);
  EXPECT_EQ(cusumOf({false, false, false}).verdict, Verdict::NotYet);
}

TEST(Learning, ZScoresAreStandardDeviationsBetterThanTheGroup) {
  std::vector<Attempt> group;
  for (const double total : {50, 60, 70, 80, 90}) group.push_back(attempt(total));
  group.push_back(attempt(0)), group.back().flags = "copy";
  EXPECT_THROW(referenceOf("x", {group.begin(), group.begin() + 4}), std::invalid_argument);
  const Reference reference = parseReference("r", toJson(referenceOf("x", group)));
  EXPECT_EQ(reference.attempts, 5U);
  const auto z = zScores(reference, attempt(70 + 2 * std::sqrt(250)));  // sample variance 250
  ASSERT_EQ(z.size(), 3U) << "total, time_s and the item; quality is the same for all";
  EXPECT_EQ(z[0].name, "total");
  EXPECT_NEAR(z[0].z, 2, 1e-12);
  EXPECT_EQ(z[1].name, "time_s");
  EXPECT_NEAR(z[1].z, 2, 1e-12) << "less time is better";
  EXPECT_EQ(z[2].name, "off");
  EXPECT_NEAR(z[2].z, -2, 1e-5);
  Attempt other = attempt(70);
  other.exercise_hash = "2";
  EXPECT_TRUE(zScores(reference, other).empty()) << "another version of the exercise";
  for (const char* bad :
       {"", "[", "{}", "{\"figures\": []}", "{\"vest_reference\": 2, \"figures\": []}",
        "{\"vest_reference\": 1, \"exercise\": \"x\", \"exercise_hash\": \"1\", \"attempts\": 5, "
        "\"figures\": [{\"name\": \"a\", \"mean\": 1, \"deviation\": -1}]}"})
    EXPECT_THROW(parseReference("r", bad), std::invalid_argument) << bad;
  std::string twice = toJson(reference);
  twice.insert(twice.find("\"exercise\""), "\"exercise\": \"y\", ");
  try {
    parseReference("r", twice);
    ADD_FAILURE() << "taken";
  } catch (const std::invalid_argument& why) {
    EXPECT_EQ(std::string(why.what()), "r: line 3: key: exercise: each key once");
  }
}

TEST(Learning, AttemptsWithAFlagCountForNothingAndAreInTheTable) {
  std::vector<Attempt> attempts{attempt(10, false), attempt(20), attempt(30)};
  attempts[1].flags = "assisted";
  const Learning l = learningOf(attempts, std::nullopt);
  EXPECT_EQ(l.totals, (std::vector<double>{10, 30}));
  EXPECT_EQ(toCsv(l),
            "attempt,date,total,quality,time_s,passed,counts,cusum\n"
            "1,,10,0,90,0,1,0.90800000000000003\n2,,20,0,80,1,0,\n3,,30,0,70,1,1,0.81600000000000006\n");
  const auto j = nlohmann::json::parse(toJson(l));
  EXPECT_EQ(j["attempts"].size(), 3U);
  EXPECT_TRUE(j["curve"].is_null());
  EXPECT_EQ(j["cusum"]["verdict"], "open");
  EXPECT_EQ(toText(l), "");
}

Report reportOf(const Exercise& e, const Result& r, const Trace& trace) {
  return {e,
          r,
          trace,
          kHostile,
          "2026-01-02T03:04:05Z",
          "0",
          learningOf({attempt(10), attempt(40)}, std::nullopt),
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
  EXPECT_NE(html.find(kDoctor), std::string::npos) << "what is no markup stays";
  EXPECT_NE(html.find("base64,/9j/\""), std::string::npos);
  for (const char* beside : {"src=\"http", "href=", "url(", "@import"})
    EXPECT_EQ(html.find(beside), std::string::npos) << beside;
  EXPECT_NE(html.find("Learning curve"), std::string::npos);
}

TEST(Report, NumbersAreNoFinerThanASurgeonReads) {
  for (const auto& [value, text] :
       std::initializer_list<std::pair<double, const char*>>{{0.000412, "0.0"},
                                                             {-0.000412, "0.0"},
                                                             {0, "0"},
                                                             {5, "5"},
                                                             {0.0712, "0.07"},
                                                             {0.5, "0.5"},
                                                             {0.3461, "0.35"},
                                                             {-2.345, "-2.35"},
                                                             {9.996, "10.0"},
                                                             {12.34, "12.3"},
                                                             {99.96, "100"},
                                                             {1234.5678, "1235"},
                                                             {12345678, "12345678"},
                                                             {NAN, "-"},
                                                             {INFINITY, "-"}})
    EXPECT_EQ(readable(value), text);
  Exercise e;
  e.items.resize(2);
  e.items[0].number.metric = Metric::ForcePeak, e.items[0].pass = 0.5, e.items[0].proficient = 0.1;
  e.items[1].number.metric = Metric::Path, e.items[1].pass = 1200, e.items[1].proficient = 500;
  Result r;
  r.items.resize(2);
  r.items[0].value = 0.000412, r.items[1].value = 1234.5678;
  Trace trace;
  scene::StepInput input;
  scene::StepReport faint;
  input.dt = 0.1, input.tools[1].present = true, faint.contacts[1].wrench[0] = 0.000412;
  for (int i = 0; i < 5; ++i) trace.add(input, faint);
  const std::string html = toHtml(reportOf(e, r, trace));
  for (const char* part : {">0.0 N<", ">0.5<", ">0.1<", ">1235 mm<", ">1200<"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  for (const std::string& page : {html, toText(e, r)})
    for (const char* part : {"0.0004", "e+0", "e-0"}) EXPECT_EQ(page.find(part), std::string::npos) << part;
}

TEST(Report, TellsHowEachHandMoved) {
  Trace trace;
  scene::StepInput input;
  input.dt = 0.001;
  for (int i = 0; i < 6000; ++i) {  // the left hand round a corner, the right one in the last second alone
    const double t = 0.001 * i;
    input.tools[0].present = true, input.tools[1].present = t >= 5.0;
    input.tools[0].position = {0.02 * std::min(t, 3.0), 0.02 * std::max(0.0, t - 3.0), 0};
    input.tools[1].position = {0, 0, 0.1 - 0.03 * (t - 5.0)};
    trace.add(input, {});
  }
  const auto economy = [&](const std::vector<Moment>& moments) {
    return trace.motion(moments).tools.at(0).economy;
  };
  using Kind = Moment::Kind;
  EXPECT_NEAR(economy({{Kind::PhaseEnded, 3000, 0}, {Kind::PhaseEnded, 6000, 1}}).value(), 1.0, 2e-3);
  EXPECT_NEAR(economy({{Kind::PhaseEnded, 1000, 0}, {Kind::PhaseEnded, 2000, 1}}).value(), 1.0 / 3.0, 2e-3);
  EXPECT_NEAR(economy({{Kind::PhaseEnded, 6000, 0}}).value(), std::sqrt(0.5), 2e-3);
  EXPECT_FALSE(economy({{Kind::Hint, 6000, 0}}).has_value()) << "no goal, no economy";
  const auto f = trace.motion({});
  ASSERT_EQ(f.tools.size(), 2U) << "the third hand was never there";
  EXPECT_NEAR(f.tools[0].path, 0.12, 1e-3);
  EXPECT_NEAR(f.tools[1].mean_speed, 0.03, 1e-4);
  EXPECT_NEAR(f.tools[1].depth_path.value(), 0.03, 1e-3);
  EXPECT_NEAR(f.bimanual.value(), 1.0, 1e-9) << "while both are there";
  Exercise e;
  Result r;
  const std::string html = toHtml(reportOf(e, r, trace));
  for (const char* part :
       {"<td>left</td><td class=\"n\">120 mm<", ">20 mm/s<", ">30 mm/s<", "<th>SPARC</th>"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
}

TEST(Report, TheStatementSaysWhoWhatAndHowWell) {
  Exercise e;
  e.title = "T";
  Result r;
  r.exercise = "x", r.total = 80, r.time = 12.5, r.passed = r.finished = true;
  const Trace trace;
  Report report = reportOf(e, r, trace);
  report.learning.attempts.back().flags = "practice,copy";
  const auto j = nlohmann::json::parse(toXapi(report));
  EXPECT_EQ(j["actor"]["account"]["name"], kHostile);
  const std::string home = j["actor"]["account"]["homePage"];
  EXPECT_EQ(home.rfind("https://", 0), 0U) << "xAPI 1.0.3, 2.4.2.4: an IRL, so a URL and no URN";
  EXPECT_EQ(j["verb"]["id"], "http://adlnet.gov/expapi/verbs/passed");
  EXPECT_EQ(j["object"]["id"], "urn:vest:exercise:x");
  EXPECT_EQ(j["result"]["score"]["scaled"], 0.8);
  EXPECT_EQ(j["result"]["duration"], "PT12.50S");
  EXPECT_EQ(j["timestamp"], "2026-01-02T03:04:05Z");
  EXPECT_EQ(j["result"]["extensions"]["urn:vest:flags"], (std::vector<std::string>{"practice", "copy"}))
      << "who reads it alone learns that it does not count";
  const std::string html = toHtml(report);
  for (const char* why : {"practice: the session did not keep real time", "copy: the same input"})
    EXPECT_NE(html.find(why), std::string::npos) << why;
}

}  // namespace
}  // namespace vest::exercise
