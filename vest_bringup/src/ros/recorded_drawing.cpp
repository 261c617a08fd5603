#include "vest_bringup/ros/recorded_drawing.h"

#include <stdexcept>

#include <vest_msgs/ModelEdit.h>

#include "vest_bringup/ros/bag_format.h"
#include "vest_bringup/ros/bag_reader.h"
#include "vest_bringup/ros/typed_message.h"
#include "vest_instruments/files/read.h"
#include "vest_tissue/material/database.h"

namespace vest::session {

std::optional<modelling::Session> replayDrawing(const std::string& bag) {
  std::optional<modelling::Session> drawing;
  std::optional<vest_msgs::ModelEdit> early;  // whoever came while an edit went out has it before all of them
  BagReader reader(bag);
  reader.read([&](const BagMessage& message) {
    if (!endsWith(message.connection.topic, "model/edits")) return;
    vest_msgs::ModelEdit edit;
    readMessage(bag, message, edit);
    const auto refuse = [&](const std::string& what) {
      throw std::invalid_argument(bag + ": model/edits " + std::to_string(edit.seq) + ": " + what);
    };
    // What a drawing refuses names its source alone.
    const auto named = [&](auto&& draw) {
      try {
        draw();
      } catch (const std::invalid_argument& why) {
        refuse(why.what());
      }
    };
    if (edit.op == "open") {
      if (drawing && drawing->log().front().hash == edit.hash) return;  // told again to whoever came late
      // Its folder was of another machine, perhaps.
      const std::string name = edit.path.substr(edit.path.find_last_of('/') + 1);
      named([&] {
        drawing.emplace(name.empty() ? "source.yaml" : files::shown(name, 200), edit.after,
                        modelling::readMaterials(material::databasePath()));
      });
    } else {
      if (!drawing) {
        early = edit;
        return;
      }
      const std::uint64_t known = drawing->log().back().seq;
      if (edit.seq <= known && drawing->log()[edit.seq].hash == edit.hash) return;
      if (edit.seq != known + 1) refuse("it follows " + std::to_string(known) + ": edits are missing");
      const bool stepping = edit.op == "undo" || edit.op == "redo";
      named([&] {
        drawing->apply(edit.op, stepping ? "" : edit.path,
                       edit.op == "set" || edit.op == "insert" ? edit.after : "");
      });
    }
    if (drawing->hash() != edit.hash)
      refuse("hash " + files::shown(edit.hash) + "; the source's is " + drawing->hash());
  });
  const auto told = [&] {
    return drawing && early->seq < drawing->log().size() && drawing->log()[early->seq].hash == early->hash;
  };
  if (early && !told())
    throw std::invalid_argument(bag + ": model/edits " + std::to_string(early->seq) +
                                ": no open before it, and none after it with all edits up to it");
  return drawing;
}

}  // namespace vest::session
