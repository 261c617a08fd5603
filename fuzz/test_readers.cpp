// Damaged inputs to every reader of files, in the ordinary build; ./test --full runs libFuzzer with
// sanitizers (fuzz/run_sanitized) beside it.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>

#include <gtest/gtest.h>

#include "readers.h"

namespace {

using vest::fuzz::Reader;

// Counter-based random numbers, so that a failure can be repeated (SplitMix64, Steele et al., OOPSLA 2014).
struct Random {
  std::uint64_t seed, index = 0;
  std::uint64_t operator()() {
    std::uint64_t z = seed * 0x2545f4914f6cdd1dull + 0x9e3779b97f4a7c15ull * ++index;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    return z ^ (z >> 31);
  }
  std::size_t below(std::size_t count) { return count == 0 ? 0 : (*this)() % count; }
};

const char* const kPieces[] = {"nan",  "-1", "0",  "1e39", "1e308", "-1e-308", "99999999999", "4294967295",
                               "[",    "{",  ": ", "\n",   "&a ",   "*a",      "---\n",       "!!binary ",
                               "..",   "//", "\"", "'",    ",",     ",,,,",    "\t",          "\xff\xfe",
                               "\x1b", "- ", "~",  "inf",  "0x10",  "1_0",     "true",        "=== x.csv\n"};

std::string damaged(const std::vector<std::string>& corpus, std::uint64_t seed) {
  Random random{seed};
  std::string s = corpus[random.below(corpus.size())];
  const std::size_t changes = 1 + random.below(5);
  for (std::size_t c = 0; c < changes; ++c) {
    const std::size_t at = random.below(s.size());
    switch (random.below(8)) {
      case 0:
        if (!s.empty()) s[at] = static_cast<char>(random());
        break;
      case 1:
        s.erase(at, 1 + random.below(30));
        break;
      case 2:
        s.insert(at, kPieces[random.below(std::size(kPieces))]);
        break;
      case 3: {  // another number
        const std::size_t from = s.find_first_of("0123456789", at);
        if (from == std::string::npos) break;
        const std::size_t end = std::min(s.find_first_not_of("0123456789.eE+-", from), s.size());
        s.replace(from, end - from, kPieces[random.below(8)]);
        break;
      }
      case 4:
        s.insert(at, s.substr(random.below(s.size()), random.below(80)));
        break;
      case 5:
        s.resize(at);
        break;
      case 6: {  // four bytes, as counts and indices of binary files
        const std::uint32_t values[] = {0, 0xffffffffu, 0x7fffffffu, 65536,
                                        static_cast<std::uint32_t>(random())};
        if (s.size() < at + 4) break;
        const std::uint32_t v = values[random.below(5)];
        s.replace(at, 4, reinterpret_cast<const char*>(&v), 4);
        break;
      }
      default: {
        const std::string& other = corpus[random.below(corpus.size())];
        s = s.substr(0, at) + other.substr(random.below(other.size()));
        break;
      }
    }
  }
  return s;
}

/// s of ./test: what once crashed, hung or judged wrongly is read for a minute a kind. These are surfaces and
/// meshes, scenes and their sources, sessions, snapshots.
const std::map<std::string, double> kLonger = {
    {"surface", 30}, {"mesh", 30},    {"scene", 30},    {"source", 30}, {"bag", 40},
    {"steps", 40},   {"summary", 20}, {"snapshot", 40}, {"state", 20},  {"field", 20}};

/// s, all readers: ./test ends a test after 600, also on a busy machine. The longer ones stop before.
constexpr double kPatience = 380;

/// What each reader was given, as a table at the end.
class Given : public ::testing::Environment {
 public:
  struct Row {
    std::string reader;
    std::uint64_t inputs;
    double seconds;
  };
  static std::vector<Row>& rows() {
    static std::vector<Row> of_all;
    return of_all;
  }
  void TearDown() override {
    if (rows().empty()) return;
    std::printf("| reader | changed inputs | s | inputs/s |\n| --- | ---: | ---: | ---: |\n");
    for (const Row& r : rows())
      std::printf("| %s | %llu | %.1f | %.0f |\n", r.reader.c_str(),
                  static_cast<unsigned long long>(r.inputs), r.seconds,
                  static_cast<double>(r.inputs) / std::max(r.seconds, 1e-3));
  }
};
const auto* const given = ::testing::AddGlobalTestEnvironment(new Given);

/// Inputs a reader in `--full`; a shell may ask for others: VEST_FULL=1 VEST_READER_INPUTS=1000000.
std::uint64_t wholeCount() {
  const char* const asked = std::getenv("VEST_READER_INPUTS");
  return asked == nullptr ? 100000 : std::max(1ull, std::strtoull(asked, nullptr, 10));
}

/// What ends this process is a file that can be given to the reader again. It is written then: a file for
/// each input would take longer than most readers.
class Last {
 public:
  static void keepAs(const std::string& file) {
    std::snprintf(name, sizeof name, "%s", file.c_str());
    for (const int s : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGVTALRM}) std::signal(s, write);
  }
  static void of(const std::string& input) { bytes = input.data(), size = input.size(); }

