// The tool as a user runs it: files, messages, locale; and the published curves where they lie at hand.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <sstream>
#include <tuple>
#include <utility>
#include <vector>

#include "vest_effects/haemodynamics/network.h"

namespace {

namespace fs = std::filesystem;
using vest::haemodynamics::parseNumber;

struct Outcome {
  int status;
  std::string text;
};

Outcome call(const std::string& arguments, const std::string& environment = "") {
  const fs::path log = fs::path(::testing::TempDir()) / "vest_pulse_test.log";
  const std::string command =
      environment + " '" VEST_PULSE "' " + arguments + " > '" + log.string() + "' 2>&1";
  const int status = std::system(command.c_str());
  std::stringstream text;
  text << std::ifstream(log).rdbuf();
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text.str()};
}

using Columns = std::map<std::string, std::vector<double>>;

Columns readColumns(const fs::path& file) {
  Columns columns;
  std::ifstream stream(file);
  std::string line, cell;
  std::vector<std::string> names;
  std::getline(stream, line);
  for (std::stringstream header(line); std::getline(header, cell, ',');) names.push_back(cell);
  while (std::getline(stream, line)) {
    std::size_t i = 0;
    for (std::stringstream row(line); std::getline(row, cell, ',') && i < names.size(); ++i) {
      double value = 0;
      EXPECT_TRUE(parseNumber(cell, value)) << file << ": " << cell;
      columns[names[i]].push_back(value);
    }
  }
  return columns;
}

std::string slurp(const fs::path& file) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

const std::string kBifurcation = VEST_TEST_DATA "/bifurcation";

fs::path freshFolder(const std::string& name) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("vest_pulse_" + name);
  fs::remove_all(folder);
  return folder;
}

}  // namespace

TEST(VestPulse, WritesTheFilesOfTheContract) {
  const fs::path out = freshFolder("contract");
  const Outcome outcome = call("'" + kBifurcation + "' --output '" + out.string() + "'");
  ASSERT_EQ(outcome.status, 0) << outcome.text;
  for (const char* word : {"run time", "cells", "mass balance"})
    EXPECT_NE(outcome.text.find(word), std::string::npos) << outcome.text;
  for (const char* name : {"trunk", "left_branch", "right_branch"}) {
    for (const char* site : {"_prox.csv", "_mid.csv", "_dist.csv"}) {
      const fs::path file = out / (std::string(name) + site);
      ASSERT_TRUE(fs::exists(file)) << file;
      EXPECT_EQ(slurp(file).substr(0, 22), "t_s,P_Pa,Q_m3_s,A_m2\n0");
      const Columns c = readColumns(file);
      ASSERT_EQ(c.at("t_s").size(), 800u);
      for (std::size_t i = 0; i < 800; ++i)
        ASSERT_NEAR(c.at("t_s")[i], 0.001 * static_cast<double>(i), 1e-12);
    }
  }
  EXPECT_EQ(slurp(out / "summary.csv").substr(0, 74),
            "id,name,P_mean_Pa,P_min_Pa,P_max_Pa,Q_mean_m3_s,Q_min_m3_s,Q_max_m3_s\n1,tr");
  // Mass, read off the files as an outsider would.
  const Columns trunk = readColumns(out / "trunk_dist.csv"), left = readColumns(out / "left_branch_prox.csv"),
                right = readColumns(out / "right_branch_prox.csv"), in = readColumns(out / "trunk_prox.csv"),
                left_end = readColumns(out / "left_branch_dist.csv"),
                right_end = readColumns(out / "right_branch_dist.csv");
  double total_in = 0, total_out = 0;
  for (std::size_t i = 0; i < 800; ++i) {
    ASSERT_NEAR(trunk.at("Q_m3_s")[i], left.at("Q_m3_s")[i] + right.at("Q_m3_s")[i], 1e-12);
    total_in += in.at("Q_m3_s")[i];
    total_out += left_end.at("Q_m3_s")[i] + right_end.at("Q_m3_s")[i];
  }
  EXPECT_NEAR(total_out, total_in, 1e-3 * total_in);
  fs::remove_all(out);
}

TEST(VestPulse, ThreadsKernelLevelAndAGermanLocaleChangeNothing) {
  const fs::path one = freshFolder("one"), other = freshFolder("other");
  const std::string common = "'" + kBifurcation + "' --cycles 2 --dx 0.004 --output ";
  ASSERT_EQ(call(common + "'" + one.string() + "'").status, 0);
  const struct {
    const char *options, *environment;
  } variants[] = {
      {"", "LC_ALL=de_DE.UTF-8 LANG=de_DE.UTF-8"}, {" --threads 3", ""}, {"", "VEST_KERNEL=baseline"}};
  for (const auto& variant : variants) {
    const Outcome outcome = call(common + "'" + other.string() + "'" + variant.options, variant.environment);
    ASSERT_EQ(outcome.status, 0) << outcome.text;
    int files = 0;
    for (const auto& entry : fs::directory_iterator(one)) {
      EXPECT_EQ(slurp(entry.path()), slurp(other / entry.path().filename()))
          << entry.path() << variant.environment;
      ++files;
    }
    EXPECT_EQ(files, 10);
    fs::remove_all(other);
  }
  fs::remove_all(one);
}

