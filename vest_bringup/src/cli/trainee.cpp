#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "vest_bringup/exercise/curriculum.h"
#include "vest_bringup/exercise/erase_reports.h"
#include "vest_bringup/exercise/learning_curve.h"
#include "vest_bringup/exercise/rating.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_instruments/files/read.h"
#include "write_whole.h"

namespace {

/// A text of the database: it may be a stranger's.
std::string shown(const std::string& text) {
  return vest::files::shown(text, 2000);
}

void print(const vest::exercise::Attempt& a) {
  const std::string date = shown(a.date), exercise = shown(a.exercise);
  if (a.exercise == vest::exercise::kCurriculum) {
    std::printf("%s  a new curriculum\n", date.c_str());
    return;
  }
  for (const auto& form : vest::exercise::kForms) {
    if (a.exercise.rfind(std::string(form.name) + " ", 0) != 0) continue;
    std::printf("%s  %s  rated %.0f marks\n", date.c_str(), exercise.c_str(), a.total);
    return;
  }
  std::printf("%s  %s  %s, total %.1f, quality %.1f, %.1f s%s%s  %s\n", date.c_str(), exercise.c_str(),
              a.passed ? "passed" : "not passed", a.total, a.quality, a.time, a.flags.empty() ? "" : ", ",
              shown(a.flags).c_str(), shown(a.directory).c_str());
}

/// What a trainee shall learn, how far that is, and what comes next.
void tell(const std::vector<vest::exercise::CurriculumStep>& steps) {
  if (steps.empty()) throw std::invalid_argument("no curriculum yet (--exercises NAME,NAME… makes one)");
  bool next = true;
  for (const auto& step : steps) {
    std::printf("%-5s  %s  %zu attempts\n",
                step.done ? "done"
                : next    ? "next"
                          : "-",
                shown(step.exercise).c_str(), step.attempts);
    next = next && step.done;
  }
}

/// A line of a class: one trainee, at one exercise or in all.
void tell(const vest::exercise::Trainees& trainees, const std::string& name, const std::string& exercise) {
  const auto learning = vest::exercise::learningOf(trainees.attempts(name, exercise), std::nullopt);
  std::size_t attempts = 0, passed = 0;
  for (const auto& a : learning.attempts)  // marks of people and curricula have no hash
    attempts += !a.exercise_hash.empty(), passed += a.passed && a.flags.empty();
  std::printf("%s  %zu attempts, %zu passed", shown(name).c_str(), attempts, passed);
  if (!exercise.empty() && !learning.totals.empty())
    std::printf(", last total %.1f, best %.1f", learning.totals.back(),
                *std::max_element(learning.totals.begin(), learning.totals.end()));
  using Verdict = vest::exercise::Cusum::Verdict;
  if (!exercise.empty() && learning.cusum.verdict != Verdict::Open)
    std::printf(", %s", learning.cusum.verdict == Verdict::Competent ? "competent" : "not yet competent");
  std::printf("\n");
}

/// Numbers of one exercise, for people or for a table.
void tell(const vest::exercise::Learning& learning, const std::string& format) {
  if (format == "csv") std::fputs(toCsv(learning).c_str(), stdout);
  if (format == "json") std::fputs(toJson(learning).c_str(), stdout);
  if (format != "text") return;
  for (const auto& a : learning.attempts) print(a);
  for (const auto& z : learning.z) std::printf("z %+.2f  %s\n", z.z, shown(z.name).c_str());
  std::printf("%s\n", toText(learning).c_str());
}

}  // namespace

