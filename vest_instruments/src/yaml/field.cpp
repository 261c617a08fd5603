#include "field.h"

#include <sstream>

#include "vest_instruments/files/file_error.h"
#include "vest_instruments/files/strict_yaml.h"

namespace vest::yaml {

void Field::refuse(const std::string& value, const std::string& allowed) const {
  throw files::FileError(files::shown(file, 4096) + ": " +
                         (path.empty() ? "" : files::shown(path, 200) + ": ") + files::shown(value, 100) +
                         "; allowed: " + files::shown(allowed, 4096));
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

bool Field::has(const char* key) const {
  if (!node.IsMap()) refuse("not a map", "a map of keys");
  return static_cast<bool>(node[key]);
}

Field Field::at(const char* key) const {
  if (!node.IsMap()) refuse("not a map", "a map of keys");
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

Field loadFile(const std::string& path) try {
  constexpr std::size_t kMost = 64 * 1024;  // the shipped file has 2 kB
  files::YamlLimits limits;
  limits.depth = 8;
  return {path, "", files::parseYaml(files::read(path, kMost), limits)};
} catch (const files::Refused& why) {
  throw files::FileError(files::shown(path, 4096) + ": " +
                         (why.line > 0 ? "line " + std::to_string(why.line) : why.field) + ": " +
                         files::shown(why.value) + "; allowed: " + why.allowed);
}

}  // namespace vest::yaml