TEST(VestPulse, RefusesWithOneMessageThatNamesFileLineAndField) {
  const fs::path folder = freshFolder("bad_case"), out = freshFolder("bad_out");
  fs::copy(kBifurcation, folder);
  std::string network = slurp(folder / "network.csv");
  network.replace(network.find("0.009"), 5, "0");
  std::ofstream(folder / "network.csv") << network;
  const Outcome outcome = call("'" + folder.string() + "' --output '" + out.string() + "'");
  EXPECT_NE(outcome.status, 0);
  EXPECT_NE(outcome.text.find("network.csv:2: r_prox_m = 0: allowed is 1e-07 ... 1"), std::string::npos)
      << outcome.text;
  EXPECT_FALSE(fs::exists(out));
  for (const char* options :
       {"--dx 0", "--dx 0,002", "--dx nan", "--cycles 0", "--cycles x", "--threads 0", "--unknown"}) {
    const Outcome bad = call("'" + kBifurcation + "' --output '" + out.string() + "' " + options);
    EXPECT_NE(bad.status, 0) << options;
    EXPECT_FALSE(bad.text.empty()) << options;
  }
  EXPECT_NE(call("'" + kBifurcation + "'").status, 0) << "--output is required";
  fs::remove_all(folder);
}

TEST(VestPulse, UnwritableOutputIsReported) {
  const fs::path file = fs::path(::testing::TempDir()) / "vest_pulse_is_a_file";
  std::ofstream(file) << "x";
  const Outcome outcome = call("'" + kBifurcation + "' --cycles 1 --output '" + file.string() + "'");
  EXPECT_NE(outcome.status, 0);
  EXPECT_NE(outcome.text.find("vest_pulse_is_a_file"), std::string::npos) << outcome.text;
  fs::remove(file);
}

// Boileau et al. 2015, benchmarks 2 and 3: the criteria of their case.json.
using PublishedCase = std::tuple<const char*, const char*, double>;

fs::path referenceFolder() {
  const char* elsewhere = std::getenv("VEST_SHARED_DATA");
  return elsewhere ? elsewhere : VEST_SHARED_DATA;
}

// The cases whose curves lie at hand; none in a clone by itself.
std::vector<PublishedCase> publishedCases() {
  std::vector<PublishedCase> found;
  for (const PublishedCase& one :
       {PublishedCase("cca", "common_carotid", 3.0), PublishedCase("uta", "upper_thoracic_aorta", 12.0)}) {
    if (fs::exists(referenceFolder() / std::get<0>(one) / "ref_fv1d_mid.csv")) found.push_back(one);
  }
  return found;
}

class PublishedCurves : public ::testing::TestWithParam<PublishedCase> {};

TEST_P(PublishedCurves, AreReproducedWithinTheirCriterion) {
  const auto [name, segment, radius_mm] = GetParam();
  const fs::path folder = referenceFolder() / name;
  const fs::path out = freshFolder(name);
  const Outcome outcome = call("'" + folder.string() + "' --output '" + out.string() + "'");
  ASSERT_EQ(outcome.status, 0) << outcome.text;
  const Columns reference = readColumns(folder / "ref_fv1d_mid.csv");
  const Columns mid = readColumns(out / (std::string(segment) + "_mid.csv"));
  const Columns prox = readColumns(out / (std::string(segment) + "_prox.csv"));
  const Columns dist = readColumns(out / (std::string(segment) + "_dist.csv"));
  const std::size_t count = reference.at("t_s").size();
  ASSERT_EQ(mid.at("t_s").size(), count);
  const auto compare = [&](const char* what, const char* column,
                           const std::function<double(std::size_t)>& ours, double rms_limit,
                           double extreme_limit) {
    const auto& theirs = reference.at(column);
    double sum = 0, greatest = 0, our_max = -1e300, max = -1e300, our_min = 1e300, min = 1e300;
    for (std::size_t i = 0; i < count; ++i) {
      sum += std::pow(ours(i) - theirs[i], 2);
      greatest = std::max(greatest, std::fabs(theirs[i]));
      max = std::max(max, theirs[i]);
      min = std::min(min, theirs[i]);
      our_max = std::max(our_max, ours(i));
      our_min = std::min(our_min, ours(i));
    }
    const double rms = std::sqrt(sum / static_cast<double>(count)) / greatest;
    std::printf("%s %s: RMS %.3f %%, greatest %+.3f %%, least %+.3f %% (of the greatest)\n", name, what,
                100 * rms, 100 * (our_max - max) / greatest, 100 * (our_min - min) / greatest);
    EXPECT_LT(rms, rms_limit) << what;
    EXPECT_LT(std::fabs(our_max - max) / greatest, extreme_limit) << what;
  };
  compare(
      "P", "P_kPa", [&](std::size_t i) { return mid.at("P_Pa")[i] / 1000; }, 0.005, 0.005);
  compare(
      "Q", "Q_ml_s", [&](std::size_t i) { return mid.at("Q_m3_s")[i] * 1e6; }, 0.01, 0.01);
  compare(
      "dr", "dr_mm",
      [&, r = radius_mm](std::size_t i) { return std::sqrt(mid.at("A_m2")[i] / M_PI) * 1000 - r; }, 0.01,
      0.02);
  compare(
      "dP", "dP_in_minus_out_kPa",
      [&](std::size_t i) { return (prox.at("P_Pa")[i] - dist.at("P_Pa")[i]) / 1000; }, 0.01, 0.02);
  fs::remove_all(out);
}

