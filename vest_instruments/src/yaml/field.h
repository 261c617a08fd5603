/// Strict reading of small YAML files: whatever is refused names file, field, value and what is allowed.
#pragma once

#include <initializer_list>
#include <string>

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>

namespace vest::yaml {

/// A node together with where it stands. Every method throws files::FileError.
struct Field {
  const std::string& file;
  std::string path;
  YAML::Node node;

  [[noreturn]] void refuse(const std::string& value, const std::string& allowed) const;
  std::string text() const;
  /// A map with these keys alone, each at most once.
  void onlyKeys(std::initializer_list<const char*> keys) const;
  /// Of a map; anything else is refused.
  bool has(const char* key) const;
  /// Must be there.
  Field at(const char* key) const;
  Field element(int i) const { return {file, path + "[" + std::to_string(i) + "]", node[i]}; }
  double number(double lower, double upper) const;
  Eigen::Vector3d vector(double lower, double upper) const;
  /// One of these words.
  std::string word(std::initializer_list<const char*> allowed) const;
  /// A text that is not empty.
  std::string scalar(const char* allowed) const;
};

/// Reads a file of at most 64 KiB, nested at most 8 deep (files/strict_yaml.h). `path` must outlive it.
/// @throws files::FileError
Field loadFile(const std::string& path);

}  // namespace vest::yaml
