#pragma once

#include <cstddef>
#include <string>
#include <vector>

/// A YAML text that is edited by path and keeps every byte that no edit means.
namespace vest::modelling {

/// What an edit replaces: `before` at `offset` by `after`.
struct Patch {
  std::size_t offset = 0;
  std::string before, after;
};

/// Paths are keys and places of lists, each behind a slash: /objects/tube_left/tube/centre/3. An item of a
/// list is named by its key `name` where it has one, or by its place from 0; `-` is the place behind the
/// last.
class Document {
 public:
  /// @throws files::Refused (vest_instruments/files/read.h): what is no YAML, or has no place of its own in
  /// the text: empty values, block scalars, values over several lines, keys behind a `?`
  explicit Document(std::string text);

  const std::string& text() const { return text_; }
  bool has(const std::string& path) const;
  struct Node;
  const Node& root() const { return root_; }  ///< a mapping
  /// The bytes of a value; a block is given its margin, so that they are YAML by themselves.
  /// @throws std::invalid_argument: the path, and what is there instead
  std::string bytes(const std::string& path) const;

  // What to replace. @throws std::invalid_argument, files::Refused: nothing is to be done then
  Patch set(const std::string& path, const std::string& value) const;     ///< a value, or a key not yet there
  Patch insert(const std::string& path, const std::string& value) const;  ///< into a list, before that place
  Patch remove(const std::string& path) const;  ///< an item of a list, or a key with its value

  struct Node {
    enum class Kind : unsigned char { Scalar, List, Map } kind = Kind::Scalar;
    bool flow = false;  ///< [ ] or { }
    std::size_t begin = 0, end = 0;
    std::string word;               ///< of a scalar
    std::vector<std::size_t> keys;  ///< of a map, by child: where its key begins. Of a block list: the dashes
    std::vector<std::string> names;  ///< of a map, by child: its key
    std::vector<Node> children;
  };

 private:
  struct Place;
  Place find(const std::string& path) const;
  std::size_t colonOf(const Node& map, std::size_t child) const;
  std::string text_;
  Node root_;
};

/// A YAML value in one line, that set() and insert() take as they take `value`. @throws as these
std::string inOneLine(const std::string& value);
/// A text as YAML has it, quoted where it must be.
std::string quoted(const std::string& text);

}  // namespace vest::modelling