TEST(PulseSvg, DrawsACurveAndRefusesWhatIsNoneInOneLine) {
  const fs::path folder = fs::path(::testing::TempDir()) / "vest_pulse_svg_test";
  fs::create_directories(folder);
  const std::string good = "t_s,P_Pa,Q_m3_s\n0,1000,1e-6\n0.1,2000,2e-6\n0.2,1500,1e-6\n";
  const auto draw = [&](const std::string& result, const std::string& reference) {
    std::ofstream(folder / "a.csv") << result;
    std::ofstream(folder / "b.csv") << reference;
    const fs::path log = folder / "log";
    const std::string at = "'" + folder.string() + "/";
    const int status = std::system(("/usr/bin/python3 '" VEST_PULSE_SVG "' " + at + "a.csv' " + at +
                                    "b.csv' " + at + "out.svg' --title 'a < b' 2> '" + log.string() + "'")
                                       .c_str());
    std::stringstream text;
    text << std::ifstream(log).rdbuf();
    return Outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1, text.str()};
  };
  const Outcome drawn = draw(good, good);
  EXPECT_EQ(drawn.status, 0) << drawn.text;
  std::stringstream picture;
  picture << std::ifstream(folder / "out.svg").rdbuf();
  EXPECT_NE(picture.str().find("a &lt; b"), std::string::npos);
  fs::remove(folder / "out.svg");
  const std::string head = "t_s,P_Pa,Q_m3_s\n";
  for (const std::string& bad :
       {std::string(), head, head + "0,1,1\n", head + "0,1,1\n0,1,1\n", head + "0,1,1\n1,nan,1\n",
        head + "0,1,1\n1,1e300,1\n", head + "-1,1,1\n1,1,1\n", head + "0,1,1\ninf,1,1\n",
        std::string("a,b\n1,2\n"), std::string("\0\xff\n", 3), head + "0,1\n1,1\n"}) {
    for (const auto& [result, reference] : {std::pair(bad, good), std::pair(good, bad)}) {
      const Outcome refused = draw(result, reference);
      EXPECT_EQ(refused.status, 1) << bad;
      EXPECT_EQ(std::count(refused.text.begin(), refused.text.end(), '\n'), 1) << bad << refused.text;
      EXPECT_NE(refused.text.find(".csv"), std::string::npos) << refused.text;
      EXPECT_FALSE(fs::exists(folder / "out.svg")) << bad;
    }
  }
  // Nobody waits for a pipe, or reads without end.
  for (const char* const of : {"mkfifo", "ln -s /dev/zero"}) {
    fs::remove(folder / "c.csv");
    ASSERT_EQ(std::system((std::string(of) + " '" + (folder / "c.csv").string() + "'").c_str()), 0);
    const int status =
        std::system(("timeout 20 /usr/bin/python3 '" VEST_PULSE_SVG "' '" + (folder / "c.csv").string() +
                     "' '" + (folder / "b.csv").string() + "' '" + (folder / "out.svg").string() + "' 2> '" +
                     (folder / "log").string() + "'")
                        .c_str());
    EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 1) << of;
  }
  fs::remove_all(folder);
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(PublishedCurves);
INSTANTIATE_TEST_SUITE_P(Boileau, PublishedCurves, ::testing::ValuesIn(publishedCases()));
