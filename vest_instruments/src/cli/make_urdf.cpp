// Writes the URDF of a trainer box: `make_urdf --box trainer_box.yaml --output trainer.urdf`, or checks one:
// `--check FILE`.
#include <fstream>
#include <iostream>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_instruments/files/refusal.h"
#include "vest_instruments/urdf/description.h"

int main(int argc, char** argv) {
  CLI::App app{
      "Writes the URDF of box and instruments from the box's layout, or checks a URDF's size, depth and "
      "tree"};
  std::string box_file, output, check;
  auto* check_option = app.add_option("--check", check, "URDF to check; writes nothing");
  app.add_option("--box", box_file, "layout, e.g. config/trainer_box.yaml")->excludes(check_option);
  app.add_option("--output", output, "URDF to write (standard output where not given)");
  CLI11_PARSE(app, argc, argv);
  try {
    if (!check.empty()) {
      vest::urdf::checkUrdf(vest::files::read(check, 4u << 20));
      std::cout << vest::files::shown(check, 6000) << ": one tree, within the limits\n";
      return 0;
    }
    if (box_file.empty()) throw std::runtime_error("--box or --check must be given");
    const auto box = vest::kinematics::loadTrainerBox(box_file);
    vest::urdf::ToolSet tools;
    for (std::size_t i = 0; i < tools.size(); ++i) tools[i] = box.arms[i].tool;
    const std::string xml = vest::urdf::makeUrdf(box, tools);
    vest::urdf::checkUrdf(xml);
    std::ofstream file;
    if (!output.empty()) file.open(output);
    // Flushed here: a full disk is seen only then.
    if (!((output.empty() ? std::cout : file) << xml << std::flush))
      throw std::runtime_error((output.empty() ? "standard output" : output) + ": cannot be written");
  } catch (const std::exception& e) {
    std::cerr << "make_urdf: "
              << (check.empty() ? vest::files::shown(e.what(), 6000) : vest::files::refusal(e.what(), check))
              << "\n";
    return 1;
  }
  return 0;
}
