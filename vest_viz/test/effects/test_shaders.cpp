// Protects that a shader gets the numbers that the view sets. A name that vertex and fragment program both
// declare is one number to OpenGL, and OGRE fills it from the vertex program's parameters alone: what is set
// for the fragment program then never comes. (Pools were lit by a constant instead of the exposed lamp: dull,
// dark and without mirrors.)
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace vest::effects {
namespace {

std::string read(const std::string& name) {
  std::ifstream file(std::string(VEST_VIZ_MEDIA) + "/" + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Each match's first group.
std::set<std::string> all(const std::string& text, const std::string& pattern) {
  std::set<std::string> found;
  const std::regex what(pattern);
  for (std::sregex_iterator m(text.begin(), text.end(), what), end; m != end; ++m) found.insert((*m)[1]);
  return found;
}

struct Program {
  std::string source;
  std::set<std::string> automatic;  ///< what OGRE itself fills
};

std::map<std::string, Program> programs() {
  std::map<std::string, Program> found;
  const std::string text = read("vest_viz.program");
  const std::regex head("(vertex|fragment)_program (\\S+) glsl");
  for (std::sregex_iterator m(text.begin(), text.end(), head), end; m != end; ++m) {
    const auto from = static_cast<std::size_t>(m->position());
    const std::string block = text.substr(from, text.find("\n}", from) - from);
    found[(*m)[2]] = {*all(block, "source (\\S+)").begin(), all(block, "param_named_auto (\\S+)")};
  }
  return found;
}

TEST(Shaders, NoNumberOfAFragmentProgramIsItsVertexProgramsToo) {
  const std::map<std::string, Program> known = programs();
  const std::string materials = read("vest_viz.material");
  const std::regex pass("vertex_program_ref (\\S+)[^}]*\\}\\s*fragment_program_ref (\\S+)");
  int passes = 0;
  for (std::sregex_iterator m(materials.begin(), materials.end(), pass), end; m != end; ++m, ++passes) {
    ASSERT_TRUE(known.count((*m)[1]) && known.count((*m)[2])) << m->str();
    const Program &vertex = known.at((*m)[1]), &fragment = known.at((*m)[2]);
    const std::string declared = "uniform \\S+ (\\w+)";
    const std::set<std::string> above = all(read(vertex.source), declared);
    for (const std::string& name : all(read(fragment.source), declared))
      EXPECT_TRUE(above.count(name) == 0 || (vertex.automatic.count(name) && fragment.automatic.count(name)))
          << name << " of " << vertex.source << " and " << fragment.source;
  }
  EXPECT_GE(passes, 12) << "all passes are looked at";
}

}  // namespace
}  // namespace vest::effects
