#include <map>
#include <set>
#include <vector>

#include "vest_instruments/urdf/description.h"

namespace vest::urdf {
namespace {

/// One tag as the scan meets it.
struct Tag {
  std::string name;
  std::string text;  ///< all between < and >
  bool closes = false;
  bool alone = false;  ///< <a/>
};

/// Walks through the tags without recursion; comments, declarations and CDATA are passed over.
class Scanner {
 public:
  explicit Scanner(const std::string& xml) : xml_(xml) {}

  bool next(Tag& tag) {
    for (;;) {
      const std::size_t open = xml_.find('<', at_);
      if (open == std::string::npos) return false;
      if (skipped(open, "<!--", "-->") || skipped(open, "<![CDATA[", "]]>") || skipped(open, "<?", "?>"))
        continue;
      if (xml_.compare(open, 2, "<!") == 0) throw UrdfError("document type declarations are not allowed");
      std::size_t end = open + 1;
      for (char quote = 0; end < xml_.size() && (quote != 0 || xml_[end] != '>'); ++end) {
        const char c = xml_[end];
        if (quote == 0 && (c == '"' || c == '\'')) {
          quote = c;
        } else if (c == quote) {
          quote = 0;
        }
      }
      if (end >= xml_.size()) throw UrdfError("a tag does not end");
      tag.text = xml_.substr(open + 1, end - open - 1);
      at_ = end + 1;
      tag.closes = !tag.text.empty() && tag.text.front() == '/';
      tag.alone = !tag.text.empty() && tag.text.back() == '/';
      const std::size_t from = tag.closes ? 1 : 0;
      tag.name = tag.text.substr(from, tag.text.find_first_of(" \t\r\n/", from) - from);
      return true;
    }
  }

 private:
  bool skipped(std::size_t open, const char* begin, const char* end) {
    const std::string b(begin), e(end);
    if (xml_.compare(open, b.size(), b) != 0) return false;
    const std::size_t stop = xml_.find(e, open + b.size());
    if (stop == std::string::npos) throw UrdfError("a comment or declaration does not end");
    at_ = stop + e.size();
    return true;
  }

  const std::string& xml_;
  std::size_t at_ = 0;
};

std::string attribute(const Tag& tag, const std::string& key) {
  std::size_t at = 0;
  while ((at = tag.text.find(key, at)) != std::string::npos) {
    const char before = at == 0 ? ' ' : tag.text[at - 1];
    std::size_t i = tag.text.find_first_not_of(" \t\r\n", at + key.size());
    at += key.size();
    if ((before != ' ' && before != '\t' && before != '\n' && before != '\r') || i == std::string::npos ||
        tag.text[i] != '=') {
      continue;
    }
    i = tag.text.find_first_of("\"'", i);
    if (i == std::string::npos) break;
    const std::size_t end = tag.text.find(tag.text[i], i + 1);
    if (end == std::string::npos) break;
    return tag.text.substr(i + 1, end - i - 1);
  }
  return {};
}

void checkTree(const std::set<std::string>& links, const std::map<std::string, std::string>& parent_of) {
  std::string root;
  for (const std::string& link : links) {
    if (parent_of.count(link) != 0) continue;
    if (!root.empty())
      throw UrdfError("links '" + root + "' and '" + link + "' both have no parent: not one tree");
    root = link;
  }
  if (root.empty())
    throw UrdfError(links.empty() ? "no links" : "every link has a parent: the joints form a cycle");
  std::set<std::string> rooted{root};
  for (const std::string& link : links) {
    std::vector<std::string> path;
    std::string at = link;
    while (rooted.count(at) == 0) {
      path.push_back(at);
      if (path.size() > links.size()) throw UrdfError("link '" + link + "' is part of a cycle of joints");
      at = parent_of.at(at);
    }
    rooted.insert(path.begin(), path.end());
  }
}

}  // namespace

void checkUrdf(const std::string& xml) {
  if (xml.size() > 4u * 1024u * 1024u) throw UrdfError("more than 4 MB of URDF");
  if (xml.find('\0') != std::string::npos) throw UrdfError("a NUL byte inside");
  Scanner scanner(xml);
  Tag tag;
  std::vector<std::string> open;
  std::set<std::string> links;
  std::map<std::string, std::string> parent_of;
  std::string joint, parent, child;
  while (scanner.next(tag)) {
    if (tag.closes) {
      if (open.empty() || open.back() != tag.name)
        throw UrdfError("</" + tag.name.substr(0, 60) + "> closes nothing");
      open.pop_back();
      if (tag.name == "joint" && open.size() == 1) {
        if (links.empty() || parent.empty() || child.empty())
          throw UrdfError("joint '" + joint + "' lacks a link");
        if (parent == child) throw UrdfError("joint '" + joint + "' joins a link with itself");
        if (!parent_of.emplace(child, parent).second) throw UrdfError("link '" + child + "' has two parents");
      }
      continue;
    }
    const std::size_t level = open.size();
    if (level == 0 && tag.name != "robot") throw UrdfError("the outermost element is not <robot>");
    if (level == 1 && tag.name == "link") {
      const std::string name = attribute(tag, "name");
      if (name.empty()) throw UrdfError("a link without a name");
      if (!links.insert(name).second) throw UrdfError("link '" + name + "' is defined twice");
    }
    if (level == 1 && tag.name == "joint") {
      joint = attribute(tag, "name");
      parent.clear();
      child.clear();
    }
    if (level == 2 && open.back() == "joint" && tag.name == "parent") parent = attribute(tag, "link");
    if (level == 2 && open.back() == "joint" && tag.name == "child") child = attribute(tag, "link");
    if (!tag.alone) open.push_back(tag.name);
    if (open.size() > 64) throw UrdfError("elements nested deeper than 64");
  }
  if (!open.empty()) throw UrdfError("<" + open.back().substr(0, 60) + "> is not closed");
  for (const auto& [c, p] : parent_of) {
    for (const std::string& link : {c, p}) {
      if (links.count(link) == 0) throw UrdfError("a joint names the unknown link '" + link + "'");
    }
  }
  checkTree(links, parent_of);
}

}  // namespace vest::urdf
