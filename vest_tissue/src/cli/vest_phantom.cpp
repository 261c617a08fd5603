#include <cstdio>
#include <exception>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "vest_instruments/files/option.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/image/phantom.h"

int main(int argc, char** argv) {
  CLI::App app(
      "Writes a patient made of exact shapes as a DICOM series: for trials without a patient's data.");
  std::string name, folder, fault = "none", list;
  vest::image::PhantomImage options;
  std::vector<std::uint32_t> size{128, 128, 64};
  app.add_option("NAME", name, "head, lumbar or abdomen")->required();
  app.add_option("FOLDER", folder, "to write to: new or empty")->required();
  app.add_option("--size", size, "columns, rows, slices")->expected(3)->capture_default_str();
  app.add_option("--noise", options.noise, "HU, standard deviation")
      ->check(vest::files::number(0, 1e4))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the noise")->capture_default_str();
  std::string names = "what shall be wrong or unusual:";
  for (const auto& [key, what] : vest::image::faults()) names += "\n  " + key + ": " + what;
  app.add_option("--fault", fault, names)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    std::filesystem::create_directories(folder);
    if (!std::filesystem::is_empty(folder)) throw std::invalid_argument(folder + ": is not empty");
    options.size = {size[0], size[1], size[2]};
    const auto volume = vest::image::picture(vest::image::makePhantom(name), options);
    vest::image::writeDicom(volume, folder, fault);
    std::printf("%s: %s, %u x %u x %u\n", vest::files::shown(folder, 6000).c_str(), name.c_str(), size[0],
                size[1], size[2]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "vest_phantom: %s\n", vest::files::shown(error.what(), 1000).c_str());
    return 1;
  }
}
