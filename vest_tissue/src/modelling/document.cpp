#include "vest_tissue/modelling/document.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include "vest_instruments/files/read.h"
#include "vest_instruments/files/strict_yaml.h"

namespace vest::modelling {
namespace {

using Node = Document::Node;
using NodeKind = Document::Node::Kind;

constexpr std::size_t kNone = std::string::npos;
constexpr std::size_t kWidth = 110;  // signs of a line that is written

int lineOf(const std::string& text, std::size_t at) {
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

std::size_t lineStart(const std::string& text, std::size_t at) {
  const std::size_t before = at == 0 ? kNone : text.rfind('\n', at - 1);
  return before == kNone ? 0 : before + 1;
}

/// Behind the line's end.
std::size_t lineEnd(const std::string& text, std::size_t at) {
  const std::size_t end = text.find('\n', at);
  return end == kNone ? text.size() : end + 1;
}

bool isBlank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

/// The next sign that is neither blank nor part of a comment, nor one of `passed`.
std::size_t nextSign(const std::string& text, std::size_t at, char passed = ' ') {
  while (at < text.size()) {
    const bool comment = text[at] == '#' && (at == 0 || isBlank(text[at - 1]) || text[at - 1] == passed);
    if (comment)
      at = lineEnd(text, at);
    else if (isBlank(text[at]) || text[at] == passed)
      ++at;
    else
      return at;
  }
  return text.size();
}

/// Takes the parser's events and the places that they tell, and finds where each value ends.
class Builder : public YAML::EventHandler {
 public:
  explicit Builder(const std::string& text)
      : text_(text), shift_(text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0) {}

  Node root;

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { refuse(at(mark), "an alias", "none"); }
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(std::min(at(mark), text_.size()), "a key without value", "a value, [] or {}");
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                const std::string& word) override {
    const std::size_t begin = at(mark);
    const std::size_t end = endOfScalar(begin, word);
    if (!open_.empty() && top().kind == NodeKind::Map && !keyed()) {
      const std::size_t line = lineStart(text_, begin);
      for (std::size_t i = begin; i-- > line;) {
        if (text_[i] == '?') refuse(begin, "a key behind ?", "key: value");
        if (!isBlank(text_[i])) break;
      }
      top().keys.push_back(begin);
      top().names.push_back(word);
      return;
    }
    Node node;
    node.begin = begin;
    node.end = end;
    node.word = word;
    close(std::move(node));
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value style) override {
    start(mark, NodeKind::List, style);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value style) override {
    start(mark, NodeKind::Map, style);
  }
  void OnSequenceEnd() override { finish(']'); }
  void OnMapEnd() override { finish('}'); }

 private:
  [[noreturn]] void refuse(std::size_t at, const std::string& what, const std::string& allowed) const {
    throw files::Refused(lineOf(text_, std::min(at, text_.size())), "document", what, allowed);
  }
  std::size_t at(const YAML::Mark& mark) const {
    const std::size_t place = shift_ + static_cast<std::size_t>(std::max(mark.pos, 0));
    if (place > text_.size()) refuse(text_.size(), "bytes that are no UTF-8", "UTF-8");
    return place;
  }
  Node& top() { return open_.back(); }
  bool keyed() { return top().names.size() > top().children.size(); }

  std::size_t endOfScalar(std::size_t begin, const std::string& word) const {
    const char first = begin < text_.size() ? text_[begin] : '\0';
    if (first == '"' || first == '\'') {
      for (std::size_t i = begin + 1; i < text_.size(); ++i) {
        if (first == '"' && text_[i] == '\\') {
          ++i;
        } else if (text_[i] == '\n') {
          break;
        } else if (text_[i] == first) {
          if (first == '\'' && i + 1 < text_.size() && text_[i + 1] == '\'')
            ++i;
          else
            return i + 1;
        }
      }
    } else if (!word.empty() && text_.compare(begin, word.size(), word) == 0) {
      return begin + word.size();
    }
    refuse(begin, "a text over several lines, or one with bytes that are no UTF-8",
           "values in one line each");
  }
  void start(const YAML::Mark& mark, NodeKind kind, YAML::EmitterStyle::value style) {
    if (!open_.empty() && top().kind == NodeKind::Map && !keyed())
      refuse(at(mark), "a list or mapping as key", "key: value");
    Node node;
    node.kind = kind;
    node.flow = style == YAML::EmitterStyle::Flow;
    node.begin = at(mark);
    open_.push_back(std::move(node));
  }
  void finish(char closing) {
    Node node = std::move(open_.back());
    open_.pop_back();
    std::size_t end = node.children.empty() ? node.begin + 1 : node.children.back().end;
    if (node.flow) {
      end = nextSign(text_, end, ',');
      if (end >= text_.size() || text_[end] != closing)
        refuse(node.begin, "a list whose end is not found", "[a, b] or {a: b}");
      ++end;
    } else if (node.kind == NodeKind::List) {
      std::size_t from = node.begin;
      for (const Node& child : node.children) {
        const std::size_t dash = nextSign(text_, from);
        if (dash >= text_.size() || text_[dash] != '-' || dash >= child.begin)
          refuse(child.begin, "an item whose dash is not found", "- item");
        node.keys.push_back(dash);
        from = child.end;
      }
    }
    node.end = end;
    close(std::move(node));
  }
  void close(Node node) {
    if (open_.empty())
      root = std::move(node);
    else
      top().children.push_back(std::move(node));
  }

  const std::string& text_;
  std::size_t shift_;
  std::vector<Node> open_;
};

// ---- values as they are written

std::string wordOf(const YAML::Node& node) {
  const std::string& word = node.Scalar();
  const bool plain =
      !word.empty() && word != "-" && word != "---" && word != "..." && word != "~" && word != "null" &&
      word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.+-/") ==
          std::string::npos;
  if (plain) return word;
  std::string quoted = "\"";
  for (const char c : word) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      throw std::invalid_argument(files::shown(word) + ": a text with control characters; allowed: without");
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + '"';
}

std::string flowText(const YAML::Node& node) {
  if (node.IsNull()) throw std::invalid_argument("an empty value; allowed: a text, a number, [] or {}");
  if (node.IsScalar()) return wordOf(node);
  std::string all;
  if (node.IsSequence()) {
    for (const auto& item : node) all += (all.empty() ? "" : ", ") + flowText(item);
    return "[" + all + "]";
  }
  for (const auto& entry : node)
    all += (all.empty() ? "" : ", ") + flowText(entry.first) + ": " + flowText(entry.second);
  return "{" + all + "}";
}

/// A list of words or of points reads best in one line, whatever its length.
bool oneLine(const YAML::Node& node, const std::string& flow, std::size_t indent) {
  if (node.IsScalar() || node.size() == 0 || indent + flow.size() <= kWidth) return true;
  if (!node.IsSequence()) return false;
  for (const auto& item : node)
    if (item.IsMap()) return false;
  return true;
}

/// As a block whose first line begins at column `indent`.
std::string blockText(const YAML::Node& node, std::size_t indent) {
  const std::string flow = flowText(node);
  if (oneLine(node, flow, indent)) return flow;
  const std::string margin(indent, ' ');
  std::string all;
  if (node.IsSequence()) {
    for (const auto& item : node)
      all += (all.empty() ? "" : margin) + "- " + blockText(item, indent + 2) + "\n";
  } else {
    for (const auto& entry : node) {
      const std::string key = flowText(entry.first), value = flowText(entry.second);
      all += (all.empty() ? "" : margin) + key + ":";
      if (oneLine(entry.second, value, indent + key.size() + 2))
        all += " " + value + "\n";
      else
        all += "\n" + margin + "  " + blockText(entry.second, indent + 2) + "\n";
    }
  }
  all.pop_back();  // the last line's end is the caller's
  return all;
}

YAML::Node valueOf(const std::string& text) {
  files::YamlLimits limits;
  limits.depth = 16;
  limits.values = 20000;
  return files::parseYaml(text, limits);
}

/// In one line; a word as it was typed: 0.0100 stays 0.0100, and quotes stay.
std::string lineText(const YAML::Node& parsed, const std::string& value) {
  const std::string text = flowText(parsed);
  if (!parsed.IsScalar() || value.find_first_of("\n\r#") != kNone) return text;
  const std::size_t first = value.find_first_not_of(" \t"), last = value.find_last_not_of(" \t");
  const bool as_typed = first != kNone && (value[first] == '"' || value[first] == '\'' || text[0] != '"');
  return as_typed ? value.substr(first, last - first + 1) : text;
}

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::invalid_argument(files::shown(path, 200) + ": " + what);
}

std::string known(const Node& node) {
  if (node.kind == NodeKind::Scalar) return "a value";
  if (node.kind == NodeKind::List)
    return node.children.empty() ? "an empty list" : "0 to " + std::to_string(node.children.size() - 1);
  std::string all;
  for (const std::string& name : node.names) all += (all.empty() ? "" : ", ") + name;
  return all.empty() ? "an empty mapping" : all;
}

std::size_t placeOf(const std::string& word) {
  if (word.empty() || word.size() > 6 || word.find_first_not_of("0123456789") != std::string::npos)
    return kNone;
  return static_cast<std::size_t>(std::stoul(word));
}

std::size_t childOf(const Node& node, const std::string& word) {
  if (node.kind == NodeKind::Map) {
    const auto found = std::find(node.names.begin(), node.names.end(), word);
    return found == node.names.end() ? kNone : static_cast<std::size_t>(found - node.names.begin());
  }
  if (node.kind == NodeKind::Scalar) return kNone;
  for (std::size_t i = 0; i < node.children.size(); ++i) {
    const Node& item = node.children[i];
    for (std::size_t k = 0; k < item.names.size(); ++k)
      if (item.names[k] == "name" && item.children[k].word == word) return i;
  }
  const std::size_t place = placeOf(word);
  return place < node.children.size() ? place : kNone;
}

}  // namespace