// Trainees by pseudonym and their results.
int main(int argc, char** argv) {
  CLI::App app{"Trainees by pseudonym and their results. No other word about a person is kept"};
  app.require_subcommand(1);
  std::string name, database;
  app.add_option("--database", database,
                 "file; default: $VEST_TRAINEES, else ~/.local/share/vest/trainees.db");
  auto* const adding = app.add_subcommand("add", "a new trainee");
  auto* const listing = app.add_subcommand("list", "all trainees, a line each: attempts, passes");
  auto* const showing = app.add_subcommand("show", "the attempts of a trainee, a line each");
  auto* const exporting = app.add_subcommand("export", "prints everything that is kept of a trainee, JSON");
  auto* const erasing = app.add_subcommand(
      "erase", "forgets a trainee, all results and reports; recordings, which name nobody, stay");
  auto* const rating = app.add_subcommand("rate", "keeps a person's marks beside the scores");
  std::string form = "GOALS", exercise, rater;
  std::vector<int> marks;
  rating->add_option("--form", form, "GOALS or GEARS");
  rating->add_option("--exercise", exercise, "that was seen")->required();
  rating->add_option("--rater", rater, "pseudonym of who rates");
  rating
      ->add_option(
          "--marks", marks,
          "1 to 5 each, in the form's order: depth perception, bimanual dexterity, efficiency, tissue "
          "handling (GEARS: force sensitivity), autonomy (GEARS: and robotic control)")
      ->required()
      ->delimiter(',');
  listing->add_option("--exercise", exercise, "at this one: last and best total, too");
  auto* const plan = app.add_subcommand(
      "curriculum", "what a trainee shall learn, in order: what is done (two passes in a row), what is next");
  std::vector<std::string> planned;
  plan->add_option("--exercises", planned, "makes a new one of these")->delimiter(',');
  auto* const progress = app.add_subcommand("progress", "learning curve, CUSUM and z-scores of a trainee");
  progress->add_option("--exercise", exercise, "one of vest_exercise list")->required();
  std::string format = "text";
  progress->add_option("--format", format)->check(CLI::IsMember({"text", "csv", "json"}));
  auto* const reference =
      app.add_subcommand("reference", "makes trainees the group that z-scores of an exercise compare with");
  std::vector<std::string> group;
  reference->add_option("--exercise", exercise, "one of vest_exercise list")->required();
  reference->add_option("--of", group, "pseudonyms; only their numbers are kept")->required()->delimiter(',');
  for (auto* const one : {progress, adding, showing, exporting, erasing, rating, plan})
    one->add_option("NAME", name, "pseudonym")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    if (database.empty()) database = vest::exercise::Trainees::defaultFile();
    vest::exercise::Trainees trainees(database);
    if (!exercise.empty()) vest::ros_shell::exerciseFile(exercise);  // one that there is
    if (adding->parsed()) trainees.add(name);
    if (listing->parsed())
      for (const std::string& one : trainees.list()) tell(trainees, one, exercise);
    if (showing->parsed())
      for (const auto& a : trainees.attempts(name)) print(a);
    if (rating->parsed())
      trainees.keep(vest::exercise::ratingOf(form, exercise, rater, marks, name, vest::exercise::dateNow()));
    for (const std::string& one : planned) vest::ros_shell::exerciseFile(one);
    if (!planned.empty())
      trainees.keep(vest::exercise::curriculumOf(planned, name, vest::exercise::dateNow()));
    if (plan->parsed()) tell(vest::exercise::curriculumSteps(trainees.attempts(name)));
    if (progress->parsed())
      tell(vest::exercise::learningOf(trainees.attempts(name, exercise),
                                      vest::exercise::storedReference(database, exercise)),
           format);
    if (reference->parsed()) {
      std::vector<vest::exercise::Attempt> attempts;
      for (const std::string& one : group)
        for (const auto& a : trainees.attempts(one, exercise)) attempts.push_back(a);
      const std::string file = vest::exercise::referenceFile(database, exercise);
      try {
        vest::tools::writeWhole(file, toJson(vest::exercise::referenceOf(exercise, attempts)));
      } catch (const std::invalid_argument& e) {  // which of several databases it is
        throw std::invalid_argument(database + ": " + e.what());
      }
      std::printf("%s\n", shown(file).c_str());
    }
    if (exporting->parsed()) std::fputs(trainees.exported(name).c_str(), stdout);
    if (erasing->parsed()) {
      for (const auto& a : trainees.attempts(name))
        if (vest::exercise::eraseReports(a.directory, name))
          std::printf("report removed: %s\n", shown(a.directory).c_str());
      trainees.erase(name);
    }
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_trainee: %s\n", shown(e.what()).c_str());
    return 1;
  }
  return 0;
}
