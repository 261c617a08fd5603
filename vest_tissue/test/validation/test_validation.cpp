// Every claim of docs/validation.md, and the class that makes it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "sections.h"

namespace {

using namespace vest;

class Claims : public testing::TestWithParam<std::size_t> {};

TEST_P(Claims, AllHold) {
  const auto entry = validate::sections()[GetParam()];
  validate::Options options;
  options.full = std::getenv("VEST_FULL") != nullptr;
  const auto section = entry.make(options, "test");
  if (entry.name == "bars" || entry.name == "finite_elements")
    std::printf("count: %d of 1 series of finer meshes\n", options.full ? 1 : 0);
  if (entry.name == "knots") std::printf("count: %d of 1 table of all knots\n", options.full ? 1 : 0);
  EXPECT_GE(section.checks().size(), 2u);
  EXPECT_TRUE(section.passed()) << section.failures();
}

INSTANTIATE_TEST_SUITE_P(Section, Claims, testing::Range<std::size_t>(0, validate::sections().size()),
                         [](const auto& info) { return validate::sections()[info.param].name; });

TEST(Section, AClaimOutsideItsBoundOrWithoutANumberFailsAndIsNamed) {
  validation::Section s("42_test", "Test", "command");
  EXPECT_TRUE(s.atMost("small", 1.0, 2.0, "m"));
  EXPECT_TRUE(s.passed());
  EXPECT_FALSE(s.atMost("large", 3.0, 2.0, "m"));
  EXPECT_FALSE(s.atLeast("few", 3.0, 4.0, "no unit"));
  EXPECT_FALSE(s.atMost("lost", std::nan(""), 1e9, "m"));
  EXPECT_FALSE(s.passed());
  for (const char* word : {"large", "few", "lost", "42_test"})
    EXPECT_NE(s.failures().find(word), std::string::npos) << word;
  EXPECT_EQ(s.failures().find("small"), std::string::npos);
  EXPECT_NE(s.markdown().find("**fails**"), std::string::npos);
  EXPECT_THROW(validation::Section("test", "Test", "c"), std::invalid_argument);
}

TEST(Section, ThePageHoldsAllSectionsInOrderWithLinksFromItsOwnFolder) {
  const std::string folder = testing::TempDir() + "vest_page/validation";
  std::filesystem::remove_all(testing::TempDir() + "vest_page");
  validation::Section late("30_b", "Later", "c"), early("05_a", "Earlier", "c");
  early.plot("curve", {"A curve", "x, m", "y, m", {}, false, false});
  late.text("See [this](https://example.org).");
  late.write(folder);
  early.write(folder);
  std::ofstream(folder + "/notes.md") << "not a section";
  EXPECT_EQ(validation::assemble(folder, folder + ".md"), 2u);
  std::ifstream in(folder + ".md");
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_LT(text.str().find("## Earlier"), text.str().find("## Later"));
  EXPECT_NE(text.str().find("](validation/05_a_curve.svg)"), std::string::npos);
  EXPECT_NE(text.str().find("](https://example.org)"), std::string::npos);
  EXPECT_EQ(text.str().find("not a section"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder + "/05_a_curve.svg"));
}

}  // namespace
