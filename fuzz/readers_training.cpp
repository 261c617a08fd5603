#include <filesystem>

#include "readers.h"
#include "vest_bringup/exercise/exercise.h"
#include "vest_bringup/exercise/learning_curve.h"
#include "vest_bringup/exercise/trainees.h"
#include "vest_instruments/files/read.h"

namespace vest::fuzz {
namespace {

void readExercise(const std::string& input) {
  folder().clear();
  const std::string file = folder().write("exercise.yaml", input);
  takes(file, [&] { exercise::loadExercise(file); });
}

std::vector<std::string> exercises() {
  const std::string at = std::string(VEST_SOURCE_DIR) + "/vest_bringup/exercises/";
  std::vector<std::string> all;
  for (const char* name : {"clip_cut_tube", "look_round", "seal_tube", "empty_pouch"})
    all.push_back(files::read(at + name + "/exercise.yaml", 1 << 20));
  return all;
}

void readTrainees(const std::string& input) {
  folder().clear();
  const std::string file = folder().write("trainees.db", input);
  takes("", [&] {
    exercise::Trainees trainees(file, 0);
    for (const std::string& name : trainees.list()) {
      trainees.attempts(name);
      trainees.exported(name);
    }
    exercise::Attempt attempt;
    trainees.add("new");
    attempt.trainee = "new";
    trainees.keep(attempt);
    trainees.erase("new");
  });
  for (const char* beside : {"-wal", "-shm", "-journal"}) std::filesystem::remove(file + beside);
}

void readReference(const std::string& input) {
  takes("reference.json", [&] { exercise::parseReference("reference.json", input); });
}

std::vector<std::string> references() {
  exercise::Reference group;
  group.exercise = "lift_tube", group.hash = "0123456789abcdef", group.attempts = 7;
  group.figures = {{"total", 71.5, 12.25}, {"time_s", 40.0, 0.0}};
  return {exercise::toJson(group)};
}

std::vector<std::string> databases() {
  const Folder one;
  const std::string file = one.path() + "/trainees.db";
  {
    exercise::Trainees trainees(file);
    for (const char* name : {"first", "second"}) {
      trainees.add(name);
      exercise::Attempt attempt;
      attempt.trainee = name, attempt.date = "2026-01-01", attempt.exercise = "lift_tube";
      attempt.json = "{\"total\": 3.5}";
      trainees.keep(attempt);
    }
  }
  return {files::read(file, 1 << 20)};
}

}  // namespace

std::vector<Reader> trainingReaders() {
  return {{"exercise", readExercise, exercises},
          {"trainees", readTrainees, databases},
          {"reference", readReference, references}};
}

}  // namespace vest::fuzz
