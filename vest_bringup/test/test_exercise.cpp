#include <gtest/gtest.h>

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <vest_msgs/StateHash.h>
#include <vest_msgs/StepInput.h>

#include "exercise_refusal.h"
#include "play.h"
#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/exercise/outline.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_bringup/ros/moment_bag.h"
#include "vest_bringup/ros/scripted_session.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/scene/stitches.h"
#include "vest_tissue/scene/world_state.h"

// Protects exercises: each passes with its good script and fails with its bad ones for the stated reason; the
// score of a recorded session is the one that it had, to the bit; wrong files are refused by file, line and
// field.

namespace vest::exercise {
namespace {

namespace fs = std::filesystem;

/// A script in the scene of an exercise, with all effects, until the exercise ends or s have passed (0: no
/// limit).
struct Attempt {
  simulation::Play play;
  const Engine& engine;

  Attempt(const Exercise& e, const std::string& script, double seconds = 0)
      : play(e.scene, script), engine(addExercise(e, play.stage)) {
    play.box.arms[static_cast<std::size_t>(tools::Instrument::Endoscope)].optic_angle = e.optic * kDegree;
    const auto report = simulation::rehearse(*play.stage.trainer, play.box, play.trajectory,
                                             simulation::handsOf(play.trajectory), seconds, {},
                                             [this] { return engine.finished(); });
    EXPECT_NE(report.worst, scene::Status::Fault) << script;
  }
};

/// Those that cost least, of different kinds; all of them with VEST_FULL=1. clip_cut_tube is played below.
std::vector<std::string> played() {
  if (std::getenv("VEST_FULL") != nullptr) return ros_shell::exerciseNames();
  return {"coagulate_spot", "divide_fold",  "divide_tube",   "lift_tube", "ligate_stump",
          "look_straight",  "salpingotomy", "stop_bleeding", "seal_tube", "touch_order"};
}

class ExerciseScripts : public ::testing::TestWithParam<std::string> {};

TEST_P(ExerciseScripts, TheGoodOnePassesAndTheBadOnesFailForTheStatedReason) {
  const Exercise e = loadExercise(ros_shell::exerciseFile(GetParam()));
  {
    const Attempt good(e, e.pass_script.file);
    const Result r = good.engine.result();
    EXPECT_TRUE(r.passed) << toText(e, r);
    EXPECT_GE(r.total, 60) << toText(e, r);
    EXPECT_TRUE(r.failed_by.empty()) << toText(e, r);
  }
  for (const Script& script : e.fail_scripts) {
    const Attempt bad(e, script.file);
    const Result r = bad.engine.result();
    EXPECT_FALSE(r.passed) << script.file;
    EXPECT_NE(std::find(r.failed_by.begin(), r.failed_by.end(), script.reason), r.failed_by.end())
        << script.file << " should fail by " << script.reason << "\n"
        << toText(e, r);
  }
}

INSTANTIATE_TEST_SUITE_P(Played, ExerciseScripts, ::testing::ValuesIn(played()),
                         [](const auto& name) { return name.param; });

Exercise shipped() {
  return loadExercise(ros_shell::exerciseFile("clip_cut_tube"));
}

TEST(ExerciseEngine, GoesOnFromASnapshotToTheSameResult) {
  const Exercise e = shipped();
  simulation::Play p(e.scene, e.pass_script.file);
  const Engine& engine = addExercise(e, p.stage);
  std::vector<std::uint8_t> snapshot;
  constexpr std::uint64_t kCut = 1500, kEnd = 3000;
  const auto play = [&](std::uint64_t from) {
    simulation::Script script(p.box, p.trajectory, simulation::handsOf(p.trajectory));
    scene::StepReport report;
    for (std::uint64_t k = 0; k < kEnd; ++k) {
      scene::StepInput input = script.inputAt(1e-3 * static_cast<double>(k));
      if (k < from) continue;  // the script has a memory, too
      input.step = k + 1;
      p.stage.trainer->step(input, report);
      if (k + 1 == kCut && from == 0) p.stage.trainer->save(snapshot);
    }
    return engine.result();
  };
  Result whole = play(0);
  p.stage.trainer->restore(snapshot);
  Result parted = play(kCut);
  EXPECT_EQ(parted.flags, kRestored) << "a result that was not got in one go says so";
  parted.flags = whole.flags;
  EXPECT_EQ(toJson(e, parted), toJson(e, whole));
  EXPECT_GT(whole.items.back().value, 50) << "mm: there was motion to lose";
}

TEST(ExerciseEngine, AnotherOpticThanItsOwnFailsTheExercise) {
  Exercise e = shipped();
  for (const auto& [optic, good] :
       {std::pair(30.0, true), std::pair(30.4, true), std::pair(0.0, false), std::pair(45.0, false)}) {
    e.optic = optic;
    simulation::Play p(e.scene, e.pass_script.file);
    const Engine& engine = addExercise(e, p.stage);
    simulation::Script script(p.box, p.trajectory, simulation::handsOf(p.trajectory));
    scene::StepReport report;
    for (std::uint64_t k = 1; k <= 5; ++k) {
      scene::StepInput input = script.inputAt(1e-3 * static_cast<double>(k));
      input.step = k;
      p.stage.trainer->step(input, report);
    }
    const Result r = engine.result();
    const auto wrong = std::count(r.failed_by.begin(), r.failed_by.end(), "optic");
    EXPECT_EQ(wrong, good ? 0 : 1) << optic;
    EXPECT_EQ(toText(e, r).find("The endoscope had another optic") == std::string::npos, good) << optic;
  }
}

TEST(ExerciseEngine, DoingNothingFastScoresNothing) {
  const Exercise e = shipped();
  const Attempt idle(e, fs::path(e.file).parent_path() / "does_nothing.yaml", 0.3);
  const Result r = idle.engine.result();
  EXPECT_EQ(r.total, 0);
  EXPECT_EQ(r.quality, 0);
}

TEST(ExerciseEngine, WhatATeacherChangedIsAssisted) {
  const Exercise e = shipped();
  simulation::Play p(e.scene, e.pass_script.file);
  const Engine& engine = addExercise(e, p.stage);
  scene::StepInput input;
  scene::StepReport report;
  input.step = 1;
  p.stage.trainer->step(input, report);
  EXPECT_EQ(engine.result().flags, 0U);
  input.step = 2;
  input.edits.push_back({"vessel", "youngs_modulus", 20000});
  p.stage.trainer->step(input, report);
  EXPECT_EQ(engine.result().flags, kAssisted);
}

TEST(ExerciseEngine, AnglesNeedNoLibm) {
  for (const double angle : {0.0, 0.5, 5.0, 30.0, 89.0, 90.0, 135.0, 180.0})
    EXPECT_NEAR(degrees(std::cos(angle * M_PI / 180)), angle, 2e-6);
}

TEST(ExerciseConditions, BecomeTrueAtTheStepThatTheySay) {
  const std::string late = "{of: time_s, above: 0.0505}", early = "{of: time_s, below: 0.0205}";
  // Each condition, and the step at which it is true for the first time; 0: never.
  const std::vector<std::pair<std::string, std::uint64_t>> course{
      {late, 51},
      {"{any: [" + late + ", " + early + "]}", 1},
      {"{all: [" + late + ", " + early + "]}", 0},
      {"{not: " + early + "}", 21},
      {"{for_s: 0.0095, that: " + late + "}", 60},
      {"{within_s: 0.05, that: " + late + "}", 0},
      {"{within_s: 0.06, that: " + late + "}", 51},
      {"{before: [" + early + ", " + late + "]}", 1},
      {"{before: [" + late + ", " + early + "]}", 0},
      {"{event: cut, object: vessel}", 0},
  };
  const Exercise base = shipped();
  std::string text = files::read(base.file, 1U << 20U), gates = "gates:\n";
  for (std::size_t i = 0; i < course.size(); ++i)
    gates += "  - {name: asked" + std::to_string(i) + ", text: Asked., never: " + course[i].first + "}\n";
  const std::size_t at = text.find("gates:");
  text.replace(at, text.find("errors:") - at, gates);
  text.replace(text.find("reason: clipped_before_cut"), 26, "reason: cut");
  const Exercise e = parseExercise(base.file, text);
  simulation::Play p(e.scene, e.pass_script.file);
  const Engine& engine = addExercise(e, p.stage);
  scene::StepReport report;
  for (std::uint64_t k = 1; k <= 80; ++k) {
    scene::StepInput input;
    input.step = k;
    p.stage.trainer->step(input, report);
  }
  std::vector<std::uint64_t> first(course.size());
  for (const Moment& m : engine.result().moments)
    if (m.kind == Moment::Kind::GateBroken) first[m.index] = m.step;
  for (std::size_t i = 0; i < course.size(); ++i) EXPECT_EQ(first[i], course[i].second) << course[i].first;
}

TEST(ExerciseNumbers, ACutIsMeasuredAgainstTheMarksCircle) {
  const Eigen::Vector3d centre(0.002, 0.050, 0.059);
  constexpr double kRadius = 0.004;  // m
  Exercise e = shipped();
  e.scene = "cut_strip";
  e.tools = {};
  Mark circle, way;
  circle.name = "circle", circle.at = centre, circle.object = "strip", circle.radius = kRadius;
  way = circle;
  way.name = "way", way.at = Eigen::Vector3d(0.006, 0.0475, 0.059), way.radius = 0.003;
  e.marks = {circle, way};
  Phase phase;
  phase.name = "cut", phase.end.kind = Condition::Kind::Number, phase.end.low = 100;
  e.phases = {phase};
  e.gates.clear(), e.errors.clear(), e.items.clear();
  for (const auto& [metric, marks] :
       {std::pair(Metric::CutRound, std::vector<std::string>{"circle"}),
        std::pair(Metric::CutRoundRms, std::vector<std::string>{"circle"}),
        std::pair(Metric::CutRound, std::vector<std::string>{"circle", "way"})}) {
    Item item;
    item.number.metric = metric, item.number.object = "strip", item.number.marks = marks;
    item.pass = 1;
    e.items.push_back(item);
  }
  simulation::Play p("cut_strip", false);
  const Engine& engine = addExercise(e, p.stage);
  p.run({}, 8.5);
  // The same by many points along the blade's way; the strip lies level.
  double most = 0, squares = 0, length = 0, beyond = 0;
  const auto& tracks = p.world().state().objects[0].cut.tracks;
  ASSERT_GT(tracks.size(), 5U);
  for (const auto& track : tracks) {
    const Eigen::Vector3d a(track.from[0], track.from[1], track.from[2]),
        b(track.to[0], track.to[1], track.to[2]);
    constexpr int kParts = 200;
    for (int i = 0; i < kParts; ++i) {
      const Eigen::Vector3d at = a + (i + 0.5) / kParts * (b - a), off = at - centre;
      const double d = std::abs(std::hypot(off.x(), off.y()) - kRadius), l = (b - a).norm() / kParts;
      most = std::max(most, d), squares += l * d * d, length += l;
      if ((0.5 * (a + b) - way.at).norm() >= way.radius) beyond = std::max(beyond, d);
    }
  }
  const auto items = engine.result().items;
  EXPECT_NEAR(items[0].value, 1e3 * most, 0.1);
  EXPECT_NEAR(items[1].value, 1e3 * std::sqrt(squares / length), 0.05);
  EXPECT_NEAR(items[2].value, 1e3 * beyond, 0.1);
  EXPECT_GT(items[0].value, 2.0) << "a straight cut is no circle";
}

TEST(ExerciseNumbers, AStitchIsMeasuredByItsBitesAndItsThread) {
  // Where the needle went in and came out was seen beforehand; the marks say it to the millimetre.
  simulation::Play seen("suture_pad", false);
  seen.run({}, 16.0);
  scene::Bites bites;
  scene::findBites(seen.world(), bites);
  ASSERT_EQ(bites.count, 2U);
  EXPECT_FALSE(bites.mouths[0].exit);
  EXPECT_TRUE(bites.mouths[1].exit);
  const double wide = (bites.mouths[1].rest - bites.mouths[0].rest).norm();
  EXPECT_GT(wide, 0.008) << "m";
  EXPECT_LT(wide, 0.024) << "m: half a circle of 36 mm is 23 mm wide";

  Exercise e = shipped();
  e.scene = "suture_pad";
  e.tools = {};
  Mark entry, exit;
  entry.name = "entry", entry.at = bites.mouths[0].rest + Eigen::Vector3d(0, 0.001, 0), entry.object = "pad";
  exit.name = "exit", exit.at = bites.mouths[1].rest, exit.object = "pad";
  e.marks = {entry, exit};
  Phase phase;
  phase.name = "stitch", phase.end.kind = Condition::Kind::Event, phase.end.count = 2;
  phase.end.event = scene::EventKind::Grasped, phase.end.object = "thread";
  e.phases = {phase};
  e.gates.clear(), e.errors.clear(), e.items.clear();
  const auto item = [&e](Metric metric, const std::string& object, const std::vector<std::string>& marks) {
    Item i;
    i.number.metric = metric, i.number.object = object, i.number.marks = marks;
    i.pass = 1;
    e.items.push_back(i);
  };
  item(Metric::Bites, "pad", {}), item(Metric::Bites, "tray", {});
  item(Metric::BiteOff, "pad", {"entry", "exit"}), item(Metric::BiteOff, "pad", {"entry"});
  item(Metric::Apart, "", {"entry", "exit"});
  item(Metric::KnotDeterminant, "", {}), item(Metric::Tail, "", {}), item(Metric::KnotOff, "", {});
  item(Metric::ThreadTensionPeak, "", {});
  simulation::Play p("suture_pad", false);
  const Engine& engine = addExercise(e, p.stage);
  p.run({}, 30.0);
  EXPECT_TRUE(engine.finished()) << "by an event of the thread";
  const auto items = engine.result().items;
  EXPECT_EQ(items[0].value, 1);
  EXPECT_EQ(items[1].value, 0);
  EXPECT_NEAR(items[2].value, 1.0, 0.1);
  EXPECT_NEAR(items[3].value, 1e3 * (exit.at - entry.at).norm(), 0.1);
  EXPECT_NEAR(items[4].value, 1e3 * (exit.at - entry.at).norm(), 2.0) << "the pad has given way a little";
  EXPECT_EQ(items[5].value, 1) << "no knot";
  EXPECT_EQ(items[6].value, 0);
  EXPECT_EQ(items[7].value, 0);
  EXPECT_GT(items[8].value, 0.02) << "N";
}

TEST(ExerciseNumbers, ThePatientIsReadInTheUnitsOfTheWard) {
  Exercise e = shipped();
  e.scene = "arterial_bleeding";
  e.tools = {}, e.marks.clear(), e.gates.clear(), e.errors.clear(), e.items.clear();
  Phase phase;
  phase.name = "bleeds", phase.end.kind = Condition::Kind::Event, phase.end.count = 9;
  phase.end.event = scene::EventKind::Clipped, phase.end.object = "artery";
  e.phases = {phase};
  const Metric all[] = {Metric::HeartRate,   Metric::Systolic, Metric::MeanPressure, Metric::Given,
                        Metric::Haematocrit, Metric::Oxygen,   Metric::Vasopressor,  Metric::Arrested,
                        Metric::GasPressure, Metric::Fog};
  for (const Metric metric : all) {
    Item i;
    i.number.metric = metric;
    i.pass = 1;
    e.items.push_back(i);
  }
  simulation::Play p("arterial_bleeding", true);
  const Engine& engine = addExercise(e, p.stage);
  p.run({}, 2.0);
  const auto items = engine.result().items;
  const haemodynamics::CirculationState& c = p.stage.blood->circulation();
  EXPECT_NEAR(items[0].value, 60 * c.heart_rate, 1e-9);
  EXPECT_NEAR(items[0].value, 70, 5) << "1/min";
  EXPECT_NEAR(items[1].value, 119, 8) << "mmHg";
  EXPECT_NEAR(items[2].value, c.mean / 133.322, 1e-9);
  EXPECT_EQ(items[3].value, 0);
  EXPECT_NEAR(items[4].value, 41, 0.1) << "per cent";
  EXPECT_NEAR(items[5].value, 98, 0.1);
  EXPECT_EQ(items[6].value, 0);
  EXPECT_EQ(items[7].value, 0);
  EXPECT_NEAR(items[8].value, 12, 1) << "mmHg";
  EXPECT_GE(items[9].value, 0);
}

TEST(ExerciseFile, WrongOnesAreRefusedByFileLineAndField) {
  const std::vector<std::array<std::string, 3>> wrong{
      {"limit_s: 120", "limit_s: .nan", ":7: limit_s: .nan"},
      {"limit_s: 120", "limit: 120", "limit_s: missing"},
      {"limit_s: 120", "limit_s: 120\nspeed: 2", "speed: "},
      {"proficient_s: 20", "proficient_s: 500", "proficient_s: 500"},
      {"better: lower", "better: smaller", "items[0].better: smaller"},
      {"of: clip_off_mm", "of: clip_off_cm", "items[0].of: clip_off_cm"},
      {"mark: [near, far]", "mark: [near, nowhere]", "must be the name of one of the marks"},
      {"proficient: 1.5, pass: 3", "proficient: 3, pass: 1.5", "must be worse than proficient"},
      {"event: clipped,", "event: stapled,", "phases[0].end.event: stapled"},
      {"at_least: 2}", "at_least: -2}", "at_least: -2"},
      {"object: vessel, at_least", "object: aorta, at_least", "no object is called 'aorta'"},
      {"object: vessel, at_least", "role: nerve, at_least", "no object has the role 'nerve'"},
      {"tools: {right: [clip_applier", "tools: {right: [chainsaw", "tools.right[0]: chainsaw"},
      {"name: cut\n", "name: clip\n", "stands twice"},
      {"name: clip_square", "name: clip_place", "items[1].name: clip_place: stands twice"},
      {"name: clip_square", "name: total", "items[1].name: total: is a figure of every attempt"},
      {"above: 2}", "above: 2, below: 1}", "errors[1].when.below: 1"},
      {"reason: clip}", "reason: weather}", "must name a phase, a gate or an item"},
      {"pass: pass.yaml", "pass: ../../pass.yaml", "scripts.pass: ../../pass.yaml"},
      {"scene: clip_tube", "scene: clip tube", "scene: clip tube"},
      {"title: Clip", "title: &a Clip", "anchor"},
      {"title: Clip and cut a tube", "title: \"\\e[2J\"", "title: \\x1b[2J: must have no control characters"},
      {"scene: clip_tube", "scene: ..", "scene: ..: must be"},
  };
  for (const auto& [from, to, said] : wrong) {
    const std::string what = refusal(from, to);
    EXPECT_NE(what.find(said), std::string::npos) << to << ": " << what;
  }
  std::string deep = "{of: time_s, above: 1}";
  for (int i = 0; i < 12; ++i) deep = "{not: " + deep + "}";
  EXPECT_NE(refusal("never: {before", "never: " + deep + "\n    #{").find("at most 8 deep"),
            std::string::npos);
}

TEST(ExerciseMarks, AreLinesRoundTheTubeAndCirclesOnASurface) {
  for (const auto& [name, lines] : {std::pair("clip_cut_tube", 3U), std::pair("coagulate_spot", 1U)}) {
    const Exercise e = loadExercise(ros_shell::exerciseFile(name));
    const simulation::Play p(e.scene, e.pass_script.file, false);
    const auto outlines = outlinesOf(e, p.stage.trainer->world());
    ASSERT_EQ(outlines.size(), lines);
    for (std::size_t i = 0; i < lines; ++i) {
      EXPECT_EQ(outlines[i].mark, e.marks[i].name);
      Eigen::Vector3d middle = Eigen::Vector3d::Zero();
      for (const auto& point : outlines[i].line)
        middle += point / static_cast<double>(outlines[i].line.size());
      EXPECT_LT((middle - e.marks[i].at).norm(), 0.002) << name << ": " << e.marks[i].name;
      for (const auto& point : outlines[i].line) EXPECT_GT((point - middle).norm(), 0.0015);
    }
  }
}

TEST(ExercisePage, TellsEachNumberAsTheCodeHasIt) {
  const std::string page =
      files::read(ros::package::getPath("vest_bringup") + "/../docs/exercises.md", 1U << 20U);
  for (const MetricInfo& m : kMetrics) {
    const std::string begin = "| " + std::string(m.name) + " | ",
                      end = " | " + std::string(m.meaning) + " |\n";
    const std::size_t row = page.find(begin);
    ASSERT_NE(row, std::string::npos) << m.name;
    EXPECT_EQ(page.find(end, row), page.find('\n', row) + 1 - end.size()) << m.name;
    EXPECT_EQ(&infoOf(m.metric), &m) << "the table is in the order of Metric";
  }
}

std::string said(const std::string& command, int& code) {
  const std::string out = fs::temp_directory_path() / ("vest_exercise_" + std::to_string(getpid()));
  const int status = std::system((command + " > " + out + " 2>&1").c_str());
  code = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  std::ifstream in(out);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  fs::remove(out);
  return text;
}

/// A session that took so many times as long.
void stretch(const std::string& from, const std::string& to, double times) {
  rosbag::Bag in(from), out(to, rosbag::bagmode::Write);
  const auto later = [&](const ros::Time& t) { return ros::Time(1 + times * (t.toSec() - 1)); };
  for (const rosbag::MessageInstance& m : rosbag::View(in)) {
    if (const auto step = m.instantiate<vest_msgs::StepInput>()) {
      step->header.stamp = later(step->header.stamp);
      out.write(m.getTopic(), step->header.stamp, *step);
    } else if (const auto hash = m.instantiate<vest_msgs::StateHash>()) {
      hash->header.stamp = later(hash->header.stamp);
      out.write(m.getTopic(), hash->header.stamp, *hash);
    } else {
      out.write(m.getTopic(), m.getTime(), m);
    }
  }
}

TEST(VestScore, ARecordingThatBeginsAtASnapshotGoesOnWithItsExercise) {
  std::string folder = fs::temp_directory_path() / "vest_score_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const Exercise e = shipped();
  {
    simulation::Play p(e.scene, e.pass_script.file);
    const Engine& engine = addExercise(e, p.stage);
    scene::SceneFiles files;
    scene::loadScene(ros::package::getPath("vest_tissue") + "/scenes/" + e.scene + "/" + e.scene + ".yaml",
                     files);
    const auto play = [&](double seconds, const simulation::Watch& watch) {
      simulation::rehearse(*p.stage.trainer, p.box, p.trajectory, simulation::handsOf(p.trajectory), seconds,
                           watch);
    };
    play(0.1, {});
    std::vector<std::uint8_t> snapshot;
    p.stage.trainer->save(snapshot);
    fs::create_directories(folder + "/snapshots");
    std::ofstream(folder + "/snapshots/start.snapshot", std::ios::binary)
        .write(reinterpret_cast<const char*>(snapshot.data()), static_cast<std::streamsize>(snapshot.size()));
    session::ScriptedSession session(folder, files, p.stage.trainer->world(),
                                     simulation::sessionEffects(true, p.trajectory), "pelvis");
    session.writeExercise(files::read(e.file, 1U << 20U));
    play(0.3, [&](double, const scene::StepInput& input, const scene::StepReport& report) {
      session.write(p.stage.trainer->world(), input, report);
    });
    session.writeResult(toJson(e, engine.result()));
  }
  int code = 0;
  const std::string again = said(VEST_RESIMULATE " --effects " + folder, code);
  EXPECT_EQ(code, 0) << again;
  EXPECT_EQ(again.rfind("300 steps, ", 0), 0U) << again;
  const std::string scored = said(VEST_SCORE " " + folder, code);
  EXPECT_EQ(code, 0) << scored;
  fs::remove_all(folder);
}

class ExerciseRecordings : public ::testing::TestWithParam<std::string> {};

TEST_P(ExerciseRecordings, ScoreToTheBitsOfTheSession) {
  std::string folder = fs::temp_directory_path() / "vest_score_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  int code = 0;
  const std::string live =
      said(VEST_EXERCISE " run " + GetParam() + " --json --output " + folder + "/session", code);
  EXPECT_EQ(code, 0) << live;
  const std::string scored = said(VEST_SCORE " --json " + folder + "/session", code);
  EXPECT_EQ(code, 0) << scored;
  EXPECT_EQ(scored, live);
  fs::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Played, ExerciseRecordings, ::testing::ValuesIn(played()),
                         [](const auto& name) { return name.param; });

TEST(VestExercise, AFullDiskIsOneMessageAndLeavesNoHalfSession) {
  std::string folder = fs::temp_directory_path() / "vest_score_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string bag = folder + "/session/session.bag",
                    run = VEST_EXERCISE " run clip_cut_tube --output " + folder + "/session";
  int code = 0;
  for (const char* room : {"4", "600", "1300"}) {  // kB: full at once, within the steps, near the end
    const std::string full =
        said("(trap '' XFSZ; bash -c 'ulimit -f " + std::string(room) + "; " + run + "')", code);
    EXPECT_EQ(code, 2) << full;
    EXPECT_EQ(full, "vest_exercise: " + bag + ": cannot be written (is the disk full?)\n");
    EXPECT_FALSE(fs::exists(bag)) << room;
  }
  const std::string nowhere = said(VEST_EXERCISE " run clip_cut_tube --output /proc/nowhere", code);
  EXPECT_EQ(nowhere, "vest_exercise: /proc/nowhere/session.bag: cannot be written\n");
  const auto moments = [&folder] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit none{4096, 4096};
    setrlimit(RLIMIT_FSIZE, &none);
    try {
      ros_shell::MomentBag bag(folder + "/moments.bag");
    } catch (const std::invalid_argument&) {
      _exit(3);
    }
    _exit(0);
  };
  EXPECT_EXIT(moments(), ::testing::ExitedWithCode(3), "");
  fs::remove_all(folder);
}

TEST(VestScore, ScoresARecordedSessionToTheSameBits) {
  std::string folder = fs::temp_directory_path() / "vest_score_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  int code = 0;
  const std::string live =
      said(VEST_EXERCISE " run clip_cut_tube --json --output " + folder + "/session", code);
  ASSERT_EQ(code, 0) << live;
  const std::string scored = said(VEST_SCORE " --json " + folder + "/session", code);
  EXPECT_EQ(code, 0) << scored;
  EXPECT_EQ(scored, live);
  EXPECT_NE(live.find("\"passed\": true"), std::string::npos) << live;
  std::ofstream(folder + "/session/report.html") << "the report before";
  // What cannot be written leaves what was there.
  fs::create_directories(folder + "/session/report.html.new/in_the_way");
  const std::string full = said("(" VEST_SCORE " --report " + folder + "/session > /dev/null)", code);
  EXPECT_EQ(code, 2) << full;
  EXPECT_NE(full.find("report.html: cannot be written (is the disk full?)"), std::string::npos) << full;
  EXPECT_EQ(std::count(full.begin(), full.end(), '\n'), 1) << full;
  EXPECT_EQ(files::read(folder + "/session/report.html", 100), "the report before");
  fs::remove_all(folder + "/session/report.html.new");
  // A link in a stranger's folder, in the place of a file of the tool's own: nothing goes through it.
  std::ofstream(folder + "/mine") << "a file of mine";
  fs::create_symlink(folder + "/mine", folder + "/session/report.html.new");
  said("(" VEST_SCORE " --pdf " + folder + "/session > /dev/null)", code);
  EXPECT_EQ(code, 0);
  EXPECT_EQ(files::read(folder + "/mine", 100), "a file of mine");
  const bool pdf = std::system("command -v weasyprint > /dev/null") == 0;  // ./test installs it
  EXPECT_EQ(fs::exists(folder + "/session/report.pdf"), pdf);
  if (pdf) {
    EXPECT_EQ(files::read(folder + "/session/report.pdf", 10000000).substr(0, 5), "%PDF-");
  }
  EXPECT_GT(fs::file_size(folder + "/session/report.html"), 1000u);
  EXPECT_FALSE(fs::exists(folder + "/session/report.html.new"));
  fs::create_directory(folder + "/slow");
  stretch(folder + "/session/session.bag", folder + "/slow/session.bag", 1.2);
  const std::string slow = said(VEST_SCORE " --json " + folder + "/slow", code);
  EXPECT_EQ(code, 0) << slow;
  EXPECT_NE(slow.find("\"practice\""), std::string::npos) << "1.2 s of wall time for one of simulation";
  EXPECT_EQ(live.find("\"practice\""), std::string::npos);
  fs::resize_file(folder + "/session/session.bag", fs::file_size(folder + "/session/session.bag") / 2);
  const std::string cut = said(VEST_SCORE " " + folder + "/session", code);
  EXPECT_EQ(code, 2) << cut;
  EXPECT_EQ(std::count(cut.begin(), cut.end(), '\n'), 1) << cut;
  fs::remove_all(folder);
}
}  // namespace
}  // namespace vest::exercise
