// Each bad value is refused with file, line and field; good oddities of the files are read.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "vest_effects/haemodynamics/model.h"

using namespace vest::haemodynamics;

namespace {

const char kCase[] =
    "{\n \"rho\": 1060,\n \"mu\": 0.004,\n \"zeta\": 2,\n \"period_s\": 1.0,\n \"taper\": \"linear\"\n}\n";
const char kHeader[] =
    "id,name,node_in,node_out,length_m,r_prox_m,r_dist_m,h_prox_m,h_dist_m,E_Pa,P_ref_Pa,terminal,R1_Pa_s_m3,"
    "R2_Pa_s_m3,"
    "C_m3_Pa,P_out_Pa\n";
const char kTrunk[] = "1,trunk,1,2,0.1,0.01,0.01,0.001,0.001,4e5,10000,0,0,0,0,0\n";
const char kLeft[] = "2,left,2,3,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,1,1e8,1e9,1e-9,0\n";
const char kRight[] = "3,right,2,4,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,1,1e8,1e9,1e-9,0\n";
const char kInflow[] = "t_s,Q_m3_s\n0,0\n0.2,1e-4\n0.4,0\n1,0\n";

class Refusal : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        std::filesystem::path(::testing::TempDir()) /
        (std::string("vest_refusal_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    write("case.json", kCase);
    write("network.csv", std::string(kHeader) + kTrunk + kLeft + kRight);
    write("inflow.csv", kInflow);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  void expectRefused(const std::string& file, int line, const std::string& field, double dx = 0.01) {
    try {
      buildModel(readCase(folder_.string()), dx);
      ADD_FAILURE() << "accepted, though " << field << " is bad";
    } catch (const NetworkError& error) {
      EXPECT_EQ(std::filesystem::path(error.file()).filename().string(), file) << error.what();
      EXPECT_EQ(error.line(), line) << error.what();
      EXPECT_EQ(error.field(), field) << error.what();
      const std::string text = error.what();
      EXPECT_NE(text.find(file), std::string::npos);
      EXPECT_NE(text.find(field), std::string::npos);
      EXPECT_NE(text.find("allowed is"), std::string::npos);
    }
  }

  // Row 3 (line 4) is `right` with one field replaced.
  void rightWith(int field, const std::string& value) {
    std::vector<std::string> fields;
    std::string row = kRight;
    row.pop_back();
    std::size_t begin = 0;
    for (;;) {
      const auto comma = row.find(',', begin);
      fields.push_back(row.substr(begin, comma - begin));
      if (comma == std::string::npos) break;
      begin = comma + 1;
    }
    fields[field] = value;
    std::string changed;
    for (std::size_t i = 0; i < fields.size(); ++i) changed += (i ? "," : "") + fields[i];
    write("network.csv", std::string(kHeader) + kTrunk + kLeft + changed + "\n");
  }

  std::filesystem::path folder_;
};

}  // namespace

TEST_F(Refusal, TheUnchangedCaseIsAccepted) {
  const Model model = buildModel(readCase(folder_.string()), 0.01);
  EXPECT_EQ(model.segments.size(), 3u);
  EXPECT_EQ(model.cells, 30);
}

TEST_F(Refusal, EveryNumberOfASegmentHasItsRange) {
  const struct {
    int column;
    const char* field;
    std::vector<std::string> values;
  } cases[] = {
      {4, "length_m", {"0", "-0.1", "nan", "inf", "abc", "", "0,1", "1e999", "0x1", "1e4", "1e-7"}},
      {5, "r_prox_m", {"0", "-1e-3", "NaN", "1e-400", "2", "1e-8"}},
      {6, "r_dist_m", {"0", "-1e-3", "nan", "1e30"}},
      {7, "h_prox_m", {"0", "-1", "nan", "1e-30"}},
      {8, "h_dist_m", {"0", "-1", "nan", "2"}},
      {9, "E_Pa", {"0", "-4e5", "inf", "1e-30", "1e30"}},
      {10, "P_ref_Pa", {"nan", "-inf", "x", "1e30"}},
      {12, "R1_Pa_s_m3", {"-1", "nan", "", "1e30"}},
      {13, "R2_Pa_s_m3", {"-1e9", "inf", "", "1e30"}},
      {14, "C_m3_Pa", {"-1e-12", "nan", "2"}},
      {15, "P_out_Pa", {"nan", "", "-1e30"}},
      {11, "terminal", {"2", "yes", "", "-1"}},
      {2, "node_in", {"-1", "2.5", "x", ""}},
      {3, "node_out", {"2", "99999999999999999999"}},
  };
  for (const auto& c : cases) {
    for (const auto& value : c.values) {
      SCOPED_TRACE(std::string(c.field) + " = " + value);
      rightWith(c.column, value);
      // A comma inside a number makes a field too many.
      if (value == "0,1")
        expectRefused("network.csv", 4, "row");
      else
        expectRefused("network.csv", 4, c.field);
    }
  }
}

TEST_F(Refusal, DuplicateAndUnusableNames) {
  rightWith(0, "2");
  expectRefused("network.csv", 4, "id");
  for (const char* name : {"left", "", "../escape", "a b", ".hidden", "a/b"}) {
    SCOPED_TRACE(name);
    rightWith(1, name);
    expectRefused("network.csv", 4, "name");
  }
}

TEST_F(Refusal, TerminalWithoutResistance) {
  write("network.csv", std::string(kHeader) + kTrunk + kLeft +
                           "3,right,2,4,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,1,0,0,1e-9,0\n");
  expectRefused("network.csv", 4, "R1_Pa_s_m3");
}

TEST_F(Refusal, EndWithoutTerminalParameters) {
  rightWith(11, "0");
  expectRefused("network.csv", 4, "terminal");
}

TEST_F(Refusal, TerminalInTheMiddleOrSharedByTwo) {
  write("network.csv", std::string(kHeader) +
                           "1,trunk,1,2,0.1,0.01,0.01,0.001,0.001,4e5,10000,1,1e8,0,0,0\n" + kLeft + kRight);
  expectRefused("network.csv", 2, "terminal");
  rightWith(3, "3");  // both end in node 3
  expectRefused("network.csv", 3, "terminal");
}

TEST_F(Refusal, LoopWithoutInflow) {
  write("network.csv",
        std::string(kHeader) + kTrunk + "2,back,2,1,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,0,0,0,0,0\n");
  expectRefused("network.csv", 2, "node_in");
}

TEST_F(Refusal, TwoInflowNodes) {
  write("network.csv", std::string(kHeader) + kTrunk + kLeft + kRight +
                           "4,second,7,2,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,0,0,0,0,0\n");
  expectRefused("network.csv", 5, "node_in");
}

TEST_F(Refusal, PartsThatTheInflowDoesNotReach) {
  write("network.csv", std::string(kHeader) + kTrunk + kLeft + kRight +
                           "4,island,7,8,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,1,1e8,0,0,0\n");
  expectRefused("network.csv", 5, "node_in");
  write("network.csv", std::string(kHeader) + kTrunk + kLeft + kRight +
                           "4,ring_a,7,8,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,0,0,0,0,0\n"
                           "5,ring_b,8,7,0.1,0.006,0.006,0.0006,0.0006,4e5,10000,0,0,0,0,0\n");
  expectRefused("network.csv", 5, "node_in");
}

TEST_F(Refusal, SegmentThatReturnsToItsOwnNode) {
  rightWith(3, "2");
  expectRefused("network.csv", 4, "node_out");
}

TEST_F(Refusal, FilesThatAreMissingEmptyOrCut) {
  for (const char* file : {"case.json", "network.csv", "inflow.csv"}) {
    SetUp();
    std::filesystem::remove(folder_ / file);
    expectRefused(file, 0, "file");
  }
  SetUp();
  write("network.csv", "");
  expectRefused("network.csv", 0, "header");
  write("network.csv", kHeader);
  expectRefused("network.csv", 0, "rows");
  write("network.csv", std::string(kHeader) + kTrunk + "2,left,2,3,0.1\n");
  expectRefused("network.csv", 3, "row");
  write("network.csv", "id,name\n1,a\n");
  expectRefused("network.csv", 1, "node_in");
}

TEST_F(Refusal, CaseValues) {
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = kCase;
    text.replace(text.find(from), from.size(), to);
    write("case.json", text);
  };
  with("1060", "0");
  expectRefused("case.json", 2, "rho");
  with("1060", "\"1060\"");
  expectRefused("case.json", 2, "rho");
  with("1060", "1e-9");
  expectRefused("case.json", 2, "rho");
  with("0.004", "-1");
  expectRefused("case.json", 3, "mu");
  with("0.004", "1e9");
  expectRefused("case.json", 3, "mu");
  with(": 2", ": -1");
  expectRefused("case.json", 4, "zeta");
  with(": 2", ": 1e30");
  expectRefused("case.json", 4, "zeta");
  with("1.0,", "0,");
  expectRefused("case.json", 5, "period_s");
  with("linear", "parabolic");
  expectRefused("case.json", 6, "taper");
  with("\"mu\"", "\"nu\"");
  expectRefused("case.json", 0, "mu");
  with("1060,", "1060");
  expectRefused("case.json", 3, "JSON");
  with("\"linear\"",
       "\"linear\", \"wall_thickness_law\": {\"a\": -1, \"b_per_m\": 0, \"c\": 0, \"d_per_m\": 0}");
  expectRefused("network.csv", 2, "r_prox_m");
  with("\"linear\"", "\"linear\",\n \"wall_thickness_law\": {\"a\": 0.2, \"b_per_m\": 0, \"c\": 0}");
  expectRefused("case.json", 0, "d_per_m");
  with("\"mu\": 0.004", "\"mu\": 0.004,\n \"rho\": 1000");
  expectRefused("case.json", 4, "key");
  with("\"linear\"", "\"linear\", \"note\": {\"a\": 1,\n \"\\u0061\": 2}");
  expectRefused("case.json", 7, "key");
  write("case.json", std::string(100000, '['));
  expectRefused("case.json", 1, "JSON");
}

