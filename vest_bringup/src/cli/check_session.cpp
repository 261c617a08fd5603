#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_bringup/ros/session_check.h"
#include "vest_instruments/files/read.h"

int main(int argc, char** argv) {
  CLI::App app{
      "Judges a recorded session from the bag's stamps: rates, steps, real time, and how it ended. Exit 0 "
      "only if "
      "every row holds"};
  std::string directory, ns = "/vest";
  bool no_picture = false;
  app.add_option("DIR", directory, "folder with session.bag and session.json")->required();
  app.add_option("--namespace", ns, "namespace of the session, default /vest");
  app.add_flag("--no-picture", no_picture, "the session ran without a view");
  CLI11_PARSE(app, argc, argv);
  try {
    const auto rows = vest::session::checkSession(directory, ns, !no_picture);
    int failed = 0;
    std::printf("%-34s %14s  allowed\n", "", "measured");
    for (const auto& row : rows) {
      failed += row.good ? 0 : 1;
      std::printf("%-34s %14s  %-28s %s\n", row.name.c_str(), row.value.c_str(), row.allowed.c_str(),
                  row.good ? "ok" : "NO");
    }
    if (failed == 0)
      std::puts("every row holds");
    else
      std::printf("%d row%s not held\n", failed, failed > 1 ? "s" : "");
    return failed == 0 ? 0 : 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_check_session: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 2;
  }
}
