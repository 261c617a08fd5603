#include <cstdio>
#include <exception>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_bringup/ros/recovery.h"
#include "vest_instruments/files/read.h"

int main(int argc, char** argv) {
  CLI::App app{
      "Makes a valid bag of what a killed recorder left (session.bag.active), writes session.json beside it, "
      "and "
      "counts what was kept and lost"};
  std::string bag, output;
  app.add_option("BAG", bag, "session.bag.active, the folder that holds it, or any bag that is damaged")
      ->required();
  app.add_option("--output", output, "the valid bag; default: BAG without .active, which is removed then");
  CLI11_PARSE(app, argc, argv);
  try {
    const vest::session::Recovery done = vest::session::recoverBag(bag, output);
    const auto kept = static_cast<unsigned long long>(done.kept);
    if (done.lost)
      std::printf("%s: %llu messages kept, %llu lost\n", vest::files::shown(done.bag, 6000).c_str(), kept,
                  static_cast<unsigned long long>(*done.lost));
    else
      std::printf("%s: %llu messages kept, at least %llu lost\n", vest::files::shown(done.bag, 6000).c_str(),
                  kept, static_cast<unsigned long long>(done.damaged));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_recover_bag: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 2;
  }
  return 0;
}
