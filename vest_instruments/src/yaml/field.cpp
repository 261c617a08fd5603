#include "field.h"

#include <fstream>
#include <sstream>

#include "vest_instruments/kinematics/trainer_box.h"

namespace vest::yaml {

using kinematics::LayoutError;

void Field::refuse(const std::string& value, const std::string& allowed) const {
  throw LayoutError(file + ": " + (path.empty() ? "" : path + ": ") + value + "; allowed: " + allowed);
}

std::string Field::text() const {
  std::ostringstream out;
  out << node;
  return out.str();
}

void Field::onlyKeys(std::initializer_list<const char*> keys) const {
  if (!node.IsMap()) refuse("not a map", "a map of keys");
  std::string known;
  for (const char* k : keys) known += (known.empty() ? "" : ", ") + std::string(k);
  for (auto it = node.begin(); it != node.end(); ++it) {
    if (!it->first.IsScalar()) refuse("a key that is no word", known);
    const std::string key = it->first.Scalar();
    bool found = false;
    int count = 0;
    for (const char* k : keys) found = found || key == k;
    for (auto other = node.begin(); other != node.end(); ++other) {
      if (other->first.IsScalar() && other->first.Scalar() == key) ++count;
    }
    if (!found) refuse("unknown key '" + key + "'", known);
    if (count > 1) refuse("key '" + key + "' given twice", "each key once");
  }
}

Field Field::at(const char* key) const {
  Field child{file, path.empty() ? key : path + "." + key, node[key]};
  if (!child.node) child.refuse("missing", "it must be given");
  return child;
}

double Field::number(double lower, double upper) const {
  double value = 0.0;
  try {
    value = node.as<double>();
  } catch (const YAML::Exception&) {
    refuse("'" + text() + "' is no number", "a number");
  }
  if (!(value >= lower && value <= upper)) {
    std::ostringstream allowed;
    allowed << lower << " … " << upper;
    refuse(text(), allowed.str());
  }
  return value;
}

Eigen::Vector3d Field::vector(double lower, double upper) const {
  if (!node.IsSequence() || node.size() != 3) refuse("'" + text() + "'", "three numbers [x, y, z]");
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) v[i] = element(i).number(lower, upper);
  return v;
}

std::string Field::word(std::initializer_list<const char*> allowed) const {
  std::string known;
  for (const char* k : allowed) {
    if (node.IsScalar() && node.Scalar() == k) return k;
    known += (known.empty() ? "" : ", ") + std::string(k);
  }
  refuse("'" + text() + "'", known);
}

std::string Field::scalar(const char* allowed) const {
  if (!node.IsScalar() || node.Scalar().empty()) refuse("'" + text() + "'", allowed);
  return node.Scalar();
}

namespace {

std::string readText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw LayoutError(path + ": cannot be read; allowed: a readable YAML file");
  constexpr std::size_t kMost = 64 * 1024;  // the shipped file has 2 kB
  std::string text(kMost + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > kMost) throw LayoutError(path + ": more than 64 KiB; allowed: a file up to 64 KiB");
  int depth = 0;
  bool comment = false;
  for (const char c : text) {
    if (c == '\n') comment = false;
    if (c == '#') comment = true;
    if (comment) continue;
    if (c == '&' || c == '*') throw LayoutError(path + ": YAML anchor or alias; allowed: plain YAML");
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (depth > 8) throw LayoutError(path + ": nested deeper than 8; allowed: a plain file");
  }
  return text;
}

}  // namespace

Field loadFile(const std::string& path) {
  const std::string text = readText(path);
  Field root{path, "", {}};
  try {
    root.node = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    throw LayoutError(path + ": line " + std::to_string(e.mark.line + 1) + ": " + e.msg + "; allowed: YAML");
  }
  return root;
}

}  // namespace vest::yaml
