#include <cstdio>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_bringup/exercise/trainees.h"
#include "vest_instruments/files/read.h"

namespace {

/// A text of the database: it may be a stranger's.
std::string shown(const std::string& text) {
  return vest::files::shown(text, 2000);
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
  auto* const listing = app.add_subcommand("list", "all trainees with the number of their attempts");
  auto* const showing = app.add_subcommand("show", "the attempts of a trainee, a line each");
  auto* const exporting = app.add_subcommand("export", "prints everything that is kept of a trainee, JSON");
  auto* const erasing =
      app.add_subcommand("erase", "forgets a trainee and all results; recordings stay where they are");
  for (auto* const one : {adding, showing, exporting, erasing})
    one->add_option("NAME", name, "pseudonym")->required();
  CLI11_PARSE(app, argc, argv);
  try {
    vest::exercise::Trainees trainees(database.empty() ? vest::exercise::Trainees::defaultFile() : database);
    if (adding->parsed()) trainees.add(name);
    if (listing->parsed())
      for (const std::string& one : trainees.list())
        std::printf("%s  %zu attempts\n", shown(one).c_str(), trainees.attempts(one).size());
    if (showing->parsed())
      for (const auto& a : trainees.attempts(name))
        std::printf("%s  %s  %s, total %.1f, quality %.1f, %.1f s%s%s  %s\n", shown(a.date).c_str(),
                    shown(a.exercise).c_str(), a.passed ? "passed" : "not passed", a.total, a.quality, a.time,
                    a.flags.empty() ? "" : ", ", shown(a.flags).c_str(), shown(a.directory).c_str());
    if (exporting->parsed()) std::fputs(trainees.exported(name).c_str(), stdout);
    if (erasing->parsed()) trainees.erase(name);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_trainee: %s\n", shown(e.what()).c_str());
    return 1;
  }
  return 0;
}
