#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>
#include <Eigen/Core>

/// Strict reading of YAML: unknown and doubled keys, and what vest_instruments/files/strict_yaml.h refuses,
/// are errors; every error is one message with file, line, field, value and what is allowed.
namespace vest::scene::yaml {

constexpr std::size_t kMaxBytes = 4u << 20;

/// @throws std::invalid_argument
[[noreturn]] void fail(const std::string& file, int line, const std::string& field, const std::string& value,
                       const std::string& allowed);

/// Whole regular file as bytes. @throws std::invalid_argument if it cannot be read or is larger than
/// `max_bytes`
std::string readFile(const std::string& path, std::size_t max_bytes);

/// A relative path below the scene's directory: no "..", no absolute path, no URL. Returns
/// directory/relative.
std::string resolve(const std::string& directory, const std::string& relative, const std::string& file,
                    int line, const std::string& field);

/// A value with its place in the file.
class Value {
 public:
  Value(std::string file, std::string field, YAML::Node node)
      : file_(std::move(file)), field_(std::move(field)), node_(std::move(node)) {}

  bool isMap() const { return node_.IsMap(); }
  bool isList() const { return node_.IsSequence(); }
  bool isScalar() const { return node_.IsScalar(); }
  int line() const { return node_.Mark().line + 1; }
  const std::string& file() const { return file_; }
  const std::string& field() const { return field_; }
  std::string text() const;  ///< as it stands in the file, shortened

  std::string string() const;
  std::string name() const;  ///< letters, digits, _ . -; not empty, no . in front
  bool boolean() const;
  double number(double least, double most) const;
  double positive() const;
  std::uint32_t integer(std::uint32_t least, std::uint32_t most) const;
  Eigen::Vector3d vector3() const;
  std::vector<Value> list() const;
  std::string oneOf(const std::vector<std::string>& words) const;
  [[noreturn]] void fail(const std::string& allowed) const;
  const YAML::Node& node() const { return node_; }

 private:
  std::string file_, field_;
  YAML::Node node_;
};

/// A mapping whose keys are all to be asked for; finish() refuses the rest.
class Map {
 public:
  explicit Map(const Value& value);
  bool has(const std::string& key);
  Value operator[](const std::string& key);         ///< required
  void only(const std::vector<std::string>& keys);  ///< refuses all others at once, before anything is read
  void finish() const;
  const Value& value() const { return value_; }

 private:
  Value value_;
  std::set<std::string> asked_;
};

/// Parses text of `file`. @throws std::invalid_argument
Value parse(const std::string& file, const std::string& text);

}  // namespace vest::scene::yaml
