#pragma once

#include <map>
#include <string>
#include <vector>

#include "vest_tissue/modelling/bake.h"
#include "vest_tissue/modelling/document.h"

/// A source that is being drawn: edits by path, undo, and the scene that it bakes to (docs/modelling.md).
namespace vest::modelling {

/// One step of a drawing, as it is recorded.
struct Edit {
  std::uint64_t seq = 0;      ///< from 1; 0: how the session began
  std::string op;             ///< open, set, insert, remove, undo or redo
  std::string path;           ///< of the value; open: of the file
  std::string before, after;  ///< bytes of the value; empty: there was none
  std::string hash;           ///< of the document behind it, 16 hexadecimal digits
};

/// Rings of an object that lie near another one.
struct Proposal {
  std::string object, to;
  int first = 0, last = 0;           ///< rings
  double nearest = 0, farthest = 0;  ///< m, of the rings' nearest knots
  std::string path, value;  ///< the edit that ties them: insert VALUE at PATH, or set where it has none
};

class Session {
 public:
  /// @param path of the source: parts lie beside it @throws std::invalid_argument
  Session(std::string path, std::string text, Materials materials);

  /// `value` is YAML. The document always bakes: an edit after which it would not is refused, and leaves
  /// everything as it was. @throws std::invalid_argument: one line
  const Edit& apply(const std::string& op, const std::string& path, const std::string& value = {});
  bool canUndo() const { return done_ > 0; }
  bool canRedo() const { return done_ < steps_.size(); }

  const std::string& path() const { return path_; }
  const std::string& text() const { return document_.text(); }
  const Document& document() const { return document_; }
  const SceneSource& source() const { return source_; }
  const scene::Description& scene() const { return scene_; }
  const std::vector<std::string>& rebuilt() const { return cache_.rebuilt; }  ///< by the last edit
  std::string hash() const;                                                   ///< XXH64 of the text
  const std::vector<Edit>& log() const { return log_; }                       ///< the first is `open`

  /// Runs of an object's rings within `within` m of each other object's surface, by object in scene order.
  /// @throws std::invalid_argument where there is no such object
  std::vector<Proposal> propose(const std::string& object, double within) const;

 private:
  struct Step {
    Patch patch;
    std::string path, before, after;
  };
  void take(Document document);

  std::string path_;
  Materials materials_;
  Document document_;
  SceneSource source_;
  scene::Description scene_;
  BakeCache cache_;
  std::vector<Step> steps_;
  std::size_t done_ = 0;
  std::vector<Edit> log_;
};

/// Edits as a file has them (docs/modelling.md).
struct Script {
  struct Line {
    std::string op, path, value;
    std::string hash;  ///< what the document's shall be behind it; empty: not compared
    int line = 0;
  };
  std::string file;
  std::string source_hash;  ///< what the document's shall be before the first one; empty: not compared
  std::vector<Line> edits;
};
/// @throws std::invalid_argument: file, line, field, value, what is allowed
Script readEdits(const std::string& path, const std::string& text);
/// What a session did, as such a file.
std::string editsText(const std::vector<Edit>& log);
/// Applies one after the other. @throws std::invalid_argument: file and line of the first that is refused, or
/// after which a hash differs; those before it stay
void play(const Script& script, Session& session);

/// Source, scene and nets, with the source's parts, into a folder. @return the scene file
/// @throws std::invalid_argument, std::runtime_error
std::string save(const Session& session, const std::string& directory);

}  // namespace vest::modelling
