// A recorded drawing, done again: model/edits of a bag to the same source and the same scene.
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>

#include <CLI/CLI.hpp>

#include "vest_bringup/ros/recorded_drawing.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/scene/world.h"

int main(int argc, char** argv) {
  CLI::App app{"Does a recorded drawing again (topic model/edits) and compares the hash behind each edit"};
  std::string bag, output;
  app.add_option("BAG", bag, "bag with the topic model/edits")->required();
  app.add_option("-o,--output", output, "folder for source, scene and nets; default: nothing is written");
  CLI11_PARSE(app, argc, argv);
  try {
    const std::optional<vest::modelling::Session> session = vest::session::replayDrawing(bag);
    if (!session) throw std::invalid_argument(bag + ": no topic model/edits");
    std::printf("%s: %zu edits, document %s\n", vest::files::shown(bag, 6000).c_str(),
                session->log().size() - 1, session->hash().c_str());
    if (output.empty()) return 0;
    const std::string scene = vest::modelling::save(*session, output);
    std::printf("%s: scene %s\n", vest::files::shown(scene, 6000).c_str(),
                vest::scene::loadScene(scene).hash.c_str());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "vest_replay_model: %s\n", vest::files::shown(e.what(), 6000).c_str());
    return 1;
  }
  return 0;
}
