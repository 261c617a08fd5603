#include "vest_tissue/modelling/library.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "vest_instruments/files/read.h"
#include "vest_tissue/files/yaml_reader.h"
#include "vest_tissue/material/database.h"
#include "vest_tissue/modelling/fields.h"
#include "vest_tissue/modelling/handles.h"
#include "vest_tissue/scene/world.h"
#include "vest_tissue/volume/transfer_table.h"

namespace vest::modelling {
namespace {

namespace fs = std::filesystem;
using scene::yaml::Map;
using Node = Document::Node;

void addMaterials(const LibraryEntry& like, std::vector<LibraryEntry>& entries) {
  for (const material::Tissue& tissue : material::readDatabase(like.file).tissues) {
    LibraryEntry entry = like;
    entry.kind = "material";
    entry.name = tissue.name;
    const material::Quantity& e = tissue.at("youngs_modulus");
    char about[80];
    std::snprintf(about, sizeof about, "Young's modulus %.6g Pa", e.value);
    entry.about = about;
    entry.source = (e.assumed ? "assumed: " : "") + e.source;
    entries.push_back(entry);
  }
}

/// A text in which names of objects are others.
std::string renamed(const Document& object, const std::map<std::string, std::string>& names) {
  static const std::set<std::string> kRefers = {"name", "mirror_of", "on", "to", "of", "outside"};
  std::vector<std::pair<std::size_t, const Node*>> found;
  const auto look = [&](const auto& self, const Node& node) -> void {
    for (std::size_t i = 0; i < node.children.size(); ++i) {
      const Node& child = node.children[i];
      if (node.kind == Node::Kind::Map && kRefers.count(node.names[i]) != 0 && names.count(child.word) != 0)
        found.emplace_back(child.begin, &child);
      self(self, child);
    }
  };
  look(look, object.root());
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text = object.text();
  for (const auto& [begin, node] : found)
    text.replace(begin, node->end - begin, quoted(names.at(node->word)));
  return text;
}

std::string moved(const std::string& text, const Vector3& by) {
  Document object(text);
  if (by.isZero() || object.has("/mirror_of")) return text;  // a mirror follows what it mirrors
  for (const Handle& handle : handlesOf(readAlone(text))) {
    const bool at = handle.path.size() > 3 && handle.path.compare(handle.path.size() - 3, 3, "/at") == 0;
    const bool carries = handle.kind == Handle::Kind::Whole || handle.path == "/revolve/origin" ||
                         handle.path == "/tree/root" || (handle.kind == Handle::Kind::Point && at);
    if (!carries) continue;
    const Patch patch = object.set(handle.path, valueAt(handle, handle.place + by));
    std::string next = object.text();
    next.replace(patch.offset, patch.before.size(), patch.after);
    object = Document(std::move(next));
  }
  return object.text();
}

}  // namespace

std::vector<LibraryEntry> readLibrary() {
  const fs::path data = fs::path(material::databasePath()).parent_path();
  return readLibrary((data / ".." / "library" / "index.yaml").lexically_normal().string());
}

std::vector<LibraryEntry> readLibrary(const std::string& index) {
  const fs::path package = fs::path(index).parent_path() / "..";
  Map map(scene::yaml::parse(index, scene::yaml::readFile(index, scene::yaml::kMaxBytes)));
  map["vest_library"].integer(1, 1);
  std::vector<LibraryEntry> entries;
  for (const scene::yaml::Value& item : map["entries"].list()) {
    Map keys(item);
    LibraryEntry entry;
    entry.kind = keys["kind"].oneOf({"part", "scene", "materials", "table", "texture"});
    entry.name = keys["name"].name();
    const auto words = [&](const char* key) {
      std::string text = keys[key].string();
      if (text.empty()) keys[key].fail("must be said");
      return text;
    };
    entry.licence = words("licence"), entry.source = words("source"), entry.about = words("about");
    if (entry.kind != "texture" || keys.has("file")) {
      const std::string file = scene::yaml::resolve(package.string(), keys["file"].string(), index,
                                                    item.line(), keys["file"].field());
      if (!fs::exists(file)) keys["file"].fail("must be a file of this package");
      entry.file = fs::path(file).lexically_normal().string();
    }
    keys.finish();
    const fs::path picture = package / "library" / "pictures" / (entry.kind + "_" + entry.name + ".jpg");
    if (fs::exists(picture)) entry.picture = picture.lexically_normal().string();
    for (const LibraryEntry& other : entries)
      if (other.kind == entry.kind && other.name == entry.name)
        item.fail("must be there once: " + entry.kind + " " + entry.name);
    if (entry.kind == "materials")
      addMaterials(entry, entries);
    else
      entries.push_back(entry);
  }
  map.finish();
  const std::vector<std::string> order = {"part", "scene", "material", "table", "texture"};
  std::stable_sort(entries.begin(), entries.end(), [&](const LibraryEntry& a, const LibraryEntry& b) {
    return std::find(order.begin(), order.end(), a.kind) < std::find(order.begin(), order.end(), b.kind);
  });
  return entries;
}

const LibraryEntry& find(const std::vector<LibraryEntry>& entries, const std::string& name,
                         const std::string& kind) {
  const LibraryEntry* found = nullptr;
  std::string known;
  for (const LibraryEntry& entry : entries) {
    if (!kind.empty() && entry.kind != kind) continue;
    known += (known.empty() ? "" : ", ") + entry.name;
    if (entry.name != name) continue;
    if (found != nullptr)
      throw std::invalid_argument(files::shown(name) + ": there is a " + found->kind + " and a " +
                                  entry.kind + " of this name; allowed: with --kind");
    found = &entry;
  }
  if (found == nullptr)
    throw std::invalid_argument(files::shown(name) + ": is not in the library; allowed: " + known);
  return *found;
}

std::vector<std::string> faultsOf(const std::vector<LibraryEntry>& entries) {
  std::vector<std::string> faults;
  for (const LibraryEntry& entry : entries) {
    try {
      if (entry.kind == "table") volume::readTransferTable(entry.file);
      if (entry.kind == "scene") scene::loadScene(entry.file);
      if (entry.kind == "part") {
        const Materials materials = readMaterials(material::databasePath());
        Session session("source.yaml", "vest_source: 1\nname: drawn\nobjects: []\n", materials);
        for (const Script::Line& line : additions(session.document(), entry.file))
          session.apply(line.op, line.path, line.value);
      }
      if ((entry.kind == "part" || entry.kind == "scene") && entry.picture.empty())
        throw std::invalid_argument("picture: must be library/pictures/" + entry.kind + "_" + entry.name +
                                    ".jpg");
    } catch (const std::exception& error) {
      faults.push_back(entry.kind + " " + entry.name + ": " + error.what());
    }
  }
  return faults;
}

std::vector<Script::Line> additions(const Document& source, const std::string& part_file,
                                    const std::string& as, const Vector3& by) {
  const std::string text = scene::yaml::readFile(part_file, scene::yaml::kMaxBytes);
  Map part(scene::yaml::parse(part_file, text));
  part["vest_part"].integer(1, 1);
  const Document document(text);
  std::set<std::string> taken;
  for (const ObjectLine& line : objectsOf(source)) taken.insert(line.name);
  const std::vector<ObjectLine> lines = objectsOf(document);
  if (lines.empty()) part.value().fail("objects: must be one or more");
  // All names of a part get the same number. TREE_2 is a branch of TREE.
  const bool tree =
      std::any_of(lines.begin(), lines.end(), [](const ObjectLine& line) { return line.kind == "tree"; });
  std::map<std::string, std::string> names;
  for (int number = 1; names.empty(); ++number) {
    const std::string end = number == 1 ? "" : (tree ? "_no" : "_") + std::to_string(number);
    for (const ObjectLine& line : lines)
      names[line.name] = (as.empty()                   ? line.name
                          : line.name == lines[0].name ? as
                                                       : as + "_" + line.name) +
                         end;
    for (const auto& [from, to] : names)
      if (taken.count(to) != 0) {
        names.clear();
        break;
      }
  }
  std::vector<Script::Line> edits;
  const bool listed = source.has("/objects");
  std::string all;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const Document object(document.bytes("/objects/" + std::to_string(i)));
    const std::string value = inOneLine(moved(renamed(object, names), by));
    all += (all.empty() ? "" : ", ") + value;
    if (listed) edits.push_back({"insert", "/objects/-", value, "", 0});
  }
  if (!listed) edits.push_back({"set", "/objects", "[" + all + "]", "", 0});
  return edits;
}

}  // namespace vest::modelling