std::string inOneLine(const std::string& value) {
  return lineText(valueOf(value), value);
}

std::string quoted(const std::string& text) {
  YAML::Node node;
  node = text;
  return wordOf(node);
}

/// Where a path leads: the value, or the list or mapping that has no such value yet.
struct Document::Place {
  const Node* parent = nullptr;
  const Node* above = nullptr;  ///< of the parent
  std::size_t child = kNone, parent_child = kNone;
  std::string last;
};

Document::Document(std::string text) : text_(std::move(text)) {
  files::parseYaml(text_);  // what is refused anywhere, and the limits
  Builder builder(text_);
  std::istringstream stream(text_);
  YAML::Parser parser(stream);
  parser.HandleNextDocument(builder);
  root_ = std::move(builder.root);
  if (root_.kind != NodeKind::Map) throw files::Refused(1, "document", "no mapping", "key: value");
}

Document::Place Document::find(const std::string& path) const {
  if (path.empty() || path[0] != '/')
    fail(path, "a path; allowed: /key/key/place, e.g. /objects/tube/material");
  Place place;
  const Node* node = &root_;
  std::stringstream words(path.substr(1));
  std::string word, walked;
  bool any = false;
  while (std::getline(words, word, '/')) {
    if (any) {
      if (place.child == kNone)
        fail(path, walked + " is not there; allowed: " + files::shown(known(*place.parent), 1000));
      place.above = place.parent;
      place.parent_child = place.child;
      node = &node->children[place.child];
    }
    any = true;
    place.parent = node;
    place.child = childOf(*node, word);
    place.last = word;
    walked += "/" + files::shown(word);
  }
  if (!any || path.back() == '/') fail(path, "a path; allowed: /key/key/place without a slash at its end");
  return place;
}

