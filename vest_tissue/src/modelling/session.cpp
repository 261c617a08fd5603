#include "vest_tissue/modelling/session.h"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <stdexcept>

#include "vest_instruments/files/read.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/modelling/copy_parts.h"
#include "vest_tissue/modelling/ties.h"
#include "vest_tissue/scene/baked.h"

namespace vest::modelling {
namespace {

Document documentOf(const std::string& path, std::string text) try {
  return Document(std::move(text));
} catch (const files::Refused& why) {
  scene::yaml::fail(path, why.line, why.field, why.value, "allowed: " + why.allowed);
}

std::string patched(const std::string& text, const Patch& patch, bool back) {
  const std::string& there = back ? patch.after : patch.before;
  std::string result = text;
  return result.replace(patch.offset, there.size(), back ? patch.before : patch.after);
}

std::string bytesAt(const Document& document, const std::string& path) {
  return document.has(path) ? document.bytes(path) : "";
}

}  // namespace

Session::Session(std::string path, std::string text, Materials materials)
    : path_(std::move(path)),
      materials_(std::move(materials)),
      document_(documentOf(path_, std::move(text))) {
  source_ = readSource(path_, document_.text());
  scene_ = bake(source_, materials_, &cache_);
  log_.push_back({0, "open", path_, "", document_.text(), hash()});
}

std::string Session::hash() const {
  return scene::hashText(document_.text());
}

void Session::take(Document document) {
  SceneSource source = readSource(path_, document.text());
  scene::Description scene = bake(source, materials_, &cache_);
  document_ = std::move(document);
  source_ = std::move(source);
  scene_ = std::move(scene);
}

const Edit& Session::apply(const std::string& op, const std::string& path, const std::string& value) try {
  const auto finished = [&](const Step& step, bool back) -> const Edit& {
    log_.push_back({log_.size(), op, step.path, back ? step.after : step.before,
                    back ? step.before : step.after, hash()});
    return log_.back();
  };
  if (op == "undo" || op == "redo") {
    const bool back = op == "undo";
    if (!path.empty() || !value.empty())
      throw std::invalid_argument("a path or value; allowed: none, the last edit is meant");
    if (back ? !canUndo() : !canRedo())
      throw std::invalid_argument(back ? "nothing is left to undo" : "nothing is left to redo");
    const Step& step = steps_[back ? done_ - 1 : done_];
    take(documentOf(path_, patched(document_.text(), step.patch, back)));
    done_ += back ? -1 : 1;
    return finished(step, back);
  }
  if (op != "set" && op != "insert" && op != "remove")
    throw std::invalid_argument("the operation " + files::shown(op) +
                                "; allowed: set, insert, remove, undo, redo");
  if (op == "remove" && !value.empty()) throw std::invalid_argument("a value; allowed: none with remove");
  if (value.size() > scene::yaml::kMaxBytes) throw std::invalid_argument("a value of more than 4 MiB");
  Step step;
  step.patch = op == "set"      ? document_.set(path, value)
               : op == "insert" ? document_.insert(path, value)
                                : document_.remove(path);
  step.path = path;
  Document after = documentOf(path_, patched(document_.text(), step.patch, false));
  step.before = op == "insert" ? "" : bytesAt(document_, path);
  step.after = value;
  take(std::move(after));
  steps_.resize(done_);
  steps_.push_back(std::move(step));
  ++done_;
  return finished(steps_.back(), false);
} catch (const std::exception& error) {
  std::string why = error.what();
  if (const auto* refused = dynamic_cast<const files::Refused*>(&error))
    why = refused->value + "; allowed: " + refused->allowed;
  throw std::invalid_argument(files::shown(op, 20) + " " + files::shown(path, 200) + ": " +
                              files::shown(why, 4000));
}

std::vector<Proposal> Session::propose(const std::string& object, double within) const {
  const scene::Object* self = nullptr;
  std::string known;
  for (const scene::Object& o : scene_.objects) {
    if (o.name == object) self = &o;
    known += (known.empty() ? "" : ", ") + o.name;
  }
  if (!self)
    throw std::invalid_argument(files::shown(object) + ": no object of the scene; those are " + known);
  if (!(within > 0 && within <= 1))
    throw std::invalid_argument("within: " + std::to_string(within) + ": must be > 0, at most 1 m");
  // A branch is written down as its tree.
  const auto written = [&](const std::string& name) {
    for (const TreeSource& tree : source_.trees)
      for (std::size_t i = 0; i < tree.branches.size(); ++i)
        if (branchName(tree.name, i) == name) return tree.name;
    return name;
  };
  const std::string owner = written(object), list = "/objects/" + owner + "/connect";
  std::vector<Proposal> proposals;
  for (const scene::Object& other : scene_.objects) {
    if (written(other.name) == owner || other.model == scene::ObjectModel::Rigid) continue;
    if (other.contact_triangles.empty()) continue;
    const NearestPoints nearest(other.rest_position, other.contact_triangles);
    Proposal run;
    bool open = false;
    const auto close = [&] {
      if (!open) return;
      open = false;
      ConnectRule rule;
      rule.to = other.name;
      rule.rings.first = run.first, rule.rings.last = run.last;
      rule.within = within, rule.stiffness = kTie;
      const std::string text = textOf(rule);
      run.value = document_.has(list) ? text : "[" + text + "]";
      run.path = document_.has(list) ? list + "/-" : list;
      proposals.push_back(run);
    };
    for (std::size_t r = 0; r < self->tube.rings.size(); ++r) {
      double least = std::numeric_limits<double>::infinity();
      for (const scene::Index knot : self->tube.rings[r]) {
        if (self->fixed[knot]) continue;
        least = std::min(least, std::abs(nearest(self->rest_position[knot]).distance));
      }
      if (!(least <= within)) {
        close();
        continue;
      }
      if (!open) run = {object, other.name, static_cast<int>(r), static_cast<int>(r), least, least, "", ""};
      open = true;
      run.last = static_cast<int>(r);
      run.nearest = std::min(run.nearest, least);
      run.farthest = std::max(run.farthest, least);
    }
    close();
  }
  return proposals;
}

Script readEdits(const std::string& path, const std::string& text) {
  using scene::yaml::Map;
  Map map(scene::yaml::parse(path, text));
  const Document document = documentOf(path, text);
  Script script;
  script.file = path;
  map["vest_edits"].integer(1, 1);
  if (map.has("source_hash")) script.source_hash = map["source_hash"].string();
  // Each bakes what it changes, which takes milliseconds, and more the more objects there are.
  constexpr std::size_t kMost = 2000;
  std::size_t place = 0;
  for (const auto& item : map["edits"].list()) {
    if (place == kMost)
      scene::yaml::fail(path, item.line(), "edits", "more than " + std::to_string(kMost),
                        "at most " + std::to_string(kMost) + " in a file");
    Map edit(item);
    Script::Line line;
    line.line = item.line();
    line.op = edit["op"].oneOf({"set", "insert", "remove", "undo", "redo"});
    const std::string at = "/edits/" + std::to_string(place++);
    if (edit.has("path")) line.path = edit["path"].string();
    if (edit.has("value")) line.value = document.bytes(at + "/value");
    if (edit.has("hash")) line.hash = edit["hash"].string();
    edit.finish();
    script.edits.push_back(std::move(line));
  }
  map.finish();
  return script;
}

std::string editsText(const std::vector<Edit>& log) {
  std::string text = "vest_edits: 1\n";
  if (log.size() == 1) return text + "source_hash: \"" + log[0].hash + "\"\nedits: []\n";
  for (const Edit& edit : log) {
    if (edit.op == "open") {
      text += "source_hash: \"" + edit.hash + "\"\nedits:\n";
      continue;
    }
    const bool stepping = edit.op == "undo" || edit.op == "redo";
    text += "  - {op: " + edit.op;
    if (!stepping) text += ", path: " + quoted(edit.path);
    if (edit.op == "set" || edit.op == "insert") text += ", value: " + inOneLine(edit.after);
    text += ", hash: \"" + edit.hash + "\"}\n";
  }
  return text;
}

void play(const Script& script, Session& session) {
  const auto compare = [&](const std::string& hash, int line, const std::string& field) {
    if (!hash.empty() && hash != session.hash())
      scene::yaml::fail(script.file, line, field, hash,
                        "allowed: the document's, which is " + session.hash());
  };
  compare(script.source_hash, 0, "source_hash");
  constexpr std::size_t kMostKnots = 2000000;  // baked by all edits (assumed): a minute or two
  std::size_t knots = 0;
  for (const Script::Line& edit : script.edits) {
    if (knots > kMostKnots)
      scene::yaml::fail(script.file, edit.line, "edits", std::to_string(knots) + " knots were baked so far",
                        "at most " + std::to_string(kMostKnots) + " by one file: fewer edits, or two files");
    try {
      session.apply(edit.op, edit.path, edit.value);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(files::shown(script.file, 4096) + ":" + std::to_string(edit.line) + ": " +
                                  error.what());
    }
    compare(edit.hash, edit.line, "hash");
    for (const std::string& name : session.rebuilt())
      for (const scene::Object& object : session.scene().objects)
        if (object.name == name) knots += object.position.size();
  }
}

std::string save(const Session& session, const std::string& directory) {
  namespace fs = std::filesystem;
  const fs::path file = fs::absolute(session.path());
  writeScene(session.scene(), directory, file.filename().string(), session.text());
  copyParts(session.source(), file.parent_path().string(), directory);
  return directory + "/" + session.source().name + ".yaml";
}

}  // namespace vest::modelling