TEST_F(Refusal, InflowValues) {
  const struct {
    const char* text;
    int line;
    const char* field;
  } cases[] = {{"t_s,Q_m3_s\n", 0, "rows"},
               {"t_s,Q_m3_s\n0,0\n0,1\n", 3, "t_s"},
               {"t_s,Q_m3_s\n0,0\n0.5,1\n0.4,0\n", 4, "t_s"},
               {"t_s,Q_m3_s\n-0.1,0\n", 2, "t_s"},
               {"t_s,Q_m3_s\n0,0\n1.5,0\n", 3, "t_s"},
               {"t_s,Q_m3_s\n0,nan\n", 2, "Q_m3_s"},
               {"t_s,Q_m3_s\n0;0\n", 2, "row"},
               {"t_s\n0\n", 1, "Q_m3_s"}};
  for (const auto& c : cases) {
    SCOPED_TRACE(c.text);
    write("inflow.csv", c.text);
    expectRefused("inflow.csv", c.line, c.field);
  }
}

TEST_F(Refusal, CellSizesThatMakeNoSense) {
  expectRefused("network.csv", 0, "dx", 0);
  expectRefused("network.csv", 0, "dx", -1);
  expectRefused("network.csv", 0, "dx", 1e-12);
}

TEST_F(Refusal, WindowsLineEndsBlankLinesAndOtherColumnsAreRead) {
  write("network.csv", std::string("\xEF\xBB\xBF") + "note," + kHeader + "\r\n" + "x," + kTrunk + "\n," +
                           kLeft + "y," + kRight + "\r\n\r\n");
  write("inflow.csv", "t_s,Q_m3_s\r\n 0 , 1e-5\r\n0.5,+2e-5\r\n");
  const Model model = buildModel(readCase(folder_.string()), 0.01);
  EXPECT_EQ(model.segments.size(), 3u);
  // Closed over the period: from 0.5 s back to the first point at 1 s.
  EXPECT_NEAR(model.inflowAt(0.75), 1.5e-5, 1e-18);
  EXPECT_NEAR(model.inflowVolume(2.0), 3e-5, 1e-18);
}

TEST_F(Refusal, AnOptionalKeyThatIsNullIsAsIfItWereNotThere) {
  std::string text = kCase;
  text.insert(text.find("\"taper\""), "\"wall_thickness_law\": null, ");
  write("case.json", text);
  const Network network = readCase(folder_.string());
  EXPECT_FALSE(network.wall_thickness_law.has_value());
  EXPECT_NO_THROW(buildModel(network, 0.01));
}

TEST_F(Refusal, WallThicknessLawTakesThePlaceOfTheColumns) {
  std::string text = kCase;
  text.insert(text.find("\"taper\""),
              "\"wall_thickness_law\": {\"a\": 0.1, \"b_per_m\": 0, \"c\": 0, \"d_per_m\": 0}, ");
  write("case.json", text);
  rightWith(7, "");
  const Model model = buildModel(readCase(folder_.string()), 0.01);
  // h = 0.1 r: beta = (4/3) sqrt(pi) E·0.1·r/(pi r²)
  EXPECT_NEAR(model.segments[2].beta_mid, 4.0 / 3 * 4e5 * 0.1 / (std::sqrt(3.14159265358979) * 0.006), 1e-3);
}
