#include "vest_tissue/volume/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <stdexcept>
#include <unordered_map>

#include "words.h"

namespace vest::volume {
namespace {

constexpr std::size_t kTag = 1u << 30;
constexpr std::size_t kMostTetrahedra = 2000000;  // of a file (assumed)
constexpr std::size_t kMostCells = 4000000;       // of a file (assumed)

/// Nodes of an element by gmsh's number of its kind: tetrahedra, and what fills no volume; 0: neither.
std::size_t nodesOfKind(std::size_t kind) {
  static const std::map<std::size_t, std::size_t> known{{1, 2}, {2, 3},  {3, 4},   {4, 4},  {8, 3},
                                                        {9, 6}, {10, 9}, {11, 10}, {15, 1}, {16, 8}};
  const auto found = known.find(kind);
  return found == known.end() ? 0 : found->second;
}

/// Of a section of version 4.1. Tags may have gaps, but gmsh writes the least and the greatest that are
/// there.
struct Header {
  const char *what, *one;
  std::size_t blocks, entries, least, greatest;
  std::size_t are = 0, first = kTag, last = 0;  ///< seen: how many, least and greatest tag

  std::size_t tag(Words& in) {
    const std::size_t t = in.whole(one, greatest, least);
    ++are, first = std::min(first, t), last = std::max(last, t);
    return t;
  }
  void check(const Words& in) const {
    if (are != entries)
      in.fail("the header counts " + std::to_string(entries) + " " + what + ", its blocks hold " +
              std::to_string(are) + "; allowed: as many");
    if (are > 0 && (first != least || last != greatest))
      in.fail("the header says that tags of " + std::string(what) + " go from " + std::to_string(least) +
              " to " + std::to_string(greatest) + ", they go from " + std::to_string(first) + " to " +
              std::to_string(last) + "; allowed: the same");
  }
};

Header readHeader(Words& in, const char* what, const char* one) {
  Header h{what, one, in.count("the number of blocks"), in.count("the number of entries"), 0, 0};
  h.least = in.whole("the least tag", kTag);
  h.greatest = in.whole("the greatest tag", kTag);
  if (h.entries > 0 && h.least > h.greatest)
    in.fail("the least tag is above the greatest; allowed: not above");
  return h;
}

Lattice readGmsh(const std::string& path, const std::string& bytes) {
  Words in(path, bytes);
  Lattice mesh;
  std::unordered_map<std::size_t, Index> node;
  std::unordered_map<std::size_t, std::uint16_t> physical;  // of volumes, 4.1
  in.expect("$MeshFormat");
  const std::string version = in.word("the version");
  const bool old = version == "2.2";
  if (!old && version != "4.1") in.fail("version " + files::shown(version, 20) + "; allowed: 2.2 or 4.1");
  if (in.whole("the file type", 1) != 0) in.fail("a binary file; allowed: ASCII (gmsh -bin 0)");
  in.whole("the data size", 16);
  in.expect("$EndMeshFormat");
  const auto addNode = [&](std::size_t tag, const Eigen::Vector3d& x) {
    if (!node.emplace(tag, static_cast<Index>(mesh.nodes.size())).second)
      in.fail("node " + std::to_string(tag) + " stands there twice; allowed: once");
    if (mesh.nodes.size() >= kMostNodes) in.fail("more than " + std::to_string(kMostNodes) + " nodes");
    mesh.nodes.push_back(x);
  };
  const auto vector = [&] {
    Eigen::Vector3d x;
    for (int a = 0; a < 3; ++a) x[a] = in.coordinate();
    return x;
  };
  const auto element = [&](std::size_t kind, std::uint16_t label) {
    const std::size_t nodes = nodesOfKind(kind);
    if (nodes == 0)
      in.fail("element kind " + std::to_string(kind) +
              "; allowed: tetrahedra, and points, lines and faces beside them");
    std::array<Index, 4> t{};
    for (std::size_t k = 0; k < nodes; ++k) {
      const std::size_t tag = in.whole("a node", kTag);
      const auto found = node.find(tag);
      if (found == node.end())
        in.fail("an element names node " + std::to_string(tag) +
                ", which does not exist; allowed: a tag of $Nodes");
      if (k < 4) t[k] = found->second;
    }
    if (kind == 11) in.fail("a tetrahedron of second order; allowed: four nodes (gmsh -order 1)");
    if (kind != 4) return;
    if (mesh.tetrahedra.size() == kMostTetrahedra)
      in.fail("more than " + std::to_string(kMostTetrahedra) + " tetrahedra");
    mesh.tetrahedra.push_back(t);
    mesh.label.push_back(label);
  };
  std::string section;
  std::set<std::string> sections{"$MeshFormat"};
  while (in.next(section)) {
    if ((section == "$MeshFormat" || section == "$Nodes" || section == "$Elements" ||
         section == "$Entities") &&
        !sections.insert(section).second)
      in.fail(section + " twice; allowed: once");
    if (section == "$Nodes" && old) {
      const std::size_t count = in.count("the number of nodes");
      for (std::size_t i = 0; i < count; ++i) {
        const std::size_t tag = in.whole("a node", kTag);
        addNode(tag, vector());
      }
      in.expect("$EndNodes");
    } else if (section == "$Nodes") {
      Header header = readHeader(in, "nodes", "a node");
      for (std::size_t b = 0; b < header.blocks; ++b) {
        in.whole("a dimension", 3), in.whole("an entity", kTag);
        if (in.whole("parametric", 1) != 0) in.fail("parametric nodes; allowed: none");
        std::vector<std::size_t> tags(in.count("the number of nodes"));
        for (auto& tag : tags) tag = header.tag(in);
        for (const auto tag : tags) addNode(tag, vector());
      }
      header.check(in);
      in.expect("$EndNodes");
    } else if (section == "$Elements" && old) {
      const std::size_t count = in.count("the number of elements");
      for (std::size_t i = 0; i < count; ++i) {
        in.whole("an element", kTag);
        const std::size_t kind = in.whole("a kind", 200), tags = in.whole("the number of tags", 64);
        std::uint16_t label = 0;
        for (std::size_t k = 0; k < tags; ++k) {
          const std::size_t tag = in.whole("a tag", kTag);
          if (k == 0 && tag > 65535)
            in.fail("physical group " + std::to_string(tag) + "; allowed: up to 65535");
          if (k == 0) label = static_cast<std::uint16_t>(tag);
        }
        element(kind, label);
      }
      in.expect("$EndElements");
    } else if (section == "$Elements") {
      Header header = readHeader(in, "elements", "an element");
      for (std::size_t b = 0; b < header.blocks; ++b) {
        const std::size_t dimension = in.whole("a dimension", 3), entity = in.whole("an entity", kTag),
                          kind = in.whole("a kind", 200), count = in.count("the number of elements");
        const auto found = dimension == 3 ? physical.find(entity) : physical.end();
        const std::uint16_t label = found == physical.end() ? std::uint16_t{0} : found->second;
        for (std::size_t i = 0; i < count; ++i) {
          header.tag(in);
          element(kind, label);
        }
      }
      header.check(in);
      in.expect("$EndElements");
    } else if (section == "$Entities" && !old) {
      std::array<std::size_t, 4> count{};
      for (auto& n : count) n = in.count("the number of entities");
      for (std::size_t dimension = 0; dimension < 4; ++dimension) {
        for (std::size_t i = 0; i < count[dimension]; ++i) {
          const std::size_t tag = in.whole("an entity", kTag);
          for (int k = 0; k < (dimension == 0 ? 3 : 6); ++k) in.number("a coordinate");
          const std::size_t groups = in.count("the number of groups");
          for (std::size_t g = 0; g < groups; ++g) {
            const std::size_t group = in.whole("a physical group", 65535);
            if (dimension == 3 && g == 0) physical[tag] = static_cast<std::uint16_t>(group);
          }
          if (dimension == 0) continue;
          const std::size_t bounds = in.count("the number of bounding entities");
          for (std::size_t k = 0; k < bounds; ++k) in.number("a bounding entity");
        }
      }
      in.expect("$EndEntities");
    } else if (section[0] == '$') {
      const std::string end = "$End" + section.substr(1);
      std::string word;
      do {
        if (!in.next(word)) in.fail("ends within " + section);
      } while (word != end);
    } else {
      in.fail("'" + files::shown(section, 40) + "'; allowed here: a section");
    }
  }
  return mesh;
}

Lattice readVtk(const std::string& path, const std::string& bytes) {
  Words in(path, bytes);
  Lattice mesh;
  if (bytes.compare(0, 22, "# vtk DataFile Version") != 0)
    in.fail("does not begin with '# vtk DataFile Version'; allowed: legacy VTK files");
  in.skipLine();
  in.word("a title");
  in.skipLine();
  if (in.word("ASCII") != "ASCII") in.fail("not an ASCII file; allowed: legacy VTK, ASCII");
  in.expect("DATASET");
  in.expect("UNSTRUCTURED_GRID");
  std::vector<std::vector<std::size_t>> cells;
  std::vector<std::size_t> kinds;
  std::vector<std::uint16_t> labels;
  std::string key;
  bool of_cells = false;
  while (in.next(key)) {
    if (key == "POINTS") {
      const std::size_t count = in.count("the number of points");
      if (!mesh.nodes.empty()) in.fail("POINTS twice; allowed: once");
      if (count > kMostNodes) in.fail("more than " + std::to_string(kMostNodes) + " points");
      in.word("a type");
      for (std::size_t i = 0; i < count; ++i) {
        Eigen::Vector3d x;
        for (int a = 0; a < 3; ++a) x[a] = in.coordinate();
        mesh.nodes.push_back(x);
      }
    } else if (key == "CELLS") {
      const std::size_t first = in.count("the number of cells"), second = in.count("the size of the cells");
      if (!cells.empty()) in.fail("CELLS twice; allowed: once");
      if (first > kMostCells) in.fail("more than " + std::to_string(kMostCells) + " cells");
      std::string word = in.word("a cell");
      if (word == "OFFSETS") {  // 5.1
        in.word("a type");
        std::vector<std::size_t> offset(first);
        for (auto& o : offset) o = in.whole("an offset", second);
        in.expect("CONNECTIVITY");
        in.word("a type");
        std::vector<std::size_t> corner(second);
        for (auto& k : corner) k = in.whole("a point", kTag);
        if (!offset.empty() && (offset.front() != 0 || offset.back() != second))
          in.fail("offsets from " + std::to_string(offset.front()) + " to " + std::to_string(offset.back()) +
                  "; allowed: from 0 to " + std::to_string(second));
        for (std::size_t i = 0; i + 1 < first; ++i) {
          if (offset[i + 1] < offset[i]) in.fail("offsets fall; allowed: ascending");
          cells.emplace_back(corner.begin() + static_cast<std::ptrdiff_t>(offset[i]),
                             corner.begin() + static_cast<std::ptrdiff_t>(offset[i + 1]));
        }
      } else {
        std::size_t used = 0;
        for (std::size_t i = 0; i < first; ++i) {
          const double size =
              in.toNumber(i == 0 ? word : in.word("the size of a cell"), "the size of a cell");
          if (!(size >= 0.0 && size < static_cast<double>(second - used)) || size != std::floor(size))
            in.fail("a cell of " + std::to_string(size) + " points; allowed: as CELLS counts, " +
                    std::to_string(second) + " numbers in all");
          cells.emplace_back(static_cast<std::size_t>(size));
          for (auto& k : cells.back()) k = in.whole("a point", kTag);
          used += 1 + cells.back().size();
        }
        if (used != second)
          in.fail("the cells hold " + std::to_string(used) + " numbers, CELLS counts " +
                  std::to_string(second) + "; allowed: as many");
      }
    } else if (key == "CELL_TYPES") {
      if (!kinds.empty()) in.fail("CELL_TYPES twice; allowed: once");
      kinds.resize(in.count("the number of cells"));
      for (auto& k : kinds) k = in.whole("a cell type", 200);
    } else if (key == "CELL_DATA" || key == "POINT_DATA") {
      of_cells = key == "CELL_DATA";
      const std::size_t count = in.count("a count");
      if (of_cells && count != cells.size())
        in.fail("CELL_DATA of " + std::to_string(count) + "; allowed: " + std::to_string(cells.size()) +
                ", as CELLS holds");
    } else if (key == "SCALARS" && of_cells && labels.empty()) {
      in.word("a name");
      const std::string type = in.word("a type");
      const bool whole = type == "int" || type == "unsigned_char" || type == "short" ||
                         type == "unsigned_short" || type == "unsigned_int" || type == "long";
      in.skipLine();
      in.expect("LOOKUP_TABLE");
      in.word("a table");
      for (std::size_t i = 0; i < cells.size(); ++i) {
        if (whole)
          labels.push_back(static_cast<std::uint16_t>(in.whole("a label", 65535)));
        else
          in.number("a value");
      }
    } else {
      in.skipLine();  // fields that say nothing about the mesh
    }
  }
  if (kinds.size() != cells.size())
    in.fail(std::to_string(cells.size()) + " cells and " + std::to_string(kinds.size()) +
            " cell types; allowed: as many");
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (kinds[i] <= 9 || (kinds[i] >= 21 && kinds[i] <= 23)) continue;  // points, lines, faces
    if (kinds[i] != 10)
      in.fail("cell type " + std::to_string(kinds[i]) +
              "; allowed: tetrahedra (10), and points, lines and faces beside them");
    if (mesh.tetrahedra.size() == kMostTetrahedra)
      in.fail("more than " + std::to_string(kMostTetrahedra) + " tetrahedra");
    if (cells[i].size() != 4) in.fail("a tetrahedron of " + std::to_string(cells[i].size()) + " points");
    std::array<Index, 4> t{};
    for (std::size_t k = 0; k < 4; ++k) {
      if (cells[i][k] >= mesh.nodes.size())
        in.fail("a cell names point " + std::to_string(cells[i][k]) +
                ", which does not exist; allowed: 0 to " + std::to_string(mesh.nodes.size() - 1));
      t[k] = static_cast<Index>(cells[i][k]);
    }
    mesh.tetrahedra.push_back(t);
    mesh.label.push_back(labels.size() == cells.size() ? labels[i] : std::uint16_t{0});
  }
  return mesh;
}

}  // namespace

std::string endingOf(const std::string& path) {
  const auto dot = path.find_last_of('.');
  std::string ending = dot == std::string::npos ? "" : path.substr(dot + 1);
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

Lattice readTetrahedra(const std::string& path, const std::string& bytes) {
  const std::string ending = endingOf(path);
  if (ending != "msh" && ending != "vtk")
    throw std::invalid_argument(files::shown(path, 4096) + ": '." + files::shown(ending) +
                                "'; allowed: .msh (gmsh 2.2, 4.1) or .vtk (legacy)");
  Lattice mesh = ending == "msh" ? readGmsh(path, bytes) : readVtk(path, bytes);
  if (mesh.tetrahedra.empty())
    throw std::invalid_argument(files::shown(path, 4096) + ": no tetrahedra; allowed: at least one");
  return mesh;
}

}  // namespace vest::volume
