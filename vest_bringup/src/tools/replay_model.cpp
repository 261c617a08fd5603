// A recorded drawing, done again: model/edits of a bag to the same source and the same scene.
#include <cstdio>
#include <exception>
#include <optional>
#include <stdexcept>
#include <string>

#include <vest_msgs/ModelEdit.h>
#include <CLI/CLI.hpp>

#include "vest_bringup/ros/bag_format.h"
#include "vest_bringup/ros/bag_reader.h"
#include "vest_bringup/ros/typed_message.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/session.h"
#include "vest_tissue/scene/world.h"

namespace {

using vest::modelling::Session;

/// The drawing that began last. @throws std::invalid_argument: bag, edit, and what is wrong with it
std::optional<Session> replay(const std::string& bag) {
  std::optional<Session> session;
  vest::session::BagReader reader(bag);
  reader.read([&](const vest::session::BagMessage& message) {
    if (!vest::session::endsWith(message.connection.topic, "model/edits")) return;
    vest_msgs::ModelEdit edit;
    vest::session::readMessage(bag, message, edit);
    const auto refuse = [&](const std::string& what) {
      throw std::invalid_argument(bag + ": model/edits " + std::to_string(edit.seq) + ": " + what);
    };
    if (edit.op == "open") {
      if (session && session->log().front().hash == edit.hash) return;  // told again to whoever came late
      // Its folder was of another machine, perhaps.
      const std::string name = edit.path.substr(edit.path.find_last_of('/') + 1);
      session.emplace(name.empty() ? "source.yaml" : name, edit.after,
                      vest::modelling::readMaterials(vest::material::databasePath()));
    } else {
      if (!session) refuse("no open before it");
      const std::uint64_t known = session->log().back().seq;
      if (edit.seq <= known && session->log()[edit.seq].hash == edit.hash) return;
      if (edit.seq != known + 1) refuse("it follows " + std::to_string(known) + ": edits are missing");
      const bool stepping = edit.op == "undo" || edit.op == "redo";
      session->apply(edit.op, stepping ? "" : edit.path,
                     edit.op == "set" || edit.op == "insert" ? edit.after : "");
    }
    if (session->hash() != edit.hash)
      refuse("hash " + vest::files::shown(edit.hash) + "; the source's is " + session->hash());
  });
  return session;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Does a recorded drawing again (topic model/edits) and compares the hash behind each edit"};
  std::string bag, output;
  app.add_option("BAG", bag, "bag with the topic model/edits")->required();
  app.add_option("-o,--output", output, "folder for source, scene and nets; default: nothing is written");
  CLI11_PARSE(app, argc, argv);
  try {
    const std::optional<Session> session = replay(bag);
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
