#include "vest_instruments/files/strict_json.h"

#include <algorithm>
#include <deque>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace vest::files {
namespace {

constexpr std::size_t kMostValues = 1000000;  // of a text (assumed): one takes up to 150 bytes

int lineOf(const std::string& text, std::size_t at) {
  return 1 + static_cast<int>(
                 std::count(text.begin(), text.begin() + static_cast<long>(std::min(at, text.size())), '\n'));
}

/// A key and where it stands. Most are bytes of the text; those with escapes were decoded.
struct Key {
  std::string_view name;
  std::size_t at;
};

/// Refuses nesting, endless lists and keys that stand twice, before a tree is built: RFC 8259 leaves open
/// which of two values counts, and readers differ. Texts that are no JSON may pass; the parser refuses them.
void checkKeys(const std::string& text, std::size_t deepest) {
  std::vector<std::vector<Key>> open;  // of each object or list around this place
  std::deque<std::string> decoded;
  std::size_t values = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if ((c == ',' || c == '{' || c == '[') && ++values > kMostValues)
      throw Refused(lineOf(text, i), "JSON", "", "at most " + std::to_string(kMostValues) + " values");
    if (c == '{' || c == '[') {
      if (open.size() == deepest)
        throw Refused(lineOf(text, i), "JSON", "", "nesting of at most " + std::to_string(deepest));
      open.emplace_back();
    } else if (c == '}' || c == ']') {
      if (open.empty()) return;
      auto& keys = open.back();
      std::sort(keys.begin(), keys.end(),
                [](const Key& a, const Key& b) { return a.name != b.name ? a.name < b.name : a.at < b.at; });
      const auto twice = std::adjacent_find(keys.begin(), keys.end(),
                                            [](const Key& a, const Key& b) { return a.name == b.name; });
      if (twice != keys.end())
        throw Refused(lineOf(text, twice[1].at), "key", std::string(twice->name), "each key once");
      open.pop_back();
    } else if (c == '"') {
      const std::size_t begin = i++;
      bool escapes = false;
      for (; i < text.size() && text[i] != '"'; ++i)
        if (text[i] == '\\') escapes = true, ++i;
      const std::size_t next = text.find_first_not_of(" \t\r\n", i + 1);
      if (open.empty() || next == std::string::npos || text[next] != ':') continue;
      const std::string_view raw(text.data() + begin, i + 1 - begin);
      std::string_view name = raw.substr(1, raw.size() - 2);
      if (escapes) {
        const auto value = nlohmann::json::parse(raw.begin(), raw.end(), nullptr, false);
        if (!value.is_string()) return;
        decoded.push_back(value.get<std::string>());
        name = decoded.back();
      }
      open.back().push_back({name, begin});
    }
  }
}

}  // namespace

nlohmann::json parseJson(const std::string& text, std::size_t deepest) {
  checkKeys(text, deepest);
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    throw Refused(lineOf(text, error.byte > 0 ? error.byte - 1 : 0), "JSON", "", "valid JSON (RFC 8259)");
  } catch (const nlohmann::json::out_of_range&) {
    throw Refused(0, "JSON", "", "numbers that a double can hold");
  }
}

}  // namespace vest::files