bool Document::has(const std::string& path) const {
  try {
    return find(path).child != kNone;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

std::string Document::bytes(const std::string& path) const {
  const Place place = find(path);
  if (place.child == kNone) fail(path, "is not there; allowed: " + files::shown(known(*place.parent), 1000));
  const Node& node = place.parent->children[place.child];
  const bool block = !node.flow && node.kind != NodeKind::Scalar;
  return std::string(block ? node.begin - lineStart(text_, node.begin) : 0, ' ') +
         text_.substr(node.begin, node.end - node.begin);
}

std::size_t Document::colonOf(const Node& map, std::size_t child) const {
  return text_.find(':', map.keys[child] + map.names[child].size());
}

Patch Document::set(const std::string& path, const std::string& value) const {
  const Place place = find(path);
  const YAML::Node parsed = valueOf(value);
  const Node& parent = *place.parent;
  if (place.child != kNone) {
    const Node& node = parent.children[place.child];
    const std::size_t column = node.begin - lineStart(text_, node.begin);
    const bool block = !node.flow && node.kind != NodeKind::Scalar && !parsed.IsScalar();
    return {node.begin, text_.substr(node.begin, node.end - node.begin),
            block ? blockText(parsed, column) : lineText(parsed, value)};
  }
  if (parent.kind != NodeKind::Map)
    fail(path, "is not there; allowed: " + files::shown(known(parent), 1000) + " (insert adds to a list)");
  const std::string key = quoted(place.last);
  if (parent.flow) {
    const bool first = parent.children.empty();
    const std::size_t at = first ? parent.begin + 1 : parent.children.back().end;
    return {at, "", (first ? "" : ", ") + key + ": " + flowText(parsed)};
  }
  const std::size_t column = parent.begin - lineStart(text_, parent.begin);
  const std::size_t at = lineEnd(text_, parent.children.back().end);
  const std::string margin(column, ' '), flow = flowText(parsed);
  std::string text = margin + key + ":";
  if (oneLine(parsed, flow, column + key.size() + 2))
    text += " " + flow + "\n";
  else
    text += "\n" + margin + "  " + blockText(parsed, column + 2) + "\n";
  return {at, "", (at > 0 && text_[at - 1] != '\n' ? "\n" : "") + text};
}

Patch Document::insert(const std::string& path, const std::string& value) const {
  const Place place = find(path);
  const Node& list = *place.parent;
  if (list.kind != NodeKind::List)
    fail(path, "is no place of a list; allowed: a list's place, or set for a key");
  const std::size_t count = list.children.size();
  const std::size_t wanted = place.last == "-"      ? count
                             : place.child != kNone ? place.child
                                                    : placeOf(place.last);
  if (wanted > count)
    fail(path, "is no place of the list; allowed: 0 to " + std::to_string(count) + ", or -");
  const YAML::Node parsed = valueOf(value);
  if (list.flow) {
    const std::string text = flowText(parsed);
    const bool in_block = place.above != nullptr && place.above->kind == NodeKind::Map && !place.above->flow;
    if (count == 0 && in_block && !oneLine(parsed, text, 0)) {  // the list becomes a block
      const std::size_t key = place.above->keys[place.parent_child], column = key - lineStart(text_, key);
      const std::size_t colon = colonOf(*place.above, place.parent_child);
      return {colon + 1, text_.substr(colon + 1, list.end - colon - 1),
              "\n" + std::string(column + 2, ' ') + "- " + blockText(parsed, column + 4)};
    }
    if (count == 0) return {list.begin + 1, "", text};
    if (wanted < count) return {list.children[wanted].begin, "", text + ", "};
    return {list.children.back().end, "", ", " + text};
  }
  const std::size_t line = lineStart(text_, list.keys[0]), column = list.keys[0] - line;
  if (text_.find_first_not_of(' ', line) != list.keys[0])
    fail(path, "its list begins behind other text; allowed: lists that begin on a line of their own");
  const std::string text = std::string(column, ' ') + "- " + blockText(parsed, column + 2) + "\n";
  if (wanted < count) return {lineStart(text_, list.keys[wanted]), "", text};
  const std::size_t at = lineEnd(text_, list.children.back().end);
  return {at, "", (text_[at - 1] != '\n' ? "\n" : "") + text};
}

Patch Document::remove(const std::string& path) const {
  const Place place = find(path);
  const Node& parent = *place.parent;
  if (place.child == kNone) fail(path, "is not there; allowed: " + files::shown(known(parent), 1000));
  const auto cut = [&](std::size_t begin, std::size_t end) {
    return Patch{begin, text_.substr(begin, end - begin), ""};
  };
  const std::size_t i = place.child, count = parent.children.size();
  const auto beginOf = [&](std::size_t k) {
    return parent.kind == NodeKind::Map ? parent.keys[k] : parent.children[k].begin;
  };
  const std::size_t end = parent.children[i].end;
  if (parent.flow) {
    if (i > 0) return cut(parent.children[i - 1].end, end);
    return cut(beginOf(0), count > 1 ? beginOf(1) : end);
  }
  if (count == 1) {  // an empty block cannot be written
    if (place.above == nullptr) fail(path, "is the only key; allowed: to leave one");
    const std::string empty = parent.kind == NodeKind::Map ? "{}" : "[]";
    if (place.above->kind == NodeKind::Map && !place.above->flow) {
      const std::size_t colon = colonOf(*place.above, place.parent_child);
      return {colon + 1, text_.substr(colon + 1, parent.end - colon - 1), " " + empty};
    }
    return {parent.begin, text_.substr(parent.begin, parent.end - parent.begin), empty};
  }
  const std::size_t sign = parent.keys[i], line = lineStart(text_, sign);
  if (text_.find_first_not_of(' ', line) == sign) return cut(line, lineEnd(text_, end));
  if (i + 1 < count) return cut(beginOf(i), beginOf(i + 1));  // shares its line with the dash of a list
  fail(path, "shares its line with other text; allowed: an item on a line of its own");
}

}  // namespace vest::modelling
