#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include <ros/package.h>
#include <sys/stat.h>
#include <CLI/CLI.hpp>

#include "render.h"
#include "vest_bringup/exercise/report.h"
#include "vest_bringup/exercise/trainees.h"
#include "vest_bringup/ros/exercise_file.h"
#include "vest_bringup/ros/moment_bag.h"
#include "vest_bringup/ros/session_player.h"
#include "vest_instruments/files/refusal.h"
#include "write_whole.h"

// Scores a recorded session: simulates it again and lets the exercise's engine look at each step.

namespace {

namespace exercise = vest::exercise;
namespace fs = std::filesystem;

/// When the recording ended, UTC.
std::string dateOf(const std::string& file) {
  struct stat status = {};
  stat(file.c_str(), &status);
  char text[32] = "";
  struct tm utc = {};
  gmtime_r(&status.st_mtime, &utc);
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

/// Keeps the moments that counted for the renderer.
class Moments {
 public:
  Moments() {
    std::string name = fs::temp_directory_path() / "vest_moments_XXXXXX";
    if (mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be made");
    folder_ = name;
    bag_ = std::make_unique<vest::ros_shell::MomentBag>(folder_ + "/moments.bag");
  }
  ~Moments() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Moments(const Moments&) = delete;
  Moments& operator=(const Moments&) = delete;

  vest::simulation::StageFrames frames() { return bag_->frames(); }
  /// A new attempt: what was seen before does not count.
  void again() { first_ = pictures_.size(), seen_ = 0, finished_ = false; }

  void look(const vest::scene::World& world, const vest::scene::StepInput& input,
            const exercise::Engine& engine) {
    if (finished_) return;
    if (world.steps() % 50 == 0 || engine.finished() != finished_) {
      if (!bag_->current(world) && !engine.finished()) return;
      const auto all = engine.result().moments;
      for (; seen_ < all.size(); ++seen_) {
        using Kind = exercise::Moment::Kind;
        const Kind kind = all[seen_].kind;
        const bool counts = kind == Kind::PhaseEnded || kind == Kind::GateBroken || kind == Kind::ErrorMade;
        if (!counts || pictures_.size() >= first_ + kMost) continue;
        const double t = 1e-3 * static_cast<double>(all[seen_].step);
        bag_->write(1e-3 * static_cast<double>(world.steps()), world, box_, input);
        pictures_.push_back({t, exercise::describe(engine.exercise(), all[seen_]), ""});
      }
      finished_ = engine.finished();
    }
  }

  /// Draws them with the code of the endoscopic view; none where that cannot be.
  std::vector<exercise::Picture> draw() {
    bag_->close();
    if (pictures_.empty()) return {};
    if (!vest::tools::render(folder_ + "/moments.bag",
                             {"--each-state", "--format", "jpg", "--output", folder_})) {
      std::fprintf(stderr, "vest_score: no pictures: vest_render failed\n");
      return {};
    }
    for (std::size_t i = 0; i < pictures_.size(); ++i) {
      char name[32];
      std::snprintf(name, sizeof name, "/frame_%06zu.jpg", i);
      std::ifstream in(folder_ + name, std::ios::binary);
      pictures_[i].jpeg.assign(std::istreambuf_iterator<char>(in), {});
    }
    return {pictures_.begin() + static_cast<std::ptrdiff_t>(first_), pictures_.end()};
  }

 private:
  static constexpr std::size_t kMost = 8;
  std::string folder_;
  std::unique_ptr<vest::ros_shell::MomentBag> bag_;
  vest::kinematics::TrainerBox box_ = vest::kinematics::loadTrainerBox(
      ros::package::getPath("vest_instruments") + "/config/trainer_box.yaml");
  std::vector<exercise::Picture> pictures_;
  std::size_t first_ = 0, seen_ = 0;
  bool finished_ = false;
};

struct Wanted {
  std::string directory, exercise, trainee, database;
  int threads = 1;
  bool json = false, report = false, pictures = false, pdf = false;
};

void printPdf(const std::string& directory) {
  std::remove((directory + "/report.pdf").c_str());  // where it is a link, it is not followed
  const int status = vest::data::runProgram(
      {"weasyprint", "--quiet", directory + "/report.html", directory + "/report.pdf"}, "/dev/null", false);
  if (status == 127)
    std::fprintf(stderr, "vest_score: no PDF: weasyprint is not installed (apt install weasyprint)\n");
  else if (status != 0)
    std::fprintf(stderr, "vest_score: %s/report.pdf: weasyprint could not write it\n",
                 vest::files::shown(directory, 6000).c_str());
}

void score(const Wanted& wanted) {
  vest::session::RecordedSession session(wanted.directory + "/session.bag");
  if (!session.effects())
    throw std::invalid_argument("the session does not tell its effects (allowed: one with effects/options)");
  const auto asked = wanted.exercise.empty()
                         ? vest::session::exerciseOf(session)
                         : exercise::loadExercise(vest::ros_shell::exerciseFile(wanted.exercise));
  if (!asked) throw std::invalid_argument("no exercise was done in it (use --exercise)");
  const exercise::Exercise& e = *asked;
  std::unique_ptr<exercise::Trainees> trainees;
  const std::string database = wanted.database.empty() && !wanted.trainee.empty()
                                   ? exercise::Trainees::defaultFile()
                                   : wanted.database;
  if (!wanted.trainee.empty()) {
    trainees = std::make_unique<exercise::Trainees>(database);
    trainees->attempts(wanted.trainee);  // who is not known is told before the work
  }
  vest::session::PlayOptions options;
  options.effects = true, options.threads = wanted.threads;
  if (!wanted.exercise.empty()) options.exercise = &e;
  std::unique_ptr<Moments> moments;
  if (wanted.pictures) moments = std::make_unique<Moments>(), options.frames = moments->frames();
  exercise::Trace trace;
  bool over = false;
  const auto played =
      vest::session::play(wanted.directory, session, options,
                          [&](const auto& world, const auto& input, const auto& report, const auto* engine) {
                            if (!engine) return;
                            if (world.steps() == 1) {  // the last attempt counts
                              trace = exercise::Trace(), over = false;
                              if (moments) moments->again();
                            }
                            if (!over) trace.add(input, report);
                            over = engine->finished();
                            if (moments) moments->look(world, input, *engine);
                          });
  if (!played.result)
    throw std::invalid_argument("the exercise needs scene " + e.scene + ", the session has another one");
  const std::string json = exercise::toJson(e, *played.result), date = dateOf(session.file());
  std::fputs((wanted.json ? json : exercise::toText(e, *played.result)).c_str(), stdout);
  exercise::Result as_live = *played.result;
  as_live.flags &= ~static_cast<std::uint64_t>(exercise::kPractice);  // the engine knows no clock
  if (wanted.exercise.empty() && as_live.finished && !session.result().empty() &&
      session.result() != exercise::toJson(e, as_live))
    throw vest::session::Difference("the score differs from the one of the session");
  exercise::Learning learning;
  std::string problem;  // the report is written all the same
  if (trainees) try {
      const auto kept = trainees->keep(vest::ros_shell::attemptOf(
          e, *played.result, wanted.trainee, date, VEST_VERSION, fs::absolute(wanted.directory).string()));
      learning = exercise::learningOf(trainees->attempts(wanted.trainee, e.name),
                                      exercise::storedReference(database, e.name));
      const std::string words = toText(learning);
      if (!wanted.json)
        std::printf("kept for %s%s%s\n%s%s", kept.trainee.c_str(), kept.flags.empty() ? "" : ": ",
                    kept.flags.c_str(), words.c_str(), words.empty() ? "" : "\n");
    } catch (const std::exception& why) {
      problem = why.what();
    }
  if (wanted.report || wanted.pictures || wanted.pdf) {
    exercise::Report report{
        e, *played.result, trace, wanted.trainee, date, VEST_VERSION, std::move(learning), {}, {}};
    for (const auto& note : session.notes()) {
      const double t = (note.stamp - played.exercise_begin).toSec();
      if (t >= 0) report.notes.push_back({t, note.text});
    }
    if (moments) report.pictures = moments->draw();
    vest::tools::writeWhole(wanted.directory + "/report.html", exercise::toHtml(report));
    vest::tools::writeWhole(wanted.directory + "/score.json", json);
    vest::tools::writeWhole(wanted.directory + "/trace.csv", trace.toCsv());
    vest::tools::writeWhole(wanted.directory + "/motion.json",
                            vest::session::motion::toJson(trace.motion(played.result->moments)));
    vest::tools::writeWhole(wanted.directory + "/xapi.json", exercise::toXapi(report));
    if (trainees) {
      vest::tools::writeWhole(wanted.directory + "/learning.json", toJson(report.learning));
      vest::tools::writeWhole(wanted.directory + "/learning.csv", toCsv(report.learning));
    }
    if (!wanted.json)
      std::printf("report: %s/report.html\n", vest::files::shown(wanted.directory, 6000).c_str());
    if (wanted.pdf) printPdf(wanted.directory);
  }
  if (!problem.empty()) throw exercise::DatabaseError(problem);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{
      "Scores a recorded session by simulating it again with its effects. Exit 0: scored, and where the "
      "session "
      "has a score it is the same to the bit; 1: it differs; 2: refused"};
  Wanted wanted;
  app.add_option("DIR", wanted.directory, "folder with session.bag")->required();
  app.add_option("--exercise", wanted.exercise,
                 "exercise or its file; default: the one that the session carries");
  app.add_option("--threads", wanted.threads, "worker threads")->check(CLI::Range(1, 64));
  app.add_option("--trainee", wanted.trainee,
                 "pseudonym: keeps the result for this trainee (vest_trainee add)");
  app.add_option("--database", wanted.database,
                 "of trainees; default: $VEST_TRAINEES, else in ~/.local/share/vest");
  app.add_flag("--report", wanted.report,
               "writes report.html, score.json, motion.json, trace.csv and xapi.json into DIR; with "
               "--trainee learning.json and learning.csv, too");
  app.add_flag("--pictures", wanted.pictures, "the report, with pictures of the moments that counted");
  app.add_flag("--pdf", wanted.pdf, "the report, and report.pdf by weasyprint");
  app.add_flag("--json", wanted.json, "print JSON");
  CLI11_PARSE(app, argc, argv);
  try {
    score(wanted);
  } catch (const vest::session::Difference& e) {
    std::fprintf(stderr, "vest_score: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  } catch (const exercise::DatabaseError& e) {
    std::fprintf(stderr, "vest_score: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_score: %s\n",
                 vest::files::refusal(e.what(), wanted.directory + "/session.bag").c_str());
    return 2;
  }
  return 0;
}
