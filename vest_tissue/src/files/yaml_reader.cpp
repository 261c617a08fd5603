#include "vest_tissue/files/yaml_reader.h"

#include <cstdio>
#include <sstream>
#include <stdexcept>

#include "vest_instruments/files/strict_yaml.h"

namespace vest::scene::yaml {
namespace {

std::string format(double value) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%g", value);
  return buffer;
}

}  // namespace

void fail(const std::string& file, int line, const std::string& field, const std::string& value,
          const std::string& allowed) {
  throw std::invalid_argument(files::shown(file, 4096) + (line > 0 ? ":" + std::to_string(line) : "") + ": " +
                              files::shown(field, 200) + ": " + files::shown(value) + ": " +
                              files::shown(allowed, 4096));
}

std::string readFile(const std::string& path, std::size_t max_bytes) try {
  return files::read(path, max_bytes);
} catch (const files::Refused& why) {
  fail(path, why.line, why.field, why.value, "allowed: " + why.allowed);
}

std::string resolve(const std::string& directory, const std::string& relative, const std::string& file,
                    int line, const std::string& field) {
  const std::string allowed =
      "must be a relative path below the scene's folder (no '..', no '/' in front, no URL)";
  if (relative.empty() || relative[0] == '/' || relative[0] == '~' ||
      relative.find(':') != std::string::npos || relative.find('\\') != std::string::npos ||
      relative.find('\0') != std::string::npos) {
    fail(file, line, field, relative, allowed);
  }
  std::stringstream parts(relative);
  for (std::string part; std::getline(parts, part, '/');) {
    if (part == ".." || part.empty()) fail(file, line, field, relative, allowed);
  }
  return directory + "/" + relative;
}

std::string Value::text() const {
  if (!node_.IsDefined() || node_.IsNull()) return "nothing";
  if (node_.IsScalar()) return node_.Scalar();
  if (node_.IsMap()) return "a mapping";
  if (node_.size() != 3) return "a list";
  std::string all;  // a vector as it stands
  for (const auto& item : node_) {
    if (!item.IsScalar()) return "a list";
    all += (all.empty() ? "[" : ", ") + item.Scalar();
  }
  return all + "]";
}

void Value::fail(const std::string& allowed) const {
  yaml::fail(file_, line(), field_, text(), allowed);
}

std::string Value::string() const {
  if (!node_.IsScalar()) fail("must be a text");
  return node_.Scalar();
}

std::string Value::name() const {
  const std::string word = string();
  bool good = !word.empty() && word.size() <= 64 && word[0] != '.';
  for (const char c : word) {
    good = good && ((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                    c == '.' || c == '-');
  }
  if (!good) fail("must be 1 to 64 of letters, digits, '_', '.', '-', and begin with no '.'");
  return word;
}

bool Value::boolean() const {
  const std::string word = string();
  if (word != "true" && word != "false") fail("must be true or false");
  return word == "true";
}

double Value::number(double least, double most) const {
  const std::string allowed = "must be a number from " + format(least) + " to " + format(most);
  if (!node_.IsScalar()) fail(allowed);
  double value = 0;
  if (!files::parseNumber(node_.Scalar(), value) || value < least || value > most) fail(allowed);
  return value;
}

double Value::positive() const {
  const double value = number(-1e30, 1e30);
  if (!(value > 0)) fail("must be a number > 0");
  return value;
}

std::uint32_t Value::integer(std::uint32_t least, std::uint32_t most) const {
  const std::string allowed =
      "must be a whole number from " + std::to_string(least) + " to " + std::to_string(most);
  if (!node_.IsScalar()) fail(allowed);
  const std::string& word = node_.Scalar();
  if (word.empty() || word.size() > 10 || word.find_first_not_of("0123456789") != std::string::npos)
    fail(allowed);
  const unsigned long long value = std::stoull(word);
  if (value < least || value > most) fail(allowed);
  return static_cast<std::uint32_t>(value);
}

Eigen::Vector3d Value::vector3() const {
  const std::string allowed = "must be a list of 3 numbers";
  if (!node_.IsSequence() || node_.size() != 3) fail(allowed);
  const auto items = list();
  return {items[0].number(-1e9, 1e9), items[1].number(-1e9, 1e9), items[2].number(-1e9, 1e9)};
}

std::vector<Value> Value::list() const {
  if (!node_.IsSequence()) fail("must be a list");
  std::vector<Value> items;
  for (std::size_t i = 0; i < node_.size(); ++i)
    items.emplace_back(file_, field_ + "[" + std::to_string(i) + "]", node_[i]);
  return items;
}

std::string Value::oneOf(const std::vector<std::string>& words) const {
  std::string allowed = "must be one of";
  for (const auto& word : words) {
    if (node_.IsScalar() && node_.Scalar() == word) return word;
    allowed += " " + word;
  }
  fail(allowed);
}

Map::Map(const Value& value) : value_(value) {
  if (!value.isMap()) value.fail("must be a mapping");
  std::set<std::string> known;
  for (const auto& entry : value.node()) {
    if (!entry.first.IsScalar()) Value(value.file(), value.field(), entry.first).fail("keys must be words");
    if (!known.insert(entry.first.Scalar()).second) {
      Value(value.file(), value.field(), entry.first).fail("key stands twice");
    }
  }
}

bool Map::has(const std::string& key) {
  asked_.insert(key);
  return static_cast<bool>(value_.node()[key]);
}

Value Map::operator[](const std::string& key) {
  const std::string field = value_.field().empty() ? key : value_.field() + "." + key;
  if (!has(key)) yaml::fail(value_.file(), value_.line(), field, "missing", "is required");
  return Value(value_.file(), field, value_.node()[key]);
}

void Map::only(const std::vector<std::string>& keys) {
  asked_.insert(keys.begin(), keys.end());
  finish();
}

void Map::finish() const {
  for (const auto& entry : value_.node()) {
    const std::string key = entry.first.Scalar();
    if (asked_.count(key)) continue;
    std::string allowed = "unknown key; known are";
    for (const auto& word : asked_) allowed += " " + word;
    Value(value_.file(), value_.field().empty() ? key : value_.field() + "." + key, entry.first)
        .fail(allowed);
  }
}

Value parse(const std::string& file, const std::string& text) {
  if (text.size() > kMaxBytes) {
    fail(file, 0, "file", std::to_string(text.size()) + " bytes",
         "at most " + std::to_string(kMaxBytes) + " bytes");
  }
  try {
    const YAML::Node root = files::parseYaml(text);
    if (!root.IsMap()) fail(file, 1, "document", "no mapping", "must be a mapping");
    return Value(file, "", root);
  } catch (const files::Refused& why) {
    fail(file, why.line, why.field, why.value, "allowed: " + why.allowed);
  }
}

}  // namespace vest::scene::yaml
