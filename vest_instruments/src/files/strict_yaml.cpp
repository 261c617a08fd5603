#include "vest_instruments/files/strict_yaml.h"

#include <algorithm>
#include <sstream>

#include <yaml-cpp/eventhandler.h>

namespace vest::files {
namespace {

/// The parser keeps every sign of a flow list until the list ends, 100 bytes and more each: they are counted
/// before it sees any. yaml-cpp 0.6, of Ubuntu 20.04, takes all memory for "[a:]", and a 4 ends the text to
/// it.
void countSigns(const std::string& text, std::size_t most) {
  std::size_t signs = 0;
  int line = 1;
  char before = 0;
  for (const char c : text) {
    line += c == '\n';
    if (before == ':' && c == ']') throw Refused(line, "document", "':]'", "a space between the two");
    before = c;
    // YAML 1.2, 5.1: printable characters.
    if (c >= 0 && c < 0x20 && c != '\n' && c != '\t' && c != '\r')
      throw Refused(line, "document", "a control character", "text");
    signs += c == ',' || c == '[' || c == '{' || c == ':' || c == '?' || c == '\n';
    if (signs > most)
      throw Refused(line, "document", "more than " + std::to_string(most) + " values or lines",
                    "at most as many (large tables belong in files of their own)");
  }
}

class Scan : public YAML::EventHandler {
 public:
  explicit Scan(const YamlLimits& limits) : limits_(limits) {}
  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) refuse(mark, "a second document ('---')", "one document");
  }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { value(mark, "", anchor); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    refuse(mark, "an alias", "no anchors and aliases");
  }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string&) override {
    value(mark, tag, anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    value(mark, tag, anchor);
    deeper(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    value(mark, tag, anchor);
    deeper(mark);
  }
  void OnMapEnd() override { --depth_; }

 private:
  [[noreturn]] static void refuse(const YAML::Mark& mark, const std::string& what,
                                  const std::string& allowed) {
    throw Refused(mark.line + 1, "document", what, allowed);
  }
  void value(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor) {
    if (anchor != 0) refuse(mark, "an anchor", "no anchors and aliases");
    // "?" is what a plain value says of itself, "!" a quoted one.
    if (!tag.empty() && tag != "?" && tag != "!") refuse(mark, "the tag " + tag, "no tags");
    if (++values_ > limits_.values)
      refuse(mark, "more than " + std::to_string(limits_.values) + " values", "at most as many");
  }
  void deeper(const YAML::Mark& mark) {
    if (++depth_ > limits_.depth)
      refuse(mark, "nesting deeper than " + std::to_string(limits_.depth),
             "at most " + std::to_string(limits_.depth) + " levels");
  }
  YamlLimits limits_;
  std::size_t values_ = 0;
  int depth_ = 0, documents_ = 0;
};

}  // namespace

YAML::Node parseYaml(const std::string& text, const YamlLimits& limits) try {
  countSigns(text, 2 * limits.values);
  // To yaml-cpp, the end of a text behind a line's end closes a quote. It does not behind a comment.
  std::istringstream stream(text + "\n#");
  YAML::Parser parser(stream);
  Scan scan(limits);
  while (parser.HandleNextDocument(scan)) {
  }
  // yaml-cpp 0.6, again: "{file:" at the end of a text.
  return YAML::Load(!text.empty() && text.back() == ':' ? text + '\n' : text);
} catch (const YAML::Exception& error) {
  const std::string before(text, 0, text.find_last_not_of(" \n") + 1);
  const int last = 1 + static_cast<int>(std::count(before.begin(), before.end(), '\n'));
  throw Refused(std::min(error.mark.line + 1, last), "document", error.msg, "well-formed YAML");
}

}  // namespace vest::files