 private:
  static void write(int signal) {  // functions that signal-safety(7) lists, alone
    const int file = open(name, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (file >= 0 && ::write(file, bytes, size) == static_cast<ssize_t>(size))
      if (::write(2, name, std::strlen(name)) > 0 && ::write(2, ": the last input\n", 17) > 0) close(file);
    std::signal(signal, SIG_DFL);
    raise(signal);
  }
  static inline char name[512];
  static inline const char* bytes = nullptr;
  static inline std::size_t size = 0;
};

class Readers : public ::testing::TestWithParam<std::string> {};

TEST_P(Readers, TakeOrRefuseWhateverComes) {
  const Reader& reader = vest::fuzz::reader(GetParam());
  const auto corpus = vest::fuzz::corpus(reader);
  ASSERT_FALSE(corpus.empty()) << "fuzz/corpus/" << reader.name;
  for (const auto& input : corpus) reader.run(input);
  const bool full = std::getenv("VEST_FULL") != nullptr;
  const std::uint64_t whole = wholeCount(), least = full ? whole : 1000;
  const auto longer = kLonger.find(reader.name);
  const std::chrono::duration<double> most(full || longer == kLonger.end() ? 0.0 : longer->second);
  const auto begin = std::chrono::steady_clock::now();
  static const auto first = begin;
  const std::chrono::duration<double> patience(kPatience);
  Last::keepAs(::testing::TempDir() + "/vest_reader_" + reader.name);
  std::uint64_t seed = 0;
  const auto lasts = [&] {
    const auto now = std::chrono::steady_clock::now();
    return now - begin < most && now - first < patience;
  };
  while (++seed <= least || lasts()) {
    const std::string input = damaged(corpus, seed);
    Last::of(input);
    const itimerval limit{{0, 0}, {20, 0}};  // s of processor time: an endless loop ends the process
    setitimer(ITIMER_VIRTUAL, &limit, nullptr);
    reader.run(input);
  }
  std::printf("count: %llu of %llu changed inputs\n", static_cast<unsigned long long>(seed - 1),
              static_cast<unsigned long long>(std::max(whole, seed - 1)));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  Given::rows().push_back({reader.name, seed - 1, took.count()});
  const itimerval off{};
  setitimer(ITIMER_VIRTUAL, &off, nullptr);
}

/// Changed sessions that are all refused would tell nothing of the steps behind them.
TEST(Sessions, ChangedOnesReachAStepOfReSimulation) {
  constexpr std::uint64_t kCount = 200;
  for (const auto& [name, least] : {std::pair("bag", kCount / 100), std::pair("steps", kCount / 4)}) {
    const Reader& reader = vest::fuzz::reader(name);
    const auto corpus = vest::fuzz::corpus(reader);
    const std::uint64_t before = vest::fuzz::steppedSessions();
    for (const auto& input : corpus) {
      vest::fuzz::lastRefusal().clear();
      reader.run(input);
      EXPECT_EQ(vest::fuzz::lastRefusal(), "") << "a good one";
    }
    EXPECT_EQ(vest::fuzz::steppedSessions() - before, corpus.size()) << name;
    for (std::uint64_t seed = 1; seed <= kCount; ++seed) reader.run(damaged(corpus, seed));
    const std::uint64_t stepped = vest::fuzz::steppedSessions() - before - corpus.size();
    std::printf("%s: %llu of %llu changed ones reached a step\n", name,
                static_cast<unsigned long long>(stepped), static_cast<unsigned long long>(kCount));
    EXPECT_GT(stepped, least) << name;
  }
}

/// What a fuzzer finds must not lie among the sources, where a commit would take it.
TEST(Fuzzer, WhatFailsLiesInTheBuildUnlessAPlaceIsNamed) {
  using vest::fuzz::withPlaceOfBad;
  const auto named = withPlaceOfBad({"vest_fuzz", "-runs=1", "corpus"}, "curve");
  ASSERT_EQ(named.size(), 4u);
  EXPECT_EQ(named[0], "vest_fuzz");
  const std::string option = "-artifact_prefix=", end = "/build/fuzz/bad/curve/";
  ASSERT_GT(named[3].size(), option.size() + end.size());
  EXPECT_EQ(named[3].substr(0, option.size()), option);
  EXPECT_EQ(named[3].substr(named[3].size() - end.size()), end);
  EXPECT_EQ(access(named[3].c_str() + option.size(), W_OK), 0);
  const std::vector<std::string> own{"vest_fuzz", "-artifact_prefix=/tmp/", "-runs=1"};
  EXPECT_EQ(withPlaceOfBad(own, "curve"), own);
}

std::vector<std::string> names() {
  const rlimit memory{3ull << 30, 3ull << 30};  // a reader that wants more gets std::bad_alloc: no refusal
  setrlimit(RLIMIT_AS, &memory);
  std::vector<std::string> all;
  for (const auto& reader : vest::fuzz::readers()) all.push_back(reader.name);
  return all;
}

INSTANTIATE_TEST_SUITE_P(OfFiles, Readers, ::testing::ValuesIn(names()),
                         [](const auto& info) { return info.param; });

}  // namespace
