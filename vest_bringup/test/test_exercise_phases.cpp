#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "exercise_refusal.h"
#include "play.h"
#include "vest_bringup/exercise/engine.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_bringup/session/motion_metrics.h"
#include "vest_instruments/files/read.h"

// Protects phases that wait for a start of their own, and figures of motion among the items and gates: they
// are those of vest_metrics, the same live, from another thread and from a snapshot.

namespace vest::exercise {
namespace {

constexpr auto kLeft = static_cast<std::size_t>(tools::Instrument::Left),
               kRight = static_cast<std::size_t>(tools::Instrument::Right),
               kCamera = static_cast<std::size_t>(tools::Instrument::Endoscope);

/// An exercise without anything in the scene of clip_cut_tube.
Exercise bare() {
  Exercise e = loadExercise(ros_shell::exerciseFile("clip_cut_tube"));
  e.tools = {}, e.marks.clear(), e.phases.clear(), e.gates.clear(), e.errors.clear(), e.items.clear();
  e.least = 0, e.optic = 0;
  return e;
}

/// Holds while the tip of a tool is higher (or lower) than so many mm.
Condition height(std::size_t tool, double low, double high = 1e9) {
  Condition c;
  c.kind = Condition::Kind::Number;
  c.number.metric = Metric::TipHeight, c.number.tool = static_cast<int>(tool);
  c.low = low, c.high = high;
  return c;
}

Phase phaseOf(const std::string& name, const Condition& end) {
  Phase p;
  p.name = name, p.instruction = "Do " + name + ".", p.end = end;
  return p;
}

/// Steps an exercise with tools well above the tissue.
struct Stepped {
  simulation::Play play;
  Engine& engine;
  std::shared_ptr<Progress> progress;
  std::uint64_t step = 0;
  scene::StepReport report;

  explicit Stepped(const Exercise& e)
      : play(e.scene, e.pass_script.file), engine(addExercise(e, play.stage)), progress(engine.progress()) {}
  /// @param place called as place(t, input)
  template <class Place>
  void run(std::uint64_t steps, Place&& place) {
    for (const std::uint64_t end = step + steps; step < end;) {
      scene::StepInput input;
      input.step = ++step;
      place(1e-3 * static_cast<double>(step), input);
      play.stage.trainer->step(input, report);
    }
  }
};

void raise(scene::StepInput& input, std::size_t tool, double height) {
  input.tools[tool].present = true;
  input.tools[tool].tool = tools::ToolKind::Grasper;
  input.tools[tool].position = {tool == kLeft ? -0.05 : 0.05, 0.05, height};
}

std::vector<std::uint64_t> stepsOf(const Result& r, Moment::Kind kind) {
  std::vector<std::uint64_t> steps;
  for (const Moment& m : r.moments)
    if (m.kind == kind) steps.push_back(m.step);
  return steps;
}

TEST(ExercisePhases, WaitForTheirStartAndTheClockForTheFirst) {
  Exercise e = bare();
  e.phases = {phaseOf("lower", height(kRight, 0, 110)), phaseOf("raise", height(kRight, 125))};
  e.phases[0].start = height(kRight, 115);
  e.phases[0].wait = "Take the grasper.";
  e.phases[0].hint = "Lower it.", e.phases[0].hint_after = 0.0045;
  e.phases[1].start = height(kLeft, 115);
  Stepped s(e);
  // Low, so that the first one could end; but it has not begun.
  s.run(60, [](double, scene::StepInput& input) { raise(input, kRight, 0.105); });
  EXPECT_TRUE(stepsOf(s.engine.result(), Moment::Kind::PhaseBegun).empty());
  EXPECT_EQ(s.engine.result().time, 0) << "the clock has not begun";
  ASSERT_TRUE(s.progress->update());
  EXPECT_EQ(s.progress->standing().instruction, "Take the grasper.");
  EXPECT_EQ(s.progress->standing().phase, "lower");
  s.run(60, [](double, scene::StepInput& input) { raise(input, kRight, 0.120); });
  EXPECT_EQ(stepsOf(s.engine.result(), Moment::Kind::PhaseBegun), (std::vector<std::uint64_t>{61}));
  EXPECT_NEAR(s.engine.result().time, 0.059, 1e-9) << "since the first phase began";
  EXPECT_EQ(stepsOf(s.engine.result(), Moment::Kind::Hint), (std::vector<std::uint64_t>{66}));
  s.run(10, [](double, scene::StepInput& input) { raise(input, kRight, 0.105); });
  EXPECT_EQ(stepsOf(s.engine.result(), Moment::Kind::PhaseEnded), (std::vector<std::uint64_t>{121}));
  ASSERT_TRUE(s.progress->update());
  EXPECT_EQ(s.progress->standing().instruction, "Do raise.") << "no words for waiting: those of the phase";
  // High enough for the end of the second one, which waits for the left hand.
  s.run(20, [](double, scene::StepInput& input) { raise(input, kRight, 0.130); });
  EXPECT_FALSE(s.engine.finished());
  s.run(20, [](double, scene::StepInput& input) { raise(input, kRight, 0.130), raise(input, kLeft, 0.120); });
  EXPECT_TRUE(s.engine.finished());
  EXPECT_EQ(stepsOf(s.engine.result(), Moment::Kind::PhaseBegun), (std::vector<std::uint64_t>{61, 151}));
  EXPECT_EQ(stepsOf(s.engine.result(), Moment::Kind::PhaseEnded), (std::vector<std::uint64_t>{121, 152}));
}

TEST(ExercisePhases, OneThatIsLeftOutWaitsBesideTheRequiredOne) {
  Exercise e = bare();
  e.phases = {phaseOf("aside", height(kLeft, 125)), phaseOf("lower", height(kRight, 0, 110))};
  e.phases[0].required = false, e.phases[0].start = height(kLeft, 115);
  for (const bool done : {true, false}) {
    Stepped s(e);
    const auto said = [&s] {
      return s.progress->update() ? s.progress->standing().instruction : "nothing new";
    };
    s.run(5, [](double, scene::StepInput& input) { raise(input, kRight, 0.120); });
    EXPECT_EQ(said(), "Do lower.") << "nothing is said of what waits beside it";
    if (done) {
      s.run(1,
            [](double, scene::StepInput& input) { raise(input, kRight, 0.120), raise(input, kLeft, 0.120); });
      EXPECT_EQ(said(), "Do aside.");
      s.run(1,
            [](double, scene::StepInput& input) { raise(input, kRight, 0.120), raise(input, kLeft, 0.130); });
      EXPECT_EQ(said(), "Do lower.");
    }
    s.run(1, [](double, scene::StepInput& input) { raise(input, kRight, 0.105); });
    const Result r = s.engine.result();
    EXPECT_TRUE(r.finished);
    EXPECT_TRUE(r.failed_by.empty());
    EXPECT_EQ(stepsOf(r, Moment::Kind::PhaseEnded).size(), done ? 2U : 1U);
    const auto begun = stepsOf(r, Moment::Kind::PhaseBegun);
    EXPECT_EQ(begun.size(), done ? 2U : 1U) << "the required one goes on, it does not begin anew";
    EXPECT_EQ(begun.front(), 1U) << "what has no start begins at once";
  }
}

TEST(ExercisePhases, WhatNeverStartsEndsAtTheLimitAndScoresNothing) {
  Exercise e = bare();
  e.limit = 0.1, e.proficient = 0.01;
  e.phases = {phaseOf("lower", height(kRight, 0, 110))};
  e.phases[0].start = height(kRight, 115);
  Stepped s(e);
  s.run(105, [](double, scene::StepInput& input) { raise(input, kRight, 0.105); });
  const Result r = s.engine.result();
  EXPECT_TRUE(r.finished);
  EXPECT_EQ(r.total, 0);
  EXPECT_EQ(r.failed_by, (std::vector<std::string>{"lower"}));
}

/// A smooth reach there, with a turn of the tool; a second way; the camera goes along.
void reach(double t, scene::StepInput& input) {
  const auto smooth = [](double s) {
    s = std::clamp(s, 0.0, 1.0);
    return s * s * s * (10 + s * (6 * s - 15));
  };
  raise(input, kRight, 0.12), raise(input, kLeft, 0.12), raise(input, kCamera, 0.15);
  const double there = smooth(t / 0.8), back = smooth((t - 0.9) / 0.7), shake = 2e-4 * std::sin(50 * t);
  input.tools[kRight].position += Eigen::Vector3d(0.03 * there - 0.01 * back, 0.01 * back + shake, 0);
  input.tools[kRight].orientation = Eigen::AngleAxisd(0.6 * there, Eigen::Vector3d::UnitX());
  input.tools[kLeft].position.z() += 0.02 * there - 0.015 * back;
  input.tools[kCamera].position.x() += 0.02 * back;
  input.tools[kCamera].tool = tools::ToolKind::Endoscope;
}

constexpr std::array<Metric, 11> kOfATool{Metric::FilteredPath, Metric::AngularPath, Metric::DepthPath,
                                          Metric::DepthTurns,   Metric::Economy,     Metric::MeanSpeed,
                                          Metric::PeakSpeed,    Metric::Rest,        Metric::RmsJerk,
                                          Metric::Sparc,        Metric::Ldlj};

Exercise ofFigures() {
  Exercise e = bare();
  e.limit = 1.9905, e.proficient = 1;  // its last step is 1991
  Condition late;
  late.kind = Condition::Kind::Number, late.number.metric = Metric::Time, late.low = 0.7995;
  Condition never = late;
  never.low = 100;
  e.phases = {phaseOf("there", late), phaseOf("back", never)};
  e.phases[1].required = false;
  e.phases.push_back(phaseOf("end", never));
  const auto item = [&e](Metric metric, std::size_t tool, const std::string& phase) {
    Item i;
    i.name = "i" + std::to_string(e.items.size());
    i.number.metric = metric, i.number.tool = static_cast<int>(tool), i.phase = phase;
    i.pass = 1;
    e.items.push_back(i);
  };
  for (const Metric m : kOfATool) item(m, kRight, "");
  for (const Metric m : kOfATool) item(m, kRight, "there");
  item(Metric::AngularPath, kCamera, ""), item(Metric::FilteredPath, kCamera, "");
  item(Metric::Bimanual, 0, ""), item(Metric::PathRatio, 0, "");
  return e;
}

TEST(ExerciseFigures, AreThoseOfVestMetricsToTheBit) {
  const Exercise e = ofFigures();
  Stepped s(e);
  std::array<session::MotionTable, 3> tables;  // right, right until 0.8 s, camera
  session::MotionTable both;
  both.tools.resize(2);
  double now = 0;
  s.run(2100, [&](double t, scene::StepInput& input) {
    reach(t, input);
    now += input.dt;
    if (input.step % 20 != 1 || input.step > 1991) return;
    const auto keep = [&](session::MotionTable& to, std::size_t tool) {
      to.tools.resize(1), to.time.push_back(now);
      to.tools[0].position.push_back(input.tools[tool].position);
      to.tools[0].orientation.push_back(input.tools[tool].orientation);
    };
    keep(tables[0], kRight), keep(tables[2], kCamera);
    if (input.step <= 800) keep(tables[1], kRight);
    both.time.push_back(now);
    both.tools[0].position.push_back(input.tools[kLeft].position);
    both.tools[1].position.push_back(input.tools[kRight].position);
  });
  const Result r = s.engine.result();
  ASSERT_TRUE(r.finished);
  for (const std::size_t part : {0U, 1U}) {
    const auto f = session::motion::figuresOf(tables[part]).tools.front();
    const std::size_t first = part * kOfATool.size();
    const auto& tip = tables[part].tools[0].position;
    const std::size_t goal = part == 0 ? 40 : 39;  // of step 801; and of the last row before
    const double expected[] = {1e3 * f.filtered_path.value(),
                               f.angular_path.value() * (1 / kDegree),
                               1e3 * f.depth_path.value(),
                               static_cast<double>(f.depth_turns.value()),
                               100 * std::min(1.0, (tip[goal] - tip[0]).norm() / f.path),
                               1e3 * f.mean_speed,
                               1e3 * f.filtered_peak_speed.value(),
                               100 * f.filtered_idle_fraction.value(),
                               f.filtered_rms_jerk.value(),
                               f.sparc.value(),
                               f.ldlj.value()};
    for (std::size_t i = 0; i < kOfATool.size(); ++i)
      EXPECT_EQ(r.items[first + i].value, expected[i]) << part << " " << infoOf(kOfATool[i]).name;
  }
  const std::size_t rest = 2 * kOfATool.size();
  const auto camera = session::motion::figuresOf(tables[2]).tools.front();
  EXPECT_EQ(r.items[rest].value, camera.angular_path.value() * (1 / kDegree));
  EXPECT_EQ(r.items[rest + 1].value, 1e3 * camera.filtered_path.value());
  const auto hands = session::motion::figuresOf(both);
  EXPECT_EQ(r.items[rest + 2].value, 100 * hands.bimanual.value());
  EXPECT_EQ(r.items[rest + 3].value, 100 * hands.path_ratio.value());
}

TEST(ExerciseFigures, AreTheSameForAnotherThreadAndFromASnapshot) {
  const Exercise e = ofFigures();
  Stepped whole(e);
  std::vector<std::uint8_t> snapshot;
  for (int part = 0; part < 42; ++part) {
    whole.run(50, reach);
    if (part == 19) whole.play.stage.trainer->save(snapshot);
    if (part % 3 == 0) whole.progress->update();  // each slot of the buffer misses some
  }
  ASSERT_TRUE(whole.progress->update() || whole.progress->result().finished);
  const Result r = whole.engine.result();
  EXPECT_EQ(toJson(e, whole.progress->result()), toJson(e, r));
  EXPECT_LT(r.items.back().value, 100) << "there is motion to lose";
  Stepped parted(e);
  parted.run(500, reach);
  parted.play.stage.trainer->restore(snapshot);
  parted.step = 1000;
  parted.run(1100, reach);
  Result again = parted.engine.result();
  EXPECT_EQ(again.flags, kRestored);
  again.flags = r.flags;
  EXPECT_EQ(toJson(e, again), toJson(e, r));
  parted.progress->update();
  EXPECT_EQ(parted.progress->result().items.front().value, r.items.front().value);
}

TEST(ExerciseFigures, WhatIsNotKnownPassesNothing) {
  Exercise e = bare();
  e.limit = 0.5, e.proficient = 0.1;
  e.phases = {phaseOf("lower", height(kRight, 0, 110))};
  Item item;
  item.name = "smooth", item.number.metric = Metric::Sparc, item.number.tool = static_cast<int>(kLeft);
  item.higher_is_better = true, item.pass = -100, item.proficient = -1;
  e.items = {item};
  Stepped s(e);
  s.run(300, [](double, scene::StepInput& input) { raise(input, kRight, 0.12); });
  EXPECT_TRUE(std::isnan(s.engine.result().items[0].value)) << "only at the end";
  s.run(10, [](double, scene::StepInput& input) { raise(input, kRight, 0.105); });
  const Result r = s.engine.result();
  EXPECT_TRUE(r.finished);
  EXPECT_EQ(r.failed_by, (std::vector<std::string>{"smooth"})) << "the left hand was not there";
  EXPECT_EQ(r.items[0].points, 0);
  EXPECT_EQ(r.quality, 0);
  EXPECT_NE(toJson(e, r).find("\"value\": null"), std::string::npos);
  EXPECT_NE(toText(e, r).find("smooth: sparc - (pass"), std::string::npos) << toText(e, r);
}

TEST(ExerciseFigures, AreLimitsByAGate) {
  Exercise e = bare();
  e.phases = {phaseOf("lower", height(kRight, 0, 110))};
  const auto angleBelow = [](double most) {
    Condition c;
    c.kind = Condition::Kind::Number, c.number.metric = Metric::AngularPath;
    c.number.tool = static_cast<int>(kRight), c.high = most;
    return c;
  };
  // The tool turns by 0.6 rad, 34 degrees.
  for (const auto& [most, holds] : {std::pair(40.0, true), std::pair(30.0, false)}) {
    Condition any;
    any.kind = Condition::Kind::Any;
    any.children = {height(kLeft, 200), angleBelow(most)};
    e.gates = {{"steady", "It turned too much.", any, false}};
    Stepped s(e);
    s.run(1001, reach);
    EXPECT_FALSE(s.engine.result().failed_by.empty()) << "not known before the end";
    s.run(1, [](double, scene::StepInput& input) { raise(input, kRight, 0.105); });
    EXPECT_EQ(s.engine.result().failed_by.empty(), holds) << most;
  }
}

TEST(ExerciseFigures, StandWhereTheyAreKnownAndAStartIsReadAsStrictlyAsAnEnd) {
  const std::string figure = "{of: sparc, tool: right, above: -9}";
  const std::string clip = "  - name: clip\n", end = "    end: ", at_end = "is known at the end alone";
  EXPECT_NE(
      refusal("never: {before", "never: " + figure + "\n    #{").find("gates[0].never.of: sparc: " + at_end),
      std::string::npos);
  EXPECT_NE(refusal(end, "    start: " + figure + "\n" + end).find("phases[0].start.of: sparc: " + at_end),
            std::string::npos);
  EXPECT_NE(refusal("never: {before", "need: {for_s: 1, that: " + figure + "}\n    #{").find(at_end),
            std::string::npos);
  EXPECT_EQ(refusal("never: {before", "need: {any: [{not: " + figure + "}, " + figure + "]}\n    #{"),
            "accepted");
  EXPECT_NE(refusal(end, "    start: {event: stapled}\n" + end).find("phases[0].start.event: stapled"),
            std::string::npos);
  EXPECT_NE(refusal(end, "    wait: Not yet.\n" + end).find("phases[0].wait"), std::string::npos)
      << "nothing waits without a start";
  EXPECT_EQ(refusal(end, "    start: {event: grasped}\n    wait: Not yet.\n" + end), "accepted");
  EXPECT_NE(refusal("of: clip_off_mm", "of: ldlj").find("items[0].tool: missing"), std::string::npos);
}

TEST(ExerciseFigures, AreTakenByUnit) {
  for (const auto& [metric, unit] :
       {std::pair(Metric::RmsJerk, "m/s³"), std::pair(Metric::PeakSpeed, "mm/s"), std::pair(Metric::Ldlj, ""),
        std::pair(Metric::Leak, "ml/s"), std::pair(Metric::Economy, "percent"), std::pair(Metric::Time, "s"),
        std::pair(Metric::ForceImpulse, "Ns")})
    EXPECT_EQ(unitOf(infoOf(metric)), unit) << infoOf(metric).name;
}

}  // namespace
}  // namespace vest::exercise
